//! The network: nodes, springs, one anchor per component; checked once, right from then on.

mod adjacency;
mod components;
mod error;

pub(crate) use adjacency::{Adjacency, End, SpanningTree};
pub use error::NetworkError;

use std::borrow::Cow;
use std::sync::{Arc, OnceLock};

use nalgebra::{Matrix2, Point2, Vector2};

use crate::gauss_seidel::SweepRows;
use crate::spring::Spring;
use components::Components;

/// The node that holds a component in place, and where.
///
/// Displacements say nothing of absolute coordinates: without an anchor a component could float anywhere.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Anchor {
    /// The anchored node.
    pub node: usize,
    /// Where it is held, in the map frame, in metres.
    pub position: Point2<f64>,
}

/// Springs between numbered nodes, known to pose a problem with exactly one answer.
///
/// The constructor checks everything that can be wrong: node numbers, finite displacements, positive definite
/// covariances. It finds the connected components and anchors the lowest-numbered node of each at the origin
/// ([`with_anchors`](Self::with_anchors) changes that), so the energy
///
/// ```text
/// E(p) = Σ_springs w (p_to − p_from − rest)ᵀ U⁻¹ (p_to − p_from − rest)
/// ```
///
/// has exactly one minimum over the free nodes. Springs keep their numbers:
/// * several springs between the same two nodes (parallel springs) act together, as their inverse-variance mean would;
/// * a spring from a node to itself can move nothing: it only adds its constant `restᵀ U⁻¹ rest` to the energy;
/// * an empty network, a network of one node and several components are legal.
///
/// `w` is 1 unless [`reweighted`](Self::reweighted) says otherwise.
///
/// ```
/// use relaxation::{nalgebra::Vector2, Network, Spring};
///
/// let springs = [
///     Spring::isotropic(0, 1, Vector2::new(1.0, 0.0), 0.01),
///     Spring::isotropic(2, 3, Vector2::new(0.0, 1.0), 0.01),
/// ];
/// let network = Network::new(4, &springs)?;
/// assert_eq!(network.components(), 2);
/// assert_eq!(network.dead_reckoning()[3].y, 1.0); // node 2 is the anchor of the second component
///
/// let bad = [Spring::isotropic(0, 1, Vector2::new(1.0, 0.0), -0.5)];
/// let error = Network::new(2, &bad).unwrap_err().to_string();
/// assert!(error.starts_with("spring 0: covariance must be symmetric and positive definite, got [[-0.5"));
/// # Ok::<(), relaxation::NetworkError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Network {
    springs: Arc<Vec<Spring>>,
    /// Factor on each spring's information; `None` means 1 for all.
    weights: Option<Arc<[f64]>>,
    isotropic: bool,
    components: Components,
    adjacency: OnceLock<Adjacency>,
    tree: OnceLock<SpanningTree>,
    rows: OnceLock<SweepRows>,
}

impl Network {
    /// Checks `springs` between the nodes `0..nodes` and finds their components.
    ///
    /// # Errors
    ///
    /// The first spring that names a node out of range, has a displacement that is not finite, or a covariance that is
    /// not symmetric positive definite; or more nodes or springs than 32-bit indices can number.
    pub fn new(nodes: usize, springs: &[Spring]) -> Result<Self, NetworkError> {
        Self::from_vec(nodes, springs.to_vec())
    }

    /// As [`new`](Self::new), without copying the springs.
    ///
    /// # Errors
    ///
    /// As [`new`](Self::new).
    pub fn from_vec(nodes: usize, springs: Vec<Spring>) -> Result<Self, NetworkError> {
        if nodes >= u32::MAX as usize || springs.len() > (u32::MAX / 2) as usize {
            return Err(NetworkError::TooLarge { nodes, springs: springs.len() });
        }
        let mut isotropic = true;
        for (index, spring) in springs.iter().enumerate() {
            isotropic &= spring.is_isotropic();
            check(index, spring, nodes)?;
        }
        let components = Components::new(nodes, springs.iter().map(|s| (s.from, s.to)));
        Ok(Self::assembled(Arc::new(springs), None, isotropic, components))
    }

    fn assembled(
        springs: Arc<Vec<Spring>>,
        weights: Option<Arc<[f64]>>,
        isotropic: bool,
        components: Components,
    ) -> Self {
        Self {
            springs,
            weights,
            isotropic,
            components,
            adjacency: OnceLock::new(),
            tree: OnceLock::new(),
            rows: OnceLock::new(),
        }
    }

    /// The same springs held by other nodes: each of `anchors` replaces the anchor of its component.
    ///
    /// # Errors
    ///
    /// An anchor that does not exist or is nowhere (NaN), or two anchors in one component.
    pub fn with_anchors(self, anchors: &[Anchor]) -> Result<Self, NetworkError> {
        let components = self.components.with_anchors(anchors)?;
        Ok(Self::assembled(self.springs, self.weights, self.isotropic, components))
    }

    /// The same springs held by `anchors` wherever their components allow.
    pub(crate) fn held(self, anchors: &[Anchor]) -> Self {
        let components = self.components.inheriting(anchors);
        Self::assembled(self.springs, self.weights, self.isotropic, components)
    }

    /// The same springs with each one's information (inverse covariance) multiplied by its weight.
    ///
    /// This is how a robust estimator softens springs it mistrusts; the springs are shared, not copied, and weights do not
    /// multiply up: they always count from the springs themselves. A weight of zero takes the spring out of the problem.
    /// Where that splits a component, the part that lost its anchor is held by its lowest-numbered node instead.
    ///
    /// # Errors
    ///
    /// Another number of weights than springs, or a weight that is negative or not finite.
    pub fn reweighted(&self, weights: &[f64]) -> Result<Self, NetworkError> {
        if weights.len() != self.springs.len() {
            return Err(NetworkError::WeightCount { springs: self.springs.len(), weights: weights.len() });
        }
        if let Some((spring, &weight)) = weights.iter().enumerate().find(|(_, w)| !(w.is_finite() && **w >= 0.0)) {
            return Err(NetworkError::WeightInvalid { spring, weight });
        }
        let active = self.springs.iter().zip(weights).filter(|(_, w)| **w > 0.0);
        let components = Components::new(self.len(), active.map(|(s, _)| (s.from, s.to))).inheriting(self.anchors());
        Ok(Self::assembled(Arc::clone(&self.springs), Some(weights.into()), self.isotropic, components))
    }

    /// How many nodes there are.
    #[must_use]
    pub fn len(&self) -> usize {
        self.components.of_node.len()
    }

    /// Whether there is no node at all.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The springs, in the order they were given.
    #[must_use]
    pub fn springs(&self) -> &[Spring] {
        &self.springs
    }

    /// The springs back, without copying them if no other network shares them.
    #[must_use]
    pub fn into_springs(self) -> Vec<Spring> {
        Arc::try_unwrap(self.springs).unwrap_or_else(|shared| shared.to_vec())
    }

    /// The factor on the information of one spring: 1 unless [`reweighted`](Self::reweighted).
    #[must_use]
    pub fn weight(&self, spring: usize) -> f64 {
        self.weights.as_ref().map_or(1.0, |w| w[spring])
    }

    /// Whether every spring is equally sure in every direction, so that x and y share one scalar matrix.
    #[must_use]
    pub fn is_isotropic(&self) -> bool {
        self.isotropic
    }

    /// How many connected components there are. Springs of weight zero do not connect.
    #[must_use]
    pub fn components(&self) -> usize {
        self.components.anchors.len()
    }

    /// The component of a node: components are numbered by their lowest node.
    #[must_use]
    pub fn component(&self, node: usize) -> usize {
        self.components.of_node[node] as usize
    }

    /// The anchors, one per component, in the order of the components.
    #[must_use]
    pub fn anchors(&self) -> &[Anchor] {
        &self.components.anchors
    }

    /// Whether `node` holds its component.
    #[must_use]
    pub fn is_anchor(&self, node: usize) -> bool {
        self.components.anchors[self.component(node)].node == node
    }

    /// Where the springs alone put every node when followed from the anchors along the surest chains: those of fewest
    /// springs, or, where variances are more than 10⁴ apart, those of least total variance.
    ///
    /// On a tree this is the optimum; with loops it is where relaxation may set out from.
    #[must_use]
    pub fn dead_reckoning(&self) -> Vec<Point2<f64>> {
        let mut positions = vec![Point2::origin(); self.len()];
        for anchor in self.anchors() {
            positions[anchor.node] = anchor.position;
        }
        let tree = self.tree();
        for &node in &tree.order[self.components()..] {
            let parent = tree.parent[node as usize];
            positions[node as usize] = positions[parent.node as usize] + self.rest_from(parent.node, parent.spring);
        }
        positions
    }

    /// The energy at `positions`: each spring counted once (the double sum of the paper is twice this).
    ///
    /// # Panics
    ///
    /// If there is not exactly one position per node.
    #[must_use]
    pub fn energy(&self, positions: &[Point2<f64>]) -> f64 {
        assert_eq!(positions.len(), self.len(), "one position per node");
        // Summed in blocks, so that rounding grows with the square root of a million springs at worst, not with their number.
        let blocks = (0..self.springs.len()).step_by(BLOCK).map(|first| {
            let last = (first + BLOCK).min(self.springs.len());
            (first..last).map(|index| self.spring_energy(index, positions)).sum::<f64>()
        });
        blocks.sum()
    }

    /// The energy of one spring at `positions`: its squared residual in standard deviations, times its weight.
    ///
    /// # Panics
    ///
    /// If the spring or a node has no entry.
    #[must_use]
    pub fn spring_energy(&self, spring: usize, positions: &[Point2<f64>]) -> f64 {
        let s = &self.springs[spring];
        let r = positions[s.to] - positions[s.from] - s.rest;
        if self.isotropic {
            return self.weight(spring) * r.norm_squared() / s.covariance.m11;
        }
        self.weight(spring) * r.dot(&(s.information() * r))
    }

    // --- What the solvers see. ---

    pub(crate) fn adjacency(&self) -> &Adjacency {
        self.adjacency.get_or_init(|| self.find_adjacency())
    }

    /// The network for one who walks over it once: which springs end where is forgotten afterwards, unless it was known.
    pub(crate) fn passing(&self) -> Passing<'_> {
        let adjacency = match self.adjacency.get() {
            Some(known) => Cow::Borrowed(known),
            None => Cow::Owned(self.find_adjacency()),
        };
        Passing { network: self, adjacency }
    }

    fn find_adjacency(&self) -> Adjacency {
        Adjacency::new(self.len(), &self.springs, |spring| self.weight(spring) > 0.0)
    }

    pub(crate) fn tree(&self) -> &SpanningTree {
        self.tree.get_or_init(|| {
            let variance =
                |spring: u32| self.springs[spring as usize].covariance.trace() / self.weight(spring as usize);
            let (mut least, mut most) = (f64::INFINITY, 0.0_f64);
            for spring in (0..self.springs.len()).filter(|&spring| self.weight(spring) > 0.0) {
                #[expect(clippy::cast_possible_truncation, reason = "`from_vec` checked that every index fits 32 bits")]
                let variance = variance(spring as u32);
                (least, most) = (least.min(variance), most.max(variance));
            }
            if most > ALIKE * least {
                SpanningTree::surest(self.len(), self.adjacency(), self.anchors(), variance)
            } else {
                SpanningTree::breadth_first(self.len(), self.adjacency(), self.anchors())
            }
        })
    }

    pub(crate) fn rows(&self) -> &SweepRows {
        self.rows.get_or_init(|| SweepRows::new(self))
    }

    /// The displacement along `spring` for one who leaves `node`.
    pub(crate) fn rest_from(&self, node: u32, spring: u32) -> Vector2<f64> {
        let s = &self.springs[spring as usize];
        if s.from == node as usize { s.rest } else { -s.rest }
    }

    /// Stiffness of an isotropic spring, weight included.
    pub(crate) fn stiffness(&self, spring: usize) -> f64 {
        self.weight(spring) / self.springs[spring].covariance.m11
    }

    /// Stiffness of any spring, weight included.
    pub(crate) fn information(&self, spring: usize) -> Matrix2<f64> {
        self.springs[spring].information() * self.weight(spring)
    }

    /// Compliance of any spring of positive weight, weight included.
    pub(crate) fn covariance(&self, spring: usize) -> Matrix2<f64> {
        self.springs[spring].covariance / self.weight(spring)
    }

    /// `start` as a solver may use it: coordinates that are not finite are replaced by dead reckoning.
    ///
    /// # Panics
    ///
    /// If there is not exactly one position per node.
    pub(crate) fn usable_start(&self, start: &[Point2<f64>]) -> Vec<Point2<f64>> {
        assert_eq!(start.len(), self.len(), "one start position per node");
        if start.iter().all(is_finite) {
            return start.to_vec();
        }
        let reckoned = self.dead_reckoning();
        start.iter().zip(reckoned).map(|(&given, reckoned)| if is_finite(&given) { given } else { reckoned }).collect()
    }
}

/// A network and which springs end where, for as long as it is looked at.
#[derive(Debug)]
pub(crate) struct Passing<'a> {
    pub(crate) network: &'a Network,
    pub(crate) adjacency: Cow<'a, Adjacency>,
}

/// Springs whose variances are within this factor of each other count as about equally stiff.
const ALIKE: f64 = 1e4;

/// Springs per partial sum of the energy.
const BLOCK: usize = 512;

fn is_finite(p: &Point2<f64>) -> bool {
    p.x.is_finite() && p.y.is_finite()
}

/// Everything that can be wrong with one spring.
pub(crate) fn check(index: usize, spring: &Spring, nodes: usize) -> Result<(), NetworkError> {
    for node in [spring.from, spring.to] {
        if node >= nodes {
            return Err(NetworkError::NodeOutOfRange { spring: index, node, nodes });
        }
    }
    let u = &spring.covariance;
    if spring.is_isotropic() {
        // Nearly every spring of a map: asked in short.
        let stiffness = u.m11.recip();
        if u.m11 > 0.0
            && u.m11.is_finite()
            && (spring.rest.norm_squared() * stiffness).is_finite()
            && stiffness.is_finite()
        {
            return Ok(());
        }
    }
    let information = spring.information();
    let definite = u.m11 > 0.0 && u.m22 > 0.0 && u.m11 * u.m22 > u.m12 * u.m21;
    // Rounding of a rotated covariance may tell the two mixed terms apart in the last digits.
    let symmetric = (u.m12 - u.m21).abs() <= 1e-9 * u.m11.max(u.m22);
    let invertible = information.iter().chain(u.iter()).all(|v| v.is_finite()) && information.m11 > 0.0;
    // An isotropic variance below 1e-162 has a product of variances that underflows, and is right all the same.
    if !(symmetric && invertible && (definite || (spring.is_isotropic() && u.m11 > 0.0))) {
        let [xx, xy, yx, yy] = [u.m11, u.m12, u.m21, u.m22];
        return Err(NetworkError::CovarianceNotPositiveDefinite { spring: index, xx, xy, yx, yy });
    }
    if !spring.rest.dot(&(information * spring.rest)).is_finite() {
        return Err(NetworkError::RestNotFinite { spring: index, x: spring.rest.x, y: spring.rest.y });
    }
    Ok(())
}
