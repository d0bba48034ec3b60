//! Where a scenario is on the Earth: the plane of traffic in degrees or, for traffic in metres, the projection of the SUMO
//! net that the scenario names as its basemap.

use std::io::Read;

use quick_xml::events::BytesStart;
use standoff_io::display_text::quoted;
use standoff_io::geodesy::{LocalPlane, wrapped};
use standoff_io::net_projection::{Location, NEAR_M, Projected, has_projection};
use standoff_io::text_source::xml::{Elements, attributes, walk};
use standoff_io::text_source::{self, Expectation, Fault, Lines, Position};

use super::basemap::{self, MapFile};
use super::load::Typed;
use super::schema_types::PLACE_MAX_M;
use crate::traffic::Traffic;

/// Expected contents of a basemap, for messages.
static NET: Expectation =
    Expectation { description: "a map", formats: "SUMO net or GeoJSON, plain or gzip", is_map: true };

/// Converts degrees to the plane of the scenario.
#[derive(Debug)]
pub(super) enum Earth {
    /// Traffic in degrees.
    Plane(LocalPlane),
    /// Traffic in metres, in the frame of a net.
    Net(Box<Projected>),
}

impl Earth {
    /// Finds where a scenario is. The error states why degrees cannot be placed.
    pub(super) fn of(typed: &Typed, traffic: Option<&Traffic>) -> Result<Self, String> {
        if let Some(origin) = typed.origin_on_earth(traffic) {
            return origin.plane().map(Self::Plane).map_err(|error| error.to_string());
        }
        let maps = basemap::files(typed);
        let heads = maps.iter().map(|map| (name_of(map), head(map)));
        for (name, head) in heads {
            let described = |fault: Fault| format!("with the basemap {}: {fault}", quoted(&name));
            let Some((location, bounds_m)) = head.map_err(described)? else { continue };
            if !has_projection(&location) {
                continue;
            }
            let location = frame_of(location, bounds_m, traffic);
            return Projected::of(&location).map(|net| Self::Net(Box::new(net))).map_err(described);
        }
        Err("the location of the scenario on the Earth is unknown: name the SUMO net of the traffic in `basemap` or with \
             --map (with a projection), use traffic in degrees, or give metres as `vertices`"
            .to_owned())
    }

    /// Converts degrees to east and north, m. Rounded to the millimetre for the record.
    pub(super) fn place(&self, latitude_deg: f64, longitude_deg: f64) -> Result<[f64; 2], String> {
        let far = |why: String| format!("[{longitude_deg}, {latitude_deg}] is not near the traffic: {why}");
        let [wrapped_deg, _] = wrapped([longitude_deg, latitude_deg]);
        let at = match self {
            Self::Plane(plane) => {
                let at = plane.position(latitude_deg, wrapped_deg).map_err(|error| far(error.to_string()))?;
                [at.x_m(), at.y_m()]
            }
            Self::Net(net) => {
                let is_on_earth = latitude_deg.abs() <= 90.0 && wrapped_deg.abs() <= 180.0;
                let at = is_on_earth.then(|| net.metres([wrapped_deg, latitude_deg])).flatten();
                at.filter(|at| at.iter().all(|value| value.abs() <= PLACE_MAX_M))
                    .ok_or_else(|| far("it is outside the projection of the net".to_owned()))?
            }
        };
        Ok(at.map(|metres| (metres * 1e3).round() / 1e3))
    }
}

fn name_of(map: &MapFile) -> String {
    match map {
        MapFile::BuiltIn(name, _) => (*name).to_owned(),
        MapFile::OnDisk(path) => path.display().to_string(),
    }
}

/// Frame and bounds of a net (west, south, east, north), m; `None` for other maps.
type Head = Option<(Location, Option<[f64; 4]>)>;

fn head(map: &MapFile) -> Result<Head, Fault> {
    match map {
        MapFile::BuiltIn(_, bytes) => head_of(text_source::text(*bytes, &NET)?),
        MapFile::OnDisk(path) => head_of(text_source::open(path, &NET)?),
    }
}

fn head_of(mut text: Lines<impl Read>) -> Result<Head, Fault> {
    if text.first_byte()? != Some(b'<') {
        return Ok(None);
    }
    let mut net = Net::default();
    let read = walk(text, &mut net);
    if !net.is_read {
        read?;
    }
    Ok(net.location.map(|location| (location, net.bounds_m)))
}

/// State of the reader of a net.
#[derive(Default)]
struct Net {
    location: Option<Location>,
    bounds_m: Option<[f64; 4]>,
    /// True if the rest of the file does not matter.
    is_read: bool,
}

impl Elements for Net {
    fn element(&mut self, element: &BytesStart<'_>, start: Position, depth: usize) -> Result<(), Fault> {
        match (depth, element.name().into_inner()) {
            (0, "net") => return Ok(()),
            (1, "location") => {
                let [bounds] = attributes(element, start, ["convBoundary"])?;
                let numbers = bounds.map(|bounds| bounds.text.split(',').map(|text| text.parse().ok()).collect());
                let numbers: Option<Vec<f64>> = numbers.flatten();
                self.bounds_m = numbers.and_then(|numbers| numbers.try_into().ok());
                self.location = Some(Location::of(element, start)?);
            }
            (1, _) => return Ok(()),
            _ => {}
        }
        self.is_read = self.location.is_some() || depth == 0;
        // Ends the reading.
        if self.is_read { Err(Fault::whole(String::new())) } else { Ok(()) }
    }
}

/// Frame of traffic over a net.
fn frame_of(location: Location, bounds_m: Option<[f64; 4]>, traffic: Option<&Traffic>) -> Location {
    let (Some([west, south, east, north]), Some(traffic)) = (bounds_m, traffic) else { return location };
    location.of_traffic(|[x_m, y_m]| {
        let (in_x, in_y) = (west + x_m - NEAR_M..=east + x_m + NEAR_M, south + y_m - NEAR_M..=north + y_m + NEAR_M);
        traffic.places().any(|[x, y]| in_x.contains(&x) && in_y.contains(&y))
    })
}
