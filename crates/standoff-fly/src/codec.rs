//! Bytes of MAVLink 2 frames to messages and back, with message signing.
//!
//! MAVLink 1 frames are dropped: they cannot be signed. With a key, unsigned, wrongly signed and replayed frames are
//! dropped, too (<https://mavlink.io/en/guide/message_signing.html>).

use std::collections::VecDeque;
use std::io::{self, Read};

use mavlink::dialects::ardupilotmega::MavMessage;
use mavlink::error::MessageReadError;
use mavlink::{MAVLinkV2MessageRaw, MavHeader, MavlinkReader, MavlinkVersion, Message, SigningConfig, SigningData};

/// Component id of a companion computer (MAV_COMP_ID_ONBOARD_COMPUTER).
pub const COMPANION_COMPONENT_ID: u8 = 191;

/// Flag of a signed frame in the incompatibility flags.
const SIGNED: u8 = 1;

/// Maximum number of bytes of a stream that wait for decoding. A frame has at most 280.
const BUFFER_MAX: usize = 65_536;

/// Key and link id of the message signing.
#[derive(Clone, PartialEq, Eq)]
pub struct SigningKey {
    /// Secret key that the autopilot knows, too.
    pub key: [u8; 32],
    /// Number of this link; each sender with the same key needs another one.
    pub link_id: u8,
}

/// Encoder and decoder of one link.
pub struct Codec {
    signing: Option<SigningData>,
    system_id: u8,
    sequence: u8,
    stream: MavlinkReader<Buffered>,
}

/// Received bytes of a stream that are not yet decoded.
#[derive(Default)]
struct Buffered(VecDeque<u8>);

impl Read for Buffered {
    fn read(&mut self, to: &mut [u8]) -> io::Result<usize> {
        if self.0.is_empty() { Err(io::ErrorKind::WouldBlock.into()) } else { self.0.read(to) }
    }
}

impl Codec {
    /// Creates the codec of a link. `system_id` is that of the vehicle, because the companion computer is one of its
    /// components.
    pub fn new(system_id: u8, signing: Option<&SigningKey>) -> Self {
        let signing = signing.map(|SigningKey { key, link_id }| {
            SigningData::from_config(SigningConfig::new(*key, *link_id, true, false))
        });
        Self { signing, system_id, sequence: 0, stream: MavlinkReader::new(Buffered::default()) }
    }

    /// Decodes all frames of a datagram. A truncated frame at its end is dropped, so that a damaged datagram does not
    /// affect the next one.
    pub fn decode_datagram(&self, bytes: &[u8], mut hear: impl FnMut(MavHeader, MavMessage)) {
        // Each error is a dropped frame; the reader goes on behind it. A frame has at least 12 bytes, an error at least
        // one.
        let mut reader = MavlinkReader::with_capacity(512, bytes);
        for _ in 0..=bytes.len() {
            match reader.read_message_signed::<MavMessage>(MavlinkVersion::V2, self.signing.as_ref()) {
                Ok((header, message)) => hear(header, message),
                Err(MessageReadError::Io(_)) => return,
                Err(_) => {}
            }
        }
    }

    /// Decodes all complete frames of a stream (TCP, serial) up to the received bytes.
    pub fn decode_stream(&mut self, bytes: &[u8], mut hear: impl FnMut(MavHeader, MavMessage)) {
        for chunk in bytes.chunks(BUFFER_MAX) {
            self.stream.get_mut().0.extend(chunk);
            for _ in 0..=BUFFER_MAX {
                match self.stream.read_message_signed::<MavMessage>(MavlinkVersion::V2, self.signing.as_ref()) {
                    Ok((header, message)) => hear(header, message),
                    Err(MessageReadError::Io(_)) => break,
                    Err(_) => {}
                }
            }
        }
    }

    /// Encodes a message of this companion computer, signed if there is a key.
    pub fn encode(&mut self, message: &MavMessage) -> Vec<u8> {
        let component_id = COMPANION_COMPONENT_ID;
        let header = MavHeader { system_id: self.system_id.into(), component_id, sequence: self.sequence };
        self.sequence = self.sequence.wrapping_add(1);
        encode_as(header, message, self.signing.as_ref())
    }
}

/// Encodes a message of any sender.
pub fn encode_as<M: Message>(header: MavHeader, message: &M, signing: Option<&SigningData>) -> Vec<u8> {
    let mut frame = MAVLinkV2MessageRaw::new();
    match signing {
        Some(signing) => {
            frame.serialize_message_for_signing(header, message);
            debug_assert!(frame.incompatibility_flags() & SIGNED != 0);
            signing.sign_message(&mut frame);
        }
        None => frame.serialize_message(header, message),
    }
    frame.raw_bytes().to_vec()
}
