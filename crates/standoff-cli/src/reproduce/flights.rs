//! Flying one scenario with many seeds, on all cores; results come in the order of the seeds.

use std::ops::Range;

use standoff::ParamError;
use standoff_sim::monte_carlo::each_seed;
use standoff_sim::record::Frame;
use standoff_sim::run::{Mission, fly};
use standoff_sim::scenario::{Edits, Scenario, Template};
use standoff_sim::score::{Choice, Metrics};

use crate::failure::Failure;

/// A margin in metres in place of (16), which is not the paper's.
pub(crate) const IN_METRES: [&str; 2] = ["orbit.margin=standard-deviations", "orbit.on_membership_change=shift"];

/// Which seeds are flown.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Plan {
    /// How many runs, at least two: one has no spread.
    pub(crate) runs: u32,
    /// The seed of the first; the next has the next.
    pub(crate) first_seed: u64,
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
        let looked = each_seed(&template(scenario, set)?, self.seeds(), None, look);
        looked.map_err(Failure::running)?.into_iter().collect()
    }

    /// The scenario of the first seed.
    pub(crate) fn first(&self, scenario: &str, set: &[&str]) -> Result<Scenario, Failure> {
        template(scenario, set)?.draw(self.first_seed).map_err(Failure::running)
    }
}

fn template(scenario: &str, set: &[&str]) -> Result<Template, Failure> {
    let edits = Edits { set: set.iter().map(|edit| (*edit).to_owned()).collect(), ..Edits::default() };
    Template::load(scenario, &edits).map_err(Failure::running)
}

/// Flies a mission and scores it.
pub(crate) fn score(scenario: &Scenario, choice: Choice) -> Result<Metrics, Failure> {
    fly(scenario, choice).map_err(refused)
}

/// Flies a mission and shows every frame.
pub(crate) fn watch(scenario: &Scenario, mut look: impl FnMut(&Frame)) -> Result<(), Failure> {
    let mut mission = Mission::new(scenario).map_err(refused)?;
    while let Some(frame) = mission.frame() {
        look(&frame);
    }
    Ok(())
}

fn refused(errors: Vec<ParamError>) -> Failure {
    Failure::running(errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_come_in_the_order_of_the_seeds() {
        let plan = Plan { runs: 40, first_seed: 7 };
        let seeds = plan.each("tour/01-one-uav", &[], |scenario| Ok(scenario.seed)).map_err(|_| ()).unwrap();
        assert_eq!(seeds, (7..47).collect::<Vec<_>>());
    }
}
