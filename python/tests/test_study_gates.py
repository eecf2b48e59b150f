"""The arithmetic of the study's gates, on tables made for it: what should fail fails, what should pass passes."""

import sys
from itertools import product
from pathlib import Path

import pandas as pd
import pytest

SCRIPTS = Path(__file__).resolve().parents[2] / "scripts"
sys.path.insert(0, str(SCRIPTS))
try:
    import study.gates
    import study.measure
    import study.page
    import study.runs
finally:
    sys.path.remove(str(SCRIPTS))

SEEDS = [1, 2, 3, 4]
CELLS = [(0.05, mu, torque) for mu in (0.55, 0.7, 0.85) for torque in (1.4, 1.6, 1.8, 2.2)]
METRICS = {"slip_speed_std": 0.1, "torque_squared_n2m2s": 10.0, "slip_rms": 0.2, "crossing_s": 2.5}


def row(policy, cell=(0.05, 0.7, 1.8), seed=1, climbed=True, **more):
    place = dict(zip(study.gates.CELL, cell, strict=True))
    tags = {"group": "grid", "scenario": "step", "case": "", "engine": "articulated", "wheels": "ball", "error": None}
    return {**tags, **place, "policy": policy, "seed": seed, "climbed": climbed, **METRICS, **more}


def grid(falls=(), alone=48, **of_independent):
    """A grid in which traction's metrics are those parts of independent's, and those runs (policy, cell, seed) fail."""
    rows = []
    for number, (cell, seed) in enumerate(product(CELLS, SEEDS)):
        parts = {metric: METRICS[metric] * part for metric, part in of_independent.items()}
        rows += [
            row("independent", cell, seed, ("independent", cell, seed) not in falls),
            row("traction", cell, seed, ("traction", cell, seed) not in falls, **parts),
            row("traction without retry", cell, seed, number < alone),
        ]
    return pd.DataFrame(rows)


def verdicts(gates):
    return {gate.name: gate.held for gate in gates}


GOOD = {"slip_speed_std": 0.54, "torque_squared_n2m2s": 0.89, "slip_rms": 0.84}


def test_a_grid_at_its_bounds_holds_and_each_metric_beyond_fails_alone():
    assert all(verdicts(study.gates.grid(grid(**GOOD), "articulated", "ball")).values())
    for metric, most in study.gates.PARTS.items():
        found = verdicts(study.gates.grid(grid(**GOOD | {metric: most + 0.01}), "articulated", "ball"))
        assert [name for name, held in found.items() if not held] == [
            f"{study.gates.NAMES[metric]}, ratio to independent"
        ]


def test_a_cell_climbed_less_often_fails_even_where_the_sum_is_enough():
    falls = [("traction", CELLS[3], 2)]
    found = verdicts(study.gates.grid(grid(falls, **GOOD), "articulated", "ball"))
    assert [name for name, held in found.items() if not held] == [
        "cells in which traction climbs at least as often as independent"
    ]
    both = grid([*falls, ("independent", CELLS[3], 1)], **GOOD)  # counts, not seeds
    assert all(verdicts(study.gates.grid(both, "articulated", "ball")).values())


def test_46_of_48_hold_and_45_do_not():
    falls = [(policy, CELLS[0], seed) for policy in ("traction", "independent") for seed in (1, 2)]
    assert (
        verdicts(study.gates.grid(grid(falls, **GOOD), "rapier", "ball"))["traction climbs"] is False
    )  # another engine
    assert verdicts(study.gates.grid(grid(falls, **GOOD), "articulated", "ball"))["traction climbs"] is True
    falls += [(policy, CELLS[1], 1) for policy in ("traction", "independent")]
    assert verdicts(study.gates.grid(grid(falls, **GOOD), "articulated", "ball"))["traction climbs"] is False


def test_only_pairs_in_which_both_climb_count():
    rows = grid([("independent", CELLS[0], 1)], **GOOD)
    hot = (
        (rows["policy"] == "traction") & (rows["torque_n_m"] == 1.4) & (rows["friction"] == 0.55) & (rows["seed"] == 1)
    )
    rows.loc[hot, "torque_squared_n2m2s"] = 1e6
    pairs = study.gates.paired(rows, "traction", "independent")
    assert len(pairs) == 47
    assert study.gates.part(pairs, "torque_squared_n2m2s") == pytest.approx(0.89)
    assert study.gates.difference(pairs, "torque_squared_n2m2s") == pytest.approx((-1.1, -1.1, -1.1))


def test_means_are_compared_and_not_ratios():
    # 1 of 2 and 9 of 10: 10 / 12, where the mean of the ratios is 0.7.
    rows = pd.DataFrame(
        [row(policy, seed=seed, torque_squared_n2m2s=heat) for policy, seed, heat in
         [("traction", 1, 1.0), ("independent", 1, 2.0), ("traction", 2, 9.0), ("independent", 2, 10.0)]]
    )  # fmt: skip
    assert study.gates.part(
        study.gates.paired(rows, "traction", "independent"), "torque_squared_n2m2s"
    ) == pytest.approx(10 / 12)


def test_without_retry_the_bound_is_the_engine_s():
    name = "traction without retry climbs"
    assert verdicts(study.gates.grid(grid(alone=44, **GOOD), "articulated", "ball"))[name] is True
    assert verdicts(study.gates.grid(grid(alone=43, **GOOD), "articulated", "ball"))[name] is False
    for alone, held in [(34, True), (33, False)]:
        rows = grid(alone=alone, **GOOD).assign(engine="rapier")
        assert verdicts(study.gates.grid(rows, "rapier", "ball"))[name] is held


def test_what_is_missing_or_failed_does_not_hold_and_rollers_are_reported():
    rows = grid(**GOOD)
    assert not any(verdicts(study.gates.grid(rows.iloc[:-1], "articulated", "ball")).values())
    rows.loc[rows.index[0], "error"] = "diverged"
    assert not any(verdicts(study.gates.grid(rows, "articulated", "ball")).values())
    reported = study.gates.grid(grid(**GOOD).assign(wheels="rollers"), "articulated", "rollers")
    assert {gate.verdict for gate in reported} == {"reported"}


def perturbed(case, count):
    runs = list(product(CELLS, SEEDS[:2]))
    return pd.DataFrame(
        [row("traction", *run, number < count, group="perturbed", case=case) for number, run in enumerate(runs)]
    )


def test_perturbed_runs_may_fail_once_and_with_lag_three_times():
    for case, count, held in [("noise", 23, True), ("noise", 22, False), ("a lag", 21, True), ("a lag", 20, False)]:
        assert [gate.held for gate in study.gates.perturbed(perturbed(case, count), [case], "articulated")] == [held]
    assert study.gates.perturbed(perturbed("noise", 24), ["bias"], "articulated")[0].held is False  # no run


def ground(name, **of_steady):
    rows = [row("independent", seed=seed, group="grounds", case=name) for seed in range(8)]
    rows += [row("traction", seed=seed, group="grounds", case=name, **of_steady) for seed in range(8)]
    return pd.DataFrame(rows)


def test_other_grounds_may_take_a_tenth_more_and_half_a_step_s_spread_is_reported():
    def held(rows, name="ramp"):
        return [gate.held for gate in study.gates.grounds(rows, [name], "articulated", 8)]

    assert held(ground("ramp", torque_squared_n2m2s=10.99)) == [True, True, True]
    assert held(ground("ramp", torque_squared_n2m2s=11.01)) == [True, False, True]
    assert held(ground("ramp", climbed=False)) == [False, False, False]  # no pair
    assert held(ground("ramp").iloc[:0]) == [False, False, False]  # no run
    assert held(ground("half_step", slip_speed_std=0.9), "half_step") == [True, True, None]
    for slow, fast, judged in [(4e-4, 1e-9, True), (6e-4, 1e-9, False)]:  # next to none is none
        rows = ground("ice", slip_speed_std=slow)
        rows.loc[rows["policy"] == "independent", "slip_speed_std"] = fast
        assert held(rows, "ice") == [True, True, judged]
    some = ground("ramp")
    some.loc[15, "climbed"] = False
    assert held(some) == [False, False, False]


def hard(cells, falls, engine="articulated", seeds=SEEDS):
    return [
        row("traction_runup", cell, seed, (cell, seed) not in falls, group="hard", engine=engine)
        for cell in cells
        for seed in seeds
    ]


def test_a_cell_counts_only_where_every_run_climbs():
    possible = [(0.06, 0.55, round(1.0 + number / 10, 1)) for number in range(37)]
    slow = possible[:16]
    for cells, runs in [(5, 2), (6, 3), (5, 3), (6, 2)]:
        falls = [(cell, 1) for cell in possible[-cells:]]
        rows = hard(possible, falls) + hard(slow, [(cell, 1) for cell in slow[:runs]], "rapier", SEEDS[:1])
        gates = study.gates.runup(pd.DataFrame(rows), possible, slow, len(SEEDS))
        assert [gate.held for gate in gates] == [cells <= 5, runs <= 2]


def test_wheels_on_dampers_stay_together_and_none_collapses():
    for apart, fall, held in [(5.9, 0.9, [True, True]), (6.1, 0.9, [False, True]), (5.9, 1.1, [True, False])]:
        metrics = pd.DataFrame(
            [{"policy": policy, "apart_ever_rpm": apart, "fall_rpm": fall} for policy in ("traction", "traction_runup")]
        )
        assert [gate.held for gate in study.gates.on_dampers(metrics)] == 2 * held
    assert not any(gate.held for gate in study.gates.on_dampers(metrics.iloc[:0]))


def test_the_plan_has_the_runs_that_the_gates_ask_for():
    runs = pd.DataFrame([{name: run.get(name) for name in ("group", "engine", "wheels", "policy", "case", "seed")}
                         for run in study.runs.planned(short=False)])  # fmt: skip
    sizes = runs.groupby(["group", "engine", "wheels", "policy", "case"]).size()
    for engine in ("articulated", "rapier"):
        for policy in ("traction", "independent", "traction without retry"):
            assert sizes["grid", engine, "ball", policy, ""] == study.gates.GRID_RUNS
    assert set(sizes["perturbed", "articulated", "ball", "traction"]) == {study.gates.PERTURBED_RUNS}
    assert set(sizes["grounds", "articulated", "ball", "traction"]) == {study.gates.GROUND_RUNS}
    assert len(study.runs.HARD) == 16 and set(study.runs.HARD) <= set(study.runs.hard_cells()) - study.runs.IMPOSSIBLE
    assert len(set(study.runs.hard_cells()) - study.runs.IMPOSSIBLE) == 37
    keys = [study.runs.key(run, "build") for run in study.runs.planned(short=False)]
    assert len(set(keys)) == len(keys)


def test_a_page_is_filled_between_its_markers_and_nowhere_else():
    page = "a\n<!-- study: one -->\nold\n<!-- end of study -->\nb\n"
    filled = study.page.filled(page, {"one": "new \\1"})
    assert filled == "a\n<!-- study: one -->\nnew \\1\n<!-- end of study -->\nb\n"
    assert study.page.filled(filled, {"one": "new \\1"}) == filled
    for texts in ({}, {"one": "", "two": ""}):
        with pytest.raises(ValueError, match="markers"):
            study.page.filled(page, texts)


def test_wheel_4_is_met_by_its_edge_at_the_commanded_speed_and_never_on_the_flat():
    keys = {"physics.engine": "articulated", "control.policy": "independent", "stop_when_done": True}
    found = study.measure.measure("step", keys, 1)
    assert found["climbed"] and found["error"] is None and found["retries"] == 0.0
    # Loops follow 0.3 m/s within a per cent where no limit is met; nothing is left of the front row's climb.
    assert found["impact_m_s"] == pytest.approx(0.3, abs=0.003) == found["impact_rim_m_s"]
    assert abs(found["impact_windup"]) < 0.02 and 0.0 < found["impact_thrust"] < 1.0
    assert found["peak_n"] > 20 * 9.81 / 5  # at rest no wheel carries more than a fifth of it
    flat = study.measure.measure("flat", {"physics.engine": "articulated", "duration_s": 0.5}, 1)
    assert flat["verdict"] == "completed" and flat["impact_m_s"] is None
