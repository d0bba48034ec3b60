//! A replay that grows while pages follow it.

use std::collections::hash_map::RandomState;
use std::hash::BuildHasher;
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::chunk::gzip;
use super::encoder::Part;
use super::header::Head;
use crate::Bytes;
use crate::serve::{Feed, Resource};

const JSON: &str = "application/json";
const BYTES: &str = "application/octet-stream";

/// A replay that one thread extends and any number of pages follow. The writing thread never waits for pages.
#[derive(Debug)]
pub struct Replay {
    state: Mutex<ReplayState>,
    feed: Feed,
}

#[derive(Debug)]
struct ReplayState {
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
        let state = ReplayState { head, map, sealed: Vec::new(), open: None, done: false, run };
        Ok(Self { feed: Feed::new(state.progress()), state: Mutex::new(state) })
    }

    /// Adds a complete part.
    pub fn add(&self, part: Part) {
        let mut state = self.lock();
        state.sealed.push(part);
        state.open = None;
        self.feed.send(state.progress());
    }

    /// Publishes the current state of the part that is being filled; `steps`: its number of time steps.
    pub fn show(&self, part: Part, steps: usize) {
        let mut state = self.lock();
        state.open = Some((part, steps));
        self.feed.send(state.progress());
    }

    /// Marks the replay as complete; `head` contains the results.
    pub fn finish(&self, head: &Head) -> serde_json::Result<()> {
        let head = gzip(head.json()?.as_bytes()).into();
        let mut state = self.lock();
        (state.head, state.done) = (head, true);
        self.feed.send(state.progress());
        Ok(())
    }

    /// Number of pages that follow the replay.
    #[must_use]
    pub fn viewers(&self) -> usize {
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
    pub fn get(&self, path: &str) -> Option<Resource> {
        let state = self.lock();
        if path == "head.json" {
            return Some(Resource { kind: JSON, body: state.head.clone(), gzip: true });
        }
        if path == "map.json" {
            return state.map.clone().map(|body| Resource { kind: JSON, body, gzip: true });
        }
        let (block, number) = path.split_once('/')?;
        let number: usize = number.parse().ok()?;
        let sealed = state.sealed.get(number);
        let open = state.open.as_ref().filter(|_| number == state.sealed.len()).map(|(part, _)| part);
        let part = sealed.or(open)?;
        Some(Resource { kind: BYTES, body: part.block(block)?.clone(), gzip: true })
    }

    /// Locks the contents. A poisoned lock is safe: every change is a single assignment or push.
    fn lock(&self) -> MutexGuard<'_, ReplayState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl ReplayState {
    /// Formats the progress as JSON; see [`Replay::feed`].
    fn progress(&self) -> String {
        let open = self.open.as_ref().map_or(0, |(_, steps)| *steps);
        let Self { sealed, done, run, .. } = self;
        format!("{{\"run\":\"{run}\",\"sealed\":{},\"open\":{open},\"done\":{done}}}", sealed.len())
    }
}
