//! Rotations as unit quaternions x, y, z, w.

/// A turn by `angle` \[rad\] about `axis` (any length but zero), by the right-hand rule.
pub(crate) fn about(axis: [f64; 3], angle: f64) -> [f64; 4] {
    let length = axis.iter().map(|a| a * a).sum::<f64>().sqrt();
    let (sin, cos) = (libm::sin(angle / 2.0), libm::cos(angle / 2.0));
    [
        sin * axis[0] / length,
        sin * axis[1] / length,
        sin * axis[2] / length,
        cos,
    ]
}

/// A vector turned: v + 2 u x (u x v + w v).
pub(crate) fn rotate([x, y, z, w]: [f64; 4], v: [f64; 3]) -> [f64; 3] {
    let cross = |a: [f64; 3], b: [f64; 3]| {
        [
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ]
    };
    let u = [x, y, z];
    let inner = cross(u, v);
    let outer = cross(u, [0, 1, 2].map(|k| inner[k] + w * v[k]));
    [0, 1, 2].map(|k| v[k] + 2.0 * outer[k])
}

/// The second turn, then the first.
pub(crate) fn after([a, b, c, w]: [f64; 4], [d, e, f, v]: [f64; 4]) -> [f64; 4] {
    [
        w * d + a * v + b * f - c * e,
        w * e - a * f + b * v + c * d,
        w * f + a * e - b * d + c * v,
        w * v - a * d - b * e - c * f,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_about_an_axis_follows_the_right_hand_rule() {
        let nose_down = rotate(about([0.0, 2.0, 0.0], 0.1), [1.0, 0.0, 0.0]);
        let expected = [0.1_f64.cos(), 0.0, -(0.1_f64.sin())];
        for (got, expected) in nose_down.iter().zip(expected) {
            assert!((got - expected).abs() < 1e-15);
        }
    }
}
