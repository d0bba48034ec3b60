//! The equation ledger: which item implements each equation of the paper, and which test checks it.
//!
//! docs/equations.toml says what should be, the tags in the code what is, docs/ledger.md shows both.

mod tags;

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use serde::Deserialize;
use tags::{Claim, Tag};

const LIST: &str = "docs/equations.toml";
const LEDGER: &str = "docs/ledger.md";

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct List {
    equation: Vec<Equation>,
}

/// A piece of the paper that the project takes a stand on.
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

/// Writes the ledger, whatever is wrong with it, and says what is.
pub(crate) fn write(root: &Path) -> Result<String, String> {
    let (equations, tags) = load(root)?;
    let path = root.join(LEDGER);
    fs::write(&path, render(&equations, &tags)).map_err(|error| format!("{LEDGER}: {error}"))?;
    let problems: String = problems(&equations, &tags).iter().map(|problem| format!("\nwarning: {problem}")).collect();
    Ok(format!("{LEDGER}: written, {} entries{problems}", equations.len()))
}

/// Everything that is wrong, one line each.
pub(crate) fn check(root: &Path) -> Result<String, String> {
    let (equations, tags) = load(root)?;
    let mut problems = problems(&equations, &tags);
    // A ledger that is not there differs from its first line on.
    let found = fs::read_to_string(root.join(LEDGER)).unwrap_or_default();
    problems.extend(out_of_date(&found, &render(&equations, &tags)));
    if problems.is_empty() { Ok(format!("{LEDGER}: up to date")) } else { Err(problems.join("\n")) }
}

fn load(root: &Path) -> Result<(Vec<Equation>, Vec<Tag>), String> {
    let list = fs::read_to_string(root.join(LIST)).map_err(|error| format!("{LIST}: {error}"))?;
    let list: List = toml::from_str(&list).map_err(|error| format!("{LIST}: {error}"))?;
    let known: Vec<&str> = list.equation.iter().map(|equation| equation.id.as_str()).collect();
    let mut tags = Vec::new();
    for package in entries(&root.join("crates"))? {
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

/// What list and tags say against each other.
fn problems(equations: &[Equation], tags: &[Tag]) -> Vec<String> {
    let mut problems = Vec::new();
    for tag in tags.iter().filter(|tag| !equations.iter().any(|equation| equation.id == tag.equation)) {
        let (Tag { path, line, item, .. }, name) = (tag, label(&tag.equation));
        problems.push(format!("{path}:{line}: `{item}` names {name}, which {LIST} does not list: mend one of them"));
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
                        "{name} is implemented, says {LIST}, but no doc comment says \"{word} {name}\": tag the item, \
                         or change the status"
                    ));
                }
            }
            (Status::Planned | Status::OutOfScope, Some(Tag { path, line, item, .. }), _) => problems.push(format!(
                "{path}:{line}: `{item}` implements {name}, which is not implemented, says {LIST}: change the status"
            )),
            _ => {}
        }
    }
    problems
}

/// Where the ledger differs first from what it should be.
fn out_of_date(found: &str, expected: &str) -> Option<String> {
    if found == expected {
        return None;
    }
    let (mut found, mut expected) = (found.lines(), expected.lines());
    for number in 1.. {
        let (is, should_be) = (found.next(), expected.next());
        if is != should_be || is.is_none() {
            let show = |line: Option<&str>| line.map_or("nothing".to_string(), |line| format!("\"{line}\""));
            let (is, should_be) = (show(is), show(should_be));
            return Some(format!(
                "{LEDGER} is out of date: run `cargo xtask ledger`\n  line {number} is {is}\n  and should be {should_be}"
            ));
        }
    }
    None
}

fn render(equations: &[Equation], tags: &[Tag]) -> String {
    let mut text = format!(
        "# Equation ledger\n\n\
         <!-- Written by `cargo xtask ledger` from equations.toml and the doc comments: do not edit. -->\n\n\
         Every equation of the paper that the project takes a stand on, the code that implements it and the tests that \
         check it.\nA number in parentheses is an equation of the paper.\n\
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
    text.push_str("\n## Deviations\n\nWhere what is done by default differs from what the paper prints, and why.\n");
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

/// One link per item, in order of path and line. No line numbers, lest every edit changes the ledger.
fn links(tags: &[Tag], equation: &Equation, claim: Claim) -> String {
    let mut links: Vec<String> = Vec::new();
    for tag in tags.iter().filter(|tag| tag.claim == claim && tag.equation == equation.id) {
        let link = format!("[`{}`](../{})", tag.item, tag.path);
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

/// The way a table names an equation: (5), Lemma 3.1.
fn heading(id: &str) -> String {
    if id.bytes().all(|byte| byte.is_ascii_digit()) { format!("({id})") } else { id.to_string() }
}

/// The way a tag names an equation: Eq. (5), Lemma 3.1.
fn label(id: &str) -> String {
    let heading = heading(id);
    if heading.starts_with('(') { format!("Eq. {heading}") } else { heading }
}

#[cfg(test)]
mod tests;
