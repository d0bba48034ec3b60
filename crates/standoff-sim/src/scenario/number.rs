//! A number in a scenario file: a constant, or a distribution from which each run draws.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize, Serializer};
use serde_path_to_error::Segment;
use standoff_io::display_text::printable;
use toml::Value;

use self::Distribution::{Normal, Uniform};
use crate::random::Draw;

/// A number, or a distribution from which each run draws.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(untagged)]
pub enum Number {
    /// A constant.
    Constant(#[serde(serialize_with = "as_typed")] f64),
    /// Drawn from a distribution.
    Drawn(Distribution),
}

/// A distribution of numbers.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Distribution {
    /// Uniform between two bounds.
    Uniform {
        /// Smallest value.
        min: f64,
        /// Largest value.
        max: f64,
    },
    /// Normal (Gaussian).
    Normal {
        /// Mean.
        mean: f64,
        /// Standard deviation.
        sd: f64,
    },
}

impl Number {
    /// Reads a number. The error is the dotted key of the wrong part in the value, and what is wrong.
    pub(super) fn read(value: &Value) -> Result<Self, (String, String)> {
        let distribution = match value {
            Value::Float(number) => return Ok(Self::Constant(*number)),
            Value::Integer(number) => return Ok(Self::Constant(*number as f64)),
            Value::Table(distribution) if distribution.len() == 1 => distribution,
            _ => {
                let what =
                    "must be a number, { uniform = { min = .., max = .. } } or { normal = { mean = .., sd = .. } }";
                return Err((String::new(), what.to_owned()));
            }
        };
        serde_path_to_error::deserialize(value.clone()).map(Self::Drawn).map_err(|error| {
            let kind = distribution.keys().cloned();
            let parts = error.path().iter().filter_map(|segment| match segment {
                Segment::Map { key } => Some(key.clone()),
                Segment::Enum { .. } | Segment::Seq { .. } | Segment::Unknown => None,
            });
            let part = kind.chain(parts).collect::<Vec<_>>().join(".");
            // The library appends a line with the position, for which the key is better.
            let what = error.into_inner().to_string().lines().next().unwrap_or_default().to_owned();
            let expected = what.strip_prefix("invalid type").and_then(|what| what.rsplit_once(", expected "));
            let what = match expected {
                Some((_, "f64")) => "must be a number".to_owned(),
                Some(_) => "must be a table".to_owned(),
                None => printable(&what),
            };
            (part, what)
        })
    }

    /// Describes the error in the number itself, if there is one.
    pub fn problem(&self) -> Option<String> {
        match *self {
            Self::Constant(value) if !value.is_finite() => Some("must be a finite number".to_owned()),
            Self::Drawn(Uniform { min, max }) if !(min.is_finite() && max.is_finite() && min <= max) => {
                Some(format!("must be uniform between finite bounds, min <= max, not {min} and {max}"))
            }
            Self::Drawn(Normal { mean, sd }) if !(mean.is_finite() && sd.is_finite() && sd >= 0.0) => {
                Some(format!("must be normal with a finite mean and sd >= 0, not {mean} and {sd}"))
            }
            _ => None,
        }
    }

    /// Returns the smallest and the largest value; for a normal distribution, six standard deviations from the mean.
    pub fn extremes(&self) -> [f64; 2] {
        match *self {
            Self::Constant(value) => [value, value],
            Self::Drawn(Uniform { min, max }) => [min, max],
            Self::Drawn(Normal { mean, sd }) => [mean - 6.0 * sd, mean + 6.0 * sd],
        }
    }

    /// Draws a value.
    pub fn draw(&self, draw: &mut Draw) -> f64 {
        match *self {
            Self::Constant(value) => value,
            Self::Drawn(Uniform { min, max }) => min + (max - min) * draw.uniform(),
            Self::Drawn(Normal { mean, sd }) => mean + sd * draw.normal(),
        }
    }
}

impl Default for Number {
    fn default() -> Self {
        Self::Constant(0.0)
    }
}

impl From<f64> for Number {
    fn from(value: f64) -> Self {
        Self::Constant(value)
    }
}

/// Returns a whole number as an integer, as a user would type it: 100, not 100.0. A negative zero must stay negative.
pub(super) fn whole(value: f64) -> Option<i64> {
    (value.trunc() == value && value.abs() < 1e15 && value.to_bits() != 1 << 63).then_some(value as i64)
}

/// Serialises a number as a user would type it.
pub(super) fn as_typed<S: Serializer>(value: &f64, serializer: S) -> Result<S::Ok, S::Error> {
    match whole(*value) {
        Some(whole) => serializer.serialize_i64(whole),
        None => serializer.serialize_f64(*value),
    }
}

/// Serialises lists of such numbers.
pub(super) fn lists_as_typed<S: Serializer>(lists: &[Vec<f64>], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(lists.iter().map(|list| list.iter().copied().map(Number::Constant).collect::<Vec<_>>()))
}
