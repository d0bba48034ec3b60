//! What a single frame comes to by the true geometry: the values that the metrics are averages of, one by one.

use standoff::{Angle, Position};

use super::rules::Rules;
use super::true_orbits::TrueOrbits;
use crate::frame::{Frame, GroupRow, UavRow, ViewRow};
use crate::geometry::{Geometry, at, existing, is_seen, looking, off_orbit_m, position, position_error_m, truth_of};

/// Judges the frames of a run, one after the other: true orbits move, and before the first cue nothing is in view.
///
/// ```
/// use standoff_sim::run::Mission;
/// use standoff_sim::scenario::{Edits, Scenario};
/// use standoff_sim::score::{Judge, Rules};
///
/// let scenario = Scenario::load("paper/table-2-pair", &Edits::default(), 1)?;
/// let mut mission = Mission::new(&scenario).expect("a loaded scenario can be flown");
/// let mut judge = Judge::new(Rules::of(&scenario.settings));
/// while let Some(frame) = mission.frame() {
///     let judged = judge.frame(frame);
///     assert!(frame.uavs.iter().all(|uav| judged.standoff_error_m(uav).is_none_or(f64::is_finite)));
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Judge {
    rules: Rules,
    orbits: TrueOrbits,
    /// There was a target in a frame before.
    is_after_cue: bool,
}

impl Judge {
    /// One that has seen nothing yet.
    #[must_use]
    pub fn new(rules: Rules) -> Self {
        Self { rules, orbits: TrueOrbits::default(), is_after_cue: false }
    }

    /// Looks at the next frame.
    pub fn frame<'a>(&'a mut self, frame: &'a Frame) -> Judged<'a> {
        let geometry = Geometry::of(frame);
        self.orbits.next(&self.rules, &frame.groups, geometry.known());
        let is_after_cue = self.is_after_cue;
        self.is_after_cue |= !frame.truth.is_empty();
        Judged { geometry, rules: &self.rules, frame, is_after_cue, looking: looking(frame), orbits: &self.orbits }
    }
}

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
    orbits: &'a TrueOrbits,
}

/// How many of all targets that exist the team knows of and looks at, and how well it knows where they are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Custody {
    /// Targets that exist, known to the team or not.
    pub targets: usize,
    /// Of them: those that have a track.
    pub tracked: usize,
    /// Of those tracked: members of a group that a UAV has in view, of whatever group. `None` as for [`Judged::in_view`].
    pub watched: Option<usize>,
    /// Of all: those that a UAV has in view, known or not.
    pub seen: Option<usize>,
    /// Root of the mean squared position error of those tracked, m; `None` where there are none.
    pub position_error_m: Option<f64>,
}

impl Judged<'_> {
    /// r - r_d of a UAV by the true geometry, m, as `standoff_error_m` takes it; positive outside.
    #[must_use]
    pub fn standoff_error_m(&self, uav: &UavRow) -> Option<f64> {
        let orbit = self.orbits.of(uav.group?)?.flown;
        Some(off_orbit_m(at(uav), orbit.centre, orbit.radius_m))
    }

    /// Distance from a group's estimated centre to that of its true orbit, m. `None` where a target on the orbit does not
    /// exist: the estimate is of all of them.
    #[must_use]
    pub fn centre_error_m(&self, group: &GroupRow) -> Option<f64> {
        self.geometry.centre_error_m(group, self.orbits.of(group.group).map(|orbit| orbit.flown.centre))
    }

    /// Whether any UAV has a target in view, as `out_of_view_fraction` takes it; `None` at the first cue, before which no
    /// sensor can be pointed, and for what does not exist.
    #[must_use]
    pub fn in_view(&self, target: u32) -> Option<bool> {
        let target = position(truth_of(self.frame, target)?);
        self.is_after_cue.then(|| is_seen(&self.rules.sensor, &self.looking, target))
    }

    /// The custody of all targets at once.
    #[must_use]
    pub fn custody(&self) -> Custody {
        let is_in_view = |truth| is_seen(&self.rules.sensor, &self.looking, position(truth));
        // In the order of targets, as the truth is.
        let in_view: Vec<u32> =
            self.frame.truth.iter().filter(|truth| is_in_view(truth)).map(|truth| truth.target).collect();
        let (mut tracked, mut watched, mut errors_m2) = (0, 0, 0.0);
        for (track, truth) in existing(self.frame) {
            tracked += 1;
            watched += usize::from(track.group.is_some() && in_view.binary_search(&track.target).is_ok());
            let error_m = position_error_m(track, truth);
            errors_m2 += error_m * error_m;
        }
        Custody {
            targets: self.frame.truth.len(),
            tracked,
            watched: self.is_after_cue.then_some(watched),
            seen: self.is_after_cue.then_some(in_view.len()),
            position_error_m: (tracked > 0).then(|| (errors_m2 / tracked as f64).sqrt()),
        }
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
    /// target at the group's true centre, m: the geometric mean of the semi-axes of its one-sigma ellipse; of a pair
    /// the determinant is (36).
    #[must_use]
    pub fn scan_sd_m(&self, group: u32) -> Option<f64> {
        let centre = self.orbits.of(group)?.flown.centre;
        let crew = self.frame.uavs.iter().filter(|uav| uav.group == Some(group));
        let information = crew.map(|uav| self.rules.sensor.information(at(uav), centre)).reduce(|a, b| a + b)?;
        Some(information.determinant().sqrt().sqrt().recip()).filter(|sd_m| sd_m.is_finite())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::Mission;
    use crate::scenario::{Edits, Scenario};

    /// A flight in which targets slip out of view.
    #[test]
    fn the_custody_of_all_targets_counts_them_one_by_one() {
        let scenario = Scenario::load("paper/figure-9-basic", &Edits::default(), 1).unwrap();
        let mut mission = Mission::new(&scenario).unwrap();
        let mut judge = Judge::new(Rules::of(&scenario.settings));
        let (mut instants, mut unseen) = (0, 0);
        while let Some(frame) = mission.frame() {
            let judged = judge.frame(frame);
            let custody = judged.custody();
            assert_eq!(custody.targets, frame.truth.len());
            let tracks: Vec<_> = frame.tracks.iter().filter(|row| truth_of(frame, row.target).is_some()).collect();
            assert_eq!(custody.tracked, tracks.len());
            let errors = tracks.iter().filter_map(|track| judged.geometry.position_error_m(track));
            let mean_m2 = errors.map(|error_m| error_m * error_m).sum::<f64>() / tracks.len() as f64;
            assert_eq!(custody.position_error_m, Some(mean_m2.sqrt()).filter(|_| !tracks.is_empty()));
            let views: Option<Vec<bool>> = frame.truth.iter().map(|truth| judged.in_view(truth.target)).collect();
            let Some(views) = views.filter(|_| judged.is_after_cue) else {
                assert_eq!((custody.seen, custody.watched), (None, None));
                continue;
            };
            assert_eq!(custody.seen, Some(views.iter().filter(|&&view| view).count()));
            let members = tracks.iter().filter(|row| row.group.is_some() && judged.in_view(row.target) == Some(true));
            assert_eq!(custody.watched, Some(members.count()));
            instants += 1;
            unseen += usize::from(custody.seen < Some(custody.targets));
        }
        assert!(instants > 150 && unseen > 0, "of {instants} instants {unseen} with a target out of view");
    }
}
