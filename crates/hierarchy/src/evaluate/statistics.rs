use serde::Serialize;

/// Seven figures of a set of errors, under the names that evo gives them.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Statistics {
    /// The largest.
    pub max: f64,
    /// The mean.
    pub mean: f64,
    /// The middle one, or the mean of the middle two.
    pub median: f64,
    /// The smallest.
    pub min: f64,
    /// The root of the mean square.
    pub rmse: f64,
    /// The sum of the squares.
    pub sse: f64,
    /// The standard deviation of the set itself (divided by its size).
    pub std: f64,
}

impl Statistics {
    /// The figures of `errors`; `None` where there is none.
    #[must_use]
    pub fn of(errors: &[f64]) -> Option<Self> {
        let mut sorted = errors.to_vec();
        sorted.sort_by(f64::total_cmp);
        let (min, max) = (*sorted.first()?, *sorted.last()?);
        #[expect(clippy::cast_precision_loss, reason = "far fewer than 2⁵³ errors")]
        let count = sorted.len() as f64;
        let mean = errors.iter().sum::<f64>() / count;
        let sse = errors.iter().map(|error| error * error).sum::<f64>();
        let variance = errors.iter().map(|error| (error - mean).powi(2)).sum::<f64>() / count;
        let (low, high) = (sorted[(sorted.len() - 1) / 2], sorted[sorted.len() / 2]);
        Some(Self {
            max,
            mean,
            median: f64::midpoint(low, high),
            min,
            rmse: (sse / count).sqrt(),
            sse,
            std: variance.sqrt(),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_seven_figures_of_four_errors() {
        let figures = Statistics::of(&[1.0, 2.0, 3.0, 6.0]).unwrap();
        assert_eq!((figures.min, figures.median, figures.mean, figures.max), (1.0, 2.5, 3.0, 6.0));
        assert_eq!((figures.sse, figures.rmse), (50.0, 12.5f64.sqrt()));
        assert_eq!(figures.std, 3.5f64.sqrt());
        assert_eq!(Statistics::of(&[]), None);
    }
}
