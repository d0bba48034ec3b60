#!/usr/bin/env python3
"""Generates town.poly.xml.gz: buildings in the blocks between the streets of convoy.net.xml.gz, as SUMO polygons.

Python alone runs it:

    python3 town_buildings.py

Each block has a row of buildings along each of its four streets, with gaps between them and a yard in the middle.
"""

import gzip
import random
import re
from pathlib import Path

import town

SEED = 1
# Distance of the front walls from the middle of the streets, depth of the buildings, and gaps between them, m.
FRONT_M, DEPTH_M, GAP_M = 12, 13, 8
# Number of buildings on each side of a block, and their heights, m.
ON_A_SIDE, HEIGHTS_M = 3, (6, 9, 12, 15, 18, 24)
COLUMNS = "ABCDEF"


def crossings(net):
    """Position of each crossing by name, m."""
    found = re.findall(r'<junction id="([A-F][0-5])"[^>]*? x="([^"]*)" y="([^"]*)"', net)
    return {name: (float(x), float(y)) for name, x, y in found}


def between(a, b, part):
    """Point at a part of the way from a to b."""
    return tuple(p + part * (q - p) for p, q in zip(a, b))


def inset(corners, distance):
    """Quadrilateral whose sides are that far inside those of another, which is anticlockwise."""
    moved = []
    for (ax, ay), (bx, by) in zip(corners, corners[1:] + corners[:1]):
        length = ((bx - ax) ** 2 + (by - ay) ** 2) ** 0.5
        nx, ny = -(by - ay) / length, (bx - ax) / length
        moved.append(((ax + distance * nx, ay + distance * ny), (bx - ax, by - ay)))
    points = []
    for (p, d), (q, e) in zip(moved[-1:] + moved[:-1], moved):
        part = ((q[0] - p[0]) * e[1] - (q[1] - p[1]) * e[0]) / (d[0] * e[1] - d[1] * e[0])
        points.append((p[0] + part * d[0], p[1] + part * d[1]))
    return points


def block(corners):
    """Outlines of the buildings of a block."""
    front, back = inset(corners, FRONT_M), inset(corners, FRONT_M + DEPTH_M)
    for side in range(4):
        ends = front[side], front[(side + 1) % 4], back[(side + 1) % 4], back[side]
        length = sum((p - q) ** 2 for p, q in zip(*ends[:2])) ** 0.5
        gap = GAP_M / length
        # The corner belongs to the row of the previous side.
        start = (DEPTH_M + GAP_M) / length
        width = (1 - start - (ON_A_SIDE - 1) * gap) / ON_A_SIDE
        for index in range(ON_A_SIDE):
            low = start + index * (width + gap)
            at = low, low + width
            near = [between(ends[0], ends[1], part) for part in at]
            # At right angles to the front, so that rows of neighbouring sides do not overlap.
            along = tuple((q - p) / length for p, q in zip(*ends[:2]))
            deep = [(x - DEPTH_M * along[1], y + DEPTH_M * along[0]) for x, y in reversed(near)]
            yield near + deep


def main():
    folder = Path(__file__).parent
    at = crossings(gzip.decompress((folder / "convoy.net.xml.gz").read_bytes()).decode())
    heights, polygons = random.Random(SEED), []
    for column, east in zip(COLUMNS, COLUMNS[1:]):
        for row in range(5):
            names = f"{column}{row}", f"{east}{row}", f"{east}{row + 1}", f"{column}{row + 1}"
            for outline in block([at[name] for name in names]):
                shape = " ".join(f"{x:.2f},{y:.2f}" for x, y in outline)
                height = HEIGHTS_M[int(heights.random() * len(HEIGHTS_M))]
                polygons.append(
                    f'    <poly id="b{len(polygons)}" type="building" fill="1" shape="{shape}">'
                    f'<param key="height" value="{height}"/></poly>'
                )
    town.pack("\n".join(["<additional>", *polygons, "</additional>", ""]), folder / "town.poly.xml.gz")


main()
