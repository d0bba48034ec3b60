"""The code on the page about Python runs."""

import re
from pathlib import Path
from typing import Any

import pytest

DOCS = Path(__file__).parents[2] / "docs"


def test_code_blocks_of_the_python_page_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = (DOCS / "python.md").read_text()
    blocks = re.findall(r"^```python\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
    assert len(blocks) >= 7
    monkeypatch.chdir(tmp_path)
    variables: dict[str, Any] = {}
    for block in blocks:
        exec(block, variables)
    assert variables["compared"].b.endswith("by Bold")
    assert variables["faster"].metrics["custody_fraction"] is not None
    assert variables["steering"].turn_rate_rad_s.shape == (1000,) and len(variables["uavs"]) == variables["run"].uavs.num_rows
    assert not list(tmp_path.iterdir())
