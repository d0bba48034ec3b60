//! What the documents name in back quotes is in the source: files and folders, crates, modules, items, their members.

use std::fs;
use std::path::{Path, PathBuf};

use crate::code::Code;
use crate::{root, source};

/// Words that are not ours.
const OTHERS: [&str; 6] = ["Result", "None", "Send", "false", "std", "no_std"];

/// Text that the documents quote and that names nothing.
const QUOTED: [&str; 4] = ["cargo ", "standoff ", "Implements ", "Checks "];

/// What is in back quotes, outside of blocks of code, with its line.
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

/// Every file of the project, under the repository.
fn files(root: &Path, folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(root.join(folder)).expect("a folder can be read") {
        let entry = entry.expect("a folder can be read");
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
    /// Every Cargo.toml, and every source text: for names of dependencies, and of files that the program writes.
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
        // `agent.picture()`: the variable may have any name, what is asked of it has not.
        if let Some((_, members)) = name.split_once('.') {
            return members.split('.').all(|member| self.has_member(member.split('(').next().unwrap_or_default()));
        }
        match name.rsplit_once("::") {
            Some((owner, last)) => self.has_in(owner, last),
            None => self.has_word(name),
        }
    }

    /// A crate, a module, an item, a member, a dependency.
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

    /// `owner` is a type, wherever its methods are, or a module.
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
    for document in ["ARCHITECTURE.md", "docs/embedding.md"] {
        let text = fs::read_to_string(root().join(document)).expect("the document is there");
        for (line, name) in quoted(&text).into_iter().filter(|(_, name)| !known.has(name)) {
            missing.push_str(&format!("{document}:{line}: `{name}` is nowhere in the source\n"));
        }
    }
    assert!(missing.is_empty(), "{missing}");
}

#[test]
fn what_does_not_exist_is_told() {
    let known = Known::new();
    for name in
        ["Agent", "Agent::decide", "heading::steer", "scenario/file.rs", "crates/standoff", "libm", "agent.picture()"]
    {
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
