//! How sure the coordinates are: exact marginal covariances relative to the anchor.

mod selected;

use nalgebra::{Matrix2, Point2};

use crate::direct::{DirectFactor, SolveError};
use crate::network::Network;

/// The exact covariance of every node, and of every two nodes that a spring joins, relative to the anchors.
///
/// The covariance of all coordinates is the inverse `A⁻¹` of the normal matrix; a node's marginal is its diagonal block, in
/// the isotropic case the effective resistance between the node and its anchor, the springs being resistors of their
/// variances. Only the blocks that are asked for are computed: the selected inverse of the core (Takahashi, Fagan & Chin
/// 1973) from the factor that also solves for positions, then corridors and leaves from their ends. That takes about twice
/// the time of a solution.
///
/// It is as right as the springs' covariances are: a wrong loop closure makes places *look* surer.
///
/// ```
/// use relaxation::{nalgebra::Vector2, Covariance, Network, Spring};
///
/// let spring = |from, to| Spring::isotropic(from, to, Vector2::new(1.0, 0.0), 1.0);
/// let path = Network::new(3, &[spring(0, 1), spring(1, 2)])?;
/// let covariance = Covariance::new(&path);
/// assert_eq!(covariance.node(2).m11, 2.0); // variances of springs in a row add up
/// assert_eq!(covariance.displacement(1).m11, 1.0);
/// # Ok::<(), relaxation::NetworkError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Covariance {
    nodes: Vec<Matrix2<f64>>,
    springs: Vec<SpringCovariance>,
}

/// The joint covariance of the two nodes of a spring, in m².
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct SpringCovariance {
    /// Marginal of the node the spring starts from.
    pub from: Matrix2<f64>,
    /// Covariance between the two: row the coordinate of `from`, column that of `to`.
    pub cross: Matrix2<f64>,
    /// Marginal of the node the spring leads to.
    pub to: Matrix2<f64>,
}

impl Covariance {
    /// Computes all marginals of `network`.
    #[must_use]
    pub fn new(network: &Network) -> Self {
        let _span = tracing::debug_span!("covariance", nodes = network.len()).entered();
        let (nodes, cross) = if network.is_isotropic() {
            let (nodes, cross) = selected::blocks::<f64, 1>(network);
            let matrix = |variances: Vec<f64>| variances.into_iter().map(Matrix2::from_diagonal_element).collect();
            (matrix(nodes), matrix(cross))
        } else {
            selected::blocks::<Matrix2<f64>, 2>(network)
        };
        let nodes: Vec<Matrix2<f64>> = nodes;
        let springs = network.springs().iter().zip(cross);
        let springs =
            springs.map(|(s, cross)| SpringCovariance { from: nodes[s.from], cross, to: nodes[s.to] }).collect();
        Self { nodes, springs }
    }

    /// The covariance of a node's position in m², relative to the anchor of its component; zero for the anchor itself.
    ///
    /// # Panics
    ///
    /// If there is no such node.
    #[must_use]
    pub fn node(&self, node: usize) -> Matrix2<f64> {
        self.nodes[node]
    }

    /// The joint covariance of the two nodes of a spring.
    ///
    /// # Panics
    ///
    /// If there is no such spring.
    #[must_use]
    pub fn spring(&self, spring: usize) -> SpringCovariance {
        self.springs[spring]
    }

    /// How sure the relaxed displacement between the nodes of a spring is, in m²: never less sure than the spring itself.
    ///
    /// # Panics
    ///
    /// If there is no such spring.
    #[must_use]
    pub fn displacement(&self, spring: usize) -> Matrix2<f64> {
        let SpringCovariance { from, cross, to } = self.springs[spring];
        from + to - cross - cross.transpose()
    }
}

/// The joint covariance of some nodes.
#[derive(Debug, Clone, PartialEq)]
pub struct JointCovariance {
    nodes: usize,
    blocks: Vec<Matrix2<f64>>,
}

impl JointCovariance {
    /// The block of the `row`-th and the `column`-th of the chosen nodes, in m².
    ///
    /// # Panics
    ///
    /// If fewer were chosen.
    #[must_use]
    pub fn block(&self, row: usize, column: usize) -> Matrix2<f64> {
        assert!(row < self.nodes && column < self.nodes, "block ({row}, {column}) of {} nodes", self.nodes);
        self.blocks[row * self.nodes + column]
    }
}

/// The joint covariance of any chosen nodes, however far apart: one factorisation and a solution per node.
///
/// # Errors
///
/// As [`DirectFactor::new`], or [`SolveError::NoSuchNode`].
pub fn joint_covariance(network: &Network, chosen: &[usize]) -> Result<JointCovariance, SolveError> {
    if let Some(&node) = chosen.iter().find(|&&node| node >= network.len()) {
        return Err(SolveError::NoSuchNode { node, nodes: network.len() });
    }
    let factor = DirectFactor::new(network)?;
    let mut blocks = vec![Matrix2::zeros(); chosen.len() * chosen.len()];
    for (j, &column) in chosen.iter().enumerate() {
        for axis in 0..2 {
            let mut force = Point2::origin();
            force[axis] = 1.0;
            let response = factor.response(column, force.coords);
            for (i, &row) in chosen.iter().enumerate() {
                blocks[i * chosen.len() + j].set_column(axis, &response(row));
            }
        }
    }
    Ok(JointCovariance { nodes: chosen.len(), blocks })
}
