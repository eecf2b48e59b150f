"""Opens a log with independent readers and exits with 1 if one of them finds a fault.

usage: python scripts/checks/log.py LOG.mcap [--require TOPIC ...]
"""

import argparse
import struct
import sys
import zlib
from collections import Counter
from pathlib import Path

from mcap.reader import SeekingReader
from mcap.records import DataEnd, Footer
from mcap.stream_reader import StreamReader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

MAGIC = b"\x89MCAP0\r\n"


def check_summary_crc(path: Path) -> None:
    """The one checksum that no reader below looks at: that of the summary section."""
    data = path.read_bytes()
    tail = len(data) - len(MAGIC)
    if data[tail:] != MAGIC:
        raise ValueError("the file does not end with the magic bytes")
    start, _, crc = struct.unpack("<QQI", data[tail - 20 : tail])
    if crc == 0:
        raise ValueError("the summary section has no checksum")
    if zlib.crc32(data[start : tail - 4]) != crc:
        raise ValueError("the summary section's checksum does not match")


def check_stream(path: Path) -> Counter:
    """Checksums of chunks and data section, front to back."""
    kinds: Counter = Counter()
    with path.open("rb") as file:
        for record in StreamReader(file, validate_crcs=True).records:
            kinds[type(record).__name__] += 1
            if isinstance(record, DataEnd) and record.data_section_crc == 0:
                raise ValueError("the data section has no checksum")
    if kinds[DataEnd.__name__] != 1 or kinds[Footer.__name__] != 1:
        raise ValueError("the file is not complete")
    return kinds


def check_mcap(path: Path):
    """Counts by topic, and the first VehicleState, as `mcap` and `mcap-ros2-support` see them."""
    counts: Counter = Counter()
    sequences: dict[str, int] = {}
    first = None
    with path.open("rb") as file:
        reader = SeekingReader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        header = reader.get_header()
        print(f"profile {header.profile!r}, library {header.library!r}")
        for schema, channel, message, decoded in reader.iter_decoded_messages(log_time_order=False):
            if message.sequence != sequences.get(channel.topic, 0):
                raise ValueError(f"{channel.topic}: sequence {message.sequence} is out of order")
            if message.log_time != message.publish_time:
                raise ValueError(f"{channel.topic}: log time and publish time differ")
            sequences[channel.topic] = message.sequence + 1
            counts[channel.topic] += 1
            if first is None and schema.name == "omnistep_msgs/msg/VehicleState":
                first = decoded
        for record in reader.iter_metadata():
            print(f"metadata {record.name!r}: {record.metadata}")
        for record in reader.iter_attachments():
            print(f"attachment {record.name!r}, {record.media_type}, {len(record.data)} bytes")
        summary = reader.get_summary()
        if summary is None or summary.statistics is None:
            raise ValueError("the file has no summary")
        if summary.statistics.message_count != sum(counts.values()):
            raise ValueError("the statistics count other messages than the file holds")
    return counts, first


def check_rosbags(path: Path):
    """Counts by topic, and the first VehicleState, as `rosbags` sees them; definitions must be those of ROS 2."""
    reference = get_typestore(Stores.ROS2_JAZZY)
    counts: Counter = Counter()
    first = None
    with AnyReader([path]) as reader:
        for connection in reader.connections:
            for name in get_types_from_msg(connection.msgdef.data, connection.msgtype):
                if name in reference.fielddefs and reader.typestore.hash_rihs01(name) != reference.hash_rihs01(name):
                    raise ValueError(f"{connection.topic}: {name} is not defined as in ROS 2")
        for connection, _, raw in reader.messages():
            message = reader.deserialize(raw, connection.msgtype)
            size = len(bytes(reader.typestore.serialize_cdr(message, connection.msgtype)))
            if size != len(raw):  # a reader that stops early would not notice
                raise ValueError(f"{connection.topic}: {len(raw)} bytes, but the type has {size}")
            counts[connection.topic] += 1
            if first is None and connection.msgtype == "omnistep_msgs/msg/VehicleState":
                first = message
    return counts, first


def main() -> int:
    """Check the log named on the command line; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("log", type=Path)
    parser.add_argument("--require", nargs="*", default=[], metavar="TOPIC", help="topics that must have messages")
    arguments = parser.parse_args()
    try:
        check_summary_crc(arguments.log)
        kinds = check_stream(arguments.log)
        counts, first = check_mcap(arguments.log)
        bag_counts, bag_first = check_rosbags(arguments.log)
        if counts != bag_counts:
            raise ValueError(f"the readers disagree: {dict(counts)} and {dict(bag_counts)}")
        if missing := [topic for topic in arguments.require if not counts[topic]]:
            raise ValueError(f"no messages on {', '.join(missing)}")
    except Exception as error:  # whatever a reader raises is a fault of the file
        print(f"{arguments.log}: {type(error).__name__}: {error}", file=sys.stderr)
        return 1
    print("records:", dict(kinds))
    for topic, count in sorted(counts.items()):
        print(f"{count:8d}  {topic}")
    print("first VehicleState by mcap-ros2-support:", first, sep="\n")
    print("first VehicleState by rosbags:", bag_first, sep="\n")
    print(f"{arguments.log}: ok")
    return 0


if __name__ == "__main__":
    sys.exit(main())
