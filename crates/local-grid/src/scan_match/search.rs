use nalgebra::{Isometry2, Point2, Vector2};

use super::{Echo, Match, MatchOptions, Prior, refine, thinned};
use crate::align::{AlignOptions, Volume, WallTable, peaks};
use crate::{GridFrame, LocalMap};

/// The poses that a search tries.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct SearchWindow {
    /// Positions up to so many metres from the guess, along both axes.
    pub reach: f64,
    /// Turns up to so many radians from the guess; π for any heading.
    pub turn: f64,
    /// Distance of neighbouring positions in metres; turns step as far at the distant echoes.
    pub step: f64,
    /// Echoes from further away are left out, in metres: they would ask for finer turns than a search can try.
    pub max_range: f64,
    /// At most so many echoes are used.
    pub echoes: usize,
    /// The least share of echoes that must meet known space.
    pub min_overlap: f64,
    /// How many candidates are refined.
    pub candidates: usize,
}

impl Default for SearchWindow {
    fn default() -> Self {
        Self {
            reach: 4.0,
            turn: 30f64.to_radians(),
            step: 0.2,
            max_range: 12.0,
            echoes: 180,
            min_overlap: 0.4,
            candidates: 4,
        }
    }
}

/// Fits a scan to a map from afar: tries every pose of a window, then slides the best few into place.
///
/// Returns the matches that remain, best score first, each at a different place; none where nothing is known. The second's
/// score against the first's tells how distinct the match is. For closing loops: match the echoes of a scan, or
/// those gathered around a place, against the map of an old place.
///
/// After Olson (2009) and Konolige's correlative matching; distances stand in for the blurred map.
#[must_use]
pub fn search(
    map: &LocalMap,
    echoes: &[Echo],
    around: &Isometry2<f64>,
    window: &SearchWindow,
    options: &MatchOptions,
) -> Vec<Match> {
    let _span = tracing::debug_span!("search", echoes = echoes.len()).entered();
    let near: Vec<Echo> = echoes.iter().filter(|echo| echo.point.coords.norm() <= window.max_range).copied().collect();
    let points: Vec<Point2<f64>> =
        thinned(&near, window.echoes).iter().map(|echo| around.rotation * echo.point).collect();
    let Some(table) = nearness(map, &points, around, window, options) else { return Vec::new() };
    let wide = AlignOptions {
        reach: window.reach,
        turn_window: window.turn,
        min_overlap: window.min_overlap,
        peak_separation: (2.5 * window.step).max(0.5 * map.options().max_distance),
        ..AlignOptions::default()
    };
    let volume = Volume::over(&table, &points, &wide);
    let pose = |peak: &peaks::Peak| {
        let turn = around.rotation.angle() + peak.turn;
        Isometry2::new(around.translation.vector + peak.offset, turn)
    };
    let found = peaks::of(&volume, &wide);
    let starts = found.iter().take(window.candidates).map(pose);
    let mut matches: Vec<Match> = starts.map(|start| refine(map, echoes, &Prior::start(start), options)).collect();
    matches.sort_by(|a, b| b.score.total_cmp(&a.score));
    distinct(matches, window.step)
}

/// Drops matches that slid into the same place as a better one.
fn distinct(matches: Vec<Match>, step: f64) -> Vec<Match> {
    let mut kept: Vec<Match> = Vec::new();
    for candidate in matches {
        let apart = |other: &Match| {
            let error = other.map_from_robot.inv_mul(&candidate.map_from_robot);
            error.translation.vector.norm() > step || error.rotation.angle().abs() > 0.05
        };
        if kept.iter().all(apart) {
            kept.push(candidate);
        }
    }
    kept
}

/// How near walls are, around the guess and as far as echoes can fall; its frame has the guess at the origin.
fn nearness(
    map: &LocalMap,
    points: &[Point2<f64>],
    around: &Isometry2<f64>,
    window: &SearchWindow,
    options: &MatchOptions,
) -> Option<WallTable> {
    let far = points.iter().map(|point| point.coords.norm()).reduce(f64::max)?;
    let half = far + window.reach + window.step;
    let corner = Point2::new(-half, -half);
    let frame = GridFrame::covering(corner, Point2::new(half, half), window.step).ok()?;
    let centre: Vector2<f64> = around.translation.vector;
    if !(centre.x.is_finite() && centre.y.is_finite()) {
        return None;
    }
    let sigma = options.kernel.max(0.75 * window.step);
    let cell = |index: usize| {
        let point = frame.center(index / frame.columns(), index % frame.columns()) + centre;
        let (distance, known) = map.nearest(point, window.step);
        let near = if distance < map.options().max_distance { (-0.5 * (distance / sigma).powi(2)).exp() } else { 0.0 };
        (narrow(near), known)
    };
    Some(WallTable::of(frame, (0..frame.n_cells()).map(cell)))
}

#[expect(clippy::cast_possible_truncation, reason = "a degree in [0, 1]")]
fn narrow(near: f64) -> f32 {
    near as f32
}
