//! The example of docs/embedding.md: it does what the page says.

#![expect(clippy::unwrap_used, reason = "helpers of tests")]

#[expect(dead_code, reason = "it has a main of its own")]
#[path = "../examples/companion/main.rs"]
mod companion;

use companion::{Companion, fly, line, vehicles};
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
