use std::collections::BTreeMap;

use local_grid::SensorKind;

use crate::lines::{Words, parse};

/// A property of a sensor that its message has no field for and a `PARAM` line says instead.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Param {
    Name,
    Kind,
    MinRange,
    MaxRange,
    Deviation,
}

/// What the parameter is called for the messages `tag`, such as `sonar_max_range` for `SONAR`.
pub(crate) fn name_of(tag: &str, param: Param) -> String {
    let property = match param {
        Param::Name => "name",
        Param::Kind => "kind",
        Param::MinRange => "min_range",
        Param::MaxRange => "max_range",
        Param::Deviation => "heading_deviation",
    };
    format!("{}_{property}", tag.to_ascii_lowercase())
}

/// The `PARAM` lines seen so far that say something about sensors.
#[derive(Debug, Default)]
pub(crate) struct Params {
    values: BTreeMap<String, String>,
}

impl Params {
    /// A log may set any number of parameters; those of sensors are few.
    const LIMIT: usize = 1000;

    /// Reads `PARAM name value host time`, after its first word; whether it is about a sensor.
    pub(crate) fn read(&mut self, words: &mut Words<'_>) -> bool {
        let (name, value) = (words.word().text, words.word().text);
        let (Ok(name), Ok(value)) = (std::str::from_utf8(name), std::str::from_utf8(value)) else { return false };
        let of_sensor = ["sonar", "laser", "imu"].iter().any(|word| name.contains(word));
        if of_sensor && (self.values.len() < Self::LIMIT || self.values.contains_key(name)) {
            self.values.insert(name.to_owned(), value.to_owned());
        }
        of_sensor
    }

    /// The finite number that parameter `name` is set to.
    pub(crate) fn number(&self, name: &str) -> Option<f64> {
        parse(self.values.get(name)?.as_bytes()).filter(|value| value.is_finite())
    }

    /// The word that describes the messages `tag`.
    pub(crate) fn text(&self, tag: &str, param: Param) -> Option<&str> {
        if self.values.is_empty() { None } else { self.values.get(&name_of(tag, param)).map(String::as_str) }
    }

    /// The finite number that describes the messages `tag`.
    pub(crate) fn of(&self, tag: &str, param: Param) -> Option<f64> {
        if self.values.is_empty() { None } else { self.number(&name_of(tag, param)) }
    }

    /// What the sensor of the messages `tag` is called; the tag itself where nothing is said.
    pub(crate) fn sensor_name(&self, tag: &str) -> String {
        // Blanks separate words in a log; a name is written with `%20` for them.
        self.values
            .get(&name_of(tag, Param::Name))
            .map_or_else(|| tag.to_ascii_lowercase(), |name| name.replace("%20", " "))
    }

    /// The physics of the sensor of the messages `tag`.
    pub(crate) fn kind(&self, tag: &str) -> Option<SensorKind> {
        match self.values.get(&name_of(tag, Param::Kind))?.as_str() {
            "sonar" => Some(SensorKind::Sonar),
            "laser" => Some(SensorKind::Laser),
            "infrared" => Some(SensorKind::Infrared),
            _ => None,
        }
    }
}
