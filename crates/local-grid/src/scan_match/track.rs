use super::{Echo, Match, MatchOptions, Prior, SearchWindow, refine, search};
use crate::LocalMap;

/// When a scan that should follow from odometry is searched for instead.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct TrackOptions {
    /// How a scan slides into place.
    pub matching: MatchOptions,
    /// When a smaller share of echoes than this lies near walls, odometry is weighed in fully, and the scan is searched for.
    pub doubted_inliers: f64,
    /// Where a doubted scan is searched for, around what odometry says.
    pub window: SearchWindow,
    /// By how much a searched match must score better to be taken, and for each standard deviation that it lies further from
    /// the odometry once more.
    pub margin: f64,
}

impl Default for TrackOptions {
    fn default() -> Self {
        Self {
            matching: MatchOptions::default(),
            doubted_inliers: 0.75,
            window: SearchWindow { reach: 0.6, turn: 20f64.to_radians(), step: 0.1, ..SearchWindow::default() },
            margin: 0.015,
        }
    }
}

/// Where the robot is after a step that odometry measured: the scan slides into the map from there. If few of its echoes
/// find walls it is held by the odometry, and it is searched for in a window around.
#[must_use]
pub fn track(map: &LocalMap, echoes: &[Echo], prior: &Prior, options: &TrackOptions) -> Match {
    let slid = refine(map, echoes, prior, &options.matching);
    if slid.inliers >= options.doubted_inliers {
        return slid;
    }
    // Much of what the scan saw is new, or it slid astray: few walls hold it, so odometry has its say.
    let believing = MatchOptions { prior_share: 1.0, ..options.matching.clone() };
    let held = refine(map, echoes, prior, &believing);
    let best = if fits(&held) + options.margin >= fits(&slid) { held } else { slid };
    // The further a pose lies from what odometry says, the better it must fit.
    let worth = |found: &Match| fits(found) - options.margin * prior.deviation(&found.map_from_robot);
    let searched = search(map, echoes, &prior.map_from_robot, &options.window, &options.matching);
    let better = searched.into_iter().max_by(|a, b| worth(a).total_cmp(&worth(b)));
    match better {
        Some(better) if worth(&better) > worth(&best) + options.margin => better,
        _ => best,
    }
}

/// How near to walls the echoes lie that meet what the map knows. Those in the unknown speak neither for nor against a pose:
/// counted as misses they would favour poses that hide them, where a robot enters a room or looks back along a corridor.
fn fits(found: &Match) -> f64 {
    found.score / found.overlap.max(LEAST_OVERLAP)
}

/// Fewer echoes than this share are no measure of a fit.
const LEAST_OVERLAP: f64 = 0.4;
