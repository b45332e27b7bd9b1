//! Whether links know how far off they are: their errors against the truth beside the deviations that they claim.

use hierarchy::Mapper;
use hierarchy::evaluate::TimedPath;
use nalgebra::{Isometry2, Rotation2};

/// The errors of links along one axis, each with the variance that is claimed for it.
#[derive(Debug, Default)]
pub(crate) struct Axis(Vec<(f64, f64)>);

/// The links over which the robot drove: along their way, across it, and their turn.
#[derive(Debug, Default)]
pub(crate) struct LinkErrors {
    along: Axis,
    across: Axis,
    turn: Axis,
}

impl LinkErrors {
    /// The errors of the links from place to place, where the truth is known at both ends.
    pub(crate) fn of(mapper: &Mapper, truth: &TimedPath) -> Self {
        let anchors = mapper.trajectory().anchors();
        let at = |place| {
            let anchor = anchors.iter().find(|anchor| anchor.place == place)?;
            Some(truth.between(anchor.stamp, 2.0)? * anchor.place_from_robot.inverse())
        };
        let mut errors = Self::default();
        for link in mapper.topology().links().iter().filter(|link| link.to.0 == link.from.0 + 1 && !link.is_carried()) {
            let (Some(from), Some(to)) = (at(link.from), at(link.to)) else { continue };
            errors.compare(&from.inv_mul(&to), &link.displacement);
        }
        errors
    }

    fn compare(&mut self, seen: &Isometry2<f64>, measured: &hierarchy::topo_map::Displacement) {
        let way = Rotation2::new(-measured.vector.y.atan2(measured.vector.x));
        let off = way * (measured.vector - seen.translation.vector);
        let covariance = way * measured.covariance * way.transpose();
        self.along.0.push((off.x, covariance[(0, 0)]));
        self.across.0.push((off.y, covariance[(1, 1)]));
        if let Some(turn) = measured.turn {
            let off = nalgebra::UnitComplex::new(turn.change - seen.rotation.angle()).angle();
            self.turn.0.push((off, turn.variance));
        }
    }
}

impl std::fmt::Display for LinkErrors {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let degrees = 180.0 / std::f64::consts::PI;
        for (name, axis, unit, scale) in
            [("along", &self.along, "m", 1.0), ("across", &self.across, "m", 1.0), ("turn", &self.turn, "°", degrees)]
        {
            if !axis.0.is_empty() {
                writeln!(f, "  {name:<7} {}", axis.told(unit, scale))?;
            }
        }
        Ok(())
    }
}

/// The median of χ² with one degree of freedom.
const MEDIAN_CHI2: f64 = 0.455;
/// 99 % of it.
const CHI2_99: f64 = 6.63;

impl Axis {
    /// The axis in words.
    fn told(&self, unit: &str, scale: f64) -> String {
        let count = self.0.len() as f64;
        let root_mean = |of: fn(&(f64, f64)) -> f64| scale * (self.0.iter().map(of).sum::<f64>() / count).sqrt();
        let mut squares: Vec<f64> = self.0.iter().map(|(off, variance)| off * off / variance).collect();
        squares.sort_by(f64::total_cmp);
        let beyond = squares.iter().filter(|square| **square > CHI2_99).count() as f64 / count;
        format!(
            "{} links err by {:.3} {unit}, claim {:.3} {unit} (rms); NEES mean {:.2}, median {:.2} of what it should be, {:.1} % beyond 99 %",
            self.0.len(),
            root_mean(|(off, _)| off * off),
            root_mean(|(_, variance)| *variance),
            squares.iter().sum::<f64>() / count,
            squares[squares.len() / 2] / MEDIAN_CHI2,
            100.0 * beyond
        )
    }
}
