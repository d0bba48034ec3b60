//! Simplifies a map until it fits into a page.

use std::collections::BTreeMap;

use simplify_polyline::{Point as Vertex, simplify};
use standoff_io::net_projection::NEAR_M;

use crate::encode::{Contents, Layer, Packed};
use crate::feature_class::Kind;
use crate::geometry::{Bounds, Form, Point, Shape};
use crate::limits::{MAX_PACKED, MAX_PIECE, TOLERANCE_M, TOLERANCE_MAX_M};
use crate::projection::Placed;

/// Attribution that OpenStreetMap's data require.
const CREDIT: &str = "\u{a9} OpenStreetMap contributors";

/// Rounding step of line widths, m.
const WIDTH_STEP_M: f64 = 0.5;

/// Packs a map, simplified as far as necessary.
pub(crate) fn fit(placed: Placed, is_of_openstreetmap: bool) -> Result<Packed, String> {
    let Placed { shapes, of } = placed;
    let credit = is_of_openstreetmap.then(|| CREDIT.to_owned());
    let mut tolerance_m = TOLERANCE_M;
    while tolerance_m < TOLERANCE_MAX_M {
        let contents = Contents::new(credit.clone(), layers(&shapes, tolerance_m));
        if let Some(gz) = contents.packed() {
            let far = of - shapes.len();
            let mut left_out = Vec::new();
            if far > 0 {
                left_out.push(format!(
                    "{far} of {of} lines and areas are omitted because they are more than {:.0} km from the run",
                    NEAR_M / 1e3
                ));
            }
            if tolerance_m > TOLERANCE_M {
                left_out.push(format!(
                    "lines have a tolerance of {tolerance_m} m and smaller areas are omitted, to fit into the page"
                ));
            }
            let note = (!left_out.is_empty()).then(|| format!("the map is simplified: {}", left_out.join("; ")));
            return Ok(Packed { gz, note });
        }
        tolerance_m *= 2.0;
    }
    let most = MAX_PACKED / 1_000;
    Err(format!("has too many lines and areas to fit into {most} kB; crop the map to the area of the vehicles"))
}

fn layers(shapes: &[Shape], tolerance_m: f64) -> Vec<Layer> {
    let mut layers: BTreeMap<(Kind, i64), Layer> = BTreeMap::new();
    for Shape { kind, form, name } in shapes {
        let steps = match form {
            Form::Line(width_m, _) => (width_m / WIDTH_STEP_M).round().max(1.0) as i64,
            Form::Area(_) => 0,
        };
        let layer = layers.entry((*kind, steps)).or_insert_with(|| Layer {
            kind: *kind,
            width_m: steps as f64 * WIDTH_STEP_M,
            lines: Vec::new(),
            areas: Vec::new(),
            names: BTreeMap::new(),
        });
        match form {
            Form::Line(_, line) => {
                let Some(line) = delta_encoded(&thinned(line, tolerance_m)) else { continue };
                if let Some(name) = name {
                    layer.names.entry(name.to_string()).or_default().push(layer.lines.len() as u32);
                }
                layer.lines.push(line);
            }
            Form::Area(rings) => {
                let is_seen = |ring: &&Vec<Point>| {
                    Bounds::of(ring.iter().copied()).is_some_and(|Bounds([west, south, east, north])| {
                        tolerance_m <= TOLERANCE_M || (east - west).max(north - south) >= 2.0 * tolerance_m
                    })
                };
                // If the outer ring is too small, the holes are omitted as well.
                if !rings.first().is_some_and(|ring| is_seen(&ring)) {
                    continue;
                }
                let rings = rings.iter().filter(is_seen).flat_map(|ring| delta_encoded(&thinned(ring, tolerance_m)));
                let rings: Vec<_> = rings.filter(|ring| ring.len() >= 8).collect();
                if !rings.is_empty() {
                    layer.areas.push(rings);
                }
            }
        }
    }
    layers.into_values().filter(|layer| !(layer.lines.is_empty() && layer.areas.is_empty())).collect()
}

/// Simplifies a line to a tolerance. It is processed in pieces, because the worst case takes quadratic time and a
/// recursion depth equal to the number of points.
fn thinned(line: &[Point], tolerance_m: f64) -> Vec<Point> {
    let mut kept: Vec<Point> = Vec::new();
    let mut from = 0;
    while from + 1 < line.len() {
        let to = (from + MAX_PIECE).min(line.len() - 1);
        let piece: Vec<Vertex<2, f64>> = line[from..=to].iter().map(|&vec| Vertex { vec }).collect();
        let piece = simplify(&piece, tolerance_m, true);
        kept.extend(piece.iter().skip(usize::from(from > 0)).map(|vertex| vertex.vec));
        from = to;
    }
    kept
}

/// Converts a line to whole decimetres and delta-encodes it; merges equal consecutive points.
fn delta_encoded(line: &[Point]) -> Option<Vec<i32>> {
    let whole = line.iter().map(|point| point.map(|value| (value * 10.0).round() as i32));
    let (mut delta_encoded, mut before): (Vec<i32>, Option<[i32; 2]>) = (Vec::new(), None);
    for point in whole {
        if before == Some(point) {
            continue;
        }
        let [x, y] = before.unwrap_or_default();
        delta_encoded.extend([point[0] - x, point[1] - y]);
        before = Some(point);
    }
    (delta_encoded.len() >= 4).then_some(delta_encoded)
}
