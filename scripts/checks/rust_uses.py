"""Which file of a Rust crate uses which other: each path in the code, resolved to the file that defines its item.

Tree-sitter reads the syntax. Macros are not expanded: tokens of a macro call that look like a path are taken as one.
A method call names no file, and code for tests alone (`cfg(test)`) is left out. Neither a declaration `mod child;`
nor a re-export `pub use child::Item;` is a use: a path through it leads to the file of the item.
"""

import re
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import tree_sitter_rust
from tree_sitter import Language, Node, Parser

RUST = Language(tree_sitter_rust.language())
ITEMS = {
    "const_item",
    "enum_item",
    "function_item",
    "function_signature_item",
    "macro_definition",
    "static_item",
    "struct_item",
    "trait_item",
    "type_item",
    "union_item",
}
NAMES = {"identifier", "type_identifier", "crate", "self", "super", "metavariable"}
TEST_ONLY = re.compile(rb"#\[cfg\((all\()?test\b")
PATH_IN_TEXT = re.compile(rb'"(\w+(?:::\w+)*)"')  # as in #[serde(default = "crate::defaults::rate")]


@dataclass(eq=False)
class Module:
    """A module: its file, what its names lead to, and the paths in its code."""

    file: Path
    parent: "Module | None"
    items: set[str] = field(default_factory=set)
    modules: dict[str, list["Module"]] = field(default_factory=lambda: defaultdict(list))
    imports: dict[str, list[tuple[str, ...]]] = field(default_factory=lambda: defaultdict(list))
    globs: list[tuple[str, ...]] = field(default_factory=list)
    mentions: dict[tuple[str, ...], int] = field(default_factory=dict)  # to the line of the first


@dataclass(frozen=True)
class Item:
    """An item, of which only the file matters."""

    file: Path


ELSEWHERE = Item(Path())  # of another crate


class Crate:
    """The modules below one root file."""

    def __init__(self, root: Path) -> None:
        self.files: dict[Path, Node] = {}
        self.macros: dict[str, Item] = {}
        self.root = self._read(root, root.parent, None)

    def uses(self) -> dict[tuple[Path, Path], tuple[int, str]]:
        """Each pair of files of which the first uses an item of the second: the line and the path of one use."""
        found: dict[tuple[Path, Path], tuple[int, str]] = {}
        for module in self._all(self.root):
            for path, line in module.mentions.items():
                for item in self._resolve(module, path, set()):
                    if isinstance(item, Item) and item not in (ELSEWHERE, Item(module.file)):
                        found.setdefault((module.file, item.file), (line, "::".join(path)))
        return found

    def _all(self, module: Module) -> Iterator[Module]:
        yield module
        for children in module.modules.values():
            for child in children:
                yield from self._all(child)

    # Reading.

    def _read(self, file: Path, folder: Path, parent: Module | None) -> Module:
        tree = Parser(RUST).parse(file.read_bytes())
        self.files[file] = tree.root_node
        module = Module(file, parent)
        self._children(tree.root_node, module, folder)
        return module

    def _children(self, node: Node, module: Module, folder: Path) -> None:
        attributes: list[Node] = []
        for child in node.named_children:
            if child.type == "attribute_item":
                attributes.append(child)
            elif child.type not in ("line_comment", "block_comment"):
                if not any(TEST_ONLY.match(attribute.text or b"") for attribute in attributes):
                    for attribute in attributes:
                        self._attribute(attribute, module)
                    self._visit(child, attributes, module, folder)
                attributes = []

    def _visit(self, node: Node, attributes: list[Node], module: Module, folder: Path) -> None:
        kind = node.type
        name = text(node.child_by_field_name("name"))
        if kind == "mod_item":
            self._module(node, name, attributes, module, folder)
            return
        if kind == "use_declaration":
            public = any(child.type == "visibility_modifier" for child in node.children)
            self._use(node.child_by_field_name("argument"), (), public, module)
            return
        if kind in ITEMS:
            module.items.add(name)
        if kind == "macro_definition":
            self.macros[name] = Item(module.file)
        if kind in ("scoped_identifier", "scoped_type_identifier"):
            if path := path_of(node):
                mention(module, path, node)
        elif kind == "type_identifier" or (kind == "identifier" and is_item(node)):
            mention(module, (text(node),), node)
        if kind in ("token_tree", "macro_definition"):
            self._tokens(node, module)
        else:
            self._children(node, module, folder)

    def _module(self, node: Node, name: str, attributes: list[Node], module: Module, folder: Path) -> None:
        if body := node.child_by_field_name("body"):
            child = Module(module.file, module)
            self._children(body, child, folder / name)
        else:
            named = [re.search(rb'#\[path = "(.*)"\]', attribute.text or b"") for attribute in attributes]
            places = [module.file.parent / match[1].decode() for match in named if match]
            places = places or [folder / f"{name}.rs", folder / name / "mod.rs"]
            place = next((place.resolve() for place in places if place.is_file()), None)
            if place is None:
                return
            child = self._read(place, place.parent if place.name == "mod.rs" else place.with_suffix(""), module)
        module.modules[name].append(child)

    def _use(self, node: Node | None, before: tuple[str, ...], public: bool, module: Module) -> None:
        if node is None:
            return
        if node.type == "use_wildcard":
            module.globs.append(before + path_of(node.named_child(0)))
        elif node.type in ("use_list", "scoped_use_list"):
            before += path_of(node.child_by_field_name("path"))
            for child in (node.child_by_field_name("list") or node).named_children:
                self._use(child, before, public, module)
        elif node.type == "use_as_clause":
            self._import(before + path_of(node.child_by_field_name("path")), node, public, module)
        elif node.type in NAMES | {"scoped_identifier"}:
            self._import(before + path_of(node), node, public, module)

    def _import(self, path: tuple[str, ...], node: Node, public: bool, module: Module) -> None:
        path = path[:-1] if path[-1] == "self" and len(path) > 1 else path
        alias = text(node.child_by_field_name("alias")) or path[-1]
        module.imports[alias].append(path)
        if not public:
            mention(module, path, node)

    def _attribute(self, node: Node, module: Module) -> None:
        for match in PATH_IN_TEXT.finditer(node.text or b""):
            mention(module, tuple(match[1].decode().split("::")), node)
        for tree in descendants(node, "token_tree"):
            self._tokens(tree, module)

    def _tokens(self, node: Node, module: Module) -> None:
        """Paths among the tokens of a macro: names with `::` between them."""
        path: list[str] = []
        children = node.children
        for at, child in enumerate(children):
            after = children[at + 1] if at + 1 < len(children) else None
            if child.type in NAMES:
                path.append(text(child).lstrip("$"))
                if after is None or after.type != "::":
                    called = after is not None and (text(after)[:1] in ("(", "!"))
                    if len(path) > 1 or path[0][0].isupper() or called:
                        mention(module, tuple(path), child)
                    path = []
            elif child.type != "::":
                path = []
                self._tokens(child, module)

    # Resolving.

    def _resolve(self, module: Module, path: tuple[str, ...], seen: set[object]) -> set[Module | Item]:
        """What a path leads to, of all kinds of items with that name; empty for a name of another crate."""
        head, *rest = path
        at: set[Module | Item]
        if head == "crate":
            at = {self.root}
        elif head == "self":
            at = {module}
        elif head == "super":
            at = {module.parent or module}
        else:
            at = self._look_up(module, head, seen)
            if not at and not rest and head in self.macros:
                at = {self.macros[head]}
        for name in rest:
            modules = [place for place in at if isinstance(place, Module)]
            if not modules:
                break  # what follows a type is its function or variant
            at = set()
            for place in modules:
                if name == "super":
                    at.add(place.parent or place)
                else:
                    # What no text defines is made by a macro of that file.
                    at |= self._look_up(place, name, seen) or {Item(place.file)}
        return at

    def _look_up(self, module: Module, name: str, seen: set[object]) -> set[Module | Item]:
        if (module, name) in seen:
            return set()
        seen = seen | {(module, name)}
        found: set[Module | Item] = set(module.modules[name]) if name in module.modules else set()
        if name in module.items:
            found.add(Item(module.file))
        for path in module.imports.get(name, []):
            found |= self._resolve(module, path, seen) or {ELSEWHERE}
        if not found:
            for path in module.globs:
                for place in self._resolve(module, path, seen):
                    if isinstance(place, Module):
                        found |= self._look_up(place, name, seen)
        return found


def text(node: Node | None) -> str:
    """The text of a node, nothing for none."""
    return (node.text or b"").decode() if node else ""


def path_of(node: Node | None) -> tuple[str, ...]:
    """The names of a path, without those after one that is no plain name, such as `<T as Trait>`."""
    if node is None:
        return ()
    if node.type in NAMES:
        return (text(node),)
    if node.type in ("scoped_identifier", "scoped_type_identifier"):
        before = node.child_by_field_name("path")
        path = path_of(before)
        return (*path, text(node.child_by_field_name("name"))) if path or before is None else ()
    return ()


def mention(module: Module, path: tuple[str, ...], node: Node) -> None:
    """Note a path of a module's code, once."""
    module.mentions.setdefault(path, node.start_point[0] + 1)


def is_item(node: Node) -> bool:
    """Whether a lone name may be an item: a function that is called, a macro, or a constant; no variable."""
    parent = node.parent
    if parent is None or text(node)[0].isupper():
        return True
    return node == parent.child_by_field_name("function") or node == parent.child_by_field_name("macro")


def descendants(node: Node, kind: str) -> Iterator[Node]:
    """The topmost nodes of a kind."""
    for child in node.named_children:
        if child.type == kind:
            yield child
        else:
            yield from descendants(child, kind)
