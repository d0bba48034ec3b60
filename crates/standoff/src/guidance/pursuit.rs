//! How near somebody comes who turns at a UAV all the while.

use crate::angle::Angle;
use crate::frame::{Displacement, Position};
use crate::uav::UavState;

/// Steps in which it is foretold, s: in one a pursuer at 40 m/s goes on by 20 m, and turns by 9 degrees.
const STEP_S: f64 = 0.5;

/// The least distance within so long, m, of a UAV that is at `uav_at` so long from now, and of one who turns at it as fast as it can,
/// at once, and flies on as fast as it does. Of a distance `growth_m_s` less counts for each second foretold.
pub(crate) fn closest_m(
    pursuer: &UavState,
    turn_rate_max_rad_s: f64,
    ahead_s: f64,
    growth_m_s: f64,
    uav_at: impl Fn(f64) -> Position,
) -> f64 {
    let (mut position, mut heading) = (pursuer.position, pursuer.heading);
    let mut closest_m = f64::INFINITY;
    let steps = (ahead_s / STEP_S) as u32;
    for step in 0..=steps {
        let after_s = f64::from(step) * STEP_S;
        let to_uav: Displacement = uav_at(after_s) - position;
        closest_m = closest_m.min(to_uav.length_m() - growth_m_s * after_s);
        let turn_max_rad = turn_rate_max_rad_s * STEP_S;
        let error_rad = (to_uav.direction() - heading).rad();
        heading = heading + Angle::from_rad(error_rad.clamp(-turn_max_rad, turn_max_rad));
        position = position + Displacement::from_polar(pursuer.speed_m_s * STEP_S, heading);
    }
    closest_m
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at_40_m_s(x_m: f64, heading_deg: f64) -> UavState {
        UavState::straight(Position::from_m(x_m, 0.0), Angle::from_deg(heading_deg), 40.0)
    }

    /// A UAV at 55 m/s leaves one behind who follows at 40 m/s by 15 m/s; at 30 m/s it is caught up with by 10 m/s.
    #[test]
    fn a_pursuer_behind_comes_nearer_by_the_difference_of_the_speeds() {
        let fleeing = |speed_m_s: f64| move |at_s: f64| Position::from_m(speed_m_s * at_s, 0.0);
        let behind = at_40_m_s(-200.0, 0.0);
        assert!((closest_m(&behind, 0.3, 10.0, 0.0, fleeing(55.0)) - 200.0).abs() < 1e-9);
        assert!((closest_m(&behind, 0.3, 10.0, 0.0, fleeing(30.0)) - 100.0).abs() < 1e-9);
        assert!((closest_m(&behind, 0.3, 10.0, 5.0, fleeing(30.0)) - 50.0).abs() < 1e-9);
    }

    /// Flying away from the UAV, it would not come near if it flew on; it turns.
    #[test]
    fn who_flies_past_may_turn() {
        let hovering = |_| Position::ORIGIN;
        let leaving = at_40_m_s(100.0, 0.0);
        assert!(closest_m(&leaving, 0.0, 20.0, 0.0, hovering) >= 100.0);
        let closest = closest_m(&leaving, 0.3, 20.0, 0.0, hovering);
        assert!(closest < 60.0, "{closest} m");
    }
}
