use crate::entry::Entry;
use crate::error::LogError;

/// Several streams of entries, each in order, as one in order; at equal stamps the earlier stream comes first.
#[derive(Debug)]
pub(crate) struct Merge<S> {
    streams: Vec<Ahead<S>>,
}

/// A stream and its next entry.
#[derive(Debug)]
struct Ahead<S> {
    stream: S,
    next: Option<Option<Result<Entry, LogError>>>,
}

impl<S: Iterator<Item = Result<Entry, LogError>>> Merge<S> {
    pub(crate) fn new(streams: Vec<S>) -> Self {
        Self { streams: streams.into_iter().map(|stream| Ahead { stream, next: None }).collect() }
    }

    pub(crate) fn streams(&self) -> impl Iterator<Item = &S> {
        self.streams.iter().map(|ahead| &ahead.stream)
    }
}

impl<S: Iterator<Item = Result<Entry, LogError>>> Ahead<S> {
    /// The stamp of the next entry; an error is due at once, the end never.
    fn due(&mut self) -> Option<f64> {
        match self.next.get_or_insert_with(|| self.stream.next()) {
            Some(Ok(entry)) => Some(entry.stamp),
            Some(Err(_)) => Some(f64::NEG_INFINITY),
            None => None,
        }
    }
}

impl<S: Iterator<Item = Result<Entry, LogError>>> Iterator for Merge<S> {
    type Item = Result<Entry, LogError>;

    fn next(&mut self) -> Option<Self::Item> {
        let mut first: Option<(f64, usize)> = None;
        for (index, ahead) in self.streams.iter_mut().enumerate() {
            if let Some(due) = ahead.due()
                && first.is_none_or(|(earliest, _)| due < earliest)
            {
                first = Some((due, index));
            }
        }
        self.streams[first?.1].next.take()?
    }
}
