"""Laws of your own: what :func:`standoff.run` and :func:`standoff.compare` fly in the place of the product."""

from typing import Any, ClassVar, Literal

from standoff._standoff import Briefing, Command

__all__ = ["Law"]


class Law:
    """A law that decides what UAVs do. Subclass it, and write :meth:`decide`.

    The simulator makes one for each run and each UAV, or one for the whole team, so nothing is carried from one run into
    the next. It sees no truth: only what an agent has, or the team's picture.

    :cvar decides_for: ``"agent"``: one law for each UAV, which decides for it alone. ``"team"``: one law for all; it is
        given a list of observations, by ascending UAV, and gives a list of commands.
    :cvar sees: ``"own"``: own state, own scan, what teammates report, cues. ``"picture"``: the team's picture as well,
        which the product keeps beside the law: fused tracks, groups, orbits, who serves which group; and what the product
        would do.
    :cvar replaces: ``"all"``: everything; without the picture nothing is known of tracks and groups, and what would need
        them is not scored. ``"guidance"``: speed and turn rate (and where to look, if the law says); tracks, groups and
        assignment are the product's. ``"assignment"``: who serves which group; the law is given a
        :class:`~standoff.Choice` and gives a dict of UAVs to groups.

    A law that replaces all may have a method ``tracks()``, asked after each instant, which gives :class:`~standoff.Tracks`:
    then its estimates are scored. Where each UAV has a law of its own, the first one's are.
    """

    decides_for: ClassVar[Literal["agent", "team"]] = "agent"
    sees: ClassVar[Literal["own", "picture"]] = "own"
    replaces: ClassVar[Literal["all", "guidance", "assignment"]] = "all"

    def __init__(self, briefing: Briefing) -> None:
        """Begin a run.

        :param briefing: what a team may know before it flies: limits, sensor, orbits.
        """
        self.briefing = briefing

    def decide(self, observation: Any) -> Command | tuple[float, float] | Any:
        """Decide what to do until the next instant.

        :param observation: an :class:`~standoff.Observation`; for a team a list of them; for a law that assigns a
            :class:`~standoff.Choice`.
        :returns: a :class:`~standoff.Command`, or ``(speed_m_s, turn_rate_rad_s)``, or None: what the product would do,
            or straight on. For a team a list of these. For a law that assigns a dict of UAVs to groups, or None.
        """
        raise NotImplementedError
