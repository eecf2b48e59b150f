"""Is traction control safe whatever its sensors say? Runs drawn by seed and judged by laws, beside plain loops.

Every draw has its sensors' noise, bias, delay and counts, its motors' lag, perhaps a broken encoder, a vehicle, a
ground and a command, and is stopped on the way. ``PYTHONPATH=scripts python -m study.safety DRAWS [FIRST]`` says which
runs went beyond which limit; the exit code is 1 if one left a torque after the stop, gave what is no number, or ended
with an error.
"""

import argparse
import sys
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pandas as pd

import omnistep

#: Built-in vehicles, and two public robots beside this file.
VEHICLES = ["chugo7", "omni3", "mecanum4", "rocker_bogie6", "ridgeback", "rosmaster_x3"]
GROUNDS = ["flat", "step", "stairs", "bumps", "rough", "ice", "height_map"]
POLICIES = ["traction", "traction_runup"]
DURATION_S = 8.0
STOPS_S = 5.0  # stopped for good
ENDS_S = 2.0  # from the stop on torque may last so long: a time-out, a deceleration, the bleed
FASTER = 1.5  # of the command or the stated run-up
FASTEST_M_S = 1.0  # of a run-up
#: Ways that are commanded, from ahead [rad]: most go ahead.
WAYS = [0.0, 0.0, 0.0, 0.0, 0.5, float(np.pi / 2), float(np.pi)]
BACK_M = 0.05  # beyond a stated back-off
#: What the policies state of their retries: how many times the command a run-up is, and how far they back off [m].
RUN_UP_TIMES = {"traction": 2.0, "traction_runup": 4.0}
BACK_OFF_M = {"traction": 0.22, "traction_runup": 0.27}
BACKS_OFF, RUNS_UP = 1, 2  # as `traction_mode` says it
SLOWS_S = 1.0  # after a run-up; the target falls by 4 m/s^2
#: The laws, and those that nothing may break.
LAWS = ["too fast", "back", "rim", "torque", "no number"]
NEVER = ["torque", "no number"]
DRAWS = 1000  # of the study: each under traction control and under plain loops
#: What may mislead the control of a draw: the first that fits.
CAUSES = ["encoder broken", "noise or counts", "late", "sound"]
NOISE_PART, COUNT_PART = 0.1, 0.5  # of the command: noise, and the speed of one count per period
LATE_S = 0.01  # of delay, lag and period together
#: Of draws that nothing misleads no one may go beyond these.
SOUND = ["too fast", "back"]
ROBOTS = Path(__file__).resolve().parent / "robots"


def loadable(name: str) -> str:
    """What loads a vehicle of the list."""
    robot = ROBOTS / f"{name}.toml"
    return str(robot) if robot.is_file() else name


def drawn(seed: int) -> dict[str, Any]:
    """The run of a seed: its ground as the scenario, keys, and its labels."""
    dice = Random(seed)
    name, ground, policy = VEHICLES[seed % len(VEHICLES)], dice.choice(GROUNDS), dice.choice(POLICIES)
    vehicle = omnistep.Vehicle(loadable(name))
    period_us = dice.choice([1000, 1000, 2000, 5000, 10000])
    keys: dict[str, Any] = {
        "vehicle": loadable(name),
        # One of eight on the engine that takes twenty times as long.
        "physics.engine": "rapier" if seed // len(VEHICLES) % 8 == 7 else "articulated",
        "duration_s": DURATION_S,
        "control.policy": policy,
        "control.period_s": period_us / 1e6,
        "control.precision": dice.choice(["f32", "f64"]),
        "sensors.encoder_counts": dice.choice([0, 0, 32, 256, 1024, 4096]),
        "sensors.encoder_noise_rad_s": dice.choice([0.0, 0.1, 1.0, 5.0]) * dice.random(),
        "sensors.gyro_noise_rad_s": dice.choice([0.0, 0.01, 0.5]) * dice.random(),
        "sensors.gyro_bias_rad_s": dice.choice([0.0, 0.05, 0.3]) * dice.uniform(-1.0, 1.0),
        "sensors.no_imu": dice.random() < 0.1,
        "sensors.no_hinge_encoders": dice.random() < 0.1,
        "sensors.delay_s": dice.choice([0, 0, 5000, 10000]) // period_us * period_us / 1e6,
        "actuators.torque_lag_s": dice.choice([0.0, 0.0, 0.005, 0.02]),
        "perturbation.yaw_rad": dice.uniform(0.0, 0.2),
        "perturbation.start_m": 0.02,
    }
    speed, angle = dice.choice([0.05, 0.15, 0.3, 0.3, 0.5]), dice.choice(WAYS)
    if name == "rocker_bogie6":
        angle = 0.0 if angle < 2.0 else np.pi
    keys |= {"command.vx_m_s": speed * float(np.cos(angle)), "command.vy_m_s": speed * float(np.sin(angle))}
    faults, broken = [], ""
    # Half of the runs have a broken encoder, for good or for a while.
    if dice.random() < 0.5:
        broken = dice.choice(["encoder_stuck", "encoder_dead", "encoder_silent"])
        from_s = dice.uniform(0.0, STOPS_S)
        fault = {"kind": broken, "wheel": dice.choice(vehicle.wheel_names), "from_s": from_s}
        faults.append(fault | ({"until_s": from_s + dice.uniform(0.2, 2.0)} if dice.random() < 0.3 else {}))
    driven = dice.random() < 0.5
    if driven:
        keys["drive"] = {}
    stop = dice.choice(["emergency_stop", "command_lost", "rest"]) if driven else "rest"
    if stop == "rest":
        keys["command.then"] = [{"at_s": STOPS_S, "vx_m_s": 0.0, "vy_m_s": 0.0, "wz_rad_s": 0.0}]
    else:
        faults.append({"kind": stop, "from_s": STOPS_S})
    if faults:
        keys["fault"] = faults
    # What plain loops climb, and what no policy does.
    if ground in ("step", "stairs"):
        radius_m = min(wheel["radius_m"] for wheel in vehicle.to_dict()["wheel"])
        keys["terrain.height_m"] = radius_m * dice.uniform(0.1, 1.2 if ground == "step" else 0.8)
    labels = {"vehicle": name, "case": ground, "traction": policy, "broken": broken, "driven": driven, "wheels": "ball"}
    return {
        "group": "safety",
        "scenario": ground,
        "seed": seed,
        "engine": keys["physics.engine"],
        **labels,
        "keys": keys,
    }


def cause(run: dict) -> str:
    """Which of the causes a draw has."""
    keys = run["keys"]
    asked = np.hypot(keys["command.vx_m_s"], keys["command.vy_m_s"])
    radius_m = min(wheel["radius_m"] for wheel in omnistep.Vehicle(keys["vehicle"]).to_dict()["wheel"])
    counts, period_s = keys["sensors.encoder_counts"], keys["control.period_s"]
    count_m_s = 2.0 * np.pi / counts / period_s * radius_m if counts else 0.0
    if run["broken"]:
        return "encoder broken"
    if keys["sensors.encoder_noise_rad_s"] * radius_m >= NOISE_PART * asked or count_m_s >= COUNT_PART * asked:
        return "noise or counts"
    # Rounding: a sum of 10 ms is not late.
    late_s = keys["sensors.delay_s"] + keys["actuators.torque_lag_s"] + period_s
    return "late" if late_s > LATE_S + 1e-9 else "sound"


def with_causes(rows: pd.DataFrame) -> pd.DataFrame:
    """Rows of draws, and what misleads each."""
    causes = {seed: cause(drawn(int(seed))) for seed in rows["seed"].unique()}
    return rows.assign(cause=rows["seed"].map(causes))


def planned(seeds: range) -> list[dict]:
    """Every draw under traction control, and under plain loops."""
    runs = [drawn(seed) for seed in seeds]
    policies = [(run, policy) for run in runs for policy in (run["traction"], "independent")]
    return [run | {"policy": policy, "keys": run["keys"] | {"control.policy": policy}} for run, policy in policies]


def judged(trace: omnistep.Trace, keys: dict[str, Any], traction: str) -> dict[str, float]:
    """How far a run went in each law: 1 is the limit; of motors without a no-load speed rims have none."""
    period_s, asked = keys["control.period_s"], np.hypot(keys["command.vx_m_s"], keys["command.vy_m_s"])
    way = np.array([keys["command.vx_m_s"], keys["command.vy_m_s"]]) / asked
    rows = round(STOPS_S / period_s)
    # From its first back-off on a policy states that it goes back. It goes faster while it tries, for a second after
    # that, and at later rows of the obstacle, which `traction_runup` approaches as fast as the row before them.
    mode, row = (trace[name][:rows] if name in trace else np.zeros(rows) for name in ("traction_mode", "traction_row"))
    tried = np.maximum.accumulate(mode == BACKS_OFF)
    tries = (mode == BACKS_OFF) | (mode == RUNS_UP)
    since = np.arange(rows) - np.maximum.accumulate(np.where(tries, np.arange(rows), -rows))
    runs_up = (since <= SLOWS_S / period_s) | (tried & (row > 0))
    most = FASTER * np.where(runs_up, max(asked, min(RUN_UP_TIMES[traction] * asked, FASTEST_M_S)), asked)
    # Without torque a vehicle without friction rolls wherever the ground inclines it to.
    torque = trace.wheels("torque_n_m")
    pushed = (trace.wheels("applied_n_m") != 0.0).any(axis=1)[:rows]
    vx, vy, z = trace["twist_vx_m_s"][:rows], trace["twist_vy_m_s"][:rows], trace["pose_z_m"][:rows]
    # What falls may go faster by what it fell.
    may = np.sqrt(most**2 + 2.0 * 9.81 * (np.maximum.accumulate(z) - z))
    speeds = np.where(pushed, np.hypot(vx, vy) / may, 0.0)
    # Along the way as commanded, in the vehicle's axes.
    along_m = np.cumsum(np.where(pushed, vx * way[0] + vy * way[1], 0.0)) * period_s
    back_m = np.max(np.maximum.accumulate(along_m) - along_m, initial=0.0)
    vehicle = omnistep.Vehicle(keys["vehicle"])
    no_load = vehicle.no_load_rad_s
    gears = [
        wheel["gear"] * wheel["radius_m"] * np.cos(wheel["roller_angle_rad"]) for wheel in vehicle.to_dict()["wheel"]
    ]
    rim = np.abs(trace.wheels("rim_m_s") / gears).max() / no_load if no_load else np.nan
    after = torque[round((STOPS_S + ENDS_S) / period_s) :]
    signals = [name for name in trace.names if name.startswith(("twist_", "pose_", "traction_"))]
    finite = (
        all(np.isfinite(trace[name]).all() for name in signals) and np.isfinite(trace.wheels("requested_n_m")).all()
    )
    parts = [
        np.max(speeds, initial=0.0),
        back_m / (BACK_M + (BACK_OFF_M[traction] if tried.any() else 0.0)),
        rim / 1.01,
        np.inf if (after != 0.0).any() else 0.0,
        0.0 if finite else np.inf,
    ]
    return dict(zip(LAWS, map(float, parts), strict=True))


def measure(run: dict) -> dict[str, Any]:
    """Run, and judge; ``error`` is why nothing could be judged."""
    try:
        trace = omnistep.run(run["scenario"], overrides=run["keys"], seed=run["seed"], progress=False)
    except omnistep.SimulationError as error:
        return {"error": str(error)}
    return {"error": None, **judged(trace, run["keys"], run["traction"])}


def main() -> int:
    """Run the draws, and print what became of them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("draws", type=int)
    parser.add_argument("first", type=int, nargs="?", default=0)
    arguments = parser.parse_args()
    runs = planned(range(arguments.first, arguments.first + arguments.draws))
    never = 0
    for run in runs:
        found = measure(run)
        beyond = {law: found[law] for law in LAWS if found["error"] is None and found[law] > 1.0}
        if found["error"] or beyond:
            print(f"seed {run['seed']}, {run['vehicle']}, {run['case']}, {run['policy']}: {found['error'] or beyond}")
        never += bool(found["error"]) or any(law in beyond for law in NEVER)
    print(f"{len(runs)} runs, {never} with a torque after the stop, no number, or an error")
    return 1 if never else 0


if __name__ == "__main__":
    sys.exit(main())
