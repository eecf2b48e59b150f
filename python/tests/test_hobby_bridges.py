"""Identification from PWM of bridges that brake or coast at zero duty: what it doubts, when it gives no interval."""

import importlib.util
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import omnistep
from omnistep import _identify_cli, identification
from omnistep._measurement_noise import implied_rad_s, shown_rad_s
from omnistep._wheel_logs import read

SPEC = importlib.util.spec_from_file_location("hobby_plant", Path(__file__).with_name("hobby_plant.py"))
plant = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(plant)

KNOWN = {"mass_kg": plant.TRUTH["mass_kg"], "wheel_inertia_kg_m2": plant.TRUTH["wheel_inertia_kg_m2"]}
#: What duty cycles tell, and how near. Counts, and commands that change between rows, leave less than half of that.
WITHIN = {
    "stall_torque_n_m": 0.015,
    "slope_n_m_s_rad": 0.015,
    "gear_friction_n_m": 0.05,
    "yaw_inertia_kg_m2": 0.08,
}
CASES = [(zero, seed) for zero in ("brake", "coast") for seed in (0, 1)]


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("hobby")
    return {(zero, seed): plant.written(folder, seed, zero) for zero, seed in CASES}


@pytest.fixture(scope="module")
def found(logs):
    return {case: omnistep.identify(log, vehicle=plant.file(), fix=KNOWN, progress=False) for case, log in logs.items()}


@pytest.mark.parametrize("case", CASES)
def test_motor_and_friction_are_found_and_the_bridge_is_named(found, case):
    result, zero = found[case], case[0]
    assert result.zero_duty == zero
    for name, within in WITHIN.items():
        assert result[name].value == pytest.approx(plant.TRUTH[name], rel=within), name
    (line,) = [line for line in result.undetermined if line.startswith("zero duty:")]
    assert f'results are those of "{zero}"' in line
    # Viscous friction brakes always, as a motor does that its bridge shorts: the other way round nothing does.
    assert ("about equally" in line) == (zero == "brake")
    # Single counts over the 0.1 s of the comparison are 0.8 % of these speeds.
    assert result.simulation.off < 0.025
    assert not [line for line in result.undetermined if line.startswith(("doubtful", "no interval"))]
    assert not result.doubted


def test_intervals_hold_the_truth(found):
    inside = [
        result[name].low <= plant.TRUTH[name] <= result[name].high for result in found.values() for name in WITHIN
    ]
    # Of 16 independent ones with 95 % more than three are outside in one of 140 cases.
    assert len(inside) == 16 and sum(inside) >= 13


@pytest.fixture(scope="module")
def wrong(logs):
    return omnistep.identify(logs["coast", 0], vehicle=plant.file(), fix=KNOWN, zero_duty="brake", progress=False)


def test_the_wrong_bridge_gives_no_interval_and_says_why(wrong):
    assert wrong.zero_duty == "brake"
    assert not any(each.determined for each in wrong.estimates)
    (line,) = [line for line in wrong.undetermined if line.startswith("no interval is given")]
    assert "bridges at zero duty" in line
    # Wheels that roll on are braked in the model.
    assert wrong.simulation.off > 0.25
    assert f"the log's speeds are off by {100 * wrong.simulation.off:.2g} %" in wrong.table()
    rows = [row.split() for row in wrong.table().splitlines()]
    assert [row[2] for row in rows if row[0] == "stall_torque_n_m"] == ["none"]


def test_bridges_that_coast_within_each_period_have_no_line(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    log = plant.written(tmp_path, 0, "chops")
    known = [f"--fix={name}={value}" for name, value in KNOWN.items()]
    asked = [str(log), "--vehicle", "hobby.toml", *known, "--quiet", "-o", "found.toml"]
    assert _identify_cli.identify(asked) == 1 and not (tmp_path / "found.toml").exists()
    said = capsys.readouterr()
    (line,) = [line for line in said.out.splitlines() if line.startswith("no interval is given: ")]
    assert "no line of the motor fits, as speed is not linear in the duty cycle" in line and "slow decay" in line
    # By its line the motor would turn at 46 rad/s without load, where it has 16. With such bridges speeds are off by a
    # third of that; diodes, which let no current flow back, are not in the model.
    line_off, chopped_off = (float(part) for part in re.findall(r"by (\d+) %", line))
    assert line_off > 30.0 and chopped_off < 0.5 * line_off
    assert (
        said.err.startswith("error: found.toml: not written: no line of the motor fits") and said.err.count("\n") == 1
    )
    rows = [row.split() for row in said.out.splitlines()]
    assert [row[2] for row in rows if row[:1] == ["slope_n_m_s_rad"]] == ["none"]
    assert not any(row[:2] == ["zero", "duty:"] for row in rows)


def test_what_is_far_from_the_file_is_doubted(logs):
    kg_cm = plant.file(stall_torque_n_m=16.0)
    result = omnistep.identify(logs["coast", 1], vehicle=kg_cm, fix=KNOWN, zero_duty="coast", progress=False)
    (line,) = [line for line in result.undetermined if line.startswith("doubtful")]
    assert "stall_torque_n_m is 1.6 N.m, 1/10 of the file's 16" in line


def test_a_late_log_is_doubted(logs):
    columns = {**omnistep.read_mcap(logs["brake", 0]).trace.columns()}
    # Commands of 15 rows of 10 ms before the others.
    for wheel in plant.file().wheel_names:
        columns[f"wheel_{wheel}_duty"] = np.roll(columns.pop(f"commanded_duty_{wheel}"), -15)
    early = omnistep.identify(columns, vehicle=plant.file(), fix=KNOWN, zero_duty="brake", progress=False)
    # The plant's delay and lag, less a row in which commands change.
    assert early["delay_s"].value == pytest.approx(0.15, abs=0.012)
    assert any(line.startswith("doubtful: delay_s is 0.1") for line in early.undetermined)


def test_the_map_says_what_bridges_do_and_the_log_keeps_it(tmp_path):
    log = plant.written(tmp_path, 2, "coast", 'zero = "coast"\n')
    assert read(log, plant.file()).zero_duty == "coast"
    result = omnistep.identify(log, vehicle=plant.file(), fix=KNOWN, progress=False)
    assert result.zero_duty == "coast"
    assert not [line for line in result.undetermined if line.startswith("zero duty:")]
    text = (tmp_path / "map.toml").read_text()
    for given in ('"off"', "0", "[]"):
        (tmp_path / "map.toml").write_text(text.replace('zero = "coast"', f"zero = {given}"))
        with pytest.raises(omnistep.ConfigError, match=r'map\.toml: duty\.zero: .*, allowed: "brake" or "coast"$'):
            omnistep.import_log(tmp_path / "coast_2.csv", map=tmp_path / "map.toml", out=tmp_path / "no.mcap")
    with pytest.raises(omnistep.ConfigError, match='zero_duty: \'off\', allowed: "brake" or "coast"'):
        omnistep.identify(log, vehicle=plant.file(), zero_duty="off", progress=False)


def test_noise_is_shown_and_implied_in_the_same_unit():
    rng = np.random.default_rng(4)
    rows, period = 4, 0.005
    speed = 5.0 + 2.0 * np.sin(0.5 * period * np.arange(20000))[:, None] * np.ones(3)
    # Angles that are each wrong by 2 mrad, and a walk of 1 mrad a row: their velocities.
    angle = 2e-3 * rng.standard_normal((20000, 3)) + np.cumsum(1e-3 * rng.standard_normal((20000, 3)), axis=0)
    noise = np.diff(angle, axis=0, prepend=0.0) / period
    sd = float(np.std(noise[1:]))
    # Of windows of 20 rows, half of 1000, 3 wheels: 30000 numbers. Errors of angles make neighbours differ: a line
    # through a window takes 4 % less of them than of independent ones.
    assert shown_rad_s(speed + noise, period) == pytest.approx(sd, rel=0.06)
    # A bin is the mean of four readings; a walk has four steps of a row in one of a bin.
    bins, ratio = 2e-3 / np.sqrt(rows), rows * 1e-3**2 / (2e-3**2 / rows)
    assert implied_rad_s(bins, ratio, rows, period) == pytest.approx(sd, rel=0.01)


def test_the_command_draws_what_it_simulated(logs, tmp_path):
    (tmp_path / "hobby.toml").write_text(plant.file().to_toml())

    def command(*more):
        known = [f"--fix={name}={value}" for name, value in KNOWN.items()]
        asked = ["identify", str(logs["coast", 0]), "--vehicle", "hobby.toml", "--zero-duty", "coast", *known, *more]
        done = subprocess.run([sys.executable, "-m", "omnistep", *asked], cwd=tmp_path, capture_output=True, text=True)
        return done.returncode, done.stdout, done.stderr

    code, said, wrong = command("--plot", "fit.png", "--quiet")
    assert (code, wrong) == (0, "")
    assert "simulated with these numbers the log's speeds are off by 1" in said
    assert (tmp_path / "fit.png").read_bytes().startswith(b"\x89PNG")
    code, said, wrong = command("--plot", "fit.gif", "--quiet")
    assert (code, said, wrong) == (2, "", "error: fit.gif: '.gif', allowed: .png, .svg or .pdf\n")
    assert not (tmp_path / "fit.gif").exists()


def test_refuted_results_are_no_file_unless_it_is_asked_for(logs, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "hobby.toml").write_text(plant.file().to_toml())
    known = [f"--fix={name}={value}" for name, value in KNOWN.items()]
    asked = [str(logs["coast", 0]), "--vehicle", "hobby.toml", "--zero-duty", "brake", *known, "--quiet"]
    assert _identify_cli.identify([*asked, "-o", "found.toml"]) == 1
    said = capsys.readouterr()
    assert "no interval is given: " in said.out and not (tmp_path / "found.toml").exists()
    assert said.err.startswith("error: found.toml: not written: the fit needs noise of ") and said.err.count("\n") == 1
    assert said.err.endswith("; --write-doubtful writes it all the same\n")
    assert _identify_cli.identify([*asked, "-o", "found.toml", "--write-doubtful"]) == 0
    # The reason is said all the same, and the vehicle is that of the table.
    assert "found.toml: doubtful: the fit needs noise of " in capsys.readouterr().err
    assert omnistep.Vehicle("found.toml")["motor.stall_torque_n_m"] != 1.0


def test_a_log_without_its_end_is_named_with_what_was_read(logs, tmp_path):
    whole = logs["brake", 0].read_bytes()
    (tmp_path / "cut.mcap").write_bytes(whole[: int(0.9 * len(whole))])
    read_s = omnistep.read_mcap(tmp_path / "cut.mcap").trace["time_s"][-1]
    # Nine tenths of 26.83 s, less a chunk of half a second or so.
    assert 23.0 < read_s < 24.2
    more = {"vehicle": plant.file(), "fix": KNOWN, "zero_duty": "brake", "progress": False}
    said = f"{tmp_path / 'cut.mcap'}: its end is missing, as of a recording that was cut off: {read_s:.6g} s read"
    found = omnistep.identify(tmp_path / "cut.mcap", **more)
    assert found.undetermined[0] == said and f"\n{said}\n" in found.table()
    # A calibration says it once, of however many runs the log is.
    parts = [(0.0, 6.0), (6.0, 12.0), (12.0, 18.0)]
    runs = [
        omnistep.CalibrationRun(log=tmp_path / "cut.mcap", distance_m=1.0, from_s=begin, until_s=end)
        for begin, end in parts
    ]
    assert omnistep.calibrate(runs, vehicle=plant.file()).undetermined[:2].count(said) == 1


def test_a_number_at_a_bound_of_its_range_is_doubted(logs, monkeypatch):
    # What is at a bound `test_calibrate.py` asserts; a search that ends there takes minutes.
    ended = "delay_s ended at the bound of its range, -0.01 s"
    monkeypatch.setattr(identification, "at_bounds", lambda *_: (ended,))
    result = omnistep.identify(logs["brake", 0], vehicle=plant.file(), fix=KNOWN, zero_duty="brake", progress=False)
    assert result.doubted == ended and all(each.note != "none" for each in result.estimates)
    assert any(line.startswith(f"{ended}, which distorts the others; check units") for line in result.undetermined)


def test_a_log_that_tells_nothing_leaves_the_file_and_is_doubted(logs):
    # A motor that moves nothing, whatever else is changed.
    weak = plant.file(stall_torque_n_m=0.008, slope_n_m_s_rad=0.0005)
    result = omnistep.identify(logs["brake", 0], vehicle=weak, fix=KNOWN, zero_duty="brake", progress=False)
    assert not any(each.determined for each in result.estimates)
    assert all(each.held for each in result.estimates if each.note != "fixed")
    assert result.doubted


def test_the_picture_has_both_speeds_of_every_wheel(found):
    simulation = found["coast", 0].simulation
    axes = simulation.plot().axes
    assert len(axes) == 4
    for number, ax in enumerate(axes):
        recorded, again = (line.get_ydata() for line in ax.lines)
        assert np.array_equal(recorded, simulation.recorded[0][:, number], equal_nan=True)
        assert np.array_equal(again, simulation.simulated[0][:, number], equal_nan=True)
