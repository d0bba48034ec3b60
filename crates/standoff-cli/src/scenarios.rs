//! `standoff scenarios` and `standoff check`.

use standoff_results::{Failure, Maps, count, warn};
use standoff_sim::scenario::{BUILT_IN, Overrides, Scenario, built_in, built_in_like, schema};

use crate::terminal::{note, print};

/// Lists the built-in scenarios, or prints one.
pub(crate) fn show(name: Option<&str>) -> Result<(), Failure> {
    let Some(name) = name else {
        let width = BUILT_IN.iter().map(|scenario| scenario.name.len()).max().unwrap_or_default();
        let mut list = String::new();
        for scenario in BUILT_IN {
            let about = Scenario::load(scenario.name, &Overrides::default(), 1).map_err(Failure::running)?.about;
            list += &format!("{:width$}  {about}\n", scenario.name);
        }
        return print(&list);
    };
    let found = built_in(name).ok_or_else(|| {
        let hint = built_in_like(name).map_or_else(String::new, |hint| format!("; {hint}"));
        Failure::Input(format!("{name}: no built-in scenario has this name; `standoff scenarios` lists them{hint}"))
    })?;
    print(found.text)
}

/// Prints the JSON schema of scenario files.
pub(crate) fn show_schema() -> Result<(), Failure> {
    print(&format!("{:#}\n", schema()))
}

/// Checks a scenario and the files it names.
pub(crate) fn check(file: &str) -> Result<(), Failure> {
    let scenario = Scenario::load(file, &Overrides::default(), 1).map_err(Failure::Scenario)?;
    warn(&scenario, &format!("{file}: "), &note);
    // A run also writes the resolved scenario, so that this must work, too.
    scenario.resolved().map_err(Failure::Scenario)?;
    Maps::default().of_scenario(&scenario, &note)?;
    print(&format!("{file}: valid ({}, {} s)\n", count(scenario.uavs.len(), "UAV"), scenario.settings.duration.s()))
}
