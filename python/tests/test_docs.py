"""The code on the page about Python runs."""

import re
from pathlib import Path
from typing import Any

import pytest

DOCS = Path(__file__).parents[2] / "docs" / "user"


def code_blocks(page: str) -> list[str]:
    return re.findall(r"^```python\n(.*?)^```", (DOCS / page).read_text(), re.MULTILINE | re.DOTALL)


def test_code_blocks_of_the_sweep_page_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    variables: dict[str, Any] = {}
    for block in code_blocks("sweep.md"):
        exec(block, variables)
    assert len(variables["swept"]) == 9 and not list(tmp_path.iterdir())


def test_law_of_the_cookbook_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (block,) = (block for block in code_blocks("cookbook.md") if "import standoff" in block)
    variables: dict[str, Any] = {}
    exec(block, variables)
    assert variables["law"]["phase_error_deg"]["better"] == "a"


def test_code_blocks_of_the_python_page_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    blocks = code_blocks("python.md")
    assert len(blocks) >= 7
    monkeypatch.chdir(tmp_path)
    variables: dict[str, Any] = {}
    for block in blocks:
        exec(block, variables)
    assert variables["compared"].b.endswith("by Bold")
    assert variables["faster"].metrics["custody_fraction"] is not None
    assert variables["steering"].turn_rate_rad_s.shape == (1000,) and len(variables["uavs"]) == len(variables["run"].uavs)
    assert not list(tmp_path.iterdir())
