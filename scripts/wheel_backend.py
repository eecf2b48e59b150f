"""Builds the wheel as maturin does, without a path of the machine that builds it.

pip calls this (`build-backend` in pyproject.toml). Paths come in two ways: panics name source files of dependencies,
which the compiler is told to call otherwise; and the list of parts (CycloneDX) names this folder, which is rewritten.
"""

import json
import os
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

import maturin
from build_places import named_in, remap_flags, without_places
from maturin import (  # noqa: F401 (the other hooks of PEP 517 and 660 are maturin's own)
    build_editable,
    build_sdist,
    get_requires_for_build_editable,
    get_requires_for_build_sdist,
    get_requires_for_build_wheel,
    prepare_metadata_for_build_editable,
    prepare_metadata_for_build_wheel,
)


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    """Build the wheel into a folder; return its file name."""
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
    trim(Path(wheel_directory) / name)
    return name


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


def trim(wheel: Path) -> None:
    """Rewrite the lists of parts in a wheel: no path of this machine. Refuse one whose library names any."""
    with tempfile.TemporaryDirectory() as folder:
        tool = [sys.executable, "-m", "wheel"]
        subprocess.run([*tool, "unpack", "--dest", folder, str(wheel)], check=True, stdout=subprocess.DEVNULL)
        (unpacked,) = Path(folder).iterdir()
        for library in (path for end in ("so", "pyd", "dylib") for path in unpacked.rglob(f"*.{end}")):
            if path := named_in(library.read_bytes()):
                wheel.unlink()
                sys.exit(
                    f"{library.name} names {path}: the compiler was not told to rename it, as where Cargo's "
                    "configuration has target.*.rustflags; set RUSTFLAGS to those flags instead and build again"
                )
        for parts in unpacked.glob("*.dist-info/sboms/*.json"):
            parts.write_text(without_places(parts.read_text(encoding="utf-8")), encoding="utf-8")
        wheel.unlink()
        # The same name again, with new hashes in RECORD.
        subprocess.run(
            [*tool, "pack", "--dest-dir", str(wheel.parent), str(unpacked)], check=True, stdout=subprocess.DEVNULL
        )
