//! What a rim does against the world while the frame that carries its wheel turns.
//!
//! docs/derivations.md: What a carrier's turning does to a rim.

use omni_sim::config::Override;
use omni_sim::{Trace, run};

use crate::engines::{load, on_both_engines};

/// Slope of the ramp \[rad\]: so gentle that its foot hardly knocks.
const SLOPE: f64 = 0.1;
const SPEED_M_S: f64 = 0.3;

fn up_the_ramp(overrides: &[&str]) -> Trace {
    let slope = format!("terrain.slope_rad={SLOPE}");
    let common = [
        &slope,
        "terrain.length_m=2.0",
        "terrain.friction=0.9",
        "control.policy=independent",
    ];
    let overrides: Vec<_> = common
        .iter()
        .chain(overrides)
        .map(|text| Override::parse(text).expect("KEY=VALUE"))
        .collect();
    run(&load("ramp", &overrides).expect("valid")).expect("runs")
}

/// Means of a wheel's slip, and of what it would be were the encoder's reading the rim's whole turning,
/// each the way the wheel moves, over the rows where the vehicle's origin is between two places \[m/s\].
fn slips(trace: &Trace, between_m: [f64; 2], wheel: usize, way_per_rad: f64) -> [f64; 2] {
    let x = trace.column("pose_x_m").expect("a column");
    let signal = |name: &str| trace.wheel(name, wheel).expect("a signal");
    let (rim, along, read) = (signal("rim_m_s"), signal("along_m_s"), signal("measured_rad_s"));
    let rows: Vec<_> = (0..trace.rows() - 1)
        .filter(|row| x[*row] > between_m[0] && x[*row] < between_m[1])
        .collect();
    assert!(rows.len() > 300, "{} rows", rows.len());
    let mean = |of: &dyn Fn(usize) -> f64| {
        rows.iter()
            .map(|row| of(*row) * along[*row].signum())
            .sum::<f64>()
            / rows.len() as f64
    };
    // The encoder is read at the start of the next period.
    [
        mean(&|row| rim[row] - along[row]),
        mean(&|row| way_per_rad * read[row + 1] - along[row]),
    ]
}

fn a_wheel_that_rolls_on_a_frame_that_pitches_does_not_slip() {
    // The front row is on the slope, which starts at 0.7 m, and the middle row, R1 = 0.3 m behind,
    // before it: the front frame pitches by v tan(slope) / R1.
    let (trace, between_m, radius_m) = (up_the_ramp(&[]), [0.5, 0.65], 0.066);
    let pitch_rate = SPEED_M_S * SLOPE.tan() / 0.3;
    let taken = radius_m * pitch_rate; // 6.6 mm/s, a slip of 2 %
    for (wheel, expected) in [(4, taken), (6, taken), (3, 0.0), (0, 0.0), (2, 0.0)] {
        let [slip, by_encoder] = slips(&trace, between_m, wheel, radius_m);
        // Steady rolling: what is left is creep of the contacts in rapier, a third of a thousandth.
        assert!(slip.abs() < 5e-4 * SPEED_M_S, "wheel {}: {slip} m/s", wheel + 1);
        // 1 %, as the front row is slower by the slope's cosine and still speeding up; and the creep.
        let off = by_encoder - expected;
        assert!(
            off.abs() < 0.015 * taken + 5e-4 * SPEED_M_S,
            "wheel {}: {by_encoder} m/s, {expected} m/s",
            wheel + 1
        );
    }
    let ratio = trace.wheel("slip_ratio", 4).expect("a signal");
    let x = trace.column("pose_x_m").expect("a column");
    let row = x.iter().position(|x| *x > 0.6).expect("there");
    assert!(ratio[row].abs() < 2e-3, "{}", ratio[row]); // counted before: 0.022
}

fn a_mecanum_wheel_that_rolls_on_a_platform_that_pitches_or_rolls_does_not_slip() {
    let (radius_m, cos) = (0.076, 0.5_f64.sqrt());
    let sideways = [
        "vehicle=mecanum4",
        "start.heading_rad=1.5707963267948966",
        "command.vx_m_s=0",
        "command.vy_m_s=-0.3",
    ];
    // The wheels that follow, still on the level: on a slope a ball is not quite a mecanum wheel.
    // The origin is at 0.6 m: the wheels ahead, 0.25 m and 0.2 m, are on the slope.
    for (keys, lever_m, following) in [(&sideways[..1], 0.5, [2, 3]), (&sideways[..], 0.4, [0, 2])] {
        let trace = up_the_ramp(keys);
        let rate = SPEED_M_S * SLOPE.tan() / lever_m;
        // The roller's axis stands at 45 degrees: of pitching or rolling as much goes across the
        // push as the cosine says, once.
        let taken = radius_m * cos * rate;
        for wheel in following {
            let [slip, by_encoder] = slips(&trace, [0.55, 0.65], wheel, radius_m * cos);
            // rapier's balls creep by half a millimetre a second.
            assert!(
                slip.abs() < 0.2 * taken,
                "wheel {wheel}: {slip} m/s of {taken} m/s"
            );
            // Sideways the climb takes a twentieth of the speed; and the cosines of slope and lean.
            // The cosine twice would be 0.29 off.
            let counted = by_encoder - slip;
            assert!(
                (counted / taken - 1.0).abs() < 0.08,
                "wheel {wheel}: {counted} m/s, {taken} m/s"
            );
        }
    }
}

fn what_links_make_of_rolling_wheels_is_in_the_spread_and_not_in_the_linkage_spread() {
    let outcome = *up_the_ramp(&[]).outcome();
    // While the front frame rises two of five wheels read 2.2 % more: a deviation of 0.022 sqrt(0.4
    // 0.6) = 0.011. That is about a third of the time from the foot on; the square root of it is 0.6.
    assert!(
        (0.005..0.009).contains(&outcome.speed_ratio_std),
        "{}",
        outcome.speed_ratio_std
    );
    // All wheels roll: what is left is creep of the contacts in rapier.
    assert!(outcome.slip_speed_std < 1e-3, "{}", outcome.slip_speed_std);
}

fn the_realised_reference_is_the_commanded_one_but_where_a_policy_reduces_it() {
    let climb = |policy: &str| {
        let keys = [
            Override::new("control.policy", policy),
            Override::new("vehicle.motor.stall_torque_n_m", 1.4),
        ];
        *run(&load("step", &keys).expect("valid")).expect("runs").outcome()
    };
    for policy in ["independent", "scale_torques", "shared_integral"] {
        let outcome = climb(policy);
        assert_eq!(
            outcome.speed_error_realised_rms, outcome.speed_error_rms,
            "{policy}"
        );
    }
    // At the riser and at its stall all references are reduced together, and wheels follow the
    // reduced ones: 0.50 instead of 0.73.
    let outcome = climb("scale_references");
    let (realised, commanded) = (outcome.speed_error_realised_rms, outcome.speed_error_rms);
    assert!(realised < 0.9 * commanded, "{realised}, {commanded}");
}

on_both_engines! {
    what_links_make_of_rolling_wheels_is_in_the_spread_and_not_in_the_linkage_spread,
    the_realised_reference_is_the_commanded_one_but_where_a_policy_reduces_it,
    a_wheel_that_rolls_on_a_frame_that_pitches_does_not_slip,
    a_mecanum_wheel_that_rolls_on_a_platform_that_pitches_or_rolls_does_not_slip,
}
