//! Checks the single values of traffic files and describes what is wrong.

use standoff_io::display_text::quoted;

use super::Coordinates;

/// A kind of number: its range, and the advice if a value is outside it.
pub(super) struct Quantity {
    low: f64,
    high: f64,
    unit: &'static str,
    advice: &'static str,
}

/// Time. Beyond this range, an f64 in seconds cannot resolve a microsecond.
const TIME: Quantity =
    Quantity { low: -9e9, high: 9e9, unit: "s", advice: "give plain seconds (SUMO: without --human-readable-time)" };
/// Time in a table, in seconds.
pub(super) const LOGGED_SECONDS: Quantity = Quantity {
    unit: "s, or a date-time like 2026-03-01T12:00:00.5Z",
    advice: "if it is milliseconds, call the column time_ms",
    ..TIME
};
/// Time in a table, in milliseconds.
pub(super) const LOGGED_MILLISECONDS: Quantity = Quantity {
    low: -9e12,
    high: 9e12,
    unit: "ms, or a date-time like 2026-03-01T12:00:00.5Z",
    advice: "if it is seconds, call the column time_s",
};
/// East or north.
const METRES: Quantity = Quantity { low: -1e8, high: 1e8, unit: "m", advice: "remove the sample or correct it" };
/// East or north, if the unit of the file's coordinates is unknown.
const METRES_OR_DEGREES: Quantity = Quantity { unit: "m, or degrees", ..METRES };
/// Degrees north.
const LATITUDE: Quantity = Quantity { low: -90.0, high: 90.0, unit: "degrees north", advice: NO_DEGREES };
/// Degrees east; beyond 180 as in files with longitudes of 0 to 360.
const LONGITUDE: Quantity = Quantity { low: -180.0, high: 360.0, unit: "degrees east", advice: NO_DEGREES };
const NO_DEGREES: &str = "correct the sample or remove it; if all coordinates are metres, set traffic.coordinates = \
                          \"metres\", and call the columns of a table x_m and y_m";
/// Both coordinates of SUMO if an object has no position, m.
const SUMO_UNKNOWN_M: f64 = -1_073_741_824.0;
/// Longitude and latitude in GPX.
pub(super) const GPX_AXES: [Quantity; 2] = [
    Quantity { advice: "correct the point or remove it", ..LONGITUDE },
    Quantity { advice: "correct the point or remove it", ..LATITUDE },
];
/// Priority of a vehicle.
pub(super) const PRIORITY: Quantity = Quantity { low: 0.01, high: 100.0, unit: "", advice: "leave it blank for 1" };
/// Returns the quantities of x and y.
pub(super) fn axes(coordinates: Coordinates) -> [Quantity; 2] {
    match coordinates {
        Coordinates::Auto => [METRES_OR_DEGREES, METRES_OR_DEGREES],
        Coordinates::Metres => [METRES, METRES],
        Coordinates::Degrees => [LONGITUDE, LATITUDE],
    }
}

/// Parses a coordinate without a check; NaN if it is blank.
pub(super) fn raw(text: &str) -> Option<f64> {
    let text = text.trim();
    if text.is_empty() { Some(f64::NAN) } else { text.parse().ok() }
}

/// Returns whether these coordinates (x and y, or longitude and latitude) stand for an unknown position. Receivers write 0,
/// values out of range, or the largest number; those out of range are the same for both coordinates, except in AIS.
pub(super) fn is_unknown(coordinates: Coordinates, [x, y]: [f64; 2]) -> bool {
    let is_none = !x.is_finite() && !y.is_finite() || [x, y] == [SUMO_UNKNOWN_M; 2];
    let [longitude, latitude] = [x.abs(), y.abs()];
    let is_unknown_degrees = || {
        [longitude, latitude] == [0.0; 2]
            || [longitude, latitude] == [181.0, 91.0]
            || [longitude, latitude] == [180.0, 90.0]
            || latitude > 90.0 && longitude == latitude
    };
    is_none || coordinates == Coordinates::Degrees && is_unknown_degrees()
}

impl Quantity {
    pub(super) const fn new(low: f64, high: f64, unit: &'static str, advice: &'static str) -> Self {
        Self { low, high, unit, advice }
    }

    /// Returns whether `value` is in the range; `false` for NaN.
    pub(super) fn contains(&self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
    }

    /// Parses `text`, the value of `key`.
    pub(super) fn parse(&self, key: &str, text: &str) -> Result<f64, String> {
        self.check(key, text, text.trim().parse().ok())
    }

    /// Checks `value`, which was parsed from `text`, the value of `key`; `None` if that is not a number.
    pub(super) fn check(&self, key: &str, text: &str, value: Option<f64>) -> Result<f64, String> {
        let Self { low, high, unit, advice } = self;
        let (wrong, advice) = match value {
            Some(value) if self.contains(value) => return Ok(value),
            Some(value) if value.is_finite() => ("is out of range", *advice),
            Some(_) => ("is not finite", *advice),
            None if has_thousands(text) => {
                ("is not a number", "write numbers with a decimal point and without separators of thousands")
            }
            None => ("is not a number", *advice),
        };
        let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
        Err(format!("{key} = {} {wrong}; {low} to {high}{unit}; {advice}", quoted(text)))
    }
}

/// Returns whether `text` is a number with separators of thousands, perhaps with decimals.
fn has_thousands(text: &str) -> bool {
    let digits = text.trim().trim_start_matches(['-', '+']);
    let is_digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    let is_separator = |c: char| c.is_whitespace() || ",.'\u{2019}_".contains(c);
    let Some(separator) = digits.chars().find(|c| !c.is_ascii_digit()).filter(|c| is_separator(*c)) else {
        return false;
    };
    // Another sign separates the decimals.
    let whole = match digits.rsplit_once([',', '.']) {
        Some((whole, decimals)) if !digits[whole.len()..].starts_with(separator) && is_digits(decimals) => whole,
        _ => digits,
    };
    let mut groups = whole.split(separator);
    groups.next().is_some_and(|first| matches!(first.len(), 1..=3))
        && groups.all(|group| group.len() == 3 && is_digits(group))
}

/// Parses `text`, the value of `key`, as a time in seconds; returns microseconds.
pub(super) fn time_us(key: &str, text: &str) -> Result<i64, String> {
    Ok((TIME.parse(key, text)? * 1e6).round() as i64)
}

/// Checks the name of a vehicle, the value of `key`.
pub(super) fn check_name(key: &str, name: &str) -> Result<(), String> {
    let length = name.chars().count();
    if (1..=200).contains(&length) {
        return Ok(());
    }
    let advice = if length == 0 { "a name" } else { "a shorter name" };
    Err(format!("{key} = {} has {length} characters; 1 to 200; give the vehicle {advice}", quoted(name)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_read_with_blanks_around() {
        assert_eq!(METRES.parse("x", " -1.5e3\r"), Ok(-1500.0));
        assert_eq!(METRES.parse("x", "1e8"), Ok(1e8));
    }

    #[test]
    fn number_errors_contain_the_range_and_advice() {
        for (text, wrong) in [
            ("abc", "is not a number"),
            ("", "is not a number"),
            ("1,5", "is not a number"),
            ("NaN", "is not finite"),
            ("-inf", "is not finite"),
            ("1e999", "is not finite"),
            ("1.0001e8", "is out of range"),
        ] {
            let expected =
                format!("x = \"{text}\" {wrong}; -100000000 to 100000000 m; remove the sample or correct it");
            assert_eq!(METRES.parse("x", text), Err(expected));
        }
    }

    #[test]
    fn separators_of_thousands_are_named() {
        for text in ["1 000", "-1\u{202f}000", "1,000", "4.929.100", "4,929,100.25", "4.929.100,5", "1'000", "12 345.6"]
        {
            let message = METRES.check("x", text, None).unwrap_err();
            let advice = "write numbers with a decimal point and without separators of thousands";
            assert!(message.ends_with(advice), "{message}");
        }
        for text in ["1,5", "1 00", "1234,567", "1.2.3", ",000", "1:000", "abc", "", "a 000", "1,000,5"] {
            let message = METRES.check("x", text, None).unwrap_err();
            assert!(message.ends_with(METRES.advice), "{message}");
        }
    }

    #[test]
    fn every_quantity_has_its_range() {
        for (quantity, inside, outside) in
            [(&METRES_OR_DEGREES, "-1e8", "-1.1e8"), (&LATITUDE, "-90", "90.1"), (&LONGITUDE, "360", "-180.1")]
        {
            assert!(quantity.parse("key", inside).is_ok());
            assert!(quantity.parse("key", outside).is_err());
        }
    }

    #[test]
    fn positions_that_receivers_mark_as_unknown_are_recognised() {
        let in_degrees = |at| is_unknown(Coordinates::Degrees, at);
        let largest = 2_147_483_647.0;
        for value in [0.0, largest, 1e-7 * largest, 999.0, -9999.0, 1e20, f64::NAN, f64::INFINITY, 180.0] {
            assert!(in_degrees([value, value]), "{value}");
        }
        assert!(in_degrees([181.0, 91.0]) && in_degrees([-180.0, 90.0]) && in_degrees([f64::NAN, f64::INFINITY]));
        for at in [[0.0, 1.0], [11.3, 44.5], [89.0, 89.0], [181.0, 44.5], [f64::NAN, 44.5], [11.3, 91.0]] {
            assert!(!in_degrees(at), "{at:?}");
        }
        let in_metres = |at| is_unknown(Coordinates::Metres, at);
        assert!(in_metres([SUMO_UNKNOWN_M; 2]) && !in_metres([0.0; 2]) && !in_metres([999.0; 2]));
    }

    #[test]
    fn times_become_whole_microseconds() {
        assert_eq!(time_us("time", "1250.30"), Ok(1_250_300_000));
        assert_eq!(time_us("time", "-0.0000015"), Ok(-2));
        assert!(time_us("time", "00:20:50").unwrap_err().contains("--human-readable-time"));
        assert!(time_us("time", "1e10").unwrap_err().contains("out of range"));
    }

    #[test]
    fn names_are_neither_empty_nor_too_long() {
        assert!(check_name("id", &"é".repeat(200)).is_ok());
        assert!(check_name("id", "").is_err());
        let message = check_name("id", &"x".repeat(201)).unwrap_err();
        assert!(message.contains("has 201 characters; 1 to 200") && message.len() < 150, "{message}");
    }
}
