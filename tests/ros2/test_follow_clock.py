"""Several vehicles have one time: that of the run, or of another simulator, that publishes `/clock`."""

import time

from messages import Time, message, stamp_ns
from peers import until


def at(seconds: float) -> object:
    """A message of a clock."""
    nanoseconds = round(seconds * 1e9)
    stamp = Time(sec=nanoseconds // 1_000_000_000, nanosec=nanoseconds % 1_000_000_000)
    return message("rosgraph_msgs/msg/Clock")(clock=stamp)


def test_a_run_waits_for_the_clock_goes_on_with_it_and_begins_anew_with_it(cyclone, run):
    odom = cyclone.read("/odom", "nav_msgs/msg/Odometry")
    one = run("flat", "--follow-clock")
    clock = cyclone.write("/clock", "rosgraph_msgs/msg/Clock", reliable=False)

    def last_s() -> float:
        return stamp_ns(odom.samples[-1]) / 1e9 if odom.samples else -1.0

    time.sleep(0.5)
    assert last_s() < 0.01, "no clock, no time"
    # 50 messages a second of what is simulated; the last one that is due is at 1.00 s, or at 0.98.
    for seconds in (1.0, 2.5):
        clock.write(at(seconds))
        until(lambda seconds=seconds: last_s() > seconds - 0.03, f"{seconds} s")
        time.sleep(0.3)
        assert last_s() <= seconds
    clock.write(at(0.5))
    until(lambda: 0.4 < last_s() <= 0.5, "the time to go back")
    time.sleep(0.3)
    assert last_s() <= 0.5
    until(lambda: "/clock: no message for 5 s: the run waits" in one.said, "the line about the silence")
    assert one.stop() == 0, one.said


def test_two_vehicles_have_the_time_of_one_of_them(cyclone, run):
    clock = cyclone.read("/clock", "rosgraph_msgs/msg/Clock")
    odom = {name: cyclone.read(f"/{name}/odom", "nav_msgs/msg/Odometry") for name in ("one", "two")}
    run("flat", "--namespace", "two", "--frame-prefix", "two/", "--follow-clock")
    run("flat", "--namespace", "one", "--frame-prefix", "one/")
    odom["two"].after(100)
    count = len(clock.samples)
    clock.after(count + 50)
    # At any time both were seen within two messages (20 ms each) and what the machine delays.
    apart = abs(stamp_ns(odom["one"].samples[-1]) - stamp_ns(odom["two"].samples[-1])) / 1e9
    assert apart < 0.5
    stamps = [stamp_ns(sample) for sample in clock.samples]
    assert stamps == sorted(stamps), "one run publishes the clock"


def test_what_follows_a_clock_has_no_pace_of_its_own(run):
    for options, line in [
        (["--real-time-factor", "2"], "cannot be used with"),
        (["--topic-rate", "clock=50"], "--topic-rate = clock=50, allowed: 0 with --follow-clock"),
    ]:
        refused = run("flat", "--follow-clock", *options, ready=False)
        assert refused.ended() == 2
        assert line in refused.said
