"""What goes wrong, as exceptions. A law of your own raises what it likes, and that comes out as it is."""

__all__ = ["InputError", "ScenarioError", "StandoffError"]


class StandoffError(Exception):
    """Something failed while running: a disk, a worker, a law that never answers."""


class InputError(ValueError):
    """Wrong input: an argument, a record, a folder. The message says what is allowed and what to do."""


class ScenarioError(InputError):
    """A scenario that cannot be used; what is wrong is drawn under what was typed."""
