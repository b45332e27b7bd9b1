//! The figures of the paper, drawn again: the environment, the topological map before and after, the gridmap.

use nalgebra::Point2;
use simulator::{Material, World};

use super::trial::Outcome;
use crate::render::svg::{Drawing, panels};

const STYLE: &str = ".smooth{stroke:#222;stroke-width:.09}.rough{stroke:#8a5a2b;stroke-width:.07}\
.glass{stroke:#3c78e6;stroke-width:.07}.faint{stroke:#bbb;stroke-width:.06}\
.link{stroke:#2a7d4f;stroke-width:.08}.place{fill:#1f3fb5}.start{fill:#c03020}";

/// Fig. 3: the environment, smooth walls black, rough ones and furniture brown, glass blue.
pub(super) fn environment(world: &World) -> String {
    let mut drawing = Drawing::new();
    for wall in world.at(0.0).surfaces() {
        let class = match wall.material {
            Material::Smooth => "smooth",
            Material::Rough => "rough",
            Material::Glass => "glass",
        };
        drawing.line(class, wall.from, wall.to, "");
    }
    let start = Point2::from(world.map_from_start().translation.vector);
    drawing.disc("start", start, 0.25, "where the robot starts");
    panels(&[(format!("The environment: {}", world.name()), drawing)], STYLE)
}

/// Fig. 4: the topological map by dead reckoning and after relaxation, over the true walls.
pub(super) fn topology(world: &World, outcome: &Outcome) -> String {
    let panel = |caption: &str, positions: &[Option<Point2<f64>>]| {
        let mut drawing = Drawing::new();
        for wall in world.at(0.0).surfaces() {
            drawing.line("faint", wall.from, wall.to, "");
        }
        for &(from, to) in &outcome.links {
            if let (Some(from), Some(to)) = (positions[from], positions[to]) {
                drawing.line("link", from, to, "");
            }
        }
        for (index, at) in positions.iter().enumerate() {
            if let Some(at) = at {
                drawing.disc("place", *at, 0.14, &format!("place {index}"));
            }
        }
        (caption.to_owned(), drawing)
    };
    panels(
        &[panel("Before: dead reckoning with the compass", &outcome.before), panel("After relaxation", &outcome.after)],
        STYLE,
    )
}
