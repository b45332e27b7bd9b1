//! What counts as a room, and where it ends.

use std::collections::BTreeSet;

use approx::assert_abs_diff_eq;
use rand::{RngExt as _, SeedableRng as _};
use region_map::{Options, RegionMap, local_grid::Grid, segment};

use crate::plans::{corridor_with_rooms, draw, two_rooms};

fn regions(free: &Grid<f32>) -> RegionMap {
    segment(free, &Options::default()).expect("the options are the defaults")
}

/// How many regions each region leads to, sorted.
fn degrees(map: &RegionMap) -> Vec<usize> {
    let neighbours = |label: u16| {
        let pairs = map.gateways.iter().filter(|gateway| gateway.regions.contains(&label));
        pairs.map(|gateway| gateway.regions).collect::<BTreeSet<_>>().len()
    };
    let mut degrees: Vec<usize> = map.regions.iter().map(|region| neighbours(region.label)).collect();
    degrees.sort_unstable();
    degrees
}

#[test]
fn two_rooms_and_a_door_are_two_regions_and_a_gateway() {
    let map = regions(&draw(&two_rooms(0.9), 0.05, 0.0));
    assert_eq!(degrees(&map), [1, 1]);
    let door = &map.gateways[0];
    assert_abs_diff_eq!(door.width, 0.9, epsilon = 0.15);
    assert_abs_diff_eq!(door.center.x, 4.1, epsilon = 0.15);
    assert_abs_diff_eq!(door.center.y, 2.0, epsilon = 0.1);
    assert_abs_diff_eq!(door.normal.x.abs(), 1.0, epsilon = 0.05);
    assert_abs_diff_eq!(door.confidence, 1.0, epsilon = 1e-6);
    let across = map.region(door.regions[1]).unwrap().centroid - map.region(door.regions[0]).unwrap().centroid;
    assert!(door.normal.dot(&across) > 0.0, "the normal points into the second region");
    for region in &map.regions {
        assert_abs_diff_eq!(region.area, 16.0, epsilon = 0.3);
        assert_abs_diff_eq!(region.length, 4.0, epsilon = 0.15);
        assert!(region.room > 0.99);
    }
}

/// An opening of half the width of both rooms is a gateway, one of nearly their whole width is none.
#[test]
fn a_wide_opening_parts_rooms_only_while_it_is_a_bottleneck() {
    assert_eq!(regions(&draw(&two_rooms(2.0), 0.05, 0.0)).regions.len(), 2);
    assert_eq!(regions(&draw(&two_rooms(3.4), 0.05, 0.0)).regions.len(), 1);
}

#[test]
fn a_corridor_with_six_rooms_is_a_star_however_it_lies() {
    for turn in [0.0, 33_f64.to_radians(), 71_f64.to_radians()] {
        for resolution in [0.05, 0.1, 0.2] {
            let map = regions(&draw(&corridor_with_rooms(), resolution, turn));
            assert_eq!(degrees(&map), [1, 1, 1, 1, 1, 1, 6], "resolution {resolution}, turn {turn}");
            assert_eq!(map.gateways.len(), 6, "resolution {resolution}, turn {turn}");
            let corridors: Vec<_> = map.regions.iter().filter(|region| region.corridor > 0.5).collect();
            assert_eq!(corridors.len(), 1);
            assert_abs_diff_eq!(corridors[0].width, 2.0, epsilon = 0.25);
            assert_abs_diff_eq!(corridors[0].length, 13.0, epsilon = 0.5);
            let lies = corridors[0].orientation - turn;
            assert_abs_diff_eq!(lies.tan(), 0.0, epsilon = resolution / 6.5); // a cell over half the length
        }
    }
}

#[test]
fn salt_and_pepper_change_no_region() {
    for (turn, resolution) in [(0.0, 0.05), (33_f64.to_radians(), 0.05), (0.0, 0.1)] {
        let mut free = draw(&corridor_with_rooms(), resolution, turn);
        let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(11);
        for cell in free.cells_mut() {
            if rng.random_bool(0.02) {
                *cell = 1.0 - *cell;
            }
        }
        assert_eq!(degrees(&regions(&free)), [1, 1, 1, 1, 1, 1, 6], "turn {turn}, resolution {resolution}");
    }
}

#[test]
fn chairs_tables_and_cupboards_change_no_region() {
    let mut free = draw(&corridor_with_rooms(), 0.05, 0.0);
    let mut put = |x0: f64, y0: f64, x1: f64, y1: f64| {
        let frame = *free.frame();
        for row in 0..frame.rows() {
            for column in 0..frame.columns() {
                let p = frame.center(row, column);
                if (x0..x1).contains(&p.x) && (y0..y1).contains(&p.y) {
                    *free.get_mut(row, column).unwrap() = 0.0;
                }
            }
        }
    };
    for (x, y) in [(1.0, 1.0), (1.2, 1.0), (1.0, 1.2), (1.2, 1.2), (2.0, 1.4), (2.0, 2.4), (3.0, 1.4), (3.0, 2.4)] {
        put(x, y, x + 0.06, y + 0.06); // a chair and a table
    }
    put(5.0, 0.0, 5.5, 1.2); // a cupboard at a wall
    put(9.4, 3.0, 10.0, 3.6); // a plant
    assert_eq!(degrees(&regions(&free)), [1, 1, 1, 1, 1, 1, 6]);
}

#[test]
fn labels_part_the_free_cells() {
    let free = draw(&corridor_with_rooms(), 0.05, 33_f64.to_radians());
    let map = regions(&free);
    for (&label, &membership) in map.labels.cells().iter().zip(free.cells()) {
        assert_eq!(label > 0, membership > 0.5);
        assert!(usize::from(label) <= map.regions.len());
    }
    let total: f64 = map.regions.iter().map(|region| region.area).sum();
    assert_abs_diff_eq!(total, free.cells().iter().sum::<f32>() as f64 * 0.05 * 0.05, epsilon = 1e-6);
}

#[test]
fn a_rectangle_has_its_length_width_and_direction() {
    for degrees in [0.0_f64, 33.0, 120.0] {
        let map = regions(&draw(&[([0.0, 0.0], [8.0, 2.0])], 0.05, degrees.to_radians()));
        let [region] = &map.regions[..] else { panic!("{} regions", map.regions.len()) };
        assert_abs_diff_eq!(region.length, 8.0, epsilon = 0.05);
        assert_abs_diff_eq!(region.width, 2.0, epsilon = 0.05);
        assert_abs_diff_eq!(region.elongation, 4.0, epsilon = 0.1);
        assert_abs_diff_eq!((2.0 * (region.orientation - degrees.to_radians())).sin(), 0.0, epsilon = 0.01);
        assert!(region.corridor > 0.9);
    }
}

#[test]
fn maps_without_space_have_no_regions() {
    let mut free = draw(&[([0.0, 0.0], [0.5, 0.5])], 0.1, 0.0);
    assert_eq!(regions(&free).regions, []); // smaller than any region
    free.cells_mut().fill(0.0);
    assert_eq!(regions(&free).regions, []);
    free.cells_mut().fill(f32::NAN);
    assert_eq!(regions(&free).regions, []);
    free.cells_mut().fill(1.0);
    assert_eq!(regions(&free).regions.len(), 1);
}

#[test]
fn options_that_mean_nothing_are_refused() {
    let free = draw(&[([0.0, 0.0], [4.0, 4.0])], 0.1, 0.0);
    for options in [
        Options { threshold: f32::NAN, ..Options::default() },
        Options { furniture: -1.0, ..Options::default() },
        Options { widest_gateway: f64::INFINITY, ..Options::default() },
        Options { least_area: f64::NAN, ..Options::default() },
        Options { narrowest_region: -0.1, ..Options::default() },
    ] {
        let error = segment(&free, &options).unwrap_err().to_string();
        assert!(error.starts_with("option ") && error.contains("must be"), "{error}");
    }
}

/// Behind the dotted wall of a corridor readings show a strip of empty space, joined with it by a hole or not.
#[test]
fn a_strip_in_which_nobody_can_stand_is_no_region() {
    let (corridor, strip, hole) = (([0.0, 0.0], [8.0, 1.5]), ([0.0, 1.7], [8.0, 2.1]), ([3.0, 1.5], [3.5, 1.7]));
    for floor in [vec![corridor, strip], vec![corridor, strip, hole]] {
        let free = draw(&floor, 0.05, 0.0);
        let with = |narrowest_region| segment(&free, &Options { narrowest_region, ..Options::default() }).unwrap();
        assert_eq!(with(0.0).regions.len(), 2, "of {} parts", floor.len());
        let map = with(Options::default().narrowest_region);
        assert_eq!((map.regions.len(), map.gateways.len()), (1, 0), "of {} parts", floor.len());
        assert_abs_diff_eq!(map.regions[0].width, 1.5, epsilon = 0.1);
        assert_eq!(map.labels.at([6.0, 1.9].into()), Some(&0), "the strip belongs to nothing");
    }
}

/// A map that a robot built: nothing is quite free and nothing quite a wall.
#[test]
fn fuzzy_memberships_serve_as_well_and_say_how_sure_a_gateway_is() {
    let mut free = draw(&corridor_with_rooms(), 0.1, 0.0);
    let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(5);
    for cell in free.cells_mut() {
        *cell = if *cell > 0.5 { rng.random_range(0.6..0.9) } else { rng.random_range(0.0..0.4) };
    }
    let map = regions(&free);
    assert_eq!(degrees(&map), [1, 1, 1, 1, 1, 1, 6]);
    for gateway in &map.gateways {
        assert_abs_diff_eq!(gateway.confidence, 0.75, epsilon = 0.08);
    }
    let room = map.regions.iter().find(|region| region.room > 0.9).expect("a room");
    assert_abs_diff_eq!(room.area, 0.75 * 16.0, epsilon = 0.5); // memberships count
}

/// Noise is no map, and must not take for ever either.
#[test]
fn noise_is_cut_in_bounded_time() {
    let mut rng = rand_pcg::Pcg64Mcg::seed_from_u64(2);
    for (resolution, share) in [(0.05, 0.5), (0.05, 0.9), (0.2, 0.9), (0.2, 0.97)] {
        let mut free = draw(&[([0.0, 0.0], [400.0 * resolution, 400.0 * resolution])], resolution, 0.0);
        free.cells_mut().iter_mut().for_each(|cell| *cell *= f32::from(u8::from(rng.random_bool(share))));
        let map = regions(&free);
        assert!(map.regions.len() < 20_000);
    }
}

/// Makes a rectangle wall, corners in metres.
fn wall(free: &mut Grid<f32>, low: [f64; 2], high: [f64; 2]) {
    let frame = *free.frame();
    for row in 0..frame.rows() {
        for column in 0..frame.columns() {
            let p = frame.center(row, column);
            if (low[0]..high[0]).contains(&p.x) && (low[1]..high[1]).contains(&p.y) {
                free.cells_mut()[row * frame.columns() + column] = 0.0;
            }
        }
    }
}

/// What a robot's sensors make of a copier in a corridor: a narrow spot of less than a metre.
#[test]
fn in_a_robots_map_a_narrow_spot_in_a_corridor_is_no_door() {
    let mut free = draw(&corridor_with_rooms(), 0.1, 0.0);
    wall(&mut free, [5.0, 5.2], [6.0, 6.4]);
    assert_eq!(segment(&free, &Options::default()).unwrap().regions.len(), 8, "in a drawn map it parts the corridor");
    let map = segment(&free, &Options::robot_map()).unwrap();
    assert_eq!(degrees(&map), [1, 1, 1, 1, 1, 1, 6]);
    assert_eq!(map.gateways.len(), 6);
}

#[test]
fn a_large_table_parts_no_room_of_a_robots_map() {
    for turn in [0.0, 33_f64.to_radians()] {
        let mut free = draw(&[([0.0, 0.0], [6.0, 4.0]), ([6.2, 0.0], [9.0, 4.0]), ([6.0, 1.6], [6.2, 2.5])], 0.1, turn);
        let table = draw(&[([2.2, 1.2], [4.0, 2.8]), ([0.0, 0.0], [0.1, 0.1]), ([8.9, 3.9], [9.0, 4.0])], 0.1, turn);
        for (cell, table) in free.cells_mut().iter_mut().zip(table.cells()) {
            *cell -= table;
        }
        let map = segment(&free, &Options::robot_map()).unwrap();
        assert_eq!(degrees(&map), [1, 1], "turned by {turn}");
    }
}

/// Echoes dot a wall; as long as nobody passes between the dots it is one.
#[test]
fn a_dotted_wall_parts_rooms_of_a_robots_map() {
    let mut free = draw(&[([0.0, 0.0], [8.0, 4.0])], 0.1, 0.0);
    for k in 0..8 {
        let y = 0.1 + 0.5 * f64::from(k);
        if !(1.5..2.4).contains(&y) {
            wall(&mut free, [3.9, y], [4.2, y + 0.3]);
        }
    }
    let map = segment(&free, &Options::robot_map()).unwrap();
    assert_eq!(degrees(&map), [1, 1]);
}
