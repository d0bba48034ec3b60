//! `standoff run`: flies a scenario into a record, and tells it.

use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Parser;
use indicatif::{ProgressBar, ProgressStyle};
use standoff_results::{Failure, Telling, Told, has_older_run, lines, refused, tell, warn};
use standoff_sim::record::{Closed, Frame};
use standoff_sim::run::Mission;
use standoff_sim::scenario::{Scenario, Template};
use standoff_sim::score::Choice;
use standoff_sim::text;
use standoff_sim::yardstick::yardstick;
use standoff_view::replay::Line;
use standoff_view::serve::{Bytes, Server};
use standoff_view::site::RunSite;

use crate::changes::{Changes, DEFAULT_SCENARIO};
use crate::interruption::Interruption;
use crate::maps::Maps;
use crate::mcap::Mcap;
use crate::papers_law;
use crate::speech::{note, print_outcome};
use crate::wanted::Wanted;
use crate::watch::{Pace, Served, Watched, rate};

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
    warn(&scenario, "", &note);
    let out = match &args.out {
        // Without a slash at its end: a link to a folder would be followed half of the way.
        Some(out) => out.components().collect(),
        None => args.changes.folder(args.scenario.as_deref(), &template, &args.seed.to_string()),
    };
    let has_older_run = has_older_run(&scenario, &out)?;
    let map = args.maps.named().of_scenario(&scenario, &note)?;
    let interruption = Interruption::expected()?;
    let mut mcap = args.mcap.as_deref().map(|file| Mcap::create(file, &scenario, &out)).transpose()?;
    if has_older_run {
        note(&format!("note: replacing the older run in {}", text::path(&out)));
    }
    let mut live = args.view.then(|| Live::begin(args, &scenario, map.clone())).transpose()?;
    let flown = fly(&scenario, args.metrics.choice, &out, map.as_ref(), &interruption, |frame| {
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
        let told = tell(&dir, &place, choice, &note)?;
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
    print_outcome(&outcome, args.json, &out, Telling { papers_law: papers_law.as_ref(), ..Telling::default() })?;
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

/// Flies the mission into a record; `look` sees every frame.
fn fly(
    scenario: &Scenario,
    choice: Choice,
    out: &Path,
    map: Option<&Bytes>,
    interruption: &Interruption,
    mut look: impl FnMut(&Frame),
) -> Result<Closed, Failure> {
    let mut mission = Mission::scored_by(scenario, choice).map_err(|errors| Failure::Input(refused(&errors)))?;
    let progress = progress(mission.frames(), "instants");
    let go_on = || !interruption.has_come();
    let flown = standoff_results::fly(scenario, &mut mission, out, map, &note, go_on, |frame| {
        look(frame);
        progress.inc(1);
    });
    progress.finish_and_clear();
    flown
}

/// A bar on a terminal, nothing in a pipe.
pub(crate) fn progress(of: u64, what: &str) -> ProgressBar {
    if !io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template(&format!("{{bar:40}} {{pos}}/{{len}} {what}, {{eta}} left"));
    ProgressBar::new(of).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}
