//! Flying one scenario with many seeds, on all cores; results come in the order of the seeds.

use std::num::NonZeroUsize;
use std::ops::Range;
use std::path::{Path, PathBuf};

use standoff::ParamError;
use standoff_sim::monte_carlo::{each_seed, fly_all};
use standoff_sim::record::Frame;
use standoff_sim::run::{Mission, fly};
use standoff_sim::scenario::{Edits, Scenario, Template};
use standoff_sim::score::{Choice, Metrics};

use crate::failure::Failure;
use crate::streets::Streets;

/// The paper's law, for missions that are flown otherwise. Over traffic `guidance.lead_s` stays the scenario's.
pub const PAPERS_LAW: [&str; 16] = [
    "filter.lost_in_view_s=5",
    "guidance.feedforward=exact",
    "guidance.turn_rate_gain=0",
    "guidance.heading_gain_1_s=2",
    "guidance.lead=constant",
    "guidance.speed_reference=ground",
    "orbit.margin=mahalanobis",
    "orbit.on_membership_change=filter",
    "orbit.centre=filtered",
    "orbit.aim=centre",
    "orbit.response_s=0",
    "orbit.take_back_fraction=0.9",
    "groups.count=half",
    "groups.discard=furthest",
    "groups.assignment_inertia=0.5",
    "groups.search=none",
];

/// A margin in metres in place of (16), which is not the paper's.
pub(crate) const IN_METRES: [&str; 3] =
    ["orbit.margin=standard-deviations", "orbit.margin_sds=1.645", "orbit.on_membership_change=shift"];

/// Which seeds are flown.
#[derive(Debug, Clone)]
pub struct Plan {
    /// How many runs, at least two: one has no spread.
    pub runs: u32,
    /// The seed of the first; the next has the next.
    pub first_seed: u64,
    /// On so many threads; one per core if `None`. Makes no difference but in time.
    pub threads: Option<NonZeroUsize>,
    /// Traffic files over which improvements and coverage are flown, too.
    pub traffic: Vec<PathBuf>,
}

impl Plan {
    /// Every seed.
    pub(crate) fn seeds(&self) -> Range<u64> {
        self.first_seed..self.first_seed + u64::from(self.runs)
    }

    /// The scenario of each seed through `look`, in the order of the seeds.
    pub(crate) fn each<T: Send>(
        &self,
        scenario: &str,
        set: &[&str],
        look: impl Fn(&Scenario) -> Result<T, Failure> + Sync,
    ) -> Result<Vec<T>, Failure> {
        self.look(&Flown::of(scenario, set), look)
    }

    /// The scenario of each seed of a mission through `look`, in the order of the seeds.
    pub(crate) fn look<T: Send>(
        &self,
        mission: &Flown,
        look: impl Fn(&Scenario) -> Result<T, Failure> + Sync,
    ) -> Result<Vec<T>, Failure> {
        let template = mission.template()?;
        let looked = each_seed(&template, self.seeds(), self.threads, |scenario| match &mission.streets {
            None => look(scenario),
            Some(streets) => look(&template.clone().over(streets.traffic(scenario.seed)?).draw(scenario.seed)?),
        });
        looked.map_err(Failure::running)?.into_iter().collect()
    }

    /// Flies and scores every seed, in order.
    pub(crate) fn fly(&self, mission: &Flown, choice: Choice) -> Result<Vec<Metrics>, Failure> {
        if mission.streets.is_none() {
            return fly_all(&mission.template()?, self.seeds(), choice, self.threads).map_err(Failure::running);
        }
        self.look(mission, |scenario| fly(scenario, choice).map_err(|errors| refused(&errors)))
    }

    /// The scenario of the first seed.
    pub(crate) fn first(&self, scenario: &str, set: &[&str]) -> Result<Scenario, Failure> {
        Flown::of(scenario, set).template()?.draw(self.first_seed).map_err(Failure::running)
    }
}

/// A scenario and what is changed about it.
#[derive(Debug, Clone)]
pub(crate) struct Flown {
    scenario: String,
    edits: Edits,
    /// Instead of the scenario's traffic, that of streets drawn from the seed.
    streets: Option<Streets>,
}

impl Flown {
    /// A built-in scenario with these values set.
    pub(crate) fn of(scenario: &str, set: &[&str]) -> Self {
        Self { scenario: scenario.to_owned(), edits: Edits::default(), streets: None }.and(set)
    }

    /// Flown over a traffic file, with the settings of `traffic/convoy`.
    pub(crate) fn over(file: &Path, set: &[&str]) -> Self {
        let edits = Edits { traffic: Some(file.to_owned()), ..Edits::default() };
        Self { scenario: "traffic/convoy".to_owned(), edits, streets: None }.and(set)
    }

    /// Flown over streets drawn from the seed, with the settings of `traffic/convoy`.
    pub(crate) fn streets(streets: Streets) -> Self {
        Self { streets: Some(streets), ..Self::of("traffic/convoy", &[]) }
    }

    /// The same with so many UAVs.
    #[must_use]
    pub(crate) fn with_uavs(mut self, uavs: u32) -> Self {
        self.edits.uavs = Some(uavs);
        self
    }

    /// The same with further values set.
    #[must_use]
    pub(crate) fn and(&self, set: &[&str]) -> Self {
        let mut more = self.clone();
        more.edits.set.extend(set.iter().map(|edit| (*edit).to_owned()));
        more
    }

    fn template(&self) -> Result<Template, Failure> {
        Ok(Template::load(&self.scenario, &self.edits)?)
    }
}

/// Name of a file without its folders.
pub(crate) fn file_name(file: &Path) -> String {
    file.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned())
}

/// A metric of the runs that have it.
pub(crate) fn measured(runs: &[Metrics], metric: &str) -> Vec<f64> {
    runs.iter().filter_map(|run| run.value(metric)).collect()
}

/// Time of a frame, s.
pub(crate) fn time_s(frame: &Frame) -> f64 {
    frame.time_us as f64 * 1e-6
}

/// What is wrong with a mission's parameters.
fn refused(errors: &[ParamError]) -> Failure {
    Failure::Running(errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))
}

/// Flies a mission and shows every frame.
pub(crate) fn watch(scenario: &Scenario, mut look: impl FnMut(&Frame)) -> Result<(), Failure> {
    let mut mission = Mission::new(scenario).map_err(|errors| refused(&errors))?;
    while let Some(frame) = mission.frame() {
        look(frame);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_come_in_the_order_of_the_seeds() {
        let plan = Plan { runs: 40, first_seed: 7, threads: None, traffic: Vec::new() };
        let seeds = plan.each("tour/01-one-uav", &[], |scenario| Ok(scenario.seed)).map_err(|_| ()).unwrap();
        assert_eq!(seeds, (7..47).collect::<Vec<_>>());
    }
}
