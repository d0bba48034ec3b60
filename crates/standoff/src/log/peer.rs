//! Who is there, and what each has heard.

use crate::message::{Ask, Held, Knowledge, Speaker};
use crate::uav::UavId;

/// Long before any instant.
pub(crate) const NEVER: i64 = i64::MIN / 2;

/// Whether a teammate is there.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Presence {
    /// Heard of this instant or the last one.
    Live,
    /// Not heard for a moment: it keeps its duty, and is carried on from where it was.
    Silent,
    /// Not heard for longer than the lease: the team goes on without it.
    Gone,
    /// It has said that it leaves.
    Left,
}

/// A UAV that was heard, or that others have heard.
#[derive(Debug, Clone)]
pub(crate) struct Peer {
    pub(crate) uav: UavId,
    /// The first instant of which it is known to have spoken, and the last.
    pub(crate) first: i64,
    pub(crate) newest: i64,
    /// It was heard itself, not only heard of.
    pub(crate) is_heard: bool,
    /// When it said that it leaves.
    pub(crate) left_at: Option<i64>,
    /// The instant of the report from which `knowledge` is.
    pub(crate) knows_at: i64,
    pub(crate) knowledge: Knowledge,
    /// What it has told to hold is what is held here, neither more nor less, as far as it could know.
    pub(crate) is_alike: bool,
    /// Its picture does not count until then: it was asked for, and not given.
    pub(crate) passed_over_until: i64,
}

impl Peer {
    pub(crate) fn new(uav: UavId, instant: i64) -> Self {
        let (first, newest, knows_at) = (instant, instant, NEVER);
        let (left_at, knowledge, passed_over_until) = (None, Knowledge::default(), NEVER);
        Self { uav, first, newest, is_heard: false, left_at, knows_at, knowledge, is_alike: false, passed_over_until }
    }

    /// It has spoken of an instant: if it had left, it is back.
    pub(crate) fn spoke(&mut self, instant: i64) {
        self.first = self.first.min(instant);
        self.newest = self.newest.max(instant);
        self.left_at = self.left_at.filter(|left_at| instant <= *left_at);
    }

    /// Its report of an instant was heard. That it left before it spoke again is over.
    pub(crate) fn hear(&mut self, instant: i64, leaves: bool) {
        self.is_heard = true;
        self.spoke(instant);
        if leaves && instant == self.newest {
            self.left_at = Some(instant);
        }
    }

    /// It is to report an instant.
    pub(crate) fn is_due(&self, instant: i64) -> bool {
        self.first <= instant && self.left_at.is_none_or(|left_at| instant <= left_at)
    }

    pub(crate) fn presence(&self, now: i64, lease: i64) -> Presence {
        match now - self.newest {
            _ if self.left_at.is_some() => Presence::Left,
            ..=1 => Presence::Live,
            ago if ago <= lease => Presence::Silent,
            _ => Presence::Gone,
        }
    }

    /// It is there, or was a moment ago, and has told what it knows.
    pub(crate) fn tells(&self, now: i64, lease: i64) -> bool {
        self.left_at.is_none() && now - lease <= self.knows_at
    }

    /// What it asks of a UAV.
    pub(crate) fn asks(&self, of: UavId) -> Option<Ask> {
        self.knowledge.asks.filter(|ask| ask.of == of)
    }

    /// What it has told to hold of a speaker.
    pub(crate) fn held(&self, speaker: Speaker) -> &[Held] {
        let held = &self.knowledge.held[..];
        let start = held.partition_point(|run| run.speaker < speaker);
        let length = held[start..].partition_point(|run| run.speaker == speaker);
        &held[start..start + length]
    }
}
