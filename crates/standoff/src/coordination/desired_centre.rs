//! Desired centre of the orbit around a set of targets, and the spread of the targets around it.

use crate::coordination::group_centre::mean_state;
use crate::coordination::memberships::GroupedTrack;
use crate::coordination::spread::furthest_from;
use crate::enclosing_circle::EnclosingCircle;
use crate::frame::{Position, Velocity};
use crate::guidance::standoff_distance::Spread;
use crate::params::CentreEstimate;
use crate::target::TargetState;

/// Relative rounding error of distances, with a wide margin.
const ROUNDING: f64 = 1e-6;

/// Desired centre at one time step, before any filter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct DesiredCentre {
    /// Mean of the targets' states; with the minimum enclosing circle, the centre of the circle replaces the mean
    /// position. The mean velocity is kept, because the velocity of the circle's centre jumps whenever other targets
    /// define the circle (rms 4 m/s and more between time steps over busy streets, compared with 0.7 m/s for the mean),
    /// and predicts the centre in five seconds no better.
    pub(crate) state: TargetState,
    pub(crate) members: u32,
    /// Radius of the minimum enclosing circle and its rate, if that rule is used.
    circle: Option<Spread>,
}

impl DesiredCentre {
    /// Computes the desired centre; `None` without targets.
    pub(crate) fn of(
        rule: CentreEstimate,
        known: &[GroupedTrack],
        places: impl Iterator<Item = usize> + Clone,
    ) -> Option<Self> {
        let (mean, members) = mean_state(places.clone().map(|index| known[index].estimate()))?;
        Some(match rule {
            CentreEstimate::Filtered => Self { state: mean, members, circle: None },
            CentreEstimate::EnclosingCircle => {
                let (centre, spread) = circle_of(places.map(|index| known[index].estimate().state))?;
                let state = TargetState::new(centre, mean.velocity(), mean.acceleration_m_s2());
                Self { state, members, circle: Some(spread) }
            }
        })
    }

    /// Spread of the targets around a centre, by the rule of that centre; `furthest` is the target furthest from it.
    pub(crate) fn spread(&self, furthest: &TargetState, centre: &TargetState) -> Spread {
        self.circle.unwrap_or_else(|| Spread::of(furthest, centre))
    }

    /// Distance from the centre beyond which no further target fits into an orbit that contains targets within
    /// `orbit_m` of its centre, m.
    pub(crate) fn reach_m(&self, orbit_m: f64) -> f64 {
        match self.circle {
            None => {
                let n = f64::from(self.members);
                // The further target moves the centroid towards itself by one part in n + 1.
                orbit_m * (n + 1.0) / n
            }
            // As seen from the further target, at least one target lies on the circle at or beyond its centre. The
            // distance between the two is at least the hypotenuse of a right triangle whose right angle is at the
            // centre, and at most one diameter.
            Some(circle) => (4.0 * orbit_m * orbit_m - circle.distance_m * circle.distance_m).max(0.0).sqrt(),
        }
    }

    /// False if no orbit that contains targets within `orbit_m` of its centre contains `members` and a further target.
    /// This takes less time than their enclosing circle.
    pub(crate) fn may_admit(
        &self,
        further: Position,
        orbit_m: f64,
        mut members: impl Iterator<Item = Position>,
    ) -> bool {
        let (reach_m, squared_m2) = (self.reach_m(orbit_m), further.squared_distance_m2(self.state.position()));
        let is_within = |squared_m2: f64, limit_m: f64| squared_m2 <= limit_m * limit_m;
        let Some(circle) = self.circle else { return is_within(squared_m2, reach_m) };
        // A target inside the circle leaves it unchanged; otherwise, targets are at most one diameter apart.
        is_within(squared_m2, reach_m)
            && (is_within(squared_m2, circle.distance_m * (1.0 + ROUNDING))
                || members.all(|at| is_within(at.squared_distance_m2(further), 2.0 * orbit_m * (1.0 + ROUNDING))))
    }

    /// Index of the target furthest from the desired centre.
    pub(crate) fn furthest(&self, known: &[GroupedTrack], places: impl Iterator<Item = usize>) -> Option<usize> {
        furthest_from(self.state.position(), known, places)
    }
}

/// Centre of the minimum enclosing circle of the targets, its radius and the rate of the radius.
fn circle_of(targets: impl Iterator<Item = TargetState> + Clone) -> Option<(Position, Spread)> {
    let circle = EnclosingCircle::of(targets.clone().map(|target| target.position()))?;
    let velocity = |number: usize| targets.clone().nth(number).map_or(Velocity::ZERO, |target| target.velocity());
    let rate_m_s = circle.motion(velocity).radius_rate_m_s;
    Some((circle.centre, Spread { distance_m: circle.radius_m, rate_m_s }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coordination::memberships::Memberships;
    use crate::message::Cue;
    use crate::params::TeamParams;
    use crate::time::Time;
    use crate::tracking::track::Track;

    fn known(targets: &[(f64, f64, f64)]) -> Vec<GroupedTrack> {
        let mut memberships = Memberships::default();
        for (label, (x_m, y_m, vx_m_s)) in (0..).zip(targets) {
            let velocity = Velocity::from_m_s(*vx_m_s, 0.0);
            let cue = Cue { velocity, ..Cue::at(label, Position::from_m(*x_m, *y_m)) };
            memberships.start(Track::from_cue(&cue, &TeamParams::paper().track, Time::EPOCH).unwrap());
        }
        memberships.tracks().to_vec()
    }

    /// The outer two targets, 200 m apart, move away from each other at 5 and 1 m/s; a third stands near the first.
    #[test]
    fn the_circle_grows_as_the_targets_on_it_move_apart() {
        let known = known(&[(0.0, 0.0, -5.0), (10.0, 6.0, 0.0), (200.0, 0.0, 1.0)]);
        let desired = DesiredCentre::of(CentreEstimate::EnclosingCircle, &known, 0..3).unwrap();
        assert_eq!((desired.state.position(), desired.members), (Position::from_m(100.0, 0.0), 3));
        assert_eq!(desired.circle, Some(Spread { distance_m: 100.0, rate_m_s: 3.0 }));
        // It is the rate of the circle, which is less than the speed at which the second outer target leaves the mean
        // of the three.
        let furthest = known[2].estimate().state;
        assert_eq!(desired.spread(&furthest, &desired.state), Spread { distance_m: 100.0, rate_m_s: 3.0 });
        // The last of the targets on the circle.
        assert_eq!(desired.furthest(&known, 0..3), Some(2));
        let mean = DesiredCentre::of(CentreEstimate::Filtered, &known, 0..3).unwrap();
        assert_eq!((mean.state.position(), mean.circle), (Position::from_m(70.0, 2.0), None));
    }

    /// With a further target at the reach, in any direction, the circle is at least as large as the orbit allows.
    #[test]
    fn no_target_beyond_the_reach_fits() {
        let group = [(-60.0, 0.0, 0.0), (60.0, 0.0, 0.0)];
        let desired = DesiredCentre::of(CentreEstimate::EnclosingCircle, &known(&group), 0..2).unwrap();
        let reach_m = desired.reach_m(100.0);
        let may_admit = |at: (f64, f64), orbit_m| {
            let members = known(&group).into_iter().map(|target| target.position());
            desired.may_admit(Position::from_m(at.0, at.1), orbit_m, members.collect::<Vec<_>>().into_iter())
        };
        // 140 m from the centre is 200 m from one member and 80 m from the other one.
        assert!(may_admit((139.9, 0.0), 100.0) && !may_admit((140.1, 0.0), 100.0));
        assert!(may_admit((0.0, 59.0), 50.0) && !may_admit((0.0, 82.0), 50.0));
        assert!((reach_m - (200.0f64 * 200.0 - 60.0 * 60.0).sqrt()).abs() < 1e-9);
        for degrees in 0..360 {
            let at = crate::frame::Displacement::from_polar(reach_m, crate::angle::Angle::from_deg(f64::from(degrees)));
            let all = known(&[group[0], group[1], (at.x_m(), at.y_m(), 0.0)]);
            let with = DesiredCentre::of(CentreEstimate::EnclosingCircle, &all, 0..3).unwrap();
            assert!(with.circle.unwrap().distance_m >= 100.0 - 1e-9, "{degrees}");
        }
    }
}
