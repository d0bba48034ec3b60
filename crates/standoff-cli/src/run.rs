//! `standoff run`: flies a scenario, writes its record and prints the results.

use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};

use clap::Parser;
use indicatif::{ProgressBar, ProgressStyle};
use standoff_app::{Failure, OutcomeOptions, Report, format_errors, has_older_run, lines, report_run, warn};
use standoff_io::display_text;
use standoff_record::{FinishedRecord, Frame};
use standoff_sim::baseline::baseline;
use standoff_sim::run::Mission;
use standoff_sim::scenario::{Scenario, ScenarioTemplate};
use standoff_view::replay::Line;
use standoff_view::serve::{Bytes, Server};
use standoff_view::site;
use standoff_view::tiles::TileServer;

use crate::advise;
use crate::live_view::{LiveReplay, Pace, ServeArgs, speed};
use crate::maps::Maps;
use crate::metric_args::MetricArgs;
use crate::overrides::{DEFAULT_SCENARIO, OverrideArgs};
use crate::paper_comparison;
use crate::signals::Interruption;
use crate::terminal::{note, print_outcome};

pub(crate) const EXAMPLES: &str = "\
Examples:
  standoff run paper/table-2-pair --seed 7
  standoff run paper/table-2-pair --set guidance.radial_gain=0.5 --out half
  standoff run tour/02-two-uavs --json | jq .metrics.position_error_m
  standoff run --traffic city.fcd.xml.gz --uavs 4
  standoff run traffic/city --view --speed 20
  standoff run --traffic city.fcd.xml.gz --map city.net.xml.gz
  standoff run traffic/city --uavs 4 --baseline
  standoff run traffic/city --uavs 2 --advise
  standoff run mine.toml --set uavs.count=3 --set targets.random.count=6";

/// Options of `standoff run`.
#[derive(Parser)]
pub(crate) struct Args {
    /// The name of a built-in scenario, or a scenario file [default: improved/figure-9; with --traffic, the settings of
    /// traffic/convoy].
    scenario: Option<String>,
    #[command(flatten)]
    changes: OverrideArgs,
    /// Seed of all random numbers.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Folder for the results [default: standoff-out/NAME-SEED, followed by +KEY=VALUE for each change].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    maps: Maps,
    #[command(flatten)]
    metrics: MetricArgs,
    /// Also compute the coverage baseline: see standoff baseline.
    #[arg(long)]
    baseline: bool,
    /// Also fly the mission with a larger orbit and with more UAVs, and print the target time in custody of each.
    #[arg(long)]
    advise: bool,
    /// Print one JSON object instead of the table.
    #[arg(long, conflicts_with = "advise")]
    json: bool,
    /// Serve a page that shows the run while it flies.
    #[arg(long)]
    view: bool,
    /// With --view, the speed of the simulation relative to real time.
    #[arg(long, value_name = "FACTOR", default_value = "1", value_parser = speed, requires = "view")]
    speed: f64,
    #[command(flatten)]
    served: ServeArgs,
}

impl Default for Args {
    fn default() -> Self {
        Self::parse_from(["run"])
    }
}

/// Refuses options of the live view without it.
fn check_view(args: &Args) -> Result<(), Failure> {
    let wrong = [
        (args.served.has_address(), "--listen sets the address of the page that --view serves: add --view"),
        (args.served.has_tiles(), "--tiles adds images to the page that --view serves: add --view"),
    ];
    match wrong.into_iter().find(|(is_given, _)| *is_given && !args.view) {
        Some((_, message)) => Err(Failure::Input(message.to_owned())),
        None => Ok(()),
    }
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    check_view(args)?;
    let name = args.changes.scenario(args.scenario.as_deref(), DEFAULT_SCENARIO);
    let overrides = args.maps.with(args.changes.overrides()?);
    let template = ScenarioTemplate::load(name, &overrides).map_err(Failure::Scenario)?;
    let scenario = template.draw(args.seed).map_err(Failure::Scenario)?;
    let tiles = args.served.tiles(scenario.origin().is_some())?;
    warn(&scenario, "", &note);
    let out = match &args.out {
        // Removes a trailing slash, so that a symbolic link to a folder is recognised and refused.
        Some(out) => out.components().collect(),
        None => args.changes.folder(args.scenario.as_deref(), &template, &args.seed.to_string()),
    };
    let has_older_run = has_older_run(&scenario, &out)?;
    let map = args.maps.named().of_scenario(&scenario, &note)?;
    let interruption = Interruption::install()?;
    if has_older_run {
        note(&format!("note: replacing the older run in {}", display_text::path(&out)));
    }
    let mut live = args.view.then(|| Live::begin(args, &scenario, tiles, map.clone())).transpose()?;
    let closed = fly(&scenario, &out, map.as_ref(), &interruption, |frame| {
        live.iter_mut().for_each(|live| live.frame(frame, &interruption));
    })?;
    // The complete record is published even if there is no room for the figures.
    let (dir, place, choice) = (closed.dir().to_owned(), out.clone(), args.metrics.selection());
    let with_baseline = args.baseline;
    let (advise, uavs) = (args.advise, scenario.uavs.len());
    let report = interruption.run_interruptible(move || {
        let report = report_run(&dir, &place, choice, &note)?;
        let trials = advise.then(|| advise::trials(&template, &scenario)).transpose()?;
        Ok((report, with_baseline.then(|| baseline(&scenario)), trials))
    });
    closed.publish().map_err(Failure::running)?;
    let (Report { mut outcome, written }, baseline, trials) = report.ok_or_else(|| {
        let (shown, out) = (display_text::path(&out), display_text::shell_path(&out));
        Failure::running(format!(
            "interrupted; the run is complete in {shown}: to print its results, run standoff report {out}"
        ))
    })??;
    outcome.baseline = baseline;
    let paper_comparison = if args.json {
        None
    } else {
        paper_comparison::of(args.scenario.as_deref(), &args.changes, args.seed, choice)?
    };
    let custody = outcome.metrics.metrics["custody_fraction"];
    let advice = trials.map_or_else(String::new, |trials| advise::text(custody, uavs, &trials));
    let options =
        OutcomeOptions { paper_comparison: paper_comparison.as_ref(), advice: &advice, ..OutcomeOptions::default() };
    print_outcome(&outcome, args.json, &out, options)?;
    written?;
    live.map_or(Ok(()), |live| live.end(lines(&outcome.metrics, &outcome.settings), &interruption))
}

/// A run that a page shows while it flies.
struct Live {
    replay: LiveReplay,
    pace: Pace,
    /// Serves the page until it is dropped.
    _server: Server,
}

impl Live {
    fn begin(
        args: &Args,
        scenario: &Scenario,
        tiles: Option<&TileServer>,
        map: Option<Bytes>,
    ) -> Result<Self, Failure> {
        let replay = LiveReplay::flight(scenario, true, map)?;
        let announce = |url: &str| {
            note(&format!("live view: {url}", url = url.trim_end()));
            Ok(())
        };
        let server = args.served.serve(site::of_runs(replay.replay(), None, tiles), announce)?;
        Ok(Self { replay, pace: Pace::new(args.speed), _server: server })
    }

    /// Waits until a frame is due, then shows it.
    fn frame(&mut self, frame: &Frame, interruption: &Interruption) {
        self.pace.keep(frame.time_us, interruption);
        self.replay.frame(frame);
    }

    /// Shows the results of the run until Ctrl-C.
    fn end(self, outcome: Vec<Line>, interruption: &Interruption) -> Result<(), Failure> {
        self.replay.finish(outcome)?;
        note("the run is finished; press Ctrl-C to stop serving the page");
        interruption.wait(None);
        Ok(())
    }
}

/// Flies the mission and writes its record; calls `look` with every frame.
fn fly(
    scenario: &Scenario,
    out: &Path,
    map: Option<&Bytes>,
    interruption: &Interruption,
    mut look: impl FnMut(&Frame),
) -> Result<FinishedRecord, Failure> {
    let mut mission = Mission::new(scenario).map_err(|errors| Failure::Input(format_errors(&errors)))?;
    let progress = progress(mission.frames(), "time steps");
    let continues = || !interruption.is_interrupted();
    let record = standoff_app::fly(scenario, &mut mission, out, map, &note, continues, |frame| {
        look(frame);
        progress.inc(1);
    });
    progress.finish_and_clear();
    record
}

/// Creates a progress bar on a terminal, and a hidden one in a pipe.
pub(crate) fn progress(of: u64, what: &str) -> ProgressBar {
    if !io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template(&format!("{{bar:40}} {{pos}}/{{len}} {what}, {{eta}} left"));
    ProgressBar::new(of).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}
