"""Identification finds the parameters of vehicles that are known, and says what it cannot tell."""

import importlib.util
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import least_squares

import omnistep
from omnistep._margins import margins
from omnistep._measurement_noise import likely
from omnistep._motion_model import Motion
from omnistep._stretches import cut
from omnistep._vehicle_masses import Masses
from omnistep._wheel_logs import read

SPEC = importlib.util.spec_from_file_location("wheel_plant", Path(__file__).with_name("wheel_plant.py"))
plant = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(plant)

DRIVES = {
    "mecanum4": {"kp": 0.3, "ki": 0.8, "top": (0.8, 0.6, 1.6)},
    "omni3": {"kp": 0.06, "ki": 0.12, "top": (0.6, 0.5, 2.0)},
}


def truth_of(vehicle):
    """A vehicle that its file does not describe: heavier, with friction, late and lagging."""
    mass, _, yaw = plant.masses(vehicle)
    return {
        "mass_kg": 1.15 * mass,
        "yaw_inertia_kg_m2": 0.9 * yaw,
        "wheel_inertia_kg_m2": vehicle["wheel.0.inertia_kg_m2"],
        "gear_friction_n_m": 0.06,
        "viscous_n_m_s_rad": 0.004,
        "delay_s": 0.006,
        "lag_s": 0.03,
    }


@pytest.fixture(scope="module")
def mecanum():
    vehicle = omnistep.Vehicle("mecanum4")
    truth = truth_of(vehicle)
    return vehicle, truth, plant.logs(vehicle, truth, range(6), counts=360, **DRIVES["mecanum4"])


def test_intervals_cover_the_truth_in_95_of_100_seeds(mecanum, coverage):
    (vehicle, truth, _), (seeds, (least, most)) = mecanum, coverage
    # Whole counts of one speed, read once a period, repeat with a beat: of many drives at the same speeds they are the
    # same beats. These are up to a tenth faster or slower.
    logs = plant.logs(vehicle, truth, range(seeds), counts=360, vary=0.1, **DRIVES["mecanum4"])
    covered = {}
    for log in logs:
        found = omnistep.identify(log, vehicle=vehicle, fix={"wheel_inertia_kg_m2": truth["wheel_inertia_kg_m2"]})
        for each in found.estimates:
            if each.determined:
                covered.setdefault(each.name, []).append(each.low <= truth[each.name] <= each.high)
    assert sorted(covered) == sorted(set(truth) - {"wheel_inertia_kg_m2"})
    shares = {name: np.mean(each) for name, each in covered.items()}
    assert all(len(each) == len(logs) for each in covered.values())
    assert all(least <= share <= most for share in shares.values()), shares


@pytest.fixture(scope="module")
def noisy(mecanum):
    vehicle, truth, _ = mecanum
    return plant.logs(vehicle, truth, range(6, 10), counts=360, noise_rad_s=0.3, vary=0.1, **DRIVES["mecanum4"])


@pytest.mark.parametrize("of_noise", [False, True])
def test_the_estimate_is_where_scipy_ends_with_the_same_residuals(mecanum, noisy, of_noise):
    vehicle, truth, logs = mecanum
    data = noisy[0] if of_noise else logs[0]
    found = omnistep.identify(data, vehicle=vehicle, fix={"wheel_inertia_kg_m2": truth["wheel_inertia_kg_m2"]})
    log, masses = read(data, vehicle), Masses(vehicle)
    motion = Motion(cut(log, masses, log.torques, lifted=False), masses, log.torques, 1.0)
    names = [each.name for each in found.estimates if each.determined]
    assert len(names) == 6
    scale = np.array([truth[name] for name in names])
    held = {"wheel_inertia_kg_m2": truth["wheel_inertia_kg_m2"], "rolling_resistance": 0.0}

    def residual(z):
        return motion.residual({**held, **dict(zip(names, z * scale, strict=True))})

    # Another algorithm, from the truth instead of the file, without bounds.
    first = least_squares(residual, np.ones(len(names)), method="lm", xtol=1e-12, ftol=1e-12)
    parts = [(first.fun.reshape(motion.measured.shape), motion.stretches.stretch)]
    motion.noise = likely(parts, motion.stretches.rows, "a test")
    oracle = least_squares(residual, first.x, method="lm", xtol=1e-12, ftol=1e-12)
    assert oracle.success
    values = np.array([found[name].value for name in names])
    halves = np.array([0.5 * (found[name].high - found[name].low) for name in names])
    # Both stop within a thousandth of what the data leave open anyway, at a relative change of the cost of 1e-8.
    assert (np.abs(values - oracle.x * scale) < 0.02 * halves).all()


def test_wheels_in_the_air_part_gears_from_rolling_and_wheels_from_the_mass():
    vehicle = omnistep.Vehicle("mecanum4")
    truth = truth_of(vehicle) | {"wheel_inertia_kg_m2": 0.006, "rolling_n_m": 0.04}
    gains = {"kp": 0.03, "ki": 0.08, "top": (0.8, 0.6, 1.6)}  # of a wheel alone
    (air,) = plant.logs(vehicle, truth, [1], counts=4096, lifted=True, **gains, parts=40)
    (ground,) = plant.logs(vehicle, truth, [2], counts=4096, **DRIVES["mecanum4"])
    # Up to 9.2 s it does not turn: going round a bend takes the mass alone, and would tell it.
    alone = omnistep.identify({key: column[:920] for key, column in ground.items()}, vehicle=vehicle)
    assert not alone["rolling_resistance"].determined and not alone["wheel_inertia_kg_m2"].determined
    assert any(
        "wheels_off_ground" in line and "rolling_resistance apart from gear_friction_n_m" in line
        for line in alone.undetermined
    )
    assert any("wheels_off_ground" in line and "wheel_inertia_kg_m2 apart from" in line for line in alone.undetermined)
    both = omnistep.identify(ground, vehicle=vehicle, wheels_off_ground=air)
    # 0.04 N.m a wheel of 76 mm under a quarter of 27.6 kg. Intervals are a third of what is allowed here.
    rolling = 0.04 / (0.25 * truth["mass_kg"] * 9.81 * 0.076)
    for name, value, within in [
        ("wheel_inertia_kg_m2", 0.006, 0.02),
        ("gear_friction_n_m", 0.06, 0.02),
        ("rolling_resistance", rolling, 0.04),
        ("mass_kg", truth["mass_kg"], 0.01),
    ]:
        assert both[name].determined
        assert both[name].value == pytest.approx(value, rel=within), name
    # A file has no rolling resistance: its gears take both.
    assert both.vehicle["motor.gear_friction_n_m"] == pytest.approx(0.10, rel=0.02)
    assert both.vehicle["wheel.2.inertia_kg_m2"] == both["wheel_inertia_kg_m2"].value


def test_duty_cycles_tell_the_motors_line_where_the_mass_is_known(mecanum):
    vehicle, truth, logs = mecanum
    # A motor's torque is stall times duty, late and lagging, less slope times speed: the plant's viscous is both.
    stall, slope, viscous = 2.4, 0.003, 0.001
    log = dict(logs[3])
    for name in vehicle.wheel_names:
        log[f"wheel_{name}_duty"] = log.pop(f"wheel_{name}_applied_n_m") / stall
    fix = {"wheel_inertia_kg_m2": truth["wheel_inertia_kg_m2"], "viscous_n_m_s_rad": viscous}
    found = omnistep.identify(log, vehicle=vehicle, fix=fix | {"mass_kg": truth["mass_kg"]})
    # Three half intervals of one seed.
    assert found["stall_torque_n_m"].value == pytest.approx(stall, rel=2e-3)
    assert found["slope_n_m_s_rad"].value == pytest.approx(slope, rel=0.05)
    assert found.vehicle["motor.slope_n_m_s_rad"] == found["slope_n_m_s_rad"].value
    percent = {key: 100 * column if key.endswith("_duty") else column for key, column in log.items()}
    with pytest.raises(omnistep.ConfigError, match=r"_duty reaches \d+\.?\d*, allowed: -1 to 1"):
        omnistep.identify(percent, vehicle=vehicle, fix=fix)
    without = omnistep.identify(log, vehicle=vehicle)
    assert not without["stall_torque_n_m"].determined
    assert any("stall_torque_n_m apart from" in line and "fix mass_kg" in line for line in without.undetermined)


def new_excitation(folder, vehicle):
    """The scenario that `omnistep new excitation` writes."""
    command = [sys.executable, "-m", "omnistep", "new", "excitation", "drive", "--vehicle", vehicle]
    assert subprocess.run(command, cwd=folder, check=True).returncode == 0
    return folder / "drive.toml"


@pytest.fixture(scope="module")
def excitation(tmp_path_factory):
    """Of a mecanum vehicle that its file does not describe."""
    return new_excitation(tmp_path_factory.mktemp("excitation"), "mecanum4")


REAL = {
    "vehicle.body.0.mass_kg": 24.0,
    "vehicle.motor.gear_friction_n_m": 0.05,
    "vehicle.motor.viscous_n_m_s_rad": 0.005,
    "actuators.torque_lag_s": 0.02,
    "sensors.delay_s": 0.005,
    "control.period_s": 0.005,
}


@pytest.mark.parametrize("counts", [360, 4096])
def test_a_simulated_vehicle_is_found_from_the_excitation(excitation, counts, tmp_path):
    drawn = omnistep.Vehicle("mecanum4")
    scenario = omnistep.Scenario(excitation, overrides={**REAL, "sensors.encoder_counts": counts})
    trace = omnistep.run(scenario, mcap=tmp_path / "drive.mcap")
    found = omnistep.identify(tmp_path / "drive.mcap", vehicle=drawn, fix={"wheel_inertia_kg_m2": 0.0035})
    again = omnistep.identify(trace, vehicle=drawn, fix={"wheel_inertia_kg_m2": 0.0035})
    assert [each.value for each in found.estimates] == pytest.approx([each.value for each in again.estimates], rel=1e-6)
    mass, _, yaw = plant.masses(scenario.vehicle)
    # A hundredth: what balls for wheels and grip that gives a little are away from rolling without slip.
    for name, value, within in [
        ("mass_kg", mass, 0.01),
        ("yaw_inertia_kg_m2", yaw, 0.02),
        ("gear_friction_n_m", 0.05, 0.03),
        ("viscous_n_m_s_rad", 0.005, 0.05),
    ]:
        assert found[name].value == pytest.approx(value, rel=within), name
    assert found["delay_s"].value + found["lag_s"].value == pytest.approx(0.025, abs=0.001)
    # What was found is a vehicle that drives, with gains of the margins that it says.
    assert found.vehicle.mass_kg == pytest.approx(found["mass_kg"].value)
    assert plant.masses(found.vehicle)[2] == pytest.approx(found["yaw_inertia_kg_m2"].value)
    assert found.loops.phase_margin_deg >= 45.0 and found.loops.gain_margin_db >= 6.0


def test_a_vehicle_of_whose_wheels_few_push_at_a_time_is_found_too(tmp_path):
    # Aside four of seven wheels push, with less than half of the weight: at the pace of the others they would slip, and
    # the mass be 6 % too high.
    real = {key: value for key, value in REAL.items() if key != "vehicle.body.0.mass_kg"}
    path = new_excitation(tmp_path, "chugo7")
    scenario = omnistep.Scenario(path, overrides={**real, "sensors.encoder_counts": 360})
    drawn = omnistep.Vehicle("chugo7")
    fix = {"wheel_inertia_kg_m2": drawn["wheel.0.inertia_kg_m2"]}
    found = omnistep.identify(omnistep.run(scenario), vehicle=drawn, fix=fix)
    assert not [line for line in found.undetermined if "no motion of this vehicle" in line]
    mass, _, yaw = plant.masses(scenario.vehicle)
    for name, value in [("mass_kg", mass), ("yaw_inertia_kg_m2", yaw)]:
        assert found[name].low <= value <= found[name].high, name
        # And an interval that says something: before wheels kept their grip it was 4 % of the mass to each side, a
        # quarter of which is left for the few stretches that turn.
        assert found[name].high - found[name].low < 0.02 * value, name


def test_margins_are_those_of_closed_forms():
    # kp around an inertia behind a delay: it crosses at kp / J = 10 rad/s, at -90 deg - 0.1 rad. It is -180 deg
    # at pi / 2 / 0.01 s = 157 rad/s, where the gain is 10 / 157. Frequencies are 0.6 % apart.
    phase, gain = margins(0.5, 0.0, inertia=0.05, viscous=0.0, delay_s=0.01, lag_s=0.0)
    assert phase == pytest.approx(90.0 - np.degrees(0.1), abs=0.1)
    assert gain == pytest.approx(20 * np.log10(np.pi / 2 / 0.01 / 10.0), abs=0.1)
    # A lag alone never turns it by 180 deg.
    assert margins(0.5, 0.0, inertia=0.05, viscous=0.0, delay_s=0.0, lag_s=0.01)[1] == np.inf


def without(log, name):
    return {key: column for key, column in log.items() if key != name}


def test_what_is_wrong_is_said_in_one_line(mecanum, tmp_path):
    vehicle, _, logs = mecanum
    log = logs[0]
    cases = [
        (without(log, "time_s"), {}, "no column time_s"),
        (without(log, "wheel_rear_left_applied_n_m"), {}, "no column wheel_rear_left_applied_n_m"),
        (log | {"time_s": log["time_s"][::-1]}, {}, "time_s does not increase in row 2, from "),
        (log | {"wheel_rear_left_measured_rad_s": np.zeros(3)}, {}, "wheel_rear_left_measured_rad_s has shape (3,)"),
        ({key: 0.0 * column if key != "time_s" else column for key, column in log.items()}, {}, "a log of a drive"),
        ({key: column[:200] for key, column in log.items()}, {}, "drive longer"),
        (log | {"time_s": 1e300 * log["time_s"]}, {}, "time_s reaches 2.1e+301, allowed: up to 1e+12"),
        (log, {"fix": {"mass": 3.0}}, "fix: mass: unknown key (did you mean mass_kg?)"),
        (log, {"fix": {"mass_kg": -3.0}}, "fix: mass_kg = -3.0, allowed: 1.2 to 480"),
        ([], {}, "data: empty"),
    ]
    for data, more, message in cases:
        with pytest.raises(omnistep.ConfigError) as refused:
            omnistep.identify(data, vehicle=vehicle, **more)
        assert message in str(refused.value)
        assert "\n" not in str(refused.value) and "allowed: " in str(refused.value)


def test_noise_that_a_controller_answers_puts_nothing_off(mecanum, noisy):
    vehicle, truth, _ = mecanum
    fix = {"wheel_inertia_kg_m2": truth["wheel_inertia_kg_m2"]}
    off = {"velocities": [], "angles": []}
    for seed, log in enumerate(noisy, start=6):
        rng = np.random.default_rng(seed)
        rng.random(4)
        noise = 0.3 * rng.standard_normal((len(log["time_s"]), 4))
        # The encoder's angles alone: the noise on the velocities that the controller took is not in them.
        angles = log | {
            f"wheel_{name}_position_rad": plant.PERIOD_S * np.cumsum(log[f"wheel_{name}_measured_rad_s"] - noise[:, k])
            for k, name in enumerate(vehicle.wheel_names)
        }
        for name, given in (("velocities", log), ("angles", angles)):
            found = omnistep.identify(given, vehicle=vehicle, fix=fix)
            off[name].append(found["delay_s"].value - truth["delay_s"])
    # Without the walk that noise on velocities adds up to, the delay was 2 ms too small. One log leaves 0.9 ms open,
    # with angles 0.25 ms (a deviation); three deviations of the mean of four.
    assert np.mean(off["velocities"]) == pytest.approx(0.0, abs=1.4e-3)
    assert np.mean(off["angles"]) == pytest.approx(0.0, abs=4e-4)


def test_gaps_are_left_out(mecanum):
    vehicle, truth, logs = mecanum
    fix = {"wheel_inertia_kg_m2": truth["wheel_inertia_kg_m2"]}
    log = {key: column.copy() for key, column in logs[5].items()}
    log["wheel_front_left_measured_rad_s"][500:520] = np.nan
    rows = np.r_[0:900, 930 : len(log["time_s"])]
    found = omnistep.identify({key: column[rows] for key, column in log.items()}, vehicle=vehicle, fix=fix)
    # Torques of one wheel that are not known: nothing is made of them, nor of the state of a lag after them.
    unknown = {key: column.copy() for key, column in logs[5].items()}
    for begin in (150, 700, 1800, 1950):
        unknown["wheel_front_left_applied_n_m"][begin : begin + 15] = np.nan
    without_torques = omnistep.identify(unknown, vehicle=vehicle, fix=fix)
    whole = omnistep.identify(logs[5], vehicle=vehicle, fix=fix)
    for each in whole.estimates:
        if each.determined:
            # Of a part of the data: within the whole log's interval and a half.
            halves = 0.5 * (each.high - each.low)
            assert without_torques[each.name].value == pytest.approx(each.value, abs=1.5 * halves), each.name
    # The gaps are 60 rows, and after each 15 are left out; their stretches end on whole bins, and some are too short.
    assert 75 / 2100 < whole.used - without_torques.used < 0.15
    # Twice the half interval: a gap takes some of the data.
    assert found["mass_kg"].value == pytest.approx(truth["mass_kg"], rel=1e-3)
    assert found.used < whole.used


def test_the_command_writes_a_file_that_is_a_vehicle(mecanum, tmp_path):
    vehicle, truth, logs = mecanum
    names = list(logs[0])
    rows = np.stack([logs[0][name] for name in names], axis=1)
    np.savetxt(tmp_path / "drive.csv", rows, delimiter=",", header=",".join(names), comments="", fmt="%.9g")

    def command(*arguments):
        done = subprocess.run(
            [sys.executable, "-m", "omnistep", *arguments], cwd=tmp_path, capture_output=True, text=True
        )
        return done.returncode, done.stdout, done.stderr

    (tmp_path / "drawn.toml").write_text(vehicle.to_toml())
    asked = ["identify", "drive.csv", "--vehicle", "drawn.toml", "--fix", "wheel_inertia_kg_m2=0.0035"]
    code, said, wrong = command(*asked, "--quiet", "-o", "found.toml")
    assert (code, wrong) == (0, "")
    assert "this log cannot tell rolling_resistance apart from gear_friction_n_m" in said
    assert "phase margin" in said
    assert omnistep.Vehicle(tmp_path / "found.toml").mass_kg == pytest.approx(truth["mass_kg"], rel=1e-3)
    assert command("check", "found.toml")[0] == 0
    for arguments, message in [
        ([*asked[:-1], "mass_kg=heavy"], "--fix mass_kg=heavy, allowed: NAME=VALUE"),
        (["identify", "none.csv", "--vehicle", "omni3"], "none.csv: "),
        ([*asked, "-o", "drawn.toml"], "drawn.toml: this command reads this file"),
    ]:
        code, said, wrong = command(*arguments)
        assert (code, said) == (2, "")
        assert wrong.startswith("error: ") and message in wrong and wrong.count("\n") == 1
