//! What the command line changes about a scenario: the same for every command that flies one.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use clap::Args;
use standoff_results::Failure;
use standoff_sim::scenario::{Edits, Template, name_of};

use crate::folder;

/// What is flown if nothing is named.
pub(crate) const DEFAULT_SCENARIO: &str = "best/figure-9";

/// Changes of a scenario.
#[derive(Args, Default)]
pub(crate) struct Changes {
    /// Fly over this traffic file: SUMO floating-car data or CSV tracks, plain or .gz.
    #[arg(long, value_name = "FILE")]
    traffic: Option<PathBuf>,
    /// Number of UAVs, started on an orbit about the first targets.
    #[arg(long, value_name = "N")]
    uavs: Option<u32>,
    /// Change a value of the scenario; may be given several times.
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_and_value)]
    set: Vec<String>,
}

/// How a traffic file is flown if no scenario is named.
const DEFAULT_FOR_TRAFFIC: &str = "traffic/convoy";

impl Changes {
    /// They change nothing.
    pub(crate) fn is_empty(&self) -> bool {
        self.traffic.is_none() && self.uavs.is_none() && self.set.is_empty()
    }

    /// The traffic file, if they change nothing else; `None` if they do.
    pub(crate) fn only_traffic(&self) -> Option<Option<&Path>> {
        (self.uavs.is_none() && self.set.is_empty()).then_some(self.traffic.as_deref())
    }

    /// As the simulator takes them. Fails if they contradict each other.
    pub(crate) fn edits(&self) -> Result<Edits, Failure> {
        let set = self.last_set();
        let over = set.iter().find(|(key, _)| matches!(**key, "uavs" | "uavs.count"));
        match (self.uavs, over) {
            (Some(uavs), Some((key, value))) if *key == "uavs" || *value != uavs.to_string() => {
                let what = format!("--uavs {uavs} and --set {key}={value} contradict each other: give one of them");
                Err(Failure::Input(what))
            }
            _ => Ok(Edits { set: self.set.clone(), traffic: self.traffic.clone(), uavs: self.uavs }),
        }
    }

    /// These, and then `more` values.
    pub(crate) fn edits_and(&self, more: &[String]) -> Result<Edits, Failure> {
        let mut edits = self.edits()?;
        edits.set.extend_from_slice(more);
        Ok(edits)
    }

    /// What is set in the end, by key: a value that a later one replaces is not among it.
    fn last_set(&self) -> BTreeMap<&str, &str> {
        let mut last: BTreeMap<&str, &str> = BTreeMap::new();
        for (key, value) in self.set.iter().filter_map(|edit| edit.split_once('=')) {
            let key = key.trim();
            // A table takes the place of all that is in it: of the keys from `key.` on, before `key/`, the next sign.
            let (from, to) = (format!("{key}."), format!("{key}/"));
            let replaced: Vec<&str> = last.range(from.as_str()..to.as_str()).map(|(other, _)| *other).collect();
            for other in replaced {
                last.remove(other);
            }
            last.insert(key, value.trim());
        }
        last
    }

    /// Where the results of what is `named`, or is flown without a name, go: the same changes have the same folder, in
    /// whatever order they are typed, and others another. A traffic file is known by what is in it.
    pub(crate) fn folder(&self, named: Option<&str>, template: &Template, seeds: &str) -> PathBuf {
        let flown = template.name();
        let traffic = self.traffic.as_ref().and_then(|_| template.traffic_crc32()).map(|crc| format!("{crc:08x}"));
        let (scenario, traffic) = match (named, traffic) {
            (Some(named), Some(crc)) => (name_of(named), Some(format!("{flown}-{crc}"))),
            (_, traffic) => (flown.to_owned(), traffic),
        };
        let traffic = traffic.map(|traffic| ("traffic".to_owned(), traffic));
        let uavs = self.uavs.map(|uavs| ("uavs".to_owned(), uavs.to_string()));
        let set = self.last_set().into_iter().map(|(key, value)| (key.to_owned(), value.to_owned()));
        folder::folder(&scenario, seeds, &traffic.into_iter().chain(uavs).chain(set).collect::<Vec<_>>())
    }

    /// The scenario to change: that which is named, or one for traffic, or `default`.
    pub(crate) fn scenario<'a>(&self, named: Option<&'a str>, default: &'a str) -> &'a str {
        named.unwrap_or(if self.traffic.is_some() { DEFAULT_FOR_TRAFFIC } else { default })
    }
}

/// A value that is set, as typed: behind a space it would be taken for something else.
pub(crate) fn key_and_value(typed: &str) -> Result<String, String> {
    let whole = typed.contains('=').then(|| typed.to_owned());
    whole.ok_or_else(|| format!("a key without its value: write {typed}=VALUE, with = and no space"))
}
