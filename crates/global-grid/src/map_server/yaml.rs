use std::collections::BTreeMap;
use std::io::{self, BufRead};

use super::{MapMetadata, Mode};

/// Why a map's description cannot be used. Lines and columns count from 1.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MetadataError {
    /// The reader failed.
    #[error("the description could not be read")]
    Io(#[source] io::Error),
    /// The text is not of the form `key: value`.
    #[error("line {line}, column {column}: expected {expected}")]
    Syntax {
        /// Where.
        line: usize,
        /// Where.
        column: usize,
        /// What was expected.
        expected: &'static str,
    },
    /// A key that must be there is not.
    #[error("`{0}` is missing")]
    Missing(&'static str),
    /// A key is there twice.
    #[error("line {line}: `{key}` is there twice")]
    Twice {
        /// Where the second stands.
        line: usize,
        /// The key.
        key: String,
    },
    /// A value is not one that its key can have.
    #[error("line {line}, column {column}: `{key}` must be {expected}, got `{value}`")]
    Value {
        /// Where.
        line: usize,
        /// Where.
        column: usize,
        /// The key.
        key: &'static str,
        /// What it may be.
        expected: &'static str,
        /// What it was.
        value: String,
    },
    /// Free below, occupied above, unknown between: so the thresholds must be in that order.
    #[error("`free_thresh` must be below `occupied_thresh`, got {free} and {occupied}")]
    Thresholds {
        /// Below is free.
        free: f64,
        /// Above is occupied.
        occupied: f64,
    },
}

/// A value and where it stands.
struct Entry {
    text: String,
    line: usize,
    column: usize,
}

impl MapMetadata {
    /// Reads a description, as the map server does; nothing of the image is looked at.
    ///
    /// The part of YAML that map descriptions use is understood: one key per line, plain or quoted values, lists in
    /// brackets or with dashes, comments. Keys that the map server does not know are passed over.
    /// `image` must lie in the description's folder or below: an absolute path, or one with `..`, is refused.
    ///
    /// # Errors
    ///
    /// What is missing, wrong or out of order, with its line.
    pub fn read(input: impl BufRead) -> Result<Self, MetadataError> {
        let entries = Entries::read(input)?;
        let metadata = Self {
            image: entries.image()?,
            mode: entries.mode()?,
            resolution: entries.number("resolution", 1e-4..=1e3, "between 0.0001 and 1000 metres per pixel")?,
            origin: entries.origin()?,
            negate: entries.negate()?,
            occupied_thresh: entries.number("occupied_thresh", 0.0..=1.0, "in [0, 1]")?,
            free_thresh: entries.number("free_thresh", 0.0..=1.0, "in [0, 1]")?,
        };
        let (free, occupied) = (metadata.free_thresh, metadata.occupied_thresh);
        if free >= occupied {
            return Err(MetadataError::Thresholds { free, occupied });
        }
        Ok(metadata)
    }
}

struct Entries(BTreeMap<String, Entry>);

impl Entries {
    fn read(input: impl BufRead) -> Result<Self, MetadataError> {
        let mut entries = BTreeMap::<String, Entry>::new();
        let mut open: Option<String> = None; // a key whose list follows with dashes
        for (index, text) in input.lines().enumerate() {
            let (text, line) = (text.map_err(MetadataError::Io)?, index + 1);
            let text = without_comment(&text).trim_end();
            let indent = text.len() - text.trim_start().len();
            let body = text.trim_start();
            if body.is_empty() || body == "---" || body == "..." || body.starts_with('%') {
                continue;
            }
            if let (Some(item), Some(key)) = (body.strip_prefix('-').filter(|item| item.starts_with(' ')), &open) {
                let entry = entries.get_mut(key).expect("the open key was put in");
                let comma = if entry.text.is_empty() { "" } else { "," };
                entry.text = format!("{}{comma}{}", entry.text, item.trim());
                continue;
            }
            let syntax = |column, expected| MetadataError::Syntax { line, column, expected };
            if indent > 0 {
                return Err(syntax(indent + 1, "a key at the start of the line"));
            }
            let (key, value) = body.split_once(':').ok_or(syntax(1, "`key: value`"))?;
            if !(value.is_empty() || value.starts_with(' ')) {
                return Err(syntax(key.chars().count() + 2, "a space after the colon"));
            }
            let column = key.chars().count() + 2 + (value.len() - value.trim_start().len());
            let (key, value) = (unquoted(key.trim()), value.trim().to_owned());
            if entries.contains_key(&key) {
                return Err(MetadataError::Twice { line, key });
            }
            open = value.is_empty().then(|| key.clone());
            entries.insert(key, Entry { text: value, line, column });
        }
        Ok(Self(entries))
    }

    fn get(&self, key: &'static str) -> Result<&Entry, MetadataError> {
        self.0.get(key).filter(|entry| !entry.text.is_empty()).ok_or(MetadataError::Missing(key))
    }

    fn number(
        &self,
        key: &'static str,
        allowed: std::ops::RangeInclusive<f64>,
        expected: &'static str,
    ) -> Result<f64, MetadataError> {
        let entry = self.get(key)?;
        let number = entry.text.parse().ok().filter(|number| allowed.contains(number));
        number.ok_or_else(|| entry.wrong(key, expected))
    }

    fn image(&self) -> Result<String, MetadataError> {
        let entry = self.get("image")?;
        let name = unquoted(&entry.text);
        let leaves = name.starts_with(['/', '\\', '~'])
            || name.contains(':')
            || name.split(['/', '\\']).any(|part| part == ".." || part.is_empty());
        if leaves || name.chars().any(char::is_control) {
            return Err(entry.wrong("image", "the name of a file in the folder of the description"));
        }
        Ok(name)
    }

    fn mode(&self) -> Result<Mode, MetadataError> {
        let Ok(entry) = self.get("mode") else { return Ok(Mode::Trinary) };
        match unquoted(&entry.text).as_str() {
            "trinary" => Ok(Mode::Trinary),
            "scale" => Ok(Mode::Scale),
            "raw" => Ok(Mode::Raw),
            _ => Err(entry.wrong("mode", "`trinary`, `scale` or `raw`")),
        }
    }

    fn negate(&self) -> Result<bool, MetadataError> {
        let entry = self.get("negate")?;
        match entry.text.as_str() {
            "0" | "false" | "False" | "no" => Ok(false),
            "1" | "true" | "True" | "yes" => Ok(true),
            _ => Err(entry.wrong("negate", "0 or 1")),
        }
    }

    fn origin(&self) -> Result<[f64; 3], MetadataError> {
        let entry = self.get("origin")?;
        let list = entry.text.trim_start_matches('[').trim_end_matches(']');
        let numbers: Result<Vec<f64>, _> = list.split(',').map(|number| number.trim().parse()).collect();
        let numbers = numbers.ok().filter(|numbers| numbers.iter().all(|number| number.is_finite()));
        let origin = numbers.and_then(|numbers| numbers.try_into().ok());
        origin.ok_or_else(|| entry.wrong("origin", "three numbers: x, y in metres and yaw in radians"))
    }
}

impl Entry {
    fn wrong(&self, key: &'static str, expected: &'static str) -> MetadataError {
        MetadataError::Value { line: self.line, column: self.column, key, expected, value: self.text.clone() }
    }
}

/// The line up to a `#` that stands outside quotes and after a space.
fn without_comment(line: &str) -> &str {
    let mut quote = None;
    let mut before = ' ';
    for (at, letter) in line.char_indices() {
        match (letter, quote) {
            ('#', None) if before.is_whitespace() => return &line[..at],
            ('"' | '\'', None) => quote = Some(letter),
            (_, Some(open)) if open == letter && before != '\\' => quote = None,
            _ => {}
        }
        before = letter;
    }
    line
}

fn unquoted(text: &str) -> String {
    for quote in ['"', '\''] {
        if let Some(inner) = text.strip_prefix(quote).and_then(|text| text.strip_suffix(quote)) {
            return if quote == '"' {
                inner.replace("\\\"", "\"").replace("\\\\", "\\")
            } else {
                inner.replace("''", "'")
            };
        }
    }
    text.to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    const GOOD: &str = "image: map.pgm # beside this file\nresolution: 0.05\norigin: [-1.5, 2, 0.0]\nnegate: 0\n\
                        occupied_thresh: 0.65\nfree_thresh: 0.196\n";

    fn read(text: &str) -> Result<MapMetadata, MetadataError> {
        MapMetadata::read(text.as_bytes())
    }

    #[test]
    fn a_description_reads() {
        let map = read(GOOD).unwrap();
        assert_eq!((map.image.as_str(), map.mode, map.origin), ("map.pgm", Mode::Trinary, [-1.5, 2.0, 0.0]));
        let listed = GOOD.replace("origin: [-1.5, 2, 0.0]", "origin:\n  - -1.5\n  - 2\n  - 0.0\nmode: raw");
        assert_eq!((read(&listed).unwrap().origin, read(&listed).unwrap().mode), ([-1.5, 2.0, 0.0], Mode::Raw));
    }

    #[test]
    fn faults_are_named_with_their_line() {
        let cases = [
            ("resolution: 0.05", "resolution: 0", "line 2, column 13: `resolution` must be between"),
            ("resolution: 0.05", "resolution: nan", "got `nan`"),
            ("resolution: 0.05\n", "", "`resolution` is missing"),
            ("map.pgm", "../secret.pgm", "the name of a file in the folder"),
            ("map.pgm", "/etc/passwd", "the name of a file in the folder"),
            ("map.pgm", "C:\\map.pgm", "the name of a file in the folder"),
            ("negate: 0", "negate: maybe", "line 4, column 9: `negate` must be 0 or 1, got `maybe`"),
            ("[-1.5, 2, 0.0]", "[-1.5, 2]", "three numbers"),
            ("free_thresh: 0.196", "free_thresh: 0.7", "must be below `occupied_thresh`, got 0.7 and 0.65"),
            ("negate: 0", "negate: 0\nnegate: 1", "line 5: `negate` is there twice"),
            ("negate: 0", "negate 0", "line 4, column 1: expected `key: value`"),
            ("negate: 0", "negate: 0\nmode: grey", "`trinary`, `scale` or `raw`"),
        ];
        for (good, bad, expected) in cases {
            let error = read(&GOOD.replace(good, bad)).unwrap_err().to_string();
            assert!(error.contains(expected), "{bad}: {error}");
        }
    }
}
