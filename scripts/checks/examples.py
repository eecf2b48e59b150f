"""Checks that the public items of omni-core that teach have an example: one that asserts a number.

python scripts/checks/examples.py [--self-test]: one line an item without one, exit code 1 if there is any.

Items are structs, enums, traits, functions and methods that can be reached from the crate's root, as rustdoc's JSON
lists them. Not modules, constants, fields, variants and what a trait's implementation repeats. Not methods that hold no
law either; `holds_no_law` says which. Those need documentation only, which the compiler's `missing_docs` sees to.
"""

import json
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
CRATE = "omnistep-core"
LIBRARY = "omni_core"
# Attributes of a code block that rustdoc compiles and runs; `text`, `no_run`, `ignore` and `compile_fail` are not here.
RUNS = re.compile(r"rust|should_panic|edition\d{4}")
# A number within an assertion, though not the one in `f64`.
ASSERTS = re.compile(r"\bassert(?:_eq|_ne)?!\((?:(?!\);).)*?\b\d", re.DOTALL)
# A body that only hands out a field: `{ self.field }`, `{ &self.a.b }`, or the same method of a field.
GETTER = re.compile(r"\{\s*(?:&(?:mut )?)?self(?:\.\w+)*\.(?:(?P<delegated>\w+)\(\)|\w+)\s*\}\Z")
# Methods that need no example by their names, and constructors that need none if their type's example calls them.
NAMES = {"name", "number", "state", "restore"}
CONSTRUCTORS = {"new", "zero", "default"}
# Kinds of items that need no example.
EXEMPT = {"constant", "static", "type_alias", "assoc_const", "assoc_type", "struct_field", "variant"}

Item = dict[str, Any]
Index = dict[str, Item]


def rustdoc() -> Item:
    """What rustdoc knows of the crate. Its JSON is not yet stable, hence the variable."""
    options = ["--locked", "-p", CRATE, "--lib", "--quiet", "--", "-Zunstable-options", "--output-format", "json"]
    subprocess.run(["cargo", "rustdoc", *options], cwd=ROOT, check=True, env={**os.environ, "RUSTC_BOOTSTRAP": "1"})
    metadata = ["cargo", "metadata", "--locked", "--no-deps", "--format-version", "1"]
    output = subprocess.run(metadata, cwd=ROOT, check=True, capture_output=True, text=True).stdout
    path = Path(json.loads(output)["target_directory"]) / "doc" / f"{LIBRARY}.json"
    documented: Item = json.loads(path.read_text(encoding="utf-8"))
    return documented


def blocks(docs: str) -> Iterator[str]:
    """The code blocks of `docs` that run as tests, without the lines that a reader does not see."""
    block: list[str] | None = None
    counts = False
    for line in docs.splitlines():
        if fence := re.match(r" {0,3}```+(.*)", line):
            if block is None:
                words = re.split(r"[,\s]+", fence[1].strip())
                block, counts = [], all(RUNS.fullmatch(word) for word in words if word)
            else:
                if counts:
                    yield "\n".join(block)
                block = None
        elif block is not None and not re.match(r"\s*(?:#(?: |$)|//)", line):
            block.append(line)


def has_example(docs: str | None) -> bool:
    """Does some code block assert a number?"""
    return any(ASSERTS.search(block) for block in blocks(docs or ""))


def source(item: Item) -> str:
    """The text of a function, from its `fn` line to its last brace."""
    span = item["span"]
    lines = (ROOT / span["filename"]).read_text(encoding="utf-8").splitlines()
    return "\n".join(lines[span["begin"][0] - 1 : span["end"][0]])


def is_getter(text: str, name: str) -> bool:
    """Does the function of this source only hand out a field, or what the same method of a field hands out?"""
    body = GETTER.search(text)
    return body is not None and body["delegated"] in (None, name)


def holds_no_law(method: Item, owner: Item) -> bool:
    """Does this method need no example: a getter, or a constructor, setter or trait's method that its owner's shows?"""
    name, inputs = method["name"], method["inner"]["function"]["sig"]["inputs"]
    takes_self = bool(inputs) and inputs[0][0] == "self"
    if name in NAMES:
        return takes_self
    example = "\n".join(blocks(owner["docs"] or ""))
    if name in CONSTRUCTORS and not takes_self:
        called = re.search(rf"\b{owner['name']}(?:::<[^;]+>)?::{name}\(", example) is not None
        return called or (not inputs and has_example(owner["docs"]))
    if name.startswith("with_") and takes_self:
        return f".{name}(" in example
    if "trait" in owner["inner"] and f"fn {name}(" in example:
        return True
    return takes_self and len(inputs) == 1 and is_getter(source(method), name)


def items(index: Index, identity: int, path: str = "") -> Iterator[tuple[str, Item]]:
    """Every item that needs an example, with its path: those in the item `identity`, and that itself."""
    item = index.get(str(identity))
    if item is None:  # of another crate
        return
    ((kind, inner),) = item["inner"].items()
    name = path + (item["name"] or "")
    if kind == "use":
        if inner["is_glob"]:
            raise ValueError(f"`pub use {inner['source']}::*`: the items behind it are not looked for")
        yield from items(index, inner["id"], path)
    elif kind == "module":
        below = "" if inner["is_crate"] else f"{name}::"
        for child in inner["items"]:
            yield from items(index, child, below)
    elif kind in ("struct", "enum", "union"):
        yield name, item
        for child in inner["impls"]:
            implementation = index[str(child)]["inner"]["impl"]
            if implementation["trait"] is None:
                yield from methods(index, item, implementation["items"], name)
    elif kind == "trait":
        yield name, item
        yield from methods(index, item, inner["items"], name)
    elif kind == "function":
        yield name, item
    elif kind not in EXEMPT:
        raise ValueError(f"{name}: what is a {kind}?")


def methods(index: Index, owner: Item, identities: list[int], path: str) -> Iterator[tuple[str, Item]]:
    """Those of `identities`, members of the type or trait `owner` at `path`, that need an example."""
    for identity in identities:
        member = index[str(identity)]
        if "function" not in member["inner"] or not holds_no_law(member, owner):
            yield from items(index, identity, f"{path}::")


def findings(documented: Item) -> tuple[list[str], int]:
    """The items without an example, one line each, and how many items there are."""
    every: dict[int, tuple[str, Item]] = {}
    for name, item in items(documented["index"], documented["root"]):
        # What can be reached by two paths counts once, by the shorter one.
        every[item["id"]] = min(every.get(item["id"], (name, item)), (name, item), key=lambda known: len(known[0]))
    found = []
    for name, item in every.values():
        if not has_example(item["docs"]):
            found.append((item["span"]["filename"], item["span"]["begin"][0], name))
    lines = [f"{file}:{line}: {name} has no example that asserts a number" for file, line, name in sorted(found)]
    return lines, len(every)


def self_test(documented: Item) -> None:
    """Prove that a missing example is noticed, in made-up documentation and for every kind of item in the crate's."""
    assert has_example("Text.\n\n```\nassert_eq!(f(), 2.0);\n```\n")
    assert has_example("```rust,should_panic\nassert!(\n    (f() - 2.0).abs() < 1e-9\n);\n```")
    for docs in [
        None,
        "Text that says `assert_eq!(f(), 2.0);`.",
        "```\nlet two = f();\n```",
        "```\n# assert_eq!(f(), 2.0);\n// assert_eq!(f(), 2.0);\n```",
        "```\nassert!(f::<f64>().is_ok());\nlet two = 2;\n```",
        *(f"```{word}\nassert_eq!(f(), 2.0);\n```" for word in ("compile_fail,E0308", "no_run", "ignore", "text")),
    ]:
        assert not has_example(docs), docs
    for body, getter in {
        "fn yaw(&self) -> R {\n    self.pose.yaw\n}": True,
        "fn config(&self) -> &Config {\n    &self.config\n}": True,
        "fn yaw(&self) -> R { self.pose.yaw() }": True,  # the same getter of a field
        "fn yaw(&self) -> R { self.pose.wrapped() }": False,
        "fn yaw(&self) -> R { -self.yaw }": False,
        "fn yaw(&self) -> R { if self.known { self.yaw } else { self.last } }": False,
        "fn stop(&mut self) { self.stopped = true; }": False,
    }.items():
        assert is_getter(body, body[3:].split("(")[0]) == getter, body
    shown = "```\nlet wheel = Wheel::<f64>::new(0.1)?;\nassert_eq!(wheel.turns, 0);\n```"
    type_example: Item = {"name": "Wheel", "inner": {"struct": {}}, "docs": shown}
    new: Item = {"name": "new", "inner": {"function": {"sig": {"inputs": [["radius_m", {}]]}}}}
    assert holds_no_law(new, type_example)
    assert not holds_no_law({**new, "name": "zero"}, type_example)  # the example does not call it
    assert not holds_no_law(new, {**type_example, "docs": None})
    for item in documented["index"].values():
        item["docs"] = "Nothing."
    found, count = findings(documented)
    names = {line.split(": ")[1].split(" ")[0] for line in found}
    assert len(found) == count == len(names), (len(found), count, len(names))
    laws = {"Kinematics", "Kinematics::inverse", "WheelLayout::mecanum4", "drive::Fault", "Real"}
    laws |= {"Real::limited", "metrics::shape_error", "loops::WheelController::with_rest", "loops::Pid::step"}
    assert laws <= names, laws - names
    lawless = {
        "Kinematics::inverse_matrix",
        "drive::Fault::number",
        "traction::TractionPolicy::restore",
        "Drive::kinematics",
    }
    assert not lawless & names, lawless & names


def main() -> int:
    """Check the crate; return the exit code."""
    documented = rustdoc()
    if "--self-test" in sys.argv[1:]:
        self_test(documented)
        return 0
    found, count = findings(documented)
    print("\n".join(found) if found else f"examples: each of the {count} types and laws of {CRATE} asserts a number")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
