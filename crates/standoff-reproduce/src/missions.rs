//! Figures 8 to 11: the paper's two missions, over many seeds.

mod figure_10;
mod figure_11;
mod figure_8;
mod figure_9;

pub(crate) use figure_8::figure_8;
pub(crate) use figure_9::figure_9;
pub(crate) use figure_10::figure_10;
pub(crate) use figure_11::figure_11;

use standoff_sim::scenario::Scenario;
use standoff_view::figures::{Figure, Setup, figures};

use super::claim::{Claim, Finding};
use super::flights::watch;
use super::statistics::Estimate;
use crate::failure::Failure;

/// The mission of figures 9 to 11, and of figure 11a.
const MISSION: &str = "paper/figure-9";
const BASIC: &str = "paper/figure-9-basic";

/// Two UAVs this near to their separation keep it, degrees.
const APART_DEG: f64 = 5.0;

/// Why a target gets out of view, rarely: checked in the runs in which one does.
const ORBIT_GROWS: &str = "when a target is requested or handed over, the centroid jumps before the orbit has grown: by a \
                           degree where once, by more where a target is handed over twice within a minute and a UAV \
                           flies over members on its way in (docs/limits.md)";

/// A claim that the paper shows in one run.
fn always(what: impl Into<String>, held: &[bool], reason: &'static str) -> Claim {
    let finding = Finding::Always { ours: Estimate::share(held.iter().copied()) };
    Claim { what: what.into(), unit: "runs", finding, runs: held.len(), reason }
}

/// The map of one run.
fn map(name: &'static str, scenario: &Scenario) -> Result<Figure, Failure> {
    let mut frames = Vec::new();
    watch(scenario, |frame| frames.push(Ok::<_, std::convert::Infallible>(frame.clone())))?;
    let title = format!("{}, seed {}", scenario.name, scenario.seed);
    let drawn = figures(frames.into_iter(), &Setup::of(title, &scenario.settings)).map_err(Failure::running)?;
    let map = drawn.into_iter().find(|figure| figure.name == "trajectories");
    let map = map.ok_or_else(|| Failure::running(format!("{}: nothing to draw", scenario.name)))?;
    Ok(Figure { name, ..map })
}
