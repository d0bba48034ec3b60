"""Shared fixtures: the command, whose results the package must reproduce."""

import os
import subprocess
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def command() -> Path:
    """Path of the program ``standoff``, built from the same source, from $STANDOFF."""
    program = Path(os.environ["STANDOFF"])
    version = subprocess.run([program, "--version"], check=True, capture_output=True, text=True).stdout
    assert version.startswith("standoff ")
    return program
