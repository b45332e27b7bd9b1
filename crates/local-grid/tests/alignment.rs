//! Alignment of signatures: exact where it can be, honest where it cannot.

use local_grid::nalgebra::{Isometry2, Point2, Vector2};
use local_grid::{AlignOptions, Ambiguity, CellClass, GridFrame, Signature, align};

use crate::plan::{corridor, room, seen};

#[test]
fn a_signature_shifted_by_three_cells_is_recovered_as_three_tenths() {
    let a = seen(room, Isometry2::identity(), 6.4);
    for (x, y) in [(0.3, 0.0), (0.0, -0.3), (-0.5, 0.7)] {
        let b = seen(room, Isometry2::translation(x, y), 6.4);
        let found = align(&a, &b, &AlignOptions::default());
        approx::assert_relative_eq!(found.offset, Vector2::new(x, y), epsilon = 0.005);
        assert_eq!(found.ambiguity, Ambiguity::None);
        assert!(found.score > 0.95 && found.contradiction < 0.02, "{found:?}");
        assert!(found.covariance[(0, 0)].sqrt() < 0.08, "{}", found.covariance);
    }
}

#[test]
fn shifts_below_a_cell_are_found() {
    let a = seen(room, Isometry2::identity(), 6.4);
    let b = seen(room, Isometry2::translation(0.243, -0.158), 6.4);
    let found = align(&a, &b, &AlignOptions::default());
    approx::assert_relative_eq!(found.offset, Vector2::new(0.243, -0.158), epsilon = 0.05);
}

#[test]
fn swapping_the_two_inverts_the_offset() {
    let a = seen(room, Isometry2::identity(), 6.4);
    let b = seen(room, Isometry2::translation(0.4, 0.2), 6.4);
    let (forth, back) = (align(&a, &b, &AlignOptions::default()), align(&b, &a, &AlignOptions::default()));
    approx::assert_relative_eq!(forth.offset, -back.offset, epsilon = 0.01);
    approx::assert_relative_eq!(forth.score, back.score, epsilon = 0.01);
}

#[test]
fn a_corridor_is_ambiguous_along_its_axis() {
    let a = seen(corridor, Isometry2::identity(), 6.4);
    for turn in [0.0, 0.6] {
        let a = if turn == 0.0 { a.clone() } else { seen(corridor, Isometry2::rotation(turn), 6.4) };
        let b = seen(corridor, Isometry2::new(Vector2::new(0.5, 0.2), turn), 6.4);
        let options = AlignOptions::default();
        let found = align(&a, &b, &options);
        let Ambiguity::Along(axis) = found.ambiguity else { panic!("{found:?}") };
        let expected = Vector2::new(turn.cos(), -turn.sin());
        assert!(axis.unit_vector().dot(&expected).abs() > 0.99, "{axis:?}");
        let position = found.covariance.fixed_view::<2, 2>(0, 0);
        let along = (expected.transpose() * position * expected)[0];
        approx::assert_relative_eq!(along, options.reach.powi(2) / 3.0, max_relative = 0.02);
        let across = Vector2::new(-expected.y, expected.x);
        approx::assert_relative_eq!(found.offset.dot(&across), 0.2, epsilon = 0.05);
        assert!((across.transpose() * position * across)[0].sqrt() < 0.1);
    }
}

#[test]
fn where_one_wall_can_lie_on_the_other_is_another_match_and_no_spread() {
    // Sonars often hear one wall of a corridor only: it fits on both.
    let one_wall = |point: Point2<f64>| if point.y > 0.5 { CellClass::Unknown } else { corridor(point) };
    let wide = AlignOptions { reach: 2.4, ..AlignOptions::default() };
    let found = align(
        &seen(corridor, Isometry2::identity(), 6.4),
        &seen(one_wall, Isometry2::translation(0.0, 0.2), 6.4),
        &wide,
    );
    let Ambiguity::Along(axis) = found.ambiguity else { panic!("{found:?}") };
    assert!(axis.unit_vector().x.abs() > 0.99, "{axis:?}");
    assert!([0.2, 2.3].iter().any(|y| (found.offset.y - y).abs() < 0.05), "{found:?}");
    assert!(found.covariance[(1, 1)].sqrt() < 0.1, "{}", found.covariance);
    assert!(found.distinctiveness() < 0.1, "but the other match is told of: {found:?}");
}

#[test]
fn turned_places_are_found_when_turns_are_searched() {
    let a = seen(room, Isometry2::identity(), 6.4);
    for (degrees, window) in [(12.0f64, 30.0f64), (-25.0, 30.0), (100.0, 180.0), (-170.0, 180.0)] {
        let truth = Isometry2::new(Vector2::new(0.35, -0.2), degrees.to_radians());
        let b = seen(room, truth, 6.4);
        let found = align(&a, &b, &AlignOptions { turn_window: window.to_radians(), ..AlignOptions::default() });
        let error = truth.inverse() * found.a_from_b();
        assert!(error.translation.vector.norm() < 0.06, "{degrees}: {found:?}");
        assert!(error.rotation.angle().abs() < 1.5f64.to_radians(), "{degrees}: {found:?}");
        assert!(found.distinctiveness() > 0.15, "{degrees}: {found:?}");
    }
}

#[test]
fn different_rooms_do_not_match() {
    let same = align(
        &seen(room, Isometry2::identity(), 6.4),
        &seen(room, Isometry2::translation(0.2, 0.3), 6.4),
        &AlignOptions::default(),
    );
    let other = align(
        &seen(room, Isometry2::identity(), 6.4),
        &seen(corridor, Isometry2::identity(), 6.4),
        &AlignOptions::default(),
    );
    assert!(other.score < 0.7 * same.score, "{other:?}");
    assert!(other.contradiction > 0.2, "{other:?}");
}

#[test]
fn nothing_to_compare_is_no_match() {
    let frame = GridFrame::new(Point2::new(-3.2, -3.2), 0.1, 64, 64).unwrap();
    let blank = Signature::from_classes(frame, vec![CellClass::Unknown; 64 * 64]).unwrap();
    let known = seen(room, Isometry2::identity(), 6.4);
    for (a, b) in [(&blank, &known), (&known, &blank), (&blank, &blank)] {
        let found = align(a, b, &AlignOptions::default());
        assert_eq!((found.score, found.ambiguity), (0.0, Ambiguity::Everywhere));
    }
}
