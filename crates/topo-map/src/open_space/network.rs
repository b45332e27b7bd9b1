use rand::{Rng, RngExt};

use super::{Features, N_FEATURES};

/// The small neural network that says whether the way from a place into one direction is open: a perceptron with one
/// layer of `tanh` units and a logistic output.
///
/// ```text
/// h = tanh(W x + b),   p = 1 / (1 + exp(−(v·h + c)))
/// ```
///
/// Long readings alone prove nothing for a sonar: a smooth wall met at a slant throws the echo away. What tells an
/// opening from such a wall are the neighbouring readings and what the working grid remembers, which is what the network
/// learns from examples ([`train`](crate::train)).
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(try_from = "RawNetwork", into = "RawNetwork")]
pub struct OpenSpace {
    /// Per hidden unit: its weights on the inputs, its bias, and its weight in the output.
    pub(super) units: Vec<Unit>,
    pub(super) bias: f32,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Unit {
    pub(super) weights: Features,
    pub(super) bias: f32,
    pub(super) output: f32,
}

/// The network as a file holds it: reading goes through a check.
#[derive(serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct RawNetwork {
    inputs: usize,
    hidden: Vec<RawUnit>,
    output_bias: f32,
}

#[derive(serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct RawUnit {
    weights: Vec<f32>,
    bias: f32,
    output: f32,
}

/// Why a network cannot be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum NetworkError {
    /// The text is no JSON, or not that of a network.
    #[error("not the weights of a network: {0}")]
    Json(String),
    /// The layers do not fit together.
    #[error("a network for open space has {N_FEATURES} inputs and 1 to 1000 hidden units, got {inputs} and {hidden}")]
    Shape {
        /// Inputs.
        inputs: usize,
        /// Hidden units.
        hidden: usize,
    },
    /// A weight is no number.
    #[error("hidden unit {unit} of the network has weights that are not finite")]
    NotFinite {
        /// Which unit, from 0; one past the last means the output's bias.
        unit: usize,
    },
}

impl OpenSpace {
    /// The network that comes with this crate, trained on simulated sonar by the example `train_open_space`.
    ///
    /// # Panics
    ///
    /// Never, unless the crate was built with a broken file of weights.
    #[must_use]
    pub fn trained() -> Self {
        Self::from_json(include_str!("../../../../fixtures/networks/open_space.json"))
            .expect("the weights are part of the build, and a test reads them")
    }

    /// A network of `hidden` units with small random weights, as training begins with.
    #[must_use]
    pub fn random(hidden: usize, rng: &mut impl Rng) -> Self {
        let scale = 1.0 / 11_f32.sqrt(); // keeps the units in the steep part of tanh
        let mut weight = || rng.random_range(-1.0_f32..1.0) * scale;
        let unit = |weight: &mut dyn FnMut() -> f32| Unit {
            weights: std::array::from_fn(|_| weight()),
            bias: weight(),
            output: weight(),
        };
        Self { units: (0..hidden).map(|_| unit(&mut weight)).collect(), bias: 0.0 }
    }

    /// Reads weights.
    ///
    /// # Errors
    ///
    /// Text that is no JSON or not that of a network, layers that do not fit, weights that are not finite.
    pub fn from_json(text: &str) -> Result<Self, NetworkError> {
        let raw: RawNetwork = serde_json::from_str(text).map_err(|error| NetworkError::Json(error.to_string()))?;
        Self::try_from(raw)
    }

    /// Writes weights.
    ///
    /// # Panics
    ///
    /// Never: weights are finite numbers.
    #[must_use]
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).expect("numbers in vectors are JSON")
    }

    /// The probability that the way is open, in `[0, 1]`.
    #[must_use]
    pub fn openness(&self, features: &Features) -> f32 {
        logistic(self.logit(features))
    }

    /// `v·h + c`, the log-odds of being open.
    pub(super) fn logit(&self, features: &Features) -> f32 {
        self.units.iter().map(|unit| unit.output * unit.activation(features)).sum::<f32>() + self.bias
    }
}

impl Unit {
    pub(super) fn activation(&self, features: &Features) -> f32 {
        let sum: f32 = self.weights.iter().zip(features).map(|(w, x)| w * x).sum();
        (sum + self.bias).tanh()
    }
}

pub(super) fn logistic(logit: f32) -> f32 {
    1.0 / (1.0 + (-logit).exp())
}

impl TryFrom<RawNetwork> for OpenSpace {
    type Error = NetworkError;

    fn try_from(raw: RawNetwork) -> Result<Self, NetworkError> {
        let shape = NetworkError::Shape { inputs: raw.inputs, hidden: raw.hidden.len() };
        if raw.inputs != N_FEATURES || !(1..=1000).contains(&raw.hidden.len()) {
            return Err(shape);
        }
        let mut units = Vec::with_capacity(raw.hidden.len());
        for (index, RawUnit { weights, bias, output }) in raw.hidden.into_iter().enumerate() {
            let Ok(weights) = Features::try_from(weights) else { return Err(shape) };
            if !weights.iter().chain([&bias, &output]).all(|x| x.is_finite()) {
                return Err(NetworkError::NotFinite { unit: index });
            }
            units.push(Unit { weights, bias, output });
        }
        if !raw.output_bias.is_finite() {
            return Err(NetworkError::NotFinite { unit: units.len() });
        }
        Ok(Self { units, bias: raw.output_bias })
    }
}

impl From<OpenSpace> for RawNetwork {
    fn from(network: OpenSpace) -> Self {
        let raw = |unit: &Unit| RawUnit { weights: unit.weights.to_vec(), bias: unit.bias, output: unit.output };
        Self { inputs: N_FEATURES, hidden: network.units.iter().map(raw).collect(), output_bias: network.bias }
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;

    use super::*;

    #[test]
    fn weights_are_read_back_as_written() {
        let network = OpenSpace::random(8, &mut rand_pcg::Pcg64Mcg::seed_from_u64(3));
        assert_eq!(OpenSpace::from_json(&network.to_json()).unwrap(), network);
    }

    #[test]
    fn the_weights_that_come_along_can_be_read() {
        assert!((8..=10).contains(&OpenSpace::trained().units.len()));
    }

    #[test]
    fn broken_weights_are_refused() {
        assert!(matches!(OpenSpace::from_json("{"), Err(NetworkError::Json(_))));
        let none = r#"{"inputs": 11, "hidden": [], "output_bias": 0}"#;
        assert!(matches!(OpenSpace::from_json(none), Err(NetworkError::Shape { hidden: 0, .. })));
        let short = r#"{"inputs": 11, "hidden": [{"weights": [1, 2], "bias": 0, "output": 1}], "output_bias": 0}"#;
        assert!(matches!(OpenSpace::from_json(short), Err(NetworkError::Shape { .. })));
        let typo = r#"{"inputs": 11, "hiden": [], "output_bias": 0}"#;
        assert!(matches!(OpenSpace::from_json(typo), Err(NetworkError::Json(_))));
    }
}
