//! Graphs in files: g2o and TORO text, plain or gzip.
//!
//! | line | meaning |
//! |---|---|
//! | `VERTEX_SE2 id x y θ` | a pose, metres and radians |
//! | `EDGE_SE2 i j dx dy dθ I11 I12 I13 I22 I23 I33` | pose of `j` in the frame of `i`, upper triangle of its information matrix |
//! | `VERTEX_XY id x y` | a point |
//! | `EDGE_XY i j dx dy I11 I12 I22` | displacement from `i` to `j`; `EDGE_POINTXY` is the name g2o's own program knows |
//! | `FIX id …` | vertices that stay where they are |
//! | `VERTEX2 id x y θ` | TORO's name for a pose |
//! | `EDGE2 i j dx dy dθ I11 I12 I22 I33 I13 I23` | TORO's edge: **another order** of the same information matrix |
//!
//! Both dialects may stand in one file. Blank lines and `#` comments are passed over; a line with an unknown tag is counted in
//! [`Graph::skipped`], so that nothing disappears silently; a line with a known tag that cannot be read is an error that says where.
//!
//! ```
//! use relaxation::g2o;
//!
//! let text = "VERTEX_XY 0 0 0\nVERTEX_XY 1 2 0\nEDGE_POINTXY 0 1 2.5 0 100 0 100\n";
//! let graph = g2o::read(text.as_bytes())?;
//! assert_eq!(graph.point_edges[0].displacement.x, 2.5);
//! # Ok::<(), relaxation::g2o::ParseError>(())
//! ```

mod build;
mod number;
mod read;
mod write;

use nalgebra::{Matrix2, Matrix3, Point2, Vector2};

use crate::pose::Pose;

pub use build::{BuildError, PointProblem, PoseProblem};
pub use read::{ParseError, read};
pub use write::{WriteError, write, write_gzip, write_toro, write_toro_gzip};

/// What a file holds, in the order it was written, with the numbers as they stand there.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Graph {
    /// `VERTEX_SE2` and `VERTEX2` lines; a repeated id counts once, the first time.
    pub poses: Vec<PoseVertex>,
    /// `VERTEX_XY` lines; a repeated id counts once, the first time.
    pub points: Vec<PointVertex>,
    /// `EDGE_SE2` and `EDGE2` lines.
    pub pose_edges: Vec<PoseEdge>,
    /// `EDGE_XY` and `EDGE_POINTXY` lines.
    pub point_edges: Vec<PointEdge>,
    /// The vertices of the `FIX` lines.
    pub fixed: Vec<u64>,
    /// Lines with tags we do not know, by tag in order of appearance.
    pub skipped: Vec<Skipped>,
    /// Vertex lines whose id had been used before, and were therefore left out.
    pub duplicates: Vec<u64>,
}

/// A pose with its name.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseVertex {
    /// The name edges call it by.
    pub id: u64,
    /// Its pose in the map.
    pub pose: Pose,
}

/// A point with its name.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointVertex {
    /// The name edges call it by.
    pub id: u64,
    /// Its position in the map, metres.
    pub position: Point2<f64>,
}

/// A measured pose of `to` in the frame of `from`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseEdge {
    /// Id of the vertex measured from.
    pub from: u64,
    /// Id of the vertex measured.
    pub to: u64,
    /// Pose of `to` in the frame of `from`.
    pub from_to: Pose,
    /// Upper triangle of the information matrix, row by row (`I11 I12 I13 I22 I23 I33`): 1/m², 1/(m·rad), 1/rad².
    pub information: [f64; 6],
}

impl PoseEdge {
    /// The information matrix, whole.
    #[must_use]
    pub fn information_matrix(&self) -> Matrix3<f64> {
        let [a, b, c, d, e, f] = self.information;
        Matrix3::new(a, b, c, b, d, e, c, e, f)
    }
}

/// A measured displacement from one point to another, in the map's directions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointEdge {
    /// Id of the vertex measured from.
    pub from: u64,
    /// Id of the vertex measured.
    pub to: u64,
    /// From `from` to `to`, metres.
    pub displacement: Vector2<f64>,
    /// Upper triangle of the information matrix (`I11 I12 I22`), 1/m².
    pub information: [f64; 3],
}

impl PointEdge {
    /// The information matrix, whole.
    #[must_use]
    pub fn information_matrix(&self) -> Matrix2<f64> {
        let [a, b, c] = self.information;
        Matrix2::new(a, b, b, c)
    }
}

/// Lines that were passed over because their tag is unknown.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Skipped {
    /// The tag, shortened when it is very long; `…` stands for all tags after the first 64.
    pub tag: String,
    /// How many lines began with it.
    pub count: usize,
    /// The first of them, counted from 1.
    pub first_line: usize,
}
