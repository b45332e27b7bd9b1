//! A coloured picture with numbers.

use std::io::{self, Write};

use local_grid::{Grid, nalgebra::Point2};

use super::write_png;
use crate::RegionMap;

type Rgb = [u8; 3];

const WALL: Rgb = [72, 76, 84];
const INK: Rgb = [20, 20, 24];

/// Digits on a raster of 3 × 5 dots, row by row, the highest of three bits leftmost.
const DIGITS: [[u8; 5]; 10] = [
    [7, 5, 5, 5, 7],
    [2, 6, 2, 2, 7],
    [7, 1, 7, 4, 7],
    [7, 1, 7, 1, 7],
    [5, 5, 7, 1, 1],
    [7, 4, 7, 1, 7],
    [7, 4, 7, 5, 7],
    [7, 1, 1, 1, 1],
    [7, 5, 7, 5, 7],
    [7, 5, 7, 1, 7],
];

/// Writes a PNG, one pixel per cell, the highest row first: each region in a colour of its own, what is not free in it a
/// shade darker, gateways as dark lines, and the labels as numbers.
///
/// # Errors
///
/// What `out` gives back; a grid without cells cannot be a PNG.
pub fn write_picture(out: &mut impl Write, map: &RegionMap, free: &Grid<f32>) -> io::Result<()> {
    let frame = map.labels.frame();
    let mut canvas = Canvas { rows: frame.rows(), columns: frame.columns(), pixels: Vec::new() };
    for (&label, &membership) in map.labels.cells().iter().zip(free.cells()) {
        let shade = if membership > 0.5 { 1.0 } else { 0.75 };
        canvas.pixels.push(if label == 0 { WALL } else { color(label, shade) });
    }
    let cell = |point: Point2<f64>| {
        let at = (point - frame.origin()) / frame.resolution();
        (at.y.floor(), at.x.floor())
    };
    for gateway in &map.gateways {
        let [from, to] = gateway.ends.map(cell);
        canvas.line(from, to);
    }
    let zoom = (frame.rows().max(frame.columns()) / 400).clamp(1, 8);
    for region in &map.regions {
        let (row, column) = cell(region.inside);
        canvas.number(row, column, zoom, region.label);
    }
    let bytes: Vec<u8> = canvas.pixels.chunks(canvas.columns.max(1)).rev().flatten().flatten().copied().collect();
    write_png(out, frame.rows(), frame.columns(), png::ColorType::Rgb, png::BitDepth::Eight, &bytes)
}

/// A light colour; hues of neighbouring labels lie a golden angle apart.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "between 0 and 255")]
fn color(label: u16, shade: f64) -> Rgb {
    let hue = f64::from(label) * 0.381_966;
    let channel = |shift: f64| {
        let wave = (std::f64::consts::TAU * (hue + shift)).cos();
        ((205.0 + 45.0 * wave) * shade) as u8
    };
    [channel(0.0), channel(1.0 / 3.0), channel(2.0 / 3.0)]
}

/// Pixels, the lowest row first.
struct Canvas {
    rows: usize,
    columns: usize,
    pixels: Vec<Rgb>,
}

impl Canvas {
    /// Inks a pixel; what lies outside is left out.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked to be inside the canvas")]
    #[expect(clippy::cast_precision_loss, reason = "sides are far below 2^52")]
    fn ink(&mut self, row: f64, column: f64) {
        if (0.0..self.rows as f64).contains(&row) && (0.0..self.columns as f64).contains(&column) {
            self.pixels[row as usize * self.columns + column as usize] = INK;
        }
    }

    fn line(&mut self, from: (f64, f64), to: (f64, f64)) {
        let steps = (to.0 - from.0).abs().max((to.1 - from.1).abs()).max(1.0);
        let mut step = 0.0;
        while step <= steps {
            let at = |from: f64, to: f64| (from + (to - from) * step / steps).round();
            self.ink(at(from.0, to.0), at(from.1, to.1));
            step += 1.0;
        }
    }

    /// Writes a number around a cell.
    #[expect(clippy::cast_precision_loss, reason = "a label has five digits, a digit four dots")]
    fn number(&mut self, row: f64, column: f64, zoom: usize, number: u16) {
        let digits = number.to_string();
        let dot = zoom as f64;
        let left = column - (digits.len() as f64 * 4.0 - 1.0) * dot / 2.0;
        for (place, digit) in digits.bytes().enumerate() {
            for (down, bits) in DIGITS[usize::from(digit - b'0')].into_iter().enumerate() {
                for across in (0..3).filter(|across| bits >> (2 - across) & 1 == 1) {
                    let x = left + (4 * place + across) as f64 * dot;
                    let y = row + (2.0 - down as f64) * dot;
                    for k in 0..zoom * zoom {
                        self.ink((y + (k / zoom) as f64).floor(), (x + (k % zoom) as f64).floor());
                    }
                }
            }
        }
    }
}
