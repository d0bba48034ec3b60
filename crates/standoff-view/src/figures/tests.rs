//! Tests of the figures on synthetic runs: which figures are drawn, unusual runs, and reproducible bytes.

use super::chart::fitted;
use super::collect::Run;
use super::curve::MAX_POINTS;
use super::style::width_px;
use super::{Figure, FigureError, Setup, figures};
use crate::colours::{GROUPS, UAVS};
use crate::row_fixtures::{group_row, track_row, truth_row, uav_row};
use crate::score_fixtures::score_config;
use plotters::style::RGBColor;
use standoff::math::{PI, TAU, cos, exp, sin};
use standoff::{Angle, TeammateStatus};
use standoff_record::{AgentRow, EventRow, Frame, GroupRow, MembershipState, TeammateRow, TrackRow, UavRow};
use standoff_score::FrameScorer;
use std::convert::Infallible;
use std::f64::consts::FRAC_PI_2;

const ALL: [&str; 7] =
    ["trajectories", "standoff_distance", "phase", "separation", "margin", "off_boresight", "speed_and_turn_rate"];

pub(crate) fn setup() -> Setup {
    Setup {
        title: "Two UAVs & one <group>".to_owned(),
        about: String::new(),
        field_of_view_rad: 0.7,
        sensing_range_m: 1000.0,
        speed_min_m_s: 30.0,
        speed_max_m_s: 50.0,
        turn_rate_max_rad_s: 0.2,
        radius_min_m: 370.0,
        radius_max_m: 2000.0,
        desired_phase_rad: FRAC_PI_2,
        intruders: 0,
        detections: None,
        rules: score_config(),
    }
}

/// Adds a target and its track, whose estimate has this error.
fn add_target(frame: &mut Frame, (x_m, y_m): (f64, f64), error_m: (f64, f64), track: TrackRow) {
    frame.truth.push(truth_row(track.target, x_m, y_m));
    frame.tracks.push(TrackRow { state: [x_m + error_m.0, 0.0, 0.0, y_m + error_m.1, 0.0, 0.0], ..track });
}

/// Frames of UAVs that spiral onto a circle about a group moving north-east; some values are missing.
fn run(uavs: u32, targets: u32, steps: i32) -> Vec<Frame> {
    (0..steps).map(|i| frame_at(uavs, targets, i)).collect()
}

fn frame_at(uavs: u32, targets: u32, i: i32) -> Frame {
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
        let noise_m = |rate: f64| 4.0 * sin(time * rate + f64::from(target));
        let group = (!missing(target)).then_some(1);
        add_target(&mut frame, (x_m, y_m), (noise_m(0.8), noise_m(1.0)), track_row(target, group));
    }
    for uav in 1..=uavs {
        let settle = exp(-time / 20.0);
        let ripple = |rate: f64| sin(time * rate + f64::from(uav));
        let spacing = if uavs > 2 { TAU / f64::from(uavs) } else { FRAC_PI_2 };
        let phase = Angle::from_rad(f64::from(uav) * spacing * (1.0 - 0.4 * settle) + 0.1 * time).rad();
        let distance = standoff_distance_m + 300.0 * settle + 5.0 * ripple(0.4);
        frame.uavs.push(UavRow {
            group: Some(1),
            x_m: x_m + distance * cos(phase),
            y_m: y_m + distance * sin(phase),
            heading_rad: phase + FRAC_PI_2,
            speed_m_s: 40.0 + 4.0 * ripple(0.6),
            turn_rate_rad_s: 0.1 + 0.03 * ripple(0.6),
            boresight_rad: (!missing(uav)).then_some(phase + PI + 0.03 * ripple(0.6)),
            speed_command_m_s: (40.0 + 5.0 * ripple(0.62)).min(44.5),
            turn_rate_command_rad_s: 0.1 + 0.05 * ripple(1.7),
            centre_distance_m: (!missing(uav)).then_some(distance),
            phase_rad: (!missing(uav)).then_some(phase),
            ..uav_row(uav)
        });
    }
    frame.groups.push(GroupRow {
        members: targets,
        x_m,
        y_m,
        vx_m_s: 6.0,
        spread_m,
        margin_m: 20.0,
        standoff_unclamped_m,
        standoff_distance_m,
        nearest_groupmate_m: (uavs > 1).then(|| 300.0 + 40.0 * sin(time / 8.0)),
        ..group_row(1)
    });
    frame
}

/// A handoff and a removal similar to figure 9: four UAVs in two groups of seven targets that move apart. Target 4
/// drives from group 1 to group 2 and is in handoff for a while; target 7 moves away from group 2.
fn handoff(steps: i32) -> Vec<Frame> {
    (0..steps).map(|i| parting(i, f64::from(i) / f64::from(steps))).collect()
}

fn parting(i: i32, share: f64) -> Frame {
    let mut frame = Frame { time_us: i64::from(i) * 500_000, ..Frame::default() };
    let home = |group: u32| (300.0 * share, if group == 1 { -500.0 } else { 500.0 } * (1.0 + share));
    let away = (6.0 * (share - 0.85)).max(0.0);
    for target in 1..=7 {
        let (group, to_group, place) = match target {
            4 if share < 0.4 => (Some(1), None, MembershipState::Member),
            4 if share < 0.6 => (Some(1), Some(2), MembershipState::InHandoff),
            7 if away > 0.0 => (None, None, MembershipState::Removed),
            1..=3 => (Some(1), None, MembershipState::Member),
            _ => (Some(2), None, MembershipState::Member),
        };
        let (mut x_m, mut y_m) = home(if target < 4 { 1 } else { 2 });
        let angle = f64::from(target) * 2.1 + 0.02 * f64::from(i);
        (x_m, y_m) = (x_m + 80.0 * cos(angle), y_m + 80.0 * sin(angle) + if target == 7 { 600.0 * away } else { 0.0 });
        if target == 4 {
            y_m = -400.0 + 1000.0 * share;
        }
        let noise_m = |rate: f64| 4.0 * sin(f64::from(i) * rate + f64::from(target));
        let track = TrackRow { membership: place, receiving_group: to_group, ..track_row(target, group) };
        add_target(&mut frame, (x_m, y_m), (noise_m(0.8), noise_m(1.0)), track);
    }
    let [one, two] = [1, 2].map(|group| {
        let mut part = frame_at(2, 0, i);
        let members = frame.tracks.iter().filter(|row| row.group == Some(group) || row.receiving_group == Some(group));
        let members: Vec<_> = members.map(|row| (row.state[0], row.state[3])).collect();
        let count = members.len() as f64;
        let centre = members.iter().fold((0.0, 0.0), |sum, at| (sum.0 + at.0 / count, sum.1 + at.1 / count));
        let centre = (centre.0 + 3.0 * sin(0.1 * f64::from(i)), centre.1);
        let moved = (centre.0 - part.groups[0].x_m, centre.1 - part.groups[0].y_m);
        let ripple = 10.0 + 5.0 * sin(0.07 * f64::from(i) + f64::from(group));
        let (separation_m, margin_m) = (Some(450.0 + 10.0 * ripple), ripple);
        let row = GroupRow {
            group,
            x_m: centre.0,
            y_m: centre.1,
            margin_m,
            nearest_groupmate_m: separation_m,
            ..part.groups[0]
        };
        frame.groups.push(row);
        for uav in &mut part.uavs {
            (uav.uav, uav.group) = (uav.uav + 2 * (group - 1), Some(group));
            (uav.x_m, uav.y_m) = (uav.x_m + moved.0, uav.y_m + moved.1);
        }
        part.uavs
    });
    frame.uavs.extend(one.into_iter().chain(two));
    let crosses = |from: f64| share >= from && share - 1.0 / 200.0 < from;
    let kinds = [("handoff-started", 4, 0.4), ("handoff-completed", 4, 0.6), ("removed", 7, 0.85), ("lost", 7, 0.98)];
    for (kind, target, _) in kinds.into_iter().filter(|kind| crosses(kind.2)) {
        let (group, to_group) = if target == 4 { (Some(1), Some(2)) } else { (Some(2), None) };
        let (kind, target) = (kind.to_owned(), Some(target));
        frame.events.push(EventRow { kind, target, group, to_group, ..EventRow::default() });
    }
    frame
}

/// Eight UAVs in four groups over many targets in a town with streets 150 m apart. Targets change groups and leave
/// them.
fn town(targets: u32, steps: i32) -> Vec<Frame> {
    let frame = |i: i32| {
        let time = f64::from(i) * 0.5;
        let mut frame = Frame { time_us: i64::from(i) * 500_000, ..Frame::default() };
        let home = |group: u32| {
            let angle = f64::from(group) * 1.7 + 0.0015 * time;
            (900.0 * cos(angle), 700.0 * sin(2.0 * angle))
        };
        for target in 0..targets {
            let start = |by: u32| 150.0 * (f64::from(target * by % 23) - 11.0);
            // Back and forth along a street.
            let way = 1200.0 * sin(f64::from(target) + 0.008 * time);
            let (x_m, y_m) = if target % 2 == 0 { (start(7), way) } else { (way, start(11)) };
            let apart = |group: &u32| (x_m - home(*group).0).abs() + (y_m - home(*group).1).abs();
            let group = (0..4).find(|group| apart(group) < 600.0);
            let membership = if group.is_some() { MembershipState::Member } else { MembershipState::Removed };
            let track = TrackRow { membership, ..track_row(target, group) };
            add_target(&mut frame, (x_m, y_m), (3.0 * sin(time), 0.0), track);
        }
        for group in 0..4 {
            let mut part = frame_at(2, 0, i);
            let (x_m, y_m) = home(group);
            let moved = (x_m - part.groups[0].x_m, y_m - part.groups[0].y_m);
            frame.groups.push(GroupRow { group, x_m, y_m, ..part.groups[0] });
            for uav in &mut part.uavs {
                (uav.uav, uav.group) = (uav.uav + 2 * group, Some(group));
                (uav.x_m, uav.y_m) = (uav.x_m + moved.0, uav.y_m + moved.1);
            }
            frame.uavs.extend(part.uavs);
        }
        frame
    };
    (0..steps).map(frame).collect()
}

fn drawn(frames: Vec<Frame>, setup: &Setup) -> Vec<Figure> {
    figures(frames.into_iter().map(Ok::<_, Infallible>), setup).unwrap()
}

fn names(frames: Vec<Frame>) -> Vec<&'static str> {
    drawn(frames, &setup()).iter().map(|figure| figure.name).collect()
}

/// Checks that every figure is complete and all coordinates are finite. The library keeps them on the page.
fn assert_sound(figures: &[Figure]) {
    for Figure { name, svg } in figures {
        assert!(svg.starts_with("<svg width=\"900\"") && svg.trim_end().ends_with("</svg>"), "{name}");
        assert!(!svg.contains("NaN") && !svg.contains("inf") && svg.len() < 1_000_000, "{name}");
        assert_words_fit(name, svg);
    }
}

#[test]
fn the_phase_figure_needs_two_uavs_on_one_orbit() {
    assert_eq!(names(run(2, 4, 60)), ALL);
    assert_eq!(names(run(3, 4, 60)), ALL);
    assert!(!names(run(1, 4, 60)).contains(&"phase"));
    let mut apart = run(2, 4, 60);
    apart.iter_mut().for_each(|frame| frame.uavs[1].group = Some(2));
    assert!(!names(apart).contains(&"phase"));
}

#[test]
fn the_same_run_gives_the_same_bytes_with_its_title_escaped() {
    let figures = drawn(run(3, 4, 60), &setup());
    assert_eq!(figures, drawn(run(3, 4, 60), &setup()));
    assert!(figures.iter().all(|figure| figure.svg.contains("Two UAVs &amp; one &lt;group&gt;")));
}

#[test]
fn missing_frames_are_an_error_and_read_errors_are_passed_on() {
    let none = figures(std::iter::empty::<Result<Frame, Infallible>>(), &setup());
    assert!(matches!(none, Err(FigureError::NoFrames)));
    let bad = figures([Ok(Frame::default()), Err("torn")].into_iter(), &setup());
    assert!(matches!(bad, Err(FigureError::Frame("torn"))));
}

#[test]
fn empty_short_and_long_runs_are_drawn() {
    for frames in [vec![Frame::default()], run(0, 0, 3), run(2, 4, 1), run(24, 150, 2400)] {
        assert_sound(&drawn(frames, &setup()));
    }
}

#[test]
fn extreme_values_are_drawn() {
    for value in [1e7, -1e7, 1e9, f64::MAX, f64::MIN, f64::NAN, f64::INFINITY, 0.0, -1.0, 5e-324] {
        let mut frames = run(2, 4, 60);
        for (i, frame) in frames.iter_mut().enumerate() {
            frame.groups[0].standoff_unclamped_m = value;
            frame.groups[0].y_m += value;
            (frame.groups[0].margin_m, frame.groups[0].nearest_groupmate_m) = (value, Some(value));
            frame.tracks[0].state[0] = value;
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

/// Texts of a figure: x position and font size (px), anchor and content.
fn words(svg: &str) -> Vec<(f64, f64, &str, &str)> {
    svg.split("<text").skip(1).filter_map(word).collect()
}

fn word(text: &str) -> Option<(f64, f64, &str, &str)> {
    let (head, rest) = text.split_once(">\n")?;
    let value = |name: &str| head.split(&format!(" {name}=\"")).nth(1)?.split('"').next();
    let px = |name: &str| Some(value(name)?.parse::<f64>().ok()? / 4.0);
    let anchor = if head.contains("rotate") { "turned" } else { value("text-anchor").unwrap_or("start") };
    Some((px("x")?, px("font-size")?, anchor, rest.split("\n</text>").next()?))
}

/// Checks that no text leaves the page, even in a wide font.
fn assert_words_fit(name: &str, svg: &str) {
    let words = words(svg);
    assert!(words.len() > 8, "{name}");
    for (x, size, anchor, text) in words {
        let text = text.replace("&amp;", "&").replace("&lt;", "<").replace("&gt;", ">");
        let wide = width_px(&text, size);
        let (left, right) = match anchor {
            "start" => (x, x + wide),
            "middle" => (x - wide / 2.0, x + wide / 2.0),
            // Rotated texts and axis numbers always have enough space.
            _ => continue,
        };
        assert!(left >= 0.0 && right <= 900.0, "{name}: {text:?} from {left} to {right} px");
    }
}

/// Legend entries: texts to the right of the plots.
fn legend(svg: &str) -> Vec<&str> {
    words(svg).into_iter().filter(|(x, ..)| *x > 730.0).map(|(.., text)| text).collect()
}

#[test]
fn the_map_has_few_legend_entries_and_the_most_important_ones() {
    for (frames, least) in [(handoff(200), 8), (town(650, 1200), 6), (generations(30), 4), (run(24, 4, 40), 3)] {
        let figures = drawn(frames, &setup());
        let names = legend(svg(&figures, "trajectories")).len();
        assert!((least..=8).contains(&names), "{names} entries");
    }
    let figures = drawn(handoff(200), &setup());
    let map = svg(&figures, "trajectories");
    assert!(legend(map).contains(&"UAV, view at the end") && legend(map).contains(&"handoff completed"));
    assert!(map.contains("\ngroup 1\n") && map.contains("\ngroup 2\n"), "group names are on the map");
    assert!(!map.contains("UAV at the start"), "the least important entry is left out");
}

#[test]
fn a_legend_shows_the_number_of_unnamed_uavs() {
    let figures = drawn(run(24, 4, 40), &setup());
    let names = legend(svg(&figures, "off_boresight"));
    assert!(names.contains(&"UAV 8") && !names.contains(&"UAV 9") && names.contains(&"and 16 more UAVs"), "{names:?}");
    assert!(!drawn(run(8, 4, 40), &setup()).iter().any(|figure| figure.svg.contains(" more UAVs")));
}

#[test]
fn long_legend_entries_are_shortened_with_an_ellipsis() {
    assert_eq!(fitted("UAV 10 to UAV 11".to_owned()), "UAV 10 to UAV 11");
    let long = fitted("WWW ".repeat(20));
    assert!(long.ends_with('…') && width_px(&long, 11.5) <= 150.0 && long.len() > 10, "{long}");
}

/// Collects the curves of a run.
fn gathered(frames: &[Frame]) -> Run {
    let mut run = Run::default();
    let mut scorer = FrameScorer::new(setup().rules);
    frames.iter().for_each(|frame| run.add(frame, &mut scorer));
    run
}

fn svg<'a>(figures: &'a [Figure], name: &str) -> &'a str {
    &figures.iter().find(|figure| figure.name == name).unwrap().svg
}

#[test]
fn a_handoff_and_a_removal_are_marked_on_the_map_and_over_time() {
    let figures = drawn(handoff(200), &setup());
    assert_sound(&figures);
    let map = svg(&figures, "trajectories");
    for label in
        ["handoff completed", "target removed", "target lost", "targets, group colour", "handoff to that group"]
    {
        assert!(map.contains(label), "{label}");
    }
    for name in ["standoff_distance", "margin"] {
        let svg = svg(&figures, name);
        for label in ["handoff started", "handoff completed", "target removed"] {
            assert_eq!(svg.matches(label).count(), 1, "{name}: {label}");
        }
        assert!(svg.contains("group 1") && svg.contains("group 2") && !svg.contains("lost"), "{name}");
    }
    let one_group = drawn(run(2, 4, 60), &setup());
    assert!(!one_group.iter().any(|figure| figure.svg.contains("band") || figure.svg.contains(", group 1 (")));
}

#[test]
fn a_path_changes_colour_with_the_group_without_a_gap() {
    let run = gathered(&handoff(200));
    let pieces = |target: u32| &run.tracks[&target].pieces;
    assert_eq!(pieces(1).keys().copied().collect::<Vec<_>>(), [Some(0)]);
    let [first, second] = [0, 1].map(|colour| pieces(4)[&Some(colour)].runs(MAX_POINTS).concat());
    assert_eq!((first.last(), first.len(), second.len()), (second.first(), 121, 80));
    assert_eq!(run.dwells.keys().copied().collect::<Vec<_>>(), [(4, 1)]);
    assert_eq!(run.dwells[&(4, 1)].runs(MAX_POINTS).concat().len(), 40);
    assert_eq!(pieces(7).keys().copied().collect::<Vec<_>>(), [None, Some(1)]);
    assert_eq!(run.uavs[&3].assigned.pieces.keys().copied().collect::<Vec<_>>(), [Some(1)]);
}

#[test]
fn figures_that_need_no_truth_are_drawn_without_it() {
    let mut frames = handoff(200);
    frames.iter_mut().for_each(|frame| frame.truth.clear());
    let names = names(frames);
    assert!(names.contains(&"margin") && names.contains(&"standoff_distance") && !names.contains(&"off_boresight"));
}

/// Groups that exist one after the other for 2, 3, 4, ... time steps, and one group that exists all the time.
fn generations(count: u32) -> Vec<Frame> {
    let (mut frames, mut i) = (Vec::new(), 0);
    for group in 1..=count {
        for _ in 0..=group {
            let mut frame = frame_at(2, 4, i);
            frame.groups = [0, group].map(|group| GroupRow { group, ..frame.groups[0] }).to_vec();
            frame.uavs.iter_mut().for_each(|row| row.group = Some(group));
            frames.push(frame);
            i += 1;
        }
    }
    frames
}

#[test]
fn only_the_longest_lived_of_many_groups_have_panels_and_a_note_states_this() {
    let figures = drawn(generations(9), &setup());
    assert_sound(&figures);
    let svg = svg(&figures, "standoff_distance");
    assert!(svg.contains("(the 4 longest-lived of 10 groups)"));
    assert_eq!(
        [0, 6, 7, 8, 9].map(|id| svg.contains(&format!("Distance to centre, group {id} (m)"))),
        [true, false, true, true, true]
    );
    assert!(!drawn(handoff(200), &setup()).iter().any(|figure| figure.svg.contains("longest-lived")));
}

#[test]
fn simultaneous_groups_differ_in_colour_and_few_retired_groups_are_kept() {
    let mut run = Run::default();
    for frame in generations(80) {
        run.add(&frame, &mut FrameScorer::new(setup().rules));
        let [lasting, other] = [0, 1].map(|place| run.group_colour(frame.groups[place].group));
        assert_ne!(lasting, other);
    }
    assert_eq!((run.created, run.groups.len()), (81, 32));
    assert!(run.groups.contains_key(&0) && run.groups.contains_key(&50) && !run.groups.contains_key(&49));
    assert!(GROUPS.iter().all(|colour| !UAVS.contains(colour)));
}

#[test]
fn figures_of_a_large_town_stay_small() {
    let figures = drawn(town(650, 1200), &setup());
    assert_sound(&figures);
    assert!(svg(&figures, "trajectories").contains("earlier paths of UAVs"));
}

#[test]
fn figures_without_data_are_left_out() {
    assert!(names(vec![Frame::default()]).is_empty());
    assert_eq!(names(run(0, 4, 9)), ["trajectories", "standoff_distance", "margin"]);
}

#[test]
fn curves_of_two_pairs_with_a_common_uav_look_different() {
    let mut frames = run(3, 4, 60);
    for (i, frame) in frames.iter_mut().enumerate() {
        // UAV 1 flies with UAV 2, then with UAV 3.
        frame.uavs[if i < 30 { 2 } else { 1 }].group = None;
    }
    let figures = drawn(frames, &setup());
    let svg = svg(&figures, "phase");
    assert!(svg.contains("UAV 1 to UAV 2") && svg.contains("UAV 1 to UAV 3"));
    let hex = |rank: usize| {
        let RGBColor(r, g, b) = UAVS[rank];
        format!("#{r:02X}{g:02X}{b:02X}")
    };
    let strokes = |rank: usize, dashed: bool| {
        let of = |line: &&str| line.contains(&hex(rank)) && line.contains("stroke-dasharray") == dashed;
        svg.lines().filter(of).count()
    };
    assert!(strokes(0, false) > 0 && strokes(0, true) == 0);
    assert!([1, 2].into_iter().all(|rank| strokes(rank, true) > 0 && strokes(rank, false) == 0));
}

#[test]
fn each_uav_has_its_own_turn_rate_row_and_a_note_gives_the_number_of_rows() {
    let figures = drawn(town(20, 40), &setup());
    let all = svg(&figures, "speed_and_turn_rate");
    assert!((1..=8).all(|uav| all.matches(&format!("UAV {uav} (°/s)")).count() == 1) && !all.contains("of the first"));
    let figures = drawn(run(24, 4, 40), &setup());
    let some = svg(&figures, "speed_and_turn_rate");
    assert!(some.contains("UAV 8 (°/s)") && !some.contains("UAV 9 (°/s)"));
    assert!(some.contains("(turn rates of the first 8 of 24 UAVs)"));
}

/// Two agents that do not receive each other for a while, then have different assignments and commit nothing. The
/// second agent's computer starts late.
#[test]
fn the_agreement_figure_shows_contact_disagreement_and_uncommitted_time() {
    assert!(!names(run(2, 4, 40)).contains(&"agreement"), "one agent for the whole team");
    let mut frames = run(2, 4, 40);
    for (i, frame) in (0..).zip(&mut frames) {
        let apart = (10..30).contains(&i);
        for agent in (0..2).filter(|agent| i >= 5 * agent) {
            let committed_us = (i > 0).then_some(500_000 * if apart { 9 } else { i64::from(i) - 1 });
            frame.agents.all.push(AgentRow { agent, committed_us, ..AgentRow::default() });
            for uav in 0..2 {
                let is_gone = apart && uav != agent;
                let status = Some(if is_gone { TeammateStatus::TimedOut } else { TeammateStatus::Live });
                let (group, group_id) = (Some(1), (!is_gone).then_some(7));
                let row = TeammateRow { agent, uav, status, group, group_id, ..TeammateRow::default() };
                frame.agents.teammates.push(row);
            }
        }
    }
    let gathered = gathered(&frames);
    let values =
        |curve: &super::curve::Curve| curve.runs(MAX_POINTS).concat().iter().map(|at| at.1).collect::<Vec<_>>();
    for (id, first) in [(0, 0), (1, 5)] {
        let curves = &gathered.agents[&id];
        let expected: Vec<f64> = (first..40).map(|i| f64::from((10..30).contains(&i))).collect();
        assert_eq!((values(&curves.not_received), values(&curves.disagreeing)), (expected.clone(), expected));
        assert_eq!(values(&curves.uncommitted).into_iter().fold(0.0, f64::max), 10.0);
    }
    let figures = drawn(frames, &setup());
    assert_sound(&figures);
    assert_eq!(legend(svg(&figures, "agreement")), ["UAV 0", "UAV 1"]);
}
