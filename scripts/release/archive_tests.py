"""Links two examples to every prebuilt archive, by the CMake package, and compares what they print in QEMU.

python scripts/release/archive_tests.py PACKAGE THREE LINE LINE: PACKAGE is the folder of the unpacked CMake package,
THREE the folder of the constants of firmware/scenarios/three.toml, and each LINE what an example has to print. Every
processor and float ABI of archives.toml is linked for; those that QEMU has are run. The first difference ends it.
"""

import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from archives import FIRMWARE, archives, prefix

TESTS = FIRMWARE / "packages" / "tests"
WORK = FIRMWARE / "target" / "archives" / "tests"
# QEMU's machine of a processor. The Cortex-M0 and M1 have the instructions of the M0+, and are only linked for.
MACHINES = {"cortex-m3": "mps2-an385", "cortex-m4": "mps2-an386", "cortex-m7": "mps2-an500", "cortex-m33": "mps2-an505"}
MACHINES |= {"cortex-m0plus": "microbit", "rv32imc": "virt", "rv32imac": "virt"}
UNITS = {"cortex-m4": "fpv4-sp-d16", "cortex-m7": "fpv5-sp-d16", "cortex-m33": "fpv5-sp-d16"}
# Where flash and memory of that machine are, instead of where link.ld has them.
SECURE = {"0x00000000": "0x10000000", "0x20000000": "0x38000000"}
PROGRAMS = ("mecanum", "three")


def options(abi: str, cpu: str) -> str:
    """What gcc is called with."""
    if cpu.startswith("rv"):
        return f"-march={cpu} -mabi={abi} --specs=picolibc.specs -O2"
    unit = f" -mfpu={UNITS[cpu]}" if abi != "soft" and cpu in UNITS else ""
    return f"-mcpu={cpu} -mthumb -mfloat-abi={abi}{unit} -O2"


def link_script(cpu: str) -> Path:
    """Where the machine has its memory."""
    if cpu.startswith("rv"):
        return TESTS / "riscv.ld"
    script = FIRMWARE / "c" / "example" / "link.ld"
    if cpu != "cortex-m33":
        return script
    text = script.read_text(encoding="utf-8")
    for usual, secure in SECURE.items():
        text = text.replace(usual, secure)
    changed = WORK / "secure.ld"
    changed.write_text(text, encoding="utf-8")
    return changed


def run(*command: str | Path) -> str:
    """What a command prints; where it fails, that ends the test."""
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    if done.returncode:
        raise SystemExit(f"{' '.join(map(str, command))}:\n{done.stdout}")
    return done.stdout


def build(archive: dict, abi: str, cpu: str, package: Path, three: Path) -> Path:
    """Both programs for a processor, with the archive that the package chooses for it."""
    folder = WORK / f"{cpu}-{abi}"
    startup = TESTS / "startup_riscv.c" if cpu.startswith("rv") else FIRMWARE / "c" / "example" / "startup.c"
    values = {
        "CMAKE_SYSTEM_NAME": "Generic",
        "CMAKE_C_COMPILER": f"{prefix(archive)}gcc",
        "CMAKE_C_FLAGS": options(abi, cpu),
        "CMAKE_TRY_COMPILE_TARGET_TYPE": "STATIC_LIBRARY",
        "omnistep_ROOT": package,
        "PACKAGE": package,
        "STARTUP": startup,
        "LINK_SCRIPT": link_script(cpu),
        "THREE_CONSTANTS": three,
    }
    said = run("cmake", "--fresh", "-S", TESTS, "-B", folder, *(f"-D{name}={value}" for name, value in values.items()))
    if f"omnistep: {archive['name']}\n" not in said:
        raise SystemExit(f"another archive than {archive['name']} was chosen for {cpu} with {abi}:\n{said}")
    run("cmake", "--build", folder)
    return folder


def compare(case: tuple[dict, str, str], package: Path, three: Path, lines: list[str]) -> str:
    """Build and run for one processor; one line that says what was done."""
    archive, abi, cpu = case
    start = time.monotonic()
    folder = build(archive, abi, cpu, package, three)
    machine = MACHINES.get(cpu)
    for program, line in zip(PROGRAMS, lines, strict=True):
        if machine and (said := run(FIRMWARE / "qemu.sh", machine, folder / program).strip()) != line:
            raise SystemExit(f"{archive['name']} for {cpu} with {abi} in {machine}: {said}\nwanted: {line}")
    what = f"run in {machine}" if machine else "linked, not run"
    return f"{time.monotonic() - start:5.1f} s  {archive['name']:17} {cpu}, {abi}: {what}"


def main() -> int:
    """Every processor and float ABI of the table, two at a time."""
    package, three = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()
    WORK.mkdir(parents=True, exist_ok=True)
    cases = [(row, abi, cpu) for row in archives() for abi, cpus in row["fits"].items() for cpu in cpus]
    with ThreadPoolExecutor(2) as pool:
        for line in pool.map(lambda case: compare(case, package, three, sys.argv[3:]), cases):
            print(line, flush=True)
    print(f"{len(cases)} processors and float ABIs: the same lines")
    return 0


if __name__ == "__main__":
    sys.exit(main())
