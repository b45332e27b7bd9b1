use std::ops::Range;

use crate::description::{Column, Separator};
use crate::error::Fault;
use crate::lines::parse;

/// A line cut into columns, in storage that is used again.
#[derive(Debug, Default)]
pub(super) struct Fields {
    spans: Vec<Range<usize>>,
    /// What stands before the first column, or all the letters of a line whose columns they separate.
    tag: Vec<u8>,
}

impl Fields {
    /// Cuts `line` into columns.
    pub(super) fn cut(&mut self, line: &[u8], separator: Separator) {
        self.spans.clear();
        self.tag.clear();
        match separator {
            Separator::Whitespace => self.cut_at_blanks(line),
            Separator::Comma => self.cut_at(line, b','),
            Separator::Semicolon => self.cut_at(line, b';'),
            Separator::Letters => self.cut_at_letters(line),
        }
        if separator != Separator::Letters
            && let Some(first) = self.spans.first()
        {
            self.tag.extend_from_slice(&line[first.clone()]);
        }
    }

    fn cut_at_blanks(&mut self, line: &[u8]) {
        let mut start = None;
        for (at, byte) in line.iter().chain(b" ").enumerate() {
            match (byte.is_ascii_whitespace(), start) {
                (false, None) => start = Some(at),
                (true, Some(from)) => {
                    self.spans.push(from..at);
                    start = None;
                }
                _ => {}
            }
        }
    }

    /// Blanks around a column do not count, nor does a separator at the end of the line.
    fn cut_at(&mut self, line: &[u8], separator: u8) {
        let mut start = 0;
        for (at, byte) in line.iter().chain([&separator]).enumerate() {
            if *byte == separator {
                let trimmed = line[start..at].trim_ascii();
                let before = line[start..at].len() - line[start..at].trim_ascii_start().len();
                self.spans.push(start + before..start + before + trimmed.len());
                start = at + 1;
            }
        }
        if self.spans.last().is_some_and(Range::is_empty) {
            self.spans.pop();
        }
    }

    fn cut_at_letters(&mut self, line: &[u8]) {
        let line = line.trim_ascii_end();
        let mut start = None;
        for (at, byte) in line.iter().enumerate() {
            if byte.is_ascii_alphabetic() {
                self.tag.push(*byte);
                if let Some(from) = start.take() {
                    self.spans.push(from..at);
                }
            } else if start.is_none() {
                start = Some(at);
            }
        }
        self.spans.extend(start.map(|from| from..line.len()));
    }

    pub(super) fn tag(&self) -> &[u8] {
        &self.tag
    }

    pub(super) fn len(&self) -> usize {
        self.spans.len()
    }

    /// The index of `column`, from 0; `None` where the line is too short.
    pub(super) fn index(&self, column: Column) -> Option<usize> {
        let index = if column.0 > 0 {
            usize::try_from(column.0 - 1).ok()?
        } else {
            self.spans.len().checked_sub(usize::try_from(column.0.unsigned_abs()).ok()?)?
        };
        (index < self.spans.len()).then_some(index)
    }

    /// Where the column at `index` stands in `line`; the end of the line where there is none.
    pub(super) fn span(&self, line: &[u8], index: Option<usize>) -> Range<usize> {
        index.and_then(|index| self.spans.get(index).cloned()).unwrap_or(line.len()..line.len())
    }

    /// The finite number in `column`.
    pub(super) fn number(&self, line: &[u8], column: Column, what: &str) -> Result<f64, Fault> {
        self.number_at(line, self.index(column), what)
    }

    /// The finite number in the column at `index`.
    pub(super) fn number_at(&self, line: &[u8], index: Option<usize>, what: &str) -> Result<f64, Fault> {
        let span = self.span(line, index);
        match parse(&line[span.clone()]) {
            Some(value) if value.is_finite() => Ok(value),
            _ => Err(Fault::field(line, span, what)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cut(line: &str, separator: Separator) -> Vec<String> {
        let mut fields = Fields::default();
        fields.cut(line.as_bytes(), separator);
        fields.spans.iter().map(|span| line[span.clone()].to_owned()).collect()
    }

    #[test]
    fn lines_are_cut_where_their_separator_stands() {
        assert_eq!(cut(" 1\t2  3 ", Separator::Whitespace), ["1", "2", "3"]);
        assert_eq!(cut("1; 2 ;;4;", Separator::Semicolon), ["1", "2", "", "4"]);
        assert_eq!(cut("el300er-25t24", Separator::Letters), ["300", "-25", "24"]);
        assert_eq!(cut("", Separator::Comma), [] as [&str; 0]);
    }

    #[test]
    fn columns_count_from_either_end() {
        let mut fields = Fields::default();
        fields.cut(b"7,8,9", Separator::Comma);
        assert_eq!((fields.index(Column(1)), fields.index(Column(-1))), (Some(0), Some(2)));
        assert_eq!((fields.index(Column(4)), fields.index(Column(-4))), (None, None));
    }
}
