"""Routes over edges that a vehicle can climb, planned with its climb chart.

:func:`omnistep.plan_route` plans one, and :attr:`Route.scenario` drives it.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from os import PathLike, fspath
from typing import Any, Literal, NamedTuple

from omnistep import _omnistep
from omnistep._omnistep import Scenario
from omnistep.charts import ClimbChart
from omnistep.errors import ConfigError

__all__ = ["Crossing", "Route", "RoutePoint", "plan_route"]


class RoutePoint(NamedTuple):
    """A point of a route. Between two points the vehicle travels straight without turning, or turns in place.

    Example:
        >>> from omnistep.routes import RoutePoint
        >>> RoutePoint(1.0, 0.0, 0.0, 0.4, 2.5, crosses=False).time_s
        2.5
    """

    x_m: float
    y_m: float
    yaw_rad: float
    speed_m_s: float
    time_s: float
    crosses: bool


class Crossing(NamedTuple):
    """An edge that a route crosses: where, in which direction, with which side leading, and how high it is.

    Example:
        >>> from omnistep.routes import Crossing
        >>> edge = Crossing(0.7, 0.0, 0.0, 0.0, "up", 0.03, 0.048, 0.3, 4.1)
        >>> edge.height_m < edge.allowed_m
        True
    """

    x_m: float
    y_m: float
    normal_rad: float
    side_deg: float
    kind: str
    height_m: float
    allowed_m: float
    speed_m_s: float
    time_s: float


@dataclass(frozen=True, repr=False)
class Route:
    """A route, as ``omnistep plan --json`` prints it.

    Example:
        >>> import omnistep
        >>> chart = omnistep.climb_chart("omni3", edges=["step", "drop"], sides_deg=[0.0, 15.0])
        >>> route = omnistep.plan_route("flat", (2.0, 0.0), chart=chart, overrides={"vehicle": "omni3"})
        >>> round(route.length_m, 2), route.crossings
        (2.0, [])
        >>> omnistep.run(route.scenario, progress=False).outcome.verdict
        'arrived'
    """

    #: The route as JSON.
    text: str
    #: The scenario that it was planned in.
    planned_in: Scenario

    @cached_property
    def _keys(self) -> dict[str, Any]:
        keys: dict[str, Any] = json.loads(self.text)
        return keys

    @property
    def points(self) -> list[RoutePoint]:
        """The path, from the start on."""
        return [RoutePoint(**point) for point in self._keys["points"]]

    @property
    def crossings(self) -> list[Crossing]:
        """The edges that it crosses, in this order."""
        return [Crossing(**crossing) for crossing in self._keys["crossings"]]

    @property
    def length_m(self) -> float:
        """Length of the path [m]."""
        return float(self._keys["length_m"])

    @property
    def duration_s(self) -> float:
        """Duration at constant speeds [s]."""
        return float(self._keys["duration_s"])

    @property
    def cost(self) -> float:
        """Time [s], energy per mass [J/kg] or risk of the route, as planned."""
        return float(self._keys["cost"])

    @property
    def scenario(self) -> Scenario:
        """The scenario with this route as its path, followed with the estimated pose; :func:`omnistep.run` drives it.

        Raises:
            ConfigError: a point is more than 100 m from the origin.
        """
        return _omnistep.drive_route(self.text, self.planned_in)

    def __repr__(self) -> str:
        """Say how long it is, and how many edges it crosses."""
        return f"<omnistep.routes.Route of {self.length_m:.2f} m over {len(self._keys['crossings'])} edges>"


def plan_route(
    scenario: str | PathLike[str] | Scenario,
    to: Sequence[float],
    *,
    chart: ClimbChart | str | PathLike[str],
    map: str | PathLike[str] | None = None,
    elevation: tuple[str | PathLike[str], float, float] | None = None,
    keep_out: Sequence[Sequence[float]] = (),
    cost: Literal["time", "energy", "risk"] = "time",
    margin: float = 0.8,
    clearance_m: float = 0.05,
    resolution_m: float = 0.05,
    around_m: float = 3.0,
    overrides: Mapping[str, Any] | None = None,
) -> Route:
    """Plan a route from a scenario's start to a goal, over edges that the vehicle climbs: as ``omnistep plan`` does.

    Args:
        scenario: a built-in name (see :func:`omnistep.list_scenarios`), the path of a .toml file or a
            :class:`omnistep.Scenario`: its vehicle, its ground and its start.
        to: x and y in the world [m], -100 to 100, and a heading [deg] if it matters.
        chart: what the vehicle climbs, see :func:`omnistep.climb_chart`, or the file of a chart.
        map: a map of ROS's map_server, a .yaml file, instead of the scenario's ground.
        elevation: heights of the map: a grey PNG or PGM of the same size, and the heights of its black and white [m].
        keep_out: rectangles that the vehicle does not enter: x from and to, y from and to in the world [m].
        cost: what the route has the least of.
        margin: part of the chart's limits to plan with, 0.1 to 1.
        clearance_m: distance from walls and from edges that are not crossed [m], 0 to 1.
        resolution_m: cells of the scenario's ground [m], 0.001 to 10.
        around_m: how far around start and goal the scenario's ground is looked at [m], 1 to 100.
        overrides: keys of the scenario to replace, as in :func:`omnistep.run`.

    Returns:
        The route.

    Raises:
        ConfigError: a name, key, value or file is wrong, or the chart is of another vehicle.
        NoRouteError: there is no way; the message says which edge or obstacle is in the way.

    Example:
        >>> import omnistep
        >>> chart = omnistep.climb_chart("chugo7", edges=["step", "drop"], sides_deg=[0.0, 15.0])
        >>> over = omnistep.plan_route("stairs", (4.0, 0.0), chart=chart)
        >>> [crossing.kind for crossing in over.crossings]
        ['up', 'up', 'up']
    """
    if isinstance(chart, ClimbChart):
        text, file = chart.text, "chart"
    else:
        text, file = ClimbChart.read(chart).text, fspath(chart)
    try:
        goal = [float(part) for part in to]
    except (TypeError, ValueError) as error:
        raise ConfigError(f"to: {to!r}, allowed: two or three numbers", key="to") from error
    try:
        areas = [(float(x), float(to_x), float(y), float(to_y)) for x, to_x, y, to_y in keep_out]
    except (TypeError, ValueError) as error:
        raise ConfigError(f"keep_out: {keep_out!r}, allowed: four numbers each", key="keep_out") from error
    if elevation is not None and map is None:
        raise ConfigError("elevation: given without map, whose heights it has", key="elevation")
    planned_in = Scenario(scenario, overrides=overrides)
    route = _omnistep.plan_route(
        planned_in,
        goal,
        chart=text,
        file=file,
        map=None if map is None else fspath(map),
        elevation=elevation,
        keep_out=areas,
        cost=cost,
        margin=margin,
        clearance_m=clearance_m,
        resolution_m=resolution_m,
        around_m=around_m,
    )
    return Route(route, planned_in)
