"""Foreign logs as samples: CSV, Parquet, rosbag2; the only module that names the readers of rosbags."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from omnistep._bag_limits import bounded
from omnistep._log_map import TIMES, LogMap, Signal
from omnistep._omnistep import recover, shortened
from omnistep._recorded_command import MOST_S
from omnistep._tables import (
    MOST_SAMPLES,
    SUFFIXES,
    Floats,
    Skipped,
    check_packed,
    columns_of,
    floats,
    module,
    names_of,
    needs,
    reading,
)
from omnistep._toml_files import no_file
from omnistep.errors import LogError

#: Up to this many columns are all named if one is missing; of more, the nearest.
FEW_COLUMNS = 20
#: Longest time between samples of a log: beyond it, nanoseconds become coarse [s].
MOST_APART_S = 1e7
#: Most control periods: an hour at 1 kHz.
MOST_ROWS = 3_600_000
#: Most control periods per sample, beyond a minimum: more periods would add no information from the log.
ROWS_PER_SAMPLE, FEW_ROWS = 100, 100_000
#: Fields of these message types for each signal; ``yaw(...)`` is the heading of a quaternion.
_POSE = ("position.x", "position.y", "yaw(orientation)")
_TWIST = ("linear.x", "linear.y", "angular.z")
_PLACES = {
    ("command", "geometry_msgs/msg/Twist"): _TWIST,
    ("command", "geometry_msgs/msg/TwistStamped"): tuple(f"twist.{name}" for name in _TWIST),
    ("gyro", "sensor_msgs/msg/Imu"): tuple(f"angular_velocity.{axis}" for axis in "xyz"),
    ("accelerometer", "sensor_msgs/msg/Imu"): tuple(f"linear_acceleration.{axis}" for axis in "xyz"),
}
for _table in ("pose", "odometry"):
    for _type, _at in (
        ("nav_msgs/msg/Odometry", "pose.pose."),
        ("geometry_msgs/msg/PoseWithCovarianceStamped", "pose.pose."),
        ("geometry_msgs/msg/PoseStamped", "pose."),
    ):
        _PLACES[_table, _type] = (f"{_at}{_POSE[0]}", f"{_at}{_POSE[1]}", f"yaw({_at}orientation)")
#: First and last bytes of an MCAP file.
_MAGIC = b"\x89MCAP0\r\n"
_JOINTS = "sensor_msgs/msg/JointState"
#: Names of joints that are kept, to say which there are.
MOST_JOINTS = 1000

Nanoseconds = NDArray[np.int64]

#: Up to this many columns are all named if one is missing; of more, the nearest.
FEW_COLUMNS = 20


@dataclass(frozen=True)
class Samples:
    """A recorded signal, one row for each sample: times [ns] and the raw numbers, NaN for a missing one."""

    time_ns: Nanoseconds
    values: Floats


def read_samples(
    path: Path, log_map: LogMap, progress: Callable[[float], None], skipped: Skipped | None = None
) -> tuple[dict[str, Samples], str]:
    """Read every signal that a map names, and describe the missing part of the log.

    With ``skipped`` the lines of a CSV file that cannot be read are left out.
    """
    if not path.exists():
        raise LogError(no_file(path, "file or folder"), file=str(path))
    suffix = path.suffix.lower()
    if suffix in SUFFIXES:
        if not path.is_file():
            raise LogError(no_file(path), file=str(path))
        return _of_table(path, log_map, skipped if suffix == ".csv" else None), ""
    if _is_cut_off(path):
        with tempfile.TemporaryDirectory() as folder:
            whole = Path(folder) / path.name
            until_s = recover(path, whole)
            samples = _of_bag(path, whole, log_map, progress)
        return samples, f"its end is missing, as of a recording that was cut off: {until_s:.6g} s read"
    if path.is_dir() or (suffix in (".mcap", ".db3") and path.is_file()):
        return _of_bag(path, path, log_map, progress), ""
    if suffix == ".bag":
        how = "rosbags-convert --src IN.bag --dst OUT"
        raise LogError(f"{path}: a bag of ROS 1, allowed: a rosbag2, by {how}", file=str(path))
    allowed = "a regular file .csv, .parquet, .mcap or .db3, or the folder of a rosbag2"
    raise LogError(f"{path}: not a log that can be read, allowed: {allowed}", file=str(path))


def span(path: Path, log_map: LogMap, first_ns: int, last_ns: int, samples: int) -> tuple[int, int]:
    """Start of the first control period [ns] and the number of periods, of a log with wheels from a time to another."""
    period_ns = round(log_map.scenario.period_s * 1e6) * 1000
    begin = first_ns if log_map.from_s is None else round(log_map.from_s * 1e9)
    end = last_ns if log_map.until_s is None else min(round(log_map.until_s * 1e9), last_ns)
    length_s = (end - begin) * 1e-9
    if not period_ns <= end - begin <= MOST_S * 1e9:
        limits = (
            f"{period_ns * 1e-9:g} to {MOST_S:g} s from its first wheel's sample, or [time] from_s, on; [time] unit"
        )
        raise LogError(f"{path}: {length_s:g} s, allowed: {limits}", file=str(path))
    rows = (end - begin) // period_ns + 1
    most = min(MOST_ROWS, max(FEW_ROWS, ROWS_PER_SAMPLE * samples))
    if rows > most:
        found = f"{rows} control periods for {samples} samples"
        log_map.refuse("period_s", f"{period_ns * 1e-9:g}: {found}, allowed: {most}")
    return begin, rows


# Tables


def _of_table(path: Path, log_map: LogMap, skipped: Skipped | None) -> dict[str, Samples]:
    for table, signal in log_map.signals.items():
        if signal.topic is not None:
            log_map.refuse(f"{table}.topic", f"{signal.topic!r}: {path} is a table, allowed: none")
        if not signal.names:
            log_map.refuse(f"{table}.names", f"missing, allowed: columns of {path}")
    if log_map.time_column is None:
        log_map.refuse("time.column", f"missing, allowed: a column of {path}")
    wanted = {log_map.time_column: "time.column"}
    for table, signal in log_map.signals.items():
        wanted.update(dict.fromkeys(signal.names, f"{table}.names"))
    try:
        module("pyarrow")  # of both readers
    except ImportError as error:
        raise needs("pyarrow", "omnistep import", "import") from error
    with reading(path):
        columns = names_of(path, list(wanted) if skipped else ())
    if not set(wanted) & set(columns) and any(_is_number(name) for name in columns):
        raise LogError(
            f"{path}: the first line has numbers, allowed: the columns' names, as in the map", file=str(path)
        )
    for name, key in wanted.items():
        if columns.count(name) != 1:
            few = len(columns) <= FEW_COLUMNS
            near = columns if few else get_close_matches(name, columns, n=3, cutoff=0.5) or columns
            if path.suffix.lower() == ".csv" and skipped is None and names_of(path, list(wanted)) != columns:
                what = "the first line does not name the columns, another one does"
                raise LogError(f"{path}: {what}, allowed: names first; or --skip-bad-lines", file=str(path))
            found = "no column" if name not in columns else "more than one column"
            log_map.refuse(key, f"{found} {name!r} in {path}, there are: {', '.join(near)}")
    # Of a packed file the times first: they say whether the rest is worth unpacking.
    first = [log_map.time_column] if path.suffix.lower() == ".parquet" else list(wanted)
    rest = [name for name in wanted if name not in first]
    with reading(path):
        check_packed(path, list(wanted), log_map.time_column)
        try:
            table_of = columns_of(path, first, time=log_map.time_column, skipped=skipped)
        except LogError as error:
            if f"{path}: line " in str(error):
                raise LogError(f"{error}; or --skip-bad-lines", file=str(path)) from error
            raise
        time_ns = _times(path, table_of[log_map.time_column], log_map)
        if rest:
            span(path, log_map, 0, int(time_ns.max()), time_ns.size)
            table_of |= columns_of(path, rest)
        return {
            table: Samples(time_ns, np.column_stack([floats(path, name, table_of[name]) for name in signal.names]))
            for table, signal in log_map.signals.items()
        }


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _times(path: Path, column: Any, log_map: LogMap) -> Nanoseconds:
    """Times since the first one [ns]; a row without a time is sorted before all others, and left out."""
    pyarrow = module("pyarrow")
    unit_s = log_map.time_unit_s
    if pyarrow.types.is_timestamp(column.type):
        unit_s = TIMES[column.type.unit]
        column = column.cast(pyarrow.int64())

    def refuse(what: str) -> NoReturn:
        raise LogError(f"{path}: column {log_map.time_column}: {what}", file=str(path))

    if column.null_count:
        refuse(f"{column.null_count} empty cells, allowed: a time in every row")
    whole = pyarrow.types.is_integer(column.type)
    times = column.to_numpy() if whole else floats(path, str(log_map.time_column), column)
    if not np.isfinite(times).all():
        refuse("not finite, allowed: a time in every row")
    # As Python's numbers, which do not overflow.
    apart_s = (times.max().item() - times.min().item()) * unit_s
    if apart_s > MOST_APART_S:
        refuse(f"times {apart_s:g} s apart, allowed: {MOST_APART_S:g} s; its unit may be another than {unit_s:g} s")
    # Nanoseconds since 1970 exceed the precision of a double: differences are formed first.
    since = times - times.min()
    return np.asarray(np.rint(since.astype(np.float64) * (unit_s * 1e9)), dtype=np.int64)


# Bags


def _of_bag(path: Path, file: Path, log_map: LogMap, progress: Callable[[float], None]) -> dict[str, Samples]:
    """Signals of a file or folder, which messages call ``path``."""
    for table, signal in log_map.signals.items():
        if signal.topic is None:
            log_map.refuse(f"{table}.topic", f"missing, allowed: a topic of {path}")
    if log_map.time_column is not None:
        log_map.refuse("time.column", f"{log_map.time_column!r}: {path} is a bag, allowed: none")
    try:
        typesys, reader = module("rosbags.typesys"), module("rosbags.highlevel").AnyReader
    except ImportError as error:
        raise needs("rosbags", "omnistep import", "import") from error
    types = typesys.get_typestore(typesys.Stores.LATEST)
    with reading(path), bounded(file) as unpacking, reader([file], default_typestore=types) as bag:
        getters: dict[str, list[tuple[str, Callable[[Any], Sequence[float]]]]] = {}
        for table, signal in log_map.signals.items():
            topic = str(signal.topic)
            if topic not in bag.topics:
                near = get_close_matches(topic, bag.topics, n=3) or sorted(bag.topics)
                log_map.refuse(f"{table}.topic", f"no {topic!r} in {path}, there are: {', '.join(near) or 'none'}")
            getters.setdefault(topic, []).append((table, _getter(log_map, signal, bag.topics[topic].msgtype or "")))
        unpacking.begin()
        unpacking.check_index(bag, set(getters))
        stamps: dict[str, list[int]] = {topic: [] for topic in getters}
        arrivals: dict[str, list[int]] = {topic: [] for topic in getters}
        values: dict[str, list[Sequence[float]]] = {table: [] for table in log_map.signals}
        joints: dict[str, set[str]] = {}
        connections = [connection for connection in bag.connections if connection.topic in getters]
        count = max(sum(connection.msgcount for connection in connections), 1)
        for number, (connection, received, raw) in enumerate(bag.messages(connections=connections)):
            if number % 4096 == 0:
                progress(min(number / count, 1.0))
            _most(path, number)
            message = bag.deserialize(raw, connection.msgtype)
            stamps[connection.topic].append(_stamp(message) if log_map.clock == "header" else 0)
            arrivals[connection.topic].append(received)
            for table, get in getters[connection.topic]:
                values[table].append(get(message))
                if connection.msgtype == _JOINTS and len(joints.setdefault(table, set())) < MOST_JOINTS:
                    joints[table].update(message.name)
    times = _of_one_clock(path, log_map, stamps, arrivals)
    samples = {}
    for table, signal in log_map.signals.items():
        seen = joints.get(table)
        if seen and not seen & set(signal.names):
            near = get_close_matches(signal.names[0], seen, n=3) or sorted(seen)[:8]
            log_map.refuse(f"{table}.names", f"none of them on {signal.topic} in {path}, there are: {', '.join(near)}")
        rows = np.array(values[table], dtype=np.float64).reshape(-1, len(signal.factors))
        samples[table] = Samples(times[str(signal.topic)], rows)
    return samples


def _is_cut_off(path: Path) -> bool:
    """Whether it is an MCAP file without its end and index, as from a recorder with a flat battery."""
    if path.suffix.lower() != ".mcap" or not path.is_file():
        return False
    with path.open("rb") as file:
        begin = file.read(len(_MAGIC))
        file.seek(-min(path.stat().st_size, len(_MAGIC)), 2)
        end = file.read()
    return begin == _MAGIC and end != _MAGIC


def _of_one_clock(
    path: Path, log_map: LogMap, stamps: dict[str, list[int]], arrivals: dict[str, list[int]]
) -> dict[str, Nanoseconds]:
    """Times of every topic since the first message [ns], all of the clock of the map."""
    times = arrivals
    # A simulated clock may begin with 0: a topic has no stamps only if all stamps are 0.
    stamped = [topic for topic, of_topic in stamps.items() if any(of_topic)]
    if log_map.clock == "header" and stamped:
        times = stamps
        without = [topic for topic, of_topic in stamps.items() if of_topic and topic not in stamped]
        if without:
            reason = f"messages on {without[0]} have no time stamps, those on {stamped[0]} have"
            log_map.refuse("time.clock", f'"header": {reason}, allowed: "received"')
    there = {topic: of_topic for topic, of_topic in times.items() if of_topic}
    if not there:
        return {topic: np.empty(0, dtype=np.int64) for topic in times}
    start, first = min((min(of_topic), topic) for topic, of_topic in there.items())
    end, last = max((max(of_topic), topic) for topic, of_topic in there.items())
    apart_s = (end - start) * 1e-9
    if apart_s > MOST_APART_S:
        reason = (
            f"messages on {' and '.join(sorted({first, last}))} are {apart_s:g} s apart, allowed: {MOST_APART_S:g} s"
        )
        raise LogError(f"{path}: {shortened(reason)}", file=str(path))
    return {topic: np.array([time - start for time in of_topic], dtype=np.int64) for topic, of_topic in times.items()}


def _most(path: Path, number: int) -> None:
    if number > MOST_SAMPLES:
        raise LogError(f"{path}: more than {MOST_SAMPLES} messages on the topics to read", file=str(path))


def _stamp(message: Any) -> int:
    """The time stamp of a message [ns]; 0 if it has none."""
    stamp = getattr(getattr(message, "header", None), "stamp", None)
    return int(stamp.sec) * 1_000_000_000 + int(stamp.nanosec) if stamp is not None else 0


def _getter(log_map: LogMap, signal: Signal, kind: str) -> Callable[[Any], Sequence[float]]:
    """A function that reads a signal's numbers from a message of a type."""
    key = f"{signal.table}.names"
    if kind == _JOINTS:
        if not signal.names:
            log_map.refuse(key, f"missing, allowed: joints of {signal.topic}")
        if signal.table == "duty":
            log_map.refuse(
                "duty.topic", f"{signal.topic!r} has a {_JOINTS}, which has no duty cycles, allowed: another type"
            )
        holds = "position" if signal.positions or signal.table == "hinges" else "velocity"
        if signal.table in ("torques", "commanded_torques"):
            holds = "effort"
        return _joints(signal.names, holds)
    names = signal.names or _PLACES.get((signal.table, kind), ())
    if not names:
        log_map.refuse(key, f"missing, allowed: fields of {kind or 'messages of more than one type'}, such as data.0")
    if len(names) != len(signal.factors):
        log_map.refuse(key, f"{len(names)} fields, allowed: {len(signal.factors)}")
    fields = [_field(log_map, key, name) for name in names]
    return lambda message: [get(message) for get in fields]


def _joints(names: Sequence[str], holds: str) -> Callable[[Any], Sequence[float]]:
    known: dict[tuple[str, ...], list[int | None]] = {}

    def get(message: Any) -> Sequence[float]:
        there = tuple(message.name)
        if there not in known:
            known.clear()
            known[there] = [there.index(name) if name in there else None for name in names]
        values = getattr(message, holds)
        return [math.nan if at is None or at >= len(values) else float(values[at]) for at in known[there]]

    return get


def _field(log_map: LogMap, key: str, name: str) -> Callable[[Any], float]:
    yaw = name.startswith("yaw(") and name.endswith(")")
    path = (name[4:-1] if yaw else name).split(".")

    def get(message: Any) -> float:
        here = message
        for step in path:
            try:
                here = here[int(step)] if step.isdecimal() else getattr(here, "" if step.startswith("_") else step)
            except (AttributeError, IndexError, TypeError):
                kind = getattr(message, "__msgtype__", type(message).__name__)
                log_map.refuse(key, f"no field {name!r} in a message of type {kind}")
        if yaw:
            return math.atan2(2.0 * (here.w * here.z + here.x * here.y), 1.0 - 2.0 * (here.y**2 + here.z**2))
        if isinstance(here, str | bytes) or not np.isscalar(here):
            log_map.refuse(key, f"field {name!r} is not a number")
        return float(here)  # type: ignore[arg-type]

    return get
