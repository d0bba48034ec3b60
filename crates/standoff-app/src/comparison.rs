//! Text of comparisons.

use standoff_io::display_text::WIDTH;
use standoff_sim::monte_carlo::{Better, Comparison, Paired};

use crate::metric_table::{MetricRow, Shown, in_unit, interval, metric_table, remarks};

/// Formats a comparison for a terminal of 100 columns: the verdict on all metrics, and a table of the main ones and of
/// those that differ; of all, if the user selected them.
pub fn comparison_text(comparison: &Comparison) -> String {
    let Comparison { a, b, seed, runs, metrics } = comparison;
    let shown = Shown::of(metrics);
    let is_measured = |paired: &Paired| shown.are_named() || paired.mean_a.or(paired.mean_b).is_some();
    let measured: Vec<_> = metrics.iter().filter(|(_, paired)| is_measured(paired)).collect();
    let mut text = format!("{}\n\nA: {a}\nB: {b}\n", overall(&measured));
    text += &format!("{runs} runs of each with the same random draws, from seed {seed}\n");
    let is_shown = |name: &str, paired: &Paired| shown.has(name) || paired.differs;
    let rows: Vec<_> = measured.iter().filter(|(name, paired)| is_shown(name, paired)).map(|one| row(one)).collect();
    text += &metric_table(&[("A", 8), ("B", 8), ("95 % of B - A ", 19)], "result", &rows, WIDTH);
    let numbers =
        metrics.iter().filter(|(name, paired)| is_shown(name, paired)).map(|(name, of)| (name.as_str(), of.n));
    text += &remarks(numbers, *runs, measured.len() - rows.len());
    text + "better, differs: the whole interval of B - A is beyond +- the size of interest (docs/user/metrics.md)\n\
            same: the whole interval is within +- the size of interest; unclear: neither; fly more runs\n"
}

fn row((metric, paired): &(String, Paired)) -> MetricRow<'_> {
    let [a, b] = [paired.mean_a, paired.mean_b].map(|mean| in_unit(metric, mean));
    let cells = vec![a, b, interval(metric, paired.ci95)];
    MetricRow { metric, cells, end: Verdict::of(paired).text().to_owned(), remarks: Vec::new() }
}

/// Result of comparing one metric.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// A is better.
    ABetter,
    /// B is better.
    BBetter,
    /// A and B differ, and neither direction is known to be better.
    Differs,
    /// The difference has no practical importance.
    Same,
    /// More runs may decide.
    Unclear,
}

impl Verdict {
    /// Returns the verdict on a metric.
    pub fn of(paired: &Paired) -> Self {
        match (paired.differs, paired.better, paired.ci95) {
            (true, Some(Better::A), _) => Self::ABetter,
            (true, Some(Better::B), _) => Self::BBetter,
            (true, None, _) => Self::Differs,
            (false, _, Some([lo, hi])) if lo >= -paired.interest && hi <= paired.interest => Self::Same,
            (false, ..) if paired.equal == Some(1.0) => Self::Same,
            (false, ..) => Self::Unclear,
        }
    }

    /// Returns the verdict as text.
    pub fn text(self) -> &'static str {
        match self {
            Self::ABetter => "A better",
            Self::BBetter => "B better",
            Self::Differs => "differs",
            Self::Same => "same",
            Self::Unclear => "unclear",
        }
    }
}

/// Returns the verdict on all measured metrics in one line.
fn overall(measured: &[&(String, Paired)]) -> String {
    let count = |verdict| measured.iter().filter(|(_, paired)| Verdict::of(paired) == verdict).count();
    let (a, b, differs) = (count(Verdict::ABetter), count(Verdict::BBetter), count(Verdict::Differs));
    let (same, unclear) = (count(Verdict::Same), count(Verdict::Unclear));
    let verdict = match (a, b) {
        (0, 0) => "neither A nor B is better in any metric".to_owned(),
        (0, b) => format!("B is better in {b} of {} metrics, A in none", measured.len()),
        (a, 0) => format!("A is better in {a} of {} metrics, B in none", measured.len()),
        (a, b) => format!("B is better in {b} of {} metrics, A in {a}", measured.len()),
    };
    let neutral = if differs > 0 { format!(", {differs} differ") } else { String::new() };
    format!("verdict: {verdict}{neutral}; {same} the same, {unclear} unclear")
}
