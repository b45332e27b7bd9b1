use std::collections::VecDeque;
use std::io::BufRead;

use crate::clock::Watch;
use crate::description::{RobotDescription, Table};
use crate::entry::Entry;
use crate::error::{Fault, LogError, LogErrorKind};
use crate::lines::Lines;
use crate::report::LogReport;
use crate::source::{Decoded, Source};
use crate::told::{Grammar, Told};

mod dead_reckoning;
mod fields;
mod path;
mod ranges;
mod row;

use dead_reckoning::DeadReckoning;
use fields::Fields;
use path::Path;

/// A table of numbers of a described robot, plain or compressed with gzip, as a stream of entries.
///
/// A line gives, in this order: its odometry where it has a heading or no ranges, its heading, and its scans with the odometry of the line.
/// Blank lines and lines that begin with `#` are no rows.
///
/// ```
/// use robot_log::{CsvReader, EntryKind, RobotDescription};
///
/// let robot = RobotDescription::builtin("bigwheel").unwrap();
/// let text = "2,2,51,72,89,10,60,472,496\n14,16,52,64,95,10,60,469,497\n";
/// let entries = CsvReader::new("garden.csv", text.as_bytes(), &robot, false)?.collect::<Result<Vec<_>, _>>()?;
/// let EntryKind::Gyro { heading, .. } = entries[1].kind else { panic!() };
/// assert_eq!(heading.radians(), -51f64.to_radians()); // its gyro counts clockwise
/// # Ok::<(), robot_log::LogError>(())
/// ```
#[derive(Debug)]
pub struct CsvReader<R>(Told<Decoded<R>, Rows>);

impl<R: BufRead> CsvReader<R> {
    /// Starts to read the file `name` of `robot`; `lenient` leaves faulty lines out and counts them.
    ///
    /// # Errors
    ///
    /// The first bytes cannot be read or are not text, or no table of the robot is about a file of this name.
    pub fn new(name: impl Into<String>, reader: R, robot: &RobotDescription, lenient: bool) -> Result<Self, LogError> {
        let name = name.into();
        let Source { reader, head } = Source::new(&name, reader)?;
        if head.contains(&0) {
            return Err(LogError::whole(name, LogErrorKind::Binary));
        }
        Self::from_source(name, reader, robot, lenient)
    }

    pub(crate) fn from_source(
        name: String,
        reader: Decoded<R>,
        robot: &RobotDescription,
        lenient: bool,
    ) -> Result<Self, LogError> {
        let rows = Rows::new(&name, robot, lenient).map_err(|kind| LogError::whole(name.as_str(), kind))?;
        Ok(Self(Told::new(Lines::new(name, reader), rows)))
    }

    /// What was read and skipped so far.
    #[must_use]
    pub fn report(&self) -> &LogReport {
        self.0.report()
    }
}

impl<R: BufRead> Iterator for CsvReader<R> {
    type Item = Result<Entry, LogError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.0.next()
    }
}

/// Understands the rows of one file, given what earlier rows added up to.
#[derive(Debug)]
struct Rows {
    robot: RobotDescription,
    /// The tables of the robot that are about this file.
    tables: Vec<Table>,
    fields: Fields,
    odometry: DeadReckoning,
    path: Path,
    /// The stamp of the latest entry.
    given: f64,
    watch: Watch,
    /// The stamp of the latest row of a file without stamps.
    counted: Option<f64>,
    lines: u64,
    lenient: bool,
}

impl Grammar for Rows {
    fn read(&mut self, line: &[u8], told: &mut VecDeque<Entry>, report: &mut LogReport) -> Result<(), Fault> {
        self.lines += 1;
        let text = line.trim_ascii();
        if text.is_empty() || text[0] == b'#' || self.tables.iter().any(|table| self.lines <= table.header_lines) {
            return Ok(());
        }
        let Some(index) = (0..self.tables.len()).find(|index| self.is_row_of(line, *index)) else {
            let tags: Vec<&str> = self.tables.iter().filter_map(|table| table.tag.as_deref()).collect();
            let first = self.fields.span(line, Some(0));
            return Err(Fault::field(line, first, format!("a line of the kinds `{}`", tags.join("`, `"))));
        };
        if self.tables[index].ignore {
            report.pass_over(self.fields.tag());
            return Ok(());
        }
        row::read(self, index, line, told, report)
    }

    fn is_lenient(&self) -> bool {
        self.lenient
    }

    fn nothing(&self, _report: &LogReport) -> LogErrorKind {
        LogErrorKind::Empty
    }
}

impl Rows {
    /// Rows may lie so many seconds behind the latest, as the lines of a CARMEN log may.
    const HOLD: f64 = 1.0;

    fn new(name: &str, robot: &RobotDescription, lenient: bool) -> Result<Self, LogErrorKind> {
        let tables: Vec<Table> = robot.tables().iter().filter(|table| is_about(table, name)).cloned().collect();
        if tables.is_empty() {
            let patterns: Vec<&str> = robot.tables().iter().filter_map(|table| table.file.as_deref()).collect();
            let known = patterns.join("`, `");
            return Err(LogErrorKind::Description(format!(
                "no table of the robot `{}` is about a file of this name; its files are called `{known}`",
                robot.name()
            )));
        }
        Ok(Self {
            robot: robot.clone(),
            tables,
            fields: Fields::default(),
            odometry: DeadReckoning::default(),
            path: Path::default(),
            given: f64::NEG_INFINITY,
            watch: Watch::new(Self::HOLD),
            counted: None,
            lines: 0,
            lenient,
        })
    }

    /// Whether the line, cut as table `index` wants it, is a row of that table.
    fn is_row_of(&mut self, line: &[u8], index: usize) -> bool {
        let table = &self.tables[index];
        self.fields.cut(line, table.separator);
        table.tag.as_ref().is_none_or(|tag| tag.as_bytes() == self.fields.tag())
    }
}

/// Whether the table is about files called `name`, folders left aside.
pub(crate) fn is_about(table: &Table, name: &str) -> bool {
    let name = name.rsplit(['/', '\\']).next().unwrap_or(name);
    table.file.as_ref().is_none_or(|pattern| matches_pattern(pattern, name))
}

/// Whether `name` is `pattern`, in which every `*` stands for anything.
fn matches_pattern(pattern: &str, name: &str) -> bool {
    let mut parts = pattern.split('*');
    let first = parts.next().unwrap_or("");
    let Some(mut rest) = name.strip_prefix(first) else { return false };
    let mut parts: Vec<&str> = parts.collect();
    let Some(last) = parts.pop() else { return rest.is_empty() };
    for part in parts {
        let Some(at) = rest.find(part) else { return false };
        rest = &rest[at + part.len()..];
    }
    rest.ends_with(last)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patterns_match_names() {
        assert!(matches_pattern("*_od*", "run1_od.txt"));
        assert!(matches_pattern("*.cnt", "bakery1.cnt"));
        assert!(!matches_pattern("*.cnt", "bakery1.scn"));
        assert!(!matches_pattern("a*b*c", "ac"));
        assert!(matches_pattern("a*b*c", "a--b--c"));
        assert!(!matches_pattern("log", "logs"));
    }
}
