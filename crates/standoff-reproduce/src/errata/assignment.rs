//! (32) adds information about different targets before the determinant is taken, and (33) lets a UAV serve two groups.

use standoff::coordination::assignment::{AvailableUav, Site, assign};
use standoff::{Displacement, Duty, GroupId, Objective, Position, SensorParams, TeamParams, UavId, math};
use standoff_sim::draws::{Draw, Draws, Stream};

use crate::claim::Claim;
use crate::failure::Failure;
use crate::flights::Plan;
use crate::statistics::{mean, quantiles};
use crate::study::{Data, Study, Table};

const UAVS: u32 = 4;
const TARGETS: usize = 4;
/// Half the side of the square in which UAVs and groups lie, m, and that of the square of a group's targets.
const FIELD_M: f64 = 1000.0;
const GROUP_M: f64 = 100.0;
/// Worlds for every run: they cost little.
const WORLDS_PER_RUN: u64 = 10;

pub(super) fn study_assignment(plan: &Plan) -> Result<Study, Failure> {
    let mut found = Study::new(
        "errata",
        "Erratum of (32) and (33): the assignment",
        "Random worlds: four UAVs and two groups of four targets anywhere in a square of 2 km, the targets within 100 m of \
         their group's middle each way. *Printed* is the determinant of the sum of all information; *restated* the sum \
         over targets of the logarithm of the determinant of each one's. Both give every UAV one group; a pair of \
         combinations that (32) and (33) allow as they are printed is found by trying all.",
    );
    let seeds = plan.first_seed..plan.first_seed + WORLDS_PER_RUN * u64::from(plan.runs);
    let worlds: Vec<Outcome> = seeds.map(|seed| judge(&World::draw(seed))).collect();
    let differ: Vec<f64> = worlds.iter().filter(|world| world.differs).map(|world| world.loss).collect();
    let losses: Vec<f64> = worlds.iter().map(|world| world.loss).collect();
    let mut table = Table::new(
        format!("What the printed objective loses, in ln det per target, in {} worlds:", worlds.len()),
        ["worlds", "mean", "median", "5 %", "95 %", "determinant, mean factor"],
    );
    for (name, losses) in [("all", &losses), ("those in which the crews differ", &differ)] {
        let [low, middle, high] = quantiles(losses);
        table.row(name, [mean(losses), middle, low, high, math::exp(-mean(losses))]);
    }
    found.tables.push(table);
    let rows = worlds.iter().map(|world| vec![f64::from(world.differs), world.loss, f64::from(world.twice)]);
    let columns = "crews_differ,loss_ln_det_per_target,printed_uses_a_uav_twice";
    found.data.push(Data::new("errata-assignment", columns, rows));
    found.claims = vec![
        Claim::always(
            "(32) gathers the most information about the targets: it picks the crews of the restated objective",
            "worlds",
            worlds.iter().map(|world| !world.differs),
            "information about different targets is added before the determinant is taken: looking at one group from \
             north and at the other from east scores as if each were seen from both sides",
        ),
        Claim::always(
            "(32) with (33) gives every UAV one group",
            "worlds",
            worlds.iter().map(|world| !world.twice),
            "(33) bounds how often a combination of UAVs is used, not how often a UAV is: more UAVs always tell more, so \
             all serve one group, and all but one of them the other, too",
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

/// What comes of a world.
struct Outcome {
    differs: bool,
    /// Sum of ln det per target that the printed objective's crews tell less than the restated one's.
    loss: f64,
    /// The best pair of combinations as printed has a UAV in both.
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
        Self { uavs, groups, sensor: TeamParams::table_1().track.sensor }
    }

    fn crews(&self, objective: Objective) -> Vec<Duty> {
        let hands: Vec<AvailableUav> = (0..)
            .zip(&self.uavs)
            .map(|(id, &position)| AvailableUav { uav: UavId(id), position, serves: None })
            .collect();
        let sites: Vec<Site<'_>> =
            (0..).zip(&self.groups).map(|(id, members)| Site { group: GroupId(id), members }).collect();
        assign(&hands, &sites, &self.sensor, objective, TeamParams::table_1().group.assignment_inertia)
    }

    /// Sum over targets of ln det of what their crew tells, per target.
    fn worth(&self, crews: &[Duty]) -> f64 {
        let mut worths = Vec::new();
        for (id, members) in (0..).zip(&self.groups) {
            let crew =
                || crews.iter().filter(|duty| duty.group == GroupId(id)).map(|duty| self.uavs[duty.uav.0 as usize]);
            worths.extend(members.iter().map(|target| {
                let told: nalgebra::Matrix2<f64> = crew().map(|uav| self.sensor.information(uav, *target)).sum();
                math::ln(told.determinant())
            }));
        }
        mean(&worths)
    }

    /// Combinations of UAVs, as bits, for the two groups, by (32) and (33) as printed: no combination serves both.
    fn printed(&self) -> [u32; 2] {
        let told = |group: usize, bits: u32| -> nalgebra::Matrix2<f64> {
            let crew = (0..).zip(&self.uavs).filter(|(id, _)| bits >> id & 1 == 1).map(|(_, uav)| uav);
            crew.flat_map(|uav| self.groups[group].iter().map(|target| self.sensor.information(*uav, *target))).sum()
        };
        let combinations = 1..1 << UAVS;
        let mut best = (f64::NEG_INFINITY, [0, 0]);
        for first in combinations.clone() {
            for second in combinations.clone().filter(|second| *second != first) {
                let score = (told(0, first) + told(1, second)).determinant();
                if score > best.0 {
                    best = (score, [first, second]);
                }
            }
        }
        best.1
    }
}

fn judge(world: &World) -> Outcome {
    let (printed, restated) = (world.crews(Objective::Printed), world.crews(Objective::LogDet));
    let [first, second] = world.printed();
    Outcome {
        differs: printed != restated,
        loss: world.worth(&restated) - world.worth(&printed),
        twice: first & second != 0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_restated_crews_never_tell_less_and_use_every_uav_once() {
        for seed in 1..200 {
            let world = World::draw(seed);
            // Scores are rounded to millionths.
            assert!(judge(&world).loss > -1e-5, "seed {seed}");
            assert_eq!(world.crews(Objective::LogDet).len(), world.uavs.len());
        }
    }
}
