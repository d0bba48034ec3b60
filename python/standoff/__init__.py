"""Cooperative standoff tracking: UAVs keep groups of moving ground vehicles in view."""

from standoff._standoff import (
    Batch,
    Briefing,
    Choice,
    Command,
    Comparison,
    Cue,
    Intruder,
    Observation,
    Picture,
    Report,
    Run,
    Scenario,
    Table,
    Tracks,
    Zone,
    __version__,
    compare,
    merge,
    monte_carlo,
    run,
    scenarios,
    yardstick,
)
from standoff.errors import InputError, ScenarioError, StandoffError
from standoff.law import Law

# Last, for it imports this.
from standoff import pieces  # isort: skip

__all__ = [
    "Batch",
    "Briefing",
    "Choice",
    "Command",
    "Comparison",
    "Cue",
    "InputError",
    "Intruder",
    "Law",
    "Observation",
    "Picture",
    "Report",
    "Run",
    "Scenario",
    "ScenarioError",
    "StandoffError",
    "Table",
    "Tracks",
    "Zone",
    "__version__",
    "compare",
    "merge",
    "monte_carlo",
    "pieces",
    "run",
    "scenarios",
    "yardstick",
]
