//! Fallback: a circle to the left or to the right that a UAV can fly forever.
//!
//! Its airspeed is constant: the lowest one, or for banking aircraft, which lack the power to slow down in a turn, the
//! current one. In the air, the circle is the tightest turn. If zones bind the UAV in wind, the circle is over ground, of
//! the radius r = (V_a + w)^2 / (V_a omega_max), which the highest heading rate allows in a tailwind. The UAV turns onto
//! it as if it were on such a circle, then holds the circle that it has reached, so that errors do not accumulate.
//!
//! A UAV that is on such a circle, or on a path that ends in one, can always continue (T. Schouwenaars, J. How and
//! E. Feron, *Decentralized Cooperative Trajectory Planning of Multiple Aircraft with Hard Safety Guarantees*, AIAA
//! Guidance, Navigation, and Control Conference 2004).

use core::cell::OnceCell;

use nalgebra::Vector2;

use crate::angle::Angle;
use crate::frame::{Displacement, Position, Velocity};
use crate::math;
use crate::math::PI;
use crate::params::{Integrator, UavParams};
use crate::safety::motion::{Airframe, Motion};
use crate::safety::predicted_trajectory::least_length;
use crate::time::Duration;
use crate::uav::{AutopilotModel, Command};
use crate::wind::Wind;

/// Maximum turn between two consecutive points of a path, rad.
const TURN_STEP_RAD: f64 = 0.15;
/// Number of lags after which a turn counts as a circle.
const SETTLED_LAGS: f64 = 6.0;
/// Shortest time until a turn counts as a circle, s.
const SETTLED_MIN_S: f64 = 4.0;
/// Maximum number of commands until then. With shorter periods, the predicted command is held for several.
const COMMANDS_MAX: f64 = 28.0;
/// Maximum number of points of a path per command.
const POINTS_MAX: f64 = 20.0;
/// Share of the heading error, and of the error of the radius, that a UAV on a circle corrects per lead time.
const COURSE_GAIN: f64 = 0.4;
const RADIUS_GAIN: f64 = 0.1;
/// Weight of the shortfall of two circles relative to that of the paths onto them, which are flown before.
const CIRCLES_WEIGHT: f64 = 0.3;
/// Steps of a lap on a circle over ground.
const LAP_STEPS: f64 = 64.0;

/// Direction of a circle.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Sense {
    Left,
    Right,
}

impl Sense {
    pub(crate) const BOTH: [Self; 2] = [Self::Left, Self::Right];

    pub(crate) fn of(is_left: bool) -> Self {
        if is_left { Self::Left } else { Self::Right }
    }

    /// This sense, then the other one.
    pub(crate) fn with_other(self) -> [Self; 2] {
        [self, Self::of(self == Self::Right)]
    }

    /// Sign of the turn rate.
    fn sign(self) -> f64 {
        if self == Self::Left { 1.0 } else { -1.0 }
    }
}

/// Circle over ground.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Ring {
    centre: Position,
    radius_m: f64,
}

/// A fallback that a UAV has found to be clear of all outlines.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Plan {
    pub(crate) sense: Sense,
    /// Circle that it ends in.
    ring: Ring,
    /// Time until the UAV holds this circle, s.
    entry_s: f64,
}

impl Plan {
    /// The plan when the UAV has flown it for a time.
    pub(crate) fn after_s(self, time_s: f64) -> Self {
        Self { entry_s: self.entry_s - time_s, ..self }
    }
}

/// Predicts fallbacks.
#[derive(Debug, Clone)]
pub(crate) struct FallbackModel {
    pub(crate) airframe: Airframe,
    /// True if circles are over ground.
    is_over_ground: bool,
    /// One command, in pieces: the first one, and those of the fallback.
    first: Pieces,
    held: Pieces,
    /// Number of commands until the turn is a circle.
    commands: usize,
    /// Time from a decision until its command has its effect, s.
    lead_s: f64,
    /// Maximum deviation of the distance between two flown paths from the distance between the chords of the predicted
    /// ones, m.
    pub(crate) error_m: f64,
    /// Time in which a UAV can fly towards another one before it has turned away, s.
    pub(crate) turning_s: f64,
}

/// A command, divided into equal pieces.
#[derive(Debug, Clone)]
struct Pieces {
    response: AutopilotModel,
    count: usize,
}

impl Pieces {
    fn of(uav: &UavParams, time_s: f64) -> Self {
        let exact = (time_s * uav.turn_rate_max_rad_s / TURN_STEP_RAD).ceil().clamp(1.0, POINTS_MAX);
        let count = if uav.integrator == Integrator::Euler { 1.0 } else { exact };
        Self { response: uav.response(Duration::from_s(time_s / count)), count: count as usize }
    }

    fn piece_s(&self) -> f64 {
        self.response.duration_s()
    }

    fn time_s(&self) -> f64 {
        self.piece_s() * self.count as f64
    }

    /// Deviation of an arc of the longer pieces from its chord, m.
    fn sagitta_m(&self, other: &Self, airframe: &Airframe) -> f64 {
        let longest_s = self.piece_s().max(other.piece_s());
        airframe.fastest_over_ground_m_s() * longest_s * airframe.uav.turn_rate_max_rad_s * longest_s / 8.0
    }
}

/// Path of a UAV: a command for one period, then a fallback.
#[derive(Debug, Clone)]
pub(crate) struct Path {
    points: Vec<Position>,
    /// Circle at the end.
    ring: Ring,
    /// Distance of the last point from this circle, m.
    off_m: f64,
    airspeed_m_s: f64,
    /// Turn rate on the circle, rad/s; `None` if it changes with the course, in wind.
    turn_rate_rad_s: Option<f64>,
    /// Unit vector from the centre to the last point.
    spoke: Vector2<f64>,
    pub(crate) sense: Sense,
}

impl Path {
    /// Consecutive positions.
    pub(crate) fn points(&self) -> &[Position] {
        &self.points
    }

    /// Distances from the centre of the circle at the end at which the UAV stays, m.
    pub(crate) fn ring_m(&self) -> (Position, [f64; 2]) {
        let Ring { centre, radius_m } = self.ring;
        (centre, [radius_m - self.off_m, radius_m + self.off_m])
    }
}

/// The two paths of a UAV after a command, each computed when it is needed.
#[derive(Debug)]
pub(crate) struct Paths<'a> {
    model: &'a FallbackModel,
    from: &'a Motion,
    pub(crate) command: Command,
    paths: [OnceCell<Path>; 2],
}

impl<'a> Paths<'a> {
    pub(crate) fn after(model: &'a FallbackModel, from: &'a Motion, command: Command) -> Self {
        Self { model, from, command, paths: [OnceCell::new(), OnceCell::new()] }
    }

    pub(crate) fn of(&self, sense: Sense) -> &Path {
        self.paths[sense as usize].get_or_init(|| self.model.path(self.from, self.command, sense))
    }
}

impl FallbackModel {
    /// Fallback in the air.
    pub(crate) fn in_air(airframe: Airframe, period_s: f64) -> Self {
        let uav = &airframe.uav;
        let (lags, lag_s) = (SETTLED_LAGS, uav.speed_lag_s.max(uav.turn_rate_lag_s));
        let settled_s = match uav.integrator {
            Integrator::Exact => uav.settling_s(lags).max(SETTLED_MIN_S),
            // Euler steps settle slowly.
            Integrator::Euler => 4.0 * lags * lag_s,
        };
        let held_s = match uav.integrator {
            Integrator::Exact => period_s.max(settled_s / COMMANDS_MAX),
            Integrator::Euler => period_s,
        };
        let (first, held) = (Pieces::of(uav, period_s), Pieces::of(uav, held_s));
        // Those of both paths.
        let arcs_m = 2.0 * first.sagitta_m(&held, &airframe);
        Self {
            is_over_ground: false,
            commands: (settled_s / held_s).ceil().clamp(1.0, 200.0) as usize,
            lead_s: uav.turn_rate_lag_s + 0.5 * period_s,
            error_m: arcs_m + airframe.wind_error_m(),
            turning_s: 2.0 * period_s + uav.turn_delay_s() + 1.0 / uav.turn_rate_max_rad_s,
            first,
            held,
            airframe,
        }
    }

    /// Fallback over ground.
    pub(crate) fn over_ground(airframe: Airframe, period_s: f64) -> Self {
        Self { is_over_ground: true, ..Self::in_air(airframe, period_s) }
    }

    /// Deviation of an arc from its chord, m.
    pub(crate) fn sagitta_m(&self) -> f64 {
        self.first.sagitta_m(&self.held, &self.airframe)
    }

    /// Time from the beginning of a fallback until it is a circle, s.
    pub(crate) fn settled_s(&self) -> f64 {
        self.held.piece_s() * (self.held.count * self.commands) as f64
    }

    /// Wind in which circles are over ground; `None` if they are in the air.
    fn ring_wind(&self, motion: &Motion) -> Option<Wind> {
        (self.is_over_ground && motion.wind != Wind::default()).then_some(motion.wind)
    }

    /// Airspeed, m/s, and radius, m, of the circle of a UAV.
    fn circle(&self, motion: &Motion) -> (f64, f64) {
        let airspeed_m_s = self.airframe.circle_airspeed_m_s(motion.state.speed_m_s);
        let wind = self.ring_wind(motion);
        let wind_m_s = wind.map_or(0.0, |wind| wind.velocity.speed_m_s().max(self.airframe.wind_m_s));
        (airspeed_m_s, self.airframe.circle_m(airspeed_m_s, wind_m_s))
    }

    /// False if the wind is at least as fast as a UAV on its circle over ground.
    pub(crate) fn can_circle(&self, motion: &Motion) -> bool {
        let (airspeed_m_s, _) = self.circle(motion);
        self.ring_wind(motion).is_none_or(|wind| wind.velocity.speed_m_s() < airspeed_m_s)
    }

    /// Radius of the circle of a UAV, m.
    pub(crate) fn circle_m(&self, motion: &Motion) -> f64 {
        self.circle(motion).1
    }

    /// Command of a fallback: a turn, or the circle of a plan.
    pub(crate) fn command(&self, motion: &Motion, sense: Sense, plan: Option<&Plan>) -> Command {
        let (speed_m_s, radius_m) = self.circle(motion);
        let turn_rate_max_rad_s = self.airframe.uav.turn_rate_max_rad_s;
        let turn_rate_rad_s = match self.ring_wind(motion) {
            None => sense.sign() * turn_rate_max_rad_s,
            Some(wind) => {
                let ring = plan.filter(|plan| plan.entry_s <= 0.0).map(|plan| plan.ring);
                self.heading_rate_rad_s((motion, wind), sense, ring, radius_m)
                    .clamp(-turn_rate_max_rad_s, turn_rate_max_rad_s)
            }
        };
        Command { speed_m_s, turn_rate_rad_s }
    }

    /// Heading rate at constant airspeed on a circle over ground: psi' = V_g chi' / (V_a cos(psi - chi)), with the course
    /// rate chi' = V_g / r, for the course at which the command has its effect; and towards the ring, if any.
    fn heading_rate_rad_s(
        &self,
        (motion, wind): (&Motion, Wind),
        sense: Sense,
        ring: Option<Ring>,
        radius_m: f64,
    ) -> f64 {
        let state = &motion.state;
        let now = state.velocity() + wind.velocity;
        let heading = state.heading + Angle::from_rad(state.turn_rate_rad_s * self.lead_s);
        let then = Velocity::from_polar(state.speed_m_s, heading) + wind.velocity;
        let (course, ground_speed_m_s) = (then.direction(), then.speed_m_s());
        let cos_drift = (heading - course).sin_cos().1.max(0.1);
        let mut course_rate_rad_s = sense.sign() * ground_speed_m_s / ring.map_or(radius_m, |ring| ring.radius_m);
        if let Some(Ring { centre, radius_m }) = ring {
            let out = state.position + (now + then) * (0.5 * self.lead_s) - centre;
            let gain_1_s = COURSE_GAIN / self.lead_s;
            let inward_rad = (out.length_m() - radius_m) * RADIUS_GAIN / self.lead_s / ground_speed_m_s.max(1.0);
            let along = out.direction() + Angle::from_rad(sense.sign() * (0.5 * PI + inward_rad.clamp(-1.0, 1.0)));
            course_rate_rad_s += gain_1_s * (along - course).rad();
        }
        ground_speed_m_s * course_rate_rad_s / (state.speed_m_s.max(1.0) * cos_drift)
    }

    /// Path from a motion: a command for one period, then the fallback.
    pub(crate) fn path(&self, from: &Motion, command: Command, sense: Sense) -> Path {
        self.rollout(from, command, sense, None)
    }

    /// Path from a motion on which the UAV flies a plan from now on.
    pub(crate) fn path_of(&self, from: &Motion, plan: &Plan) -> Path {
        let first = self.command(from, plan.sense, Some(plan));
        self.rollout(from, first, plan.sense, Some(plan.after_s(self.first.time_s())))
    }

    fn rollout(&self, from: &Motion, first: Command, sense: Sense, plan: Option<Plan>) -> Path {
        let mut motion = *from;
        let mut points = Vec::with_capacity(1 + self.first.count + self.held.count * self.commands);
        points.push(motion.state.position);
        let mut fly = |motion: &mut Motion, pieces: &Pieces, command| {
            for _ in 0..pieces.count {
                *motion = pieces.response.advance(motion, command);
                points.push(motion.state.position);
            }
        };
        fly(&mut motion, &self.first, first);
        // In the air the command stays the same, also if power does not suffice for a constant airspeed.
        let turn = self.command(&motion, sense, None);
        let held_s = self.held.time_s();
        for number in 0..self.commands {
            let command = match self.ring_wind(&motion) {
                None => turn,
                Some(_) => self.command(&motion, sense, plan.map(|plan| plan.after_s(held_s * number as f64)).as_ref()),
            };
            fly(&mut motion, &self.held, command);
        }
        let (ring, turn_rate_rad_s) = self.ring(&motion, turn, sense);
        let ring = plan.filter(|_| self.ring_wind(&motion).is_some()).map_or(ring, |plan| plan.ring);
        let out = motion.state.position - ring.centre;
        let off_m = (out.length_m() - ring.radius_m).abs();
        let spoke = Displacement::from_polar(1.0, out.direction()).vector();
        Path { points, ring, off_m, airspeed_m_s: turn.speed_m_s, turn_rate_rad_s, spoke, sense }
    }

    /// Circle that a UAV flies that has settled in a turn, and its turn rate in the air.
    fn ring(&self, end: &Motion, turn: Command, sense: Sense) -> (Ring, Option<f64>) {
        let uav = &self.airframe.uav;
        let ((radius_m, lean_rad), course, turn_rate_rad_s) = match self.ring_wind(end) {
            Some(wind) => ((self.circle_m(end), 0.0), (end.state.velocity() + wind.velocity).direction(), None),
            None => {
                let turn_rate_rad_s = uav.turn_rate_max_at_rad_s(turn.speed_m_s);
                let circle = circle(uav, turn.speed_m_s, turn_rate_rad_s, self.held.piece_s());
                (circle, end.state.heading, Some(turn_rate_rad_s))
            }
        };
        let to_centre = course + Angle::from_rad(sense.sign() * (0.5 * PI - lean_rad));
        let centre = end.state.position + Displacement::from_polar(radius_m, to_centre);
        (Ring { centre, radius_m }, turn_rate_rad_s)
    }

    /// The plan to fly the fallback of a path after its first period.
    pub(crate) fn plan(&self, path: &Path) -> Plan {
        Plan { sense: path.sense, ring: path.ring, entry_s: self.settled_s() }
    }

    /// Radius of the free circle that a UAV at its nominal speed needs to fly its fallback forever, m.
    pub(crate) fn nominal_circle_m(&self) -> f64 {
        let uav = &self.airframe.uav;
        let airspeed_m_s = self.airframe.circle_airspeed_m_s(uav.speed_m_s);
        let in_air_m = || circle(uav, airspeed_m_s, uav.turn_rate_max_at_rad_s(airspeed_m_s), self.held.piece_s()).0;
        let wind_m_s = if self.is_over_ground { self.airframe.wind_m_s } else { 0.0 };
        if wind_m_s > 0.0 { self.airframe.circle_m(airspeed_m_s, wind_m_s) } else { in_air_m() }
    }

    /// Shortfall of the distance of two paths in the same wind, as a fraction of the required distance: the largest plus
    /// the mean until both are circles, plus a part of that of the circles. Zero if they never come nearer than that.
    pub(crate) fn shortfall(&self, a: &Path, b: &Path, required_m: f64, wind: Wind) -> f64 {
        let relative = |point: usize| (a.points[point] - b.points[point]).vector();
        let (mut from, mut worst, mut sum) = (relative(0), 0.0, 0.0);
        let short = |distance_m: f64| ((required_m - distance_m) / required_m).max(0.0);
        let pieces = a.points.len().min(b.points.len()) - 1;
        let required_m2 = required_m * required_m;
        for piece in 1..=pieces {
            let to = relative(piece);
            // Far apart, and both ends of the piece within the required distance of each other.
            if to.norm_squared() > 4.01 * required_m2 && (to - from).norm_squared() < required_m2 {
                from = to;
                continue;
            }
            worst = f64::max(worst, short(least_length([from, to])));
            sum += short(to.norm());
            from = to;
        }
        worst + sum / pieces as f64 + CIRCLES_WEIGHT * short(circles_m(a, b, required_m, wind))
    }
}

/// Radius of the circle that a UAV flies with a constant turn rate, m, and how far its heading leans out of the tangent,
/// rad. Euler steps of `step_s` form a polygon; its corners are on the circle.
fn circle(uav: &UavParams, speed_m_s: f64, turn_rate_rad_s: f64, step_s: f64) -> (f64, f64) {
    match uav.integrator {
        Integrator::Exact => (speed_m_s / turn_rate_rad_s, 0.0),
        Integrator::Euler => {
            let lean_rad = (0.5 * turn_rate_rad_s * step_s).clamp(1e-6, 1.5);
            (0.5 * speed_m_s * step_s / math::sin(lean_rad), lean_rad)
        }
    }
}

/// Lower bound of the distance of two UAVs that fly the circles at the end of their paths forever, m; exact for circles of
/// equal radius and airspeed. May be larger than `enough_m` if that is exceeded.
fn circles_m(a: &Path, b: &Path, enough_m: f64, wind: Wind) -> f64 {
    let apart = (a.ring.centre - b.ring.centre).vector();
    let wider_m = (a.ring.radius_m - b.ring.radius_m).abs();
    // At some time, both may be where the circles come nearest.
    let outside_m = apart.norm() - a.ring.radius_m - b.ring.radius_m;
    let nested_m = wider_m - apart.norm();
    let least_m = outside_m.max(nested_m).max(0.0);
    match (a.turn_rate_rad_s, b.turn_rate_rad_s) {
        _ if least_m >= enough_m => least_m,
        (None, None) if a.airspeed_m_s == b.airspeed_m_s => lap_m([a, b], wind),
        (Some(a_rad_s), Some(b_rad_s)) if a_rad_s == b_rad_s => turning_m(a, b, wider_m),
        _ => least_m,
    }
}

/// Distance of two UAVs on circles in the air that they fly at one turn rate, m.
fn turning_m(a: &Path, b: &Path, wider_m: f64) -> f64 {
    let (apart, radius_m) = ((a.ring.centre - b.ring.centre).vector(), 0.5 * (a.ring.radius_m + b.ring.radius_m));
    if a.sense == b.sense {
        // The difference of the two spokes turns, but keeps its length.
        return ((apart.norm() - radius_m * (a.spoke - b.spoke).norm()).abs() - wider_m).max(0.0);
    }
    // The difference of two spokes that turn in opposite directions moves to and fro on a line.
    let bisector = a.spoke + b.spoke;
    let along = match bisector.norm() {
        length if length > 1e-6 => Vector2::new(-bisector.y, bisector.x) / length,
        _ => a.spoke,
    };
    let most_m = 2.0 * radius_m;
    let at_m = (-apart.dot(&along)).clamp(-most_m, most_m);
    ((apart + along * at_m).norm() - wider_m).max(0.0)
}

/// Minimum distance of two UAVs on circles over ground during one lap, m. Both need the same time for a lap.
fn lap_m(paths: [&Path; 2], wind: Wind) -> f64 {
    let mut spokes = paths.map(|path| path.spoke);
    let place = |path: &Path, spoke: Vector2<f64>| path.ring.centre.vector() + spoke * path.ring.radius_m;
    // Spoke after a time, at the ground speed on its course.
    let turned = |path: &Path, from: Vector2<f64>, at: Vector2<f64>, time_s: f64| {
        let along = Vector2::new(-at.y, at.x) * path.sense.sign();
        let ground_speed_m_s = wind.ground_speed_m_s(along, path.airspeed_m_s).max(1.0);
        let angle_rad = path.sense.sign() * ground_speed_m_s * time_s / path.ring.radius_m;
        let (sin, cos) = math::sin_cos(angle_rad);
        Vector2::new(from.x * cos - from.y * sin, from.x * sin + from.y * cos)
    };
    let airspeed_m_s = paths[0].airspeed_m_s;
    let slowest_m_s = (airspeed_m_s - wind.velocity.speed_m_s()).max(1.0);
    // The harmonic mean of the ground speeds on a circle is at least that of the lowest and the highest one.
    let lap_s = math::TAU * paths[0].ring.radius_m / slowest_m_s.max(0.3 * airspeed_m_s);
    let step_s = math::TAU * paths[0].ring.radius_m / (LAP_STEPS * airspeed_m_s);
    let mut from = place(paths[0], spokes[0]) - place(paths[1], spokes[1]);
    let mut least_m = from.norm();
    for _ in 0..(lap_s / step_s).ceil() as usize {
        spokes = [0, 1].map(|index| {
            let middle = turned(paths[index], spokes[index], spokes[index], 0.5 * step_s);
            turned(paths[index], spokes[index], middle, step_s)
        });
        let to = place(paths[0], spokes[0]) - place(paths[1], spokes[1]);
        least_m = least_m.min(least_length([from, to]));
        from = to;
    }
    least_m
}

/// Chooses a sense for each UAV so that the largest shortfall is as small as possible; returns that shortfall and the
/// senses. `short(i, s, j, t)` is the shortfall of UAV `i` on sense `s` with UAV `j` on sense `t`; for `i` equal to `j`, that
/// of UAV `i` alone. It is called at most once with the same arguments. Of equal choices, the preferred senses count.
pub(crate) fn choose_senses(
    preferred: &[Sense],
    short: impl Fn(usize, Sense, usize, Sense) -> f64,
) -> (f64, Vec<Sense>) {
    struct Search<S> {
        short: S,
        /// Shortfalls of the last UAV and each other one, by senses and numbers; NaN if not yet computed.
        known: Vec<f64>,
        chosen: Vec<Sense>,
        best: (f64, Vec<Sense>),
    }
    impl<S: Fn(usize, Sense, usize, Sense) -> f64> Search<S> {
        fn place(&mut self, preferred: &[Sense], worst: f64) {
            let index = self.chosen.len();
            if worst >= self.best.0 {
                return;
            }
            let Some(first) = preferred.get(index) else {
                self.best = (worst, self.chosen.clone());
                return;
            };
            for sense in first.with_other() {
                self.chosen.push(sense);
                let Self { short, known, chosen, .. } = self;
                let mut most = worst;
                for (other, at) in chosen.iter().enumerate() {
                    let known = &mut known[4 * (index * preferred.len() + other) + 2 * sense as usize + *at as usize];
                    if known.is_nan() {
                        *known = short(index, sense, other, *at);
                    }
                    most = most.max(*known);
                }
                self.place(preferred, most);
                self.chosen.pop();
            }
        }
    }
    let known = vec![f64::NAN; 4 * preferred.len() * preferred.len()];
    let mut search = Search { short, known, chosen: Vec::new(), best: (f64::INFINITY, preferred.to_vec()) };
    search.place(preferred, 0.0);
    search.best
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::params::{BankParams, TeamParams};
    use crate::safety::zones::tests::Drawn;
    use crate::uav::UavState;

    fn drawn_state(drawn: &mut Drawn, uav: &UavParams) -> UavState {
        UavState {
            position: Position::from_m(drawn.between(-200.0, 200.0), drawn.between(-200.0, 200.0)),
            heading: Angle::from_rad(drawn.between(-PI, PI)),
            speed_m_s: drawn.between(25.0, 55.0),
            turn_rate_rad_s: drawn.between(-1.0, 1.0) * uav.turn_rate_max_rad_s,
            vertical: None,
        }
    }

    /// Minimum distance of two UAVs that fly a command for one period, then an escape manoeuvre for a minute.
    fn flown_m(
        model: &FallbackModel,
        period_s: f64,
        starts: [UavState; 2],
        first: [Command; 2],
        senses: [Sense; 2],
    ) -> f64 {
        let uav = &model.airframe.uav;
        let piece_s = period_s / 50.0;
        let response = uav.response(Duration::from_s(piece_s));
        let mut motions = starts.map(|state| Motion::steady(uav, &state));
        let mut commands = first;
        let mut least_m = f64::INFINITY;
        for piece in 0..(60.0 / piece_s) as usize {
            least_m = least_m.min(motions[0].state.position.distance_m(motions[1].state.position));
            for ((motion, command), side) in motions.iter_mut().zip(&mut commands).zip(senses) {
                if piece == 50 {
                    *command = model.command(motion, side, None);
                }
                *motion = response.advance(motion, *command);
            }
        }
        least_m
    }

    /// The shortfall is that of the flown paths, with all periods and lags; never smaller by more than the error of
    /// chords.
    #[test]
    fn the_predicted_distance_of_two_escape_manoeuvres_is_flown() {
        let mut drawn = Drawn(7);
        for case in 0..300 {
            let lag_s = |drawn: &mut Drawn| drawn.between(0.1, 2.0);
            let (speed_lag_s, turn_rate_lag_s) = (lag_s(&mut drawn), lag_s(&mut drawn));
            let bank = (case % 3 == 0).then(BankParams::default);
            let uav = UavParams { speed_lag_s, turn_rate_lag_s, bank, ..TeamParams::paper().uav };
            let period_s = [0.1, 0.5, 1.0, 2.0][drawn.below(4)];
            let model = FallbackModel::in_air(Airframe::new(uav, 0.0), period_s);
            let starts = [0, 1].map(|_| drawn_state(&mut drawn, &uav));
            let senses = [0, 1].map(|_| Sense::BOTH[drawn.below(2)]);
            let first = [0, 1]
                .map(|_| Command { speed_m_s: drawn.between(25.0, 55.0), turn_rate_rad_s: drawn.between(-0.3, 0.3) });
            let [a, b] =
                [0, 1].map(|index| model.path(&Motion::steady(&uav, &starts[index]), first[index], senses[index]));
            let flown_m = flown_m(&model, period_s, starts, first, senses);
            // Of two required distances around the flown one, the paths keep the smaller one only.
            let error_m = model.error_m + 1.0;
            let kept = model.shortfall(&a, &b, (flown_m - error_m).max(0.01), Wind::default());
            let missed = model.shortfall(&a, &b, flown_m + error_m, Wind::default());
            // The circles of banking UAVs differ: their distance is a lower bound.
            let is_kept = kept == 0.0 || bank.is_some();
            assert!(is_kept && missed > 0.0, "case {case}: {flown_m} m, {kept}, {missed}");
        }
    }

    /// The senses are the best of all combinations.
    #[test]
    fn the_chosen_senses_have_the_smallest_shortfall() {
        let uav = TeamParams::paper().uav;
        let model = FallbackModel::in_air(Airframe::new(uav, 0.0), 0.5);
        let mut drawn = Drawn(3);
        for _ in 0..100 {
            let states = [0; 4].map(|_| drawn_state(&mut drawn, &uav));
            let paths = states.map(|state| {
                let motion = Motion::steady(&uav, &state);
                Sense::BOTH.map(|side| model.path(&motion, model.command(&motion, side, None), side))
            });
            let short = |i: usize, s: Sense, j: usize, t: Sense| match i == j {
                true => 0.0,
                false => model.shortfall(&paths[i][s as usize], &paths[j][t as usize], 52.0, Wind::default()),
            };
            let worst = |senses: &[Sense]| {
                let pairs = (0..4).flat_map(|i| (0..i).map(move |j| (i, j)));
                pairs.map(|(i, j)| short(i, senses[i], j, senses[j])).fold(0.0, f64::max)
            };
            let all = (0..16).map(|bits| [0, 1, 2, 3].map(|index| Sense::BOTH[bits >> index & 1]));
            let best = all.map(|senses| worst(&senses)).fold(f64::INFINITY, f64::min);
            let (shortfall, chosen) = choose_senses(&[Sense::Left; 4], short);
            assert_eq!((shortfall, worst(&chosen)), (best, best));
            let forbidden = |i, s, j, t| if i == 2 && j == 2 && s == Sense::Left { 9.0 } else { short(i, s, j, t) };
            assert_eq!(choose_senses(&[Sense::Left; 4], forbidden).1[2], Sense::Right);
        }
    }
}
