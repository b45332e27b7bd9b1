//! Scores this crate and two plain baselines on floor plans with hand-cut rooms: `score_rooms FOLDER [PICTURES]`; with
//! `--stability`, instead, what turning, noise, coarser cells and degrees change.
//!
//! `FOLDER` holds `NAME.png`, `NAME_furniture.png` and `NAME_gt.png` (every doorway closed by a line), 0.05 m per pixel,
//! white = free. `PICTURES` is a folder for pictures of every result over its truth.

#![expect(clippy::print_stdout, reason = "a program that prints a table")]

mod disturb;
mod picture;
mod plan;
mod score;

use std::{path::Path, sync::OnceLock, time::Instant};

use disturb::{DISTURBANCES, Plan};
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
const LEAST_AREA: f64 = 1.0;

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
    let (flags, paths): (Vec<String>, Vec<String>) = std::env::args().skip(1).partition(|word| word.starts_with('-'));
    let folder = Path::new(paths.first().ok_or("usage: score_rooms [--stability] FOLDER [PICTURES]")?);
    let pictures = paths.get(1).map(Path::new);
    if flags.iter().any(|flag| flag == "--stability") {
        return stability(folder);
    }
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

/// What disturbances change: means over all plans.
fn stability(folder: &Path) -> Result<(), String> {
    for suffix in ["", "_furniture"] {
        println!("{}", if suffix.is_empty() { "empty" } else { "furnished" });
        println!("plan                       IoU recall precision found  true      ms");
        for (name, disturb) in DISTURBANCES {
            let mut all = Vec::new();
            let begun = seconds();
            for plan in plan::names(folder) {
                let plan = disturb(&read(folder, &plan, suffix)?);
                let labels = METHODS[0].1(&plan.free)?;
                all.push(judge(&labels, &plan));
            }
            row(name, &Score::mean(&all), (seconds() - begun) * 1e3 / all.len().max(1) as f64);
        }
        println!();
    }
    Ok(())
}

fn read(folder: &Path, name: &str, suffix: &str) -> Result<Plan, String> {
    let drawn = plan::read_grey(&folder.join(format!("{name}{suffix}.png")))?;
    let truth = plan::read_grey(&folder.join(format!("{name}_gt.png")))?.white_regions();
    let frame = GridFrame::new(Point2::origin(), RESOLUTION, drawn.rows, drawn.columns).map_err(text)?;
    let cells = drawn.grey.iter().map(|&grey| f32::from(u8::from(grey >= 250))).collect();
    let free = Grid::from_cells(frame, cells).map_err(|_| "a picture of another size than its header says")?;
    if truth.len() != drawn.grey.len() {
        return Err(format!("{name}: the truth is of another size than the plan"));
    }
    Ok(Plan { free, truth })
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a few hundred cells")]
fn judge(labels: &Grid<u16>, plan: &Plan) -> Score {
    let found: Vec<u32> = labels.cells().iter().map(|&label| u32::from(label)).collect();
    score::score(&found, &plan.truth, (LEAST_AREA / labels.frame().resolution().powi(2)).round() as usize)
}

/// Scores one method on all plans.
fn table(folder: &Path, suffix: &str, method: Method, pictures: Option<&Path>) -> Result<(), String> {
    let mut all = Vec::new();
    let mut times = Vec::new();
    for name in plan::names(folder) {
        let plan = read(folder, &name, suffix)?;
        let (labels, milliseconds) = fastest_of_three(method, &plan.free)?;
        let score = judge(&labels, &plan);
        row(&name, &score, milliseconds);
        if let Some(out) = pictures {
            let free: Vec<bool> = plan.free.cells().iter().map(|&cell| cell > 0.5).collect();
            let found: Vec<u32> = labels.cells().iter().map(|&label| u32::from(label)).collect();
            let columns = plan.free.frame().columns();
            picture::write(&out.join(format!("{name}{suffix}.png")), columns, &found, &plan.truth, &free)?;
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

fn fastest_of_three(method: Method, free: &Grid<f32>) -> Result<(Grid<u16>, f64), String> {
    let mut best = f64::INFINITY;
    let mut labels = Grid::new(*free.frame());
    for _ in 0..3 {
        let start = seconds();
        labels = method(free)?;
        best = best.min((seconds() - start) * 1e3);
    }
    Ok((labels, best))
}
