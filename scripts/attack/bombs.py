"""Small logs that unpack to gigabytes: `import` rejects each in one line, and unpacks none."""

import random
import sqlite3
import struct
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from campaign import Campaign, Setting, faults, in_parallel, run
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

MAGIC = b"\x89MCAP0\r\n"
HEAD = 'schema_version = 1\nvehicle = "omni3"\nperiod_s = 0.01\n'
OF_BAG = HEAD + '[wheels]\ntopic = "/joints"\nnames = ["a", "b", "c"]\n'


def bag(folder: Path, plugin: StoragePlugin) -> Path:
    """A bag of one message."""
    types = get_typestore(Stores.ROS2_JAZZY)
    of, kind = types.types, "sensor_msgs/msg/JointState"
    with Writer(folder, version=9, storage_plugin=plugin) as writer:
        joints = writer.add_connection("/joints", kind, typestore=types)
        stamp = of["builtin_interfaces/msg/Time"](sec=1000, nanosec=0)
        header, numbers = of["std_msgs/msg/Header"](stamp=stamp, frame_id=""), np.ones(3)
        state = of[kind](header=header, name=["a", "b", "c"], position=numbers, velocity=numbers, effort=numbers)
        writer.write(joints, 10**12, types.serialize_cdr(state, kind))
    return folder


def zeros(name: str, size: int) -> bytes:
    """This many zeros, compressed, made a piece at a time."""
    packed = pa.BufferOutputStream()
    with pa.CompressedOutputStream(packed, name) as stream:
        for _ in range(size >> 24):
            stream.write(bytes(1 << 24))
    return packed.getvalue().to_pybytes()


def chunk(folder: Path, chance: random.Random) -> tuple[Path, str]:
    """A bag whose chunk is zeros, as many as it says or more."""
    [file] = bag(folder / "drive", StoragePlugin.MCAP).glob("*.mcap")
    name, unpacks = chance.choice(("zstd", "lz4")), chance.randrange(48, 128) << 24
    says = chance.choice((unpacks, unpacks, 1000))
    whole, packed, out = file.read_bytes(), zeros(name, unpacks), MAGIC
    at = len(MAGIC)
    while at + 9 <= len(whole) - len(MAGIC):
        kind, length = struct.unpack_from("<BQ", whole, at)
        data = whole[at + 9 : at + 9 + length]
        at += 9 + length
        if kind == 0x06:  # a chunk: two times, size, checksum, name of the compression, data
            data = data[:16] + struct.pack("<QII", says, 0, len(name)) + name.encode()
            data += struct.pack("<Q", len(packed)) + packed
        elif kind == 0x02:  # the footer: no index is behind the data
            data = bytes(20)
        elif kind == 0x0F:  # the end of the data: no checksum
            data = bytes(4)
        out += struct.pack("<BQ", kind, len(data)) + data
    file.write_bytes(out + MAGIC)
    return chance.choice((file, file.parent)), OF_BAG


def database(folder: Path, chance: random.Random) -> tuple[Path, str]:
    """A bag of SQLite whose messages are made as they are read."""
    [file] = bag(folder / "drive", StoragePlugin.SQLITE3).glob("*.db3")
    written = sqlite3.connect(file)
    written.executescript(
        f"CREATE TABLE m2(id, topic_id, timestamp, data AS (zeroblob({chance.randrange(9) * 10**8 + 10**8}))); "
        "INSERT INTO m2(id, topic_id, timestamp) SELECT id, topic_id, timestamp FROM messages; "
        "DROP TABLE messages; ALTER TABLE m2 RENAME TO messages"
    )
    written.close()
    return chance.choice((file, file.parent)), OF_BAG


def yaml(folder: Path, chance: random.Random) -> tuple[Path, str]:
    """A bag whose description is nested without need."""
    log = bag(folder / "drive", StoragePlugin.MCAP)
    text = chance.choice(("a: " + "[" * 100_000, "\n".join("  " * k + "a:" for k in range(2000)), "a: b\n" * 500_000))
    (log / "metadata.yaml").write_text(text)
    return log, OF_BAG


def table(folder: Path, chance: random.Random) -> tuple[Path, str]:
    """Parquet of zeros: a few kilobytes a million of rows, each asked for by 15 columns of the map."""
    names, groups = [f"w{k}" for k in range(3)], chance.randrange(20, 36)
    rows = pa.table(dict.fromkeys(["t", *names], pa.array(np.zeros(1_000_000, "i1"))))
    with pq.ParquetWriter(folder / "t.parquet", rows.schema, compression="zstd") as writer:
        for _ in range(groups):
            writer.write_table(rows)
    read = ("wheels", "references", "torques", "commanded_torques", "duty")
    columns = "".join(f'[{name}]\nnames = ["w0", "w1", "w2"]\n' for name in read)
    return folder / "t.parquet", f'{HEAD}[time]\ncolumn = "t"\n{columns}'


def campaigns(setting: Setting) -> list[Campaign]:
    """Bombs of each kind; memory and time of each `import` are limited as of every command."""
    kinds: list[Callable[[Path, random.Random], tuple[Path, str]]] = [chunk, chunk, database, yaml, table]
    made = setting.folder("bombs")

    def attack(number: int) -> str | None:
        folder = made / str(number)
        folder.mkdir()
        log, text = kinds[number % len(kinds)](folder, setting.random(f"bomb {number}"))
        (folder / "map.toml").write_text(text)
        words = ["import", log.relative_to(folder), "--map", "map.toml", "-o", "out.mcap"]
        ended = run([sys.executable, "-m", "omnistep", *words], folder)
        wrong = faults(ended, allowed=(2,))
        if not wrong and ended.err.count("\n") != 1:
            wrong.append(f"{ended.err.count(chr(10))} lines: {ended.err[-150:]}")
        if not wrong:
            return None
        return f"scripts/attack/bombs.py, seed {setting.seed}, bomb {number}: {ended.command}: {'; '.join(wrong)}"

    tried, failures = in_parallel(attack, range(setting.count(10)))
    return [Campaign("bombs: import", tried, "logs", failures)]
