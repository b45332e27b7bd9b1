use std::io::{BufReader, Write};

use proptest::prelude::*;
use robot_log::{CarmenOptions, CarmenReader, LogErrorKind};

fn first_error(bytes: &[u8]) -> LogErrorKind {
    match CarmenReader::new("x", bytes, CarmenOptions::default()) {
        Err(error) => error.kind,
        Ok(log) => log.filter_map(Result::err).next().expect("an error").kind,
    }
}

fn gzip(text: &[u8]) -> Vec<u8> {
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    packed.write_all(text).unwrap();
    packed.finish().unwrap()
}

#[test]
fn files_that_are_no_log_are_refused_by_what_they_are() {
    assert!(matches!(first_error(b""), LogErrorKind::Empty));
    assert!(matches!(first_error(b"# only a comment\n\n"), LogErrorKind::Empty));
    assert!(matches!(first_error(b"\x7fELF\x02\x01\x01\0\0\0\0"), LogErrorKind::Binary));
    assert!(matches!(first_error(b"ODOM 1 2\0 3 0 0 0 1 h 1\nODOM"), LogErrorKind::Binary));
    assert!(matches!(first_error(b"12,13,14\n"), LogErrorKind::NeedsDescription));
    assert!(matches!(first_error(b"O 1 2 3 4\nL 1 2 3\n"), LogErrorKind::Foreign { messages } if messages == "L`, `O"));
    assert!(matches!(first_error(b"hello world\n"), LogErrorKind::Field { .. }));
}

#[test]
fn a_log_of_which_no_line_can_be_read_is_refused_with_the_first_of_them() {
    let log =
        CarmenReader::new("x", &b"o;1;2\nl;3;4\n"[..], CarmenOptions { lenient: true, ..CarmenOptions::default() });
    let error = log.unwrap().find_map(Result::err).expect("an error");
    assert!(matches!(&error.kind, LogErrorKind::Unread { lines: 2, first } if first.contains("x:1:1")), "{error}");
}

#[test]
fn zeros_in_a_line_spoil_that_line_only() {
    let line = b"ODOM 1 2 3 0 0 0 1 h 1\n";
    let text = [&line[..], b"ODOM 1 2 3 0 0\0\0\0\n", line].concat();
    assert!(matches!(first_error(&text), LogErrorKind::ZeroByte));
    let lenient = CarmenOptions { lenient: true, ..CarmenOptions::default() };
    let mut log = CarmenReader::new("x", text.as_slice(), lenient).unwrap();
    assert_eq!(log.by_ref().map(Result::unwrap).count(), 2);
    assert_eq!(log.report().errors[0].to_string(), "x:2:15: a zero byte stands in the line, expected text");
}

#[test]
fn a_directory_is_refused() {
    let folder = std::fs::File::open(env!("CARGO_MANIFEST_DIR")).unwrap();
    let error = CarmenReader::new("x", BufReader::new(folder), CarmenOptions::default()).unwrap_err();
    assert!(matches!(error.kind, LogErrorKind::Directory), "{error}");
}

#[test]
fn gzip_is_unpacked_member_by_member_and_damage_is_seen() {
    let line = b"ODOM 1 2 3 0 0 0 1 h 1\n";
    let members = [gzip(line), gzip(line)].concat();
    let log = CarmenReader::new("x", members.as_slice(), CarmenOptions::default()).unwrap();
    assert_eq!(log.map(Result::unwrap).count(), 2);
    let packed = gzip(&line.repeat(50_000));
    assert!(matches!(first_error(&packed[..packed.len() / 2]), LogErrorKind::Gzip(_)));
    assert!(matches!(first_error(&packed[..packed.len() - 3]), LogErrorKind::Gzip(_)));
    assert!(matches!(first_error(&packed[..5]), LogErrorKind::Gzip(_)));
    let mut flipped = packed.clone();
    let middle = flipped.len() / 2;
    flipped[middle] ^= 0x55;
    assert!(matches!(first_error(&flipped), LogErrorKind::Gzip(_) | LogErrorKind::Field { .. } | LogErrorKind::Binary));
}

#[test]
fn a_file_without_line_ends_is_given_up() {
    assert!(matches!(first_error(&b"ODOM 1 ".repeat(1_000_000)), LogErrorKind::LineTooLong { .. }));
}

#[test]
fn a_count_of_ranges_that_no_scanner_has_is_refused() {
    assert!(matches!(first_error(b"FLASER 18446744073709551615 1 2\n"), LogErrorKind::Field { .. }));
    assert!(matches!(first_error(b"FLASER 0 0 0 0 0 0 0 1 h 1\n"), LogErrorKind::Sensor(_)));
    assert!(matches!(first_error(b"SONAR 0.3 99999 1\n"), LogErrorKind::Field { .. }));
}

/// Reads to the end, whatever comes, both ways.
fn exhaust(bytes: &[u8]) {
    for lenient in [false, true] {
        if let Ok(log) = CarmenReader::new("x", bytes, CarmenOptions { lenient, ..CarmenOptions::default() }) {
            for entry in log.flatten() {
                assert!(entry.stamp.is_finite());
            }
        }
    }
}

proptest! {
    #[test]
    fn random_bytes_never_panic(bytes in proptest::collection::vec(any::<u8>(), 0..400)) {
        exhaust(&bytes);
    }

    #[test]
    fn random_words_never_panic(
        lines in proptest::collection::vec(
            proptest::collection::vec(
                prop_oneof![
                    Just("FLASER"), Just("ROBOTLASER1"), Just("RAWLASER3"), Just("SONAR"), Just("ODOM"), Just("IMU"), Just("PARAM"),
                    Just("TRUEPOS"), Just("0"), Just("1"), Just("2"), Just("-1"), Just("1e308"), Just("-1e308"), Just("nan"), Just("inf"),
                    Just("0.5"), Just("5e-324"), Just("sonar_max_range"), Just("é"), Just("\u{0}"),
                ],
                0..40,
            ),
            0..20,
        )
    ) {
        let text = lines.iter().map(|words| words.join(" ")).collect::<Vec<_>>().join("\n");
        exhaust(text.as_bytes());
    }

    #[test]
    fn a_log_with_one_byte_changed_never_panics(at in 0usize..300, byte in any::<u8>()) {
        let text = "PARAM sonar_max_range 4 n 0\nSONAR 0.4 2 1 2 0.1 0 0 0 0.1 1.57 1 h 1\nFLASER 3 1 2 3 0 0 0 0 0 0 1.5 h 1\n\
                    ROBOTLASER1 0 -1.5 3 1.5 20 0.01 0 3 1 2 3 0 1 0 0 1 0 0 0 0 0 0 0 2 h 2\nIMU 0 0 9 1 0 0 0 0 0 0 0 0 0 2 h 2\n\
                    TRUEPOS 1 2 3 1 2 3 3 h 3\nODOM 1 2 3 0 0 0 4 h 4\n";
        let mut bytes = text.as_bytes().to_vec();
        let at = at % bytes.len();
        bytes[at] = byte;
        exhaust(&bytes);
    }
}
