"""What a release is made with, as far as no server is needed."""

import importlib
import os
import re
import shutil
import subprocess
import sys
import tarfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def scripts():
    """Imports a module of scripts/release."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(ROOT / "scripts" / "release")
        yield importlib.import_module


@pytest.fixture(scope="module")
def addresses():
    """The module that knows which files name the repository."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(ROOT / "scripts" / "checks")
        return importlib.import_module("addresses")


@pytest.fixture
def released(tmp_path, addresses):
    """What scripts/release/tag_fits.sh reads, as it is on the day of a release."""
    texts = ("CITATION.cff", "CHANGELOG.md", "README.md")
    scripts = ("scripts/release/tag_fits.sh", "scripts/checks/addresses.py")
    for name in {*scripts, "Cargo.toml", "firmware/Cargo.toml", *texts, *addresses.FILES}:
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, tmp_path / name)
    for lock in [*ROOT.glob("Cargo.lock"), *ROOT.glob("*/Cargo.lock"), *ROOT.glob("examples/*/Cargo.lock")]:
        copy = tmp_path / lock.relative_to(ROOT)
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(lock, copy)
    version = re.search(r'^version = "(.*)"$', (ROOT / "Cargo.toml").read_text(encoding="utf-8"), re.MULTILINE)[1]
    changes = tmp_path / "CHANGELOG.md"
    text = changes.read_text(encoding="utf-8").replace("Nothing has been released yet", "This is the first release")
    changes.write_text(text.replace("## [Unreleased]", f"## [{version}] - 2001-02-03"), encoding="utf-8")
    citation = tmp_path / "CITATION.cff"
    text = citation.read_text(encoding="utf-8").replace("\nlicense:", "\ndate-released: 2001-02-03\nlicense:")
    citation.write_text(text, encoding="utf-8")
    readme = tmp_path / "README.md"
    readme.write_text(re.sub(r"not\syet\son\sPyPI", "on PyPI", readme.read_text(encoding="utf-8")), encoding="utf-8")
    return tmp_path, version


def tag_fits(folder, tag):
    return subprocess.run([folder / "scripts/release/tag_fits.sh", tag], capture_output=True, text=True, check=False)


def test_a_tag_fits_where_every_file_has_its_version(released):
    folder, version = released
    ended = tag_fits(folder, f"v{version}")
    assert (ended.returncode, ended.stderr) == (0, "")
    assert "is not v" in tag_fits(folder, "v99.0.0").stderr


@pytest.mark.parametrize(
    ("file", "old", "new"),
    [
        ("Cargo.toml", 'crates/omni-log", version = "', 'crates/omni-log", version = "9'),
        ("CITATION.cff", "\nversion: ", "\nversion: 9"),
        ("CITATION.cff", "\ndate-released: ", "\nreleased: "),
        ("CHANGELOG.md", "\n## [", "\n## [9"),
        ("CHANGELOG.md", "] - 2001-02-03", "] - 2001-02-04"),
        ("packaging/conda/recipe.yaml", '\n  version: "', '\n  version: "9'),
        ("packaging/npm/package.json", '"version": "', '"version": "9'),
        ("mkdocs.yml", "\nrepo_url: https://github.com/", "\nrepo_url: https://github.com/another"),
        ("pyproject.toml", '"https://github.com/omnistep', '"https://github.com/another'),
        ("CHANGELOG.md", "# Changelog\n", "# Changelog\n\nNothing has been released yet.\n"),
        ("firmware/Cargo.toml", '\nversion = "', '\nversion = "9'),
        ("wasm/Cargo.lock", 'name = "omni-sim"\nversion = "', 'name = "omni-sim"\nversion = "9'),
        ("README.md", "# omnistep\n", "# omnistep\n\nIt is not yet\non PyPI.\n"),
    ],
)
def test_a_tag_does_not_fit_if_one_file_has_another_version_or_no_release(file, old, new, released):
    folder, version = released
    text = (folder / file).read_text(encoding="utf-8")
    assert old in text
    (folder / file).write_text(text.replace(old, new, 1), encoding="utf-8")
    ended = tag_fits(folder, f"v{version}")
    assert ended.returncode == 1
    assert len(ended.stderr.splitlines()) == 1 and file in ended.stderr


# What stands in for cargo: the names in a file are the index; one upload is refused for now, another for good.
CARGO = """#!{python}
import os, sys
from pathlib import Path
here = Path(__file__).parent
index, log = here / "index", here / "log"
known = index.read_text().split()
if sys.argv[1] == "metadata":
    os.execv({cargo!r}, ["cargo", *sys.argv[1:]])
if sys.argv[1] == "info":
    name = sys.argv[-1].partition("@")[0]
    if name not in known:
        sys.exit(f"error: could not find `{{sys.argv[-1]}}` in registry")
if sys.argv[1] == "publish":
    name = sys.argv[-1]
    tried = log.read_text().split() if log.exists() else []
    log.write_text(" ".join([*tried, name]))
    if name == "omni-sim" and tried.count(name) == 0:
        sys.exit("error: the remote server responded with an error (status 429 Too Many Requests)")
    if name == "omni-log" and not (here / "mended").exists():
        sys.exit("error: no such token")
    index.write_text(" ".join([*known, name]))
"""


def test_an_upload_goes_on_where_it_stopped_and_waits_where_the_registry_asks_for_it(tmp_path, monkeypatch, scripts):
    publish = scripts("publish")
    stub = tmp_path / "cargo"
    stub.write_text(CARGO.format(python=sys.executable, cargo=shutil.which("cargo")), encoding="utf-8")
    stub.chmod(0o755)
    (tmp_path / "index").write_text("omnistep-core", encoding="utf-8")
    monkeypatch.setenv("PATH", f"{tmp_path}:/usr/bin:/bin")
    waits = []
    monkeypatch.setattr(publish.time, "sleep", waits.append)
    order = list(publish.crates())
    around = ["omni-bound", "omni-config", "omni-link", "omni-log", "omni-plan", "omni-sim", "omni-study"]
    assert sorted(order) == [*around, "omnistep", "omnistep-core"]
    assert order[0] == "omnistep-core" and order[-1] == "omnistep"
    assert order.index("omni-config") < order.index("omni-sim") < order.index("omni-log")
    assert order.index("omni-link") < order.index("omni-sim") < order.index("omni-study")
    with pytest.raises(SystemExit, match=r"omni-log was not uploaded; run scripts/package\.sh --publish again"):
        publish.main()
    assert waits == [publish.WAIT_S]
    # Those that are there now are not tried again.
    (tmp_path / "log").unlink()
    (tmp_path / "mended").touch()
    there = set((tmp_path / "index").read_text(encoding="utf-8").split())
    publish.main()
    tried = (tmp_path / "log").read_text(encoding="utf-8").split()
    assert tried == [name for name in order if name not in there]
    assert tried[0] == "omni-log" and tried[-1] == "omnistep"


def test_a_windows_program_that_needs_a_library_of_visual_c_is_refused(tmp_path, scripts):
    command = scripts("command")
    program = tmp_path / "omnistep.exe"
    for content, wrong in ((b"MZ\0KERNEL32.dll\0", None), (b"MZ\0VCRUNTIME140.dll\0", "VCRUNTIME140.dll")):
        program.write_bytes(content)
        said = command.wrong_with(program, "x86_64-pc-windows-msvc")
        assert said is None if wrong is None else wrong in said


def test_a_tag_does_not_fit_in_another_repository_than_the_files_name(released, monkeypatch):
    folder, version = released
    for repository, code in (("omnistep/omnistep", 0), ("another/omnistep", 1)):
        monkeypatch.setenv("GITHUB_REPOSITORY", repository)
        assert tag_fits(folder, f"v{version}").returncode == code


def test_every_address_of_the_repository_is_written_from_cargo_toml(addresses):
    addresses.self_test()
    assert addresses.main() == 0


def test_the_notes_of_a_release_are_its_section_of_the_changelog(scripts):
    notes = scripts("notes")
    notes.self_test()
    text = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    made = notes.notes(text, "Unreleased", "https://example.org/o/n")
    assert "\n### Added\n" in made and "\n## " not in made


def test_licence_texts_are_shared_and_a_package_without_one_is_an_error(scripts):
    scripts("licences").self_test()


def test_the_packages_of_the_c_library_name_what_the_controller_needs_and_no_more(scripts):
    licences = scripts("licences")
    packages = licences.linked("library", licences.MICROCONTROLLER)
    assert {"libm", "nalgebra"} <= {each.name for each in packages} and len(packages) < 20
    text = licences.text_of(packages)
    assert "Copyright (c) 2018 Jorge Aparicio" in text and str(Path.home()) not in text


def test_the_source_is_packed_with_a_fitting_lock_file_and_links_that_lead_somewhere(tmp_path, monkeypatch, scripts):
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")  # where maturin is
    name = scripts("wheel_backend").build_sdist(str(tmp_path))
    with tarfile.open(tmp_path / name) as archive:
        archive.extractall(tmp_path, **({"filter": "data"} if hasattr(tarfile, "data_filter") else {}))
        assert {entry.mtime for entry in archive} == {archive.getmembers()[0].mtime}
    top = tmp_path / name.removesuffix(".tar.gz")
    command = ["cargo", "metadata", "--locked", "--format-version", "1"]
    subprocess.run(command, cwd=top, check=True, stdout=subprocess.DEVNULL)

    def pinned(lock):
        return set(re.findall(r'^name = "(.*)"\nversion = "(.*)"', lock.read_text(encoding="utf-8"), re.MULTILINE))

    assert pinned(top / "Cargo.lock") < pinned(ROOT / "Cargo.lock")
    about = (top / "PKG-INFO").read_text(encoding="utf-8")
    links = re.findall(r"\]\(([^)\s]+)\)", about)
    assert len(links) > 15 and all(link.startswith("https://") for link in links)
    assert re.search(r"!\[[^\]]*\]\(https://github\.com/[\w/-]+/raw/v[\d.]+/docs/images/climb\.gif\)", about)


def test_of_a_text_only_relative_links_get_addresses(scripts):
    with_addresses = scripts("wheel_backend").with_addresses
    kept = "[a](https://x.org/y) [b](#part) [c](mailto:a@b) `x[0](1 2)`"
    assert with_addresses(kept) == kept
    assert re.fullmatch(r"\[d\]\(https://\S+/blob/v[\d.]+/docs/d\.md#e\)", with_addresses("[d](docs/d.md#e)"))
