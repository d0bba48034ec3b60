//! The example of docs/user/embedding.md works as the page describes.

#[expect(dead_code, reason = "the example has its own main")]
#[path = "../../examples/companion/main.rs"]
mod example;

use std::f64::consts::FRAC_PI_2;

use example::arguments::Arguments;
use example::udp::Loss;
use example::{Companion, PERIOD, cue, start, vehicles};
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
    standoff::enclosing_circle::EnclosingCircle::of(positions.into_iter()).unwrap().centre
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

#[test]
fn damaged_datagrams_are_counted() {
    let mut pair = team(2);
    let (observation, _) = pair[0].observe(Time::EPOCH);
    let (_, mut sent) = pair[1].observe(Time::EPOCH);
    pair[0].hear(&observation, &sent[0]);
    sent[0][9] ^= 1;
    pair[0].hear(&observation, &sent[0]);
    pair[0].hear(&observation, &[]);
    assert_eq!(pair[0].damaged, 2);
    assert!(pair[0].agent.last_report_at(UavId(1)).is_some());
}

#[test]
fn invalid_arguments_are_reported() {
    let parse = |text: &str| Arguments::parse(text.split(' ').map(str::to_owned));
    let valid =
        "--uav 1 --team 3 --port 4000 --seconds 5 --lose 20 --speed 3 --start-us 7 --restart-count 2 --at 1,-2,90";
    let Arguments { uav, team, port, seconds, lose_percent, speed, start_us, restart_count, at } =
        parse(valid).unwrap();
    assert_eq!((uav, team, port, seconds, lose_percent, speed), (1, 3, 4000, 5, 20, 3));
    assert_eq!((start_us, restart_count), (Some(7), 2));
    assert_eq!(at.map(|own| (own.position, own.heading)), Some((Position::from_m(1.0, -2.0), Angle::from_deg(90.0))));
    for (invalid, expected) in [
        ("--uav 3 --team 3 --port 4000 --seconds 5", "--uav must be less than --team"),
        ("--uav 0 --team 1 --seconds 5", "--port"),
        ("--lose 101", "--lose 101: must be a whole number from 0 to 100"),
        ("--at 1,2", "--at 1,2: must be three numbers"),
        ("--at 1,2,nan", "must be"),
        ("--start-us -1", "--start-us -1"),
        ("--seconds", "--seconds: missing value"),
        ("--speed 11", "--speed 11: must be a whole number from 0 to 10"),
        ("--rate 5", "--rate: unknown option"),
    ] {
        let error = parse(invalid).unwrap_err();
        assert!(error.contains(expected) && error.contains("usage"), "{invalid}: {error}");
    }
}

/// Data rate of `team` UAVs, kbit/s: mean over all UAVs, and maximum of any UAV in any second. They circle around ten
/// vehicles for two minutes, measure all of them twice a second, and lose `lose_percent` of the messages sent to them.
fn kbit_s(team: u32, lose_percent: u32) -> [f64; 2] {
    let params = TeamParams { link: LinkModel::Lossy, ..TeamParams::paper() };
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
            let detections: Vec<_> = (0..10)
                .map(|id| Detection { label: Some(TargetLabel(id)), measurement: measure(id), range_rate_m_s: None })
                .collect();
            let scan = Scan { boresight: Some(Angle::from_rad(heading.rad() + FRAC_PI_2)), detections: &detections };
            let observation = agent.observe(now, &own, Some(scan));
            let messages = agent.outbox(&observation).to_vec();
            by_second[id as usize][tick as usize / 2] +=
                messages.iter().map(|message| wire::encode(message).unwrap().len()).sum::<usize>();
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
fn ten_targets_need_less_than_25_kbit_s_at_a_packet_loss_of_20_percent() {
    for (lose_percent, mean_max) in [(0, 8.0), (20, 25.0), (50, 50.0)] {
        for team in [2, 4, 8] {
            let [mean, max] = kbit_s(team, lose_percent);
            println!("{team} UAVs, {lose_percent} % lost: mean {mean:.1} kbit/s, maximum {max:.1} kbit/s");
            assert!(mean < mean_max, "{team} UAVs, {lose_percent} %: {mean:.1} kbit/s");
        }
    }
}

/// A companion computer may run the agent on any thread.
#[test]
fn an_agent_can_move_to_another_thread() {
    let agent = Agent::new(UavId(3), TeamParams::paper()).unwrap();
    assert_eq!(std::thread::spawn(move || agent.id()).join().unwrap(), UavId(3));
}

/// Without packet loss, the output of a process depends only on the mission time.
#[test]
fn the_book_quotes_the_printed_lines() {
    let page = include_str!("../../../../docs/user/embedding.md");
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
