//! The agent: total, the same for all, and quiet about memory.

mod common;

use common::{Team, observe_all, scan_of, step};
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
fn a_decision_may_be_asked_for_again_with_what_came_in_since() {
    let mut team = Team::new(3, 5);
    for tick in 0..40 {
        let (now, scans, mut inbox) = team.speak(tick);
        for (index, agent) in team.agents.iter_mut().enumerate() {
            let own = team.states[index];
            let mut other = agent.clone();
            let once = step(agent, now, &own, scan_of(&scans[index]), &inbox).command;
            let observation = other.observe(now, &own, Some(scan_of(&scans[index])));
            other.decide(&observation);
            inbox[1..].iter().for_each(|message| other.hear(&observation, message));
            other.decide(&observation);
            inbox.reverse();
            inbox.iter().for_each(|message| other.hear(&observation, message));
            assert_eq!(once, other.decide(&observation).command);
            assert_eq!(agent.picture(), other.picture());
        }
        team.fly(now);
    }
}

/// Who has heard nobody yet does not know how late words come: what is later than the lease counts all the same.
#[test]
fn the_first_words_count_however_late_they_come_within_the_horizon() {
    let mut late = Team::new(2, 3);
    let (mut inbox, mut known) = (Vec::new(), 0);
    let mut agent = late.agents[0].clone();
    for tick in 0..20 {
        let (now, scans, said) = late.speak(tick);
        inbox.push(said);
        let own = late.states[0];
        let observation = agent.observe(now, &own, Some(scan_of(&scans[0])));
        // Eight periods, where the lease has six.
        if let Some(words) = (tick as usize).checked_sub(8).map(|then| &inbox[then]) {
            words.iter().for_each(|message| agent.hear(&observation, message));
        }
        known = agent.decide(&observation).diagnostics.refused.late.max(known);
    }
    assert_eq!((agent.picture().known().len(), known), (3, 0));
}

/// What an agent says is the report of its scan; without a scan it says nothing and is no teammate, but hears.
#[test]
fn what_an_agent_says_is_the_report_of_its_scan() {
    let mut team = Team::new(2, 3);
    for tick in 0..9 {
        team.tick(tick);
    }
    let (now, scans, inbox) = team.speak(9);
    let own = team.states[0];
    let agent = &mut team.agents[0];
    let observation = agent.observe(now, &own, Some(scan_of(&scans[0])));
    let [Message::Report(said)] = agent.outbox(&observation) else { panic!("one report") };
    assert_eq!((said.uav, said.epoch, said.sequence, said.time, said.state), (UavId(0), 0, 10, now, own));
    assert_eq!((said.boresight, &said.detections), (scans[0].0, &scans[0].1));
    agent.decide(&observation);
    let later = now + Duration::from_s(0.5);
    let silent = agent.observe(later, &own, None);
    assert_eq!((agent.outbox(&silent), agent.outbox(&observation)), (&[][..], &[][..]));
    for message in inbox {
        let Message::Report(heard) = message else { continue };
        agent.hear(&silent, &Message::Report(Report { time: later, ..heard }));
    }
    agent.decide(&silent);
    let heard: Vec<_> = agent.picture().team.iter().map(|mate| (mate.uav, mate.is_heard)).collect();
    assert_eq!(heard, [(UavId(0), false), (UavId(1), true)]);
}

/// What the own inbox refuses is not said to others.
#[test]
fn an_agent_says_nothing_that_it_would_not_hear() {
    let own = Team::new(1, 0).states[0];
    let mut agent = Agent::new(UavId(0), TeamParams::table_1()).unwrap();
    let unsound = Scan { boresight: Some(Angle::from_rad(f64::NAN)), detections: &[] };
    let observation = agent.observe(Time::START, &own, Some(unsound));
    assert!(agent.outbox(&observation).is_empty());
    assert_eq!(agent.decide(&observation).diagnostics.refused.messages(), 1);
}

/// The first observation of an instant counts, also for the command.
#[test]
fn an_instant_is_observed_once() {
    let mut team = Team::new(2, 3);
    for tick in 0..30 {
        let (now, scans, inbox) = team.speak(tick);
        let own = team.states[0];
        let mut twice = team.agents[0].clone();
        let expected = step(&mut team.agents[0].clone(), now, &own, scan_of(&scans[0]), &inbox);
        let first = twice.observe(now, &own, Some(scan_of(&scans[0])));
        let moved = UavState { position: Position::from_m(9.0, 9.0), ..own };
        let second = twice.observe(now, &moved, Some(Scan::default()));
        assert_eq!(first, second);
        inbox.iter().for_each(|message| twice.hear(&second, message));
        assert_eq!(twice.decide(&second), expected);
        team.decide(now, &scans, &inbox);
    }
}

/// An instant of which nobody asked for a decision is known all the same; until the next decision the picture is the last
/// one decided.
#[test]
fn an_instant_that_is_not_decided_is_not_forgotten() {
    let mut team = Team::new(2, 4);
    let mut agents = [team.agents[0].clone(), team.agents[0].clone()];
    let mut fleet = Fleet::new(TeamParams::table_1()).unwrap();
    for tick in 0..60 {
        let (now, scans, inbox) = team.speak(tick);
        let own = team.states[0];
        for (agent, skips) in agents.iter_mut().zip([false, true]) {
            let before = agent.picture().clone();
            let observation = agent.observe(now, &own, Some(scan_of(&scans[0])));
            assert!(*agent.picture() == before || skips && (tick - 1) % 7 > 4, "tick {tick}");
            inbox.iter().for_each(|message| agent.hear(&observation, message));
            if !(skips && tick % 7 > 4) {
                agent.decide(&observation);
                assert_eq!(agent.picture().time, now);
            }
        }
        // The same of a fleet.
        let observed = observe_all(&mut fleet, now, &team.states, &scans, &inbox);
        team.decide(now, &scans, &inbox);
        if tick % 7 <= 4 {
            fleet.decide(&observed[0]);
            for picture in [agents[1].picture(), fleet.picture()] {
                assert_eq!(format!("{picture:?}"), format!("{:?}", agents[0].picture()), "tick {tick}");
            }
        }
    }
}

/// Nothing is heard or said with another agent's observation.
#[test]
fn another_agents_observation_opens_no_ear() {
    let mut team = Team::new(2, 3);
    let (now, scans, inbox) = team.speak(0);
    let own = team.states[0];
    let other = team.agents[1].clone().observe(now, &own, Some(scan_of(&scans[1])));
    let observation = team.agents[0].observe(now, &own, Some(scan_of(&scans[0])));
    inbox.iter().for_each(|message| team.agents[0].hear(&other, message));
    assert!(team.agents[0].outbox(&other).is_empty() && !team.agents[0].outbox(&observation).is_empty());
    team.agents[0].decide(&observation);
    assert!(team.agents[0].picture().known().is_empty());
}

/// Nothing is heard with an observation of an instant that is over.
#[test]
fn what_is_heard_of_an_old_observation_changes_nothing() {
    let mut team = Team::new(2, 3);
    let (now, scans, inbox) = team.speak(0);
    let own = team.states[0];
    let old = team.agents[0].observe(now, &own, Some(scan_of(&scans[0])));
    team.decide(now, &scans, &inbox);
    team.tick(1);
    let before = format!("{:?}", team.agents[0].picture());
    inbox.iter().for_each(|message| team.agents[0].hear(&old, message));
    let late = Cue {
        searcher: 1,
        said: now,
        number: 0,
        label: TargetLabel(77),
        time: now,
        position: Position::ORIGIN,
        velocity: Velocity::ZERO,
        position_sd_m: 20.0,
        velocity_sd_m_s: 2.0,
    };
    team.agents[0].hear(&old, &Message::Cue(late));
    team.agents[0].decide(&old);
    assert_eq!(format!("{:?}", team.agents[0].picture()), before);
    let mut fleet = Fleet::new(TeamParams::table_1()).unwrap();
    let old = fleet.observe(now, UavId(0), &own, Some(Scan::default()));
    let new = fleet.observe(now + Duration::from_s(0.5), UavId(0), &own, Some(Scan::default()));
    fleet.hear(&old, &Message::Cue(late));
    fleet.decide(&new);
    assert!(fleet.picture().known().is_empty());
}

/// The pair settles on an orbit at right angles and all targets are held.
#[test]
fn a_pair_settles_at_right_angles() {
    let mut team = Team::new(2, 4);
    for tick in 0..400 {
        team.tick(tick);
    }
    let picture = team.agents[0].picture();
    assert!(picture.known().iter().all(|known| known.track.status == TrackStatus::Held), "{picture:?}");
    let centre = picture.groups[0].centre.estimate().state.position();
    let phases: Vec<_> = team.states.iter().map(|state| (state.position - centre).direction()).collect();
    let separation_deg = (phases[1] - phases[0]).deg().abs();
    assert!((separation_deg - 90.0).abs() < 5.0, "{separation_deg}");
    for state in &team.states {
        let error_m = state.position.distance_m(centre) - picture.groups[0].standoff.distance_m;
        assert!(error_m.abs() < 20.0, "{error_m}");
    }
}

/// One wrong time, ahead or behind, is refused and told of, and leaves no trace; the furthest that is believed is.
#[test]
fn a_clock_that_jumps_for_one_step_changes_no_bit() {
    let hour = Duration::from_us(3_600_000_000);
    let mut team = Team::new(2, 4);
    let mut wrong_now_and_then = team.agents[0].clone();
    for tick in 0..40 {
        let (now, scans, inbox) = team.speak(tick);
        let own = team.states[0];
        if tick > 0 {
            let before = format!("{:?}", wrong_now_and_then.picture());
            // More than a tenth of a period off the grid, before the last instant, or too far ahead.
            let us = [50_001, -50_001, -1_000_000].map(|us| now + Duration::from_us(us));
            for wrong in us.into_iter().chain([now + hour, Time::from_us(i64::MAX), Time::from_us(i64::MIN)]) {
                let step = step(&mut wrong_now_and_then, wrong, &own, scan_of(&scans[0]), &inbox);
                assert!((25.0..=55.0).contains(&step.command.speed_m_s));
            }
            assert_eq!(format!("{:?}", wrong_now_and_then.picture()), before);
        }
        let got = step(&mut wrong_now_and_then, now, &own, scan_of(&scans[0]), &inbox);
        assert_eq!((i64::from(got.diagnostics.refused.instants), got.diagnostics.refused.messages()), (6 * tick, 0));
        team.decide(now, &scans, &inbox);
        assert_eq!(format!("{:?}", wrong_now_and_then.picture()), format!("{:?}", team.agents[0].picture()));
    }
    let (last, own) = (team.agents[0].picture().time, team.states[0]);
    for (agent, gap_us, refused) in [(0, 10_000_000, 0), (1, 10_500_000, 1)] {
        let now = last + Duration::from_us(gap_us);
        let agent = &mut team.agents[agent];
        assert_eq!(step(agent, now, &own, Scan::default(), &[]).diagnostics.refused.instants, refused);
        assert_eq!(agent.picture().time, if refused == 0 { now } else { last });
    }
}

/// A clock that was set stays refused until the agent is reset; then it knows, to the bit, what a new one knows, its
/// counts go on, and its teammates hear it.
#[test]
fn a_reset_agent_begins_anew_at_any_time() {
    let mut team = Team::new(2, 4);
    for tick in 0..20 {
        team.tick(tick);
    }
    for first_tick in [10_000, -10_000] {
        let own = team.states[0];
        let (now, scans, _) = team.speak(first_tick);
        for agent in &mut team.agents {
            let before = step(agent, now, &own, Scan::default(), &[]).diagnostics.refused.instants;
            assert_eq!(step(agent, now, &own, Scan::default(), &[]).diagnostics.refused.instants, before + 1);
            agent.reset();
            assert!(agent.picture().known().is_empty());
        }
        drop(scans);
        let mut fresh = Team::new(2, 4);
        fresh.states.clone_from(&team.states);
        let cues: Vec<Message> =
            fresh.speak(first_tick).2.into_iter().filter(|said| matches!(said, Message::Cue(_))).collect();
        for tick in first_tick..first_tick + 40 {
            let (now, scans, mut inbox) = team.speak(tick);
            if tick == first_tick {
                inbox.extend(cues.clone());
            }
            for (index, agent) in fresh.agents.iter_mut().enumerate() {
                step(agent, now, &team.states[index], scan_of(&scans[index]), &inbox);
            }
            team.decide(now, &scans, &inbox);
            for (agent, fresh) in team.agents.iter().zip(&fresh.agents) {
                assert_eq!(format!("{:?}", agent.picture()), format!("{:?}", fresh.picture()));
                assert_eq!((agent.picture().known().len(), agent.picture().crew.len()), (4, 2));
            }
        }
    }
    let own = team.states[0];
    let refused = step(&mut team.agents[0], Time::START, &own, Scan::default(), &[]).diagnostics;
    assert_eq!((refused.refused.instants, refused.refused.messages()), (5, 0));
}

/// The same of a fleet.
#[test]
fn a_fleet_refuses_what_its_agents_refuse_and_can_be_reset() {
    let mut team = Team::new(2, 4);
    let mut fleet = Fleet::new(TeamParams::table_1()).unwrap();
    let hear = |fleet: &mut Fleet, team: &mut Team, at: Option<Time>| {
        let (now, scans, inbox) = team.speak(0);
        let observed = observe_all(fleet, at.unwrap_or(now), &team.states, &scans, &inbox);
        fleet.decide(&observed[0])
    };
    hear(&mut fleet, &mut team, None);
    let before = format!("{:?}", fleet.picture());
    let later = Time::from_us(3_600_000_000);
    let refused = hear(&mut fleet, &mut team, Some(later)).diagnostics.refused.instants;
    assert_eq!(format!("{:?}", fleet.picture()), before);
    // One for each UAV.
    assert_eq!(refused, 2);
    fleet.reset();
    assert!(fleet.picture().known().is_empty());
    hear(&mut fleet, &mut team, Some(later));
    assert_eq!((fleet.picture().time, fleet.picture().crew.len()), (later, 0));
}

/// Two searchers hand the same targets over: whichever is heard first, and whether at once or within a second step of
/// the instant, all agents know the same.
#[test]
fn two_cues_of_one_target_leave_one_picture_whatever_their_order() {
    let own = Team::new(1, 0).states[0];
    let of_searcher = |searcher: u32, x_m: f64, position_sd_m: f64| {
        (0..3u16).map(move |target| {
            Message::Cue(Cue {
                searcher,
                said: Time::START,
                number: target,
                label: TargetLabel(target.into()),
                time: Time::START,
                position: Position::from_m(x_m + f64::from(target), 0.0),
                velocity: Velocity::from_m_s(5.0, 0.0),
                position_sd_m,
                velocity_sd_m_s: 2.0,
            })
        })
    };
    let first: Vec<Message> =
        of_searcher(0, 0.0, 20.0).chain(of_searcher(1, 30.0, 10.0)).chain(of_searcher(2, -9.0, 10.0)).collect();
    let mut reversed = first.clone();
    reversed.reverse();
    let picture = |inboxes: &[&[Message]]| {
        let mut agent = Agent::new(UavId(0), TeamParams::table_1()).unwrap();
        for inbox in inboxes {
            step(&mut agent, Time::START, &own, Scan::default(), inbox);
        }
        format!("{:?}", agent.picture())
    };
    let expected = picture(&[&first]);
    assert!(expected.contains("Cued"), "{expected}");
    for other in
        [picture(&[&reversed]), picture(&[&first[..4], &first[4..]]), picture(&[&reversed[..2], &reversed[2..]])]
    {
        assert_eq!(other, expected);
    }
}

/// A message with an absurd epoch from, or in the name of, a teammate: it is heard again at the next instant.
#[test]
fn no_epoch_silences_a_teammate() {
    let mut team = Team::new(2, 4);
    let mut told_wrong = team.agents[0].clone();
    for tick in 0..60 {
        let (now, scans, inbox) = team.speak(tick);
        let mut heard = inbox.clone();
        if tick == 20 {
            for message in &mut heard {
                if let Message::Report(report) = message {
                    (report.epoch, report.sequence) = (u32::MAX, u32::MAX);
                }
            }
        }
        let own = team.states[0];
        let got = step(&mut told_wrong, now, &own, scan_of(&scans[0]), &heard).diagnostics;
        team.decide(now, &scans, &inbox);
        assert_eq!(got.refused.messages(), 0, "{tick}");
        assert_eq!(format!("{:?}", told_wrong.picture()), format!("{:?}", team.agents[0].picture()), "{tick}");
    }
}

/// An agent without any target circles where it is, inside the limits.
#[test]
fn with_nothing_to_watch_the_agent_holds_a_circle() {
    let mut agent = Agent::new(UavId(0), TeamParams::table_1()).unwrap();
    let own = Team::new(1, 0).states[0];
    let step = step(&mut agent, Time::START, &own, Scan::default(), &[]);
    assert_eq!(step.command, Command { speed_m_s: 40.0, turn_rate_rad_s: 0.16 });
    assert_eq!((step.look_at, step.diagnostics.group), (None, None));
}

#[test]
fn parameters_out_of_range_are_all_reported() {
    let mut params = TeamParams::table_1();
    params.uav.speed_m_s = -1.0;
    params.guidance.radial_gain = 0.0;
    let paths: Vec<_> = Agent::new(UavId(0), params).unwrap_err().into_iter().map(|error| error.path).collect();
    assert_eq!(paths, ["uav.speed_m_s", "uav.speed_change_max_m_s", "guidance.radial_gain"]);
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
        vertical: None,
    })
}

fn any_detections() -> impl Strategy<Value = Vec<Detection>> {
    let detection = (0..4u32, any_number(), any_number()).prop_map(|(target, range_m, bearing)| Detection {
        label: TargetLabel(target),
        measurement: RangeBearing { range_m, bearing: Angle::from_rad(bearing) },
    });
    proptest::collection::vec(detection, 0..5)
}

fn any_message(now_us: i64) -> impl Strategy<Value = Message> {
    let report = (0..3u32, any_state(), any_number(), any_detections(), prop_oneof![Just(now_us), any::<i64>()])
        .prop_map(|(uav, state, boresight, detections, us)| {
            let (sequence, boresight) = ((us as u32) | 1, Some(Angle::from_rad(boresight)));
            let report = Report::of(UavId(uav), Time::from_us(us), state);
            Message::Report(Report { sequence, boresight, detections, ..report })
        });
    let cue = (0..4u32, any_number(), any_number(), any_number(), any_number(), any_number()).prop_map(
        move |(target, x, y, vx, sd, sd_v)| {
            Message::Cue(Cue {
                searcher: 0,
                said: Time::from_us(now_us),
                number: target as u16,
                label: TargetLabel(target),
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
            let step = step(&mut agent, Time::from_us(us), state, scan, &messages);
            let command = step.command;
            prop_assert!((25.0..=55.0).contains(&command.speed_m_s), "{command:?}");
            prop_assert!(command.turn_rate_rad_s.abs() <= 0.3, "{command:?}");
            for known in agent.picture().known() {
                prop_assert!(known.track.estimate().state.0.iter().all(|value| value.is_finite()));
                prop_assert!(known.track.estimate().covariance.matrix().iter().all(|value| value.is_finite()));
            }
        }
    }
}
