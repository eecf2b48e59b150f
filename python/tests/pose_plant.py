"""A mecanum vehicle below motion capture as few lines of numpy: a truth for calibration that shares no code with it."""

import numpy as np

STEP_S = 0.005
ROW_S = 0.02
WHEELS = ("front_left", "front_right", "rear_left", "rear_right")
#: What the vehicle is; the file (`mecanum4`) has 0.076 m and 0.45 m.
RADIUS_M, LEVER_M = 0.0751, 0.4622
#: Where the marker plate is on it: x, y [m], yaw [rad].
PLATE = (0.03, 0.02, 0.1)


#: How fast it is driven ahead, sideways [m/s] and around [rad/s].
FASTEST = (0.4, 0.3, 0.6)


def commanded(rng, duration_s, *, fastest=FASTEST):
    """Twists of a drive by hand: another one every 2 to 4 s, with pauses, smoothed over 0.3 s."""
    twists = []
    while len(twists) < duration_s / STEP_S:
        twist = rng.uniform(-1, 1, 3) * fastest * (rng.random() > 0.15)
        twists += [twist] * round(rng.uniform(2.0, 4.0) / STEP_S)
    twists = np.array(twists[: round(duration_s / STEP_S)])
    twists[: round(1.0 / STEP_S)] = 0.0
    rows = round(0.3 / STEP_S)
    return np.stack([np.convolve(column, np.ones(rows) / rows)[: len(column)] for column in twists.T], axis=1)


def wandering(rng, rows, columns, lasts_s=0.3):
    """Noise of size 1 that lasts for a while."""
    keep = np.exp(-STEP_S / lasts_s)
    noise = rng.standard_normal((rows, columns))
    for k in range(1, rows):
        noise[k] = keep * noise[k - 1] + np.sqrt(1 - keep**2) * noise[k]
    return noise


def rolled(twists, radius_m=RADIUS_M, lever_m=LEVER_M):
    """Rates of the four wheels [rad/s] for twists."""
    x, y, turn = twists[:, 0], twists[:, 1], lever_m * twists[:, 2]
    return np.stack([x - y - turn, x + y + turn, x + y - turn, x - y + turn], axis=1) / radius_m


def driven(rng, *, duration_s=60.0, slip=0.03, lasts_s=0.3, counts=210, noise_m=0.001, noise_rad=0.002, jitter_s=0.001,
           delay_s=0.0, plate=PLATE, fastest=FASTEST, radii=(1, 1, 1, 1), sideways=1.0):  # fmt: skip
    """A log of the drive: times, angles in whole counts, poses of the plate with noise, late by a delay.

    It goes so far sideways of what wheels say that roll without slip.
    """
    twists = commanded(rng, duration_s, fastest=fastest)
    slipped = 1.0 + slip * wandering(rng, len(twists), 4, lasts_s)
    angles = np.cumsum(rolled(twists) * slipped / np.array(radii), axis=0) * STEP_S
    twists = twists * [1.0, sideways, 1.0]
    yaw = np.cumsum(twists[:, 2]) * STEP_S
    middle = yaw - 0.5 * STEP_S * twists[:, 2]
    x = np.cumsum(np.cos(middle) * twists[:, 0] - np.sin(middle) * twists[:, 1]) * STEP_S
    y = np.cumsum(np.sin(middle) * twists[:, 0] + np.cos(middle) * twists[:, 1]) * STEP_S
    clock = STEP_S * np.arange(1, len(twists) + 1)
    times = np.arange(0.2, duration_s - 0.2, ROW_S)
    times += jitter_s * rng.standard_normal(len(times))

    def at(column, late=0.0):
        return np.interp(times - late, clock, column)

    count = 2 * np.pi / counts
    log = {"time_s": times}
    for k, name in enumerate(WHEELS):
        log[f"wheel_{name}_position_rad"] = np.floor(at(angles[:, k]) / count + rng.random()) * count
    # The room's axes are not those of the start.
    room, heading = 0.7, at(yaw, delay_s)
    px = at(x, delay_s) + np.cos(heading) * plate[0] - np.sin(heading) * plate[1]
    py = at(y, delay_s) + np.sin(heading) * plate[0] + np.cos(heading) * plate[1]
    log["pose_x_m"] = 1.5 + np.cos(room) * px - np.sin(room) * py + noise_m * rng.standard_normal(len(times))
    log["pose_y_m"] = -0.4 + np.sin(room) * px + np.cos(room) * py + noise_m * rng.standard_normal(len(times))
    turned = heading + plate[2] + room + noise_rad * rng.standard_normal(len(times))
    log["pose_yaw_rad"] = np.arctan2(np.sin(turned), np.cos(turned))
    return log
