"""What the site's generator needs for our markup: formulas, and docstrings with Sphinx roles."""

import re
from collections.abc import Iterator
from typing import Any

import griffe
from latex2mathml.converter import convert
from pymdownx.superfences import SuperFencesException

# ":func:`run`" and ":meth:`Trace.wheels`".
ROLE = re.compile(r":(func|meth|class|mod):`~?([\w.]+)`")
# The heading of a Google-style example, and an example without a heading.
EXAMPLE = re.compile(r"^Example:$", re.MULTILINE)
# What is returned, in words: a colon in its first line does not end a type.
RETURNS = re.compile(r"(^Returns:\n)(.*)", re.MULTILINE)
BARE = re.compile(r"(?:^|(?<=\n\n))((?:>>> .*\n?)(?:.+\n?)*)")


def math(source: str, language: str, css_class: str, options: Any, md: Any, **_: Any) -> str:
    """A ```math block as MathML, which browsers draw without a script."""
    drawn = convert(source, display="block")
    if "\\" in drawn:
        raise SuperFencesException(f"a command of LaTeX that is not known in {source}")
    return f'<div class="{css_class}">{drawn}</div>'


def markdown(text: str, place: griffe.Object) -> str:
    """The docstring of the thing at `place` as Markdown: roles become links, every example gets a heading."""

    def link(match: re.Match[str]) -> str:
        kind, name = match[1], match[2].removeprefix("omnistep.")
        module = place.module
        if kind == "meth" and "." not in name:
            owner = f"omnistep.{(place if place.is_class else place.parent).name}"
        elif name in module.members and not module.members[name].is_alias and not module.name.startswith("_"):
            owner = module.path
        else:
            owner = "omnistep"
        return f"[`{name}`][{owner}.{name}]"

    text = EXAMPLE.sub("Examples:", ROLE.sub(link, text))
    text = RETURNS.sub(lambda match: match[1] + match[2].replace(": ", "&#58; "), text)
    if "Examples:" in text:
        return text
    return BARE.sub(lambda match: "Examples:\n" + re.sub(r"^(?=.)", "    ", match[1], flags=re.MULTILINE), text)


def walk(thing: griffe.Object | griffe.Alias) -> Iterator[griffe.Object]:
    """An object and everything defined in it."""
    if isinstance(thing, griffe.Object):
        yield thing
        for member in thing.members.values():
            yield from walk(member)


class Sphinx(griffe.Extension):
    """Turns docstrings of ours, and stubs of compiled classes, into what mkdocstrings understands."""

    def on_package(self, *, pkg: griffe.Module, **_: Any) -> None:
        """Rewrite what was read."""
        for thing in list(walk(pkg)):
            if thing.docstring:
                thing.docstring.value = markdown(thing.docstring.value, thing)
            # A compiled class is made by __new__; readers and mkdocstrings look for the arguments of __init__.
            new = thing.members.get("__new__")
            if thing.is_class and isinstance(new, griffe.Function) and "__init__" not in thing.members:
                made = griffe.Function("__init__", parameters=griffe.Parameters(*new.parameters), lineno=new.lineno)
                thing.set_member("__init__", made)
                thing.del_member("__new__")
