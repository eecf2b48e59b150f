#!/usr/bin/env python3
"""Checks prose for patterns of English that a list of words can find; CONTRIBUTING.md, How we write, lists them all.

    python scripts/checks/english.py
    python scripts/checks/english.py --self-test

One line per finding, with the better words; exit code 1 if there is any. Prose is Markdown outside of code, doc
comments and comments, docstrings, and the help texts of argparse.
"""

import ast
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from comment_width import hashed, rust

ROOT = Path(__file__).resolve().parents[2]
CHECKED = (
    "*.md",
    ":(glob)crates/*/src/**/*.rs",
    ":(glob)python/omnistep/**/*.py",
    "python/omnistep/_omnistep.pyi",
    ":(glob)scripts/**/*.py",
    ":(glob)scripts/**/*.sh",
    ":(glob)firmware/c/src/*.rs",
    ":(glob)firmware/c/src/*.in",
    ":(glob)firmware/c/include/*",
    ":(glob)firmware/src/**/*.rs",
    ":(glob)web/**/*.js",
    ":(glob)web/**/*.mjs",
    ":(glob)wasm/**/*.rs",
    ":(glob)wasm/**/*.py",
    ":(glob)wasm/**/*.mjs",
    "Makefile",
)
#: They quote the patterns.
EXEMPT = ("CONTRIBUTING.md", "docs/glossary.md", "scripts/checks/english.py")
START = r"(?:^|(?<=[.!?:;] ))"
UNITS = "metres|millimetres|radians|degrees|counts|steps|times|messages|frames|pictures|samples"
#: One row a period is one row per period.
COUNTED = "(?:one|two|three|some|\\d[\\d.,]*) (?:counts?|rows?|lines?|panels?|points?)|counts|rows"
PER = "turn|(?:control )?period|policy|pair|run|wheel|row"
#: Arguments of argparse with a help text.
HELP = ("help", "description")
#: Each pattern, and what to write instead.
PATTERNS = {
    r"\bAfter this page\b": "This guide shows how to ...; This page defines ...",
    r"\bin every bit\b": "bit-identical",
    r"\bphysics (?:fail|are|have|do|gain|end)\b": "physics is singular",
    rf"{START}So (?!far\b)": "one sentence with because, which or so that; Therefore",
    rf"\b(?:{UNITS}|once|twice|\d[\d.,]*) a second\b": "per second",
    rf"\b(?:{COUNTED}) a (?:{PER})\b": "per",
    r"\bcrosswise\b": "transverse",
    rf"{START}Where the [^.,;:]*,": "If or When",
    r"\brefused\b": "rejected; is an error",
    r"\bremembers?\b": "the state of",
}


def markdown(text: str) -> Iterator[tuple[int, str]]:
    """The lines of a page outside of code blocks; a list item or a row of a table begins a paragraph."""
    fenced = False
    for number, line in enumerate(text.splitlines(), 1):
        fence = line.lstrip().startswith(("```", "~~~"))
        fenced = fenced != fence
        yield number, "" if fenced or fence else line


def python(text: str) -> Iterator[tuple[int, str]]:
    """The lines of docstrings and help texts, then the comments."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            body = node.body[0] if node.body else None
            if isinstance(body, ast.Expr) and isinstance(body.value, ast.Constant) and ast.get_docstring(node):
                for number, line in enumerate(str(body.value.value).splitlines(), body.lineno):
                    yield number, "" if line.lstrip().startswith((">>>", "...")) else line
        elif isinstance(node, ast.keyword) and node.arg in HELP and isinstance(node.value, ast.Constant):
            yield node.value.lineno, str(node.value.value)
    yield from ((number, comment.lstrip(":")) for number, comment in hashed(text))


#: What reads the prose of a file; of others, comments after a hash.
READERS = {".md": markdown, ".py": python, ".pyi": python} | dict.fromkeys(
    (".rs", ".in", ".h", ".hpp", ".js", ".mjs"), rust
)


def paragraphs(name: str, text: str) -> Iterator[list[tuple[int, str]]]:
    """Prose in paragraphs, so that sentences are found over the ends of lines."""
    lines = READERS.get(Path(name).suffix, hashed)(text)
    paragraph: list[tuple[int, str]] = []
    for number, line in lines:
        line = re.sub(r"`[^`]*`|\"[^\"]*\"", "CODE", line).strip()
        begins = re.match(r"[-*|#>]|\d+\. |\w+: ", line)
        if paragraph and (not line or begins or number != paragraph[-1][0] + 1):
            yield paragraph
            paragraph = []
        if line := re.sub(r"^(?:[-*|#>/!]+|\d+\.|\w+:(?= )) *", "", line):
            paragraph.append((number, line))
    if paragraph:
        yield paragraph


def findings(name: str, text: str) -> list[tuple[int, str, str]]:
    """The line of each pattern in a file, its words, and better ones."""
    found = []
    for paragraph in paragraphs(name, text):
        starts, joined = [], ""
        for number, line in paragraph:
            starts.append((len(joined), number))
            joined += line + " "
        for pattern, better in PATTERNS.items():
            for match in re.finditer(pattern, joined):
                number = max(start for start in starts if start[0] <= match.start())[1]
                found.append((number, match[0].strip(), better))
    return sorted(found)


def self_test() -> None:
    """Prove that each pattern is found in each kind of prose, and nothing in code."""
    for name, text, expected in [
        ("a.md", "After this page you can drive.\n\n```sh\nrefused\n```\nA `refused` log.\n", [1]),
        ("a.md", "It turns. So it\nstops. So far so good, so\nit stops.\n- So it is.\n", [1, 4]),
        ("a.md", "Where the wheel slips, it stops.\n\nSee where the wheel, or\nthe hinge is.\n", [1]),
        ("a.rs", "/// Equal in\n/// every bit.\n/// ```\n/// refused(); // So it is.\n/// ```\nfn refused() {}", [1]),
        ("a.rs", 'fn f() { g("refused"); } // the physics fail', [1]),
        ("a.py", '"""Ten counts a second, after a second."""\nx = "refused"  # two crosswise wheels\n', [1, 2]),
        ("a.py", 'f(help="a log is refused")\n', [1]),
        ("a.md", "It has 64 counts a turn, and one row a control\nperiod. A row a person knows.\n", [1, 1]),
        ("a.sh", "# 5.0 a second\nrefused=1\n", [1]),
        ("a.hpp", "/// A filter that remembers.\nint remembers; // refused\n", [1, 2]),
        ("Makefile", "all: ## in every bit\n\tremember\n", [1]),
    ]:
        assert [line for line, _, _ in findings(name, text)] == expected, (name, text, findings(name, text))


def main() -> int:
    """Check the files of the repository; return the exit code."""
    if "--self-test" in sys.argv[1:]:
        self_test()
        return 0
    failed = False
    listed = subprocess.run(["git", "ls-files", "-z", *CHECKED], cwd=ROOT, check=True, capture_output=True, text=True)
    for name in filter(None, listed.stdout.split("\0")):
        if name in EXEMPT:
            continue
        for line, words, better in findings(name, (ROOT / name).read_text(encoding="utf-8")):
            failed = True
            print(f'{name}:{line}: "{words}", better: {better}')
    return int(failed)


if __name__ == "__main__":
    raise SystemExit(main())
