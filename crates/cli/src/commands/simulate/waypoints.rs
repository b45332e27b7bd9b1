use std::path::Path;

use simulator::nalgebra::Point2;

use super::world::read_text;
use crate::exit::Exit;
use crate::failure::{Failure, Place};

/// The points of a file: `x y` per line, in metres; blank lines and `#` comments are left out.
pub(super) fn read(path: &Path) -> Result<Vec<Point2<f64>>, Failure> {
    let mut points = Vec::new();
    for (line, text) in (1..).zip(read_text(path)?.lines()) {
        let text = text.split('#').next().unwrap_or_default().trim();
        if text.is_empty() {
            continue;
        }
        points.push(point(text).ok_or_else(|| {
            let message = format!("{}: expected two coordinates in metres, `x y`, found `{text}`", path.display());
            let place = Place { file: path.display().to_string(), line, ..Place::default() };
            Failure::new(Exit::Rejected, "waypoints.line", message).at(place)
        })?);
    }
    if points.is_empty() {
        let message = format!("could not use {}: it holds no waypoint", path.display());
        return Err(Failure::new(Exit::Rejected, "waypoints.empty", message));
    }
    Ok(points)
}

fn point(text: &str) -> Option<Point2<f64>> {
    let numbers: Vec<f64> = text
        .split(|c: char| c.is_whitespace() || c == ',')
        .filter(|word| !word.is_empty())
        .map(|word| word.parse().ok().filter(|number: &f64| number.abs() <= 1e4))
        .collect::<Option<_>>()?;
    let [x, y] = numbers.try_into().ok()?;
    Some(Point2::new(x, y))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_is_two_numbers() {
        assert_eq!(point("1.5 -2"), Some(Point2::new(1.5, -2.0)));
        assert_eq!(point("1.5, -2"), Some(Point2::new(1.5, -2.0)));
        for wrong in ["1", "1 2 3", "a b", "nan 0", "1e9 0"] {
            assert_eq!(point(wrong), None, "{wrong}");
        }
    }
}
