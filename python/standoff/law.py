"""Base class of custom laws, which :func:`standoff.run` and :func:`standoff.compare` use instead of the built-in law."""

from typing import Any, ClassVar, Literal

from standoff._standoff import MissionInfo, Command

__all__ = ["Law"]


class Law:
    """A law that decides what UAVs do. Subclass it and implement :meth:`decide`.

    The simulator creates one object per run and UAV, or one per run for the whole team, so no state is carried from one
    run to the next. A law never sees the truth, only what an agent receives, or the team state.

    :cvar decides_for: ``"agent"``: one law per UAV, which decides for that UAV. ``"team"``: one law for the whole team,
        which receives a list of observations in ascending order of UAVs and returns a list of commands.
    :cvar sees: ``"own"``: own state, own scan, reports of teammates, cues. ``"team-state"``: in addition the team state,
        which the built-in law computes alongside: fused tracks, groups, orbits, assignments; and the built-in law's
        command.
    :cvar replaces: ``"all"``: everything. Without the team state no tracks or groups are known, and metrics that need
        them are not computed. ``"guidance"``: speed and turn rate, and optionally the pointing of the sensor; tracks,
        groups and assignment are built in. ``"assignment"``: the assignment of UAVs to groups. The law receives a
        :class:`~standoff.AssignmentProblem` and returns a dict from UAVs to groups.

    A law that replaces everything may have a method ``tracks()``, which is called after each time step and returns
    :class:`~standoff.Tracks`; these estimates are scored. If each UAV has its own law, those of the first one are scored.
    """

    decides_for: ClassVar[Literal["agent", "team"]] = "agent"
    sees: ClassVar[Literal["own", "team-state"]] = "own"
    replaces: ClassVar[Literal["all", "guidance", "assignment"]] = "all"

    def __init__(self, mission: MissionInfo) -> None:
        """Initialise the law for one run.

        :param mission: what a team may know in advance: limits, sensor, orbits.
        """
        self.mission = mission

    def decide(self, observation: Any) -> Command | tuple[float, float] | Any:
        """Decide the command until the next time step.

        :param observation: an :class:`~standoff.Observation`; for a team law a list of them; for an assignment law a
            :class:`~standoff.AssignmentProblem`.
        :returns: a :class:`~standoff.Command`, or ``(speed_m_s, turn_rate_rad_s)``, or None for the built-in law's
            command (straight flight if there is none). For a team law a list of these. For an assignment law a dict from
            UAVs to groups, or None for the built-in assignment.
        """
        raise NotImplementedError
