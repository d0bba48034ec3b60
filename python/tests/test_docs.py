"""The page about Python says what runs."""

import re
from pathlib import Path
from typing import Any

import pytest

DOCS = Path(__file__).parents[2] / "docs"


def test_what_the_page_says_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = (DOCS / "python.md").read_text()
    blocks = re.findall(r"^```python\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
    assert len(blocks) >= 7
    monkeypatch.chdir(tmp_path)
    there: dict[str, Any] = {}
    for block in blocks:
        exec(block, there)
    assert there["compared"].b.endswith("by Bold") and there["faster"].metrics["watched_fraction"] is not None
    assert there["radius_m"].shape == (1000,) and len(there["uavs"]) == there["run"].uavs.num_rows
    assert not list(tmp_path.iterdir())
