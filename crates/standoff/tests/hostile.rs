//! Nonsense from teammates: it is refused, counted, and leaves no trace in what is known.

#![expect(clippy::unwrap_used, reason = "a failed unwrap fails the test")]

mod common;

use common::{Team, report, scan_of, step};
use proptest::prelude::*;
use standoff::*;

const PERIOD_US: i64 = 500_000;

/// What may be wrong with a message.
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

/// What may be wrong with what somebody tells of what it has heard.
#[derive(Debug, Clone, Copy)]
enum Unlisted {
    Backward,
    OutOfOrder,
    Overlapping,
    TooLong,
}

fn no_number() -> impl Strategy<Value = f64> {
    prop_oneof![Just(f64::NAN), Just(f64::INFINITY), Just(f64::NEG_INFINITY)]
}

fn anything_wrong() -> impl Strategy<Value = Wrong> {
    prop_oneof![
        no_number().prop_map(Wrong::State),
        no_number().prop_map(Wrong::Boresight),
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
        no_number().prop_map(Wrong::CuePosition),
        no_number().prop_map(Wrong::CueVelocity),
        prop_oneof![no_number(), Just(0.0), -1e300..0.0f64].prop_map(Wrong::CueSd),
        Just(Wrong::CueFromTheFuture),
        Just(Wrong::CueOffGrid),
        Just(Wrong::CueAhead),
    ]
}

impl Wrong {
    /// A message of a UAV that does not fly here, or about a target that is not there, with that wrong.
    fn message(self, now: Time, like: &Report) -> Message {
        let mut report = Report { uav: UavId(77), epoch: 9, sequence: 1, ..like.clone() };
        let mut cue = Cue {
            searcher: 9,
            said: now,
            number: 0,
            label: TargetLabel(99),
            time: now,
            position: Position::ORIGIN,
            velocity: Velocity::ZERO,
            position_sd_m: 20.0,
            velocity_sd_m_s: 2.0,
        };
        let moved = |us| Time::from_us(now.us().saturating_add(us));
        match self {
            Self::State(value) => report.state.speed_m_s = value,
            Self::Boresight(value) => report.boresight = Some(Angle::from_rad(value)),
            // Before this agent was there.
            Self::Past => report.time = moved(-100 * PERIOD_US),
            // More than a tenth of a period.
            Self::OffGrid => report.time = moved(PERIOD_US / 10 + 1),
            // More than the lease.
            Self::Ahead => report.time = moved(7 * PERIOD_US),
            Self::Future => report.time = moved(i64::MAX),
            Self::Held(wrong) => {
                let held = |uav, from, to| Held { speaker: Speaker::Uav(UavId(uav)), from, to };
                report.knowledge.get_or_insert_default().held = match wrong {
                    Unlisted::Backward => vec![held(1, 1, 0)],
                    Unlisted::OutOfOrder => vec![held(2, 0, 0), held(1, 0, 0)],
                    Unlisted::Overlapping => vec![held(1, 0, 1), held(1, 1, 2)],
                    Unlisted::TooLong => (0..1025).map(|instant| held(1, 2 * instant, 2 * instant)).collect(),
                };
            }
            Self::CuePosition(value) => cue.position = Position::from_m(value, 0.0),
            Self::CueVelocity(value) => cue.velocity = Velocity::from_m_s(0.0, value),
            Self::CueSd(value) => cue.position_sd_m = value,
            Self::CueFromTheFuture => cue.time = moved(1),
            Self::CueOffGrid => cue.said = moved(-PERIOD_US / 10 - 1),
            Self::CueAhead => cue.said = moved(7 * PERIOD_US),
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

/// A teammate that says two things of one instant is believed the first.
#[test]
fn a_second_scan_of_one_instant_is_refused() {
    let mut team = Team::new(2, 4);
    let mut honest = team.agents[0].clone();
    let mut told_twice = honest.clone();
    for tick in 0..20 {
        let (now, scans, inbox) = team.speak(tick);
        let mut with_second = inbox.clone();
        let mut second = report(&team.agents[1], now, &team.states[1], scan_of(&scans[1])).unwrap();
        second.sequence += 1;
        second.state.position = second.state.position + Displacement::from_m(50.0, 0.0);
        with_second.push(Message::Report(second));
        let own = team.states[0];
        let expected = step(&mut honest, now, &own, scan_of(&scans[0]), &inbox).command;
        let got = step(&mut told_twice, now, &own, scan_of(&scans[0]), &with_second);
        assert_eq!((got.command, i64::from(got.diagnostics.refused.messages())), (expected, tick + 1));
        assert_eq!(format!("{:?}", told_twice.picture()), format!("{:?}", honest.picture()));
        team.decide(now, &scans, &inbox);
    }
}

/// What is said of an instant that cannot change any more is refused and counted; before that it counts, however late.
#[test]
fn a_report_of_a_committed_instant_is_refused() {
    let mut team = Team::new(2, 4);
    (0..20).for_each(|tick| team.tick(tick));
    let (now, scans, inbox) = team.speak(20);
    let agent = &mut team.agents[0];
    step(agent, now, &team.states[0], scan_of(&scans[0]), &inbox);
    let committed = agent.committed_at().unwrap();
    // Each has told of the instant before, which is by when all of the one before that is known.
    assert_eq!(now - committed, Duration::from_us(2 * PERIOD_US));
    let observation = agent.observe(now, &team.states[0], None);
    let mut of = |instant: Time, uav| {
        let stranger = Report::of(UavId(uav), instant, team.states[1]);
        agent.hear(&observation, &Message::Report(stranger));
        (agent.decide(&observation).diagnostics.refused.late, agent.picture().team.len())
    };
    assert_eq!(of(committed, 77), (1, 2));
    assert_eq!(of(committed + Duration::from_us(PERIOD_US), 78), (1, 3));
    // A cue, too.
    let cue = |said| match Wrong::CueFromTheFuture.message(said, &Report::of(UavId(0), said, team.states[0])) {
        Message::Cue(cue) => Message::Cue(Cue { time: said, ..cue }),
        other => other,
    };
    let mut of = |instant: Time| {
        agent.hear(&observation, &cue(instant));
        (agent.decide(&observation).diagnostics.refused.late, agent.picture().known().len())
    };
    assert_eq!(of(committed), (2, 4));
    assert_eq!(of(committed + Duration::from_us(PERIOD_US)), (2, 5));
}

/// A report of a UAV that is where it could not have come to is not counted by anybody; where it could have, or in time, it
/// is.
#[test]
fn a_uav_that_jumps_is_not_believed() {
    let jumped = |by_m: f64, tick: i64| {
        let mut team = Team::new(2, 4);
        (0..10).for_each(|tick| team.tick(tick));
        let (now, scans, _) = team.speak(tick);
        let mut report = Report::of(UavId(1), now, team.states[1]);
        let before = team.agents[0].picture().teammate(UavId(1)).unwrap().state.position;
        report.state.position = before + Displacement::from_m(by_m, 0.0);
        let inbox = [Message::Report(report)];
        let agent = &mut team.agents[0];
        let got = step(agent, now, &team.states[0], scan_of(&scans[0]), &inbox);
        let is_heard = agent.picture().teammate(UavId(1)).unwrap().is_heard;
        let again = agent.observe(now + Duration::from_us(PERIOD_US), &team.states[0], None);
        assert_eq!(agent.decide(&again).diagnostics.refused, got.diagnostics.refused, "counted once");
        (got.diagnostics.refused.impossible, is_heard)
    };
    // Twice the greatest speed of 55 m/s, for half a second or a whole one, and 100 m.
    assert_eq!((jumped(154.0, 10), jumped(156.0, 10)), ((0, true), (1, false)));
    assert_eq!((jumped(209.0, 11), jumped(211.0, 11)), ((0, true), (1, false)));
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(200) })]
    /// An agent that hears nonsense between sound messages knows, to the bit, and commands what one knows that did not
    /// hear it; each piece is counted.
    #[test]
    fn nonsense_from_teammates_is_refused_counted_and_changes_no_bit(
        wrongs in proptest::collection::vec((0..30i64, anything_wrong(), 0..20usize), 1..12),
    ) {
        let mut team = Team::new(3, 5);
        let mut honest = team.agents[0].clone();
        let mut told_nonsense = honest.clone();
        let mut count = 0;
        for tick in 0..30 {
            let (now, scans, inbox) = team.speak(tick);
            let like = report(&team.agents[1], now, &team.states[1], scan_of(&scans[1])).unwrap();
            let mut with_nonsense = inbox.clone();
            for (_, wrong, place) in wrongs.iter().filter(|(at, ..)| *at == tick) {
                with_nonsense.insert(place % (with_nonsense.len() + 1), wrong.message(now, &like));
                // What was before it was there is no matter of this agent's, nor a teammate's fault.
                count += u32::from(!matches!(wrong, Wrong::Past));
            }
            let own = team.states[0];
            let expected = step(&mut honest, now, &own, scan_of(&scans[0]), &inbox);
            let got = step(&mut told_nonsense, now, &own, scan_of(&scans[0]), &with_nonsense);
            prop_assert_eq!(got.command, expected.command);
            prop_assert_eq!(got.look_at, expected.look_at);
            prop_assert_eq!(got.diagnostics.refused.messages(), count);
            prop_assert_eq!(format!("{:?}", told_nonsense.picture()), format!("{:?}", honest.picture()));
            team.decide(now, &scans, &inbox);
        }
    }

    /// Detections that no sensor makes are left out of a report; the others of it count.
    #[test]
    fn detections_without_a_number_change_no_bit(values in proptest::collection::vec((0..9u32, no_number()), 1..8)) {
        let mut team = Team::new(2, 4);
        let mut honest = team.agents[0].clone();
        let mut told_nonsense = honest.clone();
        for tick in 0..20 {
            let (now, scans, inbox) = team.speak(tick);
            let mut with_nonsense = inbox.clone();
            for message in &mut with_nonsense {
                let Message::Report(report) = message else { continue };
                for (target, value) in &values {
                    let bearing = Angle::ZERO;
                    let range_m = *value;
                    // Before the sound ones: also of the same target, the sound one counts.
                    let measurement = RangeBearing { range_m, bearing };
                    report.detections.insert(0, Detection { label: TargetLabel(*target), measurement });
                    let measurement = RangeBearing { range_m: -1.0, bearing: Angle::from_rad(1.0) };
                    report.detections.push(Detection { label: TargetLabel(*target), measurement });
                }
            }
            let own = team.states[0];
            step(&mut honest, now, &own, scan_of(&scans[0]), &inbox);
            step(&mut told_nonsense, now, &own, scan_of(&scans[0]), &with_nonsense);
            prop_assert_eq!(format!("{:?}", told_nonsense.picture()), format!("{:?}", honest.picture()));
            team.decide(now, &scans, &inbox);
        }
    }
}

/// Eight bytes of a picture that somebody tells are others.
#[derive(Debug, Clone, Copy)]
enum Other {
    Number(f64),
    Byte(u8),
}

fn others() -> impl Strategy<Value = Vec<(usize, Other)>> {
    let number = prop_oneof![no_number(), Just(1e308), Just(-1e308), Just(0.0), -1e9..1e9f64].prop_map(Other::Number);
    proptest::collection::vec((any::<usize>(), prop_oneof![number, any::<u8>().prop_map(Other::Byte)]), 1..4)
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(1000) })]
    /// A picture that was tampered with, digest and all: who asks for it believes it or does not, and is total, and what it
    /// knows is finite.
    #[test]
    fn whatever_picture_is_told_an_agent_stays_total(others in others()) {
        let (bytes, from, now) = TOLD.with(|told| (told.0.clone(), told.1.clone(), told.2));
        let mut bytes = bytes;
        for (place, other) in others {
            match other {
                Other::Number(number) => {
                    let place = place % (bytes.len() - 8);
                    bytes[place..place + 8].copy_from_slice(&number.to_le_bytes());
                }
                Other::Byte(byte) => {
                    let place = place % bytes.len();
                    bytes[place] = byte;
                }
            }
        }
        let Ok(picture) = postcard::from_bytes::<Picture>(&bytes) else { return Ok(()) };
        let stamp = Stamp { time: picture.time, digest: picture.digest() };
        // What was read may be written otherwise.
        let bytes = postcard::to_allocvec(&picture).unwrap();
        let mut agent = Agent::new(UavId(1), TeamParams::table_1()).unwrap();
        for tick in 0..12i64 {
            let step = told(&mut agent, (&from, now), tick, stamp, &bytes);
            prop_assert!((25.0..=55.0).contains(&step.command.speed_m_s), "{step:?}");
            prop_assert!(step.command.turn_rate_rad_s.abs() <= 0.3, "{step:?}");
            prop_assert!(step.altitude_m.is_none_or(f64::is_finite), "{step:?}");
            prop_assert!(step.look_at.is_none_or(|look| look.position.is_finite() && look.velocity.is_finite()), "{step:?}");
            for known in agent.picture().known() {
                prop_assert!(known.track.estimate().state.0.iter().all(|value| value.is_finite()));
            }
        }
    }
}

/// An instant of a UAV that begins after another: from that one it hears a report that tells of a picture, and these bytes as
/// the picture's.
fn told(agent: &mut Agent, (from, since): (&Report, Time), tick: i64, stamp: Stamp, bytes: &[u8]) -> Step {
    let now = since + Duration::from_us(tick * PERIOD_US);
    let own = UavState { position: Position::from_m(300.0, 0.0), ..from.state };
    let mut report = Report { time: now, sequence: 100 + tick as u32, ..from.clone() };
    let knowledge = report.knowledge.get_or_insert_default();
    (knowledge.since, knowledge.stamp) = (Time::START, stamp);
    let observation = agent.observe(now, &own, Some(Scan::default()));
    agent.hear(&observation, &Message::Report(report));
    let parts = bytes.chunks(SnapshotPart::BYTES_MAX);
    let count = parts.len() as u16;
    for (index, part) in (0..).zip(parts) {
        let (uav, since) = (UavId(0), Time::START);
        let part = SnapshotPart { uav, since, stamp, index, count, bytes: part.to_vec() };
        agent.hear(&observation, &Message::Snapshot(part));
    }
    agent.decide(&observation)
}

/// Bytes that are not those of the picture that was told of are not believed, whatever else they are.
#[test]
fn a_picture_that_is_not_the_one_that_was_told_of_is_refused() {
    let (bytes, from, now) = TOLD.with(|told| (told.0.clone(), told.1.clone(), told.2));
    let picture: Picture = postcard::from_bytes(&bytes).unwrap();
    let stamp = Stamp { time: picture.time, digest: picture.digest() };
    let mut other = picture;
    other.groups[0].altitude_m += 1.0;
    let other = postcard::to_allocvec(&other).unwrap();
    for (bytes, is_believed) in [(bytes, true), (other, false)] {
        let mut agent = Agent::new(UavId(1), TeamParams::table_1()).unwrap();
        let mut refused = 0;
        for tick in 0..4i64 {
            refused = told(&mut agent, (&from, now), tick, stamp, &bytes).diagnostics.refused.nonsense;
        }
        assert_eq!((agent.committed_at() >= Some(stamp.time), refused > 0), (is_believed, !is_believed));
    }
}

thread_local! {
    /// What a UAV of a team of two knows after 20 s, as bytes, with a report of it, and the instant.
    static TOLD: (Vec<u8>, Report, Time) = {
        let mut team = Team::new(2, 4);
        (0..40).for_each(|tick| team.tick(tick));
        let (now, scans, _) = team.speak(40);
        let said = report(&team.agents[0], now, &team.states[0], scan_of(&scans[0])).unwrap();
        (postcard::to_allocvec(team.agents[0].committed().unwrap()).unwrap(), said, now)
    };
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::with_cases(200) })]
    /// Whatever aircraft that are not of the team tell, the command is inside the limits, and no picture differs by a bit.
    #[test]
    fn whatever_an_intruder_tells_is_no_matter_of_the_picture(
        told in proptest::collection::vec(
            (0..20i64, any::<u32>(), -40_000_000..2_000_000i64, any::<[f64; 4]>(), [-3e3..3e3, -3e3..3e3, -90.0..90.0, -1.0..1.0]),
            1..30,
        ),
        is_near in any::<bool>(),
    ) {
        let mut team = Team::new(2, 4);
        let params = TeamParams { separation: Some(SeparationParams::default()), ..TeamParams::table_1() };
        let [mut deaf, mut hearing] = [0; 2].map(|_| Agent::new(UavId(0), params).unwrap());
        for tick in 0..20 {
            let (now, scans, inbox) = team.speak(tick);
            let traffic = told.iter().filter(|(at, ..)| *at == tick).map(|(_, aircraft, later_us, far, near)| {
                let [x_m, y_m, speed_m_s, turn_rate_rad_s] = if is_near { *near } else { *far };
                let (position, heading) = (Position::from_m(x_m, y_m), Angle::from_rad(1.0));
                let state = UavState { position, heading, speed_m_s, turn_rate_rad_s, vertical: None };
                let time = Time::from_us(now.us() + later_us);
                Message::Traffic(Traffic { aircraft: *aircraft, time, state })
            });
            let with_traffic: Vec<Message> = traffic.chain(inbox.iter().cloned()).collect();
            let own = team.states[0];
            step(&mut deaf, now, &own, scan_of(&scans[0]), &inbox);
            let got = step(&mut hearing, now, &own, scan_of(&scans[0]), &with_traffic);
            prop_assert_eq!(params.uav.limit(got.command).command, got.command);
            prop_assert_eq!(deaf.picture().digest(), hearing.picture().digest());
            team.decide(now, &scans, &inbox);
        }
    }
}
