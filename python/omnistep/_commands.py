"""Commands of the console script that Python runs: figures, videos, reports, imported logs."""

from pathlib import Path

from omnistep._command_line import Parser, made


def _report(arguments: list[str]) -> int:
    parser = Parser(
        prog="omnistep report", description="Make one page of logged runs that any browser opens, without a network."
    )
    parser.add_argument("logs", nargs="+", type=Path, metavar="LOG.mcap")
    parser.add_argument("-o", "--out", type=Path, default=Path("report.html"), help="the page; report.html if left out")
    given = parser.parse_args(arguments)
    from omnistep import report

    return made(lambda: report.write(given.logs, given.out), given.out)


def _plot(arguments: list[str]) -> int:
    parser = Parser(
        prog="omnistep plot", description="Draw a logged run from the side, at several times: figure 9 of the paper."
    )
    parser.add_argument("log", type=Path, metavar="LOG.mcap")
    parser.add_argument(
        "-o", "--out", type=Path, default=Path("side-view.png"), help="png, svg or pdf; side-view.png if left out"
    )
    parser.add_argument(
        "--every", type=float, default=0.3, metavar="SECONDS", help="time between two poses; 0.3 if left out"
    )
    given = parser.parse_args(arguments)
    from omnistep import plot

    return made(lambda: plot.write_side_view(given.log, given.out, every_s=given.every), given.out)


def _video(arguments: list[str]) -> int:
    parser = Parser(
        prog="omnistep video", description="Make a video or a picture of a logged run with Rerun, without a window."
    )
    parser.add_argument("log", type=Path, metavar="LOG.mcap")
    parser.add_argument(
        "-o", "--out", type=Path, default=Path("climb.mp4"), help="mp4, gif or png; climb.mp4 if left out"
    )
    parser.add_argument("--fps", type=float, default=10.0, help="pictures per second of the run; 10 if left out")
    parser.add_argument("--at", type=float, metavar="SECONDS", help="time of a png; the middle of the run if left out")
    given = parser.parse_args(arguments)
    from omnistep import video

    return made(lambda: video.write(given.log, given.out, fps=given.fps, at_s=given.at), given.out)


def _import(arguments: list[str]) -> int:
    parser = Parser(
        prog="omnistep import",
        description="Make a log from measurements on a vehicle, and report how each column was used.",
    )
    parser.add_argument(
        "log", type=Path, metavar="LOG", help="a .csv or .parquet file, a rosbag2 (its folder, .mcap, .db3)"
    )
    parser.add_argument(
        "--map", required=True, type=Path, metavar="MAP.toml", help="the map: columns or topics of the signals"
    )
    parser.add_argument(
        "-o", "--out", type=Path, default=Path("robot.mcap"), help="the log to write; robot.mcap if left out"
    )
    parser.add_argument(
        "--skip-bad-lines", action="store_true", help="leave out lines of a .csv that cannot be read, and count them"
    )
    parser.add_argument("--quiet", action="store_true", help="show no progress bar")
    given = parser.parse_args(arguments)
    from omnistep import recordings

    def make() -> None:
        summary = recordings.import_log(
            given.log,
            map=given.map,
            out=given.out,
            progress=not given.quiet,
            skip_bad_lines=given.skip_bad_lines,
        )
        print(summary)

    return made(make, given.out)


def _resimulate(arguments: list[str]) -> int:
    parser = Parser(
        prog="omnistep resimulate",
        description="Drive the simulation with commands, torques, wheels or duty cycles of a log, and compare both.",
    )
    parser.add_argument("log", type=Path, metavar="LOG.mcap")
    parser.add_argument(
        "--scenario", help="scenario to simulate, a built-in name or a .toml file; the log's own if left out"
    )
    by = parser.add_mutually_exclusive_group()
    by.add_argument("--commands", action="store_true", help="apply the logged commands to the controller; the default")
    by.add_argument("--torques", action="store_true", help="apply the logged torques to the motors")
    by.add_argument("--wheels", action="store_true", help="apply the measured wheels' twist to the controller")
    by.add_argument("--duty", action="store_true", help="apply the logged duty cycles to the motors")
    parser.add_argument(
        "--vehicle", help="vehicle to simulate, a built-in name or a .toml file; short for --set vehicle="
    )
    parser.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", help="replace a key of the scenario; may be repeated"
    )
    parser.add_argument(
        "--sideways",
        type=float,
        default=1.0,
        metavar="PART",
        help="ratio of lateral motion to the wheels' readings, all.sideways of calibrate; 1 if left out",
    )
    parser.add_argument(
        "--plate",
        nargs=3,
        type=float,
        metavar=("X", "Y", "YAW"),
        help="the marker plate of the log's pose on the vehicle, in m and rad; estimated if left out",
    )
    parser.add_argument(
        "-o", "--out", type=Path, default=Path("resimulated.png"), help="png, svg or pdf; resimulated.png if left out"
    )
    parser.add_argument("--quiet", action="store_true", help="show no progress bar")
    given = parser.parse_args(arguments)
    from omnistep import resimulation
    from omnistep._resimulation_inputs import BYS

    def make() -> None:
        resimulation.write(
            given.log,
            given.out,
            scenario=given.scenario,
            by=next((each for each in BYS if getattr(given, each)), "commands"),
            keys=[*([] if given.vehicle is None else [f"vehicle={given.vehicle}"]), *given.set],
            plate=given.plate,
            sideways=given.sideways,
            progress=not given.quiet,
        )

    return made(make, given.out)


#: The commands by name; each returns its exit code.
COMMANDS = {"report": _report, "plot": _plot, "video": _video, "import": _import, "resimulate": _resimulate}
