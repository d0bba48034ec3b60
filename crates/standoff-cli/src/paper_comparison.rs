//! Comparison of a run with the paper's law in the same mission.

use standoff_app::{Failure, format_errors};
use standoff_reproduce::PAPER_LAW;
use standoff_score::{MetricSelection, Metrics};
use standoff_sim::run::fly;
use standoff_sim::scenario::Scenario;

use crate::overrides::{DEFAULT_SCENARIO, OverrideArgs};

/// Returns the metrics of the default mission under the paper's law, with the same changes, initial positions and seed.
/// Returns `None` if the user chose a mission or metrics: those are printed without the comparison.
pub(crate) fn of(
    named: Option<&str>,
    changes: &OverrideArgs,
    seed: u64,
    choice: MetricSelection,
) -> Result<Option<Metrics>, Failure> {
    if named.is_some()
        || choice != MetricSelection::standard()
        || changes.scenario(None, DEFAULT_SCENARIO) != DEFAULT_SCENARIO
    {
        return Ok(None);
    }
    let overrides = changes.overrides_and(&PAPER_LAW)?;
    let scenario = Scenario::load(DEFAULT_SCENARIO, &overrides, seed).map_err(Failure::Scenario)?;
    fly(&scenario, choice).map(Some).map_err(|errors| Failure::Input(format_errors(&errors)))
}

#[cfg(test)]
mod tests {
    use standoff_sim::scenario::Overrides;

    use super::*;

    /// The initial positions stay the same, and the settings equal those of the paper's mission.
    #[test]
    fn only_the_law_differs_from_the_default_mission() {
        let load = |name: &str, set: &[&str]| {
            let set = set.iter().map(|edit| (*edit).to_owned()).collect();
            Scenario::load(name, &Overrides { set, ..Overrides::default() }, 7).unwrap()
        };
        let (default, switched) = (load(DEFAULT_SCENARIO, &[]), load(DEFAULT_SCENARIO, &PAPER_LAW));
        let mut paper = load("paper/figure-9", &[]);
        paper.settings.about.clone_from(&switched.settings.about);
        // Altitudes are simulated only with collision avoidance.
        assert_eq!(load(DEFAULT_SCENARIO, &["separation=false"]).uavs, switched.uavs);
        assert_eq!(switched.settings, paper.settings);
        assert_ne!(default.settings, paper.settings);
    }
}
