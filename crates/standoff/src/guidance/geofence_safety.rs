//! Geofence safety: restricts the commands so that a UAV never crosses the outline of a zone.
//!
//! Two fallback manoeuvres are the hardest turns to the left and to the right at the lowest speed, or for banking
//! aircraft at the current one. Both end in circles, which can be flown indefinitely. Circles are over ground, also in
//! wind. Banking aircraft lack the power to keep their ground speed on them; their circles are so wide that they can be
//! flown at constant airspeed. A state is *safe* if one of them stays clear of every outline forever. A command is
//! *allowed* if holding it for one period, with the exact response of the UAV including its lags, stays clear and ends in
//! a safe state.
//!
//! If the desired command is allowed, it is flown. Otherwise the nearest allowed command is flown. If no command is
//! allowed, the fallback manoeuvre that stays furthest from all outlines is flown; from a safe state it stays clear.
//! Therefore a safe state is followed by a safe state: a UAV that starts safe and flies these commands never crosses an
//! outline. Loiter circles as fallback manoeuvres come from T. Schouwenaars, J. How and E. Feron, *Receding Horizon
//! Path Planning with Implicit Safety Guarantees*, American Control Conference 2004.
//!
//! Safety alone would make the UAV turn away at the last moment, again and again. Therefore detour planning
//! ([`DetourPlanner`](crate::guidance::detour)) looks further ahead: if a zone blocks the path onto an orbit, or the
//! orbit itself, the UAV flies the shortest path around it to the next free part of the orbit.

use crate::bank::Motion;
use crate::frame::Displacement;
use crate::guidance::command_candidates::Costs;
use crate::guidance::detour::DetourPlanner;
use crate::guidance::geofence::{Geofence, Side, crossed_at, squared_between_m2, squared_to_side_m2};
use crate::math::{PI, TAU};
use crate::params::{Integrator, UavParams};
use crate::time::Duration;
use crate::uav::{AutopilotModel, Command, UavState};
use crate::wind::PredictionLimits;
use crate::{Angle, math};

/// Minimum clearance of paths from outlines, m. Larger than the deviation of an arc from its chord between two record
/// frames.
const MARGIN_M: f64 = 5.0;

/// Maximum turn between two consecutive points of a path, rad.
const TURN_STEP_RAD: f64 = 0.08;

/// Number of lags after which a manoeuvre counts as a circle.
const SETTLED_LAGS: f64 = 8.0;

/// Costs of a command that differs from the desired one.
const COSTS: Costs = Costs { speed: 0.3, turn: 0.1 };

/// Keeps a UAV within its geofence.
#[derive(Debug, Clone)]
pub(crate) struct GeofenceSafety {
    /// Detour planner.
    pub(crate) detours: DetourPlanner,
    limits: PredictionLimits,
    /// One period, in pieces.
    period: Pieces,
    /// Time until a manoeuvre is a circle, in pieces.
    settling: Pieces,
    /// Clearance of path points from outlines, m. Covers the deviation of the path between two points.
    margin_m: f64,
    /// Distance beyond which sides are ignored, m.
    reach_m: f64,
}

/// A duration, divided into equal pieces.
#[derive(Debug, Clone)]
struct Pieces {
    response: AutopilotModel,
    count: u32,
    piece_s: f64,
}

impl Pieces {
    fn of(time_s: f64, count: u32, uav: &UavParams) -> Self {
        let piece_s = time_s / f64::from(count);
        Self { response: uav.response(Duration::from_s(piece_s)), count, piece_s }
    }
}

/// Point of closest approach of a path to outlines.
#[derive(Debug, Clone, Copy)]
struct Closest {
    squared_m2: f64,
    /// Index of the zone.
    zone: usize,
    /// Number of pieces flown until then.
    pieces: u32,
}

impl Closest {
    const NOWHERE: Self = Self { squared_m2: f64::INFINITY, zone: 0, pieces: 0 };

    fn note(&mut self, squared_m2: f64, zone: usize, pieces: u32) {
        if squared_m2 < self.squared_m2 {
            *self = Self { squared_m2, zone, pieces };
        }
    }
}

impl Geofence {
    /// Returns true if a UAV in this state, with altitudes between two, m, can stay within the geofence: one of its two
    /// hardest turns at the lowest speed stays clear of the outline of every zone that binds it. An
    /// [`Agent`](crate::Agent) that commands it every `period` then keeps it inside.
    #[cfg_attr(feature = "research", visibility::make(pub))]
    pub(crate) fn can_stay_inside(
        &self,
        uav: &UavParams,
        period: Duration,
        own: &UavState,
        altitudes_m: [f64; 2],
    ) -> bool {
        let zones = self.part(self.binding(altitudes_m));
        GeofenceSafety::new(zones, PredictionLimits::in_wind(*uav, 0.0), period.s()).is_safe(own)
    }
}

impl Geofence {
    /// Returns the radius of the largest circle inside all keep-in zones, m, and the radius that a UAV needs, m, if the
    /// first is smaller. It is negative if no position is inside all of them.
    #[cfg_attr(feature = "research", visibility::make(pub))]
    pub(crate) fn lacking_room(&self, uav: &UavParams, period: Duration) -> Option<[f64; 2]> {
        let required_m = required_room_m(uav, period.s());
        self.lacking_room_m(required_m).map(|found_m| [found_m, required_m])
    }
}

impl GeofenceSafety {
    pub(crate) fn new(geofence: Geofence, limits: PredictionLimits, period_s: f64) -> Self {
        let PredictionLimits { uav, fastest_m_s, .. } = limits;
        let turn_max = uav.turn_rate_max_rad_s;
        let (period, settling) = pieces(&uav, period_s);
        let settled_s = settling.piece_s * f64::from(settling.count);
        let radius_m = fastest_m_s / uav.turn_rate_max_at_rad_s(fastest_m_s);
        let circle_m = 2.0 * radius_m.max(limits.circle_at_airspeed_m(fastest_m_s - limits.wind_m_s));
        Self {
            detours: DetourPlanner::of(geofence, uav),
            margin_m: margin_m(fastest_m_s, turn_max, &[&period, &settling]) + limits.wind_error_m(),
            reach_m: fastest_m_s * (period_s + settled_s) + circle_m + 2.0 * MARGIN_M,
            limits,
            period,
            settling,
        }
    }

    pub(crate) fn geofence(&self) -> &Geofence {
        &self.detours.geofence
    }

    /// Returns the command to fly instead of the desired one, and the zone that makes it necessary, if any. The desired
    /// command must be within the limits.
    pub(crate) fn make_safe(&self, own: &Motion, desired: Command) -> (Command, Option<usize>) {
        if let Some(zone) = self.geofence().violated_zones(own.state.position).next() {
            return (self.exit_command(own), Some(zone));
        }
        let sides = self.sides_near(&own.state);
        let Some(zone) = self.forbidding_zone(own, desired, &sides) else { return (desired, None) };
        let mut commands = COSTS.candidates(&self.limits, own, desired).into_iter().map(|(_, command)| command);
        let allowed = commands.find(|command| self.forbidding_zone(own, *command, &sides).is_none());
        (allowed.unwrap_or_else(|| self.manoeuvre(own, &sides)), Some(zone))
    }

    /// Fallback manoeuvres, to the left and to the right, that stay clear of every outline forever after a command was
    /// held for one period. Neither, if the command is not allowed.
    ///
    /// Circles at constant airspeed are flown with small errors. That of a teammate, and the one that a UAV already flies,
    /// need no margin for the wind: otherwise these errors would forbid a manoeuvre that teammates count on.
    pub(crate) fn safe_turns(&self, own: &Motion, command: Command, is_teammate: bool) -> [bool; 2] {
        if !self.geofence().contains(own.state.position) {
            return [false; 2];
        }
        let least_m2 = |is_expected: bool| {
            let margin_m = self.margin_m - if is_expected { self.limits.wind_error_m() } else { 0.0 };
            margin_m * margin_m
        };
        let sides = self.sides_near(&own.state);
        let is_expected = self
            .manoeuvres(own)
            .map(|turn| own.circling_in.is_some() && (is_teammate || turn.turn_rate_rad_s == command.turn_rate_rad_s));
        let first_m2 = least_m2(is_expected != [false; 2]);
        let (end, closest) = flown(&self.period, own, |motion| own.held(command, motion), &sides, first_m2);
        if closest.squared_m2 < first_m2 {
            return [false; 2];
        }
        let turns = self.manoeuvres(&end);
        [0, 1].map(|side| {
            let least_m2 = least_m2(is_expected[side]);
            self.for_good(&end, turns[side], &sides, least_m2).squared_m2 >= least_m2
        })
    }

    /// Returns true if the position is allowed and a fallback manoeuvre stays clear of every outline forever.
    pub(crate) fn is_safe(&self, own: &UavState) -> bool {
        let sides = self.sides_near(own);
        let motion = Motion::steady(&self.limits.uav, own);
        self.geofence().contains(own.position) && self.unsafe_for(&motion, &sides).is_none()
    }

    /// All sides within reach.
    fn sides_near(&self, own: &UavState) -> Vec<Side> {
        self.geofence().sides_near(own.position, self.reach_m).collect()
    }

    /// Index of the zone that forbids a command; `None` if the command is allowed.
    fn forbidding_zone(&self, own: &Motion, command: Command, sides: &[Side]) -> Option<usize> {
        if sides.is_empty() {
            return None;
        }
        let least_m2 = self.margin_m * self.margin_m;
        let (end, closest) = flown(&self.period, own, |motion| own.held(command, motion), sides, least_m2);
        if closest.squared_m2 < least_m2 { Some(closest.zone) } else { self.unsafe_for(&end, sides) }
    }

    /// Index of a zone from which neither manoeuvre stays clear; `None` if the state is safe.
    fn unsafe_for(&self, own: &Motion, sides: &[Side]) -> Option<usize> {
        let least_m2 = self.margin_m * self.margin_m;
        let [left, right] = self.manoeuvres(own);
        let closest = self.for_good(own, left, sides, least_m2);
        let is_near = closest.squared_m2 < least_m2;
        (is_near && self.for_good(own, right, sides, least_m2).squared_m2 < least_m2).then_some(closest.zone)
    }

    /// The two fallback manoeuvres, to the left and to the right.
    fn manoeuvres(&self, own: &Motion) -> [Command; 2] {
        [1.0, -1.0].map(|sense| own.escape_command(&self.limits, sense))
    }

    /// The fallback manoeuvre, to the left or to the right, of a UAV without a safe turn.
    pub(crate) fn last_turn(&self, own: &Motion) -> [bool; 2] {
        let is_left = self.manoeuvre(own, &self.sides_near(&own.state)).turn_rate_rad_s > 0.0;
        [is_left, !is_left]
    }

    /// The fallback manoeuvre that stays furthest from all outlines. If both cross an outline, the one that crosses
    /// later.
    fn manoeuvre(&self, own: &Motion, sides: &[Side]) -> Command {
        let [left, right] = self.manoeuvres(own);
        let [l, r] = [left, right].map(|command| self.for_good(own, command, sides, f64::MIN_POSITIVE));
        let is_left = l.squared_m2.total_cmp(&r.squared_m2).then(l.pieces.cmp(&r.pieces)).is_ge();
        if is_left { left } else { right }
    }

    /// Closest approach of a manoeuvre that is flown forever. The search stops at a point nearer than `least_m2`.
    fn for_good(&self, own: &Motion, command: Command, sides: &[Side], least_m2: f64) -> Closest {
        let sense = if command.turn_rate_rad_s < 0.0 { -1.0 } else { 1.0 };
        let continued = |motion: &Motion| motion.continued(command, &self.limits);
        let (end, mut closest) = flown(&self.settling, own, continued, sides, least_m2);
        if closest.squared_m2 < least_m2 {
            return closest;
        }
        let circle_m = end.circle_over_ground_m(&self.limits);
        let end = end.state;
        let (radius_m, lean_rad) = circle_m.map_or_else(
            || circle(&self.limits.uav, end.speed_m_s, end.turn_rate_rad_s.abs(), self.period.piece_s),
            |circle_m| (circle_m, 0.0),
        );
        let to_centre = end.heading + Angle::from_rad(sense * (0.5 * PI - lean_rad));
        let centre = end.position + Displacement::from_polar(radius_m, to_centre);
        for side in sides {
            let nearest_m = squared_to_side_m2(centre, side.from, side.to).sqrt();
            let furthest_m = centre.distance_m(side.from).max(centre.distance_m(side.to));
            let apart_m = (nearest_m - radius_m).max(radius_m - furthest_m).max(0.0);
            closest.note(apart_m * apart_m, side.zone, self.settling.count);
        }
        closest
    }

    /// Command that leaves the forbidden zones soonest, by a hard turn followed by straight flight.
    fn exit_command(&self, own: &Motion) -> Command {
        let speed_m_s = self.limits.uav.speed_max_m_s();
        let turn_max = self.limits.uav.turn_rate_max_rad_s;
        let straight_on = Command { speed_m_s, turn_rate_rad_s: 0.0 };
        let mut soonest = (f64::INFINITY, straight_on);
        let piece_s = (0.1 / turn_max).max(1e-2);
        let response = self.limits.uav.response(Duration::from_s(piece_s));
        let pieces = (TAU / 0.1 + self.settling.piece_s * f64::from(self.settling.count) / piece_s).min(500.0) as u32;
        for sense in [1.0, -1.0] {
            let turn = Command { speed_m_s, turn_rate_rad_s: sense * turn_max };
            let mut motion = *own;
            for piece in 0..=pieces {
                let after_s = f64::from(piece) * piece_s;
                let out_s = after_s + self.exit_distance_m(&motion.state) / speed_m_s;
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

    /// Distance straight ahead to the exit from all zones that forbid the position, m.
    fn exit_distance_m(&self, state: &UavState) -> f64 {
        let ahead = Displacement::from_polar(1.0, state.heading);
        let mut furthest_m = 0.0;
        for zone in self.geofence().violated_zones(state.position) {
            let sides = self.geofence().sides().filter(|side| side.zone == zone);
            let exit_m =
                sides.filter_map(|side| crossed_at(state.position, ahead, &side)).fold(f64::INFINITY, f64::min);
            furthest_m = f64::max(furthest_m, exit_m);
        }
        furthest_m
    }
}

/// Radius of the circle that a UAV flies with a constant turn rate, m, and how far its heading leans out of the tangent,
/// rad. Euler steps of `step_s` form a polygon; its corners are on the circle.
fn circle(uav: &UavParams, speed_m_s: f64, turn_rate_rad_s: f64, step_s: f64) -> (f64, f64) {
    match uav.integrator {
        Integrator::Exact => (speed_m_s / turn_rate_rad_s, 0.0),
        Integrator::Euler => {
            let lean_rad = (0.5 * turn_rate_rad_s * step_s).clamp(1e-6, 1.5);
            (0.5 * speed_m_s * step_s / math::sin(lean_rad), lean_rad)
        }
    }
}

/// Radius of the free circle that a UAV needs to fly its escape manoeuvre from the nominal speed forever, clear of every
/// outline, m.
pub(crate) fn required_room_m(uav: &UavParams, period_s: f64) -> f64 {
    let (period, settling) = pieces(uav, period_s);
    let speed_m_s = uav.escape_speed_m_s(uav.speed_m_s);
    let (radius_m, _) = circle(uav, speed_m_s, uav.turn_rate_max_at_rad_s(speed_m_s), period.piece_s);
    radius_m + margin_m(uav.speed_max_m_s(), uav.turn_rate_max_rad_s, &[&period, &settling])
}

/// One period, and the time until a manoeuvre is a circle.
fn pieces(uav: &UavParams, period_s: f64) -> (Pieces, Pieces) {
    let turn_max = uav.turn_rate_max_rad_s;
    let pieces = |time_s: f64| (time_s * turn_max / TURN_STEP_RAD).ceil().clamp(1.0, 200.0) as u32;
    match uav.integrator {
        Integrator::Exact => {
            let settled_s = uav.settling_s(SETTLED_LAGS);
            (Pieces::of(period_s, pieces(period_s), uav), Pieces::of(settled_s, pieces(settled_s), uav))
        }
        // Whole periods, with straight flight in each.
        Integrator::Euler => {
            let lag_s = uav.speed_lag_s.max(uav.turn_rate_lag_s);
            let periods = (3.0 * SETTLED_LAGS * lag_s / period_s).ceil().clamp(1.0, 200.0);
            (Pieces::of(period_s, 1, uav), Pieces::of(periods * period_s, periods as u32, uav))
        }
    }
}

/// Clearance of path points from outlines, m, that covers the deviation of the path between two points.
fn margin_m(speed_m_s: f64, turn_rate_rad_s: f64, paths: &[&Pieces]) -> f64 {
    let sagitta_m = |path: &&Pieces| speed_m_s * path.piece_s * turn_rate_rad_s * path.piece_s / 8.0;
    MARGIN_M + paths.iter().map(sagitta_m).fold(0.0, f64::max)
}

/// State after holding a command, and its closest approach to the sides. Stops at a point nearer than `least_m2`.
fn flown(
    pieces: &Pieces,
    from: &Motion,
    command: impl Fn(&Motion) -> Command,
    sides: &[Side],
    least_m2: f64,
) -> (Motion, Closest) {
    let (mut motion, mut closest) = (*from, Closest::NOWHERE);
    for piece in 0..pieces.count {
        let next = pieces.response.advance(&motion, command(&motion));
        for side in sides {
            let squared_m2 = squared_between_m2((motion.state.position, next.state.position), (side.from, side.to));
            closest.note(squared_m2, side.zone, piece);
        }
        motion = next;
        if closest.squared_m2 < least_m2 {
            break;
        }
    }
    (motion, closest)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::frame::Position;
    use crate::guidance::geofence::{Zone, ZoneKind};
    use crate::params::{BankParams, TeamParams};
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
        let geofence = drawn_geofence(&mut drawn, 2.0 * 40.0 / 0.3);
        let geofence_safety = GeofenceSafety::new(geofence, params.ground_limits(), params.log.period_s);
        let Some(state) = (0..20).map(|_| drawn_state(&mut drawn)).find(|state| geofence_safety.is_safe(state)) else {
            return;
        };
        let mut motion = Motion::steady(&params.uav, &state);
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
                desired = Command { speed_m_s, turn_rate_rad_s };
                goal = (drawn.below(2) == 0).then(|| corners[drawn.below(corners.len())]);
            }
            if let Some(goal) = goal {
                let error_rad = ((goal - motion.state.position).direction() - motion.state.heading).rad();
                desired.turn_rate_rad_s = error_rad.clamp(-0.3, 0.3);
            }
            let (command, _) = geofence_safety.make_safe(&motion, desired);
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
        let geofence_safety = GeofenceSafety::new(geofence, TeamParams::paper().ground_limits(), 0.5);
        let desired = Command { speed_m_s: 41.25, turn_rate_rad_s: 0.012_345 };
        assert_eq!(geofence_safety.make_safe(&steady(east(0.0, 0.0)), desired), (desired, None));
        // The radius of the tightest circle is 83 m, so at 110 m from the zone the UAV cannot continue.
        let (command, zone) = geofence_safety.make_safe(&steady(east(290.0, 0.0)), desired);
        assert!(zone == Some(1) && command.turn_rate_rad_s.abs() > 0.1, "{command:?}");
    }

    #[test]
    fn a_uav_inside_a_keep_out_zone_leaves_it_on_the_fastest_path() {
        let geofence = Geofence::new(vec![square(0.0, 0.0, 400.0)]).unwrap();
        let geofence_safety = GeofenceSafety::new(geofence, TeamParams::paper().ground_limits(), 0.5);
        // Straight ahead the exit is 100 m away; behind, it is a turn and 700 m.
        let straight_on = Command { speed_m_s: 55.0, turn_rate_rad_s: 0.0 };
        assert_eq!(geofence_safety.make_safe(&steady(east(300.0, 0.0)), straight_on), (straight_on, Some(0)));
        // To the north the exit is 50 m away: a quarter turn with a radius of 133 m is shorter than 700 m.
        let (command, _) = geofence_safety.make_safe(&steady(east(-300.0, 350.0)), straight_on);
        assert_eq!(command.turn_rate_rad_s, 0.3);
        let response = TeamParams::paper().uav.response(Duration::from_s(0.5));
        let mut state = east(-300.0, 350.0);
        let inside = (0..40).take_while(|_| {
            state = response.step(&state, geofence_safety.make_safe(&steady(state), straight_on).0);
            !geofence_safety.geofence().contains(state.position)
        });
        assert!(inside.count() < 8);
    }
}
