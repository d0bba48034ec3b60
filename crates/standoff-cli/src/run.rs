//! `standoff run`: flies a scenario into a record, and tells it.

use std::fmt::Display;
use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Parser;
use indicatif::{ProgressBar, ProgressStyle};
use standoff_sim::record::{Closed, Frame, Kept, MAX_ROWS, Occupancy, Writer, in_the_way, occupancy};
use standoff_sim::run::Mission;
use standoff_sim::scenario::{Scenario, Template};
use standoff_sim::score::Rules;
use standoff_sim::text;
use standoff_sim::world::World;
use standoff_sim::yardstick::yardstick;
use standoff_view::replay::Line;
use standoff_view::serve::{Bytes, Server};
use standoff_view::site::RunSite;

use crate::changes::{Changes, DEFAULT_SCENARIO};
use crate::failure::{Failure, note, of_record, refused, warn};
use crate::interruption::Interruption;
use crate::maps::Maps;
use crate::mcap::Mcap;
use crate::outcome::{Telling, Wanted, lines};
use crate::papers_law;
use crate::tell::{Told, tell};
use crate::watch::{Pace, Served, Watched, manifest, rate};

pub(crate) const EXAMPLES: &str = "\
Examples:
  standoff run paper/table-2-pair --seed 7
  standoff run paper/table-2-pair --set guidance.radial_gain=0.5 --out half
  standoff run tour/02-two-uavs --json | jq .metrics.position_error_m
  standoff run --traffic city.fcd.xml.gz --uavs 4
  standoff run traffic/city --view --rate 20
  standoff run --traffic city.fcd.xml.gz --map city.net.xml.gz
  standoff run traffic/city --uavs 4 --yardstick
  standoff run --mcap figure-9.mcap
  standoff run mine.toml --set uavs.count=3 --set targets.scatter.count=6";

/// What to fly, and where the results go.
#[derive(Parser)]
pub(crate) struct Args {
    /// A built-in scenario's name, or a scenario file [default: best/figure-9; with --traffic, the settings of
    /// traffic/convoy].
    scenario: Option<String>,
    #[command(flatten)]
    changes: Changes,
    /// Seed of everything random.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Folder for the results [default: standoff-out/NAME-SEED, and behind it what is changed: +KEY=VALUE].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write the mission as an MCAP file, too, for Lichtblick, Foxglove or Rerun (if built with the feature mcap).
    #[arg(long, value_name = "FILE")]
    mcap: Option<PathBuf>,
    #[command(flatten)]
    maps: Maps,
    #[command(flatten)]
    metrics: Wanted,
    /// Tell beside it what greedy discs that know where every target is would watch: see standoff yardstick.
    #[arg(long)]
    yardstick: bool,
    /// Print one JSON object instead of the table.
    #[arg(long)]
    json: bool,
    /// Serve a page that follows the run while it flies.
    #[arg(long)]
    view: bool,
    /// With --view, how many seconds of the mission are flown in a second.
    #[arg(long, value_name = "FACTOR", default_value = "1", value_parser = rate, requires = "view")]
    rate: f64,
    #[command(flatten)]
    served: Served,
}

impl Default for Args {
    fn default() -> Self {
        Self::parse_from(["run"])
    }
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    if args.served.has_address() && !args.view {
        return Err(Failure::Input("--listen is where --view serves its page: add --view".into()));
    }
    let name = args.changes.scenario(args.scenario.as_deref(), DEFAULT_SCENARIO);
    let template = Template::load(name, &args.changes.edits()?).map_err(Failure::Scenario)?;
    let scenario = template.draw(args.seed).map_err(Failure::Scenario)?;
    warn(&scenario, "");
    let rows = World::rows(&scenario);
    if rows > MAX_ROWS {
        let what = "choose a shorter duration_s, a longer period_s or fewer targets, or standoff monte-carlo, which keeps no record";
        return Err(Failure::Input(format!(
            "the record could have {rows} rows of targets; at most {MAX_ROWS}: {what}"
        )));
    }
    let out = match &args.out {
        // Without a slash at its end: a link to a folder would be followed half of the way.
        Some(out) => out.components().collect(),
        None => args.changes.folder(args.scenario.as_deref(), &template, &args.seed.to_string()),
    };
    let there = occupancy(&out);
    if there == Occupancy::Other {
        return Err(of_record(in_the_way(&out)));
    }
    let map = args.maps.of_scenario(&scenario)?;
    let interruption = Interruption::expected()?;
    let mut mcap = args.mcap.as_deref().map(|file| Mcap::create(file, &scenario, &out)).transpose()?;
    if there == Occupancy::OlderRun {
        note(&format!("note: replacing the older run in {}", text::path(&out)));
    }
    let mut live = args.view.then(|| Live::begin(args, &scenario, map.clone())).transpose()?;
    let flown = fly(&scenario, &out, map.as_ref(), &interruption, |frame| {
        mcap.iter_mut().for_each(|mcap| mcap.frame(frame));
        live.iter_mut().for_each(|live| live.frame(frame, &interruption));
    });
    let closed = match flown {
        Ok(closed) => closed,
        Err(failure) => {
            mcap.into_iter().for_each(Mcap::stop);
            return Err(failure);
        }
    };
    // If that file has failed, the record is published all the same.
    let filed = mcap.map_or(Ok(()), Mcap::close);
    // Where there is no room for figures, the record, which is complete, is published all the same.
    let (dir, place, choice) = (closed.dir().to_owned(), out.clone(), args.metrics.choice);
    let with_yardstick = args.yardstick;
    let told = interruption.unless_come(move || {
        let told = tell(&dir, &place, choice)?;
        Ok((told, with_yardstick.then(|| yardstick(&scenario))))
    });
    closed.publish().map_err(Failure::running)?;
    let (Told { mut outcome, written }, yardstick) = told.ok_or_else(|| {
        let out = text::path(&out);
        Failure::running(format!("interrupted; the run is complete in {out}: standoff show {out} tells and draws it"))
    })??;
    outcome.yardstick = yardstick;
    let papers_law =
        if args.json { None } else { papers_law::of(args.scenario.as_deref(), &args.changes, args.seed, choice)? };
    outcome.print(args.json, &out, Telling { papers_law: papers_law.as_ref(), ..Telling::default() })?;
    written?;
    let shown = live.map_or(Ok(()), |live| live.end(lines(&outcome.metrics, &outcome.settings), &interruption));
    filed.and(shown)
}

/// A run that is watched while it flies.
struct Live {
    watched: Watched,
    pace: Pace,
    /// Serves as long as it is there.
    _server: Server,
}

impl Live {
    fn begin(args: &Args, scenario: &Scenario, map: Option<Bytes>) -> Result<Self, Failure> {
        let watched = Watched::flight(scenario, true, map)?;
        let tell = |url: &str| {
            note(&format!("the run can be watched at {url}", url = url.trim_end()));
            Ok(())
        };
        let server = args.served.serve(Arc::new(RunSite::new(watched.replay(), None)), tell)?;
        Ok(Self { watched, pace: Pace::new(args.rate), _server: server })
    }

    /// Shows a frame when its time has come.
    fn frame(&mut self, frame: &Frame, interruption: &Interruption) {
        self.pace.keep(frame.time_us, interruption);
        self.watched.frame(frame);
    }

    /// Shows what the run came to until it is enough.
    fn end(self, outcome: Vec<Line>, interruption: &Interruption) -> Result<(), Failure> {
        self.watched.finish(outcome)?;
        note("the run is over; Ctrl-C ends the page");
        interruption.wait(None);
        Ok(())
    }
}

/// Flies the mission into a record; every frame is written as it comes, and `look` sees it.
///
/// Whatever ends it early, the failure says what is kept.
fn fly(
    scenario: &Scenario,
    out: &Path,
    map: Option<&Bytes>,
    interruption: &Interruption,
    mut look: impl FnMut(&Frame),
) -> Result<Closed, Failure> {
    let mut mission = Mission::new(scenario).map_err(|errors| Failure::Input(refused(&errors)))?;
    let resolved = scenario.resolved().map_err(Failure::Scenario)?;
    let names = World::names(scenario);
    let writer = Writer::create(out, &manifest(scenario), &resolved, &names).map_err(of_record)?;
    let writer = writer.judged_by(Rules::of(&scenario.settings));
    let mut writer = match map {
        Some(map) => writer.with_map(map).map_err(of_record)?,
        None => writer,
    };
    if let Some(older) = writer.set_aside() {
        note(&format!("note: an unfinished run is kept in {} until this one is complete", text::path(older)));
    }
    let progress = progress(mission.frames(), "instants");
    while !interruption.has_come() {
        let Some(frame) = mission.frame() else {
            progress.finish_and_clear();
            let kept = writer.kept();
            return writer.close().map_err(|error| broken_off(error, kept));
        };
        writer.frame(frame).map_err(|error| broken_off(error, writer.kept()))?;
        look(frame);
        progress.inc(1);
    }
    progress.finish_and_clear();
    let kept = writer.kept();
    let kept = writer.stop().map_err(|error| broken_off(error, kept))?;
    Err(broken_off("interrupted", kept))
}

/// The failure of a run that ended early, and what is left of it.
fn broken_off(error: impl Display, kept: Option<Kept>) -> Failure {
    let kept = kept.map_or_else(
        || "nothing was kept of the run".to_owned(),
        |Kept { dir, until_s }| {
            let dir = text::path(&dir);
            format!("the run is kept up to {until_s} s in {dir}, unfinished: standoff show {dir} tells it")
        },
    );
    Failure::running(format!("{error}; {kept}"))
}

/// A bar on a terminal, nothing in a pipe.
pub(crate) fn progress(of: u64, what: &str) -> ProgressBar {
    if !io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template(&format!("{{bar:40}} {{pos}}/{{len}} {what}, {{eta}} left"));
    ProgressBar::new(of).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}
