/// How well a number tells open directions from blocked ones, over all thresholds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RocScore {
    /// Area under the curve of true over false positives: the chance that an open direction gets the higher number.
    pub auc: f64,
    /// The share of blocked directions that count as open at the threshold that finds 95 % of the open ones: places
    /// that are predicted although nothing is there.
    pub false_rate_at_95: f64,
    /// That threshold.
    pub threshold_at_95: f32,
}

/// Scores numbers against the truth; `None` unless there are both open and blocked directions and only finite numbers.
///
/// Equal numbers count half for the area, and lie on the same side of any threshold.
#[must_use]
pub fn roc_score(scored: &[(f32, bool)]) -> Option<RocScore> {
    let mut sorted = scored.to_vec();
    if sorted.iter().any(|(score, _)| !score.is_finite()) {
        return None;
    }
    sorted.sort_by(|a, b| b.0.total_cmp(&a.0));
    let open = sorted.iter().filter(|(_, open)| *open).count();
    let blocked = sorted.len() - open;
    if open == 0 || blocked == 0 {
        return None;
    }
    let (mut hits, mut alarms, mut area) = (0, 0, 0.0);
    let mut at_95 = None;
    for equal in sorted.chunk_by(|a, b| a.0 == b.0) {
        let new_hits = equal.iter().filter(|(_, open)| *open).count();
        let new_alarms = equal.len() - new_hits;
        area += as_f64(new_alarms) * (as_f64(hits) + 0.5 * as_f64(new_hits));
        (hits, alarms) = (hits + new_hits, alarms + new_alarms);
        if at_95.is_none() && as_f64(hits) >= 0.95 * as_f64(open) {
            at_95 = Some((as_f64(alarms) / as_f64(blocked), equal[0].0));
        }
    }
    let (false_rate_at_95, threshold_at_95) = at_95?;
    Some(RocScore { auc: area / (as_f64(open) * as_f64(blocked)), false_rate_at_95, threshold_at_95 })
}

#[expect(clippy::cast_precision_loss, reason = "far fewer than 2^52 samples")]
fn as_f64(count: usize) -> f64 {
    count as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_perfect_score_and_a_coin() {
        let perfect: Vec<_> = (0..100_u8).map(|k| (f32::from(k), k >= 40)).collect();
        let score = roc_score(&perfect).unwrap();
        assert_eq!((score.auc, score.false_rate_at_95), (1.0, 0.0));
        let coin: Vec<_> = (0..100_u8).map(|k| (1.0, k % 2 == 0)).collect();
        let score = roc_score(&coin).unwrap();
        assert_eq!((score.auc, score.false_rate_at_95), (0.5, 1.0));
    }

    #[test]
    fn a_case_counted_by_hand() {
        // Open: 4, 3, 1; blocked: 2, 0. Pairs won: 2+2+1 of 6.
        let score = roc_score(&[(4.0, true), (3.0, true), (2.0, false), (1.0, true), (0.0, false)]).unwrap();
        approx::assert_relative_eq!(score.auc, 5.0 / 6.0);
        approx::assert_relative_eq!(score.false_rate_at_95, 0.5);
        assert_eq!(score.threshold_at_95, 1.0);
    }

    #[test]
    fn one_sided_or_broken_data_has_no_score() {
        assert_eq!(roc_score(&[(1.0, true)]), None);
        assert_eq!(roc_score(&[(f32::NAN, true), (1.0, false)]), None);
    }
}
