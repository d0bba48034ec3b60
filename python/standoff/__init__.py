"""Cooperative standoff tracking: UAVs keep groups of moving ground vehicles in view."""

from standoff._standoff import (
    InputError,
    Scenario,
    ScenarioError,
    StandoffError,
    __version__,
    scenarios,
)

__all__ = ["InputError", "Scenario", "ScenarioError", "StandoffError", "__version__", "scenarios"]
