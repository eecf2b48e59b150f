"""Routes from Python: as the command plans them, driven to the goal, and why there is none."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

import omnistep

CHART = Path(__file__).resolve().parents[2] / "crates" / "omni-plan" / "tests" / "charts" / "chugo7.toml"


def test_a_route_over_stairs_is_that_of_the_command_and_its_scenario_arrives(tmp_path):
    route = omnistep.plan_route("stairs", (4.0, 1.0), chart=CHART)
    words = ["plan", "stairs", "--to", "4,1", "--chart", str(CHART), "--json"]
    done = subprocess.run([sys.executable, "-m", "omnistep", *words], cwd=tmp_path, capture_output=True, text=True)
    assert json.loads(done.stdout) == json.loads(route.text), done.stderr
    assert [edge.kind for edge in route.crossings] == ["up"] * 3
    assert all(edge.height_m <= edge.allowed_m for edge in route.crossings)
    assert route.points[-1][:2] == pytest.approx((4.0, 1.0))
    assert route.scenario["command.follow.pose"] == "estimate"
    # Within the 5 cm of the true pose that an arrival allows, though the follower has the estimated one.
    assert omnistep.run(route.scenario, progress=False).outcome.arrived_s is not None


def test_a_chart_in_memory_is_its_file():
    chart = omnistep.ClimbChart.read(CHART)
    routes = [omnistep.plan_route("stairs", (2.5, 0.0), chart=each) for each in (chart, str(CHART))]
    assert routes[0].text == routes[1].text


def test_an_area_to_keep_out_of_is_gone_round():
    route = omnistep.plan_route("flat", (4.0, 0.0), chart=CHART, keep_out=[(1.5, 2.5, -1.0, 2.0)])
    # Half the vehicle's width beyond the area's border, and more.
    assert min(point.y_m for point in route.points) < -1.2


def test_where_there_is_no_way_the_edge_is_named():
    with pytest.raises(omnistep.NoRouteError, match=r"edge at \(0\.70, .* mm up, at most 44\.8 mm from the front"):
        omnistep.plan_route("step", (2.5, 0.0), chart=CHART, margin=0.7)


@pytest.mark.parametrize(
    ("keywords", "key", "said"),
    [
        ({"to": (1.0,)}, "to", "x and y"),
        ({"to": "there"}, "to", "two or three numbers"),
        ({"keep_out": [(1.0, 2.0)]}, "keep_out", "four numbers"),
        ({"keep_out": [(1e9, 2.0, 0.0, 1.0)]}, "corner", "-100000 to 100000"),
        ({"elevation": ("heights.png", 0.0, 1.0)}, "elevation", "without map"),
        ({"cost": "beauty"}, "cost", "time, energy, risk"),
        ({"margin": 2.0}, "margin", "0.1 to 1"),
        ({"around_m": float("nan")}, "around_m", "1 to 100"),
        ({"resolution_m": 0.0}, "resolution_m", "0.001 to 10"),
        ({"overrides": {"vehicle": "omni3"}}, "vehicle_sha256", "another vehicle"),
    ],
)
def test_bad_arguments_are_named(keywords, key, said):
    given = {"scenario": "stairs", "to": (4.0, 1.0), "chart": CHART} | keywords
    with pytest.raises(omnistep.ConfigError, match=said) as raised:
        omnistep.plan_route(**given)
    assert raised.value.key == key
