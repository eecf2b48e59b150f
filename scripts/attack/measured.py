"""Logs, maps and lists of runs of others: `import`, `identify`, `calibrate` and `resimulate` under hostile files.

Each ends with 0, or with one line that names a file and exit code 2. Many per process, which takes one second to start:
memory is limited for all of them, time for each.
"""

import json
import os
import random
import shutil
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import files
import pyarrow as pa
import pyarrow.parquet as pq
from campaign import LONGEST_MESSAGE, SECONDS, Campaign, Setting, faults, in_parallel, run

#: Commands a process.
BATCH = 30

WORKER = """
import contextlib, io, json, signal, sys, traceback
from omnistep.__main__ import main

cases, seconds, longest = json.load(open(sys.argv[1])), int(sys.argv[2]), int(sys.argv[3])


class Late(BaseException):
    pass


def late(*_):
    raise Late


signal.signal(signal.SIGALRM, late)
for number, (words, inputs) in enumerate(cases):
    print("RUNNING", number, flush=True)
    out, err, code = io.StringIO(), io.StringIO(), None
    sys.argv = ["omnistep", *words]
    signal.alarm(seconds)
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            code = main()
    except SystemExit as end:
        code = end.code
    except Late:
        code = f"no end within {seconds} s"
    except BaseException as error:
        where = traceback.extract_tb(error.__traceback__)[-1]
        code = f"{type(error).__name__}: {error} ({where.filename.rpartition('/')[2]}:{where.lineno})"[:200]
    signal.alarm(0)
    said, wrong = err.getvalue(), None
    if code not in (0, 1, 2):
        wrong = code
    # 1: of a simulation that diverges.
    elif code == 1 and words[0] != "resimulate":
        wrong = f"exit code 1: {said[:100]}"
    elif code and (said.count("\\n") != 1 or not said.startswith("error: ")):
        wrong = f"{said.count(chr(10))} lines: {said[-150:]}"
    elif code and len(said) > longest:
        wrong = f"a message of {len(said)} characters: {said[:100]}"
    elif code and not any(name in said for name in inputs):
        wrong = f"names none of {', '.join(inputs)}: {said[:150]}"
    elif "llocate" in said or "malloc" in said:
        wrong = f"memory: {said[:150]}"
    if wrong:
        print("FAILED", number, " ".join(str(wrong).split()), flush=True)
print("DONE", len(cases), flush=True)
"""

# A drive, as a CSV and a Parquet file, a recording and two bags; a map of each and a list of runs.
MAKE = """
import numpy as np, omnistep, pyarrow as pa, pyarrow.csv, pyarrow.parquet
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

scenario = omnistep.Scenario("flat", vehicle="omni3", overrides={"duration_s": 4.0, "command.vx_m_s": 0.3,
    "control.period_s": 0.01, "physics.engine": "articulated", "command.then": [
        {"at_s": 2.0, "vx_m_s": 0.0, "vy_m_s": 0.3, "wz_rad_s": 0.5, "ramp_s": 0.5}]})
trace = omnistep.run(scenario, mcap="drive.mcap")
wheels = scenario.vehicle.wheel_names
table = pa.table({name: np.asarray(column) for name, column in trace.columns().items()
                  if name == "time_s" or name.endswith(("measured_rad_s", "applied_n_m", "gyro_rad_s"))})
pa.csv.write_csv(table, "drive.csv")
pa.parquet.write_table(table, "drive.parquet")
head = 'schema_version = 1\\nvehicle = "omni3"\\nperiod_s = 0.01\\n'
names = ", ".join(f'"wheel_{wheel}_measured_rad_s"' for wheel in wheels)
torques = names.replace("measured_rad_s", "applied_n_m")
columns = f'[time]\\ncolumn = "time_s"\\nunit = "s"\\n[wheels]\\nunit = "rad/s"\\nscale = 1.0\\nnames = [{names}]\\n'
open("table.toml", "w").write(head + columns + f"[commanded_torques]\\noffset = 0.0\\nnames = [{torques}]\\n")
joints = ", ".join(f'"{wheel}"' for wheel in wheels)
of_bag = f'[wheels]\\ntopic = "/joints"\\nnames = [{joints}]\\n'
open("bag.toml", "w").write(head + 'max_gap_s = 0.1\\n[time]\\nclock = "header"\\n' + of_bag)
run = '[[run]]\\nlog = "drive.csv"\\nend_x_m = 0.5\\nend_y_m = 0.4\\nend_yaw_rad = 0.9\\ngyro = false\\n'
open("runs.toml", "w").write("schema_version = 1\\nposition_sd_m = 0.01\\n" + run * 8)
types = get_typestore(Stores.ROS2_JAZZY)
of = types.types
for folder, plugin in (("bag_mcap", StoragePlugin.MCAP), ("bag_db3", StoragePlugin.SQLITE3)):
    with Writer(folder, version=9, storage_plugin=plugin) as bag:
        joint = bag.add_connection("/joints", "sensor_msgs/msg/JointState", typestore=types)
        for row, velocities in enumerate(trace.wheels("measured_rad_s")):
            time = 1_700_000_000_000_000_000 + row * 10_000_000
            stamp = of["builtin_interfaces/msg/Time"](sec=time // 10**9, nanosec=time % 10**9)
            header = of["std_msgs/msg/Header"](stamp=stamp, frame_id="base")
            message = of["sensor_msgs/msg/JointState"](header=header, name=list(wheels), position=np.zeros(0),
                                                       velocity=velocities.copy(), effort=np.zeros(0))
            bag.write(joint, time, types.serialize_cdr(message, joint.msgtype))
"""

CELLS = [
    "", "nan", "inf", "-inf", "1e308", "-1e308", "1e400", "5e-324", "0x10", "1,5", "'", '"', '"""', "\0", "é", "abc",
    "-", "9" * 400, "1e99999999", "true", "1970-01-01", "NULL", "\ufeff", "=1+1", "\u202e",
]  # fmt: skip

Case = tuple[list[str], list[str]]


def changed(data: bytes, chance: random.Random) -> bytes:
    """Some bytes changed, taken out, put in, or the end cut off; ends of a file have its tables."""
    out = bytearray(data)
    for _ in range(chance.choice((1, 1, 2, 8))):
        if not out:
            break
        near = min(len(out), 2000)
        at = chance.choice((chance.randrange(len(out)), chance.randrange(near), len(out) - 1 - chance.randrange(near)))
        choice = chance.randrange(6)
        if choice == 0:
            out[at] ^= 1 << chance.randrange(8)
        elif choice == 1:
            out[at] = chance.choice((0, 1, 0x7F, 0x80, 0xFF))
        elif choice == 2:
            del out[at : at + chance.choice((1, 1, 8, 1000))]
        elif choice == 3:
            out[at:at] = bytes(chance.randrange(256) for _ in range(chance.choice((1, 8))))
        elif choice == 4:
            out[at : at + 8] = chance.choice((b"\xff" * 8, b"\0" * 8, b"\x7f" + b"\xff" * 7, b"\xff" * 7 + b"\x7f"))
        elif chance.random() < 0.3:
            del out[at:]
    return bytes(out)


def changed_csv(data: bytes, chance: random.Random) -> bytes:
    """Cells, rows and columns that are none."""
    if chance.random() < 0.3:
        return changed(data, chance)
    lines = data.decode().splitlines()
    for _ in range(chance.choice((1, 1, 3))):
        at = min(chance.choice((0, 1, chance.randrange(len(lines)), len(lines) - 1)), len(lines) - 1)
        cells = lines[at].split(",")
        choice = chance.randrange(9)
        if choice < 4:
            cells[chance.randrange(len(cells))] = chance.choice(CELLS)
            lines[at] = ",".join(cells)
        elif choice == 4:
            # A column of one thing.
            column, cell = chance.randrange(len(cells)), chance.choice(CELLS)
            for row in range(1, len(lines)):
                lines[row] = ",".join([*lines[row].split(",")[:column], cell, *lines[row].split(",")[column + 1 :]])
        elif choice == 5:
            lines[at] = lines[at] * chance.choice((0, 2, 3000))
        elif choice == 6:
            lines[at:at] = lines[at : at + chance.choice((1, 50))]
        elif choice == 7:
            del lines[at : at + chance.choice((1, 50, len(lines)))]
            lines = lines or [""]
        else:
            lines[at] = lines[at].replace(",", chance.choice((";", "\t", ",,", " ", "|")))
    return "\n".join(lines).encode()


def by_hand(folder: Path) -> list[Path]:
    """Files that are no files, or claim more than they are, of every suffix."""
    made = []
    for suffix in (".csv", ".parquet", ".mcap", ".db3", ".toml", ""):
        (folder / f"folder{suffix}").mkdir()
        (folder / f"empty{suffix}").write_bytes(b"")
        (folder / f"zeros{suffix}").write_bytes(b"\0" * 1_000_000)
        (folder / f"endless{suffix}").symlink_to("/dev/zero")
        os.mkfifo(folder / f"pipe{suffix}")
        (folder / f"itself{suffix}").symlink_to(f"itself{suffix}")
        made += [
            folder / f"{name}{suffix}" for name in ("folder", "empty", "zeros", "endless", "pipe", "itself", "nothing")
        ]
    texts = {
        "columns.csv": ",".join(f"c{k}" for k in range(200_000)) + "\n" + ",".join("1" * 200_000) + "\n",
        "line.csv": "time_s," + "a" * 5_000_000 + "\n1,2\n",
        "cell.csv": "time_s,wheel_left_measured_rad_s\n0," + "1" * 20_000_000 + "\n",
        "quote.csv": 'time_s,wheel_left_measured_rad_s\n0,"' + "1\n" * 1_000_000,
        "deep.toml": "a = " + "[" * 100_000 + "]" * 100_000,
        "dotted.toml": ".".join(["a"] * 100_000) + " = 1",
        "long.toml": 'log = "' + "a" * 5_000_000 + '"',
    }
    for name, content in texts.items():
        (folder / name).write_text(content)
        made.append(folder / name)
    # A few kilobytes that unpack to more rows than are allowed, and a text in each.
    rows = pa.table(
        {"time_s": pa.array([0.0] * 1_000_000), "note": pa.array(["a" * 100] * 1_000_000).dictionary_encode()}
    )
    with pq.ParquetWriter(folder / "rows.parquet", rows.schema, compression="zstd") as writer:
        for _ in range(40):
            writer.write_table(rows)
    return [*made, folder / "rows.parquet"]


def commands(log: str, kind: str) -> list[list[str]]:
    """What is done with a log that is of a kind."""
    measured = [["identify", log, "--vehicle", "omni3"], ["identify", "--wheels-off-ground", log, "--vehicle", "omni3"]]
    drawn = {
        "table": [["import", log, "--map", "table.toml", "-o", "OUT"], *measured],
        "recording": [measured[0], ["resimulate", log, "-o", "OUT.svg"]],
        "bag": [["import", log, "--map", "bag.toml", "-o", "OUT"]],
    }
    return drawn[kind]


def cases(setting: Setting, folder: Path) -> Iterator[tuple[str, Case]]:
    """Campaign, words of a command, and the names of which one shall be in what it says."""
    chance = setting.random("measured")
    table, count = files.mutant, setting.count

    def write(name: str, data: bytes) -> str:
        (folder / name).write_bytes(data)
        return name

    base: dict[str, bytes] = {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}
    sources: list[tuple[str, str, Callable[[bytes, random.Random], bytes], int]] = [
        ("drive.csv", "table", changed_csv, 40),
        ("drive.parquet", "table", changed, 30),
        ("drive.mcap", "recording", changed, 15),
    ]
    for source, kind, change, times in sources:
        suffix = source.rpartition(".")[2]
        for k in range(count(times)):
            name = write(f"mutant-{k}.{suffix}", change(base[source], chance))
            for words in commands(name, kind):
                yield f"{suffix}: {words[0]}", (words, [name, "omni3"])
    for kind in ("mcap", "db3"):
        for k in range(count(25)):
            bag = folder / f"bag-{k}-{kind}"
            shutil.copytree(folder / f"bag_{kind}", bag)
            inside = chance.choice(sorted(bag.iterdir()))
            inside.write_bytes(changed(inside.read_bytes(), chance))
            log = chance.choice((bag.name, f"{bag.name}/{next(bag.glob('*.' + kind)).name}"))
            yield f"bag of {kind}: import", (commands(log, "bag")[0], [bag.name, "bag.toml"])
    for k in range(count(40)):
        name = write(f"map-{k}.toml", table(base["table.toml"].decode(), chance))
        yield "map: import", (["import", "drive.csv", "--map", name, "-o", "OUT"], [name, "drive.csv"])
        name = write(f"bagmap-{k}.toml", table(base["bag.toml"].decode(), chance))
        yield "map: import", (["import", "bag_db3", "--map", name, "-o", "OUT"], [name, "bag_db3"])
        name = write(f"runs-{k}.toml", table(base["runs.toml"].decode(), chance))
        yield "runs: calibrate", (["calibrate", name, "--vehicle", "omni3"], [name, "drive.csv", "run["])
    for path in by_hand(folder):
        log = path.name
        every = [
            *commands(log, "table"),
            commands(log, "bag")[0],
            commands(log, "recording")[1],
            ["import", "drive.csv", "--map", log, "-o", "OUT"],
            ["calibrate", log, "--vehicle", "omni3"],
            ["identify", "drive.csv", "--vehicle", log if path.suffix == ".toml" else f"./{log}"],
        ]
        for words in every if setting.long or path.suffix == ".toml" else chance.sample(every, 3):
            yield f"by hand: {words[0]}", (words, [log])


def campaigns(setting: Setting) -> list[Campaign]:
    """Mutants of each kind of file, and files by hand."""
    folder = setting.folder("measured")
    made = run([sys.executable, "-c", MAKE], folder, seconds=120)
    if made.code != 0:
        return [Campaign("measured: what is mutated", 1, "files", [made.err[-300:]])]
    tried: dict[str, Campaign] = {"plain": Campaign("measured, unchanged", unit="commands")}
    plain = [*commands("drive.csv", "table"), *commands("drive.parquet", "table"), *commands("drive.mcap", "recording")]
    plain += [
        *commands("bag_mcap", "bag"),
        *commands("bag_db3", "bag"),
        ["calibrate", "runs.toml", "--vehicle", "omni3"],
    ]
    for words in plain:
        # Without these the mutants reach nothing.
        ended = run([sys.executable, "-m", "omnistep", *(word.replace("OUT", "plain") for word in words)], folder)
        tried["plain"].tried += 1
        if ended.code != 0:
            tried["plain"].failures.append(f"{ended.command}: {ended.err[-200:]}")
    batch: list[tuple[str, Case]] = []
    batches = []
    for number, (name, (words, inputs)) in enumerate(cases(setting, folder)):
        tried.setdefault(name, Campaign(f"measured, {name}", unit="commands")).tried += 1
        words = [word.replace("OUT", f"out-{number}" + ("" if ".svg" in word else ".mcap")) for word in words]
        batch.append((name, (words, inputs)))
        if len(batch) == BATCH:
            batches.append(batch)
            batch = []
    batches.append(batch)

    def attack(item: tuple[int, list[tuple[str, Case]]]) -> str | None:
        number, jobs = item
        listed = folder / f"batch-{number}.json"
        at = 0
        while at < len(jobs):
            listed.write_text(json.dumps([job for _, job in jobs[at:]]))
            # A hang within a reader, or its end by a signal, ends the process: the next one goes on behind it.
            command = [sys.executable, "-c", WORKER, listed.name, SECONDS, LONGEST_MESSAGE]
            ended = run(command, folder, seconds=2 * SECONDS * len(jobs))
            last = -1
            for line in ended.out.splitlines():
                word, _, rest = line.partition(" ")
                if word == "RUNNING":
                    last = int(rest)
                elif word == "FAILED":
                    which, _, why = rest.partition(" ")
                    fail(jobs[at + int(which)], why)
            if "DONE" in ended.out:
                return None
            fail(jobs[at + max(last, 0)], "; ".join(faults(ended)) or f"exit code {ended.code}: {ended.err[-150:]}")
            at += max(last, 0) + 1
        return None

    def fail(job: tuple[str, Case], why: str) -> None:
        name, (words, _) = job
        for word in words:
            path = folder / word
            if path.is_file() and path.stat().st_size < 10_000_000:
                shutil.copy(path, setting.keep / path.name)
            elif path.is_dir() and not (setting.keep / path.name).exists():
                shutil.copytree(path, setting.keep / path.name, symlinks=True)
        tried[name].failures.append(f"in out/attack, omnistep {' '.join(words)}: {why}")

    in_parallel(attack, list(enumerate(batches)))
    return list(tried.values())
