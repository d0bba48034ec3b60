//! Scenarios: reads a scenario file and resolves it to everything a run needs.
//!
//! A scenario is TOML (see [`schema_types`] for the keys). [`Scenario::load`] reads it, applies the changes of the
//! command line, draws the values given as distributions, fills in the defaults and checks every range. The result can
//! be written as text with every value spelt out; the record stores that text.

mod basemap;
mod buildings;
mod builtin;
mod diagnostics;
mod dotted;
mod earth;
mod error;
mod geofence;
mod load;
mod locate;
mod number;
mod parameters;
mod parse;
mod polygons;
mod priorities;
mod resolve;
mod resolved;
mod sample;
mod schema;
pub mod schema_types;
mod start;
#[cfg(test)]
mod tests;
mod text;
mod traffic;
mod validate;
mod warnings;

use std::path::{Path, PathBuf};
use std::sync::Arc;

pub use basemap::{MAPS_MAX, MapFile};
pub use builtin::{BUILT_IN, BuiltIn, built_in, built_in_like};
pub use error::{Excerpt, Problem, ScenarioError};
pub use load::{Overrides, name_of};
pub use locate::SourcePosition;
pub use number::{Distribution, Number};
pub use parse::MISTAKES_MAX;
pub use resolved::{Intruder, Scenario, SensorModel, Settings, Targets};
pub use schema::schema;
pub(crate) use schema_types::uav_of;
pub use schema_types::{AgentSetup, Clock, Link, Manoeuvre, Outage, Partition, Radio, Restart};

use crate::traffic::Traffic;

impl Scenario {
    /// Loads a built-in scenario by name, or a scenario file, for a seed.
    pub fn load(name_or_file: &str, overrides: &Overrides, seed: u64) -> Result<Self, ScenarioError> {
        ScenarioTemplate::load(name_or_file, overrides)?.draw(seed)
    }

    /// Returns the scenario as text with every value spelt out; loading this text gives the same run.
    pub fn resolved(&self) -> Result<String, ScenarioError> {
        text::text(&self.name, &self.file, None)
    }
}

/// A scenario before anything is drawn; one template serves every seed.
///
/// ```
/// use standoff_sim::scenario::{Overrides, ScenarioTemplate};
///
/// // A template is read once and drawn for any number of seeds.
/// let template = ScenarioTemplate::load("paper/table-2-pair", &Overrides::default())?;
/// let (first, second) = (template.draw(1)?, template.draw(2)?);
/// assert_eq!(first.settings, second.settings);
/// assert_ne!(first.resolved()?, second.resolved()?);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct ScenarioTemplate {
    typed: load::Typed,
    traffic: Option<Arc<Traffic>>,
}

impl ScenarioTemplate {
    /// Loads a built-in scenario by name, or a scenario file, and the traffic file it names.
    pub fn load(name_or_file: &str, overrides: &Overrides) -> Result<Self, ScenarioError> {
        Self::with_traffic(load::Typed::load(name_or_file, overrides)?, None)
    }

    /// Loads a scenario from a text returned by [`Self::text`], and the traffic files it names: built-in ones, or
    /// path relative to the current folder. Any `traffic` replaces the files.
    pub fn of_text(name: &str, text: &str, traffic: &[PathBuf]) -> Result<Self, ScenarioError> {
        let mut typed = load::Typed::of_text(name, text)?;
        if typed.file.traffic.is_some() && !traffic.is_empty() {
            let files = traffic.iter().map(|file| file.to_string_lossy().into_owned()).collect::<Vec<_>>();
            typed.set("traffic.file", files.into())?;
        }
        Self::with_traffic(typed, None)
    }

    /// Loads a scenario called `name` from TOML, changed by `overrides`. Paths of traffic files and maps are relative
    /// to `folder`.
    pub fn of_toml(name: &str, toml: &str, overrides: &Overrides, folder: &Path) -> Result<Self, ScenarioError> {
        Self::with_traffic(load::Typed::of_toml(name, toml, overrides, folder)?, None)
    }

    /// Loads the same scenario with further changes (`KEY=VALUE`, as in [`Overrides::set`]). The traffic files are read
    /// again only if the changes concern `traffic`.
    pub fn changed(&self, set: &[String]) -> Result<Self, ScenarioError> {
        let mut typed = self.typed.changed(set)?;
        if load::sets(set, "traffic") {
            return Self::with_traffic(typed, None);
        }
        // `of_text` may have replaced the files of the text.
        if let Some(files) = dotted::value_at(&self.typed.table, "traffic.file") {
            typed.set("traffic.file", files.clone())?;
        }
        Self::with_traffic(typed, self.traffic.as_ref())
    }

    /// Reads the traffic files, unless their traffic is `known`. Returns all errors together: those in the form of the
    /// scenario, in its ranges, and in those files.
    fn with_traffic(mut typed: load::Typed, known: Option<&Arc<Traffic>>) -> Result<Self, ScenarioError> {
        let (traffic, mut problems) = match traffic::read(&typed, known) {
            Ok(traffic) => {
                let origin = typed.origin_on_earth(traffic.as_deref());
                geofence::spell_out(&mut typed, traffic.as_deref())?;
                buildings::spell_out(&mut typed, origin)?;
                priorities::spell_out(&mut typed, traffic.as_deref())?;
                if typed.problems.is_empty() {
                    return Ok(Self { typed, traffic });
                }
                (traffic, Vec::new())
            }
            Err(error) if error.is_io_error => return Err(error),
            Err(error) => (None, error.problems),
        };
        if let Err(error) = resolve::checked(&typed, traffic.as_deref(), 0) {
            problems.splice(..0, error.problems);
        }
        Err(problems.into())
    }

    /// Replaces the traffic of a scenario that has traffic; leaves other scenarios unchanged.
    #[must_use]
    pub fn over(mut self, traffic: Traffic) -> Self {
        self.traffic = self.traffic.map(|_| Arc::new(traffic));
        self
    }

    /// Name of the scenario.
    pub fn name(&self) -> &str {
        &self.typed.name
    }

    /// Returns the scenario before anything is drawn, as TOML in a unique spelling: with the changes of the command
    /// line and with defaults. It contains only the name of a traffic file: see [`Self::traffic_crc32`].
    pub fn text(&self) -> Result<String, ScenarioError> {
        self.typed.text()
    }

    /// Paths of the traffic files that are not built in.
    pub fn traffic_files(&self) -> Vec<PathBuf> {
        traffic::files(&self.typed)
    }

    /// Checksum of the traffic that was read, independent of the file's name and format.
    pub fn traffic_crc32(&self) -> Option<u32> {
        self.traffic.as_ref().map(|traffic| traffic.crc32())
    }

    /// True if the positions of its runs have a latitude and longitude.
    pub fn is_geographic(&self) -> bool {
        self.traffic.as_ref().is_some_and(|traffic| traffic.origin.is_some())
    }

    /// Returns the scenario of a seed.
    pub fn draw(&self, seed: u64) -> Result<Scenario, ScenarioError> {
        resolve::resolve(&self.typed, self.traffic.as_ref(), seed)
    }
}

impl Settings {
    /// Returns the settings of a resolved scenario as stored in a record; `label` names it in messages, `target_names`
    /// are those of the record. No traffic file is needed.
    pub fn of_record(label: &str, resolved: &str, target_names: &[String]) -> Result<Self, ScenarioError> {
        resolve::settings_of_record(&load::Typed::of_text(label, resolved)?, target_names)
    }
}
