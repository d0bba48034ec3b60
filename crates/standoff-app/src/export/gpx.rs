//! GPX 1.1: paths as tracks, gaps as waypoints.

use quick_xml::Writer;

use super::model::{Degrees, Export, Path};
use super::xml::{document, element};
use crate::error::Failure;

pub(super) fn text(export: &Export) -> Result<String, Failure> {
    document(|xml| write(xml, export))
}

fn write(xml: &mut Writer<Vec<u8>>, export: &Export) -> std::io::Result<()> {
    let gpx = xml.create_element("gpx").with_attributes([
        ("version", "1.1"),
        ("creator", "standoff"),
        ("xmlns", "http://www.topografix.com/GPX/1/1"),
    ]);
    gpx.write_inner_content(|xml| {
        for gap in &export.gaps {
            point(xml, "wpt", gap.at, |xml| {
                element(xml, "time", &export.utc(gap.begin_s))?;
                element(xml, "name", &gap.name)?;
                element(xml, "desc", &format!("gap of {:.1} s: {}", gap.end_s - gap.begin_s, gap.cause))
            })?;
        }
        export.paths.iter().try_for_each(|path| track(xml, export, path))
    })?;
    Ok(())
}

fn track(xml: &mut Writer<Vec<u8>>, export: &Export, path: &Path) -> std::io::Result<()> {
    let points = |xml: &mut Writer<Vec<u8>>| {
        path.fixes.iter().try_for_each(|fix| {
            point(xml, "trkpt", fix.at, |xml| {
                fix.altitude_m.map_or(Ok(()), |altitude_m| element(xml, "ele", &altitude_m.to_string()))?;
                element(xml, "time", &export.utc(fix.time_s))
            })
        })
    };
    xml.create_element("trk").write_inner_content(|xml| {
        element(xml, "name", &path.name)?;
        element(xml, "type", path.kind)?;
        xml.create_element("trkseg").write_inner_content(points)?;
        Ok(())
    })?;
    Ok(())
}

/// Writes an element at a position.
fn point(
    xml: &mut Writer<Vec<u8>>,
    kind: &str,
    at: Degrees,
    contents: impl Fn(&mut Writer<Vec<u8>>) -> std::io::Result<()>,
) -> std::io::Result<()> {
    let [longitude_deg, latitude_deg] = at.map(|value| value.to_string());
    let attributes = [("lat", &*latitude_deg), ("lon", &*longitude_deg)];
    xml.create_element(kind).with_attributes(attributes).write_inner_content(contents)?;
    Ok(())
}
