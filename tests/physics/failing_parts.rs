//! Encoders, motors and ground that fail or change on the way, each by its effect in numbers.

use omni_sim::config::{Override, Scenario};
use omni_sim::{Simulation, Trace, run};

use crate::engines::{load, on_the_fast_engine};

const WHEELS: usize = 7;
/// Torques that turn every wheel of `chugo7` that rolls, now one way and now the other \[N.m\].
fn torques_n_m(period: usize) -> [f64; WHEELS] {
    let sign = if (period / 300).is_multiple_of(2) {
        1.0
    } else {
        -1.0
    };
    [0.3, 0.0, 0.3, 0.3, 0.3, 0.0, 0.3].map(|torque| sign * torque)
}

fn scenario(texts: &[&str]) -> Scenario {
    let keys = texts.iter().map(|text| Override::parse(text).expect("KEY=VALUE"));
    load("flat", &keys.collect::<Vec<_>>()).expect("valid")
}

/// What wheel 1 read in each of so many periods of the same torques: the same motion, whatever is read.
fn read(texts: &[&str], periods: usize) -> Vec<f64> {
    let mut simulation = Simulation::new(&scenario(texts)).expect("valid");
    let mut readings = Vec::new();
    for period in 0..periods {
        readings.push(simulation.measured_rad_s()[0]);
        simulation.step_torques(&torques_n_m(period)).expect("finite");
    }
    readings
}

const COUNTS: usize = 4096;

/// Where a counter stands after each period.
fn counter(texts: &[&str], periods: usize) -> Vec<i64> {
    let counts = format!("sensors.encoder_counts={COUNTS}");
    let all: Vec<&str> = texts.iter().copied().chain([counts.as_str()]).collect();
    let count_rad_s = std::f64::consts::TAU / COUNTS as f64 / 1e-3;
    let mut sum = 0;
    let counts = read(&all, periods).into_iter().map(|velocity| {
        let counted = velocity / count_rad_s;
        assert!((counted - counted.round()).abs() < 1e-6, "{counted} counts");
        sum += counted.round() as i64;
        sum
    });
    counts.collect()
}

fn fault(kind: &str, more: &str) -> String {
    format!("fault=[{{ kind = {kind:?}, wheel = \"1\", from_s = 0.1, until_s = 0.8{more} }}]")
}

/// Periods of the fault: row k is read k ms after the start.
const SPAN: std::ops::Range<usize> = 100..800;

fn a_dead_encoder_s_count_stands_and_goes_on_from_there() {
    let (dead, whole) = (counter(&[&fault("encoder_dead", "")], 1000), counter(&[], 1000));
    assert_eq!(dead[..100], whole[..100]);
    assert!(dead[SPAN].iter().all(|count| *count == dead[99]));
    let away = whole[SPAN].iter().map(|count| (count - whole[99]).abs()).max();
    assert!(away > Some(500), "the wheel went on: {away:?} counts");
    // Edges that passed meanwhile are lost, and no other.
    let lost = whole[799] - whole[99];
    for (d, w) in dead[800..].iter().zip(&whole[800..]) {
        assert_eq!(*d, w - lost);
    }
    // Without counts, or with noise, it reads 0 and no more.
    let ideal = read(
        &[&fault("encoder_dead", ""), "sensors.encoder_noise_rad_s=0.1"],
        1000,
    );
    assert!(ideal[SPAN].iter().all(|velocity| *velocity == 0.0));
    // The others' noise is what it was.
    let noisy = read(&["sensors.encoder_noise_rad_s=0.1"], 1000);
    assert_eq!(ideal[800..], noisy[800..]);
}

fn a_stuck_encoder_s_count_stands_and_jumps_to_the_shaft_s_at_the_end() {
    let (stuck, whole) = (counter(&[&fault("encoder_stuck", "")], 1000), counter(&[], 1000));
    assert_eq!(stuck[..100], whole[..100]);
    assert!(stuck[SPAN].iter().all(|count| *count == stuck[99]));
    assert_eq!(stuck[800..], whole[800..]);
}

fn an_encoder_with_one_channel_alternates_between_two_counts_as_the_shaft_turns() {
    let (toggles, whole) = (
        counter(&[&fault("encoder_toggles", "")], 1000),
        counter(&[], 1000),
    );
    // For a tenth of a second: then it is known to stand, and nothing more is read of it.
    let seen = SPAN.start..SPAN.start + 95;
    let (least, most) = (
        toggles[seen.clone()].iter().min(),
        toggles[seen.clone()].iter().max(),
    );
    assert_eq!(least.map(|count| count + 1), most.copied());
    // Of four edges it sees the two of its channel: its level is what the whole count says.
    let level = |count: i64| (count + 1).div_euclid(2).rem_euclid(2);
    for k in seen.clone() {
        let expected = level(whole[k]) - level(whole[99]);
        assert_eq!(toggles[k] - toggles[99], expected, "{k} ms");
    }
    let changes = toggles[seen].windows(2).filter(|pair| pair[0] != pair[1]).count();
    assert!(changes > 20, "{changes}: it toggles as the shaft turns");
    assert!(
        toggles[SPAN.start + 105..SPAN.end]
            .windows(2)
            .all(|pair| pair[0] == pair[1])
    );
    // And then it counts on, from the third count on.
    for (t, w) in toggles[850..].iter().zip(&whole[850..]) {
        assert_eq!(t - toggles[850], w - whole[850]);
    }
}

fn an_encoder_that_slips_counts_a_part_of_the_way() {
    let (slips, whole) = (
        counter(&[&fault("encoder_slips", ", part = 0.25")], 1000),
        counter(&[], 1000),
    );
    for k in SPAN {
        let (counted, turned) = (slips[k] - slips[99], whole[k] - whole[99]);
        // Whole counts of a quarter: one to either side.
        assert!(
            (counted as f64 - 0.25 * turned as f64).abs() <= 1.25,
            "{counted} of {turned}"
        );
    }
    // Firm again it misses no count, but where it is within one is another.
    for k in 801..1000 {
        let (counted, turned) = (slips[k] - slips[799], whole[k] - whole[799]);
        assert!((counted - turned).abs() <= 1, "{counted} of {turned}");
    }
    let [ideal, true_] = [
        read(&[&fault("encoder_slips", ", part = 0.25")], 1000),
        read(&[], 1000),
    ];
    for k in 0..1000 {
        let part = if SPAN.contains(&k) { 0.25 } else { 1.0 };
        assert_eq!(ideal[k], part * true_[k]);
    }
}

fn by_every_method_the_velocity_of_a_dead_encoder_falls_and_is_finite() {
    let count_rad = std::f64::consts::TAU / COUNTS as f64;
    for method in [
        "{ kind = \"window\", periods = 8 }",
        "{ kind = \"edges\" }",
        "{ kind = \"observer\", bandwidth_rad_s = 50.0 }",
    ] {
        for kind in ["encoder_dead", "encoder_stuck", "encoder_toggles"] {
            let counts = format!("sensors.encoder_counts={COUNTS}");
            let method = format!("sensors.encoder_velocity={method}");
            let readings = read(&[&fault(kind, ""), &counts, &method], 1000);
            assert!(
                readings.iter().all(|velocity| velocity.is_finite()),
                "{kind} {method}"
            );
            if kind != "encoder_toggles" {
                // A counter that has stood for so long has turned by less than a count.
                let most = count_rad / 0.69;
                assert!(readings[799].abs() <= most, "{kind} {method}: {}", readings[799]);
            }
        }
    }
}

fn encoders_start_at_a_place_within_a_count_that_the_seed_and_nothing_else_draws() {
    // 64 counts a turn: a wheel that starts to turn passes its first edge after a part of a count that is drawn
    // evenly. What a counter has then counted beyond the way is even about 0, and does not depend on the wheel before.
    let counts = 64.0;
    let errors = |seed: u64, extra: &str| {
        let seed = format!("seed={seed}");
        let mut simulation =
            Simulation::new(&scenario(&["sensors.encoder_counts=64", &seed, extra])).expect("valid");
        let mut counted = [0.0; WHEELS];
        for period in 0..250 {
            simulation.step_torques(&torques_n_m(period)).expect("finite");
            for (sum, velocity) in counted.iter_mut().zip(simulation.measured_rad_s()) {
                *sum += velocity * 1e-3 * counts / std::f64::consts::TAU;
            }
        }
        counted
    };
    let mut ideal = Simulation::new(&scenario(&[])).expect("valid");
    let (mut turned, mut before) = ([0.0; WHEELS], [0.0; WHEELS]);
    for period in 0..250 {
        ideal.step_torques(&torques_n_m(period)).expect("finite");
        for (i, velocity) in ideal.measured_rad_s().iter().enumerate() {
            turned[i] += 0.5 * (before[i] + velocity) * 1e-3 * counts / std::f64::consts::TAU;
            before[i] = *velocity;
        }
    }
    let rolling = [0, 2, 3, 4, 6];
    let drawn: Vec<f64> = (0..40)
        .flat_map(|seed| {
            let counted = errors(seed, "duration_s=1");
            rolling.map(|i| counted[i] - turned[i])
        })
        .collect();
    let n = drawn.len() as f64;
    let mean = drawn.iter().sum::<f64>() / n;
    // An error of a whole count times (1 - p) or -p of it, p the part of a count that the way ends
    // with: half a count at most, in the mean of 200 half of that over the root of 200, 0.035; four
    // times that. (All on an edge: -p, the same of every wheel and seed.)
    assert!(mean.abs() < 0.14, "{mean} counts");
    assert!(drawn.iter().all(|error| error.abs() < 1.0), "{drawn:?}");
    assert_eq!(
        errors(3, "duration_s=1"),
        errors(3, "duration_s=2"),
        "the seed alone"
    );
    assert!((0..10).any(|seed| errors(seed, "duration_s=1") != errors(0, "duration_s=1")));
    // Noise has a stream of its own.
    let noise = |counts: &str| {
        let noisy = read(&["sensors.encoder_noise_rad_s=0.1", counts], 3);
        noisy[0]
    };
    assert_eq!(
        noise("sensors.encoder_counts=0"),
        noise("sensors.encoder_counts=100")
    );
}

fn drive(texts: &[&str]) -> Trace {
    run(&scenario(texts)).expect("runs")
}

/// The largest force along the ground over the normal force of wheel 3, in some rows.
fn grip(trace: &Trace, rows: std::ops::Range<usize>) -> f64 {
    let [along, normal] = ["force_along_n", "force_normal_n"].map(|of| trace.wheel(of, 2).expect("a signal"));
    rows.map(|k| along[k].abs() / normal[k]).fold(0.0, f64::max)
}

fn a_moving_patch_takes_the_grip_from_its_time_on_and_a_resting_one_is_left() {
    // The vehicle goes to and fro at up to 0.6 m/s; a sheet of ice of 4 m goes with it from 1 s to
    // 3 s. Braking takes 0.1 of its weight.
    let common = [
        "command.vx_m_s=0.6",
        "command.ramp_s=0.3",
        "command.then=[{ at_s = 2.0, vx_m_s = -0.6, vy_m_s = 0, wz_rad_s = 0 }, { at_s = 3.5, vx_m_s = 0.6, vy_m_s = 0, wz_rad_s = 0 }]",
        "control.policy=independent",
        "duration_s=4.0",
    ];
    let patch = |more: &str| {
        let patch = format!("friction_patch=[{{ x_m = [-2, 2], y_m = [-5, 5], friction = 0.02{more} }}]");
        drive(&[&common[..], &[patch.as_str()]].concat())
    };
    let moving = patch(", velocity_m_s = [0.3, 0.0], from_s = 1.0, until_s = 3.0");
    let hold = 0.02 * (1.0 + 1e-6);
    assert!(grip(&moving, 0..1000) > 0.05, "it speeds up on dry ground");
    assert!(grip(&moving, 1002..3000) <= hold, "{}", grip(&moving, 1002..3000));
    assert!(grip(&moving, 2000..3000) > 0.019, "it slides");
    assert!(grip(&moving, 3000..4000) > 0.05, "and then has its hold again");
    // A sheet that is faster than the vehicle is away when that turns back.
    let away = patch(", velocity_m_s = [6.0, 0.0]");
    assert!(grip(&away, 0..250) <= hold && grip(&away, 2000..2300) > 0.05);
    let rests = patch("");
    assert!(grip(&rests, 0..4000) <= hold);
}

#[test]
fn bad_keys_of_faults_and_patches_name_themselves() {
    for (key, message) in [
        (
            r#"fault=[{ kind = "encoder_dead", wheel = "9", from_s = 0.0 }]"#,
            r#"fault[0].wheel: "9", allowed: 1, 2, 3, 4, 5, 6, 7"#,
        ),
        (
            r#"fault=[{ kind = "encoder_toggles", wheel = "1", from_s = 0.0 }]"#,
            r#"fault[0].kind: "encoder_toggles", allowed: only with sensors.encoder_counts above 0"#,
        ),
        (
            r#"fault=[{ kind = "encoder_slips", wheel = "1", part = 1.5, from_s = 0.0 }]"#,
            "fault[0].part: 1.5, allowed: 0 to 1",
        ),
        (
            r#"fault=[{ kind = "motor_weak", wheel = "1", from_s = 0.0 }]"#,
            "fault[0]: missing field `part`",
        ),
        (
            r#"fault=[{ kind = "supply_sag", part = -0.5, from_s = 0.0 }]"#,
            "fault[0].part: -0.5, allowed: 0 to 1",
        ),
        (
            "friction_patch=[{ x_m = [0, 1], y_m = [0, 1], friction = 0.1, velocity_m_s = [200, 0] }]",
            "friction_patch[0].velocity_m_s: [200, 0], allowed: -100 to 100",
        ),
        (
            "friction_patch=[{ x_m = [0, 1], y_m = [0, 1], friction = 0.1, from_s = 2.0, until_s = 1.0 }]",
            "friction_patch[0].until_s: 1, allowed: more than from_s, 2",
        ),
    ] {
        let refused = load("flat", &[Override::parse(key).expect("KEY=VALUE")]).expect_err("refused");
        assert_eq!(refused.to_string(), format!("built-in flat: {message}"));
    }
}

on_the_fast_engine! {
    a_dead_encoder_s_count_stands_and_goes_on_from_there,
    a_stuck_encoder_s_count_stands_and_jumps_to_the_shaft_s_at_the_end,
    an_encoder_with_one_channel_alternates_between_two_counts_as_the_shaft_turns,
    an_encoder_that_slips_counts_a_part_of_the_way,
    by_every_method_the_velocity_of_a_dead_encoder_falls_and_is_finite,
    encoders_start_at_a_place_within_a_count_that_the_seed_and_nothing_else_draws,
    a_moving_patch_takes_the_grip_from_its_time_on_and_a_resting_one_is_left,
}
