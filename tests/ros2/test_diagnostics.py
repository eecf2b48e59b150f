"""What a run says of its vehicle's health on `/diagnostics`."""

from messages import stamp_ns
from peers import until

OK, WARN = 0, 1


def test_a_drive_over_flat_ground_is_well_once_per_second(cyclone, run):
    topic = cyclone.read("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray")
    run("flat", "--namespace", "robot1")
    samples = topic.after(4)[1:]
    assert all(stamp_ns(sample) % 1_000_000_000 == 0 for sample in samples)
    for sample in samples:
        names = [(status.name, status.level) for status in sample.status]
        assert names == [("robot1/omnistep: torque limits", OK), ("robot1/omnistep: traction control", OK)]


def test_a_stall_at_a_step_is_a_warning_with_the_wheels(cyclone, run):
    topic = cyclone.read("/diagnostics", "diagnostic_msgs/msg/DiagnosticArray")
    run("step", "--policy", "independent", "--set", "vehicle.motor.stall_torque_n_m=0.5")

    def warned():
        return [status for sample in topic.samples for status in sample.status if status.level == WARN]

    first = until(warned, "a warning")[0]
    assert first.name == "omnistep: torque limits"
    assert first.message.startswith("at the torque limit: ")
    parts = {one.key: one.value for one in first.values}
    wheel = first.message.removeprefix("at the torque limit: ").split(", ")[0]
    assert float(parts[f"part of the time, {wheel}"]) >= 0.5
