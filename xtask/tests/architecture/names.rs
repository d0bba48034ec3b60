//! Checks that names in backticks in the documents exist in the source: files, folders, crates, modules, items and
//! their members.

use std::fs;
use std::path::{Path, PathBuf};

use crate::code::Code;
use crate::{root, source};

/// Names that are not defined by this project.
const OTHERS: [&str; 6] = ["Result", "None", "Send", "false", "std", "no_std"];

/// Beginnings of quoted texts that are not names.
const QUOTED: [&str; 4] = ["cargo ", "standoff ", "Implements ", "Checks "];

/// Returns the texts in backticks outside blocks of code, with their line numbers.
fn quoted(text: &str) -> Vec<(usize, &str)> {
    let (mut found, mut is_code) = (Vec::new(), false);
    for (index, line) in text.lines().enumerate() {
        if line.trim_start().starts_with("```") {
            is_code = !is_code;
        } else if !is_code {
            found.extend(line.split('`').skip(1).step_by(2).map(|name| (index + 1, name)));
        }
    }
    found
}

/// Collects all files and folders of the repository, as relative paths.
fn files(root: &Path, folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(root.join(folder)).expect("the folder can be read") {
        let entry = entry.expect("the folder entry can be read");
        let name = entry.file_name();
        if entry.path().is_dir() && !["target", ".git", "node_modules"].iter().any(|other| name == *other) {
            files(root, &folder.join(&name), found);
        }
        found.push(folder.join(name));
    }
}

struct Known {
    code: Code,
    files: Vec<PathBuf>,
    /// Texts of all TOML and source files: they contain the names of dependencies and of files that the program writes.
    texts: Vec<String>,
}

impl Known {
    fn new() -> Self {
        let mut all = Vec::new();
        files(&root(), Path::new(""), &mut all);
        let is_text = |file: &&PathBuf| file.extension().is_some_and(|kind| kind == "rs" || kind == "toml");
        let texts = all
            .iter()
            .filter(|file| !file.starts_with("xtask/tests"))
            .filter(is_text)
            .filter_map(|file| fs::read_to_string(root().join(file)).ok());
        Self { code: source(), texts: texts.collect(), files: all }
    }

    fn has(&self, name: &str) -> bool {
        if OTHERS.contains(&name) || QUOTED.iter().any(|start| name.starts_with(start)) {
            return true;
        }
        if name.contains('/')
            || name.rsplit_once('.').is_some_and(|(_, kind)| ["rs", "js", "html", "toml"].contains(&kind))
        {
            let path = name.trim_end_matches('/');
            return self.files.iter().any(|file| file.ends_with(path))
                || self.texts.iter().any(|text| text.contains(&format!("\"{name}\"")));
        }
        // In `agent.team_state()` the variable can have any name; the members must exist.
        if let Some((_, members)) = name.split_once('.') {
            return members.split('.').all(|member| self.has_member(member.split('(').next().unwrap_or_default()));
        }
        match name.rsplit_once("::") {
            Some((owner, last)) => self.has_in(owner, last),
            None => self.has_word(name),
        }
    }

    /// True if `name` is a crate, a module, an item, a member or a dependency.
    fn has_word(&self, name: &str) -> bool {
        let is_stem = |file: &PathBuf| file.file_stem().is_some_and(|stem| stem == name);
        let is_item = self.code.modules.iter().any(|module| module.items.contains_key(name));
        let depends = |text: &String| text.lines().any(|line| line.starts_with(&format!("{name} = ")));
        is_item
            || self.code.crates.contains_key(&name.replace('-', "_"))
            || self.code.modules.iter().any(|module| is_stem(&module.file))
            || self.has_member(name)
            || self.texts.iter().any(depends)
    }

    fn has_member(&self, name: &str) -> bool {
        self.code.modules.iter().any(|module| module.items.values().any(|members| members.contains(name)))
    }

    /// True if `owner` has an item or member `name`; `owner` is a type, a module or a crate.
    fn has_in(&self, owner: &str, name: &str) -> bool {
        let last = owner.rsplit("::").next().unwrap_or(owner);
        self.code.modules.iter().any(|module| {
            let of_type = [last.to_owned(), format!("impl {last}")];
            let is_module = module.file.file_stem().is_some_and(|stem| stem == last);
            of_type.iter().filter_map(|of| module.items.get(of)).any(|members| members.contains(name))
                || (is_module && module.items.contains_key(name))
                || (self.code.crates.contains_key(owner) && module.file.file_stem().is_some_and(|stem| stem == name))
        })
    }
}

#[test]
fn the_documents_name_only_what_exists() {
    let known = Known::new();
    let mut missing = String::new();
    for document in ["ARCHITECTURE.md", "docs/user/embedding.md"] {
        let text = fs::read_to_string(root().join(document)).expect("the document can be read");
        for (line, name) in quoted(&text).into_iter().filter(|(_, name)| !known.has(name)) {
            missing.push_str(&format!("{document}:{line}: `{name}` does not exist in the source\n"));
        }
    }
    assert!(missing.is_empty(), "{missing}");
}

#[test]
fn existing_names_are_recognised_and_misspelt_ones_are_not() {
    let known = Known::new();
    for name in [
        "Agent",
        "Agent::decide",
        "heading::steer",
        "scenario/resolved.rs",
        "crates/standoff",
        "libm",
        "agent.team_state()",
    ] {
        assert!(known.has(name), "{name}");
    }
    for name in [
        "Agnet",
        "Agent::stop",
        "Group::forme",
        "heading::stear",
        "scenario/flie.rs",
        "crates/standon",
        "agent.picturs()",
    ] {
        assert!(!known.has(name), "{name}");
    }
    assert_eq!(quoted("a `b` c\n```\n`d`\n```\n`e::f`"), [(1, "b"), (5, "e::f")]);
}
