use super::*;
use core::f64::consts::{FRAC_PI_2, PI, TAU};
use proptest::prelude::*;

fn twist(vx_m_s: f64, vy_m_s: f64, wz_rad_s: f64) -> BodyTwist<f64> {
    BodyTwist::from_array([vx_m_s, vy_m_s, wz_rad_s])
}

/// Largest difference of the three numbers of two poses.
fn distance(a: PlanarPose<f64>, b: [f64; 3]) -> f64 {
    let d = [a.x_m - b[0], a.y_m - b[1], a.yaw_rad - b[2]];
    d.iter().fold(0.0, |worst, d| worst.max(d.abs()))
}

#[test]
fn a_constant_twist_moves_along_an_arc() {
    let after = |t: BodyTwist<f64>| PlanarPose::origin().moved_by(&t.over(1.0));
    let arc = after(twist(2.5 * PI, 0.0, FRAC_PI_2));
    assert!(distance(arc, [5.0, 5.0, FRAC_PI_2]) < 1e-12, "{arc:?}");
    // Integrals of R(t) (2, 0.5) over 0..1: (2 sin 1 - 0.5 (1 - cos 1), 2 (1 - cos 1) + 0.5 sin 1).
    let sideways = after(twist(2.0, 0.5, 1.0));
    let expected = [1.453_093_122_549_863, 1.340_130_880_667_668_8, 1.0];
    assert!(distance(sideways, expected) < 1e-15, "{sideways:?}");
    // A whole turn ends where it began.
    let circle = after(twist(3.0, -1.0, TAU));
    assert!(distance(circle, [0.0, 0.0, TAU]) < 1e-15, "{circle:?}"); // 3 m times sin(pi) = 1.2e-16
}

#[test]
fn discretised_commands_end_where_the_command_points() {
    let held = twist(1.0, 0.0, 0.5).discretize(1.0);
    let mut pose = PlanarPose::origin();
    for _ in 0..100 {
        pose = pose.moved_by(&held.over(0.01));
    }
    assert!(distance(pose, [1.0, 0.0, 0.5]) < 1e-13, "{pose:?}"); // 100 roundings of 1.1e-16
}

#[test]
fn discretised_commands_stay_finite_at_and_beyond_a_whole_turn() {
    for turn in [TAU - 1e-9, TAU, TAU + 1e-9, 4.0 * PI, 1e30] {
        for wz in [turn, -turn] {
            let held = twist(1.0, -2.0, wz).discretize(1.0);
            assert!(held.to_array().iter().all(|v| v.is_finite()), "{wz}: {held:?}");
            let single = BodyTwist::from_array([1.0_f32, -2.0, wz as f32]).discretize(1.0);
            assert!(
                single.to_array().iter().all(|v| v.is_finite()),
                "{wz}: {single:?}"
            );
        }
    }
    let overflown = twist(1.0, 0.0, 1e300).discretize(1e300); // the turn is infinite, the twist is not
    assert!(overflown.vx_m_s.is_finite() && overflown.vy_m_s.is_finite());
}

#[test]
fn to_body_undoes_to_world_at_any_heading() {
    for k in -20..20 {
        let pose = PlanarPose {
            x_m: 3.0,
            y_m: -1.0,
            yaw_rad: 0.37 * f64::from(k),
        };
        let twist = BodyTwist {
            vx_m_s: 0.3,
            vy_m_s: -0.2,
            wz_rad_s: 0.5,
        };
        let back = twist.to_world(&pose).to_body(&pose);
        // Two rotations of numbers below 1: a few units in the last place.
        assert!((back.vx_m_s - twist.vx_m_s).abs() < 1e-15);
        assert!((back.vy_m_s - twist.vy_m_s).abs() < 1e-15);
    }
}

proptest! {
    #[test]
    fn discretize_is_the_inverse_of_the_arc(
        vx in -2.0..2.0_f64, vy in -2.0..2.0_f64, angle in -6.2..6.2_f64, dt in 1e-3..2.0_f64,
    ) {
        let command = twist(vx, vy, angle / dt);
        let end = PlanarPose::origin().moved_by(&command.discretize(dt).over(dt));
        // A few roundings of numbers up to 4; the factor that was divided by is multiplied with again.
        prop_assert!(distance(end, [vx * dt, vy * dt, angle]) < 1e-14, "{end:?}");
        // Single precision: 1e-7 in the sine against a shortening of sin(3.1) / 3.1 = 0.013.
        let single = BodyTwist::from_array(command.to_array().map(|v| v as f32)).discretize(dt as f32);
        let (held, size) = (command.discretize(dt), vx.abs() + vy.abs());
        let shortening = (angle / 2.0).sin() / (angle / 2.0);
        let off = (f64::from(single.vx_m_s) - held.vx_m_s).abs();
        prop_assert!(off < 2e-6 * size / (shortening * shortening), "{off}");
    }

    #[test]
    fn an_arc_in_parts_ends_where_the_whole_arc_ends(
        vx in -2.0..2.0_f64, vy in -2.0..2.0_f64, wz in -9.0..9.0_f64, yaw in -7.0..7.0_f64, part in 0.0..1.0_f64,
    ) {
        let start = PlanarPose { x_m: -1.0, y_m: 2.0, yaw_rad: yaw };
        let t = twist(vx, vy, wz);
        let parts = start.moved_by(&t.over(part)).moved_by(&t.over(1.0 - part));
        let whole = start.moved_by(&t.over(1.0));
        // A heading up to 16 rad is rounded to 2e-15, and moves 3 m by as much.
        prop_assert!(distance(parts, [whole.x_m, whole.y_m, whole.yaw_rad]) < 2e-14);
    }

    #[test]
    fn f32_poses_follow_f64(
        dx in -2.0..2.0_f64, dy in -2.0..2.0_f64, dyaw in -6.0..6.0_f64, yaw in -4.0..4.0_f64,
    ) {
        let end = PlanarPose { yaw_rad: yaw, ..PlanarPose::origin() }
            .moved_by(&BodyDisplacement { dx_m: dx, dy_m: dy, dyaw_rad: dyaw });
        let single = PlanarPose { yaw_rad: yaw as f32, ..PlanarPose::origin() }
            .moved_by(&BodyDisplacement::from_array([dx, dy, dyaw].map(|v| v as f32)));
        // A heading up to 10 rad is rounded three times to 5e-7 and moves up to 2.9 m; sines are within 1e-7.
        let single = [single.x_m, single.y_m, single.yaw_rad].map(f64::from);
        prop_assert!(distance(end, single) < 5e-6);
    }

    #[test]
    fn from_point_undoes_at_point_and_the_point_moves_as_commanded(
        vx in -2.0..2.0_f64, vy in -2.0..2.0_f64, wz in -9.0..9.0_f64, x in -2.0..2.0_f64, y in -2.0..2.0_f64,
    ) {
        let command = twist(vx, vy, wz);
        let back = BodyTwist::from_point(command, [x, y]).at_point([x, y]);
        prop_assert!((back.vx_m_s - vx).abs() < 1e-14 && (back.vy_m_s - vy).abs() < 1e-14); // numbers up to 20
        prop_assert_eq!(back.wz_rad_s, wz);
        // Position of the point after a short time, by the poses of the body.
        let place = |p: PlanarPose<f64>| {
            let (sin, cos) = p.yaw_rad.sin_cos();
            [p.x_m + cos * x - sin * y, p.y_m + sin * x + cos * y]
        };
        let dt = 1e-6;
        let of_origin = BodyTwist::from_point(command, [x, y]);
        let [px, py] = place(PlanarPose::origin().moved_by(&of_origin.over(dt)));
        // Acceleration up to 9 * 20 m/s^2 over half a microsecond, and 4e-16 / dt.
        prop_assert!(((px - x) / dt - vx).abs() < 2e-4 && ((py - y) / dt - vy).abs() < 2e-4);
    }
}
