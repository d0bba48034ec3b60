#!/usr/bin/env python3
"""Generates city.fcd.xml.gz and city.net.xml.gz: two groups of cars in a town; one car changes groups, two leave, the groups merge.

To run it (takes a few seconds):

    python3 -m venv venv && venv/bin/pip install eclipse-sumo==1.28.0
    venv/bin/python city.py

The files in this folder were made with SUMO 1.28.0. The town is generated: a grid of streets with randomly shifted
crossings, all with traffic lights. The same versions of SUMO and Python generate byte-identical files.
"""

from pathlib import Path

import town

# Seed of town and drivers; chosen from 70, together with the lights' cycle, so that groups split and merge as intended.
SEED = 32
END_S = 310
# Cycle of the traffic lights.
CYCLE_S = 44
TOWN = [
    "--grid", "--grid.number", 12, "--grid.length", 230, "--tls.cycle.time", CYCLE_S,
    "--perturb-x", "normc(0,18,-35,35)", "--perturb-y", "normc(0,18,-35,35)",
]  # fmt: skip
# Crossings that the cars pass: column letter and row number in the grid.
ROUTES = {
    # The first group goes north, then east to meet the second.
    "first": "D2 D3 D4 D5 D6 D7 E7 F7 G7 G8 G9 G10 G11",
    # Two cars of the first group that leave it.
    "astray": "D2 D3 D4 D5 D6 C6 B6 B5 B4 B3 B2 B1",
    # One car of the first group that drives to the second group.
    "over": "D2 D3 D4 E4 F4 G4 H4 H5 H6 H7 G7 G8 G9 G10 G11",
    # The second group.
    "second": "H2 H3 I3 I4 H4 H5 H6 H7 G7 G8 G9 G10 G11",
}
# Name: departure (s), route, index of its first street (from 0), position on it (m), top speed relative to the limit.
# Sorted by departure, as SUMO requires.
CARS = {
    "car1": (0, "first", 0, 150, 0.85),
    "car2": (0, "first", 0, 130, 0.95),
    "car3": (0, "astray", 0, 110, 0.95),
    "car4": (0, "astray", 0, 90, 1.00),
    "car5": (0, "over", 0, 70, 1.10),
    "car6": (0, "second", 0, 150, 0.75),
    "car7": (0, "second", 0, 130, 0.90),
    "car8": (0, "second", 0, 110, 0.95),
    "car9": (0, "second", 0, 90, 1.00),
    "car10": (0, "second", 0, 65, 1.05),
    # Joins the second group: pulls out from the roadside.
    "car11": (75, "second", 2, 20, 1.05),
}
# Cars whose trip ends early: index of the last street, position on it (m). The others are still driving at the end.
LEAVES = {"car8": (6, 100)}


def trips():
    """The cars as SUMO elements."""
    for name, (depart, route, first, place, speed) in CARS.items():
        streets = town.streets(ROUTES[route])
        last, arrival = LEAVES.get(name, (len(streets) - 1, "max"))
        yield town.trip(name, depart, place, speed, streets[first : last + 1], arrival)


if __name__ == "__main__":
    net, fcd = town.simulate(TOWN, trips(), END_S, SEED)
    town.pack(fcd, Path(__file__).with_name("city.fcd.xml.gz"))
    town.pack(town.streets_alone(net), Path(__file__).with_name("city.net.xml.gz"))
