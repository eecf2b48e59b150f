"""Checks that the documents name only what exists: files, links, make targets, subcommands, tests.

In a source no name, comment or text may have a word of `RIDDLES`: CONTRIBUTING.md, "How we write".

python scripts/checks/documents.py [--self-test]: one line a finding, exit code 1 if there is any.
"""

import re
import shlex
import subprocess
import sys
import tomllib
from itertools import pairwise
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
# Folders whose contents are named by path in the documents.
PLACES = ("docs", "crates", "tests", "benches", "examples", "python", "scripts", "firmware")
# What may not stand in any tracked file: places of one machine.
MACHINE = re.compile(r"(?<![\w.])/(?:root|home|Users|work)/\w")
# Parts of names, as in `told_to_rest` and `ToldTwist`, and words of comments: what no wheel does, and people where the
# plain word is the part, the program or the user.
RIDDLES = {"believe", "believes", "believed", "believing", "heard", "unheard", "told", "untold"}
RIDDLES |= {"nobody", "somebody", "whoever"}
# Folders and endings of sources that may not have these words. This file names the words.
SOURCES = ("crates", "examples", "firmware", "python", "scripts", "tests", "viewers", "wasm", "web")
ENDINGS = ("rs", "h", "hpp", "c", "cpp", "in", "py", "pyi", "js", "mjs")
# Made by a bundler.
BUNDLES = ("python/omnistep/assets/player.js",)


def tracked(*patterns: str) -> list[Path]:
    """Files under version control: whatever else lies about is not ours to judge."""
    command = ["git", "ls-files", "--", *patterns]
    lines = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout.splitlines()
    return [ROOT / line for line in lines if (ROOT / line).is_file()]


def kebab(name: str) -> str:
    """`ClimbLimits` as clap names it: `climb-limits`."""
    return re.sub(r"(?<!^)(?=[A-Z])", "-", name).lower()


def subcommands() -> set[str]:
    """Subcommands of the command line, from its source."""
    source = (ROOT / "crates/omnistep/src/args.rs").read_text()
    body = source[source.index("enum Command {") : source.index("enum FileKindArg")]
    return {kebab(name) for name in re.findall(r"^    ([A-Z]\w+)(?:\(| \{|,)", body, re.MULTILINE)} | {"help"}


def make_targets() -> set[str]:
    """Targets of the Makefile."""
    return set(re.findall(r"^([a-z][\w-]*):", (ROOT / "Makefile").read_text(), re.MULTILINE))


def test_names() -> set[str]:
    """Names of all Rust and Python functions in files that hold tests."""
    names: set[str] = set()
    for path in tracked("*.rs", "*.py"):
        names |= set(re.findall(r"\b(?:fn|def) (\w+)", path.read_text(encoding="utf-8")))
    return names


# Programs that a document may tell a reader to call, beside make, cargo, omnistep and this repository's scripts.
PROGRAMS = {"apt", "c++", "cmake", "duckdb", "git", "mpiexec", "python", "python3", "qemu-system-arm", "rerun"}
PROGRAMS |= {"idf.py", "west"}  # of ESP-IDF and Zephyr
PROGRAMS |= {"rustup", ".", "./build/base"}  # the shell's own word; what the build of docs/cpp.md makes


def command_findings(line: str) -> list[str]:
    """What a line of a shell block calls or names that is not there."""
    found = []
    folder = ROOT
    for part in shlex.join(shlex.split(line, comments=True)).replace("'&&'", "&&").split(" && "):
        words = shlex.split(part)
        while words and re.fullmatch(r"[A-Z_]+=.*", words[0]):
            words.pop(0)
        program, arguments = (words[0], words[1:]) if words else ("", [])
        if program == "cd":
            folder = folder / arguments[0]
            found += [] if folder.is_dir() else [f"no folder {arguments[0]}"]
        elif program == "make":
            found += [f"no make target {name}" for name in arguments if name not in make_targets()]
        elif program == "cargo":
            found += cargo_findings(arguments, folder)
        elif program == "pip":
            known = set(tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"])
            named = re.findall(r"(?:\.|omnistep)\[([\w,]+)\]", part)
            found += [f"no extra {name}" for names in named for name in names.split(",") if name not in known]
        elif program == "omnistep":
            found += [] if arguments and arguments[0] in subcommands() else [f"no subcommand {' '.join(arguments[:1])}"]
        elif program and program not in PROGRAMS and not (folder / program).is_file():
            found.append(f"what is {program}?")
        if program == "cd":
            continue
        paths = [word for word in arguments if re.match(rf"(?:{'|'.join(PLACES)})/", word)]
        found += [f"no file {path}" for path in paths if not (folder / path).exists()]
    return found


def cargo_findings(arguments: list[str], folder: Path) -> list[str]:
    """Packages, examples and benchmarks that a call of cargo names and the workspace in `folder` lacks."""
    manifests = [path.read_text() for path in tracked("Cargo.toml", "*/Cargo.toml")]
    found = []
    for option, name in pairwise(arguments):
        if option == "-p":
            there = any(f'name = "{name}"' in text for text in manifests)
        elif option in ("--bench", "--example"):
            there = bool(tracked(f"*{option[2:]}*/{name}.rs", f"*{option[2:]}*/{name}/main.rs"))
        else:
            continue
        found += [] if there else [f"cargo: no {option} {name}"]
    if not (folder / "Cargo.toml").is_file():
        found.append(f"cargo: no workspace in {folder.name}")
    return found


def rust_findings(text: str) -> list[str]:
    """Names of this project's crates that a piece of Rust uses and their sources lack."""
    source = "\n".join(path.read_text(encoding="utf-8") for path in tracked("crates/*.rs"))
    found = []
    for path in re.findall(r"\bomni_\w+((?:::\w+)+)", text):
        for name in path.split("::")[1:]:
            if not re.search(
                rf"\b(?:fn|struct|enum|mod|trait|type|const) {name}\b|^    {name}\b,", source, re.MULTILINE
            ):
                found.append(f"no {name} in any crate")
    return found


def findings(path: Path, text: str) -> list[str]:
    """What `text`, a document at `path`, names that is not there."""
    found = []

    def check(exists: bool, line: int, what: str) -> None:
        if not exists:
            found.append(f"{path.relative_to(ROOT)}:{line}: {what}")

    targets, commands, functions = make_targets(), subcommands(), test_names()
    shell, begun = False, ""
    for number, line in enumerate(text.splitlines(), start=1):
        if line.strip().startswith("```"):
            shell = line.strip() == "```sh"
        elif shell and line.endswith("\\"):  # the command goes on in the next line
            begun += line.removesuffix("\\")
        elif shell:
            found.extend(f"{path.relative_to(ROOT)}:{number}: {what}" for what in command_findings(begun + line))
            begun = ""
        for link in re.findall(r"\]\(([^)#\s]+)[^)]*\)", line):
            if "://" not in link:
                check((path.parent / link).exists(), number, f"no file {link}")
        for code in re.findall(r"`([^`\s]+)`", line):
            # A build's output is named where it comes to lie; no clone has it.
            if code.split("/")[0] in PLACES and "/" in code and "*" not in code and "target" not in code.split("/"):
                check((ROOT / code).exists(), number, f"no file {code}")
            # A long name in snake case, in a table of tests, is a test's.
            if path.name in ("paper.md", "failures.md") and re.fullmatch(r"[a-z0-9]+(?:_[a-z0-9]+){4,}", code):
                check(code in functions, number, f"no test {code}")
        # A failure that is detected is driven by a test.
        cells = [cell.strip() for cell in line.strip("|").split("|")] if path.name == "failures.md" else []
        if len(cells) == 4 and "not detected" not in cells[2]:
            check(cells[3] != "", number, "no test of this failure")
        for target in re.findall(r"\bmake ([a-z][\w-]*)", line):
            if re.search(rf"(?:^|`)make {target}\b", line.strip()):
                check(target in targets, number, f"no make target {target}")
        called = r"(?:`|-- |\$ )omnistep ([a-z][a-z-]*)|cargo run --release (?:--features \w+ )?-- ([a-z][a-z-]*)"
        for command in re.findall(called, line):
            name = command[0] or command[1]
            check(name in commands, number, f"no subcommand {name}")
    return found


def riddles(text: str) -> list[tuple[int, str]]:
    """Line and name, or word of a comment, where a part of it is in `RIDDLES`."""
    found = []
    for number, line in enumerate(text.splitlines(), start=1):
        for name in re.findall(r"[A-Za-z]\w*", line):
            parts = re.findall(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+", name)
            if RIDDLES & {part.lower() for part in parts}:
                found.append((number, name))
    return found


def riddle_findings() -> list[str]:
    """Words that the sources may not have."""
    found = []
    for path in tracked(*(f"{folder}/*.{ending}" for folder in SOURCES for ending in ENDINGS)):
        if path == Path(__file__).resolve() or path.relative_to(ROOT).as_posix() in BUNDLES:
            continue
        for number, name in riddles(path.read_text(encoding="utf-8")):
            found.append(f"{path.relative_to(ROOT)}:{number}: {name}: say it plainly, as CONTRIBUTING.md has it")
    return found


def self_test() -> None:
    """Prove that a wrong document is noticed."""
    wrong = (
        "[x](nowhere.md) `docs/nowhere.md`\n`make nothing`\ncargo run --release -- fly\n`no_such_test_is_here_at_all`\n"
    )
    found = findings(ROOT / "docs" / "paper.md", wrong)
    assert len(found) == 5, found
    shell = "make nothing all\ncurl x\ncd nowhere\ncargo bench --bench none\npip install '.[none]'\nduckdb tests/x"
    shell = f"```sh\nomnistep fly\n{shell}\n```\n"
    found = findings(ROOT / "README.md", shell)
    assert len(found) == 9, found  # `make nothing` counts as text too
    assert len(findings(ROOT / "docs" / "failures.md", "| a | b | it stops | |\n| a | b | not detected | |\n")) == 1
    parts = "```sh\nmake \\\n    nothing\nomnistep run \\\n    --set a=1\n```\n"
    assert len(findings(ROOT / "README.md", parts)) == 1
    assert findings(ROOT / "README.md", "```sh\ncd firmware && cargo build -p omni-c && cd ..\n```\n") == []
    assert rust_findings("omni_config::Scenario::fly()") and not rust_findings("omni_config::Scenario::load(x)")
    assert findings(ROOT / "README.md", "`firmware/target/nowhere/libomnistep.a`") == []
    assert findings(ROOT / "README.md", "`make test` [x](LICENSE-MIT)\ncargo run --release -- compare step\n") == []
    wrong = "let told_to_rest = a;\nstruct ToldTwist;\nconst TOLD_M: f64 = 0.1;\nx.unheard // a wheel is believed\n"
    assert [number for number, _ in riddles(wrong)] == [1, 2, 3, 4, 4]
    assert riddles("let (sheared, commanded_rest, threshold) = tolds;\n") == []
    assert riddles("def heard(told): # nobody\n") == [(1, "heard"), (1, "told"), (1, "nobody")]
    assert MACHINE.search("see /" + "home/somebody/x") and not MACHINE.search("target/release, a/home/b")


def main() -> int:
    """Check everything; return the exit code."""
    if "--self-test" in sys.argv[1:]:
        self_test()
        return 0
    found = []
    for path in tracked("*.md"):
        found += findings(path, path.read_text(encoding="utf-8"))
    for path in tracked():
        if path.suffix in {".png", ".gif", ".jpg", ".lock"} or path.is_relative_to(ROOT / "fuzz/corpus"):
            continue
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
            if MACHINE.search(line):
                found.append(f"{path.relative_to(ROOT)}:{number}: a place of one machine")
    found += riddle_findings()
    print("\n".join(found) if found else "documents: every file, link, target, subcommand and test they name exists")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
