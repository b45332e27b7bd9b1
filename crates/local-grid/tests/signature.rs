//! Signatures: what they count, how they are cut, what they survive.

use local_grid::nalgebra::{Isometry2, Point2, Vector2};
use local_grid::{CellClass, Evidence, FuzzyGrid, GridFrame, Signature, SignatureOptions};

use crate::plan::{room, seen};

#[test]
fn every_bin_counts_all_its_cells() {
    let signature = seen(room, Isometry2::identity(), 6.4);
    assert_eq!(signature.rows().len(), 64);
    let mut totals = [[0, 0, 0]; 2];
    for (axis, total) in [signature.rows(), signature.columns()].iter().zip(&mut totals) {
        for count in *axis {
            assert_eq!(count.occupied + count.empty + count.unknown, 64);
            *total = [total[0] + count.occupied, total[1] + count.empty, total[2] + count.unknown];
        }
    }
    assert_eq!(totals[0], totals[1]);
    assert!(totals[0][0] > 100);
}

#[test]
fn histograms_find_a_shift_of_three_cells() {
    let a = seen(room, Isometry2::identity(), 6.4);
    let b = seen(room, Isometry2::translation(0.3, -0.2), 6.4);
    let found = a.histogram_match(&b, 0.8);
    approx::assert_relative_eq!(found.offset, Vector2::new(0.3, -0.2), epsilon = 1e-9);
    assert!(found.likelihood(4.0) > 0.6, "{found:?}");
    assert_eq!(a.histogram_match(&a, 0.8).likelihood(4.0), 1.0);
}

#[test]
fn cutting_keeps_where_the_place_lies_in_its_cell() {
    let frame = GridFrame::new(Point2::new(-4.2, -4.2), 0.1, 84, 84).unwrap();
    let mut grid = FuzzyGrid::new(frame);
    let wall = Point2::new(1.05, -0.55); // the centre of a cell
    let (row, column) = frame.cell_at(wall).unwrap();
    grid.get_mut(row, column).unwrap().occupied = 0.9;
    let place = Point2::new(0.337, 0.121);
    let signature = Signature::cut(&grid, place, &SignatureOptions::default());
    assert_eq!((signature.frame().rows(), signature.frame().columns()), (64, 64));
    let seen: Vec<_> = signature.walls().collect();
    assert_eq!(seen.len(), 1);
    approx::assert_relative_eq!(place + seen[0].coords, wall, epsilon = 1e-9);
}

#[test]
fn a_cut_over_the_border_is_unknown_there() {
    let grid = FuzzyGrid::new(GridFrame::new(Point2::origin(), 0.1, 10, 10).unwrap());
    let signature = Signature::cut(&grid, Point2::origin(), &SignatureOptions::default());
    assert_eq!(signature.known_share(), 0.0);
}

#[test]
fn weak_evidence_is_unknown() {
    let options = SignatureOptions::default();
    let class = |empty, occupied| options.class(Evidence { empty, occupied });
    assert_eq!(class(0.05, 0.08), CellClass::Unknown);
    assert_eq!(class(0.5, 0.5), CellClass::Unknown);
    assert_eq!(class(0.5, 0.1), CellClass::Empty);
    assert_eq!(class(0.1, 0.5), CellClass::Occupied);
}

#[test]
fn turning_the_robot_keeps_the_turn_invariant_descriptor() {
    let pose = |turn: f64| Isometry2::new(Vector2::new(0.1, 0.05), turn);
    let plain = seen(room, pose(0.0), 6.4);
    for degrees in [20.0f64, 90.0, 155.0] {
        let turned = seen(room, pose(degrees.to_radians()), 6.4);
        let same = plain.turn_invariant_descriptor().distance(&turned.turn_invariant_descriptor());
        let known = plain.descriptor().distance(&turned.descriptor());
        assert!(same < 0.12, "{degrees} degrees: {same}");
        assert!(same < 0.5 * known, "{degrees} degrees: {same} against {known}");
    }
}

#[cfg(feature = "serde")]
#[test]
fn signatures_survive_a_file() {
    let signature = seen(room, Isometry2::translation(0.123, 0.456), 6.4);
    let text = serde_json::to_string(&signature).unwrap();
    assert_eq!(serde_json::from_str::<Signature>(&text).unwrap(), signature);
    let broken = text.replacen("\"runs\":[[", "\"runs\":[[9", 1);
    assert!(serde_json::from_str::<Signature>(&broken).is_err());
}
