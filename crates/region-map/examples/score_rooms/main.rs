//! Scores this crate on floor plans with hand-cut rooms: `score_rooms FOLDER [PICTURES]`.
//!
//! `FOLDER` holds `NAME.png`, `NAME_furniture.png` and `NAME_gt.png`, 0.05 m per pixel, white = free.

mod picture;
mod plan;
mod score;

use std::{path::Path, time::Instant};

use region_map::{
    local_grid::{Grid, GridFrame},
    nalgebra::Point2,
};

const RESOLUTION: f64 = 0.05;

fn main() -> Result<(), String> {
    let arguments: Vec<String> = std::env::args().collect();
    let folder = Path::new(arguments.get(1).ok_or("usage: score_rooms FOLDER [PICTURES]")?);
    let pictures = arguments.get(2).map(Path::new);
    let only = arguments.get(3);
    for suffix in ["", "_furniture"] {
        println!(
            "{:24} {:>5} {:>6} {:>9} {:>5} {:>5} {:>6}",
            "plan", "IoU", "recall", "precision", "found", "true", "ms"
        );
        let mut all = Vec::new();
        let mut times = Vec::new();
        for name in plan::names(folder) {
            if only.is_some_and(|o| *o != name) {
                continue;
            }
            let empty = plan::read_grey(&folder.join(format!("{name}{suffix}.png")))?;
            let truth = plan::read_grey(&folder.join(format!("{name}_gt.png")))?.white_regions();
            let frame =
                GridFrame::new(Point2::origin(), RESOLUTION, empty.rows, empty.columns).map_err(|e| e.to_string())?;
            let cells = empty.grey.iter().map(|&g| if g >= 250 { 1.0_f32 } else { 0.0 }).collect();
            let free = Grid::from_cells(frame, cells).map_err(|_| "size")?;
            let mut best = f64::INFINITY;
            let mut labels = Vec::new();
            for _ in 0..3 {
                let start = Instant::now();
                let map = region_map::segment(&free, &region_map::Options::default()).map_err(|e| e.to_string())?;
                best = best.min(start.elapsed().as_secs_f64() * 1e3);
                labels = map.labels.cells().iter().map(|&l| u32::from(l)).collect::<Vec<_>>();
            }
            let s = score::score(&labels, &truth, (1.0 / RESOLUTION.powi(2)).round() as usize);
            println!(
                "{name:24} {:5.3} {:6.3} {:9.3} {:5} {:5} {best:6.1}",
                s.iou, s.recall, s.precision, s.found, s.truth
            );
            if let Some(out) = pictures {
                let free: Vec<bool> = free.cells().iter().map(|&c| c > 0.5).collect();
                picture::write(&out.join(format!("{name}{suffix}.png")), empty.columns, &labels, &truth, &free)?;
            }
            all.push(s);
            times.push(best);
        }
        times.sort_by(f64::total_cmp);
        let n = all.len() as f64;
        let mean = |f: fn(&score::Score) -> f64| all.iter().map(f).sum::<f64>() / n;
        println!(
            "{:24} {:5.3} {:6.3} {:9.3} {:5} {:5} {:6.1}\n",
            "mean (sum, median ms)",
            mean(|s| s.iou),
            mean(|s| s.recall),
            mean(|s| s.precision),
            all.iter().map(|s| s.found).sum::<usize>(),
            all.iter().map(|s| s.truth).sum::<usize>(),
            times[times.len() / 2]
        );
    }
    Ok(())
}
