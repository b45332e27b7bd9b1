//! Regions cut into pieces small enough to be flooded at once.

use region_map::RegionMap;

/// A region longer or wider than this is cut, in metres. A corridor may be as large as the map, and have hundreds of doors;
/// its pieces have few.
const LONGEST: f64 = 8.0;

/// A part of a region: its cells within a window.
#[derive(Debug, Clone, Copy)]
pub(super) struct Piece {
    pub(super) region: u16,
    pub(super) window: Window,
}

/// Rows and columns, each the first and one past the last.
#[derive(Debug, Clone, Copy)]
pub(super) struct Window {
    pub(super) rows: [usize; 2],
    pub(super) columns: [usize; 2],
}

/// The pieces of all regions.
#[derive(Debug)]
pub(super) struct Pieces {
    pub(super) pieces: Vec<Piece>,
    /// By label, 0 included.
    regions: Vec<Cut>,
}

/// How a region is cut: into so many parts upwards and sideways, numbered in rows.
#[derive(Debug, Clone, Copy)]
struct Cut {
    window: Window,
    parts: [usize; 2],
    first: usize,
}

impl Window {
    const EMPTY: Self = Self { rows: [usize::MAX, 0], columns: [usize::MAX, 0] };

    fn add(&mut self, row: usize, column: usize) {
        let grown = |[first, last]: [usize; 2], at: usize| [first.min(at), last.max(at + 1)];
        *self = Self { rows: grown(self.rows, row), columns: grown(self.columns, column) };
    }

    /// The window and so many cells around it, within a grid.
    pub(super) fn grown(self, by: usize, rows: usize, columns: usize) -> Self {
        let grown = |[first, last]: [usize; 2], most: usize| [first.saturating_sub(by), (last + by).min(most)];
        Self { rows: grown(self.rows, rows), columns: grown(self.columns, columns) }
    }
}

impl Pieces {
    pub(super) fn of(map: &RegionMap) -> Self {
        let columns = map.labels.frame().columns();
        let mut windows = vec![Window::EMPTY; map.regions.len() + 1];
        for (index, &label) in map.labels.cells().iter().enumerate().filter(|(_, label)| **label > 0) {
            windows[usize::from(label)].add(index / columns, index % columns);
        }
        let (mut pieces, mut regions) = (Vec::new(), Vec::new());
        for (region, window) in (0..).zip(windows) {
            let cut = Cut::of(window, map.labels.frame().resolution(), pieces.len());
            pieces.extend(cut.windows().map(|window| Piece { region, window }));
            regions.push(cut);
        }
        Self { pieces, regions }
    }

    /// The piece that holds a cell of a region.
    pub(super) fn at(&self, region: u16, row: usize, column: usize) -> usize {
        let Cut { window, parts, first } = self.regions[usize::from(region)];
        let part = |at: usize, [low, high]: [usize; 2], parts: usize| (at - low) * parts / (high - low);
        first + part(row, window.rows, parts[0]) * parts[1] + part(column, window.columns, parts[1])
    }

    /// The whole region.
    pub(super) fn region(&self, label: u16) -> Piece {
        Piece { region: label, window: self.regions[usize::from(label)].window }
    }
}

impl Cut {
    fn of(window: Window, resolution: f64, first: usize) -> Self {
        #[expect(clippy::cast_precision_loss, reason = "rows and columns of a grid")]
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "positive, and saturating")]
        let parts = |[low, high]: [usize; 2]| (high.saturating_sub(low) as f64 * resolution / LONGEST).ceil() as usize;
        Self { window, parts: [parts(window.rows), parts(window.columns)], first }
    }

    fn windows(self) -> impl Iterator<Item = Window> {
        // The cells whose part, rounded down as in `Pieces::at`, is this one.
        let bound = |[low, high]: [usize; 2], part: usize, parts: usize| low + (part * (high - low)).div_ceil(parts);
        let span = move |all, part, parts| [bound(all, part, parts), bound(all, part + 1, parts)];
        let Self { window, parts: [up, across], .. } = self;
        (0..up * across).map(move |part| Window {
            rows: span(window.rows, part / across, up),
            columns: span(window.columns, part % across, across),
        })
    }
}
