use std::io::BufRead;

use local_grid::nalgebra::{Isometry2, Vector2};

use crate::entry::{Entry, EntryKind};
use crate::error::{Fault, LogError, LogErrorKind};
use crate::lines::{Lines, Words};
use crate::report::LogReport;
use crate::source::Decoded;

/// A log in the text form of libRSF (TU Chemnitz), of which the words for robots in the plane are understood.
///
/// | line | entry |
/// |---|---|
/// | `odom2 t vx vy omega` and three variances | [`EntryKind::Odometry`]; the velocities hold from `t` until the next such line |
/// | `loop t1 t2 similarity` | [`EntryKind::Recognition`] at the later of the two stamps |
/// | `point2 t x y` and four covariances | [`EntryKind::Truth`], with the heading of the `angle` line of the same stamp |
/// | `angle t theta` and its variance | the heading of the truth |
/// | any other word | none |
///
/// Such files hold one kind of line after the other, not one moment after the other.
/// So the whole file is read before its first entry is given: the one reader here whose memory grows with the log.
#[derive(Debug)]
pub(crate) struct RsfReader {
    entries: std::vec::IntoIter<Entry>,
    report: LogReport,
}

/// What was read so far, by kind.
#[derive(Debug, Default)]
struct Columns {
    odometry: Vec<Entry>,
    /// Velocities of the latest odometry line, from its stamp on.
    rates: Option<(f64, Isometry2<f64>, [f64; 3])>,
    points: Vec<(f64, Vector2<f64>)>,
    headings: Vec<(f64, f64)>,
    recognitions: Vec<Entry>,
}

impl RsfReader {
    /// Whether a log that begins with `head` is written in this form: its first line that is no comment has one of its words.
    pub(crate) fn recognizes(head: &[u8]) -> bool {
        let words = head.split(|byte| *byte == b'\n').map(|line| Words::new(line).word().text);
        let mut words = words.filter(|word| !word.is_empty() && word[0] != b'#');
        matches!(words.next(), Some(b"odom2" | b"loop" | b"point2" | b"angle"))
    }

    /// Reads the log `name` whole.
    pub(crate) fn from_source<R: BufRead>(name: String, reader: Decoded<R>, lenient: bool) -> Result<Self, LogError> {
        let mut lines = Lines::new(name, reader);
        let (mut columns, mut report) = (Columns::default(), LogReport::default());
        while lines.advance()? {
            report.lines += 1;
            if let Err(fault) = lines.text().and_then(|line| columns.take(line, &mut report)) {
                let error = lines.fault(fault);
                if !(lenient && error.kind.is_local()) {
                    return Err(error);
                }
                report.skip(error);
            }
        }
        let entries = columns.entries();
        if entries.is_empty() {
            return Err(LogError::whole(lines.name(), LogErrorKind::Empty));
        }
        report.entries = entries.len() as u64;
        Ok(Self { entries: entries.into_iter(), report })
    }

    pub(crate) fn report(&self) -> &LogReport {
        &self.report
    }
}

impl Iterator for RsfReader {
    type Item = Result<Entry, LogError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.entries.next().map(Ok)
    }
}

impl Columns {
    fn take(&mut self, line: &[u8], report: &mut LogReport) -> Result<(), Fault> {
        let mut words = Words::new(line);
        let name = words.word();
        match name.text {
            [] | [b'#', ..] => Ok(()),
            b"odom2" => self.odometry(&mut words),
            b"loop" => self.recognition(&mut words),
            b"point2" => {
                let stamp = words.number("the stamp in seconds")?;
                let at = Vector2::new(words.number("true x in metres")?, words.number("true y in metres")?);
                words.skip(4, "the covariance of the position")?;
                self.points.push((stamp, at));
                end(&mut words)
            }
            b"angle" => {
                let stamp = words.number("the stamp in seconds")?;
                self.headings.push((stamp, words.number("the true heading in radians")?));
                words.skip(1, "the variance of the heading")?;
                end(&mut words)
            }
            other if other[0].is_ascii_alphabetic() => {
                report.pass_over(other);
                Ok(())
            }
            _ => Err(words.not(name, "a word of libRSF, such as odom2 or loop")),
        }
    }

    fn odometry(&mut self, words: &mut Words<'_>) -> Result<(), Fault> {
        let at = words.clone().word();
        let stamp = words.number("the stamp in seconds")?;
        let vx = words.number("the velocity ahead in metres per second")?;
        let vy = words.number("the velocity to the left in metres per second")?;
        let omega = words.number("the turn rate in radians per second")?;
        words.skip(3, "the variances of the velocities")?;
        end(words)?;
        let odom_from_robot = match self.rates {
            None => Isometry2::identity(),
            Some((latest, ..)) if stamp < latest => {
                let kind = LogErrorKind::Backwards { stamp, by: latest - stamp };
                return Err(Fault { kind, span: Some(at.span()) });
            }
            Some((latest, pose, rates)) => {
                let [ahead, left, turn] = rates.map(|rate| rate * (stamp - latest));
                pose * Isometry2::new(Vector2::new(ahead, left), turn)
            }
        };
        if !odom_from_robot.to_homogeneous().iter().all(|number| number.is_finite()) {
            return Err(words.not(at, "a stamp and velocities that a robot can have"));
        }
        self.rates = Some((stamp, odom_from_robot, [vx, vy, omega]));
        self.odometry.push(Entry { stamp, kind: EntryKind::Odometry { odom_from_robot } });
        Ok(())
    }

    fn recognition(&mut self, words: &mut Words<'_>) -> Result<(), Fault> {
        let first = words.number("the one stamp in seconds")?;
        let second = words.number("the other stamp in seconds")?;
        let similarity = words.number("the similarity")?;
        end(words)?;
        let (stamp, earlier) = (first.max(second), first.min(second));
        self.recognitions.push(Entry { stamp, kind: EntryKind::Recognition { earlier, similarity } });
        Ok(())
    }

    /// All entries in the order of their stamps; at equal stamps odometry first, then the truth, then recognitions.
    fn entries(mut self) -> Vec<Entry> {
        self.headings.sort_by(|a, b| a.0.total_cmp(&b.0));
        let truths: Vec<Entry> = self.points.iter().map(|(stamp, at)| self.truth(*stamp, *at)).collect();
        let mut entries = self.odometry;
        entries.extend(truths);
        entries.append(&mut self.recognitions);
        entries.sort_by(|a, b| a.stamp.total_cmp(&b.stamp));
        entries
    }

    /// A true position with the heading of the same stamp, or facing `+x` where none was written.
    fn truth(&self, stamp: f64, at: Vector2<f64>) -> Entry {
        let found = self.headings.binary_search_by(|(other, _)| other.total_cmp(&stamp));
        let heading = found.map_or(0.0, |index| self.headings[index].1);
        Entry { stamp, kind: EntryKind::Truth { map_from_robot: Isometry2::new(at, heading) } }
    }
}

/// Nothing may follow.
fn end(words: &mut Words<'_>) -> Result<(), Fault> {
    if words.at_end() {
        return Ok(());
    }
    let extra = words.word();
    Err(words.not(extra, "the end of the line"))
}
