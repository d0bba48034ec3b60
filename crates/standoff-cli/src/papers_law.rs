//! The paper's law beside a run: the same mission under it.

use standoff_reproduce::PAPERS_LAW;
use standoff_results::{Failure, refused};
use standoff_sim::run::fly;
use standoff_sim::scenario::Scenario;
use standoff_sim::score::{Choice, Metrics};

use crate::changes::{Changes, DEFAULT_SCENARIO};

/// The lead of the paper's law, which over traffic is the scenario's own.
const LEAD: &str = "guidance.lead_s=3";

/// What the paper's law comes to in the mission that is flown where none is named, changed alike, from the same starts
/// and with the same seed. What somebody chose, mission or metrics, is told alone.
pub(crate) fn of(
    named: Option<&str>,
    changes: &Changes,
    seed: u64,
    choice: Choice,
) -> Result<Option<Metrics>, Failure> {
    if named.is_some() || choice != Choice::standard() || changes.scenario(None, DEFAULT_SCENARIO) != DEFAULT_SCENARIO {
        return Ok(None);
    }
    let edits = changes.edits_and(&set())?;
    let scenario = Scenario::load(DEFAULT_SCENARIO, &edits, seed).map_err(Failure::Scenario)?;
    fly(&scenario, choice).map(Some).map_err(|errors| Failure::Input(refused(&errors)))
}

/// What turns a mission into one that flies it.
fn set() -> Vec<String> {
    PAPERS_LAW.iter().chain(&[LEAD]).map(|key| (*key).to_owned()).collect()
}

#[cfg(test)]
mod tests {
    use standoff_sim::scenario::Edits;

    use super::*;

    /// What is switched is the law and nothing else: the starts are the same, and the settings are those of the paper's
    /// own mission.
    #[test]
    fn it_differs_by_the_law_alone() {
        let set = set();
        let load = |name: &str, set: &[String]| {
            Scenario::load(name, &Edits { set: set.to_vec(), ..Edits::default() }, 7).unwrap()
        };
        let (flown, beside) = (load(DEFAULT_SCENARIO, &[]), load(DEFAULT_SCENARIO, &set));
        let paper = load("paper/figure-9", &[]);
        assert_eq!(flown.uavs, beside.uavs);
        assert_eq!(beside.settings, paper.settings);
        assert_ne!(flown.settings, paper.settings);
    }
}
