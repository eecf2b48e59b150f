"""Checks that every file has the addresses of the repository and of its pages that follow from Cargo.toml.

python scripts/checks/addresses.py [--release | --write | --self-test]: one line a finding, exit code 1 if there is any.
With `--release` Cargo.toml also has to name the repository in `GITHUB_REPOSITORY`, which workflows set; a fork may
build, but not release, under the address of another. `--write` replaces what differs.
"""

import os
import re
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
#: Files that name the repository or its pages, and no other repository but those of `OTHERS`.
FILES = (
    "pyproject.toml",
    "mkdocs.yml",
    "CITATION.cff",
    ".zenodo.json",
    ".github/ISSUE_TEMPLATE/config.yml",
    "packaging/Dockerfile",
    "packaging/conda/recipe.yaml",
    "packaging/npm/package.json",
)
OTHERS = {"github.com/conda-forge/staged-recipes"}
OWNER, NAME = r"[\w-]+", r"[\w-]+(?:\.(?!git\b)[\w-]+)*"
#: What an address of each kind looks like, and how it is made of the owner's and the repository's name.
KINDS = (
    (re.compile(rf"github\.com/{OWNER}/{NAME}"), "github.com/{owner}/{name}"),
    (re.compile(rf"{OWNER}\.github\.io/{NAME}"), "{owner}.github.io/{name}"),
    (re.compile(rf"ghcr\.io/{OWNER}/{NAME}"), "ghcr.io/{owner}/{name}"),
    (re.compile(rf"(?<=repo_name: ){OWNER}/{NAME}"), "{owner}/{name}"),
)


def parts(repository: str) -> tuple[str, str]:
    """The owner and the name in Cargo.toml's address."""
    found = re.fullmatch(rf"https://github\.com/({OWNER})/({NAME})", repository)
    if not found:
        sys.exit(f"Cargo.toml: repository is {repository}; allowed: https://github.com/OWNER/NAME")
    return found[1], found[2]


def written(text: str, owner: str, name: str) -> str:
    """A text with the addresses that it should have."""
    for pattern, form in KINDS:
        right = form.format(owner=owner, name=name)
        text = pattern.sub(lambda found, right=right: found[0] if found[0] in OTHERS else right, text)
    return text


def findings(file: str, text: str, owner: str, name: str) -> list[str]:
    """What is wrong with a file: a line that names another repository, or no address at all."""
    pairs = zip(text.splitlines(), written(text, owner, name).splitlines(), strict=True)
    found = [
        f"{file}:{number}: another repository than {owner}/{name} of Cargo.toml: {line.strip()}"
        for number, (line, right) in enumerate(pairs, start=1)
        if line != right
    ]
    if not any(pattern.search(text) for pattern, _ in KINDS):
        found.append(f"{file}: no address of the repository")
    return found


def self_test() -> None:
    """Prove that another repository is noticed and written anew, and that addresses of others stay."""
    right = (
        "a: https://github.com/me/n/issues\nb: https://me.github.io/n/\nrepo_name: me/n\nc: ghcr.io/me/n:1.2.3\n"
        "https://github.com/me/n.git\nhttps://github.com/me/n.\nhttps://github.com/conda-forge/staged-recipes\n"
    )
    assert findings("x", right, "me", "n") == []
    wrong = right.replace("me/n", "you/n").replace("//me.", "//you.")
    assert len(findings("x", wrong, "me", "n")) == 6, findings("x", wrong, "me", "n")
    assert written(wrong, "me", "n") == right
    assert findings("x", "nothing\n", "me", "n") == ["x: no address of the repository"]
    assert len(findings("x", "https://github.com/me/n-2\nhttps://github.com/me/n\n", "me", "n")) == 1
    assert parts("https://github.com/a-b/c.d") == ("a-b", "c.d")


def main() -> int:
    """Check every file, or write them; return the exit code."""
    if sys.argv[1:] == ["--self-test"]:
        self_test()
        return 0
    workspace = tomllib.loads((ROOT / "Cargo.toml").read_text(encoding="utf-8"))["workspace"]
    owner, name = parts(workspace["package"]["repository"])
    found = []
    if (here := os.environ.get("GITHUB_REPOSITORY")) and here != f"{owner}/{name}" and sys.argv[1:] == ["--release"]:
        found.append(f"Cargo.toml: repository is {owner}/{name}, and this is {here}")
    for file in FILES:
        text = (ROOT / file).read_text(encoding="utf-8")
        if sys.argv[1:] == ["--write"]:
            (ROOT / file).write_text(written(text, owner, name), encoding="utf-8")
        else:
            found += findings(file, text, owner, name)
    print("\n".join(found) if found else f"addresses: {len(FILES)} files name {owner}/{name}")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
