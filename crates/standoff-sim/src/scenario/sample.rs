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

/// A number that is drawn or out of range.
#[derive(Debug, Clone)]
struct Sampled {
    key: String,
    number: Number,
    allowed: Allowed,
    /// True if the mission draws it many times.
    is_of_many: bool,
}

/// A scenario whose form is right, prepared so that drawing it costs little.
#[derive(Debug, Clone)]
pub(super) struct Sampler {
    /// The scenario; without parameters, if none is drawn.
    table: Table,
    /// Parameters, if none is drawn.
    parameters: Option<Parameters>,
    /// All numbers that are drawn or out of range. All others stay as they are.
    numbers: Vec<Sampled>,
}

impl Sampler {
    pub(super) fn new(typed: &Table) -> Self {
        let (mut table, mut numbers) = (typed.clone(), Vec::new());
        find_in_table(root(), "", typed, &mut numbers);
        let is_parameter = |sampled: &Sampled| parameters::declared().any(|param| param.key == sampled.key);
        let parameters = (!numbers.iter().any(is_parameter)).then(|| parameters::take(&mut table));
        Self { table, parameters, numbers }
    }

    /// Draws the scenario. Also returns the numbers that are out of range.
    pub(super) fn drawn(&self, draws: Draws) -> Result<(ScenarioFile, Problems), toml::de::Error> {
        let (mut table, mut problems) = (self.table.clone(), Problems::default());
        for sampled in &self.numbers {
            let drawn = value(&sampled.number, &sampled.key, draws, 0);
            sampled.check(drawn, &mut problems);
            if let Some(value) = value_at_mut(&mut table, &sampled.key).filter(|_| !sampled.is_of_many) {
                *value = Value::Float(drawn);
            }
        }
        let parameters = self.parameters.clone().unwrap_or_else(|| parameters::take(&mut table));
        let file: ScenarioFile = table.try_into()?;
        Ok((ScenarioFile { parameters, ..file }, problems))
    }
}

impl Sampled {
    /// Adds a problem if the number itself is wrong, or its value out of range.
    fn check(&self, drawn: f64, problems: &mut Problems) {
        let Self { key, number, allowed, is_of_many } = self;
        let checked = if *is_of_many { *number } else { Number::Constant(drawn) };
        if let Some(what) = number.problem() {
            problems.add(key.clone(), what, Some(*number));
        } else if *allowed == Allowed::FINITE {
            // The range is checked elsewhere.
        } else if let Some(outside) = checked.extremes().into_iter().find(|extreme| !allowed.contains(*extreme)) {
            let is_one = matches!(checked, Number::Constant(_));
            let which = if is_one { String::new() } else { format!("up to {outside}: ") };
            problems.add(key.clone(), format!("{which}must be {allowed}"), Some(checked));
        }
    }
}

fn find_in_table(node: Node, at: &str, table: &Table, found: &mut Vec<Sampled>) {
    for (name, value) in table {
        if let Some(inner) = node.key(name) {
            find(inner, node.range(name), format!("{at}{name}"), value, found);
        }
    }
}

fn find(node: Node, range: Option<&KeyRange>, key: String, value: &Value, found: &mut Vec<Sampled>) {
    match value {
        _ if node.is_number() => {
            let allowed = range.map_or(Allowed::FINITE, |range| range.allowed);
            let is_of_many = range.is_some_and(|range| range.is_of_many);
            match Number::read(value) {
                Ok(Number::Constant(constant)) if allowed.contains(constant) => {}
                Ok(number) => found.push(Sampled { key, number, allowed, is_of_many }),
                Err(_) => {}
            }
        }
        Value::Table(table) => find_in_table(node, &format!("{key}."), table, found),
        Value::Array(values) => {
            let Some(element) = node.element() else { return };
            for (index, value) in values.iter().enumerate() {
                find(element, None, format!("{key}.{index}"), value, found);
            }
        }
        _ => {}
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
