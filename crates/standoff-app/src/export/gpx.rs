//! GPX 1.1: paths as tracks, gaps as waypoints.

use quick_xml::Writer;

use super::model::{Export, Path};
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
            let [longitude_deg, latitude_deg] = gap.at.map(|value| value.to_string());
            let waypoint =
                xml.create_element("wpt").with_attributes([("lat", &*latitude_deg), ("lon", &*longitude_deg)]);
            waypoint.write_inner_content(|xml| {
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
            let [longitude_deg, latitude_deg] = fix.at.map(|value| value.to_string());
            let point =
                xml.create_element("trkpt").with_attributes([("lat", &*latitude_deg), ("lon", &*longitude_deg)]);
            point.write_inner_content(|xml| {
                fix.altitude_m.map_or(Ok(()), |altitude_m| element(xml, "ele", &altitude_m.to_string()))?;
                element(xml, "time", &export.utc(fix.time_s))
            })?;
            Ok(())
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
