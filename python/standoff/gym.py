"""Gymnasium environments: a policy flies the UAVs, the product does everything else.

Importing this registers ``standoff/GroupTracking-v0``; ``gymnasium.make("standoff.gym:standoff/GroupTracking-v0")``
imports it, too. ``gymnasium.make_vec`` makes the native :class:`GroupTrackingVectorEnv`.

The mission is the simulator's own, of any scenario: sensors with noise and a field of view, tracks, groups, assignment and
where sensors point are the product's. The policy chooses turn rate and speed of every UAV, once per guidance period.

**Action**: ``Box(-1, 1, (UAVs, 2), float32)``. For each UAV

===== ======================== =============================================================================
place is                       unit
===== ======================== =============================================================================
0     commanded turn rate      ``uavs.turn_rate_max_rad_s`` rad/s, positive anticlockwise
1     commanded speed less the ``uavs.speed_change_max_m_s`` m/s
      nominal one
===== ======================== =============================================================================

float64 is taken, too; what is beyond -1 to 1 is flown at the limit; what is not finite is an error, and nothing has moved.

**Observation**: ``Box((UAVs, features), float32)``: what the team believes at that instant, never truth.
:func:`standoff.gym.observation_features` tells name, bounds, meaning and unit of every feature. Axes are the UAV's own:
ahead along its heading, left of it.

**Reward**, of the instant that a step leads to, by the truth, 0 to 1::

    reward   = (targets * watched + mean of on_orbit over the UAVs) / (targets + 1)
    targets  = number of existing targets
    watched  = share of them that are in a group and in some UAV's view
    on_orbit = 1 / (1 + |r - r_d| / radius_min_m); 0 for a UAV whose group has no true orbit, or without one

``watched`` is what ``watched_fraction`` averages, and r - r_d what ``standoff_error_m`` does: distance of the UAV from its
group's true orbit, about where the group's targets really are. No fault flatters it. Of what the team believes only its
grouping is in it. A target that is lost, discarded or never found stays in the divisor, and counts as much as all orbits
together: however much easier an orbit is without it, to lose it never pays. A UAV without a group, or whose group has no
target that exists, is on no orbit. And no reward is below 0, so that an episode which ends early gains nothing.

**End**: terminated when targets exist and none of them is known any more (no live track is left); truncated at the
scenario's duration.

**Info**: ``watched``, ``on_orbit`` (mean), ``targets`` (how many exist), ``seed`` (``standoff.run(scenario, seed=...)`` and
the command fly the same world), ``time_s``, and ``standoff_error_m`` (mean of |r - r_d| over the UAVs that have an orbit,
m), which is left out, or masked, where no UAV has one.

**Seeds**: ``reset(seed=s)`` flies the world of seed s; resets without a seed then fly worlds whose seeds depend on s and
on their number alone. World i of a vector environment does as an environment that was reset with s + i.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium.spaces import Box
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from standoff._standoff import Instant, Scenario, Worlds, observation_features
from standoff.errors import InputError

__all__ = ["GroupTrackingEnv", "GroupTrackingVectorEnv", "observation_features"]

ENV_ID = "standoff/GroupTracking-v0"

#: What is flown if nothing else is asked for.
SCENARIO = "tour/01-one-uav"

#: The highest seed that is chosen where none is given: a float holds it, too.
SEED_MAX = 2**53 - 1

Observations = NDArray[np.float32]
Actions = NDArray[np.floating[Any]]

# What a space of floats holds, Gymnasium's types do not tell.
Space = gymnasium.Space[Any]


class GroupTrackingEnv(gymnasium.Env[Observations, Actions]):
    """One mission, flown by one policy for all UAVs; the module tells actions, observations, rewards.

    :param scenario: a built-in name, a path, or a :class:`standoff.Scenario`.
    :param render_mode: ``None``: to see a flight, ``standoff.run(scenario, seed=info["seed"])`` makes a page of the law's.
    :raises standoff.ScenarioError: the scenario cannot be used.
    """

    metadata: dict[str, Any] = {"render_modes": []}
    observation_space: Space
    action_space: Space

    def __init__(self, scenario: str | Scenario = SCENARIO, *, render_mode: None = None) -> None:
        _check_render_mode(render_mode)
        self._worlds = Worlds(scenario, autoreset="Disabled")
        self._has_seed = False
        self.render_mode = None
        self.observation_space = observation_space(self._worlds.uavs)
        self.action_space = action_space(self._worlds.uavs)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observations, dict[str, Any]]:
        """Begins a mission.

        :param seed: its seed, 0 to 2**63 - 1; without one the next mission is flown, at first one of any seed.
        :param options: none are known.
        :returns: observation and info.
        """
        super().reset(seed=seed)
        if seed is None and not self._has_seed:
            seed = int(self.np_random.integers(SEED_MAX, endpoint=True))
        instant = self._worlds.reset([seed])
        self._has_seed = True
        return instant.observations[0], info_of(instant, 0)

    def step(self, action: Actions) -> tuple[Observations, float, bool, bool, dict[str, Any]]:
        """Flies an action until the next guidance period.

        :param action: (UAVs, 2).
        :returns: observation, reward, terminated, truncated, info.
        :raises standoff.InputError: another shape or type, or not finite; not reset, or over. Nothing has moved.
        """
        instant = self._worlds.step(np.asarray(action)[np.newaxis])
        return (
            instant.observations[0],
            float(instant.rewards[0]),
            bool(instant.terminated[0]),
            bool(instant.truncated[0]),
            info_of(instant, 0),
        )

    def law_action(self) -> NDArray[np.float64]:
        """The action of the product's own law at this instant, (UAVs, 2)."""
        law: NDArray[np.float64] = self._worlds.law_actions()[0]
        return law

    def close(self) -> None:
        """Frees the mission."""
        self._worlds.close()


class GroupTrackingVectorEnv(VectorEnv[Observations, Actions, NDArray[Any]]):
    """Missions side by side, flown natively; the module tells actions, observations, rewards.

    :param num_envs: number of missions, 1 to 100,000.
    :param scenario: a built-in name, a path, or a :class:`standoff.Scenario`.
    :param autoreset_mode: what happens to a mission that is over: an :class:`gymnasium.vector.AutoresetMode` or its value.
        With ``SAME_STEP``, ``final_obs`` and ``final_info`` tell how it ended; with ``DISABLED``, the option
        ``reset_mask`` of :meth:`reset` chooses what begins anew.
    :param threads: fly them on so many threads; more than 1 pays from some hundred UAVs on.
    :param render_mode: ``None``.
    :raises standoff.ScenarioError: the scenario cannot be used.
    :raises standoff.InputError: another argument is out of range.
    """

    metadata: dict[str, Any] = {"render_modes": [], "autoreset_mode": AutoresetMode.NEXT_STEP}

    def __init__(
        self,
        num_envs: int = 1,
        *,
        scenario: str | Scenario = SCENARIO,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        threads: int = 1,
        render_mode: None = None,
    ) -> None:
        _check_render_mode(render_mode)
        mode = autoreset_mode.value if isinstance(autoreset_mode, AutoresetMode) else autoreset_mode
        self._worlds = Worlds(scenario, count=num_envs, autoreset=mode, threads=threads)
        self._has_seeds = np.zeros(num_envs, dtype=bool)
        self.metadata = {**type(self).metadata, "autoreset_mode": AutoresetMode(mode)}
        self.render_mode = None
        self.num_envs = num_envs
        self.single_observation_space = observation_space(self._worlds.uavs)
        self.single_action_space = action_space(self._worlds.uavs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Observations, dict[str, Any]]:
        """Begins missions.

        :param seed: s: mission i has the seed s + i; or a seed for each, ``None`` for its next mission. Without one all
            fly their next missions, at first such of any seeds.
        :param options: ``reset_mask``, (num_envs,) bool: which missions begin anew; the others stay where they are.
        :returns: observations (num_envs, UAVs, features) and infos.
        """
        mask = (options or {}).get("reset_mask")
        mask = None if mask is None else np.asarray(mask)
        if mask is not None and (mask.shape != (self.num_envs,) or mask.dtype != np.bool_):
            raise InputError(f"reset_mask: bool of shape ({self.num_envs},), not {mask.dtype} of shape {mask.shape}")
        if seed is None or isinstance(seed, Sequence):
            super().reset()
            seeds: list[int | None] = [None] * self.num_envs if seed is None else list(seed)
        else:
            super().reset(seed=seed)
            seeds = [seed + index for index in range(self.num_envs)]
        for index in np.flatnonzero(~self._has_seeds[: len(seeds)]).tolist():
            if seeds[index] is None:
                seeds[index] = int(self.np_random.integers(SEED_MAX, endpoint=True))
        instant = self._worlds.reset(seeds, mask=None if mask is None else mask.tolist())
        self._has_seeds |= True if mask is None else mask
        return instant.observations, infos_of(instant)

    def step(
        self, actions: Actions
    ) -> tuple[Observations, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Flies actions until the next guidance period.

        :param actions: (num_envs, UAVs, 2).
        :returns: observations, rewards, terminations, truncations, infos.
        :raises standoff.InputError: another shape or type, or not finite; not reset, or over with ``DISABLED``. Nothing
            has moved.
        """
        instant = self._worlds.step(np.asarray(actions))
        infos = infos_of(instant)
        ended = instant.ended
        if ended is None:
            return instant.observations, instant.rewards, instant.terminated, instant.truncated, infos
        final_obs = np.full(self.num_envs, None, dtype=object)
        for index in np.flatnonzero(instant.has_ended):
            final_obs[index] = ended.observations[index]
        infos["final_obs"], infos["_final_obs"] = final_obs, instant.has_ended
        infos["final_info"], infos["_final_info"] = infos_of(ended, instant.has_ended), instant.has_ended.copy()
        # What the step has come to, and where the next mission begins.
        return instant.observations, ended.rewards, ended.terminated, ended.truncated, infos

    def law_actions(self) -> NDArray[np.float64]:
        """The actions of the product's own law at this instant, (num_envs, UAVs, 2)."""
        law: NDArray[np.float64] = self._worlds.law_actions()
        return law

    def close_extras(self, **kwargs: Any) -> None:
        """Frees the missions."""
        self._worlds.close()


def observation_space(uavs: int | None = None) -> Box:
    """The space of a team's observations, or of one UAV's.

    :param uavs: number of UAVs; ``None``: of one UAV alone, (features,).
    """
    features = observation_features()
    low, high = (np.array([feature[place] for feature in features], dtype=np.float32) for place in (1, 2))
    if uavs is None:
        return Box(low, high)
    return Box(np.tile(low, (uavs, 1)), np.tile(high, (uavs, 1)))


def action_space(uavs: int | None = None) -> Box:
    """The space of a team's actions, or of one UAV's.

    :param uavs: number of UAVs; ``None``: of one UAV alone, (2,).
    """
    return Box(-1.0, 1.0, (2,) if uavs is None else (uavs, 2), np.float32)


def info_of(instant: Instant, world: int) -> dict[str, Any]:
    """What is told of an instant of one world beside observation and reward."""
    info: dict[str, Any] = {
        "watched": float(instant.watched[world]),
        "on_orbit": float(instant.mean_on_orbit[world]),
        "targets": int(instant.targets[world]),
        "seed": int(instant.seeds[world]),
        "time_s": float(instant.time_s[world]),
    }
    if instant.has_orbit[world]:
        info["standoff_error_m"] = float(instant.standoff_error_m[world])
    return info


def infos_of(instant: Instant, mask: NDArray[np.bool_] | None = None) -> dict[str, Any]:
    """The same of all worlds, an array each and a mask of where it counts."""
    everywhere = np.ones(len(instant.targets), dtype=bool) if mask is None else mask
    infos = {
        "watched": instant.watched,
        "on_orbit": instant.mean_on_orbit,
        "targets": instant.targets,
        "seed": instant.seeds,
        "time_s": instant.time_s,
    }
    masks = {f"_{name}": everywhere.copy() for name in infos}
    error_m = {"standoff_error_m": instant.standoff_error_m, "_standoff_error_m": everywhere & instant.has_orbit}
    return {**infos, **masks, **error_m}


def _check_render_mode(render_mode: object) -> None:
    if render_mode is not None:
        raise InputError(f"render_mode: only None, not {render_mode!r}: look at a run's page instead")


if ENV_ID not in gymnasium.registry:
    gymnasium.register(
        id=ENV_ID,
        entry_point="standoff.gym:GroupTrackingEnv",
        vector_entry_point="standoff.gym:GroupTrackingVectorEnv",
    )
