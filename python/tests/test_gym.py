"""Environments for reinforcement learning: Gymnasium's own checks, and single and vector environments that agree."""

import copy
import os
import signal
import subprocess
import sys
import threading
import time
import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode

import omnistep
import omnistep.gym

TASKS = ("StepClimb", "Drive")
# Short episodes: two ends of time within a few steps.
SHORT = {"overrides": {"duration_s": 0.3, "physics.timestep_s": 0.001}, "frame_skip": 30}


def make(task, **kwargs):
    return gymnasium.make(f"omnistep/{task}-v0", **kwargs)


def make_vec(task, num_envs=3, **kwargs):
    mode = "vector_entry_point"
    return gymnasium.make_vec(f"omnistep/{task}-v0", num_envs=num_envs, vectorization_mode=mode, **kwargs)


def assert_same(one, other, where=""):
    """Every array, number and name, bit for bit."""
    assert type(one) is type(other), where
    if isinstance(one, dict):
        assert one.keys() == other.keys(), where
        for key in one:
            assert_same(one[key], other[key], f"{where}.{key}")
    elif isinstance(one, tuple) or (isinstance(one, np.ndarray) and one.dtype == object):
        for k, (a, b) in enumerate(zip(one, other, strict=True)):
            assert_same(a, b, f"{where}[{k}]")
    elif isinstance(one, np.ndarray):
        assert one.dtype == other.dtype, where
        np.testing.assert_array_equal(one, other, err_msg=where)
    else:
        assert one == other, where


@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize("render_mode", [None, "rgb_array"])
def test_gymnasium_s_own_checks_find_nothing(task, render_mode):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # Unwrapped, as the checker asks for: its own wrappers are what it would look at otherwise.
        check_env(make(task, render_mode=render_mode).unwrapped, skip_render_check=render_mode is None)


@pytest.mark.parametrize("task", TASKS)
def test_same_seed_and_actions_same_bits_other_seeds_other_episodes(task):
    def episode(seed):
        env = make(task)
        env.action_space.seed(3)
        rows = [env.reset(seed=seed), *(env.step(env.action_space.sample()) for _ in range(30)), env.reset()]
        assert all(env.observation_space.contains(row[0]) for row in rows)
        return rows

    one, again, other = episode(1), episode(1), episode(2)
    assert_same(tuple(one), tuple(again))
    assert one[0][1] != other[0][1]  # what was drawn
    assert not np.array_equal(one[30][0], other[30][0])
    assert one[0][1] != one[-1][1]  # the next episode of the same row is another one


@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
def test_the_vector_environment_is_gymnasium_s_vector_of_single_ones_bit_for_bit(task, mode):
    native = make_vec(task, autoreset_mode=mode, **SHORT)
    vectors = gymnasium.make_vec(
        f"omnistep/{task}-v0",
        num_envs=3,
        vectorization_mode="sync",
        vector_kwargs={"autoreset_mode": mode},
        **SHORT,
    )
    assert native.metadata["autoreset_mode"] is mode
    for name in ("observation_space", "action_space", "single_observation_space", "single_action_space"):
        assert getattr(native, name) == getattr(vectors, name)
    assert_same(native.reset(seed=5), vectors.reset(seed=5))
    native.action_space.seed(0)
    ends = 0
    for k in range(25):
        actions = native.action_space.sample()
        one, other = native.step(actions), vectors.step(actions)
        assert_same(one, other, f"step {k}: ")
        ends += int((one[2] | one[3]).sum())
    assert ends >= 6  # two episodes each: the ends were looked at too
    mask = np.array([True, False, True])
    assert_same(native.reset(seed=np.array([3, 1, 2])), vectors.reset(seed=[3, 1, 2]))
    assert_same(
        native.reset(seed=[7, None, None], options={"reset_mask": mask.copy()}),
        vectors.reset(seed=[7, None, None], options={"reset_mask": mask.copy()}),
    )


def test_the_number_of_threads_changes_no_bit():
    def run(threads):
        envs = make_vec("StepClimb", num_envs=5, threads=threads, **SHORT)
        envs.action_space.seed(1)
        return [envs.reset(seed=0), *(envs.step(envs.action_space.sample()) for _ in range(15))]

    assert_same(tuple(run(1)), tuple(run(3)))


def test_full_speed_ahead_climbs_three_centimetres_and_ends_the_episode():
    env = make("StepClimb")
    _, info = env.reset(seed=0, options={"height_m": 0.03, "friction": 0.8})
    assert (info["height_m"], info["friction"], info["is_success"]) == (0.03, 0.8, False)
    start_m, total, steps = info["x_m"], 0.0, 0
    assert abs(start_m) <= 0.02
    terminated = truncated = False
    assert "crossing_s" not in info
    while not (terminated or truncated):
        _, reward, terminated, truncated, info = env.step(np.array([1, 0, 0, 0, 0], np.float32))
        total, steps = total + reward, steps + 1
    assert (terminated, truncated, info["is_success"]) == (True, False, True)
    # 0.66 m from the first wheel's touch to the last wheel's stand, at 0.3 m/s, and some tenths for the bumps.
    assert info["crossing_s"] == pytest.approx(2.3, abs=0.3)
    assert info["time_s"] == pytest.approx(steps * 0.05, abs=1e-9)
    # A metre forward is worth 1, success 2, effort little; the heading is at most some hundredths of a radian off.
    assert total == pytest.approx(info["x_m"] - start_m + 2.0 - 0.1 * info["effort_s"], abs=0.25)


def test_torque_on_the_rear_row_pushes_the_vehicle_on_and_none_leaves_it_standing():
    moved = []
    for added in (0.0, 1.0):
        env = make("StepClimb")
        _, info = env.reset(seed=0)
        x_m = info["x_m"]
        for _ in range(10):
            *_, info = env.step(np.array([0, 0, 0, 0, added], np.float32))
        moved.append(info["x_m"] - x_m)
    assert abs(moved[0]) < 1e-3  # it sinks into the contacts, no more
    # 2 wheels at 1 N.m against the controller, whose k_i undoes it within some tenths of a second.
    assert moved[1] > 0.01


def test_time_out_truncates_and_a_step_after_the_end_is_refused():
    env = make("Drive", **SHORT).unwrapped
    env.reset(seed=0)
    ends = [env.step(np.zeros(7, np.float32))[2:4] for _ in range(10)]
    assert ends == [(False, False)] * 9 + [(False, True)]
    with pytest.raises(omnistep.ConfigError, match=r"after the end of an episode.* allowed: only after reset"):
        env.step(np.zeros(7, np.float32))
    env.reset()
    env.step(np.zeros(7, np.float32))


def test_a_hand_made_torque_loop_follows_the_twist_and_is_paid_for_it():
    env = make("Drive")
    seen, info = env.reset(seed=4)
    target = np.array([info["vx_m_s"], info["vy_m_s"], info["wz_rad_s"]])
    np.testing.assert_allclose(seen[8:11] * (1.0, 1.0, 2.0), target, atol=1e-6)
    layout = omnistep.Layout.chugo7(r1_m=0.30, r2_m=0.23, radius_m=0.066)
    wanted = omnistep.Kinematics(layout=layout).inverse(target)
    rewards = []
    truncated = False
    while not truncated:
        # The encoders are scaled by 20 rad/s; 0.5 N.m, a quarter of the motors' 2 N.m, is 1.
        action = 0.3 * (wanted - 20.0 * seen[:7]) / 0.5
        seen, reward, terminated, truncated, info = env.step(np.clip(action, -1, 1).astype(np.float32))
        assert not terminated
        rewards.append(reward)
    assert len(rewards) == 200  # 4 s, held for 20 ms
    assert info["is_success"]
    # Proportional control alone lags where the vehicle needs a force: here the centripetal one, 20 kg v w.
    assert info["error"] < 0.15
    effort = 0.05 * np.mean(np.square(action))
    assert rewards[-1] == pytest.approx(np.exp(-(info["error"] ** 2)) - effort, abs=1e-6)  # actions are of float32
    assert rewards[0] < 0.9 < rewards[-1]


def test_observations_are_what_sensors_tell_and_do_not_tell_the_step():
    low, high = (make("StepClimb").reset(seed=0, options={"height_m": h, "friction": 0.7})[0] for h in (0.02, 0.06))
    np.testing.assert_array_equal(low, high)
    assert low.shape == (7 + 7 + 2 + 2 + 4 + 1 + 5,)


@pytest.mark.parametrize(
    ("make_it", "key", "message"),
    [
        (lambda: make("StepClimb", height_m=(0.06, 0.02)), "height_m", "allowed: the lower end first"),
        (lambda: make("StepClimb", height_m=(0.02, 0.5)), "height_m", "height_m = 0.5, allowed: 0.001 to 0.2"),
        (lambda: make("StepClimb", friction=0.7), "friction", "friction = 0.7, allowed: the two ends of a range"),
        (lambda: make("StepClimb", scenario="ramp"), "terrain.kind", 'allowed: "step"'),
        (lambda: make("Drive", frame_skip=0), "frame_skip", "frame_skip = 0, allowed: 1 to 1000"),
        (lambda: make("Drive").reset(seed=2**63), "seed", "seed = 9223372036854775808, allowed: 0 to"),
        (
            lambda: make("Drive").reset(options={"height_m": 1}),
            "height_m",
            "unknown, allowed: vx_m_s, vy_m_s, wz_rad_s",
        ),
        (lambda: make("Drive").reset(options={"vx_m_s": "fast"}), "vx_m_s", "vx_m_s = 'fast', allowed: a number"),
        (lambda: make_vec("Drive", num_envs=0), "num_envs", "num_envs = 0, allowed: 1 to 65536"),
        (lambda: make_vec("Drive", autoreset_mode="soon"), "autoreset_mode", "allowed: NextStep, SameStep, Disabled"),
        (lambda: make_vec("Drive").reset(seed=1.5), "seed", "seed = 1.5, allowed: 0 to 9223372036854775807, or None"),
        (lambda: make_vec("Drive").reset(seed=[1]), "seed", "seed = 1 values, allowed: one for each environment"),
        (lambda: stepped(np.zeros((2, 7))), "actions", r"shape \(2, 7\), allowed: shape \(3, 7\)"),
        (lambda: stepped(np.full((3, 7), np.nan)), "action", "action = NaN, allowed: finite numbers, -1 to 1"),
    ],
)
def test_what_cannot_be_is_refused_with_its_name_and_what_is_allowed(make_it, key, message):
    with pytest.raises(omnistep.ConfigError, match=message) as caught:
        make_it()
    assert caught.value.key == key
    assert "\n" not in str(caught.value)


def stepped(actions):
    envs = make_vec("Drive")
    envs.reset(seed=0)
    return envs.step(actions)


def test_a_refused_step_changes_nothing():
    one, other = make_vec("StepClimb", **SHORT), make_vec("StepClimb", **SHORT)
    for envs in (one, other):
        envs.reset(seed=0)
    actions = np.full((3, 5), 0.5, np.float32)
    wrong = actions.copy()
    wrong[2, 1] = np.inf
    with pytest.raises(omnistep.ConfigError, match="action = inf"):
        one.step(wrong)
    assert_same(one.step(actions), other.step(actions))


def test_other_threads_run_while_environments_step():
    envs = make_vec("StepClimb", num_envs=4, frame_skip=1000)
    envs.reset(seed=0)
    stop, turns = threading.Event(), 0

    def count():
        nonlocal turns
        while not stop.is_set():
            turns += 1
            time.sleep(0)  # lets the lock go

    thread = threading.Thread(target=count)
    interval = sys.getswitchinterval()
    # The lock is not requested in the next minute: the thread runs where this one lets it go, or not at all.
    sys.setswitchinterval(60.0)
    try:
        thread.start()
        before = turns
        envs.step(np.zeros((4, 5), np.float32))
        during = turns - before
    finally:
        sys.setswitchinterval(interval)
        stop.set()
        thread.join()
    # A step of some 100 ms, a turn of microseconds.
    assert during > 10


def rows_of_wheels(picture):
    """Rows of wheels in a picture: their first and last column and line of pixels, (rows, 2) each."""
    blue = np.abs(picture.astype(int) - (0x00, 0x72, 0xB2)).max(axis=2) < 60  # lines are a pixel wide and smoothed
    columns = np.flatnonzero(blue.any(axis=0))
    rows = np.split(columns, np.flatnonzero(np.diff(columns) > 3) + 1)
    lines = [np.flatnonzero(blue[:, row[0] : row[-1] + 1].any(axis=1)) for row in rows]
    return np.array([row[[0, -1]] for row in rows]), np.array([line[[0, -1]] for line in lines])


def riser(picture):
    """The column of pixels where the grey ground rises, and by how many pixels."""
    grey = np.abs(picture.astype(int) - 204).max(axis=2) < 3
    columns = np.flatnonzero(grey.sum(axis=0) > 20)  # ground, and no letter
    tops = grey[:, columns].argmax(axis=0)
    where = int(np.flatnonzero(tops < tops[0] - 8)[0])
    return columns[where], tops[0] - tops[-1]


def test_pictures_show_the_vehicle_move():
    env = make("StepClimb", render_mode="rgb_array")
    _, before = env.reset(seed=0, options={"height_m": 0.05, "friction": 0.8})
    one = env.render()
    assert (one.dtype, one.shape) == (np.uint8, (320, 640, 3))
    columns, lines = rows_of_wheels(one)
    assert len(columns) == 3  # front, middle and rear, from the side
    rear, middle, front = columns.mean(axis=1)
    scale = 0.60 / (front - rear)  # metres a pixel: 2 R1
    # To a pixel at each end: 1.6 m are 537 of them, so 3 mm is one.
    assert (middle - rear) * scale == pytest.approx(0.30, abs=0.006)
    assert np.ptp(columns, axis=1) * scale == pytest.approx(np.full(3, 0.132), abs=0.009)
    assert np.ptp(lines[:, 1]) <= 1  # on level ground
    at, height = riser(one)
    assert (at - middle) * scale == pytest.approx(0.70 - before["x_m"], abs=0.009)
    assert height * scale == pytest.approx(0.05, abs=0.006)
    for _ in range(20):
        *_, info = env.step(np.array([1, 0, 0, 0, 0], np.float32))
    # The picture goes with the vehicle: the step comes nearer.
    columns, _ = rows_of_wheels(two := env.render())
    assert (at - riser(two)[0]) * scale == pytest.approx(info["x_m"] - before["x_m"], abs=0.009)
    assert info["x_m"] - before["x_m"] > 0.2
    for _ in range(20):
        *_, info = env.step(np.array([1, 0, 0, 0, 0], np.float32))
    _, lines = rows_of_wheels(env.render())
    assert (lines[0, 1] - lines[2, 1]) * scale == pytest.approx(0.05, abs=0.006)  # the front row is up


def test_pictures_from_above_show_every_wheel():
    envs = make_vec("Drive", render_mode="rgb_array", num_envs=2)
    envs.reset(seed=0)
    for picture in envs.render():
        assert (picture.dtype, picture.shape) == (np.uint8, (320, 640, 3))
        columns, lines = rows_of_wheels(picture)
        scale = 0.60 / (columns[2].mean() - columns[0].mean())
        # Outer rows: wheels 2 R2 = 0.46 m apart, and a diameter; the middle one stands alone.
        assert np.ptp(lines, axis=1) * scale == pytest.approx([0.592, 0.132, 0.592], abs=0.009)


def test_ids_are_found_by_module_and_gymnasium_stays_an_extra():
    found = "import gymnasium; print(gymnasium.make('omnistep.gym:omnistep/Drive-v0').spec.id)"
    missing = "import sys; sys.modules['gymnasium'] = None; import omnistep; import omnistep.gym"
    done = subprocess.run([sys.executable, "-c", found], capture_output=True, text=True, check=True, cwd="/")
    assert done.stdout.strip() == "omnistep/Drive-v0"
    failed = subprocess.run([sys.executable, "-c", missing], capture_output=True, text=True, check=False, cwd="/")
    assert failed.stderr.strip().splitlines()[-1] == (
        'ImportError: omnistep.gym needs Gymnasium: pip install "omnistep[learn]"'
    )


def test_specs_are_kept_and_make_the_same_environment_again():
    env = make("StepClimb", height_m=(0.03, 0.04))
    again = gymnasium.make(copy.deepcopy(env.spec))
    assert_same(env.reset(seed=1), again.reset(seed=1))
    assert env.unwrapped.ranges == {"height_m": (0.03, 0.04), "friction": (0.5, 0.9)}


@pytest.mark.skipif(not hasattr(os, "fork"), reason="this system has no fork")
def test_environments_of_a_process_that_was_forked_have_threads_again():
    envs = omnistep.gym.DriveVectorEnv(2, threads=2)
    envs.reset(seed=0)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of Python: it has threads itself
        child = os.fork()
    if child == 0:
        envs.step(np.zeros(envs.action_space.shape, np.float32))
        os._exit(7)
    for _ in range(100):
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            break
        time.sleep(0.1)
    else:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
    assert done and os.waitstatus_to_exitcode(status) == 7


def test_a_heading_is_off_by_less_than_half_a_turn_wherever_the_vehicle_faces():
    for seed in range(4):
        env = omnistep.gym.StepClimbEnv(overrides={"start.heading_rad": 3.14159})
        observation, _ = env.reset(seed=seed)
        # Headings differ by 0.03 rad, of a scale of 0.5 rad.
        assert abs(observation[20]) < 0.1
        _, reward, *_ = env.step(np.zeros(5, np.float32))
        assert abs(reward) < 0.02


def test_what_is_drawn_for_every_episode_is_not_to_be_overridden():
    with pytest.raises(omnistep.ConfigError, match=r"allowed: height_m=\(low, high\)"):
        omnistep.gym.StepClimbEnv(overrides={"terrain.height_m": 0.1})
