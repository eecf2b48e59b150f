"""Logs back into Python, and what is made of them."""

import base64
import json
import re
import struct
import subprocess
import sys
from pathlib import Path

import matplotlib
import numpy as np
import pytest

import omnistep
from omnistep import _metrics, _scene, meshes, plot, report
from omnistep.__main__ import main

matplotlib.use("Agg")


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A climb and its log."""
    path = tmp_path_factory.mktemp("logs") / "step.mcap"
    trace = omnistep.run("step", overrides={"duration_s": 2.0}, mcap=path)
    return trace, path


def test_a_report_of_several_scenarios_names_all_in_its_title_and_each_run_s(tmp_path):
    logs = []
    for scenario, vehicle, name in (
        ("flat", "chugo7", "flat"),
        ("flat", "omni3", "flat"),
        ("step", "chugo7", "step"),
        ("flat", "chugo7", "moon"),
    ):
        path = tmp_path / f"{name}-{vehicle}.mcap"
        keys = {"name": name, "duration_s": 0.1, "vehicle": vehicle, "physics.engine": "articulated"}
        omnistep.run(scenario, overrides=keys, mcap=path)
        logs.append(omnistep.read_mcap(path))
    logs, moon = logs[:3], logs[3]
    title = "flat with chugo7, flat with omni3, step with chugo7: traction"
    text = report.page(logs)
    assert f"<title>{title}</title>" in text and f"<h1>{title}</h1>" in text
    assert "<th scope=col><span>step, chugo7, traction</span></th>" in text
    # What they do not share is not said of all of them.
    assert "vehicle chugo7" not in text and "scenario flat" not in text and "omnistep 0." in text
    assert "<h1>flat with chugo7: traction</h1>" in report.page([logs[0], logs[0]])
    title = "flat with chugo7, flat with omni3, step with chugo7 and 1 more: traction"
    assert f"<h1>{title}</h1>" in report.page([*logs, moon])


def test_a_report_opens_where_a_low_step_is_half_climbed_and_at_the_start_on_level_ground(tmp_path):
    keys = {"physics.engine": "articulated", "terrain.height_m": 0.005, "duration_s": 4.0}
    omnistep.run("step", overrides=keys, mcap=tmp_path / "step.mcap")
    log = omnistep.read_mcap(tmp_path / "step.mcap")
    at_s = report._run(log)["obstacle"]
    middle_m = np.interp(at_s, log.frame_time_s, log.frames["base_link"][:, 0])
    assert abs(middle_m - 0.7) < 0.3, "the middle of the vehicle is within half its length of the edge"
    omnistep.run("flat", overrides={"physics.engine": "articulated", "duration_s": 1.0}, mcap=tmp_path / "flat.mcap")
    log = omnistep.read_mcap(tmp_path / "flat.mcap")
    assert report._run(log)["obstacle"] == log.frame_time_s[0]


def test_a_report_shows_shared_settings_below_its_title_and_others_in_names_and_rows(tmp_path):
    logs = []
    for vehicle, height, name in (("chugo7", 0.03, "a"), ("chugo7", 0.05, "b"), ("mecanum4", 0.05, "c")):
        given = {"duration_s": 0.1, "vehicle": vehicle, "terrain.height_m": height, "terrain.friction": 0.5}
        path = tmp_path / f"{name}.mcap"
        omnistep.run("step", overrides=given, mcap=path)
        logs.append(omnistep.read_mcap(path))
    assert report._names(logs) == [
        "chugo7, traction, height 0.03 m",
        "chugo7, traction, height 0.05 m",
        "mecanum4, traction",
    ]
    text = report.page(logs)
    assert "<p>friction 0.5, command speed 0.3 m/s, engine " in text
    rows = dict(re.findall(r'<tr class="setting"><th scope=row>([^<]*)</th>(.*?)</tr>', text))
    cells = {heading: re.findall(r"<td>([^<]*)</td>", row) for heading, row in rows.items()}
    assert cells == {
        "height [m]": ["0.03", "0.05", "0.05"],
        "torque limit [N.m]": ["2", "2", "3"],
        # At an edge mecanum wheels are simulated with rollers, without being asked for.
        "wheel model": ["balls", "balls", "rollers"],
    }
    assert "<p>height 0.03 m, friction 0.5, torque limit 2 N.m, wheel model balls," in report.page(logs[:1])


def test_plots_of_a_report_keep_peaks_of_single_periods(run):
    trace, path = run
    read = report._run(omnistep.read_mcap(path))
    for name, signal in (("slip", "slip_ratio"), ("load", "force_normal_n")):
        shown = np.frombuffer(base64.b64decode(read["series"][name]), "<f4").reshape(-1, 7)
        # Climbs have peaks between two of the plot's rows, which are 20 ms apart.
        assert len(shown) <= 102 < len(trace)
        largest = np.nanmax(np.abs(trace.wheels(signal)), axis=0)
        np.testing.assert_allclose(np.abs(shown).max(axis=0), largest, rtol=1e-6)
        assert (np.abs(trace.wheels(signal)[::20]).max(axis=0) < 0.9 * largest).any(), signal


def test_a_report_marks_runs_whose_balls_do_not_stand_for_the_wheels(tmp_path):
    logs = []
    # A vehicle with mecanum wheels meets a step with its rollers, the other one does not.
    for vehicle, model in (("mecanum4", "ball"), ("mecanum4", "rollers"), ("chugo7", "ball")):
        given = {"duration_s": 0.1, "vehicle": vehicle, "physics.wheel_model": model, "physics.engine": "articulated"}
        path = tmp_path / f"{vehicle}-{model}.mcap"
        omnistep.run("step", overrides=given, mcap=path)
        logs.append(omnistep.read_mcap(path))
    footnote = "* Balls are not a valid model of this vehicle&#x27;s wheels on this ground."
    text = report.page(logs)
    (verdicts,) = re.findall(r'<tr class="verdict">(.*?)</tr>', text)
    assert re.findall(r"<td><span>([^<]*)<", verdicts) == ["unfinished *", "unfinished", "unfinished"]
    assert footnote in text.split("</table>")[1] and footnote not in report.page(logs[1:])


def test_runs_of_one_name_are_distinguished_by_seed_file_or_number_and_no_others_are(tmp_path):
    logs = []
    for policy, seed, name in (
        ("scale_torques", 0, "a"),
        ("traction_runup", 0, "b"),
        ("scale_torques", 1, "c"),
        ("scale_torques", 1, "d"),
    ):
        path = tmp_path / f"{name}.mcap"
        omnistep.run("flat", overrides={"duration_s": 0.1, "control.policy": policy, "seed": seed}, mcap=path)
        logs.append(omnistep.read_mcap(path))
    assert report._names(logs) == [
        "scale_torques, seed 0",
        "traction_runup",
        "scale_torques, seed 1, c.mcap",
        "scale_torques, seed 1, d.mcap",
    ]
    assert report._names([logs[0], logs[0]]) == ["scale_torques, 1", "scale_torques, 2"]


@pytest.mark.parametrize(("scenario", "vehicle"), [("step", "chugo7"), ("flat", "mecanum4")])
def test_arrows_of_a_report_are_the_forces_of_the_run(tmp_path, scenario, vehicle):
    path = tmp_path / "x.mcap"
    # The articulated engine has no friction across a wheel's push: the arrows are the whole force.
    given = {"duration_s": 2.0, "vehicle": vehicle, "physics.engine": "articulated"}
    trace = omnistep.run(scenario, overrides=given, mcap=path)
    log = omnistep.read_mcap(path)
    shown = log.scene()
    pushes = _scene.pushes(log, shown, _scene.poses(log, shown["frames"]), shown["ground"])
    rows = np.round(log.frame_time_s * 1000).astype(int) - 1
    size = trace.wheels("force_normal_n")[rows]
    touches = size > 1.0
    assert touches.sum() > 300
    # They act where the run has the contact. A wheel goes 0.3 mm in the period over which its force is averaged; at the
    # riser's edge, where it touches both sides of it, it has one arrow.
    places = np.stack([trace.wheels(f"contact_{axis}_m")[rows] for axis in "xyz"], axis=2)
    off = np.linalg.norm(pushes[:, :, 3:] - places, axis=2)[touches]
    assert np.quantile(off, 0.95) < 3e-4
    # Together they are the force on the vehicle: within 2 % and 0.1 N, but for those moments at the edge.
    for axis, name in enumerate("xyz"):
        whole = trace[f"force_{name}_n"][rows]
        right = np.abs(pushes[:, :, axis].sum(axis=1) - whole) < 0.02 * np.abs(whole) + 0.1
        assert right.mean() > 0.9, (name, right.mean())
    assert not pushes[size == 0.0][:, :3].any()


def test_a_scene_has_the_bodies_wheels_and_ground_of_the_run(run):
    log = omnistep.read_mcap(run[1])
    scene = log.scene()
    assert [wheel["name"] for wheel in scene["wheels"]] == list("1234567")
    assert {(wheel["radius_m"], wheel["width_m"], wheel["roller_angle_rad"]) for wheel in scene["wheels"]} == {
        (0.066, 0.033, 0.0)
    }
    # An axle is to the left of the rolling direction: wheel 1 rolls along x, 3 against it, 2 along -y, 6 along y.
    axles = {wheel["name"]: wheel["axle"] for wheel in scene["wheels"]}
    assert [axles[name] for name in "1326"] == [[0, 1, 0], [0, -1, 0], [1, 0, 0], [-1, 0, 0]]
    assert sorted(body["edges_m"] for body in scene["bodies"]) == [[0.1] * 3, [0.34, 0.4, 0.3], [0.34, 0.4, 0.3]]
    # The floor's upper side is at 0, the step's at 5 cm, from 0.7 m on.
    floor, step = scene["ground"]
    tops = [round(part["at_m"][2] + part["half_m"][2], 6) for part in (floor, step)]
    assert tops == [0.0, 0.05] and round(step["at_m"][0] - step["half_m"][0], 6) == 0.7
    assert scene["patches"] == []
    # Every frame is one of the log's, and the base's is the first.
    assert scene["frames"][0] == "base_link" and set(scene["frames"]) == set(log.frames)


def test_a_log_holds_the_runs_own_numbers(run):
    trace, path = run
    log = omnistep.read_mcap(path)
    assert log.complete and log.outcome == trace.outcome and log.run["policy"] == trace.policy
    assert len(log.trace) == len(trace) == 2000
    for signal in log.trace.wheel_signals:
        assert np.array_equal(log.trace.wheels(signal), trace.wheels(signal)), signal
    for name in ("time_s", "estimated_vx_m_s", "common_factor"):
        assert np.array_equal(log.trace[name], trace[name]), name
    assert repr(log).endswith("unfinished, complete>"), log  # 2 s are not enough for the climb
    # Frames, 50 a second: the base is where the run has it, wheels where their centres are.
    rows = np.round(log.frame_time_s * 1000).astype(int) - 1
    assert np.array_equal(log.frames["base_link"][:, 0], trace["pose_x_m"][rows])
    for number, name in enumerate(trace.wheel_names):
        for axis, signal in enumerate(("x_m", "y_m", "z_m")):
            # Hinges give by some micrometres where a wheel hits the riser.
            off = log.frames[f"wheel_{name}"][:, axis] - trace.wheels(signal)[rows, number]
            assert np.abs(off).max() < 1e-4, (name, signal)


def test_the_scenario_of_a_log_runs_again_to_the_same_numbers(run, tmp_path):
    trace, path = run
    (tmp_path / "again.toml").write_text(omnistep.read_mcap(path).scenario_toml)
    again = omnistep.run(tmp_path / "again.toml")
    assert np.array_equal(again.wheels("applied_n_m"), trace.wheels("applied_n_m"))


def test_a_log_that_ends_early_is_read_to_its_last_chunk(run, tmp_path):
    _, path = run
    part = tmp_path / "step.mcap.part"
    whole = path.read_bytes()
    part.write_bytes(whole[: len(whole) * 2 // 3])
    log = omnistep.read_mcap(part)
    assert not log.complete and log.outcome is None and log.trace.outcome.verdict == "unfinished"
    assert 500 < len(log.trace) < 2000


@pytest.mark.parametrize("where", ["chunk", "summary"])
def test_a_flipped_bit_is_an_error_that_names_the_file(run, tmp_path, where):
    _, path = run
    whole = path.read_bytes()
    said = []
    # Of most bits of a chunk what it unpacks to is wrong, and its check finds that; of some it does not unpack at all.
    for byte in range(len(whole) // 2, len(whole) // 2 + 20) if where == "chunk" else [-200]:
        bad = bytearray(whole)
        bad[byte] ^= 1
        (tmp_path / "bad.mcap").write_bytes(bad)
        with pytest.raises(omnistep.LogError, match=r"bad\.mcap: damaged: ") as raised:
            omnistep.read_mcap(tmp_path / "bad.mcap")
        assert raised.value.file == str(tmp_path / "bad.mcap")
        said.append(str(raised.value))
    assert any("CRC" in line for line in said)


def test_what_is_no_log_is_an_error_that_names_the_file(tmp_path):
    with pytest.raises(omnistep.LogError, match="missing"):
        omnistep.read_mcap(tmp_path / "missing.mcap")
    (tmp_path / "x.mcap").write_text("hello")
    with pytest.raises(omnistep.LogError, match="not an MCAP file"):
        omnistep.read_mcap(tmp_path / "x.mcap")


def test_shapes_of_a_urdf_have_their_sizes(run):
    log = omnistep.read_mcap(run[1])
    mesh = meshes.of_urdf(log.urdf)
    assert set(mesh.links[:3]) == {"base_link", "rear", "front"}
    wheel = mesh.vertices_m[mesh.link == mesh.links.index("wheel_4")]
    # It rolls along x: a cylinder of 66 mm whose axis is y, 33 mm wide.
    assert np.allclose(wheel.min(axis=0), [-0.066, -0.0165, -0.066]) and np.allclose(
        wheel.max(axis=0), [0.066, 0.0165, 0.066]
    )
    # Crosswise wheels roll along y.
    aside = mesh.vertices_m[mesh.link == mesh.links.index("wheel_2")]
    assert np.allclose(np.ptp(aside, axis=0), [0.033, 0.132, 0.132])
    # Triangles face outwards: the volume they enclose is that of the shapes, but for the wheels' corners.
    for name, volume in (("front", 0.34 * 0.4 * 0.3), ("wheel_4", 12 * 0.066**2 * np.sin(np.pi / 12) * 0.033)):
        corners = mesh.vertices_m[mesh.triangles[mesh.link[mesh.triangles[:, 0]] == mesh.links.index(name)]]
        enclosed = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
        assert abs(abs(enclosed) / volume - 1) < 1e-9, name
    assert np.array_equal(meshes.axles(log.urdf)["wheel_6"].round(9), [-1, 0, 0])
    for axis in ("0 0 0", "1 2", "a b c", "nan 0 0"):
        joint = f'<joint name="j" type="continuous"><child link="w"/><axis xyz="{axis}"/></joint>'
        with pytest.raises(ValueError, match="not a URDF: the axis of 'w' is not three numbers"):
            meshes.axles(f'<robot name="x">{joint}</robot>')
    with pytest.raises(ValueError, match="entities"):
        meshes.of_urdf('<!DOCTYPE x [<!ENTITY a "b">]><robot name="x"/>')
    bad = [
        f'<robot><link name="a"><visual><geometry>{shape}</geometry></visual></link></robot>'
        for shape in (
            '<box size="nan 1 1"/>',
            '<box size="1 1"/>',
            '<box size="1 0 1"/>',
            '<cylinder radius="inf" length="1"/>',
            '<cylinder radius="-1" length="1"/>',
        )
    ]
    for text in ("<robot", '<robot><link name="a"><visual/></link></robot>', *bad):
        with pytest.raises(ValueError, match="not a URDF"):
            meshes.of_urdf(text)
    with pytest.raises(ValueError, match="'a' has a shape of radius = '-1', allowed: finite numbers, sizes above 0"):
        meshes.shapes(bad[-1])


@pytest.mark.parametrize("vehicle", omnistep.list_vehicles())
def test_urdf_loads_elsewhere_with_the_masses_and_axes_of_the_file(vehicle, tmp_path):
    yourdfpy = pytest.importorskip("yourdfpy")
    tomllib = pytest.importorskip("tomllib")
    text = subprocess.run(
        [sys.executable, "-m", "omnistep", "export", vehicle, "--format", "urdf"],
        check=True,
        capture_output=True,
        text=True,
    ).stdout
    (tmp_path / "v.urdf").write_text(text)
    robot = yourdfpy.URDF.load(str(tmp_path / "v.urdf"), load_meshes=False, build_scene_graph=True)
    omnistep.run("flat", overrides={"vehicle": vehicle, "duration_s": 0.01}, mcap=tmp_path / "x.mcap")
    given = tomllib.loads(omnistep.read_mcap(tmp_path / "x.mcap").scenario_toml)["vehicle"]
    masses = {link.name: link.inertial.mass for link in robot.robot.links}
    assert masses["base_link"] == given["body"][0]["mass_kg"]
    for body in given["body"][1:]:
        assert masses[body["name"]] == body["mass_kg"]
    joints = robot.joint_map
    for hinge in given.get("hinge", []):
        assert np.allclose(joints[hinge["name"]].axis, np.array(hinge["axis"]) / np.linalg.norm(hinge["axis"]))
        assert joints[hinge["name"]].limit.upper == hinge["limit_rad"]
    for wheel in given["wheel"]:
        dx, dy = np.array(wheel["rolling_direction"]) / np.linalg.norm(wheel["rolling_direction"])
        joint = joints[f"wheel_{wheel['name']}"]
        assert joint.type == "continuous" and np.allclose(joint.axis, [-dy, dx, 0.0])
        assert masses[f"wheel_{wheel['name']}"] == wheel["mass_kg"]
        # At rest the axle is where the file has it, whatever links are between.
        at = robot.get_transform(f"wheel_{wheel['name']}", "base_link")[:3, 3]
        assert np.allclose(at, [*wheel["position_m"], wheel["radius_m"]])


def test_a_page_holds_everything_and_asks_for_nothing(run, tmp_path, monkeypatch, capsys):
    _, path = run
    out = tmp_path / "page.html"
    monkeypatch.setattr(sys, "argv", ["omnistep", "report", str(path), str(path), "-o", str(out)])
    assert main() == 0 and capsys.readouterr().out == f"{out}\n"
    text = out.read_text(encoding="utf-8")
    own = text.split("<script>")[0] + text.split("</script>")[-2]
    assert not re.search(r"""(src|href)=["']?(https?:)?//""", own), "nothing from elsewhere"
    data = json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.S)[1])
    assert len(data["runs"]) == 2 and data["runs"][0]["wheels"] == list("1234567")
    # They are of one vehicle on one ground. The table has a column for each, and a row for each metric that is known.
    assert len(data["scenes"]) == 1 and data["runs"][1]["scene"] == 0
    rows = re.findall(r"<tr.*?</tr>", text.split("<table", 1)[1].split("</table>")[0])
    assert {len(re.findall(r"<t[hd]", row)) for row in rows} == {3} and len(rows) > 10
    assert "three.js authors" in text and "Permission is hereby granted" in text  # its licence goes with it


def test_a_page_shows_names_as_text_and_nothing_of_them_runs(run, tmp_path):
    evil = tmp_path / "<script>alert(1)<!--.mcap"
    evil.write_bytes(run[1].read_bytes())
    text = report.page([omnistep.read_mcap(evil)])
    assert "<script>alert" not in text and "&lt;script&gt;alert(1)&lt;!--.mcap" in text
    data = re.search(r'<script type="application/json" id="data">(.*?)</script>', text, re.S)[1]
    assert "<" not in data


def test_what_was_not_measured_is_a_gap_in_the_plots_and_no_number(run):
    decoded = report._measured(np.array([1.0, np.nan, np.inf, -np.inf]))
    values = np.frombuffer(base64.b64decode(decoded), "<f4")
    assert values[0] == 1.0 and np.isnan(values[1:]).all()


def test_every_metric_of_a_report_is_one_of_an_outcome_and_has_a_sentence(run):
    known = run[0].outcome.to_dict()
    for key, metric in _metrics.METRICS.items():
        assert key in known, key
        assert re.match(r"[A-Z].*\.$", metric.text) and metric.better in ("", "lower", "zero"), key
    assert _metrics.METRICS["work_j"].explained == "Mechanical work of the motors. Unit: J. Lower is better."


def test_the_metrics_of_a_report_are_written_and_explained_as_the_command_does(run, tmp_path):
    log = omnistep.read_mcap(run[1])
    printed = subprocess.run(
        [sys.executable, "-m", "omnistep", "info", "--explain", log.path], capture_output=True, text=True, check=True
    ).stdout
    rows = re.findall(r'<tr class="(\w+)"><th scope=row><button[^>]*>([^<]*)<.*?<td><span>([^<]*)<', report.page([log]))
    needed = {key for key, (_, shown) in log.outcome._rows().items() if shown}
    assert {key for key, _, _ in rows} == needed | {"verdict", *report._MORE} and len(needed) > 5
    for key, heading, value in rows:
        if key in report._MORE:  # the command has no row for it
            continue
        assert re.search(rf"^\| {re.escape(heading)} +\| +{re.escape(value)} \|$", printed, re.MULTILINE), (
            key,
            printed,
        )
        text = " ".join(_metrics.METRICS[key].text.split())
        assert key == "verdict" or text in " ".join(printed.split()), (key, printed)


def test_a_log_without_poses_is_no_picture(tmp_path, monkeypatch, capsys):
    path = tmp_path / "x.mcap"
    omnistep.run("flat", overrides={"duration_s": 0.1, "log.tf_hz": 0.0}, mcap=path)
    for command in (["plot"], ["video", "-o", "x.png"], ["report"]):
        monkeypatch.setattr(sys, "argv", ["omnistep", command[0], str(path), *command[1:]])
        assert main() == 2
        assert re.search(r"x\.mcap: no messages on .*/tf", capsys.readouterr().err), command


def test_a_page_of_a_killed_run_says_so(run, tmp_path):
    whole = run[1].read_bytes()
    (tmp_path / "x.mcap.part").write_bytes(whole[: len(whole) // 2])
    assert "ended early" in report.page([omnistep.read_mcap(tmp_path / "x.mcap.part")])


def test_a_side_view_is_a_picture(run, tmp_path):
    plot.write_side_view(run[1], tmp_path / "side-view.png")
    head = (tmp_path / "side-view.png").read_bytes()[:24]
    width, height = struct.unpack(">II", head[16:24])
    assert head[:8] == b"\x89PNG\r\n\x1a\n" and width > 4 * height


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["report", "missing.mcap"], "missing.mcap"),
        (["plot", "LOG", "--every", "0"], "every_s = 0.0, allowed: > 0 [s]"),
        (["video", "LOG", "-o", "x.avi"], "out = x.avi, allowed: a name that ends with .mp4, .gif or .png"),
        (["video", "LOG", "--fps", "100"], "fps = 100.0, allowed: more than 0, up to 50"),
        (["video", "LOG", "-o", "x.png", "--at", "9"], "at_s = 9.0, allowed: 0.001 to 2 [s]"),
    ],
)
def test_what_cannot_be_made_is_one_line(run, tmp_path, monkeypatch, capsys, arguments, expected):
    monkeypatch.chdir(tmp_path)
    given = [str(run[1]) if each == "LOG" else each for each in arguments]
    monkeypatch.setattr(sys, "argv", ["omnistep", *given])
    assert main() == 2
    said = capsys.readouterr().err
    assert said.startswith("error: ") and expected in said and said.count("\n") == 1
    assert list(Path(tmp_path).iterdir()) == []
