//! What the simulator promises, tested from outside.
#![expect(
    clippy::unwrap_used,
    clippy::print_stdout,
    reason = "helpers of tests may fail loudly and say what they skip"
)]

mod fixture;
mod maps;
#[path = "../examples/make_fixtures/recipe.rs"]
mod recipe;
mod repeatable;
mod validity;
mod worlds;
