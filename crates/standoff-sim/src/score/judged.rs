//! What a single frame comes to by the true geometry: the values that the metrics are averages of, one by one.

use std::collections::BTreeMap;

use standoff::{Angle, Position};

use super::rules::Rules;
use crate::frame::{Frame, UavRow, ViewRow};
use crate::geometry::{Geometry, at, centroid, is_seen, looking, off_orbit_m, position, truth_of};

/// A frame, judged by the true geometry.
#[derive(Debug)]
pub struct Judged<'a> {
    /// What needs no rules.
    pub geometry: Geometry<'a>,
    rules: &'a Rules,
    frame: &'a Frame,
    /// There was a target before this instant, at which sensors could have been pointed.
    is_after_cue: bool,
    looking: Vec<(u32, Position, Angle)>,
    /// True centroid and r_d (15) about it, without a margin, by group.
    orbits: BTreeMap<u32, (Position, f64)>,
}

impl<'a> Judged<'a> {
    /// Looks at a frame; `is_after_cue` if there was a target in one before it.
    #[must_use]
    pub fn new(rules: &'a Rules, frame: &'a Frame, is_after_cue: bool) -> Self {
        let geometry = Geometry::of(frame);
        let orbit = |group: u32| {
            let members = geometry.on_orbit(group);
            let centroid = centroid(&members)?;
            Some((group, (centroid, rules.standoff_m(&members, centroid, 0.0))))
        };
        let orbits = frame.groups.iter().filter_map(|group| orbit(group.group)).collect();
        Self { geometry, rules, frame, is_after_cue, looking: looking(frame), orbits }
    }

    /// r - r_d of a UAV by the true geometry, m, as `standoff_error_m` takes it; positive outside.
    #[must_use]
    pub fn standoff_error_m(&self, uav: &UavRow) -> Option<f64> {
        let (centroid, standoff_m) = self.orbits.get(&uav.group?)?;
        Some(off_orbit_m(at(uav), *centroid, *standoff_m))
    }

    /// Whether any UAV has a target in view, as `out_of_view_fraction` takes it; `None` at the first cue, before which no
    /// sensor can be pointed, and for what does not exist.
    #[must_use]
    pub fn in_view(&self, target: u32) -> Option<bool> {
        let target = position(truth_of(self.frame, target)?);
        self.is_after_cue.then(|| is_seen(&self.rules.sensor, &self.looking, target))
    }

    /// What each UAV has in view, by UAV then target.
    pub fn views(&self) -> impl Iterator<Item = ViewRow> {
        let pairs = self.looking.iter().flat_map(|uav| self.frame.truth.iter().map(move |truth| (uav, truth)));
        pairs.filter_map(|((uav, at, boresight), truth)| {
            let seen = self.rules.sensor.look(*at, *boresight, position(truth))?;
            let off_boresight_rad = (seen.bearing - *boresight).rad();
            Some(ViewRow { uav: *uav, target: truth.target, range_m: seen.range_m, off_boresight_rad })
        })
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
