"""Rollers of the articulated engine beside MuJoCo's: same vehicle on level ground, same physics step, in one run.

    pip install mujoco              # development only
    python benches/rollers.py [--program target/release/omnistep]

MuJoCo is timed without control, observations and a trace; ours has them all, and shortest times of several runs count.
"""

from __future__ import annotations

import argparse
import importlib.util
import sys
import time
from pathlib import Path

import omnistep

ROOT = Path(__file__).resolve().parents[1]
STUDY = ROOT / "scripts/wheel_models/step_mecanum4.toml"
DURATION_S, ROUNDS = 1.0, 5


def ours(step_us: int, model: str) -> float:
    """Times real time of a whole run."""
    keys = {
        "vehicle": "mecanum4",
        "duration_s": DURATION_S,
        "physics.engine": "articulated",
        "physics.wheel_model": model,
        "physics.step_us": step_us,
    }
    scenario = omnistep.Scenario("step", overrides=keys)
    best = float("inf")
    for _ in range(ROUNDS):
        start = time.perf_counter()
        omnistep.run(scenario)
        best = min(best, time.perf_counter() - start)
    return DURATION_S / best


def theirs(step_us: int, program: str) -> float:
    """Times real time of the physics alone, driven ahead by constant torques."""
    import mujoco

    sys.path.insert(0, str(ROOT / "scripts/wheel_models"))
    import mujoco_rollers
    from compare import vehicle_of

    vehicle, size = vehicle_of(STUDY, program)
    model = mujoco_rollers.model(vehicle, size, at_m=0.8, height=0.03, friction=0.7)
    model.opt.timestep = 1e-6 * step_us
    wheels = range(len(vehicle["wheel"]))
    spins = [int(model.joint(f"j{i}").dofadr[0]) for i in wheels]
    best = float("inf")
    for _ in range(ROUNDS):
        data = mujoco.MjData(model)
        data.qfrc_applied[spins] = 0.05
        start = time.perf_counter()
        mujoco.mj_step(model, data, round(1e6 * DURATION_S / step_us))
        best = min(best, time.perf_counter() - start)
        assert data.time > 0.99 * DURATION_S, "MuJoCo diverged and began anew"
    return DURATION_S / best


def main() -> None:
    """Print times real time and their ratios."""
    parser = argparse.ArgumentParser(description="The articulated engine beside MuJoCo.")
    parser.add_argument("--program", default=str(ROOT / "target/release/omnistep"), help="the command line's program")
    given = parser.parse_args()
    if importlib.util.find_spec("mujoco") is None:
        print("MuJoCo is not installed (pip install mujoco): the articulated engine is not compared with it")
        return
    if not Path(given.program).is_file():
        parser.error(f"--program: no file {given.program}; cargo build --release makes it")
    for step_us in (500, 250):
        balls, rollers, other = ours(step_us, "ball"), ours(step_us, "rollers"), theirs(step_us, given.program)
        print(
            f"mecanum4, {step_us} us: articulated {balls:.0f} times real time on balls and {rollers:.0f} on rollers, "
            f"MuJoCo's physics {other:.1f} on rollers: {rollers / other:.1f} times as fast"
        )


if __name__ == "__main__":
    main()
