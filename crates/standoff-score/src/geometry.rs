//! Geometric quantities of one time step: the only place where scores, figures, pages and records derive them from
//! rows.

use std::collections::BTreeSet;

use standoff::enclosing_circle::EnclosingCircle;
use standoff::grid::Grid;
use standoff::math::{self, TAU};
use standoff::params::CentreEstimate;
use standoff::{Angle, Position, RangeBearingMeasurement, SensorParams, TargetState, Velocity};
use standoff_record::{Frame, GroupRow, TrackRow, TruthRow, UavRow};

use crate::buildings::Buildings;
pub(crate) use crate::matching::position;
use crate::matching::{Matched, Matching};

/// True targets and tracks of a frame, and the quantities derived from them.
#[derive(Debug)]
pub struct Geometry<'a> {
    matching: Matching<'a>,
}

impl<'a> Geometry<'a> {
    /// Computes the geometry of a frame.
    #[must_use]
    pub fn of(frame: &'a Frame) -> Self {
        Self { matching: Matching::of(frame) }
    }

    /// Largest off-boresight angle of a UAV: the angle between its boresight and the true position of a member of its
    /// group, rad. Targets in dwell count for the passing group; targets that do not exist count for none. `None` if no
    /// member exists or the sensor is not pointed.
    #[must_use]
    pub fn off_boresight_rad(&self, uav: &UavRow) -> Option<f64> {
        let [angle_rad, _] = off_boresight_angles_rad([uav; 2], &self.matching);
        angle_rad
    }

    /// Distance from the estimated centre of a group to the true centre of the targets on its orbit, those in dwell
    /// included, m. `None` if one of them does not exist, because the estimate is that of all of them.
    pub(crate) fn centre_error_m(&self, group: &GroupRow, true_centre: Option<Position>) -> Option<f64> {
        let is_whole = !self.matching.unmatched_tracks().iter().any(|track| is_on_orbit(track, group.group));
        Some(true_centre.filter(|_| is_whole)?.distance_m(centre(group)))
    }

    /// Distance between the estimated and the true position of a target, m; `None` if the target does not exist.
    #[must_use]
    pub fn position_error_m(&self, track: &TrackRow) -> Option<f64> {
        self.matching.target_of(track).map(|target| Matched { target, track }.position_error_m())
    }

    /// Returns the true targets and the tracks of the frame.
    #[must_use]
    pub fn matching(&self) -> &Matching<'a> {
        &self.matching
    }
}

/// Orbit error r - r_d of a UAV with respect to the agents' own estimate of its group, m; positive outside the orbit.
#[must_use]
pub fn own_estimate_error_m(uav: &UavRow, group: &GroupRow) -> f64 {
    off_orbit_m(at(uav), centre(group), group.standoff_distance_m)
}

/// Radial distance of a UAV from an orbit, m; positive outside, negative inside.
pub(crate) fn off_orbit_m(uav: Position, centre: Position, radius_m: f64) -> f64 {
    uav.distance_m(centre) - radius_m
}

/// Returns the group to which a UAV is assigned.
#[must_use]
pub fn group_of<'a>(frame: &'a Frame, uav: &UavRow) -> Option<&'a GroupRow> {
    let id = uav.group?;
    // Groups are usually sorted.
    match frame.groups.binary_search_by_key(&id, |group| group.group) {
        Ok(index) => Some(&frame.groups[index]),
        Err(_) => frame.groups.iter().find(|group| group.group == id),
    }
}

/// Identifies a phase difference: the number of UAVs on the orbit, the UAV, and the other UAV of a pair. With more than
/// two UAVs, the difference is to the next UAV anticlockwise, and the last field is `None`. With more than three, a UAV
/// also counts as the one opposite it.
pub type PhasePair = (usize, u32, Option<u32>);

/// Returns the phase differences of each group in a frame, rad. A group with an unknown phase has none, because its
/// neighbours and their number would be wrong.
#[must_use]
pub fn phase_differences(frame: &Frame) -> Vec<(u32, PhasePair, f64)> {
    let mut found = Vec::new();
    let groups: BTreeSet<u32> = frame.uavs.iter().filter_map(|row| row.group).collect();
    for group in groups {
        let uavs = frame.uavs.iter().filter(|row| row.group == Some(group));
        let phase = |row: &UavRow| Some(Angle::from_rad(row.phase_rad.filter(|rad| rad.is_finite())?));
        let phases = uavs.map(|row| Some((row.uav, phase(row)?)));
        let Some(phases) = phases.collect::<Option<Vec<_>>>() else { continue };
        if let [(a, first), (b, second)] = phases[..] {
            found.push((group, (2, a, Some(b)), (first - second).abs_rad()));
        } else if phases.len() > 2 {
            let count = phases.len();
            found.extend(phase_gaps_rad(phases).into_iter().map(|(uav, gap_rad)| (group, (count, uav, None), gap_rad)));
        }
    }
    found
}

/// Full turn of `count` UAVs, rad: of more than three, only the doubled phases matter.
fn full_turn_rad(count: usize) -> f64 {
    if count > 3 { 0.5 * TAU } else { TAU }
}

/// Phase differences of three or more UAVs, each to the next one anticlockwise, rad, by ascending phase.
pub(crate) fn phase_gaps_rad(mut phases: Vec<(u32, Angle)>) -> Vec<(u32, f64)> {
    let full_turn_rad = full_turn_rad(phases.len());
    let wrapped_rad = |phase: Angle| phase.rad().rem_euclid(full_turn_rad);
    phases.sort_by(|a, b| wrapped_rad(a.1).total_cmp(&wrapped_rad(b.1)).then(a.0.cmp(&b.0)));
    let next_rad = phases.iter().skip(1).map(|next| wrapped_rad(next.1));
    let next_rad = next_rad.chain(phases.first().map(|first| wrapped_rad(first.1) + full_turn_rad));
    phases.iter().zip(next_rad).map(|(&(uav, phase), next_rad)| (uav, next_rad - wrapped_rad(phase))).collect()
}

/// Desired phase difference of `count` UAVs, rad: `pair_rad` for two UAVs, even spacing for more.
#[must_use]
pub fn desired_pair_phase_rad(count: usize, pair_rad: f64) -> f64 {
    if count == 2 { pair_rad } else { full_turn_rad(count) / count as f64 }
}

/// Largest off-boresight angles of two UAVs, computed as a batch (SIMD).
pub(crate) fn off_boresight_angles_rad(uavs: [&UavRow; 2], matching: &Matching<'_>) -> [Option<f64>; 2] {
    let boresights = math::sin_cos_batch(uavs.map(|uav| uav.boresight_rad.unwrap_or_default()));
    let largest: [_; 2] = std::array::from_fn(|i| largest_off_boresight(uavs[i], boresights[i], matching));
    let angles_rad = math::atan2_batch(largest.map(Option::unwrap_or_default));
    std::array::from_fn(|i| largest[i].map(|_| angles_rad[i]))
}

/// Finds the group member with the largest off-boresight angle from a UAV, given the sine and cosine of the boresight.
/// Returns the components of its relative position across and along the boresight, m; `None` if the UAV has no group,
/// no boresight or no member.
fn largest_off_boresight(uav: &UavRow, (sin, cos): (f64, f64), matching: &Matching<'_>) -> Option<(f64, f64)> {
    let group = uav.group.filter(|_| uav.boresight_rad.is_some())?;
    let off = |member: Position| {
        let member_rel_uav = member - at(uav);
        let (x, y) = (member_rel_uav.x_m(), member_rel_uav.y_m());
        ((cos * y - sin * x).abs(), cos * x + sin * y)
    };
    let is_larger = |a: (f64, f64), b: (f64, f64)| a.0 * b.1 > b.0 * a.1;
    // Targets in dwell to this group still count for the passing group.
    let members = matching.on_orbit(group).filter(|pair| pair.track.group == Some(group));
    members.map(|pair| off(position(pair.target))).reduce(|a, b| if is_larger(b, a) { b } else { a })
}

/// What determines whether a target is in view: the sensors, and the buildings that hide targets from them.
pub(crate) type InView<'a> = (&'a SensorParams, &'a Buildings);

/// A sensor that is pointed.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PointedSensor {
    pub(crate) uav: u32,
    pub(crate) position: Position,
    /// Altitude of the UAV, m; `None` if it is not simulated.
    altitude_m: Option<f64>,
    pub(crate) boresight: Angle,
}

impl PointedSensor {
    /// Returns whether a target is within sensing range and field of view, whether or not a building hides it.
    pub(crate) fn covers(&self, sensor: &SensorParams, target: Position) -> bool {
        sensor.in_view(self.position, self.boresight, target)
    }

    /// Returns the noise-free measurement of a target in view: covered, and not hidden by a building.
    pub(crate) fn measure(&self, (sensor, buildings): InView<'_>, target: Position) -> Option<RangeBearingMeasurement> {
        let measurement = sensor.measure(self.position, self.boresight, target)?;
        (!self.is_blocked(buildings, target)).then_some(measurement)
    }

    /// Returns whether a building hides a target.
    fn is_blocked(&self, buildings: &Buildings, target: Position) -> bool {
        buildings.hide(target, self.position, self.altitude_m)
    }
}

/// The sensors that are pointed; the memory is reused.
#[derive(Debug, Clone, Default)]
pub(crate) struct PointedSensors {
    /// By ascending UAV.
    pub(crate) all: Vec<PointedSensor>,
    places: Grid,
    range_m: f64,
}

impl PointedSensors {
    /// Returns the pointed sensors of a frame.
    pub(crate) fn of(frame: &Frame, sensor: &SensorParams) -> Self {
        let mut pointed = Self::default();
        pointed.fill(frame, sensor);
        pointed
    }

    /// Replaces the sensors by those of a frame.
    fn fill(&mut self, frame: &Frame, sensor: &SensorParams) {
        self.all.clear();
        self.all.extend(frame.uavs.iter().filter_map(|uav| {
            let boresight = Angle::from_rad(uav.boresight_rad?);
            Some(PointedSensor { uav: uav.uav, position: at(uav), altitude_m: uav.altitude_m, boresight })
        }));
        self.range_m = sensor.sensing_range_m;
        self.places.fill(self.all.iter().map(|sensor| sensor.position), 0.5 * self.range_m);
    }

    /// Sensors near a target, others cannot have it in view; in no particular order.
    fn near(&self, target: Position) -> impl Iterator<Item = &PointedSensor> {
        self.places.near(target, self.range_m).map(|index| &self.all[index])
    }

    /// Returns whether a target is in view of one of the sensors.
    pub(crate) fn have_in_view(&self, rules: InView<'_>, target: Position) -> bool {
        self.near(target).any(|sensor| sensor.measure(rules, target).is_some())
    }
}

/// The pointed sensors of a frame and, if needed, the targets that each of them covers; the memory is reused.
#[derive(Debug, Clone, Default)]
pub(crate) struct Coverage {
    sensors: PointedSensors,
    near: Vec<usize>,
    /// Index of a target and of a sensor near it.
    candidates: Vec<(usize, usize)>,
    /// Target and index of a sensor that covers it, behind a building or not; by ascending target. `None` if not needed.
    covered: Option<Vec<(u32, usize)>>,
}

impl Coverage {
    /// Makes an empty coverage, with the targets of each sensor or without.
    pub(crate) fn new(is_of_each_sensor: bool) -> Self {
        Self { covered: is_of_each_sensor.then(Vec::new), ..Self::default() }
    }

    /// Replaces the sensors and targets by those of a frame.
    pub(crate) fn fill(&mut self, frame: &Frame, sensor: &SensorParams) {
        let Self { sensors, near, candidates, covered } = self;
        sensors.fill(frame, sensor);
        let Some(covered) = covered else { return };
        candidates.clear();
        for (index, truth) in frame.truth.iter().enumerate() {
            let all = sensors.places.near_ascending(position(truth), sensors.range_m, near);
            candidates.extend(all.map(|sensor| (index, sensor)));
        }
        covered.clear();
        // Candidates are processed in pairs (SIMD). A single last one is paired with itself.
        for pair in candidates.chunks(2) {
            let looks = [pair[0], pair[pair.len() - 1]].map(|(target, index)| {
                let PointedSensor { position: from, boresight, .. } = sensors.all[index];
                (from, boresight, position(&frame.truth[target]))
            });
            let is_covered = pair.iter().zip(sensor.in_view_batch(looks)).filter(|(_, is_in_view)| *is_in_view);
            covered.extend(is_covered.map(|((target, index), _)| (frame.truth[*target].target, *index)));
        }
    }

    /// True if no sensor is pointed.
    pub(crate) fn is_blind(&self) -> bool {
        self.sensors.all.is_empty()
    }

    /// Returns the sensors that cover a target, by ascending UAV; none if they are not needed.
    pub(crate) fn of(&self, target: u32) -> impl Iterator<Item = &PointedSensor> {
        let covered = self.covered.as_deref().unwrap_or_default();
        let first = covered.partition_point(|(covered, _)| *covered < target);
        let covering = covered[first..].iter().take_while(move |(covered, _)| *covered == target);
        covering.map(|(_, index)| &self.sensors.all[*index])
    }

    /// Returns whether a target is in view of one of the sensors.
    pub(crate) fn is_in_view(&self, rules: InView<'_>, target: &TruthRow) -> bool {
        match self.covered {
            Some(_) => self.of(target.target).any(|sensor| !sensor.is_blocked(rules.1, position(target))),
            None => self.sensors.have_in_view(rules, position(target)),
        }
    }

    /// Returns whether one of the sensors covers a position.
    pub(crate) fn includes(&self, sensor: &SensorParams, at: Position) -> bool {
        self.sensors.near(at).any(|pointed| pointed.covers(sensor, at))
    }
}

pub(crate) fn at(uav: &UavRow) -> Position {
    Position::from_m(uav.x_m, uav.y_m)
}

pub(crate) fn centre(group: &GroupRow) -> Position {
    Position::from_m(group.x_m, group.y_m)
}

/// True centre of an orbit about targets; `None` without targets.
pub(crate) fn true_centre(
    rule: CentreEstimate,
    targets: impl ExactSizeIterator<Item = Position> + Clone,
) -> Option<Position> {
    match rule {
        CentreEstimate::Filtered => centroid(targets),
        CentreEstimate::EnclosingCircle => EnclosingCircle::of(targets).map(|circle| circle.centre),
    }
}

fn centroid(positions: impl ExactSizeIterator<Item = Position>) -> Option<Position> {
    let n = positions.len();
    let sum = positions.fold((0.0, 0.0), |(x, y), p| (x + p.x_m(), y + p.y_m()));
    (n > 0).then(|| Position::from_m(sum.0 / n as f64, sum.1 / n as f64))
}

/// Returns whether the target of a track is on the orbit of a group, those in dwell from and to it included.
pub(crate) fn is_on_orbit(track: &TrackRow, group: u32) -> bool {
    [track.group, track.receiving_group].contains(&Some(group))
}

/// True states of the existing targets on the orbit of a group.
pub(crate) fn on_orbit(matching: &Matching<'_>, group: u32) -> impl Iterator<Item = TargetState> {
    matching.on_orbit(group).map(|Matched { target, .. }| {
        TargetState::new(position(target), Velocity::from_m_s(target.vx_m_s, target.vy_m_s), [0.0; 2])
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::{config_of, score, score_config};
    use crate::missions::{frames, load};
    use crate::row_fixtures::{truth_row, uav_row};
    use standoff_sim::random::{Draws, Stream};

    /// During the dwell of a handoff, the target counts for both centres, but for the off-boresight angle of the
    /// passing group only.
    #[test]
    fn a_target_in_dwell_counts_for_both_orbits_and_one_boresight() {
        let frames = frames(&load("tour/05-a-handoff", &[], 1));
        let has_dwell =
            |frame: &&Frame| frame.tracks.iter().any(|track| track.group.and(track.receiving_group).is_some());
        let frame = frames.iter().find(has_dwell).unwrap();
        let track = frame.tracks.iter().find(|track| track.group.and(track.receiving_group).is_some()).unwrap();
        let target_position = position(Geometry::of(frame).matching.target_of(track).unwrap());
        let geometry = Geometry::of(frame);
        let positions_of =
            |group: u32| on_orbit(&geometry.matching, group).map(|one| one.position()).collect::<Vec<_>>();
        assert!(
            [track.group, track.receiving_group].iter().all(|id| positions_of(id.unwrap()).contains(&target_position))
        );
        for group in &frame.groups {
            let positions = positions_of(group.group);
            let mean_m = |of: fn(&Position) -> f64| positions.iter().map(of).sum::<f64>() / positions.len() as f64;
            let off = Position::from_m(mean_m(|at| at.x_m()), mean_m(|at| at.y_m())) - centre(group);
            let mean = true_centre(CentreEstimate::Filtered, positions.iter().copied());
            assert!((geometry.centre_error_m(group, mean).unwrap() - off.length_m()).abs() < 1e-9);
        }
        let receiving = |uav: &&UavRow| uav.group == track.receiving_group;
        let uav = frame.uavs.iter().find(receiving).unwrap();
        let mut without = frame.clone();
        without.truth.retain(|truth| truth.target != track.target);
        assert_eq!(geometry.off_boresight_rad(uav), Geometry::of(&without).off_boresight_rad(uav));
    }

    /// Of one UAV, of two, and of 40, which are found by the grid.
    #[test]
    fn coverage_of_each_sensor_equals_separate_looks() {
        let config = score_config();
        let mut draw = Draws::new(1).at(Stream::Measurement, 0, 0);
        let (mut coverage, mut in_view) = (Coverage::new(true), 0);
        for uavs in [1, 2, 3, 40] {
            let mut place_m = |span_m: f64| span_m * (draw.uniform() - 0.5);
            let frame = Frame {
                uavs: (0..uavs)
                    .map(|uav| UavRow {
                        x_m: place_m(4000.0),
                        y_m: place_m(4000.0),
                        boresight_rad: (uav % 5 != 4).then(|| place_m(TAU)),
                        ..uav_row(uav)
                    })
                    .collect(),
                truth: (0..101).map(|target| truth_row(3 * target, place_m(4000.0), place_m(4000.0))).collect(),
                ..Frame::default()
            };
            coverage.fill(&frame, &config.sensor);
            for target in &frame.truth {
                let covers = |sensor: &&PointedSensor| sensor.covers(&config.sensor, position(target));
                let separate = coverage.sensors.all.iter().filter(covers).map(|sensor| sensor.uav);
                assert!(coverage.of(target.target).map(|sensor| sensor.uav).eq(separate), "{uavs} UAVs");
                let is_in_view = coverage.sensors.have_in_view(config.in_view(), position(target));
                assert_eq!(coverage.is_in_view(config.in_view(), target), is_in_view);
                assert_eq!(coverage.includes(&config.sensor, position(target)), is_in_view);
                in_view += u32::from(is_in_view);
            }
        }
        assert!((50..350).contains(&in_view), "{in_view}");
    }

    /// The estimated centre is that of all members: an error with respect to some of them would be meaningless.
    /// Off-boresight angles use the members that exist, and are `None` if none exists.
    #[test]
    fn a_group_with_a_missing_member_has_no_centre_error() {
        let mut frame = frames(&load("paper/table-2-pair", &[], 1)).swap_remove(100);
        let (uav, group) = (frame.uavs[0], frame.groups[0]);
        let estimated = Some(centre(&group));
        assert_eq!(Geometry::of(&frame).centre_error_m(&group, estimated), Some(0.0));
        let (gone, track) = (frame.truth.remove(0).target, frame.tracks[0]);
        assert_eq!(gone, track.target);
        let geometry = Geometry::of(&frame);
        assert_eq!((geometry.centre_error_m(&group, estimated), geometry.position_error_m(&track)), (None, None));
        assert!(geometry.off_boresight_rad(&uav).is_some() && geometry.position_error_m(&frame.tracks[1]).is_some());
        frame.truth.clear();
        assert_eq!(Geometry::of(&frame).off_boresight_rad(&uav), None);
    }

    /// The values of single frames are the terms of the metrics, to the bit.
    #[test]
    fn the_values_of_frames_give_the_metrics() {
        let scenario = load("paper/figure-9", &[], 1);
        let frames = frames(&scenario);
        let (mut widest_deg, mut tracking_m, mut n) = (0.0f64, 0.0, 0.0);
        for frame in &frames {
            let geometry = Geometry::of(frame);
            for group in &frame.groups {
                for uav in frame.uavs.iter().filter(|uav| uav.group == Some(group.group)) {
                    assert_eq!(group_of(frame, uav), Some(group));
                    widest_deg = widest_deg.max(geometry.off_boresight_rad(uav).map_or(0.0, f64::to_degrees));
                    (tracking_m, n) = (tracking_m + own_estimate_error_m(uav, group).abs(), n + 1.0);
                }
            }
        }
        let metrics = score(&config_of(&scenario.settings), &frames);
        assert_eq!(metrics["off_boresight_max_deg"], Some(widest_deg));
        assert_eq!(metrics["standoff_error_own_estimate_m"], Some(tracking_m / n));
    }

    #[test]
    fn angle_differences_wrap_across_west() {
        let mut frame = frames(&load("paper/table-2-pair", &[], 1)).swap_remove(100);
        (frame.uavs[0].phase_rad, frame.uavs[1].phase_rad) = (Some(3.0), Some(-3.0));
        assert!((phase_differences(&frame)[0].2 - (TAU - 6.0)).abs() < 1e-9);
        let truth = TruthRow { x_m: 0.0, y_m: -1.0, ..frame.truth[0] };
        (frame.truth, frame.tracks) = (vec![truth], vec![frame.tracks[0]]);
        let uav = UavRow { x_m: 10.0, y_m: 0.0, boresight_rad: Some(3.0), ..frame.uavs[0] };
        let off_rad = Geometry::of(&frame).off_boresight_rad(&uav).unwrap();
        assert!((off_rad - (TAU - 6.0) / 2.0 - math::atan2(1.0, 10.0)).abs() < 1e-9);
    }

    #[test]
    fn phase_differences_of_three_uavs_sum_to_a_full_turn() {
        let mut frame = frames(&load("paper/table-2-pair", &[], 1)).swap_remove(100);
        frame.uavs.push(UavRow { uav: 2, ..frame.uavs[0] });
        frame.uavs.iter_mut().for_each(|row| row.phase_rad = Some(f64::from(row.uav) * 3.0));
        let gaps = phase_differences(&frame);
        assert!(gaps.len() == 3 && (gaps.iter().map(|gap| gap.2).sum::<f64>() - TAU).abs() < 1e-9);
        // Four UAVs whose doubled phases are evenly spaced, the second on the opposite side.
        let mut four = frame.clone();
        four.uavs.push(UavRow { uav: 3, ..frame.uavs[0] });
        for (row, phase_deg) in four.uavs.iter_mut().zip([-170.0f64, 55.0, -80.0, -35.0]) {
            row.phase_rad = Some(phase_deg.to_radians());
        }
        let gaps = phase_differences(&four);
        let desired_rad = desired_pair_phase_rad(4, 0.0);
        assert!(gaps.len() == 4 && gaps.iter().all(|gap| (gap.2 - desired_rad).abs() < 1e-9), "{gaps:?}");
        frame.uavs[2].phase_rad = None;
        assert!(phase_differences(&frame).is_empty());
    }
}
