//! Checks that modules do not import each other in a circle, directly or through other modules. A re-exported name
//! (`pub use`) belongs to the module that defines it.
//!
//! `cargo test -p xtask import` prints all circles.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use crate::code::{Code, Imports};
use crate::source;

/// Returns all files that `file` depends on, directly or indirectly.
fn reach<'a>(imports: &Imports<'a>, file: &'a Path) -> BTreeSet<&'a Path> {
    let mut reached = BTreeSet::new();
    let mut next = vec![file];
    while let Some(file) = next.pop() {
        next.extend(imports[file].keys().filter(|file| reached.insert(**file)));
    }
    reached
}

/// Returns the sets of files that all depend on each other.
fn circles<'a>(imports: &Imports<'a>) -> BTreeSet<BTreeSet<&'a Path>> {
    let reached: BTreeMap<_, _> = imports.keys().map(|file| (*file, reach(imports, file))).collect();
    let around = |file| reached[file].iter().copied().filter(|other| reached[other].contains(file)).collect();
    imports.keys().map(around).filter(|circle: &BTreeSet<_>| !circle.is_empty()).collect()
}

/// Formats one line for each import in each circle.
fn describe(circles: &BTreeSet<BTreeSet<&Path>>, imports: &Imports<'_>) -> String {
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

/// True if `parent` is the parent module of `child`, as `record.rs` is of `record/rows.rs`.
fn is_parent(parent: &Path, child: &Path) -> bool {
    child.parent() == Some(&parent.with_extension(""))
}

/// Imports of parent modules are left to the next test.
#[test]
fn modules_do_not_import_each_other_in_circles() {
    let code = source();
    let mut imports = code.imports();
    for (file, named) in &mut imports {
        named.retain(|other, _| !is_parent(other, file));
    }
    let found = circles(&imports);
    assert!(found.is_empty(), "circles of imports:\n{}", describe(&found, &imports));
}

#[test]
fn modules_do_not_import_parents_that_import_them() {
    let code = source();
    let imports = code.imports();
    let mut text = String::new();
    for (file, named) in &imports {
        for (parent, names) in named.iter().filter(|(parent, _)| is_parent(parent, file)) {
            if let Some(back) = imports[*parent].get(file) {
                text.push_str(&format!(
                    "{} imports {names:?} from its parent, which imports {back:?} from it\n",
                    file.display()
                ));
            }
        }
    }
    assert!(text.is_empty(), "modules that import from a parent that imports from them:\n{text}");
    let found = circles(&imports);
    assert!(found.is_empty(), "circles of imports through a parent:\n{}", describe(&found, &imports));
}

#[test]
fn circles_through_re_exports_macros_and_bodies_are_found_and_test_code_is_ignored() {
    let folder = tempfile::tempdir().expect("a temporary folder can be created");
    let crate_with = |files: &[(&str, &str)]| {
        for (file, text) in files {
            let path = folder.path().join("mine/src").join(file);
            fs::create_dir_all(path.parent().expect("the file is in a folder")).expect("the folder can be created");
            fs::write(path, text).expect("the file can be written");
        }
        let code = Code::read(folder.path(), &[PathBuf::from("mine")]);
        let imports = code.imports();
        describe(&circles(&imports), &imports).replace("mine/src/", "")
    };
    let root = ("lib.rs", "mod one; mod two; mod three; pub use three::Three;");
    let three = ("three.rs", "pub struct Three;");
    let one = ("one.rs", "use crate::two::{self, Two as Other}; pub struct One;");
    let straight = ("two.rs", "pub struct Two; #[cfg(test)] use crate::one::One; fn f(one: u8) -> crate::Three {}");
    assert_eq!(crate_with(&[root, three, one, straight]), "");
    let expected = "circle 1\n    two.rs <- one.rs: Two\n    one.rs <- two.rs: One\n";
    for back in ["fn f() { super::one::One; }", "fn f() { vec![(1, crate::one::One)]; }", "use super::one::*;"] {
        let two = format!("pub struct Two; {back}");
        let found = crate_with(&[root, three, one, ("two.rs", &two)]);
        assert_eq!(found.replace(": \n", ": One\n"), expected, "{back}");
    }
    let three = ("three.rs", "pub struct Three { one: crate::one::One }");
    let found = crate_with(&[root, three, one, straight]);
    let imports = ["one.rs <- three.rs: One", "three.rs <- two.rs: Three"];
    assert!(imports.iter().all(|import| found.contains(import)), "{found}");
}
