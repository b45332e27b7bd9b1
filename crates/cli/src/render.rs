pub(crate) mod svg;
pub(crate) mod topology;
