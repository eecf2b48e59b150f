"""States of `Simulation.save` with flipped bits, cut or turned: each is rejected, and none panics."""

from campaign import Campaign, Setting, in_python

FLIP = """
import random, sys
import omnistep

seed, count, keep = int(sys.argv[1]), int(sys.argv[2]), sys.argv[3]
chance = random.Random(seed)
scenarios = []
for engine in ("rapier", "articulated"):
    for more in ({}, {"vehicle": "mecanum4", "physics.wheel_model": "rollers"}):
        scenario = omnistep.Scenario("flat", overrides={"physics.engine": engine, **more})
        simulation = omnistep.Simulation(scenario)
        for _ in range(20):
            simulation.step((0.1, 0, 0))
        whole = simulation.save()
        omnistep.Simulation.resume(scenario, whole).step((0.1, 0, 0))  # the state that is damaged is a good one
        scenarios.append((scenario, whole))
for k in range(count):
    scenario, whole = scenarios[k % len(scenarios)]
    data = bytearray(whole)
    kind = chance.choice(("bit", "bit", "bit", "bit", "cut", "turned"))
    at = chance.randrange(len(data))
    if kind == "bit":
        data[at] ^= 1 << chance.randrange(8)
    elif kind == "cut":
        del data[at:]
    else:
        data = data[at:] + data[:at] if at else data[::-1]
    wrong = None
    try:
        resumed = omnistep.Simulation.resume(scenario, bytes(data))
        wrong = "resumed"
        for _ in range(30):
            resumed.step((0.1, 0, 0))
    except omnistep.OmnistepError as error:
        if not wrong and not 0 < len(str(error)) <= 300:
            wrong = f"a message of {len(str(error))} characters"
    except BaseException as error:
        wrong = f"{wrong or 'refused'}, {type(error).__name__}: {error}"[:200]
    if wrong:
        name = f"{keep}/state-{seed}-{k}"
        open(name, "wb").write(data)
        print("FAILED", name, kind, wrong.splitlines()[0], flush=True)
print("TRIED", count)
"""


def campaigns(setting: Setting) -> list[Campaign]:
    """Both engines, balls and rollers."""
    count = setting.count(500)
    wrong = in_python(setting, "snapshots", FLIP, "Simulation.resume", count)
    return [Campaign("damaged states of a simulation", count, "states", wrong)]
