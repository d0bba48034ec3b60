"""The thread that calls a custom law. All code of the law runs on it, and nothing else does.

It is a pure Python thread without native frames below the law's code: if a call never returns, the thread is abandoned
and ends with the interpreter.
"""

from __future__ import annotations

import itertools
import reprlib
import threading
from collections.abc import Callable
from queue import SimpleQueue
from typing import Any

from standoff._standoff import Command, Tracks

QueuedCall = tuple[Callable[..., Any], tuple[Any, ...], Callable[..., Any], tuple[Any, ...]]
EXPECTED = "a Command, (speed_m_s, turn_rate_rad_s), or None for the built-in command"


def begin(deliver: Callable[[Any, BaseException | None], None]) -> tuple[Callable[[QueuedCall | None], None], int]:
    """Starts the thread.

    :returns: a function that queues a call and the conversion of its return value, or None to end the thread; and the
        thread's identifier.
    """
    calls: SimpleQueue[QueuedCall | None] = SimpleQueue()

    def serve() -> None:
        while (item := calls.get()) is not None:
            call, arguments, convert, convert_arguments = item
            try:
                converted, raised = convert(call(*arguments), *convert_arguments), None
            except BaseException as error:
                converted, raised = None, error
            deliver(converted, raised)
            # Keep no references while waiting for the next call.
            del item, call, arguments, converted, raised

    thread = threading.Thread(target=serve, name="standoff law", daemon=True)
    thread.start()
    return calls.put, thread.ident or 0


def new_law(law: Any) -> Any:
    """Returns a new law object unchanged."""
    return law


def command(returned: Any, law_name: str) -> Command | None:
    """Converts a law's return value to the command of one UAV."""
    if returned is None or isinstance(returned, Command):
        return returned
    try:
        speed_m_s, turn_rate_rad_s = returned
    except (TypeError, ValueError):
        raise ValueError(f"{law_name}.decide: returned {reprlib.repr(returned)}; must return {EXPECTED}") from None
    try:
        return Command(float(speed_m_s), float(turn_rate_rad_s))
    except (TypeError, ValueError) as error:
        raise ValueError(
            f"{law_name}.decide: returned {reprlib.repr(returned)}; must return {EXPECTED}: {error}"
        ) from error


def commands(returned: Any, law_name: str, uavs: int) -> list[Command | None]:
    """Converts a team law's return value to one command per UAV."""
    try:
        each = iter(returned)
    except TypeError:
        raise TypeError(
            f"{law_name}.decide: returned {reprlib.repr(returned)}; a team law must return a list of commands"
        ) from None
    # Read at most one more than allowed, because an iterator may be infinite.
    decisions = list(itertools.islice(each, uavs + 1))
    if len(decisions) != uavs:
        count = f"more than {uavs}" if len(decisions) > uavs else str(len(decisions))
        raise ValueError(f"{law_name}.decide: returned {count} commands for {uavs} UAVs; must return one for each")
    return [command(one, law_name) for one in decisions]


def assignments(returned: Any, law_name: str, uavs: frozenset[int], groups: frozenset[int]) -> list[tuple[int, int]] | None:
    """Converts an assignment law's return value to pairs of UAV and group; None for the built-in assignment."""
    if returned is None:
        return None
    if not isinstance(returned, dict):
        raise TypeError(
            f"{law_name}.decide: returned {reprlib.repr(returned)}; an assignment law must return a dict from UAVs to "
            "groups, or None"
        )
    assignments = []
    for uav, group in returned.items():
        for what, number, allowed in (("UAV", uav, uavs), ("group", group, groups)):
            if number not in allowed:
                raise ValueError(f"{law_name}.decide: {what} {reprlib.repr(number)} is not one of {sorted(allowed)}")
        assignments.append((int(uav), int(group)))
    return assignments


def tracks(returned: Any, law_name: str) -> Tracks:
    """Checks that a law's ``tracks`` returned target estimates."""
    if not isinstance(returned, Tracks):
        raise TypeError(f"{law_name}.tracks: returned {reprlib.repr(returned)}; must return standoff.Tracks")
    return returned
