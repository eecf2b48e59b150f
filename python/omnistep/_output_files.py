"""Files that commands write: complete or not at all, and never over their own inputs."""

from __future__ import annotations

import os
import secrets
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from omnistep._omnistep import list_vehicles
from omnistep._toml_files import read_toml
from omnistep.errors import ConfigError

#: The largest scenario file that is examined: a file with an embedded picture is smaller.
MOST_SCENARIO_BYTES = 16_000_000
#: Keys with which a scenario names files other than its vehicle.
REFERENCES = (("terrain", "image"), ("command", "file"))


def scenario_files(path: Path) -> tuple[Path, ...]:
    r"""A scenario file, and the files that it names: its vehicle, its height map, its table of commands.

    A file that cannot be read names none: the reader of the scenario reports why.

    >>> import pathlib, tempfile
    >>> from omnistep._output_files import scenario_files
    >>> file = pathlib.Path(tempfile.mkdtemp()) / "yard.toml"
    >>> _ = file.write_text('vehicle = "my.toml"\n[terrain]\nkind = "height_map"\nimage = "yard.png"\n')
    >>> [each.name for each in scenario_files(file)]
    ['yard.toml', 'my.toml', 'yard.png']
    """
    try:
        _, keys = read_toml(path, MOST_SCENARIO_BYTES)
    except ConfigError:
        return (path,)
    return (path, *named_files(keys, path.parent))


def named_files(keys: Mapping[str, Any], folder: Path) -> tuple[Path, ...]:
    """The files that the keys of a scenario name, by paths relative to a folder."""
    named = [keys.get("vehicle")]
    for table, key in REFERENCES:
        of = keys.get(table)
        named.append(of.get(key) if isinstance(of, Mapping) else None)
    texts = [each for each in named if isinstance(each, str) and "\0" not in each]
    # Whatever is built in, or inside the scenario itself, is no file.
    return tuple(folder / each for each in texts if each not in list_vehicles() and not each.startswith("data:"))


def check_output(out: Path, inputs: Iterable[Path] = (), *, text: bool = False) -> None:
    """Refuse a path that a file may not be written to.

    Raises:
        ConfigError: the path is one of the inputs, is inside a folder that is an input, or is something other than a
            regular file: a folder, a device, a pipe, or a link to one. A text may be written into a device or a pipe.

    >>> from pathlib import Path
    >>> from omnistep._output_files import check_output
    >>> check_output(Path("/"))
    Traceback (most recent call last):
    ...
    omnistep.errors.ConfigError: /: not a regular file, allowed: the name of a new file, or of one to replace
    """
    if not out.exists():
        return
    for each in inputs:
        if each.exists() and (out.samefile(each) or (each.is_dir() and out.resolve().parent.samefile(each))):
            raise ConfigError(f"{out}: this command reads this file, allowed: another name", key="out", file=str(out))
    if not out.is_file() and not (text and not out.is_dir()):
        allowed = "the name of a new file, or of one to replace"
        raise ConfigError(f"{out}: not a regular file, allowed: {allowed}", key="out", file=str(out))


def check_picture(out: Path, inputs: Iterable[Path] = ()) -> None:
    """Refuse a path that no picture may be written to; as :func:`check_output`, and for its extension."""
    if out.suffix not in (".png", ".svg", ".pdf"):
        raise ConfigError(f"{out}: {out.suffix!r}, allowed: .png, .svg or .pdf", key="out", file=str(out))
    check_output(out, inputs)


@contextmanager
def _named(out: Path) -> Iterator[None]:
    """Name the path, and no other, in an error of the system."""
    try:
        yield
    except OSError as error:
        if error.errno is None:
            raise
        raise OSError(error.errno, error.strerror, str(out)) from error


@contextmanager
def replaced(out: Path, inputs: Iterable[Path] = ()) -> Iterator[Path]:
    """A temporary file in the folder of a path, with the same extension, which replaces the path when complete.

    Raises:
        ConfigError: as :func:`check_output`.
        OSError: the file cannot be written.
    """
    check_output(out, inputs)
    aside = out.with_name(f"{out.stem}.{secrets.token_hex(8)}.part{out.suffix}")
    try:
        with _named(out):
            aside.open("x").close()  # follows no link
            yield aside
            with aside.open("rb+") as file:
                os.fsync(file.fileno())
            aside.replace(out)  # a link is replaced, not followed
    finally:
        aside.unlink(missing_ok=True)


def write_text(out: Path, text: str, inputs: Iterable[Path] = ()) -> None:
    """Write a text to a file, complete or not at all; into a pipe or a terminal it goes as it is.

    Raises:
        ConfigError: as :func:`check_output`.
        OSError: the file cannot be written.
    """
    check_output(out, inputs, text=True)
    if out.exists() and not out.is_file():
        with _named(out):
            out.write_text(text, encoding="utf-8")
        return
    with replaced(out, inputs) as aside:
        aside.write_text(text, encoding="utf-8")
