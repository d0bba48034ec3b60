//! Paths that aircraft fly between two recorded time steps.
//!
//! A UAV holds its command over a time step, so that (1) gives its path from the recorded state and command. In wind, (1)
//! describes the motion in the air, which drifts at a constant velocity during a time step. The path is a sequence of
//! cubic Bezier curves over equal parts of the time step, in three dimensions; each has position and velocity of (1) at
//! both ends. A part is at most a third of a lag and a turn of 0.3 rad long: for UAVs of up to 100 m/s the curve is then
//! within 0.01 m of (1). The path of an intruder or of a banking UAV is one such curve, between two recorded states.

use nalgebra::{Vector2, Vector3};
use standoff::math;
use standoff::params::Integrator;
use standoff::safety::predicted_trajectory::least_length;
use standoff::uav::AutopilotModel;
use standoff::{Angle, Command, Duration, Position, TeamParams, UavState, Velocity};
use standoff_record::{IntruderRow, UavRow};

/// Horizontal position, m, and velocity, m/s.
type Node = (Vector2<f64>, Vector2<f64>);

/// Maximum number of parts of a time step.
const PARTS_MAX: f64 = 400.0;

/// Recorded state of an aircraft.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Recorded {
    /// State in the plane; in wind, heading and speed are those in the air.
    state: UavState,
    /// Wind until the next time step; `None` if the air is calm, or the state that over ground. The turn rate in the air
    /// is not recorded.
    wind: Option<Velocity>,
    /// Command until the next time step; `None` if it is unknown, or if (1) does not describe the aircraft.
    command: Option<Command>,
    altitude_m: Option<f64>,
    climb_rate_m_s: Option<f64>,
}

impl From<&UavRow> for Recorded {
    fn from(row: &UavRow) -> Self {
        let UavRow { altitude_m, climb_rate_m_s, bank_rad, .. } = *row;
        let air = row.air_heading_rad.zip(row.airspeed_m_s);
        let (heading_rad, speed_m_s) = air.unwrap_or((row.heading_rad, row.speed_m_s));
        let wind = row.wind_x_m_s.zip(row.wind_y_m_s).map(|(x_m_s, y_m_s)| Velocity::from_m_s(x_m_s, y_m_s));
        let (position, heading) = (Position::from_m(row.x_m, row.y_m), Angle::from_rad(heading_rad));
        let level = UavState::level_flight(position, heading, speed_m_s);
        let state = UavState { turn_rate_rad_s: row.turn_rate_rad_s, ..level };
        let command = Command { speed_m_s: row.speed_command_m_s, turn_rate_rad_s: row.turn_rate_command_rad_s };
        // Lags do not describe the turn of a banking aircraft.
        let command = bank_rad.is_none().then_some(command);
        Self { state, wind, command, altitude_m, climb_rate_m_s }
    }
}

/// The command of an intruder is unknown.
impl From<&IntruderRow> for Recorded {
    fn from(row: &IntruderRow) -> Self {
        let (position, heading) = (Position::from_m(row.x_m, row.y_m), Angle::from_rad(row.heading_rad));
        let state = UavState::level_flight(position, heading, row.speed_m_s);
        Self { state, wind: None, command: None, altitude_m: row.altitude_m, climb_rate_m_s: None }
    }
}

impl Recorded {
    /// Altitude, m; `None` if altitudes are not simulated.
    pub(crate) fn altitude_m(&self) -> Option<f64> {
        self.altitude_m
    }

    pub(crate) fn position(&self) -> Position {
        self.state.position
    }
}

/// Computes paths over one time step.
#[derive(Debug, Clone)]
pub(crate) struct PathModel {
    response: AutopilotModel,
    parts: usize,
    period_s: f64,
    speed_lag_s: f64,
    /// Heading change over a time step per unit of the difference between turn rate and command at its start, s. With
    /// turn rates of up to pi divided by it, the path in wind is unique.
    lagged_s: f64,
    is_exact: bool,
}

impl PathModel {
    pub(crate) fn new(team: &TeamParams, period_s: f64) -> Self {
        let uav = &team.uav;
        let rate_1_s = (3.0 / uav.speed_lag_s.min(uav.turn_rate_lag_s)).max(uav.turn_rate_max_rad_s / 0.3);
        let parts = (period_s * rate_1_s).ceil().clamp(1.0, PARTS_MAX);
        let response = uav.response(Duration::from_s(period_s / parts));
        let (speed_lag_s, is_exact) = (uav.speed_lag_s, uav.integrator == Integrator::Exact);
        let lagged_s = uav.turn_rate_lag_s * (1.0 - math::exp(-period_s / uav.turn_rate_lag_s));
        Self { response, parts: parts as usize, period_s, speed_lag_s, lagged_s, is_exact }
    }

    /// Distance that the path between two recorded states keeps to straight motion at constant speed, m. While a command
    /// is held: an eighth of the largest acceleration times the square of the duration, and less for a sudden change of
    /// speed.
    #[inline]
    pub(crate) fn bend_max_m(&self, from: &Recorded, to: &Recorded, duration_s: f64) -> f64 {
        if !self.is_one_step(duration_s) || (from.command.is_some() && !self.is_exact) {
            return 0.0;
        }
        let Some(command) = from.command else { return self.between(from, to).bend_m() };
        let start = self.start(from, to, command);
        let turn_rate_rad_s = start.turn_rate_rad_s.abs().max(command.turn_rate_rad_s.abs());
        let turning_m_s2 = start.speed_m_s.max(command.speed_m_s) * turn_rate_rad_s;
        // A speed between two limits moves a UAV by at most a quarter of their difference times the duration.
        let changing_m = (command.speed_m_s - start.speed_m_s).abs()
            * self.period_s
            * (0.125 * self.period_s / self.speed_lag_s).min(0.25);
        0.125 * self.period_s * self.period_s * turning_m_s2 + changing_m
    }

    /// State of (1) at the start of a time step in which a command is held. In wind, its turn rate is the one that leads
    /// from one heading to the other; of those, which differ by full circles, the smallest.
    fn start(&self, from: &Recorded, to: &Recorded, command: Command) -> UavState {
        if from.wind.is_none() {
            return from.state;
        }
        let commanded_rad = command.turn_rate_rad_s * (self.period_s - self.lagged_s);
        let turned_rad = (to.state.heading - from.state.heading - Angle::from_rad(commanded_rad)).rad();
        UavState { turn_rate_rad_s: turned_rad / self.lagged_s, ..from.state }
    }

    /// Path from one recorded state to another. It is straight after an Euler step (4), and between states that are not
    /// one time step apart.
    pub(crate) fn path(&self, from: &Recorded, to: &Recorded, duration_s: f64) -> FlownPath {
        if !self.is_one_step(duration_s) || (from.command.is_some() && !self.is_exact) {
            return self.straight(from, to);
        }
        let height = self.height(from, to);
        let nodes = match from.command {
            Some(command) => self.held(from, to, command),
            None => self.nodes(&self.between(from, to)),
        };
        let node = |index: usize| {
            let share = index as f64 / self.parts as f64;
            let ((at, velocity), (up, climb)) = (nodes[index], (height.at(share), height.slope(share) / self.period_s));
            (Vector3::new(at.x, at.y, up.z), Vector3::new(velocity.x, velocity.y, climb.z))
        };
        let part_s = self.period_s / self.parts as f64;
        let mut last = node(0);
        let curve = |index| {
            let next = node(index);
            Curve::hermite(std::mem::replace(&mut last, next), next, part_s)
        };
        FlownPath { curves: (1..=self.parts).map(curve).collect() }
    }

    /// Position and velocity at the ends of all parts while a command is held.
    fn held(&self, from: &Recorded, to: &Recorded, command: Command) -> Vec<Node> {
        let start = self.start(from, to, command);
        let states = std::iter::successors(Some(start), |state| Some(self.response.step(state, command)));
        let states: Vec<UavState> = states.take(self.parts + 1).collect();
        // The drift with the wind. Without wind zero, except for rounding and for states that the model does not explain.
        let drift = (to.position() - states[self.parts].position).vector();
        let node = |(index, state): (usize, &UavState)| {
            let share = index as f64 / self.parts as f64;
            (state.position.vector() + drift * share, state.velocity().vector() + drift / self.period_s)
        };
        states.iter().enumerate().map(node).collect()
    }

    /// Position and velocity at the ends of all parts of a curve over the whole time step.
    fn nodes(&self, curve: &Curve) -> Vec<Node> {
        let node = |index: usize| {
            let share = index as f64 / self.parts as f64;
            (curve.at(share).xy(), curve.slope(share).xy() / self.period_s)
        };
        (0..=self.parts).map(node).collect()
    }

    /// Horizontal curve with the recorded velocities at both ends of a time step.
    fn between(&self, from: &Recorded, to: &Recorded) -> Curve {
        let wind = from.wind.unwrap_or(Velocity::ZERO);
        let end = |of: &Recorded| {
            let (at, velocity) = (of.position().vector(), (of.state.velocity() + wind).vector());
            (Vector3::new(at.x, at.y, 0.0), Vector3::new(velocity.x, velocity.y, 0.0))
        };
        Curve::hermite(end(from), end(to), self.period_s)
    }

    fn is_one_step(&self, duration_s: f64) -> bool {
        (duration_s - self.period_s).abs() < 1e-6
    }

    /// Altitude over one time step, at constant rate of climb if it is not recorded.
    fn height(&self, from: &Recorded, to: &Recorded) -> Curve {
        let [from_m, to_m] = [from, to].map(|of| of.altitude_m.unwrap_or(0.0));
        let mean_m_s = (to_m - from_m) / self.period_s;
        let [from_m_s, to_m_s] = [from, to].map(|of| of.climb_rate_m_s.unwrap_or(mean_m_s));
        let up = |length: f64| Vector3::z() * length;
        Curve::hermite((up(from_m), up(from_m_s)), (up(to_m), up(to_m_s)), self.period_s)
    }

    /// Straight path at constant speed.
    fn straight(&self, from: &Recorded, to: &Recorded) -> FlownPath {
        let at = |of: &Recorded| Vector3::new(of.position().x_m(), of.position().y_m(), of.altitude_m.unwrap_or(0.0));
        let node = |index: usize| at(from).lerp(&at(to), index as f64 / self.parts as f64);
        FlownPath { curves: (0..self.parts).map(|index| Curve::straight(node(index), node(index + 1))).collect() }
    }
}

/// Path of an aircraft over one time step.
#[derive(Debug, Clone)]
pub(crate) struct FlownPath {
    /// Curves of equal duration.
    curves: Vec<Curve>,
}

impl FlownPath {
    pub(crate) fn curves(&self) -> &[Curve] {
        &self.curves
    }
}

/// Cubic Bezier curve: east, north and altitude of its control points, m.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Curve([Vector3<f64>; 4]);

impl Curve {
    /// Curve with a position and velocity at each end, over a duration.
    fn hermite(from: (Vector3<f64>, Vector3<f64>), to: (Vector3<f64>, Vector3<f64>), duration_s: f64) -> Self {
        Self([from.0, from.0 + from.1 * (duration_s / 3.0), to.0 - to.1 * (duration_s / 3.0), to.0])
    }

    fn straight(from: Vector3<f64>, to: Vector3<f64>) -> Self {
        Self([from, from.lerp(&to, 1.0 / 3.0), from.lerp(&to, 2.0 / 3.0), to])
    }

    /// Motion relative to another aircraft.
    pub(crate) fn relative_to(&self, other: &Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] - other.0[i]))
    }

    /// Both halves in time, by de Casteljau.
    pub(crate) fn halves(&self) -> [Self; 2] {
        let [a, b, c, d] = self.0;
        let middle = |one: Vector3<f64>, other: Vector3<f64>| (one + other) * 0.5;
        let (ab, bc, cd) = (middle(a, b), middle(b, c), middle(c, d));
        let (abc, bcd) = (middle(ab, bc), middle(bc, cd));
        let abcd = middle(abc, bcd);
        [Self([a, ab, abc, abcd]), Self([abcd, bcd, cd, d])]
    }

    /// Position after a share of the time.
    pub(crate) fn at(&self, share: f64) -> Vector3<f64> {
        let [a, b, c, d] = self.0;
        let left = 1.0 - share;
        a * (left * left * left)
            + (b * (left * left * share) + c * (left * share * share)) * 3.0
            + d * (share * share * share)
    }

    /// Derivative of the position in the share of the time.
    fn slope(&self, share: f64) -> Vector3<f64> {
        let [a, b, c, d] = self.0;
        let left = 1.0 - share;
        ((b - a) * (left * left) + (c - b) * (2.0 * left * share) + (d - c) * (share * share)) * 3.0
    }

    /// Horizontal positions of both ends.
    pub(crate) fn ends(&self) -> [Position; 2] {
        [self.0[0], self.0[3]].map(|at| Position::from_m(at.x, at.y))
    }

    /// Largest horizontal distance from straight motion at constant speed between both ends, m; at most 3/4 of the
    /// distance of the control points.
    pub(crate) fn bend_m(&self) -> f64 {
        let [a, b, c, d] = self.0;
        let off_m = |of: Vector3<f64>, share: f64| (of - a.lerp(&d, share)).xy().norm();
        0.75 * off_m(b, 1.0 / 3.0).max(off_m(c, 2.0 / 3.0))
    }

    /// Altitudes that it cannot exceed, m.
    pub(crate) fn altitudes_m(&self) -> [f64; 2] {
        let heights = self.0.map(|at| at.z);
        [heights.into_iter().fold(f64::INFINITY, f64::min), heights.into_iter().fold(f64::NEG_INFINITY, f64::max)]
    }

    /// Smallest horizontal distance of the straight line between both ends from the origin, m.
    pub(crate) fn straight_to_origin_m(&self) -> f64 {
        least_length([self.0[0].xy(), self.0[3].xy()])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use standoff::{UavId, UavParams};
    use standoff_sim::random::{Draws, Stream};
    use standoff_sim::run::Mission;
    use standoff_sim::scenario::{Overrides, Scenario};

    /// Positions of (1) at 256 times of a step, from steps of that length.
    fn integrated(params: &UavParams, period_s: f64, start: UavState, command: Command) -> Vec<UavState> {
        let fine = params.response(Duration::from_s(period_s / 256.0));
        std::iter::successors(Some(start), |state| Some(fine.step(state, command))).take(257).collect()
    }

    fn recorded(state: UavState, command: Option<Command>) -> Recorded {
        Recorded { state, wind: None, command, altitude_m: None, climb_rate_m_s: None }
    }

    /// Position on a path after a share of its time.
    fn at(path: &FlownPath, share: f64) -> Position {
        let part = share * path.curves.len() as f64;
        let curve = (part as usize).min(path.curves.len() - 1);
        let at = path.curves[curve].at(part - curve as f64);
        Position::from_m(at.x, at.y)
    }

    /// Largest distance of a path from these states, m.
    fn off_m(path: &FlownPath, states: &[UavState]) -> f64 {
        let off_m = |(index, state): (usize, &UavState)| state.position.distance_m(at(path, index as f64 / 256.0));
        states.iter().enumerate().map(off_m).fold(0.0, f64::max)
    }

    /// Periods up to 2 s, lags above and below them, and the hardest reversal of turn and speed.
    #[test]
    fn a_path_is_within_a_centimetre_of_the_integrated_flight() {
        let mut worst_m: f64 = 0.0;
        for (period_s, lag_s, speed_m_s, turn_rate_max_rad_s) in [
            (0.5, 1.0 / 3.0, 40.0, 0.3),
            (2.0, 1.0, 80.0, 0.6),
            (2.0, 0.05, 80.0, 0.6),
            (2.0, 20.0, 80.0, 0.6),
            (1.0, 0.3, 25.0, 1.0),
            (0.1, 1e-3, 100.0, 0.3),
        ] {
            let mut team = TeamParams::recommended();
            let lags = (lag_s, 2.0 * lag_s);
            team.uav =
                UavParams { speed_lag_s: lags.0, turn_rate_lag_s: lags.1, speed_m_s, turn_rate_max_rad_s, ..team.uav };
            let start = UavState {
                turn_rate_rad_s: -turn_rate_max_rad_s,
                ..UavState::level_flight(Position::from_m(300.0, -20.0), Angle::from_deg(170.0), speed_m_s - 15.0)
            };
            let command = Command { speed_m_s: speed_m_s + 15.0, turn_rate_rad_s: turn_rate_max_rad_s };
            let states = integrated(&team.uav, period_s, start, command);
            let model = PathModel::new(&team, period_s);
            let (from, to) = (recorded(start, Some(command)), recorded(states[256], None));
            let path = model.path(&from, &to, period_s);
            worst_m = worst_m.max(off_m(&path, &states));
            let [start, end] = [states[0], states[256]].map(|state| state.position.vector());
            let bends_m = states
                .iter()
                .enumerate()
                .map(|(index, state)| (state.position.vector() - start.lerp(&end, index as f64 / 256.0)).norm());
            let (bend_m, bend_max_m) = (bends_m.fold(0.0, f64::max), model.bend_max_m(&from, &to, period_s));
            assert!(bend_m <= bend_max_m && bend_m > 0.05 * bend_max_m, "{bend_m} {bend_max_m}");
            let steps = path.curves.windows(2).map(|pair| pair[0].ends()[1].distance_m(pair[1].ends()[0]));
            assert!(steps.fold(0.0, f64::max) < 1e-9);
        }
        assert!((1e-6..0.01).contains(&worst_m), "{worst_m}");
    }

    /// A simulated flight of one UAV: its airframe, the wind, and its commands, each held for a time step.
    struct InWind<'a> {
        airframe: &'a [String],
        wind: &'a [String],
        period_s: f64,
        commands: &'a [Command],
    }

    impl InWind<'_> {
        /// Parameters and rows of the flight in wind, or in calm air in `shorter` time steps for each one in wind.
        fn flown(&self, wind: &[String], shorter: usize) -> (TeamParams, Vec<UavRow>) {
            let duration_s = self.period_s * (self.commands.len() - 1) as f64;
            let times = [format!("duration_s={duration_s}"), format!("period_s={}", self.period_s / shorter as f64)];
            let overrides = Overrides { set: [self.airframe, wind, &times].concat(), ..Overrides::default() };
            let scenario = Scenario::load("tour/01-one-uav", &overrides, 1).unwrap();
            let mut mission = Mission::new(&scenario).unwrap();
            let mut rows = Vec::new();
            while mission.observe() {
                mission.propose().unwrap();
                assert!(mission.override_command(UavId(0), self.commands[rows.len() / shorter]));
                rows.push(mission.decide().unwrap().uavs[0]);
            }
            (scenario.settings.team, rows)
        }

        /// Largest distance of the paths from the simulated motion, m: that in calm air, which drifts with the wind.
        fn off_m(&self, shorter: usize) -> f64 {
            let (team, rows) = self.flown(self.wind, 1);
            let (_, fine) = self.flown(&[], shorter);
            let model = PathModel::new(&team, self.period_s);
            let place = |row: &UavRow| Position::from_m(row.x_m, row.y_m).vector();
            let (mut off_max_m, mut drift) = (0.0, Velocity::ZERO.vector());
            for (step, pair) in rows.windows(2).enumerate() {
                let [from, to] = [&pair[0], &pair[1]].map(Recorded::from);
                let path = model.path(&from, &to, self.period_s);
                let wind = Velocity::from_m_s(pair[0].wind_x_m_s.unwrap(), pair[0].wind_y_m_s.unwrap());
                let moved = wind.vector() * self.period_s;
                for index in 0..=shorter {
                    let share = index as f64 / shorter as f64;
                    let simulated = place(&fine[step * shorter + index]) + drift + moved * share;
                    off_max_m = f64::max(off_max_m, (at(&path, share).vector() - simulated).norm());
                }
                drift += moved;
                let end = place(&fine[(step + 1) * shorter]) + drift;
                assert!((place(&pair[1]) - end).norm() < 1e-6, "{step}");
            }
            off_max_m
        }
    }

    /// Commands of 40 time steps, at random between the limits and at them.
    fn any_commands(params: &UavParams) -> Vec<Command> {
        let mut draw = Draws::new(7).at(Stream::Measurement, 0, 0);
        let mut share = || (3.0 * draw.uniform() - 1.5).clamp(-1.0, 1.0);
        let command = |_| Command {
            speed_m_s: params.speed_m_s + params.speed_change_max_m_s * share(),
            turn_rate_rad_s: params.turn_rate_max_rad_s * share(),
        };
        (0..40).map(command).collect()
    }

    fn settings(params: &UavParams) -> Vec<String> {
        let values = [
            ("speed_m_s", params.speed_m_s),
            ("speed_change_max_m_s", params.speed_change_max_m_s),
            ("turn_rate_max_rad_s", params.turn_rate_max_rad_s),
            ("speed_lag_s", params.speed_lag_s),
            ("turn_rate_lag_s", params.turn_rate_lag_s),
        ];
        values.map(|(key, value)| format!("uavs.{key}={value}")).to_vec()
    }

    /// Winds of 5 to 15 m/s from three directions, with and without gusts, periods of 0.5 to 7 s, lags above and below
    /// them, and speeds of up to 95 m/s.
    #[test]
    fn in_wind_a_path_is_within_a_centimetre_of_the_simulated_flight() {
        let mut worst_m: f64 = 0.0;
        for (speed_m_s, speed_change_max_m_s, turn_rate_max_rad_s) in
            [(40.0, 15.0, 0.3), (23.0, 7.0, 0.6), (80.0, 15.0, 0.6)]
        {
            for (speed_lag_s, turn_rate_lag_s) in [(1.0 / 3.0, 1.0 / 3.0), (3.0, 0.8), (0.05, 0.2), (1.0, 5.0)] {
                let params = TeamParams::recommended().uav;
                let params = UavParams {
                    speed_m_s,
                    speed_change_max_m_s,
                    turn_rate_max_rad_s,
                    speed_lag_s,
                    turn_rate_lag_s,
                    ..params
                };
                let (airframe, commands) = (settings(&params), any_commands(&params));
                for (period_s, wind) in [
                    (0.5, "{speed_m_s=5,from_deg=0}"),
                    (1.0, "{speed_m_s=10,from_deg=130,gust_w20_m_s=10}"),
                    (2.0, "{speed_m_s=15,from_deg=250}"),
                    (7.0, "{speed_m_s=15,from_deg=250}"),
                ] {
                    let flight =
                        InWind { airframe: &airframe, wind: &[format!("wind={wind}")], period_s, commands: &commands };
                    let off_m = flight.off_m(20);
                    println!(
                        "{speed_m_s} m/s, lags {speed_lag_s:.2} and {turn_rate_lag_s:.2} s, {period_s} s, {wind}: {off_m:.6} m"
                    );
                    worst_m = worst_m.max(off_m);
                }
            }
        }
        println!("worst: {worst_m:.4} m");
        assert!((1e-6..0.01).contains(&worst_m), "{worst_m}");
    }

    /// A banking UAV rolls during a time step, which its record does not contain.
    #[test]
    fn in_wind_the_path_of_a_banking_uav_is_within_a_centimetre_in_half_a_second() {
        for (period_s, shorter, off_max_m) in [(0.5, 5, 0.008), (1.0, 10, 0.05), (2.0, 20, 0.6)] {
            let mut worst_m: f64 = 0.0;
            for (speed_m_s, speed_change_max_m_s, turn_rate_max_rad_s) in
                [(23.0, 7.0, 0.3), (23.0, 7.0, 0.6), (40.0, 15.0, 0.3)]
            {
                let params = TeamParams::recommended().uav;
                let params = UavParams { speed_m_s, speed_change_max_m_s, turn_rate_max_rad_s, ..params };
                let airframe = [settings(&params), vec!["uavs.dynamics=bank".to_owned()]].concat();
                let wind = ["wind={speed_m_s=15,from_deg=250}".to_owned()];
                let commands = any_commands(&params);
                let flight = InWind { airframe: &airframe, wind: &wind, period_s, commands: &commands };
                let off_m = flight.off_m(shorter);
                println!("banking, {speed_m_s} m/s, {turn_rate_max_rad_s} rad/s, {period_s} s: {off_m:.3} m");
                worst_m = worst_m.max(off_m);
            }
            assert!((0.5 * off_max_m..off_max_m).contains(&worst_m), "{period_s} s: {worst_m} m");
        }
    }

    /// An intruder with a constant turn rate, which its record does not contain.
    #[test]
    fn the_path_of_an_intruder_follows_its_turn() {
        let team = TeamParams::recommended();
        let start =
            UavState { turn_rate_rad_s: 0.3, ..UavState::level_flight(Position::ORIGIN, Angle::from_deg(-60.0), 55.0) };
        for (period_s, off_max_m) in [(0.5, 0.001), (1.0, 0.01), (2.0, 0.1)] {
            let states = integrated(&team.uav, period_s, start, Command { speed_m_s: 55.0, turn_rate_rad_s: 0.3 });
            let [from, to] = [start, states[256]].map(|state| UavState { turn_rate_rad_s: 0.0, ..state });
            let path = PathModel::new(&team, period_s).path(&recorded(from, None), &recorded(to, None), period_s);
            assert!(off_m(&path, &states) < off_max_m);
        }
    }

    /// The path of a banking UAV depends on its recorded states, not on its command.
    #[test]
    fn the_path_of_a_banking_uav_does_not_follow_its_command() {
        let row =
            UavRow { turn_rate_command_rad_s: 0.3, speed_m_s: 40.0, speed_command_m_s: 40.0, ..UavRow::default() };
        let straight = Recorded { command: None, ..Recorded::from(&UavRow { x_m: 20.0, ..row }) };
        let middle_m = |bank_rad| {
            let path = PathModel::new(&TeamParams::recommended(), 0.5).path(
                &Recorded::from(&UavRow { bank_rad, ..row }),
                &straight,
                0.5,
            );
            path.curves.iter().map(Curve::bend_m).fold(0.0, f64::max)
        };
        assert!(middle_m(Some(0.1)) < 1e-9 && middle_m(None) > 1e-3);
    }

    /// An Euler step (4) moves the UAV straight ahead. A gap in the record is straight as well.
    #[test]
    fn euler_steps_and_gaps_are_straight() {
        let mut team = TeamParams::paper();
        let command = Command { speed_m_s: 55.0, turn_rate_rad_s: 0.3 };
        let [start, end] =
            [0.0, 20.0].map(|x_m| UavState::level_flight(Position::from_m(x_m, 0.0), Angle::from_deg(30.0), 40.0));
        let middle = |team: &TeamParams, duration_s: f64| {
            let path =
                PathModel::new(team, 0.5).path(&recorded(start, Some(command)), &recorded(end, None), duration_s);
            let curve = path.curves[path.curves.len() / 2];
            path.curves.iter().map(Curve::bend_m).fold(curve.ends()[0].y_m().abs(), f64::max)
        };
        assert!(middle(&team, 0.5) > 0.1 && middle(&team, 1.0) < 1e-12);
        team.uav.integrator = Integrator::Euler;
        assert!(middle(&team, 0.5) < 1e-12);
    }

    #[test]
    fn halves_of_a_curve_are_the_curve() {
        let at = |x, y, z| Vector3::new(x, y, z);
        let curve = Curve([at(0.0, 0.0, 1.0), at(1.0, 5.0, 2.0), at(4.0, -3.0, 0.0), at(6.0, 1.0, 9.0)]);
        let [first, second] = curve.halves();
        assert!((first.at(0.5) - curve.at(0.25)).norm() < 1e-12 && (second.at(0.5) - curve.at(0.75)).norm() < 1e-12);
        let step = (curve.at(0.4 + 1e-6) - curve.at(0.4 - 1e-6)) / 2e-6;
        assert!((curve.slope(0.4) - step).norm() < 1e-6);
        let off_m = |share: f64| (curve.at(share) - curve.0[0].lerp(&curve.0[3], share)).xy().norm();
        let largest_m = (0..=100).map(|index| off_m(f64::from(index) / 100.0)).fold(0.0, f64::max);
        assert!(largest_m <= curve.bend_m() && curve.bend_m() < 3.0 * largest_m);
    }
}
