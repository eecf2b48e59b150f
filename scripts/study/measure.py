"""What is measured of a run of the study: its outcome, and the metrics that need the whole trace."""

import hashlib
import inspect
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

import omnistep
import study.safety
from omnistep import _omnistep

#: Wheels of chugo7 that roll ahead, by place in the vehicle file, and the way each turns then.
ROLLING = {0: 1.0, 2: -1.0, 3: 1.0, 4: 1.0, 6: -1.0}
MIDDLE = 3  # wheel 4
MEAN = 10  # periods of a mean force, 10 ms
AT_ONCE = 50  # periods after an impact in which a wheel's own loop is what answers
AFTER = 300  # periods after an impact in which thrust decides, 0.3 s
RISER = 0.3  # part of a contact's normal that points back: the wheel touches an edge
BEFORE = 20  # periods before an impact over which a speed is a mean
RPM = np.pi / 30


def build() -> str:
    """What tells these measurements from those of another build: the compiled part and what measures."""
    measures = inspect.getsource(sys.modules[__name__]) + inspect.getsource(study.safety)
    robots = b"".join(robot.read_bytes() for robot in sorted(study.safety.ROBOTS.iterdir()))
    source = Path(_omnistep.__file__).read_bytes() + measures.encode() + robots
    return hashlib.sha256(source).hexdigest()[:16]


def measure(scenario: str, overrides: Mapping[str, Any], seed: int) -> dict[str, Any]:
    """Run, and return the metrics by name; ``error`` is why there are none."""
    try:
        trace = omnistep.run(scenario, overrides=overrides, seed=seed, progress=False)
    except omnistep.SimulationError as error:
        return {"error": str(error), "climbed": False}
    metrics = trace.outcome.to_dict() | {"error": None, "peak_n": peak_n(trace), "retries": 0.0}
    if "traction_retries" in trace:
        metrics["retries"] = float(trace["traction_retries"][-1])
    return metrics | impact(trace)


def peak_n(trace: omnistep.Trace) -> float:
    """Largest force of the ground on one wheel, as a mean over 10 ms."""
    force = np.hypot(trace.wheels("force_normal_n"), trace.wheels("force_along_n"))
    total = np.cumsum(np.vstack([np.zeros(force.shape[1]), force]), axis=0)
    return float(np.max(total[MEAN:] - total[:-MEAN]) / MEAN)


def impact(trace: omnistep.Trace) -> dict[str, float | None]:
    """How fast the vehicle is when wheel 4 first meets the edge, and what its wheels push in the 0.3 s after.

    Speeds are means over the 20 ms before, [m/s]. Parts of the torque limit, means over the wheels that roll ahead, are
    the wind-up of the loops' integrals then, the thrust that motors are commanded to give after, and the push that the
    ground takes of it; of wheel 4 alone is what it is commanded to give in the first 50 ms, and its rise in 0.3 s, [m].
    """
    names = ["impact_m_s", "impact_rim_m_s", "impact_windup", "impact_thrust", "impact_own", "impact_push"]
    names.append("impact_rise_m")
    nothing = dict.fromkeys(names)
    if trace.terrain["kind"] != "step" or trace.vehicle != "chugo7":
        return nothing
    touches = (trace.wheels("normal_x")[:, MIDDLE] < -RISER) & (trace.wheels("force_normal_n")[:, MIDDLE] > 1.0)
    first = int(np.argmax(touches))
    if not touches.any() or first < BEFORE or first + AFTER > len(trace):
        return nothing
    before, after = slice(first - BEFORE, first), slice(first, first + AFTER)
    wheels, ways = list(ROLLING), np.array(list(ROLLING.values()))
    limit = trace.wheels("limit_upper_n_m")[first, MIDDLE]
    parts = [
        np.mean(trace["twist_vx_m_s"][before]),
        np.mean(trace.wheels("rim_m_s")[before][:, wheels] * ways),
        np.mean(trace.wheels("i_n_m")[before][:, wheels] * ways) / limit,
        np.mean(trace.wheels("applied_n_m")[after][:, wheels] * ways) / limit,
        np.mean(trace.wheels("applied_n_m")[first : first + AT_ONCE, MIDDLE]) / limit,
        np.mean(trace.wheels("force_along_n")[after][:, wheels] * ways * trace.wheel_radius_m[wheels]) / limit,
        np.ptp(trace.wheels("z_m")[[first, first + AFTER - 1], MIDDLE]),
    ]
    return dict(zip(names, map(float, parts), strict=True))


#: Section 3.3 of the paper on the vehicle's own wheels: friction 0, so that nothing but the law joins them.
DAMPERS = [("1", 0.001, 5.0, 7.0), ("1", 0.003, 37.0, 60.0), ("4", 0.004, 14.0, 52.0), ("5", 0.008, 22.0, 57.0)]
CHANGES = sorted({time for _, _, *times in DAMPERS for time in times})
SETTLED_S = 1.0


def on_dampers(policy: str) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    """Run section 3.3: wheels 1, 4, 5 are A, B, C. Return metrics, and speeds [rpm] over time."""
    loads = [
        {"kind": "wheel_drag", "wheel": wheel, "damper_n_m_s_rad": damper, "from_s": start, "until_s": end}
        for wheel, damper, start, end in DAMPERS
    ]
    keys: dict[str, Any] = {
        "duration_s": 65.0,
        "command.vx_m_s": 100 * RPM * 0.066,
        "terrain.friction": 0.0,
        "physics.engine": "articulated",
        # Equation (13).
        "vehicle.motor.stall_torque_n_m": 0.19613,
        "vehicle.motor.slope_n_m_s_rad": 0.001713 / RPM,
        "vehicle.gains.kp_n_m_s_rad": 0.02,
        "vehicle.gains.ki_n_m_rad": 0.05,
        "fault": loads,
    }
    keys |= {f"vehicle.wheel.{wheel}.inertia_kg_m2": 1e-3 for wheel in range(7)}
    keys["control.policy"] = policy
    if policy in ("traction", "traction_runup"):
        keys["control.max_retries"] = 0
    trace = omnistep.run("flat", overrides=keys, progress=False)
    time = trace["time_s"]
    wheels, ways = list(ROLLING), np.array(list(ROLLING.values()))
    speeds = trace.wheels("measured_rad_s")[:, wheels] * ways / RPM
    slowest = speeds.min(axis=1)
    apart = speeds.max(axis=1) - slowest
    settled = (time > 3.0) & np.all([(time < change) | (time > change + SETTLED_S) for change in CHANGES], axis=0)
    loaded = settled & np.any([(time > start) & (time < end) for _, _, start, end in DAMPERS], axis=0)
    falls = []
    for end in (end for *_, end in DAMPERS):
        after = (time >= end) & (time < end + SETTLED_S)
        falls.append(slowest[np.searchsorted(time, end) - 1] - slowest[after].min())
    metrics = {
        "policy": policy,
        "apart_rpm": float(apart[loaded].max()),
        "apart_ever_rpm": float(apart[time > 3.0].max()),
        "fall_rpm": float(max(falls)),
        "fastest_rpm": float(speeds[time > 3.0].max()),
    }
    rows = slice(None, None, 100)
    columns = {f"wheel_{number + 1}": speeds[rows, place] for place, number in enumerate(wheels)}
    metrics |= {f"slowest_{moment:g}_rpm": float(slowest[np.searchsorted(time, moment)]) for moment in (20, 30, 59)}
    return metrics, {"time_s": time[rows]} | columns
