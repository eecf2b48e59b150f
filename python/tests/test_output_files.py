"""Files that commands write: complete or not at all, and in place of nothing else."""

import os
import resource
import stat
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import omnistep

#: A picture for a height map.
PICTURE = Path(__file__).parents[2] / "crates/omni-config/assets/pictures/hills.png"
MAP = 'schema_version = 1\nvehicle = "own.toml"\nperiod_s = 0.001\n[time]\ncolumn = "time_s"\n[wheels]\n'
#: Each command that writes a file, but for its `-o`.
COMMANDS = {
    "import": ["import", "drive.csv", "--map", "map.toml"],
    "report": ["report", "run.mcap"],
    "plot": ["plot", "run.mcap"],
    "import by a scenario": ["import", "drive.csv", "--map", "by_scenario.toml"],
    "resimulate": ["resimulate", "run.mcap", "--scenario", "own_run.toml"],
    "resimulate with hills": ["resimulate", "run.mcap", "--scenario", "hilly.toml", "--set", "vehicle=chugo.toml"],
    "identify": ["identify", "drive.csv", "--vehicle", "own.toml", "--fix", "wheel_inertia_kg_m2=0.0035"],
    "calibrate": ["calibrate", "runs.toml", "--vehicle", "own.toml"],
    "export": ["export", "own.toml", "--format", "urdf"],
}
#: What it reads, and the extension of what it writes.
READS = {
    "import": (["drive.csv", "map.toml", "own.toml"], ".mcap"),
    "report": (["run.mcap"], ".html"),
    "plot": (["run.mcap"], ".png"),
    "import by a scenario": (
        ["drive.csv", "by_scenario.toml", "named.toml", "own.toml", "named.png", "named.csv"],
        ".mcap",
    ),
    "resimulate": (["run.mcap", "own_run.toml"], ".png"),
    "resimulate with hills": (["run.mcap", "hilly.toml", "chugo.toml", "named.png"], ".png"),
    "identify": (["drive.csv", "own.toml"], ".toml"),
    "calibrate": (["runs.toml", "own.toml", "drive.csv"], ".toml"),
    "export": (["own.toml"], ".urdf"),
}


@pytest.fixture(scope="module")
def drawn(tmp_path_factory, curve):
    """A folder with what the commands read."""
    folder = tmp_path_factory.mktemp("drawn")
    names = [f"wheel_{name}_measured_rad_s" for name in curve.wheel_names]
    columns = ["time_s", *names, *(f"wheel_{name}_torque_n_m" for name in curve.wheel_names)]
    rows = np.stack([curve[name] for name in columns], axis=1)
    np.savetxt(folder / "drive.csv", rows, delimiter=",", header=",".join(columns), comments="")
    (folder / "own.toml").write_text(omnistep.Vehicle("omni3").to_toml())
    (folder / "map.toml").write_text(MAP + f"names = {names!r}\n".replace("'", '"'))
    (folder / "runs.toml").write_text('[[run]]\nlog = "drive.csv"\ndistance_m = 0.5\n')
    omnistep.run("step", overrides={"duration_s": 0.2}, mcap=folder / "run.mcap")
    (folder / "own_run.toml").write_text(
        'schema_version = 1\nname = "own"\nvehicle = "chugo7"\nduration_s = 0.2\n'
        '[terrain]\nkind = "flat"\nfriction = 0.7\n[command]\nvx_m_s = 0.1\n'
    )
    # Scenarios that name other files: a vehicle, a height map, a table of commands.
    (folder / "chugo.toml").write_text(omnistep.Vehicle("chugo7").to_toml())
    (folder / "named.png").write_bytes(PICTURE.read_bytes())
    (folder / "named.csv").write_text("time_s,vx_m_s,vy_m_s,wz_rad_s\n0,0.1,0,0\n1,0.1,0,0\n")
    for name, vehicle, command in (
        ("named.toml", "own.toml", 'file = "named.csv"'),
        ("hilly.toml", "omni3", "vx_m_s = 0.1"),
    ):
        (folder / name).write_text(
            f'schema_version = 1\nname = "hilly"\nvehicle = "{vehicle}"\nduration_s = 0.2\n'
            '[terrain]\nkind = "height_map"\nfriction = 0.7\nimage = "named.png"\npixel_m = 0.015\n'
            f"black_height_m = 0.0\nwhite_height_m = 0.08\nstart_x_m = 0.7\n[command]\n{command}\n"
        )
    by_scenario = MAP.replace('vehicle = "own.toml"', 'scenario = "named.toml"')
    (folder / "by_scenario.toml").write_text(by_scenario + f"names = {names!r}\n".replace("'", '"'))
    return folder


def _command(folder, *arguments, **options):
    done = subprocess.run(
        [sys.executable, "-m", "omnistep", *arguments], cwd=folder, capture_output=True, text=True, **options
    )
    return done.returncode, done.stdout, done.stderr


@pytest.mark.parametrize("command", COMMANDS)
def test_no_command_writes_over_what_it_reads(drawn, command):
    for name in READS[command][0]:
        before = (drawn / name).read_bytes()
        link = drawn / f"link{READS[command][1]}"
        link.symlink_to(name)
        # By its own name a picture is refused for its extension already.
        for out in (name, f"../{drawn.name}/{name}", link.name):
            code, _, err = _command(drawn, *COMMANDS[command], "-o", out)
            assert code == 2 and err.count("\n") == 1, (out, err)
            assert "this command reads this file, allowed: another name" in err or "extension" in err or "'" in err, err
        assert "this command reads this file" in err
        assert (drawn / name).read_bytes() == before and link.is_symlink()
        link.unlink()


@pytest.mark.parametrize("command", COMMANDS)
def test_what_is_no_regular_file_stays_what_it_is(drawn, command):
    extension = READS[command][1]
    folder, pipe, link = (drawn / f"{name}{extension}" for name in ("folder", "pipe", "link"))
    folder.mkdir()
    os.mkfifo(pipe)
    link.symlink_to("/dev/full")
    outs = [folder, link] if extension in (".html", ".toml", ".urdf") else [folder, pipe, link]
    try:
        for out in outs:
            kind = out.lstat().st_mode
            code, _, err = _command(drawn, *COMMANDS[command], "-o", out.name)
            assert code in (1, 2) and err.count("\n") == 1, err
            # A text is written into a device: this one is full, where a drive of two seconds tells parameters.
            full = command in ("report", "export", "calibrate") and out is link
            assert ("No space left on device" if full else "allowed: ") in err, err
            assert out.lstat().st_mode == kind and stat.S_ISCHR(os.stat("/dev/full").st_mode)
    finally:
        folder.rmdir()
        pipe.unlink()
        link.unlink()
    assert not list(drawn.glob("*.part*"))


# Of the two that find parameters a drive of two seconds is too little.
@pytest.mark.parametrize("command", ["import", "report", "plot", "resimulate", "export"])
def test_a_file_that_cannot_be_written_to_its_end_is_not_there_at_all(drawn, command):
    # No file over 100 bytes: as on a full disk, but for the words.
    limit = (100, 100)
    out = f"half{READS[command][1]}"
    code, _, err = _command(
        drawn, *COMMANDS[command], "-o", out, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, limit)
    )
    assert code in (1, 2) and err.count("\n") == 1 and out in err, err
    assert "None" not in err and "File too large" in err, err
    assert [each.name for each in drawn.iterdir() if each.name.startswith("half")] in ([], [f"{out}.part"])
    (drawn / f"{out}.part").unlink(missing_ok=True)
    code, _, err = _command(drawn, *COMMANDS[command], "-o", out)
    assert code == 0 and (drawn / out).stat().st_size > 100, err
    # Again, in place of it, and of a link, which is not followed.
    before = (drawn / out).stat().st_mtime_ns
    link = drawn / f"again{READS[command][1]}"
    link.symlink_to(out)
    assert _command(drawn, *COMMANDS[command], "-o", link.name)[0] == 0
    assert not link.is_symlink() and (drawn / out).stat().st_mtime_ns == before
    (drawn / out).unlink()
    link.unlink()


def test_a_folder_that_was_removed_is_named_without_an_empty_second_name(tmp_path, drawn):
    gone = tmp_path / "gone"
    code, _, err = _command(drawn, "report", "run.mcap", "-o", str(gone / "page.html"))
    assert code == 2 and err == f"error: [Errno 2] No such file or directory: '{gone / 'page.html'}'\n"


def test_nothing_inside_a_bag_that_is_read_is_replaced(tmp_path):
    (tmp_path / "bag").mkdir()
    (tmp_path / "bag" / "bag_0.mcap").write_bytes(b"precious")
    (tmp_path / "map.toml").write_text(MAP.replace("own.toml", "omni3") + 'names = ["a", "b", "c"]\n')
    code, _, err = _command(tmp_path, "import", "bag", "--map", "map.toml", "-o", "bag/bag_0.mcap")
    assert code == 2 and "this command reads this file" in err, err
    assert (tmp_path / "bag" / "bag_0.mcap").read_bytes() == b"precious"


def test_a_run_writes_no_log_in_place_of_a_device(tmp_path):
    (tmp_path / "flat-traction.mcap").symlink_to("/dev/full")
    short = ["--set", "duration_s=0.1"]
    code, _, err = _command(tmp_path, "run", "flat", *short, "--out", ".")
    assert code == 2 and err.count("\n") == 1 and "a device, allowed: a regular file" in err, err
    assert (tmp_path / "flat-traction.mcap").is_symlink()
