//! Measures how the CPU time of a time step grows with the size of the team, at ten targets per UAV, and draws it.
//!
//! `growth FIGURE STEPS UAVS...` writes an SVG file; docs/developer/benchmarks.md explains it.

use std::path::Path;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use plotters::prelude::*;
use standoff_record::{Manifest, Writer};
use standoff_score::{FrameScorer, MetricSelection, Scorer};
use standoff_sim::run::Mission;
use standoff_sim::scenario::{Overrides, ScenarioTemplate};
use standoff_sim::world::World;

const USAGE: &str = "usage: growth FIGURE STEPS UAVS...";

/// Number of targets per UAV.
const TARGETS: u32 = 10;

/// Names of the layouts, area per target in square kilometres, and colours.
const LAYOUTS: [(&str, f64, RGBColor); 2] =
    [("sparse", 1.0, RGBColor(0, 114, 178)), ("dense", 0.04, RGBColor(213, 94, 0))];

/// CPU time of this process, which other programs on the machine hardly change; elapsed time where it is not known.
fn cpu_time(start: Instant) -> Duration {
    let statistics = std::fs::read_to_string("/proc/self/schedstat").ok();
    let nanoseconds = statistics.and_then(|text| text.split(' ').next()?.parse().ok());
    nanoseconds.map_or_else(|| start.elapsed(), Duration::from_nanos)
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [figure, steps, sizes @ ..] = arguments.as_slice() else { return usage() };
    let (Ok(steps), Ok(sizes)) = (steps.parse(), sizes.iter().map(|size| size.parse()).collect()) else {
        return usage();
    };
    let sizes: Vec<u32> = sizes;
    let mut curves = Vec::new();
    for (name, area_km2, _) in LAYOUTS {
        println!(
            "| {name}: UAVs | targets | missions | drawing, s | first time step, ms | later ones, ms | of these scores, ms | longest, ms | us per target | measurements per target | record, ms |"
        );
        println!("|---|---|---|---|---|---|---|---|---|---|---|");
        let point = |uavs: &u32| (f64::from(uavs * TARGETS), measure(*uavs, area_km2, steps));
        curves.push(sizes.iter().map(point).collect::<Vec<_>>());
    }
    match draw(figure.as_ref(), &curves) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {figure}: {error}");
            ExitCode::FAILURE
        }
    }
}

fn usage() -> ExitCode {
    eprintln!("{USAGE}");
    ExitCode::from(2)
}

/// Draws the time per target over the number of targets, one curve for each layout.
fn draw(file: &Path, curves: &[Vec<(f64, f64)>]) -> Result<(), Box<dyn std::error::Error>> {
    let all = || curves.iter().flatten();
    let targets = all().map(|(targets, _)| *targets).fold((f64::INFINITY, 1.0), |(a, b), n| (n.min(a), n.max(b)));
    let highest_us = all().map(|(_, us)| *us).fold(0.0, f64::max);
    let area = SVGBackend::new(file, (640, 360)).into_drawing_area();
    area.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&area)
        .margin(12)
        .margin_right(32)
        .x_label_area_size(44)
        .y_label_area_size(56)
        .build_cartesian_2d((targets.0..targets.1).log_scale(), 0.0..1.1 * highest_us)?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .x_desc("targets (ten per UAV)")
        .y_desc("CPU time of a time step per target, us")
        .x_label_formatter(&|targets| format!("{targets:.0}"))
        .draw()?;
    for ((name, _, colour), curve) in LAYOUTS.iter().zip(curves) {
        chart
            .draw_series(LineSeries::new(curve.iter().copied(), colour.stroke_width(2)).point_size(3))?
            .label(*name)
            .legend(|(x, y)| PathElement::new([(x, y), (x + 18, y)], colour.stroke_width(2)));
    }
    chart.configure_series_labels().position(SeriesLabelPosition::UpperLeft).background_style(WHITE).draw()?;
    area.present()?;
    Ok(())
}

/// CPU times of missions of one size.
#[derive(Default)]
struct Times {
    /// Drawing the scenarios.
    drawing: Duration,
    /// First time steps.
    first: Duration,
    /// Later time steps with their scores.
    later: Duration,
    /// The scores of these.
    scoring: Duration,
    /// The records of these.
    recording: Duration,
    /// Longest of the later time steps.
    longest: Duration,
    /// Number of later time steps.
    steps: u32,
    /// Number of measurements of these.
    measurements: usize,
}

/// Flies and scores missions with targets at random places of a square, and prints a row of the table. Returns the CPU
/// time of a time step per target, us.
///
/// Small teams fly several missions, because the clock may advance only every 4 ms.
fn measure(uavs: u32, area_km2: f64, steps: u32) -> f64 {
    let targets = uavs * TARGETS;
    let missions = (1000 / uavs).clamp(1, 100);
    let mut times = Times::default();
    for seed in 1..=u64::from(missions) {
        fly(uavs, area_km2, steps, seed, &mut times);
    }
    let ms = |time: Duration| time.as_secs_f64() * 1e3;
    let mean_ms = |time: Duration| ms(time) / f64::from(times.steps.max(1));
    let us_per_target = 1e3 * mean_ms(times.later) / f64::from(targets);
    let measurements = times.measurements as f64 / f64::from(times.steps.max(1)) / f64::from(targets);
    println!(
        "| {uavs} | {targets} | {missions} | {:.2} | {:.1} | {:.2} | {:.2} | {:.1} | {us_per_target:.1} | {measurements:.2} | {:.2} |",
        times.drawing.as_secs_f64() / f64::from(missions),
        ms(times.first) / f64::from(missions),
        mean_ms(times.later),
        mean_ms(times.scoring),
        ms(times.longest),
        mean_ms(times.recording)
    );
    us_per_target
}

/// Flies and scores a mission; adds its times.
fn fly(uavs: u32, area_km2: f64, steps: u32, seed: u64, times: &mut Times) {
    let targets = uavs * TARGETS;
    let half_m = 500.0 * (f64::from(targets) * area_km2).sqrt();
    let duration_s = 0.5 * f64::from(steps);
    let text = format!(
        "duration_s = {duration_s:.1}
         [uavs]
         count = {uavs}
         [sensor]
         range_sd_m = 10
         bearing_sd_deg = 3
         [targets.random]
         count = {targets}
         x_m = {{ uniform = {{ min = {:.1}, max = {half_m:.1} }} }}
         y_m = {{ uniform = {{ min = {:.1}, max = {half_m:.1} }} }}
         vx_m_s = {{ uniform = {{ min = -8.0, max = 8.0 }} }}
         vy_m_s = {{ uniform = {{ min = -8.0, max = 8.0 }} }}",
        -half_m, -half_m
    );
    let process = Instant::now();
    let start = cpu_time(process);
    let template = ScenarioTemplate::of_toml("growth", &text, &Overrides::default(), ".".as_ref());
    let scenario = template.and_then(|template| template.draw(seed)).unwrap_or_else(|error| panic!("{error}"));
    let mut mission = Mission::new(&scenario).expect("a loaded scenario can be flown");
    times.drawing += cpu_time(process) - start;
    let mut scorer = Scorer::new(mission.score_config(), MetricSelection::standard());
    let folder = tempfile::tempdir().expect("a temporary folder");
    let manifest = Manifest::new("growth", seed, duration_s, 0.5);
    let resolved = scenario.resolved().expect("a text");
    let writer = Writer::create(&folder.path().join("run"), &manifest, &resolved, &World::names(&scenario));
    let mut columns = FrameScorer::new(mission.score_config());
    let writer = writer.expect("a new folder");
    let mut writer = writer.deriving(move |frame| columns.derived_columns(frame));
    loop {
        let start = cpu_time(process);
        let Some(frame) = mission.frame() else { break };
        let flown = cpu_time(process);
        scorer.frame(frame);
        let end = cpu_time(process);
        let took = end - start;
        writer.frame(frame).expect("space on the disk");
        if frame.time_us == 0 {
            times.first += took;
        } else {
            times.steps += 1;
            times.measurements += frame.detections.len();
            times.later += took;
            times.scoring += end - flown;
            times.recording += cpu_time(process) - end;
            times.longest = times.longest.max(took);
        }
    }
    if seed == 1 {
        let metrics = scorer.metrics();
        eprintln!(
            "{uavs} UAVs: custody {:?}, in view {:?}, separation {:?} m, violations {:?}, avoiding {:?} s, handoffs {:?}",
            metrics["custody_fraction"],
            metrics["in_view_fraction"],
            metrics["separation_min_same_altitude_m"],
            metrics["separation_violations"],
            metrics["avoidance_time_s"],
            metrics["handoffs"]
        );
    }
}
