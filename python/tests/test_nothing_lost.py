"""Runs side by side, pages that cannot be written, results with a flipped bit."""

import os
import resource
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

import omnistep
from omnistep import report
from omnistep._columns import columns
from omnistep._omnistep import damage


def until_grown(part, process, size=1):
    begun = time.monotonic()
    while not part.exists() or part.stat().st_size < size:
        assert process.poll() is None and time.monotonic() - begun < 120, "the log grows"
        time.sleep(0.01)


def test_a_log_of_another_program_is_refused_and_a_killed_one_blocks_nothing(tmp_path):
    path = tmp_path / "x.mcap"
    code = f"import omnistep; omnistep.run('flat', overrides={{'duration_s': 3600}}, mcap={str(path)!r})"
    with subprocess.Popen([sys.executable, "-c", code]) as other:
        until_grown(tmp_path / "x.mcap.part", other)
        with pytest.raises(omnistep.LogError, match=r"x\.mcap: is being written by another run: wait") as caught:
            omnistep.run("flat", overrides={"duration_s": 0.1}, mcap=path)
        assert caught.value.file == str(path)
        assert other.poll() is None
        other.kill()
    omnistep.run("flat", overrides={"duration_s": 0.1}, mcap=path)
    assert omnistep.read_mcap(path).complete and list(tmp_path.iterdir()) == [path]


def test_of_threads_with_one_log_each_has_it_or_is_refused(tmp_path):
    path = tmp_path / "x.mcap"

    def run(friction):
        try:
            omnistep.run("flat", overrides={"duration_s": 0.2, "terrain.friction": friction}, mcap=path)
        except omnistep.LogError as error:
            assert "is being written by another run" in str(error)
            return None
        return friction

    for _ in range(5):
        with ThreadPoolExecutor(4) as pool:
            wrote = set(pool.map(run, [0.5, 0.6, 0.7, 0.8])) - {None}
        log = omnistep.read_mcap(path)
        friction = omnistep.Scenario.from_toml(log.scenario_toml).to_dict()["terrain"]["friction"]
        assert log.complete and friction in wrote
        assert list(tmp_path.iterdir()) == [path]


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    path = tmp_path_factory.mktemp("log") / "x.mcap"
    omnistep.run("flat", overrides={"duration_s": 0.2}, mcap=path)
    return path


def test_a_page_that_cannot_be_written_leaves_the_one_that_was_there(log, tmp_path):
    page = tmp_path / "report.html"
    page.write_text("the old page")
    # As a full disk: no file may be larger. Python has the signal ignored.
    _, hard = limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, hard))
    try:
        with pytest.raises(OSError, match="too large") as caught:
            report.write([log], page)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert caught.value.filename == str(page)
    assert page.read_text() == "the old page" and list(tmp_path.iterdir()) == [page]
    report.write([log], page)
    assert page.read_text().startswith("<!doctype html>") and list(tmp_path.iterdir()) == [page]


def test_a_page_replaces_a_link_and_does_not_follow_it(log, tmp_path):
    victim, page = tmp_path / "victim", tmp_path / "report.html"
    victim.write_text("precious")
    page.symlink_to(victim)
    report.write([log], page)
    assert victim.read_text() == "precious" and not page.is_symlink() and page.is_file()
    umask = os.umask(0)
    os.umask(umask)
    assert page.stat().st_mode & 0o777 == 0o666 & ~umask


def test_a_page_shows_a_log_whose_name_is_no_utf_8(log, tmp_path):
    # As of another machine: in Latin-1. Python has such a name with surrogates, which no page can hold.
    other = tmp_path / os.fsdecode(b"caf\xe9.mcap")
    try:
        other.write_bytes(log.read_bytes())
    except OSError:
        pytest.skip("this file system has no such names")
    page = tmp_path / "report.html"
    report.write([log, other], page)
    assert "<td>caf\ufffd.mcap</td>" in page.read_text(encoding="utf-8")


@pytest.mark.parametrize("place", [60, 400, -100])
def test_results_with_a_flipped_bit_are_not_shown(tmp_path, place):
    grid = {"terrain.friction": [0.5, 0.9]}

    def sweep():
        # One job: rows stand in the order in which runs end.
        return omnistep.sweep(
            grid, scenario="flat", overrides={"duration_s": 0.1}, out=tmp_path, jobs=1, progress=False
        )

    sweep()
    (part,) = tmp_path.glob("part-*.parquet")
    assert damage(part) is None
    assert columns(tmp_path, {"terrain_friction": "x"}) == {"terrain_friction": [0.5, 0.9]}
    whole = part.read_bytes()
    bad = bytearray(whole)
    bad[place] ^= 1
    part.write_bytes(bad)
    for rows in (tmp_path, part):
        with pytest.raises(omnistep.ConfigError, match="its SHA-256 checksum is wrong") as caught:
            columns(rows, {"terrain_friction": "x"})
        assert caught.value.file == str(part) and "\n" not in str(caught.value)
    with pytest.warns(UserWarning, match="renamed to .damaged"):
        again = sweep()
    (fresh,) = tmp_path.glob("part-*.parquet")
    assert again.computed == 2 and fresh.read_bytes() == whole


@pytest.mark.parametrize("reader", ["pyarrow", "polars", "duckdb"])
def test_other_readers_read_past_the_checksum(tmp_path, reader):
    import duckdb
    import polars
    import pyarrow.parquet

    grid = {"terrain.friction": [0.5, 0.9]}

    def sweep():
        # One job: rows stand in the order in which runs end.
        return omnistep.sweep(
            grid, scenario="flat", overrides={"duration_s": 0.1}, out=tmp_path, jobs=1, progress=False
        )

    sweep()
    (part,) = tmp_path.glob("part-*.parquet")
    read = {
        "pyarrow": lambda: pyarrow.parquet.read_table(part)["terrain_friction"].to_pylist(),
        "polars": lambda: polars.read_parquet(part)["terrain_friction"].to_list(),
        "duckdb": lambda: [row[0] for row in duckdb.read_parquet(str(part)).project("terrain_friction").fetchall()],
    }
    assert sorted(read[reader]()) == [0.5, 0.9]


def test_ctrl_c_of_the_command_line_names_the_unfinished_log(tmp_path):
    command = [sys.executable, "-m", "omnistep", "run", "step", "--quiet", "--set", "duration_s=3600"]
    with subprocess.Popen(command, cwd=tmp_path, stderr=subprocess.PIPE, text=True) as process:
        part = tmp_path / "out" / "step-traction.mcap.part"
        until_grown(part, process, 300_000)
        process.send_signal(signal.SIGINT)
        _, said = process.communicate()
    assert process.returncode == 130
    log = omnistep.read_mcap(part)
    end = f"{len(log.trace) * 1e6 * 1e-9:.2f}"  # nanoseconds, as the program has it: it decides how halves are rounded
    assert said == f"stopped: the run ended at {end} s of 3600 s; its log until then is out/{part.name}\n"


def test_a_folder_whose_name_is_no_utf_8_is_written_to(tmp_path):
    folder = os.fsencode(tmp_path) + b"/b\xff"
    command = [sys.executable, "-m", "omnistep", "run", "flat", "--quiet", "--set", "duration_s=0.1", "--out", folder]
    done = subprocess.run(command, capture_output=True, check=True)
    log = folder + b"/flat-traction.mcap"
    assert done.stdout.endswith(log + b"\n")
    assert omnistep.read_mcap(Path(os.fsdecode(log))).complete
    refused = subprocess.run([*command, "--json"], capture_output=True, check=False)
    assert refused.returncode == 2 and not refused.stdout and b"with --json, a folder" in refused.stderr
    # And a page of it, in it.
    page = folder + b"/x.html"
    command = [sys.executable, "-m", "omnistep", "report", log, "-o", page]
    done = subprocess.run(command, capture_output=True, check=True)
    assert done.stdout == page + b"\n" and Path(os.fsdecode(page)).stat().st_size > 1_000_000
