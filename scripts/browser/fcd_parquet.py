"""Writes SUMO floating-car data as Parquet: python fcd_parquet.py OUT.

Columns are those of `sumo --fcd-output FILE.parquet`.
"""

import sys

import pandas as pd

rows = [
    (float(t), f"car {k}", 10.0 * t + 30.0 * k, 3.0 * k * k)
    for t in range(61)
    for k in range(4)
]

table = pd.DataFrame(rows, columns=["timestep_time", "vehicle_id", "vehicle_x", "vehicle_y"])
table.to_parquet(sys.argv[1])
