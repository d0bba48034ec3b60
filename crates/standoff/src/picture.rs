//! The team's picture at one instant: every known target, the groups and their orbits.
//!
//! A picture is a function of the picture before it and of what was said in between; whose agent computes it makes no
//! difference, not in a single bit.

use crate::angle::Angle;
use crate::coordination::assignment::{AssignmentLaw, AvailableUav, Duty, Site, assign, sound};
use crate::coordination::event::{AssignmentReason, Event, EventKind};
use crate::coordination::group::Group;
use crate::coordination::memberships::{Known, Memberships, Roster};
use crate::coordination::search::{SearchDuty, Searching};
use crate::coordination::settling::{Agenda, Room, Settling};
use crate::coordination::teammate::Teammate;
use crate::digest::digest;
use crate::estimation::information_filter::Contribution;
use crate::estimation::track::{Track, TrackId, TrackStatus};
use crate::frame::Position;
use crate::group_id::GroupId;
use crate::guidance::airspace::Airspace;
use crate::guidance::heading::OnOrbit;
use crate::message::{Report, TargetLabel};
use crate::row::{Row, TARGETS_MAX, TEAM_MAX};
use crate::sensor::{RangeBearing, SensorParams};
use crate::target::Transition;
use crate::team::{Altitudes, GroupCount, GroupParams, Search, TeamParams};
use crate::time::{Duration, Time};
use crate::uav::UavId;

#[cfg(test)]
mod tests;

/// What a team knows and intends at one instant.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Picture {
    /// The instant.
    pub time: Time,
    /// The groups, by ascending id.
    pub groups: Vec<Group>,
    /// Who serves which group, by ascending UAV: every UAV heard of late that does not search, while there is anything
    /// to watch.
    pub crew: Vec<Duty>,
    /// Who searches for which lost target, by ascending UAV.
    pub searches: Vec<SearchDuty>,
    /// Number of targets that are known, not lost, and in no group.
    pub unassigned: u32,
    /// What changed at this instant.
    #[serde(skip)]
    pub events: Vec<Event>,
    /// Every UAV heard of late, ascending, and the group it serves.
    pub team: Vec<Teammate>,
    memberships: Memberships,
    /// Where each of the team is on its group's orbit; nobody is on one while there are no groups.
    #[serde(skip)]
    on_orbit: Vec<OnOrbit>,
    had_team: bool,
    agenda: Agenda,
    /// Reports of this instant that no UAV could have made, for it is not where it was before; and targets too many.
    #[serde(skip)]
    pub(crate) impossible: u32,
}

/// What came in between two pictures.
pub(crate) struct News<'a> {
    /// The instant of the new picture.
    pub(crate) now: Time,
    /// What was said.
    pub(crate) row: &'a Row,
    /// The target model over the time between.
    pub(crate) transition: &'a Transition,
    /// Who assigns in the place of the product, if somebody does.
    pub(crate) assignment: Option<&'a dyn AssignmentLaw>,
    /// Where UAVs may fly, where that is not everywhere.
    pub(crate) airspace: Option<&'a Airspace>,
    /// Groups and duties stay as they were; only what is known of targets and UAVs goes on.
    pub(crate) is_carried_on: bool,
}

/// Room that lives on, so that a step allocates nothing; what is in it means nothing once the step has ended.
#[derive(Debug, Clone, Default)]
pub(crate) struct Scratch {
    /// The sum of what was measured of each known target, by place.
    measured: Vec<Option<Contribution>>,
    /// What was measured of targets without a live track: label, position of the UAV, measurement; by label, then UAV.
    trackless: Vec<(TargetLabel, Position, RangeBearing)>,
    /// Who was in each group before that was settled.
    before: Roster,
    settling: Room,
    /// Whose report does not count; hardly ever anybody's.
    impossible: Vec<UavId>,
}

impl Picture {
    /// Every known target, by ascending track.
    pub fn known(&self) -> &[Known] {
        self.memberships.known()
    }

    /// The members of a group, those in dwell to or from it included.
    pub(crate) fn members_of(&self, group: GroupId) -> impl Iterator<Item = &Known> + Clone {
        self.memberships.of(group).map(|place| &self.known()[place])
    }

    /// What is known of a track.
    pub fn find(&self, track: TrackId) -> Option<&Known> {
        self.memberships.place(track).ok().map(|place| &self.known()[place])
    }

    /// What is known of a target that sensors call by a label.
    pub fn find_label(&self, label: TargetLabel) -> Option<&Known> {
        self.find(TrackId::of(label))
    }

    /// The group that a UAV serves.
    pub fn group_of(&self, uav: UavId) -> Option<&Group> {
        let duty = self.crew.binary_search_by_key(&uav, |duty| duty.uav).ok().map(|index| &self.crew[index])?;
        self.group(duty.group)
    }

    /// The lost track that a UAV searches for.
    pub fn searched_by(&self, uav: UavId) -> Option<&Track> {
        let duty = self.searches.binary_search_by_key(&uav, |duty| duty.uav).ok().map(|index| &self.searches[index])?;
        self.find(duty.track).map(|known| &known.track)
    }

    /// What the picture is, in one number: equal for two that will be followed by equal ones.
    pub fn digest(&self) -> u64 {
        digest(self)
    }

    /// Works out what is not told of a picture that came from elsewhere; `false` if it is none that could be followed: out of
    /// order, beyond its bounds, of times to come, or with numbers that are none.
    pub(crate) fn make_whole(&mut self, params: &TeamParams) -> bool {
        self.memberships.make_whole(self.time, Duration::from_s(params.group.dwell_max_s))
            && self.agenda.is_sound(self.time, params)
            && self.known().len() <= TARGETS_MAX
            && self.team.len() <= TEAM_MAX
            && is_ascending(self.groups.iter().map(|group| group.id.0))
            && self.groups.iter().map(|group| group.id).eq(self.memberships.groups().iter().copied())
            && self.groups.iter().all(Group::is_sound)
            && is_ascending(self.crew.iter().map(|duty| u64::from(duty.uav.0)))
            && self.crew.iter().all(|duty| self.group(duty.group).is_some())
            && is_ascending(self.searches.iter().map(|duty| u64::from(duty.uav.0)))
            && self.searches.iter().all(|duty| self.find(duty.track).is_some())
            && is_ascending(self.team.iter().map(|mate| u64::from(mate.uav.0)))
            && self.team.iter().all(|mate| mate.state.is_finite() && mate.said.is_sound() && mate.said_at <= self.time)
    }

    /// Who is in which group, or serves which, is another than in the picture before.
    pub(crate) fn is_rearranged_since(&self, previous: &Picture) -> bool {
        self.crew != previous.crew
            || self.searches != previous.searches
            || self.memberships.roster() != previous.memberships.roster()
    }

    /// The how many'th group it is that was founded, from 0: how records and people call it, where all hear everything.
    /// Of groups that are there, or were at the last instant.
    pub fn number(&self, group: GroupId) -> Option<u32> {
        self.memberships.number(group)
    }

    /// The group of that id.
    pub fn group(&self, id: GroupId) -> Option<&Group> {
        self.groups.binary_search_by_key(&id, |group| group.id).ok().map(|index| &self.groups[index])
    }

    /// Of the team, a UAV.
    pub fn teammate(&self, uav: UavId) -> Option<&Teammate> {
        self.team.binary_search_by_key(&uav, |mate| mate.uav).ok().map(|index| &self.team[index])
    }

    /// The UAVs of a group, and where they are on its orbit.
    pub(crate) fn on_orbit_of(&self, group: GroupId) -> impl Iterator<Item = (&Teammate, &OnOrbit)> + Clone {
        self.team.iter().zip(&self.on_orbit).filter(move |(mate, _)| mate.group == Some(group))
    }

    /// Becomes the picture that follows `previous`, given the news.
    pub(crate) fn follow(&mut self, previous: &Picture, news: &News, params: &TeamParams, scratch: &mut Scratch) {
        self.events.clear();
        (self.time, self.impossible) = (news.now, 0);
        self.memberships.copy(&previous.memberships);
        self.agenda = previous.agenda;
        // Step by step for all tracks: no target waits for another's numbers.
        self.memberships.tracks_mut().for_each(|track| track.predict(news.transition));
        // Where there is no room, lost ones make it.
        let is_full = self.known().len() >= TARGETS_MAX;
        let after_s = if is_full { 0.0 } else { params.track.forget_lost_s };
        self.memberships.forget_lost(Duration::from_s(after_s));
        self.take_cues(news, params);
        self.gather_team(previous, news, params, &mut scratch.impossible);
        self.measure(news.row, &params.track.sensor, scratch);
        self.update_tracks(previous, news, params, scratch);
        self.start_tracks(params, scratch);

        scratch.before.copy(self.memberships.roster());
        if !news.is_carried_on {
            Settling {
                now: news.now,
                memberships: &mut self.memberships,
                agenda: &mut self.agenda,
                previous: &previous.groups,
                team: &self.team,
                params,
                events: &mut self.events,
                room: &mut scratch.settling,
            }
            .settle();
        }
        self.unassigned = self.known().iter().filter(|known| known.is_unassigned()).count() as u32;
        self.form_groups(previous, news, params, &scratch.before);
        self.searches.clone_from(&previous.searches);
        if news.is_carried_on {
            self.crew.clear();
            self.carry_crew_on(previous);
        } else {
            self.settle_searches(params);
            self.assign_crew(previous, news, params);
        }
        self.tell_of_uavs(previous);
        self.judge_groups(previous, params, news.airspace);
    }

    fn take_cues(&mut self, news: &News, params: &TeamParams) {
        for cue in news.row.cues() {
            let is_wanted = self.find_label(cue.label).is_none_or(|known| known.track.is_lost());
            let Some(track) = Track::from_cue(cue, &params.track, news.now).filter(|_| is_wanted) else { continue };
            self.start(track, EventKind::Cued);
        }
    }

    /// What the measurements of this instant say of each known target, linearised about its predicted position and summed
    /// in the order of the UAVs; and what was measured of others.
    ///
    /// Implements the sums of Eq. (10), (11).
    fn measure(&self, row: &Row, sensor: &SensorParams, scratch: &mut Scratch) {
        let Scratch { measured, trackless, impossible, .. } = scratch;
        measured.clear();
        measured.resize(self.known().len(), None);
        trackless.clear();
        // By fours, which the processor works on side by side (SIMD).
        const NONE: RangeBearing = RangeBearing { range_m: 0.0, bearing: Angle::ZERO };
        let mut four = [(0, (Position::ORIGIN, &NONE, Position::ORIGIN)); 4];
        let mut n = 0;
        let mut sum = |four: &mut [(usize, (Position, &RangeBearing, Position)); 4], n: usize| {
            // Where there are fewer, the last one stands in.
            let last = four[n - 1];
            four[n..].fill(last);
            let contributions = Contribution::of_measurements(sensor, four.map(|(_, measurement)| measurement));
            for ((place, _), contribution) in four[..n].iter().zip(contributions) {
                *measured[*place].get_or_insert_default() += contribution;
            }
        };
        for report in counting(row, impossible) {
            let (from, mut next) = (report.state.position, 0);
            for detection in &report.detections {
                let id = TrackId::of(detection.label);
                // Most UAVs see one target after the other.
                let is_next = self.known().get(next).is_some_and(|known| known.track.id == id);
                let place = if is_next { Ok(next) } else { self.memberships.place(id) };
                match place.map(|place| (place, &self.known()[place])) {
                    Ok((place, known)) if !known.track.is_lost() => {
                        four[n] = (place, (from, &detection.measurement, known.position()));
                        n += 1;
                        if n == four.len() {
                            sum(&mut four, n);
                            n = 0;
                        }
                    }
                    _ => trackless.push((detection.label, from, detection.measurement)),
                }
                next = place.map_or(next, |place| place + 1);
            }
        }
        if n > 0 {
            sum(&mut four, n);
        }
        // Stable: the measurements of one target stay in the order of the UAVs.
        trackless.sort_by_key(|(label, ..)| *label);
    }

    /// Updates the predicted tracks, starts lost ones again, and tells what has become of them.
    fn update_tracks(&mut self, previous: &Picture, news: &News, params: &TeamParams, scratch: &Scratch) {
        let sensor = &params.track.sensor;
        let should_be_seen = |position: Position, clearance_m: f64| {
            counting(news.row, &scratch.impossible).any(|report| {
                report.boresight.is_some_and(|boresight| {
                    sensor.well_in_view(report.state.position, boresight, position, clearance_m)
                })
            })
        };
        // Who was known is known, unless forgotten, in the same order.
        let mut olds = previous.known().iter().map(|old| &old.track).peekable();
        for (place, measured) in scratch.measured.iter().enumerate() {
            let known = &self.known()[place];
            let (id, label, status) = (known.track.id, known.track.label, known.track.status);
            let (group, to) = (known.group(), known.receiving_group());
            while olds.next_if(|old| old.id < id).is_some() {}
            let old = olds.next_if(|old| old.id == id);
            let track = self.memberships.track_mut(place);
            if track.is_lost() {
                let again = Track::from_measurements(label, scratch.measured_of(label), &params.track);
                *track = again.unwrap_or(*track);
            } else {
                // A track that a cue has just started is at this instant already.
                let cued;
                let (before, dt) = match old.filter(|old| !old.is_lost()) {
                    Some(old) => (old, news.transition.dt),
                    None => {
                        cued = *track;
                        (&cued, Duration::ZERO)
                    }
                };
                track.update(before, measured.as_ref(), dt, should_be_seen, &params.track);
            }
            let kind = match (status, track.status) {
                (TrackStatus::Lost(_), TrackStatus::Lost(_)) => continue,
                (TrackStatus::Lost(_), _) => EventKind::Reacquired,
                (_, TrackStatus::Lost(reason)) => EventKind::Lost(reason),
                (TrackStatus::Cued, TrackStatus::Held) => EventKind::Acquired,
                _ => continue,
            };
            self.events.push(Event { to, ..Event::of_track(kind, id, group) });
        }
    }

    /// Measurements of targets that nobody handed over start tracks of their own.
    fn start_tracks(&mut self, params: &TeamParams, scratch: &Scratch) {
        for of_one in scratch.trackless.chunk_by(|a, b| a.0 == b.0) {
            let label = of_one[0].0;
            if self.find_label(label).is_none()
                && let Some(track) = Track::from_measurements(label, scratch.measured_of(label), &params.track)
            {
                self.start(track, EventKind::Acquired);
            }
        }
    }

    /// Keeps a track from now on, if there is room for it.
    fn start(&mut self, track: Track, kind: EventKind) {
        if self.known().len() >= TARGETS_MAX && self.find(track.id).is_none() {
            self.impossible += 1;
            return;
        }
        self.memberships.start(track);
        self.events.push(Event::of_track(kind, track.id, None));
    }

    /// The team: every UAV heard of late, and the group it served until now. The report of one that is where it could not
    /// have come to since it was heard last does not count: if it stays there, it is a new one once the other is forgotten.
    fn gather_team(&mut self, previous: &Picture, news: &News, params: &TeamParams, impossible: &mut Vec<UavId>) {
        impossible.clear();
        self.team.clear();
        let (lease, speed_m_s) = (params.lease(), 2.0 * params.uav.speed_max_m_s());
        let could_be_at = |mate: &Teammate, position: Position| {
            let reach_m = speed_m_s * (news.now - mate.said_at).s() + JUMP_M;
            position.squared_distance_m2(mate.said.position) <= reach_m * reach_m
        };
        let reports = news.row.reports();
        let mut room = TEAM_MAX - reports.len();
        let carry_on = |mates: &[Teammate], team: &mut Vec<Teammate>, room: &mut usize| {
            for mate in mates.iter().filter(|mate| mate.is_of_late(news.now, lease)).take(*room) {
                *room -= 1;
                team.push(mate.carried_on(news.now, params.radio));
            }
        };
        let mut mates = &previous.team[..];
        for report in reports {
            // Mostly nobody is silent.
            if mates.first().is_some_and(|mate| mate.uav < report.uav) {
                let (silent, others) = mates.split_at(mates.partition_point(|mate| mate.uav < report.uav));
                carry_on(silent, &mut self.team, &mut room);
                mates = others;
            }
            let of_it = mates.first().filter(|mate| mate.uav == report.uav);
            if of_it.is_some_and(|mate| mate.is_of_late(news.now, lease) && !could_be_at(mate, report.state.position)) {
                impossible.push(report.uav);
                room += 1;
                continue;
            }
            mates = &mates[usize::from(of_it.is_some())..];
            self.team.push(Teammate::heard(report, of_it.and_then(|mate| mate.group)));
        }
        carry_on(mates, &mut self.team, &mut room);
        self.impossible += impossible.len() as u32;
    }

    /// The id of the group that a UAV serves.
    pub(crate) fn duty_of(&self, uav: UavId) -> Option<GroupId> {
        self.crew.binary_search_by_key(&uav, |duty| duty.uav).ok().map(|index| self.crew[index].group)
    }

    fn form_groups(&mut self, previous: &Picture, news: &News, params: &TeamParams, before: &Roster) {
        self.groups.clear();
        for &id in self.memberships.groups() {
            let known = self.memberships.known();
            let Some(old) = previous.group(id) else {
                let altitude_m = free_altitude_m(&self.groups, params);
                let group = Group::found(id, known, self.memberships.of(id), params);
                self.groups.extend(group.map(|group| Group { altitude_m, ..group }));
                continue;
            };
            // In place, for a group is long.
            self.groups.extend_from_slice(core::slice::from_ref(old));
            let carried = self.groups.last_mut().and_then(|group| {
                group.carry_on(known, before.of(id), self.memberships.of(id), news.transition, params)
            });
            if carried.is_none() {
                self.groups.pop();
            }
        }
    }

    /// Who searches; the others serve groups.
    fn settle_searches(&mut self, params: &TeamParams) {
        if params.group.search == Search::Lost {
            let (memberships, team) = (&self.memberships, &mut self.team[..]);
            Searching { memberships, team, params, duties: &mut self.searches, events: &mut self.events }.settle();
        }
    }

    /// Carries the crew on; assigns it anew where groups or UAVs have come or gone.
    fn assign_crew(&mut self, previous: &Picture, news: &News, params: &TeamParams) {
        self.crew.clear();
        if self.groups.is_empty() {
            self.team.iter_mut().for_each(|mate| mate.group = None);
            return;
        }
        let reason = self.reason_to_assign(previous);
        if reason.is_none() && news.assignment.is_none() {
            return self.carry_crew_on(previous);
        }
        // What a UAV does counts, not what others have believed that it does.
        let serves = |mate: &Teammate| mate.does.filter(|group| self.group(*group).is_some()).or(mate.group);
        let available =
            |mate: &Teammate| AvailableUav { uav: mate.uav, position: mate.state.position, serves: serves(mate) };
        let at_hand = || self.team.iter().filter(|mate| !is_searching(&self.searches, mate.uav));
        let uavs: Vec<AvailableUav> = at_hand().map(available).collect();
        let positions = |id: GroupId| self.memberships.of(id).map(|place| self.known()[place].position());
        let members: Vec<(GroupId, Vec<Position>)> =
            self.groups.iter().map(|group| (group.id, positions(group.id).collect())).collect();
        let sites: Vec<_> = members.iter().map(|(group, members)| Site { group: *group, members }).collect();
        let GroupParams { objective, assignment_inertia, .. } = params.group;
        let wanted = news.assignment.and_then(|law| law.assign(self.time, &uavs, &sites));
        let reason = match (wanted, reason) {
            (Some(duties), _) => {
                self.crew = sound(duties, &uavs, &sites);
                AssignmentReason::OwnLaw
            }
            (None, Some(reason)) => {
                self.crew = assign(&uavs, &sites, &params.track.sensor, objective, assignment_inertia);
                reason
            }
            (None, None) => return self.carry_crew_on(previous),
        };
        for group in &mut self.groups {
            group.members_when_assigned = group.members;
        }
        for duty in &self.crew {
            let serves = uavs.iter().find(|uav| uav.uav == duty.uav).and_then(|uav| uav.serves);
            if let Some(old) = serves.filter(|old| *old != duty.group) {
                let crew = self.crew.iter().filter(|other| other.group == duty.group).count();
                let reason = if params.group.count == GroupCount::Needed { reason.by_need(crew) } else { reason };
                let event = Event::of_group(EventKind::Reassigned(reason), old);
                self.events.push(Event { to: Some(duty.group), uav: Some(duty.uav), ..event });
            }
        }
    }

    /// Who does not search serves whom it served.
    fn carry_crew_on(&mut self, previous: &Picture) {
        let Self { crew, searches, .. } = self;
        crew.extend(previous.crew.iter().filter(|duty| !is_searching(searches, duty.uav)));
    }

    /// Why UAVs are to be assigned anew, if they are.
    fn reason_to_assign(&self, previous: &Picture) -> Option<AssignmentReason> {
        if previous.crew.iter().any(|duty| self.teammate(duty.uav).is_none()) {
            Some(AssignmentReason::UavLost)
        } else if previous.groups.iter().any(|group| self.group(group.id).is_none()) {
            Some(AssignmentReason::GroupDissolved)
        } else if self.groups.iter().any(|group| previous.group(group.id).is_none()) {
            Some(AssignmentReason::GroupFounded)
        } else {
            let mut idle = self.team.iter().filter(|mate| mate.group.is_none());
            match idle.find(|mate| !is_searching(&self.searches, mate.uav)) {
                Some(mate) if is_searching(&previous.searches, mate.uav) => Some(AssignmentReason::SearchEnded),
                Some(_) => Some(AssignmentReason::UavJoined),
                None => self.groups.iter().any(Group::has_changed).then_some(AssignmentReason::GroupChanged),
            }
        }
    }

    /// Who has left the team, and who has come to it; the first team is no news.
    fn tell_of_uavs(&mut self, previous: &Picture) {
        self.had_team = previous.had_team || !self.team.is_empty();
        if self.team.iter().map(|mate| mate.uav).eq(previous.team.iter().map(|mate| mate.uav)) {
            return;
        }
        let event = |kind, group, uav| Event { kind, track: None, group, to: None, uav: Some(uav) };
        for Teammate { uav, .. } in &previous.team {
            if self.teammate(*uav).is_none() {
                self.events.push(event(EventKind::UavLost, previous.duty_of(*uav), *uav));
            }
        }
        for Teammate { uav, .. } in &self.team {
            if previous.had_team && previous.teammate(*uav).is_none() {
                self.events.push(event(EventKind::UavJoined, self.duty_of(*uav), *uav));
            }
        }
    }

    /// How the groups' UAVs follow their orbits; tells of orbits that cannot be flown and of UAVs too close.
    fn judge_groups(&mut self, previous: &Picture, params: &TeamParams, airspace: Option<&Airspace>) {
        let mut crew = self.crew.iter().peekable();
        for mate in &mut self.team {
            // A crew that is carried on may name who is gone.
            while crew.next_if(|duty| duty.uav < mate.uav).is_some() {}
            mate.group = crew.next_if(|duty| duty.uav == mate.uav).map(|duty| duty.group);
        }
        self.place_on_orbits(params);
        for group in &mut self.groups {
            let id = group.id;
            let crew = self.team.iter().zip(&self.on_orbit).filter(|(mate, _)| mate.group == Some(id));
            let crew = crew.map(|(mate, on_orbit)| (mate.state.position, on_orbit));
            group.judge(crew, self.time - previous.time, params);
            let kinds = group.alarm(&params.group, airspace);
            self.events.extend(kinds.into_iter().flatten().map(|kind| Event::of_group(kind, id)));
        }
    }

    /// Where each UAV of the team is on its group's orbit.
    fn place_on_orbits(&mut self, params: &TeamParams) {
        let mut on_orbit = core::mem::take(&mut self.on_orbit);
        on_orbit.clear();
        if let Some(first) = self.groups.first() {
            let place = |mate: &Teammate| {
                // Who searches is on no orbit; nobody asks where.
                let group = mate.group.and_then(|group| self.group(group)).unwrap_or(first);
                (mate.state.position, group.orbit(params))
            };
            // By twos, which the processor works on side by side (SIMD); a last one alone beside itself.
            for pair in self.team.chunks(2) {
                let both = OnOrbit::each(&params.guidance, [&pair[0], &pair[pair.len() - 1]].map(place));
                on_orbit.extend(both.into_iter().take(pair.len()));
            }
        }
        self.on_orbit = on_orbit;
    }
}

/// A UAV that says it has jumped by less than this, m, has: its navigation filter has found itself.
const JUMP_M: f64 = 100.0;

/// The reports of a row that count.
fn counting<'a>(row: &'a Row, impossible: &'a [UavId]) -> impl Iterator<Item = &'a Report> + Clone {
    row.reports().iter().filter(|report| impossible.is_empty() || !impossible.contains(&report.uav))
}

fn is_ascending<T: PartialOrd>(ids: impl Iterator<Item = T>) -> bool {
    ids.is_sorted_by(|a, b| a < b)
}

fn is_searching(searches: &[SearchDuty], uav: UavId) -> bool {
    searches.iter().any(|duty| duty.uav == uav)
}

impl Scratch {
    /// The measurements of a target without a live track, in the order of the UAVs.
    fn measured_of(&self, label: TargetLabel) -> impl Iterator<Item = (Position, RangeBearing)> {
        let start = self.trackless.partition_point(|(other, ..)| *other < label);
        let of_one = self.trackless[start..].iter().take_while(move |(other, ..)| *other == label);
        of_one.map(|(_, from, measurement)| (*from, *measurement))
    }
}

/// The lowest altitude that no group has. Ids ascend, so groups that go on are there before new ones.
fn free_altitude_m(groups: &[Group], params: &TeamParams) -> f64 {
    let altitude_m = |step: usize| params.group.altitude_lowest_m + step as f64 * params.group.altitude_step_m;
    if params.group.altitudes == Altitudes::One {
        return altitude_m(0);
    }
    let is_free = |step: &usize| {
        groups.iter().all(|group| group.altitude_m < altitude_m(*step) || group.altitude_m > altitude_m(*step))
    };
    altitude_m((0..).find(is_free).unwrap_or_default())
}
