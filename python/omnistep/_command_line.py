"""What every Python command of the console script shares: its parser, its last line and its exit code."""

import argparse
import os
import re
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

from omnistep.errors import OmnistepError, SimulationError


class Parser(argparse.ArgumentParser):
    """The parser of a command, to which -1e-3 is a number too, as to argparse itself from Python 3.14 on."""

    def __init__(self, **texts: Any) -> None:
        super().__init__(**texts)
        self._negative_number_matcher = re.compile(r"-\.?\d")


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
