"""Every code block of the documents does what it says; none is left out in silence."""

import contextlib
import importlib.util
import io
import json
import os
import re
import shlex
import signal
import subprocess
import sys
import tomllib
from collections import Counter
from doctest import ELLIPSIS, NORMALIZE_WHITESPACE, OutputChecker
from functools import cache
from pathlib import Path

import matplotlib.pyplot as plt
import pytest
from latex2mathml.converter import convert
from matplotlib.testing.compare import compare_images
from sybil import Document
from sybil.evaluators.python import PythonEvaluator
from sybil.parsers.markdown.lexers import RawFencedCodeBlockLexer

from omnistep._log_map import read_map

ROOT = Path(__file__).resolve().parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted(ROOT.glob("docs/*.md"))]
BLOCK = re.compile(r"(?P<kind>[\w-]*)(?P<info>[^\n]*)$\n", re.MULTILINE)
KINDS_OF_FILES = ("scenario", "vehicle", "study")

# Packages whose blocks are only compiled here: dask's is run by test_sweep_dask.py in `make test-full`, MPI's was tried
# by hand, ROS 2's launch files want an installation.
ELSEWHERE = ("dask", "mpi4py", "launch")

# Commands of minutes, and of an image that `make firmware` builds and runs: here their options are looked up.
LONG = ("study climb_map", "--duration 600", "--controller qemu")


@cache
def documents():
    """The script that knows what the repository has."""
    spec = importlib.util.spec_from_file_location("check_documents", ROOT / "scripts/checks/documents.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def omnistep(*arguments):
    """The command line: its exit code, and what it says on standard output and on standard error."""
    command = [sys.executable, "-m", "omnistep", *arguments]
    if arguments[:1] == ("drive",) or "--ros2" in arguments:
        return interrupted(command)
    done = subprocess.run(command, capture_output=True, text=True)
    return done.returncode, done.stdout, done.stderr


def interrupted(command):
    """The same of a command that goes on until Ctrl-C, which it gets as soon as it says where it is."""
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=pipe, stderr=pipe, text=True) as run:
        lines = []
        while (line := run.stderr.readline()) and "Ctrl-C ends it" not in line:
            lines.append(line)
        run.send_signal(signal.SIGINT)
        out, err = run.communicate()
        return run.returncode, out, "".join(lines) + line + err


@cache
def help_of(command):
    return omnistep(command, "--help")[1]


def python_block(example, info):
    if '__name__ == "__main__"' in example.parsed or "def generate_launch_description()" in example.parsed:
        program(example, info)
        return
    said = io.StringIO()
    # As fine as scripts/docs/figures.py draws the documents' pictures.
    with contextlib.redirect_stdout(said), plt.rc_context({"savefig.dpi": 90}):
        PythonEvaluator()(example)
    example.namespace["said"] = said.getvalue()
    plt.close("all")
    # A picture under the name of one that the documents show is that one.
    for shown in sorted((ROOT / "docs" / "images").glob("*.png")):
        drawn = Path(shown.name)
        if drawn.is_file():
            # compare_images leaves its findings beside what it compares; the tolerance is test_plot_images.py's.
            expected = Path(f"shown-{shown.name}")
            expected.write_bytes(shown.read_bytes())
            found = compare_images(expected, drawn, tol=0.3)
            assert found is None, found
            drawn.unlink()


def program(example, info):
    """A block that is a file of its own: what starts processes has to be."""
    path = Path(title[1] if (title := re.search(r'title="([^"]+)"', info)) else "block.py")
    path.write_text(example.parsed)
    compile(example.parsed, str(path), "exec")
    if any(f"from {package}" in example.parsed for package in ELSEWHERE):
        return
    done = subprocess.run([sys.executable, "-W", "error", str(path)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    example.namespace["said"] = done.stdout


def sh_block(example, info):
    lines = [line for line in example.parsed.replace("\\\n", " ").splitlines() if line.strip()]
    assert lines
    said = ""
    for line in lines:
        command = shlex.split(line, comments=True)
        if command[:1] != ["omnistep"] or any(long in line for long in LONG):
            assert documents().command_findings(line) == []
            if command[:3] == ["cargo", "run", "--release"] and "--" in command:
                command = command[command.index("--") :]
            if command[:1] in (["--"], ["omnistep"]):
                flags = [word for word in command[1:] if word.startswith("--")]
                assert [flag for flag in flags if flag not in help_of(command[1])] == [], line
            continue
        target = command[command.index(">") + 1] if ">" in command else None
        code, out, err = omnistep(*command[1 : command.index(">") if target else None])
        assert code == 0, f"{line}: {err}"
        if target:
            Path(target).write_text(out)
        else:
            said += out
    example.namespace["said"] = said


def toml_value(value):
    """A value as TOML writes it."""
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{json.dumps(key)} = {toml_value(each)}" for key, each in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(toml_value(each) for each in value) + "]"
    return json.dumps(value)


def merged(base, fragment):
    """A file with a fragment put into it: tables key by key, unless they are of another kind; lists of tables grow."""
    if isinstance(base, dict) and isinstance(fragment, dict):
        if base.get("kind") != fragment.get("kind", base.get("kind")):
            return fragment
        return base | {key: merged(base.get(key), value) for key, value in fragment.items()}
    if isinstance(base, list) and base and isinstance(base[0], dict):
        return base + fragment
    return fragment


@cache
def keys_of(kind):
    return set(json.loads(omnistep("schema", kind)[1])["properties"])


@cache
def started(kind):
    """The file that `omnistep new KIND` writes."""
    assert omnistep("new", kind, f"new_{kind}")[0] == 0
    path = Path(f"new_{kind}.toml")
    text = path.read_text()
    path.unlink()
    return tomllib.loads(text)


def toml_block(example, info):
    fragment = tomllib.loads(example.parsed)
    if all(isinstance(value, dict) and "path" in value for value in fragment.values()):  # of a Cargo.toml
        for value in fragment.values():
            assert (ROOT / value["path"].removeprefix("../omnistep/")).is_dir()
        return
    if title := re.search(r'title="([^"]+)"', info):
        Path(title[1]).write_text(example.parsed)
    if "wheels" in fragment and "period_s" in fragment:  # the map of a foreign log
        read_map(title[1])
        return
    kinds = [kind for kind in KINDS_OF_FILES if set(fragment) <= keys_of(kind)]
    errors = [f"{sorted(fragment)}: keys of {kinds or 'no kind of file'}"]
    for kind in kinds:
        whole = fragment if "schema_version" in fragment else merged(started(kind), fragment)
        Path("block.toml").write_text("".join(f"{key} = {toml_value(value)}\n" for key, value in whole.items()))
        code, _, err = omnistep("check", "block.toml")
        if code == 0:
            return
        errors.append(err)
    raise AssertionError("\n".join(errors))


def text_block(example, info):
    if 'title="output"' in info:
        checker, flags = OutputChecker(), ELLIPSIS | NORMALIZE_WHITESPACE
        said = example.namespace["said"]
        assert checker.check_output(example.parsed, said, flags), f"said:\n{said}\nprinted:\n{example.parsed}"


def math_block(example, info):
    drawn = convert(example.parsed)
    assert "\\" not in drawn and "merror" not in drawn, drawn


def rust_block(example, info):
    # Where a page is a crate's documentation, the compiler runs them; here are pieces of firmware.
    assert documents().rust_findings(example.parsed) == []


def compiles(compiler, file):
    # With the constants that the page wrote, else of a scenario that has a [drive]; firmware/c/example is what runs.
    if not Path("constants.h").exists():
        code, constants, err = omnistep("export", "flat", "--format", "c", "--set", "drive.command_timeout_s=0.2")
        assert code == 0, err
        Path("constants.h").write_text(constants)
    flags = ["-Wall", "-Wextra", "-Werror", "-fsyntax-only", "-I.", f"-I{ROOT / 'firmware/c/include'}"]
    done = subprocess.run([*compiler, *flags, file], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def c_block(example, info):
    Path("block.c").write_text(example.parsed)
    compiles([os.environ.get("CC", "cc"), "-std=c11"], "block.c")


def cpp_block(example, info):
    # A file that others include, or a program.
    file = title[1] if (title := re.search(r'title="([^"]+)"', info)) else "block.cpp"
    Path(file).write_text(example.parsed)
    Path("unit.cpp").write_text(f'#include "{file}"\n')
    compiles([os.environ.get("CXX", "c++"), "-std=c++17", "-Wpedantic"], "unit.cpp")


def cmake_block(example, info):
    # `make cpp` builds it.
    assert example.parsed == (ROOT / "firmware/c/example/cpp/CMakeLists.txt").read_text()


RUNNERS = {
    "python": python_block,
    "sh": sh_block,
    "toml": toml_block,
    "text": text_block,  # drawings; with title="output" what the block before it prints
    "math": math_block,
    "rust": rust_block,
    "c": c_block,
    "cpp": cpp_block,
    "cmake": cmake_block,
}


def blocks(document):
    for region in RawFencedCodeBlockLexer(BLOCK)(document):
        region.parsed = region.lexemes["source"]
        runner = RUNNERS.get(region.lexemes["kind"])
        region.evaluator = runner and (lambda example, run=runner, info=region.lexemes["info"]: run(example, info))
        yield region


@pytest.mark.parametrize("path", PAGES, ids=[str(path.relative_to(ROOT)) for path in PAGES])
def test_every_block_of_a_page_does_what_it_says(path, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    document = Document.parse(str(path), blocks)
    for example in document:
        try:
            example.evaluate()
        except Exception as error:
            error.add_note(f"in the block at {path.relative_to(ROOT)}:{example.line}")
            raise


def test_the_programs_of_three_wheels_are_those_that_run_in_an_emulator():
    page = (ROOT / "docs" / "three-wheels.md").read_text()
    for kind, file in (("rust", "firmware/src/three.rs"), ("c", "firmware/c/example/three.c")):
        shown = re.findall(rf"```{kind} title=\"[^\"]+\"\n(.*?)```", page, re.DOTALL)
        assert shown == [(ROOT / file).read_text()], file
    scenario = re.findall(r"```toml title=\"base.toml\"\n(.*?)```", page, re.DOTALL)
    of_the_image = tomllib.loads((ROOT / "firmware/scenarios/three.toml").read_text())
    assert tomllib.loads(scenario[0]) | {"name": "three"} == of_the_image


def test_pieces_of_the_program_of_four_mecanum_wheels_are_its_own():
    file = "crates/omni-core/examples/mecanum_traction.rs"
    program, shown = (ROOT / file).read_text(), 0
    for page in PAGES:
        for piece in re.findall(rf"```rust title=\"{file}\"\n(.*?)```", page.read_text(), re.DOTALL):
            assert piece in program, page.name
            shown += 1
    assert shown == 3
    page = (ROOT / "docs" / "mecanum-in-20-minutes.md").read_text()
    shown_in_c = re.findall(r"```c title=\"mecanum.c\"\n(.*?)```", page, re.DOTALL)
    assert shown_in_c == [(ROOT / "firmware/c/example/mecanum.c").read_text()]
    scenario = re.findall(r"```toml title=\"control.toml\"\n(.*?)```", page, re.DOTALL)
    of_the_image = tomllib.loads((ROOT / "firmware/scenarios/mecanum.toml").read_text())
    assert tomllib.loads(scenario[0]) | {"name": "mecanum", "vehicle": "mecanum4"} == of_the_image


def test_the_first_program_in_cpp_is_the_one_that_is_built_and_run():
    page = (ROOT / "docs" / "cpp.md").read_text()
    shown = dict(re.findall(r"```\w+ title=\"([^\"]+)\"\n(.*?)```", page, re.DOTALL))
    example = ROOT / "firmware/c/example/cpp"
    assert shown == {path.name: path.read_text() for path in example.iterdir()}


def test_a_picture_below_a_block_is_one_that_the_block_saves():
    saved = 0
    for path in PAGES:
        for block, name in re.findall(
            r"```python[^\n]*\n((?:(?!```).)*)```\n\n!\[[^]]*\]\(.*?([\w-]+\.png)\)", path.read_text(), re.DOTALL
        ):
            assert f'savefig("{name}")' in block, f"{path.name}: {name}"
            saved += 1
    assert saved >= 3  # of the tutorial


def test_the_readme_is_short_and_its_table_is_what_the_first_command_prints(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = (ROOT / "README.md").read_text()
    assert len(text.splitlines()) <= 100
    code, said, err = omnistep("compare", "step", "--quiet")
    assert code == 0, err
    printed = {}
    for table in said.split("\n\n"):  # one below the other
        rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines() if line[:1] == "|"]
        policies = rows[0][1:]
        printed |= {(row[0], policy): cell for row in rows for policy, cell in zip(policies, row[1:], strict=True)}
    shown = re.findall(r"^\| ([^|]+) \| ([\d.]+) \| ([\d.]+) \|$", text, re.MULTILINE)
    assert len(shown) == 3
    for row, independent, traction in shown:
        assert (independent, traction) == (printed[row, "independent"], printed[row, "traction"]), row
    for _, block in re.findall(r"```(\w+)\n(.*?)```", text, re.DOTALL):
        assert max(map(len, block.splitlines())) <= 80, block


def test_no_block_is_left_out():
    counts = Counter()
    for path in PAGES:
        document = Document.parse(str(path), blocks)
        found = Counter(region.lexemes["kind"] for _, region in document.regions)
        fences = len(re.findall(r"^ *(?:```|~~~)", document.text, re.MULTILINE))
        assert 2 * found.total() == fences, path
        counts += found
    assert set(counts) == set(RUNNERS), "a kind of block that nothing runs, or a runner without a block"


@pytest.mark.parametrize(
    ("kind", "info", "text"),
    [
        ("python", "", "assert 1 + 1 == 3\n"),
        # Three vehicles where the picture has four.
        ("python", "", 'import omnistep as o; o.plot.side_view(o.run(), every_s=0.9).figure.savefig("climb.png")\n'),
        ("sh", "", "omnistep run nowhere\n"),
        ("sh", "", "make nothing\n"),
        ("sh", "", "curl https://example.org\n"),
        ("sh", "", "cargo run --release -- run step --fly\n"),
        ("toml", "", "[[fault]]\nkind = 'wheel_lost'\nwheel = '9'\nfrom_s = 1.0\n"),
        ("toml", "", "[no_such_table]\nkey = 1\n"),
        ("toml", "", "omni-core = { path = '../omnistep/crates/nothing' }\n"),
        ("text", ' title="output"', "something else\n"),
        ("rust", "", "omni_config::Scenario::fly();\n"),
        ("c", "", '#include "constants.h"\nvoid fly(void) { omni7_drive_fly(&OMNI_DRIVE); }\n'),
        ("cpp", "", '#include "omnistep.hpp"\nvoid f(omnistep::Drive<9>& d) { d.reset(); }\n'),
        ("cpp", ' title="a.hpp"', '#include "omnistep.hpp"\ninline void f(omnistep::Drive<7>& d) { d.halt(); }\n'),
        ("cmake", "", "find_package(omnistep 0.2 REQUIRED)\n"),
        ("math", "", "\\nosuchcommand{x}\n"),
    ],
)
def test_a_wrong_block_is_noticed(kind, info, text, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    page = tmp_path / "page.md"
    page.write_text(f"```python\nprint(1)\n```\n\n```{kind}{info}\n{text}```\n")
    right, wrong = Document.parse(str(page), blocks)
    right.evaluate()
    with pytest.raises(Exception):  # noqa: B017 - whatever it is, the page fails
        wrong.evaluate()
