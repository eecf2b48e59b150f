"""Tables of measurements in: what is known comes out as it was measured, and gaps stay gaps."""

import sys

import numpy as np
import pyarrow
import pyarrow.parquet
import pytest

import omnistep
from omnistep.__main__ import main
from omnistep._log_map import KINDS, read_map
from omnistep._resampling import _ascending

HEAD = 'schema_version = 1\nvehicle = "omni3"\nperiod_s = 0.01\n'
TIME = '[time]\ncolumn = "t"\n'
WHEELS = '[wheels]\nnames = ["a", "b", "c"]\n'
ROWS = "t,a,b,c\n0,1,2,3\n0.01,1,2,3\n0.02,1,2,3\n0.03,1,2,3\n"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def imported(folder, table, keys, *, name="robot.csv"):
    """The log of a table, as a text or as columns."""
    if isinstance(table, str):
        (folder / name).write_text(table)
    (folder / "my.toml").write_text(keys)
    summary = omnistep.import_log(folder / name, map=folder / "my.toml", out=folder / "robot.mcap")
    return summary, omnistep.read_mcap(folder / "robot.mcap")


def command_line(monkeypatch, capfd, *arguments):
    """Exit code, and the lines on standard output and standard error."""
    monkeypatch.setattr(sys, "argv", ["omnistep", *(str(each) for each in arguments)])
    try:
        code = main()
    except SystemExit as ended:
        code = ended.code
    said = capfd.readouterr()
    return code, said.out, said.err


@pytest.fixture(scope="module")
def round_trip(tmp_path_factory, curve, recorded):
    """A run, its robot's table, and what became of that."""
    folder = tmp_path_factory.mktemp("round")
    recorded.write_csv(folder / "robot.csv", recorded.columns(curve))
    summary, log = imported(folder, None, recorded.MAP)
    return summary, log


def test_velocities_of_jittering_counts_are_within_a_count_and_a_gap_is_nan(round_trip, curve, recorded):
    summary, log = round_trip
    assert log.recorded and log.complete and log.outcome is None and log.trace.policy == "recorded"
    assert len(log.trace) == summary.rows == len(curve)
    # Rows begin with the first sample: the same times as the run's. Whole nanoseconds, as seconds.
    assert np.allclose(log.trace["time_s"], curve["time_s"], atol=1e-9, rtol=0)
    measured = log.trace.wheels("measured_rad_s")
    # Each position is floored to a count, between two samples too: their difference is off by less than one. What a
    # straight line between samples leaves out is the acceleration times a period squared: a thousandth of a count.
    count = 2 * np.pi / recorded.COUNTS_PER_TURN / recorded.PERIOD_S
    off = np.abs(measured - curve.wheels("measured_rad_s"))
    assert np.nanmax(off) < 1.001 * count
    # The angles themselves are there too, right within a count.
    angles = np.column_stack([log.trace[f"sensed_wheel_rad_{name}"] for name in log.trace.wheel_names])
    turned = np.cumsum(curve.wheels("measured_rad_s") * recorded.PERIOD_S, axis=0)
    assert np.nanmax(np.abs(angles - angles[0] - (turned - turned[0]))) < 1.001 * count * recorded.PERIOD_S
    assert np.array_equal(
        np.isnan(angles[1:]).any(axis=1) | np.isnan(angles[:-1]).any(axis=1), np.isnan(measured[1:, 0])
    )
    # The position is unknown before the first sample and in the gap; times jitter by less than a period.
    unknown = np.flatnonzero(np.isnan(measured).any(axis=1))
    assert unknown[0] == 0
    inside = np.arange(recorded.GAP.start, recorded.GAP.stop)
    assert set(inside) <= set(unknown[1:]) <= set(range(inside[0] - 1, inside[-1] + 3))
    assert np.isnan(measured[unknown[1:]]).all(), "the wheels are read together"


def test_the_summary_says_rate_gap_and_what_was_left_out(round_trip):
    summary, log = round_trip
    wheels = [each for each in summary.signals if each.signal == "wheels"]
    for each in wheels:
        assert (each.samples, each.gaps, each.missing, each.unordered, each.beyond) == (1800, 1, 0, 0, 0)
        # 200 samples are not there; their neighbours jitter by a fifth of a period each.
        assert each.longest_gap_s == each.gaps_s == pytest.approx(0.201, abs=4e-4)
        # The median of 1799 distances that are a period give or take two fifths of one.
        assert each.rate_hz == pytest.approx(1000.0, rel=0.02)
    # Commands hold for ever by the map, so theirs is no gap.
    assert [each.gaps for each in summary.signals if each.signal == "command"] == [0, 0, 0]
    assert "count_1" in str(summary) and log.run["import"] == str(summary)
    assert log.run["source"] == "robot.csv" and log.run["map"] == "my.toml"


def test_commands_hold_currents_become_torques_and_poses_are_of_the_end_of_a_period(round_trip, curve):
    _, log = round_trip
    asked = log.trace["asked_wz_rad_s"]
    # A row's command was sent within a period of its start: on the ramp of 0.3 s a period is 0.001 rad/s.
    assert np.abs(asked - curve["command_wz_rad_s"]).max() <= 1.001e-3
    known = np.isfinite(log.trace.wheels("torque_n_m")[:, 0])
    # Between two samples torques bend: by their second difference at most.
    torques = curve.wheels("torque_n_m")
    bend = np.abs(np.diff(torques, 2, axis=0)).max()
    assert np.abs(log.trace.wheels("torque_n_m") - torques)[known].max() <= bend
    for name in ("pose_x_m", "pose_y_m", "pose_yaw_rad"):
        off = np.abs(log.trace[name] - curve[name])
        # 0.4 m/s and 0.3 rad/s at most, a straight line over some periods: micrometres.
        assert np.nanmax(off) < 1e-5, name
    assert np.isnan(log.trace["common_factor"]).all() and np.isnan(log.trace.wheels("saturated")).all()


def test_odometry_comes_from_the_counts_and_the_turns_in_a_gap_are_not_lost(round_trip, curve):
    _, log = round_trip
    gap = np.flatnonzero(np.isnan(log.trace.wheels("measured_rad_s")[:, 0]))
    behind = np.arange(gap[-1] + 2, len(log.trace) - 1)
    assert gap.size > 100 and behind.size > 100
    # The robot's counts are of 4096 a turn at times that jitter by a fifth of a period: what a wheel turns in
    # that and a count, once each, is below a millimetre; on the plane the wheels roll within half a millimetre.
    for name, bound in (("x_m", 2e-3), ("y_m", 2e-3), ("yaw_rad", 1e-2)):
        off = log.trace[f"odom_{name}"] - curve[f"pose_{name}"]
        assert np.abs(off[behind]).max() < bound, name
    # In the gap the position is unknown, and it stays where it was.
    assert np.ptp(log.trace["odom_x_m"][gap[1:-2]]) == 0.0


def test_frames_are_where_the_vehicle_was_observed(round_trip, monkeypatch, tmp_path):
    _, log = round_trip
    at = np.rint(log.frame_time_s / 0.001).astype(int) - 1
    base = log.frames["base_link"]
    assert np.array_equal(base[:, 0], log.trace["pose_x_m"][at]) and np.isfinite(base).all()
    # The frame of odometry is where both began, up to what odometry is off.
    assert np.abs(log.frames["odom"][:, :2]).max() < 5e-3
    assert set(log.frames) == {"base_link", "odom", "wheel_1", "wheel_2", "wheel_3"}
    out = tmp_path / "report.html"
    monkeypatch.setattr(sys, "argv", ["omnistep", "report", str(log.path), "-o", str(out)])
    assert main() == 0
    text = out.read_text()
    # It has no outcome; what the import said is there to be opened, and nothing of it runs.
    assert "<span>recorded</span></td>" in text and "<summary>import</summary><pre tabindex=0>" in text


def test_odometry_is_where_the_vehicle_was_first_seen(folder):
    # It is observed from 30 ms on, at (5, 5) and looking to the left; by then it has gone 0.02 m.
    rows = "t,a,b,c,x,y,h\n" + "".join(
        f"{k / 100},1,1,1,{5 if k > 3 else ''},{5 if k > 3 else ''},{1.5 if k > 3 else ''}\n" for k in range(10)
    )
    keys = '[pose]\nnames = ["x", "y", "h"]\n'
    _, log = imported(folder, rows, HEAD + TIME + WHEELS + keys)
    trace = log.trace
    first = int(np.flatnonzero(np.isfinite(trace["pose_x_m"]))[0])
    assert first == 3  # it ends at 40 ms
    for name in ("x_m", "y_m", "yaw_rad"):
        assert trace[f"odom_{name}"][first] == pytest.approx(trace[f"pose_{name}"][first], abs=1e-12)
    # The wheels of omni3 all turn alike: on the spot, at 1 rad/s of wheels of 50 mm around 0.18 m.
    assert np.diff(trace["odom_yaw_rad"]) == pytest.approx(0.01 * 0.05 / 0.18, rel=1e-3)
    assert np.allclose(trace["odom_x_m"], 5.0, atol=1e-9)


def test_the_scenario_inside_runs_with_the_recorded_command(round_trip, curve):
    _, log = round_trip
    again = omnistep.run(omnistep.Scenario.from_toml(log.scenario_toml))
    assert len(again) == len(curve)
    # The command is the recorded one, a period late at most.
    assert np.abs(again["command_vx_m_s"] - curve["command_vx_m_s"]).max() <= 1.001e-3


def test_values_between_samples_are_on_the_line_and_none_beyond_the_largest_gap(folder):
    rows = "t,a,b,c\n0,0,0,0\n0.02,2,0,0\n0.04,4,0,0\n0.14,9,0,0\n0.16,11,0,0\n"
    _, log = imported(folder, rows, HEAD + TIME + WHEELS)
    nan = np.nan
    # 3 times the median distance, 0.02 s, is less than 0.1 s.
    expected = [0, 1, 2, 3, 4, *[nan] * 9, 9, 10, 11]
    assert np.allclose(log.trace.wheels("measured_rad_s")[:, 0], expected, equal_nan=True, atol=1e-12)
    _, log = imported(folder, rows, HEAD + "max_gap_s = 0.1\n" + TIME + WHEELS)
    bridged = log.trace.wheels("measured_rad_s")[:, 0]
    assert np.allclose(bridged[4:15], np.linspace(4, 9, 11))


def test_units_signs_offsets_gears_and_sides_of_a_gear(folder):
    rows = "t,a,b,c\n" + "".join(f"{k / 100},60,60,65\n" for k in range(4))
    vehicle = omnistep.Vehicle("omni3", overrides={"wheel.0.gear": 0.5})
    (folder / "geared.toml").write_text(vehicle.to_toml())
    head = HEAD.replace('"omni3"', '"geared.toml"')
    keys = 'unit = "rpm"\nscale = [1, -1, 1]\noffset = [0, 0, 5]\nat = "wheel"\n'
    _, log = imported(folder, rows, head + TIME + WHEELS + keys)
    turn = 2 * np.pi
    # The actuator turns twice as fast as its wheel.
    assert np.allclose(log.trace.wheels("measured_rad_s"), [2 * turn, -turn, turn])
    keys = '[torques]\nnames = ["a", "b", "c"]\nunit = "A"\nn_m_per_a = 0.1\nat = "wheel"\n'
    _, log = imported(folder, rows, head + TIME + WHEELS + keys)
    assert np.allclose(log.trace.wheels("torque_n_m"), [3.0, 6.0, 6.5])


def test_a_parquet_file_is_the_same_as_its_csv(folder, curve, recorded):
    table = recorded.columns(curve)
    recorded.write_csv(folder / "robot.csv", table)
    pyarrow.parquet.write_table(pyarrow.table(table), folder / "robot.parquet")
    _, one = imported(folder, None, recorded.MAP)
    one = one.trace.to_numpy().copy()
    _, other = imported(folder, None, recorded.MAP, name="robot.parquet")
    assert np.array_equal(one, other.trace.to_numpy(), equal_nan=True)


def test_whole_nanoseconds_since_1970_and_time_stamps_keep_every_digit(folder):
    start = 1_790_000_000_123_456_789
    times = start + 10_000_000 * np.arange(4)
    wheels = {name: [0.0, 1.0, 2.0, 3.0] for name in "abc"}
    for column, unit in ((times, 'unit = "ns"\n'), (pyarrow.array(times, pyarrow.timestamp("ns")), "")):
        pyarrow.parquet.write_table(pyarrow.table({"t": column, **wheels}), folder / "robot.parquet")
        _, log = imported(folder, None, HEAD + TIME + unit + WHEELS, name="robot.parquet")
        # A double of that size is off by 128 ns: 1.28e-5 of the way between two samples.
        assert np.array_equal(log.trace.wheels("measured_rad_s")[:, 0], [0.0, 1.0, 2.0, 3.0])


def test_late_doubled_and_empty_samples_are_left_out_and_counted(folder):
    rows = "t,a,b,c\n0,0,0,0\n0.01,1,,0\n0.01,7,1,0\n0.02,2,2,inf\n0.015,7,7,0\n0.03,3,3,0\n"
    summary, log = imported(folder, rows, HEAD + TIME + WHEELS)
    # Of each column by itself: without b the next row is its first of that time; where c is infinite none is late.
    assert [(each.missing, each.unordered) for each in summary.signals] == [(0, 2), (1, 1), (1, 1)]
    assert np.allclose(log.trace.wheels("measured_rad_s")[:, 0], [0, 1, 2, 3])
    assert np.allclose(log.trace.wheels("measured_rad_s")[:, 1], [0, 1, 2, 3])


def test_one_sample_that_is_ahead_costs_itself_and_not_those_after_it(folder):
    times = 0.01 * np.arange(300)
    times[100] += 0.5
    rows = "t,a,b,c\n" + "".join(f"{t:.3f},{k},1,1\n" for k, t in enumerate(times))
    summary, log = imported(folder, rows, HEAD + TIME + WHEELS)
    assert [(each.samples, each.unordered, each.gaps) for each in summary.signals] == [(299, 1, 0)] * 3
    # On the line over the one that is not there.
    assert np.allclose(log.trace.wheels("measured_rad_s")[:, 0], np.arange(300), atol=1e-9)


def test_as_few_samples_are_left_out_as_that_takes():
    rng = np.random.default_rng(2)
    for _ in range(300):
        times = rng.integers(0, 9, rng.integers(0, 9))
        kept = times[_ascending(times)]
        assert (np.diff(kept) > 0).all()
        subsets = (times[[bool(bits >> k & 1) for k in range(times.size)]] for bits in range(2**times.size))
        assert kept.size == max(each.size for each in subsets if (np.diff(each) > 0).all()), times


def test_a_command_beyond_the_range_is_reported_by_the_names_of_the_log(folder):
    rows = "t,a,b,c,vx,vy,wz\n" + "".join(f"{k / 100},1,1,1,{1e6 if k == 50 else 0.2},0,0\n" for k in range(100))
    keys = HEAD + TIME + WHEELS + '[command]\nnames = ["vx", "vy", "wz"]\n'
    said = "robot.csv: command, vx: 1e[+]06 m/s at 0.5 s of the new log, allowed: -100 to 100"
    with pytest.raises(omnistep.LogError, match=said):
        imported(folder, rows, keys)


def test_changes_of_a_command_that_have_no_room_are_reported(folder, monkeypatch):
    rows = "t,a,b,c,vx,vy,wz\n" + "".join(f"{k / 100},1,1,1,{k / 100},0,0\n" for k in range(30))
    keys = HEAD + TIME + WHEELS + '[command]\nnames = ["vx", "vy", "wz"]\n'
    summary, _ = imported(folder, rows, keys)
    assert summary.commands_left_out == 0 and "lacks" not in str(summary)
    for module in ("recordings", "_recorded_command"):
        monkeypatch.setattr(f"omnistep.{module}.MOST_COMMANDS", 10)
    summary, log = imported(folder, rows, keys)
    # Every third of 30.
    assert summary.commands_left_out == 20
    assert "the scenario in the log lacks 20 changes of the command: it can hold 10" in str(summary)
    assert np.allclose(log.trace["asked_vx_m_s"], np.arange(30) / 100)


def test_names_of_files_in_capitals(folder):
    summary, _ = imported(folder, ROWS, HEAD + TIME + WHEELS, name="ROBOT.CSV")
    assert summary.rows == 4


def test_a_parquet_column_of_text_is_refused_before_it_is_unpacked(folder, monkeypatch):
    columns = {"t": [0.0, 0.01], "a": ["1", "2"], "b": [1.0, 2.0], "c": [1.0, 2.0]}
    pyarrow.parquet.write_table(pyarrow.table(columns), folder / "robot.parquet")

    class Closed(pyarrow.parquet.ParquetFile):
        def iter_batches(self, *_, **__):
            raise AssertionError("was unpacked")

    monkeypatch.setattr(pyarrow.parquet, "ParquetFile", Closed)
    with pytest.raises(omnistep.LogError, match=r"robot.parquet: column a: of type string, allowed: numbers"):
        imported(folder, None, HEAD + TIME + WHEELS, name="robot.parquet")


@pytest.mark.parametrize("vehicle", ["omni3", "chugo7"])
def test_a_new_map_is_one_as_it_is_and_with_every_table_in_it(folder, monkeypatch, capfd, vehicle):
    code, out, err = command_line(monkeypatch, capfd, "new", "import-map", "mine", "--vehicle", vehicle)
    assert (code, err) == (0, "") and out.startswith(f"mine.toml: an import map for {vehicle}; ")
    assert set(read_map("mine.toml").signals) == {"wheels"}
    lines = (folder / "mine.toml").read_text().splitlines(keepends=True)
    first = next(number for number, line in enumerate(lines) if line.startswith("schema_version"))
    text = "".join(lines[:first] + [line.removeprefix("# ") for line in lines[first:]])
    (folder / "whole.toml").write_text(text)
    lacks = {"hinges", "hinge_rates"} if vehicle == "omni3" else set()
    assert set(read_map("whole.toml").signals) == set(KINDS) - lacks
    assert read_map("whole.toml").signals["wheels"].wrap == 2.0**16


def test_info_and_replay_take_a_recording_and_say_what_it_lacks(round_trip, monkeypatch, capfd, recorded):
    _, log = round_trip
    code, out, err = command_line(monkeypatch, capfd, "info", log.path)
    assert (code, err) == (0, "") and "recorded, imported from robot.csv, vehicle omni3" in out
    code, out, err = command_line(monkeypatch, capfd, "replay", log.path)
    unknown = int(np.isnan(log.trace.wheels("measured_rad_s")).any(axis=1).sum())
    known = int(np.isfinite(log.trace.wheels("torque_n_m")[:, 0]).sum())
    assert code == 0, err
    assert f"it has torques in {known}, no command in 0, no velocity of some wheel in {unknown}" in out
    assert out.count("N.m") == 3 and "NaN" not in out


CURRENT = '[torques]\nnames = ["a", "b", "c"]\nunit = "A"\n'
BAD = [
    (ROWS, "", "my.toml: schema_version: missing, allowed: 1"),
    (ROWS, HEAD + TIME + WHEELS + "[gyros]\n", "my.toml: gyros: unknown key (did you mean gyro?)"),
    (ROWS, HEAD + TIME + WHEELS + "wrap = 3\n", "my.toml: wheels.wrap: unknown key (did you mean wrap_bits?)"),
    (ROWS, HEAD.replace("0.01", "0"), "my.toml: period_s: 0, allowed: 1e-06 to 0.1"),
    (ROWS, HEAD.replace("0.01", "nan"), "my.toml: period_s: nan, allowed: 1e-06 to 0.1"),
    (ROWS, HEAD.replace("omni3", "omni33"), 'my.toml: unknown vehicle "omni33"'),
    (ROWS, HEAD + TIME, "my.toml: wheels: missing, allowed: a table [wheels]"),
    (ROWS, HEAD + WHEELS, "my.toml: time.column: missing, allowed: a column of robot.csv"),
    (ROWS, HEAD + TIME.replace('"t"', '"tt"') + WHEELS, "my.toml: time.column: no column 'tt' in robot.csv"),
    (
        ROWS,
        HEAD + TIME + WHEELS.replace('"a", ', ""),
        "my.toml: wheels.names: 2 names, allowed: 3, one each of 1, 2, 3",
    ),
    (
        ROWS,
        HEAD + TIME + WHEELS.replace('"a", "b"', '"a", "a"'),
        "my.toml: wheels.names: 'a' twice, allowed: each name once",
    ),
    (ROWS, HEAD + TIME + WHEELS + 'unit = "rmp"\n', "my.toml: wheels.unit: 'rmp', allowed: rad/s, deg/s, rpm"),
    (
        ROWS,
        HEAD + TIME + WHEELS + 'unit = "count"\n',
        "my.toml: wheels.counts_per_turn: missing, allowed: a number with",
    ),
    (ROWS, HEAD + TIME + WHEELS + "wrap_bits = 16\n", "my.toml: wheels.wrap_bits: 16, allowed: a whole number"),
    (ROWS, HEAD + TIME + WHEELS + "scale = [1, 2]\n", "my.toml: wheels.scale: 2 numbers, allowed: one, or 3"),
    (ROWS, HEAD + TIME + WHEELS + f"scale = 1{'0' * 400}\n", "my.toml: wheels.scale: 1000"),
    (ROWS, HEAD + TIME + WHEELS + "offset = nan\n", "my.toml: wheels.offset: nan, allowed: a number"),
    (
        ROWS.replace("0.03", "3000"),
        HEAD.replace("0.01", "1e-6") + TIME + WHEELS,
        "my.toml: period_s: 1e-06: 3000000001 con",
    ),
    (ROWS, HEAD + TIME + WHEELS + "scale = 0\n", "my.toml: wheels.scale: 0, allowed: other numbers"),
    (ROWS, HEAD + TIME + WHEELS + 'topic = "/a"\n', "my.toml: wheels.topic: '/a': robot.csv is a table, allowed: none"),
    (ROWS, HEAD + TIME + WHEELS + CURRENT, "my.toml: torques.n_m_per_a: missing, allowed: a number with unit"),
    (ROWS, HEAD + TIME + "from_s = 9\n" + WHEELS, "robot.csv: -8.97 s, allowed: 0.01 to 3600 s"),
    (ROWS, "schema_version = [", "my.toml: not TOML: "),
    (ROWS, "period_s = 0x" + "f" * 5000, "my.toml: period_s: a whole number of 20000 bits, allowed: up to 8192"),
    (ROWS.replace("3\n0.02", "x\n0.02"), HEAD + TIME + WHEELS, "robot.csv: line 3, column c: 'x', allowed: numbers"),
    (
        ROWS.replace("0.02", ""),
        HEAD + TIME + WHEELS,
        "robot.csv: column t: 1 empty cells, allowed: a time in every row",
    ),
    (ROWS.replace("0.02", "nan"), HEAD + TIME + WHEELS, "robot.csv: column t: "),
    (ROWS.replace("0.02", "noon"), HEAD + TIME + WHEELS, "robot.csv: column t: of type string, allowed: numbers"),
    (ROWS + "0.04,1,2\n", HEAD + TIME + WHEELS, "robot.csv: line 6: 3 cells, allowed: 4, as in the first line"),
    (
        ROWS.replace("\n0.01", "\n7200"),
        HEAD + TIME + WHEELS,
        "robot.csv: column t: time goes back by 7199.98 s in row 3, from 7200 to 0.02 s, allowed: 1 s at most; cut",
    ),
    (ROWS + "4e9,1,2,3\n", HEAD + TIME + WHEELS, "robot.csv: column t: times 4e+09 s apart, allowed: 1e+07 s"),
    (ROWS + "1e6,1,2,3\n", HEAD + TIME + WHEELS, "robot.csv: 1e+06 s, allowed: 0.01 to 3600 s"),
    ("", HEAD + TIME + WHEELS, "robot.csv: an empty first line"),
    (
        ROWS.split("\n", 1)[1],
        HEAD + TIME + WHEELS,
        "robot.csv: the first line has numbers, allowed: the columns' names",
    ),
    ("t,a,b,c\n", HEAD + TIME + WHEELS, "robot.csv: no rows, allowed: 1 to 36000000"),
    ("t,a,b,c\n1,,,\n", HEAD + TIME + WHEELS, "robot.csv: no velocity of any wheel, allowed: at least two samples"),
    ("t,a,a,b,c\n1,1,1,1,1\n", HEAD + TIME + WHEELS, "my.toml: wheels.names: more than one column 'a'"),
    ("\x00" * 100, HEAD + TIME + WHEELS, "no column 't'"),
]


@pytest.mark.parametrize(("rows", "keys", "said"), BAD, ids=range(len(BAD)))
def test_what_is_wrong_with_a_table_or_its_map_is_one_line_and_exit_code_2(
    folder, monkeypatch, capfd, rows, keys, said
):
    (folder / "robot.csv").write_text(rows)
    (folder / "my.toml").write_text(keys)
    code, out, err = command_line(monkeypatch, capfd, "import", "robot.csv", "--map", "my.toml")
    assert (code, out) == (2, "") and err.count("\n") == 1, err
    assert said in err, err
    assert not (folder / "robot.mcap").exists()


def test_counts_beyond_their_counter_are_refused(folder, monkeypatch, capfd):
    (folder / "robot.csv").write_text(ROWS.replace("0.02,1", "0.02,70000"))
    (folder / "my.toml").write_text(HEAD + TIME + WHEELS + 'unit = "count"\ncounts_per_turn = 64\nwrap_bits = 16\n')
    code, _, err = command_line(monkeypatch, capfd, "import", "robot.csv", "--map", "my.toml")
    assert code == 2 and "a: counts from 1 to 70000, allowed: fewer than 2^wrap_bits = 65536" in err


def test_files_that_are_none_and_broken_ones(folder, monkeypatch, capfd):
    (folder / "my.toml").write_text(HEAD + TIME + WHEELS)
    (folder / "torn.parquet").write_bytes(b"PAR1" + bytes(40) + b"PAR1")
    (folder / "robot.txt").write_text("")
    (folder / "robot.csv").write_text(ROWS)
    (folder / "folder.csv").mkdir()
    (folder / "old.bag").write_bytes(b"#ROSBAG V2.0\n" + bytes(4096))
    for name, said in (
        ("nothing.csv", "nothing.csv: no such file or folder"),
        ("robto.csv", 'robto.csv (did you mean "robot.csv"?): no such file or folder'),
        ("robot.txt", "robot.txt: not a log that can be read, allowed: a regular file .csv, .parquet, .mcap or .db3"),
        ("old.bag", "old.bag: a bag of ROS 1, allowed: a rosbag2, by rosbags-convert"),
        ("torn.parquet", "torn.parquet: cannot be read: "),
        ("folder.csv", "folder.csv: not a regular file"),
    ):
        code, out, err = command_line(monkeypatch, capfd, "import", name, "--map", "my.toml")
        assert (code, out) == (2, "") and err.count("\n") == 1 and said in err, (name, err)
    for name, said in (
        ("no.toml", "no.toml: no such file"),
        ("my.tml", 'my.tml (did you mean "my.toml"?): no such file'),
        (".", ".: not a regular file"),
    ):
        code, out, err = command_line(monkeypatch, capfd, "import", "robot.csv", "--map", name)
        assert (code, out) == (2, "") and err.count("\n") == 1 and said in err, (name, err)
    code, _, err = command_line(monkeypatch, capfd, "import", "robot.csv", "--map", "my.toml", "-o", "robot.csv")
    assert code == 2 and "this command reads this file, allowed: another name" in err


def test_a_reader_that_is_not_installed_is_named_with_its_extra(folder, monkeypatch, capfd):
    (folder / "robot.csv").write_text(ROWS)
    (folder / "robot.mcap").write_text("")
    (folder / "my.toml").write_text(HEAD + TIME + WHEELS)
    (folder / "bag.toml").write_text(HEAD + WHEELS + 'topic = "/joint_states"\n')
    for package, log, keys in (("pyarrow", "robot.csv", "my.toml"), ("rosbags", "robot.mcap", "bag.toml")):
        with monkeypatch.context() as without:
            without.setitem(sys.modules, package, None)
            without.setitem(sys.modules, f"{package}.highlevel", None)
            code, _, err = command_line(without, capfd, "import", log, "--map", keys, "-o", "out.mcap")
        assert code == 2 and err == f'error: omnistep import needs {package}: pip install "omnistep[import]"\n'
