"""Exceptions of the package. Exceptions raised by a custom law are passed on unchanged."""

__all__ = ["InputError", "ScenarioError", "StandoffError"]


class StandoffError(Exception):
    """A failure while running: a disk, a worker, a law that exceeds its time limit."""


class InputError(ValueError):
    """Wrong input: an argument, a record, a folder. The message states what is allowed and what to do."""


class ScenarioError(InputError):
    """An invalid scenario. The message marks the error in the source text."""
