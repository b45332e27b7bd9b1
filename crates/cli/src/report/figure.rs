use std::fmt::Write;

use hierarchy::topo_map::{LinkOrigin, LinkState};
use hierarchy::{Atlas, AtlasPlace};
use local_grid::GridFrame;
use nalgebra::{Point2, Vector2};

/// The longer side of a drawing, in its own units.
const SIDE: f64 = 1000.0;

/// A window on the map that a drawing shows, in metres.
#[derive(Debug, Clone, Copy)]
struct Window {
    low: Point2<f64>,
    size: Vector2<f64>,
    scale: f64,
}

impl Window {
    fn new(low: Point2<f64>, high: Point2<f64>) -> Self {
        let size = (high - low).map(|side| if side.is_finite() { side.max(1e-3) } else { 1.0 });
        Self { low, size, scale: SIDE / size.max() }
    }

    /// The window of all places, before and after relaxation, and a metre around them.
    fn of_places(atlas: &Atlas) -> Self {
        let points = || atlas.places.iter().flat_map(|place| [place.position.coords, place.dead_reckoned.coords]);
        let far = Vector2::repeat(f64::INFINITY);
        let (low, high) = (points().fold(far, |low, p| low.inf(&p)), points().fold(-far, |high, p| high.sup(&p)));
        Self::new((low - Vector2::repeat(1.0)).into(), (high + Vector2::repeat(1.0)).into())
    }

    fn extent(&self) -> (f64, f64) {
        (self.size.x * self.scale, self.size.y * self.scale)
    }

    fn put(&self, point: Point2<f64>) -> (f64, f64) {
        let at = (point - self.low) * self.scale;
        (at.x, self.extent().1 - at.y)
    }

    /// A bar of a round length with its label, and an arrow to the north.
    fn furniture(&self) -> String {
        let length = round_length(0.2 * self.size.max());
        let (y, end) = (self.extent().1 - 16.0, 16.0 + length * self.scale);
        format!(
            r#"<g class="furniture"><path d="M16 {:.1}v6H{end:.1}v-6"/><text x="{:.1}" y="{:.1}">{length} m</text><path d="M26 62V22l-6 12M26 22l6 12"/><text x="20" y="82">N</text></g>"#,
            y - 6.0,
            end + 8.0,
            y + 3.0
        )
    }
}

/// The gridmap with the relaxed topological map on it: what a reader without a script sees.
///
/// `png` is the gridmap's image, one pixel per cell, as text.
pub(super) fn map(atlas: &Atlas, frame: &GridFrame, png: &str) -> String {
    let size = Vector2::new(frame.columns(), frame.rows()).map(as_f64) * frame.resolution();
    let window = Window::new(frame.origin(), frame.origin() + size);
    let (width, height) = window.extent();
    let mut svg = format!(
        r#"<svg class="map" viewBox="0 0 {width:.0} {height:.0}" role="img" aria-label="The gridmap with places and links">
<image id="fuzzy" href="data:image/png;base64,{png}" width="{width:.2}" height="{height:.2}" preserveAspectRatio="none"/>
"#
    );
    svg.push_str(&graph(atlas, &window, |place| place.position));
    svg.push_str(&window.furniture());
    svg + "</svg>"
}

/// Where dead reckoning has the places, and where relaxation has them, side by side at one scale.
pub(super) fn before_and_after(atlas: &Atlas) -> String {
    let window = Window::of_places(atlas);
    let (width, height) = window.extent();
    let panel = |caption: &str, position: fn(&AtlasPlace) -> Point2<f64>| {
        format!(
            r#"<figure><svg class="graph" viewBox="0 0 {width:.0} {height:.0}" role="img" aria-label="{caption}">{}{}</svg><figcaption>{caption}</figcaption></figure>"#,
            graph(atlas, &window, position),
            window.furniture()
        )
    };
    panel("by dead reckoning", |place| place.dead_reckoned) + &panel("after relaxation", |place| place.position)
}

/// Links and places as a few paths: small, whatever their number.
fn graph(atlas: &Atlas, window: &Window, position: impl Fn(&AtlasPlace) -> Point2<f64>) -> String {
    let mut paths: [(&str, String); 6] =
        ["rejected", "predicted", "traveled", "recognized", "unvisited", "place"].map(|class| (class, String::new()));
    let mut draw = |class: &str, text: std::fmt::Arguments<'_>| {
        if let Some((_, path)) = paths.iter_mut().find(|(name, _)| *name == class) {
            let _ = path.write_fmt(text); // writing to a string cannot fail
        }
    };
    for link in &atlas.links {
        let (x, y) = window.put(position(&atlas.places[link.from]));
        let (to_x, to_y) = window.put(position(&atlas.places[link.to]));
        let class = match (link.state, link.origin) {
            (LinkState::Rejected, _) => "rejected",
            (_, LinkOrigin::Predicted) => "predicted",
            (_, LinkOrigin::Recognized) => "recognized",
            (_, LinkOrigin::Traveled) => "traveled",
        };
        draw(class, format_args!("M{x:.1} {y:.1}L{to_x:.1} {to_y:.1}"));
    }
    for place in &atlas.places {
        let (x, y) = window.put(position(place));
        draw(if place.visited { "place" } else { "unvisited" }, format_args!("M{x:.1} {y:.1}h0"));
    }
    let drawn = paths.into_iter().filter(|(_, path)| !path.is_empty());
    drawn.map(|(class, path)| format!("<path class=\"{class}\" d=\"{path}\"/>\n")).collect()
}

/// The largest of 1, 2 and 5 times a power of ten that is no longer than `longest`.
fn round_length(longest: f64) -> f64 {
    let decade = 10f64.powf(longest.log10().floor());
    [5.0, 2.0].into_iter().map(|step| step * decade).find(|length| *length <= longest).unwrap_or(decade)
}

#[expect(clippy::cast_precision_loss, reason = "cells of a map are few")]
fn as_f64(count: usize) -> f64 {
    count as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn north_is_up_and_lengths_are_round() {
        let window = Window::new(Point2::new(-5.0, 0.0), Point2::new(5.0, 20.0));
        assert_eq!(window.put(Point2::new(-5.0, 20.0)), (0.0, 0.0));
        assert_eq!([0.3, 4.9, 12.0].map(round_length), [0.2, 2.0, 10.0]);
    }

    #[test]
    fn a_map_without_places_is_still_a_drawing() {
        assert!(before_and_after(&Atlas::default()).contains("viewBox=\"0 0 1000 1000\""));
    }
}
