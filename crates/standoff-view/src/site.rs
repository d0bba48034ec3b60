//! What is served: the pages, and the data behind them.

use std::collections::VecDeque;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::batch::Batch;
use crate::page;
use crate::replay::{Replay, gzip};
use crate::serve::{Answer, Feed, Site};

/// Runs of a batch that are held once they have been flown again.
const HELD: usize = 8;

/// Where the data of one run lie, and of the other one of two.
const RUNS: [&str; 2] = ["/replay", "/replay-2"];

/// A run that has been flown or is being flown; or two, side by side.
#[derive(Debug)]
pub struct RunSite {
    first: Arc<Replay>,
    second: Option<Arc<Replay>>,
}

impl RunSite {
    /// Shows a replay, which may still grow, and beside it another one.
    #[must_use]
    pub fn new(first: Arc<Replay>, second: Option<Arc<Replay>>) -> Self {
        Self { first, second }
    }

    /// The runs shown, each with where its data lie.
    fn runs(&self) -> impl Iterator<Item = (&'static str, &Arc<Replay>)> {
        RUNS.into_iter().zip([Some(&self.first), self.second.as_ref()].into_iter().flatten())
    }

    /// The run whose data lie at `path`, and which of them.
    fn of<'a>(&self, path: &'a str) -> Option<(&Arc<Replay>, &'a str)> {
        self.runs().find_map(|(base, replay)| Some((replay, path.strip_prefix(base)?.strip_prefix('/')?)))
    }
}

impl Site for RunSite {
    fn get(&self, path: &str) -> Option<Answer> {
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

/// A run of a batch: of which of the batches shown, and its seed.
type Which = (usize, u64);
/// Flies a run again; `None` if that cannot be done.
type Fly = dyn Fn(usize, u64) -> Option<Arc<Replay>> + Send + Sync;

/// Monte Carlo results, any run of which is flown again when somebody wants to see it.
pub struct BatchSite {
    data: Answer,
    fly: Box<Fly>,
    /// The newest last.
    flown: Mutex<VecDeque<(Which, Arc<Replay>)>>,
}

impl BatchSite {
    /// Shows results; `fly` flies a run of the n-th batch again, by its seed.
    pub fn new(
        batch: &Batch,
        fly: impl Fn(usize, u64) -> Option<Arc<Replay>> + Send + Sync + 'static,
    ) -> serde_json::Result<Self> {
        let body = gzip(batch.json()?.as_bytes()).into();
        let data = Answer { kind: "application/json", body, gzip: true, immutable: false };
        Ok(Self { data, fly: Box::new(fly), flown: Mutex::default() })
    }

    fn held(&self, which: Which) -> Option<Arc<Replay>> {
        let flown = self.flown();
        flown.iter().find(|(held, _)| *held == which).map(|(_, replay)| Arc::clone(replay))
    }

    /// The run, flown again if it is not held.
    fn replay(&self, which: Which) -> Option<Arc<Replay>> {
        if let Some(replay) = self.held(which) {
            return Some(replay);
        }
        // Nobody else waits meanwhile; who wants the same run at the same time flies it, too, to the same bits.
        let replay = (self.fly)(which.0, which.1)?;
        let mut flown = self.flown();
        flown.push_back((which, Arc::clone(&replay)));
        while flown.len() > HELD {
            flown.pop_front();
        }
        Some(replay)
    }

    /// A panic while it was held has left it whole.
    fn flown(&self) -> MutexGuard<'_, VecDeque<(Which, Arc<Replay>)>> {
        self.flown.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Site for BatchSite {
    fn get(&self, path: &str) -> Option<Answer> {
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
        // A page asks for the head first: the run has been flown by now.
        (rest == "replay/feed").then(|| self.held(which).map(|replay| replay.feed())).flatten()
    }
}

/// `/run/BATCH/SEED/REST`, the numbers in their only spelling.
fn of_run(path: &str) -> Option<(Which, &str)> {
    let mut parts = path.strip_prefix("/run/")?.splitn(3, '/');
    let (batch, seed) = (parts.next()?, parts.next()?);
    let which: Which = (batch.parse().ok()?, seed.parse().ok()?);
    ((which.0.to_string(), which.1.to_string()) == (batch.to_owned(), seed.to_owned()))
        .then_some((which, parts.next()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_has_one_address() {
        assert_eq!(of_run("/run/0/17/"), Some(((0, 17), "")));
        assert_eq!(of_run("/run/2/18446744073709551615/replay/feed"), Some(((2, u64::MAX), "replay/feed")));
        for path in
            ["/run/0/17", "/run/00/17/", "/run/0/+17/", "/run/0/-1/", "/run//17/", "/run/0/18446744073709551616/", "/"]
        {
            assert_eq!(of_run(path), None, "{path}");
        }
    }
}
