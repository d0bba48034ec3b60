//! CZML: paths that move with the clock of the globe, outlines and gaps in their time.

use serde_json::{Value, json};

use super::model::{Export, Fix};

pub(super) fn text(export: &Export) -> String {
    let interval = |begin_s: f64, end_s: f64| format!("{}/{}", export.utc(begin_s), export.utc(end_s));
    let clock = json!({"interval": interval(0.0, export.end_s), "currentTime": export.utc(0.0), "multiplier": 1});
    let document = json!({"id": "document", "name": export.name, "version": "1.0", "clock": clock});
    let samples = |fix: &Fix| [fix.time_s, fix.at[0], fix.at[1], fix.altitude_m.unwrap_or(0.0)];
    let paths = export.paths.iter().enumerate().filter_map(|(index, path)| {
        let (first, last) = (path.fixes.first()?, path.fixes.last()?);
        let color = json!({"rgba": if path.kind == "uav" { [160, 60, 200, 255] } else { [230, 120, 20, 255] }});
        Some(json!({
            "id": format!("{} {index}", path.kind), "name": path.name,
            "availability": interval(first.time_s, last.time_s),
            "position": {"epoch": export.utc(0.0),
                "cartographicDegrees": path.fixes.iter().flat_map(samples).collect::<Vec<_>>()},
            "point": {"pixelSize": 8, "color": color}, "label": {"text": path.name, "pixelOffset": {"cartesian2": [12, 0]},
                "horizontalOrigin": "LEFT", "scale": 0.5},
            "path": {"leadTime": 0, "trailTime": 60, "material": {"solidColor": {"color": color}}},
        }))
    });
    let outlines = export.outlines.iter().enumerate().map(|(index, of)| {
        let points: Vec<f64> = of.ring.iter().flat_map(|at| [at[0], at[1], 0.0]).collect();
        json!({
            "id": format!("outline {index}"), "name": format!("{}: {}", of.name, of.kind),
            "availability": interval(of.begin_s, of.end_s),
            "polyline": {"positions": {"cartographicDegrees": points}, "clampToGround": true, "width": 1},
        })
    });
    let gaps = export.gaps.iter().enumerate().map(|(index, gap)| {
        json!({
            "id": format!("gap {index}"), "name": format!("{}: gap, {}", gap.name, gap.cause),
            "availability": interval(gap.begin_s, gap.end_s),
            "position": {"cartographicDegrees": [gap.at[0], gap.at[1], 0.0]},
            "point": {"pixelSize": 10, "color": {"rgba": [220, 0, 0, 255]}},
        })
    });
    Value::Array(core::iter::once(document).chain(paths).chain(outlines).chain(gaps).collect()).to_string()
}
