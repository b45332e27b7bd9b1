use std::path::Path;

use relaxation::g2o::{self, Graph};
use serde_json::json;

use crate::context::Context;
use crate::failure::Failure;
use crate::files;

/// Whether the name says that the file is a graph.
pub(super) fn is_graph(path: &Path) -> bool {
    let name = path.to_string_lossy().to_lowercase();
    let name = name.strip_suffix(".gz").unwrap_or(&name);
    [".g2o", ".graph", ".toro"].iter().any(|ending| name.ends_with(ending))
}

/// Prints what the graph holds; whether it is healthy.
pub(super) fn inspect(path: &Path, context: &Context) -> Result<bool, Failure> {
    let graph = g2o::read(files::open(path)?).map_err(|error| Failure::rejected(path, "graph.parse", &error))?;
    let (nodes, edges) = (graph.poses.len() + graph.points.len(), graph.pose_edges.len() + graph.point_edges.len());
    let findings = findings(&graph);
    if context.json {
        let skipped: Vec<_> =
            graph.skipped.iter().map(|skipped| json!({ "tag": skipped.tag, "count": skipped.count })).collect();
        context.print_json(&json!({
            "schema": "topogrid/inspect/1", "file": path.display().to_string(), "holds": "graph",
            "graph": { "poses": graph.poses.len(), "points": graph.points.len(), "pose_edges": graph.pose_edges.len(),
                       "point_edges": graph.point_edges.len(), "fixed": graph.fixed.len(), "skipped": skipped },
            "healthy": findings.is_empty(), "findings": findings,
        }))?;
    } else {
        let mut text = format!("{}: a graph of {nodes} vertices and {edges} edges\n", path.display());
        for (count, what) in [
            (graph.poses.len(), "poses"),
            (graph.points.len(), "points"),
            (graph.pose_edges.len(), "edges between poses"),
            (graph.point_edges.len(), "edges between points"),
            (graph.fixed.len(), "fixed vertices"),
        ] {
            if count > 0 {
                text += &format!("  {count:>8}  {what}\n");
            }
        }
        findings.iter().for_each(|finding| text += &format!("  ! {finding}\n"));
        text += if findings.is_empty() { "healthy\n" } else { "not healthy\n" };
        context.print(&text)?;
    }
    Ok(findings.is_empty())
}

fn findings(graph: &Graph) -> Vec<String> {
    let mut findings = Vec::new();
    for skipped in &graph.skipped {
        findings.push(format!(
            "{} lines `{}` are of an unknown kind, the first is line {}",
            skipped.count, skipped.tag, skipped.first_line
        ));
    }
    if !graph.duplicates.is_empty() {
        findings.push(format!("{} vertices have an id that was used before", graph.duplicates.len()));
    }
    let ids: std::collections::BTreeSet<u64> =
        graph.poses.iter().map(|vertex| vertex.id).chain(graph.points.iter().map(|vertex| vertex.id)).collect();
    let ends = graph.pose_edges.iter().map(|edge| (edge.from, edge.to));
    let ends = ends.chain(graph.point_edges.iter().map(|edge| (edge.from, edge.to)));
    let dangling = ends.filter(|(from, to)| !ids.contains(from) || !ids.contains(to)).count();
    if dangling > 0 && !ids.is_empty() {
        findings.push(format!("{dangling} edges end at a vertex that is not in the file"));
    }
    if graph.pose_edges.is_empty() && graph.point_edges.is_empty() {
        findings.push("there are no edges".to_owned());
    }
    findings
}
