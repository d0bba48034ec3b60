//! (32) adds information about different targets before the determinant, and (33) allows a UAV in two groups.

use standoff::coordination::assignment::Assignment;
use standoff::coordination::assignment::AvailableUav;
use standoff::coordination::assignment::CandidateGroup;
use standoff::coordination::assignment::assign;
use standoff::math;
use standoff::params::Objective;
use standoff::{Displacement, GroupId, Position, SensorParams, TeamParams, UavId};
use standoff_sim::random::{Draw, Draws, Stream};

use crate::claim::Claim;
use crate::error::Failure;
use crate::monte_carlo_plan::Plan;
use crate::statistics::{mean, quantiles};
use crate::study::{Data, Study, Table};

const UAVS: u32 = 4;
const TARGETS: usize = 4;
/// Half the side of the square that contains UAVs and groups, m.
const FIELD_M: f64 = 1000.0;
/// Half the side of the square that contains the targets of a group, m.
const GROUP_M: f64 = 100.0;
/// Number of random worlds per run of the plan; they are fast to compute.
const WORLDS_PER_RUN: u64 = 10;

pub(super) fn study_assignment(plan: &Plan) -> Result<Study, Failure> {
    let mut found = Study::new(
        "errata",
        "Erratum of (32) and (33): the assignment",
        "Random worlds: four UAVs and two groups of four targets in a square of 2 km, the targets within 100 m of the \
         middle of their group along each axis. *Restated* is the sum over targets of the logarithm of each target's \
         determinant. It is compared with (32), both with one group per UAV. The best combinations that (32) and (33) \
         allow as published are found by exhaustive search.",
    );
    let seeds = plan.first_seed..plan.first_seed + WORLDS_PER_RUN * u64::from(plan.runs);
    let worlds: Vec<Outcome> = seeds.map(|seed| evaluate(&World::draw(seed))).collect();
    let differ: Vec<f64> = worlds.iter().filter(|world| world.differs).map(|world| world.loss).collect();
    let losses: Vec<f64> = worlds.iter().map(|world| world.loss).collect();
    let mut table = Table::new(
        format!("Loss of the published objective in ln det per target, in {} worlds:", worlds.len()),
        ["worlds", "mean", "median", "5 %", "95 %", "determinant, mean factor"],
    );
    for (name, losses) in [("all", &losses), ("those with different assignments", &differ)] {
        let [low, middle, high] = quantiles(losses);
        table.row(name, [mean(losses), middle, low, high, math::exp(-mean(losses))]);
    }
    found.tables.push(table);
    let rows = worlds.iter().map(|world| vec![f64::from(world.differs), world.loss, f64::from(world.twice)]);
    let columns = "assignments_differ,loss_ln_det_per_target,published_uses_a_uav_twice";
    found.data.push(Data::new("errata-assignment", columns, rows));
    found.claims = vec![
        Claim::always(
            "(32) maximises the information about the targets: it gives the assignment of the restated objective",
            "worlds",
            worlds.iter().map(|world| !world.differs),
            "information about different targets is added before the determinant: observing one group from the north \
             and the other from the east scores as if each were observed from both directions",
        ),
        Claim::always(
            "(32) with (33) gives every UAV one group",
            "worlds",
            worlds.iter().map(|world| !world.twice),
            "(33) limits the use of each combination of UAVs, not of each UAV; more UAVs always give more information, \
             so that all are assigned to one group and all except one also to the other",
        ),
    ];
    Ok(found)
}

/// UAVs and the targets of two groups.
struct World {
    uavs: Vec<Position>,
    groups: [Vec<Position>; 2],
    sensor: SensorParams,
}

/// Comparison of the two objectives in a world.
struct Outcome {
    /// True if the assignments differ.
    differs: bool,
    /// Loss of the published objective relative to the restated one, in ln det per target.
    loss: f64,
    /// True if the best combinations as published have a UAV in both groups.
    twice: bool,
}

impl World {
    fn draw(seed: u64) -> Self {
        let mut draw = Draws::new(seed).at(Stream::Scenario, 0, 0);
        let square = |draw: &mut Draw, half_m: f64| {
            Displacement::from_m(half_m * (2.0 * draw.uniform() - 1.0), half_m * (2.0 * draw.uniform() - 1.0))
        };
        let uavs = (0..UAVS).map(|_| Position::ORIGIN + square(&mut draw, FIELD_M)).collect();
        let groups = [(); 2].map(|()| {
            let middle = Position::ORIGIN + square(&mut draw, FIELD_M);
            (0..TARGETS).map(|_| middle + square(&mut draw, GROUP_M)).collect()
        });
        Self { uavs, groups, sensor: TeamParams::paper().track.sensor }
    }

    fn assignment(&self, objective: Objective) -> Vec<Assignment> {
        let uavs: Vec<AvailableUav> = (0..)
            .zip(&self.uavs)
            .map(|(id, &position)| AvailableUav { uav: UavId(id), position, current_group: None })
            .collect();
        let sites: Vec<CandidateGroup<'_>> = (0..)
            .zip(&self.groups)
            .map(|(id, members)| CandidateGroup { group: GroupId(id), members, priorities: &[] })
            .collect();
        assign(&uavs, &sites, &self.sensor, objective, TeamParams::paper().group.assignment_switching_cost)
    }

    /// Returns the mean over targets of ln det of the information from their assigned UAVs.
    fn mean_ln_det(&self, assignment: &[Assignment]) -> f64 {
        let mut ln_dets = Vec::new();
        for (id, members) in (0..).zip(&self.groups) {
            let assigned = || {
                assignment
                    .iter()
                    .filter(|assignment| assignment.group == GroupId(id))
                    .map(|assignment| self.uavs[assignment.uav.0 as usize])
            };
            ln_dets.extend(members.iter().map(|target| {
                let sum: nalgebra::Matrix2<f64> = assigned().map(|uav| self.sensor.information(uav, *target)).sum();
                math::ln(sum.determinant())
            }));
        }
        mean(&ln_dets)
    }

    /// Returns the best combinations of UAVs for the two groups, as bits, by (32) and (33) as published: the two
    /// combinations must differ.
    fn published(&self) -> [u32; 2] {
        let information = |group: usize, bits: u32| -> nalgebra::Matrix2<f64> {
            let uavs = (0..).zip(&self.uavs).filter(|(id, _)| bits >> id & 1 == 1).map(|(_, uav)| uav);
            uavs.flat_map(|uav| self.groups[group].iter().map(|target| self.sensor.information(*uav, *target))).sum()
        };
        let combinations = 1..1 << UAVS;
        let mut best = (f64::NEG_INFINITY, [0, 0]);
        for first in combinations.clone() {
            for second in combinations.clone().filter(|second| *second != first) {
                let score = (information(0, first) + information(1, second)).determinant();
                if score > best.0 {
                    best = (score, [first, second]);
                }
            }
        }
        best.1
    }
}

fn evaluate(world: &World) -> Outcome {
    let (published, restated) = (world.assignment(Objective::Paper), world.assignment(Objective::LogDet));
    let [first, second] = world.published();
    Outcome {
        differs: published != restated,
        loss: world.mean_ln_det(&restated) - world.mean_ln_det(&published),
        twice: first & second != 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_restated_assignment_has_at_least_equal_information_and_uses_every_uav_once() {
        for seed in 1..200 {
            let world = World::draw(seed);
            // The assignment rounds scores to 1e-6.
            assert!(evaluate(&world).loss > -1e-5, "seed {seed}");
            assert_eq!(world.assignment(Objective::LogDet).len(), world.uavs.len());
        }
    }
}
