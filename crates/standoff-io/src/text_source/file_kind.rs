//! Recognises by its first bytes a file that cannot be read as text.

use super::lines::{Fault, Position};
use crate::bounded_input::wide_encoding;

/// Number of first bytes that are examined.
pub(super) const HEAD: u64 = 10;

pub(super) const GZIP: &[u8] = &[0x1f, 0x8b];

/// Compression formats other than gzip: first bytes, name, and the program that unpacks it. The block size of bzip2 is
/// its default.
const PACKED: &[(&[u8], &str, &str)] = &[
    (&[0x28, 0xb5, 0x2f, 0xfd], "zstd", "zstd -d"),
    (b"\xfd7zXZ\0", "xz", "xz -d"),
    (b"BZh91AY&SY", "bzip2", "bzip2 -d"),
    (b"PK\x03\x04", "zip", "unzip"),
    (b"7z\xbc\xaf\x27\x1c", "7z", "7z x"),
    (&[0x04, 0x22, 0x4d, 0x18], "lz4", "lz4 -d"),
    (&[0x1f, 0x9d], "compress", "uncompress"),
];

/// Rejects a file that is compressed in another way than gzip, by its first bytes.
pub(super) fn check_packing(head: &[u8]) -> Result<(), Fault> {
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

    use super::super::tests::read;
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
