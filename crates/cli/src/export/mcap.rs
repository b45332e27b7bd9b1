use std::collections::BTreeMap;
use std::io::{self, Write};

use hierarchy::topo_map::{LinkOrigin, LinkState};
use hierarchy::{Atlas, AtlasLink};
use mcap::records::MessageHeader;
use mcap::{McapError, WriteOptions, Writer};
use nalgebra::{Isometry2, Point2};
use serde_json::{Value, json};

use super::{Source, rounded};

/// The path in the map, the raw odometry, and the places with their links, as messages that Foxglove draws: JSON with the
/// schemas `foxglove.PoseInFrame` and `foxglove.SceneUpdate`, stamped by the log's clock.
pub(super) fn write(out: &mut dyn Write, source: &Source) -> io::Result<()> {
    recording(out, source).map_err(io::Error::other)
}

/// What a field of a message is, where a viewer needs to know its type before it reads it.
type Fields<'a> = &'a [(&'a str, &'a str)];

fn recording(out: &mut dyn Write, source: &Source) -> Result<(), McapError> {
    let options = WriteOptions::new().compression(None).disable_seeking(true).library("topogrid");
    let mut writer = options.create(mcap::write::NoSeek::new(out))?;
    let pose: Fields = &[("timestamp", "object"), ("frame_id", "string"), ("pose", "object")];
    let path = channel(&mut writer, "/trajectory", "foxglove.PoseInFrame", pose)?;
    let raw = channel(&mut writer, "/odometry", "foxglove.PoseInFrame", pose)?;
    let scene: Fields = &[("deletions", "array"), ("entities", "array")];
    let places = channel(&mut writer, "/places", "foxglove.SceneUpdate", scene)?;
    let samples = source.mapper.trajectory().samples();
    let begin = samples.first().map_or(0.0, |sample| sample.stamp);
    put(&mut writer, places, 0, begin, &graph(source.atlas, source.frame, begin))?;
    for ((number, sample), map_from_robot) in (0..).zip(samples).zip(source.mapper.poses()) {
        let stamp = sample.stamp;
        put(&mut writer, path, number, stamp, &in_frame(&map_from_robot, source.frame, stamp))?;
        put(&mut writer, raw, number, stamp, &in_frame(&sample.odom_from_robot, "odom", stamp))?;
    }
    writer.finish()?;
    Ok(())
}

fn channel<W: Write + io::Seek>(
    writer: &mut Writer<W>,
    topic: &str,
    name: &str,
    fields: Fields,
) -> Result<u16, McapError> {
    let properties: BTreeMap<_, _> = fields.iter().map(|(name, kind)| (*name, json!({ "type": kind }))).collect();
    let schema = json!({ "title": name, "type": "object", "properties": properties });
    let schema = writer.add_schema(name, "jsonschema", schema.to_string().as_bytes())?;
    writer.add_channel(schema, topic, "json", &BTreeMap::new())
}

fn put<W: Write + io::Seek>(
    writer: &mut Writer<W>,
    channel_id: u16,
    sequence: u32,
    stamp: f64,
    message: &Value,
) -> Result<(), McapError> {
    let [seconds, nanoseconds] = split(stamp);
    let log_time = seconds * 1_000_000_000 + nanoseconds;
    let header = MessageHeader { channel_id, sequence, log_time, publish_time: log_time };
    writer.write_to_known_channel(&header, message.to_string().as_bytes())
}

/// Whole seconds and nanoseconds; times before the clock's beginning are its beginning.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "not negative, and within the clock's range"
)]
fn split(stamp: f64) -> [u64; 2] {
    let stamp = stamp.clamp(0.0, 9e9);
    let seconds = stamp.floor();
    // Stamps are written with microseconds: what lies below is rounding.
    [seconds as u64, ((stamp - seconds) * 1e6).round().min(999_999.0) as u64 * 1000]
}

fn time(stamp: f64) -> Value {
    let [sec, nsec] = split(stamp);
    json!({ "sec": sec, "nsec": nsec })
}

fn pose(pose: &Isometry2<f64>) -> Value {
    let (at, (sin, cos)) = (pose.translation.vector, (0.5 * pose.rotation.angle()).sin_cos());
    json!({
        "position": { "x": rounded(at.x), "y": rounded(at.y), "z": 0.0 },
        "orientation": { "x": 0.0, "y": 0.0, "z": sin, "w": cos },
    })
}

fn in_frame(at: &Isometry2<f64>, frame: &str, stamp: f64) -> Value {
    json!({ "timestamp": time(stamp), "frame_id": frame, "pose": pose(at) })
}

/// The places as spheres, and the links as lines, one list for each colour.
fn graph(atlas: &Atlas, frame: &str, stamp: f64) -> Value {
    let spheres = atlas.places.iter().filter(|place| place.visited).map(|place| {
        json!({
            "pose": pose(&Isometry2::translation(place.position.x, place.position.y)),
            "size": { "x": 0.3, "y": 0.3, "z": 0.3 }, "color": color([0.11, 0.42, 0.66], 1.0),
        })
    });
    let lines = COLORS.iter().enumerate().map(|(kind, (rgb, opacity))| {
        let ends = atlas.links.iter().filter(|link| kind_of(link) == kind).flat_map(|link| [link.from, link.to]);
        let points: Vec<Value> = ends.map(|end| point(&atlas.places[end].position)).collect();
        json!({
            "type": 2, "pose": pose(&Isometry2::identity()), "thickness": 0.06, "scale_invariant": false,
            "points": points, "color": color(*rgb, *opacity), "colors": [], "indices": [],
        })
    });
    let texts =
        atlas.places.iter().filter_map(|place| place.name.as_ref().map(|name| (place, name))).map(|(place, name)| {
            json!({
                "pose": pose(&Isometry2::translation(place.position.x, place.position.y)), "billboard": true,
                "font_size": 0.4, "scale_invariant": false, "color": color([0.0, 0.0, 0.0], 1.0), "text": name,
            })
        });
    json!({ "deletions": [], "entities": [{
        "timestamp": time(stamp), "frame_id": frame, "id": "places", "lifetime": { "sec": 0, "nsec": 0 },
        "frame_locked": true, "metadata": [], "arrows": [], "cubes": [], "cylinders": [], "triangles": [], "models": [],
        "spheres": spheres.collect::<Vec<_>>(), "lines": lines.collect::<Vec<_>>(), "texts": texts.collect::<Vec<_>>(),
    }]})
}

/// Driven links are grey, recognised ones red, what does not hold is light.
const COLORS: [([f64; 3], f64); 3] = [([0.33; 3], 1.0), ([0.82, 0.29, 0.36], 1.0), ([0.7; 3], 0.5)];

/// The place of a link's colour among [`COLORS`].
fn kind_of(link: &AtlasLink) -> usize {
    match (link.state, link.origin) {
        (LinkState::Rejected, _) | (_, LinkOrigin::Predicted) => 2,
        (_, LinkOrigin::Traveled) => 0,
        (_, LinkOrigin::Recognized) => 1,
    }
}

fn point(at: &Point2<f64>) -> Value {
    json!({ "x": rounded(at.x), "y": rounded(at.y), "z": 0.0 })
}

fn color([r, g, b]: [f64; 3], a: f64) -> Value {
    json!({ "r": r, "g": g, "b": b, "a": a })
}
