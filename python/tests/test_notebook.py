"""What a notebook shows, and the calls that are made most in one."""

import io
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace
from xml.etree import ElementTree

import numpy as np
import pytest

import omnistep
from omnistep import _played, _progress

SHORT = {"duration_s": 0.1}


@pytest.fixture(scope="module")
def runs():
    return omnistep.compare("step", overrides={"duration_s": 3.0}, progress=False)


def test_a_comparison_prints_the_command_s_table_but_for_the_speed_of_computation(runs, tmp_path):
    command = [sys.executable, "-m", "omnistep", "compare", "step", "--set", "duration_s=3.0", "--out", str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    table = [line for line in done.stdout.splitlines()[1:] if "real-time factor" not in line and ".mcap" not in line]
    assert str(runs).splitlines() == table
    assert len(table) == 2 * 12 + 1 and max(map(len, table)) <= 80


def test_a_comparison_is_a_mapping_that_does_not_change(runs):
    assert list(runs) == omnistep.list_policies() and len(runs) == 6 and runs == dict(runs.items())
    assert runs.get("none") is None and "traction" in runs
    with pytest.raises(KeyError, match="no run 'none', allowed: 'independent'"):
        runs["none"]
    with pytest.raises(TypeError):
        runs["traction"] = None
    table = runs.to_pandas()
    assert table.index.name == "policy" and list(table.index) == list(runs)
    assert table.loc["traction", "work_j"] == runs["traction"].outcome.work_j
    page = runs._repr_html_()
    assert page.startswith("<table><caption") and page.count("<td") == 10 * 6 and "height 0.05 m" in page


def test_a_comparison_on_two_engines_names_them():
    given = {"policies": ["independent"], "engines": ["rapier", "articulated"], "overrides": SHORT, "progress": False}
    runs = omnistep.compare("flat", **given)
    assert "| engine                 |      rapier | articulated |" in str(runs).splitlines()
    assert list(runs.to_pandas().index) == [("independent", "rapier"), ("independent", "articulated")]
    assert runs.to_pandas().reset_index()["engine"].tolist() == ["rapier", "articulated"]


def test_a_scenario_s_key_among_the_arguments_is_refused_with_the_way_to_give_it():
    key = {"terrain.friction": 0.5}
    for call in (omnistep.run, omnistep.compare, omnistep.run_study, lambda x, **more: omnistep.sweep([{}], **more)):
        with pytest.raises(TypeError, match=r"terrain\.friction, .*overrides=\{'terrain\.friction': 0\.5\}"):
            call("ensemble" if call is omnistep.run_study else "step", **key)
    with pytest.raises(TypeError, match=r"run: no argument polcy \(did you mean policy\?\), allowed: scenario, policy"):
        omnistep.run("step", polcy="traction")


def test_a_sweep_without_a_folder_leaves_none_and_has_every_row(tmp_path, monkeypatch):
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    given = {"scenario": "flat", "overrides": SHORT, "progress": False}
    result = omnistep.sweep({"terrain.friction": [0.5, 0.9]}, **given)
    assert list(tmp_path.iterdir()) == [] and result.folder is None
    kept = omnistep.sweep({"terrain.friction": [0.5, 0.9]}, out=tmp_path / "kept", **given)
    assert result.rows() == kept.rows() and result.cells == kept.cells and (tmp_path / "kept").is_dir()
    assert repr(result) == "<omnistep.StudyResult of 2 runs, 0 failed, 2 computed now>"
    with ThreadPoolExecutor() as pool, pytest.raises(omnistep.ConfigError, match="out = None, allowed: with an exec"):
        omnistep.sweep([{}], executor=pool, **given)


def test_a_bar_is_shown_in_a_terminal_or_a_notebook_and_nowhere_else(monkeypatch):
    monkeypatch.setattr("sys.stderr", io.StringIO())
    assert not _progress.is_seen()
    for shell, seen in ((None, False), (SimpleNamespace(), False), (SimpleNamespace(kernel=object()), True)):
        monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=lambda shell=shell: shell))
        assert _progress.is_seen() == seen
    monkeypatch.setitem(sys.modules, "IPython", None)
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    assert _progress.is_seen()
    monkeypatch.setattr("sys.stderr", None)
    assert not _progress.is_seen()


def cells(page):
    """What is in the cells of a table of HTML, which is well formed."""
    root = ElementTree.fromstring(f"<div>{page}</div>")
    return ["".join(each.itertext()) for each in root.iter() if each.tag in ("td", "th")]


def test_outcome_and_trace_show_the_metrics_of_the_command_s_table(runs):
    trace = runs["traction"]
    metrics = cells(trace.outcome._repr_html_())
    assert metrics[:4] == ["verdict", "unfinished", "limited by", "time"]
    assert metrics[metrics.index("work [J]") + 1] == f"{trace.outcome.work_j:.2f}"
    shown = cells(trace._repr_html_())
    assert shown[1] == f"traction, 3000 periods, {len(trace.names)} columns" and shown[2:] == metrics


def test_a_vehicle_is_drawn_from_above_with_its_front_up_and_its_wheels_names():
    vehicle = omnistep.Vehicle("mecanum4")
    root = ElementTree.fromstring(vehicle._repr_html_())
    places = {each.text: (float(each.get("x")), float(each.get("y"))) for each in root.iter("text")}
    assert set(places) == set(vehicle.wheel_names)
    assert places["front_left"][1] < places["rear_left"][1] and places["front_left"][0] < places["front_right"][0]
    facts = cells(vehicle._repr_html_())
    assert facts[facts.index("mass [kg]") + 1] == f"{vehicle.mass_kg:g}"


def test_scenario_limits_chart_and_study_are_tables_of_their_numbers():
    scenario = cells(omnistep.Scenario("step")._repr_html_())
    assert scenario[scenario.index("terrain.height_m") + 1] == "0.05"
    limits = omnistep.climb_limits("step")
    shown = cells(limits._repr_html_())
    assert shown[:4] == ["row", "front", "middle", "rear"]
    assert shown[shown.index("verdict") + 1 :][:3] == limits.verdicts
    points = {"terrain.friction": [0.5, 0.9]}
    study = omnistep.sweep(points, scenario="flat", overrides=SHORT, progress=False)
    assert "0.9" in cells(study._repr_html_()) and "2 runs, 0 failed" in study._repr_html_()


def test_a_chart_is_a_table_of_sizes_in_millimetres_by_approach_and_edge():
    cell = 'edge = "step"\nside_deg = 15.0\nskew_deg = 0.0\nclimbs_m = 0.0244\nlimit_m = 0.03\nbecause = "stalled"\n'
    head = 'vehicle = "a<b"\npolicy = "traction"\nfriction = 0.7\nspeed_m_s = 0.3\nmargin = 0.8\n'
    page = omnistep.ClimbChart(f"{head}[[cell]]\n{cell}")._repr_html_()
    assert cells(page) == ["approach", "step", "side 15 deg, skew 0 deg", "24.4, stalled"] and "a&lt;b under" in page


@pytest.mark.parametrize("vehicle", ["chugo7", "rocker_bogie6", "mecanum4"])
def test_the_poses_of_a_trace_in_the_player_are_those_of_its_log(vehicle, tmp_path):
    keys = {"vehicle": vehicle, "duration_s": 2.0, "command.wz_rad_s": 0.1}
    trace = omnistep.run("step", overrides=keys, mcap=tmp_path / "x.mcap", progress=False)
    log = omnistep.read_mcap(tmp_path / "x.mcap")
    played, scene = _played._Played.of(trace)
    assert scene == log.scene() and set(played.frames) == set(log.frames) - {"odom"}
    for name, poses in played.frames.items():
        # At times a period later than the log's, in which it moves 0.3 mm; places in between are joined by lines.
        between = np.array([np.interp(log.frame_time_s, played.frame_time_s, column) for column in poses.T]).T
        assert np.abs(between[:, :3] - log.frames[name][:, :3]).max() < 2e-3, name
        turns = np.abs(np.sum(between[:, 3:] * log.frames[name][:, 3:], axis=1))
        assert turns.min() > np.cos(0.5 * np.radians(4.0)), name


def test_a_run_is_shown_in_a_frame_that_fetches_nothing_and_stays_small(runs, tmp_path, monkeypatch):
    frame = runs["traction"].show(height_px=300)
    page = frame._repr_html_()
    assert page.startswith('<iframe title="step with chugo7: traction" sandbox="allow-scripts"')
    assert 'height="300"' in page and "http:" not in frame.page and "https:" not in frame.page and len(page) < 600_000
    monkeypatch.setattr(_played, "_MOST_NUMBERS", 1000)
    assert len(runs["traction"].show().page) < len(frame.page)
    with pytest.raises(omnistep.ConfigError, match="height_px = 0, allowed: 100 to 4000"):
        runs["traction"].show(height_px=0)
    omnistep.run("flat", overrides=SHORT, mcap=tmp_path / "x.mcap")
    log = omnistep.read_mcap(tmp_path / "x.mcap")
    assert log._repr_html_() == log.show()._repr_html_()
    with pytest.raises(omnistep.ConfigError, match="allowed: the Log itself"):
        log.trace.show()


def test_points_from_the_side_are_joints_only_of_a_vehicle_that_has_some(runs, curve):
    labels = [omnistep.plot.side_view(run).lines[-1].get_label().split(",")[0] for run in (runs["traction"], curve)]
    assert labels[0] == "joint on wheel 4" and labels[1].startswith("centre of wheel ")


def test_every_panel_without_one_below_has_numbers_and_long_names_are_slanted():
    rows = [{"p": p, "x": x, "y": 1.0, "climbed": True} for p in "abcde" for x in (1.0, 2.0)]
    axes = omnistep.plot.climb_map(rows, x="x", y="y", panel="p")
    assert [axes[0].get_subplotspec().get_gridspec().ncols, len(axes)] == [2, 5]
    assert all(tick.label1.get_visible() for ax in axes[3:] for tick in ax.xaxis.get_major_ticks())
    names = [{"control_policy": policy, "climbed": True} for policy in omnistep.list_policies()]
    (ax,) = omnistep.plot.ensemble(names, ["climbed"])
    assert {label.get_rotation() for label in ax.get_xticklabels()} == {20.0}
