use hierarchy::{Config, Mapper, SessionError};

use crate::logs::{entries, map, office_loop, shared};

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

/// Maps a log that is stored and read back after each of `stops` entries.
fn resumed(log: &[robot_log::Entry], config: &Config, stops: &[usize]) -> Vec<u8> {
    let mut mapper = Mapper::new(config.clone()).unwrap();
    let mut known = 0;
    for &stop in stops {
        for entry in &log[known..stop] {
            mapper.push(entry).unwrap();
        }
        mapper = Mapper::load(&mut stored(&mapper).as_slice()).unwrap();
        known = mapper.tally().entries;
    }
    for entry in &log[known..] {
        mapper.push(entry).unwrap();
    }
    mapper.finish().unwrap();
    stored(&mapper)
}

/// Whether it does not matter where a log is interrupted.
fn goes_on(log: &[robot_log::Entry], config: &Config, what: &str) {
    let whole = resumed(log, config, &[]);
    let part = |share: usize| share * log.len() / 9;
    for stops in [[part(5)].as_slice(), &[0, part(3), part(4), part(7)]] {
        assert!(resumed(log, config, stops) == whole, "{what}: another map where it stops after {stops:?} entries");
    }
}

#[test]
fn a_resumed_map_is_the_uninterrupted_one() {
    let mut config = Config::default();
    goes_on(&office_loop()[..2600], &config, "with a compass");
    config.heading.source = hierarchy::HeadingMode::Structure;
    goes_on(&office_loop()[..1200], &config, "by the walls that sonars see");
}

#[test]
fn a_resumed_map_of_other_sensors_is_the_uninterrupted_one() {
    let config = Config::default();
    if let Some(folder) = shared("laser/intel") {
        let log = entries(&[folder.join("intel_raw.clf.gz")], None);
        goes_on(&log[..1500], &config, "by the fit of laser scans");
    }
    if let Some(folder) = shared("sonar/bigwheel") {
        let log = entries(&[folder.join("garden_15_03_20.csv")], Some("bigwheel"));
        goes_on(&log, &config, "by a gyro that drifts");
    }
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
    for (version, entries) in [(1, 300), (2, 1500), (3, 2500)] {
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
    for mapper in [golden(2), golden(3)] {
        let plan = mapper.floor_plan();
        assert_eq!(plan.regions.iter().filter_map(|region| region.name.as_deref()).collect::<Vec<_>>(), ["hall"]);
        assert_eq!(plan.gateways[0].passage, hierarchy::Passage::Closed);
        let again = Mapper::load(&mut stored(&mapper).as_slice()).unwrap();
        assert_eq!(again.floor_plan(), plan);
    }
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
