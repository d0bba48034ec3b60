//! Reads traffic from XML; the root element determines the format.

use std::io::Read;

use quick_xml::events::BytesStart;
use standoff_io::display_text::quoted;
use standoff_io::text_source::xml::{Elements, walk};
use standoff_io::text_source::{Fault, Lines, Position};

use super::fcd::Fcd;
use super::gpx::Gpx;
use super::model::{Options, Traffic};

/// Formats that are not read: the root element, the name of the format, and how to get one that is read.
const OTHERS: [(&str, &str, &str); 6] = [
    ("kml", "KML", "GPX, for example with gpsbabel -i kml -o gpx"),
    ("TrainingCenterDatabase", "TCX", "GPX, for example with gpsbabel -i gtrnctr -o gpx"),
    ("net", "a SUMO net, without vehicles", "floating-car data with sumo --net-file --fcd-output"),
    ("routes", "SUMO routes, without positions", "floating-car data with sumo --route-files --fcd-output"),
    ("additional", "additional elements of SUMO", "floating-car data with sumo --fcd-output"),
    (
        "osm",
        "an OpenStreetMap extract, without vehicles",
        "floating-car data with SUMO's osmWebWizard and --fcd-output",
    ),
];

pub(super) fn read(lines: Lines<impl Read>, options: &Options) -> Result<Traffic, Fault> {
    let mut file = Xml { fcd: Fcd::new(options), gpx: None };
    walk(lines, &mut file)?;
    match file.gpx {
        Some(gpx) => gpx.finish(options),
        None => file.fcd.finish(options),
    }
}

/// The readers of both formats.
struct Xml {
    fcd: Fcd,
    /// Set if the root element is that of GPX.
    gpx: Option<Gpx>,
}

impl Elements for Xml {
    fn element(&mut self, element: &BytesStart<'_>, start: Position, depth: usize) -> Result<(), Fault> {
        if let Some(gpx) = &mut self.gpx {
            return gpx.element(element, start, depth);
        }
        let name = element.local_name().into_inner();
        if depth == 0 && name == "gpx" {
            self.gpx = Some(Gpx::default());
            return Ok(());
        }
        if let Some((_, found, nearest)) = OTHERS.into_iter().find(|(root, ..)| depth == 0 && *root == name) {
            let name = quoted(name);
            let message = format!(
                "element = {name}; the only root element must be fcd-export or gpx; this is {found}: make {nearest}"
            );
            return Err(Fault::at(start, message));
        }
        self.fcd.element(element, start, depth)
    }

    fn text(&mut self, text: &str) {
        if let Some(gpx) = &mut self.gpx {
            gpx.text(text);
        }
    }

    fn end(&mut self, depth: usize) -> Result<(), Fault> {
        self.gpx.as_mut().map_or(Ok(()), |gpx| gpx.end(depth))
    }

    fn comment(&mut self, comment: &str) {
        self.fcd.comment(comment);
    }
}
