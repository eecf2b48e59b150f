"""Mecanum robots with hobby bridges, as few lines of numpy: shares nothing with the simulator or the estimator.

Each motor has its line (stall torque, slope), gear friction, a lag and a delay. A bridge at zero duty brakes (the motor
is shorted) or coasts (it is open). One that "chops" coasts in the rest of each PWM period too. The log has PWM of 8
bits, whole counts, and times in ms that jitter.
"""

import numpy as np

import omnistep

#: Step of the integration and mean distance of rows [s].
STEP_S, ROW_S = 0.001, 0.01
#: Forward, left, counter-clockwise as signs of the four wheels: front left, front right, rear left, rear right.
AXES = np.array([[1, 1, 1, 1], [-1, 1, 1, -1], [-1, 1, -1, 1]])
TRUTH = {
    "stall_torque_n_m": 1.6, "slope_n_m_s_rad": 0.1, "gear_friction_n_m": 0.06, "lag_s": 0.004, "delay_s": 0.006,
    "mass_kg": 24.0, "yaw_inertia_kg_m2": 1.1, "wheel_inertia_kg_m2": 0.0035,
}  # fmt: skip


def file(**motor):
    """The vehicle file: its motor is wrong by a factor of 1.6, or as given."""
    motor = {"stall_torque_n_m": 1.0, "slope_n_m_s_rad": 0.06} | motor
    keys = omnistep.Vehicle("mecanum4").to_dict()
    keys["motor"] |= motor | {"no_load_rpm": None, "no_load_rad_s": None}
    return omnistep.Vehicle.from_dict(keys)


def commands(rng):
    """PWM, -255 to 255, every step: forward, sideways, turning, at three levels, with pauses at zero; then steps."""
    parts = [(0.5, np.zeros(4))]
    for level in (110, 180, 250):
        for axis in AXES:
            for sign in (1, -1):
                parts += [(rng.uniform(0.6, 0.9), sign * level * axis), (rng.uniform(0.3, 0.6), np.zeros(4))]
    for _ in range(30):
        parts.append((0.15, rng.choice([-200, 0, 200], p=[0.4, 0.2, 0.4]) * rng.choice([-1, 1], size=4)))
    return np.concatenate([np.tile(pwm, (round(time / STEP_S), 1)) for time, pwm in parts])


def table(seed, zero, counts=1440):
    """A log of such a drive as columns: t_ms, enc_1 to enc_4, pwm_1 to pwm_4."""
    rng = np.random.default_rng(seed)
    p, radius = TRUTH, 0.076
    x, y = np.abs(omnistep.Vehicle("mecanum4")["wheel.0.position_m"])
    turns = (AXES * np.array([[1.0], [1.0], [x + y]])).T / radius
    inertia = np.diag([p["mass_kg"], p["mass_kg"], p["yaw_inertia_kg_m2"]])
    inverse = np.linalg.inv(inertia + p["wheel_inertia_kg_m2"] * turns.T @ turns)
    pwm = commands(rng)
    late = np.concatenate([np.zeros((round(p["delay_s"] / STEP_S), 4)), pwm])
    keep = np.exp(-STEP_S / p["lag_s"])
    moves, angle, volts = np.zeros(3), rng.uniform(0, 1, 4), np.zeros(4)
    angles = np.empty((len(pwm), 4))
    for step in range(len(pwm)):
        angles[step] = angle
        duty, wheels = late[step] / 255, turns @ moves
        volts = duty + (volts - duty) * keep
        torque = p["stall_torque_n_m"] * volts - p["slope_n_m_s_rad"] * wheels
        if zero == "chops":
            # On for a part of the period, then open: the line of full voltage for that part, and diodes let none back.
            ways = np.sign(volts)
            torque = volts * np.maximum(p["stall_torque_n_m"] - p["slope_n_m_s_rad"] * wheels * ways, 0.0)
        if zero == "coast":
            # An open bridge lets no current flow at once.
            torque, volts = np.where(duty == 0, 0.0, torque), np.where(duty == 0, 0.0, volts)
        force = turns.T @ (torque - p["gear_friction_n_m"] * np.clip(wheels / 0.05, -1, 1))
        vx, vy, turn = moves
        force += p["mass_kg"] * np.array([turn * vy, -turn * vx, 0.0])
        moves = moves + STEP_S * inverse @ force
        angle = angle + STEP_S * turns @ moves
    nominal = np.arange(0.0, (len(pwm) - 20) * STEP_S, ROW_S)
    rows = np.round((nominal + rng.uniform(0, 0.002, len(nominal))) / STEP_S).astype(int)
    columns = {"t_ms": np.floor(rows * STEP_S * 1000 + 1e-6)}
    columns |= {f"enc_{k + 1}": np.floor(angles[rows, k] * counts / (2 * np.pi)) for k in range(4)}
    return columns | {f"pwm_{k + 1}": pwm[rows, k] for k in range(4)}


def written(folder, seed, zero, duty_keys="", counts=1440):
    """The log as CSV, imported with a map: the path of the recording."""
    columns = table(seed, zero, counts)
    source, out = folder / f"{zero}_{seed}.csv", folder / f"{zero}_{seed}.mcap"
    np.savetxt(source, np.stack(list(columns.values()), axis=1), "%d", ",", header=",".join(columns), comments="")
    (folder / "hobby.toml").write_text(file().to_toml())
    (folder / "map.toml").write_text(
        'schema_version = 1\nvehicle = "hobby.toml"\nperiod_s = 0.01\n[time]\ncolumn = "t_ms"\nunit = "ms"\n'
        f'[wheels]\nnames = ["enc_1", "enc_2", "enc_3", "enc_4"]\nunit = "count"\ncounts_per_turn = {counts}\n'
        f'[duty]\nnames = ["pwm_1", "pwm_2", "pwm_3", "pwm_4"]\nscale = 0.00392156862745098\n{duty_keys}'
    )
    omnistep.import_log(source, map=folder / "map.toml", out=out, progress=False)
    return out
