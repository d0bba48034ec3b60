//! The outcome of a run: a table for people, a JSON object for programs.

mod events;
mod goals;

use std::path::Path;

use serde::Serialize;
use standoff_sim::scenario::Settings;
use standoff_sim::score::{About, Chosen, Metrics, TargetScore};
use standoff_sim::text;
use standoff_sim::yardstick::{SPEED_M_S, Yardstick};
use standoff_view::replay::Line;

pub(crate) use events::Events;
use events::named;
pub use events::wrapped;

/// Time in no group that stands first, because it outweighs whatever is said of groups.
const UNCOVERED: f64 = 0.1;
/// Targets that are told one by one.
const TARGETS_SHOWN: usize = 20;

/// Metrics that say little to who flies one run: what others are made of, or come to here.
const UNTOLD: [&str; 7] = [
    "position_error_all_m",
    "standoff_distance_m",
    "separation_min_group_m",
    "position_squared_error_m2",
    "position_bound_m2",
    "velocity_squared_error_m2_s2",
    "velocity_bound_m2_s2",
];

/// What is told of a run beside the paper's law.
const BESIDE_PAPERS_LAW: [&str; 9] = [
    "watched_fraction",
    "seen_fraction",
    "longest_gap_s",
    "position_error_m",
    "standoff_error_m_settled",
    "phase_error_deg",
    "line_of_sight_max_deg",
    "separation_min_layer_m",
    "infeasible_fraction",
];

/// What a run came to.
#[derive(Serialize)]
pub struct Outcome {
    pub(crate) scenario: String,
    pub(crate) seed: u64,
    pub(crate) duration_s: f64,
    /// The instant at which an unfinished run breaks off.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) unfinished_after_s: Option<f64>,
    pub(crate) uavs: usize,
    pub(crate) targets: usize,
    /// What the coordinates of its traffic file were taken for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) traffic: Option<String>,
    /// How many there were at a time, on average.
    pub(crate) targets_mean: Option<f64>,
    /// What was measured.
    pub metrics: Chosen,
    /// What greedy discs would watch, if asked for: it is of the scenario, so that no summary of a record has it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub yardstick: Option<Yardstick>,
    #[serde(flatten)]
    pub(crate) events: Events,
    /// How each target fared.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub(crate) per_target: Vec<PerTarget>,
    /// What was flown.
    #[serde(skip)]
    pub settings: Settings,
}

/// How a target fared.
#[derive(Serialize)]
pub(crate) struct PerTarget {
    pub(crate) target: String,
    #[serde(flatten)]
    pub(crate) score: TargetScore,
}

/// How an outcome is told to people.
#[derive(Clone, Copy, Default)]
pub struct Telling<'a> {
    /// Beside it, what the paper's law came to: a few rows.
    pub papers_law: Option<&'a Metrics>,
    /// Target by target, too.
    pub per_target: bool,
}

/// The rows of the table: metrics that were chosen and that tell something, in their own order; shares in percent.
pub fn lines(metrics: &Chosen, settings: &Settings) -> Vec<Line> {
    // Where consistency is told of quiet and of manoeuvring targets, its average hides both.
    let is_split = metrics.get("anees_manoeuvring").flatten().is_some();
    // Where all groups have one UAV, or all have more, position errors are told already.
    let by_crew = ["position_error_one_m", "position_error_more_m"];
    let is_mixed = by_crew.iter().all(|name| metrics.get(name).flatten().is_some());
    let untold =
        |name: &&str| UNTOLD.contains(name) || (*name == "anees" && is_split) || (by_crew.contains(name) && !is_mixed);
    let line = |about: &About| {
        let (unit, factor) = About::unit(about.name);
        let value = metrics.get(about.name)?.map(|value| factor * value);
        let good = goals::good(about.name, settings);
        Some(Line { metric: about.name, words: about.words, value, unit, good })
    };
    let told = Metrics::ABOUT.iter().filter(|about| !untold(&about.name));
    let lines = told.filter_map(line);
    // That nothing manoeuvres, nothing was lost, or one mind knows for all, needs no row.
    let needs_none = |metric: &str| {
        ["anees_", "refound_", "refind_"].iter().any(|start| metric.starts_with(start))
            || Metrics::AGREEMENT.contains(&metric)
    };
    lines.filter(|line| line.value.is_some() || !needs_none(line.metric)).collect()
}

impl Outcome {
    /// One JSON object and a newline.
    pub fn json(&self) -> serde_json::Result<String> {
        Ok(serde_json::to_string_pretty(self)? + "\n")
    }

    /// What a person wants to know, first things first; the results are in `out`.
    pub fn told(&self, out: &Path, telling: Telling) -> String {
        let Self { scenario, seed, duration_s, unfinished_after_s, uavs, targets, targets_mean, .. } = self;
        let end = unfinished_after_s.map_or_else(String::new, |end_s| format!(", unfinished after {end_s} s"));
        // Of vehicles that come and go there are never so many at once as in all.
        let at_a_time = targets_mean.filter(|mean| (mean - *targets as f64).abs() > 0.05);
        let at_a_time = at_a_time.map_or_else(String::new, |mean| format!(" ({mean:.1} at a time)"));
        let mut told = format!(
            "{}, seed {seed}: {}, {}{at_a_time}, {duration_s} s{end}\n",
            text::words(scenario),
            count(*uavs, "UAV"),
            count(*targets, "target")
        );
        if let Some(traffic) = &self.traffic {
            told += &format!("coordinates of the traffic taken for {traffic}\n");
        }
        told += "\n";
        told += &self.custody();
        told += &self.beside_yardstick();
        told += if told.ends_with("\n\n") { "" } else { "\n" };
        told += &self.table(telling.papers_law);
        let is_told = |metric: &str| telling.papers_law.is_none() || BESIDE_PAPERS_LAW.contains(&metric);
        for word in goals::words(&self.metrics, &self.events, &self.settings, is_told) {
            told += &wrapped("* ", &word);
        }
        if telling.papers_law.is_some() {
            told += &wrapped("* ", goals::PAPERS_LAW);
        }
        if telling.per_target && !self.per_target.is_empty() {
            told += &self.targets_told();
        }
        let ends_s = self.per_target.iter().map(|one| (one.target.as_str(), one.score.until_s)).collect();
        told += &self.events.told(unfinished_after_s.unwrap_or(*duration_s), &ends_s);
        told + &format!("\nresults in {}\n", text::path(out))
    }

    /// Of how many vehicles how many are watched and seen, and the longest gap.
    fn custody(&self) -> String {
        let get = |name: &str| self.metrics.get(name).flatten();
        let Some(mean) = self.targets_mean else { return String::new() };
        let is_whole = (mean - mean.round()).abs() < 0.05;
        let of = if is_whole { format!("of {mean:.0}") } else { format!("of {mean:.2}") };
        let mut told = String::new();
        if let Some(share) = get("uncovered_fraction").filter(|share| *share > UNCOVERED) {
            told += &format!(
                "in no group   {:.2} {of} targets on average ({:.2} %): no orbit is flown about them\n",
                share * mean,
                100.0 * share
            );
        }
        for (what, metric, words) in [
            ("watched", "watched_fraction", "in a group and in some UAV's view"),
            ("seen", "seen_fraction", "in some UAV's view, in a group or not"),
        ] {
            if let Some(share) = get(metric) {
                let percent = 100.0 * share;
                told += &format!("{what:13} {:.2} {of} targets on average ({percent:.2} %): {words}\n", share * mean);
            }
        }
        if let Some(gap_s) = get("longest_gap_s") {
            let longest = |one: &&PerTarget| gap_s > 0.0 && one.score.longest_gap_s == Some(gap_s);
            let whose = self.per_target.iter().find(longest);
            let whose = whose.map_or_else(String::new, |one| format!(", {}", text::words(&named(&one.target))));
            told += &format!("longest gap   {gap_s:.1} s in no UAV's view{whose}\n");
        }
        told
    }

    /// What was watched beside what as many discs as UAVs would, whole percent; nothing if it was not asked for.
    fn beside_yardstick(&self) -> String {
        let Some(Yardstick { all, .. }) = self.yardstick else { return String::new() };
        let percent =
            |share: Option<f64>| share.map_or_else(|| "-".to_owned(), |share| format!("{:.0} %", 100.0 * share));
        let (watched, yardstick) = (self.metrics.get("watched_fraction").flatten(), all.mover_fraction);
        let know = if all.discs == 1 { "knows" } else { "know" };
        let discs = count(all.discs, "greedy disc");
        let what = format!("{discs} that {know} where every target is, at {SPEED_M_S} m/s");
        format!("watched {}, yardstick {}: {what}\n", percent(watched), percent(yardstick))
    }

    fn table(&self, papers_law: Option<&Metrics>) -> String {
        let mut told = match papers_law {
            Some(_) => format!("{:33} {:>9} {:>12}       good is\n", "metric", "this run", "paper's law*"),
            None => format!("{:36} {:>9}       good is\n", "metric", "value"),
        };
        for Line { metric, value, unit, good, .. } in lines(&self.metrics, &self.settings) {
            let line = match papers_law {
                Some(_) if !BESIDE_PAPERS_LAW.contains(&metric) => continue,
                Some(paper) => {
                    let (_, factor) = About::unit(metric);
                    let paper = paper.value(metric).map(|value| factor * value);
                    format!("{metric:33} {:>9} {:>12} {unit:5} {good}", number(value), number(paper))
                }
                None => format!("{metric:36} {:>9} {unit:5} {good}", number(value)),
            };
            told += line.trim_end();
            told += "\n";
        }
        told
    }

    /// Target by target: all of them, or those with the longest gaps.
    fn targets_told(&self) -> String {
        let mut targets: Vec<&PerTarget> = self.per_target.iter().collect();
        let gap_s = |one: &PerTarget| one.score.longest_gap_s.unwrap_or(0.0);
        if targets.len() > TARGETS_SHOWN {
            targets.sort_by(|a, b| gap_s(b).total_cmp(&gap_s(a)));
            targets.truncate(TARGETS_SHOWN);
        }
        let mut told = format!(
            "\n{:24} {:>10} {:>8} {:>13} {:>16} {:>6}\n",
            "target", "watched %", "seen %", "longest_gap_s", "position_error_m", "anees"
        );
        for PerTarget { target, score } in &targets {
            let percent = |share: Option<f64>| number(share.map(|share| 100.0 * share));
            let manoeuvres = if score.manoeuvres { "  manoeuvres" } else { "" };
            told += &format!(
                "{:24} {:>10} {:>8} {:>13} {:>16} {:>6}{manoeuvres}\n",
                text::words(&named(target)),
                percent(score.watched_fraction),
                percent(score.seen_fraction),
                number(score.longest_gap_s),
                number(score.position_error_m),
                number(score.anees)
            );
        }
        if self.per_target.len() > targets.len() {
            told += &format!("  those with the longest gaps; all {} in summary.json\n", self.per_target.len());
        }
        told
    }
}

fn number(value: Option<f64>) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.2}"))
}

/// `1 UAV`, `2 UAVs`.
pub fn count(n: usize, what: &str) -> String {
    format!("{n} {what}{}", if n == 1 { "" } else { "s" })
}
