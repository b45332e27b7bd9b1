mod features;
mod network;
mod peaks;
mod score;
mod train;

pub use features::{FeatureOptions, Features, N_FEATURES};
pub use network::{NetworkError, OpenSpace};
pub use peaks::{Central, Opening, PeakOptions};
pub use score::{RocScore, roc_score};
pub use train::{Sample, TrainOptions, TrainReport, gradient, mean_loss, train};
