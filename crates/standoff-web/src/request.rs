//! What a page asks for: a scenario with changes, and a seed.

use std::fmt::Display;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use standoff_app::Failure;
use standoff_io::bounded_input;
use standoff_sim::scenario::{BUILT_IN, Overrides, Scenario, ScenarioError, ScenarioTemplate};
use wasm_bindgen::prelude::wasm_bindgen;

/// Mission that a page asks for.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Request {
    /// Name of a built-in scenario, or of the text.
    pub scenario: String,
    /// Text of a scenario file instead of a built-in one.
    pub text: Option<String>,
    /// Changes, `KEY=VALUE` each, as for `--set`.
    pub set: Vec<String>,
    /// Traffic files that replace the targets. They are given with [`give_file`].
    pub traffic: Vec<PathBuf>,
    /// Maps that replace those of the scenario, given likewise.
    pub maps: Vec<PathBuf>,
    /// Number of UAVs, with automatic starts.
    pub uavs: Option<u32>,
    /// Whether the record is kept, for [`Flight::record`](crate::Flight::record).
    pub is_recorded: bool,
    /// Seed, as text because JavaScript numbers have only 53 bits.
    pub seed: String,
}

impl Request {
    /// Reads a request as JSON.
    pub fn of_json(json: &str) -> Result<Self, String> {
        serde_json::from_str(json).map_err(|error| format!("error: the request is wrong: {error}"))
    }

    /// The scenario before anything is drawn. The error is the message that the command would print.
    pub fn template(&self) -> Result<ScenarioTemplate, String> {
        let Self { set, traffic, maps, uavs, .. } = self.clone();
        let overrides = Overrides { set, traffic, uavs, maps, origin: None };
        let template = match &self.text {
            Some(text) => ScenarioTemplate::of_toml(&self.scenario, text, &overrides, Path::new("")),
            None => ScenarioTemplate::load(&self.scenario, &overrides),
        };
        template.map_err(message_of)
    }

    /// The seed as a number.
    pub fn seed(&self) -> Result<u64, String> {
        let what = || format!("error: the seed {:?} must be a whole number from 0 to {}", self.seed, u64::MAX);
        self.seed.parse().map_err(|_| what())
    }

    /// Draws the scenario.
    pub fn scenario(&self) -> Result<Scenario, String> {
        let seed = self.seed()?;
        self.template()?.draw(seed).map_err(message_of)
    }
}

/// The message that the command prints for a scenario that cannot be used.
pub(crate) fn message_of(error: ScenarioError) -> String {
    Failure::Scenario(error).message(false).join("\n")
}

/// Formats wrong parameters, one per line.
pub(crate) fn format_errors(errors: &[impl Display]) -> String {
    errors.iter().map(|error| format!("error: {error}")).collect::<Vec<_>>().join("\n")
}

/// Gives a file of the page: traffic and maps of this name are read from these bytes.
#[wasm_bindgen(js_name = giveFile)]
pub fn give_file(name: &str, bytes: Vec<u8>) {
    bounded_input::give(Path::new(name), bytes.into());
}

/// Texts of the built-in scenarios by name, as a JSON object.
#[must_use]
pub fn scenarios() -> String {
    let texts = BUILT_IN.iter().map(|scenario| (scenario.name.to_owned(), scenario.text.into()));
    serde_json::Value::Object(texts.collect()).to_string()
}
