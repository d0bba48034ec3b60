"""Checks exported files of a run with independent readers: python check_export.py DIR.

The program $STANDOFF writes them. They are read with fastkml, gpxpy, GeoPandas and czml3; positions are projected with PROJ.
"""

import json
import os
import subprocess
import sys
from datetime import datetime, timedelta, timezone
from pathlib import Path

import czml3
import fastkml
import geopandas
import gpxpy
import numpy as np
import pandas as pd
from fastkml.gx import Track
from pyproj import Transformer
from shapely.geometry import shape

BEGIN = datetime(2026, 7, 1, 8, 0, tzinfo=timezone.utc)
# About 0.1 mm.
TOLERANCE_DEG = 1e-9


def main(run: Path) -> None:
    manifest = json.loads((run / "run.json").read_text())
    given = manifest.get("origin")
    origin = given or {"latitude_deg": -35.36, "longitude_deg": 149.165}
    files = {kind: run / f"export.{kind}" for kind in ("kml", "geojson", "gpx", "czml")}
    begin_us = manifest.get("begin_unix_us")
    command = [os.environ["STANDOFF"], "export", str(run)]
    if begin_us is None:
        command += ["--begin", "2026-07-01T10:00:00+02:00"]
    else:
        # The traffic of these checks begins then, too.
        assert datetime.fromtimestamp(begin_us / 1e6, timezone.utc) == BEGIN
    if not given:
        command.append("--origin={latitude_deg},{longitude_deg}".format(**origin))
    for kind, file in files.items():
        command += [f"--{kind}", str(file)]
    subprocess.run(command, check=True)

    # The tangent plane of the record is the orthographic projection of the ellipsoid.
    plane = f"+proj=ortho +lat_0={origin['latitude_deg']} +lon_0={origin['longitude_deg']} +ellps=WGS84"
    to_degrees = Transformer.from_crs(plane, "EPSG:4326", always_xy=True)
    to_metres = Transformer.from_crs("EPSG:4326", plane, always_xy=True)
    uavs = pd.read_parquet(run / "uavs.parquet")
    tracks = pd.read_parquet(run / "tracks.parquet")
    paths = {f"UAV {uav}": rows for uav, rows in uavs.groupby("uav")}
    names = pd.read_parquet(run / "targets.parquet").set_index("target")["name"]
    paths |= {names.get(rows["target"].iloc[0]): rows for _, rows in tracks.groupby("track")}

    if given:
        check_columns(run, to_degrees)
    check_kml(files["kml"], paths, to_degrees)
    check_gpx(files["gpx"], paths, to_degrees)
    check_geojson(files["geojson"], run, to_metres)
    # The reader refuses what is no CZML.
    document = czml3.Document.model_validate({"packets": json.loads(files["czml"].read_text())})
    assert len(document.packets) > len(paths)
    print(f"check_export: {run.name}: {len(paths)} paths, {len(document.packets)} packets agree")


def check_columns(run: Path, to_degrees: Transformer) -> None:
    """Checks places and times in the tables."""
    for table in ("uavs", "truth", "tracks", "groups"):
        rows = pd.read_parquet(run / f"{table}.parquet")
        longitude_deg, latitude_deg = to_degrees.transform(rows["x_m"], rows["y_m"])
        assert np.abs(rows["latitude_deg"] - latitude_deg).max() < TOLERANCE_DEG, table
        assert np.abs((rows["longitude_deg"] - longitude_deg + 180) % 360 - 180).max() < TOLERANCE_DEG, table
        if "time_utc" in rows:
            assert (rows["time_utc"] == BEGIN + pd.to_timedelta(rows["time_us"], "us")).all(), table


def check_path(name: str, times: list[datetime], degrees: np.ndarray, paths: dict, to_degrees: Transformer) -> None:
    rows = paths[name]
    expected = np.column_stack(to_degrees.transform(rows["x_m"], rows["y_m"]))
    assert degrees.shape == expected.shape, name
    assert np.abs(degrees - expected).max() < TOLERANCE_DEG, (name, np.abs(degrees - expected).max())
    utc = [BEGIN + timedelta(microseconds=int(us)) for us in rows["time_us"]]
    assert all(abs(a - b) < timedelta(milliseconds=1) for a, b in zip(times, utc, strict=True)), name


def check_kml(file: Path, paths: dict, to_degrees: Transformer) -> None:
    document = fastkml.KML.parse(file).features[0]
    folders = {folder.name: folder.features for folder in document.features}
    found = set()
    for placemark in folders["UAVs"] + folders["Tracks"]:
        track = placemark.kml_geometry
        assert isinstance(track, Track)
        times = [item.when.dt for item in track.track_items]
        degrees = np.array([[item.coord.x, item.coord.y] for item in track.track_items])
        check_path(placemark.name, times, degrees, paths, to_degrees)
        found.add(placemark.name)
    assert found == set(paths)
    for placemark in folders["Orbits"] + folders["Fields of view"] + folders["Gaps"]:
        assert shape(placemark.geometry).is_valid and placemark.times is not None


def check_gpx(file: Path, paths: dict, to_degrees: Transformer) -> None:
    gpx = gpxpy.parse(file.read_text())
    assert {track.name for track in gpx.tracks} == set(paths)
    for track in gpx.tracks:
        points = track.segments[0].points
        degrees = np.array([[point.longitude, point.latitude] for point in points])
        check_path(track.name, [point.time for point in points], degrees, paths, to_degrees)


def check_geojson(file: Path, run: Path, to_metres: Transformer) -> None:
    frame = geopandas.read_file(file)
    assert frame.crs.to_epsg() == 4326 and frame.geometry.is_valid.all()
    groups = pd.read_parquet(run / "groups.parquet")
    orbits = frame[frame["kind"] == "orbit"]
    assert len(orbits) > 0
    for name, begin, ring in zip(orbits["name"], pd.to_datetime(orbits["begin"]), orbits.geometry.exterior, strict=True):
        time_us = round((begin - BEGIN).total_seconds() * 1e6)
        row = groups[(groups["time_us"] == time_us) & (groups["group"] == int(name.split()[1]))].iloc[0]
        x_m, y_m = to_metres.transform(*np.array(ring.coords).T)
        radius_m = np.hypot(x_m - row["x_m"], y_m - row["y_m"])
        assert np.abs(radius_m - row["standoff_distance_m"]).max() < 1e-4
    assert gaps_of(run) == sorted(
        (name, *((pd.Timestamp(end) - BEGIN).total_seconds() for end in (begin, until)))
        for name, begin, until in frame.loc[frame["kind"] == "gap", ["name", "begin", "end"]].itertuples(index=False)
    )


def gaps_of(run: Path) -> list[tuple[str, float, float]]:
    """Times of at least 2 s in which an existing target is in no UAV's view: name, begin and end, s."""
    truth = pd.read_parquet(run / "truth.parquet")
    names = pd.read_parquet(run / "targets.parquet").set_index("target")["name"]
    period_s = json.loads((run / "run.json").read_text())["period_s"]
    in_view = set(pd.read_parquet(run / "in_view.parquet")[["target", "time_us"]].itertuples(index=False, name=None))
    gaps = []
    for target, rows in truth.groupby("target"):
        # The first time step of a target does not count.
        times_us = rows["time_us"].sort_values().iloc[1:]
        is_seen = times_us.map(lambda time_us, target=target: (target, time_us) in in_view)
        for _, out_us in times_us[~is_seen].groupby(is_seen.cumsum()):
            begin_s, end_s = out_us.min() / 1e6, out_us.max() / 1e6 + period_s
            if end_s - begin_s >= 2.0:
                gaps.append((names[target], begin_s, end_s))
    return sorted(gaps)


main(Path(sys.argv[1]))
