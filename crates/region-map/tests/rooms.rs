//! What counts as a room, and where it ends.

use approx::assert_abs_diff_eq;
use region_map::{Options, segment};

use crate::plans::{draw, two_rooms};

#[test]
fn two_rooms_and_a_door_are_two_regions_and_a_gateway() {
    for turn in [0.0, 33_f64.to_radians()] {
        let map = segment(&draw(&two_rooms(0.9), 0.05, turn), &Options::default()).unwrap();
        assert_eq!(map.regions.len(), 2);
        assert_eq!(map.gateways.len(), 1);
        assert_abs_diff_eq!(map.gateways[0].width, 0.9, epsilon = 0.15);
        for region in &map.regions {
            assert_abs_diff_eq!(region.area, 16.0, epsilon = 0.6);
        }
    }
}
