//! What a study comes to: claims, tables, figures, data.

use std::fs;
use std::path::Path;

use standoff_sim::{disk, text};
use standoff_view::figures::Figure;
use standoff_view::figures::study::{Line, Plot, study};

use super::claim::{Claim, FEW_RUNS, Verdict, shown};
use super::flights::Plan;
use super::statistics::Estimate;
use crate::failure::Failure;

/// What comes to a study. Fails if a scenario, or the traffic that the plan names, cannot be used.
pub(crate) type Measure = fn(&Plan) -> Result<Study, Failure>;

/// A piece of the paper, reproduced.
pub struct Study {
    /// The argument that asks for it.
    pub(crate) name: &'static str,
    /// Its heading.
    pub(crate) title: &'static str,
    /// What is done, in a few sentences of Markdown.
    pub(crate) about: String,
    pub(crate) claims: Vec<Claim>,
    pub(crate) tables: Vec<Table>,
    pub(crate) figures: Vec<Figure>,
    pub(crate) data: Vec<Data>,
}

/// A table for people.
pub(crate) struct Table {
    pub(crate) title: String,
    pub(crate) columns: Vec<String>,
    pub(crate) rows: Vec<Vec<String>>,
}

/// Numbers for programs: a CSV file.
pub(crate) struct Data {
    /// File name without its extension.
    pub(crate) name: &'static str,
    /// Names of the columns, with commas between.
    pub(crate) columns: String,
    pub(crate) rows: Vec<Vec<f64>>,
}

impl Study {
    /// A study that has found nothing yet.
    pub(crate) fn new(name: &'static str, title: &'static str, about: impl Into<String>) -> Self {
        let about = about.into();
        Self { name, title, about, claims: Vec::new(), tables: Vec::new(), figures: Vec::new(), data: Vec::new() }
    }

    /// Draws a figure.
    pub(crate) fn draw(
        &mut self,
        name: &'static str,
        heading: &str,
        caption: &str,
        plots: &[Plot],
    ) -> Result<(), Failure> {
        self.figures.push(study(name, heading, caption, plots).map_err(Failure::running)?);
        Ok(())
    }

    /// Writes the figures and the data.
    fn save(&self, dir: &Path) -> Result<(), Failure> {
        save_figures(&self.figures, dir)?;
        self.data.iter().try_for_each(|data| write(&dir.join(format!("{}.csv", data.name)), &data.csv()))
    }

    /// How many of its claims have this verdict.
    pub(crate) fn count(&self, verdict: Verdict) -> usize {
        self.claims.iter().filter(|claim| claim.finding.verdict() == verdict).count()
    }

    /// The claims as plain text, and the tables.
    pub fn text(&self) -> String {
        let mut text = format!("{}\n", self.title);
        if !self.claims.is_empty() {
            let row = |claim: &Claim| {
                let verdict = claim.finding.verdict().words().to_owned();
                vec![plain(&claim.what), claim.paper(), claim.ours(), verdict]
            };
            text += &columns(&["claim", "paper", "ours", "verdict"], self.claims.iter().map(row).collect());
        }
        for table in &self.tables {
            text += &format!("\n  {}\n{}", plain(&table.title), columns(&table.columns, table.rows.clone()));
        }
        text
    }
}

impl Table {
    pub(crate) fn new(title: impl Into<String>, columns: impl IntoIterator<Item: Into<String>>) -> Self {
        Self { title: title.into(), columns: columns.into_iter().map(Into::into).collect(), rows: Vec::new() }
    }

    /// Adds a row: its name, then texts.
    pub(crate) fn add(&mut self, name: impl Into<String>, cells: impl IntoIterator<Item = String>) {
        self.rows.push([name.into()].into_iter().chain(cells).collect());
    }

    /// Adds a row: its name, then numbers.
    pub(crate) fn row(&mut self, name: impl Into<String>, numbers: impl IntoIterator<Item = f64>) {
        self.add(name, numbers.into_iter().map(shown));
    }

    /// The same, with an interval after every number.
    pub(crate) fn estimates(&mut self, name: &str, estimates: impl IntoIterator<Item = Estimate>) {
        self.row(name, estimates.into_iter().flat_map(|e| [e.value, e.low, e.high]));
    }
}

impl Data {
    pub(crate) fn new(
        name: &'static str,
        columns: impl Into<String>,
        rows: impl IntoIterator<Item = Vec<f64>>,
    ) -> Self {
        Self { name, columns: columns.into(), rows: rows.into_iter().collect() }
    }

    /// Numbers in full; one that is missing is an empty field.
    fn csv(&self) -> String {
        let field = |value: &f64| if value.is_finite() { value.to_string() } else { String::new() };
        let row = |row: &Vec<f64>| row.iter().map(field).collect::<Vec<_>>().join(",") + "\n";
        format!("{}\n", self.columns) + &self.rows.iter().map(row).collect::<String>()
    }
}

/// Two axes of which nothing is drawn yet but lines.
pub(crate) fn plot(across: &str, upward: impl Into<String>, lines: impl IntoIterator<Item = Line>) -> Plot {
    Plot { axes: [across.to_owned(), upward.into()], lines: lines.into_iter().collect(), ..Plot::default() }
}

/// A line through points.
pub(crate) fn line(label: impl Into<String>, colour: usize, points: impl IntoIterator<Item = (f64, f64)>) -> Line {
    Line { label: label.into(), colour, dashed: false, points: points.into_iter().collect() }
}

/// A line of a column of numbers over the first.
pub(crate) fn line_of(label: impl Into<String>, colour: usize, rows: &[Vec<f64>], column: usize) -> Line {
    line(label, colour, rows.iter().map(|row| (row[0], row[column])))
}

/// What all came to, in a few lines of at most 100 columns: how many claims of each study come out, how many in their
/// direction only, how many not.
pub fn summary(studies: &[Study]) -> String {
    let studies: Vec<&Study> = studies.iter().filter(|study| !study.claims.is_empty()).collect();
    let row = |title: &str, studies: &[&Study]| {
        let count = |verdict: Verdict| studies.iter().map(|study| study.count(verdict)).sum();
        let claims = studies.iter().map(|study| study.claims.len()).sum::<usize>();
        let counts = [claims].into_iter().chain(Verdict::ALL.map(count));
        [title.to_owned()].into_iter().chain(counts.map(|count| count.to_string())).collect()
    };
    let mut rows: Vec<Vec<String>> = studies.iter().map(|study| row(study.title, &[study])).collect();
    if rows.is_empty() {
        return String::new();
    }
    if rows.len() > 1 {
        rows.push(row("in all", &studies));
    }
    let mut text = "Summary\n".to_owned() + &columns(&["", "claims", "come out", "direction", "do not"], rows);
    let weak = studies.iter().flat_map(|study| &study.claims).filter(|claim| (1..FEW_RUNS).contains(&claim.runs));
    let weak = weak.count();
    if weak > 0 {
        text +=
            &format!("  {weak} of these verdicts are weak: they come from fewer than {FEW_RUNS} runs, see --runs\n");
    }
    text
}

/// Writes what an argument asked for: figures, data, and the claims of all its studies.
pub fn save(studies: &[Study], dir: &Path) -> Result<(), Failure> {
    let mut claims = Vec::new();
    for study in studies {
        study.save(dir)?;
        for claim in &study.claims {
            let mut value = serde_json::to_value(claim).map_err(Failure::running)?;
            value["verdict"] = serde_json::to_value(claim.finding.verdict()).map_err(Failure::running)?;
            claims.push(value);
        }
    }
    let Some(first) = studies.first() else { return Ok(()) };
    let claims = serde_json::to_string_pretty(&claims).map_err(Failure::running)? + "\n";
    write(&dir.join(claims_file(first.name)), &claims)
}

/// The file of the claims that an argument asked for.
pub fn claims_file(name: &str) -> String {
    format!("{name}.json")
}

/// Writes figures as SVG.
pub(crate) fn save_figures(figures: &[Figure], dir: &Path) -> Result<(), Failure> {
    figures.iter().try_for_each(|figure| write(&dir.join(format!("{}.svg", figure.name)), &figure.svg))
}

/// Writes a file, and the folders above it.
pub(crate) fn write(path: &Path, text: &str) -> Result<(), Failure> {
    let made = path.parent().map_or(Ok(()), fs::create_dir_all);
    let written = made.and_then(|()| disk::save_quickly(path, text));
    written.map_err(|reason| Failure::running(format!("{}: {reason}", text::path(path))))
}

/// Markdown without its code marks.
fn plain(text: &str) -> String {
    text.replace('`', "")
}

/// Rows of a table under their heads, aligned.
fn columns(heads: &[impl ToString], mut rows: Vec<Vec<String>>) -> String {
    rows.insert(0, heads.iter().map(ToString::to_string).collect());
    let width = |column: usize| rows.iter().filter_map(|row| row.get(column)).map(|cell| cell.chars().count()).max();
    let widths: Vec<usize> = (0..heads.len()).map(|column| width(column).unwrap_or_default()).collect();
    let line = |row: &Vec<String>| {
        let cells: Vec<String> = row.iter().zip(&widths).map(|(cell, &width)| format!("{cell:width$}")).collect();
        format!("  {}\n", cells.join("  ").trim_end())
    };
    rows.iter().map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::claim::Finding;
    use crate::statistics::Estimate;

    #[test]
    fn data_keep_every_digit_and_leave_out_what_is_missing() {
        let data = Data::new("made-up", "a,b", vec![vec![0.1 + 0.2, f64::NAN], vec![1.0, -2.5]]);
        assert_eq!(data.csv(), "a,b\n0.30000000000000004,\n1,-2.5\n");
    }

    #[test]
    fn the_summary_counts_and_tells_what_few_runs_are_worth() {
        let claim = |ours, runs| Claim {
            what: String::new(),
            unit: "m",
            finding: Finding::number(1.0, Estimate::exact(ours)),
            runs,
            reason: "",
        };
        let study = |claims| Study { claims, ..Study::new("table-2", "Table II", "") };
        let [good, bad] = [study(vec![claim(1.0, 0), claim(2.0, 29)]), study(vec![claim(2.0, 30)])];
        let one =
            "Summary\n            claims  come out  direction  do not\n  Table II  2       1         0          1\n";
        let weak = "  1 of these verdicts are weak: they come from fewer than 30 runs, see --runs\n";
        assert_eq!(summary(&[good, study(vec![])]), format!("{one}{weak}"));
        let good = study(vec![claim(1.0, 0), claim(2.0, 0)]);
        let told = summary(&[good, bad]);
        assert!(told.ends_with("\n  in all    3       1         0          2\n"), "{told}");
    }

    #[test]
    fn columns_line_up() {
        let rows = vec![vec!["long name".to_owned(), "1".to_owned()], vec!["x".to_owned(), "22".to_owned()]];
        assert_eq!(columns(&["what", "n"], rows), "  what       n\n  long name  1\n  x          22\n");
    }
}
