//! Sensor pointing: a UAV points its sensor at the middle of the angular extent of its group's members. If they do not
//! all fit into the field of view, it points at the middle of the set with the highest total priority that fits.
//!
//! The middle minimises the largest off-boresight angle of the members. Let L and R be the outermost two members, at
//! distances l and r from the UAV. The boresight meets the line between them in the point Q that divides it in the
//! ratio of these distances:
//!
//! ```text
//! Q  = w L + (1 - w) R            w  = r / (l + r)
//! Q' = w L' + (1 - w) R' + w' (L - R)        w' = (r' l - r l') / (l + r)^2
//! ```

use nalgebra::Matrix2;

use crate::frame::{Displacement, Position, Velocity};
use crate::math;
use crate::output::PointingTarget;
use crate::target::TargetState;
use crate::uav::UavState;

/// Middle of the angular extent of targets, seen from a UAV, as a point with the velocity that results from the motion
/// of the targets and the UAV. `None` if the extent is wider than `widest_rad`. Also `None` if a target is more than 90
/// degrees off the direction to their `centre`, because the middle is then undefined.
pub(crate) fn angular_midpoint(
    uav: &UavState,
    centre: Position,
    targets: impl Iterator<Item = TargetState>,
    widest_rad: f64,
) -> Option<PointingTarget> {
    let towards = (centre - uav.position).vector();
    // For the rightmost and the leftmost target: tangent of the angle off the centre, anticlockwise, and the target.
    let mut outermost: Option<[(f64, TargetState); 2]> = None;
    for target in targets {
        let target_rel_uav = (target.position() - uav.position).vector();
        let (ahead, aside) = (towards.dot(&target_rel_uav), towards.perp(&target_rel_uav));
        let one = (aside / ahead, target);
        if !(ahead > 0.0 && one.0.is_finite()) {
            return None;
        }
        let [right, left] = outermost.unwrap_or([one; 2]);
        outermost = Some([if one.0 < right.0 { one } else { right }, if one.0 > left.0 { one } else { left }]);
    }
    let [(_, right), (_, left)] = outermost?;
    let [right_rel_uav, left_rel_uav] = [right, left].map(|target| (target.position() - uav.position).vector());
    if math::atan2(right_rel_uav.perp(&left_rel_uav), right_rel_uav.dot(&left_rel_uav)) > widest_rad {
        return None;
    }
    let own_velocity = Velocity::from_polar(uav.speed_m_s, uav.heading);
    let range = |target: &TargetState| {
        let target_rel_uav = target.position() - uav.position;
        let velocity_rel_uav = (target.velocity() - own_velocity).vector();
        (target_rel_uav.length_m(), target_rel_uav.vector().dot(&velocity_rel_uav) / target_rel_uav.length_m())
    };
    let ((l_m, l_m_s), (r_m, r_m_s)) = (range(&left), range(&right));
    let both_m = l_m + r_m;
    let (share, share_1_s) = (r_m / both_m, (r_m_s * l_m - r_m * l_m_s) / (both_m * both_m));
    let left_rel_right = (left.position() - right.position()).vector();
    let from_right = left_rel_right * share;
    let velocity_rel_right = (left.velocity() - right.velocity()).vector() * share + left_rel_right * share_1_s;
    let look = PointingTarget {
        position: right.position() + Displacement::from_m(from_right.x, from_right.y),
        velocity: right.velocity() + Velocity::from(velocity_rel_right),
    };
    (look.position.is_finite() && look.velocity.is_finite()).then_some(look)
}

/// Middle of the set of targets with the highest total priority that fits into the field of view of a UAV. Of equal
/// sets, the one with the largest total position variance is used, so that targets out of view are looked at next. If
/// the variances are equal too, the nearest set is used. Each target is given with its position variance, m2, and its
/// priority. `None` if the field of view is half a turn or more, or if there are no targets.
///
/// In an optimal set one target can be at the right edge of the field of view, so each target is tried there.
pub(crate) fn angular_midpoint_of_most(
    uav: &UavState,
    targets: impl Iterator<Item = (TargetState, f64, f64)> + Clone,
    field_of_view_rad: f64,
) -> Option<PointingTarget> {
    if field_of_view_rad >= math::PI {
        return None;
    }
    let target_rel_uav = |target: &TargetState| (target.position() - uav.position).vector();
    let turned_by = |angle_rad: f64| {
        let (sin, cos) = math::sin_cos(angle_rad);
        Matrix2::new(cos, -sin, sin, cos)
    };
    let to_left_edge = turned_by(field_of_view_rad);
    let fitting = |right: TargetState| {
        let right_rel_uav = target_rel_uav(&right);
        let left_edge = to_left_edge * right_rel_uav;
        targets.clone().filter(move |(target, ..)| {
            let target_rel_uav = target_rel_uav(target);
            right_rel_uav.perp(&target_rel_uav) >= 0.0 && target_rel_uav.perp(&left_edge) >= 0.0
        })
    };
    let mut best: Option<(f64, f64, f64, TargetState)> = None;
    for (right, ..) in targets.clone() {
        let (priority, variance_m2, distance_m2) =
            fitting(right).fold((0.0, 0.0, 0.0), |(sum, variance_m2, distance_m2), (target, m2, priority)| {
                (sum + priority, variance_m2 + m2, distance_m2 + target_rel_uav(&target).norm_squared())
            });
        let is_better = best.is_none_or(|(highest, best_m2, nearest_m2, _)| {
            // Rounding must not decide between equal variances.
            let is_equal = (variance_m2 - best_m2).abs() <= 1e-9 * best_m2;
            priority > highest
                || (priority == highest && if is_equal { distance_m2 < nearest_m2 } else { variance_m2 > best_m2 })
        });
        if is_better {
            best = Some((priority, variance_m2, distance_m2, right));
        }
    }
    let (.., right) = best?;
    let ahead = turned_by(0.5 * field_of_view_rad) * target_rel_uav(&right);
    let ahead = uav.position + Displacement::from_m(ahead.x, ahead.y);
    angular_midpoint(uav, ahead, fitting(right).map(|(target, ..)| target), math::PI)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::angle::Angle;
    use crate::time::Duration;

    const UAV: UavState = UavState::level_flight(Position::ORIGIN, Angle::ZERO, 40.0);

    fn at_deg(distance_m: f64, bearing_deg: f64, velocity: (f64, f64)) -> TargetState {
        let position = Position::ORIGIN + Displacement::from_polar(distance_m, Angle::from_deg(bearing_deg));
        TargetState::new(position, Velocity::from_m_s(velocity.0, velocity.1), [0.0, 0.0])
    }

    /// Targets from 60 to 100 degrees at different distances: the middle is at 80 degrees, independent of the centre
    /// and of other targets in between.
    #[test]
    fn the_middle_is_half_way_between_the_outermost_targets() {
        let targets =
            [at_deg(400.0, 100.0, (0.0, 0.0)), at_deg(300.0, 61.0, (0.0, 0.0)), at_deg(250.0, 60.0, (0.0, 0.0))];
        for centre_deg in [62.0, 90.0, 130.0] {
            let centre = at_deg(300.0, centre_deg, (0.0, 0.0)).position();
            let look = angular_midpoint(&UAV, centre, targets.into_iter(), math::PI).unwrap();
            assert!((look.boresight(UAV.position, Duration::ZERO).rad().to_degrees() - 80.0).abs() < 1e-9);
            let of = |widest_deg: f64| angular_midpoint(&UAV, centre, targets.into_iter(), widest_deg.to_radians());
            assert_eq!((of(40.1), of(39.9)), (Some(look), None));
        }
    }

    /// Half a second later, when the UAV has flown 20 m and the targets 5 m, the moving point is still within a tenth
    /// of a degree of the middle. A fixed point would be off by more than a degree.
    #[test]
    fn the_middle_moves_with_the_targets_and_the_uav() {
        let targets = [at_deg(500.0, 110.0, (10.0, 0.0)), at_deg(250.0, 60.0, (0.0, -10.0))];
        let centre = at_deg(300.0, 85.0, (0.0, 0.0)).position();
        let look = angular_midpoint(&UAV, centre, targets.into_iter(), math::PI).unwrap();
        let later = UavState { position: Position::from_m(20.0, 0.0), ..UAV };
        let moved = targets
            .map(|target| TargetState::new(target.position() + target.velocity() * 0.5, target.velocity(), [0.0, 0.0]));
        let middle_deg = |uav: &UavState, targets: [TargetState; 2]| {
            let bearings = targets.map(|target| (target.position() - uav.position).direction().rad().to_degrees());
            0.5 * (bearings[0] + bearings[1])
        };
        let boresight_deg =
            |look: PointingTarget| look.boresight(later.position, Duration::from_s(0.5)).rad().to_degrees();
        let off_deg = boresight_deg(look) - middle_deg(&later, moved);
        assert!(off_deg.abs() < 0.1, "{off_deg}");
        let still_deg = boresight_deg(PointingTarget { velocity: Velocity::ZERO, ..look }) - middle_deg(&later, moved);
        assert!(still_deg.abs() > 1.0, "{still_deg}");
    }

    /// Of four targets from -50 to 45 degrees, the left three or the right three fit into 70 degrees. The sensor points
    /// at the three with the most uncertain target, and at a smaller set only if no larger one fits.
    #[test]
    fn the_largest_set_that_fits_is_preferred_and_of_equal_sets_the_most_uncertain() {
        let look_deg = |targets: &[(f64, f64)]| {
            let targets = targets.iter().map(|(bearing_deg, m2)| (at_deg(300.0, *bearing_deg, (0.0, 0.0)), *m2, 1.0));
            let look = angular_midpoint_of_most(&UAV, targets, 70f64.to_radians()).unwrap();
            look.boresight(UAV.position, Duration::ZERO).rad().to_degrees()
        };
        let near = |one_deg: f64, other_deg: f64| (one_deg - other_deg).abs() < 1e-9;
        assert!(near(look_deg(&[(-50.0, 9.0), (-20.0, 1.0), (10.0, 1.0), (45.0, 16.0)]), 12.5));
        assert!(near(look_deg(&[(-50.0, 25.0), (-20.0, 1.0), (10.0, 1.0), (45.0, 16.0)]), -20.0));
        assert!(near(look_deg(&[(-50.0, 25.0), (-40.0, 1.0), (-30.0, 1.0), (45.0, 900.0)]), -40.0));
        // Equal variances: the nearer two, in any order of the targets.
        let near_and_far = [(-60.0, 300.0), (-40.0, 300.0), (50.0, 250.0), (60.0, 250.0)]
            .map(|(bearing_deg, distance_m)| (at_deg(distance_m, bearing_deg, (0.0, 0.0)), 4.0, 1.0));
        for targets in [near_and_far, {
            let [a, b, c, d] = near_and_far;
            [d, c, b, a]
        }] {
            let look = angular_midpoint_of_most(&UAV, targets.into_iter(), 70f64.to_radians()).unwrap();
            assert!(near(look.boresight(UAV.position, Duration::ZERO).rad().to_degrees(), 55.0));
        }
        // A target of high priority counts more than two others.
        let weighed = [(-60.0, 1.0), (-40.0, 1.0), (50.0, 2.5)]
            .map(|(bearing_deg, priority)| (at_deg(300.0, bearing_deg, (0.0, 0.0)), 4.0, priority));
        let look = angular_midpoint_of_most(&UAV, weighed.into_iter(), 70f64.to_radians()).unwrap();
        assert!(near(look.boresight(UAV.position, Duration::ZERO).rad().to_degrees(), 50.0));
        // Targets on both sides of +-180 degrees, and targets all around.
        assert!(near(look_deg(&[(170.0, 1.0), (-150.0, 1.0), (0.0, 400.0)]), -170.0));
        assert!(near(look_deg(&[(0.0, 1.0), (120.0, 9.0), (-120.0, 4.0)]), 120.0));
        let one = [(at_deg(300.0, 0.0, (0.0, 0.0)), 1.0, 1.0)];
        assert!(angular_midpoint_of_most(&UAV, one.into_iter(), math::PI).is_none());
        assert!(angular_midpoint_of_most(&UAV, [].into_iter(), 1.0).is_none());
    }

    #[test]
    fn targets_not_ahead_of_the_uav_have_no_middle() {
        let centre = at_deg(100.0, 90.0, (0.0, 0.0)).position();
        let towards = |bearing_deg| {
            angular_midpoint(&UAV, centre, [at_deg(100.0, bearing_deg, (0.0, 0.0))].into_iter(), math::PI)
        };
        assert!(towards(179.0).is_some() && towards(181.0).is_none() && towards(-90.0).is_none());
        assert!(angular_midpoint(&UAV, UAV.position, [at_deg(100.0, 0.0, (0.0, 0.0))].into_iter(), math::PI).is_none());
        assert!(angular_midpoint(&UAV, centre, [].into_iter(), math::PI).is_none());
    }
}
