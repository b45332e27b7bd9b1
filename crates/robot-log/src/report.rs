use std::collections::BTreeMap;

use crate::error::LogError;

/// What a reader did besides yielding entries: how much it read, what it left out and why.
#[derive(Debug, Default)]
pub struct LogReport {
    /// Lines read, blank ones and comments included.
    pub lines: u64,
    /// Entries yielded.
    pub entries: u64,
    /// Lines that carry nothing for a map (comments apart), by their first word, such as `PARAM`.
    pub passed_over: BTreeMap<String, u64>,
    /// Faulty lines that a lenient reader left out, by [`LogErrorKind::code`](crate::LogErrorKind::code).
    pub skipped: BTreeMap<&'static str, u64>,
    /// The first of the faulty lines, at most [`LogReport::ERRORS_KEPT`].
    pub errors: Vec<LogError>,
    /// Entries whose line had no usable stamp (0 after others, or a clock that was never set) and got one.
    pub stamps_given: u64,
    /// Entries whose stamp was a little behind and was held at that of the entry before.
    pub stamps_held: u64,
    /// Scans whose line states another sensor mount than the first line of that sensor did; the first is used.
    pub mounts_ignored: u64,
}

impl LogReport {
    /// How many faults are kept with their text.
    pub const ERRORS_KEPT: usize = 10;

    /// How many lines were left out as faulty.
    #[must_use]
    pub fn skipped_lines(&self) -> u64 {
        self.skipped.values().sum()
    }

    pub(crate) fn skip(&mut self, error: LogError) {
        *self.skipped.entry(error.kind.code()).or_default() += 1;
        if self.errors.len() < Self::ERRORS_KEPT {
            self.errors.push(error);
        }
    }

    pub(crate) fn pass_over(&mut self, word: &[u8]) {
        /// A damaged file could name any number of kinds; memory must not grow with the log.
        const KINDS: usize = 100;
        let word = String::from_utf8_lossy(word);
        if let Some(count) = self.passed_over.get_mut(word.as_ref()) {
            *count += 1;
        } else {
            let word = if self.passed_over.len() < KINDS { word.into_owned() } else { "other".to_owned() };
            *self.passed_over.entry(word).or_default() += 1;
        }
    }
}
