//! Draws the numbers of a scenario, and checks their ranges.

use std::fmt::Display;

use standoff::validation::Allowed;
use toml::{Table, Value};

use super::diagnostics::Problems;
use super::dotted::value_at_mut;
use super::number::Number;
use super::parameters;
use super::schema::{Node, root};
use super::schema_types::{KeyRange, Parameters, ScenarioFile};
use crate::random::{Draws, Stream};

/// Key of a number, and its range.
type Key = (String, Option<&'static KeyRange>);

/// A scenario whose form is right, prepared so that drawing it costs little.
#[derive(Debug, Clone)]
pub(super) struct Sampler {
    /// The scenario; without parameters, if none is drawn.
    table: Table,
    /// Parameters, if none is drawn.
    parameters: Option<Parameters>,
    /// Keys of all numbers that are drawn or out of range, with their ranges. All others stay as they are.
    keys: Vec<Key>,
}

impl Sampler {
    pub(super) fn new(typed: &Table) -> Self {
        let (mut table, mut keys) = (typed.clone(), Vec::new());
        add_keys_of_table(root(), "", typed, &mut keys);
        let is_parameter = |(key, _): &Key| parameters::declared().any(|param| param.key == key);
        let parameters = (!keys.iter().any(is_parameter)).then(|| parameters::take(&mut table));
        Self { table, parameters, keys }
    }

    /// Draws the scenario. Also returns the numbers that are out of range.
    pub(super) fn drawn(&self, draws: Draws) -> Result<(ScenarioFile, Problems), toml::de::Error> {
        let (mut table, mut drawing) = (self.table.clone(), Drawing { draws, problems: Problems::default() });
        for (key, range) in &self.keys {
            if let Some(value) = value_at_mut(&mut table, key) {
                drawing.number(*range, key, value);
            }
        }
        let parameters = self.parameters.clone().unwrap_or_else(|| parameters::take(&mut table));
        let file: ScenarioFile = table.try_into()?;
        Ok((ScenarioFile { parameters, ..file }, drawing.problems))
    }
}

fn add_keys_of_table(node: Node<'static>, at: &str, table: &Table, keys: &mut Vec<Key>) {
    for (name, value) in table {
        if let Some(inner) = node.key(name) {
            add_keys(inner, node.range(name), format!("{at}{name}"), value, keys);
        }
    }
}

fn add_keys(node: Node<'static>, range: Option<&'static KeyRange>, key: String, value: &Value, keys: &mut Vec<Key>) {
    match value {
        _ if node.is_number() => {
            let allowed = range.map_or(Allowed::FINITE, |range| range.allowed);
            let is_settled = |number: &Number| matches!(number, Number::Constant(value) if allowed.contains(*value));
            if Number::read(value).is_ok_and(|number| !is_settled(&number)) {
                keys.push((key, range));
            }
        }
        Value::Table(table) => add_keys_of_table(node, &format!("{key}."), table, keys),
        Value::Array(values) => {
            let Some(element) = node.element() else { return };
            for (index, value) in values.iter().enumerate() {
                add_keys(element, None, format!("{key}.{index}"), value, keys);
            }
        }
        _ => {}
    }
}

/// State of drawing the numbers of a seed, with the problems found.
struct Drawing {
    draws: Draws,
    problems: Problems,
}

impl Drawing {
    fn number(&mut self, range: Option<&KeyRange>, key: &dyn Display, value: &mut Value) {
        let Ok(number) = Number::read(value) else { return };
        let (allowed, is_of_many) = range.map_or((Allowed::FINITE, false), |range| (range.allowed, range.is_of_many));
        let drawn = self::value(&number, key, self.draws, 0);
        let checked = if is_of_many { number } else { Number::Constant(drawn) };
        if let Some(what) = number.problem() {
            self.problems.add(key.to_string(), what, Some(number));
        } else if allowed == Allowed::FINITE {
            // The range is checked elsewhere.
        } else if let Some(outside) = checked.extremes().into_iter().find(|extreme| !allowed.contains(*extreme)) {
            let is_one = matches!(checked, Number::Constant(_));
            let which = if is_one { String::new() } else { format!("up to {outside}: ") };
            self.problems.add(key.to_string(), format!("{which}must be {allowed}"), Some(checked));
        }
        if !is_of_many {
            *value = Value::Float(drawn);
        }
    }
}

/// Returns the value of a number as a function of the seed, its key and the index of the draw (0; from 1 on for numbers
/// that are drawn many times). An invalid number gets a valid value, so that everything else can be checked.
pub(super) fn value(number: &Number, key: &dyn Display, draws: Draws, nth: u64) -> f64 {
    match *number {
        _ if number.problem().is_some() => 1.0,
        Number::Constant(value) => value,
        _ => {
            let key = key.to_string();
            let drawn = number.draw(&mut draws.at(Stream::Scenario, stream_of(&key), nth));
            if key.ends_with(".count") { drawn.round() } else { drawn }
        }
    }
}

/// Names under which the random streams of renamed tables are keyed: the current name and the first one. A seed draws
/// the same values whatever the table is called.
const STREAM_NAMES: [(&str, &str); 5] = [
    ("targets.random.", "targets.scatter."),
    ("targets.start.", "targets.at."),
    ("uavs.start.", "uavs.at."),
    ("uavs.start_ring.", "uavs.ring."),
    ("uavs.boot_delay_s", "uavs.start_late_s"),
];

/// Identifies the random stream of a scenario key by a stable hash of its name (FNV-1a).
fn stream_of(key: &str) -> u64 {
    let renamed = STREAM_NAMES.iter().find_map(|(now, first)| key.strip_prefix(now).map(|rest| (*first, rest)));
    let (first, rest) = renamed.unwrap_or((key, ""));
    let bytes = first.bytes().chain(rest.bytes());
    bytes.fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}
