"""A log's commands or torques through the simulation again: near zero where the model is the same, else not."""

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest

import omnistep
from omnistep import _marker_plate
from omnistep.__main__ import main
from omnistep._wheel_logs import read
from omnistep.resimulation import Difference

SPEC = importlib.util.spec_from_file_location("pose_plant", Path(__file__).with_name("pose_plant.py"))
pose_plant = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(pose_plant)


@pytest.fixture(scope="module")
def log(tmp_path_factory, curve, recorded):
    """What a robot recorded of a run, imported."""
    folder = tmp_path_factory.mktemp("resimulated")
    recorded.write_csv(folder / "robot.csv", recorded.columns(curve))
    (folder / "my.toml").write_text(recorded.MAP)
    omnistep.import_log(folder / "robot.csv", map=folder / "my.toml", out=folder / "robot.mcap")
    return omnistep.read_mcap(folder / "robot.mcap")


HEAVIER = {"vehicle.body.0.mass_kg": 20.0}


def test_the_commands_of_a_runs_own_log_give_it_again_in_every_bit(tmp_path):
    path = tmp_path / "flat.mcap"
    trace = omnistep.run("flat", overrides={"duration_s": 0.5}, mcap=path)
    again = omnistep.resimulate(path)
    assert np.array_equal(again.simulated.wheels("applied_n_m"), trace.wheels("applied_n_m"))
    assert again.unknown == 0 and all(each.rms == 0.0 for each in again.differences.values()), again
    # Torques without a controller move the same vehicle the same way; a torque of -0 is one of 0 by then.
    by_torques = omnistep.resimulate(path, by="torques")
    assert all(each.rms < 1e-25 for each in by_torques.differences.values()), by_torques


def test_torques_that_acted_are_not_made_late_a_second_time(tmp_path):
    path = tmp_path / "late.mcap"
    omnistep.run("flat", overrides={"duration_s": 0.5, "actuators.torque_lag_s": 0.05}, mcap=path)
    again = omnistep.resimulate(path, by="torques")
    # Torques of a log are averages over a period, in which a lag of 50 periods bends them by hardly anything:
    # measured 6e-7 rad/s. With the lag twice it is 0.4 rad/s.
    assert again.differences["wheels"].rms < 1e-5, again
    assert again.zeroed == ("actuators.torque_lag_s",) and "actuators.torque_lag_s = 0, because" in str(again)
    # What was commanded still has the lag before it.
    by_commands = omnistep.resimulate(path)
    assert by_commands.zeroed == () and by_commands.differences["wheels"].rms == 0.0, by_commands


def test_torques_that_were_only_commanded_still_meet_the_lag(curve, recorded, tmp_path):
    recorded.write_csv(tmp_path / "robot.csv", recorded.columns(curve))
    for table, lag_s in (("torques", 0.0), ("commanded_torques", 0.05)):
        (tmp_path / "my.toml").write_text(recorded.MAP.replace("[torques]", f"[{table}]"))
        omnistep.import_log(tmp_path / "robot.csv", map=tmp_path / "my.toml", out=tmp_path / f"{table}.mcap")
        log = tmp_path / f"{table}.mcap"
        again = omnistep.resimulate(log, by="torques", overrides={"actuators.torque_lag_s": 0.05})
        expected = omnistep.resimulate(log, by="torques", overrides={"actuators.torque_lag_s": lag_s})
        assert np.array_equal(again.simulated.to_numpy(), expected.simulated.to_numpy(), equal_nan=True)
        assert bool(again.zeroed) == (lag_s == 0.0)


def test_a_gap_in_torques_that_acted_stays_a_gap_beside_commanded_torques(log, curve, recorded, tmp_path):
    recorded.write_csv(tmp_path / "robot.csv", recorded.columns(curve))
    torques = recorded.MAP.split("[torques]")[1].split("[pose]")[0]
    # What was commanded is nonsense, three times as much: it is not what acts in the gap.
    (tmp_path / "my.toml").write_text(f"{recorded.MAP}\n[commanded_torques]{torques}scale = 3.0\nmax_gap_s = inf\n")
    omnistep.import_log(tmp_path / "robot.csv", map=tmp_path / "my.toml", out=tmp_path / "both.mcap")
    both = omnistep.read_mcap(tmp_path / "both.mcap")
    gap = np.isnan(both.trace.wheels("torque_n_m")).any(axis=1)
    assert gap.sum() > 190 and np.isfinite(both.trace.wheels("applied_n_m")[gap]).all()
    again, alone = (omnistep.resimulate(each, by="torques") for each in (both, log))
    assert again.unknown == alone.unknown == gap.sum()
    assert np.array_equal(again.simulated.to_numpy(), alone.simulated.to_numpy(), equal_nan=True)


def test_by_commands_what_is_left_is_the_encoders(log, curve, recorded):
    again = omnistep.resimulate(log)
    assert len(again.simulated) == len(again.recorded) == len(curve) and again.unknown == 0
    # The difference of two floors is triangular within a count, of which the root mean square is a count
    # over the root of 6; on a line between two samples it is less. A whole count would be another vehicle.
    count = 2 * np.pi / recorded.COUNTS_PER_TURN / recorded.PERIOD_S
    assert again.differences["wheels"].rms < count / np.sqrt(6)
    # Places have no such noise: 0.3 m/s for a period is 0.3 mm.
    assert again.differences["path"].largest < 3e-4
    unknown = np.isnan(log.trace.wheels("measured_rad_s"))
    for number, name in enumerate(log.trace.wheel_names):
        each = again.differences[f"wheel_{name}_measured_rad_s"]
        assert each.left_out == unknown[:, number].sum() and each.compared + each.left_out == len(curve)
    assert again.differences["wheels"].left_out == unknown.sum()


def test_by_torques_a_wrong_mass_shows(log):
    same = omnistep.resimulate(log, by="torques")
    heavier = omnistep.resimulate(log, by="torques", overrides=HEAVIER)
    unknown = int((~np.isfinite(log.trace.wheels("torque_n_m"))).any(axis=1).sum())
    assert same.unknown == heavier.unknown == unknown > 190
    # The gap is in steady driving, where holding torques of hardly anything changes hardly anything.
    for name in ("path", "wheels"):
        assert heavier.differences[name].rms > 2 * same.differences[name].rms, (name, same, heavier)
    assert heavier.differences["path"].rms > 0.05 > 0.01 > same.differences["path"].rms


def test_without_a_pose_the_path_is_the_wheels_until_the_first_gap(log, curve, recorded, tmp_path):
    recorded.write_csv(tmp_path / "robot.csv", recorded.columns(curve))
    (tmp_path / "my.toml").write_text(recorded.MAP.split("[pose]")[0])
    omnistep.import_log(tmp_path / "robot.csv", map=tmp_path / "my.toml", out=tmp_path / "robot.mcap")
    path = omnistep.resimulate(tmp_path / "robot.mcap").differences["path"]
    # Row 0 has no position before it; the gap's first row is one before its first missing sample, or that.
    assert recorded.GAP.start - 2 <= path.compared <= recorded.GAP.start - 1
    assert path.compared + path.left_out == len(curve)
    # Counts do not add up: two counts of 4096 a turn, and a period of 0.3 m/s.
    assert path.largest < 1e-3


def test_figures_of_a_difference():
    time_s = np.arange(1.0, 5.0)
    each = Difference.of("x", time_s, np.array([1.0, np.nan, 3.0, -3.0]), np.array([1.0, 5.0, 7.0, np.nan]))
    assert (each.compared, each.left_out, each.largest, each.largest_at_s) == (2, 2, 4.0, 3.0)
    assert each.rms == np.sqrt(8.0) and each.recorded_rms == np.sqrt(5.0)
    none = Difference.of("x", time_s, np.full(4, np.nan), np.zeros(4))
    assert none.compared == 0 and np.isnan(none.rms)


def test_the_command_prints_the_figures_and_draws_both(log, tmp_path, monkeypatch, capfd):
    out = tmp_path / "both.png"
    mass = "vehicle.body.0.mass_kg=20"
    arguments = ["resimulate", str(log.path), "--torques", "--set", mass, "-o", str(out), "--quiet"]
    monkeypatch.setattr(sys, "argv", ["omnistep", *arguments])
    assert main() == 0
    said = capfd.readouterr().out
    heavier = omnistep.resimulate(log, by="torques", overrides=HEAVIER)
    assert said == f"{heavier}\n{out}\n" and out.read_bytes().startswith(b"\x89PNG")
    figure = heavier.plot()
    # Three wheels, three parts of the twist, the path; in each the log and the simulation.
    assert [len(ax.lines) for ax in figure.axes] == [2] * 7
    drawn = figure.axes[0].lines[0].get_ydata()
    assert np.array_equal(drawn, log.trace.wheels("measured_rad_s")[:, 0], equal_nan=True)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--scenario", "step"], "scenario step: wheels 1, 2, 3, 4, 5, 6, 7, allowed: those of the log, 1, 2, 3"),
        (["--set", "control.period_s=0.0005"], "a control period of 0.0005 s, and row 0 of the log ends at 0.001 s"),
        (["--set", "mass"], "--set mass: allowed: KEY=VALUE"),
        (["--set", "vehicle.mass=3"], "vehicle.mass"),
        (["--plate", "-2e1", "0", "0"], "plate = -20, 0, 0, allowed: x and y of -10 to 10 m"),
        (["--plate", "20", "0", "0"], "plate = 20, 0, 0, allowed: x and y of -10 to 10 m, and a yaw of -7 to 7 rad"),
        (["-o", "both.bmp"], "both.bmp: '.bmp', allowed: .png, .svg or .pdf"),
    ],
)
def test_what_cannot_be_compared_is_one_line(log, monkeypatch, capfd, tmp_path, arguments, said):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["omnistep", "resimulate", str(log.path), *arguments])
    assert main() == 2
    err = capfd.readouterr().err
    assert err.count("\n") == 1 and said in err, err
    assert not list(tmp_path.iterdir())


def test_a_log_without_torques_or_commands_says_so(curve, recorded, tmp_path):
    recorded.write_csv(tmp_path / "robot.csv", recorded.columns(curve))
    (tmp_path / "my.toml").write_text(recorded.MAP.split("[command]")[0])
    omnistep.import_log(tmp_path / "robot.csv", map=tmp_path / "my.toml", out=tmp_path / "robot.mcap")
    for by in ("commands", "torques"):
        with pytest.raises(omnistep.ConfigError, match=f"by = '{by}': the log has no {by}"):
            omnistep.resimulate(tmp_path / "robot.mcap", by=by)
    with pytest.raises(omnistep.ConfigError, match=r"asked_\*\), allowed: wheels \(--wheels\)$"):
        omnistep.resimulate(tmp_path / "robot.mcap")


def imported_duty(folder, measured, duty, zero):
    """A log of wheels and duty cycles alone, 200 rows a second."""
    names = [f"{of}{k}" for of in "wd" for k in range(4)]
    table = np.column_stack([0.005 * np.arange(len(duty)), measured, duty])
    np.savetxt(folder / "robot.csv", table, "%.9g", ",", header=",".join(["t", *names]), comments="")
    (folder / "my.toml").write_text(
        'schema_version = 1\nvehicle = "mecanum4"\nperiod_s = 0.005\n[time]\ncolumn = "t"\n'
        f'[wheels]\nnames = {names[:4]}\n[duty]\nnames = {names[4:]}\nzero = "{zero}"\n'
    )
    out = folder / f"{zero}.mcap"
    omnistep.import_log(folder / "robot.csv", map=folder / "my.toml", out=out, progress=False)
    return out


def test_wheels_or_duty_cycles_alone_drive_the_simulation_along_the_recorded_path(tmp_path):
    turns = [(0.0, 0.3, 0.4), (-0.3, 0.1, -0.6), (0.0, 0.0, 0.0)]
    axes = ("vx_m_s", "vy_m_s", "wz_rad_s")
    then = [
        {"at_s": 1.5 * (k + 1), "ramp_s": 0.5, **dict(zip(axes, turn, strict=True))} for k, turn in enumerate(turns)
    ]
    keys = {"vehicle": "mecanum4", "physics.engine": "articulated", "control.policy": "independent", "duration_s": 6.0}
    keys |= {"command.vx_m_s": 0.4, "command.ramp_s": 0.5, "command.then": then, "control.period_s": 0.005}
    trace = omnistep.run("flat", overrides=keys)
    measured = np.asarray(trace.wheels("measured_rad_s"))
    # The motors' line, backwards: 3 N.m at rest, 0.1 N.m less for each rad/s.
    duty = (np.asarray(trace.wheels("applied_n_m")) + 0.1 * measured) / 3.0
    log, engine = imported_duty(tmp_path, measured, duty, "brake"), {"physics.engine": "articulated"}
    with pytest.raises(omnistep.ConfigError, match=r"allowed: wheels \(--wheels\), duty \(--duty\)$"):
        omnistep.resimulate(log, overrides=engine)

    def off_m(by, **more):
        again = omnistep.resimulate(log, by=by, overrides=engine | more).simulated
        return np.hypot(*(again[f"pose_{axis}_m"] - trace[f"pose_{axis}_m"] for axis in "xy")).max()

    # Duty cycles are the run's own, to nine digits. The controller follows the wheels' twist as late again as the
    # vehicle followed its command: 0.1 s at 0.3 m/s.
    assert off_m("duty") < 1e-4 and off_m("wheels") < 0.03
    assert "do not follow" not in str(omnistep.resimulate(log, by="wheels", overrides=engine))
    # Loops that need J / kp = 2 s, as those derived for slow rows and light wheels are: the path is theirs.
    slow = {"vehicle.gains.kp_n_m_s_rad": 0.02, "vehicle.gains.ki_n_m_rad": 0.0025}
    assert off_m("wheels", **slow) > 0.1
    said = str(omnistep.resimulate(log, by="wheels", overrides=engine | slow))
    assert "the simulated wheels do not follow the recorded ones" in said and "the path tests their loops" in said
    # A motor of half the torque goes elsewhere.
    assert off_m("duty", **{"vehicle.motor.stall_torque_n_m": 1.5}) > 0.1
    # From 3 s on without duty: an open bridge has no torque, a short one brakes.
    duty[600:] = 0.0
    for zero, brakes in (("brake", True), ("coast", False)):
        again = omnistep.resimulate(imported_duty(tmp_path, measured, duty, zero), by="duty", overrides=engine)
        assert (np.asarray(again.simulated.wheels("applied_n_m"))[600:] != 0.0).any() == brakes


def test_duty_cycles_of_another_plant_with_its_numbers_give_its_path(hobby_plant, tmp_path):
    log = hobby_plant.written(tmp_path, 0, "brake", 'zero = "brake"\n')
    motor = {key: hobby_plant.TRUTH[key] for key in ("stall_torque_n_m", "slope_n_m_s_rad", "gear_friction_n_m")}
    keys = {f"vehicle.motor.{key}": value for key, value in motor.items()}
    keys |= {"physics.engine": "articulated", "actuators.torque_lag_s": hobby_plant.TRUTH["lag_s"]}
    true, file = (omnistep.resimulate(log, by="duty", overrides=each).differences["path"] for each in (keys, {}))
    # 27 s without any feedback; its yaw inertia is 15 % below the file's.
    assert true.rms < 0.02 and file.rms > 3.0 * true.rms, (true, file)


def with_plate(folder, plate, **more):
    """A drive below motion capture, imported: wheels and poses of a plate, of a vehicle that its file describes."""
    log = pose_plant.driven(np.random.default_rng(3), plate=plate, **more)
    keys = omnistep.Vehicle("mecanum4").to_dict()
    for wheel in keys["wheel"]:
        x, y = wheel["position_m"]
        wheel["position_m"] = [x * pose_plant.LEVER_M / 0.45, y * pose_plant.LEVER_M / 0.45]
        wheel["radius_m"] = pose_plant.RADIUS_M
    (folder / "true.toml").write_text(omnistep.Vehicle.from_dict(keys).to_toml())
    np.savetxt(folder / "drive.csv", np.stack(list(log.values()), 1), "%.6f", ",", header=",".join(log), comments="")
    (folder / "map.toml").write_text(
        'schema_version = 1\nvehicle = "true.toml"\nperiod_s = 0.01\n[time]\ncolumn = "time_s"\n'
        f'[wheels]\nnames = {[f"wheel_{name}_position_rad" for name in pose_plant.WHEELS]}\nunit = "rad"\n'
        '[pose]\nnames = ["pose_x_m", "pose_y_m", "pose_yaw_rad"]\nunit = "rad"\n'
    )
    out = folder / "drive.mcap"
    omnistep.import_log(folder / "drive.csv", map=folder / "map.toml", out=out, progress=False)
    return out


def test_the_path_is_compared_without_the_place_and_the_yaw_of_the_plate(tmp_path):
    more, far = {"by": "wheels", "overrides": {"physics.engine": "articulated"}, "progress": False}, (0.2, -0.1, 0.5)
    middle = omnistep.resimulate(with_plate(tmp_path, (0.0, 0.0, 0.0), duration_s=20.0), **more).differences["path"].rms
    log = with_plate(tmp_path, far, duration_s=20.0)
    alike, given, found = (omnistep.resimulate(log, plate=plate, **more) for plate in ((0, 0, 0), far, None))
    # Slip of 3 % for 0.3 s of 0.4 m/s is 4 mm in each of 18 pieces; 0.02 rad is a twenty-fifth of the yaw.
    assert found.plate[:3] == pytest.approx(far, abs=0.02)
    # What is left is that of a plate in the middle; taken for the vehicle's own pose, the path is turned by 0.5 rad.
    for each in (given, found):
        assert each.differences["path"].rms == pytest.approx(middle, abs=0.01)
    assert alike.differences["path"].rms > 10.0 * middle
    assert f"\n{found.plate}" in str(found) and "found from wheels and poses" in str(found)
    assert "x 0.2000 m, y -0.1000 m, yaw 0.5000 rad, as given" in str(given)


def test_slip_to_the_side_is_taken_into_account_where_it_is_stated(tmp_path):
    more = {"by": "wheels", "progress": False}
    log = with_plate(tmp_path, pose_plant.PLATE, duration_s=40.0, slip=0.0, sideways=0.85)
    without, stated = (omnistep.resimulate(log, sideways=part, **more) for part in (1.0, 0.85))
    none = omnistep.resimulate(with_plate(tmp_path, pose_plant.PLATE, duration_s=40.0, slip=0.0), **more)
    # As without slip, whatever simulated loops of 10 ms leave of that.
    assert stated.differences["path"].rms == pytest.approx(none.differences["path"].rms, abs=0.005)
    # Half a metre to the side, 15 % of it: 7 cm, on the average of there and back half of that.
    assert without.differences["path"].rms > 0.03 + stated.differences["path"].rms
    assert stated.plate[:3] == pytest.approx(pose_plant.PLATE, abs=0.005)
    with pytest.raises(omnistep.ConfigError, match=r"sideways = 0.2, allowed: 0.5 to 1.5"):
        omnistep.resimulate(log, sideways=0.2)


def test_repeated_poses_are_not_compared(tmp_path):
    more = {"by": "wheels", "progress": False}
    log = with_plate(tmp_path, pose_plant.PLATE, duration_s=40.0)
    rows = np.genfromtxt(tmp_path / "drive.csv", delimiter=",", names=True)
    whole = omnistep.resimulate(log, **more)
    for key in ("pose_x_m", "pose_y_m", "pose_yaw_rad"):
        rows[key][1680:1760] = rows[key][1680]
    names = rows.dtype.names
    np.savetxt(
        tmp_path / "held.csv", np.stack([rows[n] for n in names], 1), "%.6f", ",", header=",".join(names), comments=""
    )
    held = tmp_path / "held.mcap"
    omnistep.import_log(tmp_path / "held.csv", map=tmp_path / "map.toml", out=held, progress=False)
    again = omnistep.resimulate(held, **more)
    # Rows of 20 ms, and what is resampled to 10 ms between the last of them and the next.
    ((begin, end),) = again.repeated_s
    assert (begin, end) == pytest.approx((33.6, 35.2), abs=0.05)
    assert f"the pose is repeated from {begin:.1f} to {end:.1f} s while the wheels move: left out" in str(again)
    # Compared with them it would be 0.5 m off at their end.
    assert again.differences["path"].largest < whole.differences["path"].largest + 0.02


def test_late_poses_are_compared_without_their_delay(tmp_path):
    more = {"by": "wheels", "overrides": {"physics.engine": "articulated"}, "progress": False}
    in_time, late = (
        omnistep.resimulate(with_plate(tmp_path, pose_plant.PLATE, duration_s=20.0, delay_s=by), **more)
        for by in (0.0, 0.25)
    )
    # Rows of 10 ms; ends of pieces of 1 s tell the delay to some 3 ms.
    assert in_time.late_s == pytest.approx(0.0, abs=0.011) and late.late_s == pytest.approx(0.25, abs=0.011)
    # 0.25 s of 0.4 m/s are 0.1 m.
    assert late.differences["path"].rms == pytest.approx(in_time.differences["path"].rms, abs=0.005)
    assert late.plate[:3] == pytest.approx(pose_plant.PLATE, abs=0.02)
    assert f"poses are {late.late_s:.3g} s late" in str(late)


def test_a_plate_is_found_where_most_of_the_log_is_at_rest(tmp_path):
    # A minute at rest before 20 s of driving: poses that are 0.1 mm off agree there whatever the plate is.
    log = with_plate(tmp_path, pose_plant.PLATE, duration_s=20.0, noise_m=1e-4)
    vehicle = omnistep.Vehicle(tmp_path / "true.toml")
    wheels = read(log, vehicle, pose=True)
    still = round(60.0 / wheels.period_s)
    measured = np.concatenate([np.zeros((still, 4)), wheels.measured])
    noise = np.random.default_rng(4).normal(scale=1e-4, size=(still, 3))
    there = wheels.pose[np.isfinite(wheels.pose).all(axis=1)][0]
    pose = np.concatenate([there + noise, wheels.pose])
    plate = _marker_plate.found(vehicle, measured, pose, wheels.period_s)
    assert plate[:3] == pytest.approx(pose_plant.PLATE, abs=0.02), plate


def test_a_drive_without_turns_tells_the_yaw_of_the_plate_alone():
    vehicle, log = omnistep.Vehicle("mecanum4"), pose_plant.driven(np.random.default_rng(1), fastest=(0.4, 0.3, 0.0))
    wheels = read(log, vehicle, pose=True)
    plate = _marker_plate.found(vehicle, wheels.measured, wheels.pose, wheels.period_s)
    # Slip of 3 % across the way is up to 0.03 rad in each of 60 pieces.
    assert plate[:3] == (0.0, 0.0, pytest.approx(pose_plant.PLATE[2], abs=0.01)) and "its yaw found" in str(plate)
    still = np.zeros_like(wheels.measured)
    plate = _marker_plate.found(vehicle, still, wheels.pose, wheels.period_s)
    assert plate[:3] == (0.0, 0.0, 0.0) and "wheels and poses do not tell it" in str(plate)
