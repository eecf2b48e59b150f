#!/usr/bin/env python3
"""Checks that comments are no wider than 120 columns: rustfmt breaks none, and nothing formats TOML and shell scripts.

    python scripts/checks/comment_width.py
    python scripts/checks/comment_width.py --self-test

One line a comment that is wider; exit code 1 if there is any. Ruff checks Python. Code blocks and tables of doc
comments may be wider, and so may a word that is longer than a line, such as an address.
"""

import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import tree_sitter_rust
from rust_uses import descendants
from tree_sitter import Language, Parser

ROOT = Path(__file__).resolve().parents[2]
RUST = Language(tree_sitter_rust.language())
FILES = ("*.rs", "*.rs.in", "*.toml", "*.sh")
WIDTH = 120
#: A line of TOML or of a shell script that is a comment or ends with one: a # after a space, outside quotes.
HASH = re.compile(r"""(?:"[^"]*"|'[^']*'|[^"'#]|(?<=\S)#)*(?<!\S)#(.*)""")


def rust(text: str) -> Iterator[tuple[int, str]]:
    """The lines that are comments or end with one, each with the comment; without code blocks and tables."""
    lines = text.splitlines()
    tree = Parser(RUST).parse(text.encode())
    found = (node for kind in ("line_comment", "block_comment") for node in descendants(tree.root_node, kind))
    last, fenced = -1, False
    for node in sorted(found, key=lambda node: node.start_byte):
        for row in range(node.start_point[0], node.end_point[0] + (node.end_point[1] > 0)):
            comment = re.sub(r"^\s*(?:/[/*][/!*]?|\*)?", "", lines[row][node.start_point[1] :])
            fence = comment.lstrip().startswith("```")
            fenced = (fenced and row == last + 1) != fence
            last = row
            if not fenced and not fence and not comment.lstrip().startswith("|"):
                yield row + 1, comment


def hashed(text: str) -> Iterator[tuple[int, str]]:
    """The same of TOML or a shell script."""
    for number, line in enumerate(text.splitlines(), 1):
        if comment := HASH.match(line):
            yield number, comment[1]


def wide(name: str, text: str) -> list[int]:
    """The numbers of the lines with a comment that is too wide."""
    lines = text.splitlines()
    found = rust(text) if ".rs" in name else hashed(text)
    return [number for number, comment in found if len(lines[number - 1]) > WIDTH and len(comment.split()) > 1]


def self_test() -> None:
    """Prove that wide comments are found, and nothing else is mistaken for one."""
    words, short = "word " * 24, "word " * 20
    code = f'fn f() {{ g("{"x" * 120} // {words}"); }}'
    for name, text, expected in [
        ("a.rs", f"// {words}\n/// {words}\n//! {words}\n// {short}", [1, 2, 3]),
        ("a.rs", f"{code}\nfn g() {{ h(); }} // {words}\n/* short\n{words} */", [2, 4]),
        ("a.rs", f"/// ```\n/// {words}\n/// ```\n/// {words}\nfn f() {{}}", [4]),
        ("a.rs", f"/// | {words} |\n// https://{'x' * 120}", []),
        ("a.rs.in", f"// {words}", [1]),
        ("a.toml", f'# {words}\na = 1 # {words}\na = "# {words}"\nb = "#" # {words}', [1, 2, 4]),
        ("a.sh", f"#!/bin/sh\n# {words}\necho $# {words}\necho '{words} # {words}'\n", [2]),
    ]:
        assert wide(name, text) == expected, (name, text, wide(name, text))


def main() -> int:
    """Check the files of the repository; return the exit code."""
    if "--self-test" in sys.argv[1:]:
        self_test()
        return 0
    listed = subprocess.run(["git", "ls-files", "-z", *FILES], cwd=ROOT, check=True, capture_output=True, text=True)
    found = 0
    for name in filter(None, listed.stdout.split("\0")):
        for number in wide(name, (ROOT / name).read_text(encoding="utf-8")):
            found += 1
            print(f"{name}:{number}: a comment wider than {WIDTH} columns")
    return min(found, 1)


if __name__ == "__main__":
    raise SystemExit(main())
