//! What makes the law safe, each sentence of docs/derivations.md by itself.

use super::*;

/// Noise of zero mean and this size, the same in every run.
pub(super) struct Noise(pub(super) u64);

impl Noise {
    pub(super) fn next(&mut self, size: f64) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        let unit = (self.0 >> 11) as f64 / (1_u64 << 53) as f64;
        size * 12_f64.sqrt() * (unit - 0.5)
    }
}

pub(super) fn with(change: impl Fn(&mut TractionSensors<f64>)) -> Traction<f64, 7> {
    let mut sensors = TractionSensors::perfect();
    change(&mut sensors);
    seven(TractionConfig::traction(0.3, 2.0, T).with_sensors(sensors))
}

/// A vehicle under traction control: whatever calls for it is over.
pub(super) fn engaged(traction: &Traction<f64, 7>) -> TractionState<f64, 7> {
    let mut state = stood(traction);
    traction.command(&mut state, &AHEAD);
    state.loops = TractionLoops::Traction;
    state
}

/// Mean speed and torque over the second half of `periods`, of wheels that are read with noise.
fn driven_with_noise(traction: &Traction<f64, 7>, noise_rad_s: f64) -> (f64, f64) {
    let (mut state, mut plant, mut noise) = (engaged(traction), Plant::new(10.0), Noise(7));
    let (mut speed, mut thrust) = (0.0, 0.0);
    for period in 0..8000 {
        let rates = plant.rate_rad_s.map(|rate| rate + noise.next(noise_rad_s));
        let sample = traction.step(&mut state, &level(AHEAD, &rates), &TractionTarget::at(0.3));
        plant.step(&sample.wheels.applied.n_m);
        if period >= 4000 {
            speed += plant.speed_m_s / 4000.0;
            thrust += sample.thrust_n_m / 4000.0;
        }
    }
    (speed, thrust)
}

#[test]
fn counts_of_slow_wheels_that_reach_a_limit_of_the_torque_are_not_rectified() {
    // A count in a period reads as 98 rad/s, for which the loop asks 15 times the motor's torque:
    // plain loops have the commanded speed on average.
    let counts = 64.0;
    let traction = with(|sensors| sensors.encoder_counts = counts);
    let slow = BodyTwist {
        vx_m_s: 0.03,
        ..BodyTwist::ZERO
    };
    let (mut state, mut plant) = (stood(&traction), Plant::new(10.0));
    let (mut angle, mut counted) = ([0.0_f64; 7], [0.0_f64; 7]);
    let mut speed = 0.0;
    for period in 0..20_000 {
        let mut rates = [0.0; 7];
        for i in 0..7 {
            angle[i] += plant.rate_rad_s[i] * T;
            let now = (angle[i] / std::f64::consts::TAU * counts).floor();
            rates[i] = (now - counted[i]) * std::f64::consts::TAU / counts / T;
            counted[i] = now;
        }
        let sample = traction.step(&mut state, &level(slow, &rates), &TractionTarget::at(0.03));
        plant.step(&sample.wheels.applied.n_m);
        assert_eq!(sample.loops, TractionLoops::Plain);
        speed += plant.speed_m_s / 10_000.0 * f64::from(period >= 10_000);
    }
    // A tenth: the integral swings with the counts.
    assert!((speed - 0.03).abs() < 0.1 * 0.03, "{speed} m/s");
}

#[test]
fn noise_of_zero_mean_makes_torque_of_zero_mean() {
    for noise_rad_s in [0.5, 1.0, 2.0, 5.0] {
        let traction = with(|sensors| sensors.encoder_noise_rad_s = noise_rad_s);
        let (speed, thrust) = driven_with_noise(&traction, noise_rad_s);
        // The slowest of five alone would be 1.16 standard deviations below the speed: 4 % at 1 rad/s, 20 % at 5.
        assert!(
            (speed - 0.3).abs() < 0.05 * 0.3,
            "{noise_rad_s} rad/s: {speed} m/s"
        );
        // Nothing holds the plant back.
        assert!(
            thrust.abs() < 0.02 * LIMIT_N_M,
            "{noise_rad_s} rad/s: {thrust} N.m"
        );
    }
}

#[test]
fn no_wheel_is_turned_against_its_command_and_its_motion() {
    // Whatever is estimated of the vehicle: ten thousand states of which none need be possible.
    let traction = preset();
    let mut noise = Noise(3);
    for _ in 0..10_000 {
        let mut state = engaged(&traction);
        state.speed_m_s = noise.next(1.0);
        state.target_m_s = 0.3;
        state.integral_n_m = noise.next(2.0);
        for (wheel, sign) in state.wheels.iter_mut().zip(Plant::SIGNS) {
            wheel.contact_n_m = noise.next(2.0);
            wheel.speed_m_s = state.speed_m_s + noise.next(0.1);
            (wheel.usable, wheel.applied_n_m) = (true, sign);
        }
        let rates = Plant::SIGNS.map(|sign| sign * noise.next(3.0).abs());
        for (wheel, rate) in state.wheels.iter_mut().zip(rates) {
            wheel.measured_rad_s = rate;
        }
        let sample = traction.step(&mut state, &level(AHEAD, &rates), &TractionTarget::at(0.3));
        if sample.thrust_n_m < 0.0 || sample.heading_rad != 0.0 {
            continue;
        }
        for (i, sign) in Plant::SIGNS.into_iter().enumerate() {
            // Ahead, and slower than half of the target: whatever the estimated motion of the
            // vehicle, it is not slowed down, let alone turned back.
            if sign != 0.0 && sign * rates[i] * 0.066 < 0.15 {
                let torque = sign * sample.wheels.applied.n_m[i];
                assert!(torque > -1e-9, "wheel {i} at {} rad/s: {torque} N.m", rates[i]);
            }
        }
    }
}

#[test]
fn an_implausible_speed_ends_in_plain_loops_until_the_command_rests() {
    let (traction, back) = (preset(), [-3.0, 0.0, 3.0, -3.0, -3.0, 0.0, 3.0]);
    let mut state = engaged(&traction);
    let mut loops = Vec::new();
    for period in 0..600 {
        // No reading is the same to the bit, or it would be mute.
        let back = back.map(|rate| rate + 1e-6 * f64::from(period % 2));
        loops.push(
            traction
                .step(&mut state, &level(AHEAD, &back), &TractionTarget::at(0.3))
                .loops,
        );
    }
    let taken_over = loops.iter().position(|loops| *loops == TractionLoops::Fallback);
    // 0.3 s, once the filtered wheels say 0.1 m/s back: 0.2 m/s are there after a few of its time constants of 8.4 ms.
    assert!(
        taken_over.is_some_and(|period| (290..350).contains(&period)),
        "{taken_over:?}"
    );
    // With the wheels ahead again it stays so; at rest it is over.
    let ahead = back.map(|rate: f64| -rate);
    for _ in 0..1000 {
        let sample = traction.step(&mut state, &level(AHEAD, &ahead), &TractionTarget::at(0.3));
        assert_eq!(sample.loops, TractionLoops::Fallback);
    }
    // No try by a speed that is not trusted: it would back off without an end.
    let mut tries = TractionTarget::at(-0.3);
    tries.trying = true;
    let [tried, driven] = [tries, TractionTarget::at(0.3)].map(|target| {
        traction
            .step(&mut state.clone(), &level(AHEAD, &ahead), &target)
            .wheels
            .requested
    });
    assert_eq!(tried, driven);
    let sample = traction.step(
        &mut state,
        &level(BodyTwist::ZERO, &[0.0; 7]),
        &TractionTarget::at(0.0),
    );
    assert_eq!(sample.loops, TractionLoops::Plain);
}

#[test]
fn where_nothing_slips_climbs_or_is_held_up_it_is_plain_loops_in_every_bit() {
    let (traction, mut state, mut plant) = (preset(), TractionState::new(), Plant::new(10.0));
    let mut integral = [0.0; 7];
    for _ in 0..3000 {
        let readings = level(AHEAD, &plant.rate_rad_s);
        let sample = traction.step(&mut state, &readings, &TractionTarget::at(0.3));
        let reference = traction.kinematics().inverse(&AHEAD).rad_s;
        for i in 0..7 {
            let error = reference[i] - plant.rate_rad_s[i];
            let torque = (0.3 * error + integral[i]).clamp(-LIMIT_N_M, LIMIT_N_M);
            if torque.abs() < LIMIT_N_M || error * torque <= 0.0 {
                integral[i] += 2.0 * error * T;
            }
            assert_eq!(sample.wheels.applied.n_m[i], torque);
        }
        assert_eq!(sample.loops, TractionLoops::Plain);
        plant.step(&sample.wheels.applied.n_m);
    }
}

#[test]
fn times_and_gains_follow_from_what_is_known_of_sensors_and_motors() {
    let perfect = preset().times;
    assert_eq!((perfect.slip_s, perfect.free_m_s), (7.5e-3, 4e-3));
    let late = with(|sensors| (sensors.delay_s, sensors.lag_s) = (5e-3, 5e-3)).times;
    assert!((late.slip_s - 6.0 * 10e-3).abs() < 1e-12 && late.own_gain_n_m_s_rad < 0.3);
    let noisy = with(|sensors| sensors.encoder_noise_rad_s = 2.0).times;
    // A tenth of the motor's 2 N.m is what noise makes of the torque of a wheel that is slowed down in so long a time.
    assert!(
        (J * 2.0 / noisy.slip_s - 0.1 * LIMIT_N_M).abs() < 1e-9,
        "{noisy:?}"
    );
    assert!(noisy.free_m_s > perfect.free_m_s);
    let coarse = with(|sensors| sensors.encoder_counts = 64.0).times;
    assert!(
        coarse.slip_s > 10.0 * perfect.slip_s && coarse.free_m_s < 0.1,
        "{coarse:?}"
    );
    let slow = seven(TractionConfig::traction(0.3, 2.0, 10e-3)).times;
    assert_eq!(slow.slip_s, 50e-3); // five periods
    // Raw counts are as late as other readings: 15 ms of twice 20.
    let both = with(|sensors| (sensors.encoder_counts, sensors.delay_s) = (64.0, 20e-3));
    let [gain, integral] = both.times.own(&both.config, true);
    // The integral by its square: the loop's damping stays.
    assert!((gain - 0.3 * 0.375).abs() < 1e-12 && (integral - 2.0 * 0.375 * 0.375).abs() < 1e-12);
}

#[test]
fn a_vehicle_faster_than_its_target_is_not_pushed_by_any_gains_or_integral() {
    // The softest gains that are allowed: 15 ms of twice 60.
    let traction = with(|sensors| (sensors.delay_s, sensors.lag_s) = (30e-3, 30e-3));
    for way in [1.0, -1.0] {
        let command = BodyTwist {
            vx_m_s: 0.3 * way,
            ..BodyTwist::ZERO
        };
        let thrust = |speed_m_s: f64| {
            let mut state = stood(&traction);
            traction.command(&mut state, &command);
            state.loops = TractionLoops::Traction;
            (state.target_m_s, state.speed_m_s) = (command.vx_m_s, way * speed_m_s);
            (state.full_thrust_n_m, state.integral_n_m) = (LIMIT_N_M, way * LIMIT_N_M);
            traction.find_thrust(&mut state);
            traction.find_thrust(&mut state); // the integral counts from the second period on
            (way * state.thrust_n_m, way * state.integral_n_m)
        };
        assert_eq!(
            thrust(0.3),
            (LIMIT_N_M, LIMIT_N_M),
            "at the target a climb has all of it"
        );
        let (half, integral) = thrust(0.3 + 0.5 * 0.075);
        let most = 0.5 * LIMIT_N_M + 1e-12;
        assert!(
            half < most && integral < most && half > 0.45 * LIMIT_N_M,
            "{half}, {integral}"
        );
        let (none, integral) = thrust(1.25 * 0.3);
        assert!(none < 1e-12 && integral < 1e-12, "{none}, {integral}");
        let (brakes, integral) = thrust(0.5);
        assert!(brakes < -0.01 && integral <= 0.0, "{brakes}, {integral}");
    }
}

#[test]
fn a_loop_that_swings_between_its_limits_is_held_more_softly_and_recovers() {
    let traction = preset();
    let mut state = engaged(&traction);
    let flat = traction.kinematics().inverse(&AHEAD).rad_s;
    for period in 0..500 {
        // Wheel 4 races ahead and back every ten periods, as a loop does with an unknown delay.
        let mut rates = flat;
        rates[3] += if period / 10 % 2 == 0 { 20.0 } else { -20.0 };
        let _ = traction.step(&mut state, &level(AHEAD, &rates), &TractionTarget::at(0.3));
    }
    assert!(state.slip_gain_part < 0.5, "{}", state.slip_gain_part); // 0.7 a swing; recovery bridges some
    for _ in 0..5000 {
        let _ = traction.step(&mut state, &level(AHEAD, &flat), &TractionTarget::at(0.3));
    }
    assert!(state.slip_gain_part > 0.98, "{}", state.slip_gain_part); // five times the second in which it recovers
}

#[test]
fn a_gyro_is_not_used_before_its_zero_is_known() {
    let (traction, mut state) = (preset(), TractionState::new());
    let mut readings = level(AHEAD, &[0.0; 7]);
    readings.imu.rate_rad_s[2] = 0.3; // all of it zero, and full thrust: no time to find it
    let turning = BodyTwist {
        wz_rad_s: 0.4,
        ..AHEAD
    };
    let rates = traction
        .kinematics()
        .inverse(&turning)
        .rad_s
        .map(|rate| 2.0 * rate);
    (readings.command, readings.wheels_rad_s) = (turning, &rates);
    state.largest_motor_n_m = LIMIT_N_M;
    let mut sample = TractionSample::zero();
    for _ in 0..100 {
        state.thrust_n_m = LIMIT_N_M;
        sample = traction.step(&mut state, &readings, &TractionTarget::at(0.3));
        state.gyro_found_s = 0.0;
    }
    assert!((sample.yaw_rad_s - 0.8).abs() < 1e-3, "{}", sample.yaw_rad_s); // by the wheels
    // At rest before the first motion it takes a twentieth of a second.
    let mut state = TractionState::new();
    let mut readings = level(BodyTwist::ZERO, &[0.0; 7]);
    readings.imu.rate_rad_s[2] = 0.3;
    for _ in 0..60 {
        sample = traction.step(&mut state, &readings, &TractionTarget::at(0.0));
    }
    assert!(
        (sample.gyro_zero_rad_s - 0.3).abs() < 1e-9 && sample.yaw_rad_s.abs() < 1e-9,
        "{sample:?}"
    );
}

#[test]
fn a_gyro_whose_zero_is_found_in_no_time_is_used() {
    for gyro_zero_s in [0.0, 0.01, 0.049, 2.0] {
        let mut config = preset().config;
        config.gyro_zero_s = gyro_zero_s;
        let traction = seven(config);
        let mut state = TractionState::new();
        let readings = level(BodyTwist::ZERO, &[0.0; 7]);
        for _ in 0..60 {
            let _ = traction.step(&mut state, &readings, &TractionTarget::at(0.0));
        }
        assert!(traction.knows_zero(&state), "{gyro_zero_s} s");
    }
}

#[test]
fn a_mute_encoder_is_left_out_and_used_again() {
    let (traction, mut state, mut plant) = (preset(), TractionState::new(), Plant::new(10.0));
    plant.drag_n = 120.0; // of 150 N that five motors have
    let mut out = None;
    for period in 0..3000 {
        let mut rates = plant.rate_rad_s;
        if period >= 500 {
            rates[4] = 2.0; // stuck
        }
        let sample = traction.step(&mut state, &level(AHEAD, &rates), &TractionTarget::at(0.3));
        plant.step(&sample.wheels.applied.n_m);
        if !sample.wheels.active[4] && out.is_none() {
            out = Some(period - 500);
            assert_eq!(sample.wheels.applied.n_m[4], 0.0);
        }
    }
    // A quarter of a second with more than half of the torque; that much is there at once.
    assert!(
        out.is_some_and(|periods| (250..400).contains(&periods)),
        "{out:?}"
    );
}
