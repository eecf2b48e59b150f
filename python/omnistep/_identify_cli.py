"""``omnistep identify`` and ``omnistep calibrate``: from logs of a vehicle to its file."""

import argparse
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from omnistep._calibration_runs import CalibrationRun, read_runs
from omnistep._command_line import NotWritten, Parser, made
from omnistep._omnistep import Vehicle, list_vehicles
from omnistep._output_files import check_output, check_picture, replaced, write_text
from omnistep._toml_files import read_toml
from omnistep._vehicle_edits import Changes, calibrated_halves, edited, identified_halves, tomlkit
from omnistep.errors import ConfigError


def identify(arguments: list[str]) -> int:
    """Run ``omnistep identify`` and return its exit code."""
    parser = Parser(
        prog="omnistep identify",
        description="Estimate masses, friction, delay and lag from logs of torques and velocities, with intervals.",
    )
    parser.add_argument(
        "logs", nargs="*", type=Path, metavar="LOG", help=".mcap, .csv or .parquet of a drive on flat ground"
    )
    parser.add_argument("--vehicle", required=True, help="the vehicle as far as known: a .toml file or a built-in name")
    parser.add_argument(
        "--wheels-off-ground", nargs="+", default=[], type=Path, metavar="LOG", help="logs with all wheels in the air"
    )
    parser.add_argument(
        "--fix",
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="a value from another measurement, such as mass_kg=3.2; may be repeated",
    )
    parser.add_argument(
        "--zero-duty",
        choices=("brake", "coast"),
        help="state of the bridges at a duty cycle of 0; from the log, or the better fit, if left out",
    )
    parser.add_argument("-o", "--out", type=Path, help="the vehicle file to write, with the results and gains")
    _may_write_doubtful(parser)
    parser.add_argument(
        "--plot", type=Path, metavar="FIT.png", help="png, svg or pdf of the wheels' speeds, simulated with the results"
    )
    parser.add_argument("--quiet", action="store_true", help="show no progress bar")
    given = parser.parse_args(arguments)
    inputs = [*given.logs, *given.wheels_off_ground, Path(given.vehicle)]

    def found(drawn: Vehicle) -> Answer:
        from omnistep.identification import identify

        if given.plot is not None:
            check_picture(given.plot, inputs)
        fix = dict(_fixed(each) for each in given.fix)
        result = identify(
            given.logs,
            vehicle=drawn,
            wheels_off_ground=given.wheels_off_ground,
            fix=fix,
            zero_duty=given.zero_duty,
            progress=not given.quiet,
        )
        if given.plot is not None:
            with replaced(given.plot, inputs) as aside:
                result.simulation.plot().savefig(aside, dpi=110)
        changes = Changes(result.vehicle, identified_halves(result.vehicle, result.estimates))
        return Answer(result.table(), changes, result.doubted)

    return _write(found, given, lambda: inputs)


def calibrate(arguments: list[str]) -> int:
    """Run ``omnistep calibrate`` and return its exit code."""
    parser = Parser(
        prog="omnistep calibrate",
        description="Estimate wheel radii, positions and directions from runs with measured ends, with intervals.",
    )
    parser.add_argument(
        "runs", type=Path, metavar="RUNS.toml", help="names the logs and the measurements at their ends"
    )
    parser.add_argument("--vehicle", required=True, help="the vehicle as drawn: a .toml file or a built-in name")
    parser.add_argument("-o", "--out", type=Path, help="the vehicle file to write, with the results")
    _may_write_doubtful(parser)
    parser.add_argument("--quiet", action="store_true", help="show no progress bar")
    given = parser.parse_args(arguments)

    runs: list[CalibrationRun] = []
    noise: dict[str, float] = {}

    def inputs() -> list[Path]:
        read, stated = read_runs(given.runs)
        runs.extend(read)
        noise.update(stated)
        return [given.runs, Path(given.vehicle), *(run.log for run in read if isinstance(run.log, Path))]

    def found(drawn: Vehicle) -> Answer:
        from omnistep.calibration import calibrate

        result = calibrate(runs, vehicle=drawn, progress=not given.quiet, **noise)
        halves = calibrated_halves(drawn, (*result.common, *result.estimates))
        return Answer(result.table(), Changes(result.vehicle, halves), result.doubted)

    return _write(found, given, inputs)


def _fixed(text: str) -> tuple[str, float]:
    name, _, value = text.partition("=")
    try:
        return name, float(value)
    except ValueError as error:
        raise ConfigError(f"--fix {text}, allowed: NAME=VALUE, such as mass_kg=3.2", key=name) from error


def _may_write_doubtful(parser: Parser) -> None:
    parser.add_argument(
        "--write-doubtful", action="store_true", help="write the file of -o even if the results are refuted"
    )


@dataclass(frozen=True)
class Answer:
    """What was found: a table for the reader, the vehicle, and why it is none to be used, if it is."""

    table: str
    changes: Changes
    doubted: str


def _write(found: Callable[[Vehicle], Answer], given: argparse.Namespace, inputs: Callable[[], list[Path]]) -> int:
    """Print the estimates, and write the vehicle file with them; never in place of one of the inputs."""
    name, out = given.vehicle, given.out

    def make() -> None:
        # Looked up before the search, which may take minutes.
        reads = inputs()
        if out is not None:
            check_output(out, reads, text=True)
            tomlkit()
        drawn = Vehicle(name)
        # Read before the search: it takes a while, and the file may change.
        text = drawn.to_toml() if out is None or name in list_vehicles() else read_toml(Path(name))[0]
        answer = found(drawn)
        if out is None:
            print(answer.table)
            return
        if answer.doubted and not given.write_doubtful:
            print(answer.table)
            raise NotWritten(f"{out}: not written: {answer.doubted}; --write-doubtful writes it all the same")
        new, notes = edited(text, drawn, answer.changes)
        Vehicle.from_toml(new)
        print(answer.table)
        if answer.doubted:
            print(f"{out}: doubtful: {answer.doubted}", file=sys.stderr)
        for note in notes:
            print(f"{out}: {note}", file=sys.stderr)
        write_text(out, new, reads)

    return made(make, out)
