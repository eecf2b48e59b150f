"""Controllers of one's own: the same run as a built-in law gives, the same trace, log, metrics and rows."""

import contextlib
import gc
import multiprocessing
import os
import pickle
import signal
import threading
import time
from concurrent.futures import ProcessPoolExecutor

import numpy as np
import pytest

import omnistep

SHORT = {"duration_s": 0.3}
UNKNOWN = ("common_factor", "_p_n_m", "_i_n_m", "_d_n_m", "_requested_n_m", "_saturated", "command_")


class Loops:
    """omnistep's own loops, as a foreign controller."""

    signals = ("asked_m_s", "largest_n_m")

    def __init__(self, policy):
        self.policy = policy

    def reset(self, info):
        """Start afresh."""
        self.controller = omnistep.Controller(info.scenario, policy=self.policy)

    def step(self, observation):
        """What they say."""
        torques = self.controller.step(observation.command, observation.wheels_rad_s).applied_n_m
        self.asked_m_s, self.largest_n_m = observation.command[0], np.abs(torques).max()
        return torques


class Pi:
    """A loop a wheel, in numpy."""

    def __init__(self, kp=0.3, ki=2.0):
        self.kp, self.ki = kp, ki

    def reset(self, info):
        """Start afresh."""
        self.inverse, self.period_s = info.kinematics.inverse_matrix, info.period_s
        self.integral = np.zeros(info.wheel_count)

    def step(self, observation):
        """Proportional and integral terms."""
        error = self.inverse @ observation.command - observation.wheels_rad_s
        self.integral += self.ki * self.period_s * error
        return self.kp * error + self.integral


class Versioned(Pi):
    """A law that says which it is."""

    def __init__(self, version, **gains):
        super().__init__(**gains)
        self.version = version


class Stumbles(Pi):
    """Fails on its way."""

    def step(self, observation):
        """As ever, for seventy periods."""
        if observation.period == 70:
            raise ZeroDivisionError("seventy")
        return super().step(observation)


def coast(observation):
    return np.zeros_like(observation.wheels_rad_s)


def same_run(own, built_in):
    """Every column that does not say what only omnistep's own loops know."""
    assert set(built_in.names) <= set(own.names)
    for name in built_in.names:
        if not any(part in name for part in UNKNOWN):
            np.testing.assert_array_equal(own[name], built_in[name], err_msg=name)


@pytest.mark.parametrize("policy", ["independent", "scale_references"])
def test_the_built_in_loops_as_an_own_policy_are_bit_identical(policy):
    # Up to the step and on to it, where every law is at its limits.
    overrides = {"duration_s": 1.5}
    own = omnistep.run("step", policy=Loops(policy), overrides=overrides)
    built_in = omnistep.run("step", policy=policy, overrides=overrides)
    same_run(own, built_in)
    assert own.policy == "Loops" and built_in.policy == policy
    assert own.outcome.work_j == built_in.outcome.work_j
    assert np.isnan(own["common_factor"]).all()  # what it does inside is unknown


def test_a_loop_a_wheel_in_ten_lines_of_numpy_is_independent_to_1e_8():
    own = omnistep.run("flat", policy=Pi(), overrides={"duration_s": 1.0})
    built_in = omnistep.run("flat", policy="independent", overrides={"duration_s": 1.0})
    # The same law summed up in another order: numbers of some rad/s part by some of their last bits, of which 1 s of
    # contacts makes 3e-9.
    np.testing.assert_allclose(own.wheels("measured_rad_s"), built_in.wheels("measured_rad_s"), rtol=0, atol=1e-8)
    assert own["twist_vx_m_s"][-1] == pytest.approx(0.3, abs=0.01)


def test_a_policy_sees_what_the_trace_says_and_nothing_that_a_vehicle_has_not():
    seen = []

    def watch(observation):
        arrays = (observation.command, observation.wheels_rad_s, observation.torques_n_m, observation.hinges_rad)
        seen.append((observation.period, observation.time_s, *(array.copy() for array in arrays)))
        assert observation.specific_force_m_s2[2] > 0.0 and observation.new_command
        return 0.1 * np.array([1, 0, -1, 1, 1, 0, -1])

    trace = omnistep.run("flat", policy=watch, overrides=SHORT)
    assert [row[0] for row in seen] == list(range(300))
    np.testing.assert_allclose([row[1] for row in seen], np.arange(300) * 1e-3, rtol=0, atol=1e-12)
    np.testing.assert_array_equal([row[2][0] for row in seen], trace["command_vx_m_s"])
    np.testing.assert_array_equal([row[3] for row in seen], trace.wheels("measured_rad_s"))
    np.testing.assert_array_equal([row[4] for row in seen][1:], trace.wheels("applied_n_m")[:-1])
    np.testing.assert_array_equal(
        [row[5] for row in seen][1:], np.c_[trace["hinge_pitch_angle_rad"], trace["hinge_roll_angle_rad"]][:-1]
    )
    public = {name for name in dir(omnistep.Observation) if not name.startswith("_")}
    assert public == {
        *("period", "time_s", "command", "new_command", "wheels_rad_s", "torques_n_m", "hinges_rad", "hinges_rad_s"),
        *("rate_rad_s", "specific_force_m_s2", "roll_rad", "pitch_rad", "climbed_m"),
    }


def test_a_silent_encoder_and_a_lost_command_reach_the_policy():
    faults = [
        {"kind": "encoder_silent", "wheel": "2", "from_s": 0.1},
        {"kind": "command_lost", "from_s": 0.2},
    ]
    received = []

    def watch(observation):
        received.append((np.isnan(observation.wheels_rad_s).tolist(), observation.new_command))
        return [0.0] * 7

    omnistep.run("flat", policy=watch, overrides={**SHORT, "fault": faults})
    assert received[50] == ([False] * 7, True)
    assert received[150] == ([False, True] + [False] * 5, True)
    assert not received[250][1]


def test_the_observation_is_one_object_that_cannot_be_written_or_pickled():
    seen = set()

    def watch(observation):
        seen.add((id(observation), id(observation.wheels_rad_s)))
        with pytest.raises(ValueError, match="read-only"):
            observation.wheels_rad_s[0] = 1.0
        with pytest.raises(TypeError, match="keep copies"):
            pickle.dumps(observation)
        return observation.torques_n_m  # its own memory is a torque like another

    omnistep.run("flat", policy=watch, overrides={"duration_s": 0.01})
    assert len(seen) == 1


@pytest.mark.parametrize("kind", [list, tuple, np.float32, np.int64, "strided", "column of a matrix"])
def test_torques_are_taken_in_any_shape_of_numbers(kind):
    torques = np.array([1, 0, -1, 1, 1, 0, -1])
    matrix = np.zeros((7, 3))
    matrix[:, 1] = torques
    given = (
        {
            "strided": np.repeat(torques.astype(float), 2)[::2],
            "column of a matrix": matrix[:, 1],
        }.get(kind)
        if isinstance(kind, str)
        else (torques.astype(kind) if kind not in (list, tuple) else kind(torques.tolist()))
    )
    trace = omnistep.run("flat", policy=lambda observation: given, overrides={"duration_s": 0.01})
    np.testing.assert_array_equal(trace.wheels("requested_n_m"), np.tile(torques, (10, 1)))


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (None, "it returned None, allowed: 7 finite torques"),
        (np.zeros(3), "it returned 3 values, allowed: 7"),
        ([0.0] * 8, "it returned 8 values, allowed: 7"),
        (np.zeros((7, 1)), r"it returned an array of shape \[7, 1\], allowed: 7"),
        (0.5, "it returned a value of type float, allowed: 7"),
        ("0000000", "it returned a value of type str, allowed: 7"),
        (b"0000000", "it returned a value of type bytes, allowed: 7"),
        (bytearray(7), "it returned a value of type bytearray, allowed: 7"),
        ({1: 2.0}, "it returned a value of type dict, allowed: 7"),
        ([0.0] * 6 + ["a"], "it returned list with a value that is not a number, allowed: 7"),
        (np.array(["a"] * 7), "it returned ndarray with a value that is not a number, allowed: 7"),
        ([0.0, float("nan"), 0.0, 0.0, 0.0, 0.0, 0.0], "returned NaN N.m for wheel 2 in period 3, .*allowed: finite"),
        ([0.0] * 6 + [float("inf")], "it returned inf N.m for wheel 7 in period 3, .*allowed: finite"),
    ],
)
def test_what_is_no_torque_is_one_line_that_names_policy_period_and_what_is_allowed(given, said, tmp_path):
    def wrong(observation):
        return given if observation.period == 3 else np.zeros(7)

    with pytest.raises(omnistep.SimulationError, match=said) as caught:
        omnistep.run("flat", policy=wrong, overrides=SHORT, mcap=tmp_path / "x.mcap")
    text = str(caught.value)
    assert text.startswith("policy wrong: ") and "period 3, t = 0.003 s" in text and "\n" not in text
    assert list(tmp_path.iterdir()) == []


def test_what_a_policy_raises_comes_out_with_a_note_of_when_and_leaves_no_log(tmp_path):
    with pytest.raises(ZeroDivisionError, match="seventy") as caught:
        omnistep.run("flat", policy=Stumbles(), overrides=SHORT, mcap=tmp_path / "x.mcap")
    assert caught.value.__notes__ == ["in period 70, t = 0.070 s, of policy Stumbles"]
    assert list(tmp_path.iterdir()) == []

    class Unready(Pi):
        def reset(self, info):
            raise LookupError("not yet")

    with pytest.raises(LookupError) as caught:
        omnistep.run("flat", policy=Unready())
    assert caught.value.__notes__ == ["in reset of policy Unready"]


@pytest.mark.parametrize(
    ("policy", "said"),
    [
        (3, "<class 'int'>, allowed: a name, an object"),
        (Pi, "the class Pi instead of an object of it"),
        (type("Half", (), {"step": lambda self, observation: None})(), r"Half with step but without reset\(info\)"),
        (type("Odd", (Pi,), {"name": 7})(), "whose name is not a string"),
        (type("Odd", (Pi,), {"signals": "error"})(), "signals = error, allowed: names in a tuple"),
    ],
)
def test_what_is_no_policy_is_refused_before_anything_runs(policy, said):
    with pytest.raises(TypeError, match=said):
        omnistep.run("flat", policy=policy)


@pytest.mark.parametrize(
    ("names", "said"),
    [
        (("e", "e"), "each name once"),
        (("Error",), "lower case letters"),
        (("time_s",), "another name: reserved are the columns"),
        (("gyro_rad_s",), "another name: reserved are the columns"),
        (tuple(f"s{i}" for i in range(257)), "256 signals at most"),
    ],
)
def test_signals_that_cannot_be_columns_are_refused(names, said):
    with pytest.raises(omnistep.ConfigError, match=said) as caught:
        omnistep.run("flat", policy=type("Own", (Pi,), {"signals": names})())
    assert caught.value.key == "policy"


def test_own_signals_are_columns_of_the_trace_and_of_the_log_in_every_bit(tmp_path):
    path = tmp_path / "own.mcap"
    trace = omnistep.run("flat", policy=Loops("scale_torques"), overrides=SHORT, mcap=path)
    np.testing.assert_array_equal(trace["largest_n_m"], np.abs(trace.wheels("applied_n_m")).max(axis=1))
    np.testing.assert_array_equal(trace["asked_m_s"], trace["command_vx_m_s"])
    log = omnistep.read_mcap(path)
    assert log.complete and log.trace.policy == log.run["policy"] == "Loops"
    for name in ("largest_n_m", "asked_m_s", "wheel_5_applied_n_m", "wheel_5_torque_n_m"):
        np.testing.assert_array_equal(log.trace[name], trace[name])
    again = pickle.loads(pickle.dumps(trace))
    assert again.policy == "Loops"
    np.testing.assert_array_equal(again["largest_n_m"], trace["largest_n_m"])


def test_a_signal_that_is_not_there_is_the_policy_s_own_exception():
    policy = type("Own", (Pi,), {"signals": ("error_rad_s",)})()
    with pytest.raises(AttributeError, match="error_rad_s") as caught:
        omnistep.run("flat", policy=policy)
    assert "in period 0" in caught.value.__notes__[0]
    policy.error_rad_s = "large"
    with pytest.raises(omnistep.SimulationError, match="its signal error_rad_s is large, allowed: a number"):
        omnistep.run("flat", policy=policy)


def test_a_policy_is_given_once():
    with pytest.raises(omnistep.ConfigError, match=r"overrides has control\.policy"):
        omnistep.run("flat", policy=coast, overrides={"control.policy": "scale_torques"})


def test_torques_are_brought_within_what_the_motors_have():
    trace = omnistep.run("flat", policy=lambda observation: [50.0] * 7, overrides={"duration_s": 0.01})
    assert (trace.wheels("requested_n_m") == 50.0).all() and trace.wheels("saturated").all()
    np.testing.assert_array_equal(trace.wheels("applied_n_m"), trace.wheels("limit_upper_n_m"))


def test_compare_takes_names_and_controllers_mixed_and_engines():
    traces = omnistep.compare("flat", policies=["scale_torques", Pi(), coast], overrides={"duration_s": 0.05})
    assert [(name, trace.policy) for name, trace in traces.items()] == [
        (n, n) for n in ("scale_torques", "Pi", "coast")
    ]
    both = ["rapier", "articulated"]
    traces = omnistep.compare("flat", policies=[Pi()], engines=both, overrides={"duration_s": 0.05})
    assert {key: trace.outcome.engine for key, trace in traces.items()} == {("Pi", engine): engine for engine in both}
    with pytest.raises(omnistep.ConfigError, match=r"\['Pi', 'Pi'\], allowed: at least one name, each only once"):
        omnistep.compare("flat", policies=[Pi(), Pi(kp=0.1)])
    with pytest.raises(omnistep.ConfigError, match="engines"):
        omnistep.compare("flat", engines=["rapier", "rapier"])
    with pytest.raises(TypeError, match="engines: 'rapier', allowed: a list"):
        omnistep.compare("flat", engines="rapier")
    with pytest.raises(omnistep.ConfigError, match=r"physics\.engine is also given by engines"):
        omnistep.compare("flat", engines=both, overrides={"physics.engine": "rapier"})


def test_ctrl_c_stops_a_policy_within_a_fraction_of_a_second():
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        timer = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
        timer.start()
        start = time.monotonic()
        with pytest.raises(KeyboardInterrupt):
            omnistep.run("flat", policy=Pi(), overrides={"duration_s": 3600.0})
        assert time.monotonic() - start < 2.3  # the call would have gone on for minutes
    finally:
        signal.signal(signal.SIGINT, before)


def test_runs_keep_nothing_of_a_policy_alive():
    class Large(Pi):
        alive = 0

        def __init__(self):
            super().__init__()
            Large.alive += 1

        def __del__(self):
            Large.alive -= 1

    for _ in range(3):
        omnistep.run("flat", policy=Large(), overrides={"duration_s": 0.01})
    gc.collect()
    assert Large.alive == 0


# Many runs


def test_a_sweep_has_the_rows_of_single_runs_on_threads_and_on_two_processes(tmp_path):
    points = [{"terrain.friction": friction} for friction in (0.5, 0.9)]
    rows = {}
    for name, executor in (
        ("threads", None),
        ("processes", ProcessPoolExecutor(2, multiprocessing.get_context("spawn"))),
    ):
        with executor or contextlib.nullcontext():
            result = omnistep.sweep(
                points,
                scenario="flat",
                policy=Pi(),
                overrides=SHORT,
                seeds=2,
                out=tmp_path / name,
                executor=executor,
                progress=False,
            )
        rows[name] = result.rows()
        assert result.failed == 0 and result.computed == 4
    # In every bit: a row does not know who computed it. NaN is None there.
    assert rows["threads"] == rows["processes"]
    for row in rows["threads"]:
        alone = omnistep.run(
            "flat", policy=Pi(), overrides={**SHORT, "terrain.friction": row["terrain_friction"]}, seed=row["seed"]
        )
        assert row["work_j"] == alone.outcome.work_j
        assert row["control_policy"] == "Pi"


def test_rows_of_two_laws_never_mix(tmp_path):
    def swept(policy, out):
        points = [{"terrain.friction": 0.5}]
        return omnistep.sweep(
            points, scenario="flat", policy=policy, overrides=SHORT, out=tmp_path / out, progress=False
        )

    first = swept(Pi(), "a")
    assert (first.computed, swept(Pi(), "a").computed) == (1, 0)  # equal objects, equal pickles: it is there already
    for other in (Pi(kp=0.31), coast, "scale_torques"):
        with pytest.raises(omnistep.ConfigError, match="use another folder"):
            swept(other, "a")
    keys = {
        swept(policy, f"{i}").rows()[0]["key"] for i, policy in enumerate([Pi(), Pi(kp=0.31), coast, "independent"])
    }
    assert len(keys) == 4
    # A version is enough: it changes with the law.
    versioned = [
        swept(Versioned(version, kp=kp), f"{version}{kp}").rows()[0]["key"]
        for version, kp in [("1", 0.3), ("1", 0.2), ("2", 0.3)]
    ]
    assert versioned[0] == versioned[1] != versioned[2]


def test_a_policy_that_raises_in_a_sweep_is_a_row_that_says_so(tmp_path):
    result = omnistep.sweep(
        [{"terrain.friction": 0.5}], scenario="flat", policy=Stumbles(), overrides=SHORT, out=tmp_path, progress=False
    )
    error = result.rows()[0]["error"]
    assert error == "policy Stumbles: period 70, t = 0.070 s: ZeroDivisionError: seventy"


def test_a_policy_that_cannot_be_pickled_is_refused_with_what_can(tmp_path):
    class Local(Pi):
        pass

    for policy in (lambda observation: None, Local()):
        with pytest.raises(
            omnistep.ConfigError, match=r"cannot be pickled, but .* \(.*, allowed: a function or an object of a"
        ):
            omnistep.sweep([{"terrain.friction": 0.5}], policy=policy, out=tmp_path)
    with pytest.raises(TypeError, match="version = 3, allowed: a string"):
        omnistep.sweep([{"terrain.friction": 0.5}], policy=Versioned(3), out=tmp_path)


# One period at a time


def test_a_simulation_with_a_policy_is_bit_identical_to_the_run_with_metrics_and_log(tmp_path):
    simulation = omnistep.Simulation("flat", policy=Loops("scale_torques"), overrides=SHORT)
    assert simulation.policy == "Loops"
    for _ in range(300):
        simulation.step(simulation.command_at(simulation.time_s))
    path = tmp_path / "x.mcap"
    trace, whole = simulation.finish(mcap=path), omnistep.run("flat", policy=Loops("scale_torques"), overrides=SHORT)
    assert trace.names == whole.names
    np.testing.assert_array_equal(trace.to_numpy(), whole.to_numpy())
    assert simulation.outcome.work_j == whole.outcome.work_j
    log = omnistep.read_mcap(path)
    assert log.complete and log.run["policy"] == "Loops"
    np.testing.assert_array_equal(log.trace["largest_n_m"], whole["largest_n_m"])


def test_periods_without_a_controller_are_rows_with_what_is_known(tmp_path):
    simulation = omnistep.Simulation("flat", policy=Loops("scale_torques"))
    simulation.step((0.1, 0.0, 0.0))
    simulation.step_torques([0.5] * 7)
    simulation.step((0.1, 0.0, 0.0))
    trace = simulation.finish(mcap=tmp_path / "x.mcap")
    np.testing.assert_array_equal(trace["time_s"], [0.001, 0.002, 0.003])
    for unknown in ("largest_n_m", "command_vx_m_s", "wheel_3_measured_rad_s", "common_factor"):
        assert np.isnan(trace[unknown][1])
    assert trace["asked_m_s"][2] == 0.1 and trace["wheel_3_applied_n_m"][1] == 0.5
    assert np.isfinite(trace["pose_x_m"]).all()
    log = omnistep.read_mcap(tmp_path / "x.mcap")
    assert np.isnan(log.trace["largest_n_m"][1]) and len(log.trace) == 3
    assert all(np.isfinite(poses).all() for poses in log.frames.values())


def test_the_clock_of_a_policy_goes_on_in_periods_past_it():
    periods = []

    def watch(observation):
        periods.append(observation.period)
        return [0.0] * 7

    simulation = omnistep.Simulation("flat", policy=watch)
    for past in (False, True, True, False):
        simulation.step_torques([0.0] * 7) if past else simulation.step((0.0, 0.0, 0.0))
    assert periods == [0, 3]


@pytest.mark.parametrize("policy", ["scale_references", Pi()], ids=["preset", "own"])
def test_a_pickled_simulation_goes_on_bit_for_bit(policy):
    overrides = {"sensors.encoder_noise_rad_s": 0.01, "sensors.delay_s": 0.002}
    simulation = omnistep.Simulation("step", policy=policy, overrides=overrides, seed=3)
    for _ in range(400):
        simulation.step((0.3, 0.0, 0.0))
    copy = pickle.loads(pickle.dumps(simulation))
    for each in (simulation, copy):
        for _ in range(400):
            each.step((0.3, 0.0, 0.1))
    assert copy.time_s == simulation.time_s == 0.8
    np.testing.assert_array_equal(copy.trace.to_numpy(), simulation.trace.to_numpy())
    assert copy.policy == simulation.policy and copy.outcome.energy_residual == simulation.outcome.energy_residual


def test_nothing_is_kept_unasked():
    simulation = omnistep.Simulation("flat", policy=coast, record=False)
    simulation.step((0.1, 0.0, 0.0))
    for ask in (lambda: simulation.trace, lambda: simulation.outcome, simulation.finish):
        with pytest.raises(omnistep.ConfigError, match="record = False") as caught:
            ask()
        assert caught.value.key == "record"
    assert pickle.loads(pickle.dumps(simulation)).time_s == 0.001


def test_a_policy_that_raises_in_a_simulation_raises_there_and_the_run_can_go_on():
    simulation = omnistep.Simulation("flat", policy=Stumbles())
    with pytest.raises(ZeroDivisionError) as caught:
        for _ in range(100):
            simulation.step((0.1, 0.0, 0.0))
    assert "in period 70" in caught.value.__notes__[0]
    simulation.step((0.1, 0.0, 0.0))
    assert len(simulation.trace) == 71 and simulation.time_s == pytest.approx(0.072, abs=1e-12)


def test_a_policy_that_asks_for_its_own_simulation_gets_an_error_and_nothing_hangs():
    def curious(observation):
        return [simulation.time_s] * 7

    simulation = omnistep.Simulation("flat", policy=curious)
    with pytest.raises(RuntimeError, match="a policy used the simulation that it controls"):
        simulation.step((0.1, 0.0, 0.0))


@pytest.mark.parametrize("by", ["run", "reset", "simulation", "progress"])
def test_runs_that_start_runs_without_end_are_a_recursion_error_and_a_few_are_fine(by):
    deepest = 0

    class Nested:
        def __init__(self, depth, most):
            self.depth, self.most = depth, most

        def run(self):
            nonlocal deepest
            deepest = max(deepest, self.depth)
            if self.depth == self.most:
                return
            inner = Nested(self.depth + 1, self.most)
            if by == "simulation":
                omnistep.Simulation("flat", policy=inner, record=False).step((0.0, 0.0, 0.0))
            elif by == "progress":
                omnistep._omnistep.run("flat", overrides={"duration_s": 0.07}, on_progress=lambda _: inner.run())
            else:
                omnistep.run("flat", policy=inner, overrides={"duration_s": 0.01}, progress=False)

        def reset(self, info):
            if by == "reset":
                self.run()

        def step(self, observation):
            if by != "reset" and observation.period == 0:
                self.run()
            return np.zeros(7)

    Nested(0, 16).run()
    assert deepest == 16
    with pytest.raises(RecursionError, match="runs that start runs, 16 within each other, allowed: 16"):
        Nested(0, 1000).run()
    assert deepest == 16
    # It is counted down again.
    Nested(0, 16).run()


def test_environments_say_their_engine():
    gym = pytest.importorskip("omnistep.gym")
    env = gym.DriveEnv()
    assert env.engine == "articulated"
    assert gym.DriveVectorEnv(2, overrides={"physics.engine": "rapier"}).engine == "rapier"
