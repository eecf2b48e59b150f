"""A sweep on a dask cluster of two worker processes, one of which is killed. Run by scripts/test-full.sh."""

import contextlib
import importlib.util
import io
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pyarrow.parquet as pq
import pytest

import omnistep

if importlib.util.find_spec("distributed") is None:
    pytest.skip('needs dask: pip install "omnistep[dask]"', allow_module_level=True)

# What dask and its dependencies deprecate is not ours to mend.
pytestmark = pytest.mark.filterwarnings("default")

SHORT = {"duration_s": 0.3, "perturbation.yaw_rad": 0.05}
POINTS = {"terrain.friction": [0.5, 0.7, 0.9]}


@pytest.fixture(scope="module")
def client():
    from dask.distributed import Client, LocalCluster

    cluster = LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None)
    with cluster, Client(cluster) as client:
        yield client


def rows_in(folder):
    rows = []
    for part in [*Path(folder).glob("part-*.growing"), *Path(folder).glob("part-*.parquet")]:
        # One that becomes whole in between is read under its next name.
        with contextlib.suppress(FileNotFoundError):
            table = pq.read_table(io.BytesIO(part.read_bytes()), columns=["key", "slip_rms"])
            rows += [tuple(row.values()) for row in table.to_pylist()]
    return rows


def sweep(**more):
    return omnistep.sweep(POINTS, scenario="flat", overrides=SHORT, seeds=20, progress=False, **more)


def test_a_dask_worker_that_is_killed_loses_no_row_and_its_batch_goes_on_elsewhere(client, tmp_path):
    alone = sweep(out=tmp_path / "alone")
    killed, seen = [], []

    def kill():
        pids = client.run(os.getpid)
        deadline = time.monotonic() + 120.0
        while len(seen) < 10 and time.monotonic() < deadline:
            seen[:] = rows_in(tmp_path / "shared")
        killed.append(next(iter(pids.values())))
        os.kill(killed[0], signal.SIGKILL)

    killer = threading.Thread(target=kill)
    killer.start()
    shared = sweep(out=tmp_path / "shared", executor=client.get_executor(pure=False), batch=15)
    killer.join()
    assert killed and 10 <= len(seen) < 60
    assert shared.rows() == alone.rows() and (len(shared), shared.computed, shared.failed) == (60, 60, 0)
    # A part for each of the four batches: the batch that was begun twice went on in its own.
    assert len(list((tmp_path / "shared").glob("part-*.parquet"))) == 4
    rows = rows_in(tmp_path / "shared")
    assert len(rows) == len(set(rows)) == 60 and set(seen) <= set(rows)
    assert sweep(out=tmp_path / "shared", executor=client.get_executor(pure=False)).computed == 0


def test_the_page_s_dask_block_runs_as_it_is(tmp_path):
    page = (Path(__file__).resolve().parents[2] / "docs/scale-out.md").read_text(encoding="utf-8")
    code = [block.split("```")[0] for block in page.split("```python\n")[1:] if "dask" in block.split("```")[0]]
    assert len(code) == 1
    (tmp_path / "block.py").write_text(code[0])
    done = subprocess.run([sys.executable, "block.py"], capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
