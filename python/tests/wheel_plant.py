"""Vehicles as few lines of numpy, many at once: a truth for identification that shares no code with it."""

import numpy as np

import omnistep

PERIOD_S = 0.01
#: Time, and parts of the top twist.
LEGS = [
    (0.0, (0, 0, 0)), (0.4, (0, 0, 0)), (0.8, (1, 0, 0)), (2.0, (1, 0, 0)), (2.7, (-1, 0, 0)), (3.7, (-1, 0, 0)),
    (4.1, (-0.3, 0, 0)), (5.1, (-0.3, 0, 0)), (5.5, (0, 1, 0)), (6.4, (0, 1, 0)), (7.0, (0, -1, 0)), (8.0, (0, -1, 0)),
    (8.3, (0, -0.3, 0)), (9.2, (0, -0.3, 0)), (9.6, (0, 0, 1)), (10.4, (0, 0, 1)), (11.0, (0, 0, -1)),
    (11.8, (0, 0, -1)), (12.4, (0, 0, 0.8)), (13.0, (0, 0, 0.3)), (13.8, (0, 0, 0.3)), (14.2, (0.5, 0.3, 0.4)),
    (15.0, (0.5, 0.3, 0.4)), (15.6, (-0.5, 0.4, -0.5)), (16.6, (-0.5, 0.4, -0.5)), (17.0, (0.6, 0, 0)),
    (21.0, (0.6, 0, 0)),
]  # fmt: skip


def commands(top):
    """A drive in every direction, swings of 0.5 to 5 Hz in its end."""
    time = np.arange(round(LEGS[-1][0] / PERIOD_S)) * PERIOD_S
    parts = np.array([part for _, part in LEGS])
    twist = np.stack([np.interp(time, [at for at, _ in LEGS], parts[:, axis]) for axis in range(3)], axis=1)
    swing = np.clip(time - 17.2, 0.0, None)
    twist[:, 0] += 0.3 * np.sin(2 * np.pi * (0.5 * swing + 0.5 * 4.5 / 3.8 * swing**2))
    return twist * top


def masses(vehicle):
    """Mass, centre of mass and yaw inertia about the origin of a file, wheels as discs."""
    keys = vehicle.to_dict()
    parts = [(body["mass_kg"], body["com_m"][:2]) for body in keys["body"]]
    parts += [(wheel["mass_kg"], wheel["position_m"]) for wheel in keys["wheel"]]
    mass = sum(kg for kg, _ in parts)
    centre = sum(kg * np.array(place) for kg, place in parts) / mass
    own = sum(b["mass_kg"] * (b["inertia_box_m"][0] ** 2 + b["inertia_box_m"][1] ** 2) / 12 for b in keys["body"])
    discs = sum(wheel["inertia_kg_m2"] / 2 for wheel in keys["wheel"])
    return mass, centre, own + discs + sum(kg * (np.array(place) ** 2).sum() for kg, place in parts)


def logs(vehicle, truth, seeds, *, counts, kp, ki, top, lifted=False, noise_rad_s=0.0, parts=10, vary=0.0):
    """What encoders and loops of PI say of the same drive, one log a seed.

    Friction is dry above 0.02 rad/s and steep below; the steps are of the midpoint rule, ten a control period. An
    encoder is whole counts from an angle of the seed's; its velocity is the counts of a period. Commands of the seeds
    differ by a factor of up to 1 -+ ``vary``.
    """
    matrix = omnistep.Kinematics(layout=vehicle.layout).inverse_matrix
    factors = [1.0 + vary * np.random.default_rng([seed, 1]).uniform(-1.0, 1.0) for seed in seeds]
    references = np.array(factors)[:, None, None] * (commands(top) @ matrix.T)
    wheels = len(matrix)
    _, (cx, cy), _ = masses(vehicle)
    m, turning = truth["mass_kg"], truth["wheel_inertia_kg_m2"]
    if lifted:
        matrix, inertia = np.eye(wheels), turning * np.eye(wheels)
    else:
        rigid = [[m, 0, -m * cy], [0, m, m * cx], [-m * cy, m * cx, truth["yaw_inertia_kg_m2"]]]
        inertia = np.array(rigid) + turning * matrix.T @ matrix
    inverse = np.linalg.inv(inertia)
    step = PERIOD_S / parts
    keep = np.exp(-step / truth["lag_s"])
    half = np.exp(-0.5 * step / truth["lag_s"])
    dry, viscous = truth["gear_friction_n_m"], truth["viscous_n_m_s_rad"]
    dry = dry if lifted else dry + truth.get("rolling_n_m", 0.0)

    def force(torque, motion):
        turn = motion @ matrix.T
        on = (torque - dry * np.clip(turn / 0.02, -1, 1) - viscous * turn) @ matrix
        if not lifted:
            vx, vy, w = motion.T
            on -= m * np.stack([-w * (vy + w * cx), w * (vx - w * cy), w * (cx * vx + cy * vy)], axis=1)
        return on

    rng = [np.random.default_rng(seed) for seed in seeds]
    offset = np.stack([each.random(wheels) for each in rng])
    noise = np.stack([each.standard_normal(references.shape[1:]) for each in rng]) * noise_rad_s
    count = 2 * np.pi / counts
    motion = np.zeros((len(seeds), matrix.shape[1]))
    angle, integral, acting = (np.zeros((len(seeds), wheels)) for _ in range(3))
    line = [np.zeros((len(seeds), wheels))] * round(truth["delay_s"] / step)
    before = np.floor(angle / count + offset)
    read, given = (np.zeros(references.shape) for _ in range(2))
    for row, reference in enumerate(references.swapaxes(0, 1)):
        now = np.floor(angle / count + offset)
        read[:, row] = (now - before) * count / PERIOD_S + noise[:, row]
        before = now
        error = reference - read[:, row]
        integral += ki * PERIOD_S * error
        given[:, row] = kp * error + integral
        for _ in range(parts):
            line.append(given[:, row])
            late = line.pop(0)
            middle = late + (acting - late) * half
            acting = late + (acting - late) * keep
            between = motion + 0.5 * step * force(middle, motion) @ inverse
            after = motion + step * force(middle, between) @ inverse
            angle = angle + 0.5 * step * (motion + after) @ matrix.T
            motion = after
    time = np.arange(references.shape[1]) * PERIOD_S
    return [
        {"time_s": time}
        | {f"wheel_{name}_measured_rad_s": read[k, :, n] for n, name in enumerate(vehicle.wheel_names)}
        | {f"wheel_{name}_applied_n_m": given[k, :, n] for n, name in enumerate(vehicle.wheel_names)}
        for k in range(len(seeds))
    ]
