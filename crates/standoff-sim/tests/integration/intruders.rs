//! Intruders, aircraft outside the team: their scenario keys, their motion, and collision avoidance with them.

use std::path::Path;

use crate::common::{frames, load, overrides};
use standoff::Position;
use standoff_record::{Frame, Record};
use standoff_sim::scenario::{Overrides, Scenario, ScenarioTemplate};

fn scenario(set: &[&str]) -> Scenario {
    load("tour/04-two-groups", set, 3)
}

fn apart_m((x_m, y_m): (f64, f64), (other_x_m, other_y_m): (f64, f64)) -> f64 {
    Position::from_m(x_m, y_m).distance_m(Position::from_m(other_x_m, other_y_m))
}

/// Smallest distance of the intruder to any UAV, m.
fn closest_m(frames: &[Frame]) -> f64 {
    let apart = frames.iter().flat_map(|frame| {
        let intruder = frame.intruders[0];
        frame.uavs.iter().map(move |uav| apart_m((uav.x_m, uav.y_m), (intruder.x_m, intruder.y_m)))
    });
    apart.fold(f64::INFINITY, f64::min)
}

const KEEPS_APART: &str = "separation={}";

/// A pursuing intruder reaches a UAV without collision avoidance, but not one with it. The record shows which aircraft
/// is avoided.
#[test]
fn pursuing_intruder_comes_close_only_without_collision_avoidance() {
    let one = "groups.altitude_policy=\"common\"";
    let pursues = "intruders=[{pursued_uav=1, bearing_deg=20}]";
    let caught = frames(&scenario(&[pursues]));
    assert!(closest_m(&caught) < 45.0, "{}", closest_m(&caught));
    let avoiding = frames(&scenario(&[pursues, KEEPS_APART, one]));
    assert!(closest_m(&avoiding) >= 50.0, "{}", closest_m(&avoiding));
    let (first, start) = (avoiding[0].uavs[1], avoiding[0].intruders[0]);
    assert!((apart_m((first.x_m, first.y_m), (start.x_m, start.y_m)) - 1000.0).abs() < 1e-6);
    assert_eq!(start.altitude_m, first.altitude_m);
    let row = avoiding.iter().flat_map(|frame| &frame.uavs).find(|uav| uav.avoided_intruder.is_some()).unwrap();
    assert_eq!((row.avoided_intruder, row.avoided_uav), (Some(0), None));
    let event = avoiding.iter().flat_map(|frame| &frame.events).find(|event| event.intruder.is_some()).unwrap();
    assert_eq!((event.kind.as_str(), event.uavs.len(), event.intruder), ("avoidance", 1, Some(0)));
    assert!(event.reason_text().ends_with("m of intruder 0"), "{}", event.reason_text());
}

/// An intruder flies relative to the air: in a wind from the west, one heads north and drifts east.
#[test]
fn intruder_drifts_with_the_wind() {
    let north = "intruders=[{x_m=0, y_m=5000, heading_deg=90, speed_m_s=30}]";
    let frames = frames(&scenario(&[north, "wind={speed_m_s=10, from_deg=270}", "duration_s=40"]));
    let (first, last) = (frames[0].intruders[0], frames.last().unwrap().intruders[0]);
    assert!((last.x_m - 400.0).abs() < 1e-6 && (last.y_m - 6200.0).abs() < 1e-6, "{last:?}");
    assert!((first.speed_m_s - 1000f64.sqrt()).abs() < 1e-9 && (last.speed_m_s - 1000f64.sqrt()).abs() < 1e-9);
}

/// Without `pursued_uav`, it flies straight, or in a circle with radius speed / turn rate.
#[test]
fn intruder_without_target_flies_straight_or_in_a_circle() {
    let all = "intruders=[{x_m=0, y_m=5000}, {x_m=0, y_m=9000, heading_deg=90, turn_rate_deg_s=-9, speed_m_s=30}]";
    let frames = frames(&scenario(&[all, "duration_s=40"]));
    let (first, last) = (&frames[0].intruders, &frames.last().unwrap().intruders);
    assert!((last[0].x_m - 1600.0).abs() < 1e-6 && (last[0].y_m - 5000.0).abs() < 1e-6, "{last:?}");
    // One full circle in 40 s, except for the lag at the start: 30 m/s for a third of a second.
    let off_m = apart_m((last[1].x_m, last[1].y_m), (first[1].x_m, first[1].y_m));
    assert!(off_m < 15.0, "{off_m}");
    let right_m = frames.iter().map(|frame| frame.intruders[1].x_m).fold(0.0, f64::max);
    assert!((right_m - 2.0 * 30.0 / 9f64.to_radians()).abs() < 5.0, "{right_m}");
}

/// While its transponder is off, UAVs avoid its extrapolated last report. Its true position is only in the record.
#[test]
fn silent_intruder_is_dead_reckoned() {
    let silent = "intruders=[{pursued_uav=0, bearing_deg=90, transponder_off=[{from_s=10, until_s=15}, {from_s=20, until_s=25}]}]";
    let frames = frames(&scenario(&[silent, KEEPS_APART, "groups.altitude_policy=\"common\""]));
    let quiet_s: Vec<f64> = frames
        .iter()
        .filter(|frame| !frame.intruders[0].transponder_on)
        .map(|frame| frame.time_us as f64 / 1e6)
        .collect();
    assert_eq!((quiet_s.len(), quiet_s[0], quiet_s[9], quiet_s[19]), (20, 10.0, 14.5, 24.5));
    assert!(closest_m(&frames) >= 50.0, "{}", closest_m(&frames));
}

/// One agent for the team and one agent per UAV with a lossless radio fly identically.
#[test]
fn all_agents_avoid_intruders_identically() {
    let set = ["intruders=[{pursued_uav=2, bearing_deg=-60}]", KEEPS_APART, "groups.altitude_policy=\"common\""];
    let one = frames(&scenario(&set));
    let each = frames(&scenario(&[&set[..], &["team.agents=\"per-uav\""]].concat()));
    for (one, each) in one.iter().zip(&each) {
        assert_eq!((&one.uavs, &one.intruders), (&each.uavs, &each.intruders));
    }
}

/// The record contains intruders, in a table that exists only if there are any. The scenario in the record gives the
/// same flight.
#[test]
fn record_contains_intruders_if_there_are_any() {
    let home = tempfile::tempdir().unwrap();
    for (name, set) in [("with", &["intruders=[{pursued_uav=0}]"][..]), ("without", &[])] {
        let (dir, scenario) = (home.path().join(name), scenario(set));
        let mut writer = crate::common::writer(&dir, &scenario);
        let flown = frames(&scenario);
        for (index, frame) in flown.iter().enumerate() {
            writer.frame(frame).unwrap();
            if index == 100 {
                writer.checkpoint().unwrap();
                // The record is readable up to the checkpoint.
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
        let again = ScenarioTemplate::of_toml(name, record.scenario_toml(), &Overrides::default(), Path::new(""));
        assert_eq!(again.unwrap().draw(3).unwrap().intruders, scenario.intruders);
    }
}

/// Errors are reported at the position of the input, with a remedy.
#[test]
fn errors_in_intruders_are_reported_at_their_position() {
    let error_text = |intruder: &str| {
        let overrides = overrides(&[&format!("intruders=[{intruder}]")]);
        Scenario::load("tour/04-two-groups", &overrides, 1).unwrap_err().to_string()
    };
    for (intruder, expected) in [
        ("{}", "intruders.0: has no start; give `x_m` and `y_m`, or `pursued_uav`"),
        ("{x_m=1}", "intruders.0.x_m = 1: incomplete start; give `y_m` as well"),
        ("{pursued_uav=0, y_m=1}", "intruders.0.y_m = 1: incomplete start; give `x_m` as well"),
        ("{distance_m=5}", "`distance_m` and `bearing_deg` are relative to the pursued UAV; give `pursued_uav`"),
        ("{x_m=1, y_m=2, distance_m=5, pursued_uav=0}", "a start relative to a UAV; keep one"),
        (
            "{pursued_uav=4}",
            "intruders.0.pursued_uav = 4: must be at least 0 and at most 3 (one of the UAVs, counted from 0)",
        ),
        ("{pursued_uav=0, turn_rate_deg_s=3}", "an intruder with a `pursued_uav` turns towards that UAV; keep one"),
        ("{pursued_uav=0, speed_m_s=0}", "intruders.0.speed_m_s = 0: must be above 0"),
        (
            "{pursued_uav=0, transponder_off=[{from_s=3, until_s=2}]}",
            "intruders.0.transponder_off.0.until_s = 2: must be at least 3",
        ),
        ("{pursue=0}", "there is no such key; did you mean `pursued_uav`?"),
    ] {
        let message = error_text(intruder);
        assert!(message.contains(expected), "{intruder}: {message}");
    }
}
