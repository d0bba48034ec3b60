//! The program with its devices: real time, sockets and status lines.

use std::net::{SocketAddr, UdpSocket};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Instant, SystemTime, UNIX_EPOCH};

use standoff::{Duration, Time};
use standoff_io::display_text;
use standoff_record::Frame;

use crate::address::LinkAddress;
use crate::codec::{self, Codec, SigningKey};
use crate::commanded_file::CommandedFile;
use crate::companion::{Companion, Outgoing};
use crate::config::Config;
use crate::cot::CotSender;
use crate::period::is_due;
use crate::status;
use crate::sumo::Sumo;
use crate::team_clock::team_us;
use crate::time_stamps::{self, Saver};
use crate::transport::{Input, Inputs, Link, Radio, Received};

/// Longest time between two clocks that are read at the same moment.
const SAME_MOMENT_MAX: Duration = Duration::from_us(5_000);

/// Period at which the same warning about a datagram is repeated.
const WARNING_PERIOD: Duration = Duration::from_us(10_000_000);

/// Time for which the program sends on after it has announced that the UAV leaves the team.
const LEAVE: Duration = Duration::from_us(1_000_000);

/// Time after which the program ends without an answer to its request to circle.
const LEAVE_MAX: Duration = Duration::from_us(3_500_000);

/// Longest time between two steps: longer than the period of positions, which start the steps.
const STEP_MAX: Duration = Duration::from_us(150_000);

/// Shortest time between two steps: after a step without a position, the next position starts a step immediately.
const STEP_MIN: Duration = Duration::from_us(40_000);

/// Maximum number of inputs processed between two steps, so that a flood of datagrams does not delay a step.
const INPUTS_MAX: usize = 2000;

/// Addresses of the devices of one aircraft.
pub struct Devices {
    /// Link to the autopilot.
    pub link: LinkAddress,
    /// Key of the message signing; `None`: frames are neither signed nor checked.
    pub signing: Option<SigningKey>,
    /// File that keeps the time stamps of signed frames; `None` without signing.
    pub time_stamps: Option<PathBuf>,
    /// Local address of the feed.
    pub feed: String,
    /// Local address for teammates.
    pub listen: String,
    /// Addresses of the teammates.
    pub teammates: Vec<String>,
    /// Address of a SUMO simulation with targets.
    pub sumo: Option<String>,
    /// Address of an operator map that receives Cursor-on-Target events.
    pub cot: Option<String>,
    /// File that exists while the aircraft is commanded.
    pub commanded_file: Option<PathBuf>,
}

/// Why the program has ended.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum RunError {
    /// Wrong settings.
    #[error("{0}")]
    Input(String),
    /// A failure while running.
    #[error("{0}")]
    Running(String),
}

/// Flies until `stop` is set or `duration` has passed. `report` receives status lines and warnings, `record` the rows of
/// each time step, with the team's time.
pub fn run(
    config: Config,
    devices: &Devices,
    stop: &AtomicBool,
    duration: Option<Duration>,
    report: &mut dyn FnMut(&str),
    record: &mut dyn FnMut(Frame),
) -> Result<(), RunError> {
    let system_id = config.system_id;
    let (plane, sensor, uav) = (config.plane, config.params.track.sensor, config.uav);
    let mut companion = Companion::new(config)
        .map_err(|errors| RunError::Input(errors.iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")))?;
    let inputs = Inputs::new();
    let mut open = Open::new(system_id, devices, &inputs)?;
    if devices.signing.is_some() && codec::clock_stamp() == 0 {
        report(CLOCK_WARNING);
    }
    let connect = |address: &String| Sumo::connect(address, uav.0 + 1, plane, sensor).map_err(at(address));
    let mut sumo = devices.sumo.as_ref().map(connect).transpose()?;
    let open_cot = |to: &String| CotSender::open(to, plane).map_err(at(to));
    let mut cot = devices.cot.as_ref().map(open_cot).transpose()?;
    let mut commanded_file = devices.commanded_file.as_deref().map(commanded_file).transpose()?;

    let clock = Clock { begun: Instant::now() };
    let begun_at = clock.now();
    let mut leaves_at: Option<Time> = None;
    let mut status = status::Reporter::default();
    loop {
        let now = clock.now();
        let is_due = duration.is_some_and(|duration| now - begun_at >= duration);
        if leaves_at.is_none() && (stop.load(Ordering::Relaxed) || is_due) {
            companion.leave();
            leaves_at = Some(now);
        }
        if let Some(left_at) = leaves_at {
            let is_over = now - left_at >= if companion.awaits_answer() { LEAVE_MAX } else { LEAVE };
            if is_over {
                commanded_file.iter_mut().for_each(|file| file.update(false, report));
                return open.finish();
            }
        }
        open.receive(&clock, &inputs, &mut companion, report);
        if let Some((at, wall)) = clock.with_wall() {
            companion.hear_clock(at, wall);
        }
        let now = clock.now();
        if let Some(sumo) = &mut sumo {
            let lines = sumo.lines(now, &companion);
            let lines = lines.map_err(|reason| RunError::Running(format!("SUMO: {reason}")))?;
            lines.into_iter().for_each(|line| companion.hear_feed_line(now, line));
        }
        let outgoing = companion.step(now);
        // Before the first command is sent.
        commanded_file.iter_mut().for_each(|file| file.update(companion.is_commanding(), report));
        open.send(now, &outgoing);
        if let Some(frame) = outgoing.frame {
            cot.iter_mut().for_each(|cot| cot.send(&frame));
            record(frame);
        }
        status.report(now, &companion, report);
    }
}

fn commanded_file(path: &Path) -> Result<CommandedFile, RunError> {
    CommandedFile::new(path).map_err(|error| RunError::Input(format!("{}: {error}", display_text::path(path))))
}

/// Time of the last position.
fn position_at(companion: &Companion) -> Option<Time> {
    companion.vehicle.position.map(|position| position.at)
}

/// Open devices.
struct Open {
    codec: Codec,
    link: Link,
    radio: Radio,
    /// Saves the time stamps of signed frames.
    saver: Option<Saver>,
    system_id: u8,
    /// Number of wrong lines of the feed.
    wrong_lines: u32,
    /// Last warning about a second vehicle.
    doubled_at: Option<Time>,
}

/// Warning about a clock that gives no time stamps.
const CLOCK_WARNING: &str = "warning: the clock of this computer is before 2015, where the time stamps of signed frames \
                             begin: the autopilot may drop all frames; set the clock and start again";

/// A function that adds to an error of a device which one it is.
fn at(what: &str) -> impl Fn(std::io::Error) -> RunError + use<> {
    let what = what.to_owned();
    move |error| {
        let is_used = error.kind() == std::io::ErrorKind::AddrInUse;
        let advice = if is_used { "; end the other program, or choose another port" } else { "" };
        RunError::Running(format!("{what}: {error}{advice}"))
    }
}

impl Open {
    /// Saves the time stamps of signed frames.
    fn finish(self) -> Result<(), RunError> {
        let saved = self.saver.map(|saver| saver.finish(self.codec.time_stamps()));
        saved.unwrap_or(Ok(())).map_err(at("time stamps of signed frames"))
    }

    /// Sends messages to the autopilot and to the teammates.
    fn send(&mut self, now: Time, outgoing: &Outgoing) {
        for message in &outgoing.mavlink {
            let frame = self.codec.encode(message);
            self.link.send(&frame);
        }
        self.saver.iter_mut().for_each(|saver| saver.update(now, self.codec.time_stamps()));
        outgoing.teammates.iter().for_each(|datagram| self.radio.send(datagram));
    }

    fn new(system_id: u8, devices: &Devices, inputs: &Inputs) -> Result<Self, RunError> {
        let mut codec = Codec::new(system_id, devices.signing.as_ref());
        let link =
            Link::open(&devices.link, inputs, Instant::now()).map_err(at(&format!("--link {}", devices.link)))?;
        let radio = Radio::open(&devices.listen, &devices.teammates, inputs)
            .map_err(at(&format!("--listen {}", devices.listen)))?;
        let mut saver = None;
        if let Some(file) = &devices.time_stamps {
            let shown = display_text::path(file);
            let known = time_stamps::read(file).map_err(|error| RunError::Input(format!("{shown}: {error}")))?;
            codec.restore(known);
            saver = Some(Saver::start(file.clone()).map_err(at(&shown))?);
        }
        let of_feed = at(&format!("--feed {}", devices.feed));
        let feed = UdpSocket::bind(&devices.feed).map_err(&of_feed)?;
        inputs.listen(Input::Feed, &feed).map_err(of_feed)?;
        Ok(Self { codec, link, radio, saver, system_id, wrong_lines: 0, doubled_at: None })
    }

    /// Receives until the next step is due.
    fn receive(&mut self, clock: &Clock, inputs: &Inputs, companion: &mut Companion, report: &mut dyn FnMut(&str)) {
        // A position calls for a command immediately; without positions, the longest time passes.
        let (now, known_at) = (clock.now(), position_at(companion));
        for _ in 0..INPUTS_MAX {
            let is_known = position_at(companion) == known_at;
            let due_at = now + if is_known { STEP_MAX } else { STEP_MIN };
            let left_us = (due_at - clock.now()).us().clamp(0, STEP_MAX.us());
            if left_us == 0 {
                break;
            }
            if let Some(received) = inputs.next(std::time::Duration::from_micros(left_us as u64)) {
                self.pass_on(clock, received, companion, report);
            }
        }
    }

    /// Passes an input on to the companion.
    fn pass_on(&mut self, clock: &Clock, received: Received, companion: &mut Companion, report: &mut dyn FnMut(&str)) {
        let Received { input, at, from, bytes } = received;
        let bytes = match bytes {
            Ok(bytes) => bytes,
            Err(reason) => {
                report(&format!("warning: link to the autopilot: {reason}; it is opened again"));
                return;
            }
        };
        let now = clock.at(at);
        match input {
            Input::Autopilot if !self.link.accepts(from, at) => self.warn_of_double(now, from, &bytes, report),
            Input::Autopilot => {
                let mut is_vehicle = false;
                let hear = |header, message| is_vehicle |= companion.receive(now, &header, &message);
                match from {
                    Some(_) => self.codec.decode_datagram(&bytes, hear),
                    None => self.codec.decode_stream(&bytes, hear),
                }
                let is_behind = self.codec.take_behind();
                if is_vehicle {
                    self.link.confirm(from, at);
                } else if is_behind {
                    self.link.answer(from);
                }
            }
            Input::Feed => {
                for line in String::from_utf8_lossy(&bytes).lines().filter(|line| !line.trim().is_empty()) {
                    if let Err(error) = companion.hear_feed(now, line) {
                        // The first wrong lines are shown; a feed with the same mistake would repeat it for ever.
                        self.wrong_lines = self.wrong_lines.saturating_add(1);
                        if self.wrong_lines <= 10 {
                            report(&format!("warning: {error}"));
                        }
                    }
                }
            }
            Input::Teammates if self.radio.accepts(from) => companion.hear_teammate(&bytes),
            Input::Teammates => {}
        }
    }

    /// Warns of a heartbeat that the vehicle's system id, but not its address has.
    fn warn_of_double(&mut self, now: Time, from: Option<SocketAddr>, bytes: &[u8], report: &mut dyn FnMut(&str)) {
        let Some((from, peer)) = from.zip(self.link.peer()) else { return };
        if codec::is_heartbeat(bytes, self.system_id) && is_due(self.doubled_at, now, WARNING_PERIOD) {
            self.doubled_at = Some(now);
            report(&format!(
                "warning: heartbeats of system {} arrive from {peer} and from {from}: only those from the first address \
                 count; give each vehicle another system id and port",
                self.system_id
            ));
        }
    }
}

/// The time of this program, which is monotonic.
struct Clock {
    begun: Instant,
}

impl Clock {
    fn now(&self) -> Time {
        self.at(Instant::now())
    }

    /// Time of a moment.
    fn at(&self, moment: Instant) -> Time {
        let us = moment.saturating_duration_since(self.begun).as_micros();
        Time::from_us(i64::try_from(us).unwrap_or(i64::MAX))
    }

    /// A time of this program and the time of the computer's clock, as the team's time, at the same moment; `None` if the
    /// program was interrupted between them.
    fn with_wall(&self) -> Option<(Time, Time)> {
        let (before, wall, after) = (self.now(), Self::wall(), self.now());
        (after - before < SAME_MOMENT_MAX).then_some((before, wall))
    }

    /// The clock of the computer, as the team's time.
    fn wall() -> Time {
        let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let unix_us = i64::try_from(since.as_micros()).unwrap_or(i64::MAX);
        Time::from_us(team_us(unix_us))
    }
}
