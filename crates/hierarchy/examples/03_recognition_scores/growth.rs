//! What one more place costs while a map grows.

use hierarchy::Mapper;

/// The next number of places at which to tell the cost, and how it stood at the one before.
pub(crate) struct Mark {
    places: usize,
    places_then: usize,
    seconds_then: f64,
    links_then: usize,
}

impl Mark {
    pub(crate) fn begin() -> Self {
        Self { places: 500, places_then: 0, seconds_then: cpu_seconds().unwrap_or(0.0), links_then: 0 }
    }

    #[expect(clippy::cast_precision_loss, reason = "places are few")]
    pub(crate) fn pass(&mut self, mapper: &Mapper) {
        let places = mapper.topology().places().len();
        let Some(seconds) = (places >= self.places).then(cpu_seconds).flatten() else { return };
        let links = mapper.coordinates().links_relaxed();
        let count = (places - self.places_then) as f64;
        let each = 1e3 * (seconds - self.seconds_then) / count;
        let relaxed = (links - self.links_then) as f64 / count;
        println!(
            "  {places} places: {each:.2} ms of CPU for each since {}, {relaxed:.0} links relaxed",
            self.places_then
        );
        *self = Self { places: places + places / 2, places_then: places, seconds_then: seconds, links_then: links };
    }
}

/// User time of this process, where the system tells it: in hundredths of a second.
fn cpu_seconds() -> Option<f64> {
    let told = std::fs::read_to_string("/proc/self/stat").ok()?;
    let ticks: f64 = told.rsplit(") ").next()?.split(' ').nth(11)?.parse().ok()?;
    Some(ticks / 100.0)
}
