//! Compares the tables of columns in `docs/user/record.md` with the declarations of the columns, or writes them.

use std::path::Path;

use crate::column::{self, Field, Row};
use crate::frame::{
    AgentEventRow, AgentRow, DetectionRow, EventRow, GroupRow, IntruderRow, TeammateRow, TentativeRow, TrackRow,
    TruthRow, UavRow, ViewRow,
};
use crate::schema::{TargetRow, WithError};

/// One line per column, or per group of columns that one field declares.
fn lines<R: Field>() -> Vec<String> {
    let columns = column::columns::<R>();
    let declared: Vec<_> = columns.iter().map(|column| column.declaration()).collect();
    let line = |alike: &[&column::Declaration]| {
        let names: Vec<_> = alike.iter().map(|column| format!("`{}`", column.name)).collect();
        format!("| {} | {} |", names.join(", "), alike[0].doc)
    };
    declared.chunk_by(|one, next| one.doc == next.doc).map(line).collect()
}

fn table<R: Row>() -> (&'static str, Vec<String>) {
    (R::TABLE, lines::<R>())
}

/// Replaces the table of columns in the section of a table.
fn replace(page: &mut String, (table, lines): (&str, Vec<String>)) {
    const HEAD: &str = "| column | meaning |\n|---|---|\n";
    let section = page.find(&format!("\n## `{table}`\n")).unwrap_or_else(|| panic!("no section on {table}"));
    let start = section + page[section..].find(HEAD).unwrap_or_else(|| panic!("no columns of {table}")) + HEAD.len();
    let end = start + page[start..].find("\n\n").unwrap();
    page.replace_range(start..end, &lines.join("\n"));
}

/// With `WRITE_RECORD_PAGE=1`, it writes the page.
#[test]
fn the_page_lists_every_column_with_its_declared_meaning() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/user/record.md");
    let page = std::fs::read_to_string(&path).unwrap();
    let mut expected = page.clone();
    let mut of_agents = lines::<AgentEventRow>();
    of_agents.truncate(of_agents.len() - lines::<EventRow>().len());
    of_agents.push("| all of `events` | The same. |".to_owned());
    for table in [
        table::<WithError<UavRow>>(),
        table::<IntruderRow>(),
        table::<TruthRow>(),
        table::<WithError<TrackRow>>(),
        table::<TentativeRow>(),
        table::<GroupRow>(),
        table::<DetectionRow>(),
        table::<EventRow>(),
        table::<TargetRow>(),
        table::<ViewRow>(),
        table::<AgentRow>(),
        (AgentEventRow::TABLE, of_agents),
        table::<TeammateRow>(),
    ] {
        replace(&mut expected, table);
    }
    if std::env::var_os("WRITE_RECORD_PAGE").is_some() {
        std::fs::write(&path, &expected).unwrap();
        return;
    }
    let different = page.lines().zip(expected.lines()).find(|(line, expected)| line != expected);
    let advice = "run `WRITE_RECORD_PAGE=1 cargo test -p standoff-record docs`";
    assert!(
        page == expected,
        "docs/user/record.md differs from the declared columns, first in {different:?}: {advice}"
    );
}
