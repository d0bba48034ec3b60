//! What an agent has heard: the latest report of every UAV and the cues of this instant, each counted once.
//!
//! A report counts for the instant at which its scan was made; one from another instant is refused and counted. One that
//! repeats what was heard changes nothing. Of several reports of one UAV, or cues of one target, at one instant one
//! counts, whichever comes first. And no message counts beyond its instant: none can silence a UAV for longer.

use core::cmp::Ordering;

use crate::message::{Cue, Detection, Message, Report, Scan};
use crate::time::{Duration, Time};
use crate::uav::{UavId, UavState};

/// More UAVs than this at a time are not listened to: a team is a few.
const TEAM_MAX: usize = 256;

/// What an agent has heard.
#[derive(Debug, Clone)]
pub(crate) struct Inbox {
    now: Time,
    /// A UAV not heard for longer than this counts as lost.
    timeout: Duration,
    /// The latest of every UAV that does not count as lost, by ascending UAV.
    latest: Vec<Report>,
    /// By ascending label, no label twice.
    cues: Vec<Cue>,
    refused: u32,
}

impl Inbox {
    /// Nothing heard yet.
    pub(crate) fn new(timeout: Duration) -> Self {
        Self { now: Time::START, timeout, latest: Vec::new(), cues: Vec::new(), refused: 0 }
    }

    /// Turns to a new instant: what was heard before counts no more, and who counts as lost is forgotten.
    pub(crate) fn open(&mut self, now: Time) {
        self.cues.clear();
        self.now = now;
        let timeout = self.timeout;
        self.latest.retain(|report| now - report.time <= timeout);
    }

    /// Forgets what was heard; what was refused stays counted.
    pub(crate) fn reset(&mut self) {
        self.latest.clear();
        self.cues.clear();
    }

    /// Messages refused so far: from another instant, a second report of one, or nonsense.
    pub(crate) fn refused(&self) -> u32 {
        self.refused
    }

    pub(crate) fn hear(&mut self, message: &Message) {
        match message {
            Message::Report(report) => self.hear_report(report),
            Message::Cue(cue) => self.hear_cue(cue),
        }
    }

    pub(crate) fn hear_report(&mut self, report: &Report) {
        let Report { uav, epoch, sequence, time, state, boresight, ref detections } = *report;
        self.hear_scan(uav, (epoch, sequence), time, &state, Scan { boresight, detections });
    }

    /// A report in parts, wherever they are kept; `stamp` is its epoch and sequence.
    pub(crate) fn hear_scan(&mut self, uav: UavId, stamp: (u32, u32), time: Time, state: &UavState, scan: Scan) {
        let sound = state.is_finite() && scan.boresight.is_none_or(|angle| angle.rad().is_finite());
        if time != self.now || !sound {
            return self.refuse();
        }
        let index = match self.latest.binary_search_by_key(&uav, |report| report.uav) {
            Ok(index) => {
                let latest = &self.latest[index];
                if latest.time == time {
                    // Another scan of the same instant is not to be had: the one said first counts.
                    match stamp.cmp(&(latest.epoch, latest.sequence)) {
                        // The same again changes nothing.
                        Ordering::Equal => return,
                        Ordering::Greater => return self.refuse(),
                        Ordering::Less => self.refuse(),
                    }
                }
                index
            }
            Err(_) if self.latest.len() >= TEAM_MAX => return self.refuse(),
            Err(index) => {
                let (state, boresight, detections) = (*state, None, Vec::new());
                self.latest.insert(index, Report { uav, epoch: 0, sequence: 0, time, state, boresight, detections });
                index
            }
        };
        let latest = &mut self.latest[index];
        (latest.epoch, latest.sequence) = stamp;
        (latest.time, latest.state, latest.boresight) = (time, *state, scan.boresight);
        keep_sound(scan.detections, &mut latest.detections);
    }

    pub(crate) fn hear_cue(&mut self, cue: &Cue) {
        if !cue.is_sound() || cue.time > self.now {
            return self.refuse();
        }
        match self.cues.binary_search_by_key(&cue.label, |cue| cue.label) {
            Ok(index) if counts_before(cue, &self.cues[index]) => self.cues[index] = *cue,
            Ok(_) => {}
            Err(index) => self.cues.insert(index, *cue),
        }
    }

    fn refuse(&mut self) {
        self.refused = self.refused.saturating_add(1);
    }

    /// The latest reports of all who do not count as lost, by ascending UAV.
    pub(crate) fn latest(&self) -> &[Report] {
        &self.latest
    }

    /// The reports of this instant, by ascending UAV.
    pub(crate) fn reports(&self) -> impl Iterator<Item = &Report> + Clone {
        self.latest.iter().filter(|report| report.time == self.now)
    }

    /// Where a UAV has said it is, if it has at this instant.
    pub(crate) fn state_of(&self, uav: UavId) -> Option<&UavState> {
        let index = self.latest.binary_search_by_key(&uav, |report| report.uav).ok()?;
        Some(&self.latest[index]).filter(|report| report.time == self.now).map(|report| &report.state)
    }

    /// The cues of this instant, by ascending label.
    pub(crate) fn cues(&self) -> &[Cue] {
        &self.cues
    }
}

/// Makes `kept` what is sound of a scan, by ascending label, no label twice.
pub(crate) fn keep_sound(detections: &[Detection], kept: &mut Vec<Detection>) {
    kept.clear();
    kept.extend_from_slice(detections);
    if !kept.iter().all(Detection::is_sound) {
        kept.retain(Detection::is_sound);
    }
    if !kept.is_sorted_by(|a, b| a.label < b.label) {
        kept.sort_by_key(|detection| detection.label);
        kept.dedup_by_key(|detection| detection.label);
    }
}

/// Of two cues of one target this one counts: the newest, of those the surest; then any order that all share.
fn counts_before(cue: &Cue, other: &Cue) -> bool {
    let numbers = |cue: &Cue| {
        let Cue { position, velocity, position_sd_m, velocity_sd_m_s, .. } = *cue;
        [position_sd_m, velocity_sd_m_s, position.x_m(), position.y_m(), velocity.x_m_s(), velocity.y_m_s()]
    };
    let mut pairs = numbers(cue).into_iter().zip(numbers(other));
    let by_numbers = pairs.find_map(|(a, b)| Some(a.total_cmp(&b)).filter(|order| order.is_ne()));
    other.time.cmp(&cue.time).then(by_numbers.unwrap_or(Ordering::Equal)).is_lt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Position;
    use crate::message::TargetLabel;
    use crate::sensor::RangeBearing;
    use crate::{Angle, Velocity};

    fn report(uav: u32, epoch: u32, sequence: u32, us: i64) -> Report {
        let state =
            UavState { position: Position::ORIGIN, heading: Angle::ZERO, speed_m_s: 40.0, turn_rate_rad_s: 0.0 };
        let time = Time::from_us(us);
        Report { uav: UavId(uav), epoch, sequence, time, state, boresight: None, detections: Vec::new() }
    }

    fn heard(inbox: &Inbox) -> Vec<(u32, u32)> {
        inbox.reports().map(|report| (report.uav.0, report.sequence)).collect()
    }

    #[test]
    fn reports_are_kept_in_the_order_of_ids_whatever_order_they_come_in() {
        let mut inbox = Inbox::new(Duration::from_us(3_000_000));
        inbox.open(Time::from_us(5));
        for uav in [3, 1, 2] {
            inbox.hear_report(&report(uav, 0, 9, 5));
        }
        assert_eq!(heard(&inbox), [(1, 9), (2, 9), (3, 9)]);
    }

    #[test]
    fn a_duplicate_changes_nothing_and_a_replay_is_refused() {
        let mut inbox = Inbox::new(Duration::from_us(3_000_000));
        inbox.open(Time::from_us(5));
        inbox.hear_report(&report(1, 0, 9, 5));
        inbox.hear_report(&report(1, 0, 9, 5));
        assert_eq!((heard(&inbox), inbox.refused()), (vec![(1, 9)], 0));
        inbox.open(Time::from_us(6));
        inbox.hear_report(&report(1, 0, 9, 5));
        assert_eq!((heard(&inbox), inbox.refused()), (vec![], 1));
        // After a restart the count begins again.
        inbox.hear_report(&report(1, 1, 0, 6));
        assert_eq!(heard(&inbox), [(1, 0)]);
    }

    /// Whatever a report says of its epoch and its place in it, the UAV is heard again at the next instant.
    #[test]
    fn no_report_silences_its_uav() {
        for wrong in [report(1, u32::MAX, u32::MAX, 5), report(1, 0, 0, 5)] {
            let (mut inbox, mut reversed) =
                (Inbox::new(Duration::from_us(3_000_000)), Inbox::new(Duration::from_us(3_000_000)));
            inbox.open(Time::from_us(5));
            inbox.hear_report(&wrong);
            inbox.hear_report(&report(1, 0, 9, 5));
            // The one said first counts, whichever is heard first, and the other is told of.
            reversed.open(Time::from_us(5));
            reversed.hear_report(&report(1, 0, 9, 5));
            reversed.hear_report(&wrong);
            assert_eq!(heard(&inbox), [(1, wrong.sequence.min(9))]);
            assert_eq!((heard(&reversed), reversed.refused()), (heard(&inbox), 1));
            assert_eq!(inbox.refused(), 1);
            inbox.open(Time::from_us(6));
            inbox.hear_report(&report(1, 0, 10, 6));
            assert_eq!((heard(&inbox), inbox.refused()), (vec![(1, 10)], 1));
        }
    }

    #[test]
    fn uavs_that_count_as_lost_make_room() {
        let mut inbox = Inbox::new(Duration::from_us(3_000_000));
        inbox.open(Time::from_us(5));
        for ghost in 0..TEAM_MAX as u32 + 1 {
            inbox.hear_report(&report(1000 + ghost, 0, 1, 5));
        }
        assert_eq!((heard(&inbox).len(), inbox.refused()), (TEAM_MAX, 1));
        for (us, is_heard) in [(3_000_005, false), (3_000_006, true)] {
            inbox.open(Time::from_us(us));
            inbox.hear_report(&report(1, 0, 9, us));
            assert_eq!(heard(&inbox), if is_heard { vec![(1, 9)] } else { vec![] });
        }
    }

    #[test]
    fn reports_of_another_instant_and_nonsense_are_refused() {
        let mut inbox = Inbox::new(Duration::from_us(3_000_000));
        inbox.open(Time::from_us(5));
        inbox.hear_report(&report(1, 0, 1, 4));
        inbox.hear_report(&report(1, 0, 1, 6));
        let mut nonsense = report(1, 0, 1, 5);
        nonsense.state.speed_m_s = f64::NAN;
        inbox.hear_report(&nonsense);
        assert_eq!((heard(&inbox), inbox.refused()), (vec![], 3));
    }

    #[test]
    fn detections_that_no_sensor_makes_are_dropped() {
        let detection = |target, range_m| Detection {
            label: TargetLabel(target),
            measurement: RangeBearing { range_m, bearing: Angle::ZERO },
        };
        let mut inbox = Inbox::new(Duration::from_us(3_000_000));
        inbox.open(Time::START);
        let mut said = report(1, 0, 1, 0);
        said.detections = vec![detection(4, 10.0), detection(2, f64::NAN), detection(1, 5.0), detection(4, 11.0)];
        inbox.hear_report(&said);
        let kept: Vec<_> =
            inbox.reports().flat_map(|r| &r.detections).map(|d| (d.label.0, d.measurement.range_m)).collect();
        assert_eq!(kept, [(1, 5.0), (4, 10.0)]);
    }

    fn cue() -> Cue {
        Cue {
            label: TargetLabel(1),
            time: Time::START,
            position: Position::ORIGIN,
            velocity: Velocity::ZERO,
            position_sd_m: 20.0,
            velocity_sd_m_s: 3.0,
        }
    }

    #[test]
    fn a_cue_counts_once_and_only_if_sound() {
        let mut inbox = Inbox::new(Duration::from_us(3_000_000));
        inbox.open(Time::START);
        inbox.hear(&Message::Cue(cue()));
        inbox.hear(&Message::Cue(Cue { position: Position::from_m(9.0, 9.0), ..cue() }));
        inbox.hear(&Message::Cue(Cue { label: TargetLabel(2), velocity_sd_m_s: -1.0, ..cue() }));
        assert_eq!(inbox.cues(), [cue()]);
        assert_eq!(inbox.refused(), 1);
    }

    /// The newest, of those the surest, and of those always the same.
    #[test]
    fn which_of_several_cues_counts_is_no_matter_of_order() {
        let best_first = [
            Cue { time: Time::from_us(7), position_sd_m: 90.0, ..cue() },
            Cue { position_sd_m: 19.0, velocity_sd_m_s: 9.0, ..cue() },
            Cue { velocity_sd_m_s: 2.0, ..cue() },
            Cue { position: Position::from_m(-1.0, 5.0), ..cue() },
            Cue { position: Position::from_m(0.0, -1.0), ..cue() },
            Cue { velocity: Velocity::from_m_s(-0.0, 9.0), ..cue() },
            Cue { velocity: Velocity::from_m_s(0.0, -9.0), ..cue() },
            cue(),
        ];
        for (rank, better) in best_first.iter().enumerate() {
            for worse in &best_first[rank + 1..] {
                for heard in [[better, worse], [worse, better]] {
                    let mut inbox = Inbox::new(Duration::from_us(3_000_000));
                    inbox.open(Time::from_us(7));
                    heard.into_iter().for_each(|cue| inbox.hear_cue(cue));
                    assert_eq!(format!("{:?}", inbox.cues()), format!("{:?}", [better]));
                }
            }
        }
    }
}
