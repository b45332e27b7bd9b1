use nalgebra::Vector2;

/// Straightened outlines may leave the pixels' edges by so many pixels.
///
/// The stairs of a slanted line have two rows of corners, up to one pixel apart.
const TOLERANCE: f64 = 1.01;
/// Outlines of so few pixel edges are specks of noise: a single pixel has four.
const SPECK: usize = 5;

/// The outlines of the free area in pixels, `x` right and `y` up, free area to the left: closed polygons, straightened.
///
/// The edges between free and solid pixels are followed; their ends are thinned out by Douglas & Peucker's rule (1973).
pub(super) fn outlines(columns: usize, rows: usize, is_free: impl Fn(usize, usize) -> bool) -> Vec<Vec<Vector2<f64>>> {
    let mut edges = Edges::new(columns, rows, is_free);
    let mut outlines = Vec::new();
    while let Some(cracks) = edges.next_loop() {
        if cracks.len() < SPECK {
            continue;
        }
        let outline = straighten(&cracks);
        if outline.len() > 1 {
            outlines.push(outline);
        }
    }
    outlines
}

/// Directions in counter-clockwise order: right, up, left, down.
const STEPS: [(isize, isize); 4] = [(1, 0), (0, 1), (-1, 0), (0, -1)];

/// The edges between free and solid pixels that no outline holds yet: per pixel corner, four bits of directions.
struct Edges {
    stride: usize,
    leaving: Vec<u8>,
    searched: usize,
}

impl Edges {
    fn new(columns: usize, rows: usize, is_free: impl Fn(usize, usize) -> bool) -> Self {
        let stride = columns + 1;
        let mut leaving = vec![0u8; stride * (rows + 1)];
        let solid = |column: Option<usize>, row: Option<usize>| match (column, row) {
            (Some(column), Some(row)) if column < columns && row < rows => !is_free(column, row),
            _ => true,
        };
        for row in 0..rows {
            for column in (0..columns).filter(|&column| is_free(column, row)) {
                let corner = |right: usize, up: usize| (row + up) * stride + column + right;
                let below = solid(Some(column), row.checked_sub(1));
                let right = solid(Some(column + 1), Some(row));
                let above = solid(Some(column), Some(row + 1));
                let left = solid(column.checked_sub(1), Some(row));
                // Counter-clockwise round the free pixel.
                for (direction, (is_solid, from)) in
                    [(below, corner(0, 0)), (right, corner(1, 0)), (above, corner(1, 1)), (left, corner(0, 1))]
                        .into_iter()
                        .enumerate()
                {
                    leaving[from] |= u8::from(is_solid) << direction;
                }
            }
        }
        Self { stride, leaving, searched: 0 }
    }

    /// Follows the next outline to its end: the corners of pixels that it passes.
    fn next_loop(&mut self) -> Option<Vec<Vector2<f64>>> {
        let start = self.searched + self.leaving[self.searched..].iter().position(|&bits| bits != 0)?;
        self.searched = start;
        let mut at = start;
        let mut direction = self.leaving[start].trailing_zeros() as usize;
        let mut corners = Vec::new();
        loop {
            self.leaving[at] &= !(1 << direction);
            let (dx, dy) = STEPS[direction];
            #[expect(clippy::cast_precision_loss, reason = "pixels are few")]
            let (x, y) = ((at % self.stride) as f64, (at / self.stride) as f64);
            corners.push(Vector2::new(x, y));
            // Every edge has two ends: the sum stays within the corners.
            at = at.wrapping_add_signed(dx + dy * self.stride.cast_signed());
            // Left first: pixels that only touch at a corner are not connected.
            let turn = [1, 0, 3].into_iter().map(|turn| (direction + turn) % 4);
            match turn.into_iter().find(|next| self.leaving[at] & (1 << next) != 0) {
                Some(next) => direction = next,
                None => return Some(corners),
            }
        }
    }
}

/// A closed polygon thinned out so that no point left out lies farther than the tolerance from it.
fn straighten(points: &[Vector2<f64>]) -> Vec<Vector2<f64>> {
    // The two points farthest apart from the first are corners for certain.
    let farthest = |from: usize| {
        let distance = |k: &usize| (points[*k] - points[from]).norm_squared();
        (0..points.len()).max_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0)
    };
    let (first, second) = (farthest(0), farthest(farthest(0)));
    let (first, second) = (first.min(second), first.max(second));
    let count = points.len();
    let mut kept = vec![false; count];
    kept[first] = true;
    kept[second] = true;
    let mut open = vec![(first, second), (second, first + count)];
    while let Some((from, to)) = open.pop() {
        let (a, b) = (points[from % count], points[to % count]);
        let chord = b - a;
        let off = |k: usize| {
            let p = points[k % count] - a;
            let share = if chord.norm_squared() > 0.0 { p.dot(&chord) / chord.norm_squared() } else { 0.0 };
            (p - chord * share.clamp(0.0, 1.0)).norm()
        };
        let worst = (from + 1..to).map(|k| (k, off(k))).max_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((worst, distance)) = worst
            && distance > TOLERANCE
        {
            kept[worst % count] = true;
            open.extend([(from, worst), (worst, to)]);
        }
    }
    points.iter().zip(kept).filter(|(_, kept)| *kept).map(|(point, _)| *point).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(picture: &[&str]) -> Vec<Vec<Vector2<f64>>> {
        let rows = picture.len();
        outlines(picture[0].len(), rows, |column, row| picture[rows - 1 - row].as_bytes()[column] == b'.')
    }

    #[test]
    fn a_slanted_wall_becomes_one_straight_piece() {
        let picture: Vec<String> = (0..40)
            .map(|row| (0..80).map(|column| if column < 20 + row / 2 { '.' } else { '#' }).collect::<String>())
            .collect();
        let rows: Vec<&str> = picture.iter().map(String::as_str).collect();
        let found = of(&rows);
        assert_eq!(found.len(), 1);
        assert!(found[0].len() <= 8, "{:?}", found[0]); // four walls
    }

    #[test]
    fn an_island_has_an_outline_of_its_own_and_a_speck_none() {
        assert_eq!(of(&["......", "..##..", "..##..", "......"]).len(), 2);
        assert_eq!(of(&[".....", "..#..", "....."]).len(), 1);
    }

    #[test]
    fn areas_that_touch_at_a_corner_stay_apart() {
        assert_eq!(of(&["..##", "..##", "##..", "##.."]).len(), 2);
    }
}
