"""Runs in closed loop with sensors and parts that are not as they should be: the speed that is asked, and stops."""

import json
import os
import random
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from campaign import Campaign, Setting, faults, in_parallel, run

import omnistep

sys.path.append(str(Path(__file__).resolve().parents[1]))
import study.safety

VEHICLES = ("chugo7", "omni3", "mecanum4", "rocker_bogie6")
ASKED_M_S = 0.3
#: When a vehicle is commanded to stop, and how long it has for that: the time-out of 0.5 s, the deceleration from
#: 0.3 m/s (0.3 s) and the 0.5 s in which torques end, rounded up.
STOP_S, ENDED_S, DURATION_S = 2.0, 4.0, 5.0

Keys = dict[str, Any]

# Reads runs, and says of each the verdict, the mean speed of the second half, and torque and motor work after a stop.
WORKER = """
import json, sys, warnings
import numpy, omnistep

warnings.simplefilter("ignore")  # some of what is asked is doubtful on purpose
for number, (keys, ended_s) in enumerate(json.load(open(sys.argv[1]))):
    trace = omnistep.run(omnistep.Scenario("flat", overrides=keys))
    time, x = trace["time_s"], trace["pose_x_m"]
    half = len(time) // 2
    said = {"verdict": trace.outcome.verdict, "end_s": float(time[-1]),
            "speed_m_s": float((x[-1] - x[half]) / (time[-1] - time[half]))}
    after = time >= ended_s
    said["torque_n_m"] = float(max(numpy.abs(trace.wheels(name)[after]).max(initial=0.0)
                                   for name in ("applied_n_m", "torque_n_m")))
    last = time >= time[-1] - 1.0
    said["work_j"] = float(numpy.ptp(trace["turnover_j"][last]))
    print("RAN", number, json.dumps(said), flush=True)
"""


def measured(folder: Path, runs: list[Keys], ended_s: float) -> tuple[list[dict[str, Any] | None], list[str]]:
    """Report of each run, and failures: several runs per process, which takes one second to start."""
    said: list[dict[str, Any] | None] = [None] * len(runs)
    share = -(-len(runs) // (os.cpu_count() or 1))

    def work(first: int) -> str | None:
        jobs = runs[first : first + share]
        listed = folder / f"runs-{first}.json"
        listed.write_text(json.dumps([(keys, ended_s) for keys in jobs]))
        ended = run([sys.executable, "-c", WORKER, listed], folder, seconds=30 + 10 * len(jobs))
        done = 0
        for line in ended.out.splitlines():
            if line.startswith("RAN "):
                _, number, rest = line.split(" ", 2)
                said[first + int(number)] = json.loads(rest)
                done += 1
        if done == len(jobs):
            return None
        why = "; ".join(faults(ended, allowed=(0,))) or ended.err[-200:]
        return f"{command(jobs[done])}: {why}"

    _, failures = in_parallel(work, range(0, len(runs), share))
    return said, failures


def command(keys: Keys) -> str:
    """What repeats a run."""
    return "omnistep run flat " + " ".join(f"--set '{key}={toml(value)}'" for key, value in keys.items())


def toml(value: Any) -> str:
    """A value as a scenario has it."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} = {toml(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    return json.dumps(value)


def sensors(setting: Setting) -> list[Campaign]:
    """Every vehicle and policy keeps its speed with sensors that are a little wrong.

    Cheap gyros have a zero offset of 3 degrees per second by their datasheets, cheap accelerometers of 80 mg.
    """
    wrong = {
        "gyro_bias_rad_s": 0.05,
        "gyro_noise_rad_s": 0.3,
        "encoder_noise_rad_s": 1.5,
        "accelerometer_noise_m_s2": 1.0,
        "accelerometer_bias_m_s2": 0.8,
        "attitude_bias_rad": 0.05,
        "attitude_walk_rad_per_sqrt_s": 0.02,
    }
    runs: list[Keys] = []
    for seed in range(setting.seed, setting.seed + setting.count(1)):
        for vehicle in VEHICLES:
            for policy in ("scale_references", "traction", "traction_runup"):
                for name, size in wrong.items():
                    keys = {"vehicle": vehicle, "control.policy": policy, f"sensors.{name}": size, "seed": seed}
                    keys |= {"command.vx_m_s": ASKED_M_S, "duration_s": 3.0, "physics.engine": "articulated"}
                    runs.append(keys)
    said, failures = measured(setting.folder("sensors"), runs, 3.0)
    for keys, of in zip(runs, said, strict=True):
        if of is None or abs(of["speed_m_s"] - ASKED_M_S) <= 0.1 * ASKED_M_S:
            continue
        failures.append(f"{command(keys)}: {of['speed_m_s']:.2f} m/s for {ASKED_M_S:.2f}, {of['verdict']}")
    return [Campaign("speed with wrong sensors", len(runs), "runs", failures)]


def drawn(chance: random.Random, wheels: dict[str, list[str]]) -> Keys:
    """A run that is commanded to stop, with parts that fail before."""
    vehicle = chance.choice(VEHICLES)
    policy = chance.choice(
        (
            "independent",
            "scale_torques",
            "scale_references",
            "scale_references",
            "shared_integral",
            "traction",
            "traction_runup",
        )
    )
    keys: Keys = {
        "vehicle": vehicle,
        "control.policy": policy,
        "command.vx_m_s": ASKED_M_S,
        "command.vy_m_s": chance.choice((0.0, 0.1)) if vehicle != "rocker_bogie6" else 0.0,
        "command.wz_rad_s": chance.choice((0.0, 0.4)),
        "duration_s": DURATION_S,
        "physics.engine": chance.choice(("rapier", "articulated")),
        "terrain.friction": chance.choice((0.1, 0.4, 0.7)),
        "seed": chance.randrange(10_000),
    }
    counts = chance.choice((0, 64, 256, 1024, 4096))
    if counts:
        keys["sensors.encoder_counts"] = counts
    if chance.random() < 0.3:
        keys["sensors.encoder_noise_rad_s"] = chance.choice((0.5, 2.0, 10.0))
    kinds = ["encoder_stuck", "encoder_stuck", "encoder_dead", "encoder_slips", "encoder_silent"]
    kinds += ["encoder_toggles"] * (counts > 0)
    broken: list[Keys] = []
    for wheel in chance.sample(wheels[vehicle], chance.choice((1, 2))):
        fault: Keys = {"kind": chance.choice(kinds), "wheel": wheel, "from_s": round(chance.uniform(0.5, 2.5), 3)}
        if fault["kind"] == "encoder_slips":
            fault["part"] = 0.5
        broken.append(fault)
    stops = ["rest"]
    # Half of traction control is by itself.
    if policy not in ("traction", "traction_runup") or chance.random() < 0.5:
        stops += ["emergency_stop", "command_lost"]
        if chance.random() < 0.5:
            keys["drive.faults"] = {}
        else:
            keys["drive"] = {}
    stop = chance.choice(stops)
    if stop == "rest":
        keys["command.then"] = [{"at_s": STOP_S, "vx_m_s": 0.0, "vy_m_s": 0.0, "wz_rad_s": 0.0}]
    else:
        broken.append({"kind": stop, "from_s": STOP_S})
    keys["fault"] = broken
    return keys


def stops(setting: Setting) -> list[Campaign]:
    """Whatever fails and is measured, torque is exactly 0 two seconds after a stop, and motors do no work any more."""
    chance = setting.random("stops")
    wheels = wheel_names()
    runs = [drawn(chance, wheels) for _ in range(setting.count(40))]
    said, failures = measured(setting.folder("stops"), runs, ENDED_S)
    for keys, of in zip(runs, said, strict=True):
        if of is not None:
            failures += [f"{command(keys)}: {what}" for what in not_stopped(of)]
    return [Campaign("stops with parts that fail", len(runs), "runs", failures)]


def safety(setting: Setting) -> list[Campaign]:
    """Runs of the study's safety table that the study does not draw: no torque after a stop, numbers, no error."""
    runs = [run for run in study.safety.planned(safety_seeds(setting)) if run["policy"] != "independent"]

    def work(run: Keys) -> str | None:
        found = study.safety.measure(run)
        broken = found["error"] or [law for law in study.safety.NEVER if found[law] > 1.0]
        draw = f"seed {run['seed']} of scripts/study/safety.py, {run['vehicle']}, {run['case']}"
        return f"{draw}: {broken}" if broken else None

    _, failures = in_parallel(work, runs)
    return [Campaign("traction control with wrong sensors", len(runs), "runs", failures)]


def safety_seeds(setting: Setting) -> range:
    """Beyond those of the study."""
    first = study.safety.DRAWS + 1000 * setting.seed
    return range(first, first + setting.count(48))


def not_stopped(of: dict[str, Any]) -> Iterator[str]:
    """What of a run is no stop."""
    # A run that ends early, as one that diverges does, has nothing behind the stop to look at.
    if of["end_s"] < DURATION_S - 0.01:
        yield f"ended at {of['end_s']:.2f} s: {of['verdict']}"
    # Also where not a number: then neither is 0.
    elif of["torque_n_m"] != 0.0 or of["work_j"] != 0.0:
        yield f"{of['torque_n_m']:g} N.m from {ENDED_S:g} s on, {of['work_j']:g} J in the last second, {of['verdict']}"


def wheel_names() -> dict[str, list[str]]:
    """Names of each vehicle's wheels."""
    return {vehicle: list(omnistep.Vehicle(vehicle).wheel_names) for vehicle in VEHICLES}
