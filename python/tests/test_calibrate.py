"""Calibration finds the wheels of vehicles that are known, from what a tape measure and a gyro say."""

import subprocess
import sys

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.stats import binom

import omnistep
from omnistep import _identify_cli
from omnistep._calibration_runs import read_runs
from omnistep._estimates import Parameter, at_bounds, fit

STEP_S = 0.02
TAPE_M, TURN_RAD = 0.002, 0.004


def driven(sign):
    """Squares ahead and sideways, lines, a turn on the spot, an arc: twists and how long."""
    corner = (0, 0, sign, np.pi / 2)
    return [
        [(0.4, 0, 0, 5), corner] * 4,
        [(0, sign * 0.4, 0, 5), corner] * 4,
        [(0.4 * sign, 0, 0, 6)],
        [(0, 0.4 * sign, 0, 6)],
        [(0, 0, sign, 12)],
        [(0.3, 0.2 * sign, 0.4 * sign, 12)],
    ]


DRIVES = driven(1) + driven(-1)


def built(drawn, rng):
    """Radii 1 %, places 4 mm, directions 10 mrad off the drawing."""
    keys = {}
    for k, wheel in enumerate(drawn.layout.wheels):
        angle = np.arctan2(*wheel.rolling_direction[::-1]) + 0.01 * rng.standard_normal()
        keys[f"wheel.{k}.radius_m"] = wheel.radius_m * (1 + 0.01 * rng.standard_normal())
        keys[f"wheel.{k}.position_m"] = list(np.array(wheel.position_m) + 0.004 * rng.standard_normal(2))
        keys[f"wheel.{k}.rolling_direction"] = [np.cos(angle), np.sin(angle)]
    return drawn.replace(keys)


def drive(vehicle, parts, rng, *, counts=2000, slip=0.0, noise=1.0):
    """What the encoders of a vehicle say, and where it ends as measured. Slip grows with the root of the way."""
    twists = np.concatenate([np.tile(part[:3], (round(part[3] / STEP_S), 1)) for part in parts])
    yaw = np.cumsum(twists[:, 2]) * STEP_S
    middle = yaw - 0.5 * STEP_S * twists[:, 2]
    # The chord of an arc is shorter than the arc.
    chord = np.sinc(0.5 * STEP_S * twists[:, 2] / np.pi) * STEP_S
    x = (chord * (np.cos(middle) * twists[:, 0] - np.sin(middle) * twists[:, 1])).sum()
    y = (chord * (np.sin(middle) * twists[:, 0] + np.cos(middle) * twists[:, 1])).sum()
    turns = omnistep.Kinematics(layout=vehicle.layout).inverse(twists) * STEP_S
    turns = turns + slip * np.sqrt(np.abs(turns)) * rng.standard_normal(turns.shape)
    angles = np.vstack([np.zeros(turns.shape[1]), np.cumsum(turns, axis=0)])
    if counts:
        count = 2 * np.pi / counts
        angles = np.floor(angles / count + rng.random(turns.shape[1])) * count
    log = {"time_s": STEP_S * np.arange(len(angles))}
    log |= {f"wheel_{name}_position_rad": angles[:, k] for k, name in enumerate(vehicle.wheel_names)}
    end = np.array([x, y, yaw[-1]]) + noise * rng.standard_normal(3) * [TAPE_M, TAPE_M, TURN_RAD]
    return log, end


def runs_of(vehicle, rng, **how):
    runs = []
    for parts in DRIVES:
        log, (x, y, yaw) = drive(vehicle, parts, rng, **how)
        runs.append(omnistep.CalibrationRun(log=log, end_x_m=x, end_y_m=y, end_yaw_rad=yaw))
    return runs


def truth_of(drawn, real):
    """The parameters: a place along the push cannot be determined, so it is the lever that counts."""
    truth = {}
    for name, wheel, there in zip(drawn.wheel_names, drawn.layout.wheels, real.layout.wheels, strict=True):
        angles = [np.arctan2(*each.rolling_direction[::-1]) for each in (wheel, there)]
        turn = np.angle(np.exp(1j * (angles[1] - angles[0])))
        push, drawn_push = (angle + wheel.roller_angle_rad for angle in angles[::-1])
        across = np.array([np.sin(push), -np.cos(push)])
        moved = np.array([np.sin(drawn_push), -np.cos(drawn_push)])
        lever = (np.array(there.position_m) - np.array(wheel.position_m)) @ across
        truth |= {
            f"{name}.radius_m": there.radius_m,
            f"{name}.turn_rad": turn,
            f"{name}.shift_m": lever / (moved @ across),
        }
    return truth


@pytest.mark.parametrize("name", ["omni3", "mecanum4", "chugo7"])
def test_without_noise_the_wheels_are_found_exactly(name):
    drawn = omnistep.Vehicle(name)
    rng = np.random.default_rng(3)
    real = built(drawn, rng)
    found = omnistep.calibrate(runs_of(real, rng, counts=0, noise=0.0), vehicle=drawn)
    for key, value in truth_of(drawn, real).items():
        assert found[key].determined, key
        # Rounding, and where a search ends: millionths of a metre or radian.
        assert found[key].value == pytest.approx(value, abs=2e-6), key
    # What the file then says turns the wheels as the real vehicle's do.
    twist = [0.3, -0.2, 0.5]
    speeds = [omnistep.Kinematics(layout=each.layout).inverse(twist) for each in (found.vehicle, real)]
    np.testing.assert_allclose(speeds[0], speeds[1], rtol=1e-4, atol=1e-4)


def test_intervals_cover_the_truth_in_95_of_100_seeds(coverage):
    drawn, (seeds, (least, most)) = omnistep.Vehicle("omni3"), coverage
    covered = {}
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        real = built(drawn, rng)
        found = omnistep.calibrate(runs_of(real, rng), vehicle=drawn)
        truth = truth_of(drawn, real)
        for each in found.estimates:
            covered.setdefault(each.name, []).append(each.determined and each.low <= truth[each.name] <= each.high)
    shares = {name: np.mean(each) for name, each in covered.items()}
    assert len(shares) == 9
    assert all(least <= share <= most for share in shares.values()), shares


@pytest.mark.parametrize("counts", [4096, 1024, 360, 210])
@pytest.mark.parametrize(("tape_m", "turn_rad"), [(0.002, 0.005), (0.01, 0.02)])
def test_a_radius_that_all_wheels_share_is_found_with_coarse_counts_too(counts, tape_m, turn_rad):
    # Every radius 7.3 % above the drawing; eight drives of 1.5 m and 4 rad.
    drawn, rng = omnistep.Vehicle("mecanum4"), np.random.default_rng(0)
    real = drawn.replace({f"wheel.{k}.radius_m": 1.073 * 0.076 for k in range(4)})
    runs = []
    for twist in [(0.3, 0, 0), (0, 0.3, 0), (0, 0, 0.8), (0.3, 0.1, 0.4)]:
        for sign in (1, -1):
            parts = [(*(sign * np.array(twist)), 5.0)]
            log, end = drive(real, parts, rng, counts=counts, noise=0.0)
            x, y, yaw = end + rng.standard_normal(3) * [tape_m, tape_m, turn_rad]
            runs.append(omnistep.CalibrationRun(log=log, end_x_m=x, end_y_m=y, end_yaw_rad=yaw))
    found = omnistep.calibrate(runs, vehicle=drawn, position_sd_m=tape_m, yaw_sd_rad=turn_rad)
    # Four lines of 1.5 m, each to 10 mm: 0.3 % of their common length; three times that.
    assert found["all.radius"].value == pytest.approx(1.073, rel=0.01)
    assert found["all.radius"].determined and found["all.lever"].determined
    assert "these runs tell one radius for all wheels, the lever" in found.undetermined[0]
    for name in drawn.wheel_names:
        each = found[f"{name}.radius_m"]
        assert each.value == pytest.approx(1.073 * 0.076, rel=0.02), each
        # Nothing pretends to know a single wheel better than the ends tell all of them.
        assert not each.determined or each.high - each.low > 0.5 * 0.076 * (
            found["all.radius"].high - found["all.radius"].low
        )


@pytest.mark.parametrize("name", ["mecanum4", "chugo7"])
def test_what_all_wheels_have_in_common_is_separated(name):
    drawn = omnistep.Vehicle(name)
    wheels = drawn.layout.wheels

    def moved(lever=1.0, turn=0.0):
        keys = {}
        for k, wheel in enumerate(wheels):
            angle = np.arctan2(*wheel.rolling_direction[::-1]) + turn
            x, y = lever * np.array(wheel.position_m)
            keys[f"wheel.{k}.position_m"] = [np.cos(turn) * x - np.sin(turn) * y, np.sin(turn) * x + np.cos(turn) * y]
            keys[f"wheel.{k}.rolling_direction"] = [np.cos(angle), np.sin(angle)]
        return drawn.replace(keys)

    for real, expected in [(moved(lever=1.04), (1.0, 1.04, 0.0)), (moved(turn=0.03), (1.0, 1.0, 0.03))]:
        found = omnistep.calibrate(runs_of(real, np.random.default_rng(3)), vehicle=drawn)
        for name, value in zip(("all.radius", "all.lever", "all.turn_rad"), expected, strict=True):
            each = found[name]
            # Eight turns of 2 pi and twelve rad to 4 mrad and 2 mm: a part in 1500 each, and three times that.
            assert each.determined and each.value == pytest.approx(value, abs=2e-3), each
    # Straight lines to a tape tell no lever, whatever wheels say of each other.
    rng, runs = np.random.default_rng(0), []
    for parts in [[(0.3, 0, 0, 5)], [(-0.3, 0, 0, 5)], [(0, 0.3, 0, 5)], [(0, -0.3, 0, 5)]]:
        log, (x, y, _) = drive(moved(lever=1.04), parts, rng)
        runs.append(omnistep.CalibrationRun(log=log, distance_m=float(np.hypot(x, y))))
    found = omnistep.calibrate(runs, vehicle=drawn)
    assert found["all.radius"].determined and not found["all.lever"].determined and not found["all.turn_rad"].determined


@pytest.mark.parametrize("name", ["omni3", "mecanum4", "chugo7"])
def test_one_end_that_is_wrong_is_named_and_leaves_no_interval(name):
    drawn, rng = omnistep.Vehicle(name), np.random.default_rng(4)
    runs = runs_of(built(drawn, rng), rng)
    # Where single wheels are turned it is unknown what is slip to the side.
    common = omnistep.calibrate(runs, vehicle=drawn).common
    assert all(each.determined for each in common if each.name != "all.sideways")
    wrong = runs[5]
    runs[5] = omnistep.CalibrationRun(
        log=wrong.log, end_x_m=wrong.end_x_m + 0.05, end_y_m=wrong.end_y_m, end_yaw_rad=wrong.end_yaw_rad
    )
    found = omnistep.calibrate(runs, vehicle=drawn)
    assert not any(each.determined for each in (*found.common, *found.estimates))
    assert any("run[5] does not fit the others" in line for line in found.undetermined), found.undetermined


def test_a_log_without_an_encoder_at_its_start_is_refused_and_units_are_named():
    drawn, rng = omnistep.Vehicle("mecanum4"), np.random.default_rng(1)
    runs = runs_of(drawn, rng)
    log = {key: column.copy() for key, column in runs[2].log.items()}
    log["wheel_front_left_position_rad"][:3] = np.nan
    with pytest.raises(omnistep.ConfigError, match=r"run\[0\]: it starts without an encoder while it moves"):
        omnistep.calibrate([omnistep.CalibrationRun(log=log, end_x_m=2.4)], vehicle=drawn)
    # Radii were taken for diameters: the wheels are twice as large as drawn.
    far = [
        omnistep.CalibrationRun(
            log=run.log, end_x_m=2 * run.end_x_m, end_y_m=2 * run.end_y_m, end_yaw_rad=run.end_yaw_rad
        )
        for run in runs
    ]
    found = omnistep.calibrate(far, vehicle=drawn)
    assert any("2 times as far as the wheels say: check for diameters for radii" in line for line in found.undetermined)


def test_four_wheels_that_slip_and_count_coarsely_have_intervals_that_hold():
    drawn, covered = omnistep.Vehicle("mecanum4"), []
    for seed in range(24):
        rng = np.random.default_rng(1000 + seed)
        real = built(drawn, rng)
        runs = runs_of(real, rng, counts=210, slip=0.01)
        found = omnistep.calibrate(runs, vehicle=drawn, position_sd_m=0.01, yaw_sd_rad=0.02)
        truth = truth_of(drawn, real)
        covered += [each.low <= truth[each.name] <= each.high for each in found.estimates if each.determined]
    # Of 288 numbers that all but a few are determined; 12 of a run go together, so 24 runs leave 4 %.
    assert len(covered) > 150 and 0.88 <= np.mean(covered) <= 1.0, (len(covered), np.mean(covered))


def test_ends_that_refute_what_was_stated_have_no_interval():
    drawn, rng = omnistep.Vehicle("mecanum4"), np.random.default_rng(2)
    runs = runs_of(built(drawn, rng), rng, noise=20.0)  # 4 cm where 2 mm are stated
    found = omnistep.calibrate(runs, vehicle=drawn, position_sd_m=0.002, yaw_sd_rad=0.005)
    assert not any(each.determined for each in (*found.common, *found.estimates))
    (line,) = [line for line in found.undetermined if line.startswith("no interval is given")]
    assert "the ends are 0.0" in line and "where position_sd_m = 0.002" in line
    # Stated as it is, there is one.
    honest = omnistep.calibrate(runs, vehicle=drawn, position_sd_m=0.04, yaw_sd_rad=0.08)
    assert honest["all.radius"].determined and honest["all.radius"].low < 1.0 + 0.01 < honest["all.radius"].high + 0.02


def test_the_estimate_is_where_scipy_ends_with_odometry_of_its_own():
    drawn = omnistep.Vehicle("omni3")
    rng = np.random.default_rng(11)
    real = built(drawn, rng)
    runs = runs_of(real, rng)
    found = omnistep.calibrate(runs, vehicle=drawn, position_sd_m=TAPE_M, yaw_sd_rad=TURN_RAD)
    wheels = drawn.layout.wheels
    angles = [np.stack([run.log[f"wheel_{name}_position_rad"] for name in drawn.wheel_names], axis=1) for run in runs]

    def residual(x):
        rows = []
        for wheel, (radius, shift, turn) in zip(wheels, x.reshape(-1, 3), strict=True):
            start = np.arctan2(*wheel.rolling_direction[::-1])
            place = np.array(wheel.position_m) + shift * np.array([np.sin(start), -np.cos(start)])
            a = np.array([np.cos(start + turn), np.sin(start + turn)])
            rows.append(np.array([*a, place[0] * a[1] - place[1] * a[0]]) / radius)
        back = np.linalg.inv(np.array(rows))
        left = []
        for run, angle in zip(runs, angles, strict=True):
            along, aside, turn = back @ np.diff(angle, axis=0).T
            yaw = np.cumsum(turn)
            middle, chord = yaw - 0.5 * turn, np.sinc(0.5 * turn / np.pi)
            left += [
                ((chord * (np.cos(middle) * along - np.sin(middle) * aside)).sum() - run.end_x_m) / places,
                ((chord * (np.sin(middle) * along + np.cos(middle) * aside)).sum() - run.end_y_m) / places,
                (yaw[-1] - run.end_yaw_rad) / turns,
            ]
        return np.array(left)

    # The weights that the calibration ended with: what is left over, less what parameters took.
    places, turns = found.position_rms_m, found.yaw_rms_rad
    begin = np.array([[wheel.radius_m, 0.0, 0.0] for wheel in wheels]).ravel()
    oracle = least_squares(residual, begin, x_scale="jac", method="lm", xtol=1e-14, ftol=1e-14)
    for each, value in zip(found.estimates, oracle.x, strict=True):
        # Places weigh against turns a little differently here, as parameters took more of one: a tenth of the interval.
        assert each.value == pytest.approx(value, abs=0.1 * (each.high - each.low)), each.name


def test_a_gyro_and_a_tape_tell_radii_and_levers_but_not_where_ahead_is():
    drawn = omnistep.Vehicle("omni3")
    rng = np.random.default_rng(5)
    real = drawn.replace({"wheel.0.radius_m": 0.0506, "wheel.2.radius_m": 0.0495})
    runs = []
    for parts in DRIVES:
        log, (x, y, _) = drive(real, parts, rng, noise=0.3)
        rows = len(log["time_s"])
        rest = 100
        for key, column in log.items():
            log[key] = np.r_[np.full(rest, column[0]), column] if key != "time_s" else STEP_S * np.arange(rows + rest)
        rate = np.r_[np.zeros(rest + 1), np.concatenate([np.full(round(p[3] / STEP_S), p[2]) for p in parts])]
        log["gyro_rad_s"] = rate + 0.01 + 1e-3 * rng.standard_normal(len(rate))
        # A tape tells nothing of a drive that ends where it began.
        distance = float(np.hypot(x, y))
        runs.append(omnistep.CalibrationRun(log=log, distance_m=distance if distance > 0.5 else None, gyro=True))
    found = omnistep.calibrate(runs, vehicle=drawn)
    held = [each.name for each in found.estimates if not each.determined]
    # Turned as a whole, the vehicle drives the same distances: one direction stays as drawn, no more.
    assert len(held) >= 1 and all(name.endswith("turn_rad") or name.endswith("shift_m") for name in held)
    assert any(held[0] in line and "drive" in line for line in found.undetermined)
    # 2 mm in lines of 2.4 m, twice each.
    assert found["1.radius_m"].value == pytest.approx(0.0506, rel=2e-3)
    assert found["3.radius_m"].value == pytest.approx(0.0495, rel=2e-3)


@pytest.mark.parametrize("noise_rad_s", [0.0, 1e-3, 0.1])
def test_the_gyros_zero_is_found_with_noise_on_velocities(noise_rad_s):
    drawn = omnistep.Vehicle("omni3")
    rng = np.random.default_rng(0)
    runs = []
    for twist in [(0.3, 0, 0), (0, 0.3, 0), (-0.3, 0, 0), (0, -0.3, 0), *[(0, 0, 1)] * 8]:
        twists = np.r_[np.zeros((200, 3)), np.tile(twist, (801, 1))]
        wheels = omnistep.Kinematics(layout=drawn.layout).inverse(twists) + noise_rad_s * rng.standard_normal((1001, 3))
        x, y, _ = omnistep.moved_by([0, 0, 0], 8.01 * np.array(twist))
        log = {"time_s": 0.01 * np.arange(1001), "gyro_rad_s": twists[:, 2] + 0.02}
        log |= {f"wheel_{name}_measured_rad_s": wheels[:, k] for k, name in enumerate(drawn.wheel_names)}
        runs.append(omnistep.CalibrationRun(log=log, end_x_m=x, end_y_m=y, gyro=True))
    found = omnistep.calibrate(runs, vehicle=drawn)
    # 0.1 rad/s in each of 1000 rows is 32 mrad of a wheel, 1.6 mm of its way, 0.2 mm of its lever in a turn of 8 rad:
    # three times that. A zero of 0.02 rad/s left in would be 0.2 rad of 8, or 4 mm of a lever of 0.15 m.
    for each in found.estimates:
        if each.name.endswith("shift_m"):
            assert each.value == pytest.approx(0.0, abs=6e-4), each.name


def test_what_ends_at_a_bound_is_named():
    target = np.repeat([5.0, 1.0], 500)
    # The first lies beyond its range, the second ends at 0, where a friction may well end.
    parameters = [
        Parameter(name="a_kg", unit="kg", start=1.0, scale=1.0, lower=0.5, upper=2.0),
        Parameter(name="b_n_m", unit="N.m", start=1.0, scale=1.0, lower=0.0, upper=9.0),
    ]
    found = fit(lambda x: np.repeat([x[0], 1.0 + x[1]], 500) - target, parameters, needed_by="a test")
    assert found.free.all() and found.x == pytest.approx([2.0, 0.0])
    (line,) = at_bounds(parameters, found)
    assert line.startswith("a_kg ended at the bound of its range, 2 kg")


def test_lines_alone_tell_radii_and_the_rest_is_named():
    drawn = omnistep.Vehicle("omni3")
    rng = np.random.default_rng(6)
    runs = []
    for parts in [DRIVES[2], DRIVES[3], DRIVES[8], DRIVES[9]]:
        log, (x, y, yaw) = drive(drawn, parts, rng)
        runs.append(omnistep.CalibrationRun(log=log, end_x_m=x, end_y_m=y, end_yaw_rad=yaw))
    found = omnistep.calibrate(runs, vehicle=drawn)
    held = {each.name for each in found.estimates if not each.determined}
    # Without a turn levers and radii cannot be separated, and no interval is given for it.
    assert any(name.endswith("shift_m") for name in held)
    assert any("turns on the spot" in line for line in found.undetermined)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_turns_on_the_spot_with_one_larger_wheel_are_no_turn_of_the_whole(seed):
    # The larger wheel pushes the vehicle aside as it turns, which wheels that are all turned would do too.
    drawn, rng = omnistep.Vehicle("chugo7"), np.random.default_rng([seed, 49])
    larger = f"wheel.{rng.integers(7)}.radius_m"
    real = drawn.replace({larger: 1.04 * drawn[larger]})
    runs = []
    for rate, duration_s in ((1.0, 12), (-1.0, 12), (1.0, 8), (-1.0, 8), (0.5, 12)):
        log, (x, y, yaw) = drive(real, [(0, 0, rate, duration_s)], rng, slip=0.003)
        runs.append(omnistep.CalibrationRun(log=log, end_x_m=x, end_y_m=y, end_yaw_rad=yaw))
    turn = omnistep.calibrate(runs, vehicle=drawn)["all.turn_rad"]
    # What the runs do not tell keeps the file's value, 0, to what single wheels have of it.
    assert turn.determined or abs(turn.value) < 0.02, turn


def test_a_simulated_vehicle_is_found_from_its_logs(tmp_path):
    drawn = omnistep.Vehicle("mecanum4")
    real = {"wheel.0.radius_m": 0.0768, "wheel.3.radius_m": 0.0754, "wheel.1.position_m": [0.25, -0.206]}
    twists = [
        (0.3, 0, 0),
        (-0.3, 0, 0),
        (0, 0.3, 0),
        (0, -0.3, 0),
        (0, 0, 0.8),
        (0, 0, -0.8),
        (0.3, 0.1, 0.4),
        (-0.2, 0.2, -0.4),
    ]
    lines = ["yaw_sd_rad = 0.001"]
    for k, (vx, vy, wz) in enumerate(twists):
        stop = {"at_s": 4.0, "vx_m_s": 0.0, "vy_m_s": 0.0, "wz_rad_s": 0.0, "ramp_s": 0.5}
        scenario = omnistep.Scenario(
            "flat",
            vehicle=drawn.replace(real),
            overrides={
                "physics.engine": "articulated", "duration_s": 5.0, "sensors.encoder_counts": 4096,
                "control.policy": "independent", "command.vx_m_s": vx, "command.vy_m_s": vy, "command.wz_rad_s": wz,
                "command.ramp_s": 0.5, "command.then": [stop],
            },
        )  # fmt: skip
        trace = omnistep.run(scenario, mcap=tmp_path / f"{k}.mcap")
        x, y, yaw = (float(trace[f"pose_{each}"][-1]) for each in ("x_m", "y_m", "yaw_rad"))
        lines += ["[[run]]", f'log = "{k}.mcap"', f"end_x_m = {x}", f"end_y_m = {y}", f"end_yaw_rad = {yaw}"]
    (tmp_path / "runs.toml").write_text("\n".join(lines))
    (tmp_path / "drawn.toml").write_text(drawn.to_toml())
    done = subprocess.run(
        [sys.executable, "-m", "omnistep", "calibrate", "runs.toml", "--vehicle", "drawn.toml", "-o", "found.toml"],
        cwd=tmp_path, capture_output=True, text=True,
    )  # fmt: skip
    # Where reading takes more than a second a bar says how far it is.
    assert done.returncode == 0 and "error" not in done.stderr and "warning" not in done.stderr, done.stderr
    assert (
        "front_left.radius_m" in done.stdout
        and "no run can tell the position of a wheel along its force" in done.stdout
    )
    found = omnistep.Vehicle(tmp_path / "found.toml")
    # Wheels slip by some hundred thousandths on the way: 0.1 % of a radius of 1 % off.
    assert found["wheel.0.radius_m"] == pytest.approx(0.0768, rel=1e-3)
    assert found["wheel.3.radius_m"] == pytest.approx(0.0754, rel=1e-3)
    assert found["wheel.2.radius_m"] == pytest.approx(0.0760, rel=1e-3)


def test_what_is_wrong_is_said_in_one_line(tmp_path):
    drawn = omnistep.Vehicle("omni3")
    log, (x, _, _) = drive(drawn, DRIVES[2], np.random.default_rng(0))
    run = omnistep.CalibrationRun
    rate = np.zeros(len(log["time_s"]))
    gap = {key: np.delete(column, np.s_[50:70]) for key, column in log.items()}
    cases = [
        ([], {}, "runs: empty"),
        ([run(log=log)], {}, "run[0]: no measurement"),
        ([run(log=log, end_x_m=float("nan"))], {}, "run[0].end_x_m = nan, allowed: -1000 to 1000"),
        ([run(log=log, end_x_m=x)], {"position_sd_m": 0.0}, "position_sd_m = 0.0, allowed: 1e-06 to 10"),
        ([run(log=log, gyro=True)], {}, "no column gyro_rad_s"),
        (
            [run(log=log | {"gyro_rad_s": rate}, gyro=True)],
            {},
            "run[0]: the wheels stand 0 s at its start, allowed: at least 0.5 s",
        ),
        ([run(log=log | {"gyro_rad_s": np.nan * rate}, gyro=True)], {}, "run[0]: gyro_rad_s has no number"),
        ([run(log=log, distance_m=-2.0)], {}, "run[0].distance_m = -2.0, allowed: 0 to 1000"),
        ([run(log=gap, end_x_m=x)], {}, "0.4 s without encoders, allowed: gaps up to 0.1 s"),
        ([run(log={"time_s": log["time_s"]}, end_x_m=x)], {}, "no column wheel_1_measured_rad_s"),
        ([run(log={key: 0 * c if key != "time_s" else c for key, c in log.items()}, end_x_m=x)], {}, "no wheel turns"),
    ]
    for runs, more, message in cases:
        with pytest.raises(omnistep.ConfigError) as refused:
            omnistep.calibrate(runs, vehicle=drawn, **more)
        assert message in str(refused.value)
        assert "\n" not in str(refused.value) and "allowed: " in str(refused.value)
    for text, message in [
        ("run = 3", "no [[run]]"),
        ("[[run]]\nlog = 3", "run[0].log = 3"),
        ('[[run]]\nlog = "a.csv"\nend_z_m = 1.0', "run[0].end_z_m: unknown key (did you mean end_y_m?)"),
        ('[[run]]\nlog = "a.csv"\nend_x_m = "far"', "run[0].end_x_m = 'far', allowed: -1000 to 1000"),
        ("[[run", "allowed: a TOML file"),
        ("run = " + "[" * 100_000, "nested too deeply"),
        ('[[run]]\nlog = "a.csv"\nend_x_m = 0x' + "f" * 5000, "run[0].end_x_m: a whole number of 20000 bits"),
        (
            "schema_version = 1\n" + ".".join(["a"] * 200_000) + " = 1",
            "line 2: more than 100 dots in a key, allowed: 100",
        ),
        ("a = " + "1.5," * 300_000, "1200004 bytes, allowed: 1048576"),
        ('schema_version = 2\n[[run]]\nlog = "a.csv"', "schema_version = 2, allowed: 1"),
    ]:
        (tmp_path / "runs.toml").write_text(text)
        with pytest.raises(omnistep.ConfigError) as refused:
            read_runs(tmp_path / "runs.toml")
        assert "runs.toml" in str(refused.value) and message in str(refused.value) and "\n" not in str(refused.value)


def test_what_the_runs_do_not_tell_keeps_the_files_value():
    drawn, rng = omnistep.Vehicle("mecanum4"), np.random.default_rng(6)
    real = drawn.replace({f"wheel.{k}.radius_m": 1.02 * 0.076 for k in range(4)})
    lines = [[(0.3, 0, 0, 5)], [(-0.3, 0, 0, 5)], [(0, 0.3, 0, 5)], [(0, -0.3, 0, 5)]]
    cases = {"one distance on a curve": 0, "straight lines": 2, "a gyro and a tape": 3, "all of it": 4}
    for what, common in cases.items():
        runs = []
        for parts in [[(0.3, 0.1, 0.3, 8)]] if common == 0 else lines if common == 2 else DRIVES:
            log, (x, y, yaw) = drive(real, parts, rng)
            far = float(np.hypot(x, y))
            if common == 0:
                runs.append(omnistep.CalibrationRun(log=log, distance_m=0.6 * far))
            elif common == 2:
                runs.append(omnistep.CalibrationRun(log=log, distance_m=far))
            elif common == 3:
                # A tape and the heading tell distances and turns, not where ahead is.
                more = {"distance_m": far} if far > 0.5 else {}
                runs.append(omnistep.CalibrationRun(log=log, end_yaw_rad=yaw, **more))
            else:
                runs.append(omnistep.CalibrationRun(log=log, end_x_m=x, end_y_m=y, end_yaw_rad=yaw))
        found = omnistep.calibrate(runs, vehicle=drawn)
        assert sum(each.determined for each in found.common) == common, what
        for each in (*found.common, *found.estimates):
            # Exactly: nothing of it was estimated.
            assert each.held == (each.note == "these runs do not tell it"), (what, each)
            assert each.determined or each.held or each.note in ("as all wheels are", "only together with others")
        for each in found.common:
            assert each.determined or each.value == each.before, (what, each)
        if common:
            # Four lines of 1.5 m to 2 mm: a part in 1500; three times that.
            assert found["all.radius"].value == pytest.approx(1.02, abs=2e-3), what
        if common < 2:
            # Nothing of a lever is determined, of any wheel.
            assert found.vehicle["wheel.0.position_m"] == drawn["wheel.0.position_m"], what
        if common == 0:
            assert found.vehicle["wheel.3.radius_m"] == drawn["wheel.3.radius_m"]
        # A table says "held" of what is held alone.
        for line, each in zip(found.table().splitlines()[1:], (*found.common, *found.estimates), strict=False):
            assert line.startswith(each.name) and ("held: " in line) == each.held, line


def test_refuted_results_are_no_file_unless_it_is_asked_for(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    drawn, rng = omnistep.Vehicle("mecanum4"), np.random.default_rng(7)
    columns = ["time_s", *(f"wheel_{name}_position_rad" for name in drawn.wheel_names)]
    written = []
    for k, parts in enumerate(DRIVES):
        log, end = drive(drawn, parts, rng)
        rows = np.stack([log[key] for key in columns], axis=1)
        np.savetxt(f"{k}.csv", rows, delimiter=",", header=",".join(columns), comments="", fmt="%.6f")
        written.append(end)

    def command(scale, *more, off_m=0.0):
        lines = [
            f'[[run]]\nlog = "{k}.csv"\nend_x_m = {scale * x + off_m * (k == 3)}\nend_y_m = {scale * y}\n'
            f"end_yaw_rad = {yaw}\n"
            for k, (x, y, yaw) in enumerate(written)
        ]
        (tmp_path / "runs.toml").write_text("".join(lines))
        (tmp_path / "found.toml").unlink(missing_ok=True)
        code = _identify_cli.calibrate(["runs.toml", "--vehicle", "mecanum4", "-o", "found.toml", *more])
        return code, *capsys.readouterr(), (tmp_path / "found.toml").exists()

    code, _, wrong, there = command(1.0)
    assert (code, wrong, there) == (0, "", True)
    # An end that is 0.4 m off; ends in units of which the wheels would have to be half as large.
    for given, reason in [
        ((1.0, 0.4), "error: found.toml: not written: run[3] (3.csv) does not fit the others, which fit "),
        ((0.5, 0.0), "error: found.toml: not written: "),
    ]:
        code, said, wrong, there = command(given[0], off_m=given[1])
        assert (code, there) == (1, False), wrong
        assert "all.radius" in said and wrong.startswith(reason) and wrong.count("\n") == 1, wrong
        assert wrong.endswith("; --write-doubtful writes it all the same\n")
        code, _, wrong, there = command(given[0], "--write-doubtful", off_m=given[1])
        assert (code, there) == (0, True) and wrong.startswith("found.toml: doubtful: "), wrong
    assert "as far as is searched; check units" in said


def test_what_ends_where_the_search_does_is_doubted():
    drawn, rng = omnistep.Vehicle("omni3"), np.random.default_rng(8)
    # A quarter of the way that the wheels turned: no residual refutes two lines, but no wheel is so small.
    runs = []
    for parts in [[(0.3, 0, 0, 5)], [(0, 0.3, 0, 5)]]:
        log, (x, y, _) = drive(drawn, parts, rng)
        runs.append(omnistep.CalibrationRun(log=log, distance_m=0.25 * float(np.hypot(x, y))))
    found = omnistep.calibrate(runs, vehicle=drawn)
    # 45 % below the drawing is as far as is searched.
    assert found.doubted.endswith("in the file, as far as is searched")
    assert found["all.radius"].value == pytest.approx(0.55, abs=0.01)
    ends = [drive(drawn, parts, rng) for parts in DRIVES]
    fine = [omnistep.CalibrationRun(log=log, end_x_m=x, end_y_m=y, end_yaw_rad=yaw) for log, (x, y, yaw) in ends]
    assert omnistep.calibrate(fine, vehicle=drawn).doubted == ""


def test_ends_that_a_hand_measured_have_intervals_that_hold_with_nothing_stated():
    # A tape to 4 mm, an angle to 8 mrad, and in each run each wheel slips by 0.5 % of its way: twelve runs.
    drawn, seeds, held = omnistep.Vehicle("omni3"), 24, {"all.radius": 0, "all.lever": 0}
    factors = {"all.radius": 1.03, "all.lever": 1.05}
    keys = {f"wheel.{k}.radius_m": 1.03 * wheel.radius_m for k, wheel in enumerate(drawn.layout.wheels)}
    places = {f"wheel.{k}.position_m": [1.05 * x for x in w.position_m] for k, w in enumerate(drawn.layout.wheels)}
    real = drawn.replace(keys | places)
    for seed in range(seeds):
        rng, runs = np.random.default_rng(9000 + seed), []
        for parts in DRIVES:
            log, (x, y, yaw) = drive(real, parts, rng, counts=360, noise=2.0)
            log |= {key: (1 + 0.005 * rng.standard_normal()) * log[key] for key in log if key != "time_s"}
            runs.append(omnistep.CalibrationRun(log=log, end_x_m=x, end_y_m=y, end_yaw_rad=yaw))
        found = omnistep.calibrate(runs, vehicle=drawn)
        assert not found.doubted, (seed, found.doubted)
        for name, factor in factors.items():
            each = found[name]
            held[name] += each.determined and each.low <= factor <= each.high
            # Of use: half of it is less than 3 %, which is what the drawing's radius is off by.
            assert 0.5 * (each.high - each.low) < 0.03, (seed, each)
    # Fewer than these come by chance in one of a thousand tests of intervals that hold in 95 %.
    assert min(held.values()) >= binom.ppf(0.001, seeds, 0.95), held
