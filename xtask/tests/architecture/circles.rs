//! No circle of imports: of two modules at most one names what the other defines, also by way of third ones. A name that
//! is passed on (`pub use`) is of the module that defines it.
//!
//! `cargo test -p xtask import` tells the circles there are.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use crate::code::{Code, Imports};
use crate::source;

/// Everything that `file` depends on, also by way of others.
fn reach<'a>(imports: &Imports<'a>, file: &'a Path) -> BTreeSet<&'a Path> {
    let mut reached = BTreeSet::new();
    let mut next = vec![file];
    while let Some(file) = next.pop() {
        next.extend(imports[file].keys().filter(|file| reached.insert(**file)));
    }
    reached
}

/// The sets of files each of which depends on all others of its set.
fn circles<'a>(imports: &Imports<'a>) -> BTreeSet<BTreeSet<&'a Path>> {
    let reached: BTreeMap<_, _> = imports.keys().map(|file| (*file, reach(imports, file))).collect();
    let around = |file| reached[file].iter().copied().filter(|other| reached[other].contains(file)).collect();
    imports.keys().map(around).filter(|circle: &BTreeSet<_>| !circle.is_empty()).collect()
}

/// One line for each step around each circle.
fn tell(circles: &BTreeSet<BTreeSet<&Path>>, imports: &Imports<'_>) -> String {
    let mut text = String::new();
    for (number, circle) in circles.iter().enumerate() {
        text.push_str(&format!("circle {}\n", number + 1));
        for (file, other) in circle.iter().flat_map(|file| imports[file].keys().map(move |other| (*file, *other))) {
            if circle.contains(other) {
                let names: Vec<_> = imports[file][other].iter().copied().collect();
                text.push_str(&format!("    {} <- {}: {}\n", other.display(), file.display(), names.join(", ")));
            }
        }
    }
    text
}

/// `record.rs` is the parent of `record/rows.rs`.
fn is_parent(parent: &Path, child: &Path) -> bool {
    child.parent() == Some(&parent.with_extension(""))
}

/// Apart from a module and its own children, which the next test looks at.
#[test]
fn no_module_imports_what_imports_it() {
    let code = source();
    let mut imports = code.imports();
    for (file, named) in &mut imports {
        named.retain(|other, _| !is_parent(other, file));
    }
    let found = circles(&imports);
    assert!(found.is_empty(), "circles of imports:\n{}", tell(&found, &imports));
}

#[test]
fn no_module_imports_the_parent_that_imports_it() {
    let code = source();
    let imports = code.imports();
    let mut told = String::new();
    for (file, named) in &imports {
        for (parent, names) in named.iter().filter(|(parent, _)| is_parent(parent, file)) {
            if let Some(back) = imports[*parent].get(file) {
                told.push_str(&format!("{}: {names:?}, which names {back:?} of it\n", file.display()));
            }
        }
    }
    assert!(told.is_empty(), "modules that import from the parent that imports from them:\n{told}");
    let found = circles(&imports);
    assert!(found.is_empty(), "circles of imports by way of a parent:\n{}", tell(&found, &imports));
}

#[test]
fn circles_are_found_through_names_that_are_passed_on_in_macros_and_bodies_and_not_in_tests() {
    let folder = tempfile::tempdir().expect("there is room for a few files");
    let crate_with = |files: &[(&str, &str)]| {
        for (file, text) in files {
            let path = folder.path().join("mine/src").join(file);
            fs::create_dir_all(path.parent().expect("it is in a folder")).expect("it can be made");
            fs::write(path, text).expect("it can be written");
        }
        let code = Code::read(folder.path(), &[PathBuf::from("mine")]);
        let imports = code.imports();
        tell(&circles(&imports), &imports).replace("mine/src/", "")
    };
    let root = ("lib.rs", "mod one; mod two; mod three; pub use three::Three;");
    let three = ("three.rs", "pub struct Three;");
    let one = ("one.rs", "use crate::two::{self, Two as Other}; pub struct One;");
    let straight = ("two.rs", "pub struct Two; #[cfg(test)] use crate::one::One; fn f(one: u8) -> crate::Three {}");
    assert_eq!(crate_with(&[root, three, one, straight]), "");
    let expected = "circle 1\n    two.rs <- one.rs: Two\n    one.rs <- two.rs: One\n";
    for back in ["fn f() { super::one::One; }", "fn f() { vec![(1, crate::one::One)]; }", "use super::one::*;"] {
        let two = format!("pub struct Two; {back}");
        let told = crate_with(&[root, three, one, ("two.rs", &two)]);
        assert_eq!(told.replace(": \n", ": One\n"), expected, "{back}");
    }
    let three = ("three.rs", "pub struct Three { one: crate::one::One }");
    let told = crate_with(&[root, three, one, straight]);
    assert!(["one.rs <- three.rs: One", "three.rs <- two.rs: Three"].iter().all(|step| told.contains(step)), "{told}");
}
