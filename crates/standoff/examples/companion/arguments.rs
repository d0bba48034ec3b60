//! What is typed.

use standoff::{Angle, Position, UavState};

pub(crate) const USAGE: &str = "usage: companion --uav N --team N --port BASE --seconds S \
[--lose PERCENT] [--start-us T] [--epoch N] [--at X_M,Y_M,HEADING_DEG]";

/// One UAV of a team.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Arguments {
    /// Which UAV this is, from 0.
    pub(crate) uav: u32,
    /// How many there are.
    pub(crate) team: u32,
    /// Each UAV hears at this port plus its number, of this machine.
    pub(crate) port: u16,
    /// The mission's end, s after its start.
    pub(crate) seconds: u32,
    /// How much of what comes is lost, per cent.
    pub(crate) lose_percent: u32,
    /// The mission's start, the same for all: microseconds of UNIX time. By default the last full ten minutes.
    pub(crate) start_us: Option<i64>,
    /// Counts restarts.
    pub(crate) epoch: u32,
    /// Where the UAV is when the program starts; by default where the mission begins.
    pub(crate) at: Option<UavState>,
}

impl Arguments {
    /// Names and values, in any order; what is wrong, for people.
    pub(crate) fn parse(words: impl Iterator<Item = String>) -> Result<Self, String> {
        let mut arguments =
            Self { uav: u32::MAX, team: 0, port: 0, seconds: 0, lose_percent: 0, start_us: None, epoch: 0, at: None };
        let mut words = words;
        while let Some(name) = words.next() {
            let value = words.next().ok_or_else(|| format!("{name}: a value is missing; {USAGE}"))?;
            let wrong = |allowed: &str| format!("{name} {value}: allowed is {allowed}; {USAGE}");
            let number = |to: u32| {
                let number = value.parse().ok().filter(|number| *number <= to);
                number.ok_or_else(|| wrong(&format!("a whole number from 0 to {to}")))
            };
            match &*name {
                "--uav" => arguments.uav = number(TEAM_MAX - 1)?,
                "--team" => arguments.team = number(TEAM_MAX)?,
                "--port" => arguments.port = number(65_535 - TEAM_MAX)? as u16,
                "--seconds" => arguments.seconds = number(86_400)?,
                "--lose" => arguments.lose_percent = number(100)?,
                "--epoch" => arguments.epoch = number(u32::MAX)?,
                "--start-us" => {
                    let start_us = value.parse().ok().filter(|us| (0..1 << 60).contains(us));
                    arguments.start_us = Some(start_us.ok_or_else(|| wrong("microseconds of UNIX time"))?);
                }
                "--at" => arguments.at = Some(place(&value).ok_or_else(|| wrong("three numbers, as in 100,-250,90"))?),
                _ => return Err(format!("{name}: there is no such option; {USAGE}")),
            }
        }
        let Self { uav, team, port, seconds, .. } = arguments;
        if uav >= team || port == 0 || seconds == 0 {
            return Err(format!("--uav has to be below --team, --port and --seconds above 0; {USAGE}"));
        }
        Ok(arguments)
    }

    /// Where a UAV hears.
    pub(crate) fn port_of(&self, uav: u32) -> u16 {
        self.port.saturating_add(uav as u16)
    }
}

/// As many as a few ports.
const TEAM_MAX: u32 = 100;

fn place(text: &str) -> Option<UavState> {
    let numbers: Vec<f64> = text.split(',').map(|number| number.trim().parse().ok()).collect::<Option<_>>()?;
    let [x_m, y_m, heading_deg] = numbers.try_into().ok()?;
    let (position, heading) = (Position::from_m(x_m, y_m), Angle::from_deg(heading_deg));
    Some(UavState::straight(position, heading, 40.0)).filter(UavState::is_finite)
}
