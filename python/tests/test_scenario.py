"""Scenarios and vehicles as values: read, changed, compared, sent elsewhere."""

import json
import pickle
import tomllib

import numpy as np
import pytest

import omnistep


@pytest.mark.parametrize("name", omnistep.list_scenarios())
def test_a_scenario_survives_toml_dictionaries_and_pickle(name):
    scenario = omnistep.Scenario(name)
    assert omnistep.Scenario.from_toml(scenario.to_toml()) == scenario
    assert omnistep.Scenario.from_dict(scenario.to_dict()) == scenario
    assert pickle.loads(pickle.dumps(scenario)) == scenario
    assert tomllib.loads(scenario.to_toml()) == scenario.to_dict()


def test_a_path_of_an_override_is_relative_to_the_working_directory(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scenarios").mkdir()
    for place, vehicle in (("scenarios/bot.toml", "omni3"), ("bot.toml", "mecanum4")):
        (tmp_path / place).write_text(omnistep.Vehicle(vehicle).to_toml(), encoding="utf-8")
    file = tmp_path / "scenarios" / "flat.toml"
    keys = "duration_s = 0.01\n[terrain]\nkind = 'flat'\nfriction = 0.7\n[command]\nvx_m_s = 0.1\n"
    file.write_text(f"schema_version = 1\nname = 'a'\nvehicle = 'bot.toml'\n{keys}", encoding="utf-8")
    assert omnistep.Scenario(file).vehicle.name == "omni3"
    assert omnistep.Scenario(file, overrides={"vehicle": "bot.toml"}).vehicle.name == "mecanum4"
    assert omnistep.Scenario(file, vehicle="bot.toml").vehicle.name == "mecanum4"
    assert omnistep.run(file, overrides={"vehicle": "bot.toml"}).vehicle == "mecanum4"


@pytest.mark.parametrize("name", omnistep.list_vehicles())
def test_a_vehicle_survives_toml_dictionaries_and_pickle(name):
    vehicle = omnistep.Vehicle(name)
    assert omnistep.Vehicle.from_toml(vehicle.to_toml()) == vehicle
    assert omnistep.Vehicle.from_dict(vehicle.to_dict()) == vehicle
    assert pickle.loads(pickle.dumps(vehicle)) == vehicle
    assert vehicle.wheel_names == [wheel["name"] for wheel in vehicle["wheel"]]


def test_a_scenario_runs_as_its_name_with_the_same_keys_does():
    # Motors so weak that the policy matters, a perturbation so that the seed does.
    keys = {"duration_s": 0.3, "perturbation.yaw_rad": 0.05, "vehicle.motor.stall_torque_n_m": 0.2}
    scenario = omnistep.Scenario("flat", policy="scale_torques", overrides=keys, seed=3)
    by_name = omnistep.run("flat", policy="scale_torques", overrides=keys, seed=3).to_numpy()
    ways = {
        "all in the scenario": lambda: omnistep.run(scenario),
        "all replaced": lambda: omnistep.run(omnistep.Scenario("flat").replace(keys, policy="scale_torques", seed=3)),
        "some beside it": lambda: omnistep.run(
            omnistep.Scenario("flat", overrides=keys), policy="scale_torques", seed=3
        ),
        "keys beside it": lambda: omnistep.run(
            omnistep.Scenario("flat", policy="scale_torques", seed=3), overrides=keys
        ),
    }
    for way, run in ways.items():
        assert (run().to_numpy() == by_name).all(), way
    # Each of them decides something.
    others = [
        scenario.replace(seed=4),
        scenario.replace(policy="independent"),
        scenario.replace({"vehicle.motor.stall_torque_n_m": 0.3}),
    ]
    for other in others:
        assert (omnistep.run(other).to_numpy() != by_name).any(), other
    assert (scenario.seed, scenario.policy, scenario.duration_s, scenario.period_s) == (3, "scale_torques", 0.3, 0.001)
    # Arguments change it further, and leave it as it is.
    assert omnistep.run(scenario, policy="shared_integral").policy == "shared_integral"
    assert omnistep.Simulation(scenario, seed=9).scenario.seed == 9
    assert scenario.seed == 3


def test_a_dictionary_of_the_keys_that_differ_is_enough_for_another_scenario():
    step = omnistep.Scenario("step")
    higher = step.replace({"terrain": {**step["terrain"], "height_m": 0.06}})
    assert higher == omnistep.Scenario("step", overrides={"terrain.height_m": 0.06})
    assert higher != step
    faulty = step.replace({"fault": [{"kind": "wheel_lost", "wheel": "5", "from_s": 1.0}]})
    assert faulty["fault.0.wheel"] == "5"


def test_another_vehicle_is_a_name_or_a_value_and_keys_reach_into_it():
    light = omnistep.Vehicle("omni3", overrides={"body.0.mass_kg": 4.0})
    scenario = omnistep.Scenario("flat", vehicle=light, overrides={"vehicle.body.0.com_m": [0.0, 0.0, 0.1]})
    assert scenario["vehicle.body.0.mass_kg"] == 4.0
    assert scenario["vehicle.body.0.com_m"] == [0.0, 0.0, 0.1]
    assert scenario.vehicle.mass_kg == pytest.approx(omnistep.Vehicle("omni3").mass_kg - 2.0)
    assert omnistep.Scenario("flat", vehicle="omni3") == omnistep.Scenario("flat", overrides={"vehicle": "omni3"})


def test_gains_that_a_file_leaves_out_are_derived_again_for_a_heavier_vehicle():
    keys = omnistep.Vehicle("omni3").to_dict()
    del keys["gains"]
    flat = omnistep.Scenario("flat", vehicle=omnistep.Vehicle.from_dict(keys))
    assert "gains" not in flat.to_dict()["vehicle"]
    heavier = flat.replace({"vehicle.body.0.mass_kg": 12.0})
    assert heavier.vehicle["gains.ki_n_m_rad"] != flat.vehicle["gains.ki_n_m_rad"]
    keys["body"][0]["mass_kg"] = 12.0
    assert heavier == omnistep.Scenario("flat", vehicle=omnistep.Vehicle.from_dict(keys))


def test_what_follows_from_a_vehicles_numbers():
    vehicle = omnistep.Vehicle("chugo7")
    assert vehicle.mass_kg == 20.0
    # Moment balance: the wheels carry the weight, however it is distributed. The sum is exact but for rounding.
    loads = vehicle.static_loads_n()
    assert loads is not None
    assert loads.sum() == pytest.approx(20.0 * 9.81, rel=1e-12)
    assert vehicle.static_loads_n(gravity_m_s2=1.62).sum() == pytest.approx(20.0 * 1.62, rel=1e-12)
    # One actuator at 10 rad/s: the same map as kinematics'.
    speeds = vehicle.speeds_at(10.0)
    for axis in range(3):
        fastest = np.abs(omnistep.Kinematics(layout=vehicle.layout).inverse(np.eye(3)[axis] * speeds[axis])).max()
        assert fastest == pytest.approx(10.0, rel=1e-12)
    assert vehicle.urdf().startswith('<robot name="chugo7">')


def test_a_missing_key_names_the_keys_that_there_are():
    step = omnistep.Scenario("step")
    with pytest.raises(KeyError, match=r"terrain\.hight_m: terrain has .*height_m"):
        step["terrain.hight_m"]
    with pytest.raises(KeyError, match=r"vehicle\.wheel has 7 elements"):
        step["vehicle.wheel.7"]
    with pytest.raises(KeyError, match="seed has no keys"):
        step["seed.x"]


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: omnistep.Scenario("stairway"), "unknown scenario"),
        (lambda: omnistep.Scenario("step", policy="papier"), "shared_integral"),
        (lambda: omnistep.Scenario("step", vehicle="chugo8"), "unknown vehicle"),
        (lambda: omnistep.Scenario("step", seed=-1), "seed"),
        (lambda: omnistep.Scenario("step").replace({"terrain.friction": -1}), "scenario step: terrain.friction: -1"),
        (lambda: omnistep.Scenario.from_dict({"name": "x"}), "allowed|missing"),
        (lambda: omnistep.Scenario.from_toml("name = "), "scenario:1:"),
        (lambda: omnistep.Vehicle("chugo7").replace({"wheel.0.radius_m": 0}), r"vehicle chugo7: wheel\[0\].radius_m"),
        (lambda: omnistep.Vehicle("chugo7").static_loads_n(gravity_m_s2=0.0), "gravity_m_s2 = 0, allowed"),
    ],
)
def test_bad_input_is_one_line_that_says_what_is_allowed(build, message):
    with pytest.raises(omnistep.ConfigError, match=message) as caught:
        build()
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("value", [object(), {1: 2.0}, [None]])
def test_a_value_that_no_file_can_hold_is_a_type_error_with_its_key(value):
    with pytest.raises(TypeError, match=r"overrides.*allowed"):
        omnistep.Scenario("step", overrides={"terrain": value})


@pytest.mark.parametrize("thing", [3, None, ["step"]])
def test_a_scenario_of_another_type_is_a_type_error(thing):
    with pytest.raises(TypeError, match=r"scenario: .*allowed: a name, a path or an omnistep.Scenario"):
        omnistep.run(thing)


@pytest.mark.parametrize(
    ("arguments", "key"),
    [
        ({"policy": "scale_torques", "overrides": {"control.policy": "independent"}}, "control.policy"),
        ({"seed": 1, "overrides": {"seed": 5}}, "seed"),
        ({"vehicle": "omni3", "overrides": {"vehicle": "mecanum4"}}, "vehicle"),
    ],
)
def test_what_is_given_twice_is_refused(arguments, key):
    with pytest.raises(omnistep.ConfigError, match="allowed: one of the two") as caught:
        omnistep.Scenario("flat", **arguments)
    assert caught.value.key == key


def test_what_holds_itself_is_refused_and_so_is_what_only_looks_like_an_array():
    endless: list = []
    endless.append(endless)
    with pytest.raises(TypeError, match="lists nested too deeply"):
        omnistep.Scenario("flat", overrides={"x": endless})
    with pytest.raises(TypeError, match=r"terrain\.friction: .*allowed: a number"):
        omnistep.Scenario("flat", overrides={"terrain.friction": type("Odd", (), {"tolist": lambda self: self})()})


@pytest.mark.parametrize("seed", [1.5, "1", object()])
def test_a_seed_of_another_type_is_named(seed):
    with pytest.raises(TypeError, match=r"seed: .*allowed: a whole number, 0 to"):
        omnistep.Scenario("flat", seed=seed)


def test_equal_values_have_the_same_hash_and_others_another():
    assert len({omnistep.Scenario("flat"), omnistep.Scenario("flat"), omnistep.Scenario("flat", seed=1)}) == 2
    assert len({omnistep.Vehicle("omni3"), omnistep.Scenario("flat", vehicle="omni3").vehicle}) == 1


def test_what_a_run_gives_and_what_kinematics_are_made_of_survive_pickle():
    trace = omnistep.run("flat", overrides={"duration_s": 0.2})
    again = pickle.loads(pickle.dumps(trace))
    assert again.names == trace.names and (again.to_numpy() == trace.to_numpy()).all()
    assert pickle.loads(pickle.dumps(trace.outcome)).to_dict().keys() == trace.outcome.to_dict().keys()
    assert repr(again) == repr(trace) and again.wheel_signals == trace.wheel_signals
    layout = omnistep.Vehicle("mecanum4").layout
    assert pickle.loads(pickle.dumps(layout)) == layout
    assert pickle.loads(pickle.dumps(layout.wheels[1])) == layout.wheels[1]
    weights = np.array([1.0, 2.0, 3.0, 4.0])
    kinematics = omnistep.Kinematics(layout=layout, weights=weights)
    expected = kinematics.forward_matrix
    weights[:] = 1.0  # the caller's own from here on
    assert (pickle.loads(pickle.dumps(kinematics)).forward_matrix == expected).all()
    with pytest.raises(ValueError, match="the pickle is damaged"):
        omnistep.Trace._of_state(omnistep.Scenario("flat").to_toml(), "scale_torques", b"")


@pytest.mark.parametrize("name", ["/dev/zero", "v.toml", "chugo7"])
def test_a_pickle_names_no_file_of_this_machine(tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "v.toml").write_text(omnistep.Vehicle("chugo7").to_toml(), encoding="utf-8")
    scenario = omnistep.Scenario("height_map")
    read, (text,) = scenario.__reduce__()
    assert read(text) == scenario
    keys = scenario.to_dict()
    for key, bad in (
        ("vehicle", keys | {"vehicle": name}),
        ("terrain.image", keys | {"terrain": keys["terrain"] | {"image": name}}),
    ):
        table = toml_of(bad)
        for call in (lambda text: read(text), lambda text: omnistep.Trace._of_state(text, "scale_torques", b"")):
            with pytest.raises(
                omnistep.ConfigError, match="a scenario in a log or a pickle cannot name another file"
            ) as caught:
                call(table)
            assert caught.value.key == key and caught.value.file == "pickle"


def toml_of(keys):
    """Plain tables as TOML: every value is one that JSON writes the same, inline tables but for their sign."""

    def value(given):
        if isinstance(given, dict):
            return "{" + ", ".join(f"{json.dumps(k)} = {value(v)}" for k, v in given.items()) + "}"
        if isinstance(given, list):
            return "[" + ", ".join(map(value, given)) + "]"
        return json.dumps(given)

    return "".join(f"{key} = {value(given)}\n" for key, given in keys.items())
