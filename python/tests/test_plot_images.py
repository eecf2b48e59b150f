"""Pictures: what is drawn looks as it did when it was last reviewed.

python -m pytest python/tests/test_plot_images.py --mpl-generate-path=python/tests/baseline draws them anew: look at
each before it is committed.
"""

from pathlib import Path

import matplotlib.pyplot as plt
import pytest
from matplotlib.testing.compare import compare_images

import omnistep

BASELINE = Path(__file__).parent / "baseline"
# Root mean square over the levels 0 to 255 of all pixels. Runs are the same in every bit and the test extra pins
# matplotlib, which brings its own letters (DejaVu) and its own renderer, so 0 is expected; processors that round
# another way move a few pixels at the rims of lines by a level. The wrong pictures below are 0.86 or more away.
TOLERANCE = 0.3
HOW = {"dpi": 55}
COMPARED = {"style": "default", "backend": "agg", "tolerance": TOLERANCE, "savefig_kwargs": HOW}


@pytest.fixture(autouse=True)
def close_figures():
    yield
    plt.close("all")


def rows(*, climbed_at_2_n_m=3):
    """Rows of a study: three seeds of two torques, heights and policies; one run failed, one cell is bare."""
    made = []
    for policy in ("scale_references", "independent"):
        for torque, height, climbs in ((1.0, 0.03, 1), (1.0, 0.05, 0), (2.0, 0.03, climbed_at_2_n_m), (2.0, 0.05, 2)):
            if (policy, torque, height) == ("independent", 1.0, 0.05):
                continue
            for seed in range(3):
                failed = (policy, torque, height, seed) == ("independent", 2.0, 0.05, 2)
                row = {"control_policy": policy, "vehicle_motor_stall_torque_n_m": torque, "terrain_height_m": height}
                row |= {"seed": seed, "climbed": None if failed else seed < climbs}
                row |= {"torque_squared_n2m2s": None if failed else torque * (3.0 + seed * (policy == "independent"))}
                made.append(row | {"error": "the physics left the finite numbers" if failed else None})
    return made


@pytest.mark.mpl_image_compare(filename="figure-8.png", **COMPARED)
def test_figure_8_looks_as_it_did(wheel_runs):
    return omnistep.plot.motor_bench(wheel_runs)[0].figure


@pytest.mark.mpl_image_compare(filename="figure-9.png", **COMPARED)
def test_figure_9_looks_as_it_did(climb, general_climb):
    return omnistep.plot.side_views([climb, general_climb])[0].figure


@pytest.mark.mpl_image_compare(filename="figure-10.png", **COMPARED)
def test_figure_10_looks_as_it_did(climb):
    return omnistep.plot.climb(climb)[0].figure


@pytest.mark.mpl_image_compare(filename="figures-10-11.png", **COMPARED)
def test_figures_10_and_11_look_as_they_did(climb, general_climb):
    return omnistep.plot.climbs([climb, general_climb])[0, 0].figure


@pytest.mark.mpl_image_compare(filename="paper.png", **COMPARED)
def test_all_figures_at_once_look_as_they_did(climb, general_climb, wheel_runs):
    return whole(climb, general_climb, wheel_runs)


@pytest.mark.mpl_image_compare(filename="climb-map.png", **COMPARED)
def test_climb_map_looks_as_it_did():
    return omnistep.plot.climb_map(rows())[0].figure


@pytest.mark.mpl_image_compare(filename="ensemble.png", **COMPARED)
def test_means_with_whiskers_look_as_they_did():
    return means(rows())


def means(rows):
    axes = omnistep.plot.ensemble(rows, ["climbed", "torque_squared_n2m2s"], lines="vehicle.motor.stall_torque_n_m")
    return axes[0].get_figure(root=True)


def whole(proposed, general, wheel_runs):
    axes = omnistep.plot.paper(proposed=proposed, general=general, wheel_runs=wheel_runs)
    return axes["8"][0].get_figure(root=True)


def difference(name, draw, folder):
    """Root mean square between a picture that was looked at and the one drawn now, by what the plugin compares with."""
    with plt.style.context("default", after_reset=True):
        figure = draw()
        figure.savefig(folder / name, **HOW)
    found = compare_images(BASELINE / name, folder / name, tol=TOLERANCE, in_decorator=True)
    return found["rms"] if found is not None else None


def test_a_run_that_is_another_by_a_little_is_noticed(climb, general_climb, wheel_runs, tmp_path):
    gains = {"gains.kp_n_m_s_rad": 0.02 * 0.9}
    softer = [omnistep.run_motor_bench("scale_references", overrides=gains), wheel_runs[1]]
    slower = omnistep.run("step", overrides={"command.vx_m_s": 0.3 * 0.98})
    both = [slower, general_climb]
    wrong = {
        "figure-8.png": lambda: omnistep.plot.motor_bench(softer)[0].figure,
        "figure-9.png": lambda: omnistep.plot.side_views(both)[0].figure,
        "figure-10.png": lambda: omnistep.plot.climb(slower)[0].figure,
        "figures-10-11.png": lambda: omnistep.plot.climbs(both)[0, 0].figure,
        "paper.png": lambda: whole(slower, general_climb, wheel_runs),
        "climb-map.png": lambda: omnistep.plot.climb_map(rows(climbed_at_2_n_m=2))[0].figure,
        "ensemble.png": lambda: means(rows(climbed_at_2_n_m=2)),
    }
    assert set(wrong) == {path.name for path in BASELINE.iterdir()}
    rms = {name: difference(name, draw, tmp_path) for name, draw in wrong.items()}
    assert None not in rms.values(), rms


def test_a_curve_a_hundredth_of_its_axis_too_high_is_noticed(climb, general_climb, wheel_runs, tmp_path):
    def raised(axes):
        ax = axes.ravel()[0]
        (low, high), curve = ax.get_ylim(), ax.lines[1]
        curve.set_ydata(curve.get_ydata() + 0.01 * (high - low))  # about a pixel
        return ax.get_figure(root=True)

    wrong = {
        "figure-8.png": lambda: raised(omnistep.plot.motor_bench(wheel_runs)),
        "figure-9.png": lambda: raised(omnistep.plot.side_views([climb, general_climb])),
        "figure-10.png": lambda: raised(omnistep.plot.climb(climb)),
        "figures-10-11.png": lambda: raised(omnistep.plot.climbs([climb, general_climb])),
    }
    rms = {name: difference(name, draw, tmp_path) for name, draw in wrong.items()}
    assert None not in rms.values(), rms
    right = {
        "figure-8.png": lambda: omnistep.plot.motor_bench(wheel_runs)[0].figure,
        "figure-10.png": lambda: omnistep.plot.climb(climb)[0].figure,
    }
    for name, draw in right.items():  # compared in the same way
        assert difference(name, draw, tmp_path) is None


def test_pictures_are_compared_by_plain_pytest_and_stay_small(request):
    # Without the option the plugin would let every figure pass.
    assert request.config.getoption("--mpl")
    assert request.config.pluginmanager.hasplugin("pytest_mpl")
    assert sum(path.stat().st_size for path in BASELINE.iterdir()) < 500_000
