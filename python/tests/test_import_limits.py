"""Logs of others that ask for more memory or time than their size is worth."""

import resource
import sqlite3
import struct
import subprocess
import sys
from types import SimpleNamespace

import lz4.frame
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from rosbags.rosbag2 import CompressionMode, StoragePlugin, Writer
from rosbags.rosbag2.storage_mcap import zstd
from rosbags.typesys import Stores, get_typestore

import omnistep
from omnistep import _bag_limits, _tables

TYPES = get_typestore(Stores.ROS2_JAZZY)
KIND = "sensor_msgs/msg/JointState"
MAP = 'schema_version = 1\nvehicle = "omni3"\nperiod_s = 0.01\n[wheels]\ntopic = "/joint_states"\n'
MAP += 'names = ["left", "right", "rear"]\n'
#: Of an import of nothing: Python, NumPy and this program take some 0.5 GB of addresses, and twice the limit is let.
MOST_BYTES = 1_500_000_000
MAGIC = b"\x89MCAP0\r\n"


def _bag(folder, plugin=StoragePlugin.MCAP, **compression):
    """A second of three joints at 100 Hz."""
    time, header = TYPES.types["builtin_interfaces/msg/Time"], TYPES.types["std_msgs/msg/Header"]
    writer = Writer(folder, version=9, storage_plugin=plugin)
    if compression:
        writer.set_compression(**compression)
    with writer as bag:
        joints = bag.add_connection("/joint_states", KIND, typestore=TYPES)
        for k in range(100):
            numbers = {name: np.full(3, float(k)) for name in ("position", "velocity", "effort")}
            stamp = time(sec=1000 + k // 100, nanosec=k % 100 * 10_000_000)
            names = ["left", "right", "rear"]
            state = TYPES.types[KIND](header=header(stamp=stamp, frame_id=""), name=names, **numbers)
            bag.write(joints, 10**12 + k * 10_000_000, TYPES.serialize_cdr(state, KIND))
    return folder


def _records(whole):
    at = len(MAGIC)
    while at + 9 <= len(whole) - len(MAGIC):
        kind, length = whole[at], struct.unpack_from("<Q", whole, at + 1)[0]
        yield kind, whole[at + 9 : at + 9 + length]
        at += 9 + length


def _zeros(name, size):
    """This many zeros, compressed, made a piece at a time."""
    piece = b"\0" * 2**24
    if name == "lz4":
        packer = lz4.frame.LZ4FrameCompressor()
        return packer.begin() + b"".join(packer.compress(piece) for _ in range(size // len(piece))) + packer.flush()
    packer = zstd.ZstdCompressor()
    return b"".join(packer.compress(piece) for _ in range(size // len(piece))) + packer.flush()


def _bomb(folder, name, *, says, unpacks, indexed):
    """A bag whose chunk is zeros, more of them than it may say."""
    [file] = _bag(folder).glob("*.mcap")
    packed, out = _zeros(name, unpacks), []
    for kind, data in _records(file.read_bytes()):
        if kind == 0x06:
            data = data[:16] + struct.pack("<QII", says, 0, len(name)) + name.encode()
            data += struct.pack("<Q", len(packed)) + packed
        elif kind == 0x08:
            # Its numbers of the chunk, behind those of the index of its messages.
            behind = 36 + struct.unpack_from("<I", data, 32)[0] + 8
            length = struct.pack("<Q", 9 + 40 + len(name) + len(packed))
            data = data[:24] + length + data[32:behind] + struct.pack("<I", len(name)) + name.encode()
            data += struct.pack("<QQ", len(packed), says)
        elif kind == 0x02 and not indexed:
            data = bytes(20)
        elif kind == 0x0F and not indexed:
            data = bytes(4)
        out.append((kind, data))
    if indexed:
        # What is behind the chunk has another place: of that the footer has where the index begins.
        before = [data for kind, data in _records(file.read_bytes()) if kind == 0x06]
        after = [data for kind, data in out if kind == 0x06]
        grown = sum(map(len, after)) - sum(map(len, before))
        [footer] = [data for kind, data in out if kind == 0x02]
        moved = struct.pack("<QQI", *(at + grown for at in struct.unpack_from("<QQ", footer)), 0)
        out = [(kind, moved if kind == 0x02 else data) for kind, data in out]
    file.write_bytes(MAGIC + b"".join(struct.pack("<BQ", kind, len(data)) + data for kind, data in out) + MAGIC)
    return file


def _imported(log, folder, keys=MAP):
    """What the command says within a limit of memory, and how many seconds of a processor it takes."""
    (folder / "my.toml").write_text(keys)
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    done = subprocess.run(
        [sys.executable, "-m", "omnistep", "import", str(log), "--map", "my.toml"],
        cwd=folder,
        capture_output=True,
        text=True,
        preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_DATA, (MOST_BYTES, MOST_BYTES)),
    )
    return done.returncode, done.stderr, resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before


def _refused(log, folder, said, keys=MAP):
    code, err, took_s = _imported(log, folder, keys)
    assert code == 2 and err.count("\n") == 1 and said in err and len(err) <= 400, err
    # Nothing was unpacked: most of the time is that of imports.
    assert took_s < 10.0, took_s


@pytest.mark.parametrize("indexed", [True, False], ids=["indexed", "not indexed"])
@pytest.mark.parametrize("name", ["zstd", "lz4"])
def test_a_chunk_is_looked_at_before_it_is_unpacked(tmp_path, name, indexed):
    size = 2**30
    file = _bomb(tmp_path / "drive", name, says=size, unpacks=size, indexed=indexed)
    said = f"unpack to {size} bytes" if indexed else f"a chunk that unpacks to {size} bytes"
    for log in (file, file.parent):
        _refused(log, tmp_path, said)
        _refused(log, tmp_path, f"allowed: {_bag_limits.MOST_TOGETHER} at most")


@pytest.mark.parametrize("indexed", [True, False], ids=["indexed", "not indexed"])
@pytest.mark.parametrize("name", ["zstd", "lz4"])
def test_a_chunk_that_says_less_than_it_is_unpacks_no_further_than_it_says(tmp_path, name, indexed):
    file = _bomb(tmp_path / "drive", name, says=1000, unpacks=2**30, indexed=indexed)
    _refused(file, tmp_path, "data that unpack to more than 1000 bytes, allowed: 1000 at most")


def test_chunks_that_overlap_in_time_count_together_and_others_one_by_one(tmp_path):
    def chunk(start, end, size):
        return SimpleNamespace(
            message_start_time=start, message_end_time=end, uncompressed_size=size, channel_count={1: 1}
        )

    def checked(*chunks):
        (tmp_path / "bag.mcap").write_bytes(bytes(10**7))
        joints = SimpleNamespace(id=1, topic="/joint_states")
        part = SimpleNamespace(connections=[joints], chunks=[chunk(*each) for each in chunks])
        reader = SimpleNamespace(readers=[SimpleNamespace(storage=part)])
        _bag_limits.Unpacking(tmp_path / "bag.mcap").check_index(reader, {"/joint_states"})

    third = _bag_limits.MOST_TOGETHER // 3
    checked(*((k, k, third) for k in range(13)))
    checked((0, 9, third), (9, 12, third), (10, 20, third))
    for chunks, said in (
        ([(0, 9, third), (8, 12, third), (9, 20, third), (9, 30, third)], "chunks that are read together unpack to"),
        ([(k, k, third) for k in range(14)], f"10000000 bytes that unpack to {14 * third}, allowed: 600000000"),
    ):
        with pytest.raises(omnistep.LogError, match=said):
            checked(*chunks)


@pytest.mark.parametrize("plugin", [StoragePlugin.MCAP, StoragePlugin.SQLITE3])
@pytest.mark.parametrize("mode", [CompressionMode.MESSAGE, CompressionMode.FILE])
def test_bags_that_are_compressed_as_a_whole_or_by_the_message_are_read(tmp_path, plugin, mode):
    from rosbags.rosbag2 import CompressionFormat

    log = _bag(tmp_path / "drive", plugin, mode=mode, fmt=CompressionFormat.ZSTD)
    (tmp_path / "my.toml").write_text(MAP)
    summary = omnistep.import_log(log, map=tmp_path / "my.toml", out=tmp_path / "robot.mcap", progress=False)
    assert summary.rows == 100
    for file in log.glob("*.zstd"):
        file.write_bytes(_zeros("zstd", 2**28))
        _refused(log, tmp_path, f" and more, allowed: {_bag_limits.MOST_TOGETHER} at most")


def test_messages_of_a_database_are_in_its_file(tmp_path):
    [file] = _bag(tmp_path / "drive", StoragePlugin.SQLITE3).glob("*.db3")
    assert _imported(file, tmp_path)[0] == 0
    with sqlite3.connect(file) as database:
        database.executescript(
            "CREATE TABLE m2(id, topic_id, timestamp, data AS (zeroblob(900000000))); "
            "INSERT INTO m2(id, topic_id, timestamp) SELECT id, topic_id, timestamp FROM messages; "
            "DROP TABLE messages; ALTER TABLE m2 RENAME TO messages"
        )
    database.close()
    for log in (file, file.parent):
        _refused(log, tmp_path, "table messages: column data is generated, allowed: columns that are stored")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a: " + "[" * 100_000, "YAML nested 33 deep and more, allowed: 32 at most"),
        ("\n".join("  " * k + "a:" for k in range(500)), "YAML nested 33 deep and more, allowed: 32 at most"),
        ("a: b\n" * 200_000, "YAML of 524289 characters or more, allowed: 524288 at most"),
    ],
    ids=["brackets", "indented", "long"],
)
def test_yaml_that_takes_long_is_not_read(tmp_path, text, said):
    log = _bag(tmp_path / "drive")
    (log / "metadata.yaml").write_text(text)
    _refused(log, tmp_path, f"metadata.yaml: {said}")


def test_yaml_inside_a_bag_is_looked_at_too(tmp_path):
    [file] = _bag(tmp_path / "drive", StoragePlugin.SQLITE3).glob("*.db3")
    with sqlite3.connect(file) as database:
        database.execute("UPDATE topics SET offered_qos_profiles = ?", ("[" * 100_000,))
    database.close()
    _refused(file, tmp_path, "YAML nested 33 deep and more")


def _table(path, rows, columns):
    zeros = pa.array(np.zeros(rows, "i1"))
    table = pa.table({"t": pa.array(np.arange(rows)), **dict.fromkeys(columns, zeros)})
    pq.write_table(table, path, compression="zstd")


TABLE = 'schema_version = 1\nvehicle = "omni3"\nperiod_s = 0.001\n[time]\ncolumn = "t"\nunit = "ms"\n'


def test_rows_by_columns_of_parquet_are_looked_at_before_anything_is_unpacked(tmp_path, monkeypatch):
    names = [f"w{k}" for k in range(3)]
    _table(tmp_path / "t.parquet", 6_000_000, names)
    size = (tmp_path / "t.parquet").stat().st_size
    said = f"t.parquet: {size} bytes with 6000000 rows of 4 columns, 24000000 numbers, allowed: "
    keys = TABLE + f"[wheels]\nnames = {names!r}\n".replace("'", '"')
    if _tables.CELLS_PER_BYTE * size < 24_000_000:
        _refused(tmp_path / "t.parquet", tmp_path, said, keys)
    monkeypatch.setattr(_tables, "MOST_CELLS", 1000)
    monkeypatch.setattr(_tables, "CELLS_PER_BYTE", 0)
    monkeypatch.setattr(pq.ParquetFile, "iter_batches", lambda *_, **__: pytest.fail("unpacked"))
    (tmp_path / "my.toml").write_text(keys)
    with pytest.raises(omnistep.LogError, match=said):
        omnistep.import_log(tmp_path / "t.parquet", map=tmp_path / "my.toml", out=tmp_path / "r.mcap", progress=False)


def test_the_times_of_parquet_are_looked_at_before_the_rest_is_unpacked(tmp_path, monkeypatch):
    names = [f"w{k}" for k in range(3)]
    _table(tmp_path / "t.parquet", 4_000_000, names)
    (tmp_path / "my.toml").write_text(TABLE + f"[wheels]\nnames = {names!r}\n".replace("'", '"'))
    unpacked = []
    batches = pq.ParquetFile.iter_batches

    def kept(self, *, columns):
        unpacked.extend(columns)
        return batches(self, columns=columns)

    monkeypatch.setattr(pq.ParquetFile, "iter_batches", kept)
    with pytest.raises(omnistep.LogError, match=r"t.parquet: 4000 s, allowed: 0.001 to 3600 s"):
        omnistep.import_log(tmp_path / "t.parquet", map=tmp_path / "my.toml", out=tmp_path / "r.mcap", progress=False)
    assert unpacked == ["t"]


def test_a_control_period_is_a_limited_part_of_the_time_between_samples(tmp_path):
    rows = "".join(f"{5 * k},{k},{k},{k}\n" for k in range(400))
    (tmp_path / "t.csv").write_text("t,a,b,c\n" + rows)
    keys = TABLE + '[wheels]\nnames = ["a", "b", "c"]\n'
    said = "my.toml: period_s: 1e-06: 1995001 control periods for 400 samples, allowed: 100000"
    _refused(tmp_path / "t.csv", tmp_path, said, keys.replace("0.001", "1e-6"))
    assert _imported(tmp_path / "t.csv", tmp_path, keys.replace("0.001", "5e-5"))[0] == 0  # 39901


def test_numbers_of_absurd_size_bring_no_warning_of_numpy(tmp_path):
    (tmp_path / "t.csv").write_text("t,a,b,c\n0,1,1,1\n10,2,2,inf\n20,3,1e308,3\n30,3,-1e308,3\n40,1,1,1\n")
    for unit in ("rad", "rad/s", "rpm"):
        keys = TABLE + f'[wheels]\nnames = ["a", "b", "c"]\nunit = "{unit}"\n'
        code, err, _ = _imported(tmp_path / "t.csv", tmp_path, keys)
        assert (code, err) == (0, ""), err


def test_a_map_may_begin_with_a_byte_order_mark(tmp_path):
    (tmp_path / "t.csv").write_text("t,a,b,c\n0,1,1,1\n10,2,2,2\n")
    code, err, _ = _imported(tmp_path / "t.csv", tmp_path, "\ufeff" + TABLE + '[wheels]\nnames = ["a", "b", "c"]\n')
    assert (code, err) == (0, ""), err
