use std::io::{self, Write};

use hierarchy::{RouteGraph, RouteNode};
use serde_json::json;

use super::{Source, rounded};
use crate::run_folder::calendar::Moment;

/// The map of `topological_navigation` (University of Lincoln), with everything that its schema asks for and what its
/// planner reads: a node for each spot, with its edges, pose, tolerances and influence zone.
///
/// The date is that of the log's last entry: the same log gives the same bytes.
pub(super) fn write(out: &mut dyn Write, source: &Source) -> io::Result<()> {
    let graph = source.atlas.route_graph(&source.routes);
    let stamp = source.mapper.trajectory().samples().last().map_or(0.0, |sample| sample.stamp);
    let (name, frame) = (json!(source.name), json!(source.frame));
    write!(
        out,
        "meta:\n  last_updated: {}\nname: {name}\nmetric_map: {name}\npointset: {name}\n\
         transformation:\n  child: topo_map\n  parent: {frame}\n  rotation: {{w: 1.0, x: 0.0, y: 0.0, z: 0.0}}\n  \
         translation: {{x: 0.0, y: 0.0, z: 0.0}}\nnodes:{}\n",
        date(stamp),
        if graph.nodes.is_empty() { " []" } else { "" }
    )?;
    (0..graph.nodes.len()).try_for_each(|node| write_node(out, source, &graph, node))
}

fn write_node(out: &mut dyn Write, source: &Source, graph: &RouteGraph, index: usize) -> io::Result<()> {
    let node = &graph.nodes[index];
    let (map, frame, name) = (json!(source.name), json!(source.frame), json!(node.name));
    let neighbors = graph.edges.iter().filter_map(|edge| match (edge.from == index, edge.to == index) {
        (true, _) => Some((&graph.nodes[edge.to], edge)),
        (_, true) => Some((&graph.nodes[edge.from], edge)),
        _ => None,
    });
    let neighbors: Vec<_> = neighbors.collect();
    write!(out, "- meta: {{map: {map}, node: {name}, pointset: {map}}}\n  node:\n    name: {name}\n")?;
    writeln!(out, "    parent_frame: {frame}\n    localise_by_topic: ''")?;
    writeln!(out, "    edges:{}", if neighbors.is_empty() { " []" } else { "" })?;
    for (to, edge) in neighbors {
        let (there, id) = (json!(to.name), json!(format!("{}_{}", node.name, to.name)));
        write!(
            out,
            "    - edge_id: {id}\n      node: {there}\n      action: NavigateToPose\n      \
             action_type: geometry_msgs/PoseStamped\n      config: []\n      fail_policy: fail\n      \
             fluid_navigation: true\n      recovery_behaviours_config: ''\n      restrictions_planning: 'True'\n      \
             restrictions_runtime: 'True'\n      \
             goal: {{target_pose: {{header: {{frame_id: $node.parent_frame}}, pose: $node.pose}}}}\n      \
             properties: {{length_m: {:?}, std_m: {:?}, traversals: {}}}\n",
            rounded(edge.length),
            rounded(edge.sigma),
            edge.traversals
        )?;
    }
    write_pose(out, node)
}

fn write_pose(out: &mut dyn Write, node: &RouteNode) -> io::Result<()> {
    /// The influence zone is a regular octagon of this radius, in metres: half the distance between places.
    const RADIUS: f64 = 0.5;
    let (sin, cos) = (0.5 * node.heading).sin_cos();
    write!(
        out,
        "    pose:\n      orientation: {{w: {cos:.9}, x: 0.0, y: 0.0, z: {sin:.9}}}\n      \
         position: {{x: {:?}, y: {:?}, z: 0.0}}\n    \
         properties: {{xy_goal_tolerance: 0.3, yaw_goal_tolerance: 0.1, std_m: {:?}, visits: {}}}\n    \
         restrictions_planning: 'True'\n    restrictions_runtime: 'True'\n    verts:\n",
        rounded(node.position.x),
        rounded(node.position.y),
        rounded(node.sigma),
        node.visits
    )?;
    (0..8).try_for_each(|corner| {
        let (sin, cos) = (std::f64::consts::FRAC_PI_8 * f64::from(2 * corner + 1)).sin_cos();
        writeln!(out, "    - {{x: {:?}, y: {:?}}}", rounded(RADIUS * cos), rounded(RADIUS * sin))
    })
}

/// `2022-06-23_13-10-11`, in UTC.
fn date(stamp: f64) -> String {
    Moment::of(stamp).iso().trim_end_matches('Z').replace('T', "_").replace(':', "-")
}
