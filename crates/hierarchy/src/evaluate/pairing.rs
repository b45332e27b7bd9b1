use nalgebra::Isometry2;

use super::path::TimedPath;

/// At which stamps two paths are compared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pairing {
    /// Every pose of the shorter path with the one of the longer that is nearest in time, as evo does.
    Nearest {
        /// Seconds by which their stamps may differ.
        apart: f64,
    },
    /// Every pose of the shorter path with the longer one interpolated at its stamp: for clocks that do not tick together.
    Interpolated {
        /// Seconds from pose to pose of the longer path over which it may be interpolated; nobody knows what a robot did in a longer pause.
        gap: f64,
    },
}

impl Default for Pairing {
    /// Poses at most 0.01 s apart, evo's default.
    fn default() -> Self {
        Self::Nearest { apart: 0.01 }
    }
}

impl Pairing {
    /// The nearest poses where at least nine of ten stamps that both paths cover find one, else interpolated ones.
    ///
    /// With unequal clocks a few stamps always agree by chance; a score of those alone would speak of a part of the path only.
    #[must_use]
    pub fn automatic(estimate: &TimedPath, reference: &TimedPath, apart: f64) -> Self {
        let (short, long) =
            if reference.len() < estimate.len() { (reference, estimate) } else { (estimate, reference) };
        let (Some(first), Some(last)) = (long.stamps().first(), long.stamps().last()) else {
            return Self::Nearest { apart };
        };
        let common = short.stamps().iter().filter(|stamp| (first - apart..=last + apart).contains(*stamp)).count();
        let found = pair(estimate, reference, Self::Nearest { apart }).len();
        if 10 * found >= 9 * common { Self::Nearest { apart } } else { Self::Interpolated { gap: LONGEST_GAP } }
    }

    /// What it is called in reports.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Nearest { .. } => "nearest",
            Self::Interpolated { .. } => "interpolated",
        }
    }
}

/// Seconds from pose to pose over which a path is interpolated unless somebody says otherwise.
const LONGEST_GAP: f64 = 2.0;

/// Poses of two paths at a common stamp.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pair {
    pub(super) stamp: f64,
    pub(super) estimate: Isometry2<f64>,
    pub(super) reference: Isometry2<f64>,
}

/// The poses to compare, in the order of their stamps.
pub(super) fn pair(estimate: &TimedPath, reference: &TimedPath, pairing: Pairing) -> Vec<Pair> {
    let swapped = reference.len() < estimate.len();
    let (short, long) = if swapped { (reference, estimate) } else { (estimate, reference) };
    let other = |stamp: f64| match pairing {
        Pairing::Nearest { apart } => long
            .nearest(stamp)
            .filter(|index| (long.stamps()[*index] - stamp).abs() <= apart)
            .map(|index| long.poses()[index]),
        Pairing::Interpolated { gap } => long.between(stamp, gap),
    };
    let pair = |(stamp, pose): (f64, &Isometry2<f64>)| {
        let other = other(stamp)?;
        let (estimate, reference) = if swapped { (other, *pose) } else { (*pose, other) };
        Some(Pair { stamp, estimate, reference })
    };
    short.iter().filter_map(pair).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A robot at 1 m/s, seen `rate` times per second from `start` on.
    fn drive(start: f64, rate: f64, count: u32) -> TimedPath {
        TimedPath::new((0..count).map(|k| {
            let stamp = start + f64::from(k) / rate;
            (stamp, Isometry2::translation(stamp, 0.0))
        }))
    }

    #[test]
    fn clocks_that_drift_apart_are_bridged_by_interpolation() {
        let (truth, estimate) = (drive(0.0, 5.0, 200), drive(0.0, 9.93, 400));
        let pairing = Pairing::automatic(&estimate, &truth, 0.01);
        assert_eq!(pairing, Pairing::Interpolated { gap: 2.0 });
        let pairs = pair(&estimate, &truth, pairing);
        assert_eq!(pairs.len(), 200);
        assert!(pairs.iter().all(|pair| (pair.estimate.translation.x - pair.stamp).abs() < 1e-9));
        assert_eq!(Pairing::automatic(&estimate, &drive(0.004, 9.93, 50), 0.01), Pairing::default());
    }

    #[test]
    fn nothing_is_invented_in_a_pause_or_beyond_an_end() {
        let paused =
            TimedPath::new(drive(0.0, 10.0, 20).iter().chain(drive(8.0, 10.0, 20).iter()).map(|(t, p)| (t, *p)));
        let truth = drive(0.0, 1.7, 20);
        let pairs = pair(&paused, &truth, Pairing::Interpolated { gap: 2.0 });
        assert!(!pairs.is_empty() && pairs.iter().all(|pair| pair.stamp <= 1.9 || (8.0..=9.9).contains(&pair.stamp)));
    }
}
