"""Odometry of a run: its columns, in its log, in other readers of it, and from above."""

import matplotlib.pyplot as plt
import numpy as np
import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader

import omnistep
from omnistep import report

PLACE = ("odom_x_m", "odom_y_m", "odom_yaw_rad")
VARIANCES = ("odom_var_x_m2", "odom_cov_xy_m2", "odom_var_y_m2", "odom_var_yaw_rad2")


@pytest.fixture(scope="module")
def bend(tmp_path_factory):
    """A square that starts with another heading: its trace, and its log."""
    path = tmp_path_factory.mktemp("odometry") / "square.mcap"
    overrides = {"duration_s": 4.0, "start.heading_rad": 0.4}
    trace = omnistep.run("square", overrides=overrides, mcap=path)
    return trace, path


@pytest.fixture(autouse=True)
def close_figures():
    yield
    plt.close("all")


def rows_of(trace, time_s):
    return np.searchsorted(trace["time_s"], time_s - 1e-9)


def test_a_log_has_the_columns_of_its_run_at_the_rate_of_its_topics(bend):
    trace, path = bend
    log = omnistep.read_mcap(path)
    rows = rows_of(trace, log.odometry["time_s"])
    assert len(rows) == 201  # the first period, and every 20 ms of 4 s
    for name in (*PLACE[:2], *VARIANCES):
        assert np.array_equal(log.odometry[name], trace[name][rows]), name
    for name in ("pose_x_m", "pose_y_m"):
        assert np.array_equal(log.ground_truth[name], trace[name][rows]), name
    # Through a quaternion and back.
    np.testing.assert_allclose(log.odometry[PLACE[2]], trace[PLACE[2]][rows], atol=1e-14)
    np.testing.assert_allclose(log.ground_truth["pose_yaw_rad"], trace["pose_yaw_rad"][rows], atol=1e-14)
    # The frame of odometry is off from the world as odometry is from the truth.
    off = np.hypot(trace["pose_x_m"] - trace["odom_x_m"], trace["pose_y_m"] - trace["odom_y_m"])[rows]
    turned = np.abs(trace["pose_yaw_rad"] - trace["odom_yaw_rad"])[rows]
    reach = np.hypot(trace["odom_x_m"], trace["odom_y_m"])[rows]
    # Both lean by some 1e-5 rad, and a metre that leans is 1e-10 m shorter.
    assert (np.hypot(*log.frames["odom"][:, :2].T) <= off + turned * reach + 1e-10).all()


def test_the_error_of_the_outcome_is_the_distance_in_the_last_row(bend):
    trace, _ = bend
    x, y = (trace[f"pose_{axis}"][-1] - trace[f"odom_{axis}"][-1] for axis in ("x_m", "y_m"))
    metrics = trace.outcome.to_dict()
    assert metrics["odometry_error_m"] == trace.outcome.odometry_error_m
    # The C library may round the last of 53 bits otherwise.
    assert metrics["odometry_error_m"] == pytest.approx(np.hypot(x, y), rel=2**-52, abs=0)
    last = {name: trace[f"pose_{name}"][-1] for name in ("x_m", "y_m", "yaw_rad")}
    assert {name: metrics[f"final_{name}"] for name in last} == last


def test_ros2_readers_of_others_find_odometry_with_its_covariance_and_the_truth(bend):
    trace, path = bend
    seen = {"/odom": [], "/ground_truth/odom": []}
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for schema, channel, message, odom in reader.iter_decoded_messages(topics=list(seen)):
            assert schema.name == "nav_msgs/msg/Odometry"
            seen[channel.topic].append((message.log_time / 1e9, odom))
    rows = rows_of(trace, np.array([time_s for time_s, _ in seen["/odom"]]))
    assert len(seen["/odom"]) == len(seen["/ground_truth/odom"]) == 201
    for row, (_, odom), (_, truth) in zip(rows, *seen.values(), strict=True):
        assert (odom.header.frame_id, odom.child_frame_id) == ("odom", "base_link")
        assert (truth.header.frame_id, truth.child_frame_id) == ("world", "base_link")
        for topic, place in ((odom, "odom"), (truth, "pose")):
            at = topic.pose.pose.position
            assert (at.x, at.y) == (trace[f"{place}_x_m"][row], trace[f"{place}_y_m"][row])
        # Row by row: x with x, x with y, y, about z; and what a plane does not tell is as good as unknown.
        covariance = np.reshape(odom.pose.covariance, (6, 6))
        found = covariance[[0, 0, 1, 5], [0, 1, 1, 5]]
        assert found.tolist() == [trace[name][row] for name in VARIANCES]
        assert (covariance == covariance.T).all()
        assert covariance.diagonal()[2:5].tolist() == [1e6] * 3
        assert not np.any(truth.pose.covariance)


def test_the_covariance_of_the_twist_is_that_of_rolling_and_slip_through_the_least_squares_map(bend):
    trace, path = bend
    by_twist = omnistep.Kinematics(layout=omnistep.Vehicle(trace.vehicle).layout).inverse(np.eye(3)).T
    to_twist = np.linalg.pinv(by_twist)
    with AnyReader([path]) as bag:
        connections = [each for each in bag.connections if each.topic == "/odom"]
        messages = [bag.deserialize(data, each.msgtype) for each, _, data in bag.messages(connections)]
    stamps_s = np.array([message.header.stamp.sec + message.header.stamp.nanosec / 1e9 for message in messages])
    for row, message in zip(rows_of(trace, stamps_s), messages, strict=True):
        velocity = trace.wheels("measured_rad_s")[row]
        residual = velocity - by_twist @ to_twist @ velocity
        # 0.02 rad per root of rad over 20 ms, and the encoders of this scenario have no error.
        variance = 0.02**2 / 0.02 * np.abs(velocity) + residual**2
        expected = np.diag([0.0, 0.0, 1e6, 1e6, 1e6, 0.0])
        expected[np.ix_([0, 1, 5], [0, 1, 5])] = to_twist @ np.diag(variance) @ to_twist.T
        found = message.twist.covariance.reshape(6, 6)
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-15)


def test_rosbags_reads_both_topics(bend):
    trace, path = bend
    with AnyReader([path]) as bag:
        for topic, place in (("/odom", "odom"), ("/ground_truth/odom", "pose")):
            connections = [each for each in bag.connections if each.topic == topic]
            (*_, (connection, _, data)) = bag.messages(connections)
            last = bag.deserialize(data, connection.msgtype)
            assert last.pose.pose.position.x == trace[f"{place}_x_m"][-1]
            assert last.pose.covariance.shape == (36,)


def test_a_run_from_above_is_drawn_from_its_trace_and_from_its_log(bend):
    trace, path = bend
    for run in (trace, omnistep.read_mcap(path)):
        ax = omnistep.plot.path(run)
        command, truth, odometry = ax.lines[:3]
        assert [line.get_label().split(",")[0] for line in (command, truth, odometry)] == [
            "command",
            "truth",
            "odometry",
        ]
        assert np.allclose(truth.get_xydata()[-1], [trace["pose_x_m"][-1], trace["pose_y_m"][-1]], atol=1e-12)
        assert np.allclose(odometry.get_xydata()[-1], [trace["odom_x_m"][-1], trace["odom_y_m"][-1]], atol=1e-12)
        assert ax.get_aspect() == 1.0
        assert len(ax.patches) == 10  # every tenth of the run
        assert "2 standard deviations" in [text.get_text() for text in ax.get_legend().get_texts()]
    # A run without a path has no command.
    flat = omnistep.run("flat", overrides={"duration_s": 0.5})
    assert omnistep.plot.path(flat).lines[0].get_label() == "truth"


@pytest.fixture(scope="module")
def seen_rarely(tmp_path_factory):
    """A recording with odometry at 100 Hz, and a pose at 10 Hz that ends before it; 0.1 m beside odometry."""
    folder = tmp_path_factory.mktemp("rarely")
    rows = ["t,a,b,c,x,y,h,ox,oy,oh"]
    for k in range(300):
        pose = f"{k / 1000},0.1,0" if k % 10 == 0 else ",,"
        rows.append(f"{k / 100},1,1,1,{pose},{k / 1000},0,0")
    (folder / "robot.csv").write_text("\n".join(rows))
    keys = 'schema_version = 1\nvehicle = "omni3"\nperiod_s = 0.01\n[time]\ncolumn = "t"\n'
    keys += (
        '[wheels]\nnames = ["a", "b", "c"]\n[pose]\nnames = ["x", "y", "h"]\n[odometry]\nnames = ["ox", "oy", "oh"]\n'
    )
    (folder / "my.toml").write_text(keys)
    omnistep.import_log(folder / "robot.csv", map=folder / "my.toml", out=folder / "robot.mcap")
    return omnistep.read_mcap(folder / "robot.mcap")


def test_a_truth_at_times_of_its_own_is_drawn_and_none_of_what_is_missing(seen_rarely):
    assert len(seen_rarely.ground_truth["time_s"]) < len(seen_rarely.odometry["time_s"])
    ax = omnistep.plot.path(seen_rarely)
    truth, odometry = ax.lines[:2]
    end_s = seen_rarely.ground_truth["time_s"][-1]
    # Both go along x; at the last time of the truth it is 0.1 m to the left.
    assert truth.get_label() == "truth" and np.allclose(truth.get_ydata(), 0.1)
    assert odometry.get_label() == f"odometry, 0.10 m off at {end_s:.2f} s"
    # Its robot sent no variances: no ellipses, but what belongs to what. Nine tenths of the run have a truth.
    assert len(ax.patches) == 0
    joins = [line for line in ax.lines[2:] if len(line.get_xdata()) == 2]
    assert len(joins) == 9
    for join in joins:
        assert np.allclose(np.diff(join.get_xydata(), axis=0), [[0.0, -0.1]], atol=1e-9)
    above = report._above(seen_rarely)
    assert above["ellipses"] is None and len(above["truth_time"]) * 2 == pytest.approx(len(above["truth"]), abs=4)


def test_the_trace_of_a_recording_from_above_is_one_line(seen_rarely):
    with pytest.raises(omnistep.ConfigError, match="the trace of a log, which lacks odom_var_x_m2, allowed: the Log"):
        omnistep.plot.path(seen_rarely.trace)


def test_ellipses_have_the_axes_of_the_covariance(bend):
    trace, _ = bend
    ax = omnistep.plot.path(trace, every_s=2.0, sigmas=3.0)
    corners = ax.patches[0].get_xy()
    row = rows_of(trace, 2.0)
    away = corners - [trace["odom_x_m"][row], trace["odom_y_m"][row]]
    xx, xy, yy = (trace[name][row] for name in VARIANCES[:3])
    # Every corner is three standard deviations away, measured by the covariance itself.
    distances = np.einsum("ci,ij,cj->c", away, np.linalg.inv([[xx, xy], [xy, yy]]), away)
    np.testing.assert_allclose(np.sqrt(distances), 3.0, rtol=1e-6)


def test_what_cannot_be_drawn_from_above_is_refused_in_one_line(bend):
    trace, path = bend
    log = omnistep.read_mcap(path)
    for call, said in (
        (lambda: omnistep.plot.path(log.trace), "square, traction: the trace of a log, which lacks odom_x_m"),
        (lambda: omnistep.plot.path(trace, every_s=0.0), "every_s = 0.0, allowed: > 0 [s]"),
        (lambda: omnistep.plot.path(trace, sigmas=-1.0), "sigmas = -1.0, allowed: > 0"),
        (lambda: omnistep.plot.path(trace, sigmas=float("nan")), "sigmas = nan, allowed: > 0"),
    ):
        with pytest.raises(omnistep.ConfigError) as error:
            call()
        assert said in str(error.value) and "\n" not in str(error.value)
    with pytest.raises(TypeError, match="trace: the string 'x'"):
        omnistep.plot.path("x")


def test_a_report_shows_the_run_from_above(bend):
    _, path = bend
    log = omnistep.read_mcap(path)
    run = report._run(log)
    assert {"time", "odometry", "truth", "command", "ellipses"} <= set(run["above"])
    text = report.page([log])
    assert 'id="above"' in text and "odometry error [m]" in text
    assert f"{log.outcome.odometry_error_m:.4f}" in text


def test_a_log_without_odometry_is_drawn_by_nothing_from_above(tmp_path):
    path = tmp_path / "x.mcap"
    omnistep.run("flat", overrides={"duration_s": 0.2, "log.odom_hz": 0}, mcap=path)
    log = omnistep.read_mcap(path)
    with pytest.raises(omnistep.ConfigError, match="no messages on /odom"):
        omnistep.plot.path(log)
    assert report._run(log)["above"] is None
    assert '"above":null' in report.page([log])


def test_odometry_in_three_dimensions_is_in_the_log_as_other_readers_see_it_and_in_the_report(tmp_path):
    path = tmp_path / "step.mcap"
    overrides = {"odometry.kind": "ground", "physics.engine": "articulated", "physics.wheel_model": "rollers"}
    overrides |= {"vehicle": "mecanum4", "terrain.height_m": 0.02, "duration_s": 5.0, "policy": "traction"}
    policy = overrides.pop("policy")
    trace = omnistep.run("step", policy=policy, overrides=overrides, mcap=path)
    assert abs(trace["odom_z_m"][-1] - trace["pose_z_m"][-1]) < 0.003 < trace["pose_z_m"][-1]
    with AnyReader([path]) as reader:
        read = [
            (connection.topic, reader.deserialize(raw, connection.msgtype))
            for connection, _, raw in reader.messages()
            if connection.topic in ("/odom", "/markers")
        ]
    last = [message for topic, message in read if topic == "/odom"][-1]
    row = rows_of(trace, last.header.stamp.sec + 1e-9 * last.header.stamp.nanosec)
    assert last.pose.pose.position.z == trace["odom_z_m"][row]
    assert last.pose.covariance[14] == pytest.approx(trace["odom_std_z_m"][row] ** 2)
    edges = [marker for topic, message in read if topic == "/markers" for marker in message.markers]
    edges = [marker for marker in edges if marker.ns == "edges"]
    heights = [marker.points[1].z - marker.points[0].z for marker in edges]
    # As many as wheels, each with its own number, in the frame whose position they have.
    assert len({marker.id for marker in edges}) == len(edges) == 4
    assert {marker.header.frame_id for marker in edges} == {"odom"}
    np.testing.assert_allclose(heights, 0.02, atol=0.003)
    log = omnistep.read_mcap(path)
    felt = report._run(log)["edges"]  # as the player of the report draws them
    np.testing.assert_allclose([to - before for *_, before, to in felt], heights, atol=1e-6)
