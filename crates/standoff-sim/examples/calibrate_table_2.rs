//! Searches for what the paper does not print of Table II: the one setting that fits most of its 14 cells.
//!
//! ```text
//! cargo run --release -p standoff-sim --example calibrate_table_2              the search, some minutes
//! cargo run --release -p standoff-sim --example calibrate_table_2 -- shipped   only how well the shipped scenarios fit
//! ```
//!
//! The three scenarios `paper/table-2-{single,pair-basic,pair}` get the same values of the [`UNKNOWNS`]; what the paper
//! prints is not touched. The misfit of a setting is the sum of the squared logarithms of ours over the paper's, over
//! the cells, each ours a mean over [`SEARCH_SEEDS`], plus a price for orbits that do not exist and, with both active
//! measures, for targets out of view. A Latin hypercube covers the ranges; then the best settings are moved at random
//! by smaller and smaller steps. The best few are judged again by other seeds, since the best of many is also the
//! luckiest, and the winner is measured with 200 fresh ones. It is deterministic; two threads share the runs.
//!
//! Five searches ([`SEARCHES`]): for all cells, for the estimation's alone and for the guidance's alone, with filters
//! that know the targets' acceleration and filters that need not. What one setting for all loses is conflict.
//! `docs/calibration.md` tells what came out.

use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::{env, fmt, thread};

use standoff::math;
use standoff_sim::draws::{Draws, Stream};
use standoff_sim::run::Mission;
use standoff_sim::scenario::{Edits, ScenarioError, Template};
use standoff_sim::score::{Choice, Metrics, Rules, Scorer};

const COLUMNS: [&str; 3] = ["single", "pair-basic", "pair"];

/// A metric of a run.
type Metric = fn(&Metrics) -> Option<f64>;

/// A row of Table II: our metric, the paper's mean errors, and whether estimation or guidance makes it.
struct Row {
    name: &'static str,
    metric: Metric,
    paper: [Option<f64>; 3],
    of: Cells,
}

const ROWS: [Row; 5] = [
    Row {
        name: "position, m",
        metric: |metrics| metrics.position_error_m,
        paper: [Some(9.5227), Some(6.8615), Some(6.8570)],
        of: Cells::Estimation,
    },
    Row {
        name: "velocity, m/s",
        metric: |metrics| metrics.velocity_error_m_s,
        paper: [Some(1.6252), Some(1.2887), Some(1.2768)],
        of: Cells::Estimation,
    },
    Row {
        name: "standoff distance, m",
        metric: |metrics| metrics.standoff_tracking_error_m,
        paper: [Some(31.5984), Some(29.8649), Some(9.1261)],
        of: Cells::Guidance,
    },
    Row {
        name: "phase keeping, deg",
        metric: |metrics| metrics.phase_error_deg,
        paper: [None, Some(2.3173), Some(1.6205)],
        of: Cells::Guidance,
    },
    Row {
        name: "line of sight, deg",
        metric: |metrics| metrics.line_of_sight_deg,
        paper: [Some(15.6864), Some(15.4000), Some(14.5131)],
        of: Cells::Guidance,
    },
];

/// Which cells a search fits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Cells {
    All,
    Estimation,
    Guidance,
}

/// A value that the paper does not print: its range, and whether the range is covered in equal ratios.
struct Unknown {
    name: &'static str,
    range: Range<f64>,
    by_ratio: bool,
}

const fn unknown(name: &'static str, range: Range<f64>, by_ratio: bool) -> Unknown {
    Unknown { name, range, by_ratio }
}

/// Number of unknowns.
const N: usize = 10;

/// Ground vehicles, a run of at least one round of an orbit of 400 m, UAVs that start on orbits of the allowed radii.
const UNKNOWNS: [Unknown; N] = [
    unknown("length of the run, s", 60.0..200.0, true),
    unknown("targets' acceleration, m/s2", 0.03..0.5, true),
    unknown("filter's acceleration over targets'", 0.15..3.0, true),
    unknown("targets within +-, m", 10.0..150.0, true),
    unknown("targets' mean speed, m/s", 2.0..15.0, false),
    unknown("their velocities' sd per axis, m/s", 0.0..2.5, false),
    unknown("UAVs' ring, m", 250.0..700.0, false),
    unknown("first separation over 90 deg", 0.0..30.0, false),
    unknown("cue's position sd, m", 5.0..50.0, true),
    unknown("cue's velocity sd, m/s", 0.5..10.0, true),
];
/// Where they stand among the unknowns.
const LENGTH: usize = 0;
const FILTER_OVER_TARGETS: usize = 2;

/// One search: the cells that it fits, and the unknowns that it holds, with their values.
struct Search {
    title: &'static str,
    cells: Cells,
    held: &'static [(usize, f64)],
}

const KNOWS: (usize, f64) = (FILTER_OVER_TARGETS, 1.0);

const SEARCHES: [Search; 5] = [
    Search { title: "All cells, 100 s", cells: Cells::All, held: &[(LENGTH, 100.0)] },
    Search { title: "All cells, a filter that knows the targets", cells: Cells::All, held: &[KNOWS] },
    Search { title: "Estimation, a filter that knows the targets", cells: Cells::Estimation, held: &[KNOWS] },
    Search { title: "Guidance, a filter that knows the targets", cells: Cells::Guidance, held: &[KNOWS] },
    Search { title: "All cells, any length", cells: Cells::All, held: &[] },
];

const SEARCH_SEEDS: Range<u64> = 1..17;
const JUDGE_SEEDS: Range<u64> = 1001..1101;
const FRESH_SEEDS: Range<u64> = 2001..2201;
const FIRST: usize = 200;
const ROUNDS: usize = 9;
const MOVES_PER_ROUND: usize = 32;
const KEPT: usize = 8;
/// Per share of the time in which no orbit satisfies the constraints: a per cent costs as much as a cell that is 19 % off.
const INFEASIBLE_PRICE: f64 = 3.0;
/// Per share of the time out of view with both active measures: a thousandth costs as much as a cell that is 37 % off.
const OUT_OF_VIEW_PRICE: f64 = 100.0;

/// A point of the unit cube: the share of each unknown's range.
type Point = [f64; N];

impl Unknown {
    /// The value at a share of the range.
    fn at(&self, share: f64) -> f64 {
        let Range { start, end } = self.range;
        if self.by_ratio { start * math::exp(share * math::ln(end / start)) } else { start + share * (end - start) }
    }

    fn share(&self, value: f64) -> f64 {
        let Range { start, end } = self.range;
        if self.by_ratio { math::ln(value / start) / math::ln(end / start) } else { (value - start) / (end - start) }
    }
}

/// The unknowns' values.
fn values(point: &Point) -> [f64; N] {
    std::array::from_fn(|index| UNKNOWNS[index].at(point[index]))
}

/// The setting as the command line's `--set` takes it.
fn edits(point: &Point) -> Vec<String> {
    let [duration_s, acceleration, ratio, box_m, speed, sd, ring_m, over_deg, cue_m, cue_m_s] = values(point);
    // The direction does not matter: the ring's phase is drawn.
    let velocity = |share: f64| format!("{{ normal = {{ mean = {:.4}, sd = {sd:.4} }} }}", share * speed);
    let place = format!("{{ uniform = {{ min = {:.3}, max = {box_m:.3} }} }}", -box_m);
    vec![
        // A whole number of half seconds.
        format!("duration_s={:.1}", (2.0 * duration_s).round() / 2.0),
        format!("targets.acceleration_sd_m_s2={acceleration:.5}"),
        format!("filter.acceleration_sd_m_s2={:.6}", ratio * acceleration),
        format!("targets.scatter.x_m={place}"),
        format!("targets.scatter.y_m={place}"),
        format!("targets.scatter.vx_m_s={}", velocity(0.8)),
        format!("targets.scatter.vy_m_s={}", velocity(0.6)),
        format!("uavs.ring.radius_m={ring_m:.2}"),
        format!("uavs.ring.spacing_deg={:.3}", 90.0 + over_deg),
        format!("cue.position_sd_m={cue_m:.3}"),
        format!("cue.velocity_sd_m_s={cue_m_s:.4}"),
    ]
}

/// Over which part of a run the means go.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Part {
    Whole,
    Settled,
}

/// Every run of every column, in the order of seeds.
struct Flown([Vec<Metrics>; 3]);

fn fly(set: &[String], seeds: Range<u64>, part: Part) -> Result<Flown, ScenarioError> {
    let edits = Edits { set: set.to_vec(), ..Edits::default() };
    let choice = Choice::parse("table-2,out_of_view_fraction,infeasible_fraction").expect("names of metrics");
    let column = |name: &str| -> Result<Vec<Metrics>, ScenarioError> {
        let template = Template::load(&format!("paper/table-2-{name}"), &edits)?;
        seeds.clone().map(|seed| score(&template, seed, choice, part)).collect()
    };
    let [single, pair_basic, pair] = COLUMNS.map(column);
    Ok(Flown([single?, pair_basic?, pair?]))
}

fn score(template: &Template, seed: u64, choice: Choice, part: Part) -> Result<Metrics, ScenarioError> {
    let scenario = template.draw(seed)?;
    let mut mission = Mission::new(&scenario).expect("a checked scenario");
    let from_us = if part == Part::Settled { scenario.settings.settle.us() } else { 0 };
    let mut scorer = Scorer::new(Rules::of(&scenario.settings), choice);
    while let Some(frame) = mission.frame() {
        if frame.time_us >= from_us {
            scorer.frame(frame);
        }
    }
    Ok(scorer.metrics())
}

/// Mean over runs and half the width of its 95 % interval; `None` where there is nothing to measure.
fn mean(runs: &[Metrics], metric: Metric) -> Option<(f64, f64)> {
    let values: Vec<f64> = runs.iter().filter_map(metric).collect();
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|value| (value - mean) * (value - mean)).sum();
    (values.len() > 1).then(|| (mean, 1.96 * (squares / (n - 1.0) / n).sqrt()))
}

impl Flown {
    /// Ours over the paper's, for each cell that is wanted.
    fn ratios(&self, cells: Cells) -> Vec<f64> {
        let rows = ROWS.iter().filter(|row| cells == Cells::All || row.of == cells);
        let of_row = rows.flat_map(|row| {
            let of_column = self.0.iter().zip(row.paper);
            of_column.filter_map(|(runs, paper)| Some(mean(runs, row.metric)?.0 / paper?))
        });
        of_row.collect()
    }

    /// Sum of squared log ratios.
    fn distance(&self, cells: Cells) -> f64 {
        let logs = self.ratios(cells).into_iter().map(|ratio| math::ln(ratio.max(1e-6)));
        logs.map(|log| log * log).sum()
    }

    /// What the search makes small: the distance, and a price for what the paper says does not happen. Only with both
    /// active measures does it say that all targets stay in view.
    fn misfit(&self, cells: Cells) -> f64 {
        let share = |runs: &[Metrics], metric| mean(runs, metric).map_or(0.0, |(share, _)| share);
        let infeasible = self.0.iter().map(|runs| share(runs, |metrics| metrics.infeasible_fraction));
        let [.., pair] = &self.0;
        self.distance(cells)
            + infeasible.map(|share| INFEASIBLE_PRICE * share).sum::<f64>()
            + OUT_OF_VIEW_PRICE * share(pair, |metrics| metrics.out_of_view_fraction)
    }

    fn within(&self, share: f64) -> usize {
        self.ratios(Cells::All).into_iter().filter(|ratio| (ratio - 1.0).abs() <= share).count()
    }

    fn summary(&self) -> String {
        format!(
            "misfit {:.3} (estimation {:.3}, guidance {:.3}), {} cells within 10 %, {} within 25 %",
            self.misfit(Cells::All),
            self.distance(Cells::Estimation),
            self.distance(Cells::Guidance),
            self.within(0.1),
            self.within(0.25)
        )
    }
}

impl fmt::Display for Flown {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let cell = |runs: &Vec<Metrics>, row: &Row, paper: Option<f64>| match (mean(runs, row.metric), paper) {
            (Some((ours, half)), Some(paper)) => format!("{paper:.2} / {ours:.2} +- {half:.2} / {:.2}", ours / paper),
            _ => "-".to_owned(),
        };
        writeln!(out, "| paper / ours +- 95 % / ratio | {} |\n|---|---|---|---|", COLUMNS.join(" | "))?;
        for row in &ROWS {
            let cells: Vec<_> = self.0.iter().zip(row.paper).map(|(runs, paper)| cell(runs, row, paper)).collect();
            writeln!(out, "| {} | {} |", row.name, cells.join(" | "))?;
        }
        let beside: [(&str, Metric); 2] = [
            ("out of view, share", |metrics| metrics.out_of_view_fraction),
            ("infeasible, share", |metrics| metrics.infeasible_fraction),
        ];
        for (name, metric) in beside {
            let shares = self.0.iter().map(|runs| mean(runs, metric).map_or(0.0, |(share, _)| share));
            let shares: Vec<_> = shares.map(|share| format!("{share:.4}")).collect();
            writeln!(out, "| {name} | {} |", shares.join(" | "))?;
        }
        writeln!(out, "{}", self.summary())
    }
}

/// A setting and its misfit.
#[derive(Clone, Copy)]
struct Tried {
    point: Point,
    misfit: f64,
}

/// Tries settings, two at a time; the result is in the settings' order.
fn try_all(points: &[Point], seeds: &Range<u64>, cells: Cells) -> Result<Vec<Tried>, ScenarioError> {
    let next = AtomicUsize::new(0);
    let work = || {
        let mut done = Vec::new();
        while let Some((index, point)) = take(&next, points) {
            let misfit = fly(&edits(point), seeds.clone(), Part::Whole)?.misfit(cells);
            done.push((index, Tried { point: *point, misfit }));
        }
        Ok(done)
    };
    let halves: [Result<Vec<_>, ScenarioError>; 2] = thread::scope(|scope| {
        let threads = [scope.spawn(work), scope.spawn(work)];
        threads.map(|thread| thread.join().expect("a search thread"))
    });
    let [one, other] = halves;
    let mut tried = one?;
    tried.extend(other?);
    tried.sort_by_key(|(index, _)| *index);
    Ok(tried.into_iter().map(|(_, tried)| tried).collect())
}

/// The next setting that nobody has taken yet.
fn take<'a>(next: &AtomicUsize, points: &'a [Point]) -> Option<(usize, &'a Point)> {
    let index = next.fetch_add(1, Ordering::Relaxed);
    points.get(index).map(|point| (index, point))
}

/// The best few of a search, best first as other seeds judge them.
fn search(&Search { cells, held, .. }: &Search) -> Result<Vec<Tried>, ScenarioError> {
    let draws = Draws::new(1);
    let hold = |mut point: Point| {
        for (unknown, value) in held {
            point[*unknown] = UNKNOWNS[*unknown].share(*value);
        }
        point
    };
    let hypercube: Vec<Point> = latin_hypercube(draws).into_iter().map(hold).collect();
    let mut best = try_all(&hypercube, &SEARCH_SEEDS, cells)?;
    let mut step = 0.15;
    for round in 0..ROUNDS {
        best.sort_by(|a, b| a.misfit.total_cmp(&b.misfit));
        best.truncate(KEPT);
        let moved = (0..MOVES_PER_ROUND).map(|index| {
            let mut draw = draws.at(Stream::Scenario, index as u64, round as u64 + 1);
            let mut point = best[(draw.uniform() * KEPT as f64) as usize].point;
            for share in &mut point {
                let [normal, _] = draw.normals();
                if draw.uniform() < 0.6 {
                    *share = (*share + step * normal).clamp(0.0, 1.0);
                }
            }
            hold(point)
        });
        best.extend(try_all(&moved.collect::<Vec<_>>(), &SEARCH_SEEDS, cells)?);
        step *= 0.85;
    }
    best.sort_by(|a, b| a.misfit.total_cmp(&b.misfit));
    let few: Vec<Point> = best.iter().take(KEPT).map(|tried| tried.point).collect();
    let mut judged = try_all(&few, &JUDGE_SEEDS, cells)?;
    judged.sort_by(|a, b| a.misfit.total_cmp(&b.misfit));
    Ok(judged)
}

/// Points of which each range's every part of equal size holds one.
fn latin_hypercube(draws: Draws) -> Vec<Point> {
    let mut points = vec![[0.0; N]; FIRST];
    for unknown in 0..N {
        let mut draw = draws.at(Stream::Scenario, unknown as u64, 0);
        let mut parts: Vec<usize> = (0..FIRST).collect();
        for last in (1..FIRST).rev() {
            parts.swap(last, (draw.uniform() * (last + 1) as f64) as usize);
        }
        for (point, part) in points.iter_mut().zip(parts) {
            point[unknown] = (part as f64 + draw.uniform()) / FIRST as f64;
        }
    }
    points
}

/// Choices beside the numbers, and what the numbers are worth, one at a time.
const CHOICES: [(&str, &[&str]); 9] = [
    ("a filter that knows the targets", &["filter.acceleration_sd_m_s2=0.069"]),
    ("feedforward as printed", &["guidance.feedforward=printed"]),
    ("feedforward along what is flown", &["guidance.feedforward=flown"]),
    ("Euler steps", &["uavs.integrator=euler"]),
    ("Euler steps, feedforward as printed", &["uavs.integrator=euler", "guidance.feedforward=printed"]),
    ("margin in metres", &["orbit.margin=standard-deviations"]),
    ("cues of 20 m, 2 m/s", &["cue.position_sd_m=20", "cue.velocity_sd_m_s=2"]),
    ("60 s", &["duration_s=60"]),
    ("200 s", &["duration_s=200"]),
];

fn main() -> Result<(), ScenarioError> {
    println!("## The shipped scenarios, by the seeds {FRESH_SEEDS:?}\n\n{}", fly(&[], FRESH_SEEDS, Part::Whole)?);
    println!("With one thing changed:\n");
    for (name, change) in CHOICES {
        let set: Vec<String> = change.iter().map(|edit| (*edit).to_owned()).collect();
        println!("{name}: {}", fly(&set, FRESH_SEEDS, Part::Whole)?.summary());
    }
    println!("means from settle_s on: {}\n", fly(&[], FRESH_SEEDS, Part::Settled)?.summary());
    if env::args().any(|word| word == "shipped") {
        return Ok(());
    }
    for one in &SEARCHES {
        println!("## {}\n", one.title);
        let best = search(one)?;
        for tried in &best {
            let words: Vec<_> = values(&tried.point).iter().map(|value| format!("{value:.3}")).collect();
            println!("misfit {:.3}: {}", tried.misfit, words.join(", "));
        }
        println!("\nThe best, by the seeds {FRESH_SEEDS:?}:\n");
        for (unknown, value) in UNKNOWNS.iter().zip(values(&best[0].point)) {
            println!("{}: {value:.4}", unknown.name);
        }
        println!("\n{}", fly(&edits(&best[0].point), FRESH_SEEDS, Part::Whole)?);
    }
    Ok(())
}
