//! Collision avoidance: keeps the minimum distance between aircraft by small changes of the desired command.
//!
//! Each UAV predicts its own path under a command and the paths of the other aircraft. It flies the desired command if
//! that keeps the minimum distance to all of them. Otherwise it flies the admissible command, from a grid of turn rates
//! and speeds, that is closest to the desired one and keeps the minimum distance to all aircraft together. This is the
//! idea of velocity obstacles (P. Fiorini and Z. Shiller, *Motion Planning in Dynamic Environments Using Velocity
//! Obstacles*, International Journal of Robotics Research 17(7), 1998), with arcs instead of straight lines, as flown
//! by fixed-wing aircraft.
//!
//! Right of way: the UAV with the lower id looks far ahead and gives way early. The UAV with the higher id keeps its
//! course and turns away only if the other one does not give way in time. If both gave way early, they could keep
//! turning away side by side.

use crate::guidance::command_candidates::Costs;
use crate::guidance::heading::Steering;
use crate::guidance::predicted_trajectory::{Intent, PredictedTrajectory};
use crate::guidance::pursuer_model;
use crate::params::{SeparationParams, UavParams};
use crate::uav::{Aircraft, Command, UavId, UavState, Vertical};

/// Buffer added to the minimum distance to cover prediction errors, m.
const BUFFER_M: f64 = 20.0;

/// Prediction horizon of the UAV that gives way, s.
const AHEAD_S: f64 = 8.0;

/// Prediction horizon of the UAV with the right of way, s.
const SHORT_AHEAD_S: f64 = 3.0;
/// Reduction of the distance at which the UAV with the right of way turns away too, m.
const LESS_M: f64 = 15.0;

/// Growth of the position uncertainty of another aircraft per second since its last report, m/s.
const DRIFT_M_S: f64 = 10.0;
/// Growth of the required distance per second of prediction and second of report age, m/s2.
const DRIFT_M_S2: f64 = 6.0;
/// Maximum age of a report used for the uncertainty, s. Older reports count as this old.
const SILENT_MAX_S: f64 = 10.0;

/// Reduction of the buffer of the UAV with the right of way per second since the last report of the other one, m/s.
/// With an older report it turns later, because simultaneous manoeuvres of both UAVs may cancel each other.
const BUFFER_REDUCTION_M_S: f64 = 25.0;
/// Lower bound of the buffer of the UAV with the right of way, m.
const SPARE_MIN_M: f64 = -10.0;

/// Costs of a command that differs from the desired one.
const COSTS: Costs = Costs { speed: 0.1, turn: 0.2 };
/// Cost of falling short of the required distance, per fraction of that distance.
const SHORTFALL_COST: f64 = 100.0;

/// Prediction horizon for intruders, s. Both straight flight and pursuit of the UAV are predicted.
const INTRUDER_AHEAD_S: f64 = 12.0;
/// Durations of a turn followed by straight flight that are tried to avoid an intruder, s.
const TURNS_S: [f64; 4] = [2.0, 4.0, 7.0, 10.0];

/// Another aircraft, as last reported.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct OtherAircraft {
    pub(crate) aircraft: Aircraft,
    pub(crate) reported_state: UavState,
    /// Age of the report, s.
    pub(crate) age_s: f64,
}

impl OtherAircraft {
    /// Lowest and highest altitude within the prediction horizon, m; `None` if unknown.
    fn levels_m(&self) -> Option<[f64; 2]> {
        self.reported_state.vertical.map(|vertical| reach_m(vertical, vertical.altitude_m, AHEAD_S + self.age_s))
    }
}

/// An aircraft that a UAV avoids.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(not(feature = "research"), non_exhaustive)]
pub struct Avoidance {
    /// The avoided aircraft; without the avoidance, the UAV would have come too near to it.
    pub aircraft: Aircraft,
    /// Predicted minimum distance to it without the avoidance, m.
    pub predicted_distance_m: f64,
}

/// Maximum difference between the reported turn rate of a teammate and the one expected from its group's orbit, rad/s.
/// It grows by this amount per second since the report. A teammate beyond it is assumed to fly an avoidance manoeuvre.
const TRUST_RAD_S: f64 = 0.15;
/// Assumed remaining duration of a teammate's avoidance manoeuvre, s.
const AVOIDING_S: f64 = 1.0;

/// Collision avoidance of one UAV.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CollisionAvoidance<'a> {
    pub(crate) separation: &'a SeparationParams,
    pub(crate) uav: &'a UavParams,
    pub(crate) id: UavId,
    pub(crate) own: &'a UavState,
}

/// Another aircraft that may come near.
#[derive(Debug, Clone, Copy)]
struct Near {
    aircraft: Aircraft,
    course: PredictedTrajectory,
    /// Current state of an aircraft that may pursue the UAV.
    pursuer: Option<UavState>,
    /// Prediction horizon, s.
    ahead_s: f64,
    /// Required distance, m.
    required_m: f64,
    /// Growth of the required distance per second of prediction, m/s.
    growth_m_s: f64,
}

impl CollisionAvoidance<'_> {
    /// Returns the command to fly instead of the desired one, and the aircraft that it avoids, if any. The desired
    /// command must be within the limits.
    ///
    /// `altitude_m` is the commanded altitude. `intent_of` returns the intent of a teammate on its group's orbit.
    /// `is_allowed` returns false for commands that must not be flown for other reasons.
    pub(crate) fn avoid(
        &self,
        (desired, steering): (Command, Option<&Steering>),
        altitude_m: Option<f64>,
        others: impl Iterator<Item = OtherAircraft>,
        intent_of: impl Fn(UavId) -> Option<Intent>,
        is_allowed: impl Fn(Command) -> bool,
    ) -> (Command, Option<Avoidance>) {
        let levels = self.levels_m(altitude_m);
        let others = others.filter(|other| !self.is_separated(levels, other));
        let near: Vec<Near> = others.filter_map(|other| self.near(&other, &intent_of)).collect();
        if near.is_empty() {
            return (desired, None);
        }
        let intent = steering.map_or(Intent::held(desired), |steering| Intent::of(desired, self.own.heading, steering));
        let course = PredictedTrajectory::of(self.own, intent, self.uav.turn_rate_lag_s, 0.0);
        match self.shortfall(&course, &near, f64::INFINITY) {
            (_, None) => (desired, None),
            (_, avoidance) => (self.nearest_command((desired, course), &near, is_allowed), avoidance),
        }
    }

    /// Returns the altitude to command on the way to a desired altitude, m. The UAV does not climb or descend past a
    /// nearby aircraft that is separated from it by altitude only.
    pub(crate) fn altitude_m(&self, desired_m: f64, others: impl Iterator<Item = OtherAircraft>) -> f64 {
        let Some(own) = self.own.vertical else { return desired_m };
        // Altitudes between these two are clear of all nearby aircraft.
        let [mut low_m, mut high_m] = [f64::NEG_INFINITY, f64::INFINITY];
        for other in others {
            let Some((vertical, [other_low_m, other_high_m])) = other.reported_state.vertical.zip(other.levels_m())
            else {
                continue;
            };
            let clear_m =
                CLIMB_CLEAR_MINIMA * self.separation.horizontal_min_m + 2.0 * self.uav.speed_max_m_s() * other.age_s;
            let is_clear = self.own.position.squared_distance_m2(other.reported_state.position) > clear_m * clear_m;
            let over_m = own.altitude_m - vertical.altitude_m;
            // If the altitudes already overlap, waiting does not help.
            if is_clear || over_m.abs() < self.separation.vertical_min_m {
                continue;
            }
            if over_m > 0.0 {
                low_m = low_m.max(other_high_m + self.separation.vertical_min_m);
            } else {
                high_m = high_m.min(other_low_m - self.separation.vertical_min_m);
            }
        }
        let waiting_m = if desired_m > high_m {
            (high_m - SPARE_VERTICAL_M).max(low_m)
        } else if desired_m < low_m {
            (low_m + SPARE_VERTICAL_M).min(high_m)
        } else {
            return desired_m;
        };
        // The UAV keeps its altitude if it is blocked from both sides, or if it would move away from the desired
        // altitude.
        let is_backwards = (waiting_m - own.altitude_m) * (desired_m - own.altitude_m) <= 0.0;
        if low_m > high_m || is_backwards { own.altitude_m } else { waiting_m }
    }

    /// Lowest and highest altitude that the UAV will have on the way to `altitude_m`, m; `None` if unknown.
    fn levels_m(&self, altitude_m: Option<f64>) -> Option<[f64; 2]> {
        let own = self.own.vertical?;
        Some(reach_m(own, altitude_m.unwrap_or(own.altitude_m), 2.0))
    }

    /// Returns true if both are separated by altitude for the whole prediction horizon.
    fn is_separated(&self, levels: Option<[f64; 2]>, other: &OtherAircraft) -> bool {
        levels.zip(other.levels_m()).is_some_and(|([low_m, high_m], [other_low_m, other_high_m])| {
            other_low_m - high_m >= self.separation.vertical_min_m
                || low_m - other_high_m >= self.separation.vertical_min_m
        })
    }

    /// Returns true if another aircraft may come near before its report is too old. Others are ignored early.
    #[inline]
    pub(crate) fn may_come_near(&self, other: &UavState) -> bool {
        let spare_m = BUFFER_M + SILENT_MAX_S * (DRIFT_M_S + DRIFT_M_S2 * AHEAD_S);
        let flown_m = self.uav.speed_max_m_s() * AHEAD_S + other.speed_m_s.abs() * (AHEAD_S + SILENT_MAX_S);
        let far_m = CLIMB_CLEAR_MINIMA * self.separation.horizontal_min_m + spare_m + flown_m;
        self.own.position.squared_distance_m2(other.position) < far_m * far_m
    }

    /// Predicts another aircraft and sets the required distance; `None` if it is too far away to matter. This UAV gives
    /// way to teammates with a higher id and to intruders.
    fn near(&self, other: &OtherAircraft, intent_of: impl Fn(UavId) -> Option<Intent>) -> Option<Near> {
        let OtherAircraft { aircraft, reported_state: reported, age_s } = other;
        let age_s = age_s.min(SILENT_MAX_S);
        let minimum_m = self.separation.horizontal_min_m;
        let gives_way = |ahead_s| (ahead_s, minimum_m + BUFFER_M + DRIFT_M_S * age_s, DRIFT_M_S2 * age_s);
        let (teammate, (ahead_s, required_m, growth_m_s)) = match *aircraft {
            // Intruders do not give way.
            Aircraft::Intruder(_) => (None, gives_way(INTRUDER_AHEAD_S)),
            Aircraft::Uav(teammate) if self.id < teammate => (Some(teammate), gives_way(AHEAD_S)),
            Aircraft::Uav(teammate) => {
                let spare_m = (BUFFER_M - BUFFER_REDUCTION_M_S * age_s).max(SPARE_MIN_M);
                (Some(teammate), (SHORT_AHEAD_S + age_s, minimum_m - LESS_M + spare_m, 0.0))
            }
        };
        let UavState { position, speed_m_s, turn_rate_rad_s, .. } = *reported;
        let least_m = required_m + growth_m_s * ahead_s;
        let reach_m = least_m + self.uav.speed_max_m_s() * ahead_s + speed_m_s.abs() * (ahead_s + age_s);
        if self.own.position.squared_distance_m2(position) >= reach_m * reach_m {
            return None;
        }
        let is_trusted =
            |intent: &Intent| (intent.command.turn_rate_rad_s - turn_rate_rad_s).abs() < TRUST_RAD_S * (1.0 + age_s);
        let flown = Intent::held(Command { speed_m_s, turn_rate_rad_s });
        let intent = match teammate.and_then(intent_of) {
            None => flown,
            Some(intent) if is_trusted(&intent) => intent,
            // The teammate avoids another aircraft and will return to its orbit.
            Some(intent) => Intent { for_s: AVOIDING_S, turn_rate_after_rad_s: intent.turn_rate_after_rad_s, ..flown },
        };
        let course = PredictedTrajectory::of(reported, intent, self.uav.turn_rate_lag_s, age_s);
        let pursuer = teammate.is_none().then(|| reported.extrapolated(age_s));
        Some(Near { aircraft: *aircraft, course, pursuer, ahead_s, required_m, growth_m_s })
    }

    /// Returns the admissible command with the lowest cost; the desired command if no other is admissible.
    #[cold]
    fn nearest_command(
        &self,
        (desired, course): (Command, PredictedTrajectory),
        near: &[Near],
        is_allowed: impl Fn(Command) -> bool,
    ) -> Command {
        let mut best = (f64::INFINITY, desired);
        let turns_s = if near.iter().any(|other| other.pursuer.is_some()) { &TURNS_S[..] } else { &[] };
        for (effort, command) in COSTS.candidates(self.uav, self.own.turn_rate_rad_s, desired) {
            // A command with a larger shortfall costs more than the best one.
            let short_max = (best.0 - effort) / SHORTFALL_COST;
            if short_max <= 0.0 {
                break;
            }
            let held = Intent::held(command);
            let mut short = self.shortfall(&course.with(held), near, short_max).0;
            for for_s in turns_s {
                if short > 0.0 {
                    let turn = Intent { for_s: *for_s, turn_rate_after_rad_s: 0.0, ..held };
                    short = short.min(self.shortfall(&course.with(turn), near, short_max).0);
                }
            }
            if short < short_max && is_allowed(command) {
                best = (effort + SHORTFALL_COST * short, command);
            }
        }
        best.1
    }

    /// Largest shortfall of a course, as a fraction of the required distance, and the aircraft concerned. The search
    /// stops once the shortfall reaches `short_max`.
    fn shortfall(&self, course: &PredictedTrajectory, near: &[Near], short_max: f64) -> (f64, Option<Avoidance>) {
        let mut worst = (0.0, None);
        for other in near {
            let furthest_m = other.required_m + other.growth_m_s * other.ahead_s;
            if other.pursuer.is_none() && course.separation_m(&other.course, other.ahead_s) >= furthest_m {
                continue;
            }
            let closing_m_s = course.fastest_m_s() + other.course.fastest_m_s() + other.growth_m_s;
            let enough_m = other.required_m * (1.0 - short_max);
            let (mut after_s, mut spare_m, mut predicted_distance_m) = (0.0, f64::INFINITY, f64::INFINITY);
            while after_s < other.ahead_s && spare_m >= enough_m {
                let distance_m = course.at(after_s).distance_m(other.course.at(after_s));
                let left_m = distance_m - other.growth_m_s * after_s;
                (spare_m, predicted_distance_m) = (spare_m.min(left_m), predicted_distance_m.min(distance_m));
                // Before that time, the distance cannot fall below the required one or the smallest one found so far,
                // whichever is smaller.
                after_s += ((left_m - other.required_m.min(spare_m)) / closing_m_s).max(0.25);
            }
            if let Some(pursuer) = &other.pursuer {
                let turn_max_rad_s = self.uav.turn_rate_max_rad_s;
                let closest_m =
                    pursuer_model::closest_m(pursuer, turn_max_rad_s, other.ahead_s, other.growth_m_s, |at_s| {
                        course.at(at_s)
                    });
                (spare_m, predicted_distance_m) = (spare_m.min(closest_m), predicted_distance_m.min(closest_m));
            }
            let short = (other.required_m - spare_m) / other.required_m;
            if short > worst.0 {
                worst = (short, Some(Avoidance { aircraft: other.aircraft, predicted_distance_m }));
            }
            if short >= short_max {
                break;
            }
        }
        worst
    }
}

/// Horizontal distance within which a UAV does not climb or descend past another aircraft, in multiples of the minimum.
const CLIMB_CLEAR_MINIMA: f64 = 6.0;
/// Buffer added to the minimum altitude difference for a UAV that waits for another aircraft to clear its altitude, m.
const SPARE_VERTICAL_M: f64 = 1.0;

/// Lowest and highest altitude of a UAV on its way to `to_m`, m. Includes `after_s` seconds at the current climb rate.
fn reach_m(from: Vertical, to_m: f64, after_s: f64) -> [f64; 2] {
    let ends_m = [to_m, from.altitude_m + from.climb_rate_m_s * after_s];
    [ends_m.into_iter().fold(from.altitude_m, f64::min), ends_m.into_iter().fold(from.altitude_m, f64::max)]
}

#[cfg(test)]
mod tests;
