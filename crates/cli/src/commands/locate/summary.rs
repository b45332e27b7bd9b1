use std::fmt::Write as _;

use hierarchy::Whereabouts;
use hierarchy::topo_map::Recognition;
use serde_json::{Value, json};

/// In so many equal parts of the way the robot is told once each.
const PARTS: f64 = 10.0;

/// How much of a drive was known.
struct Known {
    places: usize,
    /// Metres that ended at a place which was known, and all metres.
    metres: f64,
    driven: f64,
    /// Metres before the first known place.
    first: Option<f64>,
    /// The longest stretch on which the robot had been known and was not, in metres, and where it began.
    lost: Option<(f64, f64)>,
    /// Median of the probability with which known places were known.
    probability: Option<f64>,
}

impl Known {
    fn of(seen: &[Whereabouts]) -> Self {
        let mut known = Self { places: 0, metres: 0.0, driven: 0.0, first: None, lost: None, probability: None };
        let (mut last_known, mut probabilities) = (None, Vec::new());
        for view in seen {
            let step = view.driven - known.driven;
            known.driven = view.driven;
            if let (Recognition::Known(best), Some(_)) = (view.recognition, view.map_from_robot) {
                known.places += 1;
                known.metres += step;
                known.first.get_or_insert(view.driven);
                probabilities.push(best.probability);
                last_known = Some(view.driven);
            } else if let Some(since) = last_known {
                let length = view.driven - since;
                if known.lost.is_none_or(|(longest, _)| length > longest) {
                    known.lost = Some((length, since));
                }
            }
        }
        probabilities.sort_by(f64::total_cmp);
        known.probability = probabilities.get(probabilities.len() / 2).copied();
        known
    }
}

/// The sum of a drive for programs.
pub(super) fn document(seen: &[Whereabouts]) -> Value {
    let known = Known::of(seen);
    json!({
        "places": seen.len(), "known_places": known.places, "driven_m": known.driven, "known_m": known.metres,
        "first_known_m": known.first, "longest_lost_m": known.lost.map(|(length, _)| length),
        "probability_median": known.probability,
    })
}

/// The sum of a drive, and where the robot was on the way if `shows_way`. Writing to a string cannot fail.
pub(super) fn text(seen: &[Whereabouts], shows_way: bool) -> String {
    let known = Known::of(seen);
    let mut text = String::new();
    let (places, all) = (known.places, seen.len());
    let _ = writeln!(text, "known at {places} of {all} places, {:.1} of {:.1} m driven", known.metres, known.driven);
    if let (Some(first), Some(probability)) = (known.first, known.probability) {
        let _ = writeln!(text, " first after {first:.1} m, then with a probability of {probability:.2} in the median");
    }
    if let Some((length, since)) = known.lost {
        let _ = writeln!(text, " unsure for at most {length:.1} m in one go, from {since:.1} m on");
    }
    if shows_way {
        let _ = write!(text, "\n{}", lines(ends_of_parts(seen)));
    }
    if let Some(last) = seen.last() {
        let _ = writeln!(text, "\nat the end: {}", told(last));
    }
    text
}

/// A line for each view.
pub(super) fn lines<'a>(seen: impl Iterator<Item = &'a Whereabouts>) -> String {
    let mut text = String::new();
    for view in seen {
        let _ = writeln!(text, "{:>9.1} s {:>8.1} m  {}", view.stamp, view.driven, told(view));
    }
    text
}

/// The last view of each part of the way.
fn ends_of_parts(seen: &[Whereabouts]) -> impl Iterator<Item = &Whereabouts> {
    let driven = seen.last().map_or(0.0, |last| last.driven);
    let part = move |view: &Whereabouts| (PARTS * view.driven / driven).ceil();
    let is_last = move |index: usize| seen.get(index + 1).is_none_or(|next| part(next) > part(&seen[index]));
    (0..seen.len()).filter(move |&index| is_last(index)).map(|index| &seen[index])
}

fn told(view: &Whereabouts) -> String {
    match (view.recognition, view.map_from_robot) {
        (Recognition::Known(best), Some(pose)) => format!(
            "{} at {:.2}, {:.2} m, facing {:.0}° (probability {:.2})",
            best.place,
            pose.translation.x,
            pose.translation.y,
            pose.rotation.angle().to_degrees(),
            best.probability
        ),
        (Recognition::New { probability }, _) => format!("outside of the map (probability {probability:.2})"),
        (Recognition::Unsure { reason, .. }, _) => format!("unsure: {reason}"),
        (Recognition::Known(best), None) => format!("unsure: left {}, but may have been carried since", best.place),
    }
}
