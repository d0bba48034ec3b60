//! The example of docs/embedding.md works as the page describes.

#![expect(clippy::unwrap_used, reason = "helpers of tests")]

#[expect(dead_code, reason = "the example has its own main")]
#[path = "../examples/companion/main.rs"]
mod companion;

use std::f64::consts::FRAC_PI_2;

use companion::arguments::Arguments;
use companion::udp::Loss;
use companion::{Companion, PERIOD, cue, start, vehicles, wire};
use proptest::prelude::*;
use standoff::*;

/// Flies a team in one process with a common clock. Each radio loses `lose_percent` of the messages sent to it. `is_on`
/// returns whether the computer of a UAV runs at a tick. `after_tick` is called after every tick.
fn fly(
    mut team: Vec<Companion>,
    seconds: u32,
    (lose_percent, seed): (u32, u32),
    is_on: impl Fn(usize, i64) -> bool,
    mut after_tick: impl FnMut(i64, &mut Vec<Companion>),
) -> Vec<Companion> {
    let mut losses: Vec<_> = (0..).zip(&team).map(|(id, _)| Loss::new(lose_percent, seed + id)).collect();
    for tick in 0..=2 * i64::from(seconds) {
        let now = Time::from_us(tick * PERIOD.us());
        let on: Vec<usize> = (0..team.len()).filter(|uav| is_on(*uav, tick)).collect();
        let sent: Vec<_> = on.iter().map(|uav| team[*uav].observe(now)).collect();
        for (uav, (observation, _)) in on.iter().zip(&sent) {
            let others = on.iter().zip(&sent).filter(|(other, _)| *other != uav);
            let received = others.flat_map(|(_, (_, messages))| messages).filter(|_| !losses[*uav].loses());
            received.for_each(|bytes| team[*uav].hear(observation, bytes));
            team[*uav].decide(observation);
        }
        after_tick(tick, &mut team);
    }
    team
}

/// A team at the start of the mission.
fn team(uavs: u32) -> Vec<Companion> {
    (0..uavs).map(|id| Companion::new(id, 0, start(id, uavs)).unwrap()).collect()
}

/// Distance of a UAV at the end from an orbit of radius `r_d_m` around the true centre of the group, m.
fn error_m(uav: &Companion, end: Time, r_d_m: f64) -> f64 {
    (uav.own.position.distance_m(true_centre(end)) - r_d_m).abs()
}

/// Centre of the minimum enclosing circle of the vehicles, which [`TeamParams::recommended`] orbits.
fn true_centre(now: Time) -> Position {
    let positions: Vec<_> = vehicles(now).map(|(_, position, _)| position).collect();
    EnclosingCircle::of(positions.into_iter()).unwrap().centre
}

/// Flies a pair for two minutes. Returns the pair, and r_d and the number of measured vehicles of UAV 0 at each tick.
fn flown(lose_percent: u32) -> (Vec<Companion>, Vec<(f64, usize)>) {
    let (mut pair, mut history) = (team(2), Vec::new());
    // Without a radio, each UAV needs its own cues.
    pair[1].searches = lose_percent == 100;
    let pair = fly(
        pair,
        120,
        (lose_percent, 0),
        |_, _| true,
        |_, pair| {
            let team_state = pair[0].agent.team_state();
            let measured =
                team_state.tracks().iter().filter(|known| known.track.status == TrackStatus::Updated).count();
            history.push((team_state.group_of(UavId(0)).map_or(0.0, |group| group.standoff.distance_m), measured));
        },
    );
    (pair, history)
}

const END: Time = Time::from_us(120_000_000);

#[test]
fn the_pair_flies_its_orbit_at_the_desired_phase_despite_packet_loss() {
    for lose_percent in [0, 20, 50] {
        let (team, history) = flown(lose_percent);
        let r_d_m = history.last().unwrap().0;
        for uav in &team {
            assert!(error_m(uav, END, r_d_m) < 10.0, "{lose_percent}: {} m", error_m(uav, END, r_d_m));
        }
        let directions: Vec<_> = team.iter().map(|uav| (uav.own.position - true_centre(END)).direction()).collect();
        let difference_deg = (directions[1] - directions[0]).abs_rad().to_degrees();
        assert!((difference_deg - 90.0).abs() < 10.0, "{lose_percent}: {difference_deg}");
        assert!(history[4..].iter().all(|(_, measured)| *measured == 3), "{lose_percent}: {history:?}");
    }
}

/// A UAV that receives no messages is a team of one.
#[test]
fn without_a_radio_each_uav_flies_the_orbit_by_itself() {
    let (team, history) = flown(100);
    for uav in &team {
        let error_m = error_m(uav, END, history.last().unwrap().0);
        assert!(error_m < 10.0, "{error_m} m");
    }
}

/// A decoded message equals the encoded one, bit for bit, and its length is that reported by the library. Truncated or
/// extended bytes are rejected.
#[test]
fn a_decoded_message_equals_the_encoded_one() {
    let own = UavState {
        position: Position::from_m(0.1, -2e5),
        heading: Angle::from_rad(-3.0),
        speed_m_s: 41.5,
        turn_rate_rad_s: -0.1,
        vertical: None,
    };
    let plain = Report::position_only(UavId(7), Time::from_us(-5), own);
    let commit_digest = CommitDigest { time: Time::from_us(9), digest: u64::MAX - 1 };
    let measurement = RangeBearingMeasurement { range_m: 512.25, bearing: Angle::from_rad(1.5) };
    let held = |speaker, from| ReceivedRange { source: speaker, from, to: from + 65_535 };
    let log_status = |snapshot_request| LogStatus {
        start: Time::from_us(1),
        committed_until: Time::from_us(2),
        commit_digest,
        listed_after: Time::from_us(3),
        degraded_at: Time::from_us(i64::MIN),
        received: vec![held(MessageSource::Uav(UavId(4)), 8), held(MessageSource::CueSource(65_535), -1)],
        snapshot_request,
    };
    let ask = |commit_digest| {
        Some(SnapshotRequest { receiver: UavId(65_535), commit_digest, first_missing_part: 3, received_mask: 1 << 63 })
    };
    let full = |snapshot_request| Report {
        restart_count: 3,
        sequence: u32::MAX,
        boresight: Some(Angle::from_rad(0.25)),
        detections: vec![Detection { label: TargetLabel(u32::MAX), measurement }; 3],
        assigned_group: Some(GroupId(u64::MAX)),
        is_leaving: true,
        log_status: Some(Box::new(log_status(snapshot_request))),
        ..plain.clone()
    };
    let cue = Cue {
        source: 9,
        issued_at: Time::from_us(i64::MIN),
        sequence: 65_535,
        label: TargetLabel(2),
        time: Time::from_us(i64::MAX),
        position: Position::from_m(1.0, 2.0),
        velocity: Velocity::from_m_s(3.0, 4.0),
        position_sd_m: 5.0,
        velocity_sd_m_s: 6.0,
    };
    let part =
        SnapshotPart { uav: UavId(1), start: Time::from_us(4), commit_digest, index: 5, count: 6, bytes: vec![7; 512] };
    let traffic = TrafficReport { aircraft: u32::MAX, time: Time::from_us(-7), state: plain.state };
    let vertical = Some(Vertical { altitude_m: 8.0, climb_rate_m_s: -9.0 });
    let higher = TrafficReport { state: UavState { vertical, ..traffic.state }, ..traffic };
    let reports = [plain.clone(), full(None), full(ask(None)), full(ask(Some(commit_digest)))].map(Message::Report);
    for message in reports
        .into_iter()
        .chain([Message::Cue(cue), Message::Snapshot(part)])
        .chain([traffic, higher].map(Message::Traffic))
    {
        let mut bytes = wire::encode(&message);
        assert_eq!(wire::decode(&bytes), Some(message.clone()));
        assert_eq!(bytes.len(), message.size_bytes(), "{message:?}");
        assert!((0..bytes.len()).all(|length| wire::decode(&bytes[..length]).is_none()));
        bytes.push(0);
        assert_eq!(wire::decode(&bytes), None);
    }
}

/// A silent UAV delays the commits. Another UAV that restarts 20 s later still receives the team state, and soon agrees
/// with the others, at a packet loss of 20 %.
#[test]
fn a_restarted_uav_recovers_while_another_one_is_silent() {
    let (silent_from, down) = (16, 56..59);
    let is_on = |uav: usize, tick: i64| !(uav == 2 && tick >= silent_from || uav == 0 && down.contains(&tick));
    let mut took_s: Vec<f64> = Vec::new();
    for seed in 0..100 {
        let mut differ = 0;
        fly(team(4), 50, (20, 1000 * seed), is_on, |tick, team| {
            if tick + 1 == down.end {
                team[0] = Companion::new(0, 1, team[0].own).unwrap();
            }
            let assigned_uavs_by_group = team[0].assigned_uavs_by_group();
            let differs =
                [1, 3].iter().any(|uav: &usize| team[*uav].assigned_uavs_by_group() != assigned_uavs_by_group);
            if tick >= down.end && (assigned_uavs_by_group.is_empty() || differs) {
                differ = tick + 1 - down.end;
            }
        });
        took_s.push(0.5 * differ as f64);
    }
    took_s.sort_by(f64::total_cmp);
    assert!(took_s[50] <= 3.0 && took_s[95] <= 6.0, "{took_s:?}");
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

fn any_message() -> impl Strategy<Value = Message> {
    let detection = (any::<u32>(), -1e4..1e4, any_angle()).prop_map(|(label, range_m, bearing)| Detection {
        label: TargetLabel(label),
        measurement: RangeBearingMeasurement { range_m, bearing },
    });
    let header = (any_uav(), any::<u32>(), any::<u32>(), any_time(), any::<bool>(), proptest::option::of(any::<u64>()));
    let content = (
        [-1e6..1e6, -1e6..1e6, 0.0..90.0, -0.5..0.5],
        any_angle(),
        proptest::option::of(any_angle()),
        proptest::collection::vec(detection, 0..20),
        proptest::option::of(any_knowledge()),
    );
    let report =
        (header, content).prop_map(|((uav, restart_count, sequence, time, is_leaving, assignment), content)| {
            let ([x_m, y_m, speed_m_s, turn_rate_rad_s], heading, boresight, detections, log_status) = content;
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
            label,
            time,
            position,
            velocity,
            position_sd_m,
            velocity_sd_m_s,
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
        let bytes = wire::encode(&message);
        prop_assert_eq!(bytes.len(), message.size_bytes());
        prop_assert_eq!(wire::decode(&bytes), Some(message));
    }

    /// A change of any single byte is detected.
    #[test]
    fn damaged_messages_are_rejected(message in any_message(), at in any::<prop::sample::Index>(), flip in 1u8..) {
        let mut bytes = wire::encode(&message);
        bytes[at.index(message.size_bytes())] ^= flip;
        prop_assert_eq!(wire::decode(&bytes), None);
    }

    /// A manipulated message with a valid checksum is decoded or rejected, and the agent handles it.
    #[test]
    fn manipulated_messages_are_handled(message in any_message(), changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..8), cut in any::<prop::sample::Index>()) {
        let mut bytes = wire::encode(&message);
        bytes.truncate(bytes.len() - 4);
        if changes.len() % 2 == 1 {
            bytes.truncate(cut.index(bytes.len() + 1));
        }
        let has_more = bytes.len() > 3;
        for (at, byte) in changes.iter().take_while(|_| has_more) {
            // Magic number and message type stay, otherwise almost all messages would be rejected.
            let at = 3 + at.index(bytes.len() - 3);
            bytes[at] = *byte;
        }
        bytes.extend(crc32fast::hash(&bytes).to_le_bytes());
        let mut uav = Companion::new(0, 0, start(0, 2)).unwrap();
        let (observation, _) = uav.observe(Time::EPOCH);
        uav.hear(&observation, &bytes);
        let is_message = wire::decode(&bytes).is_some_and(|read| wire::encode(&read).len() == bytes.len());
        prop_assert_eq!(uav.damaged, u32::from(!is_message));
        uav.decide(&observation);
        prop_assert!(uav.command.turn_rate_rad_s.abs() <= 0.3 && (25.0..=55.0).contains(&uav.command.speed_m_s));
    }

    #[test]
    fn random_bytes_are_rejected(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        prop_assert_eq!(wire::decode(&bytes), None);
    }
}

#[test]
fn invalid_arguments_are_reported() {
    let parse = |text: &str| Arguments::parse(text.split(' ').map(str::to_owned));
    let valid = "--uav 1 --team 3 --port 4000 --seconds 5 --lose 20 --start-us 7 --restart-count 2 --at 1,-2,90";
    let Arguments { uav, team, port, seconds, lose_percent, start_us, restart_count, at } = parse(valid).unwrap();
    assert_eq!((uav, team, port, seconds, lose_percent, start_us, restart_count), (1, 3, 4000, 5, 20, Some(7), 2));
    assert_eq!(at.map(|own| (own.position, own.heading)), Some((Position::from_m(1.0, -2.0), Angle::from_deg(90.0))));
    for (invalid, expected) in [
        ("--uav 3 --team 3 --port 4000 --seconds 5", "--uav must be less than --team"),
        ("--uav 0 --team 1 --seconds 5", "--port"),
        ("--lose 101", "--lose 101: must be a whole number from 0 to 100"),
        ("--at 1,2", "--at 1,2: must be three numbers"),
        ("--at 1,2,nan", "must be"),
        ("--start-us -1", "--start-us -1"),
        ("--seconds", "--seconds: missing value"),
        ("--speed 5", "--speed: unknown option"),
    ] {
        let error = parse(invalid).unwrap_err();
        assert!(error.contains(expected) && error.contains("usage"), "{invalid}: {error}");
    }
}

/// Data rate of `team` UAVs, kbit/s: mean over all UAVs, and maximum of any UAV in any second. They circle around ten
/// vehicles for two minutes, measure all of them twice a second, and lose `lose_percent` of the messages sent to them.
fn kbit_s(team: u32, lose_percent: u32) -> [f64; 2] {
    let params = TeamParams { link: LinkModel::Lossy, ..TeamParams::table_1() };
    let mut losses: Vec<_> = (0..team).map(|id| Loss::new(lose_percent, id)).collect();
    let mut agents: Vec<_> = (0..team).map(|id| Agent::new(UavId(id), params).unwrap()).collect();
    let mut by_second = vec![vec![0; 120]; team as usize];
    for tick in 0..240 {
        let now = Time::from_us(tick * PERIOD.us());
        let position_of = |id: u32, speed_m_s: f64| Position::from_m(speed_m_s * now.s(), 40.0 * f64::from(id));
        let cues: Vec<_> = (0..10)
            .filter(|_| tick == 0)
            .map(|id| cue(now, (TargetLabel(id), position_of(id, 5.0), Velocity::from_m_s(5.0, 0.0))))
            .collect();
        let mut sent: Vec<(Observation, Vec<Message>)> = Vec::new();
        for (id, agent) in (0..).zip(&mut agents) {
            let heading = Angle::from_rad(0.1 * now.s() + f64::from(id));
            let offset = Displacement::from_polar(400.0, Angle::from_rad(heading.rad() - FRAC_PI_2));
            let position = position_of(5, 5.0) + offset;
            let own = UavState { position, heading, speed_m_s: 40.0, turn_rate_rad_s: 0.1, vertical: None };
            let measure = |id| standoff::sensor::measure(position, position_of(id, 5.0));
            let detections: Vec<_> =
                (0..10).map(|id| Detection { label: TargetLabel(id), measurement: measure(id) }).collect();
            let scan = Scan { boresight: Some(Angle::from_rad(heading.rad() + FRAC_PI_2)), detections: &detections };
            let observation = agent.observe(now, &own, Some(scan));
            let messages = agent.outbox(&observation).to_vec();
            by_second[id as usize][tick as usize / 2] +=
                messages.iter().map(|message| wire::encode(message).len()).sum::<usize>();
            sent.push((observation, messages));
        }
        for (index, agent) in agents.iter_mut().enumerate() {
            let observation = &sent[index].0;
            let others =
                sent.iter().enumerate().filter(|(other, _)| *other != index).flat_map(|(_, (_, messages))| messages);
            let received = others.filter(|_| !losses[index].loses());
            cues.iter().chain(received).for_each(|message| agent.receive(observation, message));
            agent.decide(observation);
        }
    }
    let seconds = || by_second.iter().flatten().map(|bytes| *bytes as f64 * 8e-3);
    [seconds().sum::<f64>() / seconds().count() as f64, seconds().fold(0.0, f64::max)]
}

/// Retransmissions are included.
#[test]
fn ten_targets_need_less_than_20_kbit_s_at_a_packet_loss_of_20_percent() {
    for (team, lose_percent, mean_max) in [(4, 0, 7.0), (4, 20, 20.0), (8, 20, 20.0)] {
        let [mean, max] = kbit_s(team, lose_percent);
        println!("{team} UAVs, {lose_percent} % lost: mean {mean:.1} kbit/s, maximum {max:.1} kbit/s");
        assert!(mean < mean_max, "{team} UAVs, {lose_percent} %: {mean:.1} kbit/s");
    }
}

/// A companion computer may run the agent on any thread.
#[test]
fn an_agent_can_move_to_another_thread() {
    let agent = Agent::new(UavId(3), TeamParams::table_1()).unwrap();
    assert_eq!(std::thread::spawn(move || agent.id()).join().unwrap(), UavId(3));
}

/// Without packet loss, the output of a process depends only on the mission time.
#[test]
fn the_book_quotes_the_printed_lines() {
    let page = include_str!("../../../docs/embedding.md");
    let quoted = page.split("--uav 0 --team 2 --port 47000 --seconds 120 --start-us $start\n").nth(1).unwrap();
    let mut printed = Vec::new();
    fly(team(2), 118, (0, 0), |_, _| true, |_, pair| printed.push(pair[0].line()));
    let quoted: Vec<_> = quoted.split("```").next().unwrap().lines().filter(|line| *line != "...").collect();
    assert!(quoted.len() > 3);
    for line in quoted {
        // The page omits the digest of the committed team state.
        let line = line.strip_suffix("...").unwrap_or(line);
        assert!(printed.iter().any(|printed| printed.starts_with(line)), "{line}\n{printed:#?}");
    }
}
