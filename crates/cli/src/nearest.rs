/// The candidate that looks most like `text`, if one looks enough like it to be meant.
pub(crate) fn nearest<'a>(text: &str, candidates: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let alike = |candidate: &str| strsim::jaro_winkler(&text.to_lowercase(), &candidate.to_lowercase());
    let scored = candidates.map(|candidate| (alike(candidate), candidate));
    scored.filter(|(score, _)| *score > ALIKE).max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, candidate)| candidate)
}

/// Similarity from which a word may be a slip of the finger; the parser of the arguments takes about the same.
const ALIKE: f64 = 0.75;
