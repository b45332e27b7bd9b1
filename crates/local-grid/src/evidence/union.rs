/// How two degrees of membership in a fuzzy set are united: commutative, associative, with 0 as neutral element.
///
/// None of the two is idempotent: the same reading taken twice raises certainty.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Union {
    /// The algebraic sum `a + b − ab`.
    #[default]
    Algebraic,
    /// Dombi's union `1 / (1 + ((1/a − 1)^−λ + (1/b − 1)^−λ)^(−1/λ))` with `λ > 0` (Poloni et al. 1995).
    ///
    /// `λ = 1` is Hamacher's sum; a large `λ` tends to the maximum, a small one reinforces harder.
    Dombi {
        /// The exponent, above 0.
        lambda: f32,
    },
}

impl Union {
    /// The union of two degrees in `[0, 1]`; the result lies in `[0, 1]`.
    #[must_use]
    #[inline]
    pub fn of(self, a: f32, b: f32) -> f32 {
        match self {
            // Written so that rounding cannot leave [0, 1].
            Self::Algebraic => 1.0 - (1.0 - a) * (1.0 - b),
            Self::Dombi { lambda } => dombi(lambda, a, b),
        }
    }
}

fn dombi(lambda: f32, a: f32, b: f32) -> f32 {
    if a <= 0.0 {
        return b;
    }
    if b <= 0.0 {
        return a;
    }
    if a >= 1.0 || b >= 1.0 {
        return 1.0;
    }
    let odds = |x: f32| (1.0 / x - 1.0).powf(-lambda);
    1.0 / (1.0 + (odds(a) + odds(b)).powf(-1.0 / lambda))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dombi_reproduces_known_values() {
        let of = |lambda, a, b| Union::Dombi { lambda }.of(a, b);
        approx::assert_relative_eq!(of(1.0, 0.3, 0.4), 0.522_727, epsilon = 1e-5); // Hamacher
        approx::assert_relative_eq!(of(0.5, 0.3, 0.4), 0.683_973, epsilon = 1e-5);
        approx::assert_relative_eq!(of(0.5, 0.1, 0.1), 0.307_692, epsilon = 1e-5);
        approx::assert_relative_eq!(of(2.0, 0.1, 0.1), 0.135_796, epsilon = 1e-5);
    }

    #[test]
    fn nothing_is_neutral_and_certainty_stays() {
        for union in [Union::Algebraic, Union::Dombi { lambda: 0.5 }, Union::Dombi { lambda: 3.0 }] {
            approx::assert_relative_eq!(union.of(0.0, 0.4), 0.4, epsilon = 1e-6);
            approx::assert_relative_eq!(union.of(0.4, 0.0), 0.4, epsilon = 1e-6);
            assert_eq!(union.of(1.0, 0.4), 1.0);
            assert_eq!(union.of(0.4, 1.0), 1.0);
            assert_eq!(union.of(0.0, 0.0), 0.0);
        }
    }

    #[test]
    fn the_order_of_readings_does_not_matter() {
        let degrees = [0.1, 0.25, 0.02, 0.6, 0.1];
        for union in [Union::Algebraic, Union::Dombi { lambda: 0.7 }] {
            let forth = degrees.iter().fold(0.0, |sum, &x| union.of(sum, x));
            let back = degrees.iter().rev().fold(0.0, |sum, &x| union.of(sum, x));
            approx::assert_relative_eq!(forth, back, epsilon = 1e-5);
        }
    }
}
