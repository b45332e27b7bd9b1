use std::f64::consts::FRAC_PI_2;

use crate::front_end::Direction;

/// The building's direction by which the map was measured.
///
/// A robot that has driven few metres knows north as well as its compass does, and holds a heading along walls that is
/// wrong by as much: by 3° to 9° over the first twenty metres of an office, less and less later. So the first row of a
/// corridor came to lie askew to the next one, a metre and more at its end, where no closure could say which is right. What
/// the robot learns of the building's direction on its way holds for the headings of before as well: the map turns with it.
#[derive(Debug, Default)]
pub(super) struct Building {
    first: Option<Learning>,
}

/// The first direction that held the heading.
#[derive(Debug, Clone, Copy)]
struct Learning {
    /// That direction in radians, modulo 90°, as the map was measured by it.
    measured: f64,
    /// How many walls had taught it.
    taught: u32,
    /// Whether another one was begun with since.
    anew: bool,
}

/// The map is turned when it is off by so much, in radians.
const ASKEW: f64 = 0.003;

impl Building {
    /// By how many radians the map should be turned, now that this is known of the building's direction.
    ///
    /// Only the first direction that holds the heading turns it, and only while it does. One that was begun with anew is that
    /// of other walls: what is learnt of it says nothing of headings of before, and by then compass and closures hold the map.
    pub(super) fn learn(&mut self, now: &Direction) -> Option<f64> {
        let Some(Learning { measured, taught, anew }) = &mut self.first else {
            self.first = now.holds.then(|| Learning::of(now));
            return None;
        };
        *anew |= now.walls < std::mem::replace(taught, now.walls);
        let turn = now.radians - *measured;
        let turn = turn - FRAC_PI_2 * (turn / FRAC_PI_2).round();
        let turns = now.holds && !*anew && turn.abs() >= ASKEW;
        turns.then(|| {
            *measured = now.radians;
            turn
        })
    }
}

impl Learning {
    fn of(now: &Direction) -> Self {
        Self { measured: now.radians, taught: now.walls, anew: false }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn taught(radians: f64, walls: u32) -> Direction {
        Direction { radians, walls, holds: true }
    }

    #[test]
    fn small_lessons_add_up_before_they_turn_the_map() {
        let mut building = Building::default();
        assert_eq!(building.learn(&taught(0.500, 3)), None, "the map begins as it was measured");
        assert_eq!(building.learn(&taught(0.502, 4)), None);
        approx::assert_relative_eq!(building.learn(&taught(0.504, 5)).unwrap(), 0.004, epsilon = 1e-12);
        assert_eq!(building.learn(&taught(0.504, 6)), None);
    }

    #[test]
    fn walls_a_quarter_round_teach_the_same() {
        let mut building = Building::default();
        building.learn(&taught(0.1, 3));
        approx::assert_relative_eq!(building.learn(&taught(0.11 - FRAC_PI_2, 4)).unwrap(), 0.01, epsilon = 1e-12);
    }

    #[test]
    fn another_wing_turns_nothing() {
        let mut building = Building::default();
        building.learn(&taught(0.1, 30));
        assert_eq!(building.learn(&taught(0.4, 3)), None, "learnt anew");
        assert_eq!(building.learn(&taught(0.41, 4)), None);
    }

    #[test]
    fn walls_learnt_anew_turn_nothing_though_it_takes_them_long_to_hold() {
        let mut building = Building::default();
        building.learn(&taught(0.1, 8));
        for walls in 1..20 {
            assert_eq!(building.learn(&Direction { radians: 0.4, walls, holds: false }), None);
        }
        assert_eq!(building.learn(&taught(0.4, 20)), None);
    }
}
