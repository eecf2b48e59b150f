"""The end of every Python command of the console script: its last line and its exit code."""

import os
import sys
from collections.abc import Callable
from pathlib import Path

from omnistep.errors import OmnistepError, SimulationError


class NotWritten(OmnistepError, RuntimeError):
    """What was found is none to be used: no file was written."""


def made(make: Callable[[], None], out: Path | None) -> int:
    """Make a file, if one is wanted; print its path, or the error in one line; return the exit code."""
    try:
        make()
    except KeyboardInterrupt:
        return 130
    except (OmnistepError, ValueError, ImportError, OSError) as error:
        print(f"error: {error}", file=sys.stderr)
        return 1 if isinstance(error, RuntimeError | SimulationError) else 2
    if out is None:
        return 0
    try:
        print(out)
    except UnicodeEncodeError:  # its name is no text: as the system has it
        sys.stdout.buffer.write(os.fsencode(out) + b"\n")
    return 0
