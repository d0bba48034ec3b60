//! `standoff run --advise`: flies the mission again with one change each, and prints what each would hold.

use standoff_app::{Failure, format_errors};
use standoff_io::display_text::{WIDTH, count, wrapped};
use standoff_score::MetricSelection;
use standoff_sim::run::fly;
use standoff_sim::scenario::{Scenario, ScenarioTemplate};

/// Metric by which the changes are compared.
const CUSTODY: &str = "custody_fraction";
/// Custody at which no more UAVs are tried.
const ENOUGH: f64 = 0.995;
/// Maximum number of UAVs that are tried, relative to the scenario's.
const UAVS_MAX: usize = 4;

/// Custody of the mission with one change.
#[derive(Debug)]
pub(crate) struct Trial {
    /// The change, as for `--set`.
    set: String,
    custody_fraction: Option<f64>,
}

/// Flies the mission with a larger orbit and with more UAVs, until the targets are in custody.
pub(crate) fn trials(template: &ScenarioTemplate, scenario: &Scenario) -> Result<Vec<Trial>, Failure> {
    let uavs = scenario.uavs.len();
    let wider_m = 1.5 * scenario.settings.team.group.standoff.radius_max_m;
    let mut trials = Vec::from_iter(trial(template, scenario.seed, format!("orbit.radius_max_m={wider_m}"))?);
    let mut next = uavs + 1;
    while next <= UAVS_MAX * uavs {
        let Some(found) = trial(template, scenario.seed, format!("uavs.count={next}"))? else { break };
        let is_enough = found.custody_fraction.is_none_or(|share| share >= ENOUGH);
        trials.push(found);
        if is_enough {
            break;
        }
        next += next.div_ceil(4);
    }
    Ok(trials)
}

/// Flies the mission with a change; returns `None` if the scenario does not allow it.
fn trial(template: &ScenarioTemplate, seed: u64, set: String) -> Result<Option<Trial>, Failure> {
    let changed = template.changed(std::slice::from_ref(&set)).and_then(|template| template.draw(seed));
    let Ok(scenario) = changed else { return Ok(None) };
    let choice = MetricSelection::parse(CUSTODY).map_err(Failure::running)?;
    let metrics = fly(&scenario, choice).map_err(|errors| Failure::Input(format_errors(&errors)))?;
    Ok(Some(Trial { set, custody_fraction: metrics[CUSTODY] }))
}

/// Formats the trials next to the custody of the mission as flown.
pub(crate) fn text(flown: Option<f64>, uavs: usize, trials: &[Trial]) -> String {
    let percent = |share: Option<f64>| share.map_or_else(|| "-".to_owned(), |share| format!("{:.1} %", 100.0 * share));
    let mut text = "\nAdvice: target time in custody with one change, flown with the same seed\n".to_owned();
    text += &format!("  {:34} {:>8}\n", format!("as flown, {}", count(uavs, "UAV")), percent(flown));
    for Trial { set, custody_fraction } in trials {
        text += &format!("  {:34} {:>8}\n", format!("--set {set}"), percent(*custody_fraction));
    }
    let remark = "one run each, so that differences of a few percent may be chance: standoff compare measures them";
    text + &wrapped("  ", remark, WIDTH)
}
