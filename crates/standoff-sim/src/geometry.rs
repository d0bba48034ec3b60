//! What an instant comes to by geometry: the one place of whatever scores, figures, pages and records derive from its rows.

use std::collections::BTreeSet;

use standoff::math::{self, TAU};
use standoff::{Angle, CentreEstimate, Position, SensorParams, SmallestCircle, TargetState, Velocity};

use crate::frame::{Frame, GroupRow, TrackRow, TruthRow, UavRow};

/// An instant and who in it is known and exists.
#[derive(Debug)]
pub struct Geometry<'a> {
    frame: &'a Frame,
    known: Vec<Known>,
}

impl<'a> Geometry<'a> {
    /// That of a frame.
    #[must_use]
    pub fn of(frame: &'a Frame) -> Self {
        Self { frame, known: known(frame).collect() }
    }

    /// Largest angle at a UAV between its boresight and the true position of a member of its group, rad; targets in dwell
    /// are the duty of the passing group, and one that does not exist is nobody's. `None` where there is nobody, or the
    /// sensor is not pointed.
    #[must_use]
    pub fn line_of_sight_rad(&self, uav: &UavRow) -> Option<f64> {
        let [angle_rad, _] = lines_of_sight_rad([uav; 2], &self.known);
        angle_rad
    }

    /// Distance from a group's estimated centre to the true one of the targets on its orbit, those in dwell included, m.
    /// `None` where one of them does not exist: the estimate is of all of them.
    pub(crate) fn centre_error_m(&self, group: &GroupRow, true_centre: Option<Position>) -> Option<f64> {
        let is_on = |track: &&TrackRow| [track.group, track.to_group].contains(&Some(group.group));
        let is_whole = on_orbit(&self.known, group.group).count() == self.frame.tracks.iter().filter(is_on).count();
        Some(true_centre.filter(|_| is_whole)?.distance_m(centre(group)))
    }

    /// Distance of a target's estimated from its true position, m; `None` of one that does not exist.
    #[must_use]
    pub fn position_error_m(&self, track: &TrackRow) -> Option<f64> {
        truth_of(self.frame, track.target).map(|truth| position_error_m(track, truth))
    }

    /// The known targets that exist.
    pub(crate) fn known(&self) -> &[Known] {
        &self.known
    }
}

/// r - r_d of a UAV by the agents' own view of its group, m; positive outside the orbit.
#[must_use]
pub fn tracking_error_m(uav: &UavRow, group: &GroupRow) -> f64 {
    off_orbit_m(at(uav), centre(group), group.standoff_distance_m)
}

/// How far a UAV is off an orbit, m; positive outside, negative inside.
pub(crate) fn off_orbit_m(uav: Position, centre: Position, radius_m: f64) -> f64 {
    uav.distance_m(centre) - radius_m
}

/// The group that a UAV serves.
#[must_use]
pub fn group_of<'a>(frame: &'a Frame, uav: &UavRow) -> Option<&'a GroupRow> {
    frame.groups.iter().find(|group| Some(group.group) == uav.group)
}

/// What a phase separation lies between: how many UAVs are on the orbit, the UAV, and the other of a
/// pair; of more UAVs it is the next one anticlockwise.
pub type Between = (usize, u32, Option<u32>);

/// The phase separations of each group in a frame, rad; none where a phase is unknown, for neither the
/// neighbours nor their number would be right.
#[must_use]
pub fn separations(frame: &Frame) -> Vec<(u32, Between, f64)> {
    let mut found = Vec::new();
    let groups: BTreeSet<u32> = frame.uavs.iter().filter_map(|row| row.group).collect();
    for group in groups {
        let uavs = frame.uavs.iter().filter(|row| row.group == Some(group));
        let phase = |row: &UavRow| Some(Angle::from_rad(row.phase_rad.filter(|rad| rad.is_finite())?));
        let phases = uavs.map(|row| Some((row.uav, phase(row)?)));
        let Some(mut phases) = phases.collect::<Option<Vec<_>>>() else { continue };
        if let [(a, first), (b, second)] = phases[..] {
            found.push((group, (2, a, Some(b)), (first - second).abs_rad()));
        } else if phases.len() > 2 {
            phases.sort_by(|a, b| a.1.rad().total_cmp(&b.1.rad()).then(a.0.cmp(&b.0)));
            let next = phases.iter().skip(1).map(|next| next.1.rad());
            let gaps = phases.iter().zip(next.chain([phases[0].1.rad() + TAU]));
            found.extend(gaps.map(|(&(uav, phase), next)| (group, (phases.len(), uav, None), next - phase.rad())));
        }
    }
    found
}

/// What the phase separations of so many UAVs should be, rad: a pair's is given, more are evenly spaced.
#[must_use]
pub fn wanted_separation_rad(count: usize, pair_rad: f64) -> f64 {
    if count == 2 { pair_rad } else { TAU / count as f64 }
}

/// The lines of sight of two UAVs, which are worked on side by side (SIMD).
pub(crate) fn lines_of_sight_rad(uavs: [&UavRow; 2], known: &[Known]) -> [Option<f64>; 2] {
    let boresights = math::sin_cos_each(uavs.map(|uav| uav.boresight_rad.unwrap_or_default()));
    let largest: [_; 2] = std::array::from_fn(|i| furthest_off(uavs[i], boresights[i], known));
    let angles_rad = math::atan2_each(largest.map(Option::unwrap_or_default));
    std::array::from_fn(|i| largest[i].map(|_| angles_rad[i]))
}

/// The member of the UAV's group furthest off its boresight, of which there are the sine and cosine: how far it is
/// across it and along it, m. `None` where nothing is to be judged.
fn furthest_off(uav: &UavRow, (sin, cos): (f64, f64), known: &[Known]) -> Option<(f64, f64)> {
    let group = uav.group.filter(|_| uav.boresight_rad.is_some())?;
    let off = |member: Position| {
        let member_rel_uav = member - at(uav);
        let (x, y) = (member_rel_uav.x_m(), member_rel_uav.y_m());
        ((cos * y - sin * x).abs(), cos * x + sin * y)
    };
    let is_larger = |a: (f64, f64), b: (f64, f64)| a.0 * b.1 > b.0 * a.1;
    // Those in dwell to it are not its duty yet.
    let in_duty = known.iter().filter(|known| known.group == Some(group));
    in_duty.map(|known| off(known.position)).reduce(|a, b| if is_larger(b, a) { b } else { a })
}

/// The UAVs whose sensors are pointed: which, where they are, and whither they look.
pub(crate) fn looking(frame: &Frame) -> Vec<(u32, Position, Angle)> {
    let pointed = |uav: &UavRow| Some((uav.uav, at(uav), Angle::from_rad(uav.boresight_rad?)));
    frame.uavs.iter().filter_map(pointed).collect()
}

/// One of them has a target in view.
pub(crate) fn is_seen(sensor: &SensorParams, looking: &[(u32, Position, Angle)], target: Position) -> bool {
    looking.iter().any(|(_, uav, boresight)| sensor.in_view(*uav, *boresight, target))
}

pub(crate) fn at(uav: &UavRow) -> Position {
    Position::from_m(uav.x_m, uav.y_m)
}

pub(crate) fn position(truth: &TruthRow) -> Position {
    Position::from_m(truth.x_m, truth.y_m)
}

pub(crate) fn centre(group: &GroupRow) -> Position {
    Position::from_m(group.x_m, group.y_m)
}

pub(crate) fn position_error_m(track: &TrackRow, truth: &TruthRow) -> f64 {
    Position::from_m(track.state[0], track.state[3]).distance_m(position(truth))
}

/// Where the centre of an orbit about targets should be; `None` for no targets.
pub(crate) fn true_centre(
    rule: CentreEstimate,
    targets: impl ExactSizeIterator<Item = Position> + Clone,
) -> Option<Position> {
    match rule {
        CentreEstimate::Filtered | CentreEstimate::Centroid => centroid(targets),
        CentreEstimate::SmallestCircle => SmallestCircle::of(targets).map(|circle| circle.centre),
    }
}

fn centroid(positions: impl ExactSizeIterator<Item = Position>) -> Option<Position> {
    let n = positions.len();
    let sum = positions.fold((0.0, 0.0), |(x, y), p| (x + p.x_m(), y + p.y_m()));
    (n > 0).then(|| Position::from_m(sum.0 / n as f64, sum.1 / n as f64))
}

/// A known target that exists: where it really is, and the groups of its track.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Known {
    position: Position,
    velocity: Velocity,
    group: Option<u32>,
    to_group: Option<u32>,
}

impl Known {
    pub(crate) fn of(track: &TrackRow, truth: &TruthRow) -> Self {
        let velocity = Velocity::from_m_s(truth.vx_m_s, truth.vy_m_s);
        Self { position: position(truth), velocity, group: track.group, to_group: track.to_group }
    }
}

/// The tracks of targets that exist, and the truth about them. Both come in the order of targets: walked side by side.
pub(crate) fn existing(frame: &Frame) -> impl Iterator<Item = (&TrackRow, &TruthRow)> {
    let mut next = 0;
    frame.tracks.iter().filter_map(move |track| {
        while frame.truth.get(next).is_some_and(|truth| truth.target < track.target) {
            next += 1;
        }
        frame.truth.get(next).filter(|truth| truth.target == track.target).map(|truth| (track, truth))
    })
}

/// The known targets that exist.
pub(crate) fn known(frame: &Frame) -> impl Iterator<Item = Known> {
    existing(frame).map(|(track, truth)| Known::of(track, truth))
}

/// Where the existing targets are, and how they move, that a group's orbit goes about, those in dwell from and to it
/// included.
pub(crate) fn on_orbit(known: &[Known], group: u32) -> impl Iterator<Item = TargetState> {
    let on = known.iter().filter(move |known| [known.group, known.to_group].contains(&Some(group)));
    on.map(|known| TargetState::new(known.position, known.velocity, [0.0; 2]))
}

pub(crate) fn truth_of(frame: &Frame, target: u32) -> Option<&TruthRow> {
    let index = frame.truth.binary_search_by_key(&target, |truth| truth.target).ok()?;
    Some(&frame.truth[index])
}

pub(crate) fn track_of(frame: &Frame, target: u32) -> Option<&TrackRow> {
    let index = frame.tracks.binary_search_by_key(&target, |track| track.target).ok()?;
    Some(&frame.tracks[index])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::Mission;
    use crate::scenario::{Edits, Scenario};
    use crate::score::{Choice, Rules, Scorer};

    fn flown(name: &str) -> (Scenario, Vec<Frame>) {
        let scenario = Scenario::load(name, &Edits::default(), 1).unwrap();
        let mut mission = Mission::new(&scenario).unwrap();
        let frames = std::iter::from_fn(|| mission.frame().cloned()).collect();
        (scenario, frames)
    }

    /// In the dwell of a handoff the target moves both centres, and is the passing group's to see.
    #[test]
    fn a_target_in_dwell_is_on_both_orbits_and_one_group_s_to_see() {
        let (_, frames) = flown("tour/05-a-handoff");
        let has_dwell = |frame: &&Frame| frame.tracks.iter().any(|track| track.group.and(track.to_group).is_some());
        let frame = frames.iter().find(has_dwell).unwrap();
        let track = frame.tracks.iter().find(|track| track.group.and(track.to_group).is_some()).unwrap();
        let place = position(truth_of(frame, track.target).unwrap());
        let geometry = Geometry::of(frame);
        let places = |group: u32| on_orbit(&geometry.known, group).map(|one| one.position()).collect::<Vec<_>>();
        assert!([track.group, track.to_group].iter().all(|id| places(id.unwrap()).contains(&place)));
        for group in &frame.groups {
            let places = places(group.group);
            let mean_m = |of: fn(&Position) -> f64| places.iter().map(of).sum::<f64>() / places.len() as f64;
            let off = Position::from_m(mean_m(|at| at.x_m()), mean_m(|at| at.y_m())) - centre(group);
            let mean = true_centre(CentreEstimate::Centroid, places.iter().copied());
            assert!((geometry.centre_error_m(group, mean).unwrap() - off.length_m()).abs() < 1e-9);
        }
        let receiving = |uav: &&UavRow| uav.group == track.to_group;
        let uav = frame.uavs.iter().find(receiving).unwrap();
        let mut without = frame.clone();
        without.truth.retain(|truth| truth.target != track.target);
        assert_eq!(geometry.line_of_sight_rad(uav), Geometry::of(&without).line_of_sight_rad(uav));
    }

    /// The estimated centre is of all: against fewer of them its error would be none. The UAVs are judged by those that
    /// exist, and by nothing if nobody does.
    #[test]
    fn where_a_member_does_not_exist_the_centre_has_no_error() {
        let (_, frames) = flown("paper/table-2-pair");
        let mut frame = frames[100].clone();
        let (uav, group) = (frame.uavs[0], frame.groups[0]);
        let there = Some(centre(&group));
        assert_eq!(Geometry::of(&frame).centre_error_m(&group, there), Some(0.0));
        let (gone, track) = (frame.truth.remove(0).target, frame.tracks[0]);
        assert_eq!(gone, track.target);
        let geometry = Geometry::of(&frame);
        assert_eq!((geometry.centre_error_m(&group, there), geometry.position_error_m(&track)), (None, None));
        assert!(geometry.line_of_sight_rad(&uav).is_some() && geometry.position_error_m(&frame.tracks[1]).is_some());
        frame.truth.clear();
        assert_eq!(Geometry::of(&frame).line_of_sight_rad(&uav), None);
    }

    /// What is told of single frames is what the metrics are made of, to the bit.
    #[test]
    fn frame_by_frame_it_comes_to_the_metrics() {
        let (scenario, frames) = flown("paper/figure-9");
        let mut scorer = Scorer::new(Rules::of(&scenario.settings), Choice::ALL);
        let (mut widest_deg, mut tracking_m, mut n) = (0.0f64, 0.0, 0.0);
        for frame in &frames {
            scorer.frame(frame);
            let geometry = Geometry::of(frame);
            for group in &frame.groups {
                for uav in frame.uavs.iter().filter(|uav| uav.group == Some(group.group)) {
                    assert_eq!(group_of(frame, uav), Some(group));
                    widest_deg = widest_deg.max(geometry.line_of_sight_rad(uav).map_or(0.0, f64::to_degrees));
                    (tracking_m, n) = (tracking_m + tracking_error_m(uav, group).abs(), n + 1.0);
                }
            }
        }
        let metrics = scorer.metrics();
        assert_eq!(metrics.line_of_sight_max_deg, Some(widest_deg));
        assert_eq!(metrics.standoff_tracking_error_m, Some(tracking_m / n));
    }

    #[test]
    fn angles_are_taken_the_short_way_across_west() {
        let (_, frames) = flown("paper/table-2-pair");
        let mut frame = frames[100].clone();
        (frame.uavs[0].phase_rad, frame.uavs[1].phase_rad) = (Some(3.0), Some(-3.0));
        assert!((separations(&frame)[0].2 - (TAU - 6.0)).abs() < 1e-9);
        let truth = TruthRow { x_m: 0.0, y_m: -1.0, ..frame.truth[0] };
        (frame.truth, frame.tracks) = (vec![truth], vec![frame.tracks[0]]);
        let uav = UavRow { x_m: 10.0, y_m: 0.0, boresight_rad: Some(3.0), ..frame.uavs[0] };
        let off_rad = Geometry::of(&frame).line_of_sight_rad(&uav).unwrap();
        assert!((off_rad - (TAU - 6.0) / 2.0 - math::atan2(1.0, 10.0)).abs() < 1e-9);
    }

    #[test]
    fn the_gaps_of_three_uavs_make_a_turn() {
        let (_, frames) = flown("paper/table-2-pair");
        let mut frame = frames[100].clone();
        frame.uavs.push(UavRow { uav: 2, ..frame.uavs[0] });
        frame.uavs.iter_mut().for_each(|row| row.phase_rad = Some(f64::from(row.uav) * 3.0));
        let gaps = separations(&frame);
        assert!(gaps.len() == 3 && (gaps.iter().map(|gap| gap.2).sum::<f64>() - TAU).abs() < 1e-9);
        frame.uavs[2].phase_rad = None;
        assert!(separations(&frame).is_empty());
    }
}
