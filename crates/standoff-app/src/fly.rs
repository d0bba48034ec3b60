//! Flies a mission and writes its record.

use std::fmt::Display;
use std::path::Path;

use standoff_io::display_text;
use standoff_record::{
    FinishedRecord, Frame, MAX_ROWS, Manifest, Occupancy, PartialRecord, Writer, conflicting_files, occupancy,
};
use standoff_score::FrameScorer;
use standoff_sim::controller::Controller;
use standoff_sim::run::Mission;
use standoff_sim::scenario::{Scenario, Settings};
use standoff_sim::world::World;
use standoff_view::Bytes;

use crate::error::{Failure, of_record};
use crate::warnings::Warnings;

/// Returns true if `out` contains an older run, which the new record will replace. Fails if `out` contains anything
/// else, or if the record would have too many rows.
pub fn has_older_run(scenario: &Scenario, out: &Path) -> Result<bool, Failure> {
    let rows = World::rows(scenario);
    if rows > MAX_ROWS {
        let what = "choose a shorter duration_s, a longer period_s or fewer targets, or use standoff monte-carlo, \
                    which writes no record";
        return Err(Failure::Input(format!(
            "the record could have {rows} rows of targets; at most {MAX_ROWS}: {what}"
        )));
    }
    match occupancy(out) {
        Occupancy::Other => Err(of_record(conflicting_files(out))),
        occupancy => Ok(occupancy == Occupancy::OlderRun),
    }
}

/// Returns the manifest of the record of a scenario, flown with the built-in controller.
pub fn manifest(scenario: &Scenario) -> Manifest {
    let Settings { duration, period, .. } = scenario.settings;
    let manifest = Manifest::new(&scenario.name, scenario.seed, duration.s(), period.s());
    Manifest {
        origin: scenario.origin(),
        traffic_unit: scenario.traffic_unit(),
        begin_unix_us: scenario.begin_unix_us(),
        ..manifest
    }
}

/// Flies a scenario's mission and writes its record to `out`, frame by frame; calls `look` with every frame. Stops at
/// the end of the mission, or when `go_on`, which is called before every time step, returns false.
///
/// If the mission ends early, the failure states which part of the record was saved.
pub fn fly<B: Controller>(
    scenario: &Scenario,
    mission: &mut Mission<B>,
    out: &Path,
    map: Option<&Bytes>,
    on_warning: Warnings,
    go_on: impl Fn() -> bool,
    mut look: impl FnMut(&Frame),
) -> Result<FinishedRecord, Failure> {
    let resolved = scenario.resolved().map_err(Failure::Scenario)?;
    let names = World::names(scenario);
    let manifest = Manifest { reported: mission.reported_tables(), ..manifest(scenario) };
    let writer = Writer::create(out, &manifest, &resolved, &names).map_err(of_record)?;
    let mut scorer = FrameScorer::new(mission.score_config());
    let writer = writer.deriving(move |frame| scorer.derived_columns(frame));
    let mut writer = match map {
        Some(map) => writer.with_map(map).map_err(of_record)?,
        None => writer,
    };
    if let Some(older) = writer.set_aside() {
        on_warning(&format!(
            "note: an unfinished run is kept in {} until this one is complete",
            display_text::path(older)
        ));
    }
    while go_on() {
        let Some(frame) = mission.frame() else {
            let kept = writer.kept();
            return writer.close().map_err(|error| ended_early(error, kept));
        };
        writer.frame(frame).map_err(|error| ended_early(error, writer.kept()))?;
        look(frame);
    }
    let kept = writer.kept();
    let kept = writer.stop().map_err(|error| ended_early(error, kept))?;
    Err(ended_early("interrupted", kept))
}

/// Returns the failure of a run that ended early, with the part that was saved.
fn ended_early(error: impl Display, kept: Option<PartialRecord>) -> Failure {
    let saved = kept.map_or_else(
        || "nothing of the run was saved".to_owned(),
        |PartialRecord { dir, until_s }| {
            let (shown, dir) = (display_text::path(&dir), display_text::shell_path(&dir));
            format!(
                "the run up to {until_s} s is saved in {shown}, unfinished: to print its results, run standoff report {dir}"
            )
        },
    );
    Failure::running(format!("{error}; {saved}"))
}
