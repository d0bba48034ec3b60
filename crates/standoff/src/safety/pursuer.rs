//! Worst-case model of an intruder that keeps turning towards a UAV.

use crate::frame::Position;
use crate::uav::UavState;

/// Time step of the prediction, s. In one step, a pursuer at 40 m/s moves 20 m and turns by 9 degrees.
const STEP_S: f64 = 0.5;

/// Predicts the minimum distance, m, between a UAV and a pursuer during the next `ahead_s` seconds.
///
/// The pursuer turns towards the UAV at up to `turn_rate_max_rad_s`, without lag, and keeps its speed. `uav_at` returns
/// the position of the UAV a number of seconds from now. The distance is reduced by `growth_m_s` for each second of
/// prediction.
pub(crate) fn closest_m(
    pursuer: &UavState,
    turn_rate_max_rad_s: f64,
    ahead_s: f64,
    growth_m_s: f64,
    uav_at: impl Fn(f64) -> Position,
) -> f64 {
    let (mut pursuer, mut closest_m) = (*pursuer, f64::INFINITY);
    let steps = (ahead_s / STEP_S) as u32;
    for step in 0..=steps {
        let after_s = f64::from(step) * STEP_S;
        let to_uav = uav_at(after_s) - pursuer.position;
        closest_m = closest_m.min(to_uav.length_m() - growth_m_s * after_s);
        pursuer = pursuer.turned_towards(to_uav.direction(), turn_rate_max_rad_s, STEP_S);
    }
    closest_m
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::angle::Angle;

    fn at_40_m_s(x_m: f64, heading_deg: f64) -> UavState {
        UavState::level_flight(Position::from_m(x_m, 0.0), Angle::from_deg(heading_deg), 40.0)
    }

    /// A pursuer at 40 m/s falls behind a UAV at 55 m/s by 15 m/s and closes on a UAV at 30 m/s by 10 m/s.
    #[test]
    fn a_pursuer_behind_closes_at_the_difference_of_the_speeds() {
        let fleeing = |speed_m_s: f64| move |at_s: f64| Position::from_m(speed_m_s * at_s, 0.0);
        let behind = at_40_m_s(-200.0, 0.0);
        assert!((closest_m(&behind, 0.3, 10.0, 0.0, fleeing(55.0)) - 200.0).abs() < 1e-9);
        assert!((closest_m(&behind, 0.3, 10.0, 0.0, fleeing(30.0)) - 100.0).abs() < 1e-9);
        assert!((closest_m(&behind, 0.3, 10.0, 5.0, fleeing(30.0)) - 50.0).abs() < 1e-9);
    }

    /// A pursuer that flies away from the UAV comes near only if it turns.
    #[test]
    fn a_pursuer_that_has_flown_past_turns_back() {
        let stationary = |_| Position::ORIGIN;
        let leaving = at_40_m_s(100.0, 0.0);
        assert!(closest_m(&leaving, 0.0, 20.0, 0.0, stationary) >= 100.0);
        let closest = closest_m(&leaving, 0.3, 20.0, 0.0, stationary);
        assert!(closest < 60.0, "{closest} m");
    }
}
