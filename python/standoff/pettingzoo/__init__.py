"""PettingZoo environments: every UAV is an agent with its own policy."""

from standoff.pettingzoo import group_tracking_v0

__all__ = ["group_tracking_v0"]
