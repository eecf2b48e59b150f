"""`omnistep new vehicle NAME --from-urdf`: round parts that are no wheels, and what contradicts itself in a URDF."""

import math
import sys
import tomllib

import numpy as np
import pytest

from omnistep.__main__ import main
from omnistep._omnistep import cli


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def imported(here, monkeypatch, urdf, *options):
    """The keys of the vehicle file that the command writes, and the notes in it by key."""
    (here / "robot.toml").unlink(missing_ok=True)
    (here / "robot.urdf").write_text(urdf)
    monkeypatch.setattr(sys, "argv", ["omnistep", "new", "vehicle", "robot", "--from-urdf", "robot.urdf", *options])
    assert main() == 0
    text = (here / "robot.toml").read_text()
    notes = [line.split(" # guess: ") for line in text.splitlines() if " # guess: " in line]
    return tomllib.loads(text), [(before.split(" = ")[0].strip(), note) for before, note in notes]


def refused(here, monkeypatch, capsys, urdf, *options):
    """The line with which the command refuses."""
    (here / "robot.urdf").write_text(urdf)
    monkeypatch.setattr(sys, "argv", ["omnistep", "new", "vehicle", "robot", "--from-urdf", "robot.urdf", *options])
    assert main() == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and len(said) <= 300
    return said


def sphere(radius):
    return f'<collision><geometry><sphere radius="{radius}"/></geometry></collision>'


def omni(robots, *more, named="wheel"):
    """A robot on three omni wheels, 150 mm from its middle."""
    parts = [robots.BODY, *more]
    for number in range(3):
        yaw = 2 * math.pi * number / 3
        at = (0.15 * math.cos(yaw), 0.15 * math.sin(yaw), 0.05)
        shape = robots.cylinder(0.05).replace(f'rpy="{robots.HALF_TURN} 0 0"', f'rpy="0 {robots.HALF_TURN} 0"')
        parts.append(robots.link(f"{named}{number}", 0.5, (0.0006, 0.0003, 0.0003), shape=shape))
        joint = robots.joint(f"turn{number}", "continuous", "base", f"{named}{number}", at, (0, 0, yaw), (1, 0, 0))
        parts.append(joint)
    return f'<robot name="omni">{"".join(parts)}</robot>'


def round_part(robots, name, at, shape):
    """A part that turns about y and weighs 0.1 kg."""
    yield robots.link(name, 0.1, (0.0003, 0.0006, 0.0003), shape=shape)
    yield robots.joint(f"{name}_joint", "continuous", "base", name, at)


#: A support ball, a brush and a drum: round, about a level axle, on the ground.
PARTS = {
    "support_ball": ((-0.03, 0.02, 0.05), sphere(0.05)),
    "middle_ball": ((0, 0, 0.05), sphere(0.05)),
    "brush": ((0.35, 0.1, 0.05), None),
    "drum": ((0.3, 0, 0.05), None),
}


@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize("kind", ["omni", "mecanum"])
def test_a_round_part_that_is_not_named_as_a_wheel_belongs_to_the_body_and_is_noted(
    part, kind, robots, here, monkeypatch
):
    at, shape = PARTS[part]
    more = round_part(robots, part, at, shape or robots.cylinder(0.05, 0.1))
    urdf = omni(robots, *more) if kind == "omni" else robots.four(robots.BODY, *more)
    vehicle, notes = imported(here, monkeypatch, urdf)
    wheels = 3 if kind == "omni" else 4
    assert len(vehicle["wheel"]) == wheels
    assert math.isclose(vehicle["body"][0]["mass_kg"], 8.1, rel_tol=1e-9)
    (note,) = [note for key, note in notes if key == "mass_kg"]
    assert note.startswith(f"with {part}, which touches the ground, but is not named as the wheels are; joints held")
    # The option says the same, by the link or by the joint, and then there is nothing to note of the ground.
    for name in (part, f"{part}_joint"):
        same, notes = imported(here, monkeypatch, urdf, "--not-wheel", name)
        assert same == vehicle
        assert [note for key, note in notes if key == "mass_kg"] == [f"joints held at 0: {part}_joint"]


def test_the_option_leaves_out_a_part_named_as_a_wheel_or_of_a_robot_without_names(robots, here, monkeypatch):
    ball = list(round_part(robots, "support_wheel", (-0.03, 0.02, 0.05), sphere(0.05)))
    vehicle, _ = imported(here, monkeypatch, omni(robots, *ball))
    assert len(vehicle["wheel"]) == 4
    vehicle, _ = imported(here, monkeypatch, omni(robots, *ball), "--not-wheel", "support_wheel")
    assert len(vehicle["wheel"]) == 3
    # No name says anything: all round parts on the ground are wheels, and each says so.
    two = [*ball, *round_part(robots, "support2", (0.3, 0.02, 0.05), sphere(0.05))]
    urdf = omni(robots, *two, named="part").replace("support_wheel", "support1")
    vehicle, notes = imported(here, monkeypatch, urdf)
    note = "a round part that touches the ground; if it is no wheel, use --not-wheel"
    assert len(vehicle["wheel"]) == 5 and notes.count(("name", note)) == 5
    vehicle, _ = imported(here, monkeypatch, urdf, "--not-wheel", "support1", "--not-wheel=support2")
    assert len(vehicle["wheel"]) == 3


def test_rollers_of_a_part_that_is_left_out_are_no_wheels(robots, here, monkeypatch):
    more = list(round_part(robots, "spare_wheel", (0.3, 0.1, 0.05), robots.cylinder(0.05)))
    more += [robots.link("roller", 0.01, shape=robots.cylinder(0.01))]
    more += [robots.joint("roller_turn", "continuous", "spare_wheel", "roller", (0, 0, -0.04))]
    vehicle, _ = imported(here, monkeypatch, robots.four(robots.BODY, *more), "--not-wheel", "spare_wheel")
    assert [wheel["name"] for wheel in vehicle["wheel"]] == ["fl", "fr", "rl", "rr"]
    assert math.isclose(vehicle["body"][0]["mass_kg"], 8.11, rel_tol=1e-9)


def test_a_refusal_of_a_named_part_says_how_to_leave_it_out(robots, here, monkeypatch, capsys):
    middle = list(round_part(robots, "spare_wheel", (0, 0.1, 0.05), robots.cylinder(0.05)))
    urdf = robots.four(robots.BODY, *middle)
    said = refused(here, monkeypatch, capsys, urdf)
    assert 'mecanum wheel "spare_wheel" is in the middle' in said
    assert said.endswith("; --not-wheel spare_wheel leaves it out\n")
    assert len(imported(here, monkeypatch, urdf, "--not-wheel", "spare_wheel")[0]["wheel"]) == 4
    (here / "robot.toml").unlink()
    # Too few remain: the refusal names the parts that the rule of names left out.
    urdf = robots.four(robots.BODY).replace("rl_wheel", "rl").replace("rr_wheel", "rr")
    said = refused(here, monkeypatch, capsys, urdf)
    assert "2 wheels (fl_wheel, fr_wheel)" in said and said.endswith("; not named as wheels: rl, rr\n")


def turned(robots, yaw):
    """The small robot below a root link that it is turned in."""
    base = robots.link("root") + robots.joint("mount", "fixed", "root", "base", rpy=(0, 0, yaw))
    return robots.four(robots.BODY, base)


NAMES = (("fl", "front left"), ("fr", "front right"), ("rl", "rear left"), ("rr", "rear right"))


@pytest.mark.parametrize("words", [False, True])
def test_names_that_say_another_place_are_noted(words, robots, here, monkeypatch):
    def named(urdf):
        for letters, word in NAMES if words else ():
            urdf = urdf.replace(f'"{letters}_wheel"', f'"{word.replace(" ", "_")}_wheel"')
        return urdf

    _, notes = imported(here, monkeypatch, named(robots.four(robots.BODY)))
    assert not [note for key, note in notes if key in ("position_m", "rolling_direction")]
    _, notes = imported(here, monkeypatch, named(turned(robots, math.pi)))
    expected = [
        f"at the {other}, but the name says {word}"
        for (_, word), (_, other) in zip(NAMES, reversed(NAMES), strict=True)
    ]
    assert [note for key, note in notes if key == "position_m"] == expected
    mirrored = robots.four(robots.BODY)
    for old, new in (("fl_", "x_"), ("fr_", "fl_"), ("x_", "fr_")):
        mirrored = mirrored.replace(f'"{old}wheel"', f'"{new}wheel"')
    _, notes = imported(here, monkeypatch, named(mirrored))
    assert [note for key, note in notes if key == "position_m"] == [
        "at the left, but the name says right",
        "at the right, but the name says left",
    ]


@pytest.mark.parametrize(("yaw", "degrees"), [(math.pi / 2, 90), (-math.pi / 2, 90), (0.2, 11)])
def test_wheels_that_do_not_roll_along_x_are_noted(yaw, degrees, robots, here, monkeypatch):
    _, notes = imported(here, monkeypatch, turned(robots, yaw))
    note = f"{degrees} degrees off x, which is forward: is root turned?"
    assert [said for key, said in notes if key == "rolling_direction"] == [note] * 4
    # Omni wheels roll in every direction.
    _, notes = imported(here, monkeypatch, omni(robots))
    assert not [said for key, said in notes if key == "rolling_direction"]


def test_a_centre_of_mass_in_the_ground_and_implausible_radii_are_noted(robots, here, monkeypatch):
    below = robots.BODY.replace('xyz="0 0 0.1"', 'xyz="0 0 -0.3"')
    vehicle, notes = imported(here, monkeypatch, robots.four(below))
    assert ("com_m", "not above the ground: are the places and the inertial right?") in notes
    np.testing.assert_allclose(vehicle["body"][0]["com_m"], [0, 0, -0.3], atol=1e-9)
    note = ("radius_m", "wheels of 0.01 to 0.5 m are usual: is the URDF in metres?")
    for radius in (1.97, 0.005):
        urdf = robots.four(robots.BODY, radius=radius)
        if radius > 1.0:  # inches, whose wheels are clear of each other
            urdf = urdf.replace("0.2 0.15 ", "7.9 5.9 ").replace("0.2 -0.15 ", "7.9 -5.9 ")
        _, notes = imported(here, monkeypatch, urdf)
        assert notes.count(note) == 4
        # A radius that was given is no guess.
        assert note not in imported(here, monkeypatch, urdf, "--radius", str(radius))[1]
    assert note not in imported(here, monkeypatch, robots.four(robots.BODY))[1]


@pytest.mark.parametrize("name", ["panther", "ridgeback", "robotino", "rosbot_xl", "rosmaster_x3", "youbot", "lekiwi"])
def test_public_robots_do_not_contradict_themselves_and_their_doubts_are_published(
    name, robots, here, monkeypatch, capfd
):
    urdf, options, *_ = robots.ROBOTS.get(name, (robots.lekiwi, ["--radius", "0.05"]))
    _, notes = imported(here, monkeypatch, urdf(), *options)
    words = ("but the name says", "which is forward", "not above the ground", "are usual", "touches the ground")
    found = [note for _, note in notes if any(word in note for word in words)]
    # The inertial of Robotino's base has no origin: its centre of mass is on the floor.
    low = name == "robotino"
    assert found == (["not above the ground: are the places and the inertial right?"] if low else [])
    capfd.readouterr()
    assert cli(["omnistep", "check", "robot.toml"]) == 0
    warned = [line for line in capfd.readouterr().err.splitlines() if line.startswith("warning: ")]
    # Wheels of 0.4 kg with 1 kg.m^2, and with the inertia of something larger.
    published = ["all its mass at the rim gives"] * (name in ("robotino", "youbot"))
    published += ["com_m has the height 0,", "the derived time constant is 6.83 s"] * low
    assert [line for line in warned if not any(text in line for text in published)] == []
