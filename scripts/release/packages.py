"""Packs the prebuilt archives for Arduino, PlatformIO, ESP-IDF, Zephyr and CMake, and a node for micro-ROS.

python scripts/release/packages.py CONSTANTS LINE [FOLDER]: writes omnistep-KIND-VERSION.zip and SHA256SUMS into FOLDER,
by default out/archives. CONSTANTS is the header of the example's scenario, and LINE what the example prints. A package
is the folder firmware/packages/KIND, with the header, the archives, the example and the licences. A file that ends in
.in is filled from archives.toml and Cargo.toml. Equal content produces equal bytes.
"""

import hashlib
import re
import sys
import tomllib
import zipfile
from pathlib import Path

import licences
from archives import BUILT, FIRMWARE, archives
from build_places import ROOT

PACKAGES = FIRMWARE / "packages"
SYSTEMS = {"arduino": "Arduino", "platformio": "PlatformIO", "esp-idf": "ESP-IDF", "zephyr": "Zephyr", "cmake": "CMake"}
# Where each kind has the header, and its example.
HEADERS = {"arduino": "src"}
EXAMPLES = {
    "arduino": "examples/Mecanum",
    "platformio": "examples/mecanum/src",
    "esp-idf": "examples/mecanum/main",
    "zephyr": "samples/mecanum/src",
    "cmake": "example",
    "micro-ros": "",
}
# Texts that go into README.md.
PARTS_OF_README = ("about.md", "run.md")
Files = dict[str, bytes]


def places(kind: str, archive: dict) -> list[str]:
    """Where a package has an archive; none if it is for other processors."""
    if kind == "arduino":
        return [f"src/{folder}/libomnistep.a" for folder in archive["arduino"]]
    if kind == "micro-ros" or (kind == "esp-idf" and "esp" not in archive):
        return []
    return [f"lib/{archive['name']}/libomnistep.a"]


def table(kind: str, rows: list[dict]) -> str:
    """The archives of a package, for its README."""
    lines = ["| archive | processors | compiled for | bytes |", "|---|---|---|---:|"]
    for row in rows:
        if not places(kind, row):
            continue
        fits = "; ".join(f"{', '.join(cpus)} (`{abi}`)" for abi, cpus in row["fits"].items())
        if kind == "esp-idf":
            fits = ", ".join(row["esp"])
        size = (BUILT / row["name"] / "libomnistep.a").stat().st_size
        lines.append(f"| `{row['name']}` | {fits} | `{row['target']}` | {size} |")
    return "\n".join(lines)


def values(rows: list[dict], line: str) -> dict[str, str]:
    """What the words between @ stand for."""
    package = tomllib.loads((ROOT / "Cargo.toml").read_text(encoding="utf-8"))["workspace"]["package"]
    fits = [(abi, cpu, row["name"]) for row in rows for abi, cpus in row["fits"].items() for cpu in cpus]
    chips = [(chip, row["name"]) for row in rows for chip in row.get("esp", [])]
    return {
        "version": package["version"],
        "minor": package["version"].rpartition(".")[0],
        "repository": package["repository"],
        "line": line,
        "names": ", ".join(row["name"] for row in rows),
        "chips": ", ".join(chip for chip, _ in chips),
        "chips_cmake": "\n".join(f"set(omnistep_archive_{chip} {name})" for chip, name in chips),
        "chips_python": ", ".join(f'"{chip}": "{name}"' for chip, name in chips),
        "fits_cmake": "\n".join(f"    set(fits_{abi}_{cpu} {name})" for abi, cpu, name in fits),
        "fits_python": "\n".join(f'    ("{abi}", "{cpu}"): "{name}",' for abi, cpu, name in fits),
    }


def filled(text: str, words: dict[str, str]) -> str:
    """A template with its words; a word that is unknown ends the packing."""
    return re.sub(r"@(\w+)@", lambda found: words[found[1]], text)


def package(kind: str, rows: list[dict], words: dict[str, str], common: Files) -> Files:
    """Every file of a package, by its path in it."""
    files: Files = {}
    folder = PACKAGES / kind
    words = {**words, "archives": table(kind, rows)}
    if kind in SYSTEMS:
        words["system"] = SYSTEMS[kind]
        for name in PARTS_OF_README:
            words[name.removesuffix(".md")] = filled((folder / name).read_text(encoding="utf-8").strip(), words)
        files["README.md"] = filled((PACKAGES / "README.md.in").read_text(encoding="utf-8"), words).encode()
    for path in sorted(each for each in folder.rglob("*") if each.is_file() and each.name not in PARTS_OF_README):
        name, content = path.relative_to(folder).as_posix(), path.read_bytes()
        if name.endswith(".in"):
            name, content = name.removesuffix(".in"), filled(content.decode(), words).encode()
        files[name] = content
    for row in rows:
        for place in places(kind, row):
            files[place] = (BUILT / row["name"] / "libomnistep.a").read_bytes()
    if kind in SYSTEMS:
        for header in sorted((FIRMWARE / "c" / "include").iterdir()):
            files[f"{HEADERS.get(kind, 'include')}/{header.name}"] = header.read_bytes()
        files["PARTS.txt"] = common["PARTS.txt"]
    for name in ("LICENSE-MIT", "LICENSE-APACHE"):
        files[name] = common[name]
    # Arduino's and other tools look for a file of this name.
    files["LICENSE"] = b"MIT or Apache-2.0, as you choose: LICENSE-MIT, LICENSE-APACHE.\n"
    example = f"{EXAMPLES[kind]}/".lstrip("/")
    for name in ("base.c", "base.h", "bench.c", "constants.h", "mecanum.toml"):
        if kind != "micro-ros" or name != "bench.c":
            files[example + name] = common[name]
    choice = filled((PACKAGES / "omnistep-archive.cmake.in").read_text(encoding="utf-8"), words).encode()
    if kind == "zephyr":
        files["omnistep-archive.cmake"] = choice
    if kind == "cmake":
        config = "lib/cmake/omnistep/"
        for name in ("omnistep-config.cmake", "omnistep-config-version.cmake"):
            files[config + name] = files.pop(name)
        files[config + "omnistep-archive.cmake"] = choice
        for name in ("omnistep-constants.cmake", "write-constants.cmake"):
            files[config + name] = (FIRMWARE / "c" / "cmake" / name).read_bytes()
        for name in ("startup.c", "startup.h", "link.ld"):
            files[example + name] = (FIRMWARE / "c" / "example" / name).read_bytes()
    return files


def write(path: Path, top: str, files: Files) -> None:
    """A zip whose bytes depend on nothing but its files."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as packed:
        for name, content in sorted(files.items()):
            entry = zipfile.ZipInfo(f"{top}/{name}", date_time=(1980, 1, 1, 0, 0, 0))
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.create_system, entry.external_attr = 3, 0o100644 << 16
            packed.writestr(entry, content)


def main() -> int:
    """Pack each kind, and write the checksums."""
    if len(sys.argv) not in (3, 4):
        print(__doc__.split("\n\n")[1].partition(":")[0], file=sys.stderr)
        return 2
    rows = archives()
    words = values(rows, sys.argv[2])
    out = Path(sys.argv[3]) if len(sys.argv) == 4 else ROOT / "out" / "archives"
    out.mkdir(parents=True, exist_ok=True)
    # The same packages for every processor of the table.
    parts = licences.collected("library", licences.MICROCONTROLLER)
    common = {path.name: path.read_bytes() for path in (PACKAGES / "example").iterdir()}
    common |= {name: (ROOT / name).read_bytes() for name in ("LICENSE-MIT", "LICENSE-APACHE")}
    common |= {"constants.h": Path(sys.argv[1]).read_bytes(), "PARTS.txt": parts.encode()}
    sums = []
    for kind in EXAMPLES:
        top = "omnistep" if kind in SYSTEMS else f"omnistep-{kind}"
        path = out / f"omnistep-{kind}-{words['version']}.zip"
        files = package(kind, rows, words, common)
        write(path, top, files)
        sums.append(f"{hashlib.sha256(path.read_bytes()).hexdigest()}  {path.name}\n")
        print(f"{path.stat().st_size:8} bytes, {len(files):3} files: {path.name}")
    (out / "SHA256SUMS").write_text("".join(sums), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
