#!/usr/bin/env python3
"""Finds files that use each other in a circle: of one crate, of the Python package, of the JavaScript modules.

    python scripts/checks/circles.py [FOLDER of another checkout]
    python scripts/checks/circles.py --self-test

One line a circle: its files, and one use in each direction. Exit code 1 if there is any.
"""

import argparse
import ast
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import networkx
import tree_sitter_javascript
from rust_uses import Crate, descendants, text
from tree_sitter import Language, Parser

ROOT = Path(__file__).resolve().parents[2]
JAVASCRIPT = Language(tree_sitter_javascript.language())
OUTSIDE = {"target", "out", "node_modules", ".venv"}

Uses = dict[tuple[Path, Path], tuple[int, str]]  # from a file to a file: the line and what is used


def rust(root: Path) -> Iterator[Uses]:
    """The uses of every crate's library and programs."""
    for manifest in files(root, "Cargo.toml"):
        source = manifest.parent / "src"
        for file in [source / "lib.rs", source / "main.rs", *sorted(source.glob("bin/*.rs"))]:
            if file.is_file():
                yield Crate(file).uses()


def python(package: Path) -> Uses:
    """The uses of a package's modules; what `__init__.py` only passes on is used where it is defined."""
    modules = {file.stem: ast.parse(file.read_bytes()) for file in sorted(package.glob("*.py"))}
    passed_on = dict(imports(package.name, modules.get("__init__", ast.parse("")), {}, modules))
    uses: Uses = {}
    for name, tree in modules.items():
        mentioned = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
        for used, (line, module) in imports(package.name, tree, passed_on, modules):
            if module != name and (name != "__init__" or used in mentioned):
                uses.setdefault((package / f"{name}.py", package / f"{module}.py"), (line, used))
    return uses


def imports(
    package: str, tree: ast.Module, passed_on: dict[str, tuple[int, str]], modules: dict[str, ast.Module]
) -> Iterator[tuple[str, tuple[int, str]]]:
    """The names that a module imports from its package, also within functions, each with its line and module."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            for alias in node.names:
                first, _, module = alias.name.partition(".")
                if first == package and module in modules:
                    yield alias.asname or alias.name, (node.lineno, module)
        elif isinstance(node, ast.ImportFrom):
            first, _, module = (node.module or "").partition(".")
            if node.level == 1:
                first, module = package, node.module or ""
            for alias in node.names if first == package else []:
                if module in modules:
                    yield alias.name, (node.lineno, module)
                elif not module and alias.name in modules:
                    yield alias.name, (node.lineno, alias.name)
                elif not module:
                    yield alias.name, (node.lineno, passed_on.get(alias.name, (0, "__init__"))[1])


def javascript(root: Path) -> Uses:
    """The imports of the JavaScript modules from each other."""
    uses: Uses = {}
    for file in [*files(root, "*.js"), *files(root, "*.mjs")]:
        tree = Parser(JAVASCRIPT).parse(file.read_bytes())
        for kind in ("import_statement", "export_statement"):
            for node in descendants(tree.root_node, kind):
                source = text(node.child_by_field_name("source")).strip("\"'")
                if source.startswith("."):
                    uses.setdefault((file, (file.parent / source).resolve()), (node.start_point[0] + 1, source))
    return uses


def files(root: Path, pattern: str) -> list[Path]:
    """The files of a checkout, without what was built or installed there."""
    found = root.resolve().rglob(pattern)
    return sorted(file for file in found if not OUTSIDE & set(file.relative_to(root.resolve()).parts))


def circles(root: Path) -> list[str]:
    """A line for each circle of a checkout."""
    root = root.resolve()
    lines = []
    for uses in [*rust(root), python(root / "python" / "omnistep"), javascript(root)]:
        graph = networkx.DiGraph(uses.keys())
        for component in networkx.strongly_connected_components(graph):
            if len(component) > 1:
                lines.append(circle(root, graph.subgraph(component), uses))
    return sorted(set(lines))


def circle(root: Path, graph: "networkx.DiGraph[Path]", uses: Uses) -> str:
    """The files of a circle, and the uses of a shortest one among them."""
    shortest = min(networkx.simple_cycles(graph, length_bound=girth(graph)), key=sorted)
    ways = []
    for user, used in zip(shortest, [*shortest[1:], shortest[0]], strict=True):
        line, what = uses[user, used]
        ways.append(f"{user.relative_to(root)}:{line} uses {what} of {used.name}")
    return f"{' '.join(sorted(str(file.relative_to(root)) for file in graph))}: {', '.join(ways)}"


def girth(graph: "networkx.DiGraph[Path]") -> int:
    """The length of a shortest circle."""
    return min(1 + networkx.shortest_path_length(graph, used, user) for user, used in graph.edges)


def self_test() -> None:
    """Trees with circles and without, each with what is to be found."""
    cases = {
        "two files": ({"a.rs": "use crate::b::B; pub struct A;", "b.rs": "pub struct B(crate::a::A);"}, ["a.rs b.rs"]),
        "by a re-export": (
            {"lib.rs": "mod a; mod b; pub use a::A; pub use b::*;", "a.rs": "use crate::B; pub struct A;",
             "b.rs": "use crate::A; pub struct B(A);"},
            ["a.rs b.rs"],
        ),
        "declared and re-exported only": (
            {"lib.rs": "mod a; pub use a::A; pub const N: u8 = 1;", "a.rs": "pub struct A([u8; crate::N]);"}, []
        ),
        "parent and child": (
            {"a.rs": "mod b; pub struct A; fn f() { b::g(); }", "a/b.rs": "use super::A; pub fn g() {}"},
            ["a.rs a/b.rs"],
        ),
        "tests": ({"a.rs": "pub struct A; #[cfg(test)] mod t { use crate::b::B; }", "b.rs": "use crate::a::A;"}, []),
        "a function in a text": (
            {"a.rs": '#[serde(default = "crate::b::one")] pub struct A;', "b.rs": "use crate::a; fn one() -> a::A {}"},
            ["a.rs b.rs"],
        ),
        "within a macro": (
            {"a.rs": "pub struct A; fn f() { print!(crate::b::g()); }", "b.rs": "use crate::a::A; pub fn g() {}"},
            ["a.rs b.rs"],
        ),
        "three files": (
            {"lib.rs": "mod a; mod b; mod c;", "a.rs": "use crate::b::B; pub struct A;",
             "b.rs": "use super::c::C; pub struct B;", "c.rs": "use crate::a::A; pub struct C;"},
            ["a.rs b.rs c.rs"],
        ),
        "downward": ({"a.rs": "use crate::b::B;", "b.rs": "pub struct B; impl B { fn a(&self) { self.a() } }"}, []),
        "Python": (
            {"__init__.py": "from omnistep.a import A\nfrom omnistep.b import B\n__all__ = ['A', 'B']",
             "a.py": "class A:\n    def f(self):\n        from omnistep import B", "b.py": "from omnistep.a import A"},
            ["a.py b.py"],
        ),
        "Python, downward": ({"__init__.py": "from omnistep.a import A", "a.py": "import json"}, []),
        "JavaScript": ({"a.js": "import { b } from './b.js';", "b.js": "export { a } from './a.js';"}, ["a.js b.js"]),
    }  # fmt: skip
    for name, (texts, expected) in cases.items():
        with tempfile.TemporaryDirectory() as folder:
            suffix = Path(next(iter(texts))).suffix
            source = Path(folder, "python/omnistep" if suffix == ".py" else "src")
            (Path(folder) / "Cargo.toml").touch()
            if suffix == ".rs":
                texts = {"lib.rs": "mod a; mod b;", **texts}
            for file, content in texts.items():
                (source / file).parent.mkdir(parents=True, exist_ok=True)
                (source / file).write_text(content)
            found = [
                line.partition(":")[0].replace(f"{source.relative_to(folder)}/", "") for line in circles(Path(folder))
            ]
            assert found == expected, f"{name}: {found} instead of {expected}"


def main() -> int:
    """Print a line for each circle; exit code 1 if there is any."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("root", type=Path, nargs="?", default=ROOT, help="a checkout, by default this one")
    parser.add_argument("--self-test", action="store_true", help="test the check itself")
    arguments = parser.parse_args()
    if arguments.self_test:
        self_test()
        return 0
    lines = circles(arguments.root)
    for line in lines:
        print(line, file=sys.stderr)
    return min(len(lines), 1)


if __name__ == "__main__":
    raise SystemExit(main())
