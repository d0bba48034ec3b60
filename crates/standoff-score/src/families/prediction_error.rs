//! One-step prediction error of orbits: the part of the standoff error that no guidance law can avoid.
//!
//! The position of a UAV results from commands of the previous time step or earlier, when the current orbit could only
//! be predicted. A UAV that is exactly on the predicted orbit therefore still has this error. No UAV with the same
//! information can have a smaller one, provided that inward and outward errors are equally likely.
//!
//! ```text
//! e = |u - c| - r_d        prediction error  = | e(current orbit) - e(orbit predicted one time step ago) |
//! ```

use standoff::by_group::ByGroup;
use standoff::guidance::orbit_motion::OrbitMotion;
use standoff::{TargetState, Velocity};
use standoff_record::{GroupRow, TrackRow};

use crate::geometry::{at, centre, off_orbit_m};
use crate::matching;
use crate::mean::Mean;
use crate::metric::{BOTH, Family, Metric, MetricSet, NEITHER, metric};
use crate::step::{Inputs, Step};
use crate::true_orbits::TrueOrbits;

/// One-step prediction errors of a run, from `transient_s` on.
#[derive(Debug, Default)]
pub(crate) struct PredictionErrors {
    before: Vec<TrackRow>,
    groups_before: Vec<GroupRow>,
    orbits_before: TrueOrbits,
    /// Tracks on the orbit of each group, now and before.
    on_orbits: ByGroup<u32>,
    on_orbits_before: ByGroup<u32>,
    /// Predicted members of one group; reused buffer.
    members: Vec<TargetState>,
    /// Error of the true orbit, m.
    truth: Mean,
    /// Error of the agents' own orbit, m.
    own: Mean,
}

impl Family for PredictionErrors {
    const SECTION: &'static str = "Guidance";
    const SET: MetricSet = MetricSet::Limits;
    const METRICS: &'static [Metric<Self>] = &[
        metric("orbit_prediction_error_m_settled", "orbit prediction error", NEITHER, 0.2, BOTH, |of, _| {
            of.truth.value()
        }),
        metric(
            "own_orbit_prediction_error_m_settled",
            "orbit prediction error (own estimate)",
            NEITHER,
            0.2,
            BOTH,
            |of, _| of.own.value(),
        ),
    ];

    fn inputs(_: &[&str]) -> Inputs {
        Inputs { true_orbits: true, ..Inputs::default() }
    }

    fn add(&mut self, step: &Step<'_>) {
        let frame = step.frame;
        std::mem::swap(&mut self.on_orbits, &mut self.on_orbits_before);
        self.on_orbits.fill(matching::on_orbits(frame.tracks.iter()));
        if step.config.is_settled(frame) {
            frame.groups.iter().for_each(|group| self.group(step, group));
        }
        self.orbits_before.clone_from(step.true_orbits);
        self.before.clone_from(&frame.tracks);
        self.groups_before.clone_from(&frame.groups);
    }
}

impl PredictionErrors {
    /// Groups count only while their members stay the same: a change of membership is not a prediction error.
    fn group(&mut self, step: &Step<'_>, group: &GroupRow) {
        let Step { config, frame, true_orbits: orbits, .. } = step;
        let old = self.groups_before.binary_search_by_key(&group.group, |old| old.group);
        let Some(old) = old.ok().map(|index| &self.groups_before[index]) else { return };
        let before = self.on_orbits_before.of(group.group).map(|index| &self.before[index]);
        let now = self.on_orbits.of(group.group).map(|index| &frame.tracks[index]);
        if !before.clone().map(matching::key).eq(now.map(matching::key)) {
            return;
        }
        self.members.clear();
        self.members.extend(before.map(|track| step.transition.predict(&TargetState(track.state.into()))));
        let members = &self.members;
        let (Some(truth), Some(desired)) = (orbits.of(group.group), config.orbit(members)) else { return };
        let after = |flown: &OrbitMotion, margin_m: f64| config.orbit_after(flown, &desired, members, margin_m);
        let expected_true = self.orbits_before.of(group.group).map_or(desired, |orbit| after(&orbit.flown, 0.0));
        let orbit = |row: &GroupRow| OrbitMotion {
            centre: centre(row),
            velocity: Velocity::from_m_s(row.vx_m_s, row.vy_m_s),
            radius_m: row.standoff_distance_m,
            rate_m_s: row.standoff_rate_m_s,
            turn_limit_m: row.turn_limit_m.unwrap_or(f64::INFINITY),
        };
        let (own, was) = (orbit(group), orbit(old));
        let expected_own = if config.orbit_motion.is_instantaneous() {
            // The agents' own centre moves on at constant velocity.
            let centre = was.centre + was.velocity * config.period_s;
            let state = TargetState::new(centre, was.velocity, [0.0; 2]);
            let standoff = config.standoff_distance(members, &state, group.margin_m, desired.turn_limit_m);
            OrbitMotion::start(&state, &standoff, desired.turn_limit_m)
        } else {
            after(&was, group.margin_m)
        };
        for index in step.uavs.of(group.group) {
            let uav = &frame.uavs[index];
            let off_m = |orbit: &OrbitMotion| off_orbit_m(at(uav), orbit.centre, orbit.radius_m);
            self.truth.add((off_m(&truth.flown) - off_m(&expected_true)).abs());
            self.own.add((off_m(&own) - off_m(&expected_own)).abs());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use standoff::Position;
    use standoff_record::Frame;

    use crate::ScoreConfig;
    use crate::common::config_of;
    use crate::metric::accumulated;
    use crate::missions::{frames, load};
    use crate::{MetricSelection, Scorer};

    fn flown(set: &[&str]) -> (ScoreConfig, Vec<Frame>) {
        let scenario = load("paper/table-2-pair", set, 4);
        (config_of(&scenario.settings), frames(&scenario))
    }

    fn prediction_errors(score_config: &ScoreConfig, frames: &[Frame]) -> [f64; 2] {
        let prediction_errors: PredictionErrors = accumulated(score_config, frames);
        [prediction_errors.truth.value().unwrap(), prediction_errors.own.value().unwrap()]
    }

    /// With exact cues, exact measurements and constant target velocities, the prediction error is zero.
    #[test]
    fn prediction_error_is_zero_without_noise() {
        let exact = [
            "sensor.range_sd_m=0",
            "sensor.bearing_sd_deg=0",
            "cue.position_sd_m=1e-3",
            "cue.velocity_sd_m_s=1e-3",
            "targets.acceleration_sd_m_s2=0",
            "filter.acceleration_sd_m_s2=1e-3",
        ];
        let (score_config, frames) = flown(&exact);
        let [truth_m, own_m] = prediction_errors(&score_config, &frames);
        assert!(truth_m < 0.02 && own_m < 0.02, "{truth_m} {own_m}");
    }

    /// Moving the true targets 700 m away from the UAV gives a prediction error of 700 m; the agents' own error is
    /// unchanged.
    #[test]
    fn displaced_truth_gives_a_prediction_error() {
        let (score_config, mut frames) = flown(&[]);
        frames.iter_mut().for_each(|frame| frame.uavs.truncate(1));
        let [_, own_m] = prediction_errors(&score_config, &frames);
        for frame in &mut frames {
            let (uav, group) = (frame.uavs[0], &frame.groups[0]);
            let away = Position::from_m(group.x_m, group.y_m) - at(&uav);
            for truth in &mut frame.truth {
                truth.x_m += 700.0 * away.direction().cos();
                truth.y_m += 700.0 * away.direction().sin();
            }
        }
        let [truth_m, own_after_m] = prediction_errors(&score_config, &frames);
        assert!((truth_m - 700.0).abs() < 10.0, "{truth_m}");
        assert_eq!(own_m.to_bits(), own_after_m.to_bits());
    }

    /// Errors are not smaller than their prediction error, within the accuracy of 60 runs.
    #[test]
    fn standoff_errors_exceed_their_prediction_errors() {
        let choice = MetricSelection::parse("standard,limits").unwrap();
        let (mut errors_m, mut surprises_m) = ([0.0; 2], [0.0; 2]);
        for seed in 0..60 {
            let scenario = load("paper/table-2-pair", &[], seed);
            let mut scorer = Scorer::new(config_of(&scenario.settings), choice);
            frames(&scenario).iter().for_each(|frame| scorer.frame(frame));
            let metrics = scorer.metrics();
            errors_m[0] += metrics["standoff_error_m_settled"].unwrap();
            errors_m[1] += metrics["standoff_error_own_estimate_m_settled"].unwrap();
            surprises_m[0] += metrics["orbit_prediction_error_m_settled"].unwrap();
            surprises_m[1] += metrics["own_orbit_prediction_error_m_settled"].unwrap();
        }
        assert!(errors_m[0] > surprises_m[0] && errors_m[1] > surprises_m[1], "{errors_m:?} {surprises_m:?}");
        assert!(surprises_m.iter().all(|surprise_m| *surprise_m > 60.0 * 0.1));
    }
}
