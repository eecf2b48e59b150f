"""Sweeps: the same rows wherever they are computed, nothing lost with a worker, exactly what is missing afterwards."""

import contextlib
import io
import json
import multiprocessing
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path

import duckdb
import numpy as np
import pandas as pd
import polars as pl
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

import omnistep

ROOT = Path(__file__).resolve().parents[2]
SHORT = {"duration_s": 0.2, "perturbation.yaw_rad": 0.05}
FRICTION = "terrain.friction"


def short(points, **more):
    return omnistep.sweep(points, scenario="flat", overrides=SHORT, progress=False, **more)


def keys_in(folder):
    """The keys of all rows in a folder, also of parts that still grow."""
    keys = []
    for part in [*Path(folder).glob("part-*.growing"), *Path(folder).glob("part-*.parquet")]:
        # One that becomes whole in between is read under its next name.
        with contextlib.suppress(FileNotFoundError):
            keys += pq.read_table(io.BytesIO(part.read_bytes()), columns=["key"])["key"].to_pylist()
    return keys


class Here(Executor):
    """Computes in the caller's thread and remembers the key of every run that it was asked for."""

    def __init__(self):
        self.keys, self.sizes = [], []

    def submit(self, fn, /, *args):
        """Compute at once, after a pickle and back as for another process."""
        fn, args = pickle.loads(pickle.dumps((fn, args)))
        self.keys += [run["key"] for run in json.loads(args[0])["runs"]]
        self.sizes.append(len(pickle.dumps(args)))
        future = Future()
        try:
            future.set_result(fn(*self.changed(*args)))
        except Exception as error:
            future.set_exception(error)
        return future

    def changed(self, *args):
        """Return the arguments as they arrive."""
        return args


def test_a_dictionary_of_lists_is_a_grid_and_points_need_none(tmp_path):
    grid = {"control.policy": ["scale_torques", "independent"], FRICTION: [0.5, 0.9]}
    rows = short(grid, out=tmp_path / "grid", seeds=[3, 1]).rows()
    assert short(grid, out=tmp_path / "grid", seeds=range(1, 4, 2)).computed == 0
    got = [(row["control_policy"], row["terrain_friction"], row["seed"]) for row in rows]
    assert got == [(p, friction, seed) for p in grid["control.policy"] for friction in (0.5, 0.9) for seed in (3, 1)]

    own = omnistep.run("flat", overrides=SHORT)
    rows = short([{FRICTION: 0.5}, {"control.policy": "scale_torques"}], out=tmp_path / "list").rows()
    listed = [(row["terrain_friction"], row["control_policy"]) for row in rows]
    assert listed == [(0.5, own.policy), (own.terrain["friction"], "scale_torques")] and own.terrain["friction"] != 0.5
    metrics = omnistep.run("flat", overrides={**SHORT, FRICTION: 0.5}).outcome.to_dict()
    # Metrics that were not measured are NaN in one and null in the other.
    assert {name: rows[0][name] for name in metrics} == {n: None if v != v else v for n, v in metrics.items()}


def test_processes_give_the_rows_that_this_process_gives(tmp_path):
    points = [{FRICTION: friction} for friction in (0.5, 0.7, 0.9)]
    alone = short(points, out=tmp_path / "alone", seeds=4)
    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
        shared = short(points, out=tmp_path / "shared", seeds=4, executor=pool, batch=5)
    assert alone.rows() == shared.rows() and len(shared) == 12
    assert (alone.computed, shared.computed, shared.failed) == (12, 12, 0)
    assert len({row["slip_rms"] for row in shared.rows()}) >= 4, "seeds differ"
    # Five runs a batch and a part a batch: 5, 5, 2.
    assert len(list((tmp_path / "shared").glob("part-*.parquet"))) == 3


def test_what_goes_to_a_worker_is_small_and_a_sweep_that_grows_computes_what_is_new(tmp_path):
    here = Here()
    first = short([{FRICTION: 0.5}], out=tmp_path, seeds=32, executor=here, batch=16)
    # What runs share, a scenario with its vehicle, goes once: another run adds its key, its seed and its axes.
    short([{FRICTION: 0.5}], out=tmp_path / "one", seeds=1, executor=(one := Here()))
    assert len(here.sizes) == 2 and max(here.sizes) - one.sizes[0] < 15 * 200 < one.sizes[0]
    assert len(set(here.keys)) == 32 and set(here.keys) == {row["key"] for row in first.rows()}
    again = Here()
    more = short([{FRICTION: 0.7}, {FRICTION: 0.5}], out=tmp_path, seeds=33, executor=again)
    assert len(set(again.keys)) == len(again.keys) == more.computed == 34 and not set(again.keys) & set(here.keys)
    assert short([{FRICTION: 0.5}], out=tmp_path, seeds=32, executor=(third := Here())).computed == 0 == len(third.keys)


def test_a_killed_worker_loses_no_row_and_going_on_computes_what_is_missing(tmp_path):
    points, seen = [{FRICTION: friction} for friction in (0.5, 0.7, 0.9)], []

    def kill():
        # Rows of two workers, each within a batch of 15.
        deadline = time.monotonic() + 120.0
        while len(seen) < 10 and time.monotonic() < deadline:
            seen[:] = keys_in(tmp_path)
        os.kill(multiprocessing.active_children()[0].pid, signal.SIGKILL)

    with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
        pool.submit(int).result()
        killer = threading.Thread(target=kill)
        killer.start()
        with pytest.raises(BrokenProcessPool) as caught:
            short(points, out=tmp_path, seeds=20, executor=pool, batch=15)
        killer.join()
    assert any("the same call continues from there" in note for note in caught.value.__notes__)
    kept = keys_in(tmp_path)
    assert 10 <= len(seen) <= len(kept) < 60 and set(seen) <= set(kept)

    here = Here()
    result = short(points, out=tmp_path, seeds=20, executor=here)
    every = {row["key"] for row in result.rows()}
    assert len(every) == 60 == len(result)
    assert sorted(here.keys) == sorted(every - set(kept)), "each missing run once, and no other"
    assert result.computed == 60 - len(kept)
    assert sorted(keys_in(tmp_path)) == sorted(every), "no row twice"
    rows = duckdb.read_parquet(str(tmp_path / "*.parquet")).project("key").fetchall()
    assert sorted(key for (key,) in rows) == sorted(every), "for any reader"


def test_a_run_that_fails_on_a_worker_is_a_row_with_its_error(tmp_path):
    # A motor so strong, under a gain so high, that it tears the vehicle apart at once.
    points = {"vehicle.motor.stall_torque_n_m": [2.0, 1e6]}
    more = {"scenario": "flat", "progress": False, "seeds": 2, "out": tmp_path}
    overrides = {**SHORT, "vehicle.gains.kp_n_m_s_rad": 1e6, "physics.engine": "rapier"}
    result = omnistep.sweep(points, overrides=overrides, executor=Here(), **more)
    assert [row["error"] is None for row in result.rows()] == [True, True, False, False]
    assert all("a joint separated at t = " in row["error"] for row in result.rows()[2:])
    assert result.failed == 2 and [cell["errors"] for cell in result.cells] == [0, 2]
    assert omnistep.sweep(points, overrides=overrides, **more).computed == 0
    assert omnistep.sweep(points, overrides=overrides, retry_errors=True, **more).computed == 2


def test_counts_may_be_numpys(tmp_path):
    grid = {FRICTION: np.array([0.5, 0.9])}
    result = short(grid, out=tmp_path, seeds=np.int64(2), jobs=np.int64(2), executor=Here(), batch=np.int64(3))
    assert (len(result), len(list(tmp_path.glob("part-*.parquet")))) == (4, 2)
    assert short(grid, out=tmp_path, seeds=np.int64(3), jobs=np.int64(1)).computed == 2


def test_two_workers_with_the_same_batch_keep_each_others_rows(tmp_path):
    class Twice(Here):
        def submit(self, fn, /, *args):
            futures = []
            both = [threading.Thread(target=lambda: futures.append(Here.submit(self, fn, *args))) for _ in range(2)]
            for thread in both:
                thread.start()
            for thread in both:
                thread.join()
            for future in futures:
                assert future.exception() is None
            return futures[0]

    result = short({FRICTION: [0.5, 0.9]}, out=tmp_path, seeds=6, executor=Twice(), batch=12)
    assert len(result) == 12 and sorted(keys_in(tmp_path)) == sorted(row["key"] for row in result.rows())


def test_a_vehicle_that_a_point_does_not_replace_is_a_column_with_its_name(tmp_path):
    rows = short([{}, {"vehicle": "rocker_bogie6"}], out=tmp_path).rows()
    assert [row["vehicle"] for row in rows] == [omnistep.Scenario("flat").vehicle.name, "rocker_bogie6"]


def test_workers_that_do_not_see_the_folder_are_noticed(tmp_path):
    class Elsewhere(Here):
        def changed(self, batch, folder, jobs, own):
            return batch, str(tmp_path / "elsewhere"), jobs, own

    class Idle(Here):
        def submit(self, fn, /, *args):
            future = Future()
            future.set_result((1, 0))
            return future

    with pytest.raises(omnistep.ConfigError, match="every worker must see the same folder") as caught:
        short([{}], out=tmp_path / "here", executor=Elsewhere())
    assert caught.value.key == "out"
    with pytest.raises(omnistep.StudyError, match="here: 1 computed rows are missing"):
        short([{}], out=tmp_path / "here", executor=Idle())
    assert not (tmp_path / "elsewhere").exists()


def test_any_data_frame_takes_the_rows_with_their_types(tmp_path):
    result = short({FRICTION: [0.5, 0.9]}, out=tmp_path, seeds=2)
    types = {"key": pa.string(), "seed": pa.int64(), "terrain_friction": pa.float64(), "climbed": pa.bool_()}
    types |= {"slip_rms": pa.float64(), "crossing_s": pa.float64(), "error": pa.string()}
    table = result.to_arrow()
    assert table.column_names == result.names and {name: table.schema.field(name).type for name in types} == types
    assert table.to_pylist() == result.rows() and table["crossing_s"].null_count == 4
    frame = result.to_polars()
    assert isinstance(frame, pl.DataFrame) and frame.to_dicts() == result.rows()
    frame = result.to_pandas()
    assert isinstance(frame, pd.DataFrame) and frame["slip_rms"].tolist() == [row["slip_rms"] for row in result.rows()]
    assert [str(frame[name].dtype) for name in ("seed", "climbed", "crossing_s")] == ["Int64", "boolean", "float64"]
    stored = duckdb.read_parquet(str(tmp_path / "part-*.parquet"))
    assert sorted(stored.project("key, slip_rms").fetchall()) == sorted(
        (r["key"], r["slip_rms"]) for r in result.rows()
    )


@pytest.mark.parametrize(
    ("points", "more", "expected", "key"),
    [
        ([{}, {FRICTION: -1}], {}, r"points\[1\]: built-in flat: terrain\.friction: -1, allowed", FRICTION),
        ({"terrain.frictoin": [1]}, {}, "unknown field `frictoin` .did you mean `friction`", "terrain.frictoin"),
        ([{FRICTION: 0.5}, {FRICTION: 0.5}], {}, r"points\[0\] and points\[1\] are the same run", "points"),
        ([{"seed": 1}], {}, "set the seeds with `seeds`", "points"),
        ([], {}, "none, allowed: one or more", "points"),
        ({FRICTION: []}, {}, "none, allowed: one or more", "points"),
        ({}, {}, "none, allowed: one or more", "points"),
        ({FRICTION: range(1000), "vx": range(101)}, {}, "points: 101000, allowed: 100000 at most", "points"),
        ([{}] * 100_001, {}, "points: 100001, allowed: 100000 at most", "points"),
        ([{"no": 1}] * 11, {"seeds": 100_000}, "seeds: 100000 for 11 combinations, allowed: 1000000 runs", "seeds"),
        ([{}], {"overrides": {"seed": 3}}, "overrides: seed, allowed: any other key; set the seeds with seeds", "seed"),
        ([{"duration_s": 1.0}], {}, "duration_s is also replaced by points", "duration_s"),
        ([{"control.policy": "scale_torques"}], {"policy": "scale_torques"}, "policy: control", "control.policy"),
        ([{}], {"seeds": 0}, "seeds: 0, allowed: how many, 1 to", "seeds"),
        ([{}], {"seeds": [1, 1]}, "seeds: 1, allowed", "seeds"),
        ([{}], {"jobs": 0}, "jobs = 0, allowed", "jobs"),
        ([{}], {"jobs": True}, "jobs = True, allowed: a whole number", "jobs"),
        ([{}], {"jobs": np.float64(2)}, r"jobs = np\.float64\(2\.0\), allowed: a whole number", "jobs"),
        ([{}], {"batch": -1}, "batch = -1, allowed", "batch"),
    ],
)
def test_bad_points_are_refused_in_one_line_and_nothing_is_written(points, more, expected, key, tmp_path):
    with pytest.raises(omnistep.ConfigError, match=expected) as caught:
        omnistep.sweep(points, **{"scenario": "flat", "overrides": SHORT, "out": tmp_path / "out", **more})
    assert caught.value.key == key and "\n" not in str(caught.value)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("points", ["step", 3, {FRICTION: 0.5}, {FRICTION: "0.5"}, [0.5]])
def test_points_of_the_wrong_kind_are_type_errors(points, tmp_path):
    with pytest.raises(TypeError, match=r"^points.*allowed: a (list|dictionary)"):
        short(points, out=tmp_path)


def test_a_folder_of_another_sweep_is_refused_and_stays_as_it_is(tmp_path):
    short([{FRICTION: 0.5}], out=tmp_path)
    before = keys_in(tmp_path)
    with pytest.raises(omnistep.ConfigError, match=r"holds results with .*use another folder$") as caught:
        short([{"control.policy": "scale_torques"}], out=tmp_path)
    assert caught.value.key == "out" and keys_in(tmp_path) == before


def test_the_example_queries_its_sweep_with_duckdb(tmp_path):
    example = [sys.executable, str(ROOT / "python/examples/climb_map.py"), "--out", str(tmp_path / "map")]
    done = subprocess.run([*example, "--seeds", "1"], capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    table = done.stdout.splitlines()
    assert "policy" in table[0] and len(table) == 2 + 2 * 3, done.stdout
    share = {tuple(line.split()[:2]): line.split()[2] for line in table[2:]}
    # 1 N.m stalls, 2.2 N.m climbs: with a wide margin on either side of the threshold, 1.4 to 1.8 (docs/validation.md).
    assert {share[policy, "1.0"] for policy in ("independent", "scale_references")} == {"0%"}, done.stdout
    assert {share[policy, "2.2"] for policy in ("independent", "scale_references")} == {"100%"}, done.stdout


def test_what_no_key_can_hold_is_named_with_its_point(tmp_path):
    with pytest.raises(TypeError, match=r"points\[1\]: .*terrain\.friction: .*allowed: a number"):
        short([{FRICTION: 0.5}, {FRICTION: None}], out=tmp_path)
