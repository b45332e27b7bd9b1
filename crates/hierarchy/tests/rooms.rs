use hierarchy::{Config, Mapper};
use region_map::RegionMap;
use topo_map::PlaceId;

use crate::logs::office_loop;

#[test]
fn a_room_keeps_its_name_while_the_map_grows() {
    let log = office_loop();
    let (first, rest) = log.split_at(1500);
    let mut mapper = Mapper::new(Config::default()).unwrap();
    first.iter().for_each(|entry| drop(mapper.push(entry).unwrap()));
    let mut map = mapper.survey(&mapper.gridmap().unwrap()).unwrap();
    let label = mapper.places_in(&map).into_iter().find_map(|(_, label)| label).unwrap();
    let inside = |mapper: &Mapper, map: &RegionMap, label: u16| -> Vec<PlaceId> {
        let places = mapper.places_in(map).into_iter().filter(|(_, of)| *of == Some(label));
        places.map(|(place, _)| place).collect()
    };
    let before = inside(&mapper, &map, label);
    mapper.name_region(&mut map, label, "dock").unwrap();
    assert!(mapper.name_region(&mut map, 999, "nowhere").is_err());

    rest.iter().for_each(|entry| drop(mapper.push(entry).unwrap()));
    mapper.finish().unwrap();
    let map = mapper.survey(&mapper.gridmap().unwrap()).unwrap();
    let dock = map.find("dock").expect("the name is still there").label;
    let after = inside(&mapper, &map, dock);
    let still = before.iter().filter(|place| after.contains(place)).count();
    assert!(after.contains(&before[0]), "place {:?} is no longer in the dock", before[0]);
    assert!(2 * still > before.len(), "of {before:?} only {still} still lie in the dock");
    assert!(mapper.places_in(&map).len() > 100);
    assert_eq!(mapper.places_in(&map)[0].0, PlaceId(0));
}
