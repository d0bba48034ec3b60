//! Runs watched in a browser: what `standoff view` and `standoff run --view` share.

use std::io::{self, IsTerminal};
use std::net::{Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::time::{Duration, Instant};

use clap::Args;
use standoff_results::{Failure, manifest, tell_left_out};
use standoff_sim::record::{Frame, Manifest};
use standoff_sim::scenario::{Scenario, Settings};
use standoff_sim::score::Rules;
use standoff_sim::world::World;
use standoff_view::figures::Setup;
use standoff_view::replay::{Encoder, Head, Line, Replay};
use standoff_view::serve::{Bytes, Limits, Server, Site};

use crate::interruption::Interruption;
use crate::speech::note;

/// Least time between two looks at a run that is being flown: more often, a page would only be busier.
const LOOK: Duration = Duration::from_millis(250);
/// Showing may take this share of the time.
const SHARE: u32 = 10;

/// Where a page is served.
#[derive(Args)]
pub(crate) struct Served {
    /// Serve the page at this address and port (port 0: one that is free). Who can reach it can see the page: other
    /// machines, too, unless it is a loopback address [default: 127.0.0.1:0].
    #[arg(long, value_name = "ADDRESS:PORT")]
    listen: Option<SocketAddr>,
    /// Do not open a browser.
    #[arg(long)]
    no_open: bool,
}

impl Served {
    /// An address was given.
    pub(crate) fn has_address(&self) -> bool {
        self.listen.is_some()
    }

    /// Serves a site until what is returned is dropped; `tell` is told its address.
    pub(crate) fn serve(
        &self,
        site: Arc<dyn Site>,
        tell: impl FnOnce(&str) -> Result<(), Failure>,
    ) -> Result<Server, Failure> {
        let listen = self.listen.unwrap_or((Ipv4Addr::LOCALHOST, 0).into());
        let server = Server::bind(listen, site, Limits::default());
        let server = server.map_err(|error| Failure::running(format!("--listen {listen}: {error}")))?;
        let address = server.address();
        if !address.ip().is_loopback() {
            note("warning: this is not a loopback address: whoever can reach it can see the page");
        }
        let url = format!("http://{address}/");
        tell(&format!("{url}\n"))?;
        if !self.no_open && io::stderr().is_terminal() && has_desktop() {
            // Who has no browser still has the address.
            let _ = opener::open_browser(&url);
        }
        Ok(server)
    }
}

/// Whether there is a screen that a browser could open on.
fn has_desktop() -> bool {
    let is_set = |name: &str| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    cfg!(any(target_os = "macos", windows)) || is_set("DISPLAY") || is_set("WAYLAND_DISPLAY")
}

/// A run that is turned into a replay while it is flown or read.
pub(crate) struct Watched {
    encoder: Encoder,
    head: Head,
    replay: Arc<Replay>,
    next_look: Instant,
}

impl Watched {
    pub(crate) fn new(
        manifest: &Manifest,
        settings: &Settings,
        targets: Vec<String>,
        live: bool,
        map: Option<Bytes>,
    ) -> Result<Self, Failure> {
        let mut head = Head::new(manifest, Setup::of(manifest.title(), settings), targets);
        (head.live, head.map) = (live, map);
        let replay = Arc::new(Replay::new(&head).map_err(Failure::running)?);
        Ok(Self { encoder: Encoder::new(&Rules::of(settings), 1), head, replay, next_look: Instant::now() })
    }

    /// A run of this scenario; of a `live` one the page shows the newest instant.
    pub(crate) fn flight(scenario: &Scenario, live: bool, map: Option<Bytes>) -> Result<Self, Failure> {
        Self::new(&manifest(scenario), &scenario.settings, World::names(scenario), live, map)
    }

    pub(crate) fn replay(&self) -> Arc<Replay> {
        Arc::clone(&self.replay)
    }

    /// Takes in the next frame. Pages see it soon, if there are any; nothing waits for them.
    pub(crate) fn frame(&mut self, frame: &Frame) {
        if let Some(part) = self.encoder.frame(frame) {
            self.replay.add(part);
            return;
        }
        let now = Instant::now();
        if now < self.next_look || self.replay.watchers() == 0 {
            return;
        }
        if let Some((part, instants)) = self.encoder.so_far() {
            self.replay.show(part, instants);
        }
        self.next_look = Instant::now() + LOOK.max(now.elapsed() * SHARE);
    }

    /// That was all; it came to this.
    pub(crate) fn finish(mut self, outcome: Vec<Line>) -> Result<(), Failure> {
        if let Some(part) = self.encoder.part() {
            self.replay.add(part);
        }
        self.head.events_left_out = self.encoder.events_left_out();
        self.head.other_events_left_out = self.encoder.other_events_left_out();
        tell_left_out(self.head.events_left_out, &note);
        (self.head.outcome, self.head.live) = (outcome, false);
        self.replay.finish(&self.head).map_err(Failure::running)
    }
}

/// Keeps simulated time in step with the time of day.
pub(crate) struct Pace {
    rate: f64,
    begun: Instant,
}

impl Pace {
    /// So many simulated seconds in a second.
    pub(crate) fn new(rate: f64) -> Self {
        Self { rate, begun: Instant::now() }
    }

    /// Waits until it is time for the instant.
    pub(crate) fn keep(&self, time_us: i64, interruption: &Interruption) {
        let due = Duration::try_from_secs_f64(time_us as f64 * 1e-6 / self.rate);
        interruption.wait(due.ok().and_then(|due| self.begun.checked_add(due)));
    }
}

/// A rate: simulated seconds in a second.
pub(crate) fn rate(text: &str) -> Result<f64, String> {
    let rate: f64 = text.parse().map_err(|_| "should be a number, such as 1 (real time) or 20".to_owned())?;
    if (0.01..=10_000.0).contains(&rate) { Ok(rate) } else { Err("should be between 0.01 and 10000".to_owned()) }
}
