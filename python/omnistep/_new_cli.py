"""``omnistep new vehicle NAME --from-urdf ROBOT.urdf``: from a URDF to a vehicle file."""

import re
from collections.abc import Collection, Iterable
from pathlib import Path
from typing import Any

import numpy as np

from omnistep._command_line import Parser, made
from omnistep._omnistep import Kinematics, Vehicle
from omnistep._output_files import replaced
from omnistep._urdf_tree import Robot, read_urdf, shown
from omnistep._urdf_vehicle import Table, vehicle_tables
from omnistep._urdf_wheels import RADII_M
from omnistep.errors import ConfigError

#: Share of the motors' top speeds that may be commanded, as of mecanum4.
_COMMANDED = 0.4
#: Usage, which the compiled command does not know.
USAGE = "omnistep new vehicle NAME --from-urdf ROBOT.urdf [--wheels mecanum|omni] [--radius M] [--not-wheel NAME]"


def new(arguments: list[str]) -> int:
    """Run ``omnistep new vehicle NAME --from-urdf ROBOT.urdf`` and return its exit code."""
    parser = Parser(
        prog="omnistep new",
        description="Make a vehicle file from a URDF. What was guessed is marked in the file.",
        usage=USAGE,
    )
    parser.add_argument("kind", choices=["vehicle"], help="the kind of file")
    parser.add_argument("name", metavar="NAME", help="name of the vehicle: letters, digits, _ or -")
    parser.add_argument("--from-urdf", required=True, type=Path, metavar="ROBOT.urdf", help="the robot, without xacro")
    parser.add_argument(
        "--wheels",
        choices=["mecanum", "omni"],
        help="kind of wheels; if left out, mecanum if all axles are parallel",
    )
    parser.add_argument(
        "--radius",
        type=float,
        metavar="M",
        help="radius of all wheels [m]; from their cylinders or spheres if left out",
    )
    parser.add_argument(
        "--not-wheel",
        action="append",
        default=[],
        metavar="NAME",
        help="a link or a joint that is round and turns, but is not a wheel; repeatable",
    )
    given = parser.parse_args(arguments)

    def make() -> None:
        print(_write(given.name, given.from_urdf, given.wheels, given.radius, given.not_wheel))

    return made(make, None)


def _write(name: str, urdf: Path, kind: str | None, radius_m: float | None, not_wheels: Collection[str]) -> str:
    """Write the vehicle file, and return what is said of it."""
    if not re.fullmatch(r"[A-Za-z0-9_-]{1,40}", name):
        raise ConfigError(f"new {shown(name)}: name: \"{shown(name)}\", allowed: 1 to 40 letters, digits, '_' or '-'")
    low, high = RADII_M
    if radius_m is not None and not low <= radius_m <= high:
        raise ConfigError(f"--radius {radius_m:g}, allowed: {low} to {high:g}, in m", key="radius")
    out = Path(f"{name}.toml")
    if out.exists() or out.is_symlink():
        kept = "the file exists and was not changed; use another name, or move it away first"
        raise ConfigError(f"{out}: {kept}", file=str(out))
    robot = read_urdf(urdf)
    tables = vehicle_tables(robot, kind=kind, radius_m=radius_m, not_wheels=not_wheels)
    text, vehicle = _vehicle(name, robot, tables)
    with replaced(out, [urdf]) as aside:
        aside.write_text(text, encoding="utf-8")
    keys = vehicle.to_dict()
    mecanum = any(wheel.get("roller_angle_rad") for wheel in keys["wheel"])
    parts = [
        _counted(len(keys["body"]), "body", "bodies"),
        _counted(len(keys.get("hinge") or []), "hinge", "hinges"),
        f"{len(keys['wheel'])} {'mecanum' if mecanum else 'omni'} wheels",
        f"{vehicle.mass_kg:.3f} kg",
    ]
    guesses = text.count("# guess: ")
    return f'{out}: {", ".join(parts)}; {guesses} values are marked "# guess"; next: omnistep check {out}'


def _counted(number: int, one: str, more: str) -> str:
    return f"{number} {one if number == 1 else more}"


def _vehicle(name: str, robot: Robot, tables: list[Table]) -> tuple[str, Vehicle]:
    """Return the text of the vehicle file and the vehicle that it describes."""
    head = [
        _schema_line(),
        f"# From {robot.file}, robot {shown(robot.name)!r}, by omnistep new vehicle --from-urdf.",
        "#",
        '# What the URDF does not say is marked "# guess": correct it. All joints are at 0.',
        "# Frame: x forward, y left, z up, in metres, as the vehicle stands on flat ground.",
        f"# The origin is on the ground, at x and y of the link {shown(robot.root)!r}.",
        *_row("schema_version", 1, "of the file format"),
        *_row("name", name, "in logs"),
    ]
    try:
        layout = Vehicle.from_toml(_text(head, tables)).layout
        motor = next(table for table in tables if table.kind == "motor")
        tables = [*tables, _limits(Kinematics(layout=layout), motor.keys["no_load_rad_s"])]
        # Limits stand behind the motor, as in the built-in files.
        tables.sort(key=lambda table: _ORDER.index(table.kind))
        text = _text(head, tables)
        return text, Vehicle.from_toml(text)
    except ConfigError as error:
        raise ConfigError(f"{robot.file}: {error}", file=robot.file) from error


_ORDER = ("[body]", "[hinge]", "[coupling]", "motor", "limits", "rollers", "[wheel]")
_REMARKS = {
    "motor": "one for each wheel, all alike, behind their gears",
    "limits": "of the commanded twist",
    "rollers": 'used with physics.wheel_model = "rollers"; so long that they leave no gaps',
}


def _limits(kinematics: Kinematics, no_load_rad_s: float) -> Table:
    """Return limits of the twist: a fraction of the motors' highest speed along each axis alone."""
    keys = {}
    for key, twist in {"vx_m_s": [1.0, 0.0, 0.0], "vy_m_s": [0.0, 1.0, 0.0], "wz_rad_s": [0.0, 0.0, 1.0]}.items():
        fastest = float(np.abs(kinematics.inverse(twist)).max())
        keys[key] = float(f"{_COMMANDED * no_load_rad_s / fastest:.2g}")
    return Table("limits", keys, dict.fromkeys(keys, f"{_COMMANDED:g} of what the motors reach"))


def _schema_line() -> str:
    """Return the first line: the schema if it is in the same folder, otherwise the command that writes it."""
    schema = Path("vehicle.schema.json")
    if schema.is_file() and schema.stat().st_size > 0:
        return f"#:schema ./{schema}"
    how = f'omnistep schema vehicle > {schema}, and "#:schema ./{schema}" as the first line.'
    return f"# For completion in an editor: {how}"


def _text(head: list[str], tables: list[Table]) -> str:
    lines = list(head)
    for table in tables:
        remark = _REMARKS.get(table.kind)
        lines += ["", f"[{table.kind}]".ljust(31) + f" # {remark}" if remark else f"[{table.kind}]"]
        for key, value in table.keys.items():
            note = table.notes.get(key)
            lines += _row(key, value, f"guess: {note}" if note else "")
        if table.kind == "[wheel]":
            lines += _row("contact", None, "guess: for floors")
        if table.kind == "motor":
            lines += ["", "# No [gains]: they are derived from the masses, the motor and the control period."]
    return "\n".join(lines) + "\n"


def _row(key: str, value: Any, comment: str) -> list[str]:
    text = f"{key} = {_toml(value)}" if value is not None else f'{key} = {{ kind = "ball" }}'
    return [f"{text:<31} # {comment}" if comment else text]


def _toml(value: Any) -> str:
    """A value as TOML writes it, to nine digits and a nanometre."""
    if isinstance(value, str):
        return f'"{value}"'  # a name of letters, digits, _ and -
    if isinstance(value, int):
        return str(value)
    if isinstance(value, Iterable):
        return "[" + ", ".join(_toml(round(float(each), 9) + 0.0) for each in value) + "]"
    return repr(float(f"{value:.9g}"))
