use super::Config;

/// What each key of the configuration means, for people who meet it in a file.
const ABOUT: [(&str, &str); 15] = [
    ("grid.range_max_m", "Farthest reading that is drawn, in metres; 0 leaves it to the sensor's model."),
    ("grid.resolution_m", "Metres per cell of the gridmap."),
    (
        "grid.sonar",
        "By which model sonar readings are drawn: \"oriolo\" (the paper's short-sighted cone), \"shared\" (each echo shared \
         out by what all readings say) or \"murphy\".",
    ),
    ("heading.compass_correlation_m", "Distance over which the disturbance of a compass stays the same, in metres."),
    (
        "heading.compass_disturbance_deg",
        "Standard deviation of the disturbance that a compass suffers indoors, beyond its own noise, in degrees.",
    ),
    (
        "heading.source",
        "Where headings come from: \"auto\" (a compass where there is one, else walls and scans), \"compass\", \
         \"structure\" (walls and scans) or \"odometry\".",
    ),
    ("odometry.distance_m", "Standard deviation of a driven distance after one metre, in metres."),
    ("odometry.heading_per_m_deg", "Standard deviation of the heading after one metre, in degrees."),
    ("odometry.heading_per_turn_deg", "Standard deviation of the heading after one full turn, in degrees."),
    ("places.spacing_m", "Distance between places, in metres."),
    ("recognition.agreement", "Successive places that must agree before a loop is closed."),
    ("recognition.enabled", "Whether places are recognised at all; without it the map stays a chain."),
    ("recognition.floor", "Similarity of two views, between 0 and 1, below which nothing is recognised."),
    ("recognition.gate_sigma", "Half width in standard deviations of the region in which a known place is looked for."),
    (
        "relaxation.policy",
        "\"converge\": to the optimum whenever a loop closes; \"one-sweep\": one sweep for each place, as the paper does.",
    ),
];

impl Config {
    /// What a key means, in one sentence; `None` for one that does not exist.
    #[must_use]
    pub fn about(key: &str) -> Option<&'static str> {
        ABOUT.iter().find(|(other, _)| *other == key).map(|(_, about)| *about)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_is_explained_and_nothing_else_is() {
        let table: toml::Table = toml::from_str(&Config::default().to_toml()).unwrap();
        let keys = table
            .iter()
            .flat_map(|(head, inner)| inner.as_table().unwrap().keys().map(move |name| format!("{head}.{name}")));
        let keys: Vec<String> = keys.collect();
        for key in &keys {
            assert!(Config::about(key).is_some(), "{key} has no explanation in config/about.rs");
        }
        for (key, _) in ABOUT {
            assert!(keys.iter().any(|other| other == key), "{key} is explained and does not exist");
        }
    }
}
