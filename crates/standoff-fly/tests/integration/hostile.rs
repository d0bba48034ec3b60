//! Hostile, damaged, replayed and wrongly signed streams change nothing and crash nothing.

use crate::common::flight::{Flight, config};
use mavlink::MavHeader;
use mavlink::dialects::ardupilotmega::{HEARTBEAT_DATA, MavAutopilot, MavMessage, MavModeFlag};
use standoff_fly::authority::State;
use standoff_fly::codec::{Codec, SigningKey, clock_stamp, encode_as};

fn key(byte: u8) -> SigningKey {
    SigningKey { key: [byte; 32], link_id: 7 }
}

/// Key of another sender, and a time stamp `later` after now, in units of 10 us.
fn signing(byte: u8, later: u64) -> (SigningKey, u64) {
    (SigningKey { key: [byte; 32], link_id: 9 }, clock_stamp() + later)
}

/// Heartbeat of a disarmed vehicle in MANUAL, which ends the commands if it counts.
fn takeover(system_id: u32, component_id: u8, signing: Option<(SigningKey, u64)>) -> Vec<u8> {
    let heartbeat = HEARTBEAT_DATA {
        autopilot: MavAutopilot::MAV_AUTOPILOT_ARDUPILOTMEGA,
        base_mode: MavModeFlag::empty(),
        custom_mode: 0,
        ..HEARTBEAT_DATA::default()
    };
    encode_as(
        MavHeader { system_id, component_id, sequence: 0 },
        &MavMessage::HEARTBEAT(heartbeat),
        signing.as_ref().map(|(key, stamp)| (key, *stamp)),
    )
}

fn engaged(key: Option<&SigningKey>) -> Flight {
    let mut flight = Flight::new(config(), key);
    flight.fly(20.0);
    assert_eq!(flight.companion.authority(), State::Engaged);
    flight
}

/// In PX4, the number of GUIDED is another mode.
#[test]
fn another_autopilot_is_not_commanded() {
    let mut flight = Flight::new(config(), None);
    flight.vehicle.autopilot = MavAutopilot::MAV_AUTOPILOT_PX4;
    flight.fly(30.0);
    assert_eq!(flight.companion.authority(), State::Waiting);
    assert!(flight.companion.vehicle.heartbeat.is_none() && flight.companion.vehicle.is_other_autopilot());
    flight.vehicle.autopilot = MavAutopilot::MAV_AUTOPILOT_ARDUPILOTMEGA;
    flight.fly(2.0);
    assert!(flight.companion.vehicle.heartbeat.is_some() && !flight.companion.vehicle.is_other_autopilot());
}

#[test]
fn a_signed_flight_engages_and_ignores_unsigned_and_wrongly_signed_frames() {
    let mut flight = engaged(Some(&key(1)));
    let before = flight.companion.vehicle.heartbeat;
    for frame in [takeover(1, 1, None), takeover(1, 1, Some(signing(2, 0)))] {
        flight.hear(&frame);
        assert_eq!(flight.companion.vehicle.heartbeat, before);
    }
    flight.step();
    assert_eq!(flight.companion.authority(), State::Engaged);
    // The same frame with the right key counts, once: this test can fail.
    let frame = takeover(1, 1, Some(signing(1, 0)));
    flight.hear(&frame);
    assert!(flight.companion.vehicle.heartbeat.is_some_and(|heartbeat| !heartbeat.is_armed));
    flight.fly(1.0);
    let after = flight.companion.vehicle.heartbeat;
    assert!(after.is_some_and(|heartbeat| heartbeat.is_armed));
    flight.hear(&frame);
    assert_eq!(flight.companion.vehicle.heartbeat, after, "a replayed frame counts");
}

/// Without the time stamps of the last session, frames recorded in the minute before a restart are accepted after it.
#[test]
fn frames_of_an_earlier_session_are_refused_after_a_restart() {
    let key = key(1);
    let mut before = Codec::new(1, Some(&key));
    let count = |codec: &mut Codec, datagram: &[u8]| {
        let mut count = 0;
        codec.decode_datagram(datagram, |_, _| count += 1);
        count
    };
    let recorded = [1, 2].map(|later| takeover(1, 1, Some(signing(1, later)))).concat();
    assert_eq!(count(&mut before, &recorded), 2);
    let sent = before.encode(&standoff_fly::command::heartbeat());
    assert_eq!(count(&mut Codec::new(1, Some(&key)), &recorded), 2, "this test can fail");
    let mut after = Codec::new(1, Some(&key));
    after.restore(before.time_stamps().clone());
    assert_eq!(count(&mut after, &recorded), 0);
    assert_eq!(count(&mut after, &takeover(1, 1, Some(signing(1, 1_000)))), 1);
    // Sent frames go on after those of the last session, even if the clock was set back.
    let ahead = before.time_stamps().iter().map(|(stream, stamp)| (*stream, stamp + 1_000_000)).collect();
    after.restore(ahead);
    after.encode(&standoff_fly::command::heartbeat());
    let stamp = |codec: &Codec| codec.time_stamps()[&(7, 1, 191)];
    assert!(stamp(&after) >= stamp(&before) + 1_000_000 && !sent.is_empty());
}

#[test]
fn messages_of_other_systems_and_components_are_ignored() {
    let mut flight = engaged(None);
    let before = flight.companion.vehicle.heartbeat;
    for (system_id, component_id) in [(2, 1), (1, 190), (1, 191), (255, 190)] {
        flight.hear(&takeover(system_id, component_id, None));
        assert_eq!(flight.companion.vehicle.heartbeat, before, "{system_id} {component_id}");
    }
    flight.hear(&takeover(1, 1, None));
    assert_ne!(flight.companion.vehicle.heartbeat, before);
}

/// A replayed recording of the whole flight, minutes old, leaves the state of the vehicle as it is.
#[test]
fn replayed_telemetry_is_dropped_by_its_time_stamps() {
    let mut flight = engaged(None);
    let mut recording = Vec::new();
    for _ in 0..50 {
        recording.extend(flight.vehicle.advance());
    }
    recording.iter().for_each(|datagram| flight.hear(datagram));
    flight.fly(30.0);
    let before = (flight.companion.vehicle.position, flight.companion.vehicle.roll);
    recording.iter().for_each(|datagram| flight.hear(datagram));
    assert_eq!((flight.companion.vehicle.position, flight.companion.vehicle.roll), before);
}

#[test]
fn damaged_and_truncated_datagrams_do_not_affect_the_next_one() {
    let mut flight = engaged(None);
    let frame = takeover(1, 1, None);
    let before = flight.companion.vehicle.heartbeat;
    for length in 0..frame.len() {
        flight.hear(&frame[..length]);
    }
    for (index, bit) in (0..frame.len()).flat_map(|index| (0..8).map(move |bit| (index, bit))) {
        let mut damaged = frame.clone();
        damaged[index] ^= 1 << bit;
        flight.hear(&damaged);
    }
    assert_eq!(flight.companion.vehicle.heartbeat, before);
    flight.hear(&frame);
    assert_ne!(flight.companion.vehicle.heartbeat, before);
}

#[test]
fn a_stream_is_decoded_in_any_pieces_and_after_any_garbage() {
    let frame = takeover(1, 1, None);
    for garbage in [&[][..], &[0xFD; 40], &[0xFE, 0xFF, 0xFD, 0x00], &frame[..frame.len() - 1]] {
        let mut codec = Codec::new(1, None);
        let mut heard = 0;
        // A cut-off frame waits for its rest, so that the first frames after it may be lost.
        let bytes = [garbage, &frame.repeat(40)].concat();
        for piece in bytes.chunks(7) {
            codec.decode_stream(piece, |_, _| heard += 1);
        }
        assert!((26..=40).contains(&heard), "{heard} after {} bytes", garbage.len());
    }
}

/// Whatever arrives on all three inputs, commands are finite and nothing panics.
#[test]
fn arbitrary_bytes_on_all_inputs_crash_nothing() {
    bolero::check!().with_iterations(200).for_each(|bytes: &[u8]| {
        let mut flight = Flight::new(config(), None);
        flight.fly(1.2);
        let now = flight.now();
        let _ = flight.companion.hear_feed(now, &String::from_utf8_lossy(bytes));
        flight.companion.hear_teammate(bytes);
        flight.hear(bytes);
        flight.decide();
        let mut codec = Codec::new(1, None);
        codec.decode_stream(bytes, |_, _| {});
    });
}

/// Valid frames of every kind of telemetry with arbitrary contents: neither a panic nor a command that is not finite.
#[test]
fn arbitrary_payloads_in_valid_frames_crash_nothing() {
    use mavlink::Message;
    bolero::check!().with_iterations(200).with_type::<(Vec<(u8, Vec<u8>)>,)>().for_each(|(payloads,)| {
        let mut flight = Flight::new(config(), None);
        flight.vehicle.set("FENCE_TYPE", 7.0);
        flight.fly(1.2);
        for (kind, payload) in payloads {
            let ids = [0, 22, 24, 30, 33, 44, 73, 74, 77, 168, 193, 242, 245, 246];
            let id = ids[usize::from(*kind) % ids.len()];
            let Ok(message) = MavMessage::parse(mavlink::MavlinkVersion::V2, id, payload) else { continue };
            let header = MavHeader { system_id: 1, component_id: 1, sequence: 0 };
            flight.hear(&encode_as(header, &message, None));
            flight.step();
        }
        let state = flight.companion.vehicle.state(flight.now());
        assert!(state.is_none_or(|state| state.position.x_m().is_finite() && state.speed_m_s.is_finite()));
    });
}
