//! Columns and rows that depend on the truth: other programs can compute metrics from them without any geometry.

use std::collections::BTreeSet;
use std::fs::File;
use std::path::Path;

use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;
use standoff::math::{cos, sin};
use standoff_record::Record;
use standoff_score::FrameScorer;

use crate::common::{frames, load, writer};

/// Returns these columns of a table: the rows, with null as NaN.
fn columns<const N: usize>(dir: &Path, table: &str, names: [&str; N]) -> Vec<[f64; N]> {
    let file = File::open(dir.join(table).with_extension("parquet")).unwrap();
    let reader = SerializedFileReader::new(file).unwrap();
    let number = |field: &Field| match field {
        Field::Double(value) => *value,
        Field::Int(value) => f64::from(*value),
        Field::UInt(value) => f64::from(*value),
        Field::Long(value) => *value as f64,
        Field::Null => f64::NAN,
        other => panic!("{table}: {other:?} is not a number"),
    };
    let rows = reader.get_row_iter(None).unwrap();
    rows.map(|row| {
        let row = row.unwrap();
        names.map(|name| number(row.get_column_iter().find(|(column, _)| *column == name).unwrap().1))
    })
    .collect()
}

#[test]
fn tables_contain_the_inputs_of_the_metrics() {
    let home = tempfile::tempdir().unwrap();
    let dir = home.path().join("run");
    let scenario = load("paper/table-2-pair", &[], 3);
    let score_config = scenario.settings.score_config();
    let mut scorer = FrameScorer::new(score_config.clone());
    let mut writer = writer(&dir, &scenario).deriving(move |frame| scorer.derived_columns(frame));
    let frames = frames(&scenario);
    frames.iter().for_each(|frame| writer.frame(frame).unwrap());
    writer.finish().unwrap();
    let metrics = crate::score_fixtures::score(&score_config, &frames);

    let errors_m = columns(&dir, "uavs", ["standoff_error_m"]).into_iter().map(|[error_m]| error_m);
    let errors_m: Vec<f64> = errors_m.filter(|error_m| !error_m.is_nan()).collect();
    let mean_m = errors_m.iter().map(|error_m| error_m.abs()).sum::<f64>() / errors_m.len() as f64;
    assert_eq!(Some(mean_m), metrics["standoff_error_m"]);
    assert!(errors_m.iter().any(|error_m| *error_m < 0.0) && errors_m.iter().any(|error_m| *error_m > 0.0));

    let tracks = columns(&dir, "tracks", ["group", "position_error_m"]).into_iter();
    let members = tracks.filter(|[group, error_m]| !group.is_nan() && !error_m.is_nan());
    let errors_m: Vec<f64> = members.map(|[_, error_m]| error_m).collect();
    assert_eq!(Some(errors_m.iter().sum::<f64>() / errors_m.len() as f64), metrics["position_error_m"]);

    let views = columns(&dir, "in_view", ["time_us", "uav", "target", "range_m", "off_boresight_rad"]);
    let seen: BTreeSet<(i64, u32)> =
        views.iter().map(|[time_us, _, target, ..]| (*time_us as i64, *target as u32)).collect();
    let steps = (frames.len() - 1) * frames[0].truth.len();
    assert_eq!(Some(seen.len() as f64 / steps as f64), metrics["in_view_fraction"]);
    for [time_us, uav, target, range_m, off_boresight_rad] in &views {
        let frame = frames.iter().find(|frame| frame.time_us == *time_us as i64).unwrap();
        let (uav, truth) = (frame.uavs[*uav as usize], frame.truth[*target as usize]);
        let direction_rad = uav.boresight_rad.unwrap() + off_boresight_rad;
        let (dx_m, dy_m) = (range_m * cos(direction_rad), range_m * sin(direction_rad));
        assert!((uav.x_m + dx_m - truth.x_m).abs() < 1e-6 && (uav.y_m + dy_m - truth.y_m).abs() < 1e-6);
        assert!(off_boresight_rad.abs() <= score_config.sensor.half_field_of_view_rad());
    }
    assert!(views.iter().any(|[.., off_boresight_rad]| *off_boresight_rad < 0.0));
    let counts = Record::open(&dir).unwrap().manifest().counts.clone().unwrap();
    assert_eq!(counts.rows["in_view"], views.len() as u64);
}
