//! Flattened values of a batch's scenario, to find the differences between batches and to reproduce them.

use std::collections::BTreeMap;

use toml::{Table, Value};

use super::Batch;
use crate::scenario::{Overrides, ScenarioError, ScenarioTemplate, built_in};

/// TOML values by dotted key.
pub type Settings = BTreeMap<String, String>;

impl Batch {
    /// Returns the `--set` arguments that turn the built-in scenario of the same name into this one. `None` if there is
    /// no such scenario, or if the arguments do not reproduce this one.
    pub fn changes_of_built_in(&self) -> Option<Vec<String>> {
        built_in(&self.scenario)?;
        let load = |set: &[String]| -> Result<(String, Option<u32>), ScenarioError> {
            let template =
                ScenarioTemplate::load(&self.scenario, &Overrides { set: set.to_vec(), ..Overrides::default() })?;
            Ok((template.text()?, template.traffic_crc32()))
        };
        let (unchanged, _) = load(&[]).ok()?;
        let (ours, unchanged) = (settings_of(&self.scenario_toml).ok()?, settings_of(&unchanged).ok()?);
        let changed = ours.into_iter().filter(|(key, value)| unchanged.get(key) != Some(value));
        let set: Vec<String> = changed.map(|(key, value)| format!("{key}={value}")).collect();
        (load(&set).ok()? == (self.scenario_toml.clone(), self.traffic_crc32)).then_some(set)
    }
}

/// Returns the settings in which the resolved scenarios of two runs differ, each `KEY=VALUE`. Descriptions have no
/// influence on a run, and arrays such as start positions differ with the seed; both are left out.
pub fn differing_settings(scenarios_toml: [&str; 2]) -> Result<[Vec<String>; 2], toml::de::Error> {
    let [a, b] = scenarios_toml.map(settings_of);
    let (a, b) = (a?, b?);
    let differing = |ours: &Settings, theirs: &Settings| {
        let is_shown = |key: &str, value: &str| key != "about" && !value.starts_with('[');
        let changed = ours.iter().filter(|(key, value)| is_shown(key, value) && theirs.get(*key) != Some(value));
        changed.map(|(key, value)| format!("{key}={value}")).collect()
    };
    Ok([differing(&a, &b), differing(&b, &a)])
}

/// Returns every value of a TOML document by its dotted key; an array is one value.
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
    use crate::common::overrides;
    use standoff_score::MetricSelection;

    fn batch(overrides: &Overrides) -> Batch {
        let template = ScenarioTemplate::load("paper/table-2-pair", overrides).unwrap();
        Batch::new(&template, 1, 2, None, MetricSelection::standard()).unwrap()
    }

    #[test]
    fn settings_have_dotted_keys() {
        let settings = settings_of("a = 1\n[b]\nc = \"x\"\n[b.d]\ne = [1, 2]\n[[f]]\ng = 1.5\n").unwrap();
        let expected = [("a", "1"), ("b.c", "\"x\""), ("b.d.e", "[1, 2]"), ("f", "[{ g = 1.5 }]")];
        assert_eq!(settings, expected.map(|(key, value)| (key.to_owned(), value.to_owned())).into());
    }

    #[test]
    fn differing_settings_are_those_of_each_run_without_arrays() {
        let a = "about = \"x\"\nduration_s = 20\n[uavs]\ncount = 2\nspeed_m_s = 40\n[[uavs.start]]\nx_m = 1\n";
        let b = "about = \"y\"\nduration_s = 20\n[uavs]\ncount = 3\n[[uavs.start]]\nx_m = 2\n";
        let expected = [vec!["uavs.count=2", "uavs.speed_m_s=40"], vec!["uavs.count=3"]];
        assert_eq!(
            differing_settings([a, b]).unwrap(),
            expected.map(|all| all.into_iter().map(str::to_owned).collect::<Vec<_>>())
        );
    }

    #[test]
    fn changes_of_a_built_in_scenario_reproduce_it() {
        assert_eq!(batch(&overrides(&[])).changes_of_built_in(), Some(Vec::new()));
        let flown =
            batch(&overrides(&["guidance.lead_s=0.5", "targets.random.x_m=7", "orbit.pointing=angular-midpoint"]));
        let changes = flown.changes_of_built_in().unwrap();
        assert_eq!(changes.len(), 3, "{changes:?}");
        assert_eq!(batch(&Overrides { set: changes, ..Overrides::default() }), flown);
    }

    #[test]
    fn no_changes_if_set_cannot_express_them() {
        let mut other = batch(&overrides(&[]));
        other.scenario = "mine".to_owned();
        assert_eq!(other.changes_of_built_in(), None);
        let mut less = batch(&overrides(&[]));
        less.scenario_toml = less.scenario_toml.replace("lead_s = 3\n", "");
        assert_eq!(less.changes_of_built_in(), None);
    }
}
