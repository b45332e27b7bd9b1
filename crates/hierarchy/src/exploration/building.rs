use std::f64::consts::FRAC_PI_2;

/// The building's direction by which the map was measured.
///
/// A robot that has driven few metres knows north as well as its compass does, and holds a heading along walls that is
/// wrong by as much: by 3° to 9° over the first twenty metres of an office, less and less later. So the first row of a
/// corridor came to lie askew to the next one, a metre and more at its end, where no closure could say which is right. What
/// the robot learns of the building's direction on its way holds for the headings of before as well: the map turns with it.
#[derive(Debug, Default)]
pub(super) struct Building {
    /// That direction in radians, modulo 90°, and how many walls had taught it.
    measured: Option<(f64, u32)>,
}

/// The map is turned when it is off by so much, in radians.
const ASKEW: f64 = 0.003;

impl Building {
    /// By how many radians the map should be turned, now that the building's direction is known as `now`, taught by so many
    /// walls. A direction that is learnt anew is that of other walls, and turns nothing.
    pub(super) fn learn(&mut self, now: Option<(f64, u32)>) -> Option<f64> {
        let (direction, walls) = now?;
        let (measured, taught) = *self.measured.get_or_insert((direction, walls));
        let turn = direction - measured;
        let turn = turn - FRAC_PI_2 * (turn / FRAC_PI_2).round();
        let anew = walls < taught;
        let turns = turn.abs() >= ASKEW;
        self.measured = Some((if anew || turns { direction } else { measured }, walls));
        (turns && !anew).then_some(turn)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_lessons_add_up_before_they_turn_the_map() {
        let mut building = Building::default();
        assert_eq!(building.learn(None), None);
        assert_eq!(building.learn(Some((0.500, 3))), None, "the map begins as it was measured");
        assert_eq!(building.learn(Some((0.502, 4))), None);
        approx::assert_relative_eq!(building.learn(Some((0.504, 5))).unwrap(), 0.004, epsilon = 1e-12);
        assert_eq!(building.learn(Some((0.504, 6))), None);
    }

    #[test]
    fn walls_a_quarter_round_teach_the_same() {
        let mut building = Building::default();
        building.learn(Some((0.1, 3)));
        approx::assert_relative_eq!(building.learn(Some((0.11 - FRAC_PI_2, 4))).unwrap(), 0.01, epsilon = 1e-12);
    }

    #[test]
    fn another_wing_turns_nothing() {
        let mut building = Building::default();
        building.learn(Some((0.1, 30)));
        assert_eq!(building.learn(Some((0.4, 3))), None, "learnt anew");
        approx::assert_relative_eq!(building.learn(Some((0.41, 4))).unwrap(), 0.01, epsilon = 1e-12);
    }
}
