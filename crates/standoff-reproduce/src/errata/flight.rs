//! One UAV, guidance and kinematics in a closed loop, about a centre that is known exactly.

use standoff::guidance::heading::steer;
use standoff::guidance::standoff_distance::Ramp;
use standoff::{
    Angle, Command, Duration, Feedforward, GuidanceParams, Integrator, Orbit, Position, TeamParams, UavParams,
    UavState, Velocity,
};

/// Table I's T_s, s.
pub(super) const PERIOD_S: f64 = 0.5;
/// Steps flown, and the first that counts: the last third of 600 s.
const STEPS: u32 = 1200;
const SETTLED: u32 = 800;

/// An orbit of a constant radius.
pub(super) fn orbit(centre: Position, centre_velocity: Velocity, distance_m: f64) -> Orbit {
    let steered = Ramp { radius_m: distance_m, rate_m_s: 0.0 };
    Orbit { centre, centre_velocity, distance_m, rate_m_s: 0.0, steered }
}

/// What is flown: Table I but for what is named.
pub(super) struct Flight {
    pub(super) uav: UavParams,
    pub(super) guidance: GuidanceParams,
    /// Eastward.
    pub(super) centre_speed_m_s: f64,
    pub(super) radius_m: f64,
}

impl Flight {
    /// About a centre at rest at 400 m, with k_l.
    pub(super) fn new(feedforward: Feedforward, radial_gain: f64) -> Self {
        let team = TeamParams::table_1();
        let guidance = GuidanceParams { feedforward, radial_gain, ..team.guidance };
        Self { uav: team.uav, guidance, centre_speed_m_s: 0.0, radius_m: 400.0 }
    }

    /// The same with Euler's step (4).
    pub(super) fn euler(mut self) -> Self {
        self.uav.integrator = Integrator::Euler;
        self
    }

    /// Largest |r - r_d| once settled, m.
    pub(super) fn largest_error_m(&self) -> f64 {
        self.settled_errors_m().into_iter().fold(0.0, f64::max)
    }

    /// Mean |r - r_d| once settled, m.
    pub(super) fn mean_error_m(&self) -> f64 {
        super::super::statistics::mean(&self.settled_errors_m())
    }

    fn settled_errors_m(&self) -> Vec<f64> {
        let mut state =
            UavState::straight(Position::from_m(1.5 * self.radius_m, 0.0), Angle::from_deg(90.0), self.uav.speed_m_s);
        let velocity = Velocity::from_m_s(self.centre_speed_m_s, 0.0);
        let response = self.uav.response(Duration::from_s(PERIOD_S));
        let mut errors_m = Vec::new();
        for step in 0..STEPS {
            let centre = Position::ORIGIN + velocity * (f64::from(step) * PERIOD_S);
            let orbit = orbit(centre, velocity, self.radius_m);
            if step >= SETTLED {
                errors_m.push((state.position.distance_m(orbit.centre) - self.radius_m).abs());
            }
            let steering = steer(&self.guidance, &state, &orbit, self.uav.speed_m_s);
            let wanted = Command { speed_m_s: self.uav.speed_m_s, turn_rate_rad_s: steering.turn_rate_rad_s };
            state = response.step(&state, self.uav.limit(wanted).command);
        }
        errors_m
    }
}
