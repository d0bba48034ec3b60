//! Numbers and times of a CSV table as spreadsheets and GPS loggers write them.

use chrono::{DateTime, FixedOffset, NaiveDateTime};
use standoff_io::display_text::quoted;

use super::super::times::TimeForm;
use super::super::validate::{LOGGED_MILLISECONDS, LOGGED_SECONDS, Quantity};

/// Number format of a table. If no commas separate its fields, the first number with a decimal sign determines that
/// sign, because 1,234 is a different number with a decimal point than with a decimal comma.
pub(super) struct Numbers {
    /// True if a comma may be the decimal sign.
    may_be_comma: bool,
    decimal_sign: Option<char>,
}

impl Numbers {
    pub(super) fn new(separator: u8) -> Self {
        Self { may_be_comma: separator != b',', decimal_sign: None }
    }

    /// Parses `text`, the value of `key`, and checks it.
    pub(super) fn parse(&mut self, key: &str, text: &str, quantity: &Quantity) -> Result<f64, String> {
        let value = self.value(key, text)?;
        quantity.check(key, text, value)
    }

    /// Parses `text`, the value of `key`; `None` if it is not a number.
    pub(super) fn value(&mut self, key: &str, text: &str) -> Result<Option<f64>, String> {
        if !self.may_be_comma {
            return Ok(text.trim().parse().ok());
        }
        let value = text.trim().replace(',', ".").parse().ok();
        // Only valid numbers determine the decimal sign.
        if let (Some(_), Some(sign)) = (value, text.chars().find(|c| [',', '.'].contains(c)))
            && *self.decimal_sign.get_or_insert(sign) != sign
        {
            let [this, others] = if sign == ',' { ["comma", "point"] } else { ["point", "comma"] };
            let text = quoted(text);
            return Err(format!("{key} = {text} has a decimal {this}, others before it a {others}; write all alike"));
        }
        Ok(value)
    }
}

/// Time format of a file; the first time determines it.
#[derive(Default)]
pub(in super::super) struct Clock {
    /// Form of times that are numbers.
    of_numbers: TimeForm,
    form: Option<TimeForm>,
}

impl Clock {
    /// Creates the clock of the column `key`.
    pub(super) fn new(key: &str) -> Self {
        let in_milliseconds = key.to_ascii_lowercase().ends_with("_ms");
        Self { of_numbers: if in_milliseconds { TimeForm::Milliseconds } else { TimeForm::Seconds }, form: None }
    }

    /// Returns how the file writes its times, after the first of them.
    pub(in super::super) fn form(&self) -> TimeForm {
        self.form.unwrap_or(self.of_numbers)
    }

    /// Parses `text`, the value of `key`, as a time; returns microseconds.
    pub(super) fn time_us(&mut self, key: &str, text: &str, numbers: &mut Numbers) -> Result<i64, String> {
        let (quantity, unit_us) = match self.of_numbers {
            TimeForm::Milliseconds => (&LOGGED_MILLISECONDS, 1e3),
            _ => (&LOGGED_SECONDS, 1e6),
        };
        let (form, time_us) = match date_time(text) {
            Some((form, time_us)) if (-9e15..=9e15).contains(&(time_us as f64)) => (form, time_us),
            Some(_) => {
                return Err(format!(
                    "{key} = {} is out of range; must be in the years 1685 to 2255; correct it",
                    quoted(text)
                ));
            }
            None => (self.of_numbers, (numbers.parse(key, text, quantity)? * unit_us).round() as i64),
        };
        self.check_form(key, text, form)?;
        Ok(time_us)
    }

    /// Parses `text`, the value of `key`, as a date and time; returns microseconds since 1970.
    pub(in super::super) fn date_time_us(&mut self, key: &str, text: &str) -> Result<i64, String> {
        match date_time(text) {
            Some((form, time_us)) if (-9e15..=9e15).contains(&(time_us as f64)) => {
                self.check_form(key, text, form)?;
                Ok(time_us)
            }
            _ => Err(format!("{key} = {} is not a date-time like 2026-03-01T12:00:00.5Z", quoted(text))),
        }
    }

    /// Rejects a form that the times before it do not have.
    fn check_form(&mut self, key: &str, text: &str, form: TimeForm) -> Result<(), String> {
        match self.form.replace(form) {
            Some(before) if before != form => {
                let (text, form, before) = (quoted(text), form.name(), before.name());
                Err(format!("{key} = {text} is a {form}, the time before it a {before}; write all alike"))
            }
            _ => Ok(()),
        }
    }
}

/// Parses a date and time in ISO 8601, with a T or a blank in between; returns the form and the microseconds since
/// 1970.
fn date_time(text: &str) -> Option<(TimeForm, i64)> {
    // Most files have numbers, which this skips quickly.
    if !text.contains(':') {
        return None;
    }
    let text = text.trim().replace(',', ".");
    let local = || {
        ["%Y-%m-%dT%H:%M:%S%.f", "%Y-%m-%d %H:%M:%S%.f"]
            .into_iter()
            .find_map(|format| NaiveDateTime::parse_from_str(&text, format).ok())
    };
    // An offset may consist of hours only.
    let zoned = || {
        ["%Y-%m-%dT%H:%M:%S%.f%#z", "%Y-%m-%d %H:%M:%S%.f%#z"]
            .into_iter()
            .find_map(|format| DateTime::parse_from_str(&text, format).ok())
    };
    match text.parse::<DateTime<FixedOffset>>().ok().or_else(zoned) {
        Some(time) => Some((TimeForm::DateTime, time.timestamp_micros())),
        None => Some((TimeForm::LocalDateTime, local()?.and_utc().timestamp_micros())),
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::Coordinates;
    use super::super::super::validate::axes;
    use super::*;

    /// Parses the times of a column.
    fn times(key: &str, separator: u8, texts: &[&str]) -> Result<Vec<i64>, String> {
        let (mut clock, mut numbers) = (Clock::new(key), Numbers::new(separator));
        texts.iter().map(|text| clock.time_us(key, text, &mut numbers)).collect()
    }

    #[test]
    fn times_may_be_date_times() {
        // 2026-03-01 12:00 UTC, from `date -d 2026-03-01T12:00Z +%s`.
        let noon_us = 1_772_366_400_000_000;
        for text in [
            "2026-03-01T12:00:00Z",
            "2026-03-01T12:00:00.000Z",
            " 2026-03-01 12:00:00Z",
            "2026-03-01T14:00:00+02:00",
            "2026-03-01T06:30:00.0-0530",
            "2026-03-01 14:00:00,000 +02:00",
            "2026-03-01T12:00:00",
            "2026-03-01 12:00:00",
        ] {
            assert_eq!(times("time", b',', &[text]), Ok(vec![noon_us]), "{text}");
        }
        let parts = ["2026-03-01T12:00:00.5Z", "2026-03-01T12:00:00.250001Z"];
        assert_eq!(times("time", b',', &parts), Ok(vec![noon_us + 500_000, noon_us + 250_001]));
    }

    #[test]
    fn numbers_are_seconds_or_milliseconds_by_the_name_of_their_column() {
        assert_eq!(times("timestamp", b',', &["1772366400.25", "-1"]), Ok(vec![1_772_366_400_250_000, -1_000_000]));
        assert_eq!(times("Time_MS", b',', &["1772366400250", "0.5"]), Ok(vec![1_772_366_400_250_000, 500]));
        let error = times("timestamp", b',', &["1772366400250"]).unwrap_err();
        assert!(error.contains("is out of range") && error.ends_with("call the column time_ms"), "{error}");
        assert!(times("time_ms", b',', &["1772366400250000"]).unwrap_err().contains("9000000000000 ms"));
    }

    #[test]
    fn all_times_must_have_one_form() {
        for (first, second, expected) in [
            ("5", "2026-03-01T12:00:00Z", "is a date-time with an offset, the time before it a number"),
            ("2026-03-01T12:00:00Z", "5", "is a number, the time before it a date-time with an offset"),
            ("2026-03-01T12:00:00Z", "2026-03-01T12:00:01", "is a date-time without an offset, the time before it a"),
        ] {
            let error = times("time", b',', &[first, second]).unwrap_err();
            assert!(error.contains(expected) && error.ends_with("write all alike"), "{error}");
        }
    }

    #[test]
    fn invalid_times_are_rejected() {
        for text in ["noon", "", "12:00:00", "2026-02-30T12:00:00Z", "2026-03-01T25:00:00Z", "01.03.2026 12:00:00"] {
            let error = times("time", b',', &[text]).unwrap_err();
            assert!(error.contains("is not a number") && error.contains("2026-03-01T12:00:00.5Z"), "{error}");
        }
        assert!(times("time", b',', &["2300-01-01T00:00:00Z"]).unwrap_err().contains("the years 1685 to 2255"));
    }

    #[test]
    fn all_numbers_must_have_one_decimal_sign() {
        let metres = &axes(Coordinates::Metres)[0];
        let mut numbers = Numbers::new(b';');
        assert_eq!(numbers.parse("x", "12", metres), Ok(12.0));
        assert_eq!(numbers.parse("x", " -1,5e1", metres), Ok(-15.0));
        let mixed = numbers.parse("x", "1.5", metres).unwrap_err();
        assert_eq!(mixed, "x = \"1.5\" has a decimal point, others before it a comma; write all alike");
        assert!(numbers.parse("x", "1.234,5", metres).unwrap_err().starts_with("x = \"1.234,5\" is not a number"));
        let mut numbers = Numbers::new(b';');
        assert_eq!(numbers.parse("x", "1.5", metres), Ok(1.5));
        assert!(numbers.parse("x", "1,234", metres).is_err());
        assert!(Numbers::new(b',').parse("x", "1,5", metres).unwrap_err().contains("is not a number"));
    }
}
