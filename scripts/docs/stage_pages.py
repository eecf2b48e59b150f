"""Stages the site's pages in out/docs.

python scripts/docs/stage_pages.py

The staged pages are docs/*.md, where links to files outside docs become their paths, and the reference: the Python
interface, the command line's own help, and the keys of every kind of file as tables, from their JSON Schemas.
"""

import json
import os
import pkgutil
import re
import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path
from typing import Any

import griffe

import omnistep

ROOT = Path(__file__).resolve().parents[2]
DOCS, STAGED = ROOT / "docs", ROOT / "out" / "docs"
# Made by scripts/playground.sh, where its tools are there; what its page says instead where they are not.
PLAYGROUND = ROOT / "out" / "playground"
# Where the site's copy of the playground links to the site: alone it has nothing to link to.
ABOUT = ("<!-- about -->", '<a href="../playground.html">About this page</a>')
NO_PLAYGROUND = "This copy of the site was built without the playground: `scripts/playground.sh` says what is missing."
LINK = re.compile(r"(?<!!)\[([^\]]+)\]\((\.\./[^)\s#]+)(?:#[^)\s]*)?\)")
# Pages of the Python reference: what each is about, and what it shows in this order. Modules are shown whole.
PAGES = {
    "runs": (
        "Runs, traces, logs",
        "run compare Comparison climb_limits run_motor_bench read_mcap Trace Outcome Log PlayerFrame ClimbLimits"
        " MotorBenchTrace Simulation Sample Policy PolicyInfo Observation import_log ImportSummary ImportedSignal"
        " resimulate Resimulation Difference",
    ),
    "files": ("Vehicles and scenarios", "Vehicle Scenario list_vehicles list_scenarios list_policies"),
    "control": (
        "Kinematics and control",
        "Layout Wheel Kinematics Desaturated Odometry Estimator moved_by discretize at_point from_point to_world"
        " to_body CommandShaper ShapedCommands Waypoint TrajectoryPlanner Trajectory TrajectorySample HolonomicFollower"
        " Follow Pid PidSample EncoderCounter VelocityEstimator DcMotor MotorDuty torque_duty Controller ControlSample"
        " disturbed_ratio slip_ratio shape_error speed_ratio_std torque_range torque_factor reference_factor",
    ),
    "many": (
        "Many runs",
        "run_study sweep StudyResult climb_chart ClimbChart ChartCell plan_route Route RoutePoint Crossing"
        " tune TuneResult",
    ),
    "measured": ("Identification, calibration", "identify Identification calibrate Calibration CalibrationRun"),
    "learning": ("Environments for learning", "gym"),
    "mujoco": ("MuJoCo", "mujoco"),
    "pictures": ("Figures, videos, reports", "plot video report meshes"),
}
# Modules whose names the package exports itself.
RUNS = ("runs", "ensembles", "own_policy", "tuning")
WHOSE_NAMES = ("errors", "charts", "routes", *RUNS, "recordings", "resimulation", "identification", "calibration")


def public() -> list[str]:
    """Every public name: what the package exports, and its modules, but those whose names it exports itself."""
    modules = [found.name for found in pkgutil.iter_modules(omnistep.__path__) if not found.name.startswith("_")]
    exported = [name for name in omnistep.__all__ if not name.startswith("_")]
    return exported + [name for name in modules if name not in (*exported, *WHOSE_NAMES)]


def python_pages() -> dict[str, str]:
    """The pages of the Python reference, as mkdocstrings directives; the last one has what no other page names."""
    shown = [name for _, names in PAGES.values() for name in names.split()]
    rest = [name for name in public() if name not in shown]
    pages = {**PAGES, "rest": ("Errors and the rest", " ".join(sorted(rest)))}
    texts = {}
    for page, (title, names) in pages.items():
        body = []
        for name in names.split():
            members = ", ".join(f'"{each}"' for each in module_names(name)) if is_module(name) else ""
            options = f"    options:\n      members: [{members}]\n" if members else ""
            if name == "gym":  # its classes share what they do with the others by way of a private module
                options += "      inherited_members: [reset, step, render, ranges, action_s, engine]\n"
                options += "      show_bases: false\n"
            body.append(f"::: omnistep.{name}\n" + options)
        texts[page] = f"# {title}\n\n" + "\n".join(body)
    return texts


def is_module(name: str) -> bool:
    """Is it a module of the package?"""
    return any(found.name == name for found in pkgutil.iter_modules(omnistep.__path__))


@cache
def source() -> griffe.Module:
    """The package as its files have it: nothing of its extras has to be installed."""
    package = griffe.load("omnistep", search_paths=[str(ROOT / "python")], allow_inspection=False)
    assert isinstance(package, griffe.Module)
    return package


def module_names(name: str) -> list[str]:
    """Public names of a module, in the order of their definition."""
    module = source()[name]
    made_here = [each for each, thing in module.members.items() if not thing.is_alias and not thing.is_attribute]
    return [str(each) for each in module.exports or made_here if not str(each).startswith("_")]


def said(*arguments: str) -> str:
    """What the command line prints."""
    command = [sys.executable, "-m", "omnistep", *arguments]
    environment = {**os.environ, "COLUMNS": "1000", "NO_COLOR": "1"}  # lines of help are wrapped by the browser
    return subprocess.run(command, capture_output=True, text=True, check=True, env=environment).stdout


def help_text(text: str) -> str:
    """Help of a command as Markdown: its sentence, its usage as code, a table for each list."""
    parts: list[str] = []
    for line in text.splitlines():
        if entry := re.fullmatch(r" +(\S.*?)(?: {2,}(\S.*))?", line):
            parts.append(f"| `{cell(entry[1], code=True)}` | {cell(entry[2] or '')} |")
        elif line.lower().startswith("usage:"):
            parts.append(f"```text\n{line.partition(': ')[2]}\n```")
        elif line.endswith(":"):
            parts.append(f"| {line[:-1].capitalize()} | |\n|---|---|")
        else:
            parts.append(cell(line))
    return "\n".join(parts) + "\n"


def command_page() -> str:
    """The help of the command line and of each subcommand."""
    whole = said("--help")
    names = re.findall(r"^  ([a-z]\w*)  ", whole[whole.index("Commands:") :], re.MULTILINE)
    parts = [
        f"# Command line\n\nFrom what `omnistep --help` and `omnistep SUBCOMMAND --help` print.\n\n{help_text(whole)}"
    ]
    for name in names:
        if name != "help":
            parts.append(f"## omnistep {name}\n\n{help_text(said(name, '--help'))}")
    return "\n".join(parts)


def anchor(name: str) -> str:
    """The anchor of a table."""
    return re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")


def cell(text: str, *, code: bool = False) -> str:
    """Text, or code, that stands in a table."""
    text = text.replace("|", "\\|").replace("\n", " ")
    return text if code else text.replace("[", "\\[").replace("<", "&lt;")


class Keys:
    """The tables of one kind of file."""

    def __init__(self, kind: str) -> None:
        """Reads its schema."""
        self.kind = kind
        self.schema: dict[str, Any] = json.loads(said("schema", kind))
        self.definitions: dict[str, Any] = self.schema.get("$defs", {})
        self.tables: dict[str, str] = {}

    def page(self) -> str:
        """The page."""
        top = self.table(f"a {self.kind} file", self.schema, level=2)
        intro = (
            f"{self.schema['description']}\n\nFrom `omnistep schema {self.kind}`, which editors read too; "
            f"`omnistep check FILE` says in one line what is wrong with a file."
        )
        return f"# Keys of a {self.kind} file\n\n{intro}\n\n{top}\n" + "\n".join(self.tables.values())

    def resolved(self, schema: dict[str, Any]) -> tuple[str | None, dict[str, Any]]:
        """What a reference means, and its name."""
        name = schema["$ref"].rpartition("/")[2] if "$ref" in schema else None
        return name, self.definitions[name] if name else schema

    def choices(self, schema: dict[str, Any]) -> list[dict[str, Any]]:
        """The alternatives of a schema."""
        return list(schema.get("oneOf") or schema.get("anyOf") or [])

    def type_of(self, schema: dict[str, Any]) -> str:
        """What a value is, in words; tables that it needs are made on the way."""
        name, meant = self.resolved(schema)
        if "const" in meant:
            return f"`{json.dumps(meant['const'])}`"
        if "enum" in meant:
            return ", ".join(f"`{json.dumps(value)}`" for value in meant["enum"])
        options = self.choices(meant)
        if options and all("const" in option for option in options):
            return "; ".join(f"`{json.dumps(option['const'])}`: {cell(option['description'])}" for option in options)
        if name and name != "Vehicle" and ("properties" in meant or any("properties" in each for each in options)):
            self.add(name, meant)
            return f"table, see [{name}](#{anchor(name)})"
        if options:
            return " or ".join(self.type_of(option) for option in options)
        if name == "Vehicle":
            return "table with the [keys of a vehicle file](vehicle.md)"
        if meant.get("type") == "array":
            return self.list_of(meant)
        kind = meant.get("type", "any value")
        low, high = meant.get("minimum"), meant.get("maximum")
        if low is not None and low == high:
            return f"`{low}`"
        between = f", {low:g} to {high:g}" if low is not None and high is not None else ""
        return f"{kind}{between or (f', at least {low:g}' if low is not None else '')}"

    def list_of(self, schema: dict[str, Any]) -> str:
        """A list, in words."""
        low, high = schema.get("minItems"), schema.get("maxItems")
        inner = self.type_of(schema["items"]) if isinstance(schema.get("items"), dict) else "values"
        if low is not None and low == high:
            return f"list of {low}: {inner}"
        return f"list{f', at most {high}' if high else ''}: {inner}"

    def add(self, name: str, schema: dict[str, Any]) -> None:
        """Makes the table of a definition, once."""
        if name in self.tables:
            return
        self.tables[name] = ""  # keeps its place, and ends loops
        options = self.choices(schema)
        text = f"## {name}\n\n{schema.get('description', '')}\n"
        if "properties" in schema:
            # Alternatives only say which of its keys have to be there.
            keys = [f"`{key}`" for option in options for key in option["required"]]
            text += f"\nOne of {', '.join(keys)} has to be there.\n" if keys else ""
            text += "\n" + self.rows(schema)
        elif options:
            text += "".join(
                f"\n- `{json.dumps(option['const'])}`: {cell(option['description'])}"
                for option in options
                if "const" in option
            )
            text += "\n" if any("const" in option for option in options) else ""
            for option in options:
                properties = option.get("properties", {})
                kind, (first, *others) = properties.get("kind", {}).get("const"), [*properties, ""]
                if first and others == [""] and "properties" in properties[first]:
                    # A name with its keys in a table behind it.
                    inner = {"description": option["description"], **properties[first]}
                    text += "\n" + self.table(f"{first} = table", inner, level=3, named=name)
                elif properties:
                    text += "\n" + self.table(f'kind = "{kind}"' if kind else "keys", option, level=3, named=name)
        else:
            text += "\n" + self.rows(schema)
        self.tables[name] = text

    def table(self, title: str, schema: dict[str, Any], *, level: int, named: str = "") -> str:
        """A heading, a sentence, the rows."""
        sentence = f"{schema['description']}\n\n" if named and "description" in schema else ""
        shown = f"`{title}`" if "=" in title else title[0].upper() + title[1:]
        return f"{'#' * level} {shown} {{ #{anchor(f'{named} {title}')} }}\n\n{sentence}{self.rows(schema)}"

    def rows(self, schema: dict[str, Any]) -> str:
        """A row a key: those that have to be there first, as the schema has them."""
        required = schema.get("required", [])
        properties = schema["properties"]
        lines = ["| key | | value | meaning |", "|---|---|---|---|"]
        for key in sorted(properties, key=lambda key: required.index(key) if key in required else len(required)):
            value = properties[key]
            plain = "default" in value and not isinstance(value["default"], (dict, list))
            default = f"default `{json.dumps(value['default'])}`" if plain else "optional"
            needed = "required" if key in required else default
            lines.append(f"| `{key}` | {needed} | {self.type_of(value)} | {cell(value.get('description', ''))} |")
        return "\n".join(lines) + "\n"


def entries() -> list[str]:
    """What the reference has to have an entry for: every public name, and those in modules that are shown whole."""
    found = []
    for name in public():
        found += [f"omnistep.{name}.{each}" for each in module_names(name)] if is_module(name) else [f"omnistep.{name}"]
    return found


def stage() -> None:
    """Write every page to out/docs."""
    shutil.rmtree(STAGED, ignore_errors=True)
    shutil.copytree(DOCS, STAGED)
    for path in STAGED.glob("*.md"):
        text = path.read_text(encoding="utf-8")
        path.write_text(LINK.sub(outside, text), encoding="utf-8")
    if PLAYGROUND.is_dir():
        shutil.copytree(PLAYGROUND, STAGED / "playground")
        page = STAGED / "playground" / "index.html"
        text = page.read_text(encoding="utf-8")
        assert ABOUT[0] in text, f"{page}: no {ABOUT[0]}"
        page.write_text(text.replace(*ABOUT), encoding="utf-8")
    else:
        page = STAGED / "playground.md"
        page.write_text(re.sub(r"<a href=.*</a>", NO_PLAYGROUND, page.read_text(encoding="utf-8")), encoding="utf-8")
    folder = STAGED / "reference"  # in the repository its pages only say where to look
    pages = {**python_pages(), "cli": command_page()}
    pages |= {kind: Keys(kind).page() for kind in ("vehicle", "scenario", "study")}
    for name, text in pages.items():
        (folder / f"{name}.md").write_text(text, encoding="utf-8")


def outside(match: re.Match[str]) -> str:
    """A link to a file that is no page, as text that names it."""
    text, path = match[1], match[2].removeprefix("../")
    return f"`{path}`" if path.endswith(text) or path.startswith(text) else f"{text} (`{path}`)"


if __name__ == "__main__":
    stage()
