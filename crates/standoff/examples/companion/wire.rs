//! Binary encoding of messages.

use standoff::*;

/// First two bytes of every message: identify the format and its version.
const MAGIC: [u8; 2] = *b"s1";

/// Encodes a message, little-endian, in [`Message::size_bytes`] bytes. Floating-point numbers are not rounded, because
/// all agents must compute with the same bits. Ids of UAVs and cue sources are below 65,536, and so are the lengths of
/// ranges. The checksum at the end detects damage but does not protect against attackers.
pub(crate) fn encode(message: &Message) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(message.size_bytes());
    bytes.extend(MAGIC);
    match message {
        Message::Report(report) => put_report(report, &mut bytes),
        Message::Cue(cue) => put_cue(cue, &mut bytes),
        Message::Snapshot(part) => {
            let SnapshotPart { uav, start, commit_digest, index, count, bytes: part } = part;
            bytes.push(2);
            put(&mut bytes, [uav.0 as u16, *index, *count, part.len() as u16].map(u16::to_le_bytes));
            put(&mut bytes, [start.us().to_le_bytes()]);
            put_commit_digest(commit_digest, &mut bytes);
            bytes.extend(part);
        }
        Message::Traffic(traffic) => put_traffic(traffic, &mut bytes),
    }
    let checksum = crc32fast::hash(&bytes);
    put(&mut bytes, [checksum.to_le_bytes()]);
    bytes
}

fn put<const N: usize, const M: usize>(bytes: &mut Vec<u8>, values: [[u8; N]; M]) {
    bytes.extend(values.as_flattened());
}

fn put_commit_digest(commit_digest: &CommitDigest, bytes: &mut Vec<u8>) {
    put(bytes, [commit_digest.time.us().to_le_bytes(), commit_digest.digest.to_le_bytes()]);
}

fn put_report(report: &Report, bytes: &mut Vec<u8>) {
    let Report {
        uav,
        restart_count,
        sequence,
        time,
        state,
        boresight,
        detections,
        assigned_group: assignment,
        is_leaving,
        log_status,
    } = report;
    let UavState { position, heading, speed_m_s, turn_rate_rad_s, vertical } = state;
    let has_request = log_status.as_ref().is_some_and(|log_status| log_status.snapshot_request.is_some());
    let flags = [*is_leaving, assignment.is_some(), log_status.is_some(), has_request, vertical.is_some()];
    bytes.push(0);
    put(bytes, [(uav.0 as u16).to_le_bytes()]);
    put(bytes, [restart_count, sequence].map(|number| number.to_le_bytes()));
    put(bytes, [time.us().to_le_bytes()]);
    let boresight_rad = boresight.map_or(f64::NAN, Angle::rad);
    let numbers = [position.x_m(), position.y_m(), heading.rad(), *speed_m_s, *turn_rate_rad_s, boresight_rad];
    put(bytes, numbers.map(f64::to_le_bytes));
    put(bytes, [assignment.map_or(0, |group| group.0).to_le_bytes()]);
    bytes.push((0..).zip(flags).map(|(bit, is_set)| u8::from(is_set) << bit).sum());
    put(bytes, [(detections.len() as u16).to_le_bytes()]);
    put_vertical(vertical.as_ref(), bytes);
    for Detection { label, measurement } in detections {
        put(bytes, [label.0.to_le_bytes()]);
        put(bytes, [measurement.range_m, measurement.bearing.rad()].map(f64::to_le_bytes));
    }
    if let Some(log_status) = log_status {
        put_knowledge(log_status, bytes);
    }
}

fn put_knowledge(log_status: &LogStatus, bytes: &mut Vec<u8>) {
    let LogStatus {
        start,
        committed_until: committed,
        commit_digest,
        listed_after,
        received,
        degraded_at: disturbed,
        snapshot_request,
    } = log_status;
    put(bytes, [start, committed, listed_after, disturbed].map(|time| time.us().to_le_bytes()));
    put_commit_digest(commit_digest, bytes);
    put(bytes, [(received.len() as u16).to_le_bytes()]);
    for ReceivedRange { source, from, to } in received {
        let (kind, id) = match source {
            MessageSource::Uav(uav) => (0, uav.0),
            MessageSource::CueSource(cue_source) => (1, *cue_source),
        };
        bytes.push(kind);
        put(bytes, [(id as u16).to_le_bytes()]);
        put(bytes, [from.to_le_bytes()]);
        put(bytes, [(to.saturating_sub(*from).clamp(0, 65_535) as u16).to_le_bytes()]);
    }
    if let Some(SnapshotRequest { receiver, commit_digest, first_missing_part, received_mask }) = snapshot_request {
        put(bytes, [receiver.0 as u16, *first_missing_part].map(u16::to_le_bytes));
        put(bytes, [received_mask.to_le_bytes()]);
        bytes.push(u8::from(commit_digest.is_some()));
        put_commit_digest(&commit_digest.unwrap_or_default(), bytes);
    }
}

fn put_cue(cue: &Cue, bytes: &mut Vec<u8>) {
    let Cue {
        source: cue_source,
        issued_at,
        sequence: number,
        label,
        time,
        position,
        velocity,
        position_sd_m,
        velocity_sd_m_s,
    } = cue;
    bytes.push(1);
    put(bytes, [*cue_source as u16, *number].map(u16::to_le_bytes));
    put(bytes, [label.0.to_le_bytes()]);
    put(bytes, [issued_at, time].map(|time| time.us().to_le_bytes()));
    let [x_m, y_m] = [position.x_m(), position.y_m()];
    let numbers = [x_m, y_m, velocity.x_m_s(), velocity.y_m_s(), *position_sd_m, *velocity_sd_m_s];
    put(bytes, numbers.map(f64::to_le_bytes));
}

fn put_traffic(traffic: &TrafficReport, bytes: &mut Vec<u8>) {
    let TrafficReport { aircraft, time, state } = traffic;
    let UavState { position, heading, speed_m_s, turn_rate_rad_s, vertical } = state;
    bytes.push(3);
    put(bytes, [aircraft.to_le_bytes()]);
    put(bytes, [time.us().to_le_bytes()]);
    let numbers = [position.x_m(), position.y_m(), heading.rad(), *speed_m_s, *turn_rate_rad_s];
    put(bytes, numbers.map(f64::to_le_bytes));
    bytes.push(u8::from(vertical.is_some()));
    put_vertical(vertical.as_ref(), bytes);
}

fn put_vertical(vertical: Option<&Vertical>, bytes: &mut Vec<u8>) {
    if let Some(Vertical { altitude_m, climb_rate_m_s }) = vertical {
        put(bytes, [altitude_m, climb_rate_m_s].map(|number| number.to_le_bytes()));
    }
}

/// Decodes a message; `None` if the bytes are not a valid message. The agent checks the plausibility of the content.
pub(crate) fn decode(bytes: &[u8]) -> Option<Message> {
    let (content, checksum) = bytes.split_last_chunk()?;
    let is_intact = crc32fast::hash(content) == u32::from_le_bytes(*checksum);
    let mut from = Reader(content.strip_prefix(&MAGIC).filter(|_| is_intact)?);
    let message = match from.byte()? {
        0 => Message::Report(from.report()?),
        1 => Message::Cue(from.cue()?),
        2 => Message::Snapshot(from.part()?),
        3 => Message::Traffic(from.traffic()?),
        _ => return None,
    };
    from.0.is_empty().then_some(message)
}

/// Reader over the bytes that are not decoded yet.
struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (first, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(*first)
    }

    fn byte(&mut self) -> Option<u8> {
        self.take().map(|[byte]| byte)
    }

    fn short(&mut self) -> Option<u16> {
        self.take().map(u16::from_le_bytes)
    }

    fn word(&mut self) -> Option<u32> {
        self.take().map(u32::from_le_bytes)
    }

    fn long(&mut self) -> Option<u64> {
        self.take().map(u64::from_le_bytes)
    }

    fn signed(&mut self) -> Option<i64> {
        self.take().map(i64::from_le_bytes)
    }

    fn time(&mut self) -> Option<Time> {
        self.signed().map(Time::from_us)
    }

    fn number(&mut self) -> Option<f64> {
        self.take().map(f64::from_le_bytes)
    }

    fn angle(&mut self) -> Option<Angle> {
        self.number().map(Angle::from_rad)
    }

    fn position(&mut self) -> Option<Position> {
        Some(Position::from_m(self.number()?, self.number()?))
    }

    fn uav(&mut self) -> Option<UavId> {
        self.short().map(|id| UavId(id.into()))
    }

    fn commit_digest(&mut self) -> Option<CommitDigest> {
        Some(CommitDigest { time: self.time()?, digest: self.long()? })
    }

    fn report(&mut self) -> Option<Report> {
        let (uav, restart_count, sequence, time) = (self.uav()?, self.word()?, self.word()?, self.time()?);
        let (position, heading) = (self.position()?, self.angle()?);
        let (speed_m_s, turn_rate_rad_s) = (self.number()?, self.number()?);
        let boresight = Some(self.angle()?).filter(|boresight| boresight.rad().is_finite());
        let (assignment, flags) = (GroupId(self.long()?), self.byte()?);
        let is_set = |bit: u8| flags >> bit & 1 == 1;
        let (is_leaving, assignment) = (is_set(0), Some(assignment).filter(|_| is_set(1)));
        let detection_count = self.short()?;
        let vertical = if is_set(4) { Some(self.vertical()?) } else { None };
        let state = UavState { position, heading, speed_m_s, turn_rate_rad_s, vertical };
        // No memory is reserved for the announced count; it may be wrong.
        let detections = (0..detection_count).map(|_| self.detection()).collect::<Option<_>>()?;
        let log_status = if is_set(2) { Some(Box::new(self.log_status(is_set(3))?)) } else { None };
        Some(Report {
            uav,
            restart_count,
            sequence,
            time,
            state,
            boresight,
            detections,
            assigned_group: assignment,
            is_leaving,
            log_status,
        })
    }

    fn vertical(&mut self) -> Option<Vertical> {
        Some(Vertical { altitude_m: self.number()?, climb_rate_m_s: self.number()? })
    }

    fn detection(&mut self) -> Option<Detection> {
        let label = TargetLabel(self.word()?);
        Some(Detection {
            label,
            measurement: RangeBearingMeasurement { range_m: self.number()?, bearing: self.angle()? },
        })
    }

    fn log_status(&mut self, has_request: bool) -> Option<LogStatus> {
        let (start, committed, listed_after) = (self.time()?, self.time()?, self.time()?);
        let (disturbed, commit_digest) = (self.time()?, self.commit_digest()?);
        let received = (0..self.short()?).map(|_| self.received()).collect::<Option<_>>()?;
        let snapshot_request = if has_request { Some(self.snapshot_request()?) } else { None };
        Some(LogStatus {
            start,
            committed_until: committed,
            commit_digest,
            listed_after,
            received,
            degraded_at: disturbed,
            snapshot_request,
        })
    }

    fn received(&mut self) -> Option<ReceivedRange> {
        let source = match (self.byte()?, u32::from(self.short()?)) {
            (0, uav) => MessageSource::Uav(UavId(uav)),
            (1, cue_source) => MessageSource::CueSource(cue_source),
            _ => return None,
        };
        let (from, more) = (self.signed()?, self.short()?);
        Some(ReceivedRange { source, from, to: from.checked_add(more.into())? })
    }

    fn snapshot_request(&mut self) -> Option<SnapshotRequest> {
        let (receiver, first_missing_part) = (self.uav()?, self.short()?);
        let (received_mask, has_commit_digest) = (self.long()?, self.byte()? == 1);
        let commit_digest = Some(self.commit_digest()?).filter(|_| has_commit_digest);
        Some(SnapshotRequest { receiver, commit_digest, first_missing_part, received_mask })
    }

    fn cue(&mut self) -> Option<Cue> {
        let (cue_source, number) = (u32::from(self.short()?), self.short()?);
        let (label, issued_at, time) = (TargetLabel(self.word()?), self.time()?, self.time()?);
        let (position, velocity) = (self.position()?, Velocity::from_m_s(self.number()?, self.number()?));
        let (position_sd_m, velocity_sd_m_s) = (self.number()?, self.number()?);
        Some(Cue {
            source: cue_source,
            issued_at,
            sequence: number,
            label,
            time,
            position,
            velocity,
            position_sd_m,
            velocity_sd_m_s,
        })
    }

    fn traffic(&mut self) -> Option<TrafficReport> {
        let (aircraft, time, position, heading) = (self.word()?, self.time()?, self.position()?, self.angle()?);
        let (speed_m_s, turn_rate_rad_s) = (self.number()?, self.number()?);
        let vertical = if self.byte()? == 1 { Some(self.vertical()?) } else { None };
        Some(TrafficReport {
            aircraft,
            time,
            state: UavState { position, heading, speed_m_s, turn_rate_rad_s, vertical },
        })
    }

    fn part(&mut self) -> Option<SnapshotPart> {
        let (uav, index, count, length) = (self.uav()?, self.short()?, self.short()?, self.short()?);
        let (start, commit_digest) = (self.time()?, self.commit_digest()?);
        let (bytes, rest) = self.0.split_at_checked(length.into())?;
        self.0 = rest;
        Some(SnapshotPart { uav, start, commit_digest, index, count, bytes: bytes.to_vec() })
    }
}
