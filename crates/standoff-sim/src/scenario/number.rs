//! A number of a scenario file: a constant, or a distribution from which each run draws.

use std::fmt;

use serde::de::{Deserialize, Deserializer, MapAccess, Visitor, value::MapAccessDeserializer};
use serde::ser::{Serialize, Serializer};

use crate::draws::Draw;

/// A number, or how to draw it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Number {
    /// Always this.
    Constant(f64),
    /// Uniform between two bounds: `{ uniform = { min = 1.0, max = 2.0 } }`.
    Uniform {
        /// Smallest value.
        min: f64,
        /// Largest value.
        max: f64,
    },
    /// Normal: `{ normal = { mean = 0.0, sd = 1.0 } }`.
    Normal {
        /// Mean.
        mean: f64,
        /// Standard deviation.
        sd: f64,
    },
}

impl Number {
    /// What is wrong with the distribution itself, if anything.
    pub fn problem(&self) -> Option<String> {
        match *self {
            Self::Constant(value) if !value.is_finite() => Some("must be a finite number".to_owned()),
            Self::Uniform { min, max } if !(min.is_finite() && max.is_finite() && min <= max) => {
                Some(format!("must be uniform between finite bounds, min <= max, not {min} and {max}"))
            }
            Self::Normal { mean, sd } if !(mean.is_finite() && sd.is_finite() && sd >= 0.0) => {
                Some(format!("must be normal with a finite mean and sd >= 0, not {mean} and {sd}"))
            }
            _ => None,
        }
    }

    /// The smallest and the largest value that is drawn; of a normal, six standard deviations out.
    pub fn extremes(&self) -> [f64; 2] {
        match *self {
            Self::Constant(value) => [value, value],
            Self::Uniform { min, max } => [min, max],
            Self::Normal { mean, sd } => [mean - 6.0 * sd, mean + 6.0 * sd],
        }
    }

    /// One draw.
    pub fn draw(&self, draw: &mut Draw) -> f64 {
        match *self {
            Self::Constant(value) => value,
            Self::Uniform { min, max } => min + (max - min) * draw.uniform(),
            Self::Normal { mean, sd } => mean + sd * draw.normal(),
        }
    }
}

impl From<f64> for Number {
    fn from(value: f64) -> Self {
        Self::Constant(value)
    }
}

#[derive(serde::Deserialize, serde::Serialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
enum Distribution {
    #[serde(rename = "uniform")]
    Uniform(Bounds),
    #[serde(rename = "normal")]
    Normal(Moments),
}

#[derive(serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields)]
struct Bounds {
    min: f64,
    max: f64,
}

#[derive(serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields)]
struct Moments {
    mean: f64,
    sd: f64,
}

impl<'de> Deserialize<'de> for Number {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct NumberVisitor;
        impl<'de> Visitor<'de> for NumberVisitor {
            type Value = Number;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a number, { uniform = { min = .., max = .. } } or { normal = { mean = .., sd = .. } }")
            }
            fn visit_f64<E>(self, value: f64) -> Result<Number, E> {
                Ok(Number::Constant(value))
            }
            fn visit_i64<E>(self, value: i64) -> Result<Number, E> {
                Ok(Number::Constant(value as f64))
            }
            fn visit_u64<E>(self, value: u64) -> Result<Number, E> {
                Ok(Number::Constant(value as f64))
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Number, A::Error> {
                Ok(match Distribution::deserialize(MapAccessDeserializer::new(map))? {
                    Distribution::Uniform(Bounds { min, max }) => Number::Uniform { min, max },
                    Distribution::Normal(Moments { mean, sd }) => Number::Normal { mean, sd },
                })
            }
        }
        deserializer.deserialize_any(NumberVisitor)
    }
}

impl Serialize for Number {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match *self {
            // As a person would write it: 100, not 100.0; but a negative zero must stay one.
            Self::Constant(value) if value.trunc() == value && value.abs() < 1e15 && value.to_bits() != 1 << 63 => {
                serializer.serialize_i64(value as i64)
            }
            Self::Constant(value) => serializer.serialize_f64(value),
            Self::Uniform { min, max } => Distribution::Uniform(Bounds { min, max }).serialize(serializer),
            Self::Normal { mean, sd } => Distribution::Normal(Moments { mean, sd }).serialize(serializer),
        }
    }
}

/// A number that has been drawn, as a person would type it.
pub(super) fn as_typed<S: Serializer>(value: &f64, serializer: S) -> Result<S::Ok, S::Error> {
    Number::Constant(*value).serialize(serializer)
}
