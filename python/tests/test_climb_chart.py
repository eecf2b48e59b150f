"""Climb charts from Python: the command's bytes, what is between the cells, pictures, and what is said of bad input."""

import subprocess
import sys

import matplotlib.pyplot as plt
import numpy as np
import pytest

import omnistep
from omnistep.charts import ClimbChart

PLAIN = {"policy": "independent", "edges": ["step"]}


@pytest.fixture(autouse=True)
def close_figures():
    yield
    plt.close("all")


@pytest.fixture(scope="module")
def omni3(tmp_path_factory):
    """A chart of two sides, and its file."""
    out = tmp_path_factory.mktemp("chart") / "omni3.toml"
    return omnistep.climb_chart("omni3", **PLAIN, sides_deg=[0, 15], out=out), out


def of_cells(*cells, mirrored=True):
    """A chart of made-up cells: edge, skew, side, size to plan with."""
    text = f'vehicle = "a"\npolicy = "traction"\nmirrored = {str(mirrored).lower()}\n'
    for edge, skew, side, climbs in cells:
        text += f'[[cell]]\nedge = "{edge}"\nskew_deg = {skew:.1f}\nside_deg = {side:.1f}\n'
        text += f'climbs_m = {climbs}\nlimit_m = {climbs + 0.01}\nbecause = "stalled"\n'
    return ClimbChart(text)


def test_command_and_python_write_the_same_bytes_also_when_resumed(omni3, tmp_path):
    chart, out = omni3
    command = [sys.executable, "-m", "omnistep", "chart", "omni3", "--policy", "independent", "--edge", "step"]
    command += ["--side", "0,15", "--quiet", "--out", tmp_path / "a.toml"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "a.toml").read_bytes() == out.read_bytes() == chart.text.encode()
    # In two parts, and of a vehicle that is given itself.
    other, vehicle = tmp_path / "b.toml", omnistep.Vehicle("omni3")
    omnistep.climb_chart(vehicle, **PLAIN, sides_deg=[15], out=other, jobs=1)
    omnistep.climb_chart(vehicle, **PLAIN, sides_deg=[0], out=other, resume=True)
    assert other.read_bytes() == out.read_bytes()
    read = ClimbChart.read(out)
    assert read == chart
    assert (read.vehicle, read.policy, read.friction, read.speed_m_s, read.margin) == (
        *("omni3", "independent"),
        *(0.7, 0.3, 0.8),
    )
    chart.write(tmp_path / "c.toml")
    assert (tmp_path / "c.toml").read_bytes() == out.read_bytes()


def test_between_cells_the_smallest_neighbour_counts_and_nothing_beyond_is_known():
    mirrored = of_cells(
        ("step", 0, 0, 0.03),
        ("step", 0, 15, 0.01),
        ("step", 10, 0, 0.02),
        ("step", 10, 15, 0.005),
        ("drop", 0, 0, 0.05),
    )
    assert mirrored.climbs_m(0.0) == 0.03
    assert mirrored.climbs_m(7.0) == mirrored.climbs_m(-7.0) == mirrored.climbs_m(353.0) == 0.01
    assert mirrored.climbs_m(7.0, skew_deg=5.0) == mirrored.climbs_m(-7.0, skew_deg=-5.0) == 0.005
    assert mirrored.climbs_m(16.0) == mirrored.climbs_m(0.0, skew_deg=11.0) == mirrored.climbs_m(7.0, edge="gap") == 0.0
    assert mirrored.climbs_m(0.0, edge="drop") == 0.05
    round_about = of_cells(("step", 0, -165, 0.02), ("step", 0, 180, 0.01), mirrored=False)
    assert round_about.climbs_m(-170.0) == round_about.climbs_m(190.0) == 0.01


@pytest.mark.parametrize(
    ("keywords", "line"),
    [
        ({"edges": ["kerb"]}, 'edges: "kerb", allowed: step, drop, bar, slope, gap'),
        ({"sides_deg": [200]}, "chart: sides_deg: 200, allowed: -180 to 180"),
        ({"margin": 0}, "chart: margin: 0, allowed: 0.1 to 1"),
        ({"starts": -1}, "starts: -1, allowed: 3 to 100"),
        ({"friction": float("nan")}, "chart: friction: NaN, allowed: 0 to 2"),
        (
            {"overrides": {"command.vx_m_s": 1.0}},
            "chart: command.vx_m_s: replaced, allowed: keys that a chart does not vary",
        ),
        ({"resume": True}, "resume = True, allowed: with out"),
        ({"jobs": 0}, "jobs = 0, allowed: 1 or more"),
    ],
)
def test_bad_input_is_one_line(keywords, line):
    with pytest.raises(omnistep.ConfigError) as error:
        omnistep.climb_chart("omni3", **keywords)
    assert str(error.value).startswith(line) and "\n" not in str(error.value)


def test_a_file_that_is_no_chart_and_a_chart_of_other_runs_are_refused(omni3, tmp_path):
    _, out = omni3
    bad = tmp_path / "bad.toml"
    for text, line in [
        ("schema_version = 1\n", f"{bad}: line "),
        ("a = [", f"{bad}: not TOML: "),
        (
            out.read_text().replace("side_deg = 0.0", "side_deg = 999.0"),
            f"{bad}: cell[0].side_deg: 999, allowed: -180 to 180",
        ),
    ]:
        bad.write_text(text)
        with pytest.raises(omnistep.ConfigError) as error:
            ClimbChart.read(bad)
        assert str(error.value).startswith(line) and "\n" not in str(error.value)
    with pytest.raises(
        omnistep.ConfigError, match=r"^chart: friction: 0.7, allowed: 0.5, as the chart that it shall continue$"
    ):
        omnistep.climb_chart("omni3", **PLAIN, sides_deg=[0], friction=0.5, out=out, resume=True)


def sectors(ax):
    """Middle [deg], width [deg] and radius [mm] of every sector of a picture."""
    return np.array(
        [
            (np.degrees(each.get_x() + 0.5 * each.get_width()), np.degrees(each.get_width()), each.get_height())
            for each in ax.patches
        ]
    )


def test_a_picture_goes_all_round_and_has_what_the_cells_say():
    whole = of_cells(*(("step", 0, side, 0.001 * (side + 1)) for side in range(0, 181, 15)))
    ax = omnistep.plot.chart(whole)
    sides, widths, climbs = sectors(ax).T
    np.testing.assert_allclose(sides, np.arange(-165, 181, 15), atol=1e-9)
    np.testing.assert_allclose(widths, 15.0)  # side by side
    np.testing.assert_allclose(climbs, np.abs(np.arange(-165, 181, 15)) + 1.0)  # in mm
    (limits,) = ax.lines
    arcs = limits.get_ydata().reshape(24, -1)
    np.testing.assert_allclose(arcs - climbs[:, np.newaxis], 10.0)
    assert np.isnan(limits.get_xdata().reshape(24, -1)[:, -1]).all()  # no line from one arc to the next
    np.testing.assert_allclose(ax.get_xlim(), [0.0, 2.0 * np.pi])
    assert ax.get_theta_offset() == pytest.approx(np.pi / 2)  # forward is up, and left is left
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["traction"]
    _, square = plt.subplots()
    for arguments, key in [((whole, {"ax": square}), "ax"), (([], {}), "charts"), ((whole, {"edge": "gap"}), "edge")]:
        with pytest.raises(omnistep.ConfigError) as error:
            omnistep.plot.chart(arguments[0], **arguments[1])
        assert error.value.key == key
    with pytest.raises(TypeError):
        omnistep.plot.chart([whole.text])


@pytest.mark.parametrize(
    ("sides", "mirrored", "width", "labels"),
    [
        ([0, 90, 180], True, 30.0, ["-90°\nright", "0° forward", "90°\nleft", "180° back"]),
        ([0, 45, 90, 135, 180], True, 30.0, [f"{side}°" for side in (-135, -45, 45, 135)]),
        ([-10, 0, 10], False, 10.0, ["-10°", "0° forward", "10°"]),
        ([30], False, 30.0, ["30°"]),
        ([-180, 180], False, 30.0, ["180° back"]),
    ],
)
def test_few_sides_are_a_sector_and_an_angle_each_with_nothing_between(sides, mirrored, width, labels):
    # Nothing is climbed at the first side.
    ax = omnistep.plot.chart(of_cells(*(("step", 0, side, 0.02 * (side != 0)) for side in sides), mirrored=mirrored))
    drawn = sectors(ax)
    np.testing.assert_allclose(drawn[:, 1], width)
    assert {round(side) % 360: radius > 0.0 for side, _, radius in drawn} == {
        side % 360: side != 0 for side in sides + [-side for side in sides if mirrored]
    }
    names = [text.get_text() for text in ax.get_xticklabels()]
    assert len(names) == len(drawn) and set(labels) <= set(names)
    # The scale is between two sides.
    scale = ax.get_rlabel_position()
    assert min(abs((side - scale + 180.0) % 360.0 - 180.0) for side in drawn[:, 0]) >= 0.5 * width


def test_a_chart_without_any_size_has_a_picture():
    nothing = ClimbChart(of_cells(("step", 0, 0, 0.0)).text.replace("limit_m = 0.01", "limit_m = 0.0"))
    assert omnistep.plot.chart(nothing).get_rmax() == 1.0
