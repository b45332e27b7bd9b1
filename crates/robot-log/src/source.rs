use std::io::{BufRead, BufReader, Cursor, Read};

use flate2::bufread::MultiGzDecoder;

use crate::error::LogError;
use crate::lines::io_error;

/// So much of a log's beginning decides what it is.
const HEAD: usize = 64 << 10;

/// A log's bytes, decompressed, and a copy of their beginning.
pub(crate) struct Source<R> {
    pub(crate) reader: Decoded<R>,
    pub(crate) head: Vec<u8>,
}

/// The bytes of a log, with what was looked at first put back in front.
pub(crate) enum Decoded<R> {
    Plain(PutBack<R>),
    Gzip(Box<PutBack<BufReader<MultiGzDecoder<R>>>>),
}

type PutBack<R> = std::io::Chain<Cursor<Vec<u8>>, R>;

impl<R> std::fmt::Debug for Decoded<R> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Plain(_) => "Plain",
            Self::Gzip(_) => "Gzip",
        })
    }
}

impl<R: BufRead> Source<R> {
    /// Looks at the beginning of `reader`: unpacks gzip, and keeps the first 64 KiB of the text.
    pub(crate) fn new(name: &str, mut reader: R) -> Result<Self, LogError> {
        let gzip = reader.fill_buf().map_err(|error| io_error(name, error))?.starts_with(&[0x1f, 0x8b]);
        if gzip {
            let mut text = BufReader::with_capacity(HEAD, MultiGzDecoder::new(reader));
            let head = head_of(name, &mut text)?;
            Ok(Self { reader: Decoded::Gzip(Box::new(Cursor::new(head.clone()).chain(text))), head })
        } else {
            let head = head_of(name, &mut reader)?;
            Ok(Self { reader: Decoded::Plain(Cursor::new(head.clone()).chain(reader)), head })
        }
    }
}

fn head_of(name: &str, reader: &mut impl Read) -> Result<Vec<u8>, LogError> {
    let mut head = Vec::new();
    reader.take(HEAD as u64).read_to_end(&mut head).map_err(|error| io_error(name, error))?;
    Ok(head)
}

impl<R: BufRead> Read for Decoded<R> {
    fn read(&mut self, buffer: &mut [u8]) -> std::io::Result<usize> {
        match self {
            Self::Plain(reader) => reader.read(buffer),
            Self::Gzip(reader) => reader.read(buffer),
        }
    }
}

impl<R: BufRead> BufRead for Decoded<R> {
    fn fill_buf(&mut self) -> std::io::Result<&[u8]> {
        match self {
            Self::Plain(reader) => reader.fill_buf(),
            Self::Gzip(reader) => reader.fill_buf(),
        }
    }

    fn consume(&mut self, count: usize) {
        match self {
            Self::Plain(reader) => reader.consume(count),
            Self::Gzip(reader) => reader.consume(count),
        }
    }
}
