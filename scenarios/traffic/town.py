"""Shared by convoy.py and city.py: generates a town, simulates cars in it with SUMO, and packs the output files."""

import gzip
import re
import subprocess
import sys
import tempfile
from pathlib import Path


def run(tool, *arguments):
    """Runs one of SUMO's programs, which pip installs next to the Python interpreter."""
    subprocess.run([Path(sys.executable).with_name(tool), *map(str, arguments)], check=True, stdout=subprocess.DEVNULL)


def streets(crossings):
    """The streets of a route given by its crossings: column letter and row number in the grid."""
    names = crossings.split()
    return [start + end for start, end in zip(names, names[1:])]


def trip(name, depart, place, speed, route, arrival="max"):
    """SUMO element of a car that starts from standstill at a position (m) on the first street of its route."""
    return (
        f'<vehicle id="{name}" type="car" depart="{depart}" departPos="{place}" departSpeed="0"'
        f' speedFactor="{speed}" arrivalPos="{arrival}"><route edges="{" ".join(route)}"/></vehicle>'
    )


def simulate(town, trips, end, seed):
    """Runs SUMO; returns the net and the FCD output. ``town``: options of netgenerate; ``trips``: sorted by departure."""
    with tempfile.TemporaryDirectory() as folder:
        net, cars, fcd = (Path(folder, name) for name in ("town.net.xml", "cars.rou.xml", "fcd.xml"))
        run(
            "netgenerate", *town, "--default.speed", 13.9, "--default-junction-type", "traffic_light",
            "--tls.left-green.time", 0, "--no-turnarounds", "--seed", seed, "--output-file", net,
        )  # fmt: skip
        cars.write_text("\n".join(["<routes>", '<vType id="car" sigma="0.5" speedDev="0"/>', *trips, "</routes>"]))
        run(
            "sumo", "--net-file", net, "--route-files", cars, "--begin", 0, "--end", end, "--step-length", 0.5,
            "--seed", seed, "--no-step-log", "--precision", 2, "--fcd-output", fcd,
            "--fcd-output.attributes", "id,x,y,angle,speed",
        )  # fmt: skip
        return net.read_text(), fcd.read_text()


def streets_alone(net):
    """The net for display only: without internal edges, traffic lights and rights of way, which only SUMO needs."""
    net = re.sub(r'\s*<edge id="[^"]*" function="internal">.*?</edge>', "", net, flags=re.DOTALL)
    net = re.sub(r"\s*<tlLogic .*?</tlLogic>", "", net, flags=re.DOTALL)
    net = re.sub(r"\s*<(?:connection|request) [^>]*/>", "", net)
    # Remove the junctions of internal lanes, too.
    return re.sub(r'\s*<junction id="[^"]*" type="internal"[^>]*/>', "", net)


def pack(text, target):
    """Writes a gzip file; the same text gives the same bytes."""
    # Remove comments, because they contain the time and folder of the simulation.
    text = re.sub(r"<!--.*?-->\s*", "", text, flags=re.DOTALL)
    with target.open("wb") as file, gzip.GzipFile(filename="", mode="wb", fileobj=file, mtime=0) as packed:
        packed.write(text.encode())
    print(f"{target}: {target.stat().st_size} bytes")
