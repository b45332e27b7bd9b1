use nalgebra::{Isometry2, Matrix2, Point2};
use relaxation::Pose;
use relaxation::g2o::{Graph, PointEdge, PointVertex, PoseEdge, PoseVertex};
use topo_map::{Link, LinkOrigin, LinkState};

use crate::atlas::{Atlas, AtlasLink, AtlasPlace};
use crate::config::RelaxationPolicy;
use crate::coordinates::problem::{Problem, pose_spring};
use crate::mapper::{Mapper, MapperError};
use crate::metrics::{LinkMetrics, LogMetrics, METRICS_SCHEMA, Metrics, RelaxationMetrics};

impl Mapper {
    /// The topological map with its coordinates, as pictures, tables and exports need it.
    ///
    /// # Errors
    ///
    /// Links that cannot be relaxed.
    pub fn atlas(&self) -> Result<Atlas, MapperError> {
        let (map, coordinates) = (self.topology(), self.coordinates());
        let covariances = coordinates.problem(map)?.covariances(&coordinates.padded(map))?;
        let before = self.dead_reckoned();
        let names: std::collections::BTreeMap<_, _> = self.names().collect();
        let arrivals = self.arrivals();
        let place = |place: &topo_map::Place<_>| {
            let map_from_place = coordinates.map_from_place(place.id);
            AtlasPlace {
                id: place.id,
                name: names.get(&place.id).map(|name| (*name).to_owned()),
                visited: place.is_visited(),
                visits: place.visits,
                position: map_from_place.translation.vector.into(),
                heading: map_from_place.rotation.angle(),
                robot_heading: arrivals.get(&place.id).copied().unwrap_or(0.0),
                same_as: self.same_as(place.id),
                dead_reckoned: before.get(place.id.index()).copied().unwrap_or_else(Point2::origin),
                ellipse: covariances.get(place.id.index()).map(ellipse),
            }
        };
        Ok(Atlas {
            places: map.places().iter().map(place).collect(),
            links: map.links().iter().map(|link| self.atlas_link(link)).collect(),
        })
    }

    /// Which way the robot looked in the map when it first came to each place, in radians.
    fn arrivals(&self) -> std::collections::BTreeMap<topo_map::PlaceId, f64> {
        let heading = |anchor: &crate::trajectory::Anchor| {
            let map_from_place = self.coordinates().map_from_place(anchor.place);
            (anchor.place, (map_from_place * anchor.place_from_robot).rotation.angle())
        };
        // The first visit is put in last.
        self.trajectory().anchors().iter().rev().map(heading).collect()
    }

    fn atlas_link(&self, link: &Link) -> AtlasLink {
        let from = self.coordinates().map_from_place(link.from);
        let step = self.coordinates().map_from_place(link.to).translation.vector - from.translation.vector;
        // A link without a turn is a vector in the map's axes, one with a turn in those of its first place.
        let seen = if link.displacement.turn.is_some() { from.rotation.inverse() * step } else { step };
        let off = seen - link.displacement.vector;
        let information = link.displacement.covariance.try_inverse().unwrap_or_else(Matrix2::zeros);
        AtlasLink {
            id: link.id,
            from: link.from.index(),
            to: link.to.index(),
            origin: link.origin,
            state: link.state,
            length: link.distance(),
            sigma: link.displacement.covariance.symmetric_eigenvalues().max().max(0.0).sqrt(),
            residual: off.norm(),
            residual_sigma: (off.transpose() * information * off)[0].sqrt(),
            traversals: link.traversals,
        }
    }

    /// The figures of the levels up to the coordinates; those of the gridmap and of time are the caller's to fill in.
    ///
    /// # Errors
    ///
    /// Links that cannot be relaxed.
    pub fn metrics(&self) -> Result<Metrics, MapperError> {
        let (map, tally) = (self.topology(), self.tally());
        let links = |wanted: fn(&Link) -> bool| map.links().iter().filter(|link| wanted(link)).count();
        let accepted = |link: &Link| link.origin == LinkOrigin::Recognized && link.state != LinkState::Rejected;
        let recognized = links(accepted);
        Ok(Metrics {
            schema: METRICS_SCHEMA.into(),
            log: LogMetrics {
                entries: tally.entries,
                scans: tally.scans,
                readings: tally.readings,
                path_length_m: tally.path_length,
                duration_s: tally.duration(),
                heading_source: self.heading_source().into(),
                skipped: 0,
            },
            places: map.n_visited(),
            predicted_places: map.n_predicted(),
            links: LinkMetrics {
                traveled: links(|link| link.origin == LinkOrigin::Traveled),
                recognized,
                rejected: self.closures().len() - recognized.min(self.closures().len()),
                carried: links(Link::is_carried),
                pieces: map.components().len(),
            },
            relaxation: self.relaxation_metrics()?,
            ..Metrics::default()
        })
    }

    /// Energies before, after and at the optimum; the optimum is a direct solution of its own, so that it checks the
    /// relaxation.
    fn relaxation_metrics(&self) -> Result<RelaxationMetrics, MapperError> {
        let problem = self.coordinates().problem(self.topology())?;
        let (before, after) = (self.dead_reckoning(), self.coordinates().padded(self.topology()));
        if before.len() != after.len() {
            return Ok(RelaxationMetrics::default()); // nothing has been placed yet
        }
        let (energy_before, energy_after) = (problem.energy(&before), problem.energy(&after));
        let energy_optimum = problem.optimum()?;
        let shift =
            |(from, to): (&Isometry2<f64>, &Isometry2<f64>)| (to.translation.vector - from.translation.vector).norm();
        let max_shift_m = before.iter().zip(&after).map(shift).fold(0.0, f64::max);
        let excess = energy_after - energy_optimum;
        let solver = match self.config().relaxation.policy {
            RelaxationPolicy::Converge if matches!(problem, Problem::Poses(_)) => "gauss-newton",
            RelaxationPolicy::Converge => "elimination",
            RelaxationPolicy::OneSweep => "gauss-seidel, one sweep per place",
        };
        Ok(RelaxationMetrics {
            energy_before,
            energy_after,
            energy_optimum,
            relative_gap: if energy_before > 1e-12 { excess / energy_before } else { 0.0 },
            sweeps: self.coordinates().sweeps(),
            solver: solver.into(),
            max_shift_m,
        })
    }

    /// What can be proven of the coordinates, see [`Problem::certificate`].
    ///
    /// # Errors
    ///
    /// Links that cannot be relaxed.
    pub fn certificate(&self, strained: usize) -> Result<relaxation::Certificate, MapperError> {
        let (map, coordinates) = (self.topology(), self.coordinates());
        Ok(coordinates.problem(map)?.certificate(&coordinates.padded(map), strained)?)
    }

    /// The places and measured links as a g2o graph: positions alone where a compass holds the headings, else poses.
    #[must_use]
    pub fn graph(&self) -> Graph {
        let (map, coordinates) = (self.topology(), self.coordinates());
        let mut graph = Graph::default();
        let turns = map.links().iter().any(|link| link.displacement.turn.is_some());
        for place in map.places() {
            let id = u64::from(place.id.0);
            let pose = coordinates.map_from_place(place.id);
            let at = pose.translation.vector;
            if turns {
                graph.poses.push(PoseVertex { id, pose: Pose::new(at.x, at.y, pose.rotation.angle()) });
            } else {
                graph.points.push(PointVertex { id, position: at.into() });
            }
        }
        for link in map.links().iter().filter(|link| link.is_measured()) {
            let (from, to) = (u64::from(link.from.0), u64::from(link.to.0));
            if turns {
                let spring = pose_spring(link);
                let i = spring.information;
                let information = [i.m11, i.m12, i.m13, i.m22, i.m23, i.m33];
                graph.pose_edges.push(PoseEdge { from, to, from_to: spring.from_to, information });
            } else if let Some(i) = link.displacement.covariance.try_inverse() {
                let information = [i.m11, i.m12, i.m22];
                graph.point_edges.push(PointEdge { from, to, displacement: link.displacement.vector, information });
            }
        }
        graph.fixed.extend(map.places().first().map(|place| u64::from(place.id.0)));
        graph
    }
}

/// The one-σ ellipse of a covariance: half axes, the long one first, and its direction in radians.
fn ellipse(covariance: &Matrix2<f64>) -> ([f64; 2], f64) {
    let eigen = covariance.symmetric_eigen();
    let long = usize::from(eigen.eigenvalues[1] > eigen.eigenvalues[0]);
    let half = |axis: usize| eigen.eigenvalues[axis].max(0.0).sqrt();
    let axis = eigen.eigenvectors.column(long);
    ([half(long), half(1 - long)], f64::atan2(axis[1], axis[0]))
}
