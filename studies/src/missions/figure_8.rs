//! Figure 8: four targets, two UAVs.

use standoff_score::geometry::Geometry;
use standoff_sim::scenario::Scenario;

use super::{Orbits, half_deg, histories, map, phase_claim, phase_plot};
use crate::claim::Claim;
use crate::error::Failure;
use crate::monte_carlo_plan::{Plan, watch};
use crate::percentile_bands::{bands, data};
use crate::statistics::mean;
use crate::study::Study;

const SCENARIO: &str = "paper/figure-8";

/// Observations of a run.
#[derive(Default)]
struct RunObservations {
    orbits: Orbits,
    widest_deg: f64,
    has_removal: bool,
}

/// Flies figure 8.
pub(crate) fn figure_8(plan: &Plan) -> Result<Study, Failure> {
    let mut found = Study::new(
        "figure-8",
        "Figure 8: four targets, two UAVs",
        format!(
            "`{SCENARIO}`: trajectories of one run, and time histories of all runs. A target is out of a UAV's view if \
             its off-boresight angle exceeds half the field of view."
        ),
    );
    let runs = plan.each(SCENARIO, &[], observe)?;
    let scenario = plan.first(SCENARIO, &[])?;
    let settings = &scenario.settings;
    let half_deg = half_deg(settings);
    let in_view = || runs.iter().map(|run| run.widest_deg <= half_deg);
    let phase_differences_deg: Vec<f64> = runs.iter().map(|run| mean(&run.orbits.settled_deg)).collect();
    found.claims = vec![
        Claim::always(
            format!("all targets stay within both UAVs' field of view ({half_deg:.0} deg off boresight) at all times"),
            "runs",
            in_view().zip(&runs).map(|(in_view, run)| in_view && !run.has_removal),
            "the four targets drift apart; when the largest orbit no longer covers them, the furthest is removed, as \
             in section IV.B.2; the remaining members stay in view, as the next row shows",
        ),
        Claim::always("all targets except removed ones do so", "runs", in_view(), ""),
        phase_claim("UAVs", settings, &phase_differences_deg),
    ];
    let (errors, angles) =
        (histories(&runs, |run| &run.orbits.errors_m), histories(&runs, |run| &run.orbits.phase_differences_deg));
    let plots = [bands("Standoff error (m)", &errors), phase_plot("Phase difference (°)", &angles, settings)];
    let heading = "Standoff distance error and phase difference of a pair, over many runs (figure 8)";
    let caption = format!("{SCENARIO}, {} runs", plan.runs);
    found.figures.push(map("figure-8", &scenario)?);
    found.draw("figure-8-histories", heading, &caption, &plots)?;
    found.data.push(data("figure-8", &[("standoff_error_m", &errors), ("phase_difference_deg", &angles)]));
    Ok(found)
}

fn observe(scenario: &Scenario) -> Result<RunObservations, Failure> {
    let mut seen = RunObservations::default();
    watch(scenario, |frame| {
        seen.orbits.observe(frame, &scenario.settings);
        seen.has_removal |= frame.events.iter().any(|event| event.kind == "removed");
        let geometry = Geometry::of(frame);
        let widest = frame.uavs.iter().filter_map(|uav| geometry.off_boresight_rad(uav)).map(f64::to_degrees);
        seen.widest_deg = widest.fold(seen.widest_deg, f64::max);
    })?;
    Ok(seen)
}
