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
    let labels: Vec<u16> = map.regions.iter().map(|region| region.label).collect();
    for label in &labels {
        mapper.name_region(&mut map, *label, &format!("room {label}")).unwrap();
    }
    let homes = mapper.places_in(&map);
    assert!(mapper.name_region(&mut map, 999, "nowhere").is_err());

    rest.iter().for_each(|entry| drop(mapper.push(entry).unwrap()));
    mapper.finish().unwrap();
    let map = mapper.survey(&mapper.gridmap().unwrap()).unwrap();
    // Two small parts may have become one hall, which takes one name; of what kept its name the places are still in it.
    let kept: Vec<_> = labels.iter().filter_map(|old| Some((*old, map.find(&format!("room {old}"))?.label))).collect();
    assert!(!kept.is_empty(), "no name is left of {}", labels.len());
    for (old, new) in kept {
        let of_old = homes.iter().filter(|(_, label)| *label == Some(old)).map(|(place, _)| *place);
        let of_old: Vec<PlaceId> = of_old.collect();
        let now = mapper.places_in(&map);
        let still = of_old.iter().filter(|place| now.contains(&(**place, Some(new)))).count();
        assert!(2 * still >= of_old.len(), "{still} of {} places of room {old} are still in it", of_old.len());
    }
    assert!(mapper.places_in(&map).len() > 100);
    assert_eq!(mapper.places_in(&map)[0].0, PlaceId(0));
}
