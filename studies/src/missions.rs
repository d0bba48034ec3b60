//! Figures 8 to 11: the paper's two missions with many seeds.

mod figure_10;
mod figure_11;
mod figure_8;
mod figure_9;

pub(crate) use figure_8::figure_8;
pub(crate) use figure_9::figure_9;
pub(crate) use figure_10::figure_10;
pub(crate) use figure_11::figure_11;

use standoff_record::{Frame, GroupRow};
use standoff_score::geometry;
use standoff_sim::scenario::{Scenario, Settings};
use standoff_view::figures::study::Plot;
use standoff_view::figures::{Figure, Setup, figures};

use super::claim::{Claim, Finding};
use super::monte_carlo_plan::{time_s, watch};
use super::percentile_bands::{History, bands};
use super::statistics::Estimate;
use crate::error::Failure;

/// The mission of figures 9 to 11.
pub(crate) const MISSION: &str = "paper/figure-9";
/// The mission of figure 11a.
const BASIC: &str = "paper/figure-9-basic";

/// Tolerance of the phase error, degrees.
const PHASE_TOLERANCE_DEG: f64 = 5.0;

/// Reason why a target is rarely out of view; checked in the runs where it happens.
const ORBIT_GROWS: &str = "at the start and at the end of a handoff, the centroid jumps before the orbit has grown: by \
                           one degree for a single handoff, by more if a target is handed over twice within a minute \
                           and a UAV flies over members on its way in (docs/user/limits.md)";

/// Time histories of the orbits of a run.
#[derive(Default)]
struct Orbits {
    errors_m: History,
    phase_differences_deg: History,
    settled_errors_m: Vec<f64>,
    /// Phase error |phase difference - theta_d| after the transient.
    settled_deg: Vec<f64>,
}

impl Orbits {
    fn observe(&mut self, frame: &Frame, settings: &Settings) {
        let time_s = time_s(frame);
        // |r - r_d| by the agents' own estimates: the paper's standoff distance error.
        let in_groups = frame.uavs.iter().filter_map(|uav| Some((uav, geometry::group_of(frame, uav)?)));
        let errors: Vec<f64> = in_groups.map(|(uav, group)| geometry::own_estimate_error_m(uav, group).abs()).collect();
        let angles: Vec<f64> = frame.groups.iter().filter_map(|group| phase_difference_deg(frame, group)).collect();
        if time_s >= settings.transient.s() {
            self.settled_errors_m.extend(&errors);
            self.settled_deg.extend(angles.iter().map(|angle| (angle - desired_phase_difference_deg(settings)).abs()));
        }
        self.errors_m.push((time_s, errors));
        self.phase_differences_deg.push((time_s, angles));
    }
}

/// Returns the phase difference of the two UAVs of a group about the estimated centre, degrees in [0, 180]; `None`
/// unless the group has two UAVs.
fn phase_difference_deg(frame: &Frame, group: &GroupRow) -> Option<f64> {
    let mut differences = geometry::phase_differences(frame).into_iter();
    let of_pair = differences.find(|(id, (count, ..), _)| *id == group.group && *count == 2);
    of_pair.map(|(.., angle_rad)| angle_rad.to_degrees())
}

/// Returns theta_d, the desired phase difference, degrees.
fn desired_phase_difference_deg(settings: &Settings) -> f64 {
    settings.team.guidance.desired_phase_rad.to_degrees()
}

/// Returns half of a UAV's field of view, degrees.
fn half_deg(settings: &Settings) -> f64 {
    settings.team.track.sensor.half_field_of_view_rad().to_degrees()
}

/// Creates a plot of the phase differences of all runs and the desired one.
fn phase_plot(axis: &str, runs: &[History], settings: &Settings) -> Plot {
    Plot {
        shown: Vec::new(),
        levels: vec![(desired_phase_difference_deg(settings), "desired".to_owned())],
        ..bands(axis, runs)
    }
}

/// Creates the claim that UAVs keep the desired phase difference; `runs` are the mean phase errors of the runs,
/// degrees.
fn phase_claim(uavs: &str, settings: &Settings, runs: &[f64]) -> Claim {
    Claim {
        what: format!(
            "the {uavs} keep a phase difference of {:.0} deg after the transient: mean phase error",
            desired_phase_difference_deg(settings)
        ),
        unit: "deg",
        finding: Finding::Number { paper: 0.0, tolerance: PHASE_TOLERANCE_DEG, ours: Estimate::mean(runs) },
        runs: runs.len(),
        reason: "",
    }
}

/// Returns one history of every run.
fn histories<T>(runs: &[T], which: impl Fn(&T) -> &History) -> Vec<History> {
    runs.iter().map(|run| which(run).clone()).collect()
}

/// Draws the map of one run.
fn map(name: &'static str, scenario: &Scenario) -> Result<Figure, Failure> {
    let mut frames = Vec::new();
    watch(scenario, |frame| frames.push(Ok::<_, std::convert::Infallible>(frame.clone())))?;
    let title = format!("{}, seed {}", scenario.name, scenario.seed);
    let drawings = figures(frames.into_iter(), &Setup::of(title, &scenario.settings)).map_err(Failure::running)?;
    let map = drawings.into_iter().find(|figure| figure.name == "trajectories");
    let map = map.ok_or_else(|| Failure::running(format!("{}: the run has no trajectories to draw", scenario.name)))?;
    Ok(Figure { name, ..map })
}
