"""Least squares for calibration: parameters common to all wheels, and single wheels if they deviate."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import atan2, cos, sin
from typing import Any

import numpy as np

from omnistep._calibration_drives import Drive
from omnistep._calibration_poses import Piece, Plate, Recording
from omnistep._estimates import DETERMINED, Estimate, Floats, times_deviation
from omnistep._omnistep import Kinematics, Layout, Vehicle, Wheel
from omnistep.errors import ConfigError

NEEDED_BY = "omnistep.calibrate"
#: Errors of a drawing: relative errors of radii and lever arms, errors of directions in radians.
SCALE = 0.05
#: Common parameters may deviate by this multiple of the drawing's error.
COMMON = 4.0
#: Residuals tell their own size from so many degrees of freedom on, and are no smaller than this [m, rad].
ENOUGH, LEAST_M = 3.0, 1e-6
#: From so many runs on their own scatter says how far the numbers may be off.
MANY = 4
#: Slip lasts: errors of so many neighbouring pieces may be alike, and of no more than this part of all pieces.
ALIKE_PIECES, PART = 4, 4
#: Errors of ends that were measured with a tape, beside slip, if nothing else is stated; of poses likewise.
POSITION_M, YAW_RAD = 0.002, 0.005
#: Errors of a plate and a clock: a large error of each [m, m, rad, s], and the largest allowed error in such units. A
#: plate may look anywhere; without ends measured by hand its yaw is the rotation of the whole vehicle.
PLATE, CLOCK = (0.05, 0.05, 0.05), 0.05
FAR = {"sideways": (4.0,), "plate": (10.0, 10.0, 1000.0), "clock": (2.0,)}
#: Pieces tell a lever that turn by so many times their error on the average, and a radius that go so far.
CLEARLY = 4.0
#: Poses are differentiated over this time on both sides [s], for their noise.
DELAY_S = 0.02
#: Slip that is expected of a run or of a piece of a recording, as a part of its way.
SLIP = 0.01
#: Reason why a single wheel has no interval that follows from the common parameters.
ALIKE, TOGETHER = "as all wheels are", "only together with others"
#: A smaller deviation is none, in units of ``SCALE``.
LEAST = 1e-6
#: Parameters of single wheels are used if they make the measurements this much more probable: strong evidence, 20 to 1,
#: on the scale of Kass and Raftery ("Bayes factors", 1995). Errors of slip are not of one size, as the model has them.
PAYS = 3.0
#: Rollers are oblique from this sine of their angle on.
OBLIQUE = 0.1
#: The search: differences, the largest and the smallest step, how far it goes, in units of ``SCALE``.
DIFFERENCE, LARGEST, SMALLEST, FARTHEST, ITERATIONS = 1e-3, 2.0, 1e-6, 9.0, 30


@dataclass
class Found:
    """The best-fitting parameters, in units of a drawing's error, and their uncertainty."""

    u: Floats
    #: The same, but parameters and combinations that the runs do not determine keep the file's value: reported and
    #: written.
    reported: Floats
    covariance: Floats
    #: The same from the scatter of runs; 0 from few.
    scatter: Floats
    #: Degrees of freedom of the first; for the second, the expected share of each run, and their factor.
    freedom: float
    shares: Floats
    blocks: float
    #: Standard deviations of places [m] and turns [rad] of measured ends, the same of pieces between recorded poses,
    #: and of wheels against each other, by what is left.
    sd: Floats
    #: Root mean square of the same residuals: no less than the stated values if a few runs agree with them.
    rms: Floats
    #: Residual of the ends, in squares of these, and its degrees of freedom.
    ends_left: float
    ends_freedom: float
    #: For each run: the reduction of the residual without it, its count of numbers, and the factor by which the other
    #: runs fit better without it, in positions or in headings, whichever is larger.
    left_out: list[tuple[float, int, float]]
    #: Logarithm of how probable the measurements are under this model; larger is better.
    evidence: float


class Problem:
    """Parameters, and the residuals of all runs for them."""

    def __init__(
        self,
        vehicle: Vehicle,
        drives: Sequence[Drive | Piece],
        position_sd: float | None,
        yaw_sd: float | None,
        watch: Callable[[], None],
    ) -> None:
        #: ``watch`` is called whenever all runs are compared with the measurements.
        self.drawn, self.drives, self.watch = vehicle, drives, watch
        self.wheels = vehicle.layout.wheels
        #: Of the parameters of wheels.
        self.names = [
            f"{wheel}.{kind}" for wheel in vehicle.wheel_names for kind in ("radius_m", "shift_m", "turn_rad")
        ]
        lever = float(np.mean([np.hypot(*wheel.position_m) for wheel in self.wheels]))
        start, scale, common = [], [], []
        for wheel in self.wheels:
            push = atan2(*wheel.rolling_direction[::-1]) + wheel.roller_angle_rad
            x, y = wheel.position_m
            start += [wheel.radius_m, 0.0, 0.0]
            scale += [SCALE * wheel.radius_m, SCALE * lever, SCALE]
            # Columns: all radii and all lever arms scaled by the same factor; the whole vehicle rotated, with unchanged
            # lever arms.
            common += [
                [1.0, 0.0, 0.0],
                [0.0, (x * sin(push) - y * cos(push)) / lever, -(x * cos(push) + y * sin(push)) / lever],
                [0.0, 0.0, 1.0],
            ]
        #: Where numbers that are none of a wheel are among the parameters: how far it goes sideways of what the wheels
        #: say, where rollers are oblique; plates and clocks of the recordings.
        self.at: dict[tuple[str, str], int] = {}
        self.sideways: int | None = None
        if any(abs(sin(wheel.roller_angle_rad)) > OBLIQUE for wheel in self.wheels):
            self.sideways = self.at["sideways", "all"] = len(start)
            start, scale = [*start, 1.0], [*scale, SCALE]
        for recording in recordings_of(drives):
            if ("plate", recording.plate) not in self.at:
                self.at["plate", recording.plate] = len(start)
                yaw = recording.yaw_of_plate(Kinematics(layout=vehicle.layout))
                start, scale = [*start, 0.0, 0.0, yaw], [*scale, *PLATE]
            if ("clock", recording.clock) not in self.at:
                self.at["clock", recording.clock] = len(start)
                start, scale = [*start, 0.0], [*scale, CLOCK]
        self.start, self.scale = np.array(start), np.array(scale)
        self.common = np.vstack([common, np.zeros((len(start) - len(common), 3))])
        radius = float(np.mean([abs(wheel.radius_m * wheel.gear) for wheel in self.wheels]))
        ends_m = [radius * drive.way_rad for drive in drives if isinstance(drive, Drive)]
        pieces_m = [recording.piece_m for recording in recordings_of(drives)]
        #: Of ends that were measured on the spot, without slip: what was stated, or what a tape leaves.
        self.tape = np.array([position_sd or POSITION_M, yaw_sd or YAW_RAD])
        #: Of ends, and of pieces between recorded poses: what was stated, or what a tape and slip leave.
        self.stated = np.array(
            [
                stated or np.hypot(least, SLIP * float(np.mean(ways or [0.0])) / of)
                for ways in (ends_m, pieces_m)
                for stated, least, of in ((position_sd, POSITION_M, 1.0), (yaw_sd, YAW_RAD, lever))
            ]
        )
        if all(not drive.parts.any() for drive in drives):
            raise ConfigError("runs: no wheel turns in any run, allowed: runs that drive", key="runs")
        #: Whether the runs contain enough lateral motion to determine it.
        self.slips = self.sideways is not None and self._goes_sideways()
        #: Rotation of wheels that would increase lateral motion, as a column of the parameters.
        self.toed = np.zeros((len(start), int(self.sideways is not None)))
        for k, wheel in enumerate(self.wheels if self.sideways is not None else ()):
            push = atan2(*wheel.rolling_direction[::-1]) + wheel.roller_angle_rad
            self.toed[3 * k + 2] = cos(push) * sin(push)
        #: The common parameters that keep the file's value.
        self.held = self._held()
        # The run of each number that was measured, in the order of the groups.
        groups = self._ends(np.zeros(len(self.start)))
        self.run_of = np.concatenate([np.repeat(np.arange(len(drives)), [len(e) for e in group]) for group in groups])
        #: The group of each.
        self.group_of = np.repeat(np.arange(len(groups)), [sum(len(e) for e in group) for group in groups])

    def _held(self) -> Any:
        """What recorded poses alone do not tell: radius, lever, turn.

        Odometry of a drive that hardly turns, or moves, is noise, and what multiplies noise would be found too large. A
        vehicle that is rotated below its plate is a rotated plate: the file defines the forward direction.
        """
        pieces = [drive for drive in self.drives if isinstance(drive, Piece)]
        if len(pieces) < len(self.drives):
            return np.zeros(3, dtype=bool)
        ways = np.array([drive.measured(0.0) for drive in pieces])
        way, turned = np.sqrt(np.mean(ways[:, 0] ** 2 + ways[:, 1] ** 2)), np.sqrt(np.mean(ways[:, 2] ** 2))
        return np.array([way < CLEARLY * self.stated[2], turned < CLEARLY * self.stated[3], True])

    def _goes_sideways(self) -> bool:
        back = np.asarray(Kinematics(layout=self.drawn.layout).forward_matrix)[1]
        for kind, stated in ((Drive, self.stated[0]), (Piece, self.stated[2])):
            ways = [np.abs(drive.parts @ back).sum() for drive in self.drives if isinstance(drive, kind)]
            if ways and np.sqrt(np.mean(np.square(ways))) > CLEARLY * stated:
                return True
        return False

    def layout(self, u: Floats) -> Layout:
        """The wheels as odometry uses them."""
        part = 1.0 if self.sideways is None else float(self.numbers(u)[self.sideways])
        wheels = []
        for wheel, (radius, shift, turn) in zip(self.wheels, self.of_wheels(u), strict=True):
            place, direction = _moved(wheel, shift, turn)
            moved = Wheel(
                position_m=place,
                rolling_direction=direction,
                roller_angle_rad=wheel.roller_angle_rad,
                radius_m=radius,
                gear=wheel.gear,
                reversed=wheel.reversed,
            )
            wheels.append(moved if part == 1.0 else _slipping(moved, part))
        return Layout(wheels=wheels)

    def numbers(self, u: Floats) -> Floats:
        """Radius [m], shift [m], turn [rad] of every wheel; then the parameters of plates and clocks."""
        return np.asarray(self.start + self.scale * u)

    def of_wheels(self, u: Floats) -> Floats:
        """Radius [m], shift [m], turn [rad] of every wheel, (N, 3)."""
        return self.numbers(u)[: 3 * len(self.wheels)].reshape(-1, 3)

    def plate(self, recording: Recording, u: Floats) -> Plate:
        """Position of a recording's plate, and the delay of its poses."""
        numbers = self.numbers(u)
        place, clock = self.at["plate", recording.plate], self.at["clock", recording.clock]
        x_m, y_m, yaw_rad = map(float, numbers[place : place + 3])
        return Plate(x_m, y_m, yaw_rad, float(numbers[clock]))

    def _ends(self, u: Floats) -> list[list[list[float]]]:
        """Errors of positions and headings of every drive: first at measured ends, then of pieces."""
        kinematics = Kinematics(layout=self.layout(u))
        plates = {id(each): self.plate(each, u) for each in recordings_of(self.drives)}
        groups: list[list[list[float]]] = [[], [], [], []]
        for drive in self.drives:
            if isinstance(drive, Piece):
                errors = [[], [], *drive.errors(kinematics, plates[id(drive.recording)])]
            else:
                errors = [*drive.errors(kinematics), [], []]
            for group, error in zip(groups, errors, strict=True):
                group.append(error)
        return groups

    def groups(self, u: Floats) -> list[Floats]:
        """Errors of places and turns of ends and of pieces, and of wheels against each other."""
        self.watch()
        spread = np.zeros(0)
        if len(self.wheels) > 3:
            kinematics = Kinematics(layout=self.layout(u))
            spread = kinematics.residual(np.concatenate([drive.parts for drive in self.drives])).ravel()
        return [*(np.array([e for error in group for e in error]) for group in self._ends(u)), spread]

    def solve(self) -> tuple[Found, Found]:
        """The better of two models, and the second: only common parameters, or parameters of every wheel.

        Better is what makes the measurements more probable (MacKay, "Bayesian interpolation", 1992): each further
        number must pay for itself.
        """
        common, single = self._fit(single=False, held=self.held), self._single(self.held)
        found = single if single.evidence > common.evidence + PAYS else common
        # What one of the two tells is not held: in the second a radius of all wheels may be turns of single ones too. A
        # turn of the whole is not taken from the first: a single wheel that differs drifts as one.
        rows, models = np.linalg.pinv(self.common), ((common, found), (common, found), (found,))
        deviations = np.array(
            [min(_deviations(row, each).max() for each in tells) for row, tells in zip(rows, models, strict=True)]
        )
        held = self.held | (deviations >= DETERMINED)
        if held.all() and not self._others(slips=self.slips):
            found.reported = np.zeros_like(found.u)
        elif (held != self.held).any():
            again = self._single(held) if found is single else self._fit(single=False, held=held)
            # Not at the cost of determined parameters: a held lever arm would bias a radius if turns determine their
            # ratio.
            moved = np.abs(rows @ (again.reported - found.u))
            if (moved <= deviations)[~held].all():
                found.reported = again.reported
        return found, single

    def _single(self, held: Any) -> Found:
        """Single wheels may differ, and be rotated so that the vehicle moves less laterally: none slips.

        Equal lateral slip of all wheels explains the same measurements, so that numbers may be wrong by the difference.
        """
        slipping = self._fit(single=True, held=held)
        if not self.slips:
            return slipping
        # Single wheels must pay beside what is common, and that may slip.
        return replace(self._fit(single=True, held=held, slipping=slipping), evidence=slipping.evidence)

    def _others(self, *, slips: bool) -> dict[tuple[str, str], int]:
        """Indices of the parameters that belong to no wheel, with or without lateral slip."""
        return {each: at for each, at in self.at.items() if slips or at != self.sideways}

    def _fit(self, *, single: bool, held: Any, slipping: Found | None = None) -> Found:
        """Least squares about the drawing, each group weighted by its residuals.

        The prior of a wheel is the drawing with the common parameters, with a standard deviation of ``SCALE`` if single
        wheels may differ. Parameters that the runs do not determine keep this value and this deviation. Relative to a
        solution with lateral slip, no wheel slips.
        """
        count, own = 3 * len(self.wheels), np.eye(len(self.start))
        kept, common = self.common[:, held], self.common[:, ~held]
        others = self._others(slips=self.slips and slipping is None)
        if single and slipping is None:
            # Wheels that are all rotated towards their rollers' sides are equivalent to wheels with lateral slip, or to
            # larger wheels.
            kept = np.hstack([kept, self.toed])
        own = own - kept @ np.linalg.pinv(kept)
        rest = [own[:, at : at + len(FAR[kind])] for (kind, _), at in others.items()]
        moves = np.hstack([common, own[:, : count if single else 0], *rest])
        wide = np.full(common.shape[1], COMMON)
        far = [FAR[kind] for kind, _ in others]
        prior = np.diag(1.0 / np.concatenate([wide, np.ones(count if single else 0), *far]) ** 2)
        z = np.zeros(moves.shape[1])
        parts = sum(len(drive.parts) for drive in self.drives) if len(self.wheels) > 3 else 0
        # The first weight of the comparison of wheels follows from what the drawing leaves of it: counts and slip.
        groups = self.groups(moves @ z)
        spread = np.sqrt((groups[-1] ** 2).sum() / max(1, len(groups[-1]) - 3 * parts))
        sd = np.r_[self.stated, max(spread, LEAST_M)]
        for _ in range(ITERATIONS):
            groups = self.groups(moves @ z)
            sizes = [len(group) for group in groups]
            independent = np.array(sizes) - np.array([0, 0, 0, 0, 3 * parts])
            residual, jacobian = np.concatenate(groups), self._jacobian(moves, z)
            weights: Floats = 1.0 / np.repeat(sd, sizes)
            weighted: Floats = weights * residual
            slopes: Floats = weights[:, None] * jacobian
            covariance: Floats = np.asarray(np.linalg.inv(slopes.T @ slopes + prior), dtype=np.float64)
            step = -covariance @ (slopes.T @ weighted + prior @ z)
            # Each group's residuals lack the degrees of freedom that determine the parameters.
            left = residual + jacobian @ step
            hat = np.einsum("ij,jk,ik->i", slopes, covariance, slopes)
            before, free, rms, at = sd.copy(), np.zeros(len(sizes)), np.zeros(len(sizes)), 0
            for k, size in enumerate(sizes):
                rows = slice(at, at + size)
                rms[k] = np.sqrt((left[rows] ** 2).sum() / max(1, size))
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
        known = free[:-1].sum() if (free[:-1] >= ENOUGH).any() else np.inf
        scatter, shares, blocks = self._scatter(weighted, slopes, covariance)
        left_out = [self._without(run, weighted, slopes, covariance, free) for run in range(len(self.drives))]
        if slipping is not None:
            # The same difference by the parameters of least size.
            weight = 1.0 / np.sqrt(prior.diagonal())
            off = weight * np.linalg.lstsq(moves * weight, slipping.u - moves @ z, rcond=1e-9)[0]
            covariance = covariance + np.outer(off, off)
        return Found(
            u=moves @ z,
            reported=_determined(z, covariance, prior, moves),
            covariance=moves @ covariance @ moves.T,
            scatter=moves @ scatter @ moves.T,
            freedom=max(1.0, known),
            shares=moves @ shares @ moves.T,
            blocks=blocks,
            sd=sd,
            rms=rms,
            ends_left=float((weighted[: sum(sizes[:-1])] ** 2).sum()),
            ends_freedom=float(free[:-1].sum()),
            left_out=left_out,
            evidence=float(evidence),
        )

    def _scatter(self, weighted: Floats, slopes: Floats, covariance: Floats) -> tuple[Floats, Floats, float]:
        """Covariance from the estimates without neighbouring runs (jackknife); 0 for few runs.

        The jackknife of moving blocks (Künsch, "The jackknife and the bootstrap for general stationary observations",
        1989) has errors in it that differ from run to run, and those that last for some pieces. With it comes what each
        run would have of it by the errors' size, and for how much of a run one counts in blocks.
        """
        runs, pieces = len(self.drives), sum(isinstance(drive, Piece) for drive in self.drives)
        if runs < MANY:
            return np.zeros_like(covariance), np.zeros((1, *covariance.shape)), 1.0
        block, moved = max(1, min(ALIKE_PIECES, pieces // PART)), []
        for first in range(1 - block, runs):
            rows, left = self._predicted(range(first, first + block), weighted, slopes, covariance)
            moved.append(covariance @ slopes[rows].T @ left)
        shares = []
        for run in range(runs):
            own = slopes[np.flatnonzero(self.run_of == run)] @ covariance
            alone: Floats = np.eye(len(own)) - own @ slopes[np.flatnonzero(self.run_of == run)].T
            shares.append(own.T @ np.linalg.solve(alone, own))
        # As of a triangular window over the correlations of runs.
        return np.transpose(moved) @ moved / block, np.array(shares), 3 * block / (2 * block**2 + 1)

    def _without(
        self, run: int, weighted: Floats, slopes: Floats, covariance: Floats, free: Floats
    ) -> tuple[float, int, float]:
        """What is less without a run, see :class:`Found`."""
        rows, left = self._predicted([run], weighted, slopes, covariance)
        # Residuals of the other runs, if the parameters are fitted to the other runs.
        others, times = weighted + slopes @ (covariance @ slopes[rows].T @ left), 1.0
        others[rows] = 0.0
        for k, freedom in enumerate(free[:-1]):
            own = np.flatnonzero(self.group_of == k)
            rest = freedom - np.isin(rows, own).sum()
            if freedom > rest >= ENOUGH:
                whole = float((weighted[own] ** 2).sum())
                less = max(float((others[own] ** 2).sum()), 1e-3 * whole)
                times = max(times, float(np.sqrt(whole / freedom / (less / rest))))
        return float(weighted[rows] @ left), len(rows), times

    def _predicted(
        self, runs: Sequence[int], weighted: Floats, slopes: Floats, covariance: Floats
    ) -> tuple[Any, Floats]:
        """The rows of runs, and their errors if the parameters were fitted to the other runs."""
        rows = np.flatnonzero(np.isin(self.run_of, runs))
        own = slopes[rows]
        alone: Floats = np.eye(len(rows)) - own @ covariance @ own.T
        return rows, np.asarray(np.linalg.solve(alone, weighted[rows]))

    def _jacobian(self, moves: Floats, z: Floats) -> Floats:
        """How residuals move with every parameter."""
        columns = []
        for k, size in enumerate(self._differences(len(z))):
            step = size * np.eye(len(z))[k]
            ends = [np.concatenate(self.groups(moves @ (z + side))) for side in (-step, step)]
            columns.append((ends[1] - ends[0]) / (2 * size))
        return np.stack(columns, axis=1)

    def _differences(self, parameters: int) -> Floats:
        sizes = np.full(parameters, DIFFERENCE)
        for (kind, _), at in self.at.items():
            if kind == "clock":
                sizes[parameters - len(self.start) + at] = DELAY_S / CLOCK
        return sizes

    def _within(self, moves: Floats, z: Floats) -> Floats:
        """No wheel is half or twice as large as drawn, nor turned by half a radian; nor does it slip so far."""
        wheels = 3 * len(self.wheels)
        if self.sideways is not None:
            z = np.where(moves[self.sideways] != 0.0, np.clip(z, -FARTHEST, FARTHEST), z)
        most = np.abs(moves[:wheels] @ z).max(initial=0.0)
        if most <= FARTHEST:
            return z
        return np.where(np.abs(moves[:wheels]).max(axis=0) > 0.0, z * FARTHEST / most, z)

    def far(self, found: Found) -> list[str]:
        """What ends as far from the file as is searched."""
        common, each = np.linalg.pinv(self.common), np.eye(len(self.start))
        names = ("all.radius", "all.lever", "all.turn_rad")
        rows = [(*row, common[k]) for k, row in enumerate(zip(names, (1.0, 1.0, 0.0), [SCALE] * 3, strict=True))]
        if self.sideways is not None:
            rows.append(("all.sideways", 1.0, SCALE, each[self.sideways]))
        for name, start, scale, row in zip(self.names, self.start, self.scale, each, strict=False):
            # Parameters of a single wheel that the runs do not determine may diverge; they are not reported.
            if abs(row @ found.reported) > 0.5 * abs(row @ found.u):
                rows.append((name, start, scale, row))
        said = []
        for name, start, scale, row in rows:
            value = start + scale * float(row @ found.u)
            if abs(value - start) > 0.99 * FARTHEST * scale:
                said.append(f"{name} is {value:.4g} after {start:.4g} in the file, as far as is searched")
        return said

    def vehicle(self, u: Floats) -> Vehicle:
        keys: dict[str, Any] = {}
        for k, (wheel, numbers) in enumerate(zip(self.wheels, self.of_wheels(u), strict=True)):
            radius, shift, turn = numbers
            place, direction = _moved(wheel, shift, turn)
            keys[f"wheel.{k}.radius_m"] = float(radius)
            keys[f"wheel.{k}.position_m"] = list(place)
            keys[f"wheel.{k}.rolling_direction"] = list(direction)
        return self.drawn.replace(keys)

    def common_estimates(self, found: Found) -> tuple[Estimate, ...]:
        """The common parameters, with an interval if the runs determine them."""
        # A mean over the wheels for a radius and a turn, by their levers for a lever.
        common = np.linalg.pinv(self.common)
        rows = [
            ("all.radius", "", 1.0, SCALE, common[0]),
            ("all.lever", "", 1.0, SCALE, common[1]),
            ("all.turn_rad", "rad", 0.0, SCALE, common[2]),
        ]
        if self.sideways is not None:
            rows.append(("all.sideways", "", 1.0, SCALE, np.eye(len(self.start))[self.sideways]))
        return tuple(self._estimate(*row, found, found) for row in rows)

    def estimates(self, found: Found, single: Found) -> tuple[Estimate, ...]:
        """The parameters of every wheel, likewise, if it may differ from the other wheels."""
        given = []
        wheels = 3 * len(self.wheels)
        # Pieces are few for so many numbers: such intervals held the truth in 85 to 97 %.
        alike = bool(self.held.any()) and found is not single
        for k, (name, row) in enumerate(zip(self.names, np.eye(len(self.start))[:wheels], strict=True)):
            unit = "rad" if name.endswith("rad") else "m"
            each = self._estimate(name, unit, self.start[k], self.scale[k], row, found, single)
            if alike:
                each = replace(each, low=None, high=None, note=each.note or ALIKE)
            elif self.held[2] and unit == "rad" and each.determined:
                # To recorded poses the mean of all is the plate's yaw: only differences from it are known.
                each = replace(each, low=None, high=None, note=TOGETHER)
            given.append(each)
        return tuple(given)

    def plates(self, found: Found) -> tuple[Estimate, ...]:
        """Positions of marker plates on the vehicle, and the delays of their poses."""
        given, rows = [], np.eye(len(self.start))
        for (kind, name), at in self.at.items():
            if kind == "sideways":
                continue
            units = (("plate_x_m", "m"), ("plate_y_m", "m"), ("plate_yaw_rad", "rad"), ("delay_s", "s"))
            for k, (what, unit) in enumerate(units[:3] if kind == "plate" else units[3:], at):
                each = self._estimate(f"{name}.{what}", unit, self.start[k], self.scale[k], rows[k], found, found)
                given.append(replace(each, before=0.0))
        return tuple(given)

    @staticmethod
    def _estimate(
        name: str, unit: str, start: float, scale: float, row: Floats, found: Found, known: Found
    ) -> Estimate:
        value, middle = float(start + scale * (row @ found.reported)), float(start + scale * (row @ known.u))
        deviation = _deviations(row, known).max()
        # Held parameters have no deviation, except for rounding.
        determined = LEAST < deviation < DETERMINED
        times = times_deviation([known.freedom, _scattered(row, known)], NEEDED_BY)
        half = float(scale * np.max(times * _deviations(row, known)))
        held = not determined and abs(row @ found.reported) < LEAST
        follows = TOGETHER if found is known else ALIKE
        return Estimate(
            name=name,
            unit=unit,
            value=float(start) if held else value,
            low=min(value, middle - half) if determined else None,
            high=max(value, middle + half) if determined else None,
            before=float(start),
            note="" if determined else "these runs do not tell it" if held else follows,
        )


def _determined(z: Floats, covariance: Floats, prior: Floats, moves: Floats) -> Floats:
    """The parameters with the file's value in every direction that the runs do not determine, of single wheels too.

    Directions are those of the information beside the prior's: of what a radius of all wheels and turns of single ones
    explain alike nearly all goes to the radius, which may be further off.
    """
    weight = np.sqrt(prior)
    variances, directions = np.linalg.eigh(weight @ covariance @ weight)
    ways = moves / weight.diagonal() @ directions
    # By the number that differs most: all wheels together may be determined better than each.
    known = np.sqrt(np.maximum(0.0, variances)) * np.abs(ways).max(axis=0) < DETERMINED
    return np.asarray(ways[:, known] @ (directions[:, known].T @ (weight @ z)))


def _deviations(row: Floats, found: Found) -> Floats:
    """Standard deviations of a combination of the parameters, in units of a drawing's error.

    By the size of all errors, and by the scatter of runs.
    """
    return np.asarray(np.sqrt(np.maximum(0.0, [row @ each @ row for each in (found.covariance, found.scatter)])))


def _scattered(row: Floats, found: Found) -> float:
    """Degrees of freedom of the scatter: of a combination that two of ten runs tell there is one.

    As of Satterthwaite ("An approximate distribution of estimates of variance components", 1946).
    """
    shares = np.einsum("i,rij,j->r", row, found.shares, row)
    many = float(shares.sum() ** 2 / max(float((shares**2).sum()), 1e-300))
    return max(1.0, many * found.blocks)


def recordings_of(drives: Sequence[Drive | Piece]) -> list[Recording]:
    """The recordings that pieces are of, each once."""
    return list({id(drive.recording): drive.recording for drive in drives if isinstance(drive, Piece)}.values())


def _slipping(wheel: Wheel, part: float) -> Wheel:
    """A wheel whose readings match a vehicle that covers only this fraction of its lateral distance."""
    angle = atan2(*wheel.rolling_direction[::-1])
    push = angle + wheel.roller_angle_rad
    # The push direction times a speed is the wheel's, so is a lever times a turn.
    ahead, aside, (x, y) = cos(push), sin(push) / part, wheel.position_m
    size, to = np.hypot(ahead, aside), atan2(aside, ahead)
    missing = (x * sin(push) - y * cos(push)) / size - (x * sin(to) - y * cos(to))
    return Wheel(
        position_m=(x + missing * sin(to), y - missing * cos(to)),
        rolling_direction=wheel.rolling_direction,
        roller_angle_rad=to - angle,
        radius_m=wheel.radius_m * cos(wheel.roller_angle_rad) / (float(size) * cos(to - angle)),
        gear=wheel.gear,
        reversed=wheel.reversed,
    )


def _moved(wheel: Wheel, shift: float, turn: float) -> tuple[tuple[float, float], tuple[float, float]]:
    """Position and rolling direction of a wheel that is shifted across its push and rotated."""
    dx, dy = wheel.rolling_direction
    angle = atan2(dy, dx)
    push = angle + wheel.roller_angle_rad
    x, y = wheel.position_m
    place = (x + shift * sin(push), y - shift * cos(push))
    return place, ((dx, dy) if turn == 0.0 else (cos(angle + turn), sin(angle + turn)))
