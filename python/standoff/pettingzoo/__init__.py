"""PettingZoo environments: every UAV an agent with a policy of its own."""

from standoff.pettingzoo import group_tracking_v0

__all__ = ["group_tracking_v0"]
