"""Gymnasium environments: a policy steers the UAVs, and standoff does everything else.

Importing this registers ``standoff/GroupTracking-v0``; ``gymnasium.make("standoff.gym:standoff/GroupTracking-v0")``
imports it, too. ``gymnasium.make_vec`` creates the native :class:`GroupTrackingVectorEnv`.

The mission can use any scenario of the simulator: noisy sensors with a limited field of view, tracks, groups, assignment
and sensor pointing work as usual. The policy chooses turn rate and speed of every UAV, once per guidance period.

**Action**: ``Box(-1, 1, (UAVs, 2), float32)``. For each UAV

===== ======================== =============================================================================
index meaning                  unit
===== ======================== =============================================================================
0     commanded turn rate      ``uavs.turn_rate_max_rad_s`` rad/s, positive anticlockwise
1     commanded speed minus    ``uavs.speed_change_max_m_s`` m/s
      nominal speed
===== ======================== =============================================================================

float64 is accepted, too. Values are clipped to -1 to 1; a value that is not finite is an error and leaves the world
unchanged.

**Observation**: ``Box((UAVs, features), float32)``: the team's estimates at that time step, never the truth.
:func:`standoff.gym.observation_features` lists name, bounds, meaning and unit of every feature. Axes are the UAV's own:
ahead along its heading, and left of it.

**Reward**, for the time step after the action, computed from the truth, 0 to 1::

    reward     = (targets * in_custody + mean of on_orbit over the UAVs) / (targets + 1)
    targets    = number of existing targets
    in_custody = fraction of them that are in a group and in some UAV's view
    on_orbit   = 1 / (1 + |r - r_d| / radius_min_m); 0 for a UAV without a group, or whose group has no true orbit

The metric ``custody_fraction`` is the mean of ``in_custody``, and ``standoff_error_m`` that of |r - r_d|: the distance
of the UAV from its group's true orbit, about the true positions of the group's targets. Failures cannot increase the
reward: of the team's estimates it uses only the grouping. A target that is lost, removed or never found stays in the
divisor and counts as much as all orbits together, so losing it never pays, however much easier an orbit is without it.
A UAV without a group, or whose group has no existing target, is on no orbit. Rewards are never negative, so ending an
episode early gains nothing.

**End**: terminated when targets exist but no live track is left; truncated at the scenario's duration.

**Info**: ``in_custody``, ``on_orbit`` (mean), ``targets`` (number of existing targets), ``seed`` (``standoff.run(scenario,
seed=...)`` and the command simulate the same world), ``time_s``, and ``standoff_error_m`` (mean of |r - r_d| over the
UAVs that have an orbit, m), which is omitted, or masked, if no UAV has one.

**Seeds**: ``reset(seed=s)`` starts the world of seed s. Later resets without a seed start worlds whose seeds depend only
on s and on the number of resets. World i of a vector environment behaves like an environment that was reset with s + i.

**Images**: with ``render_mode="rgb_array"``, ``render()`` draws the map of the replay page without texts: UAVs
(triangles) with their fields of view, true targets (grey dots), tracks (rings in the colour of their group) and orbits.

**Copies**: environments cannot be copied or pickled. To return to a state, or to branch from it, create another
environment, reset it with the same seed and repeat the actions: the worlds are then bit-identical.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NoReturn

import gymnasium
import numpy as np
from gymnasium.spaces import Box
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from standoff._standoff import EnvStep, Scenario, Worlds, observation_features
from standoff.errors import InputError

__all__ = ["GroupTrackingEnv", "GroupTrackingVectorEnv", "observation_features"]

ENV_ID = "standoff/GroupTracking-v0"

#: Default scenario.
SCENARIO = "tour/01-one-uav"

#: Highest random seed chosen if none is given; a float can represent it exactly.
SEED_MAX = 2**53 - 1

Observations = NDArray[np.float32]
Actions = NDArray[np.floating[Any]]
Image = NDArray[np.uint8]

# Gymnasium's types do not state the element type of a space of floats.
Space = gymnasium.Space[Any]


class NotCopied:
    """Base of the environments: refuses copies, which would share the native missions or lack them."""

    def __reduce_ex__(self, protocol: object) -> NoReturn:
        raise TypeError(
            f"a {type(self).__name__} cannot be copied or pickled: create another one, reset it with the same seed and "
            "repeat the actions, which gives bit-identical worlds"
        )


class GroupTrackingEnv(NotCopied, gymnasium.Env[Observations, Actions]):
    """One mission in which one policy steers all UAVs; the module defines actions, observations and rewards.

    :param scenario: a built-in name, a path, or a :class:`standoff.Scenario`.
    :param render_mode: ``"rgb_array"`` or ``None``.
    :raises standoff.ScenarioError: the scenario cannot be used.
    """

    metadata: dict[str, Any] = {"render_modes": ["rgb_array"], "render_fps": 10}
    observation_space: Space
    action_space: Space

    def __init__(self, scenario: str | Scenario = SCENARIO, *, render_mode: str | None = None) -> None:
        check_render_mode(render_mode)
        self._worlds = Worlds(scenario, autoreset="Disabled")
        self._has_seed = False
        self.render_mode = render_mode
        self.observation_space = observation_space(self._worlds.uavs)
        self.action_space = action_space(self._worlds.uavs)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observations, dict[str, Any]]:
        """Starts a mission.

        :param seed: its seed, 0 to 2**63 - 1. Without one the next mission starts; the first one has a random seed.
        :param options: ignored.
        :returns: observation and info.
        """
        super().reset(seed=seed)
        if seed is None and not self._has_seed:
            seed = int(self.np_random.integers(SEED_MAX, endpoint=True))
        step = self._worlds.reset([seed])
        self._has_seed = True
        return step.observations[0], info_of(step, 0)

    def step(self, action: Actions) -> tuple[Observations, float, bool, bool, dict[str, Any]]:
        """Applies an action until the next guidance period.

        :param action: (UAVs, 2).
        :returns: observation, reward, terminated, truncated, info.
        :raises standoff.InputError: the action has another shape or type, or is not finite; or the mission is over or
            was not reset. The world is unchanged.
        """
        array = np.asarray(action)
        if array.shape != self.action_space.shape:
            raise InputError(
                f"actions: must be float32 or float64 of shape {self.action_space.shape}, not of shape {array.shape}"
            )
        step = self._worlds.step(array[np.newaxis])
        return (
            step.observations[0],
            float(step.rewards[0]),
            bool(step.terminated[0]),
            bool(step.truncated[0]),
            info_of(step, 0),
        )

    def law_action(self) -> NDArray[np.float64]:
        """The action of the built-in law at this time step, (UAVs, 2)."""
        law: NDArray[np.float64] = self._worlds.law_actions()[0]
        return law

    def render(self) -> Image | None:
        """The map at this time step; ``None`` without a render mode.

        :returns: red, green and blue, (600, 600, 3); north is up.
        """
        return self._worlds.image() if self.render_mode else None

    def close(self) -> None:
        """Frees the mission."""
        self._worlds.close()


class GroupTrackingVectorEnv(NotCopied, VectorEnv[Observations, Actions, NDArray[Any]]):
    """Several missions, simulated natively; the module defines actions, observations and rewards.

    :param num_envs: number of missions, 1 to 100,000.
    :param scenario: a built-in name, a path, or a :class:`standoff.Scenario`.
    :param autoreset_mode: how finished missions restart: an :class:`gymnasium.vector.AutoresetMode` or its value.
        With ``SAME_STEP``, ``final_obs`` and ``final_info`` contain the last state of a finished mission; with
        ``DISABLED``, the option ``reset_mask`` of :meth:`reset` selects the missions to restart.
    :param threads: number of threads; more than 1 pays off above some hundred UAVs.
    :param render_mode: ``"rgb_array"`` or ``None``.
    :raises standoff.ScenarioError: the scenario cannot be used.
    :raises standoff.InputError: another argument is out of range.
    """

    metadata: dict[str, Any] = {**GroupTrackingEnv.metadata, "autoreset_mode": AutoresetMode.NEXT_STEP}

    def __init__(
        self,
        num_envs: int = 1,
        *,
        scenario: str | Scenario = SCENARIO,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        threads: int = 1,
        render_mode: str | None = None,
    ) -> None:
        check_render_mode(render_mode)
        mode = autoreset_mode.value if isinstance(autoreset_mode, AutoresetMode) else autoreset_mode
        self._worlds = Worlds(scenario, count=num_envs, autoreset=mode, threads=threads)
        self._has_seeds = np.zeros(num_envs, dtype=bool)
        self.metadata = {**type(self).metadata, "autoreset_mode": AutoresetMode(mode)}
        self.render_mode = render_mode
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
        """Starts missions.

        :param seed: an integer s gives mission i the seed s + i; a sequence has a seed for each mission, or ``None`` for
            its next mission. Without it every mission continues with its next seed; the first ones have random seeds.
        :param options: ``reset_mask``, (num_envs,) bool: the missions to restart; the others are unchanged.
        :returns: observations (num_envs, UAVs, features) and infos.
        """
        mask = (options or {}).get("reset_mask")
        mask = None if mask is None else np.asarray(mask)
        if mask is not None and (mask.shape != (self.num_envs,) or mask.dtype != np.bool_):
            raise InputError(
                f"reset_mask: must be bool of shape ({self.num_envs},), not {mask.dtype} of shape {mask.shape}"
            )
        if seed is None or isinstance(seed, Sequence):
            super().reset()
            seeds: list[int | None] = [None] * self.num_envs if seed is None else list(seed)
        else:
            super().reset(seed=seed)
            seeds = [seed + index for index in range(self.num_envs)]
        for index in np.flatnonzero(~self._has_seeds[: len(seeds)]).tolist():
            if seeds[index] is None:
                seeds[index] = int(self.np_random.integers(SEED_MAX, endpoint=True))
        step = self._worlds.reset(seeds, mask=None if mask is None else mask.tolist())
        self._has_seeds |= True if mask is None else mask
        return step.observations, infos_of(step)

    def step(
        self, actions: Actions
    ) -> tuple[Observations, NDArray[np.float64], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Applies actions until the next guidance period.

        :param actions: (num_envs, UAVs, 2).
        :returns: observations, rewards, terminations, truncations, infos.
        :raises standoff.InputError: the actions have another shape or type, or are not finite; or a mission was not
            reset, or is over with ``DISABLED``. The worlds are unchanged.
        """
        step = self._worlds.step(np.asarray(actions))
        infos = infos_of(step)
        ended = step.ended
        if ended is None:
            return step.observations, step.rewards, step.terminated, step.truncated, infos
        final_obs = np.full(self.num_envs, None, dtype=object)
        for index in np.flatnonzero(step.has_ended):
            final_obs[index] = ended.observations[index]
        infos["final_obs"], infos["_final_obs"] = final_obs, step.has_ended
        infos["final_info"], infos["_final_info"] = infos_of(ended, step.has_ended), step.has_ended.copy()
        # Rewards and flags of the finished mission, but the first observation of the next one.
        return step.observations, ended.rewards, ended.terminated, ended.truncated, infos

    def law_actions(self) -> NDArray[np.float64]:
        """The actions of the built-in law at this time step, (num_envs, UAVs, 2)."""
        law: NDArray[np.float64] = self._worlds.law_actions()
        return law

    def render(self) -> tuple[Image, ...] | None:
        """The maps of all missions at this time step, as for a single environment; ``None`` without a render mode."""
        return tuple(self._worlds.image(world) for world in range(self.num_envs)) if self.render_mode else None

    def close_extras(self, **kwargs: Any) -> None:
        """Frees the missions."""
        self._worlds.close()


def observation_space(uavs: int | None = None) -> Box:
    """The observation space of a team or of one UAV.

    :param uavs: number of UAVs; ``None`` for a single UAV's space, (features,).
    """
    features = observation_features()
    low, high = (np.array([feature[index] for feature in features], dtype=np.float32) for index in (1, 2))
    if uavs is None:
        return Box(low, high)
    return Box(np.tile(low, (uavs, 1)), np.tile(high, (uavs, 1)))


def action_space(uavs: int | None = None) -> Box:
    """The action space of a team or of one UAV.

    :param uavs: number of UAVs; ``None`` for a single UAV's space, (2,).
    """
    return Box(-1.0, 1.0, (2,) if uavs is None else (uavs, 2), np.float32)


def info_of(step: EnvStep, world: int) -> dict[str, Any]:
    """The info dict of one world at one time step."""
    info: dict[str, Any] = {
        "in_custody": float(step.in_custody[world]),
        "on_orbit": float(step.mean_on_orbit[world]),
        "targets": int(step.targets[world]),
        "seed": int(step.seeds[world]),
        "time_s": float(step.time_s[world]),
    }
    if step.has_orbit[world]:
        info["standoff_error_m"] = float(step.standoff_error_m[world])
    return info


def infos_of(step: EnvStep, mask: NDArray[np.bool_] | None = None) -> dict[str, Any]:
    """The info dict of all worlds: one array per entry, and a mask of its valid elements."""
    everywhere = np.ones(len(step.targets), dtype=bool) if mask is None else mask
    infos = {
        "in_custody": step.in_custody,
        "on_orbit": step.mean_on_orbit,
        "targets": step.targets,
        "seed": step.seeds,
        "time_s": step.time_s,
    }
    masks = {f"_{name}": everywhere.copy() for name in infos}
    error_m = {"standoff_error_m": step.standoff_error_m, "_standoff_error_m": everywhere & step.has_orbit}
    return {**infos, **masks, **error_m}


def check_render_mode(render_mode: object) -> None:
    """Refuses other render modes than those of the environments."""
    if render_mode not in (None, "rgb_array"):
        raise InputError(f'render_mode = {render_mode!r}: must be None or "rgb_array"')


if ENV_ID not in gymnasium.registry:
    gymnasium.register(
        id=ENV_ID,
        entry_point="standoff.gym:GroupTrackingEnv",
        vector_entry_point="standoff.gym:GroupTrackingVectorEnv",
    )
