//! The example of docs/embedding.md: it does what the page says.

#![expect(clippy::unwrap_used, reason = "helpers of tests")]

#[expect(dead_code, reason = "it has a main of its own")]
#[path = "../examples/companion/main.rs"]
mod companion;

use std::f64::consts::FRAC_PI_2;

use companion::arguments::Arguments;
use companion::udp::Loss;
use companion::{Companion, PERIOD, cue, start, vehicles, wire};
use proptest::prelude::*;
use standoff::*;

/// Flies a team in one process, in which all clocks are the same and each radio loses so much of what comes. `is_on` says
/// whether the computer of a UAV runs at an instant, by its number; `tell` is called after every instant.
fn fly(
    mut team: Vec<Companion>,
    seconds: u32,
    (lose_percent, seed): (u32, u32),
    is_on: impl Fn(usize, i64) -> bool,
    mut tell: impl FnMut(i64, &mut Vec<Companion>),
) -> Vec<Companion> {
    let mut losses: Vec<_> = (0..).zip(&team).map(|(id, _)| Loss::new(lose_percent, seed + id)).collect();
    for tick in 0..=2 * i64::from(seconds) {
        let now = Time::from_us(tick * PERIOD.us());
        let on: Vec<usize> = (0..team.len()).filter(|uav| is_on(*uav, tick)).collect();
        let said: Vec<_> = on.iter().map(|uav| team[*uav].observe(now)).collect();
        for (uav, (observation, _)) in on.iter().zip(&said) {
            let others = on.iter().zip(&said).filter(|(other, _)| *other != uav);
            let heard = others.flat_map(|(_, (_, said))| said).filter(|_| !losses[*uav].loses());
            heard.for_each(|bytes| team[*uav].hear(observation, bytes));
            team[*uav].decide(observation);
        }
        tell(tick, &mut team);
    }
    team
}

/// A team at the mission's start.
fn team(uavs: u32) -> Vec<Companion> {
    (0..uavs).map(|id| Companion::new(id, 0, start(id, uavs)).unwrap()).collect()
}

/// How far a UAV is, at the end, from an orbit of `r_d_m` about the true centroid, m.
fn error_m(uav: &Companion, end: Time, r_d_m: f64) -> f64 {
    (uav.own.position.distance_m(centroid(end)) - r_d_m).abs()
}

fn centroid(now: Time) -> Position {
    let places: Vec<_> = vehicles(now).map(|(_, position, _)| position).collect();
    let mean = |of: fn(&Position) -> f64| places.iter().map(of).sum::<f64>() / places.len() as f64;
    Position::from_m(mean(|place| place.x_m()), mean(|place| place.y_m()))
}

/// Flies a pair for two minutes and gives it back, and the first UAV's r_d and number of vehicles measured, by instant.
fn flown(lose_percent: u32) -> (Vec<Companion>, Vec<(f64, usize)>) {
    let (mut pair, mut seen) = (team(2), Vec::new());
    // Where nobody is heard, each has to be told of the vehicles.
    pair[1].searches = lose_percent == 100;
    let pair = fly(
        pair,
        120,
        (lose_percent, 0),
        |_, _| true,
        |_, pair| {
            let picture = pair[0].agent.picture();
            let held = picture.known().iter().filter(|known| known.track.status == TrackStatus::Held).count();
            seen.push((picture.group_of(UavId(0)).map_or(0.0, |group| group.standoff.distance_m), held));
        },
    );
    (pair, seen)
}

const END: Time = Time::from_us(120_000_000);

#[test]
fn the_pair_holds_its_orbit_at_right_angles_though_messages_are_lost() {
    for lose_percent in [0, 20, 50] {
        let (team, seen) = flown(lose_percent);
        let r_d_m = seen.last().unwrap().0;
        for uav in &team {
            assert!(error_m(uav, END, r_d_m) < 10.0, "{lose_percent}: {} m", error_m(uav, END, r_d_m));
        }
        let directions: Vec<_> = team.iter().map(|uav| (uav.own.position - centroid(END)).direction()).collect();
        let apart_deg = (directions[1] - directions[0]).abs_rad().to_degrees();
        assert!((apart_deg - 90.0).abs() < 10.0, "{lose_percent}: {apart_deg}");
        assert!(seen[4..].iter().all(|(_, held)| *held == 3), "{lose_percent}: {seen:?}");
    }
}

/// A UAV that hears nobody is a team of one.
#[test]
fn without_a_radio_each_holds_the_orbit_by_itself() {
    let (team, seen) = flown(100);
    for uav in &team {
        let error_m = error_m(uav, END, seen.last().unwrap().0);
        assert!(error_m < 10.0, "{error_m} m");
    }
}

/// What is heard is what was said, to the bit, and takes as many bytes as the library tells; what was cut short, or goes on,
/// is no message, and no bytes are trouble.
#[test]
fn a_message_comes_through_as_it_was_said() {
    let own = UavState {
        position: Position::from_m(0.1, -2e5),
        heading: Angle::from_rad(-3.0),
        speed_m_s: 41.5,
        turn_rate_rad_s: -0.1,
        vertical: None,
    };
    let plain = Report::of(UavId(7), Time::from_us(-5), own);
    let stamp = Stamp { time: Time::from_us(9), digest: u64::MAX - 1 };
    let measurement = RangeBearing { range_m: 512.25, bearing: Angle::from_rad(1.5) };
    let held = |speaker, from| Held { speaker, from, to: from + 65_535 };
    let knowledge = |asks| Knowledge {
        since: Time::from_us(1),
        committed: Time::from_us(2),
        stamp,
        listed_after: Time::from_us(3),
        disturbed: Time::from_us(i64::MIN),
        held: vec![held(Speaker::Uav(UavId(4)), 8), held(Speaker::Searcher(65_535), -1)],
        asks,
    };
    let ask = |stamp| Some(Ask { of: UavId(65_535), stamp, next: 3, after: 1 << 63 });
    let said = |asks| Report {
        epoch: 3,
        sequence: u32::MAX,
        boresight: Some(Angle::from_rad(0.25)),
        detections: vec![Detection { label: TargetLabel(u32::MAX), measurement }; 3],
        duty: Some(GroupId(u64::MAX)),
        leaves: true,
        knowledge: Some(Box::new(knowledge(asks))),
        ..plain.clone()
    };
    let cue = Cue {
        searcher: 9,
        said: Time::from_us(i64::MIN),
        number: 65_535,
        label: TargetLabel(2),
        time: Time::from_us(i64::MAX),
        position: Position::from_m(1.0, 2.0),
        velocity: Velocity::from_m_s(3.0, 4.0),
        position_sd_m: 5.0,
        velocity_sd_m_s: 6.0,
    };
    let part = SnapshotPart { uav: UavId(1), since: Time::from_us(4), stamp, index: 5, count: 6, bytes: vec![7; 512] };
    let traffic = Traffic { aircraft: u32::MAX, time: Time::from_us(-7), state: plain.state };
    let vertical = Some(Vertical { altitude_m: 8.0, climb_rate_m_s: -9.0 });
    let higher = Traffic { state: UavState { vertical, ..traffic.state }, ..traffic };
    let reports = [plain.clone(), said(None), said(ask(None)), said(ask(Some(stamp)))].map(Message::Report);
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

/// The silence of one UAV holds up what can be committed. Another one that starts anew 20 s later is told all the same, and
/// soon agrees with the others, though a fifth is lost.
#[test]
fn a_uav_that_starts_anew_is_told_though_another_one_is_silent() {
    let (silent_from, down) = (16, 56..59);
    let is_on = |uav: usize, tick: i64| !(uav == 2 && tick >= silent_from || uav == 0 && down.contains(&tick));
    let mut took_s: Vec<f64> = Vec::new();
    for seed in 0..20 {
        let mut differ = 0;
        fly(team(4), 50, (20, 1000 * seed), is_on, |tick, team| {
            if tick + 1 == down.end {
                team[0] = Companion::new(0, 1, team[0].own).unwrap();
            }
            let crews = team[0].crews();
            let differs = [1, 3].iter().any(|uav: &usize| team[*uav].crews() != crews);
            if tick >= down.end && (crews.is_empty() || differs) {
                differ = tick + 1 - down.end;
            }
        });
        took_s.push(0.5 * differ as f64);
    }
    took_s.sort_by(f64::total_cmp);
    assert!(took_s[10] <= 3.0 && took_s[19] <= 6.0, "{took_s:?}");
}

fn any_time() -> impl Strategy<Value = Time> {
    any::<i64>().prop_map(Time::from_us)
}

fn any_stamp() -> impl Strategy<Value = Stamp> {
    (any_time(), any::<u64>()).prop_map(|(time, digest)| Stamp { time, digest })
}

fn any_uav() -> impl Strategy<Value = UavId> {
    any::<u16>().prop_map(|id| UavId(id.into()))
}

fn any_angle() -> impl Strategy<Value = Angle> {
    (-3.1..3.1).prop_map(Angle::from_rad)
}

fn any_knowledge() -> impl Strategy<Value = Knowledge> {
    let held = (any::<u16>(), any::<bool>(), any::<i32>(), any::<u16>()).prop_map(|(id, is_uav, from, more)| {
        let speaker = if is_uav { Speaker::Uav(UavId(id.into())) } else { Speaker::Searcher(id.into()) };
        let from = i64::from(from) << 16;
        Held { speaker, from, to: from + i64::from(more) }
    });
    let ask = (any_uav(), proptest::option::of(any_stamp()), any::<u16>(), any::<u64>());
    let ask = ask.prop_map(|(of, stamp, next, after)| Ask { of, stamp, next, after });
    let (times, held) = ([(); 4].map(|()| any_time()), proptest::collection::vec(held, 0..40));
    (times, any_stamp(), held, proptest::option::of(ask)).prop_map(|(times, stamp, held, asks)| {
        let [since, committed, listed_after, disturbed] = times;
        Knowledge { since, committed, stamp, listed_after, held, disturbed, asks }
    })
}

fn any_message() -> impl Strategy<Value = Message> {
    let detection = (any::<u32>(), -1e4..1e4, any_angle()).prop_map(|(label, range_m, bearing)| Detection {
        label: TargetLabel(label),
        measurement: RangeBearing { range_m, bearing },
    });
    let who = (any_uav(), any::<u32>(), any::<u32>(), any_time(), any::<bool>(), proptest::option::of(any::<u64>()));
    let what = (
        [-1e6..1e6, -1e6..1e6, 0.0..90.0, -0.5..0.5],
        any_angle(),
        proptest::option::of(any_angle()),
        proptest::collection::vec(detection, 0..20),
        proptest::option::of(any_knowledge()),
    );
    let report = (who, what).prop_map(|((uav, epoch, sequence, time, leaves, duty), what)| {
        let ([x_m, y_m, speed_m_s, turn_rate_rad_s], heading, boresight, detections, knowledge) = what;
        let state =
            UavState { position: Position::from_m(x_m, y_m), heading, speed_m_s, turn_rate_rad_s, vertical: None };
        let (duty, knowledge) = (duty.map(GroupId), knowledge.map(Box::new));
        Message::Report(Report { uav, epoch, sequence, time, state, boresight, detections, duty, leaves, knowledge })
    });
    let cue = (any::<[u16; 2]>(), any::<u32>(), any_time(), any_time(), [(); 6].map(|()| -1e6..1e6));
    let cue = cue.prop_map(|([searcher, number], label, said, time, [x_m, y_m, vx_m_s, vy_m_s, p_m, v_m_s])| {
        let (searcher, label, position) = (searcher.into(), TargetLabel(label), Position::from_m(x_m, y_m));
        let (velocity, position_sd_m, velocity_sd_m_s) = (Velocity::from_m_s(vx_m_s, vy_m_s), p_m, v_m_s);
        Message::Cue(Cue { searcher, said, number, label, time, position, velocity, position_sd_m, velocity_sd_m_s })
    });
    let bytes = proptest::collection::vec(any::<u8>(), 0..=SnapshotPart::BYTES_MAX);
    let part = (any_uav(), any_time(), any_stamp(), any::<[u16; 2]>(), bytes);
    let part = part.prop_map(|(uav, since, stamp, [index, count], bytes)| {
        Message::Snapshot(SnapshotPart { uav, since, stamp, index, count, bytes })
    });
    let numbers = [-1e6..1e6, -1e6..1e6, 0.0..90.0, -0.5..0.5, 0.0..1e4, -9.0..9.0];
    let traffic = (any::<u32>(), any_time(), any_angle(), numbers, any::<bool>());
    let traffic = traffic.prop_map(|(aircraft, time, heading, numbers, has_vertical)| {
        let [x_m, y_m, speed_m_s, turn_rate_rad_s, altitude_m, climb_rate_m_s] = numbers;
        let vertical = has_vertical.then_some(Vertical { altitude_m, climb_rate_m_s });
        let state = UavState { position: Position::from_m(x_m, y_m), heading, speed_m_s, turn_rate_rad_s, vertical };
        Message::Traffic(Traffic { aircraft, time, state })
    });
    prop_oneof![report, cue, part, traffic]
}

proptest! {
    #[test]
    fn whatever_is_said_comes_through_as_it_was_said(message in any_message()) {
        let bytes = wire::encode(&message);
        prop_assert_eq!(bytes.len(), message.size_bytes());
        prop_assert_eq!(wire::decode(&bytes), Some(message));
    }

    /// Damage is found: one byte that is another is no message, wherever it is.
    #[test]
    fn what_was_damaged_is_no_message(message in any_message(), place in any::<prop::sample::Index>(), flip in 1u8..) {
        let mut bytes = wire::encode(&message);
        bytes[place.index(message.size_bytes())] ^= flip;
        prop_assert_eq!(wire::decode(&bytes), None);
    }

    /// With a true checksum, too: it is read as far as it makes sense, an agent takes it, and more than came is never made
    /// room for.
    #[test]
    fn whatever_comes_does_no_harm(message in any_message(), changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..8), cut in any::<prop::sample::Index>()) {
        let mut bytes = wire::encode(&message);
        bytes.truncate(bytes.len() - 4);
        if changes.len() % 2 == 1 {
            bytes.truncate(cut.index(bytes.len() + 1));
        }
        let has_more = bytes.len() > 3;
        for (place, byte) in changes.iter().take_while(|_| has_more) {
            // What it is stays: or most would be no message.
            let place = 3 + place.index(bytes.len() - 3);
            bytes[place] = *byte;
        }
        bytes.extend(crc32fast::hash(&bytes).to_le_bytes());
        let mut uav = Companion::new(0, 0, start(0, 2)).unwrap();
        let (observation, _) = uav.observe(Time::START);
        uav.hear(&observation, &bytes);
        let is_message = wire::decode(&bytes).is_some_and(|read| wire::encode(&read).len() == bytes.len());
        prop_assert_eq!(uav.damaged, u32::from(!is_message));
        uav.decide(&observation);
        prop_assert!(uav.command.turn_rate_rad_s.abs() <= 0.3 && (25.0..=55.0).contains(&uav.command.speed_m_s));
    }

    #[test]
    fn bytes_that_nobody_made_are_no_message(bytes in prop::collection::vec(any::<u8>(), 0..400)) {
        prop_assert_eq!(wire::decode(&bytes), None);
    }
}

#[test]
fn what_is_typed_wrong_is_said() {
    let parse = |text: &str| Arguments::parse(text.split(' ').map(str::to_owned));
    let given = "--uav 1 --team 3 --port 4000 --seconds 5 --lose 20 --start-us 7 --epoch 2 --at 1,-2,90";
    let Arguments { uav, team, port, seconds, lose_percent, start_us, epoch, at } = parse(given).unwrap();
    assert_eq!((uav, team, port, seconds, lose_percent, start_us, epoch), (1, 3, 4000, 5, 20, Some(7), 2));
    assert_eq!(at.map(|own| (own.position, own.heading)), Some((Position::from_m(1.0, -2.0), Angle::from_deg(90.0))));
    for (wrong, named) in [
        ("--uav 3 --team 3 --port 4000 --seconds 5", "--uav has to be below --team"),
        ("--uav 0 --team 1 --seconds 5", "--port"),
        ("--lose 101", "--lose 101: allowed is a whole number from 0 to 100"),
        ("--at 1,2", "--at 1,2: allowed is three numbers"),
        ("--at 1,2,nan", "allowed"),
        ("--start-us -1", "--start-us -1"),
        ("--seconds", "--seconds: a value is missing"),
        ("--speed 5", "--speed: there is no such option"),
    ] {
        let error = parse(wrong).unwrap_err();
        assert!(error.contains(named) && error.contains("usage"), "{wrong}: {error}");
    }
}

/// What each of so many UAVs says, kbit/s: the mean, and the most of any UAV in any second. They circle about ten vehicles,
/// measure all of them twice a second, and lose so much of what they hear, for two minutes.
fn kbit_s(team: u32, lose_percent: u32) -> [f64; 2] {
    let params = TeamParams { radio: Radio::Fallible, ..TeamParams::table_1() };
    let mut losses: Vec<_> = (0..team).map(|id| Loss::new(lose_percent, id)).collect();
    let mut agents: Vec<_> = (0..team).map(|id| Agent::new(UavId(id), params).unwrap()).collect();
    let mut by_second = vec![vec![0; 120]; team as usize];
    for tick in 0..240 {
        let now = Time::from_us(tick * PERIOD.us());
        let place = |id: u32, speed_m_s: f64| Position::from_m(speed_m_s * now.s(), 40.0 * f64::from(id));
        let cues: Vec<_> = (0..10)
            .filter(|_| tick == 0)
            .map(|id| cue(now, (TargetLabel(id), place(id, 5.0), Velocity::from_m_s(5.0, 0.0))))
            .collect();
        let mut said: Vec<(Observation, Vec<Message>)> = Vec::new();
        for (id, agent) in (0..).zip(&mut agents) {
            let heading = Angle::from_rad(0.1 * now.s() + f64::from(id));
            let position = place(5, 5.0) + Displacement::from_polar(400.0, Angle::from_rad(heading.rad() - FRAC_PI_2));
            let own = UavState { position, heading, speed_m_s: 40.0, turn_rate_rad_s: 0.1, vertical: None };
            let measure = |id| standoff::sensor::measure(position, place(id, 5.0));
            let detections: Vec<_> =
                (0..10).map(|id| Detection { label: TargetLabel(id), measurement: measure(id) }).collect();
            let scan = Scan { boresight: Some(Angle::from_rad(heading.rad() + FRAC_PI_2)), detections: &detections };
            let observation = agent.observe(now, &own, Some(scan));
            let messages = agent.outbox(&observation).to_vec();
            by_second[id as usize][tick as usize / 2] +=
                messages.iter().map(|message| wire::encode(message).len()).sum::<usize>();
            said.push((observation, messages));
        }
        for (index, agent) in agents.iter_mut().enumerate() {
            let observation = &said[index].0;
            let others =
                said.iter().enumerate().filter(|(other, _)| *other != index).flat_map(|(_, (_, messages))| messages);
            let heard = others.filter(|_| !losses[index].loses());
            cues.iter().chain(heard).for_each(|message| agent.hear(observation, message));
            agent.decide(observation);
        }
    }
    let seconds = || by_second.iter().flatten().map(|bytes| *bytes as f64 * 8e-3);
    [seconds().sum::<f64>() / seconds().count() as f64, seconds().fold(0.0, f64::max)]
}

/// What is said again for others included.
#[test]
fn ten_targets_take_less_than_20_kbit_s_though_a_fifth_is_lost() {
    for (team, lose_percent, mean_max) in [(4, 0, 7.0), (4, 20, 20.0), (8, 20, 20.0)] {
        let [mean, most] = kbit_s(team, lose_percent);
        println!("{team} UAVs, {lose_percent} % lost: {mean:.1}, at most {most:.1}");
        assert!(mean < mean_max, "{team} UAVs, {lose_percent} %: {mean:.1} kbit/s");
    }
}

/// A companion computer may run it on whatever thread it likes.
#[test]
fn an_agent_can_move_to_another_thread() {
    let agent = Agent::new(UavId(3), TeamParams::table_1()).unwrap();
    assert_eq!(std::thread::spawn(move || agent.id()).join().unwrap(), UavId(3));
}

/// Where nothing is lost, what a process prints is a function of the mission's time.
#[test]
fn the_book_quotes_what_it_prints() {
    let page = include_str!("../../../docs/embedding.md");
    let quoted = page.split("--uav 0 --team 2 --port 47000 --seconds 120 --start-us $start\n").nth(1).unwrap();
    let mut printed = Vec::new();
    fly(team(2), 118, (0, 0), |_, _| true, |_, pair| printed.push(pair[0].line()));
    let quoted: Vec<_> = quoted.split("```").next().unwrap().lines().filter(|line| *line != "...").collect();
    assert!(quoted.len() > 3);
    for line in quoted {
        // What a picture's digest is, is told by no page.
        let line = line.strip_suffix("...").unwrap_or(line);
        assert!(printed.iter().any(|printed| printed.starts_with(line)), "{line}\n{printed:#?}");
    }
}
