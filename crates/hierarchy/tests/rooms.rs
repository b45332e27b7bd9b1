use hierarchy::{Config, Mapper};
use topo_map::PlaceId;

use crate::logs::office_loop;

#[test]
fn a_room_keeps_its_name_while_the_map_grows() {
    let log = office_loop();
    let (first, rest) = log.split_at(1500);
    let mut mapper = Mapper::new(Config::default()).unwrap();
    first.iter().for_each(|entry| drop(mapper.push(entry).unwrap()));
    let mut map = mapper.survey(&mapper.gridmap().unwrap()).unwrap();
    let (place, label) = mapper.places_in(&map).into_iter().find_map(|(place, label)| Some((place, label?))).unwrap();
    mapper.name_region(&mut map, label, "dock").unwrap();
    assert!(mapper.name_region(&mut map, 999, "nowhere").is_err());

    rest.iter().for_each(|entry| drop(mapper.push(entry).unwrap()));
    mapper.finish().unwrap();
    let map = mapper.survey(&mapper.gridmap().unwrap()).unwrap();
    let dock = map.find("dock").expect("the name is still there").label;
    assert!(mapper.places_in(&map).contains(&(place, Some(dock))), "place {place:?} is no longer in the dock");
    assert!(mapper.places_in(&map).len() > 100);
    assert_eq!(mapper.places_in(&map)[0].0, PlaceId(0));
}
