//! A number in a scenario file: a constant, or a distribution from which each run draws.

use std::borrow::Cow;
use std::{fmt, iter};

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{MapAccess, Visitor, value::MapAccessDeserializer};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::{Value, json};

use self::Distribution::{Normal, Uniform};
use crate::random::Draw;

/// A constant, or a distribution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Number {
    /// A constant.
    Constant(f64),
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

impl From<f64> for Number {
    fn from(value: f64) -> Self {
        Self::Constant(value)
    }
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
                Distribution::deserialize(MapAccessDeserializer::new(map)).map(Number::Drawn)
            }
        }
        deserializer.deserialize_any(NumberVisitor)
    }
}

impl Serialize for Number {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match *self {
            // As a user would type it: 100, not 100.0; but a negative zero must stay negative.
            Self::Constant(value) if value.trunc() == value && value.abs() < 1e15 && value.to_bits() != 1 << 63 => {
                serializer.serialize_i64(value as i64)
            }
            Self::Constant(value) => serializer.serialize_f64(value),
            Self::Drawn(distribution) => distribution.serialize(serializer),
        }
    }
}

impl JsonSchema for Number {
    fn schema_name() -> Cow<'static, str> {
        "Number".into()
    }

    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let distributions = Distribution::json_schema(generator);
        let distributions = distributions.get("oneOf").and_then(Value::as_array).into_iter().flatten().cloned();
        let one_of: Vec<Value> = iter::once(json!({ "type": "number" })).chain(distributions).collect();
        json_schema!({ "description": "A number, or a distribution from which each run draws.", "oneOf": one_of })
    }
}

/// Serialises a drawn number as a user would type it.
pub(super) fn as_typed<S: Serializer>(value: &f64, serializer: S) -> Result<S::Ok, S::Error> {
    Number::Constant(*value).serialize(serializer)
}

/// Serialises lists of such numbers.
pub(super) fn lists_as_typed<S: Serializer>(lists: &[Vec<f64>], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(lists.iter().map(|list| list.iter().copied().map(Number::Constant).collect::<Vec<_>>()))
}
