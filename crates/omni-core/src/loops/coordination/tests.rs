use super::*;
use proptest::prelude::*;

fn symmetric<const N: usize>(limits: [f64; N]) -> TorqueRanges<f64, N> {
    TorqueRanges {
        lower_n_m: limits.map(|l| -l),
        upper_n_m: limits,
    }
}

#[test]
fn torques_of_wheels_that_turn_backwards_are_limited_too() {
    // The hazard of eq. (11) as printed (no absolute value): -392.26 mN.m would pass the test tau <= tau_max.
    let requested = [100.0, -392.26, 250.0, 180.0, 90.0, 60.0, 120.0];
    let factor = torque_factor(&requested, &symmetric([196.13; 7]));
    assert_eq!(factor, 0.5);
    assert_eq!(requested[1] * factor, -196.13);
}

#[test]
fn an_exhausted_wheel_stops_all_under_equation_12_and_none_above_the_floor() {
    let ranges = TorqueRanges {
        lower_n_m: [-1.0; 2],
        upper_n_m: [0.0, 1.0],
    };
    assert_eq!(torque_factor(&[0.5, 0.5], &ranges), 0.0);
    assert_eq!(reference_factor(&[1.5, 1.0], &[1.0, 1.0], &ranges, 0.3), 0.3);
}

proptest! {
    #[test]
    fn torque_ratios_are_kept_and_the_worst_wheel_is_at_its_limit(
        requested in prop::array::uniform7(-5.0..5.0_f64), limits in prop::array::uniform7(0.01..3.0_f64),
    ) {
        let ranges = symmetric(limits);
        let c = torque_factor(&requested, &ranges);
        let fullest = requested.iter().zip(limits).map(|(t, l)| (c * t).abs() / l).fold(0.0, f64::max);
        prop_assert!(fullest <= 1.0 + 1e-15); // one division, one multiplication
        prop_assert!(c == 1.0 || fullest >= 1.0 - 1e-15);
    }

    #[test]
    fn the_reference_factor_is_the_largest_that_no_wheel_s_own_reference_overdrives(
        a in prop::array::uniform7(-0.9..0.9_f64), b in prop::array::uniform7(-5.0..5.0_f64),
        limits in prop::array::uniform7(1.0..3.0_f64),
    ) {
        // Offsets within limits: some factor of 0 or more then serves every wheel.
        let ranges = symmetric(limits);
        let whole: [f64; 7] = core::array::from_fn(|i| a[i] + b[i]);
        let s = reference_factor(&whole, &b, &ranges, 0.0);
        let torque = |s: f64, i: usize| a[i] + s * b[i];
        let over = |s: f64| (0..7).any(|i| torque(s, i) * b[i].signum() > limits[i]);
        prop_assert!((0.0..=1.0).contains(&s));
        prop_assert!(!over(s - 1e-12), "s = {s} overdrives a wheel");
        prop_assert!(s == 1.0 || over(s + 1e-9), "s = {s} could be larger"); // slopes are rarely below 1e-3
    }
}
