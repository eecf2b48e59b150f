"""Maps of studies: every cell is what its rows say, whatever holds them."""

import re
import subprocess
import sys

import duckdb
import matplotlib.pyplot as plt
import pandas as pd
import polars as pl
import pyarrow as pa
import pytest

import omnistep

STUDY = """
schema_version = 1
name = "small"
scenario = "step"
seeds = 1

[[axis]]
key = "terrain.height_m"
values = [0.02, 0.09]

[[axis]]
key = "control.policy"
values = ["scale_torques", "independent"]
"""
X, Y, PANEL = "vehicle_motor_stall_torque_n_m", "terrain_height_m", "control_policy"


@pytest.fixture(autouse=True)
def close_figures():
    yield
    plt.close("all")


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """The folder of a study of four runs."""
    folder = tmp_path_factory.mktemp("study")
    (folder / "small.toml").write_text(STUDY)
    command = [sys.executable, "-m", "omnistep", "study", "small.toml", "--out", "results"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=folder)
    assert (done.returncode, done.stderr) == (0, "")
    return folder / "results"


def rows():
    """Two seeds a cell: both climb up to 1 m of height a N.m of torque, one up to 1.5; one run failed."""
    made = []
    for policy in ("scale_references", "independent"):
        for torque in (2.0, 1.0):
            for height in (1.0, 1.5, 3.0):
                for seed in (0, 1):
                    row = {X: torque, Y: height, PANEL: policy, "seed": seed, "error": None}
                    row["climbed"] = height <= torque * (1.0 if seed else 1.5)
                    made.append(row)
    made[1] |= {"climbed": None, "error": "the physics left the finite numbers"}  # scale_references, 2 N.m, 1 m
    return made


def cells(ax):
    """Return what the cells say, but for the intervals."""
    return [re.sub(r"\n\d+-\d+ %", "", text.get_text()) for text in ax.texts]


def test_runs_that_were_cut_off_are_no_stalls_but_hatched_and_counted_apart():
    def cell(torque, *verdicts):
        made = [{X: torque, Y: 1.0, "climbed": verdict == "climbed", "verdict": verdict} for verdict in verdicts]
        return [row | {"seed": seed, "error": None} for seed, row in enumerate(made)]

    cut, stalls = ["unfinished"] * 2, ["stalled"] * 2
    made = (
        cell(0.5, *stalls) + cell(1.0, *cut) + cell(1.5, "climbed", *cut, "stalled") + cell(2.0, "climbed", "climbed")
    )
    (ax,) = omnistep.plot.climb_map(made, panel=None)
    assert cells(ax) == ["0/2", "0/2\n2 unfinished", "1/4\n2 unfinished", "2/2"]
    # The colour is the share of those that came to an end: none is known in the second cell.
    (mesh,) = ax.collections
    assert mesh.get_array().mask.ravel().tolist() == [False, True, False, False]
    assert mesh.get_array().compressed().tolist() == [0.0, 0.5, 1.0]
    hatched = [(patch.get_x(), patch.get_height(), patch.get_hatch()) for patch in ax.patches]
    assert hatched == [(1, 1.0, "///"), (2, 0.5, "///")]
    # Rows without verdicts give the map as it was.
    for row in made:
        del row["verdict"]
    (ax,) = omnistep.plot.climb_map(made, panel=None)
    assert cells(ax) == ["0/2", "0/2", "1/4", "2/2"] and not ax.patches


def test_every_cell_is_the_count_of_its_rows_and_its_colour_the_share():
    axes = omnistep.plot.climb_map(rows())
    assert [ax.get_title() for ax in axes] == ["independent: climbed / runs", "scale_references: climbed / runs"]
    # Rows from the lowest height, columns from the smallest torque: 1 N.m, 2 N.m.
    assert cells(axes[0]) == ["2/2", "2/2", "1/2", "2/2", "0/2", "1/2"]
    assert cells(axes[1]) == ["2/2", "1/1\n1 failed", "1/2", "2/2", "0/2", "1/2"]
    (mesh,) = axes[0].collections
    assert mesh.get_array().ravel().tolist() == [1.0, 1.0, 0.5, 1.0, 0.0, 0.5]
    assert mesh.get_clim() == (0.0, 1.0) and mesh.get_cmap().name == "cividis"
    # A cell's text is in its middle, where its ticks are.
    places = [text.get_position() for text in axes[0].texts]
    assert places[:3] == [(0.5, 0.5), (1.5, 0.5), (0.5, 1.5)]
    assert axes[0].get_xticks().tolist() == [0.5, 1.5]
    assert [tick.get_text() for tick in axes[0].get_xticklabels()] == ["1", "2"]
    assert [tick.get_text() for tick in axes[0].get_yticklabels()] == ["1", "1.5", "3"]
    assert axes[0].get_xlabel() == "vehicle motor stall torque [N.m]" and axes[0].get_ylabel() == "terrain height [m]"


def test_a_cell_of_several_runs_says_the_interval_of_its_share():
    (ax,) = omnistep.plot.climb_map([row for row in rows() if row[PANEL] == "scale_references"], panel=None)
    # Wilson's score with z = 1.96: (p + z^2/2n -+ z sqrt(p(1-p)/n + z^2/4n^2)) / (1 + z^2/n). One run has no interval.
    both, one, none = "2/2\n34-100 %", "1/2\n9-91 %", "0/2\n0-66 %"
    assert [text.get_text() for text in ax.texts] == [both, "1/1\n1 failed", one, both, none, one]


def test_a_cell_without_a_run_is_bare():
    (ax,) = omnistep.plot.climb_map([row for row in rows() if row[PANEL] == "independent"][:-2])
    assert cells(ax) == ["2/2", "2/2", "1/2", "2/2", "-", "1/2"]
    assert ax.collections[0].get_array().mask.ravel().tolist() == [False] * 4 + [True, False]


def test_any_column_may_be_an_axis_or_a_panel_and_axes_given_are_drawn_on():
    _, given = plt.subplots(3)
    axes = omnistep.plot.climb_map(rows(), x="seed", y="control.policy", panel="terrain.height_m", axes=given)
    assert all(a is b for a, b in zip(axes, given, strict=True))
    assert [ax.get_title().split(":")[0] for ax in axes] == ["1", "1.5", "3"]
    assert [tick.get_text() for tick in axes[0].get_yticklabels()] == ["independent", "scale_references"]
    assert cells(axes[1]) == ["2/2", "1/2", "2/2", "1/2"]
    (whole,) = omnistep.plot.climb_map(rows(), panel=None)
    assert cells(whole) == ["4/4", "3/3\n1 failed", "2/4", "4/4", "0/4", "2/4"]


@pytest.mark.parametrize(
    "table",
    [
        pl.DataFrame,
        lambda made: pl.DataFrame(made).lazy(),
        pd.DataFrame,
        lambda made: pd.DataFrame(made).convert_dtypes(),
        pa.Table.from_pylist,
        lambda made: duckdb.from_arrow(pa.Table.from_pylist(made)),
        lambda made: {name: [row[name] for row in made] for name in made[0]},
    ],
    ids=["polars", "polars-lazy", "pandas", "pandas-nullable", "pyarrow", "duckdb", "columns"],
)
def test_every_table_gives_the_map_that_its_rows_give(table):
    expected = [cells(ax) for ax in omnistep.plot.climb_map(rows())]
    assert [cells(ax) for ax in omnistep.plot.climb_map(table(rows()))] == expected


def test_a_relation_of_duckdb_is_asked_once_as_it_may_answer_in_another_order():
    asked = []

    class Relation:
        columns = tuple(rows()[0])

        def select(self, wanted):
            asked.append(wanted)
            made = rows() if len(asked) == 1 else rows()[::-1]
            names = [name.strip('"') for name in wanted.split(", ")]
            return type("Answer", (), {"fetchall": lambda _: [tuple(row[name] for name in names) for row in made]})()

        def fetchall(self):
            raise AssertionError("every column of a study was asked for")

    expected = [cells(ax) for ax in omnistep.plot.climb_map(rows())]
    assert [cells(ax) for ax in omnistep.plot.climb_map(Relation())] == expected
    assert len(asked) == 1


def test_the_result_of_a_study_gives_the_map_of_its_folder(study):
    small = study.parent / "small.toml"
    result = omnistep.run_study(small, out=study, progress=False)
    assert (len(result), result.computed) == (4, 0)
    (ax,) = omnistep.plot.climb_map(result, x="control.policy", panel=None)
    assert cells(ax) == ["1/1", "1/1", "0/1", "0/1"]
    (of_folder,) = omnistep.plot.climb_map(study, x="control.policy", panel=None)
    assert cells(of_folder) == cells(ax)


@pytest.mark.parametrize("reader", ["pyarrow", "polars", "duckdb"])
def test_every_reader_reads_what_a_study_wrote(study, reader, monkeypatch):
    for other in {"pyarrow": "pyarrow.dataset", "polars": "polars", "duckdb": "duckdb"}.items():
        if other[0] != reader:
            monkeypatch.setitem(sys.modules, other[1], None)
    (ax,) = omnistep.plot.climb_map(study, x="control.policy", panel=None)
    # 2 cm is climbed; 9 cm is more than the wheel's radius.
    assert cells(ax) == ["1/1", "1/1", "0/1", "0/1"]
    assert [tick.get_text() for tick in ax.get_xticklabels()] == ["independent", "scale_torques"]
    parts = [str(part) for part in study.glob("*.parquet")]
    maps = [omnistep.plot.climb_map(part, x="control.policy", panel=None)[0] for part in parts]
    assert sorted(cell for ax in maps for cell in cells(ax) if cell != "-") == ["0/1", "0/1", "1/1", "1/1"]


def test_no_reader_is_one_line(study, monkeypatch):
    for name in ("pyarrow.dataset", "polars", "duckdb"):
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(ImportError, match="Parquet needs pyarrow, polars or duckdb: pip install pyarrow"):
        omnistep.plot.climb_map(study, x="control.policy", panel=None)


def test_wrong_requests_are_one_line(tmp_path):
    (tmp_path / "part.parquet").write_text("no Parquet")
    (tmp_path / "empty").mkdir()
    without = [{name: value for name, value in row.items() if name != "climbed"} for row in rows()]
    cases = {
        "y: no column 'terrain_hight_m', nearest: terrain_height_m": (rows(), {"y": "terrain.hight_m"}),
        "rows: no column 'climbed', there are: vehicle_motor": (without, {}),
        "allowed: a different column for each": (rows(), {"y": X}),
        r"rows\[0\]: climbed = 0.5, allowed: true, false": ([row | {"climbed": 0.5} for row in rows()], {}),
        r"rows\[3\]: no terrain_height_m": ([*rows()[:3], rows()[0] | {Y: None}], {}),
        "rows: none, allowed: at least one": (pl.DataFrame(rows()).clear(), {}),
        "none, allowed: at least one": ([], {}),
        "rows: a int, allowed: a StudyResult, the folder": (7, {}),
        "nowhere: no such file or folder": (tmp_path / "nowhere", {}),
        r"empty: no \*.parquet in it": (tmp_path / "empty", {}),
        "not Parquet: ": (tmp_path, {}),
        "axes = 3 axes, allowed: 2": (rows(), {"axes": plt.subplots(3)[1]}),
    }
    for message, (given, options) in cases.items():
        with pytest.raises(omnistep.ConfigError, match=message) as caught:
            omnistep.plot.climb_map(given, **options)
        assert "\n" not in str(caught.value) and caught.value.key
