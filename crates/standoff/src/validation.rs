//! Errors for parameters that are out of range. Every `...Params` is checked once, when an object is built from it.

use core::fmt;

/// A parameter outside its allowed range.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{path} = {value}: must be {allowed}")]
pub struct ParamError {
    /// Path of the parameter in the checked type: field names joined by dots, as in `track.sensor.range_sd_m`.
    pub path: String,
    /// The given value.
    pub value: f64,
    /// Allowed range.
    pub allowed: Allowed,
}

/// Joins the errors of several fields and prefixes each path with the name of its field.
pub(crate) fn errors_of<const N: usize>(fields: [(&'static str, Vec<ParamError>); N]) -> Vec<ParamError> {
    let within = |(field, errors): (&'static str, Vec<ParamError>)| {
        errors.into_iter().map(move |error| ParamError { path: format!("{field}.{}", error.path), ..error })
    };
    fields.into_iter().flat_map(within).collect()
}

/// An interval of allowed values, in the parameter's unit.
///
/// ```
/// use standoff::validation::Allowed;
///
/// let gain = Allowed::at_least(0.001).at_most(1.0);
/// assert!(gain.contains(0.2) && !gain.contains(0.0) && !gain.contains(f64::NAN));
/// assert_eq!(gain.to_string(), "at least 0.001 and at most 1");
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Allowed {
    lower: Bound,
    upper: Bound,
    /// Why the interval has this bound, if another parameter sets it; otherwise empty.
    pub because: &'static str,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Bound {
    None,
    Open(f64),
    Closed(f64),
}

impl Allowed {
    /// Every finite number.
    pub const FINITE: Self = Self { lower: Bound::None, upper: Bound::None, because: "" };

    /// Values larger than `limit`.
    pub const fn above(limit: f64) -> Self {
        Self { lower: Bound::Open(limit), ..Self::FINITE }
    }

    /// Values of at least `limit`.
    pub const fn at_least(limit: f64) -> Self {
        Self { lower: Bound::Closed(limit), ..Self::FINITE }
    }

    /// Exactly one value.
    pub const fn exactly(value: f64) -> Self {
        Self::at_least(value).at_most(value)
    }

    /// Adds a lower limit that is included.
    pub(crate) const fn and_at_least(self, limit: f64) -> Self {
        Self { lower: Bound::Closed(limit), ..self }
    }

    /// Adds an upper limit that is excluded.
    pub const fn below(self, limit: f64) -> Self {
        Self { upper: Bound::Open(limit), ..self }
    }

    /// Adds an upper limit that is included.
    pub const fn at_most(self, limit: f64) -> Self {
        Self { upper: Bound::Closed(limit), ..self }
    }

    /// Names the other parameter that sets the bound.
    pub const fn with_reason(self, because: &'static str) -> Self {
        Self { because, ..self }
    }

    /// True if the value is finite and inside the interval.
    pub fn contains(&self, value: f64) -> bool {
        let above = match self.lower {
            Bound::None => true,
            Bound::Open(limit) => value > limit,
            Bound::Closed(limit) => value >= limit,
        };
        let below = match self.upper {
            Bound::None => true,
            Bound::Open(limit) => value < limit,
            Bound::Closed(limit) => value <= limit,
        };
        value.is_finite() && above && below
    }

    /// Returns the same interval in another unit: applies an increasing function to every bound.
    pub fn map(self, convert: impl Fn(f64) -> f64) -> Self {
        let bound = |bound| match bound {
            Bound::None => Bound::None,
            Bound::Open(limit) => Bound::Open(convert(limit)),
            Bound::Closed(limit) => Bound::Closed(convert(limit)),
        };
        Self { lower: bound(self.lower), upper: bound(self.upper), because: self.because }
    }

    /// Adds an error for the parameter at `path` if its value is outside the interval.
    pub fn check(&self, path: &str, value: f64, errors: &mut Vec<ParamError>) {
        if !self.contains(value) {
            errors.push(ParamError { path: path.to_owned(), value, allowed: *self });
        }
    }
}

impl fmt::Display for Allowed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Bounds converted from radians carry rounding noise, which is removed here.
        let tidy = |limit: f64| (limit * 1e9).round() / 1e9;
        let because = |f: &mut fmt::Formatter<'_>| match self.because {
            "" => Ok(()),
            because => write!(f, " ({because})"),
        };
        if let (Bound::Closed(lower), Bound::Closed(upper)) = (self.lower, self.upper)
            && lower == upper
        {
            write!(f, "exactly {}", tidy(lower))?;
            return because(f);
        }
        let lower = match self.lower {
            Bound::None => None,
            Bound::Open(limit) => Some(format!("above {}", tidy(limit))),
            Bound::Closed(limit) => Some(format!("at least {}", tidy(limit))),
        };
        let upper = match self.upper {
            Bound::None => None,
            Bound::Open(limit) => Some(format!("below {}", tidy(limit))),
            Bound::Closed(limit) => Some(format!("at most {}", tidy(limit))),
        };
        match (lower, upper) {
            (None, None) => f.write_str("a finite number")?,
            (Some(lower), None) => f.write_str(&lower)?,
            (None, Some(upper)) => f.write_str(&upper)?,
            (Some(lower), Some(upper)) => write!(f, "{lower} and {upper}")?,
        }
        because(f)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_names_the_parameter_the_value_and_the_range() {
        let mut errors = Vec::new();
        let range = Allowed::above(0.0).at_most(2.0).with_reason("see the manual");
        range.check("lag_s", 3.0, &mut errors);
        assert_eq!(errors[0].to_string(), "lag_s = 3: must be above 0 and at most 2 (see the manual)");
    }

    #[test]
    fn an_error_of_a_field_carries_its_path() {
        let mut inner = Vec::new();
        Allowed::above(0.0).check("range_sd_m", 0.0, &mut inner);
        let errors = errors_of([("track", errors_of([("sensor", inner)]))]);
        assert_eq!(errors[0].to_string(), "track.sensor.range_sd_m = 0: must be above 0");
    }

    #[test]
    fn no_range_contains_a_value_that_is_not_finite() {
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert!(!Allowed::FINITE.contains(value));
            assert!(!Allowed::above(-1.0).contains(value));
        }
    }
}
