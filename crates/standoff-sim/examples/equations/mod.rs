//! The mission of `paper/table-2-pair` by the equations alone: the state of one known pair of UAVs and four known targets
//! in arrays, without agents, messages, groups, custody, record or general scores.
//!
//! It calls the functions that agents and the simulator call, so that its cost is the share of the equations in that of a
//! run. docs/developer/benchmarks.md compares both; a test compares their results.

use core::array::from_fn;

use nalgebra::Matrix3;
use standoff::coordination::group_centre::Centroid;
use standoff::coordination::group_centre::GroupCentre;
use standoff::guidance::heading::Orbit;
use standoff::guidance::heading::steer;
use standoff::guidance::standoff_distance::Ramp;
use standoff::guidance::standoff_distance::Spread;
use standoff::math;
use standoff::target::Transition;
use standoff::tracking::information_filter::Contribution;
use standoff::uav::AutopilotModel;
use standoff::{
    Angle, Command, Covariance, Displacement, Estimate, Position, RangeBearingMeasurement, TargetState, TeamParams,
    UavState, Velocity,
};
use standoff_sim::random::{Draws, Stream};
use standoff_sim::scenario::Settings;
use standoff_sim::world::moved;

const TARGETS: usize = 4;
const UAVS: usize = 2;
const STEPS: u64 = 200;

/// Settings of all missions, and what follows from them.
pub(crate) struct Equations {
    settings: Settings,
    transition: Transition,
    noise_factor: Matrix3<f64>,
    autopilot: AutopilotModel,
    /// Variances of the first estimates, in the units of a state.
    variances: [f64; 6],
}

/// Means over the mission: errors of position (m) and velocity (m/s), distance from the orbit (m), error of the phase
/// difference (rad), and largest angle between a target and the boresight (rad).
pub(crate) type Means = [f64; 5];

impl Equations {
    /// Takes the settings from a scenario, which must be `paper/table-2-pair`.
    pub(crate) fn new(settings: Settings) -> Self {
        let target = settings.team.track.target;
        let transition = target.transition(settings.period);
        let acceleration = target.acceleration_sd_m_s2 * target.acceleration_sd_m_s2;
        let [position, velocity] = [settings.cue.position_sd_m, settings.cue.velocity_sd_m_s].map(|sd| sd * sd);
        let variances = [position, velocity, acceleration, position, velocity, acceleration];
        let (noise_factor, autopilot) = (transition.noise_factor(), settings.team.uav.response(settings.period));
        Self { settings, transition, noise_factor, autopilot, variances }
    }

    /// Flies the mission of a seed.
    pub(crate) fn fly(&self, seed: u64) -> Means {
        let Self { settings, transition, noise_factor, autopilot, variances } = self;
        let draws = Draws::new(seed);
        let mut start = draws.at(Stream::Scenario, 0, 0);
        let acceleration_sd_m_s2 = variances[2].sqrt();
        let mut truth: [TargetState; TARGETS] = from_fn(|_| {
            let [x_m, y_m] = from_fn(|_| 84.0 * start.uniform() - 42.0);
            let [vx, vy, ax, ay] = start.normals();
            let velocity = Velocity::from_m_s(8.0 + 0.8 * vx, 6.0 + 0.8 * vy);
            TargetState::new(Position::from_m(x_m, y_m), velocity, [ax, ay].map(|normal| acceleration_sd_m_s2 * normal))
        });
        let mut estimates: [Estimate; TARGETS] = from_fn(|target| {
            let mut state = truth[target].0;
            for row in [0, 1, 3, 4] {
                state[row] += variances[row].sqrt() * start.normal();
            }
            (state[2], state[5]) = (0.0, 0.0);
            Estimate { state: TargetState(state), covariance: Covariance::from_diagonal(*variances) }
        });
        let first_phase = Angle::from_rad(math::TAU * start.uniform());
        let mut uavs: [UavState; UAVS] = from_fn(|uav| {
            let phase = first_phase + Angle::from_deg(94.0 * uav as f64);
            let position = Position::ORIGIN + Displacement::from_polar(390.0, phase);
            UavState::level_flight(position, phase + Angle::from_deg(90.0), settings.team.uav.speed_m_s)
        });
        let mut centre = GroupCentre::start(&centroid(&estimates)).expect("a positive definite covariance");
        let mut sums = [0.0; 5];
        for step in 1..=STEPS {
            for (index, state) in (0..).zip(&mut truth) {
                *state = moved(state, transition, noise_factor, draws.at(Stream::TargetMotion, index, step));
            }
            self.track(&mut estimates, &truth, &uavs, draws, step);
            centre = centre.advance(transition, &centroid(&estimates)).expect("a positive definite covariance");
            let orbit = self.orbit(&estimates, &centre);
            let commands = self.guide(&uavs, &orbit);
            let errors = self.errors(&estimates, &truth, &uavs, &orbit);
            sums.iter_mut().zip(errors).for_each(|(sum, error)| *sum += error);
            for (uav, command) in uavs.iter_mut().zip(commands) {
                *uav = autopilot.step(uav, command);
            }
        }
        sums.map(|sum| sum / STEPS as f64)
    }

    /// Eq. (7) to (11).
    fn track(
        &self,
        estimates: &mut [Estimate; TARGETS],
        truth: &[TargetState; TARGETS],
        uavs: &[UavState; UAVS],
        draws: Draws,
        step: u64,
    ) {
        let sensor = &self.settings.team.track.sensor;
        let weights: [f64; 2] = sensor.noise_information().diagonal().into();
        estimates.iter_mut().for_each(|estimate| estimate.predict(&self.transition));
        let mut sums = [Contribution::default(); TARGETS];
        for (uav, UavState { position, .. }) in (0..).zip(uavs) {
            let exact = Displacement::direction_batch(truth.map(|state| state.position() - *position));
            let measurements = from_fn(|target| {
                let [range, bearing] = draws.at(Stream::Measurement, (uav << 32) | target as u64, step).normals();
                let z = RangeBearingMeasurement {
                    range_m: truth[target].position().distance_m(*position) + sensor.range_sd_m * range,
                    bearing: exact[target] + Angle::from_rad(sensor.bearing_sd_rad * bearing),
                };
                (*position, z, estimates[target].state.position())
            });
            let contributions = Contribution::from_measurements(measurements, [weights; TARGETS]);
            sums.iter_mut().zip(contributions).for_each(|(sum, of_uav)| *sum += of_uav);
        }
        estimates.iter_mut().zip(&sums).for_each(|(estimate, sum)| estimate.update(sum));
    }

    /// Eq. (15), (16), (22).
    fn orbit(&self, estimates: &[Estimate; TARGETS], centre: &GroupCentre) -> Orbit {
        let TeamParams { group, guidance, track, .. } = &self.settings.team;
        let bounds = &group.standoff;
        let state = centre.estimate().state;
        let spreads = estimates.iter().map(|estimate| Spread::of(&estimate.state, &state));
        let spread = spreads.max_by(|a, b| a.distance_m.total_cmp(&b.distance_m)).expect("there are targets");
        let standoff = bounds.distance(spread, centre.innovation_distance, &track.sensor);
        let radius = Ramp { radius_m: standoff.distance_m, rate_m_s: standoff.rate_m_s };
        Orbit::about(&state, &standoff, radius.with_lead(guidance.lead_s, bounds))
    }

    /// Eq. (23) to (25), (35), (2) and (3).
    fn guide(&self, uavs: &[UavState; UAVS], orbit: &Orbit) -> [Command; UAVS] {
        let TeamParams { guidance, uav: limits, .. } = &self.settings.team;
        let error_rad = phase_error_rad(uavs, orbit);
        from_fn(|uav| {
            let ahead_rad = if uav == 0 { error_rad } else { -error_rad };
            let speed_m_s = limits.speed_m_s + guidance.phase_gain_1_s * ahead_rad * orbit.distance_m;
            let speed_m_s = limits.limit(Command { speed_m_s, turn_rate_rad_s: 0.0 }).command.speed_m_s;
            let steering = steer(guidance, limits, &uavs[uav], orbit, speed_m_s);
            limits.limit(Command { speed_m_s, turn_rate_rad_s: steering.turn_rate_rad_s }).command
        })
    }

    /// Errors of one time step, in the order of [`Means`].
    fn errors(
        &self,
        estimates: &[Estimate; TARGETS],
        truth: &[TargetState; TARGETS],
        uavs: &[UavState; UAVS],
        orbit: &Orbit,
    ) -> Means {
        let [mut position_m, mut velocity_m_s] = [0.0; 2];
        for (estimate, state) in estimates.iter().zip(truth) {
            let estimated = estimate.state;
            position_m += estimated.position().distance_m(state.position());
            velocity_m_s += (estimated.velocity() - state.velocity()).speed_m_s();
        }
        let [mut standoff_m, mut angle_rad] = [0.0; 2];
        for UavState { position, .. } in uavs {
            standoff_m += (position.distance_m(orbit.centre) - orbit.distance_m).abs();
            let boresight = (orbit.centre - *position).direction();
            let directions = Displacement::direction_batch(truth.map(|state| state.position() - *position));
            angle_rad += directions.map(|direction| (direction - boresight).abs_rad()).into_iter().fold(0.0, f64::max);
        }
        let [targets, uav_count] = [TARGETS, UAVS].map(|count| count as f64);
        let phase_rad = phase_error_rad(uavs, orbit).abs();
        [position_m / targets, velocity_m_s / targets, standoff_m / uav_count, phase_rad, angle_rad / uav_count]
    }
}

/// Section II.C.
fn centroid(estimates: &[Estimate; TARGETS]) -> Centroid {
    Centroid::of(estimates.iter()).expect("there are targets")
}

/// Difference of the two phases minus a quarter turn, rad: the error of Eq. (35).
fn phase_error_rad(uavs: &[UavState; UAVS], orbit: &Orbit) -> f64 {
    let [first, second] = Displacement::direction_batch(uavs.map(|uav| uav.position - orbit.centre));
    (second - first - Angle::from_deg(90.0)).rad()
}
