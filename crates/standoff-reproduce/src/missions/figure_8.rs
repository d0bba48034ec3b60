//! Figure 8: four targets, two UAVs.

use standoff_sim::scenario::Scenario;
use standoff_view::figures::study::study;

use super::{APART_DEG, always, map};
use crate::claim::{Claim, Finding};
use crate::failure::Failure;
use crate::flights::{Plan, watch};
use crate::history::{History, bands, data};
use crate::observe::{line_of_sight_deg, separation_deg, standoff_error_m, time_s};
use crate::statistics::{Estimate, mean};
use crate::study::Study;

const SCENARIO: &str = "paper/figure-8";

/// What is seen of a run.
#[derive(Default)]
struct Seen {
    errors_m: History,
    separations_deg: History,
    /// |separation - theta_d|, once settled.
    settled_deg: Vec<f64>,
    widest_deg: f64,
    has_discard: bool,
}

/// Flies figure 8.
pub(crate) fn figure_8(plan: &Plan) -> Result<Study, Failure> {
    let mut found = Study::new(
        "figure-8",
        "Figure 8: four targets, two UAVs",
        format!(
            "`{SCENARIO}`: one run's trajectories, and the histories of all runs. A target is out of a UAV's view beyond \
             half its field of view off the boresight."
        ),
    );
    let runs = plan.each(SCENARIO, &[], look)?;
    let scenario = plan.first(SCENARIO, &[])?;
    let (half_deg, wanted_deg) = {
        let team = &scenario.settings.team;
        (team.track.sensor.half_view_rad().to_degrees(), team.guidance.separation_rad.to_degrees())
    };
    let in_view: Vec<bool> = runs.iter().map(|run| run.widest_deg <= half_deg).collect();
    let all_kept: Vec<bool> = runs.iter().map(|run| run.widest_deg <= half_deg && !run.has_discard).collect();
    let separations: Vec<f64> = runs.iter().map(|run| mean(&run.settled_deg)).collect();
    found.claims = vec![
        always(
            format!("all targets stay within both UAVs' field of view ({half_deg:.0} deg off boresight) at all times"),
            &all_kept,
            "the four drift apart; where the largest orbit does not hold them any more, the furthest is discarded, as \
             section IV.B.2 says; whom the group keeps, it keeps in view, as the next line has it",
        ),
        always("all targets but those that the group discards do so", &in_view, ""),
        Claim {
            what: format!("the UAVs keep {wanted_deg:.0} deg apart, once settled: mean error"),
            unit: "deg",
            finding: Finding::Number { paper: 0.0, tolerance: APART_DEG, ours: Estimate::mean(&separations) },
            runs: separations.len(),
            reason: "",
        },
    ];
    let (errors, angles): (Vec<History>, Vec<History>) =
        runs.into_iter().map(|run| (run.errors_m, run.separations_deg)).unzip();
    let mut separation = bands("Separation (°)", &[("", &angles)]);
    separation.shown.clear();
    separation.levels.push((wanted_deg, "wanted".to_owned()));
    let plots = [bands("Standoff error (m)", &[("", &errors)]), separation];
    let heading = "Standoff distance error and separation of a pair, over many runs (figure 8)";
    let caption = format!("{SCENARIO}, {} runs", plan.runs);
    found.figures.push(map("figure-8", &scenario)?);
    found.figures.push(study("figure-8-histories", heading, &caption, &plots).map_err(Failure::running)?);
    found.data.push(data("figure-8", &[("standoff_error_m", &errors), ("separation_deg", &angles)]));
    Ok(found)
}

fn look(scenario: &Scenario) -> Result<Seen, Failure> {
    let (mut seen, settle_s) = (Seen::default(), scenario.settings.settle.s());
    let wanted_deg = scenario.settings.team.guidance.separation_rad.to_degrees();
    watch(scenario, |frame| {
        let time_s = time_s(frame);
        let errors = frame.uavs.iter().filter_map(|uav| standoff_error_m(frame, uav));
        seen.errors_m.push((time_s, errors.collect()));
        let angles: Vec<f64> = frame.groups.iter().filter_map(|group| separation_deg(frame, group)).collect();
        if time_s >= settle_s {
            seen.settled_deg.extend(angles.iter().map(|angle| (angle - wanted_deg).abs()));
        }
        seen.separations_deg.push((time_s, angles));
        seen.has_discard |= frame.events.iter().any(|event| event.kind == "discarded");
        let widest = frame.uavs.iter().filter_map(|uav| line_of_sight_deg(frame, uav));
        seen.widest_deg = widest.fold(seen.widest_deg, f64::max);
    })?;
    Ok(seen)
}
