"""Fits of long logs cost few evaluations, in one thread, and what replaced parts of SciPy gives their numbers."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest
from scipy import signal, stats
from threadpoolctl import threadpool_info, threadpool_limits

import omnistep
from omnistep import _blas_threads, _calibration_poses
from omnistep._calibration_fit import Problem
from omnistep._estimates import times_deviation
from omnistep._motion_model import Motion, lagging

SPEC = importlib.util.spec_from_file_location("wheel_plant", Path(__file__).with_name("wheel_plant.py"))
plant = importlib.util.module_from_spec(SPEC)
SPEC.loader.exec_module(plant)
# A minute at 200 Hz: the drive three times, at three speeds.
plant.PERIOD_S = 0.005
ONCE, ROWS = plant.commands, 12_000
plant.commands = lambda top: np.concatenate([part * ONCE(np.array(top)) for part in (1.0, 0.9, 1.1)])[:ROWS]

#: Evaluations of a minute of log. There are two searches: with independent errors, and with the estimated noise. Each
#: takes up to 9 steps with differences for seven parameters, eight evaluations and one more to try the step: 81; and a
#: dozen more beside bounds and for what is held. When differences were as small as rounding, it was 5118.
MOST = 200


@pytest.mark.parametrize(("counts", "noise_rad_s"), [(10_000_000, 0.0), (360, 0.0), (4096, 0.3), (360, 0.3)])
def test_a_minute_at_200_hz_takes_few_evaluations_whatever_the_readings(counts, noise_rad_s, monkeypatch):
    vehicle = omnistep.Vehicle("mecanum4")
    mass, _, yaw = plant.masses(vehicle)
    truth = {
        "mass_kg": 1.15 * mass,
        "yaw_inertia_kg_m2": 0.9 * yaw,
        "wheel_inertia_kg_m2": vehicle["wheel.0.inertia_kg_m2"],
        "gear_friction_n_m": 0.06,
        "viscous_n_m_s_rad": 0.004,
        "delay_s": 0.005,
        "lag_s": 0.03,
    }
    drive = {"kp": 0.3, "ki": 0.8, "top": (0.8, 0.6, 1.6)}
    (log,) = plant.logs(vehicle, truth, [1], counts=counts, noise_rad_s=noise_rad_s, parts=4, **drive)
    assert len(log["time_s"]) == ROWS
    evaluated = []
    residual = Motion.residual
    monkeypatch.setattr(Motion, "residual", lambda self, p: evaluated.append(p) or residual(self, p))
    found = omnistep.identify(log, vehicle=vehicle, progress=False)
    # All parameters but rolling resistance, which a log on the ground cannot separate from gear friction.
    assert sum(each.determined for each in found.estimates) == 7
    assert len(evaluated) < MOST
    # Filters of whole columns are few: a step of a parameter goes to another delay or lag and back.
    assert len({each["lag_s"] for each in evaluated}) < MOST / 5
    assert found["mass_kg"].value == pytest.approx(truth["mass_kg"], rel=0.01)


def test_a_calibration_of_a_minute_takes_few_evaluations_and_its_bar_ends_full(pose_plant, monkeypatch):
    log = pose_plant.driven(np.random.default_rng(0))
    evaluated, shown = [], []
    groups = Problem.groups
    monkeypatch.setattr(Problem, "groups", lambda self, u: evaluated.append(u) or groups(self, u))

    class Seen:
        n = 0.0
        __enter__, __exit__ = lambda self: self, lambda *_: None

        def update(self, part):
            self.n += part
            shown.append(self.n)

    monkeypatch.setattr("omnistep._progress.counter", lambda **_: Seen())
    omnistep.calibrate([omnistep.CalibrationRun(log=log, pose=True)], vehicle="mecanum4")
    # Two models, one of them with and without slip to the side, each again with what is not determined held. A step of
    # 19 parameters takes 39; searches end within some steps.
    assert len(evaluated) < 1000
    assert len(shown) == len(evaluated) + 1 and np.all(np.diff(shown) >= 0.0)
    assert shown[-1] == pytest.approx(1.0)


def blas_threads():
    return {each["num_threads"] for each in threadpool_info() if each["user_api"] == "blas"}


def test_fits_compute_in_one_thread_and_leave_the_number_as_it_was():
    with threadpool_limits(2, "blas"):
        before = blas_threads()

        def fit():
            with _blas_threads.one_thread("a test"):
                assert blas_threads() == {1}
                with _blas_threads.one_thread("a test"):
                    pass
                assert blas_threads() == {1}

        fit()
        assert blas_threads() == before


def test_lags_parabolas_and_quantiles_are_those_of_scipy():
    rng = np.random.default_rng(0)
    series, step = rng.standard_normal((500, 4)), 0.005 / 0.03
    keep = np.exp(-step)
    # Some hundred roundings.
    np.testing.assert_allclose(
        lagging(series, step), signal.lfilter([1 - keep], [1, -keep], series, axis=0), atol=1e-13
    )
    poses = rng.standard_normal((60, 3))
    for rows in (5, 21):
        smoothed = _calibration_poses._smooth(poses, rows)
        np.testing.assert_allclose(smoothed, signal.savgol_filter(poses, rows, 2, axis=0), atol=1e-13)
    freedom = np.array([1.0, 2.5, 30.0, np.inf])
    np.testing.assert_allclose(times_deviation(freedom, "a test"), stats.t.ppf(0.975, freedom), rtol=1e-12)
