use std::io::{self, BufRead};
use std::ops::Range;

use crate::error::{Fault, LogError, LogErrorKind};

/// Longer lines than any robot writes: a 4 MiB line would hold half a million ranges.
const LONGEST_LINE: usize = 4 << 20;

/// The lines of a log, one at a time, in a buffer that is used again: memory does not grow with the log.
#[derive(Debug)]
pub(crate) struct Lines<R> {
    name: String,
    reader: R,
    line: Vec<u8>,
    number: u64,
}

impl<R: BufRead> Lines<R> {
    pub(crate) fn new(name: impl Into<String>, reader: R) -> Self {
        Self { name: name.into(), reader, line: Vec::new(), number: 0 }
    }

    /// Reads the next line, without its end; `false` at the end of the log.
    pub(crate) fn advance(&mut self) -> Result<bool, LogError> {
        self.line.clear();
        // `take` bounds what a file without line ends can make us hold.
        let limit = LONGEST_LINE as u64 + 1;
        let mut bounded = io::Read::take(&mut self.reader, limit);
        let count = bounded.read_until(b'\n', &mut self.line).map_err(|error| io_error(&self.name, error))?;
        if count == 0 {
            return Ok(false);
        }
        self.number += 1;
        if self.line.len() > LONGEST_LINE {
            return Err(self.error(LogErrorKind::LineTooLong { limit: LONGEST_LINE }));
        }
        while self.line.last().is_some_and(|byte| matches!(byte, b'\n' | b'\r')) {
            self.line.pop();
        }
        if self.number == 1 && self.line.contains(&0) {
            return Err(self.error(LogErrorKind::Binary));
        }
        Ok(true)
    }

    /// The present line, unless a disk that lost its power left zeros in it.
    pub(crate) fn text(&self) -> Result<&[u8], Fault> {
        match self.line.iter().position(|byte| *byte == 0) {
            Some(at) => Err(Fault { kind: LogErrorKind::ZeroByte, span: Some(at..at + 1) }),
            None => Ok(&self.line),
        }
    }

    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// `fault` with the position of the present line.
    pub(crate) fn fault(&self, fault: Fault) -> LogError {
        fault.at(&self.name, self.number, &self.line)
    }

    /// An error about the present line as a whole.
    pub(crate) fn error(&self, kind: LogErrorKind) -> LogError {
        LogError { name: self.name.clone(), line: self.number, column: 0, excerpt: None, kind }
    }
}

/// The error of the operating system or of the decompressor, told apart.
pub(crate) fn io_error(name: &str, error: io::Error) -> LogError {
    let kind = match error.kind() {
        io::ErrorKind::IsADirectory => LogErrorKind::Directory,
        io::ErrorKind::UnexpectedEof | io::ErrorKind::InvalidInput | io::ErrorKind::InvalidData => {
            LogErrorKind::Gzip(error)
        }
        _ => LogErrorKind::Read(error),
    };
    LogError::whole(name, kind)
}

/// A word of a line and where it stands.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Word<'a> {
    pub(crate) text: &'a [u8],
    start: usize,
}

impl Word<'_> {
    pub(crate) fn span(&self) -> Range<usize> {
        self.start..self.start + self.text.len()
    }
}

/// The words of a line, split at white space, read one after the other.
#[derive(Debug, Clone)]
pub(crate) struct Words<'a> {
    line: &'a [u8],
    at: usize,
}

impl<'a> Words<'a> {
    pub(crate) fn new(line: &'a [u8]) -> Self {
        Self { line, at: 0 }
    }

    /// The next word; an empty one at the end of the line.
    pub(crate) fn word(&mut self) -> Word<'a> {
        let rest = &self.line[self.at..];
        let start = self.at + rest.iter().position(|byte| !byte.is_ascii_whitespace()).unwrap_or(rest.len());
        let rest = &self.line[start..];
        let length = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        self.at = start + length;
        Word { text: &self.line[start..self.at], start }
    }

    /// Whether only white space is left.
    pub(crate) fn at_end(&self) -> bool {
        self.line[self.at..].iter().all(u8::is_ascii_whitespace)
    }

    /// A finite number; `what` says which, with its unit.
    pub(crate) fn number(&mut self, what: &str) -> Result<f64, Fault> {
        let word = self.word();
        match parse(word.text) {
            Some(value) if value.is_finite() => Ok(value),
            _ => Err(self.not(word, what)),
        }
    }

    /// A finite number that is not negative.
    pub(crate) fn length(&mut self, what: &str) -> Result<f64, Fault> {
        let word = self.word();
        match parse(word.text) {
            Some(value) if value.is_finite() && value >= 0.0 => Ok(value),
            _ => Err(self.not(word, what)),
        }
    }

    /// How many of something follow, at most `limit`.
    pub(crate) fn count(&mut self, what: &str, limit: usize) -> Result<usize, Fault> {
        let word = self.word();
        let count = std::str::from_utf8(word.text).ok().and_then(|text| text.parse().ok());
        count.filter(|count| *count <= limit).ok_or_else(|| self.not(word, format!("{what} (at most {limit})")))
    }

    /// Steps over `count` words that are not looked at; `what` says which.
    pub(crate) fn skip(&mut self, count: usize, what: &str) -> Result<(), Fault> {
        (0..count).try_for_each(|_| {
            let word = self.word();
            if word.text.is_empty() { Err(self.not(word, what)) } else { Ok(()) }
        })
    }

    /// The fault that `word` is not what was expected.
    pub(crate) fn not(&self, word: Word<'_>, expected: impl Into<String>) -> Fault {
        Fault::field(self.line, word.span(), expected)
    }
}

/// The number that `text` spells.
pub(crate) fn parse(text: &[u8]) -> Option<f64> {
    std::str::from_utf8(text).ok()?.parse().ok()
}
