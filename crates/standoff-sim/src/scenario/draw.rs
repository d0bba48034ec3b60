//! From a number that is typed to the one that is flown: drawn, or in the place of one that was not typed, and held to
//! its range.

use std::fmt::Display;

use standoff::Allowed;

use super::number::Number;
use super::problems::Problems;
use crate::draws::{Draws, Stream};

/// What can be drawn.
pub(super) trait Draw {
    /// What it is then: all its numbers are numbers.
    type Drawn;

    /// It for a seed; `at` stands before its keys: `uavs.at.1.`.
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

/// Numbers that follow others where they are not typed, by their keys.
#[derive(Debug, Clone, Copy)]
pub(super) struct Absent {
    pub(super) duration_s: f64,
    pub(super) period_s: f64,
    pub(super) settle_s: f64,
    pub(super) count: f64,
    pub(super) correlation_rate_1_s: f64,
    pub(super) acceleration_sd_m_s2: f64,
    pub(super) range_sd_m: f64,
    pub(super) bearing_sd_deg: f64,
    pub(super) gap_s: f64,
}

/// The numbers of a seed, and what is wrong with them.
pub(super) struct Drawing {
    pub(super) draws: Draws,
    /// What is looked at now is drawn many times, later: the most extreme draws must be in range.
    pub(super) is_of_many: bool,
    pub(super) absent: Absent,
    pub(super) problems: Problems,
}

impl Drawing {
    /// The number at a key of the table that `at` stands for.
    pub(super) fn number(&mut self, at: &dyn Display, key: &str, number: &Number, allowed: Allowed) -> f64 {
        // Most numbers are so, and nothing is to be said of them.
        if let Number::Constant(value) = *number
            && allowed.contains(value)
        {
            return value;
        }
        let key = format_args!("{at}{key}");
        let value = value(number, &key, self.draws, 0);
        let looked_at = if self.is_of_many { *number } else { Number::Constant(value) };
        if let Some(what) = number.problem() {
            self.problems.add(key.to_string(), what, Some(*number));
        } else if allowed == Allowed::FINITE {
            // Its range is for others to say.
        } else if let Some(outside) = looked_at.extremes().into_iter().find(|extreme| !allowed.contains(*extreme)) {
            let is_one = matches!(looked_at, Number::Constant(_));
            let which = if is_one { String::new() } else { format!("up to {outside}: ") };
            self.problems.add(key.to_string(), format!("{which}must be {allowed}"), Some(looked_at));
        }
        value
    }

    /// Holds a number to its range that the flight draws, many times.
    pub(super) fn check_many(&mut self, at: &dyn Display, key: &str, number: &Number, allowed: Allowed) {
        let is_of_many = std::mem::replace(&mut self.is_of_many, true);
        self.number(at, key, number, allowed);
        self.is_of_many = is_of_many;
    }

    /// The numbers of lists in a list.
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

/// What a number comes to: a function of the seed, of its key and of which draw it is (0; from 1 on, of what is drawn
/// many times). A sound one stands for a number that is wrong in itself, so that everything else can be checked.
pub(super) fn value(number: &Number, key: &dyn Display, draws: Draws, nth: u64) -> f64 {
    match *number {
        _ if number.problem().is_some() => 1.0,
        Number::Constant(value) => value,
        _ => {
            let key = key.to_string();
            let drawn = number.draw(&mut draws.at(Stream::Scenario, hash(&key), nth));
            if key.ends_with(".count") { drawn.round() } else { drawn }
        }
    }
}

/// A stable hash of a key (FNV-1a).
fn hash(key: &str) -> u64 {
    key.bytes().fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3))
}
