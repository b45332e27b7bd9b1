use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::io;
use std::path::Path;

use serde_json::{Map, Value};

use crate::exit::Exit;

/// Why a command ended without having done its work: what, where, what was expected, what to do.
#[derive(Debug)]
pub(crate) struct Failure {
    /// What the shell is told.
    pub(crate) exit: Exit,
    /// Boxed, because every function of the program may return one.
    what: Box<What>,
}

#[derive(Debug)]
struct What {
    code: String,
    message: String,
    place: Option<Place>,
    /// What lies beneath, outermost first.
    causes: Vec<String>,
    help: Option<String>,
    details: Map<String, Value>,
    /// Further faults of the same input, each a failure by itself.
    others: Vec<Failure>,
    /// Faults of each kind, those that are not told of included; empty where there is but one.
    kinds: BTreeMap<&'static str, u64>,
}

/// Where in a file something is wrong.
#[derive(Debug, Clone, Default)]
pub(crate) struct Place {
    pub(crate) file: String,
    /// From 1; 0 where the fault is not in a line.
    pub(crate) line: u64,
    /// In characters, from 1; 0 where it is not in a column.
    pub(crate) column: usize,
    /// A piece of the line, and where the fault starts and how long it is, in characters.
    pub(crate) excerpt: Option<(String, usize, usize)>,
    /// What to write under the mark.
    pub(crate) label: String,
}

impl Failure {
    /// A failure named `code` (a promise to programs, such as `log.field`) that says `message`.
    pub(crate) fn new(exit: Exit, code: impl Into<String>, message: impl Into<String>) -> Self {
        let (code, message) = (code.into(), message.into());
        let (causes, details, others, kinds) = (Vec::new(), Map::new(), Vec::new(), BTreeMap::new());
        let what = What { code, message, place: None, causes, help: None, details, others, kinds };
        Self { exit, what: Box::new(what) }
    }

    /// The input `path` is not usable, because of `error`.
    pub(crate) fn rejected(path: &Path, code: &str, error: &dyn std::error::Error) -> Self {
        let message = format!("could not use {}: {error}", path.display());
        Self::new(Exit::Rejected, code, message).because_of(error)
    }

    /// The file `path` cannot be read.
    pub(crate) fn reading(path: &Path, error: &io::Error) -> Self {
        Self::new(Exit::Rejected, "input.read", format!("could not read {}: {error}", path.display()))
    }

    /// The file `path` cannot be written.
    pub(crate) fn writing(path: &Path, error: &io::Error) -> Self {
        Self::new(Exit::Failed, "output.write", format!("could not write {}: {error}", path.display()))
    }

    /// Standard output cannot be written; that its reader has left is no failure.
    pub(crate) fn stdout(error: io::Error) -> Self {
        let exit = if error.kind() == io::ErrorKind::BrokenPipe { Exit::Done } else { Exit::Failed };
        Self::new(exit, "output.stdout", format!("could not write to standard output: {error}"))
    }

    /// What the user can do about it.
    pub(crate) fn help(mut self, help: impl Into<String>) -> Self {
        self.what.help = Some(help.into());
        self
    }

    /// Where it is.
    pub(crate) fn at(mut self, place: Place) -> Self {
        self.what.place = Some(place);
        self
    }

    /// It is a file that is wrong, there, and not the command line.
    pub(crate) fn rejected_at(mut self, place: Place) -> Self {
        self.exit = Exit::Rejected;
        self.at(place)
    }

    /// A detail that programs get as JSON.
    pub(crate) fn detail(mut self, key: &str, value: impl Into<Value>) -> Self {
        self.what.details.insert(key.to_owned(), value.into());
        self
    }

    /// It is one of several faults: some of the others, and how many there are of each kind.
    pub(crate) fn among(mut self, others: Vec<Self>, kinds: BTreeMap<&'static str, u64>) -> Self {
        if !others.is_empty() {
            self.what.kinds = kinds;
        }
        self.what.others = others;
        self
    }

    /// The causes of `error`, without its own text.
    pub(crate) fn because_of(mut self, error: &dyn std::error::Error) -> Self {
        let mut cause = error.source();
        while let Some(error) = cause {
            self.what.causes.push(error.to_string());
            cause = error.source();
        }
        self
    }

    /// The failure for eyes; nothing where there is nothing to tell.
    pub(crate) fn render(&self, color: bool) -> Option<String> {
        if self.exit == Exit::Done {
            return None;
        }
        let paint =
            |style: &str, text: &str| if color { format!("\u{1b}[{style}m{text}\u{1b}[0m") } else { text.to_owned() };
        let mut text = format!("{}: {}", paint("1;31", "error"), self.what.message);
        if let Some(place) = self.what.place.as_ref().filter(|place| place.line > 0) {
            place.draw(&mut text, paint);
        }
        for cause in &self.what.causes {
            let _ = write!(text, "\n  caused by: {cause}"); // writing to a string cannot fail
        }
        for other in &self.what.others {
            let place = other.what.place.as_ref().map(Place::position).unwrap_or_default();
            let _ = write!(text, "\n  {}: {}", paint("1;36", &place), other.what.message);
        }
        if let Some(rest) = self.untold() {
            let _ = write!(text, "\n  {rest}");
        }
        if let Some(help) = &self.what.help {
            let _ = write!(text, "\n  {}: {help}", paint("1", "help"));
        }
        Some(text)
    }

    /// How many faults there are beyond those that are told of.
    fn untold(&self) -> Option<String> {
        let all: u64 = self.what.kinds.values().sum();
        let rest = all.saturating_sub(1 + self.what.others.len() as u64);
        let kind = |(kind, count): (&&str, &u64)| format!("{count} {kind}");
        let kinds: Vec<String> = self.what.kinds.iter().map(kind).collect();
        (rest > 0).then(|| format!("and {rest} more: {} in all", kinds.join(", ")))
    }

    /// The failure for programs, in one line.
    pub(crate) fn to_json(&self) -> Option<String> {
        (self.exit != Exit::Done).then(|| serde_json::json!({ "error": self.as_object() }).to_string())
    }

    fn as_object(&self) -> Map<String, Value> {
        let mut error = Map::new();
        error.insert("code".into(), self.what.code.clone().into());
        error.insert("message".into(), self.what.message.clone().into());
        if let Some(place) = &self.what.place {
            error.insert("file".into(), place.file.clone().into());
            if place.line > 0 {
                error.insert("line".into(), place.line.into());
            }
            if place.column > 0 {
                error.insert("column".into(), place.column.into());
            }
        }
        error.extend(self.what.details.clone());
        if !self.what.causes.is_empty() {
            error.insert("causes".into(), self.what.causes.clone().into());
        }
        if let Some(help) = &self.what.help {
            error.insert("help".into(), help.clone().into());
        }
        if !self.what.others.is_empty() {
            let others = self.what.others.iter().map(|other| Value::Object(other.as_object()));
            error.insert("others".into(), others.collect());
            error.insert("kinds".into(), serde_json::json!(self.what.kinds));
        }
        error
    }
}

impl Place {
    /// `file:line:column`, as far as it is known.
    fn position(&self) -> String {
        let mut position = self.file.clone();
        for number in [self.line, self.column as u64] {
            if number > 0 {
                let _ = write!(position, ":{number}");
            }
        }
        position
    }

    /// Appends the position, the excerpt and the mark beneath it.
    fn draw(&self, text: &mut String, paint: impl Fn(&str, &str) -> String) {
        let _ = write!(text, "\n   ╭─[{}]", paint("1;36", &self.position()));
        if let Some((excerpt, start, length)) = &self.excerpt {
            let (blank, before, after) = (" ".repeat(*start), (length - 1) / 2, length / 2);
            let mark = format!("{}┬{}", "─".repeat(before), "─".repeat(after));
            let hook = format!("╰── {}", self.label);
            let _ = write!(text, "\n   │ {excerpt}\n   · {blank}{}", paint("1;31", &mark));
            let _ = write!(text, "\n   · {blank}{}{}", " ".repeat(before), paint("1;31", &hook));
        }
    }
}

impl From<robot_log::LogError> for Failure {
    fn from(error: robot_log::LogError) -> Self {
        Self::from(&error)
    }
}

/// What helps with a log of a format of its own.
pub(crate) const DESCRIBE: &str = "describe the robot with --robot NAME or --robot FILE.toml";

impl From<&robot_log::LogError> for Failure {
    fn from(error: &robot_log::LogError) -> Self {
        use robot_log::LogErrorKind;
        let (message, label) = match &error.kind {
            LogErrorKind::Field { expected, found } => {
                (format!("expected {expected}, found {found}"), format!("expected {expected}"))
            }
            kind => (format!("{}: {kind}", error.name), "here".to_owned()),
        };
        let help = match &error.kind {
            kind if kind.is_local() => Some("use --lenient to leave faulty lines out; they are counted and reported"),
            LogErrorKind::NeedsDescription | LogErrorKind::Foreign { .. } | LogErrorKind::Unread { .. } => {
                Some(DESCRIBE)
            }
            LogErrorKind::Directory => Some("name the log file itself"),
            _ => None,
        };
        let mut failure = Self::new(Exit::Rejected, error.kind.code(), message).because_of(error);
        if let LogErrorKind::Field { expected, found } = &error.kind {
            failure = failure.detail("expected", expected.as_str()).detail("found", found.trim_matches('`'));
        }
        let excerpt = error.excerpt.as_ref().map(|excerpt| (excerpt.text.clone(), excerpt.start, excerpt.length));
        failure =
            failure.at(Place { file: error.name.clone(), line: error.line, column: error.column, excerpt, label });
        match help {
            Some(help) => failure.help(help),
            None => failure,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_faulty_field_is_marked_where_it_stands() {
        let text = "ODOM 24.99 49.98 O.1 0 0 0 250 h 250\n";
        let error = robot_log::CarmenReader::new("office.log", text.as_bytes(), robot_log::CarmenOptions::default())
            .unwrap()
            .next()
            .unwrap()
            .unwrap_err();
        let shown = Failure::from(error).render(false).unwrap();
        let lines: Vec<&str> = shown.lines().collect();
        assert_eq!(lines[0], "error: expected heading of the robot in radians, found `O.1`");
        assert_eq!(lines[1], "   ╭─[office.log:1:18]");
        assert_eq!(
            lines[2].chars().skip(5).collect::<String>().find("O.1"),
            lines[3].chars().skip(5).collect::<String>().find('─')
        );
        assert!(lines[5].contains("--lenient"), "{shown}");
    }

    #[test]
    fn a_reader_that_left_is_no_failure() {
        let failure = Failure::stdout(io::ErrorKind::BrokenPipe.into());
        assert_eq!(failure.exit, Exit::Done);
        assert_eq!(failure.render(true), None);
    }
}
