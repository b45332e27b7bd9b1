//! Makes the logs under `fixtures/logs` again, byte for byte.

#[path = "make_fixtures/recipe.rs"]
mod recipe;

use recipe::{RECIPES, fixtures};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    for recipe in RECIPES {
        let log = recipe.cook()?;
        let path = fixtures().join(recipe.log);
        std::fs::write(&path, &log)?;
        eprintln!("{}: {} bytes", recipe.log, log.len());
    }
    Ok(())
}
