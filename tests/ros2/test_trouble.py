"""Peers that die, freeze or never look, and a network that loses: the run goes on as if they were not there."""

import os
import shutil
import signal
import subprocess
import time

import numpy as np
import pytest
from conftest import lacking
from messages import message, stamp_ns
from peers import until

TOPICS = {
    "/clock": "rosgraph_msgs/msg/Clock",
    "/odom": "nav_msgs/msg/Odometry",
    "/tf": "tf2_msgs/msg/TFMessage",
    "/joint_states": "sensor_msgs/msg/JointState",
    "/vehicle_state": "omnistep_msgs/msg/VehicleState",
    "/imu": "sensor_msgs/msg/Imu",
}
# What an allocator may keep more of while four hundred messages a second go through it: seen were 0.1 MB. A reader
# whose messages were all kept would take 0.2 MB a second.
GROWTH_KB = 1024
# How long a silent peer counts as alive; the default of Fast DDS is 20 s.
LEASE_S = 5
# What the DDS library keeps of each participant that ever was: seen were 4.
VISITOR_KB = 8


def freezes(peer):
    peer.process.send_signal(signal.SIGSTOP)


def dies(peer):
    peer.kill()


@pytest.mark.parametrize("harm", [dies, freezes, None], ids=["dies", "freezes", "never takes a sample"])
def test_a_peer_in_trouble_neither_slows_the_run_nor_makes_it_grow(cyclone, fast_dds, run, harm):
    clock = cyclone.read("/clock", "rosgraph_msgs/msg/Clock")
    one = run("flat")
    peer = fast_dds(lease_s=LEASE_S)
    for topic, kind in TOPICS.items():
        (peer.read if harm else peer.hold)(topic, kind, depth=10)
    until(lambda: all(peer.matched.get(f"rt{topic}") for topic in TOPICS), "the peer reads everything")
    clock.first()
    until(lambda: stamp_ns(clock.samples[-1]) > 8_000_000_000, "eight seconds: by then an allocator has what it needs")
    if harm:
        harm(peer)
    start, before, hungry = len(clock.samples), one.rss_kb(), one.look_for_hunger()
    time.sleep(LEASE_S + 3.0)
    kept = one.rss_kb()
    time.sleep(6.0)
    after, starved = one.rss_kb(), one.look_for_hunger() - hungry
    if harm is freezes:
        peer.kill()
    simulated = np.array([stamp_ns(sample) for sample in clock.samples[start:]]) / 1e9
    wall = np.array(clock.times_s[start:])
    span = wall[-1] - wall[0]
    assert span > 12.0, "the other reader still gets its messages"
    assert len(simulated) >= 0.95 * (simulated[-1] - simulated[0]) * 100
    # Seven times as fast as it has to be, the run is late for want of a processor, and for nothing else.
    assert simulated[-1] - simulated[0] > 0.9 * span - starved
    # While it counts as alive, what it has not confirmed is kept: 0.2 MB a second. After that nothing is.
    assert kept - before < GROWTH_KB + 250 * LEASE_S
    assert after - kept < GROWTH_KB / 2
    assert one.stop() == 0


def test_a_reader_that_wants_all_and_takes_none_does_not_stop_a_topic_for_the_others(cyclone, fast_dds, run):
    """The library keeps 8192 messages for it, which at 1000 Hz is eight seconds."""
    one = run("flat", "--topic-rate", "odom=1000")
    odometry = cyclone.read("/odom", "nav_msgs/msg/Odometry")
    odometry.first()
    peer = fast_dds()
    peer.hold("/odom", "nav_msgs/msg/Odometry", depth=0)
    until(lambda: peer.matched.get("rt/odom"), "the peer reads odometry")
    begun = stamp_ns(odometry.samples[-1])
    until(lambda: stamp_ns(odometry.samples[-1]) > begun + 20_000_000_000, "twenty seconds more")
    assert one.stop() == 0


@pytest.fixture
def loss():
    """Drops one datagram of ten, of everything that the tests and the program send each other."""
    qdisc = ["tc", "qdisc", "add", "dev", "lo", "root", "netem", "loss", "10%"]
    if shutil.which("tc") and subprocess.run(qdisc, capture_output=True).returncode == 0:
        yield "netem"
        subprocess.run(["tc", "qdisc", "del", "dev", "lo", "root"], check=True)
        return
    rules = (
        "add table inet loss; add chain inet loss input { type filter hook input priority 0; }; "
        "add rule inet loss input meta l4proto udp numgen random mod 10 == 0 drop"
    )
    if not shutil.which("nft"):
        lacking("a kernel with netem, or nft (apt install nftables)")
    if subprocess.run(["nft", rules], capture_output=True).returncode != 0:
        pytest.skip("this system drops no datagrams: its kernel has neither netem nor nftables")
    yield "nftables"
    subprocess.run(["nft", "delete", "table", "inet", "loss"], check=True)


def test_reliable_topics_arrive_although_one_datagram_of_ten_is_lost(cyclone, fast_dds, run, loss):
    fast = fast_dds()
    got = {
        "cyclone": cyclone.read("/odom", "nav_msgs/msg/Odometry").samples,
        "fast": fast.read("/odom", "nav_msgs/msg/Odometry"),
    }
    careless = cyclone.read("/imu", "sensor_msgs/msg/Imu", reliable=False)
    run("flat")
    description = cyclone.read("/robot_description", "std_msgs/msg/String", transient=True, depth=1)
    text = fast.read("/robot_description", "std_msgs/msg/String", transient=True, depth=1)
    until(lambda: all(len(samples) > 300 for samples in got.values()), "300 messages")
    until(lambda: len(careless.samples) > 600, "600 messages of the sensor")
    until(lambda: text and description.samples, "the description, which is many datagrams")
    assert description.samples[0].data == message("std_msgs/msg/String").deserialize(text[0]).data
    from messages import definitions

    stamps = {
        "cyclone": [stamp_ns(sample) for sample in got["cyclone"]],
        "fast": [stamp_ns(definitions().deserialize_cdr(sample, "nav_msgs/msg/Odometry")) for sample in got["fast"]],
    }
    for name, at in stamps.items():
        missing = 1 - len(at) / ((at[-1] - at[0]) / 20_000_000 + 1)
        # A message is lost for good where it and what asks for it again are lost until ten newer ones are there.
        assert missing < 0.02, name
    at = [stamp_ns(sample) for sample in careless.samples]
    missing = 1 - len(at) / ((at[-1] - at[0]) / 10_000_000 + 1)
    assert missing > 0.03, "else nothing was lost, and this test shows nothing"


def test_a_command_arrives_although_one_datagram_of_ten_is_lost(fast_dds, cyclone, run, loss):
    from messages import twist

    truth = cyclone.read("/ground_truth/odom", "nav_msgs/msg/Odometry")
    run("flat", "--set", "command.vx_m_s=0")
    peer = fast_dds()
    peer.write("/cmd_vel", "geometry_msgs/msg/Twist")

    def moves() -> bool:
        peer.send("/cmd_vel", bytes(twist(vx=0.2).serialize()))
        time.sleep(0.05)
        return bool(truth.samples) and abs(truth.samples[-1].twist.twist.linear.x - 0.2) < 0.01

    until(moves, "0.2 m/s")


def test_memory_stays_while_readers_come_and_go(cyclone, fast_dds, run, capsys):
    """For ROS2_SOAK_S seconds, 20 unless set; `make test-full` takes ten minutes."""
    seconds = float(os.environ.get("ROS2_SOAK_S", "20"))
    clock = cyclone.read("/clock", "rosgraph_msgs/msg/Clock")
    one = run("flat")
    clock.first()
    used, start, visits = [], time.monotonic(), 0
    while time.monotonic() - start < seconds or visits < 12:
        visitor = fast_dds()
        came = visitor.read("/odom", "nav_msgs/msg/Odometry")
        visitor.read("/robot_description", "std_msgs/msg/String", transient=True, depth=1)
        until(lambda came=came: len(came) > 10, "ten messages for a visitor")
        visits += 1
        # One of three does not say goodbye, and counts as alive for some twenty seconds.
        if visits % 3 == 0:
            visitor.kill()
        else:
            visitor.close()
        used.append(one.rss_kb())
        time.sleep(0.5)
    warm, late = np.median(used[visits // 4 : visits // 2]), np.median(used[3 * visits // 4 :])
    with capsys.disabled():
        print(f" {visits} readers in {seconds:.0f} s: {used[0]} kB at first, {warm:.0f} kB, at last {late:.0f} kB")
    # From the middle of the one to the middle of the other it is half of the time, and half of the visitors.
    assert late - warm < GROWTH_KB + VISITOR_KB * visits / 2
    simulated = (stamp_ns(clock.samples[-1]) - stamp_ns(clock.samples[0])) / 1e9
    assert simulated > 0.9 * (clock.times_s[-1] - clock.times_s[0]) - one.look_for_hunger()
    assert one.stop() == 0
