"""Requests that a browser would not send."""

import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager

_HOST = b"Host: 127.0.0.1\r\n"
#: Asks for the page.
PAGE = b"GET / HTTP/1.1\r\n" + _HOST + b"\r\n"
#: None of these is to be done.
WRONG = [
    os.urandom(4096),
    b"\0" * 100_000,
    b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
    b"\x16\x03\x01\x02\0\x01\0\x01\xfc\x03\x03" + os.urandom(500),  # TLS
    b"GET " + b"/" * 100_000 + b" HTTP/1.1\r\n" + _HOST + b"\r\n",
    b"GET / HTTP/1.1\r\n" + _HOST + b"X: " + b"a" * 1_000_000,
    b"GET / HTTP/1.1\r\n" + _HOST + b"X: a\r\n" * 10_000 + b"\r\n",
    b"GET / HTTP/1.1\r\n" + _HOST * 2 + b"\r\n",
    b"GET / HTTP/1.1\r\nHost: \xff\xfe\r\n\r\n",
    b"GET / HTTP/9.9\r\n" + _HOST + b"\r\n",
    b"GET http://evil.example/ HTTP/1.1\r\nHost: evil.example\r\n\r\n",
    b"GET /../../etc/passwd HTTP/1.1\r\n" + _HOST + b"\r\n",
    b"POST / HTTP/1.1\r\n" + _HOST + b"Content-Length: 18446744073709551616\r\n\r\n",
    b"POST / HTTP/1.1\r\n" + _HOST + b"Content-Length: 1\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n",
    b"POST / HTTP/1.1\r\n" + _HOST + b"Transfer-Encoding: chunked\r\n\r\nffffffffffffffff\r\n",
    b"CONNECT evil.example:443 HTTP/1.1\r\n" + _HOST + b"\r\n",
    b"GET / HTTP/1.1\r\n" + _HOST + b"Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Key: x\r\n\r\n",
    b"GET / HTTP/1.1\r\n" + _HOST + b"Connection: Upgrade\r\nUpgrade: h2c\r\nHTTP2-Settings: AAA\r\n\r\n",
]


def answered(port: int, request: bytes, seconds: float) -> int | None:
    """The status of the answer to a request; 0 if it is closed without one, None if neither happens."""
    with socket.create_connection(("127.0.0.1", port), timeout=seconds) as wire:
        received = b""
        try:
            wire.sendall(request)
            while len(received) < 12 and (more := wire.recv(4096)):
                received += more
        except TimeoutError:
            return None
        except OSError:  # closed while it was answered
            pass
        return int(received.split(b" ")[1]) if received.startswith(b"HTTP/1.") else 0


@contextmanager
def deaf(port: int, count: int) -> Iterator[None]:
    """Clients that ask for the page and read nothing of it."""
    wires = [socket.create_connection(("127.0.0.1", port), timeout=5) for _ in range(count)]
    try:
        for wire in wires:
            wire.sendall(PAGE)
        yield
    finally:
        for wire in wires:
            wire.close()
