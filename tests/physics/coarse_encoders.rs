//! Encoders of few counts: what estimators of velocity make of them, and what the loops then do.

use omni_sim::config::Override;
use omni_sim::{Trace, run};

use crate::engines::{load, on_the_fast_engine};

/// Counts a turn of a small robot's encoders, and what one of them is in a control period \[rad/s\].
const COUNTS: u32 = 360;
const ONE_RAD_S: f64 = std::f64::consts::TAU / 360.0 / 1e-3;

fn drive(scenario: &str, velocity: Option<&str>, more: &[&str]) -> Trace {
    let mut keys = vec![format!("sensors.encoder_counts={COUNTS}")];
    keys.extend(velocity.map(|kind| format!("sensors.encoder_velocity={kind}")));
    keys.extend(more.iter().map(|key| (*key).to_owned()));
    let overrides: Vec<_> = keys
        .iter()
        .map(|text| Override::parse(text).expect("KEY=VALUE"))
        .collect();
    run(&load(scenario, &overrides).expect("valid")).expect("runs")
}

/// Root mean square of what is read of a wheel beyond how it turned at the end of the period before
/// \[rad/s\], in some rows.
fn noise_rad_s(trace: &Trace, rows: std::ops::Range<usize>) -> f64 {
    let read = trace.wheel("measured_rad_s", 3).expect("a signal");
    let rim = trace.wheel("rim_m_s", 3).expect("a signal");
    let square = |row: usize| (read[row] - rim[row - 1] / 0.066).powi(2);
    (rows.clone().map(square).sum::<f64>() / rows.len() as f64).sqrt()
}

/// The same motors under every reading: a soft loop, which a count of 17 rad/s does not throw from limit to limit.
const SOFT: [&str; 3] = [
    "control.policy=independent",
    "vehicle.gains.kp_n_m_s_rad=0.1",
    "vehicle.gains.ki_n_m_rad=0.5",
];

fn the_noise_of_a_steady_velocity_falls_as_the_estimators_say() {
    let keys = [&SOFT[..], &["duration_s=3.0"]].concat();
    let noise = |velocity| noise_rad_s(&drive("flat", velocity, &keys), 2000..3000);
    let plain = noise(None);
    // At 4.5 rad/s a count comes every 3.8 periods: zeros and 17.5 rad/s, whose deviation is the
    // root of their product, 7.7 rad/s.
    let expected = (4.545_f64 * (ONE_RAD_S - 4.545)).sqrt();
    assert!((plain / expected - 1.0).abs() < 0.1, "{plain} rad/s, {expected}");
    let window = noise(Some("{ kind = \"window\", periods = 16 }"));
    let edges = noise(Some("{ kind = \"edges\" }"));
    let observer = noise(Some("{ kind = \"observer\", bandwidth_rad_s = 50.0 }"));
    // Their bounds at a steady velocity: a count over 16 periods, and the bandwidth times a count over e.
    assert!(window < ONE_RAD_S / 16.0, "{window}");
    assert!(
        observer < 50.0 * ONE_RAD_S * 1e-3 / std::f64::consts::E,
        "{observer}"
    );
    // Stamps read exactly what the velocity was on the way: what is left is how the loop makes it change.
    assert!(edges < 0.1, "{edges}");
    // And the vehicle goes as fast as commanded by every one of them.
    for velocity in ["{ kind = \"window\", periods = 16 }", "{ kind = \"edges\" }"] {
        let trace = drive("flat", Some(velocity), &keys);
        let vx = trace.column("twist_vx_m_s").expect("a column");
        let mean = vx[2000..].iter().sum::<f64>() / (vx.len() - 2000) as f64;
        assert!((mean - 0.3).abs() < 0.003, "{velocity}: {mean} m/s");
    }
}

fn at_rest_nothing_is_read_and_nothing_is_not_a_number() {
    for velocity in [
        "{ kind = \"window\", periods = 32 }",
        "{ kind = \"edges\" }",
        "{ kind = \"observer\", bandwidth_rad_s = 20.0 }",
    ] {
        let still = ["command.vx_m_s=0", "duration_s=1.0"];
        let trace = drive("flat", Some(velocity), &[&SOFT[..], &still].concat());
        for wheel in 0..7 {
            let read = trace.wheel("measured_rad_s", wheel).expect("a signal");
            // A wheel that settles may pass an edge; a second later it reads a count a second at most.
            assert!(read.iter().all(|r| r.is_finite()), "{velocity}");
            assert!(
                read[999].abs() <= ONE_RAD_S * 1e-3 / 0.9,
                "{velocity}: {}",
                read[999]
            );
        }
    }
}

fn a_step_that_bare_counts_do_not_climb_is_climbed_with_every_estimator() {
    let keys = ["control.policy=independent"]; // with the vehicle's own gains
    let plain = drive("step", None, &keys);
    assert!(
        !plain.outcome().climbed,
        "a count in a period is more than the motor has"
    );
    let early = noise_rad_s(&plain, 200..1000);
    for velocity in [
        "{ kind = \"window\", periods = 8 }",
        "{ kind = \"edges\" }",
        "{ kind = \"observer\", bandwidth_rad_s = 100.0 }",
    ] {
        let trace = drive("step", Some(velocity), &keys);
        assert!(trace.outcome().climbed, "{velocity}");
        // A window of 8 leaves an eighth of a count, evenly spread: 2.2 rad/s over the root of 6 is
        // 0.9, of the 7.8 that bare counts have.
        let noise = noise_rad_s(&trace, 200..1000);
        assert!(noise < early / 8.0, "{velocity}: {noise} rad/s of {early}");
    }
}

on_the_fast_engine! {
    the_noise_of_a_steady_velocity_falls_as_the_estimators_say,
    at_rest_nothing_is_read_and_nothing_is_not_a_number,
    a_step_that_bare_counts_do_not_climb_is_climbed_with_every_estimator,
}

#[test]
fn a_window_of_one_period_is_what_counts_without_an_estimator_are() {
    let keys = [&SOFT[..], &["duration_s=0.5"]].concat();
    let read = |velocity| {
        drive("flat", velocity, &keys)
            .wheel("measured_rad_s", 3)
            .expect("a signal")
            .to_vec()
    };
    let (plain, window) = (read(None), read(Some("{ kind = \"window\", periods = 1 }")));
    for (a, b) in plain.iter().zip(&window) {
        // The same whole counts; their product is rounded otherwise.
        assert!((a - b).abs() < 1e-9, "{a} {b}");
    }
}
