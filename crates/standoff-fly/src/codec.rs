//! Bytes of MAVLink 2 frames to messages and back, with message signing.
//!
//! MAVLink 1 frames are dropped: they cannot be signed. With a key, unsigned, wrongly signed and replayed frames are
//! dropped, too (<https://mavlink.io/en/guide/message_signing.html>).

use std::collections::VecDeque;
use std::io::{self, Read};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use mavlink::dialects::ardupilotmega::MavMessage;
use mavlink::error::MessageReadError;
use mavlink::{MAV_STX_V2, MAVLinkMessageRaw, MAVLinkV2MessageRaw, MavHeader, MavlinkReader, MavlinkVersion, Message};

use crate::command::AUTOPILOT_COMPONENT_ID;
use crate::time_stamps::{STAMP_MAX, Stream, TimeStamps};

/// Component id of a companion computer (MAV_COMP_ID_ONBOARD_COMPUTER).
pub const COMPANION_COMPONENT_ID: u8 = 191;

/// Flag of a signed frame in the incompatibility flags.
const SIGNED: u8 = 1;

/// Zero of the time stamps: 2015-01-01 00:00 UTC, seconds of UNIX time.
const STAMP_EPOCH_UNIX_S: u64 = 1_420_070_400;

/// Largest difference of the first time stamp of an unknown sender to the newest one, in units of 10 us: a minute.
const UNKNOWN_AGE_MAX: u64 = 6_000_000;

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
    signing: Option<SigningKey>,
    system_id: u8,
    sequence: u8,
    stream: MavlinkReader<Buffered>,
    time_stamps: TimeStamps,
    /// True if the autopilot has sent a frame with a right signature and an old time stamp.
    is_behind: bool,
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
        Self {
            signing: signing.cloned(),
            system_id,
            sequence: 0,
            stream: MavlinkReader::new(Buffered::default()),
            time_stamps: TimeStamps::new(),
            is_behind: false,
        }
    }

    /// Takes over the time stamps of an earlier session: frames with older ones are dropped, and sent frames have newer
    /// ones.
    pub fn restore(&mut self, known: TimeStamps) {
        self.time_stamps = known;
    }

    /// Time stamps of the last valid frame of each stream, sent frames included.
    pub fn time_stamps(&self) -> &TimeStamps {
        &self.time_stamps
    }

    /// True if the autopilot has sent a frame since the last call whose signature is right, but whose time stamp is old.
    /// ArduPlane's time stamps are no clock: they advance with the newest one that it receives. So it needs a frame.
    pub fn take_behind(&mut self) -> bool {
        core::mem::take(&mut self.is_behind)
    }

    /// Decodes all frames of a datagram. A truncated frame at its end is dropped, so that a damaged datagram does not
    /// affect the next one.
    pub fn decode_datagram(&mut self, bytes: &[u8], mut hear: impl FnMut(MavHeader, MavMessage)) {
        // Each error is a dropped frame; the reader goes on behind it. A frame has at least 12 bytes, an error at least
        // one.
        let mut reader = MavlinkReader::with_capacity(512, bytes);
        for _ in 0..=bytes.len() {
            match next_frame(&mut reader) {
                Next::Frame(frame) => self.hear(&frame, &mut hear),
                Next::Dropped => {}
                Next::End => return,
            }
        }
    }

    /// Decodes all complete frames of a stream (TCP, serial) up to the received bytes.
    pub fn decode_stream(&mut self, bytes: &[u8], mut hear: impl FnMut(MavHeader, MavMessage)) {
        for chunk in bytes.chunks(BUFFER_MAX) {
            self.stream.get_mut().0.extend(chunk);
            for _ in 0..=BUFFER_MAX {
                match next_frame(&mut self.stream) {
                    Next::Frame(frame) => self.hear(&frame, &mut hear),
                    Next::Dropped => {}
                    Next::End => break,
                }
            }
        }
    }

    /// Passes a frame on, if it is signed as required.
    fn hear(&mut self, frame: &MAVLinkV2MessageRaw, hear: &mut impl FnMut(MavHeader, MavMessage)) {
        let (system_id, component_id) = (frame.system_id(), frame.component_id());
        if let Some(signing) = &self.signing {
            let Ok(system_id) = u8::try_from(system_id) else { return };
            if !has_signature(frame, signing) {
                return;
            }
            let stream = (frame.signature_link_id(), system_id, component_id);
            let stamp = frame.signature_timestamp();
            if self.is_old(stream, stamp) {
                self.is_behind |= (system_id, component_id) == (self.system_id, AUTOPILOT_COMPONENT_ID);
                return;
            }
            self.time_stamps.insert(stream, stamp);
        }
        let header = MavHeader { system_id, component_id, sequence: frame.sequence() };
        if let Ok(message) = MavMessage::parse(MavlinkVersion::V2, frame.message_id(), frame.payload()) {
            hear(header, message);
        }
    }

    /// True for a frame that repeats an earlier one, and for the first one of a stream if it is older than a minute.
    fn is_old(&self, stream: Stream, stamp: u64) -> bool {
        match self.time_stamps.get(&stream) {
            Some(last) => stamp <= *last,
            None => stamp.saturating_add(UNKNOWN_AGE_MAX) < self.newest_stamp(),
        }
    }

    /// Newest time stamp: that of the clock, or one that was sent or received.
    fn newest_stamp(&self) -> u64 {
        self.time_stamps.values().copied().max().unwrap_or(0).max(clock_stamp())
    }

    /// Encodes a message of this companion computer, signed if there is a key.
    pub fn encode(&mut self, message: &MavMessage) -> Vec<u8> {
        let component_id = COMPANION_COMPONENT_ID;
        let header = MavHeader { system_id: self.system_id.into(), component_id, sequence: self.sequence };
        self.sequence = self.sequence.wrapping_add(1);
        let Some(signing) = &self.signing else { return encode_as(header, message, None) };
        let stream = (signing.link_id, self.system_id, component_id);
        let stamp = self.newest_stamp().max(self.time_stamps.get(&stream).map_or(0, |last| last.saturating_add(1)));
        let frame = encode_as(header, message, Some((signing, stamp)));
        self.time_stamps.insert(stream, stamp);
        frame
    }
}

/// What a reader has next.
enum Next {
    Frame(Box<MAVLinkV2MessageRaw>),
    /// A damaged frame, or one of MAVLink 1.
    Dropped,
    /// No complete frame.
    End,
}

fn next_frame<R: Read>(reader: &mut MavlinkReader<R>) -> Next {
    match reader.read_raw_message::<MavMessage>(MavlinkVersion::V2) {
        Ok(MAVLinkMessageRaw::V2(frame)) => Next::Frame(Box::new(frame)),
        Err(MessageReadError::Io(_)) => Next::End,
        Ok(MAVLinkMessageRaw::V1(_)) | Err(_) => Next::Dropped,
    }
}

/// True if a frame has the signature that the key gives.
fn has_signature(frame: &MAVLinkV2MessageRaw, signing: &SigningKey) -> bool {
    let mut signature = [0; 6];
    let is_signed = frame.incompatibility_flags() & SIGNED != 0;
    if is_signed {
        frame.calculate_signature(&signing.key, &mut signature);
    }
    is_signed && frame.signature_value() == signature
}

/// True for a datagram that begins with a heartbeat of a vehicle's autopilot.
pub(crate) fn is_heartbeat(datagram: &[u8], system_id: u8) -> bool {
    // Start, three bytes of length and flags, sequence, system and component id, and the three bytes of the message id.
    let header = datagram.first_chunk::<10>();
    header.is_some_and(|[start, _, _, _, _, system, component, id @ ..]| {
        (*start, *system, *component, *id) == (MAV_STX_V2, system_id, AUTOPILOT_COMPONENT_ID, [0; 3])
    })
}

/// Time since the zero of the time stamps by the clock of this computer, in units of 10 us; 0 before it.
pub fn clock_stamp() -> u64 {
    stamp_at(SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default())
}

/// Time stamp at a UNIX time.
fn stamp_at(unix: Duration) -> u64 {
    let us = unix.as_micros().saturating_sub(u128::from(STAMP_EPOCH_UNIX_S) * 1_000_000);
    u64::try_from(us / 10).unwrap_or(u64::MAX)
}

/// Encodes a message of any sender; with a key and a time stamp, it is signed.
pub fn encode_as<M: Message>(header: MavHeader, message: &M, signature: Option<(&SigningKey, u64)>) -> Vec<u8> {
    let mut frame = MAVLinkV2MessageRaw::new();
    match signature {
        Some((SigningKey { key, link_id }, stamp)) => {
            frame.serialize_message_for_signing(header, message);
            *frame.signature_link_id_mut() = *link_id;
            frame.signature_timestamp_bytes_mut().copy_from_slice(&stamp.min(STAMP_MAX).to_le_bytes()[..6]);
            let mut signature = [0; 6];
            frame.calculate_signature(key, &mut signature);
            frame.signature_value_mut().copy_from_slice(&signature);
        }
        None => frame.serialize_message(header, message),
    }
    frame.raw_bytes().to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_stamps_begin_in_2015_in_units_of_10_us() {
        // `date -u -d 2015-01-01 +%s`.
        let at =
            |after_us: i64| stamp_at(Duration::from_micros(1_420_070_400_000_000u64.saturating_add_signed(after_us)));
        assert_eq!([i64::MIN, -1, 9, 10, 1_000_000].map(at), [0, 0, 0, 1, 100_000]);
    }

    #[test]
    fn only_heartbeats_of_the_vehicles_autopilot_are_recognised_by_their_first_bytes() {
        let heartbeat = crate::command::heartbeat();
        for (system_id, component_id, is_its) in [(1, 1, true), (2, 1, false), (1, 191, false)] {
            let frame = encode_as(MavHeader { system_id, component_id, sequence: 3 }, &heartbeat, None);
            assert_eq!(is_heartbeat(&frame, 1), is_its);
        }
        let roll =
            encode_as(MavHeader { system_id: 1, component_id: 1, sequence: 3 }, &crate::command::roll(1, 0.1), None);
        assert!(!is_heartbeat(&roll, 1) && !is_heartbeat(&roll[..9], 1));
    }
}
