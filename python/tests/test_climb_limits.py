"""What a step takes at least: torque and run-up of each row of wheels."""

import pickle

import numpy as np
import pytest

import omnistep


def limits(height_m=0.05, friction=0.7, torque_n_m=1.4, **more):
    keys = {"terrain.height_m": height_m, "terrain.friction": friction, "vehicle.motor.stall_torque_n_m": torque_n_m}
    return omnistep.climb_limits(overrides={**keys, **more})


@pytest.mark.parametrize(
    ("height_m", "friction", "torque_n_m"),
    [
        (0.05, 0.55, [2.09, np.inf, np.inf]),
        (0.05, 0.70, [1.33, 2.48, np.inf]),
        (0.05, 0.85, [1.31, 2.21, 2.00]),
        (0.04, 0.70, [1.09, 1.83, 1.66]),
    ],
)
def test_least_torques_are_those_of_an_earlier_study(height_m, friction, torque_n_m):
    # 1.5 %: the study began 0.1 mm up the edge, where it takes up to 1 % less, and rounded to 0.01 N.m.
    np.testing.assert_allclose(limits(height_m, friction).least_torque_n_m, torque_n_m, rtol=0.015)


def test_run_up_by_momentum_is_that_of_the_study_and_at_least_less():
    found = limits(torque_n_m=1.0)
    mass_kg = 22.5  # 20 kg, and five wheels of 1 kg that turn as discs
    by_momentum = np.sqrt(2 * found.deficit_j * found.path_mass_kg) / mass_kg
    # 3 % and 0.01 m/s, as in crates/omni-bound/tests/laws.rs.
    np.testing.assert_allclose(by_momentum, [0.23, 0.51, 0.36], rtol=0.03, atol=0.01)
    of_energy = np.sqrt(2 * found.deficit_j / mass_kg)
    # Rounding: both are the same three numbers.
    np.testing.assert_allclose(found.run_up_m_s, of_energy / np.sqrt(found.kept_at_most), rtol=1e-9)
    np.testing.assert_allclose(found.path_run_up_m_s, of_energy / np.sqrt(found.kept_on_path), rtol=1e-9)
    assert (found.run_up_m_s <= found.path_run_up_m_s).all()


def test_verdicts_follow_speed_and_torque():
    assert limits(torque_n_m=3.0).verdicts == ["torque", "torque", "run_up"]
    weak = limits(torque_n_m=1.0)
    assert (weak.verdicts[1], weak.possible, weak.decisive) == ("impossible", False, "middle")
    fast = limits(torque_n_m=1.0, **{"command.vx_m_s": 0.7})
    assert fast.possible and fast.verdicts[1] == "run_up" and fast.speed_m_s == 0.7


def test_run_up_never_rises_with_torque():
    run_ups = np.array([limits(torque_n_m=torque).run_up_m_s for torque in (0.4, 0.8, 1.2, 1.6, 2.0, 2.6)])
    assert (np.diff(run_ups, axis=0) <= 1e-9).all()  # rounding


def test_a_bound_is_a_value():
    one, other = (
        limits(),
        omnistep.climb_limits(omnistep.Scenario("step", overrides={"vehicle.motor.stall_torque_n_m": 1.4})),
    )
    assert one == other != limits(0.04)
    assert pickle.loads(pickle.dumps(one)) == one
    assert (one.vehicle, one.height_m, one.friction, one.torque_n_m, one.speed_m_s) == ("chugo7", 0.05, 0.7, 1.4, 0.3)
    assert one.rows == ["front", "middle", "rear"] and one.wheels == [["5", "6", "7"], ["4"], ["1", "2", "3"]]
    assert repr(one) == "<omnistep.ClimbLimits of chugo7 over 0.05 m: not excluded, the middle row is decisive>"


@pytest.mark.parametrize(
    ("scenario", "overrides", "key", "said"),
    [
        ("step", {"vehicle": "omni3"}, "vehicle", "vehicle omni3: it has 0 transverse hinges"),
        ("step", {"vehicle": "rocker_bogie6"}, "vehicle", "its hinges are coupled"),
        ("stairs", {}, "terrain.kind", "not a plain step"),
        ("step", {"terrain.height_m": 0.07}, "terrain.height_m", "less than 0.066, the radius"),
        ("step", {"start.heading_rad": 0.1}, "start.heading_rad", "0.1, allowed for climb limits: 0"),
        ("step", {"command.wz_rad_s": 0.5}, "command.wz_rad_s", "0.5, allowed for climb limits: 0"),
        ("step", {"terrain.hight_m": 0.05}, "terrain.hight_m", "height_m"),
    ],
)
def test_what_no_bound_is_there_for_is_refused_by_key(scenario, overrides, key, said):
    with pytest.raises(omnistep.ConfigError, match=said) as caught:
        omnistep.climb_limits(scenario, overrides=overrides)
    assert caught.value.key == key and len(str(caught.value).splitlines()) == 1
