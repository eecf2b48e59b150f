"""Foreign peers: Cyclone DDS in this process, Fast DDS in one of its own (fast_dds.cpp)."""

import os
import signal
import subprocess
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field

from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.qos import Policy, Qos
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration
from messages import dds_name, message

PATIENCE_S = 30.0  # before something that should come is missed: two noisy cores find each other in one or two seconds
DEPTH = 4000  # samples that a reader keeps until it is looked at; more than a test asks for


def until(done: Callable[[], object], what: str, seconds: float = PATIENCE_S) -> object:
    """What `done` returns once it is true; an error where that takes too long."""
    end = time.monotonic() + seconds
    while not (result := done()):
        assert time.monotonic() < end, f"not within {seconds} s: {what}"
        time.sleep(0.01)
    return result


def qos(reliable: bool = True, transient: bool = False, depth: int = DEPTH) -> Qos:
    """As ROS 2 sets it: history, reliability, durability."""
    reliability = Policy.Reliability.Reliable(duration(seconds=1)) if reliable else Policy.Reliability.BestEffort
    durability = Policy.Durability.TransientLocal if transient else Policy.Durability.Volatile
    return Qos(reliability, durability, Policy.History.KeepLast(depth))


@dataclass
class Subscription:
    """What came on a topic: samples, and when they were taken [s]."""

    topic: str
    samples: list = field(default_factory=list, repr=False)
    times_s: list = field(default_factory=list, repr=False)

    def first(self) -> object:
        """The first sample, which is waited for."""
        until(lambda: self.samples, f"a sample of {self.topic}")
        return self.samples[0]

    def after(self, count: int) -> list:
        """The samples, once there are so many."""
        until(lambda: len(self.samples) >= count, f"{count} samples of {self.topic}, {len(self.samples)} came")
        return list(self.samples)


class Cyclone:
    """A participant of Cyclone DDS; a thread takes what comes."""

    def __init__(self, domain: int):
        self.participant = DomainParticipant(domain)
        self.readers: list[tuple[DataReader, Subscription]] = []
        self.going = True
        self.thread = threading.Thread(target=self._take, daemon=True)
        self.thread.start()

    def read(self, topic: str, kind: str, **settings) -> Subscription:
        """Reads a topic, as `/odom` of `nav_msgs/msg/Odometry`."""
        subscription = Subscription(topic)
        wanted = qos(**settings)
        reader = DataReader(self.participant, Topic(self.participant, f"rt{topic}", message(kind)), wanted)
        self.readers.append((reader, subscription))
        return subscription

    def hold(self, topic: str, kind: str, **settings) -> DataReader:
        """A reader whose samples are not taken."""
        wanted = qos(**settings)
        return DataReader(self.participant, Topic(self.participant, f"rt{topic}", message(kind)), wanted)

    def write(self, topic: str, kind: str, matched: bool = True, **settings) -> DataWriter:
        """A writer of a topic, once it has a reader."""
        wanted = qos(**{"depth": 10} | settings)
        writer = DataWriter(self.participant, Topic(self.participant, f"rt{topic}", message(kind)), wanted)
        if matched:
            until(lambda: writer.get_matched_subscriptions(), f"a reader of {topic}")
        return writer

    def _take(self):
        while self.going:
            for reader, subscription in list(self.readers):
                for sample in reader.take(DEPTH):
                    if sample.sample_info.valid_data:
                        subscription.samples.append(sample)
                        subscription.times_s.append(time.monotonic())
            time.sleep(0.005)

    def close(self):
        """Leaves the domain."""
        self.going = False
        self.thread.join()
        self.readers.clear()
        self.participant = None


class FastDds:
    """A process with a participant of Fast DDS; samples are bytes with the header of their encoding."""

    program = os.environ.get("FAST_DDS_PEER", "")

    def __init__(self, domain: int, lease_s: int = 0):
        """`lease_s`: how long others keep a silent peer as alive; 0: as it comes, 20 s."""
        command = [self.program, str(domain), str(lease_s)]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self.samples: dict[str, list[bytes]] = {}
        self.matched: dict[str, int] = {}
        self.ready: set[str] = set()
        self.thread = threading.Thread(target=self._listen, daemon=True)
        self.thread.start()

    def _listen(self):
        for line in self.process.stdout:
            match line.split():
                case b"sample", topic, text:
                    self.samples.setdefault(topic.decode(), []).append(bytes.fromhex(text.decode()))
                case b"matched", topic, count:
                    self.matched[topic.decode()] = int(count)
                case b"ready", topic:
                    self.ready.add(topic.decode())

    def _say(self, line: str):
        self.process.stdin.write(f"{line}\n".encode())
        self.process.stdin.flush()

    def _made(self, verb: str, topic: str, kind: str, reliable: bool, transient: bool, depth: int):
        durability = "transient_local" if transient else "volatile"
        settings = f"{'reliable' if reliable else 'best_effort'} {durability} {depth}"
        self._say(f"{verb} rt{topic} {dds_name(kind)} {settings}")
        until(lambda: f"rt{topic}" in self.ready, f"{verb} {topic} by Fast DDS")

    def read(
        self, topic: str, kind: str, reliable: bool = True, transient: bool = False, depth: int = DEPTH
    ) -> list[bytes]:
        """Reads a topic; what comes is appended to the list."""
        came = self.samples.setdefault(f"rt{topic}", [])
        self._made("read", topic, kind, reliable, transient, depth)
        return came

    def hold(self, topic: str, kind: str, reliable: bool = True, transient: bool = False, depth: int = 10):
        """A reader whose samples are not taken."""
        self._made("hold", topic, kind, reliable, transient, depth)

    def write(self, topic: str, kind: str, reliable: bool = True, transient: bool = False, depth: int = 10):
        """A writer of a topic, once it has a reader."""
        self._made("write", topic, kind, reliable, transient, depth)
        until(lambda: self.matched.get(f"rt{topic}"), f"a reader of {topic} for Fast DDS")

    def send(self, topic: str, sample: bytes):
        """A sample, with its header."""
        self._say(f"send rt{topic} {sample.hex()}")

    def kill(self):
        """Ends the peer as a crash would: it does not say goodbye."""
        self.process.send_signal(signal.SIGKILL)
        self.process.wait()

    def close(self):
        """Leaves the domain, if it has not been killed."""
        self.process.stdin.close()
        self.process.wait()
        self.thread.join()
        self.process.stdout.close()
