//! Times grids of the `costmap` crate on readings at known poses, as the example `known_poses` times ours.
//!
//! ```text
//! costmap-grid sonar|laser FILE REPEATS OUT.pgm
//! ```
//!
//! The crate has grids and rays, not a rule: beams count down along the ray and up in its last cell, bounded both ways.
//! A sonar is a fan of rays, one for each cell of its arc.

use std::error::Error;
use std::f32::consts::PI;

use costmap::{Grid2d, MapInfo};
use glam::Vec2;
use rustix::time::{ClockId, clock_gettime};

/// A scan: where the rays start, and each one's direction and length in metres.
struct Fan {
    from: Vec2,
    rays: Vec<(Vec2, f32)>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [kind, file, repeats, out] = arguments.as_slice() else {
        return Err("usage: costmap-grid sonar|laser FILE REPEATS OUT.pgm".into());
    };
    let (sonar, mut readings) = (kind == "sonar", 0);
    let resolution = if sonar { 0.1 } else { 0.05 };
    let mut fans = Vec::new();
    for line in std::fs::read_to_string(file)?.lines() {
        let numbers = line.split_whitespace().map(str::parse).collect::<Result<Vec<f32>, _>>()?;
        let [x, y, heading, ranges @ ..] = numbers.as_slice() else { return Err("a line is too short".into()) };
        readings += ranges.len();
        fans.push(Fan { from: Vec2::new(*x, *y), rays: rays(sonar, *heading, ranges, resolution) });
    }
    let info = frame(sonar, &fans, resolution);
    let (mut times, mut grid) = (Vec::new(), None);
    for _ in 0..repeats.parse::<usize>()?.max(1) {
        let mut drawn = Grid2d::<i8>::new_with_value(info.clone(), 0);
        let start = milliseconds();
        fans.iter().for_each(|fan| draw(&mut drawn, fan, resolution));
        times.push(milliseconds() - start);
        grid = Some(drawn);
    }
    times.sort_by(f64::total_cmp);
    let ms = times[times.len() / 2];
    let per = ms * 1e6 / readings as f64;
    println!("{{\"peer\":\"costmap\",\"kind\":\"{kind}\",\"readings\":{readings},\"ms\":{ms:.3},\"ns_per_reading\":{per:.1}}}");
    if let Some(grid) = grid.filter(|_| sonar) {
        write_gray(&grid, out)?;
    }
    Ok(())
}

fn rays(sonar: bool, heading: f32, ranges: &[f32], resolution: f32) -> Vec<(Vec2, f32)> {
    let toward = |bearing: f32, range: f32| (Vec2::from_angle(heading + bearing), range);
    if sonar {
        let (range, width) = (ranges[0], 25f32.to_radians());
        let count = if range < 6.0 { ((width * range / resolution).ceil() as usize).max(3) } else { 0 };
        return (0..count).map(|k| toward(width * (k as f32 / (count - 1) as f32 - 0.5), range)).collect();
    }
    let count = ranges.len();
    let step = PI / (if count % 2 == 1 { count - 1 } else { count }) as f32;
    let heard = ranges.iter().enumerate().filter(|(_, range)| **range < 50.0);
    heard.map(|(k, range)| toward(k as f32 * step - PI / 2.0, *range)).collect()
}

fn frame(sonar: bool, fans: &[Fan], resolution: f32) -> MapInfo {
    let (mut low, mut high) = (Vec2::ZERO, Vec2::new(45.0, 35.0));
    if !sonar {
        let ends = || fans.iter().flat_map(|fan| fan.rays.iter().map(|ray| fan.from + ray.0 * ray.1));
        low = ends().fold(Vec2::INFINITY, Vec2::min).floor() - 2.0;
        high = ends().fold(Vec2::NEG_INFINITY, Vec2::max).ceil() + 2.0;
    }
    let size = ((high - low) / resolution).round();
    MapInfo { width: size.x as u32, height: size.y as u32, resolution, origin: low, ..Default::default() }
}

fn draw(grid: &mut Grid2d<i8>, fan: &Fan, resolution: f32) {
    for &(toward, range) in &fan.rays {
        if let Some(cells) = grid.line_value_mut(fan.from, toward, (range - resolution).max(0.0)) {
            cells.for_each(|cell| *cell = (*cell - 1).max(-50));
        }
        let end = grid.world_to_map(fan.from + toward * range);
        if let Some(cell) = end.and_then(|cell| grid.get_mut(cell)) {
            *cell = (*cell + 3).min(50);
        }
    }
}

/// Milliseconds that this thread has run.
fn milliseconds() -> f64 {
    let time = clock_gettime(ClockId::ThreadCPUTime);
    time.tv_sec as f64 * 1e3 + time.tv_nsec as f64 * 1e-6
}

/// Counts as probabilities, `254 (1 − p)`, unknown 205; the highest row first.
fn write_gray(grid: &Grid2d<i8>, path: &str) -> std::io::Result<()> {
    let (width, height) = (450, 350);
    let mut image = format!("P5\n{width} {height}\n255\n").into_bytes();
    for row in (0..height).rev() {
        for column in 0..width {
            let count = grid.get(glam::UVec2::new(column, row)).copied().unwrap_or(0);
            let p = 1.0 / (1.0 + (-0.1 * f32::from(count)).exp());
            image.push(if count == 0 { 205 } else { (254.0 * (1.0 - p)).round() as u8 });
        }
    }
    std::fs::write(path, image)
}
