//! What plans through regions cost and lose against those over all cells.
//!
//! ```text
//! cargo run --release -p hierarchy --example plans_timed -- [--pairs N] [PLAN.png...] [RUN/session.hmap...]
//! ```
//!
//! PLAN is a floor plan of 0.05 m per pixel, white = free, and is planned over from region to region, from the spots farthest from
//! walls; the map of a run from place to place, and the robot fits where it has been. Forty pairs (or N) are taken at random:
//! through regions ([`Planner`]), and by A* over all cells with the same costs. The cells' unsafety and the ways between
//! gateways are made once for all plans; `made` tells how long both took.
#![expect(clippy::print_stdout, reason = "an example says what it found")]

use std::fs::File;
use std::io::BufReader;
use std::time::Instant;

use hierarchy::global_grid::Exposure;
use hierarchy::global_grid::map_server::{MapMetadata, read_image};
use hierarchy::global_grid::plan::{PlanOptions, plan_over, unsafety};
use hierarchy::{Mapper, Planner};
use nalgebra::Point2;
use rand::RngExt;
use rand_pcg::Pcg64Mcg;
use region_map::{Options, RegionMap, segment};
use robot_log::local_grid::{Fuzzy, FuzzyGrid, Grid};

type Failure = Box<dyn std::error::Error>;

/// How a floor plan is read.
const DESCRIPTION: &str =
    "image: plan.png\nresolution: 0.05\norigin: [0, 0, 0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.1\n";
/// Pairs that are planned between, unless another number is asked for.
const PAIRS: usize = 40;

fn main() -> Result<(), Failure> {
    println!(
        "map                          rows columns regions gateways  ways  made ms  regions ms  cells ms  times  longer: mean   worst"
    );
    let mut names: Vec<String> = std::env::args().skip(1).collect();
    let n_pairs = match names.iter().position(|name| name == "--pairs") {
        Some(at) => names.drain(at..(at + 2).min(names.len())).next_back().unwrap_or_default().parse()?,
        None => PAIRS,
    };
    for name in names {
        let ground = if name.ends_with(".hmap") { recorded(&name)? } else { drawn(&picture(&name)?)? };
        measure(name.rsplit('/').next().unwrap_or(&name), &ground, n_pairs)?;
    }
    Ok(())
}

/// The degrees of a picture: what is white is wholly empty, all else wholly occupied.
fn picture(path: &str) -> Result<Grid<f32>, Failure> {
    let map = read_image(&MapMetadata::read(DESCRIPTION.as_bytes())?, BufReader::new(File::open(path)?))?;
    Ok(map.cells.map(|&cell| f32::from(u8::from(cell == 0))))
}

/// What is planned over.
struct Ground {
    gridmap: FuzzyGrid,
    map: RegionMap,
    /// Where the robot has been.
    driven: Vec<Point2<f64>>,
    /// Where ways begin and end.
    ends: Vec<Point2<f64>>,
}

fn drawn(free: &Grid<f32>) -> Result<Ground, Failure> {
    let gridmap = free.map(|&free| Fuzzy { empty: 0.95 * free, occupied: 0.95 * (1.0 - free) });
    let map = segment(free, &Options::default())?;
    let ends = map.regions.iter().map(|region| region.inside).collect();
    Ok(Ground { gridmap, map, driven: Vec::new(), ends })
}

fn recorded(path: &str) -> Result<Ground, Failure> {
    let mut mapper = Mapper::load(&mut BufReader::new(File::open(path)?))?;
    let gridmap = mapper.gridmap()?;
    let map = mapper.survey(&gridmap)?;
    let visited = mapper.topology().places().iter().filter(|place| place.is_visited());
    let ends = visited.map(|place| mapper.coordinates().map_from_place(place.id).translation.vector.into()).collect();
    Ok(Ground { gridmap, map, driven: mapper.driven(), ends })
}

fn measure(name: &str, ground: &Ground, n_pairs: usize) -> Result<(), Failure> {
    let Ground { gridmap, map, driven, ends } = ground;
    let options = &PlanOptions { exposure: Exposure::of(gridmap), driven: driven.clone(), ..PlanOptions::default() };
    let (planner, made) = timed(|| Planner::new(gridmap, map, options));
    let (planner, cells) = (planner?, unsafety(gridmap, options)?);
    let (mut by_regions, mut by_cells, mut longer) = (0.0, 0.0, Vec::new());
    for [start, goal] in pairs(ends, n_pairs) {
        let (plan, took) = timed(|| planner.plan(start, goal));
        let (least, took_over_cells) = timed(|| plan_over(&cells, start, goal, options));
        if let (Ok(plan), Some(least)) = (plan, least) {
            by_regions += took;
            by_cells += took_over_cells;
            longer.push(100.0 * (plan.path.length / least.length - 1.0));
        }
    }
    let n = longer.len().max(1) as f64;
    let (mean, worst) = (longer.iter().sum::<f64>() / n, longer.iter().copied().fold(f64::NEG_INFINITY, f64::max));
    let frame = gridmap.frame();
    println!(
        "{name:28} {:>4} {:>7} {:>7} {:>8} {:>5} {:>8.0} {:>11.2} {:>9.2} {:>6.1} {mean:>11.2} % {worst:>5.2} %",
        frame.rows(),
        frame.columns(),
        map.regions.len(),
        map.gateways.len(),
        longer.len(),
        1e3 * made,
        1e3 * by_regions / n,
        1e3 * by_cells / n,
        by_cells / by_regions,
    );
    Ok(())
}

/// What a call gives, and the seconds that it took.
fn timed<T>(call: impl FnOnce() -> T) -> (T, f64) {
    let begun = Instant::now();
    let result = call();
    (result, begun.elapsed().as_secs_f64())
}

/// Ends taken at random, always the same ones.
fn pairs(ends: &[Point2<f64>], n: usize) -> Vec<[Point2<f64>; 2]> {
    let mut random = Pcg64Mcg::new(1);
    let mut spot = || ends[random.random_range(0..ends.len())];
    (0..n).filter(|_| !ends.is_empty()).map(|_| [spot(), spot()]).filter(|[a, b]| a != b).collect()
}
