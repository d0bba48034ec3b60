//! A mission flown into a record.

use std::fmt::Display;
use std::path::Path;

use standoff_sim::brain::Brain;
use standoff_sim::record::{Closed, Frame, Kept, MAX_ROWS, Manifest, Occupancy, Writer, in_the_way, occupancy};
use standoff_sim::run::Mission;
use standoff_sim::scenario::{Scenario, Settings};
use standoff_sim::text;
use standoff_sim::world::World;
use standoff_view::serve::Bytes;

use crate::failure::{Failure, of_record};
use crate::say::Say;

/// Whether an older run lies where a scenario's record is to go, which it will replace. Fails if anything else lies there,
/// or if the record would have too many rows.
pub fn has_older_run(scenario: &Scenario, out: &Path) -> Result<bool, Failure> {
    let rows = World::rows(scenario);
    if rows > MAX_ROWS {
        let what = "choose a shorter duration_s, a longer period_s or fewer targets, or standoff monte-carlo, which keeps no record";
        return Err(Failure::Input(format!(
            "the record could have {rows} rows of targets; at most {MAX_ROWS}: {what}"
        )));
    }
    match occupancy(out) {
        Occupancy::Other => Err(of_record(in_the_way(out))),
        there => Ok(there == Occupancy::OlderRun),
    }
}

/// What a record of this scenario's run says it is, flown by the product.
pub fn manifest(scenario: &Scenario) -> Manifest {
    let Settings { duration, period, .. } = scenario.settings;
    let manifest = Manifest::new(&scenario.name, scenario.seed, duration.s(), period.s());
    Manifest { origin: scenario.origin(), traffic_unit: scenario.traffic_unit(), ..manifest }
}

/// Flies a scenario's mission into a record in `out`; every frame is written as it comes, and `look` sees it. It goes on
/// until the mission is over or `go_on`, asked before every instant, says no.
///
/// Whatever ends it early, the failure says what is kept.
pub fn fly<B: Brain>(
    scenario: &Scenario,
    mission: &mut Mission<B>,
    out: &Path,
    map: Option<&Bytes>,
    say: Say,
    go_on: impl Fn() -> bool,
    mut look: impl FnMut(&Frame),
) -> Result<Closed, Failure> {
    let resolved = scenario.resolved().map_err(Failure::Scenario)?;
    let names = World::names(scenario);
    let manifest = Manifest { reported: mission.reported(), ..manifest(scenario) };
    let writer = Writer::create(out, &manifest, &resolved, &names).map_err(of_record)?;
    let writer = writer.judged_by(mission.rules());
    let mut writer = match map {
        Some(map) => writer.with_map(map).map_err(of_record)?,
        None => writer,
    };
    if let Some(older) = writer.set_aside() {
        say(&format!("note: an unfinished run is kept in {} until this one is complete", text::path(older)));
    }
    while go_on() {
        let Some(frame) = mission.frame() else {
            let kept = writer.kept();
            return writer.close().map_err(|error| broken_off(error, kept));
        };
        writer.frame(frame).map_err(|error| broken_off(error, writer.kept()))?;
        look(frame);
    }
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
