//! How much of the traffic is watched, and how calmly: the paper's law, all that is new, and all but one at a time.

use standoff_sim::score::{Choice, Metrics};
use standoff_sim::yardstick::yardstick;

use super::claim::{shown, signed};
use super::flights::{Flown, PAPERS_LAW, Plan, file_name, measured};
use super::improvements::difference;
use super::statistics::Estimate;
use super::streets::Streets;
use super::study::{Data, Study, Table};
use crate::failure::Failure;

/// What undoes each of what is new.
const WITHOUT: [(&str, &[&str]); 11] = [
    ("groups by need", &["groups.count=half"]),
    ("the smallest circle", &["orbit.centre=centroid"]),
    ("sensors on the middle", &["orbit.aim=centre"]),
    ("the discard of who widens most", &["groups.discard=furthest"]),
    ("the bounded motion of orbits", &["orbit.response_s=0"]),
    ("the smaller heading gain", &["guidance.heading_gain_1_s=2"]),
    ("the greater inertia", &["groups.assignment_inertia=0.5"]),
    ("the greater share of the largest orbit", &["orbit.take_back_fraction=0.9"]),
    ("a margin of none", &["orbit.margin_sds=1.645"]),
    ("the early loss of what is unseen in view", &["filter.lost_in_view_s=5"]),
    ("a search for the lost", &["groups.search=none"]),
];

/// What the tables show: metric, heading, how many of the unit shown are one of the metric's.
const SHOWN: [(&str, &str, f64); 8] = [
    ("watched_fraction", "watched (%)", 100.0),
    ("out_of_view_fraction", "out of view (%)", 100.0),
    ("position_error_m", "position error (m)", 1.0),
    ("turn_rate_saturated_fraction", "turn rate at its limit (%)", 100.0),
    ("turn_reversals_per_min", "turn reversals (1/min)", 1.0),
    ("speed_saturated_fraction", "speed at a limit (%)", 100.0),
    ("standoff_error_m_settled", "standoff error, true (m)", 1.0),
    ("reassignments_per_uav_min", "re-assignments (1/min per UAV)", 1.0),
];

/// So many of the plan's runs come to one of these: whole towns are flown.
const RUNS_PER_RUN: u32 = 20;
/// Seeds from 101 on, where the plan's are from 1 on: what is new was tuned on others.
const SEEDS_AFTER: u64 = 100;

const SMALL_TOWN: Streets = Streets { blocks: 10, cars: 30 };
const LARGE_TOWN: Streets = Streets { blocks: 20, cars: 100 };

/// Flies every mission by the paper's law, with all that is new, and with all but one.
pub(crate) fn coverage(plan: &Plan) -> Result<Study, Failure> {
    let plan =
        &Plan { runs: (plan.runs / RUNS_PER_RUN).max(2), first_seed: plan.first_seed + SEEDS_AFTER, ..plan.clone() };
    let mut found = Study::new(
        "coverage",
        "Beyond the paper: how much is watched, and how calmly",
        format!(
            "What scenarios fly that say nothing, the same without each of its new keys, and the paper's law (its printed \
             margin (16), its exact (25)): {} runs each, seeds {} to {}. Nothing was tuned on those seeds; the built-in \
             missions were among those tuned on, with others. Differences are paired by seed, with 95 % intervals. *Streets* are drawn from the seed: crossings every 150 m, cars of 5 \
             to 15 m/s that stop, turn and go on at random, 300 s. The yardstick is what greedy discs of the largest \
             orbit's footprint would watch that know every target: half as many as UAVs (the paper's number of groups), \
             and as many; it is no bound.",
            plan.runs,
            plan.first_seed,
            plan.first_seed + u64::from(plan.runs) - 1,
        ),
    );
    let choice = Choice::parse(&SHOWN.map(|(metric, ..)| metric).join(",")).map_err(Failure::running)?;
    let heads =
        ["", "paper's law", "all", "N/2 discs, moving", "N/2, placed anew", "N discs, moving", "N, placed anew"];
    let mut summary = Table::new("Watched (%), beside the yardstick:", heads);
    let (mut tables, mut data) = (Vec::new(), Vec::new());
    for (index, (name, mission)) in missions(plan).iter().enumerate() {
        let all = plan.fly(mission, choice)?;
        let papers = plan.fly(&mission.and(&PAPERS_LAW), choice)?;
        let heads = [""].into_iter().chain(SHOWN.map(|(_, head, _)| head));
        let title = format!("{name}: all, and differences from it:");
        let mut table = Table::new(title, heads);
        table.add("all", SHOWN.map(|(metric, _, unit)| mean(&all, metric).times(unit).told(shown)));
        let mut add = |number: usize, row: &str, changed: &[Metrics]| {
            let changes = SHOWN.map(|(metric, _, unit)| (difference(&all, changed, metric), unit));
            table.add(row, changes.map(|(change, unit)| change.times(unit).told(signed)));
            let numbers = SHOWN.iter().zip(changes).flat_map(|(&(metric, ..), (change, _))| {
                [mean(&all, metric).value, change.value, 0.5 * (change.high - change.low)]
            });
            data.push([index as f64, number as f64].into_iter().chain(numbers).collect());
        };
        add(0, "the paper's law", &papers);
        for (number, (row, undo)) in WITHOUT.iter().enumerate() {
            add(1 + number, &format!("without {row}"), &plan.fly(&mission.and(undo), choice)?);
        }
        tables.push(table);
        let watched = [&papers, &all].map(|runs| mean(runs, "watched_fraction"));
        let cells = watched.into_iter().chain(discs(plan, mission)?);
        summary.add(name, cells.map(|estimate| estimate.times(100.0).told(shown)));
    }
    found.tables.push(summary);
    found.tables.extend(tables);
    let mut columns = "mission,without".to_owned();
    for (metric, ..) in SHOWN {
        columns += &format!(",{metric}_all,{metric}_difference,{metric}_half_width");
    }
    found.data.push(Data::new("coverage", columns, data));
    Ok(found)
}

/// What is flown, and what it is called.
fn missions(plan: &Plan) -> Vec<(String, Flown)> {
    let streets = |town: Streets, uavs: u32| {
        let side_km = f64::from(town.blocks) * 0.15;
        let name = format!("streets of {side_km} km, {} cars, {uavs} UAVs", town.cars);
        (name, Flown::streets(town).with_uavs(uavs))
    };
    let city = |uavs: u32| (format!("`traffic/city`, {uavs} UAVs"), Flown::of("traffic/city", &[]).with_uavs(uavs));
    let own = |name: &str| (format!("`{name}`"), Flown::of(name, &[]));
    let mut missions = vec![
        streets(SMALL_TOWN, 4),
        streets(SMALL_TOWN, 8),
        streets(LARGE_TOWN, 8),
        city(2),
        city(4),
        own("traffic/convoy"),
        own("best/figure-9"),
    ];
    missions.extend(plan.traffic.iter().map(|file| (format!("`{}`", file_name(file)), Flown::over(file, &[]))));
    missions
}

fn mean(runs: &[Metrics], metric: &str) -> Estimate {
    Estimate::mean(&measured(runs, metric))
}

/// What half as many discs as UAVs watch, moving and placed anew, and what as many.
fn discs(plan: &Plan, mission: &Flown) -> Result<[Estimate; 4], Failure> {
    let told = plan.look(mission, |scenario| {
        let stick = yardstick(scenario);
        Ok([stick.half, stick.all].map(|watched| [watched.mover_fraction, watched.best_fraction]))
    })?;
    let column = |of: usize| told.iter().filter_map(|watched| watched[of / 2][of % 2]).collect::<Vec<_>>();
    Ok([0, 1, 2, 3].map(|of| Estimate::mean(&column(of))))
}

#[cfg(test)]
mod tests {
    use standoff_sim::scenario::{Scenario, Targets};

    use super::*;

    /// Each row of the tables undoes one key of the paper's law, each key is undone by one, and none is one that no
    /// scenario over traffic has. The margin and the circle are undone alone, short of the paper's printed margin and its
    /// filter, which go with other keys.
    #[test]
    fn what_is_undone_is_the_papers_law() {
        let undone: Vec<&str> = WITHOUT.iter().flat_map(|(_, undo)| undo.iter().copied()).collect();
        let others = ["orbit.margin_sds=1.645", "orbit.centre=centroid"];
        assert!(undone.iter().all(|key| PAPERS_LAW.contains(key) || others.contains(key)), "{undone:?}");
        let new = |edit: &&&str| {
            !["feedforward", "turn_rate_gain", "lead", "speed_reference", "margin", "on_membership_change", "centre"]
                .iter()
                .any(|key| edit.contains(&format!(".{key}=")))
        };
        let mut papers: Vec<&str> = PAPERS_LAW.iter().filter(new).copied().collect();
        let mut sorted: Vec<&str> = undone.iter().filter(|key| !others.contains(*key)).copied().collect();
        papers.sort_unstable();
        sorted.sort_unstable();
        assert_eq!(sorted, papers);
    }

    /// The streets of a seed are flown, not the convoy; the yardstick is of the same vehicles: many discs watch more.
    #[test]
    fn streets_of_the_seed_are_flown() {
        let plan = Plan { runs: 2, first_seed: 101, threads: None, traffic: Vec::new() };
        let town = Flown::streets(Streets { blocks: 10, cars: 9 }).with_uavs(2).and(&["duration_s=20"]);
        let cars = |scenario: &Scenario| match &scenario.targets {
            Targets::Traffic(traffic) => Ok((traffic.vehicles.len(), traffic.crc32())),
            Targets::Random { .. } => Err(Failure::running("not over traffic")),
        };
        let told = plan.look(&town, cars).map_err(|_| ()).unwrap();
        assert!(told[0].0 == 9 && told[1].0 == 9 && told[0].1 != told[1].1, "{told:?}");
        let flown = plan.fly(&town, Choice::parse("watched_fraction").unwrap()).map_err(|_| ()).unwrap();
        let share = flown[0].watched_fraction.unwrap();
        assert!(0.0 < share && share < 1.0, "{share}");
        let [half, half_best, all, all_best] = discs(&plan, &town).map_err(|_| ()).unwrap();
        assert!(half.value <= half_best.value && all.value <= all_best.value && half.value < all_best.value);
    }
}
