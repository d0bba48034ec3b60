//! A Markdown page as the tests read it: its blocks of code with what the page's source says of them, links, headings.

use std::path::{Path, PathBuf};

/// A page, and where it is.
pub(crate) struct Page {
    /// From the root of the repository.
    pub(crate) path: PathBuf,
    pub(crate) text: String,
}

/// A block of code.
pub(crate) struct Block {
    /// `console`, `sh`, `toml`, ...; empty if the page does not say.
    pub(crate) language: String,
    /// What the lines `<!-- book: ... -->` before it say.
    pub(crate) marks: Vec<String>,
    pub(crate) text: String,
    /// Where it begins in the page, from 1.
    pub(crate) line: usize,
}

impl Block {
    /// The rest of the mark that begins so.
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
                    assert!(mark.is_some() || text.is_empty() || marks.is_empty(), "{}:{line}: no block", self.name());
                }
            }
        }
        assert!(!is_open, "{}: its last block has no end", self.name());
        blocks
    }

    /// The lines outside blocks.
    fn prose(&self) -> impl Iterator<Item = &str> {
        let mut is_open = false;
        self.text.lines().filter(move |line| {
            let is_fence = line.starts_with("```");
            is_open ^= is_fence;
            !is_open && !is_fence
        })
    }

    /// What stands between backticks.
    pub(crate) fn quoted(&self) -> impl Iterator<Item = &str> {
        self.prose().flat_map(|line| line.split('`').skip(1).step_by(2))
    }

    /// Where the links and pictures lead, but for other sites.
    pub(crate) fn links(&self) -> Vec<String> {
        let unquoted = self.prose().map(|line| line.split('`').step_by(2).collect::<String>());
        let links = unquoted.flat_map(|line| {
            let targets = line.split("](").skip(1).filter_map(|rest| rest.split(')').next());
            targets.map(str::to_owned).collect::<Vec<_>>()
        });
        links.filter(|link| !link.contains("://")).collect()
    }

    /// What a link names after `#`, for each heading: letters, digits and hyphens, small; a second of a kind counts.
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
