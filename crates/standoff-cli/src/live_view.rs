//! Runs shown in a browser: code shared by `standoff view` and `standoff run --view`.

use std::io::{self, IsTerminal};
use std::net::{Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::time::{Duration, Instant};

use clap::Args;
use standoff_app::{Failure, manifest, warn_omitted};
use standoff_record::{Frame, Manifest};
use standoff_sim::scenario::{Scenario, Settings};
use standoff_sim::world::World;
use standoff_view::figures::Setup;
use standoff_view::replay::{Encoder, Head, Line, Replay};
use standoff_view::serve::{Bytes, Limits, Server, Site};
use standoff_view::tiles::TileServer;

use crate::signals::Interruption;
use crate::terminal::note;

/// Minimum time between two updates of the page of a running mission; more frequent updates would only load the page.
const UPDATE_INTERVAL: Duration = Duration::from_millis(250);
/// Minimum ratio of the time between updates to the time that one takes.
const UPDATE_TIME_RATIO: u32 = 10;

/// Options of the page server.
#[derive(Args)]
pub(crate) struct ServeArgs {
    /// Serve the page at this address and port (port 0: any free port). Unless it is a loopback address, other machines
    /// that can reach it can see the page, too [default: 127.0.0.1:0].
    #[arg(long, value_name = "ADDRESS:PORT")]
    listen: Option<SocketAddr>,
    /// Do not open a browser.
    #[arg(long)]
    no_open: bool,
    /// Show the images of this tile server below the map, if the traffic has geographic coordinates: an address with
    /// {z}, {x} and {y}. The browser requests them; nothing is requested without this option.
    #[arg(long, value_name = "URL")]
    tiles: Option<TileServer>,
}

impl ServeArgs {
    /// Options of a command whose `--listen` has another meaning.
    pub(crate) fn at(listen: Option<SocketAddr>, no_open: bool) -> Self {
        Self { listen, no_open, tiles: None }
    }

    /// True if the user gave an address.
    pub(crate) fn has_address(&self) -> bool {
        self.listen.is_some()
    }

    /// True if the user gave a tile server.
    pub(crate) fn has_tiles(&self) -> bool {
        self.tiles.is_some()
    }

    /// Returns the tile server. Fails if the user gave one, but no shown run `is_geographic`.
    pub(crate) fn tiles(&self, is_geographic: bool) -> Result<Option<&TileServer>, Failure> {
        if self.has_tiles() && !is_geographic {
            let message = "--tiles: the run has no geographic coordinates: tiles need traffic in degrees";
            return Err(Failure::Input(message.to_owned()));
        }
        Ok(self.tiles.as_ref())
    }

    /// Serves a site until the returned server is dropped; calls `announce` with its address.
    pub(crate) fn serve(
        &self,
        site: Site,
        announce: impl FnOnce(&str) -> Result<(), Failure>,
    ) -> Result<Server, Failure> {
        let listen = self.listen.unwrap_or((Ipv4Addr::LOCALHOST, 0).into());
        let server = Server::bind(listen, site, Limits::default());
        let server = server.map_err(|error| Failure::running(format!("--listen {listen}: {error}")))?;
        let address = server.address();
        if !address.ip().is_loopback() {
            note(&format!(
                "warning: {address} is not a loopback address: any machine that can reach it can see the page"
            ));
        }
        let url = format!("http://{address}/");
        announce(&format!("{url}\n"))?;
        if !self.no_open && io::stderr().is_terminal() && has_desktop() {
            // Errors are ignored: the user still has the address.
            let _ = open::that_detached(&url);
        }
        Ok(server)
    }
}

/// True if the machine has a screen on which a browser can open.
fn has_desktop() -> bool {
    let is_set = |name: &str| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    cfg!(any(target_os = "macos", windows)) || is_set("DISPLAY") || is_set("WAYLAND_DISPLAY")
}

/// A run that is encoded as a replay while it is flown or read.
pub(crate) struct LiveReplay {
    encoder: Encoder,
    head: Head,
    replay: Arc<Replay>,
    next_update: Instant,
}

impl LiveReplay {
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
        let encoder = Encoder::new(&settings.score_config(), 1).with_detections(head.limits.detections);
        Ok(Self { encoder, head, replay, next_update: Instant::now() })
    }

    /// Prepares the replay of a run of this scenario; if it is `live`, the page follows the newest time step.
    pub(crate) fn flight(scenario: &Scenario, live: bool, map: Option<Bytes>) -> Result<Self, Failure> {
        Self::new(&manifest(scenario), &scenario.settings, World::names(scenario), live, map)
    }

    /// True if the positions of the run have a latitude and longitude.
    pub(crate) fn is_geographic(&self) -> bool {
        self.head.origin.is_some()
    }

    /// Name of the scenario.
    pub(crate) fn scenario(&self) -> &str {
        &self.head.scenario
    }

    /// Sets the settings that differ from those of the other run on the page, before the run is served.
    pub(crate) fn set_changes(&mut self, changes: Vec<String>) -> Result<(), Failure> {
        self.head.changes = changes;
        self.replay = Arc::new(Replay::new(&self.head).map_err(Failure::running)?);
        Ok(())
    }

    pub(crate) fn replay(&self) -> Arc<Replay> {
        Arc::clone(&self.replay)
    }

    /// Adds the next frame. Open pages receive it within a short time; the run never waits for a page.
    pub(crate) fn frame(&mut self, frame: &Frame) {
        if let Some(part) = self.encoder.frame(frame) {
            self.replay.add(part);
            return;
        }
        let now = Instant::now();
        if now < self.next_update || self.replay.viewers() == 0 {
            return;
        }
        if let Some(part) = self.encoder.so_far() {
            self.replay.show(part, self.encoder.open_steps());
        }
        self.next_update = Instant::now() + UPDATE_INTERVAL.max(now.elapsed() * UPDATE_TIME_RATIO);
    }

    /// Ends the replay and adds the outcome of the run.
    pub(crate) fn finish(mut self, outcome: Vec<Line>) -> Result<(), Failure> {
        if let Some(part) = self.encoder.part() {
            self.replay.add(part);
        }
        self.head.complete(outcome, &self.encoder);
        warn_omitted(self.head.events_left_out, &note);
        self.replay.finish(&self.head).map_err(Failure::running)
    }
}

/// Paces simulated time relative to real time.
pub(crate) struct Pace {
    speed: f64,
    begun: Instant,
}

impl Pace {
    /// Creates a pace of `rate` simulated seconds per real second.
    pub(crate) fn new(rate: f64) -> Self {
        Self { speed: rate, begun: Instant::now() }
    }

    /// Waits until the time step at `time_us` is due, or until the user interrupts the run.
    pub(crate) fn keep(&self, time_us: i64, interruption: &Interruption) {
        let due = Duration::try_from_secs_f64(time_us as f64 * 1e-6 / self.speed);
        interruption.wait(due.ok().and_then(|due| self.begun.checked_add(due)));
    }
}

/// Parses a rate: simulated seconds per real second.
pub(crate) fn speed(text: &str) -> Result<f64, String> {
    let rate: f64 = text.parse().map_err(|_| "must be a number, such as 1 (real time) or 20".to_owned())?;
    if (0.01..=10_000.0).contains(&rate) { Ok(rate) } else { Err("must be between 0.01 and 10000".to_owned()) }
}
