//! Background maps: read, transformed to the plane of a run, simplified, and packed for its page.
//!
//! Two file formats are read, plain or gzipped. The format is detected from the content, never from the name:
//!
//! - **SUMO** nets (`.net.xml`): an edge becomes a line as wide as its lanes, a junction an area; and SUMO polygons
//!   (`<poly>`). `<location>` defines their frame: `projParameter` and `netOffset`.
//! - **GeoJSON**: lines and polygons in degrees (WGS84), according to the standard; longitudes may continue beyond 180.
//!   Coordinates that cannot be degrees are interpreted as metres in the plane of the run. The properties define the
//!   feature class, as in OpenStreetMap (`highway`, `building`, `natural`, ...).
//!
//! Maps never affect the simulation. A malicious or too large file, one that is not a map, and one in an unknown frame
//! are refused with an error message: [`MapError`].

mod encode;
mod error;
mod feature_class;
#[cfg(test)]
mod fuzz;
mod geojson;
mod geometry;
mod limits;
mod projection;
mod simplify;
mod sumo;
#[cfg(test)]
mod tests;

use standoff_io::text_source::{self, Expectation, Fault, Text};
use standoff_sim::scenario::MapFile;

pub use encode::{Packed, of_record};
pub use error::MapError;
pub use geometry::Bounds;
pub use projection::Place;

use error::named;
use geometry::Count;
use projection::Read;

/// Accepted input.
static MAP: Expectation =
    Expectation { description: "map", formats: "a SUMO net (.net.xml), SUMO polygons or GeoJSON", is_map: true };

/// Reads, transforms, simplifies and packs maps. Fails at the first invalid one.
pub fn pack(files: &[MapFile], place: &Place) -> Result<Packed, MapError> {
    let mut read = Vec::new();
    let mut count = Count::default();
    for file in files {
        let (name, text) = match file {
            MapFile::BuiltIn(name, bytes) => ((*name).to_owned(), text_source::text(*bytes, &MAP)),
            MapFile::OnDisk(path) => (path.display().to_string(), text_source::open(path, &MAP)),
        };
        let found = text.and_then(|text| parse(text, count, place.origin.is_some())).map_err(named(&name))?;
        count = found.shapes.count;
        read.push((name, found));
    }
    let is_of_openstreetmap = read.iter().any(|(_, found)| found.is_of_openstreetmap);
    let placed = projection::all(read, place)?;
    simplify::fit(placed, is_of_openstreetmap).map_err(|message| named(&all_names(files))(Fault::whole(message)))
}

fn all_names(files: &[MapFile]) -> String {
    let name = |file: &MapFile| match file {
        MapFile::BuiltIn(name, _) => (*name).to_owned(),
        MapFile::OnDisk(path) => path.display().to_string(),
    };
    files.iter().map(name).collect::<Vec<_>>().join(", ")
}

/// Parses a file of a run in degrees or in metres; `before` counts the contents of the previous files.
fn parse(mut text: Text<'_>, before: Count, in_degrees: bool) -> Result<Read, Fault> {
    match text.first_byte()? {
        Some(b'<') => sumo::read(text, before),
        Some(b'{') => geojson::read(text, before, in_degrees),
        Some(_) => {
            let message = format!("is not a map: must be {}, and start with < or {{", MAP.formats);
            Err(Fault::at(text.position(), message))
        }
        None => Err(Fault::whole(format!("contains no text; must be {}", MAP.formats))),
    }
}
