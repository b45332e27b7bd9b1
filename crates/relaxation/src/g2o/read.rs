//! Reading: one pass over the bytes, in pieces, whatever their size.

use std::io::{self, BufRead, Read};

use flate2::bufread::MultiGzDecoder;
use nalgebra::{Point2, Vector2};

use super::number;
use super::{Graph, PointEdge, PointVertex, PoseEdge, PoseVertex, Skipped};
use crate::pose::Pose;

/// How many bytes are asked for at a time.
const PIECE: usize = 1 << 18;
/// The longest line that is believed to be one; it bounds the memory a file without line ends can take.
const LONGEST_LINE: usize = 1 << 20;
/// Unknown tags told apart before the rest share one entry.
const MAX_TAGS: usize = 64;
/// Characters of an unknown tag or a wrong word that are shown.
const SHOWN: usize = 32;

/// Why a graph could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ParseError {
    /// Something else stands where a number, an id, a tag or the end of the line must be.
    #[error("line {line}, column {column}: expected {expected}, found `{found}`")]
    Unexpected {
        /// Counted from 1.
        line: usize,
        /// Counted from 1, in bytes.
        column: usize,
        /// What must stand here.
        expected: &'static str,
        /// What stands here, shortened.
        found: String,
    },
    /// A line too long to be one of a graph.
    #[error("line {line}: longer than {LONGEST_LINE} bytes, this is no g2o or TORO text")]
    LineTooLong {
        /// Counted from 1.
        line: usize,
    },
    /// The source failed, or its gzip data is damaged.
    #[error("reading failed after line {line}")]
    Io {
        /// Lines read before, all of them good.
        line: usize,
        /// The cause.
        #[source]
        source: io::Error,
    },
}

/// Reads a graph in g2o or TORO syntax, plain or gzip (told apart by the first two bytes).
///
/// # Errors
/// A known line that cannot be read, a line longer than a mebibyte, a failing source.
pub fn read(mut source: impl BufRead) -> Result<Graph, ParseError> {
    let head = source.fill_buf().map_err(|source| ParseError::Io { line: 0, source })?;
    // A source that hands out a single first byte would hide the second; gzip's first byte begins no line of text.
    if head.first() == Some(&0x1f) { read_text(MultiGzDecoder::new(source)) } else { read_text(source) }
}

fn read_text(mut source: impl Read) -> Result<Graph, ParseError> {
    let mut reader = Reader::default();
    let mut buffer = vec![0; PIECE];
    let mut filled = 0;
    loop {
        if filled == buffer.len() {
            buffer.resize(2 * filled, 0);
        }
        let count = match source.read(&mut buffer[filled..]) {
            Ok(count) => count,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            Err(source) => {
                return Err(ParseError::Io { line: reader.line, source });
            }
        };
        let fresh = filled;
        filled += count;
        // Only whole lines are parsed; at the end the last one needs no line end.
        let whole = if count == 0 {
            filled
        } else {
            buffer[fresh..filled].iter().rposition(|b| *b == b'\n').map_or(0, |at| fresh + at + 1)
        };
        reader.lines(&buffer[..whole])?;
        buffer.copy_within(whole..filled, 0);
        filled -= whole;
        if filled > LONGEST_LINE {
            return Err(ParseError::LineTooLong { line: reader.line + 1 });
        }
        if count == 0 {
            return Ok(reader.finish());
        }
    }
}

#[derive(Default)]
struct Reader {
    graph: Graph,
    /// Lines finished so far.
    line: usize,
}

impl Reader {
    fn lines(&mut self, bytes: &[u8]) -> Result<(), ParseError> {
        let mut cursor = Cursor { bytes, at: 0, line_start: 0 };
        while cursor.at < bytes.len() {
            cursor.line_start = cursor.at;
            self.record(&mut cursor).map_err(|wrong| wrong.at_line(self.line + 1, &cursor))?;
            self.line += 1;
        }
        Ok(())
    }

    fn record(&mut self, c: &mut Cursor<'_>) -> Result<(), Wrong> {
        c.skip_blanks();
        let tag = number::token(&c.bytes[c.at..]);
        let start = c.at;
        c.at += tag.len();
        match tag {
            b"EDGE_SE2" => {
                let [from, to] = c.ids()?;
                let n = c.floats::<9>()?;
                self.pose_edge(from, to, &n, [n[3], n[4], n[5], n[6], n[7], n[8]]);
            }
            b"EDGE2" => {
                let [from, to] = c.ids()?;
                let n = c.floats::<9>()?;
                // TORO writes I11 I12 I22 I33 I13 I23.
                self.pose_edge(from, to, &n, [n[3], n[4], n[7], n[5], n[8], n[6]]);
            }
            b"VERTEX_SE2" | b"VERTEX2" => {
                let [id] = c.ids()?;
                let [x, y, heading] = c.floats()?;
                self.graph.poses.push(PoseVertex { id, pose: Pose { x, y, heading } });
            }
            b"EDGE_XY" | b"EDGE_POINTXY" => {
                let [from, to] = c.ids()?;
                let [dx, dy, a, b, d] = c.floats()?;
                self.graph.point_edges.push(PointEdge {
                    from,
                    to,
                    displacement: Vector2::new(dx, dy),
                    information: [a, b, d],
                });
            }
            b"VERTEX_XY" => {
                let [id] = c.ids()?;
                let [x, y] = c.floats()?;
                self.graph.points.push(PointVertex { id, position: Point2::new(x, y) });
            }
            b"FIX" => {
                let [id] = c.ids()?;
                self.graph.fixed.push(id);
                while !c.at_line_end() {
                    let [id] = c.ids()?;
                    self.graph.fixed.push(id);
                }
            }
            [] => {}
            [b'#', ..] => c.skip_line(),
            [b'A'..=b'Z' | b'a'..=b'z' | b'_', ..] => {
                self.skip(tag);
                c.skip_line();
            }
            _ => {
                c.at = start;
                return Err(Wrong("a tag such as EDGE_SE2"));
            }
        }
        c.end_line()
    }

    fn pose_edge(&mut self, from: u64, to: u64, n: &[f64; 9], information: [f64; 6]) {
        let from_to = Pose { x: n[0], y: n[1], heading: n[2] };
        self.graph.pose_edges.push(PoseEdge { from, to, from_to, information });
    }

    fn skip(&mut self, tag: &[u8]) {
        let skipped = &mut self.graph.skipped;
        let mut tag = shorten(tag);
        if skipped.len() >= MAX_TAGS && !skipped.iter().any(|known| known.tag == tag) {
            tag = "…".into();
        }
        match skipped.iter_mut().find(|known| known.tag == tag) {
            Some(known) => known.count += 1,
            None => skipped.push(Skipped { tag, count: 1, first_line: self.line + 1 }),
        }
    }

    fn finish(mut self) -> Graph {
        let duplicates = &mut self.graph.duplicates;
        keep_first(&mut self.graph.poses, |vertex| vertex.id, duplicates);
        keep_first(&mut self.graph.points, |vertex| vertex.id, duplicates);
        self.graph
    }
}

/// Leaves the first vertex of each id and notes the ids of the others.
fn keep_first<V>(vertices: &mut Vec<V>, id: impl Fn(&V) -> u64, duplicates: &mut Vec<u64>) {
    if vertices.is_sorted_by(|a, b| id(a) < id(b)) {
        return;
    }
    let mut seen = std::collections::HashSet::with_capacity(vertices.len());
    vertices.retain(|vertex| {
        let fresh = seen.insert(id(vertex));
        if !fresh {
            duplicates.push(id(vertex));
        }
        fresh
    });
}

/// What was expected at the cursor.
struct Wrong(&'static str);

impl Wrong {
    #[cold]
    fn at_line(self, line: usize, c: &Cursor<'_>) -> ParseError {
        let found = match c.bytes.get(c.at) {
            None | Some(b'\r' | b'\n') => "end of line".into(),
            _ => shorten(number::token(&c.bytes[c.at..])),
        };
        ParseError::Unexpected { line, column: c.at - c.line_start + 1, expected: self.0, found }
    }
}

fn shorten(bytes: &[u8]) -> String {
    let text = String::from_utf8_lossy(bytes);
    if text.chars().count() <= SHOWN {
        return text.into_owned();
    }
    text.chars().take(SHOWN).chain(['…']).collect()
}

struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
    line_start: usize,
}

impl Cursor<'_> {
    #[inline]
    fn skip_blanks(&mut self) {
        while matches!(self.bytes.get(self.at), Some(b' ' | b'\t')) {
            self.at += 1;
        }
    }

    #[inline]
    fn floats<const N: usize>(&mut self) -> Result<[f64; N], Wrong> {
        let mut values = [0.0; N];
        for value in &mut values {
            self.skip_blanks();
            let (read, length) = number::float(&self.bytes[self.at..]).ok_or(Wrong("a finite number"))?;
            *value = read;
            self.at += length;
        }
        Ok(values)
    }

    #[inline]
    fn ids<const N: usize>(&mut self) -> Result<[u64; N], Wrong> {
        let mut values = [0; N];
        for value in &mut values {
            self.skip_blanks();
            let (read, length) =
                number::integer(&self.bytes[self.at..]).ok_or(Wrong("an id (a whole number from 0)"))?;
            *value = read;
            self.at += length;
        }
        Ok(values)
    }

    fn at_line_end(&mut self) -> bool {
        self.skip_blanks();
        matches!(self.bytes.get(self.at), None | Some(b'\r' | b'\n'))
    }

    fn skip_line(&mut self) {
        let rest = &self.bytes[self.at..];
        self.at += rest.iter().position(|b| *b == b'\n').unwrap_or(rest.len());
    }

    #[inline]
    fn end_line(&mut self) -> Result<(), Wrong> {
        self.skip_blanks();
        while self.bytes.get(self.at) == Some(&b'\r') {
            self.at += 1;
        }
        match self.bytes.get(self.at) {
            None => Ok(()),
            Some(b'\n') => {
                self.at += 1;
                Ok(())
            }
            Some(_) => Err(Wrong("the end of the line")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn parse(text: &str) -> Result<Graph, ParseError> {
        read(text.as_bytes())
    }

    #[test]
    fn toro_and_g2o_name_the_same_information_matrix_in_different_orders() {
        let graph = parse("EDGE_SE2 0 1 1 2 3 11 12 13 22 23 33\nEDGE2 0 1 1 2 3 11 12 22 33 13 23\n").unwrap();
        assert_eq!(graph.pose_edges[0], graph.pose_edges[1]);
        assert_eq!(graph.pose_edges[0].information_matrix()[(1, 2)], 23.0);
    }

    #[test]
    fn comments_blank_lines_carriage_returns_and_missing_last_line_end_are_fine() {
        let graph = parse("# a graph\r\n\r\n  VERTEX_XY\t3 1.5 -2\r\nFIX 3 4\n\nVERTEX_XY 4 0 0").unwrap();
        assert_eq!(graph.points.len(), 2);
        assert_eq!(graph.fixed, [3, 4]);
    }

    #[test]
    fn unknown_tags_are_counted_with_the_line_where_they_began() {
        let graph = parse("EQUIV 1 2\nVERTEX2 0 0 0 0\nBR 7\nEQUIV 3 4\n").unwrap();
        let counts: Vec<_> = graph.skipped.iter().map(|s| (s.tag.as_str(), s.count, s.first_line)).collect();
        assert_eq!(counts, [("EQUIV", 2, 1), ("BR", 1, 3)]);
    }

    #[test]
    fn a_repeated_vertex_counts_once() {
        let graph = parse("VERTEX_SE2 5 1 0 0\nVERTEX_SE2 2 0 0 0\nVERTEX_SE2 5 9 9 9\n").unwrap();
        assert_eq!(graph.poses.len(), 2);
        assert_eq!(graph.poses[0].pose.x, 1.0);
        assert_eq!(graph.duplicates, [5]);
    }

    #[test]
    fn errors_say_where_and_what() {
        for (text, expected) in [
            (
                "VERTEX_SE2 0 0 0 0\nEDGE_SE2 0 1 1 0 0 1 0 0 x 0 1\n",
                "line 2, column 26: expected a finite number, found `x`",
            ),
            ("VERTEX_XY 0 nan 0", "line 1, column 13: expected a finite number, found `nan`"),
            ("VERTEX_XY -1 0 0", "line 1, column 11: expected an id (a whole number from 0), found `-1`"),
            ("VERTEX_XY 0 0", "line 1, column 14: expected a finite number, found `end of line`"),
            ("VERTEX_XY 0 0 0 7", "line 1, column 17: expected the end of the line, found `7`"),
            ("\n\n 12 1", "line 3, column 2: expected a tag such as EDGE_SE2, found `12`"),
        ] {
            assert_eq!(parse(text).unwrap_err().to_string(), expected, "{text}");
        }
    }

    #[test]
    fn a_file_without_line_ends_is_refused_before_it_fills_the_memory() {
        let error = read(io::BufReader::new(io::repeat(b'A'))).unwrap_err();
        assert!(matches!(error, ParseError::LineTooLong { line: 1 }));
    }

    #[test]
    fn damaged_gzip_is_an_error() {
        let error = read(&[0x1f, 0x8b, 8, 0, 1, 2, 3][..]).unwrap_err();
        assert!(matches!(error, ParseError::Io { .. }));
    }

    #[test]
    fn pieces_of_any_size_give_the_same_graph() {
        struct Drip<'a>(&'a [u8], usize);
        impl Read for Drip<'_> {
            fn read(&mut self, out: &mut [u8]) -> io::Result<usize> {
                let count = self.1.min(self.0.len()).min(out.len());
                out[..count].copy_from_slice(&self.0[..count]);
                self.0 = &self.0[count..];
                Ok(count)
            }
        }
        let text = b"VERTEX_SE2 0 1.25 2 3\nFOO 1\nEDGE_SE2 0 1 1 2 3 11 12 13 22 23 33\n#x\nFIX 0";
        let whole = read(&text[..]).unwrap();
        for size in 1..text.len() {
            assert_eq!(read_text(Drip(text, size)).unwrap(), whole);
        }
    }

    proptest! {
        #[test]
        fn random_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
            let _ = read(&bytes[..]);
        }

        #[test]
        fn lines_of_nearly_right_words_never_panic(words in proptest::collection::vec(
            prop_oneof![Just("EDGE_SE2"), Just("VERTEX2"), Just("FIX"), Just("\n"), Just("1"), Just("-2.5e3"), Just("EDGE_XY"), Just("\r"), Just("é")], 0..60)) {
            let _ = read(words.join(" ").as_bytes());
        }
    }
}
