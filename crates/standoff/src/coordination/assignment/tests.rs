use nalgebra::Matrix2;
use pathfinding::kuhn_munkres::kuhn_munkres;
use pathfinding::matrix::Matrix;

use super::local_search::{Search, improve, matching};
use super::problem::{Problem, Score, UavSet};
use super::*;
use crate::frame::{Displacement, Position};
use crate::math;

/// Switching cost in Table I.
const INERTIA: f64 = 0.5;

fn sensor() -> SensorParams {
    crate::TeamParams::paper().track.sensor
}

/// Random numbers for worlds: splitmix64.
struct Draw(u64);

impl Draw {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) % n as u64) as usize
    }

    fn about(&mut self, centre: Position, half_width_m: f64) -> Position {
        let mut one = || (self.below(1 << 30) as f64 / f64::from(1 << 29) - 1.0) * half_width_m;
        centre + Displacement::from_m(one(), one())
    }
}

fn available(id: u32, position: Position) -> AvailableUav {
    AvailableUav { uav: UavId(id), position, current_group: None }
}

struct World {
    uavs: Vec<AvailableUav>,
    groups: Vec<Vec<Position>>,
}

impl World {
    /// In a field of 2, 8 or 30 km: UAVs scattered or starting together, groups of one to ten targets within 300 m.
    fn new(kind: usize, uavs: usize, groups: usize, draw: &mut Draw) -> Self {
        let half_width_m = [1000.0, 4000.0, 15_000.0][kind / 2 % 3];
        let start = draw.about(Position::ORIGIN, half_width_m);
        let (centre, apart_m) = if kind.is_multiple_of(2) { (Position::ORIGIN, half_width_m) } else { (start, 100.0) };
        let uavs = (0..uavs as u32).map(|id| available(id, draw.about(centre, apart_m))).collect();
        let group = |_| {
            let centre = draw.about(Position::ORIGIN, half_width_m);
            (0..1 + draw.below(10)).map(|_| draw.about(centre, 150.0)).collect()
        };
        Self { uavs, groups: (0..groups).map(group).collect() }
    }

    /// On a grid so coarse that UAVs and whole groups coincide or mirror each other.
    fn tied(uavs: usize, groups: usize, draw: &mut Draw) -> Self {
        let at = |draw: &mut Draw| Position::from_m(100.0 * draw.below(3) as f64, 0.0);
        let uavs = (0..uavs as u32).map(|id| available(id, at(draw))).collect();
        let group = |_| (0..1 + draw.below(2)).map(|_| at(draw)).collect();
        Self { uavs, groups: (0..groups).map(group).collect() }
    }

    fn sites<'a>(&'a self) -> Vec<CandidateGroup<'a>> {
        let site =
            |(id, members): (u64, &'a Vec<Position>)| CandidateGroup { group: GroupId(id), members, priorities: &[] };
        (0..).zip(&self.groups).map(site).collect()
    }

    fn problem(&self) -> Problem {
        Problem::new(&self.uavs, &self.sites(), &sensor(), INERTIA)
    }

    fn groups_assigned(&self, objective: Objective) -> Vec<usize> {
        let assignments = assign(&self.uavs, &self.sites(), &sensor(), objective, INERTIA);
        assert!(
            assignments.iter().map(|assignment| assignment.uav).eq(self.uavs.iter().map(|available| available.uav))
        );
        assignments.iter().map(|assignment| assignment.group.0 as usize).collect()
    }

    /// Straightforward implementation of the rules: tries every assignment of the UAVs to groups, including ties.
    fn brute_force(&self, objective: Objective) -> Vec<usize> {
        let (n, g) = (self.uavs.len(), self.groups.len());
        let key = |groups: &Vec<usize>| {
            let size = |group| groups.iter().filter(|of| **of == group).count();
            let feasible = if n < g {
                (0..g).all(|group| size(group) <= 1)
            } else {
                (0..g).all(|group| (1..=n.div_ceil(g).max(2)).contains(&size(group)))
            };
            let covered: usize = if n < g { groups.iter().map(|group| self.groups[*group].len()).sum() } else { 0 };
            let first_takes_lower: Vec<bool> =
                (0..g).flat_map(|group| groups.iter().map(move |of| *of == group)).collect();
            feasible.then(|| (covered, self.score(groups, objective), first_takes_lower))
        };
        let nth = |index: usize| (0..n).scan(index, |rest, _| Some((*rest % g, *rest /= g).0)).collect();
        (0..g.pow(n as u32)).map(nth).max_by_key(key).unwrap()
    }

    fn score(&self, groups: &[usize], objective: Objective) -> i64 {
        let information_of = |group: usize, target: Position| {
            let uavs = self.uavs.iter().zip(groups).filter(|(_, of)| **of == group);
            uavs.map(|(available, _)| sensor().information(available.position, target)).sum::<Matrix2<f64>>()
        };
        let has_uav = |group: &usize| groups.contains(group);
        let of = |group: usize| self.groups[group].iter().map(move |target| information_of(group, *target));
        let ln = |information: Matrix2<f64>| math::ln(information.determinant().max(1e-24));
        let millionths = |ln: f64| (1e6 * ln).round() as i64;
        let groups = (0..self.groups.len()).filter(has_uav);
        match objective {
            Objective::LogDet => groups.map(|group| millionths(of(group).map(ln).sum())).sum(),
            Objective::Paper => millionths(ln(groups.flat_map(of).sum())),
        }
    }
}

/// Checks Eq. (32), (33), as restated and with the paper's objective, with enough, many and too few UAVs.
#[test]
fn the_exact_assignment_is_optimal_and_breaks_ties_in_order() {
    let mut draw = Draw(1);
    for round in 0..25 {
        for (uavs, groups) in [(1, 1), (1, 3), (2, 2), (2, 4), (3, 2), (4, 2), (5, 2), (4, 3), (5, 4), (6, 3), (3, 5)] {
            for world in [World::new(round, uavs, groups, &mut draw), World::tied(uavs, groups, &mut draw)] {
                for objective in [Objective::LogDet, Objective::Paper] {
                    let (got, best) = (world.groups_assigned(objective), world.brute_force(objective));
                    assert_eq!(got, best, "{objective:?} {:?} {:?}", world.uavs, world.groups);
                }
            }
        }
    }
}

/// Checks the erratum of Eq. (32): summed over different targets, the information is largest if lines of sight cross,
/// even if they lead to different targets, each of which is then known less well.
#[test]
fn the_objective_of_the_paper_sends_each_uav_the_longer_way() {
    let world = World {
        uavs: vec![available(0, Position::ORIGIN), available(1, Position::from_m(500.0, -600.0))],
        groups: vec![vec![Position::from_m(500.0, 0.0)], vec![Position::from_m(1000.0, -600.0)]],
    };
    assert_eq!(world.groups_assigned(Objective::LogDet), [0, 1]);
    assert_eq!(world.groups_assigned(Objective::Paper), [1, 0]);
}

#[test]
fn of_tied_assignments_the_first_group_takes_the_lower_uavs() {
    let at = |x_m| Position::from_m(x_m, 0.0);
    let world = |uavs, groups| World {
        uavs: (0..uavs).map(|id| available(id, at(0.0))).collect(),
        groups: vec![vec![at(300.0)]; groups],
    };
    assert_eq!(world(3, 2).groups_assigned(Objective::LogDet), [0, 0, 1]);
    assert_eq!(world(4, 2).groups_assigned(Objective::LogDet), [0, 0, 1, 1]);
    assert_eq!(world(2, 3).groups_assigned(Objective::LogDet), [0, 1]);
}

/// Two UAVs, and groups of 2, 3 and 2 targets: the largest group gets a UAV, and of the other two the nearer one.
#[test]
fn too_few_uavs_cover_the_most_targets_first() {
    let group = |x_m: f64, n: usize| vec![Position::from_m(x_m, 0.0); n];
    let world = World {
        uavs: vec![available(3, Position::ORIGIN), available(7, Position::from_m(0.0, 400.0))],
        groups: vec![group(900.0, 2), group(5000.0, 3), group(600.0, 2)],
    };
    let mut groups = world.groups_assigned(Objective::LogDet);
    groups.sort_unstable();
    assert_eq!(groups, [1, 2]);
}

#[test]
fn every_uav_gets_one_group_and_no_group_too_many_for_any_positions() {
    let mut draw = Draw(2);
    for (n, g) in [(2, 2), (6, 3), (3, 9), (9, 4), (12, 6), (13, 6), (14, 30), (30, 15), (31, 3), (40, 1), (20, 20)] {
        let mut world = World::new(n, n, g, &mut draw);
        world.uavs[0].position = world.groups[0][0];
        world.uavs[1].position = Position::from_m(f64::NAN, 0.0);
        world.groups[0].push(Position::from_m(f64::INFINITY, f64::NEG_INFINITY));
        world.groups[0].push(Position::from_m(-1e308, 1e308));
        if g > 1 {
            world.groups[1].clear();
        }
        for objective in [Objective::LogDet, Objective::Paper] {
            let groups = world.groups_assigned(objective);
            assert_eq!(groups, world.groups_assigned(objective));
            let sizes = (0..g).map(|group| groups.iter().filter(|of| **of == group).count());
            assert_eq!(groups.len(), n);
            assert!(sizes.clone().all(|size| size <= if n < g { 1 } else { n.div_ceil(g).max(2) }));
            assert_eq!(sizes.filter(|size| *size > 0).count(), n.min(g));
        }
    }
    assert_eq!(assign(&[], &World::new(0, 1, 1, &mut draw).sites(), &sensor(), Objective::LogDet, INERTIA), []);
    assert_eq!(assign(&[available(0, Position::ORIGIN)], &[], &sensor(), Objective::Paper, INERTIA), []);
}

#[test]
fn the_matching_is_optimal_for_any_initial_prices() {
    let mut draw = Draw(3);
    for (rows, columns, range) in
        [(1, 1, 9), (3, 3, 4), (5, 5, 100), (6, 6, 5), (2, 5, 50), (4, 6, 3), (50, 50, 1000)].repeat(50)
    {
        let mut number = || draw.below(2 * range + 1) as Score - range as Score;
        let worth: Vec<Vec<Score>> = (0..rows).map(|_| (0..columns).map(|_| number()).collect()).collect();
        let mut prices: Vec<Score> = (0..columns).map(|_| if rows == columns { number() } else { 0 }).collect();
        let chosen = matching(&worth, &mut prices);
        let total: Score = worth.iter().zip(&chosen).map(|(row, column)| row[*column]).sum();
        let (best, _) = kuhn_munkres(&Matrix::from_rows(worth.iter().cloned()).unwrap());
        assert_eq!(total, best, "{worth:?} {chosen:?}");
    }
}

/// Loss of a method compared with the optimum, in ln det per target: mean and worst, and the numbers of worlds with a
/// loss and of all worlds.
#[derive(Debug)]
struct Loss {
    worlds: usize,
    lossy: usize,
    mean: f64,
    worst: f64,
}

/// Evaluates `worlds` worlds of each of six kinds, for every number of UAVs from 6 to 12 and of groups from 2 to one
/// less.
fn loss(worlds: usize, method: impl Fn(&Problem) -> Vec<UavSet>) -> Loss {
    let mut draw = Draw(4);
    let mut losses = Vec::new();
    for (kind, uavs) in (0..6).flat_map(|kind| (6..=EXACT_UAVS_MAX).map(move |uavs| (kind, uavs))) {
        for groups in (2..uavs).flat_map(|groups| core::iter::repeat_n(groups, worlds)) {
            let world = World::new(kind, uavs, groups, &mut draw);
            let problem = world.problem();
            let lost = problem.total(&problem.exact()) - problem.total(&method(&problem));
            losses.push(1e-6 * lost as f64 / world.groups.iter().map(Vec::len).sum::<usize>() as f64);
        }
    }
    let (n, lossy) = (losses.len(), losses.iter().filter(|loss| **loss > 0.0).count());
    Loss {
        worlds: n,
        lossy,
        mean: losses.iter().sum::<f64>() / n as f64,
        worst: losses.iter().copied().fold(0.0, f64::max),
    }
}

/// Local search of the whole problem.
fn search(problem: &Problem) -> Vec<UavSet> {
    improve(problem, Search::new(problem).start(), 2000)
}

/// The greedy rounds alone, with which the search begins, lose a thousand times as much.
#[test]
fn the_loss_of_the_search_is_negligible() {
    let searched = loss(1, search);
    assert!(searched.mean < 5e-5 && searched.worst < 0.01 && searched.lossy <= 2, "{searched:?}");
    let started = loss(1, |problem| Search::new(problem).start());
    assert!(started.mean > 0.05 && started.lossy > 250, "{started:?}");
}

#[test]
#[ignore = "long: for .ci/long"]
fn the_loss_of_the_search_is_negligible_in_many_worlds() {
    let searched = loss(20, search);
    assert_eq!((searched.worlds, searched.lossy), (5880, 4), "{searched:?}");
    assert!(searched.mean < 1.6e-6 && searched.worst < 0.0053, "{searched:?}");
}

/// Loss of [`assign_changed`] compared with the search of the whole problem, as a fraction of the sum of ln det.
fn loss_of_neighbourhoods(world: &World, has_changed: &dyn Fn(usize) -> bool) -> f64 {
    let (sites, problem) = (world.sites(), world.problem());
    let assigned = assign_changed(&world.uavs, &sites, has_changed, &sensor(), Objective::LogDet, INERTIA);
    let mut uav_sets = vec![UavSet::new(); problem.groups.len()];
    for (index, assignment) in assigned.iter().enumerate() {
        let site = problem.groups.iter().position(|choice| choice.group == assignment.group).unwrap();
        uav_sets[site].push(index);
    }
    let (best, found) = (problem.total(&search(&problem)), problem.total(&uav_sets));
    (best - found) as f64 / best.abs() as f64
}

/// From nothing, and in flight after a further group has appeared.
#[test]
fn searches_of_neighbourhoods_lose_little_compared_with_a_search_of_everything() {
    let mut draw = Draw(6);
    let (mut losses, mut losses_in_flight) = (Vec::new(), Vec::new());
    for (n, g) in [(13, 6), (16, 15), (24, 24), (30, 15), (40, 20), (40, 13)] {
        for kind in 0..6 {
            let mut world = World::new(kind, n, g, &mut draw);
            losses.push(loss_of_neighbourhoods(&world, &|_| true));
            let assigned = assign(&world.uavs, &world.sites(), &sensor(), Objective::LogDet, INERTIA);
            for (uav, assignment) in world.uavs.iter_mut().zip(&assigned) {
                uav.current_group = Some(assignment.group);
            }
            if n > g {
                world.groups.push(World::new(kind, 1, 1, &mut draw).groups.swap_remove(0));
            }
            losses_in_flight.push(loss_of_neighbourhoods(&world, &|_| false));
        }
    }
    for losses in [losses, losses_in_flight] {
        let mean = losses.iter().sum::<f64>() / losses.len() as f64;
        assert!(mean < 0.005 && losses.iter().all(|loss| *loss < 0.02), "{mean} {losses:?}");
    }
}

/// Beyond Eq. (32): in flight, a UAV changes groups only if the gain exceeds the switching cost.
#[test]
fn uavs_are_not_reassigned_for_a_small_gain() {
    let at = |x_m| vec![Position::from_m(x_m, 0.0)];
    let mut world = World {
        uavs: vec![available(0, at(-10.0)[0]), available(1, at(10.0)[0])],
        groups: vec![at(-500.0), at(500.0)],
    };
    assert_eq!(world.groups_assigned(Objective::LogDet), [0, 1]);
    // Crossed, each UAV is slightly farther from its own group than from the other: not worth two reassignments.
    (world.uavs[0].current_group, world.uavs[1].current_group) = (Some(GroupId(1)), Some(GroupId(0)));
    assert_eq!(world.groups_assigned(Objective::LogDet), [1, 0]);
    // Twice the distance is.
    (world.uavs[0].position, world.uavs[1].position) = (at(-200.0)[0], at(200.0)[0]);
    assert_eq!(world.groups_assigned(Objective::LogDet), [0, 1]);
}

/// One UAV covers the group of higher total priority. One of three UAVs improves the position of the target of high
/// priority, although a third one at the other group would provide more information.
#[test]
fn priorities_weigh_the_information_about_targets() {
    let place = |x_m: f64| Position::from_m(x_m, 0.0);
    let (near, far) = (vec![place(0.0), place(10.0)], vec![place(1000.0)]);
    let groups_assigned = |uavs: &[f64], priorities: [&[f64]; 2]| {
        let uavs: Vec<_> = (0..).zip(uavs).map(|(id, x_m)| available(id, place(*x_m))).collect();
        let members = [&near, &far].into_iter().zip(priorities);
        let sites: Vec<_> = (0..)
            .map(GroupId)
            .zip(members)
            .map(|(group, (members, priorities))| CandidateGroup { group, members, priorities })
            .collect();
        let assignments = assign(&uavs, &sites, &sensor(), Objective::LogDet, INERTIA);
        assignments.iter().map(|assignment| assignment.group.0).collect::<Vec<_>>()
    };
    assert_eq!(groups_assigned(&[300.0], [&[], &[]]), [0]);
    assert_eq!(groups_assigned(&[300.0], [&[1.0, 1.0], &[2.5]]), [1]);
    let third = [-300.0, 400.0, 1300.0];
    assert_eq!(groups_assigned(&third, [&[], &[]]), [0, 0, 1]);
    assert_eq!(groups_assigned(&third, [&[1.0, 1.0], &[9.0]]), [0, 1, 1]);
}
