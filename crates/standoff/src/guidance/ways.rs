//! Ways around zones: where an orbit, or the way onto it, is barred, the shortest way to where it is free again.
//!
//! What the guidance law would fly is foretold as if there were no zones. If that meets an outline soon, or on the way onto the
//! orbit at all, the UAV heads for the place where it is free again: straight, or by the corners that stand in between. So
//! orbits are flown in part, flattened along an outline; where nothing of one is free, a wider one is flown, as far as the
//! sensor reaches; and where there is none either, the UAV stays as near to the centre as it can.

use crate::angle::Angle;
use crate::frame::{Displacement, Position};
use crate::guidance::airspace::{
    Airspace, Side, ZoneKind, cross, nearest_on_side, squared_between_m2, squared_to_side_m2,
};
use crate::guidance::heading::{GuidanceParams, OnOrbit, Orbit};
use crate::math;
use crate::uav::{Command, UavParams, UavState};

/// Corners are passed at this distance, m.
const PASSING_M: f64 = 40.0;

/// A place to turn at for every so much of a corner, rad: further, and the way between two would cut the corner.
const CORNER_STEP_RAD: f64 = 1.0;

/// A way keeps at least so far off outlines, m, where it does not begin nearer.
const CLEAR_M: f64 = 15.0;

/// Where a way ends there is so much room, m.
const FREE_M: f64 = 25.0;

/// Most places to turn at. Of more, every so-many-th is left out.
const PLACES_MAX: usize = 400;

/// On an orbit, what is barred later than in so long is of no account yet, s: a quarter of a turn, and some.
const SOON_S: f64 = 8.0;

/// What is foretold goes on in such steps, s, and for no more of them.
const STEP_S: f64 = 1.0;
const STEPS_MAX: u32 = 400;

/// For so long a centre is believed to go on as it moves, s.
const CARRIED_ON_S: f64 = 20.0;

/// Places of an orbit to which there is no way, after which nobody looks further.
const CUT_OFF_MAX: u32 = 4;

/// Wider orbits that are tried, in radii.
const WIDER: [f64; 4] = [1.25, 1.5, 1.8, 2.2];

/// Places to turn at, and which of them see each other.
#[derive(Debug, Clone)]
pub(crate) struct Ways {
    pub(crate) airspace: Airspace,
    uav: UavParams,
    sides: Vec<Side>,
    places: Vec<Position>,
    /// By place, the others that it sees, and how far they are, m.
    next: Vec<Vec<(usize, f64)>>,
}

/// What is to be flown in the place of what is barred.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Detour {
    pub(crate) command: Command,
    /// The zone that is in the way.
    pub(crate) zone: usize,
}

/// What comes of an orbit that is flown as if there were no zones.
enum Ahead {
    Clear,
    /// A zone bars it, and here it is free again, if that is anywhere.
    Barred(usize, Option<Position>),
}

impl Ways {
    pub(crate) fn of(airspace: Airspace, uav: UavParams) -> Self {
        let sides: Vec<Side> = airspace.sides().collect();
        let mut places = Vec::new();
        for zone in airspace.zones() {
            // The free side is to the right of an outline that is followed so.
            let is_anticlockwise = zone.twice_area_m2() > 0.0;
            let mut outline = zone.outline.clone();
            if is_anticlockwise != (zone.kind == ZoneKind::KeepOut) {
                outline.reverse();
            }
            let corners = outline.len();
            for (place, at) in outline.iter().enumerate() {
                let (before, after) = (outline[(place + corners - 1) % corners], outline[(place + 1) % corners]);
                let (into, out) = ((*at - before).direction(), (after - *at).direction());
                let turn_rad = (out - into).rad();
                if turn_rad <= 0.0 {
                    // It does not stand out.
                    continue;
                }
                let count = (turn_rad / CORNER_STEP_RAD).ceil().max(1.0);
                for nth in 0..count as u32 {
                    let share = (f64::from(nth) + 0.5) / count;
                    let outward = into + Angle::from_rad(share * turn_rad - 0.5 * math::PI);
                    places.push(*at + Displacement::from_polar(PASSING_M, outward));
                }
            }
        }
        places.retain(|at| airspace.allows(*at) && clearance_m2(*at, &sides) >= CLEAR_M * CLEAR_M);
        let every = places.len().div_ceil(PLACES_MAX).max(1);
        let places: Vec<Position> = places.into_iter().step_by(every).collect();
        let mut next = vec![Vec::new(); places.len()];
        for (one, from) in places.iter().enumerate() {
            for (other, to) in places.iter().enumerate().skip(one + 1) {
                if is_clear(*from, *to, &sides, CLEAR_M) {
                    let far_m = from.distance_m(*to);
                    next[one].push((other, far_m));
                    next[other].push((one, far_m));
                }
            }
        }
        Self { airspace, uav, sides, places, next }
    }

    /// Where to head for first, on the shortest way; `None`: there is none.
    fn first(&self, from: Position, to: Position) -> Option<Position> {
        let sides = &self.sides[..];
        // Who is near an outline already gets no nearer.
        let room_m = (0.9 * clearance_m2(from, sides).sqrt()).min(CLEAR_M);
        if is_clear(from, to, sides, room_m) {
            return Some(to);
        }
        // Dijkstra's, from the end, so that what is found is the first step.
        let count = self.places.len();
        let mut far_m = vec![f64::INFINITY; count];
        let mut is_done = vec![false; count];
        for (place, at) in self.places.iter().enumerate() {
            if is_clear(*at, to, sides, CLEAR_M) {
                far_m[place] = at.distance_m(to);
            }
        }
        let mut best: (f64, Option<Position>) = (f64::INFINITY, None);
        loop {
            let open = (0..count).filter(|place| !is_done[*place] && far_m[*place] < best.0);
            let Some(place) = open.min_by(|a, b| far_m[*a].total_cmp(&far_m[*b])) else { break };
            is_done[place] = true;
            let at = self.places[place];
            let whole_m = far_m[place] + from.distance_m(at);
            if whole_m < best.0 && is_clear(from, at, sides, room_m) {
                best = (whole_m, Some(at));
            }
            for (other, way_m) in &self.next[place] {
                far_m[*other] = far_m[*other].min(far_m[place] + way_m);
            }
        }
        best.1
    }
}

impl Ways {
    /// What to fly in the place of an orbit that is barred, soon or on the way onto it; `None`: it is not. Its radius may be
    /// as large as `largest_m`.
    pub(crate) fn around(
        &self,
        guidance: &GuidanceParams,
        own: &UavState,
        orbit: &Orbit,
        speed_m_s: f64,
        largest_m: f64,
    ) -> Option<Detour> {
        let centre_m = own.position.distance_m(orbit.centre);
        let radius_m = orbit.steered.radius_m.max(orbit.distance_m);
        let drift_m = orbit.centre_velocity.speed_m_s() * CARRIED_ON_S;
        let reach_m = centre_m.max(2.5 * radius_m) + drift_m + FREE_M + self.circle_m();
        let sides: Vec<Side> = self.airspace.sides_near(orbit.centre, reach_m).collect();
        if sides.is_empty() || self.airspace.forbidding(own.position).next().is_some() {
            return None;
        }
        let Ahead::Barred(zone, free) = self.ahead(guidance, own, orbit, speed_m_s, &sides) else { return None };
        if let Some(to) = free {
            return Some(Detour { command: self.towards(own, to, speed_m_s), zone });
        }
        for wider in WIDER.iter().map(|wider| wider * orbit.distance_m).filter(|radius_m| *radius_m <= largest_m) {
            let mut orbit = *orbit;
            (orbit.distance_m, orbit.steered.radius_m) = (wider, wider);
            let command = match self.ahead(guidance, own, &orbit, speed_m_s, &sides) {
                Ahead::Clear => {
                    let steering = OnOrbit::of(guidance, own.position, &orbit).steer(guidance, own, speed_m_s);
                    Command { speed_m_s, turn_rate_rad_s: steering.turn_rate_rad_s }
                }
                Ahead::Barred(_, Some(to)) => self.towards(own, to, speed_m_s),
                Ahead::Barred(_, None) => continue,
            };
            return Some(Detour { command, zone });
        }
        // Nothing of it is free: as near to the centre as can be.
        let off_m = 0.5 * self.circle_m();
        let free = sides.iter().filter_map(|side| {
            let nearest = nearest_on_side(orbit.centre, side.from, side.to);
            let outward = (nearest - orbit.centre).direction();
            let across = (side.to - side.from).direction() + Angle::from_rad(0.5 * math::PI);
            let tried = [outward, across, across + Angle::from_rad(math::PI)];
            let tried = tried.map(|outward| nearest + Displacement::from_polar(off_m, outward));
            tried.into_iter().find(|at| self.is_free(*at, &sides))
        });
        let free = free.filter(|at| self.first(own.position, *at).is_some());
        let nearest = free.min_by(|a, b| {
            let far_m2 = |at: &Position| at.squared_distance_m2(orbit.centre);
            far_m2(a).total_cmp(&far_m2(b))
        });
        nearest.map(|to| Detour { command: self.towards(own, to, speed_m_s), zone })
    }

    fn is_free(&self, at: Position, sides: &[Side]) -> bool {
        clearance_m2(at, sides) >= FREE_M * FREE_M && self.airspace.allows(at)
    }

    /// What becomes of a UAV that flies an orbit as if there were no zones.
    fn ahead(&self, guidance: &GuidanceParams, own: &UavState, orbit: &Orbit, speed_m_s: f64, sides: &[Side]) -> Ahead {
        let turn_max_rad = self.uav.turn_rate_max_rad_s * STEP_S;
        let mut state = UavState { speed_m_s, ..*own };
        let (mut barred, mut is_there, mut cut_off) = (None, false, 0);
        // Once round, from where it is there.
        let mut rest_s = math::TAU * orbit.distance_m / speed_m_s;
        for step in 0..STEPS_MAX {
            let after_s = f64::from(step) * STEP_S;
            let moved = orbit.centre_velocity * after_s.min(CARRIED_ON_S);
            let orbit = Orbit { centre: orbit.centre + moved, ..*orbit };
            let on_orbit = OnOrbit::of(guidance, state.position, &orbit);
            is_there |= on_orbit.centre_distance_m() < 1.2 * orbit.distance_m;
            if is_there {
                rest_s -= STEP_S;
            }
            if barred.is_none() && is_there && after_s >= SOON_S {
                return Ahead::Clear;
            }
            if rest_s < 0.0 {
                break;
            }
            let wanted = on_orbit.steer(guidance, &state, speed_m_s).desired_heading;
            let turn_rad = (wanted - state.heading).rad().clamp(-turn_max_rad, turn_max_rad);
            let along = state.heading + Angle::from_rad(0.5 * turn_rad);
            let next = state.position + Displacement::from_polar(speed_m_s * STEP_S, along);
            if barred.is_none() {
                let least_m2 = CLEAR_M.min(0.9 * clearance_m2(own.position, sides).sqrt()).max(1.0);
                let met = sides.iter().find(|side| {
                    squared_between_m2((state.position, next), (side.from, side.to)) < least_m2 * least_m2
                });
                barred = met.map(|side| side.zone);
            }
            (state.position, state.heading) = (next, state.heading + Angle::from_rad(turn_rad));
            // What lies within the circle that it would have to turn is not headed for; nor, on the way onto an orbit, what is
            // free before that, be it a pocket of the zone.
            let is_far = || own.position.squared_distance_m2(next) > self.circle_m() * self.circle_m();
            if let Some(zone) = barred
                && (is_there || step + 1 == STEPS_MAX)
                && is_far()
                && self.is_free(next, sides)
            {
                if self.first(own.position, next).is_some() {
                    return Ahead::Barred(zone, Some(next));
                }
                cut_off += 1;
                if cut_off >= CUT_OFF_MAX {
                    break;
                }
            }
        }
        barred.map_or(Ahead::Clear, |zone| Ahead::Barred(zone, None))
    }

    /// Turns to the first place on the way to somewhere.
    fn towards(&self, own: &UavState, to: Position, speed_m_s: f64) -> Command {
        let at = self.first(own.position, to).unwrap_or(to);
        let to_it = at - own.position;
        let error_rad = (to_it.direction() - own.heading).rad();
        // What lies beside a UAV, nearer than it can turn, is reached by turning slower.
        let is_beside = error_rad.abs() > 0.8 && to_it.length_m() < 2.0 * self.circle_m();
        let slowest_m_s = self.uav.speed_m_s - self.uav.speed_change_max_m_s;
        let speed_m_s = if is_beside { slowest_m_s.max(0.7 * self.uav.speed_m_s) } else { speed_m_s };
        Command { speed_m_s, turn_rate_rad_s: error_rad * TURN_GAIN_1_S }
    }

    /// Radius of the smallest circle at nominal speed, m.
    fn circle_m(&self) -> f64 {
        self.uav.speed_m_s / self.uav.turn_rate_max_rad_s
    }
}

/// Gain of the heading on a way around, 1/s.
const TURN_GAIN_1_S: f64 = 0.8;

fn clearance_m2(at: Position, sides: &[Side]) -> f64 {
    sides.iter().map(|side| squared_to_side_m2(at, side.from, side.to)).fold(f64::INFINITY, f64::min)
}

/// The straight way keeps off all sides. Its ends are where a UAV may be.
fn is_clear(from: Position, to: Position, sides: &[Side], room_m: f64) -> bool {
    let along = to - from;
    let reach_m2 = |side: &Side| {
        // Cheap, and mostly enough: both corners on one side of the way, and further than the room.
        let (a, b) = (cross(along, side.from - from), cross(along, side.to - from));
        (a * b > 0.0).then(|| a.abs().min(b.abs()))
    };
    let far_m2 = room_m * along.length_m();
    sides.iter().all(|side| {
        reach_m2(side).is_some_and(|off_m2| off_m2 > far_m2)
            || squared_between_m2((from, to), (side.from, side.to)) >= room_m * room_m
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Velocity;
    use crate::guidance::airspace::Zone;
    use crate::guidance::borders::Borders;
    use crate::guidance::standoff_distance::Ramp;
    use crate::team::TeamParams;
    use crate::time::Duration;

    fn zone(kind: ZoneKind, corners: &[(f64, f64)]) -> Zone {
        let outline = corners.iter().map(|(x_m, y_m)| Position::from_m(*x_m, *y_m)).collect();
        Zone { name: String::new(), kind, outline }
    }

    /// How a UAV flew that began in the west, heading east, to an orbit of 300 m about the origin.
    struct Flown {
        /// Of the second half of ten minutes: within 40 m of the orbit.
        on_orbit_fraction: f64,
        /// And within so much of the centre.
        furthest_m: f64,
        turned_back: usize,
    }

    fn fly(zones: Vec<Zone>, from: (f64, f64)) -> Flown {
        let params = TeamParams::table_1();
        let borders = Borders::new(Airspace::new(zones).unwrap(), params.uav, 0.5);
        let ramp = Ramp { radius_m: 300.0, rate_m_s: 0.0 };
        let orbit = Orbit {
            centre: Position::ORIGIN,
            centre_velocity: Velocity::ZERO,
            distance_m: 300.0,
            rate_m_s: 0.0,
            steered: ramp,
        };
        let response = params.uav.response(Duration::from_s(0.5));
        let position = Position::from_m(from.0, from.1);
        let mut state = UavState::straight(position, Angle::ZERO, 40.0);
        assert!(borders.is_safe(&state));
        let mut flown = Flown { on_orbit_fraction: 0.0, furthest_m: 0.0, turned_back: 0 };
        for step in 0..1200 {
            let wanted = OnOrbit::of(&params.guidance, state.position, &orbit).steer(&params.guidance, &state, 40.0);
            let wanted = Command { speed_m_s: 40.0, turn_rate_rad_s: wanted.turn_rate_rad_s };
            let around = borders.ways.around(&params.guidance, &state, &orbit, 40.0, 700.0);
            let wanted = params.uav.limit(around.map_or(wanted, |detour| detour.command)).command;
            let (command, _) = borders.keep(&state, wanted);
            state = response.step(&state, command);
            assert!(borders.airspace().allows(state.position), "step {step}: {state:?}");
            if step >= 600 {
                let far_m = state.position.distance_m(orbit.centre);
                flown.on_orbit_fraction += f64::from((far_m - 300.0).abs() < 40.0) / 600.0;
                flown.furthest_m = flown.furthest_m.max(far_m);
                flown.turned_back += usize::from(command.turn_rate_rad_s < -0.25);
            }
        }
        flown
    }

    #[test]
    fn without_a_zone_in_the_way_nothing_changes() {
        let far = zone(ZoneKind::KeepOut, &[(3000.0, 0.0), (3500.0, 0.0), (3000.0, 500.0)]);
        let flown = fly(vec![far], (-1500.0, 0.0));
        assert!(flown.on_orbit_fraction > 0.999, "{}", flown.on_orbit_fraction);
    }

    #[test]
    fn a_pocket_between_a_uav_and_its_orbit_is_left_again() {
        // A U that opens to the west, and an L; the UAV begins in the pocket, or before it.
        let u = [
            (-1400.0, -500.0),
            (-500.0, -500.0),
            (-500.0, 500.0),
            (-1400.0, 500.0),
            (-1400.0, 450.0),
            (-550.0, 450.0),
            (-550.0, -450.0),
            (-1400.0, -450.0),
        ];
        let l =
            [(-1400.0, 450.0), (-550.0, 450.0), (-550.0, -600.0), (-500.0, -600.0), (-500.0, 500.0), (-1400.0, 500.0)];
        for corners in [&u[..], &l[..]] {
            for from in [(-900.0, 100.0), (-2000.0, -50.0)] {
                let flown = fly(vec![zone(ZoneKind::KeepOut, corners)], from);
                assert!(flown.on_orbit_fraction > 0.95, "{from:?}: {}", flown.on_orbit_fraction);
            }
        }
    }

    #[test]
    fn an_orbit_that_is_cut_is_flown_in_part() {
        // Half of it, by a wall that is left to the north, and by a keep-in.
        let wall = [(-3000.0, 60.0), (3000.0, 60.0), (3000.0, 900.0), (-3000.0, 900.0)];
        let inside = [(-3000.0, -3000.0), (3000.0, -3000.0), (3000.0, 60.0), (-3000.0, 60.0)];
        // A corner that stands in, and a hut on the way.
        let corner = [(100.0, 100.0), (2000.0, 100.0), (2000.0, 2000.0), (100.0, 2000.0)];
        let hut = [(280.0, -20.0), (320.0, -20.0), (320.0, 20.0), (280.0, 20.0)];
        let cases = [
            (ZoneKind::KeepOut, &wall, 0.4),
            (ZoneKind::KeepIn, &inside, 0.4),
            (ZoneKind::KeepOut, &corner, 0.6),
            (ZoneKind::KeepOut, &hut, 0.7),
        ];
        for (kind, corners, least) in cases {
            let flown = fly(vec![zone(kind, corners)], (-1500.0, -200.0));
            let Flown { on_orbit_fraction, furthest_m, turned_back } = flown;
            assert!(on_orbit_fraction > least && furthest_m < 420.0, "{corners:?}: {on_orbit_fraction}, {furthest_m}");
            assert!(turned_back < 60, "{corners:?}: {turned_back}");
        }
    }

    #[test]
    fn an_orbit_with_nothing_free_is_flown_wider() {
        let town = [(-360.0, -360.0), (360.0, -360.0), (360.0, 360.0), (-360.0, 360.0)];
        let flown = fly(vec![zone(ZoneKind::KeepOut, &town)], (-1500.0, 0.0));
        assert!(flown.furthest_m < 700.0, "{}", flown.furthest_m);
        // One in which no orbit fits is kept as near to as can be.
        let large = town.map(|(x, y)| (4.0 * x, 4.0 * y));
        let flown = fly(vec![zone(ZoneKind::KeepOut, &large)], (-2500.0, 0.0));
        assert!(flown.furthest_m < 2100.0, "{}", flown.furthest_m);
    }
}
