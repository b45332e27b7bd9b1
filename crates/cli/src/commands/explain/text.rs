use std::fmt::Write as _;
use std::path::Path;

use hierarchy::explain::{Explanation, LinkStory, LoopStory, PlaceStory, WhatIf};
use hierarchy::topo_map::{LinkOrigin, LinkState, PlaceId};

/// Rows of a table that leave room for its head and foot on a screen of 24 lines.
pub(super) const ROWS: usize = 18;
/// A bridge that parts fewer places is the end of a path, and no weak spot.
const PARTS: usize = 3;

/// The whole story on one screen; writing to a string cannot fail.
pub(super) fn overview(run: &Path, told: &Explanation) -> String {
    let (accepted, refused) = (told.accepted(), told.refused());
    let mut text = format!(
        "{} places, {} links, energy {:.2}; {} loops believed, {} refused\n",
        told.places.len(),
        told.links.len(),
        told.energy,
        accepted.len(),
        refused.len()
    );
    let run = run.display();
    if !accepted.is_empty() {
        let (before, after) = (told.loop_residual_rms_before_m(), told.loop_residual_rms_m());
        let _ = writeln!(text, "\nloops miss by {before:.2} m by dead reckoning, {after:.2} m relaxed (rms)");
        let _ = writeln!(text, "\nmost strained loops                            topogrid explain {run} --loops");
        accepted.iter().take(3).for_each(|story| loop_row(&mut text, story));
    }
    if !refused.is_empty() {
        let _ = writeln!(text, "\nrefused, farthest from the map first");
        refused.iter().take(3).for_each(|story| loop_row(&mut text, story));
    }
    let _ = writeln!(text, "\nleast sure places                              topogrid explain {run} --worst 10");
    told.places.iter().take(3).for_each(|story| place_row(&mut text, story));
    let _ = match told.weakest_bridge(PARTS) {
        _ if accepted.is_empty() => writeln!(text, "\nno loop was closed: nothing checks this map"),
        Some(bridge) => writeln!(
            text,
            "\nP{}–P{} alone holds {} places to the rest: one wrong measurement there bends the map",
            bridge.from.0, bridge.to.0, bridge.beyond
        ),
        None => writeln!(text, "\nno single link holds the map together"),
    };
    text
}

/// Every loop, those refused first.
pub(super) fn loops(told: &Explanation, rows: usize) -> String {
    let (accepted, refused) = (told.accepted(), told.refused());
    let mut text = format!(
        "{} loops believed, {} refused; σ: from what the rest of the map says\n",
        accepted.len(),
        refused.len()
    );
    let _ = writeln!(text, "  loop            off [m]       σ   alike  why");
    let shown_refused = refused.len().min(rows - rows.min(accepted.len()).min(rows / 2));
    let shown = accepted.len().min(rows - shown_refused);
    for story in refused.iter().take(shown_refused).chain(accepted.iter().take(shown)) {
        loop_row(&mut text, story);
    }
    more(&mut text, refused.len() + accepted.len() - shown_refused - shown, "loops");
    text
}

/// The places that are least sure.
pub(super) fn worst(told: &Explanation) -> String {
    let mut text = String::from("  place        at [m]            σ [m]  moved [m]  links\n");
    told.places.iter().for_each(|story| place_row(&mut text, story));
    text
}

/// The links that were asked for.
pub(super) fn links(told: &Explanation, rows: usize) -> String {
    let mut text = String::new();
    for story in told.links.iter().take(rows) {
        link_row(&mut text, story);
        if story.bridge {
            let _ = writeln!(
                text,
                "    it alone holds {} places to the rest: nothing checks it, and if it is wrong the map is bent there",
                story.beyond
            );
        }
        if let Some(story) = told.loops.iter().find(|other| other.link == Some(story.link)) {
            let _ = writeln!(text, "    {}", story.reason);
        }
    }
    text
}

/// One place with everything that holds it.
pub(super) fn place(told: &Explanation, place: PlaceId, rows: usize) -> String {
    let Some(story) = told.places.first() else { return format!("P{} was never visited\n", place.0) };
    let mut text = worst(told);
    let _ = writeln!(text, "\n{} links, {} of them loops", story.links, story.loops);
    told.links.iter().take(rows / 2).for_each(|link| link_row(&mut text, link));
    more(&mut text, told.links.len().saturating_sub(rows / 2), "links");
    let refused = told.refused();
    if !refused.is_empty() {
        let _ = writeln!(text, "\nrefused");
        refused.iter().take(rows / 3).for_each(|story| loop_row(&mut text, story));
        more(&mut text, refused.len().saturating_sub(rows / 3), "loops");
    }
    text
}

/// What would change without some links.
pub(super) fn what_if(what_if: &WhatIf, told: &Explanation, rows: usize) -> String {
    let mut text = String::new();
    for link in &what_if.removed {
        told.links.iter().filter(|story| story.link == *link).for_each(|story| link_row(&mut text, story));
    }
    let _ = writeln!(text, "without: energy {:.2} → {:.2}", what_if.energy_with, what_if.energy_without);
    if what_if.parted > 0 {
        let _ = writeln!(text, "{} places would be held to the rest by nothing", what_if.parted);
    }
    let Some(farthest) = what_if.moved.first() else {
        let _ = writeln!(text, "no place would move");
        return text;
    };
    let _ = writeln!(text, "{} places would move, by up to {:.2} m", what_if.moved.len(), farthest.distance_m);
    let shown = rows.saturating_sub(what_if.removed.len() + 5).min(what_if.moved.len());
    for moved in &what_if.moved[..shown] {
        let ([x0, y0], [x, y]) = (moved.from_m, moved.to_m);
        let name = format!("P{}", moved.place.0);
        let _ = writeln!(text, "  {name:<6} ({x0:7.2}, {y0:7.2}) → ({x:7.2}, {y:7.2})  {:6.2} m", moved.distance_m);
    }
    more(&mut text, what_if.moved.len() - shown, "places");
    text
}

fn loop_row(text: &mut String, story: &LoopStory) {
    let [x, y] = story.residual_m;
    let sign = if story.accepted { ' ' } else { '×' };
    let name = format!("P{}→P{}", story.place.0, story.known.0);
    let alike = story.score.map_or_else(|| "   –".to_owned(), |score| format!("{score:.2}"));
    let sigmas = story.residual_sigma;
    let _ = writeln!(text, "{sign} {name:<13} {:>7.2}  {sigmas:>6.1}    {alike}  {}", x.hypot(y), story.reason);
}

fn link_row(text: &mut String, story: &LinkStory) {
    let [x, y] = story.residual_m;
    let kind = match (story.state, story.origin) {
        (LinkState::Rejected, _) => "held to be false",
        (_, LinkOrigin::Traveled) => "traveled",
        (_, LinkOrigin::Recognized) => "recognized",
        (_, LinkOrigin::Predicted) => "predicted",
    };
    let name = format!("P{}–P{}", story.from.0, story.to.0);
    let _ = write!(text, "  {name:<13} {kind}, {:.2} m long", story.length_m);
    let _ = match (story.bridge, story.weight > 0.0) {
        (_, false) => writeln!(text, ", counts for nothing"),
        (true, _) => writeln!(text, ", in no loop"),
        (false, _) => writeln!(
            text,
            ", off by ({x:+.2}, {y:+.2}) m: {:.1} σ, share of the energy {:.2}",
            story.residual_sigma, story.energy
        ),
    };
}

fn place_row(text: &mut String, story: &PlaceStory) {
    let [x, y] = story.position_m;
    let name = story.name.as_ref().map_or_else(|| format!("P{}", story.place.0), |n| format!("P{} {n}", story.place.0));
    let held = match (story.links, story.loops) {
        (1, _) => "single link".to_owned(),
        (links, 0) => format!("{links} links"),
        (links, 1) => format!("{links} links, 1 loop"),
        (links, loops) => format!("{links} links, {loops} loops"),
    };
    let _ =
        writeln!(text, "  {name:<10} ({x:7.2}, {y:7.2})  {:>6.2}     {:>6.2}  {held}", story.sigma_m, story.shift_m);
}

fn more(text: &mut String, left: usize, what: &str) {
    if left > 0 {
        let _ = writeln!(text, "  … and {left} more {what}: --all, or --json");
    }
}
