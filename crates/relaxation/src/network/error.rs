//! What can be wrong with a network, said with the number of the spring and the value.

/// Why springs do not make a network.
///
/// The text is a fragment that fits after "could not build the network: ".
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NetworkError {
    /// A spring ends at a node that does not exist.
    #[error("spring {spring}: node {node} does not exist, the network has {nodes} nodes (numbered from 0)")]
    NodeOutOfRange {
        /// Index of the spring.
        spring: usize,
        /// The node it names.
        node: usize,
        /// How many nodes there are.
        nodes: usize,
    },
    /// A displacement is NaN or infinite, or so long that its energy is.
    #[error("spring {spring}: displacement must be finite and its energy too, got ({x}, {y}) m")]
    RestNotFinite {
        /// Index of the spring.
        spring: usize,
        /// Its displacement to the east, in metres.
        x: f64,
        /// Its displacement to the north, in metres.
        y: f64,
    },
    /// A covariance is not symmetric positive definite (or too small or large for its inverse to be a number).
    #[error("spring {spring}: covariance must be symmetric and positive definite, got [[{xx}, {xy}], [{yx}, {yy}]] m²")]
    CovarianceNotPositiveDefinite {
        /// Index of the spring.
        spring: usize,
        /// Variance along x.
        xx: f64,
        /// Covariance, row x.
        xy: f64,
        /// Covariance, row y.
        yx: f64,
        /// Variance along y.
        yy: f64,
    },
    /// An anchor is a node that does not exist.
    #[error("anchor {node} does not exist, the network has {nodes} nodes (numbered from 0)")]
    AnchorOutOfRange {
        /// The node named.
        node: usize,
        /// How many nodes there are.
        nodes: usize,
    },
    /// An anchor's position is NaN or infinite.
    #[error("anchor {node}: position must be finite, got ({x}, {y}) m")]
    AnchorNotFinite {
        /// The anchored node.
        node: usize,
        /// Its x, in metres.
        x: f64,
        /// Its y, in metres.
        y: f64,
    },
    /// Two anchors hold one component: the springs between them would have to bend.
    #[error("anchors {first} and {second} are in one component; each component has exactly one anchor")]
    TwoAnchors {
        /// The anchor named first.
        first: usize,
        /// The other one.
        second: usize,
    },
    /// The weights do not match the springs in number.
    #[error("expected one weight per spring, {springs} of them, got {weights}")]
    WeightCount {
        /// How many springs there are.
        springs: usize,
        /// How many weights were given.
        weights: usize,
    },
    /// A weight is negative, NaN or infinite.
    #[error("spring {spring}: weight must be finite and not negative, got {weight}")]
    WeightInvalid {
        /// Index of the spring.
        spring: usize,
        /// Its weight.
        weight: f64,
    },
    /// More nodes or springs than 32-bit indices can number.
    #[error("{nodes} nodes and {springs} springs are too many: at most {} nodes and {} springs", u32::MAX - 1, u32::MAX / 2)]
    TooLarge {
        /// How many nodes were asked for.
        nodes: usize,
        /// How many springs were given.
        springs: usize,
    },
}
