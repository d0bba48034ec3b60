//! A file that several read at a time: each read says where, so that nobody moves another's place.

use std::fs::File;
use std::io::{self, Read};
use std::sync::Arc;

use bytes::Bytes;
use parquet::errors::Result;
use parquet::file::reader::{ChunkReader, Length};

/// An open file, read at places that are told.
#[derive(Clone)]
pub(crate) struct Positional(pub(crate) Arc<File>);

#[cfg(unix)]
fn read_at(file: &File, buffer: &mut [u8], at: u64) -> io::Result<usize> {
    std::os::unix::fs::FileExt::read_at(file, buffer, at)
}

#[cfg(windows)]
fn read_at(file: &File, buffer: &mut [u8], at: u64) -> io::Result<usize> {
    std::os::windows::fs::FileExt::seek_read(file, buffer, at)
}

/// A read that goes on where it was.
pub(crate) struct From {
    file: Arc<File>,
    at: u64,
}

impl Read for From {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = read_at(&self.file, buffer, self.at)?;
        self.at += read as u64;
        Ok(read)
    }
}

impl Length for Positional {
    fn len(&self) -> u64 {
        self.0.metadata().map_or(0, |metadata| metadata.len())
    }
}

impl ChunkReader for Positional {
    type T = From;

    fn get_read(&self, at: u64) -> Result<From> {
        Ok(From { file: Arc::clone(&self.0), at })
    }

    fn get_bytes(&self, at: u64, length: usize) -> Result<Bytes> {
        // A length that is not true takes no memory.
        let mut bytes = Vec::new();
        let read = self.get_read(at)?.take(length as u64).read_to_end(&mut bytes)?;
        if read == length {
            return Ok(bytes.into());
        }
        Err(io::Error::new(io::ErrorKind::UnexpectedEof, format!("ends {} bytes too early", length - read)).into())
    }
}
