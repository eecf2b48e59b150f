"""Builds libomnistep.a for every processor of firmware/packages/archives.toml, for users without a Rust toolchain.

python scripts/release/archives.py [+TOOLCHAIN]: writes firmware/target/archives/NAME/libomnistep.a. Each archive is one
object that needs no other library and defines no other names than the header's, so that it can be linked into any
program: the parts of Rust's library that it uses are inside, under names of its own. Needs Rust's targets and the
binutils of gcc-arm-none-eabi and gcc-riscv64-unknown-elf.
"""

import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

from build_places import ROOT, named_in, remap_flags

FIRMWARE = ROOT / "firmware"
TABLE = FIRMWARE / "packages" / "archives.toml"
BUILT = FIRMWARE / "target" / "archives"
# What the compiler leaves for other tools, and tables for exceptions, which the library has none of. With a note about
# the stack in one object, ld warns of all objects without it, such as those of gcc.
REMOVED = (".llvmbc", ".llvmcmd", ".comment", ".note.GNU-stack", ".eh_frame", ".ARM.exidx*", ".ARM.extab*")


def archives() -> list[dict]:
    """The rows of the table."""
    return tomllib.loads(TABLE.read_text(encoding="utf-8"))["archive"]


def prefix(archive: dict) -> str:
    """How the names of gcc and its tools begin."""
    return "riscv64-unknown-elf-" if archive["target"].startswith("riscv") else "arm-none-eabi-"


def said(*command: str | Path) -> str:
    """What a command prints; its failure ends the build."""
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True).stdout


def compile_for(rows: list[dict], folder: Path, toolchain: list[str]) -> None:
    """Compile the library for the targets of these rows, in parallel."""
    drop = ("RUSTFLAGS", "CARGO_ENCODED_RUSTFLAGS", "CARGO_BUILD_RUSTFLAGS", "CARGO_BUILD_TARGET")
    environment = {name: value for name, value in os.environ.items() if name not in drop}
    # Dependencies of build scripts and macros are compiled once, also for the images of scripts/firmware.sh.
    environment |= {"CARGO_TARGET_DIR": str(folder), "CARGO_BUILD_BUILD_DIR": str(FIRMWARE / "target" / "build")}
    environment["CARGO_PROFILE_RELEASE_DEBUG"] = "false"
    for row in rows:
        name = row["target"].upper().replace("-", "_").replace(".", "_")
        environment[f"CARGO_TARGET_{name}_RUSTFLAGS"] = " ".join([*remap_flags(), *row.get("rust", "").split()])
    targets = [word for row in rows for word in ("--target", row["target"])]
    what = ("--locked", "--quiet", "--release", "--package", "omni-c", "--lib")
    subprocess.run(["cargo", *toolchain, "build", *what, *targets], cwd=FIRMWARE, check=True, env=environment)


def names(tool: str, path: Path, *options: str) -> list[str]:
    """Symbols of an object or an archive."""
    lines = said(f"{tool}nm", *options, path).splitlines()
    return sorted({line.split()[-1] for line in lines if line.strip() and not line.endswith(":")})


def finish(archive: dict, library: Path) -> None:
    """Make one object of what the header's functions need, and an archive of it."""
    tool, folder = prefix(archive), BUILT / archive["name"]
    folder.mkdir(parents=True, exist_ok=True)
    stripped, whole, packed = folder / "stripped.a", folder / "omnistep.o", folder / "libomnistep.a"
    removed = [f"--remove-section={name}" for name in REMOVED]
    said(f"{tool}objcopy", "--strip-debug", *removed, library, stripped)
    functions = [name for name in names(tool, stripped, "--extern-only", "--defined-only") if name.startswith("omni")]
    emulation = ["-m", "elf32lriscv"] if "riscv" in tool else []
    roots = [f"--undefined={name}" for name in functions]
    said(f"{tool}ld", *emulation, "--relocatable", "--gc-sections", *roots, stripped, "-o", whole)
    keep = [f"--keep-global-symbol={name}" for name in functions]
    said(f"{tool}objcopy", *keep, "--strip-unneeded", *removed, whole)
    packed.unlink(missing_ok=True)
    said(f"{tool}ar", "rcsD", packed, whole)
    stripped.unlink()
    whole.unlink()
    check(archive, packed)


def check(archive: dict, packed: Path) -> None:
    """End the build where an archive has what it must not have."""
    tool = prefix(archive)
    header = (FIRMWARE / "c" / "include" / "omnistep.h").read_text(encoding="utf-8")
    if missing := names(tool, packed, "--undefined-only"):
        sys.exit(f"{archive['name']} needs other libraries: {' '.join(missing)}")
    defined = names(tool, packed, "--extern-only", "--defined-only")
    if foreign := [name for name in defined if not name.startswith("omni")]:
        sys.exit(f"{archive['name']} defines names that other libraries may have: {' '.join(foreign)}")
    # Some have the version in their symbol.
    symbols = dict(re.findall(r"^#define (omni\w+) (omni\w+)$", header, re.MULTILINE))
    declared = re.findall(r"^\w[\w *]*\b(omni\w*)\(", header, re.MULTILINE)
    declared = {symbols.get(name, name) for name in declared}
    if lacking := declared - set(defined):
        sys.exit(f"{archive['name']} lacks functions of the header: {' '.join(sorted(lacking))}")
    if folder := named_in(packed.read_bytes()):
        sys.exit(f"{archive['name']} contains the path {folder}")
    # Many floating-point units support only single precision.
    if ".f64" in said(f"{tool}objdump", "--disassemble", packed):
        sys.exit(f"{archive['name']} computes in double precision")
    print(f"{packed.stat().st_size:8} bytes, {len(defined)} functions: {archive['name']}, {archive['target']}")


def main() -> int:
    """Build what has to be built together, then what is apart."""
    toolchain = sys.argv[1:]
    rows = archives()
    together = [row for row in rows if not row.get("apart")]
    compile_for(together, BUILT / "cargo", toolchain)
    for row in rows:
        folder = BUILT / "cargo"
        if row.get("apart"):
            folder = BUILT / "cargo" / row["name"]
            compile_for([row], folder, toolchain)
        finish(row, folder / row["target"] / "release" / "libomnistep.a")
    return 0


if __name__ == "__main__":
    sys.exit(main())
