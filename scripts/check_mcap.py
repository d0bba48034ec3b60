#!/usr/bin/env python3
"""Read the MCAP file of a run with MCAP's own Python packages, and compare it with the run's record.

Usage: check_mcap.py <record folder> <MCAP file>

docs/user/mcap.md describes the topics. Messages are decoded by the schemas in the file. The scene is replayed as a viewer does:
entities replace one another and are deleted, and at every time step the remaining ones must match the record.

Prints lines like check_equations.py. Exits with 1 and a message if anything differs. Not checked: colours, labels,
latitude and longitude.
"""

import json
import sys
from collections import defaultdict
from pathlib import Path

import numpy as np
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

from check_equations import Comparison, Record, direction, wrap

CHI_SQUARE_95 = 5.991464547107979  # 95 % quantile with two degrees of freedom


def main(arguments):
    if len(arguments) != 2:
        print(__doc__.strip(), file=sys.stderr)
        return 2
    folder, path = map(Path, arguments)
    try:
        record, compare = Record(folder), Comparison()
        with open(path, "rb") as file:
            reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
            check_file(reader, record, compare)
            topics = defaultdict(dict)
            for schema, channel, message, decoded in reader.iter_decoded_messages():
                unexpected = message.log_time != message.publish_time or schema.encoding != "protobuf"
                compare("messages of an unexpected form", 0, unexpected)
                topics[channel.topic].setdefault(message.log_time // 1000, []).append(decoded)
        for check in [check_poses, check_points, check_states, check_orbits, check_scene,
                      check_log]:
            check(topics, record, compare)
        compare("topics that were not checked", 0, len(topics))
    except Exception as error:  # a topic or a field is missing or cannot be read
        print(f"{path}: {type(error).__name__}: {error}", file=sys.stderr)
        return 1
    return compare.report(path)


def check_file(reader, record, compare):
    """Checks the metadata and the attachment of the file."""
    manifest = json.loads((record.folder / "run.json").read_text(encoding="utf-8"))
    (metadata,) = reader.iter_metadata()
    expected = {name: str(manifest[name]) for name in ["scenario", "seed", "version"]}
    compare("metadata that differ", 0, sum(metadata.metadata[name] != value for name, value in expected.items()))
    for name in ["duration_s", "period_s"]:
        compare(f"metadata: {name}", manifest[name], float(metadata.metadata[name]))
    (attachment,) = reader.iter_attachments()
    scenario = (record.folder / attachment.name).read_bytes()
    compare("scenario attached", 0, attachment.name != "scenario.toml" or attachment.data != scenario)


def only(messages):
    """Returns the only message of a time step."""
    (message,) = messages
    return message


def seconds(stamp):
    return stamp.seconds + stamp.nanos / 1e9


def check_times(what, recorded, messages, compare):
    """Checks that messages and rows have the same time steps."""
    compare(f"{what}: time steps that differ", 0, len(set(recorded) ^ set(messages)))


def height(row):
    """Returns the altitude of a UAV: the flown one, or otherwise the commanded one; 0 for other objects."""
    flown, commanded = (getattr(row, name, None) for name in ["altitude_m", "commanded_altitude_m"])
    return commanded or 0.0 if flown is None else flown


def check_poses(topics, record, compare):
    transforms = topics.pop("/tf")
    check_times("/tf", record.uavs, transforms, compare)
    poses = {uav: topics.pop(f"/uav/{uav}/pose") for uav in record.uavs[record.times[0]]}
    for time, rows in record.uavs.items():
        sent = {transform.child_frame_id: transform for transform in only(transforms[time]).transforms}
        compare("/tf: UAVs that differ", 0, len(set(sent) ^ {f"uav-{uav}" for uav in rows}))
        for uav, row in rows.items():
            transform, pose = sent[f"uav-{uav}"], only(poses[uav][time])
            place = [row.x_m, row.y_m, height(row)]
            for what, stamp, position, turned in [
                    ("/tf", transform.timestamp, transform.translation, transform.rotation),
                    ("pose", pose.timestamp, pose.pose.position, pose.pose.orientation)]:
                compare(f"{what}: time", time / 1e6, seconds(stamp))
                compare(f"{what}: position", place, np.array([position.x, position.y, position.z]))
                compare(f"{what}: level, of length 1", [0.0, 0.0, 1.0],
                        np.array([turned.x, turned.y, np.hypot(turned.z, turned.w)]))
                compare.angle(f"{what}: heading", row.heading_rad, 2.0 * np.arctan2(turned.z, turned.w))


def check_points(topics, record, compare):
    """Checks points, which have single precision."""
    types = {5: "<u4", 7: "<f4"}
    for kind, rows, key in [("uavs", record.uavs, "uav"), ("truth", record.truth, "target"),
                            ("tracks", record.tracks, "target")]:
        clouds = topics.pop(f"/points/{kind}")
        check_times(f"/points/{kind}", record.uavs, clouds, compare)
        for time, (cloud,) in clouds.items():
            layout = np.dtype({"names": [field.name for field in cloud.fields],
                               "formats": [types[field.type] for field in cloud.fields],
                               "offsets": [field.offset for field in cloud.fields], "itemsize": cloud.point_stride})
            points, recorded = np.frombuffer(cloud.data, layout), [row for _, row in sorted(rows[time].items())]
            compare(f"/points/{kind}: ids that differ", 0, list(points[key]) != sorted(rows[time]))
            places = [[row.x_m, row.y_m, height(row)] for row in recorded]
            compare(f"/points/{kind}: places", places, np.array([points[axis] for axis in "xyz"]).T, tolerance=1e-7)


def numbers(message):
    """Returns the fields of a message by name; missing ones are None."""
    return {field.name: getattr(message, field.name) if not field.has_presence or message.HasField(field.name) else None
            for field in message.DESCRIPTOR.fields}


def check_states(topics, record, compare):
    for uav in record.uavs[record.times[0]]:
        states = topics.pop(f"/uav/{uav}/state")
        check_times("state", record.uavs, states, compare)
        for time, (state,) in states.items():
            row, state = record.uavs[time][uav], numbers(state)
            expected = record.groups[time][row.group].standoff_distance_m if row.group is not None else None
            known = row.centre_distance_m is not None and expected is not None
            compare("state: standoff_distance_m", expected, state.pop("standoff_distance_m"))
            error = row.centre_distance_m - expected if known else None
            compare("state: standoff_error_own_estimate_m", error, state.pop("standoff_error_own_estimate_m"))
            compare("state: off_boresight_rad", off_boresight(record, time, row), state.pop("off_boresight_rad"))
            for name, value in state.items():
                compare(f"state: {name}", getattr(row, name), value)


def off_boresight(record, time, uav):
    """Returns the largest angle between the boresight and the true position of a member of the UAV's group."""
    if uav.boresight_rad is None or uav.group is None:
        return None
    members = [record.truth[time][target] for target in record.assigned_members(time, uav.group) if target in record.truth[time]]
    angles = [abs(wrap(direction(member.position - uav.position) - uav.boresight_rad)) for member in members]
    return max(angles, default=None)


def check_orbits(topics, record, compare):
    for group in sorted({group for rows in record.groups.values() for group in rows}):
        orbits = topics.pop(f"/group/{group}/orbit")
        check_times("orbit", [time for time, rows in record.groups.items() if group in rows], orbits, compare)
        for time, (orbit,) in orbits.items():
            for name, value in numbers(orbit).items():
                compare(f"orbit: {name}", getattr(record.groups[time][group], name), value)


def check_scene(topics, record, compare):
    scenes, shown = topics.pop("/scene"), {}
    check_times("/scene", record.uavs, scenes, compare)
    for time in record.times:
        update = only(scenes[time])
        for deletion in update.deletions:
            compare("/scene: deletions of entities that do not exist", 0, deletion.type != 0 or deletion.id not in shown)
            del shown[deletion.id]
        shown |= {entity.id: entity for entity in update.entities}
        kinds = {"uav": record.uavs, "truth": record.truth, "track": record.tracks, "group": record.groups}
        there = {f"{kind}/{key}": row for kind, rows in kinds.items() for key, row in rows[time].items()}
        there |= {f"zone/{number}": zone for number, zone in enumerate(record.scenario.get("geofence", []))}
        compare("/scene: entities that differ", 0, len(set(there) ^ set(shown)))
        for name, row in there.items():
            entity = shown[name]
            compare("/scene: time of entities", time / 1e6, seconds(entity.timestamp))
            SHAPES[name.split("/")[0]](entity, row, record, compare)


def points(line):
    return np.array([[point.x, point.y, point.z] for point in line.points])


def check_marker(what, marker, row, compare):
    compare(f"/scene: {what}, position", row.position, np.array([marker.pose.position.x, marker.pose.position.y]))


def check_uav(entity, row, record, compare):
    check_marker("UAV", only(entity.arrows), row, compare)
    compare("/scene: field of view drawn", row.boresight_rad is not None, len(entity.lines))
    if entity.lines:
        edge = points(only(entity.lines))[1:, :2] - row.position
        sensor = record.scenario["sensor"]
        compare("/scene: field of view, reach", sensor["sensing_range_m"], np.hypot(*edge.T))
        angles = wrap(direction(edge.T) - row.boresight_rad)
        compare("/scene: field of view, width", sensor["field_of_view_deg"], np.degrees(np.ptp(angles)))
        compare("/scene: field of view, middle", 0.0, angles.mean())


def check_truth(entity, row, _, compare):
    check_marker("vehicle", only(entity.cubes), row, compare)


def check_track(entity, row, _, compare):
    check_marker("track", only(entity.spheres), row, compare)
    off = points(only(entity.lines))[:, :2] - row.position
    compare("/scene: ellipse of 95 %", CHI_SQUARE_95, np.einsum("ni,ij,nj->n", off, np.linalg.inv(row.p_position), off),
            tolerance=1e-8)
    metadata = {pair.key: pair.value for pair in entity.metadata}
    compare("/scene: metadata of a track that differ", 0,
            metadata["membership"] != row.membership or metadata["status"] != row.status)
    for name in ["group", "receiving_group"]:
        compare(f"/scene: {name} of a track", getattr(row, name), float(metadata[name]) if name in metadata else None)


def check_group(entity, row, _, compare):
    circle = points(only(entity.lines))
    compare("/scene: orbit, radius", row.standoff_distance_m, np.hypot(*(circle[:, :2] - row.position).T))
    compare("/scene: orbit, altitude", row.altitude_m, circle[:, 2])


def check_zone(entity, zone, _, compare):
    levels = [zone.get("altitude_min_m", 0.0)] + [zone[key] for key in ["altitude_max_m"] if key in zone]
    compare("/scene: outlines of a zone", len(levels), len(entity.lines))
    for level, line in zip(levels, entity.lines):
        compare("/scene: vertices of a zone", zone["vertices"], points(line)[:, :2])
        compare("/scene: altitude of a zone", level, points(line)[:, 2])
    metadata = {pair.key: pair.value for pair in entity.metadata}
    limits = {key: f"{zone[key]:g}" for key in ["altitude_min_m", "altitude_max_m"] if key in zone}
    compare("/scene: metadata of a zone that differ", 0, metadata != {"kind": zone["kind"], "name": zone.get("name", "")} | limits)


SHAPES = {"zone": check_zone, "uav": check_uav, "truth": check_truth, "track": check_track, "group": check_group}


def check_log(topics, record, compare):
    entries = topics.pop("/log", {})
    check_times("/log", record.events, entries, compare)
    for time, events in record.events.items():
        compare("/log: number of events", len(events), len(entries[time]))
        for event, entry in zip(events, entries[time]):
            differs = entry.name != event.kind or not entry.message.endswith(event.reason)
            compare("/log: events that differ", 0, differs or seconds(entry.timestamp) != time / 1e6)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
