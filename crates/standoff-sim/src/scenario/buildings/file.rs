//! Reads buildings from files: GeoJSON and SUMO polygons.

use std::io::Read;

use quick_xml::events::BytesStart;
use serde_json::Value;
use standoff_io::bounded_input::size;
use standoff_io::display_text::{printable, quoted};
use standoff_io::geodesy::Origin;
use standoff_io::text_source::xml::{Elements, attributes, walk};
use standoff_io::text_source::{Fault, NOT_UNICODE, NOT_UTF_8, Position, Text, input_fault};
use standoff_score::{BUILDING_HEIGHT_MAX_M, BUILDING_VERTICES_MAX, BUILDINGS_MAX};

use super::super::earth::Earth;
use super::super::polygons::{GeoJson, Rings, check_metres, rings};
use super::outline::Outline;

/// Maximum size of a GeoJSON text, bytes, because all of it is in memory: ten times that of the maximum number of
/// buildings.
const GEOJSON_MAX: u64 = 16 << 20;

/// Height of a storey, m.
const STOREY_M: f64 = 3.0;

/// Properties with a height, m, then those with a number of storeys; the first one counts.
const HEIGHTS: [&str; 3] = ["height_m", "height", "building:height"];
const STOREYS: [&str; 2] = ["building:levels", "levels"];

/// Root elements of SUMO files with polygons.
const ROOTS: [&str; 3] = ["additional", "polygons", "shapes"];

/// Buildings of a file, and what the user should know about them.
#[derive(Debug)]
pub(super) struct Contents {
    pub(super) buildings: Vec<Outline>,
    pub(super) notes: Vec<String>,
}

/// Reads buildings. Degrees are converted to the plane at `origin`, that of the traffic in degrees; without it, the file
/// is in the metres of the scenario.
pub(super) fn read(mut text: Text<'_>, origin: Option<Origin>) -> Result<Contents, Fault> {
    let plane = origin.map(Origin::plane).transpose().map_err(|error| Fault::whole(error.to_string()))?;
    let (plane, is_metric) = (plane.map(Earth::Plane), plane.is_none());
    let shapes = match text.first_byte()? {
        Some(b'<') => sumo(text, plane)?,
        Some(b'{') => geojson(text, plane.as_ref())?,
        _ => {
            let message = "is neither GeoJSON nor SUMO polygons: must start with { or <; convert it with ogr2ogr or \
                           polyconvert";
            return Err(Fault::at(text.position(), message.to_owned()));
        }
    };
    // Maps contain other areas, too. If a file names its buildings, the others are none.
    let has_named = shapes.all.iter().any(|shape| shape.is_building);
    let (mut buildings, mut without_height) = (Vec::new(), 0);
    for shape in shapes.all.iter().filter(|shape| shape.is_building || !has_named) {
        let outline = Outline::of_m(shape.height_m, &shape.rings_m);
        let fault = |message: String| match shape.position {
            Some(position) => Fault::at(position, message),
            None => Fault::whole(message),
        };
        let called = format!("building {}", buildings.len());
        if is_metric {
            check_metres(&shape.rings_m).map_err(|message| fault(format!("{called} {message}")))?;
        }
        let checked = outline.check();
        checked.map_err(|message| fault(format!("{called}: {message}; remove or correct it")))?;
        without_height += usize::from(outline.height_cm.is_none());
        buildings.push(outline);
    }
    if buildings.is_empty() {
        return Err(Fault::whole("contains no polygon; must contain the outlines of buildings".to_owned()));
    }
    let count = buildings.len();
    let heights =
        format!("{without_height} of {count} buildings have no height: they are world.building_height_m high");
    let others = shapes.others + shapes.all.len() - count;
    let ignored = format!("ignores {others} of its shapes, which are not buildings");
    let notes = [(without_height, heights), (others, ignored)];
    Ok(Contents { buildings, notes: notes.into_iter().filter(|(n, _)| *n > 0).map(|(_, note)| note).collect() })
}

/// Shapes of a file.
#[derive(Default)]
struct ShapesOfFile {
    /// Polygons.
    all: Vec<ShapeOfFile>,
    vertices: usize,
    /// Number of points and lines.
    others: usize,
}

/// A polygon of a file, in the plane of the scenario.
struct ShapeOfFile {
    /// Position in the file, if it is known.
    position: Option<Position>,
    /// True if the file calls it a building, or gives it a height.
    is_building: bool,
    height_m: Option<f64>,
    rings_m: Rings,
}

impl ShapesOfFile {
    fn add(&mut self, shape: ShapeOfFile) -> Result<(), String> {
        self.vertices += shape.rings_m.iter().map(Vec::len).sum::<usize>();
        self.all.push(shape);
        check_numbers(self.all.len(), self.vertices)
    }
}

/// Describes too many vertices or buildings.
fn check_numbers(buildings: usize, vertices: usize) -> Result<(), String> {
    if buildings <= BUILDINGS_MAX && vertices <= BUILDING_VERTICES_MAX {
        return Ok(());
    }
    Err(format!(
        "has more than {BUILDINGS_MAX} buildings, or {BUILDING_VERTICES_MAX} vertices; crop the file to the area of the \
         vehicles"
    ))
}

/// Returns the height in metres, with or without their unit; `None` if it is none of a building.
fn height_m(text: &str) -> Option<f64> {
    let text = text.trim();
    let number = text.strip_suffix('m').unwrap_or(text).trim_end().parse::<f64>().ok();
    number.filter(|height_m| *height_m > 0.0 && *height_m <= BUILDING_HEIGHT_MAX_M)
}

/// Returns the height of the first property that has one.
fn height_of(property: impl Fn(&str) -> Option<String>) -> Option<f64> {
    let of = |keys: &[&str], scale_m: f64| {
        keys.iter().find_map(|key| height_m(&property(key)?)).and_then(|value| height_m(&(value * scale_m).to_string()))
    };
    of(&HEIGHTS, 1.0).or_else(|| of(&STOREYS, STOREY_M))
}

fn geojson(text: Text<'_>, plane: Option<&Earth>) -> Result<ShapesOfFile, Fault> {
    let mut bytes = Vec::new();
    let read = text.in_one_piece().take(GEOJSON_MAX + 1).read_to_end(&mut bytes);
    read.map_err(|error| input_fault(None, &error))?;
    if bytes.len() as u64 > GEOJSON_MAX {
        let what = "crop the file to the area of the vehicles, or use SUMO polygons";
        return Err(Fault::whole(format!("has more than {} of GeoJSON; {what}", size(GEOJSON_MAX))));
    }
    let json: Value = serde_json::from_slice(&bytes).map_err(|error| {
        let position = Position { line: error.line() as u64, column: error.column() as u64 };
        let reason = error.to_string();
        let message = match reason.starts_with(NOT_UNICODE) {
            true => NOT_UTF_8.to_owned(),
            false => format!("not JSON: {}; cut off or damaged? create the file again", printable(&reason)),
        };
        Fault::at(position, message)
    })?;
    let mut shapes = ShapesOfFile::default();
    collect(&json, None, plane, &mut shapes).map_err(Fault::whole)?;
    Ok(shapes)
}

/// Reads the polygons of a part of GeoJSON in a feature with these properties.
fn collect(
    object: &Value,
    properties: Option<&Value>,
    plane: Option<&Earth>,
    shapes: &mut ShapesOfFile,
) -> Result<(), String> {
    let property = |key: &str| match properties?.get(key)? {
        Value::Null => None,
        Value::String(text) => Some(text.clone()),
        other => Some(other.to_string()),
    };
    match GeoJson::of(object)? {
        GeoJson::Collection(parts) => parts.iter().try_for_each(|part| collect(part, properties, plane, shapes)),
        GeoJson::Feature(geometry) => {
            geometry.map_or(Ok(()), |geometry| collect(geometry, object.get("properties"), plane, shapes))
        }
        GeoJson::Polygons(polygons) => polygons.iter().try_for_each(|coordinates| {
            let height_m = height_of(property);
            let is_building =
                ["building", "building:part"].iter().any(|key| property(key).is_some_and(|is| is != "no"));
            let rings_m =
                rings(coordinates, plane).map_err(|message| format!("building {}: {message}", shapes.all.len()))?;
            shapes.add(ShapeOfFile {
                position: None,
                is_building: is_building || height_m.is_some(),
                height_m,
                rings_m,
            })
        }),
        GeoJson::Other(_) => {
            shapes.others += 1;
            Ok(())
        }
    }
}

fn sumo(text: Text<'_>, plane: Option<Earth>) -> Result<ShapesOfFile, Fault> {
    let mut file = Sumo { plane, shapes: ShapesOfFile::default(), params: Vec::new(), poly: None };
    walk(text, &mut file)?;
    Ok(file.shapes)
}

/// State of the reader of SUMO polygons.
struct Sumo {
    plane: Option<Earth>,
    shapes: ShapesOfFile,
    /// Polygon that is being read, and its parameters.
    poly: Option<ShapeOfFile>,
    params: Vec<(String, String)>,
}

impl Elements for Sumo {
    fn element(&mut self, element: &BytesStart<'_>, start: Position, depth: usize) -> Result<(), Fault> {
        match (depth, element.name().into_inner()) {
            (0, name) if !ROOTS.contains(&name) => {
                let help = match name {
                    "net" => "this is a net: make polygons of buildings with polyconvert",
                    "osm" => "this is OpenStreetMap XML: convert it with polyconvert --osm-files",
                    _ => "make polygons of buildings with SUMO's polyconvert",
                };
                let message = format!("element = {}; the root element must be additional; {help}", quoted(name));
                Err(Fault::at(start, message))
            }
            (1, "poly") => self.poly(element, start),
            (2, "param") if self.poly.is_some() => {
                let [key, value] = attributes(element, start, ["key", "value"])?;
                if let (Some(key), Some(value)) = (key, value)
                    && (HEIGHTS.contains(&key.text.as_ref()) || STOREYS.contains(&key.text.as_ref()))
                    && self.params.len() < HEIGHTS.len() + STOREYS.len()
                {
                    self.params.push((key.text.into_owned(), value.text.into_owned()));
                }
                Ok(())
            }
            _ => Ok(()),
        }
    }

    fn end(&mut self, depth: usize) -> Result<(), Fault> {
        let Some(mut shape) = self.poly.take_if(|_| depth == 1) else { return Ok(()) };
        let of = |key: &str| self.params.iter().find(|(name, _)| name == key).map(|(_, value)| value.clone());
        shape.height_m = height_of(of);
        shape.is_building |= shape.height_m.is_some();
        let position = shape.position;
        self.shapes.add(shape).map_err(|message| Fault { position, ..Fault::whole(message) })
    }
}

impl Sumo {
    fn poly(&mut self, element: &BytesStart<'_>, start: Position) -> Result<(), Fault> {
        self.params.clear();
        let [kind, shape, geo] = attributes(element, start, ["type", "shape", "geo"])?;
        let Some(shape) = shape else {
            return Err(Fault::at(start, "poly: shape is missing; must be an attribute".to_owned()));
        };
        let is_in_degrees = geo.is_some_and(|geo| ["1", "true"].contains(&geo.text.as_ref()));
        let plane = match (is_in_degrees, &self.plane) {
            (true, None) => {
                let message = "poly: geo = 1: its shape is in degrees, but the traffic is in metres; make the polygons \
                               with polyconvert --net-file, or use traffic in degrees";
                return Err(Fault::at(start, message.to_owned()));
            }
            (false, Some(_)) => {
                let message = "poly: its shape is in metres, but the traffic is in degrees; make the polygons with \
                               polyconvert --proj.plain-geo, or use traffic in metres";
                return Err(Fault::at(start, message.to_owned()));
            }
            (_, plane) => plane.as_ref(),
        };
        let point = |text: &str| {
            let mut numbers =
                text.split(',').map(|number| number.parse::<f64>().ok().filter(|metres| metres.is_finite()));
            let (Some(Some(x)), Some(Some(y))) = (numbers.next(), numbers.next()) else {
                return Err(format!("{}: must be x,y", quoted(text)));
            };
            plane.map_or(Ok([x, y]), |plane| plane.place(y, x))
        };
        let ring_m = shape.read(|text| text.split_whitespace().map(point).collect::<Result<Vec<_>, _>>())?;
        let is_building = kind.is_some_and(|kind| kind.text.starts_with("building"));
        self.poly = Some(ShapeOfFile { position: Some(start), is_building, height_m: None, rings_m: vec![ring_m] });
        Ok(())
    }
}
