//! Reads zones from KML: each polygon of a placemark, with the placemark's name.

use quick_xml::events::BytesStart;
use standoff_io::display_text::quoted;
use standoff_io::geodesy::LocalPlane;
use standoff_io::text_source::xml::{Elements, walk};
use standoff_io::text_source::{self, Expectation, Fault, Position};

use super::shapes::{Contents, Found, Rings, Shape, ignored, place};

/// Expected contents, for messages.
static ZONES: Expectation = Expectation { description: "zones", formats: "KML with polygons" };

/// Maximum length of a name, bytes.
const NAME_MAX: usize = 1_000;

pub(super) fn read(bytes: &[u8], plane: &LocalPlane) -> Result<Contents, String> {
    let described = |fault: Fault| match fault.position {
        Some(position) => format!("{position}: {fault}"),
        None => fault.to_string(),
    };
    let text = text_source::text(bytes, &ZONES).map_err(described)?;
    let mut file = Kml::new(plane);
    walk(text, &mut file).map_err(described)?;
    let altitudes = file.has_altitudes.then(|| "ignores the altitudes of its polygons".to_owned());
    let notes: Vec<String> = altitudes.into_iter().chain(ignored(file.others)).collect();
    let note = (!notes.is_empty()).then(|| notes.join("; "));
    Ok(Contents { zones: file.zones, note })
}

/// State of the reader.
struct Kml<'a> {
    plane: &'a LocalPlane,
    zones: Vec<Found>,
    has_altitudes: bool,
    /// Number of points and lines.
    others: usize,
    /// Depth and name of the current placemark.
    placemark: Option<(usize, String)>,
    /// Depth and rings of the current polygon.
    polygon: Option<(usize, Rings)>,
    is_hole: bool,
    /// Element whose text is collected: its depth and whether it is a name.
    collects: Option<(usize, bool)>,
    text: String,
    start: Position,
}

impl Elements for Kml<'_> {
    fn element(&mut self, element: &BytesStart<'_>, start: Position, depth: usize) -> Result<(), Fault> {
        let name = element.local_name().into_inner();
        let mut collect = |is_name| {
            self.collects = Some((depth, is_name));
            self.text.clear();
            self.start = start;
        };
        match name {
            _ if depth == 0 && name != "kml" => {
                let message = format!("element = {}; the root element must be kml", quoted(name));
                return Err(Fault::at(start, message));
            }
            "Placemark" => self.placemark = Some((depth, String::new())),
            "name" if self.placemark.as_ref().is_some_and(|(of, _)| of + 1 == depth) => collect(true),
            "Polygon" => self.polygon = Some((depth, Vec::new())),
            "Point" | "LineString" | "Track" => self.others += 1,
            "outerBoundaryIs" => self.is_hole = false,
            "innerBoundaryIs" => self.is_hole = true,
            "coordinates" if self.polygon.is_some() => collect(false),
            _ => {}
        }
        Ok(())
    }

    fn text(&mut self, text: &str) {
        let room = match self.collects {
            Some((_, true)) => NAME_MAX.saturating_sub(self.text.len()),
            Some((_, false)) => usize::MAX,
            None => 0,
        };
        if text.len() <= room {
            self.text.push_str(text);
        }
    }

    fn end(&mut self, depth: usize) -> Result<(), Fault> {
        if let Some((_, is_name)) = self.collects.take_if(|(of, _)| *of == depth) {
            if is_name {
                let text = self.text.trim();
                self.placemark.iter_mut().for_each(|(_, name)| text.clone_into(name));
            } else {
                let ring = self.ring().map_err(|message| Fault::at(self.start, message))?;
                if let Some((_, rings)) = &mut self.polygon {
                    // The outline is the first ring, whatever the order in the file.
                    rings.insert(if self.is_hole { rings.len() } else { 0 }, ring);
                }
            }
        }
        if let Some((_, rings)) = self.polygon.take_if(|(of, _)| *of == depth) {
            let name = self.placemark.as_ref().map_or_else(String::new, |(_, name)| name.clone());
            self.zones.push(Found { name, kind: None, shape: Shape::Polygon(rings) });
        }
        self.placemark.take_if(|(of, _)| *of == depth);
        Ok(())
    }
}

impl<'a> Kml<'a> {
    fn new(plane: &'a LocalPlane) -> Self {
        let (text, start) = (String::new(), Position::START);
        let (placemark, polygon, collects) = (None, None, None);
        Self {
            plane,
            zones: Vec::new(),
            has_altitudes: false,
            others: 0,
            placemark,
            polygon,
            is_hole: false,
            collects,
            text,
            start,
        }
    }

    /// Parses the collected coordinates: `longitude,latitude` or `longitude,latitude,altitude`, separated by blanks.
    fn ring(&mut self) -> Result<Vec<[f64; 2]>, String> {
        let mut ring = Vec::new();
        for point in self.text.split_whitespace() {
            let numbers: Option<Vec<f64>> = point.split(',').map(|number| number.parse().ok()).collect();
            let (lon, lat, altitude_m) = match numbers.as_deref() {
                Some(&[lon, lat]) => (lon, lat, 0.0),
                Some(&[lon, lat, altitude_m]) => (lon, lat, altitude_m),
                _ => return Err(format!("coordinates = {}: must be longitude,latitude,altitude", quoted(point))),
            };
            self.has_altitudes |= altitude_m != 0.0;
            ring.push(place(lat, lon, self.plane)?);
        }
        Ok(ring)
    }
}
