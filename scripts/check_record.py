#!/usr/bin/env python3
"""Check that pandas, polars and DuckDB read a record and agree on it.

Usage: check_record.py <record folder>

Prints one line per table. Exits with 1 and a message if a table cannot be opened, if the three
disagree on its columns, rows or values, if the number of rows or time steps differs from run.json, if
time_s is not time_us in seconds, or if a variance is not positive. Needs the packages in requirements.txt.
"""

import json
import math
import sys
from pathlib import Path

import duckdb
import pandas
import polars

TABLES = ["uavs", "truth", "tracks", "groups", "detections", "events", "targets", "in_view"]
# Tables of per-UAV team states: either all of them exist, or none.
OF_AGENTS = ["agents", "agent_tracks", "agent_groups", "agent_events", "agent_teammates"]
AXES = ["x", "vx", "ax", "y", "vy", "ay"]


class Mismatch(Exception):
    """Error in a record."""


def main(arguments):
    if len(arguments) != 1:
        print(__doc__.strip(), file=sys.stderr)
        return 2
    folder = Path(arguments[0])
    try:
        manifest = json.loads((folder / "run.json").read_text(encoding="utf-8"))
        print(f"{folder}: {manifest['scenario']}, seed {manifest['seed']}, format {manifest['format']}")
        has_agents = (folder / "agents.parquet").exists()
        optional = [table for table in ["intruders", "tentative"] if (folder / f"{table}.parquet").exists()]
        for table in TABLES + optional + (OF_AGENTS if has_agents else []):
            path = folder / f"{table}.parquet"
            if table in ["truth", "in_view"] and not path.exists():
                print(f"{table}: not in this record")
                continue
            print(check(table, path, manifest["counts"]))
    except Exception as error:  # any exception of a library means a wrong or unreadable record
        print(f"{folder}: {type(error).__name__}: {error}", file=sys.stderr)
        return 1
    return 0


def check(table, path, counts):
    """Reads and checks a table with three libraries; returns the line to print."""
    columns, rows = agreed(table, path)
    names = [name for name, _ in columns]
    values = dict(columns)
    require(rows == counts["rows"][table], table, f"has {rows} rows, run.json has {counts['rows'][table]}")
    if table == "uavs":
        time_steps = len(set(values["time_us"]))
        require(time_steps == counts["time_steps"], table, f"has {time_steps} time steps, run.json has {counts['time_steps']}")
    if table == "targets":
        require(names == ["target", "name"], table, f"has columns {names}")
        require(values["target"] == list(range(rows)), table, "is not in order of target")
    else:
        require(names[:2] == ["time_us", "time_s"], table, f"begins with columns {names[:2]}")
        pairs = list(zip(values["time_us"], values["time_s"]))
        wrong = [us for us, s in pairs if s != us / 1e6]
        require(not wrong, table, f"time_s is not time_us / 1e6 at {wrong[:3]} us")
        times = values["time_us"]
        require(times == sorted(times), table, "is not in order of time")
    if table == "tracks":
        for axis in AXES:
            low = [v for v in values[f"cov_{axis}_{axis}"] if not v > 0]
            require(not low, table, f"cov_{axis}_{axis} is not positive: {low[:3]}")
        require(sum(name.startswith("cov_") for name in names) == 21, table, "lacks covariances")
        unknown = set(values["status"]) - {"cued", "updated", "coasting"}
        require(not unknown, table, f"unknown status {unknown}")
    if table in OF_AGENTS:
        order = list(zip(values["time_us"], values["agent"]))
        require(order == sorted(order), table, "is not in order of time and agent")
    page = (Path(__file__).parent.parent / "docs" / "user" / "record.md").read_text(encoding="utf-8")
    text = sections(page, table) + "`time_us` `time_s` `time_utc` `latitude_deg` `longitude_deg`"
    undocumented = [name for name in names if f"`{name}`" not in text]
    require(not undocumented, table, f"has columns that docs/user/record.md does not describe: {undocumented}")
    for name, column in columns:
        bad = [v for v in column if isinstance(v, float) and not math.isfinite(v)]
        require(not bad, table, f"{name} contains {bad[:3]}")
    return f"{table}: {rows} rows, {len(names)} columns, {path.stat().st_size} bytes"


def sections(page, table):
    """Returns the section of the page on a table, and that on the table with the same columns, if any."""
    text = next(part for part in page.split("\n## ") if f"`{table}`" in part.split("\n")[0])
    base = {"agent_tracks": "tracks", "agent_groups": "groups", "agent_events": "events"}.get(table)
    return text + sections(page, base) if base else text


def agreed(table, path):
    """Returns the columns, as lists of plain values, and the number of rows, if all three readers agree."""
    readings = {"pandas": by_pandas(path), "polars": by_polars(path), "duckdb": by_duckdb(path)}
    columns, rows = readings["pandas"]
    names = [name for name, _ in columns]
    for reader, (others, count) in readings.items():
        other_names = [name for name, _ in others]
        require(count == rows, table, f"{reader} finds {count} rows, pandas {rows}")
        require(other_names == names, table, f"{reader} finds columns {other_names}, pandas {names}")
        for (name, ours), (_, theirs) in zip(columns, others):
            require(ours == theirs, table, f"{reader} and pandas differ in {name}")
    return columns, rows


def by_pandas(path):
    frame = pandas.read_parquet(path, engine="pyarrow", dtype_backend="pyarrow")
    # Arrow types, because pandas would convert a column with nulls to floats with NaN.
    columns = [(n, [None if v is pandas.NA else v for v in frame[n].tolist()]) for n in frame.columns]
    return columns, len(frame)


def by_polars(path):
    frame = polars.read_parquet(path)
    return [(name, frame[name].to_list()) for name in frame.columns], frame.height


def by_duckdb(path):
    # A single thread keeps the order of the rows.
    connection = duckdb.connect(config={"threads": 1})
    result = connection.execute("SELECT * FROM read_parquet(?)", [str(path)])
    names = [entry[0] for entry in result.description]
    rows = result.fetchall()
    return [(name, [row[i] for row in rows]) for i, name in enumerate(names)], len(rows)


def require(holds, table, what):
    if not holds:
        raise Mismatch(f"{table}: {what}")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
