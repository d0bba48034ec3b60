//! Selection: the candidate command with the lowest cost that keeps the geofence.
//!
//! Costs are, from low to high: the difference from the desired command, the shortfall of predicted distances, and the
//! shortfall of fallbacks.

use crate::safety::candidates::candidates;
use crate::safety::fallback::{Path, Paths, Sense};
use crate::safety::predicted_trajectory::{Intent, PredictedTrajectory, SampledTrajectory, least_length};
use crate::safety::pursuer;
use crate::safety::separation::{Avoidance, CollisionAvoidance, Near, Required, avoidance, avoiding};
use crate::uav::{Aircraft, Command, UavId};

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
/// Cost of fallbacks that fall short, and per fraction of their required distance. Above all other costs: as
/// long as no fallback falls short, the UAVs can keep the minimum distance whatever they do next.
const FALLBACK_SHORTFALL_COST: f64 = 1000.0;

/// Durations of a turn followed by straight flight that are tried to avoid an intruder, s.
const TURNS_S: [f64; 4] = [2.0, 4.0, 7.0, 10.0];

/// Paths of other aircraft that a UAV must not come near.
pub(crate) struct Neighbours<'a> {
    pub(crate) near: &'a [Near],
    /// Fallbacks of teammates, and the distance to keep from each, m.
    pub(crate) fallbacks: Vec<(UavId, &'a Path, f64)>,
}

/// A candidate command, and its costs.
#[derive(Debug, Clone, Copy)]
struct Choice {
    cost: f64,
    command: Command,
    sense: Sense,
    /// Shortfall of its fallback.
    fallback_short: f64,
}

/// What every candidate is compared with.
struct Search<'a> {
    avoidance: &'a CollisionAvoidance<'a>,
    neighbours: &'a Neighbours<'a>,
    course: PredictedTrajectory,
    /// Turn rate that the UAV flies, rad/s.
    flown_rad_s: f64,
    /// Cost of a change of the turn rate, s/rad.
    change_cost_s: f64,
    /// Durations of turns that are tried, s.
    turns_s: &'static [f64],
}

impl CollisionAvoidance<'_> {
    /// Returns the admissible command with the lowest cost, the sense of its fallback, and the aircraft that the desired
    /// command would come near; the desired command if no other is admissible. `turns` returns the fallbacks that the
    /// geofence allows after a command.
    pub(crate) fn nearest_command(
        &self,
        (desired, course): (Command, PredictedTrajectory),
        neighbours: &Neighbours,
        turns: impl Fn(&Paths) -> [bool; 2],
    ) -> (Command, Sense, Option<Avoidance>) {
        let near = neighbours.near;
        let (short, near_avoidance) = self.shortfall(&course.sampled(), near, f64::INFINITY);
        let paths = Paths::after(self.fallbacks, self.own, desired);
        let possible = turns(&paths);
        let is_allowed = possible != [false; 2];
        let possible = if is_allowed { possible } else { self.last_turn() };
        let (fallback_short, sense, fallback_avoidance) =
            self.fallback_shortfall(&paths, neighbours, f64::INFINITY, possible);
        if short <= 0.0 && fallback_short <= 0.0 && is_allowed {
            return (desired, sense, None);
        }
        let conflict = near_avoidance.or(fallback_avoidance).map(|avoidance| avoidance.aircraft);
        let search = self.search(course, neighbours, conflict);
        let mut best = Choice { cost: f64::INFINITY, command: desired, sense, fallback_short };
        for (effort, command) in candidates(self.fallbacks, self.own, desired) {
            // All further commands cost more, too.
            if effort >= best.cost {
                break;
            }
            best = search.cheaper((effort, command), &best, &turns).unwrap_or(best);
        }
        let is_given_up = best.fallback_short > 0.0;
        let avoidance =
            if is_given_up { fallback_avoidance.or(near_avoidance) } else { near_avoidance.or(fallback_avoidance) };
        let is_left = best.sense == Sense::Left;
        (best.command, best.sense, avoidance.map(|avoidance| Avoidance { is_left, is_given_up, ..avoidance }))
    }

    fn search<'a>(
        &'a self,
        course: PredictedTrajectory,
        neighbours: &'a Neighbours<'a>,
        conflict: Option<Aircraft>,
    ) -> Search<'a> {
        let near = neighbours.near;
        let teammate = near.iter().find(|other| Some(other.aircraft) == conflict && other.pursuer.is_none());
        let age_s = teammate.map_or(0.0, |other| other.required.age_s);
        Search {
            avoidance: self,
            neighbours,
            course,
            flown_rad_s: avoiding(self.manoeuvre)
                .map_or(self.own.state.turn_rate_rad_s, |manoeuvre| manoeuvre.command.turn_rate_rad_s),
            change_cost_s: CHANGE_COST_1_S * age_s / self.fallbacks.airframe.uav.turn_rate_max_rad_s,
            turns_s: if near.iter().any(|other| other.pursuer.is_some()) { &TURNS_S } else { &[] },
        }
    }

    /// Fallback, to the left or to the right, of a UAV without one that the geofence allows.
    pub(crate) fn last_turn(&self) -> [bool; 2] {
        self.geofence.map_or([true; 2], |geofence| geofence.last_turn(self.own, self.plan.as_ref()))
    }

    /// Smallest shortfall of the fallbacks after a command, the sense of that fallback, and the aircraft that comes
    /// nearest. The search may stop once the shortfall reaches `short_max`.
    fn fallback_shortfall(
        &self,
        paths: &Paths,
        neighbours: &Neighbours,
        short_max: f64,
        possible: [bool; 2],
    ) -> (f64, Sense, Option<Avoidance>) {
        let first = Sense::of(paths.command.turn_rate_rad_s >= 0.0);
        if neighbours.fallbacks.is_empty() {
            return (0.0, first, None);
        }
        let mut best = (f64::INFINITY, first, None);
        for sense in first.with_other().into_iter().filter(|sense| possible[*sense as usize]) {
            let mut worst = (0.0, sense, None);
            for (uav, other, required_m) in &neighbours.fallbacks {
                let short = self.fallbacks.shortfall(paths.of(sense), other, *required_m, self.own.wind);
                if short > worst.0 {
                    let predicted_distance_m = required_m * (1.0 - short).max(0.0);
                    worst = (short, sense, Some(avoidance(Aircraft::Uav(*uav), predicted_distance_m)));
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
    pub(crate) fn shortfall(
        &self,
        course: &SampledTrajectory,
        near: &[Near],
        short_max: f64,
    ) -> (f64, Option<Avoidance>) {
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

impl Search<'_> {
    /// A candidate, if it costs less than the best one so far.
    fn cheaper(
        &self,
        (effort, command): (f64, Command),
        best: &Choice,
        turns: impl Fn(&Paths) -> [bool; 2],
    ) -> Option<Choice> {
        let effort = effort + self.change_cost(command);
        // A command with a larger shortfall costs more than the best one.
        let short_max = (best.cost - effort) / SHORTFALL_COST;
        if short_max <= 0.0 {
            return None;
        }
        let short = self.shortfall(command, short_max);
        if short >= short_max {
            return None;
        }
        let cost = effort + SHORTFALL_COST * short;
        let short_max = ((best.cost - cost) / FALLBACK_SHORTFALL_COST - 1.0).max(f64::MIN_POSITIVE);
        let paths = Paths::after(self.avoidance.fallbacks, self.avoidance.own, command);
        let fallback = |possible| self.avoidance.fallback_shortfall(&paths, self.neighbours, short_max, possible);
        // Without the geofence first, because its turns take longer to compute.
        let mut chosen = fallback([true; 2]);
        if chosen.0 >= short_max {
            return None;
        }
        let possible = turns(&paths);
        if possible == [false; 2] {
            return None;
        }
        if possible != [true; 2] {
            chosen = fallback(possible);
        }
        let (fallback_short, sense, _) = chosen;
        let falls_short = if fallback_short > 0.0 { FALLBACK_SHORTFALL_COST * (1.0 + fallback_short) } else { 0.0 };
        let cost = cost + falls_short;
        (cost < best.cost).then_some(Choice { cost, command, sense, fallback_short })
    }

    /// Cost of a turn rate that differs from the flown one.
    fn change_cost(&self, command: Command) -> f64 {
        let (flown, turn) = (self.flown_rad_s, command.turn_rate_rad_s);
        let is_reversal = flown * turn < 0.0 && flown.abs().min(turn.abs()) > REVERSAL_RAD_S;
        self.change_cost_s * (turn - flown).abs() + if is_reversal { REVERSAL_COST } else { 0.0 }
    }

    /// Smallest shortfall of a command that is held, or followed by straight flight.
    fn shortfall(&self, command: Command, short_max: f64) -> f64 {
        let (near, held) = (self.neighbours.near, Intent::held(command));
        let shortfall = |intent| self.avoidance.shortfall(&self.course.with(intent).sampled(), near, short_max).0;
        let mut short = shortfall(held);
        for for_s in self.turns_s {
            if short > 0.0 {
                short = short.min(shortfall(Intent { for_s: *for_s, turn_rate_after_rad_s: 0.0, ..held }));
            }
        }
        short
    }
}
