use rand::{Rng, RngExt};

use super::network::{Unit, logistic};
use super::{Features, N_FEATURES, OpenSpace};

/// One direction seen from one place, and whether the way was open.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// What was seen.
    pub features: Features,
    /// Whether a robot could have driven there.
    pub open: bool,
}

/// How a network is trained.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrainOptions {
    /// Hidden units.
    pub hidden: usize,
    /// Samples per step.
    pub batch: usize,
    /// Most passes over all samples.
    pub epochs: usize,
    /// Step length of Adam.
    pub rate: f32,
    /// Training stops after so many passes without a better loss on the held-out samples.
    pub patience: usize,
}

impl Default for TrainOptions {
    fn default() -> Self {
        Self { hidden: 9, batch: 64, epochs: 200, rate: 0.003, patience: 15 }
    }
}

/// How training went.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrainReport {
    /// Passes over all samples.
    pub epochs: usize,
    /// Mean cross-entropy on the training samples, in nats.
    pub loss: f64,
    /// The same on the held-out samples.
    pub held_out_loss: f64,
}

/// The mean cross-entropy of the network's answers, in nats, both classes weighing the same.
#[must_use]
pub fn mean_loss(network: &OpenSpace, samples: &[Sample]) -> f64 {
    let weights = class_weights(samples);
    let loss = |sample: &Sample| f64::from(weight(weights, sample.open) * sample_loss(network, sample));
    #[expect(clippy::cast_precision_loss, reason = "far fewer than 2^52 samples")]
    let count = samples.len().max(1) as f64;
    samples.iter().map(loss).sum::<f64>() / count
}

/// `−ln p` of the right answer, computed from the log-odds so that it stays exact when the network is sure.
fn sample_loss(network: &OpenSpace, sample: &Sample) -> f32 {
    let logit = network.logit(&sample.features);
    let against = if sample.open { -logit } else { logit };
    against.max(0.0) + (-against.abs()).exp().ln_1p()
}

/// The gradient of the mean loss over `samples`, in the order of the parameters of the network: per hidden unit its
/// weights, its bias, its output weight; then the output's bias.
#[must_use]
pub fn gradient(network: &OpenSpace, samples: &[Sample]) -> Vec<f32> {
    weighted_gradient(network, samples.iter(), class_weights(samples))
}

fn weighted_gradient<'s>(
    network: &OpenSpace,
    samples: impl ExactSizeIterator<Item = &'s Sample>,
    weights: (f32, f32),
) -> Vec<f32> {
    #[expect(clippy::cast_precision_loss, reason = "batches are small")]
    let share = 1.0 / samples.len().max(1) as f32;
    let mut sum = vec![0.0; n_parameters(network)];
    for sample in samples {
        let truth = f32::from(u8::from(sample.open));
        let error = (logistic(network.logit(&sample.features)) - truth) * share * weight(weights, sample.open);
        for (unit, sum) in network.units.iter().zip(sum.chunks_exact_mut(N_FEATURES + 2)) {
            let activation = unit.activation(&sample.features);
            let inner = error * unit.output * (1.0 - activation * activation);
            for (sum, x) in sum.iter_mut().zip(&sample.features) {
                *sum += inner * x;
            }
            sum[N_FEATURES] += inner;
            sum[N_FEATURES + 1] += error * activation;
        }
        sum[network.units.len() * (N_FEATURES + 2)] += error;
    }
    sum
}

/// Trains a network on `samples` by Adam (Kingma & Ba 2015), and keeps the state that did best on `held_out`.
///
/// What is held out should come from other worlds, not from other spots of the same ones. Both classes weigh the same,
/// however often they occur.
#[must_use]
pub fn train(
    samples: &[Sample],
    held_out: &[Sample],
    options: &TrainOptions,
    rng: &mut impl Rng,
) -> (OpenSpace, TrainReport) {
    let mut network = OpenSpace::random(options.hidden.clamp(1, 1000), rng);
    let mut adam = Adam::new(n_parameters(&network), options.rate);
    let weights = class_weights(samples);
    let mut order: Vec<usize> = (0..samples.len()).collect();
    let (mut best, mut best_loss, mut best_epoch) = (network.clone(), mean_loss(&network, held_out), 0);
    let mut epochs = 0;
    while epochs < options.epochs && epochs - best_epoch <= options.patience {
        epochs += 1;
        tracing::trace!(epochs, best_loss);
        shuffle(&mut order, rng);
        for batch in order.chunks(options.batch.max(1)) {
            let gradient = weighted_gradient(&network, batch.iter().map(|&index| &samples[index]), weights);
            adam.step(&mut network, &gradient);
        }
        let loss = mean_loss(&network, held_out);
        if loss < best_loss {
            (best, best_loss, best_epoch) = (network.clone(), loss, epochs);
        }
    }
    let report = TrainReport { epochs, loss: mean_loss(&best, samples), held_out_loss: best_loss };
    (best, report)
}

/// Weights of open and of blocked samples that make both classes count the same, with a mean of one.
fn class_weights(samples: &[Sample]) -> (f32, f32) {
    let open = samples.iter().filter(|sample| sample.open).count();
    let blocked = samples.len() - open;
    #[expect(clippy::cast_precision_loss, reason = "far fewer than 2^24 samples")]
    let share = |count: usize| samples.len() as f32 / (2 * count.max(1)) as f32;
    (share(open), share(blocked))
}

fn weight((open, blocked): (f32, f32), is_open: bool) -> f32 {
    if is_open { open } else { blocked }
}

/// Fisher and Yates.
fn shuffle(order: &mut [usize], rng: &mut impl Rng) {
    for last in (1..order.len()).rev() {
        order.swap(last, rng.random_range(0..=last));
    }
}

fn n_parameters(network: &OpenSpace) -> usize {
    network.units.len() * (N_FEATURES + 2) + 1
}

/// The parameters in the order of [`gradient`].
fn parameters(network: &mut OpenSpace) -> impl Iterator<Item = &mut f32> {
    let OpenSpace { units, bias } = network;
    units.iter_mut().flat_map(unit_parameters).chain([bias])
}

fn unit_parameters(unit: &mut Unit) -> impl Iterator<Item = &mut f32> {
    let Unit { weights, bias, output } = unit;
    weights.iter_mut().chain([bias, output])
}

/// Adam's running moments of the gradient.
struct Adam {
    rate: f32,
    mean: Vec<f32>,
    square: Vec<f32>,
    steps: i32,
}

impl Adam {
    const MEAN_DECAY: f32 = 0.9;
    const SQUARE_DECAY: f32 = 0.999;

    fn new(parameters: usize, rate: f32) -> Self {
        Self { rate, mean: vec![0.0; parameters], square: vec![0.0; parameters], steps: 0 }
    }

    fn step(&mut self, network: &mut OpenSpace, gradient: &[f32]) {
        self.steps = self.steps.saturating_add(1);
        let unbias = (1.0 - Self::MEAN_DECAY.powi(self.steps), 1.0 - Self::SQUARE_DECAY.powi(self.steps));
        let moments = self.mean.iter_mut().zip(&mut self.square);
        for ((parameter, gradient), (mean, square)) in parameters(network).zip(gradient).zip(moments) {
            *mean = Self::MEAN_DECAY * *mean + (1.0 - Self::MEAN_DECAY) * gradient;
            *square = Self::SQUARE_DECAY * *square + (1.0 - Self::SQUARE_DECAY) * gradient * gradient;
            *parameter -= self.rate * (*mean / unbias.0) / ((*square / unbias.1).sqrt() + 1e-8);
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_pcg::Pcg64Mcg;

    use super::*;

    /// Open where the middle range is long and no neighbour is short: not linear in the inputs.
    fn samples(count: usize, rng: &mut impl Rng) -> Vec<Sample> {
        let sample = |rng: &mut dyn FnMut() -> f32| {
            let features: Features = std::array::from_fn(|_| rng());
            Sample { features, open: (features[3] > 0.4) == (features[2] > 0.5) }
        };
        (0..count).map(|_| sample(&mut || rng.random_range(0.0_f32..1.0))).collect()
    }

    #[test]
    fn the_gradient_is_that_of_differences() {
        let mut rng = Pcg64Mcg::seed_from_u64(1);
        let (network, samples) = (OpenSpace::random(4, &mut rng), samples(50, &mut rng));
        let analytic = gradient(&network, &samples);
        for (index, analytic) in analytic.iter().enumerate() {
            let moved = |by: f32| {
                let mut moved = network.clone();
                *parameters(&mut moved).nth(index).unwrap() += by;
                mean_loss(&moved, &samples)
            };
            // The loss is summed in f64 from f32 terms: a step of 1e-2 leaves an error of about 1e-5.
            let numeric = (moved(1e-2) - moved(-1e-2)) / 2e-2;
            approx::assert_relative_eq!(f64::from(*analytic), numeric, epsilon = 5e-5, max_relative = 2e-3);
        }
    }

    #[test]
    fn what_no_line_separates_is_learned_and_the_same_seed_learns_the_same() {
        let learn = || {
            let mut rng = Pcg64Mcg::seed_from_u64(2);
            let (training, held_out) = (samples(2000, &mut rng), samples(500, &mut rng));
            let options = TrainOptions { rate: 0.01, epochs: 120, ..TrainOptions::default() };
            train(&training, &held_out, &options, &mut rng)
        };
        let (network, report) = learn();
        assert!(report.held_out_loss < 0.3, "{report:?}"); // ln 2 = 0.69 is guessing
        assert_eq!(learn().0, network);
    }

    #[test]
    fn no_samples_are_no_panic() {
        let (_, report) = train(&[], &[], &TrainOptions::default(), &mut Pcg64Mcg::seed_from_u64(2));
        assert_eq!(report.loss, 0.0);
    }
}
