//! Parser for Markdown pages: blocks of code with their `<!-- book: ... -->` marks, links and headings.

use std::path::{Path, PathBuf};

/// A page and its path.
pub(crate) struct Page {
    /// Path relative to the root of the repository.
    pub(crate) path: PathBuf,
    pub(crate) text: String,
}

/// A block of code.
pub(crate) struct Block {
    /// `console`, `sh`, `toml`, ...; empty if not given.
    pub(crate) language: String,
    /// Contents of the lines `<!-- book: ... -->` before the block.
    pub(crate) marks: Vec<String>,
    pub(crate) text: String,
    /// Line number of its beginning in the page, from 1.
    pub(crate) line: usize,
}

impl Block {
    /// Returns the rest of the mark that starts with `beginning`.
    pub(crate) fn mark(&self, beginning: &str) -> Option<&str> {
        self.marks.iter().find_map(|mark| mark.strip_prefix(beginning)).map(str::trim)
    }
}

impl Page {
    pub(crate) fn name(&self) -> String {
        self.path.display().to_string()
    }

    pub(crate) fn folder(&self) -> &Path {
        self.path.parent().unwrap_or(Path::new(""))
    }

    pub(crate) fn blocks(&self) -> Vec<Block> {
        let mut blocks: Vec<Block> = Vec::new();
        let (mut marks, mut is_open) = (Vec::new(), false);
        for (line, text) in (1..).zip(self.text.lines()) {
            match (text.strip_prefix("```"), blocks.last_mut().filter(|_| is_open)) {
                (Some(_), Some(_)) => is_open = false,
                (Some(language), None) => {
                    let (language, marks) = (language.trim().to_owned(), std::mem::take(&mut marks));
                    blocks.push(Block { language, marks, text: String::new(), line });
                    is_open = true;
                }
                (None, Some(block)) => block.text += &format!("{text}\n"),
                (None, None) => {
                    let mark = text.strip_prefix("<!-- book: ").and_then(|rest| rest.strip_suffix(" -->"));
                    marks.extend(mark.map(str::to_owned));
                    assert!(
                        mark.is_some() || text.is_empty() || marks.is_empty(),
                        "{}:{line}: no block after a mark",
                        self.name()
                    );
                }
            }
        }
        assert!(!is_open, "{}: the last block is not closed", self.name());
        blocks
    }

    /// Returns the lines outside blocks.
    fn prose(&self) -> impl Iterator<Item = &str> {
        let mut is_open = false;
        self.text.lines().filter(move |line| {
            let is_fence = line.starts_with("```");
            is_open ^= is_fence;
            !is_open && !is_fence
        })
    }

    /// Returns the text between backticks.
    pub(crate) fn quoted(&self) -> impl Iterator<Item = &str> {
        self.prose().flat_map(|line| line.split('`').skip(1).step_by(2))
    }

    /// Returns the targets of links and pictures, except those on other sites.
    pub(crate) fn links(&self) -> Vec<String> {
        let unquoted = self.prose().map(|line| line.split('`').step_by(2).collect::<String>());
        let links = unquoted.flat_map(|line| {
            let targets = line.split("](").skip(1).filter_map(|rest| rest.split(')').next());
            targets.map(str::to_owned).collect::<Vec<_>>()
        });
        links.filter(|link| !link.contains("://")).collect()
    }

    /// Returns the anchor of each heading: lower-case letters, digits, hyphens and underscores; a repeated anchor gets
    /// a number.
    pub(crate) fn anchors(&self) -> Vec<String> {
        let mut anchors: Vec<String> = Vec::new();
        for line in self.prose().filter(|line| line.starts_with('#')) {
            let title = line.trim_start_matches('#').trim().to_lowercase().replace(' ', "-");
            let slug: String = title.chars().filter(|c| c.is_alphanumeric() || "-_".contains(*c)).collect();
            let again = anchors.iter().filter(|anchor| **anchor == slug).count();
            anchors.push(if again == 0 { slug } else { format!("{slug}-{again}") });
        }
        anchors
    }
}
