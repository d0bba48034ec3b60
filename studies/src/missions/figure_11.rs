//! Figure 11: the off-boresight angle of the furthest target, with and without the active measures and the dwell.

use standoff_score::geometry::Geometry;
use standoff_sim::scenario::Scenario;
use standoff_view::figures::study::Plot;

use super::{BASIC, MISSION, ORBIT_GROWS, half_deg, histories};
use crate::claim::{Claim, Paper};
use crate::error::Failure;
use crate::monte_carlo_plan::{IN_METRES, Plan, time_s, watch};
use crate::percentile_bands::{History, bands, data};
use crate::statistics::{Estimate, mean};
use crate::study::{Data, Study, Table};

/// Time after a handoff that the angle is checked for, s.
const AFTER_S: f64 = 5.0;

/// Observations of a run.
#[derive(Default)]
struct RunObservations {
    /// Largest angle of all UAVs at each time step.
    widest_deg: History,
    /// Maximum over all time steps.
    most_deg: f64,
    /// 1 for each time step at which some UAV's angle exceeds half the field of view, otherwise 0.
    beyond: Vec<f64>,
    /// True if the limit is exceeded within `AFTER_S` of a handoff; `None` without a handoff.
    beyond_after_handoff: Option<bool>,
}

impl RunObservations {
    /// Percentage of the time in which some UAV's angle exceeds half the field of view.
    fn beyond_percent(&self) -> f64 {
        100.0 * mean(&self.beyond)
    }
}

/// Flies figure 11.
pub(crate) fn figure_11(plan: &Plan) -> Result<Study, Failure> {
    let mut found = Study::new(
        "figure-11",
        "Figure 11: off-boresight angle of the furthest target",
        format!(
            "`{BASIC}` (11a: no active measures, no dwell) and `{MISSION}` (11b) with the same seeds, and 11b with the \
             margin in metres of figure 10. The off-boresight angle (the paper's line of sight) is the angle between a \
             UAV's boresight and the true position of the furthest member of its group; during the dwell, a target \
             counts as a member of the passing group. The limit is half the field of view."
        ),
    );
    let half_deg = half_deg(&plan.first(MISSION, &[])?.settings);
    let fly = |scenario: &str, set: &[&str]| plan.each(scenario, set, |scenario| observe(scenario, half_deg));
    let variants = [fly(BASIC, &[])?, fly(MISSION, &[])?, fly(MISSION, &IN_METRES)?];
    let [basic, active, _] = &variants;
    found.claims = claims(basic, active, half_deg);
    found.tables.push(table(&variants, half_deg));
    let row = |(index, seed): (usize, u64)| {
        let of_runs = variants.iter().flat_map(|runs| [runs[index].most_deg, runs[index].beyond_percent()]);
        [seed as f64].into_iter().chain(of_runs).collect()
    };
    let columns = "seed,basic_largest_deg,basic_beyond_percent,active_largest_deg,active_beyond_percent,\
                   active_in_metres_largest_deg,active_in_metres_beyond_percent";
    found.data.push(Data::new("figure-11-runs", columns, plan.seeds().enumerate().map(row)));
    let [basic, active, metres] = variants.map(|runs| histories(&runs, |run| &run.widest_deg));
    let plots = [("11a", &basic), ("11b", &active), ("11b, in metres", &metres)].map(|(name, runs)| Plot {
        levels: vec![(half_deg, "half the field of view".to_owned())],
        ..bands(&format!("Largest angle (°), {name}"), runs)
    });
    let heading = "Off-boresight angle of the furthest target of a group, over many runs (figure 11)";
    let caption = format!("largest angle of the four UAVs; {} runs", plan.runs);
    found.draw("figure-11", heading, &caption, &plots)?;
    let kinds: [(&str, &[History]); 3] =
        [("basic_deg", &basic), ("active_deg", &active), ("active_in_metres_deg", &metres)];
    found.data.push(data("figure-11", &kinds));
    Ok(found)
}

fn claims(basic: &[RunObservations], active: &[RunObservations], half_deg: f64) -> Vec<Claim> {
    vec![
        Claim::always(
            format!("11a: without active measures and dwell, the angle exceeds {half_deg:.0} deg"),
            "runs",
            basic.iter().map(|run| run.most_deg > half_deg),
            "",
        ),
        Claim::always(
            format!("11a: it exceeds the limit within {AFTER_S} s of a handoff"),
            "runs",
            basic.iter().filter_map(|run| run.beyond_after_handoff),
            "",
        ),
        Claim::always(
            format!("11b: with them, it never exceeds {half_deg:.0} deg"),
            "runs",
            active.iter().map(|run| run.most_deg <= half_deg),
            ORBIT_GROWS,
        ),
        Claim::difference(
            "fraction of time in which some angle exceeds the limit: 11a to 11b",
            "% of the time",
            Paper::Less,
            basic.iter().zip(active).map(|(basic, active)| (basic.beyond_percent(), active.beyond_percent())),
            ORBIT_GROWS,
        ),
    ]
}

/// Creates the table of the variants of the mission.
fn table(variants: &[Vec<RunObservations>; 3], half_deg: f64) -> Table {
    let mut table = Table::new(
        "With 95 % intervals:",
        "|runs within the limit (%)|low|high|time beyond it (%)|low|high|largest angle, median (deg)|5 %|95 %"
            .split('|'),
    );
    let names = ["11a: no active measures, no dwell", "11b: both active measures, dwell", "11b, margin in metres"];
    for (name, runs) in names.into_iter().zip(variants) {
        let within = Estimate::share(runs.iter().map(|run| run.most_deg <= half_deg));
        let time = Estimate::mean(&runs.iter().map(RunObservations::beyond_percent).collect::<Vec<f64>>());
        let largest = Estimate::middle(&runs.iter().map(|run| run.most_deg).collect::<Vec<f64>>());
        table.estimates(name, [within, time, largest]);
    }
    table
}

fn observe(scenario: &Scenario, half_deg: f64) -> Result<RunObservations, Failure> {
    let (mut seen, mut handed_over_s) = (RunObservations::default(), None);
    watch(scenario, |frame| {
        let time_s = time_s(frame);
        let geometry = Geometry::of(frame);
        let angles = frame.uavs.iter().filter_map(|uav| geometry.off_boresight_rad(uav)).map(f64::to_degrees);
        let widest_deg = angles.reduce(f64::max);
        seen.widest_deg.push((time_s, widest_deg.into_iter().collect()));
        let Some(widest_deg) = widest_deg else { return };
        let is_beyond = widest_deg > half_deg;
        seen.most_deg = seen.most_deg.max(widest_deg);
        seen.beyond.push(f64::from(is_beyond));
        if frame.events.iter().any(|event| event.kind == "handoff-completed") {
            handed_over_s = Some(time_s);
            seen.beyond_after_handoff.get_or_insert(false);
        }
        if is_beyond && handed_over_s.is_some_and(|at_s: f64| time_s - at_s <= AFTER_S) {
            seen.beyond_after_handoff = Some(true);
        }
    })?;
    Ok(seen)
}
