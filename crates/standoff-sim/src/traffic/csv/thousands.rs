//! Recognises positions that may have separators of thousands: 1.010 may be 1.01 m or 1,010 m.

use standoff_io::display_text::quoted;

/// The positions of a table, as far as they may have separators of thousands.
#[derive(Default)]
pub(super) struct Thousands {
    /// First position with a sign before its last three digits.
    example: Option<String>,
    has_whole_numbers: bool,
    has_decimals: bool,
}

impl Thousands {
    /// Adds `text`, the value of `key`.
    pub(super) fn add(&mut self, key: &str, text: &str) {
        let is_digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
        let digits = text.trim().trim_start_matches(['-', '+']);
        match digits.split_once([',', '.']) {
            None => {
                self.has_whole_numbers |= digits != "0";
                self.has_decimals |= digits.len() > 3 || !is_digits(digits);
            }
            Some((whole, part))
                if matches!(whole.len(), 1..=3) && part.len() == 3 && is_digits(whole) && is_digits(part) =>
            {
                self.has_decimals |= whole.starts_with('0');
                if self.example.is_none() {
                    self.example = Some(format!("{key} = {}", quoted(text.trim())));
                }
            }
            Some(_) => self.has_decimals = true,
        }
    }

    /// Returns an example if all positions with a sign have three digits after it, and whether others are whole numbers:
    /// no program writes decimals so.
    pub(super) fn found(self) -> Option<(String, bool)> {
        self.example.filter(|_| !self.has_decimals).map(|example| (example, self.has_whole_numbers))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_groups_of_three_digits_may_be_thousands() {
        let found = |values: &[&str]| {
            let mut thousands = Thousands::default();
            values.iter().for_each(|value| thousands.add("x", value));
            thousands.found()
        };
        assert_eq!(found(&["1.000", "0", "-12.500"]), Some(("x = \"1.000\"".to_owned(), false)));
        assert_eq!(found(&["990", "1,000"]), Some(("x = \"1,000\"".to_owned(), true)));
        for decimals in
            [&["1.000", "0.500"][..], &["1.000", "1000"], &["1.000", "2.5"], &["1234.567"], &["990"], &["1e3"]]
        {
            assert_eq!(found(decimals), None, "{decimals:?}");
        }
    }
}
