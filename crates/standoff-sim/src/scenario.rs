//! Scenarios: one file in, everything a run needs out: typed, drawn, checked, with no option left open.
//!
//! A scenario is TOML (see [`mod@file`] for the keys). [`Scenario::load`] reads it, applies what the command line changes,
//! draws what is given as a distribution, fills in the defaults and checks every range. The result can spell every
//! value out as text, which the record keeps.

mod builtin;
mod check;
mod draw;
mod error;
pub mod file;
mod flown;
mod form;
mod load;
mod locate;
mod map;
mod number;
mod problems;
mod resolve;
mod schema;
mod start;
mod team;
#[cfg(test)]
mod tests;
mod traffic;
mod zones;

use std::path::{Path, PathBuf};
use std::sync::Arc;

pub use builtin::{BUILT_IN, BuiltIn, built_in, built_in_like};
pub use error::{Excerpt, Problem, ScenarioError};
pub use file::Minds;
pub use flown::{
    Clock, CueError, Intruder, Link, Manoeuvre, Noise, Outage, Partition, Radio, Restart, Scenario, Settings, Targets,
};
pub use form::MISTAKES_MAX;
pub use load::{Edits, name_of};
pub(crate) use load::{LENGTH_MAX, SPELT_OUT};
pub use locate::Place;
pub use map::{MAPS_MAX, MapFile};
pub use number::{Distribution, Number};
pub use schema::schema;

use crate::traffic::Traffic;

impl Scenario {
    /// Loads a built-in scenario by name, or a file.
    pub fn load(name_or_file: &str, edits: &Edits, seed: u64) -> Result<Self, ScenarioError> {
        Template::load(name_or_file, edits)?.draw(seed)
    }

    /// The scenario as text with every value spelt out; loading it gives the same run.
    pub fn resolved(&self) -> Result<String, ScenarioError> {
        resolve::text(&self.name, &self.file)
    }
}

/// A scenario before anything is drawn: one scenario for every seed.
///
/// ```
/// use standoff_sim::scenario::{Edits, Template};
///
/// // Read once, drawn for as many seeds as are wanted.
/// let template = Template::load("paper/table-2-pair", &Edits::default())?;
/// let (one, two) = (template.draw(1)?, template.draw(2)?);
/// assert_eq!(one.settings, two.settings);
/// assert_ne!(one.resolved()?, two.resolved()?);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Template {
    typed: load::Typed,
    traffic: Option<Arc<Traffic>>,
}

impl Template {
    /// Loads a built-in scenario by name, or a file, and the traffic file it names.
    pub fn load(name_or_file: &str, edits: &Edits) -> Result<Self, ScenarioError> {
        Self::with_traffic(load::Typed::load(name_or_file, edits)?)
    }

    /// The scenario that a text of [`Self::text`] tells of, with the traffic file it names: built in, or looked for from
    /// the current folder; or with `traffic` in its place.
    pub fn of_text(name: &str, text: &str, traffic: Option<&Path>) -> Result<Self, ScenarioError> {
        let mut typed = load::Typed::of_text(name, text)?;
        if let (Some(table), Some(file)) = (&mut typed.file.traffic, traffic) {
            table.file = file.to_string_lossy().into_owned();
        }
        Self::with_traffic(typed)
    }

    /// A scenario typed as TOML, changed by `edits`, called `name`. Traffic files and maps it names are looked for from
    /// `folder`.
    pub fn of_toml(name: &str, toml: &str, edits: &Edits, folder: &Path) -> Result<Self, ScenarioError> {
        Self::with_traffic(load::Typed::of_toml(name, toml, edits, folder)?)
    }

    /// With the traffic file read. What is wrong in the scenario's form, in its ranges and in that file is told at once.
    fn with_traffic(mut typed: load::Typed) -> Result<Self, ScenarioError> {
        let (traffic, mut problems) = match traffic::read(&typed) {
            Ok(traffic) => {
                zones::spell_out(&mut typed, traffic.as_ref().and_then(|traffic| traffic.origin))?;
                if typed.problems.is_empty() {
                    return Ok(Self { typed, traffic: traffic.map(Arc::new) });
                }
                (traffic, Vec::new())
            }
            Err(error) if error.is_machine_s => return Err(error),
            Err(error) => (None, error.problems),
        };
        if let Err(error) = resolve::checked(&typed, traffic.as_ref(), 0) {
            problems.splice(..0, error.problems);
        }
        Err(problems.into())
    }

    /// The same over other traffic, where it is flown over traffic; else the same.
    #[must_use]
    pub fn over(mut self, traffic: Traffic) -> Self {
        self.traffic = self.traffic.map(|_| Arc::new(traffic));
        self
    }

    /// The scenario's name.
    pub fn name(&self) -> &str {
        &self.typed.name
    }

    /// The scenario before anything is drawn, as TOML in one spelling: with what the command line changed, and with
    /// defaults spelt out. Of a traffic file only the name is in it: see [`Self::traffic_crc32`].
    pub fn text(&self) -> Result<String, ScenarioError> {
        resolve::text(&self.typed.origin.label, &self.typed.file)
    }

    /// The traffic file, if it is one that is not built in.
    pub fn traffic_file(&self) -> Option<PathBuf> {
        traffic::file(&self.typed)
    }

    /// A checksum of what was read from the traffic file, whatever its name and form.
    pub fn traffic_crc32(&self) -> Option<u32> {
        self.traffic.as_ref().map(|traffic| traffic.crc32())
    }

    /// The scenario of a seed.
    pub fn draw(&self, seed: u64) -> Result<Scenario, ScenarioError> {
        resolve::resolve(&self.typed, self.traffic.as_ref(), seed)
    }
}

impl Settings {
    /// The settings of a resolved scenario, as a record keeps it; `label` names it in messages. No traffic file is
    /// needed.
    pub fn of_record(label: &str, resolved: &str) -> Result<Self, ScenarioError> {
        resolve::settings_of_record(&load::Typed::of_text(label, resolved)?)
    }
}
