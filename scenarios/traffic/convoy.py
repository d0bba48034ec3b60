#!/usr/bin/env python3
"""Makes convoy.fcd.xml.gz: six cars that drive through a small town as a convoy, stop at its lights and go on.

To run it (a few seconds):

    python3 -m venv venv && venv/bin/pip install eclipse-sumo==1.28.0
    venv/bin/python convoy.py

The file here was made with SUMO 1.28.0. The town is generated, not a real one: a grid of streets, its crossings shifted
at random, all of them with lights. The same versions of SUMO and Python make the same file, byte for byte.
"""

import gzip
import re
import subprocess
import sys
import tempfile
from pathlib import Path

# Of town and drivers; chosen among 25, with the lights' cycle, so that the group spreads and closes but stays together.
SEED = 22
END_S = 220
# Of the lights. Short, so that the tail of the convoy, if a light cuts it off, soon catches up.
CYCLE_S = 44
# Crossings that the convoy passes: column letter and row number of the grid.
ROUTE = "A1 B1 C1 C2 D2 E2 E3 E4 D4 C4 C5 B5 A5 A4 A3 B3 C3 D3".split()
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


def run(tool, *arguments):
    """Runs one of SUMO's programs; they lie next to the Python that pip installed them for."""
    subprocess.run([Path(sys.executable).with_name(tool), *map(str, arguments)], check=True, stdout=subprocess.DEVNULL)


def trips():
    """The cars and where they go, as SUMO reads them."""
    streets = [start + end for start, end in zip(ROUTE, ROUTE[1:])]
    yield "<routes>"
    yield '<vType id="car" sigma="0.5" speedDev="0"/>'
    for name, (depart, first, place, speed) in CARS.items():
        last, arrival = LEAVES.get(name, (len(streets) - 1, "max"))
        yield (
            f'<vehicle id="{name}" type="car" depart="{depart}" departPos="{place}" departSpeed="0"'
            f' speedFactor="{speed}" arrivalPos="{arrival}"><route edges="{" ".join(streets[first : last + 1])}"/></vehicle>'
        )
    yield "</routes>"


def simulate(folder):
    """The text that SUMO writes."""
    town, cars, fcd = folder / "town.net.xml", folder / "cars.rou.xml", folder / "fcd.xml"
    run(
        "netgenerate", "--grid", "--grid.number", 6, "--grid.length", 150, "--default.speed", 13.9,
        "--perturb-x", "normc(0,12,-25,25)", "--perturb-y", "normc(0,12,-25,25)", "--seed", SEED,
        "--default-junction-type", "traffic_light", "--tls.cycle.time", CYCLE_S, "--tls.left-green.time", 0,
        "--no-turnarounds", "--output-file", town,
    )  # fmt: skip
    cars.write_text("\n".join(trips()))
    run(
        "sumo", "--net-file", town, "--route-files", cars, "--begin", 0, "--end", END_S, "--step-length", 0.5,
        "--seed", SEED, "--no-step-log", "--precision", 2, "--fcd-output", fcd,
        "--fcd-output.attributes", "id,x,y,angle,speed",
    )  # fmt: skip
    return fcd.read_text()


def main():
    with tempfile.TemporaryDirectory() as folder:
        text = simulate(Path(folder))
    # The comments tell when and in which folder the file was made.
    text = re.sub(r"<!--.*?-->\s*", "", text, flags=re.DOTALL)
    target = Path(__file__).with_name("convoy.fcd.xml.gz")
    with target.open("wb") as file, gzip.GzipFile(filename="", mode="wb", fileobj=file, mtime=0) as packed:
        packed.write(text.encode())
    print(f"{target}: {target.stat().st_size} bytes")


if __name__ == "__main__":
    main()
