//! `standoff view`: looks at runs in a browser.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread;

use clap::Parser;
use standoff_sim::record::{Frame, Record};
use standoff_sim::run::Mission;
use standoff_sim::scenario::{Scenario, Settings};
use standoff_sim::score::{Choice, Chosen, Rules, Scorer};
use standoff_view::site::RunSite;

use crate::changes::Changes;
use crate::failure::{Failure, note, print};
use crate::outcome::{Wanted, lines};
use crate::run::DEFAULT_SCENARIO;
use crate::watch::{Interruption, Served, Watched};

pub(crate) const EXAMPLES: &str = "\
Examples:
  standoff view                                   fly paper/figure-9 and look at it
  standoff view standoff-out/paper/figure-9-1     look at a run that has been flown
  standoff view best/figure-9 --seed 7            fly a scenario and look at it; no results are written
  standoff run traffic/city --view                look at a run while it flies";

/// What to look at, and where it is served.
#[derive(Parser)]
pub(crate) struct Args {
    /// The folder of a run; or a built-in scenario's name or a scenario file, which is flown [default: paper/figure-9;
    /// with --traffic, the settings of traffic/convoy].
    #[arg(value_name = "DIR|SCENARIO")]
    what: Option<String>,
    #[command(flatten)]
    changes: Changes,
    /// Seed of everything random; of a scenario.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    metrics: Wanted,
    #[command(flatten)]
    served: Served,
}

pub(crate) fn view(args: &Args) -> Result<(), Failure> {
    let shown = match args.what.as_deref().map(Path::new).filter(|path| path.is_dir()) {
        Some(dir) => record(dir, args)?,
        None => flight(args)?,
    };
    let interruption = Interruption::expected()?;
    let site = Arc::new(RunSite::new(shown.watched.replay()));
    let server = args.served.serve(site, print)?;
    note("Ctrl-C ends it.");
    // The page is there at once and fills while the run is flown or read.
    let work = thread::spawn(move || (shown.work)(shown.watched));
    interruption.wait(None);
    drop(server);
    // What is not done yet is not needed any more.
    if work.is_finished() {
        work.join().unwrap_or_else(|_| Err(Failure::running("the run could not be shown")))
    } else {
        Ok(())
    }
}

/// A replay, and what fills it.
struct Shown {
    watched: Watched,
    work: Box<dyn FnOnce(Watched) -> Result<(), Failure> + Send>,
}

/// A run that has been flown.
fn record(dir: &Path, args: &Args) -> Result<Shown, Failure> {
    if !args.changes.is_empty() {
        return Err(Failure::Input(
            "--traffic, --uavs and --set change a scenario, not a run that has been flown".into(),
        ));
    }
    let record = Record::open(dir).map_err(Failure::input)?;
    let label = dir.join("scenario.toml").display().to_string();
    let settings = Settings::of_record(&label, record.scenario_toml()).map_err(Failure::input)?;
    let watched = Watched::new(record.manifest(), &settings, record.target_names().to_vec())?;
    let choice = args.metrics.choice;
    let dir = PathBuf::from(dir);
    let work = move |watched: Watched| {
        let mut told = Told::new(watched, &settings, choice);
        for frame in record.frames().map_err(Failure::running)? {
            match frame {
                Ok(frame) => told.frame(&frame),
                Err(error) => {
                    note(&format!("error: {}: {error}; what is before can be seen", dir.display()));
                    break;
                }
            }
        }
        told.finish()
    };
    Ok(Shown { watched, work: Box::new(work) })
}

/// A run that is flown to be looked at.
fn flight(args: &Args) -> Result<Shown, Failure> {
    let name = args.changes.scenario(args.what.as_deref(), DEFAULT_SCENARIO);
    let scenario = Scenario::load(name, &args.changes.edits(), args.seed).map_err(Failure::input)?;
    scenario.warnings.iter().for_each(|warning| note(&format!("warning: {warning}")));
    let watched = Watched::flight(&scenario)?;
    let choice = args.metrics.choice;
    let work = move |watched: Watched| {
        let mut told = Told::new(watched, &scenario.settings, choice);
        let refused = |errors: Vec<standoff::ParamError>| {
            Failure::Input(errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n"))
        };
        let mut mission = Mission::new(&scenario).map_err(refused)?;
        while let Some(frame) = mission.frame() {
            told.frame(frame);
        }
        told.finish()
    };
    Ok(Shown { watched, work: Box::new(work) })
}

/// A run that is shown and scored.
struct Told {
    watched: Watched,
    scorer: Scorer,
    choice: Choice,
}

impl Told {
    fn new(watched: Watched, settings: &Settings, choice: Choice) -> Self {
        Self { watched, scorer: Scorer::new(Rules::of(settings), choice), choice }
    }

    fn frame(&mut self, frame: &Frame) {
        self.scorer.frame(frame);
        self.watched.frame(frame);
    }

    fn finish(self) -> Result<(), Failure> {
        let metrics = Chosen { metrics: self.scorer.metrics(), choice: self.choice };
        self.watched.finish(lines(&metrics))
    }
}
