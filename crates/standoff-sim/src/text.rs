//! Text from outside as people may be shown it: names and values of files can hold anything, control characters and
//! megabytes included.

use std::path::Path;

/// Most characters of a message's part that is not ours.
const PART: usize = 200;

/// A value from a file, in quotes, on one line, and not too long.
#[must_use]
pub fn quoted(text: &str) -> String {
    let (text, more) = cut(text, 60);
    format!("\"{}{more}\"", text.escape_debug())
}

/// Somebody else's words as a part of a message: on one line, and not too long.
#[must_use]
pub fn words(text: &str) -> String {
    // Spelt out, a character can become ten.
    let (text, more) = cut(text, PART);
    let escaped = escaped(text);
    let (escaped, still_more) = cut(&escaped, PART);
    escaped.to_owned() + if more.is_empty() { still_more } else { more }
}

/// Text without characters that break the line or upset a terminal: they are spelt out. Line ends are among them.
#[must_use]
pub fn escaped(text: &str) -> String {
    let mut shown = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '"' | '\'' | '\\' => shown.push(c),
            c => shown.extend(c.escape_debug()),
        }
    }
    shown
}

/// Lines without any other characters that upset a terminal: for what is shown as a whole.
#[must_use]
pub fn lines(text: &str) -> String {
    text.split('\n').map(escaped).collect::<Vec<_>>().join("\n")
}

/// A path as messages name it.
#[must_use]
pub fn path(path: &Path) -> String {
    escaped(&path.to_string_lossy())
}

/// At most the first `most` characters of a text, and what stands for the rest.
fn cut(text: &str, most: usize) -> (&str, &'static str) {
    match text.char_indices().nth(most) {
        Some((end, _)) => (&text[..end], "..."),
        None => (text, ""),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_from_files_is_shown_on_one_line() {
        assert_eq!(quoted("a\n\u{1b}[31m\"\u{202e}"), r#""a\n\u{1b}[31m\"\u{202e}""#);
        assert_eq!(quoted(&"é".repeat(61)), format!("\"{}...\"", "é".repeat(60)));
        assert_eq!(words("it's \"é\"\r\u{9b}2J\0\u{7f}"), "it's \"é\"\\r\\u{9b}2J\\0\\u{7f}");
        assert_eq!(words(&"x".repeat(9999)), "x".repeat(200) + "...");
        assert_eq!(words(&"\u{10ff00}".repeat(199)), r"\u{10ff00}".repeat(20) + "...");
        assert_eq!(lines("a\n\u{1b}b\n"), "a\n\\u{1b}b\n");
        assert_eq!(path(Path::new("o\u{1b}]0;title\u{7}/it's")), "o\\u{1b}]0;title\\u{7}/it's");
    }
}
