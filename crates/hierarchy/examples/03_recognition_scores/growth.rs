//! What one more place costs while a map grows.

/// The next number of places at which to tell the cost, and how it stood at the one before.
pub(crate) struct Mark {
    places: usize,
    places_then: usize,
    seconds_then: f64,
}

impl Mark {
    pub(crate) fn begin() -> Self {
        Self { places: 500, places_then: 0, seconds_then: cpu_seconds().unwrap_or(0.0) }
    }

    #[expect(clippy::cast_precision_loss, reason = "places are few")]
    pub(crate) fn pass(&mut self, places: usize) {
        let Some(seconds) = (places >= self.places).then(cpu_seconds).flatten() else { return };
        let each = 1e3 * (seconds - self.seconds_then) / (places - self.places_then) as f64;
        println!("  {places} places: {each:.2} ms of CPU for each since {}", self.places_then);
        *self = Self { places: places + places / 2, places_then: places, seconds_then: seconds };
    }
}

/// User time of this process, where the system tells it: in hundredths of a second.
fn cpu_seconds() -> Option<f64> {
    let told = std::fs::read_to_string("/proc/self/stat").ok()?;
    let ticks: f64 = told.rsplit(") ").next()?.split(' ').nth(11)?.parse().ok()?;
    Some(ticks / 100.0)
}
