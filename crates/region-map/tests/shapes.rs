//! What regions measure, where they end, and their outlines.

use approx::assert_abs_diff_eq;
use region_map::{
    Options, RegionMap,
    export::{write_geojson, write_labels, write_picture},
    local_grid::Grid,
    nalgebra::{Isometry2, Point2, Vector2},
    segment, segment_explored,
};

use crate::plans::{corridor_with_rooms, draw, two_rooms};

fn regions(free: &Grid<f32>) -> RegionMap {
    segment(free, &Options::default()).expect("the options are the defaults")
}

/// Moments say that an L is nearly as wide as long; measured along it, it is a corridor.
#[test]
fn a_bent_corridor_is_a_corridor() {
    let l = [([0.0, 0.0], [2.0, 12.0]), ([0.0, 0.0], [10.0, 2.0])];
    for turn in [0.0, 33_f64.to_radians()] {
        let map = regions(&draw(&l, 0.05, turn));
        assert_eq!(map.regions.len(), 1);
        let corridor = &map.regions[0];
        assert_abs_diff_eq!(corridor.width, 2.0, epsilon = 0.1);
        assert_abs_diff_eq!(corridor.length, 20.0, epsilon = 1.0);
        assert!(corridor.corridor > 0.9, "{corridor:?}");
        assert!(map.region_at(corridor.inside).is_some());
    }
}

/// Where a corridor opens into a hall, nothing pinches it; the hall begins all the same.
#[test]
fn a_corridor_ends_where_a_hall_begins() {
    let plan = [([0.0, 0.0], [8.0, 8.0]), ([8.0, 3.0], [18.0, 4.6])];
    for turn in [0.0, 33_f64.to_radians()] {
        let map = regions(&draw(&plan, 0.05, turn));
        assert_eq!(map.regions.len(), 2);
        assert_eq!(map.gateways.len(), 1);
        assert_abs_diff_eq!(map.gateways[0].width, 1.6, epsilon = 0.15);
        let corridor = map.regions.iter().find(|region| region.corridor > 0.5).expect("a corridor");
        assert_abs_diff_eq!(corridor.area, 16.0, epsilon = 1.0);
    }
}

/// So it does where one wall of the corridor runs on as a wall of the hall; but a niche beside a cupboard is no corridor.
#[test]
fn a_corridor_may_end_in_the_corner_of_a_hall() {
    let plan = |length: f64| [([0.0, 0.0], [8.0, 8.0]), ([8.0, 0.0], [8.0 + length, 1.6])];
    for turn in [0.0, 33_f64.to_radians()] {
        let map = regions(&draw(&plan(8.0), 0.05, turn));
        assert_eq!((map.regions.len(), map.gateways.len()), (2, 1));
        let hall = map.regions.iter().find(|region| region.room > 0.5).expect("a hall");
        assert_abs_diff_eq!(hall.area, 64.0, epsilon = 1.5);
        assert_eq!(regions(&draw(&plan(2.4), 0.05, turn)).regions.len(), 1);
    }
}

#[test]
fn a_border_on_the_unexplored_is_a_frontier() {
    let free = draw(&[([0.0, 0.0], [5.0, 4.0])], 0.1, 0.0);
    let frame = *free.frame();
    let mut unknown = Grid::<bool>::new(frame);
    for row in 0..frame.rows() {
        for column in 0..frame.columns() {
            // Nobody has looked beyond the right side.
            unknown.cells_mut()[row * frame.columns() + column] = frame.center(row, column).x > 5.0;
        }
    }
    let map = segment_explored(&free, &unknown, &Options::default()).unwrap();
    assert_abs_diff_eq!(map.regions[0].frontier, 4.0, epsilon = 0.2);
    assert_abs_diff_eq!(map.regions[0].wall, 14.0, epsilon = 0.4);
    assert_abs_diff_eq!(regions(&free).regions[0].wall, 18.0, epsilon = 0.4);
}

#[test]
fn outlines_hold_the_area_of_their_regions() {
    for turn in [0.0, 33_f64.to_radians()] {
        let mut free = draw(&corridor_with_rooms(), 0.05, turn);
        // A pillar too large to be furniture is a hole in its room.
        let frame = *free.frame();
        for row in 0..frame.rows() {
            for column in 0..frame.columns() {
                let p = frame.center(row, column) - Point2::new(6.5, 5.2);
                let back = region_map::nalgebra::Rotation2::new(-turn) * p;
                if (back.x - 4.6).abs() < 0.7 && (back.y + 3.6).abs() < 0.7 {
                    *free.get_mut(row, column).unwrap() = 0.0;
                }
            }
        }
        let map = regions(&free);
        let mut holes = 0;
        for (region, outline) in map.regions.iter().zip(map.outlines()) {
            assert_eq!(outline.parts.len(), 1);
            let part = &outline.parts[0];
            holes += part.holes.len();
            assert!(signed_area(&part.outer) > 0.0);
            let area: f64 = signed_area(&part.outer) + part.holes.iter().map(|hole| signed_area(hole)).sum::<f64>();
            assert_abs_diff_eq!(area, region.area, epsilon = 0.03 * region.area);
            assert!(part.outer.len() < 60, "{} corners", part.outer.len());
        }
        assert_eq!(holes, 1);
    }
}

fn signed_area(ring: &[Point2<f64>]) -> f64 {
    let next = ring.iter().cycle().skip(1);
    ring.iter().zip(next).map(|(a, b)| a.coords.perp(&b.coords)).sum::<f64>() / 2.0
}

#[test]
fn moving_a_region_turns_its_axis_and_its_places() {
    let map = regions(&draw(&two_rooms(0.9), 0.05, 0.0));
    let quarter = Isometry2::new(Vector2::new(1.0, 0.0), std::f64::consts::FRAC_PI_2);
    let gateway = map.gateways[0].moved(&quarter);
    assert_abs_diff_eq!(gateway.normal, quarter * map.gateways[0].normal);
    let turned = map.regions[0].moved(&quarter);
    assert!(turned.orientation.abs() <= std::f64::consts::FRAC_PI_2);
    assert_abs_diff_eq!(turned.centroid, quarter * map.regions[0].centroid);
}

#[test]
fn files_hold_what_was_found() {
    let free = draw(&two_rooms(0.9), 0.1, 0.0);
    let mut map = regions(&free);
    map.name(1, "a \"quoted\" \\ name").unwrap();
    let mut text = Vec::new();
    write_geojson(&mut text, &map, &Isometry2::identity()).unwrap();
    let text = String::from_utf8(text).unwrap();
    assert!(text.contains(r#""name":"a \"quoted\" \\ name""#), "{text}");
    assert_eq!(text.matches("\"kind\":\"region\"").count(), 2);
    assert_eq!(text.matches("\"kind\":\"gateway\"").count(), 1);

    let mut bytes = Vec::new();
    write_labels(&mut bytes, &map.labels).unwrap();
    let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
    let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut pixels).unwrap();
    let frame = map.labels.frame();
    assert_eq!((info.width as usize, info.height as usize), (frame.columns(), frame.rows()));
    let (row, column) = frame.cell_at(map.regions[1].inside).unwrap();
    let pixel = 2 * ((frame.rows() - 1 - row) * frame.columns() + column);
    assert_eq!(pixels[pixel..pixel + 2], [0, 2]); // 16 bits, big end first, highest row first

    let mut picture = Vec::new();
    write_picture(&mut picture, &map, &free).unwrap();
    let reader = png::Decoder::new(std::io::Cursor::new(picture)).read_info().unwrap();
    let (wide, high) = (reader.info().width as usize, reader.info().height as usize);
    // A small map is enlarged by a whole number, so that its labels can be read.
    assert_eq!((wide % frame.columns(), high / frame.rows()), (0, wide / frame.columns()));
    assert!(wide.max(high) >= 800, "{wide} x {high}");
}
