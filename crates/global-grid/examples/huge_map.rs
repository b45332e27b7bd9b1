//! A map of 10⁸ known cells, built, saved and read back: what it takes in time and memory.
//!
//! ```text
//! huge_map FOLDER
//! ```
//!
//! A laser drives up and down a hall of 500 × 500 m and sees 5 m to all sides; cells of 0.05 m.

#![expect(clippy::print_stdout, reason = "a program says what it made")]

use std::error::Error;
use std::fs::File;
use std::io::{BufReader, BufWriter, Write};
use std::sync::Arc;
use std::time::Instant;

use global_grid::local_grid::nalgebra::{Isometry2, Vector2};
use global_grid::local_grid::{RangeSensor, Scan};
use global_grid::map_server::{MapMetadata, read_image, write_pgm};
use global_grid::{CrispOptions, GridMap, GridOptions};

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args().nth(1).ok_or("usage: huge_map FOLDER")?;
    let step = 1f64.to_radians();
    let fan = RangeSensor::fan("laser", Isometry2::identity(), -179.5f64.to_radians(), step, 360, 0.05..=50.0)?;
    let scan = Scan::from_ranges(Arc::new(fan), std::iter::repeat_n(5.0, 360))?;
    let start = Instant::now();
    let mut map = GridMap::new(GridOptions { resolution: 0.05, ..GridOptions::default() })?;
    for (key, (x, y)) in (0u32..72).flat_map(|x| (0u32..72).map(move |y| (x, y))).enumerate() {
        let at = Vector2::new(f64::from(x), f64::from(y)) * 7.0;
        map.insert(u64::try_from(key)?, &Isometry2::new(at, 0.3 * f64::from(x + y)), &scan)?;
    }
    let crisp = CrispOptions { free: 0.1, occupied: 0.1, ..CrispOptions::default() };
    let mut known = 0u64;
    let cells = map.read(|tally| {
        known += u64::from(!tally.is_unknown());
        crisp.occupancy(map.options().degrees(tally))
    })?;
    println!(
        "built:  {known} known cells in {:.1} s, {} MiB of cells",
        start.elapsed().as_secs_f64(),
        map.cell_bytes() >> 20
    );
    drop(map);
    let (path, start) = (format!("{folder}/huge.pgm"), Instant::now());
    let mut out = BufWriter::new(File::create(&path)?);
    write_pgm(&cells, &mut out)?;
    out.flush()?;
    println!("saved:  {} MiB in {:.1} s", std::fs::metadata(&path)?.len() >> 20, start.elapsed().as_secs_f64());
    let start = Instant::now();
    let metadata = MapMetadata::new("huge.pgm", cells.frame());
    let read = read_image(&metadata, BufReader::with_capacity(1 << 20, File::open(&path)?))?;
    let same = read.occupancy().cells() == cells.cells();
    println!(
        "read:   in {:.1} s, {}",
        start.elapsed().as_secs_f64(),
        if same { "the same cells" } else { "NOT the same" }
    );
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    println!("memory: {}", status.lines().find(|line| line.starts_with("VmHWM")).unwrap_or("peak not known").trim());
    if same { Ok(()) } else { Err("the map did not read back".into()) }
}
