"""Files of others: TOML, height maps, and results of studies."""

import itertools
import os
import random
import re
import shutil
import struct
import zlib
from collections.abc import Iterator
from pathlib import Path

import pyarrow.parquet as pq
from campaign import Campaign, Setting, faults, in_parallel, run

NUMBERS = [
    "nan", "inf", "-inf", "1e308", "-1e308", "5e-324", "-0.0", "0", "-1", "1", "1e-12",
    "1e12", "2147483648", "4294967296", "-9223372036854775808", "9223372036854775807",
    "18446744073709551616", "0x7fffffffffffffff", "1_000", "99999999999999999999999999999999", "4000",
]  # fmt: skip
OTHERS = [
    '""', '"chugo7"', '"../../etc/passwd"', '"/dev/zero"', '"/dev/stdin"', '"\\u0000"', '"\\u202e"', "[]", "{}", "true",
    "1979-05-27T07:32:00Z", "[[[[[[1]]]]]]", "{ a = { b = { c = 1 } } }", '"%s%n"', "[nan, nan, nan]", "'''\nx\n'''",
]  # fmt: skip


def other_numbers(text: str, chance: random.Random) -> bytes:
    """The TOML file with up to four other numbers: most are accepted, and have to work."""
    lines = text.splitlines()
    of_number = [k for k, line in enumerate(lines) if re.match(r"\s*\w+\s*=\s*-?\d", line) and "version" not in line]
    for at in chance.sample(of_number, min(len(of_number), chance.choice((1, 1, 2, 4)))):
        key, value = (part.strip() for part in lines[at].split("#")[0].split("=", 1))
        factor = chance.choice((-1, 0, 0.01, 0.1, 0.5, 0.9, 1.1, 2, 10, 100))
        try:
            number = float(value) * factor
        except ValueError:
            continue
        lines[at] = f"{key} = {round(number) if value.isdigit() else repr(number)}"
    return "\n".join(lines).encode()


def mutant(text: str, chance: random.Random) -> bytes:
    """The TOML file with one to three changes."""
    if chance.random() < 0.4:
        return other_numbers(text, chance)
    lines = text.splitlines()
    for _ in range(chance.choice((1, 1, 1, 2, 3))):
        keys = [k for k, line in enumerate(lines) if re.match(r'\s*[\w".-]+\s*=', line)]
        at = chance.choice(keys)
        key, value = (part.strip() for part in lines[at].split("=", 1))
        choice = chance.randrange(15)
        if choice < 5:
            numbers = list(re.finditer(r"-?\d+(\.\d+)?(e-?\d+)?", value.split("#")[0]))
            if numbers:
                number = chance.choice(numbers)
                new = value[: number.start()] + chance.choice(NUMBERS) + value[number.end() :]
            else:
                new = chance.choice(NUMBERS)
            lines[at] = f"{key} = {new}"
        elif choice < 7:
            lines[at] = f"{key} = {chance.choice(OTHERS)}"
        elif choice == 7:
            del lines[at]
        elif choice == 8:
            lines.insert(at, lines[at])
        elif choice == 9:
            lines[at] = f"{key}{chance.choice('xé_')} = {value}"
        elif choice == 10:
            size = chance.choice((400, 100_000, 10_000_000))
            lines[at] = f'{key} = "{"a" * size}"'
        elif choice == 11:
            depth = chance.choice((100, 100_000))
            lines[at] = f"{key} = {'[' * depth}{']' * depth}"
        elif choice == 12:
            tables = [k for k, line in enumerate(lines) if line.startswith("[")] or [0]
            table = chance.choice(tables)
            lines[table:table] = chance.choice((lines[table : table + 8] * 3, ["[[wheel]]"] * 9, [f"[{key}]"]))
        elif choice == 13:
            count = chance.choice((300, 30_000))
            lines[at:at] = [f"key_{k} = {k}" for k in range(count)]
        else:
            lines[at] = lines[at][: chance.randrange(len(lines[at]) + 1)]
    data = "\n".join(lines).encode()
    whole = chance.randrange(12)
    if whole == 0:
        place = chance.randrange(len(data))
        data = data[:place] + chance.choice((b"\xff\xfe", b"\0", b"\xed\xa0\x80", b"\r", b"\x1b[2J")) + data[place:]
    elif whole == 1:
        data = data[: chance.randrange(len(data))]
    elif whole == 2:
        text = data.decode(errors="replace")
        data = chance.choice((text.encode("utf-16"), b"\xef\xbb\xbf" + data, text.replace("\n", "\r\n").encode()))
    return data


def toml(setting: Setting) -> list[Campaign]:
    """Mutants of every built-in file through `check`; what is accepted is run for a moment."""
    chance, folder = setting.random("toml"), setting.folder("toml")
    assets = setting.top / "crates/omni-config/assets"
    sources = {kind: sorted((assets / kind).glob("*.toml")) for kind in ("vehicles", "scenarios", "studies")}
    accepted: list[tuple[Path, str]] = []

    def made() -> Iterator[tuple[Path, str]]:
        for k in range(setting.count(600)):
            kind = ("vehicles", "scenarios", "scenarios", "studies")[k % 4]
            path = folder / f"{kind}-{k}.toml"
            path.write_bytes(mutant(chance.choice(sources[kind]).read_text(), chance))
            yield path, kind

    def check(item: tuple[Path, str]) -> str | None:
        path, kind = item
        ended = run([setting.omnistep, "check", path.name], folder)
        if wrong := faults(ended, allowed=(0, 2)):
            return f"omnistep check {setting.kept(path)}: {'; '.join(wrong)}"
        if ended.code == 0 and kind != "studies":
            accepted.append((path, kind))
        else:
            path.unlink()
        return None

    def drive(item: tuple[Path, str]) -> str | None:
        path, kind = item
        words = [path.name] if kind == "scenarios" else ["flat", "--set", f"vehicle={path.name}"]
        command = [setting.omnistep, "run", *words, "--set", "duration_s=0.05", "--quiet", "--out", path.stem]
        ended = run(command, folder)
        shutil.rmtree(folder / path.stem, ignore_errors=True)
        # 1: diverged, and said so.
        if wrong := faults(ended):
            return f"{ended.command.replace(path.name, str(setting.kept(path)))}: {'; '.join(wrong)}"
        return None

    checked = in_parallel(check, list(made()))
    accepted.sort()
    driven = in_parallel(drive, accepted)
    return [
        Campaign("TOML mutants: check", checked[0], "files", checked[1]),
        Campaign("TOML mutants accepted: run", driven[0], "files", driven[1]),
        by_hand(setting, folder),
    ]


def by_hand(setting: Setting, folder: Path) -> Campaign:
    """Files that are no files, and files without end."""
    step = (setting.top / "crates/omni-config/assets/scenarios/step.toml").read_bytes()
    study = b'schema_version = 1\nname = "long"\nscenario = "flat"\nseeds = 1\n'
    place = folder / "hand"
    place.mkdir()
    texts = {
        "100MB-string": b'schema_version = 1\nname = "' + b"a" * 100_000_000 + b'"\n',
        "100MB-comment": step + b"#" + b" " * 100_000_000,
        "million-keys": b"".join(b"a%d = 1\n" % k for k in range(1_000_000)),
        "deep": b"a = " + b"{ b = " * 100_000 + b"1" + b" }" * 100_000,
        "nul": step.replace(b"step", b"st\0ep", 1),
        "utf16": step.decode().encode("utf-16"),
        "latin1": step.replace(b"name", "größe".encode("latin-1"), 1),
        "empty": b"",
        "zeros": b"\0" * 1_000_000,
        "long-key": b"a." * 1_000_000 + b"a = 1\n",
        "long-axis": study + b'[[axis]]\nkey = "' + b"a." * 1_000_000 + b'a"\nvalues = [1]\n',
        "long-set": study + b'[set]\n"' + b"a." * 1_000_000 + b'a" = 1\n',
    }
    paths = []
    for name, data in texts.items():
        paths.append(place / f"{name}.toml")
        paths[-1].write_bytes(data)
    special = place / "special.toml"
    for name, target in (("zero", "/dev/zero"), ("full", "/dev/full"), ("folder", "/")):
        paths.append(place / f"{name}.toml")
        paths[-1].symlink_to(target)
    paths.append(place / "fifo.toml")
    os.mkfifo(paths[-1])
    for name, value in (
        ("names-zero", place / "zero.toml"),
        ("names-fifo", place / "fifo.toml"),
        ("names-itself", special),
    ):
        paths.append(place / f"{name}.toml")
        paths[-1].write_bytes(step.replace(b'"chugo7"', f'"{value}"'.encode()))
    special.write_bytes(step.replace(b'"chugo7"', b'"special.toml"'))

    def check(item: tuple[str, list[object]]) -> str | None:
        name, words = item
        wrong = faults(run([setting.omnistep, *words], place), allowed=(0, 2))
        # By its name: scripts/attack/files.py makes it again.
        return f"by_hand, {name}: {'; '.join(wrong)}" if wrong else None

    checked: list[tuple[str, list[object]]] = [(path.name, ["check", path.name]) for path in [*paths, special]]
    # The longest word that Linux accepts.
    checked.append(("long-option", ["run", "flat", "--set", "a." * 65_000 + "a=1"]))
    return Campaign("TOML by hand", *_with_unit(in_parallel(check, checked), "files"))


def _with_unit(result: tuple[int, list[str]], unit: str) -> tuple[int, str, list[str]]:
    return result[0], unit, result[1]


# Pictures.


def chunk(kind: bytes, data: bytes, crc: int | None = None, length: int | None = None) -> bytes:
    """A chunk of a PNG, with the checksum that it should have unless another is given."""
    right = zlib.crc32(kind + data)
    return (
        struct.pack(">I", len(data) if length is None else length)
        + kind
        + data
        + struct.pack(">I", right if crc is None else crc)
    )


def png(setting: Setting) -> list[Campaign]:
    """Height maps with sound checksums and hostile contents."""
    chance, folder = setting.random("png"), setting.folder("png")
    scenario = (setting.top / "crates/omni-config/assets/scenarios/height_map.toml").read_text()

    def picture(k: int) -> bytes:
        width, height = chance.choice(
            ((4, 4), (16, 9), (2, 2), (1, 1), (0, 0), (60000, 60000), (2000, 2000), (1 << 31, 1))
        )
        depth, color = chance.choice(
            ((8, 0), (16, 0), (8, 0), (16, 0), (1, 0), (8, 3), (8, 6), (16, 2), (7, 0), (255, 255))
        )
        interlace = chance.choice((0, 0, 0, 1, 2))
        bytes_of_row = 1 + min(width, 5000) * max(depth, 8) // 8
        rows = bytes(
            chance.randrange(256) if chance.random() < 0.1 else 0
            for _ in range(min(bytes_of_row * min(height, 50), 100_000))
        )
        fill = chance.choice((0, 0, 0, 1, 2, 3))
        if fill == 1:
            rows = bytes(200_000_000 if k % 40 == 1 else 1_000_000)
        elif fill == 2:
            rows = rows[: len(rows) // 2]
        image = zlib.compress(rows, 1)
        chunks = [
            chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, depth, color, 0, 0, interlace)),
            chunk(b"IDAT", image),
            chunk(b"IEND", b""),
        ]
        extra = chance.randrange(10)
        if extra == 0:
            chunks.insert(1, chunk(b"zTXt", b"name\0\0" + zlib.compress(bytes(50_000_000), 1)))
        elif extra == 1:
            chunks.insert(1, chunk(b"iCCP", b"icc\0\0" + zlib.compress(bytes(50_000_000), 1)))
        elif extra == 2:
            chunks.insert(1, chunk(b"PLTE", bytes(chance.choice((0, 1, 3, 769, 3000)))))
        elif extra == 3:
            chance.shuffle(chunks)
        elif extra == 4:
            chunks.insert(
                chance.randrange(3), chunk(chance.choice((b"tRNS", b"gAMA", b"acTL", b"fcTL", b"XXXX")), bytes(8))
            )
        elif extra == 5:
            chunks[1] = chunk(b"IDAT", image, length=chance.choice((0, 0x7FFFFFFF, 0xFFFFFFFF, len(image) + 1)))
        data = b"\x89PNG\r\n\x1a\n" + b"".join(chunks)
        if chance.random() < 0.2:
            data = data[: chance.randrange(len(data))]
        return data

    def made() -> Iterator[Path]:
        for k in range(setting.count(120)):
            path = folder / f"heights-{k}.png"
            path.write_bytes(picture(k))
            path.with_suffix(".toml").write_text(scenario.replace('"hills"', f'"{path.name}"'))
            yield path

    def check(path: Path) -> str | None:
        ended = run([setting.omnistep, "check", path.with_suffix(".toml").name], folder)
        if wrong := faults(ended, allowed=(0, 2)):
            setting.kept(path)
            return f"omnistep check {setting.kept(path.with_suffix('.toml'))}: {'; '.join(wrong)}"
        path.unlink()
        return None

    return [Campaign("height maps: check", *_with_unit(in_parallel(check, list(made())), "files"))]


# Results.


def parquet(setting: Setting) -> list[Campaign]:
    """One bit of a study's results is flipped: the next `study` has the right rows, or says what is wrong."""
    chance, folder = setting.random("parquet"), setting.folder("parquet")
    study = folder / "small.toml"
    study.write_text(
        'schema_version = 1\nname = "small"\nscenario = "flat"\nseeds = 3\n[set]\nduration_s = 0.02\n'
        '"perturbation.yaw_rad" = 0.03\n[[axis]]\nkey = "terrain.friction"\nvalues = [0.5, 0.6, 0.7]\n'
    )

    def command(out: Path) -> list[object]:
        return [setting.omnistep, "study", study, "--out", out, "--quiet", "--json", "--jobs", "1"]

    def rows(out: Path) -> list[dict[str, object]]:
        parts = [pq.read_table(path).to_pylist() for path in sorted(out.glob("part-*.parquet"))]
        return sorted(itertools.chain(*parts), key=lambda row: str(row["key"]))

    whole = folder / "whole"
    first = run(command(whole), folder)
    if first.code != 0:
        return [Campaign("results: one bit flipped", 1, "bits", [f"{first.command}: {first.err}"])]
    right = rows(whole)
    part = next(whole.glob("part-*.parquet"))
    size = part.stat().st_size

    def flip(item: tuple[int, int]) -> str | None:
        k, bit = item
        out = folder / f"flip-{k}"
        shutil.copytree(whole, out)
        damaged = out / part.name
        data = bytearray(damaged.read_bytes())
        data[bit // 8] ^= 1 << bit % 8
        damaged.write_bytes(data)
        ended = run(command(out), folder)
        wrong = faults(ended)
        if not wrong and ended.code == 0:
            try:
                # nan is not equal to itself: compared as text
                if str(rows(out)) != str(right):
                    wrong = ["exit 0 and other numbers"]
            except (OSError, ValueError) as error:
                wrong = [f"exit 0 and results that cannot be read: {error}"[:150]]
        shutil.rmtree(out)
        if wrong:
            return (
                f"bit {bit} of {setting.keep / 'whole'}/{part.name} flipped, then {ended.command}: {'; '.join(wrong)}"
            )
        return None

    bits = [(k, chance.randrange(8 * size)) for k in range(setting.count(100))]
    tried, failures = in_parallel(flip, bits)
    if failures:
        shutil.copytree(whole, setting.keep / "whole")
    return [Campaign("results: one bit flipped", tried, "bits", failures)]
