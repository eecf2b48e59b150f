"""docs/robots.md lists the robots that the command has, with the wheels, masses and speeds of their files."""

import re
import sys
from pathlib import Path

SCRIPTS = Path(__file__).resolve().parents[2] / "scripts" / "docs"
sys.path.insert(0, str(SCRIPTS))
try:
    import robots_page
finally:
    sys.path.remove(str(SCRIPTS))

PAGE = robots_page.PAGE.read_text(encoding="utf-8")


def first_cells(table):
    """The first cell of each row of a table."""
    return re.findall(r"^\| `(\w+)` \|", table, re.MULTILINE)


def test_the_list_is_what_the_files_say():
    assert robots_page.block(PAGE, "list") == robots_page.listed()


def test_every_table_has_every_robot():
    names = robots_page.names()
    assert sorted(names) == sorted(path.stem for path in robots_page.FILES.glob("*.toml"))
    assumed = PAGE.split("| robot | assumed |")[1].split("\n\n")[0]
    for table in (robots_page.block(PAGE, "list"), robots_page.block(PAGE, "climbs"), assumed):
        assert first_cells(table) == names


def test_speeds_and_heights_of_the_simulated_table_are_of_the_files():
    for row in robots_page.block(PAGE, "climbs").splitlines()[2:]:
        name, speed, *_, independent, traction, _ = [cell.strip(" `") for cell in row.strip("|").split("|")]
        robot = robots_page.vehicle(name)
        assert float(speed) == float(f"{robot['limits.vx_m_s'] / 2:.2g}")
        heights_mm = robots_page.heights_mm(robot)
        for cell in (independent, traction):
            number = int(re.search(r"\d+", cell)[0])
            assert number in heights_mm, f"{name}: {cell}"
