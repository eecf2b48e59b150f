"""Intervals and paired differences of a study, against arithmetic of their own."""

import math
import statistics

import matplotlib.pyplot as plt
import pytest

import omnistep

# Student's t that 95 of 100 are within, for four runs: every printed table has it.
T_OF_4 = 3.182446


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    """Two speeds and two policies from four starts, half a second each."""
    points = {"command.vx_m_s": [0.2, 0.4], "control.policy": ["independent", "scale_torques"]}
    overrides = {"duration_s": 0.5, "perturbation.yaw_rad": 0.05, "command.frame": "world"}
    out = tmp_path_factory.mktemp("intervals") / "grid"
    given = {"scenario": "flat", "overrides": overrides, "seeds": 4, "progress": False}
    return omnistep.sweep(points, out=out, **given)


def metrics(result, name, **where):
    """A metric by seed, of the rows that are so."""
    chosen = [row for row in result.rows() if all(row[key] == value for key, value in where.items())]
    return {row["seed"]: row[name] for row in chosen}


def interval(measured):
    mean, half = statistics.mean(measured), T_OF_4 * statistics.stdev(measured) / 2.0
    return [mean - half, mean, mean + half]


def test_means_have_students_interval_and_rates_wilsons(result):
    cells = result.summary("work_j", "climbed")
    assert len(cells) == 4 == len(result.cells)
    for cell in cells:
        where = {key: cell[key] for key in ("command_vx_m_s", "control_policy")}
        expected = interval(metrics(result, "work_j", **where).values())
        assert [cell["work_j_low"], cell["work_j"], cell["work_j_high"]] == pytest.approx(expected, rel=1e-6)
        assert cell["work_j_low"] < cell["work_j_high"]
        z = statistics.NormalDist().inv_cdf(0.975)
        # None of four: z^2 / (n + z^2).
        assert (cell["climbed"], cell["climbed_low"]) == (0.0, 0.0)
        assert cell["climbed_high"] == pytest.approx(z * z / (4 + z * z), rel=1e-12)


def test_one_run_has_a_mean_and_no_interval(tmp_path):
    given = {"scenario": "flat", "overrides": {"duration_s": 0.1}, "out": tmp_path / "one", "progress": False}
    (cell,) = omnistep.sweep([{"terrain.friction": 0.6}], **given).summary("work_j", "crossing_s")
    assert cell["work_j"] > 0.0 and cell["work_j_low"] is None and cell["work_j_high"] is None
    assert [cell[f"crossing_s{end}"] for end in ("", "_low", "_high")] == [None] * 3


def test_paired_differences_are_those_of_runs_with_the_same_seed(result):
    cells = result.paired("command.vx_m_s", 0.2, "work_j")
    assert [(cell["command_vx_m_s"], cell["pairs"]) for cell in cells] == [(0.4, 4)] * 2
    for cell in cells:
        policy = cell["control_policy"]
        fast = metrics(result, "work_j", command_vx_m_s=0.4, control_policy=policy)
        slow = metrics(result, "work_j", command_vx_m_s=0.2, control_policy=policy)
        expected = interval([fast[seed] - slow[seed] for seed in fast])
        assert [cell["low"], cell["difference"], cell["high"]] == pytest.approx(expected, rel=1e-6)
    climbed = result.paired("control.policy", "independent")
    assert [(cell["only_here"], cell["only_there"], cell["difference"]) for cell in climbed] == [(0, 0, 0.0)] * 2


def test_what_cannot_be_compared_is_one_line(result):
    for given, expected in [
        (
            ("control.polcy", "scale_torques"),
            'baseline: "control.polcy" \\(did you mean "control.policy"\\?\\), allowed: command',
        ),
        (
            ("control.policy", "scale_references"),
            "baseline: control.policy = scale_references, allowed: independent, scale_torques",
        ),
        (("control.policy", "scale_torques", "verdict"), 'metrics: "verdict", allowed: '),
    ]:
        with pytest.raises(omnistep.ConfigError, match=expected) as refused:
            result.paired(*given)
        assert len(str(refused.value).splitlines()) == 1
    with pytest.raises(omnistep.ConfigError, match='did you mean "work_j"'):
        result.summary("work")


def test_whiskers_are_the_intervals_of_the_summary(result):
    axes = omnistep.plot.ensemble(result, ["climbed", "work_j"], lines="command.vx_m_s")
    for ax, metric in zip(axes, ("climbed", "work_j"), strict=True):
        drawn = sorted(tuple(float(y) for _, y in bar.get_segments()[0]) for bar in ax.collections)
        cells = result.summary(metric)
        expected = sorted((cell[f"{metric}_low"], cell[f"{metric}_high"]) for cell in cells)
        assert len(drawn) == 4 and math.isclose(sum(map(sum, drawn)), sum(map(sum, expected)), rel_tol=1e-12)
    assert [text.get_text() for text in axes[1].get_xticklabels()] == ["independent", "scale_torques"]
    with pytest.raises(omnistep.ConfigError, match="metrics: verdict is text"):
        omnistep.plot.ensemble(result, ["verdict"])
    plt.close("all")


def test_a_wheel_at_its_reduced_reference_lags_behind_the_commanded_one_alone():
    # At the riser the motors are at their limit: all references are reduced, and wheels follow those closer.
    outcome = omnistep.run("step", policy="scale_references", overrides={"vehicle.motor.stall_torque_n_m": 1.4}).outcome
    assert 0.0 < outcome.speed_error_realised_rms < outcome.speed_error_rms
    other = omnistep.run("step", policy="independent", overrides={"duration_s": 2.0}).outcome
    assert other.speed_error_realised_rms == other.speed_error_rms
