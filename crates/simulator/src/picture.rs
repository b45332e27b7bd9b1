use local_grid::GridFrame;
use nalgebra::{Isometry2, Point2, Vector2};

use crate::index::floor;
use crate::{Material, Scene};

/// A picture of a world from above: north up, one colour per dot.
///
/// ```
/// use simulator::{Picture, World};
/// use simulator::nalgebra::Point2;
///
/// let world = World::from_plan("name = 'r'\n[[wall]]\npoints = [[0, 0], [3, 0], [3, 2]]\n")?;
/// let mut picture = Picture::of(&world, 20.0);
/// picture.scene(&world.at(0.0));
/// picture.dot(Point2::new(1.0, 1.0), 2.0, [200, 0, 0]);
/// assert_eq!(&picture.png()[1..4], b"PNG");
/// # Ok::<(), simulator::PlanError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Picture {
    low: Point2<f64>,
    scale: f64,
    width: usize,
    height: usize,
    dots: Vec<[u8; 3]>,
}

/// The white border in dots.
const BORDER: f64 = 12.0;
/// Pictures are never larger along an edge.
const LARGEST: f64 = 8192.0;

impl Picture {
    /// A white picture that covers the world at `scale` dots per metre (less where that would make more than 8192 dots).
    #[must_use]
    pub fn of(world: &crate::World, scale: f64) -> Self {
        let (low, high) = world.bounds();
        let size = high - low;
        let scale = scale.clamp(0.01, (LARGEST - 2.0 * BORDER) / size.max().max(1e-3));
        let dots = |metres: f64| floor((metres * scale + 2.0 * BORDER).ceil()).max(1);
        let (width, height) = (dots(size.x), dots(size.y));
        let low = low - Vector2::repeat(BORDER / scale);
        Self { low, scale, width, height, dots: vec![[255; 3]; width * height] }
    }

    /// Draws walls black, rough ones brown, glass blue, and what moves like walls.
    pub fn scene(&mut self, scene: &Scene<'_>) {
        for wall in scene.surfaces() {
            let colour = match wall.material {
                Material::Smooth => [0, 0, 0],
                Material::Rough => [130, 80, 30],
                Material::Glass => [60, 120, 230],
            };
            self.line(wall.from, wall.to, colour);
        }
    }

    /// Draws a line between two points of the map frame.
    pub fn line(&mut self, from: Point2<f64>, to: Point2<f64>, colour: [u8; 3]) {
        let steps = ((to - from).norm() * self.scale * 2.0).ceil().clamp(1.0, 4.0 * LARGEST);
        let count = floor(steps);
        for step in 0..=count {
            #[expect(clippy::cast_precision_loss, reason = "bounded by the picture's size")]
            let share = step as f64 / steps;
            self.dot(from + (to - from) * share, 0.7, colour);
        }
    }

    /// Draws a dot of `radius` picture dots at a point of the map frame.
    pub fn dot(&mut self, at: Point2<f64>, radius: f64, colour: [u8; 3]) {
        let center = (at - self.low) * self.scale;
        let radius = radius.clamp(0.5, 100.0);
        if !(center.x.is_finite() && center.y.is_finite()) {
            return;
        }
        for row in floor(center.y - radius)..=floor(center.y + radius) {
            for column in floor(center.x - radius)..=floor(center.x + radius) {
                #[expect(clippy::cast_precision_loss, reason = "bounded by the picture's size")]
                let middle = Vector2::new(column as f64 + 0.5, row as f64 + 0.5);
                if (middle - center).norm() <= radius && row < self.height && column < self.width {
                    self.dots[(self.height - 1 - row) * self.width + column] = colour;
                }
            }
        }
    }

    /// Draws a robot: its body and where it looks.
    pub fn robot(&mut self, map_from_robot: &Isometry2<f64>, radius: f64, colour: [u8; 3]) {
        let on_skin = |angle: f64| map_from_robot * (Isometry2::rotation(angle) * Point2::new(radius, 0.0));
        for k in 0..24 {
            let angle = f64::from(k) * std::f64::consts::TAU / 24.0;
            self.line(on_skin(angle), on_skin(angle + std::f64::consts::TAU / 24.0), colour);
        }
        self.line(map_from_robot * Point2::origin(), on_skin(0.0), colour);
    }

    /// Colours the cells of a grid, under what is drawn later; cells for which `colour` gives nothing stay.
    pub fn cells(&mut self, frame: &GridFrame, colour: impl Fn(usize, usize) -> Option<[u8; 3]>) {
        for row in 0..self.height {
            for column in 0..self.width {
                #[expect(clippy::cast_precision_loss, reason = "bounded by the picture's size")]
                let at = self.low + Vector2::new(column as f64 + 0.5, row as f64 + 0.5) / self.scale;
                if let Some(colour) = frame.cell_at(at).and_then(|(r, c)| colour(r, c)) {
                    self.dots[(self.height - 1 - row) * self.width + column] = colour;
                }
            }
        }
    }

    /// Width and height in dots.
    #[must_use]
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }

    /// The picture as a PNG file.
    ///
    /// # Panics
    ///
    /// Never: writing into memory cannot fail, and the size is checked when the picture is made.
    #[must_use]
    pub fn png(&self) -> Vec<u8> {
        let mut file = Vec::new();
        let edge = |dots: usize| u32::try_from(dots).expect("at most 8192 dots");
        let mut encoder = png::Encoder::new(&mut file, edge(self.width), edge(self.height));
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header().expect("a header of a valid size");
        writer.write_image_data(self.dots.as_flattened()).expect("as many bytes as the header says");
        writer.finish().expect("writing into memory");
        file
    }
}
