//! Command-line arguments.

use standoff::{Angle, Position, UavState};

pub(crate) const USAGE: &str = "usage: companion --uav N --team N --port BASE --seconds S \
[--lose PERCENT] [--speed N] [--start-us T] [--restart-count N] [--at X_M,Y_M,HEADING_DEG]";

/// Arguments of the program for one UAV of a team.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Arguments {
    /// Id of this UAV, from 0.
    pub(crate) uav: u32,
    /// Number of UAVs in the team.
    pub(crate) team: u32,
    /// Base port. Each UAV receives on this port plus its id, on the local machine.
    pub(crate) port: u16,
    /// End of the mission, s after its start.
    pub(crate) seconds: u32,
    /// Packet loss of received messages, per cent.
    pub(crate) lose_percent: u32,
    /// Mission time per time of the machine's clock, the same for all UAVs.
    pub(crate) speed: u32,
    /// Start of the mission, the same for all UAVs: microseconds of UNIX time. Default: the last full ten minutes.
    pub(crate) start_us: Option<i64>,
    /// Restart count.
    pub(crate) restart_count: u32,
    /// State of the UAV at the start of the program. Default: the initial state of the mission.
    pub(crate) at: Option<UavState>,
}

impl Arguments {
    /// Parses names and values in any order. The error is a message for the user.
    pub(crate) fn parse(words: impl Iterator<Item = String>) -> Result<Self, String> {
        let mut arguments = Self {
            uav: u32::MAX,
            team: 0,
            port: 0,
            seconds: 0,
            lose_percent: 0,
            speed: 1,
            start_us: None,
            restart_count: 0,
            at: None,
        };
        let mut words = words;
        while let Some(name) = words.next() {
            let value = words.next().ok_or_else(|| format!("{name}: missing value; {USAGE}"))?;
            let error = |allowed: &str| format!("{name} {value}: must be {allowed}; {USAGE}");
            let number = |to: u32| {
                let number = value.parse().ok().filter(|number| *number <= to);
                number.ok_or_else(|| error(&format!("a whole number from 0 to {to}")))
            };
            match &*name {
                "--uav" => arguments.uav = number(TEAM_MAX - 1)?,
                "--team" => arguments.team = number(TEAM_MAX)?,
                "--port" => arguments.port = number(65_535 - TEAM_MAX)? as u16,
                "--seconds" => arguments.seconds = number(86_400)?,
                "--lose" => arguments.lose_percent = number(100)?,
                "--speed" => arguments.speed = number(10)?,
                "--restart-count" => arguments.restart_count = number(u32::MAX)?,
                "--start-us" => {
                    let start_us = value.parse().ok().filter(|us| (0..1 << 60).contains(us));
                    arguments.start_us = Some(start_us.ok_or_else(|| error("microseconds of UNIX time"))?);
                }
                "--at" => {
                    let at = parse_state(&value).ok_or_else(|| error("three numbers, for example 100,-250,90"))?;
                    arguments.at = Some(at);
                }
                _ => return Err(format!("{name}: unknown option; {USAGE}")),
            }
        }
        let Self { uav, team, port, seconds, speed, .. } = arguments;
        if uav >= team || port == 0 || seconds == 0 || speed == 0 {
            return Err(format!(
                "--uav must be less than --team; --port, --seconds and --speed must be greater than 0; {USAGE}"
            ));
        }
        Ok(arguments)
    }

    /// Port on which a UAV receives.
    pub(crate) fn port_of(&self, uav: u32) -> u16 {
        self.port.saturating_add(uav as u16)
    }
}

/// Maximum team size; each UAV uses a port.
const TEAM_MAX: u32 = 100;

fn parse_state(text: &str) -> Option<UavState> {
    let parse = |number: &str| number.trim().parse().ok().filter(|number: &f64| number.is_finite());
    let numbers: Vec<f64> = text.split(',').map(parse).collect::<Option<_>>()?;
    let [x_m, y_m, heading_deg] = numbers.try_into().ok()?;
    let (position, heading) = (Position::from_m(x_m, y_m), Angle::from_deg(heading_deg));
    Some(UavState::level_flight(position, heading, 40.0))
}
