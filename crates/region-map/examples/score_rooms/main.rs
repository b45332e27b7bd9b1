//! Scores this crate and two plain baselines on floor plans with hand-cut rooms: `score_rooms FOLDER [PICTURES]`.
//!
//! `FOLDER` holds `NAME.png`, `NAME_furniture.png` and `NAME_gt.png` (every doorway closed by a line), 0.05 m per pixel,
//! white = free. `PICTURES` is a folder for pictures of every result over its truth.

#![expect(clippy::print_stdout, reason = "a program that prints a table")]

mod picture;
mod plan;
mod score;

use std::{path::Path, sync::OnceLock, time::Instant};

use region_map::{
    Options, baseline,
    local_grid::{Grid, GridFrame},
    nalgebra::Point2,
    segment,
};
use score::Score;

/// Metres per pixel of the plans.
const RESOLUTION: f64 = 0.05;
/// Regions under one square metre are ignored.
const LEAST_CELLS: usize = 400;

/// A way to cut a map into regions.
type Method = fn(&Grid<f32>) -> Result<Grid<u16>, String>;

const METHODS: [(&str, Method); 3] = [
    ("gateways (segment)", |free| Ok(segment(free, &Options::default()).map_err(text)?.labels)),
    ("cut below 1.1 m", |free| baseline::by_opening(free, 1.1, 1.0).map_err(text)),
    ("distance transform", |free| baseline::by_distance(free, 0.2, 0.8, 1.0).map_err(text)),
];

fn text(error: impl std::fmt::Display) -> String {
    error.to_string()
}

fn main() -> Result<(), String> {
    let arguments: Vec<String> = std::env::args().collect();
    let folder = Path::new(arguments.get(1).ok_or("usage: score_rooms FOLDER [PICTURES]")?);
    let pictures = arguments.get(2).map(Path::new);
    for (name, method) in METHODS {
        for suffix in ["", "_furniture"] {
            println!("{name}, {}", if suffix.is_empty() { "empty" } else { "furnished" });
            println!("plan                       IoU recall precision found  true      ms");
            let pictures = pictures.filter(|_| name == METHODS[0].0);
            table(folder, suffix, method, pictures)?;
        }
    }
    Ok(())
}

/// Scores one method on all plans.
fn table(folder: &Path, suffix: &str, method: Method, pictures: Option<&Path>) -> Result<(), String> {
    let mut all = Vec::new();
    let mut times = Vec::new();
    for name in plan::names(folder) {
        let drawn = plan::read_grey(&folder.join(format!("{name}{suffix}.png")))?;
        let truth = plan::read_grey(&folder.join(format!("{name}_gt.png")))?.white_regions();
        let frame = GridFrame::new(Point2::origin(), RESOLUTION, drawn.rows, drawn.columns).map_err(text)?;
        let cells = drawn.grey.iter().map(|&grey| f32::from(u8::from(grey >= 250))).collect();
        let free = Grid::from_cells(frame, cells).map_err(|_| "a picture of another size than its header says")?;
        let (labels, milliseconds) = fastest_of_three(method, &free)?;
        let score = score::score(&labels, &truth, LEAST_CELLS);
        row(&name, &score, milliseconds);
        if let Some(out) = pictures {
            let free: Vec<bool> = free.cells().iter().map(|&cell| cell > 0.5).collect();
            picture::write(&out.join(format!("{name}{suffix}.png")), drawn.columns, &labels, &truth, &free)?;
        }
        all.push(score);
        times.push(milliseconds);
    }
    times.sort_by(f64::total_cmp);
    let (mean, median) = (Score::mean(&all), times.get(times.len() / 2).ok_or("no NAME_gt.png in the folder")?);
    row("mean, sum, median", &mean, *median);
    println!();
    Ok(())
}

fn row(name: &str, score: &Score, milliseconds: f64) {
    let Score { recall, precision, iou, found, truth } = score;
    println!("{name:24} {iou:5.3} {recall:6.3} {precision:9.3} {found:5} {truth:5} {milliseconds:7.1}");
}

/// Processor time of this thread where the system tells it, else the time on the wall.
fn seconds() -> f64 {
    static START: OnceLock<Instant> = OnceLock::new();
    let start = START.get_or_init(Instant::now);
    let nanoseconds = std::fs::read_to_string("/proc/thread-self/schedstat").ok();
    let nanoseconds = nanoseconds.and_then(|text| text.split_whitespace().next()?.parse::<f64>().ok());
    nanoseconds.map_or(start.elapsed().as_secs_f64(), |nanoseconds| nanoseconds / 1e9)
}

fn fastest_of_three(method: Method, free: &Grid<f32>) -> Result<(Vec<u32>, f64), String> {
    let mut best = f64::INFINITY;
    let mut labels = Vec::new();
    for _ in 0..3 {
        let start = seconds();
        let found = method(free)?;
        best = best.min((seconds() - start) * 1e3);
        labels = found.cells().iter().map(|&label| u32::from(label)).collect();
    }
    Ok((labels, best))
}
