//! What was said of one instant: at most one report of each UAV, and cues; each counted once.
//!
//! Of several reports of one UAV one counts, that which was said first, whichever is heard first; so whoever has heard the
//! same entries holds the same row.

use core::cmp::Ordering;

use crate::angle::Angle;
use crate::group_id::GroupId;
use crate::message::{Cue, Detection, Report, Scan};
use crate::time::Time;
use crate::uav::{UavId, UavState};

/// More UAVs than this at a time are not listened to: a team is a few.
pub(crate) const TEAM_MAX: usize = 256;

/// More targets than this are not kept at a time: as many as a picture can be told of (`PARTS_MAX` of the snapshot). Nor are
/// more detections taken from one report, or more cues of one instant.
pub(crate) const TARGETS_MAX: usize = 8_000;

/// What became of something heard.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Put {
    /// It counts; it was not known.
    New,
    /// It says nothing new.
    Known,
    /// It makes no sense, or another one of the same speaker counts.
    Refused,
    /// It counts in the place of another one, which does not any more.
    Instead,
}

/// What a UAV says of an instant, wherever its parts are kept.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Said<'a> {
    pub(crate) uav: UavId,
    /// Epoch and sequence.
    pub(crate) stamp: (u32, u32),
    pub(crate) state: &'a UavState,
    pub(crate) scan: Scan<'a>,
    pub(crate) duty: Option<GroupId>,
    pub(crate) leaves: bool,
}

impl<'a> Said<'a> {
    pub(crate) fn of(report: &'a Report) -> Self {
        let Report { uav, epoch, sequence, ref state, boresight, ref detections, duty, leaves, .. } = *report;
        Self { uav, stamp: (epoch, sequence), state, scan: Scan { boresight, detections }, duty, leaves }
    }
}

/// The entries of an instant.
#[derive(Debug, Clone, Default)]
pub(crate) struct Row {
    /// The instant.
    pub(crate) time: Time,
    /// By ascending UAV; the first `said` of them count, the others are room.
    reports: Vec<Report>,
    said: usize,
    /// By ascending label; of one target the one that counts first.
    cues: Vec<Cue>,
}

impl Row {
    /// Turns to another instant, of which nothing is known yet.
    pub(crate) fn open(&mut self, time: Time) {
        self.time = time;
        self.cues.clear();
        self.said = 0;
    }

    /// The reports, by ascending UAV.
    pub(crate) fn reports(&self) -> &[Report] {
        &self.reports[..self.said]
    }

    /// The report of a UAV.
    pub(crate) fn report_of(&self, uav: UavId) -> Option<&Report> {
        self.reports().binary_search_by_key(&uav, |report| report.uav).ok().map(|index| &self.reports[index])
    }

    /// The cues, by ascending label; of several of one target the first counts.
    pub(crate) fn cues(&self) -> &[Cue] {
        &self.cues
    }

    /// Takes a report in.
    pub(crate) fn put(&mut self, said: Said) -> Put {
        let Said { uav, stamp, state, scan, duty, leaves } = said;
        let is_sound = state.is_sound() && scan.boresight.is_none_or(|angle| angle.rad().is_finite());
        if !is_sound || scan.detections.len() > TARGETS_MAX {
            return Put::Refused;
        }
        let (index, put) = match self.reports().binary_search_by_key(&uav, |report| report.uav) {
            Ok(index) => {
                let known = &self.reports[index];
                match stamp.cmp(&(known.epoch, known.sequence)).then_with(|| any_order(&said, known)) {
                    Ordering::Equal => return Put::Known,
                    Ordering::Greater => return Put::Refused,
                    Ordering::Less => (index, Put::Instead),
                }
            }
            Err(_) if self.said >= TEAM_MAX => return Put::Refused,
            Err(index) => {
                if self.reports.len() == self.said {
                    self.reports.push(Report::of(uav, self.time, *state));
                }
                self.reports[index..=self.said].rotate_right(1);
                self.said += 1;
                (index, Put::New)
            }
        };
        let report = &mut self.reports[index];
        keep_sound(scan.detections, &mut report.detections);
        (report.uav, report.time, report.state, report.boresight) = (uav, self.time, *state, scan.boresight);
        (report.epoch, report.sequence) = stamp;
        (report.duty, report.leaves) = (duty, leaves);
        put
    }

    /// There are as many cues as there may be.
    pub(crate) fn is_full(&self) -> bool {
        self.cues.len() >= TARGETS_MAX
    }

    /// Takes a cue in. Of too many those are kept that come first, whichever are heard first.
    pub(crate) fn put_cue(&mut self, cue: &Cue) -> Put {
        let is_same = |known: &Cue| (known.searcher, known.number) == (cue.searcher, cue.number);
        let is_beyond = |last: &Cue| self.is_full() && counting_order(last, cue).is_lt();
        if !cue.is_sound() || cue.time > self.time || self.cues.last().is_some_and(is_beyond) {
            return Put::Refused;
        }
        let mut put = Put::New;
        // One that says something else under the same name, of whatever target, is the same entry.
        if let Some(index) = self.cues.iter().position(is_same) {
            match counting_order(cue, &self.cues[index]) {
                Ordering::Equal => return Put::Known,
                Ordering::Greater => return Put::Refused,
                Ordering::Less => put = Put::Instead,
            }
            self.cues.remove(index);
        }
        let place = self.cues.partition_point(|known| counting_order(known, cue).is_lt());
        self.cues.insert(place, *cue);
        self.cues.truncate(TARGETS_MAX);
        put
    }
}

/// Of two reports under one name that say something else: any order that all share.
#[cold]
fn any_order(said: &Said, known: &Report) -> Ordering {
    let bits = |state: &UavState, boresight: Option<Angle>| {
        let UavState { position, heading, speed_m_s, turn_rate_rad_s, vertical } = *state;
        let numbers = [position.x_m(), position.y_m(), heading.rad(), speed_m_s, turn_rate_rad_s].map(f64::to_bits);
        let vertical = vertical.map(|vertical| vertical.numbers().map(f64::to_bits));
        (numbers, vertical, boresight.map(|boresight| boresight.rad().to_bits()))
    };
    let seen = |of: &Detection| (of.label, of.measurement.range_m.to_bits(), of.measurement.bearing.rad().to_bits());
    let heads = (bits(said.state, said.scan.boresight), said.duty, said.leaves);
    heads.cmp(&(bits(&known.state, known.boresight), known.duty, known.leaves)).then_with(|| {
        // Mostly it is the same, word for word.
        if said.scan.detections.iter().map(seen).eq(known.detections.iter().map(seen)) {
            return Ordering::Equal;
        }
        let mut kept = Vec::new();
        keep_sound(said.scan.detections, &mut kept);
        kept.iter().map(seen).cmp(known.detections.iter().map(seen))
    })
}

/// Makes `kept` what is sound of a scan, by ascending label, no label twice.
fn keep_sound(detections: &[Detection], kept: &mut Vec<Detection>) {
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

/// By label; of one target the newest, of those the surest; then any order that all share.
fn counting_order(cue: &Cue, other: &Cue) -> Ordering {
    let numbers = |cue: &Cue| {
        let Cue { position, velocity, position_sd_m, velocity_sd_m_s, .. } = *cue;
        [position_sd_m, velocity_sd_m_s, position.x_m(), position.y_m(), velocity.x_m_s(), velocity.y_m_s()]
    };
    let mut pairs = numbers(cue).into_iter().zip(numbers(other));
    let by_numbers = pairs.find_map(|(a, b)| Some(a.total_cmp(&b)).filter(|order| order.is_ne()));
    let by_name = (cue.searcher, cue.number).cmp(&(other.searcher, other.number));
    (cue.label.cmp(&other.label))
        .then(other.time.cmp(&cue.time))
        .then(by_numbers.unwrap_or(Ordering::Equal))
        .then(by_name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Position;
    use crate::message::TargetLabel;
    use crate::sensor::RangeBearing;
    use crate::{Angle, Velocity};

    fn report(uav: u32, epoch: u32, sequence: u32) -> Report {
        let state = UavState::straight(Position::ORIGIN, Angle::ZERO, 40.0);
        Report { epoch, sequence, ..Report::of(UavId(uav), Time::from_us(5), state) }
    }

    fn row() -> Row {
        let mut row = Row::default();
        row.open(Time::from_us(5));
        row
    }

    /// Puts reports; gives what became of each, and who has said what in the end.
    fn put(row: &mut Row, reports: &[Report]) -> (Vec<Put>, Vec<(u32, u32)>) {
        let puts = reports.iter().map(|report| row.put(Said::of(report))).collect();
        (puts, row.reports().iter().map(|report| (report.uav.0, report.sequence)).collect())
    }

    #[test]
    fn reports_are_kept_in_the_order_of_ids_whatever_order_they_come_in() {
        let (mut row, all) = (row(), [3, 1, 2].map(|uav| report(uav, 0, 9)));
        assert_eq!(put(&mut row, &all), (vec![Put::New; 3], vec![(1, 9), (2, 9), (3, 9)]));
        assert_eq!((row.report_of(UavId(2)), row.report_of(UavId(4))), (Some(&report(2, 0, 9)), None));
    }

    #[test]
    fn a_duplicate_changes_nothing_and_a_row_that_is_opened_again_knows_nothing() {
        let mut row = row();
        assert_eq!(put(&mut row, &[report(1, 0, 9), report(1, 0, 9)]), (vec![Put::New, Put::Known], vec![(1, 9)]));
        row.open(Time::from_us(6));
        assert_eq!(put(&mut row, &[]).1, []);
        // After a restart the count begins again. The time is that of the row, to the microsecond.
        assert_eq!(put(&mut row, &[report(1, 1, 0)]), (vec![Put::New], vec![(1, 0)]));
        assert_eq!(row.reports()[0].time, Time::from_us(6));
    }

    /// The one said first counts, whichever is heard first, and the other is told of.
    #[test]
    fn of_two_reports_of_one_uav_the_one_said_first_counts() {
        let honest = report(1, 0, 9);
        for (other, counts) in [(report(1, u32::MAX, u32::MAX), 9), (report(1, 1, 0), 9), (report(1, 0, 0), 0)] {
            let (first, second) = if counts == 9 { (&honest, &other) } else { (&other, &honest) };
            let both = put(&mut row(), &[first.clone(), second.clone()]);
            assert_eq!(both, (vec![Put::New, Put::Refused], vec![(1, counts)]));
            let reversed = put(&mut row(), &[second.clone(), first.clone()]);
            assert_eq!(reversed, (vec![Put::New, Put::Instead], vec![(1, counts)]));
        }
    }

    /// One that says two things under one name cannot make others hold what they did not hear in one order.
    #[test]
    fn of_two_reports_under_one_name_the_same_counts_in_whatever_order_they_come() {
        let honest = report(1, 0, 9);
        let seen =
            |range_m| Detection { label: TargetLabel(1), measurement: RangeBearing { range_m, bearing: Angle::ZERO } };
        let lies: [fn(&mut Report); 4] = [
            |lie| lie.state.speed_m_s = 41.0,
            |lie| lie.state.heading = Angle::from_rad(-0.0),
            |lie| lie.boresight = Some(Angle::ZERO),
            |lie| lie.leaves = true,
        ];
        let mut others = lies.map(|lie| {
            let mut other = honest.clone();
            lie(&mut other);
            other
        });
        others[3].detections = vec![seen(5.0)];
        for other in others {
            let mut rows = [row(), row()];
            let puts =
                [put(&mut rows[0], &[honest.clone(), other.clone()]).0, put(&mut rows[1], &[other, honest.clone()]).0];
            assert!(
                puts.contains(&vec![Put::New, Put::Refused]) && puts.contains(&vec![Put::New, Put::Instead]),
                "{puts:?}"
            );
            assert_eq!(format!("{:?}", rows[0].reports()), format!("{:?}", rows[1].reports()));
        }
        // What no sensor makes is no difference.
        let mut again = honest.clone();
        again.detections = vec![seen(f64::NAN)];
        assert_eq!(put(&mut row(), &[honest, again]).0, [Put::New, Put::Known]);
    }

    /// What a report says of what it has heard is no matter of the row's: who says it again does not tell it.
    #[test]
    fn whoever_says_it_a_report_is_the_same_entry() {
        let mut told = report(1, 0, 9);
        (told.knowledge, told.duty, told.leaves) = (Some(Box::default()), Some(GroupId(3)), true);
        let mut row = row();
        row.put(Said::of(&told));
        assert_eq!(row.reports(), [Report { knowledge: None, ..told }]);
    }

    #[test]
    fn no_more_uavs_are_listened_to_than_a_team_may_have() {
        let mut row = row();
        let all: Vec<Report> = (0..=TEAM_MAX as u32).map(|uav| report(1000 + uav, 0, 1)).collect();
        let (puts, heard) = put(&mut row, &all);
        assert_eq!((heard.len(), puts[TEAM_MAX]), (TEAM_MAX, Put::Refused));
        // Whose report counts can still be heard better.
        assert_eq!(put(&mut row, &[report(1000, 0, 0)]).0, [Put::Instead]);
    }

    #[test]
    fn reports_without_a_number_or_from_beyond_the_earth_are_refused() {
        let mut row = row();
        let mut far = report(1, 0, 1);
        for x_m in [1e300, -2e8] {
            far.state.position = Position::from_m(x_m, 0.0);
            assert_eq!(row.put(Said::of(&far)), Put::Refused);
        }
        for wrong in [f64::NAN, f64::INFINITY, 1e300] {
            let (mut speed, mut turn, mut boresight) = (report(1, 0, 1), report(1, 0, 1), report(1, 0, 1));
            speed.state.speed_m_s = wrong;
            // Carried on along such a turn it would be nowhere.
            turn.state.turn_rate_rad_s = -wrong;
            boresight.boresight = Some(Angle::from_rad(f64::INFINITY));
            assert_eq!(put(&mut row, &[speed, turn, boresight]), (vec![Put::Refused; 3], vec![]));
        }
    }

    #[test]
    fn detections_that_no_sensor_makes_are_dropped() {
        let detection = |target, range_m| Detection {
            label: TargetLabel(target),
            measurement: RangeBearing { range_m, bearing: Angle::ZERO },
        };
        let mut row = row();
        let mut said = report(1, 0, 1);
        said.detections = vec![
            detection(4, 10.0),
            detection(2, f64::NAN),
            detection(1, 5.0),
            detection(4, 11.0),
            detection(3, 1e300),
        ];
        row.put(Said::of(&said));
        let kept: Vec<_> =
            row.reports().iter().flat_map(|r| &r.detections).map(|d| (d.label.0, d.measurement.range_m)).collect();
        assert_eq!(kept, [(1, 5.0), (4, 10.0)]);
    }

    fn cue() -> Cue {
        Cue {
            searcher: 0,
            said: Time::START,
            number: 0,
            label: TargetLabel(1),
            time: Time::START,
            position: Position::ORIGIN,
            velocity: Velocity::ZERO,
            position_sd_m: 20.0,
            velocity_sd_m_s: 3.0,
        }
    }

    /// Two that one searcher says under one number are one entry, of which the same one counts in whatever order.
    #[test]
    fn a_cue_counts_once_and_only_if_sound() {
        let mut row = row();
        let other = Cue { position: Position::from_m(9.0, 9.0), ..cue() };
        let of_another = Cue { label: TargetLabel(2), ..cue() };
        let unsound = Cue { label: TargetLabel(2), velocity_sd_m_s: -1.0, ..cue() };
        let of_the_future = Cue { label: TargetLabel(2), time: Time::from_us(6), ..cue() };
        let puts = [cue(), cue(), other, of_another, unsound, of_the_future].map(|cue| row.put_cue(&cue));
        assert_eq!(puts, [Put::New, Put::Known, Put::Refused, Put::Refused, Put::Refused, Put::Refused]);
        assert_eq!(row.cues(), [cue()]);
        row.open(Time::from_us(5));
        assert_eq!([of_another, other, cue()].map(|cue| row.put_cue(&cue)), [Put::New, Put::Instead, Put::Instead]);
        assert_eq!(row.cues(), [cue()]);
    }

    /// Whichever is heard first: who has heard all holds the same.
    #[test]
    fn of_too_many_cues_the_same_are_kept_in_whatever_order_they_come() {
        let cues: Vec<Cue> = (0..TARGETS_MAX as u32 + 9)
            .map(|label| Cue {
                searcher: label / 1000,
                number: (label % 1000) as u16,
                label: TargetLabel(label),
                ..cue()
            })
            .collect();
        let (mut row, mut reversed) = (row(), row());
        cues.iter().for_each(|cue| _ = row.put_cue(cue));
        cues.iter().rev().for_each(|cue| _ = reversed.put_cue(cue));
        assert_eq!((row.cues(), reversed.cues()), (&cues[..TARGETS_MAX], &cues[..TARGETS_MAX]));
        assert_eq!((row.put_cue(&cues[TARGETS_MAX]), row.put_cue(&cues[3])), (Put::Refused, Put::Known));
    }

    #[test]
    fn a_report_of_more_targets_than_a_team_keeps_is_refused() {
        let detection =
            Detection { label: TargetLabel(1), measurement: RangeBearing { range_m: 10.0, bearing: Angle::ZERO } };
        let said = |n| Report { detections: vec![detection; n], ..report(1, 0, 1) };
        assert_eq!(put(&mut row(), &[said(TARGETS_MAX + 1), said(TARGETS_MAX)]).0, [Put::Refused, Put::New]);
    }

    /// The newest, of those the surest, and of those always the same; all are kept, so that each can be said again.
    #[test]
    fn which_of_several_cues_counts_is_no_matter_of_order() {
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
            cue.searcher = 99 - rank;
        }
        for (rank, better) in best_first.iter().enumerate() {
            for worse in &best_first[rank + 1..] {
                for heard in [[better, worse], [worse, better]] {
                    let mut row = row();
                    heard.into_iter().for_each(|cue| assert_eq!(row.put_cue(cue), Put::New));
                    // To the bit, also of a zero's sign.
                    assert_eq!(format!("{:?}", row.cues()), format!("{:?}", [better, worse]));
                }
            }
        }
    }
}
