//! Zones: a UAV flies only commands after which a fallback stays clear of every outline.
//!
//! A state is *safe* if a circle to the left or to the right, at constant airspeed, stays clear of every outline forever.
//! A command is *allowed* if one period of it stays clear and ends in a safe state. From a safe state, the UAV flies the
//! desired command if it is allowed, otherwise the nearest allowed one. If there is none, it flies the circle that it has
//! planned when it found the last command allowed. Therefore a UAV that starts safe never crosses an outline. Loiter
//! circles as fallback come from T. Schouwenaars, J. How and E. Feron, *Receding Horizon Path Planning with Implicit
//! Safety Guarantees*, American Control Conference 2004.
//!
//! Safety alone would make the UAV turn away at the last moment, again and again. Therefore detour planning
//! ([`DetourPlanner`](crate::safety::detour)) looks further ahead: if a zone blocks the path onto an orbit, or the
//! orbit itself, the UAV flies the shortest path around it to the next free part of the orbit.

use crate::frame::{Displacement, Velocity};
use crate::math::TAU;
use crate::params::UavParams;
use crate::safety::candidates::candidates;
use crate::safety::detour::DetourPlanner;
use crate::safety::fallback::{FallbackModel, Path, Plan, Sense};
use crate::safety::geofence::{Geofence, Side, crossed_at, squared_between_m2, squared_to_side_m2};
use crate::safety::motion::{Airframe, Motion};
use crate::time::Duration;
use crate::uav::{Command, UavState};
use crate::wind::Wind;

/// Minimum clearance of paths from outlines, m. Larger than the deviation of an arc from its chord between two record
/// frames.
const MARGIN_M: f64 = 5.0;

/// Keeps a UAV within its geofence.
#[derive(Debug, Clone)]
pub(crate) struct GeofenceSafety {
    /// Detour planner.
    pub(crate) detours: DetourPlanner,
    /// Fallbacks of all UAVs that the same zones bind.
    pub(crate) model: FallbackModel,
    /// Distance beyond which sides are ignored, m.
    reach_m: f64,
}

/// Outlines near a UAV.
#[derive(Debug, Clone)]
pub(crate) struct Outlines {
    sides: Vec<Side>,
    /// True if the zones allow the position of the UAV.
    is_allowed: bool,
}

impl Outlines {
    /// True if every path is clear of them.
    pub(crate) fn are_far(&self) -> bool {
        self.is_allowed && self.sides.is_empty()
    }
}

/// Use of a path; it decides the margin for errors of the prediction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Of {
    /// A command without other aircraft near. It may be that of a path, and change until the next decision.
    Path,
    /// A command that keeps clear of other aircraft. A larger margin would forbid fallbacks that teammates count on.
    Avoidance,
    /// A path that the UAV or a teammate flies anyway.
    Flown,
}

/// Closest approach of a path to outlines.
#[derive(Debug, Clone, Copy)]
struct Closest {
    squared_m2: f64,
    /// Index of the zone.
    zone: usize,
    /// Number of pieces flown until then.
    pieces: usize,
}

impl Closest {
    const NOWHERE: Self = Self { squared_m2: f64::INFINITY, zone: 0, pieces: 0 };

    fn note(&mut self, squared_m2: f64, zone: usize, pieces: usize) {
        if squared_m2 < self.squared_m2 {
            *self = Self { squared_m2, zone, pieces };
        }
    }

    /// Of a path. The search stops at a piece nearer than `least_m2`.
    fn of(path: &Path, sides: &[Side], least_m2: f64) -> Self {
        let (points, (centre, [inner_m, outer_m])) = (path.points(), path.ring_m());
        let mut closest = Self::NOWHERE;
        for piece in 1..points.len() {
            for side in sides {
                let squared_m2 = squared_between_m2((points[piece - 1], points[piece]), (side.from, side.to));
                closest.note(squared_m2, side.zone, piece);
            }
            if closest.squared_m2 < least_m2 {
                return closest;
            }
        }
        for side in sides {
            let nearest_m = squared_to_side_m2(centre, side.from, side.to).sqrt();
            let furthest_m = centre.distance_m(side.from).max(centre.distance_m(side.to));
            let apart_m = (nearest_m - outer_m).max(inner_m - furthest_m).max(0.0);
            closest.note(apart_m * apart_m, side.zone, points.len());
        }
        closest
    }
}

impl Geofence {
    /// Returns true if a UAV in this state, with heading, airspeed and heading rate relative to the air, and altitudes
    /// between two, m, can stay within the geofence in a steady wind: a circle to the left or to the right stays clear of
    /// the outline of every zone that binds it. An [`Agent`](crate::Agent) that commands it every `period` then keeps it
    /// inside.
    pub fn can_stay_inside(
        &self,
        uav: &UavParams,
        period: Duration,
        (own, wind): (&UavState, Wind),
        altitudes_m: [f64; 2],
    ) -> bool {
        let zones = self.part(self.binding(altitudes_m));
        let airframe = Airframe::new(*uav, wind.velocity.speed_m_s());
        GeofenceSafety::new(zones, airframe, period.s()).is_safe(&Motion::steady(uav, own).in_wind(Some(wind)))
    }

    /// Returns the radius of the largest circle inside all keep-in zones, m, and the radius that a UAV needs in a wind,
    /// m/s, if the first is smaller. It is negative if no position is inside all of them.
    pub fn lacking_room(&self, uav: &UavParams, period: Duration, wind_m_s: f64) -> Option<[f64; 2]> {
        let model = FallbackModel::over_ground(Airframe::new(*uav, wind_m_s), period.s());
        let required_m = model.nominal_circle_m() + margin_m(&model, Of::Path);
        self.lacking_room_m(required_m).map(|found_m| [found_m, required_m])
    }
}

/// Clearance of the points of a path from outlines, m. Covers the deviation of the path between two points.
fn margin_m(model: &FallbackModel, of: Of) -> f64 {
    let airframe = &model.airframe;
    let errors_m = match of {
        Of::Path => airframe.wind_error_m() + airframe.path_error_m(),
        Of::Avoidance => airframe.wind_error_m(),
        Of::Flown => 0.0,
    };
    MARGIN_M + model.sagitta_m() + errors_m
}

impl GeofenceSafety {
    pub(crate) fn new(geofence: Geofence, airframe: Airframe, period_s: f64) -> Self {
        let model = FallbackModel::over_ground(airframe, period_s);
        let fastest_m_s = airframe.uav.speed_max_m_s();
        let circle_m = 2.0 * airframe.circle_m(fastest_m_s, airframe.wind_m_s);
        let reach_margin_m = MARGIN_M + margin_m(&model, Of::Path);
        Self {
            detours: DetourPlanner::of(geofence, airframe.over_ground()),
            reach_m: airframe.fastest_over_ground_m_s() * (period_s + model.settled_s()) + circle_m + reach_margin_m,
            model,
        }
    }

    pub(crate) fn geofence(&self) -> &Geofence {
        &self.detours.geofence
    }

    /// Returns the command to fly instead of the desired one, and the zone that makes it necessary, if any. Commands are
    /// relative to the air. The desired command must be within the limits.
    pub(crate) fn make_safe(&self, own: &Motion, desired: Command, plan: Option<&Plan>) -> (Command, Option<usize>) {
        if let Some(zone) = self.geofence().violated_zones(own.state.position).next() {
            return (self.exit_command(own), Some(zone));
        }
        let sides = self.sides_near(own);
        let Some(zone) = self.forbidding_zone(own, desired, &sides) else { return (desired, None) };
        let mut commands = candidates(&self.model, own, desired).into_iter().map(|(_, command)| command);
        let allowed = commands.find(|command| self.forbidding_zone(own, *command, &sides).is_none());
        (allowed.unwrap_or_else(|| self.fallback(own, plan, &sides).0), Some(zone))
    }

    /// Outlines that a UAV may reach.
    pub(crate) fn outlines(&self, own: &Motion) -> Outlines {
        Outlines { sides: self.sides_near(own), is_allowed: self.geofence().contains(own.state.position) }
    }

    /// Returns true if a path that begins at an allowed position stays clear of every outline forever.
    pub(crate) fn is_clear(&self, path: &Path, outlines: &Outlines, of: Of) -> bool {
        outlines.is_allowed && self.forbidding_zone_of(path, &outlines.sides, of).is_none()
    }

    /// Returns true if the position is allowed and a fallback stays clear of every outline forever.
    pub(crate) fn is_safe(&self, own: &Motion) -> bool {
        let sides = self.sides_near(own);
        let turns = Sense::BOTH.map(|sense| self.model.path(own, self.model.command(own, sense, None), sense));
        let is_clear = |path: &Path| self.forbidding_zone_of(path, &sides, Of::Path).is_none();
        self.geofence().contains(own.state.position) && self.model.can_circle(own) && turns.iter().any(is_clear)
    }

    /// The plan of a UAV that flies a command: the fallback after it that stays furthest from all outlines; or the plan
    /// so far, if the command is not allowed. `None` far from all outlines.
    pub(crate) fn plan_after(&self, own: &Motion, command: Command, plan: Option<Plan>, period_s: f64) -> Option<Plan> {
        let sides = self.sides_near(own);
        if sides.is_empty() {
            return None;
        }
        let least_m2 = self.least_m2(Of::Avoidance);
        let paths = Sense::BOTH.map(|sense| self.model.path(own, command, sense));
        let [left, right] = [0, 1].map(|index| Closest::of(&paths[index], &sides, least_m2).squared_m2);
        let kept = plan.filter(|_| left.max(right) < least_m2).map(|plan| plan.after_s(period_s));
        kept.or_else(|| Some(self.model.plan(&paths[usize::from(right > left)])))
    }

    /// All sides within reach.
    fn sides_near(&self, own: &Motion) -> Vec<Side> {
        self.geofence().sides_near(own.state.position, self.reach_m).collect()
    }

    fn least_m2(&self, of: Of) -> f64 {
        let margin_m = margin_m(&self.model, of);
        margin_m * margin_m
    }

    /// Index of the zone that forbids a command; `None` if the command is allowed.
    fn forbidding_zone(&self, own: &Motion, command: Command, sides: &[Side]) -> Option<usize> {
        if sides.is_empty() {
            return None;
        }
        let zone = self.forbidding_zone_of(&self.model.path(own, command, Sense::Left), sides, Of::Path)?;
        self.forbidding_zone_of(&self.model.path(own, command, Sense::Right), sides, Of::Path).map(|_| zone)
    }

    /// Index of the zone whose outline a path comes near.
    fn forbidding_zone_of(&self, path: &Path, sides: &[Side], of: Of) -> Option<usize> {
        let least_m2 = self.least_m2(of);
        let closest = Closest::of(path, sides, least_m2);
        (closest.squared_m2 < least_m2).then_some(closest.zone)
    }

    /// The fallback, to the left or to the right, of a UAV without a safe turn.
    pub(crate) fn last_turn(&self, own: &Motion, plan: Option<&Plan>) -> [bool; 2] {
        let (_, sense) = self.fallback(own, plan, &self.sides_near(own));
        Sense::BOTH.map(|of| of == sense)
    }

    /// The planned fallback, if it stays clear; otherwise the one that stays furthest from all outlines. Of those that
    /// cross an outline, the one that crosses later.
    fn fallback(&self, own: &Motion, plan: Option<&Plan>, sides: &[Side]) -> (Command, Sense) {
        let planned = plan.map(|plan| {
            let closest = Closest::of(&self.model.path_of(own, plan), sides, f64::MIN_POSITIVE);
            (closest, self.model.command(own, plan.sense, Some(plan)), plan.sense)
        });
        if let Some((_, command, sense)) =
            planned.filter(|(closest, ..)| closest.squared_m2 >= self.least_m2(Of::Flown))
        {
            return (command, sense);
        }
        let turns = Sense::BOTH.map(|sense| {
            let command = self.model.command(own, sense, None);
            (Closest::of(&self.model.path(own, command, sense), sides, f64::MIN_POSITIVE), command, sense)
        });
        let by_clearance =
            |a: &Closest, b: &Closest| a.squared_m2.total_cmp(&b.squared_m2).then(a.pieces.cmp(&b.pieces));
        let [left, right] = turns;
        let furthest = if by_clearance(&left.0, &right.0).is_ge() { left } else { right };
        let furthest = planned.filter(|planned| by_clearance(&planned.0, &furthest.0).is_ge()).unwrap_or(furthest);
        (furthest.1, furthest.2)
    }

    /// Command that leaves the forbidden zones soonest, by a hard turn followed by straight flight.
    fn exit_command(&self, own: &Motion) -> Command {
        let speed_m_s = self.model.airframe.uav.speed_max_m_s();
        let turn_max = self.model.airframe.uav.turn_rate_max_rad_s;
        let straight_on = Command { speed_m_s, turn_rate_rad_s: 0.0 };
        let mut soonest = (f64::INFINITY, straight_on);
        let piece_s = (0.1 / turn_max).max(1e-2);
        let response = self.model.airframe.uav.response(Duration::from_s(piece_s));
        let pieces = (TAU / 0.1 + self.model.settled_s() / piece_s).min(500.0) as u32;
        for sense in [1.0, -1.0] {
            let turn = Command { speed_m_s, turn_rate_rad_s: sense * turn_max };
            let mut motion = *own;
            for piece in 0..=pieces {
                let after_s = f64::from(piece) * piece_s;
                let out_s = after_s + self.exit_s(&motion, speed_m_s);
                if out_s < soonest.0 {
                    soonest = (out_s, if piece == 0 { straight_on } else { turn });
                }
                if after_s >= soonest.0 {
                    break;
                }
                motion = response.advance(&motion, turn);
            }
        }
        soonest.1
    }

    /// Time of straight flight at an airspeed, m/s, until the exit from all zones that forbid the position, s.
    fn exit_s(&self, motion: &Motion, airspeed_m_s: f64) -> f64 {
        let (at, air) = (motion.state.position, Velocity::from_polar(airspeed_m_s, motion.state.heading));
        let ground = air + motion.wind.velocity;
        let ahead = Displacement::from_polar(1.0, ground.direction());
        let mut furthest_m = 0.0;
        for zone in self.geofence().violated_zones(at) {
            let sides = self.geofence().sides().filter(|side| side.zone == zone);
            let exit_m = sides.filter_map(|side| crossed_at(at, ahead, &side)).fold(f64::INFINITY, f64::min);
            furthest_m = f64::max(furthest_m, exit_m);
        }
        furthest_m / ground.speed_m_s().max(1.0)
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::angle::Angle;
    use crate::frame::Position;
    use crate::math;
    use crate::math::PI;
    use crate::params::{BankParams, Integrator, TeamParams, WindParams};
    use crate::safety::geofence::{Zone, ZoneKind};
    use proptest::prelude::*;

    /// Random number generator (splitmix64).
    pub(crate) struct Drawn(pub(crate) u64);

    impl Drawn {
        pub(crate) fn between(&mut self, low: f64, high: f64) -> f64 {
            self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mut z = self.0;
            z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            low + (high - low) * ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
        }

        pub(crate) fn below(&mut self, count: usize) -> usize {
            (self.between(0.0, count as f64) as usize).min(count - 1)
        }
    }

    /// A star, an L or a U around `centre`, within `size_m` of it, rotated at random.
    pub(crate) fn shape(drawn: &mut Drawn, centre: Position, size_m: f64) -> Vec<Position> {
        let turned = Angle::from_rad(drawn.between(-PI, PI));
        let at = |(x, y): (f64, f64)| {
            let (length, direction) = (math::hypot(x, y), Displacement::from_m(x, y).direction());
            centre + Displacement::from_polar(length * size_m, direction + turned)
        };
        let wide = drawn.between(0.1, 0.5);
        match drawn.below(3) {
            0 => {
                let corners = 3 + drawn.below(9);
                let corner = |n: usize| {
                    let along = Angle::from_rad(TAU * (n as f64 + drawn.between(0.0, 0.7)) / corners as f64);
                    centre + Displacement::from_polar(size_m * drawn.between(0.2, 1.0), along + turned)
                };
                (0..corners).map(corner).collect()
            }
            1 => {
                let (a, b) = (-0.7, -0.7 + wide);
                [(a, a), (0.7, a), (0.7, b), (b, b), (b, 0.7), (a, 0.7)].map(at).into()
            }
            _ => {
                let (a, b) = (-0.7, -0.7 + wide);
                let corners = [(a, a), (0.7, a), (0.7, 0.7), (-b, 0.7), (-b, b), (b, b), (b, 0.7), (a, 0.7)];
                corners.map(at).into()
            }
        }
    }

    /// A random geofence: keep-out zones at least `apart_m` apart, sometimes within a keep-in zone.
    pub(crate) fn drawn_geofence(drawn: &mut Drawn, apart_m: f64) -> Geofence {
        let mut zones: Vec<Zone> = Vec::new();
        let mut discs: Vec<(Position, f64)> = Vec::new();
        for _ in 0..1 + drawn.below(5) {
            let size_m = drawn.between(30.0, 500.0);
            let centre = Position::from_m(drawn.between(-900.0, 900.0), drawn.between(-900.0, 900.0));
            if discs.iter().all(|(other, other_m)| other.distance_m(centre) > other_m + size_m + apart_m) {
                discs.push((centre, size_m));
                let outline = shape(drawn, centre, size_m);
                zones.push(Zone { kind: ZoneKind::KeepOut, vertices: outline, ..Zone::default() });
            }
        }
        if drawn.below(3) == 0 {
            let furthest_m = discs.iter().map(|(at, size_m)| at.distance_m(Position::ORIGIN) + size_m);
            let half_m = (furthest_m.fold(300.0, f64::max) + apart_m) * 1.5;
            let corners = [(-half_m, -half_m), (half_m, -half_m), (half_m, half_m), (-half_m, half_m)];
            let outline = corners.map(|(x_m, y_m)| Position::from_m(x_m, y_m)).into();
            zones.push(Zone { kind: ZoneKind::KeepIn, vertices: outline, ..Zone::default() });
        }
        Geofence::new(zones).unwrap_or_default()
    }

    pub(crate) fn drawn_state(drawn: &mut Drawn) -> UavState {
        UavState {
            position: Position::from_m(drawn.between(-1500.0, 1500.0), drawn.between(-1500.0, 1500.0)),
            heading: Angle::from_rad(drawn.between(-PI, PI)),
            speed_m_s: drawn.between(25.0, 55.0),
            turn_rate_rad_s: drawn.between(-0.3, 0.3),
            vertical: None,
        }
    }

    /// Checks that a UAV that starts safe never leaves its geofence, for random desired commands, also between time
    /// steps.
    fn stays_within(seed: u64, params: &TeamParams) {
        let mut drawn = Drawn(seed);
        let wind = params.wind.map(|wind| {
            let direction = Angle::from_rad(drawn.between(-PI, PI));
            Wind { velocity: Velocity::from_polar(wind.orbit_wind_m_s, direction) }
        });
        let geofence = drawn_geofence(&mut drawn, 2.0 * 40.0 / 0.3);
        let geofence_safety = GeofenceSafety::new(geofence, params.airframe(), params.log.period_s);
        let Some(state) = (0..20)
            .map(|_| drawn_state(&mut drawn))
            .find(|state| geofence_safety.is_safe(&Motion::steady(&params.uav, state).in_wind(wind)))
        else {
            return;
        };
        let (mut motion, mut plan) = (Motion::steady(&params.uav, &state).in_wind(wind), None);
        let pieces = if params.uav.integrator == Integrator::Euler { 1 } else { 5 };
        let response = params.uav.response(Duration::from_s(params.log.period_s / f64::from(pieces)));
        // Random commands that last a few seconds, or flight straight towards a corner or the origin.
        let (mut desired, mut until) = (Command { speed_m_s: 40.0, turn_rate_rad_s: 0.0 }, 0);
        let corners: Vec<Position> = geofence_safety
            .geofence()
            .zones()
            .flat_map(|zone| zone.vertices.clone())
            .chain([Position::ORIGIN])
            .collect();
        let mut goal = None;
        for step in 0..60 {
            if step >= until {
                until = step + 1 + drawn.below(20);
                let (speed_m_s, turn_rate_rad_s) = (drawn.between(25.0, 55.0), drawn.between(-0.3, 0.3));
                desired = params.uav.limit(Command { speed_m_s, turn_rate_rad_s }).command;
                goal = (drawn.below(2) == 0).then(|| corners[drawn.below(corners.len())]);
            }
            if let Some(goal) = goal {
                let error_rad = ((goal - motion.state.position).direction() - motion.state.heading).rad();
                desired.turn_rate_rad_s = error_rad.clamp(-0.3, 0.3);
            }
            let (command, _) = geofence_safety.make_safe(&motion, desired, plan.as_ref());
            plan = geofence_safety.plan_after(&motion, command, plan, params.log.period_s);
            assert_eq!(params.uav.limit(command).command, command, "command exceeds the limits");
            for _ in 0..pieces {
                motion = response.advance(&motion, command);
                let violated_zones = geofence_safety.geofence().violated_zones(motion.state.position).next();
                assert_eq!(violated_zones, None, "seed {seed}, step {step}: {motion:?}");
            }
        }
    }

    proptest! {
        #[test]
        fn a_uav_that_starts_safe_stays_within_its_geofence(seed in any::<u64>()) {
            stays_within(seed, &TeamParams::paper());
        }

        #[test]
        fn a_uav_with_long_lags_or_euler_steps_stays_within_its_geofence(seed in any::<u64>()) {
            let mut params = TeamParams::paper();
            (params.uav.speed_lag_s, params.uav.turn_rate_lag_s) = (0.6, 1.5);
            stays_within(seed, &params);
            params.uav.integrator = Integrator::Euler;
            stays_within(seed, &params);
        }

        #[test]
        fn a_banking_uav_that_starts_safe_stays_within_its_geofence(seed in any::<u64>()) {
            let mut params = TeamParams::paper();
            let slow = BankParams { bank_max_rad: 0.9, roll_rate_max_rad_s: 0.4, turn_factor: 0.8, ..BankParams::default() };
            for bank in [BankParams::default(), slow] {
                params.uav.bank = Some(bank);
                stays_within(seed, &params);
            }
        }
    }

    /// In a steady wind of 5 to 12 m/s, with wide and narrow ranges of airspeed.
    #[test]
    fn a_uav_that_starts_safe_in_wind_stays_within_its_geofence() {
        for seed in 0..200 {
            let mut drawn = Drawn(seed ^ 0xabcd);
            let mut params = TeamParams::paper();
            params.wind = Some(WindParams { orbit_wind_m_s: drawn.between(5.0, 12.0), ..WindParams::default() });
            params.uav.speed_change_max_m_s = [4.0, 8.0, 15.0][drawn.below(3)];
            params.uav.bank = (drawn.below(2) == 0).then(BankParams::default);
            params.log.period_s = [0.1, 0.5, 1.0][drawn.below(3)];
            stays_within(seed, &params);
        }
    }

    fn square(x_m: f64, y_m: f64, half_m: f64) -> Zone {
        let outline = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(x, y)| Position::from_m(x_m + x * half_m, y_m + y * half_m));
        Zone { kind: ZoneKind::KeepOut, vertices: outline.into(), ..Zone::default() }
    }

    fn steady(state: UavState) -> Motion {
        Motion::steady(&TeamParams::paper().uav, &state)
    }

    fn east(x_m: f64, y_m: f64) -> UavState {
        UavState::level_flight(Position::from_m(x_m, y_m), Angle::ZERO, 40.0)
    }

    #[test]
    fn allowed_commands_are_unchanged_and_others_report_the_zone() {
        let geofence = Geofence::new(vec![square(-5000.0, 0.0, 10.0), square(600.0, 0.0, 200.0)]).unwrap();
        let geofence_safety = GeofenceSafety::new(geofence, TeamParams::paper().airframe(), 0.5);
        let desired = Command { speed_m_s: 41.25, turn_rate_rad_s: 0.012_345 };
        assert_eq!(geofence_safety.make_safe(&steady(east(0.0, 0.0)), desired, None), (desired, None));
        // The radius of the tightest circle is 83 m, so at 110 m from the zone the UAV cannot continue.
        let (command, zone) = geofence_safety.make_safe(&steady(east(290.0, 0.0)), desired, None);
        assert!(zone == Some(1) && command.turn_rate_rad_s.abs() > 0.1, "{command:?}");
    }

    #[test]
    fn a_uav_inside_a_keep_out_zone_leaves_it_on_the_fastest_path() {
        let geofence = Geofence::new(vec![square(0.0, 0.0, 400.0)]).unwrap();
        let geofence_safety = GeofenceSafety::new(geofence, TeamParams::paper().airframe(), 0.5);
        // Straight ahead the exit is 100 m away; behind, it is a turn and 700 m.
        let straight_on = Command { speed_m_s: 55.0, turn_rate_rad_s: 0.0 };
        assert_eq!(geofence_safety.make_safe(&steady(east(300.0, 0.0)), straight_on, None), (straight_on, Some(0)));
        // To the north the exit is 50 m away: a quarter turn with a radius of 133 m is shorter than 700 m.
        let (command, _) = geofence_safety.make_safe(&steady(east(-300.0, 350.0)), straight_on, None);
        assert_eq!(command.turn_rate_rad_s, 0.3);
        let response = TeamParams::paper().uav.response(Duration::from_s(0.5));
        let mut state = east(-300.0, 350.0);
        let inside = (0..40).take_while(|_| {
            state = response.step(&state, geofence_safety.make_safe(&steady(state), straight_on, None).0);
            !geofence_safety.geofence().contains(state.position)
        });
        assert!(inside.count() < 8);
    }
}
