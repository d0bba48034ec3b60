"""Two cars on a winding road in SUMO, which advances in real time for its TraCI clients: of each aircraft, `standoff fly`
and this one."""

import math
import subprocess
import threading
import time
from pathlib import Path

import sumo
import traci

# The cars' positions are requested with this period, s.
PERIOD_S = 0.2
SPEED_M_S = 6
NODES_M = [(0, 0), (400, 60), (800, -40), (1200, 80), (1600, 0), (4000, 0)]


class Road:
    """A running simulation, and the state of its cars."""

    def __init__(self, folder, port, aircraft):
        programs = Path(sumo.SUMO_HOME) / "bin"
        nodes = "".join(f'<node id="n{n}" x="{x}" y="{y}"/>' for n, (x, y) in enumerate(NODES_M))
        names = [f"e{n}" for n in range(len(NODES_M) - 1)]
        edges = "".join(f'<edge id="{name}" from="n{n}" to="n{n + 1}" numLanes="1" speed="13.9"/>'
                        for n, name in enumerate(names))
        cars = "".join(f'<vehicle id="car.{n}" type="car" route="road" depart="0" departPos="{10 + 30 * n}" '
                       f'departSpeed="{SPEED_M_S}"/>' for n in (1, 0))
        (folder / "road.nod.xml").write_text(f"<nodes>{nodes}</nodes>")
        (folder / "road.edg.xml").write_text(f"<edges>{edges}</edges>")
        (folder / "road.rou.xml").write_text(
            f'<routes><vType id="car" maxSpeed="{SPEED_M_S}" speedDev="0" sigma="0"/>'
            f'<route id="road" edges="{" ".join(names)}"/>{cars}</routes>')
        net = folder / "road.net.xml"
        subprocess.run([programs / "netconvert", "-n", folder / "road.nod.xml", "-e", folder / "road.edg.xml",
                        "-o", net, "--offset.disable-normalization", "true"], check=True, stdout=subprocess.DEVNULL)
        self.port, self.aircraft = port, aircraft
        self.process = subprocess.Popen(
            [programs / "sumo", "-n", net, "-r", folder / "road.rou.xml", "--remote-port", str(port),
             "--num-clients", str(2 * aircraft), "--step-length", str(PERIOD_S), "--no-step-log"],
            stdout=subprocess.DEVNULL, stderr=(folder / "sumo.log").open("w"))

    def follow(self, number, seconds):
        """Starts to follow the cars in a thread. Call it in the process of the aircraft with this number."""
        self.cars, self.known_at = {}, time.monotonic()
        threading.Thread(target=self.run, args=(number, seconds), daemon=True).start()

    def run(self, number, seconds):
        connection = traci.connect(self.port, numRetries=20, waitBetweenRetries=0.5)
        # The first orders are those of `standoff fly`.
        connection.setOrder(self.aircraft + number + 1)
        begun_at = time.monotonic()
        for count in range(1, round(seconds / PERIOD_S)):
            time.sleep(max(begun_at + count * PERIOD_S - time.monotonic(), 0))
            connection.simulationStep(count * PERIOD_S)
            cars = {}
            for name in connection.vehicle.getIDList():
                east_m, north_m = connection.vehicle.getPosition(name)
                speed_m_s, angle = connection.vehicle.getSpeed(name), math.radians(connection.vehicle.getAngle(name))
                velocity = (speed_m_s * math.cos(angle), speed_m_s * math.sin(angle))
                cars[name] = ((north_m, east_m), velocity)
            self.cars, self.known_at = cars, time.monotonic()
        connection.close()

    def targets(self):
        """Position and velocity of each car now, metres north and east."""
        age_s = time.monotonic() - self.known_at
        return {name: ((at[0] + v[0] * age_s, at[1] + v[1] * age_s), v) for name, (at, v) in self.cars.items()}
