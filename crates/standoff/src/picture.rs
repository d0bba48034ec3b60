//! The team's picture at one instant: every known target, the groups and their orbits.
//!
//! A picture is a function of the picture before it and of what was said in between; whose agent computes it makes no
//! difference, not in a single bit.

use crate::coordination::event::{Event, EventKind};
use crate::coordination::group::{Group, GroupId};
use crate::coordination::membership::{self, Known};
use crate::estimation::track::{Look, Track, TrackStatus};
use crate::frame::Position;
use crate::inbox::Inbox;
use crate::target::{TargetId, Transition};
use crate::team::TeamParams;
use crate::time::Time;

/// The only group there is until targets are clustered into several.
const GROUP: GroupId = GroupId(0);

/// What a team knows and intends at one instant.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Picture {
    /// The instant.
    pub time: Time,
    /// Every known target, by ascending id.
    pub known: Vec<Known>,
    /// The groups, by ascending id.
    pub groups: Vec<Group>,
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
    looks: Vec<Look>,
    /// What changed in the last picture.
    pub(crate) events: Vec<Event>,
}

impl Picture {
    /// What is known of a target.
    pub fn find(&self, target: TargetId) -> Option<&Known> {
        self.place(target).ok().map(|index| &self.known[index])
    }

    fn place(&self, target: TargetId) -> Result<usize, usize> {
        self.known.binary_search_by_key(&target, |known| known.track.target)
    }

    /// Becomes the picture that follows `previous`, given the news; what changed goes into `scratch.events`.
    pub(crate) fn follow(&mut self, previous: &Picture, news: &News, params: &TeamParams, scratch: &mut Scratch) {
        scratch.events.clear();
        self.time = news.now;
        self.known.clear();
        self.known.extend_from_slice(&previous.known);
        self.take_cues(news, params, &mut scratch.events);
        self.advance_tracks(previous, news, params, scratch);
        self.start_unknown(news, params, scratch);
        membership::settle(&mut self.known, GROUP, &params.group, &mut scratch.events);
        self.form_groups(previous, news, params, &mut scratch.events);
    }

    fn take_cues(&mut self, news: &News, params: &TeamParams, events: &mut Vec<Event>) {
        for cue in news.inbox.cues() {
            let place = self.place(cue.target);
            let wanted = place.is_err() || place.is_ok_and(|index| self.known[index].track.is_lost());
            let Some(track) = Track::from_cue(cue, &params.track, news.now).filter(|_| wanted) else { continue };
            match place {
                Ok(index) => self.known[index] = Known::free(track),
                Err(index) => self.known.insert(index, Known::free(track)),
            }
            events.push(Event { kind: EventKind::Cued, target: Some(cue.target), group: None });
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
        for known in &mut self.known {
            let before = known.track;
            looks_at(before.target, news.inbox, &mut scratch.looks);
            // A track that a cue has just started is at this instant already.
            let was_alive = previous.find(before.target).is_some_and(|old| !old.track.is_lost());
            let step = if was_alive || before.is_lost() { news.transition } else { news.no_time };
            known.track = before.advance(step, &scratch.looks, should_be_seen, &params.track);
            let kind = match (before.status, known.track.status) {
                (TrackStatus::Lost(_), TrackStatus::Lost(_)) => continue,
                (TrackStatus::Lost(_), _) => EventKind::Reacquired,
                (_, TrackStatus::Lost(reason)) => EventKind::Lost(reason),
                (TrackStatus::Cued, TrackStatus::Held) => EventKind::Acquired,
                _ => continue,
            };
            scratch.events.push(Event { kind, target: Some(before.target), group: known.group() });
        }
    }

    /// Detections of targets that nobody handed over start tracks of their own.
    fn start_unknown(&mut self, news: &News, params: &TeamParams, scratch: &mut Scratch) {
        for detection in news.inbox.reports().flat_map(|report| &report.detections) {
            let Err(index) = self.place(detection.target) else { continue };
            looks_at(detection.target, news.inbox, &mut scratch.looks);
            let started = Track::from_looks(detection.target, &scratch.looks, &params.track);
            let Some(track) = started else { continue };
            self.known.insert(index, Known::free(track));
            let kind = EventKind::Acquired;
            scratch.events.push(Event { kind, target: Some(detection.target), group: None });
        }
    }

    fn form_groups(&mut self, previous: &Picture, news: &News, params: &TeamParams, events: &mut Vec<Event>) {
        self.groups.clear();
        let before = previous.groups.iter().find(|group| group.id == GROUP);
        let carried = before.map(|group| (group, previous.known.as_slice()));
        let Some(group) = Group::form(GROUP, &self.known, carried, news.transition, params) else { return };
        if group.is_feasible() != before.is_none_or(Group::is_feasible) {
            let kind = match group.is_feasible() {
                true => EventKind::OrbitFeasible,
                false => EventKind::OrbitInfeasible { smallest_m: group.smallest_m, largest_m: group.largest_m },
            };
            events.push(Event { kind, target: None, group: Some(GROUP) });
        }
        self.groups.push(group);
    }
}

/// Everything measured of one target at this instant, by ascending UAV.
fn looks_at(target: TargetId, inbox: &Inbox, looks: &mut Vec<Look>) {
    looks.clear();
    for report in inbox.reports() {
        let found = report.detections.binary_search_by_key(&target, |detection| detection.target);
        if let Ok(index) = found {
            looks.push(Look { uav: report.state.position, measurement: report.detections[index].measurement });
        }
    }
}
