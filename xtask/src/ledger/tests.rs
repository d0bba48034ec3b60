//! Tests of every problem that the ledger check can report, and of its messages.

use super::*;

fn equation(id: &str, status: Status) -> Equation {
    Equation { id: id.to_string(), title: "a title".to_string(), status, deviation: None }
}

fn tags(source: &str) -> Vec<Tag> {
    tags::find("crates/a/src/b.rs", source, &[])
}

#[track_caller]
fn check(status: Status, source: &str, expected: &[&str]) {
    let problems = problems(&[equation("5", status)], &tags(source));
    assert_eq!(problems.len(), expected.len(), "{problems:?}");
    for (problem, part) in problems.iter().zip(expected) {
        assert!(problem.contains(part), "{problem}");
    }
}

const BOTH: &str = "/// Implements Eq. (5).\nfn f() {}\n/// Checks Eq. (5).\nfn g() {}";

#[test]
fn an_implemented_and_checked_equation_has_no_problems() {
    check(Status::Implemented, BOTH, &[]);
    check(Status::Planned, "", &[]);
    check(Status::OutOfScope, "/// Checks Eq. (5).\nfn g() {}", &[]);
}

#[test]
fn an_implemented_equation_needs_a_code_tag_and_a_test_tag() {
    check(Status::Implemented, "/// Checks Eq. (5).\nfn g() {}", &["\"Implements Eq. (5)\""]);
    check(Status::Implemented, "/// Implements Eq. (5).\nfn f() {}", &["\"Checks Eq. (5)\""]);
    check(Status::Implemented, "", &["\"Implements Eq. (5)\"", "\"Checks Eq. (5)\""]);
}

#[test]
fn code_of_an_equation_that_is_not_implemented_is_reported() {
    check(
        Status::Planned,
        BOTH,
        &["crates/a/src/b.rs:1: `f` implements Eq. (5), which docs/developer/equations.toml lists as not implemented"],
    );
    check(Status::OutOfScope, BOTH, &["`f` implements Eq. (5)"]);
}

#[test]
fn an_unknown_equation_is_reported_with_its_place() {
    check(Status::Planned, "//! x\n\n/// Checks Lemma 9.9.\nfn g() {}", &["crates/a/src/b.rs:3: `g` names Lemma 9.9"]);
}

#[test]
fn an_equation_that_is_listed_twice_is_reported() {
    let problems = problems(&[equation("5", Status::Planned), equation("5", Status::Planned)], &[]);
    assert_eq!(problems, ["docs/developer/equations.toml: Eq. (5) is listed twice: remove one"]);
}

#[test]
fn a_stale_ledger_names_the_first_difference_and_the_remedy() {
    assert_eq!(out_of_date("a\nb\n", "a\nb\n"), None);
    let message = out_of_date("a\nb\n", "a\nc\n").unwrap();
    assert!(message.contains("run `cargo xtask ledger`") && message.contains("line 2 is \"b\""), "{message}");
    assert!(out_of_date("", "a\n").unwrap().contains("line 1 is missing"));
    assert!(out_of_date("a\nb\n", "a\n").unwrap().contains("should be missing"));
    // Only the final newline is missing: the lines are equal, but the files differ.
    assert!(out_of_date("a", "a\n").is_some());
}

#[test]
fn a_row_links_code_and_tests_and_deviations_follow_the_table() {
    let mut with = equation("5", Status::Implemented);
    with.deviation = Some("Because.".to_string());
    let text = render(&[with, equation("Lemma 3.1", Status::Planned), equation("6", Status::Implemented)], &tags(BOTH));
    let row = "| (5) | a title | implemented | [`f`](../../crates/a/src/b.rs) | [`g`](../../crates/a/src/b.rs) |\n";
    assert!(text.contains(row), "{text}");
    assert!(text.contains("| Lemma 3.1 | a title | planned | - | - |\n"), "{text}");
    assert!(text.contains("| (6) | a title | implemented | **missing** | **missing** |\n"), "{text}");
    assert!(text.ends_with("\n### (5): a title\n\nBecause.\n"), "{text}");
}

#[test]
fn unknown_keys_and_values_in_the_list_are_refused() {
    let list = |line: &str| toml::from_str::<List>(&format!("[[equation]]\nid = \"5\"\ntitle = \"t\"\n{line}"));
    assert!(list("status = \"out-of-scope\"").is_ok());
    assert!(list("status = \"done\"").is_err());
    assert!(list("status = \"planned\"\ndeviaton = \"x\"").is_err());
}
