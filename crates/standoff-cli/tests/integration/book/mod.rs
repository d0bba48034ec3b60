//! Tests of the book: every command runs and prints the quoted output, every scenario loads, and every link is valid.
//!
//! The pages are plain Markdown; lines `<!-- book: ... -->` before a block of code control this test:
//!
//! | mark | means |
//! |---|---|
//! | `not run: WHY` | the block's commands cannot be run here |
//! | `shorter: COMMAND` | this command replaces the one with the same beginning, up to `--runs` or `--points` |
//! | `exit N` | the commands end with this status, not 0 |
//! | `save as NAME` | the block is a file that the reader creates |
//! | `not a scenario` | the TOML is wrong on purpose |
//! | `copy FILE` | this file of the repository is copied to the working folder |

mod page;
mod shell;

use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::{fs, iter, thread};

use page::{Block, Page};
use shell::{check_quoted, copy, left_out, run, typed};

/// Number of pages tested in parallel.
const READERS: usize = 2;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Returns the pages in a folder of the repository and its subfolders, sorted by name.
fn pages(folder: &str) -> Vec<Page> {
    let entries = fs::read_dir(root().join(folder)).unwrap().map(|entry| entry.unwrap().path());
    let mut entries: Vec<_> = entries.collect();
    entries.sort();
    let mut found = Vec::new();
    for entry in entries {
        let path = Path::new(folder).join(entry.file_name().unwrap());
        if entry.is_dir() && !folder.is_empty() {
            found.extend(pages(path.to_str().unwrap()));
        } else if path.extension().is_some_and(|ending| ending == "md") {
            found.push(Page { path, text: fs::read_to_string(entry).unwrap() });
        }
    }
    found
}

/// Returns the pages for users: the front page, the book and the examples.
fn for_users() -> impl Iterator<Item = Page> {
    let front = pages("").into_iter().filter(|page| page.path == Path::new("README.md"));
    front.chain(pages("docs")).chain(pages("examples"))
}

/// Results of a page's commands.
#[derive(Default)]
struct Tally {
    run: usize,
    left_out: Vec<String>,
    wrong: Vec<String>,
}

#[test]
fn every_command_runs_and_prints_the_quoted_output() {
    let pages: Vec<_> = for_users().collect();
    // Pages are tested in parallel because most commands use one core. Each free thread takes the next page.
    let next = AtomicUsize::new(0);
    let follow_some = || iter::from_fn(|| pages.get(next.fetch_add(1, Ordering::Relaxed))).map(follow_page).collect();
    let tallies: Vec<Vec<Tally>> = thread::scope(|scope| {
        let readers: Vec<_> = (0..READERS).map(|_| scope.spawn(follow_some)).collect();
        readers.into_iter().map(|reader| reader.join().unwrap()).collect()
    });
    let tallies: Vec<_> = tallies.into_iter().flatten().collect();
    let run: usize = tallies.iter().map(|tally| tally.run).sum();
    let left_out: Vec<_> = tallies.iter().flat_map(|tally| tally.left_out.clone()).collect();
    let wrong: Vec<_> = tallies.iter().flat_map(|tally| tally.wrong.clone()).collect();
    println!("{run} commands run; not run:\n{}", left_out.join("\n"));
    assert!(wrong.is_empty(), "{}", wrong.join("\n\n"));
    assert!(run > 50, "only {run} commands were found");
}

/// Runs the commands of a page in a temporary folder.
fn follow_page(page: &Page) -> Tally {
    let mut tally = Tally::default();
    let folder = tempfile::tempdir().unwrap();
    for block in page.blocks() {
        let place = format!("{}:{}", page.name(), block.line);
        for file in block.marks.iter().filter_map(|mark| mark.strip_prefix("copy ")) {
            copy(&root().join(file), folder.path());
        }
        if let Some(name) = block.mark("save as") {
            fs::write(folder.path().join(name), &block.text).unwrap();
        }
        match block.language.as_str() {
            "" | "console" | "sh" => follow(&place, &block, folder.path(), &mut tally),
            "toml" if block.mark("not a scenario").is_some() => {}
            "toml" => tally.wrong.extend(refused(&block, folder.path()).map(|why| format!("{place}: {why}"))),
            "rust" | "text" | "csv" => {}
            other => match block.mark("not run:") {
                Some(why) => tally.left_out.push(format!("{place}: {other}: {why}")),
                None => tally.wrong.push(format!("{place}: this test cannot check {other}")),
            },
        }
    }
    tally
}

/// Runs the commands of a block.
fn follow(place: &str, block: &Block, folder: &Path, tally: &mut Tally) {
    let expected = block.mark("exit").map_or(0, |status| status.parse().unwrap());
    for typed in typed(&block.language, &block.text) {
        let command = &typed.command;
        if let Some(why) = block.mark("not run:").or(left_out(command)) {
            tally.left_out.push(format!("{place}: {command}: {why}"));
            continue;
        }
        let bare = command.split(" #").next().unwrap_or_default();
        let ends = [" --runs ", " --points "].iter().filter_map(|option| bare.find(option));
        let beginning = bare[..ends.min().unwrap_or(bare.len())].trim_end();
        let mut shorter = block.marks.iter().filter_map(|mark| mark.strip_prefix("shorter: "));
        let shorter = shorter.find(|shorter| shorter.starts_with(beginning));
        let (status, printed) = run(folder, shorter.unwrap_or(command));
        tally.run += 1;
        let quoted = check_quoted(&typed.output, &printed);
        if status != Some(expected) || quoted.is_err() {
            let why = quoted.err().unwrap_or(printed);
            tally.wrong.push(format!("{place}: {command}: exit status {status:?}: {why}"));
        }
    }
}

/// Returns the error if a scenario does not load; a part of a scenario without targets gets one added.
fn refused(block: &Block, folder: &Path) -> Option<String> {
    let has_targets = ["[targets.random]", "[[targets.start]]", "[traffic]"].iter().any(|key| block.text.contains(key));
    let target = if has_targets { "" } else { "\n[[targets.start]]\n" };
    fs::write(folder.join("snippet.toml"), format!("{}{target}", block.text)).unwrap();
    let (status, printed) = run(folder, "standoff check snippet.toml");
    fs::remove_file(folder.join("snippet.toml")).unwrap();
    (status != Some(0)).then_some(printed)
}

/// Commands and options that the text mentions exist.
#[test]
fn every_command_and_option_that_is_mentioned_exists() {
    let folder = tempfile::tempdir().unwrap();
    let mut known: Vec<(String, String)> = Vec::new();
    let mut wrong = Vec::new();
    for page in for_users() {
        for command in page.quoted().filter(|quoted| quoted.starts_with("standoff ")) {
            let mut words = command.split_whitespace().skip(1);
            let name = words.next().unwrap_or_default();
            if !known.iter().any(|(known, _)| known == name) {
                let help = run(folder.path(), &format!("standoff {} --help", name.trim_start_matches("--help")));
                known.push((name.to_owned(), if help.0 == Some(0) { help.1 } else { String::new() }));
            }
            let help = &known.iter().find(|(known, _)| known == name).unwrap().1;
            let options = words.filter(|word| word.starts_with("--"));
            let missing: Vec<_> = options.filter(|option| !help.contains(*option)).collect();
            if help.is_empty() || !missing.is_empty() {
                wrong.push(format!("{}: {command} {missing:?}", page.name()));
            }
        }
    }
    assert!(known.len() > 5 && wrong.is_empty(), "{wrong:#?}");
}

/// Code on a page consists of consecutive lines of an example, so that it is compiled and tested.
#[test]
fn quoted_code_is_part_of_an_example() {
    let trimmed = |text: &str| text.lines().map(str::trim).collect::<Vec<_>>().join("\n");
    let examples = [
        "standoff/examples/companion/main.rs",
        "standoff/examples/companion/udp.rs",
        "standoff-sim/examples/follower.rs",
    ];
    let sources = examples.map(|file| trimmed(&fs::read_to_string(root().join("crates").join(file)).unwrap()));
    let mut found = 0;
    for page in for_users() {
        for block in page.blocks().iter().filter(|block| block.language == "rust") {
            let quoted = trimmed(&block.text);
            let is_found = sources.iter().any(|source| source.contains(&quoted));
            assert!(is_found, "{}:{}: in none of the examples", page.name(), block.line);
            found += 1;
        }
    }
    assert!(found > 3, "only {found} quotations were found");
}

#[test]
fn every_link_has_a_target() {
    let mut wrong = Vec::new();
    let all = ["", "docs", "examples", "scenarios"].map(pages);
    for page in all.iter().flatten() {
        for link in page.links() {
            let (file, anchor) = link.split_once('#').unwrap_or((&link, ""));
            let target = if file.is_empty() { page.path.clone() } else { page.folder().join(file) };
            let text = fs::read_to_string(root().join(&target)).unwrap_or_default();
            let exists = root().join(&target).exists();
            let target = Page { path: target, text };
            if !exists || !anchor.is_empty() && !target.anchors().contains(&anchor.to_owned()) {
                wrong.push(format!("{}: {link}", page.name()));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn every_page_is_listed_once_in_the_summary() {
    let pages = pages("docs");
    let summary = pages.iter().find(|page| page.path.ends_with("SUMMARY.md")).unwrap();
    let mut chapters = summary.links();
    chapters.sort();
    let names =
        pages.iter().filter_map(|page| page.path.strip_prefix("docs").ok()).map(|path| path.display().to_string());
    assert_eq!(chapters, names.filter(|name| name != "SUMMARY.md").collect::<Vec<_>>());
}

/// The gallery shows every built-in scenario: its map, description and command, and the button that flies it.
#[test]
fn the_gallery_shows_every_scenario() {
    let gallery = fs::read_to_string(root().join("docs/user/gallery.md")).unwrap();
    let (_, listed) = run(&root(), "standoff scenarios");
    let mut missing = Vec::new();
    for (name, about) in listed.lines().filter_map(|line| line.split_once(' ')) {
        let picture = format!("../pictures/gallery/{}.svg", name.replace('/', "-"));
        let entry = format!(
            "### {name}\n\n![Map of {name}]({picture})\n\n{}.\n\n```sh\nstandoff run {name}\n```\n\n\
             <p data-mission=\"scenario={name}\"></p>\n",
            about.trim().trim_end_matches('.')
        );
        missing.extend((!gallery.contains(&entry)).then_some(name));
    }
    assert!(listed.lines().count() > 20, "{listed}");
    assert!(missing.is_empty(), "run scripts/draw_gallery: docs/user/gallery.md lacks {missing:?}");
}
