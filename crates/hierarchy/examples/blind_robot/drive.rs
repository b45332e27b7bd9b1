use hierarchy::Mapper;
use hierarchy::evaluate::{AbsoluteError, Alignment, Pairing, TimedPath, absolute_error};
use nalgebra::{Isometry2, Vector2};
use rand::RngExt;
use rand_pcg::Pcg64Mcg;
use robot_log::{Entry, EntryKind};

/// A recogniser that looks once a metre and is mostly wrong.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Recogniser {
    /// The share of the places within 0.7 m that it knows again.
    pub(crate) recall: f64,
    /// Wrong proposals for each right one.
    pub(crate) wrong: usize,
    /// The highest similarity that a wrong proposal gets; right ones get 0.2 to 1.
    pub(crate) most_alike: f64,
    /// Whether half of the wrong ones name the same wrong spot, as two equal-looking junctions do.
    pub(crate) aliased: bool,
}

impl Default for Recogniser {
    fn default() -> Self {
        Self { recall: 0.25, wrong: 3, most_alike: 0.8, aliased: false }
    }
}

/// The route through `corners`, driven at 1 m/s by a robot that veers by 0.25° per metre.
pub(crate) fn drive(corners: &[[f64; 2]], recogniser: &Recogniser, seed: u64) -> Vec<Entry> {
    let mut random = Pcg64Mcg::new(u128::from(2 * seed + 1));
    let (mut log, mut views): (Vec<Entry>, Vec<(f64, Vector2<f64>)>) = (Vec::new(), Vec::new());
    let (mut odom_from_robot, mut map_from_robot) = (Isometry2::identity(), Isometry2::identity());
    for (k, step) in (1u32..).zip(steps(corners)) {
        let stamp = 0.2 * f64::from(k);
        let (length, turn) = (step.translation.x, step.rotation.angle());
        let noise: f64 = random.random_range(-0.01..0.01);
        let veer = length * 0.25f64.to_radians() + 0.3 * noise;
        odom_from_robot *= Isometry2::new(Vector2::new(length * (1.0 + noise), 0.0), turn + veer);
        map_from_robot *= step;
        log.push(Entry { stamp, kind: EntryKind::Odometry { odom_from_robot } });
        log.push(Entry { stamp, kind: EntryKind::Truth { map_from_robot } });
        if k % 5 == 1 {
            let spot = map_from_robot.translation.vector;
            log.extend(recogniser.proposals(&mut random, &views, stamp, spot));
            views.push((stamp, spot));
        }
    }
    log
}

/// Steps of 0.2 m, and of a tenth of the turn at each corner.
fn steps(corners: &[[f64; 2]]) -> Vec<Isometry2<f64>> {
    let (mut steps, mut heading) = (Vec::new(), 0.0f64);
    for leg in corners.windows(2) {
        let way = Vector2::from(leg[1]) - Vector2::from(leg[0]);
        let turn = relaxation::wrap(way.y.atan2(way.x) - heading);
        heading += turn;
        steps.extend((0..10).map(|_| Isometry2::new(Vector2::zeros(), turn / 10.0)));
        let mut left = way.norm();
        while left > 0.1 {
            steps.push(Isometry2::translation(0.2, 0.0));
            left -= 0.2;
        }
    }
    steps
}

impl Recogniser {
    fn proposals(
        &self,
        random: &mut Pcg64Mcg,
        views: &[(f64, Vector2<f64>)],
        stamp: f64,
        spot: Vector2<f64>,
    ) -> Vec<Entry> {
        let mut found = Vec::new();
        let mut propose = |earlier, similarity| {
            found.push(Entry { stamp, kind: EntryKind::Recognition { earlier, similarity } });
        };
        let known = |(earlier, there): &&(f64, Vector2<f64>)| stamp - earlier > 20.0 && (spot - there).norm() < 0.7;
        for (earlier, _) in views.iter().filter(known) {
            if random.random_range(0.0..1.0) >= self.recall {
                continue;
            }
            propose(*earlier, random.random_range(0.2..1.0));
            for k in 0..self.wrong {
                // Views a fixed stretch of way earlier look alike where the building repeats itself.
                let alias = views.len().checked_sub(25).filter(|_| self.aliased && k % 2 == 0);
                let wrong = alias.unwrap_or_else(|| random.random_range(0..views.len()));
                propose(views[wrong].0, random.random_range(0.0..self.most_alike));
            }
        }
        found
    }
}

/// A corridor of 60 m, to and fro.
pub(crate) fn corridor(legs: usize) -> Vec<[f64; 2]> {
    (0..=legs).map(|leg| [if leg % 2 == 0 { 0.0 } else { 60.0 }, 0.0]).collect()
}

/// Two rounds of a rectangle and one of its halves.
pub(crate) fn rounds() -> Vec<[f64; 2]> {
    let round = [[0.0, 0.0], [40.0, 0.0], [40.0, 20.0], [0.0, 20.0]];
    let half = [[0.0, 0.0], [20.0, 0.0], [20.0, 20.0], [0.0, 20.0], [0.0, 0.0]];
    round.into_iter().chain(round).chain(half).collect()
}

/// Sides at odd angles, so that the building holds no heading: two rounds.
pub(crate) fn triangle() -> Vec<[f64; 2]> {
    let round = [[0.0, 0.0], [30.0, 0.0], [11.0, 23.0]];
    round.into_iter().chain(round).chain([[0.0, 0.0], [30.0, 0.0]]).collect()
}

/// The errors of the map's path and of the raw odometry against the truth of the log.
pub(crate) fn judged(mapper: &Mapper, log: &[Entry]) -> Option<(AbsoluteError, AbsoluteError)> {
    let truth = TimedPath::new(log.iter().filter_map(|entry| match entry.kind {
        EntryKind::Truth { map_from_robot } => Some((entry.stamp, map_from_robot)),
        _ => None,
    }));
    let samples = mapper.trajectory().samples();
    let stamps = || samples.iter().map(|sample| sample.stamp);
    let path = TimedPath::new(stamps().zip(mapper.poses()));
    let odometry = TimedPath::new(stamps().zip(samples.iter().map(|sample| sample.odom_from_robot)));
    let error = |path: &TimedPath| {
        let pairing = Pairing::Interpolated { gap: 2.0 };
        absolute_error(path, &truth, Alignment::Rigid, pairing)
    };
    error(&path).zip(error(&odometry))
}
