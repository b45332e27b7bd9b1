use std::fmt::Write;
use std::path::Path;

use nalgebra::Point2;
use relaxation::g2o::Graph;
use relaxation::{Certificate, PoseCertificate};
use serde_json::{Value, json};

/// What a relaxation came to.
#[derive(Debug)]
pub(super) struct Report {
    /// `poses` or `points`.
    pub(super) kind: &'static str,
    /// The id of each node.
    pub(super) ids: Vec<u64>,
    /// First and last node of each edge, by number of the node.
    pub(super) edges: Vec<(usize, usize)>,
    /// Vertices that the file did not have.
    pub(super) made: usize,
    /// Edges that no method can use.
    pub(super) left_out: usize,
    /// How positions were computed.
    pub(super) method: String,
    /// What was done about false edges.
    pub(super) robust: &'static str,
    /// As g2o defines it.
    pub(super) chi2_before: f64,
    pub(super) chi2_after: f64,
    pub(super) iterations: usize,
    pub(super) converged: bool,
    pub(super) seconds: f64,
    pub(super) components: usize,
    pub(super) degrees_of_freedom: i64,
    pub(super) proof: Proof,
    /// One for each edge; empty where all are believed.
    pub(super) weights: Vec<f64>,
    /// Covariance of each node, row by row; empty where nobody asked.
    pub(super) covariances: Vec<Vec<f64>>,
    pub(super) before: Vec<Point2<f64>>,
    pub(super) after: Vec<Point2<f64>>,
}

/// How many edges with large residuals are named.
pub(super) const STRAINED: usize = 10;

/// What is known of the distance to the optimum.
#[derive(Debug)]
pub(super) enum Proof {
    /// A convex problem: the gap is proven.
    Global(Box<Certificate>),
    /// Poses: by how much one more step could lower χ², and how many descents ended no lower.
    Local { gap: f64, descents: usize, structure: Structure },
    /// The problem with the final weights.
    Reweighted(Structure),
}

impl Proof {
    fn structure(&self) -> Structure {
        match self {
            Self::Global(certificate) => Structure::of_points(certificate),
            Self::Local { structure, .. } | Self::Reweighted(structure) => structure.clone(),
        }
    }
}

/// What holds a graph together and what strains it.
#[derive(Debug, Clone)]
pub(super) struct Structure {
    /// How many edges are part of no loop.
    bridges: usize,
    /// The edges with the largest residuals in standard deviations, the worst first.
    strained: Vec<(usize, f64)>,
}

impl Structure {
    pub(super) fn of_points(certificate: &Certificate) -> Self {
        let strained = certificate.strained.iter().map(|s| (s.spring, s.sigmas)).collect();
        Self { bridges: certificate.bridges.len(), strained }
    }

    pub(super) fn of_poses(certificate: &PoseCertificate) -> Self {
        let strained = certificate.strained.iter().map(|s| (s.spring, s.sigmas)).collect();
        Self { bridges: certificate.bridges.len(), strained }
    }
}

impl Report {
    fn rejected(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.weights.iter().copied().enumerate().filter(|(_, weight)| *weight < 0.5)
    }

    pub(super) fn to_json(&self, path: &Path, graph: &Graph) -> Value {
        let skipped: Vec<Value> = graph
            .skipped
            .iter()
            .map(|s| json!({ "tag": s.tag, "count": s.count, "first_line": s.first_line }))
            .collect();
        let rejected: Vec<Value> = self
            .rejected()
            .map(|(edge, weight)| {
                let (from, to) = self.edges[edge];
                json!({ "edge": edge, "from": self.ids[from], "to": self.ids[to], "weight": weight })
            })
            .collect();
        let mut document = json!({
            "schema": "topogrid/relax/1", "file": path.display().to_string(), "holds": self.kind,
            "nodes": self.ids.len(), "edges": self.edges.len(), "components": self.components,
            "degrees_of_freedom": self.degrees_of_freedom, "vertices_made": self.made,
            "edges_left_out": self.left_out, "duplicates": graph.duplicates.len(), "skipped": skipped,
            "method": self.method, "chi2": { "before": self.chi2_before, "after": self.chi2_after },
            "iterations": self.iterations, "converged": self.converged, "seconds": self.seconds,
            "certificate": self.certificate(),
            "robust": { "method": self.robust, "rejected": rejected },
        });
        if !self.covariances.is_empty() {
            let one = |(id, covariance): (&u64, &Vec<f64>)| json!({ "id": id, "covariance": covariance });
            document["covariances"] = self.ids.iter().zip(&self.covariances).map(one).collect();
        }
        document
    }

    /// What is known of the result, whatever the method.
    fn certificate(&self) -> Value {
        let mut certificate = match &self.proof {
            Proof::Global(c) => json!({
                "kind": "global optimum", "gap": c.gap, "relative_gap": c.relative_gap, "max_shift_m": c.max_shift,
                "residual_norm": c.residual_norm,
            }),
            Proof::Local { gap, descents, .. } => json!({
                "kind": "lowest minimum found", "gap": gap, "relative_gap": gap / self.chi2_after.max(f64::MIN_POSITIVE),
                "descents": descents,
            }),
            Proof::Reweighted(_) => json!({ "kind": "optimum for the final weights" }),
        };
        let Structure { bridges, strained } = self.proof.structure();
        certificate["bridges"] = json!(bridges);
        certificate["strained"] = strained.iter().map(|(edge, sigmas)| self.strain(*edge, *sigmas)).collect();
        certificate
    }

    fn strain(&self, edge: usize, sigmas: f64) -> Value {
        let (from, to) = self.edges[edge];
        json!({ "edge": edge, "from": self.ids[from], "to": self.ids[to], "sigmas": sigmas })
    }

    /// For eyes; writing to a string cannot fail.
    pub(super) fn to_text(&self, path: &Path) -> String {
        let mut text = format!(
            "{}: {} {} and {} edges in {} {}\n",
            path.display(),
            self.ids.len(),
            self.kind,
            self.edges.len(),
            self.components,
            if self.components == 1 { "piece" } else { "pieces" }
        );
        let _ = writeln!(
            text,
            "  χ²         {:.6} → {:.6} ({} degrees of freedom)",
            self.chi2_before, self.chi2_after, self.degrees_of_freedom
        );
        let _ = writeln!(text, "  method     {}, {} iterations, {:.3} s", self.method, self.iterations, self.seconds);
        let _ = match &self.proof {
            Proof::Global(c) => writeln!(
                text,
                "  optimum    global, gap at most {:.1e} of χ², no place more than {:.1e} m off",
                c.relative_gap, c.max_shift
            ),
            Proof::Local { gap, descents, .. } => {
                writeln!(text, "  optimum    lowest minimum of {descents} descents, one more step would gain {gap:.1e}")
            }
            Proof::Reweighted(_) => writeln!(text, "  optimum    for the final weights"),
        };
        if let Some(&(edge, sigmas)) = self.proof.structure().strained.first() {
            let (from, to) = self.edges[edge];
            let _ =
                writeln!(text, "  worst edge {} → {}, {sigmas:.1} σ from what it says", self.ids[from], self.ids[to]);
        }
        if !self.converged {
            let _ = writeln!(text, "  ! not converged: the coordinates are not the optimum");
        }
        if !self.weights.is_empty() {
            let _ = writeln!(text, "  robust     {}: {} edges let go", self.robust, self.rejected().count());
            for (edge, weight) in self.rejected().take(8) {
                let (from, to) = self.edges[edge];
                let _ = writeln!(text, "             {} → {} (weight {weight:.3})", self.ids[from], self.ids[to]);
            }
        }
        if self.made > 0 {
            let _ =
                writeln!(text, "  made       {} vertices that the file does not have, by dead reckoning", self.made);
        }
        let worst = self
            .covariances
            .iter()
            .zip(&self.ids)
            .map(|(c, id)| {
                let size = if c.len() == 9 { 3 } else { 2 };
                ((c[0] + c[size + 1]).sqrt(), *id)
            })
            .max_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((sigma, id)) = worst {
            let _ = writeln!(text, "  least sure vertex {id}, σ {sigma:.3} m (all of them: --json)");
        }
        text
    }
}
