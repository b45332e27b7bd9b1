use std::collections::VecDeque;
use std::io::BufRead;

use crate::entry::Entry;
use crate::error::{Fault, LogError, LogErrorKind};
use crate::lines::Lines;
use crate::report::LogReport;

/// Understands the lines of one kind of log, given what earlier lines said.
pub(crate) trait Grammar {
    /// What one line tells is put behind what is `told` already; a faulty line tells nothing.
    fn read(&mut self, line: &[u8], told: &mut VecDeque<Entry>, report: &mut LogReport) -> Result<(), Fault>;

    /// Whether faulty lines are left out and counted, instead of being the end.
    fn is_lenient(&self) -> bool;

    /// Why a log without an entry is none.
    fn nothing(&self, report: &LogReport) -> LogErrorKind;
}

/// The entries that the lines of a log tell, in their order; they end after the first error.
#[derive(Debug)]
pub(crate) struct Told<R, G> {
    lines: Lines<R>,
    grammar: G,
    told: VecDeque<Entry>,
    report: LogReport,
    done: bool,
}

impl<R: BufRead, G: Grammar> Told<R, G> {
    pub(crate) fn new(lines: Lines<R>, grammar: G) -> Self {
        Self { lines, grammar, told: VecDeque::new(), report: LogReport::default(), done: false }
    }

    pub(crate) fn report(&self) -> &LogReport {
        &self.report
    }

    fn advance(&mut self) -> Result<Option<Entry>, LogError> {
        while self.told.is_empty() && self.lines.advance()? {
            self.report.lines += 1;
            let text = self.lines.text();
            if let Err(fault) = text.and_then(|line| self.grammar.read(line, &mut self.told, &mut self.report)) {
                let error = self.lines.fault(fault);
                if !(self.grammar.is_lenient() && error.kind.is_local()) {
                    return Err(error);
                }
                self.report.skip(error);
            }
        }
        let entry = self.told.pop_front();
        self.report.entries += u64::from(entry.is_some());
        if self.report.entries == 0 {
            return Err(LogError::whole(self.lines.name(), self.nothing()));
        }
        Ok(entry)
    }

    /// Why not one entry was found.
    fn nothing(&self) -> LogErrorKind {
        match self.report.errors.first() {
            Some(first) => LogErrorKind::Unread { lines: self.report.skipped_lines(), first: first.to_string() },
            None => self.grammar.nothing(&self.report),
        }
    }
}

impl<R: BufRead, G: Grammar> Iterator for Told<R, G> {
    type Item = Result<Entry, LogError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.done {
            return None;
        }
        let step = self.advance().transpose();
        self.done = !matches!(step, Some(Ok(_)));
        step
    }
}
