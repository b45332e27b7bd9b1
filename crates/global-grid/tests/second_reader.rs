//! What we write, others read: the image crate and a YAML parser that are not ours.

use global_grid::local_grid::GridFrame;
use global_grid::local_grid::nalgebra::Point2;
use global_grid::map_server::{MapMetadata, Mode, read_image, write_pgm, write_yaml};
use global_grid::{Occupancy, layers};
use image::codecs::pnm::{PnmEncoder, PnmSubtype, SampleEncoding};
use rand::RngExt;
use yaml_rust2::YamlLoader;

use crate::dice;

type Grid<C> = global_grid::local_grid::Grid<C>;

fn random_map(seed: u64) -> Grid<Occupancy> {
    let mut random = dice(seed);
    let frame = GridFrame::new(Point2::new(-12.35, 7.0), 0.05, 23, 31).unwrap();
    let kinds = [Occupancy::Unknown, Occupancy::Free, Occupancy::Occupied];
    let cells = (0..frame.n_cells()).map(|_| kinds[random.random_range(0..3)]).collect();
    Grid::from_cells(frame, cells).unwrap()
}

/// A map server as its documentation describes it, on top of other people's parsers.
fn second_opinion(yaml: &str, image: &[u8]) -> (f64, [f64; 3], Vec<Vec<i32>>) {
    let document = &YamlLoader::load_from_str(yaml).unwrap()[0];
    let number = |key: &str| document[key].as_f64().or(document[key].as_i64().map(|n| n as f64)).unwrap();
    let origin = [0, 1, 2].map(|at| document["origin"][at].as_f64().unwrap());
    let pixels = image::load_from_memory(image).unwrap().into_luma8();
    assert!(document["image"].as_str().is_some());
    let cell = |x: u32, y: u32| {
        let shade = f64::from(pixels.get_pixel(x, y).0[0]) / 255.0;
        let occupancy = if number("negate") == 1.0 { shade } else { 1.0 - shade };
        if occupancy > number("occupied_thresh") {
            100
        } else if occupancy < number("free_thresh") {
            0
        } else {
            -1
        }
    };
    let rows = (0..pixels.height()).rev().map(|y| (0..pixels.width()).map(|x| cell(x, y)).collect()).collect();
    (number("resolution"), origin, rows)
}

#[test]
fn both_readers_find_what_was_written() {
    for seed in 0..5 {
        let map = random_map(seed);
        let (mut pgm, mut yaml) = (Vec::new(), Vec::new());
        write_pgm(&map, &mut pgm).unwrap();
        write_yaml(&MapMetadata::new("map.pgm", map.frame()), &mut yaml).unwrap();
        let metadata = MapMetadata::read(yaml.as_slice()).unwrap();
        let ours = read_image(&metadata, pgm.as_slice()).unwrap();
        let (resolution, origin, theirs) = second_opinion(std::str::from_utf8(&yaml).unwrap(), &pgm);
        assert_eq!((resolution, origin), (metadata.resolution, metadata.origin));
        assert_eq!((metadata.mode, ours.occupancy()), (Mode::Trinary, map));
        let ours: Vec<Vec<i32>> =
            ours.cells.cells().chunks(31).map(|row| row.iter().map(|&cell| i32::from(cell)).collect()).collect();
        assert_eq!(ours, theirs);
    }
}

#[test]
fn both_readers_read_pictures_of_any_kind_alike() {
    // A grey PNG that an image library wrote, with shades on both sides of the thresholds.
    let mut picture = image::GrayImage::new(256, 2);
    for (x, y, pixel) in picture.enumerate_pixels_mut() {
        pixel.0[0] = u8::try_from(if y == 0 { x } else { 255 - x }).unwrap();
    }
    let mut png = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut png, image::ImageFormat::Png).unwrap();
    let pnm = |encoding| {
        let mut bytes = Vec::new();
        let encoder = PnmEncoder::new(&mut bytes).with_subtype(PnmSubtype::Graymap(encoding));
        picture.write_with_encoder(encoder).unwrap();
        bytes
    };
    for bytes in [png.into_inner(), pnm(SampleEncoding::Binary), pnm(SampleEncoding::Ascii)] {
        for negate in [0, 1] {
            let yaml = format!(
                "image: map.png\nresolution: 0.1\norigin: [0.0, 0.0, 0.0]\nnegate: {negate}\n\
                 occupied_thresh: 0.65\nfree_thresh: 0.196\n"
            );
            let metadata = MapMetadata::read(yaml.as_bytes()).unwrap();
            let ours = read_image(&metadata, bytes.as_slice()).unwrap();
            let theirs = second_opinion(&yaml, &bytes).2.concat();
            let ours: Vec<i32> = ours.cells.cells().iter().map(|&cell| i32::from(cell)).collect();
            assert_eq!(ours, theirs, "negate {negate}");
        }
    }
}

#[test]
fn layers_keep_sixteen_bits_for_others() {
    let frame = GridFrame::new(Point2::origin(), 0.1, 2, 3).unwrap();
    let mut grid = global_grid::local_grid::FuzzyGrid::new(frame);
    grid.get_mut(1, 2).unwrap().empty = 0.123_456;
    let mut bytes = Vec::new();
    layers::write_layer(&grid, layers::Layer::Free, &mut bytes).unwrap();
    let pixels = image::load_from_memory(&bytes).unwrap().into_luma16();
    assert_eq!(pixels.get_pixel(2, 0).0[0], 8091); // 0.123456 · 65535, at the top right
    assert_eq!(pixels.get_pixel(0, 1).0[0], 0);
}
