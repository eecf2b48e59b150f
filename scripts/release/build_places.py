"""Folders of this machine that may be named in what is built, and what they are called instead.

Run as a program: prints the compiler's flags for it. With these in `CARGO_BUILD_RUSTFLAGS` everything is built as the
wheel is, and what they share is compiled once. With files as arguments: searches them, and the contents of wheels, .zip
and .tar.gz files, for such folders; exit code 1 if it finds any.
"""

import os
import re
import sys
import tarfile
import zipfile
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def places() -> dict[str, str]:
    """Folders and their other names; outer first, because the compiler takes the last that fits."""
    home = Path.home()
    named = {
        home: "/home",
        Path(os.environ.get("CARGO_HOME", home / ".cargo")): "/cargo",
        Path(os.environ.get("RUSTUP_HOME", home / ".rustup")): "/rustup",
        ROOT: "/omnistep",
    }
    if target := os.environ.get("CARGO_TARGET_DIR"):
        named[ROOT / target] = "/target"
    named = {path: name for path, name in named.items() if len(path.parts) > 1}  # a home may be the root folder
    return {str(path): name for path, name in sorted(named.items(), key=lambda item: len(item[0].parts))}


def remap_flags() -> list[str]:
    """Flags of the compiler."""
    return [f"--remap-path-prefix={path}={name}" for path, name in places().items()]


def named_in(content: bytes) -> str | None:
    """The innermost folder of this machine that a file names."""
    for path in reversed(places()):
        if any(re.search(pattern.encode(), content) for pattern in patterns(path)):
            return path
    return None


def patterns(path: str) -> list[str]:
    """Expressions for a folder in a text: alone or with what is in it, and not as a part of another folder's name."""
    # A folder of one name, such as /src, is also the end of others.
    before = r"(?<![\w.-])" if len(Path(path).parts) == 2 else ""
    return [f"{before}{re.escape(written)}(?![\\w.-])" for written in written_ways(path)]


def written_ways(path: str) -> list[str]:
    """A path, and how JSON and addresses write it if that differs (on Windows)."""
    return list(dict.fromkeys((path, path.replace("\\", "\\\\"), path.replace("\\", "/"))))


def without_places(text: str) -> str:
    """A text with the other names instead of the folders."""
    for path, name in reversed(places().items()):
        for pattern in patterns(path):
            text = re.sub(pattern, lambda _, name=name: name, text)  # type: ignore[misc]
    return text


def contents(file: Path) -> Iterator[tuple[str, bytes]]:
    """Name and content of the file, or of each file packed in it."""
    if file.suffix in (".whl", ".zip"):
        with zipfile.ZipFile(file) as wheel:
            yield from ((f"{file.name}: {name}", wheel.read(name)) for name in wheel.namelist())
    elif file.name.endswith(".tar.gz"):
        with tarfile.open(file) as archive:
            for entry in archive:
                if packed := archive.extractfile(entry):
                    yield f"{file.name}: {entry.name}", packed.read()
    else:
        yield file.name, file.read_bytes()


def check(files: list[str]) -> None:
    """Exit with code 1, and one line for each file that names a folder of this machine."""
    searched = 0
    wrong = []
    for name, content in (each for file in files for each in contents(Path(file))):
        searched += 1
        if path := named_in(content):
            wrong.append(f"{name} contains the path {path}")
    if wrong:
        sys.exit("\n".join(wrong))
    print(f"no path of this machine in {searched} files ({len(files)} with their contents)")


def print_flags() -> None:
    """Print the flags; without those of folders whose names hold spaces, at which Cargo would part them."""
    flags = remap_flags()
    whole = [flag for flag in flags if len(flag.split()) == 1]
    if len(whole) < len(flags):
        print("a folder's name holds a space: the wheel will be built apart from the rest", file=sys.stderr)
    print(*whole)


if __name__ == "__main__":
    check(sys.argv[1:]) if len(sys.argv) > 1 else print_flags()
