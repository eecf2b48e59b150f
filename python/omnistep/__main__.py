"""The command line: ``omnistep`` and ``python -m omnistep``."""

import signal
import sys

from omnistep._omnistep import cli


def main() -> int:
    """Run the command line and return its exit code: 0 done, 1 the run failed, 2 the request was wrong."""
    # Ctrl-C ends the process at once, as it ends the Rust binary; the log keeps its .part name.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return cli(["omnistep", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
