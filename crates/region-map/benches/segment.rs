//! Time to cut an office into rooms, and of the two plain baselines, on a drawn plan and one of four times its area.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use region_map::{
    Options, baseline,
    local_grid::{Grid, GridFrame},
    nalgebra::Point2,
    segment,
};

/// An office: rows of rooms of 4 × 4 m on both sides of corridors of 2 m, doors of 0.9 m, at 0.05 m per cell.
fn office(wings: usize, rooms: usize) -> Grid<f32> {
    let (wing, room) = (212, 84); // cells: two rooms, a corridor and walls; a room and a wall
    let (rows, columns) = (wings * wing + 4, rooms * room + 4);
    let frame = GridFrame::new(Point2::origin(), 0.05, rows, columns).expect("a frame of a few million cells");
    let mut free = Grid::<f32>::new(frame);
    for row in 2..rows - 2 {
        for column in 2..columns - 2 {
            let (across, along) = ((row - 2) % wing, (column - 2) % room);
            let corridor = (84..124).contains(&across);
            let in_room = (across < 80 || (128..208).contains(&across)) && along < 80;
            let door = (80..128).contains(&across) && (30..48).contains(&along);
            let joint = (40..60).contains(&column) && across >= 208; // wings are joined through rooms
            free.cells_mut()[row * columns + column] = f32::from(u8::from(corridor || in_room || door || joint));
        }
    }
    free
}

fn segmentation(criterion: &mut Criterion) {
    for (name, wings, rooms) in [("office", 4, 10), ("office_x4", 8, 20)] {
        let free = office(wings, rooms);
        let found = segment(&free, &Options::default()).expect("the options are the defaults");
        assert_eq!(found.regions.len(), wings * (2 * rooms + 1), "every room and every corridor");
        let mut group = criterion.benchmark_group(name);
        group.sample_size(10);
        group.bench_function("segment", |b| b.iter(|| segment(black_box(&free), &Options::default())));
        group.bench_function("cut_below_1.1_m", |b| b.iter(|| baseline::by_opening(black_box(&free), 1.1, 1.0)));
        group.bench_function("distance", |b| b.iter(|| baseline::by_distance(black_box(&free), 0.2, 0.8, 1.0)));
        group.finish();
    }
}

criterion_group!(benches, segmentation);
criterion_main!(benches);
