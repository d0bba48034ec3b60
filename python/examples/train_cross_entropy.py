"""Trains a policy with the cross-entropy method in NumPy; takes some seconds on one core.

    python train_cross_entropy.py --out training

The policy is linear: one matrix from a UAV's observation to its action, the same for every UAV. In each generation many
policies are drawn from a normal distribution and each flies a mission, in one vector environment; the best of them define
the next distribution. Progress is measured by the gap closed: 0 is the return of a random policy, 1 that of the built-in
law, in the same worlds with the same rewards. The final value is measured in worlds not used for training.

Writes curve.csv and curve.svg. The same arguments give the same bytes.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from standoff.gym import GroupTrackingVectorEnv, observation_features

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Generation:
    """Results of one generation."""

    number: int
    #: Return of the distribution's mean, of the best policy, and the average of all policies.
    mean_policy: float
    best: float
    population: float
    #: Fraction of the gap between a random policy and the law that the distribution's mean has closed.
    gap_closed: float


@dataclass(frozen=True)
class Training:
    """Results of a training run."""

    #: Mean returns over the worlds in which the last policy is evaluated.
    random_return: float
    law_return: float
    policy_return: float
    curve: list[Generation]
    #: (2, features + 1): the matrix, followed by the column of constants.
    policy: Array

    @property
    def gap_closed(self) -> float:
        """Fraction of the gap that the last policy closes in those worlds."""
        return gap_closed(self.policy_return, self.random_return, self.law_return)


def gap_closed(policy_return: float, random_return: float, law_return: float) -> float:
    """Fraction of the gap closed: 0 for a random policy, 1 for the built-in law."""
    return (policy_return - random_return) / (law_return - random_return)


def returns(env: GroupTrackingVectorEnv, act: Callable[[Array], Array], *, seeds: list[int]) -> Array:
    """The sum of rewards of one mission per world, with the given seeds."""
    observations, _ = env.reset(seed=seeds)
    total = np.zeros(env.num_envs)
    is_flying = np.ones(env.num_envs, dtype=bool)
    while is_flying.any():
        observations, rewards, terminated, truncated, _ = env.step(act(observations.astype(np.float64)))
        total += np.where(is_flying, rewards, 0.0)
        is_flying &= ~(terminated | truncated)
    return total


def linear(policies: Array) -> Callable[[Array], Array]:
    """Combines linear policies (2, features + 1), one per world, into a function from observations to actions."""
    matrices, constants = policies[:, :, :-1], policies[:, np.newaxis, :, -1]

    def act(observations: Array) -> Array:
        actions = observations @ matrices.transpose(0, 2, 1) + constants
        return np.clip(actions, -1.0, 1.0)

    return act


def train(
    scenario: str = "tour/01-one-uav",
    *,
    generations: int = 40,
    population: int = 64,
    elites: int = 8,
    seed: int = 1,
    log: Callable[[str], None] = lambda line: None,
) -> Training:
    """Trains a policy; the result depends only on the arguments."""
    draws = np.random.default_rng(seed)
    env = GroupTrackingVectorEnv(population, scenario=scenario)
    features = len(observation_features())
    shape = env.reset(seed=seed)[0].shape[:2] + (2,)
    # Different from the seeds of the training, where generation g uses seed + g.
    seeds = [seed + 1_000_000 + index for index in range(population)]
    random_return = float(returns(env, lambda _: draws.uniform(-1.0, 1.0, shape), seeds=seeds).mean())
    law_return = float(returns(env, lambda _: env.law_actions(), seeds=seeds).mean())
    log(f"random {random_return:.1f}, law {law_return:.1f}")
    mean, sd = np.zeros((2, features + 1)), np.ones((2, features + 1))
    curve = []
    for number in range(generations):
        policies = mean + sd * draws.standard_normal((population, *mean.shape))
        policies[0] = mean
        # Every generation uses another world, if the scenario has random values.
        scores = returns(env, linear(policies), seeds=[seed + number] * population)
        best = policies[np.argsort(-scores, kind="stable")[:elites]]
        mean_policy, best_policy = float(scores[0]), float(scores.max())
        closed = gap_closed(mean_policy, random_return, law_return)
        curve.append(Generation(number, mean_policy, best_policy, float(scores.mean()), closed))
        log(f"generation {number}: mean policy {mean_policy:.1f}, best {best_policy:.1f}, gap closed {closed:.2f}")
        # The additional spread decays slowly, because a narrow distribution finds no better policies.
        mean, sd = best.mean(axis=0), best.std(axis=0) + 0.3 * 0.9**number
    policy_return = float(returns(env, linear(np.tile(mean, (population, 1, 1))), seeds=seeds).mean())
    env.close()
    return Training(random_return, law_return, policy_return, curve, mean)


def write(training: Training, folder: Path) -> None:
    """Writes the learning curve as CSV and SVG."""
    folder.mkdir(parents=True, exist_ok=True)
    rows = [f"{g.number},{g.mean_policy!r},{g.best!r},{g.population!r},{g.gap_closed!r}" for g in training.curve]
    (folder / "curve.csv").write_text("\n".join(["generation,mean_policy,best,population,gap_closed", *rows, ""]))
    (folder / "curve.svg").write_text(picture(training))


def picture(training: Training) -> str:
    """SVG of the return by generation, with the returns of a random policy and of the built-in law."""
    width, height, left, bottom = 640, 360, 60, 40
    everything = [training.random_return, training.law_return]
    everything += [number for g in training.curve for number in (g.mean_policy, g.best)]
    low, high = min(everything), max(everything)

    def x(number: int) -> float:
        return left + (width - left - 120) * number / max(len(training.curve) - 1, 1)

    def y(value: float) -> float:
        return 20 + (height - 20 - bottom) * (high - value) / max(high - low, 1e-9)

    def line(values: Sequence[float], colour: str, name: str, dash: str = "", down: float = 4.0) -> str:
        points = " ".join(f"{x(number):.1f},{y(value):.1f}" for number, value in enumerate(values))
        label = f'<text x="{x(len(values) - 1) + 6:.1f}" y="{y(values[-1]) + down:.1f}" fill="{colour}">{name}</text>'
        return f'<polyline points="{points}" fill="none" stroke="{colour}" stroke-dasharray="{dash}"/>{label}'

    n = len(training.curve)
    half = 0.5 * (training.random_return + training.law_return)
    ticks = "".join(
        f'<text x="{left - 8}" y="{y(value) + 4:.1f}" text-anchor="end">{value:.0f}</text>'
        for value in (training.random_return, half, training.law_return)
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif" font-size="12">'
        f'<rect width="{width}" height="{height}" fill="white"/>{ticks}'
        f'<text x="{left}" y="{height - 12}">generation 0 to {n - 1}; return of a mission</text>'
        + line([training.law_return] * n, "#555555", "law", "6 3")
        + line([half] * n, "#999999", "half the gap", "2 3")
        + line([training.random_return] * n, "#555555", "random", "6 3")
        + line([g.mean_policy for g in training.curve], "#0b6fb8", "mean policy", down=20.0)
        + "</svg>\n"
    )


def main() -> int:
    """Trains and prints the results; returns 1 if less than half of the gap is closed."""
    parser = argparse.ArgumentParser(description="Trains a policy by the cross-entropy method.")
    parser.add_argument("--scenario", default="tour/01-one-uav")
    parser.add_argument("--generations", type=int, default=40)
    parser.add_argument("--population", type=int, default=64)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("training"))
    args = parser.parse_args()
    started_s = time.perf_counter()
    training = train(
        args.scenario, generations=args.generations, population=args.population, seed=args.seed, log=print
    )
    write(training, args.out)
    closed = training.gap_closed
    print(f"return {training.policy_return:.1f} in worlds not used for training: {closed:.0%} of the gap closed")
    print(f"{time.perf_counter() - started_s:.1f} s; the curve is in {args.out / 'curve.svg'}")
    return 0 if closed >= 0.5 else 1


if __name__ == "__main__":
    raise SystemExit(main())
