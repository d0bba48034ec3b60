//! Frames of SUMO nets, and their relation to the Earth.

use proj4rs::Proj;
use proj4rs::transform::transform;
use quick_xml::events::BytesStart;

use crate::display_text::{printable, quoted};
use crate::text_source::xml::{Found, attributes};
use crate::text_source::{Fault, Position};

/// Maximum coordinate in the frame of a net, m.
pub const FURTHEST_M: f64 = 1e8;

/// Distance from a run within which a map of it must be, m. It is beyond the range of every sensor.
pub const NEAR_M: f64 = 5_000.0;

/// Maximum length of a projection, bytes; usual ones have 100.
const PROJECTION_MAX: usize = 1_000;

/// Coordinate frame of a net (SUMO's `<location>`).
#[derive(Debug, Clone, PartialEq)]
pub struct Location {
    /// Offset that was added to projected positions.
    pub offset_m: [f64; 2],
    /// Projection as a PROJ string; `!` or `-` for none.
    pub projection: String,
    /// Position of the projection in its file.
    pub position: Position,
}

impl Location {
    /// Reads the element `<location>` of a net, which starts at `start`.
    pub fn of(element: &BytesStart<'_>, start: Position) -> Result<Self, Fault> {
        let [offset, projection] = attributes(element, start, ["netOffset", "projParameter"])?;
        let need = |found: Option<Found<'_>>, key: &str| {
            let message =
                format!("location: {key} is missing; must be an attribute; make the net again with netconvert");
            found.map(|found| (found.text.into_owned(), found.position)).ok_or_else(|| Fault::at(start, message))
        };
        let (offset, offset_at) = need(offset, "netOffset")?;
        let (projection, position) = need(projection, "projParameter")?;
        if projection.len() > PROJECTION_MAX {
            let message = format!("projParameter has {} bytes; at most {PROJECTION_MAX}", projection.len());
            return Err(Fault::at(position, message));
        }
        let number = |text: &str| text.trim().parse::<f64>().ok().filter(|value| value.abs() <= FURTHEST_M);
        match offset.split_once(',').map(|(x, y)| (number(x), number(y))) {
            Some((Some(x_m), Some(y_m))) => Ok(Self { offset_m: [x_m, y_m], projection, position }),
            _ => {
                let message =
                    format!("netOffset: {}: must be x,y in metres, of at most {FURTHEST_M:e}", quoted(&offset));
                Err(Fault::at(offset_at, message))
            }
        }
    }

    /// Returns the frame of traffic in metres over the net: that of the net or, for traffic from
    /// `sumo --fcd-output.utm`, its projection without the offset, if the net is near the traffic only there. `is_near`
    /// returns true if the net, shifted by a vector in metres, is near the traffic.
    pub fn of_traffic(self, is_near: impl Fn([f64; 2]) -> bool) -> Self {
        let without_offset = self.offset_m.map(|offset_m| -offset_m);
        let lacks_offset = !is_near([0.0; 2]) && is_near(without_offset);
        Self { offset_m: if lacks_offset { [0.0; 2] } else { self.offset_m }, ..self }
    }
}

/// Frame of a net, related to the Earth.
#[derive(Debug)]
pub struct Projected {
    projection: Proj,
    earth: Proj,
    offset_m: [f64; 2],
}

impl Projected {
    /// Creates it from the frame of a net. Fails if its projection is missing or not supported.
    pub fn of(location: &Location) -> Result<Self, Fault> {
        let Location { offset_m, projection, position } = location;
        let refused = |what: &str| {
            let advice = "make the net again with a supported projection, for example netconvert --proj.utm";
            Fault::at(*position, format!("projParameter = {}: {what}; {advice}", quoted(projection)))
        };
        if !has_projection(location) {
            let what =
                "it has no projection, so its location on the Earth is unknown, but other coordinates are in degrees";
            let advice = "use traffic in metres (sumo --fcd-output without .geo), or a map with a projection";
            return Err(Fault::at(*position, format!("projParameter = {}: {what}; {advice}", quoted(projection))));
        }
        // Grids would be other files that this file names.
        if projection.to_lowercase().contains("grids") || projection.contains("NAD27") {
            return Err(refused("grid files for datum shifts are not supported"));
        }
        let parsed = Proj::from_proj_string(projection).map_err(|error| refused(&printable(&error.to_string())))?;
        if parsed.is_latlong() || !parsed.has_inverse() || !parsed.has_forward() {
            return Err(refused("must convert degrees to metres and back"));
        }
        let earth = Proj::from_proj_string("+proj=longlat +datum=WGS84 +no_defs");
        let earth = earth.map_err(|error| refused(&printable(&error.to_string())))?;
        Ok(Self { projection: parsed, earth, offset_m: *offset_m })
    }

    /// Converts a position in the net to longitude and latitude, degrees; `None` if the projection cannot be inverted
    /// there.
    pub fn degrees(&self, [x_m, y_m]: [f64; 2]) -> Option<[f64; 2]> {
        let mut point = (x_m - self.offset_m[0], y_m - self.offset_m[1], 0.0);
        transform(&self.projection, &self.earth, &mut point).ok()?;
        finite([point.0.to_degrees(), point.1.to_degrees()])
    }

    /// Converts longitude and latitude, degrees, to a position in the net; `None` if it has none.
    pub fn metres(&self, [lon_deg, lat_deg]: [f64; 2]) -> Option<[f64; 2]> {
        let mut point = (lon_deg.to_radians(), lat_deg.to_radians(), 0.0);
        transform(&self.earth, &self.projection, &mut point).ok()?;
        finite([point.0 + self.offset_m[0], point.1 + self.offset_m[1]])
    }
}

/// True if the frame of a net is related to the Earth.
pub fn has_projection(location: &Location) -> bool {
    !matches!(location.projection.trim(), "" | "!" | "-" | ".")
}

/// Returns a position if its coordinates are finite and at most [`FURTHEST_M`].
pub fn finite(point: [f64; 2]) -> Option<[f64; 2]> {
    point.iter().all(|value| value.abs() <= FURTHEST_M).then_some(point)
}
