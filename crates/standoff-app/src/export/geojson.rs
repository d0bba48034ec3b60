//! GeoJSON (RFC 7946): paths as lines, outlines as polygons, gaps as points. Times are ISO 8601.

use serde_json::{Value, json};

use super::model::{Export, Fix};

pub(super) fn text(export: &Export) -> String {
    let point = |fix: &Fix| fix.at.into_iter().chain(fix.altitude_m).collect::<Vec<f64>>();
    let paths = export.paths.iter().filter(|path| path.fixes.len() > 1).map(|path| {
        let times: Vec<_> = path.fixes.iter().map(|fix| export.utc(fix.time_s)).collect();
        let sds_m: Option<Vec<f64>> = path.fixes.iter().map(|fix| fix.position_sd_m).collect();
        feature(
            &json!({"type": "LineString", "coordinates": path.fixes.iter().map(point).collect::<Vec<_>>()}),
            json!({"kind": path.kind, "name": path.name, "begin": times.first(), "end": times.last(), "times": times,
                "position_sd_m": sds_m}),
        )
    });
    let outlines = export.outlines.iter().map(|of| {
        feature(
            &json!({"type": "Polygon", "coordinates": [of.ring]}),
            json!({"kind": of.kind, "name": of.name, "begin": export.utc(of.begin_s), "end": export.utc(of.end_s)}),
        )
    });
    let gaps = export.gaps.iter().map(|gap| {
        feature(
            &json!({"type": "Point", "coordinates": gap.at}),
            json!({"kind": "gap", "name": gap.name, "begin": export.utc(gap.begin_s), "end": export.utc(gap.end_s),
                "cause": gap.cause}),
        )
    });
    let features: Vec<Value> = paths.chain(outlines).chain(gaps).collect();
    json!({"type": "FeatureCollection", "features": features}).to_string()
}

fn feature(geometry: &Value, properties: Value) -> Value {
    json!({"type": "Feature", "geometry": geometry, "properties": properties})
}
