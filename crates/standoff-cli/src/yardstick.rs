//! `standoff yardstick`: how much discs that know where every target is would watch.

use clap::Parser;
use standoff_results::{Failure, Yardsticked, count, warn, wrapped};
use standoff_sim::scenario::Scenario;
use standoff_sim::text;
use standoff_sim::yardstick::{SPEED_M_S, Watched};

use crate::changes::{Changes, DEFAULT_SCENARIO};
use crate::speech::{note, print};

pub(crate) const EXAMPLES: &str = "\
Examples:
  standoff yardstick best/figure-9
  standoff yardstick traffic/city --uavs 4
  standoff yardstick --traffic city.fcd.xml.gz --uavs 2 --json";

/// What to measure.
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
    /// Print one JSON object instead of the table.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let name = args.changes.scenario(args.scenario.as_deref(), DEFAULT_SCENARIO);
    let scenario = Scenario::load(name, &args.changes.edits()?, args.seed).map_err(Failure::Scenario)?;
    warn(&scenario, "", &note);
    let told = Yardsticked::of(&scenario);
    print(&if args.json { told.json().map_err(Failure::running)? } else { text::lines(&table(&told)) })
}

fn table(told: &Yardsticked) -> String {
    let Yardsticked { scenario, seed, duration_s, uavs, targets, yardstick } = told;
    let of = format!("{}, {}", count(*uavs, "UAV"), count(*targets, "target"));
    let mut table = format!("{}, seed {seed}: {of}, {duration_s} s\n\n", text::words(scenario));
    table += &format!("{:30} {:>10} {:>10}\n", "watched, % of target-time", "mover", "best discs");
    // Of a lone UAV both are one disc.
    let half = (yardstick.half.discs < *uavs).then_some(("half as many as UAVs", yardstick.half));
    for (whose, watched) in half.into_iter().chain([("as many as UAVs", yardstick.all)]) {
        let Watched { discs, mover_fraction, best_fraction } = watched;
        let discs = format!("{}, {whose}", count(discs, "disc"));
        table += &format!("{discs:30} {:>10} {:>10}\n", percent(mover_fraction), percent(best_fraction));
    }
    table += "\n";
    let disc =
        format!("disc: what the largest orbit keeps in view, {:.0} m about its centre;", yardstick.disc_radius_m);
    let mover = format!("mover: goes greedily at {SPEED_M_S} m/s, sent anew each second;");
    let best = "best discs: placed anew at every instant. All know where every target is. A yardstick, not a bound";
    table + &wrapped("* ", &format!("{disc} {mover} {best}"))
}

/// A share in percent.
fn percent(share: Option<f64>) -> String {
    share.map_or_else(|| "-".to_owned(), |share| format!("{:.1}", 100.0 * share))
}
