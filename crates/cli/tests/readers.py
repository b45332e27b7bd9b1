"""Reads what topogrid exports with other people's readers and prints what they saw, as JSON.

    python3 readers.py FORMAT FILE...

Exit code 77 means that the reader is not installed.
"""

import importlib
import json
import sys


def installed(module, package=None):
    """The module, where the package that holds it is installed; else the reading is skipped with a word."""
    try:
        return importlib.import_module(module)
    except ImportError:
        print(f"skipped: the Python package {package or module} is not installed")
        sys.exit(77)


def tum(path):
    path = installed("evo.tools.file_interface", "evo").read_tum_trajectory_file(path)
    assert path.check()[0], path.check()[1]
    return {"poses": path.num_poses, "length_m": path.path_length, "end": path.positions_xyz[-1].tolist()}


def geojson(path):
    geojson = installed("geojson")
    with open(path) as file:
        collection = geojson.load(file)
    assert collection.is_valid, collection.errors()
    kinds = [feature["geometry"]["type"] for feature in collection["features"]]
    return {"features": len(kinds), "points": kinds.count("Point"), "lines": len(kinds) - kinds.count("Point")}


def nav2(path):
    """As Nav2's GeoJsonGraphFileLoader goes through a file."""
    with open(path) as file:
        features = json.load(file)["features"]
    points = [f for f in features if f["geometry"]["type"] == "Point"]
    lines = [f for f in features if f["geometry"]["type"] in ("MultiLineString", "LineString")]
    where = {f["properties"]["id"]: f["geometry"]["coordinates"] for f in points}
    ids = [f["properties"]["id"] for f in features]
    assert all(isinstance(number, int) and number >= 0 for number in ids)
    assert len(set(ids)) == len(ids), "ids must be unique across nodes and edges"
    ways = set()
    for line in lines:
        start, end = line["properties"]["startid"], line["properties"]["endid"]
        stretch = line["geometry"]["coordinates"][0]
        assert stretch == [where[start], where[end]], "a line begins and ends at its nodes"
        assert isinstance(line["properties"]["cost"], float)
        ways.add((start, end))
    assert all((end, start) in ways for start, end in ways), "both directions"
    for feature in features:
        for value in feature["properties"]["metadata"].values():
            assert isinstance(value, (int, float, str, bool))
    return {"nodes": len(points), "edges": len(lines)}


# What topological_navigation asks of a map (its published schema, in our words): the keys that must be there, each with
# what it holds; a list has one rule for all of its items.
TMAP2 = {
    "meta": {"last_updated": r"^\d{4}-\d\d-\d\d_\d\d-\d\d-\d\d$"},
    "metric_map": str,
    "name": str,
    "pointset": str,
    "nodes": [
        {
            "meta": {"map": str, "node": str, "pointset": str},
            "node": {
                "name": str,
                "parent_frame": str,
                "pose": {"position": {"x": float, "y": float, "z": float}, "orientation": {"w": float, "z": float}},
                "properties": {"xy_goal_tolerance": float, "yaw_goal_tolerance": float},
                "verts": [{"x": float, "y": float}],
                "edges": [{"edge_id": str, "node": str, "action": str, "action_type": str, "goal": {"target_pose": dict}}],
            },
        }
    ],
}


def schema(rule):
    """The rule as a JSON schema."""
    if isinstance(rule, dict):
        return {"type": "object", "required": list(rule), "properties": {key: schema(inner) for key, inner in rule.items()}}
    if isinstance(rule, list):
        return {"type": "array", "items": schema(rule[0])}
    if isinstance(rule, str):
        return {"type": "string", "pattern": rule}
    return {"type": {str: "string", float: "number", dict: "object"}[rule]}


def g2o(path):
    gtsam = installed("gtsam")
    graph, poses = gtsam.readG2o(path, False)
    return {"poses": poses.size(), "edges": graph.size(), "chi2": 2 * graph.error(poses)}


def tmap2(path):
    yaml, jsonschema = installed("yaml", "PyYAML"), installed("jsonschema")
    with open(path) as file:
        tmap = yaml.safe_load(file)
    jsonschema.Draft7Validator(schema(TMAP2)).validate(tmap)
    names = [node["node"]["name"] for node in tmap["nodes"]]
    edges = [edge["node"] for node in tmap["nodes"] for edge in node["node"]["edges"]]
    assert len(set(names)) == len(names) and set(edges) <= set(names)
    for node in tmap["nodes"]:
        turn = node["node"]["pose"]["orientation"]
        assert abs(turn["w"] ** 2 + turn["z"] ** 2 - 1) < 1e-6
    return {"nodes": len(names), "edges": len(edges), "names": names}


def dot(path):
    networkx, pydot = installed("networkx"), installed("pydot")
    graph = networkx.Graph(networkx.nx_pydot.from_pydot(pydot.graph_from_dot_file(path)[0]))
    graph.remove_nodes_from([node for node in graph if not node.startswith("P")])
    spots = [attributes["pos"] for _, attributes in graph.nodes(data=True)]
    assert all(spot.strip('"').endswith("!") for spot in spots)
    return {"nodes": len(graph), "edges": graph.number_of_edges(), "connected": networkx.is_connected(graph)}


def map_server(path):
    yaml = installed("yaml", "PyYAML")
    with open(path) as file:
        header = yaml.safe_load(file)
    assert header["free_thresh"] < 50 / 255 < header["occupied_thresh"] and header["negate"] == 0
    assert header["image"] == "map.pgm" and header["origin"][2] == 0
    with open(path.replace("map.yaml", header["image"]), "rb") as file:
        kind, size, depth, pixels = file.read().split(b"\n", 3)
    columns, rows = map(int, size.split())
    assert kind == b"P5" and depth == b"255" and len(pixels) == rows * columns
    cells = {"occupied": 0, "free": 0, "unknown": 0}
    for shade in pixels:  # as nav2_map_server's loader decides
        share = (255 - shade) / 255
        word = "occupied" if share > header["occupied_thresh"] else "free" if share < header["free_thresh"] else "unknown"
        cells[word] += 1
    return {"rows": rows, "columns": columns, **cells}


def mcap(path):
    make_reader = installed("mcap.reader", "mcap").make_reader
    counts, last = {}, {}
    with open(path, "rb") as file:
        for schema, channel, message in make_reader(file, validate_crcs=True).iter_messages():
            assert channel.message_encoding == "json" and json.loads(schema.data)["title"] == schema.name
            counts[channel.topic] = counts.get(channel.topic, 0) + 1
            last[channel.topic] = json.loads(message.data)
    at = last["/trajectory"]["pose"]["position"]
    scene = last["/places"]["entities"][0]
    return {"counts": counts, "end": [at["x"], at["y"]], "places": len(scene["spheres"])}


if __name__ == "__main__":
    print(json.dumps(globals()[sys.argv[1]](*sys.argv[2:])))
