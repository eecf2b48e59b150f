"""The files for channels that no release has used yet: they are read, and name only what is there."""

import ast
import importlib
import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from ruamel.yaml import YAML

ROOT = Path(__file__).resolve().parents[2]
PACKAGING = ROOT / "packaging"


def toml(name):
    return tomllib.loads((ROOT / name).read_text(encoding="utf-8"))


def yaml(path):
    return YAML(typ="safe").load((ROOT / path).read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def package():
    """What Cargo.toml says of every package."""
    return toml("Cargo.toml")["workspace"]["package"]


def test_the_recipe_of_conda_asks_for_what_the_package_asks_for(package):
    recipe, project = yaml("packaging/conda/recipe.yaml"), toml("pyproject.toml")
    context, needs = recipe["context"], recipe["requirements"]
    assert context["version"] == package["version"] and recipe["about"]["license"] == package["license"]
    assert f">={context['python_min']}" == project["project"]["requires-python"]
    plain = [each.replace(" ", "") for each in needs["run"]]
    assert plain == ["python", *project["project"]["dependencies"]]
    built = [each.replace(" ", "") for each in needs["host"]]
    assert built == ["python", "pip", *project["build-system"]["requires"]]
    scripts = re.findall(r"scripts/[\w/]+\.py", " ".join(recipe["build"]["script"]))
    packed = {each["path"] for each in project["tool"]["maturin"]["include"]}
    assert scripts and packed.issuperset(scripts), "the source on PyPI has what the recipe calls"
    made = {"THIRD-PARTY.txt"}
    assert made < set(recipe["about"]["license_file"])
    assert all((ROOT / name).is_file() for name in recipe["about"]["license_file"] if name not in made)


def test_the_image_holds_the_files_of_the_programs_archive_and_runs_the_program(package):
    lines = (PACKAGING / "Dockerfile").read_text(encoding="utf-8")
    assert f":{package['version']}" in lines and "--network host" in lines
    steps = [line.split() for line in lines.splitlines() if re.match(r"[A-Z]+ ", line)]
    assert [step[0] for step in steps] == ["FROM", "LABEL", "COPY", "COPY", "WORKDIR", "USER", "ENTRYPOINT", "CMD"]
    source = ast.parse((ROOT / "scripts/release/command.py").read_text(encoding="utf-8"))
    named = [each.value for each in source.body if isinstance(each, ast.Assign) and each.targets[0].id == "PACKED"]
    in_archive = {*ast.literal_eval(named[0]), "THIRD-PARTY.txt", "omnistep"}
    for step in (step for step in steps if step[0] == "COPY"):
        assert in_archive.issuperset(step[1:-1])
    assert json.loads(steps[-2][1]) == ["/omnistep"] and json.loads(steps[-1][1]) == ["--help"]


def test_the_package_for_npm_names_files_that_its_script_puts_into_it(package):
    written = json.loads((PACKAGING / "npm/package.json").read_text(encoding="utf-8"))
    assert (written["version"], written["license"]) == (package["version"], package["license"])
    script = (ROOT / "scripts/release/npm_package.py").read_text(encoding="utf-8")
    for name in written["files"]:
        assert name in script or (name == "THIRD-PARTY.txt" and "licences.NAME" in script)
    assert {each.removeprefix("./") for each in written["exports"].values()} <= set(written["files"])
    assert "export class Engine" in (ROOT / "web/playground/engine.js").read_text(encoding="utf-8")


def test_the_container_of_contributors_is_that_of_the_workflows():
    written = json.loads((ROOT / ".devcontainer/devcontainer.json").read_text(encoding="utf-8"))
    images = {
        job["container"]["image"]
        for name in ("ci", "pages")
        for job in yaml(f".github/workflows/{name}.yml")["jobs"].values()
        if "container" in job
    }
    assert images == {written["image"]}
    assert (ROOT / written["postCreateCommand"]).is_file()


def test_the_archive_of_zenodo_and_the_citation_say_the_same(package):
    zenodo = json.loads((ROOT / ".zenodo.json").read_text(encoding="utf-8"))
    citation = yaml("CITATION.cff")
    assert zenodo["creators"] == citation["authors"] == toml("pyproject.toml")["project"]["authors"]
    assert zenodo["keywords"] == citation["keywords"]
    assert zenodo["license"] in citation["license"] and citation["license"] == package["license"].split(" OR ")


def test_the_notebook_has_every_block_of_python_of_the_tutorial_and_no_relative_link(tmp_path):
    made = subprocess.run(
        [sys.executable, ROOT / "scripts/docs/notebook.py", tmp_path], capture_output=True, text=True, check=False
    )
    assert made.returncode == 0, made.stderr
    cells = json.loads((tmp_path / "tutorial.ipynb").read_text(encoding="utf-8"))["cells"]
    code = ["".join(cell["source"]) for cell in cells if cell["cell_type"] == "code"]
    page = (ROOT / "docs/tutorial.md").read_text(encoding="utf-8")
    blocks = [block.strip("\n") for block in re.findall(r"^```python\n(.*?)^```", page, re.MULTILINE | re.DOTALL)]
    assert code[0].startswith("%pip install") and code[1:] == blocks
    text = "".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "markdown")
    links = re.findall(r"\]\(([^)\s]+)\)", text)
    assert len(links) > 10 and all(link.startswith("https://") for link in links)
    assert "```python" not in text and len({cell["id"] for cell in cells}) == len(cells)


def test_links_of_the_notebook_lead_to_the_site_and_to_the_repository():
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(ROOT / "scripts" / "docs")
        addressed = importlib.import_module("notebook").addressed
    site = "https://o.github.io/n/"
    text = "[a](x.md#y) ![b](images/b.png) [c](../LICENSE-MIT) [d](#e) [f](https://g.org/h.md)"
    assert addressed(text, "https://github.com/o/n", site) == (
        f"[a]({site}x.html#y) ![b]({site}images/b.png) [c](https://github.com/o/n/blob/main/LICENSE-MIT) "
        "[d](#e) [f](https://g.org/h.md)"
    )


def test_actions_of_workflows_are_named_by_their_hash_and_one_hash_each():
    used = {}
    for path in (ROOT / ".github/workflows").glob("*.yml"):
        for name, version in re.findall(r"uses: ([\w-]+/[\w./-]+)@(.+)", path.read_text(encoding="utf-8")):
            assert re.fullmatch(r"[0-9a-f]{40} # v\d+\.\d+\.\d+", version), (path.name, name)
            used.setdefault(name, set()).add(version)
    assert {"actions/deploy-pages", "actions/upload-pages-artifact"} <= used.keys()
    assert all(len(versions) == 1 for versions in used.values()), used
