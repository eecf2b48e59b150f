"""What is loaded for an import or a command is what it needs: the rest is time for which users wait."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import omnistep

SOURCE = Path(omnistep.__file__)
#: Packages of extras, and tqdm, which a visible bar needs.
EXTRAS = {
    "gymnasium", "IPython", "matplotlib", "mujoco", "optuna", "pandas", "plotly", "polars", "pyarrow", "rerun",
    "rosbags", "scipy", "threadpoolctl", "tomlkit", "tqdm",
}  # fmt: skip


def loaded_by(program):
    """The modules that a program loads, beside those of the interpreter's own start."""
    around = f"import sys\nbefore = set(sys.modules)\n{program}\nprint(*sorted(set(sys.modules) - before))"
    done = subprocess.run([sys.executable, "-W", "ignore", "-c", around], capture_output=True, text=True, check=True)
    return done.stdout.splitlines()[-1].split()


def packages_of(modules):
    return {module.partition(".")[0] for module in modules}


def test_an_import_loads_the_compiled_part_alone():
    loaded = loaded_by("import omnistep")
    assert packages_of(loaded) - sys.stdlib_module_names == {"omnistep"}
    # All of them are small: the compiled part, the exceptions, the methods for notebooks.
    assert {each for each in loaded if each.startswith("omnistep.")} == {
        "omnistep._notebook",
        "omnistep._omnistep",
        "omnistep.errors",
    }
    assert not {"typing", "inspect", "dataclasses", "argparse"} & set(loaded)


def test_all_public_names_together_load_no_other_package_than_numpy():
    loaded = loaded_by("from omnistep import *")
    assert packages_of(loaded) - sys.stdlib_module_names == {"numpy", "omnistep"}
    assert "asyncio" not in loaded


@pytest.mark.parametrize(
    "arguments",
    [["--help"], ["list"], ["check", "step"], ["run", "--help"], ["new", "vehicle", "--help"]],
    ids=" ".join,
)
def test_a_command_of_the_compiled_part_loads_no_package(arguments):
    program = f"sys.argv = ['omnistep', *{arguments}]\nfrom omnistep.__main__ import main\nmain()"
    loaded = loaded_by(program)
    assert "omnistep._omnistep" in loaded
    assert not EXTRAS & packages_of(loaded)
    # The usage of `new` for a URDF is Python's.
    assert ("numpy" in loaded) == (arguments[0] == "new")


def test_a_run_without_a_terminal_loads_no_package_of_an_extra():
    loaded = loaded_by("import omnistep\nomnistep.run('flat', overrides={'duration_s': 0.01})")
    assert not EXTRAS & packages_of(loaded)


FITS = """
import numpy as np, omnistep
drawn = omnistep.Vehicle("mecanum4")
scenario = omnistep.Scenario("flat", vehicle=drawn, overrides={
    "physics.engine": "articulated", "duration_s": 3.0, "command.vx_m_s": 0.5,
    "command.then": [{"at_s": 1.5, "vx_m_s": 0.0, "vy_m_s": 0.5, "wz_rad_s": 0.5, "ramp_s": 0.5}]})
omnistep.identify(omnistep.run(scenario), vehicle=drawn, fix={"wheel_inertia_kg_m2": 0.0035})
runs = []
for twist in [(0.3, 0, 0), (0, 0.3, 0), (0, 0, 1), (0.2, 0, 0.5), (0, -0.2, -0.5)]:
    wheels = omnistep.Kinematics(layout=drawn.layout).inverse([twist] * 201)
    x, y, yaw = omnistep.moved_by([0, 0, 0], 2.0 * np.array(twist))
    log = {"time_s": 0.01 * np.arange(201)}
    log |= {f"wheel_{name}_measured_rad_s": wheels[:, k] for k, name in enumerate(drawn.wheel_names)}
    runs.append(omnistep.CalibrationRun(log=log, end_x_m=x, end_y_m=y, end_yaw_rad=yaw))
omnistep.calibrate(runs, vehicle=drawn)
"""


def test_fits_load_of_scipy_what_they_need():
    loaded = loaded_by(FITS)
    assert {"scipy.optimize", "scipy.special"} <= set(loaded)
    # As long to load as a minute of log takes to fit.
    assert not {"scipy.stats", "scipy.signal", "scipy.interpolate"} & set(loaded)
    assert not {"matplotlib", "pandas", "polars", "pyarrow", "tqdm"} & packages_of(loaded)


def test_a_report_loads_no_matplotlib_and_a_figure_no_plotly(tmp_path):
    run = f"import omnistep\nlog = {str(tmp_path / 'flat.mcap')!r}\n"
    run += "trace = omnistep.run('flat', overrides={'duration_s': 0.1}, mcap=log)\n"
    report = loaded_by(f"{run}from omnistep import report\nreport.write([log], {str(tmp_path / 'page.html')!r})")
    assert packages_of(report) & EXTRAS == {"plotly"}
    figure = loaded_by(f"{run}import matplotlib\nmatplotlib.use('Agg')\nomnistep.plot.climb(trace)")
    assert packages_of(figure) & EXTRAS == {"matplotlib"}


def test_what_is_loaded_later_is_what_type_checkers_see():
    tree = ast.parse(SOURCE.read_text(encoding="utf-8"))
    (block,) = (node for node in tree.body if isinstance(node, ast.If) and isinstance(node.test, ast.Name))
    seen = {}
    for node in block.body:
        module = node.module.removeprefix("omnistep").lstrip(".")
        seen |= {alias.name: module or alias.name for alias in node.names}
    later = {name: module for module, names in omnistep._LATER.items() for name in names.split() or [module]}
    assert later == seen
    assert set(later) < set(omnistep.__all__) < set(dir(omnistep))
    for name in omnistep.__all__:
        assert getattr(omnistep, name) is not None
    with pytest.raises(AttributeError, match="module 'omnistep' has no attribute 'rnu'"):
        omnistep.rnu  # noqa: B018
