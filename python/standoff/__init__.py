"""Cooperative standoff tracking: UAVs keep groups of moving ground vehicles in view."""

from standoff._standoff import (
    Batch,
    MissionInfo,
    AssignmentProblem,
    Command,
    Comparison,
    Cue,
    Intruder,
    Observation,
    TeamState,
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
    baseline,
)
from standoff.errors import InputError, ScenarioError, StandoffError
from standoff.law import Law

# Last, because it imports this package.
from standoff import components  # isort: skip

__all__ = [
    "Batch",
    "MissionInfo",
    "AssignmentProblem",
    "Command",
    "Comparison",
    "Cue",
    "InputError",
    "Intruder",
    "Law",
    "Observation",
    "TeamState",
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
    "components",
    "run",
    "scenarios",
    "baseline",
]
