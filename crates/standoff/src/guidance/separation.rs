//! UAVs kept apart from one another, by small changes of what they would fly.
//!
//! Each UAV foretells where a command would take it and where the others go on to, and flies what was wanted of it while
//! that keeps everybody far enough away. Where it does not, it flies the command nearest to what was wanted that does: of
//! turn rates and speeds within the limits, the same for any number of others at once. That is the idea of velocity
//! obstacles (P. Fiorini and Z. Shiller, *Motion Planning in Dynamic Environments Using Velocity Obstacles*, International
//! Journal of Robotics Research 17(7), 1998), with arcs instead of straight lines, which is what a fixed wing flies.
//!
//! Reciprocal, by right of way: the one of lower id looks far ahead and gives way early; the one of higher id goes on, and
//! turns away itself only if that comes to nothing. Two that both gave way early would go on doing so, side by side.

use crate::guidance::alternatives::Costs;
use crate::guidance::course::{Course, Intent};
use crate::guidance::heading::Steering;
use crate::guidance::pursuit;
use crate::param::{Allowed, ParamError};
use crate::uav::{Aircraft, Command, UavId, UavParams, UavState, Vertical};

/// How far apart UAVs are kept: they may be nearer than one of the two, never than both.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeparationParams {
    /// Least horizontal distance of two UAVs, m; 1 to 10,000.
    pub minimum_m: f64,
    /// Least difference of their altitudes, m; 1 to 10,000.
    pub vertical_m: f64,
}

impl Default for SeparationParams {
    fn default() -> Self {
        Self { minimum_m: 50.0, vertical_m: 30.0 }
    }
}

impl SeparationParams {
    /// Every parameter that is out of range.
    pub fn errors(&self) -> Vec<ParamError> {
        let mut errors = Vec::new();
        let metres = Allowed::at_least(1.0).at_most(1e4);
        metres.check("minimum_m", self.minimum_m, &mut errors);
        metres.check("vertical_m", self.vertical_m, &mut errors);
        errors
    }
}

/// A UAV does not fly what is foretold to bring it nearer than the least distance and this, m, if it can help it: what is
/// foretold is not what comes.
const SPARE_M: f64 = 20.0;

/// So far ahead looks who gives way, s.
const AHEAD_S: f64 = 8.0;

/// So far looks who goes on, s, and so much nearer it lets the other come before it turns away as well, m.
const SHORT_AHEAD_S: f64 = 3.0;
const LESS_M: f64 = 15.0;

/// Where another one is, is not known so well for each second since it said so, m/s; and how that grows, for each second
/// foretold, m/s2; nobody has been silent for longer than the last, s, and counts.
const DRIFT_M_S: f64 = 10.0;
const DRIFT_M_S2: f64 = 6.0;
const SILENT_MAX_S: f64 = 10.0;

/// The later the other one is heard of, the less it helps if both act: who goes on spares it so much less for each second, m/s,
/// down to this, m.
const RELUCTANCE_M_S: f64 = 25.0;
const SPARE_MIN_M: f64 = -10.0;

/// What it costs to fly something else; and the part of the wanted distance by which a command falls short.
const COSTS: Costs = Costs { speed: 0.1, turn: 0.2 };
const SHORTFALL_COST: f64 = 100.0;

/// So far ahead it is foretold of who is not of the team that it flies on, and that it turns at the UAV, s.
const INTRUDER_AHEAD_S: f64 = 12.0;
/// For so long a UAV may turn, before it flies straight on, on the way out of an intruder's way, s.
const TURNS_S: [f64; 4] = [2.0, 4.0, 7.0, 10.0];

/// Another aircraft, as it last said.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Other {
    pub(crate) aircraft: Aircraft,
    pub(crate) said: UavState,
    /// How long ago, s.
    pub(crate) age_s: f64,
}

impl Other {
    /// The altitudes between which it is for as long as is looked ahead, m; `None`: nobody knows.
    fn levels_m(&self) -> Option<[f64; 2]> {
        self.said.vertical.map(|its| reach_m(its, its.altitude_m, AHEAD_S + self.age_s))
    }
}

/// Whom a UAV avoids.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Avoidance {
    /// The aircraft to which it would have come nearest.
    pub from: Aircraft,
    /// How near, m, by what it foretold.
    pub foretold_m: f64,
}

/// Who turns otherwise than its group's orbit wants by more than this, rad/s, and so much more for each second since it said
/// so, flies something else, and does so for a moment yet, s.
const TRUST_RAD_S: f64 = 0.15;
const AVOIDING_S: f64 = 1.0;

/// A UAV that keeps apart from others.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Keeper<'a> {
    pub(crate) separation: &'a SeparationParams,
    pub(crate) uav: &'a UavParams,
    pub(crate) id: UavId,
    pub(crate) own: &'a UavState,
}

/// Another aircraft that may come near.
#[derive(Debug, Clone, Copy)]
struct Near {
    aircraft: Aircraft,
    course: Course,
    /// Where it is now, if it may turn at the UAV.
    pursuer: Option<UavState>,
    /// For so long what is foretold counts, s.
    ahead_s: f64,
    /// How far away it is kept where that is possible, m, and how much further for each second foretold, m/s.
    wanted_m: f64,
    growth_m_s: f64,
}

impl Keeper<'_> {
    /// What to fly in the place of what is wanted, which is inside the limits, and whom that avoids, if anybody.
    ///
    /// `altitude_m` is what it is to climb to, `intent_of` what another one is about to fly if it does as its group needs,
    /// `is_allowed` tells what may be flown at all.
    pub(crate) fn keep_apart(
        &self,
        (wanted, steering): (Command, Option<&Steering>),
        altitude_m: Option<f64>,
        others: impl Iterator<Item = Other>,
        intent_of: impl Fn(UavId) -> Option<Intent>,
        is_allowed: impl Fn(Command) -> bool,
    ) -> (Command, Option<Avoidance>) {
        let levels = self.levels_m(altitude_m);
        let others = others.filter(|other| !self.is_apart(levels, other));
        let near: Vec<Near> = others.filter_map(|other| self.near(&other, &intent_of)).collect();
        if near.is_empty() {
            return (wanted, None);
        }
        let intent = steering.map_or(Intent::held(wanted), |steering| Intent::of(wanted, self.own.heading, steering));
        let course = Course::of(self.own, intent, self.uav.turn_rate_lag_s, 0.0);
        match self.shortfall(&course, &near, f64::INFINITY) {
            (_, None) => (wanted, None),
            (_, avoidance) => (self.nearest_command((wanted, course), &near, is_allowed), avoidance),
        }
    }

    /// The altitude to ask for on the way to a wanted one, m: not past who is near and apart by altitude alone.
    pub(crate) fn altitude_m(&self, wanted_m: f64, others: impl Iterator<Item = Other>) -> f64 {
        let Some(own) = self.own.vertical else { return wanted_m };
        // Between these it is clear of all that are near.
        let [mut low_m, mut high_m] = [f64::NEG_INFINITY, f64::INFINITY];
        for other in others {
            let Some((its, [its_low_m, its_high_m])) = other.said.vertical.zip(other.levels_m()) else { continue };
            let clear_m = CLIMB_CLEAR_MINIMA * self.separation.minimum_m + 2.0 * self.uav.speed_max_m_s() * other.age_s;
            let is_clear = self.own.position.squared_distance_m2(other.said.position) > clear_m * clear_m;
            let over_m = own.altitude_m - its.altitude_m;
            // Who is beside it already can only go on.
            if is_clear || over_m.abs() < self.separation.vertical_m {
                continue;
            }
            if over_m > 0.0 {
                low_m = low_m.max(its_high_m + self.separation.vertical_m);
            } else {
                high_m = high_m.min(its_low_m - self.separation.vertical_m);
            }
        }
        let waits_m = if wanted_m > high_m {
            (high_m - SPARE_VERTICAL_M).max(low_m)
        } else if wanted_m < low_m {
            (low_m + SPARE_VERTICAL_M).min(high_m)
        } else {
            return wanted_m;
        };
        // Between two that hold it, and where it would only go away from its altitude, it stays.
        let is_backwards = (waits_m - own.altitude_m) * (wanted_m - own.altitude_m) <= 0.0;
        if low_m > high_m || is_backwards { own.altitude_m } else { waits_m }
    }

    /// The altitudes between which it will be, m; `None`: nobody knows.
    fn levels_m(&self, altitude_m: Option<f64>) -> Option<[f64; 2]> {
        let own = self.own.vertical?;
        Some(reach_m(own, altitude_m.unwrap_or(own.altitude_m), 2.0))
    }

    /// Kept apart by altitude for as long as is looked ahead.
    fn is_apart(&self, levels: Option<[f64; 2]>, other: &Other) -> bool {
        levels.zip(other.levels_m()).is_some_and(|([low_m, high_m], [its_low_m, its_high_m])| {
            its_low_m - high_m >= self.separation.vertical_m || low_m - its_high_m >= self.separation.vertical_m
        })
    }

    /// It may come near while it is heard of; who is so far away that it cannot is left out of all else.
    #[inline]
    pub(crate) fn may_come_near(&self, other: &UavState) -> bool {
        let spare_m = SPARE_M + SILENT_MAX_S * (DRIFT_M_S + DRIFT_M_S2 * AHEAD_S);
        let flown_m = self.uav.speed_max_m_s() * AHEAD_S + other.speed_m_s.abs() * (AHEAD_S + SILENT_MAX_S);
        let far_m = CLIMB_CLEAR_MINIMA * self.separation.minimum_m + spare_m + flown_m;
        self.own.position.squared_distance_m2(other.position) < far_m * far_m
    }

    /// What is to be kept of another one, unless it is too far away to matter: of lower id, this UAV gives way.
    fn near(&self, other: &Other, intent_of: impl Fn(UavId) -> Option<Intent>) -> Option<Near> {
        let Other { aircraft, said, age_s } = other;
        let age_s = age_s.min(SILENT_MAX_S);
        let minimum_m = self.separation.minimum_m;
        let gives_way = |ahead_s| (ahead_s, minimum_m + SPARE_M + DRIFT_M_S * age_s, DRIFT_M_S2 * age_s);
        let (mate, (ahead_s, wanted_m, growth_m_s)) = match *aircraft {
            // It does nothing for it.
            Aircraft::Intruder(_) => (None, gives_way(INTRUDER_AHEAD_S)),
            Aircraft::Uav(mate) if self.id < mate => (Some(mate), gives_way(AHEAD_S)),
            Aircraft::Uav(mate) => {
                let spare_m = (SPARE_M - RELUCTANCE_M_S * age_s).max(SPARE_MIN_M);
                (Some(mate), (SHORT_AHEAD_S + age_s, minimum_m - LESS_M + spare_m, 0.0))
            }
        };
        let UavState { position, speed_m_s, turn_rate_rad_s, .. } = *said;
        let least_m = wanted_m + growth_m_s * ahead_s;
        let reach_m = least_m + self.uav.speed_max_m_s() * ahead_s + speed_m_s.abs() * (ahead_s + age_s);
        if self.own.position.squared_distance_m2(position) >= reach_m * reach_m {
            return None;
        }
        let is_trusted =
            |intent: &Intent| (intent.command.turn_rate_rad_s - turn_rate_rad_s).abs() < TRUST_RAD_S * (1.0 + age_s);
        let flown = Intent::held(Command { speed_m_s, turn_rate_rad_s });
        let intent = match mate.and_then(intent_of) {
            None => flown,
            Some(intent) if is_trusted(&intent) => intent,
            // It avoids somebody, and will be back.
            Some(intent) => Intent { for_s: AVOIDING_S, then_rad_s: intent.then_rad_s, ..flown },
        };
        let course = Course::of(said, intent, self.uav.turn_rate_lag_s, age_s);
        let pursuer = mate.is_none().then(|| said.carried_on(age_s));
        Some(Near { aircraft: *aircraft, course, pursuer, ahead_s, wanted_m, growth_m_s })
    }

    /// The command that costs least; what is wanted if nothing else may be flown.
    #[cold]
    fn nearest_command(
        &self,
        (wanted, course): (Command, Course),
        near: &[Near],
        is_allowed: impl Fn(Command) -> bool,
    ) -> Command {
        let mut best = (f64::INFINITY, wanted);
        let turns_s = if near.iter().any(|other| other.pursuer.is_some()) { &TURNS_S[..] } else { &[] };
        for (effort, command) in COSTS.alternatives(self.uav, self.own.turn_rate_rad_s, wanted) {
            // Whatever falls shorter than that costs more.
            let short_max = (best.0 - effort) / SHORTFALL_COST;
            if short_max <= 0.0 {
                break;
            }
            let held = Intent::held(command);
            let mut short = self.shortfall(&course.with(held), near, short_max).0;
            for for_s in turns_s {
                if short > 0.0 {
                    let turn = Intent { for_s: *for_s, then_rad_s: 0.0, ..held };
                    short = short.min(self.shortfall(&course.with(turn), near, short_max).0);
                }
            }
            if short < short_max && is_allowed(command) {
                best = (effort + SHORTFALL_COST * short, command);
            }
        }
        best.1
    }

    /// By which part of the wanted distance a course falls short at most, and of whom; beyond so much nobody looks any further.
    fn shortfall(&self, course: &Course, near: &[Near], short_max: f64) -> (f64, Option<Avoidance>) {
        let mut worst = (0.0, None);
        for other in near {
            let furthest_m = other.wanted_m + other.growth_m_s * other.ahead_s;
            if other.pursuer.is_none() && course.apart_m(&other.course, other.ahead_s) >= furthest_m {
                continue;
            }
            let closing_m_s = course.fastest_m_s() + other.course.fastest_m_s() + other.growth_m_s;
            let enough_m = other.wanted_m * (1.0 - short_max);
            let (mut after_s, mut spare_m, mut foretold_m) = (0.0, f64::INFINITY, f64::INFINITY);
            while after_s < other.ahead_s && spare_m >= enough_m {
                let distance_m = course.at(after_s).distance_m(other.course.at(after_s));
                let left_m = distance_m - other.growth_m_s * after_s;
                (spare_m, foretold_m) = (spare_m.min(left_m), foretold_m.min(distance_m));
                // Before that it cannot be nearer than it was, or than is wanted.
                after_s += ((left_m - other.wanted_m.min(spare_m)) / closing_m_s).max(0.25);
            }
            if let Some(pursuer) = &other.pursuer {
                let turn_max_rad_s = self.uav.turn_rate_max_rad_s;
                let closest_m = pursuit::closest_m(pursuer, turn_max_rad_s, other.ahead_s, other.growth_m_s, |at_s| {
                    course.at(at_s)
                });
                (spare_m, foretold_m) = (spare_m.min(closest_m), foretold_m.min(closest_m));
            }
            let short = (other.wanted_m - spare_m) / other.wanted_m;
            if short > worst.0 {
                worst = (short, Some(Avoidance { from: other.aircraft, foretold_m }));
            }
            if short >= short_max {
                break;
            }
        }
        worst
    }
}

/// Nobody climbs or descends past who is nearer than so many minima.
const CLIMB_CLEAR_MINIMA: f64 = 6.0;
/// So much more than the least difference of altitudes waits who may not climb or descend past another one, m.
const SPARE_VERTICAL_M: f64 = 1.0;

/// The altitudes between which a UAV is on its way to one, that is reached within so long if it goes on as now, m.
fn reach_m(from: Vertical, to_m: f64, after_s: f64) -> [f64; 2] {
    let ends_m = [to_m, from.altitude_m + from.climb_rate_m_s * after_s];
    [ends_m.into_iter().fold(from.altitude_m, f64::min), ends_m.into_iter().fold(from.altitude_m, f64::max)]
}

#[cfg(test)]
mod tests;
