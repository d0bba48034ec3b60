//! `standoff view`: looks at runs in a browser.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread;

use clap::Parser;
use standoff_results::{Failure, lines, of_batch, of_record, refused, settings_of, tell_end, warn};
use standoff_sim::disk;
use standoff_sim::monte_carlo::Results;
use standoff_sim::record::{Frame, Record};
use standoff_sim::run::Mission;
use standoff_sim::scenario::{Scenario, Settings, built_in, built_in_like};
use standoff_sim::score::{Choice, Chosen, Rules, Scorer};
use standoff_sim::text;
use standoff_view::batch::Batch;
use standoff_view::site::{BatchSite, RunSite};

use crate::changes::{Changes, DEFAULT_SCENARIO};
use crate::interruption::Interruption;
use crate::maps::Maps;
use crate::speech::{no_thread, note, print, told};
use crate::wanted::Wanted;
use crate::watch::{Served, Watched};

pub(crate) const EXAMPLES: &str = "\
Examples:
  standoff view                                   fly figure 9, look at it
  standoff view standoff-out/best/figure-9-1      look at a run
  standoff view best/figure-9 --seed 7            fly it; write nothing
  standoff view paper/figure-9 best/figure-9      look at two runs side by side
  standoff view standoff-out/batch                look at many runs
  standoff view batch-a batch-b                   compare batches
  standoff view mine-1 --map town.net.xml.gz      with its roads
  standoff run traffic/city --view                look while it flies";

/// What to look at, and where it is served.
#[derive(Parser)]
pub(crate) struct Args {
    /// The folder of a run; or a built-in scenario's name or a scenario file, which is flown [default: best/figure-9; with
    /// --traffic, the settings of traffic/convoy]; two of these are shown side by side. Or the folder of the runs of a
    /// standoff monte-carlo; several of these are compared.
    #[arg(value_name = "DIR|SCENARIO")]
    what: Vec<String>,
    #[command(flatten)]
    changes: Changes,
    /// Seed of everything random; of a scenario [default: 1].
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    #[command(flatten)]
    maps: Maps,
    #[command(flatten)]
    metrics: Wanted,
    #[command(flatten)]
    served: Served,
}

pub(crate) fn view(args: &Args) -> Result<(), Failure> {
    let dirs: Vec<&Path> = args.what.iter().map(Path::new).collect();
    let is_run = |dir: &Path| dir.join("run.json").exists() || !dir.is_dir();
    match dirs[..] {
        [] => show(flight(None, args)?, None, args),
        [one] if is_run(one) => show(run(one, args)?, None, args),
        [one, other] if is_run(one) && is_run(other) => show(run(one, args)?, Some(run(other, args)?), args),
        _ if dirs.iter().any(|dir| is_run(dir)) => {
            let message = "a run is shown alone, or beside one other run; the folders of a standoff monte-carlo are \
                           compared with one another, any number of them";
            Err(Failure::Input(message.to_owned()))
        }
        _ => batches(&dirs, args),
    }
}

/// A run that has been flown, or one that will be.
fn run(what: &Path, args: &Args) -> Result<Shown, Failure> {
    if what.join("run.json").exists() { record(what, args) } else { flight(what.to_str(), args) }
}

/// Shows a run, or two, from the moment they are begun to be flown or read.
fn show(first: Shown, second: Option<Shown>, args: &Args) -> Result<(), Failure> {
    let site = RunSite::new(first.watched.replay(), second.as_ref().map(|shown| shown.watched.replay()));
    let interruption = Interruption::expected()?;
    let server = args.served.serve(Arc::new(site), print)?;
    note("Ctrl-C ends it.");
    let begin = |shown: Shown| {
        let work = move || (shown.work)(shown.watched).map_err(|failure| told(&failure));
        thread::Builder::new().spawn(work).map_err(no_thread)
    };
    let works = [Some(first), second].into_iter().flatten().map(begin).collect::<Result<Vec<_>, _>>()?;
    interruption.wait(None);
    drop(server);
    // What is not done yet is not needed any more.
    let mut done = works.into_iter().filter(|work| work.is_finished());
    let are_shown = done.all(|work| work.join().is_ok_and(|done| done.is_ok()));
    if are_shown { Ok(()) } else { Err(Failure::running("the run could not be shown as a whole")) }
}

/// Many runs, any of which is flown again when somebody wants to see it.
fn batches(dirs: &[&Path], args: &Args) -> Result<(), Failure> {
    let traffic = args.changes.only_traffic().filter(|_| args.seed.is_none()).ok_or_else(|| {
        Failure::Input("--uavs, --set and --seed are for a scenario, not for runs that have been flown".to_owned())
    })?;
    let results = dirs.iter().map(|dir| Results::open(dir)).collect::<Result<Vec<_>, _>>().map_err(of_batch)?;
    let batch = Batch::of(&results).map_err(of_batch)?;
    let template = |results: &Results| {
        let template = results.batch().template(traffic);
        template.inspect_err(|error| note(&format!("warning: its runs cannot be replayed: {error}"))).ok()
    };
    let templates: Vec<_> = results.iter().map(template).collect();
    let (choice, maps) = (args.metrics.choice, args.maps.named());
    let fly = move |variant: usize, seed: u64| {
        let scenario = templates.get(variant)?.as_ref()?.draw(seed).ok()?;
        // A run can be looked at without, too.
        let map = maps.of_scenario(&scenario, &note).unwrap_or_else(|failure| {
            failure.warning().iter().for_each(|warning| note(warning));
            None
        });
        let watched = Watched::flight(&scenario, false, map).ok()?;
        let replay = watched.replay();
        fly(&scenario, watched, choice).ok()?;
        Some(replay)
    };
    let interruption = Interruption::expected()?;
    let site = BatchSite::new(&batch, fly).map_err(Failure::running)?;
    let _server = args.served.serve(Arc::new(site), print)?;
    note("Ctrl-C ends it.");
    interruption.wait(None);
    Ok(())
}

/// A replay, and what fills it.
struct Shown {
    watched: Watched,
    work: Box<dyn FnOnce(Watched) -> Result<(), Failure> + Send>,
}

/// A run that has been flown.
fn record(dir: &Path, args: &Args) -> Result<Shown, Failure> {
    if !args.changes.is_empty() || args.seed.is_some() {
        return Err(Failure::Input(
            "--traffic, --uavs, --set and --seed are for a scenario, not for a run that has been flown".into(),
        ));
    }
    let record = Record::open(dir).map_err(of_record)?;
    tell_end(&record, &note);
    let settings = settings_of(&record)?;
    let map = args.maps.named().of_record(&record, &note)?;
    let watched = Watched::new(record.manifest(), &settings, record.target_names().to_vec(), false, map)?;
    let choice = args.metrics.choice;
    let dir = PathBuf::from(dir);
    let frames = record.frames().map_err(of_record)?;
    let work = move |watched: Watched| {
        tell(watched, &settings, choice, |look| {
            for frame in frames {
                match frame {
                    Ok(frame) => look(&frame),
                    Err(error) => {
                        note(&format!("error: {}: {error}; what is before can be seen", text::path(&dir)));
                        break;
                    }
                }
            }
        })
    };
    Ok(Shown { watched, work: Box::new(work) })
}

/// What is named like a folder or a scenario, and is neither.
fn nothing_there(name: &str) -> Failure {
    let [partial, file] = [disk::PARTIAL, ".toml"].map(|ending| format!("{}{ending}", name.trim_end_matches('/')));
    let help = if Path::new(&partial).exists() {
        format!("what an unfinished run has left is in {}", text::words(&partial))
    } else if Path::new(&file).is_file() {
        format!("did you mean {}?", text::words(&file))
    } else {
        let lists = "standoff scenarios lists what is built in; where the results of a run are it says at its end";
        built_in_like(name).unwrap_or_else(|| lists.to_owned())
    };
    Failure::Input(format!(
        "{}: no folder of results is there, no scenario file, and none of that name is built in; {help}",
        text::words(name)
    ))
}

/// A run that is flown to be looked at.
fn flight(what: Option<&str>, args: &Args) -> Result<Shown, Failure> {
    let name = args.changes.scenario(what, DEFAULT_SCENARIO);
    // Folders may have dots in their names, too.
    let is_file_s = [".toml", ".csv", ".xml", ".gz"].iter().any(|ending| name.to_lowercase().ends_with(ending));
    if !is_file_s && built_in(name).is_none() && !Path::new(name).exists() {
        return Err(nothing_there(name));
    }
    let scenario = Scenario::load(name, &args.changes.edits()?, args.seed.unwrap_or(1)).map_err(Failure::Scenario)?;
    warn(&scenario, "", &note);
    let watched = Watched::flight(&scenario, false, args.maps.named().of_scenario(&scenario, &note)?)?;
    let choice = args.metrics.choice;
    Ok(Shown { watched, work: Box::new(move |watched| fly(&scenario, watched, choice)) })
}

fn fly(scenario: &Scenario, watched: Watched, choice: Choice) -> Result<(), Failure> {
    let mut mission = Mission::scored_by(scenario, choice).map_err(|errors| Failure::Input(refused(&errors)))?;
    tell(watched, &scenario.settings, choice, |look| {
        while let Some(frame) = mission.frame() {
            look(frame);
        }
    })
}

/// Scores all frames and lets them be watched.
fn tell(
    mut watched: Watched,
    settings: &Settings,
    choice: Choice,
    frames: impl FnOnce(&mut dyn FnMut(&Frame)),
) -> Result<(), Failure> {
    let mut scorer = Scorer::new(Rules::of(settings), choice);
    frames(&mut |frame| {
        scorer.frame(frame);
        watched.frame(frame);
    });
    watched.finish(lines(&Chosen { metrics: scorer.metrics(), choice }, settings))
}
