//! Tests of the whole file: it is read back with the crates that viewers use and compared with the frames.

use super::*;
use crate::common::{frames, load};
use foxglove::Decode;
use foxglove::messages::Pose;
use foxglove::messages::{FrameTransforms, LocationFix, Log, PointCloud, PoseInFrame, SceneEntity, SceneUpdate};
use mcap::MessageStream;
use standoff::research::math::{atan2, hypot};
use standoff_record::{MembershipState, TrackStatus};
use standoff_sim::scenario::Overrides;
use std::fs;
use std::path::PathBuf;
use tempfile::TempDir;

const SCENARIO: &str = "paper/figure-9";

fn scenario(set: &[&str]) -> Scenario {
    load(SCENARIO, set, 1)
}

fn begin(path: &Path, scenario: &Scenario) -> Result<Writer, McapError> {
    Writer::create(path, scenario, &scenario.resolved().unwrap())
}

/// Writes these frames and returns the bytes of the file.
fn written(scenario: &Scenario, frames: &[Frame]) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mission.mcap");
    let mut writer = begin(&path, scenario).unwrap();
    frames.iter().for_each(|frame| writer.frame(frame).unwrap());
    writer.finish().unwrap();
    assert_eq!(names(&folder), ["mission.mcap"]);
    fs::read(path).unwrap()
}

/// The messages of a topic, with their times in microseconds.
fn messages<M: Decode>(bytes: &[u8], topic: &str) -> Vec<(i64, M)> {
    let of_topic = MessageStream::new(bytes).unwrap().map(Result::unwrap).filter(|read| read.channel.topic == topic);
    let decoded = of_topic.map(|read| {
        assert_eq!(read.publish_time, read.log_time);
        let message = M::decode(&read.data[..]).unwrap_or_else(|error| panic!("{topic}: {error}"));
        ((read.log_time / 1000).cast_signed(), message)
    });
    decoded.collect()
}

fn entity<'a>(update: &'a SceneUpdate, id: &str) -> &'a SceneEntity {
    update.entities.iter().find(|entity| entity.id == id).unwrap_or_else(|| panic!("no {id}"))
}

fn names(folder: &TempDir) -> Vec<String> {
    let entries = fs::read_dir(folder.path()).unwrap();
    let mut names: Vec<_> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn poses_match_the_frames() {
    let scenario = scenario(&["duration_s=20"]);
    let frames = frames(&scenario);
    let bytes = written(&scenario, &frames);
    let times: Vec<_> = frames.iter().map(|frame| frame.time_us).collect();
    let transforms = messages::<FrameTransforms>(&bytes, "/tf");
    assert_eq!(transforms.iter().map(|message| message.0).collect::<Vec<_>>(), times);
    for uav in 0..4 {
        let poses = messages::<PoseInFrame>(&bytes, &format!("/uav/{uav}/pose"));
        assert_eq!(poses.len(), frames.len());
        for ((frame, (time_us, pose)), (_, transforms)) in frames.iter().zip(poses).zip(&transforms) {
            let row = &frame.uavs[uav];
            let stamp = pose.timestamp.unwrap();
            assert_eq!(
                (i64::from(stamp.sec()) * 1_000_000 + i64::from(stamp.nsec()) / 1000, time_us),
                (time_us, frame.time_us)
            );
            let Pose { position, orientation } = pose.pose.unwrap();
            let transform = &transforms.transforms[uav];
            assert_eq!((&transform.translation, &transform.rotation), (&position, &orientation));
            assert_eq!((pose.frame_id.as_str(), transform.parent_frame_id.as_str()), ("world", "world"));
            assert_eq!(transform.child_frame_id, format!("uav-{uav}"));
            let (position, rotation) = (position.unwrap(), orientation.unwrap());
            assert_eq!(
                [position.x, position.y, position.z],
                [row.x_m, row.y_m, row.commanded_altitude_m.unwrap_or(0.0)]
            );
            let heading = 2.0 * atan2(rotation.z, rotation.w);
            assert!((heading - row.heading_rad).abs() < 1e-12, "{heading}, not {}", row.heading_rad);
        }
    }
}

/// Commanded altitudes change by 50 m immediately, flown altitudes gradually. The zone is drawn at every time step.
#[test]
fn altitudes_match_the_frames_and_zones_are_drawn() {
    let scenario = load("tour/09-separation", &["duration_s=20", "groups.altitude_policy=per-group"], 1);
    let frames = frames(&scenario);
    let bytes = written(&scenario, &frames);
    let uav = frames[0].uavs.iter().position(|row| row.commanded_altitude_m != row.altitude_m).unwrap();
    let poses = messages::<PoseInFrame>(&bytes, &format!("/uav/{uav}/pose"));
    for (frame, (_, pose)) in frames.iter().zip(poses) {
        assert_eq!(Some(pose.pose.unwrap().position.unwrap().z), frame.uavs[uav].altitude_m);
    }
    for (_, scene) in messages::<SceneUpdate>(&bytes, "/scene") {
        let field = entity(&scene, "zone/0");
        let corners: Vec<_> = field.lines[0].points.iter().map(|at| (at.x, at.y)).collect();
        assert_eq!(corners, [(650.0, -100.0), (900.0, -350.0), (1150.0, -100.0)]);
        assert_eq!(field.texts[0].text, "keep-out field");
        assert!(!scene.deletions.iter().any(|deletion| deletion.id == field.id));
    }
}

#[test]
fn point_clouds_match_the_tracks() {
    let scenario = scenario(&["duration_s=20"]);
    let frames = frames(&scenario);
    let bytes = written(&scenario, &frames);
    let clouds = messages::<PointCloud>(&bytes, "/points/tracks");
    assert_eq!(clouds.len(), frames.len());
    for (frame, (_, cloud)) in frames.iter().zip(clouds) {
        let fields: Vec<_> = cloud.fields.iter().map(|field| (field.name.as_str(), field.offset)).collect();
        assert_eq!(fields, [("x", 0), ("y", 4), ("z", 8), ("target", 12)]);
        assert_eq!(cloud.data.len(), 16 * frame.tracks.len());
        for (row, point) in frame.tracks.iter().zip(cloud.data.chunks(16)) {
            let [x, y, z, target] = [0, 4, 8, 12].map(|at| <[u8; 4]>::try_from(&point[at..at + 4]).unwrap());
            assert_eq!([x, y, z].map(f32::from_le_bytes), [row.state[0] as f32, row.state[3] as f32, 0.0]);
            assert_eq!(u32::from_le_bytes(target), row.target);
        }
    }
}

#[test]
fn every_event_is_in_the_log() {
    let scenario = scenario(&[]);
    let frames = frames(&scenario);
    let bytes = written(&scenario, &frames);
    let flown = frames.iter().flat_map(|frame| frame.events.iter().map(move |event| (frame.time_us, event)));
    let flown: Vec<_> = flown.collect();
    let logged = messages::<Log>(&bytes, "/log");
    assert!(flown.len() > 20, "the mission has handoffs and removals");
    assert_eq!(logged.len(), flown.len());
    for ((time_us, event), (at, entry)) in flown.into_iter().zip(logged) {
        assert_eq!((at, &entry.name), (time_us, &event.kind));
        assert!(entry.message.ends_with(&event.reason), "{}", entry.message);
        if let Some(target) = event.target {
            assert!(entry.message.contains(&format!("target-{target}")), "{}", entry.message);
        }
        let is_warning = ["removed", "orbit-infeasible"].contains(&event.kind.as_str());
        assert_eq!(entry.level() == foxglove::messages::log::Level::Warning, is_warning, "{}", event.kind);
    }
}

#[test]
fn orbits_ellipses_and_views_have_the_size_in_the_frames() {
    let scenario = scenario(&["duration_s=30"]);
    let frames = frames(&scenario);
    let bytes = written(&scenario, &frames);
    let scenes = messages::<SceneUpdate>(&bytes, "/scene");
    assert_eq!(scenes.len(), frames.len());
    for (frame, (_, scene)) in frames.iter().zip(&scenes) {
        for row in &frame.groups {
            let circle = &entity(scene, &format!("group/{}", row.group)).lines[0];
            for point in &circle.points {
                let radius = hypot(point.x - row.x_m, point.y - row.y_m);
                assert!((radius - row.standoff_distance_m).abs() < 1e-9 && point.z == row.altitude_m, "{point:?}");
            }
        }
        for row in &frame.tracks {
            let ellipse = &entity(scene, &format!("track/{}", row.target)).lines[0];
            let [xx, xy, yy] = [row.covariance[0], row.covariance[3], row.covariance[15]];
            for point in &ellipse.points {
                let (x, y) = (point.x - row.state[0], point.y - row.state[3]);
                // 95 % of chi-square with two degrees of freedom lie below 5.99146.
                let distance = (yy * x * x - 2.0 * xy * x * y + xx * y * y) / (xx * yy - xy * xy);
                assert!((distance - 5.991_46).abs() < 1e-5, "{distance}");
            }
        }
        for row in &frame.truth {
            let cube = &entity(scene, &format!("truth/{}", row.target)).cubes[0];
            let position = cube.pose.as_ref().unwrap().position.as_ref().unwrap();
            assert_eq!([position.x, position.y], [row.x_m, row.y_m]);
        }
        for row in &frame.uavs {
            let lines = &entity(scene, &format!("uav/{}", row.uav)).lines;
            assert_eq!(lines.len(), usize::from(row.boresight_rad.is_some()));
            let (Some(view), Some(boresight)) = (lines.first(), row.boresight_rad) else { continue };
            let direction = |point: &foxglove::messages::Point3| atan2(point.y - row.y_m, point.x - row.x_m);
            for (edge, edge_deg) in [(&view.points[1], -35.0_f64), (view.points.last().unwrap(), 35.0)] {
                let off = standoff::Angle::from_rad(direction(edge) - boresight - edge_deg.to_radians());
                assert!(off.abs_rad() < 1e-9, "half of 70 degrees to either side");
                assert!((hypot(edge.x - row.x_m, edge.y - row.y_m) - 1200.0).abs() < 1e-9, "the sensing range");
            }
        }
    }
}

/// Tracks of every kind; no two kinds may look alike.
#[test]
fn kinds_of_tracks_have_different_colours() {
    let scenario = scenario(&["duration_s=2"]);
    let mut frame = frames(&scenario).pop().unwrap();
    let kinds = [
        (TrackStatus::Updated, MembershipState::Member),
        (TrackStatus::Updated, MembershipState::InHandoff),
        (TrackStatus::Updated, MembershipState::Removed),
        (TrackStatus::Updated, MembershipState::Ungrouped),
        (TrackStatus::Coasting, MembershipState::Member),
        (TrackStatus::Coasting, MembershipState::Removed),
    ];
    for (track, (status, place)) in frame.tracks.iter_mut().zip(kinds) {
        (track.status, track.membership, track.group) = (status, place, Some(0));
    }
    let bytes = written(&scenario, &[frame]);
    let (_, scene) = messages::<SceneUpdate>(&bytes, "/scene").pop().unwrap();
    let mut looks: Vec<_> = Vec::new();
    for (target, kind) in kinds.iter().enumerate() {
        let track = entity(&scene, &format!("track/{target}"));
        let look = (track.spheres[0].color.unwrap(), track.lines[0].color.unwrap());
        assert!(!looks.contains(&look), "{kind:?} looks like another kind");
        looks.push(look);
    }
    let label = |target| entity(&scene, &format!("track/{target}")).texts[0].text.clone();
    assert_eq!(
        (label(0), label(1), label(5)),
        ("target-0".to_owned(), "target-1, in-handoff".to_owned(), "target-5, removed, coasting".to_owned())
    );
}

#[test]
fn entities_that_no_longer_exist_are_deleted_once() {
    let scenario = scenario(&["duration_s=2"]);
    let mut frames = frames(&scenario);
    for frame in &mut frames[2..] {
        frame.truth.retain(|row| row.target != 3);
        frame.tracks.retain(|row| row.target != 5);
        frame.groups.clear();
    }
    let groups: Vec<_> = frames[1].groups.iter().map(|row| format!("group/{}", row.group)).collect();
    let bytes = written(&scenario, &frames);
    let scenes = messages::<SceneUpdate>(&bytes, "/scene");
    let deleted = |scene: &SceneUpdate| scene.deletions.iter().map(|gone| gone.id.clone()).collect::<Vec<_>>();
    let expected = [groups, vec!["track/5".to_owned(), "truth/3".to_owned()]].concat();
    let all: Vec<_> = scenes.iter().map(|(_, scene)| deleted(scene)).collect();
    assert_eq!(all, [vec![], vec![], expected, vec![], vec![]]);
    assert!(scenes[2].1.entities.iter().all(|entity| entity.id != "track/5"));
}

#[test]
fn uavs_in_georeferenced_scenarios_have_latitude_and_longitude() {
    let folder = tempfile::tempdir().unwrap();
    let traffic = folder.path().join("traffic.csv");
    let row = |i: i32| format!("{i},car,{},{}\n", 44.5 + f64::from(i) * 1e-5, 11.3);
    fs::write(&traffic, format!("t,id,lat,lon\n{}", (0..=10).map(row).collect::<String>())).unwrap();
    let overrides = Overrides { traffic: vec![traffic], ..Overrides::default() };
    let scenario = Scenario::load("traffic/convoy", &overrides, 1).unwrap();
    let frames = frames(&scenario);
    let bytes = written(&scenario, &frames);
    let fixes = messages::<LocationFix>(&bytes, "/uav/1/location");
    assert_eq!(fixes.len(), frames.len());
    for (frame, (_, fix)) in frames.iter().zip(fixes) {
        let row = &frame.uavs[1];
        // At 44.5 N a degree is 111 122 m along the meridian, 79 530 m along the parallel; the convergence of the
        // meridians and the curvature are below a metre here.
        let (north_m, east_m) = ((fix.latitude - 44.5) * 111_122.0, (fix.longitude - 11.3) * 79_530.0);
        assert!((north_m - row.y_m).abs() < 1.0 && (east_m - row.x_m).abs() < 1.0, "{fix:?}, {row:?}");
        let heading = standoff::Angle::from_rad(fix.heading.unwrap() + row.heading_rad);
        assert!((heading.deg() - 90.0).abs() < 1e-9, "clockwise from north");
    }
    let plane = self::scenario(&["duration_s=1"]);
    let bytes = written(&plane, &self::frames(&plane));
    assert!(messages::<LocationFix>(&bytes, "/uav/1/location").is_empty(), "a scenario in metres only has no location");
}

#[test]
fn plot_data_exist_for_every_frame() {
    let scenario = scenario(&["duration_s=5"]);
    let frames = frames(&scenario);
    let bytes = written(&scenario, &frames);
    let count = |topic: &str| {
        MessageStream::new(&bytes).unwrap().filter(|read| read.as_ref().unwrap().channel.topic == topic).count()
    };
    let of_group = |id| frames.iter().filter(|frame| frame.groups.iter().any(|row| row.group == id)).count();
    assert_eq!((count("/uav/0/state"), count("/uav/3/state")), (frames.len(), frames.len()));
    assert_eq!((count("/group/0/orbit"), count("/group/1/orbit")), (of_group(0), of_group(1)));
}

#[test]
fn the_file_contains_the_scenario_and_its_metadata() {
    let scenario = scenario(&["duration_s=1"]);
    let bytes = written(&scenario, &frames(&scenario));
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    let metadata = mcap::read::metadata(&bytes, &summary.metadata_indexes[0]).unwrap();
    let values = ["scenario", "seed", "duration_s", "period_s", "version"].map(|key| metadata.metadata[key].as_str());
    assert_eq!(values, [SCENARIO, "1", "1", "0.5", env!("CARGO_PKG_VERSION")]);
    let attachment = mcap::read::attachment(&bytes, &summary.attachment_indexes[0]).unwrap();
    assert_eq!(attachment.name, "scenario.toml");
    assert_eq!(attachment.data, scenario.resolved().unwrap().as_bytes());
}

#[test]
fn the_same_run_gives_the_same_bytes() {
    let scenario = scenario(&[]);
    let frames = frames(&scenario);
    assert!(written(&scenario, &frames) == written(&scenario, &frames));
}

/// Checks that a file cannot be created in a folder prepared by `make`, that the error message contains `expected`, and
/// that the folder stays unchanged.
fn check_refused(make: impl FnOnce(&Path) -> PathBuf, expected: &str) {
    let folder = tempfile::tempdir().unwrap();
    let path = make(folder.path());
    let before = names(&folder);
    let error = begin(&path, &scenario(&["duration_s=1"])).err().unwrap().to_string();
    assert!(error.contains(expected), "{error}");
    assert_eq!(names(&folder), before);
}

#[test]
fn files_other_than_mcap_are_not_overwritten() {
    let text = |name: &'static str| {
        move |folder: &Path| {
            fs::write(folder.join(name), "my thesis").unwrap();
            folder.join("a.mcap")
        }
    };
    check_refused(text("a.mcap"), "a.mcap is not an MCAP file and will not be overwritten; choose another file name");
    check_refused(text("a.mcap.partial"), "a.mcap.partial is not an MCAP file and will not be overwritten");
    check_refused(|folder| folder.to_owned(), "is a folder and will not be overwritten");
    check_refused(|folder| folder.join("none/a.mcap"), "none/a.mcap.partial: No such file or directory");
    check_refused(|_| PathBuf::from("/"), "does not name a file");
    #[cfg(unix)]
    check_refused(
        |folder| {
            fs::write(folder.join("thesis.tex"), "my thesis").unwrap();
            std::os::unix::fs::symlink("thesis.tex", folder.join("a.mcap.partial")).unwrap();
            folder.join("a.mcap")
        },
        "a.mcap.partial is not a regular file",
    );
}

#[test]
fn an_older_file_is_replaced_only_when_the_new_one_is_complete() {
    let scenario = scenario(&["duration_s=1"]);
    let frames = frames(&scenario);
    let older = written(&scenario, &frames[..1]);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    fs::write(&path, &older).unwrap();
    // The partial file of an interrupted run.
    fs::write(folder.path().join("a.mcap.partial"), &older[..200]).unwrap();
    let mut writer = begin(&path, &scenario).unwrap();
    frames.iter().for_each(|frame| writer.frame(frame).unwrap());
    assert_eq!(names(&folder), ["a.mcap", "a.mcap.partial"]);
    assert_eq!(fs::read(&path).unwrap(), older);
    writer.finish().unwrap();
    assert_eq!(names(&folder), ["a.mcap"]);
    assert!(fs::read(&path).unwrap() == written(&scenario, &frames));
}

#[test]
fn a_dropped_writer_deletes_its_file() {
    let scenario = scenario(&["duration_s=1"]);
    let folder = tempfile::tempdir().unwrap();
    let mut writer = begin(&folder.path().join("a.mcap"), &scenario).unwrap();
    writer.frame(&frames(&scenario)[0]).unwrap();
    drop(writer);
    assert!(names(&folder).is_empty());
}

#[test]
fn two_runs_cannot_write_the_same_file() {
    let scenario = scenario(&["duration_s=1"]);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let first = begin(&path, &scenario).unwrap();
    let error = begin(&path, &scenario).err().unwrap();
    assert!(matches!(error, McapError::InUse { .. }), "{error}");
    first.finish().unwrap();
    assert_eq!(names(&folder), ["a.mcap"]);
}

#[test]
fn a_file_that_cannot_be_renamed_is_kept() {
    let scenario = scenario(&["duration_s=1"]);
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.mcap");
    let writer = begin(&path, &scenario).unwrap();
    fs::write(&path, "another program's data").unwrap();
    let error = writer.finish().unwrap_err().to_string();
    assert!(error.contains("stays in") && error.contains("a.mcap.partial"), "{error}");
    assert_eq!(names(&folder), ["a.mcap", "a.mcap.partial"]);
    assert_eq!(fs::read_to_string(&path).unwrap(), "another program's data");
}
