"""Figures: the data drawn is the data given, on the axes given."""

import matplotlib.pyplot as plt
import numpy as np
import pytest

import omnistep


@pytest.fixture(autouse=True)
def close_figures():
    yield
    plt.close("all")


def line(ax, label):
    (found,) = [each for each in ax.lines if each.get_label() == label]
    return found


def test_climb_draws_a_front_a_middle_and_a_rear_wheel_with_their_reference(climb):
    axes = omnistep.plot.climb(climb)
    assert axes.shape == (3,)
    for label, wheel in {"front (wheel 5)": 4, "middle (wheel 4)": 3, "rear (wheel 1)": 0}.items():
        np.testing.assert_array_equal(line(axes[0], label).get_ydata(), climb.wheels("disturbed_ratio")[:, wheel])
        np.testing.assert_array_equal(line(axes[1], label).get_ydata(), climb.wheels("slip_ratio")[:, wheel])
        np.testing.assert_array_equal(line(axes[2], label).get_ydata(), climb.wheels("measured_rad_s")[:, wheel])
    assert line(axes[2], "reference").get_ydata()[-1] == pytest.approx(0.3 / 0.066)
    assert axes[2].get_xlabel() == "time [s]"


def test_climb_turns_wheels_on_the_left_the_way_of_the_vehicle(climb):
    axes = omnistep.plot.climb(climb, wheels=["3"])
    np.testing.assert_array_equal(line(axes[2], "wheel 3").get_ydata(), -climb.wheels("measured_rad_s")[:, 2])
    with pytest.raises(KeyError, match="allowed: 1, 2, 3"):
        omnistep.plot.climb(climb, wheels=["9"])


def test_axes_given_are_drawn_on_and_returned(climb):
    _, given = plt.subplots(3)
    returned = omnistep.plot.climb(climb, axes=given)
    assert all(a is b for a, b in zip(returned, given, strict=True))
    _, ax = plt.subplots()
    assert omnistep.plot.strip(climb, ax=ax) is ax
    with pytest.raises(ValueError, match="allowed: 3"):
        omnistep.plot.climb(climb, axes=given[:2])


def test_strip_marks_the_middle_joint_every_three_tenths(climb):
    ax = omnistep.plot.strip(climb)
    points = line(ax, "joint on wheel 4, every 0.3 s")
    assert len(points.get_xdata()) == 21  # 0 to 6 s
    np.testing.assert_array_equal(points.get_xdata()[1:], climb["wheel_4_x_m"][299::300])
    assert points.get_ydata()[-1] == pytest.approx(0.05 + 0.066, abs=1e-3)  # on the upper plane
    with pytest.raises(ValueError, match="allowed: > 0"):
        omnistep.plot.strip(climb, every_s=0.0)


def test_wheels_draws_each_wheel_of_each_run_and_the_loads():
    runs = [omnistep.wheels("paper"), omnistep.wheels("synchronised")]
    axes = omnistep.plot.wheels(runs)
    for k in range(3):
        for run in runs:
            np.testing.assert_array_equal(line(axes[k], run.policy).get_ydata(), run.speed_rpm[:, k])
    np.testing.assert_array_equal(line(axes[3], "load C").get_ydata(), runs[0].load_n_m_s_rad[:, 2])
    assert omnistep.plot.wheels(runs[0]).shape == (4,)
