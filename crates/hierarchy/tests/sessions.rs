use hierarchy::{Config, Mapper, SessionError};

use crate::logs::{map, office_loop};

fn stored(mapper: &Mapper) -> Vec<u8> {
    let mut bytes = Vec::new();
    mapper.save(&mut bytes).unwrap();
    bytes
}

#[test]
fn a_session_read_back_is_the_same_map() {
    let mapper = map(&office_loop(), Config::default());
    let bytes = stored(&mapper);
    let read = Mapper::load(&mut bytes.as_slice()).unwrap();
    assert!(stored(&read) == bytes, "writing again gives other bytes");
    assert!(read.poses() == mapper.poses());
    assert!(read.gridmap().unwrap() == mapper.gridmap().unwrap());
    let signatures =
        |mapper: &Mapper| mapper.topology().places().iter().map(|p| p.signature().cloned()).collect::<Vec<_>>();
    let (one, two) = (signatures(&read), signatures(&mapper));
    let same = one.iter().zip(&two).filter(|(one, two)| one == two).count();
    assert!(same + 2 >= one.len(), "{same} of {} signatures are drawn again alike", one.len());
}

#[test]
fn a_map_goes_on_where_it_was_stored() {
    let log = office_loop();
    let mut first = Mapper::new(Config::default()).unwrap();
    let (one, two) = log.split_at(log.len() / 2);
    for entry in one {
        first.push(entry).unwrap();
    }
    let mut second = Mapper::load(&mut stored(&first).as_slice()).unwrap();
    for entry in two {
        first.push(entry).unwrap();
        second.push(entry).unwrap();
    }
    assert_eq!(first.topology().n_visited(), second.topology().n_visited());
    assert_eq!(first.tally().entries, second.tally().entries);
    assert!(second.closures().iter().any(|c| matches!(c.verdict, hierarchy::Verdict::Accepted { .. })));
}

#[test]
fn names_outlive_the_program() {
    let mut mapper = map(&office_loop()[..400], Config::default());
    assert!(mapper.name(topo_map::PlaceId(0), "dock"));
    assert!(!mapper.name(topo_map::PlaceId(9999), "nowhere"));
    let read = Mapper::load(&mut stored(&mapper).as_slice()).unwrap();
    assert_eq!(read.names().collect::<Vec<_>>(), [(topo_map::PlaceId(0), "dock")]);
}

#[test]
fn what_is_no_session_is_refused_by_its_fault() {
    let bytes = stored(&map(&office_loop()[..400], Config::default()));
    let load = |bytes: &[u8]| Mapper::load(&mut &*bytes).map(|_| ()).unwrap_err();
    assert!(matches!(load(b"FLASER 180 1.0"), SessionError::NoSession));
    assert!(matches!(load(b""), SessionError::NoSession));
    assert!(matches!(load(&bytes[..bytes.len() - 7]), SessionError::CutOff { .. }));
    let mut damaged = bytes.clone();
    let middle = damaged.len() / 2;
    damaged[middle] ^= 0x10;
    assert!(matches!(load(&damaged), SessionError::Damaged { .. }));
    let mut newer = bytes.clone();
    newer[4] = 9;
    assert!(matches!(load(&newer), SessionError::TooNew { found: 9 }));
    let mut huge = bytes;
    huge[6..14].copy_from_slice(&u64::MAX.to_le_bytes());
    assert!(matches!(load(&huge), SessionError::TooLarge { .. }));
}

#[test]
fn sessions_of_every_version_are_read_for_ever() {
    for (version, entries) in [(1, 300), (2, 1500)] {
        let mapper = golden(version);
        let again = map_prefix(entries);
        assert_eq!(mapper.topology().n_visited(), again.topology().n_visited());
        let apart = |(a, b): (&nalgebra::Isometry2<f64>, &nalgebra::Isometry2<f64>)| {
            (a.translation.vector - b.translation.vector).norm()
        };
        assert!(mapper.poses().iter().zip(&again.poses()).map(apart).all(|apart| apart < 1e-9));
    }
}

#[test]
fn an_old_session_is_written_anew_with_all_that_it_holds() {
    let old = golden(1);
    let read = Mapper::load(&mut stored(&old).as_slice()).unwrap();
    assert_eq!(read.poses(), old.poses());
    assert_eq!(read.closures(), old.closures());
    assert_eq!(*read.floor_plan(), hierarchy::FloorPlan::default());
}

#[test]
fn a_stored_session_knows_its_rooms() {
    let mapper = golden(2);
    let plan = mapper.floor_plan();
    assert_eq!(plan.regions.iter().filter_map(|region| region.name.as_deref()).collect::<Vec<_>>(), ["hall"]);
    assert_eq!(plan.gateways[0].passage, hierarchy::Passage::Closed);
    let again = Mapper::load(&mut stored(&mapper).as_slice()).unwrap();
    assert_eq!(again.floor_plan(), plan);
}

/// The shipped session of a version.
fn golden(version: u16) -> Mapper {
    let path = format!("{}/../../fixtures/sessions/v{version}.hmap", env!("CARGO_MANIFEST_DIR"));
    Mapper::load(&mut std::fs::File::open(path).unwrap()).unwrap()
}

/// The map of the first entries of the shipped log, not yet finished.
fn map_prefix(entries: usize) -> Mapper {
    let mut mapper = Mapper::new(Config::default()).unwrap();
    for entry in &office_loop()[..entries] {
        mapper.push(entry).unwrap();
    }
    mapper
}
