//! The team's picture at one instant: every known target, the groups and their orbits.
//!
//! A picture is a function of the picture before it and of what was said in between; whose agent computes it makes no
//! difference, not in a single bit.

use crate::coordination::Roster;
use crate::coordination::assignment::{Duty, Hand, Site, assign};
use crate::coordination::event::{AssignmentReason, Event, EventKind};
use crate::coordination::group::{Group, GroupId};
use crate::coordination::membership::{Buffers, Known, OnDuty, Settling};
use crate::estimation::information_filter::Contribution;
use crate::estimation::track::{Look, Track, TrackStatus};
use crate::frame::Position;
use crate::guidance::heading::OnOrbit;
use crate::inbox::Inbox;
use crate::sensor::SensorParams;
use crate::target::{TargetId, Transition};
use crate::team::TeamParams;
use crate::time::{Duration, Time};
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
}

/// Buffers that live on, so that a step allocates nothing.
#[derive(Debug, Clone, Default)]
pub(crate) struct Scratch {
    /// Everything measured at this instant of targets with a track, by UAV then target.
    sightings: Vec<Sighting>,
    /// What that says, by the places of the known targets.
    told: Vec<Told>,
    /// Everything measured of targets without a track, by UAV then target.
    strangers: Vec<(TargetId, Look)>,
    /// All looks at one target.
    looks: Vec<Look>,
    /// The team now, and whom each serves.
    pub(crate) on_duty: Vec<OnDuty>,
    /// Where each of them is on its group's orbit; nobody is on one while there are no groups.
    pub(crate) on_orbit: Vec<OnOrbit>,
    /// Who belonged where at the last instant, as places of now.
    roster_before: Roster,
    buffers: Buffers,
    /// What changed in the last picture.
    pub(crate) events: Vec<Event>,
}

/// A look at the known target in a place.
#[derive(Debug, Clone, Copy)]
struct Sighting {
    place: usize,
    look: Look,
}

/// What all looks at a target say, and how many they are.
#[derive(Debug, Clone, Copy, Default)]
struct Told {
    contribution: Contribution,
    looks: usize,
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
        // Step by step for all tracks: no target waits for another's numbers.
        self.known.iter_mut().for_each(|known| known.track.predict(news.transition));
        self.take_cues(news, params, &mut scratch.events);
        self.gather_sightings(news.inbox, scratch);
        self.linearise(&params.track.sensor, scratch);
        self.conclude_tracks(previous, news, params, scratch);
        self.start_strangers(params, scratch);

        gather_team(previous, news, &mut scratch.on_duty);
        scratch.buffers.roster.fill(&self.known);
        scratch.roster_before.copy(&scratch.buffers.roster);
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

    /// Everything measured at this instant, by the place of its target.
    fn gather_sightings(&self, inbox: &Inbox, scratch: &mut Scratch) {
        let Scratch { sightings, strangers, .. } = scratch;
        sightings.clear();
        strangers.clear();
        for report in inbox.reports() {
            let mut next = 0;
            for detection in &report.detections {
                let look = Look { uav: report.state.position, measurement: detection.measurement };
                // Most UAVs see one target after the other.
                let is_next = self.known.get(next).is_some_and(|known| known.track.target == detection.target);
                match if is_next { Ok(next) } else { self.place(detection.target) } {
                    Ok(place) => {
                        sightings.push(Sighting { place, look });
                        next = place + 1;
                    }
                    Err(_) => strangers.push((detection.target, look)),
                }
            }
        }
    }

    /// What the sightings say, linearised about the predictions, summed for each target in the order of the UAVs.
    ///
    /// Implements the sums of Eq. (10), (11).
    fn linearise(&self, sensor: &SensorParams, scratch: &mut Scratch) {
        let Scratch { sightings, told, .. } = scratch;
        told.clear();
        told.resize(self.known.len(), Told::default());
        // By fours, which are worked on side by side; where there are fewer, the last one stands in.
        for four in sightings.chunks(4) {
            let measurements: [_; 4] = core::array::from_fn(|i| {
                let Sighting { place, look } = &four[i.min(four.len() - 1)];
                (look.uav, &look.measurement, self.known[*place].track.estimate().state.position())
            });
            for (sighting, contribution) in four.iter().zip(Contribution::of_measurements(sensor, measurements)) {
                let told = &mut told[sighting.place];
                told.contribution += contribution;
                told.looks += 1;
            }
        }
    }

    /// Updates the predicted tracks, starts lost ones again, and tells what has become of them.
    fn conclude_tracks(&mut self, previous: &Picture, news: &News, params: &TeamParams, scratch: &mut Scratch) {
        let sensor = &params.track.sensor;
        let should_be_seen = |position: Position, clearance_m: f64| {
            news.inbox.reports().any(|report| {
                report.boresight.is_some_and(|boresight| {
                    sensor.well_in_view(report.state.position, boresight, position, clearance_m)
                })
            })
        };
        let Scratch { sightings, told, looks, events, .. } = scratch;
        // Who was known is known, in the same order.
        let mut olds = previous.known.iter().map(|old| &old.track).peekable();
        for (place, (known, told)) in self.known.iter_mut().zip(told).enumerate() {
            let (target, status) = (known.track.target, known.track.status);
            let old = olds.next_if(|old| old.target == target);
            let cued;
            if !known.track.is_lost() {
                let (before, dt) = match old.filter(|old| !old.is_lost()) {
                    Some(old) => (old, news.transition.dt),
                    // A track that a cue has just started is at this instant already.
                    None => {
                        cued = known.track;
                        (&cued, Duration::ZERO)
                    }
                };
                let told = (told.looks > 0).then_some(&told.contribution);
                known.track.conclude(before, told, dt, should_be_seen, &params.track);
            } else if told.looks > 0 {
                looks.clear();
                looks.extend(sightings.iter().filter(|sighting| sighting.place == place).map(|sighting| sighting.look));
                known.track = Track::from_looks(target, looks, &params.track).unwrap_or(known.track);
            }
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
    fn start_strangers(&mut self, params: &TeamParams, scratch: &mut Scratch) {
        let Scratch { strangers, looks, events, .. } = scratch;
        // Stable: the looks at one target stay in the order of the UAVs.
        strangers.sort_by_key(|(target, _)| *target);
        for own in strangers.chunk_by(|a, b| a.0 == b.0) {
            let target = own[0].0;
            looks.clear();
            looks.extend(own.iter().map(|(_, look)| *look));
            let (Some(track), Err(place)) = (Track::from_looks(target, looks, &params.track), self.place(target))
            else {
                continue;
            };
            self.known.insert(place, Known::unassigned(track));
            events.push(Event::of_target(EventKind::Acquired, target, None));
        }
    }

    fn form_groups(&mut self, previous: &Picture, news: &News, params: &TeamParams, scratch: &Scratch) {
        self.groups.clear();
        let (now, before) = (&scratch.buffers.roster, &scratch.roster_before);
        for id in now.groups() {
            let Some(old) = previous.group(id) else {
                let Some(group) = Group::found(id, &self.known, now.of(id), params) else { continue };
                let altitude_m = self.free_altitude_m(params);
                self.groups.push(Group { altitude_m, ..group });
                continue;
            };
            // In place, for a group is long.
            self.groups.extend_from_slice(core::slice::from_ref(old));
            let carried = self
                .groups
                .last_mut()
                .and_then(|group| group.carry_on(&self.known, before.of(id), now.of(id), news.transition, params));
            if carried.is_none() {
                self.groups.pop();
            }
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
        self.had_team = previous.had_team || !self.team.is_empty();
        if self.team == previous.team {
            return;
        }
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
    }

    /// How the groups' UAVs follow their orbits; tells of orbits that cannot be flown and of UAVs too close.
    fn judge_groups(&mut self, previous: &Picture, params: &TeamParams, scratch: &mut Scratch) {
        for (on_duty, duty) in scratch.on_duty.iter_mut().zip(&self.crew) {
            on_duty.group = Some(duty.group);
        }
        self.place_on_orbits(params, scratch);
        for group in &mut self.groups {
            let id = group.id;
            let crew = scratch.on_duty.iter().zip(&scratch.on_orbit).filter(|(on_duty, _)| on_duty.group == Some(id));
            let crew = crew.map(|(on_duty, on_orbit)| (on_duty.state.position, on_orbit));
            group.judge(crew, self.time - previous.time, params);
            let kinds = group.alarm(&params.group);
            scratch.events.extend(kinds.into_iter().flatten().map(|kind| Event::of_group(kind, group.id)));
        }
    }

    /// Where each UAV of the crew is on its group's orbit.
    fn place_on_orbits(&self, params: &TeamParams, scratch: &mut Scratch) {
        let Scratch { on_duty, on_orbit, .. } = scratch;
        on_orbit.clear();
        let Some(first) = self.groups.first() else { return };
        let place = |on_duty: &OnDuty| {
            // While there are groups, everybody serves one.
            let group = on_duty.group.and_then(|group| self.group(group)).unwrap_or(first);
            (on_duty.state.position, group.orbit(params))
        };
        // By twos, which are worked on side by side; a last one alone beside itself.
        for pair in on_duty.chunks(2) {
            let both = OnOrbit::each(&params.guidance, [&pair[0], &pair[pair.len() - 1]].map(place));
            on_orbit.extend(both.into_iter().take(pair.len()));
        }
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
