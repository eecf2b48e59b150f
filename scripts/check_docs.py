"""Checks that the documents name only what exists: files, links, make targets, subcommands, tests.

python scripts/check_docs.py [--self-test]: one line a finding, exit code 1 if there is any.
"""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
# Folders whose contents are named by path in the documents.
PLACES = ("docs", "crates", "tests", "benches", "examples", "python", "scripts", "firmware")
# What may not stand in any tracked file: places of one machine.
MACHINE = re.compile(r"(?<![\w.])/(?:root|home|Users|work)/\w")


def tracked(*patterns: str) -> list[Path]:
    """Files under version control: whatever else lies about is not ours to judge."""
    command = ["git", "ls-files", "--", *patterns]
    lines = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout.splitlines()
    return [ROOT / line for line in lines if (ROOT / line).is_file()]


def subcommands() -> set[str]:
    """Subcommands of the command line, from its source."""
    source = (ROOT / "crates/omni-sim/src/cli.rs").read_text()
    body = source[source.index("enum Command {") : source.index("struct RunArgs")]
    return {name.lower() for name in re.findall(r"^    ([A-Z]\w+)(?:\(| \{|,)", body, re.MULTILINE)} | {"help"}


def make_targets() -> set[str]:
    """Targets of the Makefile."""
    return set(re.findall(r"^([a-z][\w-]*):", (ROOT / "Makefile").read_text(), re.MULTILINE))


def test_names() -> set[str]:
    """Names of all Rust and Python functions in files that hold tests."""
    names: set[str] = set()
    for path in tracked("*.rs", "*.py"):
        names |= set(re.findall(r"\b(?:fn|def) (\w+)", path.read_text(encoding="utf-8")))
    return names


def findings(path: Path, text: str) -> list[str]:
    """What `text`, a document at `path`, names that is not there."""
    found = []

    def check(exists: bool, line: int, what: str) -> None:
        if not exists:
            found.append(f"{path.relative_to(ROOT)}:{line}: {what}")

    targets, commands, functions = make_targets(), subcommands(), test_names()
    for number, line in enumerate(text.splitlines(), start=1):
        for link in re.findall(r"\]\(([^)#\s]+)[^)]*\)", line):
            if "://" not in link:
                check((path.parent / link).exists(), number, f"no file {link}")
        for code in re.findall(r"`([^`\s]+)`", line):
            if code.split("/")[0] in PLACES and "/" in code and "*" not in code:
                check((ROOT / code).exists(), number, f"no file {code}")
            # A long name in snake case, in a table of tests, is a test's.
            if path.name == "paper.md" and re.fullmatch(r"[a-z0-9]+(?:_[a-z0-9]+){4,}", code):
                check(code in functions, number, f"no test {code}")
        for target in re.findall(r"\bmake ([a-z][\w-]*)", line):
            if re.search(rf"(?:^|`)make {target}\b", line.strip()):
                check(target in targets, number, f"no make target {target}")
        for command in re.findall(r"(?:`|-- |\$ )omnistep ([a-z]+)|cargo run --release -- ([a-z]+)", line):
            name = command[0] or command[1]
            check(name in commands, number, f"no subcommand {name}")
    return found


def self_test() -> None:
    """Prove that a wrong document is noticed."""
    wrong = (
        "[x](nowhere.md) `docs/nowhere.md`\n`make nothing`\ncargo run --release -- fly\n`no_such_test_is_here_at_all`\n"
    )
    found = findings(ROOT / "docs" / "paper.md", wrong)
    assert len(found) == 5, found
    assert findings(ROOT / "README.md", "`make test` [x](LICENSE-MIT)\ncargo run --release -- compare step\n") == []
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
        if path.suffix in {".png", ".lock"}:
            continue
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
            if MACHINE.search(line):
                found.append(f"{path.relative_to(ROOT)}:{number}: a place of one machine")
    print("\n".join(found) if found else "documents: every file, link, target, subcommand and test they name exists")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
