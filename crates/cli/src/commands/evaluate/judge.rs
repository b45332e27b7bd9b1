use hierarchy::Mapper;
use hierarchy::evaluate::{
    AbsoluteError, Delta, Localization, MapMatch, Pairing, Recognition, Relation, RelationsError, RelationsOptions,
    RelativeError, Sharpness, TimedPath, absolute_error, compare_maps, localization, read_relations, recognition,
    relations_error, relative_error, sharpness,
};
use nalgebra::Isometry2;
use serde::Serialize;

use super::subject::{PlacedMap, is_map, read_map, read_path};
use super::{EvaluateArgs, PairChoice};
use crate::exit::Exit;
use crate::failure::Failure;
use crate::files;

/// The scores of one path.
#[derive(Debug, Serialize)]
pub(super) struct Scores {
    pub(super) ate: Option<AbsoluteError>,
    pub(super) rpe: Option<RelativeError>,
    pub(super) localization: Option<Localization>,
    pub(super) relations: Option<RelationsError>,
    pub(super) map: Option<MapMatch>,
    pub(super) sharpness: Option<Sharpness>,
    /// Mean entropy of the map's known cells.
    pub(super) entropy_bits: Option<f64>,
    /// Median distance of walls that are met again from where they were met before, in metres.
    pub(super) seen_again_m: Option<f64>,
    pub(super) start_to_end_m: Option<f64>,
    /// Sides of the smallest box that holds the path, in metres.
    pub(super) driven_over_m: [f64; 2],
}

/// How well the run knew places again.
#[derive(Debug, Serialize)]
pub(super) struct RecognitionScores {
    pub(super) precision: f64,
    pub(super) recall: f64,
    #[serde(flatten)]
    pub(super) counts: Recognition,
}

/// What paths are judged by.
pub(super) struct Judge<'a> {
    args: &'a EvaluateArgs,
    truth: Option<TimedPath>,
    relations: Option<Vec<Relation>>,
    map: Option<PlacedMap>,
}

impl<'a> Judge<'a> {
    /// Reads the true path, the true relations and the true map, as far as they are named.
    pub(super) fn read(args: &'a EvaluateArgs) -> Result<Self, Failure> {
        let path = args.truth.iter().find(|path| !is_map(path));
        let truth = path.map(|path| read_path(path, &args.reading, true)).transpose()?;
        let relations = args.relations.as_ref().map(|path| {
            read_relations(files::open(path)?).map_err(|error| Failure::rejected(path, "relations.parse", &error))
        });
        let map = args.truth.iter().find(|path| is_map(path)).map(|path| read_map(path)).transpose()?;
        Ok(Self { args, truth, relations: relations.transpose()?, map })
    }

    /// The scores of a path and of the map drawn along it; where poses are few, `carrier` brings them to the stamps of
    /// the relations.
    pub(super) fn scores(&self, path: &TimedPath, carrier: Option<&TimedPath>, map: Option<&PlacedMap>) -> Scores {
        let (args, truth) = (self.args, self.truth.as_ref());
        let pairing = truth.map_or_else(Pairing::default, |truth| self.pairing(path, truth));
        let ate = truth.and_then(|truth| absolute_error(path, truth, args.align.into(), pairing));
        let aligned = ate.as_ref().map_or_else(Isometry2::identity, |ate| ate.reference_from_estimate);
        let options = RelationsOptions::default();
        Scores {
            rpe: truth.and_then(|truth| relative_error(path, truth, Delta::Metres(args.stretch), pairing)),
            localization: truth.and_then(|truth| localization(path, truth, &aligned, pairing, args.cell)),
            relations: self.relations.as_ref().map(|relations| relations_error(path, relations, carrier, &options)),
            map: self.map.as_ref().zip(map).map(|((reference, true_from_grid), (map, map_from_grid))| {
                compare_maps(map, reference, &(true_from_grid.inverse() * aligned * map_from_grid))
            }),
            sharpness: map.map(|(map, _)| sharpness(map)),
            entropy_bits: None,
            seen_again_m: None,
            start_to_end_m: path.start_to_end(),
            driven_over_m: path.extent(),
            ate,
        }
    }

    fn pairing(&self, estimate: &TimedPath, reference: &TimedPath) -> Pairing {
        match self.args.pair {
            PairChoice::Auto => Pairing::automatic(estimate, reference, self.args.apart),
            PairChoice::Nearest => Pairing::Nearest { apart: self.args.apart },
            PairChoice::Interpolate => Pairing::Interpolated { gap: f64::INFINITY },
        }
    }

    /// Whether what was named could be compared with at all.
    pub(super) fn check(&self, scores: &Scores) -> Result<(), Failure> {
        if self.truth.is_some() && scores.ate.is_none() {
            let (subject, apart) = (self.args.subject.display(), self.args.apart);
            let message = format!("no stamp of {subject} lies within {apart} s of a true one");
            return Err(Failure::new(Exit::Rejected, "evaluate.stamps", message)
                .help("allow more with --apart, or check the clocks"));
        }
        if scores.ate.as_ref().is_some_and(|ate| ate.pairs < 2) {
            let message = "there is only one stamp at which to compare, which any path would meet exactly";
            return Err(Failure::new(Exit::Rejected, "evaluate.stamps", message)
                .help("where every stamp of a log is the same, --clock none counts its scans instead"));
        }
        if scores.relations.is_some_and(|relations| relations.all.is_none()) {
            let message = "no relation lies within the time of the trajectory";
            return Err(
                Failure::new(Exit::Rejected, "evaluate.stamps", message).help("check that both use the same clock")
            );
        }
        if self.map.is_some() && scores.map.is_none() {
            let message = format!("{} holds no map to compare with the true one", self.args.subject.display());
            return Err(Failure::new(Exit::Usage, "evaluate.map", message).help("name a run folder"));
        }
        Ok(())
    }

    /// How well the run knew places again, where a true path is at hand.
    pub(super) fn recognition(&self, mapper: &Mapper) -> Option<RecognitionScores> {
        let counts = recognition(mapper, self.truth.as_ref()?)?;
        Some(RecognitionScores { precision: counts.precision(), recall: counts.recall(), counts })
    }
}
