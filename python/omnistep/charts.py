"""Climb charts: the greatest edge that a vehicle climbs, by the side that leads and by skew.

:func:`omnistep.climb_chart` makes one, :meth:`ClimbChart.read` reads its file, and :func:`omnistep.plot.chart` draws
it.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from os import PathLike
from pathlib import Path
from typing import Any, Literal, NamedTuple

from omnistep._omnistep import ChartRuns, Vehicle
from omnistep._output_files import check_output, write_text
from omnistep._toml_files import read_toml
from omnistep.errors import ConfigError

__all__ = ["ChartCell", "ClimbChart", "climb_chart"]

#: The largest file of a chart [bytes]: of five thousand approaches each edge.
_MOST_BYTES = 16_000_000


class ChartCell(NamedTuple):
    """What a vehicle climbs on one approach; docs/climb-chart.md describes each number.

    Example:
        >>> from omnistep.charts import ChartCell
        >>> cell = ChartCell("step", 0.0, 0.0, 0.024, 0.03, 0.031, "stalled")
        >>> cell.climbs_m, cell.because, cell.clearance_m
        (0.024, 'stalled', None)
    """

    edge: str
    side_deg: float
    skew_deg: float
    climbs_m: float
    limit_m: float
    fails_m: float | None
    because: str
    clearance_m: float | None = None
    climb_limits_m: float | None = None


@dataclass(frozen=True, repr=False)
class ClimbChart:
    """A chart, as its file holds it.

    Example:
        >>> import omnistep
        >>> chart = omnistep.climb_chart("omni3", edges=["step"], sides_deg=[0.0, 15.0])
        >>> chart.vehicle, chart.friction, len(chart.cells)
        ('omni3', 0.7, 2)
        >>> chart.climbs_m(10.0) == min(cell.climbs_m for cell in chart.cells)  # the smaller of its neighbours
        True
    """

    #: The text of its file.
    text: str

    @classmethod
    def read(cls, path: str | PathLike[str]) -> ClimbChart:
        """Read the file of a chart.

        Raises:
            ConfigError: the file is no chart; the message names file, key and value.
        """
        text, _ = read_toml(Path(path), _MOST_BYTES)
        ChartRuns.check(str(path), text)
        return cls(text)

    def write(self, path: str | PathLike[str]) -> None:
        """Write the file: the same bytes as ``omnistep chart`` writes.

        Raises:
            ConfigError: the path is no regular file.
            OSError: the file cannot be written.
        """
        write_text(Path(path), self.text)

    @property
    def keys(self) -> dict[str, Any]:
        """Every key of the file."""
        return tomllib.loads(self.text)

    @cached_property
    def _keys(self) -> dict[str, Any]:
        """The same, read once."""
        return self.keys

    @property
    def vehicle(self) -> str:
        """The vehicle's name."""
        return str(self._keys["vehicle"])

    @property
    def policy(self) -> str:
        """The control law."""
        return str(self._keys["policy"])

    @property
    def friction(self) -> float:
        """Coulomb coefficient between wheels and ground."""
        return float(self._keys["friction"])

    @property
    def speed_m_s(self) -> float:
        """Commanded speed [m/s]."""
        return float(self._keys["speed_m_s"])

    @property
    def margin(self) -> float:
        """Part of the limit that ``climbs_m`` is."""
        return float(self._keys["margin"])

    @property
    def cells(self) -> list[ChartCell]:
        """The approaches, in the order of edge, skew and side."""
        optional = {"fails_m": None}
        return [ChartCell(**(optional | cell)) for cell in self._keys["cell"]]

    def climbs_m(self, side_deg: float, *, skew_deg: float = 0.0, edge: str = "step") -> float:
        """Size to plan with [m]: the smallest of the cells around a side and a skew.

        Args:
            side_deg: direction of travel in the vehicle's axes [deg], counter-clockwise; 0 is forward.
            skew_deg: direction of travel off the edge's normal [deg].
            edge: ``step``, ``drop``, ``bar``, ``slope`` or ``gap``.

        Returns:
            The size; 0 beyond the sides and skews of the chart.
        """
        keys = self._keys
        side_deg = math.remainder(side_deg, 360.0)
        if keys["mirrored"] and side_deg < 0.0:
            side_deg, skew_deg = -side_deg, -skew_deg
        climbs = {
            (float(cell["skew_deg"]), float(cell["side_deg"])): float(cell["climbs_m"])
            for cell in keys["cell"]
            if cell["edge"] == edge
        }
        skews = _around(skew_deg, sorted({skew for skew, _ in climbs}))
        sides = _around(side_deg, sorted({side for _, side in climbs}), turn=not keys["mirrored"])
        return min((climbs.get((skew, side), 0.0) for skew in skews for side in sides), default=0.0)

    def _repr_html_(self) -> str:
        from omnistep._html import chart_html

        return chart_html(self)

    def __repr__(self) -> str:
        """Name vehicle and law, and count the approaches."""
        return f"<omnistep.charts.ClimbChart of {self.vehicle} under {self.policy}, {len(self.cells)} approaches>"


def _around(wanted: float, known: Sequence[float], *, turn: bool = False) -> list[float]:
    """The known numbers around a number, or the number itself; none if it is outside. With ``turn`` they wrap around.

    >>> from omnistep.charts import _around
    >>> _around(10.0, [0.0, 15.0]), _around(15.0, [0.0, 15.0]), _around(16.0, [0.0, 15.0])
    ([0.0, 15.0], [15.0], [])
    >>> _around(-170.0, [-165.0, 180.0], turn=True)
    [180.0, -165.0]
    """
    if wanted in known:
        return [wanted]
    below = [number for number in known if number < wanted]
    above = [number for number in known if number > wanted]
    if below and above:
        return [below[-1], above[0]]
    # Beyond half a turn the next is on the other side, if it is as near as sides of a chart are.
    if turn and known and known[0] + 360.0 - known[-1] <= 15.0:
        return [known[-1], known[0]]
    return []


def climb_chart(
    vehicle: str | PathLike[str] | Vehicle = "chugo7",
    *,
    policy: str | None = None,
    edges: Sequence[Literal["step", "drop", "bar", "slope", "gap"]] = ("step", "drop"),
    sides_deg: Sequence[float] | None = None,
    skews_deg: Sequence[float] = (0.0,),
    friction: float = 0.7,
    speed_m_s: float = 0.3,
    margin: float = 0.8,
    starts: int = 3,
    overrides: Mapping[str, Any] | None = None,
    out: str | PathLike[str] | None = None,
    resume: bool = False,
    jobs: int | None = None,
) -> ClimbChart:
    """Find the greatest edge that a vehicle climbs, by direction of travel.

    Sizes increase until one is not climbed, each from several starts, as in ``omnistep chart``.

    Args:
        vehicle: a built-in name (see :func:`omnistep.list_vehicles`), the path of a .toml file or a
            :class:`omnistep.Vehicle`.
        policy: a coordination policy; the best that the vehicle allows by default.
        edges: kinds of obstacle: steps up, steps down (``drop``), half-round bars (``bar``), slopes, gaps.
        sides_deg: directions of travel in the vehicle's axes [deg], -180 to 180; every 15 degrees by default.
        skews_deg: directions of travel off the edge's normal [deg], -80 to 80, each for every side.
        friction: Coulomb coefficient between wheels and ground, 0 to 2.
        speed_m_s: commanded speed [m/s], 0.01 to 10.
        margin: part of the limit to plan with, 0.1 to 1.
        starts: number of starts from which each size has to be climbed, 3 to 100.
        overrides: keys to replace in every run, as in :func:`omnistep.run`.
        out: the chart's file, kept after each cell; none by default.
        resume: keep the cells of the file ``out``, and add the missing cells.
        jobs: runs at the same time; one for each core by default.

    Returns:
        The chart.

    Raises:
        ConfigError: a name, key or value is wrong, or the file is a chart of other runs.

    Example:
        >>> import omnistep
        >>> chart = omnistep.climb_chart("omni3", edges=["step"], sides_deg=[0.0])
        >>> ahead = chart.cells[0]
        >>> 0.0 < ahead.climbs_m <= 0.8 * ahead.limit_m
        True
    """
    if resume and out is None:
        raise ConfigError("resume = True, allowed: with out", key="resume")
    if jobs is not None and jobs < 1:
        raise ConfigError(f"jobs = {jobs}, allowed: 1 or more", key="jobs")
    runs = ChartRuns(
        vehicle,
        policy=policy,
        edges=list(edges),
        sides_deg=[] if sides_deg is None else [float(side) for side in sides_deg],
        skews_deg=[float(skew) for skew in skews_deg],
        friction=friction,
        speed_m_s=speed_m_s,
        margin=margin,
        starts=starts,
        overrides=overrides,
    )
    if out is None:
        return ClimbChart(runs.compute(jobs=jobs))
    path = Path(out)
    check_output(path)
    done = ClimbChart.read(path).text if resume and path.exists() else None
    text = runs.compute(done=done, file=str(path), jobs=jobs, keep=lambda text: write_text(path, text))
    chart = ClimbChart(text)
    chart.write(path)
    return chart
