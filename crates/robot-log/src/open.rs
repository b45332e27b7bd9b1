use std::io::{self, BufRead, Read};

use crate::carmen::{CarmenOptions, CarmenReader};
use crate::csv::{CsvReader, is_about};
use crate::description::RobotDescription;
use crate::entry::Entry;
use crate::error::{LogError, LogErrorKind};
use crate::merge::Merge;
use crate::report::LogReport;
use crate::rsf::RsfReader;
use crate::source::Source;

/// One file of a log: its name, for errors, and its bytes, plain or compressed with gzip.
pub struct Input {
    /// What errors call it.
    pub name: String,
    /// Its bytes.
    pub reader: Box<dyn BufRead + Send>,
}

impl std::fmt::Debug for Input {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Input").field("name", &self.name).finish_non_exhaustive()
    }
}

impl Input {
    /// The file `name` that `reader` reads.
    pub fn new(name: impl Into<String>, reader: impl BufRead + Send + 'static) -> Self {
        Self { name: name.into(), reader: Box::new(reader) }
    }
}

impl Read for Input {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.reader.read(buffer)
    }
}

impl BufRead for Input {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        self.reader.fill_buf()
    }

    fn consume(&mut self, count: usize) {
        self.reader.consume(count);
    }
}

/// How to read a log of any kind.
#[derive(Debug, Clone, Default)]
pub struct ReadOptions {
    /// What CARMEN logs leave open, and whether faulty lines are left out (of any log).
    pub carmen: CarmenOptions,
    /// The robot whose tables of numbers the files are; CARMEN logs need none.
    pub robot: Option<RobotDescription>,
}

/// A log of any kind that this crate reads, as a stream of entries in the order of their stamps.
///
/// Several files are read side by side and merged; entries of equal stamp come in the order of the files.
#[derive(Debug)]
pub struct LogReader {
    files: Merge<Stream>,
    done: bool,
}

/// One file of a log.
#[derive(Debug)]
pub(crate) enum Stream {
    Carmen(Box<CarmenReader<Input>>),
    Csv(Box<CsvReader<Input>>),
    Rsf(RsfReader),
}

/// Opens a log that may consist of several `inputs`; the first bytes of each tell what it is.
///
/// # Errors
///
/// No input, an input that cannot be read, is not text, or is a table that needs a robot description.
pub fn open_log(inputs: Vec<Input>, options: &ReadOptions) -> Result<LogReader, LogError> {
    if inputs.is_empty() {
        return Err(LogError::whole("log", LogErrorKind::Empty));
    }
    let files = in_order(inputs, options.robot.as_ref()).into_iter();
    let files = files.map(|input| Stream::open(input, options)).collect::<Result<_, _>>()?;
    Ok(LogReader { files: Merge::new(files), done: false })
}

/// At equal stamps odometry must come before scans: the files in the order in which the description names them.
fn in_order(mut inputs: Vec<Input>, robot: Option<&RobotDescription>) -> Vec<Input> {
    if let Some(robot) = robot {
        inputs.sort_by_key(|input| robot.tables().iter().position(|table| is_about(table, &input.name)));
    }
    inputs
}

impl Stream {
    fn open(input: Input, options: &ReadOptions) -> Result<Self, LogError> {
        let name = input.name.clone();
        let Source { reader, head } = Source::new(&name, input)?;
        match &options.robot {
            Some(_) if head.contains(&0) => Err(LogError::whole(name, LogErrorKind::Binary)),
            Some(robot) => CsvReader::from_source(name, reader, robot, options.carmen.lenient)
                .map(|reader| Self::Csv(Box::new(reader))),
            None if RsfReader::recognizes(&head) => {
                RsfReader::from_source(name, reader, options.carmen.lenient).map(Self::Rsf)
            }
            None => CarmenReader::from_source(name, reader, &head, options.carmen.clone())
                .map(|reader| Self::Carmen(Box::new(reader))),
        }
    }
}

impl LogReader {
    /// What was read, passed over and skipped so far, of each file in the order given.
    pub fn reports(&self) -> impl Iterator<Item = &LogReport> {
        self.files.streams().map(|stream| match stream {
            Stream::Carmen(reader) => reader.report(),
            Stream::Csv(reader) => reader.report(),
            Stream::Rsf(reader) => reader.report(),
        })
    }
}

impl Iterator for LogReader {
    type Item = Result<Entry, LogError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.done {
            return None;
        }
        let step = self.files.next();
        self.done = !matches!(step, Some(Ok(_)));
        step
    }
}

impl Iterator for Stream {
    type Item = Result<Entry, LogError>;

    fn next(&mut self) -> Option<Self::Item> {
        match self {
            Self::Carmen(reader) => reader.next(),
            Self::Csv(reader) => reader.next(),
            Self::Rsf(reader) => reader.next(),
        }
    }
}
