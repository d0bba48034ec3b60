//! Priorities: how much a target counts in decisions, and areas of interest.
//!
//! A target of priority 5 counts as much as five targets of priority 1, the default. A target inside areas of interest
//! has the highest of their priorities and its own.

use crate::frame::Position;
use crate::validation::Allowed;

/// Range of priorities.
pub const PRIORITY: Allowed = Allowed::at_least(0.01).at_most(100.0);

/// Area whose targets matter: a polygon, convex or not.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct AreaOfInterest {
    /// Corners in order, clockwise or anticlockwise. The last is joined to the first.
    pub vertices: Vec<Position>,
    /// Priority of the targets inside, in the range [`PRIORITY`].
    pub priority: f64,
}

/// Returns the priority of a target at a position: the highest of its own and those of the areas around it.
pub fn priority_at(own: f64, at: Position, areas: &[AreaOfInterest]) -> f64 {
    let around = areas.iter().filter(|area| is_inside(&area.vertices, at));
    around.map(|area| area.priority).fold(own, f64::max)
}

/// Returns true if a position is inside a polygon: a ray to the east crosses its sides an odd number of times.
pub(crate) fn is_inside(vertices: &[Position], at: Position) -> bool {
    let sides = vertices.iter().zip(vertices.iter().cycle().skip(1));
    let crossed = sides.filter(|(from, to)| {
        (from.y_m() > at.y_m()) != (to.y_m() > at.y_m()) && {
            let share = (at.y_m() - from.y_m()) / (to.y_m() - from.y_m());
            at.x_m() < from.x_m() + share * (to.x_m() - from.x_m())
        }
    });
    crossed.count() % 2 == 1
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The second area is an L that does not contain its own centre of mass.
    #[test]
    fn a_target_has_the_highest_priority_of_its_own_and_of_the_areas_around_it() {
        let area = |priority, corners: &[(f64, f64)]| AreaOfInterest {
            vertices: corners.iter().map(|(x_m, y_m)| Position::from_m(*x_m, *y_m)).collect(),
            priority,
        };
        let square = area(3.0, &[(0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0)]);
        let bent = area(5.0, &[(0.0, 0.0), (90.0, 0.0), (90.0, 5.0), (5.0, 5.0), (5.0, 90.0), (0.0, 90.0)]);
        let areas = [square, bent];
        let at = |own, x_m, y_m| priority_at(own, Position::from_m(x_m, y_m), &areas);
        assert_eq!([at(1.0, 9.0, 9.0), at(1.0, 2.0, 2.0), at(1.0, 30.0, 30.0)], [3.0, 5.0, 1.0]);
        assert_eq!([at(4.0, 9.0, 9.0), at(4.0, 80.0, 2.0), at(0.5, 30.0, 30.0)], [4.0, 5.0, 0.5]);
        assert_eq!(priority_at(2.0, Position::ORIGIN, &[]), 2.0);
    }
}
