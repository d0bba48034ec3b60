//! Finds the tags that link code and tests to equations.
//!
//! A tag is a sentence of a doc comment that starts with "Implements" (code) or "Checks" (a test). It names equations,
//! `Eq. (10), (11)`, `(5, 6)`, `(8-11)`, `Lemma 3.1`, `Algorithm 1` or `section IV.B.2`, anywhere up to the end of its
//! paragraph; text in backticks is ignored. A tag belongs to the next item after the comment, or to the file (`//!`).
//! The search is based on lines only; a parser is not needed.

/// Kind of a tag.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Claim {
    Implements,
    Checks,
}

/// A link between an item and an equation.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Tag {
    pub(crate) claim: Claim,
    /// Id of the equation, as in docs/developer/equations.toml.
    pub(crate) equation: String,
    /// Path relative to the root of the workspace, with `/`.
    pub(crate) path: String,
    /// Line number of the end of the paragraph, from 1.
    pub(crate) line: usize,
    pub(crate) item: String,
}

/// Returns all tags of a file. If several ids in `known` match, the longest wins: `section IV.B.2, convergence rule`
/// and `section IV.B.2` can both exist.
pub(crate) fn find(path: &str, source: &str, known: &[&str]) -> Vec<Tag> {
    let lines: Vec<&str> = source.lines().map(str::trim_start).collect();
    let file_name = path.rsplit('/').next().unwrap_or(path);
    let mut tags = Vec::new();
    let (mut paragraph, mut of_file, mut in_fence) = (String::new(), false, false);
    for (index, line) in lines.iter().chain([&""]).enumerate() {
        let comment = doc_text(line);
        let is_fence = comment.is_some_and(|(text, _)| text.trim_start().starts_with("```"));
        let more = comment.filter(|(text, _)| !is_fence && !in_fence && !text.trim().is_empty());
        in_fence = comment.is_some() && (in_fence != is_fence);
        if more.is_none_or(|(_, inner)| inner != of_file) {
            let next_item = || lines.get(index..)?.iter().find_map(|line| item(line));
            let item = if of_file { None } else { next_item() }.unwrap_or_else(|| file_name.to_string());
            for (claim, text) in claims(&paragraph) {
                for equation in names(text, known) {
                    tags.push(Tag { claim, equation, path: path.to_string(), line: index, item: item.clone() });
                }
            }
            paragraph.clear();
        }
        if let Some((text, inner)) = more {
            of_file = inner;
            paragraph.push_str(text.trim());
            paragraph.push(' ');
        }
    }
    tags
}

/// Returns the text of a doc-comment line, and true if it is an inner one (`//!`); `None` for other lines.
fn doc_text(line: &str) -> Option<(&str, bool)> {
    let outer = line.strip_prefix("///").filter(|text| !text.starts_with('/')).map(|text| (text, false));
    outer.or_else(|| line.strip_prefix("//!").map(|text| (text, true)))
}

/// Returns the claims of a paragraph; each one extends to the next claim or to the end of the paragraph.
fn claims(paragraph: &str) -> Vec<(Claim, &str)> {
    let starts_sentence = |at: usize| {
        let before = paragraph[..at].trim_end();
        before.is_empty() || before.ends_with(['.', '!', '?'])
    };
    let mut starts: Vec<(usize, Claim)> = [("Implements ", Claim::Implements), ("Checks ", Claim::Checks)]
        .into_iter()
        .flat_map(|(word, claim)| paragraph.match_indices(word).map(move |(at, _)| (at, claim)))
        .filter(|(at, _)| starts_sentence(*at))
        .collect();
    starts.sort_by_key(|(at, _)| *at);
    let ends = starts.iter().skip(1).map(|(at, _)| *at).chain([paragraph.len()]);
    starts.iter().zip(ends).map(|((at, claim), end)| (*claim, &paragraph[*at..end])).collect()
}

/// Returns the equations that a text names, without duplicates.
fn names(text: &str, known: &[&str]) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    let (mut before, mut in_code) = (' ', false);
    for (at, c) in text.char_indices() {
        in_code ^= c == '`';
        // A parenthesis after a word is a call, and after a bracket it is a link.
        if !in_code && !before.is_alphanumeric() && !matches!(before, '_' | ']') {
            let here = &text[at..];
            let found = if c == '(' { numbers(&here[1..]) } else { named(here, known).into_iter().collect() };
            for name in found {
                if !names.contains(&name) {
                    names.push(name);
                }
            }
        }
        before = c;
    }
    names
}

/// Returns the numbers at the beginning of a parenthesis, with ranges expanded.
fn numbers(text: &str) -> Vec<String> {
    let inside = text.split(')').next().unwrap_or_default();
    let range = |part: &str| -> Option<(u32, u32)> {
        let (first, last) = part.split_once('-').unwrap_or((part, part));
        Some((first.trim().parse().ok()?, last.trim().parse().ok()?))
    };
    inside.split(',').map_while(range).flat_map(|(first, last)| first..=last).map(|n| n.to_string()).collect()
}

/// Returns the lemma, algorithm or section whose name is at the beginning of the text.
fn named(text: &str, known: &[&str]) -> Option<String> {
    let kind = ["Lemma ", "Algorithm ", "section "].into_iter().find(|kind| text.starts_with(kind))?;
    let ends = |id: &str| !text[id.len()..].starts_with(char::is_alphanumeric);
    if let Some(id) = known.iter().filter(|id| text.starts_with(**id) && ends(id)).max_by_key(|id| id.len()) {
        return Some(id.to_string());
    }
    let number = text[kind.len()..].split(|c: char| !c.is_alphanumeric() && c != '.').next()?.trim_end_matches('.');
    // "Checks section by section" names nothing.
    let numbered = number.starts_with(|c: char| c.is_ascii_digit() || "IVX".contains(c));
    numbered.then(|| format!("{kind}{number}"))
}

/// Returns the name of the item that a line declares.
fn item(line: &str) -> Option<String> {
    if line.starts_with("//") || line.starts_with('#') {
        return None;
    }
    let words = line.split(|c: char| !c.is_alphanumeric() && c != '_').filter(|word| !word.is_empty());
    let mut words =
        words.skip_while(|word| ["pub", "crate", "super", "in", "unsafe", "async", "extern", "C"].contains(word));
    match words.next()? {
        "fn" | "struct" | "enum" | "trait" | "type" | "mod" | "static" => words.next().map(str::to_string),
        "const" => words.find(|word| !["fn", "unsafe"].contains(word)).map(str::to_string),
        "impl" => Some(line.split('{').next()?.trim().to_string()),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KNOWN: [&str; 3] = ["Lemma 3.1", "section IV.B.2", "section IV.B.2, convergence rule"];

    #[track_caller]
    fn check_names(text: &str, expected: &[&str]) {
        assert_eq!(names(text, &KNOWN), expected, "{text}");
    }

    #[test]
    fn all_forms_of_names_are_recognised() {
        check_names("Implements the H of Eq. (10), (11).", &["10", "11"]);
        check_names("Checks Eq. (5, 6): two half steps are one.", &["5", "6"]);
        check_names("Checks (8-10), and (12-13, 20, Lemma 3.1).", &["8", "9", "10", "12", "13", "20", "Lemma 3.1"]);
        check_names("Implements Eq. (13), and with k_l the direction of (20).", &["13", "20"]);
        check_names("Implements section IV.B.2's removal by range.", &["section IV.B.2"]);
        check_names("Implements section IV.B.2, convergence rule.", &["section IV.B.2, convergence rule"]);
        check_names("Implements Algorithm 1.", &["Algorithm 1"]);
        check_names("Checks Eq. (24)'s wrap, and (24) again.", &["24"]);
    }

    #[test]
    fn names_that_are_not_listed_are_found_too() {
        check_names("Implements Eq. (99) and Lemma 3.14, section II.D.", &["99", "Lemma 3.14", "section II.D"]);
    }

    #[test]
    fn formulas_values_code_and_links_are_not_names() {
        check_names("Checks f(3), `(4)`, [it](5), (r^2 - 6), (3.8, 7 m), (mean 2), x_(8), section by section.", &[]);
    }

    #[track_caller]
    fn check(source: &str, expected: &[(Claim, &str, usize, &str)]) {
        let tags = find("crates/a/src/b.rs", source, &KNOWN);
        let got: Vec<_> = tags.iter().map(|t| (t.claim, t.equation.as_str(), t.line, t.item.as_str())).collect();
        assert_eq!(got, expected, "{source}");
    }

    #[test]
    fn a_tag_belongs_to_the_next_item_past_attributes() {
        check(
            "/// Adds.\n///\n/// Implements Eq. (10),\n/// (11).\n#[must_use]\npub(crate) const fn update<'a>(\n",
            &[(Claim::Implements, "10", 4, "update"), (Claim::Implements, "11", 4, "update")],
        );
        check("/// Implements (1).\npub struct Uav {", &[(Claim::Implements, "1", 1, "Uav")]);
        check("    /// Checks (1).\n    const G: f64 = 9.8;", &[(Claim::Checks, "1", 1, "G")]);
        check("/// Implements (1).\nimpl Step for Uav {", &[(Claim::Implements, "1", 1, "impl Step for Uav")]);
        check("//! Implements (1).\n//!\n//! Eq. (2).\n\nfn f() {}", &[(Claim::Implements, "1", 1, "b.rs")]);
        check("//! Eq. (2).\n/// Implements (1).\nfn f() {}", &[(Claim::Implements, "1", 2, "f")]);
        check("/// Implements (1).", &[(Claim::Implements, "1", 1, "b.rs")]);
    }

    #[test]
    fn a_tag_starts_a_sentence_and_ends_with_its_paragraph() {
        check("/// Eq. (1). Implements (2).\n///\n/// And (3).\nfn f() {}", &[(Claim::Implements, "2", 1, "f")]);
        check("/// It Implements (1); see Checks (2).\n// Checks (3).\n//// Checks (4).\nfn f() {}", &[]);
        check(
            "/// Implements (1). Checks (2).\nfn f() {}",
            &[(Claim::Implements, "1", 1, "f"), (Claim::Checks, "2", 1, "f")],
        );
    }

    #[test]
    fn code_blocks_are_skipped() {
        check(
            "/// Implements (1):\n/// ```text\n/// Checks (2)\n/// ```\n/// (3)\nfn f() {}",
            &[(Claim::Implements, "1", 1, "f")],
        );
    }
}
