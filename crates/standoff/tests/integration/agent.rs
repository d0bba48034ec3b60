//! The agent: valid results for any input, and identical team states in all agents.

use crate::common::{Team, observe_all, outgoing, scan_of, step};
use proptest::prelude::*;
use standoff::*;

/// With an ideal radio all agents have the same team state, bit for bit.
#[test]
fn all_team_states_are_bit_identical() {
    let mut team = Team::new(4, 7);
    for tick in 0..120 {
        team.tick(tick);
        let first = format!("{:?}", team.agents[0].team_state());
        for agent in &team.agents[1..] {
            assert_eq!(format!("{:?}", agent.team_state()), first, "tick {tick}");
        }
    }
}

/// Messages that arrive late within a time step, twice, or in another order change no bit of the decision.
#[test]
fn a_decision_can_be_repeated_after_further_messages() {
    let mut team = Team::new(3, 5);
    for tick in 0..40 {
        let (now, scans, mut inbox) = team.speak(tick);
        for (index, agent) in team.agents.iter_mut().enumerate() {
            let own = team.states[index];
            let mut other = agent.clone();
            let once = step(agent, now, &own, scan_of(&scans[index]), &inbox).command;
            let observation = other.observe(now, &own, Some(scan_of(&scans[index])));
            other.decide(&observation);
            inbox[1..].iter().for_each(|message| other.receive(&observation, message));
            other.decide(&observation);
            inbox.reverse();
            inbox.iter().for_each(|message| other.receive(&observation, message));
            assert_eq!(once, other.decide(&observation).command);
            assert_eq!(agent.team_state(), other.team_state());
        }
        team.fly(now);
    }
}

/// An agent that has received no message yet does not know the latency. It uses the first messages even if they are
/// older than the teammate timeout.
#[test]
fn the_first_messages_are_used_if_they_are_within_the_horizon() {
    let mut team = Team::new(2, 3);
    let (mut sent, mut late) = (Vec::new(), 0);
    let mut agent = team.agents[0].clone();
    for tick in 0..20 {
        let (now, scans, messages) = team.speak(tick);
        sent.push(messages);
        let own = team.states[0];
        let observation = agent.observe(now, &own, Some(scan_of(&scans[0])));
        // A latency of eight periods; the teammate timeout is six.
        if let Some(messages) = (tick as usize).checked_sub(8).map(|then| &sent[then]) {
            messages.iter().for_each(|message| agent.receive(&observation, message));
        }
        late = agent.decide(&observation).diagnostics.rejected.late.max(late);
    }
    assert_eq!((agent.team_state().tracks().len(), late), (3, 0));
}

/// Teammates of a banking UAV need its command to avoid it: its bank angle is still on its way to that of the commanded
/// turn. Without a minimum separation, it is not sent.
#[test]
fn banking_uavs_report_their_command() {
    let own = UavState::level_flight(Position::from_m(0.0, 0.0), Angle::from_deg(0.0), 40.0);
    let reported = |bank: Option<BankParams>, keeps_separation: bool| {
        let mut params = TeamParams::recommended();
        params.uav.bank = bank;
        params.separation = params.separation.filter(|_| keeps_separation);
        let mut agent = Agent::new(UavId(0), params).unwrap();
        let mut reports = Vec::new();
        for tick in 0..2 {
            let observation = agent.observe(Time::from_us(500_000 * tick), &own, Some(Scan::default()));
            if let Some(Message::Report(report)) = agent.outbox(&observation).first() {
                reports.push(report.manoeuvre);
            }
            agent.decide(&observation);
        }
        assert_eq!((reports.len(), reports[0]), (2, None));
        reports[1]
    };
    let manoeuvre = reported(Some(BankParams::default()), true).unwrap();
    assert_eq!((manoeuvre.avoids, manoeuvre.command.speed_m_s), (None, 40.0));
    assert_eq!([reported(None, true), reported(Some(BankParams::default()), false)], [None, None]);
}

/// An agent sends the report of its scan. Without a scan it sends nothing and does not count as a teammate, but
/// receives.
#[test]
fn an_agent_sends_the_report_of_its_scan() {
    let mut team = Team::new(2, 3);
    for tick in 0..9 {
        team.tick(tick);
    }
    let (now, scans, inbox) = team.speak(9);
    let own = team.states[0];
    let agent = &mut team.agents[0];
    let observation = agent.observe(now, &own, Some(scan_of(&scans[0])));
    let [Message::Report(report)] = agent.outbox(&observation) else { panic!("not exactly one report") };
    assert_eq!(
        (report.uav, report.restart_count, report.sequence, report.time, report.state),
        (UavId(0), 0, 10, now, own)
    );
    assert_eq!((report.boresight, &report.detections), (scans[0].0, &scans[0].1));
    agent.decide(&observation);
    let later = now + Duration::from_s(0.5);
    let silent = agent.observe(later, &own, None);
    assert_eq!((agent.outbox(&silent), agent.outbox(&observation)), (&[][..], &[][..]));
    for message in inbox {
        let Message::Report(report) = message else { continue };
        agent.receive(&silent, &Message::Report(Report { time: later, ..report }));
    }
    agent.decide(&silent);
    let is_received: Vec<_> =
        agent.team_state().teammates.iter().map(|teammate| (teammate.uav, teammate.reported_now)).collect();
    assert_eq!(is_received, [(UavId(0), false), (UavId(1), true)]);
}

/// An agent does not send a report that it would reject itself.
#[test]
fn an_agent_does_not_send_an_invalid_report() {
    let own = Team::new(1, 0).states[0];
    let mut agent = Agent::new(UavId(0), TeamParams::paper()).unwrap();
    let invalid = Scan { boresight: Some(Angle::from_rad(f64::NAN)), detections: &[] };
    let observation = agent.observe(Time::EPOCH, &own, Some(invalid));
    assert!(agent.outbox(&observation).is_empty());
    assert_eq!(agent.decide(&observation).diagnostics.rejected.messages(), 1);
}

/// Only the first observation of a time step is used, also for the command.
#[test]
fn a_time_step_is_observed_once() {
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
        inbox.iter().for_each(|message| twice.receive(&second, message));
        assert_eq!(twice.decide(&second), expected);
        team.decide(now, &scans, &inbox);
    }
}

/// A time step without a call of `decide` is still processed. Until the next decision, the team state is that of the
/// last decision.
#[test]
fn a_time_step_without_a_decision_is_not_forgotten() {
    let mut team = Team::new(2, 4);
    let mut agents = [team.agents[0].clone(), team.agents[0].clone()];
    let mut fleet = TeamAgent::new(TeamParams::paper()).unwrap();
    for tick in 0..60 {
        let (now, scans, inbox) = team.speak(tick);
        let own = team.states[0];
        for (agent, skips) in agents.iter_mut().zip([false, true]) {
            let before = agent.team_state().clone();
            let observation = agent.observe(now, &own, Some(scan_of(&scans[0])));
            assert!(*agent.team_state() == before || skips && (tick - 1) % 7 > 4, "tick {tick}");
            inbox.iter().for_each(|message| agent.receive(&observation, message));
            if !(skips && tick % 7 > 4) {
                agent.decide(&observation);
                assert_eq!(agent.team_state().time, now);
            }
        }
        // The same for a fleet.
        let observed = observe_all(&mut fleet, now, &team.states, &scans, &inbox);
        team.decide(now, &scans, &inbox);
        if tick % 7 <= 4 {
            fleet.decide(&observed[0]);
            for team_state in [agents[1].team_state(), fleet.team_state()] {
                assert_eq!(format!("{team_state:?}"), format!("{:?}", agents[0].team_state()), "tick {tick}");
            }
        }
    }
}

/// An agent neither receives nor sends with another agent's observation.
#[test]
fn another_agents_observation_is_ignored() {
    let mut team = Team::new(2, 3);
    let (now, scans, inbox) = team.speak(0);
    let own = team.states[0];
    let other = team.agents[1].clone().observe(now, &own, Some(scan_of(&scans[1])));
    let observation = team.agents[0].observe(now, &own, Some(scan_of(&scans[0])));
    inbox.iter().for_each(|message| team.agents[0].receive(&other, message));
    assert!(team.agents[0].outbox(&other).is_empty() && !team.agents[0].outbox(&observation).is_empty());
    team.agents[0].decide(&observation);
    assert!(team.agents[0].team_state().tracks().is_empty());
}

/// Messages passed with the observation of a past time step are ignored.
#[test]
fn messages_with_an_old_observation_are_ignored() {
    let mut team = Team::new(2, 3);
    let (now, scans, inbox) = team.speak(0);
    let own = team.states[0];
    let old = team.agents[0].observe(now, &own, Some(scan_of(&scans[0])));
    team.decide(now, &scans, &inbox);
    team.tick(1);
    let before = format!("{:?}", team.agents[0].team_state());
    inbox.iter().for_each(|message| team.agents[0].receive(&old, message));
    let late = Cue {
        source: 1,
        issued_at: now,
        sequence: 0,
        label: Some(TargetLabel(77)),
        time: now,
        position: Position::ORIGIN,
        velocity: Velocity::ZERO,
        position_sd_m: 20.0,
        velocity_sd_m_s: 2.0,
        priority: None,
    };
    team.agents[0].receive(&old, &Message::Cue(late));
    team.agents[0].decide(&old);
    assert_eq!(format!("{:?}", team.agents[0].team_state()), before);
    let mut fleet = TeamAgent::new(TeamParams::paper()).unwrap();
    let old = fleet.observe(now, UavId(0), &own, Some(Scan::default()));
    let new = fleet.observe(now + Duration::from_s(0.5), UavId(0), &own, Some(Scan::default()));
    fleet.receive(&old, &Message::Cue(late));
    fleet.decide(&new);
    assert!(fleet.team_state().tracks().is_empty());
}

/// A pair of UAVs converges to an orbit at a phase difference of 90 degrees and measures all targets.
#[test]
fn a_pair_converges_to_the_desired_phase() {
    let mut team = Team::new(2, 4);
    for tick in 0..400 {
        team.tick(tick);
    }
    let team_state = team.agents[0].team_state();
    assert!(team_state.tracks().iter().all(|known| known.track.status == TrackStatus::Updated), "{team_state:?}");
    let centre = team_state.groups[0].centre().state.position();
    let phases: Vec<_> = team.states.iter().map(|state| (state.position - centre).direction()).collect();
    let difference_deg = (phases[1] - phases[0]).deg().abs();
    assert!((difference_deg - 90.0).abs() < 5.0, "{difference_deg}");
    for state in &team.states {
        let error_m = state.position.distance_m(centre) - team_state.groups[0].standoff.distance_m;
        assert!(error_m.abs() < 20.0, "{error_m}");
    }
}

/// A wrong time, ahead or behind, is rejected, counted, and changes nothing. The largest permitted jump is accepted.
#[test]
fn a_clock_jump_of_one_step_changes_no_bit() {
    let hour = Duration::from_us(3_600_000_000);
    let mut team = Team::new(2, 4);
    let mut tested = team.agents[0].clone();
    for tick in 0..40 {
        let (now, scans, inbox) = team.speak(tick);
        let own = team.states[0];
        if tick > 0 {
            let before = format!("{:?}", tested.team_state());
            // More than a tenth of a period off the grid, before the last time step, or too far ahead.
            let us = [50_001, -50_001, -1_000_000].map(|us| now + Duration::from_us(us));
            for wrong in us.into_iter().chain([now + hour, Time::from_us(i64::MAX), Time::from_us(i64::MIN)]) {
                let step = step(&mut tested, wrong, &own, scan_of(&scans[0]), &inbox);
                assert!((25.0..=55.0).contains(&step.command.speed_m_s));
            }
            assert_eq!(format!("{:?}", tested.team_state()), before);
        }
        let got = step(&mut tested, now, &own, scan_of(&scans[0]), &inbox);
        assert_eq!((i64::from(got.diagnostics.rejected.bad_time), got.diagnostics.rejected.messages()), (6 * tick, 0));
        team.decide(now, &scans, &inbox);
        assert_eq!(format!("{:?}", tested.team_state()), format!("{:?}", team.agents[0].team_state()));
    }
    let (last, own) = (team.agents[0].team_state().time, team.states[0]);
    for (agent, gap_us, refused) in [(0, 10_000_000, 0), (1, 10_500_000, 1)] {
        let now = last + Duration::from_us(gap_us);
        let agent = &mut team.agents[agent];
        assert_eq!(step(agent, now, &own, Scan::default(), &[]).diagnostics.rejected.bad_time, refused);
        assert_eq!(agent.team_state().time, if refused == 0 { now } else { last });
    }
}

/// The clock of UAV 1 is off, drifts, or is set during the mission. The agents stay equal, and only a set clock costs a
/// time step.
#[test]
fn an_agent_follows_a_clock_that_is_off_or_drifts() {
    type Clock = fn(f64) -> f64;
    let clocks: [(Clock, u32); 6] = [
        (|now_s| 0.2 + now_s, 0),
        (|now_s| now_s - 0.24, 0),
        (|now_s| now_s * (1.0 + 500e-6), 0),
        (|now_s| now_s * (1.0 - 1_900e-6), 0),
        (|now_s| 0.2 + now_s * (1.0 + 1_900e-6), 0),
        (|now_s| if now_s < 30.0 { now_s } else { now_s + 0.2 }, 1),
    ];
    for (index, (clock, bad_times)) in clocks.into_iter().enumerate() {
        let mut team = Team::new(2, 4);
        for tick in 0..600 {
            let (now, scans, mut inbox) = team.speak(tick);
            let off = Time::EPOCH + Duration::from_s(clock(now.s()));
            inbox.retain(|message| !matches!(message, Message::Report(report) if report.uav == UavId(1)));
            inbox.extend(outgoing(&team.agents[1], off, &team.states[1], scan_of(&scans[1])));
            let times = [now, off];
            let mut commands = Vec::new();
            for (index, agent) in team.agents.iter_mut().enumerate() {
                commands.push(step(agent, times[index], &team.states[index], scan_of(&scans[index]), &inbox));
            }
            // The report of the rejected time step is missing until it is retransmitted.
            let is_repaired = bad_times == 0 || !(60..70).contains(&tick);
            if is_repaired {
                let [one, other] = [0, 1].map(|agent| team.agents[agent].team_state().digest());
                assert_eq!(one, other, "clock {index}, {now:?}");
                assert_eq!(team.agents[0].team_state().teammates.len(), 2, "clock {index}, {now:?}");
            }
            assert_eq!(commands[1].diagnostics.rejected.bad_time, if tick < 60 { 0 } else { bad_times });
            team.apply(&commands, now);
        }
    }
}

/// A clock that was set, or a long pause, is distinguished from single wrong times and from times off the grid.
#[test]
fn a_time_jump_is_detected_at_its_second_time_step() {
    let own = UavState::level_flight(Position::ORIGIN, Angle::ZERO, 40.0);
    let jumps = |times_s: &[f64]| {
        let mut agent = Agent::new(UavId(0), TeamParams::paper()).unwrap();
        let observe = |time_s: &f64| {
            let _ = agent.observe(Time::EPOCH + Duration::from_s(*time_s), &own, Some(Scan::default()));
            agent.is_time_jump()
        };
        let jumps: Vec<_> = times_s.iter().map(observe).collect();
        agent.reset();
        assert!(!agent.is_time_jump());
        jumps
    };
    assert_eq!(jumps(&[0.0, 3600.0, 3600.5, 3600.5, 3601.5]), [false, false, true, true, true]);
    assert_eq!(jumps(&[100.0, 0.0, 0.0, 0.5, 100.5, 0.5]), [false, false, false, true, false, false]);
    for wrong in [[0.0, 3600.0, 0.5, 3600.5], [0.0, 3600.0, 1800.0, 900.0], [0.0, 3600.2, 3600.7, 3601.2]] {
        assert_eq!(jumps(&wrong), [false; 4], "{wrong:?}");
    }
}

/// After its clock was set, an agent rejects the time until it is reset. Then its team state equals that of a new
/// agent, bit for bit. Its counters continue, and its teammates accept its reports.
#[test]
fn a_reset_agent_starts_from_scratch_at_any_time() {
    let mut team = Team::new(2, 4);
    for tick in 0..20 {
        team.tick(tick);
    }
    for first_tick in [10_000, -10_000] {
        let own = team.states[0];
        let (now, scans, _) = team.speak(first_tick);
        for agent in &mut team.agents {
            let before = step(agent, now, &own, Scan::default(), &[]).diagnostics.rejected.bad_time;
            assert_eq!(step(agent, now, &own, Scan::default(), &[]).diagnostics.rejected.bad_time, before + 1);
            agent.reset();
            assert!(agent.team_state().tracks().is_empty());
        }
        drop(scans);
        let mut fresh = Team::new(2, 4);
        fresh.states.clone_from(&team.states);
        let cues: Vec<Message> =
            fresh.speak(first_tick).2.into_iter().filter(|message| matches!(message, Message::Cue(_))).collect();
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
                assert_eq!(format!("{:?}", agent.team_state()), format!("{:?}", fresh.team_state()));
                assert_eq!((agent.team_state().tracks().len(), agent.team_state().assignments.len()), (4, 2));
            }
        }
    }
    let own = team.states[0];
    let refused = step(&mut team.agents[0], Time::EPOCH, &own, Scan::default(), &[]).diagnostics;
    assert_eq!((refused.rejected.bad_time, refused.rejected.messages()), (5, 0));
}

/// A fleet rejects wrong times like an agent, and can be reset.
#[test]
fn a_fleet_rejects_wrong_times_and_can_be_reset() {
    let mut team = Team::new(2, 4);
    let mut fleet = TeamAgent::new(TeamParams::paper()).unwrap();
    let run = |fleet: &mut TeamAgent, team: &mut Team, at: Option<Time>| {
        let (now, scans, inbox) = team.speak(0);
        let observed = observe_all(fleet, at.unwrap_or(now), &team.states, &scans, &inbox);
        fleet.decide(&observed[0])
    };
    run(&mut fleet, &mut team, None);
    let before = format!("{:?}", fleet.team_state());
    let later = Time::from_us(3_600_000_000);
    let rejected = run(&mut fleet, &mut team, Some(later)).diagnostics.rejected.bad_time;
    assert_eq!(format!("{:?}", fleet.team_state()), before);
    // One per UAV.
    assert_eq!(rejected, 2);
    fleet.reset();
    assert!(fleet.team_state().tracks().is_empty());
    run(&mut fleet, &mut team, Some(later));
    assert_eq!((fleet.team_state().time, fleet.team_state().assignments.len()), (later, 0));
}

/// Several cue sources send cues for the same targets. The team state does not depend on their order, nor on whether
/// they arrive together or in two parts of the time step.
#[test]
fn two_cues_of_one_target_give_the_same_team_state_in_any_order() {
    let own = Team::new(1, 0).states[0];
    let of_searcher = |searcher: u32, x_m: f64, position_sd_m: f64| {
        (0..3u16).map(move |target| {
            Message::Cue(Cue {
                source: searcher,
                issued_at: Time::EPOCH,
                sequence: target,
                label: Some(TargetLabel(target.into())),
                time: Time::EPOCH,
                position: Position::from_m(x_m + f64::from(target), 0.0),
                velocity: Velocity::from_m_s(5.0, 0.0),
                position_sd_m,
                velocity_sd_m_s: 2.0,
                priority: None,
            })
        })
    };
    let first: Vec<Message> =
        of_searcher(0, 0.0, 20.0).chain(of_searcher(1, 30.0, 10.0)).chain(of_searcher(2, -9.0, 10.0)).collect();
    let mut reversed = first.clone();
    reversed.reverse();
    let team_state = |inboxes: &[&[Message]]| {
        let mut agent = Agent::new(UavId(0), TeamParams::paper()).unwrap();
        for inbox in inboxes {
            step(&mut agent, Time::EPOCH, &own, Scan::default(), inbox);
        }
        format!("{:?}", agent.team_state())
    };
    let expected = team_state(&[&first]);
    assert!(expected.contains("Cued"), "{expected}");
    for other in [
        team_state(&[&reversed]),
        team_state(&[&first[..4], &first[4..]]),
        team_state(&[&reversed[..2], &reversed[2..]]),
    ] {
        assert_eq!(other, expected);
    }
}

/// After a message with an absurd restart count from a teammate, or in its name, its next reports are still accepted.
#[test]
fn an_absurd_restart_count_does_not_silence_a_teammate() {
    let mut team = Team::new(2, 4);
    let mut tested = team.agents[0].clone();
    for tick in 0..60 {
        let (now, scans, inbox) = team.speak(tick);
        let mut received = inbox.clone();
        if tick == 20 {
            for message in &mut received {
                if let Message::Report(report) = message {
                    (report.restart_count, report.sequence) = (u32::MAX, u32::MAX);
                }
            }
        }
        let own = team.states[0];
        let got = step(&mut tested, now, &own, scan_of(&scans[0]), &received).diagnostics;
        team.decide(now, &scans, &inbox);
        assert_eq!(got.rejected.messages(), 0, "{tick}");
        assert_eq!(format!("{:?}", tested.team_state()), format!("{:?}", team.agents[0].team_state()), "{tick}");
    }
}

/// An agent without targets circles at its current position, within the limits.
#[test]
fn an_agent_without_targets_flies_a_circle() {
    let mut agent = Agent::new(UavId(0), TeamParams::paper()).unwrap();
    let own = Team::new(1, 0).states[0];
    let step = step(&mut agent, Time::EPOCH, &own, Scan::default(), &[]);
    assert_eq!(step.command, Command { speed_m_s: 40.0, turn_rate_rad_s: 0.16 });
    assert_eq!((step.pointing_target, step.diagnostics.group), (None, None));
}

#[test]
fn parameters_out_of_range_are_all_reported() {
    let mut params = TeamParams::paper();
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
        label: Some(TargetLabel(target)),
        measurement: RangeBearingMeasurement { range_m, bearing: Angle::from_rad(bearing) },
        range_rate_m_s: None,
    });
    proptest::collection::vec(detection, 0..5)
}

fn any_message(now_us: i64) -> impl Strategy<Value = Message> {
    let report = (0..3u32, any_state(), any_number(), any_detections(), prop_oneof![Just(now_us), any::<i64>()])
        .prop_map(|(uav, state, boresight, detections, us)| {
            let (sequence, boresight) = ((us as u32) | 1, Some(Angle::from_rad(boresight)));
            let report = Report::position_only(UavId(uav), Time::from_us(us), state);
            Message::Report(Report { sequence, boresight, detections, ..report })
        });
    let cue = (0..4u32, any_number(), any_number(), any_number(), any_number(), any_number()).prop_map(
        move |(target, x, y, vx, sd, sd_v)| {
            Message::Cue(Cue {
                source: 0,
                issued_at: Time::from_us(now_us),
                sequence: target as u16,
                label: Some(TargetLabel(target)),
                time: Time::from_us(now_us),
                position: Position::from_m(x, y),
                velocity: Velocity::from_m_s(vx, y),
                position_sd_m: sd,
                velocity_sd_m_s: sd_v,
                priority: None,
            })
        },
    );
    prop_oneof![report, cue]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]
    /// For any input, the command is finite and within the limits, and the team state is finite.
    #[test]
    fn any_input_gives_a_valid_command_and_a_finite_team_state(
        states in proptest::collection::vec(any_state(), 1..8),
        detections in any_detections(),
        messages in proptest::collection::vec(any_message(500_000), 0..6),
        times in proptest::collection::vec(prop_oneof![Just(500_000i64), 0..5_000_000i64, any::<i64>()], 8),
    ) {
        let mut agent = Agent::new(UavId(0), TeamParams::paper()).unwrap();
        for (state, us) in states.iter().zip(times) {
            let scan = Scan { boresight: Some(state.heading), detections: &detections };
            let step = step(&mut agent, Time::from_us(us), state, scan, &messages);
            let command = step.command;
            prop_assert!((25.0..=55.0).contains(&command.speed_m_s), "{command:?}");
            prop_assert!(command.turn_rate_rad_s.abs() <= 0.3, "{command:?}");
            for known in agent.team_state().tracks() {
                prop_assert!(known.track.estimate().state.0.iter().all(|value| value.is_finite()));
                prop_assert!(known.track.estimate().covariance.matrix().iter().all(|value| value.is_finite()));
            }
        }
    }
}
