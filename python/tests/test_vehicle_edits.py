"""A vehicle file after `calibrate -o` and `identify -o` is the same file with other numbers."""

import re
import sys

import numpy as np
import pytest

import omnistep
from omnistep import _identify_cli
from omnistep._estimates import Estimate
from omnistep._identified_vehicle import vehicle_with
from omnistep._omnistep import cli
from omnistep._vehicle_edits import Changes, calibrated_halves, edited, identified_halves
from omnistep._vehicle_masses import Masses

TWISTS = [(0.4, 0, 0), (0, 0.4, 0), (0, 0, 1), (0.3, 0.1, 0.4), (-0.4, 0, 0), (0, -0.4, 0), (0, 0, -1), (0.2, 0, -0.5)]
SHORT = """schema_version = 1
name = "strafer"
total_mass_kg = 8.8     # from a scale

[[body]]
name = "frame"
inertia_box_m = [0.40, 0.35, 0.12]

[motor] # of a shop
stall_torque_kg_cm = 24.3   # its data sheet
no_load_rpm = 312           # likewise
rotor_inertia_kg_m2 = 1e-6
gear_ratio = 20

[mecanum4]
wheelbase_m = 0.336 # by tape
track_m = 0.40
radius_m = 0.048    # by calliper
wheel_mass_kg = 0.35
"""


@pytest.fixture
def drawn(tmp_path, monkeypatch):
    """The file that `omnistep new vehicle` writes, with its comments."""
    monkeypatch.chdir(tmp_path)
    assert cli(["omnistep", "new", "vehicle", "drawn", "--template", "mecanum4"]) == 0
    return tmp_path / "drawn.toml"


def runs_of(real, rng, tape_m=0.002, yaw_rad=0.004):
    """Lines, turns and arcs of a real vehicle, with ends as a tape gives them."""
    runs = []
    for twist in TWISTS:
        wheels = omnistep.Kinematics(layout=real.layout).inverse([twist] * 401)
        end = omnistep.moved_by([0, 0, 0], 4.0 * np.array(twist)) + rng.standard_normal(3) * [tape_m, tape_m, yaw_rad]
        log = {"time_s": 0.01 * np.arange(401)}
        log |= {f"wheel_{name}_measured_rad_s": wheels[:, k] for k, name in enumerate(real.wheel_names)}
        runs.append(omnistep.CalibrationRun(log=log, end_x_m=end[0], end_y_m=end[1], end_yaw_rad=end[2]))
    return runs


def numbers_of(line):
    return re.findall(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e-?\d+)?", line.split("#")[0].partition("=")[2])


@pytest.mark.parametrize("seed", range(3))
def test_calibration_changes_numbers_alone_to_the_digits_that_intervals_justify(drawn, seed):
    rng, text = np.random.default_rng(seed), drawn.read_text()
    vehicle = omnistep.Vehicle(drawn)
    real = vehicle.replace({f"wheel.{k}.radius_m": 0.076 * (1 + 0.01 * rng.standard_normal()) for k in range(4)})
    found = omnistep.calibrate(runs_of(real, rng), vehicle=vehicle)
    halves = calibrated_halves(vehicle, (*found.common, *found.estimates))
    new, notes = edited(text, vehicle, Changes(found.vehicle, halves))
    assert notes == []
    before, after = text.splitlines(), new.splitlines()
    changed = [(old, line) for old, line in zip(before, after, strict=True) if old != line]
    assert len(changed) == 12  # radius, place and direction of four wheels
    for old, line in changed:
        assert old.split(" = ")[0] == line.split(" = ")[0] and old.partition("#")[1:] == line.partition("#")[1:]
        for number in numbers_of(line):
            assert len(number.split("e")[0].replace(".", "").lstrip("-0")) <= 6, line
    again = omnistep.Vehicle.from_toml(new)
    for k in range(4):
        # Two digits of a half width: rounded by at most a twentieth of it.
        half = halves["wheel", k, "radius_m"]
        assert again[f"wheel.{k}.radius_m"] == pytest.approx(found.vehicle[f"wheel.{k}.radius_m"], abs=half / 20)
        half = halves["wheel", k, "position_m"]
        assert again[f"wheel.{k}.position_m"] == pytest.approx(found.vehicle[f"wheel.{k}.position_m"], abs=half / 20)


@pytest.mark.parametrize("seed", range(3))
def test_a_short_form_holds_what_all_wheels_have_in_common(seed):
    vehicle = omnistep.Vehicle.from_toml(SHORT)
    lever, larger = (0.336 + 0.40) / 2, 1.02
    wider = 0.01 * lever  # of each of the two, for a lever that is 1 % larger
    form = {"wheelbase_m": 0.336 + wider, "track_m": 0.40 + wider, "radius_m": 0.048 * larger}
    text = SHORT
    for key, value in form.items():
        text = re.sub(rf"(?m)^{key} = [0-9.]+", f"{key} = {value}", text)
    real = omnistep.Vehicle.from_toml(text)
    found = omnistep.calibrate(runs_of(real, np.random.default_rng(seed)), vehicle=vehicle)
    halves = calibrated_halves(vehicle, (*found.common, *found.estimates))
    new, notes = edited(SHORT, vehicle, Changes(found.vehicle, halves))
    assert all("has no turn of all wheels" in note for note in notes)
    assert [line.partition("#")[1:] for line in new.splitlines()] == [
        line.partition("#")[1:] for line in SHORT.splitlines()
    ]
    again = omnistep.Vehicle.from_toml(new)
    for k in range(4):
        # The intervals hold the truth in 95 of 100: three times as wide they do for every seed here.
        tolerance = 3 * halves["wheel", k, "radius_m"]
        assert again[f"wheel.{k}.radius_m"] == pytest.approx(form["radius_m"], abs=tolerance)
        tolerance = 3 * halves["wheel", k, "position_m"]
        assert again[f"wheel.{k}.position_m"] == pytest.approx(real[f"wheel.{k}.position_m"], abs=tolerance)


def test_three_wheels_in_a_circle_keep_their_form():
    text = """
[omni3]
lever_m = 0.18 # by tape
radius_m = 0.05
wheel_mass_kg = 0.4
"""
    text = SHORT[: SHORT.index("rotor_inertia")] + text
    vehicle = omnistep.Vehicle.from_toml(text)
    real = omnistep.Vehicle.from_toml(text.replace("0.18", "0.184"))
    new, _ = edited(text, vehicle, Changes(real, {("wheel", k, "position_m"): 0.001 for k in range(3)}))
    assert new == text.replace("0.18", "0.184")


def test_a_turn_that_can_be_seen_is_not_left_out():
    vehicle = omnistep.Vehicle.from_toml(SHORT)
    for turn, of_form in ((0.004, True), (0.006, False)):
        keys = {f"wheel.{k}.rolling_direction": [np.cos(turn), np.sin(turn)] for k in range(4)}
        for k, wheel in enumerate(vehicle.layout.wheels):
            # The whole turns below levers that stay: each wheel shifts across its push.
            x, y, push = *wheel.position_m, wheel.roller_angle_rad
            shift = -turn * (x * np.cos(push) + y * np.sin(push))
            keys[f"wheel.{k}.position_m"] = [x + shift * np.sin(push), y - shift * np.cos(push)]
        new, notes = edited(SHORT, vehicle, Changes(vehicle.replace(keys), {}))
        assert ("has no turn of all wheels: 0.004 rad are left out" in notes[0]) is of_form
        assert ("[[wheel]]" not in new) is of_form


def test_wheels_that_differ_are_written_out_and_the_form_stays_as_a_comment():
    vehicle = omnistep.Vehicle.from_toml(SHORT)
    new, notes = edited(SHORT, vehicle, Changes(vehicle.replace({"wheel.2.radius_m": 0.0487}), {}))
    assert len(notes) == 1 and notes[0].startswith("[mecanum4] cannot hold wheels that differ")
    again = omnistep.Vehicle.from_toml(new)
    assert again.wheel_names == vehicle.wheel_names
    assert [again[f"wheel.{k}.radius_m"] for k in range(4)] == [0.048, 0.048, 0.0487, 0.048]
    for line in SHORT.splitlines():
        assert line in new


def test_identified_numbers_go_to_the_keys_that_the_file_has():
    vehicle = omnistep.Vehicle.from_toml(SHORT)
    keys = vehicle.to_dict()
    stall, slope = 2.1, 2.1 / (300 * np.pi / 30)
    keys["motor"] |= {"stall_torque_n_m": stall, "slope_n_m_s_rad": slope, "no_load_rpm": None}
    keys["motor"]["gear_friction_n_m"] = 0.0412
    keys["gains"] = {"kp_n_m_s_rad": 0.26123456, "ki_n_m_rad": 0.38, "kd_n_m_s2_rad": 0.0}
    keys["body"][0]["mass_kg"] += 0.7
    solid = 0.35 * 0.048**2 / 2
    for wheel in keys["wheel"]:
        wheel["inertia_kg_m2"] = solid + 400 * 1.5e-6  # gear_ratio 20
    changes = Changes(omnistep.Vehicle.from_dict(keys), {("total_mass_kg",): 0.04, ("gains", "kp_n_m_s_rad"): 0.003})
    new, notes = edited(SHORT, vehicle, changes)
    assert len(notes) == 1 and notes[0].startswith("[gains] is new")
    for old, line in [
        ("total_mass_kg = 8.8     #", "total_mass_kg = 9.5     #"),
        ("stall_torque_kg_cm = 24.3   #", "stall_torque_kg_cm = 21.414   #"),  # 2.1 / 0.0980665
        ("no_load_rpm = 312           #", "no_load_rpm = 300.0           #"),
        ("rotor_inertia_kg_m2 = 1e-6", "rotor_inertia_kg_m2 = 1.5e-06"),
        ("gear_ratio = 20\n", "gear_ratio = 20\ngear_friction_n_m = 0.0412\n"),
    ]:
        assert old in SHORT and line in new, new
    assert "kp_n_m_s_rad = 0.2612\n" in new
    again = omnistep.Vehicle.from_toml(new)
    assert again.mass_kg == pytest.approx(9.5) and again.no_load_rad_s == pytest.approx(10 * np.pi)
    assert again["wheel.0.inertia_kg_m2"] == pytest.approx(keys["wheel"][0]["inertia_kg_m2"])
    # Inertias that no rotor gives: less than those of the solid wheels.
    for wheel in keys["wheel"]:
        wheel["inertia_kg_m2"] = 0.5 * solid
    new, notes = edited(SHORT, vehicle, Changes(omnistep.Vehicle.from_dict(keys), {}))
    assert "rotor_inertia_kg_m2" in notes[0] and "rotor_inertia_kg_m2" not in new
    assert omnistep.Vehicle.from_toml(new)["wheel.0.inertia_kg_m2"] == pytest.approx(0.5 * solid)


def test_a_rotor_stays_a_rotor_after_a_calibration_of_single_wheels(tmp_path, capsys):
    text = SHORT.replace("rotor_inertia_kg_m2 = 1e-6", "rotor_inertia_kg_m2 = 1e-6 # its data sheet")
    vehicle = omnistep.Vehicle.from_toml(text)
    sizes = vehicle.replace({f"wheel.{k}.radius_m": 0.048 * (1 + 0.02 * (-1) ** k) for k in range(4)})
    calibrated, _ = edited(text, vehicle, Changes(sizes, {}))
    drawn = omnistep.Vehicle.from_toml(calibrated)
    masses = Masses(drawn)
    found = {
        "mass_kg": 9.5,
        "yaw_inertia_kg_m2": masses.yaw_inertia,
        "wheel_inertia_kg_m2": 1.3 * masses.wheel_inertia,
        "gear_friction_n_m": 0.04,
        "viscous_n_m_s_rad": 0.0,
        "rolling_resistance": 0.0,
    }
    built, _ = vehicle_with(drawn, masses, found, duty=False)
    new, notes = edited(calibrated, drawn, Changes(built, {}))
    assert notes == [] and "inertia_kg_m2" not in new.replace("rotor_inertia_kg_m2", "")
    for line in calibrated.splitlines():
        # Of the keys that a calibration writes, and of all comments, none is lost.
        assert line.split(" = ")[0] in new and line.partition("#")[2] in new, line
    # Six digits of the rotor, and radii of 0.04896 and 0.04704 m in the solid part: the mean is what was found.
    again = Masses(omnistep.Vehicle.from_toml(new))
    assert again.wheel_inertia == pytest.approx(found["wheel_inertia_kg_m2"], rel=2e-6)
    (tmp_path / "new.toml").write_text(new)
    assert cli(["omnistep", "check", "--strict", str(tmp_path / "new.toml")]) == 0, capsys.readouterr().err


def test_without_a_change_every_byte_stays(drawn):
    for text in (SHORT, drawn.read_text(), drawn.read_text().replace("\n", "\r\n")):
        vehicle = omnistep.Vehicle.from_toml(text)
        assert edited(text, vehicle, Changes(vehicle, {})) == (text, [])


def test_halves_of_an_identification_follow_what_each_number_is_made_of():
    vehicle = omnistep.Vehicle("mecanum4")
    gains = {"kp_n_m_s_rad": 0.4, "ki_n_m_rad": 2.0, "kd_n_m_s2_rad": 0.0}

    def of(name, value, half):
        return Estimate(name=name, unit="", value=value, low=value - half, high=value + half, before=value, note="")

    halves = identified_halves(vehicle.replace({"gains": gains}), [of("mass_kg", 24.0, 0.24), of("slope", 1.0, 0.1)])
    assert halves["total_mass_kg",] == pytest.approx(0.24)
    assert halves["body", 0, "mass_kg"] == pytest.approx(0.2)  # 1 % of 20 kg
    assert ("body", 0, "inertia_box_m") not in halves


def test_what_cannot_be_written_is_said_in_one_line_before_the_search(drawn, capsys, monkeypatch):
    (drawn.parent / "runs.toml").write_text('[[run]]\nlog = "none.csv"\nend_x_m = 1.0\n')

    def refused(vehicle):
        assert _identify_cli.calibrate(["runs.toml", "--vehicle", vehicle, "-o", "new.toml"]) == 2
        assert not (drawn.parent / "new.toml").exists()
        said = capsys.readouterr()
        assert said.out == "" and said.err.count("\n") == 1
        return said.err

    assert refused("gone.toml").startswith("error: gone.toml: ")
    monkeypatch.setitem(sys.modules, "tomlkit", None)
    assert 'pip install "omnistep[identify]"' in refused("drawn.toml")
