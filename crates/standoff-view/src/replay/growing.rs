//! A replay that can be watched while it grows.

use std::collections::hash_map::RandomState;
use std::hash::BuildHasher;
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::encoder::Part;
use super::head::Head;
use super::part::gzip;
use crate::serve::{Answer, Bytes, Feed};

const JSON: &str = "application/json";
const BYTES: &str = "application/octet-stream";

/// A replay that one thread adds to and any number of pages watch. Who adds never waits for who watches.
#[derive(Debug)]
pub struct Replay {
    held: Mutex<Held>,
    feed: Feed,
}

#[derive(Debug)]
struct Held {
    head: Bytes,
    map: Option<Bytes>,
    /// Parts that will not change any more.
    sealed: Vec<Part>,
    /// The part after them as it is so far, and of how many instants it is.
    open: Option<(Part, usize)>,
    done: bool,
    /// Tells this replay from any other that a page has seen.
    run: u64,
}

impl Replay {
    /// A replay that has nothing but its head yet.
    pub fn new(head: &Head) -> serde_json::Result<Self> {
        let map = head.map.clone();
        let head = gzip(head.json()?.as_bytes()).into();
        // Any number will do that another process, or the next replay, does not have.
        let run = RandomState::new().hash_one(0);
        let held = Held { head, map, sealed: Vec::new(), open: None, done: false, run };
        Ok(Self { feed: Feed::new(held.state()), held: Mutex::new(held) })
    }

    /// Adds a part that is full.
    pub fn add(&self, part: Part) {
        let mut held = self.held();
        held.sealed.push(part);
        held.open = None;
        self.feed.say(held.state());
    }

    /// Shows the part that is being filled, of so many instants, as it is so far.
    pub fn show(&self, part: Part, instants: usize) {
        let mut held = self.held();
        held.open = Some((part, instants));
        self.feed.say(held.state());
    }

    /// That was all; the head says what it came to.
    pub fn finish(&self, head: &Head) -> serde_json::Result<()> {
        let head = gzip(head.json()?.as_bytes()).into();
        let mut held = self.held();
        (held.head, held.done) = (head, true);
        self.feed.say(held.state());
        Ok(())
    }

    /// How many pages are following it.
    #[must_use]
    pub fn watchers(&self) -> usize {
        self.feed.readers()
    }

    /// What says how far it is: `{"run": which, "sealed": parts, "open": instants, "done": whether that is all}`.
    #[must_use]
    pub fn feed(&self) -> Feed {
        self.feed.clone()
    }

    /// What lies at `head.json`, `map.json`, `overview/N`, `detail/N` and `pictures/N`.
    #[must_use]
    pub fn get(&self, path: &str) -> Option<Answer> {
        let held = self.held();
        if path == "head.json" {
            return Some(Answer { kind: JSON, body: held.head.clone(), gzip: true, immutable: false });
        }
        if path == "map.json" {
            return held.map.clone().map(|body| Answer { kind: JSON, body, gzip: true, immutable: false });
        }
        let (half, number) = path.split_once('/')?;
        let number: usize = number.parse().ok()?;
        let sealed = held.sealed.get(number);
        let open = held.open.as_ref().filter(|_| number == held.sealed.len()).map(|(part, _)| part);
        let part = sealed.or(open)?;
        let body = match half {
            "overview" => &part.overview,
            "detail" => &part.detail,
            "pictures" => part.pictures.as_ref()?,
            _ => return None,
        };
        // Another run may be served at the same address later: nothing is kept by browsers.
        Some(Answer { kind: BYTES, body: body.clone(), gzip: true, immutable: false })
    }

    /// A panic while it was held has left it whole: every change is a single assignment or push.
    fn held(&self) -> MutexGuard<'_, Held> {
        self.held.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Held {
    fn state(&self) -> String {
        let open = self.open.as_ref().map_or(0, |(_, instants)| *instants);
        let Self { sealed, done, run, .. } = self;
        format!("{{\"run\":\"{run}\",\"sealed\":{},\"open\":{open},\"done\":{done}}}", sealed.len())
    }
}
