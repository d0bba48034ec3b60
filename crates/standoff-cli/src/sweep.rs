//! `standoff sweep`: flies a Monte Carlo batch at each point of a grid or a Latin hypercube of scenario keys.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use clap::Parser;
use standoff_app::{Axis, Failure, LatinHypercube, Sweep, SweepResults, warn};
use standoff_io::display_text;
use standoff_sim::scenario::ScenarioTemplate;

use crate::metric_args::MetricArgs;
use crate::monte_carlo::{DEFAULT_SCENARIO, ProgressReporter};
use crate::overrides::OverrideArgs;
use crate::signals::Interruption;
use crate::terminal::{note, print};

pub(crate) const EXAMPLES: &str = "\
Examples:
  standoff sweep paper/table-2-pair --vary guidance.lead_s=0..4:5 --runs 50
                              five values, evenly spaced
  standoff sweep mine.toml --vary uavs.count=2,4 --vary sensor.range_sd_m=5,9 \\
      --runs 20               a grid of four points
  standoff sweep mine.toml --vary uavs.count=2..8 --vary uavs.speed_m_s=25..45 \\
      --points 30 --runs 20   a Latin hypercube of thirty points

After an interruption by Ctrl-C or anything else, repeat the command to resume.";

/// Options of `standoff sweep`.
#[derive(Parser)]
pub(crate) struct Args {
    /// The name of a built-in scenario, or a scenario file [default: paper/table-2-pair; with --traffic, the settings
    /// of traffic/convoy].
    scenario: Option<String>,
    /// Vary a key of the scenario over a list of values (KEY=A,B,C), evenly spaced values (KEY=FROM..TO:COUNT) or, with
    /// --points, a range (KEY=FROM..TO); may be given several times.
    #[arg(long, value_name = "KEY=VALUES", required = true, value_parser = Axis::parse)]
    vary: Vec<Axis>,
    /// Draw N points by a Latin hypercube instead of a grid of all combinations.
    #[arg(long, value_name = "N")]
    points: Option<usize>,
    /// Seed of the Latin hypercube [default: 1]. It does not affect the runs.
    #[arg(long, value_name = "N", requires = "points")]
    points_seed: Option<u64>,
    /// Number of runs of each point.
    #[arg(long, value_name = "N")]
    runs: u64,
    /// Seed of the first run of every point; each further run uses the next seed.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    changes: OverrideArgs,
    #[command(flatten)]
    metrics: MetricArgs,
    /// Number of threads [default: one per core]. It does not affect the results.
    #[arg(long, value_name = "N")]
    threads: Option<NonZeroUsize>,
    /// Folder for the results [default: standoff-out/NAME-sweep-KEYS-CHECKSUM, followed by +KEY=VALUE for each
    /// change].
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print one JSON object instead of the table.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let name = args.changes.scenario(args.scenario.as_deref(), DEFAULT_SCENARIO);
    let template = ScenarioTemplate::load(name, &args.changes.overrides()?).map_err(Failure::Scenario)?;
    let latin_hypercube = args.points.map(|points| LatinHypercube { points, seed: args.points_seed.unwrap_or(1) });
    let sweep = Sweep::new(&args.vary, latin_hypercube, &template, args.seed, args.runs, args.metrics.selection())?;
    let first = template.changed(&sweep.changes(0)).and_then(|first| first.draw(args.seed));
    warn(&first.map_err(Failure::Scenario)?, "", &note);
    let out = args.out.clone().map_or_else(|| default_out(args, &sweep, &template), Ok)?;
    let interruption = Interruption::install()?;
    let results = fly(&sweep, &out, &template, args.threads, &interruption)?;
    let text = if args.json { results.json()? } else { results.text(args.metrics.is_given(), &out) };
    print(&display_text::lines(&text))
}

/// Returns the default output folder. The same sweep gets the same folder, so that repeating the command resumes it; a
/// checksum distinguishes sweeps of the same keys.
fn default_out(args: &Args, sweep: &Sweep, template: &ScenarioTemplate) -> Result<PathBuf, Failure> {
    let keys = sweep.keys().join("-").replace('.', "-");
    let crc = crc32fast::hash(sweep.json()?.as_bytes());
    Ok(args.changes.folder(args.scenario.as_deref(), template, &format!("sweep-{keys}-{crc:08x}")))
}

fn fly(
    sweep: &Sweep,
    out: &Path,
    template: &ScenarioTemplate,
    threads: Option<NonZeroUsize>,
    interruption: &Interruption,
) -> Result<SweepResults, Failure> {
    let mut reporter = ProgressReporter::new();
    let results = sweep.fly_into(out, template, threads, interruption.flag(), |progress| reporter.print(progress));
    let done = reporter.finish();
    if results.is_ok() && done.is_none() {
        note(&format!("note: {} is already complete; no runs are flown", display_text::path(out)));
    }
    results.map_err(|failure| match failure {
        Failure::Running(message) => {
            let saved = format!("completed runs are saved in {}", display_text::path(out));
            Failure::Running(format!("{message}; {saved}: repeat the command to resume"))
        }
        other => other,
    })
}
