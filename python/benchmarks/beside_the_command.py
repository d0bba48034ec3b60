"""How long a run takes from Python, beside the same run of the command, in one process after the other.

    STANDOFF=target/release/standoff python beside_the_command.py

The wheel and the command have to be releases of the same source. Tells medians of wall time, alternating, and the time
to import the package, NumPy already there.
"""

from __future__ import annotations

import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import standoff

SCENARIOS = [("best/figure-9", 15), ("traffic/city", 9)]


def main() -> None:
    command = os.environ["STANDOFF"]
    code = "import numpy, time; began = time.perf_counter(); import standoff; print(time.perf_counter() - began)"
    imports_s = [float(subprocess.check_output([sys.executable, "-c", code])) for _ in range(7)]
    print(f"import: {1e3 * statistics.median(imports_s):.0f} ms")
    with tempfile.TemporaryDirectory() as temporary:
        started_s = []
        for _ in range(15):
            began = time.perf_counter()
            subprocess.run([command, "--version"], check=True, stdout=subprocess.DEVNULL)
            started_s.append(time.perf_counter() - began)
        start_s = statistics.median(started_s)
        for scenario, times in SCENARIOS:
            theirs_s, ours_s = [], []
            for number in range(times):
                out = Path(temporary, f"{scenario.replace('/', '-')}-{number}")
                began = time.perf_counter()
                subprocess.run([command, "run", scenario, "--out", out], check=True, stdout=subprocess.DEVNULL)
                theirs_s.append(time.perf_counter() - began - start_s)
                shutil.rmtree(out)
                began = time.perf_counter()
                standoff.run(scenario, out=out)
                ours_s.append(time.perf_counter() - began)
                shutil.rmtree(out)
            ours, theirs = statistics.median(ours_s), statistics.median(theirs_s)
            print(f"{scenario}: Python {1e3 * ours:.0f} ms, command {1e3 * theirs:.0f} ms, ratio {ours / theirs:.3f}")


if __name__ == "__main__":
    main()
