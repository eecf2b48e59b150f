"""What a notebook shows, and the calls that are made most in one."""

import io
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from types import SimpleNamespace

import pytest

import omnistep
from omnistep import _progress

SHORT = {"duration_s": 0.1}


@pytest.fixture(scope="module")
def runs():
    return omnistep.compare("step", overrides={"duration_s": 3.0}, progress=False)


def test_a_comparison_prints_the_table_of_the_command_but_for_the_speed_of_computation(runs, tmp_path):
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


def test_a_key_of_the_scenario_among_the_arguments_is_refused_with_the_way_to_give_it():
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
