//! Where ways cross from one piece of a region to the next.

use global_grid::plan::PlanOptions;
use region_map::RegionMap;
use robot_log::local_grid::Grid;

use super::doors::{Door, cells, safest_of_stretches};
use super::pieces::{Piece, Pieces};

/// Open borders between pieces are crossed once in so many metres.
const STRETCH: f64 = 1.2;

/// A pair of cells to both sides of a border, that of the piece first.
type Pair = [(usize, usize); 2];

/// Doors between the pieces of each region.
pub(super) fn crossings(unsafety: &Grid<f32>, map: &RegionMap, pieces: &Pieces, options: &PlanOptions) -> Vec<Door> {
    let frame = unsafety.frame();
    let label = |(row, column): (usize, usize)| map.labels.get(row, column).copied().unwrap_or_default();
    let risk = |(row, column): (usize, usize)| unsafety.get(row, column).map_or(1.0, |risk| f64::from(*risk));
    let longest = cells(STRETCH, frame.resolution());
    let mut doors = Vec::new();
    for piece in &pieces.pieces {
        let open = |pair: &Pair| pair.iter().all(|&at| label(at) == piece.region && risk(at) <= options.forbidden);
        for border in borders(piece) {
            let worse = |pair: &Pair| risk(pair[0]).max(risk(pair[1]));
            for [(row, column), _] in safest_of_stretches(border.split(|pair| !open(pair)), longest, worse) {
                doors.push(Door { point: frame.center(row, column), regions: [piece.region; 2], gateway: None });
            }
        }
    }
    doors
}

/// The upper and the right border of a piece; cells beyond its region are left for the caller to see.
fn borders(piece: &Piece) -> [Vec<Pair>; 2] {
    let ([low, high], [left, right]) = (piece.window.rows, piece.window.columns);
    let upper = (left..right).map(|column| [(high - 1, column), (high, column)]).collect();
    let side = (low..high).map(|row| [(row, right - 1), (row, right)]).collect();
    [upper, side]
}
