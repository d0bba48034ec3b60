//! Bytes of MAVLink 2 frames to messages and back, with message signing.
//!
//! MAVLink 1 frames are dropped: they cannot be signed. With a key, unsigned, wrongly signed and replayed frames are
//! dropped, too (<https://mavlink.io/en/guide/message_signing.html>).

use std::collections::VecDeque;
use std::io::{self, Read};

use mavlink::dialects::ardupilotmega::MavMessage;
use mavlink::error::MessageReadError;
use mavlink::{
    MAVLinkMessageRaw, MAVLinkV2MessageRaw, MavHeader, MavlinkReader, MavlinkVersion, Message, SigningConfig,
    SigningData,
};

use crate::time_stamps::TimeStamps;

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
    key: Option<[u8; 32]>,
    system_id: u8,
    sequence: u8,
    stream: MavlinkReader<Buffered>,
    time_stamps: TimeStamps,
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
        let key = signing.map(|signing| signing.key);
        let signing = signing.map(|SigningKey { key, link_id }| {
            SigningData::from_config(SigningConfig::new(*key, *link_id, true, false))
        });
        Self {
            signing,
            key,
            system_id,
            sequence: 0,
            stream: MavlinkReader::new(Buffered::default()),
            time_stamps: TimeStamps::new(),
        }
    }

    /// Takes over the time stamps of an earlier session: frames with older ones are dropped, and sent frames have newer
    /// ones. Without signing, it has no effect.
    pub fn restore(&mut self, known: &TimeStamps) {
        let (Some(signing), Some(key)) = (&self.signing, &self.key) else { return };
        // The newest stream comes first: then another one that is more than a minute older is refused as a new stream.
        let mut streams: Vec<_> = known.iter().collect();
        streams.sort_by_key(|(_, stamp)| core::cmp::Reverse(**stamp));
        for ((link_id, system_id, component_id), stamp) in streams {
            // The crate stores the time stamp of a frame that is valid; there is no other way to set it.
            let mut frame = MAVLinkV2MessageRaw::new();
            let header = MavHeader { system_id: (*system_id).into(), component_id: *component_id, sequence: 0 };
            frame.serialize_message_for_signing(header, &crate::command::heartbeat());
            frame.signature_timestamp_bytes_mut().copy_from_slice(&stamp.to_le_bytes()[..6]);
            *frame.signature_link_id_mut() = *link_id;
            let mut signature = [0; 6];
            frame.calculate_signature(key, &mut signature);
            frame.signature_value_mut().copy_from_slice(&signature);
            signing.verify_signature(&frame);
        }
        self.time_stamps.clone_from(known);
    }

    /// Time stamps of the last valid frame of each stream, sent frames included.
    pub fn time_stamps(&self) -> &TimeStamps {
        &self.time_stamps
    }

    /// Decodes all frames of a datagram. A truncated frame at its end is dropped, so that a damaged datagram does not
    /// affect the next one.
    pub fn decode_datagram(&mut self, bytes: &[u8], mut hear: impl FnMut(MavHeader, MavMessage)) {
        // Each error is a dropped frame; the reader goes on behind it. A frame has at least 12 bytes, an error at least
        // one.
        let mut reader = MavlinkReader::with_capacity(512, bytes);
        for _ in 0..=bytes.len() {
            if !decode_next(&mut reader, self.signing.as_ref(), &mut self.time_stamps, &mut hear) {
                return;
            }
        }
    }

    /// Decodes all complete frames of a stream (TCP, serial) up to the received bytes.
    pub fn decode_stream(&mut self, bytes: &[u8], mut hear: impl FnMut(MavHeader, MavMessage)) {
        let Self { signing, stream, time_stamps, .. } = self;
        for chunk in bytes.chunks(BUFFER_MAX) {
            stream.get_mut().0.extend(chunk);
            for _ in 0..=BUFFER_MAX {
                if !decode_next(stream, signing.as_ref(), time_stamps, &mut hear) {
                    break;
                }
            }
        }
    }

    /// Encodes a message of this companion computer, signed if there is a key.
    pub fn encode(&mut self, message: &MavMessage) -> Vec<u8> {
        let component_id = COMPANION_COMPONENT_ID;
        let header = MavHeader { system_id: self.system_id.into(), component_id, sequence: self.sequence };
        self.sequence = self.sequence.wrapping_add(1);
        let frame = encode_as(header, message, self.signing.as_ref());
        // The signature is the link id, the time stamp and six bytes.
        if let (true, Some([link_id, stamp @ ..])) = (self.signing.is_some(), frame.last_chunk::<13>()) {
            let mut bytes = [0; 8];
            bytes[..6].copy_from_slice(&stamp[..6]);
            self.time_stamps.insert((*link_id, self.system_id, component_id), u64::from_le_bytes(bytes));
        }
        frame
    }
}

/// Decodes the next frame of a reader. Returns false if the reader has no complete frame.
fn decode_next<R: Read>(
    reader: &mut MavlinkReader<R>,
    signing: Option<&SigningData>,
    time_stamps: &mut TimeStamps,
    hear: &mut impl FnMut(MavHeader, MavMessage),
) -> bool {
    let frame = match reader.read_raw_message_signed::<MavMessage>(MavlinkVersion::V2, signing) {
        Ok(MAVLinkMessageRaw::V2(frame)) => frame,
        Err(MessageReadError::Io(_)) => return false,
        Ok(MAVLinkMessageRaw::V1(_)) | Err(_) => return true,
    };
    let (system_id, component_id) = (frame.system_id(), frame.component_id());
    if let (true, Ok(system_id)) = (signing.is_some(), u8::try_from(system_id)) {
        let stream = (frame.signature_link_id(), system_id, component_id);
        time_stamps.insert(stream, frame.signature_timestamp());
    }
    let header = MavHeader { system_id, component_id, sequence: frame.sequence() };
    if let Ok(message) = MavMessage::parse(MavlinkVersion::V2, frame.message_id(), frame.payload()) {
        hear(header, message);
    }
    true
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
