//! The team's picture at one instant: every known target, the groups and their orbits.
//!
//! A picture is a function of the picture before it and of what was said in between; whose agent computes it makes no
//! difference, not in a single bit.

use crate::angle::Angle;
use crate::coordination::Roster;
use crate::coordination::assignment::{Duty, Hand, Site, assign};
use crate::coordination::event::{AssignmentReason, Event, EventKind};
use crate::coordination::group::{Before, Group, GroupId};
use crate::coordination::membership::{Buffers, Known, OnDuty, Settling};
use crate::estimation::track::{Look, Track, TrackStatus};
use crate::frame::{Displacement, Position};
use crate::inbox::Inbox;
use crate::target::{TargetId, Transition};
use crate::team::TeamParams;
use crate::time::Time;
use crate::uav::UavId;

/// What a team knows and intends at one instant.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Picture {
    /// The instant.
    pub time: Time,
    /// Every known target, by ascending id.
    pub known: Vec<Known>,
    /// The groups, by ascending id.
    pub groups: Vec<Group>,
    /// Who serves which group, by ascending UAV: every UAV heard of late, while there is anything to watch.
    pub crew: Vec<Duty>,
    /// Number of targets that are known, not lost, and in no group.
    pub unassigned: u32,
    /// Every UAV heard of late, ascending.
    team: Vec<UavId>,
    had_team: bool,
    /// The id of the next group that is founded.
    next_group: u32,
    /// When it is next asked whether UAVs could watch more elsewhere.
    next_review: Time,
}

/// What came in between two pictures.
pub(crate) struct News<'a> {
    /// The instant of the new picture.
    pub(crate) now: Time,
    /// What was said.
    pub(crate) inbox: &'a Inbox,
    /// The target model over the time between.
    pub(crate) transition: &'a Transition,
    /// The target model over no time at all.
    pub(crate) no_time: &'a Transition,
}

/// Buffers that live on, so that a step allocates nothing.
#[derive(Debug, Clone, Default)]
pub(crate) struct Scratch {
    /// Everything measured at this instant, by target then UAV.
    sightings: Vec<Sighting>,
    /// How many of them are of targets without a track.
    unknown: usize,
    /// The sightings' looks, in the same order.
    looks: Vec<Look>,
    /// The team now, and whom each serves.
    pub(crate) on_duty: Vec<OnDuty>,
    /// The direction from its group's centre to each of them; of no meaning for who serves none.
    pub(crate) phases: Vec<Angle>,
    /// Who belonged where at the last instant, as places of now.
    roster_before: Roster,
    buffers: Buffers,
    /// What changed in the last picture.
    pub(crate) events: Vec<Event>,
}

#[derive(Debug, Clone, Copy)]
struct Sighting {
    target: TargetId,
    uav: UavId,
    look: Look,
}

impl Picture {
    /// What is known of a target.
    pub fn find(&self, target: TargetId) -> Option<&Known> {
        self.place(target).ok().map(|index| &self.known[index])
    }

    fn place(&self, target: TargetId) -> Result<usize, usize> {
        self.known.binary_search_by_key(&target, |known| known.track.target)
    }

    /// The group that a UAV serves.
    pub fn group_of(&self, uav: UavId) -> Option<&Group> {
        let duty = self.crew.binary_search_by_key(&uav, |duty| duty.uav).ok().map(|index| &self.crew[index])?;
        self.group(duty.group)
    }

    /// The group of that id.
    pub fn group(&self, id: GroupId) -> Option<&Group> {
        self.groups.binary_search_by_key(&id, |group| group.id).ok().map(|index| &self.groups[index])
    }

    /// Becomes the picture that follows `previous`, given the news; what changed goes into `scratch.events`.
    pub(crate) fn follow(&mut self, previous: &Picture, news: &News, params: &TeamParams, scratch: &mut Scratch) {
        scratch.events.clear();
        self.time = news.now;
        self.known.clear();
        self.known.extend_from_slice(&previous.known);
        (self.next_group, self.next_review) = (previous.next_group, previous.next_review);
        gather_sightings(news.inbox, &mut scratch.sightings);
        scratch.looks.clear();
        scratch.looks.extend(scratch.sightings.iter().map(|sighting| sighting.look));
        self.take_cues(news, params, &mut scratch.events);
        self.advance_tracks(previous, news, params, scratch);
        self.start_unknown(params, scratch);

        gather_team(previous, news, &mut scratch.on_duty);
        scratch.roster_before.fill(&self.known);
        Settling {
            now: news.now,
            known: &mut self.known,
            previous: &previous.groups,
            on_duty: &scratch.on_duty,
            params,
            next_group: &mut self.next_group,
            next_review: &mut self.next_review,
            events: &mut scratch.events,
            buffers: &mut scratch.buffers,
        }
        .settle();
        self.unassigned = self.known.iter().filter(|known| known.is_outside()).count() as u32;
        self.form_groups(previous, news, params, scratch);
        self.assign_crew(previous, params, scratch);
        self.tell_of_uavs(previous, scratch);
        self.judge_groups(previous, params, scratch);
    }

    fn take_cues(&mut self, news: &News, params: &TeamParams, events: &mut Vec<Event>) {
        for cue in news.inbox.cues() {
            let place = self.place(cue.target);
            let wanted = place.is_err() || place.is_ok_and(|index| self.known[index].track.is_lost());
            let Some(track) = Track::from_cue(cue, &params.track, news.now).filter(|_| wanted) else { continue };
            match place {
                Ok(index) => self.known[index] = Known::unassigned(track),
                Err(index) => self.known.insert(index, Known::unassigned(track)),
            }
            events.push(Event::of_target(EventKind::Cued, cue.target, None));
        }
    }

    fn advance_tracks(&mut self, previous: &Picture, news: &News, params: &TeamParams, scratch: &mut Scratch) {
        let sensor = &params.track.sensor;
        let should_be_seen = |position: Position, clearance_m: f64| {
            news.inbox.reports().any(|report| {
                report.boresight.is_some_and(|boresight| {
                    sensor.well_in_view(report.state.position, boresight, position, clearance_m)
                })
            })
        };
        // Targets, sightings and the targets before come in the same order: walked side by side.
        let Scratch { sightings, looks, unknown, events, .. } = scratch;
        let (mut sighted, mut olds) = (Sighted { sightings, looks }, previous.known.as_slice());
        *unknown = sightings.len();
        for known in &mut self.known {
            let (target, status) = (known.track.target, known.track.status);
            let looks = sighted.take(target);
            *unknown -= looks.len();
            olds = &olds[olds.iter().take_while(|old| old.track.target < target).count()..];
            // A track that a cue has just started is at this instant already.
            let old = olds.first().filter(|old| old.track.target == target);
            let was_alive = old.is_some_and(|old| !old.track.is_lost());
            let step = if was_alive || known.track.is_lost() { news.transition } else { news.no_time };
            known.track.advance(step, looks, should_be_seen, &params.track);
            let kind = match (status, known.track.status) {
                (TrackStatus::Lost(_), TrackStatus::Lost(_)) => continue,
                (TrackStatus::Lost(_), _) => EventKind::Reacquired,
                (_, TrackStatus::Lost(reason)) => EventKind::Lost(reason),
                (TrackStatus::Cued, TrackStatus::Held) => EventKind::Acquired,
                _ => continue,
            };
            let event = Event::of_target(kind, target, known.group());
            events.push(Event { to: known.receiving_group(), ..event });
        }
    }

    /// Detections of targets that nobody handed over start tracks of their own.
    fn start_unknown(&mut self, params: &TeamParams, scratch: &mut Scratch) {
        let Scratch { sightings, looks, unknown, events, .. } = scratch;
        if *unknown == 0 {
            return;
        }
        let (mut sighted, mut index) = (Sighted { sightings, looks }, 0);
        while let Some(Sighting { target, .. }) = sighted.sightings.first().copied() {
            let looks = sighted.take(target);
            let later = self.known[index..].iter();
            index += later.take_while(|known| known.track.target < target).count();
            if self.known.get(index).is_some_and(|known| known.track.target == target) {
                continue;
            }
            let Some(track) = Track::from_looks(target, looks, &params.track) else { continue };
            self.known.insert(index, Known::unassigned(track));
            events.push(Event::of_target(EventKind::Acquired, target, None));
        }
    }

    fn form_groups(&mut self, previous: &Picture, news: &News, params: &TeamParams, scratch: &Scratch) {
        self.groups.clear();
        let (now, before) = (&scratch.buffers.roster, &scratch.roster_before);
        for id in now.groups() {
            let old = previous.group(id).map(|group| Before { group, members: before.of(id) });
            let is_new = old.is_none();
            let Some(mut group) = Group::form(id, &self.known, now.of(id), old, news.transition, params) else {
                continue;
            };
            if is_new {
                group.altitude_m = self.free_altitude_m(params);
            }
            self.groups.push(group);
        }
    }

    /// The lowest altitude that no group has. Ids ascend, so groups that go on are there before new ones.
    fn free_altitude_m(&self, params: &TeamParams) -> f64 {
        let altitude_m = |step: usize| params.group.altitude_lowest_m + step as f64 * params.group.altitude_step_m;
        let is_free = |step: &usize| {
            self.groups.iter().all(|group| group.altitude_m < altitude_m(*step) || group.altitude_m > altitude_m(*step))
        };
        altitude_m((0..).find(is_free).unwrap_or_default())
    }

    /// Carries the crew on; assigns it anew where groups or UAVs have come or gone.
    fn assign_crew(&mut self, previous: &Picture, params: &TeamParams, scratch: &mut Scratch) {
        self.crew.clear();
        if self.groups.is_empty() {
            return;
        }
        let is_new = |group: &Group| previous.group(group.id).is_none();
        let has_ended = |group: &Group| self.group(group.id).is_none();
        let is_silent = |duty: &Duty| scratch.on_duty.binary_search_by_key(&duty.uav, |on_duty| on_duty.uav).is_err();
        let reason = if previous.crew.iter().any(is_silent) {
            AssignmentReason::UavLost
        } else if previous.groups.iter().any(has_ended) {
            AssignmentReason::GroupDissolved
        } else if self.groups.iter().any(is_new) {
            AssignmentReason::GroupFounded
        } else if scratch.on_duty.iter().any(|on_duty| on_duty.group.is_none()) {
            AssignmentReason::UavJoined
        } else if self.groups.iter().any(Group::has_changed) {
            AssignmentReason::GroupChanged
        } else {
            self.crew.extend_from_slice(&previous.crew);
            return;
        };
        let hand =
            |on_duty: &OnDuty| Hand { uav: on_duty.uav, position: on_duty.state.position, serves: on_duty.group };
        let uavs: Vec<Hand> = scratch.on_duty.iter().map(hand).collect();
        let positions = |id: GroupId| {
            scratch.buffers.roster.of(id).map(|index| self.known[index].track.estimate().state.position())
        };
        let members: Vec<(GroupId, Vec<Position>)> =
            self.groups.iter().map(|group| (group.id, positions(group.id).collect())).collect();
        let sites: Vec<_> = members.iter().map(|(group, members)| Site { group: *group, members }).collect();
        self.crew = assign(&uavs, &sites, &params.track.sensor, params.group.objective);
        for group in &mut self.groups {
            group.members_when_assigned = group.members;
        }
        for (duty, on_duty) in self.crew.iter().zip(&scratch.on_duty) {
            if let Some(old) = on_duty.group.filter(|old| *old != duty.group) {
                let event = Event::of_group(EventKind::Reassigned(reason), old);
                scratch.events.push(Event { to: Some(duty.group), uav: Some(duty.uav), ..event });
            }
        }
    }

    /// Who has left the team, and who has come to it; the first team is no news.
    fn tell_of_uavs(&mut self, previous: &Picture, scratch: &mut Scratch) {
        let Scratch { on_duty, events, .. } = scratch;
        self.team.clear();
        self.team.extend(on_duty.iter().map(|on_duty| on_duty.uav));
        let group_of = |crew: &[Duty], uav: UavId| {
            crew.binary_search_by_key(&uav, |duty| duty.uav).ok().map(|index| crew[index].group)
        };
        let told = |kind, group, uav| Event { kind, target: None, group, to: None, uav: Some(uav) };
        for uav in previous.team.iter().filter(|uav| self.team.binary_search(uav).is_err()) {
            events.push(told(EventKind::UavLost, group_of(&previous.crew, *uav), *uav));
        }
        for uav in self.team.iter().filter(|uav| previous.had_team && previous.team.binary_search(uav).is_err()) {
            events.push(told(EventKind::UavJoined, group_of(&self.crew, *uav), *uav));
        }
        self.had_team = previous.had_team || !self.team.is_empty();
    }

    /// How the groups' UAVs follow their orbits; tells of orbits that cannot be flown and of UAVs too close.
    fn judge_groups(&mut self, previous: &Picture, params: &TeamParams, scratch: &mut Scratch) {
        for (on_duty, duty) in scratch.on_duty.iter_mut().zip(&self.crew) {
            on_duty.group = Some(duty.group);
        }
        self.find_phases(scratch);
        for group in &mut self.groups {
            let id = group.id;
            let crew = scratch.on_duty.iter().filter(|on_duty| on_duty.group == Some(id)).copied();
            group.judge(crew, self.time - previous.time, params);
            let kinds = group.alarm(&params.group);
            scratch.events.extend(kinds.into_iter().flatten().map(|kind| Event::of_group(kind, group.id)));
        }
    }

    /// Where about its group each UAV of the crew is.
    fn find_phases(&self, scratch: &mut Scratch) {
        let from_centre = |on_duty: &OnDuty| {
            let group = on_duty.group.and_then(|group| self.group(group));
            let centre = group.map_or(Position::ORIGIN, |group| group.centre.estimate().state.position());
            on_duty.state.position - centre
        };
        scratch.phases.clear();
        // By twos, which are worked on side by side; a last one alone beside itself.
        for pair in scratch.on_duty.chunks(2) {
            let both = [&pair[0], &pair[pair.len() - 1]].map(from_centre);
            scratch.phases.extend(Displacement::direction_each(both).into_iter().take(pair.len()));
        }
    }
}

/// Everything measured at this instant, by target then UAV.
fn gather_sightings(inbox: &Inbox, sightings: &mut Vec<Sighting>) {
    sightings.clear();
    for report in inbox.reports() {
        sightings.extend(report.detections.iter().map(|detection| Sighting {
            target: detection.target,
            uav: report.uav,
            look: Look { uav: report.state.position, measurement: detection.measurement },
        }));
    }
    let key = |sighting: &Sighting| (sighting.target, sighting.uav);
    if !sightings.is_sorted_by_key(key) {
        sightings.sort_unstable_by_key(key);
    }
}

/// What was measured, target after target.
struct Sighted<'a> {
    sightings: &'a [Sighting],
    looks: &'a [Look],
}

impl<'a> Sighted<'a> {
    /// Everything measured of one target at this instant, by ascending UAV. Leaves those of later targets.
    fn take(&mut self, target: TargetId) -> &'a [Look] {
        let earlier = self.sightings.iter().take_while(|sighting| sighting.target < target).count();
        let own = self.sightings[earlier..].iter().take_while(|sighting| sighting.target == target).count();
        self.sightings = &self.sightings[earlier + own..];
        let (taken, later) = self.looks.split_at(earlier + own);
        self.looks = later;
        &taken[earlier..]
    }
}

/// The team: every UAV heard of late, and the group it served until now.
fn gather_team(previous: &Picture, news: &News, on_duty: &mut Vec<OnDuty>) {
    on_duty.clear();
    on_duty.extend(news.inbox.teammates(news.now).map(|mate| {
        let duty = previous.crew.binary_search_by_key(&mate.uav, |duty| duty.uav).ok();
        OnDuty {
            uav: mate.uav,
            group: duty.map(|index| previous.crew[index].group),
            state: mate.state,
            boresight: mate.boresight,
        }
    }));
}
