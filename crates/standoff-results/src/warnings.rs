//! Warnings and notes in addition to the results.

use standoff_sim::scenario::Scenario;

/// Callback for warnings and notes, one line per call.
pub type Warnings<'a> = &'a dyn Fn(&str);

/// Passes the non-fatal warnings about a scenario to `say`, each with the prefix `of`.
pub fn warn(scenario: &Scenario, of: &str, say: Warnings) {
    scenario.warnings.iter().for_each(|warning| say(&format!("warning: {of}{warning}")));
}
