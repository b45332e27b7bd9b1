use nalgebra::{Isometry2, Matrix2, Rotation2, Vector2};

use crate::{PlaceId, TopoMap};

/// The settings of the Bayes filter over places.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(default, deny_unknown_fields))]
pub struct LocalizerOptions {
    /// The standard deviation `s_p` in metres of where inside a place the robot may stop.
    pub place_size: f64,
    /// How far from a place's centre, in metres, the robot may be and still count as being there.
    pub place_radius: f64,
    /// The share `ε` of belief that may be anywhere after every step, so that a kidnapped robot is found again.
    pub kidnapping: f64,
    /// At how many standard deviations from the nearest known place a place never seen before is as likely as that one.
    pub uncharted_sigmas: f64,
    /// The likelihood ratio of all places that the caller did not compare with the robot's view, for example because
    /// the signature index did not name them.
    pub unlisted_likelihood: f64,
    /// A place is recognised only if it holds at least this probability.
    pub known_probability: f64,
    /// A place is recognised only if its view is at least this many times likelier than a view of another place.
    pub likelihood_floor: f64,
    /// A new place is reported only if being somewhere uncharted holds at least this probability.
    pub new_probability: f64,
    /// How many links from a supposed place the robot may get in one step.
    pub reach: usize,
    /// Hypotheses below this probability are forgotten; their mass is spread over all places.
    pub prune: f64,
}

impl Default for LocalizerOptions {
    /// Reconstructed defaults: `s_p` = 0.5 m, `ε` = 0.01, recognised above 0.9.
    fn default() -> Self {
        Self {
            place_size: 0.5,
            place_radius: 0.6,
            kidnapping: 0.01,
            uncharted_sigmas: 1.5,
            unlisted_likelihood: 0.1,
            known_probability: 0.9,
            likelihood_floor: 2.0,
            new_probability: 0.8,
            reach: 3,
            prune: 1e-7,
        }
    }
}

/// How well the robot's present view fits one place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlaceLikelihood {
    /// The place compared.
    pub place: PlaceId,
    /// How many times likelier this view is at that place than at any other: 1 says nothing, less speaks against it.
    pub ratio: f64,
    /// Where the robot would be, seen from the place's centre, in metres.
    pub offset: Vector2<f64>,
    /// The covariance of `offset` in m²; large along a corridor's axis.
    pub covariance: Matrix2<f64>,
    /// The turn in radians from the place's axes to those that the robot uses now; zero with a compass.
    pub turn: f64,
}

/// One place where the robot may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hypothesis {
    /// The place.
    pub place: PlaceId,
    /// The probability of being there.
    pub probability: f64,
    /// Where the robot is, seen from the place's centre, in metres.
    pub offset: Vector2<f64>,
    /// The covariance of `offset` in m².
    pub covariance: Matrix2<f64>,
    /// The turn in radians from the place's axes to those that the robot uses now; zero with a compass.
    pub turn: f64,
    /// The likelihood ratio of the last view.
    pub ratio: f64,
    /// Over how many views in succession this place and those that led to it were confirmed; `u32::MAX` where the
    /// robot's own unbroken path leads there.
    pub agreement: u32,
}

/// What the filter believes: the hypotheses by falling probability, and the two rests.
#[derive(Debug, Clone, PartialEq)]
pub struct Belief {
    /// The places that stand out, the most probable first.
    pub hypotheses: Vec<Hypothesis>,
    /// The probability of being at a place that the map does not have.
    pub uncharted: f64,
    /// The probability of being at any other place of the map.
    pub elsewhere: f64,
}

/// What the filter says of the place where the robot is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Recognition {
    /// A place of the map.
    Known(Hypothesis),
    /// A place that the map does not have.
    New {
        /// The probability of that.
        probability: f64,
    },
    /// No answer is sure enough.
    Unsure {
        /// Why not.
        reason: Unsure,
        /// The best guess, if there is one.
        best: Option<Hypothesis>,
    },
}

/// Why the filter does not answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Unsure {
    /// No answer has enough probability.
    #[error("no place stands out")]
    Undecided,
    /// The best place does not look like what the robot sees.
    #[error("the best place does not look like the present view")]
    Unlike,
    /// The best place is too far from where the robot is.
    #[error("the best place lies too far away")]
    TooFar,
}

/// Why the filter refuses its input.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LocalizeError {
    /// A setting is out of its range.
    #[error("option `{name}` must lie in {range}, got {value}")]
    Option {
        /// Its name.
        name: &'static str,
        /// What it must lie in.
        range: &'static str,
        /// What it was.
        value: f64,
    },
    /// The place is not one of the map's visited ones.
    #[error("{0} is not a visited place of the map")]
    Place(PlaceId),
    /// A place was compared twice.
    #[error("{0} is listed twice")]
    Twice(PlaceId),
    /// A likelihood ratio, offset or covariance that is none.
    #[error(
        "{place}: a likelihood needs a finite ratio ≥ 0, a finite offset and turn and a positive covariance, got ratio {ratio}"
    )]
    Likelihood {
        /// The place.
        place: PlaceId,
        /// The ratio given.
        ratio: f64,
    },
    /// A motion must be a vector with a variance.
    #[error("a step needs a finite displacement and a variance ≥ 0, got ({x}, {y}) m and {variance} m²")]
    Motion {
        /// Metres along x.
        x: f64,
        /// Metres along y.
        y: f64,
        /// Variance in m².
        variance: f64,
    },
}

/// A Bayes filter over the places of a map (after Duckett & Nehmzow 1999), which also believes in places that the map
/// does not have yet, and in being carried away.
///
/// With `p` the belief, `o_i` the offset inside place `i`, `m` the step, `s_m²` its variance, and `t_ij` the displacement
/// along links:
///
/// ```text
/// p̄(j) = ε/N + (1 − ε) Σ_i p(i) w_ij / Z_i,   w_ij = exp(−|o_i + m − t_ij|² / 2(s_m² + s_p²))
/// p(j) ∝ p̄(j) L_j
/// ```
///
/// It uses links, not coordinates, so the map need not be globally consistent. `Z_i` also holds the weight
/// `exp(−k²/2)` of a place that is not in the map, `k` being [`LocalizerOptions::uncharted_sigmas`].
///
/// Only places that stand out are kept one by one, the rest share one number: a step costs what the neighbourhood of
/// the robot costs, whatever the size of the map.
#[derive(Debug, Clone)]
pub struct Localizer {
    options: LocalizerOptions,
    belief: Belief,
}

impl Localizer {
    /// A filter that knows nothing: any place of the map is as likely as any other, and as none of them.
    ///
    /// # Errors
    ///
    /// An option out of its range.
    pub fn new(options: LocalizerOptions) -> Result<Self, LocalizeError> {
        options.check()?;
        Ok(Self { options, belief: Belief { hypotheses: Vec::new(), uncharted: 0.5, elsewhere: 0.5 } })
    }

    /// The settings.
    #[must_use]
    pub fn options(&self) -> &LocalizerOptions {
        &self.options
    }

    /// What the filter believes now.
    #[must_use]
    pub fn belief(&self) -> &Belief {
        &self.belief
    }

    /// The robot stands at a place that was just added to the map: what was uncharted is now that place.
    ///
    /// # Errors
    ///
    /// The place is not visited.
    pub fn enter<S>(&mut self, map: &TopoMap<S>, place: PlaceId) -> Result<(), LocalizeError> {
        require_visited(map, place)?;
        let probability = std::mem::take(&mut self.belief.uncharted);
        let covariance = Matrix2::identity() * 1e-4; // the centre of a place is where the robot first stood
        let offset = Vector2::zeros();
        let entered = Hypothesis { place, probability, offset, covariance, turn: 0.0, ratio: 1.0, agreement: u32::MAX };
        self.belief.hypotheses.retain(|hypothesis| hypothesis.place != place);
        self.belief.hypotheses.push(entered);
        self.normalize();
        Ok(())
    }

    /// The robot is at `place` beyond doubt, `offset` metres from its centre.
    ///
    /// # Errors
    ///
    /// The place is not visited, or the offset is not finite.
    pub fn settle<S>(&mut self, map: &TopoMap<S>, place: PlaceId, offset: Vector2<f64>) -> Result<(), LocalizeError> {
        require_visited(map, place)?;
        if !(offset.x.is_finite() && offset.y.is_finite()) {
            return Err(LocalizeError::Motion { x: offset.x, y: offset.y, variance: 0.0 });
        }
        let covariance = Matrix2::identity() * 1e-2;
        let only =
            Hypothesis { probability: 1.0, place, offset, covariance, turn: 0.0, ratio: 1.0, agreement: u32::MAX };
        self.belief = Belief { hypotheses: vec![only], uncharted: 0.0, elsewhere: 0.0 };
        Ok(())
    }

    /// The robot has moved by `displacement` (m, map frame), known to a variance of `variance` m² per axis.
    ///
    /// # Errors
    ///
    /// A displacement that is not finite or a negative variance.
    pub fn predict<S>(
        &mut self,
        map: &TopoMap<S>,
        displacement: Vector2<f64>,
        variance: f64,
    ) -> Result<(), LocalizeError> {
        if !(displacement.x.is_finite() && displacement.y.is_finite() && variance >= 0.0 && variance.is_finite()) {
            return Err(LocalizeError::Motion { x: displacement.x, y: displacement.y, variance });
        }
        let mut moved = Vec::new();
        let mut uncharted = self.belief.uncharted;
        for hypothesis in &self.belief.hypotheses {
            uncharted += self.spread(map, hypothesis, displacement, variance, &mut moved);
        }
        let stays = 1.0 - self.options.kidnapping;
        self.belief.uncharted = uncharted * stays;
        self.belief.elsewhere = self.belief.elsewhere * stays + self.options.kidnapping;
        self.belief.hypotheses = united(moved);
        self.belief.hypotheses.iter_mut().for_each(|hypothesis| hypothesis.probability *= stays);
        self.normalize();
        Ok(())
    }

    /// Spreads one hypothesis over the places that the step may have led to; answers what may have left the map.
    fn spread<S>(
        &self,
        map: &TopoMap<S>,
        hypothesis: &Hypothesis,
        step: Vector2<f64>,
        variance: f64,
        moved: &mut Vec<Hypothesis>,
    ) -> f64 {
        let landed = hypothesis.offset + Rotation2::new(hypothesis.turn) * step;
        let uncertain = hypothesis.covariance.trace() * 0.5 + variance + self.options.place_size.powi(2);
        let uncharted_weight = (-0.5 * self.options.uncharted_sigmas.powi(2)).exp();
        let around = map.surroundings(hypothesis.place, self.options.reach);
        let weigh =
            |pose: &Isometry2<f64>| (-(landed - pose.translation.vector).norm_squared() / (2.0 * uncertain)).exp();
        let total = uncharted_weight + around.iter().map(|(_, pose)| weigh(pose)).sum::<f64>();
        for (place, pose) in &around {
            moved.push(Hypothesis {
                place: *place,
                probability: hypothesis.probability * weigh(pose) / total,
                offset: pose.rotation.inverse() * (landed - pose.translation.vector),
                covariance: hypothesis.covariance + Matrix2::identity() * variance,
                turn: hypothesis.turn - pose.rotation.angle(),
                ..*hypothesis
            });
        }
        hypothesis.probability * uncharted_weight / total
    }

    /// The robot has looked around: how well its view fits the places that were compared with it.
    ///
    /// # Errors
    ///
    /// A place that was not visited or is listed twice, a ratio below 0, anything not finite.
    pub fn update<S>(&mut self, map: &TopoMap<S>, likelihoods: &[PlaceLikelihood]) -> Result<(), LocalizeError> {
        let _span = tracing::debug_span!("recognize", compared = likelihoods.len()).entered();
        check_likelihoods(map, likelihoods)?;
        let kept = self.belief.hypotheses.len();
        let others = map.n_visited().saturating_sub(kept).max(1);
        #[expect(clippy::cast_precision_loss, reason = "far fewer than 2^52 places")]
        let share = self.belief.elsewhere / others as f64;
        for hypothesis in &mut self.belief.hypotheses {
            match likelihoods.iter().find(|seen| seen.place == hypothesis.place) {
                Some(seen) => self.options.weigh(hypothesis, seen),
                None => {
                    hypothesis.ratio = self.options.unlisted_likelihood;
                    hypothesis.probability *= hypothesis.ratio;
                }
            }
        }
        for seen in likelihoods {
            if self.belief.hypotheses[..kept].iter().all(|hypothesis| hypothesis.place != seen.place) {
                self.belief.elsewhere = (self.belief.elsewhere - share).max(0.0);
                self.belief.hypotheses.push(self.options.surprise(seen, share));
            }
        }
        self.belief.elsewhere *= self.options.unlisted_likelihood;
        self.normalize();
        Ok(())
    }

    /// What the belief says of the place where the robot is: a known one, a new one, or nothing sure.
    #[must_use]
    pub fn decide<S>(&self, map: &TopoMap<S>) -> Recognition {
        let best = self.belief.hypotheses.first().copied();
        if self.belief.uncharted >= self.options.new_probability {
            return Recognition::New { probability: self.belief.uncharted };
        }
        let Some(mut hypothesis) = best else {
            return Recognition::Unsure { reason: Unsure::Undecided, best };
        };
        hypothesis.probability = self.mass_at(map, &hypothesis);
        let reason = if hypothesis.probability < self.options.known_probability {
            Unsure::Undecided
        } else if hypothesis.ratio < self.options.likelihood_floor {
            Unsure::Unlike
        } else if hypothesis.offset.norm() > self.options.place_radius {
            Unsure::TooFar
        } else {
            return Recognition::Known(hypothesis);
        };
        Recognition::Unsure { reason, best: Some(hypothesis) }
    }

    /// The probability of standing at the spot of `best`, whichever of several overlapping places it is given to.
    fn mass_at<S>(&self, map: &TopoMap<S>, best: &Hypothesis) -> f64 {
        let around = map.surroundings(best.place, self.options.reach);
        let same_spot = |hypothesis: &&Hypothesis| {
            around.iter().find(|(place, _)| *place == hypothesis.place).is_some_and(|(_, pose)| {
                let spot = pose.rotation * hypothesis.offset + pose.translation.vector;
                (spot - best.offset).norm() <= self.options.place_radius
            })
        };
        self.belief.hypotheses.iter().filter(same_spot).map(|hypothesis| hypothesis.probability).sum()
    }

    /// Makes the probabilities add up to one, forgets what has become improbable, and sorts.
    fn normalize(&mut self) {
        let belief = &mut self.belief;
        let sum = |belief: &Belief| belief.hypotheses.iter().map(|h| h.probability).sum::<f64>();
        let total = sum(belief) + belief.uncharted + belief.elsewhere;
        if !(total > 0.0 && total.is_finite()) {
            // Everything was ruled out: the filter knows nothing, as at its start.
            *belief = Belief { hypotheses: Vec::new(), uncharted: 0.5, elsewhere: 0.5 };
            return;
        }
        belief.hypotheses.iter_mut().for_each(|hypothesis| hypothesis.probability /= total);
        belief.uncharted /= total;
        belief.hypotheses.retain(|hypothesis| hypothesis.probability >= self.options.prune);
        belief.elsewhere = (1.0 - belief.uncharted - sum(belief)).max(0.0);
        belief.hypotheses.sort_by(|a, b| b.probability.total_cmp(&a.probability).then(a.place.cmp(&b.place)));
    }
}

impl LocalizerOptions {
    fn check(&self) -> Result<(), LocalizeError> {
        let positive = [
            ("place_size", self.place_size),
            ("place_radius", self.place_radius),
            ("uncharted_sigmas", self.uncharted_sigmas),
            ("likelihood_floor", self.likelihood_floor),
            ("unlisted_likelihood", self.unlisted_likelihood),
        ];
        for (name, value) in positive {
            if !(value > 0.0 && value.is_finite()) {
                return Err(LocalizeError::Option { name, range: "(0, ∞)", value });
            }
        }
        let shares = [
            ("kidnapping", self.kidnapping),
            ("known_probability", self.known_probability),
            ("new_probability", self.new_probability),
            ("prune", self.prune),
        ];
        for (name, value) in shares {
            if !(0.0..1.0).contains(&value) {
                return Err(LocalizeError::Option { name, range: "[0, 1)", value });
            }
        }
        Ok(())
    }

    /// Bayes' rule for a place that was expected: how well it looks like it, and whether it lies where it should.
    fn weigh(&self, hypothesis: &mut Hypothesis, seen: &PlaceLikelihood) {
        let innovation = seen.offset - hypothesis.offset;
        let spread = hypothesis.covariance + seen.covariance;
        let Some(information) = spread.try_inverse() else { return };
        let surprise = (innovation.transpose() * information * innovation)[0];
        hypothesis.ratio = seen.ratio * (-0.5 * surprise).exp();
        hypothesis.probability *= hypothesis.ratio;
        hypothesis.turn = seen.turn;
        let gain = hypothesis.covariance * information;
        hypothesis.offset += gain * innovation;
        let covariance = (Matrix2::identity() - gain) * hypothesis.covariance;
        hypothesis.covariance = (covariance + covariance.transpose()) * 0.5;
        hypothesis.agreement = match hypothesis.ratio >= self.likelihood_floor {
            true => hypothesis.agreement.saturating_add(1),
            false if hypothesis.agreement == u32::MAX => u32::MAX, // odometry vouches for it, whatever it looks like
            false => 0,
        };
    }

    /// Bayes' rule for a place where nobody expected the robot.
    fn surprise(&self, seen: &PlaceLikelihood, prior: f64) -> Hypothesis {
        Hypothesis {
            place: seen.place,
            probability: prior * seen.ratio,
            offset: seen.offset,
            covariance: seen.covariance,
            turn: seen.turn,
            ratio: seen.ratio,
            agreement: u32::from(seen.ratio >= self.likelihood_floor),
        }
    }
}

/// Adds up the hypotheses that speak of the same place; the most probable one lends its offset.
fn united(mut moved: Vec<Hypothesis>) -> Vec<Hypothesis> {
    moved.sort_by(|a, b| a.place.cmp(&b.place).then(b.probability.total_cmp(&a.probability)));
    let mut united: Vec<Hypothesis> = Vec::with_capacity(moved.len());
    for hypothesis in moved {
        match united.last_mut() {
            Some(last) if last.place == hypothesis.place => last.probability += hypothesis.probability,
            _ => united.push(hypothesis),
        }
    }
    united
}

fn require_visited<S>(map: &TopoMap<S>, place: PlaceId) -> Result<(), LocalizeError> {
    if map.place(place).is_some_and(crate::Place::is_visited) { Ok(()) } else { Err(LocalizeError::Place(place)) }
}

fn check_likelihoods<S>(map: &TopoMap<S>, likelihoods: &[PlaceLikelihood]) -> Result<(), LocalizeError> {
    for (index, seen) in likelihoods.iter().enumerate() {
        require_visited(map, seen.place)?;
        if likelihoods[..index].iter().any(|before| before.place == seen.place) {
            return Err(LocalizeError::Twice(seen.place));
        }
        let finite = seen.ratio.is_finite() && seen.turn.is_finite() && seen.offset.iter().all(|x| x.is_finite());
        let definite = seen.covariance.trace() > 0.0 && seen.covariance.determinant() > 0.0;
        if !(finite && definite && seen.ratio >= 0.0) {
            return Err(LocalizeError::Likelihood { place: seen.place, ratio: seen.ratio });
        }
    }
    Ok(())
}
