//! UAVs kept out of zones and in them: by which commands may be flown at all, and by ways around what is in the way.
//!
//! A state is *safe* if from it one of two manoeuvres, the hardest turn to the left or to the right at the lowest speed, stays
//! clear of every outline for good: they end in circles, which can be flown for ever. A command is *allowed* if holding it for
//! a period, by the exact answer of the UAV with its lags, stays clear and ends in a safe state. An allowed command is flown;
//! else the allowed one nearest to it; and where there is none, the manoeuvre that keeps furthest from all outlines, which
//! from a safe state is one that stays clear. So whoever is in a safe state is in one at the next instant: a UAV that begins
//! safe, and flies as it is told, never crosses an outline. Loiter circles as what is always left to do are those of
//! T. Schouwenaars, J. How and E. Feron, *Receding Horizon Path Planning with Implicit Safety Guarantees*, American Control
//! Conference 2004.
//!
//! That alone would turn away at the last moment and again and again. So what is wanted is looked at further ahead, too
//! ([`Ways`](crate::guidance::ways)): where the way onto an orbit, or the orbit itself, goes through a zone, the UAV flies the
//! shortest way around it to where its orbit is free again.

use crate::frame::Displacement;
use crate::guidance::airspace::{Airspace, Side, crossed_at, squared_between_m2, squared_to_side_m2};
use crate::guidance::alternatives::Costs;
use crate::guidance::ways::Ways;
use crate::math::{PI, TAU};
use crate::time::Duration;
use crate::uav::{Command, Integrator, Response, UavParams, UavState};
use crate::{Angle, math};

/// Outlines are kept from by so much, m: more than an arc lies off its chord between two instants of a record.
const MARGIN_M: f64 = 5.0;

/// Further than so between two places of a path nothing turns, rad.
const TURN_STEP_RAD: f64 = 0.08;

/// After so many lags a manoeuvre is a circle.
const SETTLED_LAGS: f64 = 8.0;

/// What it costs to fly something else.
const COSTS: Costs = Costs { speed: 0.3, turn: 0.1 };

/// What keeps a UAV within its airspace.
#[derive(Debug, Clone)]
pub(crate) struct Borders {
    /// Ways around what is in the way.
    pub(crate) ways: Ways,
    uav: UavParams,
    /// A period, in pieces.
    period: Pieces,
    /// Until a manoeuvre is a circle, in pieces.
    settling: Pieces,
    /// How far off outlines paths are kept, m: what lies between two places of a path included.
    margin_m: f64,
    /// Nothing further away matters now, m.
    reach_m: f64,
}

/// A time in equal pieces.
#[derive(Debug, Clone)]
struct Pieces {
    response: Response,
    count: u32,
    piece_s: f64,
}

impl Pieces {
    fn of(time_s: f64, count: u32, uav: &UavParams) -> Self {
        let piece_s = time_s / f64::from(count);
        Self { response: uav.response(Duration::from_s(piece_s)), count, piece_s }
    }
}

/// How near a path comes to outlines.
#[derive(Debug, Clone, Copy)]
struct Closest {
    squared_m2: f64,
    /// The zone there.
    zone: usize,
    /// So long it flies until then, in pieces.
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

impl Airspace {
    /// A UAV that is there can stay where it may be: one of its two hardest turns, at the lowest speed, keeps clear of every
    /// outline. From there [`Agent`](crate::Agent) keeps it so, commanding it every `period`.
    pub fn has_way_out(&self, uav: &UavParams, period: Duration, own: &UavState) -> bool {
        Borders::new(self.clone(), *uav, period.s()).is_safe(own)
    }
}

impl Borders {
    pub(crate) fn new(airspace: Airspace, uav: UavParams, period_s: f64) -> Self {
        let turn_max = uav.turn_rate_max_rad_s;
        let pieces = |time_s: f64| (time_s * turn_max / TURN_STEP_RAD).ceil().clamp(1.0, 200.0) as u32;
        let lag_s = uav.speed_lag_s.max(uav.turn_rate_lag_s);
        let (period, settling) = match uav.integrator {
            Integrator::Exact => {
                let settled_s = SETTLED_LAGS * lag_s;
                (Pieces::of(period_s, pieces(period_s), &uav), Pieces::of(settled_s, pieces(settled_s), &uav))
            }
            // Whole periods, straight on in each.
            Integrator::Euler => {
                let periods = (3.0 * SETTLED_LAGS * lag_s / period_s).ceil().clamp(1.0, 200.0);
                (Pieces::of(period_s, 1, &uav), Pieces::of(periods * period_s, periods as u32, &uav))
            }
        };
        let sagitta_m = |piece_s: f64| uav.speed_max_m_s() * piece_s * turn_max * piece_s / 8.0;
        let settled_s = settling.piece_s * f64::from(settling.count);
        let circle_m = 2.0 * uav.speed_max_m_s() / turn_max;
        Self {
            ways: Ways::of(airspace, uav),
            margin_m: MARGIN_M + sagitta_m(period.piece_s).max(sagitta_m(settling.piece_s)),
            reach_m: uav.speed_max_m_s() * (period_s + settled_s) + circle_m + 2.0 * MARGIN_M,
            uav,
            period,
            settling,
        }
    }

    pub(crate) fn airspace(&self) -> &Airspace {
        &self.ways.airspace
    }

    /// What to fly in the place of a command that is within the limits, and the zone because of which that is another one.
    pub(crate) fn keep(&self, own: &UavState, wanted: Command) -> (Command, Option<usize>) {
        if let Some(zone) = self.airspace().forbidding(own.position).next() {
            return (self.way_out(own), Some(zone));
        }
        let sides = self.sides_near(own);
        let Some(zone) = self.refused(own, wanted, &sides) else { return (wanted, None) };
        let mut commands =
            COSTS.alternatives(&self.uav, own.turn_rate_rad_s, wanted).into_iter().map(|(_, command)| command);
        let allowed = commands.find(|command| self.refused(own, *command, &sides).is_none());
        (allowed.unwrap_or_else(|| self.manoeuvre(own, &sides)), Some(zone))
    }

    /// A command that is within the limits may be flown.
    pub(crate) fn allows(&self, own: &UavState, command: Command) -> bool {
        let sides = self.sides_near(own);
        self.airspace().allows(own.position) && self.refused(own, command, &sides).is_none()
    }

    /// From a state that is allowed there is a manoeuvre that stays so for good.
    pub(crate) fn is_safe(&self, own: &UavState) -> bool {
        let sides = self.sides_near(own);
        self.airspace().allows(own.position) && self.unsafe_for(own, &sides).is_none()
    }

    /// Every side that matters now.
    fn sides_near(&self, own: &UavState) -> Vec<Side> {
        self.airspace().sides_near(own.position, self.reach_m).collect()
    }

    /// The zone because of which a command may not be flown.
    fn refused(&self, own: &UavState, command: Command, sides: &[Side]) -> Option<usize> {
        if sides.is_empty() {
            return None;
        }
        let least_m2 = self.margin_m * self.margin_m;
        let (end, closest) = flown(&self.period, own, command, sides, least_m2);
        if closest.squared_m2 < least_m2 { Some(closest.zone) } else { self.unsafe_for(&end, sides) }
    }

    /// The zone because of which neither manoeuvre stays clear.
    fn unsafe_for(&self, own: &UavState, sides: &[Side]) -> Option<usize> {
        let least_m2 = self.margin_m * self.margin_m;
        let [left, right] = self.manoeuvres();
        let closest = self.for_good(own, left, sides, least_m2);
        let is_near = closest.squared_m2 < least_m2;
        (is_near && self.for_good(own, right, sides, least_m2).squared_m2 < least_m2).then_some(closest.zone)
    }

    fn manoeuvres(&self) -> [Command; 2] {
        let speed_m_s = self.uav.speed_m_s - self.uav.speed_change_max_m_s;
        [1.0, -1.0].map(|sense| Command { speed_m_s, turn_rate_rad_s: sense * self.uav.turn_rate_max_rad_s })
    }

    /// The manoeuvre that keeps furthest away; of two that do not keep away, that which does for longer.
    fn manoeuvre(&self, own: &UavState, sides: &[Side]) -> Command {
        let [left, right] = self.manoeuvres();
        let [l, r] = [left, right].map(|command| self.for_good(own, command, sides, f64::MIN_POSITIVE));
        let is_left = l.squared_m2.total_cmp(&r.squared_m2).then(l.pieces.cmp(&r.pieces)).is_ge();
        if is_left { left } else { right }
    }

    /// How near a manoeuvre comes if it is flown for ever; nearer than the least nobody looks any further.
    fn for_good(&self, own: &UavState, command: Command, sides: &[Side], least_m2: f64) -> Closest {
        let (end, mut closest) = flown(&self.settling, own, command, sides, least_m2);
        if closest.squared_m2 < least_m2 {
            return closest;
        }
        let sense = if command.turn_rate_rad_s < 0.0 { -1.0 } else { 1.0 };
        // An Euler step flies the sides of a polygon, of which the circle has the corners.
        let (radius_m, lean_rad) = match self.uav.integrator {
            Integrator::Exact => (end.speed_m_s / end.turn_rate_rad_s.abs(), 0.0),
            Integrator::Euler => {
                let lean_rad = (0.5 * end.turn_rate_rad_s.abs() * self.period.piece_s).clamp(1e-6, 1.5);
                (0.5 * end.speed_m_s * self.period.piece_s / math::sin(lean_rad), lean_rad)
            }
        };
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

    /// Where it may not be: the command with which it is out soonest, by a hard turn and then straight on.
    fn way_out(&self, own: &UavState) -> Command {
        let speed_m_s = self.uav.speed_max_m_s();
        let turn_max = self.uav.turn_rate_max_rad_s;
        let straight_on = Command { speed_m_s, turn_rate_rad_s: 0.0 };
        let mut soonest = (f64::INFINITY, straight_on);
        let piece_s = (0.1 / turn_max).max(1e-2);
        let response = self.uav.response(Duration::from_s(piece_s));
        let pieces = (TAU / 0.1 + self.settling.piece_s * f64::from(self.settling.count) / piece_s).min(500.0) as u32;
        for sense in [1.0, -1.0] {
            let turn = Command { speed_m_s, turn_rate_rad_s: sense * turn_max };
            let mut state = *own;
            for piece in 0..=pieces {
                let after_s = f64::from(piece) * piece_s;
                let out_s = after_s + self.out_in_m(&state) / speed_m_s;
                if out_s < soonest.0 {
                    soonest = (out_s, if piece == 0 { straight_on } else { turn });
                }
                if after_s >= soonest.0 {
                    break;
                }
                state = response.step(&state, turn);
            }
        }
        soonest.1
    }

    /// How far it is straight on out of all zones in which it may not be, m.
    fn out_in_m(&self, state: &UavState) -> f64 {
        let ahead = Displacement::from_polar(1.0, state.heading);
        let mut far_m = 0.0;
        for zone in self.airspace().forbidding(state.position) {
            let sides = self.airspace().sides().filter(|side| side.zone == zone);
            let out_m = sides.filter_map(|side| crossed_at(state.position, ahead, &side)).fold(f64::INFINITY, f64::min);
            far_m = f64::max(far_m, out_m);
        }
        far_m
    }
}

/// The state after holding a command, and how near to sides it came; nearer than the least it is not flown on.
fn flown(pieces: &Pieces, own: &UavState, command: Command, sides: &[Side], least_m2: f64) -> (UavState, Closest) {
    let (mut state, mut closest) = (*own, Closest::NOWHERE);
    for piece in 0..pieces.count {
        let next = pieces.response.step(&state, command);
        for side in sides {
            let squared_m2 = squared_between_m2((state.position, next.position), (side.from, side.to));
            closest.note(squared_m2, side.zone, piece);
        }
        state = next;
        if closest.squared_m2 < least_m2 {
            break;
        }
    }
    (state, closest)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::frame::Position;
    use crate::guidance::airspace::{Zone, ZoneKind};
    use crate::team::TeamParams;
    use proptest::prelude::*;

    /// Numbers from a seed (splitmix64).
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

    /// A star, an L or a U about a place, no further from it than so much; turned at random.
    pub(crate) fn shape(drawn: &mut Drawn, centre: Position, size_m: f64) -> Vec<Position> {
        let turned = Angle::from_rad(drawn.between(-PI, PI));
        let at = |(x, y): (f64, f64)| {
            let (far, direction) = (math::hypot(x, y), Displacement::from_m(x, y).direction());
            centre + Displacement::from_polar(far * size_m, direction + turned)
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

    /// Zones at least so far apart, some of them within a keep-in.
    pub(crate) fn drawn_airspace(drawn: &mut Drawn, apart_m: f64) -> Airspace {
        let mut zones: Vec<Zone> = Vec::new();
        let mut taken: Vec<(Position, f64)> = Vec::new();
        for _ in 0..1 + drawn.below(5) {
            let size_m = drawn.between(30.0, 500.0);
            let centre = Position::from_m(drawn.between(-900.0, 900.0), drawn.between(-900.0, 900.0));
            if taken.iter().all(|(other, its_m)| other.distance_m(centre) > its_m + size_m + apart_m) {
                taken.push((centre, size_m));
                let outline = shape(drawn, centre, size_m);
                zones.push(Zone { name: String::new(), kind: ZoneKind::KeepOut, outline });
            }
        }
        if drawn.below(3) == 0 {
            let furthest_m = taken.iter().map(|(at, size_m)| at.distance_m(Position::ORIGIN) + size_m);
            let far_m = (furthest_m.fold(300.0, f64::max) + apart_m) * 1.5;
            let corners = [(-far_m, -far_m), (far_m, -far_m), (far_m, far_m), (-far_m, far_m)];
            let outline = corners.map(|(x_m, y_m)| Position::from_m(x_m, y_m)).into();
            zones.push(Zone { name: String::new(), kind: ZoneKind::KeepIn, outline });
        }
        Airspace::new(zones).unwrap_or_default()
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

    /// Whatever is wanted of a UAV that begins safe, every period anew, it is never where it may not be; not between instants
    /// either.
    fn stays_within(seed: u64, params: &TeamParams) {
        let mut drawn = Drawn(seed);
        let airspace = drawn_airspace(&mut drawn, 2.0 * 40.0 / 0.3);
        let borders = Borders::new(airspace, params.uav, params.log.period_s);
        let Some(mut state) = (0..20).map(|_| drawn_state(&mut drawn)).find(|state| borders.is_safe(state)) else {
            return;
        };
        let pieces = if params.uav.integrator == Integrator::Euler { 1 } else { 5 };
        let response = params.uav.response(Duration::from_s(params.log.period_s / f64::from(pieces)));
        // Whims of a few seconds; or straight at a zone; or whatever.
        let (mut wanted, mut until) = (Command { speed_m_s: 40.0, turn_rate_rad_s: 0.0 }, 0);
        let corners: Vec<Position> =
            borders.airspace().zones().flat_map(|zone| zone.outline.clone()).chain([Position::ORIGIN]).collect();
        let mut goal = None;
        for step in 0..60 {
            if step >= until {
                until = step + 1 + drawn.below(20);
                let (speed_m_s, turn_rate_rad_s) = (drawn.between(25.0, 55.0), drawn.between(-0.3, 0.3));
                wanted = Command { speed_m_s, turn_rate_rad_s };
                goal = (drawn.below(2) == 0).then(|| corners[drawn.below(corners.len())]);
            }
            if let Some(goal) = goal {
                let error_rad = ((goal - state.position).direction() - state.heading).rad();
                wanted.turn_rate_rad_s = error_rad.clamp(-0.3, 0.3);
            }
            let (command, _) = borders.keep(&state, wanted);
            assert_eq!(params.uav.limit(command).command, command, "inside the limits");
            for _ in 0..pieces {
                state = response.step(&state, command);
                let forbidding = borders.airspace().forbidding(state.position).next();
                assert_eq!(forbidding, None, "seed {seed}, step {step}: {state:?}");
            }
        }
    }

    proptest! {
        #[test]
        fn whoever_begins_safe_stays_within_its_airspace(seed in any::<u64>()) {
            stays_within(seed, &TeamParams::table_1());
        }

        #[test]
        fn so_does_whoever_is_slow_to_answer_or_flies_by_euler_steps(seed in any::<u64>()) {
            let mut params = TeamParams::table_1();
            (params.uav.speed_lag_s, params.uav.turn_rate_lag_s) = (0.6, 1.5);
            stays_within(seed, &params);
            params.uav.integrator = Integrator::Euler;
            stays_within(seed, &params);
        }
    }

    fn square(x_m: f64, y_m: f64, half_m: f64) -> Zone {
        let outline = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
            .map(|(x, y)| Position::from_m(x_m + x * half_m, y_m + y * half_m));
        Zone { name: String::new(), kind: ZoneKind::KeepOut, outline: outline.into() }
    }

    fn east(x_m: f64, y_m: f64) -> UavState {
        UavState::straight(Position::from_m(x_m, y_m), Angle::ZERO, 40.0)
    }

    #[test]
    fn what_is_allowed_is_flown_to_the_bit_and_what_is_not_is_told() {
        let airspace = Airspace::new(vec![square(-5000.0, 0.0, 10.0), square(600.0, 0.0, 200.0)]).unwrap();
        let borders = Borders::new(airspace, TeamParams::table_1().uav, 0.5);
        let wanted = Command { speed_m_s: 41.25, turn_rate_rad_s: 0.012_345 };
        assert_eq!(borders.keep(&east(0.0, 0.0), wanted), (wanted, None));
        // 83 m are the radius of the tightest circle; at 100 m it is too late for going on.
        let (command, zone) = borders.keep(&east(290.0, 0.0), wanted);
        assert!(zone == Some(1) && command.turn_rate_rad_s.abs() > 0.1, "{command:?}");
    }

    #[test]
    fn a_uav_inside_a_keep_out_leaves_it_soonest() {
        let airspace = Airspace::new(vec![square(0.0, 0.0, 400.0)]).unwrap();
        let borders = Borders::new(airspace, TeamParams::table_1().uav, 0.5);
        // Straight on it is 100 m; back, a turn and 700 m.
        let straight_on = Command { speed_m_s: 55.0, turn_rate_rad_s: 0.0 };
        assert_eq!(borders.keep(&east(300.0, 0.0), straight_on), (straight_on, Some(0)));
        // To the north it is 50 m: a quarter turn with 133 m of radius is shorter than 700 m.
        let (command, _) = borders.keep(&east(-300.0, 350.0), straight_on);
        assert_eq!(command.turn_rate_rad_s, 0.3);
        let response = TeamParams::table_1().uav.response(Duration::from_s(0.5));
        let mut state = east(-300.0, 350.0);
        let inside = (0..40).take_while(|_| {
            state = response.step(&state, borders.keep(&state, straight_on).0);
            !borders.airspace().allows(state.position)
        });
        assert!(inside.count() < 8);
    }
}
