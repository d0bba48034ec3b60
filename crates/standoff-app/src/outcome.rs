//! The outcome of a run, as text for a terminal or as JSON.

mod events;
mod problem_files;
mod problems;
mod targets_and_limits;

use std::path::Path;

use serde::Serialize;
use standoff_io::display_text::{self, count, shell_path, wrapped};
use standoff_score::{MetricInfo, MetricSelection, Metrics, SelectedMetrics, TargetScore, WorseDirection};
use standoff_sim::baseline::{CoverageBaseline, SPEED_M_S};
use standoff_sim::scenario::Settings;
use standoff_view::replay::Line;

use crate::metric_table::{MetricRow, distinct, metric_table};
pub(crate) use events::Events;
use events::named;
pub(crate) use problem_files::ProblemFiles;
pub(crate) use problems::Problem;

/// Minimum fraction of ungrouped target time that is explained.
const UNGROUPED_NOTABLE: f64 = 0.1;
/// Maximum number of targets listed in the table.
const TARGETS_SHOWN: usize = 20;

/// Results of a run.
#[derive(Serialize)]
pub struct Outcome {
    pub(crate) scenario: String,
    pub(crate) seed: u64,
    pub(crate) duration_s: f64,
    /// Time of the last time step of an unfinished run, s; `None` for a complete run.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) unfinished_after_s: Option<f64>,
    pub(crate) uavs: usize,
    pub(crate) targets: usize,
    /// Interpretation of the coordinates in the traffic file: metres or degrees.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) traffic: Option<String>,
    /// Mean number of targets that exist at a time.
    pub(crate) targets_mean: Option<f64>,
    /// The selected metrics.
    pub metrics: SelectedMetrics,
    /// Coverage baseline, if requested. It belongs to the scenario, so that it is not in the summary of a record.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub baseline: Option<CoverageBaseline>,
    /// Alarms, grouped by kind and cause.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) problems: Vec<Problem>,
    #[serde(flatten)]
    pub(crate) events: Events,
    /// Scores of each target.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub per_target: Vec<PerTarget>,
    /// Settings of the run.
    #[serde(skip)]
    pub settings: Settings,
}

/// Scores of one target.
#[derive(Debug, Clone, Serialize)]
pub struct PerTarget {
    /// Name of the target.
    pub target: String,
    /// Scores, defined like the metrics of the same names.
    #[serde(flatten)]
    pub score: TargetScore,
}

/// Options for printing an outcome.
#[derive(Clone, Copy)]
pub struct OutcomeOptions<'a> {
    /// Metrics of the paper's law to print next to the run's.
    pub paper_comparison: Option<&'a Metrics>,
    /// Advice to print after the results.
    pub advice: &'a str,
    /// True to also list the targets.
    pub per_target: bool,
    /// Maximum length of explanations and events, characters. The table needs 80.
    pub width: usize,
}

impl Default for OutcomeOptions<'_> {
    fn default() -> Self {
        Self { paper_comparison: None, advice: "", per_target: false, width: display_text::WIDTH }
    }
}

/// Returns the selected metrics in their fixed order, fractions in percent. Those without a value are left out of the
/// default selection.
pub fn lines(metrics: &SelectedMetrics, settings: &Settings) -> Vec<Line> {
    let is_default = metrics.choice == MetricSelection::standard();
    let line = |info: &MetricInfo| {
        let (unit, factor) = MetricInfo::unit(info.name);
        let value = metrics.get(info.name)?.map(|value| factor * value);
        let target = targets_and_limits::target(info.name, settings);
        let is_main = metrics.choice.shows(info);
        let (metric, section, label) = (info.name, info.section, info.label);
        (value.is_some() || !is_default).then_some(Line { metric, section, label, value, unit, target, is_main })
    };
    MetricInfo::all().iter().filter_map(line).collect()
}

impl Outcome {
    /// Formats the outcome as one JSON object and a newline.
    pub fn json(&self) -> serde_json::Result<String> {
        Ok(serde_json::to_string_pretty(self)? + "\n")
    }

    /// Formats the outcome as text; `out` is the folder of the results. The text names its page if it exists.
    pub fn text(&self, out: &Path, options: OutcomeOptions) -> String {
        let Self { scenario, seed, duration_s, unfinished_after_s, uavs, targets, targets_mean, .. } = self;
        let end = unfinished_after_s.map_or_else(String::new, |end_s| format!(", unfinished after {end_s} s"));
        // If vehicles appear and disappear, the mean number of targets at a time is below their total number.
        let at_a_time = targets_mean.filter(|mean| (mean - *targets as f64).abs() > 0.05);
        let at_a_time = at_a_time.map_or_else(String::new, |mean| format!(" ({mean:.1} at a time)"));
        let mut text = format!(
            "{}, seed {seed}: {}, {}{at_a_time}, {duration_s} s{end}\n",
            display_text::printable(scenario),
            count(*uavs, "UAV"),
            count(*targets, "target")
        );
        let about = &self.settings.about;
        if !about.is_empty() {
            text += &wrapped("", &display_text::printable(about), options.width);
        }
        if let Some(traffic) = &self.traffic {
            text += &format!("Traffic coordinates interpreted as {traffic}.\n");
        }
        text += &self.table(options.paper_comparison, options.width);
        if options.paper_comparison.is_some() {
            text += &wrapped("* ", targets_and_limits::PAPER_LAW, options.width);
        }
        if options.per_target && !self.per_target.is_empty() {
            text += &self.targets_table();
        }
        if !self.problems.is_empty() {
            text += "\nProblems, those of the longest total time first; all are in alarms.csv and gaps.csv\n";
        }
        self.problems.iter().for_each(|problem| text += &problem.text(options.width));
        let alarms: Vec<&str> = self.problems.iter().map(|problem| problem.kind).collect();
        text += &self.events.text(&alarms, options.width);
        text += options.advice;
        let (dir, page) = (shell_path(out), out.join("report.html"));
        text += &format!("\nresults in {dir}\nnext:\n");
        // A read-only record may have no page.
        if page.is_file() {
            text += &format!("  open {}  (replays the run in a browser)\n", shell_path(&page));
        }
        text + &format!("  standoff view {dir}  (serves the replay with every time step)\n")
    }

    /// Formats the metrics as a table, with lines that explain values below their row.
    fn table(&self, paper_comparison: Option<&Metrics>, width: usize) -> String {
        let remarks = targets_and_limits::remarks(&self.metrics, &self.events, &self.settings);
        let lines = lines(&self.metrics, &self.settings);
        let row = |line: &Line| {
            let digits = if MetricInfo::of(line.metric).is_some_and(|info| info.is_count) { 0 } else { 2 };
            let mut cells = vec![number(line.value, digits, line.unit)];
            let mut explanations: Vec<String> = self.explanation(line.metric).into_iter().collect();
            if let Some(paper) = paper_comparison {
                let (_, factor) = MetricInfo::unit(line.metric);
                cells.push(number(paper[line.metric].map(|value| factor * value), digits, line.unit));
                let is_better = is_better(line.metric, paper[line.metric], self.metrics.get(line.metric).flatten());
                explanations.extend(is_better.then(|| "the paper's law has the better value".to_owned()));
            }
            if line.metric == "custody_fraction" {
                explanations.extend(self.ungrouped_text());
                explanations.extend(self.baseline_text());
            }
            let own = remarks.iter().filter(|(metric, _)| *metric == line.metric);
            explanations.extend(own.map(|(_, remark)| remark.clone()));
            MetricRow { metric: line.metric, cells, end: line.target.clone(), remarks: explanations }
        };
        let heads = [("this run", 9), ("paper's law*", 13)];
        let heads = if paper_comparison.is_some() { &heads[..] } else { &heads[..1] };
        let rows: Vec<_> = lines.iter().filter(|line| line.is_main).map(row).collect();
        let text = metric_table(heads, "goal or limit", &rows, width);
        match lines.len() - rows.len() {
            0 => text,
            more => text + &format!("{more} more metrics with --metrics all\n"),
        }
    }

    /// Returns the line that explains the value of a metric.
    fn explanation(&self, metric: &str) -> Option<String> {
        let value = self.metrics.get(metric).flatten();
        let meaning = targets_and_limits::meaning(metric, value?, &self.settings);
        match metric {
            "custody_fraction" | "in_view_fraction" => {
                Some(meaning? + &self.of_targets(value).map_or_else(String::new, |n| format!(": {n}")))
            }
            "longest_out_of_view_s" => {
                let gap_s = value.filter(|gap_s| *gap_s > 0.0)?;
                let longest = self.per_target.iter().find(|one| one.score.longest_out_of_view_s == Some(gap_s))?;
                Some(display_text::printable(&named(&longest.target)))
            }
            _ => meaning,
        }
    }

    /// States how many targets are in no group, if they are many.
    fn ungrouped_text(&self) -> Option<String> {
        let share = self.metrics.metrics["ungrouped_fraction"].filter(|share| *share > UNGROUPED_NOTABLE);
        Some(format!("{} are in no group: no orbit covers them", self.of_targets(Some(share?))?))
    }

    /// Formats a fraction of target time as a mean number of targets.
    fn of_targets(&self, share: Option<f64>) -> Option<String> {
        let mean = self.targets_mean?;
        let is_whole = (mean - mean.round()).abs() < 0.05;
        let total = if is_whole { format!("{mean:.0}") } else { format!("{mean:.2}") };
        let hundredths = (share? * mean * 100.0).round();
        // A mean that is not quite all targets does not look like it.
        let hundredths = if share? < 1.0 { hundredths.min((mean * 100.0).round() - 1.0) } else { hundredths };
        Some(format!("{:.2} of {total} targets on average", hundredths / 100.0))
    }

    /// Formats the coverage of one greedy disc per UAV; `None` without a baseline.
    fn baseline_text(&self) -> Option<String> {
        let CoverageBaseline { all_uavs: all, .. } = self.baseline.as_ref()?;
        let percent = all.mover_fraction.map_or_else(|| "-".to_owned(), |share| format!("{:.0} %", 100.0 * share));
        let discs = count(all.discs, "greedy disc");
        Some(format!("baseline {percent}: {discs} with perfect knowledge of all targets, at {SPEED_M_S} m/s"))
    }

    /// Formats one row per target: all targets, or those with the longest gaps.
    fn targets_table(&self) -> String {
        let mut targets: Vec<&PerTarget> = self.per_target.iter().collect();
        let gap_s = |one: &PerTarget| one.score.longest_out_of_view_s.unwrap_or(0.0);
        if targets.len() > TARGETS_SHOWN {
            targets.sort_by(|a, b| gap_s(b).total_cmp(&gap_s(a)));
            targets.truncate(TARGETS_SHOWN);
        }
        let mut text = format!(
            "\n{:24} {:>10} {:>9} {:>13} {:>16} {:>6}\n",
            "target", "custody %", "in view %", "longest gap s", "position error m", "ANEES"
        );
        for PerTarget { target, score } in &targets {
            let percent = |share: Option<f64>| number(share.map(|share| 100.0 * share), 2, "%");
            let manoeuvres = if score.manoeuvres { "  manoeuvres" } else { "" };
            let priority = score.priority.map_or_else(String::new, |priority| format!("  priority {priority}"));
            text += &format!(
                "{:24} {:>10} {:>9} {:>13} {:>16} {:>6}{priority}{manoeuvres}\n",
                display_text::printable(&named(target)),
                percent(score.custody_fraction),
                percent(score.in_view_fraction),
                number(score.longest_out_of_view_s, 2, "s"),
                number(score.position_error_m, 2, "m"),
                number(score.anees, 2, "")
            );
        }
        if self.per_target.len() > targets.len() {
            text += &format!("  targets with the longest gaps; all {} are in summary.json\n", self.per_target.len());
        }
        text
    }
}

/// True if `one` is better than `other` by at least the size of interest.
fn is_better(metric: &str, one: Option<f64>, other: Option<f64>) -> bool {
    let (Some(info), Some(more)) = (MetricInfo::of(metric), one.zip(other).map(|(one, other)| one - other)) else {
        return false;
    };
    match info.rated() {
        Some(WorseDirection::Large) => more < -info.interest,
        Some(WorseDirection::Small) => more > info.interest,
        None => false,
    }
}

/// Formats a value with this number of decimals.
fn number(value: Option<f64>, digits: usize, unit: &str) -> String {
    value.map_or_else(|| "-".to_owned(), |value| distinct(value, unit, format!("{value:.digits$}")))
}

#[cfg(test)]
mod tests {
    use super::number;

    #[test]
    fn a_fraction_that_is_not_quite_0_or_1_does_not_look_like_it() {
        let percent = |value| number(Some(value), 2, "%");
        assert_eq!(
            [99.994, 99.996, 100.0, 0.004, 0.006, 0.0].map(percent),
            ["99.99", ">99.99", "100.00", "<0.01", "0.01", "0.00"]
        );
        assert_eq!((number(Some(99.996), 2, "m"), number(None, 2, "%")), ("100.00".to_owned(), "-".to_owned()));
    }
}
