//! How calmly the UAVs fly: speeds asked for beyond the limits, turns the other way, calls to another group.
//!
//! A UAV counts while its sensor is pointed: one that is out flies nobody's law, and a quiet circle of its must not make
//! the team look calm.

use std::collections::BTreeMap;

use super::mean::Mean;
use crate::frame::{Frame, UavRow};

/// A turn rate nearer to zero than this is no turn to either side, rad/s.
const DEAD_BAND_RAD_S: f64 = 0.02;

/// All UAVs so far.
#[derive(Debug, Clone, Default)]
pub(super) struct Calm {
    of: BTreeMap<u32, Last>,
    /// Instants in which the law asked for a speed outside the limits.
    pub(super) speed_saturated: Mean,
    reversals: u64,
    reassignments: u64,
    /// UAV-instants in a group.
    in_group: u64,
}

/// What a UAV did last.
#[derive(Debug, Clone, Copy, Default)]
struct Last {
    /// It turned beyond the dead band, left (anticlockwise).
    is_left: Option<bool>,
    group: Option<u32>,
}

impl Calm {
    /// Takes in the next frame.
    pub(super) fn frame(&mut self, frame: &Frame) {
        for uav in frame.uavs.iter().filter(|uav| uav.boresight_rad.is_some()) {
            self.uav(uav);
        }
    }

    /// Whatever lies between, the dead band or an outage, it is the last turn and the last group that count.
    fn uav(&mut self, uav: &UavRow) {
        let last = self.of.entry(uav.uav).or_default();
        self.speed_saturated.add(f64::from(uav.speed_limited));
        if uav.turn_rate_rad_s.abs() > DEAD_BAND_RAD_S {
            let is_left = uav.turn_rate_rad_s > 0.0;
            self.reversals += u64::from(last.is_left.replace(is_left).is_some_and(|was_left| was_left != is_left));
        }
        if let Some(group) = uav.group {
            self.in_group += 1;
            self.reassignments += u64::from(last.group.replace(group).is_some_and(|old| old != group));
        }
    }

    /// Turns the other way per UAV and minute.
    pub(super) fn reversals_per_min(&self, period_s: f64) -> Option<f64> {
        per_min(self.reversals, self.speed_saturated.n, period_s)
    }

    /// Changes of group per UAV and minute in a group.
    pub(super) fn reassignments_per_min(&self, period_s: f64) -> Option<f64> {
        per_min(self.reassignments, self.in_group, period_s)
    }
}

fn per_min(count: u64, instants: u64, period_s: f64) -> Option<f64> {
    (instants > 0).then(|| count as f64 / (instants as f64 * period_s / 60.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::score::fixtures::uav_row;

    /// A UAV flies these turn rates, in rad/s, at one instant each.
    fn turning(turns_rad_s: &[f64]) -> Calm {
        flown(turns_rad_s.iter().map(|turn_rate_rad_s| UavRow { turn_rate_rad_s: *turn_rate_rad_s, ..uav_row(0) }))
    }

    fn flown(rows: impl Iterator<Item = UavRow>) -> Calm {
        let mut calm = Calm::default();
        rows.for_each(|row| calm.frame(&Frame { uavs: vec![row], ..Frame::default() }));
        calm
    }

    /// Six instants of 0.5 s: left, nearly straight, right, nearly straight to the left, right, left. Right and left again
    /// are two reversals in 0.05 min: 40 a minute.
    #[test]
    fn a_reversal_goes_from_beyond_the_dead_band_to_beyond_the_other() {
        let calm = turning(&[0.3, 0.019, -0.021, 0.02, -0.3, 0.021]);
        assert_eq!(calm.reversals, 2);
        assert!((calm.reversals_per_min(0.5).unwrap() - 40.0).abs() < 1e-9);
        assert_eq!(turning(&[0.3, 0.0, 0.3, 0.01, -0.019, 0.1]).reversals, 0);
        assert_eq!(turning(&[]).reversals_per_min(0.5), None);
        assert_eq!(turning(&[-0.3]).reversals_per_min(0.5), Some(0.0));
    }

    /// Left, then three instants out, then right: the time out is no one's, and the turn counts. Of two instants in which
    /// it flew, of 0.5 s, one at a bound of the speed: a half, and one reversal in 1/60 min.
    #[test]
    fn a_uav_that_is_out_makes_no_one_calm() {
        let row = |turn_rate_rad_s: f64, speed_limited: bool| UavRow { turn_rate_rad_s, speed_limited, ..uav_row(0) };
        let out = UavRow { boresight_rad: None, ..row(0.2, false) };
        let calm =
            flown([row(0.2, true), out, UavRow { turn_rate_rad_s: -0.2, ..out }, out, row(-0.2, false)].into_iter());
        assert_eq!(calm.speed_saturated.value(), Some(0.5));
        assert!((calm.reversals_per_min(0.5).unwrap() - 60.0).abs() < 1e-9);
        assert_eq!(flown([out].into_iter()).speed_saturated.value(), None);
    }

    /// First 1, then 2, in none, 2 again, out, 3: two changes, in four instants of 15 s in a group: two a minute.
    #[test]
    fn a_reassignment_is_any_change_of_group_but_the_first() {
        let row = |group: Option<u32>| UavRow { group, ..uav_row(0) };
        let out = UavRow { boresight_rad: None, ..row(Some(7)) };
        let rows = [row(None), row(Some(1)), row(Some(2)), row(None), row(Some(2)), out, row(Some(3))];
        let calm = flown(rows.into_iter());
        assert_eq!((calm.reassignments, calm.in_group), (2, 4));
        assert!((calm.reassignments_per_min(15.0).unwrap() - 2.0).abs() < 1e-9);
        assert_eq!(flown([row(None)].into_iter()).reassignments_per_min(15.0), None);
    }

    /// Two UAVs that turn one to the left and one to the right all the time, each in its group, reverse and change nothing.
    #[test]
    fn each_uav_is_measured_against_itself() {
        let mut calm = Calm::default();
        let uavs = [(0, 0.1), (1, -0.1)].map(|(uav, turn_rate_rad_s)| UavRow {
            group: Some(uav),
            turn_rate_rad_s,
            ..uav_row(uav)
        });
        let frame = Frame { uavs: uavs.to_vec(), ..Frame::default() };
        (0..3).for_each(|_| calm.frame(&frame));
        assert_eq!((calm.reversals_per_min(1.0), calm.reassignments_per_min(1.0)), (Some(0.0), Some(0.0)));
    }
}
