//! Control effort of the UAVs: speed commands beyond the limits, turn reversals and reassignments.
//!
//! A UAV counts only while its sensor is pointed. During an outage it follows no law, and its steady circling must not
//! improve the metrics.

use standoff_record::{Frame, UavRow};

use crate::by_id::ById;
use crate::mean::Mean;

/// Turn rates below this absolute value count as no turn, rad/s.
const DEAD_BAND_RAD_S: f64 = 0.02;

/// Control effort of all UAVs so far.
#[derive(Debug, Clone, Default)]
pub(crate) struct ControlEffort {
    of: ById<Last>,
    /// Time steps at which the law commanded a speed outside the limits.
    pub(crate) speed_saturated: Mean,
    reversals: u64,
    reassignments: u64,
    /// UAV time steps with an assigned group.
    in_group: u64,
}

/// Last turn direction and last group of a UAV.
#[derive(Debug, Clone, Copy, Default)]
struct Last {
    /// True if the last turn beyond the dead band was to the left (anticlockwise).
    is_left: Option<bool>,
    group: Option<u32>,
}

impl ControlEffort {
    /// Adds the next frame.
    pub(crate) fn frame(&mut self, frame: &Frame) {
        for uav in frame.uavs.iter().filter(|uav| uav.boresight_rad.is_some()) {
            self.uav(uav);
        }
    }

    /// The last turn and the last group count, even if dead-band time steps or an outage lie in between.
    fn uav(&mut self, uav: &UavRow) {
        let last = self.of.entry(uav.uav, Last::default);
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

    /// Turn reversals per UAV and minute.
    pub(crate) fn reversals_per_min(&self, period_s: f64) -> Option<f64> {
        per_min(self.reversals, self.speed_saturated.n, period_s)
    }

    /// Changes of group per UAV and minute in a group.
    pub(crate) fn reassignments_per_min(&self, period_s: f64) -> Option<f64> {
        per_min(self.reassignments, self.in_group, period_s)
    }
}

fn per_min(count: u64, time_steps: u64, period_s: f64) -> Option<f64> {
    (time_steps > 0).then(|| count as f64 / (time_steps as f64 * period_s / 60.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::row_fixtures::uav_row;

    /// A UAV with these turn rates, rad/s, one per time step.
    fn turning(turns_rad_s: &[f64]) -> ControlEffort {
        flown(turns_rad_s.iter().map(|turn_rate_rad_s| UavRow { turn_rate_rad_s: *turn_rate_rad_s, ..uav_row(0) }))
    }

    fn flown(rows: impl Iterator<Item = UavRow>) -> ControlEffort {
        let mut control_effort = ControlEffort::default();
        rows.for_each(|row| control_effort.frame(&Frame { uavs: vec![row], ..Frame::default() }));
        control_effort
    }

    /// Six time steps of 0.5 s: left, nearly straight, right, nearly straight to the left, right, left. Two reversals
    /// in 0.05 min are 40 per minute.
    #[test]
    fn reversal_crosses_the_whole_dead_band() {
        let control_effort = turning(&[0.3, 0.019, -0.021, 0.02, -0.3, 0.021]);
        assert_eq!(control_effort.reversals, 2);
        assert!((control_effort.reversals_per_min(0.5).unwrap() - 40.0).abs() < 1e-9);
        assert_eq!(turning(&[0.3, 0.0, 0.3, 0.01, -0.019, 0.1]).reversals, 0);
        assert_eq!(turning(&[]).reversals_per_min(0.5), None);
        assert_eq!(turning(&[-0.3]).reversals_per_min(0.5), Some(0.0));
    }

    /// Left, three time steps of outage, right: the outage does not count, the reversal does. In one of the two counted
    /// time steps of 0.5 s the speed is at a limit: the fraction is 0.5, with one reversal in 1/60 min.
    #[test]
    fn outage_time_does_not_count() {
        let row = |turn_rate_rad_s: f64, speed_limited: bool| UavRow { turn_rate_rad_s, speed_limited, ..uav_row(0) };
        let out = UavRow { boresight_rad: None, ..row(0.2, false) };
        let control_effort =
            flown([row(0.2, true), out, UavRow { turn_rate_rad_s: -0.2, ..out }, out, row(-0.2, false)].into_iter());
        assert_eq!(control_effort.speed_saturated.value(), Some(0.5));
        assert!((control_effort.reversals_per_min(0.5).unwrap() - 60.0).abs() < 1e-9);
        assert_eq!(flown([out].into_iter()).speed_saturated.value(), None);
    }

    /// Group 1, 2, none, 2, outage, 3: two changes in four time steps of 15 s with a group, which is two per minute.
    #[test]
    fn reassignment_is_every_change_of_group_except_the_first() {
        let row = |group: Option<u32>| UavRow { group, ..uav_row(0) };
        let out = UavRow { boresight_rad: None, ..row(Some(7)) };
        let rows = [row(None), row(Some(1)), row(Some(2)), row(None), row(Some(2)), out, row(Some(3))];
        let control_effort = flown(rows.into_iter());
        assert_eq!((control_effort.reassignments, control_effort.in_group), (2, 4));
        assert!((control_effort.reassignments_per_min(15.0).unwrap() - 2.0).abs() < 1e-9);
        assert_eq!(flown([row(None)].into_iter()).reassignments_per_min(15.0), None);
    }

    /// Two UAVs that turn steadily in opposite directions, each in its own group, have no reversals and no
    /// reassignments.
    #[test]
    fn uavs_are_scored_independently() {
        let mut control_effort = ControlEffort::default();
        let uavs = [(0, 0.1), (1, -0.1)].map(|(uav, turn_rate_rad_s)| UavRow {
            group: Some(uav),
            turn_rate_rad_s,
            ..uav_row(uav)
        });
        let frame = Frame { uavs: uavs.to_vec(), ..Frame::default() };
        (0..3).for_each(|_| control_effort.frame(&frame));
        assert_eq!(
            (control_effort.reversals_per_min(1.0), control_effort.reassignments_per_min(1.0)),
            (Some(0.0), Some(0.0))
        );
    }
}
