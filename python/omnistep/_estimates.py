"""Least squares with intervals, and parameters that the data do not determine: for identification and calibration."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from omnistep.errors import ConfigError

Floats = NDArray[np.float64]

#: Part of the intervals that shall hold the truth.
CONFIDENCE = 0.95
#: A direction of parameters is determined if its standard deviation is below this fraction of their scales.
DETERMINED = 0.3
#: A parameter within this fraction of its scale from a bound counts as at the bound if the bound fits no worse.
BESIDE = 1e-3
#: A parameter belongs to a direction if it contributes at least this fraction.
MEMBER = 0.25
#: Residuals that exceed the measurement errors by this factor refute the model and its intervals.
REFUTED = 3.0
#: Reason why an estimate then has no interval.
NONE_GIVEN = "none"
#: Advice if a number ended at a bound.
CHECK = "check units, signs and names in the log, and the vehicle file"
#: The variances of independent errors count for this many degrees of freedom beside those of groups, unless these are
#: larger than such a part of what independent errors would make of them.
INDEPENDENT, ALIKE = 8.0, 0.99


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """One number to be estimated."""

    name: str
    unit: str
    start: float
    #: A large error of ``start``.
    scale: float
    lower: float = -np.inf
    upper: float = np.inf
    #: If only a combination is determined, the parameter of the highest rank is held first.
    rank: int = 0
    #: Not searched for: it was measured otherwise.
    fixed: bool = False
    #: The value in the vehicle's file, if the search starts elsewhere.
    file: float | None = None
    #: The parameter that it is never separated from by such data, whatever small differences between wheels pretend.
    apart_from: str = ""


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """One estimated parameter.

    Attributes:
        name: the parameter, its unit at the end.
        unit: the unit.
        value: the estimate, or the held value if the data do not determine it.
        low: lower end of the 95 % interval; None if the data do not determine it.
        high: upper end of it.
        before: the value of the vehicle file.
        note: reason why it has no interval; empty if it has one.
    """

    name: str
    unit: str
    value: float
    low: float | None
    high: float | None
    before: float
    note: str = ""

    @property
    def determined(self) -> bool:
        """Whether the data determine it."""
        return self.low is not None

    @property
    def held(self) -> bool:
        """Whether it keeps the file's value because the data do not determine it."""
        return not self.determined and self.note != NONE_GIVEN and self.value == self.before


@dataclass
class Fit:
    """Result of least squares."""

    x: Floats
    deviation: Floats
    free: NDArray[np.bool_]
    #: Of each parameter that is held because only a combination is determined: the others of it.
    together: dict[int, list[int]] = field(default_factory=dict)
    #: Degrees of freedom of the deviations, of all or of each parameter.
    freedom: float | Floats = np.inf
    residual: Floats = field(default_factory=lambda: np.zeros(0))
    #: How residuals move with the parameters that were found, in units of their scales.
    jacobian: Floats = field(default_factory=lambda: np.zeros((0, 0)))


def scipy_part(name: str, needed_by: str) -> Any:
    """Import a part of SciPy, or say which extra brings it.

    Only ``optimize``, ``linalg`` and ``special``: ``stats``, and ``signal`` which loads it, take as long to load as a
    minute of log takes to fit.
    """
    try:
        return importlib.import_module(f"scipy.{name}")
    except ImportError as error:
        raise ImportError(f'{needed_by} needs SciPy: pip install "omnistep[identify]"') from error


def fit(
    residual: Callable[[Floats], Floats],
    parameters: Sequence[Parameter],
    *,
    needed_by: str,
    clusters: NDArray[np.int64] | None = None,
    redundant: int = 0,
    begin: Floats | None = None,
) -> Fit:
    """Find the parameters with the smallest sum of squared residuals; hold those that these do not determine.

    Args:
        residual: weighted residuals for all parameters; their standard deviations must be equal.
        parameters: their starts and their bounds.
        needed_by: the name for the error message if SciPy is not installed.
        clusters: for each residual the number of its group, from 0. Errors within a group may be correlated: the
            deviations account for it. Without groups, residuals are independent.
        redundant: number of residuals that carry no independent information.
        begin: start of the search instead of the parameters' ``start``, which remain the held values.
    """
    optimize = scipy_part("optimize", needed_by)
    start = np.array([p.start for p in parameters])
    scale = np.array([p.scale for p in parameters])
    bounds = np.array([[p.lower, p.upper] for p in parameters])
    free = np.array([not (p.fixed or p.apart_from) for p in parameters])
    names = [p.name for p in parameters]
    together = {k: [names.index(p.apart_from)] for k, p in enumerate(parameters) if p.apart_from}
    begin = start if begin is None else begin
    x = np.where(free, np.clip(begin, bounds[:, 0], bounds[:, 1]), start)
    while True:
        if not free.any():
            return Fit(x=x, deviation=np.zeros(len(x)), free=free, together=together, residual=residual(x))

        def of_free(z: Floats, base: Floats = x, at: NDArray[np.bool_] = free) -> Floats:
            whole = base.copy()
            whole[at] = z * scale[at]
            return residual(whole)

        low, high = (bounds[free, side] / scale[free] for side in (0, 1))
        inside = np.clip(x[free] / scale[free], low, high)
        # A first look at where it starts: a search along what is not determined goes anywhere.
        first = _jacobian(of_free, inside, low, high)
        held = _hold(first, None, free, together, parameters)
        if held is not None:
            x[held] = start[held]
            free[held] = False
            continue

        def moved(
            z: Floats, of: Callable[[Floats], Floats] = of_free, low: Floats = low, high: Floats = high
        ) -> Floats:
            return _jacobian(of, z, low, high)

        # With smaller steps than those of `_jacobian` rounding of residuals is in the derivatives: the search creeps.
        found = optimize.least_squares(of_free, inside, jac=moved, bounds=(low, high))
        left, moves, inside = found.fun, found.jac, found.x
        # The search ends beside a bound, never at it.
        nearest = np.where(inside - low < high - inside, low, high)
        beside = np.where(np.abs(inside - nearest) < BESIDE, nearest, inside)
        there = of_free(beside)
        if (beside != inside).any() and there @ there <= left @ left:
            left, moves, inside = there, moved(beside), beside
        rest = len(left) - redundant - int(free.sum())
        if rest < 1:
            raise ConfigError(
                f"{len(left) - redundant} measured numbers for {int(free.sum())} parameters, allowed: more numbers"
                " than parameters; drive more runs",
                key="data",
            )
        sigma = float(np.sqrt(left @ left / rest))
        held = _hold(moves, sigma, free, together, parameters)
        x[free] = inside * scale[free]
        if held is None:
            break
        free[held] = False
        x = np.where(free, np.clip(begin, bounds[:, 0], bounds[:, 1]), start)
    variance, freedom = sigma**2 * np.diag(_inverse(moves.T @ moves)), np.full(len(x), float(rest))
    if clusters is not None:
        variance, freedom[free] = _clustered(moves, left, clusters, variance, needed_by)
    deviation = np.zeros(len(x))
    deviation[free] = np.sqrt(variance) * scale[free]
    return Fit(
        x=x,
        deviation=deviation,
        free=free,
        together=together,
        freedom=freedom,
        residual=left,
        jacobian=moves,
    )


def _jacobian(residual: Callable[[Floats], Floats], z: Floats, low: Floats, high: Floats) -> Floats:
    """Differences, on the side that the bounds allow."""
    here = residual(z)
    columns = []
    for k in range(len(z)):
        step = 1e-4 if z[k] + 1e-4 <= high[k] else -1e-4
        moved = z.copy()
        moved[k] += step
        columns.append((residual(moved) - here) / step)
    return np.stack(columns, axis=1)


def _hold(
    jacobian: Floats,
    sigma: float | None,
    free: NDArray[np.bool_],
    together: dict[int, list[int]],
    parameters: Sequence[Parameter],
) -> int | None:
    """The parameter to hold if a direction of parameters is not determined; here they are in units of their scales.

    Without a ``sigma``, a direction is undetermined only if it changes no residual.
    """
    _, singular, directions = np.linalg.svd(np.linalg.qr(jacobian, mode="r"))
    least = 1e-7 * singular[0] if sigma is None else sigma / DETERMINED
    if singular[-1] > least:
        return None
    members = np.flatnonzero(np.abs(directions[-1]) > MEMBER)
    index = np.flatnonzero(free)[members]
    held = int(max(index, key=lambda k: (parameters[k].rank, k)))
    together[held] = [int(k) for k in index if k != held]
    return held


def shifts(
    residual: Callable[[Floats], Floats], parameters: Sequence[Parameter], found: Fit, held: int, part: float
) -> dict[str, float]:
    """Relative change of each estimated number for a relative change of a held one.

    Only numbers that change by more than a quarter of their interval are listed.
    """
    if not found.free.any():
        return {}
    x = found.x.copy()
    x[held] += part * (x[held] or parameters[held].scale)
    change = residual(x) - found.residual
    move = -(_inverse(found.jacobian.T @ found.jacobian) @ (found.jacobian.T @ change))
    given = {}
    for k, by in zip(np.flatnonzero(found.free).tolist(), move, strict=True):
        step = float(by * parameters[k].scale)
        if found.x[k] != 0.0 and abs(step) > found.deviation[k]:
            given[parameters[k].name] = step / float(found.x[k])
    return given


def _inverse(matrix: Floats) -> Floats:
    return np.asarray(np.linalg.pinv(matrix, hermitian=True), dtype=np.float64)


def _clustered(
    jacobian: Floats, residual: Floats, clusters: NDArray[np.int64], independent: Floats, needed_by: str
) -> tuple[Floats, Floats]:
    """Variances if errors within a group correlate, and their degrees of freedom.

    The sandwich of Bell and McCaffrey and its degrees of freedom ("Bias reduction in standard errors for linear
    regression with multi-stage samples", 2002; CR2) rest on the few groups that tell a parameter. As in Smyth's
    moderated t ("Linear models and empirical Bayes methods", 2004) they are weighed with variances that rest on all,
    unless groups refute that errors are independent. Then what changes without each group tells alone: the jackknife.
    """
    bread = _inverse(jacobian.T @ jacobian)
    order = np.argsort(clusters, kind="stable")
    ends = np.flatnonzero(np.diff(clusters[order])) + 1
    scores, changes, sizes, weights = [], [], [], []
    for rows in np.split(order, ends):
        # What matters of a group is in the span of its moves.
        basis, corner = np.linalg.qr(jacobian[rows])
        own, vectors = np.linalg.eigh(corner @ bread @ corner.T)
        left, rest = basis.T @ residual[rows], np.maximum(1.0 - own, 1e-3)[:, None]
        raised = bread @ corner.T @ (vectors @ (vectors.T / np.sqrt(rest)))
        scores.append(raised @ left)
        changes.append(bread @ corner.T @ (vectors @ (vectors.T @ left / rest[:, 0])))
        sizes.append((raised**2).sum(axis=1))
        weights.append(raised @ corner)
    sandwich, jackknife = ((np.array(each) ** 2).sum(axis=0) for each in (scores, changes))
    size, weight = np.array(sizes), np.array(weights)
    freedom = np.empty(len(bread))
    for k in range(len(bread)):
        like = np.diag(size[:, k]) - weight[:, k] @ bread @ weight[:, k].T
        freedom[k] = np.trace(like) ** 2 / max(float((like**2).sum()), 1e-300)
    both = INDEPENDENT + freedom
    weighed = (INDEPENDENT * independent + freedom * sandwich) / both
    # The quantile of chi squared.
    most = 2.0 * scipy_part("special", needed_by).gammaincinv(0.5 * freedom, ALIKE)
    refuted = freedom * sandwich > most * independent
    return np.where(refuted, jackknife, weighed), np.where(refuted, freedom, both)


def estimates(parameters: Sequence[Parameter], found: Fit, *, needed_by: str) -> tuple[Estimate, ...]:
    """Parameters with their intervals, each within its possible range."""
    halves = found.deviation * times_deviation(found.freedom, needed_by)
    given = []
    for k, (parameter, value, half) in enumerate(zip(parameters, found.x, halves, strict=True)):
        low: float | None = None
        high: float | None = None
        note = "fixed" if parameter.fixed else ""
        if found.free[k]:
            low = float(max(value - half, parameter.lower))
            high = float(min(value + half, parameter.upper))
        elif not parameter.fixed:
            others = [parameters[other].name for other in found.together.get(k, [])]
            note = f"only together with {', '.join(others)}" if others else "no information in these data"
        given.append(
            Estimate(
                name=parameter.name,
                unit=parameter.unit,
                value=float(value),
                low=low,
                high=high,
                before=parameter.start if parameter.file is None else parameter.file,
                note=note,
            )
        )
    return tuple(given)


def refutes(left: float, measured: float) -> bool:
    """Whether errors that are left after a fit contradict the errors of the measurements: the rule of every estimator.

    Intervals presume a model. If it is refuted, they are withheld (:func:`withheld`), and a line states the reason.
    """
    return left > REFUTED * measured


def times_deviation(freedom: Any, needed_by: str) -> Any:
    """Half of an interval, in standard deviations with so many degrees of freedom: the quantile of Student's t."""
    return scipy_part("special", needed_by).stdtrit(freedom, 0.5 + CONFIDENCE / 2)


def withheld(parts: Sequence[Estimate]) -> tuple[Estimate, ...]:
    """The estimates without intervals."""
    return tuple(replace(each, low=None, high=None, note=NONE_GIVEN) if each.determined else each for each in parts)


def at_bounds(parameters: Sequence[Parameter], found: Fit) -> tuple[str, ...]:
    """Parameters that end at a bound of their range, one line each; zero is a plausible end for friction or a lag."""
    said = []
    for k, parameter in enumerate(parameters):
        for bound in (parameter.lower, parameter.upper):
            if found.free[k] and bound != 0.0 and abs(found.x[k] - bound) < 1e-6 * parameter.scale:
                of = f"{bound:.4g} {parameter.unit}".rstrip()
                said.append(f"{parameter.name} ended at the bound of its range, {of}")
    return tuple(said)


def table(found: Sequence[Estimate]) -> str:
    """The estimates, one per line."""
    rows = [("parameter", "estimate", "95 % interval", "unit", "file")]
    for each in found:
        # A fixed number, and a number that follows from others, is not the file's value.
        interval = f"held: {each.note}" if each.held else each.note
        if each.determined:
            interval = f"{each.low:.5g} to {each.high:.5g}"
        rows.append((each.name, f"{each.value:.5g}", interval, each.unit, f"{each.before:.5g}"))
    widths = [max(len(row[column]) for row in rows) for column in range(5)]
    return "\n".join(
        "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows
    )
