"""A town of 12 × 12 blocks and a drive of 10 km through it, for a page of ten thousand places; or a larger one.

    python3 town.py [BLOCKS METRES]       writes town.toml and town.txt
    topogrid simulate town.toml --waypoints town.txt --robot laser --firings 1 --seed 2 -o town.log
    topogrid run town.log -o runs/town --set places.spacing_m=0.9
    node load.mjs ../../../../target/browser /tmp runs/town/report.html
"""

import random
import sys

BLOCKS, LENGTH = (int(sys.argv[1]), float(sys.argv[2])) if len(sys.argv) == 3 else (12, 10_300.0)
BLOCK, STREET = 7.0, 2.5
PITCH = BLOCK + STREET
SIDE = BLOCKS * PITCH + STREET


def block(x, y, rng):
    """The outline of one block, its corners cut so that crossings differ."""
    a, b, c, d = (rng.choice([0, 0, 0.6, 1.2]) for _ in range(4))
    right, top = x + BLOCK, y + BLOCK
    return [[x + a, y], [right - b, y], [right - b, y + c], [right, y + c], [right, top - d], [right - a, top - d],
            [right - a, top], [x, top], [x, y + 0.8], [x + a, y + 0.8]]


def world(rng):
    walls = [[[0, 0], [SIDE, 0], [SIDE, SIDE], [0, SIDE]]]
    corners = [STREET + i * PITCH for i in range(BLOCKS)]
    walls += [block(x, y, rng) for x in corners for y in corners]
    lines = ['name = "town"', f"start = [{STREET / 2}, {STREET / 2}, 0.0]"]
    for wall in walls:
        lines += ["", "[[wall]]", f"points = {[[round(x, 2), round(y, 2)] for x, y in wall]}", "closed = true"]
    return "\n".join(lines) + "\n"


def drive(rng):
    """From crossing to crossing, never straight back, along the street that was driven least."""
    here, came, driven, visits, points = (0, 0), None, 0.0, {}, []
    while driven < LENGTH:
        (i, j) = here
        ways = [way for way in [(i + 1, j), (i - 1, j), (i, j + 1), (i, j - 1)]
                if way != came and all(0 <= k <= BLOCKS for k in way)]
        way = min(ways, key=lambda way: (visits.get(frozenset([here, way]), 0), rng.random()))
        visits[frozenset([here, way])] = visits.get(frozenset([here, way]), 0) + 1
        here, came, driven = way, here, driven + PITCH
        points.append("%.3f %.3f" % (STREET / 2 + way[0] * PITCH, STREET / 2 + way[1] * PITCH))
    return "\n".join(points) + "\n"


if __name__ == "__main__":
    rng = random.Random(5)
    for name, text in [("town.toml", world(rng)), ("town.txt", drive(rng))]:
        with open(name, "w") as file:
            file.write(text)
