use std::collections::BTreeMap;
use std::io::{self, BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use robot_log::{CarmenOptions, Entry, Input, LogError, LogReader, LogReport, ReadOptions, open_log};

use crate::failure::{DESCRIBE, Failure};
use crate::files;

/// A log that is being read: how far, and, where something is wrong with it, what is wrong with all of it.
pub(crate) struct Log {
    reader: LogReader,
    /// Bytes taken in so far, of compressed files as they lie on the disk.
    taken: Arc<AtomicU64>,
    size: Option<u64>,
    files: Files,
}

/// The files of a log and how they are read.
struct Files {
    paths: Vec<PathBuf>,
    options: ReadOptions,
}

/// So many faults are told of.
const TOLD: usize = 10;

impl Log {
    /// Opens the log that consists of the files `paths`; `-` is standard input.
    pub(crate) fn open(paths: &[PathBuf], options: ReadOptions) -> Result<Self, Failure> {
        let (taken, files) = (Arc::new(AtomicU64::new(0)), Files { paths: paths.to_owned(), options });
        let inputs = paths.iter().map(|path| input(path, &taken)).collect::<Result<_, Failure>>()?;
        let reader = open_log(inputs, &files.options).map_err(|error| files.refused(&error))?;
        let length = |path: &PathBuf| path.metadata().ok().filter(std::fs::Metadata::is_file).map(|file| file.len());
        let size = paths.iter().map(length).sum::<Option<u64>>().filter(|size| *size > 0);
        Ok(Self { reader, taken, size, files })
    }

    /// A log that the program carries with it.
    pub(crate) fn bundled(name: &str, bytes: &'static [u8]) -> Result<Self, Failure> {
        let taken = Arc::new(AtomicU64::new(0));
        let counted = Counted { bytes, taken: Arc::clone(&taken) };
        let files = Files { paths: Vec::new(), options: ReadOptions::default() };
        let reader = open_log(vec![Input::new(name, counted)], &files.options)?;
        Ok(Self { reader, taken, size: Some(bytes.len() as u64), files })
    }

    /// Bytes of all its files; `None` where that is not known before they are read.
    pub(crate) fn size(&self) -> Option<u64> {
        self.size
    }

    /// Bytes taken in so far.
    pub(crate) fn taken(&self) -> u64 {
        self.taken.load(Ordering::Relaxed)
    }

    /// What was read, passed over and skipped so far, of each file.
    pub(crate) fn reports(&self) -> impl Iterator<Item = &LogReport> {
        self.reader.reports()
    }
}

impl Iterator for Log {
    type Item = Result<Entry, Failure>;

    fn next(&mut self) -> Option<Self::Item> {
        Some(self.reader.next()?.map_err(|error| self.files.refused(&error)))
    }
}

impl Files {
    /// The failure that a fault is, with all others of the same files: whoever mends a log wants to know of all.
    fn refused(&self, error: &LogError) -> Failure {
        let failure = Failure::from(error);
        let Some(log) = self.looked_through().filter(|_| error.kind.is_local()) else { return failure };
        let failure = if log.reports().all(|report| report.entries == 0) { failure.help(DESCRIBE) } else { failure };
        let mut kinds: BTreeMap<&'static str, u64> = BTreeMap::new();
        for (kind, count) in log.reports().flat_map(|report| &report.skipped) {
            *kinds.entry(kind).or_default() += count;
        }
        let errors = log.reports().flat_map(|report| &report.errors);
        let mut others: Vec<&LogError> =
            errors.filter(|other| (other.line, &other.name) != (error.line, &error.name)).collect();
        others.sort_by_key(|other| other.kind.code());
        others.truncate(TOLD - 1);
        failure.among(others.into_iter().map(Failure::from).collect(), kinds)
    }

    /// All files read to their end; `None` where they cannot be read twice.
    fn looked_through(&self) -> Option<LogReader> {
        let inputs: Vec<Input> = self
            .paths
            .iter()
            .map(|path| path.is_file().then(|| input(path, &Arc::default()).ok()).flatten())
            .collect::<Option<_>>()
            .filter(|inputs: &Vec<Input>| !inputs.is_empty())?;
        let carmen = CarmenOptions { lenient: true, ..self.options.carmen.clone() };
        let mut log = open_log(inputs, &ReadOptions { carmen, ..self.options.clone() }).ok()?;
        while let Some(Ok(_)) = log.next() {}
        Some(log)
    }
}

/// The file, or standard input for `-`, with what was taken in of it added to `taken`.
fn input(path: &Path, taken: &Arc<AtomicU64>) -> Result<Input, Failure> {
    let taken = Arc::clone(taken);
    if path.as_os_str() == "-" {
        return Ok(Input::new("standard input", Counted { bytes: BufReader::new(io::stdin()), taken }));
    }
    Ok(Input::new(path.display().to_string(), Counted { bytes: files::open(path)?, taken }))
}

/// Counts what is taken in.
struct Counted<R> {
    bytes: R,
    taken: Arc<AtomicU64>,
}

impl<R: BufRead> Read for Counted<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let count = self.bytes.read(buffer)?;
        self.taken.fetch_add(count as u64, Ordering::Relaxed);
        Ok(count)
    }
}

impl<R: BufRead> BufRead for Counted<R> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        self.bytes.fill_buf()
    }

    fn consume(&mut self, count: usize) {
        self.bytes.consume(count);
        self.taken.fetch_add(count as u64, Ordering::Relaxed);
    }
}
