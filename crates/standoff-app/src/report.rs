//! Reports a recorded run: computes scores, events and figures from the files of its record.

use std::cell::Cell;
use std::io::ErrorKind;
use std::path::Path;

use standoff_io::atomic_file;
use standoff_io::display_text::{self, shell_path};
use standoff_record::Record;
use standoff_score::{MetricSelection, ScoreConfig, Scorer, SelectedMetrics, problems};
use standoff_sim::scenario::Settings;
use standoff_view::figures::{FigureError, Setup, figures};
use standoff_view::page;
use standoff_view::replay::{Encoder, Head};

use crate::error::{Failure, of_record};
use crate::maps::Maps;
use crate::outcome::{Events, Outcome, PerTarget, Problem, ProblemFiles, lines};
use crate::warnings::Warnings;

/// Maximum number of target rows in a report. For longer runs the report contains only every n-th time step, so that
/// the file stays small enough to send.
const REPORT_ROWS: u64 = 300_000;
/// Maximum number of track rows of all agents up to which a report includes the other agents' states at every time
/// step; for more rows it includes them less often.
const REPORT_OTHER_ROWS: u64 = 150_000;

/// Report of a run.
pub struct Report {
    /// Results of the run.
    pub outcome: Outcome,
    /// Result of writing the summary, figures and page.
    pub written: Result<(), Failure>,
}

/// Computes the results of the record in `dir`, and writes its summary, figures and page there. Messages name `place`,
/// the final location of the folder. If that is `dir` and is read-only, a note takes the place of an error.
pub fn report_run(dir: &Path, place: &Path, choice: MetricSelection, warn: Warnings) -> Result<Report, Failure> {
    let record = Record::open(dir).map_err(of_record)?;
    report_end(&record, warn);
    if !record.has_truth() {
        warn("note: the record has no truth table; scores that need it are missing");
    }
    let settings = settings_of(&record)?;
    let reported = record.manifest().reported;
    for (is_reported, what) in [(reported.tracks, "tracks"), (reported.groups, "groups")] {
        if !is_reported {
            warn(&format!("note: the controller of this run reports no {what}; scores that need them are missing"));
        }
    }
    let config = ScoreConfig { reported, ..settings.score_config() };
    let mut scorer = Scorer::new(config.clone(), choice);
    let manifest = record.manifest();
    let setup = Setup::of(manifest.title(), &settings);
    let [stride, state_stride] = strides(&record, &setup)?;
    let encoder = Encoder::new(&config, stride).with_team_states_every(state_stride);
    let (mut encoder, mut parts) = (encoder.with_detections(setup.detections), Vec::new());
    let (mut events, mut uavs) = (Events::default(), 0);
    let frames = record.frames().map_err(of_record)?.inspect(|frame| {
        let Ok(frame) = frame else { return };
        scorer.frame(frame);
        parts.extend(encoder.frame(frame));
        uavs = uavs.max(frame.uavs.len());
        frame.events.iter().for_each(|row| events.add(frame.time_us, row, record.target_names()));
    });
    let figures = figures(frames, &setup).map_err(|error| match error {
        FigureError::Frame(error) => of_record(error),
        other => Failure::running(other),
    })?;
    let problems = problems(encoder.alarms()).iter().map(|of| Problem::of(of, record.target_names())).collect();
    let outcome = Outcome { problems, ..outcome_of(&record, settings, &scorer, choice, events, uavs) };
    warn_omitted(outcome.events.left_out(), warn);
    parts.extend(encoder.part());
    let mut head = Head::new(manifest, setup, record.target_names().to_vec());
    head.map = Maps::default().of_record(&record, warn)?;
    head.stride = stride;
    head.complete(lines(&outcome.metrics, &outcome.settings), &encoder);
    let files = ReportFiles { dir, place, unwritable: Cell::new(None) };
    let write = || {
        figures.iter().try_for_each(|figure| files.save(&format!("{}.svg", figure.name), &figure.svg))?;
        files.save("summary.json", &outcome.json().map_err(Failure::running)?)?;
        let problem_files = ProblemFiles::of(manifest, record.target_names())?;
        files.save("alarms.csv", &problem_files.alarms(encoder.alarms())?)?;
        files.save("gaps.csv", &problem_files.gaps(&encoder.gaps())?)?;
        files.save("report.html", &page::report(&head, &parts).map_err(Failure::running)?)
    };
    let written = write();
    if let Some(reason) = files.unwritable.take() {
        let place = display_text::path(place);
        warn(&format!("note: the summary, the figures and the page in {place} are not written: {reason}"));
    }
    Ok(Report { outcome, written })
}

/// Returns the stride of the time steps that a report includes, and that of those among them that have the other agents'
/// states.
fn strides(record: &Record, setup: &Setup) -> Result<[usize; 2], Failure> {
    let mut rows = record.target_rows().map_err(of_record)?;
    if setup.detections.is_some() {
        rows = rows.max(record.detection_rows().map_err(of_record)?);
    }
    let own_rows = record.agent_track_rows().map_err(of_record)?;
    let [stride, state_stride] = [rows.div_ceil(REPORT_ROWS), own_rows.div_ceil(REPORT_OTHER_ROWS)]
        .map(|stride| usize::try_from(stride).unwrap_or(usize::MAX));
    let stride = stride.max(1);
    Ok([stride, state_stride.div_ceil(stride)])
}

/// Returns the results of a recorded run whose frames have been scored.
fn outcome_of(
    record: &Record,
    settings: Settings,
    scorer: &Scorer,
    choice: MetricSelection,
    events: Events,
    uavs: usize,
) -> Outcome {
    let manifest = record.manifest();
    let name = |target: u32| record.target_names().get(target as usize).cloned().unwrap_or_default();
    Outcome {
        scenario: manifest.scenario.clone(),
        seed: manifest.seed,
        duration_s: manifest.duration_s,
        unfinished_after_s: record.ends_s(),
        uavs,
        // Cue events are incomplete if messages were lost or the controller reports no events; without a truth table
        // the number of scored targets is incomplete.
        targets: events.count("cued").max(scorer.targets().count()),
        traffic: manifest.traffic_note(),
        targets_mean: scorer.targets_mean(),
        metrics: SelectedMetrics { metrics: scorer.metrics(), choice },
        baseline: None,
        problems: Vec::new(),
        events,
        per_target: scorer.targets().map(|score| PerTarget { target: name(score.target), score }).collect(),
        settings,
    }
}

/// Files of a report.
struct ReportFiles<'a> {
    dir: &'a Path,
    /// Final location of `dir`.
    place: &'a Path,
    /// Reason why an archived record got no files.
    unwritable: Cell<Option<String>>,
}

impl ReportFiles<'_> {
    fn save(&self, name: &str, text: &str) -> Result<(), Failure> {
        let Err(reason) = atomic_file::save_quickly(&self.dir.join(name), text) else { return Ok(()) };
        // A record that is reported again may be an archive.
        let is_read_only = matches!(reason.kind(), ErrorKind::PermissionDenied | ErrorKind::ReadOnlyFilesystem);
        if self.dir == self.place && is_read_only {
            self.unwritable.set(Some(reason.to_string()));
            return Ok(());
        }
        let path = display_text::path(&self.place.join(name));
        let command = format!("standoff report {}", shell_path(self.place));
        let advice = format!("the record is complete: {command} creates the missing files");
        Err(Failure::running(format!("cannot write {path}: {reason}; {advice}")))
    }
}

/// Passes a note to `warn` if the run is unfinished.
pub fn report_end(record: &Record, warn: Warnings) {
    if let Some(end_s) = record.ends_s() {
        let duration_s = record.manifest().duration_s;
        warn(&format!("note: this run is unfinished: it covers {end_s} s of {duration_s} s"));
    }
}

/// Returns the settings of a recorded run. Fails if its scenario and its manifest contradict each other.
pub fn settings_of(record: &Record) -> Result<Settings, Failure> {
    let path = record.dir().join("scenario.toml");
    let settings = Settings::of_record(&path.display().to_string(), record.scenario_toml(), record.target_names());
    let settings = settings.map_err(Failure::input)?;
    let manifest = record.manifest();
    for (key, value, expected) in [
        ("duration_s", settings.duration.s(), manifest.duration_s),
        ("period_s", settings.period.s(), manifest.period_s),
    ] {
        // Times are whole microseconds.
        if (value - expected).abs() > 1e-6 {
            let what = format!("{key} = {value}, but run.json contains {expected}");
            let advice = "they are from different runs; copy the record again, or run the scenario again";
            return Err(Failure::Input(format!("{}: {what}: {advice}", display_text::path(&path))));
        }
    }
    Ok(settings)
}

/// Passes a note to `warn` if the page does not include all events; `events` is the number left out.
pub fn warn_omitted(events: u64, warn: Warnings) {
    if events > 0 {
        warn(&format!("note: the run has many events: {events} of them are in events.parquet only"));
    }
}

/// Writes a file atomically.
pub fn save(path: &Path, text: &str) -> Result<(), Failure> {
    atomic_file::save_quickly(path, text)
        .map_err(|reason| Failure::running(format!("{}: {reason}", display_text::path(path))))
}
