//! The directivity of a circular piston, and the Bessel function in it.

/// Amplitude of a piston's far field against its axis: `2 J₁(ka sin θ) / (ka sin θ)`, 1 on the axis.
pub(super) fn amplitude(ka: f64, bearing: f64) -> f64 {
    let x = ka * bearing.sin();
    if x * x <= MAIN_LOBE { main_lobe(0.25 * x * x) } else { 2.0 * bessel_j1(x) / x }
}

/// Square of an argument beyond the first null at 3.83, up to which the short series holds.
const MAIN_LOBE: f64 = 16.0;

/// `2 J₁(x)/x = Σ (−x²/4)^k / (k! (k+1)!)` for `quarter = x²/4` up to 4: what is left out is below 1e-12.
fn main_lobe(quarter: f64) -> f64 {
    const TERMS: usize = 13;
    const INVERSE: [f64; TERMS] = {
        let mut inverse = [0.0; TERMS];
        let mut k = 0;
        while k < TERMS {
            let n = k as f64 + 1.0;
            inverse[k] = 1.0 / (n * (n + 1.0));
            k += 1;
        }
        inverse
    };
    // Horner: 1 − q/(1·2) (1 − q/(2·3) (1 − …)).
    INVERSE.iter().rev().fold(1.0, |sum, inverse| 1.0 - quarter * inverse * sum)
}

/// The Bessel function of the first kind of order one.
///
/// Its power series up to |x| = 16, where rounding costs less than 1e-10; beyond, far outside any main lobe,
/// Hankel's expansion with two terms (better than 1e-5).
fn bessel_j1(x: f64) -> f64 {
    if x.abs() > 16.0 {
        let (a, phase) = (x.abs(), x.abs() - 0.75 * std::f64::consts::PI);
        let (p, q) = (1.0 + 15.0 / (128.0 * a * a), 3.0 / (8.0 * a));
        return x.signum() * (2.0 / (std::f64::consts::PI * a)).sqrt() * (p * phase.cos() - q * phase.sin());
    }
    let quarter = 0.25 * x * x;
    let mut term = 0.5 * x; // (x/2)^(2k+1) / (k! (k+1)!) with alternating sign
    let mut sum = term;
    for k in 1..60 {
        let k = f64::from(k);
        term *= -quarter / (k * (k + 1.0));
        sum += term;
        if term.abs() < 1e-17 * (1.0 + sum.abs()) {
            break;
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_short_series_meets_the_long_one() {
        for x in [0.001, 0.7, 2.0, 3.3, 3.999] {
            approx::assert_relative_eq!(main_lobe(0.25 * x * x), 2.0 * bessel_j1(x) / x, epsilon = 1e-11);
        }
        assert_eq!(amplitude(17.38, 0.0), 1.0);
    }

    #[test]
    fn bessel_matches_tables() {
        for (x, j1) in [(0.5, 0.242_268_457_7), (1.0, 0.440_050_585_7), (3.831_705_970_2, 0.0), (10.0, 0.043_472_746_2)]
        {
            approx::assert_relative_eq!(bessel_j1(x), j1, epsilon = 1e-9);
            approx::assert_relative_eq!(bessel_j1(-x), -j1, epsilon = 1e-9);
        }
        approx::assert_relative_eq!(bessel_j1(20.0), 0.066_833_124_2, epsilon = 1e-5);
        approx::assert_relative_eq!(bessel_j1(15.999), bessel_j1(16.001), epsilon = 5e-4);
    }
}
