#!/usr/bin/env python3
"""Generates convoy.fcd.xml.gz and convoy.net.xml.gz: six cars drive through a small town as a convoy and stop at traffic lights.

To run it (takes a few seconds):

    python3 -m venv venv && venv/bin/pip install eclipse-sumo==1.28.0
    venv/bin/python convoy.py

The files in this folder were made with SUMO 1.28.0. The town is generated: a grid of streets with randomly shifted
crossings, all with traffic lights. The same versions of SUMO and Python generate byte-identical files.
"""

from pathlib import Path

import town

# Seed of town and drivers; chosen from 25, together with the lights' cycle, so that the group spreads and closes up again.
SEED = 22
END_S = 220
# Cycle of the traffic lights; short, so that cars stopped by a light soon catch up with the convoy.
CYCLE_S = 44
TOWN = [
    "--grid", "--grid.number", 6, "--grid.length", 150, "--tls.cycle.time", CYCLE_S,
    "--perturb-x", "normc(0,12,-25,25)", "--perturb-y", "normc(0,12,-25,25)",
]  # fmt: skip
# Crossings that the convoy passes: column letter and row number in the grid.
ROUTE = "A1 B1 C1 C2 D2 E2 E3 E4 D4 C4 C5 B5 A5 A4 A3 B3 C3 D3"
# Name: departure (s), index of the first street (from 0), position on it (m), top speed relative to the limit.
# Sorted by departure, as SUMO requires.
CARS = {
    "car1": (0, 0, 100, 0.90),
    "car2": (0, 0, 80, 1.00),
    "car3": (0, 0, 60, 1.05),
    "car4": (0, 0, 38, 1.00),
    "car5": (0, 0, 15, 1.05),
    # Joins: pulls out from the roadside.
    "car6": (35, 2, 20, 1.05),
}
# Cars whose trip ends early: index of the last street, position on it (m). The others are still driving at the end.
LEAVES = {"car3": (8, 60)}


def trips():
    """The cars as SUMO elements."""
    streets = town.streets(ROUTE)
    for name, (depart, first, place, speed) in CARS.items():
        last, arrival = LEAVES.get(name, (len(streets) - 1, "max"))
        yield town.trip(name, depart, place, speed, streets[first : last + 1], arrival)


if __name__ == "__main__":
    net, fcd = town.simulate(TOWN, trips(), END_S, SEED)
    town.pack(fcd, Path(__file__).with_name("convoy.fcd.xml.gz"))
    town.pack(town.streets_alone(net), Path(__file__).with_name("convoy.net.xml.gz"))
