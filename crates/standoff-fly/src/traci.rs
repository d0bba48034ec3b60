//! Minimal client of SUMO's TraCI protocol: positions, speeds and angles of all vehicles at each simulation step
//! (<https://sumo.dlr.de/docs/TraCI/Protocol.html>).
//!
//! The crate `traci-rs` covers the whole protocol, but its licence (EPL-2.0) is not among those of `deny.toml`.

use std::io::{self, Read, Write};

/// Longest message that is read, bytes: 100,000 vehicles.
const MESSAGE_MAX: usize = 1 << 23;

/// Longest name of a vehicle or junction, bytes.
const NAME_MAX: usize = 1000;

/// Coordinates of vehicles, m, and their speeds, m/s, are at most this.
const COORDINATE_MAX_M: f64 = 1e6;
const SPEED_MAX_M_S: f64 = 200.0;

/// Radius about a junction that contains every vehicle, m.
const RANGE_M: f64 = 1e6;

/// "No limit" as begin and end of a subscription.
const UNLIMITED: f64 = -1_073_741_824.0;

const SET_ORDER: u8 = 0x03;
const SIMULATION_STEP: u8 = 0x02;
const CLOSE: u8 = 0x7F;
const GET_SIMULATION: u8 = 0xAB;
const GET_JUNCTION: u8 = 0xA9;
const SUBSCRIBE_JUNCTION_CONTEXT: u8 = 0x89;
/// A response has the id of its command plus this.
const RESPONSE: u8 = 0x10;
const VEHICLES: u8 = 0xA4;
const IDS: u8 = 0x00;
const TIME: u8 = 0x66;
const STEP_LENGTH: u8 = 0x7B;
const POSITION: u8 = 0x42;
const SPEED: u8 = 0x40;
const ANGLE: u8 = 0x43;
const TYPE_POSITION_2D: u8 = 0x01;
const TYPE_DOUBLE: u8 = 0x0B;
const TYPE_STRINGS: u8 = 0x0E;

/// A vehicle of SUMO.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct SumoVehicle {
    pub(crate) name: String,
    /// Position of the front bumper in the net, m.
    pub(crate) position_m: [f64; 2],
    pub(crate) speed_m_s: f64,
    /// Direction of travel, degrees clockwise from north.
    pub(crate) course_deg: f64,
}

/// What is wrong with the connection.
#[derive(Debug, thiserror::Error)]
pub(crate) enum TraciError {
    /// The connection failed.
    #[error("{0}")]
    Connection(#[from] io::Error),
    /// A message that is not one of the protocol.
    #[error("a message is not one of TraCI: {0}")]
    Form(&'static str),
    /// SUMO refused a command.
    #[error("SUMO refused a command: {0}")]
    Refused(String),
}

/// A connection to SUMO after the first commands.
#[derive(Debug)]
pub(crate) struct Client<S> {
    stream: S,
    /// Time of the simulation, s.
    pub(crate) time_s: f64,
    /// Length of a simulation step, s.
    pub(crate) step_length_s: f64,
}

impl<S: Read + Write> Client<S> {
    /// Subscribes to all vehicles. `order` is the rank of this client among those of the simulation, each another one.
    pub(crate) fn start(stream: S, order: u32) -> Result<Self, TraciError> {
        let mut client = Self { stream, time_s: 0.0, step_length_s: 1.0 };
        client.exchange(SET_ORDER, &order.to_be_bytes())?;
        let in_range = |value: f64, max| if (0.0..=max).contains(&value) { Ok(value) } else { Err(FORM_NUMBER) };
        client.time_s = in_range(client.get(GET_SIMULATION, TIME, TYPE_DOUBLE)?.f64()?, 1e9)?;
        client.step_length_s = in_range(client.get(GET_SIMULATION, STEP_LENGTH, TYPE_DOUBLE)?.f64()?, 60.0)?;
        let mut ids = client.get(GET_JUNCTION, IDS, TYPE_STRINGS)?;
        if ids.u32()? == 0 {
            return Err(TraciError::Form("the net has no junction"));
        }
        let junction = ids.string()?;
        let mut content = [UNLIMITED.to_be_bytes(), UNLIMITED.to_be_bytes()].concat();
        content.extend(string(&junction));
        content.push(VEHICLES);
        content.extend(RANGE_M.to_be_bytes());
        content.extend([3, POSITION, SPEED, ANGLE]);
        client.exchange(SUBSCRIBE_JUNCTION_CONTEXT, &content)?;
        Ok(client)
    }

    /// Requests the simulation up to a time; returns the vehicles then. SUMO answers once all its clients have requested
    /// that time.
    pub(crate) fn step_to(&mut self, time_s: f64) -> Result<Vec<SumoVehicle>, TraciError> {
        let mut answer = self.exchange(SIMULATION_STEP, &time_s.to_be_bytes())?;
        let mut vehicles = Vec::new();
        for _ in 0..answer.u32()? {
            let mut command = answer.command()?;
            if command.u8()? == SUBSCRIBE_JUNCTION_CONTEXT + RESPONSE {
                command.vehicles(&mut vehicles)?;
            }
        }
        self.time_s = time_s;
        Ok(vehicles)
    }

    /// Announces the end of the connection, so that SUMO goes on without this client.
    pub(crate) fn close(mut self) {
        let _ = self.exchange(CLOSE, &[]);
    }

    /// Value of a variable of the simulation or of a kind of object.
    fn get(&mut self, command: u8, variable: u8, kind: u8) -> Result<Answer, TraciError> {
        let mut answer = self.exchange(command, &[&[variable][..], &string("")].concat())?;
        let mut value = answer.command()?;
        if (value.u8()?, value.u8()?) != (command + RESPONSE, variable) {
            return Err(TraciError::Form("another answer was expected"));
        }
        value.string()?;
        value.expect(kind)?;
        Ok(value)
    }

    /// Sends a command and returns the answer after its status.
    fn exchange(&mut self, command: u8, content: &[u8]) -> Result<Answer, TraciError> {
        // A length of 0 announces one of four bytes. All lengths include themselves.
        let length = content.len() + 6;
        let mut message = (length as u32 + 4).to_be_bytes().to_vec();
        message.push(0);
        message.extend((length as u32).to_be_bytes());
        message.push(command);
        message.extend(content);
        self.stream.write_all(&message)?;

        let mut length = [0; 4];
        self.stream.read_exact(&mut length)?;
        let length = u32::from_be_bytes(length) as usize;
        if !(4..=MESSAGE_MAX).contains(&length) {
            return Err(TraciError::Form("length of a message"));
        }
        let mut bytes = vec![0; length - 4];
        self.stream.read_exact(&mut bytes)?;
        let mut answer = Answer { bytes, at: 0 };
        let mut status = answer.command()?;
        if status.u8()? != command {
            return Err(TraciError::Form("the status of another command"));
        }
        match status.u8()? {
            0 => Ok(answer),
            _ => Err(TraciError::Refused(status.string()?.chars().filter(|sign| !sign.is_control()).collect())),
        }
    }
}

const FORM_NUMBER: TraciError = TraciError::Form("a number out of range");

/// A string with its length.
fn string(text: &str) -> Vec<u8> {
    [&(text.len() as u32).to_be_bytes()[..], text.as_bytes()].concat()
}

/// Received bytes, and how many of them are read.
#[derive(Debug)]
struct Answer {
    bytes: Vec<u8>,
    at: usize,
}

impl Answer {
    fn take(&mut self, count: usize) -> Result<&[u8], TraciError> {
        let end = self.at.checked_add(count).filter(|end| *end <= self.bytes.len());
        let taken = end.ok_or(TraciError::Form("a message is too short"))?;
        let bytes = &self.bytes[self.at..taken];
        self.at = taken;
        Ok(bytes)
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], TraciError> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N)?);
        Ok(array)
    }

    fn u8(&mut self) -> Result<u8, TraciError> {
        self.array().map(u8::from_be_bytes)
    }

    fn u32(&mut self) -> Result<u32, TraciError> {
        self.array().map(u32::from_be_bytes)
    }

    fn f64(&mut self) -> Result<f64, TraciError> {
        self.array().map(f64::from_be_bytes)
    }

    fn string(&mut self) -> Result<String, TraciError> {
        let length = self.u32()? as usize;
        if length > NAME_MAX {
            return Err(TraciError::Form("a name is too long"));
        }
        Ok(String::from_utf8_lossy(self.take(length)?).into_owned())
    }

    fn expect(&mut self, kind: u8) -> Result<(), TraciError> {
        if self.u8()? == kind { Ok(()) } else { Err(TraciError::Form("a value of another type was expected")) }
    }

    /// The next command, without its length.
    fn command(&mut self) -> Result<Self, TraciError> {
        let (length, own) = match self.u8()? {
            0 => (self.u32()? as usize, 5),
            length => (usize::from(length), 1),
        };
        let length = length.checked_sub(own).ok_or(TraciError::Form("length of a command"))?;
        Ok(Self { bytes: self.take(length)?.to_vec(), at: 0 })
    }

    /// Appends the vehicles of a context subscription, without those whose numbers are out of range.
    fn vehicles(&mut self, to: &mut Vec<SumoVehicle>) -> Result<(), TraciError> {
        self.string()?;
        self.expect(VEHICLES)?;
        let variables = self.u8()?;
        for _ in 0..self.u32()? {
            let name = self.string()?;
            let (mut position_m, mut speed_m_s, mut course_deg) = ([f64::NAN; 2], f64::NAN, f64::NAN);
            for _ in 0..variables {
                let variable = self.u8()?;
                if self.u8()? != 0 {
                    return Err(TraciError::Form("a variable is unknown"));
                }
                match (variable, self.u8()?) {
                    (POSITION, TYPE_POSITION_2D) => position_m = [self.f64()?, self.f64()?],
                    (SPEED, TYPE_DOUBLE) => speed_m_s = self.f64()?,
                    (ANGLE, TYPE_DOUBLE) => course_deg = self.f64()?,
                    _ => return Err(TraciError::Form("another variable was expected")),
                }
            }
            let is_valid = position_m.iter().all(|m| m.abs() <= COORDINATE_MAX_M)
                && (0.0..=SPEED_MAX_M_S).contains(&speed_m_s)
                && (-360.0..=360.0).contains(&course_deg);
            if is_valid {
                to.push(SumoVehicle { name, position_m, speed_m_s, course_deg });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
