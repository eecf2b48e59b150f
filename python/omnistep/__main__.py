"""The command line: ``omnistep`` and ``python -m omnistep``."""

import signal
import sys

from omnistep._omnistep import cli


def main() -> int:
    """Run the command line and return its exit code: 0 done, 1 the run failed, 2 the request was wrong."""
    arguments = sys.argv[1:]
    name = arguments[0] if arguments else ""
    # Python's own commands load their parser and what they compute with; the others load nothing.
    if name in ("report", "plot", "video", "import", "resimulate"):
        from omnistep import _commands

        return _commands.COMMANDS[name](arguments[1:])
    if name in ("identify", "calibrate"):
        from omnistep import _identify_cli

        command = _identify_cli.identify if name == "identify" else _identify_cli.calibrate
        return command(arguments[1:])
    if name == "new":
        if any(each.split("=")[0] == "--from-urdf" for each in arguments):
            from omnistep import _new_cli

            return _new_cli.new(arguments[1:])
        if {"-h", "--help"} & set(arguments):
            from omnistep import _new_cli

            code = cli(["omnistep", *arguments])
            print(f"\nOf a URDF [Python]: {_new_cli.USAGE}")
            return code
    # As in the Rust binary: Ctrl-C ends the process at once, unless the command ends itself in order.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return cli(["omnistep", *arguments])


if __name__ == "__main__":
    sys.exit(main())
