//! Real time and a radio: UDP datagrams between processes on one machine, one message per datagram.

use std::io;
use std::net::{Ipv4Addr, UdpSocket};
use std::time::{SystemTime, UNIX_EPOCH};

use standoff::*;

use super::arguments::Arguments;
use super::{Companion, PERIOD};

/// Time to wait for teammates' messages before a decision.
const WAIT: Duration = Duration::from_us(100_000);

/// Maximum delay of the program after which a time step is skipped.
const LATE: Duration = Duration::from_us(250_000);

/// Simulated packet loss, per cent. The same seed loses the same messages.
pub(crate) struct Loss {
    percent: u64,
    state: u64,
}

impl Loss {
    pub(crate) fn new(percent: u32, seed: u32) -> Self {
        Self { percent: percent.into(), state: seed.into() }
    }

    pub(crate) fn loses(&mut self) -> bool {
        // SplitMix64.
        self.state = self.state.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.state ^ (self.state >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        (mixed ^ (mixed >> 31)) % 100 < self.percent
    }
}

/// Mission time from the clock of the machine. On aircraft, use GNSS time.
struct Clock {
    start_us: i64,
    /// Mission time per time of the machine's clock.
    speed: i64,
}

impl Clock {
    fn new(start_us: Option<i64>, speed: u32) -> Self {
        const TEN_MINUTES_US: i64 = 600_000_000;
        let now_us = Self { start_us: 0, speed: 1 }.now().us();
        Self { start_us: start_us.unwrap_or(now_us - now_us % TEN_MINUTES_US), speed: speed.into() }
    }

    fn now(&self) -> Time {
        let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        Time::from_us((since.as_micros() as i64).saturating_sub(self.start_us).saturating_mul(self.speed))
    }
}

/// A radio that sends every message to all teammates.
struct Udp {
    socket: UdpSocket,
    teammates: Vec<u16>,
    loss: Loss,
    clock: Clock,
}

impl Udp {
    fn send(&self, bytes: &[u8]) {
        for port in &self.teammates {
            // Errors are ignored: the agent handles lost messages.
            let _ = self.socket.send_to(bytes, (Ipv4Addr::LOCALHOST, *port));
        }
    }

    /// Receives messages until a time, but for one period at most, because the clock may have been set.
    fn listen(&mut self, until: Time, mut hear: impl FnMut(&[u8])) -> io::Result<()> {
        let mut datagram = vec![0; 65_536];
        let mut until = until;
        loop {
            let now = self.clock.now();
            until = until.min(now + PERIOD);
            let left_us = (until - now).us();
            if left_us <= 0 {
                return Ok(());
            }
            let wait_us = (left_us / self.clock.speed).max(1) as u64;
            self.socket.set_read_timeout(Some(std::time::Duration::from_micros(wait_us)))?;
            // A timeout, or a teammate's port is closed, which some systems report here.
            let Ok((length, _)) = self.socket.recv_from(&mut datagram) else { continue };
            if !self.loss.loses() {
                hear(&datagram[..length]);
            }
        }
    }
}

/// Flies a UAV until the end of the mission.
pub(crate) fn fly(mut uav: Companion, arguments: &Arguments) -> io::Result<()> {
    let teammates = (0..arguments.team).filter(|other| *other != arguments.uav);
    let mut radio = Udp {
        socket: UdpSocket::bind((Ipv4Addr::LOCALHOST, arguments.port_of(arguments.uav)))?,
        teammates: teammates.map(|other| arguments.port_of(other)).collect(),
        loss: Loss::new(arguments.lose_percent, arguments.uav),
        clock: Clock::new(arguments.start_us, arguments.speed),
    };
    let end = Time::EPOCH + Duration::from_s(arguments.seconds.into());
    let mut last = None;
    loop {
        let number = radio.clock.now().us().div_euclid(PERIOD.us()) + 1;
        let now = Time::from_us(number.max(0) * PERIOD.us());
        if now > end {
            return Ok(());
        }
        radio.listen(now, |bytes| last.iter().for_each(|observation| uav.hear(observation, bytes)))?;
        // The mission has not started, the clock was set, or the program was paused.
        let late = radio.clock.now() - now;
        if !(0..LATE.us()).contains(&late.us()) {
            continue;
        }
        if end - now <= Duration::from_s(1.0) {
            uav.agent.leave();
        }
        let (observation, messages) = uav.observe(now);
        messages.iter().for_each(|bytes| radio.send(bytes));
        radio.listen(now + WAIT, |bytes| uav.hear(&observation, bytes))?;
        uav.decide(&observation);
        if number % 2 == 0 {
            println!("{}", uav.line());
        }
        last = Some(observation);
    }
}
