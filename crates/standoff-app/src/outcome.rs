//! The outcome of a run, as text for a terminal or as JSON.

mod events;
mod targets_and_limits;

use std::path::Path;

use serde::Serialize;
use standoff_io::display_text::{self, count, shell_path, wrapped};
use standoff_score::{MetricInfo, MetricSelection, Metrics, SelectedMetrics, TargetScore};
use standoff_sim::baseline::{CoverageBaseline, SPEED_M_S};
use standoff_sim::scenario::Settings;
use standoff_view::replay::Line;

pub(crate) use events::Events;
use events::named;

/// Minimum fraction of ungrouped target time that is explained.
const UNGROUPED_NOTABLE: f64 = 0.1;
/// Maximum number of targets listed in the table.
const TARGETS_SHOWN: usize = 20;

/// Metrics left out of the table unless the user names them: components of other metrics, or nearly equal to others.
const HIDDEN: [&str; 11] = [
    "position_error_all_m",
    "standoff_distance_m",
    "standoff_error_m_settled",
    "standoff_error_own_estimate_m_settled",
    "standoff_error_unfiltered_m_settled",
    "turn_rate_saturated_fraction_settled",
    "separation_min_same_group_m",
    "position_squared_error_m2",
    "position_crlb_m2",
    "velocity_squared_error_m2_s2",
    "velocity_crlb_m2_s2",
];

/// Metrics that are printed in a comparison with the paper's law.
const PAPER_COMPARISON: [&str; 9] = [
    "custody_fraction",
    "in_view_fraction",
    "longest_out_of_view_s",
    "position_error_m",
    "standoff_error_on_orbit_m",
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
    /// Metrics of the paper's law to print next to the run's: only the most important rows are then printed.
    pub paper_comparison: Option<&'a Metrics>,
    /// True to also list the targets.
    pub per_target: bool,
    /// Maximum length of explanations and events, characters. The table needs 80.
    pub width: usize,
}

impl Default for OutcomeOptions<'_> {
    fn default() -> Self {
        Self { paper_comparison: None, per_target: false, width: display_text::WIDTH }
    }
}

/// Returns the rows of the table: the selected metrics that are informative, in their fixed order; fractions in
/// percent.
pub fn lines(metrics: &SelectedMetrics, settings: &Settings) -> Vec<Line> {
    // With separate values for manoeuvring and other targets, the overall consistency would hide both.
    let is_split = metrics.get("anees_manoeuvring").flatten().is_some();
    // If all groups have one UAV, or all have more, these two add nothing to `position_error_m`.
    let by_uav_count = ["position_error_single_uav_m", "position_error_multi_uav_m"];
    let is_mixed = by_uav_count.iter().all(|name| metrics.get(name).flatten().is_some());
    let is_set = [MetricSelection::standard(), MetricSelection::all()].contains(&metrics.choice);
    let is_hidden = |name: &&str| {
        (is_set && HIDDEN.contains(name))
            || (*name == "anees" && is_split)
            || (by_uav_count.contains(name) && !is_mixed)
    };
    // A row without a value is shown only if the user selected the metric.
    let is_standard = metrics.choice == MetricSelection::standard();
    let line = |info: &MetricInfo| {
        let (unit, factor) = MetricInfo::unit(info.name);
        let value = metrics.get(info.name)?.map(|value| factor * value);
        let is_off = is_standard && (value.is_none() || is_feature_off(info.name, value, settings));
        let target = targets_and_limits::target(info.name, settings);
        (!is_off).then_some(Line { metric: info.name, label: info.label, value, unit, target })
    };
    MetricInfo::all().iter().filter(|info| !is_hidden(&info.name)).filter_map(line).collect()
}

/// True for metrics of collision avoidance if the scenario does not use it and no violation occurred.
fn is_feature_off(metric: &str, value: Option<f64>, settings: &Settings) -> bool {
    let is_avoidance = ["separation_violations", "avoidance_time_s"].contains(&metric);
    is_avoidance && settings.team.separation.is_none() && value == Some(0.0)
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
        let ends_s = self.per_target.iter().map(|one| (one.target.as_str(), one.score.until_s)).collect();
        text += &self.events.text(unfinished_after_s.unwrap_or(*duration_s), &ends_s, options.width);
        let (dir, page) = (shell_path(out), out.join("report.html"));
        text += &format!("\nresults in {dir}\nnext:\n");
        // A read-only record may have no page.
        if page.is_file() {
            text += &format!("  open {}  (replays the run in a browser)\n", shell_path(&page));
        }
        text + &format!("  standoff view {dir}  (serves the replay with every time step)\n")
    }

    /// Formats the metrics as a table with one section per topic, with lines that explain values below their row.
    fn table(&self, paper_comparison: Option<&Metrics>, width: usize) -> String {
        let paper_heading = if paper_comparison.is_some() { "  paper's law*" } else { "" };
        let mut text = format!("\n{:49} {:>9}{paper_heading}        goal or limit\n", "", "this run");
        let remarks = targets_and_limits::remarks(&self.metrics, &self.events, &self.settings);
        let mut section = "";
        for line in lines(&self.metrics, &self.settings) {
            let Some(info) = MetricInfo::of(line.metric) else { continue };
            if paper_comparison.is_some() && !PAPER_COMPARISON.contains(&line.metric) {
                continue;
            }
            if info.section != section {
                section = info.section;
                text += &format!("{section}\n");
            }
            let Line { label, value, unit, target, .. } = &line;
            let digits = if info.is_count { 0 } else { 2 };
            let mut row = format!("  {label:47} {:>9}", number(*value, digits, unit));
            if let Some(paper) = paper_comparison {
                let (_, factor) = MetricInfo::unit(line.metric);
                row += &format!("{:>14}", number(paper[line.metric].map(|value| factor * value), digits, unit));
            }
            row += &format!(" {unit:6} {target}");
            text += row.trim_end();
            text += "\n";
            let baseline = self.baseline_text().filter(|_| line.metric == "custody_fraction");
            let own = remarks.iter().filter(|(metric, _)| *metric == line.metric).map(|(_, remark)| remark.clone());
            for explanation in self.explanation(line.metric).into_iter().chain(baseline).chain(own) {
                text += &wrapped("      ", &explanation, width);
            }
        }
        text
    }

    /// Returns the line that explains the value of a metric.
    fn explanation(&self, metric: &str) -> Option<String> {
        let value = self.metrics.get(metric).flatten();
        let meaning = targets_and_limits::meaning(metric, value?, &self.settings);
        match metric {
            "custody_fraction" | "in_view_fraction" => {
                Some(meaning? + &self.of_targets(value).map_or_else(String::new, |n| format!(": {n}")))
            }
            "ungrouped_fraction" => {
                let ungrouped = self.of_targets(value.filter(|share| *share > UNGROUPED_NOTABLE))?;
                Some(format!("{ungrouped} are in no group: no orbit covers them"))
            }
            "longest_out_of_view_s" => {
                let gap_s = value.filter(|gap_s| *gap_s > 0.0)?;
                let longest = self.per_target.iter().find(|one| one.score.longest_out_of_view_s == Some(gap_s))?;
                Some(display_text::printable(&named(&longest.target)))
            }
            _ => meaning,
        }
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
            text += &format!(
                "{:24} {:>10} {:>9} {:>13} {:>16} {:>6}{manoeuvres}\n",
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

/// Formats a value. A fraction that is not quite 0 or 1 does not look like it.
fn number(value: Option<f64>, digits: usize, unit: &str) -> String {
    let Some(value) = value else { return "-".to_owned() };
    match format!("{value:.digits$}") {
        text if unit == "%" && value < 100.0 && text == "100.00" => ">99.99".to_owned(),
        text if unit == "%" && value > 0.0 && text == "0.00" => "<0.01".to_owned(),
        text => text,
    }
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
