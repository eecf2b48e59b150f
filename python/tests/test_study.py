"""Results of a study, read by another program's Parquet reader."""

import json
import subprocess
import sys

import duckdb

STUDY = """
schema_version = 1
name = "grid"
scenario = "step"
seeds = [1, 5]

[set]
duration_s = 0.5
"perturbation.start_m" = 0.02
"vehicle.gains.kp_n_m_s_rad" = 1e6

[[axis]]
key = "terrain.height_m"
values = [0.02, 0.05, 0.08]

[[axis]]
key = "control.policy"
values = ["paper", "independent"]

[[axis]]
key = "vehicle.motor.stall_torque_n_m"
values = [2.0, 1e6]

[map]
figures = ["climbed", "required_friction"]
"""


def test_duckdb_reads_one_typed_row_a_run_and_agrees_with_the_map(tmp_path):
    (tmp_path / "grid.toml").write_text(STUDY)
    command = [sys.executable, "-m", "omnistep", "study", "grid.toml", "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    cells = [json.loads(line) for line in done.stdout.splitlines()]
    assert len(cells) == 3 * 2 * 2

    rows = duckdb.read_parquet(str(tmp_path / "out" / "grid" / "*.parquet"))
    types = dict(zip(rows.columns, map(str, rows.types), strict=True))
    assert list(types)[:5] == ["key", "seed", "terrain_height_m", "control_policy", "vehicle_motor_stall_torque_n_m"]
    assert list(types)[-1] == "error"
    expected = {"key": "VARCHAR", "seed": "BIGINT", "terrain_height_m": "DOUBLE", "climbed": "BOOLEAN"}
    expected |= {"control_policy": "VARCHAR", "crossing_s": "DOUBLE", "verdict": "VARCHAR", "error": "VARCHAR"}
    assert expected.items() <= types.items()
    counted = (
        "count(*), count(distinct key), count(error), count(isnan(slip_rms) or null), list_sort(list(distinct seed))"
    )
    assert rows.aggregate(counted).fetchall() == [(24, 24, 12, 0, [1, 5])]
    assert rows.filter("error is not null and verdict is distinct from 'diverged'").fetchall() == []
    for cell in cells:
        where = f"terrain_height_m = {cell['terrain_height_m']} and control_policy = '{cell['control_policy']}'"
        where += f" and vehicle_motor_stall_torque_n_m = {cell['vehicle_motor_stall_torque_n_m']}"
        figures = "count(*), count(error), avg(climbed::int) filter (error is null)"
        assert rows.filter(where).aggregate(figures).fetchall() == [(cell["runs"], cell["errors"], cell["climbed"])]
