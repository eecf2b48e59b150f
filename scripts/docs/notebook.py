"""Writes the tutorial as a notebook for Colab and Binder, made of docs/tutorial.md.

Writes tutorial.ipynb and requirements.txt. Each block of Python is a cell. The cell that installs takes the version of
Cargo.toml from PyPI, and the links at the top lead to the branch `notebook` of the repository: both work once a release
has been published.
"""

import argparse
import json
import re
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "tutorial.md"
BRANCH = "notebook"
#: Which paragraphs are about cells of one's own, and the section that installs from a copy of the repository.
PASTE = "Paste every block into a notebook cell, in order."
INSTALL = re.compile(r"^## Install the package\n.*?(?=^## )", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"(!?\[[^\]]*\]\()(?![a-z]+:|#)([^)\s]+)(?=\))")


def addressed(text: str, repository: str, site: str) -> str:
    """A text with addresses instead of relative links: pages and pictures of the site, files of the repository."""

    def address(link: re.Match[str]) -> str:
        start, path = link.groups()
        if path.startswith("../"):
            return f"{start}{repository}/blob/main/{path.removeprefix('../')}"
        return f"{start}{site}" + re.sub(r"\.md(?=#|$)", ".html", path)

    return LINK.sub(address, text)


def cells(page: str, install: str) -> list[tuple[str, str]]:
    """The kinds and texts of the cells; `install` is the cell in place of the section that installs."""
    page, count = INSTALL.subn(lambda _: f"## Install the package\n\n```python\n{install}\n```\n\n", page)
    if count != 1 or PASTE not in page:
        sys.exit(f"docs/tutorial.md lacks the section ## Install the package, or the sentence: {PASTE}")
    page = page.replace(PASTE, "Run the cells in order.")
    found = []
    for number, part in enumerate(re.split(r"^```python\n(.*?)^```\n", page, flags=re.MULTILINE | re.DOTALL)):
        if text := part.strip("\n"):
            found.append(("code" if number % 2 else "markdown", text))
    return found


def notebook(page: str, version: str, repository: str, site: str) -> dict:
    """The notebook as its format has it, nbformat 4.5."""
    owner_name = repository.removeprefix("https://github.com/")
    colab = f"https://colab.research.google.com/github/{owner_name}/blob/{BRANCH}/tutorial.ipynb"
    binder = f"https://mybinder.org/v2/gh/{owner_name}/{BRANCH}?labpath=tutorial.ipynb"
    badges = (
        f"[![Open in Colab](https://colab.research.google.com/assets/colab-badge.svg)]({colab})\n"
        f"[![Open in Binder](https://mybinder.org/badge_logo.svg)]({binder})"
    )
    made = cells(addressed(page, repository, site), f'%pip install --quiet "omnistep[plot]=={version}" pandas')
    listed = []
    for number, (kind, text) in enumerate([("markdown", badges), *made]):
        cell = {"cell_type": kind, "id": f"cell-{number}", "metadata": {}, "source": text.splitlines(keepends=True)}
        listed.append({**cell, "execution_count": None, "outputs": []} if kind == "code" else cell)
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    about = {"kernelspec": kernel, "language_info": {"name": "python"}}
    return {"cells": listed, "metadata": about, "nbformat": 4, "nbformat_minor": 5}


def main() -> int:
    """Write both files."""
    parser = argparse.ArgumentParser(description=__doc__)
    default = ROOT / "out" / "notebook"
    parser.add_argument("folder", nargs="?", type=Path, default=default, help="out/notebook by default")
    folder: Path = parser.parse_args().folder
    package = tomllib.loads((ROOT / "Cargo.toml").read_text(encoding="utf-8"))["workspace"]["package"]
    urls = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["urls"]
    folder.mkdir(parents=True, exist_ok=True)
    version, page = package["version"], PAGE.read_text(encoding="utf-8")
    made = notebook(page, version, package["repository"], urls["Documentation"])
    (folder / "tutorial.ipynb").write_text(json.dumps(made, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    (folder / "requirements.txt").write_text(f"omnistep[plot]=={version}\npandas\n", encoding="utf-8")
    print(f"{folder / 'tutorial.ipynb'}: {len(made['cells'])} cells")
    return 0


if __name__ == "__main__":
    sys.exit(main())
