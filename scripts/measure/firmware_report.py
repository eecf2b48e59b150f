"""Runs the firmware images in QEMU, prints their figures as a table, and fails where a budget or a bit is off.

python scripts/measure/firmware_report.py [--write | --self-test]: `--write` puts both tables into
docs/firmware-costs.md, else those there have to be true to 10 %. The images are those that scripts/firmware.sh builds.
"""

import re
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

from elftools.elf.elffile import ELFFile

ROOT = Path(__file__).resolve().parents[2]
FIRMWARE = ROOT / "firmware"
# Where the figures stand: first those that sum it up, then all of them.
PAGE = ROOT / "docs" / "firmware-costs.md"
START, END = "<!-- figures: written by scripts/measure/firmware_report.py --write -->", "<!-- end of figures -->"
# Processor, folder of its images, machine that QEMU emulates (it has no M0+; the M0 has the same instructions).
PROCESSORS = (
    ("Cortex-M4F", "thumbv7em-none-eabihf", "mps2-an386"),
    ("Cortex-M7", "m7/thumbv7em-none-eabihf", "mps2-an500"),
    ("Cortex-M0+", "m0plus/thumbv6m-none-eabi", "microbit"),
    ("riscv32imac", "riscv32imac/riscv32imac-unknown-none-elf", "virt"),
)
# Arithmetic in double precision: on these processors in software, slow and large.
DOUBLE = re.compile(r"__(aeabi_(d[a-z0-9]+|cdcmp\w*|\w+2d)|\w*df\w*)$")
# Those in C and the loop with a drive: their sizes are in the table.
C_AND_DRIVE = ("drive_loop", "c/example", "c/drive", "c/traction", "c/mecanum_wheels")
# Those that are looked at for what they must not contain.
IMAGES = {"controller", "self_test", "loop", "drive", "everything", "traction", "estimator", "path", "follow"}
IMAGES |= {"three", "stops"}
# Those that are looked at for panics alone: a constructor compares in double precision.
CONSTRUCTING = {"constructors"}
PANIC = re.compile(r"panicking|panic_fmt|panic_bounds_check|omnistep_a_panic_is_reachable")


def forbidden(symbols: list[str], *, double: bool = False) -> list[str]:
    """Those of the symbols that stand for a panic, or for double precision unless that is allowed."""
    return [name for name in symbols if (not double and DOUBLE.match(name)) or PANIC.search(name)]


class Image:
    """A linked program."""

    def __init__(self, path: Path) -> None:
        """Reads sizes and symbols."""
        with path.open("rb") as file:
            elf = ELFFile(file)
            allocated = [section for section in elf.iter_sections() if section["sh_flags"] & 2]
            writable = [section for section in allocated if section["sh_flags"] & 1]
            self.ram_bytes: int = sum(section["sh_size"] for section in writable)
            # Flash holds the start values of variables too.
            start_values = sum(section["sh_size"] for section in writable if section["sh_type"] == "SHT_PROGBITS")
            self.text_bytes: int = sum(section["sh_size"] for section in allocated) - self.ram_bytes + start_values
            table = elf.get_section_by_name(".symtab")
            self.symbols = [symbol.name for symbol in table.iter_symbols()]


def run(machine: str, image: Path) -> tuple[dict[str, int], str]:
    """Runs an image; its figures by name, and the whole of what it said."""
    done = subprocess.run([FIRMWARE / "qemu.sh", machine, image], capture_output=True, text=True)
    said = done.stdout + done.stderr
    if done.returncode != 0:
        sys.exit(f"{image.name} on {machine}: exit code {done.returncode}\n{said}")
    figures = {name: int(n) for name, n in re.findall(r"^instructions, (.*): (\d+)$", said, re.MULTILINE)}
    figures |= {name: int(n) for name, n in re.findall(r"^(stack of .*): (\d+) bytes$", said, re.MULTILINE)}
    return figures, said


def over(name: str, value: int | None, budget: dict[str, int]) -> str | None:
    """What is wrong with a figure, if anything."""
    if value is None:
        return f"{name}: not measured"
    most = budget.get("promised", round(1.1 * budget.get("measured", 0)))
    return f"{name}: {value}, allowed: {most}" if value > most else None


def table(rows: dict[str, dict[str, int]], images: dict[str, Image]) -> str:
    """The figures as Markdown: one column a processor."""
    columns = [name for name, _, _ in PROCESSORS]
    names = list(dict.fromkeys(name for figures in rows.values() for name in figures))
    lines = [f"| | {' | '.join(columns)} |", "|---|" + "---:|" * len(columns)]
    for name in names:
        unit = " \\[bytes\\]" if name.startswith("stack") else " \\[instructions\\]"
        values = [str(rows[column].get(name, "")) for column in columns]
        lines.append(f"| {name}{unit} | {' | '.join(values)} |")
    for name, image in images.items():
        for what in ("text_bytes", "ram_bytes"):
            label = {"text_bytes": "flash", "ram_bytes": "RAM"}[what]
            lines.append(f"| image `{name}`, {label} \\[bytes\\] | {getattr(image, what)} | | | |")
    return "\n".join(lines) + "\n"


def summary(figures: dict[str, int], images: dict[str, Image], budgets: dict[str, Any]) -> str:
    """The figures that sum it up, next to what is promised."""
    promised = {each["name"]: each.get("promised") for each in [*budgets["figure"], *budgets["image"]]}

    def both(name: str) -> str:
        return f"{promised[name]} | {figures[name]}"

    whole, most, image = both("step with odometry and residual, at worst"), promised["controller"], images["controller"]
    return f"""| Cortex-M4F, seven wheels, f32 | promised | measured |
|---|---:|---:|
| step: velocity limits, kinematics, seven PIDs, `scale_references` \\[instructions\\] | {both("step, free")} |
| the same with every torque at its limit \\[instructions\\] | | {figures["step, saturated"]} |
| with odometry and slip residual, worst of 10,000 steps \\[instructions\\] | {whole} |
| flash of the controller with start-up code \\[bytes\\] | {most["text_bytes"]} | {image.text_bytes} |
| RAM of the controller \\[bytes\\] | {most["ram_bytes"]} | {image.ram_bytes} |
| stack of a step with odometry and residual \\[bytes\\] | {both("stack of a step with odometry and residual")} |
"""


def drifted(old: str, new: str) -> list[str]:
    """Rows whose figures are not within 10 % of each other."""
    bad = []
    for line in new.splitlines()[2:]:
        label = line.split("|")[1]
        before = next((row for row in old.splitlines() if row.split("|")[1:2] == [label]), None)
        numbers = [[int(n) for n in re.findall(r"\| (\d+) ", row)] for row in (before or "", line)]
        close = len(numbers[0]) == len(numbers[1]) and all(abs(a - b) <= 0.1 * b for a, b in zip(*numbers, strict=True))
        if not close:
            bad.append(f"{label}: {numbers[0]}, measured {numbers[1]}")
    return bad


def placed(page: str, tables: list[str]) -> tuple[str, list[str]]:
    """The page with these tables between its markers, and the tables that were there."""
    head, *parts = page.split(f"{START}\n")
    cut = [part.partition(END) for part in parts]
    written = "".join(f"{START}\n{new}{END}{tail}" for new, (_, _, tail) in zip(tables, cut, strict=True))
    return head + written, [old for old, _, _ in cut]


def self_test() -> None:
    """A wrong figure and a wrong symbol are noticed, and each table finds its place."""
    page = f"a\n{START}\n| 1 |\n{END}\nb\n{START}\n| 2 |\n{END}\nc\n"
    assert placed(page, ["| 1 |\n", "| 2 |\n"]) == (page, ["| 1 |\n", "| 2 |\n"])
    assert placed(page, ["| 3 |\n", "| 4 |\n"])[0] == page.replace("1", "3").replace("2", "4")
    assert forbidden(["__aeabi_dadd", "__aeabi_f2d", "__muldf3", "__extendsfdf2"]) != []
    assert forbidden(["__aeabi_fadd", "__aeabi_uidivmod", "__aeabi_idiv", "__mulsf3", "__aeabi_memcpy4"]) == []
    assert forbidden(["_ZN4core9panicking9panic_fmt17h0E"]) != []
    assert forbidden(["__aeabi_f2d", "panic_fmt"], double=True) == ["panic_fmt"]
    assert over("step", 601, {"promised": 600}) and not over("step", 600, {"promised": 600})
    assert over("step", 111, {"measured": 100}) and not over("step", 110, {"measured": 100})
    assert over("step", None, {"measured": 100})
    assert drifted("| a |\n|---|\n| x | 100 |\n", "| a |\n|---|\n| x | 112 |\n")
    assert not drifted("| a |\n|---|\n| x | 100 |\n", "| a |\n|---|\n| x | 105 |\n")


def main() -> None:
    """Measures, prints, judges."""
    if "--self-test" in sys.argv:
        self_test()
        return
    budgets: dict[str, Any] = tomllib.loads((FIRMWARE / "budgets.toml").read_text())
    rows, problems, hashes = {}, [], set()
    images = {}
    for processor, folder, machine in PROCESSORS:
        release = FIRMWARE / "target" / folder / "release"
        figures, said = run(machine, release / "self_test")
        print(f"{processor}: {said.splitlines()[1]}")
        hashes |= set(re.findall(r"hash (\d+), as on the computer", said))
        if processor == "Cortex-M4F":
            for name in ("drive", "everything", "traction", "estimator", "path"):
                figures |= run(machine, release / name)[0]
            for vehicle in ("chugo7", "mecanum4"):
                for name in (f"cost_{vehicle}", f"cost_traction_{vehicle}"):
                    figures |= run(machine, FIRMWARE / "target" / "c" / name)[0]
            for name in ("controller", "loop"):
                images[name] = Image(release / name)
            for name in C_AND_DRIVE:
                images[name] = Image(FIRMWARE / "target" / name)
            problems += [over(each["name"], figures.get(each["name"]), each) for each in budgets["figure"]]
        for path in release.iterdir():
            if path.name in IMAGES | CONSTRUCTING:
                bad = forbidden(Image(path).symbols, double=path.name in CONSTRUCTING)
                problems += [f"{processor}: {path.name} contains {', '.join(bad)}"] if bad else []
        rows[processor] = figures
    for name in (*C_AND_DRIVE, "c/path", "c/three_wheels", "c/every_function"):
        bad = forbidden(Image(FIRMWARE / "target" / name).symbols)
        problems += [f"{name} contains {', '.join(bad)}"] if bad else []
    if len(hashes) != 1:
        problems.append(f"hashes differ: {hashes}")
    for each in budgets["image"]:
        for what, most in each["promised"].items():
            problems.append(over(f"{each['name']}, {what}", getattr(images[each["name"]], what), {"promised": most}))
    figures_table = table(rows, images)
    print(figures_table)
    tables = [summary(rows["Cortex-M4F"], images, budgets), figures_table]
    page, old = placed(PAGE.read_text(), tables)
    if "--write" in sys.argv:
        PAGE.write_text(page)
    else:
        problems += [f"{PAGE.name}:{line}" for pair in zip(old, tables, strict=True) for line in drifted(*pair)]
    found = [problem for problem in problems if problem]
    for problem in found:
        print(problem, file=sys.stderr)
    sys.exit(bool(found))


if __name__ == "__main__":
    main()
