"""Tries every package of out/archives with its own system's tools, as far as they are here.

python scripts/release/package_tests.py TOOLS LINE [--required]: TOOLS is the folder of a virtual environment's programs
with python/requirements-packages.txt, and LINE what the example prints. Compilers are arm-none-eabi-gcc and
riscv64-unknown-elf-gcc; programs run in QEMU. Prints what it skips; with --required that is an error.
"""

import json
import os
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

from archive_tests import MACHINES, link_script, options
from archives import FIRMWARE, archives, prefix
from build_places import ROOT
from packages import EXAMPLES, PACKAGES

OUT = ROOT / "out" / "archives"
WORK = FIRMWARE / "target" / "archives" / "packages"
TESTS = PACKAGES / "tests"
STARTUP = tuple(FIRMWARE / "c" / "example" / name for name in ("startup.c", "startup.h", "link.ld"))
# Boards of tests/arduino, the folder of the archive that each has to get, and QEMU's machine.
ARDUINO = {
    "m0plus": ("cortex-m0plus", "microbit"),
    "m3": ("cortex-m3", "mps2-an385"),
    "unor4": ("cortex-m4", "mps2-an386"),
    "nano33": ("cortex-m4/-mfpu=fpv4-sp-d16--mfloat-abi=softfp", "mps2-an386"),
    "m4hard": ("cortex-m4/fpv4-sp-d16-hard", "mps2-an386"),
    "m4softfp": ("cortex-m4/fpv4-sp-d16-softfp", "mps2-an386"),
    "m7softfp": ("cortex-m7/fpv5-d16-softfp", "mps2-an500"),
    "m7hard": ("imxrt1062/fpv5-d16-hard", "mps2-an500"),
    "m33hard": ("cortex-m33/fpv5-sp-d16-hard", None),
    "m33softfp": ("cortex-m33", None),
}
# What Kconfig sets for a float ABI or a processor; else the symbol is the processor's name.
ZEPHYR = {"soft": [], "softfp": ["FPU", "FP_SOFTABI"], "hard": ["FPU", "FP_HARDABI"], "ilp32": ["RISCV"]}
ZEPHYR |= {"rv32imc": [], "rv32imac": ["RISCV_ISA_EXT_A"]}
# What the module's Kconfig names of Zephyr's, beside CPU_CORTEX_M.
ZEPHYR_SYMBOLS = ("RISCV", "64BIT", "FLOAT_HARD", "RISCV_ISA_EXT_M", "RISCV_ISA_EXT_C")
# PlatformIO reads the list of licences from the network; these are the two that the manifest names.
PIO = """
from platformio.package.manifest.schema import ManifestSchema
names = [{"licenseId": name} for name in ("MIT", "Apache-2.0")]
ManifestSchema.load_spdx_licenses = staticmethod(lambda: {"licenses": names})
from platformio.__main__ import main
raise SystemExit(main())
"""


def run(*command: str | Path, cwd: Path = WORK, fails: bool = False, **environment: str) -> str:
    """What a command prints; if it fails and should not, or the other way round, that ends the test."""
    env = {**os.environ, **environment}
    done = subprocess.run(command, cwd=cwd, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=env)
    if (done.returncode != 0) != fails:
        raise SystemExit(f"{' '.join(map(str, command))}:\n{done.stdout}")
    return done.stdout


def emulate(machine: str | None, image: Path, line: str) -> str:
    """Run a program, compare what it prints, and return the last words of a report."""
    if machine is None:
        return "linked"
    if (said := run(FIRMWARE / "qemu.sh", machine, image).strip()) != line:
        raise SystemExit(f"{image} in {machine}: {said}\nwanted: {line}")
    return f"run in {machine}"


def arduino(package: Path, tools: Path, line: str) -> str:
    """Compile the sketch for each board of the test's core."""
    cli = shutil.which("arduino-cli")
    if cli is None:
        return "skipped: arduino-cli is missing"
    home = package.parent
    core = home / "hardware" / "test" / "test"
    shutil.copytree(TESTS / "arduino", core)
    (home / "libraries").mkdir()
    library = package.rename(home / "libraries" / "omnistep")
    for path in STARTUP:
        shutil.copy(path, core / "cores" / "test")
    folders = {name: str(home / name) for name in ("data", "downloads")} | {"user": str(home)}
    (home / "cli.json").write_text(json.dumps({"directories": folders}), encoding="utf-8")
    for board, (folder, machine) in ARDUINO.items():
        build = home / board
        command = (cli, "--config-file", home / "cli.json", "compile", "--verbose", "--fqbn", f"test:test:{board}")
        said = run(*command, "--build-path", build, library / "examples" / "Mecanum")
        found = set(re.findall(r"-L(\S+)", said))
        if found != {str(library / "src" / folder)}:
            raise SystemExit(f"arduino-cli takes another archive for {board}: {found}")
        print(f"  {board}: src/{folder}, {emulate(machine, build / 'Mecanum.ino.elf', line)}")
    return f"{run(cli, 'version').split('Version:')[-1].split()[0]} of arduino-cli: {len(ARDUINO)} boards"


def platformio(package: Path, tools: Path, line: str) -> str:
    """Check the manifest, and build a project for a board of each archive."""
    home = package.parent
    settings = {"PLATFORMIO_CORE_DIR": str(home / "core"), "PLATFORMIO_SETTING_ENABLE_TELEMETRY": "no"}
    run(tools / "python", "-c", PIO, "pkg", "pack", package, cwd=home, **settings)
    platform, project = home / "platform", home / "project"
    shutil.copytree(TESTS / "platformio", platform)
    shutil.copytree(package / "examples" / "mecanum" / "src", project / "src")
    (project / "src" / "main.cpp").unlink()
    shutil.copy(PACKAGES / "cmake" / "example" / "main.c", project / "src")
    (platform / "program").mkdir()
    (platform / "boards").mkdir()
    for path in (*STARTUP, TESTS / "startup_riscv.c"):
        shutil.copy(path, platform / "program")
    # SCons from PyPI, under the name of PlatformIO's own package of it, which is in its registry only.
    scons = home / "core" / "packages" / "tool-scons"
    scons.mkdir(parents=True)
    code = "from platformio import dependencies as d; print(d.get_core_dependencies()['tool-scons'])"
    wanted = run(tools / "python", "-c", code)
    entry = {"name": "tool-scons", "version": wanted.strip().lstrip("~^=")}
    (scons / "package.json").write_text(json.dumps({**entry, "description": "SCons"}), encoding="utf-8")
    spec = {"owner": "platformio", "id": None, "name": "tool-scons", "requirements": None, "uri": None}
    (scons / ".piopm").write_text(json.dumps({"type": "tool", **entry, "spec": spec}), encoding="utf-8")
    (scons / "scons.py").write_text("import SCons.Script\nSCons.Script.main()\n", encoding="utf-8")
    [library] = OUT.glob("omnistep-platformio-*.zip")
    shutil.copy(library, project)
    lines = ["[env]", f"platform = symlink://{platform}", f"lib_deps = file://{library.name}"]
    cases = []
    for row in archives():
        abi, cpus = next(iter(row["fits"].items()))
        cpu = next(each for each in cpus if each in MACHINES)
        cases.append((row["name"], cpu))
        build = {"mcu": row.get("esp", ["test"])[0], "cpu": cpu, "prefix": prefix(row), "flags": options(abi, cpu)}
        build["startup"] = "startup_riscv.c" if cpu.startswith("rv") else "startup.c"
        build["script"] = str(link_script(cpu))
        board = {"name": row["name"], "vendor": "none", "url": "none", "frameworks": [], "build": build}
        board["upload"] = {"maximum_size": 262144, "maximum_ram_size": 16384}
        (platform / "boards" / f"{row['name']}.json").write_text(json.dumps(board), encoding="utf-8")
        lines += [f"[env:{row['name']}]", f"board = {row['name']}"]
    # One that is not for this processor, but that it can run.
    lines += ["[env:chosen]", "board = cortex-m4-softfp", "custom_omnistep_archive = cortex-m0plus"]
    cases.append(("chosen", "cortex-m4"))
    (project / "platformio.ini").write_text("\n".join(lines) + "\n", encoding="utf-8")
    said = run(tools / "pio", "run", cwd=project, **settings)
    wanted = [*(name for name, _ in cases[:-1]), "cortex-m0plus"]
    if (found := re.findall(r"^omnistep: (.*)$", said, re.MULTILINE)) != wanted:
        raise SystemExit(f"choose_archive.py chooses {found}:\n{said}")
    for name, cpu in cases:
        image = project / ".pio" / "build" / name / "firmware.elf"
        print(f"  {name}: {emulate(MACHINES[cpu], image, line)}")
    version = run(tools / "pio", "--version", **settings).split()[-1]
    return f"{version} of PlatformIO: manifest, {len(cases)} projects"


def esp_idf(package: Path, tools: Path, line: str) -> str:
    """Run CMakeLists.txt for every chip, and pack the component, which reads the manifest."""
    chips = [(chip, row["name"]) for row in archives() for chip in row.get("esp", [])]
    for chip, name in chips:
        build = package.parent / "build"
        values = (f"-DCOMPONENT={package}", f"-DIDF_TARGET={chip}")
        said = run("cmake", "--fresh", "-S", TESTS / "esp-idf", "-B", build, *values)
        if f"linked: {package}/lib/{name}/libomnistep.a" not in said:
            raise SystemExit(f"the component links another archive for {chip}:\n{said}")
    settings = {"IDF_TOOLS_PATH": str(package.parent / "tools")}
    run(tools / "compote", "component", "pack", "--name", "omnistep", cwd=package, **settings)
    if not list((package / "dist").glob("*.tgz")):
        raise SystemExit("compote packed nothing")
    version = run(tools / "compote", "version", **settings).strip()
    return f"{version} of the component manager: manifest, {len(chips)} chips, without ESP-IDF"


def zephyr(package: Path, tools: Path, line: str) -> str:
    """Run the module's CMakeLists.txt for every processor, and read its Kconfig."""
    kconfig = package.parent / "Kconfig"
    symbols = "".join(f"config {name}\n\tbool\n" for name in ZEPHYR_SYMBOLS)
    kconfig.write_text(f"config CPU_CORTEX_M\n\tdef_bool y\n{symbols}rsource 'omnistep/Kconfig'\n", encoding="utf-8")
    code = (
        "import kconfiglib, sys\nc = kconfiglib.Kconfig(sys.argv[1])\nprint(c.syms['OMNISTEP'].visibility, *c.warnings)"
    )
    if (said := run(tools / "python", "-c", code, kconfig, cwd=package.parent).strip()) != "2":
        raise SystemExit(f"Kconfig: {said}")
    count = 0
    for row in archives():
        for abi, cpus in row["fits"].items():
            for cpu in cpus:
                symbols = ["OMNISTEP", *ZEPHYR[abi], *ZEPHYR.get(cpu, [f"CPU_{cpu.upper().replace('-', '_')}"])]
                values = [f"-DCONFIG_{name}=y" for name in symbols]
                build = package.parent / "build"
                said = run("cmake", "--fresh", "-S", TESTS / "zephyr", "-B", build, f"-DMODULE={package}", *values)
                if f"imported: {package}/lib/{row['name']}/libomnistep.a" not in said:
                    raise SystemExit(f"the module links another archive for {cpu} with {abi}:\n{said}")
                count += 1
    return f"Kconfig, {count} processors and float ABIs, without Zephyr"


def cmake(package: Path, tools: Path, line: str) -> str:
    """Call the commands of README.md."""
    text = (package / "README.md").read_text(encoding="utf-8")
    commands = next(block for block in re.findall(r"```sh\n(.*?)```", text, re.DOTALL) if "qemu" in block)
    said = run("bash", "-euc", commands, cwd=package.parent)
    if said.splitlines()[-1] != line:
        raise SystemExit(f"the commands of README.md: {said}")
    # An archive of one's own choice, one that there is not, and a processor that has none.
    configure = ("cmake", "--fresh", "-S", package / "example", "-B", package.parent / "build")
    toolchain = "-DCMAKE_TOOLCHAIN_FILE=cortex-m4.cmake"
    for option, message in (
        ("-DOMNISTEP_ARCHIVE=cortex-m4-softfp", "omnistep: cortex-m4-softfp"),
        ("-DOMNISTEP_ARCHIVE=z80", "OMNISTEP_ARCHIVE is z80; omnistep has: cortex-m0plus"),
        (
            "-DCMAKE_C_FLAGS=-mcpu=cortex-m55 -mfloat-abi=hard",
            "omnistep has no archive for cortex-m55 with the ABI hard",
        ),
    ):
        said = run(*configure, toolchain, option, fails=not message.startswith("omnistep: "))
        if message not in " ".join(said.split()):
            raise SystemExit(f"{option}: {said}")
    return "the commands of README.md, and the choice of an archive"


def micro_ros(package: Path, tools: Path, line: str) -> str:
    """Compile the node against declarations of the functions that it calls."""
    stub = package.parent / "stub"
    for name in re.findall(r"#include <(\w+/.+\.h)>", (package / "node.c").read_text(encoding="utf-8")):
        (stub / name).parent.mkdir(parents=True, exist_ok=True)
        (stub / name).write_text('#include "declarations.h"\n', encoding="utf-8")
    flags = [*options("hard", "cortex-m4").split(), "-std=c11", "-Wall", "-Wextra", "-Werror"]
    folders = [f"-I{folder}" for folder in (stub, TESTS / "micro-ros", FIRMWARE / "c" / "include")]
    for name in ("node.c", "base.c"):
        run("arm-none-eabi-gcc", *flags, *folders, "-c", package / name, "-o", package.parent / "node.o")
    return "compiled against declarations"


def main() -> int:
    """Try each package."""
    tools, line, required = Path(sys.argv[1]).resolve(), sys.argv[2], sys.argv[3:] == ["--required"]
    shutil.rmtree(WORK, ignore_errors=True)
    for kind in EXAMPLES:
        [path] = OUT.glob(f"omnistep-{kind}-[0-9]*.zip")
        home = WORK / kind
        with zipfile.ZipFile(path) as packed:
            packed.extractall(home)
        [package] = home.iterdir()
        said = globals()[kind.replace("-", "_")](package, tools, line)
        print(f"{kind}: {said}", flush=True)
        if required and said.startswith("skipped"):
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
