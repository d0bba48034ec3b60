//! KML 2.2: paths as `gx:Track`, outlines as lines and gaps as points, with their times.

use quick_xml::Writer;

use super::model::{Export, Path};
use super::xml::{document, element};
use crate::error::Failure;

pub(super) fn text(export: &Export) -> Result<String, Failure> {
    document(|xml| write(xml, export))
}

fn write(xml: &mut Writer<Vec<u8>>, export: &Export) -> std::io::Result<()> {
    let names = [("xmlns", "http://www.opengis.net/kml/2.2"), ("xmlns:gx", "http://www.google.com/kml/ext/2.2")];
    xml.create_element("kml").with_attributes(names).write_inner_content(|xml| {
        xml.create_element("Document").write_inner_content(|xml| {
            element(xml, "name", &export.name)?;
            for (kind, title) in [("uav", "UAVs"), ("track", "Tracks")] {
                folder(xml, title, |xml| {
                    export.paths.iter().filter(|path| path.kind == kind).try_for_each(|path| track(xml, export, path))
                })?;
            }
            for (kind, title) in
                [("orbit", "Orbits"), ("field of view", "Fields of view"), ("uncertainty", "Uncertainties, 95 %")]
            {
                folder(xml, title, |xml| {
                    export.outlines.iter().filter(|of| of.kind == kind).try_for_each(|of| {
                        placemark(xml, export, &of.name, [of.begin_s, of.end_s], |xml| {
                            let points = of
                                .ring
                                .iter()
                                .map(|[longitude_deg, latitude_deg]| format!("{longitude_deg},{latitude_deg}"));
                            let points = points.collect::<Vec<_>>().join(" ");
                            xml.create_element("LineString")
                                .write_inner_content(|xml| element(xml, "coordinates", &points))?;
                            Ok(())
                        })
                    })
                })?;
            }
            folder(xml, "Gaps", |xml| {
                export.gaps.iter().try_for_each(|gap| {
                    let name = format!("{}: {}", gap.name, gap.cause);
                    placemark(xml, export, &name, [gap.begin_s, gap.end_s], |xml| {
                        let [longitude_deg, latitude_deg] = gap.at;
                        let at = format!("{longitude_deg},{latitude_deg}");
                        xml.create_element("Point").write_inner_content(|xml| element(xml, "coordinates", &at))?;
                        Ok(())
                    })
                })
            })
        })?;
        Ok(())
    })?;
    Ok(())
}

fn folder(
    xml: &mut Writer<Vec<u8>>,
    title: &str,
    contents: impl Fn(&mut Writer<Vec<u8>>) -> std::io::Result<()>,
) -> std::io::Result<()> {
    xml.create_element("Folder").write_inner_content(|xml| {
        element(xml, "name", title)?;
        contents(xml)
    })?;
    Ok(())
}

fn placemark(
    xml: &mut Writer<Vec<u8>>,
    export: &Export,
    name: &str,
    [begin_s, end_s]: [f64; 2],
    geometry: impl Fn(&mut Writer<Vec<u8>>) -> std::io::Result<()>,
) -> std::io::Result<()> {
    xml.create_element("Placemark").write_inner_content(|xml| {
        element(xml, "name", name)?;
        xml.create_element("TimeSpan").write_inner_content(|xml| {
            element(xml, "begin", &export.utc(begin_s))?;
            element(xml, "end", &export.utc(end_s))
        })?;
        geometry(xml)
    })?;
    Ok(())
}

fn track(xml: &mut Writer<Vec<u8>>, export: &Export, path: &Path) -> std::io::Result<()> {
    let times = |xml: &mut Writer<Vec<u8>>| {
        let is_absolute = path.fixes.iter().all(|fix| fix.altitude_m.is_some());
        element(xml, "altitudeMode", if is_absolute { "relativeToGround" } else { "clampToGround" })?;
        path.fixes.iter().try_for_each(|fix| element(xml, "when", &export.utc(fix.time_s)))?;
        path.fixes.iter().try_for_each(|fix| {
            let [longitude_deg, latitude_deg] = fix.at;
            element(xml, "gx:coord", &format!("{longitude_deg} {latitude_deg} {}", fix.altitude_m.unwrap_or(0.0)))
        })
    };
    xml.create_element("Placemark").write_inner_content(|xml| {
        element(xml, "name", &path.name)?;
        xml.create_element("gx:Track").write_inner_content(times)?;
        Ok(())
    })?;
    Ok(())
}
