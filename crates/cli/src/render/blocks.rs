use global_grid::{CrispOptions, Occupancy};
use local_grid::{Fuzzy, FuzzyGrid};
use nalgebra::Point2;

/// What one dot of a picture shows; what is later in the list is drawn over what is earlier.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
enum Dot {
    #[default]
    Unexplored,
    Free,
    Contradictory,
    Occupied,
    Place,
}

impl Dot {
    /// Red, green and blue.
    const fn color(self) -> [u8; 3] {
        match self {
            Self::Unexplored => [0x93, 0xa5, 0xb8],
            Self::Free => [0xff, 0xff, 0xff],
            Self::Contradictory => [0xd5, 0x5e, 0x00],
            Self::Occupied => [0x20, 0x25, 0x2b],
            Self::Place => [0x0d, 0x63, 0x7d],
        }
    }

    /// Where there is no color.
    const fn letter(self) -> char {
        match self {
            Self::Unexplored => ' ',
            Self::Free => '.',
            Self::Contradictory => '?',
            Self::Occupied => '#',
            Self::Place => 'o',
        }
    }
}

/// Draws a gridmap and its places in at most so many columns and rows of text.
///
/// With color every letter holds two dots, one above the other; without, one dot that is twice as high as wide, and a
/// legend is needed.
pub(crate) fn picture(
    grid: &FuzzyGrid,
    places: &[Point2<f64>],
    (columns, rows): (usize, usize),
    color: bool,
) -> String {
    let frame = grid.frame();
    // Cells along one dot: as few as fit.
    let cells = frame.columns().div_ceil(columns.max(1)).max(frame.rows().div_ceil(2 * rows.max(1))).max(1);
    let high = if color { cells } else { 2 * cells };
    let (width, height) = (frame.columns().div_ceil(cells), frame.rows().div_ceil(high));
    let mut dots = vec![Dot::default(); width * height];
    let options = CrispOptions::for_map(grid);
    for row in 0..frame.rows() {
        for column in 0..frame.columns() {
            let dot = &mut dots[(row / high) * width + column / cells];
            *dot = (*dot).max(shown(grid.cells()[row * frame.columns() + column], &options));
        }
    }
    for place in places {
        let at = (place - frame.origin()) / frame.resolution();
        if at.x >= 0.0 && at.y >= 0.0 {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked, and cut off below")]
            let (column, row) = (at.x as usize / cells, at.y as usize / high);
            if column < width && row < height {
                dots[row * width + column] = Dot::Place;
            }
        }
    }
    let line = |row: usize| &dots[row * width..(row + 1) * width];
    let mut text = String::new();
    if color {
        // The first line of text is the northernmost.
        for top in (0..height.div_ceil(2)).rev().map(|pair| 2 * pair + 1) {
            let above = if top < height { line(top) } else { &[] };
            for (column, below) in line(top - 1).iter().enumerate() {
                let ([r, g, b], [br, bg, bb]) = (above.get(column).copied().unwrap_or_default().color(), below.color());
                text.push_str(&format!("\u{1b}[38;2;{r};{g};{b};48;2;{br};{bg};{bb}m▀"));
            }
            text.push_str("\u{1b}[0m\n");
        }
    } else {
        for row in (0..height).rev() {
            let letters: String = line(row).iter().map(|dot| dot.letter()).collect();
            text.push_str(letters.trim_end());
            text.push('\n');
        }
    }
    text
}

fn shown(cell: Fuzzy, options: &CrispOptions) -> Dot {
    match options.occupancy(cell) {
        Occupancy::Occupied => Dot::Occupied,
        Occupancy::Free => Dot::Free,
        Occupancy::Unknown if options.is_contradictory(cell) => Dot::Contradictory,
        Occupancy::Unknown => Dot::Unexplored,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use local_grid::{Grid, GridFrame};

    /// A floor of 4 × 2 m with a wall along its north and west.
    fn room() -> FuzzyGrid {
        let frame = GridFrame::new(Point2::origin(), 0.5, 4, 8).unwrap();
        let mut grid: FuzzyGrid = Grid::new(frame);
        let (rows, columns) = (grid.frame().rows(), grid.frame().columns());
        for (index, cell) in grid.cells_mut().iter_mut().enumerate() {
            let wall = index / columns == rows - 1 || index % columns == 0;
            *cell = if wall { Fuzzy { empty: 0.0, occupied: 1.0 } } else { Fuzzy { empty: 1.0, occupied: 0.0 } };
        }
        grid
    }

    #[test]
    fn north_is_up_and_a_letter_is_two_dots_high() {
        let text = picture(&room(), &[Point2::new(3.2, 0.2)], (80, 22), false);
        assert_eq!(text, "########\n#.....o.\n");
    }

    #[test]
    fn a_large_map_is_drawn_small() {
        let text = picture(&room(), &[], (4, 22), false);
        assert!(text.lines().all(|line| line.chars().count() <= 4) && text.lines().count() == 1, "{text}");
        let colored = picture(&room(), &[], (80, 22), true);
        assert_eq!((colored.lines().count(), colored.matches('▀').count()), (2, 16));
    }
}
