//! Control effort of the UAVs: commands beyond the limits, and turn reversals.
//!
//! A UAV counts only while its sensor is pointed. During an outage it follows no law, and its steady circling must not
//! improve the metrics.

use crate::by_id::ById;
use crate::geometry::group_of;
use crate::mean::{Mean, per_min};
use crate::metric::{Family, GROUPS, LARGE, Metric, NOTHING, metric};
use crate::step::Step;

/// Turn rates below this absolute value count as no turn, rad/s.
const DEAD_BAND_RAD_S: f64 = 0.02;

/// UAV time steps so far, and turn reversals.
#[derive(Debug, Default)]
pub(crate) struct ControlEffort {
    infeasible: Mean,
    turn_rate_saturated: Mean,
    turn_rate_saturated_settled: Mean,
    /// Time steps at which the law commanded a speed outside the limits.
    speed_saturated: Mean,
    reversals: u64,
    /// True if the last turn of a UAV beyond the dead band was to the left (anticlockwise).
    last_is_left: ById<bool>,
}

impl Family for ControlEffort {
    const SECTION: &'static str = "Guidance";
    const METRICS: &'static [Metric<Self>] = &[
        metric("infeasible_fraction", "UAV time without a feasible orbit", LARGE, 0.01, GROUPS, |of, _| {
            of.infeasible.value()
        }),
        metric(
            "turn_rate_saturated_fraction",
            "UAV time with the turn rate at its limit",
            LARGE,
            0.01,
            NOTHING,
            |of, _| of.turn_rate_saturated.value(),
        ),
        metric(
            "turn_rate_saturated_fraction_settled",
            "UAV time with the turn rate at its limit, settled",
            LARGE,
            0.01,
            NOTHING,
            |of, _| of.turn_rate_saturated_settled.value(),
        ),
        metric("speed_saturated_fraction", "UAV time with the speed at a limit", LARGE, 0.01, NOTHING, |of, _| {
            of.speed_saturated.value()
        }),
        metric("turn_reversals_per_min", "turn reversals per UAV and minute", LARGE, 0.5, NOTHING, |of, run| {
            per_min(of.reversals, of.speed_saturated.n, run.config.period_s)
        }),
    ];

    fn add(&mut self, step: &Step<'_>) {
        let settled = step.config.is_settled(step.frame);
        for uav in step.frame.uavs.iter().filter(|uav| uav.boresight_rad.is_some()) {
            let group = group_of(step.frame, uav);
            self.infeasible.add(f64::from(group.is_some_and(|group| !group.feasible)));
            let saturated = f64::from(uav.turn_rate_limited);
            self.turn_rate_saturated.add(saturated);
            if settled {
                self.turn_rate_saturated_settled.add(saturated);
            }
            self.speed_saturated.add(f64::from(uav.speed_limited));
            // The last turn counts, even if dead-band time steps or an outage lie in between.
            if uav.turn_rate_rad_s.abs() > DEAD_BAND_RAD_S {
                let is_left = uav.turn_rate_rad_s > 0.0;
                let was_left = std::mem::replace(self.last_is_left.entry(uav.uav, || is_left), is_left);
                self.reversals += u64::from(was_left != is_left);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::ScoreConfig;
    use crate::common::{config_of, score, score_config};
    use crate::metrics::Metrics;
    use crate::missions::{frames, load};
    use crate::row_fixtures::uav_row;
    use standoff_record::{Frame, UavRow};

    fn flown(rows: &[UavRow]) -> Metrics {
        let frames: Vec<Frame> = rows.iter().map(|row| Frame { uavs: vec![*row], ..Frame::default() }).collect();
        score(&score_config(), &frames)
    }

    /// Reversals per minute of a UAV with these turn rates, rad/s, one per time step of 0.5 s.
    fn reversals_per_min(turns_rad_s: &[f64]) -> Option<f64> {
        let rows: Vec<UavRow> = turns_rad_s
            .iter()
            .map(|turn_rate_rad_s| UavRow { turn_rate_rad_s: *turn_rate_rad_s, ..uav_row(0) })
            .collect();
        flown(&rows)["turn_reversals_per_min"]
    }

    /// Six time steps: left, nearly straight, right, nearly straight to the left, right, left. Two reversals in 0.05 min
    /// are 40 per minute.
    #[test]
    fn reversal_crosses_the_whole_dead_band() {
        assert!((reversals_per_min(&[0.3, 0.019, -0.021, 0.02, -0.3, 0.021]).unwrap() - 40.0).abs() < 1e-9);
        assert_eq!(reversals_per_min(&[0.3, 0.0, 0.3, 0.01, -0.019, 0.1]), Some(0.0));
        assert_eq!(reversals_per_min(&[]), None);
        assert_eq!(reversals_per_min(&[-0.3]), Some(0.0));
    }

    /// Left, three time steps of outage, right: the outage does not count, the reversal does. In one of the two counted
    /// time steps the speed is at a limit: the fraction is 0.5, with one reversal in 1/60 min.
    #[test]
    fn outage_time_does_not_count() {
        let row = |turn_rate_rad_s: f64, speed_limited: bool| UavRow { turn_rate_rad_s, speed_limited, ..uav_row(0) };
        let out = UavRow { boresight_rad: None, ..row(0.2, false) };
        let metrics = flown(&[row(0.2, true), out, UavRow { turn_rate_rad_s: -0.2, ..out }, out, row(-0.2, false)]);
        assert_eq!(metrics["speed_saturated_fraction"], Some(0.5));
        assert!((metrics["turn_reversals_per_min"].unwrap() - 60.0).abs() < 1e-9);
        assert_eq!(flown(&[out])["speed_saturated_fraction"], None);
    }

    /// Two UAVs that turn steadily in opposite directions have no reversals.
    #[test]
    fn uavs_are_scored_independently() {
        let uavs = [(0, 0.1), (1, -0.1)].map(|(uav, turn_rate_rad_s)| UavRow { turn_rate_rad_s, ..uav_row(uav) });
        let frame = Frame { uavs: uavs.to_vec(), ..Frame::default() };
        assert_eq!(score(&score_config(), [&frame; 3])["turn_reversals_per_min"], Some(0.0));
    }

    #[test]
    fn settled_saturation_counts_from_the_end_of_the_transient() {
        let scenario = load("tour/05-a-handoff", &[], 1);
        let (score_config, mut frames) = (config_of(&scenario.settings), frames(&scenario));
        for frame in &mut frames {
            let limited = frame.time_us < 20_000_000;
            frame.uavs.iter_mut().for_each(|uav| uav.turn_rate_limited = limited);
        }
        let settled = |transient_s: f64| {
            let metrics = score(&ScoreConfig { transient_s, ..score_config.clone() }, &frames);
            assert!(metrics["turn_rate_saturated_fraction"] > Some(0.0));
            metrics["turn_rate_saturated_fraction_settled"]
        };
        assert_eq!(settled(20.0), Some(0.0));
        assert!(settled(19.0) > Some(0.0) && settled(1e6).is_none());
    }
}
