"""A short form of the study's safety table: draws with wrong sensors, and those that nothing misleads."""

import itertools
import sys
from pathlib import Path

import pytest

SCRIPTS = Path(__file__).resolve().parents[2] / "scripts"
sys.path.insert(0, str(SCRIPTS))
try:
    import study.safety
finally:
    sys.path.remove(str(SCRIPTS))

#: What it says of sensors that it does without.
pytestmark = pytest.mark.filterwarnings("ignore:traction:UserWarning")

#: Beyond those of the study.
FIRST = 50_000


def draws(*causes):
    """Draws with these causes on the fast engine."""
    runs = (study.safety.drawn(seed) for seed in itertools.count(FIRST))
    return (run for run in runs if run["engine"] == "articulated" and study.safety.cause(run) in causes)


def measured(run, policy):
    """How far a draw went in each law under a policy."""
    found = study.safety.measure(run | {"keys": run["keys"] | {"control.policy": policy}})
    assert found["error"] is None, (run["seed"], policy, found["error"])
    return found


def test_with_sound_sensors_traction_control_keeps_the_limits_or_plain_loops_do_not():
    for run in itertools.islice(draws("sound"), 12):
        ours = measured(run, run["traction"])
        beyond = [law for law in study.safety.SOUND if ours[law] > 1.0]
        # A vehicle that falls off an edge, or tops it, is too fast under any policy; a tenth is another fall.
        if beyond:
            plain = measured(run, "independent")
            assert all(ours[law] <= 1.1 * plain[law] for law in beyond), (run, ours, plain)
        assert not any(ours[law] for law in study.safety.NEVER), run


def test_whatever_sensors_say_no_torque_outlasts_a_stop():
    for run in itertools.islice(draws("encoder broken", "noise or counts", "late"), 12):
        ours = measured(run, run["traction"])
        assert not any(ours[law] for law in study.safety.NEVER), run


def test_each_cause_is_named_by_what_is_wrong_first():
    run = next(draws("sound"))
    keys = run["keys"] | {"sensors.encoder_noise_rad_s": 0.0, "sensors.encoder_counts": 0, "sensors.delay_s": 0.0}
    keys |= {"actuators.torque_lag_s": 0.0, "control.period_s": 0.01}

    def cause(broken="", **more):
        named = {f"{section}.{name}": value for (section, name), value in more.get("keys", {}).items()}
        return study.safety.cause(run | {"broken": broken, "keys": keys | named})

    assert cause() == "sound"  # a period of 10 ms alone is not late
    assert cause(keys={("sensors", "delay_s"): 0.01}) == "late"
    assert cause(keys={("sensors", "encoder_noise_rad_s"): 5.0}) == "noise or counts"
    assert cause(keys={("sensors", "encoder_counts"): 4}) == "noise or counts"
    assert cause("encoder_dead", keys={("sensors", "delay_s"): 0.01}) == "encoder broken"
