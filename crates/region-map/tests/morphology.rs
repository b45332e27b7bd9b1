//! The laws of fuzzy morphology.

use proptest::prelude::*;
use region_map::{
    Element, Logic, dilate, erode,
    local_grid::{Grid, GridFrame},
    nalgebra::Point2,
    opening,
};

fn grid(rows: usize, columns: usize, cells: Vec<f32>) -> Grid<f32> {
    let frame = GridFrame::new(Point2::origin(), 0.1, rows, columns).expect("a small frame");
    Grid::from_cells(frame, cells).expect("as many cells as the frame has")
}

/// Memberships are multiples of 1/64 and so are those of the elements used here, so that no law is spoiled by rounding.
/// Around them lies a rim as wide as the largest element, so that none is spoiled by the end of the grid.
fn memberships() -> impl Strategy<Value = Grid<f32>> {
    prop::collection::vec(0_u8..=64, 7 * 9).prop_map(|inner| {
        let mut cells = vec![0.0; 13 * 15];
        for (index, &sixty_fourths) in inner.iter().enumerate() {
            cells[(index / 9 + 3) * 15 + index % 9 + 3] = f32::from(sixty_fourths) / 64.0;
        }
        grid(13, 15, cells)
    })
}

fn elements() -> [Element; 3] {
    // Radius 1 cell: the cone has memberships 1 and 1/2.
    [Element::disc(0.1, 0.1), Element::disc(0.25, 0.1), Element::cone(0.1, 0.1)]
}

proptest! {
    #[test]
    fn an_opening_takes_away_and_is_its_own_opening(map in memberships()) {
        for element in elements() {
            for logic in [Logic::Lukasiewicz, Logic::Goedel] {
                let opened = opening(&map, &element, logic);
                prop_assert!(opened.cells().iter().zip(map.cells()).all(|(o, m)| o <= m));
                prop_assert_eq!(&opening(&opened, &element, logic), &opened);
            }
        }
    }

    #[test]
    fn erosion_and_dilation_are_adjoint(a in memberships(), b in memberships()) {
        let below = |a: &Grid<f32>, b: &Grid<f32>| a.cells().iter().zip(b.cells()).all(|(a, b)| a <= b);
        for element in elements() {
            for logic in [Logic::Lukasiewicz, Logic::Goedel] {
                prop_assert_eq!(below(&dilate(&a, &element, logic), &b), below(&a, &erode(&b, &element, logic)));
                // Not only where both are false:
                prop_assert!(below(&a, &erode(&dilate(&a, &element, logic), &element, logic)));
            }
        }
    }

    #[test]
    fn flat_elements_know_no_logic(map in memberships()) {
        let element = Element::disc(0.2, 0.1);
        prop_assert_eq!(erode(&map, &element, Logic::Lukasiewicz), erode(&map, &element, Logic::Goedel));
        prop_assert_eq!(dilate(&map, &element, Logic::Lukasiewicz), dilate(&map, &element, Logic::Goedel));
    }
}

/// Where the popular pair of minimum and Kleene-Dienes implication puts one half, both adjoint pairs put nothing.
#[test]
fn a_hole_stays_a_hole() {
    let row = grid(1, 7, vec![1.0, 1.0, 1.0, 0.0, 1.0, 1.0, 1.0]);
    for logic in [Logic::Lukasiewicz, Logic::Goedel] {
        assert_eq!(opening(&row, &Element::cone(0.1, 0.1), logic).cells()[3], 0.0);
    }
}

#[test]
fn an_opening_closes_a_door_and_keeps_a_corridor() {
    // Two rooms, a wall of 1.4 m between them with a door of 0.9 m (11 to 19) and a passage of 1.4 m (24 to 37).
    let mut map = grid(40, 60, vec![0.0; 2400]);
    for row in 2..38 {
        for column in 2..58 {
            let wall = (24..38).contains(&column) && !(10..19).contains(&row) && !(24..38).contains(&row);
            map.cells_mut()[row * 60 + column] = if wall { 0.0 } else { 1.0 };
        }
    }
    let opened = opening(&map, &Element::disc(0.5, 0.1), Logic::default());
    assert_eq!(*opened.get(14, 31).unwrap(), 0.0); // in the door
    assert_eq!(*opened.get(31, 31).unwrap(), 1.0); // in the passage
    assert_eq!(*opened.get(20, 10).unwrap(), 1.0);
}
