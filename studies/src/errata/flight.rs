//! Closed-loop simulation of guidance and kinematics of one UAV about an exactly known centre.

use standoff::guidance::heading::Orbit;
use standoff::guidance::heading::steer;
use standoff::guidance::standoff_distance::Ramp;
use standoff::params::Feedforward;
use standoff::params::Integrator;
use standoff::{Angle, Command, Duration, GuidanceParams, Position, TeamParams, UavParams, UavState, Velocity};

/// Sampling period T_s of Table I, s.
pub(super) const PERIOD_S: f64 = 0.5;
/// Number of time steps: 600 s.
const STEPS: u32 = 1200;
/// First time step after the transient; only the last third is evaluated.
const SETTLED: u32 = 800;

/// Form of the feedforward (25).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Form {
    Published,
    Exact,
    /// The derivative of the desired heading along the field that is flown, at constant velocity of the centre and
    /// constant ground speed.
    Field,
}

/// Creates an orbit with a constant radius.
pub(super) fn orbit(centre: Position, centre_velocity: Velocity, distance_m: f64) -> Orbit {
    let steered = Ramp { radius_m: distance_m, rate_m_s: 0.0 };
    Orbit { centre, centre_velocity, distance_m, rate_m_s: 0.0, steered }
}

/// A flight with the parameters of Table I, except for these fields.
pub(super) struct Flight {
    pub(super) uav: UavParams,
    pub(super) guidance: GuidanceParams,
    pub(super) form: Form,
    /// Eastward speed of the centre.
    pub(super) centre_speed_m_s: f64,
    pub(super) radius_m: f64,
}

impl Flight {
    /// Creates a flight about a stationary centre on an orbit of 400 m; `radial_gain` is k_l.
    pub(super) fn new(form: Form, radial_gain: f64) -> Self {
        let team = TeamParams::paper();
        let feedforward = if form == Form::Published { Feedforward::Paper } else { Feedforward::StaticCentre };
        let guidance = GuidanceParams { feedforward, radial_gain, ..team.guidance };
        Self { uav: team.uav, guidance, form, centre_speed_m_s: 0.0, radius_m: 400.0 }
    }

    /// Selects Euler's integration step (4).
    pub(super) fn euler(mut self) -> Self {
        self.uav.integrator = Integrator::Euler;
        self
    }

    /// Returns the largest |r - r_d| after the transient, m.
    pub(super) fn largest_error_m(&self) -> f64 {
        self.settled_errors_m().into_iter().fold(0.0, f64::max)
    }

    /// Returns the mean |r - r_d| after the transient, m.
    pub(super) fn mean_error_m(&self) -> f64 {
        super::super::statistics::mean(&self.settled_errors_m())
    }

    fn settled_errors_m(&self) -> Vec<f64> {
        let mut state = UavState::level_flight(
            Position::from_m(1.5 * self.radius_m, 0.0),
            Angle::from_deg(90.0),
            self.uav.speed_m_s,
        );
        let velocity = Velocity::from_m_s(self.centre_speed_m_s, 0.0);
        let response = self.uav.response(Duration::from_s(PERIOD_S));
        let mut errors_m = Vec::new();
        for step in 0..STEPS {
            let centre = Position::ORIGIN + velocity * (f64::from(step) * PERIOD_S);
            let orbit = orbit(centre, velocity, self.radius_m);
            if step >= SETTLED {
                errors_m.push((state.position.distance_m(orbit.centre) - self.radius_m).abs());
            }
            let command =
                Command { speed_m_s: self.uav.speed_m_s, turn_rate_rad_s: self.turn_rate_rad_s(&state, &orbit) };
            state = response.step(&state, self.uav.limit(command).command);
        }
        errors_m
    }

    /// Command (24) with the feedforward of the form, rad/s.
    fn turn_rate_rad_s(&self, state: &UavState, orbit: &Orbit) -> f64 {
        const H_S: f64 = 1e-4;
        let steering = |after_s: f64, state: &UavState| {
            let orbit = Orbit { centre: orbit.centre + orbit.centre_velocity * after_s, ..*orbit };
            steer(&self.guidance, &self.uav, state, &orbit, self.uav.speed_m_s)
        };
        let now = steering(0.0, state);
        if self.form != Form::Field {
            return now.turn_rate_rad_s;
        }
        let along = Velocity::from_polar(self.uav.speed_m_s, now.desired_heading);
        let heading = |after_s: f64| {
            let moved = UavState { position: state.position + along * after_s, ..*state };
            steering(after_s, &moved).desired_heading
        };
        let field_rad_s = (heading(H_S) - heading(-H_S)).rad() / (2.0 * H_S);
        now.turn_rate_rad_s - now.feedforward_rad_s + field_rad_s
    }
}
