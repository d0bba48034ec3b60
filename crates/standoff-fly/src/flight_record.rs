//! Record of a flight, written by a thread of its own, so that a slow disk delays no command.

use std::io;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::thread::{self, JoinHandle};

use standoff::Duration;
use standoff_io::display_text;
use standoff_record::{Frame, RecordError, Writer};

use crate::team_clock::unix_us;

/// Maximum number of frames that wait for the disk; further ones are left out. It is a minute of the usual period.
const QUEUE_MAX: usize = 120;

/// Longest gap that is filled. A longer one, or one backward, means that the clock was set.
const GAP_MAX: Duration = Duration::from_us(60_000_000);

/// Writes the frames of a flight and passes them on, for a page.
pub struct FlightRecorder {
    sender: SyncSender<Frame>,
    thread: JoinHandle<(Option<Writer>, Duration)>,
}

impl FlightRecorder {
    /// Starts to write to `writer`, if there is one. `look` receives every frame, with times since the start of the
    /// record; `warn` receives what goes wrong. `period` is that of the team.
    pub fn start(
        writer: Option<Writer>,
        period: Duration,
        look: impl FnMut(&Frame) + Send + 'static,
        warn: impl Fn(&str) + Send + 'static,
    ) -> io::Result<Self> {
        let (sender, receiver) = sync_channel(QUEUE_MAX);
        let write = move || write(&receiver, writer, TimeSteps::new(period), look, warn);
        Ok(Self { sender, thread: thread::Builder::new().name("record".to_owned()).spawn(write)? })
    }

    /// Adds a frame with the team's time. It never waits.
    pub fn add(&self, frame: Frame) {
        // Time steps that are left out are filled like those that the program has missed.
        let _ = self.sender.try_send(frame);
    }

    /// Ends the record and moves it to its folder. `scenario` returns the scenario with a length, s. Returns the length
    /// of the record; `None` without a record.
    pub fn finish(
        self,
        scenario: impl FnOnce(f64) -> Result<String, String>,
    ) -> Result<Option<Duration>, FlightRecordError> {
        drop(self.sender);
        let Ok((writer, length)) = self.thread.join() else { return Ok(None) };
        let Some(writer) = writer else { return Ok(None) };
        let kept = writer.kept().map(|kept| display_text::path(&kept.dir));
        match scenario(length.s()) {
            Ok(scenario) => writer.close_with_length(length.s(), &scenario)?.publish()?,
            Err(reason) => {
                writer.stop()?;
                return Err(FlightRecordError::Length { reason, kept: kept.unwrap_or_default() });
            }
        }
        Ok(Some(length))
    }
}

/// Why the record of a flight is not complete.
#[derive(Debug, thiserror::Error)]
pub enum FlightRecordError {
    /// The record could not be written.
    #[error("record of the flight: {0}")]
    Record(#[from] RecordError),
    /// The scenario cannot have the length of the flight.
    #[error("record of the flight: {reason}; it stays unfinished in {kept}")]
    Length {
        /// What is wrong.
        reason: String,
        /// Folder of the unfinished record.
        kept: String,
    },
}

/// Writes all frames; returns the writer and the length of the record.
fn write(
    receiver: &Receiver<Frame>,
    mut writer: Option<Writer>,
    mut steps: TimeSteps,
    mut look: impl FnMut(&Frame),
    warn: impl Fn(&str),
) -> (Option<Writer>, Duration) {
    while let Ok(frame) = receiver.recv() {
        if steps.last.is_none() {
            writer = kept(writer, |writer| writer.begin_at(unix_us(frame.time_us)), &warn);
        }
        for frame in steps.place(frame) {
            writer = kept(writer, |writer| writer.frame(&frame), &warn);
            look(&frame);
        }
    }
    // A record without frames is not kept.
    let length = steps.length();
    (writer.filter(|_| length.is_some()), length.unwrap_or(steps.period))
}

/// Returns the writer unless the record cannot be written, because the flight is more important than its record.
fn kept(
    mut writer: Option<Writer>,
    write: impl FnOnce(&mut Writer) -> Result<(), RecordError>,
    warn: impl Fn(&str),
) -> Option<Writer> {
    if let Some(failed) = writer.as_mut().and_then(|writer| write(writer).err()) {
        warn(&format!("warning: the record of the flight ends here: {failed}"));
        return None;
    }
    writer
}

/// Places the frames of a flight at the time steps of its record, which begin at 0 and are one period apart.
struct TimeSteps {
    period: Duration,
    /// The team's time of the last frame, and the frame.
    last: Option<(i64, Frame)>,
}

impl TimeSteps {
    fn new(period: Duration) -> Self {
        Self { period, last: None }
    }

    /// Returns the frames to add: those of missed time steps, then this one.
    fn place(&mut self, frame: Frame) -> Vec<Frame> {
        let time_us = frame.time_us;
        let Some((last_us, last)) = self.last.take() else {
            let first = Frame { time_us: 0, ..frame };
            self.last = Some((time_us, first.clone()));
            return vec![first];
        };
        let gap_us = time_us.saturating_sub(last_us);
        if gap_us == 0 {
            self.last = Some((last_us, last));
            return Vec::new();
        }
        let is_gap = (0..=GAP_MAX.us()).contains(&gap_us);
        let count = if is_gap { (gap_us / self.period.us()).max(1) } else { 1 };
        let at = |nth: i64| last.time_us + nth * self.period.us();
        let mut placed: Vec<Frame> =
            (1..count).map(|nth| Frame { time_us: at(nth), ..without_news(last.clone()) }).collect();
        let this = Frame { time_us: at(count), ..frame };
        self.last = Some((time_us, this.clone()));
        placed.push(this);
        placed
    }

    /// Length of the record, at least one period; `None` without frames.
    fn length(&self) -> Option<Duration> {
        self.last.as_ref().map(|(_, last)| Duration::from_us(last.time_us.max(self.period.us())))
    }
}

/// The rows of a time step that was missed: those before it, without what happened then.
fn without_news(mut frame: Frame) -> Frame {
    frame.detections.clear();
    frame.events.clear();
    frame.uavs.iter_mut().for_each(|row| row.boresight_rad = None);
    frame
}

#[cfg(test)]
mod tests {
    use super::*;
    use standoff_record::{DetectionRow, Manifest, Record, UavRow};

    const PERIOD: Duration = Duration::from_us(500_000);

    fn frame(time_us: i64, x_m: f64) -> Frame {
        let uav = UavRow { x_m, boresight_rad: Some(1.0), ..UavRow::default() };
        Frame { time_us, uavs: vec![uav], detections: vec![DetectionRow::default()], ..Frame::default() }
    }

    #[test]
    fn missed_time_steps_repeat_the_last_rows_without_detections_and_a_set_clock_leaves_no_gap() {
        let mut steps = TimeSteps::new(PERIOD);
        let start_us = 7_000_000_000;
        let mut placed = Vec::new();
        // Two missed steps, a repeated one, and a clock that is set by an hour, then back.
        for (at_us, x_m) in
            [(0, 0.0), (500_000, 1.0), (2_000_000, 4.0), (2_000_000, 5.0), (3_602_000_000, 6.0), (1_000_000, 7.0)]
        {
            placed.extend(steps.place(frame(start_us + at_us, x_m)));
        }
        let rows: Vec<_> =
            placed.iter().map(|frame| (frame.time_us, frame.uavs[0].x_m, frame.detections.len())).collect();
        let half_s = |n: i64| n * 500_000;
        let expected = [(0, 0.0, 1), (1, 1.0, 1), (2, 1.0, 0), (3, 1.0, 0), (4, 4.0, 1), (5, 6.0, 1), (6, 7.0, 1)];
        assert_eq!(rows, expected.map(|(n, x_m, count)| (half_s(n), x_m, count)));
        assert_eq!(placed[2].uavs[0].boresight_rad, None);
        assert_eq!(steps.length(), Some(Duration::from_us(3_000_000)));
    }

    fn writer(home: &tempfile::TempDir) -> Writer {
        let manifest = Manifest { begin_unix_us: Some(0), ..Manifest::new("flight", 0, 86_400.0, PERIOD.s()) };
        Writer::create(&home.path().join("flight"), &manifest, "", &[]).unwrap().without_truth().unwrap()
    }

    #[test]
    fn a_finished_record_has_the_length_of_the_flight_and_no_truth() {
        let home = tempfile::tempdir().unwrap();
        let seen = std::sync::Arc::new(std::sync::Mutex::new(0));
        let count = std::sync::Arc::clone(&seen);
        let look = move |_: &Frame| *count.lock().unwrap() += 1;
        let recorder = FlightRecorder::start(Some(writer(&home)), PERIOD, look, |_| {}).unwrap();
        (0..5).for_each(|n| recorder.add(frame(n * PERIOD.us(), 0.0)));
        let length = recorder.finish(|duration_s| Ok(format!("duration_s = {duration_s}"))).unwrap();
        assert_eq!((length, *seen.lock().unwrap()), (Some(Duration::from_s(2.0)), 5));
        let record = Record::open(&home.path().join("flight")).unwrap();
        assert_eq!(
            (record.manifest().duration_s, record.scenario_toml(), record.has_truth()),
            (2.0, "duration_s = 2", false)
        );
        assert_eq!(record.frames().unwrap().map(Result::unwrap).count(), 5);
        // The team's time counts from 2026.
        assert_eq!(record.manifest().begin_unix_us, Some(1_767_225_600_000_000));
    }

    #[test]
    fn an_interrupted_record_is_readable_up_to_its_last_checkpoint() {
        let home = tempfile::tempdir().unwrap();
        let mut writer = writer(&home);
        (0..5).for_each(|n| writer.frame(&frame(n * PERIOD.us(), 0.0)).unwrap());
        writer.checkpoint().unwrap();
        // As if the process were killed.
        let folder = home.path().join("flight.partial");
        let record = Record::open(&folder).unwrap();
        assert_eq!((record.ends_s(), record.has_truth()), (Some(2.0), false));
        assert_eq!(record.frames().unwrap().map(Result::unwrap).count(), 5);
        std::mem::forget(writer);
    }

    #[test]
    fn a_flight_goes_on_without_a_record_that_cannot_be_written() {
        let home = tempfile::tempdir().unwrap();
        let warnings = std::sync::Arc::new(std::sync::Mutex::new(Vec::new()));
        let heard = std::sync::Arc::clone(&warnings);
        let warn = move |text: &str| heard.lock().unwrap().push(text.to_owned());
        let recorder = FlightRecorder::start(Some(writer(&home)), PERIOD, |_| {}, warn).unwrap();
        // A frame without a UAV is refused.
        recorder.add(Frame::default());
        recorder.add(frame(PERIOD.us(), 0.0));
        assert_eq!(recorder.finish(|_| Ok(String::new())).unwrap(), None);
        let warnings = warnings.lock().unwrap();
        assert!(warnings.len() == 1 && warnings[0].contains("the record of the flight ends here"), "{warnings:?}");
    }
}
