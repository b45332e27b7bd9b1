pub(crate) mod blocks;
pub(crate) mod svg;
pub(crate) mod topology;
