//! GeoJSON (RFC 7946): paths as lines, outlines as polygons, gaps as points. Times are ISO 8601.
//!
//! Lines and polygons over the antimeridian continue beyond 180 degrees, because flat maps would draw them around the world.

use serde_json::{Value, json};

use super::model::{Degrees, Export, Fix};

pub(super) fn text(export: &Export) -> String {
    let point =
        |fix: &Fix, first: &Fix| continued(fix.at, first.at).into_iter().chain(fix.altitude_m).collect::<Vec<f64>>();
    let paths = export.paths.iter().filter(|path| path.fixes.len() > 1).map(|path| {
        let times: Vec<_> = path.fixes.iter().map(|fix| export.utc(fix.time_s)).collect();
        let sds_m: Option<Vec<f64>> = path.fixes.iter().map(|fix| fix.position_sd_m).collect();
        let points: Vec<_> = path.fixes.iter().map(|fix| point(fix, &path.fixes[0])).collect();
        feature(
            &json!({"type": "LineString", "coordinates": points}),
            json!({"kind": path.kind, "name": path.name, "begin": times.first(), "end": times.last(), "times": times,
                "position_sd_m": sds_m}),
        )
    });
    let outlines = export.outlines.iter().map(|of| {
        let ring: Vec<_> = of.ring.iter().map(|at| continued(*at, of.ring[0])).collect();
        feature(
            &json!({"type": "Polygon", "coordinates": [ring]}),
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

/// Moves a point by a turn if that brings it nearer to another one.
fn continued([longitude_deg, latitude_deg]: Degrees, near: Degrees) -> Degrees {
    let turns = ((near[0] - longitude_deg) / 360.0).round();
    [longitude_deg + 360.0 * turns, latitude_deg]
}

fn feature(geometry: &Value, properties: Value) -> Value {
    json!({"type": "Feature", "geometry": geometry, "properties": properties})
}
