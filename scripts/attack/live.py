"""Clients of a live run that do what they should not: raw sockets, so that nothing is too wrong to be sent."""

import base64
import json
import os
import re
import shlex
import socket
import struct
import subprocess
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import http_requests
from campaign import MEMORY_KIB, Campaign, Setting, limited, run

# A handshake may take 10 s; a machine under load is slower.
HANDSHAKE_S = 15
# A command holds for 0.5 s after the last; the vehicle's own ramp and a busy machine are slower.
COMMAND_LOST_S = 3
# What a run says that may open no more files, and of a client that does not read.
WAITS = re.compile(r"live: (new connections wait until others end|client \d+ was disconnected): .+")


@dataclass
class Client:
    """A WebSocket client, as little of one as is needed."""

    port: int
    wire: socket.socket = field(init=False)
    buffer: bytes = b""

    def __post_init__(self) -> None:
        self.wire = socket.create_connection(("127.0.0.1", self.port), timeout=5)

    def shake(self, headers: dict[str, str] | None = None) -> int:
        """The handshake; the status that it is answered with, 0 for none."""
        own = {
            "Host": f"127.0.0.1:{self.port}",
            "Upgrade": "websocket",
            "Connection": "Upgrade",
            "Sec-WebSocket-Version": "13",
            "Sec-WebSocket-Key": base64.b64encode(os.urandom(16)).decode(),
            "Sec-WebSocket-Protocol": "foxglove.sdk.v1",
        } | (headers or {})
        lines = "".join(f"{name}: {value}\r\n" for name, value in own.items())
        try:
            self.wire.sendall(f"GET / HTTP/1.1\r\n{lines}\r\n".encode())
            while b"\r\n\r\n" not in self.buffer:
                received = self.wire.recv(4096)
                if not received:
                    return 0
                self.buffer += received
        except OSError:
            return 0
        head, self.buffer = self.buffer.split(b"\r\n\r\n", 1)
        return int(head.split()[1])

    def send(self, payload: bytes, opcode: int = 1, head: bytes | None = None) -> None:
        """A whole masked frame, or one with another head."""
        if head is None:
            length = len(payload)
            size = struct.pack("!BH", 254, length) if length > 125 else bytes([128 | length])
            head = bytes([128 | opcode]) + size + bytes(4)
        self.wire.sendall(head + payload)

    def frames(self, seconds: float) -> Iterator[tuple[int, bytes]]:
        """Frames that come within the time."""
        until = time.monotonic() + seconds
        while (left := until - time.monotonic()) > 0:
            if frame := self._frame():
                yield frame
                continue
            self.wire.settimeout(left)
            try:
                received = self.wire.recv(65536)
            except TimeoutError:
                return
            if not received:
                return
            self.buffer += received

    def _frame(self) -> tuple[int, bytes] | None:
        if len(self.buffer) < 2:
            return None
        size, at = self.buffer[1] & 127, 2
        if size > 125:
            at = 4 if size == 126 else 10
            if len(self.buffer) < at:
                return None
            size = int.from_bytes(self.buffer[2:at], "big")
        if len(self.buffer) < at + size:
            return None
        frame = self.buffer[0] & 15, self.buffer[at : at + size]
        self.buffer = self.buffer[at + size :]
        return frame

    def texts(self, seconds: float) -> Iterator[dict[str, object]]:
        """Messages in JSON."""
        for opcode, payload in self.frames(seconds):
            if opcode == 1:
                yield json.loads(payload)

    def say(self, message: object) -> None:
        """A message in JSON."""
        self.send(json.dumps(message).encode())

    def subscribe(self, topic: str) -> None:
        """Waits for the topic and asks for it."""
        for message in self.texts(5):
            for channel in message.get("channels", []) if message.get("op") == "advertise" else []:  # type: ignore[attr-defined]
                if channel["topic"] == topic:
                    self.say({"op": "subscribe", "subscriptions": [{"id": 1, "channelId": channel["id"]}]})
                    return
        raise TimeoutError(f"no channel {topic}")

    def publish(self, vx_m_s: float) -> None:
        """A twist on /cmd_vel."""
        channel = {"id": 7, "topic": "/cmd_vel", "encoding": "json", "schemaName": "geometry_msgs/msg/Twist"}
        self.say({"op": "advertise", "channels": [channel]})
        twist = {"linear": {"x": vx_m_s, "y": 0, "z": 0}, "angular": {"x": 0, "y": 0, "z": 0}}
        self.send(struct.pack("<BI", 1, 7) + json.dumps(twist).encode(), opcode=2)


@contextmanager
def serving(setting: Setting, *extra: object, limits: str = "") -> Iterator[tuple[subprocess.Popen[bytes], int, Path]]:
    """A live run, its port, and the file of what it says."""
    said = setting.work / f"live-{time.monotonic_ns()}"
    command = [setting.omnistep, "run", "flat", "--live", "--port", "0", "--json", "--set", "duration_s=600", *extra]
    with said.open("wb") as file:
        process = subprocess.Popen(limited(command, MEMORY_KIB, limits), stdout=subprocess.PIPE, stderr=file)
        try:
            until = time.monotonic() + 10
            while not (found := re.search(rb"ws://127\.0\.0\.1:(\d+)", said.read_bytes())):
                if process.poll() is not None or time.monotonic() > until:
                    shown = " ".join(shlex.quote(str(word)) for word in command)
                    raise Refused(f"{shown}: {said.read_text().strip()[:150]}")
                time.sleep(0.02)
            yield process, int(found[1]), said
        finally:
            process.kill()
            process.wait()


class Refused(Exception):
    """The run did not start."""


def is_served(port: int) -> bool:
    """Does a viewer still get the server's greeting?"""
    try:
        client = Client(port)
        return client.shake() == 101 and any(text.get("op") == "serverInfo" for text in client.texts(5))
    except OSError:
        return False


def idle(setting: Setting) -> str | None:
    """50 sockets that say nothing, where 40 files may be open: a viewer is served again, or the run says why not."""
    with serving(setting, limits="ulimit -n 40;") as (process, port, said):
        sockets = []
        for _ in range(50):
            try:
                sockets.append(socket.create_connection(("127.0.0.1", port), timeout=1))
            except OSError:
                break
        time.sleep(0.5)
        for one in sockets:
            one.close()
        until, fine = time.monotonic() + HANDSHAKE_S, False
        while not fine and process.poll() is None and time.monotonic() < until:
            fine = any(map(WAITS.fullmatch, since(said))) or is_served(port)
            time.sleep(0.5)
        if other := [line for line in since(said) if not WAITS.fullmatch(line)]:
            return f"50 idle sockets under `ulimit -n 40`: the run says {other[0]}"
        if process.poll() is not None:
            return f"50 idle sockets under `ulimit -n 40`: the run ended with {process.returncode}"
        return None if fine else "50 idle sockets under `ulimit -n 40` closed the port for good, and nothing is said"


def since(said: Path) -> list[str]:
    """Whole lines that a live run said after that of its port."""
    _, _, rest = said.read_text(errors="replace").partition("serving ws://")
    return [line.rstrip("\n") for line in rest.splitlines(keepends=True)[1:] if line.endswith("\n")]


def half_open(setting: Setting) -> str | None:
    """Handshakes that are never finished are closed."""
    with serving(setting) as (_, port, _):
        sockets = [socket.create_connection(("127.0.0.1", port), timeout=HANDSHAKE_S) for _ in range(20)]
        for one in sockets:
            one.sendall(b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n")
        until, still = time.monotonic() + HANDSHAKE_S, 0
        for one in sockets:
            one.settimeout(max(until - time.monotonic(), 0.05))
            try:
                while one.recv(4096):
                    pass
            except TimeoutError:
                still += 1
            except OSError:
                pass
        if still:
            return f"{still} of 20 half-open handshakes are held for more than {HANDSHAKE_S} s"
        return None if is_served(port) else "no viewer is served after half-open handshakes"


def pages(setting: Setting) -> str | None:
    """Who comes from a foreign page, or by a foreign name, is rejected; who comes from a viewer is not."""
    wrong = []
    with serving(setting) as (_, port, _):
        for allowed, headers in (
            (True, {}),
            (True, {"Origin": "http://localhost:8080"}),
            (True, {"Origin": "https://app.foxglove.dev"}),
            (True, {"Host": f"localhost:{port}"}),
            (False, {"Origin": "https://evil.example"}),
            (False, {"Origin": "http://localhost.evil.example"}),
            (False, {"Origin": "https://app.foxglove.dev.evil.example"}),
            (False, {"Origin": "null"}),
            (False, {"Host": "evil.example"}),
            (False, {"Host": f"evil.example:{port}"}),
            (False, {"Host": "localhost.evil.example"}),
        ):
            status = Client(port).shake(headers)
            if (status == 101) != allowed:
                wrong.append(f"{headers} is answered with {status}")
    return "; ".join(wrong) or None


def requests(setting: Setting) -> str | None:
    """Requests that are none, too long or never read: each is rejected or closed, and others are served still."""
    taken = []
    with serving(setting) as (process, port, _):
        for request in http_requests.WRONG:
            status = http_requests.answered(port, request, HANDSHAKE_S)
            if status is None or 0 < status < 400:
                taken.append(f"{request[:60]!r} is answered with {status}")
        with http_requests.deaf(port, 50):
            status = http_requests.answered(port, http_requests.PAGE, HANDSHAKE_S)
        if process.poll() is not None:
            return f"the run ended with {process.returncode}"
        if status != 200:
            taken.append(f"the page is answered with {status} then")
        if not is_served(port):
            taken.append("no viewer is served then")
    return "; ".join(taken) or None


def malformed(setting: Setting) -> str | None:
    """Frames that are none: the next viewer is served."""
    heads = [
        b"\xff" * 10,
        b"\x81\xff" + b"\xff" * 8 + bytes(4),  # 2^64 - 1 bytes
        b"\x82\xff" + struct.pack("!Q", 1 << 33) + bytes(4),
        b"\x81\x05",  # not masked
        b"\x89\xfe\x10\x00" + bytes(4),  # a ping that is too long
        b"\x80\x80" + bytes(4),  # goes on with nothing
        b"\xf1\x80" + bytes(4),  # reserved bits
        b"\x88\x81" + bytes(4),  # a close of one byte
    ]
    payloads: list[tuple[int, bytes]] = [
        (1, b"\xff\xfe"),
        (1, b"{" * 60_000),
        (1, b"[" * 60_000),
        (1, json.dumps({"op": "subscribe", "subscriptions": [{"id": -1, "channelId": 1 << 70}]}).encode()),
        (
            1,
            json.dumps({"op": "subscribe", "subscriptions": [{"id": k, "channelId": k} for k in range(2000)]}).encode(),
        ),
        (1, json.dumps({"op": "setParameters", "parameters": [{"name": "x" * 50_000, "value": [[[]]]}]}).encode()),
        (1, json.dumps({"op": "advertise", "channels": [{"id": 1, "topic": "/cmd_vel"}]}).encode()),
        (1, b'{"op": "getParameters", "parameterNames": 1e999}'),
        (2, b""),
        (2, b"\1"),
        (2, b"\1\xff\xff\xff\xff" + bytes(100)),
        (2, bytes(60_000)),
        (9, bytes(125)),
        (3, b"reserved"),
    ]
    with serving(setting) as (process, port, _):
        for head in heads:
            _attempt(port, b"x" * 100, head=head)
        for opcode, payload in payloads:
            _attempt(port, payload, opcode=opcode)
        if process.poll() is not None:
            return f"the run ended with {process.returncode}"
        return None if is_served(port) else "no viewer is served after malformed frames"


def _attempt(port: int, payload: bytes, opcode: int = 1, head: bytes | None = None) -> None:
    """Sends it; that the server closes is its right."""
    client = Client(port)
    try:
        if client.shake() == 101:
            client.send(payload, opcode, head)
            client.wire.settimeout(0.05)
            client.wire.recv(4096)
    except OSError:
        pass
    finally:
        client.wire.close()


def not_asked(setting: Setting) -> str | None:
    """Without --allow-control no client steers: the metrics are those of a run without clients."""
    length = ["--set", "duration_s=1"]
    alone = run(
        [setting.omnistep, "run", "flat", "--json", "--quiet", *length, "--out", setting.work / "alone"], setting.work
    )
    with serving(setting, *length, "--wait") as (process, port, _):
        client = Client(port)
        client.shake()
        client.subscribe("/odom")
        values = {"command.vx_m_s": -0.3, "control.policy": "scale_torques", "vehicle.motor.stall_torque_n_m": 0.5}
        parameters = [{"name": name, "value": value} for name, value in values.items()]
        client.say({"op": "setParameters", "id": "x", "parameters": parameters})
        client.publish(-0.3)
        for _ in client.frames(20):
            if process.poll() is not None:
                break
        out, _ = process.communicate(timeout=20)
    metrics, seen = json.loads(alone.out), json.loads(out)
    # The run alone also tells its policy, its speed and its log.
    if missing := seen.keys() - metrics.keys():
        return f"a run alone does not tell {', '.join(sorted(missing))}"
    if "work_j" not in seen:
        return "a live run does not tell its work"
    other = [f"{key} {metrics[key]} alone, {value} live" for key, value in seen.items() if metrics[key] != value]
    return f"steered without --allow-control: {'; '.join(other)}" if other else None


def lost(setting: Setting) -> str | None:
    """Who steers and goes leaves a vehicle at rest."""
    wrong = []
    for how in ("goes", "is silent"):
        with serving(setting, "--allow-control") as (_, port, _):
            viewer, driver = Client(port), Client(port)
            viewer.shake()
            viewer.subscribe("/cmd_vel")
            driver.shake()
            driver.publish(-0.3)
            followed = speed(viewer, lambda vx: vx < -0.25, 5)
            if how == "goes":
                driver.wire.close()
            rests = followed and speed(viewer, lambda vx: abs(vx) < 0.01, COMMAND_LOST_S)
            if not followed:
                wrong.append("a command is not followed")
            elif not rests:
                wrong.append(f"the client {how}: after {COMMAND_LOST_S} s the command still stands")
    return "; ".join(wrong) or None


def speed(viewer: Client, wanted: Callable[[float], bool], seconds: float) -> bool:
    """Does the command become so within the time? A TwistStamped ends with its six numbers."""
    for opcode, payload in viewer.frames(seconds):
        if opcode == 2 and payload[0] == 1 and wanted(struct.unpack("<6d", payload[-48:])[0]):
            return True
    return False


def campaigns(setting: Setting) -> list[Campaign]:
    """All at the same time: most of them wait."""
    attacks = (idle, half_open, pages, requests, malformed, not_asked, lost)

    def failed(attack: Callable[[Setting], str | None]) -> str | None:
        try:
            wrong = attack(setting)
        except (Refused, OSError, json.JSONDecodeError) as error:
            wrong = str(error) or repr(error)
        return f"scripts/attack/live.py, {attack.__name__}: {wrong}"[:400] if wrong else None

    with ThreadPoolExecutor(len(attacks)) as pool:
        failures = [wrong for wrong in pool.map(failed, attacks) if wrong]
    return [Campaign("live: clients of others", len(attacks), "attacks", failures)]
