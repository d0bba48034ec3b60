//! Reads zones from KML: each polygon of a placemark, with the placemark's name.
//!
//! A polygon that is extruded to the ground from one altitude above it has this altitude as its ceiling. Other altitudes
//! are ignored: those above the sea level, because the elevation of the ground is unknown, and those of polygons that are
//! not extruded, because such a polygon has no volume.

use std::collections::BTreeSet;

use quick_xml::events::BytesStart;
use standoff_io::display_text::quoted;
use standoff_io::text_source::xml::{Elements, walk};
use standoff_io::text_source::{self, Expectation, Fault, Position};

use super::super::earth::Earth;
use super::super::polygons::Rings;
use super::shapes::{Contents, Found, INSTEAD, Shape, named};

/// Expected contents, for messages.
pub(super) static ZONES: Expectation =
    Expectation { description: "zones", formats: "GeoJSON, a plan of QGroundControl or KML", is_map: true };

/// Maximum length of a name, bytes.
const NAME_MAX: usize = 1_000;

/// Formats the error of a file whose name precedes it.
pub(super) fn described(fault: Fault) -> String {
    match fault.position {
        Some(position) => format!("{position}: {fault}"),
        None => fault.to_string(),
    }
}

pub(super) fn read(bytes: &[u8], earth: &Earth) -> Result<Contents, String> {
    let text = text_source::text(bytes, &ZONES).map_err(described)?;
    let mut file = Kml::new(earth);
    walk(text, &mut file).map_err(described)?;
    let mut notes = Vec::new();
    if file.ignores_altitudes {
        notes.push(
            "ignores the altitudes of polygons, except for extruded ones with a single altitude relative to the ground"
                .to_owned(),
        );
    }
    if !file.ignored.is_empty() {
        let ignored: Vec<&str> = file.ignored.into_iter().collect();
        let ignored = ignored.join(", ");
        notes.push(format!("ignores {ignored}: only polygons are zones, and they exist all the time"));
    }
    Ok(Contents { zones: file.zones, notes })
}

/// Elements that may concern the airspace, but are not read.
const IGNORED: [&str; 6] = ["GroundOverlay", "PhotoOverlay", "ScreenOverlay", "TimeSpan", "TimeStamp", "Tour"];

/// State of the reader.
struct Kml<'a> {
    earth: &'a Earth,
    zones: Vec<Found>,
    ignores_altitudes: bool,
    /// Names of ignored elements.
    ignored: BTreeSet<&'static str>,
    /// Depth of the current collection, and the index of its first zone.
    collection: Option<(usize, usize)>,
    /// Depth of the current placemark, and its contents.
    placemark: Option<(usize, Placemark)>,
    /// Depth of the current polygon, and its contents.
    polygon: Option<(usize, Polygon)>,
    is_hole: bool,
    /// Element whose text is collected, and its depth.
    collects: Option<(usize, Text)>,
    text: String,
    start: Position,
}

/// A placemark that is being read.
struct Placemark {
    name: String,
    start: Position,
    has_polygon: bool,
}

/// A polygon that is being read.
#[derive(Default)]
struct Polygon {
    rings: Rings,
    has_outline: bool,
    /// Lowest and highest altitude of its points, m.
    altitudes_m: Option<[f64; 2]>,
    is_relative_to_ground: bool,
    is_extruded: bool,
}

/// An element whose text is collected.
#[derive(Clone, Copy)]
enum Text {
    Name,
    Coordinates,
    AltitudeMode,
    Extrude,
}

impl Polygon {
    /// Altitude from which it is extruded to the ground, m.
    fn ceiling_m(&self) -> Option<f64> {
        let [low_m, high_m] = self.altitudes_m.filter(|_| self.is_relative_to_ground && self.is_extruded)?;
        (low_m > 0.0 && low_m >= high_m).then_some(high_m)
    }

    /// True if an altitude other than zero is ignored.
    fn ignores_altitudes(&self) -> bool {
        self.ceiling_m().is_none() && self.altitudes_m.is_some_and(|altitudes_m| altitudes_m != [0.0; 2])
    }
}

impl Elements for Kml<'_> {
    fn element(&mut self, element: &BytesStart<'_>, start: Position, depth: usize) -> Result<(), Fault> {
        let name = element.local_name().into_inner();
        let mut collect = |text| {
            self.collects = Some((depth, text));
            self.text.clear();
            self.start = start;
        };
        match name {
            _ if depth == 0 && name != "kml" => {
                let message = format!("element = {}; the root element must be kml", quoted(name));
                return Err(Fault::at(start, message));
            }
            "Placemark" => self.placemark = Some((depth, Placemark { name: String::new(), start, has_polygon: false })),
            "name" if self.placemark.as_ref().is_some_and(|(of, _)| of + 1 == depth) => collect(Text::Name),
            "Polygon" => self.polygon = Some((depth, Polygon::default())),
            "MultiGeometry" if self.collection.is_none() => self.collection = Some((depth, self.zones.len())),
            "Point" | "LineString" | "LinearRing" | "Track" | "MultiTrack" | "Model" if self.polygon.is_none() => {
                let called = self.placemark.as_ref().map_or("", |(_, placemark)| &placemark.name);
                let message = format!("placemark {}is a {name}: {INSTEAD}", named(called));
                return Err(Fault::at(start, message));
            }
            "NetworkLink" | "NetworkLinkControl" => {
                let message = format!(
                    "element = {}: linked files are not read; add each as a zone with a `file`, and remove the link",
                    quoted(name)
                );
                return Err(Fault::at(start, message));
            }
            "outerBoundaryIs" => self.is_hole = false,
            "innerBoundaryIs" => self.is_hole = true,
            "coordinates" if self.polygon.is_some() => collect(Text::Coordinates),
            "altitudeMode" if self.polygon.is_some() => collect(Text::AltitudeMode),
            "extrude" if self.polygon.is_some() => collect(Text::Extrude),
            _ => self.ignored.extend(IGNORED.iter().filter(|ignored| **ignored == name)),
        }
        Ok(())
    }

    fn text(&mut self, text: &str) {
        let room = match self.collects {
            Some((_, Text::Coordinates)) => usize::MAX,
            Some(_) => NAME_MAX.saturating_sub(self.text.len()),
            None => 0,
        };
        if text.len() <= room {
            self.text.push_str(text);
        }
    }

    fn end(&mut self, depth: usize) -> Result<(), Fault> {
        if let Some((_, element)) = self.collects.take_if(|(of, _)| *of == depth) {
            let text = self.text.trim();
            match (element, &mut self.polygon) {
                (Text::Name, _) => {
                    self.placemark.iter_mut().for_each(|(_, placemark)| text.clone_into(&mut placemark.name));
                }
                (Text::Coordinates, Some((_, polygon))) => {
                    ring(text, self.earth, polygon, self.is_hole).map_err(|message| Fault::at(self.start, message))?;
                }
                (Text::AltitudeMode, Some((_, polygon))) => polygon.is_relative_to_ground = text == "relativeToGround",
                (Text::Extrude, Some((_, polygon))) => polygon.is_extruded = ["1", "true"].contains(&text),
                (_, None) => {}
            }
        }
        if let Some((_, polygon)) = self.polygon.take_if(|(of, _)| *of == depth) {
            let name = self.placemark.as_mut().map_or_else(String::new, |(_, placemark)| {
                placemark.has_polygon = true;
                placemark.name.clone()
            });
            self.ignores_altitudes |= polygon.ignores_altitudes();
            let band_m = [None, polygon.ceiling_m()];
            let first = self.collection.map_or(usize::MAX, |(_, first)| first);
            // The polygons of a collection are one zone, if they have the same ceiling.
            match self.zones.get_mut(first..).and_then(|zones| zones.iter_mut().find(|zone| zone.band_m == band_m)) {
                Some(Found { shape: Shape::Polygons(parts), .. }) => parts.push(polygon.rings),
                _ => {
                    let shape = Shape::Polygons(vec![polygon.rings]);
                    self.zones.push(Found { name, kind: None, shape, band_m });
                }
            }
        }
        self.collection.take_if(|(of, _)| *of == depth);
        match self.placemark.take_if(|(of, _)| *of == depth) {
            Some((_, Placemark { name, start, has_polygon: false })) => {
                let message = format!("placemark {}has no geometry; draw its polygon, or remove it", named(&name));
                Err(Fault::at(start, message))
            }
            _ => Ok(()),
        }
    }
}

impl<'a> Kml<'a> {
    fn new(earth: &'a Earth) -> Self {
        let (text, start) = (String::new(), Position::START);
        let (placemark, polygon, collects) = (None, None, None);
        Self {
            earth,
            zones: Vec::new(),
            ignores_altitudes: false,
            ignored: BTreeSet::new(),
            collection: None,
            placemark,
            polygon,
            is_hole: false,
            collects,
            text,
            start,
        }
    }
}

/// Adds a ring of coordinates to a polygon: `longitude,latitude` or `longitude,latitude,altitude`, separated by blanks.
fn ring(text: &str, earth: &Earth, polygon: &mut Polygon, is_hole: bool) -> Result<(), String> {
    let mut ring = Vec::new();
    for point in text.split_whitespace() {
        let numbers: Option<Vec<f64>> = point.split(',').map(|number| number.parse().ok()).collect();
        let (lon, lat, altitude_m) = match numbers.as_deref() {
            Some(&[lon, lat]) => (lon, lat, 0.0),
            Some(&[lon, lat, altitude_m]) => (lon, lat, altitude_m),
            _ => return Err(format!("coordinates = {}: must be longitude,latitude,altitude", quoted(point))),
        };
        let [low_m, high_m] = polygon.altitudes_m.unwrap_or([altitude_m; 2]);
        polygon.altitudes_m = Some([low_m.min(altitude_m), high_m.max(altitude_m)]);
        ring.push(earth.place(lat, lon)?);
    }
    if !is_hole && std::mem::replace(&mut polygon.has_outline, true) {
        return Err("a polygon has two outlines; make two polygons of it".to_owned());
    }
    let rings = &mut polygon.rings;
    // The outline is the first ring, whatever the order in the file.
    rings.insert(if is_hole { rings.len() } else { 0 }, ring);
    Ok(())
}
