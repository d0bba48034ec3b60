//! Makes untrusted text safe to print: names and values from files can contain anything, control characters and
//! megabytes of text included.

use std::path::Path;

/// Maximum number of characters of untrusted text within a message.
const PART: usize = 200;

/// Maximum number of characters of a line: enough for two paths and an explanation.
const LINE: usize = 1500;

/// Formats a number with its noun: `1 UAV`, `2 UAVs`.
#[must_use]
pub fn count(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}

/// Quotes a value from a file: on one line, at most 60 characters of it.
#[must_use]
pub fn quoted(text: &str) -> String {
    let (text, more) = cut(text, 60);
    format!("\"{}{more}\"", text.escape_debug().to_string().replace("\\'", "'"))
}

/// Escapes untrusted text within a message: on one line, at most 200 characters.
#[must_use]
pub fn printable(text: &str) -> String {
    // An escaped character can take ten characters.
    let (text, more) = cut(text, PART);
    let escaped = escaped(text);
    let (escaped, still_more) = cut(&escaped, PART);
    escaped.to_owned() + if more.is_empty() { still_more } else { more }
}

/// Escapes all characters that break the line or control a terminal, line ends included.
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

/// Escapes text of several lines except for its line ends. The middle of a very long line is left out.
#[must_use]
pub fn lines(text: &str) -> String {
    text.split('\n').map(|line| without_middle(escaped(line))).collect::<Vec<_>>().join("\n")
}

/// Returns text as typed by the user, with each character that could control a terminal replaced by one printable
/// character, so that the columns stay the same.
#[must_use]
pub fn as_typed(text: &str) -> String {
    text.replace("\r\n", "\n").chars().map(sign).collect()
}

fn sign(c: char) -> char {
    match c {
        '\n' | '\t' | '"' | '\'' | '\\' => c,
        // The Unicode pictures of control characters have the same order.
        '\0'..='\u{1f}' => char::from_u32(0x2400 + u32::from(c)).unwrap_or(char::REPLACEMENT_CHARACTER),
        c if c.escape_debug().len() > 1 => char::REPLACEMENT_CHARACTER,
        c => c,
    }
}

fn without_middle(line: String) -> String {
    let half = LINE / 2;
    if line.chars().count() <= LINE {
        return line;
    }
    let end = line.char_indices().nth_back(half - 1).map_or("", |(end, _)| &line[end..]);
    format!("{} ... {end}", cut(&line, half).0)
}

/// Formats the help line that suggests a known key or value.
pub fn did_you_mean(word: &str) -> String {
    format!("did you mean `{word}`?")
}

/// Returns the known word that is closest to the typed one: the first that continues it, or one with a few wrong
/// letters.
pub fn nearest<'a>(typed: &str, words: &[&'a str]) -> Option<&'a str> {
    // No key is longer. The distance takes time proportional to the product of both lengths.
    if typed.len() > 60 {
        return None;
    }
    let typed = typed.to_lowercase().replace('-', "_");
    let distance = |word: &str| {
        let continues = typed.len() > 3 && word.replace('-', "_").starts_with(&typed);
        if continues { 0 } else { strsim::damerau_levenshtein(&typed, &word.replace('-', "_")) }
    };
    let near = words.iter().map(|word| (distance(word), *word)).min_by_key(|(distance, _)| *distance);
    near.filter(|(distance, word)| *distance * 3 <= word.len()).map(|(_, word)| word)
}

/// Formats a path for messages.
#[must_use]
pub fn path(path: &Path) -> String {
    escaped(&path.to_string_lossy())
}

/// Formats a path as an argument of a command that users paste into a shell: quoted if the shell would change it. Text that
/// cannot be printed has the escapes of `$'...'`, which bash, zsh and ksh read.
#[must_use]
pub fn shell_path(path: &Path) -> String {
    let name = path.to_string_lossy();
    let is_plain = |c: char| c.is_alphanumeric() || "_@%+=:,./-".contains(c);
    // A command takes a leading hyphen for an option.
    let name = if name.starts_with('-') { format!("./{name}") } else { name.into_owned() };
    if !name.is_empty() && name.chars().all(is_plain) && !name.starts_with('=') {
        return name;
    }
    let is_printable = |c: char| "\"'\\".contains(c) || c.escape_debug().len() == 1;
    if path.to_str().is_some() && name.chars().all(is_printable) {
        return format!("'{}'", name.replace('\'', r"'\''"));
    }
    let mut quoted = if name.starts_with("./-") { "$'./" } else { "$'" }.to_owned();
    for part in path.as_os_str().as_encoded_bytes().utf8_chunks() {
        for c in part.valid().chars() {
            match c {
                '\'' | '\\' => quoted.extend(['\\', c]),
                c if is_printable(c) => quoted.push(c),
                '\n' | '\r' | '\t' => quoted.extend(c.escape_debug()),
                c => quoted += &format!("\\U{:08x}", u32::from(c)),
            }
        }
        part.invalid().iter().for_each(|byte| quoted += &format!("\\x{byte:02x}"));
    }
    quoted + "'"
}

/// Returns the first `most` characters of a text, and `...` if characters were left out.
fn cut(text: &str, most: usize) -> (&str, &'static str) {
    match text.char_indices().nth(most) {
        Some((end, _)) => (&text[..end], "..."),
        None => (text, ""),
    }
}

/// Width of text that is not written to a terminal, characters.
pub const WIDTH: usize = 99;

/// Wraps text at `width` characters. The first line starts with `first`; the others are indented by its length.
pub fn wrapped(first: &str, words: &str, width: usize) -> String {
    let indent = " ".repeat(first.chars().count());
    let lines = wrapped_lines(words, width.saturating_sub(indent.len()));
    let starts = [first].into_iter().chain(std::iter::repeat(&*indent));
    starts.zip(&lines).map(|(start, line)| format!("{start}{line}").trim_end().to_owned() + "\n").collect()
}

/// Breaks text into lines of at most `width` characters at its spaces; longer words have a line of their own.
pub fn wrapped_lines(words: &str, width: usize) -> Vec<String> {
    let mut lines = vec![String::new()];
    for word in words.split(' ') {
        let line = lines.last_mut().filter(|line| {
            let length = line.chars().count();
            length == 0 || length + 1 + word.chars().count() <= width
        });
        match line {
            Some(line) => *line += &if line.is_empty() { word.to_owned() } else { format!(" {word}") },
            None => lines.push(word.to_owned()),
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_from_files_is_shown_on_one_line() {
        assert_eq!(quoted("a\n\u{1b}[31m\"\u{202e}"), r#""a\n\u{1b}[31m\"\u{202e}""#);
        assert_eq!(quoted(r"O'Neill \'"), r#""O'Neill \\'""#);
        assert_eq!(quoted(&"é".repeat(61)), format!("\"{}...\"", "é".repeat(60)));
        assert_eq!(printable("it's \"é\"\r\u{9b}2J\0\u{7f}"), "it's \"é\"\\r\\u{9b}2J\\0\\u{7f}");
        assert_eq!(printable(&"x".repeat(9999)), "x".repeat(200) + "...");
        assert_eq!(printable(&"\u{10ff00}".repeat(199)), r"\u{10ff00}".repeat(20) + "...");
        assert_eq!(lines("a\n\u{1b}b\n"), "a\n\\u{1b}b\n");
        assert_eq!(lines(&"🚗".repeat(1500)), "🚗".repeat(1500));
        assert_eq!(lines(&format!("a{}z", "é".repeat(9000))), format!("a{0} ... {0}z", "é".repeat(749)));
        assert_eq!(as_typed("\ta = \"\u{9b}2J\u{2028}\"\r\n\\b\u{feff}\r\u{7f}"), "\ta = \"�2J�\"\n\\b�␍�");
        assert_eq!(path(Path::new("o\u{1b}]0;title\u{7}/it's")), "o\\u{1b}]0;title\\u{7}/it's");
    }

    #[test]
    fn paths_of_commands_are_quoted_if_a_shell_would_change_them() {
        for (name, expected) in [
            ("standoff-out/a-1+uavs=5", "standoff-out/a-1+uavs=5"),
            ("Zürich/01.csv", "Zürich/01.csv"),
            ("night shift", "'night shift'"),
            ("~/runs/a", "'~/runs/a'"),
            ("it's $HOME", r"'it'\''s $HOME'"),
            ("a\\b\"c", "'a\\b\"c'"),
            ("*;&", "'*;&'"),
            ("", "''"),
            ("-rf", "./-rf"),
            ("- f", "'./- f'"),
            ("-a\n'b\u{1b}", r"$'./-a\n\'b\U0000001b'"),
        ] {
            assert_eq!(shell_path(Path::new(name)), expected);
        }
        #[cfg(unix)]
        {
            use std::os::unix::ffi::OsStrExt;
            let latin_1 = std::ffi::OsStr::from_bytes(b"Caf\xe9");
            assert_eq!(shell_path(Path::new(latin_1)), r"$'Caf\xe9'");
        }
    }

    #[test]
    fn text_is_wrapped_at_spaces_and_indented() {
        assert_eq!(wrapped_lines("a bc def", 4), ["a bc", "def"]);
        assert_eq!(wrapped_lines("abcdef a", 4), ["abcdef", "a"]);
        let text = wrapped("  * ", &"word ".repeat(40), 79);
        assert!(text.starts_with("  * word ") && text.contains("\n    word "), "{text}");
        assert!(text.lines().all(|line| line.chars().count() <= 79), "{text}");
        assert_eq!(wrapped("", "", WIDTH), "\n");
    }
}
