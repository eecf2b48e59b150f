"""What Python pays, as ratios within one run: `python benches/python.py`, with the extra `test` installed."""

import _thread
import statistics
import tempfile
import threading
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

import omnistep

REPEATS = 5


def seconds(call: Callable[[], object]) -> float:
    """Time of one call."""
    start = time.perf_counter()
    call()
    return time.perf_counter() - start


def against(one: Callable[[], object], other: Callable[[], object]) -> tuple[float, float]:
    """Median times of two calls, taken in turns: what else the machine does meets both."""
    pairs = [(seconds(one), seconds(other)) for _ in range(REPEATS)]
    return statistics.median(a for a, _ in pairs), statistics.median(b for _, b in pairs)


def pure_python(path: Path) -> int:
    """Every message decoded by Python's mcap and its ROS 2 decoder."""
    count = 0
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for _ in reader.iter_decoded_messages():
            count += 1
    return count


def reading(folder: Path) -> None:
    """A log of the step, every message decoded and every checksum checked."""
    path = folder / "step.mcap"
    omnistep.run("step", mcap=path, progress=False)
    ours, theirs = against(lambda: omnistep.read_mcap(path, progress=False), lambda: pure_python(path))
    size = path.stat().st_size / 1e6
    print(f"read_mcap: {ours:.3f} s for {size:.1f} MB; Python's mcap {theirs:.2f} s: {theirs / ours:.0f} times as long")


def threads() -> None:
    """Two runs, one after the other and on two threads."""

    def run(_: int) -> object:
        return omnistep.run("step", progress=False)

    def both() -> object:
        with ThreadPoolExecutor(2) as pool:
            return list(pool.map(run, range(2)))

    serial, parallel = against(lambda: [run(0), run(1)], both)
    print(f"two runs: {serial:.2f} s in turn, {parallel:.2f} s on two threads: {parallel / serial:.2f} of the time")


def own_policy() -> None:
    """What the seam of a controller of one's own costs a period, beyond that controller itself."""
    torques = np.zeros(7)
    still = {"duration_s": 4.0, "command.vx_m_s": 0.0, "physics.engine": "articulated", "physics.timestep_s": 0.001}
    scenario = omnistep.Scenario("flat", overrides=still)

    def own(observation: omnistep.Observation) -> np.ndarray:
        return torques

    def alone() -> None:
        for _ in range(4000):
            own(torques)  # type: ignore[arg-type]

    def run(policy: omnistep.own_policy.PolicyLike) -> float:
        return seconds(lambda: omnistep.run(scenario, policy=policy, progress=False))

    # The vehicle stands: both controllers do next to nothing, and the physics do the same. What else the machine does
    # only adds to a time: the shortest count.
    rounds = [(run(own), run("independent"), seconds(alone)) for _ in range(4 * REPEATS)]
    with_own, built_in, call = (min(times) for times in zip(*rounds, strict=True))
    micros = (with_own - built_in - call) / 4000 * 1e6
    total = built_in / 4000 * 1e6
    print(f"a controller of one's own: {micros:.2f} us a period (at most 3); all of a built-in one's is {total:.1f} us")


def ctrl_c(folder: Path) -> None:
    """How long a call goes on after Ctrl-C."""
    log = folder / "flat.mcap"
    omnistep.run("flat", overrides={"duration_s": 20.0}, mcap=log, progress=False)
    rows = np.zeros((4_000_000, 7))
    hour = {"duration_s": 3600.0}
    calls: dict[str, Callable[[], object]] = {
        "run": lambda: omnistep.run("flat", overrides=hour, progress=False),
        "run on rollers": lambda: omnistep.run(
            "flat", overrides={**hour, "physics.wheel_model": "rollers"}, progress=False
        ),
        "compare": lambda: omnistep.compare("flat", overrides=hour, progress=False),
        "read_mcap": lambda: omnistep.read_mcap(log, progress=False),
        "Controller.step": lambda: omnistep.Controller("flat").step([0.3, 0.0, 0.0], rows),
    }
    for name, call in calls.items():
        late = []
        for i in range(REPEATS):
            pressed: list[float] = []

            def press(pressed: list[float] = pressed) -> None:
                pressed.append(time.perf_counter())
                _thread.interrupt_main()

            timer = threading.Timer(0.05 + 0.02 * i, press)
            timer.start()
            try:
                call()
            except KeyboardInterrupt:
                late.append(time.perf_counter() - pressed[0])
            else:
                timer.cancel()
        said = f"{max(late) * 1e3:.0f} ms at most" if late else "was over before"
        print(f"Ctrl-C in {name}: {said}")


def main() -> None:
    """Every figure."""
    with tempfile.TemporaryDirectory() as folder:
        reading(Path(folder))
        threads()
        own_policy()
        ctrl_c(Path(folder))


if __name__ == "__main__":
    main()
