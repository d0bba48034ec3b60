use proptest::prelude::*;

use super::*;
use crate::agent::Agent;
use crate::math::PI;
use crate::message::{Manoeuvre, Scan};
use crate::params::{LinkModel, TeamParams};
use crate::uav::{Aircraft, Command};

/// Bytes that are written as hexadecimal digits; spaces separate fields.
fn bytes(hexadecimal: &str) -> Vec<u8> {
    let digits: Vec<u32> = hexadecimal.chars().filter_map(|digit| digit.to_digit(16)).collect();
    digits.chunks(2).map(|pair| (16 * pair[0] + pair[1]) as u8).collect()
}

/// Replaces the checksum at the end, so that only the content can be wrong.
fn with_checksum(mut content: Vec<u8>) -> Vec<u8> {
    content.extend(crc32fast::hash(&content).to_le_bytes());
    content
}

/// A message of each kind, with and without optional fields, and its bytes.
fn golden() -> Vec<(Message, Vec<u8>)> {
    let state = UavState {
        position: Position::from_m(0.1, -2e5),
        heading: Angle::from_rad(-3.0),
        speed_m_s: 41.5,
        turn_rate_rad_s: -0.125,
        vertical: None,
    };
    let vertical = Some(Vertical { altitude_m: 300.0, climb_rate_m_s: -2.5 });
    let plain = Report::position_only(UavId(7), Time::from_us(-5), state);
    let detection = |label, range_m, bearing_rad| Detection {
        label: Some(TargetLabel(label)),
        measurement: RangeBearingMeasurement { range_m, bearing: Angle::from_rad(bearing_rad) },
        range_rate_m_s: None,
    };
    let uav_range = ReceivedRange { source: MessageSource::Uav(UavId(4)), from: 8, to: 8 };
    let cue_range = ReceivedRange { source: MessageSource::CueSource(65_535), from: -1, to: 65_534 };
    let request = SnapshotRequest {
        receiver: UavId(65_534),
        commit_digest: Some(CommitDigest { time: Time::from_us(9), digest: 5 }),
        first_missing_part: 3,
        received_mask: 1 << 63,
    };
    let log_status = LogStatus {
        start: Time::from_us(1),
        committed_until: Time::from_us(2),
        commit_digest: CommitDigest { time: Time::from_us(9), digest: u64::MAX - 1 },
        listed_after: Time::from_us(3),
        received: vec![uav_range, cue_range],
        degraded_at: Time::from_us(i64::MIN),
        snapshot_request: Some(request),
    };
    let full = Report {
        uav: UavId(65_535),
        restart_count: 3,
        sequence: u32::MAX,
        time: Time::from_us(1_000_000),
        state: UavState {
            position: Position::from_m(1.0, 2.0),
            heading: Angle::from_rad(0.5),
            speed_m_s: 40.0,
            turn_rate_rad_s: 0.25,
            vertical,
        },
        boresight: Some(Angle::from_rad(-1.5)),
        detections: vec![detection(9, 512.25, 1.5), detection(u32::MAX, 100.0, -0.75)],
        assigned_group: Some(GroupId(u64::MAX)),
        is_leaving: true,
        manoeuvre: Some(Manoeuvre {
            avoids: Some(Aircraft::Intruder(258)),
            command: Command { speed_m_s: 40.5, turn_rate_rad_s: -0.25 },
            is_left: true,
        }),
        log_status: Some(Box::new(log_status)),
    };
    let cue = Cue {
        source: 9,
        issued_at: Time::from_us(i64::MIN),
        sequence: 65_535,
        label: Some(TargetLabel(2)),
        time: Time::from_us(i64::MAX),
        position: Position::from_m(1.0, 2.0),
        velocity: Velocity::from_m_s(3.0, 4.0),
        position_sd_m: 5.0,
        velocity_sd_m_s: 6.0,
        priority: None,
    };
    let unlabelled_cue = Cue { label: None, ..cue };
    let with_rate = |of: Detection, range_rate_m_s| Detection { range_rate_m_s, ..of };
    let unlabelled = |of: Detection| Detection { label: None, ..of };
    let mixed = Report {
        detections: vec![
            detection(9, 512.25, 1.5),
            with_rate(detection(10, 100.0, -0.75), Some(-2.5)),
            unlabelled(with_rate(detection(0, 200.5, 0.25), Some(3.0))),
            unlabelled(detection(0, 300.0, -1.0)),
        ],
        ..plain.clone()
    };
    let part = SnapshotPart {
        uav: UavId(1),
        start: Time::from_us(4),
        commit_digest: CommitDigest { time: Time::from_us(9), digest: 5 },
        index: 5,
        count: 6,
        bytes: vec![7, 8, 255],
    };
    let traffic = TrafficReport { aircraft: u32::MAX, time: Time::from_us(-7), state };
    let high_traffic = TrafficReport { state: UavState { vertical, ..state }, ..traffic };
    [
        (
            Message::Report(plain),
            "73 05 00  0700 00000000 00000000 fbffffffffffffff  9a9999999999b93f 00000000006a08c1
             00000000000008c0 0000000000c04440 000000000000c0bf  000000000000f87f 0000000000000000 00 0000  a31ebcdb",
        ),
        (
            Message::Report(full),
            "73 05 00  ffff 03000000 ffffffff 40420f0000000000  000000000000f03f 0000000000000040
             000000000000e03f 0000000000004440 000000000000d03f  000000000000f8bf ffffffffffffffff 9f
             0000000000c07240 00000000000004c0  03 02010000 00002242 000080be
             0200  09000000 0000000000028040 000000000000f83f  ffffffff 0000000000005940 000000000000e8bf
             0100000000000000 0200000000000000 0300000000000000 0000000000000080  0900000000000000 feffffffffffffff
             0200  00 0400 0800000000000000 0000  01 ffff ffffffffffffffff ffff
             feff 0300 0000000000000080 01 0900000000000000 0500000000000000  3107fdf4",
        ),
        (
            Message::Cue(cue),
            "73 05 01  0900 ffff 02000000 0000000000000080 ffffffffffffff7f  000000000000f03f 0000000000000040
             0000000000000840 0000000000001040  0000000000001440 0000000000001840  144c844d",
        ),
        (
            Message::Snapshot(part),
            "73 05 02  0100 0400000000000000  0900000000000000 0500000000000000  0500 0600  0300 07 08 ff  0a63d593",
        ),
        (
            Message::Traffic(traffic),
            "73 05 03  ffffffff f9ffffffffffffff  9a9999999999b93f 00000000006a08c1
             00000000000008c0 0000000000c04440 000000000000c0bf  00  9d9a716b",
        ),
        (
            Message::Traffic(high_traffic),
            "73 05 03  ffffffff f9ffffffffffffff  9a9999999999b93f 00000000006a08c1
             00000000000008c0 0000000000c04440 000000000000c0bf  01 0000000000c07240 00000000000004c0  6f49b259",
        ),
        (
            Message::Report(mixed),
            "73 05 00  0700 00000000 00000000 fbffffffffffffff  9a9999999999b93f 00000000006a08c1
             00000000000008c0 0000000000c04440 000000000000c0bf  000000000000f87f 0000000000000000 60
             0200  09000000 0000000000028040 000000000000f83f  0a000000 0000000000005940 000000000000e8bf  0000c07f 000020c0
             0200  00804843 0000803e 00004040  00009643 000080bf 0000c07f  67b548b4",
        ),
        (
            Message::Cue(unlabelled_cue),
            "73 05 04  0900 ffff 0000000000000080 ffffffffffffff7f  000000000000f03f 0000000000000040
             0000000000000840 0000000000001040  0000000000001440 0000000000001840  071b4f0b",
        ),
        (
            Message::Cue(Cue { priority: Some(2.5), ..cue }),
            "73 05 05  0000000000000440 01  0900 ffff 02000000 0000000000000080 ffffffffffffff7f  000000000000f03f 0000000000000040
             0000000000000840 0000000000001040  0000000000001440 0000000000001840  47442015",
        ),
        (
            Message::Cue(Cue { priority: Some(2.5), ..unlabelled_cue }),
            "73 05 05  0000000000000440 00  0900 ffff 0000000000000080 ffffffffffffff7f  000000000000f03f 0000000000000040
             0000000000000840 0000000000001040  0000000000001440 0000000000001840  e493e47f",
        ),
    ]
    .map(|(message, hexadecimal)| (message, bytes(hexadecimal)))
    .to_vec()
}

/// A change of the layout needs a new [`VERSION`].
#[test]
fn messages_have_the_documented_bytes() {
    for (message, bytes) in golden() {
        assert_eq!(encode(&message).unwrap(), bytes, "{message:?}");
        assert_eq!(decode(&bytes).unwrap(), message);
        assert_eq!(bytes.len(), message.size_bytes(), "{message:?}");
    }
}

#[test]
fn truncated_and_extended_messages_are_rejected() {
    for (message, mut bytes) in golden() {
        for length in 0..bytes.len() {
            let error = decode(&bytes[..length]).unwrap_err();
            assert!(matches!(error, DecodeError::Truncated | DecodeError::Checksum), "{length}: {error}");
            // With a correct checksum, the length is the only error.
            let shorter = with_checksum(bytes[..length.min(bytes.len() - 5)].to_vec());
            assert!(decode(&shorter).is_err(), "{message:?}, {length}");
        }
        bytes.truncate(bytes.len() - 4);
        bytes.push(0);
        assert_eq!(decode(&with_checksum(bytes)), Err(DecodeError::Trailing(1)), "{message:?}");
    }
}

#[test]
fn every_error_has_a_name() {
    let golden = golden();
    let changed = |index: usize, changes: &[(usize, u8)]| {
        let mut bytes = golden[index].1.clone();
        bytes.truncate(bytes.len() - 4);
        changes.iter().for_each(|(at, byte)| bytes[*at] = *byte);
        decode(&with_checksum(bytes)).unwrap_err()
    };
    let [plain, full, traffic] = [0, 1, 4];
    for (error, expected, text) in [
        (changed(plain, &[(0, b'x')]), DecodeError::Format(b'x'), "first byte 120: must be 115 (the letter s)"),
        (
            changed(plain, &[(1, 1)]),
            DecodeError::Version(1),
            "version 1: must be 5; install the same version on all aircraft",
        ),
        (changed(plain, &[(2, 6)]), DecodeError::Kind(6), "kind of message 6: must be at most 5"),
        (changed(full, &[(94, 8)]), DecodeError::Flags(8), "flags 8: undefined"),
        (changed(traffic, &[(55, 2)]), DecodeError::Flags(2), "flags 2: undefined"),
        (changed(plain, &[(77, 8)]), DecodeError::Request, "snapshot request without a log status"),
        // Two detections are announced, but the bytes end.
        (changed(plain, &[(78, 2)]), DecodeError::Truncated, "the message is truncated"),
        // The kind and the first entry of the second range.
        (changed(full, &[(212, 2)]), DecodeError::Source(2), "kind of source 2: must be 0 (UAV) or 1 (cue source)"),
        (
            changed(full, &[(222, 0x7f)]),
            DecodeError::Range,
            "a range of received entries ends after the highest possible entry",
        ),
        (decode(&[]).unwrap_err(), DecodeError::Truncated, "the message is truncated"),
        (
            decode(&[FORMAT, VERSION, 0, 0, 0, 0, 0]).unwrap_err(),
            DecodeError::Checksum,
            "wrong checksum: the message is damaged",
        ),
    ] {
        assert_eq!((error, &*error.to_string()), (expected, text));
    }
}

#[test]
fn ids_and_lengths_of_more_than_two_bytes_are_rejected_or_shortened() {
    let golden = golden();
    let Message::Report(full) = &golden[1].0 else { panic!("the second message is a report") };
    let listing = |source, from, to| {
        let mut report = full.clone();
        report.log_status.as_mut().unwrap().received = vec![ReceivedRange { source, from, to }];
        encode(&Message::Report(report))
    };
    let other = Report { uav: UavId(65_536), ..full.clone() };
    assert_eq!(encode(&Message::Report(other)), Err(EncodeError::Id(65_536)));
    assert_eq!(listing(MessageSource::CueSource(65_536), 0, 0), Err(EncodeError::Id(65_536)));
    let many = Report { detections: vec![full.detections[0]; 65_536], ..full.clone() };
    assert_eq!(encode(&Message::Report(many)), Err(EncodeError::Length(65_536)));

    let source = MessageSource::CueSource(0);
    assert_eq!(listing(source, 8, 7), Err(EncodeError::Range));
    let Ok(Message::Report(report)) = decode(&listing(source, 8, 70_008).unwrap()) else { panic!("not a report") };
    assert_eq!(report.log_status.unwrap().received, [ReceivedRange { source, from: 8, to: 65_543 }]);
}

#[test]
fn the_checksum_is_that_of_zip_files() {
    assert_eq!(crc_32(b"123456789"), 0xCBF4_3926);
    assert_eq!(crc_32(&[]), crc32fast::hash(&[]));
}

fn any_time() -> impl Strategy<Value = Time> {
    any::<i64>().prop_map(Time::from_us)
}

fn any_commit_digest() -> impl Strategy<Value = CommitDigest> {
    (any_time(), any::<u64>()).prop_map(|(time, digest)| CommitDigest { time, digest })
}

fn any_uav() -> impl Strategy<Value = UavId> {
    any::<u16>().prop_map(|id| UavId(id.into()))
}

fn any_angle() -> impl Strategy<Value = Angle> {
    (-3.1..3.1).prop_map(Angle::from_rad)
}

fn any_knowledge() -> impl Strategy<Value = LogStatus> {
    let held = (any::<u16>(), any::<bool>(), any::<i32>(), any::<u16>()).prop_map(|(id, is_uav, from, more)| {
        let speaker = if is_uav { MessageSource::Uav(UavId(id.into())) } else { MessageSource::CueSource(id.into()) };
        let from = i64::from(from) << 16;
        ReceivedRange { source: speaker, from, to: from + i64::from(more) }
    });
    let ask = (any_uav(), proptest::option::of(any_commit_digest()), any::<u16>(), any::<u64>());
    let ask = ask.prop_map(|(receiver, commit_digest, first_missing_part, received_mask)| SnapshotRequest {
        receiver,
        commit_digest,
        first_missing_part,
        received_mask,
    });
    let (times, held) = ([(); 4].map(|()| any_time()), proptest::collection::vec(held, 0..40));
    (times, any_commit_digest(), held, proptest::option::of(ask)).prop_map(
        |(times, commit_digest, held, snapshot_request)| {
            let [since, committed, listed_after, disturbed] = times;
            LogStatus {
                start: since,
                committed_until: committed,
                commit_digest,
                listed_after,
                received: held,
                degraded_at: disturbed,
                snapshot_request,
            }
        },
    )
}

/// Those with label first.
fn sorted(mut detections: Vec<Detection>) -> Vec<Detection> {
    detections.sort_by_key(|detection| detection.label.is_none());
    detections
}

fn any_message() -> impl Strategy<Value = Message> {
    let label = proptest::option::of(any::<u32>());
    let rate = proptest::option::of(-100.0..100.0);
    let detection = (label, -1e4..1e4, any_angle(), rate).prop_map(|(label, range_m, bearing, range_rate_m_s)| {
        let measurement = RangeBearingMeasurement { range_m, bearing };
        Detection { label: label.map(TargetLabel), measurement, range_rate_m_s }.rounded()
    });
    let aircraft = (any::<bool>(), any::<u32>()).prop_map(|(is_uav, number)| match is_uav {
        true => Aircraft::Uav(UavId(number)),
        false => Aircraft::Intruder(number),
    });
    let manoeuvre = (proptest::option::of(aircraft), 0.0..90.0, -0.5..0.5, any::<bool>());
    let manoeuvre = manoeuvre.prop_map(|(avoids, speed_m_s, turn_rate_rad_s, is_left)| {
        Manoeuvre { avoids, command: Command { speed_m_s, turn_rate_rad_s }, is_left }.rounded()
    });
    let header = (any_uav(), any::<u32>(), any::<u32>(), any_time(), any::<bool>(), proptest::option::of(any::<u64>()));
    let content = (
        [-1e6..1e6, -1e6..1e6, 0.0..90.0, -0.5..0.5],
        any_angle(),
        proptest::option::of(any_angle()),
        proptest::collection::vec(detection, 0..20).prop_map(sorted),
        proptest::option::of(any_knowledge()),
        proptest::option::of(manoeuvre),
    );
    let report =
        (header, content).prop_map(|((uav, restart_count, sequence, time, is_leaving, assignment), content)| {
            let ([x_m, y_m, speed_m_s, turn_rate_rad_s], heading, boresight, detections, log_status, manoeuvre) =
                content;
            let state =
                UavState { position: Position::from_m(x_m, y_m), heading, speed_m_s, turn_rate_rad_s, vertical: None };
            let (assignment, log_status) = (assignment.map(GroupId), log_status.map(Box::new));
            Message::Report(Report {
                uav,
                restart_count,
                sequence,
                time,
                state,
                boresight,
                detections,
                assigned_group: assignment,
                is_leaving,
                manoeuvre,
                log_status,
            })
        });
    let cue = (any::<[u16; 2]>(), any::<u32>(), any_time(), any_time(), [(); 6].map(|()| -1e6..1e6));
    let cue = cue.prop_map(|([searcher, number], label, issued_at, time, [x_m, y_m, vx_m_s, vy_m_s, p_m, v_m_s])| {
        let (searcher, label, position) = (searcher.into(), TargetLabel(label), Position::from_m(x_m, y_m));
        let (velocity, position_sd_m, velocity_sd_m_s) = (Velocity::from_m_s(vx_m_s, vy_m_s), p_m, v_m_s);
        Message::Cue(Cue {
            source: searcher,
            issued_at,
            sequence: number,
            label: Some(label),
            time,
            position,
            velocity,
            position_sd_m,
            velocity_sd_m_s,
            priority: None,
        })
    });
    let bytes = proptest::collection::vec(any::<u8>(), 0..=SnapshotPart::BYTES_MAX);
    let part = (any_uav(), any_time(), any_commit_digest(), any::<[u16; 2]>(), bytes);
    let part = part.prop_map(|(uav, since, commit_digest, [index, count], bytes)| {
        Message::Snapshot(SnapshotPart { uav, start: since, commit_digest, index, count, bytes })
    });
    let numbers = [-1e6..1e6, -1e6..1e6, 0.0..90.0, -0.5..0.5, 0.0..1e4, -9.0..9.0];
    let traffic = (any::<u32>(), any_time(), any_angle(), numbers, any::<bool>());
    let traffic = traffic.prop_map(|(aircraft, time, heading, numbers, has_vertical)| {
        let [x_m, y_m, speed_m_s, turn_rate_rad_s, altitude_m, climb_rate_m_s] = numbers;
        let vertical = has_vertical.then_some(Vertical { altitude_m, climb_rate_m_s });
        let state = UavState { position: Position::from_m(x_m, y_m), heading, speed_m_s, turn_rate_rad_s, vertical };
        Message::Traffic(TrafficReport { aircraft, time, state })
    });
    prop_oneof![report, cue, part, traffic]
}

proptest! {
    #[test]
    fn any_decoded_message_equals_the_encoded_one(message in any_message()) {
        let bytes = encode(&message).unwrap();
        prop_assert_eq!(bytes.len(), message.size_bytes());
        prop_assert_eq!(decode(&bytes), Ok(message));
    }

    /// A change of any single byte is detected.
    #[test]
    fn damaged_messages_are_rejected(message in any_message(), at in any::<prop::sample::Index>(), flip in 1u8..) {
        let mut bytes = encode(&message).unwrap();
        bytes[at.index(message.size_bytes())] ^= flip;
        prop_assert!(decode(&bytes).is_err());
    }

    /// A manipulated message with a valid checksum is decoded or rejected, and the agent handles it.
    #[test]
    fn manipulated_messages_are_handled(message in any_message(), changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..8), cut in any::<prop::sample::Index>()) {
        let mut bytes = encode(&message).unwrap();
        bytes.truncate(bytes.len() - 4);
        if changes.len() % 2 == 1 {
            bytes.truncate(cut.index(bytes.len() + 1));
        }
        let has_more = bytes.len() > 3;
        for (at, byte) in changes.iter().take_while(|_| has_more) {
            // Format, version and kind stay, otherwise almost all messages would be rejected.
            let at = 3 + at.index(bytes.len() - 3);
            bytes[at] = *byte;
        }
        let bytes = with_checksum(bytes);
        let params = TeamParams { link: LinkModel::Lossy, ..TeamParams::recommended() };
        let mut agent = Agent::new(UavId(0), params).unwrap();
        let own = UavState::level_flight(Position::ORIGIN, Angle::ZERO, 40.0);
        let observation = agent.observe(Time::EPOCH, &own, Some(Scan::default()));
        if let Ok(message) = decode(&bytes) {
            prop_assert_eq!(encode(&message).unwrap().len(), bytes.len());
            agent.receive(&observation, &message);
        }
        let command = agent.decide(&observation).command;
        prop_assert!(command.turn_rate_rad_s.abs() <= 0.3 && (25.0..=55.0).contains(&command.speed_m_s));
    }
}

/// The checksum of most random bytes is wrong; here, it is also correct.
#[test]
fn any_bytes_are_decoded_or_rejected() {
    bolero::check!().with_type::<(u8, Vec<u8>)>().with_iterations(5_000).for_each(|(kind, content)| {
        assert!(decode(content).is_err());
        let bytes = with_checksum([&[FORMAT, VERSION, kind % 4][..], content].concat());
        if let Ok(message) = decode(&bytes) {
            assert_eq!(message.size_bytes(), bytes.len());
        }
    });
}

/// The sender rounds as its receivers do, also for bearings next to pi, which single precision rounds up.
#[test]
fn a_received_detection_without_label_equals_the_rounded_one() {
    for bearing_rad in [PI, PI - 1e-7, 1e-7 - PI, 0.1, -1e-9] {
        let measurement = RangeBearingMeasurement { range_m: 400.1, bearing: Angle::from_rad(bearing_rad) };
        let detection = Detection { label: None, measurement, range_rate_m_s: Some(0.3) };
        let state = UavState::level_flight(Position::from_m(0.0, 0.0), Angle::ZERO, 40.0);
        let report = Report { detections: vec![detection], ..Report::position_only(UavId(1), Time::EPOCH, state) };
        let Message::Report(received) = decode(&encode(&Message::Report(report)).unwrap()).unwrap() else { panic!() };
        assert_eq!((received.detections[0], detection.rounded()), (detection.rounded(), detection.rounded().rounded()));
    }
}
