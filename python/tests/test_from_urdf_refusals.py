"""What `omnistep new vehicle NAME --from-urdf` refuses: one clear line each, and no file."""

import os
import sys

import pytest

from omnistep.__main__ import main
from omnistep._urdf_tree import MOST_BYTES


@pytest.fixture(autouse=True)
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def refusal(here, monkeypatch, capsys, urdf, *options, file="robot.urdf"):
    """The one line that the command says of a URDF, which it refuses."""
    if urdf is not None:
        (here / file).write_bytes(urdf if isinstance(urdf, bytes) else urdf.encode())
    monkeypatch.setattr(sys, "argv", ["omnistep", "new", "vehicle", "robot", "--from-urdf", file, *options])
    assert main() == 2
    out, err = capsys.readouterr()
    assert out == "" and err.startswith("error: ") and err.count("\n") == 1 and len(err) <= 300
    assert not (here / "robot.toml").exists() and list(here.glob("*.part*")) == []
    return err[len("error: ") : -1]


def replaced(old, new):
    """The small robot with another text in it."""

    def urdf(robots):
        text = robots.four(robots.BODY)
        assert old in text
        return text.replace(old, new, 1)

    return urdf


def added(more):
    """The small robot with more parts."""
    return lambda robots: robots.four(robots.BODY).replace("</robot>", f"{more}</robot>")


def middle(robots):
    """Two more wheels between the others."""
    for side, y in (("ml", 0.15), ("mr", -0.15)):
        yield robots.link(f"{side}_wheel", 0.5, shape=robots.cylinder(0.05))
        yield robots.joint(side, "continuous", "base", f"{side}_wheel", (0, y, 0.05))


FIXED = '<joint name="{0}" type="fixed"><parent link="{1}"/><child link="{2}"/></joint>'
STEERED = (
    '<link name="fork"/><joint name="steer" type="revolute"><parent link="base"/><child link="fork"/>'
    '<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
)


@pytest.mark.parametrize(
    ("urdf", "said"),
    [
        (lambda robots: "", "not a URDF: no element found: line 1, column 0, allowed: one <robot>"),
        (lambda robots: "<robot", "not a URDF: unclosed token: line 1, column 0, allowed: one <robot>"),
        (lambda robots: "<sdf/>", "not a URDF: its root is <sdf>, allowed: <robot>"),
        (lambda robots: "<robot/>", "no links, allowed: a robot with links and joints"),
        (lambda robots: 2 * robots.four(robots.BODY), "2 robots in one file, allowed: one <robot>"),
        (lambda robots: b"<robot name='\xff'/>", "not a URDF: not UTF-8, allowed: a URDF file"),
        (added('<link name="base"/>'), 'two links are named "base", allowed: one'),
        (added(FIXED.format("fl", "base", "x")), 'two joints are named "fl", allowed: one'),
        (added(FIXED.format("", "base", "x")), "joint 4 has no name, allowed: a name"),
        (added(FIXED.format("j", "base", "tool")), 'joint "j": child "tool" is missing, allowed: a link of the file'),
        (added(FIXED.format("j", "tool", "base")), 'joint "j": parent "tool" is missing, allowed: a link of the file'),
        (
            added(FIXED.format("j", "fl_wheel", "base")),
            "every link is carried by another: a loop of joints, allowed: a tree of links",
        ),
        (
            added('<link name="a"/><link name="b"/>' + FIXED.format("j", "a", "b") + FIXED.format("k", "b", "a")),
            'link "a" is in a loop of joints, allowed: a tree of links',
        ),
        (
            added(FIXED.format("j", "base", "fl_wheel")),
            'link "fl_wheel" is carried by "fl" and "j", allowed: a tree of links',
        ),
        (added('<link name="lost"/>'), 'no joint carries "base", nor "lost", allowed: one root link'),
        (
            replaced('type="continuous"', 'type="screw"'),
            'joint "fl": type "screw", allowed: fixed, continuous, revolute, prismatic, planar, floating',
        ),
        (replaced('<parent link="base"/>', ""), 'joint "fl": no parent, allowed: <parent link="..."/>'),
        (replaced('<axis xyz="0 1 0"/>', '<axis xyz="0 0 0"/>'), 'joint "fl": axis of length 0, allowed: a direction'),
        (replaced("0.2 0.15 0.05", "nan 0.15 0.05"), 'joint "fl": xyz "nan 0.15 0.05", allowed: 3 numbers within 1e9'),
        (replaced("0.2 0.15 0.05", "0.2 0.15"), 'joint "fl": xyz "0.2 0.15", allowed: 3 numbers within 1e9'),
        (replaced("0.2 0.15 0.05", "${x} 0 0"), 'joint "fl": xyz "${x} 0 0", allowed: 3 numbers within 1e9'),
        (replaced('value="0.5"', 'value="inf"'), 'link "fl_wheel": value "inf", allowed: a number within 1e9'),
        (replaced('value="0.5"', 'value="-1"'), 'link "fl_wheel": mass -1 kg, allowed: 0 or more'),
        (
            replaced('value="0.5"', 'value="0"'),
            'wheel "fl_wheel": mass 0 kg, allowed: 0.001 to 10000: an inertial with its mass',
        ),
        (
            replaced('value="8.0"', 'value="0"'),
            'body "base": mass 0 kg, allowed: 0.001 to 10000: an inertial with its mass',
        ),
        (replaced('<mass value="8.0"/>', ""), 'link "base": an inertial without mass, allowed: <mass value="..."/>'),
        (replaced('ixx="0.05"', 'ixx="-0.05"'), 'link "base": a moment of inertia below 0, allowed: 0 or more'),
        (replaced('radius="0.05"', 'radius="0"'), 'link "fl_wheel": cylinder of radius 0 m, allowed: above 0'),
        (
            lambda robots: robots.panther(),
            'wheel "fl_wheel_link": no cylinder or sphere about its axle, allowed: --radius in m',
        ),
        (
            lambda robots: robots.four(robots.BODY, radius=50.0),
            'wheel "fl_wheel": radius 50 m, allowed: 0.001 to 2; is the file in millimetres?',
        ),
        (
            lambda robots: robots.four(robots.BODY).replace("0.2 0.15 0.05", "200.0 150.0 0.05"),
            'wheel "fl_wheel": 250 m from the origin, allowed: 200 radii; are places in millimetres?',
        ),
        (
            lambda robots: robots.four(robots.BODY).replace("continuous", "fixed"),
            "no wheels among 4 joints, allowed: continuous joints about a level axis, "
            'with "wheel" in the name (4 fixed ones are named so) or a cylinder about it',
        ),
        (
            lambda robots: robots.four(robots.BODY).replace("continuous", "fixed", 2),
            "2 wheels (rl_wheel, rr_wheel), allowed: 3 to 8 omni or mecanum wheels",
        ),
        (
            lambda robots: robots.four(robots.BODY, STEERED).replace(
                'link="base"/><child link="fl', 'link="fork"/><child link="fl'
            ),
            'wheel "fl_wheel" is steered by "steer", allowed: omni or mecanum wheels '
            "on axles that do not turn about the vertical; --not-wheel fl_wheel leaves it out",
        ),
        (
            lambda robots: robots.four(robots.BODY).replace("0.2 0.15 0.05", "0.2 0.15 0.08"),
            'wheel "fl_wheel" is 0.030 m above the lowest, allowed: 0.013, all on one ground; '
            "--not-wheel fl_wheel leaves it out",
        ),
        (
            lambda robots: robots.four(robots.BODY, *middle(robots)),
            'mecanum wheel "ml_wheel" is in the middle, allowed: a left and a right one in front and rear; '
            "--not-wheel ml_wheel leaves it out",
        ),
        (
            lambda robots: robots.ridgeback().replace('lower="-0.08726"', 'lower="0.01"'),
            'joint "front_rocker": 0.01 to 0.08726 rad, allowed: below 0 to above 0',
        ),
        (
            lambda robots: robots.ridgeback().replace('upper="0.08726"', 'upper="stop"'),
            'joint "front_rocker": limit upper "stop", allowed: a number',
        ),
    ],
)
def test_a_wrong_urdf_gets_one_line(urdf, said, robots, here, monkeypatch, capsys):
    line = refusal(here, monkeypatch, capsys, urdf(robots))
    assert line == f"robot.urdf: {said}"


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--radius", "50"], "--radius 50, allowed: 0.001 to 2, in m"),
        (["--radius", "nan"], "--radius nan, allowed: 0.001 to 2, in m"),
        (
            ["--not-wheel", "lidar"],
            "--not-wheel lidar: robot.urdf has no such wheel, allowed: fl_wheel, fr_wheel, rl_wheel, rr_wheel",
        ),
        (
            ["--not-wheel", "fl_wheel", "--not-wheel", "rr"],
            "robot.urdf: 2 wheels (fr_wheel, rl_wheel), allowed: 3 to 8 omni or mecanum wheels",
        ),
        (["--wheels", "omni"], "robot.urdf: --wheels omni: the axles are all parallel, allowed: mecanum"),
    ],
)
def test_a_wrong_option_gets_one_line(options, said, robots, here, monkeypatch, capsys):
    assert refusal(here, monkeypatch, capsys, robots.four(robots.BODY), *options) == said


def test_the_wheels_of_robotino_are_refused_for_the_mass_that_is_published(robots, here, monkeypatch, capsys):
    said = refusal(here, monkeypatch, capsys, robots.robotino(wheel_kg=0.00001), "--radius", "0.04")
    assert said == 'robot.urdf: wheel "wheel0_link": mass 1e-05 kg, allowed: 0.001 to 10000: an inertial with its mass'


def test_xacro_is_refused_with_the_command_that_makes_urdf_of_it(robots, here, monkeypatch, capsys):
    urdf = robots.four(robots.BODY)
    said = refusal(here, monkeypatch, capsys, urdf, file="bot.urdf.xacro")
    assert said == (
        "bot.urdf.xacro: xacro is not URDF, allowed: URDF; run xacro first: xacro bot.urdf.xacro > bot_flat.urdf"
    )
    unbound = urdf.replace("</robot>", "<xacro:wheel/></robot>")
    bound = unbound.replace("<robot", '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"')
    for text in (unbound, bound):
        said = refusal(here, monkeypatch, capsys, text)
        assert said.endswith("run xacro first: xacro robot.urdf > robot_flat.urdf")


def test_the_output_of_xacro_may_have_its_name_space_and_comments(robots, here, monkeypatch, capsys):
    text = robots.four(robots.BODY).replace("<robot", '<robot xmlns:xacro="http://www.ros.org/wiki/xacro"')
    (here / "robot.urdf").write_text(text.replace("</robot>", "<!-- <xacro:wheel/> --></robot>"))
    monkeypatch.setattr(sys, "argv", ["omnistep", "new", "vehicle", "robot", "--from-urdf", "robot.urdf"])
    assert main() == 0 and (here / "robot.toml").exists()


def test_entities_are_neither_grown_nor_fetched(robots, here, monkeypatch, capsys):
    grown = "".join(f'<!ENTITY e{n} "{10 * f"&e{n - 1};"}">' for n in range(1, 10))
    bomb = f'<!DOCTYPE robot [<!ENTITY e0 "x">{grown}]>'
    (here / "secret.txt").write_text("secret")
    outside = f'<!DOCTYPE robot [<!ENTITY e9 SYSTEM "file://{here}/secret.txt">]>'
    for head in (bomb, outside, '<!DOCTYPE robot SYSTEM "http://127.0.0.1:9/x.dtd">'):
        said = refusal(here, monkeypatch, capsys, head + robots.four(robots.BODY).replace('"four"', '"&e9;"'))
        assert said == "robot.urdf: the URDF declares entities, allowed: plain elements"
    # In another encoding, too.
    said = refusal(here, monkeypatch, capsys, (bomb + "<robot/>").encode("utf-16"))
    assert said == "robot.urdf: not a URDF: not UTF-8, allowed: a URDF file"


def test_what_is_no_file_or_too_large_a_one_is_refused(robots, here, monkeypatch, capsys):
    assert refusal(here, monkeypatch, capsys, None) == "robot.urdf: no such file, allowed: a URDF file"
    os.mkfifo(here / "pipe.urdf")
    said = refusal(here, monkeypatch, capsys, None, file="pipe.urdf")
    assert said == "pipe.urdf: not a regular file, allowed: a URDF file"
    large = robots.four(robots.BODY) + " " * (20 * 10**6)
    said = refusal(here, monkeypatch, capsys, large)
    assert said == f"robot.urdf: {len(large)} bytes, allowed: {MOST_BYTES}"


def test_deep_and_long_trees_are_read_without_recursion(robots, here, monkeypatch, capsys):
    deep = "<a>" * 10**5 + "</a>" * 10**5
    assert "no links" in refusal(here, monkeypatch, capsys, f"<robot>{deep}</robot>")
    chain = "".join(f'<link name="l{n}"/>' + FIXED.format(f"j{n}", f"l{n - 1}", f"l{n}") for n in range(1, 5000))
    said = refusal(here, monkeypatch, capsys, f'<robot><link name="l0"/>{chain}</robot>')
    assert said.startswith("robot.urdf: no wheels among 4999 joints, allowed: ")


def test_a_file_that_exists_is_kept(robots, here, monkeypatch, capsys):
    (here / "robot.urdf").write_text(robots.four(robots.BODY))
    (here / "robot.toml").write_text("mine")
    monkeypatch.setattr(sys, "argv", ["omnistep", "new", "vehicle", "robot", "--from-urdf=robot.urdf"])
    assert main() == 2
    kept = "the file exists and was not changed; use another name, or move it away first"
    assert capsys.readouterr().err == f"error: robot.toml: {kept}\n"
    assert (here / "robot.toml").read_text() == "mine"


def test_a_name_that_is_a_path_is_refused_as_by_the_compiled_command(robots, here, monkeypatch, capfd):
    (here / "robot.urdf").write_text(robots.four(robots.BODY))
    said = []
    for options in (["--from-urdf", "robot.urdf"], ["--template", "mecanum4"]):
        monkeypatch.setattr(sys, "argv", ["omnistep", "new", "vehicle", "../robot", *options])
        assert main() == 2
        said.append(capfd.readouterr().err)
    assert said[0] == said[1] and "allowed: 1 to 40 letters" in said[0]
