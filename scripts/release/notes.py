"""Prints the notes of a release: the section of its version in CHANGELOG.md, with addresses instead of relative links.

python scripts/release/notes.py TAG | --self-test: TAG is v1.2.3. The workflow of a release gives them to GitHub. A
version without a section is an error.
"""

import re
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
#: Characters that GitHub takes at most.
MOST = 125_000


def notes(changes: str, tag: str, repository: str) -> str:
    """The notes; `changes` is the text of CHANGELOG.md."""
    version = tag.removeprefix("v")
    head = re.search(rf"^## \[{re.escape(version)}\].*\n", changes, re.MULTILINE)
    if not head:
        sys.exit(f"CHANGELOG.md has no heading ## [{version}]")
    after = changes[head.end() :]
    following = re.search(r"^## \[", after, re.MULTILINE)
    body = (after[: following.start()] if following else after).strip()
    if not body:
        sys.exit(f"CHANGELOG.md says nothing below ## [{version}]")
    places = f"{repository}/blob/{tag}"
    body = re.sub(r"(?<=\]\()(?![a-z]+:|#)([^)\s]+)(?=\))", rf"{places}/\1", body)
    # Pages that the sections name without a link.
    body = re.sub(r"(?<![\w/`\[(])(docs/[\w-]+\.md)(?![\w`\])])", rf"[\1]({places}/\1)", body)
    last = f"\n\nEvery version: [CHANGELOG.md]({places}/CHANGELOG.md)\n"
    if len(body) + len(last) > MOST:
        sys.exit(f"CHANGELOG.md: the section ## [{version}] has {len(body)} characters, allowed: {MOST - len(last)}")
    return body + last


def self_test() -> None:
    """Prove that one section is taken whole, and that a version without one is an error."""
    changes = "# Changelog\n\n## [Unreleased]\n\n## [1.2.3] - 2001-02-03\n\n### Added\n\n- A [x](docs/a.md#b), "
    changes += "`docs/k.md`, [y](https://e.org/). docs/b.md\n\n## [1.2.2]\n\n- Old\n\n## [1.2]\n"
    at = "https://e.org/o/n/blob/v1.2.3"
    assert notes(changes, "v1.2.3", "https://e.org/o/n") == (
        f"### Added\n\n- A [x]({at}/docs/a.md#b), `docs/k.md`, [y](https://e.org/). [docs/b.md]({at}/docs/b.md)\n\n"
        f"Every version: [CHANGELOG.md]({at}/CHANGELOG.md)\n"
    )
    for tag, words in (("v1.2.4", "no heading"), ("v1.2", "says nothing"), ("v1x2.3", "no heading")):
        try:
            notes(changes, tag, "")
        except SystemExit as wrong:
            assert words in str(wrong.code), wrong.code
        else:
            raise AssertionError(tag)


def main() -> int:
    """Print the notes of a tag."""
    if sys.argv[1:] == ["--self-test"]:
        self_test()
        return 0
    if len(sys.argv) != 2:
        print("usage: python scripts/release/notes.py TAG", file=sys.stderr)
        return 2
    workspace = tomllib.loads((ROOT / "Cargo.toml").read_text(encoding="utf-8"))["workspace"]
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    sys.stdout.write(notes(changes, sys.argv[1], workspace["package"]["repository"]))
    return 0


if __name__ == "__main__":
    sys.exit(main())
