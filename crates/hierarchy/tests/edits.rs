use hierarchy::edit::{Edit, Edits, Measured, measure};
use hierarchy::explain::{explain, without};
use hierarchy::{Config, Mapper};
use topo_map::PlaceId;

use crate::logs::{map, office_loop};

fn edited(edits: Vec<Edit>) -> Mapper {
    let mut mapper = map(&office_loop(), Config::default());
    Edits { list: edits }.apply(&mut mapper).unwrap();
    mapper
}

#[test]
fn a_dropped_loop_leaves_the_map_as_explain_said_it_would() {
    let recorded = map(&office_loop(), Config::default());
    let told = explain(&recorded).unwrap();
    let strained = told.accepted()[0].clone();
    let links: Vec<_> = recorded.topology().links_between(strained.place, strained.known).map(|link| link.id).collect();
    let foretold = without(&recorded, &links).unwrap();
    let mapper = edited(vec![Edit::DropLink { from: strained.place.0, to: strained.known.0 }]);
    let energy = mapper.metrics().unwrap().relaxation.energy_after;
    approx::assert_relative_eq!(energy, foretold.energy_without, max_relative = 1e-9);
    let told = explain(&mapper).unwrap();
    let story = told.loops.iter().find(|story| story.link == strained.link).unwrap();
    assert!(!story.accepted && story.reason.starts_with("dropped"), "{story:?}");
    approx::assert_relative_eq!(story.chi2, strained.chi2, max_relative = 1e-3); // judged by the same rest of the map
}

#[test]
fn a_false_link_is_found_by_explain() {
    let lie = Measured { vector_m: [0.3, 0.0], sigma_m: 0.1, turn_deg: None };
    let mapper = edited(vec![Edit::AddLink { from: 20, to: 60, by: lie }]);
    let told = explain(&mapper).unwrap();
    let worst = told.accepted()[0];
    assert_eq!((worst.place, worst.known), (PlaceId(20), PlaceId(60)));
    assert!(worst.residual_sigma > 10.0 && worst.reason == "added by hand", "{worst:?}");
}

#[test]
fn pinned_places_stay_and_merged_ones_are_one() {
    let recorded = map(&office_loop(), Config::default());
    let at = recorded.coordinates().map_from_place(PlaceId(50)).translation.vector + nalgebra::Vector2::new(0.4, -0.2);
    let told = explain(&recorded).unwrap();
    let pair = told.accepted().last().map(|story| (story.place, story.known)).unwrap();
    let by = measure(&recorded, pair.0, pair.1).unwrap();
    let mapper = edited(vec![
        Edit::Pin { place: 50, at_m: at.into(), sigma_m: 0.001 },
        Edit::Merge { place: pair.0.0, into: pair.1.0, by },
        Edit::Name { place: pair.1.0, name: "kitchen".into() },
    ]);
    let moved = mapper.coordinates().map_from_place(PlaceId(50)).translation.vector;
    assert!((moved - at).norm() < 0.01, "{moved} is not {at}");
    assert_eq!(mapper.same_as(pair.0), Some(pair.1));
    let every = hierarchy::RouteOptions { same_spot: 0.0, ..Default::default() };
    let graph = |mapper: &Mapper, options| mapper.atlas().unwrap().route_graph(options);
    let (before, after) = (graph(&recorded, &every), graph(&mapper, &every));
    assert_eq!(after.nodes.len() + 1, before.nodes.len());
    let spots = graph(&recorded, &hierarchy::RouteOptions::default());
    assert!(spots.nodes.len() < before.nodes.len(), "a loop driven twice has spots that were recognised");
    assert_eq!(spots.nodes.iter().map(|node| node.visits).sum::<u32>(), 142);
    assert!(after.nodes.iter().any(|node| node.place == pair.1 && node.name == "kitchen"));
    let apart = |edge: &hierarchy::RouteEdge| edge.from < edge.to && edge.to < after.nodes.len();
    assert!(after.edges.iter().all(apart));
}

#[test]
fn what_does_not_fit_is_refused_by_number_and_words() {
    let mut mapper = map(&office_loop()[..600], Config::default());
    let apply = |edit: Edit, mapper: &mut Mapper| Edits { list: vec![edit] }.apply(mapper).unwrap_err().to_string();
    let error = apply(Edit::DropLink { from: 0, to: 9999 }, &mut mapper);
    assert_eq!(error, "edit 1 (drop the links between P0 and P9999): no link joins P0 and P9999");
    assert!(apply(Edit::Name { place: 9999, name: "x".into() }, &mut mapper).contains("no place P9999"));
    assert!(apply(Edit::Pin { place: 0, at_m: [1.0, 1.0], sigma_m: 0.1 }, &mut mapper).contains("origin"));
    assert!(apply(Edit::Pin { place: 1, at_m: [1.0, 1.0], sigma_m: 0.0 }, &mut mapper).contains("covariance"));
    assert!(Edits::from_toml("[[edit]]\ndo = \"drop-lnik\"\nfrom = 1\nto = 2\n").is_err());
    assert!(Edits::from_toml("[[edit]]\ndo = \"name\"\nplace = 1\nnam = \"x\"\n").is_err());
}
