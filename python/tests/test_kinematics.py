"""Layouts and their linear maps over arrays."""

import numpy as np
import pytest

import omnistep

MECANUM = omnistep.Layout.mecanum4(wheelbase_m=0.6, track_m=0.4, radius_m=0.1)
SEVEN = omnistep.Layout.chugo7(r1_m=0.35, r2_m=0.27, radius_m=0.1)
LAYOUTS = [
    *(omnistep.Layout.omni(wheels=n, circle_radius_m=0.3, offset_rad=0.2, wheel_radius_m=0.05) for n in range(3, 9)),
    MECANUM,
    SEVEN,
]
# Float64 has 2.2e-16; velocities here are below 100 rad/s and condition numbers below 3.
EXACT = {"rtol": 0, "atol": 1e-12}


def twists(count=50):
    return np.random.default_rng(1).uniform(-2.0, 2.0, (count, 3))


def velocities(layout, count=50):
    return np.random.default_rng(2).uniform(-20.0, 20.0, (count, len(layout)))


def refused(call, *args, **kwargs):
    with pytest.raises(omnistep.ConfigError) as caught:
        call(*args, **kwargs)
    message = str(caught.value)
    assert "\n" not in message
    assert "allowed: " in message
    return caught.value


def test_inverse_has_the_numbers_of_each_layout():
    inverse = omnistep.Kinematics(layout=SEVEN).inverse
    np.testing.assert_allclose(inverse([0.3, 0, 0]), [3, 0, -3, 3, 3, 0, -3], **EXACT)
    np.testing.assert_allclose(inverse([0, 0.3, 0]), [0, -3, 0, 0, 0, 3, 0], **EXACT)
    np.testing.assert_allclose(inverse([0, 0, 1]), [2.7, 3.5, 2.7, 0, 2.7, 3.5, 2.7], **EXACT)
    mecanum = omnistep.Layout.mecanum4(wheelbase_m=1.2, track_m=0.8, radius_m=0.5)
    np.testing.assert_allclose(omnistep.Kinematics(layout=mecanum).inverse([10, 5, 3]), [4, 36, 24, 16], **EXACT)
    example = omnistep.Kinematics(layout=MECANUM).inverse([1.0, 0.0, 2.0])  # of the class's documentation
    assert example.round(9).tolist() == [0.0, 20.0, 0.0, 20.0]
    cross = omnistep.Layout.omni(wheels=4, circle_radius_m=0.5, wheel_radius_m=0.1)
    np.testing.assert_allclose(omnistep.Kinematics(layout=cross).inverse([1, 1, 1]), [15, -5, -5, 15], **EXACT)


def test_a_wheel_of_one_s_own_is_geared_reversed_and_turned():
    plain = {"position_m": (0.2, 0.15), "radius_m": 0.05}
    others = omnistep.Layout.omni(wheels=3, circle_radius_m=0.2, wheel_radius_m=0.05).wheels

    def row(**changes):
        layout = omnistep.Layout(wheels=[omnistep.Wheel(**plain, **changes), *others])
        return omnistep.Kinematics(layout=layout).inverse_matrix[0]

    np.testing.assert_allclose(row(), [20, 0, -3], **EXACT)
    np.testing.assert_allclose(row(gear=0.05, reversed=True), [-400, 0, 60], **EXACT)
    np.testing.assert_allclose(row(rolling_direction=(0, 3)), [0, 20, 4], **EXACT)
    np.testing.assert_allclose(row(roller_angle_rad=-np.pi / 4), [20, -20, -7], **EXACT)


@pytest.mark.parametrize("layout", LAYOUTS, ids=repr)
def test_arrays_are_rows_one_by_one_and_the_matrices_are_the_maps(layout):
    kinematics, n = omnistep.Kinematics(layout=layout), len(layout)
    a, f = kinematics.inverse_matrix, kinematics.forward_matrix
    assert a.shape == (n, 3)
    assert f.shape == (3, n)
    x, v = twists(), velocities(layout)
    for method, rows, columns, matrix in [
        (kinematics.inverse, x, n, a),
        (kinematics.forward, v, 3, f),
        (kinematics.residual, v, n, np.eye(n) - a @ f),
    ]:
        out = method(rows)
        assert out.shape == (50, columns)
        assert out.dtype == np.float64
        np.testing.assert_allclose(out, rows @ matrix.T, **EXACT)
        for one, row in zip(out, rows, strict=True):
            np.testing.assert_array_equal(method(row), one)
        assert method(rows[:0]).shape == (0, columns)


@pytest.mark.parametrize(
    ("layout", "forward"),
    # The average inverts rings of omni wheels only where no wheel points along two axes.
    [*((layout, "least_squares") for layout in LAYOUTS), (MECANUM, "paper_average"), (SEVEN, "paper_average")],
    ids=repr,
)
def test_forward_undoes_inverse_and_what_it_cannot_explain_is_the_residual(layout, forward):
    kinematics = omnistep.Kinematics(layout=layout, forward=forward)
    x, v = twists(), velocities(layout)
    np.testing.assert_allclose(kinematics.forward(kinematics.inverse(x)), x, **EXACT)
    np.testing.assert_allclose(kinematics.residual(kinematics.inverse(x)), 0, **EXACT)
    rest = kinematics.residual(v)
    np.testing.assert_allclose(kinematics.inverse(kinematics.forward(v)) + rest, v, **EXACT)
    np.testing.assert_allclose(kinematics.forward(rest), 0, **EXACT)
    if forward == "least_squares":
        np.testing.assert_allclose(kinematics.forward_matrix, np.linalg.pinv(kinematics.inverse_matrix), **EXACT)


def test_a_slipping_wheel_shows_in_the_residual():
    slipping = [3.0, 0.0, -3.0, 4.0, 3.0, 0.0, -3.0]  # forward at 0.3 m/s, wheel 4 slips by 1 rad/s
    # Five wheels measure vx: four fifths of what one of them says alone cannot be motion.
    residual = omnistep.Kinematics(layout=SEVEN).residual(slipping)
    np.testing.assert_allclose(residual, [-0.2, 0, 0.2, 0.8, -0.2, 0, 0.2], **EXACT)


def test_the_average_of_the_paper_differs_from_least_squares_where_levers_differ():
    average = omnistep.Kinematics(layout=SEVEN, forward="paper_average").forward_matrix
    squares = omnistep.Kinematics(layout=SEVEN).forward_matrix
    np.testing.assert_allclose(average[:2], squares[:2], **EXACT)
    # Yaw: the mean over six wheels of r / lever; least squares weighs by the lever.
    np.testing.assert_allclose(average[2], np.array([10 / 27, 10 / 35, 10 / 27, 0, 10 / 27, 10 / 35, 10 / 27]) / 6)
    levers = np.array([2.7, 3.5, 2.7, 0, 2.7, 3.5, 2.7])
    np.testing.assert_allclose(squares[2], levers / (levers @ levers), **EXACT)
    error = refused(omnistep.Kinematics, layout=LAYOUTS[0], forward="paper_average")
    assert str(error).startswith("forward_map = ")
    assert error.key == "forward"


def test_weights_say_whom_to_trust():
    layout = omnistep.Layout.omni(wheels=4, circle_radius_m=0.2, wheel_radius_m=0.05)
    front_spins = [10.0, 0.0, 0.0, 0.0]
    assert omnistep.Kinematics(layout=layout).forward(front_spins)[1] == pytest.approx(0.25, abs=1e-12)
    doubted = omnistep.Kinematics(layout=layout, weights=[0.25, 1, 1, 1])
    assert doubted.forward(front_spins)[1] == pytest.approx(1 / 7, abs=1e-12)
    silent = omnistep.Kinematics(layout=layout, weights=np.array([0, 1, 1, 1]))
    np.testing.assert_allclose(silent.forward(front_spins), 0, **EXACT)


@pytest.mark.parametrize(
    ("gives_way", "twist", "factors", "limiting"),
    [
        ("uniform", [0.8, 0, 1.6], (0.8, 0.8), 1),
        ("translation", [0.6, 0, 2.0], (0.6, 1.0), 1),
        ("yaw", [1.0, 0, 1.2], (1.0, 0.6), 1),
    ],
)
def test_desaturate_keeps_what_does_not_give_way(gives_way, twist, factors, limiting):
    # Forward at 1 m/s is 10 rad/s of every wheel, left at 2 rad/s another 10 rad/s of the right ones.
    kinematics = omnistep.Kinematics(layout=MECANUM)
    result = kinematics.desaturate([1.0, 0.0, 2.0], limits_rad_s=16.0, gives_way=gives_way)
    np.testing.assert_allclose(result.twist, twist, **EXACT)
    np.testing.assert_allclose(result.velocities, kinematics.inverse(twist), **EXACT)
    np.testing.assert_allclose([result.translation_factor, result.yaw_factor], factors, **EXACT)
    assert result.limiting == limiting
    assert result.limiting.shape == result.yaw_factor.shape == ()


@pytest.mark.parametrize("layout", LAYOUTS, ids=repr)
@pytest.mark.parametrize("gives_way", ["uniform", "translation", "yaw"])
def test_desaturated_wheels_are_within_their_limits_and_one_of_them_at_it(layout, gives_way):
    kinematics, x = omnistep.Kinematics(layout=layout), twists(200)
    limits = np.linspace(0.4, 0.7, len(layout)) * np.abs(kinematics.inverse(x)).max()
    result = kinematics.desaturate(x, limits_rad_s=limits, gives_way=gives_way)
    assert result.twist.shape == (200, 3)
    assert result.velocities.shape == (200, len(layout))
    assert result.limiting.shape == result.translation_factor.shape == result.yaw_factor.shape == (200,)
    np.testing.assert_allclose(result.velocities, kinematics.inverse(result.twist), **EXACT)
    fullness = np.abs(result.velocities) / limits
    assert fullness.max() <= 1 + 1e-12
    free = result.limiting == -1
    assert 10 < free.sum() < 190  # both happen
    possible = (np.abs(kinematics.inverse(x)) <= limits).all(axis=1)
    assert possible[free].all()
    if gives_way == "uniform":  # the others may reduce a twist whose first part is impossible alone
        assert free[possible].all()
    np.testing.assert_array_equal(result.twist[free], x[free])
    np.testing.assert_allclose(fullness[~free, result.limiting[~free]], 1.0, **EXACT)
    factors = np.stack([result.translation_factor, result.translation_factor, result.yaw_factor], axis=1)
    np.testing.assert_array_equal(result.twist, x * factors)
    for i in (0, 100, 199):
        np.testing.assert_array_equal(
            kinematics.desaturate(x[i], limits_rad_s=list(limits), gives_way=gives_way).twist, result.twist[i]
        )


def test_inputs_stay_as_they_are_and_outputs_are_new():
    kinematics = omnistep.Kinematics(layout=SEVEN)
    x, v, limits = twists(), velocities(SEVEN), np.full(7, 5.0)
    for array in (x, v, limits):
        array.flags.writeable = False  # not even a write that changes nothing
    before = [array.copy() for array in (x, v, limits)]
    desaturated = kinematics.desaturate(x, limits_rad_s=limits)
    outputs = [
        kinematics.inverse(x),
        kinematics.forward(v),
        kinematics.residual(v),
        desaturated.twist,
        desaturated.velocities,
        omnistep.discretize(x, dt_s=0.02),
        omnistep.moved_by(x, x),
    ]
    for array, kept in zip((x, v, limits), before, strict=True):
        np.testing.assert_array_equal(array, kept)
    for out in outputs:
        assert not any(np.shares_memory(out, array) for array in (x, v, limits))
        out[...] = 0.0
    kinematics.inverse_matrix[...] = 0.0
    np.testing.assert_allclose(kinematics.inverse_matrix @ x[0], kinematics.inverse(x[0]), **EXACT)


def test_whatever_the_memory_of_an_array_its_numbers_count():
    inverse, x = omnistep.Kinematics(layout=SEVEN).inverse, twists()
    unaligned = np.frombuffer(b"\0" + x.tobytes(), np.uint8)[1:].view(np.float64).reshape(x.shape)
    assert not unaligned.flags.aligned
    spread = np.zeros((100, 6))
    spread[::2, ::-2] = x
    for same in (np.asfortranarray(x), unaligned, spread[::2, ::-2], x.astype(">f8"), x.tolist(), list(x)):
        np.testing.assert_array_equal(inverse(same), inverse(x))
    np.testing.assert_array_equal(inverse(x.astype(np.float32)), inverse(x.astype(np.float32).astype(np.float64)))
    for same in ([1, 0, -2], np.array([1, 0, -2], np.int8), (1.0, 0.0, -2.0)):
        np.testing.assert_array_equal(inverse(same), inverse(np.array([1.0, 0.0, -2.0])))


def test_wrong_shapes_are_refused_with_the_shapes_there_could_be():
    kinematics = omnistep.Kinematics(layout=SEVEN)
    for bad in (np.zeros(4), np.zeros((5, 4)), np.zeros((2, 5, 3)), np.float64(1.0), 0.3, [], [[1, 2, 3], [1, 2]]):
        for call in (kinematics.inverse, lambda x: kinematics.desaturate(x, limits_rad_s=1.0)):
            error = refused(call, bad)
            assert error.key == "twists"
            assert str(error).endswith("allowed: shape (3,) or (T, 3)")
    assert "an array of shape (5, 4)" in str(refused(kinematics.inverse, np.zeros((5, 4))))
    for bad in (np.zeros(6), np.zeros((7, 6)), np.zeros((7, 1, 7))):
        for call in (kinematics.forward, kinematics.residual):
            error = refused(call, bad)
            assert error.key == "velocities"
            assert str(error).endswith("allowed: shape (7,) or (T, 7)")
    error = refused(omnistep.moved_by, np.zeros((4, 3)), np.zeros((5, 3)))
    assert str(error) == "displacements = an array of shape (5, 3), allowed: the shape of poses, (4, 3)"


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_numbers_that_are_not_finite_are_refused_with_their_place(bad):
    kinematics, name = omnistep.Kinematics(layout=SEVEN), {np.inf: "inf", -np.inf: "-inf"}.get(bad, "NaN")
    x, v = twists(), velocities(SEVEN)
    x[5, 2] = v[49, 0] = bad
    for call in (
        kinematics.inverse,
        lambda x: omnistep.discretize(x, dt_s=0.02),
        lambda x: kinematics.desaturate(x, limits_rad_s=1.0),
    ):
        assert str(refused(call, x)) == f"twists[5, 2] = {name}, allowed: finite numbers"
        assert str(refused(call, x[5])) == f"twists[2] = {name}, allowed: finite numbers"
    for call in (kinematics.forward, kinematics.residual):
        assert str(refused(call, v)) == f"velocities[49, 0] = {name}, allowed: finite numbers"
    assert refused(omnistep.discretize, [0, 0, 0], dt_s=bad).key == "dt_s"


def test_what_is_not_a_number_is_a_type_error_that_names_the_argument():
    kinematics = omnistep.Kinematics(layout=SEVEN)
    for bad in ("abc", ["1", "2", "3"], [1 + 1j, 0, 0], None, [None, 0, 0], {"vx": 1}):
        with pytest.raises(TypeError, match=r"^twists: .*allowed: numbers"):
            kinematics.inverse(bad)
    for bad in ("abc", None, np.zeros((2, 7)), ["5"] * 7):
        with pytest.raises(TypeError, match=r"^limits_rad_s: .*allowed: a number, or one for each wheel"):
            kinematics.desaturate([0, 0, 0], limits_rad_s=bad)
    with pytest.raises(TypeError, match=r"^weights: .*allowed: one number for each wheel"):
        omnistep.Kinematics(layout=SEVEN, weights=1.0)
    for bad in (3, [0.2, 0.2, 0.2], SEVEN):
        with pytest.raises(TypeError, match=r"^wheels: .*allowed: a list of omnistep\.Wheel"):
            omnistep.Layout(wheels=bad)
    with pytest.raises(TypeError, match=r"^wheels: .*allowed: 3 to 8 wheels"):
        omnistep.Layout.omni(wheels=3.5, circle_radius_m=0.2, wheel_radius_m=0.05)
    with pytest.raises(TypeError, match="positional"):
        omnistep.Kinematics(SEVEN)
    with pytest.raises(TypeError, match=r"^position_m: .*allowed: two numbers"):
        omnistep.Wheel(position_m=0.1, radius_m=0.05)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"radius_m": 0.0}, "radius_m = 0, allowed: 0.0001 to 100"),
        ({"gear": -1.0}, "gear = -1, allowed: 0.000001 to 1000"),
        ({"position_m": (0.0, np.nan)}, "position_m = NaN, allowed: -1000 to 1000"),
        ({"rolling_direction": (0, 0)}, "rolling_direction = 0, allowed: a direction of non-zero length"),
        ({"roller_angle_rad": np.inf}, "roller_angle_rad = inf, allowed: -pi/2 to pi/2, ends excluded"),
    ],
)
def test_a_bad_wheel_is_refused_in_the_words_of_the_core(changes, message):
    bad = omnistep.Wheel(**({"position_m": (0.1, 0.2), "radius_m": 0.05} | changes))
    error = refused(omnistep.Layout, wheels=[*MECANUM.wheels[:2], bad, MECANUM.wheels[3]])
    assert str(error) == f"wheel 3: {message}"
    assert error.key == f"wheels[2].{next(iter(changes))}"


def test_layouts_that_cannot_work_are_refused():
    wheel = MECANUM.wheels[0]
    for count in (0, 1, 2, 9):
        assert str(refused(omnistep.Layout, wheels=[wheel] * count)) == f"wheels = {count}, allowed: 3 to 8 wheels"
    for count in (-1, 0, 2, 9, 2**70):
        error = refused(omnistep.Layout.omni, wheels=count, circle_radius_m=0.2, wheel_radius_m=0.05)
        assert str(error) == f"wheels = {count}, allowed: 3 to 8 wheels"
    tank = [omnistep.Wheel(position_m=w.position_m, radius_m=0.1) for w in MECANUM.wheels]
    assert "layout = 2, allowed: rank 3: wheels that move" in str(refused(omnistep.Layout, wheels=tank))
    nearly = [(0.3, -1e-3), (-0.3, 0.0), (0.3, 1e-3)]
    nearly = [omnistep.Wheel(position_m=(0, y), rolling_direction=(1, a), radius_m=0.1) for y, a in nearly]
    assert "condition_number = " in str(refused(omnistep.Layout, wheels=nearly))
    for bad in (0.0, -0.1, np.nan, np.inf):
        assert refused(omnistep.Layout.chugo7, r1_m=bad, r2_m=0.2, radius_m=0.1).key == "r1_m"
        assert refused(omnistep.Layout.chugo7, r1_m=0.2, r2_m=bad, radius_m=0.1).key == "r2_m"
        assert refused(omnistep.Layout.chugo7, r1_m=0.2, r2_m=0.2, radius_m=bad).key == "radius_m"
        assert refused(omnistep.Layout.mecanum4, wheelbase_m=bad, track_m=0.4, radius_m=0.1).key == "wheelbase_m"
        assert refused(omnistep.Layout.mecanum4, wheelbase_m=0.6, track_m=bad, radius_m=0.1).key == "track_m"
        error = refused(omnistep.Layout.omni, wheels=3, circle_radius_m=bad, wheel_radius_m=0.1)
        assert error.key == "circle_radius_m"
        error = refused(omnistep.Layout.omni, wheels=3, circle_radius_m=0.2, wheel_radius_m=bad)
        assert error.key == "wheel_radius_m"


def test_what_is_no_layout_is_a_type_error_that_names_the_argument():
    for wrong in (3, "mecanum4", None):
        with pytest.raises(TypeError, match=r"^layout: <class '\w+'>, allowed: an omnistep\.Layout$"):
            omnistep.Kinematics(layout=wrong)


def test_arguments_of_the_maps_are_refused_with_what_there_is():
    assert str(refused(omnistep.Kinematics, layout=MECANUM, forward="mean")) == (
        'forward = "mean", allowed: least_squares, paper_average'
    )
    error = refused(omnistep.Kinematics, layout=MECANUM, weights=[1, 1, 1])
    assert str(error) == "weights = 3 values, allowed: 4 numbers, one for each wheel"
    error = refused(omnistep.Kinematics, layout=MECANUM, weights=[1, -1, 1, 1])
    assert str(error) == "wheel 2: weight = -1, allowed: 0 to 1000000"
    assert error.key == "weights[1]"
    assert refused(omnistep.Kinematics, layout=MECANUM, weights=[1, np.nan, 1, 1]).key == "weights[1]"
    assert refused(omnistep.Kinematics, layout=MECANUM, weights=[0, 0, 1, 1]).key == "weights"  # two wheels, not three
    error = refused(omnistep.Kinematics, layout=MECANUM, weights=[1] * 4, forward="paper_average")
    assert error.key == "weights"
    desaturate = omnistep.Kinematics(layout=MECANUM).desaturate
    error = refused(desaturate, [1, 0, 0], limits_rad_s=1.0, gives_way="nothing")
    assert str(error) == 'gives_way = "nothing", allowed: uniform, yaw, translation'
    error = refused(desaturate, [1, 0, 0], limits_rad_s=[1, 1, 0, 1])
    assert str(error) == "wheel 3: limit_rad_s = 0, allowed: above 0, to 1e6"
    assert error.key == "limits_rad_s[2]"
    error = refused(desaturate, [1, 0, 0], limits_rad_s=[1.0])
    assert str(error) == "limits_rad_s = 1 value, allowed: 4 numbers, one for each wheel"
    assert refused(desaturate, [1, 0, 0], limits_rad_s=np.nan).key == "limits_rad_s[0]"
    assert refused(omnistep.Wheel, position_m=(1, 2, 3), radius_m=0.1).key == "position_m"


def test_layouts_are_values_that_cannot_change():
    assert len(SEVEN) == len(SEVEN.wheels) == 7
    assert omnistep.Layout(wheels=SEVEN.wheels) == SEVEN != MECANUM
    assert omnistep.Kinematics(layout=SEVEN).layout is SEVEN
    # Five wheels along x, two along y, orthogonal columns: sqrt(5 / 2), whatever the lengths.
    assert SEVEN.condition_number == pytest.approx(np.sqrt(2.5), abs=1e-12)
    for wheel in (*SEVEN.wheels, *MECANUM.wheels):
        assert eval(repr(wheel)) == wheel
    assert MECANUM.wheels[1].position_m == (0.3, -0.2)
    assert MECANUM.wheels[1].roller_angle_rad == np.pi / 4
    kinematics = omnistep.Kinematics(layout=SEVEN)
    for thing, name in [
        (SEVEN, "condition_number"),
        (SEVEN.wheels[0], "radius_m"),
        (kinematics, "layout"),
        (kinematics.desaturate([1, 0, 0], limits_rad_s=1.0), "twist"),
    ]:
        with pytest.raises(AttributeError):
            setattr(thing, name, None)


def test_discretized_twists_end_where_a_straight_line_would():
    x = twists()
    straightened = omnistep.discretize(x, dt_s=0.5)
    ends = omnistep.moved_by(np.zeros_like(x), straightened * 0.5)
    np.testing.assert_allclose(ends, x * 0.5, **EXACT)
    np.testing.assert_array_equal(omnistep.discretize(x[3], dt_s=0.5), straightened[3])
    # A quarter of a circle of radius 5 m to the left, from a pose that faces left.
    quarter = np.pi / 2
    end = omnistep.moved_by([1.0, 2.0, quarter], [5 * quarter, 0.0, quarter])
    np.testing.assert_allclose(end, [1 - 5, 2 + 5, np.pi], rtol=0, atol=1e-14)
