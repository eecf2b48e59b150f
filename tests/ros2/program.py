"""A run of the program under test: OMNISTEP, or the release build of this workspace."""

import os
import re
import signal
import subprocess
import threading
from contextlib import suppress
from pathlib import Path

from peers import until

ROOT = Path(__file__).parents[2]
PROGRAM = os.environ.get("OMNISTEP", str(ROOT / "target/release/omnistep"))
READY = re.compile(r"publishing on ROS 2, domain (\d+) \(DDS\)")


class Run:
    """`omnistep run SCENARIO --ros2 ...` in a domain, until it is stopped or its time is over."""

    def __init__(self, scenario: str, *options: str, domain: int | None, ready: bool = True, cwd: Path | None = None):
        environment = {name: value for name, value in os.environ.items() if name != "ROS_DOMAIN_ID"}
        if domain is not None:
            environment["ROS_DOMAIN_ID"] = str(domain)
        self.process = subprocess.Popen(
            [PROGRAM, "run", scenario, "--ros2", "--quiet", *options],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            env=environment,
            cwd=cwd,
        )
        self.starved_s = 0.0
        self.said = ""
        self.printed = ""
        self.threads = [threading.Thread(target=self._listen, args=(name,)) for name in ("stderr", "stdout")]
        for thread in self.threads:
            thread.start()
        if ready:
            until(lambda: READY.search(self.said) or self.process.poll() is not None, "the line that says it is ready")
            found = READY.search(self.said)
            assert found, f"ended with {self.process.returncode}: {self.said}"
            self.domain = int(found[1])

    def _listen(self, name: str):
        for line in getattr(self.process, name):
            if name == "stderr":
                self.said += line.decode()
            else:
                self.printed += line.decode()

    def rss_kb(self) -> int:
        """Memory that it has in use [kB]."""
        status = Path(f"/proc/{self.process.pid}/status").read_text()
        return int(re.search(r"VmRSS:\s*(\d+) kB", status)[1])

    def look_for_hunger(self) -> float:
        """How long in all it could have gone on and had no processor [s]: not its fault, nor that of its peers."""
        threads = []
        for thread in Path(f"/proc/{self.process.pid}/task").glob("*/schedstat"):
            with suppress(OSError):  # it has just ended
                threads.append([int(word) for word in thread.read_text().split()])
        # The one that works most is the simulation.
        self.starved_s = max(self.starved_s, max(threads, default=[0, 0])[1] / 1e9)
        return self.starved_s

    def ended(self, seconds: float = 60.0) -> int:
        """Its exit code, once it has ended by itself."""

        def over() -> bool:
            self.look_for_hunger()
            return self.process.poll() is not None

        until(over, "its end", seconds)
        for thread in self.threads:
            thread.join()
        return self.process.returncode

    def stop(self, by: signal.Signals = signal.SIGINT) -> int:
        """Its exit code after a signal."""
        self.process.send_signal(by)
        return self.ended()

    def close(self):
        """Whatever failed, nothing goes on."""
        if self.process.poll() is None:
            self.process.kill()
        self.ended()
        self.process.stdout.close()
        self.process.stderr.close()
