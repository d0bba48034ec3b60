"""What tests share: the command that the package is held to."""

import os
import subprocess
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def command() -> Path:
    """The program ``standoff``, built from the same source: $STANDOFF."""
    program = Path(os.environ["STANDOFF"])
    said = subprocess.run([program, "--version"], check=True, capture_output=True, text=True).stdout
    assert said.startswith("standoff ")
    return program
