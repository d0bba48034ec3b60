//! Transforms maps from their frame to the plane of a run.
//!
//! For traffic in metres, the plane is that of the net: both have the same x, y, unless the traffic is in the net's
//! projection (UTM), which lacks the `netOffset`. For traffic in degrees, it is the
//! plane tangent to the Earth at the origin: the net's `netOffset` is subtracted, and its projection is inverted.

use standoff_io::display_text::printable;
use standoff_io::geodesy::{LocalPlane, Origin, wrapped};
use standoff_io::net_projection::{Location, NEAR_M, Projected, finite, has_projection};
use standoff_io::text_source::Fault;

use crate::error::{MapError, named};
use crate::geometry::{Bounds, Form, Point, Shape, Shapes};

/// Size below which a line or an area is not drawn, m: the resolution of a packed map.
const SEEN_M: f64 = 0.1;

/// Plane and bounds of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Place {
    /// Point where its plane touches the Earth, if known.
    pub origin: Option<Origin>,
    /// Bounds of its vehicles and UAVs in the plane, m.
    pub bounds: Bounds,
}

/// Contents of a file.
#[derive(Debug)]
pub(crate) struct Read {
    /// In the frame of `location`, or in metres without one. Separate shapes are in degrees: longitude, latitude.
    pub(crate) shapes: Shapes,
    pub(crate) location: Option<Location>,
    /// True for a net. Traffic is in the frame of its net.
    pub(crate) is_net: bool,
    pub(crate) is_of_openstreetmap: bool,
}

/// Shapes in the plane of a run.
#[derive(Debug, Default)]
pub(crate) struct Placed {
    pub(crate) shapes: Vec<Shape>,
    /// Total number of shapes, including omitted ones.
    pub(crate) of: usize,
}

/// Transforms all shapes to the plane of a run and drops those that are too far from it. Fails if a frame cannot be
/// transformed, or if no shape of a file is near the run or large enough to be drawn.
pub(crate) fn all(files: Vec<(String, Read)>, place: &Place) -> Result<Placed, MapError> {
    let nets = files.iter().filter(|(_, file)| file.is_net);
    let located = nets.chain(&files).find_map(|(name, file)| Some((name.clone(), location_of_run(file, place)?)));
    let near = place.bounds.grown(NEAR_M);
    let mut placed = Placed::default();
    for (name, file) in files {
        let named = |fault| named(&name)(fault);
        let Read { shapes: Shapes { all: shapes, in_degrees, .. }, location, .. } = file;
        placed.of += shapes.len() + in_degrees.len();
        let before = placed.shapes.len();
        let (mut spans, mut is_seen): (Option<Bounds>, bool) = (None, false);
        let mut take = |shapes: Vec<Shape>, to: &dyn Fn(Point) -> Option<Point>| {
            for Shape { kind, form, name } in shapes {
                let Some(form) = moved(form, to) else { continue };
                let Some(bounds) = Bounds::of(form.points().copied()) else { continue };
                spans = Bounds::of(spans.iter().flat_map(|spans| spans.corners()).chain(bounds.corners()));
                if bounds.touches(near) {
                    is_seen |= !bounds.is_smaller_than(SEEN_M);
                    placed.shapes.push(Shape { kind, form, name });
                }
            }
        };
        if !shapes.is_empty() {
            let to = of_frame(location.as_ref(), located.as_ref(), place).map_err(named)?;
            take(shapes, &*to);
        }
        if !in_degrees.is_empty() {
            let to = of_degrees(located.as_ref(), place).map_err(named)?;
            take(in_degrees, &*to);
        }
        if placed.shapes.len() == before {
            // Zero has no sign in the message.
            let shown = |Bounds(sides): Bounds| sides.map(|side| side.round() + 0.0);
            let [west, south, east, north] = shown(place.bounds);
            let spans = spans.map(shown).map_or_else(String::new, |[w, s, e, n]| {
                format!("; it spans x = {w:.0} to {e:.0} m, y = {s:.0} to {n:.0} m")
            });
            let message = format!(
                "no part of it is within {:.0} km of the run, which is at x = {west:.0} to {east:.0} m, y = {south:.0} to \
                 {north:.0} m{spans}; is it a map of another place, or in another frame?",
                NEAR_M / 1e3
            );
            return Err(named(Fault::whole(message)));
        }
        if !is_seen {
            let message = format!(
                "nothing of it is left, because all its lines and areas near the run are smaller than {SEEN_M} m; are its \
                 coordinates in another unit or frame?"
            );
            return Err(named(Fault::whole(message)));
        }
    }
    Ok(placed)
}

/// Returns the frame of a run over a net.
fn location_of_run(net: &Read, place: &Place) -> Option<Location> {
    let location = net.location.clone()?;
    if place.origin.is_some() {
        return Some(location);
    }
    let near = place.bounds.grown(NEAR_M);
    let spans = Bounds::of(net.shapes.all.iter().flat_map(|shape| shape.form.points().copied()));
    let is_near = |by_m| spans.is_some_and(|spans| spans.shifted(by_m).touches(near));
    Some(location.of_traffic(is_near))
}

type To = Box<dyn Fn(Point) -> Option<Point>>;

fn plane(place: &Place) -> Result<Option<LocalPlane>, Fault> {
    let plane = place.origin.map(|origin| origin.plane()).transpose();
    plane.map_err(|error| Fault::whole(format!("the origin of the run is not a place on the Earth: {error}")))
}

/// Projects degrees onto the tangent plane.
fn onto(plane: LocalPlane, [lon_deg, lat_deg]: Point) -> Option<Point> {
    plane.position(lat_deg, lon_deg).ok().map(|at| [at.x_m(), at.y_m()])
}

/// Returns the transformation from the frame of a file in metres.
fn of_frame(own: Option<&Location>, located: Option<&(String, Location)>, place: &Place) -> Result<To, Fault> {
    // Without a frame, coordinates are metres in the plane.
    let Some(own) = own else { return Ok(Box::new(finite)) };
    if let Some(plane) = plane(place)? {
        let own = Projected::of(own)?;
        return Ok(Box::new(move |point| onto(plane, own.degrees(point)?)));
    }
    match located {
        // Nets with other offsets are shifted to that of the first net.
        Some((_, first)) if first.projection == own.projection => {
            let by = [0, 1].map(|axis| first.offset_m[axis] - own.offset_m[axis]);
            Ok(Box::new(move |[x, y]| finite([x + by[0], y + by[1]])))
        }
        Some((_, first)) if has_projection(first) && has_projection(own) => {
            let (first, own) = (Projected::of(first)?, Projected::of(own)?);
            Ok(Box::new(move |point| first.metres(own.degrees(point)?)))
        }
        _ => Ok(Box::new(finite)),
    }
}

/// Returns the transformation from degrees.
fn of_degrees(located: Option<&(String, Location)>, place: &Place) -> Result<To, Fault> {
    if let Some(plane) = plane(place)? {
        return Ok(Box::new(move |point| onto(plane, wrapped(point))));
    }
    let Some((name, first)) = located.filter(|(_, first)| has_projection(first)) else {
        let what = "its coordinates are in degrees, but the run is in metres and its location on the Earth is unknown";
        let advice = "give the SUMO net of the traffic as well (--map town.net.xml --map buildings.geojson; it needs a \
                      projection), or use traffic in degrees (sumo --fcd-output.geo)";
        return Err(Fault::whole(format!("{what}; {advice}")));
    };
    let first = Projected::of(first).map_err(|fault| Fault::whole(format!("with {}: {fault}", printable(name))))?;
    Ok(Box::new(move |point| first.metres(wrapped(point))))
}

fn moved(form: Form, to: &dyn Fn(Point) -> Option<Point>) -> Option<Form> {
    let line = |line: Vec<Point>| line.into_iter().map(to).collect::<Option<Vec<_>>>();
    Some(match form {
        Form::Line(width_m, points) => Form::Line(width_m, line(points)?),
        Form::Area(rings) => Form::Area(rings.into_iter().map(line).collect::<Option<_>>()?),
    })
}

impl Bounds {
    fn shifted(self, [x_m, y_m]: [f64; 2]) -> Self {
        let [west, south, east, north] = self.0;
        Self([west + x_m, south + y_m, east + x_m, north + y_m])
    }

    fn corners(self) -> [Point; 2] {
        let [west, south, east, north] = self.0;
        [[west, south], [east, north]]
    }
}
