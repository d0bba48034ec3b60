//! Keys that a sweep varies, with their values or range.

use standoff_io::display_text::quoted;

/// Maximum size of the ends of a range. TOML writes larger whole numbers differently.
const END_MAX: f64 = 1e15;

/// A key of the scenario and the values that a sweep gives to it.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    pub(super) key: String,
    pub(super) values: AxisValues,
}

/// Values of a key.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum AxisValues {
    /// Values as TOML text, in order.
    Listed(Vec<String>),
    /// Range of numbers, from which a Latin hypercube draws.
    Range { from: f64, to: f64 },
}

impl Axis {
    /// Parses `KEY=A,B,C`, `KEY=FROM..TO:COUNT` or `KEY=FROM..TO`.
    pub fn parse(typed: &str) -> Result<Self, String> {
        let forms = "write KEY=A,B,C, KEY=FROM..TO:COUNT or KEY=FROM..TO";
        let (key, values) = typed.split_once('=').ok_or_else(|| format!("{}: {forms}", quoted(typed)))?;
        Self::of(key, values)
    }

    /// Parses the values of a key, in the same forms.
    pub fn of(key: &str, values: &str) -> Result<Self, String> {
        let key = key.trim();
        let refused = |what: String| format!("{key}={values}: {what}");
        if key.is_empty() {
            return Err(refused("a key is missing before =".to_owned()));
        }
        let values = match values.split_once("..") {
            // A list of distributions or text may contain dots.
            Some((from, rest)) if !values.contains([',', '"', '\'', '[', '{']) => {
                let (to, count) = rest.split_once(':').map_or((rest, None), |(to, count)| (to, Some(count)));
                range(from, to, count).map_err(refused)?
            }
            _ => AxisValues::Listed(list(values).map_err(refused)?),
        };
        Ok(Self { key: key.to_owned(), values })
    }

    /// Makes a key with these values, as TOML text.
    pub fn listed(key: &str, values: Vec<String>) -> Result<Self, String> {
        let values = distinct(values).map_err(|what| format!("{key}: {what}"))?;
        Ok(Self { key: key.to_owned(), values: AxisValues::Listed(values) })
    }

    /// Key of the scenario.
    pub fn key(&self) -> &str {
        &self.key
    }
}

fn range(from: &str, to: &str, count: Option<&str>) -> Result<AxisValues, String> {
    let end = |typed: &str| {
        let end: Option<f64> = typed.trim().parse().ok().filter(|end: &f64| end.abs() <= END_MAX);
        end.ok_or_else(|| format!("{} is not a number between -1e15 and 1e15", quoted(typed.trim())))
    };
    let (from, to) = (end(from)?, end(to)?);
    if from >= to {
        return Err("the range must start below its end".to_owned());
    }
    let Some(count) = count else { return Ok(AxisValues::Range { from, to }) };
    let steps: Option<u32> = count.trim().parse().ok().filter(|count| (2..=1000).contains(count));
    let last = steps.ok_or_else(|| format!("COUNT is {}: must be a whole number from 2 to 1000", quoted(count)))? - 1;
    let value = |step: u32| (from * f64::from(last - step) + to * f64::from(step)) / f64::from(last);
    Ok(AxisValues::Listed((0..=last).map(|step| without_rounding_error(value(step)).to_string()).collect()))
}

/// Rounds to 15 digits: 0.6, not 0.6000000000000001.
fn without_rounding_error(value: f64) -> f64 {
    format!("{value:.14e}").parse().unwrap_or(value)
}

/// Splits at the commas that are outside of quotes and brackets.
fn list(values: &str) -> Result<Vec<String>, String> {
    let (mut found, mut depth, mut quote) = (vec![String::new()], 0_i32, None);
    for c in values.chars() {
        match (c, quote) {
            (',', None) if depth == 0 => {
                found.push(String::new());
                continue;
            }
            ('[' | '{', None) => depth += 1,
            (']' | '}', None) => depth -= 1,
            ('"' | '\'', None) => quote = Some(c),
            (c, Some(open)) if c == open => quote = None,
            _ => {}
        }
        if let Some(last) = found.last_mut() {
            last.push(c);
        }
    }
    distinct(found.into_iter().map(|value| value.trim().to_owned()).collect())
}

fn distinct(values: Vec<String>) -> Result<Vec<String>, String> {
    if values.is_empty() || values.iter().any(String::is_empty) {
        return Err("a value is missing".to_owned());
    }
    match (1..values.len()).find(|&index| values[..index].contains(&values[index])) {
        Some(index) => Err(format!("{} is listed twice", quoted(&values[index]))),
        None => Ok(values),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn listed(typed: &str) -> Vec<String> {
        match Axis::parse(typed).unwrap().values {
            AxisValues::Listed(values) => values,
            range @ AxisValues::Range { .. } => panic!("{range:?}"),
        }
    }

    #[test]
    fn lists_and_evenly_spaced_values_are_read() {
        assert_eq!(listed("uavs.count=2, 4,8"), ["2", "4", "8"]);
        assert_eq!(listed("guidance.lead_s=0..1:11")[3], "0.3");
        assert_eq!(listed("a=0.2..1:5"), ["0.2", "0.4", "0.6", "0.8", "1"]);
        assert_eq!(listed("a=0..3:4"), ["0", "1", "2", "3"]);
        assert_eq!(listed("a=paper"), ["paper"]);
        assert_eq!(listed("a=[1,2],{ x = 1, y = 2 },\"b,c\""), ["[1,2]", "{ x = 1, y = 2 }", "\"b,c\""]);
        let range = Axis::parse("a=-1.5..2").unwrap();
        assert_eq!(range, Axis { key: "a".to_owned(), values: AxisValues::Range { from: -1.5, to: 2.0 } });
    }

    #[test]
    fn wrong_axes_are_refused() {
        for (typed, what) in [
            ("a", "write KEY=A,B,C"),
            ("=1", "a key is missing"),
            ("a=", "a value is missing"),
            ("a=1,,2", "a value is missing"),
            ("a=1,2,1", "\"1\" is listed twice"),
            ("a=3..1", "must start below its end"),
            ("a=0..x", "\"x\" is not a number"),
            ("a=0..inf", "is not a number"),
            ("a=0..1:1", "must be a whole number from 2 to 1000"),
        ] {
            let error = Axis::parse(typed).unwrap_err();
            assert!(error.contains(what), "{typed}: {error}");
        }
    }
}
