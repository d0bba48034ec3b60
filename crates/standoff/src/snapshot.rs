//! A picture as bytes, for who was not there: in parts, checked as a whole before it is believed.
//!
//! Whoever lacks the team's past, or has another one, asks for a picture; parts come as the repair budget allows, and are
//! said again as the next report tells which have come.

use crate::message::{Ask, SnapshotPart, Stamp};
use crate::picture::Picture;
use crate::team::TeamParams;
use crate::time::Time;
use crate::uav::UavId;

/// A picture has no more parts than this: 2 MiB, some 8,000 targets.
const PARTS_MAX: usize = 4096;

/// What is offered is a newer picture after so many periods.
const OFFERED_FOR: i64 = 40;

/// A picture that is told to who asks.
#[derive(Debug, Clone, Default)]
pub(crate) struct Offer {
    pub(crate) stamp: Stamp,
    bytes: Vec<u8>,
    /// When each part was said last.
    said_at: Vec<i64>,
    made_at: i64,
}

impl Offer {
    /// A picture as it is at an instant; `None` if it is too large to be told.
    pub(crate) fn of(picture: &Picture, now: i64) -> Option<Self> {
        let bytes = postcard::to_allocvec(picture).ok()?;
        let parts = bytes.len().div_ceil(SnapshotPart::BYTES_MAX);
        let stamp = Stamp { time: picture.time, digest: picture.digest() };
        (parts <= PARTS_MAX).then(|| Self { stamp, bytes, said_at: vec![i64::MIN; parts], made_at: now })
    }

    /// Still worth being taken: it was made no more than so many periods ago, nor too many.
    pub(crate) fn is_fresh(&self, now: i64, periods: i64) -> bool {
        !self.bytes.is_empty() && now - self.made_at <= periods.min(OFFERED_FOR)
    }

    /// The next part, from one on, that who has asked at an instant lacks, and that is not on its way already.
    pub(crate) fn lacking(&self, ask: &Ask, asked_at: i64, from: u16) -> Option<u16> {
        let is_other = ask.stamp.is_some_and(|stamp| stamp != self.stamp);
        let (next, after) = if is_other { (0, 0) } else { (ask.next, ask.after) };
        let has = move |index: u16| match index.checked_sub(next) {
            None => true,
            Some(0) => false,
            Some(ahead) => ahead <= 64 && after >> (ahead - 1) & 1 == 1,
        };
        let count = self.said_at.len().min(usize::from(u16::MAX)) as u16;
        let mut parts = next.max(from)..count.min(next.saturating_add(65));
        parts.find(|index| !has(*index) && self.said_at[usize::from(*index)] < asked_at)
    }

    /// A part, said at an instant.
    pub(crate) fn part(&mut self, uav: UavId, since: Time, index: u16, now: i64, part: &mut SnapshotPart) {
        let place = usize::from(index);
        self.said_at[place] = now;
        let from = place * SnapshotPart::BYTES_MAX;
        let to = self.bytes.len().min(from + SnapshotPart::BYTES_MAX);
        (part.uav, part.since, part.stamp) = (uav, since, self.stamp);
        (part.index, part.count) = (index, self.said_at.len() as u16);
        part.bytes.clear();
        part.bytes.extend_from_slice(&self.bytes[from..to]);
    }
}

/// A picture that comes in parts.
#[derive(Debug, Clone, Default)]
pub(crate) struct Taking {
    from: Option<UavId>,
    since: Time,
    stamp: Stamp,
    parts: Vec<Option<Vec<u8>>>,
}

/// What became of a part.
#[derive(Debug)]
pub(crate) enum Taken {
    /// It is known, or of an older picture.
    Nothing,
    /// The first one; more are to come.
    First,
    /// Another one; more are to come.
    Part,
    /// All are there.
    Whole(Box<Picture>),
    /// They are not what was told of them, or no picture that could be.
    Nonsense,
}

impl Taking {
    pub(crate) fn reset(&mut self) {
        *self = Self::default();
    }

    /// What to ask of a UAV.
    pub(crate) fn ask(&mut self, of: UavId) -> Ask {
        if self.from != Some(of) {
            *self = Self { from: Some(of), ..Self::default() };
        }
        let stamp = Some(self.stamp).filter(|_| !self.parts.is_empty());
        let next = self.parts.iter().position(Option::is_none).unwrap_or(self.parts.len());
        let ahead = self.parts.iter().skip(next + 1).take(64);
        let after = ahead.zip(0..).fold(0, |after, (part, bit)| after | u64::from(part.is_some()) << bit);
        Ask { of, stamp, next: next as u16, after }
    }

    /// It is this one who was asked.
    pub(crate) fn is_asked(&self, uav: UavId) -> bool {
        self.from == Some(uav)
    }

    /// Takes in a part of whom was asked.
    pub(crate) fn take(&mut self, part: &SnapshotPart, params: &TeamParams) -> Taken {
        let SnapshotPart { since, stamp, index, count, ref bytes, .. } = *part;
        let (place, parts) = (usize::from(index), usize::from(count));
        let is_last = place + 1 == parts;
        let is_sound = place < parts
            && parts <= PARTS_MAX
            && !bytes.is_empty()
            && (bytes.len() == SnapshotPart::BYTES_MAX || is_last && bytes.len() < SnapshotPart::BYTES_MAX);
        if !is_sound {
            return Taken::Nonsense;
        }
        let is_first = (self.since, self.stamp, self.parts.len()) != (since, stamp, parts);
        if is_first {
            // An older one is over.
            if !self.parts.is_empty() && stamp.time < self.stamp.time {
                return Taken::Nothing;
            }
            (self.since, self.stamp) = (since, stamp);
            self.parts.clear();
            self.parts.resize(parts, None);
        }
        if self.parts[place].is_some() {
            return Taken::Nothing;
        }
        self.parts[place] = Some(bytes.clone());
        if self.parts.iter().any(Option::is_none) {
            return if is_first { Taken::First } else { Taken::Part };
        }
        let whole: Vec<u8> = self.parts.drain(..).flatten().flatten().collect();
        match read(&whole, self.stamp, params) {
            Some(picture) => Taken::Whole(Box::new(picture)),
            None => Taken::Nonsense,
        }
    }
}

/// The picture that these bytes are, if they are what was told of them.
fn read(bytes: &[u8], stamp: Stamp, params: &TeamParams) -> Option<Picture> {
    let (mut picture, rest) = postcard::take_from_bytes::<Picture>(bytes).ok()?;
    let is_it = rest.is_empty() && picture.time == stamp.time && picture.digest() == stamp.digest;
    (is_it && picture.make_whole(params)).then_some(picture)
}
