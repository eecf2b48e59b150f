"""What is killed, has no room, or writes where another writes."""

import json
import shutil
import signal
import subprocess
import time
from pathlib import Path

import pyarrow.parquet as pq
from campaign import Campaign, Ended, Setting, faults, limited, run


def campaigns(setting: Setting) -> list[Campaign]:
    """Kill, full disk, side by side."""
    return [killed_runs(setting), killed_studies(setting), no_room(setting), side_by_side(setting)]


def left(out: Path) -> list[Path]:
    """Logs that are finished or not, whatever they are called."""
    return sorted(path for path in out.glob("*") if ".mcap" in path.name and path.is_file())


def killed_runs(setting: Setting) -> Campaign:
    """A run that is killed leaves a log that can be read."""
    folder, chance = setting.folder("killed"), setting.random("killed")
    failures, tried = [], setting.count(6)
    for k in range(tried):
        out = folder / str(k)
        stop = chance.choice((signal.SIGKILL, signal.SIGKILL, signal.SIGTERM, signal.SIGINT))
        command = [setting.omnistep, "run", "flat", "--set", "duration_s=500", "--quiet", "--out", out]
        process = subprocess.Popen(limited(command), stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        until = time.monotonic() + 30
        # A log has its first chunk after a simulated second.
        while time.monotonic() < until and not any(path.stat().st_size > 100_000 for path in left(out)):
            time.sleep(0.02)
        time.sleep(chance.random() * 0.3)
        process.send_signal(stop)
        _, said = process.communicate(timeout=10)
        logs = left(out)
        if not logs:
            failures.append(f"flat killed by {stop.name}: no log is left: {said.decode()[:150]}")
        for log in logs:
            ended = run([setting.omnistep, "info", log], folder)
            if wrong := faults(ended, allowed=(0,)):
                failures.append(f"omnistep info {setting.kept(log)}: {'; '.join(wrong)} {ended.err[:150]}")
        if stop == signal.SIGINT and (process.returncode != 130 or len(said.splitlines()) != 1):
            failures.append(f"Ctrl-C of `run flat`: exit {process.returncode}, said {said.decode().strip()[:150]!r}")
        shutil.rmtree(out, ignore_errors=True)
    return Campaign("run killed", tried, "runs", failures)


def killed_studies(setting: Setting) -> Campaign:
    """A study that is killed again and again has the rows of one that was not."""
    folder, chance = setting.folder("studies"), setting.random("studies")
    study = folder / "many.toml"
    study.write_text(
        'schema_version = 1\nname = "many"\nscenario = "flat"\nseeds = 8\n[set]\nduration_s = 0.3\n'
        '"perturbation.yaw_rad" = 0.03\n[[axis]]\nkey = "terrain.friction"\nvalues = [0.5, 0.6, 0.7]\n'
    )

    def command(out: Path) -> list[object]:
        return [setting.omnistep, "study", study, "--out", out, "--quiet", "--json"]

    def rows(out: Path) -> str:
        read = [row for path in out.glob("part-*.parquet") for row in pq.read_table(path).to_pylist()]
        return str(sorted(read, key=lambda row: str(row["key"])))

    start = time.monotonic()
    whole = run(command(folder / "whole"), folder, seconds=120)
    took = time.monotonic() - start
    if whole.code != 0:
        return Campaign("study killed and resumed", 1, "studies", [f"{whole.command}: {whole.err[:200]}"])
    failures, tried = [], setting.count(3)
    for k in range(tried):
        out = folder / str(k)
        for _ in range(3):
            process = subprocess.Popen(limited(command(out)), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            time.sleep(chance.random() * took * 0.5)
            process.send_signal(chance.choice((signal.SIGKILL, signal.SIGINT)))
            process.wait()
        ended = run(command(out), folder, seconds=120)
        wrong = faults(ended, allowed=(0,))
        if not wrong and rows(out) != rows(folder / "whole"):
            wrong = ["other rows than without a kill"]
        if not wrong and ended.out != whole.out:
            wrong = ["another map than without a kill"]
        if wrong:
            failures.append(f"{ended.command}: killed three times before: {'; '.join(wrong)}")
    return Campaign("study killed and resumed", tried, "studies", failures)


def no_room(setting: Setting) -> Campaign:
    """A quota, a full disk, a full device: one line, and no half log with a whole one's name."""
    folder = setting.folder("room")
    scenario = ["--set", "duration_s=2", "--quiet"]
    study = ["study", "ensemble", "--seeds", "2", "--set", "duration_s=0.05", "--quiet"]
    cases: list[tuple[list[object], Path, str]] = []
    # In blocks of 512 bytes: nothing, a header, some chunks.
    for blocks in (0, 8, 200):
        out = folder / f"quota-{blocks}"
        cases.append(([setting.omnistep, "run", "flat", *scenario, "--out", out], out, f"ulimit -f {blocks};"))
        out = folder / f"quota-study-{blocks}"
        cases.append(([setting.omnistep, *study, "--out", out], out, f"ulimit -f {min(blocks, 8)};"))
    notes = []
    disk = folder / "disk"
    disk.mkdir()
    mounted = subprocess.run(["mount", "-t", "tmpfs", "-o", "size=64k", "tmpfs", disk], stderr=subprocess.DEVNULL)
    if mounted.returncode == 0:
        cases.append(([setting.omnistep, "run", "flat", *scenario, "--out", disk / "run"], disk / "run", ""))
        cases.append(([setting.omnistep, *study, "--out", disk / "study"], disk / "study", ""))
    else:
        notes.append("a full disk: not tried, only root may mount one; the quota is")
    failures = []
    try:
        for command, out, extra in cases:
            ended = run(command, folder, seconds=60, extra=extra)
            wrong = faults(ended)
            small_study = "study" in command and ended.code == 0
            if not wrong and ended.code == 0 and not small_study:
                wrong.append("exit 0 without room")
            if any(path.suffix == ".mcap" for path in left(out)):
                wrong.append("a half log has a whole one's name")
            if wrong:
                failures.append(f"{ended.command}: {'; '.join(wrong)}")
    finally:
        if mounted.returncode == 0:
            subprocess.run(["umount", disk], check=True)
    ended = run(["sh", "-c", f"'{setting.omnistep}' list >/dev/full"], folder)
    if wrong := faults(ended, allowed=(1, 2)):
        failures.append(f"{ended.command}: {'; '.join(wrong)}")
    return Campaign("no room", len(cases) + 1, "writes", failures, notes)


def side_by_side(setting: Setting) -> Campaign:
    """A process that says its run is logged is right, whatever other processes write there."""
    folder, chance = setting.folder("side"), setting.random("side")
    failures, tried = [], 0
    for k in range(setting.count(3)):
        tried += 1
        seeds = [["--seed", str(seed)] for seed in (1, 2, 3, 4)]
        failures += together(setting, folder / f"seeds-{k}", seeds, [0.0] * 4)
    for k in range(setting.count(6)):
        tried += 1
        # The same seed twice, or two; the second starts anywhere within the first.
        seeds = chance.choice(([[], []], [["--seed", "3"], []]))
        failures += together(setting, folder / f"two-{k}", seeds, [0.0, chance.random() * 0.4])
    return Campaign("runs side by side on one log", tried, "groups", failures)


def together(setting: Setting, out: Path, of: list[list[str]], delays: list[float]) -> list[str]:
    """Runs at the same time into one folder; what is wrong with what they say and leave."""
    running = []
    for extra, delay in zip(of, delays, strict=True):
        time.sleep(delay)
        command = [setting.omnistep, "run", "flat", "--set", "duration_s=1", "--quiet", "--json", *extra, "--out", out]
        running.append((extra, subprocess.Popen(limited(command), stdout=subprocess.PIPE, stderr=subprocess.PIPE)))
    wrong, done = [], []
    for extra, process in running:
        said, complaint = process.communicate(timeout=120)
        ended = Ended("", process.returncode, said.decode(), complaint.decode(), 0)
        if process.returncode == 0:
            done.append(extra[1] if extra else "0")
        wrong += faults(ended)
    logged = set()
    for log in left(out):
        ended = run([setting.omnistep, "info", "--json", log], out)
        if ended.code == 0:
            run_of = json.loads(ended.out.splitlines()[0])
            logged.add(str(run_of.get("seed", run_of.get("run", {}).get("seed"))))
        elif log.suffix == ".mcap":
            wrong.append(f"{log.name}: {ended.err.strip()[:150]}")
    if not done:
        wrong.append("none of them made its log")
    if lost := sorted(set(done) - logged):
        wrong.append(f"exit 0, but no whole log of seed {', '.join(lost)}")
    shutil.rmtree(out)
    if not wrong:
        return []
    delays_s = " and ".join(f"{delay:.2f}" for delay in delays)
    return [f"omnistep run flat --set duration_s=1, {of} started after {delays_s} s: {'; '.join(wrong)}"]
