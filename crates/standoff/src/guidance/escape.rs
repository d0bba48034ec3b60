//! Escape manoeuvres: turns that UAVs can fly together forever without coming near each other.
//!
//! A UAV has two escape manoeuvres: the hardest turn to the left and to the right at the lowest speed, or for banking
//! aircraft at the current one, which end in circles. Over ground in wind, banking aircraft keep their airspeed instead.
//! Some UAVs are *separable* if each has one of the two such that all pairs keep the required distance forever. If each
//! UAV in turn only flies commands after which they remain separable, they keep that distance (T. Schouwenaars, J. How
//! and E. Feron, *Decentralized Cooperative Trajectory Planning of Multiple Aircraft with Hard Safety Guarantees*, AIAA
//! Guidance, Navigation, and Control Conference 2004).

use nalgebra::Vector2;

use crate::angle::Angle;
use crate::bank::Motion;
use crate::frame::{Displacement, Position};
use crate::guidance::predicted_trajectory::least_length;
use crate::math::PI;
use crate::params::{Integrator, UavParams};
use crate::time::Duration;
use crate::uav::{AutopilotModel, Command};
use crate::wind::PredictionLimits;

/// Maximum turn between two consecutive points of a path, rad.
const TURN_STEP_RAD: f64 = 0.15;
/// Number of lags after which a manoeuvre counts as a circle.
const SETTLED_LAGS: f64 = 5.0;
/// Shortest time until a manoeuvre counts as a circle, s.
const SETTLED_MIN_S: f64 = 4.0;
/// Maximum number of pieces of the first period, and from then on until a manoeuvre is a circle.
const PIECES_MAX: [usize; 2] = [20, 28];
/// Maximum number of points of a path.
const POINTS_MAX: usize = 1 + PIECES_MAX[0] + PIECES_MAX[1];

/// Side of an escape manoeuvre.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Side {
    Left,
    Right,
}

impl Side {
    pub(crate) const BOTH: [Self; 2] = [Self::Left, Self::Right];

    pub(crate) fn of(is_left: bool) -> Self {
        if is_left { Self::Left } else { Self::Right }
    }

    /// This side, then the other one.
    pub(crate) fn with_other(self) -> [Self; 2] {
        [self, Self::of(self == Self::Right)]
    }

    /// Sign of the turn rate.
    fn sign(self) -> f64 {
        if self == Self::Left { 1.0 } else { -1.0 }
    }
}

/// Model of the escape manoeuvres of all UAVs of a team.
#[derive(Debug, Clone)]
pub(crate) struct EscapeModel {
    /// Responses of the first period, and from then on, during one piece.
    responses: [AutopilotModel; 2],
    /// Numbers of these pieces.
    pieces: [usize; 2],
    /// Limits within which manoeuvres are predicted.
    pub(crate) limits: PredictionLimits,
    /// Maximum deviation of the distance between two flown paths from the distance between the chords of the predicted
    /// ones, m.
    pub(crate) error_m: f64,
    /// Time in which a UAV can fly towards another one before it has turned away, s.
    pub(crate) turning_s: f64,
}

/// Path of a UAV: a command for one period, then an escape manoeuvre.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Escape {
    points: [Position; POINTS_MAX],
    /// Circle at the end.
    centre: Position,
    radius_m: f64,
    /// Turn rate on the circle, rad/s; `None` if it changes with the course, in wind.
    turn_rate_rad_s: Option<f64>,
    /// Unit vector from the centre to the last point.
    spoke: Vector2<f64>,
    pub(crate) side: Side,
}

impl EscapeModel {
    pub(crate) fn new(limits: PredictionLimits, period_s: f64) -> Self {
        let uav = &limits.uav;
        let turn_max = uav.turn_rate_max_rad_s;
        let count = |time_s: f64, most: usize| ((time_s * turn_max / TURN_STEP_RAD).ceil() as usize).clamp(1, most);
        let settled_s = uav.settling_s(SETTLED_LAGS).max(SETTLED_MIN_S);
        let pieces = [
            if uav.integrator == Integrator::Exact { count(period_s, PIECES_MAX[0]) } else { 1 },
            count(settled_s, PIECES_MAX[1]),
        ];
        let pieces_s = [period_s / pieces[0] as f64, settled_s / pieces[1] as f64];
        let exact = UavParams { integrator: Integrator::Exact, ..*uav };
        let longest_s = pieces_s[0].max(pieces_s[1]);
        Self {
            responses: [uav.response(Duration::from_s(pieces_s[0])), exact.response(Duration::from_s(pieces_s[1]))],
            pieces,
            limits,
            error_m: 0.25 * limits.fastest_m_s * longest_s * turn_max * longest_s + limits.wind_error_m(),
            turning_s: 2.0 * period_s + uav.turn_delay_s() + 1.0 / turn_max,
        }
    }

    /// The command of an escape manoeuvre that begins with a motion.
    pub(crate) fn command(&self, from: &Motion, side: Side) -> Command {
        from.escape_command(&self.limits, side.sign())
    }

    /// Path from a motion: a command for one period, then the escape manoeuvre.
    pub(crate) fn path(&self, from: &Motion, command: Command, side: Side) -> Escape {
        let mut motion = *from;
        let mut points = [from.state.position; POINTS_MAX];
        let (first, then) = points[1..=self.pieces[0] + self.pieces[1]].split_at_mut(self.pieces[0]);
        for point in first {
            motion = self.responses[0].advance(&motion, from.held(command, &motion));
            *point = motion.state.position;
        }
        let manoeuvre = self.command(&motion, side);
        for point in then {
            motion = self.responses[1].advance(&motion, motion.continued(manoeuvre, &self.limits));
            *point = motion.state.position;
        }
        let state = motion.state;
        let (radius_m, turn_rate_rad_s) = match motion.circle_over_ground_m(&self.limits) {
            Some(radius_m) => (radius_m, None),
            None => {
                let turn_rate_rad_s = self.limits.uav.turn_rate_max_at_rad_s(manoeuvre.speed_m_s);
                (manoeuvre.speed_m_s / turn_rate_rad_s, Some(turn_rate_rad_s))
            }
        };
        let outward = state.heading - Angle::from_rad(side.sign() * 0.5 * PI);
        let centre = state.position + Displacement::from_polar(-radius_m, outward);
        let spoke = Displacement::from_polar(1.0, outward).vector();
        Escape { points, centre, radius_m, turn_rate_rad_s, spoke, side }
    }

    /// Shortfall of the distance of two paths, as a fraction of the required distance: the largest plus the mean. Zero
    /// if they never come nearer than that.
    pub(crate) fn shortfall(&self, a: &Escape, b: &Escape, required_m: f64) -> f64 {
        let relative = |piece: usize| (a.points[piece] - b.points[piece]).vector();
        let (mut from, mut worst, mut sum) = (relative(0), 0.0, 0.0);
        let short = |distance_m: f64| ((required_m - distance_m) / required_m).max(0.0);
        let pieces = self.pieces[0] + self.pieces[1];
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
        f64::max(worst, short(self.circles_m(a, b))) + sum / pieces as f64
    }

    /// Lower bound of the distance of two UAVs that fly the circles at the end of their paths forever, m; exact for
    /// circles of equal radius.
    fn circles_m(&self, a: &Escape, b: &Escape) -> f64 {
        let (apart, radius_m) = ((a.centre - b.centre).vector(), 0.5 * (a.radius_m + b.radius_m));
        let wider_m = (a.radius_m - b.radius_m).abs();
        if a.turn_rate_rad_s.is_none() || a.turn_rate_rad_s != b.turn_rate_rad_s {
            // At some time, both are where the circles come nearest.
            let outside_m = apart.norm() - a.radius_m - b.radius_m;
            return outside_m.max(wider_m - apart.norm()).max(0.0);
        }
        if a.side == b.side {
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
}

/// Chooses a side for each UAV so that the largest shortfall is as small as possible; returns that shortfall and the
/// sides. `short(i, s, j, t)` is the shortfall of UAV `i` on side `s` with UAV `j` on side `t`; for `i` equal to `j`, that
/// of UAV `i` alone. It is called at most once with the same arguments. Of equal choices, the preferred sides count.
pub(crate) fn choose_sides(preferred: &[Side], short: impl Fn(usize, Side, usize, Side) -> f64) -> (f64, Vec<Side>) {
    struct Search<S> {
        short: S,
        /// Shortfalls of the last UAV and each other one, by sides and numbers; NaN if not yet computed.
        known: Vec<f64>,
        chosen: Vec<Side>,
        best: (f64, Vec<Side>),
    }
    impl<S: Fn(usize, Side, usize, Side) -> f64> Search<S> {
        fn place(&mut self, preferred: &[Side], worst: f64) {
            let index = self.chosen.len();
            if worst >= self.best.0 {
                return;
            }
            let Some(first) = preferred.get(index) else {
                self.best = (worst, self.chosen.clone());
                return;
            };
            for side in first.with_other() {
                self.chosen.push(side);
                let Self { short, known, chosen, .. } = self;
                let mut most = worst;
                for (other, at) in chosen.iter().enumerate() {
                    let known = &mut known[4 * (index * preferred.len() + other) + 2 * side as usize + *at as usize];
                    if known.is_nan() {
                        *known = short(index, side, other, *at);
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
    use crate::guidance::geofence_safety::tests::Drawn;
    use crate::params::{BankParams, TeamParams};
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
        model: &EscapeModel,
        period_s: f64,
        starts: [UavState; 2],
        first: [Command; 2],
        sides: [Side; 2],
    ) -> f64 {
        let uav = &model.limits.uav;
        let piece_s = period_s / 50.0;
        let response = uav.response(Duration::from_s(piece_s));
        let mut motions = starts.map(|state| Motion::steady(uav, &state));
        let mut commands = first;
        let mut least_m = f64::INFINITY;
        for piece in 0..(60.0 / piece_s) as usize {
            least_m = least_m.min(motions[0].state.position.distance_m(motions[1].state.position));
            for ((motion, command), side) in motions.iter_mut().zip(&mut commands).zip(sides) {
                if piece == 50 {
                    *command = model.command(motion, side);
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
            let model = EscapeModel::new(PredictionLimits::in_wind(uav, 0.0), period_s);
            let starts = [0, 1].map(|_| drawn_state(&mut drawn, &uav));
            let sides = [0, 1].map(|_| Side::BOTH[drawn.below(2)]);
            let first = [0, 1]
                .map(|_| Command { speed_m_s: drawn.between(25.0, 55.0), turn_rate_rad_s: drawn.between(-0.3, 0.3) });
            let [a, b] =
                [0, 1].map(|index| model.path(&Motion::steady(&uav, &starts[index]), first[index], sides[index]));
            let flown_m = flown_m(&model, period_s, starts, first, sides);
            // Of two required distances around the flown one, the paths keep the smaller one only.
            let error_m = model.error_m + 1.0;
            let kept = model.shortfall(&a, &b, (flown_m - error_m).max(0.01));
            let missed = model.shortfall(&a, &b, flown_m + error_m);
            // The circles of banking UAVs differ: their distance is a lower bound.
            let is_kept = kept == 0.0 || bank.is_some();
            assert!(is_kept && missed > 0.0, "case {case}: {flown_m} m, {kept}, {missed}");
        }
    }

    /// The sides are the best of all combinations.
    #[test]
    fn the_chosen_sides_have_the_smallest_shortfall() {
        let uav = TeamParams::paper().uav;
        let model = EscapeModel::new(PredictionLimits::in_wind(uav, 0.0), 0.5);
        let mut drawn = Drawn(3);
        for _ in 0..100 {
            let states = [0; 4].map(|_| drawn_state(&mut drawn, &uav));
            let paths = states.map(|state| {
                let motion = Motion::steady(&uav, &state);
                Side::BOTH.map(|side| model.path(&motion, model.command(&motion, side), side))
            });
            let short = |i: usize, s: Side, j: usize, t: Side| match i == j {
                true => 0.0,
                false => model.shortfall(&paths[i][s as usize], &paths[j][t as usize], 52.0),
            };
            let worst = |sides: &[Side]| {
                let pairs = (0..4).flat_map(|i| (0..i).map(move |j| (i, j)));
                pairs.map(|(i, j)| short(i, sides[i], j, sides[j])).fold(0.0, f64::max)
            };
            let all = (0..16).map(|bits| [0, 1, 2, 3].map(|index| Side::BOTH[bits >> index & 1]));
            let best = all.map(|sides| worst(&sides)).fold(f64::INFINITY, f64::min);
            let (shortfall, chosen) = choose_sides(&[Side::Left; 4], short);
            assert_eq!((shortfall, worst(&chosen)), (best, best));
            let forbidden = |i, s, j, t| if i == 2 && j == 2 && s == Side::Left { 9.0 } else { short(i, s, j, t) };
            assert_eq!(choose_sides(&[Side::Left; 4], forbidden).1[2], Side::Right);
        }
    }
}
