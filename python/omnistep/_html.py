"""What a notebook shows of runs, vehicles, scenarios and limits: small tables and drawings of HTML.

`_notebook.py` makes them methods of the compiled classes. Every text of a file is escaped.
"""

from __future__ import annotations

import html
import math
from collections.abc import Iterable, Sequence
from typing import Any

from omnistep._comparison import Row, caption, html_table, rows
from omnistep._omnistep import ClimbLimits, Log, Outcome, Scenario, Trace, Vehicle
from omnistep.errors import OmnistepError

#: Rows of a study's table at most.
_MOST_ROWS = 30
#: Longer side of a drawing of a vehicle [px].
_DRAWN_PX = 260.0


def outcome_html(outcome: Outcome) -> str:
    """Return the metrics that the command's table has of a run."""
    return html_table([], rows([outcome]))


def trace_html(trace: Trace) -> str:
    """Return what was run and the metrics."""
    head = f"{trace.policy}, {len(trace)} periods, {len(trace.names)} columns"
    return html_table(["", head], rows([trace.outcome]), caption=caption([trace]))


def vehicle_html(vehicle: Vehicle) -> str:
    """Return the vehicle from above and its main numbers."""
    keys = vehicle.to_dict()
    motor = keys["motor"].get("stall_torque_n_m")
    no_load = vehicle.no_load_rad_s
    facts = [
        ("wheels", str(len(vehicle.wheel_names))),
        ("bodies", ", ".join(body["name"] for body in keys["body"])),
        ("mass [kg]", f"{vehicle.mass_kg:.6g}"),
        ("stall torque [N.m]", "-" if motor is None else f"{motor:.6g}"),
        ("no-load velocity [rad/s]", "-" if no_load is None else f"{no_load:.6g}"),
        ("wheel radius [m]", ", ".join(f"{each:.6g}" for each in sorted({w["radius_m"] for w in keys["wheel"]}))),
    ]
    return _beside(_from_above(vehicle), _facts(facts, vehicle.name))


def scenario_html(scenario: Scenario) -> str:
    """Return the scenario's ground, command and law, and its vehicle from above."""
    keys = scenario.to_dict()
    facts = [("vehicle", scenario.vehicle.name), ("policy", scenario.policy), ("seed", str(scenario.seed))]
    facts.append(("longest run [s]", f"{scenario.duration_s:.6g}"))
    facts.append(("control period [ms]", f"{1e3 * scenario.period_s:g}"))
    for part in ("terrain", "command"):
        facts += [(f"{part}.{key}", _short(value)) for key, value in keys[part].items() if value is not None]
    return _beside(_from_above(scenario.vehicle), _facts(facts, scenario.name))


def limits_html(limits: ClimbLimits) -> str:
    """Return torque and run-up that each row of a vehicle needs."""
    said = f"{limits.vehicle} over {limits.height_m:.6g} m, friction {limits.friction:.6g}: "
    said += f"{'not excluded' if limits.possible else 'impossible'}, the {limits.decisive} row is decisive"
    lines = [
        Row("wheels", "", [", ".join(each) or "-" for each in limits.wheels]),
        Row("verdict", "", list(limits.verdicts)),
        Row(f"least torque [N.m], of {limits.torque_n_m:.6g}", "", [_number(each) for each in limits.least_torque_n_m]),
        Row("energy that the torque lacks [J]", "", [_number(each) for each in limits.deficit_j]),
        Row(f"least run-up [m/s], of {limits.speed_m_s:.6g}", "", [_number(each) for each in limits.run_up_m_s]),
    ]
    return html_table(["row", *limits.rows], lines, caption=said)


def chart_html(chart: Any) -> str:
    """Return sizes to plan with [mm]: a row for each side and skew, a column for each edge."""
    edges = list(dict.fromkeys(cell.edge for cell in chart.cells))
    by = {(cell.side_deg, cell.skew_deg, cell.edge): cell for cell in chart.cells}
    places = sorted({(cell.side_deg, cell.skew_deg) for cell in chart.cells}, key=lambda place: (place[1], place[0]))
    lines = []
    for side, skew in places:
        found = [by.get((side, skew, edge)) for edge in edges]
        cells = ["" if each is None else f"{1e3 * each.climbs_m:.1f}, {each.because}" for each in found]
        lines.append(Row(f"side {side:g} deg, skew {skew:g} deg", "", cells))
    said = f"{chart.vehicle} under {chart.policy}, friction {chart.friction:g}, {chart.speed_m_s:g} m/s: "
    said += f"sizes to plan with [mm], {chart.margin:g} of the limit"
    return html_table(["approach", *edges], lines, caption=said)


def study_html(result: Any) -> str:
    """Return the cells of a study: its values, counts and means."""
    cells = result.cells
    heads = list(cells[0]) if cells else []
    lines = [Row(_cell(cell[heads[0]]), "", [_cell(cell[head]) for head in heads[1:]]) for cell in cells[:_MOST_ROWS]]
    said = f"{len(result)} runs, {result.failed} failed"
    said += f"; the first {_MOST_ROWS} of {len(cells)} cells" if len(cells) > _MOST_ROWS else ""
    return html_table([head.replace("_", " ") for head in heads], lines, caption=said)


def log_html(log: Log) -> str:
    """Return the player of a log; its facts where it has no poses."""
    try:
        return log.show()._repr_html_()
    except OmnistepError as error:
        return _facts([*log.run.items(), ("not shown", str(error))], log.path.name)


def _from_above(vehicle: Vehicle) -> str:
    """Draw bodies and wheels with their names from above, x up and y to the left, as SVG."""
    keys = vehicle.to_dict()
    wheels = keys["wheel"]
    boxes = [(*body["com_m"][:2], *body["inertia_box_m"][:2]) for body in keys["body"]]
    reach = [max(abs(w["position_m"][0]) + w["radius_m"] for w in wheels), *(abs(b[0]) + b[2] / 2 for b in boxes)]
    width = [max(abs(w["position_m"][1]) + w["radius_m"] for w in wheels), *(abs(b[1]) + b[3] / 2 for b in boxes)]
    ahead, left = 1.15 * max(reach), 1.15 * max(width)
    scale = 0.5 * _DRAWN_PX / max(ahead, left)

    def at(x_m: float, y_m: float) -> tuple[float, float]:
        return scale * (left - y_m), scale * (ahead - x_m)

    parts = []
    for x, y, long, wide in boxes:
        right, top = at(x + long / 2, y + wide / 2)
        parts.append(_rect(right, top, scale * wide, scale * long, 'fill-opacity="0.06"'))
    for wheel in wheels:
        x, y = at(*wheel["position_m"])
        radius = scale * wheel["radius_m"]
        # Its rolling direction, counter-clockwise from ahead; SVG turns clockwise.
        turn = -math.degrees(math.atan2(wheel["rolling_direction"][1], wheel["rolling_direction"][0]))
        disc = _rect(x - radius / 4, y - radius, radius / 2, 2 * radius, 'fill-opacity="0.35" rx="2"')
        parts.append(f'<g transform="rotate({turn:.1f} {x:.1f} {y:.1f})">{disc}</g>')
        name = html.escape(wheel["name"])
        end = "start" if x < scale * left else "end"
        reach_px = radius * max(abs(math.sin(math.radians(turn))), 0.5) + 4
        beside = x + (reach_px if end == "start" else -reach_px)
        parts.append(
            f'<text x="{beside:.1f}" y="{y:.1f}" text-anchor="{end}" dominant-baseline="middle" stroke="none"'
            f' font-size="11">{name}</text>'
        )
    x, y = at(0.0, 0.0)
    parts.append(f'<path d="M{x:.1f} {y:.1f}v-24l-4 7m4 -7l4 7" fill="none"><title>x, ahead</title></path>')
    size = f'width="{2 * scale * left:.0f}" height="{2 * scale * ahead:.0f}"'
    said = html.escape(f"{vehicle.name} from above, ahead is up")
    return (
        f'<svg {size} role="img" aria-label="{said}" stroke="currentColor" fill="currentColor">{"".join(parts)}</svg>'
    )


def _rect(x: float, y: float, width: float, height: float, how: str) -> str:
    return f'<rect x="{x:.1f}" y="{y:.1f}" width="{width:.1f}" height="{height:.1f}" {how}/>'


def _beside(*parts: str) -> str:
    return f'<div style="display:flex;gap:1em;flex-wrap:wrap;align-items:flex-start">{"".join(parts)}</div>'


def _facts(facts: Iterable[tuple[str, str]], title: str) -> str:
    return html_table([], [Row(name, "", [text]) for name, text in facts], caption=title)


def _short(value: Any) -> str:
    text = f"{value:.6g}" if isinstance(value, float) else str(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _cell(value: Any) -> str:
    return "-" if value is None else f"{value:.4g}" if isinstance(value, float) else str(value)


def _number(value: Sequence[float] | float) -> str:
    return f"{value:.3g}"
