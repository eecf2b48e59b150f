"""Folders of this machine that may be named in what is built, and what they are called instead.

Run as a program: prints the compiler's flags for it. With these in `CARGO_BUILD_RUSTFLAGS` everything is built as the
wheel is, and what they share is compiled once.
"""

import os
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


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
        named[Path(target).absolute()] = "/target"
    named = {path: name for path, name in named.items() if len(path.parts) > 1}  # a home may be the root folder
    return {str(path): name for path, name in sorted(named.items(), key=lambda item: len(item[0].parts))}


def remap_flags() -> list[str]:
    """Flags of the compiler."""
    return [f"--remap-path-prefix={path}={name}" for path, name in places().items()]


def main() -> None:
    """Print the flags; without those of folders whose names hold spaces, at which Cargo would part them."""
    flags = remap_flags()
    whole = [flag for flag in flags if len(flag.split()) == 1]
    if len(whole) < len(flags):
        print("a folder's name holds a space: the wheel will be built apart from the rest", file=sys.stderr)
    print(*whole)


if __name__ == "__main__":
    main()
