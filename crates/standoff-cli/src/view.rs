//! `standoff view`: shows runs in a browser.

use std::path::{Path, PathBuf};
use std::thread;

use clap::Parser;
use standoff_app::{Failure, format_errors, lines, of_batch, of_record, report_end, settings_of, warn};
use standoff_io::atomic_file;
use standoff_io::bounded_input;
use standoff_io::display_text;
use standoff_record::{Frame, Record};
use standoff_score::{MetricSelection, Scorer, SelectedMetrics};
use standoff_sim::monte_carlo::{Results, differing_settings};
use standoff_sim::run::Mission;
use standoff_sim::scenario::{Scenario, ScenarioTemplate, Settings, built_in, built_in_like};
use standoff_view::batch::Batch;
use standoff_view::site;

use crate::live_view::{LiveReplay, ServeArgs};
use crate::maps::Maps;
use crate::metric_args::MetricArgs;
use crate::overrides::{DEFAULT_SCENARIO, OverrideArgs};
use crate::signals::Interruption;
use crate::terminal::{no_thread, note, print, report_failure};

pub(crate) const EXAMPLES: &str = "\
Examples:
  standoff view                                   show the default mission
  standoff view standoff-out/improved/figure-9-1  show a recorded run
  standoff view improved/figure-9 --seed 7        fly it; write nothing
  standoff view paper/figure-9 improved/figure-9  show two runs side by side
  standoff view standoff-out/batch                show a batch of runs
  standoff view batch-a batch-b                   compare batches
  standoff view mine-1 --map town.net.xml.gz      show it on a road map
  standoff view fly.html                          fly in the browser itself
  standoff run traffic/city --view                show it while it flies";

/// Options of `standoff view`.
#[derive(Parser)]
pub(crate) struct Args {
    /// What to show: one run, two runs side by side, or the folders of one or more Monte Carlo batches, which are
    /// compared. A run is the folder of a recorded run, or the name of a built-in scenario or a scenario file, which is
    /// then flown [default: improved/figure-9; with --traffic, the settings of traffic/convoy]. Or the page that flies
    /// missions in the browser.
    #[arg(value_name = "DIR|SCENARIO|PAGE")]
    what: Vec<String>,
    #[command(flatten)]
    changes: OverrideArgs,
    /// Seed of all random numbers, for a scenario that is flown [default: 1].
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    #[command(flatten)]
    maps: Maps,
    #[command(flatten)]
    metrics: MetricArgs,
    #[command(flatten)]
    served: ServeArgs,
}

pub(crate) fn view(args: &Args) -> Result<(), Failure> {
    let dirs: Vec<&Path> = args.what.iter().map(Path::new).collect();
    let is_run = |dir: &Path| dir.join("run.json").exists() || !dir.is_dir();
    match dirs[..] {
        [] => show(flight(None, args)?, None, args),
        [page] if is_page(page) => serve_page(page, args),
        [one] if is_run(one) => show(run(one, args)?, None, args),
        [one, other] if is_run(one) && is_run(other) => {
            let (mut first, mut second) = (run(one, args)?, run(other, args)?);
            distinguish(&mut first, &mut second)?;
            show(first, Some(second), args)
        }
        _ if dirs.iter().any(|dir| is_run(dir)) => {
            let message = "name one run, two runs, or any number of folders of standoff monte-carlo: runs and batches \
                           cannot be shown together";
            Err(Failure::Input(message.to_owned()))
        }
        _ => batches(&dirs, args),
    }
}

/// Opens a recorded run, or prepares the flight of a scenario.
fn run(what: &Path, args: &Args) -> Result<Shown, Failure> {
    if what.join("run.json").exists() { record(what, args) } else { flight(what.to_str(), args) }
}

/// Maximum size of the page that flies missions.
const PAGE_BYTES_MAX: u64 = 100 << 20;

fn is_page(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("html"))
}

/// Serves the page that flies missions.
fn serve_page(path: &Path, args: &Args) -> Result<(), Failure> {
    let failure = |what: &str| Failure::Input(format!("{}: {what}", display_text::path(path)));
    if !args.changes.is_empty() || args.seed.is_some() || args.served.has_tiles() {
        return Err(failure("a page takes no --traffic, --uavs, --set, --seed and --tiles: it has its own controls"));
    }
    let file = bounded_input::bytes(path, PAGE_BYTES_MAX)
        .map_err(|reason| failure(&bounded_input::cannot_be_read(&reason)))?;
    let site = site::of_flight_page(file)
        .ok_or_else(|| failure("it is not a page that flies missions, as scripts/build_web makes it"))?;
    let interruption = Interruption::install()?;
    let _server = args.served.serve(site, print)?;
    note("Press Ctrl-C to stop.");
    interruption.wait(None);
    Ok(())
}

/// Adds the settings in which two runs of the same scenario differ, so that the page can show them.
fn distinguish(first: &mut Shown, second: &mut Shown) -> Result<(), Failure> {
    if first.live.scenario() != second.live.scenario() {
        return Ok(());
    }
    let [a, b] = differing_settings([&first.scenario_toml, &second.scenario_toml]).map_err(Failure::input)?;
    first.live.set_changes(a)?;
    second.live.set_changes(b)
}

/// Serves one or two runs; the page shows them while they are still being flown or read.
fn show(first: Shown, second: Option<Shown>, args: &Args) -> Result<(), Failure> {
    let replays = (first.live.replay(), second.as_ref().map(|shown| shown.live.replay()));
    let is_geographic = [Some(&first), second.as_ref()].into_iter().flatten().any(|shown| shown.live.is_geographic());
    let site = site::of_runs(replays.0, replays.1, args.served.tiles(is_geographic)?);
    let interruption = Interruption::install()?;
    let server = args.served.serve(site, print)?;
    note("Press Ctrl-C to stop.");
    let begin = |shown: Shown| {
        let work = move || (shown.work)(shown.live).map_err(|failure| report_failure(&failure));
        thread::Builder::new().spawn(work).map_err(no_thread)
    };
    let works = [Some(first), second].into_iter().flatten().map(begin).collect::<Result<Vec<_>, _>>()?;
    interruption.wait(None);
    drop(server);
    // Threads that are still working are not needed any more.
    let mut finished = works.into_iter().filter(|work| work.is_finished());
    let all_succeeded = finished.all(|work| work.join().is_ok_and(|result| result.is_ok()));
    if all_succeeded { Ok(()) } else { Err(Failure::running("the run could not be shown completely")) }
}

/// Serves batches; a run of a batch is flown again when a page requests it.
fn batches(dirs: &[&Path], args: &Args) -> Result<(), Failure> {
    let traffic = args.changes.only_traffic().filter(|_| args.seed.is_none()).ok_or_else(|| {
        Failure::Input(
            "--uavs, --set and --seed apply to scenarios: the runs in these folders have already been flown".to_owned(),
        )
    })?;
    let results = dirs.iter().map(|dir| Results::open(dir)).collect::<Result<Vec<_>, _>>().map_err(of_batch)?;
    let batch = Batch::of(&results).map_err(of_batch)?;
    let template = |results: &Results| {
        let template = results.batch().template(traffic);
        template.inspect_err(|error| note(&format!("warning: its runs cannot be replayed: {error}"))).ok()
    };
    let templates: Vec<_> = results.iter().map(template).collect();
    // Runs that cannot be replayed need no tiles.
    let is_geographic =
        templates.iter().all(Option::is_none) || templates.iter().flatten().any(ScenarioTemplate::is_geographic);
    let tiles = args.served.tiles(is_geographic)?.cloned();
    let (choice, maps) = (args.metrics.selection(), args.maps.named());
    let fly = move |variant: usize, seed: u64| {
        let scenario = templates.get(variant)?.as_ref()?.draw(seed).ok()?;
        // The page can show the run without a map.
        let map = maps.of_scenario(&scenario, &note).unwrap_or_else(|failure| {
            failure.warning().iter().for_each(|warning| note(warning));
            None
        });
        let live = LiveReplay::flight(&scenario, false, map).ok()?;
        let replay = live.replay();
        fly(&scenario, live, choice).ok()?;
        Some(replay)
    };
    let interruption = Interruption::install()?;
    let site = site::of_batch(&batch, tiles, fly).map_err(Failure::running)?;
    let _server = args.served.serve(site, print)?;
    note("Press Ctrl-C to stop.");
    interruption.wait(None);
    Ok(())
}

/// A replay, and the work that fills it.
struct Shown {
    live: LiveReplay,
    /// The resolved scenario.
    scenario_toml: String,
    work: Box<dyn FnOnce(LiveReplay) -> Result<(), Failure> + Send>,
}

/// Opens a recorded run.
fn record(dir: &Path, args: &Args) -> Result<Shown, Failure> {
    if !args.changes.is_empty() || args.seed.is_some() {
        return Err(Failure::Input(
            "--traffic, --uavs, --set and --seed apply to scenarios: the run in this folder has already been flown"
                .into(),
        ));
    }
    let record = Record::open(dir).map_err(of_record)?;
    report_end(&record, &note);
    let settings = settings_of(&record)?;
    let map = args.maps.named().of_record(&record, &note)?;
    let live = LiveReplay::new(record.manifest(), &settings, record.target_names().to_vec(), false, map)?;
    let choice = args.metrics.selection();
    let dir = PathBuf::from(dir);
    let frames = record.frames().map_err(of_record)?;
    let scenario_toml = record.scenario_toml().to_owned();
    let work = move |live: LiveReplay| {
        score_and_show(live, &settings, choice, |look| {
            for frame in frames {
                match frame {
                    Ok(frame) => look(&frame),
                    Err(error) => {
                        note(&format!(
                            "error: {}: {error}; only the time steps before the damage are shown",
                            display_text::path(&dir)
                        ));
                        break;
                    }
                }
            }
        })
    };
    Ok(Shown { live, scenario_toml, work: Box::new(work) })
}

/// Returns the failure for a name that is neither a folder nor a scenario.
fn not_found(name: &str) -> Failure {
    let [partial, file] =
        [atomic_file::PARTIAL, ".toml"].map(|ending| format!("{}{ending}", name.trim_end_matches('/')));
    let help = if Path::new(&partial).exists() {
        format!("an unfinished run is in {}", display_text::printable(&partial))
    } else if Path::new(&file).is_file() {
        format!("did you mean {}?", display_text::printable(&file))
    } else {
        let lists = "standoff scenarios lists the built-in ones; a run prints the folder of its results at its end";
        built_in_like(name).unwrap_or_else(|| lists.to_owned())
    };
    Failure::Input(format!(
        "{}: no results folder, scenario file or built-in scenario has this name; {help}",
        display_text::printable(name)
    ))
}

/// Prepares the flight of a scenario; nothing is written.
fn flight(what: Option<&str>, args: &Args) -> Result<Shown, Failure> {
    let name = args.changes.scenario(what, DEFAULT_SCENARIO);
    // The extensions are listed because names of folders may contain dots, too.
    let names_a_file = [".toml", ".csv", ".xml", ".gz"].iter().any(|ending| name.to_lowercase().ends_with(ending));
    if !names_a_file && built_in(name).is_none() && !Path::new(name).exists() {
        return Err(not_found(name));
    }
    let overrides = args.maps.with(args.changes.overrides()?);
    let scenario = Scenario::load(name, &overrides, args.seed.unwrap_or(1)).map_err(Failure::Scenario)?;
    warn(&scenario, "", &note);
    let live = LiveReplay::flight(&scenario, false, args.maps.named().of_scenario(&scenario, &note)?)?;
    let choice = args.metrics.selection();
    let scenario_toml = scenario.resolved().map_err(Failure::Scenario)?;
    Ok(Shown { live, scenario_toml, work: Box::new(move |live| fly(&scenario, live, choice)) })
}

fn fly(scenario: &Scenario, live: LiveReplay, choice: MetricSelection) -> Result<(), Failure> {
    let mut mission = Mission::new(scenario).map_err(|errors| Failure::Input(format_errors(&errors)))?;
    score_and_show(live, &scenario.settings, choice, |look| {
        while let Some(frame) = mission.frame() {
            look(frame);
        }
    })
}

/// Scores all frames and adds them to the replay.
fn score_and_show(
    mut live: LiveReplay,
    settings: &Settings,
    choice: MetricSelection,
    frames: impl FnOnce(&mut dyn FnMut(&Frame)),
) -> Result<(), Failure> {
    let mut scorer = Scorer::new(settings.score_config(), choice);
    frames(&mut |frame| {
        scorer.frame(frame);
        live.frame(frame);
    });
    live.finish(lines(&SelectedMetrics { metrics: scorer.metrics(), choice }, settings))
}
