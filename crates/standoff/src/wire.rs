//! Binary encoding of messages for a radio.
//!
//! ```text
//! message            's' u8, version u8, kind u8, content, CRC-32 (as in zip files) of all bytes before it u32
//! kind 0, report     uav u16, restart_count u32, sequence u32, time i64, state, boresight f64 (NaN: none),
//!                    assigned_group u64 (0: none), flags u8, vertical?, manoeuvre?, detections [detection],
//!                    range rates (one f32 per detection, NaN: none)?, detections [unlabelled]?,
//!                    log_status?, snapshot_request?
//! kind 1, cue        source u16, sequence u16, label u32, cue_content
//! kind 4, cue without label
//!                    source u16, sequence u16, cue_content
//! kind 2, snapshot   uav u16, start i64, commit_digest, index u16, count u16, bytes [u8]
//! kind 5, cue with priority
//!                    priority f64, has_label u8, source u16, sequence u16, label u32?, cue_content
//! kind 3, traffic    aircraft u32, time i64, state, has_vertical u8, vertical?
//!
//! cue_content        issued_at i64, time i64, x f64, y f64, velocity_x f64, velocity_y f64, position_sd f64,
//!                    velocity_sd f64
//! state              x f64, y f64, heading f64, speed f64, turn_rate f64
//! flags              sum of 1: leaving, 2: with assigned_group, 4: log_status, 8: snapshot_request, 16: vertical,
//!                    32: range rates, 64: unlabelled, 128: manoeuvre
//! vertical           altitude f64, climb_rate f64
//! manoeuvre          sum of 1: avoids an intruder, 2: turns left, 4: avoids no aircraft u8, avoided aircraft u32 (4: 0),
//!                    speed f32, turn_rate f32
//! detection          label u32, range f64, bearing f64
//! unlabelled         range f32, bearing f32, range rate f32 (NaN: none)
//! log_status         start i64, committed_until i64, listed_after i64, degraded_at i64, commit_digest,
//!                    received [range]
//! range              kind of source (0: UAV, 1: cue source) u8, id of source u16, first entry i64,
//!                    number of further entries u16
//! snapshot_request   receiver u16, first_missing_part u16, received_mask u64, has_commit_digest u8, commit_digest
//! commit_digest      time i64, digest u64
//! ```
//!
//! `[x]` is a list: its length as u16, then its elements. `x?` is only included if its flag is set. All numbers are
//! little-endian; an f64 is not rounded, because all agents must compute with the same bits. The sender rounds what it
//! sends as f32 before it uses it. Units and frames are those
//! of the fields of [`Message`]; times are microseconds. The length in bytes is [`Message::size_bytes`].
//!
//! ```
//! use standoff::{Angle, Message, Position, Time, TrafficReport, UavState, wire};
//!
//! let state = UavState::level_flight(Position::from_m(400.0, 0.0), Angle::from_deg(90.0), 40.0);
//! let message = Message::Traffic(TrafficReport { aircraft: 0, time: Time::EPOCH, state });
//! let mut bytes = wire::encode(&message)?;
//! assert_eq!(bytes.len(), message.size_bytes());
//! bytes[20] ^= 1;
//! assert_eq!(wire::decode(&bytes), Err(wire::DecodeError::Checksum));
//! bytes[20] ^= 1;
//! assert_eq!(wire::decode(&bytes), Ok(message));
//! # Ok::<(), wire::EncodeError>(())
//! ```

use crate::angle::Angle;
use crate::frame::{Position, Velocity};
use crate::group_id::GroupId;
use crate::message::{
    CommitDigest, Cue, Detection, LogStatus, Manoeuvre, Message, MessageSource, ReceivedRange, Report, SnapshotPart,
    SnapshotRequest, TargetLabel, TrafficReport,
};
use crate::sensor::RangeBearingMeasurement;
use crate::time::Time;
use crate::uav::{Aircraft, Command, UavId, UavState, Vertical};

/// Version of the encoding. It changes with every change of the layout; a decoder accepts only its own version.
const VERSION: u8 = 5;

/// First byte of every message.
const FORMAT: u8 = b's';

/// Why a message cannot be encoded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum EncodeError {
    /// An id that needs more than two bytes.
    #[error("id {0} of a UAV or cue source: must be at most 65535")]
    Id(u32),
    /// The length of a list that needs more than two bytes.
    #[error("list of {0} elements: must have at most 65535")]
    Length(usize),
    /// A received range whose last entry is before its first.
    #[error("a range of received entries ends before it starts")]
    Range,
}

/// Why bytes are not a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum DecodeError {
    /// The bytes end before the message does.
    #[error("the message is truncated")]
    Truncated,
    /// The first byte, if it is not that of this format.
    #[error("first byte {0}: must be 115 (the letter s)")]
    Format(u8),
    /// The version of another layout.
    #[error("version {0}: must be {VERSION}; install the same version on all aircraft")]
    Version(u8),
    /// The message is damaged or truncated.
    #[error("wrong checksum: the message is damaged")]
    Checksum,
    /// Undefined kind of message.
    #[error("kind of message {0}: must be at most 5")]
    Kind(u8),
    /// Flags that are undefined.
    #[error("flags {0}: undefined")]
    Flags(u8),
    /// A snapshot request without a log status.
    #[error("snapshot request without a log status")]
    Request,
    /// Undefined kind of source.
    #[error("kind of source {0}: must be 0 (UAV) or 1 (cue source)")]
    Source(u8),
    /// A received range that ends after the highest possible entry.
    #[error("a range of received entries ends after the highest possible entry")]
    Range,
    /// Number of bytes after the end of the message.
    #[error("{0} bytes after the end of the message")]
    Trailing(usize),
}

/// Encodes a message. A received range of more than 65,536 entries is shortened to that number; teammates then
/// retransmit the others. The checksum detects damage but does not protect against attackers.
pub fn encode(message: &Message) -> Result<Vec<u8>, EncodeError> {
    let mut bytes = Vec::with_capacity(message.size_bytes());
    bytes.extend([FORMAT, VERSION]);
    match message {
        Message::Report(report) => put_kind(0, report, &mut bytes),
        Message::Cue(cue) if cue.priority.is_some() => put_kind(5, &PrioritisedCue(*cue), &mut bytes),
        Message::Cue(cue) if cue.label.is_none() => put_kind(4, &UnlabelledCue(*cue), &mut bytes),
        Message::Cue(cue) => put_kind(1, cue, &mut bytes),
        Message::Snapshot(part) => put_kind(2, part, &mut bytes),
        Message::Traffic(traffic) => put_kind(3, traffic, &mut bytes),
    }?;
    bytes.extend(crc_32(&bytes).to_le_bytes());
    Ok(bytes)
}

/// Decodes a message; any bytes are allowed. The agent checks whether the content is plausible.
pub fn decode(bytes: &[u8]) -> Result<Message, DecodeError> {
    match bytes {
        [FORMAT, VERSION, ..] => {}
        [FORMAT, version, ..] => return Err(DecodeError::Version(*version)),
        [FORMAT] | [] => return Err(DecodeError::Truncated),
        [first, ..] => return Err(DecodeError::Format(*first)),
    }
    let (content, checksum) = bytes.split_last_chunk().ok_or(DecodeError::Truncated)?;
    if crc_32(content) != u32::from_le_bytes(*checksum) {
        return Err(DecodeError::Checksum);
    }
    let mut from = content.get(2..).ok_or(DecodeError::Truncated)?;
    let message = match u8::take(&mut from)? {
        0 => Message::Report(Wire::take(&mut from)?),
        1 => Message::Cue(Wire::take(&mut from)?),
        2 => Message::Snapshot(Wire::take(&mut from)?),
        3 => Message::Traffic(Wire::take(&mut from)?),
        4 => Message::Cue(UnlabelledCue::take(&mut from)?.0),
        5 => Message::Cue(PrioritisedCue::take(&mut from)?.0),
        kind => return Err(DecodeError::Kind(kind)),
    };
    if from.is_empty() { Ok(message) } else { Err(DecodeError::Trailing(from.len())) }
}

/// CRC-32 with the reflected polynomial 0xEDB88320. Messages are short, so that a table would not pay.
fn crc_32(bytes: &[u8]) -> u32 {
    let shift = |crc: u32, _| (crc >> 1) ^ (0xEDB8_8320 & (crc & 1).wrapping_neg());
    !bytes.iter().fold(!0, |crc, byte| (0..8).fold(crc ^ u32::from(*byte), shift))
}

fn put_kind(kind: u8, content: &impl Wire, to: &mut Vec<u8>) -> Result<(), EncodeError> {
    to.push(kind);
    content.put(to)
}

/// A value with an encoding.
trait Wire: Sized {
    /// Appends the bytes of the value.
    fn put(&self, to: &mut Vec<u8>) -> Result<(), EncodeError>;

    /// Removes the bytes of a value from the front.
    fn take(from: &mut &[u8]) -> Result<Self, DecodeError>;
}

macro_rules! numbers {
    ($($number:ty),+) => {$(
        impl Wire for $number {
            fn put(&self, to: &mut Vec<u8>) -> Result<(), EncodeError> {
                to.extend(self.to_le_bytes());
                Ok(())
            }

            fn take(from: &mut &[u8]) -> Result<Self, DecodeError> {
                let (first, rest) = from.split_first_chunk().ok_or(DecodeError::Truncated)?;
                *from = rest;
                Ok(Self::from_le_bytes(*first))
            }
        }
    )+};
}

numbers!(u8, u16, u32, u64, i64, f32, f64);

/// A cue without label.
struct UnlabelledCue(Cue);

/// A cue with a priority.
struct PrioritisedCue(Cue);

/// Id of a UAV or cue source, in two bytes.
struct Id(u32);

impl Wire for Id {
    fn put(&self, to: &mut Vec<u8>) -> Result<(), EncodeError> {
        u16::try_from(self.0).map_err(|_| EncodeError::Id(self.0))?.put(to)
    }

    fn take(from: &mut &[u8]) -> Result<Self, DecodeError> {
        u16::take(from).map(|id| Self(id.into()))
    }
}

impl<A: Wire, B: Wire> Wire for (A, B) {
    fn put(&self, to: &mut Vec<u8>) -> Result<(), EncodeError> {
        self.0.put(to)?;
        self.1.put(to)
    }

    fn take(from: &mut &[u8]) -> Result<Self, DecodeError> {
        Ok((A::take(from)?, B::take(from)?))
    }
}

impl<T: Wire> Wire for Vec<T> {
    fn put(&self, to: &mut Vec<u8>) -> Result<(), EncodeError> {
        u16::try_from(self.len()).map_err(|_| EncodeError::Length(self.len()))?.put(to)?;
        self.iter().try_for_each(|element| element.put(to))
    }

    fn take(from: &mut &[u8]) -> Result<Self, DecodeError> {
        // No memory is reserved for the announced length, which may be wrong.
        (0..u16::take(from)?).map(|_| T::take(from)).collect()
    }
}

/// Encodes types as other types.
macro_rules! conversions {
    ($($type:ty as $wire:ty: $to:expr, $from:expr;)+) => {$(
        impl Wire for $type {
            fn put(&self, to: &mut Vec<u8>) -> Result<(), EncodeError> {
                let convert: fn(&Self) -> $wire = $to;
                convert(self).put(to)
            }

            fn take(from: &mut &[u8]) -> Result<Self, DecodeError> {
                <$wire>::take(from).map($from)
            }
        }
    )+};
}

conversions! {
    UavId as Id: |uav| Id(uav.0), |id| Self(id.0);
    TargetLabel as u32: |label| label.0, Self;
    GroupId as u64: |group| group.0, Self;
    Time as i64: |time| time.us(), Self::from_us;
    Angle as f64: |angle| angle.rad(), Self::from_rad;
    Option<Angle> as f64: |angle| angle.map_or(f64::NAN, Angle::rad),
        |rad| Some(rad).filter(|rad| rad.is_finite()).map(Angle::from_rad);
    Position as (f64, f64): |at| (at.x_m(), at.y_m()), |(x_m, y_m)| Self::from_m(x_m, y_m);
    Velocity as (f64, f64): |of| (of.x_m_s(), of.y_m_s()), |(x_m_s, y_m_s)| Self::from_m_s(x_m_s, y_m_s);
}

/// Encodes the fields of structs in this order. The field after a semicolon follows elsewhere, if a flag announces it.
macro_rules! fields {
    ($($type:ident { $($field:ident $(as $wire:ident)?),+ $(; $elsewhere:ident)? })+) => {$(
        impl Wire for $type {
            fn put(&self, to: &mut Vec<u8>) -> Result<(), EncodeError> {
                let Self { $($field,)+ $($elsewhere: _)? } = self;
                $(
                    $(let $field = &$wire(*$field);)?
                    $field.put(to)?;
                )+
                Ok(())
            }

            fn take(from: &mut &[u8]) -> Result<Self, DecodeError> {
                $(
                    let $field = Wire::take(from)?;
                    $(let $wire($field) = $field;)?
                )+
                Ok(Self { $($field,)+ $($elsewhere: None)? })
            }
        }
    )+};
}

fields! {
    CommitDigest { time, digest }
    Vertical { altitude_m, climb_rate_m_s }
    UavState { position, heading, speed_m_s, turn_rate_rad_s; vertical }
    RangeBearingMeasurement { range_m, bearing }
    LogStatus { start, committed_until, listed_after, degraded_at, commit_digest, received; snapshot_request }
    SnapshotRequest { receiver, first_missing_part, received_mask, commit_digest }
    SnapshotPart { uav, start, commit_digest, index, count, bytes }
}

/// Removes an optional value from the front, if its flag is set.
fn take_if<T: Wire>(is_set: bool, from: &mut &[u8]) -> Result<Option<T>, DecodeError> {
    is_set.then(|| T::take(from)).transpose()
}

/// Flags in one byte, the first one in the lowest bit.
impl<const N: usize> Wire for [bool; N] {
    fn put(&self, to: &mut Vec<u8>) -> Result<(), EncodeError> {
        (0..).zip(self).map(|(bit, is_set)| u8::from(*is_set) << bit).sum::<u8>().put(to)
    }

    fn take(from: &mut &[u8]) -> Result<Self, DecodeError> {
        let flags = u8::take(from)?;
        let is_defined = u32::from(flags) >> N == 0;
        is_defined.then(|| core::array::from_fn(|bit| flags >> bit & 1 == 1)).ok_or(DecodeError::Flags(flags))
    }
}

impl Wire for Option<CommitDigest> {
    fn put(&self, to: &mut Vec<u8>) -> Result<(), EncodeError> {
        ([self.is_some()], self.unwrap_or_default()).put(to)
    }

    fn take(from: &mut &[u8]) -> Result<Self, DecodeError> {
        <([bool; 1], _)>::take(from).map(|([is_some], commit_digest)| Some(commit_digest).filter(|_| is_some))
    }
}

impl Wire for ReceivedRange {
    fn put(&self, to: &mut Vec<u8>) -> Result<(), EncodeError> {
        let Self { source, from, to: last } = self;
        match source {
            MessageSource::Uav(uav) => (0u8, *uav).put(to),
            MessageSource::CueSource(id) => (1u8, Id(*id)).put(to),
        }?;
        let further = last.saturating_sub(*from).min(u16::MAX.into());
        (*from, u16::try_from(further).map_err(|_| EncodeError::Range)?).put(to)
    }

    fn take(from: &mut &[u8]) -> Result<Self, DecodeError> {
        let source = match Wire::take(from)? {
            (0u8, Id(uav)) => MessageSource::Uav(UavId(uav)),
            (1, Id(cue_source)) => MessageSource::CueSource(cue_source),
            (kind, _) => return Err(DecodeError::Source(kind)),
        };
        let (first, further) = <(i64, u16)>::take(from)?;
        Ok(Self { source, from: first, to: first.checked_add(further.into()).ok_or(DecodeError::Range)? })
    }
}

impl Wire for Manoeuvre {
    fn put(&self, to: &mut Vec<u8>) -> Result<(), EncodeError> {
        let (is_intruder, number) = match self.avoids {
            Some(Aircraft::Uav(uav)) => (false, uav.0),
            Some(Aircraft::Intruder(number)) => (true, number),
            None => (false, 0),
        };
        let Command { speed_m_s, turn_rate_rad_s } = self.command;
        let flags = [is_intruder, self.is_left, self.avoids.is_none()];
        ((flags, number), (speed_m_s as f32, turn_rate_rad_s as f32)).put(to)
    }

    fn take(from: &mut &[u8]) -> Result<Self, DecodeError> {
        let (([is_intruder, is_left, avoids_none], number), (speed_m_s, turn_rate_rad_s)): (_, (f32, f32)) =
            Wire::take(from)?;
        let aircraft = if is_intruder { Aircraft::Intruder(number) } else { Aircraft::Uav(UavId(number)) };
        let avoids = Some(aircraft).filter(|_| !avoids_none);
        let command = Command { speed_m_s: speed_m_s.into(), turn_rate_rad_s: turn_rate_rad_s.into() };
        Ok(Self { avoids, command, is_left })
    }
}

impl Wire for Cue {
    fn put(&self, to: &mut Vec<u8>) -> Result<(), EncodeError> {
        (Id(self.source), (self.sequence, self.label.unwrap_or(TargetLabel(0)))).put(to)?;
        self.put_content(to)
    }

    fn take(from: &mut &[u8]) -> Result<Self, DecodeError> {
        let (Id(source), (sequence, label)) = Wire::take(from)?;
        Self::take_content(source, sequence, Some(label), from)
    }
}

impl Wire for UnlabelledCue {
    fn put(&self, to: &mut Vec<u8>) -> Result<(), EncodeError> {
        (Id(self.0.source), self.0.sequence).put(to)?;
        self.0.put_content(to)
    }

    fn take(from: &mut &[u8]) -> Result<Self, DecodeError> {
        let (Id(source), sequence) = Wire::take(from)?;
        Cue::take_content(source, sequence, None, from).map(Self)
    }
}

impl Wire for PrioritisedCue {
    fn put(&self, to: &mut Vec<u8>) -> Result<(), EncodeError> {
        (self.0.priority.unwrap_or(1.0), [self.0.label.is_some()]).put(to)?;
        if self.0.label.is_some() { self.0.put(to) } else { UnlabelledCue(self.0).put(to) }
    }

    fn take(from: &mut &[u8]) -> Result<Self, DecodeError> {
        let (priority, [has_label]) = Wire::take(from)?;
        let cue = if has_label { Cue::take(from)? } else { UnlabelledCue::take(from)?.0 };
        Ok(Self(Cue { priority: Some(priority), ..cue }))
    }
}

impl Cue {
    fn put_content(&self, to: &mut Vec<u8>) -> Result<(), EncodeError> {
        let Self { issued_at, time, position, velocity, position_sd_m, velocity_sd_m_s, .. } = *self;
        ((issued_at, time), ((position, velocity), (position_sd_m, velocity_sd_m_s))).put(to)
    }

    fn take_content(
        source: u32,
        sequence: u16,
        label: Option<TargetLabel>,
        from: &mut &[u8],
    ) -> Result<Self, DecodeError> {
        let ((issued_at, time), ((position, velocity), (position_sd_m, velocity_sd_m_s))) = Wire::take(from)?;
        let priority = None;
        Ok(Self {
            source,
            issued_at,
            sequence,
            label,
            time,
            position,
            velocity,
            position_sd_m,
            velocity_sd_m_s,
            priority,
        })
    }
}

/// A detection with label, without its range rate.
struct Labelled(Detection);

impl Wire for Labelled {
    fn put(&self, to: &mut Vec<u8>) -> Result<(), EncodeError> {
        (self.0.label.unwrap_or(TargetLabel(0)), self.0.measurement).put(to)
    }

    fn take(from: &mut &[u8]) -> Result<Self, DecodeError> {
        let (label, measurement) = Wire::take(from)?;
        Ok(Self(Detection { label: Some(label), measurement, range_rate_m_s: None }))
    }
}

/// A detection without label, in single precision.
struct Unlabelled(Detection);

impl Wire for Unlabelled {
    fn put(&self, to: &mut Vec<u8>) -> Result<(), EncodeError> {
        let RangeBearingMeasurement { range_m, bearing } = self.0.rounded().measurement;
        (range_m as f32, (bearing.rad() as f32, rate_to_wire(&self.0))).put(to)
    }

    fn take(from: &mut &[u8]) -> Result<Self, DecodeError> {
        let (range_m, (bearing_rad, rate)): (f32, (f32, f32)) = Wire::take(from)?;
        let measurement =
            RangeBearingMeasurement { range_m: range_m.into(), bearing: Angle::from_rad(bearing_rad.into()) };
        Ok(Self(Detection { label: None, measurement, range_rate_m_s: rate_from_wire(rate) }))
    }
}

/// Range rate of a detection, NaN if it has none.
fn rate_to_wire(detection: &Detection) -> f32 {
    detection.range_rate_m_s.map_or(f32::NAN, |rate_m_s| rate_m_s as f32)
}

fn rate_from_wire(rate_m_s: f32) -> Option<f64> {
    Some(rate_m_s.into()).filter(|rate_m_s: &f64| !rate_m_s.is_nan())
}

/// Appends the length of a list of detections and the detections.
fn put_list<T: Wire>(list: &[Detection], of: fn(Detection) -> T, to: &mut Vec<u8>) -> Result<(), EncodeError> {
    u16::try_from(list.len()).map_err(|_| EncodeError::Length(list.len()))?.put(to)?;
    list.iter().try_for_each(|detection| of(*detection).put(to))
}

impl Wire for Report {
    fn put(&self, to: &mut Vec<u8>) -> Result<(), EncodeError> {
        let (vertical, group, status) = (self.state.vertical, self.assigned_group, self.log_status.as_deref());
        let request = status.and_then(|status| status.snapshot_request);
        let (labelled, unlabelled) = Detection::split(&self.detections);
        let has_rates = labelled.iter().any(|detection| detection.range_rate_m_s.is_some());
        let flags = [
            self.is_leaving,
            group.is_some(),
            status.is_some(),
            request.is_some(),
            vertical.is_some(),
            has_rates,
            !unlabelled.is_empty(),
            self.manoeuvre.is_some(),
        ];
        ((self.uav, self.restart_count), (self.sequence, self.time)).put(to)?;
        ((self.state, self.boresight), (group.unwrap_or(GroupId(0)), flags)).put(to)?;
        vertical.iter().try_for_each(|vertical| vertical.put(to))?;
        self.manoeuvre.iter().try_for_each(|manoeuvre| manoeuvre.put(to))?;
        put_list(labelled, Labelled, to)?;
        if has_rates {
            labelled.iter().try_for_each(|detection| rate_to_wire(detection).put(to))?;
        }
        if !unlabelled.is_empty() {
            put_list(unlabelled, Unlabelled, to)?;
        }
        status.iter().try_for_each(|status| status.put(to))?;
        request.iter().try_for_each(|request| request.put(to))
    }

    fn take(from: &mut &[u8]) -> Result<Self, DecodeError> {
        let ((uav, restart_count), (sequence, time)) = Wire::take(from)?;
        let ((mut state, boresight), (group, flags)): ((UavState, _), _) = Wire::take(from)?;
        let [is_leaving, has_group, has_status, has_request, has_vertical, has_rates, has_unlabelled, has_manoeuvre] =
            flags;
        state.vertical = take_if(has_vertical, from)?;
        let manoeuvre = take_if(has_manoeuvre, from)?;
        let mut detections: Vec<Detection> = Vec::<Labelled>::take(from)?.into_iter().map(|of| of.0).collect();
        if has_rates {
            for detection in &mut detections {
                detection.range_rate_m_s = rate_from_wire(Wire::take(from)?);
            }
        }
        if let Some(unlabelled) = take_if::<Vec<Unlabelled>>(has_unlabelled, from)? {
            detections.extend(unlabelled.into_iter().map(|of| of.0));
        }
        let mut log_status = take_if::<LogStatus>(has_status, from)?.map(Box::new);
        if has_request {
            let log_status = log_status.as_mut().ok_or(DecodeError::Request)?;
            log_status.snapshot_request = Some(Wire::take(from)?);
        }
        let assigned_group = Some(group).filter(|_| has_group);
        Ok(Self {
            uav,
            restart_count,
            sequence,
            time,
            state,
            boresight,
            detections,
            assigned_group,
            is_leaving,
            manoeuvre,
            log_status,
        })
    }
}

impl Wire for TrafficReport {
    fn put(&self, to: &mut Vec<u8>) -> Result<(), EncodeError> {
        let Self { aircraft, time, state } = self;
        ((*aircraft, *time), (*state, [state.vertical.is_some()])).put(to)?;
        state.vertical.iter().try_for_each(|vertical| vertical.put(to))
    }

    fn take(from: &mut &[u8]) -> Result<Self, DecodeError> {
        let ((aircraft, time), (mut state, [has_vertical])): (_, (UavState, _)) = Wire::take(from)?;
        state.vertical = take_if(has_vertical, from)?;
        Ok(Self { aircraft, time, state })
    }
}

#[cfg(test)]
mod tests;
