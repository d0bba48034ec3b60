//! Reads GeoJSON one object at a time; errors have their position in the file.

use std::fmt;
use std::io::{self, BufReader};

use serde::Deserializer;
use serde::de::{DeserializeSeed, Error as _, IgnoredAny, MapAccess, SeqAccess, Unexpected, Visitor};
use standoff_io::display_text::{printable, quoted};
use standoff_io::net_projection::FURTHEST_M;
use standoff_io::text_source::{Fault, NOT_UNICODE, NOT_UTF_8, Position, Text, input_fault};

use crate::feature_class::{TAGS, of_tags};
use crate::geometry::{Bounds, Count, Form, Point, Shape, Shapes};
use crate::limits::MAX_POINTS;
use crate::projection::Read;

/// Maximum plausible width of a line, m.
const WIDTH_MAX_M: f64 = 100.0;
/// Size below which a line or an area is too small for a map, m.
const SPECK_M: f64 = 1.0;
/// Width of a lane, m.
const LANE_M: f64 = 3.2;
/// Maximum length of a stored property value, bytes; all known values are shorter.
const MAX_WORD: usize = 200;
/// Supported geometries.
const GEOMETRIES: [&str; 7] =
    ["Point", "MultiPoint", "LineString", "MultiLineString", "Polygon", "MultiPolygon", "GeometryCollection"];
/// Names of WGS84 with the axis order longitude, latitude, which GeoJSON uses.
const WGS84: [&str; 5] =
    ["urn:ogc:def:crs:OGC:1.3:CRS84", "urn:ogc:def:crs:OGC::CRS84", "CRS84", "EPSG:4326", "urn:ogc:def:crs:EPSG::4326"];

/// Reads a map of a run in degrees or in metres.
pub(crate) fn read(text: Text<'_>, before: Count, in_degrees: bool) -> Result<Read, Fault> {
    let begin = text.position();
    let mut found = Found::after(before);
    let mut json = serde_json::Deserializer::from_reader(BufReader::new(text.in_one_piece()));
    let whole = ObjectOrNull(&mut found).deserialize(&mut json).and_then(|object| json.end().map(|()| object));
    let object = whole.map_err(|error| fault(error, begin))?.unwrap_or_default();
    object.emit_alone(&mut found).map_err(Fault::whole)?;
    if found.shapes.all.is_empty() {
        let message = "contains neither lines nor polygons; points are not shown";
        return Err(Fault::whole(message.to_owned()));
    }
    let mut shapes = found.shapes;
    if let Some([x, y]) = found.no_degrees.filter(|_| are_specks(&shapes)) {
        let message = format!(
            "[{x}, {y}] cannot be degrees (-360 to 360, -90 to 90), but the other coordinates are not metres: half of the \
             lines and areas would be smaller than {SPECK_M} m; correct this position"
        );
        return Err(Fault::whole(message));
    }
    if found.no_degrees.is_none() && (!found.is_beyond_180 || in_degrees || are_specks(&shapes)) {
        shapes.in_degrees = std::mem::take(&mut shapes.all);
    }
    Ok(Read { shapes, location: None, is_net: false, is_of_openstreetmap: found.is_of_openstreetmap })
}

/// Returns whether at least half of the shapes are too small for a map in metres: they are in degrees.
fn are_specks(shapes: &Shapes) -> bool {
    let bounds = |shape: &&Shape| Bounds::of(shape.form.points().copied());
    let is_speck = |shape: &&Shape| bounds(shape).is_some_and(|bounds| bounds.is_smaller_than(SPECK_M));
    2 * shapes.all.iter().filter(is_speck).count() >= shapes.all.len()
}

/// Converts an error; `begin` is the position where the JSON starts.
fn fault(error: serde_json::Error, begin: Position) -> Fault {
    let (line, column) = (error.line() as u64, error.column() as u64);
    let at = Position {
        line: begin.line + line.saturating_sub(1),
        column: if line <= 1 { begin.column + column.saturating_sub(1) } else { column.max(1) },
    };
    if error.is_io() {
        return input_fault(Some(at), &io::Error::from(error));
    }
    let found_text = error.to_string();
    let message = found_text.rsplit_once(" at line ").map_or(found_text.as_str(), |(message, _)| message);
    if error.is_data() {
        return Fault::at(at, printable(message));
    }
    if message.starts_with(NOT_UNICODE) {
        return Fault::at(at, NOT_UTF_8.to_owned());
    }
    let cut = if error.is_eof() { "; it is truncated: copy or create it again" } else { "; must be GeoJSON" };
    Fault::at(at, format!("not JSON: {}{cut}", printable(message)))
}

/// Shapes and counts read from the file so far.
struct Found {
    shapes: Shapes,
    /// Number of geometries and positions read, including those of incomplete objects.
    read: Count,
    /// Number of lists of positions, and of lists of such lists.
    lists: usize,
    /// First position that cannot be degrees, even if longitudes continue beyond 180.
    no_degrees: Option<Point>,
    /// True if a longitude is beyond 180 degrees, or the file is in metres.
    is_beyond_180: bool,
    is_of_openstreetmap: bool,
}

/// Any GeoJSON object, with the contents of its members.
#[derive(Default)]
struct Object {
    kind: String,
    coordinates: Option<Nest>,
    geometry: Option<Box<Object>>,
    geometries: Vec<Object>,
    tags: Vec<(String, String)>,
}

/// Coordinates of any nesting depth.
enum Nest {
    Position(Point),
    List(Vec<Nest>),
}

impl Object {
    /// Adds the shapes of a top-level object.
    fn emit_alone(self, found: &mut Found) -> Result<(), String> {
        match self.kind.as_str() {
            "FeatureCollection" => Ok(()),
            "Feature" => self.emit_feature(found),
            kind if GEOMETRIES.contains(&kind) => self.emit(&[], found),
            kind => Err(format!(
                "type = {}: must be FeatureCollection, Feature or a geometry; is this GeoJSON?",
                quoted(kind)
            )),
        }
    }

    fn emit_feature(self, found: &mut Found) -> Result<(), String> {
        if self.kind != "Feature" {
            return Err(format!("type = {}: must be Feature in features", quoted(&self.kind)));
        }
        self.geometry.map_or(Ok(()), |geometry| geometry.emit(&self.tags, found))
    }

    fn emit(self, tags: &[(String, String)], found: &mut Found) -> Result<(), String> {
        let kind = of_tags(tags);
        if !GEOMETRIES.contains(&self.kind.as_str()) {
            return Err(format!("type = {}: must be one of {}", quoted(&self.kind), GEOMETRIES.join(", ")));
        }
        if self.kind == "GeometryCollection" {
            return self.geometries.into_iter().try_for_each(|part| part.emit(tags, found));
        }
        let coordinates = self.coordinates.ok_or_else(|| format!("{}: coordinates are missing", self.kind))?;
        let wrong = || format!("{}: its coordinates have the wrong nesting depth", self.kind);
        let width_m = width_m(tags).unwrap_or(kind.width_m());
        let name = tags.iter().find(|(key, _)| key == "name").map(|(_, name)| name.as_str());
        let mut add = |form| found.shapes.add_named(kind, form, name, false);
        match self.kind.as_str() {
            "LineString" => add(Form::Line(width_m, coordinates.line().ok_or_else(wrong)?)),
            "MultiLineString" => {
                let lines = coordinates.lines().ok_or_else(wrong)?;
                lines.into_iter().try_for_each(|line| add(Form::Line(width_m, line)))
            }
            "Polygon" => add(Form::Area(coordinates.lines().ok_or_else(wrong)?)),
            "MultiPolygon" => {
                let Nest::List(areas) = coordinates else { return Err(wrong()) };
                areas.into_iter().try_for_each(|area| add(Form::Area(area.lines().ok_or_else(wrong)?)))
            }
            // Points are not drawn.
            _ => Ok(()),
        }
    }
}

impl Nest {
    fn line(self) -> Option<Vec<Point>> {
        let Self::List(positions) = self else { return None };
        let point = |nest| if let Self::Position(point) = nest { Some(point) } else { None };
        positions.into_iter().map(point).collect()
    }

    fn lines(self) -> Option<Vec<Vec<Point>>> {
        let Self::List(lines) = self else { return None };
        lines.into_iter().map(Self::line).collect()
    }
}

/// Width according to the properties: in metres, or as a number of lanes.
fn width_m(tags: &[(String, String)]) -> Option<f64> {
    let of = |name: &str| {
        let (_, value) = tags.iter().find(|(key, _)| key == name)?;
        value.trim_end_matches('m').trim().parse::<f64>().ok().filter(|value| *value > 0.0)
    };
    let width_m = of("width").or_else(|| Some(of("lanes")? * LANE_M));
    width_m.filter(|width_m| *width_m <= WIDTH_MAX_M)
}

/// An object, or null.
struct ObjectOrNull<'f>(&'f mut Found);

impl<'de> DeserializeSeed<'de> for ObjectOrNull<'_> {
    type Value = Option<Object>;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Option<Object>, D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for ObjectOrNull<'_> {
    type Value = Option<Object>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a GeoJSON object")
    }

    fn visit_unit<E>(self) -> Result<Option<Object>, E> {
        Ok(None)
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Option<Object>, A::Error> {
        let found = self.0;
        let mut object = Object::default();
        while let Some(key) = map.next_key::<String>()? {
            match key.as_str() {
                "type" => {
                    object.kind = map.next_value()?;
                    if object.kind == "Topology" {
                        return Err(A::Error::custom("this is TopoJSON; must be GeoJSON: convert it"));
                    }
                }
                "features" => drop(map.next_value_seed(Objects { found, has_features: true })?),
                "geometry" => object.geometry = map.next_value_seed(ObjectOrNull(found))?.map(Box::new),
                "geometries" => object.geometries = map.next_value_seed(Objects { found, has_features: false })?,
                "coordinates" => match map.next_value_seed(Coordinates(found))? {
                    Part::Nest(nest) => object.coordinates = Some(nest),
                    Part::Number(_) => return Err(A::Error::custom("coordinates must be a list")),
                },
                "properties" => object.tags = map.next_value_seed(Tags)?,
                "crs" => check_crs(&map.next_value_seed(Word(&["properties", "name"]))?).map_err(A::Error::custom)?,
                "id" | "@id" => {
                    let id = map.next_value_seed(Word(&[]))?;
                    found.is_of_openstreetmap |= ["node/", "way/", "relation/"].iter().any(|of| id.starts_with(of));
                }
                "copyright" | "attribution" | "generator" => {
                    let source = map.next_value_seed(Word(&[]))?.to_lowercase();
                    found.is_of_openstreetmap |= source.contains("openstreetmap") || source.contains("overpass");
                }
                _ => drop(map.next_value::<IgnoredAny>()?),
            }
        }
        Ok(Some(object))
    }
}

/// Refuses a coordinate reference system other than that of GeoJSON, which older files may name.
fn check_crs(name: &str) -> Result<(), String> {
    if name.is_empty() || WGS84.contains(&name) {
        return Ok(());
    }
    Err(format!("crs = {}: must be WGS84 (EPSG:4326); save the file in that system", quoted(name)))
}

/// Features, each of which is processed immediately, or the geometries of a collection, which are returned.
struct Objects<'f> {
    found: &'f mut Found,
    has_features: bool,
}

impl<'de> DeserializeSeed<'de> for Objects<'_> {
    type Value = Vec<Object>;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Vec<Object>, D::Error> {
        deserializer.deserialize_seq(self)
    }
}

impl<'de> Visitor<'de> for Objects<'_> {
    type Value = Vec<Object>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.has_features { "a list of features" } else { "a list of geometries" })
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Vec<Object>, A::Error> {
        let Self { found, has_features } = self;
        let mut geometries = Vec::new();
        while let Some(object) = seq.next_element_seed(ObjectOrNull(&mut *found))? {
            let object = object.ok_or_else(|| A::Error::invalid_type(Unexpected::Unit, &"a GeoJSON object"))?;
            if has_features {
                object.emit_feature(found).map_err(A::Error::custom)?;
            } else {
                found.read = found.read.with(1, 0).map_err(A::Error::custom)?;
                // Only features have properties.
                geometries.push(Object { tags: Vec::new(), ..object });
            }
        }
        Ok(geometries)
    }
}

impl Found {
    fn after(before: Count) -> Self {
        let shapes = Shapes::after(before);
        let (no_degrees, is_beyond_180, is_of_openstreetmap) = (None, false, false);
        Self { shapes, read: before, lists: 0, no_degrees, is_beyond_180, is_of_openstreetmap }
    }

    /// Counts one more list of positions, or of lists.
    fn count_list(&mut self) -> Result<(), String> {
        self.lists += 1;
        if self.lists <= MAX_POINTS {
            return Ok(());
        }
        Err(format!("has more than {MAX_POINTS} lists of points; crop the map to the area of the vehicles"))
    }
}

/// A number, or a position or list of such elements.
enum Part {
    Number(f64),
    Nest(Nest),
}

/// A position, or a list of elements one level deeper; within a position, a number.
struct Coordinates<'f>(&'f mut Found);

impl<'de> DeserializeSeed<'de> for Coordinates<'_> {
    type Value = Part;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Part, D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Coordinates<'_> {
    type Value = Part;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("coordinates: a number, or a list")
    }

    fn visit_f64<E>(self, value: f64) -> Result<Part, E> {
        Ok(Part::Number(value))
    }

    fn visit_i64<E>(self, value: i64) -> Result<Part, E> {
        Ok(Part::Number(value as f64))
    }

    fn visit_u64<E>(self, value: u64) -> Result<Part, E> {
        Ok(Part::Number(value as f64))
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Part, A::Error> {
        let found = self.0;
        let (mut numbers, mut count, mut list) = ([0.0; 2], 0, Vec::new());
        while let Some(part) = seq.next_element_seed(Coordinates(&mut *found))? {
            match part {
                Part::Number(_) if !list.is_empty() => {
                    return Err(A::Error::custom("a number among lists of coordinates"));
                }
                Part::Nest(_) if count > 0 => return Err(A::Error::custom("a list among the numbers of a position")),
                Part::Nest(nest) => list.push(nest),
                Part::Number(value) if value.abs() > FURTHEST_M => {
                    let what =
                        format!("{value:e} is not a coordinate; must be degrees, or metres of at most {FURTHEST_M:e}");
                    return Err(A::Error::custom(what));
                }
                Part::Number(value) => {
                    if let Some(number) = numbers.get_mut(count) {
                        *number = value;
                    }
                    count += 1;
                }
            }
        }
        match count {
            0 => {
                found.count_list().map_err(A::Error::custom)?;
                Ok(Part::Nest(Nest::List(list)))
            }
            1 => Err(A::Error::custom("a position with one number; must be longitude and latitude")),
            _ => {
                found.read = found.read.with(0, 1).map_err(A::Error::custom)?;
                let [longitude, latitude] = numbers.map(f64::abs);
                found.is_beyond_180 |= longitude > 180.0;
                if longitude > 360.0 || latitude > 90.0 {
                    found.no_degrees.get_or_insert(numbers);
                }
                Ok(Part::Nest(Nest::Position(numbers)))
            }
        }
    }
}

/// Properties that define the feature class.
struct Tags;

impl<'de> DeserializeSeed<'de> for Tags {
    type Value = Vec<(String, String)>;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Self::Value, D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Tags {
    type Value = Vec<(String, String)>;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("properties: an object or null")
    }

    fn visit_unit<E>(self) -> Result<Self::Value, E> {
        Ok(Vec::new())
    }

    fn visit_str<E>(self, _: &str) -> Result<Self::Value, E> {
        Ok(Vec::new())
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
        let mut tags = Vec::new();
        while let Some(key) = map.next_key::<String>()? {
            if TAGS.contains(&key.as_str()) || ["lanes", "width", "name"].contains(&key.as_str()) {
                tags.push((key, map.next_value_seed(Word(&[]))?));
            } else if key == "tags" {
                // Some converters of OpenStreetMap data nest them in this way.
                tags.extend(map.next_value_seed(Self)?);
            } else {
                map.next_value::<IgnoredAny>()?;
            }
            // Repeated names add no information.
            tags.truncate(4 * TAGS.len());
        }
        Ok(tags)
    }
}

/// Value at a path of member names, as text, truncated to the maximum length; empty if it is not a scalar. Nothing else
/// is stored, however large it is.
struct Word<'n>(&'n [&'n str]);

impl Word<'_> {
    fn word<E>(&self, word: &str) -> Result<String, E> {
        let end = (0..=MAX_WORD.min(word.len())).rev().find(|&end| word.is_char_boundary(end)).unwrap_or(0);
        let kept = if self.0.is_empty() { &word[..end] } else { "" };
        Ok(kept.to_owned())
    }
}

impl<'de> DeserializeSeed<'de> for Word<'_> {
    type Value = String;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<String, D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Word<'_> {
    type Value = String;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("a value")
    }

    fn visit_str<E>(self, value: &str) -> Result<String, E> {
        self.word(value)
    }

    fn visit_u64<E>(self, value: u64) -> Result<String, E> {
        self.word(&value.to_string())
    }

    fn visit_i64<E>(self, value: i64) -> Result<String, E> {
        self.word(&value.to_string())
    }

    fn visit_f64<E>(self, value: f64) -> Result<String, E> {
        self.word(&value.to_string())
    }

    fn visit_bool<E>(self, value: bool) -> Result<String, E> {
        self.word(if value { "yes" } else { "no" })
    }

    fn visit_unit<E>(self) -> Result<String, E> {
        Ok(String::new())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<String, A::Error> {
        while seq.next_element::<IgnoredAny>()?.is_some() {}
        Ok(String::new())
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<String, A::Error> {
        let mut word = String::new();
        while let Some(key) = map.next_key::<String>()? {
            match self.0 {
                [name, rest @ ..] if key == *name => word = map.next_value_seed(Word(rest))?,
                _ => drop(map.next_value::<IgnoredAny>()?),
            }
        }
        Ok(word)
    }
}
