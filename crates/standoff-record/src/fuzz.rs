//! Fuzz targets (`bolero`) for records and their manifests. See [`crate::fuzz_harness`].

use std::fs;
use std::path::Path;

use crate::common::{track_row, uav_row};
use crate::fuzz_harness::{JSON, corpus, put, refused, run};
use crate::{
    AgentEventRow, AgentRow, ByAgent, EventRow, Frame, Manifest, PerAgentTables, Record, TeammateRow, TrackRow, UavRow,
    Writer,
};

/// Writes a small record.
fn write(dir: &Path) {
    let uav = UavRow { x_m: 1.0, y_m: -2.0, boresight_rad: None, centre_distance_m: Some(100.0), ..uav_row(0) };
    let track = TrackRow { state: [1.0, 0.5, 0.0, 2.0, 0.25, 0.0], covariance: [1.0; 21], ..track_row(0, Some(1)) };
    let event = EventRow {
        kind: "cued".to_owned(),
        target: Some(0),
        to_group: Some(1),
        uavs: vec![0, 1],
        reason: "handed over".to_owned(),
        ..EventRow::default()
    };
    let all = [0, 1].map(|agent| AgentRow {
        agent,
        committed_us: Some(-500_000),
        link_degraded: agent == 0,
        sent_messages: 1,
        sent_bytes: 1 << 40,
        retransmission_limited: (agent == 0).then_some(true),
    });
    let (status, last_report_us, group, group_id) =
        (Some(standoff::TeammateStatus::Silent), Some(0), Some(1), Some(1 << 62));
    let agents = PerAgentTables {
        all: all.into(),
        tracks: vec![ByAgent { agent: 1, row: track }],
        groups: Vec::new(),
        events: vec![AgentEventRow { agent: 0, event_time_us: -1, provisional: true, event: event.clone() }],
        teammates: vec![TeammateRow { agent: 0, uav: 1, status, last_report_us, group, group_id }],
    };
    let frame = |time_us| Frame {
        time_us,
        uavs: vec![uav, UavRow { uav: 1, ..uav }],
        tracks: vec![track],
        events: vec![event.clone()],
        agents: agents.clone(),
        ..Frame::default()
    };
    let mut writer =
        Writer::create(dir, &Manifest::new("s", 1, 1.0, 0.5), "about = \"\"\n", &["lead".to_owned()]).unwrap();
    [0, 500_000, 1_000_000].into_iter().for_each(|time_us| writer.frame(&frame(time_us)).unwrap());
    writer.close().unwrap().publish().unwrap();
}

#[test]
fn any_record_is_read_or_refused() {
    let home = tempfile::tempdir().unwrap();
    let dir = home.path().join("run");
    write(&dir);
    let tables = ["uavs", "tracks", "events", "targets", "agents", "agent_tracks", "agent_events", "agent_teammates"];
    let tables = tables.map(|table| format!("{table}.parquet"));
    let files: Vec<_> = ["run.json", "scenario.toml"]
        .into_iter()
        .chain(tables.iter().map(String::as_str))
        .map(|name| dir.join(name))
        .collect();
    let good: Vec<Vec<u8>> = files.iter().map(|path| fs::read(path).unwrap()).collect();
    run("record", 0.05, |choices| {
        let which = choices.below(files.len());
        put(&files[which], choices.damaged(good[which].clone()));
        let frames = Record::open(&dir).and_then(|record| record.frames()?.take(1000).collect::<Result<Vec<_>, _>>());
        put(&files[which], &good[which]);
        match frames {
            Ok(frames) => {
                assert!(frames.iter().all(|frame| frame.time_us >= 0));
                assert!(frames.is_sorted_by(|a, b| a.time_us < b.time_us));
                true
            }
            Err(error) => refused(&error),
        }
    });
}

#[test]
fn any_manifest_is_read_or_refused() {
    let home = tempfile::tempdir().unwrap();
    let dir = home.path().join("run");
    write(&dir);
    let files = corpus("manifest");
    run("manifest", 0.05, |choices| {
        put(&dir.join("run.json"), choices.mutated(&files, &JSON));
        match Manifest::read(&dir) {
            Ok(manifest) => {
                assert!((0.0..=1e9).contains(&manifest.duration_s) && manifest.period_s > 0.0);
                true
            }
            Err(error) => refused(&error),
        }
    });
}
