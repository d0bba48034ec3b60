//! Tests of the figures as a whole, on made-up runs: which there are, that odd runs draw, that bytes repeat.

use super::{Figure, FigureError, Setup, figures, line_of_sight, phase};
use standoff::Angle;
use standoff::math::{PI, TAU, atan2, cos, exp, sin};
use standoff_sim::record::{Frame, GroupRow, Place, TrackRow, TrackStatus, TruthRow, UavRow};
use std::convert::Infallible;
use std::f64::consts::FRAC_PI_2;

const ALL: [&str; 5] = ["trajectories", "standoff_distance", "phase", "line_of_sight", "speed_and_turn_rate"];

fn setup() -> Setup {
    Setup {
        title: "Two UAVs & one <group>".to_owned(),
        field_of_view_rad: 0.7,
        speed_min_m_s: 30.0,
        speed_max_m_s: 50.0,
        turn_rate_max_rad_s: 0.2,
        radius_min_m: 370.0,
        radius_max_m: 2000.0,
        separation_rad: FRAC_PI_2,
    }
}

/// UAVs spiral in on a circle about a group that moves north-east; some values are missing.
fn run(uavs: u32, targets: u32, instants: i32) -> Vec<Frame> {
    (0..instants).map(|i| instant(uavs, targets, i)).collect()
}

fn instant(uavs: u32, targets: u32, i: i32) -> Frame {
    let time = f64::from(i) * 0.5;
    let (x_m, y_m) = (100.0 + 6.0 * time, 50.0 + 40.0 * sin(time / 30.0));
    let standoff_unclamped_m = 400.0 + 60.0 * sin(time / 25.0);
    let standoff_distance_m = standoff_unclamped_m.clamp(370.0, 440.0);
    let spread_m = 60.0 + 0.2 * f64::from(targets);
    let missing = |id: u32| (i / 7 + 3 * id as i32) % 11 == 0;
    let mut frame = Frame { time_us: i64::from(i) * 500_000, ..Frame::default() };
    for target in 1..=targets {
        let (angle, reach) = (f64::from(target) * 2.4 + 0.01 * time, spread_m * f64::from(target % 7 + 1) / 7.0);
        let (x_m, y_m) = (x_m + reach * cos(angle), y_m + reach * sin(angle));
        frame.truth.push(TruthRow { target, x_m, y_m, vx_m_s: 0.0, vy_m_s: 0.0, ax_m_s2: None, ay_m_s2: None });
        let noise = |rate: f64| 4.0 * sin(time * rate + f64::from(target));
        let state = [x_m + noise(0.8), 0.0, 0.0, y_m + noise(1.0), 0.0, 0.0];
        let (status, group) = (TrackStatus::Held, (!missing(target)).then_some(1));
        let place = if group.is_some() { Place::Member } else { Place::Unassigned };
        frame.tracks.push(TrackRow { target, status, place, group, to_group: None, state, covariance: [0.0; 21] });
    }
    for uav in 1..=uavs {
        let settle = exp(-time / 20.0);
        let ripple = |rate: f64| sin(time * rate + f64::from(uav));
        let wanted = if uavs > 2 { TAU / f64::from(uavs) } else { FRAC_PI_2 };
        let phase = Angle::from_rad(f64::from(uav) * wanted * (1.0 - 0.4 * settle) + 0.1 * time).rad();
        let distance = standoff_distance_m + 300.0 * settle + 5.0 * ripple(0.4);
        frame.uavs.push(UavRow {
            uav,
            group: Some(1),
            x_m: x_m + distance * cos(phase),
            y_m: y_m + distance * sin(phase),
            heading_rad: phase + FRAC_PI_2,
            speed_m_s: 40.0 + 4.0 * ripple(0.6),
            turn_rate_rad_s: 0.1 + 0.03 * ripple(0.6),
            boresight_rad: (!missing(uav)).then_some(phase + PI + 0.03 * ripple(0.6)),
            speed_command_m_s: (40.0 + 5.0 * ripple(0.62)).min(44.5),
            turn_rate_command_rad_s: 0.1 + 0.05 * ripple(1.7),
            speed_limited: false,
            turn_rate_limited: false,
            centre_distance_m: (!missing(uav)).then_some(distance),
            phase_rad: (!missing(uav)).then_some(phase),
            steered_distance_m: None,
            desired_heading_rad: None,
            feedforward_rad_s: None,
            convergence_threshold_m2_s: None,
            centre_too_fast: false,
            altitude_m: None,
        });
    }
    frame.groups.push(GroupRow {
        group: 1,
        members: targets,
        x_m,
        y_m,
        vx_m_s: 6.0,
        vy_m_s: 0.0,
        spread_m,
        margin_m: 20.0,
        standoff_unclamped_m,
        standoff_distance_m,
        standoff_rate_m_s: 0.0,
        turn_limit_m: None,
        feasible: true,
        altitude_m: 0.0,
        separation_m: None,
    });
    frame
}

fn drawn(frames: Vec<Frame>, setup: &Setup) -> Vec<Figure> {
    figures(frames.into_iter().map(Ok::<_, Infallible>), setup).unwrap()
}

fn names(frames: Vec<Frame>) -> Vec<&'static str> {
    drawn(frames, &setup()).iter().map(|figure| figure.name).collect()
}

/// Every figure is finished and all its points are numbers (the library keeps them on the page).
fn assert_sound(figures: &[Figure]) {
    for Figure { name, svg } in figures {
        assert!(svg.starts_with("<svg width=\"900\"") && svg.trim_end().ends_with("</svg>"), "{name}");
        assert!(!svg.contains("NaN") && !svg.contains("inf") && svg.len() < 1_000_000, "{name}");
    }
}

#[test]
fn the_phase_figure_needs_two_uavs_on_one_orbit() {
    assert_eq!(names(run(2, 4, 60)), ALL);
    assert_eq!(names(run(3, 4, 60)), ALL);
    assert!(!names(run(1, 4, 60)).contains(&"phase"));
    let mut apart = run(2, 4, 60);
    apart.iter_mut().for_each(|frame| frame.uavs[1].group = Some(2));
    assert_eq!(names(apart).len(), 4);
}

#[test]
fn angles_are_taken_the_short_way_across_west() {
    let mut frame = instant(2, 0, 60);
    (frame.uavs[0].phase_rad, frame.uavs[1].phase_rad) = (Some(3.0), Some(-3.0));
    assert!((phase::separations(&frame)[0].1 - (TAU - 6.0)).abs() < 1e-9);
    let uav = UavRow { x_m: 10.0, y_m: 0.0, boresight_rad: Some(3.0), ..frame.uavs[0] };
    let off = line_of_sight::widest(&uav, &[(1, (0.0, 0.0)), (1, (0.0, -1.0)), (2, (20.0, 0.0))]).unwrap();
    assert!((off - (TAU - 6.0) / 2.0 - atan2(1.0, 10.0)).abs() < 1e-9);
}

#[test]
fn the_gaps_of_three_uavs_make_a_turn() {
    let mut frame = instant(3, 0, 60);
    frame.uavs.iter_mut().for_each(|row| row.phase_rad = Some(f64::from(row.uav) * 3.0));
    let gaps = phase::separations(&frame);
    assert!(gaps.len() == 3 && (gaps.iter().map(|gap| gap.1).sum::<f64>() - TAU).abs() < 1e-9);
    frame.uavs[2].phase_rad = None;
    assert!(phase::separations(&frame).is_empty());
}

#[test]
fn the_same_run_gives_the_same_bytes_with_its_title_escaped() {
    let figures = drawn(run(3, 4, 60), &setup());
    assert_eq!(figures, drawn(run(3, 4, 60), &setup()));
    assert!(figures.iter().all(|figure| figure.svg.contains("Two UAVs &amp; one &lt;group&gt;")));
}

#[test]
fn no_frames_are_an_error_and_a_bad_frame_is_passed_on() {
    let none = figures(std::iter::empty::<Result<Frame, Infallible>>(), &setup());
    assert!(matches!(none, Err(FigureError::NoFrames)));
    let bad = figures([Ok(Frame::default()), Err("torn")].into_iter(), &setup());
    assert!(matches!(bad, Err(FigureError::Frame("torn"))));
}

#[test]
fn empty_short_and_long_runs_draw() {
    for frames in [vec![Frame::default()], run(0, 0, 3), run(2, 4, 1), run(24, 150, 2400)] {
        assert_sound(&drawn(frames, &setup()));
    }
}

#[test]
fn odd_values_draw() {
    for value in [1e7, -1e7, 1e9, f64::MAX, f64::MIN, f64::NAN, f64::INFINITY, 0.0, -1.0, 5e-324] {
        let mut frames = run(2, 4, 60);
        for (i, frame) in frames.iter_mut().enumerate() {
            frame.groups[0].standoff_unclamped_m = value;
            frame.groups[0].y_m += value;
            (frame.uavs[0].x_m, frame.uavs[0].speed_m_s) = (value, value);
            frame.uavs[0].boresight_rad = Some(value);
            frame.uavs[1].phase_rad = (i % 3 > 0).then_some(value);
            frame.uavs[1].centre_distance_m = Some(value);
        }
        (frames[3].time_us, frames[5].time_us) = (i64::MAX, i64::MIN);
        let title = "x\u{7}".repeat(5000);
        let setup = Setup { title, field_of_view_rad: value, speed_max_m_s: value, radius_min_m: value, ..setup() };
        assert_sound(&drawn(frames, &setup));
    }
}
