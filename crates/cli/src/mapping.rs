use std::time::Instant;

use hierarchy::{GyroSurvey, Mapper, Truth};
use robot_log::EntryKind;

use crate::commands::run::Job;
use crate::context::{self, Context};
use crate::failure::Failure;
use crate::finished::rejected;
use crate::input::Log;
use crate::live::Live;

/// Which part of a log is mapped.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Part {
    /// Entries that were taken in before, and are passed over if the log is the same.
    pub(crate) known: usize,
    /// Seconds after the log's first entry at which mapping begins and ends.
    pub(crate) from: Option<f64>,
    pub(crate) until: Option<f64>,
}

/// How the feeding of a log went.
#[derive(Debug, Default)]
pub(crate) struct Fed {
    pub(crate) truth: Truth,
    pub(crate) reading_s: f64,
    pub(crate) mapping_s: f64,
    /// Damaged lines that were left out.
    pub(crate) skipped: usize,
    /// The user wanted to stop: the log is not at its end.
    pub(crate) interrupted: bool,
}

/// Where an entry lies, seen from the part of the log that is mapped.
enum Lies {
    Before,
    Within,
    Behind,
}

/// Follows a log and says which entries belong to a [`Part`] of it.
struct Cut {
    part: Part,
    /// The stamp of the log's first entry.
    start: Option<f64>,
}

impl Cut {
    /// Where the next entry, of this stamp, lies; `mapper` holds what was taken in before this log.
    fn next(&mut self, stamp: f64, mapper: &Mapper) -> Lies {
        let start = *self.start.get_or_insert_with(|| {
            let same = mapper.tally().stamps.is_some_and(|(start, _)| start == stamp);
            if !same {
                self.part.known = 0; // another log than the one before is taken in whole
            }
            stamp
        });
        if self.part.known > 0 {
            self.part.known -= 1;
            return Lies::Before;
        }
        match self.part {
            Part { from: Some(from), .. } if stamp - start < from => Lies::Before,
            Part { until: Some(until), .. } if stamp - start > until => Lies::Behind,
            _ => Lies::Within,
        }
    }
}

/// What only the whole log tells and the mapper should know from the beginning: how its gyro drifts. Logs that can be read
/// once only, and those without a gyro among their first entries, are not looked through.
pub(crate) fn look_ahead(mapper: &mut Mapper, job: &Job) -> Result<(), Failure> {
    const FIRST: usize = 100;
    if job.inputs.is_empty() || !job.inputs.iter().all(|path| path.is_file()) {
        return Ok(());
    }
    let (mut survey, mut start, mut has_gyro) = (GyroSurvey::default(), None, false);
    for (number, entry) in (job.open)()?.enumerate() {
        let Ok(entry) = entry else { break }; // told of when it is mapped
        let since_start = entry.stamp - *start.get_or_insert(entry.stamp);
        if job.args.from.is_none_or(|from| since_start >= from) {
            survey.see(&entry);
        }
        has_gyro |= matches!(entry.kind, EntryKind::Gyro { .. });
        if number == FIRST && !has_gyro {
            break;
        }
    }
    if let Some(drift) = survey.drift() {
        mapper.expect_drift(drift);
    }
    Ok(())
}

/// Feeds a log to the mapper, entry by entry, and completes the map unless the user interrupts.
///
/// `checkpoint` is called after every `every` new places, and the map is shown to whoever looks at `live`.
pub(crate) fn feed(
    mapper: &mut Mapper,
    log: &mut Log,
    (part, every): (Part, usize),
    mut live: Option<Live>,
    context: &Context,
    mut checkpoint: impl FnMut(&Mapper) -> Result<(), Failure>,
) -> Result<Fed, Failure> {
    let stage = context.progress().reading("topology", log.size());
    let mut fed = Fed::default();
    let mut cut = Cut { part, start: None };
    let mut saved = mapper.topology().n_visited();
    let mut clock = Instant::now();
    let mut lap = move || std::mem::replace(&mut clock, Instant::now()).elapsed().as_secs_f64();
    while let Some(entry) = log.next() {
        let entry = entry?;
        fed.reading_s += lap();
        if let EntryKind::Truth { map_from_robot } = entry.kind {
            fed.truth.push(entry.stamp, map_from_robot);
        }
        match cut.next(entry.stamp, mapper) {
            Lies::Before => continue,
            Lies::Within => mapper.push(&entry).map_err(rejected)?,
            Lies::Behind => break,
        };
        if let Some(live) = &mut live {
            live.show(mapper);
        }
        fed.mapping_s += lap();
        if mapper.tally().entries.is_multiple_of(100) {
            stage.at(log.taken(), || so_far(mapper));
        }
        let places = mapper.topology().n_visited();
        if every > 0 && places >= saved + every {
            saved = places;
            checkpoint(mapper)?;
        }
        if context::interrupted() {
            fed.interrupted = true;
            stage.finish(&so_far(mapper));
            return Ok(fed);
        }
    }
    mapper.finish().map_err(rejected)?;
    stage.finish(&so_far(mapper));
    Ok(fed)
}

/// What has been found by now.
fn so_far(mapper: &Mapper) -> String {
    let (map, closures) = (mapper.topology(), mapper.closures());
    let refused = closures.iter().filter(|closure| !closure.is_accepted()).count();
    format!(
        "{} entries, {} places, {} links, {} loops ({refused} refused)",
        mapper.tally().entries,
        map.n_visited(),
        map.links().len(),
        closures.len() - refused
    )
}
