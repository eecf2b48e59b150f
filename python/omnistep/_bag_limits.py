"""Limits of memory and time for reading a bag, in proportion to its size.

The only module that names parts of rosbags that are not its interface: it unpacks without a limit.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any, NoReturn

from omnistep._tables import module
from omnistep.errors import LogError

#: Most bytes of chunks whose times overlap, which are unpacked together; writers make chunks of some megabytes.
MOST_TOGETHER = 2**27
#: Most bytes that a bag unpacks to, as a multiple of its own; of a small bag `MOST_TOGETHER`.
MOST_RATIO = 60
#: Most characters of YAML, some ten microseconds each, and deepest nesting, whose time grows with its square.
MOST_YAML, MOST_DEEP = 2**19, 32
#: Bytes that are unpacked at a time if they go to another file.
_PIECE = 2**20
#: Generated columns, by SQLite's number for them: the file does not store their values.
_GENERATED = (2, 3)


class Unpacking:
    """What a bag unpacks to, counted."""

    def __init__(self, path: Path) -> None:
        """Look at the size of a bag, a file or a folder."""
        self.path = path
        files = [path] if path.is_file() else [each for each in path.iterdir() if each.is_file()]
        self.size = sum(each.stat().st_size for each in files)
        self.most = max(MOST_TOGETHER, MOST_RATIO * self.size)
        self.sum = 0

    def begin(self) -> None:
        """Count from 0 again: the memory of earlier unpacked data is free."""
        self.sum = 0

    def check_index(self, reader: Any, topics: set[str]) -> None:
        """Reject chunks by their indexed size, which an unpacked chunk must match."""
        storage = reader.readers[0].storage
        total = 0
        for part in getattr(storage, "storages", [storage]):
            wanted = {each.id for each in part.connections if each.topic in topics}
            chunks = [each for each in getattr(part, "chunks", []) if wanted & each.channel_count.keys()]
            total += sum(each.uncompressed_size for each in chunks)
            starts = [(each.message_start_time, 0, each.uncompressed_size) for each in chunks]
            ends = [(each.message_end_time, 1, -each.uncompressed_size) for each in chunks]
            together = 0
            for _, _, more in sorted(starts + ends):
                together += more
                if together > MOST_TOGETHER:
                    self.refuse(f"chunks that are read together unpack to {together} bytes", MOST_TOGETHER)
        if total > self.most:
            self.refuse(f"{self.size} bytes that unpack to {total}", self.most)

    def take(self, size: int) -> None:
        """Count bytes before they are unpacked."""
        if size > MOST_TOGETHER:
            self.refuse(f"a chunk that unpacks to {size} bytes", MOST_TOGETHER)
        self.sum += size
        if self.sum > self.most:
            self.refuse(f"{self.size} bytes that unpack to {self.sum} and more", self.most)

    def refuse(self, what: str, most: int) -> NoReturn:
        """Raise an error that names the amount that a bag requires, and the allowed amount."""
        raise LogError(f"{self.path}: {what}, allowed: {most} at most", file=str(self.path))

    def unpacked(self, new: Callable[[], Any], data: bytes, most: int) -> bytes:
        """Consecutive frames of a compression, unpacked to at most one byte more than allowed."""
        parts: list[bytes] = []
        room = most + 1
        while data and room > 0:
            frame = new()
            while not frame.eof and room > 0:
                part = frame.decompress(data, max_length=room)
                data = b""
                parts.append(part)
                room -= len(part)
                if not part and not frame.eof:
                    raise ValueError("compressed data that end early")
            data = frame.unused_data or b""
        if room <= 0:
            self.refuse(f"data that unpack to more than {most} bytes", most)
        return b"".join(parts)


class _Zstd:
    """The part of a module for zstd that rosbags uses for messages and files of bags."""

    def __init__(self, zstd: Any, unpacking: Unpacking) -> None:
        self._zstd, self._unpacking = zstd, unpacking

    def decompress(self, data: bytes) -> bytes:
        whole = self._unpacking.unpacked(self._zstd.ZstdDecompressor, data, MOST_TOGETHER)
        self._unpacking.take(len(whole))
        return whole

    @contextmanager
    def open(self, file: Any, mode: str) -> Iterator[Any]:
        with self._zstd.open(file, mode) as packed:
            yield _Counted(packed, self._unpacking)


class _Counted:
    """A compressed file, read in pieces that are counted."""

    def __init__(self, packed: Any, unpacking: Unpacking) -> None:
        self._packed, self._unpacking = packed, unpacking

    def read(self, size: int = -1) -> bytes:
        part: bytes = self._packed.read(min(size, _PIECE) if size > 0 else _PIECE)
        self._unpacking.take(len(part))
        return part


class _Yaml:
    """A reader of YAML that looks at a text before it reads it."""

    def __init__(self, of: Any, path: Path) -> None:
        self._of, self._path = of, path

    def load(self, text: str) -> Any:
        check_yaml(self._path, text)
        return self._of.load(text)


def check_yaml(path: Path, text: str) -> None:
    """Reject YAML text that would take long to parse.

    >>> from pathlib import Path
    >>> from omnistep._bag_limits import check_yaml
    >>> check_yaml(Path("bag"), "a: [b, {c: d}]")
    >>> check_yaml(Path("bag"), "[" * 100)
    Traceback (most recent call last):
    ...
    omnistep.errors.LogError: bag: YAML nested 33 deep and more, allowed: 32 at most
    """
    if len(text) > MOST_YAML:
        raise LogError(f"{path}: YAML of {len(text)} characters or more, allowed: {MOST_YAML} at most", file=str(path))
    deep = 0
    deepest = max((len(spaces) for spaces in re.findall(r"^[ \t?:-]*", text, re.MULTILINE)), default=0) // 2
    for bracket in re.findall(r"[\[\]{}]", text):
        deep = max(deep + (1 if bracket in "[{" else -1), 0)
        deepest = max(deep, deepest)
        if deepest > MOST_DEEP:
            break
    if deepest > MOST_DEEP:
        found = f"YAML nested {MOST_DEEP + 1} deep and more"
        raise LogError(f"{path}: {found}, allowed: {MOST_DEEP} at most", file=str(path))


def _check_database(path: Path) -> None:
    """Refuse a database whose messages are not in its file."""
    import sqlite3
    from contextlib import closing

    with closing(sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro&immutable=1", uri=True)) as database:
        for table in ("schema", "topics", "messages", "message_definitions"):
            for column in database.execute(f"PRAGMA table_xinfo({table})"):
                if column[6] in _GENERATED:
                    what = f"table {table}: column {column[1]} is generated"
                    raise LogError(f"{path}: {what}, allowed: columns that are stored", file=str(path))
        [size] = database.execute("SELECT total(length(data)) FROM messages").fetchone()
    there = path.stat().st_size
    if size > there:
        raise LogError(f"{path}: {there} bytes with {size:.0f} bytes of messages, allowed: {there}", file=str(path))


@contextmanager
def bounded(path: Path) -> Iterator[Unpacking]:
    """Let rosbags unpack a bag within these limits, for as long as it reads it."""
    reader, storage = module("rosbags.rosbag2.reader"), module("rosbags.rosbag2.storage_mcap")
    metadata, database = module("rosbags.rosbag2.metadata"), module("rosbags.rosbag2.storage_sqlite3")
    lz4 = module("lz4.frame").LZ4FrameDecompressor
    unpacking = Unpacking(path)
    about = path / "metadata.yaml"
    if about.is_file():
        with about.open("rb") as file:
            check_yaml(about, file.read(MOST_YAML + 1).decode(errors="replace"))

    def chunk(unpacked: Callable[[bytes, int], bytes]) -> Callable[[bytes, int], bytes]:
        def of(data: bytes, size: int) -> bytes:
            unpacking.take(size)
            return unpacked(data, size)

        return of

    def yaml(*, typ: str, of: Any = metadata.YAML) -> _Yaml:
        return _Yaml(of(typ=typ), path)

    def opened(self: Any, of: Any = database.Sqlite3Reader._open) -> None:
        _check_database(self.path)
        of(self)

    chunks = {
        "": chunk(lambda data, _: data),
        "lz4": chunk(lambda data, size: unpacking.unpacked(lz4, data, size)),
        "zstd": chunk(lambda data, size: unpacking.unpacked(storage.zstd.ZstdDecompressor, data, size)),
    }
    with ExitStack() as stack:
        for place, name, value in (
            (storage, "DECOMPRESSORS", chunks),
            (reader, "zstd", _Zstd(reader.zstd, unpacking)),
            (metadata, "YAML", yaml),
            (database.Sqlite3Reader, "_open", opened),
        ):
            stack.callback(setattr, place, name, getattr(place, name))
            setattr(place, name, value)
        yield unpacking
