//! The agent: total, the same for all, and quiet about memory.

mod common;

use common::{Team, scan_of};
use proptest::prelude::*;
use standoff::*;

/// With a perfect radio every agent holds the same picture, to the bit, whatever the order of its inbox.
#[test]
fn all_pictures_are_bit_identical() {
    let mut team = Team::new(4, 7);
    for tick in 0..120 {
        team.tick(tick);
        let first = format!("{:?}", team.agents[0].picture());
        for agent in &team.agents[1..] {
            assert_eq!(format!("{:?}", agent.picture()), first, "tick {tick}");
        }
    }
}

/// Hearing the teammates late within an instant, twice, or in another order changes no bit of the answer.
#[test]
fn a_step_may_be_asked_again_with_what_came_in_since() {
    let mut team = Team::new(3, 5);
    for tick in 0..40 {
        let (now, scans, mut inbox) = team.speak(tick);
        for (index, agent) in team.agents.iter_mut().enumerate() {
            let own = team.states[index];
            let mut other = agent.clone();
            let once = format!("{:?}", agent.step(now, &own, scan_of(&scans[index]), &inbox).command);
            other.step(now, &own, scan_of(&scans[index]), &[]);
            other.step(now, &own, scan_of(&scans[index]), &inbox[1..]);
            inbox.reverse();
            let again = format!("{:?}", other.step(now, &own, scan_of(&scans[index]), &inbox).command);
            assert_eq!(once, again);
            assert_eq!(agent.picture(), other.picture());
        }
        team.fly(now);
    }
}

#[test]
fn what_a_step_says_is_the_report_of_its_scan() {
    let mut team = Team::new(2, 3);
    let (now, scans, inbox) = team.speak(0);
    let report = team.agents[0].report(now, &team.states[0], scan_of(&scans[0]));
    let own = team.states[0];
    let step = team.agents[0].step(now, &own, scan_of(&scans[0]), &inbox);
    assert_eq!(step.outbox, [Message::Report(report)]);
}

/// The pair settles on an orbit at right angles and all targets are held.
#[test]
fn a_pair_settles_at_right_angles() {
    let mut team = Team::new(2, 4);
    for tick in 0..400 {
        team.tick(tick);
    }
    let picture = team.agents[0].picture();
    assert!(picture.known.iter().all(|known| known.track.status == TrackStatus::Held), "{picture:?}");
    let centre = picture.groups[0].centre.estimate().state.position();
    let phases: Vec<_> = team.states.iter().map(|state| (state.position - centre).direction()).collect();
    let separation_deg = (phases[1] - phases[0]).deg().abs();
    assert!((separation_deg - 90.0).abs() < 5.0, "{separation_deg}");
    for state in &team.states {
        let error_m = state.position.distance_m(centre) - picture.groups[0].standoff.distance_m;
        assert!(error_m.abs() < 20.0, "{error_m}");
    }
}

/// An agent without any target circles where it is, inside the limits.
#[test]
fn with_nothing_to_watch_the_agent_holds_a_circle() {
    let mut agent = Agent::new(UavId(0), TeamParams::table_1()).unwrap();
    let own = Team::new(1, 0).states[0];
    let step = agent.step(Time::START, &own, Scan::default(), &[]);
    assert_eq!(step.command.command, Command { speed_m_s: 40.0, turn_rate_rad_s: 0.16 });
    assert_eq!((step.look_at, step.diagnostics.group), (None, None));
}

#[test]
fn parameters_out_of_range_are_all_reported() {
    let mut params = TeamParams::table_1();
    params.uav.speed_m_s = -1.0;
    params.guidance.radial_gain = 0.0;
    let names: Vec<_> = Agent::new(UavId(0), params).unwrap_err().iter().map(|error| error.name).collect();
    assert_eq!(names, ["speed_m_s", "speed_change_max_m_s", "radial_gain"]);
}

fn any_number() -> impl Strategy<Value = f64> {
    prop_oneof![
        -1e4..1e4f64,
        Just(f64::NAN),
        Just(f64::INFINITY),
        Just(f64::NEG_INFINITY),
        Just(0.0),
        Just(-0.0),
        Just(1e300),
        Just(5e-324),
    ]
}

fn any_state() -> impl Strategy<Value = UavState> {
    (any_number(), any_number(), any_number(), any_number(), any_number()).prop_map(|(x, y, psi, v, omega)| UavState {
        position: Position::from_m(x, y),
        heading: Angle::from_rad(psi),
        speed_m_s: v,
        turn_rate_rad_s: omega,
    })
}

fn any_detections() -> impl Strategy<Value = Vec<Detection>> {
    let detection = (0..4u32, any_number(), any_number()).prop_map(|(target, range_m, bearing)| Detection {
        target: TargetId(target),
        measurement: RangeBearing { range_m, bearing: Angle::from_rad(bearing) },
    });
    proptest::collection::vec(detection, 0..5)
}

fn any_message(now_us: i64) -> impl Strategy<Value = Message> {
    let report = (0..3u32, any_state(), any_number(), any_detections(), prop_oneof![Just(now_us), any::<i64>()])
        .prop_map(|(uav, state, boresight, detections, us)| {
            Message::Report(Report {
                uav: UavId(uav),
                epoch: 0,
                sequence: (us as u32) | 1,
                time: Time::from_us(us),
                state,
                boresight: Some(Angle::from_rad(boresight)),
                detections,
            })
        });
    let cue = (0..4u32, any_number(), any_number(), any_number(), any_number(), any_number()).prop_map(
        move |(target, x, y, vx, sd, sd_v)| {
            Message::Cue(Cue {
                target: TargetId(target),
                time: Time::from_us(now_us),
                position: Position::from_m(x, y),
                velocity: Velocity::from_m_s(vx, y),
                position_sd_m: sd,
                velocity_sd_m_s: sd_v,
            })
        },
    );
    prop_oneof![report, cue]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]
    /// Whatever comes in, the command is finite and inside the limits, and so is what the picture holds.
    #[test]
    fn the_agent_is_total(
        states in proptest::collection::vec(any_state(), 1..8),
        detections in any_detections(),
        messages in proptest::collection::vec(any_message(500_000), 0..6),
        times in proptest::collection::vec(prop_oneof![Just(500_000i64), 0..5_000_000i64, any::<i64>()], 8),
    ) {
        let mut agent = Agent::new(UavId(0), TeamParams::table_1()).unwrap();
        for (state, us) in states.iter().zip(times) {
            let scan = Scan { boresight: Some(state.heading), detections: &detections };
            let step = agent.step(Time::from_us(us), state, scan, &messages);
            let command = step.command.command;
            prop_assert!((25.0..=55.0).contains(&command.speed_m_s), "{command:?}");
            prop_assert!(command.turn_rate_rad_s.abs() <= 0.3, "{command:?}");
            for known in &agent.picture().known {
                prop_assert!(known.track.estimate().state.0.iter().all(|value| value.is_finite()));
                prop_assert!(known.track.estimate().covariance.matrix().iter().all(|value| value.is_finite()));
            }
        }
    }
}
