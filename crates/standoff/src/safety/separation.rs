//! Collision avoidance: keeps the minimum distance between aircraft by small changes of the desired command.
//!
//! A UAV flies the desired command if that keeps the required distance to all other aircraft. Otherwise it flies the
//! admissible command, from a grid of turn rates and speeds, with the lowest cost: difference from the desired command,
//! then shortfall of predicted distances, then shortfall of escape manoeuvres. Predicted paths are arcs, as flown by
//! fixed-wing aircraft (P. Fiorini and Z. Shiller, *Motion Planning in Dynamic Environments Using Velocity Obstacles*,
//! International Journal of Robotics Research 17(7), 1998).
//!
//! Coordination: the UAVs near each other plan one after the other, by ascending id. Each UAV computes the plans of those
//! before it from the same reports, so that it knows their commands and none undoes the manoeuvre of another.
//! [Path manoeuvres](crate::safety::fallback) keep them separable whatever they do next, and respect the geofence.

use crate::coordination::teammate::Teammate;
use crate::message::Manoeuvre;
use crate::params::{SeparationParams, UavParams};
use crate::safety::candidates::candidates;
use crate::safety::fallback::{FallbackModel, Path, Plan, Sense, choose_senses};
use crate::safety::motion::{Airframe, Flown, Motion};
use crate::safety::predicted_trajectory::{Intent, PredictedTrajectory, SampledTrajectory, least_length};
use crate::safety::pursuer;
use crate::safety::zones::{GeofenceSafety, Of};
use crate::time::{Duration, Time};
use crate::uav::{Aircraft, Command, UavId, UavState, Vertical};
use crate::wind::Wind;

/// Buffer added to the minimum distance to cover errors of the predicted paths of teammates, m.
const BUFFER_M: f64 = 12.0;
/// The same for intruders.
const INTRUDER_BUFFER_M: f64 = 25.0;
/// Buffer added to the minimum distance of escape manoeuvres, whose prediction is exact, m.
const ESCAPE_BUFFER_M: f64 = 2.0;

/// Prediction horizon for teammates, s.
const AHEAD_S: f64 = 8.0;

/// Growth of the position uncertainty of another aircraft per second since its last report, m/s.
const DRIFT_M_S: f64 = 10.0;
/// Growth of the required distance per second of prediction and second of report age, m/s2.
const DRIFT_M_S2: f64 = 6.0;
/// Maximum age of a report used for the uncertainty, s. Older reports count as this old.
const SILENT_MAX_S: f64 = 10.0;

/// Maximum number of UAVs that are planned together: the nearest ones.
const PLANNED_MAX: usize = 10;

/// Additional distance for the aircraft that a UAV already avoids, m.
const CLEAR_M: f64 = 4.0;

/// The same for each second of age of its report and each m/s2 of drift, s: with old reports, two UAVs that end their
/// manoeuvres as mirror images of each other would meet again.
const CLEAR_OF_OLD_S: f64 = 2.0;

/// Cost of a turn to the other side. A UAV that turns to and fro would not get clear.
const REVERSAL_COST: f64 = 0.5;
/// Cost of a turn rate that differs from the last one by the maximum turn rate, per second of age of the report of the
/// avoided teammate, 1/s. That teammate has an old report of this UAV, too: if both changed their turns at every time
/// step, each would avoid a turn that the other no longer flies.
const CHANGE_COST_1_S: f64 = 10.0;
/// Slowest turn that counts for a reversal, rad/s.
const REVERSAL_RAD_S: f64 = 0.02;

/// Cost of falling short of the required distance, per fraction of that distance.
const SHORTFALL_COST: f64 = 100.0;
/// Cost of escape manoeuvres that fall short, and per fraction of their required distance. Above all other costs: as
/// long as no escape manoeuvre falls short, the UAVs can keep the minimum distance whatever they do next.
const ESCAPE_SHORTFALL_COST: f64 = 1000.0;

/// Shortfall of an escape manoeuvre that the geofence forbids; larger than any other.
const IMPOSSIBLE: f64 = 10.0;

/// Prediction horizon for intruders, s. Both straight flight and pursuit of the UAV are predicted.
const INTRUDER_AHEAD_S: f64 = 12.0;
/// Durations of a turn followed by straight flight that are tried to avoid an intruder, s.
const TURNS_S: [f64; 4] = [2.0, 4.0, 7.0, 10.0];

/// Another aircraft, as last reported.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct OtherAircraft {
    pub(crate) aircraft: Aircraft,
    /// Motion at its last report, moved to where the wind has carried it since.
    pub(crate) motion: Motion,
    /// Age of the report, s.
    pub(crate) age_s: f64,
    /// Reported manoeuvre.
    pub(crate) manoeuvre: Option<Manoeuvre>,
}

impl OtherAircraft {
    /// A teammate. Its heading rate in wind and its commanded bank angle follow from its motion at an earlier report, if
    /// known.
    pub(crate) fn teammate(
        teammate: &Teammate,
        age_s: f64,
        wind: Option<Wind>,
        uav: &UavParams,
        before: Option<&Flown>,
    ) -> Self {
        let Teammate { last_report: state, last_report_at, manoeuvre, .. } = *teammate;
        let reported =
            Self { aircraft: Aircraft::Uav(teammate.uav), motion: Motion::steady(uav, &state), age_s, manoeuvre };
        if let Some(before) = before.filter(|before| before.from == last_report_at) {
            return Self { motion: before.motion.in_wind(wind), ..reported }.drifted();
        }
        let before = before.filter(|before| before.age_s(last_report_at).is_some());
        let command = manoeuvre.map(|manoeuvre| manoeuvre.command);
        let Some(before) = before else {
            let reported = wind.map_or(reported, |wind| reported.in_air(wind, uav));
            let motion = Motion::turning(uav, &reported.motion.state, command).in_wind(wind);
            return Self { motion, ..reported };
        };
        let acceleration_m_s2 = |airspeed_m_s| before.acceleration_m_s2(last_report_at, airspeed_m_s);
        let air = wind.map_or(state, |wind| wind.relative_to_air(&state, acceleration_m_s2));
        let flown = Flown { command: command.unwrap_or(before.command), ..*before };
        let motion = Flown::motion(Some(&flown), uav, &air, last_report_at).in_wind(wind);
        Self { motion, ..reported }.drifted()
    }

    /// An aircraft whose state is over ground, in the air.
    pub(crate) fn in_air(self, wind: Wind, uav: &UavParams) -> Self {
        let commanded_m_s = self.manoeuvre.map(|manoeuvre| manoeuvre.command.speed_m_s);
        let acceleration_m_s2 = |airspeed_m_s: f64| {
            let [slowest_m_s2, fastest_m_s2] = uav.accelerations_m_s2(airspeed_m_s);
            commanded_m_s.map_or(0.0, |commanded_m_s| {
                ((commanded_m_s - airspeed_m_s) / uav.speed_lag_s).clamp(slowest_m_s2, fastest_m_s2)
            })
        };
        let state = wind.relative_to_air(&self.motion.state, acceleration_m_s2);
        Self { motion: self.motion.with_state(state).in_wind(Some(wind)), ..self }.drifted()
    }

    /// The aircraft where the wind has carried it since its report.
    fn drifted(mut self) -> Self {
        let drift = self.motion.wind.velocity * self.age_s.min(SILENT_MAX_S);
        self.motion.state.position = self.motion.state.position + drift;
        self
    }

    /// Motion of a teammate at its report, for the next time step; `now` is the time of this one.
    pub(crate) fn as_flown(&self, now: Time) -> Option<(UavId, Flown)> {
        let Aircraft::Uav(uav) = self.aircraft else { return None };
        let UavState { position, speed_m_s, turn_rate_rad_s, .. } = self.motion.state;
        let drift = self.motion.wind.velocity * -self.age_s.min(SILENT_MAX_S);
        let motion = self.motion.with_state(UavState { position: position + drift, ..self.motion.state });
        let command = self.manoeuvre.map_or(Command { speed_m_s, turn_rate_rad_s }, |manoeuvre| manoeuvre.command);
        Some((uav, Flown { from: now + Duration::from_s(-self.age_s), motion, command, plan: None }))
    }

    /// Lowest and highest altitude within the prediction horizon, m; `None` if unknown.
    fn levels_m(&self) -> Option<[f64; 2]> {
        self.motion.state.vertical.map(|vertical| altitudes_m(vertical, vertical.altitude_m, AHEAD_S + self.age_s))
    }
}

research_fields! {
    /// An aircraft that a UAV avoids.
    #[derive(Debug, Clone, Copy, PartialEq)]
    pub struct Avoidance {
        /// The avoided aircraft; without the avoidance, the UAV would have come too near to it.
        pub aircraft: Aircraft,
        /// Predicted minimum distance to it without the avoidance, m.
        pub predicted_distance_m: f64,
        /// True if the UAV turns to the left if the conflict remains, false if to the right.
        pub(crate) is_left: bool,
        /// True if the UAV gives up the minimum separation for now: no command keeps it within the limits and the
        /// geofence. The UAV flies the one that opens the distance most.
        pub(crate) is_given_up: bool,
    }
}

/// Maximum difference between the reported turn rate of a teammate and the one expected from its group's orbit, rad/s.
/// It grows by this amount per second since the report. A teammate beyond it is assumed to fly an avoidance manoeuvre.
const TRUST_RAD_S: f64 = 0.15;
/// Assumed remaining duration of a teammate's avoidance manoeuvre, s.
const AVOIDING_S: f64 = 1.0;

/// Collision avoidance of one UAV. All states and commands are in one frame: that of the air, which a steady wind moves
/// together with all aircraft, or with a geofence that of the ground.
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

/// A UAV whose command is planned together with those of its neighbours.
#[derive(Debug, Clone, Copy)]
struct Planned {
    uav: UavId,
    /// Current motion, extrapolated from the last report.
    motion: Motion,
    /// Age of the last report, s.
    age_s: f64,
    levels_m: Option<[f64; 2]>,
    course: PredictedTrajectory,
    manoeuvre: Option<Manoeuvre>,
}

/// Another aircraft that may come near.
#[derive(Debug, Clone, Copy)]
struct Near {
    aircraft: Aircraft,
    course: SampledTrajectory,
    /// Current state of an aircraft that may pursue the UAV.
    pursuer: Option<UavState>,
    required: Required,
}

/// Distance that must be kept from another aircraft.
#[derive(Debug, Clone, Copy)]
struct Required {
    /// Prediction horizon, s.
    ahead_s: f64,
    /// Distance required now, m.
    now_m: f64,
    /// Age of the report, s.
    age_s: f64,
}

impl Required {
    /// Growth of the distance per second of prediction, m/s.
    fn growth_m_s(&self) -> f64 {
        DRIFT_M_S2 * self.age_s
    }

    /// Largest distance required within the horizon, m.
    fn most_m(&self) -> f64 {
        self.now_m + self.growth_m_s() * self.ahead_s
    }
}

/// Paths of other UAVs that the escape manoeuvres of a UAV must not come near.
struct Neighbours<'a> {
    near: &'a [Near],
    escapes: Vec<(UavId, Path, f64)>,
}

impl CollisionAvoidance<'_> {
    /// Returns the command to fly instead of the intended one, and the aircraft that it avoids, if any. The intended
    /// command must be within the limits. `altitude_m` is the commanded altitude.
    pub(crate) fn avoid(
        &self,
        intent: Intent,
        altitude_m: Option<f64>,
        others: impl Iterator<Item = OtherAircraft> + Clone,
        team: &impl DesiredCommands,
    ) -> (Command, Option<Avoidance>) {
        let levels = self.levels_m(altitude_m);
        let others = others.filter(|other| !self.is_separated(levels, other.levels_m()));
        let desired = intent.command;
        let course = PredictedTrajectory::of(&self.own.state, intent, &self.fallbacks.airframe.uav, 0.0);
        let is_teammate = |other: &OtherAircraft| matches!(other.aircraft, Aircraft::Uav(_));
        let meets = |other: &OtherAircraft| is_teammate(other) && self.can_meet(&other.motion.state, other.age_s);
        if !others.clone().any(|other| meets(&other)) {
            let near = others.clone().filter_map(|other| self.near(&other, Some(&course), |uav| team.intent_of(uav)));
            let near: Vec<Near> = near.collect();
            if near.is_empty() || self.shortfall(&course.sampled(), &near, f64::INFINITY).1.is_none() {
                return (desired, None);
            }
        }
        self.plan(desired, course, others, team)
    }

    /// True if the escape manoeuvres of this UAV and another one may meet.
    fn can_meet(&self, other: &UavState, age_s: f64) -> bool {
        let speeds_m_s = self.own.state.speed_m_s.abs() + other.speed_m_s.abs();
        // A geofence may leave only one turn to both, so that their circles meet although they fly apart.
        let circles_m = match self.geofence {
            Some(_) => [self.own.state, *other].map(|state| self.fallbacks.circle_m(&self.own.with_state(state))),
            None => [0.0; 2],
        };
        let reach_m = self.separation.horizontal_min_m
            + ESCAPE_BUFFER_M
            + speeds_m_s * self.fallbacks.turning_s
            + 2.0 * (circles_m[0] + circles_m[1])
            + (other.speed_m_s.abs() + DRIFT_M_S) * age_s;
        self.own.state.position.squared_distance_m2(other.position) < reach_m * reach_m
    }

    /// Plans the commands of this UAV and its neighbours one after the other, by ascending id: each takes the commands
    /// of those before it as known. All UAVs compute the same plan from the same reports. Returns the command of this
    /// UAV.
    #[cold]
    fn plan(
        &self,
        desired: Command,
        course: PredictedTrajectory,
        others: impl Iterator<Item = OtherAircraft> + Clone,
        team: &impl DesiredCommands,
    ) -> (Command, Option<Avoidance>) {
        let intruders: Vec<OtherAircraft> =
            others.clone().filter(|other| matches!(other.aircraft, Aircraft::Intruder(_))).collect();
        let (aircraft, manoeuvre) = (Aircraft::Uav(self.id), self.manoeuvre);
        let own = OtherAircraft { aircraft, motion: *self.own, age_s: 0.0, manoeuvre };
        let current = |other: OtherAircraft| match other.aircraft {
            Aircraft::Uav(uav) => {
                let age_s = other.age_s.min(SILENT_MAX_S);
                Some((uav, other, age_s, other.motion.state.extrapolated(age_s)))
            }
            Aircraft::Intruder(_) => None,
        };
        let mut nearest: Vec<_> = others.chain([own]).filter_map(current).collect();
        if nearest.len() >= PLANNED_MAX {
            let far_m2 = |state: &UavState| state.position.squared_distance_m2(self.own.state.position);
            nearest.sort_by(|a, b| far_m2(&a.3).total_cmp(&far_m2(&b.3)));
            nearest.truncate(PLANNED_MAX);
        }
        let plan = |(uav, other, age_s, state): (UavId, OtherAircraft, f64, UavState)| {
            let course = self.predicted(&other, team.intent_of(uav));
            let command = other.manoeuvre.map(|manoeuvre| manoeuvre.command);
            let motion = match age_s > 0.0 {
                true => Motion::turning(&self.fallbacks.airframe.uav, &state, command).in_wind(Some(self.own.wind)),
                false => other.motion,
            };
            Planned { uav, motion, age_s, levels_m: other.levels_m(), course, manoeuvre: other.manoeuvre }
        };
        let mut planned: Vec<Planned> = nearest.into_iter().map(plan).collect();
        // UAVs that avoid an intruder have right of way.
        planned.sort_by_key(|planned| {
            let avoids = planned.manoeuvre.and_then(|manoeuvre| manoeuvre.avoids);
            (matches!(avoids, Some(Aircraft::Intruder(_))), planned.uav)
        });
        let Self { separation, fallbacks, geofence, .. } = *self;
        let of = |index: usize| {
            let Planned { uav: id, motion: ref own, manoeuvre, .. } = planned[index];
            CollisionAvoidance {
                separation,
                fallbacks,
                geofence,
                id,
                own,
                manoeuvre,
                plan: self.plan.filter(|_| id == self.id),
            }
        };
        let age_s = |i: usize, j: usize| planned[i].age_s + planned[j].age_s;
        let required_m = |i: usize, j: usize| {
            let minimum_m = self.separation.horizontal_min_m + ESCAPE_BUFFER_M + self.fallbacks.error_m;
            minimum_m + DRIFT_M_S * age_s(i, j)
        };
        let can_meet = |i: usize, j: usize| {
            i != j
                && of(i).can_meet(&planned[j].motion.state, age_s(i, j))
                && !self.is_separated(planned[i].levels_m, planned[j].levels_m)
        };
        let meets: Vec<Vec<usize>> = (0..planned.len())
            .map(|index| (0..planned.len()).filter(|other| can_meet(index, *other)).collect())
            .collect();
        // The escape manoeuvres of the others are not compared with any.
        let is_met: Vec<bool> = (0..planned.len())
            .map(|index| !meets[index].is_empty() || meets.iter().any(|met| met.contains(&index)))
            .collect();
        let turns = |uav: UavId, motion: &Motion, command| {
            self.geofence.map_or([true; 2], |geofence| {
                geofence.safe_turns(motion, command, if uav == self.id { Of::Choice } else { Of::Flown })
            })
        };
        let commands: Vec<(Command, PredictedTrajectory)> = planned
            .iter()
            .map(|planned| {
                if planned.uav == self.id {
                    return (desired, course);
                }
                let intent = team.desired(planned.uav, &planned.motion);
                (
                    intent.command,
                    PredictedTrajectory::of(&planned.motion.state, intent, &self.fallbacks.airframe.uav, 0.0),
                )
            })
            .collect();
        let preferred: Vec<Sense> = planned
            .iter()
            .map(|planned| {
                let turns_left = planned.motion.state.turn_rate_rad_s >= 0.0;
                Sense::of(avoiding(planned.manoeuvre).map_or(turns_left, |manoeuvre| manoeuvre.is_left))
            })
            .collect();
        // Path manoeuvres of all, after their desired commands or, if these fall short together, from now on.
        let escapes_after = |command_of: &dyn Fn(usize, Sense) -> Command, is_now: bool| {
            let path_of = |index: usize, side| {
                is_met[index].then(|| self.fallbacks.path(&planned[index].motion, command_of(index, side), side))
            };
            let is_possible: Vec<[bool; 2]> = (0..planned.len())
                .map(|index| {
                    let motion = &planned[index].motion;
                    let after = |side: Sense| turns(planned[index].uav, motion, command_of(index, side))[side as usize];
                    let possible = Sense::BOTH.map(after);
                    if is_now && possible == [false; 2] { of(index).last_turn(motion) } else { possible }
                })
                .collect();
            let paths: Vec<[Option<Path>; 2]> =
                (0..planned.len()).map(|index| Sense::BOTH.map(|side| path_of(index, side))).collect();
            let (short, sides) = choose_senses(&preferred, |i, s, j, t| {
                if !is_possible[i][s as usize] {
                    return IMPOSSIBLE;
                }
                match (&paths[i][s as usize], &paths[j][t as usize]) {
                    (Some(a), Some(b)) if is_possible[j][t as usize] && meets[i].contains(&j) => {
                        self.fallbacks.shortfall(a, b, required_m(i, j), self.own.wind)
                    }
                    _ => 0.0,
                }
            });
            let chosen = sides.iter().enumerate().map(|(index, side)| paths[index][*side as usize].clone());
            (short, chosen.collect::<Vec<Option<Path>>>())
        };
        let (short, mut escapes) = escapes_after(&|index, _| commands[index].0, false);
        if short > 0.0 {
            escapes = escapes_after(&|index, side| self.fallbacks.command(&planned[index].motion, side, None), true).1;
        }
        let mut courses: Vec<SampledTrajectory> = planned.iter().map(|planned| planned.course.sampled()).collect();
        for index in 0..planned.len() {
            let uav = of(index);
            let (command, course) = commands[index];
            let teammate = |other: usize, course: SampledTrajectory| {
                let Planned { uav: teammate, motion: Motion { ref state, .. }, levels_m, .. } = planned[other];
                let required = uav.required(AHEAD_S, BUFFER_M, age_s(index, other));
                let is_near =
                    uav.is_within_reach(state, 0.0, required) && !self.is_separated(planned[index].levels_m, levels_m);
                let aircraft = Aircraft::Uav(teammate);
                let required = uav.kept(aircraft, required);
                is_near.then_some(Near { aircraft, course, pursuer: None, required })
            };
            let teammates = (0..planned.len()).filter(|other| *other != index);
            let teammates = teammates.filter_map(|other| teammate(other, courses[other]));
            // A teammate whose last report is old may have planned from others, and fly on as reported.
            let as_reported = (0..index).filter(|other| age_s(index, *other) > 0.0);
            let as_reported = as_reported.filter_map(|other| teammate(other, planned[other].course.sampled()));
            let intruders = intruders.iter().filter_map(|other| uav.near(other, None, |_| None));
            let near: Vec<Near> = teammates.chain(as_reported).chain(intruders).collect();
            let met = meets[index].iter();
            let met = met
                .filter_map(|other| Some((planned[*other].uav, escapes[*other].clone()?, required_m(index, *other))));
            let neighbours = Neighbours { near: &near, escapes: met.collect() };
            let (flown, side, avoidance) = uav.nearest_command((command, course), &neighbours, turns);
            if uav.id == self.id {
                return (flown, avoidance);
            }
            let course = if flown == command { course } else { course.with(Intent::held(flown)) };
            courses[index] = course.sampled();
            if !meets[index].is_empty() {
                escapes[index] = Some(self.fallbacks.path(uav.own, flown, side));
            }
        }
        (desired, None)
    }

    /// Returns the altitude to command on the way to a desired altitude, m. The UAV does not climb or descend past a
    /// nearby aircraft that is separated from it by altitude only.
    pub(crate) fn altitude_m(&self, desired_m: f64, others: impl Iterator<Item = OtherAircraft>) -> f64 {
        let Some(own) = self.own.state.vertical else { return desired_m };
        // Altitudes between these two are clear of all nearby aircraft.
        let [mut low_m, mut high_m] = [f64::NEG_INFINITY, f64::INFINITY];
        for other in others {
            let Some((vertical, [other_low_m, other_high_m])) = other.motion.state.vertical.zip(other.levels_m())
            else {
                continue;
            };
            let clear_m = CLIMB_CLEAR_MINIMA * self.separation.horizontal_min_m
                + 2.0 * self.fallbacks.airframe.uav.speed_max_m_s() * other.age_s;
            let is_clear = self.own.state.position.squared_distance_m2(other.motion.state.position) > clear_m * clear_m;
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
        let own = self.own.state.vertical?;
        Some(altitudes_m(own, altitude_m.unwrap_or(own.altitude_m), 2.0))
    }

    /// Returns true if both are separated by altitude for the whole prediction horizon.
    fn is_separated(&self, levels: Option<[f64; 2]>, other_levels: Option<[f64; 2]>) -> bool {
        levels.zip(other_levels).is_some_and(|([low_m, high_m], [other_low_m, other_high_m])| {
            other_low_m - high_m >= self.separation.vertical_min_m
                || low_m - other_high_m >= self.separation.vertical_min_m
        })
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
    fn near(
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
    fn required(&self, ahead_s: f64, buffer_m: f64, age_s: f64) -> Required {
        let now_m = self.separation.horizontal_min_m + buffer_m + DRIFT_M_S * age_s;
        Required { ahead_s, now_m, age_s }
    }

    /// A required distance, larger for the aircraft that the UAV already avoids: a manoeuvre ends only when clear.
    fn kept(&self, aircraft: Aircraft, required: Required) -> Required {
        let is_avoided = self.manoeuvre.is_some_and(|manoeuvre| manoeuvre.avoids == Some(aircraft));
        let of_age_m = match aircraft {
            Aircraft::Uav(_) => CLEAR_OF_OLD_S * required.growth_m_s(),
            Aircraft::Intruder(_) => 0.0,
        };
        Required { now_m: required.now_m + if is_avoided { CLEAR_M + of_age_m } else { 0.0 }, ..required }
    }

    /// True if another aircraft can come nearer than the required distance within the prediction horizon.
    fn is_within_reach(&self, reported: &UavState, age_s: f64, required: Required) -> bool {
        let (ahead_s, speed_m_s) = (required.ahead_s, reported.speed_m_s.abs());
        let reach_m =
            required.most_m() + self.fallbacks.airframe.uav.speed_max_m_s() * ahead_s + speed_m_s * (ahead_s + age_s);
        self.own.state.position.squared_distance_m2(reported.position) < reach_m * reach_m
    }

    /// Predicted trajectory of a teammate that follows its intent, or of an aircraft without intent.
    fn predicted(&self, other: &OtherAircraft, intent: Option<Intent>) -> PredictedTrajectory {
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

    /// Returns the admissible command with the lowest cost, the side of its escape manoeuvre, and the aircraft that the
    /// desired command would come near; the desired command if no other is admissible.
    fn nearest_command(
        &self,
        (desired, course): (Command, PredictedTrajectory),
        neighbours: &Neighbours,
        turns: impl Fn(UavId, &Motion, Command) -> [bool; 2],
    ) -> (Command, Sense, Option<Avoidance>) {
        let near = neighbours.near;
        let (short, soft_avoidance) = self.shortfall(&course.sampled(), near, f64::INFINITY);
        let possible = turns(self.id, self.own, desired);
        let is_allowed = possible != [false; 2];
        let sides = if is_allowed { possible } else { self.last_turn(self.own) };
        let (escape_short, side, escape_avoidance) =
            self.escape_shortfall(desired, &neighbours.escapes, f64::INFINITY, sides);
        if short <= 0.0 && escape_short <= 0.0 && is_allowed {
            return (desired, side, None);
        }
        let mut best = (f64::INFINITY, desired, side, escape_short);
        let turns_s = if near.iter().any(|other| other.pursuer.is_some()) { &TURNS_S[..] } else { &[] };
        let flown_rad_s = avoiding(self.manoeuvre)
            .map_or(self.own.state.turn_rate_rad_s, |manoeuvre| manoeuvre.command.turn_rate_rad_s);
        let conflict = soft_avoidance.or(escape_avoidance).map(|avoidance| avoidance.aircraft);
        let teammate = near.iter().find(|other| Some(other.aircraft) == conflict && other.pursuer.is_none());
        let age_s = teammate.map_or(0.0, |other| other.required.age_s);
        let change_cost_s = CHANGE_COST_1_S * age_s / self.fallbacks.airframe.uav.turn_rate_max_rad_s;
        for (effort, command) in candidates(self.fallbacks, self.own, desired) {
            // All further commands cost more, too.
            if effort >= best.0 {
                break;
            }
            let is_reversal = flown_rad_s * command.turn_rate_rad_s < 0.0
                && flown_rad_s.abs().min(command.turn_rate_rad_s.abs()) > REVERSAL_RAD_S;
            let effort = effort
                + if is_reversal { REVERSAL_COST } else { 0.0 }
                + change_cost_s * (command.turn_rate_rad_s - flown_rad_s).abs();
            // A command with a larger shortfall costs more than the best one.
            let short_max = (best.0 - effort) / SHORTFALL_COST;
            if short_max <= 0.0 {
                continue;
            }
            let held = Intent::held(command);
            let mut short = self.shortfall(&course.with(held).sampled(), near, short_max).0;
            for for_s in turns_s {
                if short > 0.0 {
                    let turn = Intent { for_s: *for_s, turn_rate_after_rad_s: 0.0, ..held };
                    short = short.min(self.shortfall(&course.with(turn).sampled(), near, short_max).0);
                }
            }
            if short >= short_max {
                continue;
            }
            let cost = effort + SHORTFALL_COST * short;
            let escape_short_max = ((best.0 - cost) / ESCAPE_SHORTFALL_COST - 1.0).max(f64::MIN_POSITIVE);
            let shortfall_of = |sides| self.escape_shortfall(command, &neighbours.escapes, escape_short_max, sides);
            // Without the geofence first, because its turns take longer to compute.
            let mut escape = shortfall_of([true; 2]);
            if escape.0 >= escape_short_max {
                continue;
            }
            let possible = turns(self.id, self.own, command);
            if possible == [false; 2] {
                continue;
            }
            if possible != [true; 2] {
                escape = shortfall_of(possible);
            }
            let (escape_short, side, _) = escape;
            let falls_short = if escape_short > 0.0 { ESCAPE_SHORTFALL_COST * (1.0 + escape_short) } else { 0.0 };
            if cost + falls_short < best.0 {
                best = (cost + falls_short, command, side, escape_short);
            }
        }
        let (_, command, side, escape_short) = best;
        let is_given_up = escape_short > 0.0;
        let avoidance =
            if is_given_up { escape_avoidance.or(soft_avoidance) } else { soft_avoidance.or(escape_avoidance) };
        let avoidance = avoidance.map(|avoidance| Avoidance { is_left: side == Sense::Left, is_given_up, ..avoidance });
        (command, side, avoidance)
    }

    /// Path manoeuvre, to the left or to the right, of a UAV without one that the geofence allows.
    fn last_turn(&self, motion: &Motion) -> [bool; 2] {
        self.geofence.map_or([true; 2], |geofence| geofence.last_turn(motion, self.plan.as_ref()))
    }

    /// Smallest shortfall of the escape manoeuvres after a command, the side of that manoeuvre, and the aircraft that
    /// comes nearest. The search may stop once the shortfall reaches `short_max`.
    fn escape_shortfall(
        &self,
        command: Command,
        others: &[(UavId, Path, f64)],
        short_max: f64,
        possible: [bool; 2],
    ) -> (f64, Sense, Option<Avoidance>) {
        let first = Sense::of(command.turn_rate_rad_s >= 0.0);
        if others.is_empty() {
            return (0.0, first, None);
        }
        let mut best = (f64::INFINITY, first, None);
        for side in first.with_other().into_iter().filter(|side| possible[*side as usize]) {
            let path = self.fallbacks.path(self.own, command, side);
            let mut worst = (0.0, side, None);
            for (uav, escape, required_m) in others {
                let short = self.fallbacks.shortfall(&path, escape, *required_m, self.own.wind);
                if short > worst.0 {
                    let predicted_distance_m = required_m * (1.0 - short).max(0.0);
                    worst = (short, side, Some(avoidance(Aircraft::Uav(*uav), predicted_distance_m)));
                }
                if short >= best.0.min(short_max) {
                    break;
                }
            }
            if worst.0 < best.0 {
                best = worst;
            }
            if best.0 <= 0.0 {
                break;
            }
        }
        best
    }

    /// Shortfall of the distance to other aircraft, as a fraction of the required distance: the largest plus the mean;
    /// and the aircraft concerned. The search stops once the shortfall reaches `short_max`.
    fn shortfall(&self, course: &SampledTrajectory, near: &[Near], short_max: f64) -> (f64, Option<Avoidance>) {
        let mut worst = (0.0, None);
        for other in near {
            let Required { ahead_s, now_m: required_m, .. } = other.required;
            let growth_m_s = other.required.growth_m_s();
            let (mut spare_m, mut predicted_distance_m) = (f64::INFINITY, f64::INFINITY);
            let (mut sum, mut steps) = (0.0, 0.0);
            for (after_s, step) in course.relative(&other.course, ahead_s) {
                let distance_m = least_length(step);
                let left_m = distance_m - growth_m_s * after_s;
                (spare_m, predicted_distance_m) = (spare_m.min(left_m), predicted_distance_m.min(distance_m));
                (sum, steps) = (sum + (required_m - left_m).max(0.0), steps + 1.0);
            }
            if let Some(pursuer) = &other.pursuer {
                let turn_max_rad_s = self.fallbacks.airframe.uav.turn_rate_max_rad_s;
                let closest_m =
                    pursuer::closest_m(pursuer, turn_max_rad_s, ahead_s, growth_m_s, |at_s| course.at(at_s));
                (spare_m, predicted_distance_m) = (spare_m.min(closest_m), predicted_distance_m.min(closest_m));
            }
            let short = (required_m - spare_m + sum / steps) / required_m;
            if short > worst.0 {
                worst = (short, Some(avoidance(other.aircraft, predicted_distance_m)));
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

/// The manoeuvre, if it avoids an aircraft.
fn avoiding(manoeuvre: Option<Manoeuvre>) -> Option<Manoeuvre> {
    manoeuvre.filter(|manoeuvre| manoeuvre.avoids.is_some())
}

/// Avoidance of an aircraft, before a manoeuvre has been chosen.
fn avoidance(aircraft: Aircraft, predicted_distance_m: f64) -> Avoidance {
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

/// Lowest and highest altitude of a UAV on its way to `to_m`, m. Includes `after_s` seconds at the current climb rate.
fn altitudes_m(from: Vertical, to_m: f64, after_s: f64) -> [f64; 2] {
    let ends_m = [to_m, from.altitude_m + from.climb_rate_m_s * after_s];
    [ends_m.into_iter().fold(from.altitude_m, f64::min), ends_m.into_iter().fold(from.altitude_m, f64::max)]
}

#[cfg(test)]
mod tests;
