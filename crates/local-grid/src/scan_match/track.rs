use super::{Echo, Match, MatchOptions, Prior, SearchWindow, refine, search};
use crate::LocalMap;

/// When a scan that should follow from odometry is searched for instead.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct TrackOptions {
    /// How a scan slides into place.
    pub matching: MatchOptions,
    /// A match is doubted when a smaller share of echoes than this lies near walls...
    pub doubted_inliers: f64,
    /// ...and a greater share than this lies in free space.
    pub doubted_contradiction: f64,
    /// Where a doubted scan is searched for, around what odometry says.
    pub window: SearchWindow,
    /// By how much a searched match must score better to be taken.
    pub margin: f64,
}

impl Default for TrackOptions {
    fn default() -> Self {
        Self {
            matching: MatchOptions::default(),
            doubted_inliers: 0.75,
            doubted_contradiction: 0.08,
            window: SearchWindow { reach: 0.6, turn: 20f64.to_radians(), step: 0.1, ..SearchWindow::default() },
            margin: 0.03,
        }
    }
}

/// Where the robot is after a step that odometry measured: the scan slides into the map from there, and if it fits badly
/// it is searched for in a window around.
#[must_use]
pub fn track(map: &LocalMap, echoes: &[Echo], prior: &Prior, options: &TrackOptions) -> Match {
    let slid = refine(map, echoes, prior, &options.matching);
    if slid.inliers >= options.doubted_inliers || slid.contradiction <= options.doubted_contradiction {
        return slid;
    }
    let searched = search(map, echoes, &prior.map_from_robot, &options.window, &options.matching);
    match searched.into_iter().next() {
        Some(better) if better.score > slid.score + options.margin => better,
        _ => slid,
    }
}
