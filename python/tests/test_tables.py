"""One reader of CSV and Parquet: import, identify and calibrate take the same, and refuse in the same words."""

import numpy as np
import pyarrow
import pyarrow.parquet
import pytest

import omnistep
from omnistep._wheel_logs import read

WHEELS = ("left", "right", "rear")
MAP = (
    'schema_version = 1\nvehicle = "omni3"\nperiod_s = 0.01\n[time]\ncolumn = "time_s"\n[wheels]\nnames = ['
    + ", ".join(f'"wheel_{name}_measured_rad_s"' for name in WHEELS)
    + "]\n"
)


@pytest.fixture
def vehicle():
    made = omnistep.Vehicle("omni3")
    return made.replace({f"wheel.{k}.name": name for k, name in enumerate(WHEELS)})


def text(separator=",", quote="", ending="\n", rows=12):
    """Twelve rows at 10 ms; wheel k has k + row / 10 rad/s. A column of words that was not asked for."""
    names = ["note", "time_s", *(f"wheel_{name}_measured_rad_s" for name in WHEELS)]
    lines = [separator.join(f"{quote}{name}{quote}" for name in names)]
    for row in range(rows):
        cells = ["a", f"{row / 100:.2f}", *(f"{k + row / 10:.1f}" for k in range(3))]
        lines.append(separator.join(cells))
    return ending.join(lines) + ending


@pytest.fixture
def both(tmp_path, vehicle):
    """What identify and calibrate read of a file, and what import makes of it."""
    (tmp_path / "omni.toml").write_text(vehicle.to_toml())
    (tmp_path / "my.toml").write_text(MAP.replace('"omni3"', '"omni.toml"'))

    def taken(data, name="robot.csv"):
        path = tmp_path / name
        path.write_bytes(data.encode() if isinstance(data, str) else data)

        def imported():
            omnistep.import_log(path, map=tmp_path / "my.toml", out=tmp_path / "out.mcap", progress=False)
            return omnistep.read_mcap(tmp_path / "out.mcap").trace.wheels("measured_rad_s")

        return (lambda: read(path, vehicle).measured), imported

    return taken


EXPECTED = np.arange(3) + np.arange(12)[:, None] / 10


@pytest.mark.parametrize(
    "data",
    [
        text(),
        text(quote='"'),
        "\ufeff" + text(),
        "\ufeff" + text(quote='"', ending="\r\n"),
        text(separator=";"),
        text(separator="\t", quote='"'),
        text().replace(",wheel", ", wheel"),
        text().replace("\n", "\n\n").replace("\n\n", "\n", 1),
    ],
    ids=["plain", "quotes", "mark", "mark, quotes and CRLF", "semicolons", "tabs", "spaces", "empty lines"],
)
def test_tables_that_are_taken_are_the_same_for_all(both, data):
    for take in both(data):
        np.testing.assert_array_equal(take(), EXPECTED)


def test_cells_that_are_no_number_are_gaps(both):
    data = text()
    for cell in ("", "nan", "NaN", "null", "NA"):
        # Row 5 of the second wheel.
        ours, imported = both(data.replace("0.5,1.5", f"0.5,{cell}", 1))
        gaps = np.zeros((12, 3), dtype=bool)
        gaps[5, 1] = True
        np.testing.assert_array_equal(np.isnan(ours()), gaps)
        # Between two samples import has the line through them.
        np.testing.assert_allclose(imported(), EXPECTED, rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    ("data", "said"),
    [
        ("", "robot.csv: an empty first line, allowed: the columns' names"),
        (text(rows=0), "robot.csv: no rows, allowed: 1 to 36000000"),
        (
            text().replace("0.5,1.5", "0.5,fast"),
            "robot.csv: line 7, column wheel_right_measured_rad_s: 'fast', allowed: numbers, with a decimal point",
        ),
        (
            text(separator=";").replace("0.5;1.5", "0.5;1,5").replace("\na;0.02", "\n\na;0.02"),
            "robot.csv: line 8, column wheel_right_measured_rad_s: '1,5', allowed: numbers, with a decimal point",
        ),
        (text() + "a,0.12,1\n", "robot.csv: line 14: 3 cells, allowed: 5"),
        (b"\xff\xfe" + text().encode("utf-16-le"), "robot.csv: cannot be read: 'utf-8' codec"),
    ],
    ids=["empty", "no rows", "a word", "a decimal comma", "a short row", "UTF-16"],
)
def test_what_is_wrong_with_a_table_is_said_in_the_same_words(both, data, said):
    for take in both(data):
        with pytest.raises(omnistep.LogError) as refused:
            take()
        assert said in str(refused.value) and "\n" not in str(refused.value)


def test_a_column_that_is_there_twice_is_refused(both):
    ours, imported = both(text().replace("note", "wheel_left_measured_rad_s"))
    with pytest.raises(omnistep.LogError, match=r"robot\.csv: 2 columns wheel_left_measured_rad_s, allowed: one"):
        ours()
    with pytest.raises(omnistep.ConfigError, match="more than one column 'wheel_left_measured_rad_s' in"):
        imported()


def test_parquet_is_taken_by_all(both):
    columns = {"time_s": np.arange(12) / 100, "note": ["a"] * 12}
    columns |= {f"wheel_{name}_measured_rad_s": EXPECTED[:, k] for k, name in enumerate(WHEELS)}
    sink = pyarrow.BufferOutputStream()
    pyarrow.parquet.write_table(pyarrow.table(columns), sink)
    for take in both(sink.getvalue().to_pybytes(), "robot.parquet"):
        np.testing.assert_array_equal(take(), EXPECTED)


MAP_OF_MS = (
    'schema_version = 1\nvehicle = "omni3"\nperiod_s = 0.01\n[time]\ncolumn = "t"\nunit = "ms"\n'
    '[wheels]\nnames = ["a", "b", "c"]\n'
)
#: A serial log by its lines: whether each can be read. An empty line is none, an empty cell is a missing value.
SERIAL = [
    ("0,1,1,1", True), ("", True), ("12,3", False), ("10,2,2,2", True), ("ERR i2c", False), ("20,3,x,3", False),
    ("30,4,4,4", True), (",4,4,4", False), ("40,5,,5", True), ("50,6,6,6,6", False), ("60,+7.0,.7e1,7", True),
]  # fmt: skip


@pytest.mark.parametrize("boot", [[], ["Booting v1.2", "t,a"]])
@pytest.mark.parametrize("bad_first", [0, 2, 5, 7])
def test_lines_that_cannot_be_read_are_left_out_and_counted_if_asked_for(tmp_path, boot, bad_first):
    lines = [line for k, line in enumerate(SERIAL) if line[1] or k >= bad_first]
    text = "\n".join([*boot, "t,a,b,c", *(line for line, _ in lines)]) + "\n"
    (tmp_path / "robot.csv").write_text(text)
    (tmp_path / "my.toml").write_text(MAP_OF_MS)
    where = {"map": tmp_path / "my.toml", "out": tmp_path / "robot.mcap", "progress": False}
    with pytest.raises(omnistep.LogError, match=r"; or --skip-bad-lines$"):
        omnistep.import_log(tmp_path / "robot.csv", **where)
    summary = omnistep.import_log(tmp_path / "robot.csv", **where, skip_bad_lines=True)
    numbers = [len(boot) + 2 + k for k, (_, good) in enumerate(lines) if not good]
    count, first = len(boot) + len(numbers), 1 if boot else numbers[0]
    assert (summary.skipped.count, summary.skipped.first) == (count, first)
    said = "1 line is" if count == 1 else f"{count} lines are"
    assert f"{said} left out, the first is line {first} (--skip-bad-lines)" in str(summary)
    wheels = omnistep.read_mcap(tmp_path / "robot.mcap").trace.wheels("measured_rad_s")
    # Between 10 and 30 ms it is linear; of the second wheel 5 is missing.
    assert wheels[:7, 0].tolist() == pytest.approx([1, 2, 3, 4, 5, 6, 7])
    assert wheels[[0, 1, 3, 6], 1].tolist() == pytest.approx([1, 2, 4, 7])


def test_a_whole_file_is_the_same_with_and_without_bad_lines_left_out(tmp_path):
    rows = [f"{1_700_000_000_000 + 10 * k},{k},{2 * k},{-k}" for k in range(50)]
    (tmp_path / "robot.csv").write_text("\n".join(["t,a,b,c", *rows]))
    (tmp_path / "my.toml").write_text(MAP_OF_MS)
    read = []
    for skip in (False, True):
        where = {"map": tmp_path / "my.toml", "out": tmp_path / f"{skip}.mcap", "progress": False}
        summary = omnistep.import_log(tmp_path / "robot.csv", **where, skip_bad_lines=skip)
        read.append(omnistep.read_mcap(tmp_path / f"{skip}.mcap").trace.wheels("measured_rad_s"))
    assert np.array_equal(*read, equal_nan=True)
    assert summary.skipped.count == 0 and "no line is left out" in str(summary)
