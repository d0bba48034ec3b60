//! The outcome of a run, as a table or as JSON.

mod events;
mod targets_and_limits;

use std::path::Path;

use serde::Serialize;
use standoff_sim::baseline::{CoverageBaseline, SPEED_M_S};
use standoff_sim::display_text;
use standoff_sim::scenario::Settings;
use standoff_sim::score::{MetricInfo, Metrics, SelectedMetrics, TargetScore};
use standoff_view::replay::Line;

pub(crate) use events::Events;
use events::named;
pub use events::wrapped;

/// Minimum fraction of ungrouped target time that is printed first: above it, the metrics of groups matter less.
const UNGROUPED_NOTABLE: f64 = 0.1;
/// Maximum number of targets listed in the table.
const TARGETS_SHOWN: usize = 20;

/// Metrics left out of the table: components of other metrics, or equal to others for a single run.
const HIDDEN: [&str; 7] = [
    "position_error_all_m",
    "standoff_distance_m",
    "separation_min_same_group_m",
    "position_squared_error_m2",
    "position_crlb_m2",
    "velocity_squared_error_m2_s2",
    "velocity_crlb_m2_s2",
];

/// Metrics that are printed in a comparison with the paper's law.
const BESIDE_PAPERS_LAW: [&str; 9] = [
    "custody_fraction",
    "in_view_fraction",
    "longest_out_of_view_s",
    "position_error_m",
    "standoff_error_m_settled",
    "phase_error_deg",
    "off_boresight_max_deg",
    "separation_min_same_altitude_m",
    "infeasible_fraction",
];

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
    #[serde(flatten)]
    pub(crate) events: Events,
    /// Scores of each target.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) per_target: Vec<PerTarget>,
    /// Settings of the run.
    #[serde(skip)]
    pub settings: Settings,
}

/// Scores of one target.
#[derive(Serialize)]
pub(crate) struct PerTarget {
    pub(crate) target: String,
    #[serde(flatten)]
    pub(crate) score: TargetScore,
}

/// Options for printing an outcome.
#[derive(Clone, Copy, Default)]
pub struct OutcomeOptions<'a> {
    /// Metrics of the paper's law to print next to the run's: only the most important rows are then printed.
    pub paper_comparison: Option<&'a Metrics>,
    /// True to also list the targets.
    pub per_target: bool,
}

/// Returns the rows of the table: the selected metrics that are informative, in their fixed order; fractions in
/// percent.
pub fn lines(metrics: &SelectedMetrics, settings: &Settings) -> Vec<Line> {
    // With separate values for manoeuvring and other targets, the overall consistency would hide both.
    let is_split = metrics.get("anees_manoeuvring").flatten().is_some();
    // If all groups have one UAV, or all have more, these two add nothing to `position_error_m`.
    let by_uav_count = ["position_error_single_uav_m", "position_error_multi_uav_m"];
    let is_mixed = by_uav_count.iter().all(|name| metrics.get(name).flatten().is_some());
    let is_hidden = |name: &&str| {
        HIDDEN.contains(name) || (*name == "anees" && is_split) || (by_uav_count.contains(name) && !is_mixed)
    };
    let line = |about: &MetricInfo| {
        let (unit, factor) = MetricInfo::unit(about.name);
        let value = metrics.get(about.name)?.map(|value| factor * value);
        let good = targets_and_limits::target(about.name, settings);
        Some(Line { metric: about.name, label: about.label, value, unit, target: good })
    };
    let shown = Metrics::ABOUT.iter().filter(|about| !is_hidden(&about.name));
    let lines = shown.filter_map(line);
    // These metrics have no value if no target manoeuvres, no target is lost, or all UAVs share one team state. Then
    // their rows are left out.
    let is_optional = |metric: &str| {
        ["anees_", "refound_", "refind_"].iter().any(|start| metric.starts_with(start))
            || Metrics::AGREEMENT.contains(&metric)
    };
    lines.filter(|line| line.value.is_some() || !is_optional(line.metric)).collect()
}

impl Outcome {
    /// Formats the outcome as one JSON object and a newline.
    pub fn json(&self) -> serde_json::Result<String> {
        Ok(serde_json::to_string_pretty(self)? + "\n")
    }

    /// Formats the outcome as text for the terminal, most important lines first; `out` is the folder of the results.
    pub fn text(&self, out: &Path, telling: OutcomeOptions) -> String {
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
        if let Some(traffic) = &self.traffic {
            text += &format!("traffic coordinates interpreted as {traffic}\n");
        }
        text += "\n";
        text += &self.custody();
        text += &self.baseline_rows();
        text += if text.ends_with("\n\n") { "" } else { "\n" };
        text += &self.table(telling.paper_comparison);
        let is_shown = |metric: &str| telling.paper_comparison.is_none() || BESIDE_PAPERS_LAW.contains(&metric);
        for remark in targets_and_limits::notes(&self.metrics, &self.events, &self.settings, is_shown) {
            text += &wrapped("* ", &remark);
        }
        if telling.paper_comparison.is_some() {
            text += &wrapped("* ", targets_and_limits::PAPERS_LAW);
        }
        if telling.per_target && !self.per_target.is_empty() {
            text += &self.targets_table();
        }
        let ends_s = self.per_target.iter().map(|one| (one.target.as_str(), one.score.until_s)).collect();
        text += &self.events.text(unfinished_after_s.unwrap_or(*duration_s), &ends_s);
        text + &format!("\nresults in {}\n", display_text::path(out))
    }

    /// Formats the mean number of targets in custody and in view, and the longest gap.
    fn custody(&self) -> String {
        let get = |name: &str| self.metrics.get(name).flatten();
        let Some(mean) = self.targets_mean else { return String::new() };
        let is_whole = (mean - mean.round()).abs() < 0.05;
        let total = if is_whole { format!("of {mean:.0}") } else { format!("of {mean:.2}") };
        let mut text = String::new();
        if let Some(share) = get("ungrouped_fraction").filter(|share| *share > UNGROUPED_NOTABLE) {
            text += &format!(
                "in no group   {:.2} {total} targets on average ({:.2} %): no orbit covers them\n",
                share * mean,
                100.0 * share
            );
        }
        for (label, metric, meaning) in [
            ("in custody", "custody_fraction", "in a group and in some UAV's view"),
            ("in view", "in_view_fraction", "in some UAV's view, in a group or not"),
        ] {
            if let Some(share) = get(metric) {
                let percent = 100.0 * share;
                text +=
                    &format!("{label:13} {:.2} {total} targets on average ({percent:.2} %): {meaning}\n", share * mean);
            }
        }
        if let Some(gap_s) = get("longest_out_of_view_s") {
            let is_longest = |one: &&PerTarget| gap_s > 0.0 && one.score.longest_out_of_view_s == Some(gap_s);
            let target = self.per_target.iter().find(is_longest);
            let target =
                target.map_or_else(String::new, |one| format!(", {}", display_text::printable(&named(&one.target))));
            text += &format!("longest gap   {gap_s:.1} s in no UAV's view{target}\n");
        }
        text
    }

    /// Formats the custody next to the coverage of one greedy disc per UAV, in whole percent; empty without a baseline.
    fn baseline_rows(&self) -> String {
        let Some(CoverageBaseline { all_uavs: all, .. }) = self.baseline else { return String::new() };
        let percent =
            |share: Option<f64>| share.map_or_else(|| "-".to_owned(), |share| format!("{:.0} %", 100.0 * share));
        let (custody, baseline) = (self.metrics.get("custody_fraction").flatten(), all.mover_fraction);
        let discs = count(all.discs, "greedy disc");
        let meaning = format!("{discs} with perfect knowledge of all targets, at {SPEED_M_S} m/s");
        format!("custody {}, baseline {}: {meaning}\n", percent(custody), percent(baseline))
    }

    fn table(&self, paper_comparison: Option<&Metrics>) -> String {
        let mut text = match paper_comparison {
            Some(_) => format!("{:33} {:>9} {:>12}       goal or limit\n", "metric", "this run", "paper's law*"),
            None => format!("{:36} {:>9}       goal or limit\n", "metric", "value"),
        };
        for Line { metric, value, unit, target: good, .. } in lines(&self.metrics, &self.settings) {
            let line = match paper_comparison {
                Some(_) if !BESIDE_PAPERS_LAW.contains(&metric) => continue,
                Some(paper) => {
                    let (_, factor) = MetricInfo::unit(metric);
                    let paper = paper.value(metric).map(|value| factor * value);
                    format!("{metric:33} {:>9} {:>12} {unit:5} {good}", number(value), number(paper))
                }
                None => format!("{metric:36} {:>9} {unit:5} {good}", number(value)),
            };
            text += line.trim_end();
            text += "\n";
        }
        text
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
            "target", "custody %", "in view %", "longest_out_of_view_s", "position_error_m", "anees"
        );
        for PerTarget { target, score } in &targets {
            let percent = |share: Option<f64>| number(share.map(|share| 100.0 * share));
            let manoeuvres = if score.manoeuvres { "  manoeuvres" } else { "" };
            text += &format!(
                "{:24} {:>10} {:>9} {:>13} {:>16} {:>6}{manoeuvres}\n",
                display_text::printable(&named(target)),
                percent(score.custody_fraction),
                percent(score.in_view_fraction),
                number(score.longest_out_of_view_s),
                number(score.position_error_m),
                number(score.anees)
            );
        }
        if self.per_target.len() > targets.len() {
            text += &format!("  targets with the longest gaps; all {} are in summary.json\n", self.per_target.len());
        }
        text
    }
}

fn number(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.2}"))
}

/// Formats a number with its noun: `1 UAV`, `2 UAVs`.
pub fn count(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}
