"""Copies the docstrings of the stub to the Rust sources, so that help() says what the stub says.

python scripts/docs/docstrings.py: docstrings are written once, in python/omnistep/_omnistep.pyi;
python/tests/test_examples.py compares them with what the built module says.
"""

import ast
import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
STUB = ROOT / "python" / "omnistep" / "_omnistep.pyi"
SOURCES = ROOT / "crates" / "omni-py" / "src"

Docs = dict[tuple[str, str], str]


def stub_docs() -> Docs:
    """Docstrings by class and name; a class's own has no name, a function's no class."""
    docs: Docs = {}
    for node in ast.parse(STUB.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.ClassDef | ast.FunctionDef) and (text := ast.get_docstring(node)):
            docs[(node.name, "") if isinstance(node, ast.ClassDef) else ("", node.name)] = text
        if isinstance(node, ast.ClassDef):
            for member in node.body:
                if isinstance(member, ast.FunctionDef) and (text := ast.get_docstring(member)):
                    docs[node.name, member.name] = text
    return docs


def above(lines: list[str], at: int) -> tuple[int, int, str]:
    """First and last line of the doc comment above a line, and the attributes in between."""
    start = at
    while start:
        line = lines[start - 1].strip()
        if line.endswith(")]") and not line.startswith("#["):
            while start > 1 and not lines[start - 1].strip().startswith("#["):
                start -= 1
        elif not line.startswith("#["):
            break
        start -= 1
    begin = start
    while begin and lines[begin - 1].lstrip().startswith("///"):
        begin -= 1
    return begin, start, "".join(lines[start:at])


def written(lines: list[str], docs: Docs) -> list[str]:
    """A source with the doc comments that the stub has."""
    inside, lines = "", list(lines)
    at = 0
    while at < len(lines):
        line = lines[at]
        begin, start, attributes = above(lines, at)
        key = None
        if found := re.match(r"pub\(crate\) struct (\w+)", line):
            inside = found[1] if "#[pyclass" in attributes else ""
            key = (inside, "")
        elif found := re.match(r"\s*impl (\w+) \{", line):
            inside = found[1] if "#[pymethods]" in attributes else ""
        elif line.startswith("wheel_arrays! {"):
            inside = "Sample"
        elif line.startswith("}"):
            inside = ""
        elif found := re.match(r"\s*(?:pub\(crate\) )?fn (\w+)", line):
            key = ("", found[1]) if "#[pyfunction]" in attributes else (inside or "nothing", found[1])
        elif inside and (found := re.match(r"    (\w+)(?:: Py<| = (?:signal|wheel) )", line)):
            key = (inside, found[1])
        if key in docs and (key[0] or key[1]):
            indent = re.match(r"\s*", line)[0]
            text = [f"{indent}/// {each}".rstrip() + "\n" for each in docs[key].splitlines()]
            lines[begin:start] = text
            at += len(text) - (start - begin)
        at += 1
    return lines


def main() -> None:
    """Write every source."""
    docs = stub_docs()
    for path in sorted(SOURCES.glob("*.rs")):
        lines = path.read_text(encoding="utf-8").splitlines(keepends=True)
        path.write_text("".join(written(lines, docs)), encoding="utf-8")


if __name__ == "__main__":
    main()
