"""Writes the tables of files in docs/design.md from the first line of each file.

A marker names a folder, whose files are listed, and then files and folders below it that are listed too. A first line
is one sentence: of a Rust file its first `//!`, of a Python file that of its docstring.
"""

import argparse
import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "design.md"
TABLE = re.compile(r"(<!-- files: ([\w/.-]+)([^>]*) -->\n).*?(<!-- end of files -->)", re.DOTALL)
#: Files of which a table says nothing: what a heading describes, and tests.
LEFT_OUT = re.compile(r"(lib|main|mod|__init__|__main__|tests|\w+_tests)\.\w+")


def described(path: Path) -> str:
    """What a file's first line says of it."""
    line = path.read_text(encoding="utf-8").split("\n", 1)[0]
    text = re.fullmatch(r'(?://! |""")(.+)\.(?:""")?', line)
    if not text:
        sys.exit(f"{path.relative_to(ROOT)}: the first line must say in one sentence what the file holds")
    return re.sub(r"\[(`[^`]+`)\]", r"\1", text[1]).replace("``", "`").replace("|", "\\|")


def table(folder: Path, more: list[str]) -> str:
    """A row for each file of the folder, the public ones first, and for what is listed besides."""
    files = [path for path in folder.iterdir() if path.suffix in (".rs", ".py") and not LEFT_OUT.fullmatch(path.name)]
    files += [folder / name for name in more]
    rows = []
    for path in sorted(files, key=lambda path: (path.name[0] == "_", path.with_suffix(""))):
        name = path.relative_to(folder).as_posix() + "/" * path.is_dir()
        beside = f", `{name.removesuffix('.rs')}/`" if path.suffix == ".rs" and path.with_suffix("").is_dir() else ""
        rows.append(f"| `{name}`{beside} | {described(path / 'mod.rs' if path.is_dir() else path)} |")
    return "\n".join(["| file | what it holds |", "|---|---|", *rows, ""])


def main() -> int:
    """Write the page, or compare it; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--check", action="store_true", help="writes nothing; the exit code is 1 if a table is old")
    arguments = parser.parse_args()
    page = PAGE.read_text(encoding="utf-8")
    written = TABLE.sub(lambda found: found[1] + table(ROOT / found[2], found[3].split()) + found[4], page)
    if arguments.check:
        if written != page:
            print("docs/design.md has old tables of files: make generated")
        return int(written != page)
    PAGE.write_text(written, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
