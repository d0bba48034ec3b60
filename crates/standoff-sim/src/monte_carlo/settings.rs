//! The values of a scenario that was flown, one by one: in what two batches differ, and how to ask for one of them again.

use std::collections::BTreeMap;

use toml::{Table, Value};

use super::Batch;
use crate::scenario::{Edits, ScenarioError, Template, built_in};

/// Values as TOML, by dotted key.
pub type Settings = BTreeMap<String, String>;

impl Batch {
    /// What `--set` has to be given to get this scenario from the built-in one of its name. `None` if there is none of
    /// that name, or if that does not lead there.
    pub fn changes_of_built_in(&self) -> Option<Vec<String>> {
        built_in(&self.scenario)?;
        let load = |set: &[String]| -> Result<(String, Option<u32>), ScenarioError> {
            let template = Template::load(&self.scenario, &Edits { set: set.to_vec(), ..Edits::default() })?;
            Ok((template.text()?, template.traffic_crc32()))
        };
        let (unchanged, _) = load(&[]).ok()?;
        let (ours, unchanged) = (settings_of(&self.scenario_toml).ok()?, settings_of(&unchanged).ok()?);
        let changed = ours.into_iter().filter(|(key, value)| unchanged.get(key) != Some(value));
        let set: Vec<String> = changed.map(|(key, value)| format!("{key}={value}")).collect();
        (load(&set).ok()? == (self.scenario_toml.clone(), self.traffic_crc32)).then_some(set)
    }
}

/// Every value of a TOML document by its dotted key; an array is one value.
pub(super) fn settings_of(toml: &str) -> Result<Settings, toml::de::Error> {
    let mut settings = Settings::new();
    gather("", toml::from_str(toml)?, &mut settings);
    Ok(settings)
}

fn gather(prefix: &str, table: Table, settings: &mut Settings) {
    for (key, value) in table {
        let key = if prefix.is_empty() { key } else { format!("{prefix}.{key}") };
        match value {
            Value::Table(table) => gather(&key, table, settings),
            value => {
                settings.insert(key, value.to_string());
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::score::Choice;

    fn batch(edits: &Edits) -> Batch {
        let template = Template::load("paper/table-2-pair", edits).unwrap();
        Batch::new(&template, 1, 2, None, Choice::standard()).unwrap()
    }

    fn set(changes: &[&str]) -> Edits {
        Edits { set: changes.iter().map(|change| (*change).to_owned()).collect(), ..Edits::default() }
    }

    #[test]
    fn settings_have_dotted_keys() {
        let settings = settings_of("a = 1\n[b]\nc = \"x\"\n[b.d]\ne = [1, 2]\n[[f]]\ng = 1.5\n").unwrap();
        let expected = [("a", "1"), ("b.c", "\"x\""), ("b.d.e", "[1, 2]"), ("f", "[{ g = 1.5 }]")];
        assert_eq!(settings, expected.map(|(key, value)| (key.to_owned(), value.to_owned())).into());
    }

    #[test]
    fn the_changes_of_a_built_in_scenario_lead_to_it_again() {
        assert_eq!(batch(&Edits::default()).changes_of_built_in(), Some(Vec::new()));
        let flown = batch(&set(&["guidance.lead_s=0.5", "targets.scatter.x_m=7", "orbit.centre=centroid"]));
        let changes = flown.changes_of_built_in().unwrap();
        assert_eq!(changes.len(), 3, "{changes:?}");
        assert_eq!(batch(&Edits { set: changes, ..Edits::default() }), flown);
    }

    #[test]
    fn what_set_cannot_say_is_not_said() {
        let mut other = batch(&Edits::default());
        other.scenario = "mine".to_owned();
        assert_eq!(other.changes_of_built_in(), None);
        let mut less = batch(&Edits::default());
        less.scenario_toml = less.scenario_toml.replace("lead_s = 3\n", "");
        assert_eq!(less.changes_of_built_in(), None);
    }
}
