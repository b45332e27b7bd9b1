//! The directivity of a circular piston, and the Bessel function in it.

/// Amplitude of a piston's far field against its axis: `2 J₁(ka sin θ) / (ka sin θ)`, 1 on the axis.
pub(super) fn amplitude(ka: f64, bearing: f64) -> f64 {
    let x = ka * bearing.sin();
    if x.abs() < 1e-9 { 1.0 } else { 2.0 * bessel_j1(x) / x }
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
