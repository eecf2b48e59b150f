"""What campaigns share: limits on what is run, and what passes."""

import os
import random
import shlex
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

MEMORY_KIB = 2 << 20  # 2 GB of address space
SECONDS = 10
LONGEST_MESSAGE = 300  # characters

T = TypeVar("T")


@dataclass
class Campaign:
    """What was tried and what failed; each failure says how to see it again."""

    name: str
    tried: int = 0
    unit: str = "inputs"
    failures: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


@dataclass(frozen=True)
class Setting:
    """Where and how much."""

    omnistep: Path
    top: Path
    work: Path
    """A folder for what is needed while a campaign runs."""
    keep: Path
    """A folder for inputs that made it fail."""
    seed: int
    long: bool

    def count(self, quick: int) -> int:
        """This many in the quick campaign, ten times as many in the long one."""
        return 10 * quick if self.long else quick

    def random(self, name: str) -> random.Random:
        """The same for the same seed and name."""
        return random.Random(f"{self.seed} {name}")

    def folder(self, name: str) -> Path:
        """A new folder in `work`."""
        path = self.work / name
        path.mkdir(parents=True)
        return path

    def kept(self, path: Path) -> Path:
        """The file, copied to where it stays."""
        return Path(shutil.copy(path, self.keep / path.name))


@dataclass(frozen=True)
class Ended:
    """How a program ended."""

    command: str
    code: int | None
    """None where it did not end in time, negative for a signal."""
    out: str
    err: str
    seconds: float


def limited(command: Sequence[object], kib: int = MEMORY_KIB, extra: str = "") -> list[str]:
    """The command under a limit of memory, without core files."""
    limits = f"ulimit -c 0; ulimit -v {kib}; {extra}"
    return ["sh", "-c", f'{limits} exec "$@"', "sh", *map(str, command)]


def run(
    command: Sequence[object],
    cwd: Path,
    seconds: float = SECONDS,
    extra: str = "",
    env: dict[str, str] | None = None,
) -> Ended:
    """Runs it to its end, or until the time is over."""
    start = time.monotonic()
    said = " ".join(shlex.quote(str(word)) for word in command)
    process = subprocess.Popen(
        limited(command, extra=extra),
        cwd=cwd,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        env=os.environ | (env or {}),
        start_new_session=True,
    )
    try:
        out, err = process.communicate(timeout=seconds)
        code: int | None = process.returncode
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)  # a session of its own: children too
        out, err = process.communicate()
        code = None
    if extra:
        said = f"({extra} {said})"
    return Ended(said, code, out.decode(errors="replace"), err.decode(errors="replace"), time.monotonic() - start)


def shown(err: str) -> str:
    """The first and the last line, in one."""
    lines = [line.strip() for line in err.splitlines() if line.strip()] or [""]
    return " ... ".join(dict.fromkeys((lines[0][:150], lines[-1][:150])))


def faults(ended: Ended, allowed: Iterable[int] = (0, 1, 2)) -> list[str]:
    """What is wrong with how it ended: a signal, a hang, a panic, a message that is missing or too long."""
    if ended.code is None:
        return [f"no end within {ended.seconds:.0f} s"]
    if ended.code < 0 or (ended.code > 128 and ended.code not in allowed):
        number = -ended.code if ended.code < 0 else ended.code - 128
        try:
            name = signal.Signals(number).name
        except ValueError:
            name = f"exit code {ended.code}"
        return [f"{name}: {shown(ended.err)}"]
    wrong = []
    if ended.code not in allowed:
        wrong.append(f"exit code {ended.code}")
    # "out of memory" is no panic, but 2 GB for a file are too much.
    for word in ("panicked at", "Traceback (most", "overflowed its stack", "out of memory", "annot allocate memory"):
        if word in ended.err:
            wrong.append(f'"{word}": {shown(ended.err)}')
    lines = ended.err.splitlines()
    longest = max(map(len, lines), default=0)
    if longest > LONGEST_MESSAGE:
        wrong.append(f"a message of {longest} characters: {max(lines, key=len)[:100]}...")
    if ended.code in (1, 2) and not lines:
        wrong.append(f"exit code {ended.code} without a word")
    return wrong


def in_python(setting: Setting, name: str, program: str, call: str, count: int) -> list[str]:
    """What fails of a program of Python in `scripts/attack/NAME.py`: it prints FAILED for each, and TRIED at its end.

    It is given the seed, the count, and the folder for what made it fail.
    """
    command = [sys.executable, "-c", program, setting.seed, count, setting.keep]
    ended = run(command, setting.folder(name), seconds=60 + count // 10)
    lines = ended.out.splitlines()
    wrong = [f"{call}: {line.removeprefix('FAILED ')}" for line in lines if line.startswith("FAILED")]
    if f"TRIED {count}" not in ended.out:
        why = "; ".join(faults(ended)) or ended.err[-200:]
        wrong.append(f"scripts/attack/{name}.py, seed {setting.seed}: {why}")
    return wrong


def in_parallel(work: Callable[[T], str | None], items: Iterable[T]) -> tuple[int, list[str]]:
    """As many at a time as there are cores; how many were tried, and what failed."""
    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        results = list(pool.map(work, items))
    return len(results), [failure for failure in results if failure]
