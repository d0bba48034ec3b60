//! What is served: the pages, and the data behind them.

use std::sync::Arc;

use crate::page;
use crate::replay::Replay;
use crate::serve::{Answer, Feed, Site};

/// Where a page of a run finds its data, relative to the page.
const REPLAY: &str = "replay";

/// A run that has been flown, or is being flown.
#[derive(Debug)]
pub struct RunSite {
    replay: Arc<Replay>,
}

impl RunSite {
    /// Shows a replay, which may still grow.
    #[must_use]
    pub fn new(replay: Arc<Replay>) -> Self {
        Self { replay }
    }
}

impl Site for RunSite {
    fn get(&self, path: &str) -> Option<Answer> {
        match path {
            "/" => Some(page::served_replay("/replay")),
            _ => page::asset(path).or_else(|| self.replay.get(within(path, REPLAY)?)),
        }
    }

    fn feed(&self, path: &str) -> Option<Feed> {
        (path == "/replay/feed").then(|| self.replay.feed())
    }
}

/// What is left of a path below a folder of the site.
fn within<'a>(path: &'a str, folder: &str) -> Option<&'a str> {
    path.strip_prefix('/')?.strip_prefix(folder)?.strip_prefix('/')
}
