//! Sites for the web server: the pages and their data.

use std::collections::VecDeque;
use std::iter;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use axum::extract::{Path, Request, State};
use axum::http::header::{CONTENT_SECURITY_POLICY, HeaderValue};
use axum::response::{IntoResponse, Response};
use axum::routing::get;

use crate::Bytes;
use crate::batch::Batch;
use crate::page::{BATCH, CHARTS, FLIGHT_POLICY, REPLAY, SCRIPT, STYLE};
use crate::replay::{Replay, gzip};
use crate::serve::{NOT_FOUND, Resource, ServerState, Site, policy_with_images};
use crate::tiles::TileServer;

/// Number of re-flown runs of a batch that are kept in memory.
const MAX_CACHED_RUNS: usize = 8;

/// URL paths below which the data of the first and of the second run are served.
const RUNS: [&str; 2] = ["/replay", "/replay-2"];

/// Makes a site of a replay, which may still grow, and of an optional second one shown next to it, over the images of
/// `tiles` if they have geographic coordinates.
pub fn of_runs(first: Arc<Replay>, second: Option<Arc<Replay>>, tiles: Option<&TileServer>) -> Site {
    let runs: Vec<_> = RUNS.into_iter().zip(iter::once(first).chain(second)).collect();
    let bases: Vec<_> = runs.iter().map(|(base, _)| *base).collect();
    let site = with_assets(served_replay(&bases.join(" "), tiles));
    runs.into_iter().fold(site, |site, (base, replay)| {
        let feed = replay.feed();
        let file = async move |Path(file): Path<String>| replay.get(&file).ok_or(NOT_FOUND);
        let follow =
            async move |State(server): State<Arc<ServerState>>, request: Request| server.follow(&feed, request);
        site.route(&format!("{base}/feed"), get(follow)).route(&format!("{base}/{{*file}}"), get(file))
    })
}

/// Makes a site of Monte Carlo results. `fly` re-flies a run when a page requests it, given the index of its batch and
/// its seed; `tiles` as in [`of_runs`].
pub fn of_batch(
    batch: &Batch,
    tiles: Option<TileServer>,
    fly: impl Fn(usize, u64) -> Option<Arc<Replay>> + Send + Sync + 'static,
) -> serde_json::Result<Site> {
    let data = Resource { kind: "application/json", body: gzip(batch.json()?.as_bytes()).into(), gzip: true };
    let flights = Arc::new(Flights { fly: Box::new(fly), flown: Mutex::default() });
    let run = async move |State(server): State<Arc<ServerState>>, Path(path): Path<String>, request: Request| {
        let (run, file) = parse_run(&path).ok_or(NOT_FOUND)?;
        match file {
            "" => {
                let base = format!("/run/{}/{}/replay", run.0, run.1);
                Ok(served_replay(&base, tiles.as_ref()).into_response())
            }
            // A page requests the head first, so the run has been flown already.
            "replay/feed" => Ok(server.follow(&flights.cached(run).ok_or(NOT_FOUND)?.feed(), request)),
            _ => {
                let file = file.strip_prefix("replay/").ok_or(NOT_FOUND)?;
                let replay = server.call(move || flights.replay(run)).await?.ok_or(NOT_FOUND)?;
                replay.get(file).map(Resource::into_response).ok_or(NOT_FOUND)
            }
        }
    };
    Ok(with_assets(served_batch()).route("/batch.json", get(async || data)).route("/run/{*path}", get(run)))
}

/// Makes a site of the page that flies missions, `None` if the file is not one; see [`flight_page`](crate::page::flight_page).
pub fn of_flight_page(file: Vec<u8>) -> Option<Site> {
    const ENGINE: &[u8] = b"data-part=\"engine\"";
    if !file.windows(ENGINE.len()).any(|bytes| bytes == ENGINE) {
        return None;
    }
    let html = Resource { kind: "text/html; charset=utf-8", body: file.into(), gzip: false };
    let page = ServedPage { html, policy: Some(HeaderValue::from_static(FLIGHT_POLICY)) };
    Some(Site::new().route("/", get(async || page)))
}

/// Identifies a run: index of the batch, and seed.
type RunKey = (usize, u64);
/// Re-flies a run from batch index and seed; `None` if that is not possible.
type Fly = dyn Fn(usize, u64) -> Option<Arc<Replay>> + Send + Sync;

/// Re-flown runs of a batch.
struct Flights {
    fly: Box<Fly>,
    /// The newest last.
    flown: Mutex<VecDeque<(RunKey, Arc<Replay>)>>,
}

impl Flights {
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

/// Parses `BATCH/SEED/FILE`. Numbers must be in canonical form, so that a run has only one address.
fn parse_run(path: &str) -> Option<(RunKey, &str)> {
    let mut parts = path.splitn(3, '/');
    let (batch, seed) = (parts.next()?, parts.next()?);
    let which: RunKey = (batch.parse().ok()?, seed.parse().ok()?);
    ((which.0.to_string(), which.1.to_string()) == (batch.to_owned(), seed.to_owned()))
        .then_some((which, parts.next()?))
}

/// A served page, and its content security policy if the common one does not fit.
#[derive(Debug, Clone)]
struct ServedPage {
    html: Resource,
    policy: Option<HeaderValue>,
}

impl IntoResponse for ServedPage {
    fn into_response(self) -> Response {
        let policy = self.policy.map(|policy| [(CONTENT_SECURITY_POLICY, policy)]);
        (policy, self.html).into_response()
    }
}

/// Replay page of runs whose data is served below the space-separated paths `bases`.
fn served_replay(bases: &str, tiles: Option<&TileServer>) -> ServedPage {
    served(REPLAY, bases, tiles)
}

/// Page of Monte Carlo results whose data is served as `/batch.json`.
fn served_batch() -> ServedPage {
    served(BATCH, "", None)
}

/// A page whose data is served below `bases`.
fn served(body: &str, bases: &str, tiles: Option<&TileServer>) -> ServedPage {
    let template = tiles.map(|tiles| format!(" data-tiles=\"{}\"", tiles.template().replace('&', "&amp;")));
    let template = template.unwrap_or_default();
    let page = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>standoff</title>\n<link rel=\"icon\" href=\"data:,\">\n\
         <link rel=\"stylesheet\" href=\"/page.css\">\n\
         <script src=\"/page.js\" defer></script>\n</head>\n<body data-bases=\"{bases}\"{template}>\n{body}</body>\n</html>\n"
    );
    let html = Resource { kind: "text/html; charset=utf-8", body: page.into(), gzip: false };
    ServedPage { html, policy: tiles.map(|tiles| policy_with_images(tiles.origin())) }
}

/// Makes a site of a page with its style sheet and scripts.
fn with_assets(page: ServedPage) -> Site {
    let assets = [
        ("/page.css", "text/css; charset=utf-8", STYLE.as_bytes(), false),
        ("/page.js", "text/javascript; charset=utf-8", SCRIPT.as_bytes(), false),
        ("/plotly.js", "text/javascript; charset=utf-8", CHARTS, true),
    ];
    assets.into_iter().fold(Site::new().route("/", get(async || page)), |site, (path, kind, body, gzip)| {
        let asset = Resource { kind, body: Bytes::from_static(body), gzip };
        site.route(path, get(async || asset))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_run_has_exactly_one_address() {
        assert_eq!(parse_run("0/17/"), Some(((0, 17), "")));
        assert_eq!(parse_run("2/18446744073709551615/replay/feed"), Some(((2, u64::MAX), "replay/feed")));
        for path in ["0/17", "00/17/", "0/+17/", "0/-1/", "/17/", "0/18446744073709551616/", ""] {
            assert_eq!(parse_run(path), None, "{path}");
        }
    }
}
