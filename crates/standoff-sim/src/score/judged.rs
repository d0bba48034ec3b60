//! What a single frame comes to by the true geometry: the values that the metrics are averages of, one by one.

use std::collections::BTreeMap;

use standoff::{Angle, Position};

use super::bound::Bound;
use super::{Known, Rules, at, centroid, known, on_orbit, position, standoff_m, truth_of};
use crate::record::{Frame, TrackRow, UavRow};

/// A frame, judged by the true geometry.
#[derive(Debug)]
pub struct Judged<'a> {
    rules: &'a Rules,
    frame: &'a Frame,
    /// There was a target before this instant, at which sensors could have been pointed.
    is_after_cue: bool,
    /// Where the UAVs are whose sensors are pointed, and whither.
    looking: Vec<(Position, Angle)>,
    /// True centroid and r_d (15) about it, without a margin, by group.
    orbits: BTreeMap<u32, (Position, f64)>,
}

impl<'a> Judged<'a> {
    /// Looks at a frame; `is_after_cue` if there was a target in one before it.
    #[must_use]
    pub fn new(rules: &'a Rules, frame: &'a Frame, is_after_cue: bool) -> Self {
        let known: Vec<Known> = known(frame).collect();
        let orbit = |group: u32| {
            let members: Vec<Position> = on_orbit(&known, group).collect();
            let centroid = centroid(&members)?;
            Some((group, (centroid, standoff_m(rules, &members, centroid, 0.0))))
        };
        let orbits = frame.groups.iter().filter_map(|group| orbit(group.group)).collect();
        let pointed = |uav: &UavRow| Some((at(uav), Angle::from_rad(uav.boresight_rad?)));
        let looking = frame.uavs.iter().filter_map(pointed).collect();
        Self { rules, frame, is_after_cue, looking, orbits }
    }

    /// r - r_d of a UAV by the true geometry, m, as `standoff_error_m` takes it; positive outside.
    #[must_use]
    pub fn standoff_error_m(&self, uav: &UavRow) -> Option<f64> {
        let (centroid, standoff_m) = self.orbits.get(&uav.group?)?;
        Some(at(uav).distance_m(*centroid) - standoff_m)
    }

    /// Whether any UAV has a target in view, as `out_of_view_fraction` takes it; `None` at the first cue, before which no
    /// sensor can be pointed, and for what does not exist.
    #[must_use]
    pub fn in_view(&self, target: u32) -> Option<bool> {
        let target = position(truth_of(self.frame, target)?);
        let sees = |(uav, boresight): &(Position, Angle)| self.rules.sensor.in_view(*uav, *boresight, target);
        self.is_after_cue.then(|| self.looking.iter().any(sees))
    }

    /// Distance of a target's estimated from its true position, m.
    #[must_use]
    pub fn position_error_m(&self, track: &TrackRow) -> Option<f64> {
        let truth = truth_of(self.frame, track.target)?;
        Some(Position::from_m(track.state[0], track.state[3]).distance_m(position(truth)))
    }

    /// The fourth root of the inverse determinant of the information that one scan by each UAV of a group tells of a
    /// target at the group's true centroid, m: the geometric mean of the semi-axes of its one-sigma ellipse; of a pair
    /// the determinant is (36).
    #[must_use]
    pub fn scan_sd_m(&self, group: u32) -> Option<f64> {
        let (centroid, _) = self.orbits.get(&group)?;
        let crew = self.frame.uavs.iter().filter(|uav| uav.group == Some(group));
        let information = crew.map(|uav| self.rules.sensor.information(at(uav), *centroid)).reduce(|a, b| a + b)?;
        Some(information.determinant().sqrt().sqrt().recip()).filter(|sd_m| sd_m.is_finite())
    }
}

/// The Cramer-Rao bound on positions, target by target, as the frames come: see `docs/metrics.md`.
#[derive(Debug, Clone)]
pub struct PositionBound(Bound);

impl PositionBound {
    /// `None` where no bound is defined: targets that follow no model, or measurements without noise.
    #[must_use]
    pub fn of(rules: &Rules) -> Option<Self> {
        Bound::of(rules).map(Self)
    }

    /// Takes in the next frame.
    pub fn frame(&mut self, frame: &Frame) {
        self.0.frame(frame);
    }

    /// The smallest mean squared position error that any unbiased estimate of a target can have by now, m2.
    #[must_use]
    pub fn position_m2(&self, target: u32) -> Option<f64> {
        self.0.position_m2(target)
    }
}
