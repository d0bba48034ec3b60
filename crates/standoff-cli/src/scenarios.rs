//! `standoff scenarios` and `standoff check`.

use clap::Subcommand;
use standoff_app::{Failure, Maps, warn};
use standoff_io::display_text::count;
use standoff_sim::scenario::{BUILT_IN, Overrides, Scenario, built_in, built_in_like, schema};

use crate::terminal::{note, print};

/// Subcommands of `standoff scenarios`; without one, it lists the scenarios.
#[derive(Subcommand)]
pub(crate) enum Action {
    /// Print a built-in scenario.
    Show {
        /// The scenario's name.
        name: String,
    },
    /// Print the JSON schema of scenario files, for completion and checks in editors.
    Schema,
}

pub(crate) fn run(action: Option<Action>) -> Result<(), Failure> {
    match action {
        None => list(),
        Some(Action::Show { name }) => show(&name),
        Some(Action::Schema) => print(&format!("{:#}\n", schema())),
    }
}

fn list() -> Result<(), Failure> {
    let width = BUILT_IN.iter().map(|scenario| scenario.name.len()).max().unwrap_or_default();
    let mut list = String::new();
    for scenario in BUILT_IN {
        let about = Scenario::load(scenario.name, &Overrides::default(), 1).map_err(Failure::running)?.settings.about;
        list += &format!("{:width$}  {about}\n", scenario.name);
    }
    print(&list)
}

fn show(name: &str) -> Result<(), Failure> {
    let found = built_in(name).ok_or_else(|| {
        let hint = built_in_like(name).map_or_else(String::new, |hint| format!("; {hint}"));
        Failure::Input(format!("{name}: no built-in scenario has this name; `standoff scenarios` lists them{hint}"))
    })?;
    print(found.text)
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
