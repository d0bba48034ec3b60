//! Text of comparisons, and format of numbers in tables of statistics.

use standoff_io::display_text::{WIDTH, wrapped};
use standoff_score::MetricInfo;
use standoff_sim::monte_carlo::{Better, Comparison, Paired};

/// Formats a comparison for a terminal of 100 columns: the verdict, the metrics that differ, and a table of all.
pub fn comparison_text(comparison: &Comparison) -> String {
    let Comparison { a, b, seed, runs, metrics } = comparison;
    let is_measured = |paired: &Paired| paired.mean_a.or(paired.mean_b).is_some();
    let measured: Vec<_> = metrics.iter().filter(|(_, paired)| is_measured(paired)).collect();
    let mut text = format!("{}\n\nA: {a}\nB: {b}\n", overall(&measured));
    text += &format!("{runs} runs of each with the same random draws, from seed {seed}\n");
    text += &differences(&measured);
    let width = name_width(metrics);
    let head =
        format!("{:width$} {:>9} {:>9} {:>10}  {:^20}  {}", "metric", "A", "B", "B - A", "95 % interval", "result");
    text += &format!("\n{head}\n");
    for (name, paired) in &measured {
        let interval =
            paired.ci95.map_or_else(|| "-".to_owned(), |[lo, hi]| format!("{} to {}", number(lo), number(hi)));
        let (mean_a, mean_b, difference) = (maybe(paired.mean_a), maybe(paired.mean_b), maybe(paired.difference));
        let result = Verdict::of(paired).text();
        text += &format!("{name:width$} {mean_a:>9} {mean_b:>9} {difference:>10}  {interval:^20}  {result}\n");
    }
    let names = |is: &dyn Fn(&Paired) -> bool, with_runs: bool| {
        let names = metrics
            .iter()
            .filter(|(_, paired)| is(paired))
            .map(|(name, paired)| if with_runs { format!("{name} ({})", paired.n) } else { name.clone() });
        names.collect::<Vec<_>>().join(", ")
    };
    let partly = names(&|paired| is_measured(paired) && paired.n < *runs, true);
    let never = names(&|paired| !is_measured(paired), false);
    text += "\n";
    for (what, list) in [("measured in fewer runs: ", partly), ("without values: ", never)] {
        if !list.is_empty() {
            text += &wrapped("", &format!("{what}{list}"), WIDTH);
        }
    }
    text + "metrics named *_fraction range from 0 to 1\n\
            better, differs: the whole interval of B - A is beyond +- the size of interest (docs/user/metrics.md)\n\
            same: the whole interval is within +- the size of interest; unclear: neither; fly more runs\n"
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

/// Lists the metrics that differ, the largest difference relative to the size of interest first.
fn differences(measured: &[&(String, Paired)]) -> String {
    let mut text = String::new();
    for (verdict, heading) in [
        (Verdict::BBetter, "B is better"),
        (Verdict::ABetter, "A is better"),
        (Verdict::Differs, "A and B differ, neither is better"),
    ] {
        let mut found: Vec<_> = measured.iter().filter(|(_, paired)| Verdict::of(paired) == verdict).collect();
        let size = |paired: &Paired| paired.difference.unwrap_or(0.0).abs() / paired.interest;
        found.sort_by(|(_, one), (_, other)| size(other).total_cmp(&size(one)));
        if !found.is_empty() {
            text += &format!("\n{heading}\n");
        }
        for (name, paired) in found {
            let (unit, factor) = MetricInfo::unit(name);
            let value = |mean: Option<f64>| maybe(mean.map(|mean| factor * mean));
            let label = MetricInfo::of(name).map_or(name.as_str(), |info| info.label);
            let (mean_a, mean_b) = (value(paired.mean_a), value(paired.mean_b));
            text += format!("  {label:47} A {mean_a:>9}   B {mean_b:>9} {unit}").trim_end();
            text += "\n";
        }
    }
    text
}

/// Returns the width of the column of metric names: 33 or more, so that tables of the usual metrics look alike.
pub fn name_width<T>(metrics: &[(String, T)]) -> usize {
    metrics.iter().map(|(name, _)| name.len()).fold(33, usize::max)
}

/// Formats a number with four significant digits.
pub fn number(value: f64) -> String {
    let size = value.abs();
    match size {
        0.0 => "0".to_owned(),
        _ if size >= 1000.0 => format!("{value:.0}"),
        _ if size >= 100.0 => format!("{value:.1}"),
        _ if size >= 10.0 => format!("{value:.2}"),
        _ if size >= 1.0 => format!("{value:.3}"),
        _ if size >= 1e-4 => format!("{value:.4}"),
        _ => format!("{value:.1e}"),
    }
}

/// Formats a number, or `-` if it has no value.
pub fn maybe(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), number)
}
