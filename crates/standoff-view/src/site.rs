//! Sites for the web server: the pages and their data.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::batch::Batch;
use crate::page;
use crate::replay::{Replay, gzip};
use crate::serve::{Feed, Resource, Site};

/// Number of re-flown runs of a batch that are kept in memory.
const MAX_CACHED_RUNS: usize = 8;

/// URL paths below which the data of the first and of the second run are served.
const RUNS: [&str; 2] = ["/replay", "/replay-2"];

/// Site of one run, or of two runs shown side by side. A run may be complete or in progress.
#[derive(Debug)]
pub struct RunSite {
    first: Arc<Replay>,
    second: Option<Arc<Replay>>,
}

impl RunSite {
    /// Makes a site of a replay, which may still grow, and of an optional second one shown next to it.
    #[must_use]
    pub fn new(first: Arc<Replay>, second: Option<Arc<Replay>>) -> Self {
        Self { first, second }
    }

    /// The runs, each with the URL path of its data.
    fn runs(&self) -> impl Iterator<Item = (&'static str, &Arc<Replay>)> {
        RUNS.into_iter().zip([Some(&self.first), self.second.as_ref()].into_iter().flatten())
    }

    /// The run of `path`, and the rest of the path.
    fn of<'a>(&self, path: &'a str) -> Option<(&Arc<Replay>, &'a str)> {
        self.runs().find_map(|(base, replay)| Some((replay, path.strip_prefix(base)?.strip_prefix('/')?)))
    }
}

impl Site for RunSite {
    fn get(&self, path: &str) -> Option<Resource> {
        if path == "/" {
            return Some(page::served_replay(&self.runs().map(|(base, _)| base).collect::<Vec<_>>().join(" ")));
        }
        page::asset(path).or_else(|| {
            let (replay, file) = self.of(path)?;
            replay.get(file)
        })
    }

    fn feed(&self, path: &str) -> Option<Feed> {
        let (replay, file) = self.of(path)?;
        (file == "feed").then(|| replay.feed())
    }
}

/// Identifies a run: index of the batch, and seed.
type RunKey = (usize, u64);
/// Re-flies a run from batch index and seed; `None` if that is not possible.
type Fly = dyn Fn(usize, u64) -> Option<Arc<Replay>> + Send + Sync;

/// Site of Monte Carlo results. A single run is re-flown when a page requests it.
pub struct BatchSite {
    data: Resource,
    fly: Box<Fly>,
    /// Re-flown runs, the newest last.
    flown: Mutex<VecDeque<(RunKey, Arc<Replay>)>>,
}

impl BatchSite {
    /// Makes a site of results. `fly` re-flies a run, given the index of its batch and its seed.
    pub fn new(
        batch: &Batch,
        fly: impl Fn(usize, u64) -> Option<Arc<Replay>> + Send + Sync + 'static,
    ) -> serde_json::Result<Self> {
        let body = gzip(batch.json()?.as_bytes()).into();
        let data = Resource { kind: "application/json", body, gzip: true, immutable: false };
        Ok(Self { data, fly: Box::new(fly), flown: Mutex::default() })
    }

    fn cached(&self, which: RunKey) -> Option<Arc<Replay>> {
        let flown = self.flown();
        flown.iter().find(|(cached, _)| *cached == which).map(|(_, replay)| Arc::clone(replay))
    }

    /// Returns the run, re-flown if it is not in memory.
    fn replay(&self, which: RunKey) -> Option<Arc<Replay>> {
        if let Some(replay) = self.cached(which) {
            return Some(replay);
        }
        // The lock is not held meanwhile. A simultaneous request for the same run flies it as well, with the same
        // result.
        let replay = (self.fly)(which.0, which.1)?;
        let mut flown = self.flown();
        flown.push_back((which, Arc::clone(&replay)));
        while flown.len() > MAX_CACHED_RUNS {
            flown.pop_front();
        }
        Some(replay)
    }

    /// Locks the list. A poisoned lock is safe: a panic cannot leave the list inconsistent.
    fn flown(&self) -> MutexGuard<'_, VecDeque<(RunKey, Arc<Replay>)>> {
        self.flown.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Site for BatchSite {
    fn get(&self, path: &str) -> Option<Resource> {
        match path {
            "/" => return Some(page::served_batch()),
            "/batch.json" => return Some(self.data.clone()),
            _ => {}
        }
        if let Some(asset) = page::asset(path) {
            return Some(asset);
        }
        let (which, rest) = of_run(path)?;
        match rest {
            "" => Some(page::served_replay(&format!("/run/{}/{}/replay", which.0, which.1))),
            _ => {
                let file = rest.strip_prefix("replay/")?;
                self.replay(which)?.get(file)
            }
        }
    }

    fn feed(&self, path: &str) -> Option<Feed> {
        let (which, rest) = of_run(path)?;
        // A page requests the head first, so the run has been flown already.
        (rest == "replay/feed").then(|| self.cached(which).map(|replay| replay.feed())).flatten()
    }
}

/// Parses `/run/BATCH/SEED/REST`. Numbers must be in canonical form, so that a run has only one address.
fn of_run(path: &str) -> Option<(RunKey, &str)> {
    let mut parts = path.strip_prefix("/run/")?.splitn(3, '/');
    let (batch, seed) = (parts.next()?, parts.next()?);
    let which: RunKey = (batch.parse().ok()?, seed.parse().ok()?);
    ((which.0.to_string(), which.1.to_string()) == (batch.to_owned(), seed.to_owned()))
        .then_some((which, parts.next()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_run_has_exactly_one_address() {
        assert_eq!(of_run("/run/0/17/"), Some(((0, 17), "")));
        assert_eq!(of_run("/run/2/18446744073709551615/replay/feed"), Some(((2, u64::MAX), "replay/feed")));
        for path in
            ["/run/0/17", "/run/00/17/", "/run/0/+17/", "/run/0/-1/", "/run//17/", "/run/0/18446744073709551616/", "/"]
        {
            assert_eq!(of_run(path), None, "{path}");
        }
    }
}
