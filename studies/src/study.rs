//! Results of a study: claims, tables, figures and data.

use std::fs;
use std::path::Path;

use standoff_io::atomic_file;
use standoff_io::display_text::{self, WIDTH, wrapped, wrapped_lines};
use standoff_view::figures::Figure;
use standoff_view::figures::study::{Line, Plot, study};

use super::claim::{Claim, FEW_RUNS, Finding, RULES, Verdict, shown};
use super::monte_carlo_plan::Plan;
use super::statistics::Estimate;
use crate::error::Failure;

/// Maximum width of the printed text, columns.
const COLUMNS: usize = 100;
/// Minimum width of the names of a table's rows; if less is left, columns are continued below.
const NAME_MIN: usize = 28;
/// Maximum width of the names in a table that is continued below.
const NAME_MAX: usize = 52;

/// Function that runs a study. Fails if a scenario, or the traffic that the plan names, cannot be used.
pub(crate) type Measure = fn(&Plan) -> Result<Study, Failure>;

/// Results of a study.
pub struct Study {
    /// Command-line argument that selects it.
    pub(crate) name: &'static str,
    /// Heading.
    pub(crate) title: &'static str,
    /// Description in a few sentences: Markdown for the page or, if the study has no claims, text for a terminal.
    pub(crate) about: String,
    pub(crate) claims: Vec<Claim>,
    /// Columns of the paper's table: the claims about their numbers end with their names. All numbers are errors, so
    /// that smaller ones are better.
    pub(crate) columns: &'static [&'static str],
    pub(crate) tables: Vec<Table>,
    pub(crate) figures: Vec<Figure>,
    pub(crate) data: Vec<Data>,
}

/// A table of text.
pub(crate) struct Table {
    pub(crate) title: String,
    pub(crate) columns: Vec<String>,
    pub(crate) rows: Vec<Vec<String>>,
    /// Number of columns that are printed together if the table is wider than a terminal.
    pub(crate) at_once: usize,
}

/// Numerical data, written as a CSV file.
pub(crate) struct Data {
    /// File name without its extension.
    pub(crate) name: &'static str,
    /// Comma-separated names of the columns.
    pub(crate) columns: String,
    pub(crate) rows: Vec<Vec<f64>>,
}

impl Study {
    /// Creates a study without results.
    pub(crate) fn new(name: &'static str, title: &'static str, about: impl Into<String>) -> Self {
        let (about, columns) = (about.into(), &[]);
        Self {
            name,
            title,
            about,
            claims: Vec::new(),
            columns,
            tables: Vec::new(),
            figures: Vec::new(),
            data: Vec::new(),
        }
    }

    /// Draws a figure and adds it to the study.
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

    /// Returns the claims, each with the known cause why it is not reproduced. A cause that repeats the one of the
    /// claim above is replaced by a reference to it.
    pub(crate) fn claims_with_causes(&self) -> impl Iterator<Item = (&Claim, Option<&'static str>)> {
        let above = [None].into_iter().chain(self.claims.iter().map(Claim::cause));
        self.claims.iter().zip(above).map(|(claim, above)| match claim.cause() {
            Some(cause) if above == Some(cause) => (claim, Some("cause as above")),
            cause => (claim, cause),
        })
    }

    /// Formats the claims and tables as plain text for a terminal of 100 columns.
    pub fn text(&self) -> String {
        let mut text = format!("{}\n", self.title);
        if self.claims.is_empty() {
            text += &wrapped("  ", &self.about, WIDTH);
        }
        text += &self.paper_columns();
        let is_in_column = |claim: &Claim| self.columns.iter().any(|column| row_of(claim, column).is_some());
        for (claim, cause) in self.claims_with_causes().filter(|(claim, _)| !is_in_column(claim)) {
            text += &wrapped(&format!("  {:15} ", claim.finding.verdict().words()), &plain(&claim.what), WIDTH);
            text += &wrapped(&" ".repeat(18), &format!("paper {}; ours {}", claim.paper(), claim.ours()), WIDTH);
            if let Some(gap) = claim.gap() {
                let reason = cause.map_or_else(|| gap.clone(), |cause| format!("{gap}; {cause}"));
                text += &wrapped(&" ".repeat(18), &plain(&reason), WIDTH);
            }
        }
        for table in &self.tables {
            text += &format!(
                "\n{}{}",
                wrapped("  ", &plain(&table.title), WIDTH),
                columns(&table.columns, table.plain_rows(), table.at_once)
            );
        }
        text
    }

    /// Formats the claims about the numbers of the paper's table: a table for each of its columns, and the reasons.
    fn paper_columns(&self) -> String {
        let mut text = String::new();
        let mut reasons: Vec<(&str, Vec<&str>)> = Vec::new();
        for column in self.columns {
            let heads = [column, "paper", "ours, 95 % interval", "ratio", "verdict"];
            let mut rows = Vec::new();
            for claim in &self.claims {
                let Some(name) = row_of(claim, column) else { continue };
                let Finding::Number { paper, ours, .. } = claim.finding else { continue };
                let verdict = claim.finding.verdict();
                let better = if ours.value < paper { "ours better" } else { "paper better" };
                let verdict = match verdict {
                    Verdict::NotReproduced => format!("{}; {better}", verdict.words()),
                    _ => verdict.words().to_owned(),
                };
                let ratio = format!("{:.2}", ours.value / paper);
                rows.push(vec![
                    format!("{name} ({})", claim.unit),
                    shown(paper),
                    ours.formatted(shown),
                    ratio,
                    verdict,
                ]);
                if let Some(cause) = claim.cause() {
                    match reasons.iter_mut().find(|(known, _)| *known == cause) {
                        Some((_, names)) if names.contains(&name) => {}
                        Some((_, names)) => names.push(name),
                        None => reasons.push((cause, vec![name])),
                    }
                }
            }
            text += &format!("\n{}", columns(&heads, rows, usize::MAX));
        }
        text += if reasons.is_empty() { "" } else { "\n" };
        for (cause, names) in reasons {
            text += &wrapped("  ", &plain(&format!("{}: {cause}", names.join(", "))), WIDTH);
        }
        text + if self.columns.is_empty() { "" } else { "\n" }
    }
}

/// Returns the row of a claim about a number in this column of the paper's table.
fn row_of<'a>(claim: &'a Claim, column: &str) -> Option<&'a str> {
    claim.what.strip_suffix(column)?.strip_suffix(", ").filter(|row| !row.contains(':'))
}

impl Table {
    pub(crate) fn new(title: impl Into<String>, columns: impl IntoIterator<Item: Into<String>>) -> Self {
        let columns = columns.into_iter().map(Into::into).collect();
        Self { title: title.into(), columns, rows: Vec::new(), at_once: 1 }
    }

    /// Returns the rows without the backticks of Markdown.
    fn plain_rows(&self) -> Vec<Vec<String>> {
        self.rows.iter().map(|row| row.iter().map(|cell| plain(cell)).collect()).collect()
    }

    /// Adds a row of texts after its name.
    pub(crate) fn add(&mut self, name: impl Into<String>, cells: impl IntoIterator<Item = String>) {
        self.rows.push([name.into()].into_iter().chain(cells).collect());
    }

    /// Adds a row of numbers after its name.
    pub(crate) fn row(&mut self, name: impl Into<String>, numbers: impl IntoIterator<Item = f64>) {
        self.add(name, numbers.into_iter().map(shown));
    }

    /// Adds a row of numbers, each followed by the two ends of its interval.
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

    /// Formats the data as CSV with full precision; missing numbers are empty fields.
    fn csv(&self) -> String {
        let field = |value: &f64| if value.is_finite() { value.to_string() } else { String::new() };
        let row = |row: &Vec<f64>| row.iter().map(field).collect::<Vec<_>>().join(",") + "\n";
        format!("{}\n", self.columns) + &self.rows.iter().map(row).collect::<String>()
    }
}

/// Creates a plot with labelled axes and lines only.
pub(crate) fn plot(across: &str, upward: impl Into<String>, lines: impl IntoIterator<Item = Line>) -> Plot {
    Plot { axes: [across.to_owned(), upward.into()], lines: lines.into_iter().collect(), ..Plot::default() }
}

/// Creates a line through points.
pub(crate) fn line(label: impl Into<String>, colour: usize, points: impl IntoIterator<Item = (f64, f64)>) -> Line {
    Line { label: label.into(), colour, dashed: false, points: points.into_iter().collect() }
}

/// Creates a line of one column plotted over the first column.
pub(crate) fn line_of(label: impl Into<String>, colour: usize, rows: &[Vec<f64>], column: usize) -> Line {
    line(label, colour, rows.iter().map(|row| (row[0], row[column])))
}

/// Returns the heads of a table of names and [`counts`].
pub(crate) fn count_heads() -> Vec<&'static str> {
    ["", "claims"].into_iter().chain(Verdict::ALL.map(Verdict::words)).collect()
}

/// Returns the number of claims of some studies, in total and by verdict.
pub(crate) fn counts(studies: &[&Study]) -> Vec<String> {
    let claims = || studies.iter().flat_map(|study| &study.claims);
    let count = |verdict| claims().filter(|claim| claim.finding.verdict() == verdict).count();
    [claims().count()].into_iter().chain(Verdict::ALL.map(count)).map(|count| count.to_string()).collect()
}

/// Formats the number of claims of each study by verdict, in lines of at most 100 columns.
pub fn summary(studies: &[Study]) -> String {
    let studies: Vec<&Study> = studies.iter().filter(|study| !study.claims.is_empty()).collect();
    if studies.is_empty() {
        return String::new();
    }
    let row = |title: &str, studies: &[&Study]| [vec![title.to_owned()], counts(studies)].concat();
    let mut rows: Vec<Vec<String>> = studies.iter().map(|study| row(study.title, &[study])).collect();
    if rows.len() > 1 {
        rows.push(row("total", &studies));
    }
    "Summary\n".to_owned() + &columns(&count_heads(), rows, usize::MAX)
}

/// Formats the rules of the verdicts, and the number of verdicts from few runs.
pub fn rules(studies: &[Study]) -> String {
    if studies.iter().all(|study| study.claims.is_empty()) {
        return String::new();
    }
    let mut text = "Rules of the verdicts, by kind of claim\n".to_owned();
    for (kind, rule) in RULES {
        text += &wrapped(&format!("  {kind:11}"), rule, WIDTH);
    }
    let weak = studies.iter().flat_map(|study| &study.claims).filter(|claim| (1..FEW_RUNS).contains(&claim.runs));
    let weak = weak.count();
    if weak > 0 {
        text +=
            &format!("  {weak} of these verdicts are weak: they come from fewer than {FEW_RUNS} runs, see --runs\n");
    }
    text
}

/// Writes the figures, the data and the claims of the studies of one study group.
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

/// Returns the name of the claims file of a study group.
pub fn claims_file(name: &str) -> String {
    format!("{name}.json")
}

/// Writes figures as SVG.
pub(crate) fn save_figures(figures: &[Figure], dir: &Path) -> Result<(), Failure> {
    figures.iter().try_for_each(|figure| write(&dir.join(format!("{}.svg", figure.name)), &figure.svg))
}

/// Writes a file, and creates its parent folders.
pub(crate) fn write(path: &Path, text: &str) -> Result<(), Failure> {
    let created = path.parent().map_or(Ok(()), fs::create_dir_all);
    let written = created.and_then(|()| atomic_file::save_quickly(path, text));
    written.map_err(|reason| Failure::running(format!("{}: {reason}", display_text::path(path))))
}

/// Removes the backticks from Markdown.
fn plain(text: &str) -> String {
    text.replace('`', "")
}

/// Formats the rows of a table under their heads, with aligned columns. The first column is wrapped, and further
/// columns are continued below, `at_once` together, so that no line is longer than 100 columns.
fn columns(heads: &[impl ToString], mut rows: Vec<Vec<String>>, at_once: usize) -> String {
    rows.insert(0, heads.iter().map(ToString::to_string).collect());
    let width = |column: usize| rows.iter().filter_map(|row| row.get(column)).map(|cell| cell.chars().count()).max();
    let mut widths: Vec<usize> = (0..heads.len()).map(|column| width(column).unwrap_or_default()).collect();
    let others: usize = widths.iter().skip(1).map(|width| 2 + width).sum();
    let left = (COLUMNS - 2).saturating_sub(others);
    widths[0] = widths[0].min(if left < NAME_MIN { NAME_MAX } else { left });
    let all: Vec<usize> = (1..heads.len()).collect();
    let chunks = || all.chunks(at_once.clamp(1, all.len().max(1)));
    let widest = chunks().map(|chunk| chunk.iter().map(|&column| 2 + widths[column]).sum::<usize>()).max();
    widths[0] = widths[0].min((COLUMNS - 2).saturating_sub(widest.unwrap_or_default()).max(NAME_MIN));
    let fits = |columns: &[usize]| 2 + widths[0] + columns.iter().map(|&column| 2 + widths[column]).sum::<usize>();
    let mut blocks: Vec<Vec<usize>> = Vec::new();
    for together in chunks() {
        match blocks.last_mut() {
            Some(block) if fits(&[block, together].concat()) <= COLUMNS => block.extend(together),
            _ => blocks.push(together.to_vec()),
        }
    }
    let line = |row: &Vec<String>, block: &Vec<usize>| {
        let mut names = wrapped_lines(row.first().map_or("", String::as_str), widths[0]).into_iter();
        let name = names.next().unwrap_or_default();
        let cell = |column: &usize| Some(format!("  {:width$}", row.get(*column)?, width = widths[*column]));
        let cells: String = block.iter().filter_map(cell).collect();
        let first = format!("  {name:width$}{cells}", width = widths[0]);
        [first]
            .into_iter()
            .chain(names.map(|name| format!("    {name}")))
            .fold(String::new(), |text, line| text + line.trim_end() + "\n")
    };
    let block = |block: &Vec<usize>| rows.iter().map(|row| line(row, block)).collect::<String>();
    blocks.iter().map(block).collect::<Vec<_>>().join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::statistics::Estimate;

    #[test]
    fn csv_has_full_precision_and_empty_fields_for_missing_numbers() {
        let data = Data::new("made-up", "a,b", vec![vec![0.1 + 0.2, f64::NAN], vec![1.0, -2.5]]);
        assert_eq!(data.csv(), "a,b\n0.30000000000000004,\n1,-2.5\n");
    }

    #[test]
    fn the_summary_counts_verdicts_and_marks_those_of_few_runs_as_weak() {
        let claim = |ours, runs| Claim {
            what: String::new(),
            unit: "m",
            finding: Finding::number(1.0, Estimate::exact(ours)),
            runs,
            reason: "",
        };
        let study = |claims| Study { claims, ..Study::new("table-2", "Table II", "") };
        let [good, bad] = [study(vec![claim(1.0, 0), claim(2.0, 29)]), study(vec![claim(2.0, 30)])];
        let one = summary(&[good, study(vec![])]);
        let heads = "            claims  reproduced  direction only  undecided  not reproduced\n";
        let row = "  Table II  2       1           0               0          1\n";
        assert_eq!(one, format!("Summary\n{heads}{row}"));
        let good = study(vec![claim(1.0, 0), claim(2.0, 29)]);
        let weak = "  1 of these verdicts are weak: they come from fewer than 30 runs, see --runs\n";
        assert!(rules(std::slice::from_ref(&good)).ends_with(weak));
        let both = summary(&[good, bad]);
        assert!(both.contains("\n  total     3       1           0               0          2\n"), "{both}");
    }

    #[test]
    fn columns_are_aligned() {
        let rows = vec![vec!["long name".to_owned(), "1".to_owned()], vec!["x".to_owned(), "22".to_owned()]];
        assert_eq!(columns(&["what", "n"], rows, 1), "  what       n\n  long name  1\n  x          22\n");
    }
}
