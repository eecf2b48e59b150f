"""Pickles of others, as far as they name only this package's types."""

from campaign import Campaign, Setting, in_python

# An unpickler that finds nothing but omnistep: what pickle itself allows is no fault of ours.
MUTATE = """
import io, pickle, random, sys
import numpy
import omnistep

seed, count, keep = int(sys.argv[1]), int(sys.argv[2]), sys.argv[3]
ALLOWED = (ValueError, TypeError, OverflowError, AttributeError, EOFError, ImportError, IndexError, KeyError,
           MemoryError, UnicodeError, pickle.UnpicklingError, omnistep.OmnistepError)


class Ours(pickle.Unpickler):
    def find_class(self, module, name):
        if module.split(".")[0] != "omnistep" and (module, name) != ("builtins", "getattr"):
            raise pickle.UnpicklingError(module)
        return super().find_class(module, name)


scenario = omnistep.Scenario("flat", overrides={"duration_s": 0.01, "vehicle": "omni3"})
run = omnistep.run(scenario)
things = [scenario, scenario.vehicle, run, run.outcome]


def use(thing):
    repr(thing)
    pickle.dumps(thing)
    for name in getattr(thing, "names", []):
        numpy.asarray(thing[name]).sum()
    for name in getattr(thing, "wheel_signals", []):
        thing.wheels(name).sum()
    for name in dir(thing):
        if not name.startswith("_"):
            getattr(thing, name)


chance = random.Random(seed)
plain = [pickle.dumps(thing, protocol=4) for thing in things]
for data in plain:
    use(Ours(io.BytesIO(data)).load())
for k in range(count):
    kind = k % len(plain)
    data = bytearray(plain[kind])
    for _ in range(chance.choice((1, 1, 2, 8))):
        # Numbers of rows and lengths are at the ends.
        at = chance.choice((chance.randrange(len(data)), chance.randrange(min(len(data), 3000)),
                            len(data) - 1 - chance.randrange(min(len(data), 3000))))
        choice = chance.randrange(4)
        if choice == 0:
            data[at] ^= 1 << chance.randrange(8)
        elif choice == 1:
            data[at] = chance.choice((0, 1, 0x7F, 0x80, 0xFF))
        elif choice == 2:
            del data[at:at + chance.choice((1, 1, 8))]
        else:
            data[at:at] = bytes([chance.randrange(256)])
    wrong = None
    try:
        use(Ours(io.BytesIO(bytes(data))).load())
    except ALLOWED as error:
        if len(str(error)) > 300:
            wrong = f"a message of {len(str(error))} characters"
    except BaseException as error:
        wrong = f"{type(error).__name__}: {error}"[:200]
    if wrong:
        name = f"{keep}/pickle-{seed}-{k}.pickle"
        open(name, "wb").write(data)
        print("FAILED", name, wrong.splitlines()[0], flush=True)
print("TRIED", count)
"""


def campaigns(setting: Setting) -> list[Campaign]:
    """Scenario, vehicle, run and outcome with changed bytes: an exception of a usual kind, or something that works."""
    count = setting.count(3000)
    wrong = in_python(setting, "pickles", MUTATE, "pickle.load", count)
    return [Campaign("pickles of Scenario, Trace and others", count, "pickles", wrong)]
