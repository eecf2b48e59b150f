"""Section 3.3 of the paper."""

import numpy as np
import pytest

import omnistep


def at(trace, time_s):
    return trace.speed_rpm[np.argmin(np.abs(trace.t_s - time_s))]


@pytest.mark.parametrize(
    ("time_s", "rpm"), [(13, 100.0), (20, 92.0), (30, 76.89), (45, 76.89), (54, 76.89), (59.9, 96.75), (64, 100.0)]
)
def test_with_scaled_references_wheels_share_the_speed_that_the_most_loaded_can_hold(time_s, rpm):
    # 0.2 rpm: at 54 s wheel B, unloaded two seconds before, is still 0.08 rpm above.
    np.testing.assert_allclose(at(omnistep.run_motor_bench("scale_references"), time_s), rpm, atol=0.2)


def test_literal_equation_12_does_not_converge():
    trace = omnistep.run_motor_bench("scale_torques")
    a, _, c = at(trace, 45)
    assert a - c > 5
    assert np.ptp(trace.speed_rpm[trace.t_s > 53], axis=1).max() > 50


def test_friction_is_a_key_like_any_other():
    trace = omnistep.run_motor_bench(overrides={"friction_n_m_s_rad": 2e-4})
    np.testing.assert_allclose(at(trace, 30), 76.3, atol=0.1)
    assert len(trace) == 651 == trace.t_s.size
    assert trace.load_n_m_s_rad.shape == trace.torque_n_m.shape == (651, 3)
