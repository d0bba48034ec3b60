//! The program with its devices: real time, sockets and status lines.

use std::net::UdpSocket;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Instant, SystemTime, UNIX_EPOCH};

use standoff::{Duration, Time};
use standoff_io::display_text;
use standoff_record::Frame;

use crate::address::LinkAddress;
use crate::codec::{Codec, SigningKey};
use crate::companion::{Companion, Outgoing};
use crate::config::Config;
use crate::cot::CotSender;
use crate::status;
use crate::sumo::Sumo;
use crate::time_stamps::{self, Saver};
use crate::transport::{Input, Inputs, Link, Radio, Received};

/// Zero of the team's time: 2026-01-01 00:00 UTC, seconds of UNIX time. It is fixed, so that all aircraft of a team, and
/// programs that restart, have the same time steps.
const EPOCH_UNIX_S: i64 = 1_767_225_600;

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
    let at = |what: &str| {
        let what = what.to_owned();
        move |error: std::io::Error| RunError::Running(format!("{what}: {error}"))
    };
    let inputs = Inputs::new();
    let mut devices_open = Open {
        codec: Codec::new(system_id, devices.signing.as_ref()),
        link: Link::open(&devices.link, &inputs, Instant::now()).map_err(at(&devices.link.to_string()))?,
        radio: Radio::open(&devices.listen, &devices.teammates, &inputs).map_err(at(&devices.listen))?,
        wrong_lines: 0,
    };
    let mut saver = None;
    if let Some(file) = &devices.time_stamps {
        let shown = display_text::path(file);
        let known = time_stamps::read(file).map_err(|error| RunError::Input(format!("{shown}: {error}")))?;
        devices_open.codec.restore(&known);
        saver = Some(Saver::start(file.clone()).map_err(at(&shown))?);
    }
    let feed = UdpSocket::bind(&devices.feed).map_err(at(&devices.feed))?;
    inputs.listen(Input::Feed, &feed).map_err(at(&devices.feed))?;

    let connect = |address: &String| Sumo::connect(address, uav.0 + 1, plane, sensor).map_err(at(address));
    let mut sumo = devices.sumo.as_ref().map(connect).transpose()?;
    let open_cot = |to: &String| CotSender::open(to, plane, EPOCH_UNIX_S).map_err(at(to));
    let mut cot = devices.cot.as_ref().map(open_cot).transpose()?;

    let clock = Clock;
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
            if is_over || now < left_at {
                let saved = saver.map(|saver| saver.finish(devices_open.codec.time_stamps()));
                return saved.unwrap_or(Ok(())).map_err(at("time stamps of signed frames"));
            }
        }
        // A position calls for a command immediately; without positions, the longest time passes.
        let known_at = position_at(&companion);
        for _ in 0..INPUTS_MAX {
            let is_known = position_at(&companion) == known_at;
            let due_at = now + if is_known { STEP_MAX } else { STEP_MIN };
            let left_us = (due_at - clock.now()).us().clamp(0, STEP_MAX.us());
            if left_us == 0 {
                break;
            }
            if let Some(received) = inputs.next(std::time::Duration::from_micros(left_us as u64)) {
                devices_open.pass_on(&clock, received, &mut companion, report)?;
            }
        }
        let now = clock.now();
        if let Some(sumo) = &mut sumo {
            let lines = sumo.lines(now, &companion);
            let lines = lines.map_err(|reason| RunError::Running(format!("SUMO: {reason}")))?;
            lines.into_iter().for_each(|line| companion.hear_feed_line(now, line));
        }
        let Outgoing { mavlink, teammates, frame } = companion.step(now);
        for message in &mavlink {
            let frame = devices_open.codec.encode(message);
            devices_open.link.send(&frame).map_err(at(&devices.link.to_string()))?;
        }
        saver.iter_mut().for_each(|saver| saver.update(now, devices_open.codec.time_stamps()));
        teammates.iter().for_each(|datagram| devices_open.radio.send(datagram));
        if let Some(frame) = frame {
            cot.iter_mut().for_each(|cot| cot.send(&frame));
            record(frame);
        }
        status.report(now, &companion, report);
    }
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
    /// Number of wrong lines of the feed.
    wrong_lines: u32,
}

impl Open {
    /// Passes an input on to the companion.
    fn pass_on(
        &mut self,
        clock: &Clock,
        received: Received,
        companion: &mut Companion,
        report: &mut dyn FnMut(&str),
    ) -> Result<(), RunError> {
        let Received { input, at, from, bytes } = received;
        let bytes = bytes.map_err(|reason| RunError::Running(format!("link to the autopilot: {reason}")))?;
        let now = clock.at(at);
        match input {
            Input::Autopilot if !self.link.accepts(from, at) => {}
            Input::Autopilot => {
                let mut is_vehicle = false;
                let hear = |header, message| is_vehicle |= companion.receive(now, &header, &message);
                match from {
                    Some(_) => self.codec.decode_datagram(&bytes, hear),
                    None => self.codec.decode_stream(&bytes, hear),
                }
                if is_vehicle {
                    self.link.confirm(from, at);
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
        Ok(())
    }
}

/// The team's time, from the clock of the machine.
struct Clock;

impl Clock {
    fn now(&self) -> Time {
        let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let unix_us = i64::try_from(since.as_micros()).unwrap_or(i64::MAX);
        Time::from_us(unix_us.saturating_sub(EPOCH_UNIX_S * 1_000_000))
    }

    /// Time of an earlier moment.
    fn at(&self, moment: Instant) -> Time {
        let age_us = i64::try_from(moment.elapsed().as_micros()).unwrap_or(i64::MAX);
        Time::from_us(self.now().us().saturating_sub(age_us))
    }
}
