//! What a record tells: scores, events and figures, from its files alone.

use std::path::Path;

use standoff_sim::disk;
use standoff_sim::record::Record;
use standoff_sim::scenario::Settings;
use standoff_sim::score::{Choice, Chosen, Rules, Scorer};
use standoff_sim::text;
use standoff_view::figures::{FigureError, Setup, figures};
use standoff_view::page;
use standoff_view::replay::{Encoder, Head};

use crate::failure::{Failure, of_record};
use crate::maps::Maps;
use crate::outcome::{Events, Outcome, PerTarget, lines};
use crate::say::Say;

/// Most rows of targets that a report holds: of more, it shows some instants only, and stays a file that can be sent.
const REPORT_ROWS: u64 = 300_000;
/// Most rows of tracks of all minds from whose instants it holds what the others believe.
const REPORT_OTHER_ROWS: u64 = 150_000;

/// What there is to tell of a run.
pub struct Told {
    /// What the run came to.
    pub outcome: Outcome,
    /// Whether there was room for summary, figures and page.
    pub written: Result<(), Failure>,
}

/// Scores and draws the record in `dir`; puts summary, figures and page beside it. Messages name `place`, where it will
/// lie by then.
pub fn tell(dir: &Path, place: &Path, choice: Choice, say: Say) -> Result<Told, Failure> {
    let record = Record::open(dir).map_err(of_record)?;
    tell_end(&record, say);
    if !record.has_truth() {
        say("note: the record has no truth table; scores that need it are missing");
    }
    let settings = settings_of(&record)?;
    let reported = record.manifest().reported;
    for (is_reported, what) in [(reported.tracks, "tracks"), (reported.groups, "groups")] {
        if !is_reported {
            say(&format!("note: the brain that flew reports no {what}; scores that need them are missing"));
        }
    }
    let rules = Rules { reported, ..Rules::of(&settings) };
    let mut scorer = Scorer::new(rules.clone(), choice);
    let rows = record.target_rows().map_err(of_record)?;
    let stride = usize::try_from(rows.div_ceil(REPORT_ROWS)).unwrap_or(usize::MAX).max(1);
    let own_rows = record.agent_track_rows().map_err(of_record)?;
    let pictures = usize::try_from(own_rows.div_ceil(REPORT_OTHER_ROWS)).unwrap_or(usize::MAX).div_ceil(stride);
    let (mut encoder, mut parts) = (Encoder::new(&rules, stride).with_pictures_every(pictures), Vec::new());
    let (mut events, mut uavs) = (Events::default(), 0);
    let frames = record.frames().map_err(of_record)?.inspect(|frame| {
        let Ok(frame) = frame else { return };
        scorer.frame(frame);
        parts.extend(encoder.frame(frame));
        uavs = uavs.max(frame.uavs.len());
        frame.events.iter().for_each(|row| events.add(frame.time_us, row, record.target_names()));
    });
    let manifest = record.manifest();
    let setup = Setup::of(manifest.title(), &settings);
    let figures = figures(frames, &setup).map_err(|error| match error {
        FigureError::Frame(error) => of_record(error),
        other => Failure::running(other),
    })?;
    let name = |target: u32| record.target_names().get(target as usize).cloned().unwrap_or_default();
    let outcome = Outcome {
        scenario: manifest.scenario.clone(),
        seed: manifest.seed,
        duration_s: manifest.duration_s,
        unfinished_after_s: record.ends_s(),
        uavs,
        // Where words go missing, or a brain tells little, cues are not all told of; where no truth is, nothing else is.
        targets: events.count("cued").max(scorer.targets().count()),
        traffic: manifest.traffic_told(),
        targets_mean: scorer.targets_mean(),
        metrics: Chosen { metrics: scorer.metrics(), choice },
        yardstick: None,
        events,
        per_target: scorer.targets().map(|score| PerTarget { target: name(score.target), score }).collect(),
        settings,
    };
    tell_left_out(outcome.events.left_out(), say);
    parts.extend(encoder.part());
    let mut head = Head::new(manifest, setup, record.target_names().to_vec());
    head.map = Maps::default().of_record(&record, say)?;
    (head.stride, head.outcome) = (stride, lines(&outcome.metrics, &outcome.settings));
    head.events_left_out = encoder.events_left_out();
    head.other_events_left_out = encoder.other_events_left_out();
    let save = |name: &str, text: &str| {
        disk::save_quickly(&dir.join(name), text).map_err(|reason| {
            let (path, place) = (text::path(&place.join(name)), text::path(place));
            let advice = format!("the record itself is there: standoff show {place} makes what is missing");
            Failure::running(format!("cannot write {path}: {reason}; {advice}"))
        })
    };
    let write = || {
        figures.iter().try_for_each(|figure| save(&format!("{}.svg", figure.name), &figure.svg))?;
        save("summary.json", &outcome.json().map_err(Failure::running)?)?;
        save("report.html", &page::report(&head, &parts).map_err(Failure::running)?)
    };
    let written = write();
    Ok(Told { outcome, written })
}

/// Says so if the run is unfinished.
pub fn tell_end(record: &Record, say: Say) {
    if let Some(end_s) = record.ends_s() {
        let duration_s = record.manifest().duration_s;
        say(&format!("note: this run is unfinished: it tells up to {end_s} s of {duration_s} s"));
    }
}

/// The settings of the run in a record.
pub fn settings_of(record: &Record) -> Result<Settings, Failure> {
    let path = record.dir().join("scenario.toml");
    let settings = Settings::of_record(&path.display().to_string(), record.scenario_toml()).map_err(Failure::input)?;
    let manifest = record.manifest();
    for (key, value, told) in [
        ("duration_s", settings.duration.s(), manifest.duration_s),
        ("period_s", settings.period.s(), manifest.period_s),
    ] {
        // Times are whole microseconds.
        if (value - told).abs() > 1e-6 {
            let what = format!("{key} = {value}, and run.json beside it says {told}");
            let advice = "copy the record again, or run it again";
            return Err(Failure::Input(format!("{}: {what}: they are not of one run; {advice}", text::path(&path))));
        }
    }
    Ok(settings)
}

/// Says so if there are more events than a page is given.
pub fn tell_left_out(events: u64, say: Say) {
    if events > 0 {
        say(&format!("note: the run has more events than are told one by one: {events} are in events.parquet only"));
    }
}

/// Writes a file, whole or not at all.
pub fn save(path: &Path, text: &str) -> Result<(), Failure> {
    disk::save_quickly(path, text).map_err(|reason| Failure::running(format!("{}: {reason}", text::path(path))))
}
