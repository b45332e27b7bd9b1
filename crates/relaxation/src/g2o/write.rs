//! Writing: the shortest text that reads back to the same bits.

use std::io::{self, Write};

use flate2::{Compression, write::GzEncoder};

use super::{Graph, PointEdge, PoseEdge};

/// Why a graph could not be written.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WriteError {
    /// The destination failed.
    #[error("writing failed")]
    Io(#[from] io::Error),
    /// TORO knows poses only.
    #[error("TORO text holds poses only, and this graph has {points} points and {edges} displacements between points")]
    PointsInToro {
        /// How many points there are.
        points: usize,
        /// How many displacements between points there are.
        edges: usize,
    },
}

/// Writes `graph` in g2o syntax, plain: poses, points, edges, then fixed ids. [`read`](super::read) gives the same graph back,
/// except for what it had skipped.
///
/// # Errors
/// A failing destination.
pub fn write(graph: &Graph, out: &mut impl Write) -> Result<(), WriteError> {
    for vertex in &graph.poses {
        write!(out, "VERTEX_SE2 {}", vertex.id)?;
        numbers(out, &[vertex.pose.x, vertex.pose.y, vertex.pose.heading])?;
    }
    for vertex in &graph.points {
        write!(out, "VERTEX_XY {}", vertex.id)?;
        numbers(out, &[vertex.position.x, vertex.position.y])?;
    }
    for edge in &graph.pose_edges {
        pose_edge(out, "EDGE_SE2", edge, edge.information)?;
    }
    for edge in &graph.point_edges {
        point_edge(out, edge)?;
    }
    for id in &graph.fixed {
        writeln!(out, "FIX {id}")?; // last: GTSAM reads no further than that
    }
    Ok(())
}

/// Writes `graph` in g2o syntax, compressed with gzip.
///
/// # Errors
/// A failing destination.
pub fn write_gzip(graph: &Graph, out: &mut impl Write) -> Result<(), WriteError> {
    let mut encoder = GzEncoder::new(io::BufWriter::new(out), Compression::default());
    write(graph, &mut encoder)?;
    encoder.finish()?.flush()?;
    Ok(())
}

/// Writes the poses of `graph` in TORO syntax. Fixed ids have no words there and are left out.
///
/// # Errors
/// A failing destination, or points, which TORO does not have.
pub fn write_toro(graph: &Graph, out: &mut impl Write) -> Result<(), WriteError> {
    if !graph.points.is_empty() || !graph.point_edges.is_empty() {
        return Err(WriteError::PointsInToro { points: graph.points.len(), edges: graph.point_edges.len() });
    }
    for vertex in &graph.poses {
        write!(out, "VERTEX2 {}", vertex.id)?;
        numbers(out, &[vertex.pose.x, vertex.pose.y, vertex.pose.heading])?;
    }
    for edge in &graph.pose_edges {
        let [i11, i12, i13, i22, i23, i33] = edge.information;
        pose_edge(out, "EDGE2", edge, [i11, i12, i22, i33, i13, i23])?;
    }
    Ok(())
}

/// Writes the poses of `graph` in TORO syntax, compressed with gzip.
///
/// # Errors
/// As [`write_toro`].
pub fn write_toro_gzip(graph: &Graph, out: &mut impl Write) -> Result<(), WriteError> {
    let mut encoder = GzEncoder::new(io::BufWriter::new(out), Compression::default());
    write_toro(graph, &mut encoder)?;
    encoder.finish()?.flush()?;
    Ok(())
}

fn pose_edge(out: &mut impl Write, tag: &str, edge: &PoseEdge, information: [f64; 6]) -> io::Result<()> {
    let [a, b, c, d, e, f] = information;
    let z = edge.from_to;
    write!(out, "{tag} {} {}", edge.from, edge.to)?;
    numbers(out, &[z.x, z.y, z.heading, a, b, c, d, e, f])
}

fn point_edge(out: &mut impl Write, edge: &PointEdge) -> io::Result<()> {
    let [a, b, c] = edge.information;
    write!(out, "EDGE_POINTXY {} {}", edge.from, edge.to)?;
    numbers(out, &[edge.displacement.x, edge.displacement.y, a, b, c])
}

/// The shortest decimal that reads back to the same bits; with an exponent where a plain one would have many zeros.
fn numbers(out: &mut impl Write, values: &[f64]) -> io::Result<()> {
    for value in values {
        let size = value.abs();
        if size == 0.0 || (1e-5..1e15).contains(&size) {
            write!(out, " {value}")?;
        } else {
            write!(out, " {value:e}")?;
        }
    }
    writeln!(out)
}

#[cfg(test)]
mod tests {
    use super::super::{PointVertex, PoseVertex, read};
    use super::*;
    use crate::pose::Pose;
    use nalgebra::{Point2, Vector2};
    use proptest::prelude::*;

    fn number() -> impl Strategy<Value = f64> {
        prop_oneof![-1e3..1e3, any::<f64>().prop_filter("finite", |v| v.is_finite())]
    }

    fn pose() -> impl Strategy<Value = Pose> {
        (number(), number(), number()).prop_map(|(x, y, heading)| Pose { x, y, heading })
    }

    fn graphs() -> impl Strategy<Value = Graph> {
        let poses = proptest::collection::btree_map(any::<u64>(), pose(), 0..5);
        let points = proptest::collection::btree_map(any::<u64>(), (number(), number()), 0..5);
        let pose_edges =
            proptest::collection::vec((any::<u64>(), any::<u64>(), pose(), proptest::array::uniform6(number())), 0..5);
        let point_edges =
            proptest::collection::vec((any::<u64>(), any::<u64>(), proptest::array::uniform5(number())), 0..5);
        let fixed = proptest::collection::vec(any::<u64>(), 0..3);
        (poses, points, pose_edges, point_edges, fixed).prop_map(|(poses, points, pose_edges, point_edges, fixed)| {
            Graph {
                poses: poses.into_iter().map(|(id, pose)| PoseVertex { id, pose }).collect(),
                points: points
                    .into_iter()
                    .map(|(id, (x, y))| PointVertex { id, position: Point2::new(x, y) })
                    .collect(),
                pose_edges: pose_edges
                    .into_iter()
                    .map(|(from, to, from_to, information)| PoseEdge { from, to, from_to, information })
                    .collect(),
                point_edges: point_edges
                    .into_iter()
                    .map(|(from, to, [x, y, a, b, c])| PointEdge {
                        from,
                        to,
                        displacement: Vector2::new(x, y),
                        information: [a, b, c],
                    })
                    .collect(),
                fixed,
                ..Graph::default()
            }
        })
    }

    proptest! {
        #[test]
        fn reading_undoes_writing(graph in graphs()) {
            let mut plain = Vec::new();
            write(&graph, &mut plain).unwrap();
            prop_assert_eq!(&read(&plain[..]).unwrap(), &graph);
            let mut compressed = Vec::new();
            write_gzip(&graph, &mut compressed).unwrap();
            prop_assert_eq!(&read(&compressed[..]).unwrap(), &graph);
        }

        #[test]
        fn reading_undoes_writing_toro(graph in graphs()) {
            let graph = Graph { points: vec![], point_edges: vec![], fixed: vec![], ..graph };
            let mut text = Vec::new();
            write_toro(&graph, &mut text).unwrap();
            prop_assert_eq!(read(&text[..]).unwrap(), graph);
        }
    }

    #[test]
    fn toro_refuses_points() {
        let graph = Graph { points: vec![PointVertex { id: 0, position: Point2::origin() }], ..Graph::default() };
        let error = write_toro(&graph, &mut Vec::new()).unwrap_err();
        assert_eq!(
            error.to_string(),
            "TORO text holds poses only, and this graph has 1 points and 0 displacements between points"
        );
    }
}
