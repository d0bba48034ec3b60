use std::collections::BTreeMap;
use std::io::Read;

use flate2::read::GzDecoder;
use serde_json::Value;
use standoff_record::{Frame, GroupRow, IntruderRow, Manifest, TrackRow, TrackStatus};
use standoff_score::{FrameScorer, MetricSelection, Scorer};
use standoff_sim::scenario::Scenario;

use super::{Encoder, Head, Part, Replay};
use crate::common::{frames, load};
use crate::figures::Setup;

/// A block, read back like the page does: its directory, and the values over time by table, column and id.
pub(super) struct Block {
    pub(super) directory: Value,
    columns: BTreeMap<(String, String, u32), Vec<f32>>,
}

pub(super) fn read(gz: &[u8]) -> Block {
    let mut bytes = Vec::new();
    GzDecoder::new(gz).read_to_end(&mut bytes).unwrap();
    let length = u32::from_le_bytes(bytes[..4].try_into().unwrap()) as usize;
    let directory: Value = serde_json::from_slice(&bytes[4..4 + length]).unwrap();
    let mut rest = &bytes[4 + length..];
    let steps = directory["times_us"].as_array().unwrap().len();
    let mut columns = BTreeMap::new();
    for table in directory["tables"].as_array().unwrap() {
        let ids: Vec<u32> = serde_json::from_value(table["ids"].clone()).unwrap();
        let plane = ids.len() * steps;
        for column in table["columns"].as_array().unwrap() {
            for (object, id) in ids.iter().enumerate() {
                let mut bits = 0u32;
                let number = |step: usize| {
                    let at = |place: usize| rest[place * plane + object * steps + step];
                    bits = bits.wrapping_add(u32::from_le_bytes([at(0), at(1), at(2), at(3)]));
                    f32::from_bits(bits)
                };
                let name = |value: &Value| value.as_str().unwrap().to_owned();
                columns.insert((name(&table["name"]), name(column), *id), (0..steps).map(number).collect());
            }
            rest = &rest[4 * plane..];
        }
    }
    assert!(rest.is_empty(), "the tables fill the block");
    Block { directory, columns }
}

impl Block {
    /// A value of a table or object that may be missing.
    pub(super) fn find(&self, table: &str, column: &str, id: u32, step: usize) -> Option<f64> {
        let values = self.columns.get(&(table.to_owned(), column.to_owned(), id))?;
        Some(values[step]).filter(|value| !value.is_nan()).map(f64::from)
    }

    fn value(&self, table: &str, column: &str, id: u32, step: usize) -> Option<f64> {
        let value = self.columns[&(table.to_owned(), column.to_owned(), id)][step];
        (!value.is_nan()).then_some(f64::from(value))
    }
}

/// The paper's four UAVs with two groups that hand off a target.
fn flight() -> (Scenario, Vec<Frame>) {
    let scenario = load("paper/figure-9", &[], 1);
    let frames = frames(&scenario);
    (scenario, frames)
}

pub(super) fn encoded(scenario: &Scenario, frames: &[Frame], stride: usize) -> Vec<Part> {
    let mut encoder = Encoder::new(&scenario.settings.score_config(), stride);
    let mut parts: Vec<Part> = frames.iter().filter_map(|frame| encoder.frame(frame)).collect();
    parts.extend(encoder.part());
    assert!(encoder.part().is_none(), "nothing is encoded twice");
    parts
}

pub(super) fn near(got: Option<f64>, expected: Option<f64>) -> bool {
    match (got, expected) {
        (Some(got), Some(expected)) => (got - expected).abs() <= 1e-6 * expected.abs().max(1e-30),
        (None, None) => true,
        _ => false,
    }
}

#[test]
fn every_number_of_the_record_reads_back_from_the_parts() {
    let (scenario, frames) = flight();
    let parts = encoded(&scenario, &frames, 1);
    let mut left = frames.iter();
    for part in &parts {
        let (overview, detail) = (read(&part.overview), read(&part.detail));
        assert_eq!(overview.directory["times_us"], detail.directory["times_us"]);
        let mut events = overview.directory["events"].as_array().unwrap().iter();
        for (step, time_us) in overview.directory["times_us"].as_array().unwrap().iter().enumerate() {
            let frame = left.next().unwrap();
            assert_eq!(time_us.as_i64(), Some(frame.time_us));
            for row in &frame.uavs {
                let got = |column| overview.value("uavs", column, row.uav, step);
                assert!(near(got("x_m"), Some(row.x_m)) && near(got("heading_rad"), Some(row.heading_rad)));
                assert!(near(got("group"), row.group.map(f64::from)));
                assert!(near(got("boresight_rad"), row.boresight_rad));
                assert!(near(got("turn_rate_limited"), Some(f64::from(row.turn_rate_limited))));
            }
            for row in &frame.groups {
                let got = |column| overview.value("groups", column, row.group, step);
                assert!(near(got("standoff_distance_m"), Some(row.standoff_distance_m)));
                assert!(
                    near(got("nearest_groupmate_m"), row.nearest_groupmate_m)
                        && near(got("margin_m"), Some(row.margin_m))
                );
            }
            for row in &frame.truth {
                assert!(near(detail.value("targets", "true_y_m", row.target, step), Some(row.y_m)));
            }
            for row in &frame.tracks {
                let got = |column| detail.value("targets", column, row.target, step);
                assert!(near(got("x_m"), Some(row.state[0])) && near(got("vy_m_s"), Some(row.state[4])));
                assert!(
                    near(got("cov_x_y"), Some(row.covariance[3])) && near(got("cov_y_y"), Some(row.covariance[15]))
                );
                let held = f64::from(u8::from(row.status == TrackStatus::Updated));
                assert_eq!(got("status") == Some(1.0), held == 1.0);
                assert!(near(got("receiving_group"), row.receiving_group.map(f64::from)));
                let detected = frame.detections.iter().filter(|detection| detection.target == Some(row.target)).count();
                assert_eq!(got("detections"), Some(detected as f64));
            }
            for row in &frame.events {
                let event = events.next().unwrap();
                assert_eq!(
                    (event["time_us"].as_i64(), event["kind"].as_str()),
                    (Some(frame.time_us), Some(&*row.kind))
                );
                assert_eq!(event["reason"].as_str(), Some(&*row.reason));
            }
        }
        assert!(events.next().is_none());
    }
    assert!(left.next().is_none());
    assert!(
        frames.iter().any(|frame| frame.tracks.iter().any(|track| track.receiving_group.is_some())),
        "the run has a handoff with dwell"
    );
}

/// The bounds, to which the page fits its map, are tight around everything drawn at any time step, also without a
/// detail.
#[test]
fn a_part_has_the_bounds_of_everything_it_shows() {
    let (scenario, frames) = flight();
    for stride in [1, 7] {
        let parts = encoded(&scenario, &frames, stride);
        let mut left = frames.iter();
        for part in &parts {
            let overview = read(&part.overview).directory;
            let mut around = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
            let mut put = |x: f64, y: f64, r: f64| {
                let [west, south, east, north] = around;
                around = [west.min(x - r), south.min(y - r), east.max(x + r), north.max(y + r)];
            };
            for frame in left.by_ref().take(overview["times_us"].as_array().unwrap().len()) {
                frame.uavs.iter().for_each(|row| put(row.x_m, row.y_m, 0.0));
                frame.groups.iter().for_each(|row| put(row.x_m, row.y_m, row.standoff_distance_m));
                frame.truth.iter().for_each(|row| put(row.x_m, row.y_m, 0.0));
                frame.tracks.iter().for_each(|row| put(row.state[0], row.state[3], 0.0));
            }
            let bounds_m: [f64; 4] = serde_json::from_value(overview["bounds_m"].clone()).unwrap();
            let [west, south, east, north] = around;
            assert_eq!(bounds_m, [west.floor(), south.floor(), east.ceil(), north.ceil()]);
            assert!(read(&part.detail).directory.get("bounds_m").is_none());
        }
        assert!(left.next().is_none());
    }
    let empty = encoded(&scenario, &[Frame::default()], 1);
    assert!(read(&empty[0].overview).directory.get("bounds_m").is_none(), "an empty part has no bounds");
}

/// An intruder far from all UAVs must not enlarge the extent of the map.
#[test]
fn the_bounds_include_only_intruders_near_a_uav() {
    let (scenario, frames) = flight();
    let uav = frames[0].uavs[0];
    let bounds_m = |off_m: f64| {
        let (x_m, y_m) = (uav.x_m, uav.y_m + off_m);
        let intruder = IntruderRow { x_m, y_m, ..IntruderRow::default() };
        let frame = Frame { uavs: vec![uav], intruders: vec![intruder], ..Frame::default() };
        let parts = encoded(&scenario, &[frame], 1);
        let bounds: [f64; 4] = serde_json::from_value(read(&parts[0].overview).directory["bounds_m"].clone()).unwrap();
        bounds[3] - bounds[1]
    };
    assert!((bounds_m(1199.0) - 1200.0).abs() <= 1.0 && bounds_m(1201.0) <= 1.0);
}

#[test]
fn a_part_contains_the_counts_of_the_whole_run() {
    let (scenario, frames) = flight();
    let mut left = frames.iter();
    let (mut scorer, mut compared) = (FrameScorer::new(scenario.settings.score_config()), 0);
    for part in &encoded(&scenario, &frames, 7) {
        let overview = read(&part.overview);
        for step in 0..overview.directory["times_us"].as_array().unwrap().len() {
            let frame = left.next().unwrap();
            let scores = scorer.frame(frame);
            let custody = scores.custody();
            let got = |column| overview.value("run", column, 0, step);
            let count = |targets: usize| targets as f64;
            assert_eq!(got("targets"), Some(count(custody.targets)));
            assert_eq!(got("tracked"), Some(count(custody.tracked)));
            assert_eq!(got("in_view"), custody.in_view.map(count));
            assert_eq!(got("in_custody"), custody.in_custody.map(count));
            assert!(near(got("position_error_m"), custody.position_error_m));
            compared += usize::from(custody.in_custody.is_some() && custody.position_error_m.is_some());
        }
    }
    assert!(left.next().is_none() && compared > 0);
}

/// The record of a flight has no true targets; counts of 0 would look like lost custody.
#[test]
fn without_true_targets_there_are_no_counts() {
    let (scenario, frames) = flight();
    let without = frames.iter().take(3).map(|frame| Frame { truth: Vec::new(), ..frame.clone() });
    let overview = read(&encoded(&scenario, &without.collect::<Vec<_>>(), 1)[0].overview);
    assert!((0..3).all(|step| overview.find("run", "targets", 0, step).is_none()));
    assert!(overview.find("uavs", "x_m", 0, 2).is_some());
}

/// The largest time that the page shows for a target is the metric.
#[test]
fn the_time_out_of_view_is_that_of_the_metric() {
    let scenario = load("paper/figure-9-basic", &[], 1);
    let frames = frames(&scenario);
    let rules = scenario.settings.score_config();
    let period_s = rules.period_s;
    let mut scorer = Scorer::new(rules, MetricSelection::all());
    frames.iter().for_each(|frame| scorer.frame(frame));
    let mut encoder = Encoder::new(&scenario.settings.score_config(), 1);
    frames.iter().for_each(|frame| drop(encoder.frame(frame)));
    let details: Vec<Block> = encoded(&scenario, &frames, 1).iter().map(|part| read(&part.detail)).collect();
    let mut longest_s = 0.0_f64;
    for score in scorer.targets() {
        let steps = details.iter().flat_map(|detail| {
            let count = detail.directory["times_us"].as_array().unwrap().len();
            (0..count).filter_map(|step| detail.find("targets", "out_of_view_steps", score.target, step))
        });
        let shown_s = steps.fold(0.0, f64::max) * period_s;
        assert_eq!(Some(shown_s), score.longest_out_of_view_s, "target {}", score.target);
        let gaps = encoder.gaps().into_iter().filter(|gap| gap.target == score.target);
        assert_eq!(gaps.map(|gap| f64::from(gap.steps) * period_s).fold(0.0, f64::max), shown_s);
        longest_s = longest_s.max(shown_s);
    }
    assert!(longest_s > 1.0);
}

/// In the record of a flight, a gap is a time without measurements of a track.
#[test]
fn without_truth_the_gaps_are_those_of_the_measurements() {
    let status =
        [TrackStatus::Cued, TrackStatus::Updated, TrackStatus::Coasting, TrackStatus::Coasting, TrackStatus::Updated];
    let scenario = load("tour/01-one-uav", &[], 1);
    let mut encoder = Encoder::new(&scenario.settings.score_config(), 1);
    for (step, status) in status.into_iter().enumerate() {
        let track = TrackRow { target: 3, status, ..TrackRow::default() };
        encoder.frame(&Frame { time_us: 500_000 * step as i64, tracks: vec![track], ..Frame::default() });
    }
    let gaps: Vec<_> = encoder.gaps().iter().map(|gap| (gap.target, gap.begin_us, gap.end_us, gap.steps)).collect();
    assert_eq!(gaps, [(3, 1_000_000, 2_000_000, 2)]);
}

#[test]
fn a_stride_thins_out_only_the_details() {
    let (scenario, frames) = flight();
    let parts = encoded(&scenario, &frames, 7);
    let times = |gz: &[u8]| -> Vec<i64> { serde_json::from_value(read(gz).directory["times_us"].clone()).unwrap() };
    let overview: Vec<i64> = parts.iter().flat_map(|part| times(&part.overview)).collect();
    let detail: Vec<i64> = parts.iter().flat_map(|part| times(&part.detail)).collect();
    assert_eq!(overview, frames.iter().map(|frame| frame.time_us).collect::<Vec<_>>());
    assert_eq!(detail, overview.iter().copied().step_by(7).collect::<Vec<_>>());
    // 256 is not a multiple of 7, but the second part also starts with a detail.
    let longer: Vec<Frame> = (0..300).map(|step| Frame { time_us: step * 500_000, ..frames[0].clone() }).collect();
    let second = &encoded(&scenario, &longer, 7)[1];
    assert_eq!(times(&second.detail)[0], times(&second.overview)[0]);
}

#[test]
fn the_same_frames_give_the_same_bytes() {
    let (scenario, frames) = flight();
    let bytes = || encoded(&scenario, &frames, 1).into_iter().flat_map(|part| [part.overview, part.detail]);
    assert!(bytes().eq(bytes()));
}

pub(super) fn head() -> Head {
    let setup = Setup {
        title: "t".to_owned(),
        about: "a".to_owned(),
        field_of_view_rad: 1.2,
        sensing_range_m: 1000.0,
        speed_min_m_s: 25.0,
        speed_max_m_s: 55.0,
        turn_rate_max_rad_s: 0.3,
        radius_min_m: 250.0,
        radius_max_m: 700.0,
        desired_phase_rad: 1.5,
        intruders: 0,
        detections: None,
        rules: crate::figures::tests::setup().rules,
    };
    Head::new(&Manifest::new("s", u64::MAX, 10.0, 0.5), setup, vec!["</script><b>".to_owned()])
}

/// Parts are available as soon as they are shown or added.
#[test]
fn a_replay_grows_while_pages_follow_it() {
    let (scenario, frames) = flight();
    let mut encoder = Encoder::new(&scenario.settings.score_config(), 1);
    let replay = Replay::new(&head()).unwrap();
    let times = |path: &str| {
        let body = replay.get(path)?.body;
        Some(read(&body).directory["times_us"].as_array().unwrap().len())
    };
    assert_eq!(times("overview/0"), None);
    for frame in &frames[..3] {
        assert!(encoder.frame(frame).is_none());
    }
    let (part, steps) = (encoder.so_far().unwrap(), encoder.open_steps());
    replay.show(part, steps);
    assert_eq!((times("overview/0"), times("detail/0"), times("overview/1")), (Some(3), Some(3), None));
    for frame in &frames[3..5] {
        assert!(encoder.frame(frame).is_none());
    }
    replay.add(encoder.part().unwrap());
    assert_eq!((times("overview/0"), times("overview/1")), (Some(5), None));
    for path in ["overview", "overview/", "overview/x", "overview/-1", "other/0", "detail/99999999999999999999", ""] {
        assert!(replay.get(path).is_none(), "{path}");
    }
    let mut json = String::new();
    GzDecoder::new(&*replay.get("head.json").unwrap().body).read_to_string(&mut json).unwrap();
    let head: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(head["seed"], "18446744073709551615", "JavaScript numbers have only 53 bits");
}

/// A frame of one UAV with tracks of `targets` targets.
fn crowd(step: i64, frame: &Frame, targets: u32) -> Frame {
    let (uavs, track) = (frame.uavs[..1].to_vec(), frame.tracks[0]);
    let tracks = (0..targets).map(|target| TrackRow { target, ..track }).collect();
    Frame { time_us: step * 500_000, uavs, tracks, ..Frame::default() }
}

/// Every target of a part occupies a row for each time step, so many new targets start a new part.
#[test]
fn many_new_targets_start_a_new_part() {
    let (scenario, frames) = flight();
    let few = (0..255).map(|step| crowd(step, &frames[0], 1));
    let frames: Vec<Frame> = few.chain([crowd(255, &frames[0], 20_000)]).collect();
    let parts = encoded(&scenario, &frames, 1);
    let steps = |part: &Part| read(&part.detail).directory["times_us"].as_array().unwrap().len();
    assert_eq!(parts.iter().map(steps).collect::<Vec<_>>(), [255, 1]);
}

#[test]
fn many_new_groups_fill_a_part_early() {
    let (scenario, frames) = flight();
    let group = frames[0].groups[0];
    let frame = |step: u32| Frame {
        groups: (0..100).map(|id| GroupRow { group: 100 * step + id, ..group }).collect(),
        ..crowd(step.into(), &frames[0], 1)
    };
    let frames: Vec<Frame> = (0..100).map(frame).collect();
    // 100 times the square of 23 is 52,900 rows, more than the limit.
    let parts = encoded(&scenario, &frames, 1);
    let steps = |part: &Part| read(&part.overview).directory["times_us"].as_array().unwrap().len();
    assert_eq!(parts.iter().map(steps).collect::<Vec<_>>(), [23, 23, 23, 23, 8]);
}

#[test]
fn a_page_gets_only_the_first_of_very_many_events() {
    let (scenario, frames) = flight();
    let event = frames.iter().find_map(|frame| frame.events.first()).unwrap().clone();
    let mut encoder = Encoder::new(&scenario.settings.score_config(), 1);
    for step in 0..6 {
        encoder.frame(&Frame { events: vec![event.clone(); 10_000], ..crowd(step, &frames[0], 1) });
    }
    let part = encoder.part().unwrap();
    let events = read(&part.overview).directory["events"].as_array().unwrap().len();
    assert_eq!((events, encoder.events_left_out()), (50_000, 10_000));
}

/// The page has the detections, tentative tracks and true velocities of sensors that are not ideal, and only of those.
#[test]
fn detections_and_tentative_tracks_read_back_from_the_parts() {
    let scenario = load("tour/10-unlabelled-detections", &["duration_s=20"], 1);
    let frames = frames(&scenario);
    let setup = Setup::of(String::new(), &scenario.settings);
    let mut encoder = Encoder::new(&scenario.settings.score_config(), 1).with_detections(setup.detections);
    frames.iter().for_each(|frame| assert!(encoder.frame(frame).is_none()));
    let detail = read(&encoder.part().unwrap().detail);
    // Rounded values have at least 12 bits.
    let close = |got: Option<f64>, expected: Option<f64>| match (got, expected) {
        (Some(got), Some(expected)) => (got - expected).abs() <= expected.abs() / 4096.0,
        (got, expected) => got.is_none() && expected.is_none(),
    };
    let mut false_alarms = 0;
    for (step, frame) in frames.iter().enumerate() {
        for (place, row) in (0..).zip(&frame.detections) {
            let got = |column| detail.value("detections", column, place, step);
            assert_eq!((got("uav"), got("target")), (Some(f64::from(row.uav)), row.target.map(f64::from)));
            assert!(close(got("range_m"), Some(row.range_m)) && close(got("bearing_rad"), Some(row.bearing_rad)));
            assert!(close(got("range_rate_m_s"), row.range_rate_m_s));
            false_alarms += u32::from(row.target.is_none());
        }
        for (place, row) in (0..).zip(&frame.tentative) {
            let got = |column| detail.value("tentative", column, place, step);
            assert!(close(got("x_m"), Some(row.x_m)) && close(got("existence"), Some(row.existence)));
        }
        for row in &frame.truth {
            assert!(close(detail.value("velocities", "true_vx_m_s", row.target, step), Some(row.vx_m_s)));
        }
    }
    let tentative = frames.iter().map(|frame| frame.tentative.len()).max();
    assert!(false_alarms > 300 && tentative > Some(10), "{false_alarms}, {tentative:?}");
    let (ideal, ..) = flight();
    assert_eq!(Setup::of(String::new(), &ideal.settings).detections, None);
}
