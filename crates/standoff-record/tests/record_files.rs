//! Records as files: written data are read back unchanged, and foreign files are never touched.

#![expect(clippy::unwrap_used, reason = "a helper of a test may stop it as the test itself may")]

use std::fs;
use std::path::{Path, PathBuf};

use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;
use standoff::TeammateStatus;
use standoff_io::geodesy::Origin;
use standoff_record::{
    AgentEventRow, AgentRow, ByAgent, Counts, DetectionRow, EventRow, Frame, GroupRow, IntruderRow, Manifest,
    MembershipState, NO_TARGET, Occupancy, PerAgentTables, Record, RecordError, TeammateRow, TentativeRow, TrackRow,
    TrackStatus, TruthRow, UavRow, Writer, occupancy,
};
use tempfile::TempDir;

/// Tables that are read.
const TABLES: [&str; 7] = ["uavs", "truth", "tracks", "groups", "detections", "events", "targets"];

#[test]
fn frames_are_read_back_as_written() {
    let home = TempDir::new().unwrap();
    let dir = home.path().join("made/on the way/run");
    let frames = frames(40, 2, 4);
    write(&dir, &frames);

    let record = Record::open(&dir).unwrap();
    let rows = [
        ("uavs", 80),
        ("truth", 160),
        ("tracks", 160),
        ("groups", 40),
        ("detections", 77),
        ("events", 6),
        ("targets", 4),
        ("in_view", 0),
    ];
    let counts = Counts { time_steps: 40, rows: rows.map(|(table, rows)| (table.to_owned(), rows)).into() };
    assert_eq!(record.manifest(), &Manifest { counts: Some(counts), ..manifest() });
    assert_eq!(record.scenario_toml(), SCENARIO);
    assert_eq!(record.target_names(), ["lead", "second", "third", "größe"]);
    assert!(record.has_truth());
    assert_eq!(read(&dir).unwrap(), frames);
    assert!(!partial(&dir).exists());
}

#[test]
fn run_with_many_row_groups_is_read_back() {
    let home = TempDir::new().unwrap();
    let dir = home.path().join("run");
    let frames = frames(1_000, 2, 100);
    write_of(&dir, &names(100), &frames);
    let mut read = Record::open(&dir).unwrap().frames().unwrap();
    for frame in &frames {
        assert_eq!(&read.next().unwrap().unwrap(), frame);
    }
    assert!(read.next().is_none());
}

#[test]
fn tables_without_rows_are_read_back_empty() {
    let home = TempDir::new().unwrap();
    let dir = home.path().join("run");
    let frame = Frame { uavs: vec![uav(0, 1.0)], ..Frame::default() };
    write(&dir, std::slice::from_ref(&frame));
    assert_eq!(read(&dir).unwrap(), [frame]);
}

#[test]
fn rows_on_the_earth_have_their_place_and_time_and_are_read_back_as_others() {
    let home = TempDir::new().unwrap();
    let columns = |dir: &Path, table: &str| {
        let file = fs::File::open(dir.join(format!("{table}.parquet"))).unwrap();
        let reader = SerializedFileReader::new(file).unwrap();
        let names =
            reader.metadata().file_metadata().schema_descr().columns().iter().map(|column| column.name().to_owned());
        let added: Vec<String> =
            names.filter(|name| ["time_utc", "latitude_deg", "longitude_deg"].contains(&&**name)).collect();
        let row = reader.get_row_iter(None).unwrap().last().unwrap().unwrap();
        let values = row.get_column_iter().filter(|(name, _)| added.contains(name)).map(|(_, value)| value.clone());
        let values: Vec<Field> = values.collect();
        (added.join(" "), values)
    };
    // On the equator and the antimeridian.
    let origin = Some(Origin { latitude_deg: 0.0, longitude_deg: 180.0 });
    let far = Frame { time_us: 200_000, uavs: vec![UavRow { x_m: 1e7, ..uav(0, 1.0) }], ..Frame::default() };
    let near = UavRow { x_m: 111.319_490_789, y_m: -110.574_275_816, ..uav(0, 1.0) };
    let frames = [Frame { uavs: vec![near], detections: vec![DetectionRow::default()], ..Frame::default() }, far];
    for (origin, begin_unix_us) in
        [(None, None), (origin, None), (None, Some(5)), (origin, Some(1_772_366_400_000_000))]
    {
        let dir = home.path().join("run");
        let placed = Manifest { origin, begin_unix_us, ..manifest() };
        let mut writer = Writer::create(&dir, &placed, SCENARIO, &names(4)).unwrap();
        writer.frame(&frames[0]).unwrap();
        writer.checkpoint().unwrap();
        let unfinished = partial(&dir);
        assert_eq!(
            Record::open(&unfinished).unwrap().frames().unwrap().map(Result::unwrap).collect::<Vec<_>>(),
            frames[..1]
        );
        writer.frame(&frames[1]).unwrap();
        writer.finish().unwrap();
        assert_eq!(read(&dir).unwrap(), frames);
        let (uavs, last) = columns(&dir, "uavs");
        let time = if begin_unix_us.is_some() { "time_utc" } else { "" };
        let place = if origin.is_some() { "latitude_deg longitude_deg" } else { "" };
        assert_eq!(uavs, format!("{time} {place}").trim());
        assert_eq!(columns(&dir, "detections").0, time);
        // Further than 1000 km from the origin, the plane is no map of the Earth.
        assert!(last.iter().skip(usize::from(begin_unix_us.is_some())).all(|value| *value == Field::Null), "{last:?}");
        let mut writer = Writer::create(&dir, &placed, SCENARIO, &names(4)).unwrap();
        writer.frame(&frames[0]).unwrap();
        writer.finish().unwrap();
        let (_, mut values) = columns(&dir, "uavs");
        if begin_unix_us == Some(1_772_366_400_000_000) {
            assert_eq!(values.remove(0), Field::TimestampMicros(1_772_366_400_000_000));
            let [Field::Double(latitude_deg), Field::Double(longitude_deg)] = values[..] else { panic!("{values:?}") };
            assert!((latitude_deg + 0.001).abs() < 1e-9 && (longitude_deg + 179.999).abs() < 1e-9, "{values:?}");
        }
    }
}

#[test]
fn a_start_that_was_not_known_at_first_is_that_of_the_record() {
    let home = TempDir::new().unwrap();
    let dir = home.path().join("run");
    let placed = Manifest { begin_unix_us: Some(0), ..manifest() };
    let mut writer = Writer::create(&dir, &placed, SCENARIO, &names(4)).unwrap();
    writer.begin_at(7_000_000).unwrap();
    writer.frame(&Frame { uavs: vec![uav(0, 1.0)], ..Frame::default() }).unwrap();
    writer.checkpoint().unwrap();
    assert_eq!(Record::open(&partial(&dir)).unwrap().manifest().begin_unix_us, Some(7_000_000));
    writer.finish().unwrap();
    assert_eq!(Record::open(&dir).unwrap().manifest().begin_unix_us, Some(7_000_000));
}

#[test]
fn uavs_table_without_rows_is_reported_as_damaged() {
    let home = TempDir::new().unwrap();
    let (dir, empty) = (home.path().join("run"), home.path().join("empty"));
    write(&empty, &[]);
    write(&dir, &frames(10, 2, 4));
    fs::copy(empty.join("uavs.parquet"), dir.join("uavs.parquet")).unwrap();
    recount(&dir);
    for dir in [empty, dir] {
        let error = read(&dir).unwrap_err();
        assert!(error.to_string().contains("uavs.parquet is damaged: it has no rows"), "{error}");
    }
}

/// Checks that frames which `spoil` moves beyond the limits of their run are refused by the writer and the reader.
#[track_caller]
fn check_limits(spoil: impl Fn(&mut Frame), table: &str, expected: &str) {
    let home = TempDir::new().unwrap();
    let dir = home.path().join("run");
    let mut frames = frames(3, 2, 4);
    write(&dir, &frames);
    // In a longer run with more targets, the frames are valid.
    frames.iter_mut().for_each(&spoil);
    let (other, long) = (home.path().join("other"), Manifest::new("two", 1, 900.0, 0.2));
    let mut writer = Writer::create(&other, &long, SCENARIO, &names(6)).unwrap();
    frames.iter().for_each(|frame| writer.frame(frame).unwrap());
    writer.finish().unwrap();
    let mut writer = create(&home.path().join("refused")).unwrap();
    let refused = frames.iter().find_map(|frame| writer.frame(frame).err()).unwrap().to_string();
    assert!(refused.contains(expected), "{refused}");
    for table in ["uavs", "truth", "tracks", "groups", "detections", "events"] {
        fs::copy(other.join(format!("{table}.parquet")), dir.join(format!("{table}.parquet"))).unwrap();
    }
    recount(&dir);
    let error = read(&dir).unwrap_err().to_string();
    assert!(error.contains(&format!("{table}.parquet is damaged: ")) && error.contains(expected), "{error}");
}

#[test]
fn rows_beyond_the_run_are_refused_by_writer_and_reader() {
    let last_truth = |frame: &mut Frame| frame.truth.push(truth(4, 0.0));
    check_limits(last_truth, "truth", "it has target 4 at 0 s, but the run has 4 targets");
    let last_track = |frame: &mut Frame| {
        let unknown = frame.tracks.last().map(|row| TrackRow { target: 5, ..*row });
        frame.tracks.extend(unknown);
    };
    check_limits(last_track, "tracks", "it has target 5 at 0 s, but the run has 4 targets");
    let detection = DetectionRow { uav: 0, target: Some(4), range_m: 1.0, ..DetectionRow::default() };
    check_limits(|frame| frame.detections.push(detection), "detections", "it has target 4 at 0 s");
}

/// Tracks of no target have keys above those of all targets.
#[test]
fn tracks_of_no_target_are_read_back() {
    let dir = TempDir::new().unwrap();
    let mut frames = frames(3, 2, 4);
    for frame in &mut frames {
        let lone = frame.tracks[0];
        frame.tracks.push(TrackRow { target: NO_TARGET + 7, track: NO_TARGET + 7, ..lone });
        frame.events.push(EventRow { target: Some(NO_TARGET), ..EventRow::default() });
    }
    write(&dir.path().join("run"), &frames);
    assert_eq!(read(&dir.path().join("run")).unwrap(), frames);
}

/// Checks that tables of a run with another duration and period are refused in a run of 0.4 s with time steps of 0.2 s.
#[track_caller]
fn check_times(other: &Manifest, spoil: impl Fn(&mut Frame), table: &str, expected: &str) {
    let home = TempDir::new().unwrap();
    let (dir, other_dir) = (home.path().join("run"), home.path().join("other"));
    let mut frames = frames(3, 2, 4);
    write(&dir, &frames);
    frames.iter_mut().for_each(&spoil);
    let mut writer = Writer::create(&other_dir, other, SCENARIO, &names(4)).unwrap();
    frames.iter().for_each(|frame| writer.frame(frame).unwrap());
    writer.finish().unwrap();
    let path = dir.join(format!("{table}.parquet"));
    fs::copy(other_dir.join(format!("{table}.parquet")), path).unwrap();
    recount(&dir);
    let error = read(&dir).unwrap_err().to_string();
    assert!(error.contains(&format!("{table}.parquet is damaged: {expected}")), "{error}");
}

#[test]
fn rows_between_time_steps_are_refused_and_not_skipped() {
    let slow = Manifest::new("two", 1, 1e9, 0.3);
    let slower = |frame: &mut Frame| frame.time_us = frame.time_us / 2 * 3;
    check_times(
        &slow,
        slower,
        "uavs",
        "it has rows at 0.3 s instead of 0.2 s: time steps start at 0 s and are 0.2 s apart",
    );
    check_times(&slow, slower, "groups", "its rows at 0.3 s are out of order, or the uavs table has no rows");
    // Largest time in 64 bits, which a reader might use as the end of the run.
    let mut last = [frame(0, 2, 4), frame(7, 2, 4)];
    last[1].time_us = i64::MAX;
    let (home, endless) = (TempDir::new().unwrap(), Manifest::new("two", 1, 1e13, 1e13));
    let (dir, other) = (home.path().join("run"), home.path().join("other"));
    write(&dir, &last[..1]);
    let mut writer = Writer::create(&other, &endless, SCENARIO, &names(4)).unwrap();
    last.iter().for_each(|frame| writer.frame(frame).unwrap());
    writer.finish().unwrap();
    for table in ["truth", "tracks", "groups", "detections", "events"].map(|table| format!("{table}.parquet")) {
        let good = fs::read(dir.join(&table)).unwrap();
        fs::copy(other.join(&table), dir.join(&table)).unwrap();
        recount(&dir);
        let error = read(&dir).unwrap_err().to_string();
        assert!(error.contains(&format!("{table} is damaged: its rows at 9223372036854.")), "{error}");
        fs::write(dir.join(&table), good).unwrap();
    }
    let mut writer = create(&home.path().join("late")).unwrap();
    let error = writer.frame(&frame(2, 2, 4)).unwrap_err().to_string();
    assert!(error.contains("it has rows at 0.4 s instead of 0 s"), "{error}");
}

#[test]
fn missing_rows_and_time_steps_are_reported_with_the_table() {
    let home = TempDir::new().unwrap();
    let (dir, shorter) = (home.path().join("run"), home.path().join("shorter"));
    let frames = frames(10, 2, 4);
    for table in TABLES {
        write(&dir, &frames);
        // The last rows are removed such that no time step has too many.
        let names = names(if table == "targets" { 3 } else { 4 });
        let cut = |frame: &Frame| {
            let mut frame = frame.clone();
            match table {
                "uavs" => drop(frame.uavs.pop()),
                "truth" => drop(frame.truth.pop()),
                "tracks" => drop(frame.tracks.pop()),
                "groups" => drop(frame.groups.pop()),
                "detections" => drop(frame.detections.pop()),
                "events" => drop(frame.events.pop()),
                _ => frame = Frame { uavs: frame.uavs, time_us: frame.time_us, ..Frame::default() },
            }
            frame
        };
        write_of(&shorter, &names, &frames.iter().map(cut).collect::<Vec<_>>());
        let name = format!("{table}.parquet");
        fs::copy(shorter.join(&name), dir.join(&name)).unwrap();
        let read_rows = Record::open(&shorter).unwrap().manifest().counts.clone().unwrap().rows[table];
        let counted = Record::open(&dir).map_or(4, |record| record.manifest().counts.clone().unwrap().rows[table]);
        let error = read(&dir).unwrap_err().to_string();
        let expected = format!("{name} is damaged: it has {read_rows} rows, but run.json contains {counted}");
        assert!(error.contains(&expected) && read_rows < counted, "{error}");
    }

    write(&dir, &frames);
    let path = dir.join("run.json");
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, text.replace(r#""time_steps": 10"#, r#""time_steps": 11"#)).unwrap();
    let error = read(&dir).unwrap_err().to_string();
    assert!(error.contains("uavs.parquet is damaged: it has 10 time steps, but run.json contains 11"), "{error}");
    fs::write(&path, text.replace(r#""groups": 10"#, r#""groups ": 10"#)).unwrap();
    let error = read(&dir).unwrap_err().to_string();
    assert!(error.contains("groups.parquet is damaged: run.json does not contain"), "{error}");
}

#[test]
fn unfinished_record_must_end_at_its_checkpoint() {
    let home = TempDir::new().unwrap();
    let dir = home.path().join("run");
    for steps in [3, 5] {
        let mut writer = create(&dir.with_file_name(format!("run-{steps}"))).unwrap();
        frames(steps, 2, 4).iter().for_each(|frame| writer.frame(frame).unwrap());
        writer.stop().unwrap();
    }
    let (three, five) = (home.path().join("run-3.partial"), home.path().join("run-5.partial"));
    assert_eq!(read(&three).unwrap().len(), 3);
    for table in TABLES.map(|table| format!("{table}.parquet")) {
        fs::copy(three.join(&table), five.join(&table)).unwrap();
    }
    let error = read(&five).unwrap_err().to_string();
    assert!(error.contains("it ends at 0.4 s, but the checkpoint ends at 0.8 s"), "{error}");
}

#[test]
fn equal_frames_give_equal_bytes() {
    let home = TempDir::new().unwrap();
    let (one, other) = (home.path().join("one"), home.path().join("other"));
    let frames = frames(50, 2, 4);
    write(&one, &frames);
    write(&other, &frames);
    check_same(&one, &other);
    for file in listing(&one) {
        let bytes = fs::read(&file).unwrap();
        assert!(!contains(&bytes, b"parquet-rs"), "{file:?}");
        assert!(!contains(&bytes, home.path().to_str().unwrap().as_bytes()));
    }
}

#[test]
fn record_without_truth_has_frames_without_truth() {
    let home = TempDir::new().unwrap();
    let dir = home.path().join("run");
    let mut frames = frames(10, 2, 4);
    write(&dir, &frames);
    fs::remove_file(dir.join("truth.parquet")).unwrap();
    assert!(!Record::open(&dir).unwrap().has_truth());
    frames.iter_mut().for_each(|frame| frame.truth.clear());
    assert_eq!(read(&dir).unwrap(), frames);
}

/// Tables of several agents.
const OF_AGENTS: [&str; 5] = ["agents", "agent_tracks", "agent_groups", "agent_events", "agent_teammates"];

/// Frames without agents, with several agents, and without agents again.
fn frames_of_agents() -> Vec<Frame> {
    let make = |step| if (5..15).contains(&step) { frame_of_agents(step, 3, 4) } else { frame(step, 3, 4) };
    (0..20).map(make).collect()
}

#[test]
fn tables_of_several_agents_are_read_back() {
    let home = TempDir::new().unwrap();
    let dir = home.path().join("run");
    let flown = frames_of_agents();
    write(&dir, &flown);
    assert_eq!(read(&dir).unwrap(), flown);
    let record = Record::open(&dir).unwrap();
    let rows = record.manifest().counts.clone().unwrap().rows;
    assert!(record.has_agents());
    assert_eq!(OF_AGENTS.map(|table| rows[table]), [20, 80, 20, 4, 60]);
    assert_eq!(occupancy(&dir), Occupancy::OlderRun);
    // The tables may be removed together, but not individually.
    for table in OF_AGENTS.into_iter().rev() {
        fs::remove_file(dir.join(format!("{table}.parquet"))).unwrap();
        match read(&dir) {
            Err(error) => assert!(error.to_string().contains(&format!("{table}.parquet")), "{error}"),
            Ok(frames) => {
                assert_eq!(table, "agents");
                assert!(frames.iter().all(|frame| frame.agents == PerAgentTables::default()));
            }
        }
    }
    assert!(!Record::open(&dir).unwrap().has_agents());
}

#[test]
fn unfinished_record_of_several_agents_is_read_up_to_its_checkpoint() {
    let home = TempDir::new().unwrap();
    let dir = home.path().join("run");
    let flown = frames_of_agents();
    let mut writer = create(&dir).unwrap();
    let mut look = |steps: std::ops::Range<usize>, until: usize| {
        flown[steps].iter().for_each(|frame| writer.frame(frame).unwrap());
        if writer.kept().is_none_or(|kept| kept.until_s < flown[until - 1].time_us as f64 / 1e6) {
            writer.checkpoint().unwrap();
        }
        assert_eq!(read(&partial(&dir)).unwrap(), flown[..until]);
    };
    look(0..5, 5);
    // The tables of agents exist already, but the checkpoint is older.
    look(5..7, 5);
    look(7..12, 12);
    look(12..20, 20);
    let kept = writer.stop().unwrap().unwrap();
    assert_eq!(read(&kept.dir).unwrap(), flown);
}

/// The tables of intruders and tentative tracks begin at different times, in either order.
#[test]
fn optional_tables_are_read_up_to_their_checkpoint() {
    for begins in [[6, 12, 18], [18, 6, 12], [12, 18, 6]] {
        let home = TempDir::new().unwrap();
        let dir = home.path().join("run");
        let make = |step: u32| {
            let [intruders, tentative, agents] = begins.map(|begin| step >= begin);
            let track =
                |uid: u64| TentativeRow { track_uid: uid << 40, x_m: f64::from(step), ..TentativeRow::default() };
            Frame {
                intruders: Vec::from_iter(intruders.then(IntruderRow::default)),
                tentative: if tentative { (1..4).map(track).collect() } else { Vec::new() },
                ..if agents { frame_of_agents(step, 3, 4) } else { frame(step, 3, 4) }
            }
        };
        let flown: Vec<Frame> = (0..24).map(make).collect();
        let mut writer = create(&dir).unwrap();
        for (until, frame) in (1..).zip(&flown) {
            writer.frame(frame).unwrap();
            if until % 3 == 0 {
                writer.checkpoint().unwrap();
                assert_eq!(read(&partial(&dir)).unwrap(), flown[..until], "{begins:?}");
            }
        }
        writer.finish().unwrap();
        assert_eq!(read(&dir).unwrap(), flown);
        let record = Record::open(&dir).unwrap();
        assert!(record.has_tentative_tracks() && record.has_intruders());
        assert_eq!(record.manifest().counts.clone().unwrap().rows["tentative"], 3 * (24 - u64::from(begins[1])));
        fs::remove_file(dir.join("tentative.parquet")).unwrap();
        assert!(read(&dir).unwrap().iter().all(|frame| frame.tentative.is_empty()));
    }
}

/// Checks that rows of agents changed by `spoil` are refused by the reader.
#[track_caller]
fn check_agents(spoil: impl Fn(&mut PerAgentTables), table: &str, expected: &str) {
    let home = TempDir::new().unwrap();
    let [dir, other] = ["run", "other"].map(|name| home.path().join(name));
    let mut flown = frames_of_agents();
    write(&dir, &flown);
    spoil(&mut flown[6].agents);
    // In a run with more UAVs and targets, the rows are valid.
    flown.iter_mut().for_each(|frame| frame.uavs.push(uav(7, 1.0)));
    write_of(&other, &names(9), &flown);
    fs::copy(other.join(format!("{table}.parquet")), dir.join(format!("{table}.parquet"))).unwrap();
    recount(&dir);
    let error = read(&dir).unwrap_err().to_string();
    assert!(error.contains(&format!("{table}.parquet is damaged: {expected}")), "{error}");
}

#[test]
fn invalid_rows_of_agents_are_refused() {
    let unknown = "it has UAV 7 at 1.2 s, which is not in the uavs table up to that time";
    check_agents(|agents| agents.all.last_mut().unwrap().agent = 7, "agents", unknown);
    check_agents(|agents| agents.tracks.last_mut().unwrap().agent = 7, "agent_tracks", unknown);
    check_agents(|agents| agents.groups.last_mut().unwrap().agent = 7, "agent_groups", unknown);
    check_agents(|agents| agents.teammates.last_mut().unwrap().agent = 7, "agent_teammates", unknown);
    check_agents(|agents| agents.teammates.last_mut().unwrap().uav = 7, "agent_teammates", unknown);
    let target = "it has target 8 at 1.2 s, but the run has 4 targets";
    check_agents(|agents| agents.tracks.last_mut().unwrap().row.target = 8, "agent_tracks", target);
    let twice = "the ids of its rows at 1.2 s are not unique and ascending";
    check_agents(|agents| agents.all.reverse(), "agents", twice);
    check_agents(|agents| agents.tracks.extend_from_within(..1), "agent_tracks", twice);
    check_agents(|agents| agents.groups.extend_from_within(..1), "agent_groups", twice);
    check_agents(|agents| agents.teammates.extend_from_within(..1), "agent_teammates", twice);
}

#[test]
fn any_other_missing_file_is_named() {
    let home = TempDir::new().unwrap();
    let dir = home.path().join("run");
    let others = TABLES.iter().filter(|table| **table != "truth");
    let mut names: Vec<_> = others.map(|table| format!("{table}.parquet")).collect();
    names.push("scenario.toml".to_owned());
    for name in names {
        write(&dir, &frames(10, 2, 4));
        fs::remove_file(dir.join(&name)).unwrap();
        let error = read(&dir).unwrap_err();
        assert!(matches!(error, RecordError::Read { .. }), "{error}");
        assert!(error.to_string().contains(&name), "{error}");
        fs::write(dir.join(&name), "").unwrap();
    }
}

#[test]
fn damaged_bytes_never_cause_a_panic() {
    let home = TempDir::new().unwrap();
    let dir = home.path().join("run");
    write(&dir, &frames(5, 2, 4));
    let every: usize = std::env::var("DAMAGE_EVERY").map_or(53, |text| text.parse().unwrap());
    let mut errors = 0;
    for table in TABLES {
        let path = dir.join(format!("{table}.parquet"));
        let good = fs::read(&path).unwrap();
        for at in (0..good.len()).step_by(every) {
            for mask in [0x01, 0x80, 0xff] {
                let mut bad = good.clone();
                bad[at] ^= mask;
                fs::write(&path, bad).unwrap();
                errors += u32::from(read(&dir).is_err());
            }
            fs::write(&path, &good[..at]).unwrap();
            let error = read(&dir).unwrap_err();
            assert!(matches!(error, RecordError::Damaged { .. }), "{error}");
            assert!(error.to_string().contains(table), "{error}");
        }
        fs::write(&path, &good).unwrap();
    }
    assert!(errors > 0);
    assert!(read(&dir).is_ok());
}

#[test]
fn tables_of_different_runs_do_not_make_a_record() {
    let home = TempDir::new().unwrap();
    let (dir, longer) = (home.path().join("run"), home.path().join("longer"));
    write(&dir, &frames(10, 2, 4));
    write(&longer, &frames(11, 2, 4));
    fs::copy(longer.join("tracks.parquet"), dir.join("tracks.parquet")).unwrap();
    recount(&dir);
    let error = read(&dir).unwrap_err().to_string();
    assert!(error.contains("tracks.parquet is damaged"), "{error}");

    fs::copy(dir.join("groups.parquet"), dir.join("uavs.parquet")).unwrap();
    let error = read(&dir).unwrap_err().to_string();
    assert!(error.contains("column uav is missing"), "{error}");
}

#[test]
fn other_formats_are_refused_and_other_versions_are_read() {
    let home = TempDir::new().unwrap();
    let dir = home.path().join("run");
    write(&dir, &frames(1, 2, 4));
    let path = dir.join("run.json");
    let text = fs::read_to_string(&path).unwrap();
    let ours = format!(r#""version": "{}""#, manifest().version);

    fs::write(&path, text.replace(&ours, r#""version": "9.1.0""#)).unwrap();
    assert_eq!(Record::open(&dir).unwrap().manifest().version, "9.1.0");

    // Unit of the traffic.
    for (keys, expected) in [
        (r#""traffic_unit": "metres""#, Ok(Some("metres"))),
        (
            r#""traffic_unit": "degrees", "origin": {"latitude_deg": 44.5, "longitude_deg": 11.34567891}"#,
            Ok(Some("degrees, projected about 44.500000, 11.345679")),
        ),
        (
            r#""origin": {"latitude_deg": 44.5, "longitude_deg": 11.3}"#,
            Ok(Some("degrees, projected about 44.500000, 11.300000")),
        ),
        (r#""unfinished": false"#, Ok(None)),
        (r#""traffic_unit": "degrees""#, Err("traffic_unit and origin contradict each other")),
        (r#""traffic_unit": "feet""#, Err("unknown variant `feet`, expected `metres` or `degrees`")),
    ] {
        fs::write(&path, text.replace(&ours, &format!("{ours}, {keys}"))).unwrap();
        match (Record::open(&dir), expected) {
            (Ok(record), Ok(unit)) => assert_eq!(record.manifest().traffic_note().as_deref(), unit),
            (Err(error), Err(part)) => assert!(error.to_string().contains(part), "{error}"),
            (_, expected) => panic!("{keys}: expected {expected:?}"),
        }
    }

    let uncounted = text.replace("counts", "conts");
    fs::write(&path, &uncounted).unwrap();
    let error = Record::open(&dir).unwrap_err().to_string();
    assert!(error.contains("run.json is damaged: unknown field `conts`"), "{error}");
    fs::write(&path, &text).unwrap();
    // Records of other versions are refused by their format.
    for format in [2, 3, 4, 5, 6, 8] {
        fs::write(&path, text.replace(r#""format": 7"#, &format!(r#""format": {format}"#))).unwrap();
        let error = Record::open(&dir).unwrap_err().to_string();
        assert!(error.contains(&format!("format {format}")), "{error}");
        fs::write(&path, &text).unwrap();
    }
    let unfinished = text.replace(&ours, &format!(r#"{ours}, "unfinished": true"#));
    fs::write(&path, unfinished).unwrap();
    let error = Record::open(&dir).unwrap_err().to_string();
    assert!(error.contains("run.json is damaged: it must have counts if and only if the run is finished"), "{error}");
    fs::write(&path, &text).unwrap();

    for (what, expected) in [
        (r#""scenario": "two","scenario": "two""#, "duplicate field `scenario` at line 4 column 30"),
        (&format!(r#""scenario": "{}""#, "x".repeat(1001)), "has 1001 characters; at most 1000"),
    ] {
        fs::write(&path, text.replace(r#""scenario": "two""#, what)).unwrap();
        let error = Record::open(&dir).unwrap_err().to_string();
        assert!(error.contains("run.json is damaged") && error.contains(expected), "{error}");
    }

    let later = r#"{"format": 99, "version": "9.1.0", "wind": true}"#;
    fs::write(&path, later).unwrap();
    let error = Record::open(&dir).unwrap_err();
    assert!(matches!(error, RecordError::OtherFormat { format: 99, .. }));
    assert!(error.to_string().contains("9.1.0"), "{error}");
    assert_eq!(occupancy(&dir), Occupancy::OlderRun);

    fs::write(&path, text.replace("seed", "sead")).unwrap();
    let error = Record::open(&dir).unwrap_err();
    assert!(matches!(error, RecordError::Damaged { .. }), "{error}");
}

#[test]
fn folder_without_a_manifest_is_not_a_record() {
    let home = TempDir::new().unwrap();
    let error = Record::open(home.path()).unwrap_err();
    assert!(matches!(error, RecordError::NotARecord { .. }), "{error}");
    let error = Record::open(&home.path().join("nowhere")).unwrap_err();
    assert!(matches!(error, RecordError::Read { .. }), "{error}");
}

#[test]
fn older_run_with_figures_is_replaced_when_the_new_one_is_complete() {
    let home = TempDir::new().unwrap();
    let dir = home.path().join("run");
    assert_eq!(occupancy(&dir), Occupancy::Free);
    write(&dir, &frames(10, 2, 4));
    for name in ["summary.json", "report.html", "paths.svg"] {
        fs::write(dir.join(name), "old").unwrap();
    }
    assert_eq!(occupancy(&dir), Occupancy::OlderRun);

    let mut writer = create(&dir).unwrap();
    assert_eq!(read(&dir).unwrap().len(), 10);
    writer.frame(&frames(1, 2, 4)[0]).unwrap();
    let closed = writer.close().unwrap();
    assert_eq!(read(closed.dir()).unwrap().len(), 1);
    fs::write(closed.dir().join("summary.json"), "new").unwrap();
    closed.publish().unwrap();
    assert_eq!(read(&dir).unwrap().len(), 1);
    assert_eq!(fs::read_to_string(dir.join("summary.json")).unwrap(), "new");
    assert!(!dir.join("paths.svg").exists());
}

#[test]
fn foreign_files_are_refused_and_kept() {
    let home = TempDir::new().unwrap();
    let dir = home.path().join("run");
    let spoilers: [fn(&Path) -> &'static str; 4] = [
        |dir| fs::write(dir.join("notes.txt"), "mine").map(|()| "(notes.txt)").unwrap(),
        |dir| fs::create_dir(dir.join("old.svg")).map(|()| "(old.svg)").unwrap(),
        |dir| fs::remove_file(dir.join("run.json")).map(|()| "(run.json is missing or not that of a record)").unwrap(),
        |dir| fs::write(dir.join("run.json"), "{}").map(|()| "(run.json is missing or not that of a record)").unwrap(),
    ];
    for spoil in spoilers {
        write(&dir, &frames(1, 2, 4));
        let what = spoil(&dir);
        assert_eq!(occupancy(&dir), Occupancy::Other);
        let before = listing(&dir);
        let error = create(&dir).map(drop).unwrap_err();
        assert!(matches!(error, RecordError::Occupied { .. }) && error.to_string().contains(what), "{error}");
        assert_eq!(listing(&dir), before);
        assert!(!partial(&dir).exists());
        fs::remove_dir_all(&dir).unwrap();
    }
    fs::write(&dir, "a file").unwrap();
    assert!(matches!(create(&dir), Err(RecordError::Occupied { .. })));
    assert_eq!(fs::read_to_string(&dir).unwrap(), "a file");
}

#[test]
#[cfg(unix)]
fn link_to_a_run_is_not_followed() {
    let home = TempDir::new().unwrap();
    let (dir, link) = (home.path().join("run"), home.path().join("link"));
    write(&dir, &frames(1, 2, 4));
    std::os::unix::fs::symlink(&dir, &link).unwrap();
    assert_eq!(occupancy(&link), Occupancy::Other);
    assert!(matches!(create(&link), Err(RecordError::Occupied { .. })));
    assert_eq!(read(&link).unwrap().len(), 1);
}

#[test]
fn record_is_kept_if_its_destination_is_filled_meanwhile() {
    let home = TempDir::new().unwrap();
    let dir = home.path().join("run");
    let mut writer = create(&dir).unwrap();
    writer.frame(&frame(0, 2, 4)).unwrap();
    fs::create_dir(&dir).unwrap();
    fs::write(dir.join("notes.txt"), "mine").unwrap();
    let error = writer.finish().unwrap_err();
    assert!(matches!(error, RecordError::NotMoved { .. }), "{error}");
    assert!(dir.join("notes.txt").exists());
    assert_eq!(read(&partial(&dir)).unwrap(), frames(1, 2, 4));
}

#[test]
fn dropped_writer_leaves_no_files() {
    let home = TempDir::new().unwrap();
    let dir = home.path().join("run");
    let mut writer = create(&dir).unwrap();
    writer.frame(&frames(1, 2, 4)[0]).unwrap();
    assert!(partial(&dir).exists());
    drop(writer);
    assert_eq!(listing(home.path()), Vec::<PathBuf>::new());
    assert_eq!(create(&dir).unwrap().stop().unwrap(), None);
    assert_eq!(listing(home.path()), Vec::<PathBuf>::new());
}

/// Some row groups are in the file and some rows are not: the tables of targets have both here, the other tables only
/// the latter.
#[test]
fn interrupted_record_is_read_up_to_its_last_checkpoint() {
    let home = TempDir::new().unwrap();
    let dir = home.path().join("run");
    let flown = frames(1_000, 2, 100);
    let mut writer = Writer::create(&dir, &manifest(), SCENARIO, &names(100)).unwrap();
    writer.checkpoint().unwrap();
    assert_eq!(writer.kept(), None, "there is no frame to keep yet");
    flown[..700].iter().for_each(|frame| writer.frame(frame).unwrap());
    writer.checkpoint().unwrap();
    let kept_frames = |writer: &Writer| {
        let kept = writer.kept().unwrap();
        assert_eq!(kept.dir, partial(&dir));
        1 + flown.iter().position(|frame| frame.time_us as f64 / 1e6 == kept.until_s).unwrap()
    };
    assert_eq!(kept_frames(&writer), 700);
    let look = |count: usize| {
        let record = Record::open(&partial(&dir)).unwrap();
        assert!(record.manifest().unfinished);
        assert_eq!(record.manifest().title(), format!("two, seed {}, unfinished", u64::MAX));
        assert_eq!(record.ends_s(), Some(flown[count - 1].time_us as f64 / 1e6));
        assert_eq!(record.target_names(), &names(100)[..]);
        assert_eq!(record.target_rows().unwrap(), 100 * count as u64);
        assert!(record.frames().unwrap().map(Result::unwrap).eq(flown[..count].iter().cloned()));
    };
    // On a slow machine, a second may pass, after which the writer makes another checkpoint.
    flown[700..720].iter().for_each(|frame| writer.frame(frame).unwrap());
    let count = kept_frames(&writer);
    look(count);
    drop(writer);
    look(count);
    assert_eq!(listing(home.path()), [partial(&dir)]);
}

#[test]
fn stopped_record_is_complete_up_to_its_last_frame() {
    let home = TempDir::new().unwrap();
    let dir = home.path().join("run");
    let flown = frames(20, 2, 4);
    let mut writer = create(&dir).unwrap();
    flown.iter().for_each(|frame| writer.frame(frame).unwrap());
    let kept = writer.stop().unwrap().unwrap();
    assert_eq!((&kept.dir, kept.until_s), (&partial(&dir), flown[19].time_us as f64 / 1e6));
    assert_eq!(read(&kept.dir).unwrap(), flown);
    let whole = home.path().join("whole");
    write(&whole, &flown);
    for table in TABLES.map(|table| format!("{table}.parquet")) {
        assert_eq!(fs::read(kept.dir.join(&table)).unwrap(), fs::read(whole.join(&table)).unwrap(), "{table}");
    }
}

#[test]
fn checkpoints_do_not_change_the_record() {
    let home = TempDir::new().unwrap();
    let (dir, plain) = (home.path().join("run"), home.path().join("plain"));
    let flown = frames(1_000, 2, 100);
    write_of(&plain, &names(100), &flown);
    let mut writer = Writer::create(&dir, &manifest(), SCENARIO, &names(100)).unwrap();
    for (frame, nth) in flown.iter().zip(0..) {
        writer.frame(frame).unwrap();
        if nth % 300 == 0 {
            writer.checkpoint().unwrap();
        }
    }
    writer.finish().unwrap();
    check_same(&dir, &plain);
    assert_eq!(Record::open(&dir).unwrap().ends_s(), None);
}

#[test]
fn damaged_and_missing_checkpoints_give_different_errors() {
    let home = TempDir::new().unwrap();
    let dir = home.path().join("run");
    unfinished(&dir, 3);
    let path = partial(&dir).join("checkpoint");
    let good = fs::read(&path).unwrap();
    for at in (0..good.len()).step_by(97) {
        let mut bad = good.clone();
        bad[at] ^= 0x10;
        for bytes in [&bad[..], &good[..at]] {
            fs::write(&path, bytes).unwrap();
            let error = read(&partial(&dir)).unwrap_err();
            assert!(matches!(error, RecordError::Damaged { .. }), "{error}");
            assert!(error.to_string().contains("checkpoint"), "{error}");
        }
    }
    fs::write(&path, &good).unwrap();
    assert_eq!(read(&partial(&dir)).unwrap().len(), 3);
    fs::remove_file(&path).unwrap();
    let error = read(&partial(&dir)).unwrap_err();
    assert!(matches!(error, RecordError::NothingKept { .. }), "{error}");
}

#[test]
fn unfinished_run_is_kept_until_the_next_one_is_complete() {
    let home = TempDir::new().unwrap();
    let dir = home.path().join("run");
    let older = dir.with_file_name("run.standoff-older");
    unfinished(&dir, 3);

    let mut writer = create(&dir).unwrap();
    assert_eq!(writer.set_aside(), Some(&*older));
    assert_eq!(read(&older).unwrap(), frames(3, 2, 4));
    drop(writer);
    assert_eq!(listing(home.path()), [&*older], "a run without a checkpoint replaces nothing");

    unfinished(&dir, 5);
    writer = create(&dir).unwrap();
    assert_eq!(read(&older).unwrap().len(), 5);
    writer.finish().unwrap();
    assert_eq!(listing(home.path()), [dir]);
}

/// State after a process was killed at each step of a replacement; then the next run starts and completes.
#[test]
fn replacement_interrupted_at_any_step_loses_and_mixes_nothing() {
    let moves: [&[(&str, &str)]; 4] = [
        &[("old", "run"), ("new", "run.partial")],
        &[("old", "run.standoff-older"), ("new", "run.partial")],
        &[("old", "run.standoff-older"), ("new", "run")],
        &[("new", "run.partial")],
    ];
    for moves in moves {
        let home = TempDir::new().unwrap();
        let place = |name: &str| home.path().join(name);
        write(&place("old"), &frames(1, 2, 4));
        write(&place("new"), &frames(2, 2, 4));
        moves.iter().for_each(|(from, to)| fs::rename(place(from), place(to)).unwrap());
        let _ = fs::remove_dir_all(place("old"));
        let mut writer = create(&place("run")).unwrap();
        writer.frame(&frame(0, 2, 4)).unwrap();
        assert_eq!(writer.set_aside(), None);
        assert_eq!(read(&place("run")).unwrap().len(), 2, "{moves:?}");
        assert_eq!(listing(home.path()), [place("run"), place("run.partial")], "{moves:?}");
        writer.finish().unwrap();
        assert_eq!(read(&place("run")).unwrap().len(), 1);
        assert_eq!(listing(home.path()), [place("run")]);
    }
}

#[test]
fn stale_temporary_folder_is_removed_unless_it_has_foreign_files() {
    let home = TempDir::new().unwrap();
    let dir = home.path().join("run");
    unfinished(&dir, 1);
    fs::remove_file(partial(&dir).join("checkpoint")).unwrap();
    drop(create(&dir).unwrap());
    assert_eq!(listing(home.path()), Vec::<PathBuf>::new());

    for taken in [partial(&dir), dir.with_file_name("run.standoff-older")] {
        fs::create_dir(&taken).unwrap();
        fs::write(taken.join("notes.txt"), "mine").unwrap();
        assert!(matches!(create(&dir), Err(RecordError::Occupied { .. })));
        assert!(taken.join("notes.txt").exists());
        fs::remove_dir_all(&taken).unwrap();
    }
}

/// File systems limit names to 255 bytes, and the suffix for unfinished records takes up to 15.
#[test]
fn folder_name_too_long_for_the_suffix_is_refused() {
    let home = TempDir::new().unwrap();
    let (longest, longer) = (home.path().join("x".repeat(240)), home.path().join("x".repeat(241)));
    for _ in 0..2 {
        write(&longest, &frames(1, 2, 4));
    }
    for dir in [longer, home.path().join("é".repeat(128)), home.path().join("x".repeat(300))] {
        let error = create(&dir).map(drop).unwrap_err();
        assert!(matches!(error, RecordError::LongName { .. }) && error.is_wrong_input(), "{error}");
        assert!(error.to_string().contains(" bytes; at most 240, because standoff appends a suffix"), "{error}");
    }
}

#[test]
fn two_runs_cannot_write_one_record() {
    let home = TempDir::new().unwrap();
    let dir = home.path().join("run");
    let first = create(&dir).unwrap();
    assert!(matches!(create(&dir), Err(RecordError::InUse { .. })));
    first.finish().unwrap();
    assert!(create(&dir).is_ok());
}

#[test]
fn unwritable_destination_gives_an_error() {
    let home = TempDir::new().unwrap();
    let file = home.path().join("file");
    fs::write(&file, "").unwrap();
    // A folder can never be created below a file, even by root (the tests may run as root).
    let error = create(&file.join("run")).err().unwrap();
    assert!(error.to_string().contains("file"), "{error}");
    assert!(matches!(create(Path::new("/")), Err(RecordError::NoName { .. })));
}

#[test]
fn non_finite_number_is_refused_and_ends_the_record() {
    let home = TempDir::new().unwrap();
    let dir = home.path().join("run");
    let mut writer = create(&dir).unwrap();
    let mut flown = frames(3, 2, 4);
    flown[2].tracks[1].covariance[6] = f64::NAN;
    flown[..2].iter().for_each(|frame| writer.frame(frame).unwrap());
    let error = writer.frame(&flown[2]).unwrap_err();
    let RecordError::NotFinite { table, column, time_s } = error else {
        panic!("{error}");
    };
    assert_eq!((table, column.as_str()), ("tracks", "cov_vx_vx"));
    assert!((time_s - 0.4).abs() < 1e-12);
    assert!(writer.frame(&frames(1, 2, 4)[0]).is_err());
    assert!(writer.finish().is_err());
    assert!(!dir.exists() && !partial(&dir).exists());

    let mut endless = manifest();
    endless.duration_s = f64::INFINITY;
    assert!(matches!(Writer::create(&dir, &endless, SCENARIO, &names(4)), Err(RecordError::NotFinite { .. })));
}

#[test]
fn ids_beyond_31_bits_are_refused() {
    let home = TempDir::new().unwrap();
    let good = frames(1, 2, 4).remove(0);
    let mut bad = [good.clone(), good.clone(), good];
    bad[0].uavs[0].uav = u32::MAX;
    bad[1].tracks[0].group = Some(1 << 31);
    bad[2].events[0].uavs = vec![0, 1 << 31];
    for frame in bad {
        let mut writer = create(&home.path().join("run")).unwrap();
        let error = writer.frame(&frame).unwrap_err();
        assert!(matches!(error, RecordError::TooLarge { .. }), "{error}");
    }
}

#[test]
fn frames_out_of_order_or_without_uavs_are_refused() {
    let home = TempDir::new().unwrap();
    let frames = frames(2, 2, 4);
    for bad in
        [vec![frames[1].clone(), frames[0].clone()], vec![frames[0].clone(), frames[0].clone()], vec![Frame::default()]]
    {
        let mut writer = create(&home.path().join("run")).unwrap();
        let error = bad.iter().try_for_each(|frame| writer.frame(frame));
        assert!(matches!(error, Err(RecordError::BadFrame { .. })));
    }
}

const SCENARIO: &str = "name = \"two\"\n";

fn manifest() -> Manifest {
    Manifest::new("two", u64::MAX, 600.0, 0.2)
}

fn names(targets: usize) -> Vec<String> {
    ["lead", "second", "third", "größe"].into_iter().cycle().take(targets).map(str::to_owned).collect()
}

fn create(dir: &Path) -> Result<Writer, RecordError> {
    Writer::create(dir, &manifest(), SCENARIO, &names(4))
}

fn write(dir: &Path, frames: &[Frame]) {
    write_of(dir, &names(4), frames);
}

fn write_of(dir: &Path, names: &[String], frames: &[Frame]) {
    let mut writer = Writer::create(dir, &manifest(), SCENARIO, names).unwrap();
    for frame in frames {
        writer.frame(frame).unwrap();
    }
    writer.finish().unwrap();
}

/// Makes the counts of the manifest agree with the tables, so that only the tables themselves can be refused.
fn recount(dir: &Path) {
    let path = dir.join("run.json");
    let mut json: serde_json::Value = serde_json::from_str(&fs::read_to_string(&path).unwrap()).unwrap();
    for (table, count) in json["counts"]["rows"].as_object_mut().unwrap() {
        let file = fs::File::open(dir.join(format!("{table}.parquet"))).unwrap();
        *count = SerializedFileReader::new(file).unwrap().metadata().file_metadata().num_rows().into();
    }
    fs::write(&path, serde_json::to_string_pretty(&json).unwrap()).unwrap();
}

/// Leaves the files of a run that ended after this number of frames.
fn unfinished(dir: &Path, steps: u32) {
    let mut writer = create(dir).unwrap();
    frames(steps, 2, 4).iter().for_each(|frame| writer.frame(frame).unwrap());
    writer.checkpoint().unwrap();
}

/// Checks that two records have the same files with the same bytes.
fn check_same(one: &Path, other: &Path) {
    let names = |dir| listing(dir).iter().map(|path| path.file_name().unwrap().to_owned()).collect::<Vec<_>>();
    assert_eq!(names(one).len(), 10);
    assert_eq!(names(one), names(other));
    for name in names(one) {
        assert!(fs::read(one.join(&name)).unwrap() == fs::read(other.join(&name)).unwrap(), "{name:?}");
    }
}

fn read(dir: &Path) -> Result<Vec<Frame>, RecordError> {
    Record::open(dir)?.frames()?.collect()
}

fn partial(dir: &Path) -> PathBuf {
    dir.with_file_name("run.partial")
}

fn listing(dir: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(dir).unwrap();
    let mut paths: Vec<_> = entries.map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    paths
}

fn contains(bytes: &[u8], text: &[u8]) -> bool {
    bytes.windows(text.len()).any(|window| window == text)
}

/// Frames with values of every kind, present and absent.
fn frames(steps: u32, uavs: u32, targets: u32) -> Vec<Frame> {
    (0..steps).map(|step| frame(step, uavs, targets)).collect()
}

fn frame(step: u32, uavs: u32, targets: u32) -> Frame {
    let t = f64::from(step) * 0.2;
    let status = [TrackStatus::Cued, TrackStatus::Updated, TrackStatus::Coasting];
    let happened = step.is_multiple_of(7);
    Frame {
        intruders: Vec::new(),
        tentative: Vec::new(),
        time_us: i64::from(step) * 200_000,
        uavs: (0..uavs).map(|id| uav(id, t)).collect(),
        truth: (0..targets).map(|id| truth(id, t)).collect(),
        tracks: (0..targets)
            .map(|id| TrackRow {
                track_uid: id.is_multiple_of(2).then_some(u64::from(id) << 50),
                target: id,
                track: 1_000 - id,
                status: status[((id + step) % 3) as usize],
                membership: [
                    MembershipState::Ungrouped,
                    MembershipState::Member,
                    MembershipState::InHandoff,
                    MembershipState::Removed,
                ][((id + step) % 4) as usize],
                group: id.is_multiple_of(2).then_some(id),
                receiving_group: id.is_multiple_of(3).then_some(step),
                state: std::array::from_fn(|i| t * (i as f64 + 0.1) - f64::from(id)),
                covariance: std::array::from_fn(|i| 1.0 / (t + i as f64 + 1.0)),
            })
            .collect(),
        groups: vec![GroupRow {
            group: 0,
            members: targets,
            x_m: t * 10.0,
            y_m: -t,
            vx_m_s: 10.0,
            vy_m_s: -1.0,
            spread_m: 80.0 + t.sqrt(),
            margin_m: 50.0,
            standoff_unclamped_m: 312.5 + t,
            standoff_distance_m: 300.0,
            standoff_rate_m_s: -0.0,
            turn_limit_m: step.is_multiple_of(3).then_some(150.0),
            feasible: step.is_multiple_of(2),
            convergence_threshold_m2_s: step.is_multiple_of(4).then_some(-5.0 - t),
            altitude_m: 1500.0,
            nearest_groupmate_m: step.is_multiple_of(5).then_some(400.0 + t),
            group_uid: step.is_multiple_of(2).then_some(u64::from(step) << 40),
        }],
        detections: (0..uavs.min(step))
            .map(|uav| DetectionRow {
                uav,
                target: (!step.is_multiple_of(7)).then_some(step % targets),
                range_m: 400.0 + t.sqrt(),
                bearing_rad: -1.0 + 0.01 * t,
                range_rate_m_s: step.is_multiple_of(3).then_some(0.5 - t),
            })
            .collect(),
        events: Vec::from_iter(happened.then(|| EventRow {
            intruder: None,
            track_uid: step.is_multiple_of(4).then_some((1 << 63) - u64::from(step) - 1),
            kind: "lost".to_owned(),
            target: step.is_multiple_of(2).then_some(step % targets),
            group: None,
            to_group: step.is_multiple_of(4).then_some(step),
            uavs: (0..step % 3).collect(),
            reason: "hidden — no line of sight".to_owned(),
            track: step.is_multiple_of(3).then_some(step),
            cause: step.is_multiple_of(4).then(|| "hidden".to_owned()),
            into_group: None,
            members: Some(step),
            coverable_targets: step.is_multiple_of(5).then_some(3),
            dwell_s: step.is_multiple_of(2).then_some(0.1 * t),
            required_radius_m: Some(t.sqrt()),
            allowed_radius_m: None,
            threshold_m2_s: Some(-1e4 * t),
            limit_m2_s: step.is_multiple_of(3).then_some(-6e3),
            speed_m_s: Some(f64::MIN_POSITIVE),
            limit_m_s: None,
            distance_m: Some(1.0 / (1.0 + t)),
            group_id: step.is_multiple_of(3).then_some(1 << 62),
            to_group_id: None,
            clear_fraction: Some(0.4),
            zone: Some(1),
        })),
        agents: PerAgentTables::default(),
    }
}

/// A frame with several agents that share the same estimates: all UAVs except one, which changes every time step.
fn frame_of_agents(step: u32, uavs: u32, targets: u32) -> Frame {
    let frame = frame(step, uavs, targets);
    let mut agents = PerAgentTables::default();
    for agent in (0..uavs).filter(|uav| *uav != step % uavs) {
        agents.all.push(AgentRow {
            agent,
            committed_us: agent.is_multiple_of(2).then_some(frame.time_us - 400_000),
            link_degraded: step.is_multiple_of(2),
            sent_messages: 2,
            sent_bytes: u64::from(step) << 33,
            retransmission_limited: step.is_multiple_of(3).then_some(step.is_multiple_of(2)),
        });
        agents.tracks.extend(frame.tracks.iter().map(|row| ByAgent { agent, row: *row }));
        agents.groups.extend(frame.groups.iter().map(|row| ByAgent { agent, row: *row }));
        let provisional = agent == 1;
        agents.events.extend(frame.events.iter().map(|event| AgentEventRow {
            agent,
            event_time_us: -frame.time_us,
            provisional,
            event: event.clone(),
        }));
        let status = [
            None,
            Some(TeammateStatus::Live),
            Some(TeammateStatus::Silent),
            Some(TeammateStatus::TimedOut),
            Some(TeammateStatus::Left),
        ];
        agents.teammates.extend((0..uavs).map(|uav| TeammateRow {
            agent,
            uav,
            status: status[(uav + step) as usize % status.len()],
            last_report_us: uav.is_multiple_of(2).then_some(frame.time_us),
            group: uav.is_multiple_of(3).then_some(0),
            group_id: uav.is_multiple_of(3).then_some(7 << 40),
        }));
    }
    Frame { agents, ..frame }
}

fn uav(id: u32, t: f64) -> UavRow {
    let known = |value: f64| (t > 1.0).then_some(value);
    UavRow {
        uav: id,
        group: (t > 0.5).then_some(0),
        x_m: 1e3 + 40.0 * t,
        y_m: f64::from(id) * 100.0 + t.sqrt(),
        heading_rad: 0.1 * t % 3.0,
        speed_m_s: 40.0,
        turn_rate_rad_s: f64::MIN_POSITIVE,
        boresight_rad: known(0.3),
        speed_command_m_s: 41.0,
        turn_rate_command_rad_s: -0.2,
        speed_limited: id == 0,
        turn_rate_limited: t > 3.0,
        centre_distance_m: known(300.0 + t),
        phase_rad: known(-2.0),
        steered_radius_m: known(301.0),
        desired_heading_rad: known(1.0 / (1.0 + t)),
        feedforward_rad_s: None,
        convergence_threshold_m2_s: known(-5.0),
        commanded_altitude_m: known(1500.0),
        ..UavRow::default()
    }
}

fn truth(id: u32, t: f64) -> TruthRow {
    TruthRow {
        target: id,
        x_m: f64::from(id) * 20.0 + 10.0 * t,
        y_m: t.sqrt(),
        vx_m_s: 10.0,
        vy_m_s: 0.0,
        ax_m_s2: id.is_multiple_of(2).then_some(0.1),
        ay_m_s2: None,
    }
}
