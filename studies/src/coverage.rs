//! Custody of traffic and control effort: the paper's law, all improvements, and all improvements except one.

use standoff_score::Metrics;
use standoff_sim::baseline::baseline;

use super::claim::shown;
use super::metric_table::{Column, Differences, data_columns, select_columns};
use super::monte_carlo_plan::{PAPER_LAW, Plan, ScenarioVariant, file_name};
use super::statistics::Estimate;
use super::street_traffic::Streets;
use super::study::{Data, Study, Table};
use crate::error::Failure;

/// Improvements, each with the settings that undo it.
const WITHOUT: [(&str, &[&str]); 12] = [
    ("groups as needed", &["groups.count=half-of-uavs"]),
    ("the minimum enclosing circle", &["orbit.centre=filtered", "orbit.time_constant_s=0"]),
    ("pointing at the angular midpoint", &["orbit.pointing=group-centre"]),
    ("removal by largest radius reduction", &["groups.removal=furthest-from-centre"]),
    ("the bounded motion of orbits", &["orbit.time_constant_s=0"]),
    ("the smaller heading gain", &["guidance.heading_gain_1_s=2"]),
    ("the greater switching cost", &["groups.assignment_switching_cost=0.5"]),
    ("the greater readmission radius", &["orbit.readmission_radius_fraction=0.9"]),
    ("orbits above the turn limit", &["orbit.radius_above_turn_limit=false"]),
    ("the zero margin", &["orbit.margin_sds=1.645"]),
    ("early deletion of unseen tracks", &["filter.deletion_unseen_in_view_s=5"]),
    ("the search for lost targets", &["groups.search_lost_targets=false"]),
];

/// Metrics in the tables.
const SHOWN: [Column; 8] = [
    ("custody_fraction", "custody (%)", 100.0),
    ("member_out_of_view_fraction", "out of view (%)", 100.0),
    ("position_error_m", "position error (m)", 1.0),
    ("turn_rate_saturated_fraction", "turn rate at its limit (%)", 100.0),
    ("turn_reversals_per_min", "turn reversals (1/min)", 1.0),
    ("speed_saturated_fraction", "speed at a limit (%)", 100.0),
    ("standoff_error_m_settled", "standoff error, true (m)", 1.0),
    ("reassignments_per_uav_min", "reassignments (1/min per UAV)", 1.0),
];

/// Number of runs in the plan per run of this study, which is slower because it flies over whole towns.
const RUNS_PER_RUN: u32 = 20;
/// Offset of the seeds from those of the plan, so that they differ from the seeds on which the improvements were tuned.
const SEED_OFFSET: u64 = 100;

const SMALL_TOWN: Streets = Streets { blocks: 10, cars: 30 };
const LARGE_TOWN: Streets = Streets { blocks: 20, cars: 100 };

/// Flies every mission with the paper's law, with all improvements, and with all improvements except one.
pub(crate) fn coverage(plan: &Plan) -> Result<Study, Failure> {
    let plan =
        &Plan { runs: (plan.runs / RUNS_PER_RUN).max(2), first_seed: plan.first_seed + SEED_OFFSET, ..plan.clone() };
    let mut found = Study::new(
        "coverage",
        "Beyond the paper: custody and control effort",
        format!(
            "The default settings (all improvements), the same without one improvement at a time, and the paper's law \
             (with its margin (16) as published and the exact (25)): {} runs each, seeds {} to {}. No parameter was \
             tuned on these seeds; the built-in missions were used for tuning, with other seeds. Differences are \
             paired by seed, with 95 % intervals. Streets are drawn from the seed: crossings every 150 m, and cars \
             of 5 to 15 m/s that stop and turn at random, for 300 s. The coverage baseline is the coverage of greedy \
             discs with the footprint of the largest orbit and perfect knowledge of all targets: half as many discs as \
             UAVs (the paper's number of groups), and as many as UAVs. It is not a bound.",
            plan.runs,
            plan.first_seed,
            plan.first_seed + u64::from(plan.runs) - 1,
        ),
    );
    let choice = select_columns(&SHOWN)?;
    let heads = [
        "",
        "paper's law",
        "all",
        "N/2 discs, moving",
        "N/2 discs, re-placed",
        "N discs, moving",
        "N discs, re-placed",
    ];
    let mut summary = Table::new("Custody (%) and the coverage baseline (%):", heads);
    let (mut tables, mut data) = (Vec::new(), Vec::new());
    for (index, (name, mission)) in missions(plan).iter().enumerate() {
        let all = plan.fly(mission, choice)?;
        let papers = plan.fly(&mission.and(&PAPER_LAW), choice)?;
        let title = format!("{name}: all improvements, and differences from them:");
        let mut table = Differences::new(title, "all", &SHOWN, &all);
        let mut add = |number: usize, row: &str, runs: &[Metrics]| {
            let numbers = table.add(row, runs);
            data.push([index as f64, number as f64].into_iter().chain(numbers).collect());
        };
        add(0, "the paper's law", &papers);
        for (number, (row, undo)) in WITHOUT.iter().enumerate() {
            add(1 + number, &format!("without {row}"), &plan.fly(&mission.and(undo), choice)?);
        }
        tables.push(table.table);
        let custody = [&papers, &all].map(|runs| Estimate::of(runs, "custody_fraction"));
        let cells = custody.into_iter().chain(discs(plan, mission)?);
        summary.add(name, cells.map(|estimate| estimate.times(100.0).formatted(shown)));
    }
    found.tables.push(summary);
    found.tables.extend(tables);
    let columns = "mission,without".to_owned() + &data_columns(&SHOWN, "all");
    found.data.push(Data::new("coverage", columns, data));
    Ok(found)
}

/// Returns the missions with their names.
fn missions(plan: &Plan) -> Vec<(String, ScenarioVariant)> {
    let streets = |town: Streets, uavs: u32| {
        let side_km = f64::from(town.blocks) * 0.15;
        let name = format!("streets of {side_km} km, {} cars, {uavs} UAVs", town.cars);
        (name, ScenarioVariant::streets(town).with_uavs(uavs))
    };
    let city =
        |uavs: u32| (format!("`traffic/city`, {uavs} UAVs"), ScenarioVariant::of("traffic/city", &[]).with_uavs(uavs));
    let built_in = |name: &str| (format!("`{name}`"), ScenarioVariant::of(name, &[]));
    let mut missions = vec![
        streets(SMALL_TOWN, 4),
        streets(SMALL_TOWN, 8),
        streets(LARGE_TOWN, 8),
        city(2),
        city(4),
        built_in("traffic/convoy"),
        built_in("improved/figure-9"),
    ];
    missions
        .extend(plan.traffic.iter().map(|file| (format!("`{}`", file_name(file)), ScenarioVariant::over(file, &[]))));
    missions
}

/// Returns the coverage of half as many discs as UAVs, moving and re-placed at every time step, and of as many discs as
/// UAVs.
fn discs(plan: &Plan, mission: &ScenarioVariant) -> Result<[Estimate; 4], Failure> {
    let baselines = plan.observe(mission, |scenario| {
        let baseline = baseline(scenario);
        Ok([baseline.half_of_uavs, baseline.all_uavs].map(|share| [share.mover_fraction, share.best_fraction]))
    })?;
    let column = |index: usize| baselines.iter().filter_map(|share| share[index / 2][index % 2]).collect::<Vec<_>>();
    Ok([0, 1, 2, 3].map(|index| Estimate::mean(&column(index))))
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use standoff_sim::scenario::{Scenario, Targets};

    use super::*;
    use crate::metric_table::select;
    use crate::monte_carlo_plan::PAPER_VALUES;

    /// Each row of the tables sets values of the paper's law. Each value of that law is in a row, except those that
    /// `has_row` excludes.
    #[test]
    fn each_row_sets_values_of_the_papers_law_and_each_value_is_in_a_row() {
        let undone: BTreeSet<&str> = WITHOUT.iter().flat_map(|(_, undo)| undo.iter().copied()).collect();
        let has_row = |setting: &&str| {
            let excluded = [
                "orbit.margin=",
                "orbit.centre_jump=",
                "orbit.acceleration_max_m_s2=",
                "orbit.closing_speed_max_m_s=",
                "groups.handoff_margin_m=",
                "groups.regrouping_period_s=",
                "filter.near_range_m=",
                "separation=",
            ];
            !excluded.iter().any(|start| setting.starts_with(start))
        };
        assert_eq!(undone, PAPER_VALUES.into_iter().filter(has_row).collect());
    }

    /// Flights and baseline use the street traffic of the seed, not the convoy. More discs cover more.
    #[test]
    fn missions_on_streets_use_the_traffic_of_the_seed() {
        let plan = Plan { runs: 2, first_seed: 101, threads: None, traffic: Vec::new() };
        let town = ScenarioVariant::streets(Streets { blocks: 10, cars: 9 }).with_uavs(2).and(&["duration_s=20"]);
        let cars = |scenario: &Scenario| match &scenario.targets {
            Targets::Traffic(traffic) => Ok((traffic.vehicles.len(), traffic.crc32())),
            Targets::Random { .. } => Err(Failure::running("not over traffic")),
        };
        let traffic = plan.observe(&town, cars).map_err(|_| ()).unwrap();
        assert!(traffic[0].0 == 9 && traffic[1].0 == 9 && traffic[0].1 != traffic[1].1, "{traffic:?}");
        let runs = plan.fly(&town, select(&["custody_fraction"]).map_err(|_| ()).unwrap()).map_err(|_| ()).unwrap();
        let share = runs[0]["custody_fraction"].unwrap();
        assert!(0.0 < share && share < 1.0, "{share}");
        let [half, half_best, all, all_best] = discs(&plan, &town).map_err(|_| ()).unwrap();
        assert!(half.value <= half_best.value && all.value <= all_best.value && half.value < all_best.value);
    }
}
