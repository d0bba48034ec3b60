//! Recognises by its first bytes a file that cannot be read as text.

use super::expectation::Expectation;
use super::lines::{Fault, Position};
use crate::bounded_input::wide_encoding;

/// Number of first bytes that are examined.
pub(super) const HEAD: u64 = 96;

pub(super) const GZIP: &[u8] = &[0x1f, 0x8b];

/// Compression formats other than gzip: first bytes, name, and the program that unpacks it. The block size of bzip2 is
/// its default.
const PACKED: &[(&[u8], &str, &str)] = &[
    (&[0x28, 0xb5, 0x2f, 0xfd], "zstd", "zstd -d"),
    (b"\xfd7zXZ\0", "xz", "xz -d"),
    (b"BZh91AY&SY", "bzip2", "bzip2 -d"),
    (ZIP, "zip", "unzip"),
    (b"7z\xbc\xaf\x27\x1c", "7z", "7z x"),
    (&[0x04, 0x22, 0x4d, 0x18], "lz4", "lz4 -d"),
    (&[0x1f, 0x9d], "compress", "uncompress"),
];

/// A binary format of maps or tables.
struct Binary {
    /// Place of the bytes that identify it.
    at: usize,
    bytes: &'static [u8],
    name: &'static str,
    /// Text format of a map to convert it to, and how.
    map: &'static str,
    /// Text format of tracks; `None` if the format is recognised elsewhere.
    tracks: Option<&'static str>,
}

impl Binary {
    const fn map(at: usize, bytes: &'static [u8], name: &'static str, map: &'static str) -> Self {
        Self { at, bytes, name, map, tracks: Some("CSV with the columns time, vehicle, lat and lon") }
    }

    const fn table(at: usize, bytes: &'static [u8], name: &'static str) -> Self {
        Self { map: "GeoJSON", tracks: Some("CSV in UTF-8"), ..Self::map(at, bytes, name, "") }
    }

    fn is_at_start_of(&self, head: &[u8]) -> bool {
        let is_packed = self.at < NAME_IN_ZIP || head.starts_with(ZIP);
        is_packed && head.get(self.at..).is_some_and(|rest| rest.starts_with(self.bytes))
    }
}

const OGR: &str = "GeoJSON, with ogr2ogr -f GeoJSON -t_srs EPSG:4326 NEW.geojson FILE";
const OSM: &str = "GeoJSON, with osmium export FILE -o NEW.geojson";
const ZIP: &[u8] = b"PK\x03\x04";
/// Place of the name of the first file in a zip archive.
const NAME_IN_ZIP: usize = 30;

static BINARY: [Binary; 11] = [
    Binary::map(0, &[0, 0, 0x27, 0x0a], "a Shapefile", OGR),
    Binary::map(0, b"SQLite format 3\0", "a GeoPackage or another SQLite database", OGR),
    Binary::map(0, b"fgb\x03", "FlatGeobuf", OGR),
    Binary::map(4, b"\x0a\x09OSMHeader", "OpenStreetMap PBF", OSM),
    Binary::map(0, b"II*\0", "a TIFF image", "GeoJSON: digitise its outlines"),
    Binary::map(0, b"MM\0*", "a TIFF image", "GeoJSON: digitise its outlines"),
    Binary::map(NAME_IN_ZIP, b"doc.kml", "KMZ", OGR),
    Binary { tracks: None, ..Binary::map(0, b"PAR1", "Parquet", OGR) },
    Binary::table(0, b"\xd0\xcf\x11\xe0", "a workbook of Excel"),
    Binary::table(NAME_IN_ZIP, b"[Content_Types].xml", "a workbook of Excel"),
    Binary::table(NAME_IN_ZIP, b"mimetypeapplication/vnd.oasis", "an OpenDocument file"),
];

/// Rejects a binary file and one that is compressed in another way than gzip, by its first bytes.
pub(super) fn check_kind(head: &[u8], expected: &Expectation) -> Result<(), Fault> {
    let way = |binary: &'static Binary| if expected.is_map { Some(binary.map) } else { binary.tracks };
    let mut found = BINARY.iter().filter(|binary| binary.is_at_start_of(head));
    if let Some((name, way)) = found.find_map(|binary| Some((binary.name, way(binary)?))) {
        return Err(Fault::whole(format!("is {name}; must be {}; convert it to {way}", expected.formats)));
    }
    let Some((_, name, unpack)) = PACKED.iter().find(|(begin, ..)| head.starts_with(begin)) else { return Ok(()) };
    Err(Fault::whole(format!(
        "is compressed with {name}; must be plain text or gzip; decompress it first, with {unpack}"
    )))
}

/// Rejects UTF-16 and UTF-32 text by its first bytes, with or without a byte order mark.
pub(super) fn check_encoding(head: &[u8]) -> Result<(), Fault> {
    let Some(name) = wide_encoding(head) else { return Ok(()) };
    let message =
        format!("is {name} text; must be UTF-8; save the file as UTF-8, or convert it with iconv -f {name} -t UTF-8");
    Err(Fault::at(Position::START, message))
}

#[cfg(test)]
mod tests {
    use flate2::Compression;
    use flate2::write::GzEncoder;
    use std::io::Write;

    use super::super::tests::{TRAFFIC, read};
    use super::*;

    fn gzip(bytes: &[u8]) -> Vec<u8> {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
        encoder.write_all(bytes).unwrap();
        encoder.finish().unwrap()
    }

    #[test]
    fn other_compression_formats_are_named() {
        for (head, name) in [
            (&b"\x28\xb5\x2f\xfd\x04\x00\x99"[..], "zstd"),
            (b"\xfd7zXZ\0\x00\x04\xe6", "xz"),
            (b"BZh91AY&SY\x05\x00", "bzip2"),
            (b"PK\x03\x04\x14\x00", "zip"),
            (b"7z\xbc\xaf\x27\x1c\x00\x04", "7z"),
            (b"\x04\x22\x4d\x18\x64", "lz4"),
            (b"\x1f\x9d\x90", "compress"),
        ] {
            let expected = format!("is compressed with {name}; must be plain text or gzip; decompress it first, with ");
            let fault = read(head).unwrap_err();
            assert!(fault.message.starts_with(&expected), "{fault}");
        }
    }

    #[test]
    fn binary_formats_are_named_with_the_way_to_text() {
        let in_zip = |name: &str| [ZIP, &[0; 26], name.as_bytes(), &[0; 80]].concat();
        for (bytes, name, of_map, of_tracks) in [
            (b"\0\0\x27\x0a\0\0\0\0".to_vec(), "a Shapefile", "ogr2ogr", "CSV"),
            (b"SQLite format 3\0".to_vec(), "a GeoPackage or", "ogr2ogr", "CSV"),
            (b"\0\0\0\x0d\x0a\x09OSMHeader\x18|".to_vec(), "OpenStreetMap PBF", "osmium export", "CSV"),
            (in_zip("doc.kml"), "KMZ", "ogr2ogr", "CSV"),
            (in_zip("[Content_Types].xml"), "a workbook of Excel", "GeoJSON", "CSV in UTF-8"),
        ] {
            for (is_map, way) in [(true, of_map), (false, of_tracks)] {
                let expected = Expectation { is_map, ..TRAFFIC };
                let fault = check_kind(&bytes, &expected).unwrap_err().message;
                assert!(fault.starts_with(&format!("is {name}")) && fault.contains(way), "{fault}");
            }
        }
        let packed = read(&gzip(b"SQLite format 3\0")).unwrap_err().message;
        assert!(
            packed.starts_with("once decompressed, it is a GeoPackage or another SQLite database; must"),
            "{packed}"
        );
        assert!(check_kind(b"PAR1", &TRAFFIC).is_ok(), "Parquet can be traffic");
        assert!(check_kind(b"fgb,t,id", &TRAFFIC).is_ok());
        assert!(check_kind(&in_zip("a.csv"), &TRAFFIC).unwrap_err().message.starts_with("is compressed with zip"));
    }

    #[test]
    fn text_that_begins_like_a_compressed_file_is_text() {
        for column in ["BZh9", "PK", "7z"] {
            let text = format!("{column},t,id,x,y\n0,1,v,3,4");
            assert_eq!(read(text.as_bytes()).unwrap(), text);
        }
    }

    #[test]
    fn utf_16_and_utf_32_text_is_named() {
        let wide = |text: &str| {
            let units: Vec<u16> = text.encode_utf16().collect();
            let characters: Vec<u32> = text.chars().map(u32::from).collect();
            [
                ("UTF-16", units.iter().flat_map(|unit| unit.to_le_bytes()).collect::<Vec<u8>>()),
                ("UTF-16", units.iter().flat_map(|unit| unit.to_be_bytes()).collect()),
                ("UTF-32", characters.iter().flat_map(|c| c.to_le_bytes()).collect()),
                ("UTF-32", characters.iter().flat_map(|c| c.to_be_bytes()).collect()),
            ]
        };
        for text in ["t,id,x,y\n1,v,3,4\n", "<fcd-export/>"] {
            for (name, bytes) in [wide(text), wide(&format!("\u{feff}{text}"))].concat() {
                let expected = format!("is {name} text; must be UTF-8; save the file as UTF-8, or convert it");
                for bytes in [gzip(&bytes), bytes] {
                    let fault = read(&bytes).unwrap_err();
                    assert!(fault.message.starts_with(&expected), "{fault}");
                    assert_eq!(fault.position, Some(Position::START));
                }
            }
        }
    }
}
