//! What lies under the vehicles: maps, read, placed in the plane of a run, thinned, and packed for its page.
//!
//! Two kinds of file are read, plain or gzipped; the kind is told by the content, never by the name:
//!
//! - **SUMO** nets (`.net.xml`): an edge becomes a line as wide as its lanes, a junction an area; and SUMO's polygons
//!   (`<poly>`). Their frame is that of `<location>`: `projParameter`, and what `netOffset` adds to it.
//! - **GeoJSON**: lines and polygons, in degrees (WGS84), as its standard says; what cannot be degrees is taken for metres in
//!   the plane of the run. What a thing is, properties say as OpenStreetMap calls them (`highway`, `building`, `natural`, ...).
//!
//! Nothing that is flown depends on a map. A file that is hostile, too large, no map or in no frame that can be placed is
//! refused with a sentence: [`MapError`].

mod error;
#[cfg(test)]
mod fuzz;
mod geojson;
mod kind;
mod limit;
mod packed;
mod place;
mod shape;
mod sumo;
#[cfg(test)]
mod tests;
mod thin;

use standoff_sim::scenario::MapFile;
use standoff_sim::source::{self, Fault, Text, Wanted};

pub use error::MapError;
pub use packed::{Packed, of_record};
pub use place::Place;
pub use shape::Bounds;

use error::named;
use place::Read;
use shape::Count;

/// What is wanted.
static MAP: Wanted = Wanted { what: "map", whole: "a map", formats: "a SUMO net (.net.xml), SUMO polygons or GeoJSON" };

/// Reads, places, thins and packs maps. Fails at the first that cannot be used.
pub fn pack(files: &[MapFile], place: &Place) -> Result<Packed, MapError> {
    let mut read = Vec::new();
    let mut count = Count::default();
    for file in files {
        let (name, text) = match file {
            MapFile::BuiltIn(name, bytes) => ((*name).to_owned(), source::text(*bytes, &MAP)),
            MapFile::OnDisk(path) => (path.display().to_string(), source::open(path, &MAP)),
        };
        let found = text.and_then(|text| parse(text, count)).map_err(named(&name))?;
        count = found.shapes.count;
        read.push((name, found));
    }
    let is_of_openstreetmap = read.iter().any(|(_, found)| found.is_of_openstreetmap);
    let placed = place::all(read, place)?;
    thin::fit(placed, is_of_openstreetmap).map_err(|message| named(&all_names(files))(Fault::whole(message)))
}

fn all_names(files: &[MapFile]) -> String {
    let name = |file: &MapFile| match file {
        MapFile::BuiltIn(name, _) => (*name).to_owned(),
        MapFile::OnDisk(path) => path.display().to_string(),
    };
    files.iter().map(name).collect::<Vec<_>>().join(", ")
}

/// What is in a file; `before` is in those before it.
fn parse(mut text: Text<'_>, before: Count) -> Result<Read, Fault> {
    match text.first_byte()? {
        Some(b'<') => sumo::read(text, before),
        Some(b'{') => geojson::read(text, before),
        Some(_) => {
            let message = format!("is no map: must be {}, and begin with < or {{", MAP.formats);
            Err(Fault::at(text.position(), message))
        }
        None => Err(Fault::whole(format!("holds no text; must be {}", MAP.formats))),
    }
}
