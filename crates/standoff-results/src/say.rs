//! What is told beside the results.

use standoff_sim::scenario::Scenario;

/// Who is told, line by line, what is odd and what is noteworthy beside the results.
pub type Say<'a> = &'a dyn Fn(&str);

/// Tells what is odd about a scenario that can be flown all the same, after `of`.
pub fn warn(scenario: &Scenario, of: &str, say: Say) {
    scenario.warnings.iter().for_each(|warning| say(&format!("warning: {of}{warning}")));
}
