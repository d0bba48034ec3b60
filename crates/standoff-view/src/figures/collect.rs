//! Collects the curves of the figures from the frames of a run, one frame at a time.

use super::curve::{Curve, MAX_POINTS, Point, range, usable};
use super::symbol::Mark;
use crate::colours::{GROUPS, GroupColours, UAVS};
use plotters::style::RGBColor;
use standoff::TeammateStatus;
use standoff_record::{AgentRow, EventRow, Frame};
use standoff_score::geometry::{PhasePair, group_of, own_estimate_error_m, phase_differences};
use standoff_score::{FrameScorer, FrameScores};
use std::collections::BTreeMap;
use std::ops::Range;

/// Maximum number of groups kept; the shortest-lived of the retired groups are removed first.
const MOST_GROUPS: usize = 32;
/// Maximum number of targets whose paths are kept. More paths would only cover each other.
const MOST_TARGETS: usize = 5_000;
/// Maximum number of points of all curves. Up to 200 curves have full resolution; more curves have fewer points each.
const ALL_POINTS: usize = 200 * MAX_POINTS;
/// Minimum number of points of a curve, enough to show its course.
const FEWEST_POINTS: usize = 20;
/// Number of frames after which the points are redistributed between the curves.
const SHARE_EVERY: usize = 64;
/// Maximum number of marks of one kind in a panel; further ones are thinned out.
const MOST_MARKS: usize = 60;

/// A path in pieces by colour of the group, as an index in [`GROUPS`]; `None`: in no group.
#[derive(Debug, Default)]
pub(super) struct Path {
    pub(super) pieces: BTreeMap<Option<usize>, Curve>,
    last: Option<(usize, Point, Option<usize>)>,
}

impl Path {
    fn curves(&mut self) -> impl Iterator<Item = &mut Curve> {
        self.pieces.values_mut()
    }

    fn push(&mut self, index: usize, at: Option<Point>, colour: Option<usize>) {
        let Some(at) = at else { return };
        // Pieces share their end points, so that the path has no gaps.
        if let Some((_, _, before)) = self.last.filter(|last| last.0 + 1 == index && last.2 != colour) {
            self.pieces.entry(before).or_default().push(index, at.0, at.1);
        }
        self.pieces.entry(colour).or_default().push(index, at.0, at.1);
        self.last = Some((index, at, colour));
    }
}

/// Curves of one UAV, in metres, degrees and seconds.
#[derive(Debug, Default)]
pub(super) struct Uav {
    pub(super) path: Curve,
    /// Its path by assigned group.
    pub(super) assigned: Path,
    /// Last sensor view: position, boresight (rad) and drawn range (m).
    pub(super) view: Option<(Point, f64, f64)>,
    pub(super) error: Curve,
    pub(super) off_boresight: Curve,
    pub(super) speed: Curve,
    pub(super) speed_command: Curve,
    pub(super) turn_rate: Curve,
    pub(super) turn_rate_command: Curve,
}

impl Uav {
    fn curves(&mut self) -> impl Iterator<Item = &mut Curve> {
        let Self { path, assigned, error, off_boresight, speed, speed_command, turn_rate, turn_rate_command, .. } =
            self;
        let all = [path, error, off_boresight, speed, speed_command, turn_rate, turn_rate_command];
        all.into_iter().chain(assigned.curves())
    }
}

/// Curves of the agent of one UAV, in runs with one agent per UAV.
#[derive(Debug, Default)]
pub(super) struct AgentCurves {
    /// Number of known teammates that are not live.
    pub(super) not_received: Curve,
    /// Number of agents with other assignments.
    pub(super) disagreeing: Curve,
    /// Time since the last committed time step, s.
    pub(super) uncommitted: Curve,
}

/// Curves of one group.
#[derive(Debug, Default)]
pub(super) struct Group {
    /// Index of its colour in [`GROUPS`].
    colour: usize,
    /// Number of time steps of its existence.
    pub(super) steps: usize,
    pub(super) centre: Curve,
    pub(super) standoff: Curve,
    pub(super) unclamped: Curve,
    pub(super) margin: Curve,
    pub(super) centre_error: Curve,
    pub(super) separation: Curve,
    /// Distance from the centre, by assigned UAV, m.
    pub(super) distances: BTreeMap<u32, Curve>,
    /// Phase difference between UAVs, degrees.
    pub(super) phases: BTreeMap<PhasePair, Curve>,
    /// Times of events of its targets, as a curve of the time over the running number of the event.
    marks: BTreeMap<Mark, Curve>,
}

impl Group {
    fn curves(&mut self) -> impl Iterator<Item = &mut Curve> {
        let Self { centre, standoff, unclamped, margin, centre_error, separation, distances, phases, marks, .. } = self;
        let one = [centre, standoff, unclamped, margin, centre_error, separation];
        let each = distances.values_mut().chain(phases.values_mut()).chain(marks.values_mut());
        one.into_iter().chain(each)
    }

    /// Times of the events of its targets, s, without losses, which are frequent in traffic and have little effect.
    pub(super) fn marks(&self) -> Vec<(Mark, Vec<f64>)> {
        let times = |curve: &Curve| curve.runs(MOST_MARKS).concat().iter().map(|at| at.1).collect();
        let shown = self.marks.iter().filter(|(mark, _)| **mark != Mark::Lost);
        shown.map(|(&mark, curve)| (mark, times(curve))).collect()
    }
}

/// Contents of the figures of a run.
#[derive(Debug, Default)]
pub(super) struct Run {
    pub(super) frames: usize,
    /// Earliest and latest time, s.
    times: Option<[f64; 2]>,
    pub(super) uavs: BTreeMap<u32, Uav>,
    pub(super) agents: BTreeMap<u32, AgentCurves>,
    /// Number of groups created so far.
    pub(super) created: usize,
    pub(super) groups: BTreeMap<u32, Group>,
    colours: GroupColours,
    /// True paths by target.
    pub(super) truth: BTreeMap<u32, Curve>,
    /// Estimated paths by target.
    pub(super) tracks: BTreeMap<u32, Path>,
    /// Estimated paths of targets in handoff, by target and colour of the receiving group.
    pub(super) dwells: BTreeMap<(u32, usize), Curve>,
    /// Number of marked events.
    events: usize,
    /// Positions of events of targets.
    pub(super) marks: BTreeMap<Mark, Curve>,
}

impl Run {
    /// Adds the next frame, scored by `scorer`.
    pub(super) fn add(&mut self, frame: &Frame, scorer: &mut FrameScorer) {
        let (index, time) = (self.frames, frame.time_us as f64 * 1e-6);
        self.frames += 1;
        if let Some(time) = usable(time) {
            let [first, last] = self.times.unwrap_or([time, time]);
            self.times = Some([first.min(time), last.max(time)]);
        }
        self.add_groups(frame);
        let scores = scorer.frame(frame);
        self.add_group_rows(index, time, frame, &scores);
        self.add_targets(index, frame);
        self.add_uavs(index, time, frame, &scores);
        self.add_agents(index, time, frame);
        for (group, between, angle) in phase_differences(frame) {
            if let Some(group) = self.groups.get_mut(&group) {
                group.phases.entry(between).or_default().push(index, time, angle.to_degrees());
            }
        }
        frame.events.iter().for_each(|event| self.mark_event(time, event));
        if self.frames.is_multiple_of(SHARE_EVERY) {
            self.share_points();
        }
    }

    fn add_group_rows(&mut self, index: usize, time: f64, frame: &Frame, scores: &FrameScores) {
        for row in &frame.groups {
            let Some(group) = self.groups.get_mut(&row.group) else { continue };
            group.steps += 1;
            group.centre.push(index, row.x_m, row.y_m);
            group.standoff.push(index, time, row.standoff_distance_m);
            group.unclamped.push(index, time, row.standoff_unclamped_m);
            group.margin.push(index, time, row.margin_m);
            group.centre_error.push(index, time, scores.centre_error_m(row));
            group.separation.push(index, time, row.nearest_groupmate_m);
        }
    }

    fn add_targets(&mut self, index: usize, frame: &Frame) {
        for row in &frame.truth {
            if self.truth.len() >= MOST_TARGETS && !self.truth.contains_key(&row.target) {
                continue;
            }
            self.truth.entry(row.target).or_default().push(index, row.x_m, row.y_m);
        }
        for row in &frame.tracks {
            if self.tracks.len() >= MOST_TARGETS && !self.tracks.contains_key(&row.target) {
                continue;
            }
            let (at, colour) = (place(row.state[0], row.state[3]), self.colour(row.group));
            self.tracks.entry(row.target).or_default().push(index, at, colour);
            if let Some(colour) = self.colour(row.receiving_group) {
                self.dwells.entry((row.target, colour)).or_default().push(index, row.state[0], row.state[3]);
            }
        }
    }

    fn add_uavs(&mut self, index: usize, time: f64, frame: &Frame, scores: &FrameScores) {
        for row in &frame.uavs {
            let group = group_of(frame, row);
            let colour = self.colour(row.group);
            if let Some(group) = row.group.and_then(|id| self.groups.get_mut(&id)) {
                group.distances.entry(row.uav).or_default().push(index, time, row.centre_distance_m);
            }
            let uav = self.uavs.entry(row.uav).or_default();
            uav.path.push(index, row.x_m, row.y_m);
            uav.assigned.push(index, place(row.x_m, row.y_m), colour);
            uav.view = group.and_then(|group| {
                let reach = usable(row.centre_distance_m?.abs() + group.spread_m.abs())?;
                Some((place(row.x_m, row.y_m)?, usable(row.boresight_rad?)?, reach))
            });
            uav.error.push(index, time, group.map(|group| own_estimate_error_m(row, group)));
            uav.off_boresight.push(index, time, scores.geometry.off_boresight_rad(row).map(f64::to_degrees));
            uav.speed.push(index, time, row.speed_m_s);
            uav.speed_command.push(index, time, row.speed_command_m_s);
            uav.turn_rate.push(index, time, row.turn_rate_rad_s.to_degrees());
            uav.turn_rate_command.push(index, time, row.turn_rate_command_rad_s.to_degrees());
        }
    }

    fn add_agents(&mut self, index: usize, time: f64, frame: &Frame) {
        for row in &frame.agents.all {
            let (agents, curves) = (&frame.agents, self.agents.entry(row.agent).or_default());
            let team = agents.teammates_of(row.agent).iter();
            let not_received = team.filter(|mate| mate.status.is_some_and(|status| status != TeammateStatus::Live));
            let disagrees = |other: &&AgentRow| !agents.assignments(other.agent).eq(agents.assignments(row.agent));
            curves.not_received.push(index, time, not_received.count() as f64);
            curves.disagreeing.push(index, time, agents.all.iter().filter(disagrees).count() as f64);
            curves.uncommitted.push(index, time, row.committed_us.map(|us| time - us as f64 * 1e-6));
        }
    }

    /// Limits the total number of points of all curves.
    fn share_points(&mut self) {
        let most = (ALL_POINTS / self.curves().count().max(1)).clamp(FEWEST_POINTS, MAX_POINTS);
        self.curves().for_each(|curve| curve.keep(most));
    }

    fn curves(&mut self) -> impl Iterator<Item = &mut Curve> {
        let uavs = self.uavs.values_mut().flat_map(Uav::curves);
        let groups = self.groups.values_mut().flat_map(Group::curves);
        let tracks = self.tracks.values_mut().flat_map(Path::curves);
        let others = self.truth.values_mut().chain(self.dwells.values_mut()).chain(self.marks.values_mut());
        let agents = self.agents.values_mut().flat_map(|AgentCurves { not_received, disagreeing, uncommitted }| {
            [not_received, disagreeing, uncommitted]
        });
        uavs.chain(groups).chain(tracks).chain(others).chain(agents)
    }

    /// Adds new groups.
    fn add_groups(&mut self, frame: &Frame) {
        self.colours.next_step(&frame.groups);
        let alive = |id: &u32| frame.groups.iter().any(|row| row.group == *id);
        for id in frame.groups.iter().map(|row| row.group) {
            if self.groups.contains_key(&id) {
                continue;
            }
            let colour = self.colours.place(id).unwrap_or(0);
            self.groups.insert(id, Group { colour, ..Group::default() });
            self.created += 1;
        }
        while self.groups.len() > MOST_GROUPS {
            let retired = self.groups.iter().filter(|group| !alive(group.0));
            let Some((&id, _)) = retired.min_by_key(|group| group.1.steps) else { return };
            self.groups.remove(&id);
        }
    }

    /// Marks position and time of an event.
    fn mark_event(&mut self, time: f64, event: &EventRow) {
        let Some(mark) = Mark::of(&event.kind) else { return };
        self.events += 1;
        let last = event.target.and_then(|target| self.tracks.get(&target)?.last);
        if let Some((_, (x, y), _)) = last {
            self.marks.entry(mark).or_default().push(self.events, x, y);
        }
        for id in [event.group, event.to_group].into_iter().flatten() {
            if let Some(group) = self.groups.get_mut(&id) {
                group.marks.entry(mark).or_default().push(self.events, self.events as f64, time);
            }
        }
    }

    /// Time range of the run, s.
    pub(super) fn time(&self) -> Range<f64> {
        range(self.times.into_iter().flatten(), 1.0, 0.0)
    }

    /// One curve of each UAV.
    pub(super) fn each(&self, of: fn(&Uav) -> &Curve) -> impl Iterator<Item = (u32, &Curve)> {
        self.uavs.iter().map(move |(&id, uav)| (id, of(uav)))
    }

    /// Title of a vertical axis for a quantity of one group; names the group unless it is the only one.
    pub(super) fn axis(&self, what: &str, group: u32, unit: &str) -> String {
        if self.created > 1 { format!("{what}, group {group} ({unit})") } else { format!("{what} ({unit})") }
    }

    /// Colour of a UAV, the same in every figure.
    pub(super) fn uav_colour(&self, id: u32) -> RGBColor {
        UAVS[self.uavs.range(..id).count() % UAVS.len()]
    }

    /// Colour of a group, the same in every figure.
    pub(super) fn group_colour(&self, id: u32) -> RGBColor {
        GROUPS[self.groups.get(&id).map_or(0, |group| group.colour)]
    }

    fn colour(&self, group: Option<u32>) -> Option<usize> {
        Some(self.groups.get(&group?)?.colour)
    }
}

/// Returns a position if it can be drawn.
fn place(x_m: f64, y_m: f64) -> Option<Point> {
    usable(x_m).zip(usable(y_m))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::row_fixtures::truth_row;
    use crate::score_fixtures::score_config;

    /// Number of points kept for `targets` targets that move for `steps` time steps.
    fn kept(targets: u32, steps: u32) -> usize {
        let (mut run, mut scorer) = (Run::default(), FrameScorer::new(score_config()));
        for step in 0..steps {
            let at = f64::from(step);
            let truth = (0..targets).map(|target| truth_row(target, at, at)).collect();
            run.add(&Frame { time_us: i64::from(step) * 500_000, truth, ..Frame::default() }, &mut scorer);
        }
        run.curves().map(|curve| curve.runs(usize::MAX).concat().len()).sum()
    }

    #[test]
    fn many_targets_have_fewer_points_each() {
        assert_eq!(kept(10, 3_000), 30_000, "all points of a few targets are kept");
        let all = kept(500, 2_500);
        assert!((ALL_POINTS / 2..=2 * ALL_POINTS).contains(&all), "{all}");
        assert_eq!(kept(6_000, 128), MOST_TARGETS * 128, "only the first targets have points");
    }
}
