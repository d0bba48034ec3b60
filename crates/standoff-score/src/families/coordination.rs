//! Coordination: handoffs, removals, and reassignments of UAVs.

use crate::by_id::ById;
use crate::mean::per_min;
use crate::metric::{EVENTS, Family, GROUPS, LARGE, Metric, NEITHER, count, metric};
use crate::step::Step;

/// Counts so far. Reassignments count like the control effort only while the sensor of the UAV is pointed.
#[derive(Debug, Default)]
pub(crate) struct Coordination {
    handoffs: u64,
    removals: u64,
    reassignments: u64,
    /// UAV time steps with an assigned group.
    in_group: u64,
    /// Last group of each UAV.
    last_group: ById<u32>,
}

impl Family for Coordination {
    const SECTION: &'static str = "Coordination";
    const METRICS: &'static [Metric<Self>] = &[
        count(metric("handoffs", "completed handoffs", NEITHER, 0.1, EVENTS, |of, _| Some(of.handoffs as f64))),
        count(metric("removals", "targets removed from groups", NEITHER, 0.1, EVENTS, |of, _| {
            Some(of.removals as f64)
        })),
        metric("reassignments_per_uav_min", "reassignments per UAV and minute", LARGE, 0.05, GROUPS, |of, run| {
            per_min(of.reassignments, of.in_group, run.config.period_s)
        }),
    ];

    fn add(&mut self, step: &Step<'_>) {
        for event in &step.frame.events {
            self.handoffs += u64::from(event.kind == "handoff-completed");
            self.removals += u64::from(event.kind == "removed");
        }
        for uav in step.frame.uavs.iter().filter(|uav| uav.boresight_rad.is_some()) {
            // The last group counts, even if time steps without a group or an outage lie in between.
            if let Some(group) = uav.group {
                let last = self.last_group.entry(uav.uav, || group);
                self.in_group += 1;
                self.reassignments += u64::from(std::mem::replace(last, group) != group);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::ScoreConfig;
    use crate::common::{score, score_config};
    use crate::row_fixtures::uav_row;
    use standoff_record::{Frame, UavRow};

    /// Group 1, 2, none, 2, outage, 3: two changes in four time steps of 15 s with a group, which is two per minute.
    #[test]
    fn reassignment_is_every_change_of_group_except_the_first() {
        let row = |group: Option<u32>| UavRow { group, ..uav_row(0) };
        let out = UavRow { boresight_rad: None, ..row(Some(7)) };
        let rows = [row(None), row(Some(1)), row(Some(2)), row(None), row(Some(2)), out, row(Some(3))];
        let per_min = |rows: &[UavRow]| {
            let frames: Vec<Frame> = rows.iter().map(|row| Frame { uavs: vec![*row], ..Frame::default() }).collect();
            score(&ScoreConfig { period_s: 15.0, ..score_config() }, &frames)["reassignments_per_uav_min"]
        };
        assert!((per_min(&rows).unwrap() - 2.0).abs() < 1e-9);
        assert_eq!(per_min(&[row(None)]), None);
        // UAVs are scored independently.
        let uavs = [0, 1].map(|uav| UavRow { group: Some(uav), ..uav_row(uav) });
        let frame = Frame { uavs: uavs.to_vec(), ..Frame::default() };
        assert_eq!(score(&score_config(), [&frame, &frame])["reassignments_per_uav_min"], Some(0.0));
    }
}
