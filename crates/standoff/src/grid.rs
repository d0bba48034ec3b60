//! Spatial index: a grid of square cells, sorted by row and column.
//!
//! A search returns candidates: every point within the radius, and some beyond it. The caller compares distances, so
//! that results do not depend on the cells.

use core::ops::Range;

use crate::frame::Position;

/// With at most this many points, all are candidates: computing their distances is faster than cells.
const FEW: usize = 16;

/// Largest row and column. Coordinates beyond it share the outermost cells.
const CELL_MAX: f64 = 1e9;

/// Margin of a search, as a fraction of coordinates and radius. It covers rounding.
const MARGIN: f64 = 1e-12;

/// A point in its cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Entry {
    row: i32,
    column: i32,
    index: u32,
}

/// Grid of points, each with its index in the order in which it was added.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Grid {
    cell_m: f64,
    count: usize,
    /// Empty if the points are few.
    entries: Vec<Entry>,
    /// Points while the cells are computed, and for searches of the nearest one.
    positions: Vec<Position>,
    /// Occupied rows, ascending, each with the index of its first entry.
    rows: Vec<(i32, usize)>,
}

impl Grid {
    /// Creates a grid of these points.
    pub fn of(positions: impl IntoIterator<Item = Position>, cell_m: f64) -> Self {
        let mut grid = Self::default();
        grid.fill(positions, cell_m);
        grid
    }

    /// Replaces the points; reuses the memory. The width of a cell is normally half the radius of a search or all of it.
    pub fn fill(&mut self, positions: impl IntoIterator<Item = Position>, cell_m: f64) {
        let Self { count, entries, rows, positions: all, .. } = self;
        all.clear();
        all.extend(positions);
        *count = all.len();
        self.cell_m = if cell_m > 0.0 && cell_m.is_finite() { cell_m } else { 1.0 };
        entries.clear();
        rows.clear();
        if *count <= FEW {
            return;
        }
        let cell_m = self.cell_m;
        entries.extend((0..).zip(&*all).map(|(index, at)| Entry {
            row: cell(at.y_m(), cell_m),
            column: cell(at.x_m(), cell_m),
            index,
        }));
        entries.sort_unstable();
        for (start, entry) in entries.iter().enumerate() {
            if rows.last().is_none_or(|(row, _)| *row != entry.row) {
                rows.push((entry.row, start));
            }
        }
    }

    /// Like [`Self::fill`], with a mean of two points in a cell.
    pub(crate) fn fill_evenly(&mut self, positions: impl Iterator<Item = Position> + Clone) {
        let span_m = |of: fn(Position) -> f64| {
            let [low, high] = [f64::min, f64::max].map(|least| positions.clone().map(of).reduce(least));
            high.zip(low).map_or(0.0, |(high_m, low_m)| high_m - low_m)
        };
        let count = positions.clone().count();
        let per_cell = 2.0 / count.max(1) as f64;
        let cell_m = match [span_m(Position::x_m), span_m(Position::y_m)] {
            _ if count <= FEW => 1.0,
            [x_m, y_m] => (x_m * y_m * per_cell).sqrt().max(x_m.max(y_m) * per_cell),
        };
        self.fill(positions, cell_m);
    }

    /// Indices of the points within a distance, and of some beyond it, in no particular order.
    pub fn near(&self, at: Position, radius_m: f64) -> Near<'_> {
        if self.count <= FEW || !(radius_m >= 0.0 && at.is_finite()) {
            // A search without a valid disc has all points as candidates.
            return Near { entries: &[], rows: &[], all: &self.entries, columns: (0, 0), few: 0..self.count as u32 };
        }
        let span = |value_m: f64| {
            let reach_m = radius_m + MARGIN * (value_m.abs() + radius_m);
            (cell(value_m - reach_m, self.cell_m), cell(value_m + reach_m, self.cell_m))
        };
        let (rows, columns) = (span(at.y_m()), span(at.x_m()));
        let first = self.rows.partition_point(|(row, _)| *row < rows.0);
        let count = self.rows[first..].partition_point(|(row, _)| *row <= rows.1);
        Near { entries: &[], rows: &self.rows[first..first + count], all: &self.entries, columns, few: 0..0 }
    }

    /// Like [`Self::near`], in ascending order, as if all points were examined one after the other.
    pub fn near_ascending<'a>(
        &self,
        at: Position,
        radius_m: f64,
        buffer: &'a mut Vec<usize>,
    ) -> impl Iterator<Item = usize> + Clone + use<'a> {
        buffer.clear();
        // Few candidates are in order and need no memory.
        let few = if self.count <= FEW { 0..self.count } else { 0..0 };
        if self.count > FEW {
            buffer.extend(self.near(at, radius_m));
            buffer.sort_unstable();
        }
        few.chain(buffer.iter().copied())
    }

    /// Indices of the nearest points, as many as `count`; of ties the first.
    pub(crate) fn nearest_few(&self, at: Position, count: usize) -> Vec<usize> {
        let squared_m2 = |index: usize| (self.positions[index].squared_distance_m2(at), index);
        let mut radius_m = self.cell_m;
        let mut found: Vec<(f64, usize)> = Vec::new();
        while found.len() < count {
            // From some radius on, all points are candidates anyway.
            let is_last = self.count <= FEW || radius_m > 64.0 * self.cell_m;
            let candidates = self.near(at, if is_last { f64::INFINITY } else { radius_m }).map(squared_m2);
            found.clear();
            found.extend(candidates.filter(|(squared_m2, _)| is_last || *squared_m2 <= radius_m * radius_m));
            if is_last {
                break;
            }
            radius_m *= 2.0;
        }
        found.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        found.truncate(count);
        found.into_iter().map(|(_, index)| index).collect()
    }

    /// Squared distance, m2, and index of the nearest point that counts; of ties the first.
    pub fn nearest(&self, at: Position, counts: impl Fn(usize) -> bool) -> Option<(f64, usize)> {
        let nearest_of = |candidates: Near<'_>| {
            let squared = candidates
                .filter(|index| counts(*index))
                .map(|index| (self.positions[index].squared_distance_m2(at), index));
            squared.filter(|(squared_m2, _)| !squared_m2.is_nan()).reduce(|a, b| if b < a { b } else { a })
        };
        let mut radius_m = self.cell_m;
        // From some radius on, all points are candidates anyway.
        while self.count > FEW && radius_m < 64.0 * self.cell_m {
            let found = nearest_of(self.near(at, radius_m));
            if found.is_some_and(|(squared_m2, _)| squared_m2 <= radius_m * radius_m) {
                return found;
            }
            radius_m *= 2.0;
        }
        nearest_of(self.near(at, f64::INFINITY))
    }
}

/// Row or column of a coordinate. It never decreases with the coordinate, so that no point is missed.
fn cell(value_m: f64, cell_m: f64) -> i32 {
    (value_m / cell_m).floor().clamp(-CELL_MAX, CELL_MAX) as i32
}

/// Candidates of a search in a [`Grid`].
#[derive(Debug, Clone)]
pub struct Near<'a> {
    /// Rest of the current row.
    entries: &'a [Entry],
    /// Rows to come.
    rows: &'a [(i32, usize)],
    all: &'a [Entry],
    /// First and last column.
    columns: (i32, i32),
    /// Candidates if the points are few.
    few: Range<u32>,
}

impl Iterator for Near<'_> {
    type Item = usize;

    #[inline]
    fn next(&mut self) -> Option<usize> {
        loop {
            if let [entry, rest @ ..] = self.entries {
                self.entries = rest;
                return Some(entry.index as usize);
            }
            let [(row, start), rows @ ..] = self.rows else { return self.few.next().map(|index| index as usize) };
            self.rows = rows;
            let end = rows.first().map_or_else(
                || start + self.all[*start..].partition_point(|entry| entry.row == *row),
                |(_, next)| *next,
            );
            let of_row = &self.all[*start..end];
            let first = of_row.partition_point(|entry| entry.column < self.columns.0);
            let count = of_row[first..].partition_point(|entry| entry.column <= self.columns.1);
            self.entries = &of_row[first..first + count];
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coordination::clustering::Draw;

    fn at(points: &[(f64, f64)]) -> Vec<Position> {
        points.iter().map(|(x_m, y_m)| Position::from_m(*x_m, *y_m)).collect()
    }

    /// Checks searches about each point and between points against the comparison with all points.
    fn check(positions: &[Position], cell_m: f64, radii_m: &[f64]) {
        let (grid, mut buffer) = (Grid::of(positions.iter().copied(), cell_m), Vec::new());
        let centres = positions.iter().copied().chain(positions.windows(2).map(|two| two[0].midpoint(two[1])));
        for (centre, radius_m) in centres.flat_map(|centre| radii_m.iter().map(move |radius_m| (centre, *radius_m))) {
            let is_near = |index: &usize| positions[*index].distance_m(centre) <= radius_m;
            let candidates: Vec<usize> = grid.near_ascending(centre, radius_m, &mut buffer).collect();
            assert!(candidates.is_sorted_by(|a, b| a < b) && candidates.iter().all(|index| *index < positions.len()));
            let found: Vec<usize> = candidates.iter().copied().filter(is_near).collect();
            assert_eq!(found, (0..positions.len()).filter(is_near).collect::<Vec<_>>(), "{centre:?} {radius_m}");
            let squared = positions.iter().enumerate().filter(|(_, at)| **at != centre);
            let squared = squared.map(|(index, at)| (at.squared_distance_m2(centre), index));
            let nearest = squared.min_by(|a, b| a.partial_cmp(b).unwrap());
            assert_eq!(grid.nearest(centre, |index| positions[index] != centre), nearest);
            let mut all: Vec<usize> = (0..positions.len()).collect();
            all.sort_by(|a, b| {
                let squared_m2 = |index: &usize| positions[*index].squared_distance_m2(centre);
                squared_m2(a).total_cmp(&squared_m2(b)).then(a.cmp(b))
            });
            all.truncate(7);
            assert_eq!(grid.nearest_few(centre, 7), all);
        }
    }

    #[test]
    fn an_empty_grid_has_no_candidates() {
        let grid = Grid::of([], 100.0);
        assert_eq!((grid.count, grid.near(Position::ORIGIN, 1e9).count()), (0, 0));
        assert_eq!(grid.nearest(Position::ORIGIN, |_| true), None);
    }

    #[test]
    fn searches_find_every_point_within_the_radius() {
        for count in [1, 2, FEW, FEW + 1, 300] {
            let mut draw = Draw(7);
            let mut coordinate = || draw.below(1 << 20) as f64 / 100.0 - 5000.0;
            let positions: Vec<_> = (0..count).map(|_| Position::from_m(coordinate(), coordinate())).collect();
            for cell_m in [1.0, 250.0, 600.0, 1e5] {
                check(&positions, cell_m, &[0.0, 1.0, 500.0, 600.0, 3000.0]);
            }
        }
    }

    /// All points in one cell, and on the borders and corners of cells, at a distance of exactly the radius.
    #[test]
    fn points_on_borders_of_cells_are_found() {
        check(&at(&[(0.5, 0.5); 40]), 10.0, &[0.0, 1.0]);
        let lattice: Vec<_> =
            (-40..40).map(|i| Position::from_m(f64::from(i % 9) * 10.0, f64::from(i / 9) * 10.0)).collect();
        check(&lattice, 10.0, &[0.0, 10.0, 20.0, 30.0]);
    }

    #[test]
    fn outliers_and_huge_coordinates_are_found() {
        let mut points: Vec<(f64, f64)> = (0..30).map(|i| (f64::from(i), f64::from(i % 7))).collect();
        points.extend([(1e8, -1e8), (1e8 + 1.0, -1e8), (-1e15, 3.0), (1e300, -1e300), (-1e300, 1e300)]);
        check(&at(&points), 0.5, &[0.0, 1.0, 2.5, 1e8, 1e15]);
        check(&at(&points[..32]), 1e-3, &[0.0, 1.0, 2.5, 1e8]);
    }

    /// A point that is not a number is no reason to miss another one, and a search about such a point ends.
    #[test]
    fn invalid_numbers_do_no_harm() {
        let mut points = vec![(1.0, 1.0); 40];
        points[3] = (f64::NAN, 1.0);
        points[4] = (f64::INFINITY, f64::NEG_INFINITY);
        let grid = Grid::of(at(&points), 0.0);
        let near = |at, radius_m| grid.near(at, radius_m).filter(|index| points[*index] == (1.0, 1.0)).count();
        let [valid, invalid] = [1.0, f64::NAN].map(|x_m| Position::from_m(x_m, 1.0));
        assert_eq!(
            (near(valid, 0.5), near(valid, f64::INFINITY), near(valid, f64::NAN), near(invalid, 1.0)),
            (38, 38, 38, 38)
        );
        assert_eq!(grid.nearest(valid, |index| index > 2), Some((0.0, 5)));
    }
}
