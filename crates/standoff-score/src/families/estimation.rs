//! Errors of the estimated positions and velocities.

use standoff::Displacement;
use standoff::by_group::ByGroup;

use crate::matching::{Matched, assigned};
use crate::mean::Mean;
use crate::metric::{BOTH, Family, LARGE, Metric, TRACKS, metric};
use crate::step::{Inputs, Step};

/// Mean errors of group members, except `position_all_m`, which is that of all tracked targets.
#[derive(Debug, Default)]
pub(crate) struct Estimation {
    position_m: Mean,
    /// By number of assigned UAVs whose sensor is pointed.
    position_single_uav_m: Mean,
    position_multi_uav_m: Mean,
    velocity_m_s: Mean,
    position_all_m: Mean,
    /// Assigned UAVs of each group whose sensor is pointed.
    assigned: ByGroup<u32>,
}

impl Family for Estimation {
    const SECTION: &'static str = "Estimation";
    const METRICS: &'static [Metric<Self>] = &[
        metric("position_error_m", "position error", LARGE, 0.1, BOTH, |of, _| of.position_m.value()),
        metric("position_error_single_uav_m", "position error, groups with one UAV", LARGE, 0.1, BOTH, |of, _| {
            of.position_single_uav_m.value()
        }),
        metric("position_error_multi_uav_m", "position error, groups of several UAVs", LARGE, 0.1, BOTH, |of, _| {
            of.position_multi_uav_m.value()
        }),
        metric("velocity_error_m_s", "velocity error", LARGE, 0.05, BOTH, |of, _| of.velocity_m_s.value()),
        metric("position_error_all_m", "position error of all tracks", LARGE, 0.5, TRACKS, |of, _| {
            of.position_all_m.value()
        }),
    ];

    fn inputs(_: &[&str]) -> Inputs {
        Inputs { errors: true, ..Inputs::default() }
    }

    fn add(&mut self, step: &Step<'_>) {
        let is_pointed = |index: usize| step.frame.uavs[index].boresight_rad.is_some();
        self.assigned.fill(assigned(step.frame).filter(|(_, index)| is_pointed(*index)));
        for pair in step.matching.pairs() {
            let position_error_m = pair.position_error_m();
            self.position_all_m.add(position_error_m);
            let Some(group) = pair.track.group else { continue };
            self.position_m.add(position_error_m);
            match self.assigned.of(group).len() {
                0 => {}
                1 => self.position_single_uav_m.add(position_error_m),
                _ => self.position_multi_uav_m.add(position_error_m),
            }
            let Matched { target, track } = pair;
            let [_, vx_m_s, _, _, vy_m_s, _] = track.state;
            let velocity_error = Displacement::from_m(vx_m_s - target.vx_m_s, vy_m_s - target.vy_m_s);
            self.velocity_m_s.add(velocity_error.length_m());
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::common::{score, score_config};
    use crate::row_fixtures::{track_row, truth_row, uav_row};
    use standoff_record::{Frame, UavRow};

    /// Tracks at the origin of targets at 3, 4 and 12 m. One UAV is assigned to the group of the first, two to that of
    /// the second, and to that of the third one with an outage.
    #[test]
    fn position_errors_are_split_by_number_of_assigned_uavs() {
        let mut frame = Frame::default();
        for (target, x_m) in (0..).zip([3.0, 4.0, 12.0]) {
            frame.truth.push(truth_row(target, x_m, 0.0));
            frame.tracks.push(track_row(target, Some(target)));
        }
        let uav = |uav: u32, group: u32| UavRow { group: Some(group), ..uav_row(uav) };
        frame.uavs = vec![uav(0, 0), uav(1, 1), uav(2, 1), UavRow { boresight_rad: None, ..uav(3, 2) }];
        let errors_m = |frame: &Frame| {
            let metrics = score(&score_config(), [frame]);
            [metrics["position_error_m"], metrics["position_error_single_uav_m"], metrics["position_error_multi_uav_m"]]
        };
        assert_eq!(errors_m(&frame), [Some(19.0 / 3.0), Some(3.0), Some(4.0)]);
        frame.uavs[2].group = Some(2);
        assert_eq!(errors_m(&frame), [Some(19.0 / 3.0), Some(19.0 / 3.0), None]);
    }
}
