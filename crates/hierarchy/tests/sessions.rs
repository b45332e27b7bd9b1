use hierarchy::{Config, Mapper, SessionError};

use crate::logs::{entries, map, office_loop, shared, truth};

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
    if let Some(folder) = shared("laser/coreslam") {
        let log = entries(&[folder.join("exp1.dat")], Some("coreslam"));
        goes_on(&log[..300], &config, "by scans that stand askew");
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

/// What a shipped session held when it was written stands beside it: how many links and closures, then where its places were.
#[test]
fn sessions_of_every_version_are_read_for_ever() {
    for version in VERSIONS {
        let mapper = golden(version);
        let held = std::fs::read_to_string(shipped(version, "csv")).unwrap();
        let mut numbers = held.lines().skip(1).flat_map(|line| line.split(',')).map(|n| n.parse::<f64>().unwrap());
        let mut next = || numbers.next().unwrap();
        assert_eq!(mapper.topology().links().len() as f64, next(), "links of version {version}");
        assert_eq!(mapper.closures().len() as f64, next(), "closures of version {version}");
        assert_eq!(mapper.trajectory().samples().len() as f64, next(), "samples of version {version}");
        let positions = mapper.coordinates().positions();
        assert!(positions.len() > 4 && positions.len() == mapper.topology().n_visited());
        for place in positions {
            approx::assert_abs_diff_eq!(place.x, next(), epsilon = 1e-9);
            approx::assert_abs_diff_eq!(place.y, next(), epsilon = 1e-9);
        }
        assert!(numbers.next().is_none(), "version {version} held more places");
    }
}

#[test]
fn a_session_of_every_version_goes_on() {
    let log = office_loop();
    for version in VERSIONS {
        let mut mapper = golden(version);
        let (known, places) = (mapper.tally().entries, mapper.topology().n_visited());
        for entry in &log[known..known + 600] {
            mapper.push(entry).unwrap();
        }
        assert!(mapper.topology().n_visited() > places, "version {version} adds no place");
        let judged = truth(&log).judge(&mapper).unwrap();
        assert!(judged.after_m < judged.odometry_m.max(0.5), "version {version} loses its way: {judged:?}");
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
    for mapper in VERSIONS[1..].iter().map(|version| golden(*version)) {
        let plan = mapper.floor_plan();
        assert_eq!(plan.regions.iter().filter_map(|region| region.name.as_deref()).collect::<Vec<_>>(), ["hall"]);
        assert_eq!(plan.gateways[0].passage, hierarchy::Passage::Closed);
        let again = Mapper::load(&mut stored(&mapper).as_slice()).unwrap();
        assert_eq!(again.floor_plan(), plan);
    }
}

const VERSIONS: [u16; 6] = [1, 2, 3, 4, 5, 6];

/// The shipped session of a version.
fn golden(version: u16) -> Mapper {
    Mapper::load(&mut std::fs::File::open(shipped(version, "hmap")).unwrap()).unwrap()
}

fn shipped(version: u16, extension: &str) -> String {
    format!("{}/../../fixtures/sessions/v{version}.{extension}", env!("CARGO_MANIFEST_DIR"))
}
