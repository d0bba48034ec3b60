//! The equation ledger: which item implements each equation of the paper, and which test checks it.
//!
//! docs/developer/equations.toml lists the equations and their status, tags in doc comments link the code to them, and
//! docs/developer/ledger.md shows both.

mod tags;

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use tags::{Claim, Tag};

const LIST: &str = "docs/developer/equations.toml";
const LEDGER: &str = "docs/developer/ledger.md";

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct List {
    equation: Vec<Equation>,
}

/// An equation, lemma, algorithm or section of the paper, with its status in the project.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Equation {
    id: String,
    title: String,
    status: Status,
    deviation: Option<String>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum Status {
    Implemented,
    Planned,
    OutOfScope,
}

/// Writes the ledger even if it has problems, and returns a message that lists them.
pub(crate) fn write(root: &Path) -> Result<String, String> {
    let (equations, tags) = load(root)?;
    let path = root.join(LEDGER);
    fs::write(&path, render(&equations, &tags)).map_err(|error| format!("{LEDGER}: {error}"))?;
    let problems: String = problems(&equations, &tags).iter().map(|problem| format!("\nwarning: {problem}")).collect();
    Ok(format!("{LEDGER}: written, {} entries{problems}", equations.len()))
}

/// Checks the ledger; returns all problems as an error, one per line.
pub(crate) fn check(root: &Path) -> Result<String, String> {
    let (equations, tags) = load(root)?;
    let mut problems = problems(&equations, &tags);
    // A missing ledger differs from the first line on.
    let found = fs::read_to_string(root.join(LEDGER)).unwrap_or_default();
    problems.extend(out_of_date(&found, &render(&equations, &tags)));
    if problems.is_empty() { Ok(format!("{LEDGER}: up to date")) } else { Err(problems.join("\n")) }
}

fn load(root: &Path) -> Result<(Vec<Equation>, Vec<Tag>), String> {
    let list = fs::read_to_string(root.join(LIST)).map_err(|error| format!("{LIST}: {error}"))?;
    let list: List = toml::from_str(&list).map_err(|error| format!("{LIST}: {error}"))?;
    let known: Vec<&str> = list.equation.iter().map(|equation| equation.id.as_str()).collect();
    let mut tags = Vec::new();
    for package in entries(&root.join("crates"))?.into_iter().chain([root.join("studies")]) {
        for folder in ["src", "tests"].map(|name| package.join(name)).iter().filter(|folder| folder.is_dir()) {
            for file in rust_files(folder)? {
                let source = fs::read_to_string(&file).map_err(|error| format!("{}: {error}", file.display()))?;
                let path = file.strip_prefix(root).unwrap_or(&file).to_string_lossy().replace('\\', "/");
                tags.extend(tags::find(&path, &source, &known));
            }
        }
    }
    tags.sort_by(|a, b| (&a.path, a.line).cmp(&(&b.path, b.line)));
    Ok((list.equation, tags))
}

fn rust_files(folder: &Path) -> Result<Vec<PathBuf>, String> {
    let mut files = Vec::new();
    for entry in entries(folder)? {
        if entry.is_dir() {
            files.extend(rust_files(&entry)?);
        } else if entry.extension().is_some_and(|extension| extension == "rs") {
            files.push(entry);
        }
    }
    Ok(files)
}

fn entries(folder: &Path) -> Result<Vec<PathBuf>, String> {
    let read = || -> std::io::Result<Vec<PathBuf>> { fs::read_dir(folder)?.map(|entry| Ok(entry?.path())).collect() };
    read().map_err(|error| format!("{}: {error}", folder.display()))
}

/// Returns the contradictions between the list of equations and the tags.
fn problems(equations: &[Equation], tags: &[Tag]) -> Vec<String> {
    let mut problems = Vec::new();
    for tag in tags.iter().filter(|tag| !equations.iter().any(|equation| equation.id == tag.equation)) {
        let (Tag { path, line, item, .. }, name) = (tag, label(&tag.equation));
        problems.push(format!("{path}:{line}: `{item}` names {name}, which {LIST} does not list: correct one of them"));
    }
    for (index, equation) in equations.iter().enumerate() {
        let name = label(&equation.id);
        if equations[..index].iter().any(|other| other.id == equation.id) {
            problems.push(format!("{LIST}: {name} is listed twice: remove one"));
        }
        let claimed = |claim| tags.iter().find(|tag| tag.claim == claim && tag.equation == equation.id);
        match (equation.status, claimed(Claim::Implements), claimed(Claim::Checks)) {
            (Status::Implemented, code, test) => {
                for (word, _) in [("Implements", code), ("Checks", test)].iter().filter(|(_, tag)| tag.is_none()) {
                    problems.push(format!(
                        "{LIST} lists {name} as implemented, but no doc comment contains \"{word} {name}\": tag the \
                         item, or change the status"
                    ));
                }
            }
            (Status::Planned | Status::OutOfScope, Some(Tag { path, line, item, .. }), _) => problems.push(format!(
                "{path}:{line}: `{item}` implements {name}, which {LIST} lists as not implemented: change the status"
            )),
            _ => {}
        }
    }
    problems
}

/// Returns a message with the first line where the ledger differs from the expected text.
fn out_of_date(found: &str, expected: &str) -> Option<String> {
    if found == expected {
        return None;
    }
    let (mut found, mut expected) = (found.lines(), expected.lines());
    for number in 1.. {
        let (found_line, expected_line) = (found.next(), expected.next());
        if found_line != expected_line || found_line.is_none() {
            let show = |line: Option<&str>| line.map_or("missing".to_string(), |line| format!("\"{line}\""));
            let (found_line, expected_line) = (show(found_line), show(expected_line));
            return Some(format!(
                "{LEDGER} is out of date: run `cargo xtask ledger`\n  line {number} is {found_line}\n  and should be \
                 {expected_line}"
            ));
        }
    }
    None
}

fn render(equations: &[Equation], tags: &[Tag]) -> String {
    let mut text = format!(
        "# Equation ledger\n\n\
         <!-- Written by `cargo xtask ledger` from equations.toml and the doc comments: do not edit. -->\n\n\
         The equations of the paper that the project covers, the code that implements them and the tests that check \
         them.\nA number in parentheses is an equation of the paper.\n\
         Implemented: {}; planned for a later release: {}; out of scope: {}.\n\n\
         | equation | what | status | code | tests |\n|---|---|---|---|---|\n",
        count(equations, Status::Implemented),
        count(equations, Status::Planned),
        count(equations, Status::OutOfScope),
    );
    for equation in equations {
        let (name, title, status) = (heading(&equation.id), &equation.title, equation.status.words());
        let (code, tests) = (links(tags, equation, Claim::Implements), links(tags, equation, Claim::Checks));
        // Writing to a string does not fail.
        let _ = writeln!(text, "| {name} | {title} | {status} | {code} | {tests} |");
    }
    text.push_str(
        "\n## Deviations\n\nDifferences between the default behaviour and the paper as published, with reasons.\n",
    );
    for equation in equations {
        if let Some(deviation) = &equation.deviation {
            let (name, title) = (heading(&equation.id), &equation.title);
            let planned = if equation.status == Status::Planned { " (planned)" } else { "" };
            let _ = write!(text, "\n### {name}: {title}{planned}\n\n{}\n", deviation.trim());
        }
    }
    text
}

fn count(equations: &[Equation], status: Status) -> usize {
    equations.iter().filter(|equation| equation.status == status).count()
}

/// Returns one link per item, in order of path and line. Links have no line numbers, so that overrides elsewhere in a
/// file do not change the ledger.
fn links(tags: &[Tag], equation: &Equation, claim: Claim) -> String {
    let mut links: Vec<String> = Vec::new();
    for tag in tags.iter().filter(|tag| tag.claim == claim && tag.equation == equation.id) {
        let link = format!("[`{}`](../../{})", tag.item, tag.path);
        if !links.contains(&link) {
            links.push(link);
        }
    }
    match (links.is_empty(), equation.status) {
        (false, _) => links.join("<br>"),
        (true, Status::Implemented) => "**missing**".to_string(),
        (true, _) => "-".to_string(),
    }
}

impl Status {
    fn words(self) -> &'static str {
        match self {
            Self::Implemented => "implemented",
            Self::Planned => "planned",
            Self::OutOfScope => "out of scope",
        }
    }
}

/// Formats the name of an equation for a table: (5), Lemma 3.1.
fn heading(id: &str) -> String {
    if id.bytes().all(|byte| byte.is_ascii_digit()) { format!("({id})") } else { id.to_string() }
}

/// Formats the name of an equation as in a tag: Eq. (5), Lemma 3.1.
fn label(id: &str) -> String {
    let heading = heading(id);
    if heading.starts_with('(') { format!("Eq. {heading}") } else { heading }
}

#[cfg(test)]
mod tests;
