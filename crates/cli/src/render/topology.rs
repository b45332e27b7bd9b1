use hierarchy::topo_map::{LinkOrigin, LinkState};
use hierarchy::{Atlas, AtlasPlace};
use nalgebra::Point2;

use super::svg::{Drawing, panels};

/// Colours that a colour-blind reader can tell apart; meaning is carried by dashes and widths as well.
const STYLE: &str = ".place{fill:#1b6ca8}.predicted{fill:none;stroke:#888;stroke-width:.08}\
.traveled{stroke:#555;stroke-width:.09}.recognized{stroke:#d1495b;stroke-width:.09;stroke-dasharray:.3 .15}\
.rejected{stroke:#bbb;stroke-width:.05;stroke-dasharray:.1 .2}.blocked{stroke:#222;stroke-width:.09;stroke-dasharray:.05 .15}\
.sigma{fill:#1b6ca8;fill-opacity:.12;stroke:none}.first{fill:#2a9d4b}";

/// The topological map before and after relaxation, side by side at one scale.
pub(crate) fn before_and_after(atlas: &Atlas) -> String {
    let before = graph(atlas, |place| place.dead_reckoned, |_| None);
    let after = graph(atlas, |place| place.position, |place| place.ellipse);
    panels(&[("dead reckoning".into(), before), ("relaxed".into(), after)], STYLE)
}

fn graph(
    atlas: &Atlas,
    position: impl Fn(&AtlasPlace) -> Point2<f64>,
    ellipse: impl Fn(&AtlasPlace) -> Option<([f64; 2], f64)>,
) -> Drawing {
    let mut drawing = Drawing::new();
    for place in &atlas.places {
        if let Some((half, angle)) = ellipse(place) {
            drawing.ellipse("sigma", position(place), half, angle);
        }
    }
    for link in &atlas.links {
        let class = match (link.state, link.origin) {
            (LinkState::Rejected, _) => "rejected",
            (LinkState::Blocked, _) => "blocked",
            (LinkState::Open, LinkOrigin::Traveled) => "traveled",
            (LinkState::Open, LinkOrigin::Recognized) => "recognized",
            (LinkState::Open, LinkOrigin::Predicted) => "predicted",
        };
        let (from, to) = (&atlas.places[link.from], &atlas.places[link.to]);
        let title = format!(
            "P{}–P{}: {class}, {:.2} m, residual {:.2} m ({:.1} σ)",
            from.id.0, to.id.0, link.length, link.residual, link.residual_sigma
        );
        drawing.line(class, position(from), position(to), &title);
    }
    for (index, place) in atlas.places.iter().enumerate() {
        let class = match (index, place.visited) {
            (0, _) => "first",
            (_, true) => "place",
            (_, false) => "predicted",
        };
        let mut title = format!("P{} at ({:.2}, {:.2}) m", place.id.0, place.position.x, place.position.y);
        if let Some((half, _)) = place.ellipse {
            title += &format!(", σ {:.2} m", half[0]);
        }
        if let Some(name) = &place.name {
            title = format!("{name}: {title}");
        }
        drawing.disc(class, position(place), 0.2, &title);
    }
    drawing
}
