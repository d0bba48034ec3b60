//! What the figures show of a run, gathered from its frames one at a time.

use super::curve::{Curve, MOST_POINTS, Point, range, usable};
use super::symbol::Mark;
use crate::colours::{GROUPS, GroupColours, UAVS};
use plotters::style::RGBColor;
use standoff::Presence;
use standoff_sim::geometry::{Between, group_of, separations, tracking_error_m};
use standoff_sim::record::{AgentRow, EventRow, Frame};
use standoff_sim::score::Judge;
use std::collections::BTreeMap;
use std::ops::Range;

/// Most groups kept: of those dissolved, the shortest-lived go first.
const MOST_GROUPS: usize = 32;
/// Most targets whose paths are kept: as many as a scenario or traffic may have at one time.
const MOST_TARGETS: usize = 5_000;
/// Points of all curves together: of 200 curves, each keeps as many as it would alone; of more, fewer.
const ALL_POINTS: usize = 200 * MOST_POINTS;
/// Fewest points of a curve: what shows which way it went.
const FEWEST_POINTS: usize = 20;
/// After so many frames the points are shared out anew.
const SHARE_EVERY: usize = 64;
/// Most marks of one kind in a panel; of more, some are left out.
const MOST_MARKS: usize = 60;

/// A path in pieces, by the place of the group's colour among all; `None`: in no group.
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
        // A piece ends where the next one begins.
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
    /// Its path by the group it serves.
    pub(super) served: Path,
    /// What it sees at last: where from, in which direction (rad) and how far (m).
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
        let Self { path, served, error, off_boresight, speed, speed_command, turn_rate, turn_rate_command, .. } = self;
        let all = [path, error, off_boresight, speed, speed_command, turn_rate, turn_rate_command];
        all.into_iter().chain(served.curves())
    }
}

/// Curves of one of several minds.
#[derive(Debug, Default)]
pub(super) struct Mind {
    /// UAVs that it knows of and does not hear.
    pub(super) unheard: Curve,
    /// Minds that believe in another crew.
    pub(super) contradicting: Curve,
    /// How far back what it believes may still change, s.
    pub(super) open: Curve,
}

/// Curves of one group.
#[derive(Debug, Default)]
pub(super) struct Group {
    /// Place of its colour among all.
    colour: usize,
    /// Instants it lived.
    pub(super) instants: usize,
    pub(super) centre: Curve,
    pub(super) standoff: Curve,
    pub(super) unclamped: Curve,
    pub(super) margin: Curve,
    pub(super) centre_error: Curve,
    pub(super) separation: Curve,
    /// Distance from the centre, by UAV that serves it.
    pub(super) distances: BTreeMap<u32, Curve>,
    /// Phase separations in degrees.
    pub(super) phases: BTreeMap<Between, Curve>,
    /// When something happened to a target of it: time over the count of events.
    marks: BTreeMap<Mark, Curve>,
}

impl Group {
    fn curves(&mut self) -> impl Iterator<Item = &mut Curve> {
        let Self { centre, standoff, unclamped, margin, centre_error, separation, distances, phases, marks, .. } = self;
        let one = [centre, standoff, unclamped, margin, centre_error, separation];
        let each = distances.values_mut().chain(phases.values_mut()).chain(marks.values_mut());
        one.into_iter().chain(each)
    }

    /// What happened to its targets when, s, but for losses: in traffic they are many and change little.
    pub(super) fn marks(&self) -> Vec<(Mark, Vec<f64>)> {
        let times = |curve: &Curve| curve.runs(MOST_MARKS).concat().iter().map(|at| at.1).collect();
        let shown = self.marks.iter().filter(|(mark, _)| **mark != Mark::Lost);
        shown.map(|(&mark, curve)| (mark, times(curve))).collect()
    }
}

/// A run as far as the figures show it.
#[derive(Debug, Default)]
pub(super) struct Run {
    pub(super) frames: usize,
    /// Earliest and latest instant, s.
    times: Option<[f64; 2]>,
    pub(super) uavs: BTreeMap<u32, Uav>,
    pub(super) minds: BTreeMap<u32, Mind>,
    /// Groups ever founded.
    pub(super) founded: usize,
    pub(super) groups: BTreeMap<u32, Group>,
    colours: GroupColours,
    /// True paths by target.
    pub(super) truth: BTreeMap<u32, Curve>,
    /// Estimated paths by target.
    pub(super) tracks: BTreeMap<u32, Path>,
    /// Estimated paths in dwell, by target and colour of the receiving group.
    pub(super) dwells: BTreeMap<(u32, usize), Curve>,
    /// Events marked.
    events: usize,
    /// Where something happened to targets.
    pub(super) marks: BTreeMap<Mark, Curve>,
}

impl Run {
    /// Takes in the next frame, judged by this.
    pub(super) fn add(&mut self, frame: &Frame, judge: &mut Judge) {
        let (index, time) = (self.frames, frame.time_us as f64 * 1e-6);
        self.frames += 1;
        if let Some(time) = usable(time) {
            let [first, last] = self.times.unwrap_or([time, time]);
            self.times = Some([first.min(time), last.max(time)]);
        }
        self.found(frame);
        let judged = judge.frame(frame);
        let geometry = &judged.geometry;
        for row in &frame.groups {
            let Some(group) = self.groups.get_mut(&row.group) else { continue };
            group.instants += 1;
            group.centre.push(index, row.x_m, row.y_m);
            group.standoff.push(index, time, row.standoff_distance_m);
            group.unclamped.push(index, time, row.standoff_unclamped_m);
            group.margin.push(index, time, row.margin_m);
            group.centre_error.push(index, time, judged.centre_error_m(row));
            group.separation.push(index, time, row.separation_m);
        }
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
            if let Some(colour) = self.colour(row.to_group) {
                self.dwells.entry((row.target, colour)).or_default().push(index, row.state[0], row.state[3]);
            }
        }
        for row in &frame.uavs {
            let group = group_of(frame, row);
            let colour = self.colour(row.group);
            if let Some(group) = row.group.and_then(|id| self.groups.get_mut(&id)) {
                group.distances.entry(row.uav).or_default().push(index, time, row.centre_distance_m);
            }
            let uav = self.uavs.entry(row.uav).or_default();
            uav.path.push(index, row.x_m, row.y_m);
            uav.served.push(index, place(row.x_m, row.y_m), colour);
            uav.view = group.and_then(|group| {
                let reach = usable(row.centre_distance_m?.abs() + group.spread_m.abs())?;
                Some((place(row.x_m, row.y_m)?, usable(row.boresight_rad?)?, reach))
            });
            uav.error.push(index, time, group.map(|group| tracking_error_m(row, group)));
            uav.off_boresight.push(index, time, geometry.line_of_sight_rad(row).map(f64::to_degrees));
            uav.speed.push(index, time, row.speed_m_s);
            uav.speed_command.push(index, time, row.speed_command_m_s);
            uav.turn_rate.push(index, time, row.turn_rate_rad_s.to_degrees());
            uav.turn_rate_command.push(index, time, row.turn_rate_command_rad_s.to_degrees());
        }
        for row in &frame.agents.all {
            let (agents, mind) = (&frame.agents, self.minds.entry(row.agent).or_default());
            let team = agents.team_of(row.agent).iter();
            let unheard = team.filter(|mate| mate.presence.is_some_and(|presence| presence != Presence::Live));
            let contradicts = |other: &&AgentRow| !agents.crew(other.agent).eq(agents.crew(row.agent));
            mind.unheard.push(index, time, unheard.count() as f64);
            mind.contradicting.push(index, time, agents.all.iter().filter(contradicts).count() as f64);
            mind.open.push(index, time, row.committed_us.map(|us| time - us as f64 * 1e-6));
        }
        for (group, between, angle) in separations(frame) {
            if let Some(group) = self.groups.get_mut(&group) {
                group.phases.entry(between).or_default().push(index, time, angle.to_degrees());
            }
        }
        frame.events.iter().for_each(|event| self.happened(time, event));
        if self.frames.is_multiple_of(SHARE_EVERY) {
            self.share_points();
        }
    }

    /// Bounds the points of all curves together, however many there are.
    fn share_points(&mut self) {
        let most = (ALL_POINTS / self.curves().count().max(1)).clamp(FEWEST_POINTS, MOST_POINTS);
        self.curves().for_each(|curve| curve.keep(most));
    }

    fn curves(&mut self) -> impl Iterator<Item = &mut Curve> {
        let uavs = self.uavs.values_mut().flat_map(Uav::curves);
        let groups = self.groups.values_mut().flat_map(Group::curves);
        let tracks = self.tracks.values_mut().flat_map(Path::curves);
        let others = self.truth.values_mut().chain(self.dwells.values_mut()).chain(self.marks.values_mut());
        let minds =
            self.minds.values_mut().flat_map(|Mind { unheard, contradicting, open }| [unheard, contradicting, open]);
        uavs.chain(groups).chain(tracks).chain(others).chain(minds)
    }

    /// Takes in the groups that are new.
    fn found(&mut self, frame: &Frame) {
        self.colours.next_instant(&frame.groups);
        let alive = |id: &u32| frame.groups.iter().any(|row| row.group == *id);
        for id in frame.groups.iter().map(|row| row.group) {
            if self.groups.contains_key(&id) {
                continue;
            }
            let colour = self.colours.place(id).unwrap_or(0);
            self.groups.insert(id, Group { colour, ..Group::default() });
            self.founded += 1;
        }
        while self.groups.len() > MOST_GROUPS {
            let dissolved = self.groups.iter().filter(|group| !alive(group.0));
            let Some((&id, _)) = dissolved.min_by_key(|group| group.1.instants) else { return };
            self.groups.remove(&id);
        }
    }

    /// Marks an event where and when it happened.
    fn happened(&mut self, time: f64, event: &EventRow) {
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

    /// From the first to the last instant, s.
    pub(super) fn time(&self) -> Range<f64> {
        range(self.times.into_iter().flatten(), 1.0, 0.0)
    }

    /// A curve of each UAV.
    pub(super) fn each(&self, of: fn(&Uav) -> &Curve) -> impl Iterator<Item = (u32, &Curve)> {
        self.uavs.iter().map(move |(&id, uav)| (id, of(uav)))
    }

    /// Title of an upward axis that shows something of one group, which is named unless it is the only one.
    pub(super) fn axis(&self, what: &str, group: u32, unit: &str) -> String {
        if self.founded > 1 { format!("{what}, group {group} ({unit})") } else { format!("{what} ({unit})") }
    }

    /// The UAV's colour, the same in every figure.
    pub(super) fn uav_colour(&self, id: u32) -> RGBColor {
        UAVS[self.uavs.range(..id).count() % UAVS.len()]
    }

    /// The group's colour, likewise.
    pub(super) fn group_colour(&self, id: u32) -> RGBColor {
        GROUPS[self.groups.get(&id).map_or(0, |group| group.colour)]
    }

    fn colour(&self, group: Option<u32>) -> Option<usize> {
        Some(self.groups.get(&group?)?.colour)
    }
}

/// A position if it can be drawn.
fn place(x_m: f64, y_m: f64) -> Option<Point> {
    usable(x_m).zip(usable(y_m))
}

#[cfg(test)]
mod tests {
    use super::*;
    use standoff_sim::record::TruthRow;

    /// So many points are kept of this many targets, that move for so many instants.
    fn kept(targets: u32, instants: u32) -> usize {
        let (mut run, mut judge) = (Run::default(), Judge::new(crate::figures::tests::setup().rules));
        for instant in 0..instants {
            let at = f64::from(instant);
            let row =
                |target| TruthRow { target, x_m: at, y_m: at, vx_m_s: 1.0, vy_m_s: 1.0, ax_m_s2: None, ay_m_s2: None };
            let truth = (0..targets).map(row).collect();
            run.add(&Frame { time_us: i64::from(instant) * 500_000, truth, ..Frame::default() }, &mut judge);
        }
        run.curves().map(|curve| curve.runs(usize::MAX).concat().len()).sum()
    }

    #[test]
    fn of_many_targets_fewer_points_each_are_kept() {
        assert_eq!(kept(10, 3_000), 30_000, "those of few are all kept");
        let all = kept(500, 2_500);
        assert!((ALL_POINTS / 2..=2 * ALL_POINTS).contains(&all), "{all}");
        assert_eq!(kept(6_000, 128), MOST_TARGETS * 128, "those of the first targets");
    }
}
