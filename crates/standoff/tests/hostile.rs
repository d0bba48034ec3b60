//! Nonsense from teammates: it is refused, counted, and leaves no trace in what is known.

mod common;

use common::{Team, report, scan_of, step};
use proptest::prelude::*;
use standoff::*;

/// What may be wrong with a message.
#[derive(Debug, Clone, Copy)]
enum Wrong {
    State(f64),
    Boresight(f64),
    Late,
    Early,
    Future,
    CuePosition(f64),
    CueVelocity(f64),
    CueSd(f64),
    CueFromTheFuture,
}

fn no_number() -> impl Strategy<Value = f64> {
    prop_oneof![Just(f64::NAN), Just(f64::INFINITY), Just(f64::NEG_INFINITY)]
}

fn anything_wrong() -> impl Strategy<Value = Wrong> {
    prop_oneof![
        no_number().prop_map(Wrong::State),
        no_number().prop_map(Wrong::Boresight),
        Just(Wrong::Late),
        Just(Wrong::Early),
        Just(Wrong::Future),
        no_number().prop_map(Wrong::CuePosition),
        no_number().prop_map(Wrong::CueVelocity),
        prop_oneof![no_number(), Just(0.0), -1e300..0.0f64].prop_map(Wrong::CueSd),
        Just(Wrong::CueFromTheFuture),
    ]
}

impl Wrong {
    /// A message of a UAV that does not fly here, or about a target that is not there, with that wrong.
    fn message(self, now: Time, like: &Report) -> Message {
        let mut report = Report { uav: UavId(77), epoch: 9, sequence: 1, ..like.clone() };
        let mut cue = Cue {
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
            Self::Late => report.time = moved(-500_000),
            Self::Early => report.time = moved(1),
            Self::Future => report.time = moved(i64::MAX),
            Self::CuePosition(value) => cue.position = Position::from_m(value, 0.0),
            Self::CueVelocity(value) => cue.velocity = Velocity::from_m_s(0.0, value),
            Self::CueSd(value) => cue.position_sd_m = value,
            Self::CueFromTheFuture => cue.time = moved(1),
        }
        match self {
            Self::CuePosition(_) | Self::CueVelocity(_) | Self::CueSd(_) | Self::CueFromTheFuture => Message::Cue(cue),
            _ => Message::Report(report),
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
        assert_eq!((got.command, i64::from(got.diagnostics.refused_messages)), (expected, tick + 1));
        assert_eq!(format!("{:?}", told_twice.picture()), format!("{:?}", honest.picture()));
        team.decide(now, &scans, &inbox);
    }
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
                count += 1;
            }
            let own = team.states[0];
            let expected = step(&mut honest, now, &own, scan_of(&scans[0]), &inbox);
            let got = step(&mut told_nonsense, now, &own, scan_of(&scans[0]), &with_nonsense);
            prop_assert_eq!(got.command, expected.command);
            prop_assert_eq!(got.look_at, expected.look_at);
            prop_assert_eq!(got.diagnostics.refused_messages, count);
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
