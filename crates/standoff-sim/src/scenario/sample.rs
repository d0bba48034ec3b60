//! Draws the numbers of a scenario, fills in absent ones, and checks their ranges.

use std::fmt::Display;

use standoff::validation::Allowed;

use super::diagnostics::Problems;
use super::number::Number;
use crate::random::{Draws, Stream};

/// A table whose numbers can be drawn.
pub(super) trait Draw {
    /// The table with plain numbers.
    type Drawn;

    /// Draws the table; `at` is the prefix of its keys, such as `uavs.start.1.`.
    fn drawn(&self, at: &dyn Display, drawing: &mut Drawing) -> Self::Drawn;
}

impl<T: Draw> Draw for Option<T> {
    type Drawn = Option<T::Drawn>;

    fn drawn(&self, at: &dyn Display, drawing: &mut Drawing) -> Self::Drawn {
        self.as_ref().map(|table| table.drawn(at, drawing))
    }
}

impl<T: Draw> Draw for Vec<T> {
    type Drawn = Vec<T::Drawn>;

    fn drawn(&self, at: &dyn Display, drawing: &mut Drawing) -> Self::Drawn {
        self.iter().enumerate().map(|(index, table)| table.drawn(&format_args!("{at}{index}."), drawing)).collect()
    }
}

/// Defaults of numbers that depend on other values, by key.
#[derive(Debug, Clone, Copy)]
pub(super) struct DerivedDefaults {
    pub(super) duration_s: f64,
    pub(super) period_s: f64,
    pub(super) transient_s: f64,
    pub(super) count: f64,
    /// Parameters of the library, in the order of [`DERIVED`](super::parameters::DERIVED).
    pub(super) parameters: [f64; 16],
}

/// State of drawing the numbers of a seed, with the problems found.
pub(super) struct Drawing {
    pub(super) draws: Draws,
    /// True for numbers that are drawn many times later: their most extreme values must be in range.
    pub(super) is_of_many: bool,
    pub(super) absent: DerivedDefaults,
    pub(super) problems: Problems,
}

impl Drawing {
    /// Draws and checks the number at a key of the table with the prefix `at`.
    pub(super) fn number(&mut self, at: &dyn Display, key: &str, number: &Number, allowed: Allowed) -> f64 {
        // Fast path: most numbers are valid constants.
        if let Number::Constant(value) = *number
            && allowed.contains(value)
        {
            return value;
        }
        let key = format_args!("{at}{key}");
        let value = value(number, &key, self.draws, 0);
        let checked = if self.is_of_many { *number } else { Number::Constant(value) };
        if let Some(what) = number.problem() {
            self.problems.add(key.to_string(), what, Some(*number));
        } else if allowed == Allowed::FINITE {
            // The range is checked elsewhere.
        } else if let Some(outside) = checked.extremes().into_iter().find(|extreme| !allowed.contains(*extreme)) {
            let is_one = matches!(checked, Number::Constant(_));
            let which = if is_one { String::new() } else { format!("up to {outside}: ") };
            self.problems.add(key.to_string(), format!("{which}must be {allowed}"), Some(checked));
        }
        value
    }

    /// Checks the range of a number that the mission draws many times.
    pub(super) fn check_many(&mut self, at: &dyn Display, key: &str, number: &Number, allowed: Allowed) {
        let is_of_many = std::mem::replace(&mut self.is_of_many, true);
        self.number(at, key, number, allowed);
        self.is_of_many = is_of_many;
    }

    /// Draws the numbers in a list of lists.
    pub(super) fn lists(&mut self, at: &dyn Display, key: &str, lists: &[Vec<Number>]) -> Vec<Vec<f64>> {
        let list = |(list, numbers): (usize, &Vec<Number>)| {
            let at = format!("{at}{key}.{list}.");
            let number =
                |(index, number): (usize, &Number)| self.number(&at, &index.to_string(), number, Allowed::FINITE);
            numbers.iter().enumerate().map(number).collect()
        };
        lists.iter().enumerate().map(list).collect()
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
