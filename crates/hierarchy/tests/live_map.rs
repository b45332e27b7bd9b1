use hierarchy::{Config, LiveMap, Mapper};

use crate::logs::office_loop;

#[test]
fn a_map_that_followed_equals_one_built_at_once() {
    let mut mapper = Mapper::new(Config::default()).unwrap();
    let mut live = LiveMap::new(mapper.config().grid.options()).unwrap();
    let (mut moved, mut all) = (0, 0);
    for (number, entry) in office_loop().iter().enumerate() {
        mapper.push(entry).unwrap();
        if number % 100 == 0 {
            moved += live.follow(&mapper, 0.05).unwrap().moved;
            all += mapper.poses().len();
        }
    }
    mapper.finish().unwrap();
    assert!(moved > 50, "closing the loop must move scans: {moved}");
    assert!(3 * moved < all, "what lies still must stay: {moved} of {all} fused again");
    let last = live.follow(&mapper, 0.0).unwrap();
    assert!(last.moved > 0, "slack must leave something to be done");
    assert!(live.follow(&mapper, 0.0).unwrap() == hierarchy::Followed::default());
    assert!(live.map().to_grid().unwrap() == mapper.gridmap().unwrap());
}
