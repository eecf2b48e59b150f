"""Builds wheel and source as maturin does, without a path of the machine that builds them.

pip calls this (`build-backend` in pyproject.toml). Paths come in two ways: panics name source files of dependencies,
which the compiler is asked to rename; and the list of parts (CycloneDX) names this folder, which is rewritten.
PyPI shows the README where none of its relative links leads anywhere: they become addresses in the repository. The
wheel gets the licence texts of the Rust packages that are linked into it (`licences.py`). The source is without the
package at the top of the repository, so its lock file is made to fit.
"""

import gzip
import io
import json
import os
import re
import shlex
import subprocess
import sys
import tarfile
import tempfile
import tomllib
from pathlib import Path

import licences
import maturin
from build_places import ROOT, named_in, remap_flags, without_places
from maturin import (  # noqa: F401 (the other hooks of PEP 517 and 660 are maturin's own)
    build_editable,
    get_requires_for_build_editable,
    get_requires_for_build_sdist,
    get_requires_for_build_wheel,
    prepare_metadata_for_build_editable,
    prepare_metadata_for_build_wheel,
)


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    """Build the wheel into a folder; return its file name."""
    # First, because it takes seconds, and what is missing is an error.
    texts = licences.collected("wheel", target(config_settings))
    flags = remap_flags()
    # Beside what the user's configuration says; variables replace that, so where they are set the flags go there.
    if "CARGO_ENCODED_RUSTFLAGS" in os.environ:
        os.environ["CARGO_ENCODED_RUSTFLAGS"] = "\x1f".join([os.environ["CARGO_ENCODED_RUSTFLAGS"], *flags])
    elif "RUSTFLAGS" in os.environ:
        os.environ["CARGO_ENCODED_RUSTFLAGS"] = "\x1f".join([*os.environ["RUSTFLAGS"].split(), *flags])
    else:
        # Cargo joins these with its own variable, which replaces neither of those above.
        flags = [flag for flag in flags if flag not in os.environ.get("CARGO_BUILD_RUSTFLAGS", "").split()]
        config = f"build.rustflags={json.dumps(flags)}"  # a JSON list of strings is one of TOML
        config_settings = with_arguments(config_settings, ["--config", config])
    name = maturin.build_wheel(wheel_directory, config_settings, metadata_directory)
    trim(Path(wheel_directory) / name, texts)
    return name


def build_sdist(sdist_directory, config_settings=None):
    """Build the source distribution into a folder; return its file name."""
    name = maturin.build_sdist(sdist_directory, config_settings)
    complete(Path(sdist_directory) / name)
    return name


def target(config_settings) -> str:
    """The target that maturin builds for."""
    arguments = maturin.get_maturin_pep517_args(config_settings)
    for argument, following in zip(arguments, [*arguments, ""][1:], strict=True):
        if argument == "--target" or argument.startswith("--target="):
            return argument.partition("=")[2] or following
    return os.environ.get("CARGO_BUILD_TARGET") or licences.this_machine()


def with_arguments(config_settings, arguments):
    """The settings with more arguments for maturin, which reads its variable only where they hold none."""
    settings = dict(config_settings or {})
    # In front, because what follows a `--` is for the compiler.
    for key in ("maturin.build-args", "build-args"):
        if (given := settings.get(key)) is not None:
            settings[key] = [*arguments, *(shlex.split(given) if isinstance(given, str) else given)]
            return settings
    given = shlex.split(os.environ.get("MATURIN_PEP517_ARGS", ""))
    os.environ["MATURIN_PEP517_ARGS"] = shlex.join([*arguments, *given])
    return config_settings


def trim(wheel: Path, texts: str = "") -> None:
    """Rewrite the lists of parts in a wheel: no path of this machine. Refuse one whose library names any.

    `texts` are the licences of others that it contains, which become one of its licence files.
    """
    with tempfile.TemporaryDirectory() as folder:
        tool = [sys.executable, "-m", "wheel"]
        subprocess.run([*tool, "unpack", "--dest", folder, str(wheel)], check=True, stdout=subprocess.DEVNULL)
        (unpacked,) = Path(folder).iterdir()
        for library in (path for end in ("so", "pyd", "dylib") for path in unpacked.rglob(f"*.{end}")):
            if path := named_in(library.read_bytes()):
                wheel.unlink()
                sys.exit(
                    f"{library.name} names {path}: the compiler was not asked to rename it, as where Cargo's "
                    "configuration has target.*.rustflags; set RUSTFLAGS to those flags instead and build again"
                )
        for parts in unpacked.glob("*.dist-info/sboms/*.json"):
            parts.write_text(without_places(parts.read_text(encoding="utf-8")), encoding="utf-8")
        for about in unpacked.glob("*.dist-info/METADATA"):
            text = with_addresses(about.read_text(encoding="utf-8"))
            if texts:
                # Among the header's lines, behind the licence's.
                after = re.search(r"^License-Expression: .*\n", text, re.MULTILINE)
                assert after, f"{about.name} has no licence"
                text = f"{text[: after.end()]}License-File: {licences.NAME}\n{text[after.end() :]}"
                (about.parent / "licenses").mkdir(exist_ok=True)
                (about.parent / "licenses" / licences.NAME).write_text(texts, encoding="utf-8", newline="\n")
            about.write_text(text, encoding="utf-8")
        wheel.unlink()
        # The same name again, with new hashes in RECORD.
        subprocess.run(
            [*tool, "pack", "--dest-dir", str(wheel.parent), str(unpacked)], check=True, stdout=subprocess.DEVNULL
        )


def with_addresses(text: str) -> str:
    """A text of the repository with addresses instead of relative links, of the files as they are in this version."""
    package = tomllib.loads((ROOT / "Cargo.toml").read_text(encoding="utf-8"))["workspace"]["package"]
    repository, version = package["repository"], package["version"]

    def address(link: re.Match[str]) -> str:
        start, path = link.groups()
        return f"{start}{repository}/{'raw' if start.startswith('!') else 'blob'}/v{version}/{path}"

    return re.sub(r"(!?\[[^\]]*\]\()(?![a-z]+:|#|/)([^)\s]+)(?=\))", address, text)


def complete(archive: Path) -> None:
    """Put addresses into the description of a source archive, and a lock file that fits what is packed."""
    with tarfile.open(archive) as packed:
        entries = [(entry, packed.extractfile(entry)) for entry in packed]
        files = [(entry, file.read() if file else None) for entry, file in entries]
        top = files[0][0].name.partition("/")[0]
        with tempfile.TemporaryDirectory() as folder:
            packed.extractall(folder, **({"filter": "data"} if hasattr(tarfile, "data_filter") else {}))
            # Leaves out what only the package at the top needs; everything else stays as it was.
            subprocess.run(["cargo", "update", "--quiet", "--workspace"], cwd=Path(folder) / top, check=True)
            lock = (Path(folder) / top / "Cargo.lock").read_bytes()
    with io.BytesIO() as whole:
        with (
            gzip.GzipFile(fileobj=whole, mode="wb", filename="", mtime=files[0][0].mtime) as zipped,
            tarfile.open(fileobj=zipped, mode="w") as packed,
        ):
            for entry, content in files:
                if entry.name == f"{top}/Cargo.lock":
                    content = lock
                elif entry.name == f"{top}/PKG-INFO":
                    content = with_addresses(content.decode()).encode()
                entry.size = len(content or b"")
                packed.addfile(entry, io.BytesIO(content) if content is not None else None)
        archive.write_bytes(whole.getvalue())
