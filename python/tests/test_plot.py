"""Figures: the data drawn is the data given, on the axes given."""

import subprocess
import sys

import matplotlib
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


@pytest.mark.parametrize(
    ("vehicle", "places"),
    [
        ("mecanum4", {"front": "front_right", "rear": "rear_right"}),
        ("rocker_bogie6", {"front": "front_right", "middle": "middle_right", "rear": "rear_right"}),
        ("omni3", {"right": "3", "left": "2"}),  # wheel 1 stands still, the others are side by side
    ],
)
def test_no_wheel_is_drawn_twice_however_many_rows_there_are(vehicle, places, tmp_path):
    overrides = {"duration_s": 0.4, "vehicle": vehicle}
    trace = omnistep.run("flat", overrides=overrides, mcap=tmp_path / "x.mcap")
    for run in (trace, omnistep.read_mcap(tmp_path / "x.mcap")):
        axes = omnistep.plot.climb(run)
        labels = [f"{place} (wheel {wheel})" for place, wheel in places.items()]
        assert [each.get_label() for each in axes[0].lines] == labels
        drawn = [tuple(each.get_ydata()) for each in axes[2].lines[:-1]]
        assert len(set(drawn)) == len(drawn) or vehicle != "mecanum4"


def test_the_sheet_of_the_paper_is_saved_by_itself_its_figure_or_any_of_its_axes(climb, tmp_path):
    sheet = omnistep.plot.paper(proposed=climb, general=climb)
    axes = [sheet[number][0] for number in ("8", "9", "10", "11")]
    for number, save in enumerate([sheet.savefig, sheet.figure.savefig, *(ax.figure.savefig for ax in axes)]):
        save(tmp_path / f"{number}.png", dpi=40)
    pictures = {(tmp_path / f"{number}.png").read_bytes()[:64] for number in range(6)}
    assert len(pictures) == 1 and len(list(tmp_path.iterdir())) == 6  # 10 x 15 inches each
    height, width = plt.imread(tmp_path / "0.png").shape[:2]
    assert (width, height) == (400, 600)


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
    assert omnistep.plot.side_view(climb, ax=ax) is ax
    with pytest.raises(ValueError, match="allowed: 3"):
        omnistep.plot.climb(climb, axes=given[:2])


def test_a_side_view_marks_the_middle_joint_every_three_tenths(climb):
    ax = omnistep.plot.side_view(climb)
    points = line(ax, "joint on wheel 4, every 0.3 s")
    assert len(points.get_xdata()) == 21  # 0 to 6 s
    np.testing.assert_array_equal(points.get_xdata()[1:], climb["wheel_4_x_m"][299::300])
    assert points.get_ydata()[-1] == pytest.approx(0.05 + 0.066, abs=1e-3)  # on the upper plane
    # The vehicle is drawn at every third point, and says when.
    assert [text.get_text() for text in ax.texts] == [f"{0.9 * k:.1f} s" for k in range(7)]
    with pytest.raises(ValueError, match="allowed: > 0"):
        omnistep.plot.side_view(climb, every_s=0.0)


@pytest.mark.parametrize("scenario", ["figure_eight", "square"])
def test_a_run_that_goes_around_has_no_side_view_and_the_message_names_the_view_from_above(scenario, tmp_path):
    trace = omnistep.run(scenario, mcap=tmp_path / "x.mcap")
    for run in (trace, omnistep.read_mcap(tmp_path / "x.mcap")):
        with pytest.raises(omnistep.ConfigError, match=r"run: \d\.\d m to and fro along x, .*omnistep\.plot\.path"):
            omnistep.plot.side_view(run)
    assert plt.get_fignums() == []


def test_a_drive_aside_and_one_that_backs_off_at_a_step_have_a_side_view():
    aside = {"command.vx_m_s": 0.0, "command.vy_m_s": 0.3, "duration_s": 2.0}
    assert omnistep.plot.side_view(omnistep.run("flat", overrides=aside))
    retries = omnistep.run("hard_step", policy="traction")
    assert (retries.outcome.retries or 0) > 0
    ax = omnistep.plot.side_view(retries)
    # It comes back to where it was: no two times are in one place.
    ax.figure.canvas.draw()
    boxes = [text.get_window_extent() for text in ax.texts]
    assert len(boxes) > 5 and not any(one.overlaps(other) for k, one in enumerate(boxes) for other in boxes[:k])


def test_wheels_draws_each_wheel_of_each_run_and_the_loads(wheel_runs):
    axes = omnistep.plot.motor_bench(wheel_runs)
    for k in range(3):
        for run in wheel_runs:
            np.testing.assert_array_equal(line(axes[k], run.policy).get_ydata(), run.speed_rpm[:, k])
    np.testing.assert_array_equal(line(axes[3], "load C").get_ydata(), wheel_runs[0].load_n_m_s_rad[:, 2])
    assert omnistep.plot.motor_bench(wheel_runs[0]).shape == (4,)


def test_a_second_run_of_a_policy_has_its_colour_and_other_dashes(wheel_runs):
    again = omnistep.run_motor_bench("scale_torques", overrides={"friction_n_m_s_rad": 2e-4})
    axes = omnistep.plot.motor_bench([wheel_runs[1], again])
    first, second = line(axes[0], "scale_torques"), line(axes[0], "scale_torques (2)")
    np.testing.assert_array_equal(second.get_ydata(), again.speed_rpm[:, 0])
    assert first.get_color() == second.get_color() and first.get_linestyle() != second.get_linestyle()


def test_climbs_are_the_climbs_side_by_side_on_one_scale(climb, general_climb):
    axes = omnistep.plot.climbs([climb, general_climb])
    assert axes.shape == (3, 2)
    for column, trace in zip(axes.T, (climb, general_climb), strict=True):
        assert column[0].get_title() == f"step, {trace.policy}"
        for ax, signal in zip(column, ("disturbed_ratio", "slip_ratio", "measured_rad_s"), strict=True):
            np.testing.assert_array_equal(line(ax, "front (wheel 5)").get_ydata(), trace.wheels(signal)[:, 4])
    for left, right in axes:
        assert left.get_ylim() == right.get_ylim()
        drawn = np.concatenate([each.get_ydata() for ax in (left, right) for each in ax.lines])
        assert left.get_ylim()[0] < drawn.min() and drawn.max() < left.get_ylim()[1]
    by_name = omnistep.plot.climbs({"any": climb})  # as omnistep.compare returns them
    assert by_name.shape == (3, 1)


def test_side_views_show_the_same_ground_once_below_each_run(climb):
    short = omnistep.run("step", policy="scale_references", overrides={"duration_s": 1.0})
    axes = omnistep.plot.side_views([climb, short], every_s=0.5)
    assert axes[0].get_xlim() == axes[1].get_xlim() == pytest.approx(span(climb))
    for ax, trace, letter in zip(axes, (climb, short), "ab", strict=True):
        assert ax.get_title() == f"({letter}) step, scale_references"
        points = line(ax, "joint on wheel 4, every 0.5 s")
        np.testing.assert_array_equal(points.get_xdata()[1:], trace["wheel_4_x_m"][499::500])
        assert len(ax.collections) == 1  # a second ground would hide the vehicle


def span(trace):
    x = trace.wheels("x_m")
    return x.min() - 0.15, x.max() + 0.15


def test_paper_has_every_panel_of_figures_8_to_11(climb, general_climb, wheel_runs):
    axes = omnistep.plot.paper(proposed=climb, general=general_climb, wheel_runs=wheel_runs)
    assert {name: each.shape for name, each in axes.items()} == {"8": (4,), "9": (2,), "10": (3,), "11": (3,)}
    assert len({ax.get_figure(root=True) for each in axes.values() for ax in each}) == 1
    np.testing.assert_array_equal(line(axes["8"][2], "scale_torques").get_ydata(), wheel_runs[1].speed_rpm[:, 2])
    for name, trace in {"10": climb, "11": general_climb}.items():
        drawn = line(axes[name][1], "middle (wheel 4)").get_ydata()
        np.testing.assert_array_equal(drawn, trace["wheel_4_slip_ratio"])
    for ax, trace in zip(axes["9"], (climb, general_climb), strict=True):
        drawn = line(ax, "joint on wheel 4, every 0.3 s").get_xdata()
        np.testing.assert_array_equal(drawn[1:], trace["wheel_4_x_m"][299::300])
    given = plt.figure()
    axes = omnistep.plot.paper(proposed=climb, general=general_climb, wheel_runs=wheel_runs, figure=given)
    assert axes["9"][0].get_figure(root=True) is given


def test_a_policy_has_one_colour_and_nothing_else_has_it(climb, general_climb, wheel_runs):
    colours = {policy: omnistep.plot.policy_colour(policy) for policy in omnistep.list_policies()}
    assert len(set(colours.values())) == len(colours) == 6
    axes = omnistep.plot.paper(proposed=climb, general=general_climb, wheel_runs=wheel_runs)
    for run in wheel_runs:
        assert line(axes["8"][1], run.policy).get_color() == colours[run.policy]
    for ax, trace in zip(axes["9"], (climb, general_climb), strict=True):
        points = line(ax, "joint on wheel 4, every 0.3 s")
        assert points.get_markeredgecolor() == colours[trace.policy]
    others = {each.get_color() for ax in (axes["8"][3], *axes["10"], *axes["11"]) for each in ax.lines}
    assert len(others) == 4 and others.isdisjoint(colours.values())


def test_no_legend_covers_data_and_no_setting_is_changed(climb, general_climb, wheel_runs, monkeypatch):
    monkeypatch.setattr(plt, "show", lambda: pytest.fail("a window was opened"))
    settings = dict(matplotlib.rcParams)
    figures = [
        omnistep.plot.paper(proposed=climb, general=general_climb, wheel_runs=wheel_runs)["8"],
        omnistep.plot.motor_bench(wheel_runs),
        omnistep.plot.climb(climb),
        omnistep.plot.climbs([climb, general_climb]).ravel(),
        omnistep.plot.side_views([climb, general_climb]),
        np.array([omnistep.plot.side_view(climb)]),
    ]
    assert dict(matplotlib.rcParams) == settings
    legends = 0
    for axes in figures:
        figure = axes[0].get_figure(root=True)
        figure.canvas.draw()
        for ax in figure.axes:
            if (legend := ax.get_legend()) is None:
                continue
            legends += 1
            box = legend.get_window_extent()
            for drawn in ax.lines:  # rows are denser than a legend is wide: looking at their points is enough
                points = ax.transData.transform(drawn.get_xydata())
                assert not box.count_contains(points), f"{ax.get_title()}: {drawn.get_label()}"
            assert not any(box.overlaps(patch.get_window_extent()) for patch in ax.patches)
    assert legends == (2 + 2 + 2) + 2 + 1 + 2 + 2 + 1


def test_wrong_requests_are_one_line(climb, wheel_runs, tmp_path):
    other = omnistep.run_motor_bench("scale_torques", overrides={"load.0.damper_n_m_s_rad": 0.002})
    path = tmp_path / "bare.mcap"
    bare = {"duration_s": 0.1, "log.vehicle_state_hz": 0.0, "log.tf_hz": 0.0}
    omnistep.run("flat", overrides=bare, mcap=path)
    log = omnistep.read_mcap(path)
    cases = {
        "other loads than traces": lambda: omnistep.plot.motor_bench([wheel_runs[0], other]),
        "at least one MotorBenchTrace": lambda: omnistep.plot.motor_bench([]),
        "at least one Trace": lambda: omnistep.plot.climbs({}),
        "4 axes, allowed: 3 x 2": lambda: omnistep.plot.climbs([climb, climb], axes=plt.subplots(2, 2)[1]),
        "wheels = \\[\\]": lambda: omnistep.plot.climb(climb, wheels=[]),
        "no messages on /tf": lambda: omnistep.plot.side_view(log),
        "an empty run": lambda: omnistep.plot.climb(log.trace),
        "every_s = nan": lambda: omnistep.plot.side_view(climb, every_s=float("nan")),
    }
    for message, draw in cases.items():
        before = plt.get_fignums()
        with pytest.raises(omnistep.ConfigError, match=message) as caught:
            draw()
        assert "\n" not in str(caught.value)
        assert len(plt.get_fignums()) <= len(before) + ("axes" in message)  # no empty figure is left


def test_an_argument_of_another_type_is_one_line_with_its_name(climb, wheel_runs):
    plot, path = omnistep.plot, "a.mcap"
    row = {"torque": 1.0, "height": 0.1, "climbed": True}
    over = {"x": "torque", "y": "height", "panel": None}
    cases = {
        "trace: the string 'a.mcap', allowed: Trace or Log (omnistep.read_mcap reads one)": lambda: plot.climb(path),
        "trace: None, allowed: Trace or Log": lambda: plot.climb(None),
        "wheels: the string '5', allowed: a list of names": lambda: plot.climb(climb, wheels="5"),
        "axes[0]: a int, allowed: matplotlib's Axes": lambda: plot.climb(climb, axes=[1, 2, 3]),
        "run: None, allowed: Trace or Log": lambda: plot.side_view(None),
        "run: a dict, allowed: Trace or Log": lambda: plot.side_view({"a": climb}),
        "run: the string 'a.mcap', allowed: Trace or Log (omnistep.read_mcap reads one)": lambda: plot.side_view(path),
        "ax: a int, allowed: matplotlib's Axes": lambda: plot.side_view(climb, ax=3),
        "every_s: the string '1', allowed: a number": lambda: plot.side_view(climb, every_s="1"),
        "runs[1]: a int, allowed: Trace or Log": lambda: plot.side_views([climb, 3]),
        "traces: None, allowed: Trace or Log, one or a list or dictionary of them": lambda: plot.climbs(None),
        "traces['a']: a int, allowed: Trace or Log": lambda: plot.climbs({"a": 3}),
        "traces[0]: a MotorBenchTrace, allowed: Trace or Log": lambda: plot.climbs([wheel_runs[0]]),
        "traces[0]: a Trace, allowed: MotorBenchTrace": lambda: plot.motor_bench([climb]),
        "traces: a Trace, allowed: MotorBenchTrace, one or a list or dictionary of them": lambda: plot.motor_bench(
            climb
        ),
        "proposed: a int, allowed: Trace or Log": lambda: plot.paper(proposed=3),
        "wheel_runs[0]: a int, allowed: MotorBenchTrace": lambda: plot.paper(wheel_runs=[3]),
        "figure: a int, allowed: matplotlib's Figure or SubFigure": lambda: plot.paper(figure=3),
        "axes[0]: the string 'left', allowed: matplotlib's Axes": lambda: plot.climb_map([row], **over, axes=["left"]),
    }
    for message, draw in cases.items():
        with pytest.raises(TypeError) as caught:
            draw()
        assert str(caught.value) == message
        assert plt.get_fignums() == [], message  # no empty figure is left


def test_a_log_is_drawn_as_its_run_is_and_its_trace_alone_is_refused(climb, tmp_path):
    again = omnistep.run("step", policy="scale_references", mcap=tmp_path / "climb.mcap")
    assert (again.to_numpy() == climb.to_numpy()).all()
    log = omnistep.read_mcap(tmp_path / "climb.mcap")
    of_log = [*omnistep.plot.climb(log), *omnistep.plot.climbs([log, climb])[:, 0]]
    of_log += [*omnistep.plot.paper(proposed=log, general=climb)["10"], *omnistep.plot.climbs(log)[:, 0]]
    drawn = list(omnistep.plot.climb(climb))
    for ax, expected in zip(of_log, 4 * drawn, strict=True):
        assert [each.get_label() for each in ax.lines] == [each.get_label() for each in expected.lines]
        for one, other in zip(ax.lines, expected.lines, strict=True):
            np.testing.assert_array_equal(one.get_xydata(), other.get_xydata())
    # The columns alone do not say where wheels are; those that are named need no place.
    (line_of_5,) = (each for each in omnistep.plot.climb(log.trace, wheels=["5"])[1].lines)
    np.testing.assert_array_equal(line_of_5.get_ydata(), climb["wheel_5_slip_ratio"])
    plt.close("all")
    for draw in (
        omnistep.plot.climb,
        omnistep.plot.climbs,
        omnistep.plot.side_view,
        lambda trace: omnistep.plot.side_views([climb, trace]),
        lambda trace: omnistep.plot.paper(general=trace),
    ):
        with pytest.raises(omnistep.ConfigError) as caught:
            draw(log.trace)
        message = (
            "step, scale_references: the trace of a log, which lacks the wheels' places x_m, allowed: the Log itself"
        )
        assert str(caught.value) == message
        assert plt.get_fignums() == []


def test_front_and_rear_are_the_vehicle_s_however_it_stands(tmp_path):
    turned = {"duration_s": 0.2, "start.heading_rad": np.pi}
    trace = omnistep.run("flat", overrides=turned, mcap=tmp_path / "turned.mcap")
    for run in (trace, omnistep.read_mcap(tmp_path / "turned.mcap")):
        labels = [each.get_label() for each in omnistep.plot.climb(run)[0].lines]
        assert labels == ["front (wheel 5)", "middle (wheel 4)", "rear (wheel 1)"]


def test_matplotlib_is_loaded_by_drawing_only_and_its_absence_is_one_line():
    code = "import sys, omnistep; assert 'matplotlib' not in sys.modules; sys.modules['matplotlib'] = None\n"
    code += "try: omnistep.plot.motor_bench(omnistep.run_motor_bench())\nexcept ImportError as error: print(error)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == 'omnistep.plot needs matplotlib: pip install "omnistep[plot]"\n'
