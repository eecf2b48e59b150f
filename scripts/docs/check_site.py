"""Checks the finished site in out/site, whatever built it.

python scripts/docs/check_site.py [--self-test]

Everything that a page loads is there and comes from the site, every link leads to a page and to an anchor of it, the
navigation names every staged page, the reference has every public name, and the playground is whole, if it was built.
One line a finding, exit code 1 if any.
"""

import re
import sys
import tempfile
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote

ROOT = Path(__file__).resolve().parents[2]
# Tags that make a browser fetch something, and the attribute that says from where.
FETCHED = {"script": "src", "img": "src", "iframe": "src", "source": "src", "video": "src", "object": "data"}
FETCHING_LINKS = {"stylesheet", "icon", "preconnect", "preload", "prefetch", "modulepreload", "manifest"}


class Page(HTMLParser):
    """What a page of the site loads, where its links lead, and its anchors."""

    def __init__(self, path: Path) -> None:
        """Reads it."""
        super().__init__()
        self.loads: list[str] = []
        self.links: list[str] = []
        self.anchors: set[str] = set()
        self.feed(path.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Notes what a tag fetches or links to."""
        given = {key: value or "" for key, value in attrs}
        self.anchors.add(given.get("id", ""))
        address = given.get(FETCHED.get(tag, ""), "")
        if tag == "link" and FETCHING_LINKS & set(given.get("rel", "").split()):
            address = given["href"]
        if address:
            self.loads.append(address)
        if given.get("data-md-component") == "source":  # the theme's script asks for this repository's counts
            self.loads.append("https://api.github.com")
        if tag == "a" and given.get("href"):
            self.links.append(given["href"])


def lost(path: Path, address: str, pages: dict[Path, Page]) -> str:
    """What is wrong with a link of the page at `path`; empty if nothing is, or if it leads elsewhere."""
    if re.match(r"[a-z]+:", address):
        return ""
    file, _, anchor = unquote(address).partition("#")
    target = (path.parent / file).resolve() if file else path
    if file.startswith("/") or not target.is_file():
        return f"links to {address}, which is not there"
    if anchor and target in pages and anchor not in pages[target].anchors:
        return f"links to {address}, where nothing has this anchor"
    return ""


def findings(site: Path, staged: Path, entries: list[str]) -> list[str]:
    """What is wrong with the site made of the staged pages; `entries` are the names that its reference has to have."""
    found = []
    pages = {path: Page(path) for path in sorted(site.rglob("*.html"))}
    for path, page in pages.items():
        where = path.relative_to(site)
        for address in page.loads:
            if re.match(r"(?:https?:)?//", address):
                found.append(f"{where}: a browser would fetch {address}")
            elif not address.startswith(("data:", "/")) and not (path.parent / re.sub(r"[?#].*", "", address)).exists():
                found.append(f"{where}: {address} is not there")
        if path.name != "404.html":  # this one is shown at any address, so its links start at the site's root
            found += [f"{where}: {what}" for address in page.links if (what := lost(path, address, pages))]
    for path in site.rglob("*.css"):
        for address in re.findall(r"(?:url\(|@import )[\"']?((?:https?:)?//[^\"')]+)", path.read_text("utf-8")):
            found.append(f"{path.relative_to(site)}: a browser would fetch {address}")
    # The navigation is the same on every page.
    shown = {(site / unquote(link).partition("#")[0]).resolve() for link in pages[site / "index.html"].links}
    for source in sorted(staged.rglob("*.md")):
        name = source.relative_to(staged)
        if site / name.with_suffix(".html") not in shown:
            found.append(f"{name}: mkdocs.yml has no line for it")
    anchors = set().union(*(page.anchors for page in pages.values()))
    return found + [f"the reference has no entry {entry}" for entry in entries if entry not in anchors]


def playground_findings(site: Path, built: Path) -> list[str]:
    """What the site's copy of the playground lacks of the files that were built, and whether it links back."""
    found = []
    for path in sorted(built.iterdir()) if built.is_dir() else []:
        copy = site / "playground" / path.name
        where = copy.relative_to(site)
        if not copy.is_file():
            found.append(f"{where} is not there")
        elif path.name == "index.html":
            if "../playground.html" not in Page(copy).links:
                found.append(f"{where}: no link to ../playground.html")
        elif copy.read_bytes() != path.read_bytes():
            found.append(f"{where} is another file than the one that was built")
    return found


def self_test() -> None:
    """Prove that a sound site passes, and that each kind of fault is noticed."""
    with tempfile.TemporaryDirectory() as folder:
        site, staged = Path(folder).resolve() / "site", Path(folder).resolve() / "staged"
        site.mkdir()
        staged.mkdir()
        for name in ("index", "a"):
            (staged / f"{name}.md").touch()
        index = '<a href="index.html">i</a><a href="./a.html#there">a</a><a href="https://example.org">e</a>'
        (site / "index.html").write_text(index)
        (site / "a.html").write_text('<h1 id="there">a</h1><img src="index.html?1"><a href="#there">h</a>')
        assert findings(site, staged, ["there"]) == []
        faults = {
            '<img src="//example.org/x.png">': "fetch",
            '<link rel="icon" href="https://example.org/x.png">': "fetch",
            '<i data-md-component="source"></i>': "fetch",
            '<script src="gone.js"></script>': "gone.js is not there",
            '<a href="gone.html">g</a>': "which is not there",
            '<a href="/index.html">absolute</a>': "which is not there",
            '<a href="a.html#gone">g</a>': "this anchor",
        }
        for fault, words in faults.items():
            (site / "index.html").write_text(index + fault)
            (finding,) = findings(site, staged, ["there"])
            assert words in finding, finding
        (site / "index.html").write_text(index)
        (site / "x.css").write_text("body { background: url('https://example.org/x.png') }")
        (staged / "extra.md").touch()
        assert len(findings(site, staged, ["omnistep.gone"])) == 3
        built = Path(folder) / "built"
        assert playground_findings(site, built) == []
        for where in (built, site / "playground"):
            where.mkdir()
            for name in ("index.html", "worker.js", "omnistep.wasm"):
                (where / name).write_text('<a href="../playground.html">a</a>')
        assert playground_findings(site, built) == []
        (built / "worker.js").write_text("new")
        (site / "playground" / "omnistep.wasm").unlink()
        (site / "playground" / "index.html").write_text("")
        assert [" ".join(each.split()[:2]) for each in playground_findings(site, built)] == [
            "playground/index.html: no",
            "playground/omnistep.wasm is",
            "playground/worker.js is",
        ]


def main() -> int:
    """Check the site; return the exit code."""
    if "--self-test" in sys.argv[1:]:
        self_test()
        return 0
    from stage_pages import entries  # reads the package

    site = ROOT / "out" / "site"
    found = findings(site, ROOT / "out" / "docs", entries()) + playground_findings(site, ROOT / "out" / "playground")
    print("\n".join(found) if found else "site: all that its pages load and link to is there, every name has its entry")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
