//! `standoff baseline`: computes the coverage baseline, the coverage of greedy discs with perfect knowledge.

use clap::Parser;
use standoff_app::{BaselineReport, Failure, warn};
use standoff_io::display_text::{self, WIDTH, count, wrapped};
use standoff_sim::baseline::{CoverageShare, SPEED_M_S};
use standoff_sim::scenario::Scenario;

use crate::overrides::{DEFAULT_SCENARIO, OverrideArgs};
use crate::terminal::{note, print};

pub(crate) const EXAMPLES: &str = "\
Examples:
  standoff baseline improved/figure-9
  standoff baseline traffic/city --uavs 4
  standoff baseline --traffic city.fcd.xml.gz --uavs 2 --json";

/// Options of `standoff baseline`.
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
    /// Print one JSON object instead of the table.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let name = args.changes.scenario(args.scenario.as_deref(), DEFAULT_SCENARIO);
    let scenario = Scenario::load(name, &args.changes.overrides()?, args.seed).map_err(Failure::Scenario)?;
    warn(&scenario, "", &note);
    let result = BaselineReport::of(&scenario);
    print(&if args.json { result.json().map_err(Failure::running)? } else { display_text::lines(&table(&result)) })
}

fn table(result: &BaselineReport) -> String {
    let BaselineReport { scenario, seed, duration_s, uavs, targets, baseline } = result;
    let counts = format!("{}, {}", count(*uavs, "UAV"), count(*targets, "target"));
    let mut table = format!("{}, seed {seed}: {counts}, {duration_s} s\n\n", display_text::printable(scenario));
    table += &format!("{:30} {:>13} {:>15}\n", "covered, % of target-time", "moving discs", "re-placed discs");
    // With one UAV, both rows would have one disc.
    let half = (baseline.half_of_uavs.discs < *uavs).then_some(("half as many as UAVs", baseline.half_of_uavs));
    for (relation, share) in half.into_iter().chain([("as many as UAVs", baseline.all_uavs)]) {
        let CoverageShare { discs, mover_fraction, best_fraction } = share;
        let discs = format!("{}, {relation}", count(discs, "disc"));
        table += &format!("{discs:30} {:>13} {:>15}\n", percent(mover_fraction), percent(best_fraction));
    }
    table += "\n";
    let disc =
        format!("disc: the area in view from the largest orbit, {:.0} m around its centre;", baseline.disc_radius_m);
    let mover = format!("moving discs: they move greedily at {SPEED_M_S} m/s, with a new destination each second;");
    let best =
        "re-placed discs: placed again at every time step. Both know all target positions. A baseline, not a bound";
    table + &wrapped("* ", &format!("{disc} {mover} {best}"), WIDTH)
}

/// Formats a fraction in percent.
fn percent(share: Option<f64>) -> String {
    share.map_or_else(|| "-".to_owned(), |share| format!("{:.1}", 100.0 * share))
}
