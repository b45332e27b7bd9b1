use nalgebra::Point2;

use super::report::Report;
use crate::render::svg::{Drawing, panels};

/// Colours that a colour-blind reader can tell apart.
const STYLE: &str = "line{vector-effect:non-scaling-stroke}.way{stroke:#1b6ca8;stroke-width:1}\
.closure{stroke:#d1495b;stroke-width:.7;stroke-opacity:.6}";

/// Beyond so many edges only some closures are drawn: more would only make the picture slow.
const MOST_LINES: usize = 50_000;

/// The graph before and after, side by side at one scale.
pub(super) fn before_and_after(report: &Report) -> String {
    let before = draw(report, &report.before, false);
    let after = draw(report, &report.after, true);
    panels(&[("before".into(), before), ("relaxed".into(), after)], STYLE)
}

fn draw(report: &Report, positions: &[Point2<f64>], with_weights: bool) -> Drawing {
    let mut drawing = Drawing::new();
    let every = report.edges.len().div_ceil(MOST_LINES).max(1);
    for (edge, &(from, to)) in report.edges.iter().enumerate() {
        let successive = from.abs_diff(to) == 1;
        let rejected = with_weights && report.weights.get(edge).is_some_and(|weight| *weight < 0.5);
        // A false edge crosses the whole map: shown where it was believed, left out where it was let go.
        if successive || (edge % every == 0 && !rejected) {
            drawing.line(if successive { "way" } else { "closure" }, positions[from], positions[to], "");
        }
    }
    drawing
}
