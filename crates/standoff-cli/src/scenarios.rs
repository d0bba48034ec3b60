//! `standoff scenarios` and `standoff check`.

use standoff_results::{Failure, Maps, count, warn};
use standoff_sim::scenario::{BUILT_IN, Edits, Scenario, built_in, built_in_like, schema};

use crate::speech::{note, print};

/// Lists the built-in scenarios, or prints one.
pub(crate) fn show(name: Option<&str>) -> Result<(), Failure> {
    let Some(name) = name else {
        let width = BUILT_IN.iter().map(|scenario| scenario.name.len()).max().unwrap_or_default();
        let mut list = String::new();
        for scenario in BUILT_IN {
            let about = Scenario::load(scenario.name, &Edits::default(), 1).map_err(Failure::running)?.about;
            list += &format!("{:width$}  {about}\n", scenario.name);
        }
        return print(&list);
    };
    let found = built_in(name).ok_or_else(|| {
        let like = built_in_like(name).map_or_else(String::new, |like| format!("; {like}"));
        Failure::Input(format!("{name}: no built-in scenario of that name; `standoff scenarios` lists them{like}"))
    })?;
    print(found.text)
}

/// Prints the JSON schema of scenario files.
pub(crate) fn show_schema() -> Result<(), Failure> {
    print(&format!("{:#}\n", schema()))
}

/// Checks a scenario.
pub(crate) fn check(file: &str) -> Result<(), Failure> {
    let scenario = Scenario::load(file, &Edits::default(), 1).map_err(Failure::Scenario)?;
    warn(&scenario, &format!("{file}: "), &note);
    // What is flown has to be spelt out, too.
    scenario.resolved().map_err(Failure::Scenario)?;
    Maps::default().of_scenario(&scenario, &note)?;
    print(&format!("{file}: good ({}, {} s)\n", count(scenario.uavs.len(), "UAV"), scenario.settings.duration.s()))
}
