//! `standoff run`: flies a scenario into a record, and tells it.

use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};

use clap::Parser;
use indicatif::{ProgressBar, ProgressStyle};
use standoff_sim::record::{Closed, Manifest, Occupancy, Writer, occupancy};
use standoff_sim::run::Mission;
use standoff_sim::scenario::{Scenario, Settings};
use standoff_sim::world::World;

use crate::changes::Changes;
use crate::failure::{Failure, note};
use crate::outcome::Wanted;
use crate::tell::tell;

pub(crate) const EXAMPLES: &str = "\
Examples:
  standoff run paper/table-2-pair --seed 7
  standoff run paper/table-2-pair --set guidance.radial_gain=0.5 --out half
  standoff run tour/02-two-uavs --json | jq .metrics.position_error_m
  standoff run --traffic city.fcd.xml.gz --uavs 4
  standoff run mine.toml --set uavs.count=3 --set targets.scatter.count=6";

/// What to fly, and where the results go.
#[derive(Parser)]
pub(crate) struct Args {
    /// A built-in scenario's name, or a scenario file [default: paper/figure-9; with --traffic, the settings of
    /// traffic/convoy].
    scenario: Option<String>,
    #[command(flatten)]
    changes: Changes,
    /// Seed of everything random.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Folder for the results [default: standoff-out/NAME-SEED].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    metrics: Wanted,
    /// Print one JSON object instead of the table.
    #[arg(long)]
    json: bool,
}

/// What is flown if nothing is named.
const DEFAULT_SCENARIO: &str = "paper/figure-9";

impl Default for Args {
    fn default() -> Self {
        Self::parse_from(["run"])
    }
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let name = args.changes.scenario(args.scenario.as_deref(), DEFAULT_SCENARIO);
    let scenario = Scenario::load(name, &args.changes.edits(), args.seed).map_err(Failure::input)?;
    for warning in &scenario.warnings {
        note(&format!("warning: {warning}"));
    }
    let out = match &args.out {
        Some(out) => out.clone(),
        None => Path::new("standoff-out").join(format!("{}-{}", scenario.name, scenario.seed)),
    };
    match occupancy(&out) {
        Occupancy::Free => {}
        Occupancy::OlderRun => note(&format!("note: replacing the older run in {}", out.display())),
        Occupancy::Other => {
            let what = "holds something other than a run; choose another folder with --out";
            return Err(Failure::Input(format!("{}: {what}", out.display())));
        }
    }
    let closed = fly(&scenario, &out)?;
    let outcome = tell(closed.dir(), closed.dir(), args.metrics.choice)?;
    closed.publish().map_err(Failure::running)?;
    outcome.print(args.json, &out)
}

/// Flies the mission into a record; every frame is written as it comes.
fn fly(scenario: &Scenario, out: &Path) -> Result<Closed, Failure> {
    let Settings { duration, period, .. } = scenario.settings;
    let manifest = Manifest::new(&scenario.name, scenario.seed, duration.s(), period.s());
    let manifest = Manifest { origin: scenario.origin(), ..manifest };
    let mut mission = Mission::new(scenario)
        .map_err(|errors| Failure::Input(errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")))?;
    let resolved = scenario.resolved().map_err(Failure::input)?;
    let mut writer = Writer::create(out, &manifest, &resolved).map_err(Failure::running)?;
    let progress = progress(mission.frames());
    while let Some(frame) = mission.frame() {
        writer.frame(frame).map_err(Failure::running)?;
        progress.inc(1);
    }
    progress.finish_and_clear();
    writer.close(&World::names(scenario)).map_err(Failure::running)
}

/// A bar on a terminal, nothing in a pipe.
fn progress(frames: u64) -> ProgressBar {
    if !io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let style = ProgressStyle::with_template("{bar:40} {pos}/{len} instants, {eta} left");
    ProgressBar::new(frames).with_style(style.unwrap_or_else(|_| ProgressStyle::default_bar()))
}
