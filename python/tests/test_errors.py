"""What is said of bad input: one line, the key, the file, what is allowed."""

import os
import re
import warnings

import numpy as np
import pytest

import omnistep


def refused(call, *args, **kwargs):
    with pytest.raises(omnistep.ConfigError) as caught:
        call(*args, **kwargs)
    message = str(caught.value)
    assert "\n" not in message
    assert "allowed" in message or "expected" in message
    return caught.value


def test_exceptions_form_a_tree_that_python_programs_can_catch():
    assert issubclass(omnistep.ConfigError, omnistep.OmnistepError)
    assert issubclass(omnistep.ConfigError, ValueError)
    assert issubclass(omnistep.LogError, OSError)
    assert issubclass(omnistep.SimulationError, omnistep.OmnistepError)


@pytest.mark.parametrize(
    ("overrides", "key"),
    [
        ({"terrain.friction": float("nan")}, "terrain.friction"),
        ({"vehicle.wheel.2.radius_m": 0.0}, "wheel[2].radius_m"),
        ({"vehicle.body.0.mass_kg": -1}, "body[0].mass_kg"),
        ({"control.policy": "papier"}, "control.policy"),
        ({"control.period_s": 0.00075}, "control.period_s"),
        ({"command.vx": 0.3}, "command.vx"),
        ({"terrain.height_m": -0.01}, "terrain.height_m"),
    ],
)
def test_a_bad_override_is_refused_with_its_key_and_file(overrides, key):
    error = refused(omnistep.run, "step", overrides=overrides)
    assert error.key == key
    assert error.file in ("built-in step", "built-in chugo7")


def test_unknown_names_come_with_the_names_there_are():
    assert "step, flat" in str(refused(omnistep.run, "stairway"))
    assert "shared_integral" in str(refused(omnistep.run, "step", policy="papier"))
    assert "independent, scale_torques, scale_references" in str(refused(omnistep.run_motor_bench, "shared_integral"))


@pytest.mark.parametrize("seed", [-1, 2**63, 2**64])
def test_a_seed_that_a_log_could_not_give_back_is_refused(seed):
    assert refused(omnistep.run, "flat", seed=seed).key == "seed"
    assert refused(omnistep.run, "flat", overrides={"seed": seed}).key == "seed"


def test_what_is_refused_is_not_warned_of_before():
    # Without an inertial unit traction control is warned of where it can be had, as in a simulation.
    blind = {"sensors.no_imu": True}
    with pytest.warns(UserWarning, match="without an inertial measurement unit"):
        omnistep.Simulation(omnistep.Scenario("flat", policy="traction", overrides=blind))
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        for policy in ("traction", "traction_runup"):
            with pytest.raises(omnistep.ConfigError, match=policy):
                omnistep.Controller("flat", policy=policy, overrides=blind)
    assert said == []


def test_a_file_that_cannot_be_read_is_named(tmp_path):
    with pytest.raises(omnistep.ConfigError, match=r"absent\.toml: ") as caught:
        omnistep.Simulation(tmp_path / "absent.toml")
    assert caught.value.file == str(tmp_path / "absent.toml")
    error = refused(omnistep.run_motor_bench, experiment=tmp_path)
    assert error.file == str(tmp_path) and str(error).endswith(": a directory, allowed: a regular file")


def test_a_file_with_a_typo_is_named(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text('schema_version = 1\nname = "mine\nvehicle = "chugo7"\n')
    with pytest.raises(omnistep.ConfigError, match=r"mine\.toml:2: ") as caught:
        omnistep.run(path)
    assert caught.value.file == str(path)


def test_a_command_that_is_not_finite_is_refused_and_nothing_happens():
    sim, twin = omnistep.Simulation("flat"), omnistep.Simulation("flat")
    for bad in [(np.nan, 0.0, 0.0), (0.0, np.inf, 0.0)]:
        assert refused(sim.step, bad).key in ("vx_m_s", "vy_m_s")
    for bad in [(0.1, 0.0), (0.1, 0.0, 0.0, 0.0), (), np.zeros(7), (10**400, 0, 0)]:
        assert refused(sim.step, bad).key == "command"
    assert "one finite torque for each wheel" in str(refused(sim.step_torques, [0.0] * 6))
    assert sim.time_s == 0.0
    a, b = sim.step((0.1, 0.0, 0.0)), twin.step((0.1, 0.0, 0.0))
    np.testing.assert_array_equal(a.applied_n_m, b.applied_n_m)


def test_arguments_of_the_wrong_kind_are_type_errors():
    sim = omnistep.Simulation("flat")
    for bad in (0.3, None, "abc", ("0.3", 0, 0), [None, 0, 0], [1 + 1j, 0, 0]):
        with pytest.raises(TypeError, match=r"^command: .*allowed: three finite numbers"):
            sim.step(bad)
        with pytest.raises(TypeError, match=r"^torques_n_m: .*allowed: one finite torque for each wheel"):
            sim.step_torques(bad)
    with pytest.raises(TypeError, match="allowed: a list of names"):
        omnistep.compare("flat", policies="scale_torques")
    assert sim.time_s == 0.0
    with pytest.raises(TypeError, match="allowed: a number"):
        omnistep.run("flat", overrides={"terrain.friction": object()})


def test_a_log_that_cannot_be_written_is_named(tmp_path):
    path = tmp_path / "missing" / "x.mcap"
    with pytest.raises(omnistep.LogError, match="missing") as caught:
        omnistep.run("flat", mcap=path)
    assert caught.value.file == f"{path}.part"  # the name it has until it is whole


def test_a_simulation_that_diverged_says_so_ever_after():
    # The motor's own line bounds what acts, whatever is commanded: only motors of 10^6 N.m drive the physics apart.
    strong = {"vehicle.motor.stall_torque_n_m": 1e6, "physics.engine": "articulated"}
    sim = omnistep.Simulation("flat", overrides=strong)
    with pytest.raises(omnistep.SimulationError, match=r"diverged at t = 0\.00\d s") as first:
        for _ in range(10):
            sim.step_torques([1e300] * 7)
    for call in (lambda: sim.step_torques([0.0] * 7), lambda: sim.step((0.3, 0.0, 0.0))):
        with pytest.raises(omnistep.SimulationError, match=f"^{re.escape(str(first.value))}$"):
            call()


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="pipes have names on Unix only")
def test_what_is_no_regular_file_is_refused_and_not_waited_for(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for name, kind in ((pipe, "a pipe"), ("/dev/zero", "a device")):
        for call in (
            lambda name: omnistep.run(name),
            lambda name: omnistep.Vehicle(name),
            lambda name: omnistep.run_study(name),
            lambda name: omnistep.run("height_map", overrides={"terrain.image": str(name)}),
            lambda name: omnistep.read_mcap(name),
        ):
            with pytest.raises((omnistep.ConfigError, omnistep.LogError), match=f"{kind}, allowed: a regular file"):
                call(name)


def test_no_message_exceeds_its_length():
    long = "a" * 1_000_000
    for call in (
        lambda: omnistep.run(long),
        lambda: omnistep.run("flat", policy=long),
        lambda: omnistep.run("flat", overrides={"name": long}),
        lambda: omnistep.run("flat", overrides={"duration_s": long}),
        lambda: omnistep.run("flat", overrides={"vehicle": long}),
        lambda: omnistep.run("flat", overrides={"terrain.friction": [0.5] * 300_000}),
        lambda: omnistep.run("flat", overrides={"seed": 10**4000}),
        lambda: omnistep.run("flat", seed=10**4000),
        lambda: omnistep.Scenario.from_dict({"schema_version": long}),
        lambda: omnistep.Scenario.from_dict({3: long}),
        lambda: omnistep.sweep(long, scenario="flat"),
        lambda: omnistep.sweep([long], scenario="flat"),
        lambda: omnistep.sweep({"terrain.friction": long}, scenario="flat"),
        lambda: omnistep.compare("flat", policies=long),
        lambda: omnistep.compare("flat", policies=[long]),
        lambda: omnistep.Scenario("flat")[long],
        lambda: omnistep.run("flat", overrides={"duration_s": 0.05})[long],
        lambda: omnistep.Controller("flat", policy="scale_references").step([0.3, 0.0, long], [0.0] * 7),
    ):
        with pytest.raises((ValueError, TypeError, KeyError)) as caught:
            call()
        assert len(str(caught.value)) <= 450, str(caught.value)[:600]
