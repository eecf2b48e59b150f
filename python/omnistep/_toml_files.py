"""TOML files that Python reads itself: maps of foreign logs, and runs for calibration."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from omnistep._omnistep import shortened
from omnistep.errors import ConfigError

#: The largest that is read, as of other TOML files.
MOST_BYTES = 16 * 2**20
#: The longest whole number: Python prints none of over 4300 digits. What is too large for a key is said there.
MOST_BITS = 8192


def read_toml(path: Path) -> tuple[str, dict[str, Any]]:
    """Read a TOML file: its text, and its keys.

    Raises:
        ConfigError: it is no regular file, too large, no TOML, or has a whole number of absurd length.
    """
    file = str(path)
    try:
        if not path.is_file():
            what = "not a regular file" if path.exists() else "no such file"
            raise ConfigError(f"{file}: {what}, allowed: a TOML file", file=file)
        if (size := path.stat().st_size) > MOST_BYTES:
            raise ConfigError(f"{file}: {size} bytes, allowed: {MOST_BYTES}", file=file)
        text = path.read_bytes().decode()
        keys = tomllib.loads(text)
    except OSError as error:
        raise ConfigError(f"{file}: {error.strerror or error}", file=file) from error
    except ValueError as error:  # of UTF-8 and of TOML
        why = shortened(str(error).splitlines()[0])
        raise ConfigError(f"{file}: no TOML: {why}, allowed: a TOML file", file=file) from error
    except RecursionError as error:
        raise ConfigError(f"{file}: no TOML: nested too deeply, allowed: a TOML file", file=file) from error
    _check_whole(file, keys)
    return text, keys


def _check_whole(file: str, keys: dict[str, Any]) -> None:
    """Refuse whole numbers that Python reads where they are hexadecimal, and then cannot print."""
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
