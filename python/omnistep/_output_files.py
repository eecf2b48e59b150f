"""Files that commands write: complete or not at all, and never in place of what they read."""

from __future__ import annotations

import os
import secrets
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from omnistep.errors import ConfigError


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
    """A temporary file beside a path, which takes its place once it is complete; its file name extension is the same.

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
