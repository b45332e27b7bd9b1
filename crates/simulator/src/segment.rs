use nalgebra::{Point2, Vector2};

/// What a surface is made of: how much of a sound it throws back like a mirror, how much it scatters, and whether
/// light goes through.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Material {
    /// Painted plaster, wood, doors: a mirror for ultrasound, a plain surface for light.
    #[default]
    Smooth,
    /// Brick, cloth, shelves full of things, people: a part of the sound comes back from any angle.
    Rough,
    /// Glass and polished steel: a perfect mirror for ultrasound; light goes through.
    Glass,
}

impl Material {
    /// The share of the amplitude that comes back from an oblique surface, before the cosine of the incidence.
    ///
    /// At the threshold of [`SonarModel`](crate::SonarModel) 0.03 is heard at a slant up to 0.9 m, 0.15 up to 2.5 m.
    pub(crate) fn roughness(self) -> f64 {
        match self {
            Self::Smooth => 0.03,
            Self::Rough => 0.15,
            Self::Glass => 0.0,
        }
    }

    /// The share of the amplitude that goes on after a mirror-like reflection.
    pub(crate) fn reflectivity(self) -> f64 {
        match self {
            Self::Smooth => 0.7,
            Self::Rough => 0.4,
            Self::Glass => 0.9,
        }
    }

    /// Whether light passes.
    pub(crate) fn is_transparent(self) -> bool {
        self == Self::Glass
    }
}

/// A straight piece of surface in the map frame, seen from both sides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment {
    /// One end, in metres.
    pub from: Point2<f64>,
    /// The other end, in metres.
    pub to: Point2<f64>,
    /// What it is made of.
    pub material: Material,
}

impl Segment {
    /// From end to end.
    pub(crate) fn along(&self) -> Vector2<f64> {
        self.to - self.from
    }

    /// Its length in metres.
    #[must_use]
    pub fn length(&self) -> f64 {
        self.along().norm()
    }

    /// The share of the way along the segment, in `[0, 1]`, of its point nearest to `point`.
    fn nearest_share(&self, point: Point2<f64>) -> f64 {
        let along = self.along();
        let squared = along.norm_squared();
        if squared == 0.0 { 0.0 } else { ((point - self.from).dot(&along) / squared).clamp(0.0, 1.0) }
    }

    /// Its point nearest to `point`.
    #[must_use]
    pub fn nearest(&self, point: Point2<f64>) -> Point2<f64> {
        self.from + self.along() * self.nearest_share(point)
    }

    /// Metres from `point` to the segment.
    #[must_use]
    pub fn distance(&self, point: Point2<f64>) -> f64 {
        (self.nearest(point) - point).norm()
    }

    /// The foot of the perpendicular from `point`, if it lies on the segment.
    pub(crate) fn foot(&self, point: Point2<f64>) -> Option<Point2<f64>> {
        let share = (point - self.from).dot(&self.along()) / self.along().norm_squared();
        (0.0..=1.0).contains(&share).then(|| self.from + self.along() * share)
    }

    /// Metres along the ray from `origin` in the unit direction `toward` to where it meets the segment, if it does.
    pub(crate) fn hit(&self, origin: Point2<f64>, toward: Vector2<f64>) -> Option<f64> {
        let along = self.along();
        let cross = toward.perp(&along);
        if cross.abs() < 1e-12 {
            return None; // parallel: a ray along a surface grazes it
        }
        let to_start = self.from - origin;
        let distance = to_start.perp(&along) / cross;
        let share = to_start.perp(&toward) / cross;
        // The share may miss the end by rounding; without the margin a ray could slip between two walls that meet.
        (distance >= 0.0 && (-1e-9..=1.0 + 1e-9).contains(&share)).then_some(distance)
    }

    /// The unit vector across the segment.
    pub(crate) fn normal(&self) -> Vector2<f64> {
        let along = self.along();
        Vector2::new(-along.y, along.x) / along.norm()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wall() -> Segment {
        Segment { from: Point2::new(2.0, -1.0), to: Point2::new(2.0, 3.0), material: Material::Smooth }
    }

    #[test]
    fn a_ray_meets_a_wall_where_geometry_says() {
        let hit = wall().hit(Point2::origin(), Vector2::new(0.8, 0.6)).unwrap();
        approx::assert_relative_eq!(hit, 2.5, epsilon = 1e-12); // 2 / 0.8
        assert_eq!(wall().hit(Point2::origin(), Vector2::new(-0.8, 0.6)), None); // behind
        assert_eq!(wall().hit(Point2::origin(), Vector2::new(0.0, 1.0)), None); // parallel
        assert_eq!(wall().hit(Point2::origin(), Vector2::new(0.3, 0.9).normalize()), None); // over the end
    }

    #[test]
    fn distance_is_to_the_nearest_point() {
        approx::assert_relative_eq!(wall().distance(Point2::new(0.5, 1.0)), 1.5);
        approx::assert_relative_eq!(wall().distance(Point2::new(-1.0, 7.0)), 5.0); // 3-4-5 to the end
        assert_eq!(wall().foot(Point2::new(0.0, 4.0)), None);
    }
}
