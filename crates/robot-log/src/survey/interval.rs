/// A histogram of times between events, fine enough for their median: 25 bins per factor of ten, from 0.1 ms to 1000 s.
#[derive(Debug, Clone)]
pub(super) struct Intervals {
    bins: Vec<u64>,
}

const PER_DECADE: f64 = 25.0;
const BINS: usize = 175;
const SHORTEST: f64 = 1e-4;

impl Default for Intervals {
    fn default() -> Self {
        Self { bins: vec![0; BINS + 1] }
    }
}

impl Intervals {
    pub(super) fn push(&mut self, interval: f64) {
        self.bins[bin(interval)] += 1;
    }

    /// The middle of the bin that holds the median; 0 where most events come at the same time.
    pub(super) fn median(&self) -> Option<f64> {
        let count: u64 = self.bins.iter().sum();
        let mut below = 0;
        let index = self.bins.iter().position(|bin| {
            below += bin;
            2 * below >= count && count > 0
        })?;
        #[expect(clippy::cast_precision_loss, reason = "at most BINS")]
        let exponent = (index as f64 - 0.5) / PER_DECADE;
        Some(if index == 0 { 0.0 } else { SHORTEST * 10f64.powf(exponent) })
    }
}

fn bin(interval: f64) -> usize {
    if interval < SHORTEST {
        return 0;
    }
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "not negative; bounded by the next line"
    )]
    let bin = (PER_DECADE * (interval / SHORTEST).log10()) as usize;
    bin.min(BINS - 1) + 1
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_median_is_right_to_a_tenth() {
        let mut intervals = Intervals::default();
        assert_eq!(intervals.median(), None);
        for interval in [0.2, 0.21, 0.22, 7.0, 0.01] {
            intervals.push(interval);
        }
        let median = intervals.median().unwrap();
        assert!((median / 0.21 - 1.0).abs() < 0.1, "{median}");
        let mut still = Intervals::default();
        still.push(0.0);
        assert_eq!(still.median(), Some(0.0));
        still.push(f64::MAX);
    }
}
