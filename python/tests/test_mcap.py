"""MCAP files: topics and numbers match the record, and no other file is overwritten."""

import subprocess
import sys
from collections import defaultdict
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

import standoff
from standoff.mcap import write_mcap


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> standoff.Run:
    """A run with a geographic origin: a car that drives north-east at 44.5 N, 11.3 E."""
    folder = tmp_path_factory.mktemp("run")
    rows = [f"{i},car,{44.5 + i * 1e-4},{11.3 + i * 1e-4}" for i in range(11)]
    (folder / "traffic.csv").write_text("\n".join(["t,id,lat,lon", *rows, ""]))
    return standoff.run(traffic=folder / "traffic.csv", uavs=2, out=folder / "run")


def messages(file: Path) -> dict[str, list[Any]]:
    topics = defaultdict(list)
    with file.open("rb") as stream:
        reader = make_reader(stream, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for _, channel, message, decoded in reader.iter_decoded_messages():
            topics[channel.topic].append((message.log_time // 1000, decoded))
    return topics


def export(record: Path, file: Path) -> tuple[int, str]:
    ended = subprocess.run([sys.executable, "-m", "standoff.mcap", record, file], capture_output=True, text=True)
    return ended.returncode, ended.stderr


def test_messages_match_the_record(run: standoff.Run, tmp_path: Path) -> None:
    assert export(run.dir, tmp_path / "a.mcap") == (0, "")
    topics = messages(tmp_path / "a.mcap")
    of_uav = {f"/uav/{uav}/{what}" for uav in (0, 1) for what in ("pose", "location", "state")}
    points = {f"/points/{table}" for table in ("uavs", "truth", "tracks")}
    assert set(topics) == {"/tf", "/scene", "/log", "/group/0/orbit"} | of_uav | points
    rows = run.uavs.to_pandas().query("uav == 1")
    for name in ("pose", "location", "state"):
        assert [time_us for time_us, _ in topics[f"/uav/1/{name}"]] == list(rows.time_us)
    for (_, pose), (_, fix), x_m, y_m in zip(
        topics["/uav/1/pose"], topics["/uav/1/location"], rows.x_m, rows.y_m, strict=True
    ):
        assert (pose.pose.position.x, pose.pose.position.y) == (x_m, y_m)
        # A degree at 44.5 N is 111,122 m along the meridian and 79,530 m along the parallel; curvature is neglected.
        assert (fix.longitude - 11.3) * 79_530 == pytest.approx(x_m, abs=1.0)
        assert (fix.latitude - 44.5) * 111_122 == pytest.approx(y_m, abs=1.0)
    assert len(topics["/log"]) == len(run.events)


def test_the_same_record_gives_the_same_bytes_and_replaces_older_mcap_files_only(
    run: standoff.Run, tmp_path: Path
) -> None:
    file = tmp_path / "a.mcap"
    write_mcap(run.dir, file)
    before = file.read_bytes()
    # The partial file of an interrupted export.
    (tmp_path / "a.mcap.partial").write_bytes(before[:200])
    write_mcap(run.dir, file)
    assert file.read_bytes() == before and list(tmp_path.iterdir()) == [file]
    file.write_text("my thesis")
    status, message = export(run.dir, file)
    assert status == 2 and "is not an MCAP file and will not be overwritten; choose another file name" in message
    assert file.read_text() == "my thesis" and list(tmp_path.iterdir()) == [file]


def test_wrong_input_and_a_full_disk_are_reported(run: standoff.Run, tmp_path: Path) -> None:
    for record, file, expected in [
        (tmp_path / "none", tmp_path / "a.mcap", "name the folder of a complete run"),
        (run.dir, tmp_path / "none/a.mcap", "No such file or directory"),
        (run.dir, run.dir / "a.mcap", "name a file outside it"),
    ]:
        status, message = export(record, file)
        assert status == 2 and message.startswith("error: ") and expected in message, message
    # A file-size limit acts like a full disk.
    limited = ["sh", "-c", 'ulimit -f 20; exec "$@"', "sh", sys.executable, "-m", "standoff.mcap"]
    ended = subprocess.run([*limited, str(run.dir), "a.mcap"], cwd=tmp_path, capture_output=True, text=True)
    assert ended.returncode == 1 and "cannot write a.mcap.partial: File too large" in ended.stderr
    assert not list(tmp_path.iterdir())
