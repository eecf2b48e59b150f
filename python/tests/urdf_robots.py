"""URDFs of public robots, written anew from their published numbers, and of a small one."""

import math

HALF_TURN = math.pi / 2
#: Of the front left, front right, rear left and rear right wheel.
CORNERS = ((1, 1), (1, -1), (-1, 1), (-1, -1))


def link(
    name, kilograms=0.0, moments=(0.0, 0.0, 0.0), products=(0.0, 0.0, 0.0), com=(0, 0, 0), rpy=(0, 0, 0), shape=""
):
    """A link; without mass it has no inertial."""
    if not kilograms:
        return f'<link name="{name}">{shape}</link>'
    (xx, yy, zz), (xy, xz, yz) = moments, products
    return (
        f'<link name="{name}"><inertial><origin xyz="{words(com)}" rpy="{words(rpy)}"/><mass value="{kilograms}"/>'
        f'<inertia ixx="{xx}" iyy="{yy}" izz="{zz}" ixy="{xy}" ixz="{xz}" iyz="{yz}"/></inertial>{shape}</link>'
    )


def joint(name, kind, parent, child, xyz=(0, 0, 0), rpy=(0, 0, 0), axis=(0, 1, 0), more=""):
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{words(xyz)}" rpy="{words(rpy)}"/><axis xyz="{words(axis)}"/>{more}</joint>'
    )


def words(numbers):
    return " ".join(str(number) for number in numbers)


def cylinder(radius, length=0.05):
    """A cylinder that collides, about y."""
    shape = f'<geometry><cylinder radius="{radius}" length="{length}"/></geometry>'
    return f'<collision><origin xyz="0 0 0" rpy="{HALF_TURN} 0 0"/>{shape}</collision>'


MESH = '<collision><geometry><mesh filename="package://robot/wheel.stl"/></geometry></collision>'


def rosbot_xl():
    """Husarion ROSbot XL with mecanum wheels: 170 x 270 mm, radius 50 mm; body 3.5 kg, wheels 0.4 kg."""
    parts = [link("base_link"), joint("base_to_body_joint", "fixed", "base_link", "body_link", (0, 0, 0.05))]
    products = (-0.000020968097, 0.000010399694, 0.000059372953)
    parts.append(link("body_link", 3.5, (0.01393, 0.01081, 0.02048), products, (0, 0, 0.0358)))
    for side, x, y in (("fl", 1, 1), ("fr", 1, -1), ("rl", -1, 1), ("rr", -1, -1)):
        parts.append(link(f"{side}_wheel_link", 0.4, (0.0003145, 0.0004561, 0.0003145), shape=cylinder(0.05)))
        limit = '<limit effort="1.5" velocity="30.0"/><dynamics damping="0.001" friction="0.001"/>'
        at = (x * 0.085, y * 0.135, 0)
        parts.append(joint(f"{side}_wheel_joint", "continuous", "body_link", f"{side}_wheel_link", at, more=limit))
    return f'<robot name="rosbot_xl">{"".join(parts)}</robot>'


def panther():
    """Husarion Panther with mecanum wheels WH02, meshes all of them: 440 x 678.5 mm, radius 101.6 mm, 43 and 2.4 kg."""
    parts = [link("base_link"), joint("base_to_body_joint", "fixed", "base_link", "body_link", (0, 0, 0.1016))]
    parts.append(link("body_link", 43.0, (2.630036, 2.463509, 4.611945), (-0.023480, 0.052320, 0.009337), shape=MESH))
    for side, x, y in (("fl", 1, 1), ("fr", 1, -1), ("rl", -1, 1), ("rr", -1, -1)):
        parts.append(link(f"{side}_wheel_link", 2.4, (0.010050, 0.016496, 0.010068), shape=MESH))
        limit = '<limit effort="34.5" velocity="10.958"/><dynamics damping="0.01" friction="0.01"/>'
        at = (x * 0.22, y * 0.33925, 0)
        parts.append(joint(f"{side}_wheel_joint", "continuous", "body_link", f"{side}_wheel_link", at, more=limit))
    return f'<robot name="panther">{"".join(parts)}</robot>'


def ridgeback():
    """Clearpath Ridgeback: its front wheels are on a rocker about x; 638 x 551 mm, radius 75.9 mm."""
    turned = (HALF_TURN, 0, HALF_TURN)
    moments, products = (4.4744, 7.1624, 4.6155), (0.03098, 0.003647, 0.1228)
    parts = [link("base_link"), joint("base_link_joint", "fixed", "base_link", "chassis_link")]
    parts.append(link("chassis_link", 165.304, moments, products, (0.012, 0.002, 0.067), turned))
    parts += [link("axle_link"), joint("axle_joint", "fixed", "chassis_link", "axle_link", (0, 0, 0.05))]
    parts.append(link("imu_link", 0.001, (1e-9, 1e-9, 1e-9)))
    parts.append(joint("imu_joint", "fixed", "chassis_link", "imu_link", (0.2085, -0.2902, 0.1681)))
    for end, x, kind in (("front", 1, "revolute"), ("rear", -1, "fixed")):
        moments, products = (0.0288, 0.4324, 0.4130), (2.20484e-6, -1.3145e-5, 1.8944e-3)
        parts.append(link(f"{end}_rocker_link", 10.267, moments, products, rpy=turned))
        limit = '<limit lower="-0.08726" upper="0.08726" effort="0" velocity="0"/>'
        at = (x * 0.319, 0, 0)
        parts.append(joint(f"{end}_rocker", kind, "axle_link", f"{end}_rocker_link", at, axis=(1, 0, 0), more=limit))
        for side, y in (("left", 1), ("right", -1)):
            name = f"{end}_{side}_wheel"
            parts.append(link(f"{name}_link", 2.3, (3.3212e-3, 6.6424e-3, 3.3212e-3), shape=cylinder(0.0759, 0.079)))
            parts.append(joint(name, "continuous", f"{end}_rocker_link", f"{name}_link", (0, y * 0.2755, 0)))
    return f'<robot name="ridgeback">{"".join(parts)}</robot>'


def youbot():
    """KUKA youBot: wheels on links that are named casters; 456 x 316 mm; base 22 kg, wheels 0.4 kg, an arm joint."""
    moments, products = (
        (5.652232699207, 5.669473158652, 3.683196351726),
        (-0.009719934438, 1.293988226423, -0.007379583694),
    )
    parts = [
        link("base_footprint"),
        joint("base_footprint_joint", "fixed", "base_footprint", "base_link", (0, 0, 0.084)),
    ]
    parts.append(link("base_link", 22.0, moments, products))
    parts += [link("arm_link_1", 1.39, (0.01, 0.01, 0.01))]
    limit = '<limit lower="0" upper="5.9" effort="9" velocity="1.57"/>'
    parts.append(
        joint("arm_joint_1", "revolute", "base_link", "arm_link_1", (0.167, 0, 0.161), axis=(0, 0, 1), more=limit)
    )
    for side, x, y in (("fl", 1, 1), ("fr", 1, -1), ("bl", -1, 1), ("br", -1, -1)):
        inertia = (0.012411765597, 0.015218160428, 0.011763977943)
        parts.append(link(f"caster_link_{side}", 0.1, inertia))
        at = (x * 0.228, y * 0.158, -0.034)
        parts.append(joint(f"caster_joint_{side}", "fixed", "base_link", f"caster_link_{side}", at, axis=(0, 0, 1)))
        parts.append(link(f"wheel_link_{side}", 0.4, inertia, shape=cylinder(0.05, 0.005)))
        parts.append(joint(f"wheel_joint_{side}", "continuous", f"caster_link_{side}", f"wheel_link_{side}"))
    return f'<robot name="youbot">{"".join(parts)}</robot>'


def rosmaster_x3():
    """Yahboom Rosmaster X3: 160 x 149 mm (its separation of 169 mm less twice 10), radius 32.5 mm; 4.6 and 0.1 kg."""
    x, y, z = 0.3, 0.1386, 0.19725
    box = tuple(4.6 / 12 * sides for sides in (y * y + z * z, x * x + z * z, x * x + y * y))
    parts = [link("base_footprint"), joint("base_joint", "fixed", "base_footprint", "base_link", (0, 0, 0.0325))]
    parts.append(link("base_link", 4.6, box, com=(-0.031, 0, z / 2)))
    across = 0.1 / 12 * (3 * 0.0325**2 + 0.0304**2)
    for side, x, y in (("front_left", 1, 1), ("front_right", 1, -1), ("back_left", -1, 1), ("back_right", -1, -1)):
        inertia = (across, 0.1 / 2 * 0.0325**2, across)
        parts.append(link(f"{side}_wheel_link", 0.1, inertia, shape=cylinder(0.0325, 0.0304)))
        at = (x * 0.08, y * 0.0745, -0.0325)
        parts.append(joint(f"{side}_wheel_joint", "continuous", "base_link", f"{side}_wheel_link", at))
    return f'<robot name="rosmaster_x3">{"".join(parts)}</robot>'


def robotino(wheel_kg=0.4):
    """Festo Robotino: three omni wheels 128 and 130 mm from the middle, as meshes; base 20 kg."""
    parts = [link("base_link", 20, (1.0, 1.0, 1.0))]
    for number, (at, yaw, turn) in enumerate(
        [((0.065, 0.11, 0.04), 1.04719666667, -1), ((-0.13, 0, 0.04), 0, 1), ((0.065, -0.11, 0.04), -1.04719666667, -1)]
    ):
        parts.append(link(f"wheel{number}_link", wheel_kg, (1.0, 1.0, 1.0), shape=MESH))
        rpy, axis = (0, 0, yaw), (turn, 0, 0)
        parts.append(joint(f"wheel{number}_joint", "continuous", "base_link", f"wheel{number}_link", at, rpy, axis))
    return f'<robot name="robotino">{"".join(parts)}</robot>'


def lekiwi():
    """LeKiwi, its three drives only: links that are turned in each other, an axle along z of the servo, meshes."""
    half, pi = HALF_TURN, math.pi
    parts = [link("base_plate_layer1-v5", 1.9468624348, (0.00563711, 0.00562844, 0.01124965))]
    drives = [
        ("-2", (-0.02, -0.1, 0), (pi, 0, 0), (-0.01214, -0.016, -0.00761), (pi, half, 0)),
        ("-1", (0.07928203, 0.02267949, 0), (0, 0, 0), (-0.0077864, -0.01851355, 0.00761), (0, -half, 0)),
        ("", (-0.05928203, 0.05732051, 0), (pi, 0, 0), (0.0199264, -0.00251355, -0.00761), (pi, half, 0)),
    ]
    axles = [
        ((0.01025, -0.0352, -0.03275), (0, 0, -1), (0, 0, -0.007175)),
        ((0.01025, 0.04636234, -0.01480191), (0.866025, 0, 0.5), (0.00621373, 0, 0.0035875)),
        ((0.01025, -0.01076234, 0.04685909), (-0.866025, 0, 0.5), (-0.00621373, 0, 0.0035875)),
    ]
    middles = [(0, 0.015875, 0), (0.013748156, -0.0079375, 0), (-0.013748156, -0.0079375, 0)]
    for (end, mount, mount_rpy, servo, servo_rpy), (axle, axis, hub), middle in zip(
        drives, axles, middles, strict=True
    ):
        mounted, driven, turning, wheel = (
            f"{part}{end}"
            for part in ("drive_motor_mount-v11", "ST3215_Servo_Motor-v1", "omni_wheel_mount-v5", "body-v1")
        )
        parts += [link(mounted, 0.0472422767, (5e-6, 5e-6, 9e-6)), link(driven, 0.0658962962, (1.8e-5, 1.2e-5, 1.2e-5))]
        parts += [link(turning, 0.1235708646), link(wheel, 1.3542854082, (0.00129, 0.00129, 0.00129), com=middle)]
        parts.append(joint(f"{mounted}_rigid", "fixed", "base_plate_layer1-v5", mounted, mount, mount_rpy))
        parts.append(joint(f"{driven}_rigid", "fixed", mounted, driven, servo, servo_rpy))
        parts.append(joint(f"{driven}_Revolute", "continuous", driven, turning, axle, (-half, half, 0), axis))
        parts.append(joint(f"{wheel}_rigid", "fixed", turning, wheel, hub, (-half, 0, 0)))
    return f'<robot name="LeKiwi">{"".join(parts)}</robot>'


def four(body, *more, radius=0.05, axis=(0, 1, 0)):
    """A robot on four mecanum wheels, 400 x 300 mm, whose base has other parts."""
    parts = [body, *more]
    for side, (x, y) in zip(("fl", "fr", "rl", "rr"), CORNERS, strict=True):
        parts.append(link(f"{side}_wheel", 0.5, (0.0003, 0.0006, 0.0003), shape=cylinder(radius)))
        parts.append(joint(side, "continuous", "base", f"{side}_wheel", (0.2 * x, 0.15 * y, radius), axis=axis))
    return f'<robot name="four">{"".join(parts)}</robot>'


BODY = link("base", 8.0, (0.05, 0.06, 0.07), com=(0, 0, 0.1))


# Each robot, options, positions of its wheels [m], radius [m], mass of a wheel and of all [kg], inertia about the axle.
ROBOTS = {
    "rosbot_xl": (rosbot_xl, [], [(0.085 * x, 0.135 * y) for x, y in CORNERS], 0.05, 0.4, 3.5 + 1.6, 0.0004561),
    "panther": (
        panther,
        ["--wheels", "mecanum", "--radius", "0.1016"],
        [(0.22 * x, 0.33925 * y) for x, y in CORNERS],
        0.1016,
        2.4,
        43 + 9.6,
        0.016496,
    ),
    "ridgeback": (
        ridgeback,
        ["--wheels", "mecanum"],
        [(0.319 * x, 0.2755 * y) for x, y in CORNERS],
        0.0759,
        2.3,
        165.304 + 0.001 + 2 * 10.267 + 4 * 2.3,
        6.6424e-3,
    ),
    "youbot": (
        youbot,
        ["--radius", "0.0475"],
        [(0.228 * x, 0.158 * y) for x, y in CORNERS],
        0.0475,
        0.4,
        22 + 1.39 + 4 * 0.1 + 4 * 0.4,
        0.015218160428,
    ),
    "rosmaster_x3": (
        rosmaster_x3,
        [],
        [(0.08 * x, 0.0745 * y) for x, y in CORNERS],
        0.0325,
        0.1,
        5.0,
        0.1 / 2 * 0.0325**2,
    ),
    "robotino": (robotino, ["--radius", "0.04"], [(0.065, 0.11), (-0.13, 0), (0.065, -0.11)], 0.04, 0.4, 21.2, 1.0),
}
