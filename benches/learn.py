"""What environments for learning cost: control steps a second, and ratios within this run.

python benches/learn.py [--envs N]: build with ``maturin develop --release`` first. Shortest times of several rounds
made in turns: machines are noisy, ratios less so.
"""

import argparse
import hashlib
import os
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import gymnasium
import numpy as np

import omnistep.gym  # noqa: F401  (registers the environments)

ROUNDS = 5


def shortest(works: list[Callable[[], None]]) -> list[float]:
    """Shortest time of each piece of work [s], made in turns."""
    best = [float("inf")] * len(works)
    for _ in range(ROUNDS):
        for k, work in enumerate(works):
            start = time.perf_counter()
            work()
            best[k] = min(best[k], time.perf_counter() - start)
    return best


def task(name: str, held: int, envs: int) -> None:
    """Print the figures of one task, whose actions are held for so many control periods."""
    identity, steps = f"omnistep/{name}-v0", max(1, 1000 // held)
    kind = "vector_entry_point"
    native = gymnasium.make_vec(identity, num_envs=envs, vectorization_mode=kind)
    alone = gymnasium.make_vec(identity, num_envs=envs, vectorization_mode=kind, threads=1)
    singles = [gymnasium.make(identity) for _ in range(envs)]
    actions = np.zeros(native.action_space.shape, np.float32)
    if name == "StepClimb":
        actions[:, 0] = 1.0  # into the step, where contacts are many

    def vector(which: gymnasium.vector.VectorEnv) -> Callable[[], None]:
        def work() -> None:
            which.reset(seed=0)
            for _ in range(steps):
                which.step(actions)

        return work

    def loop() -> None:
        for k, env in enumerate(singles):
            env.reset(seed=k)
        for _ in range(steps):
            for env, action in zip(singles, actions, strict=True):
                env.step(action)

    def resets() -> None:
        alone.reset(seed=0)

    threads, one, python, reset = shortest([vector(native), vector(alone), loop, resets])
    done = envs * steps * held
    busy = time.process_time()
    vector(native)()
    busy = time.process_time() - busy
    print(f"{identity}, {envs} environments, actions held for {held} control periods:")
    print(f"  native vector:           {done / threads:8.0f} control steps/s on {os.cpu_count()} cores")
    print(f"  native vector, 1 thread: {done / one:8.0f}; the cores are worth {one / threads:.2f} of one")
    print(f"  a second of one core:    {done / busy:8.0f}, whatever else the machine does")
    print(f"  loop over single ones:   {done / python:8.0f}; the vector is {python / threads:.2f} times as fast")
    print(f"  a reset:                 {1e6 * reset / envs:8.0f} us, as {reset / one * done / envs:.1f} control steps")


def machine() -> float:
    """Return what the cores are worth now, over one of them: hashing, which needs neither memory nor the lock."""
    block = bytes(1 << 20)

    def alone() -> None:
        for _ in range(300):
            hashlib.sha256(block).digest()

    def all_cores() -> None:
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            for done in [pool.submit(alone) for _ in range(os.cpu_count() or 1)]:
                done.result()

    one, several = shortest([alone, all_cores])
    return (os.cpu_count() or 1) * one / several


def main() -> None:
    """Print the figures of both tasks."""
    parser = argparse.ArgumentParser(description="What environments for learning cost.")
    parser.add_argument("--envs", type=int, default=16, help="environments; 16 if left out")
    given = parser.parse_args()
    for name, held in (("StepClimb", 50), ("Drive", 20)):
        task(name, held, given.envs)
    print(f"hashing alone, the cores are worth {machine():.2f} of one")


if __name__ == "__main__":
    main()
