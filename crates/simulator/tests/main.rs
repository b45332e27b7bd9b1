//! What the simulator promises, tested from outside.
#![expect(clippy::unwrap_used, reason = "helpers of tests may fail loudly, too")]

mod fixture;
#[path = "../examples/make_fixtures/recipe.rs"]
mod recipe;
mod repeatable;
mod validity;
