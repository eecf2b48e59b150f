"""Least squares for calibration: what all wheels have in common, and single wheels where they differ from it."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, cos, sin
from typing import Any

import numpy as np

from omnistep._calibration_drives import PARTS, Drive
from omnistep._estimates import CONFIDENCE, TOLD, Estimate, Floats, scipy_part
from omnistep._omnistep import Kinematics, Layout, Vehicle, Wheel
from omnistep.errors import ConfigError

NEEDED_BY = "omnistep.calibrate"
#: Errors that a drawing may have: of radii and levers as a part, of directions in radians.
SCALE = 0.05
#: What all wheels have in common may be off by so many times that.
COMMON = 4.0
#: Residuals tell their own size from so many degrees of freedom on, and are no smaller than this [m, rad].
ENOUGH, LEAST_M = 3.0, 1e-6
#: The search: differences, the largest and the smallest step, how far it goes, in units of ``SCALE``.
DIFFERENCE, LARGEST, SMALLEST, FARTHEST, ITERATIONS = 1e-3, 2.0, 1e-6, 9.0, 30


@dataclass
class Found:
    """The parameters that fit best, in units of what a drawing may be wrong by, and what is known of them."""

    u: Floats
    covariance: Floats
    #: Degrees of freedom of what the variances rest on.
    freedom: float
    #: Standard deviations of places [m], of turns [rad] and of wheels against each other, by what is left.
    sd: Floats
    #: What is left of the ends, in squares of these, and its degrees of freedom.
    ends_left: float
    ends_freedom: float
    #: Of each run by how much less is left without it, and how many numbers it has.
    left_out: list[tuple[float, int]]
    #: Logarithm of how probable the measurements are under this model; larger is better.
    evidence: float


class Problem:
    """Parameters, and the residuals of all runs for them."""

    def __init__(self, vehicle: Vehicle, drives: list[Drive], position_sd: float, yaw_sd: float) -> None:
        self.drawn, self.drives = vehicle, drives
        self.wheels = vehicle.layout.wheels
        lever = float(np.mean([np.hypot(*wheel.position_m) for wheel in self.wheels]))
        start, scale, common = [], [], []
        for wheel in self.wheels:
            push = atan2(*wheel.rolling_direction[::-1]) + wheel.roller_angle_rad
            x, y = wheel.position_m
            start += [wheel.radius_m, 0.0, 0.0]
            scale += [SCALE * wheel.radius_m, SCALE * lever, SCALE]
            # Columns: all radii, all levers larger by the same part; the whole vehicle turned, with levers that stay.
            common += [
                [1.0, 0.0, 0.0],
                [0.0, (x * sin(push) - y * cos(push)) / lever, -(x * cos(push) + y * sin(push)) / lever],
                [0.0, 0.0, 1.0],
            ]
        self.start, self.scale, self.common = np.array(start), np.array(scale), np.array(common)
        self.stated = np.array([position_sd, yaw_sd])
        if all(not drive.parts.any() for drive in drives):
            raise ConfigError("runs: no wheel turns in any run, allowed: runs that drive", key="runs")
        # The run of each number that was measured: those of all places, then those of all turns.
        ends = [drive.errors(Kinematics(layout=vehicle.layout)) for drive in drives]
        self.run_of = np.repeat(np.tile(np.arange(len(drives)), 2), [len(end[kind]) for kind in (0, 1) for end in ends])

    def layout(self, u: Floats) -> Layout:
        wheels = []
        for wheel, (radius, shift, turn) in zip(self.wheels, self.numbers(u).reshape(-1, 3), strict=True):
            place, direction = _moved(wheel, shift, turn)
            wheels.append(
                Wheel(
                    position_m=place,
                    rolling_direction=direction,
                    roller_angle_rad=wheel.roller_angle_rad,
                    radius_m=radius,
                    gear=wheel.gear,
                    reversed=wheel.reversed,
                )
            )
        return Layout(wheels=wheels)

    def numbers(self, u: Floats) -> Floats:
        """Radius [m], shift [m], turn [rad] of every wheel."""
        return np.asarray(self.start + self.scale * u)

    def groups(self, u: Floats) -> list[Floats]:
        """Errors of positions, of headings, and of wheels against each other."""
        kinematics = Kinematics(layout=self.layout(u))
        ends = [drive.errors(kinematics) for drive in self.drives]
        places, turns = ([e for end in ends for e in end[kind]] for kind in (0, 1))
        spread = np.zeros(0)
        if len(self.wheels) > 3:
            spread = kinematics.residual(np.concatenate([drive.parts for drive in self.drives])).ravel()
        return [np.array(places), np.array(turns), spread]

    def solve(self) -> tuple[Found, Found]:
        """The better of two models, and the second: what wheels have in common is all, or every wheel differs.

        Better is what makes the measurements more probable (MacKay, "Bayesian interpolation", 1992): each further
        number must pay for itself.
        """
        common, single = self._fit(single=False), self._fit(single=True)
        return (single if single.evidence > common.evidence else common), single

    def _fit(self, *, single: bool) -> Found:
        """Least squares about the drawing, each group weighted by its residuals.

        The prior of a wheel is the drawing with what all wheels have in common, with a standard deviation of ``SCALE``
        where single wheels may differ. What the runs do not determine keeps that value and that deviation.
        """
        wide = np.full(self.common.shape[1], COMMON)
        moves = np.hstack([self.common, np.eye(len(self.start))]) if single else self.common
        prior = np.diag(1.0 / np.r_[wide, np.ones(len(self.start)) if single else []] ** 2)
        z = np.zeros(moves.shape[1])
        parts = len(self.drives) * PARTS if len(self.wheels) > 3 else 0
        # The first weight of the comparison of wheels follows from what the drawing leaves of it: counts and slip.
        groups = self.groups(moves @ z)
        spread = np.sqrt((groups[2] ** 2).sum() / max(1, len(groups[2]) - 3 * parts))
        sd = np.r_[self.stated, max(spread, LEAST_M)]
        for _ in range(ITERATIONS):
            groups = self.groups(moves @ z)
            sizes = [len(group) for group in groups]
            independent = np.array(sizes) - np.array([0, 0, 3 * parts])
            residual, jacobian = np.concatenate(groups), self._jacobian(moves, z)
            weights: Floats = 1.0 / np.repeat(sd, sizes)
            weighted: Floats = weights * residual
            slopes: Floats = weights[:, None] * jacobian
            covariance: Floats = np.asarray(np.linalg.inv(slopes.T @ slopes + prior), dtype=np.float64)
            step = -covariance @ (slopes.T @ weighted + prior @ z)
            # What each group has told of the parameters is gone from its residuals.
            left = residual + jacobian @ step
            hat = np.einsum("ij,jk,ik->i", slopes, covariance, slopes)
            before, free, at = sd.copy(), np.zeros(3), 0
            for k, size in enumerate(sizes):
                rows = slice(at, at + size)
                free[k] = independent[k] - hat[rows].sum()
                if free[k] >= ENOUGH:
                    sd[k] = max(LEAST_M, np.sqrt((left[rows] ** 2).sum() / free[k]))
                at += size
            z = z + np.clip(step, -LARGEST, LARGEST)
            z = self._within(moves, z)
            if np.abs(step).max() < SMALLEST and np.allclose(sd, before, rtol=0.01):
                break
        said = independent > 0
        evidence = -0.5 * (weighted @ weighted + z @ prior @ z) - float(independent[said] @ np.log(sd[said]))
        evidence -= 0.5 * float(np.linalg.slogdet(np.eye(len(z)) + np.linalg.solve(prior, slopes.T @ slopes))[1])
        # The ends tell lengths; few of them, and intervals are wide.
        known = free[:2].sum() if (free[:2] >= ENOUGH).any() else np.inf
        return Found(
            u=moves @ z,
            covariance=moves @ covariance @ moves.T,
            freedom=float(max(1.0, known)),
            sd=sd,
            ends_left=float((weighted[: sizes[0] + sizes[1]] ** 2).sum()),
            ends_freedom=float(free[:2].sum()),
            left_out=[self._without(run, weighted, slopes, covariance) for run in range(len(self.drives))],
            evidence=float(evidence),
        )

    def _without(self, run: int, weighted: Floats, slopes: Floats, covariance: Floats) -> tuple[float, int]:
        """By how much less squares are left without a run, and how many numbers its end has."""
        rows = np.flatnonzero(self.run_of == run)
        own, left = slopes[rows], weighted[rows]
        alone: Floats = np.eye(len(rows)) - own @ covariance @ own.T
        return float(left @ np.linalg.solve(alone, left)), len(rows)

    def _jacobian(self, moves: Floats, z: Floats) -> Floats:
        """How residuals move with every parameter."""
        columns = []
        for step in DIFFERENCE * np.eye(len(z)):
            ends = [np.concatenate(self.groups(moves @ (z + side))) for side in (-step, step)]
            columns.append((ends[1] - ends[0]) / (2 * DIFFERENCE))
        return np.stack(columns, axis=1)

    def _within(self, moves: Floats, z: Floats) -> Floats:
        """No wheel is half or twice as large as drawn, nor turned by half a radian."""
        most = np.abs(moves @ z).max(initial=0.0)
        return z * min(1.0, FARTHEST / most) if most > 0.0 else z

    def vehicle(self, u: Floats) -> Vehicle:
        keys: dict[str, Any] = {}
        for k, (wheel, numbers) in enumerate(zip(self.wheels, self.numbers(u).reshape(-1, 3), strict=True)):
            radius, shift, turn = numbers
            place, direction = _moved(wheel, shift, turn)
            keys[f"wheel.{k}.radius_m"] = float(radius)
            keys[f"wheel.{k}.position_m"] = list(place)
            keys[f"wheel.{k}.rolling_direction"] = list(direction)
        return self.drawn.replace(keys)

    def common_estimates(self, found: Found) -> tuple[Estimate, ...]:
        """What all wheels have in common; an interval where the runs determine it."""
        # A mean over the wheels for a radius and a turn, by their levers for a lever.
        common = np.linalg.pinv(self.common)
        rows = [
            ("all.radius", "", 1.0, SCALE, common[0]),
            ("all.lever", "", 1.0, SCALE, common[1]),
            ("all.turn_rad", "rad", 0.0, SCALE, common[2]),
        ]
        return tuple(self._estimate(*row, found, found) for row in rows)

    def estimates(self, found: Found, single: Found) -> tuple[Estimate, ...]:
        """Every wheel, likewise: what is known of it where it may differ from the others."""
        given = []
        names = [f"{wheel}.{kind}" for wheel in self.drawn.wheel_names for kind in ("radius_m", "shift_m", "turn_rad")]
        for k, (name, row) in enumerate(zip(names, np.eye(len(names)), strict=True)):
            unit = "rad" if name.endswith("rad") else "m"
            given.append(self._estimate(name, unit, self.start[k], self.scale[k], row, found, single))
        return tuple(given)

    @staticmethod
    def _estimate(
        name: str, unit: str, start: float, scale: float, row: Floats, found: Found, known: Found
    ) -> Estimate:
        value, middle = (float(start + scale * (row @ each.u)) for each in (found, known))
        deviation = float(np.sqrt(row @ known.covariance @ row))
        determined = deviation < TOLD
        half = (
            float(scale) * deviation * float(scipy_part("stats", NEEDED_BY).t.ppf(0.5 + CONFIDENCE / 2, known.freedom))
        )
        return Estimate(
            name=name,
            unit=unit,
            value=value,
            low=min(value, middle - half) if determined else None,
            high=max(value, middle + half) if determined else None,
            before=float(start),
            note="" if determined else "these runs do not tell it",
        )


def _moved(wheel: Wheel, shift: float, turn: float) -> tuple[tuple[float, float], tuple[float, float]]:
    """Position and rolling direction of a wheel that is shifted across its push and rotated."""
    dx, dy = wheel.rolling_direction
    angle = atan2(dy, dx)
    push = angle + wheel.roller_angle_rad
    x, y = wheel.position_m
    place = (x + shift * sin(push), y - shift * cos(push))
    return place, ((dx, dy) if turn == 0.0 else (cos(angle + turn), sin(angle + turn)))
