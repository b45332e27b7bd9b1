use nalgebra::Vector2;

use super::WallDirection;

/// How a building's walls hold a heading.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct WallCompassOptions {
    /// So many sights teach the building's direction before any of them corrects a heading.
    pub lessons: u32,
    /// Walls that run this far from the building's direction, in radians, belong to something else.
    pub gate: f64,
    /// Sights within this many radians of the building's direction agree with it, or within 2.5 of their own deviations.
    pub agreement: f64,
    /// The share of recent sights that must agree, or the building is not square enough to hold a heading.
    pub least_agreement: f64,
    /// The share of a deviation that one sight takes back.
    pub gain: f64,
}

impl Default for WallCompassOptions {
    fn default() -> Self {
        Self { lessons: 10, gate: 8f64.to_radians(), agreement: 2f64.to_radians(), least_agreement: 0.8, gain: 0.3 }
    }
}

/// The reference is averaged over so many times the sights that it takes to trust it.
const LESSONS_AT_MOST: u32 = 10;
/// However far a heading went astray, walls 20° from the building's direction belong to something else.
const MOST_ASTRAY: f64 = 0.14;

/// A compass made of walls: most buildings have one direction, modulo 90°, and show it everywhere.
///
/// It learns that direction from what scans show, at headings that have not drifted yet, and from then on says by how much
/// a heading should turn. A building with wings at odd angles, or none at all, shows in sights that disagree; then the
/// compass keeps silent.
#[derive(Debug, Clone, PartialEq)]
pub struct WallCompass {
    options: WallCompassOptions,
    learnt: Learnt,
}

/// What a [`WallCompass`] has learnt: all that is needed to go on with it later.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Learnt {
    /// The sum of unit vectors at four times the angles seen.
    pub sum: Vector2<f64>,
    /// Sights that taught it.
    pub lessons: u32,
    /// The share of recent sights that agreed, in `[0, 1]`.
    pub agreement: f64,
}

impl Default for Learnt {
    fn default() -> Self {
        Self { sum: Vector2::zeros(), lessons: 0, agreement: 1.0 }
    }
}

impl WallCompass {
    /// A compass that has seen nothing.
    #[must_use]
    pub fn new(options: WallCompassOptions) -> Self {
        Self::recalling(options, Learnt::default())
    }

    /// A compass that has learnt something before.
    #[must_use]
    pub fn recalling(options: WallCompassOptions, learnt: Learnt) -> Self {
        Self { options, learnt }
    }

    /// What it has learnt so far.
    #[must_use]
    pub fn learnt(&self) -> Learnt {
        self.learnt
    }

    /// The building's direction in `[0, π/2)` radians, as far as it has been learnt.
    #[must_use]
    pub fn reference(&self) -> Option<f64> {
        let Learnt { sum, lessons, .. } = self.learnt;
        let known = lessons >= self.options.lessons && sum.norm() > 0.0;
        known.then(|| (0.25 * sum.y.atan2(sum.x)).rem_euclid(std::f64::consts::FRAC_PI_2))
    }

    /// Takes a sight: walls that run in `seen.direction` from a robot whose heading is believed to be `heading` radians.
    ///
    /// Returns the turn in radians that the heading should take, 0 where the walls do not say.
    pub fn sight(&mut self, seen: &WallDirection, heading: f64) -> f64 {
        self.sight_after(seen, heading, 0.0)
    }

    /// The same after something by which the heading may have gone astray by `astray` radians, as a standard deviation: walls
    /// that far off still belong to the building, and correct the heading by as much as they are the surer of the two.
    pub fn sight_after(&mut self, seen: &WallDirection, heading: f64, astray: f64) -> f64 {
        let in_map = WallDirection { direction: seen.direction + heading, ..*seen };
        let deviation = self.reference().map(|reference| in_map.turn_to(reference));
        let turn = deviation.map_or(0.0, |deviation| self.judge(deviation, seen.sigma, astray.min(MOST_ASTRAY)));
        // Learning ends: a drift that is always held back a little late would teach the reference to follow it.
        if self.learnt.lessons < LESSONS_AT_MOST.saturating_mul(self.options.lessons) {
            let angle = 4.0 * (in_map.direction + turn);
            self.learnt.sum += Vector2::new(angle.cos(), angle.sin());
            self.learnt.lessons += 1;
        }
        turn
    }

    fn judge(&mut self, deviation: f64, sigma: f64, astray: f64) -> f64 {
        let near = self.options.agreement.max(2.5 * sigma.hypot(astray));
        let agrees = if deviation.abs() <= near { 1.0 } else { 0.0 };
        // Recent means the last thirty sights or so.
        self.learnt.agreement += (agrees - self.learnt.agreement) / 30.0;
        let trusted = self.learnt.agreement >= self.options.least_agreement
            && deviation.abs() <= self.options.gate.max(2.5 * astray);
        let sure = astray.powi(2) / (astray.powi(2) + sigma.powi(2) + self.options.agreement.powi(2));
        if trusted { self.options.gain.max(sure) * deviation } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seen(direction: f64) -> WallDirection {
        WallDirection { direction, share: 0.9, sigma: 0.01, length: 10.0 }
    }

    #[test]
    fn a_drifting_heading_is_held() {
        let mut compass = WallCompass::new(WallCompassOptions::default());
        let (mut truth, mut heading) = (0.3f64, 0.3f64);
        for k in 0..400 {
            truth += 0.05;
            heading += 0.05 + 0.002; // drifts by a tenth of a degree with every scan
            heading += compass.sight(&seen(0.2 - truth), heading);
            // The first ten sights only teach; what drifted until then is taken for true.
            assert!((heading - truth).abs() < 0.05, "scan {k}: off by {}", heading - truth);
        }
    }

    #[test]
    fn a_heading_that_went_astray_at_once_is_brought_back() {
        let mut compass = WallCompass::new(WallCompassOptions::default());
        for _ in 0..20 {
            compass.sight(&seen(0.2), 0.0);
        }
        let off = 10f64.to_radians();
        assert_eq!(compass.clone().sight(&seen(0.2), off), 0.0, "too far for nothing to have happened");
        let turn = compass.sight_after(&seen(0.2), off, 0.1);
        assert!((-off..-0.8 * off).contains(&turn), "{turn}");
    }

    #[test]
    fn a_building_without_direction_holds_nothing() {
        let mut compass = WallCompass::new(WallCompassOptions::default());
        let turned = (0..300).filter(|&k| compass.sight(&seen(f64::from(k) * 0.61), 0.0) != 0.0).count();
        assert!(turned < 10, "{turned} turns");
    }

    #[test]
    fn quarter_turns_are_one_direction() {
        let mut compass = WallCompass::new(WallCompassOptions::default());
        for k in 0..40 {
            compass.sight(&seen(0.1 + f64::from(k % 4) * std::f64::consts::FRAC_PI_2), 0.0);
        }
        approx::assert_relative_eq!(compass.reference().unwrap(), 0.1, epsilon = 1e-9);
        approx::assert_relative_eq!(compass.sight(&seen(0.12), 0.0), -0.3 * 0.02, epsilon = 1e-9);
    }
}
