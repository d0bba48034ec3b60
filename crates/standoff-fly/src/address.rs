//! Address of a link to the autopilot.

use core::fmt;
use std::str::FromStr;

/// Transport and address of a link to the autopilot.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LinkAddress {
    /// Listens for UDP datagrams, and answers to the vehicle's address.
    UdpIn(String),
    /// Sends UDP datagrams to an address.
    UdpOut(String),
    /// Connects to a TCP server.
    Tcp(String),
    /// Serial port: device and baud rate.
    Serial(String, u32),
}

/// Forms of an address, for messages.
const FORMS: &str =
    "udpin:HOST:PORT, udpout:HOST:PORT, tcp:HOST:PORT or serial:DEVICE:BAUD, for example udpin:127.0.0.1:14550";

impl FromStr for LinkAddress {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let error = |what: &str| format!("`{text}`: {what}; write {FORMS}");
        let (kind, address) = text.split_once(':').ok_or_else(|| error("not an address"))?;
        let (host, last) = address.rsplit_once(':').ok_or_else(|| error("the port or baud rate is missing"))?;
        if host.is_empty() {
            return Err(error("the host or device is missing"));
        }
        if kind == "serial" {
            let baud = last.parse().ok().filter(|baud| (1200..=10_000_000).contains(baud));
            let baud = baud.ok_or_else(|| error("the baud rate must be between 1200 and 10000000"))?;
            return Ok(Self::Serial(host.to_owned(), baud));
        }
        if !last.parse::<u16>().is_ok_and(|port| port > 0) {
            return Err(error("the port must be between 1 and 65535"));
        }
        match kind {
            "udpin" => Ok(Self::UdpIn(address.to_owned())),
            "udpout" => Ok(Self::UdpOut(address.to_owned())),
            "tcp" => Ok(Self::Tcp(address.to_owned())),
            _ => Err(error("unknown transport")),
        }
    }
}

impl fmt::Display for LinkAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::UdpIn(address) => write!(f, "udpin:{address}"),
            Self::UdpOut(address) => write!(f, "udpout:{address}"),
            Self::Tcp(address) => write!(f, "tcp:{address}"),
            Self::Serial(device, baud) => write!(f, "serial:{device}:{baud}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_parsed_and_errors_state_the_forms() {
        for text in ["udpin:127.0.0.1:14550", "udpout:[::1]:14550", "tcp:plane.local:5762", "serial:/dev/ttyS1:57600"] {
            assert_eq!(text.parse::<LinkAddress>().unwrap().to_string(), text);
        }
        for (text, what) in [
            ("127.0.0.1", "not an address"),
            ("udp:127.0.0.1:1", "unknown transport"),
            ("udpin:14550", "the port or baud rate is missing"),
            ("udpin::14550", "the host or device is missing"),
            ("tcp:host:0", "the port must be"),
            ("tcp:host:65536", "the port must be"),
            ("serial:/dev/ttyS1:fast", "the baud rate must be"),
        ] {
            let error = text.parse::<LinkAddress>().unwrap_err();
            assert!(error.contains(what) && error.contains("for example udpin:127.0.0.1:14550"), "{error}");
        }
    }
}
