"""Results of a study, read by another program's Parquet reader."""

import json
import os
import signal
import subprocess
import sys
import threading
import time

import duckdb
import pytest

import omnistep

STUDY = """
schema_version = 1
name = "grid"
scenario = "step"
seeds = [1, 5]

[set]
duration_s = 0.5
"perturbation.start_m" = 0.02
"vehicle.gains.kp_n_m_s_rad" = 1e6

[[axis]]
key = "terrain.height_m"
values = [0.02, 0.05, 0.08]

[[axis]]
key = "control.policy"
values = ["scale_torques", "independent"]

[[axis]]
key = "vehicle.motor.stall_torque_n_m"
values = [2.0, 1e6]

[map]
metrics = ["climbed", "required_friction"]
"""


def test_duckdb_reads_one_typed_row_a_run_and_agrees_with_the_map(tmp_path):
    (tmp_path / "grid.toml").write_text(STUDY)
    command = [sys.executable, "-m", "omnistep", "study", "grid.toml", "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode == 0
    (said,) = done.stderr.splitlines()
    assert said.startswith("warning: grid: 24 of 24 runs cannot finish in time; "), said
    cells = [json.loads(line) for line in done.stdout.splitlines()]
    assert len(cells) == 3 * 2 * 2

    rows = duckdb.read_parquet(str(tmp_path / "out" / "grid" / "*.parquet"))
    types = dict(zip(rows.columns, map(str, rows.types), strict=True))
    assert list(types)[:5] == ["key", "seed", "terrain_height_m", "control_policy", "vehicle_motor_stall_torque_n_m"]
    assert list(types)[-1] == "error"
    expected = {"key": "VARCHAR", "seed": "BIGINT", "terrain_height_m": "DOUBLE", "climbed": "BOOLEAN"}
    expected |= {"control_policy": "VARCHAR", "crossing_s": "DOUBLE", "verdict": "VARCHAR", "error": "VARCHAR"}
    assert expected.items() <= types.items()
    counted = (
        "count(*), count(distinct key), count(error), count(isnan(slip_rms) or null), list_sort(list(distinct seed))"
    )
    assert rows.aggregate(counted).fetchall() == [(24, 24, 12, 0, [1, 5])]
    assert rows.filter("error is not null and verdict is distinct from 'diverged'").fetchall() == []
    for cell in cells:
        where = f"terrain_height_m = {cell['terrain_height_m']} and control_policy = '{cell['control_policy']}'"
        where += f" and vehicle_motor_stall_torque_n_m = {cell['vehicle_motor_stall_torque_n_m']}"
        metrics = "count(*), count(error), avg(climbed::int) filter (error is null)"
        assert rows.filter(where).aggregate(metrics).fetchall() == [(cell["runs"], cell["errors"], cell["climbed"])]


SMALL = """
schema_version = 1
name = "small"
scenario = "flat"
seeds = 4
set.duration_s = 0.1
set."perturbation.yaw_rad" = 0.05
axis = [{ key = "terrain.friction", values = [0.5, 1] }]
"""


def command(folder, *more):
    arguments = [sys.executable, "-m", "omnistep", "study", "small.toml", "--out", "results", "--quiet", *more]
    return subprocess.run(arguments, capture_output=True, text=True, check=False, cwd=folder)


def test_a_study_begun_by_the_command_is_finished_in_python_and_the_other_way_round(tmp_path):
    file, results = tmp_path / "small.toml", tmp_path / "results"
    file.write_text(SMALL)
    assert command(tmp_path, "--seeds", "2").returncode == 0
    more = omnistep.run_study(file, seeds=3, out=results, progress=False)
    assert (len(more), more.computed) == (6, 2) and more.folder == results
    said = command(tmp_path).stdout
    assert "8 runs, 6 of them done before; " in said, said
    whole = omnistep.run_study(file, out=results, progress=False)
    assert (len(whole), whole.computed, whole.failed) == (8, 0, 0)
    assert whole.rows() == omnistep.run_study(file, out=tmp_path / "fresh", progress=False).rows()
    assert [(row["terrain_friction"], row["seed"]) for row in whole.rows()] == [
        (f, s) for f in (0.5, 1.0) for s in range(4)
    ]
    cells = [json.loads(line) for line in command(tmp_path, "--json").stdout.splitlines()]
    assert cells == whole.cells and [cell["runs"] for cell in cells] == [4, 4]


def test_a_built_in_study_goes_to_out_under_its_name_and_tells_of_its_progress(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("omnistep._progress.SHORT_S", 0.0)
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    given = {"overrides": {"duration_s": 0.02}, "seeds": [7]}
    result = omnistep.run_study("ensemble", **given)
    assert (tmp_path / "out" / "ensemble").is_dir() and str(result.folder) == "out/ensemble"
    assert "5/5" in capsys.readouterr().err
    assert "5 runs, 0 failed, 5 computed now" in repr(result)
    assert omnistep.run_study("ensemble", progress=False, **given).computed == 0
    omnistep.run_study("ensemble", progress=False, **{**given, "seeds": [8]})
    assert capsys.readouterr().err == ""


def test_a_damaged_part_is_warned_of_and_computed_again(tmp_path):
    (tmp_path / "small.toml").write_text(SMALL)
    first = omnistep.run_study(tmp_path / "small.toml", out=tmp_path / "results", progress=False)
    (part,) = first.folder.glob("part-*.parquet")
    part.write_bytes(part.read_bytes()[:1000])
    with pytest.warns(UserWarning, match=r"part-\w+\.parquet: cannot be read .* renamed to \.damaged"):
        again = omnistep.run_study(tmp_path / "small.toml", out=tmp_path / "results", progress=False)
    assert again.computed == 8 and again.rows() == first.rows()


def test_a_study_that_cannot_be_is_refused_in_one_line(tmp_path):
    for given, key, expected in [
        ({"study": "stairway"}, "study", "climb_map, ensemble, engines, wheel_models, traction, traction_runup"),
        (
            {"study": "ensemble", "overrides": {"control.policy": "scale_torques"}},
            "control.policy",
            "is an axis of built-in ensemble",
        ),
        ({"study": "ensemble", "overrides": {"terrain.friction": -1}}, "terrain.friction", "-1, allowed: 0 to 2"),
        (
            {"study": "ensemble", "overrides": {"seed": 3}},
            "seed",
            "overrides: seed, allowed: any other key; set the seeds with seeds",
        ),
        ({"study": "ensemble", "seeds": []}, "seeds", r"\[\], allowed: how many"),
        ({"study": "ensemble", "jobs": 1.5}, "jobs", "jobs = 1.5, allowed: a whole number"),
    ]:
        with pytest.raises(omnistep.ConfigError, match=expected) as caught:
            omnistep.run_study(**given, out=tmp_path / "out", progress=False)
        assert caught.value.key == key and "\n" not in str(caught.value)
    assert not (tmp_path / "out").exists()
    (tmp_path / "file").write_text("")
    with pytest.raises(omnistep.StudyError, match="file"):
        omnistep.run_study("ensemble", out=tmp_path / "file", progress=False)


@pytest.fixture
def interrupts():
    """Python's own answer to Ctrl-C, also where the tests run in the background and it was switched off."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


@pytest.mark.usefixtures("interrupts")
def test_ctrl_c_ends_a_study_at_once_and_loses_nothing_that_is_done(tmp_path):
    # A short run for each seed, and one of an hour that is under way when Ctrl-C comes.
    (tmp_path / "small.toml").write_text(
        SMALL.replace('"terrain.friction", values = [0.5, 1]', '"duration_s", values = [0.1, 3600.0]').replace(
            "set.duration_s = 0.1", ""
        )
    )
    folder, pressed, kept = tmp_path / "results", [], []

    def press():
        deadline = time.monotonic() + 120.0
        while not kept and time.monotonic() < deadline:
            kept[:] = [path.name for path in folder.glob("part-*")]
        pressed.append(time.monotonic())
        os.kill(os.getpid(), signal.SIGINT)

    thread = threading.Thread(target=press)
    thread.start()
    with pytest.raises(KeyboardInterrupt):
        omnistep.run_study(tmp_path / "small.toml", out=folder, jobs=2, progress=False)
    # It takes some 60 ms; two seconds allow for a busy machine, hours were asked for.
    assert time.monotonic() - pressed[0] < 2.0
    thread.join()
    rows = duckdb.read_parquet(str(folder / "part-*.parquet")).project("duration_s, error").fetchall()
    assert 1 <= len(rows) <= 4 and set(rows) == {(0.1, None)}
    # The folder is free again, though the exception is still around.
    (tmp_path / "small.toml").write_text(
        SMALL.replace("set.duration_s = 0.1", "").replace(
            '"terrain.friction", values = [0.5, 1]', '"duration_s", values = [0.1]'
        )
    )
    result = omnistep.run_study(tmp_path / "small.toml", out=folder, progress=False)
    assert (len(result), result.computed) == (4, 4 - len(rows))


@pytest.mark.usefixtures("interrupts")
@pytest.mark.parametrize("points", [False, True])
def test_ctrl_c_ends_a_study_that_is_still_being_planned(points, tmp_path):
    # 90 000 scenarios to read and check: minutes.
    grid = {"terrain.friction": [k / 300 for k in range(300)], "command.vx_m_s": [0.1 + k / 1000 for k in range(300)]}
    axes = [f'[[axis]]\nkey = "{key}"\nvalues = {values}\n' for key, values in grid.items()]
    (tmp_path / "large.toml").write_text('schema_version=1\nname="large"\nscenario="flat"\nseeds=1\n' + "".join(axes))
    pressed = []

    def press():
        pressed.append(time.monotonic())
        os.kill(os.getpid(), signal.SIGINT)

    timer = threading.Timer(0.5, press)
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        if points:
            omnistep.sweep(grid, scenario="flat", out=tmp_path / "out", progress=False)
        else:
            omnistep.run_study(tmp_path / "large.toml", out=tmp_path / "out", progress=False)
    # It takes some 60 ms; two seconds allow for a busy machine.
    assert time.monotonic() - pressed[0] < 2.0
    timer.join()
    assert not (tmp_path / "out").exists()


def test_other_threads_go_on_while_a_study_runs(tmp_path):
    (tmp_path / "small.toml").write_text(SMALL)
    ticks, ended = [], threading.Event()

    def tick():
        while not ended.wait(0.001):
            ticks.append(None)

    thread = threading.Thread(target=tick)
    thread.start()
    begun = len(ticks)
    omnistep.run_study(tmp_path / "small.toml", out=tmp_path / "results", jobs=1, progress=False)
    during = len(ticks) - begun
    ended.set()
    thread.join()
    # Eight runs of some 10 ms: a thread that waits 1 ms each time gets many turns, or none if the lock is held.
    assert during > 8
