use super::*;

const T: f64 = 0.001;
const G: f64 = GRAVITY_M_S2;

/// A base that turns: the angles of a unit, and those that the base has, after each period.
fn turn(
    periods: usize,
    rates: impl Fn(f64) -> [f64; 3],
    read: impl Fn(f64, &mut Imu<f64>),
    mut seen: impl FnMut(f64, [f64; 2], [f64; 2]),
) {
    let mut imu = Imu::silent();
    let mut up = nalgebra::Vector3::z(); // of the world, in the base's axes
    for k in 0..periods {
        let time_s = T * k as f64;
        let rate = nalgebra::Vector3::from(rates(time_s));
        up = nalgebra::Rotation3::new(-rate * T) * up;
        imu.rate_rad_s = rate.into();
        imu.specific_force_m_s2 = (G * up).into();
        read(time_s, &mut imu);
        let _ = imu.update_angles(T);
        seen(time_s, [imu.roll_rad, imu.pitch_rad], [up.y.asin(), up.x.asin()]);
    }
}

/// The base nods, sways and spins, by up to 25 degrees.
fn rates(time_s: f64) -> [f64; 3] {
    [0.3 * (1.9 * time_s).cos(), 0.3 * (1.7 * time_s).cos(), 0.6]
}

fn error(angles: [f64; 2], wanted: [f64; 2]) -> f64 {
    (angles[0] - wanted[0]).abs().max((angles[1] - wanted[1]).abs())
}

#[test]
fn angles_follow_a_base_that_nods_sways_and_spins() {
    let (mut most, mut widest) = (0.0_f64, 0.0_f64);
    turn(
        60_000,
        rates,
        |_, _| {},
        |_, angles, wanted| {
            most = most.max(error(angles, wanted));
            widest = widest.max(error(wanted, [0.0; 2]));
        },
    );
    assert!((0.3..0.6).contains(&widest), "the base turns by {widest} rad");
    // A step takes the rates of its end for those of the whole period: 1 ms of 1 rad/s.
    assert!(most < 0.001, "{most}");
}

#[test]
fn a_gyro_that_is_off_tilts_the_angles_by_its_zero_times_the_time_constant() {
    let zero_rad_s = 0.3_f64.to_radians();
    let mut last = 0.0;
    let biased = |_: f64, imu: &mut Imu<f64>| imu.rate_rad_s[1] += zero_rad_s;
    turn(20_000, |_| [0.0; 3], biased, |_, angles, _| last = angles[1]);
    // A gyro alone would be off by 6 degrees.
    assert!((last + zero_rad_s * ATTITUDE_S).abs() < 1e-4, "{last}");
}

#[test]
fn neither_a_jolt_nor_a_fall_nor_a_start_tilts_the_angles_by_much() {
    let largest = |begin_s: f64, end_s: f64, force: fn([f64; 3]) -> [f64; 3]| {
        let mut most = 0.0_f64;
        let pushed = |time_s: f64, imu: &mut Imu<f64>| {
            if (begin_s..end_s).contains(&time_s) {
                imu.specific_force_m_s2 = force(imu.specific_force_m_s2);
            }
        };
        turn(8000, rates, pushed, |_, angles, wanted| {
            most = most.max(error(angles, wanted))
        });
        most
    };
    assert!(
        largest(1.0, 1.3, |[x, y, z]| [x - 20.0, y, z]) < 0.001,
        "a jolt against an edge"
    );
    assert!(largest(1.0, 1.3, |_| [0.0; 3]) < 0.001, "a fall");
    // 1 m/s^2 for half a second reads as 0.1 rad, of which a quarter is taken in.
    let start = largest(1.0, 1.5, |[x, y, z]| [x + 1.0, y, z]);
    assert!(start > 0.01 && start < 0.03, "{start}");
}

#[test]
fn what_is_no_number_changes_no_angle() {
    let mut imu = Imu::<f32>::silent();
    // A unit that begins in a jolt or in a fall does not say where up is.
    for begin in [[0.0; 3], [30.0, 0.0, 9.81]] {
        (imu.rate_rad_s, imu.specific_force_m_s2) = ([0.0; 3], begin);
        assert!(!imu.update_angles(0.001) && imu.pitch_rad.is_nan(), "{begin:?}");
    }
    imu.specific_force_m_s2 = [1.0, 2.0, 9.5];
    assert!(imu.update_angles(0.001));
    let angles = [imu.roll_rad, imu.pitch_rad];
    for nonsense in [f32::NAN, f32::INFINITY, -f32::INFINITY, f32::MAX] {
        for field in 0..7 {
            let mut broken = imu;
            let mut period_s = 0.001;
            match field {
                0..3 => broken.rate_rad_s[field] = nonsense,
                3..6 => broken.specific_force_m_s2[field - 3] = nonsense,
                _ => period_s = nonsense,
            }
            assert!(!broken.update_angles(period_s), "{nonsense} in {field}");
            assert_eq!([broken.roll_rad, broken.pitch_rad], angles);
        }
    }
}

#[test]
fn angles_stay_angles_whatever_is_read() {
    // A base that rolls over and spins as no vehicle does: the angles are wrong then, but bounded, and right later.
    let mut last = 1.0;
    let wild = |time_s: f64| {
        if time_s < 5.0 {
            [40.0, -30.0, 50.0]
        } else {
            [0.0; 3]
        }
    };
    turn(
        30_000,
        wild,
        |time_s, imu| {
            if time_s >= 5.0 {
                imu.specific_force_m_s2 = [0.0, 0.0, G];
            }
        },
        |_, angles, _| {
            assert!(
                angles.iter().all(|angle| angle.abs() <= LARGEST_LEAN_RAD),
                "{angles:?}"
            );
            last = error(angles, [0.0; 2]);
        },
    );
    assert!(last < 1e-4, "{last}");
}
