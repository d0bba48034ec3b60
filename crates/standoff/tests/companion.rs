//! The example of docs/embedding.md: it does what the page says.

#![expect(clippy::unwrap_used, reason = "helpers of tests")]

#[expect(dead_code, reason = "it has a main of its own")]
#[path = "../examples/companion/main.rs"]
mod companion;

use companion::{Companion, fly, line, vehicles, wire};
use standoff::*;

/// How far a UAV is, at the end, from an orbit of `r_d_m` about the true centroid, m.
fn error_m(uav: &Companion, end: Time, r_d_m: f64) -> f64 {
    (uav.own.position.distance_m(centroid(end)) - r_d_m).abs()
}

fn centroid(now: Time) -> Position {
    let places: Vec<_> = vehicles(now).map(|(_, position, _)| position).collect();
    let mean = |of: fn(&Position) -> f64| places.iter().map(of).sum::<f64>() / places.len() as f64;
    Position::from_m(mean(|place| place.x_m()), mean(|place| place.y_m()))
}

/// Flies for so long and gives back the team, and the first UAV's r_d and number of vehicles measured, second by second.
fn flown(seconds: u32, lose_every: u32) -> ([Companion; 2], Vec<(f64, usize)>) {
    let mut seen = Vec::new();
    let team = fly(seconds, lose_every, |_, _, picture| {
        let held = picture.known().iter().filter(|known| known.track.status == TrackStatus::Held).count();
        seen.push((picture.group_of(UavId(0)).map_or(0.0, |group| group.standoff.distance_m), held));
    });
    (team.unwrap(), seen)
}

#[test]
fn the_pair_holds_its_orbit_at_right_angles_though_messages_are_lost() {
    for lose_every in [0, 5, 2] {
        let (team, seen) = flown(120, lose_every);
        // The states are those of the instant after the last one told.
        let end = Time::from_us(120_500_000);
        let r_d_m = seen.last().unwrap().0;
        for uav in &team {
            assert!(error_m(uav, end, r_d_m) < 10.0, "{lose_every}: {} m", error_m(uav, end, r_d_m));
        }
        let [first, second] = team.map(|uav| (uav.own.position - centroid(end)).direction());
        assert!(((second - first).abs_rad().to_degrees() - 90.0).abs() < 10.0, "{lose_every}: {first:?} {second:?}");
        assert!(seen[1..].iter().all(|(_, held)| *held == 3), "{lose_every}: {seen:?}");
    }
}

/// A UAV that hears nobody is a team of one.
#[test]
fn without_a_radio_each_holds_the_orbit_by_itself() {
    let (team, seen) = flown(120, 1);
    for uav in &team {
        let error_m = error_m(uav, Time::from_us(120_500_000), seen.last().unwrap().0);
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

#[test]
fn the_book_quotes_what_it_prints() {
    let page = include_str!("../../../docs/embedding.md");
    let command = "$ cargo run -q -p standoff --example companion -- 120 5\n";
    let quoted = page.split(command).nth(1).unwrap().split("```").next().unwrap();
    let mut printed = Vec::new();
    fly(120, 5, |now, diagnostics, picture| printed.push(line(now, diagnostics, picture))).unwrap();
    let quoted: Vec<_> = quoted.lines().filter(|line| *line != "...").collect();
    assert!(quoted.len() > 3);
    for line in quoted {
        assert!(printed.contains(&line.to_owned()), "{line}\n{printed:#?}");
    }
}
