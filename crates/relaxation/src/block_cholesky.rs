//! Sparse Cholesky factorisation of matrices made of small square blocks, one block for each node and each spring.
//!
//! Headings (1×1 or 2×2 blocks), positions (2×2) and poses (3×3) of one graph have one and the same block pattern. So the pattern is ordered
//! and analysed once ([`Symbolic`]) and serves every factorisation of every stage and every iteration; only numbers change.
//! The factorisation is multifrontal (Duff & Reid 1983): dense fronts of a few nodes each, added up along the elimination tree.

mod inverse;
mod kernel;
mod numeric;
mod symbolic;

pub(crate) use numeric::BlockCholesky;
pub(crate) use symbolic::{Slot, Symbolic};
