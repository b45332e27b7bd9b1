//! A coloured picture with numbers.

use std::io::{self, Write};

use local_grid::{Grid, nalgebra::Point2};

use super::write_png;
use crate::RegionMap;

type Rgb = [u8; 3];

const WALL: Rgb = [72, 76, 84];
const INK: Rgb = [20, 20, 24];
const OPEN: Rgb = [255, 255, 255];
const SHUT: Rgb = [214, 32, 32];

/// Small maps are enlarged until their longer side has so many pixels, or a cell eight.
const LEAST_SIDE: usize = 800;

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

/// Writes a PNG, the highest row first: each region in a colour of its own, what is not free in it a shade darker, gateways as
/// white lines, shut ones as red ones, and the labels as numbers. Cells of small maps are squares of several pixels.
///
/// # Errors
///
/// What `out` gives back; a grid without cells cannot be a PNG.
pub fn write_picture(out: &mut impl Write, map: &RegionMap, free: &Grid<f32>) -> io::Result<()> {
    let frame = map.labels.frame();
    let longest = frame.rows().max(frame.columns());
    let scale = LEAST_SIDE.div_ceil(longest.max(1)).clamp(1, 8);
    let mut canvas = Canvas::of(map, free, scale);
    let pixel = |point: Point2<f64>| {
        let at = (point - frame.origin()) / frame.resolution() * as_f64(scale);
        (at.y.floor(), at.x.floor())
    };
    for gateway in &map.gateways {
        let [from, to] = gateway.ends.map(pixel);
        canvas.line(from, to, scale.max(2), if gateway.blocked { SHUT } else { OPEN });
    }
    let zoom = (longest * scale / 250).clamp(1, 8);
    for region in &map.regions {
        let (row, column) = pixel(region.inside);
        canvas.number(row, column, zoom, region.label);
    }
    let bytes: Vec<u8> = canvas.pixels.chunks(canvas.columns.max(1)).rev().flatten().flatten().copied().collect();
    write_png(out, canvas.rows, canvas.columns, png::ColorType::Rgb, png::BitDepth::Eight, &bytes)
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
    /// Regions and walls, `scale` pixels to a cell.
    fn of(map: &RegionMap, free: &Grid<f32>, scale: usize) -> Self {
        let frame = map.labels.frame();
        let (rows, columns) = (frame.rows() * scale, frame.columns() * scale);
        let colors = map.labels.cells().iter().zip(free.cells()).map(|(&label, &membership)| match label {
            0 => WALL,
            _ => color(label, if membership > 0.5 { 1.0 } else { 0.75 }),
        });
        let colors: Vec<Rgb> = colors.collect();
        let cell = |at: usize| colors[at / columns / scale * frame.columns() + at % columns / scale];
        Self { rows, columns, pixels: (0..rows * columns).map(cell).collect() }
    }

    /// Colours a pixel; what lies outside is left out.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked to be inside the canvas")]
    fn paint(&mut self, row: f64, column: f64, color: Rgb) {
        if (0.0..as_f64(self.rows)).contains(&row) && (0.0..as_f64(self.columns)).contains(&column) {
            self.pixels[row as usize * self.columns + column as usize] = color;
        }
    }

    /// A line, `thick` pixels thick both ways.
    fn line(&mut self, from: (f64, f64), to: (f64, f64), thick: usize, color: Rgb) {
        let steps = (to.0 - from.0).abs().max((to.1 - from.1).abs()).max(1.0);
        let mut step = 0.0;
        while step <= steps {
            let at = |from: f64, to: f64| (from + (to - from) * step / steps).round() - as_f64(thick / 2);
            let (row, column) = (at(from.0, to.0), at(from.1, to.1));
            for k in 0..thick * thick {
                self.paint(row + as_f64(k / thick), column + as_f64(k % thick), color);
            }
            step += 1.0;
        }
    }

    /// Writes a number around a pixel, a dot of a digit `zoom` pixels wide.
    fn number(&mut self, row: f64, column: f64, zoom: usize, number: u16) {
        let digits = number.to_string();
        let dot = as_f64(zoom);
        let left = column - (as_f64(digits.len()) * 4.0 - 1.0) * dot / 2.0;
        for (place, digit) in digits.bytes().enumerate() {
            for (down, bits) in DIGITS[usize::from(digit - b'0')].into_iter().enumerate() {
                for across in (0..3).filter(|across| bits >> (2 - across) & 1 == 1) {
                    let x = left + as_f64(4 * place + across) * dot;
                    let y = row + (2.0 - as_f64(down)) * dot;
                    for k in 0..zoom * zoom {
                        self.paint((y + as_f64(k / zoom)).floor(), (x + as_f64(k % zoom)).floor(), INK);
                    }
                }
            }
        }
    }
}

#[expect(clippy::cast_precision_loss, reason = "sides of pictures are far below 2^52")]
fn as_f64(count: usize) -> f64 {
    count as f64
}
