//! What an agent has heard: the latest report of every UAV and the cues of this instant, each counted once.
//!
//! A report counts for the instant at which its scan was made. One that repeats what was heard changes nothing; one
//! from another instant is refused and counted.

use crate::angle::Angle;
use crate::message::{Cue, Detection, Message, Report};
use crate::time::{Duration, Time};
use crate::uav::{UavId, UavState};

/// More UAVs than this are not listened to: a team is a few.
const TEAM_MAX: usize = 256;

/// A UAV not heard for longer than this counts as lost.
const TEAMMATE_TIMEOUT: Duration = Duration::from_us(3_000_000);

/// What an agent has heard.
#[derive(Debug, Clone, Default)]
pub(crate) struct Inbox {
    now: Time,
    /// By ascending UAV.
    slots: Vec<Slot>,
    /// By ascending target, no target twice.
    cues: Vec<Cue>,
    refused: u32,
}

/// One UAV's latest report.
#[derive(Debug, Clone)]
struct Slot {
    report: Report,
    /// Epoch and sequence of the last report of an earlier instant.
    before: Option<(u32, u32)>,
}

/// A report as it is said, wherever it is kept.
pub(crate) struct Said<'a> {
    pub(crate) uav: UavId,
    /// Epoch and sequence.
    pub(crate) stamp: (u32, u32),
    pub(crate) time: Time,
    pub(crate) state: UavState,
    pub(crate) boresight: Option<Angle>,
    pub(crate) detections: &'a [Detection],
}

/// A teammate, carried on to now.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Teammate {
    pub(crate) uav: UavId,
    pub(crate) state: UavState,
    /// Where its sensor points, if it was heard at this very instant.
    pub(crate) boresight: Option<Angle>,
}

impl Inbox {
    /// Turns to a new instant: what was heard before counts no more.
    pub(crate) fn open(&mut self, now: Time) {
        for slot in &mut self.slots {
            slot.before = Some((slot.report.epoch, slot.report.sequence));
        }
        self.cues.clear();
        self.now = now;
    }

    /// Messages refused so far: from another instant, a replay, or nonsense.
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
        self.hear_said(&Said { uav, stamp: (epoch, sequence), time, state, boresight, detections });
    }

    pub(crate) fn hear_said(&mut self, said: &Said) {
        let sound = said.state.is_finite() && said.boresight.is_none_or(|angle| angle.rad().is_finite());
        if said.time != self.now || !sound {
            self.refuse();
            return;
        }
        let index = match self.slots.binary_search_by_key(&said.uav, |slot| slot.report.uav) {
            Ok(index) => index,
            Err(_) if self.slots.len() >= TEAM_MAX => return self.refuse(),
            Err(index) => {
                self.slots.insert(index, Slot { report: said.unheard(), before: None });
                index
            }
        };
        let slot = &mut self.slots[index];
        if slot.report.time == self.now {
            // The same again changes nothing; another scan of the same instant is not to be had.
            if said.stamp != (slot.report.epoch, slot.report.sequence) {
                self.refuse();
            }
            return;
        }
        if slot.before.is_some_and(|before| said.stamp <= before) {
            return self.refuse();
        }
        said.copy_to(&mut slot.report);
    }

    pub(crate) fn hear_cue(&mut self, cue: &Cue) {
        if !cue.is_sound() || cue.time > self.now {
            return self.refuse();
        }
        if let Err(index) = self.cues.binary_search_by_key(&cue.target, |cue| cue.target) {
            self.cues.insert(index, *cue);
        }
    }

    fn refuse(&mut self) {
        self.refused = self.refused.saturating_add(1);
    }

    /// The reports of this instant, by ascending UAV.
    pub(crate) fn reports(&self) -> impl Iterator<Item = &Report> + Clone {
        self.slots.iter().map(|slot| &slot.report).filter(|report| report.time == self.now)
    }

    /// The cues of this instant, by ascending target.
    pub(crate) fn cues(&self) -> &[Cue] {
        &self.cues
    }

    /// The team: everybody heard of late, by ascending UAV, and where they would be now.
    pub(crate) fn teammates(&self, now: Time) -> impl Iterator<Item = Teammate> {
        let of_late = self.slots.iter().filter(move |slot| now - slot.report.time <= TEAMMATE_TIMEOUT);
        of_late.map(move |slot| {
            let Report { uav, time, mut state, boresight, .. } = slot.report;
            if time < now {
                state.position = state.position + state.velocity() * (now - time).s();
            }
            Teammate { uav, state, boresight: boresight.filter(|_| time == now) }
        })
    }
}

impl Said<'_> {
    /// A report in whose place this one is the first: of an instant in the past.
    fn unheard(&self) -> Report {
        let Said { uav, stamp: (epoch, sequence), state, boresight, .. } = *self;
        Report { uav, epoch, sequence, time: Time::from_us(i64::MIN), state, boresight, detections: Vec::new() }
    }

    /// Copies it into an old report's place: sound detections only, by ascending target, no target twice.
    fn copy_to(&self, to: &mut Report) {
        (to.uav, (to.epoch, to.sequence)) = (self.uav, self.stamp);
        (to.time, to.state, to.boresight) = (self.time, self.state, self.boresight);
        to.detections.clear();
        to.detections.extend_from_slice(self.detections);
        if !to.detections.iter().all(Detection::is_sound) {
            to.detections.retain(Detection::is_sound);
        }
        if !to.detections.is_sorted_by(|a, b| a.target < b.target) {
            to.detections.sort_by_key(|detection| detection.target);
            to.detections.dedup_by_key(|detection| detection.target);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Position;
    use crate::sensor::RangeBearing;
    use crate::target::TargetId;
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
        let mut inbox = Inbox::default();
        inbox.open(Time::from_us(5));
        for uav in [3, 1, 2] {
            inbox.hear_report(&report(uav, 0, 9, 5));
        }
        assert_eq!(heard(&inbox), [(1, 9), (2, 9), (3, 9)]);
    }

    #[test]
    fn a_duplicate_changes_nothing_and_a_replay_is_refused() {
        let mut inbox = Inbox::default();
        inbox.open(Time::from_us(5));
        inbox.hear_report(&report(1, 0, 9, 5));
        inbox.hear_report(&report(1, 0, 9, 5));
        assert_eq!((heard(&inbox), inbox.refused()), (vec![(1, 9)], 0));
        inbox.open(Time::from_us(6));
        inbox.hear_report(&report(1, 0, 9, 6));
        assert_eq!((heard(&inbox), inbox.refused()), (vec![], 1));
        // After a restart the count begins again.
        inbox.hear_report(&report(1, 1, 0, 6));
        assert_eq!(heard(&inbox), [(1, 0)]);
    }

    #[test]
    fn reports_of_another_instant_and_nonsense_are_refused() {
        let mut inbox = Inbox::default();
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
            target: TargetId(target),
            measurement: RangeBearing { range_m, bearing: Angle::ZERO },
        };
        let mut inbox = Inbox::default();
        inbox.open(Time::START);
        let mut said = report(1, 0, 1, 0);
        said.detections = vec![detection(4, 10.0), detection(2, f64::NAN), detection(1, 5.0), detection(4, 11.0)];
        inbox.hear_report(&said);
        let kept: Vec<_> =
            inbox.reports().flat_map(|r| &r.detections).map(|d| (d.target.0, d.measurement.range_m)).collect();
        assert_eq!(kept, [(1, 5.0), (4, 10.0)]);
    }

    #[test]
    fn a_cue_counts_once_and_only_if_sound() {
        let cue = Cue {
            target: TargetId(1),
            time: Time::START,
            position: Position::ORIGIN,
            velocity: Velocity::ZERO,
            position_sd_m: 20.0,
            velocity_sd_m_s: 3.0,
        };
        let mut inbox = Inbox::default();
        inbox.open(Time::START);
        inbox.hear(&Message::Cue(cue));
        inbox.hear(&Message::Cue(Cue { position: Position::from_m(9.0, 9.0), ..cue }));
        inbox.hear(&Message::Cue(Cue { target: TargetId(2), velocity_sd_m_s: -1.0, ..cue }));
        assert_eq!(inbox.cues(), [cue]);
        assert_eq!(inbox.refused(), 1);
    }
}
