"""Learn to climb steps with PPO of Stable-Baselines3, on the vector environment in Rust, from several seeds.

python python/examples/ppo_step_climb.py [--seeds N] [--steps N] [--out FOLDER]: trains once a seed, one process a core;
compares on the same unseen episodes what was learnt with driving straight ahead and with random actions; writes
ppo-step-climb.csv and ppo-step-climb.png. Needs the extra ``ppo``: in the repository ``pip install ".[ppo]"``.
"""

import argparse
import csv
import os
import time
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium
import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import VecEnv, VecMonitor

import omnistep.gym  # noqa: F401  (registers the environments)

NAME = "omnistep/StepClimb-v0"
UNSEEN = 1_000_000  # the seed of the first of the episodes that policies are compared on; training is far below


class Native(VecEnv):
    """A vector environment of Gymnasium with `SAME_STEP` as one of Stable-Baselines3."""

    def __init__(self, envs: gymnasium.vector.VectorEnv) -> None:
        self.envs, self.actions = envs, np.zeros(envs.action_space.shape, np.float32)
        self.render_mode = None
        super().__init__(envs.num_envs, envs.single_observation_space, envs.single_action_space)

    def reset(self) -> np.ndarray:
        observations, _ = self.envs.reset(seed=self._seeds[0])
        self._reset_seeds()
        return observations

    def step_async(self, actions: np.ndarray) -> None:
        self.actions = actions

    def step_wait(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, list[dict[str, Any]]]:
        observations, rewards, terminated, truncated, info = self.envs.step(self.actions)
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for k in np.flatnonzero(terminated | truncated):
            infos[k] = {
                "terminal_observation": info["final_obs"][k],
                "TimeLimit.truncated": bool(truncated[k]),
                "is_success": bool(info["final_info"]["is_success"][k]),
            }
        return observations, rewards, terminated | truncated, infos

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        return [getattr(self.envs, attr_name)] * len(list(self._get_indices(indices)))

    def close(self) -> None:
        self.envs.close()

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        raise NotImplementedError("the environments are in Rust")

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> list[Any]:
        raise NotImplementedError("the environments are in Rust")

    def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
        return [False] * self.num_envs


class Row(NamedTuple):
    """A line of the table: how a policy did, or, of ``training``, the latest 200 episodes."""

    policy: str
    seed: int
    actions: int
    episodes: int
    mean_return: float
    success_rate: float


class Curve(BaseCallback):
    """Mean return and success rate of the latest 200 episodes, every 8192 actions; ends after so many minutes."""

    def __init__(self, seed: int, minutes: float) -> None:
        super().__init__()
        self.rows: list[Row] = []
        self.seed = seed
        self.ended: list[tuple[float, bool]] = []
        self.stop_at = time.monotonic() + 60.0 * minutes

    def _on_step(self) -> bool:
        infos = [info for info in self.locals["infos"] if "episode" in info]
        self.ended += [(info["episode"]["r"], info["is_success"]) for info in infos]
        if self.num_timesteps % 8192 == 0 and len(self.ended) >= 50:
            returns, successes = np.mean(self.ended[-200:], axis=0)
            row = Row("training", self.seed, self.num_timesteps, len(self.ended), float(returns), float(successes))
            self.rows.append(row)
            if self.num_timesteps % 65536 == 0:
                print(
                    f"seed {self.seed}, {row.actions:7d} actions: return {returns:.3f}, climbed {successes:.2f}",
                    flush=True,
                )
        return time.monotonic() < self.stop_at


def play(act: Callable[[np.ndarray], np.ndarray], episodes: int) -> np.ndarray:
    """Play the first episode of each unseen seed: returns and, as 0 or 1, whether it climbed; (2, episodes)."""
    envs = gymnasium.make_vec(NAME, num_envs=episodes, vectorization_mode="vector_entry_point")
    observations, _ = envs.reset(seed=UNSEEN)
    returns, going, success = np.zeros(episodes), np.ones(episodes, bool), np.zeros(episodes, bool)
    while going.any():
        observations, rewards, terminated, truncated, info = envs.step(act(observations))
        returns += rewards * going
        success |= info["is_success"] & going
        going &= ~(terminated | truncated)
    return np.stack([returns, success])


def learn(seed: int, steps: int, minutes: float, episodes: int) -> tuple[list[Row], np.ndarray]:
    """Train from a seed: the curve, and how what was learnt does on the unseen episodes."""
    torch.set_num_threads(1)  # the networks are small, and every core has a seed of its own
    envs = gymnasium.make_vec(
        NAME,
        num_envs=16,
        vectorization_mode="vector_entry_point",
        autoreset_mode=gymnasium.vector.AutoresetMode.SAME_STEP,
        threads=1,
    )
    model = PPO(
        "MlpPolicy",
        VecMonitor(Native(envs)),
        n_steps=128,
        batch_size=256,
        n_epochs=8,
        learning_rate=lambda left: 5e-4 * left,  # to nothing at the end
        gamma=0.99,  # 5 s at 20 actions a second: an episode
        policy_kwargs={"log_std_init": -0.5},
        seed=seed,
        device="cpu",
    )
    curve = Curve(seed, minutes)
    start = time.monotonic()
    model.learn(steps, callback=curve)
    played = play(lambda seen: model.predict(seen, deterministic=True)[0], episodes)
    print(
        f"seed {seed}: {model.num_timesteps} actions in {time.monotonic() - start:.0f} s, "
        f"climbs {played[1].mean():.3f} of the unseen episodes",
        flush=True,
    )
    return curve.rows, played


def better(learnt: np.ndarray, ahead: np.ndarray, draws: int = 10_000) -> tuple[float, float, float]:
    """Mean of ``learnt`` (seeds, episodes) less ``ahead`` (episodes) and its 95 % interval.

    A bootstrap over seeds and over episodes: what as many other seeds on other episodes would have shown.
    """
    rng = np.random.default_rng(0)
    difference = learnt - ahead
    seeds, episodes = difference.shape
    means = [
        difference[rng.integers(seeds, size=seeds)][:, rng.integers(episodes, size=episodes)].mean()
        for _ in range(draws)
    ]
    low, high = np.percentile(means, [2.5, 97.5])
    return float(difference.mean()), float(low), float(high)


def draw(rows: list[Row], path: Path) -> None:
    """Draw the curves of training, one a seed, and the others as lines to compare with."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 3.6), dpi=110, layout="constrained")
    axes = figure.subplots(1, 2)
    seeds = sorted({row.seed for row in rows if row.policy == "training"})
    for ax, column, label in ((axes[0], "mean_return", "return"), (axes[1], "success_rate", "success rate")):
        for seed in seeds:
            curve = [row for row in rows if row.policy == "training" and row.seed == seed]
            x, y = [1e-3 * row.actions for row in curve], [getattr(row, column) for row in curve]
            ax.plot(x, y, color="#0072B2", alpha=0.5, lw=1.0, label="training, latest 200 episodes of a seed")
        styles = {"learnt": ("#0072B2", "--"), "ahead": ("#D55E00", "-."), "random": ("0.4", ":")}
        for name, (colour, style) in styles.items():
            value = np.mean([getattr(row, column) for row in rows if row.policy == name])
            ax.axhline(value, color=colour, linestyle=style, label=f"{name}, unseen episodes")
        ax.set(xlabel="actions [thousand]", ylabel=label)
        ax.grid(alpha=0.3)
    axes[1].set_ylim(-0.03, 1.03)
    handles, labels = axes[1].get_legend_handles_labels()
    kept = dict(zip(labels, handles, strict=True))  # one line a label
    figure.legend(kept.values(), kept.keys(), loc="outside lower center", ncols=4, fontsize="x-small")
    figure.savefig(path)


def main() -> None:
    """Train, compare, write."""
    parser = argparse.ArgumentParser(description="Learn to climb steps with PPO.")
    parser.add_argument("--seeds", type=int, default=5, help="trainings, each from its own seed; 5 if left out")
    parser.add_argument("--steps", type=int, default=500_000, help="actions to learn from; 500000 if left out")
    parser.add_argument("--minutes", type=float, default=60.0, help="stop a training after so many; 60 if left out")
    parser.add_argument("--episodes", type=int, default=400, help="unseen episodes to compare on; 400 if left out")
    parser.add_argument("--out", type=Path, default=Path("out"), help="folder of the results; out if left out")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    # Processes that begin anew: threads of PyTorch do not survive a fork.
    with ProcessPoolExecutor(os.cpu_count(), mp_context=get_context("spawn")) as pool:
        trained = [pool.submit(learn, seed, given.steps, given.minutes, given.episodes) for seed in range(given.seeds)]
        trained = [training.result() for training in trained]
    shape, rng = (given.episodes, 5), np.random.default_rng(0)
    straight = np.zeros(shape, np.float32)
    straight[:, 0] = 1.0
    played = {
        "random": [play(lambda _: rng.uniform(-1.0, 1.0, shape).astype(np.float32), given.episodes)],
        "ahead": [play(lambda _: straight, given.episodes)],
        "learnt": [played for _, played in trained],
    }
    rows = [row for curve, _ in trained for row in curve]
    for name, of in played.items():
        for seed, (returns, climbed) in enumerate(of):
            rows.append(Row(name, seed, 0, given.episodes, float(returns.mean()), float(climbed.mean())))
            print(f"{name} {seed}: return {returns.mean():.3f}, climbed {climbed.mean():.3f}")
    learnt = np.stack(played["learnt"])  # seeds, two figures, episodes
    for number, what in enumerate(("return", "climbed")):
        mean, low, high = better(learnt[:, number], played["ahead"][0][number])
        print(f"learnt less ahead, {what}: {mean:+.3f}, 95 % within {low:+.3f} to {high:+.3f}")
    with (given.out / "ppo-step-climb.csv").open("w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(Row._fields)
        table.writerows([*row[:4], f"{row[4]:.4f}", f"{row[5]:.4f}"] for row in rows)
    draw(rows, given.out / "ppo-step-climb.png")


if __name__ == "__main__":
    main()
