"""Pause and another start of a run, asked for as the middlewares of Cyclone DDS and of Fast DDS ask."""

import time
import types
from dataclasses import dataclass

import pytest
from cyclonedds.idl import IdlStruct
from cyclonedds.idl import types as idl
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from messages import first_of_another_run, stamp_ns
from peers import Cyclone, qos, until

# Cyclone's middleware has the client and the request's number in the message; that of Fast DDS outside.
HEADER = {"client": idl.uint64, "number": idl.int64}
FIELDS = {
    "SetBool_Request_": {"data": bool},
    "SetBool_Response_": {"success": bool, "message": str},
    # A structure without fields has one byte.
    "Empty_Request_": {"structure_needs_at_least_one_member": idl.uint8},
    "Empty_Response_": {"structure_needs_at_least_one_member": idl.uint8},
}


def message(name: str, header: dict) -> type:
    """The class of a request or a response."""
    fields = header | FIELDS[name]
    body = types.new_class(
        name,
        (IdlStruct,),
        {"typename": f"std_srvs.srv.dds_.{name}"},
        lambda namespace: namespace.update(__annotations__=fields),
    )
    return dataclass(body)


class Client:
    """A client of a service, as `/omnistep/pause` of `SetBool`."""

    def __init__(self, cyclone: Cyclone, service: str, kind: str, header: dict):
        self.header, self.number = header, 0
        self.request = message(f"{kind}_Request_", header)
        response = message(f"{kind}_Response_", header)
        asked = Topic(cyclone.participant, f"rq{service}Request", self.request)
        answered = Topic(cyclone.participant, f"rr{service}Reply", response)
        self.writer = DataWriter(cyclone.participant, asked, qos(depth=10))
        self.reader = DataReader(cyclone.participant, answered, qos(depth=10))

    def is_there(self) -> bool:
        """Whether there is a server."""
        return bool(self.writer.get_matched_subscriptions() and self.reader.get_matched_publications())

    def call(self, value):
        """The response."""
        until(self.is_there, "the service")
        self.number += 1
        header = {"client": 0x0123456789ABCDEF, "number": self.number} if self.header else {}
        self.writer.write(self.request(*header.values(), value))
        answers = []
        until(lambda: answers.extend(self.reader.take(10)) or answers, "the answer")
        (answer,) = answers
        assert {name: getattr(answer, name) for name in header} == header
        return answer


@pytest.mark.parametrize("header", [HEADER, {}], ids=["cyclone", "fast"])
def test_a_pause_stops_the_time_and_it_goes_on_from_there(cyclone, run, header):
    clock = cyclone.read("/clock", "rosgraph_msgs/msg/Clock")
    run("flat")
    pause = Client(cyclone, "/omnistep/pause", "SetBool", header)
    clock.after(20)
    answer = pause.call(True)
    assert (answer.success, answer.message) == (True, "paused")
    time.sleep(0.3)  # what was on its way
    held = len(clock.samples)
    time.sleep(1.0)
    assert len(clock.samples) == held
    assert pause.call(False).message == "running"
    stamps = [stamp_ns(sample) for sample in clock.after(held + 20)]
    # Ten messages are kept for a reader that is late; a jump by the pause would be 1.3 s.
    assert stamps[held] - stamps[held - 1] < 200_000_000
    assert stamps == sorted(stamps)


@pytest.mark.parametrize("header", [HEADER, {}], ids=["cyclone", "fast"])
def test_a_reset_begins_the_run_anew(cyclone, run, header):
    clock = cyclone.read("/clock", "rosgraph_msgs/msg/Clock")
    truth = cyclone.read("/ground_truth/odom", "nav_msgs/msg/Odometry")
    odom = cyclone.read("/odom", "nav_msgs/msg/Odometry")
    joints = cyclone.read("/joint_states", "sensor_msgs/msg/JointState")
    one = run("flat")
    reset = Client(cyclone, "/omnistep/reset", "Empty", header)
    until(lambda: truth.samples and truth.samples[-1].pose.pose.position.x > 0.2, "a drive of 0.2 m")
    reset.call(0)
    for topic in (clock, truth, odom, joints):
        (begun,) = until(lambda topic=topic: first_of_another_run(topic.samples), f"another run on {topic.topic}")
        assert stamp_ns(begun) < 200_000_000  # messages may be lost on a machine that stands still
        if topic in (truth, odom):
            assert begun.pose.pose.position.x < 0.1
    assert abs(odom.samples[-1].pose.pose.position.x - truth.samples[-1].pose.pose.position.x) < 0.05
    # It drives again, by its scenario, because no command came.
    count = len(truth.samples)
    until(lambda: truth.samples[-1].pose.pose.position.x > 0.1 and len(truth.samples) > count, "the same drive")
    assert one.stop() == 0, one.said


def test_a_run_with_a_log_has_a_pause_and_no_reset(cyclone, run, tmp_path):
    run("flat", "--log", str(tmp_path / "run.mcap"))
    pause = Client(cyclone, "/omnistep/pause", "SetBool", HEADER)
    reset = Client(cyclone, "/omnistep/reset", "Empty", HEADER)
    until(pause.is_there, "the pause")
    time.sleep(1.0)
    assert not reset.is_there()


def test_services_are_in_the_namespace(cyclone, run):
    run("flat", "--namespace", "robot1")
    pause = Client(cyclone, "/robot1/omnistep/pause", "SetBool", HEADER)
    assert pause.call(True).success
