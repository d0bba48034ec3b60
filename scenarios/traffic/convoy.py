#!/usr/bin/env python3
"""Makes convoy.fcd.xml.gz and convoy.net.xml.gz: six cars that drive through a small town as a convoy, stop at its lights and go on.

To run it (a few seconds):

    python3 -m venv venv && venv/bin/pip install eclipse-sumo==1.28.0
    venv/bin/python convoy.py

The files here were made with SUMO 1.28.0. The town is generated, not a real one: a grid of streets, its crossings shifted
at random, all of them with lights. The same versions of SUMO and Python make the same files, byte for byte.
"""

from pathlib import Path

import town

# Of town and drivers; chosen among 25, with the lights' cycle, so that the group spreads and closes but stays together.
SEED = 22
END_S = 220
# Of the lights. Short, so that the tail of the convoy, if a light cuts it off, soon catches up.
CYCLE_S = 44
TOWN = [
    "--grid", "--grid.number", 6, "--grid.length", 150, "--tls.cycle.time", CYCLE_S,
    "--perturb-x", "normc(0,12,-25,25)", "--perturb-y", "normc(0,12,-25,25)",
]  # fmt: skip
# Crossings that the convoy passes: column letter and row number of the grid.
ROUTE = "A1 B1 C1 C2 D2 E2 E3 E4 D4 C4 C5 B5 A5 A4 A3 B3 C3 D3"
# Name: departure (s), first street of the route (from 0), place on it (m), top speed as a part of the limit.
# By departure, as SUMO wants them.
CARS = {
    "car1": (0, 0, 100, 0.90),
    "car2": (0, 0, 80, 1.00),
    "car3": (0, 0, 60, 1.05),
    "car4": (0, 0, 38, 1.00),
    "car5": (0, 0, 15, 1.05),
    # Joins: pulls out from the roadside.
    "car6": (35, 2, 20, 1.05),
}
# Whose trip ends early: last street of its route, place on it (m). The others are still under way at the end.
LEAVES = {"car3": (8, 60)}


def trips():
    """The cars and where they go."""
    streets = town.streets(ROUTE)
    for name, (depart, first, place, speed) in CARS.items():
        last, arrival = LEAVES.get(name, (len(streets) - 1, "max"))
        yield town.trip(name, depart, place, speed, streets[first : last + 1], arrival)


if __name__ == "__main__":
    net, fcd = town.simulate(TOWN, trips(), END_S, SEED)
    town.pack(fcd, Path(__file__).with_name("convoy.fcd.xml.gz"))
    town.pack(town.streets_alone(net), Path(__file__).with_name("convoy.net.xml.gz"))
