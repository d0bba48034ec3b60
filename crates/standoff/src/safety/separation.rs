//! Separation: UAVs keep the minimum distance to other aircraft by small changes of the desired command.
//!
//! A UAV flies the desired command if that keeps the required distance to all other aircraft. Otherwise it
//! [selects](crate::safety::selection) another one. Predicted paths are arcs, as flown by fixed-wing aircraft (P. Fiorini
//! and Z. Shiller, *Motion Planning in Dynamic Environments Using Velocity Obstacles*, International Journal of Robotics
//! Research 17(7), 1998). All motion is relative to the air: a steady wind moves all aircraft alike.
//!
//! The UAVs near each other [plan](crate::safety::joint_plan) one after the other, by ascending id. Each UAV computes the
//! plans of those before it from the same reports, so that it knows their commands and none undoes the manoeuvre of
//! another. [Fallbacks](crate::safety::fallback) keep them separable whatever they do next, and respect the geofence.

use crate::message::Manoeuvre;
use crate::params::SeparationParams;
use crate::safety::fallback::{FallbackModel, Plan};
use crate::safety::motion::{Airframe, Motion};
use crate::safety::other_aircraft::{OtherAircraft, SILENT_MAX_S};
use crate::safety::predicted_trajectory::{Intent, PredictedTrajectory, SampledTrajectory};
use crate::safety::zones::GeofenceSafety;
use crate::uav::{Aircraft, Command, UavId, UavState};

/// Buffer added to the minimum distance to cover errors of the predicted paths of teammates, m.
pub(crate) const BUFFER_M: f64 = 12.0;
/// The same for intruders.
const INTRUDER_BUFFER_M: f64 = 25.0;
/// Buffer added to the minimum distance of escape manoeuvres, whose prediction is exact, m.
pub(crate) const FALLBACK_BUFFER_M: f64 = 2.0;

/// Prediction horizon for teammates, s.
pub(crate) const AHEAD_S: f64 = 8.0;

/// Growth of the position uncertainty of another aircraft per second since its last report, m/s.
pub(crate) const DRIFT_M_S: f64 = 25.0;
/// Growth of the required distance per second of prediction and second of report age, m/s2.
const DRIFT_M_S2: f64 = 6.0;

/// Additional distance for the aircraft that a UAV already avoids, m.
const CLEAR_M: f64 = 4.0;

/// The same for each second of age of its report and each m/s2 of drift, s: with old reports, two UAVs that end their
/// manoeuvres as mirror images of each other would meet again.
const CLEAR_OF_OLD_S: f64 = 2.0;

/// Prediction horizon for intruders, s. Both straight flight and pursuit of the UAV are predicted.
const INTRUDER_AHEAD_S: f64 = 12.0;

/// Horizontal distance within which a UAV does not climb or descend past another aircraft, in multiples of the minimum.
pub(crate) const CLIMB_CLEAR_MINIMA: f64 = 6.0;

/// An aircraft that a UAV avoids.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Avoidance {
    /// The avoided aircraft; without the avoidance, the UAV would have come too near to it.
    pub aircraft: Aircraft,
    /// Predicted minimum distance to it without the avoidance, m.
    pub predicted_distance_m: f64,
    /// True if the UAV turns to the left if the conflict remains, false if to the right.
    pub is_left: bool,
    /// True if the UAV gives up the minimum separation for now: no command keeps it within the limits and the
    /// geofence. The UAV flies the one that opens the distance most.
    pub is_given_up: bool,
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
    pub(crate) fallbacks: &'a FallbackModel,
    pub(crate) geofence: Option<&'a GeofenceSafety>,
    pub(crate) id: UavId,
    pub(crate) own: &'a Motion,
    /// Manoeuvre since the last decision, as reported.
    pub(crate) manoeuvre: Option<Manoeuvre>,
    /// Fallback that the UAV has planned.
    pub(crate) plan: Option<Plan>,
}

/// Commands that teammates fly if no aircraft is near.
pub(crate) trait DesiredCommands {
    /// Intent of a teammate at its last report if it follows the orbit of its group; `None` without a group.
    fn intent_of(&self, teammate: UavId) -> Option<Intent>;

    /// Intent of a teammate that moves with `motion`, within the limits and its geofence.
    fn desired(&self, teammate: UavId, motion: &Motion) -> Intent;
}

/// Another aircraft that may come near.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Near {
    pub(crate) aircraft: Aircraft,
    pub(crate) course: SampledTrajectory,
    /// Current state of an aircraft that may pursue the UAV.
    pub(crate) pursuer: Option<UavState>,
    pub(crate) required: Required,
}

/// Distance that must be kept from another aircraft.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Required {
    /// Prediction horizon, s.
    pub(crate) ahead_s: f64,
    /// Distance required now, m.
    pub(crate) now_m: f64,
    /// Age of the report, s.
    pub(crate) age_s: f64,
}

impl Required {
    /// Growth of the distance per second of prediction, m/s.
    pub(crate) fn growth_m_s(&self) -> f64 {
        DRIFT_M_S2 * self.age_s
    }

    /// Largest distance required within the horizon, m.
    fn most_m(&self) -> f64 {
        self.now_m + self.growth_m_s() * self.ahead_s
    }
}

impl CollisionAvoidance<'_> {
    /// True if the escape manoeuvres of this UAV and another one may meet.
    pub(crate) fn can_meet(&self, other: &UavState, age_s: f64) -> bool {
        let speeds_m_s = self.own.state.speed_m_s.abs() + other.speed_m_s.abs();
        // A geofence may leave only one turn to both, so that their circles meet although they fly apart.
        let circles_m = match self.geofence {
            Some(_) => [self.own.state, *other].map(|state| self.fallbacks.circle_m(&self.own.with_state(state))),
            None => [0.0; 2],
        };
        let reach_m = self.separation.horizontal_min_m
            + FALLBACK_BUFFER_M
            + speeds_m_s * self.fallbacks.turning_s
            + 2.0 * (circles_m[0] + circles_m[1])
            + (other.speed_m_s.abs() + DRIFT_M_S) * age_s;
        self.own.state.position.squared_distance_m2(other.position) < reach_m * reach_m
    }

    /// Returns true if another aircraft may come near before its report is too old. Others are ignored early.
    #[inline]
    pub(crate) fn may_come_near(&self, other: &UavState) -> bool {
        let far_m = self.reach_m(other.speed_m_s.abs());
        self.own.state.position.squared_distance_m2(other.position) < far_m * far_m
    }

    /// Distance beyond which another aircraft of a speed, m/s, cannot come near, m.
    fn reach_m(&self, speed_m_s: f64) -> f64 {
        reach_m(self.separation, &self.fallbacks.airframe, speed_m_s)
    }

    /// Predicts another aircraft and sets the required distance; `None` if it is too far away to matter, at least for
    /// the given course.
    pub(crate) fn near(
        &self,
        other: &OtherAircraft,
        own_course: Option<&PredictedTrajectory>,
        intent_of: impl Fn(UavId) -> Option<Intent>,
    ) -> Option<Near> {
        let OtherAircraft { aircraft, motion: Motion { state: reported, .. }, age_s, .. } = *other;
        let age_s = age_s.min(SILENT_MAX_S);
        let (ahead_s, buffer_m, intent, pursuer) = match aircraft {
            Aircraft::Intruder(_) => (INTRUDER_AHEAD_S, INTRUDER_BUFFER_M, None, Some(reported.extrapolated(age_s))),
            Aircraft::Uav(teammate) => (AHEAD_S, BUFFER_M, intent_of(teammate), None),
        };
        let required = self.required(ahead_s, buffer_m, age_s);
        if !self.is_within_reach(&reported, age_s, required) {
            return None;
        }
        let course = self.predicted(other, intent);
        let required = self.kept(aircraft, required);
        let is_clear = |own: &PredictedTrajectory| own.separation_m(&course, required.ahead_s) >= required.most_m();
        if pursuer.is_none() && own_course.is_some_and(is_clear) {
            return None;
        }
        Some(Near { aircraft, course: course.sampled(), pursuer, required })
    }

    /// Required distance to an aircraft whose report is `age_s` seconds old.
    pub(crate) fn required(&self, ahead_s: f64, buffer_m: f64, age_s: f64) -> Required {
        let now_m = self.separation.horizontal_min_m + buffer_m + DRIFT_M_S * age_s;
        Required { ahead_s, now_m, age_s }
    }

    /// A required distance, larger for the aircraft that the UAV already avoids: a manoeuvre ends only when clear.
    pub(crate) fn kept(&self, aircraft: Aircraft, required: Required) -> Required {
        let is_avoided = self.manoeuvre.is_some_and(|manoeuvre| manoeuvre.avoids == Some(aircraft));
        let of_age_m = match aircraft {
            Aircraft::Uav(_) => CLEAR_OF_OLD_S * required.growth_m_s(),
            Aircraft::Intruder(_) => 0.0,
        };
        Required { now_m: required.now_m + if is_avoided { CLEAR_M + of_age_m } else { 0.0 }, ..required }
    }

    /// True if another aircraft can come nearer than the required distance within the prediction horizon.
    pub(crate) fn is_within_reach(&self, reported: &UavState, age_s: f64, required: Required) -> bool {
        let (ahead_s, speed_m_s) = (required.ahead_s, reported.speed_m_s.abs());
        let reach_m =
            required.most_m() + self.fallbacks.airframe.uav.speed_max_m_s() * ahead_s + speed_m_s * (ahead_s + age_s);
        self.own.state.position.squared_distance_m2(reported.position) < reach_m * reach_m
    }

    /// Current motion of a teammate: that of its last report, extrapolated at its turn rate.
    pub(crate) fn now(&self, other: &OtherAircraft) -> Motion {
        let (age_s, uav) = (other.age_s.min(SILENT_MAX_S), &self.fallbacks.airframe.uav);
        let state = other.motion.state.extrapolated(age_s);
        let command = other.manoeuvre.map(|manoeuvre| manoeuvre.command);
        match age_s > 0.0 {
            true => Motion::turning(uav, &state, command).in_wind(Some(self.own.wind)),
            false => other.motion,
        }
    }

    /// The command of an intent, and its path.
    pub(crate) fn with_path(&self, from: &Motion, intent: Intent) -> (Command, PredictedTrajectory) {
        (intent.command, PredictedTrajectory::of(&from.state, intent, &self.fallbacks.airframe.uav, 0.0))
    }

    /// Predicted trajectory of a teammate that follows its intent, or of an aircraft without intent.
    pub(crate) fn predicted(&self, other: &OtherAircraft, intent: Option<Intent>) -> PredictedTrajectory {
        let (reported, age_s) = (&other.motion.state, other.age_s.min(SILENT_MAX_S));
        let UavState { speed_m_s, turn_rate_rad_s, .. } = *reported;
        let is_trusted =
            |intent: &Intent| (intent.command.turn_rate_rad_s - turn_rate_rad_s).abs() < TRUST_RAD_S * (1.0 + age_s);
        let reported_command =
            avoiding(other.manoeuvre).map(|manoeuvre| self.fallbacks.airframe.uav.limit(manoeuvre.command).command);
        let flown = Intent::held(reported_command.unwrap_or(Command { speed_m_s, turn_rate_rad_s }));
        let intent = match intent {
            None => flown,
            Some(intent) if reported_command.is_none() && is_trusted(&intent) => intent,
            // The teammate avoids another aircraft and will return to its orbit.
            Some(intent) => Intent { for_s: AVOIDING_S, turn_rate_after_rad_s: intent.turn_rate_after_rad_s, ..flown },
        };
        PredictedTrajectory::of(reported, intent, &self.fallbacks.airframe.uav, age_s)
    }
}

/// The manoeuvre, if it avoids an aircraft.
pub(crate) fn avoiding(manoeuvre: Option<Manoeuvre>) -> Option<Manoeuvre> {
    manoeuvre.filter(|manoeuvre| manoeuvre.avoids.is_some())
}

/// Avoidance of an aircraft, before a manoeuvre has been chosen.
pub(crate) fn avoidance(aircraft: Aircraft, predicted_distance_m: f64) -> Avoidance {
    Avoidance { aircraft, predicted_distance_m, is_left: false, is_given_up: false }
}

/// Distance beyond which another aircraft of a speed, m/s, cannot come near, m.
fn reach_m(separation: &SeparationParams, airframe: &Airframe, speed_m_s: f64) -> f64 {
    let old_m = SILENT_MAX_S * (DRIFT_M_S + DRIFT_M_S2 * (AHEAD_S + CLEAR_OF_OLD_S));
    let spare_m = BUFFER_M + CLEAR_M + old_m;
    let flown_m = airframe.uav.speed_max_m_s() * AHEAD_S + speed_m_s * (AHEAD_S + SILENT_MAX_S);
    CLIMB_CLEAR_MINIMA * separation.horizontal_min_m + spare_m + flown_m
}

/// The same for a ground speed, in a wind, m/s.
pub(crate) fn reach_over_ground_m(
    separation: &SeparationParams,
    airframe: &Airframe,
    speed_m_s: f64,
    wind_m_s: f64,
) -> f64 {
    reach_m(separation, airframe, speed_m_s + wind_m_s) + SILENT_MAX_S * wind_m_s
}

#[cfg(test)]
mod tests;
