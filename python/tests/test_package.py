"""The package as others meet it: typed, one command line, logs that foreign readers open."""

import importlib
import json
import os
import re
import subprocess
import sys
import tarfile
import tomllib
import venv
import zipfile
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

import omnistep

ROOT = Path(__file__).resolve().parents[2]


def command(*args):
    return subprocess.run(args, capture_output=True, text=True, check=False, cwd="/")


def test_the_console_script_is_the_same_command_line():
    script = command(str(Path(sys.executable).with_name("omnistep")), "list")
    module = command(sys.executable, "-m", "omnistep", "list")
    assert script.returncode == module.returncode == 0
    assert script.stdout == module.stdout
    assert all(
        name in script.stdout
        for name in omnistep.list_policies() + omnistep.list_scenarios() + omnistep.list_vehicles()
    )
    wrong = command(sys.executable, "-m", "omnistep", "run", "stairway")
    assert (wrong.returncode, wrong.stdout) == (2, "")
    assert wrong.stderr.startswith('error: unknown scenario "stairway"')


def test_without_matplotlib_all_but_the_plots_works_and_they_say_what_to_install():
    program = """
import sys
sys.modules["matplotlib"] = None
import omnistep
trace = omnistep.run("flat", overrides={"duration_s": 0.01})
bench = lambda _: omnistep.plot.motor_bench(omnistep.run_motor_bench())
for plot in (omnistep.plot.climb, omnistep.plot.side_view, bench):
    try:
        plot(trace)
    except ImportError as error:
        assert 'pip install "omnistep[plot]"' in str(error), error
    else:
        raise AssertionError(plot)
"""
    checked = command(sys.executable, "-c", program)
    assert checked.returncode == 0, checked.stderr


def test_the_stub_says_what_the_module_has():
    checked = command(sys.executable, "-m", "mypy.stubtest", "omnistep", "--concise")
    assert checked.returncode == 0, checked.stdout + checked.stderr


@pytest.mark.parametrize("policy", ["independent", "scale_torques", "scale_references", "shared_integral"])
def test_a_log_opens_in_mcap_with_crcs_and_in_rosbags(policy, tmp_path):
    log = tmp_path / "run.mcap"
    trace = omnistep.run("step", policy=policy, mcap=log, overrides={"duration_s": 2.0})
    checked = command(sys.executable, str(ROOT / "scripts/checks/log.py"), str(log))
    assert checked.returncode == 0, checked.stdout + checked.stderr
    assert "run.mcap: ok" in checked.stdout

    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    with log.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        states = [message for *_, message in reader.iter_decoded_messages(topics=["/vehicle_state"])]
    assert len(states) == len(trace) == 2000
    applied = trace.wheels("applied_n_m")
    assert all([w.applied_n_m for w in state.wheels] == list(row) for state, row in zip(states, applied, strict=True))
    assert {state.policy for state in states} == {policy}


@pytest.fixture(scope="module")
def wheel():
    """The file that scripts/tools/venv.sh built, of which the installed package was made."""
    (wheel,) = (ROOT / "out" / "wheel").glob("omnistep-*.whl")
    return wheel


def test_the_wheel_fits_every_python_from_3_11_on_with_types_licences_and_no_tests(wheel):
    assert "-cp311-abi3-" in wheel.name
    names = zipfile.ZipFile(wheel).namelist()
    inside = {name.split("/", 1)[1] for name in names if name.startswith("omnistep/")}
    assert {"py.typed", "_omnistep.pyi", "_omnistep.abi3.so"} <= inside
    assert {f"assets/{name}" for name in ("player.js", "plots.js", "report.css", "report.js")} <= inside
    assert {"LICENSE-MIT", "LICENSE-APACHE"} <= {Path(name).name for name in names}
    assert not [name for name in names if "test" in name or "baseline" in name]


def test_every_link_of_the_wheels_description_is_an_address(wheel):
    with zipfile.ZipFile(wheel) as archive:
        (about,) = (archive.read(name).decode() for name in archive.namelist() if name.endswith(".dist-info/METADATA"))
    links = re.findall(r"\]\(([^)\s]+)\)", about)
    assert len(links) > 15 and all(link.startswith("https://") for link in links)


@pytest.fixture(scope="module")
def backend():
    """What pip builds the wheel with."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(ROOT / "scripts" / "release")  # as pip does: `backend-path` in pyproject.toml
        return importlib.import_module("wheel_backend")


@pytest.fixture(scope="module")
def build_places(backend):
    """The module that knows the folders of this machine."""
    return importlib.import_module(backend.named_in.__module__)


def test_the_wheel_names_no_path_of_the_machine_that_built_it(wheel, build_places):
    named = [path.encode() for path in build_places.places()]
    assert str(ROOT).encode() in named and str(Path.home()).encode() in named
    with zipfile.ZipFile(wheel) as archive:
        found = {
            (name, path.decode(), archive.read(name).count(path + b"/"))
            for name in archive.namelist()
            for path in named
            if path + b"/" in archive.read(name)
        }
    assert not found


@pytest.mark.parametrize("key", [None, "build-args", "maturin.build-args"])
def test_the_compiler_renames_paths_wherever_maturin_takes_its_arguments_from(key, backend, monkeypatch):
    import maturin

    monkeypatch.setenv("MATURIN_PEP517_ARGS", "--locked -- -v" if key is None else "--of-nothing")
    settings = backend.with_arguments(key and {key: "--locked -- -v"}, ["--config", "a b"])
    assert maturin.get_maturin_pep517_args(settings) == ["--config", "a b", "--locked", "--", "-v"]


@pytest.mark.parametrize("variable", [None, "RUSTFLAGS", "CARGO_ENCODED_RUSTFLAGS"])
def test_paths_are_renamed_once_whichever_variable_cargo_reads_its_flags_from(variable, backend, monkeypatch, tmp_path):
    flags = backend.remap_flags()
    for name in ("RUSTFLAGS", "CARGO_ENCODED_RUSTFLAGS", "MATURIN_PEP517_ARGS"):
        monkeypatch.setenv(name, "")  # so that it is as it was after the test
        monkeypatch.delenv(name)
    monkeypatch.setenv("CARGO_BUILD_RUSTFLAGS", " ".join(flags))  # as in CI; either of the other two replaces it
    if variable:
        monkeypatch.setenv(variable, "-Dwarnings")
    monkeypatch.setattr(backend.maturin, "build_wheel", lambda *_: "x.whl")
    monkeypatch.setattr(backend, "trim", lambda *_: None)
    assert backend.build_wheel(str(tmp_path)) == "x.whl"
    if variable:
        assert os.environ["CARGO_ENCODED_RUSTFLAGS"].split("\x1f") == ["-Dwarnings", *flags]
    else:
        assert os.environ["MATURIN_PEP517_ARGS"] == "--config 'build.rustflags=[]'"


def test_a_wheel_whose_library_names_a_path_of_this_machine_is_refused_in_one_line(tmp_path, backend):
    about = tmp_path / "x-1" / "x-1.dist-info"
    about.mkdir(parents=True)
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: x\nVersion: 1\n")
    (about / "WHEEL").write_text("Wheel-Version: 1.0\nRoot-Is-Purelib: false\nTag: py3-none-any\n")
    (about / "RECORD").write_text("")
    wheel = tmp_path / "x-1-py3-none-any.whl"
    for inside, refused in ((b"/omnistep/crates/x.rs", False), (f"\0{ROOT}/crates/x.rs".encode(), True)):
        (tmp_path / "x-1" / "x.so").write_bytes(inside)
        packed = command(sys.executable, "-m", "wheel", "pack", "--dest-dir", str(tmp_path), str(tmp_path / "x-1"))
        assert packed.returncode == 0, packed.stderr
        if refused:
            with pytest.raises(SystemExit, match=rf"^x\.so names {re.escape(str(ROOT))}: .* set RUSTFLAGS .*$"):
                backend.trim(wheel)
        else:
            backend.trim(wheel)
        assert wheel.exists() != refused


def test_a_path_of_this_machine_is_found_in_a_file_a_wheel_and_an_archive(tmp_path, build_places, capsys):
    listing = tmp_path / "parts.cdx.json"
    for text, refused in (
        (f"path+file://{ROOT}/crates/omni-core", True),
        ("path+file:///omnistep/crates/omni-core", False),
    ):
        listing.write_text(text)
        with tarfile.open(tmp_path / "x.tar.gz", "w:gz") as archive:
            archive.add(listing, "x/parts.cdx.json")
        with zipfile.ZipFile(tmp_path / "x.whl", "w") as archive:
            archive.write(listing, "x.dist-info/sboms/parts.cdx.json")
        packed = [str(listing), str(tmp_path / "x.tar.gz"), str(tmp_path / "x.whl")]
        if not refused:
            build_places.check(packed)
            assert capsys.readouterr().out == "no path of this machine in 3 files (3 with their contents)\n"
            continue
        with pytest.raises(SystemExit) as said:
            build_places.check(packed)
        inside = ("parts.cdx.json", "x.tar.gz: x/parts.cdx.json", "x.whl: x.dist-info/sboms/parts.cdx.json")
        assert said.value.code == "\n".join(f"{name} contains the path {ROOT}" for name in inside)
        assert build_places.without_places(text) == "path+file:///omnistep/crates/omni-core"


def test_a_folder_is_found_where_it_stands_alone_and_not_in_the_name_of_another(build_places, monkeypatch, tmp_path):
    top = str(ROOT)
    for text in (f'"path":"file://{top}"', f"path+file://{top}#0.1.0", f"{top}\0", f"{top}/src", f"{top}:1"):
        assert build_places.named_in(text.encode()) == top, text
        assert top not in build_places.without_places(text), text
    for text in (f"{top}2/x", f"{top}-copy", f"{top}.old/x"):
        assert build_places.named_in(text.encode()) != top, text
    monkeypatch.setattr(Path, "home", lambda: tmp_path / "u")
    assert build_places.without_places(f"{tmp_path}/u/x {tmp_path}/user2/x") == "/home" + f"/x {tmp_path}/user2/x"
    # Cargo takes a relative folder from the top of the repository, wherever it is called.
    monkeypatch.setenv("CARGO_TARGET_DIR", "elsewhere")
    monkeypatch.chdir(tmp_path)
    assert str(ROOT / "elsewhere") in build_places.places()


def test_the_wheel_lists_its_rust_parts_with_versions_licences_and_hashes(wheel):
    with zipfile.ZipFile(wheel) as archive:
        (name,) = [name for name in archive.namelist() if ".dist-info/sboms/" in name]
        parts = json.loads(archive.read(name))
    assert parts["bomFormat"] == "CycloneDX"
    lock = tomllib.loads((ROOT / "Cargo.lock").read_text())["package"]
    locked = {(package["name"], package["version"]): package.get("checksum") for package in lock}
    of_others = {}
    for part in parts["components"]:
        key = part["name"], part["version"]
        assert key in locked and part["licenses"], key
        if locked[key]:  # from a registry
            of_others[part["name"]] = part
            assert [known["content"] for known in part["hashes"]] == [locked[key]], key
    assert {"pyo3", "rapier3d-f64", "mcap", "foxglove", "parquet"} <= of_others.keys()


def test_the_wheel_holds_the_licence_text_of_every_linked_rust_package(wheel, backend):
    with zipfile.ZipFile(wheel) as archive:
        (name,) = [name for name in archive.namelist() if name.endswith(".dist-info/licenses/THIRD-PARTY.txt")]
        text = archive.read(name).decode()
        (about,) = (archive.read(name).decode() for name in archive.namelist() if name.endswith(".dist-info/METADATA"))
    assert "License-File: THIRD-PARTY.txt" in about.partition("\n\n")[0].splitlines()
    licences = backend.licences
    packages = licences.linked("wheel", licences.this_machine())
    assert {"mcap", "nalgebra", "parquet", "pyo3", "rapier3d-f64", "zstd-sys"} <= {each.name for each in packages}
    for each in packages:
        assert f"\n{each.name} {each.version} ({each.licence}): " in text
    # Of the packages, and of the sources in C that one of them contains; not the other licence of these.
    assert text.count("Apache License") > 1 and "Meta Platforms" in text and "GNU GENERAL PUBLIC" not in text


@pytest.mark.parametrize("words", [["--target", "x"], ["--locked", "--target=x"]])
def test_licences_are_those_of_the_target_that_maturin_builds_for(words, backend, monkeypatch):
    monkeypatch.setenv("MATURIN_PEP517_ARGS", " ".join(words))
    monkeypatch.delenv("CARGO_BUILD_TARGET", raising=False)
    assert backend.target(None) == "x"
    monkeypatch.setenv("MATURIN_PEP517_ARGS", "--locked")
    assert backend.target(None) == backend.licences.this_machine()
    assert backend.target({"build-args": "--target y"}) == "y"


@pytest.mark.parametrize("extra", ["test", "docs"])
def test_the_lock_holds_every_tool_within_the_range_of_pyproject_and_by_hash(extra):
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    wanted = project["build-system"]["requires"] + project["project"]["dependencies"]
    wanted += project["project"]["optional-dependencies"][extra]
    text = (ROOT / "python" / f"requirements-{extra}.txt").read_text()
    entries = re.findall(r"^(\S+)==(\S+)((?: \\\n    --hash=sha256:[0-9a-f]{64})+)$", text, re.MULTILINE)
    assert len(entries) == len(re.findall(r"^\S", text, re.MULTILINE)), "every entry has a version and hashes"
    locked = {canonicalize_name(name): version for name, version, _ in entries}
    linux = {"python_version": "3.11", "sys_platform": "linux", "platform_machine": "x86_64"}
    for requirement in map(Requirement, wanted):
        if requirement.marker is None or requirement.marker.evaluate(linux):
            version = locked.get(canonicalize_name(requirement.name))
            assert version is not None and requirement.specifier.contains(version), str(requirement)


def test_the_wheel_works_in_a_clean_environment_with_numpy_and_tqdm_alone(wheel, tmp_path):
    venv.create(tmp_path / "venv", with_pip=True)
    python = tmp_path / "venv" / "bin" / "python"

    def clean(*args):
        # -I: neither this folder nor the environment of the test run.
        return subprocess.run([python, "-I", *args], capture_output=True, text=True, check=False, cwd=tmp_path)

    installed = clean("-m", "pip", "install", "--quiet", "--disable-pip-version-check", str(wheel))
    assert installed.returncode == 0, installed.stderr
    listed = json.loads(clean("-m", "pip", "list", "--format", "json").stdout)
    assert {package["name"] for package in listed} - {"pip", "setuptools"} == {"numpy", "omnistep", "tqdm"}
    program = """
import pathlib, omnistep
assert "venv" in pathlib.Path(omnistep.__file__).parts
trace = omnistep.run("step", mcap="step.mcap")
log = omnistep.read_mcap("step.mcap")
assert (log.trace.wheels("applied_n_m") == trace.wheels("applied_n_m")).all()
print(trace.outcome.verdict)
"""
    ran = clean("-c", program)
    assert (ran.returncode, ran.stdout) == (0, "climbed\n"), ran.stderr
    listed = subprocess.run(
        [python.with_name("omnistep"), "list"], capture_output=True, text=True, check=False, cwd=tmp_path
    )
    assert listed.returncode == 0 and "chugo7" in listed.stdout
