"""The thread on which a law of your own is asked: all of its code runs here, and nothing else does.

It is a thread of Python's alone, with nothing native below a law's code: one that never answers is left behind, and
ends with the interpreter.
"""

from __future__ import annotations

import itertools
import reprlib
import threading
from collections.abc import Callable
from queue import SimpleQueue
from typing import Any

from standoff._standoff import Command, Tracks

Asked = tuple[Callable[..., Any], tuple[Any, ...], Callable[..., Any], tuple[Any, ...]]
NEITHER = "a Command, (speed_m_s, turn_rate_rad_s), or None: as the product would"


def begin(deliver: Callable[[Any, BaseException | None], None]) -> tuple[Callable[[Asked | None], None], int]:
    """Begin such a thread. Gives what asks it, with what to call and how to read the answer, or None: end; and its number."""
    asked: SimpleQueue[Asked | None] = SimpleQueue()

    def serve() -> None:
        while (one := asked.get()) is not None:
            call, arguments, read, how = one
            try:
                answer, raised = read(call(*arguments), *how), None
            except BaseException as error:
                answer, raised = None, error
            deliver(answer, raised)
            # Nothing is held on to while nobody asks.
            del one, call, arguments, answer, raised

    thread = threading.Thread(target=serve, name="standoff law", daemon=True)
    thread.start()
    return asked.put, thread.ident or 0


def made(law: Any) -> Any:
    """A law, as it is."""
    return law


def command(answer: Any, whose: str) -> Command | None:
    """What is wanted of one UAV."""
    if answer is None or isinstance(answer, Command):
        return answer
    try:
        speed_m_s, turn_rate_rad_s = answer
    except (TypeError, ValueError):
        raise ValueError(f"{whose}.decide: gave {reprlib.repr(answer)}; {NEITHER}") from None
    try:
        return Command(float(speed_m_s), float(turn_rate_rad_s))
    except (TypeError, ValueError) as error:
        raise ValueError(f"{whose}.decide: gave {reprlib.repr(answer)}; {NEITHER}: {error}") from error


def commands(answer: Any, whose: str, uavs: int) -> list[Command | None]:
    """What is wanted of each UAV of a team."""
    try:
        each = iter(answer)
    except TypeError:
        raise TypeError(f"{whose}.decide: gave {reprlib.repr(answer)}; a team's law gives a list of commands") from None
    # One more than there can be: it may have no end.
    answers = list(itertools.islice(each, uavs + 1))
    if len(answers) != uavs:
        there = f"more than {uavs}" if len(answers) > uavs else str(len(answers))
        raise ValueError(f"{whose}.decide: gave {there} commands for {uavs} UAVs; one each")
    return [command(one, whose) for one in answers]


def duties(answer: Any, whose: str, uavs: frozenset[int], groups: frozenset[int]) -> list[tuple[int, int]] | None:
    """Who is to serve which group."""
    if answer is None:
        return None
    if not isinstance(answer, dict):
        raise TypeError(
            f"{whose}.decide: gave {reprlib.repr(answer)}; a law that assigns gives a dict of UAVs to groups, or None"
        )
    wanted = []
    for uav, group in answer.items():
        for what, number, there in (("UAV", uav, uavs), ("group", group, groups)):
            if number not in there:
                raise ValueError(f"{whose}.decide: {what} {reprlib.repr(number)} is none of {sorted(there)}")
        wanted.append((int(uav), int(group)))
    return wanted


def tracks(answer: Any, whose: str) -> Tracks:
    """What a law believes of targets."""
    if not isinstance(answer, Tracks):
        raise TypeError(f"{whose}.tracks: gave {reprlib.repr(answer)}; standoff.Tracks is wanted")
    return answer
