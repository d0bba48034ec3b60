//! The page of all claims, `docs/developer/validation.md`. It depends only on the studies, byte for byte.

use std::path::Path;

use super::claim::{Claim, RULES};
use super::monte_carlo_plan::Plan;
use super::study::{Study, count_heads, counts, save_figures, write};
use crate::error::Failure;

/// Folder of the page's figures, relative to the page.
const PICTURES: &str = "pictures/validation";

/// Writes the page of the claims of studies, and their figures to a folder next to it.
pub fn write_page(path: &Path, studies: &[Study], plan: &Plan) -> Result<(), Failure> {
    let figures_dir = path.parent().unwrap_or(Path::new("")).join(PICTURES);
    studies.iter().try_for_each(|study| save_figures(&study.figures, &figures_dir))?;
    write(path, &page(studies, plan))
}

/// Formats the page.
fn page(studies: &[Study], plan: &Plan) -> String {
    let mut text = format!(
        "# Validation: the paper, claim by claim\n\n\
         <!-- Written by `cargo run --release -- reproduce {} --page docs/developer/validation.md`: do not edit. -->\n\n\
         The paper's claims and numbers next to ours. Claims that are not reproduced stay on the page, with the reason \
         if it is known. The command of each section measures them again, and writes histories and tables as CSV. \
         [The method](method.md) explains the equations and their errata.\n",
        options(plan),
    );
    let link = |study: &Study| format!("[{}](#{})", study.title, anchor(study.title));
    text += &markdown(&count_heads(), studies.iter().map(|study| [vec![link(study)], counts(&[study])].concat()));
    text += "\n## How verdicts are determined\n\nFixed rules derive each verdict from the numbers in its row.\n";
    text += &markdown(&["kind of claim", "rule"], RULES.map(|(kind, rule)| vec![kind.to_owned(), rule.to_owned()]));
    text += &format!(
        "\nBrackets contain 95 % intervals: of means by Student's t, of fractions of runs by Wilson's formula. Run k \
         has the first seed, {}, plus k - 1; with the same seed, all variants of a scenario have the same targets and \
         the same noise. Claims without a number of runs are computed without random numbers.\n",
        plan.first_seed
    );
    for study in studies {
        text += &section(study, plan);
    }
    text
}

fn section(study: &Study, plan: &Plan) -> String {
    let command = format!("standoff reproduce {} {}", study.name, options(plan));
    let mut text = format!("\n## {}\n\n{}\n\nCommand: `{command}`.\n", study.title, study.about);
    let rows = study.claims_with_causes().map(|(claim, cause)| claim_row(claim, cause));
    text += &markdown(&["claim", "paper", "ours", "runs", "verdict", "reason"], rows);
    for table in &study.tables {
        text += &format!("\n{}\n{}", table.title, markdown(&table.columns, table.rows.clone()));
    }
    for figure in &study.figures {
        text += &format!("\n![{0}]({PICTURES}/{0}.svg)\n", figure.name);
    }
    text
}

/// Formats a claim. If no cause is known, the reason is how the numbers differ.
fn claim_row(claim: &Claim, cause: Option<&str>) -> Vec<String> {
    let runs = if claim.runs > 0 { claim.runs.to_string() } else { "-".to_owned() };
    let verdict = claim.finding.verdict().words().to_owned();
    let reason = cause.map(str::to_owned).or_else(|| claim.gap()).unwrap_or_default();
    vec![claim.what.clone(), claim.paper(), claim.ours(), runs, verdict, reason]
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

/// Returns the options of the command.
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
        let claim = |ours, reason| Claim {
            what: format!("|x| is 1, {ours} here"),
            unit: "m",
            finding: Finding::number(1.0, Estimate::exact(ours)),
            runs: 0,
            reason,
        };
        let claims = vec![
            claim(1.0, "because of *it*"),
            claim(2.0, "because of *it*"),
            claim(3.0, "because of *it*"),
            claim(4.0, ""),
        ];
        let study = Study { claims, ..Study::new("table-2", "Table II: errors", "About.") };
        let text = page(&[study], &Plan { runs: 9, first_seed: 3, threads: None, traffic: Vec::new() });
        for line in [
            "Command: `standoff reproduce table-2 --runs 9 --seed 3`.",
            "| \\|x\\| is 1, 1 here | 1.000 m | 1.000 m | - | reproduced |  |",
            "| \\|x\\| is 1, 2 here | 1.000 m | 2.000 m | - | not reproduced | because of *it* |",
            "| \\|x\\| is 1, 3 here | 1.000 m | 3.000 m | - | not reproduced | cause as above |",
            "| \\|x\\| is 1, 4 here | 1.000 m | 4.000 m | - | not reproduced | above 1.100 m, the upper end of the \
             tolerance |",
            "| [Table II: errors](#table-ii-errors) | 4 | 1 | 0 | 0 | 3 |",
        ] {
            assert!(text.contains(line), "{line}\n{text}");
        }
    }
}
