use nalgebra::Point2;
use relaxation::g2o::{Graph, PoseProblem, PoseVertex};
use relaxation::{
    Pose, PoseGraph, PoseGraphError, PoseOptions, RobustOptions, certify_poses, pose_covariances, relax_poses,
    relax_poses_robustly,
};

use super::report::{Proof, Report, STRAINED, Structure};
use super::{HeadingSource, Method, RelaxArgs, points};
use crate::context::Context;
use crate::exit::Exit;
use crate::failure::Failure;

/// 99 % of the squared residuals of true edges are below.
const INLIER: f64 = 11.345;

/// What one of the ways gave.
struct Solved {
    poses: Vec<Pose>,
    /// With the final weights.
    graph: PoseGraph,
    method: String,
    iterations: usize,
    converged: bool,
    proof: Proof,
    weights: Vec<f64>,
    covariances: Vec<Vec<f64>>,
}

/// Relaxes the file's poses and puts the new ones into it.
pub(super) fn relax(args: &RelaxArgs, graph: &mut Graph, context: &Context) -> Result<Report, Failure> {
    let mut problem_graph = graph.clone();
    let left_out = leave_out(args, &mut problem_graph, context);
    let problem = problem_graph.pose_problem().map_err(|error| {
        let failure = points::unusable(args, &error);
        if matches!(error, relaxation::g2o::BuildError::PoseEdge { .. }) {
            failure.help("--robust KIND leaves edges out whose information matrix is not positive definite")
        } else {
            failure
        }
    })?;
    let solved = match args.headings {
        HeadingSource::Given => with_given_headings(args, &problem)?,
        HeadingSource::Estimated => estimated(args, &problem, context)?,
    };
    let one = |(id, pose): (&u64, &Pose)| PoseVertex { id: *id, pose: *pose };
    graph.poses = problem.ids.iter().zip(&solved.poses).map(one).collect();
    let position = |pose: &Pose| Point2::from(pose.translation());
    let held = (0..problem.ids.len()).filter(|node| problem.graph.held(*node).is_some()).count();
    Ok(Report {
        kind: "poses",
        edges: problem.graph.springs().iter().map(|s| (s.from, s.to)).collect(),
        made: problem.made,
        left_out,
        method: solved.method,
        robust: args.robust.name(),
        chi2_before: problem.graph.chi2(&problem.start),
        chi2_after: solved.graph.chi2(&solved.poses),
        iterations: solved.iterations,
        converged: solved.converged,
        seconds: 0.0,
        components: problem.graph.components(),
        degrees_of_freedom: points::degrees(3, problem.graph.springs().len(), problem.ids.len(), held),
        proof: solved.proof,
        weights: solved.weights,
        covariances: solved.covariances,
        before: problem.start.iter().map(position).collect(),
        after: solved.poses.iter().map(position).collect(),
        ids: problem.ids,
    })
}

/// An edge whose information matrix is not positive definite cannot be weighed: a robust method treats it as false.
fn leave_out(args: &RelaxArgs, graph: &mut Graph, context: &Context) -> usize {
    if args.robust.method(INLIER).is_none() {
        return 0;
    }
    // Vertices stay, even where their only edge goes.
    let taken = graph.take_indefinite();
    if !taken.is_empty() {
        context.warn(&format!(
            "{} edges have an information matrix that is not positive definite and are left out, the first is {} → {}",
            taken.len(),
            taken[0].from,
            taken[0].to
        ));
    }
    taken.len()
}

fn failed(args: &RelaxArgs, error: &dyn std::error::Error) -> Failure {
    let message = format!("could not relax {}: {error}", args.graph.display());
    Failure::new(Exit::Failed, "relax.solve", message).because_of(error)
}

fn with_given_headings(args: &RelaxArgs, problem: &PoseProblem) -> Result<Solved, Failure> {
    let headings: Vec<f64> = problem.start.iter().map(|pose| pose.heading).collect();
    let network = problem.graph.network(&headings).map_err(|error| failed(args, &error))?;
    let start: Vec<Point2<f64>> = problem.start.iter().map(|pose| Point2::from(pose.translation())).collect();
    let solved = points::solve(args, &network, &start)?;
    let poses = solved.positions.iter().zip(&headings).map(|(p, heading)| Pose::new(p.x, p.y, *heading)).collect();
    let covariances = points::covariances(args, &solved.network)?;
    let graph = match solved.weights.is_empty() {
        true => problem.graph.clone(),
        false => problem.graph.reweighted(&solved.weights).map_err(|error| failed(args, &error))?,
    };
    let points::Solved { method, iterations, converged, proof, weights, .. } = solved;
    Ok(Solved { poses, graph, method, iterations, converged, proof, weights, covariances })
}

fn estimated(args: &RelaxArgs, problem: &PoseProblem, context: &Context) -> Result<Solved, Failure> {
    if args.method != Method::Auto {
        context.warn("--method is for known headings; estimated ones need Gauss-Newton (or say --headings given)");
    }
    let graph = &problem.graph;
    let options = PoseOptions::default();
    let mut solved = match args.robust.method(INLIER) {
        None => {
            let relaxed = relax_poses(graph, &options).map_err(|error| failed(args, &error))?;
            Solved {
                graph: graph.clone(),
                method: "headings, positions, Gauss-Newton".into(),
                iterations: relaxed.iterations,
                converged: relaxed.converged,
                proof: Proof::Local {
                    gap: relaxed.gap,
                    descents: relaxed.descents,
                    structure: Structure::of_poses(&certify_poses(graph, &relaxed.poses, STRAINED)),
                },
                poses: relaxed.poses,
                weights: Vec::new(),
                covariances: Vec::new(),
            }
        }
        Some(method) => {
            let trusted: Vec<bool> = graph.springs().iter().map(|s| s.from.abs_diff(s.to) == 1).collect();
            let robust = RobustOptions { method, ..RobustOptions::default() };
            let relaxed =
                relax_poses_robustly(graph, &trusted, &robust, &options).map_err(|error| failed(args, &error))?;
            let weighted = graph.reweighted(&relaxed.weights).map_err(|error| failed(args, &error))?;
            let certificate = certify_poses(&weighted, &relaxed.poses, STRAINED);
            Solved {
                graph: weighted,
                method: "reweighted Gauss-Newton".into(),
                iterations: relaxed.iterations,
                converged: true,
                proof: Proof::Reweighted(Structure::of_poses(&certificate)),
                poses: relaxed.poses,
                weights: relaxed.weights,
                covariances: Vec::new(),
            }
        }
    };
    if args.covariance {
        let all =
            pose_covariances(&solved.graph, &solved.poses).map_err(|error: PoseGraphError| failed(args, &error))?;
        solved.covariances = all.iter().map(|c| c.transpose().as_slice().to_vec()).collect();
    }
    Ok(solved)
}
