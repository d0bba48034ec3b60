"""What convoy.py and city.py share: a generated town, cars that drive through it in SUMO, and their file."""

import gzip
import re
import subprocess
import sys
import tempfile
from pathlib import Path


def run(tool, *arguments):
    """Runs one of SUMO's programs; they lie next to the Python that pip installed them for."""
    subprocess.run([Path(sys.executable).with_name(tool), *map(str, arguments)], check=True, stdout=subprocess.DEVNULL)


def streets(crossings):
    """The streets of a route that is given by its crossings: column letter and row number of the grid."""
    names = crossings.split()
    return [start + end for start, end in zip(names, names[1:])]


def trip(name, depart, place, speed, route, arrival="max"):
    """A car that stands at a place (m) of the first street of its route, and starts; as SUMO reads it."""
    return (
        f'<vehicle id="{name}" type="car" depart="{depart}" departPos="{place}" departSpeed="0"'
        f' speedFactor="{speed}" arrivalPos="{arrival}"><route edges="{" ".join(route)}"/></vehicle>'
    )


def simulate(town, trips, end, seed):
    """What SUMO writes: the net and the FCD. The town: options of netgenerate. Trips: by departure, as SUMO wants them."""
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
    """A net without what only a simulation needs: ways across junctions, lights, who gives way. It is here to be looked at."""
    net = re.sub(r'\s*<edge id="[^"]*" function="internal">.*?</edge>', "", net, flags=re.DOTALL)
    net = re.sub(r"\s*<tlLogic .*?</tlLogic>", "", net, flags=re.DOTALL)
    net = re.sub(r"\s*<(?:connection|request) [^>]*/>", "", net)
    # Ends of lanes that were within junctions, too.
    return re.sub(r'\s*<junction id="[^"]*" type="internal"[^>]*/>', "", net)


def pack(text, target):
    """Writes the file, the same bytes for the same text."""
    # The comments tell when and in which folder the file was made.
    text = re.sub(r"<!--.*?-->\s*", "", text, flags=re.DOTALL)
    with target.open("wb") as file, gzip.GzipFile(filename="", mode="wb", fileobj=file, mtime=0) as packed:
        packed.write(text.encode())
    print(f"{target}: {target.stat().st_size} bytes")
