"""MCAP files with Foxglove's schemas for robotics viewers, from records: ``python -m standoff.mcap RECORD FILE``.

Needs ``pip install 'standoff[mcap]'``. docs/user/mcap.md describes the topics. Imports no other module of the package.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import stat
import struct
import sys
import tomllib
from collections.abc import Iterable, Iterator
from heapq import merge
from itertools import groupby
from pathlib import Path
from typing import IO, Any

try:
    import numpy as np
    import pyarrow  # type: ignore[import-untyped]
    import pyarrow.parquet as pq  # type: ignore[import-untyped]
    from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
    from foxglove_schemas_protobuf.LocationFix_pb2 import LocationFix
    from foxglove_schemas_protobuf.Log_pb2 import Log
    from foxglove_schemas_protobuf.PointCloud_pb2 import PointCloud
    from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
    from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
    from google.protobuf import descriptor_pb2  # type: ignore[import-untyped]
    from google.protobuf.descriptor_pool import DescriptorPool  # type: ignore[import-untyped]
    from google.protobuf.message_factory import GetMessageClass  # type: ignore[import-untyped]
    from mcap.writer import MCAP0_MAGIC, CompressionType, Writer
    from mcap_protobuf.schema import register_schema
except ModuleNotFoundError as error:
    raise ModuleNotFoundError(f"standoff.mcap: {error}; pip install 'standoff[mcap]'", name=error.name) from error

__all__ = ["write_mcap"]

Fields = dict[str, Any]
"""A row of a table, or a message by field; Protobuf's constructors convert nested ones."""
Point = tuple[float, float, float]

FORMAT = 7
"""Number of the record format that is read."""
TABLES = ["uavs", "truth", "tracks", "groups", "events"]
NO_TARGET = 2**30
"""Smallest number of a track of no target."""
FURTHEST_M = 1e6
"""Maximum distance from the origin at which positions have a latitude and a longitude, m."""
SEMI_AXES_M = np.array([6378137.0, 6378137.0, 6356752.314245179])
"""Semi-axes of the WGS84 ellipsoid, m."""
ELLIPSE_SDS = 2.447746830680816
"""Size of the ellipse with 95 % of a two-dimensional normal distribution, in standard deviations."""
GROUPS = ["#cd7a06", "#04a688", "#854c2f", "#007501", "#48a715", "#8f994f", "#3b6348", "#817335"]
"""Colours of groups, as on the replay page."""
# These colours differ from those of the groups and are distinguishable with red-green colour blindness.
UNSEEN, PLAIN = "#d55e00", "#969696"
MEMBERSHIPS = {"in-handoff": "#f0e442", "removed": "#aa3377", "ungrouped": "#0072b2"}
WARNINGS = {"lost", "removed", "not-admitted", "uav-timeout", "orbit-infeasible", "orbit-blocked", "proximity-alert"}
"""Kinds of events that are logged as warnings."""
TYPES = {"double": "TYPE_DOUBLE", "bool": "TYPE_BOOL", "int32": "TYPE_UINT32"}
"""Types of fields by types of columns; all integers are counts or ids."""
UAV_STATE = """
    group speed_m_s speed_command_m_s turn_rate_rad_s turn_rate_command_rad_s speed_limited turn_rate_limited
    heading_rad desired_heading_rad boresight_rad off_boresight_rad centre_distance_m steered_radius_m
    standoff_distance_m standoff_error_own_estimate_m phase_rad feedforward_rad_s convergence_threshold_m2_s
    centre_too_fast commanded_altitude_m altitude_m climb_rate_m_s avoided_uav predicted_distance_m limiting_zone
""".split()
GROUP_ORBIT = """
    members x_m y_m vx_m_s vy_m_s spread_m margin_m standoff_unclamped_m standoff_distance_m standoff_rate_m_s
    turn_limit_m feasible convergence_threshold_m2_s altitude_m nearest_groupmate_m
""".split()


def write_mcap(record: str | os.PathLike[str], file: str | os.PathLike[str]) -> None:
    """Writes a record as an MCAP file; the same record gives the same bytes.

    The file grows as ``FILE.partial`` and is renamed when it is complete. It replaces an older MCAP file, but no other
    file.

    :param record: the folder of a run.
    :param file: the MCAP file to write, outside that folder.
    :raises ValueError: the record cannot be read, or the file cannot be created or must not be replaced.
    :raises OSError: writing fails, for example because the disk is full.
    """
    record, file = Path(record), Path(file)
    if not file.name:
        raise ValueError(f"{file} does not name a file; give a file name")
    if file.resolve().is_relative_to(record.resolve()):
        raise ValueError(f"{file} lies in the folder of the record; name a file outside it")
    export, partial = _Export(record), file.with_name(f"{file.name}.partial")
    advice = "check its folder, its permissions and the free space"
    try:
        _check_replaceable(file)
        _check_replaceable(partial)
        output = partial.open("wb")
    except OSError as error:
        raise ValueError(f"cannot write {partial}: {error.strerror}; {advice}") from error
    try:
        with output:
            export.write(output)
            output.flush()
            os.fsync(output.fileno())
        _check_replaceable(file)
        partial.replace(file)
    except OSError as error:
        raise OSError(f"cannot write {partial}: {error.strerror}; {advice}") from error
    finally:
        partial.unlink(missing_ok=True)


def _check_replaceable(path: Path) -> None:
    """Checks that a path does not exist, or is an empty file or an MCAP file. Symbolic links are rejected."""
    if not os.path.lexists(path):
        return
    what = "not a regular file"
    if stat.S_ISREG(path.lstat().st_mode):
        with path.open("rb") as file:
            what = "" if file.read(len(MCAP0_MAGIC)) in (b"", MCAP0_MAGIC) else "not an MCAP file"
    if what:
        raise ValueError(f"{path} is {what} and will not be overwritten; choose another file name")


class _Export:
    """A record that is written as messages."""

    def __init__(self, record: Path) -> None:
        try:
            self.manifest = json.loads((record / "run.json").read_bytes())
            self.toml = (record / "scenario.toml").read_bytes()
            scenario = tomllib.loads(self.toml.decode())
            if self.manifest["format"] != FORMAT:
                raise ValueError(f"its format is {self.manifest['format']}, this version reads {FORMAT}")
            # Users may remove the truth.
            names = [name for name in TABLES if name != "truth" or (record / "truth.parquet").exists()]
            self.tables = {name: pq.ParquetFile(record / f"{name}.parquet") for name in names}
            targets = pq.read_table(record / "targets.parquet").to_pylist()
            self.record, self.sensor = record, scenario["sensor"]
        except (OSError, KeyError, TypeError, ValueError, pyarrow.ArrowException) as error:
            raise ValueError(f"cannot read the record {record}: {error}; name the folder of a complete run") from error
        self.target_names = {row["target"]: row["name"] for row in targets}
        self.uav_state = _message_class("UavState", UAV_STATE, self.tables["uavs"].schema_arrow)
        self.group_orbit = _message_class("GroupOrbit", GROUP_ORBIT, self.tables["groups"].schema_arrow)
        self.zones = [_zone(number, zone) for number, zone in enumerate(scenario.get("geofence", []))]
        self.channels: dict[str, list[int]] = {}  # channel id and last sequence number, by topic
        self.schemas: dict[Any, int] = {}
        self.colours: dict[int, int] = {}  # index of the colour of each existing group
        self.colours_given = [0] * len(GROUPS)
        self.shown: set[str] = set()

    def write(self, output: IO[bytes]) -> None:
        self.writer = Writer(output, compression=CompressionType.NONE)
        self.writer.start(library=f"standoff {self.manifest['version']}")
        keys = ["scenario", "seed", "version", "duration_s", "period_s"]
        self.writer.add_metadata("standoff", {key: _shown(self.manifest[key]) for key in keys})
        self.writer.add_attachment(0, 0, "scenario.toml", "application/toml", self.toml)
        rows = merge(*map(self._rows, self.tables), key=lambda found: found[0])
        for self.time_us, of_frame in groupby(rows, key=lambda found: found[0]):
            self.stamp = {"seconds": self.time_us // 1_000_000, "nanos": self.time_us % 1_000_000 * 1000}
            frame: dict[str, list[Fields]] = {table: [] for table in TABLES}
            for _, table, row in of_frame:
                frame[table].append(row)
            self._put_frame(**frame)
        self.writer.finish()

    def _rows(self, table: str) -> Iterator[tuple[int, str, Fields]]:
        try:
            for batch in self.tables[table].iter_batches(batch_size=4096):
                yield from ((row["time_us"], table, row) for row in batch.to_pylist())
        except (OSError, pyarrow.ArrowException) as error:
            reason = str(error).split("\n")[0].rstrip(".")
            raise ValueError(f"cannot read {table}.parquet of {self.record}: {reason}; fly the run again") from error

    def _put(self, topic: str, kind: Any, **fields: Any) -> None:
        """Writes a message; the first one of a topic declares its channel."""
        if topic not in self.channels:
            if kind not in self.schemas:
                self.schemas[kind] = register_schema(self.writer, kind)
            self.channels[topic] = [self.writer.register_channel(topic, "protobuf", self.schemas[kind]), 0]
        self.channels[topic][1] += 1
        (channel, sequence), time_ns = self.channels[topic], self.time_us * 1000
        self.writer.add_message(channel, time_ns, kind(**fields).SerializeToString(), time_ns, sequence)

    def _put_frame(
        self, uavs: list[Fields], truth: list[Fields], tracks: list[Fields], groups: list[Fields], events: list[Fields]
    ) -> None:
        common = {"timestamp": self.stamp, "frame_id": "world"}
        poses = {row["uav"]: _pose(*_position(row), row["heading_rad"]) for row in uavs}
        parent = {"timestamp": self.stamp, "parent_frame_id": "world"}
        place = [{"translation": pose["position"], "rotation": pose["orientation"]} for pose in poses.values()]
        transforms = [parent | at | {"child_frame_id": f"uav-{uav}"} for uav, at in zip(poses, place, strict=True)]
        self._put("/tf", FrameTransforms, transforms=transforms)
        for row in uavs:
            self._put(f"/uav/{row['uav']}/pose", PoseInFrame, **common, pose=poses[row["uav"]])
            if "origin" in self.manifest and math.hypot(row["x_m"], row["y_m"]) <= FURTHEST_M:
                fix = _location(row, self.manifest["origin"])
                self._put(f"/uav/{row['uav']}/location", LocationFix, timestamp=self.stamp, **fix)
            self._put(f"/uav/{row['uav']}/state", self.uav_state, **_state(row, truth, tracks, groups))
        for row in groups:
            self._put(f"/group/{row['group']}/orbit", self.group_orbit, **{name: row[name] for name in GROUP_ORBIT})
        for table, key, rows in [("uavs", "uav", uavs), ("truth", "target", truth), ("tracks", "target", tracks)]:
            self._put(f"/points/{table}", PointCloud, **common, **_points(key, rows))
        self._assign_colours([row["group"] for row in groups])
        # Zones are repeated, because a viewer may start at any time step.
        entities = [*self.zones, *map(self._truth, truth), *map(self._track, tracks)]
        entities += [*map(self._orbit, groups), *map(self._uav, uavs)]
        before, self.shown = self.shown, {entity["id"] for entity in entities}
        gone = [{"timestamp": self.stamp, "type": "MATCHING_ID", "id": name} for name in sorted(before - self.shown)]
        self._put("/scene", SceneUpdate, deletions=gone, entities=[entity | common for entity in entities])
        for event in events:
            level = Log.WARNING if event["kind"] in WARNINGS else Log.INFO
            self._put("/log", Log, timestamp=self.stamp, level=level, name=event["kind"], message=self._text_of(event))

    def _assign_colours(self, groups: list[int]) -> None:
        """Gives a new group the colour that the fewest groups have; of several, the one that was given least often."""
        self.colours = {group: colour for group, colour in self.colours.items() if group in groups}
        for group in groups:
            if group not in self.colours:
                taken = list(self.colours.values())
                colour = min(range(len(GROUPS)), key=lambda index: (taken.count(index), self.colours_given[index]))
                self.colours_given[colour] += 1
                self.colours[group] = colour

    def _colour(self, group: int | None) -> str:
        return PLAIN if group is None or group not in self.colours else GROUPS[self.colours[group]]

    def _target_name(self, target: int) -> str:
        number = f"track {target - NO_TARGET}" if target >= NO_TARGET else f"target {target}"
        return str(self.target_names.get(target, number))

    def _text_of(self, event: Fields) -> str:
        target = event["track"] if event["target"] is None else event["target"]
        concerned = [
            "" if target is None else self._target_name(target),
            "" if event["group"] is None else f"group {event['group']}",
            "" if event["to_group"] is None else f"to group {event['to_group']}",
            f"UAV {event['uavs']}" if event["uavs"] else "",
        ]
        return f"{event['kind']} ({', '.join(filter(None, concerned))}): {event['reason']}"

    def _truth(self, row: Fields) -> Fields:
        pose = _pose(*_position(row), math.atan2(row["vy_m_s"], row["vx_m_s"]))
        box = {"pose": pose, "size": _vector(10.0, 6.0, 4.0), "color": _rgba(PLAIN)}
        return _entity("truth", row["target"], {"name": self._target_name(row["target"])}, cubes=[box])

    def _track(self, row: Fields) -> Fields:
        """Draws a track: the colour of the sphere shows its membership, that of the ellipse also its status."""
        name, membership, status = self._target_name(row["target"]), row["membership"], row["status"]
        marker = MEMBERSHIPS.get(membership, self._colour(row["group"]))
        line = marker if status == "updated" else UNSEEN
        label = ", ".join([name, *(word for word in (membership, status) if word not in ("member", "updated"))])
        (x_m, y_m, _), groups = _position(row), {key: row[key] for key in ("group", "receiving_group")}
        # The covariance is L L', L lower triangular; L maps the unit circle to the ellipse of one standard deviation.
        sd_m = math.sqrt(max(row["cov_x_x"], 0.0))
        across_m = row["cov_x_y"] / sd_m if sd_m > 0.0 else 0.0
        along_m = math.sqrt(max(row["cov_y_y"] - across_m * across_m, 0.0))
        sds = [(sd_m * cos, across_m * cos + along_m * sin) for sin, cos in _directions(24)]
        ellipse = [(x_m + ELLIPSE_SDS * east_m, y_m + ELLIPSE_SDS * north_m, 0.0) for east_m, north_m in sds]
        metadata = {"name": name, "membership": membership, "status": status, **groups}
        sphere = {"pose": _pose(x_m, y_m, 0.0), "size": _vector(14.0, 14.0, 14.0), "color": _rgba(marker)}
        lines, texts = [_outline(ellipse, line)], [_text((x_m, y_m, 20.0), label, line)]
        return _entity("track", row["target"], metadata, spheres=[sphere], lines=lines, texts=texts)

    def _orbit(self, row: Fields) -> Fields:
        (x_m, y_m, z_m), radius_m, colour = _position(row), row["standoff_distance_m"], self._colour(row["group"])
        circle = [(x_m + radius_m * cos, y_m + radius_m * sin, z_m) for sin, cos in _directions(72)]
        label = f"group {row['group']}: {radius_m:.0f} m{'' if row['feasible'] else ', infeasible'}"
        text = _text((x_m, y_m, z_m), label, colour)
        return _entity("group", row["group"], {}, lines=[_outline(circle, colour)], texts=[text])

    def _uav(self, row: Fields) -> Fields:
        """Draws a UAV and the outline of its field of view, from the UAV to an arc on the ground."""
        at, colour, view = _position(row), self._colour(row["group"]), []
        if row["boresight_rad"] is not None:
            angle_rad, range_m = math.radians(self.sensor["field_of_view_deg"]), self.sensor["sensing_range_m"]
            edge = [_sin_cos(row["boresight_rad"] + angle_rad * (step / 16 - 0.5)) for step in range(17)]
            arc = [(at[0] + range_m * cos, at[1] + range_m * sin, 0.0) for sin, cos in edge]
            view = [_outline([at, *arc], colour)]
        size = {"shaft_length": 30.0, "shaft_diameter": 8.0, "head_length": 25.0, "head_diameter": 20.0}
        arrow = {"pose": _pose(*at, row["heading_rad"]), "color": _rgba(colour), **size}
        text = _text(at, f"UAV {row['uav']}", colour)
        return _entity("uav", row["uav"], {}, arrows=[arrow], lines=view, texts=[text])


def _message_class(name: str, columns: Iterable[str], table: Any) -> Any:
    """Makes a message class with a field for each column. Derived fields, which are not in the table, are optional."""
    types = {column.name: (str(column.type), column.nullable) for column in table}
    file = descriptor_pb2.FileDescriptorProto(name=f"{name}.proto", package=name.lower(), syntax="proto3")
    message = file.message_type.add(name=name)
    for number, column in enumerate(columns, 1):
        kind, is_optional = types.get(column, ("double", True))
        field = message.field.add(name=column, number=number, type=TYPES[kind], label="LABEL_OPTIONAL")
        if is_optional:
            field.proto3_optional, field.oneof_index = True, len(message.oneof_decl)
            message.oneof_decl.add(name=f"_{column}")
    # A separate pool for each class, because the default pool refuses a second class of the same name.
    pool = DescriptorPool()
    pool.Add(file)
    return GetMessageClass(pool.FindMessageTypeByName(f"{name.lower()}.{name}"))


def _state(row: Fields, truth: list[Fields], tracks: list[Fields], groups: list[Fields]) -> Fields:
    """Returns the columns of a UAV and the derived numbers."""
    state = {name: row.get(name) for name in UAV_STATE}
    for group in groups:
        if group["group"] == row["group"]:
            distance_m = math.hypot(row["x_m"] - group["x_m"], row["y_m"] - group["y_m"])
            state["standoff_distance_m"] = group["standoff_distance_m"]
            state["standoff_error_own_estimate_m"] = distance_m - group["standoff_distance_m"]
    if row["group"] is not None and row["boresight_rad"] is not None:
        members = {track["target"] for track in tracks if track["group"] == row["group"]}
        sin, cos = _sin_cos(row["boresight_rad"])
        off = [(at["x_m"] - row["x_m"], at["y_m"] - row["y_m"]) for at in truth if at["target"] in members]
        angles_rad = [math.atan2(abs(cos * y_m - sin * x_m), cos * x_m + sin * y_m) for x_m, y_m in off]
        state["off_boresight_rad"] = max(angles_rad, default=None)
    return state


def _location(row: Fields, origin: Fields) -> Fields:
    """Makes a location: that of the point of the WGS84 ellipsoid below the UAV."""
    (sin, cos), (sin_lon, cos_lon) = (_sin_cos(math.radians(origin[key])) for key in ("latitude_deg", "longitude_deg"))
    east, north = np.array([-sin_lon, cos_lon, 0.0]), np.array([-sin * cos_lon, -sin * sin_lon, cos])
    up = np.array([cos * cos_lon, cos * sin_lon, sin])
    # In units of the semi-axes, the ellipsoid is the unit sphere. The vertical line through the point intersects it.
    at = SEMI_AXES_M * up / np.linalg.norm(SEMI_AXES_M * up) + (row["x_m"] * east + row["y_m"] * north) / SEMI_AXES_M
    line = up / SEMI_AXES_M
    along, outside = at @ line, at @ at - 1.0
    x, y, z = (at - outside / (along + math.sqrt(along**2 - line @ line * outside)) * line) / SEMI_AXES_M
    heading_sin, heading_cos = _sin_cos(row["heading_rad"])
    east_m_s, north_m_s = row["speed_m_s"] * heading_cos, row["speed_m_s"] * heading_sin
    return {
        "frame_id": f"uav-{row['uav']}",
        "latitude": math.degrees(math.atan2(z, math.hypot(x, y))),
        "longitude": math.degrees(math.atan2(y, x)),
        "altitude": _position(row)[2],
        # The schema requires a heading clockwise from north.
        "heading": math.remainder(math.pi / 2 - row["heading_rad"], math.tau),
        "velocity": _vector(east_m_s, north_m_s, row["climb_rate_m_s"] or 0.0),
    }


def _points(key: str, rows: list[Fields]) -> Fields:
    """Makes a point cloud with ids, in single precision."""
    fields = [{"name": axis, "offset": 4 * index, "type": "FLOAT32"} for index, axis in enumerate("xyz")]
    fields.append({"name": key, "offset": 12, "type": "UINT32"})
    data = b"".join(struct.pack("<fffI", *_position(row), row[key]) for row in rows)
    return {"pose": _pose(0.0, 0.0, 0.0), "point_stride": 16, "fields": fields, "data": data}


def _zone(number: int, zone: Fields) -> Fields:
    """Draws the outline of a zone: on the ground or at its floor, and at its ceiling."""
    colour, name = UNSEEN if zone["kind"] == "keep-out" else PLAIN, zone.get("name", "")
    limits: Fields = {key: zone[key] for key in ("altitude_min_m", "altitude_max_m") if key in zone}
    levels_m = list({"altitude_min_m": 0.0, **limits}.values())
    outlines = [[(x_m, y_m, level_m) for x_m, y_m in zone["vertices"]] for level_m in levels_m]
    text = _text(outlines[0][0], f"{zone['kind']} {name}".rstrip(), colour)
    lines = [_outline(corners, colour) for corners in outlines]
    return _entity("zone", number, {"kind": zone["kind"], "name": name, **limits}, texts=[text], lines=lines)


def _entity(kind: str, number: int, metadata: Fields, **shapes: Any) -> Fields:
    pairs = [{"key": key, "value": _shown(value)} for key, value in metadata.items() if value is not None]
    return {"id": f"{kind}/{number}", "metadata": pairs, **shapes}


def _outline(corners: list[Point], colour: str) -> Fields:
    points, style = [_vector(*corner) for corner in corners], {"thickness": 2.0, "scale_invariant": True}
    return {"type": "LINE_LOOP", "pose": _pose(0.0, 0.0, 0.0), "points": points, "color": _rgba(colour), **style}


def _text(at: Point, text: str, colour: str) -> Fields:
    style = {"billboard": True, "font_size": 14.0, "scale_invariant": True}
    return {"pose": _pose(*at), "text": text, "color": _rgba(colour), **style}


def _position(row: Fields) -> Point:
    """Returns a position; the altitude is the flown one or, if it is not simulated, the commanded one, otherwise 0."""
    flown_m, commanded_m = row.get("altitude_m"), row.get("commanded_altitude_m")
    return row["x_m"], row["y_m"], (commanded_m or 0.0) if flown_m is None else flown_m


def _pose(x_m: float, y_m: float, z_m: float, heading_rad: float = 0.0) -> Fields:
    sin, cos = _sin_cos(heading_rad / 2)
    return {"position": _vector(x_m, y_m, z_m), "orientation": {"x": 0.0, "y": 0.0, "z": sin, "w": cos}}


def _vector(x: float, y: float, z: float) -> Fields:
    return {"x": x, "y": y, "z": z}


def _rgba(colour: str) -> Fields:
    return dict(zip("rgb", (part / 255 for part in bytes.fromhex(colour[1:])), strict=True), a=1.0)


def _directions(count: int) -> list[tuple[float, float]]:
    return [_sin_cos(math.tau * index / count) for index in range(count)]


def _sin_cos(angle_rad: float) -> tuple[float, float]:
    return math.sin(angle_rad), math.cos(angle_rad)


def _shown(value: object) -> str:
    return str(value).removesuffix(".0") if isinstance(value, float) else str(value)


def _main() -> int:
    parser = argparse.ArgumentParser(prog="python -m standoff.mcap", description="Write a record as an MCAP file.")
    parser.add_argument("record", metavar="RECORD", help="folder of a run")
    parser.add_argument("file", metavar="FILE", help="MCAP file to write")
    given = parser.parse_args()
    try:
        write_mcap(given.record, given.file)
    except (ValueError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 2 if isinstance(error, ValueError) else 1
    return 0


if __name__ == "__main__":
    sys.exit(_main())
