"""Learn to climb steps with PPO of Stable-Baselines3, on the vector environment in Rust.

python python/examples/ppo_step_climb.py [--steps N] [--out FOLDER]: trains, compares on the same unseen episodes what
was learnt with driving straight ahead and with random actions, and writes ppo-step-climb.csv and ppo-step-climb.png.
Needs the extra ``ppo``: in the repository ``pip install ".[ppo]"``.
"""

import argparse
import csv
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

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


class Curve(BaseCallback):
    """Mean return and success rate of the latest 200 episodes, every 4096 steps; ends after so many minutes."""

    def __init__(self, minutes: float) -> None:
        super().__init__()
        self.rows: list[tuple[str, int, int, float, float]] = []
        self.ended: list[tuple[float, bool]] = []
        self.stop_at = time.monotonic() + 60.0 * minutes

    def _on_step(self) -> bool:
        infos = [info for info in self.locals["infos"] if "episode" in info]
        self.ended += [(info["episode"]["r"], info["is_success"]) for info in infos]
        if self.num_timesteps % 4096 == 0 and len(self.ended) >= 50:
            returns, successes = np.mean(self.ended[-200:], axis=0)
            self.rows.append(("training", self.num_timesteps, len(self.ended), float(returns), float(successes)))
            print(f"{self.num_timesteps:7d} steps: return {returns:6.3f}, success {successes:.2f}", flush=True)
        return time.monotonic() < self.stop_at


def evaluate(name: str, act: Callable[[np.ndarray], np.ndarray], episodes: int) -> tuple[str, int, int, float, float]:
    """Play the first episode of each unseen seed."""
    envs = gymnasium.make_vec(NAME, num_envs=episodes, vectorization_mode="vector_entry_point")
    observations, _ = envs.reset(seed=UNSEEN)
    returns, going, success = np.zeros(episodes), np.ones(episodes, bool), np.zeros(episodes, bool)
    while going.any():
        observations, rewards, terminated, truncated, info = envs.step(act(observations))
        returns += rewards * going
        success |= info["is_success"] & going
        going &= ~(terminated | truncated)
    print(
        f"{name}: return {returns.mean():.3f}, success {success.mean():.2f} of {episodes} unseen episodes", flush=True
    )
    return name, 0, episodes, float(returns.mean()), float(success.mean())


def draw(rows: list[tuple[str, int, int, float, float]], path: Path) -> None:
    """Draw the curve of training, and the others as lines to compare with."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8.0, 3.4), dpi=110, layout="constrained")
    axes = figure.subplots(1, 2)
    curve = [row for row in rows if row[0] == "training"]
    for ax, column, label in ((axes[0], 3, "return"), (axes[1], 4, "success rate")):
        x = [1e-3 * row[1] for row in curve]
        ax.plot(x, [row[column] for row in curve], color="#0072B2", label="training, latest 200 episodes")
        styles = {"learnt": ("#0072B2", "--"), "ahead": ("#D55E00", "-."), "random": ("0.4", ":")}
        for name, (colour, style) in styles.items():
            value = next(row[column] for row in rows if row[0] == name)
            ax.axhline(value, color=colour, linestyle=style, label=f"{name}, unseen episodes")
        ax.set(xlabel="actions [thousand]", ylabel=label)
        ax.grid(alpha=0.3)
    axes[1].set_ylim(-0.03, 1.03)
    figure.legend(*axes[1].get_legend_handles_labels(), loc="outside lower center", ncols=4, fontsize="x-small")
    figure.savefig(path)


def main() -> None:
    """Train, compare, write."""
    parser = argparse.ArgumentParser(description="Learn to climb steps with PPO.")
    parser.add_argument("--steps", type=int, default=250_000, help="actions to learn from; 250000 if left out")
    parser.add_argument("--minutes", type=float, default=60.0, help="stop after so many; 60 if left out")
    parser.add_argument("--episodes", type=int, default=96, help="unseen episodes to compare on; 96 if left out")
    parser.add_argument("--out", type=Path, default=Path("out"), help="folder of the results; out if left out")
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    torch.set_num_threads(1)  # the networks are small; the cores are for physics
    envs = gymnasium.make_vec(
        NAME,
        num_envs=16,
        vectorization_mode="vector_entry_point",
        autoreset_mode=gymnasium.vector.AutoresetMode.SAME_STEP,
    )
    model = PPO(
        "MlpPolicy",
        VecMonitor(Native(envs)),
        n_steps=128,
        batch_size=256,
        n_epochs=8,
        learning_rate=5e-4,
        gamma=0.99,  # 5 s at 20 actions a second: an episode
        policy_kwargs={"log_std_init": -0.5},
        seed=0,
        device="cpu",
    )
    curve = Curve(given.minutes)
    start = time.monotonic()
    model.learn(given.steps, callback=curve)
    print(f"{model.num_timesteps} actions in {time.monotonic() - start:.0f} s")
    shape, rng = (given.episodes, *envs.single_action_space.shape), np.random.default_rng(0)
    straight = np.zeros(shape, np.float32)
    straight[:, 0] = 1.0
    rows = [
        *curve.rows,
        evaluate("random", lambda _: rng.uniform(-1.0, 1.0, shape).astype(np.float32), given.episodes),
        evaluate("ahead", lambda _: straight, given.episodes),
        evaluate("learnt", lambda seen: model.predict(seen, deterministic=True)[0], given.episodes),
    ]
    with (given.out / "ppo-step-climb.csv").open("w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(["policy", "actions", "episodes", "mean_return", "success_rate"])
        table.writerows([*row[:3], f"{row[3]:.4f}", f"{row[4]:.4f}"] for row in rows)
    draw(rows, given.out / "ppo-step-climb.png")


if __name__ == "__main__":
    main()
