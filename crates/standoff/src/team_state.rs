//! Team state at one time step: all known targets, the groups and their orbits (a common operating picture).
//!
//! A team state is a function of the previous one and of the messages in between. All agents that compute it get
//! bitwise equal results.

use crate::angle::Angle;
use crate::coordination::assignment::{Assignment, AssignmentLaw, AvailableUav, CandidateGroup, assign, sound};
use crate::coordination::event::{Event, EventKind, ReassignmentReason};
use crate::coordination::group::Group;
use crate::coordination::grouping::{Grouping, GroupingBuffers, GroupingState};
use crate::coordination::lost_target_search::{SearchAssignment, SearchAssignmentUpdate};
use crate::coordination::memberships::{GroupIndex, GroupedTrack, Memberships};
use crate::coordination::teammate::Teammate;
use crate::digest::digest;
use crate::estimation::information_filter::Contribution;
use crate::estimation::track::{Track, TrackId, TrackStatus};
use crate::frame::Position;
use crate::group_id::GroupId;
use crate::guidance::geofence::Geofence;
use crate::guidance::heading::OrbitRelativeState;
use crate::message::{Report, TargetLabel};
use crate::params::{AltitudePolicy, GroupCount, GroupingParams, TeamParams};
use crate::sensor::{RangeBearingMeasurement, SensorParams};
use crate::step_messages::{StepMessages, TARGETS_MAX, TEAM_MAX};
use crate::target::Transition;
use crate::time::{Duration, Time};
use crate::uav::UavId;

#[cfg(test)]
mod tests;

/// Knowledge and intent of a team at one time step.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct TeamState {
    /// Time of the time step.
    pub time: Time,
    /// Groups, by ascending id.
    pub groups: Vec<Group>,
    /// Assignment of UAVs to groups, by ascending UAV. It contains every UAV received within the teammate timeout that
    /// does not search, while there are groups.
    pub assignments: Vec<Assignment>,
    /// UAVs that search for lost targets, by ascending UAV.
    pub search_assignments: Vec<SearchAssignment>,
    /// Number of tracks that are not lost and in no group.
    pub ungrouped_count: u32,
    /// Events of this time step.
    #[serde(skip)]
    pub events: Vec<Event>,
    /// UAVs whose reports were received within the teammate timeout, by ascending id, with their groups.
    pub teammates: Vec<Teammate>,
    memberships: Memberships,
    /// Place of each UAV on its group's orbit; empty while there are no groups.
    #[serde(skip)]
    on_orbit: Vec<OrbitRelativeState>,
    had_team: bool,
    grouping_state: GroupingState,
    /// Number of implausible reports of this time step, with a position that the UAV cannot have reached, and of
    /// targets beyond the maximum.
    #[serde(skip)]
    pub(crate) implausible: u32,
}

/// Input of a state update: everything that changed since the previous team state.
pub(crate) struct StepInput<'a> {
    /// Time of the new team state.
    pub(crate) now: Time,
    /// Messages of the time step.
    pub(crate) messages: &'a StepMessages,
    /// Target model over the time difference.
    pub(crate) transition: &'a Transition,
    /// Custom assignment law; `None` for the built-in one.
    pub(crate) assignment: Option<&'a dyn AssignmentLaw>,
    /// Geofence; `None` without zones.
    pub(crate) geofence: Option<&'a Geofence>,
    /// If true, groups and assignments stay unchanged; only the estimates of targets and UAVs advance.
    pub(crate) is_extrapolated: bool,
}

/// Reused buffers, so that a step allocates nothing; the contents are valid within one step.
#[derive(Debug, Clone, Default)]
pub(crate) struct Buffers {
    /// Sum of the measurements of each known target, by index.
    measured: Vec<Option<Contribution>>,
    /// Measurements of targets without a live track: label, position of the UAV, measurement; by label, then UAV.
    trackless: Vec<(TargetLabel, Position, RangeBearingMeasurement)>,
    /// Members of each group before regrouping.
    before: GroupIndex,
    grouping: GroupingBuffers,
    /// UAVs whose report is implausible; usually empty.
    implausible: Vec<UavId>,
}

impl TeamState {
    /// All known targets, by ascending track.
    pub fn tracks(&self) -> &[GroupedTrack] {
        self.memberships.tracks()
    }

    /// Members of a group, including those in handoff to or from it.
    pub(crate) fn members_of(&self, group: GroupId) -> impl Iterator<Item = &GroupedTrack> + Clone {
        self.memberships.of(group).map(|track_index| &self.tracks()[track_index])
    }

    /// Returns the target with a track id.
    pub fn track(&self, track: TrackId) -> Option<&GroupedTrack> {
        self.memberships.track_index(track).ok().map(|track_index| &self.tracks()[track_index])
    }

    /// Returns the target with a sensor-reported identity.
    pub fn track_by_label(&self, label: TargetLabel) -> Option<&GroupedTrack> {
        self.track(TrackId::from_label(label))
    }

    /// Returns the assigned group of a UAV.
    pub fn group_of(&self, uav: UavId) -> Option<&Group> {
        let assignment = self
            .assignments
            .binary_search_by_key(&uav, |assignment| assignment.uav)
            .ok()
            .map(|index| &self.assignments[index])?;
        self.group(assignment.group)
    }

    /// Returns the lost track that a UAV searches for.
    pub fn search_target_of(&self, uav: UavId) -> Option<&Track> {
        let assignment = self
            .search_assignments
            .binary_search_by_key(&uav, |assignment| assignment.uav)
            .ok()
            .map(|index| &self.search_assignments[index])?;
        self.track(assignment.track).map(|known| &known.track)
    }

    /// 64-bit digest of the state. States with equal digests evolve equally.
    pub fn digest(&self) -> u64 {
        digest(self)
    }

    /// Validates a state received from another agent and restores the fields that are not serialised. Returns `false`
    /// for an invalid state: unordered or oversized lists, times in the future, or NaNs.
    pub(crate) fn rebuild_index(&mut self, params: &TeamParams) -> bool {
        self.memberships.rebuild_index(self.time, Duration::from_s(params.group.dwell_max_s))
            && self.grouping_state.is_valid(self.time, params)
            && self.tracks().len() <= TARGETS_MAX
            && self.teammates.len() <= TEAM_MAX
            && is_ascending(self.groups.iter().map(|group| group.id.0))
            && self.groups.iter().map(|group| group.id).eq(self.memberships.groups().iter().copied())
            && self.groups.iter().all(Group::is_valid)
            && is_ascending(self.assignments.iter().map(|assignment| u64::from(assignment.uav.0)))
            && self.assignments.iter().all(|assignment| self.group(assignment.group).is_some())
            && is_ascending(self.search_assignments.iter().map(|assignment| u64::from(assignment.uav.0)))
            && self.search_assignments.iter().all(|assignment| self.track(assignment.track).is_some())
            && is_ascending(self.teammates.iter().map(|teammate| u64::from(teammate.uav.0)))
            && self.teammates.iter().all(|teammate| {
                teammate.state.is_finite() && teammate.last_report.is_valid() && teammate.last_report_at <= self.time
            })
    }

    /// True if group members, assignments or searches differ from those of the previous state.
    pub(crate) fn is_rearranged_since(&self, previous: &TeamState) -> bool {
        self.assignments != previous.assignments
            || self.search_assignments != previous.search_assignments
            || self.memberships.index() != previous.memberships.index()
    }

    /// Zero-based creation index of a group, which records and users see; it is the same for all agents if all messages
    /// arrive. `None` for groups that exist neither now nor at the previous time step.
    pub fn group_number(&self, group: GroupId) -> Option<u32> {
        self.memberships.number(group)
    }

    /// Returns the group with an id.
    pub fn group(&self, id: GroupId) -> Option<&Group> {
        self.groups.binary_search_by_key(&id, |group| group.id).ok().map(|index| &self.groups[index])
    }

    /// Returns a UAV of the team.
    pub fn teammate(&self, uav: UavId) -> Option<&Teammate> {
        self.teammates.binary_search_by_key(&uav, |teammate| teammate.uav).ok().map(|index| &self.teammates[index])
    }

    /// UAVs of a group, and their places on its orbit.
    pub(crate) fn on_orbit_of(&self, group: GroupId) -> impl Iterator<Item = (&Teammate, &OrbitRelativeState)> + Clone {
        self.teammates.iter().zip(&self.on_orbit).filter(move |(teammate, _)| teammate.group == Some(group))
    }

    /// Computes this state from the `previous` one and the input of the step.
    pub(crate) fn advance(
        &mut self,
        previous: &TeamState,
        news: &StepInput,
        params: &TeamParams,
        scratch: &mut Buffers,
    ) {
        self.events.clear();
        (self.time, self.implausible) = (news.now, 0);
        self.memberships.copy(&previous.memberships);
        self.grouping_state = previous.grouping_state;
        // Each stage processes all tracks, so that no target waits for the results of another.
        self.memberships.tracks_mut().for_each(|track| track.predict(news.transition));
        // If the maximum number of targets is reached, lost ones are removed immediately.
        let is_full = self.tracks().len() >= TARGETS_MAX;
        let after_s = if is_full { 0.0 } else { params.track.lost_track_retention_s };
        self.memberships.forget_lost(Duration::from_s(after_s));
        self.take_cues(news, params);
        self.gather_team(previous, news, params, &mut scratch.implausible);
        self.measure(news.messages, &params.track.sensor, scratch);
        self.update_tracks(previous, news, params, scratch);
        self.start_tracks(params, scratch);

        scratch.before.copy(self.memberships.index());
        if !news.is_extrapolated {
            Grouping {
                now: news.now,
                memberships: &mut self.memberships,
                state: &mut self.grouping_state,
                previous: &previous.groups,
                team: &self.teammates,
                params,
                events: &mut self.events,
                buffers: &mut scratch.grouping,
            }
            .update();
        }
        self.ungrouped_count = self.tracks().iter().filter(|known| known.is_ungrouped()).count() as u32;
        self.form_groups(previous, news, params, &scratch.before);
        self.search_assignments.clone_from(&previous.search_assignments);
        if news.is_extrapolated {
            self.assignments.clear();
            self.keep_assignments(previous);
        } else {
            self.update_searches(params);
            self.assign_uavs(previous, news, params);
        }
        self.emit_uav_events(previous);
        self.check_groups(previous, params, news.geofence);
    }

    fn take_cues(&mut self, news: &StepInput, params: &TeamParams) {
        for cue in news.messages.cues() {
            let starts_track = self.track_by_label(cue.label).is_none_or(|known| known.track.is_lost());
            let Some(track) = Track::from_cue(cue, &params.track, news.now).filter(|_| starts_track) else { continue };
            self.start(track, EventKind::Cued);
        }
    }

    /// Linearises the measurements of this time step about the predicted position of each known target and sums them in
    /// the order of the UAVs; collects the measurements of other targets.
    ///
    /// Implements the sums of Eq. (10), (11).
    fn measure(&self, row: &StepMessages, sensor: &SensorParams, scratch: &mut Buffers) {
        let Buffers { measured, trackless, implausible, .. } = scratch;
        measured.clear();
        measured.resize(self.tracks().len(), None);
        trackless.clear();
        // In batches of four (SIMD).
        const NONE: RangeBearingMeasurement = RangeBearingMeasurement { range_m: 0.0, bearing: Angle::ZERO };
        let mut four = [(0, (Position::ORIGIN, &NONE, Position::ORIGIN)); 4];
        let mut n = 0;
        let mut sum = |four: &mut [(usize, (Position, &RangeBearingMeasurement, Position)); 4], n: usize| {
            // Fills an incomplete batch with copies of its last element.
            let last = four[n - 1];
            four[n..].fill(last);
            let contributions = Contribution::from_measurements(sensor, four.map(|(_, measurement)| measurement));
            for ((track_index, _), contribution) in four[..n].iter().zip(contributions) {
                *measured[*track_index].get_or_insert_default() += contribution;
            }
        };
        for report in counting(row, implausible) {
            let (from, mut next) = (report.state.position, 0);
            for detection in &report.detections {
                let id = TrackId::from_label(detection.label);
                // Most UAVs detect one target after the other.
                let is_next = self.tracks().get(next).is_some_and(|known| known.track.id == id);
                let track_index = if is_next { Ok(next) } else { self.memberships.track_index(id) };
                match track_index.map(|track_index| (track_index, &self.tracks()[track_index])) {
                    Ok((track_index, known)) if !known.track.is_lost() => {
                        four[n] = (track_index, (from, &detection.measurement, known.position()));
                        n += 1;
                        if n == four.len() {
                            sum(&mut four, n);
                            n = 0;
                        }
                    }
                    _ => trackless.push((detection.label, from, detection.measurement)),
                }
                next = track_index.map_or(next, |track_index| track_index + 1);
            }
        }
        if n > 0 {
            sum(&mut four, n);
        }
        // Stable: the measurements of one target stay in the order of the UAVs.
        trackless.sort_by_key(|(label, ..)| *label);
    }

    /// Updates the predicted tracks, reacquires lost ones, and emits the events.
    fn update_tracks(&mut self, previous: &TeamState, news: &StepInput, params: &TeamParams, scratch: &Buffers) {
        let sensor = &params.track.sensor;
        let should_be_in_view = |position: Position, clearance_m: f64| {
            counting(news.messages, &scratch.implausible).any(|report| {
                report.boresight.is_some_and(|boresight| {
                    sensor.in_view_with_clearance(report.state.position, boresight, position, clearance_m)
                })
            })
        };
        // Targets stay in the same order until they are removed.
        let mut olds = previous.tracks().iter().map(|old| &old.track).peekable();
        for (track_index, measured) in scratch.measured.iter().enumerate() {
            let known = &self.tracks()[track_index];
            let (id, label, status) = (known.track.id, known.track.label, known.track.status);
            let (group, to) = (known.group(), known.receiving_group());
            while olds.next_if(|old| old.id < id).is_some() {}
            let old = olds.next_if(|old| old.id == id);
            let track = self.memberships.track_mut(track_index);
            if track.is_lost() {
                let reacquired = Track::from_measurements(label, scratch.measured_of(label), &params.track);
                *track = reacquired.unwrap_or(*track);
            } else {
                // A track that a cue has just started is already at this time step.
                let cued;
                let (before, dt) = match old.filter(|old| !old.is_lost()) {
                    Some(old) => (old, news.transition.dt),
                    None => {
                        cued = *track;
                        (&cued, Duration::ZERO)
                    }
                };
                track.update(before, measured.as_ref(), dt, should_be_in_view, &params.track);
            }
            let kind = match (status, track.status) {
                (TrackStatus::Lost(_), TrackStatus::Lost(_)) => continue,
                (TrackStatus::Lost(_), _) => EventKind::Reacquired,
                (_, TrackStatus::Lost(reason)) => EventKind::Lost(reason),
                (TrackStatus::Cued, TrackStatus::Updated) => EventKind::Acquired,
                _ => continue,
            };
            self.events.push(Event { to_group: to, ..Event::of_track(kind, id, group) });
        }
    }

    /// Starts tracks from measurements of targets without a cue.
    fn start_tracks(&mut self, params: &TeamParams, scratch: &Buffers) {
        for of_one_target in scratch.trackless.chunk_by(|a, b| a.0 == b.0) {
            let label = of_one_target[0].0;
            if self.track_by_label(label).is_none()
                && let Some(track) = Track::from_measurements(label, scratch.measured_of(label), &params.track)
            {
                self.start(track, EventKind::Acquired);
            }
        }
    }

    /// Adds a track, if the maximum number of targets is not reached.
    fn start(&mut self, track: Track, kind: EventKind) {
        if self.tracks().len() >= TARGETS_MAX && self.track(track.id).is_none() {
            self.implausible += 1;
            return;
        }
        self.memberships.start(track);
        self.events.push(Event::of_track(kind, track.id, None));
    }

    /// Computes the team: all UAVs received within the teammate timeout, with their previous groups. The report of a
    /// UAV whose position is not reachable from its last one is ignored; if the UAV stays there, it counts as new once
    /// the old state has timed out.
    fn gather_team(
        &mut self,
        previous: &TeamState,
        news: &StepInput,
        params: &TeamParams,
        implausible: &mut Vec<UavId>,
    ) {
        implausible.clear();
        self.teammates.clear();
        let (lease, speed_m_s) = (params.teammate_timeout(), 2.0 * params.uav.speed_max_m_s());
        let could_be_at = |teammate: &Teammate, position: Position| {
            let reach_m = speed_m_s * (news.now - teammate.last_report_at).s() + JUMP_M;
            position.squared_distance_m2(teammate.last_report.position) <= reach_m * reach_m
        };
        let reports = news.messages.reports();
        let mut room = TEAM_MAX - reports.len();
        let carry_on = |teammates: &[Teammate], team: &mut Vec<Teammate>, room: &mut usize| {
            for teammate in teammates.iter().filter(|teammate| teammate.is_recent(news.now, lease)).take(*room) {
                *room -= 1;
                team.push(teammate.extrapolated(news.now, params.link));
            }
        };
        let mut teammates = &previous.teammates[..];
        for report in reports {
            // Usually no UAV is silent.
            if teammates.first().is_some_and(|teammate| teammate.uav < report.uav) {
                let (silent, others) =
                    teammates.split_at(teammates.partition_point(|teammate| teammate.uav < report.uav));
                carry_on(silent, &mut self.teammates, &mut room);
                teammates = others;
            }
            let last_state = teammates.first().filter(|teammate| teammate.uav == report.uav);
            if last_state.is_some_and(|teammate| {
                teammate.is_recent(news.now, lease) && !could_be_at(teammate, report.state.position)
            }) {
                implausible.push(report.uav);
                room += 1;
                continue;
            }
            teammates = &teammates[usize::from(last_state.is_some())..];
            self.teammates.push(Teammate::from_report(report, last_state.and_then(|teammate| teammate.group)));
        }
        carry_on(teammates, &mut self.teammates, &mut room);
        self.implausible += implausible.len() as u32;
    }

    /// Returns the id of a UAV's assigned group.
    pub(crate) fn assignment_of(&self, uav: UavId) -> Option<GroupId> {
        self.assignments
            .binary_search_by_key(&uav, |assignment| assignment.uav)
            .ok()
            .map(|index| self.assignments[index].group)
    }

    fn form_groups(&mut self, previous: &TeamState, news: &StepInput, params: &TeamParams, before: &GroupIndex) {
        self.groups.clear();
        for &id in self.memberships.groups() {
            let known = self.memberships.tracks();
            let Some(old) = previous.group(id) else {
                let altitude_m = free_altitude_m(&self.groups, params);
                let group = Group::create(id, known, self.memberships.of(id), params);
                self.groups.extend(group.map(|group| Group { altitude_m, ..group }));
                continue;
            };
            // Copied in place, because a group is a large struct.
            self.groups.extend_from_slice(core::slice::from_ref(old));
            let advanced = self.groups.last_mut().and_then(|group| {
                group.advance(known, before.of(id), self.memberships.of(id), news.transition, params)
            });
            if advanced.is_none() {
                self.groups.pop();
            }
        }
    }

    /// Updates the search assignments; the other UAVs are assigned to groups.
    fn update_searches(&mut self, params: &TeamParams) {
        if params.group.search_lost_targets {
            let (memberships, team) = (&self.memberships, &mut self.teammates[..]);
            SearchAssignmentUpdate {
                memberships,
                team,
                params,
                assignments: &mut self.search_assignments,
                events: &mut self.events,
            }
            .update();
        }
    }

    /// Keeps the assignment; recomputes it if groups or UAVs have appeared or disappeared.
    fn assign_uavs(&mut self, previous: &TeamState, news: &StepInput, params: &TeamParams) {
        self.assignments.clear();
        if self.groups.is_empty() {
            self.teammates.iter_mut().for_each(|teammate| teammate.group = None);
            return;
        }
        let reason = self.reason_to_assign(previous);
        if reason.is_none() && news.assignment.is_none() {
            return self.keep_assignments(previous);
        }
        // The reported assignment of a UAV counts, not the one that its teammates computed.
        let serves = |teammate: &Teammate| {
            teammate.reported_group.filter(|group| self.group(*group).is_some()).or(teammate.group)
        };
        let available = |teammate: &Teammate| AvailableUav {
            uav: teammate.uav,
            position: teammate.state.position,
            current_group: serves(teammate),
        };
        let not_searching =
            || self.teammates.iter().filter(|teammate| !is_searching(&self.search_assignments, teammate.uav));
        let uavs: Vec<AvailableUav> = not_searching().map(available).collect();
        let positions = |id: GroupId| self.memberships.of(id).map(|track_index| self.tracks()[track_index].position());
        let members: Vec<(GroupId, Vec<Position>)> =
            self.groups.iter().map(|group| (group.id, positions(group.id).collect())).collect();
        let sites: Vec<_> = members.iter().map(|(group, members)| CandidateGroup { group: *group, members }).collect();
        let GroupingParams { objective, assignment_switching_cost, .. } = params.group;
        let custom = news.assignment.and_then(|law| law.assign(self.time, &uavs, &sites));
        let reason = match (custom, reason) {
            (Some(assignments), _) => {
                self.assignments = sound(assignments, &uavs, &sites);
                ReassignmentReason::CustomLaw
            }
            (None, Some(reason)) => {
                self.assignments = assign(&uavs, &sites, &params.track.sensor, objective, assignment_switching_cost);
                reason
            }
            (None, None) => return self.keep_assignments(previous),
        };
        for group in &mut self.groups {
            group.members_when_assigned = group.members;
        }
        for assignment in &self.assignments {
            let serves = uavs.iter().find(|uav| uav.uav == assignment.uav).and_then(|uav| uav.current_group);
            if let Some(old) = serves.filter(|old| *old != assignment.group) {
                let group_size = self.assignments.iter().filter(|other| other.group == assignment.group).count();
                let reason =
                    if params.group.count == GroupCount::AsNeeded { reason.by_need(group_size) } else { reason };
                let event = Event::of_group(EventKind::Reassigned(reason), old);
                self.events.push(Event { to_group: Some(assignment.group), uav: Some(assignment.uav), ..event });
            }
        }
    }

    /// Keeps the assignments of the UAVs that do not search.
    fn keep_assignments(&mut self, previous: &TeamState) {
        let Self { assignments: assigned_uavs, search_assignments, .. } = self;
        assigned_uavs
            .extend(previous.assignments.iter().filter(|assignment| !is_searching(search_assignments, assignment.uav)));
    }

    /// Returns the reason for a new assignment, if any.
    fn reason_to_assign(&self, previous: &TeamState) -> Option<ReassignmentReason> {
        if previous.assignments.iter().any(|assignment| self.teammate(assignment.uav).is_none()) {
            Some(ReassignmentReason::UavLost)
        } else if previous.groups.iter().any(|group| self.group(group.id).is_none()) {
            Some(ReassignmentReason::GroupRetired)
        } else if self.groups.iter().any(|group| previous.group(group.id).is_none()) {
            Some(ReassignmentReason::GroupCreated)
        } else {
            let mut idle = self.teammates.iter().filter(|teammate| teammate.group.is_none());
            match idle.find(|teammate| !is_searching(&self.search_assignments, teammate.uav)) {
                Some(teammate) if is_searching(&previous.search_assignments, teammate.uav) => {
                    Some(ReassignmentReason::SearchEnded)
                }
                Some(_) => Some(ReassignmentReason::UavJoined),
                None => self.groups.iter().any(Group::has_changed).then_some(ReassignmentReason::GroupChanged),
            }
        }
    }

    /// Emits events for UAVs that left or joined the team, except for the first team.
    fn emit_uav_events(&mut self, previous: &TeamState) {
        self.had_team = previous.had_team || !self.teammates.is_empty();
        if self.teammates.iter().map(|teammate| teammate.uav).eq(previous.teammates.iter().map(|teammate| teammate.uav))
        {
            return;
        }
        let event = |kind, group, uav| Event { kind, track: None, group, to_group: None, uav: Some(uav) };
        for Teammate { uav, .. } in &previous.teammates {
            if self.teammate(*uav).is_none() {
                self.events.push(event(EventKind::UavTimeout, previous.assignment_of(*uav), *uav));
            }
        }
        for Teammate { uav, .. } in &self.teammates {
            if previous.had_team && previous.teammate(*uav).is_none() {
                self.events.push(event(EventKind::UavJoined, self.assignment_of(*uav), *uav));
            }
        }
    }

    /// Evaluates how the UAVs of each group follow its orbit; emits alerts for infeasible orbits and for UAVs that are
    /// too close.
    fn check_groups(&mut self, previous: &TeamState, params: &TeamParams, geofence: Option<&Geofence>) {
        let mut assigned_uavs = self.assignments.iter().peekable();
        for teammate in &mut self.teammates {
            // A kept assignment may contain UAVs that have left.
            while assigned_uavs.next_if(|assignment| assignment.uav < teammate.uav).is_some() {}
            teammate.group =
                assigned_uavs.next_if(|assignment| assignment.uav == teammate.uav).map(|assignment| assignment.group);
        }
        self.place_on_orbits(params);
        for group in &mut self.groups {
            let id = group.id;
            let assigned_uavs =
                self.teammates.iter().zip(&self.on_orbit).filter(|(teammate, _)| teammate.group == Some(id));
            let assigned_uavs = assigned_uavs.map(|(teammate, on_orbit)| (teammate.state.position, on_orbit));
            group.check(assigned_uavs, self.time - previous.time, params);
            let kinds = group.alarm(&params.group, geofence);
            self.events.extend(kinds.into_iter().flatten().map(|kind| Event::of_group(kind, id)));
        }
    }

    /// Computes the place of each UAV on its group's orbit.
    fn place_on_orbits(&mut self, params: &TeamParams) {
        let mut on_orbit = core::mem::take(&mut self.on_orbit);
        on_orbit.clear();
        if let Some(first) = self.groups.first() {
            let track_index = |teammate: &Teammate| {
                // The place of a searching UAV is not used.
                let group = teammate.group.and_then(|group| self.group(group)).unwrap_or(first);
                (teammate.state.position, group.orbit(params))
            };
            // In batches of two (SIMD); a single last UAV is processed twice.
            for pair in self.teammates.chunks(2) {
                let both =
                    OrbitRelativeState::each(&params.guidance, [&pair[0], &pair[pair.len() - 1]].map(track_index));
                on_orbit.extend(both.into_iter().take(pair.len()));
            }
        }
        self.on_orbit = on_orbit;
    }
}

/// Maximum position jump that is accepted as a correction by a UAV's navigation filter, m.
const JUMP_M: f64 = 100.0;

/// Plausible reports of a time step.
fn counting<'a>(row: &'a StepMessages, implausible: &'a [UavId]) -> impl Iterator<Item = &'a Report> + Clone {
    row.reports().iter().filter(|report| implausible.is_empty() || !implausible.contains(&report.uav))
}

fn is_ascending<T: PartialOrd>(ids: impl Iterator<Item = T>) -> bool {
    ids.is_sorted_by(|a, b| a < b)
}

fn is_searching(search_assignments: &[SearchAssignment], uav: UavId) -> bool {
    search_assignments.iter().any(|assignment| assignment.uav == uav)
}

impl Buffers {
    /// Measurements of a target without a live track, in the order of the UAVs.
    fn measured_of(&self, label: TargetLabel) -> impl Iterator<Item = (Position, RangeBearingMeasurement)> {
        let start = self.trackless.partition_point(|(other, ..)| *other < label);
        let of_one_target = self.trackless[start..].iter().take_while(move |(other, ..)| *other == label);
        of_one_target.map(|(_, from, measurement)| (*from, *measurement))
    }
}

/// Lowest altitude that no group uses. Ids ascend, so that existing groups precede new ones.
fn free_altitude_m(groups: &[Group], params: &TeamParams) -> f64 {
    let altitude_m = |step: usize| params.group.altitude_lowest_m + step as f64 * params.group.altitude_step_m;
    if params.group.altitude_policy == AltitudePolicy::Common {
        return altitude_m(0);
    }
    let is_free = |step: &usize| {
        groups.iter().all(|group| group.altitude_m < altitude_m(*step) || group.altitude_m > altitude_m(*step))
    };
    altitude_m((0..).find(is_free).unwrap_or_default())
}
