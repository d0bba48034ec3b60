//! Where a set of targets wants the centre of its orbit, and how far it spreads about that.

use crate::coordination::memberships::Known;
use crate::coordination::spread::furthest_from;
use crate::estimation::group_centre::mean_state;
use crate::frame::{Position, Velocity};
use crate::guidance::standoff_distance::Spread;
use crate::smallest_circle::SmallestCircle;
use crate::target::TargetState;
use crate::team::CentreEstimate;

/// The centre that targets want at one instant, before any filter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct WantedCentre {
    /// The mean of their states; with the smallest circle, its centre in place of their mean position. It keeps their mean
    /// velocity: that of the circle's centre jumps with every change on its rim (rms 4 m/s and more from one tick to the
    /// next over busy streets, theirs 0.7 m/s), and foretells where the centre is in five seconds no better.
    pub(crate) state: TargetState,
    pub(crate) members: u32,
    /// The smallest circle's radius and its rate, if that is the rule.
    circle: Option<Spread>,
}

impl WantedCentre {
    /// `None` for no targets.
    pub(crate) fn of(
        rule: CentreEstimate,
        known: &[Known],
        places: impl Iterator<Item = usize> + Clone,
    ) -> Option<Self> {
        let (mean, members) = mean_state(places.clone().map(|index| known[index].estimate()))?;
        Some(match rule {
            CentreEstimate::Filtered | CentreEstimate::Centroid => Self { state: mean, members, circle: None },
            CentreEstimate::SmallestCircle => {
                let (centre, spread) = circle_in(0.0, places.map(|index| known[index].estimate().state))?;
                let state = TargetState::new(centre, mean.velocity(), mean.acceleration_m_s2());
                Self { state, members, circle: Some(spread) }
            }
        })
    }

    /// How far targets spread about a centre, by the rule that put it there: `furthest` is the furthest from it.
    pub(crate) fn spread(&self, furthest: &TargetState, centre: &TargetState) -> Spread {
        self.circle.unwrap_or_else(|| Spread::of(furthest, centre))
    }

    /// From further than this, m, no further target fits into an orbit that holds those within `orbit_m` of its centre.
    pub(crate) fn reach_m(&self, orbit_m: f64) -> f64 {
        match self.circle {
            None => {
                let n = f64::from(self.members);
                // With it, the centroid moves towards it by one part in n + 1.
                orbit_m * (n + 1.0) / n
            }
            // Beyond the centre, seen from it, somebody is on the rim: the two are as far apart as the legs of a right
            // angle at the centre reach, or further, and at most a diameter.
            Some(circle) => (4.0 * orbit_m * orbit_m - circle.distance_m * circle.distance_m).max(0.0).sqrt(),
        }
    }

    /// The place of the target furthest from the wanted centre.
    pub(crate) fn furthest(&self, known: &[Known], places: impl Iterator<Item = usize>) -> Option<usize> {
        furthest_from(self.state.position(), known, places)
    }
}

/// Centre of the smallest circle about targets `in_s` seconds from now, if they keep their velocities; its radius and the
/// rate of that.
pub(crate) fn circle_in(in_s: f64, targets: impl Iterator<Item = TargetState> + Clone) -> Option<(Position, Spread)> {
    let circle = SmallestCircle::of(targets.clone().map(|target| target.position() + target.velocity() * in_s))?;
    let velocity = |number: usize| targets.clone().nth(number).map_or(Velocity::ZERO, |target| target.velocity());
    let rate_m_s = circle.motion(velocity).radius_rate_m_s;
    Some((circle.centre, Spread { distance_m: circle.radius_m, rate_m_s }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coordination::memberships::Memberships;
    use crate::estimation::track::Track;
    use crate::message::{Cue, TargetLabel};
    use crate::team::TeamParams;
    use crate::time::Time;

    fn known(targets: &[(f64, f64, f64)]) -> Vec<Known> {
        let mut memberships = Memberships::default();
        for (label, (x_m, y_m, vx_m_s)) in (0..).zip(targets) {
            let cue = Cue {
                searcher: 0,
                said: Time::START,
                number: 0,
                label: TargetLabel(label),
                time: Time::START,
                position: Position::from_m(*x_m, *y_m),
                velocity: Velocity::from_m_s(*vx_m_s, 0.0),
                position_sd_m: 10.0,
                velocity_sd_m_s: 1.0,
            };
            memberships.start(Track::from_cue(&cue, &TeamParams::table_1().track, Time::START).unwrap());
        }
        memberships.known().to_vec()
    }

    /// The outer two, 200 m apart, part at 5 and 1 m/s; a third stands beside the first.
    #[test]
    fn the_circle_grows_as_those_on_its_rim_part() {
        let known = known(&[(0.0, 0.0, -5.0), (10.0, 6.0, 0.0), (200.0, 0.0, 1.0)]);
        let wanted = WantedCentre::of(CentreEstimate::SmallestCircle, &known, 0..3).unwrap();
        assert_eq!((wanted.state.position(), wanted.members), (Position::from_m(100.0, 0.0), 3));
        assert_eq!(wanted.circle, Some(Spread { distance_m: 100.0, rate_m_s: 3.0 }));
        // It is the circle's, not as fast as the last of those on the rim leaves the mean of the three.
        let furthest = known[2].estimate().state;
        assert_eq!(wanted.spread(&furthest, &wanted.state), Spread { distance_m: 100.0, rate_m_s: 3.0 });
        // The last of those on the rim.
        assert_eq!(wanted.furthest(&known, 0..3), Some(2));
        // Ten seconds later they are 260 m apart.
        let later = circle_in(10.0, known.iter().map(|known| known.estimate().state)).unwrap();
        assert_eq!(later, (Position::from_m(80.0, 0.0), Spread { distance_m: 130.0, rate_m_s: 3.0 }));
        let centroid = WantedCentre::of(CentreEstimate::Centroid, &known, 0..3).unwrap();
        assert_eq!((centroid.state.position(), centroid.circle), (Position::from_m(70.0, 2.0), None));
    }

    /// Wherever one more stands at the reach, the circle is at least as large as the orbit holds.
    #[test]
    fn from_beyond_its_reach_none_fits() {
        let group = [(-60.0, 0.0, 0.0), (60.0, 0.0, 0.0)];
        let wanted = WantedCentre::of(CentreEstimate::SmallestCircle, &known(&group), 0..2).unwrap();
        let reach_m = wanted.reach_m(100.0);
        assert!((reach_m - (200.0f64 * 200.0 - 60.0 * 60.0).sqrt()).abs() < 1e-9);
        for degrees in 0..360 {
            let at = crate::frame::Displacement::from_polar(reach_m, crate::angle::Angle::from_deg(f64::from(degrees)));
            let all = known(&[group[0], group[1], (at.x_m(), at.y_m(), 0.0)]);
            let with = WantedCentre::of(CentreEstimate::SmallestCircle, &all, 0..3).unwrap();
            assert!(with.circle.unwrap().distance_m >= 100.0 - 1e-9, "{degrees}");
        }
    }
}
