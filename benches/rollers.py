"""Rollers of the articulated engine beside MuJoCo's: same vehicle on level ground, same physics step, in one run.

    pip install ".[mujoco]"
    python benches/rollers.py

MuJoCo is timed without control, observations and a trace; ours has them all, and shortest times of several runs count.
"""

from __future__ import annotations

import importlib.util
import time

import omnistep.mujoco

DURATION_S, ROUNDS = 1.0, 5


def ours(step_us: int, model: str) -> float:
    """Times real time of a whole run."""
    keys = {
        "vehicle": "mecanum4",
        "duration_s": DURATION_S,
        "physics.engine": "articulated",
        "physics.wheel_model": model,
        "physics.timestep_s": step_us / 1e6,
    }
    scenario = omnistep.Scenario("step", overrides=keys)
    best = float("inf")
    for _ in range(ROUNDS):
        start = time.perf_counter()
        omnistep.run(scenario)
        best = min(best, time.perf_counter() - start)
    return DURATION_S / best


def theirs(step_us: int) -> float:
    """Times real time of the physics alone, driven ahead by constant torques."""
    import mujoco

    keys = {"vehicle": "mecanum4", "physics.timestep_s": step_us / 1e6}
    model = omnistep.mujoco.load("step", overrides=keys)
    best = float("inf")
    for _ in range(ROUNDS):
        data = mujoco.MjData(model)
        data.ctrl[:] = 0.05
        start = time.perf_counter()
        mujoco.mj_step(model, data, round(1e6 * DURATION_S / step_us))
        best = min(best, time.perf_counter() - start)
        assert data.time > 0.99 * DURATION_S, "MuJoCo diverged and began anew"
    return DURATION_S / best


def main() -> None:
    """Print times real time and their ratios."""
    if importlib.util.find_spec("mujoco") is None:
        print("MuJoCo is not installed (pip install mujoco): the articulated engine is not compared with it")
        return
    for step_us in (500, 250):
        balls, rollers, other = ours(step_us, "ball"), ours(step_us, "rollers"), theirs(step_us)
        print(
            f"mecanum4, {step_us} us: articulated {balls:.0f} times real time on balls and {rollers:.0f} on rollers, "
            f"MuJoCo's physics {other:.1f} on rollers: {rollers / other:.1f} times as fast"
        )


if __name__ == "__main__":
    main()
