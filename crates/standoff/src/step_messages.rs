//! Messages of one time step: at most one report of each UAV, and cues; each counts once.
//!
//! Of several reports of one UAV, the one that was sent first counts, in whatever order they arrive. Agents that have
//! received the same entries therefore store the same messages.

use core::cmp::Ordering;

use crate::angle::Angle;
use crate::group_id::GroupId;
use crate::message::{Cue, Detection, Manoeuvre, Report, Scan, TARGETS_MAX, TEAM_MAX};
use crate::time::Time;
use crate::uav::{UavId, UavState};

/// Result of inserting a report or cue.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Insert {
    /// It was not known and counts.
    Added,
    /// It is a duplicate.
    Duplicate,
    /// It is malformed, or another one from the same source counts.
    Rejected,
    /// It counts and replaces another one.
    Replaced,
}

/// View of a report's content, independent of where it is stored.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ReportView<'a> {
    pub(crate) uav: UavId,
    /// Restart count and sequence number.
    pub(crate) order: (u32, u32),
    pub(crate) state: &'a UavState,
    pub(crate) scan: Scan<'a>,
    pub(crate) assigned_group: Option<GroupId>,
    pub(crate) is_leaving: bool,
    pub(crate) manoeuvre: Option<Manoeuvre>,
}

impl<'a> ReportView<'a> {
    pub(crate) fn of(report: &'a Report) -> Self {
        let Report {
            uav,
            restart_count,
            sequence,
            ref state,
            boresight,
            ref detections,
            assigned_group: assignment,
            is_leaving,
            manoeuvre,
            ..
        } = *report;
        Self {
            uav,
            order: (restart_count, sequence),
            state,
            scan: Scan { boresight, detections },
            assigned_group: assignment,
            is_leaving,
            manoeuvre,
        }
    }
}

/// Reports and cues of a time step.
#[derive(Debug, Clone, Default)]
pub(crate) struct StepMessages {
    /// Time of the time step.
    pub(crate) time: Time,
    /// Reports by ascending UAV. The first `report_count` entries are valid; the others are reusable buffers.
    reports: Vec<Report>,
    report_count: usize,
    /// Cues by ascending label, those without label last; of several cues for one target, the one that counts comes
    /// first.
    cues: Vec<Cue>,
    /// Source and number of each cue, ascending.
    cue_numbers: Vec<(u32, u16)>,
}

impl StepMessages {
    /// Starts another time step without messages.
    pub(crate) fn open(&mut self, time: Time) {
        self.time = time;
        self.cues.clear();
        self.cue_numbers.clear();
        self.report_count = 0;
    }

    /// Reports by ascending UAV.
    pub(crate) fn reports(&self) -> &[Report] {
        &self.reports[..self.report_count]
    }

    /// Returns the report of a UAV.
    pub(crate) fn report_of(&self, uav: UavId) -> Option<&Report> {
        self.reports().binary_search_by_key(&uav, |report| report.uav).ok().map(|index| &self.reports[index])
    }

    /// Cues by ascending label; of several cues for one target, the first one counts.
    pub(crate) fn cues(&self) -> &[Cue] {
        &self.cues
    }

    /// Inserts a report. Detections with a range above `range_max_m` are dropped. If it has no others, its sensor has
    /// failed, so the scan counts as none.
    pub(crate) fn put(&mut self, incoming: ReportView, range_max_m: f64) -> Insert {
        let ReportView { uav, order, state, mut scan, assigned_group: assignment, is_leaving, manoeuvre } = incoming;
        if !scan.detections.is_empty() && scan.detections.iter().all(|of| of.is_beyond(range_max_m)) {
            scan = Scan::default();
        }
        let manoeuvre = manoeuvre.map(Manoeuvre::rounded);
        let incoming = ReportView { scan, manoeuvre, ..incoming };
        let is_valid = state.is_valid()
            && manoeuvre.is_none_or(|of| of.is_valid())
            && scan.boresight.is_none_or(|angle| angle.rad().is_finite());
        if !is_valid || scan.detections.len() > TARGETS_MAX {
            return Insert::Rejected;
        }
        let (index, put) = match self.reports().binary_search_by_key(&uav, |report| report.uav) {
            Ok(index) => {
                let known = &self.reports[index];
                match order
                    .cmp(&(known.restart_count, known.sequence))
                    .then_with(|| any_order(&incoming, known, range_max_m))
                {
                    Ordering::Equal => return Insert::Duplicate,
                    Ordering::Greater => return Insert::Rejected,
                    Ordering::Less => (index, Insert::Replaced),
                }
            }
            Err(_) if self.report_count >= TEAM_MAX => return Insert::Rejected,
            Err(index) => {
                if self.reports.len() == self.report_count {
                    self.reports.push(Report::position_only(uav, self.time, *state));
                }
                self.reports[index..=self.report_count].rotate_right(1);
                self.report_count += 1;
                (index, Insert::Added)
            }
        };
        let report = &mut self.reports[index];
        copy_valid(scan.detections, range_max_m, &mut report.detections);
        (report.uav, report.time, report.state, report.boresight) = (uav, self.time, *state, scan.boresight);
        (report.restart_count, report.sequence) = order;
        (report.assigned_group, report.is_leaving, report.manoeuvre) = (assignment, is_leaving, manoeuvre);
        put
    }

    /// True if the maximum number of cues is stored.
    pub(crate) fn is_full(&self) -> bool {
        self.cues.len() >= TARGETS_MAX
    }

    /// Inserts a cue. If there are too many, those first in order are kept, in whatever order they arrive.
    pub(crate) fn put_cue(&mut self, cue: &Cue) -> Insert {
        let is_beyond = |last: &Cue| self.is_full() && counting_order(last, cue).is_lt();
        if !cue.is_valid() || cue.time > self.time || self.cues.last().is_some_and(is_beyond) {
            return Insert::Rejected;
        }
        let mut put = Insert::Added;
        // A cue with the same source and number but other content, for any target, is the same entry.
        let number = (cue.source, cue.sequence);
        match self.cue_numbers.binary_search(&number) {
            Ok(_) => {
                let is_same = |known: &Cue| (known.source, known.sequence) == number;
                let Some(index) = self.cues.iter().position(is_same) else { return Insert::Rejected };
                match counting_order(cue, &self.cues[index]) {
                    Ordering::Equal => return Insert::Duplicate,
                    Ordering::Greater => return Insert::Rejected,
                    Ordering::Less => put = Insert::Replaced,
                }
                self.cues.remove(index);
            }
            Err(index) => self.cue_numbers.insert(index, number),
        }
        let place = self.cues.partition_point(|known| counting_order(known, cue).is_lt());
        self.cues.insert(place, *cue);
        if self.cues.len() > TARGETS_MAX
            && let Some(last) = self.cues.pop()
            && let Ok(index) = self.cue_numbers.binary_search(&(last.source, last.sequence))
        {
            self.cue_numbers.remove(index);
        }
        put
    }
}

/// Orders two different reports with the same restart count and sequence number: an arbitrary order that all agents
/// share.
#[cold]
fn any_order(incoming: &ReportView, known: &Report, range_max_m: f64) -> Ordering {
    let bits = |state: &UavState, boresight: Option<Angle>| {
        let UavState { position, heading, speed_m_s, turn_rate_rad_s, vertical } = *state;
        let numbers = [position.x_m(), position.y_m(), heading.rad(), speed_m_s, turn_rate_rad_s].map(f64::to_bits);
        let vertical = vertical.map(|vertical| vertical.numbers().map(f64::to_bits));
        (numbers, vertical, boresight.map(|boresight| boresight.rad().to_bits()))
    };
    let intent = |manoeuvre: Option<Manoeuvre>| manoeuvre.map(|manoeuvre| manoeuvre.order());
    let heads = (bits(incoming.state, incoming.scan.boresight), incoming.assigned_group, incoming.is_leaving);
    let known_heads = (bits(&known.state, known.boresight), known.assigned_group, known.is_leaving);
    let by_intent = intent(incoming.manoeuvre).cmp(&intent(known.manoeuvre));
    heads.cmp(&known_heads).then(by_intent).then_with(|| {
        // Usually the two reports are equal.
        if incoming.scan.detections.iter().map(Detection::order).eq(known.detections.iter().map(Detection::order)) {
            return Ordering::Equal;
        }
        let mut kept = Vec::new();
        copy_valid(incoming.scan.detections, range_max_m, &mut kept);
        kept.iter().map(Detection::order).cmp(known.detections.iter().map(Detection::order))
    })
}

/// Copies the valid detections of a scan into `kept`: by ascending label without duplicates, then those without label in
/// the order of their bits. Of these, none is a duplicate: two targets can give equal measurements.
fn copy_valid(detections: &[Detection], range_max_m: f64, kept: &mut Vec<Detection>) {
    kept.clear();
    kept.extend_from_slice(detections);
    for detection in kept.iter_mut().filter(|of| of.label.is_none() || of.range_rate_m_s.is_some()) {
        *detection = detection.rounded();
    }
    let counts = |detection: &Detection| detection.is_valid() && !detection.is_beyond(range_max_m);
    if !kept.iter().all(counts) {
        kept.retain(counts);
    }
    let is_in_order = |a: &Detection, b: &Detection| match (a.label, b.label) {
        (Some(a), Some(b)) => a < b,
        (Some(_), None) => true,
        (None, Some(_)) => false,
        (None, None) => a.order() <= b.order(),
    };
    if !kept.is_sorted_by(is_in_order) {
        kept.sort_by_key(|detection| (detection.label.is_none(), detection.label));
        kept.dedup_by(|a, b| a.label.is_some() && a.label == b.label);
        let labelled_count = Detection::split(kept).0.len();
        kept[labelled_count..].sort_by_key(Detection::order);
    }
}

/// By label, those without label last; of one target the newest first, then the most accurate; then an arbitrary order
/// that all agents share.
fn counting_order(cue: &Cue, other: &Cue) -> Ordering {
    let numbers = |cue: &Cue| {
        let Cue { position, velocity, position_sd_m, velocity_sd_m_s, priority, .. } = *cue;
        let [x_m, y_m, vx_m_s, vy_m_s] = [position.x_m(), position.y_m(), velocity.x_m_s(), velocity.y_m_s()];
        [position_sd_m, velocity_sd_m_s, x_m, y_m, vx_m_s, vy_m_s, priority.unwrap_or(0.0)]
    };
    let mut pairs = numbers(cue).into_iter().zip(numbers(other));
    let by_numbers = pairs.find_map(|(a, b)| Some(a.total_cmp(&b)).filter(|order| order.is_ne()));
    let by_source = (cue.source, cue.sequence).cmp(&(other.source, other.sequence));
    (cue.label.is_none(), cue.label)
        .cmp(&(other.label.is_none(), other.label))
        .then(other.time.cmp(&cue.time))
        .then(by_numbers.unwrap_or(Ordering::Equal))
        .then(by_source)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Position;
    use crate::message::TargetLabel;
    use crate::sensor::RangeBearingMeasurement;
    use crate::{Angle, Velocity};

    const RANGE_MAX_M: f64 = 1_300.0;

    fn report(uav: u32, restart_count: u32, sequence: u32) -> Report {
        let state = UavState::level_flight(Position::ORIGIN, Angle::ZERO, 40.0);
        Report { restart_count, sequence, ..Report::position_only(UavId(uav), Time::from_us(5), state) }
    }

    fn row() -> StepMessages {
        let mut row = StepMessages::default();
        row.open(Time::from_us(5));
        row
    }

    /// Inserts reports; returns the result of each, and the UAV and sequence number of the stored reports.
    fn put(row: &mut StepMessages, reports: &[Report]) -> (Vec<Insert>, Vec<(u32, u32)>) {
        let puts = reports.iter().map(|report| row.put(ReportView::of(report), RANGE_MAX_M)).collect();
        (puts, row.reports().iter().map(|report| (report.uav.0, report.sequence)).collect())
    }

    #[test]
    fn reports_are_sorted_by_uav_regardless_of_arrival_order() {
        let (mut row, all) = (row(), [3, 1, 2].map(|uav| report(uav, 0, 9)));
        assert_eq!(put(&mut row, &all), (vec![Insert::Added; 3], vec![(1, 9), (2, 9), (3, 9)]));
        assert_eq!((row.report_of(UavId(2)), row.report_of(UavId(4))), (Some(&report(2, 0, 9)), None));
    }

    #[test]
    fn duplicates_are_ignored_and_reopening_clears_all_messages() {
        let mut row = row();
        assert_eq!(
            put(&mut row, &[report(1, 0, 9), report(1, 0, 9)]),
            (vec![Insert::Added, Insert::Duplicate], vec![(1, 9)])
        );
        row.open(Time::from_us(6));
        assert_eq!(put(&mut row, &[]).1, []);
        // After a restart, the sequence number starts again. The time is that of the time step, to the microsecond.
        assert_eq!(put(&mut row, &[report(1, 1, 0)]), (vec![Insert::Added], vec![(1, 0)]));
        assert_eq!(row.reports()[0].time, Time::from_us(6));
    }

    /// The report that was sent first counts, in whatever order they arrive, and the other one is counted as rejected.
    #[test]
    fn the_report_that_a_uav_sent_first_counts() {
        let honest = report(1, 0, 9);
        for (other, counts) in [(report(1, u32::MAX, u32::MAX), 9), (report(1, 1, 0), 9), (report(1, 0, 0), 0)] {
            let (first, second) = if counts == 9 { (&honest, &other) } else { (&other, &honest) };
            let both = put(&mut row(), &[first.clone(), second.clone()]);
            assert_eq!(both, (vec![Insert::Added, Insert::Rejected], vec![(1, counts)]));
            let reversed = put(&mut row(), &[second.clone(), first.clone()]);
            assert_eq!(reversed, (vec![Insert::Added, Insert::Replaced], vec![(1, counts)]));
        }
    }

    /// A UAV that sends two different reports with one sequence number cannot make the stored message depend on the
    /// order of arrival.
    #[test]
    fn which_report_of_a_duplicate_sequence_number_counts_does_not_depend_on_order() {
        let honest = report(1, 0, 9);
        let detection = |range_m| Detection {
            label: Some(TargetLabel(1)),
            measurement: RangeBearingMeasurement { range_m, bearing: Angle::ZERO },
            range_rate_m_s: None,
        };
        let changes: [fn(&mut Report); 4] = [
            |change| change.state.speed_m_s = 41.0,
            |change| change.state.heading = Angle::from_rad(-0.0),
            |change| change.boresight = Some(Angle::ZERO),
            |change| change.is_leaving = true,
        ];
        let mut others = changes.map(|change| {
            let mut other = honest.clone();
            change(&mut other);
            other
        });
        others[3].detections = vec![detection(5.0)];
        for other in others {
            let mut rows = [row(), row()];
            let puts =
                [put(&mut rows[0], &[honest.clone(), other.clone()]).0, put(&mut rows[1], &[other, honest.clone()]).0];
            assert!(
                puts.contains(&vec![Insert::Added, Insert::Rejected])
                    && puts.contains(&vec![Insert::Added, Insert::Replaced]),
                "{puts:?}"
            );
            assert_eq!(format!("{:?}", rows[0].reports()), format!("{:?}", rows[1].reports()));
        }
        // An invalid detection makes no difference.
        let mut again = honest.clone();
        again.detections = vec![detection(f64::NAN)];
        assert_eq!(put(&mut row(), &[honest, again]).0, [Insert::Added, Insert::Duplicate]);
    }

    /// Detections without label are rounded as they are sent, sorted by their bits, and none is a duplicate.
    #[test]
    fn detections_without_label_have_a_canonical_order() {
        let detection = |label: Option<u32>, range_m| Detection {
            label: label.map(TargetLabel),
            measurement: RangeBearingMeasurement { range_m, bearing: Angle::from_rad(0.1) },
            range_rate_m_s: None,
        };
        let mut scrambled = report(1, 0, 9);
        scrambled.detections =
            [(None, 300.1), (Some(2), 50.1), (None, 200.0), (Some(1), 90.0), (None, 300.1), (Some(2), 60.0)]
                .map(|(label, range_m)| detection(label, range_m))
                .to_vec();
        let mut row = row();
        row.put(ReportView::of(&scrambled), RANGE_MAX_M);
        let kept: Vec<_> = row.reports()[0].detections.iter().map(|of| (of.label, of.measurement.range_m)).collect();
        let (one, two, far_m) = (Some(TargetLabel(1)), Some(TargetLabel(2)), f64::from(300.1f32));
        assert_eq!(kept, [(one, 90.0), (two, 50.1), (None, 200.0), (None, far_m), (None, far_m)]);
        // Another order is the same report.
        scrambled.detections.reverse();
        scrambled.detections.retain(|of| of.measurement.range_m != 60.0);
        assert_eq!(row.put(ReportView::of(&scrambled), RANGE_MAX_M), Insert::Duplicate);
    }

    /// The log status of a report is not stored with the messages: retransmissions do not contain it.
    #[test]
    fn a_report_is_the_same_entry_with_and_without_log_status() {
        let mut with_status = report(1, 0, 9);
        (with_status.log_status, with_status.assigned_group, with_status.is_leaving) =
            (Some(Box::default()), Some(GroupId(3)), true);
        let mut row = row();
        row.put(ReportView::of(&with_status), RANGE_MAX_M);
        assert_eq!(row.reports(), [Report { log_status: None, ..with_status }]);
    }

    #[test]
    fn reports_of_more_uavs_than_the_maximum_are_rejected() {
        let mut row = row();
        let all: Vec<Report> = (0..=TEAM_MAX as u32).map(|uav| report(1000 + uav, 0, 1)).collect();
        let (puts, stored) = put(&mut row, &all);
        assert_eq!((stored.len(), puts[TEAM_MAX]), (TEAM_MAX, Insert::Rejected));
        // An earlier report of a stored UAV can still replace the stored one.
        assert_eq!(put(&mut row, &[report(1000, 0, 0)]).0, [Insert::Replaced]);
    }

    #[test]
    fn reports_with_nan_or_positions_beyond_the_earth_are_rejected() {
        let mut row = row();
        let mut far = report(1, 0, 1);
        for x_m in [1e300, -2e8] {
            far.state.position = Position::from_m(x_m, 0.0);
            assert_eq!(row.put(ReportView::of(&far), RANGE_MAX_M), Insert::Rejected);
        }
        for wrong in [f64::NAN, f64::INFINITY, 1e300] {
            let (mut speed, mut turn, mut boresight) = (report(1, 0, 1), report(1, 0, 1), report(1, 0, 1));
            speed.state.speed_m_s = wrong;
            // Extrapolated along such a turn, the position would be undefined.
            turn.state.turn_rate_rad_s = -wrong;
            boresight.boresight = Some(Angle::from_rad(f64::INFINITY));
            assert_eq!(put(&mut row, &[speed, turn, boresight]), (vec![Insert::Rejected; 3], vec![]));
        }
    }

    #[test]
    fn invalid_detections_are_dropped() {
        let detection = |target, range_m| Detection {
            label: Some(TargetLabel(target)),
            measurement: RangeBearingMeasurement { range_m, bearing: Angle::ZERO },
            range_rate_m_s: None,
        };
        let mut row = row();
        let mut sent = report(1, 0, 1);
        sent.detections = vec![
            detection(4, 10.0),
            detection(2, f64::NAN),
            detection(1, 5.0),
            detection(4, 11.0),
            detection(3, 1e300),
        ];
        row.put(ReportView::of(&sent), RANGE_MAX_M);
        let kept: Vec<_> = row
            .reports()
            .iter()
            .flat_map(|r| &r.detections)
            .map(|d| (d.label.unwrap().0, d.measurement.range_m))
            .collect();
        assert_eq!(kept, [(1, 5.0), (4, 10.0)]);
    }

    fn cue() -> Cue {
        Cue {
            source: 0,
            issued_at: Time::EPOCH,
            sequence: 0,
            label: Some(TargetLabel(1)),
            time: Time::EPOCH,
            position: Position::ORIGIN,
            velocity: Velocity::ZERO,
            position_sd_m: 20.0,
            velocity_sd_m_s: 3.0,
            priority: None,
        }
    }

    /// Two cues with the same source and number are one entry: the same one of them counts in any order.
    #[test]
    fn a_cue_counts_once_and_only_if_valid() {
        let mut row = row();
        let other = Cue { position: Position::from_m(9.0, 9.0), ..cue() };
        let of_other_target = Cue { label: Some(TargetLabel(2)), ..cue() };
        let invalid = Cue { label: Some(TargetLabel(2)), velocity_sd_m_s: -1.0, ..cue() };
        let in_the_future = Cue { label: Some(TargetLabel(2)), time: Time::from_us(6), ..cue() };
        let puts = [cue(), cue(), other, of_other_target, invalid, in_the_future].map(|cue| row.put_cue(&cue));
        assert_eq!(
            puts,
            [Insert::Added, Insert::Duplicate, Insert::Rejected, Insert::Rejected, Insert::Rejected, Insert::Rejected]
        );
        assert_eq!(row.cues(), [cue()]);
        row.open(Time::from_us(5));
        assert_eq!(
            [of_other_target, other, cue()].map(|cue| row.put_cue(&cue)),
            [Insert::Added, Insert::Replaced, Insert::Replaced]
        );
        assert_eq!(row.cues(), [cue()]);
    }

    /// Agents that have received all of the cues store the same ones, in whatever order they arrive.
    #[test]
    fn which_cues_are_kept_at_the_limit_does_not_depend_on_order() {
        let cues: Vec<Cue> = (0..TARGETS_MAX as u32 + 9)
            .map(|label| Cue {
                source: label / 1000,
                sequence: (label % 1000) as u16,
                label: Some(TargetLabel(label)),
                ..cue()
            })
            .collect();
        let (mut row, mut reversed) = (row(), row());
        cues.iter().for_each(|cue| _ = row.put_cue(cue));
        cues.iter().rev().for_each(|cue| _ = reversed.put_cue(cue));
        assert_eq!((row.cues(), reversed.cues()), (&cues[..TARGETS_MAX], &cues[..TARGETS_MAX]));
        assert_eq!((row.put_cue(&cues[TARGETS_MAX]), row.put_cue(&cues[3])), (Insert::Rejected, Insert::Duplicate));
    }

    #[test]
    fn a_report_with_more_than_the_maximum_number_of_targets_is_rejected() {
        let detection = Detection {
            label: Some(TargetLabel(1)),
            measurement: RangeBearingMeasurement { range_m: 10.0, bearing: Angle::ZERO },
            range_rate_m_s: None,
        };
        let with_detections = |n| Report { detections: vec![detection; n], ..report(1, 0, 1) };
        assert_eq!(
            put(&mut row(), &[with_detections(TARGETS_MAX + 1), with_detections(TARGETS_MAX)]).0,
            [Insert::Rejected, Insert::Added]
        );
    }

    /// The newest counts, of those the most accurate, and of those always the same one. All are kept so that each can
    /// be retransmitted.
    #[test]
    fn which_of_several_cues_counts_does_not_depend_on_order() {
        let mut best_first = [
            Cue { time: Time::from_us(4), position_sd_m: 90.0, ..cue() },
            Cue { position_sd_m: 19.0, velocity_sd_m_s: 9.0, ..cue() },
            Cue { velocity_sd_m_s: 2.0, ..cue() },
            Cue { position: Position::from_m(-1.0, 5.0), ..cue() },
            Cue { position: Position::from_m(0.0, -1.0), ..cue() },
            Cue { velocity: Velocity::from_m_s(-0.0, 9.0), ..cue() },
            Cue { velocity: Velocity::from_m_s(0.0, -9.0), ..cue() },
            cue(),
        ];
        for (rank, cue) in (0..).zip(&mut best_first) {
            cue.source = 99 - rank;
        }
        for (rank, better) in best_first.iter().enumerate() {
            for worse in &best_first[rank + 1..] {
                for order in [[better, worse], [worse, better]] {
                    let mut row = row();
                    order.into_iter().for_each(|cue| assert_eq!(row.put_cue(cue), Insert::Added));
                    // Bitwise equal, including the sign of zero.
                    assert_eq!(format!("{:?}", row.cues()), format!("{:?}", [better, worse]));
                }
            }
        }
    }

    #[test]
    fn detections_beyond_the_sensor_are_dropped_and_a_scan_of_them_is_none() {
        let with_ranges = |ranges_m: &[f64]| {
            let detection = |(label, range_m): (u32, &f64)| Detection {
                label: Some(TargetLabel(label)),
                measurement: RangeBearingMeasurement { range_m: *range_m, bearing: Angle::ZERO },
                range_rate_m_s: None,
            };
            let mut sent = report(1, 0, 9);
            (sent.boresight, sent.detections) = (Some(Angle::ZERO), (0..).zip(ranges_m).map(detection).collect());
            let mut row = row();
            assert_eq!(row.put(ReportView::of(&sent), RANGE_MAX_M), Insert::Added);
            // The sent report and the stored one are the same.
            let stored = row.reports()[0].clone();
            let again = [&sent, &stored].map(|report| row.put(ReportView::of(report), RANGE_MAX_M));
            assert_eq!(again, [Insert::Duplicate; 2]);
            (stored.detections.iter().map(|of| of.measurement.range_m).collect::<Vec<_>>(), stored.boresight.is_some())
        };
        assert_eq!(with_ranges(&[400.0, RANGE_MAX_M]), (vec![400.0, RANGE_MAX_M], true));
        assert_eq!(with_ranges(&[40_000.0, 400.0, RANGE_MAX_M + 1.0]), (vec![400.0], true));
        assert_eq!(with_ranges(&[40_000.0, 30_000.0]), (vec![], false));
        assert_eq!(with_ranges(&[]), (vec![], true));
    }
}
