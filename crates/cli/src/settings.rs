//! The settings of a run, layer over layer: built in, `topogrid.toml` of the working folder, `--config`, the environment,
//! `--set`, flags. Every value remembers where it came from.

use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};

use clap::Args;
use hierarchy::Config;
use toml::{Table, Value};

use crate::context::Context;
use crate::exit::Exit;
use crate::failure::{Failure, Place};
use crate::files;
use crate::nearest::nearest;

/// Where settings come from, on the command line.
#[derive(Debug, Default, Args)]
pub(crate) struct SettingsArgs {
    /// Settings as TOML; unknown keys are errors, and the effective settings are written into the run folder
    #[arg(long, global = true, value_name = "FILE")]
    pub(crate) config: Option<PathBuf>,
    /// One setting, such as places.spacing_m=0.8; may be repeated
    #[arg(long, global = true, value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
}

/// Where the value of a setting comes from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Origin {
    BuiltIn,
    File(PathBuf),
    Environment(String),
    Set,
    Flag(&'static str),
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::BuiltIn => write!(f, "built in"),
            Self::File(path) => write!(f, "{}", path.display()),
            Self::Environment(name) => write!(f, "${name}"),
            Self::Set => write!(f, "--set"),
            Self::Flag(name) => write!(f, "{name}"),
        }
    }
}

/// One setting: its key, value and origin.
pub(crate) type Setting = (String, (Value, Origin));

/// Settings while they are put together.
#[derive(Debug, Clone)]
pub(crate) struct Settings {
    values: BTreeMap<String, (Value, Origin)>,
}

/// The file that counts without being named.
const WORKING_FOLDER: &str = "topogrid.toml";
const VARIABLE: &str = "TOPOGRID_";
/// A variable that is about the program's own log, and no setting.
const LOG_FILTER: &str = "TOPOGRID_LOG";

impl Settings {
    /// What holds where nobody says anything else.
    pub(crate) fn built_in() -> Self {
        let table = Table::try_from(Config::default()).unwrap_or_default();
        let values = leaves(&table, "").into_iter().map(|(key, value)| (key, (value, Origin::BuiltIn)));
        Self { values: values.collect() }
    }

    /// All layers but the flags of single commands.
    pub(crate) fn layered(args: &SettingsArgs, context: &Context) -> Result<Self, Failure> {
        let mut settings = Self::built_in();
        let working = Path::new(WORKING_FOLDER);
        if working.is_file() {
            settings.file(working)?;
        }
        if let Some(path) = &args.config {
            settings.file(path)?;
        }
        settings.environment(std::env::vars(), context)?;
        for text in &args.set {
            let Some((key, value)) = text.split_once('=') else {
                let message = format!("expected KEY=VALUE, found `{text}`");
                return Err(Failure::new(Exit::Usage, "config.set", message));
            };
            settings.put(key.trim(), parse(value.trim()), Origin::Set)?;
        }
        Ok(settings)
    }

    /// Every setting by key.
    pub(crate) fn all(self) -> impl Iterator<Item = Setting> {
        self.values.into_iter()
    }

    /// One setting, or a failure that names the nearest.
    pub(crate) fn get(&self, key: &str) -> Result<&(Value, Origin), Failure> {
        self.values.get(key).ok_or_else(|| self.unknown(key))
    }

    /// Puts a value over what was there.
    pub(crate) fn put(&mut self, key: &str, value: Value, origin: Origin) -> Result<(), Failure> {
        let Some((there, from)) = self.values.get_mut(key) else { return Err(self.unknown(key)) };
        // A whole number is a number, too.
        let value = match (&*there, value) {
            #[expect(clippy::cast_precision_loss, reason = "as a person writes it")]
            (Value::Float(_), Value::Integer(number)) => Value::Float(number as f64),
            (_, value) => value,
        };
        if there.type_str() != value.type_str() {
            let (wanted, found) = (there.type_str(), value.type_str());
            let message = format!("{key} must be a {wanted}, got the {found} {value} ({origin})");
            return Err(
                Failure::new(Exit::Usage, "config.type", message).help(format!("topogrid config explain {key}"))
            );
        }
        (*there, *from) = (value, origin);
        Ok(())
    }

    /// The configuration, every value checked.
    pub(crate) fn config(&self) -> Result<Config, Failure> {
        let mut table = Table::new();
        for (key, (value, _)) in &self.values {
            insert(&mut table, key, value.clone());
        }
        let wrong = |message: String| Failure::new(Exit::Usage, "config", message);
        let config: Config = table.try_into().map_err(|error: toml::de::Error| wrong(error.message().to_owned()))?;
        config.check().map_err(|error| wrong(error.to_string()))?;
        Ok(config)
    }

    fn file(&mut self, path: &Path) -> Result<(), Failure> {
        let text = std::io::read_to_string(files::open(path)?).map_err(|error| Failure::reading(path, &error))?;
        let table: Table = toml::from_str(&text).map_err(|error| {
            let place = error.span().map(|span| place_of(path, &text, span.start, span.len(), error.message()));
            let failure = Failure::new(Exit::Rejected, "config.syntax", error.message().trim());
            failure.at(place.unwrap_or_default())
        })?;
        for (key, value) in leaves(&table, "") {
            self.put(&key, value, Origin::File(path.to_owned())).map_err(|failure| match key_at(&text, &key) {
                Some((at, length)) => failure.rejected_at(place_of(path, &text, at, length, "here")),
                None => failure,
            })?;
        }
        Ok(())
    }

    /// `TOPOGRID_GRID_RESOLUTION_M` is `grid.resolution_m`.
    fn environment(
        &mut self,
        variables: impl Iterator<Item = (String, String)>,
        context: &Context,
    ) -> Result<(), Failure> {
        let keys: BTreeMap<String, String> = self.values.keys().map(|key| (variable(key), key.clone())).collect();
        for (name, value) in variables.filter(|(name, _)| name.starts_with(VARIABLE) && name != LOG_FILTER) {
            match keys.get(&name) {
                Some(key) => self.put(key, parse(&value), Origin::Environment(name))?,
                None => {
                    let near = nearest(&name, keys.keys().map(String::as_str));
                    let hint = near.map(|near| format!("; did you mean {near}?")).unwrap_or_default();
                    context.warn(&format!("the variable {name} is no setting{hint}"));
                }
            }
        }
        Ok(())
    }

    fn unknown(&self, key: &str) -> Failure {
        let near = nearest(key, self.values.keys().map(String::as_str));
        let help = match near {
            Some(near) => format!("did you mean `{near}`?"),
            None => "topogrid config show lists all settings".to_owned(),
        };
        Failure::new(Exit::Usage, "config.unknown", format!("there is no setting `{key}`")).help(help)
    }
}

/// The name of the variable that sets `key`.
pub(crate) fn variable(key: &str) -> String {
    format!("{VARIABLE}{}", key.to_uppercase().replace(['.', '-'], "_"))
}

/// A value as a person writes it: what is no number, flag or list is a word.
fn parse(text: &str) -> Value {
    let table: Result<Table, _> = toml::from_str(&format!("value = {text}"));
    table.ok().and_then(|mut table| table.remove("value")).unwrap_or_else(|| Value::String(text.to_owned()))
}

/// Every value of a table under its dotted key.
fn leaves(table: &Table, before: &str) -> Vec<(String, Value)> {
    let one = |(key, value): (&String, &Value)| match value {
        Value::Table(inner) => leaves(inner, &format!("{before}{key}.")),
        value => vec![(format!("{before}{key}"), value.clone())],
    };
    table.iter().flat_map(one).collect()
}

fn insert(table: &mut Table, key: &str, value: Value) {
    match key.split_once('.') {
        None => {
            table.insert(key.to_owned(), value);
        }
        Some((head, rest)) => {
            let inner = table.entry(head).or_insert_with(|| Value::Table(Table::new()));
            if let Value::Table(inner) = inner {
                insert(inner, rest, value);
            }
        }
    }
}

/// Where in a TOML text a dotted key is set: its offset and length in bytes.
fn key_at(text: &str, key: &str) -> Option<(usize, usize)> {
    let (mut table, mut offset) = (String::new(), 0);
    for line in text.split_inclusive('\n') {
        let (trimmed, indent) = (line.trim(), line.len() - line.trim_start().len());
        if let Some(name) = trimmed.strip_prefix('[').and_then(|rest| rest.split(']').next()) {
            table = format!("{}.", name.trim());
        }
        let name = trimmed.split('=').next().unwrap_or_default().trim();
        if !name.is_empty() && format!("{table}{name}") == key {
            return Some((offset + indent, name.len()));
        }
        offset += line.len();
    }
    None
}

fn place_of(path: &Path, text: &str, at: usize, length: usize, label: &str) -> Place {
    let before = &text[..at.min(text.len())];
    let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
    let line = text[line_start..].lines().next().unwrap_or_default();
    let column = text[line_start..before.len()].chars().count();
    let length = length.clamp(1, line.chars().count().saturating_sub(column).max(1));
    Place {
        file: path.display().to_string(),
        line: before.matches('\n').count() as u64 + 1,
        column: column + 1,
        excerpt: Some((line.to_owned(), column, length)),
        label: label.trim().to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_built_in_settings_are_the_default_configuration() {
        assert_eq!(Settings::built_in().config().unwrap(), Config::default());
    }

    #[test]
    fn later_layers_win_and_say_where_they_come_from() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("my.toml");
        std::fs::write(&path, "[grid]\nresolution_m = 0.2\n[places]\nspacing_m = 2\n").unwrap();
        let mut settings = Settings::built_in();
        settings.file(&path).unwrap();
        settings.put("grid.resolution_m", parse("0.05"), Origin::Set).unwrap();
        let config = settings.config().unwrap();
        assert_eq!((config.grid.resolution_m, config.places.spacing_m), (0.05, 2.0));
        assert_eq!(settings.get("grid.resolution_m").unwrap().1, Origin::Set);
        assert_eq!(settings.get("places.spacing_m").unwrap().1, Origin::File(path));
        assert_eq!(settings.get("recognition.floor").unwrap().1, Origin::BuiltIn);
    }

    #[test]
    fn a_slip_is_named_with_its_place_and_the_nearest_key() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("my.toml");
        std::fs::write(&path, "[grid]\n  resolutoin_m = 0.2\n").unwrap();
        let shown = Settings::built_in().file(&path).unwrap_err().render(false).unwrap();
        assert!(shown.contains("no setting `grid.resolutoin_m`"), "{shown}");
        assert!(shown.contains("my.toml:2:3]") && shown.contains("did you mean `grid.resolution_m`?"), "{shown}");
        let wrong = Settings::built_in().put("grid.resolution_m", parse("fine"), Origin::Set).unwrap_err();
        assert!(wrong.render(false).unwrap().contains("must be a float, got the string \"fine\" (--set)"));
    }
}
