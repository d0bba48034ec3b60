//! Flies one scenario with many seeds on all cores; results are in the order of the seeds.

use std::num::NonZeroUsize;
use std::ops::Range;
use std::path::{Path, PathBuf};

use standoff::ParamError;
use standoff_record::Frame;
use standoff_score::{MetricSelection, Metrics};
use standoff_sim::monte_carlo::{each_seed, fly_all};
use standoff_sim::run::{Mission, fly};
use standoff_sim::scenario::{Overrides, Scenario, ScenarioTemplate};

use crate::error::Failure;
use crate::street_traffic::Streets;

/// Setting that switches a mission to the paper's law.
pub const PAPER_LAW: [&str; 1] = ["guidance.law=oh-2015"];

/// Values of the paper's law in which the default law differs, apart from the guidance itself.
pub(crate) const PAPER_VALUES: [&str; 20] = [
    "filter.deletion_unseen_in_view_s=5",
    "filter.near_range_m=0",
    "guidance.heading_gain_1_s=2",
    "orbit.margin=mahalanobis",
    "orbit.margin_sds=1.645",
    "orbit.centre_jump=innovation",
    "orbit.centre=filtered",
    "orbit.pointing=group-centre",
    "orbit.time_constant_s=0",
    "orbit.acceleration_max_m_s2=1",
    "orbit.closing_speed_max_m_s=10",
    "orbit.readmission_radius_fraction=0.9",
    "orbit.radius_above_turn_limit=false",
    "groups.count=half-of-uavs",
    "groups.removal=furthest-from-centre",
    "groups.assignment_switching_cost=0.5",
    "groups.search_lost_targets=false",
    "groups.handoff_margin_m=0",
    "groups.regrouping_period_s=0",
    "separation=false",
];

/// The same values of the default law.
pub(crate) const DEFAULT_VALUES: [&str; 20] = [
    "filter.deletion_unseen_in_view_s=2",
    "filter.near_range_m=300",
    "guidance.heading_gain_1_s=1",
    "orbit.margin=standard-deviations",
    "orbit.margin_sds=0",
    "orbit.centre_jump=shift-state",
    "orbit.centre=enclosing-circle",
    "orbit.pointing=angular-midpoint",
    "orbit.time_constant_s=1.5",
    "orbit.acceleration_max_m_s2=2.5",
    "orbit.closing_speed_max_m_s=25",
    "orbit.readmission_radius_fraction=0.97",
    "orbit.radius_above_turn_limit=true",
    "groups.count=as-needed",
    "groups.removal=largest-radius-reduction",
    "groups.assignment_switching_cost=10",
    "groups.search_lost_targets=true",
    "groups.handoff_margin_m=50",
    "groups.regrouping_period_s=30",
    "separation={}",
];

/// Settings for a margin in metres that replaces (16); it is not part of the paper's law.
pub(crate) const IN_METRES: [&str; 3] =
    ["orbit.margin=standard-deviations", "orbit.margin_sds=1.645", "orbit.centre_jump=shift-state"];

/// Number of runs, seeds, threads and traffic files of a reproduction.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Number of runs; at least two, because an interval needs two.
    pub runs: u32,
    /// Seed of the first run; each further run uses the next seed.
    pub first_seed: u64,
    /// Number of threads; one per core if `None`. It does not affect the results.
    pub threads: Option<NonZeroUsize>,
    /// Traffic files on which the studies improvements and coverage are run, too.
    pub traffic: Vec<PathBuf>,
}

impl Plan {
    /// Returns the range of seeds.
    pub(crate) fn seeds(&self) -> Range<u64> {
        self.first_seed..self.first_seed + u64::from(self.runs)
    }

    /// Calls `observe` with the scenario of each seed; returns the results in the order of the seeds.
    pub(crate) fn each<T: Send>(
        &self,
        scenario: &str,
        set: &[&str],
        observe: impl Fn(&Scenario) -> Result<T, Failure> + Sync,
    ) -> Result<Vec<T>, Failure> {
        self.observe(&ScenarioVariant::of(scenario, set), observe)
    }

    /// Calls `observe` with a mission's scenario of each seed; returns the results in the order of the seeds.
    pub(crate) fn observe<T: Send>(
        &self,
        mission: &ScenarioVariant,
        observe: impl Fn(&Scenario) -> Result<T, Failure> + Sync,
    ) -> Result<Vec<T>, Failure> {
        let template = mission.template()?;
        let results = each_seed(&template, self.seeds(), self.threads, |scenario| match &mission.streets {
            None => observe(scenario),
            Some(streets) => observe(&template.clone().over(streets.traffic(scenario.seed)?).draw(scenario.seed)?),
        });
        results.map_err(Failure::running)?.into_iter().collect()
    }

    /// Flies and scores all seeds; returns the metrics in the order of the seeds.
    pub(crate) fn fly(&self, mission: &ScenarioVariant, choice: MetricSelection) -> Result<Vec<Metrics>, Failure> {
        if mission.streets.is_none() {
            return fly_all(&mission.template()?, self.seeds(), choice, self.threads).map_err(Failure::running);
        }
        self.observe(mission, |scenario| fly(scenario, choice).map_err(|errors| invalid_parameters(&errors)))
    }

    /// Returns the scenario of the first seed.
    pub(crate) fn first(&self, scenario: &str, set: &[&str]) -> Result<Scenario, Failure> {
        ScenarioVariant::of(scenario, set).template()?.draw(self.first_seed).map_err(Failure::running)
    }
}

/// A scenario with changes.
#[derive(Debug, Clone)]
pub(crate) struct ScenarioVariant {
    scenario: String,
    overrides: Overrides,
    /// Random streets whose traffic, drawn from the seed, replaces that of the scenario.
    streets: Option<Streets>,
}

impl ScenarioVariant {
    /// Selects a built-in scenario with these values set.
    pub(crate) fn of(scenario: &str, set: &[&str]) -> Self {
        Self { scenario: scenario.to_owned(), overrides: Overrides::default(), streets: None }.and(set)
    }

    /// Selects a traffic file, with the settings of `traffic/convoy`.
    pub(crate) fn over(file: &Path, set: &[&str]) -> Self {
        let overrides = Overrides { traffic: vec![file.to_owned()], ..Overrides::default() };
        Self { scenario: "traffic/convoy".to_owned(), overrides, streets: None }.and(set)
    }

    /// Selects traffic on random streets, with the settings of `traffic/convoy`.
    pub(crate) fn streets(streets: Streets) -> Self {
        Self { streets: Some(streets), ..Self::of("traffic/convoy", &[]) }
    }

    /// Sets the number of UAVs.
    #[must_use]
    pub(crate) fn with_uavs(mut self, uavs: u32) -> Self {
        self.overrides.uavs = Some(uavs);
        self
    }

    /// Returns a copy with further values set.
    #[must_use]
    pub(crate) fn and(&self, set: &[&str]) -> Self {
        let mut more = self.clone();
        more.overrides.set.extend(set.iter().map(|edit| (*edit).to_owned()));
        more
    }

    fn template(&self) -> Result<ScenarioTemplate, Failure> {
        Ok(ScenarioTemplate::load(&self.scenario, &self.overrides)?)
    }
}

/// Returns the name of a file without its folders.
pub(crate) fn file_name(file: &Path) -> String {
    file.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
}

/// Returns the values of a metric in the runs that have it.
pub(crate) fn measured(runs: &[Metrics], metric: &str) -> Vec<f64> {
    runs.iter().filter_map(|run| run[metric]).collect()
}

/// Returns the time of a frame, s.
pub(crate) fn time_s(frame: &Frame) -> f64 {
    frame.time_us as f64 * 1e-6
}

/// Converts parameter errors of a mission.
fn invalid_parameters(errors: &[ParamError]) -> Failure {
    Failure::Running(errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))
}

/// Flies a mission and calls `observe` with every frame.
pub(crate) fn watch(scenario: &Scenario, mut observe: impl FnMut(&Frame)) -> Result<(), Failure> {
    let mut mission = Mission::new(scenario).map_err(|errors| invalid_parameters(&errors))?;
    while let Some(frame) = mission.frame() {
        observe(frame);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use standoff::Law;

    use super::*;

    /// With the values of the other law, only the name of the law differs from it.
    #[test]
    fn the_laws_differ_by_their_guidance_and_the_listed_values() {
        let settings = |set: &[&str]| {
            let set = set.iter().map(|edit| (*edit).to_owned()).collect();
            Scenario::load("paper/figure-9", &Overrides { set, ..Overrides::default() }, 7).unwrap().settings
        };
        let own = "guidance.law=standoff";
        let mut papers = settings(&[&[own][..], &PAPER_VALUES].concat());
        papers.team.guidance.law = Law::Oh2015;
        assert_eq!(papers, settings(&[]));
        let mut default = settings(&DEFAULT_VALUES);
        default.team.guidance.law = Law::Standoff;
        assert_eq!(default, settings(&[own]));
    }

    #[test]
    fn results_are_in_the_order_of_the_seeds() {
        let plan = Plan { runs: 40, first_seed: 7, threads: None, traffic: Vec::new() };
        let seeds = plan.each("tour/01-one-uav", &[], |scenario| Ok(scenario.seed)).map_err(|_| ()).unwrap();
        assert_eq!(seeds, (7..47).collect::<Vec<_>>());
    }
}
