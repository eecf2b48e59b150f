"""A firmware that lies: the campaign in Rust, started by the name of the emulator."""

import os
import shutil
from pathlib import Path

from campaign import Campaign, Setting, faults, run

# Five greetings of two seconds are waited for, then there may be last words of the emulator.
SECONDS = 20

HONEST = ("honest",)
# Each must end the run with an error; the words that may not be in it blame somebody else.
REFUSED = (
    "silent",
    "garbage",
    "endless_garbage",
    "endless_frame",
    "dies_at_once",
    "wrong_version",
    "wrong_wheels",
    "wrong_digest",
    "torque_1000",
    "torque_nan",
    "torque_inf",
    "stop_with_torque",
    "stale",
    "future",
    "flood_late",
    "flood_greetings",
    "garbage_later",
    "silent_later",
    "dies_later",
)
# Anything but a crash.
EITHER = ("estimate_nan",)


def campaigns(setting: Setting, attack: Path) -> list[Campaign]:
    """Every lie through `run --controller qemu`."""
    folder = setting.folder("firmware")
    emulator = folder / "bin/qemu-system-arm"
    emulator.parent.mkdir()
    emulator.symlink_to(attack)
    image = folder / "image"
    shutil.copy(setting.top / "LICENSE-MIT", image)
    failures = []
    for lie in (*HONEST, *REFUSED, *EITHER):
        command = [setting.omnistep, "run", "flat", "--controller", "qemu", "--firmware", image, "--quiet", "--json"]
        command += ["--set", "duration_s=0.3", "--set", "control.precision=f32", "--out", folder / lie]
        path = f"{emulator.parent}:{os.environ['PATH']}"
        ended = run(command, folder, seconds=SECONDS, env={"PATH": path, "OMNISTEP_LIE": lie})
        wrong = faults(ended, allowed=(0, 1, 2))
        if not wrong:
            if lie in HONEST and ended.code != 0:
                wrong.append(f"an honest firmware is refused: {ended.err.strip()[:150]}")
            if lie in REFUSED and ended.code == 0:
                wrong.append(f"believed: {ended.out.strip()[:100]}")
            if "diverged" in ended.err:
                wrong.append(f"the physics are blamed: {ended.err.strip()[:150]}")
            if lie.startswith("garbage") and "no answer" in ended.err:
                wrong.append(f"garbage is no silence: {ended.err.strip()[:150]}")
        if wrong:
            failures.append(f"OMNISTEP_LIE={lie} {ended.command}: {'; '.join(wrong)}")
    return [Campaign("firmware that lies", len(HONEST + REFUSED + EITHER), "lies", failures)]
