use nalgebra::{Matrix2, Point2, Vector2};

use crate::{Identity, PlaceId, PlaceLikelihood, TopoMap};

/// When a spot counts as a known place, for a robot that knows roughly where it is.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct NearbyOptions {
    /// Within so many metres of its centre the robot is at a place.
    pub place_radius: f64,
    /// The uncertainty between two places that is always there, in m².
    pub least_variance: f64,
    /// The greatest squared Mahalanobis distance between where a view puts the robot and where it should be.
    pub gate: f64,
    /// Up to this standard deviation, in metres, coordinates alone say which place it is; beyond it views must.
    pub trusted_sigma: f64,
    /// Below this likelihood ratio a view says that it is another place, however near it lies: behind a wall, perhaps.
    pub unlike: f64,
    /// The likelihood ratio from which on a view says which place it is.
    pub likelihood_floor: f64,
    /// A view that is so much likelier somewhere else (natural logarithm of the odds) says nothing for a place.
    pub clear: f64,
    /// Where coordinates alone are not trusted, a view may move the robot by so many metres from where it should be. Echoes of
    /// smooth walls travel along with the robot, so that a single view tends to find it where it is looked for.
    pub farthest_pull: f64,
}

impl Default for NearbyOptions {
    fn default() -> Self {
        Self {
            place_radius: 0.6,
            least_variance: 0.002,
            gate: 5.99,
            trusted_sigma: 0.45,
            unlike: 0.1,
            likelihood_floor: 8.0,
            clear: 3.0,
            farthest_pull: 0.3,
        }
    }
}

/// Where the robot believes to be, before it looks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Supposed {
    /// The place where it last knew to be.
    pub place: PlaceId,
    /// How far it has come since, seen from the centre of that place, in metres.
    pub offset: Vector2<f64>,
    /// The covariance of that, in m².
    pub covariance: Matrix2<f64>,
}

/// Says which place of the map the robot stands at, or that it is at none: the nearest whose distance, by coordinates and
/// by view together, lies within a place's radius, unless the view is much likelier to have been taken elsewhere.
///
/// What a view says for a place is judged beside what it says for all others in reach, also those that are too far away to be
/// where the robot stands: from a room, a place in the corridor behind a thin wall looks like one that the map has at the
/// wrong spot, while the place a metre away in the room explains all that is seen.
///
/// `position` gives the coordinates of visited places. `compare` compares the present view with a place's and is only
/// called for those that may be in question. `between` is the covariance in m² of the position of a place relative to the
/// one last known, by all links of the map, and `None` where none leads: where a loop is about to close it is large, and
/// only a view that speaks for the place clearly is believed.
///
/// An ambiguous view, as along a corridor, says so by its covariance, and then leaves the ambiguous axis to the
/// coordinates.
pub fn identify_nearby<S>(
    map: &TopoMap<S>,
    supposed: &Supposed,
    signature: S,
    options: &NearbyOptions,
    position: impl Fn(PlaceId) -> Option<Point2<f64>>,
    between: impl Fn(PlaceId) -> Option<Matrix2<f64>>,
    compare: impl Fn(PlaceId, &S) -> Option<PlaceLikelihood>,
) -> Identity<S> {
    let Some(from) = position(supposed.place) else { return Identity::New { signature } };
    let estimate = from + supposed.offset;
    let (mut found, mut likeliest) = (Vec::new(), f64::NEG_INFINITY);
    for place in map.places() {
        let (Some(known), Some(center)) = (place.signature(), position(place.id)) else { continue };
        let Some(between) = between(place.id) else { continue };
        let prior = supposed.covariance + between + Matrix2::identity() * options.least_variance;
        let offset = estimate - center;
        if offset.norm() > options.place_radius + 3.0 * prior.symmetric_eigenvalues().max().sqrt() {
            continue;
        }
        let view = compare(place.id, known);
        let log_odds = view.as_ref().map_or(f64::NEG_INFINITY, |view| options.log_odds(view, offset, prior));
        likeliest = likeliest.max(log_odds);
        let judged = options.judge(offset, prior, view);
        found.extend(judged.map(|judged| (place.id, log_odds, judged)));
    }
    let at_place = found.into_iter().filter(|(_, log_odds, judged)| {
        let likely = judged.seen.is_none() || *log_odds >= likeliest - options.clear;
        likely && judged.offset.norm() <= options.place_radius
    });
    let nearest = at_place.min_by(|(.., a), (.., b)| a.offset.norm().total_cmp(&b.offset.norm()));
    nearest.map_or(Identity::New { signature }, |(place, _, Judged { offset, covariance, seen })| Identity::Known {
        place,
        offset,
        covariance,
        seen,
    })
}

/// Where the robot is, seen from a place; see [`Identity::Known`].
struct Judged {
    offset: Vector2<f64>,
    covariance: Matrix2<f64>,
    seen: Option<Matrix2<f64>>,
}

impl NearbyOptions {
    /// How much a view speaks for having been taken `offset` from a place, give or take `prior`, as a natural logarithm. Views
    /// that look alike beyond the floor are no likelier for it: corridors do.
    fn log_odds(&self, seen: &PlaceLikelihood, offset: Vector2<f64>, prior: Matrix2<f64>) -> f64 {
        let innovation = seen.offset - offset;
        let surprise = (prior + seen.covariance)
            .try_inverse()
            .map_or(f64::INFINITY, |information| (innovation.transpose() * information * innovation)[0]);
        seen.ratio.min(self.likelihood_floor).ln() - 0.5 * surprise
    }

    /// Where the robot is, seen from a place, by coordinates and view; `None` if it cannot be said to be near.
    fn judge(&self, offset: Vector2<f64>, prior: Matrix2<f64>, view: Option<PlaceLikelihood>) -> Option<Judged> {
        let sure = self.trusted_sigma.powi(2);
        let trusted = prior.symmetric_eigenvalues().max() <= sure;
        let by_coordinates = trusted.then_some(Judged { offset, covariance: prior, seen: None });
        let Some(seen) = view else { return by_coordinates };
        let innovation = seen.offset - offset;
        let Some(information) = (prior + seen.covariance).try_inverse() else { return by_coordinates };
        let surprise = (innovation.transpose() * information * innovation)[0];
        if seen.ratio < self.unlike {
            return None; // there may be a wall in between
        }
        if surprise > self.gate || seen.ratio < 1.0 {
            return by_coordinates; // the view matched something else
        }
        let gain = prior * information;
        let covariance = (Matrix2::identity() - gain) * prior;
        // Far from where it last knew to be, the robot is nowhere unless the view alone says so, along both axes, and says
        // about where it should be: a loop that is farther off is closed by the agreement of many views.
        let clear = seen.ratio >= self.likelihood_floor
            && covariance.symmetric_eigenvalues().max() <= sure
            && (gain * innovation).norm() <= self.farthest_pull;
        if !trusted && !clear {
            return None;
        }
        Some(Judged {
            offset: offset + gain * innovation,
            covariance: (covariance + covariance.transpose()) * 0.5,
            seen: Some(seen.covariance),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Displacement;

    /// A corridor of 40 places, 1 m apart, and where they lie.
    fn corridor() -> (TopoMap<u32>, impl Fn(PlaceId) -> Option<Point2<f64>>) {
        let mut map = TopoMap::new();
        let mut last = map.add_place(0).unwrap();
        for number in 1..40 {
            let next = map.add_place(number).unwrap();
            map.travel(last, next, Displacement::isotropic(Vector2::new(1.0, 0.0), 0.01)).unwrap();
            last = next;
        }
        (map, |place: PlaceId| Some(Point2::new(f64::from(place.0), 0.0)))
    }

    /// What the links of the corridor say of two places in it, were they as unsure across it as along it.
    fn between(from: u32) -> impl Fn(PlaceId) -> Option<Matrix2<f64>> {
        move |place: PlaceId| Some(Matrix2::identity() * (0.01 * f64::from(place.0.abs_diff(from))))
    }

    fn at(place: u32, x: f64) -> Supposed {
        let covariance = Matrix2::identity() * (0.005 * x.abs());
        Supposed { place: PlaceId(place), offset: Vector2::new(x, 0.0), covariance }
    }

    fn view(place: PlaceId, ratio: f64, x: f64) -> PlaceLikelihood {
        let covariance = Matrix2::identity() * 0.01;
        PlaceLikelihood { place, ratio, offset: Vector2::new(x, 0.0), covariance, turn: 0.0 }
    }

    fn known(identity: &Identity<u32>) -> Option<(u32, f64)> {
        match identity {
            Identity::Known { place, offset, .. } => Some((place.0, offset.x)),
            Identity::New { .. } | Identity::Unsure => None,
        }
    }

    #[test]
    fn nearby_coordinates_are_enough_where_there_is_nothing_to_see() {
        let (map, position) = corridor();
        let options = NearbyOptions::default();
        let identity = identify_nearby(&map, &at(3, 1.2), 99, &options, &position, between(3), |_, _| None);
        let (place, offset) = known(&identity).unwrap();
        assert_eq!(place, 4);
        approx::assert_relative_eq!(offset, 0.2, epsilon = 1e-12);
    }

    #[test]
    fn beyond_the_last_place_is_a_new_one_even_if_the_view_slides() {
        let (map, position) = corridor();
        let options = NearbyOptions::default();
        let slid = |place, _: &u32| Some(view(place, 50.0, 0.4));
        let identity = identify_nearby(&map, &at(39, 1.0), 99, &options, &position, between(39), slid);
        assert_eq!(identity, Identity::New { signature: 99 });
    }

    #[test]
    fn after_a_long_way_only_a_clear_view_is_believed() {
        // The robot has gone round to the first place over 40 m: 0.45 m of uncertainty.
        let (map, position) = corridor();
        let options = NearbyOptions::default();
        let around = Supposed { offset: Vector2::new(-38.8, 0.0), ..at(39, 1.0) };
        let with = |ratio: f64| {
            identify_nearby(&map, &around, 99, &options, &position, between(39), |place, _| {
                (place == PlaceId(0)).then(|| view(place, ratio, 0.05))
            })
        };
        assert_eq!(known(&with(2.0)), None);
        let (place, offset) = known(&with(20.0)).unwrap();
        assert_eq!(place, 0);
        assert!((0.05..0.1).contains(&offset), "the view counts more than the coordinates: {offset}");
    }

    #[test]
    fn what_a_view_says_against_its_place_is_left_to_the_agreement_of_many() {
        // As above, but the view wants the robot 0.8 m from where it should be, right at the centre of the place.
        let (map, position) = corridor();
        let options = NearbyOptions::default();
        let around = Supposed { offset: Vector2::new(-38.2, 0.0), ..at(39, 1.0) };
        let snapped = |place, _: &u32| (place == PlaceId(0)).then(|| view(place, 20.0, 0.0));
        let identity = identify_nearby(&map, &around, 99, &options, &position, between(39), snapped);
        assert_eq!(known(&identity), None);
    }

    #[test]
    fn a_place_behind_a_wall_is_not_where_the_robot_is_when_another_explains_the_view() {
        // The robot stands between two places, nearer to neither than a place is wide, and has not been there before.
        let (mut map, position) = corridor();
        let there = map.add_place(40).unwrap();
        let position = |place| if place == there { Some(Point2::new(0.0, 1.85)) } else { position(place) };
        let supposed =
            Supposed { place: there, offset: Vector2::new(0.0, -0.9), covariance: Matrix2::identity() * 0.19 };
        let still = |place| (place == there || place == PlaceId(0)).then(Matrix2::zeros);
        let options = NearbyOptions::default();
        let like = |place, ratio, y| Some(PlaceLikelihood { offset: Vector2::new(0.0, y), ..view(place, ratio, 0.0) });
        let wall = |place, _: &u32| if place == there { like(place, 8.0, -0.9) } else { like(place, 2.0, -0.1) };
        let identity = identify_nearby(&map, &supposed, 99, &options, position, still, wall);
        assert_eq!(known(&identity), None);
        let nothing_else = |place, seen: &u32| if place == there { None } else { wall(place, seen) };
        let identity = identify_nearby(&map, &supposed, 99, &options, position, still, nothing_else);
        assert_eq!(known(&identity).map(|(place, _)| place), Some(0));
    }
}
