"""Logs of others: records changed within, the checksums made right, so that what reads them is reached."""

import json
import random
import struct
import sys
import zlib
from pathlib import Path

import zstandard
from campaign import Campaign, Setting, faults, in_parallel, run

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, CHANNEL, MESSAGE, CHUNK, ATTACHMENT, METADATA, DATA_END = 1, 2, 4, 5, 6, 9, 12, 15

Record = tuple[int, bytes]


def records(data: bytes) -> list[Record]:
    """Kind and content of each."""
    found, at = [], 0
    while at + 9 <= len(data):
        kind, length = struct.unpack_from("<BQ", data, at)
        found.append((kind, data[at + 9 : at + 9 + length]))
        at += 9 + length
    return found


def joined(parts: list[Record]) -> bytes:
    """The other way round."""
    return b"".join(struct.pack("<BQ", kind, len(content)) + content for kind, content in parts)


def text(value: str) -> bytes:
    """A string of the format."""
    return struct.pack("<I", len(value.encode())) + value.encode()


def chunk(start: int, end: int, inside: bytes, compression: str, size: int | None = None) -> Record:
    """A chunk of these records."""
    body = zstandard.ZstdCompressor(level=1).compress(inside) if compression == "zstd" else inside
    size = len(inside) if size is None else size
    head = struct.pack("<QQQI", start, end, size, zlib.crc32(inside)) + text(compression)
    return CHUNK, head + struct.pack("<Q", len(body)) + body


def opened(content: bytes) -> tuple[int, int, list[Record]]:
    """Start, end and records of a chunk."""
    start, end, size, _, length = struct.unpack_from("<QQQII", content)
    body = content[32 + length + 8 :]
    return start, end, records(zstandard.ZstdDecompressor().decompress(body, max_output_size=size) if length else body)


def attachment(content: bytes) -> bytes:
    """With the checksum that it should have."""
    return content[:-4] + struct.pack("<I", zlib.crc32(content[:-4]))


LENGTHS = (0, 1, 0x7F, 0xFF, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF)
LONG = (0, 1, 1 << 31, 1 << 32, 1 << 40, (1 << 63) - 1, 1 << 63, (1 << 64) - 1)


def changed(content: bytes, chance: random.Random) -> bytes:
    """A record's content with one thing wrong."""
    data = bytearray(content)
    if not data:
        return bytes(chance.randrange(20))
    at, choice = chance.randrange(len(data)), chance.randrange(8)
    if choice < 3:
        for _ in range(chance.choice((1, 1, 4, 16))):
            data[chance.randrange(len(data))] = chance.randrange(256)
    elif choice == 3:
        data[at : at + 4] = struct.pack("<I", chance.choice(LENGTHS))
    elif choice == 4:
        data[at : at + 8] = struct.pack("<Q", chance.choice(LONG))
    elif choice == 5:
        data[at : at + 8] = struct.pack("<d", chance.choice((float("nan"), float("inf"), 1e308, -0.0, 5e-324)))
    elif choice == 6:
        del data[at:]
    else:
        data[at:at] = bytes(chance.randrange(256) for _ in range(chance.choice((1, 4, 300))))
    return bytes(data)


def shaken(parts: list[Record], chance: random.Random) -> list[Record]:
    """Records of which one is changed, lost, doubled, moved or of another kind."""
    if not parts:
        return parts
    at, choice = chance.randrange(len(parts)), chance.randrange(10)
    kind, content = parts[at]
    if choice < 6:
        parts[at] = (kind, changed(content, chance))
    elif choice == 6:
        del parts[at]
    elif choice == 7:
        parts[at:at] = [parts[at]] * chance.choice((1, 100))
    elif choice == 8:
        parts.insert(chance.randrange(len(parts)), parts.pop(at))
    else:
        parts[at] = (chance.randrange(1, 20), content)
    return parts


def mutant(log: bytes, chance: random.Random) -> bytes:
    """The log with something wrong in it that no checksum tells."""
    parts = [part for part in records(log[len(MAGIC) : -len(MAGIC)])]
    end = next(k for k, (kind, _) in enumerate(parts) if kind == DATA_END)
    summary = parts[end + 1 :] if chance.random() < 0.3 else [(FOOTER, bytes(20))]
    parts = parts[:end]
    if chance.random() < 0.6:
        at = chance.choice([k for k, (kind, _) in enumerate(parts) if kind == CHUNK])
        start, finish, inside = opened(parts[at][1])
        for _ in range(chance.choice((1, 1, 3))):
            inside = shaken(inside, chance)
        size = chance.choice((None, None, None, None, 0, 1 << 33, 1 << 62))
        parts[at] = chunk(start, finish, joined(inside), chance.choice(("zstd", "", "zstd", "lz4")), size)
    else:
        # The attachment and the metadata are as likely as all chunks together.
        own = [k for k, (kind, _) in enumerate(parts) if kind in (ATTACHMENT, METADATA, HEADER)]
        if chance.random() < 0.7:
            at = chance.choice(own)
            kind, content = parts[at]
            content = changed(content[:-4], chance) + bytes(4) if kind == ATTACHMENT else changed(content, chance)
            parts[at] = (kind, attachment(content) if kind == ATTACHMENT else content)
        else:
            parts = shaken(parts, chance)
    data = MAGIC + joined([*parts, (DATA_END, bytes(4)), *summary]) + MAGIC
    if chance.random() < 0.1:
        data = data[: chance.randrange(len(data))]
    return data


def transforms(names: list[str]) -> bytes:
    """A tf2_msgs/msg/TFMessage of these frames in world, in CDR."""
    body = struct.pack("<I", len(names))
    for name in names:
        body += bytes(-len(body) % 4) + bytes(8)
        for word in (b"world\0", name.encode() + b"\0"):
            body += bytes(-len(body) % 4) + struct.pack("<I", len(word)) + word
        body += bytes(-len(body) % 8) + struct.pack("<7d", 0, 0, 0, 0, 0, 0, 1)
    return b"\0\1\0\0" + body


def frames(header: Record, scenario: Record, names: int, rows: int) -> bytes:
    """A small log of many frame names and many messages: a table of names times rows would be without end."""
    inside: list[Record] = [
        (3, struct.pack("<H", 1) + text("tf2_msgs/msg/TFMessage") + text("ros2msg") + text("")),
        (CHANNEL, struct.pack("<HH", 1, 1) + text("/tf") + text("cdr") + struct.pack("<I", 0)),
    ]
    for k in range(rows):
        message = transforms([f"f{n}" for n in range(k, names, rows)])
        inside.append((MESSAGE, struct.pack("<HIQQ", 1, k, k, k) + message))
    parts = [header, scenario, chunk(0, rows, joined(inside), "zstd")]
    return MAGIC + joined([*parts, (DATA_END, bytes(4)), (FOOTER, bytes(20))]) + MAGIC


def with_scenario(log: bytes, scenario: str) -> bytes:
    """The log with another scenario attached."""
    parts = records(log[len(MAGIC) : -len(MAGIC)])
    end = next(k for k, (kind, _) in enumerate(parts) if kind == DATA_END)
    made = []
    for kind, content in parts[:end]:
        if kind == ATTACHMENT:
            name = text("scenario.toml") + text("application/toml")
            data = scenario.encode()
            content = attachment(bytes(16) + name + struct.pack("<Q", len(data)) + data + bytes(4))
        made.append((kind, content))
    return MAGIC + joined([*made, (DATA_END, bytes(4)), (FOOTER, bytes(20))]) + MAGIC


def by_hand(log: bytes, folder: Path, top: Path) -> dict[str, bytes]:
    """Bombs, lying lengths, and scenarios that name files of this machine."""
    parts = records(log[len(MAGIC) : -len(MAGIC)])
    header = MAGIC + joined(parts[:1])
    zeros = zstandard.ZstdCompressor(level=3).compress(bytes(400_000_000))
    bomb = struct.pack("<QQQI", 0, 1, 400_000_000, 0) + text("zstd") + struct.pack("<Q", len(zeros)) + zeros
    step = (top / "crates/omni-config/assets/scenarios/step.toml").read_text()
    heights = (top / "crates/omni-config/assets/scenarios/height_map.toml").read_text()
    vehicle = folder / "mine.toml"
    (folder / "zero.toml").symlink_to("/dev/zero")
    vehicle.write_text((top / "crates/omni-config/assets/vehicles/chugo7.toml").read_text())
    end = joined([(DATA_END, bytes(4)), (FOOTER, bytes(20))]) + MAGIC
    own = next(part for part in parts if part[0] == ATTACHMENT)
    return {
        "zstd-bomb": header + joined([(CHUNK, bomb)]) + end,
        "record-of-3-GB": header + struct.pack("<BQ", MESSAGE, 3_000_000_000) + bytes(100),
        "record-of-2-63": header + struct.pack("<BQ", CHUNK, 1 << 63) + bytes(100),
        "string-of-4-GB": header + joined([(CHANNEL, struct.pack("<HHI", 1, 1, 0xFFFFFFFF) + b"/tf")]) + end,
        "map-of-4-GB": header + joined([(METADATA, text("run") + struct.pack("<I", 0xFFFFFFFF))]) + end,
        "no-magic-at-end": log[:-8],
        # 24 GB as numbers, were every frame in every row.
        "frames-without-end": frames(parts[0], own, 20_000, 20_000),
        "names-vehicle": with_scenario(log, step.replace('"chugo7"', f'"{vehicle}"')),
        "names-zero": with_scenario(log, step.replace('"chugo7"', f'"{folder / "zero.toml"}"')),
        "names-zero-picture": with_scenario(log, heights.replace('"hills"', '"/dev/zero"')),
    }


READ = """
import sys, json, omnistep
for path in sys.argv[1:]:
    print(path, flush=True)
    try:
        log = omnistep.read_mcap(path)
        repr(log)
    except (omnistep.LogError, omnistep.ConfigError, ValueError, OSError) as error:
        if len(str(error)) > 300:
            print(f"LONG {path} {len(str(error))}", flush=True)
    except MemoryError:
        print(f"MEMORY {path}", flush=True)
    except BaseException as error:
        print(f"RAISED {path} {type(error).__name__}: {error}"[:300], flush=True)
"""


def campaigns(setting: Setting) -> list[Campaign]:
    """Mutants through `info`, `replay` and `read_mcap`; plain flipped bits; logs by hand."""
    chance, folder = setting.random("mcap"), setting.folder("mcap")
    for name in ("step", "rough"):
        run([setting.omnistep, "run", name, "--set", "duration_s=0.2", "--quiet", "--out", folder], folder)
    logs = [path.read_bytes() for path in sorted(folder.glob("*.mcap"))]
    if len(logs) != 2:
        return [Campaign("logs", 1, "files", ["omnistep run step and run rough made no logs"])]
    paths = []
    for k in range(setting.count(400)):
        paths.append(folder / f"mutant-{k}.mcap")
        paths[-1].write_bytes(mutant(chance.choice(logs), chance))

    def look(path: Path) -> str | None:
        for word in ("info", "replay"):
            ended = run([setting.omnistep, word, path.name], folder)
            if wrong := faults(ended):
                return f"omnistep {word} {setting.kept(path)}: {'; '.join(wrong)}"
        return None

    looked = in_parallel(look, paths)
    done = [Campaign("log mutants: info, replay", looked[0], "files", looked[1])]
    done.append(in_python(setting, folder, "log mutants: read_mcap", paths))

    flips = []
    for k in range(setting.count(60)):
        data = bytearray(chance.choice(logs))
        bit = chance.randrange(8 * len(data))
        data[bit // 8] ^= 1 << bit % 8
        flips.append(folder / f"flip-{k}.mcap")
        flips[-1].write_bytes(data)

    def noticed(path: Path) -> str | None:
        ended = run([setting.omnistep, "info", path.name], folder)
        wrong = faults(ended)
        if ended.code == 0:
            wrong.append("exit 0")
        return f"omnistep info {setting.kept(path)}: {'; '.join(wrong)}" if wrong else None

    done.append(Campaign("logs: one bit flipped", *_named(in_parallel(noticed, flips), "bits")))

    hands = []
    for name, data in by_hand(logs[1], folder, setting.top).items():
        hands.append(folder / f"{name}.mcap")
        hands[-1].write_bytes(data)

    def refused(path: Path) -> str | None:
        for word in ("info", "replay"):
            ended = run([setting.omnistep, word, path.name], folder)
            wrong = faults(ended)
            if path.name.startswith("names-") and ended.code == 0:
                wrong.append("a file of this machine was read")
            if wrong:
                return f"omnistep {word} {setting.kept(path)}: {'; '.join(wrong)}"
        return None

    by_command = in_parallel(refused, hands)
    by_python = in_python(setting, folder, "", hands)
    done.append(Campaign("logs by hand", by_command[0] + by_python.tried, "reads", by_command[1] + by_python.failures))
    for path in folder.glob("*.mcap"):
        path.unlink()
    return done


def _named(result: tuple[int, list[str]], unit: str) -> tuple[int, str, list[str]]:
    return result[0], unit, result[1]


def in_python(setting: Setting, folder: Path, name: str, paths: list[Path]) -> Campaign:
    """`omnistep.read_mcap` of many files in one interpreter; where it dies the rest goes on in another."""

    def read(batch: list[Path]) -> list[str]:
        wrong: list[str] = []
        while batch:
            ended = run([sys.executable, "-c", READ, *batch], folder, seconds=SECONDS_A_FILE * len(batch))
            lines = ended.out.splitlines()
            wrong += [
                f"omnistep.read_mcap: {line}" for line in lines if line.split(" ")[0] in ("LONG", "RAISED", "MEMORY")
            ]
            seen = [line for line in lines if line.startswith("/")]
            if ended.code == 0:
                break
            last = Path(seen[-1]) if seen else batch[0]
            wrong.append(f"omnistep.read_mcap({json.dumps(str(setting.kept(last)))}): {'; '.join(faults(ended))}")
            batch = batch[batch.index(last) + 1 :]
        return wrong

    batches = [paths[k : k + 25] for k in range(0, len(paths), 25)]
    failures: list[str] = []

    def work(batch: list[Path]) -> None:
        failures.extend(read(batch))

    in_parallel(work, batches)
    return Campaign(name, len(paths), "files", failures)


SECONDS_A_FILE = 10
