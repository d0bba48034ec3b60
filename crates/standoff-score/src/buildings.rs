//! Buildings that hide targets from sensors: whether the line of sight from a UAV to a target is free.

use std::sync::Arc;

use rstar::{AABB, RTree, RTreeObject, SelectionFunction};
use standoff::{Displacement, Position};

/// Maximum number of buildings.
pub const BUILDINGS_MAX: usize = 20_000;

/// Maximum number of vertices of all buildings.
pub const BUILDING_VERTICES_MAX: usize = 100_000;

/// Maximum height of a building, m; the highest one is 828 m high.
pub const BUILDING_HEIGHT_MAX_M: f64 = 1_000.0;

/// Largest distance of a vertex from the origin, east or north, m.
const PLACE_MAX_M: f64 = 1e7;

/// Part of a line of sight below which a passage through a building counts as touching its corner.
const GRAZE: f64 = 1e-9;

/// Distance from a wall within which a point is on the wall and not inside, m.
const WALL_M: f64 = 1e-6;

/// A building: a prism from the ground to its height.
#[derive(Debug, Clone, PartialEq)]
pub struct Building {
    /// Height above the ground, m; above 0, at most [`BUILDING_HEIGHT_MAX_M`].
    pub height_m: f64,
    /// Outlines, then courtyards, each with at least three vertices and without repetition of the first one. A point is
    /// inside if a ray from it crosses them an odd number of times.
    pub rings: Vec<Vec<Position>>,
}

/// Buildings with a spatial index. Copies share their memory.
#[derive(Debug, Clone, Default)]
pub struct Buildings {
    all: Arc<Vec<Building>>,
    index: Arc<RTree<Indexed>>,
}

/// Buildings are equal if their outlines and heights are; the index follows from them.
impl PartialEq for Buildings {
    fn eq(&self, other: &Self) -> bool {
        self.all == other.all
    }
}

impl Buildings {
    /// Makes the index. Fails if a building is invalid or there are too many; the message begins with the index of the
    /// building, if it concerns a single one.
    pub fn new(all: Vec<Building>) -> Result<Self, String> {
        if all.len() > BUILDINGS_MAX {
            return Err(format!("{} buildings; must be at most {BUILDINGS_MAX}", all.len()));
        }
        let vertices: usize = all.iter().flat_map(|building| &building.rings).map(Vec::len).sum();
        if vertices > BUILDING_VERTICES_MAX {
            return Err(format!("{vertices} vertices of buildings; must be at most {BUILDING_VERTICES_MAX}"));
        }
        for (index, building) in all.iter().enumerate() {
            building.check().map_err(|message| format!("building {index}: {message}"))?;
        }
        let boxes = all.iter().enumerate().map(|(index, building)| Indexed { index, envelope: building.envelope() });
        Ok(Self { index: Arc::new(RTree::bulk_load(boxes.collect())), all: Arc::new(all) })
    }

    /// True without any building.
    #[must_use]
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.all.is_empty()
    }

    /// Returns the buildings.
    #[must_use]
    pub fn all(&self) -> &[Building] {
        &self.all
    }

    /// Returns whether a building hides a target on the ground from a UAV: the straight line between them passes through
    /// the building below its height. Touching a wall, a corner or the roof hides nothing; a target inside a building is
    /// hidden from everywhere. Without an altitude, in m above the ground, the lowest one counts, from which every
    /// building on the line hides the target.
    #[must_use]
    #[inline]
    pub fn hide(&self, target: Position, uav: Position, altitude_m: Option<f64>) -> bool {
        !self.is_empty() && self.hide_behind_any(target, uav, altitude_m)
    }

    fn hide_behind_any(&self, target: Position, uav: Position, altitude_m: Option<f64>) -> bool {
        let line = LineOfSight::new(target, uav, altitude_m);
        let (mut crossed, mut crossings) = (self.index.locate_with_selection_function(&line), Vec::new());
        crossed.any(|found| self.all.get(found.index).is_some_and(|building| building.hides(&line, &mut crossings)))
    }
}

impl Building {
    fn check(&self) -> Result<(), String> {
        if !(self.height_m > 0.0 && self.height_m <= BUILDING_HEIGHT_MAX_M) {
            let height_m = self.height_m;
            return Err(format!("height = {height_m} m; must be above 0, at most {BUILDING_HEIGHT_MAX_M}"));
        }
        if self.rings.is_empty() {
            return Err("has no outline".to_owned());
        }
        for ring in &self.rings {
            if ring.len() < 3 {
                return Err(format!("an outline has {} different vertices; needs at least three", ring.len()));
            }
            let is_near = |at: &Position| at.x_m().abs() <= PLACE_MAX_M && at.y_m().abs() <= PLACE_MAX_M;
            if let Some(at) = ring.iter().find(|at| !is_near(at)) {
                let (x_m, y_m) = (at.x_m(), at.y_m());
                return Err(format!("vertex [{x_m}, {y_m}]: must be within {PLACE_MAX_M:e} m of the origin"));
            }
        }
        Ok(())
    }

    /// Smallest box around the building: east, north and up, m.
    fn envelope(&self) -> AABB<[f64; 3]> {
        let ends = |of: fn(&Position) -> f64| {
            let values = self.rings.iter().flatten().map(of);
            values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], value| [low.min(value), high.max(value)])
        };
        let ([west_m, east_m], [south_m, north_m]) = (ends(|at| at.x_m()), ends(|at| at.y_m()));
        AABB::from_corners([west_m, south_m, 0.0], [east_m, north_m, self.height_m])
    }

    /// Returns whether a line passes through the building below its height. The line rises from the target to the UAV,
    /// so it is lowest where it first enters the outline. `crossings` is a reused buffer.
    fn hides(&self, line: &LineOfSight, crossings: &mut Vec<f64>) -> bool {
        crossings.clear();
        crossings.extend([0.0, 1.0]);
        crossings.extend(self.walls().filter_map(|[a, b]| line.crossing(a, b)));
        crossings.sort_by(f64::total_cmp);
        let inside = crossings.windows(2).find(|ends| {
            let [from, to] = [ends[0], ends[1]];
            to - from > GRAZE && self.contains(line.at(0.5 * (from + to)))
        });
        inside.is_some_and(|ends| ends[0] * line.altitude_m < self.height_m)
    }

    /// Returns whether a point of the plane is inside the outlines and not on a wall.
    fn contains(&self, at: Position) -> bool {
        let mut is_inside = false;
        for [a, b] in self.walls() {
            let (wall, to_point) = ((b - a).vector(), (at - a).vector());
            let squared_m2 = wall.norm_squared();
            let along = if squared_m2 > 0.0 { (to_point.dot(&wall) / squared_m2).clamp(0.0, 1.0) } else { 0.0 };
            if (to_point - along * wall).norm_squared() <= WALL_M * WALL_M {
                return false;
            }
            // A ray to the east crosses the wall.
            if (a.y_m() > at.y_m()) != (b.y_m() > at.y_m()) {
                let x_m = a.x_m() + wall.x * (to_point.y / wall.y);
                is_inside ^= x_m > at.x_m();
            }
        }
        is_inside
    }

    fn walls(&self) -> impl Iterator<Item = [Position; 2]> {
        self.rings.iter().flat_map(|ring| {
            let next = ring.iter().skip(1).chain(ring.first());
            ring.iter().zip(next).map(|(a, b)| [*a, *b])
        })
    }
}

/// A straight line from a target on the ground to a UAV.
struct LineOfSight {
    target: Position,
    uav_rel_target: Displacement,
    altitude_m: f64,
}

impl LineOfSight {
    fn new(target: Position, uav: Position, altitude_m: Option<f64>) -> Self {
        let altitude_m = altitude_m.filter(|altitude_m| altitude_m.is_finite()).map_or(0.0, |metres| metres.max(0.0));
        Self { target, uav_rel_target: uav - target, altitude_m }
    }

    /// Point of the plane at a part of the line: 0 at the target, 1 at the UAV.
    fn at(&self, part: f64) -> Position {
        self.target + Displacement::from_m(part * self.uav_rel_target.x_m(), part * self.uav_rel_target.y_m())
    }

    /// Part of the line at which it crosses a wall; `None` if it does not, or is parallel. Walls are longer by `GRAZE`, so
    /// that rounding misses no crossing at a corner. An additional crossing has no effect, because the points between
    /// crossings decide.
    fn crossing(&self, a: Position, b: Position) -> Option<f64> {
        let (wall, a_rel_target) = ((b - a).vector(), (a - self.target).vector());
        let uav_rel_target = self.uav_rel_target.vector();
        let area = uav_rel_target.perp(&wall);
        let part = a_rel_target.perp(&wall) / area;
        let along_wall = a_rel_target.perp(&uav_rel_target) / area;
        let is_crossed = part > 0.0 && part < 1.0 && (-GRAZE..=1.0 + GRAZE).contains(&along_wall);
        (area != 0.0 && is_crossed).then_some(part)
    }

    /// Returns whether the line passes through a box, its faces included.
    fn meets(&self, envelope: &AABB<[f64; 3]>) -> bool {
        let (low, high) = (envelope.lower(), envelope.upper());
        let start = [self.target.x_m(), self.target.y_m(), 0.0];
        let along = [self.uav_rel_target.x_m(), self.uav_rel_target.y_m(), self.altitude_m];
        let (mut from, mut to) = (0.0f64, 1.0f64);
        // The height first: it excludes most of the line.
        for axis in [2, 0, 1] {
            if along[axis] == 0.0 {
                if start[axis] < low[axis] || start[axis] > high[axis] {
                    return false;
                }
                continue;
            }
            let ends = [low[axis], high[axis]].map(|face| (face - start[axis]) / along[axis]);
            (from, to) = (from.max(ends[0].min(ends[1])), to.min(ends[0].max(ends[1])));
            if from > to {
                return false;
            }
        }
        true
    }
}

/// Box of a building in the spatial index.
#[derive(Debug, Clone)]
struct Indexed {
    index: usize,
    envelope: AABB<[f64; 3]>,
}

impl RTreeObject for Indexed {
    type Envelope = AABB<[f64; 3]>;

    fn envelope(&self) -> Self::Envelope {
        self.envelope
    }
}

impl SelectionFunction<Indexed> for &LineOfSight {
    fn should_unpack_parent(&self, envelope: &AABB<[f64; 3]>) -> bool {
        self.meets(envelope)
    }

    fn should_unpack_leaf(&self, leaf: &Indexed) -> bool {
        self.meets(&leaf.envelope)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x_m: f64, y_m: f64) -> Position {
        Position::from_m(x_m, y_m)
    }

    fn building(height_m: f64, rings: &[&[(f64, f64)]]) -> Building {
        let ring = |ring: &&[(f64, f64)]| ring.iter().map(|(x_m, y_m)| at(*x_m, *y_m)).collect();
        Building { height_m, rings: rings.iter().map(ring).collect() }
    }

    /// A block of 20 m by 20 m, 10 m high.
    const BLOCK: &[(f64, f64)] = &[(0.0, 0.0), (20.0, 0.0), (20.0, 20.0), (0.0, 20.0)];

    fn hide(buildings: &[Building], target: (f64, f64), uav: (f64, f64), altitude_m: f64) -> bool {
        let (target, uav) = (at(target.0, target.1), at(uav.0, uav.1));
        Buildings::new(buildings.to_vec()).unwrap().hide(target, uav, Some(altitude_m))
    }

    /// A target 20 m east of the block, and a UAV 80 m west of the target.
    #[test]
    fn a_building_hides_what_is_behind_it_below_its_height() {
        let block = [building(10.0, &[BLOCK])];
        // The line enters the block 20 m from the target, a quarter of the way to the UAV.
        for (altitude_m, expected) in [(1.0, true), (39.9, true), (40.0, false), (300.0, false)] {
            assert_eq!(hide(&block, (40.0, 10.0), (-40.0, 10.0), altitude_m), expected, "{altitude_m} m");
        }
        // A target in front of the building, and a UAV on the same side.
        assert!(!hide(&block, (-5.0, 10.0), (-40.0, 10.0), 1.0));
        // Without an altitude, every building on the line counts.
        let all = Buildings::new(block.to_vec()).unwrap();
        assert!(all.hide(at(40.0, 10.0), at(-40.0, 10.0), None));
        assert!(all.hide(at(40.0, 10.0), at(-40.0, 10.0), Some(f64::NAN)));
        assert!(!Buildings::default().hide(at(40.0, 10.0), at(-40.0, 10.0), None));
    }

    #[test]
    fn touching_a_corner_or_a_wall_hides_nothing() {
        let block = [building(10.0, &[BLOCK])];
        // Through the corner (0, 20); a millimetre further inside it is hidden.
        assert!(!hide(&block, (-20.0, 0.0), (20.0, 40.0), 5.0));
        assert!(hide(&block, (-20.0, -0.001), (20.0, 39.999), 5.0));
        // Along each wall.
        for (target, uav) in [
            ((-10.0, 0.0), (30.0, 0.0)),
            ((-10.0, 20.0), (30.0, 20.0)),
            ((0.0, -10.0), (0.0, 30.0)),
            ((20.0, -10.0), (20.0, 30.0)),
        ] {
            assert!(!hide(&block, target, uav, 5.0), "{target:?}");
            assert!(!hide(&block, uav, target, 5.0), "{target:?}");
        }
        // Through two opposite corners, the block itself hides.
        assert!(hide(&block, (-10.0, -10.0), (30.0, 30.0), 5.0));
        // A target at a wall sees the UAV in front of it, but none behind the building.
        assert!(!hide(&block, (0.0, 10.0), (-40.0, 10.0), 50.0));
        assert!(hide(&block, (0.0, 10.0), (40.0, 10.0), 500.0));
    }

    #[test]
    fn a_target_inside_is_hidden_and_a_uav_above_a_roof_sees_past_it() {
        let block = [building(10.0, &[BLOCK])];
        assert!(hide(&block, (10.0, 10.0), (10.0, 10.0), 300.0));
        assert!(hide(&block, (10.0, 10.0), (-500.0, 10.0), 300.0));
        // Directly above a target next to the block.
        assert!(!hide(&block, (-1.0, 10.0), (-1.0, 10.0), 300.0));
        // The UAV is above the roof, the target on the ground outside, near and far from the wall.
        assert!(!hide(&block, (-5.0, 10.0), (10.0, 10.0), 300.0));
        assert!(hide(&block, (-5.0, 10.0), (10.0, 10.0), 25.0));
    }

    /// A U that is open to the north, and a block with a courtyard.
    #[test]
    fn concave_buildings_and_courtyards_hide_what_is_behind_their_walls() {
        let u: &[(f64, f64)] = &[
            (0.0, 0.0),
            (30.0, 0.0),
            (30.0, 30.0),
            (20.0, 30.0),
            (20.0, 10.0),
            (10.0, 10.0),
            (10.0, 30.0),
            (0.0, 30.0),
        ];
        let u = [building(10.0, &[u])];
        assert!(!hide(&u, (15.0, 20.0), (15.0, 100.0), 5.0));
        assert!(hide(&u, (15.0, 20.0), (100.0, 20.0), 5.0));
        // Above the near wall, 5 m from the target, and above the far wall of the line across both.
        assert!(!hide(&u, (15.0, 20.0), (65.0, 20.0), 101.0));
        assert!(hide(&u, (40.0, 20.0), (-60.0, 20.0), 99.0));
        assert!(!hide(&u, (40.0, 20.0), (-60.0, 20.0), 101.0));
        let hole: &[(f64, f64)] = &[(5.0, 5.0), (15.0, 5.0), (15.0, 15.0), (5.0, 15.0)];
        let court = [building(10.0, &[BLOCK, hole])];
        assert!(!hide(&court, (10.0, 10.0), (10.0, 10.0), 300.0));
        assert!(hide(&court, (10.0, 10.0), (110.0, 10.0), 150.0));
        assert!(!hide(&court, (10.0, 10.0), (110.0, 10.0), 201.0));
    }

    /// Random lines through random blocks at random altitudes.
    #[test]
    fn the_index_finds_what_all_buildings_hide() {
        let mut state = 7u64;
        let mut uniform = |low: f64, high: f64| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            low + (high - low) * ((state >> 11) as f64 / (1u64 << 53) as f64)
        };
        let all: Vec<Building> = (0..1_500)
            .map(|_| {
                let (x_m, y_m) = (uniform(-1e3, 1e3), uniform(-1e3, 1e3));
                let mut corner = |x: f64, y: f64| (x_m + x * uniform(2.0, 20.0), y_m + y * uniform(2.0, 20.0));
                let ring = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
                building(uniform(2.0, 60.0), &[&ring])
            })
            .collect();
        let indexed = Buildings::new(all.clone()).unwrap();
        let mut hidden = 0;
        for _ in 0..4_000 {
            let (target, uav) =
                (at(uniform(-1e3, 1e3), uniform(-1e3, 1e3)), at(uniform(-2e3, 2e3), uniform(-2e3, 2e3)));
            let altitude_m = uniform(10.0, 600.0);
            let line = LineOfSight::new(target, uav, Some(altitude_m));
            let expected = all.iter().any(|building| building.hides(&line, &mut Vec::new()));
            assert_eq!(indexed.hide(target, uav, Some(altitude_m)), expected, "{target:?} {uav:?} {altitude_m}");
            hidden += u32::from(expected);
        }
        assert!((1_000..3_500).contains(&hidden), "{hidden}");
        // The order of the buildings does not matter.
        let reversed = Buildings::new(all.into_iter().rev().collect()).unwrap();
        let (target, uav) = (at(0.0, 0.0), at(900.0, 0.0));
        assert_eq!(indexed.hide(target, uav, Some(60.0)), reversed.hide(target, uav, Some(60.0)));
    }

    #[test]
    fn invalid_buildings_are_refused() {
        let error = |building: Building| Buildings::new(vec![building]).unwrap_err();
        assert!(error(building(0.0, &[BLOCK])).contains("building 0: height = 0 m; must be above 0"));
        assert!(error(building(f64::NAN, &[BLOCK])).contains("height"));
        assert!(error(building(5.0, &[])).contains("no outline"));
        assert!(error(building(5.0, &[&BLOCK[..2]])).contains("has 2 different vertices"));
        assert!(error(building(5.0, &[&[(0.0, 0.0), (1e8, 0.0), (0.0, 1.0)]])).contains("must be within"));
        assert!(
            Buildings::new(vec![building(5.0, &[BLOCK]); BUILDINGS_MAX + 1]).unwrap_err().contains("at most 20000")
        );
        let round = vec![(0.0, 0.0); BUILDING_VERTICES_MAX + 1];
        assert!(error(building(5.0, &[&round])).contains("at most 100000"));
    }
}
