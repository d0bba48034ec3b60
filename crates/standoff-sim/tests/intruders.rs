//! Aircraft that are not of the team: what a scenario says of them, how they fly, and what UAVs do about them.

#![expect(clippy::unwrap_used, reason = "a failed unwrap fails the test")]

use std::path::Path;

use standoff::Position;
use standoff_sim::record::{Frame, Manifest, Record, Writer};
use standoff_sim::run::Mission;
use standoff_sim::scenario::{Edits, Scenario};
use standoff_sim::world::World;

fn scenario(set: &[&str]) -> Scenario {
    let set = set.iter().map(|key| (*key).to_owned()).collect();
    Scenario::load("tour/04-two-groups", &Edits { set, ..Edits::default() }, 3).unwrap()
}

fn frames(scenario: &Scenario) -> Vec<Frame> {
    let mut mission = Mission::new(scenario).unwrap();
    std::iter::from_fn(|| mission.frame().cloned()).collect()
}

fn apart_m((x_m, y_m): (f64, f64), (other_x_m, other_y_m): (f64, f64)) -> f64 {
    Position::from_m(x_m, y_m).distance_m(Position::from_m(other_x_m, other_y_m))
}

/// How near the intruder comes to any UAV, m.
fn closest_m(frames: &[Frame]) -> f64 {
    let apart = frames.iter().flat_map(|frame| {
        let intruder = frame.intruders[0];
        frame.uavs.iter().map(move |uav| apart_m((uav.x_m, uav.y_m), (intruder.x_m, intruder.y_m)))
    });
    apart.fold(f64::INFINITY, f64::min)
}

const KEEPS_APART: &str = "separation={}";

/// One that pursues catches a UAV that does nothing about it, and does not where UAVs are kept apart: it is told who is avoided.
#[test]
fn who_pursues_comes_near_unless_uavs_keep_away() {
    let one = "groups.altitudes=\"one\"";
    let pursues = "intruders=[{pursues=1, direction_deg=20}]";
    let caught = frames(&scenario(&[pursues]));
    assert!(closest_m(&caught) < 45.0, "{}", closest_m(&caught));
    let kept = frames(&scenario(&[pursues, KEEPS_APART, one]));
    assert!(closest_m(&kept) >= 50.0, "{}", closest_m(&kept));
    let (first, start) = (kept[0].uavs[1], kept[0].intruders[0]);
    assert!((apart_m((first.x_m, first.y_m), (start.x_m, start.y_m)) - 1000.0).abs() < 1e-6);
    assert_eq!(start.altitude_m, first.flown_altitude_m);
    let row = kept.iter().flat_map(|frame| &frame.uavs).find(|uav| uav.avoids_intruder.is_some()).unwrap();
    assert_eq!((row.avoids_intruder, row.avoids), (Some(0), None));
    let event = kept.iter().flat_map(|frame| &frame.events).find(|event| event.intruder.is_some()).unwrap();
    assert_eq!((event.kind.as_str(), event.uavs.len(), event.intruder), ("avoidance", 1, Some(0)));
    assert!(event.why().ends_with("m of intruder 0"), "{}", event.why());
}

/// Without `pursues` it flies on: straight, or in a circle of its speed over its turn rate.
#[test]
fn who_pursues_nobody_flies_on() {
    let all = "intruders=[{x_m=0, y_m=5000}, {x_m=0, y_m=9000, heading_deg=90, turn_rate_deg_s=-9, speed_m_s=30}]";
    let frames = frames(&scenario(&[all, "duration_s=40"]));
    let (first, last) = (&frames[0].intruders, &frames.last().unwrap().intruders);
    assert!((last[0].x_m - 1600.0).abs() < 1e-6 && (last[0].y_m - 5000.0).abs() < 1e-6, "{last:?}");
    // Once round in 40 s, but for the lag at the beginning: 30 m/s of a third of a second.
    let off_m = apart_m((last[1].x_m, last[1].y_m), (first[1].x_m, first[1].y_m));
    assert!(off_m < 15.0, "{off_m}");
    let right_m = frames.iter().map(|frame| frame.intruders[1].x_m).fold(0.0, f64::max);
    assert!((right_m - 2.0 * 30.0 / 9f64.to_radians()).abs() < 5.0, "{right_m}");
}

/// While it tells nothing it is kept away from by what it told last, and where it is comes out of the record alone.
#[test]
fn who_is_silent_for_a_while_is_dead_reckoned() {
    let silent = "intruders=[{pursues=0, direction_deg=90, silent=[{from_s=10, until_s=15}, {from_s=20, until_s=25}]}]";
    let frames = frames(&scenario(&[silent, KEEPS_APART, "groups.altitudes=\"one\""]));
    let quiet_s: Vec<f64> =
        frames.iter().filter(|frame| !frame.intruders[0].told).map(|frame| frame.time_us as f64 / 1e6).collect();
    assert_eq!((quiet_s.len(), quiet_s[0], quiet_s[9], quiet_s[19]), (20, 10.0, 14.5, 24.5));
    assert!(closest_m(&frames) >= 50.0, "{}", closest_m(&frames));
}

/// With a fleet, with an agent each, and told by a radio that loses nothing: the same flight.
#[test]
fn all_minds_keep_away_alike() {
    let set = ["intruders=[{pursues=2, direction_deg=-60}]", KEEPS_APART, "groups.altitudes=\"one\""];
    let one = frames(&scenario(&set));
    let each = frames(&scenario(&[&set[..], &["team.minds=\"each\""]].concat()));
    for (one, each) in one.iter().zip(&each) {
        assert_eq!((&one.uavs, &one.intruders), (&each.uavs, &each.intruders));
    }
}

/// The record holds them, in a table that is there only where they are; the scenario in it gives the same flight.
#[test]
fn the_record_holds_them_where_there_are_any() {
    let home = tempfile::tempdir().unwrap();
    for (name, set) in [("with", &["intruders=[{pursues=0}]"][..]), ("without", &[])] {
        let (dir, scenario) = (home.path().join(name), scenario(set));
        let (duration_s, period_s) = (scenario.settings.duration.s(), scenario.settings.period.s());
        let manifest = Manifest::new(&scenario.name, scenario.seed, duration_s, period_s);
        let names = World::names(&scenario);
        let mut writer = Writer::create(&dir, &manifest, &scenario.resolved().unwrap(), &names).unwrap();
        let flown = frames(&scenario);
        for (index, frame) in flown.iter().enumerate() {
            writer.frame(frame).unwrap();
            if index == 100 {
                writer.checkpoint().unwrap();
                // As far as that goes it can be read.
                let partial = Path::new(&dir).with_extension("partial");
                let read = Record::open(&partial).unwrap().frames().unwrap();
                let read: Vec<Frame> = read.collect::<Result<_, _>>().unwrap();
                assert_eq!(read.last().unwrap().intruders, frame.intruders);
                assert_eq!(read.len(), 101);
            }
        }
        writer.finish().unwrap();
        assert_eq!(dir.join("intruders.parquet").exists(), !set.is_empty());
        let record = Record::open(&dir).unwrap();
        assert_eq!(record.has_intruders(), !set.is_empty());
        let read: Vec<Frame> = record.frames().unwrap().collect::<Result<_, _>>().unwrap();
        assert!(read == flown);
        let folder = Path::new("");
        let again = standoff_sim::scenario::Template::of_toml(name, record.scenario_toml(), &Edits::default(), folder);
        assert_eq!(again.unwrap().draw(3).unwrap().intruders, scenario.intruders);
    }
}

/// What is wrong is told where it was typed, with what to do.
#[test]
fn what_makes_no_sense_is_told_at_its_place() {
    let told = |intruder: &str| {
        let edits = Edits { set: vec![format!("intruders=[{intruder}]")], ..Edits::default() };
        Scenario::load("tour/04-two-groups", &edits, 1).unwrap_err().to_string()
    };
    for (intruder, expected) in [
        ("{}", "intruders.0: starts nowhere; give `x_m` and `y_m`, or the UAV that it `pursues`"),
        ("{x_m=1}", "intruders.0.x_m = 1: half a place to start from; give `y_m`, too"),
        ("{pursues=0, y_m=1}", "intruders.0.y_m = 1: half a place to start from; give `x_m`, too"),
        ("{distance_m=5}", "`distance_m` and `direction_deg` are from the UAV that it `pursues`; name it"),
        ("{x_m=1, y_m=2, distance_m=5, pursues=0}", "a place seen from a UAV; keep one"),
        ("{pursues=4}", "intruders.0.pursues = 4: must be at least 0 and at most 3 (one of the UAVs, counted from 0)"),
        ("{pursues=0, turn_rate_deg_s=3}", "who `pursues` a UAV turns at it; keep one"),
        ("{pursues=0, speed_m_s=0}", "intruders.0.speed_m_s = 0: must be above 0"),
        ("{pursues=0, silent=[{from_s=3, until_s=2}]}", "intruders.0.silent.0.until_s = 2: must be at least 3"),
        ("{pursue=0}", "there is no such key; did you mean `pursues`?"),
    ] {
        let message = told(intruder);
        assert!(message.contains(expected), "{intruder}: {message}");
    }
}
