//! Warnings and notes in addition to the results.

use standoff_sim::scenario::Scenario;

/// Callback for warnings and notes, one line per call.
pub type Warnings<'a> = &'a dyn Fn(&str);

/// Passes the non-fatal warnings about a scenario to `on_warning`, each with the prefix `of`.
pub fn warn(scenario: &Scenario, of: &str, on_warning: Warnings) {
    scenario.warnings.iter().for_each(|warning| on_warning(&format!("warning: {of}{warning}")));
}
