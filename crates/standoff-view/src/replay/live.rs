//! A replay that grows while pages follow it.

use std::collections::hash_map::RandomState;
use std::hash::BuildHasher;
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::chunk::gzip;
use super::encoder::Part;
use super::header::Head;
use crate::serve::{Answer, Bytes, Feed};

const JSON: &str = "application/json";
const BYTES: &str = "application/octet-stream";

/// A replay that one thread extends and any number of pages follow. The writing thread never waits for pages.
#[derive(Debug)]
pub struct Replay {
    held: Mutex<Held>,
    feed: Feed,
}

#[derive(Debug)]
struct Held {
    head: Bytes,
    map: Option<Bytes>,
    /// Parts that are complete.
    sealed: Vec<Part>,
    /// Current state of the part that is being filled, and its number of time steps.
    open: Option<(Part, usize)>,
    /// True if the run has ended.
    done: bool,
    /// Random number that identifies this replay, so that a page notices if another one is served.
    run: u64,
}

impl Replay {
    /// Makes a replay with a head and without parts.
    pub fn new(head: &Head) -> serde_json::Result<Self> {
        let map = head.map.clone();
        let head = gzip(head.json()?.as_bytes()).into();
        // A random number differs between processes and between replays.
        let run = RandomState::new().hash_one(0);
        let held = Held { head, map, sealed: Vec::new(), open: None, done: false, run };
        Ok(Self { feed: Feed::new(held.state()), held: Mutex::new(held) })
    }

    /// Adds a complete part.
    pub fn add(&self, part: Part) {
        let mut held = self.held();
        held.sealed.push(part);
        held.open = None;
        self.feed.send(held.state());
    }

    /// Publishes the current state of the part that is being filled; `steps`: its number of time steps.
    pub fn show(&self, part: Part, steps: usize) {
        let mut held = self.held();
        held.open = Some((part, steps));
        self.feed.send(held.state());
    }

    /// Marks the replay as complete; `head` contains the results.
    pub fn finish(&self, head: &Head) -> serde_json::Result<()> {
        let head = gzip(head.json()?.as_bytes()).into();
        let mut held = self.held();
        (held.head, held.done) = (head, true);
        self.feed.send(held.state());
        Ok(())
    }

    /// Number of pages that follow the replay.
    #[must_use]
    pub fn watchers(&self) -> usize {
        self.feed.readers()
    }

    /// Feed with the progress of the replay: `{"run": identifier, "sealed": number of complete parts, "open": number of
    /// time steps in the open part, "done": whether the run has ended}`.
    #[must_use]
    pub fn feed(&self) -> Feed {
        self.feed.clone()
    }

    /// Returns the contents of `head.json`, `map.json`, `overview/N`, `detail/N` or `team-states/N`.
    #[must_use]
    pub fn get(&self, path: &str) -> Option<Answer> {
        let held = self.held();
        if path == "head.json" {
            return Some(Answer { kind: JSON, body: held.head.clone(), gzip: true, immutable: false });
        }
        if path == "map.json" {
            return held.map.clone().map(|body| Answer { kind: JSON, body, gzip: true, immutable: false });
        }
        let (block, number) = path.split_once('/')?;
        let number: usize = number.parse().ok()?;
        let sealed = held.sealed.get(number);
        let open = held.open.as_ref().filter(|_| number == held.sealed.len()).map(|(part, _)| part);
        let part = sealed.or(open)?;
        let body = match block {
            "overview" => &part.overview,
            "detail" => &part.detail,
            "team-states" => part.team_states.as_ref()?,
            _ => return None,
        };
        // Browsers must not cache: another run may be served at the same address later.
        Some(Answer { kind: BYTES, body: body.clone(), gzip: true, immutable: false })
    }

    /// Locks the contents. A poisoned lock is safe: every change is a single assignment or push.
    fn held(&self) -> MutexGuard<'_, Held> {
        self.held.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Held {
    fn state(&self) -> String {
        let open = self.open.as_ref().map_or(0, |(_, steps)| *steps);
        let Self { sealed, done, run, .. } = self;
        format!("{{\"run\":\"{run}\",\"sealed\":{},\"open\":{open},\"done\":{done}}}", sealed.len())
    }
}
