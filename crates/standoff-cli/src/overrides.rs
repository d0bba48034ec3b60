//! Options that change a scenario, shared by all commands that fly one.

use std::collections::BTreeMap;
use std::path::PathBuf;

use clap::Args;
use standoff_app::Failure;
use standoff_sim::scenario::{Overrides, ScenarioTemplate, name_of};

use crate::output_dir;

/// Scenario that is flown if the user names none.
pub(crate) const DEFAULT_SCENARIO: &str = "improved/figure-9";

/// Changes to a scenario.
#[derive(Args, Default)]
pub(crate) struct OverrideArgs {
    /// Fly over this traffic file (- for standard input): SUMO floating-car data, CSV tracks or GPX, plain or .gz; may be
    /// given several times.
    #[arg(long, value_name = "FILE")]
    traffic: Vec<PathBuf>,
    /// Number of UAVs, which start on an orbit around the first targets.
    #[arg(long, value_name = "N")]
    uavs: Option<u32>,
    /// Change a value of the scenario; may be given several times.
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_and_value)]
    set: Vec<String>,
}

/// Scenario whose settings apply to a traffic file if the user names none.
const DEFAULT_FOR_TRAFFIC: &str = "traffic/convoy";

impl OverrideArgs {
    /// True if no option changes the scenario.
    pub(crate) fn is_empty(&self) -> bool {
        self.traffic.is_empty() && self.uavs.is_none() && self.set.is_empty()
    }

    /// Returns the traffic files if no other option changes the scenario; otherwise `None`.
    pub(crate) fn only_traffic(&self) -> Option<&[PathBuf]> {
        (self.uavs.is_none() && self.set.is_empty()).then_some(&self.traffic)
    }

    /// Converts the options to overrides for the simulator. Fails if they contradict each other.
    pub(crate) fn overrides(&self) -> Result<Overrides, Failure> {
        let set = self.last_set();
        let uavs_set = set.iter().find(|(key, _)| matches!(**key, "uavs" | "uavs.count"));
        match (self.uavs, uavs_set) {
            (Some(uavs), Some((key, value))) if *key == "uavs" || *value != uavs.to_string() => {
                let what = format!("--uavs {uavs} and --set {key}={value} contradict each other: give one of them");
                Err(Failure::Input(what))
            }
            _ => {
                let (set, traffic) = (self.set.clone(), self.traffic.clone());
                Ok(Overrides { set, traffic, uavs: self.uavs, ..Overrides::default() })
            }
        }
    }

    /// Converts the options to overrides and appends the values in `more`.
    pub(crate) fn overrides_and(&self, more: &[impl AsRef<str>]) -> Result<Overrides, Failure> {
        let mut overrides = self.overrides()?;
        overrides.set.extend(more.iter().map(|edit| edit.as_ref().to_owned()));
        Ok(overrides)
    }

    /// Returns the effective `--set` values by key, without values that a later one replaces.
    fn last_set(&self) -> BTreeMap<&str, &str> {
        let mut last: BTreeMap<&str, &str> = BTreeMap::new();
        for (key, value) in self.set.iter().filter_map(|edit| edit.split_once('=')) {
            let key = key.trim();
            // A table replaces all keys inside it: those from `key.` up to `key/` (`/` follows `.` in ASCII).
            let (from, to) = (format!("{key}."), format!("{key}/"));
            let replaced: Vec<&str> = last.range(from.as_str()..to.as_str()).map(|(other, _)| *other).collect();
            for other in replaced {
                last.remove(other);
            }
            last.insert(key, value.trim());
        }
        last
    }

    /// Returns the default output folder for the scenario `named` on the command line (`None`: the default scenario).
    /// Equal changes give the same folder in any order; different changes give different folders. A traffic file is
    /// identified by the checksum of its content.
    pub(crate) fn folder(&self, named: Option<&str>, template: &ScenarioTemplate, seeds: &str) -> PathBuf {
        let name = template.name();
        let traffic = self.traffic.first().and_then(|_| template.traffic_crc32()).map(|crc| format!("{crc:08x}"));
        let (scenario, traffic) = match (named, traffic) {
            (Some(named), Some(crc)) => (name_of(named), Some(format!("{name}-{crc}"))),
            (_, traffic) => (name.to_owned(), traffic),
        };
        let traffic = traffic.map(|traffic| ("traffic".to_owned(), traffic));
        let uavs = self.uavs.map(|uavs| ("uavs".to_owned(), uavs.to_string()));
        let set = self.last_set().into_iter().map(|(key, value)| (key.to_owned(), value.to_owned()));
        output_dir::folder(&scenario, seeds, &traffic.into_iter().chain(uavs).chain(set).collect::<Vec<_>>())
    }

    /// Returns the scenario to change: the named one, or the default for traffic files, or `default`.
    pub(crate) fn scenario<'a>(&self, named: Option<&'a str>, default: &'a str) -> &'a str {
        named.unwrap_or(if self.traffic.is_empty() { default } else { DEFAULT_FOR_TRAFFIC })
    }
}

/// Checks that a `--set` argument contains `=`. A value after a space would be parsed as another argument.
pub(crate) fn key_and_value(typed: &str) -> Result<String, String> {
    let assignment = typed.contains('=').then(|| typed.to_owned());
    assignment.ok_or_else(|| format!("a key without its value: write {typed}=VALUE, with = and no space"))
}
