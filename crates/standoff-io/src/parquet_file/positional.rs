//! Positional reads: several readers share one open file without a common file position.

use std::fs::File;
use std::io::{self, BufReader, Read};
use std::sync::Arc;

use bytes::Bytes;
use parquet::errors::Result;
use parquet::file::reader::{ChunkReader, Length};

use crate::bounded_input::Input;

/// An open file that is read at explicit offsets.
#[derive(Debug)]
pub(super) struct Positional(pub(super) Arc<Input>);

#[cfg(unix)]
fn read_at(file: &File, buffer: &mut [u8], at: u64) -> io::Result<usize> {
    std::os::unix::fs::FileExt::read_at(file, buffer, at)
}

#[cfg(windows)]
fn read_at(file: &File, buffer: &mut [u8], at: u64) -> io::Result<usize> {
    std::os::windows::fs::FileExt::seek_read(file, buffer, at)
}

#[cfg(not(any(unix, windows)))]
fn read_at(_: &File, _: &mut [u8], _: u64) -> io::Result<usize> {
    Err(io::ErrorKind::Unsupported.into())
}

/// A sequential reader with its own offset.
pub(super) struct From {
    file: Arc<Input>,
    at: u64,
}

impl Read for From {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = match &*self.file {
            Input::Disk(file) => read_at(file, buffer, self.at)?,
            Input::Given(bytes) => {
                let bytes = bytes.get_ref();
                let at = usize::try_from(self.at).map_or(bytes.len(), |at| at.min(bytes.len()));
                (&bytes[at..]).read(buffer)?
            }
        };
        self.at += read as u64;
        Ok(read)
    }
}

impl Length for Positional {
    fn len(&self) -> u64 {
        match &*self.0 {
            Input::Disk(file) => file.metadata().map_or(0, |metadata| metadata.len()),
            Input::Given(bytes) => bytes.get_ref().len() as u64,
        }
    }
}

impl ChunkReader for Positional {
    type T = BufReader<From>;

    fn get_read(&self, at: u64) -> Result<Self::T> {
        Ok(BufReader::new(From { file: Arc::clone(&self.0), at }))
    }

    fn get_bytes(&self, at: u64, length: usize) -> Result<Bytes> {
        // Nothing is allocated up front: a damaged file may give a huge length.
        let mut bytes = Vec::new();
        let from = From { file: Arc::clone(&self.0), at };
        let read = from.take(length as u64).read_to_end(&mut bytes)?;
        if read == length {
            return Ok(bytes.into());
        }
        Err(io::Error::new(io::ErrorKind::UnexpectedEof, format!("ends {} bytes too early", length - read)).into())
    }
}
