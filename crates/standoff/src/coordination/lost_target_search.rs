//! Search for lost targets: which UAV searches, and the area that can contain the target by now.
//!
//! ```text
//! reach  = sd + max(v, v_0) t      v: last speed; v_0: initial speed sd of a new track; t: time since the loss
//! radius = reach / sin(half the field of view), within the bounds of the orbit
//! ```
//!
//! A searching UAV circles around the position at which the target was lost. It uses a radius from which the whole disc
//! that the target can have reached is in view, if there is one; for larger discs, the boresight swings over the disc.
//! The search ends when the target is measured, when the disc is larger than the sensing range, or when a group needs
//! the UAV. A UAV may only search if other UAVs have every member of its group in view, and if one UAV remains for
//! every group. Groups whose total priority is lower than that of the lost target do not count.

use std::collections::BTreeSet;

use crate::angle::Angle;
use crate::coordination::event::{Event, EventKind, SearchEndReason};
use crate::coordination::memberships::Memberships;
use crate::coordination::teammate::Teammate;
use crate::frame::Position;
use crate::grid::Grid;
use crate::group_id::GroupId;
use crate::math::{self, PI};
use crate::params::TeamParams;
use crate::time::{Duration, Time};
use crate::tracking::track::{LossReason, Track, TrackId, TrackStatus};
use crate::uav::UavId;

/// Period of the swing over the disc and back: at most 45 degrees per second, so that a field of view of 70 degrees has
/// each point in view for more than a second.
const SWING_PERIOD: Duration = Duration::from_us(16_000_000);
/// Delay of the swing from one UAV id to the next: the golden section of the period, so that no two UAVs swing in
/// phase.
const SWING_DELAY_US: i64 = 9_888_544;

/// Assignment of a UAV to a lost target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct SearchAssignment {
    /// Id of the UAV.
    pub uav: UavId,
    /// Lost track that the UAV searches for.
    pub track: TrackId,
}

/// Disc that can contain a lost target by now.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SearchArea {
    /// Position at which the track was lost.
    pub(crate) centre: Position,
    /// Maximum distance of the target from there, m.
    pub(crate) reach_m: f64,
    /// Radius of the circle that a searching UAV flies, m.
    pub(crate) radius_m: f64,
}

impl SearchArea {
    /// Computes the area of a lost track in `later_s` seconds; `None` if the track is not lost, or if the area is
    /// larger than the sensing range.
    pub(crate) fn of(track: &Track, later_s: f64, params: &TeamParams) -> Option<Self> {
        let estimate = track.estimate();
        let speed_m_s = estimate.state.velocity().speed_m_s().max(params.track.initial_velocity_sd_m_s);
        let reach_m = estimate.position_sd_max_m() + speed_m_s * (track.time_since_lost().s() + later_s);
        let is_searchable = track.is_lost() && reach_m <= params.track.sensor.sensing_range_m;
        let standoff = params.stationary_orbit_bounds();
        is_searchable.then(|| Self {
            centre: estimate.state.position(),
            reach_m,
            radius_m: (reach_m * standoff.radius_per_spread(&params.track.sensor))
                .clamp(standoff.radius_min_m, standoff.radius_max_m),
        })
    }

    /// Boresight of a searching UAV at a position: at the centre, if the whole disc is in view; otherwise swinging over
    /// the whole disc.
    pub(crate) fn boresight(&self, uav: UavId, at: Position, now: Time, field_of_view_rad: f64) -> Angle {
        let to_centre = self.centre - at;
        let tangent_m2 = to_centre.length_m() * to_centre.length_m() - self.reach_m * self.reach_m;
        let half_rad = if tangent_m2 > 0.0 { math::atan2(self.reach_m, tangent_m2.sqrt()) } else { PI };
        // A quarter more than necessary, so that the edge stays in view for a while, too.
        let swing_rad = 1.25 * (half_rad - field_of_view_rad / 2.0).max(0.0);
        // In whole microseconds, so that the swing is the same at any time of a mission.
        let (period_us, delay_us) = (SWING_PERIOD.us(), i64::from(uav.0) * SWING_DELAY_US);
        let into_us = (now.us().rem_euclid(period_us) + delay_us).rem_euclid(period_us);
        let triangle = 4.0 * (into_us as f64 / period_us as f64 - 0.5).abs() - 1.0;
        to_centre.direction() + Angle::from_rad(swing_rad * triangle)
    }
}

/// Update of the search assignments at one time step.
pub(crate) struct SearchAssignmentUpdate<'a> {
    pub(crate) memberships: &'a Memberships,
    /// UAVs in ascending order, each with its previous group.
    pub(crate) team: &'a mut [Teammate],
    pub(crate) params: &'a TeamParams,
    /// Search assignments of the last time step, by ascending UAV; updated in place.
    pub(crate) assignments: &'a mut Vec<SearchAssignment>,
    pub(crate) events: &'a mut Vec<Event>,
}

impl SearchAssignmentUpdate<'_> {
    /// Recalls UAVs and sends others.
    pub(crate) fn update(&mut self) {
        self.recall();
        self.send();
    }

    /// Number of UAVs that may search for a track or for others of at least its priority: those that remain if each
    /// group has one whose total priority is not lower.
    fn spare_uavs(&self, track: TrackId) -> usize {
        let priority = self.priority(track);
        let groups = self.memberships.groups().iter().filter(|group| self.total_priority(**group) >= priority);
        self.team.len().saturating_sub(groups.count())
    }

    /// Total priority of a group's members.
    fn total_priority(&self, group: GroupId) -> f64 {
        self.memberships.of(group).map(|index| self.memberships.tracks()[index].priority).sum()
    }

    fn priority(&self, track: TrackId) -> f64 {
        self.memberships.track_index(track).map_or(0.0, |index| self.memberships.tracks()[index].priority)
    }

    fn track(&self, id: TrackId) -> Option<&Track> {
        self.memberships.track_index(id).ok().map(|index| &self.memberships.tracks()[index].track)
    }

    fn recall(&mut self) {
        let mut assignments = core::mem::take(self.assignments);
        let is_in_team = |uav: UavId| self.team.binary_search_by_key(&uav, |teammate| teammate.uav).is_ok();
        assignments.retain(|assignment| is_in_team(assignment.uav));
        let reach_m = |assignment: &SearchAssignment| {
            let area = self.track(assignment.track).and_then(|track| SearchArea::of(track, 0.0, self.params));
            area.map_or(f64::INFINITY, |area| area.reach_m)
        };
        let mut ended: Vec<(SearchAssignment, SearchEndReason)> = Vec::new();
        assignments.retain(|assignment| {
            let is_found = self.track(assignment.track).is_some_and(|track| !track.is_lost());
            let end = if is_found { SearchEndReason::Found } else { SearchEndReason::GivenUp };
            let continues = reach_m(assignment).is_finite();
            ended.extend((!continues).then_some((*assignment, end)));
            continues
        });
        // Of equal priorities, the largest area is the least promising.
        let priority = |assignment: &SearchAssignment| self.priority(assignment.track);
        let least_promising = |assignments: &[SearchAssignment]| {
            let by_promise = |a: &SearchAssignment, b: &SearchAssignment| {
                priority(b).total_cmp(&priority(a)).then(reach_m(a).total_cmp(&reach_m(b)))
            };
            (0..assignments.len()).max_by(|a, b| by_promise(&assignments[*a], &assignments[*b]))
        };
        while let Some(index) = least_promising(&assignments)
            && assignments.len() > self.spare_uavs(assignments[index].track)
        {
            ended.push((assignments.remove(index), SearchEndReason::Recalled));
        }
        *self.assignments = assignments;
        for (assignment, end) in ended {
            let event = Event::of_track(EventKind::SearchEnded(end), assignment.track, None);
            self.events.push(Event { uav: Some(assignment.uav), ..event });
        }
    }

    /// Assigns the nearest UAV that is available and arrives in time to each lost target without a searching UAV, those
    /// of the highest priority first.
    fn send(&mut self) {
        let lost = || self.memberships.tracks().iter().filter(|known| known.track.is_lost());
        let highest = lost().max_by(|a, b| a.priority.total_cmp(&b.priority));
        if highest.is_none_or(|known| self.assignments.len() >= self.spare_uavs(known.track.id)) {
            return;
        }
        let mut pairs: Vec<(f64, usize, TrackId)> = Vec::new();
        let lost = lost().map(|known| &known.track);
        let searched: BTreeSet<TrackId> = self.assignments.iter().map(|assignment| assignment.track).collect();
        // A UAV that needs longer cannot arrive in time, because the area grows at least at this rate.
        let longest_s = self.params.track.sensor.sensing_range_m / self.params.track.initial_velocity_sd_m_s;
        let farthest_m = longest_s * self.params.uav.speed_m_s;
        let places = Grid::of(self.team.iter().map(|teammate| teammate.state.position), 0.25 * farthest_m);
        for track in lost.filter(|track| !searched.contains(&track.id)) {
            if SearchArea::of(track, 0.0, self.params).is_none() {
                continue;
            }
            for index in places.near(track.estimate().state.position(), farthest_m) {
                let teammate = &self.team[index];
                let distance_m = track.estimate().state.position().distance_m(teammate.state.position);
                let in_time = SearchArea::of(track, distance_m / self.params.uav.speed_m_s, self.params);
                pairs.extend(in_time.map(|_| (distance_m, index, track.id)));
            }
        }
        let priority = |pair: &(f64, usize, TrackId)| self.priority(pair.2);
        pairs.sort_unstable_by(|a, b| {
            let by_priority = priority(b).total_cmp(&priority(a));
            by_priority.then(a.0.total_cmp(&b.0)).then((a.1, a.2).cmp(&(b.1, b.2)))
        });
        for (_, index, track) in pairs {
            let (uav, group) = (self.team[index].uav, self.team[index].group);
            let is_taken = self.assignments.iter().any(|assignment| assignment.uav == uav || assignment.track == track);
            if is_taken || self.assignments.len() >= self.spare_uavs(track) || !self.can_leave(index, track) {
                continue;
            }
            self.team[index].group = None;
            let place = self.assignments.partition_point(|assignment| assignment.uav < uav);
            self.assignments.insert(place, SearchAssignment { uav, track });
            let event = Event::of_track(EventKind::SearchStarted, track, group);
            self.events.push(Event { uav: Some(uav), ..event });
        }
    }

    /// True if the UAV may search for the track: there are no groups; or the track was lost because it became too
    /// uncertain, and the UAV has no group, a group of lower total priority, or other UAVs have every member of its group
    /// in view. A target that vanished
    /// in view may have left the roads; a second UAV of a group then provides more information.
    fn can_leave(&self, index: usize, for_track: TrackId) -> bool {
        if self.memberships.groups().is_empty() {
            return true;
        }
        if self.track(for_track).is_none_or(|track| track.status != TrackStatus::Lost(LossReason::TooUncertain)) {
            return false;
        }
        let Some(group) = self.team[index].group else { return true };
        if self.total_priority(group) < self.priority(for_track) {
            return true;
        }
        let sensor = &self.params.track.sensor;
        let others = || {
            self.team.iter().filter(|teammate| teammate.group == Some(group) && teammate.uav != self.team[index].uav)
        };
        self.memberships.of(group).all(|place| {
            let at = self.memberships.tracks()[place].position();
            let has_in_view = |teammate: &Teammate| {
                teammate.boresight.is_some_and(|boresight| sensor.in_view(teammate.state.position, boresight, at))
            };
            others().any(has_in_view)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coordination::memberships::Membership;
    use crate::frame::Velocity;
    use crate::message::{Cue, Report};
    use crate::uav::UavState;

    fn params() -> TeamParams {
        TeamParams::paper()
    }

    fn track(id: u32, x_m: f64, vx_m_s: f64) -> Track {
        let cue = Cue { velocity: Velocity::from_m_s(vx_m_s, 0.0), ..Cue::at(id, Position::from_m(x_m, 0.0)) };
        Track::from_cue(&cue, &params().track, Time::EPOCH).unwrap()
    }

    fn lost(id: u32, x_m: f64, vx_m_s: f64, lost_for_s: f64) -> Track {
        let mut track = track(id, x_m, vx_m_s);
        track.status = TrackStatus::Lost(LossReason::TooUncertain);
        track.predict(&params().track.transition(Duration::from_s(lost_for_s)));
        track
    }

    /// The area starts with an uncertainty of 20 m and grows at 10 m/s, or faster if the target was faster. The orbit
    /// has twice the radius of the disc (60 degrees are planned with), within 250 and 700 m. The sensing range is 1,200
    /// m.
    #[test]
    fn the_search_area_grows_until_it_exceeds_the_sensing_range() {
        let area = |vx_m_s, lost_for_s, later_s| {
            let area = SearchArea::of(&lost(0, 40.0, vx_m_s, lost_for_s), later_s, &params());
            area.map(|area| (area.centre.x_m(), area.reach_m.round(), area.radius_m.round()))
        };
        assert_eq!(area(0.0, 0.0, 0.0), Some((40.0, 20.0, 250.0)));
        assert_eq!(area(-8.0, 20.0, 0.0), Some((40.0, 220.0, 440.0)));
        assert_eq!(area(15.0, 20.0, 0.0), Some((40.0, 320.0, 640.0)));
        assert_eq!(area(15.0, 20.0, 30.0), Some((40.0, 770.0, 700.0)));
        assert_eq!(area(8.0, 110.0, 7.9), Some((40.0, 1199.0, 700.0)));
        assert_eq!(area(8.0, 110.0, 8.1), None);
        assert_eq!(SearchArea::of(&track(0, 40.0, 8.0), 0.0, &params()), None);
    }

    /// From 700 m, a disc of 350 m spans 60 degrees, all within a field of view of 70 degrees. A disc of 606.2 m spans
    /// 120 degrees, so that its centre is 25 degrees off when an edge of the view is on an edge of the disc, plus a
    /// quarter. From within the disc, the swing covers all directions.
    #[test]
    fn the_boresight_swings_over_all_of_the_disc() {
        let at = Position::from_m(-700.0, 0.0);
        let off_deg = |reach_m: f64, uav: u32, s: f64| {
            let area = SearchArea { centre: Position::ORIGIN, reach_m, radius_m: 700.0 };
            area.boresight(UavId(uav), at, Time::EPOCH + Duration::from_s(s), 70f64.to_radians()).deg()
        };
        let wide_m = 700.0 * 0.75f64.sqrt();
        for (reach_m, uav, s, expected_deg) in [
            (350.0, 0, 0.0, 0.0),
            (wide_m, 0, 0.0, 31.25),
            (wide_m, 0, 4.0, 0.0),
            (wide_m, 0, 8.0, -31.25),
            (wide_m, 0, 14.0, 15.625),
            (wide_m, 1, 0.0, 31.25 * (4.0 * 0.118_034 - 1.0)),
            (800.0, 0, 2.0, 90.625),
        ] {
            assert!((off_deg(reach_m, uav, s) - expected_deg).abs() < 1e-6, "{reach_m} m, UAV {uav}, {s} s");
        }
        // Every direction within reach is in view at two consecutive half-seconds at some time.
        for direction_deg in -180..180 {
            let has_in_view = |half_s: u32| {
                let off = Angle::from_deg(f64::from(direction_deg) - off_deg(800.0, 3, f64::from(half_s) / 2.0));
                off.abs_rad() <= 35f64.to_radians()
            };
            assert!((0..32).any(|half_s| has_in_view(half_s) && has_in_view(half_s + 1)), "{direction_deg}");
        }
    }

    /// Of each event, the UAV and the cause or kind.
    type Causes = Vec<(u32, &'static str)>;

    struct World {
        memberships: Memberships,
        team: Vec<Teammate>,
        assignments: Vec<SearchAssignment>,
    }

    impl World {
        /// UAVs at positions on the x axis, all of one group; its target is at the origin, at which they point.
        fn new(uavs: &[f64]) -> Self {
            let mut memberships = Memberships::default();
            memberships.start(track(0, 0.0, 0.0));
            memberships.set(0, Membership::Member(GroupId(0)));
            let teammate = |(id, x_m): (usize, &f64)| {
                let position = Position::from_m(*x_m, 0.0);
                let state = UavState::level_flight(position, Angle::ZERO, 40.0);
                let boresight = Some((Position::ORIGIN - position).direction());
                let report = Report { boresight, ..Report::position_only(UavId(id as u32), Time::EPOCH, state) };
                Teammate::from_report(&report, Some(GroupId(0)), Time::EPOCH)
            };
            Self { memberships, team: uavs.iter().enumerate().map(teammate).collect(), assignments: Vec::new() }
        }

        /// Updates the assignments; returns the searching UAVs with their tracks, and the events.
        fn settle(&mut self) -> (Vec<(u32, u64)>, Causes) {
            let Self { memberships, team, assignments } = self;
            let mut events = Vec::new();
            SearchAssignmentUpdate { memberships, team, params: &params(), assignments, events: &mut events }.update();
            let cause = |event: &Event| (event.uav.unwrap().0, event.kind.cause().unwrap_or(event.kind.name()));
            (
                self.assignments.iter().map(|assignment| (assignment.uav.0, assignment.track.0)).collect(),
                events.iter().map(cause).collect(),
            )
        }
    }

    #[test]
    fn the_nearest_available_uav_searches_for_each_lost_target() {
        let mut world = World::new(&[300.0, -300.0, 400.0]);
        world.memberships.start(lost(1, 900.0, 0.0, 0.0));
        world.memberships.start(lost(2, -900.0, 0.0, 0.0));
        world.memberships.start(lost(3, 2000.0, 0.0, 0.0));
        // 500 m to the first target, 600 m to the second; a third UAV stays.
        assert_eq!(world.settle(), (vec![(1, 2), (2, 1)], vec![(2, "search-started"), (1, "search-started")]));
        assert_eq!(world.team.iter().filter(|teammate| teammate.group.is_some()).count(), 1);
        // Each continues with its own target.
        world.team.swap(1, 2);
        (world.team[1].uav, world.team[2].uav) = (UavId(1), UavId(2));
        assert_eq!(world.settle(), (vec![(1, 2), (2, 1)], vec![]));
    }

    #[test]
    fn no_uav_leaves_unless_others_have_its_members_in_view() {
        let world = |uavs: &[f64], track: Track| {
            let mut world = World::new(uavs);
            world.memberships.start(track);
            world
        };
        let near = lost(1, 900.0, 0.0, 0.0);
        assert_eq!(world(&[300.0, -300.0], near).settle().0, [(0, 1)]);
        assert_eq!(world(&[300.0], near).settle().0, []);
        let mut away = world(&[300.0, -300.0], near);
        away.team[1].boresight = Some(Angle::from_deg(90.0));
        // The UAV that has the target in view stays, the other one searches.
        assert_eq!(away.settle().0, [(1, 1)]);
        away = world(&[300.0, -300.0], near);
        away.team.iter_mut().for_each(|teammate| teammate.boresight = None);
        assert_eq!(away.settle().0, []);
        let mut vanished = near;
        vanished.status = TrackStatus::Lost(LossReason::UnseenInView);
        let mut idle = world(&[300.0, -300.0], vanished);
        assert_eq!(idle.settle().0, []);
        idle.team[1].group = None;
        assert_eq!(idle.settle().0, []);
        idle.memberships.set(0, Membership::Ungrouped);
        assert_eq!(idle.settle().0, [(0, 1)]);
        // The UAV would only arrive when the area is too large: 20 m + 10 m/s for 104 s, and 600 m at 40 m/s.
        assert_eq!(world(&[300.0, -300.0], lost(1, 900.0, 0.0, 104.0)).settle().0, []);
        assert_eq!(world(&[300.0, -300.0], lost(1, 900.0, 0.0, 102.0)).settle().0, [(0, 1)]);
    }

    /// The only UAV leaves its group, of priority 1, for a lost target of higher priority, and the nearer target waits.
    #[test]
    fn a_lost_target_of_high_priority_counts_more_than_a_group() {
        let searches = |priority: f64| {
            let mut world = World::new(&[300.0]);
            world.memberships.start(lost(1, 900.0, 0.0, 0.0));
            world.memberships.start(lost(2, 1000.0, 0.0, 0.0));
            assert!(world.memberships.restore_priorities(&[(TrackId(1), 0.9), (TrackId(2), priority)]));
            world.memberships.update_priorities(&[]);
            let searches = world.settle().0;
            assert_eq!(world.settle().0, searches);
            searches
        };
        assert_eq!(searches(1.1), [(0, 2)]);
        assert_eq!(searches(0.5), []);
    }

    #[test]
    fn a_search_ends_if_the_target_is_found_or_out_of_reach_or_a_group_needs_the_uav() {
        let searching = |tracks: &[Track]| {
            let mut world = World::new(&[300.0, -300.0, 400.0]);
            tracks.iter().for_each(|track| world.memberships.start(*track));
            world.assignments = vec![
                SearchAssignment { uav: UavId(1), track: TrackId(1) },
                SearchAssignment { uav: UavId(2), track: TrackId(2) },
            ];
            (world.team[1].group, world.team[2].group) = (None, None);
            world
        };
        let both = [lost(1, 900.0, 0.0, 50.0), lost(2, -900.0, 0.0, 60.0)];
        let mut found = searching(&both);
        *found.memberships.track_mut(1) = track(1, 950.0, 0.0);
        assert_eq!(found.settle(), (vec![(2, 2)], vec![(1, "found")]));
        let mut out_of_reach = searching(&[both[0], lost(2, -900.0, 0.0, 119.0)]);
        assert_eq!(out_of_reach.settle(), (vec![(1, 1)], vec![(2, "given-up")]));
        let mut forgotten = searching(&both[..1]);
        assert_eq!(forgotten.settle(), (vec![(1, 1)], vec![(2, "given-up")]));
        // With a second group, one of three UAVs may search; the larger area is given up.
        let mut needed = searching(&both);
        needed.memberships.start(track(3, 100.0, 0.0));
        needed.memberships.set(3, Membership::Member(GroupId(1)));
        assert_eq!(needed.settle(), (vec![(1, 1)], vec![(2, "recalled")]));
        let mut silent = searching(&both);
        silent.team.remove(2);
        assert_eq!(silent.settle(), (vec![(1, 1)], vec![]));
    }
}
