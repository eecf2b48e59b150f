"""TOML files that Python reads itself: maps of foreign logs, and runs for calibration."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from omnistep._omnistep import did_you_mean_file, shortened
from omnistep.errors import ConfigError

#: The largest that is read; ten thousand runs are less.
MOST_BYTES = 2**20
#: Most parts of a dotted key: the reader's time grows with their square.
MOST_PARTS = 100
#: Strings that end, and comments.
STRINGS = re.compile(r'"(?:\\.|[^"\\\n])*"|\'[^\'\n]*\'|#[^\n]*')
#: The longest whole number: Python prints none of over 4300 digits. Values too large for a key are reported there.
MOST_BITS = 8192


def no_file(path: Path, kind: str = "file") -> str:
    """Message for a path that is no regular file, with the file that was meant, if one is near."""
    if path.exists():
        return f"{path}: not a regular file"
    return f"{path}{did_you_mean_file(path)}: no such {kind}"


def unknown_key(key: str, known: Sequence[str]) -> str:
    """Message for an unknown key: the nearest existing key, if one is near, and all existing keys.

    >>> from omnistep._toml_files import unknown_key
    >>> unknown_key("distance", ["log", "distance_m"])
    'unknown key (did you mean distance_m?), allowed: log, distance_m'
    >>> unknown_key("colour", ["log", "distance_m"])
    'unknown key, allowed: log, distance_m'
    """
    near = get_close_matches(key, known, n=1)
    meant = f" (did you mean {near[0]}?)" if near else ""
    return f"unknown key{meant}, allowed: {', '.join(known)}"


def read_toml(path: Path, most_bytes: int = MOST_BYTES) -> tuple[str, dict[str, Any]]:
    """Read a TOML file: its text, and its keys.

    Raises:
        ConfigError: the path is not a regular file, or the file is too large, is not TOML, or has an integer that is
            too long.
    """
    file = str(path)
    try:
        if not path.is_file():
            raise ConfigError(f"{no_file(path)}, allowed: a TOML file", file=file)
        if (size := path.stat().st_size) > most_bytes:
            raise ConfigError(f"{file}: {size} bytes, allowed: {most_bytes}", file=file)
        text = path.read_bytes().decode("utf-8-sig")
    except OSError as error:
        raise ConfigError(f"{file}: {error.strerror or error}", file=file) from error
    except UnicodeDecodeError as error:
        raise ConfigError(f"{file}: not TOML: {error}, allowed: a TOML file", file=file) from error
    _check_dots(file, text)
    try:
        keys = tomllib.loads(text)
    except ValueError as error:  # of TOML, too large numbers included
        why = shortened(str(error).splitlines()[0])
        raise ConfigError(f"{file}: not TOML: {why}, allowed: a TOML file", file=file) from error
    except RecursionError as error:
        raise ConfigError(f"{file}: not TOML: nested too deeply, allowed: a TOML file", file=file) from error
    _check_whole(file, keys)
    return text, keys


def _check_dots(file: str, text: str) -> None:
    """Refuse keys of too many parts, before anything reads them."""
    before = 0
    # Without the dots of strings and comments.
    text = re.sub(STRINGS, lambda found: found[0].replace(".", " "), text)
    for stop in re.finditer(r"[={},\[\]\n#]", text):
        if stop[0] in "=]" and text.count(".", before, stop.start()) > MOST_PARTS:
            line = text.count("\n", 0, stop.start()) + 1
            raise ConfigError(
                f"{file}: line {line}: more than {MOST_PARTS} dots in a key, allowed: {MOST_PARTS}", file=file
            )
        before = stop.end()


def _check_whole(file: str, keys: dict[str, Any]) -> None:
    """Refuse hexadecimal integers that Python reads but cannot print."""
    left: list[tuple[str, Any]] = list(keys.items())
    while left:
        key, value = left.pop()
        if isinstance(value, dict):
            left += [(f"{key}.{name}", each) for name, each in value.items()]
        elif isinstance(value, list):
            left += [(f"{key}[{number}]", each) for number, each in enumerate(value)]
        elif isinstance(value, int) and value.bit_length() > MOST_BITS:
            key = shortened(key)
            message = f"{file}: {key}: a whole number of {value.bit_length()} bits, allowed: up to {MOST_BITS}"
            raise ConfigError(message, key=key, file=file)
