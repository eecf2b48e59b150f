"""Logs of wheels as calibration and identification read them: angles of a recording, times that are nearly a grid."""

import numpy as np
import pytest

import omnistep
from omnistep._wheel_logs import read


def test_angles_of_a_recording_are_read():
    drawn = omnistep.Vehicle("omni3")
    turns = omnistep.Kinematics(layout=drawn.layout).inverse([(0.4, 0.0, 0.0)] * 300) * 0.02
    log = {"time_s": 0.02 * np.arange(300)}
    log |= {f"wheel_{name}_position_rad": np.cumsum(turns[:, k]) for k, name in enumerate(drawn.wheel_names)}
    recorded = {
        key.replace("wheel_", "sensed_wheel_rad_").removesuffix("_position_rad"): column for key, column in log.items()
    }
    assert "sensed_wheel_rad_1" in recorded
    np.testing.assert_array_equal(read(recorded, drawn).positions, read(log, drawn).positions)


@pytest.mark.parametrize("rate_hz", [100, 150, 300, 400])
def test_times_may_be_rounded_to_milliseconds(rate_hz):
    drawn = omnistep.Vehicle("omni3")
    rows = np.r_[0:4000, 4100:9000]
    angles = 0.02 * rows
    log = {f"wheel_{name}_position_rad": angles for name in drawn.wheel_names}
    found = read({"time_s": np.round(rows / rate_hz, 3), **log}, drawn)
    # A line through 8900 times that are 0.3 ms off tells a period to a part of 1e-6 or so.
    assert found.period_s == pytest.approx(1 / rate_hz, rel=1e-5)
    assert len(found.measured) == 9000
    there = np.isfinite(found.positions[:, 0])
    np.testing.assert_array_equal(np.flatnonzero(there), rows)
    np.testing.assert_allclose(found.measured[there][1:], 0.02 * rate_hz, rtol=1e-5)


def test_times_that_are_no_grid_are_refused_in_one_line():
    drawn = omnistep.Vehicle("omni3")
    rng = np.random.default_rng(1)
    regular = 0.01 * np.arange(1000)
    twice = np.sort(np.r_[regular, 5.001])
    loose = np.sort(regular + 0.01 * rng.random(1000))
    for time, message in [
        (twice, "time_s has two rows in one period of 0.01 s, at 5.001 s"),
        (loose, "of 1000 times of time_s are more than 0.35 periods of 0.0"),
        (np.round(np.arange(1000) / 700, 3), "43 % of the steps of time_s are two periods of 0.001 s"),
        (np.r_[regular, 1e300], "time_s spans 1e+302 periods, allowed: up to 5000000"),
    ]:
        with pytest.raises(omnistep.ConfigError) as refused:
            read({"time_s": time, **{f"wheel_{k}_measured_rad_s": np.ones(len(time)) for k in (1, 2, 3)}}, drawn)
        assert message in str(refused.value) and "\n" not in str(refused.value) and "allowed: " in str(refused.value)
    # Rows that come 0.1 periods early or late (one standard deviation) are in their periods, one in 2000 is left out.
    shaken = regular + 0.001 * rng.standard_normal(1000)
    found = read({"time_s": shaken, **{f"wheel_{k}_position_rad": np.arange(1000.0) for k in (1, 2, 3)}}, drawn)
    there = np.isfinite(found.positions[:, 0])
    assert len(there) == 1000 and there.sum() > 990
    np.testing.assert_array_equal(found.positions[there, 0], np.flatnonzero(there))
    # A row that comes 0.45 periods late stands alone, and is left out.
    late = regular.copy()
    late[500] += 0.0045
    log = {"time_s": late, **{f"wheel_{k}_measured_rad_s": np.ones(1000) for k in (1, 2, 3)}}
    np.testing.assert_array_equal(np.flatnonzero(np.isnan(read(log, drawn).measured[:, 0])), [500])
