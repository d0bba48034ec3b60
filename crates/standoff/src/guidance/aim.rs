//! Where a UAV points its sensor so that all of its group's members fit in: at the middle of their angular extent; and
//! while they do not fit, at the middle of the most that do.
//!
//! Of all directions it is that from which the worst member is least far off. It meets the line between the outermost
//! two, L and R at distances l and r from the UAV, in the point that divides it as their distances do:
//!
//! ```text
//! Q  = w L + (1 - w) R            w  = r / (l + r)
//! Q' = w L' + (1 - w) R' + w' (L - R)        w' = (r' l - r l') / (l + r)^2
//! ```

use nalgebra::Matrix2;

use crate::frame::{Displacement, Position, Velocity};
use crate::math;
use crate::step::LookAt;
use crate::target::TargetState;
use crate::uav::UavState;

/// The middle of the angular extent of targets, seen from a UAV, as a point that moves as the targets and the UAV do.
/// `None` if the extent is wider than `widest_rad`, or one of them is not ahead of a UAV that looks towards their
/// `centre`: then they have no middle.
pub(crate) fn middle(
    uav: &UavState,
    centre: Position,
    targets: impl Iterator<Item = TargetState>,
    widest_rad: f64,
) -> Option<LookAt> {
    let towards = (centre - uav.position).vector();
    // Tangent of the angle off the centre, anticlockwise; the target.
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
    let look = LookAt {
        position: right.position() + Displacement::from_m(from_right.x, from_right.y),
        velocity: right.velocity() + Velocity::from(velocity_rel_right),
    };
    (look.position.is_finite() && look.velocity.is_finite()).then_some(look)
}

/// The middle of the most targets that fit into a field of view at once, seen from a UAV; of as many, of those known
/// worst, so that who is left out now is looked at next; of those known alike, of the nearest. Each target comes with the
/// variance of its position, m2. `None` for a field of view of half a turn or more, and for no targets.
///
/// One of those that fit is at the right edge: each target is tried there.
pub(crate) fn middle_of_most(
    uav: &UavState,
    targets: impl Iterator<Item = (TargetState, f64)> + Clone,
    field_of_view_rad: f64,
) -> Option<LookAt> {
    if field_of_view_rad >= math::PI {
        return None;
    }
    let target_rel_uav = |target: &TargetState| (target.position() - uav.position).vector();
    let turned_by = |angle_rad: f64| {
        let (sin, cos) = math::sin_cos(angle_rad);
        Matrix2::new(cos, -sin, sin, cos)
    };
    let to_left_edge = turned_by(field_of_view_rad);
    let that_fit = |right: TargetState| {
        let right_rel_uav = target_rel_uav(&right);
        let left_edge = to_left_edge * right_rel_uav;
        targets.clone().filter(move |(target, _)| {
            let target_rel_uav = target_rel_uav(target);
            right_rel_uav.perp(&target_rel_uav) >= 0.0 && target_rel_uav.perp(&left_edge) >= 0.0
        })
    };
    let mut best: Option<(usize, f64, f64, TargetState)> = None;
    for (right, _) in targets.clone() {
        let (number, sum_m2, away_m2) =
            that_fit(right).fold((0, 0.0, 0.0), |(number, sum_m2, away_m2), (target, m2)| {
                (number + 1, sum_m2 + m2, away_m2 + target_rel_uav(&target).norm_squared())
            });
        let is_better = best.is_none_or(|(most, most_m2, nearest_m2, _)| {
            // Known as badly but for rounding, which must not decide.
            let is_as_bad = (sum_m2 - most_m2).abs() <= 1e-9 * most_m2;
            number > most || (number == most && if is_as_bad { away_m2 < nearest_m2 } else { sum_m2 > most_m2 })
        });
        if is_better {
            best = Some((number, sum_m2, away_m2, right));
        }
    }
    let (.., right) = best?;
    let ahead = turned_by(0.5 * field_of_view_rad) * target_rel_uav(&right);
    let ahead = uav.position + Displacement::from_m(ahead.x, ahead.y);
    middle(uav, ahead, that_fit(right).map(|(target, _)| target), math::PI)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::angle::Angle;
    use crate::time::Duration;

    const UAV: UavState = UavState::straight(Position::ORIGIN, Angle::ZERO, 40.0);

    fn at_deg(distance_m: f64, bearing_deg: f64, velocity: (f64, f64)) -> TargetState {
        let position = Position::ORIGIN + Displacement::from_polar(distance_m, Angle::from_deg(bearing_deg));
        TargetState::new(position, Velocity::from_m_s(velocity.0, velocity.1), [0.0, 0.0])
    }

    /// From 60 to 100 degrees, far and near: the middle is at 80, wherever the centre is between and whoever else is.
    #[test]
    fn the_middle_is_half_way_between_the_outermost() {
        let targets =
            [at_deg(400.0, 100.0, (0.0, 0.0)), at_deg(300.0, 61.0, (0.0, 0.0)), at_deg(250.0, 60.0, (0.0, 0.0))];
        for centre_deg in [62.0, 90.0, 130.0] {
            let centre = at_deg(300.0, centre_deg, (0.0, 0.0)).position();
            let look = middle(&UAV, centre, targets.into_iter(), math::PI).unwrap();
            assert!((look.boresight(UAV.position, Duration::ZERO).rad().to_degrees() - 80.0).abs() < 1e-9);
            let of = |widest_deg: f64| middle(&UAV, centre, targets.into_iter(), widest_deg.to_radians());
            assert_eq!((of(40.1), of(39.9)), (Some(look), None));
        }
    }

    /// Half a second later, when the UAV has flown 20 m and the targets 5 m, it is still the middle, to a tenth of a
    /// degree; at the point that stays where it is, it would be two degrees off.
    #[test]
    fn the_middle_moves_as_all_do() {
        let targets = [at_deg(500.0, 110.0, (10.0, 0.0)), at_deg(250.0, 60.0, (0.0, -10.0))];
        let centre = at_deg(300.0, 85.0, (0.0, 0.0)).position();
        let look = middle(&UAV, centre, targets.into_iter(), math::PI).unwrap();
        let later = UavState { position: Position::from_m(20.0, 0.0), ..UAV };
        let moved = targets
            .map(|target| TargetState::new(target.position() + target.velocity() * 0.5, target.velocity(), [0.0, 0.0]));
        let middle_deg = |uav: &UavState, targets: [TargetState; 2]| {
            let bearings = targets.map(|target| (target.position() - uav.position).direction().rad().to_degrees());
            0.5 * (bearings[0] + bearings[1])
        };
        let boresight_deg = |look: LookAt| look.boresight(later.position, Duration::from_s(0.5)).rad().to_degrees();
        let off_deg = boresight_deg(look) - middle_deg(&later, moved);
        assert!(off_deg.abs() < 0.1, "{off_deg}");
        let still_deg = boresight_deg(LookAt { velocity: Velocity::ZERO, ..look }) - middle_deg(&later, moved);
        assert!(still_deg.abs() > 1.0, "{still_deg}");
    }

    /// Four from -50 to 45 degrees, of whom three fit into 70 degrees, on either side: it looks at the three with the one
    /// that is known worst, and at two only if nobody has a third beside.
    #[test]
    fn of_more_than_fit_in_it_looks_at_the_most_and_of_as_many_at_those_known_worst() {
        let look_deg = |targets: &[(f64, f64)]| {
            let targets = targets.iter().map(|(bearing_deg, m2)| (at_deg(300.0, *bearing_deg, (0.0, 0.0)), *m2));
            let look = middle_of_most(&UAV, targets, 70f64.to_radians()).unwrap();
            look.boresight(UAV.position, Duration::ZERO).rad().to_degrees()
        };
        let near = |one_deg: f64, other_deg: f64| (one_deg - other_deg).abs() < 1e-9;
        assert!(near(look_deg(&[(-50.0, 9.0), (-20.0, 1.0), (10.0, 1.0), (45.0, 16.0)]), 12.5));
        assert!(near(look_deg(&[(-50.0, 25.0), (-20.0, 1.0), (10.0, 1.0), (45.0, 16.0)]), -20.0));
        assert!(near(look_deg(&[(-50.0, 25.0), (-40.0, 1.0), (-30.0, 1.0), (45.0, 900.0)]), -40.0));
        // Known alike: the nearer two, whatever the order.
        let near_and_far = [(-60.0, 300.0), (-40.0, 300.0), (50.0, 250.0), (60.0, 250.0)]
            .map(|(bearing_deg, distance_m)| (at_deg(distance_m, bearing_deg, (0.0, 0.0)), 4.0));
        for targets in [near_and_far, {
            let [a, b, c, d] = near_and_far;
            [d, c, b, a]
        }] {
            let look = middle_of_most(&UAV, targets.into_iter(), 70f64.to_radians()).unwrap();
            assert!(near(look.boresight(UAV.position, Duration::ZERO).rad().to_degrees(), 55.0));
        }
        // Across the turn's end, and all around.
        assert!(near(look_deg(&[(170.0, 1.0), (-150.0, 1.0), (0.0, 400.0)]), -170.0));
        assert!(near(look_deg(&[(0.0, 1.0), (120.0, 9.0), (-120.0, 4.0)]), 120.0));
        let one = [(at_deg(300.0, 0.0, (0.0, 0.0)), 1.0)];
        assert!(middle_of_most(&UAV, one.into_iter(), math::PI).is_none());
        assert!(middle_of_most(&UAV, [].into_iter(), 1.0).is_none());
    }

    #[test]
    fn those_all_around_have_no_middle() {
        let centre = at_deg(100.0, 90.0, (0.0, 0.0)).position();
        let towards =
            |bearing_deg| middle(&UAV, centre, [at_deg(100.0, bearing_deg, (0.0, 0.0))].into_iter(), math::PI);
        assert!(towards(179.0).is_some() && towards(181.0).is_none() && towards(-90.0).is_none());
        assert!(middle(&UAV, UAV.position, [at_deg(100.0, 0.0, (0.0, 0.0))].into_iter(), math::PI).is_none());
        assert!(middle(&UAV, centre, [].into_iter(), math::PI).is_none());
    }
}
