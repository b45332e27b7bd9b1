//! Plans drawn with rectangles.

use region_map::{
    local_grid::{Grid, GridFrame},
    nalgebra::{Point2, Rotation2, Vector2},
};

/// A rectangle of free space in metres: low corner, high corner.
pub(crate) type Box2 = ([f64; 2], [f64; 2]);

/// Membership of free space that is the union of `boxes`, turned by `turn` radians about the middle of the map.
pub(crate) fn draw(boxes: &[Box2], resolution: f64, turn: f64) -> Grid<f32> {
    let low = |k: usize| boxes.iter().map(|b| b.0[k]).fold(f64::INFINITY, f64::min);
    let high = |k: usize| boxes.iter().map(|b| b.1[k]).fold(f64::NEG_INFINITY, f64::max);
    let middle = Point2::new((low(0) + high(0)) / 2.0, (low(1) + high(1)) / 2.0);
    let reach = (high(0) - low(0)).hypot(high(1) - low(1)) / 2.0 + 1.0;
    let corner = Vector2::new(reach, reach);
    let frame = GridFrame::covering(middle - corner, middle + corner, resolution).expect("a small square");
    let back = Rotation2::new(-turn);
    let mut grid = Grid::<f32>::new(frame);
    for row in 0..frame.rows() {
        for column in 0..frame.columns() {
            let p = middle + back * (frame.center(row, column) - middle);
            let inside = |b: &Box2| (b.0[0]..b.1[0]).contains(&p.x) && (b.0[1]..b.1[1]).contains(&p.y);
            if boxes.iter().any(inside) {
                grid.cells_mut()[row * frame.columns() + column] = 1.0;
            }
        }
    }
    grid
}

/// Two rooms of 4 × 4 m with a wall of 0.2 m between them and an opening of `width` in its middle.
pub(crate) fn two_rooms(width: f64) -> Vec<Box2> {
    vec![([0.0, 0.0], [4.0, 4.0]), ([4.2, 0.0], [8.2, 4.0]), ([4.0, 2.0 - width / 2.0], [4.2, 2.0 + width / 2.0])]
}

/// A corridor of 13 × 2 m with three rooms of 4 × 4 m on each side, doors of 0.9 m, walls of 0.2 m at least.
pub(crate) fn corridor_with_rooms() -> Vec<Box2> {
    let mut boxes = vec![([0.0, 4.2], [13.0, 6.2])];
    for k in 0..3 {
        let x = 4.4 * f64::from(k);
        let door = x + 1.0 + 0.8 * f64::from(k);
        for (room, sill) in [(0.0, 4.0), (6.4, 6.2)] {
            boxes.push(([x, room], [x + 4.0, room + 4.0]));
            boxes.push(([door, sill], [door + 0.9, sill + 0.2]));
        }
    }
    boxes
}
