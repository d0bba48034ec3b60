//! Compares the names of vehicles, because two spellings of a name split a vehicle in two.

use unicode_normalization::UnicodeNormalization;

/// Returns a name as it looks: in composed characters, without invisible ones, with single blanks.
pub(super) fn as_shown(name: &str) -> String {
    if name.bytes().all(|byte| byte.is_ascii_graphic()) {
        return name.to_owned();
    }
    let visible: String = name.chars().filter(|c| !is_invisible(*c)).nfc().collect();
    visible.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Returns the part of a shown name that spellings of it share: without case, compatibility forms, kinds of dash and of
/// decimal sign, leading zeros and the `.0` of a whole number.
pub(super) fn folded(shown: &str) -> String {
    let lower = shown.nfkc().flat_map(char::to_lowercase).map(|c| match c {
        ' ' | '_' | '\u{2010}'..='\u{2015}' | '\u{2212}' => '-',
        '\u{2018}' | '\u{2019}' => '\'',
        ',' => '.',
        c => c,
    });
    let mut folded = String::with_capacity(shown.len());
    // Zeros after a decimal point count.
    let mut may_lead = true;
    let mut characters = lower.peekable();
    while let Some(c) = characters.next() {
        let is_leading_zero = may_lead && c == '0' && characters.peek().is_some_and(char::is_ascii_digit);
        if !is_leading_zero {
            folded.push(c);
            may_lead = !c.is_ascii_digit() && c != '.';
        }
    }
    match folded.split_once('.') {
        Some((whole, part)) if is_whole(whole) && part.bytes().all(|byte| byte == b'0') => whole.to_owned(),
        _ => folded,
    }
}

fn is_whole(number: &str) -> bool {
    !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit())
}

/// Returns whether a character takes no room: controls other than blanks, joiners, marks of direction, selectors.
fn is_invisible(c: char) -> bool {
    c.is_control() && !c.is_whitespace()
        || matches!(c,
            '\u{ad}' | '\u{34f}' | '\u{61c}' | '\u{180b}'..='\u{180e}' | '\u{200b}'..='\u{200f}'
            | '\u{202a}'..='\u{202e}' | '\u{2060}'..='\u{206f}' | '\u{fe00}'..='\u{fe0f}' | '\u{feff}')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_look_the_same_are_equal() {
        for (one, other) in [
            ("Caf\u{e9}", "Cafe\u{301}"),
            ("a b", "\ta\u{a0} b "),
            ("bus", "b\u{200b}us\u{feff}"),
            ("bus", "bus\0"),
            ("\u{212b}", "\u{c5}"),
        ] {
            assert_eq!(as_shown(one), as_shown(other));
        }
        for (one, other) in [("a b", "ab"), ("bus", "Bus"), ("e", "\u{e9}"), ("1", "1.0")] {
            assert_ne!(as_shown(one), as_shown(other));
        }
    }

    #[test]
    fn spellings_of_a_name_fold_to_one() {
        for (one, other) in [
            ("Van", "van"),
            ("1", "1.0"),
            ("12.00", "012"),
            ("1", "1,0"),
            ("1.5", "1,5"),
            ("bus 07", "BUS_7"),
            ("bus-7", "bus\u{2013}7"),
            ("\u{ff11}", "1"),
            ("0", "000"),
            ("x00", "x0"),
            ("o'neill", "o\u{2019}neill"),
        ] {
            assert_eq!(folded(one), folded(other), "{one}");
        }
        // SUMO numbers the vehicles of a flow: 1.1 and 1.10 are two of them.
        for (one, other) in [
            ("1.1", "1.10"),
            ("1.0.1", "1.1"),
            ("a.0", "a"),
            ("1", "10"),
            ("1.05", "1.5"),
            ("1,05", "1,5"),
            ("a1", "a"),
        ] {
            assert_ne!(folded(one), folded(other), "{one}");
        }
    }
}
