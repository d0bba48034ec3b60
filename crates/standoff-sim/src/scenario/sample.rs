//! Draws the numbers of a scenario, and checks their ranges.

use std::fmt::Display;

use standoff::validation::Allowed;
use toml::{Table, Value};

use super::diagnostics::Problems;
use super::number::Number;
use super::parameters;
use super::schema::{Node, root};
use super::schema_types::{KeyRange, ScenarioFile};
use crate::random::{Draws, Stream};

/// Draws a scenario whose form is right. Also returns the numbers that are out of range.
pub(super) fn drawn(typed: &Table, draws: Draws) -> Result<(ScenarioFile, Problems), toml::de::Error> {
    let (mut table, mut drawing) = (typed.clone(), Drawing { draws, problems: Problems::default() });
    drawing.table(root(), &"", &mut table);
    let parameters = parameters::take(&mut table);
    let file: ScenarioFile = table.try_into()?;
    Ok((ScenarioFile { parameters, ..file }, drawing.problems))
}

/// State of drawing the numbers of a seed, with the problems found.
struct Drawing {
    draws: Draws,
    problems: Problems,
}

impl Drawing {
    /// Draws the numbers of a table; `at` is the prefix of its keys, such as `uavs.start.1.`.
    fn table(&mut self, node: Node, at: &dyn Display, table: &mut Table) {
        for (name, value) in table.iter_mut() {
            if let Some(inner) = node.key(name) {
                self.value(inner, node.range(name), &format_args!("{at}{name}"), value);
            }
        }
    }

    fn value(&mut self, node: Node, range: Option<&KeyRange>, key: &dyn Display, value: &mut Value) {
        match value {
            _ if node.is_number() => self.number(range, key, value),
            Value::Table(table) => self.table(node, &format_args!("{key}."), table),
            Value::Array(values) => {
                let Some(element) = node.element() else { return };
                for (index, value) in values.iter_mut().enumerate() {
                    self.value(element, None, &format_args!("{key}.{index}"), value);
                }
            }
            _ => {}
        }
    }

    fn number(&mut self, range: Option<&KeyRange>, key: &dyn Display, value: &mut Value) {
        let Ok(number) = Number::read(value) else { return };
        let (allowed, is_of_many) = range.map_or((Allowed::FINITE, false), |range| (range.allowed, range.is_of_many));
        // Fast path: most numbers are valid constants.
        if let Number::Constant(value) = number
            && allowed.contains(value)
        {
            return;
        }
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
