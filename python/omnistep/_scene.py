"""A log in the player of web/player: the log's scene at each frame (web/player/README.md)."""

import tomllib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from omnistep._omnistep import Log, Trace

_Floats = NDArray[np.float64]


def ground_key(log: Log) -> Any:
    """Return what tells one ground from another, however much of it a log shows."""
    scenario = tomllib.loads(log.scenario_toml)
    return scenario["terrain"], scenario.get("block"), scenario.get("friction_patch")


def extent_m(parts: list[dict[str, Any]]) -> float:
    """Return how far ground reaches along x [m]."""
    ends = [
        part["at_m"][0] + sign * part.get("half_m", [part.get("radius_m")])[0] for part in parts for sign in (-1, 1)
    ]
    return max(ends, default=0.0) - min(ends, default=0.0)


def poses(log: Log, frames: list[str]) -> _Floats:
    """Return the poses of frames at the times of a log's frames, (F, frames, 7)."""
    placed = log.frames
    # A frame that the log lacks, such as odometry in a recording without odometry, is drawn at the base.
    return np.stack([placed.get(name, placed["base_link"]) for name in frames], axis=1)


def reach_m(placed: _Floats, wheel: dict[str, Any]) -> float:
    """Return how far a wheel's rim is from the base [m], by the poses of one moment, (frames, 7)."""
    return float(np.linalg.norm(placed[wheel["frame"], :3] - placed[0, :3]) + wheel["radius_m"])


def pushes(log: Log, shown: dict[str, Any], placed: _Floats, parts: list[dict[str, Any]]) -> _Floats:
    """Return the ground force on each wheel [N] and its point of contact [m], (F, N, 6); zero in the air.

    A log contains the force along the contact normal and along the push, but not the normal itself, which is derived
    from the ground nearest to the wheel's centre. The small force transverse to the push is omitted.
    """
    trace = log.trace
    rows = np.clip(np.searchsorted(trace["time_s"], log.frame_time_s - 1e-9), 0, len(trace) - 1)
    found = np.zeros((len(rows), len(shown["wheels"]), 6))
    for number, wheel in enumerate(shown["wheels"]):
        column = trace.wheel_names.index(wheel["name"])
        normal_n = np.nan_to_num(trace.wheels("force_normal_n")[rows, column])
        along_n = np.nan_to_num(trace.wheels("force_along_n")[rows, column])
        pose = placed[:, wheel["frame"]]
        nearest = _nearest(pose[:, :3], parts)
        away = pose[:, :3] - nearest
        distance = np.linalg.norm(away, axis=1)
        touches = (normal_n > 0) & (distance > 1e-6) & (distance < 1.5 * wheel["radius_m"])
        normal = away / np.maximum(distance, 1e-6)[:, None]
        # Forwards is across the axle and the normal: the axle is to the left of it.
        forwards = np.cross(_turned(pose, np.array(wheel["axle"])), normal)
        forwards /= np.maximum(np.linalg.norm(forwards, axis=1), 1e-9)[:, None]
        # It pushes along the axis of the roller on the ground, counter-clockwise from there by the roller angle.
        slant = wheel["roller_angle_rad"]
        push = np.cos(slant) * forwards + np.sin(slant) * np.cross(normal, forwards)
        force = normal_n[:, None] * normal + along_n[:, None] * push
        found[:, number, :3] = np.where(touches[:, None], force, 0.0)
        found[:, number, 3:] = nearest
    return found


def edges(trace: Trace) -> list[list[float]]:
    """Return the edges that odometry in three dimensions found: time [s], x, y, heights before and beyond [m]."""
    found: list[list[float]] = []
    for wheel in trace.wheel_names:
        if f"ground_edge_{wheel}" not in trace:
            continue
        event, height, beyond, x, y = (
            trace[f"ground_{name}_{wheel}"] for name in ("edge", "edge_height_m", "z_m", "edge_x_m", "edge_y_m")
        )
        rows = np.flatnonzero((event > 1) & np.isfinite(height + beyond + x + y))
        columns = (trace["time_s"], x, y, beyond - height, beyond)
        found.extend([round(float(column[row]), 6) for column in columns] for row in rows)
    return sorted(found)


def _nearest(points: _Floats, parts: list[dict[str, Any]]) -> _Floats:
    """Return the point of the ground nearest to each point, (F, 3)."""
    best = np.full(len(points), np.inf)
    found = points.copy()
    for part in parts:
        at = np.array(part["at_m"])
        if part["kind"] == "box":
            turn = part["turn_y_rad"]
            own = np.array([[np.cos(turn), 0, np.sin(turn)], [0, 1, 0], [-np.sin(turn), 0, np.cos(turn)]])
            half = np.array(part["half_m"])
            place = np.clip((points - at) @ own, -half, half) @ own.T + at
        else:
            off = points - at
            off[:, 1] = 0.0
            reach = np.maximum(np.linalg.norm(off, axis=1), 1e-9)
            place = at + off * (part["radius_m"] / reach)[:, None]
            place[:, 1] = points[:, 1]
        distance = np.linalg.norm(points - place, axis=1)
        nearer = distance < best
        best[nearer], found[nearer] = distance[nearer], place[nearer]
    return found


def _turned(pose: _Floats, vector: _Floats) -> _Floats:
    """Turn a vector by each pose's quaternion: v + 2 u x (u x v + w v)."""
    u, w = pose[:, 3:6], pose[:, 6:7]
    return vector + 2 * np.cross(u, np.cross(u, vector) + w * vector)
