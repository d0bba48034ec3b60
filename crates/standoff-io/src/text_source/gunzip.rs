//! Unpacks gzip: one or more members, and zeros after them, which tape archives add.

use std::io::{self, BufRead, BufReader, Read};

use flate2::bufread::GzDecoder;

use super::Fault;
use super::file_kind::GZIP;

/// Text of a gzip file.
pub(super) struct Gunzip<R> {
    /// The member that is being unpacked; `None` after the last one.
    member: Option<GzDecoder<BufReader<R>>>,
}

impl<R: Read> Gunzip<R> {
    pub(super) fn new(packed: R) -> Self {
        Self { member: Some(GzDecoder::new(BufReader::new(packed))) }
    }
}

impl<R: Read> Read for Gunzip<R> {
    fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
        while let Some(member) = &mut self.member {
            let count = member.read(out)?;
            if count > 0 || out.is_empty() {
                return Ok(count);
            }
            self.member = self.member.take().map(|member| next_member(member.into_inner())).transpose()?.flatten();
        }
        Ok(0)
    }
}

/// Returns the member that begins here; `None` at the end. Fails if something else follows.
fn next_member<R: Read>(mut packed: BufReader<R>) -> io::Result<Option<GzDecoder<BufReader<R>>>> {
    let mut has_zeros = false;
    loop {
        let next = packed.fill_buf()?;
        let zeros = next.iter().take_while(|&&byte| byte == 0).count();
        match next.first() {
            None => return Ok(None),
            Some(0) => has_zeros = true,
            Some(&byte) if byte == GZIP[0] && !has_zeros => return Ok(Some(GzDecoder::new(packed))),
            Some(_) => {
                let message = "other bytes follow the gzip data; remove them, or unpack the file with gunzip, which \
                               ignores them";
                return Err(Fault::whole(message.to_owned()).into());
            }
        }
        packed.consume(zeros);
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use flate2::Compression;
    use flate2::write::GzEncoder;

    use super::super::tests::read;

    #[test]
    fn bytes_after_the_gzip_data_are_named_unless_they_are_zeros() {
        let packed = |text: &str| {
            let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
            encoder.write_all(text.as_bytes()).unwrap();
            encoder.finish().unwrap()
        };
        let member = packed("t,id\n");
        let followed_by = |rest: &[u8]| read(&[&member, rest].concat());
        assert_eq!(followed_by(&packed("1,a")).unwrap(), "t,id\n1,a");
        assert_eq!(followed_by(&[0; 20_000]).unwrap(), "t,id\n");
        assert_eq!(followed_by(&[&packed(""), &[0; 3][..]].concat()).unwrap(), "t,id\n");
        for rest in [&b"1,a\n"[..], b"\0\0x", b"\0\x1f\x8b"] {
            let fault = followed_by(rest).unwrap_err();
            assert!(fault.message.starts_with("other bytes follow the gzip data; remove them"), "{fault}");
        }
        assert!(followed_by(&member[..15]).unwrap_err().message.starts_with("the gzip data end too early"));
    }
}
