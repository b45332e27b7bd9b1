use std::fmt;

/// Why a log could not be read on: which file, which line, which column, what was there and what was expected.
///
/// ```
/// use robot_log::{CarmenOptions, CarmenReader};
///
/// let text = "ODOM 1.0 2.0 O.5 0 0 0 12.5 robot 12.5\n";
/// let mut log = CarmenReader::new("office.log", text.as_bytes(), CarmenOptions::default())?;
/// let error = log.next().unwrap().unwrap_err();
/// assert_eq!((error.line, error.column), (1, 14));
/// assert!(error.to_string().contains("expected heading of the robot in radians, found `O.5`"));
/// # Ok::<(), robot_log::LogError>(())
/// ```
#[derive(Debug)]
pub struct LogError {
    /// The name that the log was opened with.
    pub name: String,
    /// The line, from 1; 0 where the fault is not in a line.
    pub line: u64,
    /// The column in characters, from 1; 0 where the fault is not in a column.
    pub column: usize,
    /// The piece of the line around the fault, for display.
    pub excerpt: Option<Box<Excerpt>>,
    /// What is wrong.
    pub kind: LogErrorKind,
}

/// A piece of a line, short enough to print, and where in it the fault is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Excerpt {
    /// The text, clipped; `…` stands for what was left out.
    pub text: String,
    /// Where the fault starts in `text`, in characters, from 0.
    pub start: usize,
    /// How many characters it covers, at least 1.
    pub length: usize,
}

/// What is wrong with a log.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LogErrorKind {
    /// The operating system could not read on.
    #[error("could not be read")]
    Read(#[source] std::io::Error),
    /// A folder was given where a file belongs.
    #[error("is a directory, expected a log file")]
    Directory,
    /// The compressed file ends in the middle or is damaged.
    #[error("the gzip data is cut short or damaged")]
    Gzip(#[source] std::io::Error),
    /// Nothing in it.
    #[error("holds no entry of a robot's log")]
    Empty,
    /// Lines, and none that can be read; a lenient reader left them all out.
    #[error("none of its {lines} lines can be read; {first}")]
    Unread {
        /// How many lines were left out.
        lines: u64,
        /// What is wrong with the first of them, and where it stands.
        first: String,
    },
    /// Messages, and none that says anything of odometry, ranges or headings.
    #[error("holds no message of a robot's log, only `{messages}`; a table of numbers needs a robot description")]
    Foreign {
        /// The first words of its lines.
        messages: String,
    },
    /// Not text.
    #[error("is a binary file, expected a text log")]
    Binary,
    /// A line of a text in which a zero byte stands, as a disk that lost its power leaves them.
    #[error("a zero byte stands in the line, expected text")]
    ZeroByte,
    /// A line without end.
    #[error("a line of more than {limit} bytes, expected a text log")]
    LineTooLong {
        /// The longest line that is read, in bytes.
        limit: usize,
    },
    /// A word that does not mean what its place in the line demands.
    #[error("expected {expected}, found {found}")]
    Field {
        /// What belongs there, with its unit.
        expected: String,
        /// What is there.
        found: String,
    },
    /// A clock that runs backwards.
    #[error("stamp {stamp} s lies {by:.6} s before the entry before it; the clock must not run backwards")]
    Backwards {
        /// The stamp of the line, in seconds.
        stamp: f64,
        /// How far it is behind, in seconds.
        by: f64,
    },
    /// The line describes a range sensor that cannot exist.
    #[error("the line describes a range sensor that cannot exist")]
    Sensor(#[source] local_grid::SensorError),
    /// A table of numbers without a description of the robot that wrote it.
    #[error("is a table of numbers; say with a robot description what its columns mean")]
    NeedsDescription,
    /// The files do not fit the robot description.
    #[error("{0}")]
    Description(String),
}

impl LogErrorKind {
    /// A short name that programs can rely on, such as `log.field`.
    #[must_use]
    pub fn code(&self) -> &'static str {
        match self {
            Self::Read(_) => "log.read",
            Self::Directory => "log.directory",
            Self::Gzip(_) => "log.gzip",
            Self::Empty => "log.empty",
            Self::Unread { .. } => "log.unread",
            Self::Foreign { .. } => "log.foreign",
            Self::Binary => "log.binary",
            Self::ZeroByte => "log.zero_byte",
            Self::LineTooLong { .. } => "log.line_too_long",
            Self::Field { .. } => "log.field",
            Self::Backwards { .. } => "log.backwards",
            Self::Sensor(_) => "log.sensor",
            Self::NeedsDescription => "log.needs_description",
            Self::Description(_) => "log.description",
        }
    }

    /// Whether the fault lies in one line, so that a lenient reader can leave the line out and go on.
    #[must_use]
    pub fn is_local(&self) -> bool {
        matches!(self, Self::Field { .. } | Self::Backwards { .. } | Self::Sensor(_) | Self::ZeroByte)
    }
}

impl fmt::Display for LogError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.line, self.column) {
            (0, _) => write!(f, "{}: {}", self.name, self.kind),
            (line, 0) => write!(f, "{}:{line}: {}", self.name, self.kind),
            (line, column) => write!(f, "{}:{line}:{column}: {}", self.name, self.kind),
        }
    }
}

impl std::error::Error for LogError {
    fn source(&self) -> Option<&(dyn std::error::Error + 'static)> {
        std::error::Error::source(&self.kind)
    }
}

impl LogError {
    /// An error about the log as a whole.
    pub(crate) fn whole(name: impl Into<String>, kind: LogErrorKind) -> Self {
        Self { name: name.into(), line: 0, column: 0, excerpt: None, kind }
    }
}

/// What is wrong with one line, before it is known which line of which file that is.
#[derive(Debug)]
pub(crate) struct Fault {
    pub(crate) kind: LogErrorKind,
    /// The bytes of the line that are at fault.
    pub(crate) span: Option<std::ops::Range<usize>>,
}

impl Fault {
    /// The word at `span` is not what was `expected`.
    pub(crate) fn field(line: &[u8], span: std::ops::Range<usize>, expected: impl Into<String>) -> Self {
        let found = match &line[span.clone()] {
            [] => "the end of the line".to_owned(),
            word => format!("`{}`", shown(word, 40)),
        };
        Self { kind: LogErrorKind::Field { expected: expected.into(), found }, span: Some(span) }
    }

    /// The fault with its position: in `line`, number `number` of the log `name`.
    pub(crate) fn at(self, name: &str, number: u64, line: &[u8]) -> LogError {
        let column = self.span.as_ref().map_or(0, |span| shown(&line[..span.start], usize::MAX).chars().count() + 1);
        let excerpt = self.span.map(|span| Box::new(Excerpt::around(line, span)));
        LogError { name: name.to_owned(), line: number, column, excerpt, kind: self.kind }
    }
}

impl Excerpt {
    /// So many bytes of the line are shown before and after the fault; scan lines are thousands long.
    const CONTEXT: usize = 30;

    fn around(line: &[u8], span: std::ops::Range<usize>) -> Self {
        let from = span.start.saturating_sub(Self::CONTEXT);
        let to = line.len().min(span.end + Self::CONTEXT);
        let head = shown(&line[from..span.start], usize::MAX);
        let word = shown(&line[span.clone()], 60);
        let tail = shown(&line[span.end..to], usize::MAX);
        let (left, right) = (if from > 0 { "…" } else { "" }, if to < line.len() { "…" } else { "" });
        let (start, length) = (left.chars().count() + head.chars().count(), word.chars().count().max(1));
        Self { text: format!("{left}{head}{word}{tail}{right}"), start, length }
    }
}

/// At most `limit` characters of `bytes`, printable: what is no text becomes `�`, control characters a space.
fn shown(bytes: &[u8], limit: usize) -> String {
    let text = String::from_utf8_lossy(bytes);
    let mut shown: String =
        text.chars().take(limit).map(|character| if character.is_control() { ' ' } else { character }).collect();
    if text.chars().nth(limit).is_some() {
        shown.push('…');
    }
    shown
}
