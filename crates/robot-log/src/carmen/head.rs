use crate::error::LogErrorKind;
use crate::lines::{Words, parse};

/// What the beginning of a log tells of the rest.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct Head {
    /// Whether the first and the second laser come with the robot's pose.
    pub(crate) posed: [bool; 2],
}

impl Head {
    /// Looks at the first bytes of a log.
    pub(crate) fn look(head: &[u8]) -> Result<Self, LogErrorKind> {
        let first_line = head.split(|byte| *byte == b'\n').next().unwrap_or_default();
        if first_line.contains(&0) || looks_binary(head) {
            return Err(LogErrorKind::Binary);
        }
        let mut found = Self::default();
        let mut first = true;
        for line in head.split(|byte| *byte == b'\n') {
            let word = Words::new(line).word().text;
            if word.is_empty() || word[0] == b'#' {
                continue;
            }
            if std::mem::take(&mut first) && is_table(line) {
                return Err(LogErrorKind::NeedsDescription);
            }
            match word {
                b"FLASER" | b"ROBOTLASER1" => found.posed[0] = true,
                b"RLASER" | b"ROBOTLASER2" => found.posed[1] = true,
                _ => {}
            }
        }
        Ok(found)
    }
}

/// Text has few control characters and few bytes that are no UTF-8; files of other programs have many.
fn looks_binary(head: &[u8]) -> bool {
    let odd = |byte: &&u8| (byte.is_ascii_control() && !byte.is_ascii_whitespace()) || **byte == 0x7f;
    let controls = head.iter().filter(odd).count();
    let broken = String::from_utf8_lossy(head).chars().filter(|character| *character == '\u{fffd}').count();
    (controls + broken) * 10 > head.len()
}

/// Whether the line begins with two numbers, in whichever way they are separated.
fn is_table(line: &[u8]) -> bool {
    let separator = |byte: &u8| byte.is_ascii_whitespace() || matches!(byte, b',' | b';');
    let mut fields = line.split(separator).filter(|field| !field.is_empty());
    let mut numeric = || fields.next().is_some_and(|field| parse(field).is_some());
    numeric() && numeric()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_files_are_refused() {
        assert!(matches!(Head::look(b"\x89PNG\r\n\x1a\n\0\0"), Err(LogErrorKind::Binary)));
        assert!(matches!(Head::look(b"1.0;2.0;3.0\n"), Err(LogErrorKind::NeedsDescription)));
        assert!(matches!(Head::look(&[0xff, 0xfe, 0x81, 0x41, 0x99]), Err(LogErrorKind::Binary)));
    }
}
