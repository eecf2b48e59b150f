"""A client of a live run that sends and does not read."""

import base64
import os
import re
import socket
import struct
import subprocess
import sys
import threading


def test_a_client_that_does_not_read_is_disconnected():
    live = [sys.executable, "-m", "omnistep", "run", "flat", "--live", "--port", "0", "--duration", "60", "--quiet"]
    process = subprocess.Popen(live, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    try:
        port = int(re.search(r"127\.0\.0\.1:(\d+)", process.stderr.readline())[1])
        wire = socket.create_connection(("127.0.0.1", port))
        # Little room for answers: they wait in the run soon.
        wire.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        wire.settimeout(30.0)
        key = base64.b64encode(os.urandom(16)).decode()
        wire.sendall(
            f"GET / HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
            f"Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: {key}\r\n"
            "Sec-WebSocket-Protocol: foxglove.sdk.v1\r\n\r\n".encode()
        )
        assert wire.recv(12) == b"HTTP/1.1 101"
        # Each of these is answered with a refusal, because the run is only watched.
        payload = b'{"op":"getParameters","parameterNames":[]}'
        frames = 1000 * (struct.pack("!BB", 0x81, 0x80 | len(payload)) + bytes(4) + payload)

        def flood():
            try:
                while True:
                    wire.sendall(frames)
            except OSError:
                pass

        flooding = threading.Thread(target=flood)
        flooding.start()
        said = process.stderr.readline()
        flooding.join(60.0)
        assert not flooding.is_alive()
        why = "it did not read the 64 answers to what it sent"
        assert re.fullmatch(rf".*client 1 was disconnected: {why}\n", said), said
    finally:
        process.kill()
        process.communicate()
        wire.close()
