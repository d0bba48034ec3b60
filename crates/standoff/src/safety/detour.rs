//! Detour planning: if a zone blocks the orbit or the path onto it, the UAV flies the shortest path to the next free
//! part.
//!
//! The planner predicts the path of the guidance law without zones. If that path meets an outline soon, or anywhere
//! before it reaches the orbit, the UAV heads for the next free point of the path, either straight or around corners.
//! So the UAV flies the free part of an orbit and follows the outline along the blocked part. If no part of the orbit
//! is free, it flies a wider orbit within sensor range. If there is no such orbit either, it stays as close to the
//! centre as possible.

use crate::angle::Angle;
use crate::frame::{Displacement, Position};
use crate::guidance::followed::Followed;
use crate::guidance::heading::{Orbit, OrbitRelativeState};
use crate::math;
use crate::params::{GuidanceParams, UavParams};
use crate::safety::geofence::{Geofence, Side, ZoneKind, cross, squared_between_m2, squared_to_side_m2};
use crate::uav::UavState;

/// Distance at which corners are passed, m.
const PASSING_M: f64 = 40.0;

/// Maximum turn per waypoint at a corner, rad. With larger steps, the path between two waypoints would cut the corner.
const CORNER_STEP_RAD: f64 = 1.0;

/// Minimum clearance of a path from outlines, m, unless the path starts closer to one.
const CLEAR_M: f64 = 15.0;

/// Minimum clearance at the end of a path, m.
const FREE_M: f64 = 25.0;

/// Maximum number of waypoints. If there are more, they are thinned out evenly.
const WAYPOINTS_MAX: usize = 400;

/// Look-ahead time on the orbit, s. Blocked parts further ahead are ignored.
const ORBIT_LOOKAHEAD_S: f64 = 8.0;

/// Time step of the prediction, s.
const STEP_S: f64 = 1.0;
/// Maximum number of prediction steps.
const STEPS_MAX: u32 = 400;

/// Maximum extrapolation time of the centre at its velocity, s.
const CARRIED_ON_S: f64 = 20.0;

/// Number of unreachable points of an orbit after which the search stops.
const CUT_OFF_MAX: u32 = 4;

/// Radii of the wider orbits that are tried, as multiples of the standoff distance.
const WIDER: [f64; 4] = [1.25, 1.5, 1.8, 2.2];

/// Detour planner: a visibility graph of waypoints around the corners of all zones.
#[derive(Debug, Clone)]
pub(crate) struct DetourPlanner {
    pub(crate) geofence: Geofence,
    uav: UavParams,
    sides: Vec<Side>,
    places: Vec<Position>,
    /// For each waypoint, the visible waypoints and their distances, m.
    next: Vec<Vec<(usize, f64)>>,
}

/// Command that replaces a blocked one.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Detour {
    pub(crate) followed: Followed,
    /// Index of the blocking zone.
    pub(crate) zone: usize,
}

/// Result of predicting an orbit as if there were no zones.
enum PathAhead {
    Clear,
    /// Index of the blocking zone, and the point at which the path is free again, if any.
    Blocked(usize, Option<Position>),
}

impl DetourPlanner {
    pub(crate) fn of(geofence: Geofence, uav: UavParams) -> Self {
        let sides: Vec<Side> = geofence.sides().collect();
        let mut places = Vec::new();
        for zone in geofence.zones() {
            // Orient the outline so that the free side is on the right.
            let is_anticlockwise = zone.twice_area_m2() > 0.0;
            let mut outline = zone.vertices.clone();
            if is_anticlockwise != (zone.kind == ZoneKind::KeepOut) {
                outline.reverse();
            }
            let corners = outline.len();
            for (place, at) in outline.iter().enumerate() {
                let (before, after) = (outline[(place + corners - 1) % corners], outline[(place + 1) % corners]);
                let (into, out) = ((*at - before).direction(), (after - *at).direction());
                let turn_rad = (out - into).rad();
                if turn_rad <= 0.0 {
                    // The corner does not protrude into the free side.
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
        places.retain(|at| geofence.contains(*at) && clearance_m2(*at, &sides) >= CLEAR_M * CLEAR_M);
        let every = places.len().div_ceil(WAYPOINTS_MAX).max(1);
        let places: Vec<Position> = places.into_iter().step_by(every).collect();
        let mut next = vec![Vec::new(); places.len()];
        for (one, from) in places.iter().enumerate() {
            for (other, to) in places.iter().enumerate().skip(one + 1) {
                if is_clear(*from, *to, &sides, CLEAR_M) {
                    let distance_m = from.distance_m(*to);
                    next[one].push((other, distance_m));
                    next[other].push((one, distance_m));
                }
            }
        }
        Self { geofence, uav, sides, places, next }
    }

    /// Returns the first waypoint of the shortest path, or `to` if the straight path is free; `None` if there is no
    /// path.
    fn first(&self, from: Position, to: Position) -> Option<Position> {
        let sides = &self.sides[..];
        // A path that starts close to an outline keeps almost that distance.
        let clearance_m = (0.9 * clearance_m2(from, sides).sqrt()).min(CLEAR_M);
        if is_clear(from, to, sides, clearance_m) {
            return Some(to);
        }
        // Dijkstra's algorithm, backwards from the end, so that it yields the first step.
        let count = self.places.len();
        let mut remaining_m = vec![f64::INFINITY; count];
        let mut is_done = vec![false; count];
        for (place, at) in self.places.iter().enumerate() {
            if is_clear(*at, to, sides, CLEAR_M) {
                remaining_m[place] = at.distance_m(to);
            }
        }
        let mut best: (f64, Option<Position>) = (f64::INFINITY, None);
        loop {
            let open = (0..count).filter(|place| !is_done[*place] && remaining_m[*place] < best.0);
            let Some(place) = open.min_by(|a, b| remaining_m[*a].total_cmp(&remaining_m[*b])) else { break };
            is_done[place] = true;
            let at = self.places[place];
            let total_m = remaining_m[place] + from.distance_m(at);
            if total_m < best.0 && is_clear(from, at, sides, clearance_m) {
                best = (total_m, Some(at));
            }
            for (other, edge_m) in &self.next[place] {
                remaining_m[*other] = remaining_m[*other].min(remaining_m[place] + edge_m);
            }
        }
        best.1
    }
}

impl DetourPlanner {
    /// Returns the command to fly instead if the orbit is blocked, soon or on the path onto it; `None` if it is not
    /// blocked. Wider orbits have radii up to `largest_m`.
    pub(crate) fn detour(
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
        let sides: Vec<Side> = self.geofence.sides_near(orbit.centre, reach_m).collect();
        if sides.is_empty() || self.geofence.violated_zones(own.position).next().is_some() {
            return None;
        }
        let PathAhead::Blocked(zone, free) = self.ahead(guidance, own, orbit, speed_m_s, &sides) else { return None };
        if let Some(to) = free {
            return Some(Detour { followed: self.towards(own, to, speed_m_s), zone });
        }
        for wider in WIDER.iter().map(|wider| wider * orbit.distance_m).filter(|radius_m| *radius_m <= largest_m) {
            let mut orbit = *orbit;
            (orbit.distance_m, orbit.steered.radius_m) = (wider, wider);
            let followed = match self.ahead(guidance, own, &orbit, speed_m_s, &sides) {
                PathAhead::Clear => {
                    let on_orbit = OrbitRelativeState::of(guidance, own.position, &orbit);
                    on_orbit.follow(guidance, &self.uav, own, speed_m_s)
                }
                PathAhead::Blocked(_, Some(to)) => self.towards(own, to, speed_m_s),
                PathAhead::Blocked(_, None) => continue,
            };
            return Some(Detour { followed, zone });
        }
        // No part of any orbit is free: stay as close to the centre as possible.
        let off_m = 0.5 * self.circle_m();
        let free = sides.iter().filter_map(|side| {
            let nearest = orbit.centre.nearest_on_line(side.from, side.to);
            let outward = (nearest - orbit.centre).direction();
            let across = (side.to - side.from).direction() + Angle::from_rad(0.5 * math::PI);
            let directions = [outward, across, across + Angle::from_rad(math::PI)];
            let candidates = directions.map(|direction| nearest + Displacement::from_polar(off_m, direction));
            candidates.into_iter().find(|at| self.is_free(*at, &sides))
        });
        let free = free.filter(|at| self.first(own.position, *at).is_some());
        let nearest = free.min_by(|a, b| {
            let squared_m2 = |at: &Position| at.squared_distance_m2(orbit.centre);
            squared_m2(a).total_cmp(&squared_m2(b))
        });
        nearest.map(|to| Detour { followed: self.towards(own, to, speed_m_s), zone })
    }

    fn is_free(&self, at: Position, sides: &[Side]) -> bool {
        clearance_m2(at, sides) >= FREE_M * FREE_M && self.geofence.contains(at)
    }

    /// Predicts the path of a UAV that flies an orbit as if there were no zones, and checks it for blocked parts.
    fn ahead(
        &self,
        guidance: &GuidanceParams,
        own: &UavState,
        orbit: &Orbit,
        speed_m_s: f64,
        sides: &[Side],
    ) -> PathAhead {
        let mut state = UavState { speed_m_s, ..*own };
        let (mut blocked, mut is_on_orbit, mut cut_off) = (None, false, 0);
        // One turn, from the point at which the orbit is reached.
        let mut rest_s = math::TAU * orbit.distance_m / speed_m_s;
        for step in 0..STEPS_MAX {
            let after_s = f64::from(step) * STEP_S;
            let moved = orbit.centre_velocity * after_s.min(CARRIED_ON_S);
            let orbit = Orbit { centre: orbit.centre + moved, ..*orbit };
            let on_orbit = OrbitRelativeState::of(guidance, state.position, &orbit);
            is_on_orbit |= on_orbit.centre_distance_m() < 1.2 * orbit.distance_m;
            if is_on_orbit {
                rest_s -= STEP_S;
            }
            if blocked.is_none() && is_on_orbit && after_s >= ORBIT_LOOKAHEAD_S {
                return PathAhead::Clear;
            }
            if rest_s < 0.0 {
                break;
            }
            let desired = on_orbit.ground_track(speed_m_s).heading;
            let flown = state.turned_towards(desired, self.uav.turn_rate_max_rad_s, STEP_S);
            let next = flown.position;
            if blocked.is_none() {
                let least_m2 = CLEAR_M.min(0.9 * clearance_m2(own.position, sides).sqrt()).max(1.0);
                let met = sides.iter().find(|side| {
                    squared_between_m2((state.position, next), (side.from, side.to)) < least_m2 * least_m2
                });
                blocked = met.map(|side| side.zone);
            }
            state = flown;
            // A point within the UAV's turning circle is not a goal. Neither is a free point before the orbit is
            // reached, because it may be in a pocket of the zone.
            let is_far = || own.position.squared_distance_m2(next) > self.circle_m() * self.circle_m();
            if let Some(zone) = blocked
                && (is_on_orbit || step + 1 == STEPS_MAX)
                && is_far()
                && self.is_free(next, sides)
            {
                if self.first(own.position, next).is_some() {
                    return PathAhead::Blocked(zone, Some(next));
                }
                cut_off += 1;
                if cut_off >= CUT_OFF_MAX {
                    break;
                }
            }
        }
        blocked.map_or(PathAhead::Clear, |zone| PathAhead::Blocked(zone, None))
    }

    /// Guidance to the first waypoint on the path to a position.
    fn towards(&self, own: &UavState, to: Position, speed_m_s: f64) -> Followed {
        let waypoint = self.first(own.position, to).unwrap_or(to);
        let to_waypoint = waypoint - own.position;
        let error_rad = (to_waypoint.direction() - own.heading).rad();
        // A waypoint to the side, within the turning circle, is reached by flying slower.
        let is_too_near = error_rad.abs() > 0.8 && to_waypoint.length_m() < 2.0 * self.circle_m();
        let [slowest_m_s, _] = self.uav.speeds_m_s();
        let speed_m_s = if is_too_near { slowest_m_s.max(0.7 * self.uav.speed_m_s) } else { speed_m_s };
        Followed::straight(own, to_waypoint.direction(), speed_m_s, TURN_GAIN_1_S)
    }

    /// Minimum turn radius at nominal speed, m.
    fn circle_m(&self) -> f64 {
        self.uav.speed_m_s / self.uav.turn_rate_max_rad_s
    }
}

/// Heading gain on a detour, 1/s.
const TURN_GAIN_1_S: f64 = 0.8;

/// Squared distance from a point to the nearest side, m2.
fn clearance_m2(at: Position, sides: &[Side]) -> f64 {
    sides.iter().map(|side| squared_to_side_m2(at, side.from, side.to)).fold(f64::INFINITY, f64::min)
}

/// Returns true if the straight path keeps `clearance_m` from all sides. Both ends must be allowed positions.
fn is_clear(from: Position, to: Position, sides: &[Side], clearance_m: f64) -> bool {
    let along = to - from;
    let offset_m2 = |side: &Side| {
        // Cheap and usually sufficient: both corners are on the same side of the path and further away than the
        // clearance.
        let (a, b) = (cross(along, side.from - from), cross(along, side.to - from));
        (a * b > 0.0).then(|| a.abs().min(b.abs()))
    };
    let required_m2 = clearance_m * along.length_m();
    sides.iter().all(|side| {
        offset_m2(side).is_some_and(|offset_m2| offset_m2 > required_m2)
            || squared_between_m2((from, to), (side.from, side.to)) >= clearance_m * clearance_m
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::frame::Velocity;
    use crate::guidance::standoff_distance::Ramp;
    use crate::params::TeamParams;
    use crate::safety::geofence::Zone;
    use crate::safety::motion::Motion;
    use crate::safety::zones::GeofenceSafety;
    use crate::time::Duration;
    use crate::uav::Command;

    fn zone(kind: ZoneKind, corners: &[(f64, f64)]) -> Zone {
        let outline = corners.iter().map(|(x_m, y_m)| Position::from_m(*x_m, *y_m)).collect();
        Zone { kind, vertices: outline, ..Zone::default() }
    }

    /// Flight of a UAV that starts in the west, heads east, and flies to an orbit of 300 m around the origin. All
    /// values are from the second half of ten minutes.
    struct Flown {
        /// Fraction of the time within 40 m of the orbit.
        on_orbit_fraction: f64,
        /// Maximum distance from the centre, m.
        furthest_m: f64,
        /// Number of steps with a hard clockwise turn.
        turned_back: usize,
    }

    fn fly(zones: Vec<Zone>, from: (f64, f64)) -> Flown {
        let params = TeamParams::paper();
        let geofence_safety = GeofenceSafety::new(Geofence::new(zones).unwrap(), params.airframe(), 0.5);
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
        let mut state = UavState::level_flight(position, Angle::ZERO, 40.0);
        assert!(geofence_safety.is_safe(&Motion::steady(&params.uav, &state)));
        let mut flown = Flown { on_orbit_fraction: 0.0, furthest_m: 0.0, turned_back: 0 };
        for step in 0..1200 {
            let on_orbit = OrbitRelativeState::of(&params.guidance, state.position, &orbit);
            let detour = geofence_safety.detours.detour(&params.guidance, &state, &orbit, 40.0, 700.0);
            let on_orbit = || on_orbit.follow(&params.guidance, &params.uav, &state, 40.0);
            let followed = detour.map_or_else(on_orbit, |detour| detour.followed);
            let turn_rate_rad_s = followed.course_rate_rad_s();
            let desired = Command { speed_m_s: followed.guidance.speed_m_s, turn_rate_rad_s };
            let desired = params.uav.limit(desired).command;
            let (command, _) = geofence_safety.make_safe(&Motion::steady(&params.uav, &state), desired, None);
            state = response.step(&state, command);
            assert!(geofence_safety.geofence().contains(state.position), "step {step}: {state:?}");
            if step >= 600 {
                let distance_m = state.position.distance_m(orbit.centre);
                flown.on_orbit_fraction += f64::from((distance_m - 300.0).abs() < 40.0) / 600.0;
                flown.furthest_m = flown.furthest_m.max(distance_m);
                flown.turned_back += usize::from(command.turn_rate_rad_s < -0.25);
            }
        }
        flown
    }

    #[test]
    fn a_zone_far_from_the_orbit_changes_nothing() {
        let far = zone(ZoneKind::KeepOut, &[(3000.0, 0.0), (3500.0, 0.0), (3000.0, 500.0)]);
        let flown = fly(vec![far], (-1500.0, 0.0));
        assert!(flown.on_orbit_fraction > 0.999, "{}", flown.on_orbit_fraction);
    }

    #[test]
    fn a_uav_leaves_a_pocket_between_it_and_its_orbit() {
        // A U that opens to the west, and an L. The UAV starts in the pocket or in front of it.
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
    fn the_free_part_of_a_partly_blocked_orbit_is_flown() {
        // A wall to the north, and a keep-in zone; each blocks about half of the orbit.
        let wall = [(-3000.0, 60.0), (3000.0, 60.0), (3000.0, 900.0), (-3000.0, 900.0)];
        let inside = [(-3000.0, -3000.0), (3000.0, -3000.0), (3000.0, 60.0), (-3000.0, 60.0)];
        // A corner that reaches into the orbit, and a small zone on it.
        let corner = [(100.0, 100.0), (2000.0, 100.0), (2000.0, 2000.0), (100.0, 2000.0)];
        let small = [(280.0, -20.0), (320.0, -20.0), (320.0, 20.0), (280.0, 20.0)];
        let cases = [
            (ZoneKind::KeepOut, &wall, 0.4),
            (ZoneKind::KeepIn, &inside, 0.4),
            (ZoneKind::KeepOut, &corner, 0.6),
            (ZoneKind::KeepOut, &small, 0.7),
        ];
        for (kind, corners, least) in cases {
            let flown = fly(vec![zone(kind, corners)], (-1500.0, -200.0));
            let Flown { on_orbit_fraction, furthest_m, turned_back } = flown;
            assert!(on_orbit_fraction > least && furthest_m < 420.0, "{corners:?}: {on_orbit_fraction}, {furthest_m}");
            assert!(turned_back < 60, "{corners:?}: {turned_back}");
        }
    }

    #[test]
    fn a_blocked_orbit_is_replaced_by_a_wider_one() {
        let town = [(-360.0, -360.0), (360.0, -360.0), (360.0, 360.0), (-360.0, 360.0)];
        let flown = fly(vec![zone(ZoneKind::KeepOut, &town)], (-1500.0, 0.0));
        assert!(flown.furthest_m < 700.0, "{}", flown.furthest_m);
        // If no orbit fits around the zone, the UAV stays as close to the centre as possible.
        let large = town.map(|(x, y)| (4.0 * x, 4.0 * y));
        let flown = fly(vec![zone(ZoneKind::KeepOut, &large)], (-2500.0, 0.0));
        assert!(flown.furthest_m < 2100.0, "{}", flown.furthest_m);
    }
}
