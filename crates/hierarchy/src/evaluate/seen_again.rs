use std::collections::BTreeMap;

use nalgebra::{Isometry2, Point2};
use serde::Serialize;

use super::statistics::Statistics;
use crate::mapper::Mapper;
use crate::trajectory::Sample;

/// How far walls that are met again lie from where they were met before, without any truth.
///
/// Of every echo: the distance to the nearest earlier one that is older than some way driven, at most 1 m.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct SeenAgain {
    /// Echoes that fall near an old one, by the map or by raw odometry.
    pub echoes: usize,
    /// The median distance where the raw odometry believes them to be, in metres.
    pub odometry_m: f64,
    /// The median distance in the map, in metres.
    pub mapped_m: f64,
}

/// Echoes closer together than this many spacings of travel are of one visit.
const RECENT_SPACINGS: f64 = 8.0;
/// No farther old echo is looked for, in metres.
const FARTHEST: f64 = 1.0;
/// An echo that either path brings so near to an old one, in metres, may be of the same wall.
const NEAR: f64 = 0.5;
/// Echoes from beyond are not looked at, in metres: a sonar's may come from anywhere across its beam.
const LONGEST: f64 = 1.5;
/// About so many echoes are looked at.
const ECHOES: usize = 20_000;

/// How well the walls of later visits fall onto those of earlier ones; `None` where nothing is met again.
///
/// Both paths are judged by the same echoes, those that either brings near an old one: a wrong path meets others by chance,
/// which flatters it.
#[must_use]
pub fn seen_again(mapper: &Mapper) -> Option<SeenAgain> {
    let samples = mapper.trajectory().samples();
    let recent = RECENT_SPACINGS * mapper.config().places.spacing_m;
    let odometry: Vec<_> = samples.iter().map(|sample| sample.odom_from_robot).collect();
    let [odometry, mapped] = [odometry, mapper.poses()].map(|poses| gaps(&echoes(samples, &poses), recent));
    let again: Vec<(f64, f64)> = odometry.into_iter().zip(mapped).filter(|(a, b)| a.min(*b) < NEAR).collect();
    let median = |of: fn(&(f64, f64)) -> f64| Some(Statistics::of(&again.iter().map(of).collect::<Vec<_>>())?.median);
    Some(SeenAgain { echoes: again.len(), odometry_m: median(|gaps| gaps.0)?, mapped_m: median(|gaps| gaps.1)? })
}

/// An echo, where a path puts it, and how far the robot had driven.
type Echo = (Point2<f64>, f64);

/// Some echoes of near things, evenly taken, in the order in which they were heard.
fn echoes(samples: &[Sample], poses: &[Isometry2<f64>]) -> Vec<Echo> {
    let near = |sample: &Sample| -> Vec<Point2<f64>> {
        let points = sample.scan.echo_points().map(Point2::from);
        points.filter(|point| point.coords.norm() <= LONGEST).collect()
    };
    let all: Vec<Echo> = samples
        .iter()
        .zip(poses)
        .flat_map(|(sample, pose)| near(sample).into_iter().map(move |point| (pose * point, sample.travelled)))
        .collect();
    all.iter().step_by(all.len().div_ceil(ECHOES).max(1)).copied().collect()
}

/// Of every echo the distance to the nearest one that is older by `recent` metres of travel.
fn gaps(echoes: &[Echo], recent: f64) -> Vec<f64> {
    let mut old: BTreeMap<(i64, i64), Vec<Point2<f64>>> = BTreeMap::new();
    let mut waiting = echoes.iter().peekable();
    let mut gaps = Vec::with_capacity(echoes.len());
    for (point, travelled) in echoes {
        while let Some((point, _)) = waiting.next_if(|waiting| waiting.1 <= travelled - recent) {
            old.entry(square(point)).or_default().push(*point);
        }
        let (x, y) = square(point);
        let around = (x - 1..=x + 1).flat_map(|x| (y - 1..=y + 1).map(move |y| (x, y)));
        let nearest = around.filter_map(|square| old.get(&square)).flatten().map(|other| (other - point).norm());
        gaps.push(nearest.fold(FARTHEST, f64::min));
    }
    gaps
}

/// The square of [`FARTHEST`] in which a point lies.
#[expect(clippy::cast_possible_truncation, reason = "saturates; no robot drives 10¹⁸ metres")]
fn square(point: &Point2<f64>) -> (i64, i64) {
    ((point.x / FARTHEST).floor() as i64, (point.y / FARTHEST).floor() as i64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_echoes_of_an_earlier_visit_count() {
        let echo = |x: f64, y: f64, travelled: f64| (Point2::new(x, y), travelled);
        let echoes = [echo(0.0, 0.0, 0.0), echo(0.1, 0.0, 1.0), echo(0.4, 0.3, 20.0), echo(1.3, 0.0, 21.0)];
        let gaps = gaps(&echoes, 8.0);
        assert_eq!(gaps[..2], [FARTHEST; 2]);
        approx::assert_relative_eq!(gaps[2], 0.3f64.hypot(0.3), epsilon = 1e-12);
        assert_eq!(gaps[3], FARTHEST, "nothing within a metre but what was heard a metre ago");
    }

    #[test]
    fn the_nearest_is_found_across_squares() {
        let echoes = [(Point2::new(0.99, -0.01), 0.0), (Point2::new(1.01, 0.01), 30.0)];
        approx::assert_relative_eq!(gaps(&echoes, 8.0)[1], 0.02f64.hypot(0.02), epsilon = 1e-9);
    }
}
