//! Figure 8: four targets, two UAVs.

use standoff_sim::geometry::Geometry;
use standoff_sim::scenario::Scenario;

use super::{Orbits, apart, half_deg, histories, map, separations};
use crate::claim::Claim;
use crate::failure::Failure;
use crate::flights::{Plan, watch};
use crate::history::{bands, data};
use crate::statistics::mean;
use crate::study::Study;

const SCENARIO: &str = "paper/figure-8";

/// What is seen of a run.
#[derive(Default)]
struct Seen {
    orbits: Orbits,
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
    let settings = &scenario.settings;
    let half_deg = half_deg(settings);
    let in_view = || runs.iter().map(|run| run.widest_deg <= half_deg);
    let separations_deg: Vec<f64> = runs.iter().map(|run| mean(&run.orbits.settled_deg)).collect();
    found.claims = vec![
        Claim::always(
            format!("all targets stay within both UAVs' field of view ({half_deg:.0} deg off boresight) at all times"),
            "runs",
            in_view().zip(&runs).map(|(in_view, run)| in_view && !run.has_discard),
            "the four drift apart; where the largest orbit does not hold them any more, the furthest is discarded, as \
             section IV.B.2 says; whom the group keeps, it keeps in view, as the next line has it",
        ),
        Claim::always("all targets but those that the group discards do so", "runs", in_view(), ""),
        apart("UAVs", settings, &separations_deg),
    ];
    let (errors, angles) =
        (histories(&runs, |run| &run.orbits.errors_m), histories(&runs, |run| &run.orbits.separations_deg));
    let plots = [bands("Standoff error (m)", &errors), separations("Separation (°)", &angles, settings)];
    let heading = "Standoff distance error and separation of a pair, over many runs (figure 8)";
    let caption = format!("{SCENARIO}, {} runs", plan.runs);
    found.figures.push(map("figure-8", &scenario)?);
    found.draw("figure-8-histories", heading, &caption, &plots)?;
    found.data.push(data("figure-8", &[("standoff_error_m", &errors), ("separation_deg", &angles)]));
    Ok(found)
}

fn look(scenario: &Scenario) -> Result<Seen, Failure> {
    let mut seen = Seen::default();
    watch(scenario, |frame| {
        seen.orbits.look(frame, &scenario.settings);
        seen.has_discard |= frame.events.iter().any(|event| event.kind == "discarded");
        let geometry = Geometry::of(frame);
        let widest = frame.uavs.iter().filter_map(|uav| geometry.line_of_sight_rad(uav)).map(f64::to_degrees);
        seen.widest_deg = widest.fold(seen.widest_deg, f64::max);
    })?;
    Ok(seen)
}
