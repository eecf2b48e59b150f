"""Searches: the same trials for the same seed, failures that count and do not crash, rows that are kept."""

import subprocess
import sys

import duckdb
import pytest

import omnistep

KP = "vehicle.gains.kp_n_m_s_rad"
# Half a second from rest, where a higher gain follows better and slips more.
BRIEF = {"duration_s": 0.5, "perturbation.yaw_rad": 0.05}


def tune(**more):
    given = {"space": {KP: (0.05, 2.0, "log")}, "objective": "shape_error_rms_rad_s", "overrides": BRIEF}
    return omnistep.tune("flat", **{**given, "trials": 8, "seeds": 2, "progress": False, **more})


def test_the_best_of_the_trials_is_what_a_run_with_its_values_gives():
    found = tune()
    values = [trial.value for trial in found.study.trials]
    assert len(values) == 8 == len(set(values)) and found.value == min(values)
    runs = [omnistep.run("flat", overrides={**BRIEF, **found.overrides}, seed=seed) for seed in range(2)]
    metrics = [run.outcome.shape_error_rms_rad_s for run in runs]
    assert metrics[0] != metrics[1]
    # The mean of the same two numbers, bit for bit.
    assert found.value == (metrics[0] + metrics[1]) / 2.0
    assert 0.05 <= found.overrides[KP] <= 2.0 and found.folder is None and found.failed == 0
    assert tune(direction="maximize").value > found.value


def test_the_same_seed_searches_the_same_values_and_another_others():
    def searched(found):
        return [(trial.params, trial.value) for trial in found.study.trials]

    one = tune(trials=5)
    assert searched(one) == searched(tune(trials=5))
    assert searched(one) != searched(tune(trials=5, seed=1))


def test_a_search_that_was_ended_goes_on_where_it_was(tmp_path):
    def count():
        rows = duckdb.read_parquet(str(tmp_path / "part-*.parquet"))
        return rows.aggregate("count(*), count(distinct key)").fetchall()

    first = tune(trials=3, out=tmp_path)
    assert first.folder == tmp_path and count() == [(6, 6)]
    parts = {part: part.read_bytes() for part in tmp_path.glob("part-*.parquet")}
    second = tune(trials=5, out=tmp_path)
    assert count() == [(10, 10)] and all(part.read_bytes() == old for part, old in parts.items())
    assert [trial.params for trial in second.study.trials][:3] == [trial.params for trial in first.study.trials]


def test_choices_whole_numbers_and_points_are_searched_too():
    space = {"control.policy": ["scale_torques", "independent"], "physics.solver_iterations": (4, 6)}
    rows_seen = []

    def objective(rows):
        rows_seen.append(rows)
        return max(row["torque_squared_n2m2s"] for row in rows)

    more = {"points": {"terrain.friction": [0.5, 0.9]}, "overrides": {**BRIEF, "physics.engine": "rapier"}}
    found = tune(space=space, objective=objective, trials=4, seeds=1, **more)
    assert found.overrides["control.policy"] in ("scale_torques", "independent")
    assert found.overrides["physics.solver_iterations"] in (4, 5, 6)
    assert [[row["terrain_friction"] for row in rows] for rows in rows_seen] == [[0.5, 0.9]] * 4
    assert found.value == min(max(row["torque_squared_n2m2s"] for row in rows) for rows in rows_seen)


@pytest.mark.parametrize("objective", ["slip_rms", lambda rows: sum(row["slip_rms"] for row in rows)])
def test_runs_that_fail_count_worst_and_the_search_goes_on(objective):
    # A motor so strong, under a gain so high, that it tears the vehicle apart at once; or one that does not.
    space = {"vehicle.motor.stall_torque_n_m": [2.0, 1e6]}
    found = tune(space=space, overrides={**BRIEF, KP: 1e6}, objective=objective, seeds=1)
    torn = [trial for trial in found.study.trials if trial.params["vehicle.motor.stall_torque_n_m"] == 1e6]
    assert torn and all((trial.value, trial.user_attrs["failed"]) == (1e6, 1) for trial in torn)
    assert found.overrides == {"vehicle.motor.stall_torque_n_m": 2.0} and found.value < 100.0


def test_a_search_without_any_metric_has_no_best_values():
    # On flat ground nothing is crossed: no run has the metric.
    with pytest.raises(omnistep.StudyError, match=r"^no run of 2 trials has a crossing_s$") as caught:
        tune(objective="crossing_s", trials=2)
    assert caught.value.key == "objective"
    torn = {"vehicle.motor.stall_torque_n_m": (9e5, 1e6)}
    with pytest.raises(omnistep.StudyError, match=r"^no run of 2 trials has a slip_rms: a joint separated at "):
        keys = {**BRIEF, KP: 1e6, "physics.engine": "rapier"}
        tune(space=torn, overrides=keys, objective="slip_rms", seeds=1, trials=2)
    with pytest.raises(omnistep.StudyError, match=r"^no run of 2 trials has a value of the objective$"):
        tune(objective=lambda rows: float("nan"), trials=2)
    # Nearly every period is no whole number of microseconds; the ends are.
    with pytest.raises(omnistep.StudyError, match=r"none of 2 trials can run: .* a whole number of microseconds"):
        tune(space={"control.period_s": (0.001, 0.002)}, trials=2, seeds=1)


def test_fewer_failures_are_better_whatever_the_metric():
    half = omnistep.tuning._value([{"error": None, "x": 3.0}, {"error": None, "x": None}], "x", 1e6)
    assert half == ((3.0 + 1e6) / 2.0, 1)
    assert omnistep.tuning._value([{"error": None}], lambda rows: float("nan"), -1e6) == (-1e6, 0)


def test_values_that_do_not_fit_together_count_worst():
    # A control period that is no multiple of the physics step is refused: 1.5 of 0.5 ms is one, 1 of 0.75 ms is not.
    space = {"control.period_s": [0.001, 0.0015], "physics.timestep_s": [0.0005, 0.00025, 0.00075]}
    found = tune(space=space, trials=12, seeds=1)
    refused = [trial for trial in found.study.trials if "refused" in trial.user_attrs]
    assert 1 <= len(refused) < 12 and all(trial.value == 1e6 for trial in refused)
    assert "allowed: a multiple of physics.timestep_s" in refused[0].user_attrs["refused"]


@pytest.mark.parametrize(
    ("more", "expected", "key"),
    [
        ({"space": {}}, "space: empty", "space"),
        ({"space": {KP: (2.0, 1.0)}}, r"space: .* = \(2\.0, 1\.0\), allowed: \(from, to\)", KP),
        ({"space": {KP: (0.0, 1.0, "log")}}, 'above 0 for "log"', KP),
        ({"space": {KP: ("a", "b")}}, "or a list of values", KP),
        ({"space": {KP: (-1.0, 1.0)}}, r"kp_n_m_s_rad: -1, allowed: ", "gains.kp_n_m_s_rad"),
        ({"space": {"vehicle.gains.kp": (0.1, 1.0)}}, "unknown field `kp`", "gains.kp"),
        ({"space": {"duration_s": (0.1, 0.2)}}, "space: duration_s is also given elsewhere", "duration_s"),
        (
            {"space": {"control.policy": ["scale_torques", "scale_torque", "independent"]}},
            '"scale_torque" .did you mean "scale_torques"',
            "control.policy",
        ),
        ({"points": {}}, "none, allowed: one or more", "points"),
        ({"overrides": {"seed": 3}}, "overrides: seed, allowed", "seed"),
        ({"objective": "speed"}, "objective = 'speed', allowed: a function, or arrived_s, climbed, ", "objective"),
        ({"direction": "down"}, "direction = 'down', allowed: minimize, maximize", "direction"),
        ({"trials": 0}, "trials = 0, allowed", "trials"),
        ({"worst": 0.0}, "worst = 0.0, allowed: above 0", "worst"),
    ],
)
def test_a_bad_search_is_refused_in_one_line_before_anything_runs(more, expected, key, tmp_path):
    with pytest.raises(omnistep.ConfigError, match=expected) as caught:
        tune(out=tmp_path / "out", **more)
    assert caught.value.key == key and "\n" not in str(caught.value)
    assert not (tmp_path / "out").exists()


def test_without_optuna_the_rest_works_and_tune_says_what_to_install():
    program = """
import sys
sys.modules["optuna"] = None
import omnistep
try:
    omnistep.tune(space={"command.vx_m_s": (0.1, 0.3)})
except ImportError as error:
    assert 'pip install "omnistep[tune]"' in str(error), error
else:
    raise AssertionError
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
