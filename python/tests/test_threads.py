"""One simulation, many threads: their calls wait for each other, none is refused, none is lost."""

import signal
import subprocess
import sys
import threading

import numpy as np

import omnistep

COMMAND = (0.2, 0.0, 0.0)


def together(threads, work):
    """Do the same on several threads at once; what each of them raised or returned."""
    gate, done = threading.Barrier(threads), [None] * threads

    def one(number):
        gate.wait()
        try:
            done[number] = work(number)
        except BaseException as error:
            done[number] = error

    each = [threading.Thread(target=one, args=(number,)) for number in range(threads)]
    for thread in each:
        thread.start()
    for thread in each:
        thread.join()
    return done


def test_steps_of_eight_threads_on_one_simulation_queue_and_are_those_of_one_thread():
    shared, alone = omnistep.Simulation("flat"), omnistep.Simulation("flat")
    done = together(8, lambda _: [shared.step(COMMAND).time_s for _ in range(100)])
    assert all(isinstance(times, list) for times in done), done
    # Each of the 800 periods was computed once.
    np.testing.assert_allclose(
        sorted(time_s for times in done for time_s in times), np.arange(1, 801) * 1e-3, rtol=0.0, atol=1e-12
    )
    for _ in range(800):
        last = alone.step(COMMAND)
    # The same command every time: it does not matter who gave it.
    assert shared.time_s == alone.time_s == 0.8
    np.testing.assert_array_equal(shared.measured_rad_s, alone.measured_rad_s)
    np.testing.assert_array_equal(shared.step(COMMAND).applied_n_m, alone.step(COMMAND).applied_n_m)
    assert last.time_s == 0.8


def test_steps_of_eight_threads_on_one_controller_queue_and_are_those_of_one_thread():
    shared, alone = (
        omnistep.Controller("flat", policy="scale_references"),
        omnistep.Controller("flat", policy="scale_references"),
    )
    measured = np.full(7, 0.1)
    done = together(8, lambda _: [shared.step(COMMAND, measured).i_n_m.copy() for _ in range(3000)])
    assert all(isinstance(integrals, list) for integrals in done), [each for each in done if not isinstance(each, list)]
    # Each of the 24000 steps was computed once: the integrals are those of one thread.
    expected = [alone.step(COMMAND, measured).i_n_m for _ in range(24_000)]
    found = np.array([each for integrals in done for each in integrals])
    np.testing.assert_array_equal(np.sort(found, axis=0), np.sort(np.array(expected), axis=0))

    def reset_and_step(number):
        for _ in range(200):
            if number % 2:
                shared.reset()
            else:
                shared.step(COMMAND, measured)

    assert together(8, reset_and_step) == [None] * 8


def test_reading_stepping_and_showing_at_once_is_never_refused():
    simulation = omnistep.Simulation("flat")

    def work(number):
        for _ in range(50):
            if number % 4 == 0:
                simulation.step_torques(np.zeros(7))
            elif number % 4 == 1:
                assert simulation.measured_rad_s.shape == (7,)
            elif number % 4 == 2:
                assert 0.0 <= simulation.time_s <= 0.1 + 1e-12
                assert repr(simulation).startswith("<omnistep.Simulation of flat")
            else:
                assert simulation.command_at(1.0) == (0.3, 0.0, 0.0)

    assert together(8, work) == [None] * 8
    assert simulation.time_s == 0.1


def test_long_arrays_leave_the_interpreter_to_others():
    """The interpreter is not handed over on request here: another thread runs only where a call lets it."""
    wheels, rows = np.ones((1_000_000, 8)), np.ones((2_000_000, 3))
    numbers = np.ones(5_000_000)
    calls = [
        lambda: omnistep.disturbed_ratio(numbers, numbers),
        lambda: omnistep.speed_ratio_std(wheels, wheels),
        lambda: omnistep.torque_factor(wheels, lower_n_m=-wheels[0], upper_n_m=wheels[0]),
        lambda: omnistep.at_point(rows, [0.1, 0.2]),
        lambda: omnistep.to_world(rows, 0.5),
        lambda: omnistep.discretize(rows, dt_s=0.01),
        lambda: omnistep.moved_by(rows, rows),
    ]
    ran, over = [], threading.Event()

    def other():
        while not over.wait(0.0005):
            ran.append(1)

    thread, interval = threading.Thread(target=other), sys.getswitchinterval()
    sys.setswitchinterval(100.0)
    try:
        thread.start()
        for call in calls:
            before = len(ran)
            call()
            assert len(ran) > before
    finally:
        sys.setswitchinterval(interval)
        over.set()
        thread.join()


def test_bad_input_of_one_thread_is_an_error_there_and_the_others_go_on():
    simulation = omnistep.Simulation("flat")
    done = together(8, lambda number: simulation.step((np.nan, 0.0, 0.0) if number == 3 else COMMAND).time_s)
    assert isinstance(done[3], omnistep.errors.ConfigError)
    assert sorted(done[:3] + done[4:]) == [k * 1e-3 for k in range(1, 8)]


STUCK = """
import sys, threading
import omnistep
simulation = omnistep.Simulation("flat")
ended = threading.Event()
def work():
    while not ended.is_set():
        simulation.step((0.2, 0.0, 0.0))
threads = [threading.Thread(target=work) for _ in range(7)]
for thread in threads:
    thread.start()
try:
    print("going", flush=True)
    while True:
        simulation.step((0.2, 0.0, 0.0))
except KeyboardInterrupt:
    ended.set()
    for thread in threads:
        thread.join()
    print("stopped", flush=True)
    sys.exit(130)
"""


def test_ctrl_c_reaches_a_thread_that_waits_for_others():
    process = subprocess.Popen([sys.executable, "-c", STUCK], stdout=subprocess.PIPE, text=True)
    assert process.stdout.readline() == "going\n"
    process.send_signal(signal.SIGINT)
    said, _ = process.communicate(timeout=60.0)
    assert (process.returncode, said) == (130, "stopped\n")
