//! The page of all claims, `docs/developer/validation.md`. It depends only on the studies, byte for byte.

use std::path::Path;

use super::claim::{Claim, RULES, Verdict};
use super::monte_carlo_plan::Plan;
use super::study::{Study, save_figures, write};
use crate::error::Failure;

/// Folder of the page's figures, relative to the page.
const PICTURES: &str = "pictures/validation";

/// Writes the page of all claims, and its figures to a folder next to it. Studies without claims are left out.
pub fn write_page(path: &Path, studies: &[Study], plan: &Plan) -> Result<(), Failure> {
    let studies: Vec<&Study> = studies.iter().filter(|study| !study.claims.is_empty()).collect();
    let figures_dir = path.parent().unwrap_or(Path::new("")).join(PICTURES);
    studies.iter().try_for_each(|study| save_figures(&study.figures, &figures_dir))?;
    write(path, &page(&studies, plan))
}

/// Formats the page.
fn page(studies: &[&Study], plan: &Plan) -> String {
    let mut text = format!(
        "# Validation: the paper, claim by claim\n\n\
         <!-- Written by `cargo run --release -- reproduce {} --page docs/developer/validation.md`: do not edit. -->\n\n\
         The paper's claims and numbers next to ours. Claims that are not reproduced stay on the page, with the reason \
         if it is known.\n\
         The command of each section measures it again, and writes the data of histories and tables as CSV. \
         `standoff reproduce improvements`, `coverage` and `wind` measure what goes beyond the paper.\n\n",
        options(plan),
    );
    text += &summary(studies);
    text += "\n## How verdicts are determined\n\nFixed rules derive each verdict from the numbers in its row.\n";
    text += &markdown(&["kind of claim", "rule"], RULES.map(|(kind, rule)| vec![kind.to_owned(), rule.to_owned()]));
    text += &format!(
        "\nBrackets contain 95 % intervals: of means by Student's t, of fractions of runs by Wilson's formula.\n\
             Run k has the first seed, {}, plus k - 1; with the same seed, all variants of a scenario have the same \
             targets and the same noise.\n\
             Claims without a number of runs are computed without random numbers.\n",
        plan.first_seed
    );
    for study in studies {
        text += &section(study, plan);
    }
    text
}

/// Formats the table of the numbers of claims by study and verdict.
fn summary(studies: &[&Study]) -> String {
    let mut text = "| | claims |".to_owned();
    for verdict in Verdict::ALL {
        text += &format!(" {} |", verdict.words());
    }
    text += &format!("\n|---|{}", "---|".repeat(1 + Verdict::ALL.len()));
    for study in studies {
        text += &format!("\n| [{}](#{}) | {} |", study.title, anchor(study.title), study.claims.len());
        Verdict::ALL.iter().for_each(|verdict| text += &format!(" {} |", study.count(*verdict)));
    }
    text + "\n"
}

fn section(study: &Study, plan: &Plan) -> String {
    let command = format!("standoff reproduce {} {}", study.name, options(plan));
    let mut text = format!("\n## {}\n\n{}\n\nCommand: `{command}`.\n", study.title, study.about);
    text += &markdown(&["claim", "paper", "ours", "runs", "verdict", "reason"], study.claims.iter().map(claim_row));
    for table in &study.tables {
        text += &format!("\n{}\n{}", table.title, markdown(&table.columns, table.rows.clone()));
    }
    for figure in &study.figures {
        text += &format!("\n![{}: {}]({PICTURES}/{}.svg)\n", study.title, figure.name, figure.name);
    }
    text
}

fn claim_row(claim: &Claim) -> Vec<String> {
    let runs = if claim.runs > 0 { claim.runs.to_string() } else { "-".to_owned() };
    let verdict = claim.finding.verdict().words().to_owned();
    vec![claim.what.clone(), claim.paper(), claim.ours(), runs, verdict, claim.reason()]
}

/// Formats a Markdown table; vertical bars in cells are escaped.
fn markdown(heads: &[impl ToString], rows: impl IntoIterator<Item = Vec<String>>) -> String {
    let row = |cells: Vec<String>| {
        let cells: Vec<String> = cells.iter().map(|cell| cell.replace('|', "\\|")).collect();
        format!("| {} |\n", cells.join(" | "))
    };
    let head = row(heads.iter().map(ToString::to_string).collect());
    format!("\n{head}|{}\n", "---|".repeat(heads.len())) + &rows.into_iter().map(row).collect::<String>()
}

/// Returns the options of the command. Traffic files change no claim.
fn options(plan: &Plan) -> String {
    let seed = if plan.first_seed == 1 { String::new() } else { format!(" --seed {}", plan.first_seed) };
    format!("--runs {}{seed}", plan.runs)
}

/// Returns the anchor that Markdown hosts create for a heading.
fn anchor(heading: &str) -> String {
    let kept = heading.chars().filter(|c| c.is_alphanumeric() || matches!(c, ' ' | '-'));
    kept.map(|c| if c == ' ' { '-' } else { c.to_ascii_lowercase() }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::claim::Finding;
    use crate::statistics::Estimate;

    #[test]
    fn every_claim_is_a_row_and_claims_that_are_not_reproduced_have_a_reason() {
        let claim = |ours| Claim {
            what: format!("|x| is 1, {ours} here"),
            unit: "m",
            finding: Finding::number(1.0, Estimate::exact(ours)),
            runs: 0,
            reason: "because of *it*",
        };
        let claims = vec![claim(1.0), claim(2.0)];
        let study = Study { claims, ..Study::new("table-2", "Table II: errors", "About.") };
        let text = page(&[&study], &Plan { runs: 9, first_seed: 3, threads: None, traffic: Vec::new() });
        for line in [
            "Command: `standoff reproduce table-2 --runs 9 --seed 3`.",
            "| \\|x\\| is 1, 1 here | 1.000 m | 1.000 m | - | reproduced |  |",
            "| \\|x\\| is 1, 2 here | 1.000 m | 2.000 m | - | not reproduced | above 1.100 m, the upper end of the \
             tolerance; because of *it* |",
            "| [Table II: errors](#table-ii-errors) | 2 | 1 | 0 | 0 | 1 |",
        ] {
            assert!(text.contains(line), "{line}\n{text}");
        }
    }
}
