"""Odometry for a foreign log that has none, from its wheel readings."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from omnistep._log_map import LogMap
from omnistep._log_sources import Nanoseconds
from omnistep._omnistep import Kinematics, Odometry
from omnistep._resampling import Channel
from omnistep._tables import Floats


def reckoned(
    log_map: LogMap,
    wheels: Sequence[Channel],
    pose: Sequence[Channel],
    measured_rad_s: Floats,
    starts_ns: Nanoseconds,
    period_ns: int,
) -> Floats:
    """The pose x [m], y [m], yaw [rad] by wheel odometry, at the end of each control period, (T, 3).

    If an external pose was measured, odometry equals the first measured pose at its time; otherwise it begins at the
    origin. Over a gap the pose moves by the measured rotation of the wheels if the log has positions; if it has
    velocities, the pose stays.
    """
    layout = log_map.scenario.vehicle.layout
    odometry = Odometry(kinematics=Kinematics(layout=layout), period_s=period_ns * 1e-9)
    signal, ends_ns = log_map.signals["wheels"], starts_ns + period_ns
    if signal.positions:
        times_ns = np.concatenate([starts_ns[:1], ends_ns])
        gears = [wheel.gear if signal.at_wheel else 1.0 for wheel in layout.wheels]
        angles = [channel.at(times_ns) / gear for channel, gear in zip(wheels, gears, strict=True)]
        poses = odometry.step_positions(np.column_stack(angles))[1:]
    else:
        poses = odometry.step_velocities(measured_rad_s)
    if not pose:
        return poses
    seen = np.column_stack([channel.at(ends_ns) for channel in pose])
    known = np.flatnonzero(np.isfinite(seen).all(axis=1))
    return _moved(poses, poses[known[0]], seen[known[0]]) if known.size else poses


def _moved(poses: Floats, of: Floats, to: Floats) -> Floats:
    """Poses, (T, 3), moved as a rigid whole so that one of them becomes another one."""
    turn = to[2] - of[2]
    x, y = poses[:, 0] - of[0], poses[:, 1] - of[1]
    yaw = poses[:, 2] + turn
    sin, cos = np.sin(turn), np.cos(turn)
    turned = [to[0] + cos * x - sin * y, to[1] + sin * x + cos * y, np.arctan2(np.sin(yaw), np.cos(yaw))]
    return np.column_stack(turned)
