use relaxation::g2o::{BuildError, Graph, PointVertex};
use relaxation::nalgebra::Point2;
use relaxation::{
    Auto, ConjugateGradient, Covariance, Direct, Elimination, GaussSeidel, Kernel, Multilevel, Network, RobustMethod,
    RobustOptions, Solver, Sor, certify, relax_robustly,
};

use super::report::{Proof, Report, STRAINED, Structure};
use super::{Method, RelaxArgs, Robust};
use crate::exit::Exit;
use crate::failure::Failure;

/// 99 % of the squared residuals of true displacements are below.
const INLIER: f64 = 9.210;

/// Relaxes the file's points and puts their new positions into it.
pub(super) fn relax(args: &RelaxArgs, graph: &mut Graph) -> Result<Report, Failure> {
    let problem = graph.point_problem().map_err(|error| unusable(args, &error))?;
    let solved = solve(args, &problem.network, &problem.start)?;
    graph.points = problem
        .ids
        .iter()
        .zip(&solved.positions)
        .map(|(id, position)| PointVertex { id: *id, position: *position })
        .collect();
    let network = &problem.network;
    Ok(Report {
        kind: "points",
        edges: network.springs().iter().map(|s| (s.from, s.to)).collect(),
        made: problem.made,
        left_out: 0,
        method: solved.method,
        robust: args.robust.name(),
        chi2_before: network.energy(&problem.start),
        chi2_after: solved.network.energy(&solved.positions),
        iterations: solved.iterations,
        converged: solved.converged,
        seconds: 0.0,
        components: network.components(),
        degrees_of_freedom: degrees(2, network.springs().len(), problem.ids.len(), network.components()),
        proof: solved.proof,
        weights: solved.weights,
        covariances: covariances(args, &solved.network)?,
        before: problem.start,
        after: solved.positions,
        ids: problem.ids,
    })
}

/// Positions and how they came about.
pub(super) struct Solved {
    pub(super) positions: Vec<Point2<f64>>,
    /// With the final weights.
    pub(super) network: Network,
    pub(super) method: String,
    pub(super) iterations: usize,
    pub(super) converged: bool,
    pub(super) proof: Proof,
    pub(super) weights: Vec<f64>,
}

/// Solves the linear problem as the arguments ask.
pub(super) fn solve(args: &RelaxArgs, network: &Network, start: &[Point2<f64>]) -> Result<Solved, Failure> {
    let failed = |error: &dyn std::error::Error| {
        Failure::new(Exit::Failed, "relax.solve", format!("could not relax {}: {error}", args.graph.display()))
            .because_of(error)
    };
    if let Some(method) = args.robust.method(INLIER) {
        let trusted: Vec<bool> = network.springs().iter().map(|s| s.from.abs_diff(s.to) == 1).collect();
        let options = RobustOptions { method, ..RobustOptions::default() };
        let robust = relax_robustly(network, &trusted, &options).map_err(|error| failed(&error))?;
        let weighted = network.reweighted(&robust.weights).map_err(|error| failed(&error))?;
        let certificate = certify(&weighted, &robust.positions, STRAINED);
        let (method, converged) = ("reweighted least squares".to_owned(), robust.iterations <= options.max_iterations);
        return Ok(Solved {
            positions: robust.positions,
            network: weighted,
            method,
            iterations: robust.iterations,
            converged,
            proof: Proof::Reweighted(Structure::of_points(&certificate)),
            weights: robust.weights,
        });
    }
    let solver = args.method.solver();
    let relaxed = solver.solve(network, start);
    let proof = Proof::Global(Box::new(certify(network, &relaxed.positions, STRAINED)));
    Ok(Solved {
        positions: relaxed.positions,
        network: network.clone(),
        method: solver.name().to_owned(),
        iterations: relaxed.sweeps,
        converged: relaxed.converged,
        proof,
        weights: Vec::new(),
    })
}

/// Row by row, where they were asked for.
pub(super) fn covariances(args: &RelaxArgs, network: &Network) -> Result<Vec<Vec<f64>>, Failure> {
    if !args.covariance {
        return Ok(Vec::new());
    }
    let covariance = Covariance::new(network);
    let one = |node| {
        let c = covariance.node(node);
        vec![c.m11, c.m12, c.m21, c.m22]
    };
    Ok((0..network.len()).map(one).collect())
}

/// Measured numbers less free ones.
pub(super) fn degrees(each: usize, edges: usize, nodes: usize, held: usize) -> i64 {
    let count = |value: usize| i64::try_from(each * value).unwrap_or(i64::MAX);
    count(edges) - count(nodes) + count(held)
}

/// What is wrong with the graph.
pub(super) fn unusable(args: &RelaxArgs, error: &BuildError) -> Failure {
    Failure::rejected(&args.graph, "graph.unusable", error)
}

impl Method {
    fn solver(self) -> Box<dyn Solver> {
        match self {
            Self::Auto => Box::new(Auto),
            Self::Elimination => Box::new(Elimination),
            Self::Direct => Box::new(Direct),
            Self::GaussSeidel => Box::new(GaussSeidel::default()),
            Self::Sor => Box::new(Sor::default()),
            Self::ConjugateGradient => Box::new(ConjugateGradient::default()),
            Self::Multilevel => Box::new(Multilevel::default()),
        }
    }
}

impl Robust {
    /// With `inlier` the largest squared residual of a true edge.
    pub(super) fn method(self, inlier: f64) -> Option<RobustMethod> {
        match self {
            Self::None => None,
            Self::Gnc => Some(RobustMethod::TruncatedLeastSquares { bound: inlier }),
            Self::GncGemanMcclure => Some(RobustMethod::GemanMcClure { bound: inlier }),
            Self::Huber => Some(RobustMethod::Kernel(Kernel::Huber { delta: 1.345 })),
            Self::Cauchy => Some(RobustMethod::Kernel(Kernel::Cauchy { delta: 1.0 })),
            Self::GemanMcclure => Some(RobustMethod::Kernel(Kernel::GemanMcClure { delta: 3.0 })),
            Self::Dcs => Some(RobustMethod::Kernel(Kernel::Dcs { phi: 1.0 })),
        }
    }

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Gnc => "gnc",
            Self::GncGemanMcclure => "gnc-geman-mcclure",
            Self::Huber => "huber",
            Self::Cauchy => "cauchy",
            Self::GemanMcclure => "geman-mcclure",
            Self::Dcs => "dcs",
        }
    }
}
