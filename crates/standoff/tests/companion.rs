//! The example of docs/embedding.md: it does what the page says.

#![expect(clippy::unwrap_used, reason = "helpers of tests")]

#[expect(dead_code, reason = "it has a main of its own")]
#[path = "../examples/companion/main.rs"]
mod companion;

use companion::arguments::Arguments;
use companion::udp::Loss;
use companion::{Companion, PERIOD, start, vehicles, wire};
use proptest::prelude::*;
use standoff::*;

/// Flies a team in one process, in which all clocks are the same, each of whose radios loses so much of what comes; `tell`
/// is told the first UAV's line of every second.
fn fly(team: u32, seconds: u32, lose_percent: u32, mut tell: impl FnMut(&Companion, String)) -> Vec<Companion> {
    let mut losses: Vec<_> = (0..team).map(|id| Loss::new(lose_percent, id)).collect();
    let mut team: Vec<_> = (0..team).map(|id| Companion::new(id, 0, start(id, team)).unwrap()).collect();
    // Where nobody is heard, each has to be told of the vehicles.
    team.iter_mut().for_each(|uav| uav.searches |= lose_percent == 100);
    for tick in 0..=2 * i64::from(seconds) {
        let now = Time::from_us(tick * PERIOD.us());
        let said: Vec<_> = team.iter_mut().map(|uav| uav.observe(now)).collect();
        for (index, uav) in team.iter_mut().enumerate() {
            let heard = said.iter().enumerate().filter(|(other, _)| *other != index).flat_map(|(_, (_, said))| said);
            heard.filter(|_| !losses[index].loses()).for_each(|bytes| uav.hear(&said[index].0, bytes));
            let diagnostics = uav.decide(&said[index].0);
            if tick % 2 == 0 && index == 0 {
                tell(uav, uav.line(&diagnostics));
            }
        }
    }
    team
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

/// Flies a pair for two minutes and gives it back, and the first UAV's r_d and number of vehicles measured, by second.
fn flown(lose_percent: u32) -> (Vec<Companion>, Vec<(f64, usize)>) {
    let mut seen = Vec::new();
    let team = fly(2, 120, lose_percent, |uav, _| {
        let picture = uav.agent.picture();
        let held = picture.known().iter().filter(|known| known.track.status == TrackStatus::Held).count();
        seen.push((picture.group_of(UavId(0)).map_or(0.0, |group| group.standoff.distance_m), held));
    });
    (team, seen)
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
        assert!(seen[2..].iter().all(|(_, held)| *held == 3), "{lose_percent}: {seen:?}");
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
    };
    let plain = Report::of(UavId(7), Time::from_us(-5), own);
    let stamp = Stamp { time: Time::from_us(9), digest: u64::MAX - 1 };
    let measurement = RangeBearing { range_m: 512.25, bearing: Angle::from_rad(1.5) };
    let held = |speaker, from| Held { speaker, from, to: from + 70_000 };
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
    let reports = [plain.clone(), said(None), said(ask(None)), said(ask(Some(stamp)))].map(Message::Report);
    for message in reports.into_iter().chain([Message::Cue(cue), Message::Snapshot(part)]) {
        let mut bytes = wire::encode(&message);
        assert_eq!(wire::decode(&bytes), Some(message.clone()));
        assert_eq!(bytes.len(), message.size_bytes(), "{message:?}");
        assert!((0..bytes.len()).all(|length| wire::decode(&bytes[..length]).is_none()));
        bytes.push(0);
        assert_eq!(wire::decode(&bytes), None);
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
    fly(2, 118, 0, |_, line| printed.push(line));
    let quoted: Vec<_> = quoted.split("```").next().unwrap().lines().filter(|line| *line != "...").collect();
    assert!(quoted.len() > 3);
    for line in quoted {
        assert!(printed.contains(&line.to_owned()), "{line}\n{printed:#?}");
    }
}
