"""A firmware that lies: the campaign in Rust, started by the name of the emulator."""

import os
import shutil
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from campaign import Campaign, Setting, faults, run, shown

# Five greetings of two seconds are waited for, or eleven answers; then there may be last words of the emulator. Twice
# that for a busy machine.
SECONDS = 50

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
    "estimate_nan",
)


def campaigns(setting: Setting, attack: Path) -> list[Campaign]:
    """Every lie through `run --controller qemu`."""
    folder = setting.folder("firmware")
    emulator = folder / "bin/qemu-system-arm"
    emulator.parent.mkdir()
    emulator.symlink_to(attack)
    image = folder / "image"
    shutil.copy(setting.top / "LICENSE-MIT", image)

    def lied(lie: str) -> str | None:
        command = [
            setting.omnistep,
            "run",
            "flat",
            "--controller",
            "qemu",
            "--firmware",
            image.name,
            "--quiet",
            "--json",
        ]
        command += ["--set", "duration_s=0.3", "--set", "control.precision=f32", "--out", lie]
        path = f"{emulator.parent}:{os.environ['PATH']}"
        ended = run(command, folder, seconds=SECONDS, env={"PATH": path, "OMNISTEP_LIE": lie})
        wrong = faults(ended)
        if not wrong:
            if lie in HONEST and ended.code != 0:
                wrong.append(f"an honest firmware is refused: {shown(ended.err)}")
            if lie in REFUSED and ended.code == 0:
                wrong.append(f"believed: {ended.out.strip()[:100]}")
            if "diverged" in ended.err:
                wrong.append(f"the physics are blamed: {shown(ended.err)}")
            if lie.startswith("garbage") and "no answer" in ended.err:
                wrong.append(f"garbage is no silence: {shown(ended.err)}")
        return f"OMNISTEP_LIE={lie} {ended.command}: {'; '.join(wrong)}" if wrong else None

    # Side by side: most of them wait.
    lies = (*HONEST, *REFUSED)
    with ThreadPoolExecutor(len(lies)) as pool:
        failures = [failure for failure in pool.map(lied, lies) if failure]
    return [Campaign("firmware that lies", len(lies), "lies", failures)]
