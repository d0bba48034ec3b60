//! Collects the errors in the values of a scenario, by key.

use standoff::validation::Allowed;

use super::number::Number;

/// Maximum number of errors collected; of more, most follow from others.
const FOUND_MAX: usize = 200;

/// Problems found so far.
#[derive(Default)]
pub(super) struct Problems {
    pub(super) found: Vec<Found>,
}

/// An error at a key.
pub(super) struct Found {
    pub(super) key: String,
    pub(super) what: String,
    /// The wrong number, if the value is a number.
    pub(super) number: Option<Number>,
}

impl Problems {
    pub(super) fn add(&mut self, key: impl Into<String>, what: impl Into<String>, number: Option<Number>) {
        if self.found.len() < FOUND_MAX {
            self.found.push(Found { key: key.into(), what: what.into(), number });
        }
    }

    pub(super) fn check(&mut self, key: impl Into<String>, number: f64, allowed: Allowed) {
        if !allowed.contains(number) {
            self.add(key, format!("must be {allowed}"), Some(number.into()));
        }
    }

    /// Checks a number that must be whole.
    pub(super) fn check_whole(&mut self, key: &str, number: f64, allowed: Allowed) {
        if allowed.contains(number) && number.fract().abs() > 0.0 {
            self.add(key, "must be a whole number", Some(number.into()));
        }
        self.check(key, number, allowed);
    }

    /// Checks the number of tables in an array.
    pub(super) fn check_many(&mut self, key: &str, tables: usize, most: usize) {
        if tables > most {
            let what = format!("must be at most {most}, not {tables}; put many targets into a traffic file");
            self.add(key, what, None);
        }
    }

    /// Checks the end of an interval against its start.
    pub(super) fn check_until(&mut self, table: &str, from_s: f64, until_s: f64) {
        let later = Allowed::at_least(from_s).at_most(1e9).with_reason("not before from_s");
        self.check(format!("{table}.until_s"), until_s, later);
    }
}
