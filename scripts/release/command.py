"""Builds the command that is published: every feature, no path of this machine, all licences, the list of its parts.

python scripts/release/command.py [TARGET]: writes out/dist/omnistep-VERSION-TARGET.tar.gz for one of Rust's targets.
Default is this machine's target; on Linux the one with musl, so that the program is static. cargo-cyclonedx makes the
list (CycloneDX), and is installed if it is missing.
"""

import os
import platform
import re
import subprocess
import sys
import tarfile
import tomllib
from pathlib import Path

import licences
from build_places import ROOT, named_in, remap_flags, without_places

CYCLONEDX = "0.5.9"
# On Windows: without it the program needs VCRUNTIME140.dll, which a fresh system does not have.
STATIC = "-Ctarget-feature=+crt-static"
PACKED = ("README.md", "CHANGELOG.md", "LICENSE-MIT", "LICENSE-APACHE")


def cargo(*arguments: str, **environment: str) -> None:
    """Run cargo at the top of the repository."""
    subprocess.run(["cargo", *arguments], cwd=ROOT, check=True, env={**os.environ, **environment})


def usual_target() -> str:
    """The default target: that of this machine."""
    if sys.platform == "linux":
        return f"{platform.machine()}-unknown-linux-musl"
    said = subprocess.run(["rustc", "-vV"], check=True, capture_output=True, text=True).stdout
    found = re.search(r"^host: (\S+)$", said, re.MULTILINE)
    assert found, said
    return found[1]


def built(target: str) -> Path:
    """The program."""
    flags, build, path = remap_flags(), "build", os.environ["PATH"]
    if target.endswith("-linux-musl"):
        # Zig brings the C library and the start code, so rustc must not look for its own.
        flags, build = [*flags, "-Clink-self-contained=no"], "zigbuild"
        tools = subprocess.run([ROOT / "scripts/release/build_tools.sh"], check=True, stdout=subprocess.PIPE, text=True)
        path = tools.stdout.strip() + os.pathsep + path
    if target.endswith("-windows-msvc"):
        flags = [*flags, STATIC]
    what = ("--profile", "dist", "--features", "full", "--bin", "omnistep", "--target", target)
    cargo(build, "--locked", *what, CARGO_ENCODED_RUSTFLAGS="\x1f".join(flags), PATH=path)
    name = "omnistep.exe" if "-windows-" in target else "omnistep"
    return ROOT / os.environ.get("CARGO_TARGET_DIR", "target") / target / "dist" / name


def wrong_with(program: Path, target: str) -> str | None:
    """Why the program must not be published, or None: a path of this machine, or a shared library that it needs."""
    if folder := named_in(program.read_bytes()):
        return f"contains the path {folder}: were the compiler's flags replaced?"
    if target.endswith("-linux-musl"):
        command = ["readelf", "--wide", "--program-headers", "--dynamic", program]
        said = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        if needed := re.findall(r"^.*(?:INTERP|NEEDED).*$", said, re.MULTILINE):
            return f"is not static: {needed[0].strip()}"
    if "-windows-" in target and (needed := re.search(rb"vcruntime\w*\.dll", program.read_bytes(), re.IGNORECASE)):
        return f"needs {needed[0].decode()}, which not every Windows has"
    return None


def parts(target: str) -> str:
    """The list of what the program is made of, as CycloneDX."""
    said = subprocess.run(["cargo", "cyclonedx", "--version"], cwd=ROOT, capture_output=True, text=True).stdout
    if CYCLONEDX not in said.split():
        cargo("install", "--quiet", "--locked", f"cargo-cyclonedx@{CYCLONEDX}")
    # It writes a file beside each Cargo.toml of the workspace.
    name = "parts.cdx"
    options = ("--format", "json", "--features", "full", "--target", target, "--override-filename", name)
    try:
        cargo("cyclonedx", "--manifest-path", "crates/omnistep/Cargo.toml", *options)
        return without_places((ROOT / "crates/omnistep" / f"{name}.json").read_text(encoding="utf-8"))
    finally:
        for path in [*ROOT.glob(f"{name}.json"), *ROOT.glob(f"crates/*/{name}.json")]:
            path.unlink()


def libraries(target: str) -> dict[str, str]:
    """Licences of libraries in the program that are not Rust's: musl, which Zig brings."""
    if not target.endswith("-linux-musl"):
        return {}
    tools = subprocess.run([ROOT / "scripts/release/build_tools.sh"], check=True, stdout=subprocess.PIPE, text=True)
    (path,) = Path(tools.stdout.strip()).parent.glob("lib/python*/site-packages/ziglang/lib/libc/musl/COPYRIGHT")
    return {"musl, the C library (MIT)": licences.read(path)}


def main() -> int:
    """Build, look for folders of this machine, pack."""
    version = tomllib.loads((ROOT / "Cargo.toml").read_text(encoding="utf-8"))["workspace"]["package"]["version"]
    target = sys.argv[1] if len(sys.argv) > 1 else usual_target()
    name = f"omnistep-{version}-{target}"
    program = built(target)
    listed = parts(target)
    texts = licences.collected("program", target, libraries(target))
    if wrong := wrong_with(program, target):
        print(f"{program.name} {wrong}", file=sys.stderr)
        return 1
    if target.partition("-")[0] == usual_target().partition("-")[0]:
        subprocess.run([program, "list"], check=True, stdout=subprocess.DEVNULL)
    folder = ROOT / "out" / "dist"
    folder.mkdir(parents=True, exist_ok=True)
    listing = folder / f"{name}.cdx.json"
    listing.write_text(listed, encoding="utf-8")
    written = folder.parent / licences.NAME
    written.write_text(texts, encoding="utf-8", newline="\n")
    with tarfile.open(folder / f"{name}.tar.gz", "w:gz") as archive:
        for path in (program, written, *(ROOT / each for each in PACKED), listing):
            archive.add(path, f"{name}/{path.name}", filter=anonymous)
    print(f"out/dist/{name}.tar.gz: {(folder / f'{name}.tar.gz').stat().st_size} bytes")
    return 0


def anonymous(entry: tarfile.TarInfo) -> tarfile.TarInfo:
    """An entry of an archive without the name of who packed it."""
    entry.uid = entry.gid = 0
    entry.uname = entry.gname = ""
    return entry


if __name__ == "__main__":
    sys.exit(main())
