//! Geofence: keep-out and keep-in zones, and the geometry of their outlines.
//!
//! A UAV must be outside *each* keep-out zone and inside *each* keep-in zone, so of two keep-in zones only the
//! intersection is allowed. A zone has no holes; a hole in a keep-in zone is a keep-out zone. A zone may have several
//! parts, each with an outline: it is their union.
//!
//! A zone may have a floor and a ceiling, its *band*. A keep-out zone binds the UAVs that may fly in its band, both ends
//! included. A keep-in zone binds all UAVs.

use std::sync::Arc;

use crate::frame::{Displacement, Position};
use crate::math;
use crate::priority::is_inside;

/// Maximum number of zones of a team.
pub const ZONES_MAX: usize = 100;

/// Maximum total number of vertices of all zones. It bounds the time of detour planning.
pub(crate) const VERTICES_MAX: usize = 1_000;

/// Maximum altitude of a floor or a ceiling, m.
pub const ZONE_ALTITUDE_MAX_M: f64 = 1e5;

/// Maximum coordinate of a vertex, m.
const FARTHEST_M: f64 = 1e7;

/// Distance below which two vertices count as the same, m.
const SAME_M: f64 = 1e-6;

/// Kind of a zone: the side of the outline on which UAVs may fly.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum ZoneKind {
    /// UAVs must stay outside.
    #[default]
    KeepOut,
    /// UAVs must stay inside.
    KeepIn,
}

impl ZoneKind {
    /// Name of the kind in scenarios and records, kebab-case.
    pub fn name(self) -> &'static str {
        match self {
            Self::KeepOut => "keep-out",
            Self::KeepIn => "keep-in",
        }
    }

    /// Vertices of a regular polygon for a circle, on the safe side of it: a keep-out zone contains the circle, a keep-in
    /// zone is inside of it.
    pub fn circle(self, centre: Position, radius_m: f64, vertices: u32) -> Vec<Position> {
        let half_rad = math::PI / f64::from(vertices);
        let vertex_m = match self {
            Self::KeepOut => radius_m / math::cos(half_rad),
            Self::KeepIn => radius_m,
        };
        let vertex = |index: u32| {
            let angle_rad = 2.0 * half_rad * f64::from(index);
            let (x_m, y_m) = (vertex_m * math::cos(angle_rad), vertex_m * math::sin(angle_rad));
            Position::from_m(centre.x_m() + x_m, centre.y_m() + y_m)
        };
        (0..vertices).map(vertex).collect()
    }
}

/// A keep-out or keep-in zone: a polygon, convex or not, between two altitudes.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Zone {
    /// Name for users; may be empty.
    pub name: String,
    /// Keep-out or keep-in.
    pub kind: ZoneKind,
    /// Corners in order, clockwise or anticlockwise. The last is joined to the first.
    pub vertices: Vec<Position>,
    /// Floor, m above the plane, 0 to 100,000; `None`: no lower limit.
    pub altitude_min_m: Option<f64>,
    /// Ceiling, m above the plane, `altitude_min_m` to 100,000; `None`: no upper limit.
    pub altitude_max_m: Option<f64>,
    /// Index of an earlier zone, of the same kind, floor and ceiling, of which this is a further part: both are one zone,
    /// their union, with that index. Parts of a keep-in zone must not touch each other. `None`: a separate zone.
    pub part_of: Option<usize>,
}

/// A set of zones of a geofence: bit n is zone n.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct ZoneSet(u128);

const _: () = assert!(ZONES_MAX <= u128::BITS as usize);

impl ZoneSet {
    pub(crate) fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    fn contains(self, number: usize) -> bool {
        self.0 >> number & 1 == 1
    }
}

/// Error in the zones of a geofence.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{position}{reason}")]
pub struct GeofenceError {
    /// Index of the zone, from 0; `None` if the error concerns all zones together.
    pub zone: Option<usize>,
    /// Index of the vertex, from 0; `None` if the error concerns the whole zone.
    pub vertex: Option<usize>,
    /// Zone and vertex as text, such as `zone 1 "airfield", vertex 2: `; empty if the error concerns all zones
    /// together.
    pub position: String,
    /// The error, and how to correct it.
    pub reason: String,
}

/// Geofence: the validated zones of a team. Clones share the zones. All methods that take no altitude regard zones as
/// unlimited in height.
///
/// ```
/// use standoff::{Geofence, Position, Zone, ZoneKind};
///
/// let outline = [(0.0, 0.0), (400.0, 0.0), (0.0, 400.0)].map(|(x_m, y_m)| Position::from_m(x_m, y_m));
/// let zone = Zone { kind: ZoneKind::KeepOut, vertices: outline.into(), ..Zone::default() };
/// let geofence = Geofence::new(vec![zone]).unwrap();
/// assert!(!geofence.contains(Position::from_m(100.0, 100.0)));
/// assert!(geofence.contains(Position::from_m(300.0, 300.0)));
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Geofence {
    /// By zone, then index.
    zones: Arc<[Bounded]>,
}

/// A part of a zone and its bounding box.
#[derive(Debug, Clone, PartialEq)]
struct Bounded {
    /// Index in the geofence of the team, also in a part of it.
    index: usize,
    /// Index of the zone, that of its first part.
    number: usize,
    zone: Zone,
    low: Position,
    high: Position,
}

/// A side of a zone's outline.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Side {
    /// Index of the zone.
    pub(crate) zone: usize,
    pub(crate) from: Position,
    pub(crate) to: Position,
}

impl Geofence {
    /// Validates zones. Each must be a polygon with at least three vertices that does not cross itself. A floor must not
    /// be above the ceiling.
    pub fn new(zones: Vec<Zone>) -> Result<Self, GeofenceError> {
        let of_all = |what: String| GeofenceError { zone: None, vertex: None, position: String::new(), reason: what };
        if zones.len() > ZONES_MAX {
            return Err(of_all(format!("there are {} zones: at most {ZONES_MAX} are allowed", zones.len())));
        }
        let vertices: usize = zones.iter().map(|zone| zone.vertices.len()).sum();
        if vertices > VERTICES_MAX {
            let what = "simplify the outlines";
            return Err(of_all(format!(
                "the zones have {vertices} vertices: at most {VERTICES_MAX} are allowed; {what}"
            )));
        }
        let mut parts: Vec<Bounded> = Vec::new();
        for (index, zone) in zones.into_iter().enumerate() {
            let mut part = Bounded::new(index, zone)?;
            if let Some(first) = part.zone.part_of {
                part.join(&parts, first)?;
            }
            parts.push(part);
        }
        parts.sort_by_key(|part| (part.number, part.index));
        Ok(Self { zones: parts.into() })
    }

    /// The zones, each as its parts.
    fn unions(&self) -> impl Iterator<Item = &[Bounded]> {
        self.zones.chunk_by(|one, other| one.number == other.number)
    }

    /// Returns true if there are no zones.
    pub fn is_empty(&self) -> bool {
        self.zones.is_empty()
    }

    /// The zones by ascending index, without repeated vertices, each part apart.
    pub fn zones(&self) -> impl ExactSizeIterator<Item = &Zone> {
        let mut all: Vec<&Bounded> = self.zones.iter().collect();
        all.sort_by_key(|bounded| bounded.index);
        all.into_iter().map(|bounded| &bounded.zone)
    }

    /// Returns true if a UAV may be at a position: outside every keep-out zone and inside every keep-in zone. On an
    /// outline the result is unspecified.
    pub fn contains(&self, at: Position) -> bool {
        self.violated_zones(at).next().is_none()
    }

    /// Zone of an index.
    pub fn zone(&self, number: usize) -> Option<&Zone> {
        self.zones.iter().find(|bounded| bounded.index == number).map(|bounded| &bounded.zone)
    }

    /// Zones that bind a UAV with altitudes between two, m: all keep-in zones, and the keep-out zones that have such an
    /// altitude.
    pub(crate) fn binding(&self, altitudes_m: [f64; 2]) -> ZoneSet {
        let binding = self.zones.iter().filter(|bounded| bounded.zone.binds(altitudes_m));
        ZoneSet(binding.fold(0, |zones, bounded| zones | 1 << bounded.number))
    }

    /// The zones of a set. They keep their indices.
    #[must_use]
    pub(crate) fn part(&self, zones: ZoneSet) -> Self {
        if self.zones.iter().all(|bounded| zones.contains(bounded.number)) {
            return self.clone();
        }
        Self { zones: self.zones.iter().filter(|bounded| zones.contains(bounded.number)).cloned().collect() }
    }

    /// Indices of the zones that forbid a position, ascending.
    pub(crate) fn violated_zones(&self, at: Position) -> impl Iterator<Item = usize> {
        self.unions().filter(move |parts| is_violated(parts, at)).map(|parts| parts[0].number)
    }

    /// Indices of the zones of a set that forbid a position, ascending.
    pub(crate) fn violated_zones_of(&self, zones: ZoneSet, at: Position) -> impl Iterator<Item = usize> {
        self.violated_zones(at).filter(move |number| zones.contains(*number))
    }

    /// Indices of the zones that an aircraft with altitudes between two, m, violates at a position, ascending. Outside
    /// the band of a keep-in zone, the aircraft violates it.
    pub fn violated_zones_between(&self, at: Position, altitudes_m: [f64; 2]) -> impl Iterator<Item = usize> {
        let violated = self.unions().filter(move |parts| {
            let zone = &parts[0].zone;
            match zone.kind {
                ZoneKind::KeepOut => zone.binds(altitudes_m) && is_violated(parts, at),
                ZoneKind::KeepIn => !zone.has_altitudes(altitudes_m) || is_violated(parts, at),
            }
        });
        violated.map(|parts| parts[0].number)
    }

    /// Indices of the zones that bind an aircraft with altitudes between two, m, and whose outline the straight line
    /// between two positions crosses or touches, ascending.
    pub fn crosses(&self, from: Position, to: Position, altitudes_m: [f64; 2]) -> impl Iterator<Item = usize> {
        let reach_m = from.distance_m(to) + SAME_M;
        let near = move |bounded: &Bounded| bounded.zone.binds(altitudes_m) && bounded.is_near(from, reach_m);
        let meets = move |side: Side| squared_between_m2((from, to), (side.from, side.to)) == 0.0;
        let crossed = move |bounded: &Bounded| near(bounded) && bounded.sides().any(meets);
        self.unions().filter(move |parts| parts.iter().any(crossed)).map(|parts| parts[0].number)
    }

    /// All sides closer to a position than `reach_m`.
    pub(crate) fn sides_near(&self, at: Position, reach_m: f64) -> impl Iterator<Item = Side> {
        let near = self.zones.iter().filter(move |bounded| bounded.is_near(at, reach_m));
        let sides = near.flat_map(Bounded::sides);
        sides.filter(move |side| squared_to_side_m2(at, side.from, side.to) < reach_m * reach_m)
    }

    /// Returns true if a side is closer to a position than `reach_m`.
    pub fn has_side_near(&self, at: Position, reach_m: f64) -> bool {
        self.sides_near(at, reach_m).next().is_some()
    }

    /// The zones, or parts of them, that count. They keep their indices.
    pub(crate) fn only(&self, counts: impl Fn(&Zone) -> bool) -> Self {
        Self { zones: self.zones.iter().filter(|bounded| counts(&bounded.zone)).cloned().collect() }
    }

    /// Signed distance from a position to the edge of what the zones allow, m; negative outside. Infinite without zones.
    pub(crate) fn room_at_m(&self, at: Position) -> f64 {
        let inward_m = |bounded: &Bounded| {
            let distances_m2 = bounded.sides().map(|side| squared_to_side_m2(at, side.from, side.to));
            let distance_m = distances_m2.fold(f64::INFINITY, f64::min).sqrt();
            if bounded.zone.contains(at) { distance_m } else { -distance_m }
        };
        let room_m = |parts: &[Bounded]| {
            let inward_m = parts.iter().map(inward_m).fold(f64::NEG_INFINITY, f64::max);
            if parts[0].zone.kind == ZoneKind::KeepIn { inward_m } else { -inward_m }
        };
        self.unions().map(room_m).fold(f64::INFINITY, f64::min)
    }

    /// The smallest box around all positions that every keep-in zone contains, as two corners; `None` if there is no
    /// keep-in zone.
    pub(crate) fn keep_in_box(&self) -> Option<[Position; 2]> {
        let boxes = self.unions().filter(|parts| parts[0].zone.kind == ZoneKind::KeepIn).map(|parts| {
            let ends = |of: fn(&Bounded) -> Position, pick: fn(f64, f64) -> f64| {
                let corners = parts.iter().map(of);
                corners
                    .reduce(|a, b| Position::from_m(pick(a.x_m(), b.x_m()), pick(a.y_m(), b.y_m())))
                    .unwrap_or_default()
            };
            [ends(|part| part.low, f64::min), ends(|part| part.high, f64::max)]
        });
        boxes.reduce(|a, b| {
            let of = |one: Position, other: Position, pick: fn(f64, f64) -> f64| {
                Position::from_m(pick(one.x_m(), other.x_m()), pick(one.y_m(), other.y_m()))
            };
            [of(a[0], b[0], f64::max), of(a[1], b[1], f64::min)]
        })
    }

    /// All sides of all zones.
    pub(crate) fn sides(&self) -> impl Iterator<Item = Side> {
        self.zones.iter().flat_map(Bounded::sides)
    }
}

impl Zone {
    fn sides(&self, zone: usize) -> impl Iterator<Item = Side> {
        let next = self.vertices.iter().cycle().skip(1);
        self.vertices.iter().zip(next).map(move |(from, to)| Side { zone, from: *from, to: *to })
    }

    /// Returns true if a position is inside the outline.
    fn contains(&self, at: Position) -> bool {
        is_inside(&self.vertices, at)
    }

    /// Floor and ceiling, m.
    fn band_m(&self) -> [f64; 2] {
        [self.altitude_min_m.unwrap_or(f64::NEG_INFINITY), self.altitude_max_m.unwrap_or(f64::INFINITY)]
    }

    /// Returns true if the zone binds an aircraft with altitudes between two, m.
    fn binds(&self, [low_m, high_m]: [f64; 2]) -> bool {
        let [floor_m, ceiling_m] = self.band_m();
        self.kind == ZoneKind::KeepIn || (low_m <= ceiling_m && high_m >= floor_m)
    }

    /// Returns true if all altitudes between two, m, are between floor and ceiling.
    pub fn has_altitudes(&self, [low_m, high_m]: [f64; 2]) -> bool {
        let [floor_m, ceiling_m] = self.band_m();
        floor_m <= low_m && high_m <= ceiling_m
    }

    /// Twice the signed area, m2; positive if the vertices are in anticlockwise order.
    pub(crate) fn twice_area_m2(&self) -> f64 {
        let origin = self.vertices.first().copied().unwrap_or_default();
        self.sides(0).map(|side| cross(side.from - origin, side.to - origin)).sum()
    }
}

/// Two sides of one outline that cross or touch each other; adjacent ones may share a vertex only.
fn crossing_sides(sides: &[Side]) -> Option<[usize; 2]> {
    let crosses = |first: usize, second: usize| {
        let (one, other) = (&sides[first], &sides[second]);
        let is_next = second == first + 1 || (first == 0 && second + 1 == sides.len());
        if !is_next {
            return squared_between_m2((one.from, one.to), (other.from, other.to)) <= SAME_M * SAME_M;
        }
        let (shared, a, b) =
            if one.to == other.from { (one.to, one.from, other.to) } else { (one.from, one.to, other.from) };
        [(a, b), (b, a)].iter().any(|(at, end)| squared_to_side_m2(*at, shared, *end) <= SAME_M * SAME_M)
    };
    let mut pairs = (0..sides.len()).flat_map(|first| (first + 1..sides.len()).map(move |second| [first, second]));
    pairs.find(|[first, second]| crosses(*first, *second))
}

impl Bounded {
    fn new(number: usize, mut zone: Zone) -> Result<Self, GeofenceError> {
        let name = if zone.name.is_empty() { String::new() } else { format!(" {:?}", zone.name) };
        let error = |vertex: Option<usize>, what: String| {
            let at = vertex.map_or(String::new(), |vertex| format!(", vertex {vertex}"));
            let place = format!("zone {number}{name}{at}: ");
            Err(GeofenceError { zone: Some(number), vertex, position: place, reason: what })
        };
        let is_valid = |at: &Position| at.x_m().abs() <= FARTHEST_M && at.y_m().abs() <= FARTHEST_M;
        if let Some(vertex) = zone.vertices.iter().position(|at| !is_valid(at)) {
            return error(
                Some(vertex),
                "coordinates must be finite and at most 10,000 km from the origin on each axis".to_owned(),
            );
        }
        let is_altitude = |altitude_m: f64| (0.0..=ZONE_ALTITUDE_MAX_M).contains(&altitude_m);
        for (name, altitude_m) in [("altitude_min_m", zone.altitude_min_m), ("altitude_max_m", zone.altitude_max_m)] {
            if let Some(altitude_m) = altitude_m.filter(|altitude_m| !is_altitude(*altitude_m)) {
                return error(None, format!("{name} = {altitude_m} must be between 0 and {ZONE_ALTITUDE_MAX_M}"));
            }
        }
        if let (Some(floor_m), Some(ceiling_m)) = (zone.altitude_min_m, zone.altitude_max_m)
            && floor_m > ceiling_m
        {
            let what = "the floor must not be above the ceiling";
            return error(None, format!("altitude_min_m = {floor_m} is above altitude_max_m = {ceiling_m}; {what}"));
        }
        // The rings of polygon files repeat the first vertex at the end.
        zone.vertices.dedup_by(|a, b| a.distance_m(*b) <= SAME_M);
        while zone.vertices.len() > 1 && zone.vertices[0].distance_m(zone.vertices[zone.vertices.len() - 1]) <= SAME_M {
            zone.vertices.pop();
        }
        let vertices = zone.vertices.len();
        if vertices < 3 {
            return error(None, format!("has {vertices} different vertices; an outline needs at least three"));
        }
        let sides: Vec<Side> = zone.sides(number).collect();
        if let Some([first, second]) = crossing_sides(&sides) {
            let what = format!(
                "the side that starts here crosses or touches the side that starts at vertex {second}; an outline must \
                 not cross itself"
            );
            return error(Some(first), what);
        }
        let (mut low, mut high) = ((f64::INFINITY, f64::INFINITY), (f64::NEG_INFINITY, f64::NEG_INFINITY));
        for at in &zone.vertices {
            low = (low.0.min(at.x_m()), low.1.min(at.y_m()));
            high = (high.0.max(at.x_m()), high.1.max(at.y_m()));
        }
        Ok(Self {
            index: number,
            number,
            zone,
            low: Position::from_m(low.0, low.1),
            high: Position::from_m(high.0, high.1),
        })
    }

    /// Makes this a part of the zone with the index `first`, which is among the `earlier` ones.
    fn join(&mut self, earlier: &[Self], first: usize) -> Result<(), GeofenceError> {
        let error = |reason: String| {
            Err(GeofenceError {
                zone: Some(self.index),
                vertex: None,
                position: format!("zone {}: ", self.index),
                reason,
            })
        };
        let key = |zone: &Zone| (zone.kind, zone.altitude_min_m, zone.altitude_max_m);
        if !earlier.iter().any(|of| of.index == first && of.number == first && key(&of.zone) == key(&self.zone)) {
            let what =
                "must be the index of an earlier zone of the same kind, floor and ceiling, which is no part itself";
            return error(format!("part_of = {first}: {what}"));
        }
        let meets = |part: &&Self| {
            let within = |one: &Self, other: &Self| other.zone.contains(one.zone.vertices[0]);
            within(self, part) || within(part, self) || self.sides().any(|side| part.is_met_by(&side))
        };
        let mut others = earlier.iter().filter(|of| of.number == first && of.zone.kind == ZoneKind::KeepIn);
        if let Some(part) = others.find(meets) {
            return error(format!("part_of = {first}: it touches zone {}; join them to one outline", part.index));
        }
        self.number = first;
        Ok(())
    }

    fn is_met_by(&self, side: &Side) -> bool {
        let meets = |own: Side| squared_between_m2((own.from, own.to), (side.from, side.to)) <= SAME_M * SAME_M;
        self.is_near(side.from, side.from.distance_m(side.to) + SAME_M) && self.sides().any(meets)
    }

    fn sides(&self) -> impl Iterator<Item = Side> {
        self.zone.sides(self.number)
    }

    fn is_near(&self, at: Position, reach_m: f64) -> bool {
        at.x_m() > self.low.x_m() - reach_m
            && at.x_m() < self.high.x_m() + reach_m
            && at.y_m() > self.low.y_m() - reach_m
            && at.y_m() < self.high.y_m() + reach_m
    }

    fn contains(&self, at: Position) -> bool {
        self.is_near(at, SAME_M) && self.zone.contains(at)
    }
}

/// True if a zone with these parts forbids a position.
fn is_violated(parts: &[Bounded], at: Position) -> bool {
    parts.iter().any(|part| part.contains(at)) == (parts[0].zone.kind == ZoneKind::KeepOut)
}

/// Cross product, m2; positive if the second vector is to the left of the first.
pub(crate) fn cross(a: Displacement, b: Displacement) -> f64 {
    a.vector().perp(&b.vector())
}

/// Squared distance from a position to a side, m2.
pub(crate) fn squared_to_side_m2(at: Position, from: Position, to: Position) -> f64 {
    at.squared_distance_m2(at.nearest_on_line(from, to))
}

/// Squared distance between two sides, m2; zero if they cross.
pub(crate) fn squared_between_m2(one: (Position, Position), other: (Position, Position)) -> f64 {
    let side_of = |line: (Position, Position), at: Position| cross(line.1 - line.0, at - line.0);
    let (a, b) = (side_of(other, one.0), side_of(other, one.1));
    let (c, d) = (side_of(one, other.0), side_of(one, other.1));
    if (a > 0.0) != (b > 0.0) && (c > 0.0) != (d > 0.0) {
        return 0.0;
    }
    squared_to_side_m2(one.0, other.0, other.1)
        .min(squared_to_side_m2(one.1, other.0, other.1))
        .min(squared_to_side_m2(other.0, one.0, one.1))
        .min(squared_to_side_m2(other.1, one.0, one.1))
}

/// Distance along a ray to its crossing with a side, in units of the length of `direction`; `None` if they do not
/// cross.
pub(crate) fn crossed_at(from: Position, direction: Displacement, side: &Side) -> Option<f64> {
    let along = side.to - side.from;
    let apart = cross(direction, along);
    let between = side.from - from;
    let (ahead, share) = (cross(between, along) / apart, cross(between, direction) / apart);
    (ahead >= 0.0 && (0.0..=1.0).contains(&share)).then_some(ahead)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outline(vertices: &[(f64, f64)]) -> Vec<Position> {
        vertices.iter().map(|(x_m, y_m)| Position::from_m(*x_m, *y_m)).collect()
    }

    fn zone(kind: ZoneKind, vertices: &[(f64, f64)]) -> Zone {
        Zone { kind, vertices: outline(vertices), ..Zone::default() }
    }

    const L: [(f64, f64); 6] = [(0.0, 0.0), (300.0, 0.0), (300.0, 100.0), (100.0, 100.0), (100.0, 300.0), (0.0, 300.0)];

    #[test]
    fn a_keep_out_forbids_its_inside_and_a_keep_in_its_outside() {
        let places = [((50.0, 200.0), true), ((200.0, 200.0), false), ((200.0, 50.0), true), ((-1.0, 50.0), false)];
        for ((x_m, y_m), is_inside) in places {
            for kind in [ZoneKind::KeepOut, ZoneKind::KeepIn] {
                let geofence = Geofence::new(vec![zone(kind, &L)]).unwrap();
                assert_eq!(geofence.contains(Position::from_m(x_m, y_m)), is_inside == (kind == ZoneKind::KeepIn));
            }
        }
        // Of two keep-in zones only the intersection is allowed.
        let square = |x_m: f64| [(x_m, 0.0), (x_m + 100.0, 0.0), (x_m + 100.0, 100.0), (x_m, 100.0)];
        let both = [0.0, 50.0].map(|x_m| zone(ZoneKind::KeepIn, &square(x_m)));
        let geofence = Geofence::new(both.into()).unwrap();
        let at = |x_m| Position::from_m(x_m, 50.0);
        assert_eq!(geofence.violated_zones(at(25.0)).collect::<Vec<_>>(), [1]);
        assert!(geofence.contains(at(75.0)));
        assert_eq!(geofence.violated_zones(at(125.0)).collect::<Vec<_>>(), [0]);
    }

    /// Lines over a vertex with both ends outside, past it, and from one arm of an L to the other across the notch
    /// outside.
    #[test]
    fn a_straight_line_reports_the_zones_that_it_crosses() {
        let geofence = Geofence::new(vec![zone(ZoneKind::KeepOut, &L), zone(ZoneKind::KeepIn, &L)]).unwrap();
        let crossed = |from: (f64, f64), to: (f64, f64)| {
            geofence.crosses(Position::from_m(from.0, from.1), Position::from_m(to.0, to.1), [300.0; 2]).count()
        };
        assert_eq!(crossed((-5.0, 10.0), (10.0, -5.0)), 2);
        assert_eq!(crossed((-5.0, 4.0), (4.0, -5.0)), 0);
        assert_eq!(crossed((50.0, 200.0), (200.0, 50.0)), 2);
        assert_eq!(crossed((50.0, 200.0), (50.0, 50.0)), 0);
        assert_eq!(crossed((150.0, 200.0), (250.0, 200.0)), 0);
    }

    #[test]
    fn an_invalid_polygon_is_rejected_with_its_corner() {
        let error = |vertices: &[(f64, f64)]| {
            let error =
                Geofence::new(vec![zone(ZoneKind::KeepOut, &L), zone(ZoneKind::KeepOut, vertices)]).unwrap_err();
            assert_eq!(error.zone, Some(1));
            error.to_string()
        };
        assert_eq!(
            error(&[(0.0, 0.0), (100.0, 100.0), (100.0, 0.0), (0.0, 100.0)]),
            "zone 1, vertex 0: the side that starts here crosses or touches the side that starts at vertex 2; an outline \
             must not cross itself"
        );
        // An outline that folds back on itself.
        assert!(error(&[(0.0, 0.0), (100.0, 0.0), (50.0, 0.0), (50.0, 50.0)]).contains("cross itself"));
        assert_eq!(
            error(&[(0.0, 0.0), (1.0, 1.0), (0.0, 0.0)]),
            "zone 1: has 2 different vertices; an outline needs at least three"
        );
        assert!(
            error(&[(0.0, 0.0), (f64::NAN, 1.0), (0.0, 5.0)])
                .starts_with("zone 1, vertex 1: coordinates must be finite")
        );
        assert!(
            error(&[(0.0, 0.0), (1e8, 1.0), (0.0, 5.0)]).starts_with("zone 1, vertex 1: coordinates must be finite")
        );
    }

    /// Zones from 100 to 200 m. Their limits are part of the band.
    #[test]
    fn a_keep_out_zone_binds_altitudes_in_its_band_and_a_keep_in_zone_all() {
        let band = |kind| Zone { altitude_min_m: Some(100.0), altitude_max_m: Some(200.0), ..zone(kind, &L) };
        let geofence = Geofence::new(vec![band(ZoneKind::KeepOut), band(ZoneKind::KeepIn)]).unwrap();
        let (inside, outside) = (Position::from_m(50.0, 50.0), Position::from_m(-50.0, 50.0));
        for (altitudes_m, is_bound, is_in_band) in [
            ([100.0, 100.0], true, true),
            ([200.0, 200.0], true, true),
            ([200.0, 300.0], true, false),
            ([0.0, 100.0], true, false),
            ([50.0, 250.0], true, false),
            ([99.9, 99.9], false, false),
            ([200.1, f64::INFINITY], false, false),
        ] {
            let binding = geofence.binding(altitudes_m);
            let part: Vec<usize> = geofence.part(binding).sides().map(|side| side.zone).collect();
            assert_eq!(part.len(), if is_bound { 12 } else { 6 }, "{altitudes_m:?}");
            // The remaining zone keeps its index.
            assert_eq!((part.contains(&0), part.contains(&1)), (is_bound, true));
            let violated = |at| geofence.violated_zones_between(at, altitudes_m).collect::<Vec<_>>();
            let expected: Vec<usize> =
                [(0, is_bound), (1, !is_in_band)].iter().filter(|of| of.1).map(|of| of.0).collect();
            assert_eq!(violated(inside), expected, "{altitudes_m:?}");
            assert_eq!(violated(outside), [1], "{altitudes_m:?}");
            let crossed: Vec<usize> = geofence.crosses(inside, outside, altitudes_m).collect();
            assert_eq!(crossed, if is_bound { vec![0, 1] } else { vec![1] }, "{altitudes_m:?}");
        }
    }

    #[test]
    fn an_invalid_floor_or_ceiling_is_rejected() {
        let error = |altitude_min_m, altitude_max_m| {
            let zone = Zone { altitude_min_m, altitude_max_m, ..zone(ZoneKind::KeepOut, &L) };
            Geofence::new(vec![zone]).map(|_| ()).map_err(|error| error.to_string())
        };
        assert_eq!(error(Some(0.0), Some(ZONE_ALTITUDE_MAX_M)), Ok(()));
        assert_eq!(error(Some(120.0), Some(120.0)), Ok(()));
        let inverted =
            "zone 0: altitude_min_m = 121 is above altitude_max_m = 120; the floor must not be above the ceiling";
        assert_eq!(error(Some(121.0), Some(120.0)), Err(inverted.to_owned()));
        let range = "zone 0: altitude_max_m = NaN must be between 0 and 100000";
        assert_eq!(error(None, Some(f64::NAN)), Err(range.to_owned()));
        assert!(error(Some(-0.1), None).is_err() && error(None, Some(f64::INFINITY)).is_err());
    }

    #[test]
    fn the_numbers_of_zones_and_corners_are_limited() {
        let many = |zones: usize| Geofence::new(vec![zone(ZoneKind::KeepOut, &L); zones]).map(|_| ());
        assert_eq!(many(ZONES_MAX), Ok(()));
        assert_eq!(many(ZONES_MAX + 1).unwrap_err().to_string(), "there are 101 zones: at most 100 are allowed");
        let ring = |vertices: usize| {
            let vertex = |n: usize| {
                let (sin, cos) = crate::math::sin_cos(n as f64 / vertices as f64 * crate::math::TAU);
                (1000.0 * cos, 1000.0 * sin)
            };
            Geofence::new(vec![zone(ZoneKind::KeepIn, &(0..vertices).map(vertex).collect::<Vec<_>>())]).map(|_| ())
        };
        assert_eq!(ring(VERTICES_MAX), Ok(()));
        assert!(ring(VERTICES_MAX + 1).unwrap_err().to_string().starts_with("the zones have 1001 vertices"));
    }

    #[test]
    fn the_distance_of_crossing_sides_is_zero() {
        let at = |x_m, y_m| Position::from_m(x_m, y_m);
        let one = (at(0.0, 0.0), at(10.0, 0.0));
        assert_eq!(squared_between_m2(one, (at(5.0, -1.0), at(5.0, 1.0))), 0.0);
        assert_eq!(squared_between_m2(one, (at(5.0, 2.0), at(5.0, 9.0))), 4.0);
        assert_eq!(squared_between_m2(one, (at(13.0, 4.0), at(20.0, 4.0))), 25.0);
        let side = Side { zone: 0, from: at(5.0, -1.0), to: at(5.0, 1.0) };
        assert_eq!(crossed_at(at(0.0, 0.0), Displacement::from_m(2.0, 0.0), &side), Some(2.5));
        assert_eq!(crossed_at(at(0.0, 0.0), Displacement::from_m(-2.0, 0.0), &side), None);
        assert_eq!(crossed_at(at(0.0, 3.0), Displacement::from_m(2.0, 0.0), &side), None);
    }

    /// Two squares 100 m apart, as one zone before and after another zone.
    #[test]
    fn a_zone_with_several_parts_is_their_union() {
        let square =
            |x_m: f64| zone(ZoneKind::KeepIn, &[(x_m, 0.0), (x_m + 100.0, 0.0), (x_m + 100.0, 100.0), (x_m, 100.0)]);
        let at = |x_m| Position::from_m(x_m, 50.0);
        for kind in [ZoneKind::KeepIn, ZoneKind::KeepOut] {
            let [one, other] = [square(0.0), square(200.0)].map(|square| Zone { kind, ..square });
            let part = Zone { part_of: Some(0), ..other };
            let far = zone(ZoneKind::KeepOut, &[(900.0, 0.0), (950.0, 0.0), (900.0, 50.0)]);
            let geofence = Geofence::new(vec![one, far, part.clone()]).unwrap();
            for (x_m, is_inside) in [(-50.0, false), (50.0, true), (150.0, false), (250.0, true), (350.0, false)] {
                let is_violated = is_inside == (kind == ZoneKind::KeepOut);
                assert_eq!(geofence.contains(at(x_m)), !is_violated, "{x_m} m");
                let violated: Vec<usize> = geofence.violated_zones_between(at(x_m), [300.0; 2]).collect();
                assert_eq!(violated, if is_violated { vec![0] } else { vec![] });
                let room_m = geofence.room_at_m(at(x_m));
                assert_eq!(room_m, if is_violated { -50.0 } else { 50.0 }, "{x_m} m");
            }
            assert_eq!(geofence.crosses(at(50.0), at(250.0), [300.0; 2]).collect::<Vec<_>>(), [0]);
            assert_eq!(geofence.zones().last(), Some(&part));
            assert_eq!(geofence.part(geofence.binding([300.0; 2])), geofence);
        }
    }

    #[test]
    fn a_part_must_fit_its_zone() {
        let part = |part_of, kind, x_m: f64| {
            let vertices = [(x_m, 0.0), (x_m + 100.0, 0.0), (x_m, 100.0)];
            Zone { part_of, ..zone(kind, &vertices) }
        };
        let one = || part(None, ZoneKind::KeepIn, 0.0);
        let error = |zones: Vec<Zone>| Geofence::new(zones).unwrap_err().to_string();
        let expected = "zone 1: part_of = 0: must be the index of an earlier zone of the same kind";
        assert!(error(vec![one(), part(Some(0), ZoneKind::KeepOut, 900.0)]).starts_with(expected));
        assert!(error(vec![one(), part(Some(1), ZoneKind::KeepIn, 900.0)]).contains("part_of = 1: must be"));
        let touching = "zone 1: part_of = 0: it touches zone 0; join them to one outline";
        assert_eq!(error(vec![one(), part(Some(0), ZoneKind::KeepIn, 100.0)]), touching);
        assert_eq!(error(vec![one(), part(Some(0), ZoneKind::KeepIn, 20.0)]), touching);
        assert!(Geofence::new(vec![one(), part(Some(0), ZoneKind::KeepIn, 101.0)]).is_ok());
    }
}
