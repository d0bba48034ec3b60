"""``group_tracking_v0``: every UAV of a mission is an agent.

Worlds, numbers and seeds are the same as in :mod:`standoff.gym`, which defines an agent's observation (features,) and
action (2,). Agents are named ``uav_0``, ``uav_1``, ... by UAV number, and all of them exist until the mission ends.

**Reward** of an agent: the team's reward defined there, 0 to 1, with the agent's own ``on_orbit`` instead of the mean.
The mean over the agents is the team's reward.

**State**: the input of a central critic: the observations of all UAVs, concatenated, then true values of the team:
``in_custody``, mean ``on_orbit``, and the elapsed fraction of the scenario's duration; all within bounds.

**Copies**: as in :mod:`standoff.gym`, environments cannot be copied or pickled.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from gymnasium.spaces import Box
from numpy.typing import NDArray
from pettingzoo import ParallelEnv

from standoff._standoff import EnvStep, Scenario, Worlds
from standoff.errors import InputError
from standoff.gym import SEED_MAX, NotCopied, Image, Space, action_space, check_render_mode, info_of, observation_space

__all__ = ["GroupTrackingParallelEnv", "parallel_env"]

#: Default scenario, with two UAVs.
SCENARIO = "tour/02-two-uavs"

Observation = NDArray[np.float32]
Action = NDArray[np.floating[Any]]


class GroupTrackingParallelEnv(NotCopied, ParallelEnv[str, Observation, Action]):
    """One mission in which every UAV is an agent; see the module's documentation.

    :param scenario: a built-in name, a path, or a :class:`standoff.Scenario`.
    :param render_mode: ``"rgb_array"`` or ``None``.
    :raises standoff.ScenarioError: the scenario cannot be used.
    """

    metadata: dict[str, Any] = {"name": "group_tracking_v0", "render_modes": ["rgb_array"], "is_parallelizable": True}

    def __init__(self, scenario: str | Scenario = SCENARIO, *, render_mode: str | None = None) -> None:
        check_render_mode(render_mode)
        self.render_mode = render_mode
        self._worlds = Worlds(scenario, autoreset="Disabled")
        self.possible_agents = [f"uav_{uav}" for uav in range(self._worlds.uavs)]
        self.agents: list[str] = []
        self.observation_spaces: dict[str, Space] = {agent: observation_space() for agent in self.possible_agents}
        self.action_spaces: dict[str, Space] = {agent: action_space() for agent in self.possible_agents}
        team = observation_space(self._worlds.uavs)
        self.state_space = Box(
            np.append(team.low, np.zeros(3, np.float32)), np.append(team.high, np.ones(3, np.float32))
        )
        self._step: EnvStep | None = None

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Observation], dict[str, dict[str, Any]]]:
        """Starts a mission.

        :param seed: its seed, 0 to 2**63 - 1. Without one the next mission starts; the first one has a random seed.
        :param options: ignored.
        :returns: observations and infos by agent.
        """
        if seed is None and self._step is None:
            seed = int(np.random.default_rng().integers(SEED_MAX, endpoint=True))
        self._step = self._worlds.reset([seed])
        self.agents = list(self.possible_agents)
        return self._observations(self._step), self._infos(self._step)

    def step(
        self, actions: Mapping[str, Action]
    ) -> tuple[dict[str, Observation], dict[str, float], dict[str, bool], dict[str, bool], dict[str, dict[str, Any]]]:
        """Applies the actions of all agents until the next guidance period.

        :param actions: by agent, (2,).
        :returns: observations, rewards, terminations, truncations, infos by agent.
        :raises standoff.InputError: an agent is missing or unknown; an action has another shape or type, or is not
            finite; or the mission is over or was not reset. The world is unchanged.
        """
        if not self.agents:
            raise InputError("the mission is over or was not started: call reset first")
        if set(actions) != set(self.agents):
            raise InputError(
                f"actions: must have one for each of {', '.join(self.agents)}, not for {', '.join(map(str, actions))}"
            )
        single = [np.asarray(actions[agent]) for agent in self.agents]
        for agent, action in zip(self.agents, single, strict=True):
            if action.shape != (2,):
                raise InputError(f"actions: the one of {agent} must have shape (2,), not {action.shape}")
        step = self._worlds.step(np.stack(single)[np.newaxis])
        self._step = step
        terminated, truncated = bool(step.terminated[0]), bool(step.truncated[0])
        stepped = (
            self._observations(step),
            {agent: float(step.uav_rewards[0, index]) for index, agent in enumerate(self.agents)},
            dict.fromkeys(self.agents, terminated),
            dict.fromkeys(self.agents, truncated),
            self._infos(step),
        )
        if terminated or truncated:
            self.agents = []
        return stepped

    def law_actions(self) -> dict[str, NDArray[np.float64]]:
        """The actions of the built-in law at this time step, by agent, (2,)."""
        return dict(zip(self.possible_agents, self._worlds.law_actions()[0], strict=True))

    def state(self) -> NDArray[np.float32]:
        """The input of a central critic, as the module defines it, in ``state_space``.

        :raises standoff.InputError: the environment was not reset.
        """
        if self._step is None:
            raise InputError("no mission was started: call reset first")
        step = self._step
        elapsed = step.time_s[0] / step.duration_s[0]
        truth = np.array([step.in_custody[0], step.mean_on_orbit[0], elapsed])
        return np.append(step.observations[0], truth.astype(np.float32))

    def observation_space(self, agent: str) -> Space:
        """The space of an agent's observation."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> Space:
        """The space of an agent's action."""
        return self.action_spaces[agent]

    def render(self) -> Image | None:
        """The map at this time step, as ``standoff.gym`` describes it; ``None`` without a render mode."""
        return self._worlds.image() if self.render_mode else None

    def close(self) -> None:
        """Frees the mission."""
        self._worlds.close()
        self.agents = []

    def _observations(self, step: EnvStep) -> dict[str, Observation]:
        return {agent: step.observations[0, index].copy() for index, agent in enumerate(self.possible_agents)}

    def _infos(self, step: EnvStep) -> dict[str, dict[str, Any]]:
        infos = {}
        for index, agent in enumerate(self.possible_agents):
            infos[agent] = {**info_of(step, 0), "on_orbit": float(step.on_orbit[0, index])}
        return infos


parallel_env = GroupTrackingParallelEnv
