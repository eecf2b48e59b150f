"""Loops in Python whose memory may not grow."""

import sys

from campaign import Campaign, Setting, faults, run

# Each loop is long enough that the loss of its smallest object a round would be seen: 2,000 rounds of 1 kB (a message,
# an exception with its frames), 5,000 of 400 bytes, 20,000 of 100 (an array without data). What the allocator itself
# keeps stays below 1 MB.
BOUND_KB = 2_000

LOOPS = {
    "steps": (5_000, "for _ in range(n): simulation.step((0.2, 0, 0))"),
    "columns": (20_000, "for _ in range(n): trace['pose_x_m']"),
    "controller": (20_000, "for _ in range(n): kinematics.forward(velocities)"),
    "errors": (5_000, "for _ in range(n):\n    try: omnistep.Scenario('flat', overrides={'duration_s': -1})\n"
               "    except omnistep.ConfigError: pass"),
    "scenarios": (2_000, "for _ in range(n): omnistep.Scenario('flat')"),
    "runs": (60, "for _ in range(n): omnistep.run(short)"),
    "logs": (60, "for _ in range(n): omnistep.run(short, mcap='leak.mcap'); omnistep.read_mcap('leak.mcap')"),
    "damaged logs": (500, "for _ in range(n):\n    try: omnistep.read_mcap('damaged.mcap')\n"
                     "    except omnistep.LogError: pass"),
    "pickles": (300, "for _ in range(n): pickle.loads(pickle.dumps(trace))"),
}  # fmt: skip

LOOP = """
import gc, pickle, sys
import numpy, omnistep

def resident_kb():
    return int(open("/proc/self/statm").read().split()[1]) * 4

short = omnistep.Scenario("flat", overrides={"duration_s": 0.02})
trace = omnistep.run(short)
simulation = omnistep.Simulation("flat", record=False)  # else every period is kept, which is meant
kinematics = omnistep.Kinematics(layout=omnistep.Layout.mecanum4(wheelbase_m=0.6, track_m=0.4, radius_m=0.1))
velocities = numpy.ones(4)
omnistep.run(short, mcap="damaged.mcap")
data = bytearray(open("damaged.mcap", "rb").read())
data[len(data) // 2] ^= 1
open("damaged.mcap", "wb").write(data)
code, n = compile(sys.argv[1], "loop", "exec"), int(sys.argv[2])
names = globals()
def loop(count):
    names["n"] = count
    exec(code, names)
    gc.collect()
loop(max(n // 4, 10))
before = resident_kb()
loop(n)
print(resident_kb() - before)
"""


def campaigns(setting: Setting) -> list[Campaign]:
    """Every loop in an interpreter of its own, after a quarter of it to warm up."""
    folder = setting.folder("leaks")
    failures, notes = [], []
    for name, (count, code) in LOOPS.items():
        ended = run(
            [sys.executable, "-c", LOOP, code, setting.count(count)], folder, seconds=600 if setting.long else 120
        )
        if wrong := faults(ended, allowed=(0,)):
            failures.append(f"{name}: {'; '.join(wrong)} {ended.err.strip()[-150:]}")
            continue
        grown = int(ended.out)
        notes.append(f"{name} {grown:+d} kB")
        if grown > BOUND_KB:
            failures.append(f"{name}: {setting.count(count)} times: {grown} kB more, allowed {BOUND_KB}")
    return [Campaign("leaks in Python", len(LOOPS), "loops", failures, [", ".join(notes)])]
