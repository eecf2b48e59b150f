"""`omnistep new vehicle NAME --from-urdf`: what is in a URDF is in the vehicle file, and what is guessed is marked."""

import math
import sys
import tomllib

import numpy as np
import pytest

import omnistep
from omnistep.__main__ import main
from omnistep._omnistep import cli

# The vehicle file has nine digits and nanometres; the export has all digits.
DIGITS = {"rtol": 1e-8, "atol": 1e-9}


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def imported(here, monkeypatch, urdf, *options):
    """The keys of the vehicle file that the command writes, and its text; `omnistep check` takes it."""
    (here / "robot.urdf").write_text(urdf)
    command = ["omnistep", "new", "vehicle", "robot", "--from-urdf", "robot.urdf", *options]
    monkeypatch.setattr(sys, "argv", command)
    assert main() == 0
    assert cli(["omnistep", "check", "robot.toml"]) == 0
    text = (here / "robot.toml").read_text()
    return tomllib.loads(text), text


@pytest.mark.parametrize("name", ["panther", "ridgeback", "robotino", "rosbot_xl", "rosmaster_x3", "youbot"])
def test_wheels_and_masses_of_public_robots_are_those_that_are_published(name, robots, here, monkeypatch):
    urdf, options, places, radius, wheel_kg, all_kg, inertia = robots.ROBOTS[name]
    vehicle, _ = imported(here, monkeypatch, urdf(), *options)
    wheels = vehicle["wheel"]
    np.testing.assert_allclose([wheel["position_m"] for wheel in wheels], places, **DIGITS)
    assert [wheel["radius_m"] for wheel in wheels] == [radius] * len(places)
    np.testing.assert_allclose([wheel["mass_kg"] for wheel in wheels], wheel_kg, **DIGITS)
    np.testing.assert_allclose([wheel["inertia_kg_m2"] for wheel in wheels], inertia, **DIGITS)
    assert math.isclose(omnistep.Vehicle("robot.toml").mass_kg, all_kg, rel_tol=1e-8)


def test_the_rocker_of_ridgeback_is_a_hinge_and_loads_are_those_of_moment_balance(robots, here, monkeypatch):
    vehicle, text = imported(here, monkeypatch, robots.ridgeback())
    (hinge,) = vehicle["hinge"]
    assert (hinge["axis"], hinge["anchor_m"], hinge["limit_rad"]) == ([1, 0, 0], [0.319, 0, 0.0759], 0.08726)
    assert [wheel["body"] for wheel in vehicle["wheel"]] == ["front_rocker_link"] * 2 + ["base_link"] * 2
    assert "damping_n_m_s_rad = 0.3         # guess: a dry plain bearing; none in the URDF" in text
    loads = omnistep.Vehicle("robot.toml").static_loads_n()
    chassis = 165.304 + 10.267 + 0.001
    com = (
        np.array([0.012, 0.002]) * 165.304 + np.array([-0.319, 0]) * 10.267 + np.array([0.2085, -0.2902]) * 0.001
    ) / chassis
    # The rocker passes its half of the chassis evenly to its wheels; the rear wheels hold the chassis across.
    front = chassis * (com[0] + 0.319) / 0.638
    across = chassis * com[1] / 0.551
    rear = [(chassis - front) / 2 + sign * across for sign in (1, -1)]
    expected = [front / 2 + 10.267 / 2 + 2.3] * 2 + [each + 2.3 for each in rear]
    np.testing.assert_allclose(loads, 9.81 * np.array(expected), rtol=1e-6)  # of positions in nanometres


def test_the_turned_drives_of_lekiwi_stand_where_its_tree_has_them(robots, here, monkeypatch):
    vehicle, _ = imported(here, monkeypatch, robots.lekiwi(), "--radius", "0.05")
    # Places of the wheels' meshes in the published file by an independent reader, yourdfpy; its axes have six digits.
    expected = [(0.00061, -0.14225), (0.10625938, 0.06205338), (-0.10617666, 0.06059665)]
    np.testing.assert_allclose([wheel["position_m"] for wheel in vehicle["wheel"]], expected, atol=2e-7)
    # All turn the vehicle clockwise.
    for wheel, degrees in zip(vehicle["wheel"], (180, -60, 60), strict=True):
        direction = [math.cos(math.radians(degrees)), math.sin(math.radians(degrees))]
        np.testing.assert_allclose(wheel["rolling_direction"], direction, atol=1e-6)
        assert math.isclose(wheel["mass_kg"], 0.1235708646 + 1.3542854082, rel_tol=1e-8)


@pytest.mark.parametrize("name", ["chugo7", "mecanum4", "omni3", "rocker_bogie6"])
def test_a_vehicle_that_is_exported_and_read_back_is_the_same(name, here, monkeypatch):
    imported(here, monkeypatch, omnistep.Vehicle(name).urdf())
    first, back = omnistep.Vehicle(name).to_dict(), omnistep.Vehicle("robot.toml").to_dict()
    links = {first["body"][0]["name"]: "base_link"}
    for kind in ("body", "hinge", "wheel", "coupling"):
        assert len(back.get(kind) or []) == len(first.get(kind) or [])
    for one, other in zip(first["body"], back["body"], strict=True):
        assert other["name"] == links.get(one["name"], one["name"])
        for key in ("mass_kg", "com_m", "inertia_box_m"):
            np.testing.assert_allclose(other[key], one[key], **DIGITS)
    for one, other in zip(first.get("hinge") or [], back.get("hinge") or [], strict=True):
        assert [other[key] for key in ("name", "child")] == [one[key] for key in ("name", "child")]
        assert other["parent"] == links.get(one["parent"], one["parent"])
        for key in ("axis", "anchor_m", "limit_rad", "damping_n_m_s_rad"):
            np.testing.assert_allclose(other[key], one[key], **DIGITS)
    for one, other in zip(first.get("coupling") or [], back.get("coupling") or [], strict=True):
        assert [other[key] for key in ("hinge_a", "hinge_b", "ratio")] == [
            one[key] for key in ("hinge_a", "hinge_b", "ratio")
        ]
    for one, other in zip(first["wheel"], back["wheel"], strict=True):
        assert (other["name"], other["body"]) == (one["name"], links.get(one["body"], one["body"]))
        for key in ("position_m", "radius_m", "mass_kg", "inertia_kg_m2", "roller_angle_rad"):
            np.testing.assert_allclose(other[key], one[key], **DIGITS)
        direction = np.array(one["rolling_direction"]) / np.linalg.norm(one["rolling_direction"])
        np.testing.assert_allclose(other["rolling_direction"], direction, **DIGITS)


@pytest.mark.parametrize("seed", range(3))
def test_a_box_cut_into_eight_links_that_are_turned_anyhow_is_the_box(seed, robots, here, monkeypatch):
    edges, chance = np.array([0.4, 0.3, 0.2]), np.random.default_rng(seed)
    a, b, c = (edges / 2) ** 2 / 12
    parts = [robots.link("base")]
    for number in range(8):
        corner = [(number >> k & 1) - 0.5 for k in range(3)]
        middle = edges / 2 * corner + [0, 0, 0.2]
        at, (yaw,) = chance.uniform(-1, 1, 3), chance.uniform(-3, 3, 1)
        # The frame of the link is elsewhere and turned; its inertial is turned back, along the box.
        back = np.array([[math.cos(yaw), math.sin(yaw), 0], [-math.sin(yaw), math.cos(yaw), 0], [0, 0, 1]])
        com = back @ (middle - at)
        parts.append(robots.link(f"part{number}", 1.0, (b + c, a + c, a + b), com=com, rpy=(0, 0, -yaw)))
        parts.append(robots.joint(f"fixed{number}", "fixed", "base", f"part{number}", at, (0, 0, yaw)))
    vehicle, _ = imported(here, monkeypatch, robots.four(*parts))
    (body,) = vehicle["body"]
    np.testing.assert_allclose(body["mass_kg"], 8.0, **DIGITS)
    np.testing.assert_allclose(body["com_m"], [0, 0, 0.2], **DIGITS)
    np.testing.assert_allclose(body["inertia_box_m"], edges, **DIGITS)


def test_rollers_that_turn_on_a_wheel_belong_to_it_and_casters_and_arms_to_the_body(robots, here, monkeypatch):
    more = [
        robots.link("caster", 0.2),
        robots.joint("swivel", "continuous", "base", "caster", (0, 0, 0.1), axis=(0, 0, 1)),
    ]
    more += [robots.link("caster_wheel", 0.1, shape=robots.cylinder(0.02))]
    more += [robots.joint("caster_roll", "continuous", "caster", "caster_wheel", (0, 0, -0.08))]
    limit = '<limit lower="-1" upper="2" effort="9" velocity="1"/>'
    more += [robots.link("arm", 1.0), robots.joint("shoulder", "revolute", "base", "arm", (0, 0, 0.3), more=limit)]
    # A spinning part of a sensor: round, about a level axis, but far above the ground.
    more += [
        robots.link("mirror", 0.05, shape=robots.cylinder(0.03)),
        robots.joint("spin", "continuous", "base", "mirror", (0, 0, 0.4)),
    ]
    for number in range(6):
        more += [robots.link(f"roller{number}", 0.01, shape=robots.cylinder(0.01))]
        more += [
            robots.joint(f"turn{number}", "continuous", "fl_wheel", f"roller{number}", (0, 0, 0.04), axis=(1, 1, 0))
        ]
    vehicle, text = imported(here, monkeypatch, robots.four(robots.BODY, *more))
    assert [wheel["name"] for wheel in vehicle["wheel"]] == ["fl", "fr", "rl", "rr"]
    np.testing.assert_allclose([wheel["mass_kg"] for wheel in vehicle["wheel"]], [0.56, 0.5, 0.5, 0.5], **DIGITS)
    (body,) = vehicle["body"]
    np.testing.assert_allclose(body["mass_kg"], 8.0 + 0.2 + 0.1 + 1.0 + 0.05, **DIGITS)
    assert "# guess: joints held at 0: " in text and " and 3 more" in text


@pytest.mark.parametrize("sign", [1, -1])
def test_mecanum_rollers_form_an_o_on_the_ground_whichever_way_the_axles_point(sign, robots, here, monkeypatch):
    vehicle, text = imported(here, monkeypatch, robots.four(robots.BODY, axis=(0, sign, 0)))
    for wheel in vehicle["wheel"]:
        assert wheel["rolling_direction"] == [sign, 0]
        angle = wheel["roller_angle_rad"] + math.atan2(0, sign)
        # In an O the rollers of a corner lie across its diagonal.
        x, y = np.sign(wheel["position_m"])
        assert math.isclose(x * math.cos(angle) + y * math.sin(angle), 0.0, abs_tol=1e-8)
    assert text.count("# guess: mecanum, as all axles are parallel; an O seen from below, an X from above") == 4


def test_every_value_that_a_urdf_does_not_have_is_marked(robots, here, monkeypatch, capsys):
    _, text = imported(here, monkeypatch, robots.four(robots.link("base", 8.0, com=(0, 0, 0.1))), "--wheels", "mecanum")
    marked = {line.split(" = ")[0] for line in text.splitlines() if "# guess: " in line}
    motor = {"stall_torque_n_m", "no_load_rad_s"}
    limits = {"vx_m_s", "vy_m_s", "wz_rad_s"}
    assert marked == motor | limits | {"count", "radius_m", "roller_angle_rad", "contact", "inertia_box_m"}
    # The first thrust is two thirds of the weight: 10 kg, four wheels of 50 mm, two digits.
    assert tomllib.loads(text)["motor"]["stall_torque_n_m"] == float(f"{2 / 3 * 10 * 9.81 * 0.05 / 4:.2g}")
    marks = sum("# guess: " in line for line in text.splitlines())
    said = capsys.readouterr().out
    assert said == (
        f'robot.toml: 1 body, 0 hinges, 4 mecanum wheels, 10.000 kg; {marks} values are marked "# guess"; '
        "next: omnistep check robot.toml\n"
    )


def test_names_from_a_urdf_add_no_keys_to_the_file(robots, here, monkeypatch):
    urdf = (
        robots.four(robots.BODY)
        .replace('name="four"', 'name="a&#10;gravity = 0"')
        .replace('"fl_wheel"', '"fl&#10;x = 1 wheel"')
    )
    vehicle, text = imported(here, monkeypatch, urdf)
    assert set(vehicle["wheel"][0]) == set(vehicle["wheel"][1])
    assert set(vehicle) == {"schema_version", "name", "body", "motor", "limits", "rollers", "wheel"}
    assert "gravity" in text.splitlines()[1]


def test_without_a_urdf_the_command_is_the_compiled_one(here, monkeypatch, capfd):
    monkeypatch.setattr(sys, "argv", ["omnistep", "new", "vehicle", "robot", "--template", "mecanum4"])
    assert main() == 0
    assert capfd.readouterr().out.startswith("robot.toml: started from mecanum4;")


def test_the_help_of_the_compiled_command_names_this_one(here, monkeypatch, capfd):
    monkeypatch.setattr(sys, "argv", ["omnistep", "new", "--help"])
    assert main() == 0
    assert (
        capfd.readouterr().out.splitlines()[-1].startswith("Of a URDF [Python]: omnistep new vehicle NAME --from-urdf")
    )


@pytest.mark.parametrize(
    ("change", "limit", "note"),
    [
        (('lower="-0.08726"', 'lower="-0.05"'), 0.05, "the nearer of -0.05 and 0.08726"),
        (('type="revolute"', 'type="continuous"'), 3.0, "none in the URDF"),
        (('<limit lower="-0.08726" upper="0.08726" effort="0" velocity="0"/>', ""), 3.0, "none in the URDF"),
    ],
)
def test_the_stop_of_a_hinge_is_the_nearer_one_or_a_guess(change, limit, note, robots, here, monkeypatch):
    vehicle, text = imported(here, monkeypatch, robots.ridgeback().replace(*change, 1))
    assert [hinge["limit_rad"] for hinge in vehicle["hinge"]] == [limit]
    assert f"# guess: {note}\n" in text


@pytest.mark.parametrize("change", [('type="revolute"', 'type="prismatic"'), ('0.08726" effort', '-0.08726" effort')])
def test_a_slide_and_a_joint_without_play_are_held(change, robots, here, monkeypatch):
    vehicle, text = imported(here, monkeypatch, robots.ridgeback().replace(*change, 1))
    assert "hinge" not in vehicle and len(vehicle["body"]) == 1
    np.testing.assert_allclose(vehicle["body"][0]["mass_kg"], 165.304 + 0.001 + 2 * 10.267, **DIGITS)
    assert "# guess: joints held at 0: front_rocker\n" in text
