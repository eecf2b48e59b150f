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
HALF_TURN = math.pi / 2


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


def link(
    name, kilograms=0.0, moments=(0.0, 0.0, 0.0), products=(0.0, 0.0, 0.0), com=(0, 0, 0), rpy=(0, 0, 0), shape=""
):
    """A link; without mass it has no inertial."""
    if not kilograms:
        return f'<link name="{name}">{shape}</link>'
    (xx, yy, zz), (xy, xz, yz) = moments, products
    return (
        f'<link name="{name}"><inertial><origin xyz="{words(com)}" rpy="{words(rpy)}"/><mass value="{kilograms}"/>'
        f'<inertia ixx="{xx}" iyy="{yy}" izz="{zz}" ixy="{xy}" ixz="{xz}" iyz="{yz}"/></inertial>{shape}</link>'
    )


def joint(name, kind, parent, child, xyz=(0, 0, 0), rpy=(0, 0, 0), axis=(0, 1, 0), more=""):
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{words(xyz)}" rpy="{words(rpy)}"/><axis xyz="{words(axis)}"/>{more}</joint>'
    )


def words(numbers):
    return " ".join(str(number) for number in numbers)


def cylinder(radius, length=0.05):
    """A cylinder that collides, about y."""
    shape = f'<geometry><cylinder radius="{radius}" length="{length}"/></geometry>'
    return f'<collision><origin xyz="0 0 0" rpy="{HALF_TURN} 0 0"/>{shape}</collision>'


MESH = '<collision><geometry><mesh filename="package://robot/wheel.stl"/></geometry></collision>'


def rosbot_xl():
    """Husarion ROSbot XL with mecanum wheels: 170 x 270 mm, radius 50 mm; body 3.5 kg, wheels 0.4 kg."""
    parts = [link("base_link"), joint("base_to_body_joint", "fixed", "base_link", "body_link", (0, 0, 0.05))]
    products = (-0.000020968097, 0.000010399694, 0.000059372953)
    parts.append(link("body_link", 3.5, (0.01393, 0.01081, 0.02048), products, (0, 0, 0.0358)))
    for side, x, y in (("fl", 1, 1), ("fr", 1, -1), ("rl", -1, 1), ("rr", -1, -1)):
        parts.append(link(f"{side}_wheel_link", 0.4, (0.0003145, 0.0004561, 0.0003145), shape=cylinder(0.05)))
        limit = '<limit effort="1.5" velocity="30.0"/><dynamics damping="0.001" friction="0.001"/>'
        at = (x * 0.085, y * 0.135, 0)
        parts.append(joint(f"{side}_wheel_joint", "continuous", "body_link", f"{side}_wheel_link", at, more=limit))
    return f'<robot name="rosbot_xl">{"".join(parts)}</robot>'


def panther():
    """Husarion Panther with mecanum wheels WH02, meshes all of them: 440 x 678.5 mm, radius 101.6 mm, 43 and 2.4 kg."""
    parts = [link("base_link"), joint("base_to_body_joint", "fixed", "base_link", "body_link", (0, 0, 0.1016))]
    parts.append(link("body_link", 43.0, (2.630036, 2.463509, 4.611945), (-0.023480, 0.052320, 0.009337), shape=MESH))
    for side, x, y in (("fl", 1, 1), ("fr", 1, -1), ("rl", -1, 1), ("rr", -1, -1)):
        parts.append(link(f"{side}_wheel_link", 2.4, (0.010050, 0.016496, 0.010068), shape=MESH))
        limit = '<limit effort="34.5" velocity="10.958"/><dynamics damping="0.01" friction="0.01"/>'
        at = (x * 0.22, y * 0.33925, 0)
        parts.append(joint(f"{side}_wheel_joint", "continuous", "body_link", f"{side}_wheel_link", at, more=limit))
    return f'<robot name="panther">{"".join(parts)}</robot>'


def ridgeback():
    """Clearpath Ridgeback: its front wheels are on a rocker about x; 638 x 551 mm, radius 75.9 mm."""
    turned = (HALF_TURN, 0, HALF_TURN)
    moments, products = (4.4744, 7.1624, 4.6155), (0.03098, 0.003647, 0.1228)
    parts = [link("base_link"), joint("base_link_joint", "fixed", "base_link", "chassis_link")]
    parts.append(link("chassis_link", 165.304, moments, products, (0.012, 0.002, 0.067), turned))
    parts += [link("axle_link"), joint("axle_joint", "fixed", "chassis_link", "axle_link", (0, 0, 0.05))]
    parts.append(link("imu_link", 0.001, (1e-9, 1e-9, 1e-9)))
    parts.append(joint("imu_joint", "fixed", "chassis_link", "imu_link", (0.2085, -0.2902, 0.1681)))
    for end, x, kind in (("front", 1, "revolute"), ("rear", -1, "fixed")):
        moments, products = (0.0288, 0.4324, 0.4130), (2.20484e-6, -1.3145e-5, 1.8944e-3)
        parts.append(link(f"{end}_rocker_link", 10.267, moments, products, rpy=turned))
        limit = '<limit lower="-0.08726" upper="0.08726" effort="0" velocity="0"/>'
        at = (x * 0.319, 0, 0)
        parts.append(joint(f"{end}_rocker", kind, "axle_link", f"{end}_rocker_link", at, axis=(1, 0, 0), more=limit))
        for side, y in (("left", 1), ("right", -1)):
            name = f"{end}_{side}_wheel"
            parts.append(link(f"{name}_link", 2.3, (3.3212e-3, 6.6424e-3, 3.3212e-3), shape=cylinder(0.0759, 0.079)))
            parts.append(joint(name, "continuous", f"{end}_rocker_link", f"{name}_link", (0, y * 0.2755, 0)))
    return f'<robot name="ridgeback">{"".join(parts)}</robot>'


def youbot():
    """KUKA youBot: wheels on links that are named casters; 456 x 316 mm; base 22 kg, wheels 0.4 kg, an arm joint."""
    moments, products = (
        (5.652232699207, 5.669473158652, 3.683196351726),
        (-0.009719934438, 1.293988226423, -0.007379583694),
    )
    parts = [
        link("base_footprint"),
        joint("base_footprint_joint", "fixed", "base_footprint", "base_link", (0, 0, 0.084)),
    ]
    parts.append(link("base_link", 22.0, moments, products))
    parts += [link("arm_link_1", 1.39, (0.01, 0.01, 0.01))]
    limit = '<limit lower="0" upper="5.9" effort="9" velocity="1.57"/>'
    parts.append(
        joint("arm_joint_1", "revolute", "base_link", "arm_link_1", (0.167, 0, 0.161), axis=(0, 0, 1), more=limit)
    )
    for side, x, y in (("fl", 1, 1), ("fr", 1, -1), ("bl", -1, 1), ("br", -1, -1)):
        inertia = (0.012411765597, 0.015218160428, 0.011763977943)
        parts.append(link(f"caster_link_{side}", 0.1, inertia))
        at = (x * 0.228, y * 0.158, -0.034)
        parts.append(joint(f"caster_joint_{side}", "fixed", "base_link", f"caster_link_{side}", at, axis=(0, 0, 1)))
        parts.append(link(f"wheel_link_{side}", 0.4, inertia, shape=cylinder(0.05, 0.005)))
        parts.append(joint(f"wheel_joint_{side}", "continuous", f"caster_link_{side}", f"wheel_link_{side}"))
    return f'<robot name="youbot">{"".join(parts)}</robot>'


def rosmaster_x3():
    """Yahboom Rosmaster X3: 160 x 149 mm (its separation of 169 mm less twice 10), radius 32.5 mm; 4.6 and 0.1 kg."""
    x, y, z = 0.3, 0.1386, 0.19725
    box = tuple(4.6 / 12 * sides for sides in (y * y + z * z, x * x + z * z, x * x + y * y))
    parts = [link("base_footprint"), joint("base_joint", "fixed", "base_footprint", "base_link", (0, 0, 0.0325))]
    parts.append(link("base_link", 4.6, box, com=(-0.031, 0, z / 2)))
    across = 0.1 / 12 * (3 * 0.0325**2 + 0.0304**2)
    for side, x, y in (("front_left", 1, 1), ("front_right", 1, -1), ("back_left", -1, 1), ("back_right", -1, -1)):
        inertia = (across, 0.1 / 2 * 0.0325**2, across)
        parts.append(link(f"{side}_wheel_link", 0.1, inertia, shape=cylinder(0.0325, 0.0304)))
        at = (x * 0.08, y * 0.0745, -0.0325)
        parts.append(joint(f"{side}_wheel_joint", "continuous", "base_link", f"{side}_wheel_link", at))
    return f'<robot name="rosmaster_x3">{"".join(parts)}</robot>'


def robotino(wheel_kg=0.4):
    """Festo Robotino: three omni wheels 128 and 130 mm from the middle, as meshes; base 20 kg."""
    parts = [link("base_link", 20, (1.0, 1.0, 1.0))]
    for number, (at, yaw, turn) in enumerate(
        [((0.065, 0.11, 0.04), 1.04719666667, -1), ((-0.13, 0, 0.04), 0, 1), ((0.065, -0.11, 0.04), -1.04719666667, -1)]
    ):
        parts.append(link(f"wheel{number}_link", wheel_kg, (1.0, 1.0, 1.0), shape=MESH))
        rpy, axis = (0, 0, yaw), (turn, 0, 0)
        parts.append(joint(f"wheel{number}_joint", "continuous", "base_link", f"wheel{number}_link", at, rpy, axis))
    return f'<robot name="robotino">{"".join(parts)}</robot>'


def lekiwi():
    """LeKiwi, its three drives only: links that are turned in each other, an axle along z of the servo, meshes."""
    half, pi = HALF_TURN, math.pi
    parts = [link("base_plate_layer1-v5", 1.9468624348, (0.00563711, 0.00562844, 0.01124965))]
    drives = [
        ("-2", (-0.02, -0.1, 0), (pi, 0, 0), (-0.01214, -0.016, -0.00761), (pi, half, 0)),
        ("-1", (0.07928203, 0.02267949, 0), (0, 0, 0), (-0.0077864, -0.01851355, 0.00761), (0, -half, 0)),
        ("", (-0.05928203, 0.05732051, 0), (pi, 0, 0), (0.0199264, -0.00251355, -0.00761), (pi, half, 0)),
    ]
    axles = [
        ((0.01025, -0.0352, -0.03275), (0, 0, -1), (0, 0, -0.007175)),
        ((0.01025, 0.04636234, -0.01480191), (0.866025, 0, 0.5), (0.00621373, 0, 0.0035875)),
        ((0.01025, -0.01076234, 0.04685909), (-0.866025, 0, 0.5), (-0.00621373, 0, 0.0035875)),
    ]
    middles = [(0, 0.015875, 0), (0.013748156, -0.0079375, 0), (-0.013748156, -0.0079375, 0)]
    for (end, mount, mount_rpy, servo, servo_rpy), (axle, axis, hub), middle in zip(
        drives, axles, middles, strict=True
    ):
        mounted, driven, turning, wheel = (
            f"{part}{end}"
            for part in ("drive_motor_mount-v11", "ST3215_Servo_Motor-v1", "omni_wheel_mount-v5", "body-v1")
        )
        parts += [link(mounted, 0.0472422767, (5e-6, 5e-6, 9e-6)), link(driven, 0.0658962962, (1.8e-5, 1.2e-5, 1.2e-5))]
        parts += [link(turning, 0.1235708646), link(wheel, 1.3542854082, (0.00129, 0.00129, 0.00129), com=middle)]
        parts.append(joint(f"{mounted}_rigid", "fixed", "base_plate_layer1-v5", mounted, mount, mount_rpy))
        parts.append(joint(f"{driven}_rigid", "fixed", mounted, driven, servo, servo_rpy))
        parts.append(joint(f"{driven}_Revolute", "continuous", driven, turning, axle, (-half, half, 0), axis))
        parts.append(joint(f"{wheel}_rigid", "fixed", turning, wheel, hub, (-half, 0, 0)))
    return f'<robot name="LeKiwi">{"".join(parts)}</robot>'


# Each robot, options, positions of its wheels [m], radius [m], mass of a wheel and of all [kg], inertia about the axle.
CORNERS = ((1, 1), (1, -1), (-1, 1), (-1, -1))
ROBOTS = {
    "rosbot_xl": (rosbot_xl, [], [(0.085 * x, 0.135 * y) for x, y in CORNERS], 0.05, 0.4, 3.5 + 1.6, 0.0004561),
    "panther": (
        panther,
        ["--wheels", "mecanum", "--radius", "0.1016"],
        [(0.22 * x, 0.33925 * y) for x, y in CORNERS],
        0.1016,
        2.4,
        43 + 9.6,
        0.016496,
    ),
    "ridgeback": (
        ridgeback,
        ["--wheels", "mecanum"],
        [(0.319 * x, 0.2755 * y) for x, y in CORNERS],
        0.0759,
        2.3,
        165.304 + 0.001 + 2 * 10.267 + 4 * 2.3,
        6.6424e-3,
    ),
    "youbot": (
        youbot,
        ["--radius", "0.0475"],
        [(0.228 * x, 0.158 * y) for x, y in CORNERS],
        0.0475,
        0.4,
        22 + 1.39 + 4 * 0.1 + 4 * 0.4,
        0.015218160428,
    ),
    "rosmaster_x3": (
        rosmaster_x3,
        [],
        [(0.08 * x, 0.0745 * y) for x, y in CORNERS],
        0.0325,
        0.1,
        5.0,
        0.1 / 2 * 0.0325**2,
    ),
    "robotino": (robotino, ["--radius", "0.04"], [(0.065, 0.11), (-0.13, 0), (0.065, -0.11)], 0.04, 0.4, 21.2, 1.0),
}


@pytest.mark.parametrize("name", ROBOTS)
def test_wheels_and_masses_of_public_robots_are_those_that_are_published(name, here, monkeypatch):
    urdf, options, places, radius, wheel_kg, all_kg, inertia = ROBOTS[name]
    vehicle, _ = imported(here, monkeypatch, urdf(), *options)
    wheels = vehicle["wheel"]
    np.testing.assert_allclose([wheel["position_m"] for wheel in wheels], places, **DIGITS)
    assert [wheel["radius_m"] for wheel in wheels] == [radius] * len(places)
    np.testing.assert_allclose([wheel["mass_kg"] for wheel in wheels], wheel_kg, **DIGITS)
    np.testing.assert_allclose([wheel["inertia_kg_m2"] for wheel in wheels], inertia, **DIGITS)
    assert math.isclose(omnistep.Vehicle("robot.toml").mass_kg, all_kg, rel_tol=1e-8)


def test_the_rocker_of_ridgeback_is_a_hinge_and_its_wheels_carry_the_loads_of_moment_balance(here, monkeypatch):
    vehicle, text = imported(here, monkeypatch, ridgeback())
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


def test_drives_of_lekiwi_whose_links_are_turned_in_each_other_stand_where_its_tree_has_them(here, monkeypatch):
    vehicle, _ = imported(here, monkeypatch, lekiwi(), "--radius", "0.05")
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
        for key in ("mass_kg", "com_m", "box_m"):
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


def four(body, *more, radius=0.05, axis=(0, 1, 0)):
    """A robot on four mecanum wheels, 400 x 300 mm, whose base has other parts."""
    parts = [body, *more]
    for side, (x, y) in zip(("fl", "fr", "rl", "rr"), CORNERS, strict=True):
        parts.append(link(f"{side}_wheel", 0.5, (0.0003, 0.0006, 0.0003), shape=cylinder(radius)))
        parts.append(joint(side, "continuous", "base", f"{side}_wheel", (0.2 * x, 0.15 * y, radius), axis=axis))
    return f'<robot name="four">{"".join(parts)}</robot>'


BODY = link("base", 8.0, (0.05, 0.06, 0.07), com=(0, 0, 0.1))


@pytest.mark.parametrize("seed", range(3))
def test_a_box_cut_into_eight_links_that_are_turned_anyhow_is_the_box(seed, here, monkeypatch):
    edges, chance = np.array([0.4, 0.3, 0.2]), np.random.default_rng(seed)
    a, b, c = (edges / 2) ** 2 / 12
    parts = [link("base")]
    for number in range(8):
        corner = [(number >> k & 1) - 0.5 for k in range(3)]
        middle = edges / 2 * corner + [0, 0, 0.2]
        at, (yaw,) = chance.uniform(-1, 1, 3), chance.uniform(-3, 3, 1)
        # The frame of the link is elsewhere and turned; its inertial is turned back, along the box.
        back = np.array([[math.cos(yaw), math.sin(yaw), 0], [-math.sin(yaw), math.cos(yaw), 0], [0, 0, 1]])
        com = back @ (middle - at)
        parts.append(link(f"part{number}", 1.0, (b + c, a + c, a + b), com=com, rpy=(0, 0, -yaw)))
        parts.append(joint(f"fixed{number}", "fixed", "base", f"part{number}", at, (0, 0, yaw)))
    vehicle, _ = imported(here, monkeypatch, four(*parts))
    (body,) = vehicle["body"]
    np.testing.assert_allclose(body["mass_kg"], 8.0, **DIGITS)
    np.testing.assert_allclose(body["com_m"], [0, 0, 0.2], **DIGITS)
    np.testing.assert_allclose(body["box_m"], edges, **DIGITS)


def test_rollers_that_turn_on_a_wheel_belong_to_it_and_casters_and_arms_to_the_body(here, monkeypatch):
    more = [link("caster", 0.2), joint("swivel", "continuous", "base", "caster", (0, 0, 0.1), axis=(0, 0, 1))]
    more += [link("caster_wheel", 0.1, shape=cylinder(0.02))]
    more += [joint("caster_roll", "continuous", "caster", "caster_wheel", (0, 0, -0.08))]
    limit = '<limit lower="-1" upper="2" effort="9" velocity="1"/>'
    more += [link("arm", 1.0), joint("shoulder", "revolute", "base", "arm", (0, 0, 0.3), more=limit)]
    # A spinning part of a sensor: round, about a level axis, but far above the ground.
    more += [link("mirror", 0.05, shape=cylinder(0.03)), joint("spin", "continuous", "base", "mirror", (0, 0, 0.4))]
    for number in range(6):
        more += [link(f"roller{number}", 0.01, shape=cylinder(0.01))]
        more += [joint(f"turn{number}", "continuous", "fl_wheel", f"roller{number}", (0, 0, 0.04), axis=(1, 1, 0))]
    vehicle, text = imported(here, monkeypatch, four(BODY, *more))
    assert [wheel["name"] for wheel in vehicle["wheel"]] == ["fl", "fr", "rl", "rr"]
    np.testing.assert_allclose([wheel["mass_kg"] for wheel in vehicle["wheel"]], [0.56, 0.5, 0.5, 0.5], **DIGITS)
    (body,) = vehicle["body"]
    np.testing.assert_allclose(body["mass_kg"], 8.0 + 0.2 + 0.1 + 1.0 + 0.05, **DIGITS)
    assert "# guess: joints held at 0: " in text and " and 3 more" in text


@pytest.mark.parametrize("sign", [1, -1])
def test_rollers_of_mecanum_wheels_form_an_o_on_the_ground_whichever_way_the_axles_point(sign, here, monkeypatch):
    vehicle, text = imported(here, monkeypatch, four(BODY, axis=(0, sign, 0)))
    for wheel in vehicle["wheel"]:
        assert wheel["rolling_direction"] == [sign, 0]
        angle = wheel["roller_angle_rad"] + math.atan2(0, sign)
        # In an O the rollers of a corner lie across its diagonal.
        x, y = np.sign(wheel["position_m"])
        assert math.isclose(x * math.cos(angle) + y * math.sin(angle), 0.0, abs_tol=1e-8)
    assert text.count("# guess: mecanum, as all axles are parallel; an O seen from below, an X from above") == 4


def test_every_value_that_a_urdf_does_not_have_is_marked(here, monkeypatch, capsys):
    _, text = imported(here, monkeypatch, four(link("base", 8.0, com=(0, 0, 0.1))), "--wheels", "mecanum")
    marked = {line.split(" = ")[0] for line in text.splitlines() if "# guess: " in line}
    motor = {"stall_torque_n_m", "no_load_rad_s"}
    limits = {"vx_m_s", "vy_m_s", "wz_rad_s"}
    assert marked == motor | limits | {"count", "radius_m", "roller_angle_rad", "contact", "box_m"}
    # The first thrust is two thirds of the weight: 10 kg, four wheels of 50 mm, two digits.
    assert tomllib.loads(text)["motor"]["stall_torque_n_m"] == float(f"{2 / 3 * 10 * 9.81 * 0.05 / 4:.2g}")
    marks = sum("# guess: " in line for line in text.splitlines())
    said = capsys.readouterr().out
    assert said == (
        f'robot.toml: 1 body, 0 hinges, 4 mecanum wheels, 10.000 kg; {marks} values are marked "# guess"; '
        "next: omnistep check robot.toml\n"
    )


def test_names_from_a_urdf_add_no_keys_to_the_file(here, monkeypatch):
    urdf = four(BODY).replace('name="four"', 'name="a&#10;gravity = 0"').replace('"fl_wheel"', '"fl&#10;x = 1 wheel"')
    vehicle, text = imported(here, monkeypatch, urdf)
    assert set(vehicle["wheel"][0]) == set(vehicle["wheel"][1])
    assert set(vehicle) == {"schema_version", "name", "body", "motor", "limits", "rollers", "wheel"}
    assert "gravity" in text.splitlines()[1]


def test_without_a_urdf_the_command_is_the_compiled_one(here, monkeypatch, capfd):
    monkeypatch.setattr(sys, "argv", ["omnistep", "new", "vehicle", "robot", "--like", "mecanum4"])
    assert main() == 0
    assert capfd.readouterr().out.startswith("robot.toml: started from mecanum4;")
