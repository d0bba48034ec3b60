//! Malformed messages from teammates are rejected and counted, and do not affect the team state.

use crate::common::{Team, report, scan_of, step};
use proptest::prelude::*;
use standoff::message::CommitDigest;
use standoff::message::MessageSource;
use standoff::message::ReceivedRange;
use standoff::*;

const PERIOD_US: i64 = 500_000;

/// Faults of a message.
#[derive(Debug, Clone, Copy)]
enum Wrong {
    State(f64),
    Boresight(f64),
    Past,
    OffGrid,
    Ahead,
    Future,
    Held(Unlisted),
    CuePosition(f64),
    CueVelocity(f64),
    CueSd(f64),
    CueFromTheFuture,
    CueOffGrid,
    CueAhead,
}

/// Faults of the received ranges in a log status.
#[derive(Debug, Clone, Copy)]
enum Unlisted {
    Backward,
    OutOfOrder,
    Overlapping,
    TooLong,
}

fn not_finite() -> impl Strategy<Value = f64> {
    prop_oneof![Just(f64::NAN), Just(f64::INFINITY), Just(f64::NEG_INFINITY)]
}

fn anything_wrong() -> impl Strategy<Value = Wrong> {
    prop_oneof![
        not_finite().prop_map(Wrong::State),
        not_finite().prop_map(Wrong::Boresight),
        Just(Wrong::Past),
        Just(Wrong::OffGrid),
        Just(Wrong::Ahead),
        Just(Wrong::Future),
        prop_oneof![
            Just(Unlisted::Backward),
            Just(Unlisted::OutOfOrder),
            Just(Unlisted::Overlapping),
            Just(Unlisted::TooLong)
        ]
        .prop_map(Wrong::Held),
        not_finite().prop_map(Wrong::CuePosition),
        not_finite().prop_map(Wrong::CueVelocity),
        prop_oneof![not_finite(), Just(0.0), -1e300..0.0f64].prop_map(Wrong::CueSd),
        Just(Wrong::CueFromTheFuture),
        Just(Wrong::CueOffGrid),
        Just(Wrong::CueAhead),
    ]
}

impl Wrong {
    /// Returns a message with this fault, from a UAV outside the team or about a target that does not exist.
    fn message(self, now: Time, like: &Report) -> Message {
        let mut report = Report { uav: UavId(77), restart_count: 9, sequence: 1, ..like.clone() };
        let mut cue = Cue {
            source: 9,
            issued_at: now,
            sequence: 0,
            label: Some(TargetLabel(99)),
            time: now,
            position: Position::ORIGIN,
            velocity: Velocity::ZERO,
            position_sd_m: 20.0,
            velocity_sd_m_s: 2.0,
            priority: None,
        };
        let moved = |us| Time::from_us(now.us().saturating_add(us));
        match self {
            Self::State(value) => report.state.speed_m_s = value,
            Self::Boresight(value) => report.boresight = Some(Angle::from_rad(value)),
            // Before the start of this agent.
            Self::Past => report.time = moved(-100 * PERIOD_US),
            // More than a tenth of a period off the grid.
            Self::OffGrid => report.time = moved(PERIOD_US / 10 + 1),
            // More than the teammate timeout ahead.
            Self::Ahead => report.time = moved(7 * PERIOD_US),
            Self::Future => report.time = moved(i64::MAX),
            Self::Held(wrong) => {
                let held = |uav, from, to| ReceivedRange { source: MessageSource::Uav(UavId(uav)), from, to };
                report.log_status.get_or_insert_default().received = match wrong {
                    Unlisted::Backward => vec![held(1, 1, 0)],
                    Unlisted::OutOfOrder => vec![held(2, 0, 0), held(1, 0, 0)],
                    Unlisted::Overlapping => vec![held(1, 0, 1), held(1, 1, 2)],
                    Unlisted::TooLong => (0..1025).map(|step| held(1, 2 * step, 2 * step)).collect(),
                };
            }
            Self::CuePosition(value) => cue.position = Position::from_m(value, 0.0),
            Self::CueVelocity(value) => cue.velocity = Velocity::from_m_s(0.0, value),
            Self::CueSd(value) => cue.position_sd_m = value,
            Self::CueFromTheFuture => cue.time = moved(1),
            Self::CueOffGrid => cue.issued_at = moved(-PERIOD_US / 10 - 1),
            Self::CueAhead => cue.issued_at = moved(7 * PERIOD_US),
        }
        match self {
            Self::State(_)
            | Self::Boresight(_)
            | Self::Past
            | Self::OffGrid
            | Self::Ahead
            | Self::Future
            | Self::Held(_) => Message::Report(report),
            _ => Message::Cue(cue),
        }
    }
}

/// If a teammate sends two different reports for one time step, the first one counts.
#[test]
fn a_second_scan_of_one_time_step_is_rejected() {
    let mut team = Team::new(2, 4);
    let mut reference = team.agents[0].clone();
    let mut tested = reference.clone();
    for tick in 0..20 {
        let (now, scans, inbox) = team.speak(tick);
        let mut with_second = inbox.clone();
        let mut second = report(&team.agents[1], now, &team.states[1], scan_of(&scans[1])).unwrap();
        second.sequence += 1;
        second.state.position = second.state.position + Displacement::from_m(50.0, 0.0);
        with_second.push(Message::Report(second));
        let own = team.states[0];
        let expected = step(&mut reference, now, &own, scan_of(&scans[0]), &inbox).command;
        let got = step(&mut tested, now, &own, scan_of(&scans[0]), &with_second);
        assert_eq!((got.command, i64::from(got.diagnostics.rejected.messages())), (expected, tick + 1));
        assert_eq!(format!("{:?}", tested.team_state()), format!("{:?}", reference.team_state()));
        team.decide(now, &scans, &inbox);
    }
}

/// A late report or cue is used until its time step is committed. After that it is rejected and counted.
#[test]
fn a_report_of_a_committed_time_step_is_rejected() {
    let mut team = Team::new(2, 4);
    (0..20).for_each(|tick| team.tick(tick));
    let (now, scans, inbox) = team.speak(20);
    let agent = &mut team.agents[0];
    step(agent, now, &team.states[0], scan_of(&scans[0]), &inbox);
    let committed = agent.committed_at().unwrap();
    // Each report acknowledges the previous time step, so the one before that is committed.
    assert_eq!(now - committed, Duration::from_us(2 * PERIOD_US));
    let observation = agent.observe(now, &team.states[0], None);
    let mut report_at = |time: Time, uav| {
        let stranger = Report::position_only(UavId(uav), time, team.states[1]);
        agent.receive(&observation, &Message::Report(stranger));
        (agent.decide(&observation).diagnostics.rejected.late, agent.team_state().teammates.len())
    };
    assert_eq!(report_at(committed, 77), (1, 2));
    assert_eq!(report_at(committed + Duration::from_us(PERIOD_US), 78), (1, 3));
    // The same applies to cues.
    let cue = |time| match Wrong::CueFromTheFuture.message(time, &Report::position_only(UavId(0), time, team.states[0]))
    {
        Message::Cue(cue) => Message::Cue(Cue { time, ..cue }),
        other => other,
    };
    let mut cue_at = |time: Time| {
        agent.receive(&observation, &cue(time));
        (agent.decide(&observation).diagnostics.rejected.late, agent.team_state().tracks().len())
    };
    assert_eq!(cue_at(committed), (2, 4));
    assert_eq!(cue_at(committed + Duration::from_us(PERIOD_US)), (2, 5));
}

/// A report is rejected if the UAV could not have reached the reported position in the time since its last report.
#[test]
fn a_report_with_an_implausible_jump_is_rejected() {
    let jumped = |by_m: f64, tick: i64| {
        let mut team = Team::new(2, 4);
        (0..10).for_each(|tick| team.tick(tick));
        let (now, scans, _) = team.speak(tick);
        let mut report = Report::position_only(UavId(1), now, team.states[1]);
        let before = team.agents[0].team_state().teammate(UavId(1)).unwrap().state.position;
        report.state.position = before + Displacement::from_m(by_m, 0.0);
        let inbox = [Message::Report(report)];
        let agent = &mut team.agents[0];
        let got = step(agent, now, &team.states[0], scan_of(&scans[0]), &inbox);
        let is_received = agent.team_state().teammate(UavId(1)).unwrap().reported_now;
        let next = agent.observe(now + Duration::from_us(PERIOD_US), &team.states[0], None);
        assert_eq!(agent.decide(&next).diagnostics.rejected, got.diagnostics.rejected, "counted more than once");
        (got.diagnostics.rejected.implausible, is_received)
    };
    // The limit is 100 m plus twice the maximum speed of 55 m/s times half a second or one second.
    assert_eq!((jumped(154.0, 10), jumped(156.0, 10)), ((0, true), (1, false)));
    assert_eq!((jumped(209.0, 11), jumped(211.0, 11)), ((0, true), (1, false)));
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(200) })]
    /// An agent that receives malformed messages among valid ones has the same team state and commands, bit for bit, as
    /// an agent that does not receive them. Each malformed message is counted.
    #[test]
    fn malformed_messages_are_rejected_and_counted_and_change_no_bit(
        wrongs in proptest::collection::vec((0..30i64, anything_wrong(), 0..20usize), 1..12),
    ) {
        let mut team = Team::new(3, 5);
        let mut reference = team.agents[0].clone();
        let mut tested = reference.clone();
        let mut count = 0;
        for tick in 0..30 {
            let (now, scans, inbox) = team.speak(tick);
            let like = report(&team.agents[1], now, &team.states[1], scan_of(&scans[1])).unwrap();
            let mut with_malformed = inbox.clone();
            for (_, wrong, index) in wrongs.iter().filter(|(at, ..)| *at == tick) {
                with_malformed.insert(index % (with_malformed.len() + 1), wrong.message(now, &like));
                // Messages from before the start of the agent are ignored without being counted.
                count += u32::from(!matches!(wrong, Wrong::Past));
            }
            let own = team.states[0];
            let expected = step(&mut reference, now, &own, scan_of(&scans[0]), &inbox);
            let got = step(&mut tested, now, &own, scan_of(&scans[0]), &with_malformed);
            prop_assert_eq!(got.command, expected.command);
            prop_assert_eq!(got.pointing_target, expected.pointing_target);
            prop_assert_eq!(got.diagnostics.rejected.messages(), count);
            prop_assert_eq!(format!("{:?}", tested.team_state()), format!("{:?}", reference.team_state()));
            team.decide(now, &scans, &inbox);
        }
    }

    /// Invalid detections in a report are ignored; its other detections are used.
    #[test]
    fn invalid_detections_change_no_bit(values in proptest::collection::vec((0..9u32, not_finite()), 1..8)) {
        let mut team = Team::new(2, 4);
        let mut reference = team.agents[0].clone();
        let mut tested = reference.clone();
        for tick in 0..20 {
            let (now, scans, inbox) = team.speak(tick);
            let mut with_invalid = inbox.clone();
            for message in &mut with_invalid {
                let Message::Report(report) = message else { continue };
                for (target, value) in &values {
                    let bearing = Angle::ZERO;
                    let range_m = *value;
                    // Inserted before the valid detections: for the same target, the valid one is used.
                    let measurement = RangeBearingMeasurement { range_m, bearing };
                    report.detections.insert(0, Detection { label: Some(TargetLabel(*target)), measurement, range_rate_m_s: None });
                    let measurement = RangeBearingMeasurement { range_m: -1.0, bearing: Angle::from_rad(1.0) };
                    report.detections.push(Detection { label: Some(TargetLabel(*target)), measurement, range_rate_m_s: None });
                }
            }
            let own = team.states[0];
            step(&mut reference, now, &own, scan_of(&scans[0]), &inbox);
            step(&mut tested, now, &own, scan_of(&scans[0]), &with_invalid);
            prop_assert_eq!(format!("{:?}", tested.team_state()), format!("{:?}", reference.team_state()));
            team.decide(now, &scans, &inbox);
        }
    }
}

/// Manipulation of a snapshot: eight bytes or one byte are overwritten.
#[derive(Debug, Clone, Copy)]
enum Other {
    Number(f64),
    Byte(u8),
}

fn others() -> impl Strategy<Value = Vec<(usize, Other)>> {
    let number = prop_oneof![not_finite(), Just(1e308), Just(-1e308), Just(0.0), -1e9..1e9f64].prop_map(Other::Number);
    proptest::collection::vec((any::<usize>(), prop_oneof![number, any::<u8>().prop_map(Other::Byte)]), 1..4)
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(1000) })]
    /// A snapshot is manipulated and has a matching digest. The receiver accepts or rejects it; either way its commands
    /// stay within the limits and its team state stays finite.
    #[test]
    fn commands_stay_valid_after_any_snapshot(others in others()) {
        let (bytes, from, now) = SNAPSHOT.with(|snapshot| (snapshot.0.clone(), snapshot.1.clone(), snapshot.2));
        let mut bytes = bytes;
        for (index, other) in others {
            match other {
                Other::Number(number) => {
                    let index = index % (bytes.len() - 8);
                    bytes[index..index + 8].copy_from_slice(&number.to_le_bytes());
                }
                Other::Byte(byte) => {
                    let index = index % bytes.len();
                    bytes[index] = byte;
                }
            }
        }
        let Ok(team_state) = postcard::from_bytes::<TeamState>(&bytes) else { return Ok(()) };
        let commit_digest = CommitDigest { time: team_state.time, digest: team_state.digest() };
        // The canonical encoding may differ from the manipulated bytes.
        let bytes = postcard::to_allocvec(&team_state).unwrap();
        let mut agent = Agent::new(UavId(1), TeamParams::paper()).unwrap();
        for tick in 0..12i64 {
            let step = step_with_snapshot(&mut agent, (&from, now), tick, commit_digest, &bytes);
            prop_assert!((25.0..=55.0).contains(&step.command.speed_m_s), "{step:?}");
            prop_assert!(step.command.turn_rate_rad_s.abs() <= 0.3, "{step:?}");
            prop_assert!(step.altitude_m.is_none_or(f64::is_finite), "{step:?}");
            prop_assert!(step.pointing_target.is_none_or(|look| look.position.is_finite() && look.velocity.is_finite()), "{step:?}");
            for known in agent.team_state().tracks() {
                prop_assert!(known.track.estimate().state.0.iter().all(|value| value.is_finite()));
            }
        }
    }
}

/// Runs a time step of an agent that started after another one. It receives a report that offers a snapshot, and these
/// bytes as the snapshot.
fn step_with_snapshot(
    agent: &mut Agent,
    (from, since): (&Report, Time),
    tick: i64,
    commit_digest: CommitDigest,
    bytes: &[u8],
) -> AgentOutput {
    let now = since + Duration::from_us(tick * PERIOD_US);
    let own = UavState { position: Position::from_m(300.0, 0.0), ..from.state };
    let mut report = Report { time: now, sequence: 100 + tick as u32, ..from.clone() };
    let log_status = report.log_status.get_or_insert_default();
    (log_status.start, log_status.commit_digest) = (Time::EPOCH, commit_digest);
    let observation = agent.observe(now, &own, Some(Scan::default()));
    agent.receive(&observation, &Message::Report(report));
    let parts = bytes.chunks(SnapshotPart::BYTES_MAX);
    let count = parts.len() as u16;
    for (index, part) in (0..).zip(parts) {
        let (uav, since) = (UavId(0), Time::EPOCH);
        let part = SnapshotPart { uav, start: since, commit_digest, index, count, bytes: part.to_vec() };
        agent.receive(&observation, &Message::Snapshot(part));
    }
    agent.decide(&observation)
}

/// A snapshot is accepted only if its bytes match the offered digest.
#[test]
fn a_snapshot_that_does_not_match_its_digest_is_rejected() {
    let (bytes, from, now) = SNAPSHOT.with(|snapshot| (snapshot.0.clone(), snapshot.1.clone(), snapshot.2));
    let team_state: TeamState = postcard::from_bytes(&bytes).unwrap();
    let commit_digest = CommitDigest { time: team_state.time, digest: team_state.digest() };
    let mut other = team_state;
    other.groups[0].altitude_m += 1.0;
    let other = postcard::to_allocvec(&other).unwrap();
    for (bytes, is_accepted) in [(bytes, true), (other, false)] {
        let mut agent = Agent::new(UavId(1), TeamParams::paper()).unwrap();
        let mut rejected = 0;
        for tick in 0..4i64 {
            let step = step_with_snapshot(&mut agent, (&from, now), tick, commit_digest, &bytes);
            rejected = step.diagnostics.rejected.malformed;
        }
        assert_eq!((agent.committed_at() >= Some(commit_digest.time), rejected > 0), (is_accepted, !is_accepted));
    }
}

thread_local! {
    /// Snapshot of a UAV in a team of two after 20 s, a report of that UAV, and the time.
    static SNAPSHOT: (Vec<u8>, Report, Time) = {
        let mut team = Team::new(2, 4);
        (0..40).for_each(|tick| team.tick(tick));
        let (now, scans, _) = team.speak(40);
        let report = report(&team.agents[0], now, &team.states[0], scan_of(&scans[0])).unwrap();
        (postcard::to_allocvec(team.agents[0].committed().unwrap()).unwrap(), report, now)
    };
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(200) })]
    /// For any traffic reports, the command stays within the limits and the team state does not change.
    #[test]
    fn traffic_reports_do_not_change_the_team_state(
        reports in proptest::collection::vec(
            (0..20i64, any::<u32>(), -40_000_000..2_000_000i64, any::<[f64; 4]>(), [-3e3..3e3, -3e3..3e3, -90.0..90.0, -1.0..1.0]),
            1..30,
        ),
        is_near in any::<bool>(),
    ) {
        let mut team = Team::new(2, 4);
        let params = TeamParams { separation: Some(SeparationParams::default()), ..TeamParams::paper() };
        let [mut reference, mut tested] = [0; 2].map(|_| Agent::new(UavId(0), params).unwrap());
        for tick in 0..20 {
            let (now, scans, inbox) = team.speak(tick);
            let traffic = reports.iter().filter(|(at, ..)| *at == tick).map(|(_, aircraft, later_us, far, near)| {
                let [x_m, y_m, speed_m_s, turn_rate_rad_s] = if is_near { *near } else { *far };
                let (position, heading) = (Position::from_m(x_m, y_m), Angle::from_rad(1.0));
                let state = UavState { position, heading, speed_m_s, turn_rate_rad_s, vertical: None };
                let time = Time::from_us(now.us() + later_us);
                Message::Traffic(TrafficReport { aircraft: *aircraft, time, state })
            });
            let with_traffic: Vec<Message> = traffic.chain(inbox.iter().cloned()).collect();
            let own = team.states[0];
            step(&mut reference, now, &own, scan_of(&scans[0]), &inbox);
            let got = step(&mut tested, now, &own, scan_of(&scans[0]), &with_traffic);
            prop_assert_eq!(params.uav.limit(got.command).command, got.command);
            prop_assert_eq!(reference.team_state().digest(), tested.team_state().digest());
            team.decide(now, &scans, &inbox);
        }
    }
}
