use std::io;
use std::path::Path;

use hierarchy::{Mapper, Passage};
use region_map::nalgebra::Isometry2;
use region_map::{RegionMap, carry_names, lay_over};

use super::{Floor, RegionsArgs, names, show, warn_of_none, write};
use crate::context::Context;
use crate::exit::Exit;
use crate::failure::Failure;
use crate::{files, finished::map_folder, input::session};

/// The rooms of a run. Names and closed gateways are kept in its session, since they belong to the map and not to a file.
pub(super) fn run(args: &RegionsArgs, stored: &Path, context: &Context) -> Result<(), Failure> {
    if args.furniture.is_some() || args.resolution.is_some() {
        let message = "the rooms of a run are cut as `topogrid run` cuts them";
        return Err(Failure::new(Exit::Usage, "regions.arguments", message)
            .help("name its map.yaml to cut that with another --furniture"));
    }
    let mut mapper = session::load(&args.map)?;
    let gridmap = map_folder::read(&args.map)?.grid;
    let mut map = mapper.survey(&gridmap).map_err(|error| Failure::rejected(&args.map, "regions.map", &error))?;
    warn_of_none(&map, args, context);
    for lost in mapper.floor_plan().lost_names() {
        context.warn(&format!("the name `{lost}` has no region of its own at present; it is kept"));
    }
    let taken = match &args.names_of {
        Some(other) => take_names(other, &mut mapper, &mut map, context)?,
        None => false,
    };
    let changed = change(args, &mut mapper, &mut map)? || taken;
    let floor = Floor {
        free: hierarchy::floor(&gridmap, &mapper.poses()),
        unknown: None,
        map_from_grid: Isometry2::identity(),
    };
    let written = match &args.out {
        Some(out) => write(out, args.force, &map, &floor)?,
        None if changed => write(&args.map, true, &map, &floor)?,
        None => Vec::new(),
    };
    if changed {
        let mut recorded = session::recorded(&args.map)?; // what is edited is not recorded
        recorded.remember_floor_plan(mapper.floor_plan().clone());
        files::write(stored, true, |mut out| recorded.save(&mut out).map_err(io::Error::other))
            .map_err(|error| Failure::writing(stored, &error))?;
    }
    let places = places(&mapper, &map);
    show(args, context, map, &floor, places, written)
}

/// Gives regions without a name those that they have in another run; answers whether any has.
fn take_names(other: &Path, mapper: &mut Mapper, map: &mut RegionMap, context: &Context) -> Result<bool, Failure> {
    let mut theirs = session::load(other)?;
    let gridmap = map_folder::read(other)?.grid;
    let old = theirs.survey(&gridmap).map_err(|error| Failure::rejected(other, "regions.map", &error))?;
    let Some(old_from_new) = lay_over(&old, map) else {
        context.warn(&format!("no name was taken over: {} or this run has no regions", other.display()));
        return Ok(false);
    };
    let mut named = map.clone();
    for lost in carry_names(&old, &mut named, &old_from_new) {
        context.warn(&format!("the name `{lost}` of {} found no region here", other.display()));
    }
    let mut taken = false;
    for (label, name) in named.regions.iter().filter_map(|region| Some((region.label, region.name.as_ref()?))) {
        if map.region(label).is_some_and(|region| region.name.is_none()) {
            mapper.name_region(map, label, name).map_err(|error| names::refused(&error))?;
            taken = true;
        }
    }
    Ok(taken)
}

/// Names regions, opens and closes gateways; answers whether anything was asked for.
fn change(args: &RegionsArgs, mapper: &mut Mapper, map: &mut RegionMap) -> Result<bool, Failure> {
    for (label, name) in &args.names {
        mapper.name_region(map, *label, name).map_err(|error| names::refused(&error))?;
    }
    let closed = args.closed.iter().map(|gateway| (*gateway, Passage::Closed));
    let opened = args.opened.iter().map(|gateway| (*gateway, Passage::Open));
    for (gateway, passage) in closed.chain(opened) {
        if !mapper.set_passage(map, gateway, passage) {
            let message = match map.gateways.len() {
                0 => format!("there is no gateway {gateway}; the map has none"),
                count => format!("there is no gateway {gateway}; the gateways are 0 to {}", count - 1),
            };
            return Err(Failure::new(Exit::Usage, "regions.gateway", message));
        }
    }
    Ok(!(args.names.is_empty() && args.closed.is_empty() && args.opened.is_empty()))
}

/// The places in each region, in the order of the regions.
fn places(mapper: &Mapper, map: &RegionMap) -> Vec<Vec<u32>> {
    let mut places = vec![Vec::new(); map.regions.len()];
    for (place, label) in mapper.places_in(map) {
        if let Some(index) = label.and_then(|label| usize::from(label).checked_sub(1)) {
            places[index].push(place.0);
        }
    }
    places
}
