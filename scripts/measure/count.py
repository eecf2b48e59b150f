#!/usr/bin/env python3
"""Counts lines of code, prose, examples and tests, names at omni-core's root, circles, and long functions.

    python scripts/measure/count.py [REVISION ...]

One Markdown table, a column for each revision of git; without one, of the files as they are. With two revisions, the
last column is the difference. Prose is comments and docs; examples are the code blocks in docs; tests are counted with
all their lines. Lines without anything are not counted. Long functions have more than 60 lines of code.
"""

import argparse
import ast
import io
import subprocess
import sys
import tarfile
import tempfile
import tokenize
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import tree_sitter_javascript
import tree_sitter_rust
from tree_sitter import Language, Node, Parser

ROOT = Path(__file__).resolve().parents[2]
LANGUAGES = {
    ".rs": Language(tree_sitter_rust.language()),
    ".js": Language(tree_sitter_javascript.language()),
    ".mjs": Language(tree_sitter_javascript.language()),
}
COMMENTS = {"line_comment", "block_comment", "comment"}
OUTSIDE = {"target", "out", "node_modules", ".venv", "assets"}
KINDS = ("code", "prose", "examples", "tests")
LONG = 60


def part(path: Path) -> str:
    """Return which part of the repository a file belongs to: a crate, or a folder at the top."""
    return path.parts[1] if path.parts[0] == "crates" else path.parts[0]


def is_test(path: Path) -> bool:
    """Return whether a file holds tests alone."""
    return "tests" in path.parts or path.stem == "tests" or path.stem.endswith("_tests")


def walk(node: Node) -> Iterator[Node]:
    """Yield a node and all below it."""
    yield node
    for child in node.children:
        yield from walk(child)


def rows(node: Node) -> range:
    """Return the numbers of a node's lines."""
    return range(node.start_point[0], node.end_point[0] + (node.end_point[1] > 0))


def counted(tree: Node, text: str, *, tests: bool) -> Counter[str]:
    """Count the lines of a file in Rust or JavaScript, and its long functions."""
    lines = text.splitlines()
    kinds = ["code" if line.strip() else "" for line in lines]
    in_example = False
    functions = []
    for node in walk(tree):
        if node.type in COMMENTS:
            for row in rows(node):
                own = node.start_point[0] < row or not lines[row][: node.start_point[1]].strip()
                fence = "```" in lines[row] and lines[row].lstrip().startswith(("///", "//!"))
                if own and kinds[row] not in ("", "tests"):
                    kinds[row] = "examples" if in_example or fence else "prose"
                in_example ^= fence
        elif node.type in ("function_item", "function_declaration", "method_definition"):
            functions.append(node)
        elif node.type == "attribute_item" and (node.text or b"").startswith(b"#[cfg(test)]"):
            after = node.next_named_sibling
            while after and after.type in {"attribute_item", *COMMENTS}:
                after = after.next_named_sibling
            for row in rows(after) if after else ():
                kinds[row] = kinds[row] and "tests"
    if tests:
        kinds = [kind and "tests" for kind in kinds]
    found = Counter(filter(None, kinds))
    found["long"] = sum(sum(kinds[row] == "code" for row in rows(node)) > LONG for node in functions)
    return found


def python(text: str, *, tests: bool) -> Counter[str]:
    """Count the lines of a file in Python, and its long functions."""
    lines = text.splitlines()
    kinds = ["code" if line.strip() else "" for line in lines]
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        row = token.start[0] - 1
        if token.type == tokenize.COMMENT and lines[row].lstrip().startswith("#"):
            kinds[row] = "prose"
    tree = ast.parse(text)
    functions = []
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            functions.append(node)
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef | ast.Module):
            if ast.get_docstring(node) is None:
                continue
            in_example = False
            for row in range(node.body[0].lineno - 1, node.body[0].end_lineno or 0):
                in_example = bool(lines[row].strip()) and (in_example or ">>>" in lines[row])
                kinds[row] = kinds[row] and ("examples" if in_example else "prose")
    if tests:
        kinds = [kind and "tests" for kind in kinds]
    found = Counter(filter(None, kinds))
    spans = [range(node.lineno - 1, node.end_lineno or node.lineno) for node in functions]
    found["long"] = sum(sum(kinds[row] == "code" for row in span) > LONG for span in spans)
    return found


def root_names(source: Path) -> int:
    """Count the public names at a crate's root that its documentation lists, modules among them."""
    tree = Parser(LANGUAGES[".rs"]).parse(source.read_bytes()).root_node
    names, hidden = 0, False
    for node in tree.named_children:
        if node.type == "attribute_item":
            hidden |= b"hidden" in (node.text or b"")
            continue
        public = any(child.type == "visibility_modifier" and child.text == b"pub" for child in node.children)
        if public and not hidden:
            lists = [each for each in walk(node) if each.type == "use_list"]
            leaves = [child for each in lists for child in each.named_children if child.type != "scoped_use_list"]
            names += len(leaves) or 1
        hidden = hidden and node.type in COMMENTS
    return names


def figures(root: Path) -> dict[str, int]:
    """Count a checkout, by what is counted."""
    found: Counter[str] = Counter()
    parts: dict[str, Counter[str]] = {}
    for path in sorted(root.rglob("*")):
        place = path.relative_to(root)
        if OUTSIDE & set(place.parts) or path.suffix not in (*LANGUAGES, ".py", ".pyi") or not path.is_file():
            continue
        text, tests = path.read_text(encoding="utf-8"), is_test(place)
        if language := LANGUAGES.get(path.suffix):
            here = counted(Parser(language).parse(text.encode()).root_node, text, tests=tests)
        else:
            here = python(text, tests=tests)
        parts.setdefault(part(place), Counter()).update(here)
    for name, counts in sorted(parts.items()):
        for kind in KINDS:
            found[f"{name}: {kind}"] = counts[kind]
            found[f"all: {kind}"] += counts[kind]
        found["functions over 60 lines"] += counts["long"]
    found["names at the root of omni-core"] = root_names(root / "crates" / "omni-core" / "src" / "lib.rs")
    check = [sys.executable, str(ROOT / "scripts" / "checks" / "circles.py"), str(root)]
    found["circles between files"] = len(subprocess.run(check, capture_output=True, text=True).stderr.splitlines())
    return found


def of_revision(revision: str) -> dict[str, int]:
    """Count a revision."""
    command = ["git", "archive", "--format=tar", revision]
    archive = subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.PIPE).stdout
    with tempfile.TemporaryDirectory() as folder:
        with tarfile.open(fileobj=io.BytesIO(archive)) as files:
            files.extractall(folder, filter="data")
        return figures(Path(folder))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("revisions", nargs="*", metavar="REVISION", help="of git, such as main or a commit")
    revisions = parser.parse_args().revisions
    columns = [of_revision(revision) for revision in revisions] or [figures(ROOT)]
    heads = ["figure", *(revisions or ["here"])]
    names = sorted({name for column in columns for name in column}, key=lambda name: (":" not in name, name))
    table = [[name, *(column.get(name, 0) for column in columns)] for name in names]
    if len(columns) == 2:
        heads.append("difference")
        table = [[*row, f"{int(row[2]) - int(row[1]):+d}"] for row in table]
    print("|", " | ".join(heads), "|")
    print("|---" + "|---:" * (len(heads) - 1) + "|")
    for row in table:
        print("|", " | ".join(map(str, row)), "|")


if __name__ == "__main__":
    main()
