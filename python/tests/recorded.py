"""What a robot would have recorded of a simulated run: counts that wrap, times that jitter, a gap."""

import numpy as np

COUNTS_PER_TURN = 4096
WRAP_BITS = 16
PERIOD_S = 1e-3
#: Rows without a sample.
GAP = slice(900, 1100)

MAP = """
schema_version = 1
vehicle = "omni3"
period_s = 0.001

[time]
column = "t_ms"
unit = "ms"

[wheels]
names = ["count_1", "count_2", "count_3"]
unit = "count"
counts_per_turn = 4096
wrap_bits = 16

[command]
names = ["vx", "vy", "wz"]
max_gap_s = inf

[torques]
names = ["i_1", "i_2", "i_3"]
unit = "mA"
n_m_per_a = 0.5

[pose]
names = ["x", "y", "yaw_deg"]
unit = "deg"
"""


def columns(trace, *, gap=True, seed=1):
    """Columns of a robot's own table, by name; times in ms since it was switched on."""
    rng = np.random.default_rng(seed)
    rows = len(trace)
    starts = PERIOD_S * np.arange(rows)
    # Readings are of the start of a period, and do not come on time.
    times = starts + np.concatenate([[0.0], rng.uniform(-2e-4, 2e-4, rows - 1)])
    turned = np.cumsum(trace.wheels("measured_rad_s") * PERIOD_S, axis=0)
    found = {"t_ms": 5e6 + 1e3 * times}
    for number in range(turned.shape[1]):
        counted = np.floor(np.interp(times, starts, turned[:, number]) * COUNTS_PER_TURN / (2 * np.pi))
        # Not far below where the counter begins again.
        found[f"count_{number + 1}"] = (counted + 65_500) % 2**WRAP_BITS
        acted = np.interp(times, starts, trace.wheels("torque_n_m")[:, number])
        found[f"i_{number + 1}"] = acted / 0.5 * 1e3
    for name in ("vx", "vy", "wz"):
        unit = "rad_s" if name == "wz" else "m_s"
        found[name] = trace[f"command_{name}_{unit}"]
    # Poses are of the end of a period.
    ends = starts + PERIOD_S
    for name in ("x", "y"):
        found[name] = np.interp(times, ends, trace[f"pose_{name}_m"])
    found["yaw_deg"] = np.degrees(np.interp(times, ends, np.unwrap(trace["pose_yaw_rad"])))
    if gap:
        keep = np.ones(rows, dtype=bool)
        keep[GAP] = False
        found = {name: column[keep] for name, column in found.items()}
    return found


def write_csv(path, table):
    """A table as a CSV file; whole numbers as such."""
    lines = [",".join(table)]
    for row in zip(*table.values(), strict=True):
        lines.append(",".join(str(int(v)) if float(v).is_integer() else repr(float(v)) for v in row))
    path.write_text("\n".join(lines) + "\n")
    return path
