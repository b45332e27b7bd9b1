//! The two plainest ways to cut a map into rooms, to compare with.

use local_grid::Grid;

use crate::{
    components::components,
    distance::DistanceField,
    numbering::number,
    options::SegmentError,
    plane::Plane,
    segment::crop::{Cropped, crop, write_back},
    segment::watershed::{flood, watershed},
};

/// Cuts free space wherever it is narrower than `width` metres and grows the parts back; 1.1 m is between doors and
/// corridors. Parts below `least_area` square metres are not kept. No furniture is removed.
///
/// # Errors
///
/// More than 65535 regions.
pub fn by_opening(free: &Grid<f32>, width: f64, least_area: f64) -> Result<Grid<u16>, SegmentError> {
    baseline(free, least_area, |plane, field, meter| {
        let limit = (width / 2.0 * meter).powi(2);
        let mut wide = plane.clone();
        wide.cells
            .iter_mut()
            .zip(&field.squared.cells)
            .for_each(|(cell, &squared)| *cell &= f64::from(squared) > limit);
        components(&wide, 0).labels(plane.rows, plane.columns)
    })
}

/// Watershed of the distance to walls: basins that are less than `depth` metres deep, or whose border is wider than `ratio`
/// of the narrower basin, are merged. Parts below `least_area` square metres are not kept. No furniture is removed.
///
/// # Errors
///
/// More than 65535 regions.
pub fn by_distance(free: &Grid<f32>, depth: f64, ratio: f64, least_area: f64) -> Result<Grid<u16>, SegmentError> {
    baseline(free, least_area, |_, field, meter| watershed(field, depth * meter, ratio))
}

fn baseline(
    free: &Grid<f32>,
    least_area: f64,
    cut: impl Fn(&Plane<bool>, &DistanceField, f64) -> Plane<u32>,
) -> Result<Grid<u16>, SegmentError> {
    let mut out = Grid::new(*free.frame());
    if let Some(Cropped { plane, origin }) = crop(free, 0.5) {
        let meter = 1.0 / free.frame().resolution();
        let field = DistanceField::new(&plane);
        let mut labels = cut(&plane, &field, meter);
        flood(&plane, &field, &mut labels);
        let numbered = number(&labels, least_area * meter * meter)?;
        write_back(&numbered.labels, origin, &mut out);
    }
    Ok(out)
}
