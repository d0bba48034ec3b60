"""Compares the run time from Python with that of the command, alternately.

    STANDOFF=target/release/standoff python run_and_command.py

The wheel and the command must be release builds of the same source. Prints medians of wall time, and the time to import
the package after NumPy.
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

SCENARIOS = [("improved/figure-9", 15), ("traffic/city", 9)]


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
