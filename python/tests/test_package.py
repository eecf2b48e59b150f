"""The package as others meet it: typed, one command line, logs that foreign readers open."""

import subprocess
import sys
from pathlib import Path

import pytest

import omnistep

ROOT = Path(__file__).resolve().parents[2]


def command(*args):
    return subprocess.run(args, capture_output=True, text=True, check=False, cwd="/")


def test_the_console_script_is_the_same_command_line():
    script = command(str(Path(sys.executable).with_name("omnistep")), "list")
    module = command(sys.executable, "-m", "omnistep", "list")
    assert script.returncode == module.returncode == 0
    assert script.stdout == module.stdout
    assert all(name in script.stdout for name in omnistep.policies() + omnistep.scenarios() + omnistep.vehicles())
    wrong = command(sys.executable, "-m", "omnistep", "run", "stairway")
    assert (wrong.returncode, wrong.stdout) == (2, "")
    assert wrong.stderr.startswith('error: unknown scenario "stairway"')


def test_without_matplotlib_all_but_the_plots_works_and_they_say_what_to_install():
    program = """
import sys
sys.modules["matplotlib"] = None
import omnistep
trace = omnistep.run("flat", overrides={"duration_s": 0.01})
for plot in (omnistep.plot.climb, omnistep.plot.strip, lambda _: omnistep.plot.wheels(omnistep.wheels())):
    try:
        plot(trace)
    except ImportError as error:
        assert 'pip install "omnistep[plot]"' in str(error), error
    else:
        raise AssertionError(plot)
"""
    checked = command(sys.executable, "-c", program)
    assert checked.returncode == 0, checked.stderr


def test_the_stub_says_what_the_module_has():
    checked = command(sys.executable, "-m", "mypy.stubtest", "omnistep", "--concise")
    assert checked.returncode == 0, checked.stdout + checked.stderr


def test_the_package_is_typed_strictly():
    checked = command(sys.executable, "-m", "mypy", "--strict", "--cache-dir", "/dev/null", "-p", "omnistep")
    assert checked.returncode == 0, checked.stdout + checked.stderr


@pytest.mark.parametrize("policy", ["independent", "paper", "synchronised", "load_sharing"])
def test_a_log_opens_in_mcap_with_crcs_and_in_rosbags(policy, tmp_path):
    log = tmp_path / "run.mcap"
    trace = omnistep.run("step", policy=policy, mcap=log, overrides={"duration_s": 2.0})
    checked = command(sys.executable, str(ROOT / "scripts" / "check_log.py"), str(log))
    assert checked.returncode == 0, checked.stdout + checked.stderr
    assert "run.mcap: ok" in checked.stdout

    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    with log.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        states = [message for *_, message in reader.iter_decoded_messages(topics=["/vehicle_state"])]
    assert len(states) == len(trace) == 2000
    applied = trace.wheels("applied_n_m")
    assert all([w.applied_n_m for w in state.wheels] == list(row) for state, row in zip(states, applied, strict=True))
    assert {state.policy for state in states} == {policy}
