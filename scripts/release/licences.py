"""The licence texts of all Rust packages that are linked into what is handed out, as one text.

python scripts/release/licences.py wheel|program|library|module [TARGET]: prints the text for one of Rust's targets, by
default this machine's, for the library a Cortex-M4, for the module WebAssembly. With --self-test it proves that a
package without a text is an error.

The packages are those of `cargo tree`: normal dependencies, macros too because what they write is compiled in. Their
texts come from the sources that cargo unpacked, without duplicates. A package without a licence file gets the text that
other packages of the set carry for its expression: Apache-2.0, or MIT with the authors whom its Cargo.toml names.
"""

import json
import re
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
NAME = "THIRD-PARTY.txt"
#: The folder of the workspace, and what is chosen of it.
LINKED = {
    "wheel": (ROOT, ("--package", "omni-py")),
    "program": (ROOT, ("--package", "omnistep", "--features", "full")),
    "library": (ROOT / "firmware", ("--package", "omni-c")),
    "module": (ROOT / "wasm", ("--package", "omnistep-wasm")),
}
MICROCONTROLLER = "thumbv7em-none-eabihf"
WEBASSEMBLY = "wasm32-unknown-unknown"
FILE = re.compile(r"(un)?licen[cs]e|copying|copyright|notice", re.IGNORECASE)
CODE = {".json", ".py", ".rs", ".toml", ".yaml", ".yml"}
#: Texts of the other choice: zstd is under BSD-3-Clause or GPL-2.0, and is here under the first.
LEFT_OUT = {"zstd-sys": {"zstd/COPYING"}}
#: First and last words of the standard text of a licence, whatever stands around it.
STANDARD = {
    "Apache-2.0": ("Apache License", "END OF TERMS AND CONDITIONS"),
    "MIT": ("Permission is hereby granted, free of charge", "DEALINGS IN THE SOFTWARE."),
}
RUST = ("Rust's library (core, alloc, std and what they are made of)", "MIT OR Apache-2.0")


@dataclass(frozen=True)
class Package:
    """A package that is linked: its name and version, its licence's expression, its folder and its authors."""

    name: str
    version: str
    licence: str
    folder: Path
    authors: tuple[str, ...]


def cargo(folder: Path, *arguments: str) -> str:
    """What cargo prints about a workspace."""
    return subprocess.run(["cargo", *arguments], cwd=folder, check=True, stdout=subprocess.PIPE, text=True).stdout


def this_machine() -> str:
    """The target for which cargo builds unless another is named."""
    said = subprocess.run(["rustc", "-vV"], cwd=ROOT, check=True, stdout=subprocess.PIPE, text=True).stdout
    return said.partition("\nhost: ")[2].partition("\n")[0]


def linked(what: str, target: str) -> list[Package]:
    """The packages of others in the wheel, the program, the library or the module, sorted."""
    folder, chosen = LINKED[what]
    options = ("--locked", "--target", target, "--edges", "normal", "--prefix", "none", "--format", "{p}")
    names = {tuple(line.split()[:2]) for line in cargo(folder, "tree", *chosen, *options).splitlines() if line}
    known = cargo(folder, "metadata", "--locked", "--format-version", "1", "--filter-platform", target)
    return [
        Package(
            each["name"],
            each["version"],
            (each["license"] or "").replace("/", " OR "),
            Path(each["manifest_path"]).parent,
            tuple(each["authors"]) or (each["repository"] or each["name"],),
        )
        for each in sorted(json.loads(known)["packages"], key=lambda each: (each["name"], each["version"]))
        if each["source"] and (each["name"], f"v{each['version']}") in names
    ]


def files(package: Package) -> list[Path]:
    """The licence files of a package, those of the sources that it contains too."""
    found = []
    for path in sorted(package.folder.rglob("*")):
        parts = path.relative_to(package.folder).parts
        if not path.is_file() or parts[0].startswith(".") or path.suffix.lower() in CODE:
            continue
        named = FILE.match(path.name) or (len(parts) > 1 and FILE.match(parts[-2]))
        if named and "/".join(parts) not in LEFT_OUT.get(package.name, ()):
            found.append(path)
    return found


def words(text: str) -> str:
    """A text without the way in which its lines are broken."""
    return " ".join(text.split())


def read(path: Path) -> str:
    """A licence file, with the ends of lines that texts have here."""
    content = path.read_bytes()
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = content.decode("latin-1")
    return "\n".join(line.rstrip() for line in text.splitlines()).strip("\n")


def standard(licence: str, texts: list[str]) -> str | None:
    """The standard text of a licence, as the first of these texts that has it carries it."""
    begin, end = STANDARD[licence]
    for text in texts:
        start, stop = text.find(begin), text.find(end)
        if 0 <= start < stop:
            return text[start : stop + len(end)]
    return None


def without_file(package: Package, texts: list[str]) -> str:
    """What stands for the licence file that a package lacks; a package for which there is nothing is an error."""
    choices = re.split(r" OR ", package.licence)
    for licence in STANDARD:
        if licence in choices and (text := standard(licence, texts)):
            if licence == "MIT":
                holders = ", ".join(re.sub(r" *<[^>]*>", "", each) for each in package.authors)
                return f"MIT License\n\nCopyright (c) {holders}\n\n{text}"
            return text
    sys.exit(
        f"{package.name} {package.version} ({package.licence or 'no licence'}): it has no licence file, and no other "
        f"package carries the text; allowed: a licence file, or one of {', '.join(STANDARD)}"
    )


def text_of(packages: list[Package], beside: dict[str, str] | None = None) -> str:
    """One text: the packages with the numbers of their texts, then the texts; `beside` has those of other things."""
    own = {package: [read(path) for path in files(package)] for package in packages}
    carried = [text for texts in own.values() for text in texts]
    numbers: dict[str, int] = {}
    shown: list[str] = []
    users: list[list[str]] = []

    def number(text: str, user: str) -> int:
        key = words(text)
        if key not in numbers:
            numbers[key] = len(numbers) + 1
            shown.append(text)
            users.append([])
        if user not in users[numbers[key] - 1]:
            users[numbers[key] - 1].append(user)
        return numbers[key]

    lines = []
    for package, texts in own.items():
        name = f"{package.name} {package.version}"
        note = "" if texts else "; it has no licence file"
        numbered = sorted({number(each, name) for each in texts or [without_file(package, carried)]})
        lines.append(f"{name} ({package.licence}): {', '.join(map(str, numbered))}{note}")
    rust = standard("Apache-2.0", carried)
    if rust is None:
        sys.exit(f"{RUST[0]}: no package carries the text of Apache-2.0")
    lines.append(f"{RUST[0]} ({RUST[1]}): {number(rust, 'Rust')}")
    lines += [f"{name}: {number(text, name)}" for name, text in (beside or {}).items()]
    intro = (
        "Software of others that is contained, with its licences. Each line names a package, its licence and the\n"
        "numbers of the texts below. Where a licence leaves a choice, any of its texts may be chosen."
    )
    rule = "-" * 80
    parts = [
        f"{rule}\nText {i}: {', '.join(users[i - 1])}\n{rule}\n\n{text}\n" for i, text in enumerate(shown, start=1)
    ]
    return f"{intro}\n\n" + "\n".join(lines) + "\n\n" + "\n".join(parts)


def collected(what: str, target: str, beside: dict[str, str] | None = None) -> str:
    """The text for the wheel, the program, the library or the module of a target."""
    return text_of(linked(what, target), beside)


def self_test() -> None:
    """Prove that texts are shared, that standard texts stand in, and that a package without a text is an error."""
    apache = "Apache License\n\nTerms.\n\nEND OF TERMS AND CONDITIONS"
    granted = "Permission is hereby granted, free of charge, to anybody. DEALINGS IN THE SOFTWARE."
    with tempfile.TemporaryDirectory() as top:

        def package(name: str, licence: str, **texts: str) -> Package:
            folder = Path(top) / name
            folder.mkdir()
            for file, text in texts.items():
                (folder / file.replace("_", "-")).write_text(text, encoding="utf-8")
            return Package(name, "1.0.0", licence, folder, ("A. Author <a@example.org>",))

        one = package("one", "MIT OR Apache-2.0", LICENSE_APACHE=apache, LICENSE_MIT=f"Copyright (c) One\n\n{granted}")
        two = package("two", "MIT", LICENSE=f"Copyright (c) One\n{granted}\n")
        bare, both = package("bare", "MIT"), package("both", "Apache-2.0 OR MIT")
        text = text_of([bare, both, one, two])
        for line in (
            "bare 1.0.0 (MIT): 1; it has no licence file",
            "both 1.0.0 (Apache-2.0 OR MIT): 2; it has no licence file",
            "one 1.0.0 (MIT OR Apache-2.0): 2, 3",
            "two 1.0.0 (MIT): 3",
            f"{RUST[0]} ({RUST[1]}): 2",
            "Copyright (c) A. Author",
        ):
            assert line in text.splitlines(), (line, text)
        assert text.count(granted) == 2 and text.count("Terms.") == 1
        for packages, named in (([package("odd", "Zlib"), one], "odd 1.0.0 (Zlib)"), ([bare], "bare 1.0.0 (MIT)")):
            try:
                text_of(packages)
            except SystemExit as wrong:
                assert str(wrong.code).startswith(named), wrong.code
            else:
                raise AssertionError(named)


def main() -> int:
    """Print one of the texts."""
    if sys.argv[1:] == ["--self-test"]:
        self_test()
        return 0
    if len(sys.argv) not in (2, 3) or sys.argv[1] not in LINKED:
        print(__doc__.split("\n\n")[1], file=sys.stderr)
        return 2
    usual = {"library": MICROCONTROLLER, "module": WEBASSEMBLY}
    target = sys.argv[2] if len(sys.argv) == 3 else usual.get(sys.argv[1]) or this_machine()
    sys.stdout.write(collected(sys.argv[1], target))
    return 0


if __name__ == "__main__":
    sys.exit(main())
