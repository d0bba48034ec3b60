#!/usr/bin/env python3
"""Check that pandas, polars and DuckDB read a record and agree on it.

Usage: check_record.py <record folder>

Prints one line per table. Exits with 1 and a message if a table cannot be opened, if the three
disagree on its columns, rows or values, if a table or the instants are not as many as run.json says, if
time_s is not time_us in seconds, or if a variance is not positive. Needs the packages in requirements.txt.
"""

import json
import math
import sys
from pathlib import Path

import duckdb
import pandas
import polars

TABLES = ["uavs", "truth", "tracks", "groups", "detections", "events", "targets", "views"]
# What each of several minds believes: all of them, or none.
OF_AGENTS = ["agents", "agent_tracks", "agent_groups", "agent_events", "agent_team"]
AXES = ["x", "vx", "ax", "y", "vy", "ay"]


class Mismatch(Exception):
    """The record is not as it should be."""


def main(arguments):
    if len(arguments) != 1:
        print(__doc__.strip(), file=sys.stderr)
        return 2
    folder = Path(arguments[0])
    try:
        manifest = json.loads((folder / "run.json").read_text(encoding="utf-8"))
        print(f"{folder}: {manifest['scenario']}, seed {manifest['seed']}, format {manifest['format']}")
        has_agents = (folder / "agents.parquet").exists()
        for table in TABLES + (OF_AGENTS if has_agents else []):
            path = folder / f"{table}.parquet"
            if table in ["truth", "views"] and not path.exists():
                print(f"{table}: taken out")
                continue
            print(check(table, path, manifest["counts"]))
    except Exception as error:  # whatever a library raises, the record is at fault or unreadable
        print(f"{folder}: {type(error).__name__}: {error}", file=sys.stderr)
        return 1
    return 0


def check(table, path, counts):
    """Reads one table three times; returns the line to print."""
    columns, rows = agreed(table, path)
    names = [name for name, _ in columns]
    values = dict(columns)
    require(rows == counts["rows"][table], table, f"has {rows} rows, run.json says {counts['rows'][table]}")
    if table == "uavs":
        instants = len(set(values["time_us"]))
        require(instants == counts["instants"], table, f"has {instants} instants, run.json says {counts['instants']}")
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
        unknown = set(values["status"]) - {"cued", "held", "coasting"}
        require(not unknown, table, f"unknown status {unknown}")
    if table in OF_AGENTS:
        order = list(zip(values["time_us"], values["agent"]))
        require(order == sorted(order), table, "is not in order of time and agent")
    page = (Path(__file__).parent.parent / "docs" / "record.md").read_text(encoding="utf-8")
    told = sections(page, table) + "`time_us` `time_s`"
    untold = [name for name in names if f"`{name}`" not in told]
    require(not untold, table, f"has columns that docs/record.md does not tell of: {untold}")
    for name, column in columns:
        bad = [v for v in column if isinstance(v, float) and not math.isfinite(v)]
        require(not bad, table, f"{name} holds {bad[:3]}")
    return f"{table}: {rows} rows, {len(names)} columns, {path.stat().st_size} bytes"


def sections(page, table):
    """What the page tells of a table, and of the one whose columns it has, too."""
    told = next(part for part in page.split("\n## ") if f"`{table}`" in part.split("\n")[0])
    of = {"agent_tracks": "tracks", "agent_groups": "groups", "agent_events": "events"}.get(table)
    return told + sections(page, of) if of else told


def agreed(table, path):
    """The columns, as lists of plain values, on which all three readers agree; and the rows."""
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
    # Through Arrow: pandas would turn a column with nulls into floats with NaN.
    columns = [(n, [None if v is pandas.NA else v for v in frame[n].tolist()]) for n in frame.columns]
    return columns, len(frame)


def by_polars(path):
    frame = polars.read_parquet(path)
    return [(name, frame[name].to_list()) for name in frame.columns], frame.height


def by_duckdb(path):
    # One thread keeps the order of the rows.
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
