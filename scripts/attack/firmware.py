"""A firmware that lies: the campaign in Rust, started by the name of the emulator."""

import os
import shlex
import shutil
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from campaign import Campaign, Setting, faults, run, shown

# Five greetings of two seconds are waited for, or eleven answers; then there may be last words of the emulator. Twice
# that for a busy machine.
SECONDS = 50

HONEST = ("honest",)
# Each must end the run with an error; the words that may not be in it blame something else.
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
# A drive's besides: what it says of its mode, of its wheels and of its pose.
REFUSED_OF_A_DRIVE = (
    "drive_mode_4",
    "drive_mode_255",
    "drive_degraded",
    "drive_safe_stop",
    "drive_emergency_stop",
    "drive_shorts_motors",
    "drive_shorts_motors_in_an_emergency",
    "drive_leaves_a_safe_stop",
    "drive_normal_without_wheels",
    "drive_normal_without_a_wheel",
    "drive_fault_6",
    "drive_fault_255",
    "drive_fault_of_a_driven_wheel",
    "drive_fault_of_an_active_wheel",
    "drive_motion_unknown",
    "drive_pose_nan",
    "drive_pose_inf",
    "drive_pose_far",
    "drive_pose_jumps",
    "drive_pose_turned",
    "drive_pose_stands",
    "drive_of_loops",
    "drive_more_wheels",
    "drive_fewer_wheels",
)
# The table that it is built with, every part of a drive on.
DRIVE = "{slip={},faults={},noise={}}"


def campaigns(setting: Setting, attack: Path) -> list[Campaign]:
    """Every lie through `run --controller qemu`."""
    folder = setting.folder("firmware")
    emulator = folder / "bin/qemu-system-arm"
    emulator.parent.mkdir()
    emulator.symlink_to(attack)
    image = folder / "image"
    shutil.copy(setting.top / "LICENSE-MIT", image)

    def lied(lie: str, drive: str | None) -> str | None:
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
        command += ["--set", "duration_s=0.3", "--set", "control.precision=f32", "--out", f"{lie}-{bool(drive)}"]
        env = {"PATH": f"{emulator.parent}:{os.environ['PATH']}", "OMNISTEP_LIE": lie}
        if drive:
            command += ["--set", f"drive={drive}"]
            env["OMNISTEP_DRIVE"] = drive
        ended = run(command, folder, seconds=SECONDS, env=env)
        wrong = faults(ended)
        if not wrong:
            if lie in HONEST and ended.code != 0:
                wrong.append(f"an honest firmware is refused: {shown(ended.err)}")
            if lie not in HONEST and ended.code == 0:
                wrong.append(f"accepted: {ended.out.strip()[:100]}")
            if "diverged" in ended.err:
                wrong.append(f"the physics are blamed: {shown(ended.err)}")
            if lie.startswith("garbage") and "no answer" in ended.err:
                wrong.append(f"garbage is no silence: {shown(ended.err)}")
        shown_env = " ".join(f"{name}={shlex.quote(text)}" for name, text in env.items() if name != "PATH")
        return f"{shown_env} {ended.command}: {'; '.join(wrong)}" if wrong else None

    def campaign(name: str, lies: tuple[str, ...], drive: str | None) -> Campaign:
        # Side by side: most of them wait.
        with ThreadPoolExecutor(len(lies)) as pool:
            failures = [failure for failure in pool.map(lambda lie: lied(lie, drive), lies) if failure]
        return Campaign(name, len(lies), "lies", failures)

    return [
        campaign("firmware that lies", (*HONEST, *REFUSED), None),
        campaign("firmware of a drive that lies", (*HONEST, *REFUSED, *REFUSED_OF_A_DRIVE), DRIVE),
    ]
