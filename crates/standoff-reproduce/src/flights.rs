//! Flying one scenario with many seeds, on all cores; results come in the order of the seeds.

use std::num::NonZeroUsize;
use std::ops::Range;
use std::path::{Path, PathBuf};

use standoff_sim::monte_carlo::{each_seed, fly_all};
use standoff_sim::record::Frame;
use standoff_sim::run::Mission;
use standoff_sim::scenario::{Edits, Scenario, Template};
use standoff_sim::score::{Choice, Metrics};

use crate::failure::Failure;

/// A margin in metres in place of (16), which is not the paper's.
pub(crate) const IN_METRES: [&str; 2] = ["orbit.margin=standard-deviations", "orbit.on_membership_change=shift"];

/// Which seeds are flown.
#[derive(Debug, Clone)]
pub struct Plan {
    /// How many runs, at least two: one has no spread.
    pub runs: u32,
    /// The seed of the first; the next has the next.
    pub first_seed: u64,
    /// On so many threads; one per core if `None`. Makes no difference but in time.
    pub threads: Option<NonZeroUsize>,
    /// Traffic files over which the improvements are flown, too.
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
        let looked = each_seed(&Flown::of(scenario, set).template()?, self.seeds(), self.threads, look);
        looked.map_err(Failure::running)?.into_iter().collect()
    }

    /// Flies and scores every seed, in order.
    pub(crate) fn fly(&self, mission: &Flown, choice: Choice) -> Result<Vec<Metrics>, Failure> {
        fly_all(&mission.template()?, self.seeds(), choice, self.threads).map_err(Failure::running)
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
}

impl Flown {
    /// A built-in scenario with these values set.
    pub(crate) fn of(scenario: &str, set: &[&str]) -> Self {
        Self { scenario: scenario.to_owned(), edits: Edits::default() }.and(set)
    }

    /// Flown over a traffic file, with the settings of `traffic/convoy`.
    pub(crate) fn over(file: &Path, set: &[&str]) -> Self {
        let edits = Edits { traffic: Some(file.to_owned()), ..Edits::default() };
        Self { scenario: "traffic/convoy".to_owned(), edits }.and(set)
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

/// Flies a mission and shows every frame.
pub(crate) fn watch(scenario: &Scenario, mut look: impl FnMut(&Frame)) -> Result<(), Failure> {
    let mut mission = Mission::new(scenario)
        .map_err(|errors| Failure::Running(errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")))?;
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
