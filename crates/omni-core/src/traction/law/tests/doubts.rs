//! When traction control leaves a wheel out, and when it leaves all of them to their own loops.

use super::laws::{Noise, engaged, with};
use super::*;

/// Wheel 4 reads `dead` from the first second on: when it is left out, and the largest speed of the vehicle.
fn with_dead_wheel(
    sensors: impl Fn(&mut TractionSensors<f64>),
    dead: impl Fn(f64) -> f64,
) -> (Option<usize>, f64) {
    let (traction, mut plant) = (with(sensors), Plant::new(10.0));
    let (mut state, mut out, mut fastest_m_s) = (engaged(&traction), None, 0.0_f64);
    for period in 0..3000 {
        let mut rates = plant.rate_rad_s;
        if period >= 1000 {
            rates[3] = dead(rates[3]);
        }
        let sample = traction.step(&mut state, &level(AHEAD, &rates), &TractionTarget::at(0.3));
        plant.step(&sample.wheels.applied.n_m);
        if period >= 1000 {
            fastest_m_s = fastest_m_s.max(plant.speed_m_s);
            if !sample.wheels.active[3] && out.is_none() {
                out = Some(period - 1000);
            }
        }
    }
    (out, fastest_m_s)
}

#[test]
fn one_slow_wheel_is_left_out_while_the_ground_carries_the_others() {
    // Cut, stuck low: no reading is the same to the bit, so none is mute.
    let dither = std::cell::Cell::new(0.0);
    let next = || dither.replace(dither.get() + 1e-7);
    for stuck_rad_s in [0.0, 2.0] {
        let (out, fastest_m_s) = with_dead_wheel(|_| {}, |_| stuck_rad_s + next());
        // 0.06 s of wheels that nothing drives, once they are faster than the target and the dead
        // zone; 2 N.m on 10 kg are 3 m/s^2.
        assert!(
            out.is_some_and(|period| period < 400),
            "{stuck_rad_s} rad/s: {out:?}"
        );
        assert!(fastest_m_s < 1.5 * 0.3, "{stuck_rad_s} rad/s: {fastest_m_s}");
    }
    // The same holds for an encoder that reads less than half of its speed.
    let (out, fastest_m_s) = with_dead_wheel(|_| {}, |rate| 0.4 * rate);
    assert!(out.is_some_and(|period| period < 400), "{out:?}");
    assert!(fastest_m_s < 1.5 * 0.3, "{fastest_m_s}");
    // A motor that follows 20 ms late: two slip times of 0.12 s.
    let (out, fastest_m_s) = with_dead_wheel(|sensors| sensors.lag_s = 0.02, |_| next());
    assert!(out.is_some_and(|period| period < 700), "{out:?}");
    assert!(fastest_m_s < 2.0 * 0.3, "{fastest_m_s}");
}

#[test]
fn what_sensors_hide_is_not_controlled() {
    // 32 counts per turn hide 0.4 * 4.4 rad/s * 66 mm = 0.12 m/s: half of 0.24 m/s.
    let traction = with(|sensors| sensors.encoder_counts = 32.0);
    let held_up = |speed_m_s: f64| {
        let (mut state, command) = (
            TractionState::new(),
            BodyTwist {
                vx_m_s: speed_m_s,
                ..BodyTwist::ZERO
            },
        );
        let loops = (0..1000).map(|_| {
            traction
                .step(
                    &mut state,
                    &level(command, &[0.0; 7]),
                    &TractionTarget::at(speed_m_s),
                )
                .loops
        });
        loops.last()
    };
    assert_eq!(held_up(0.3), Some(TractionLoops::Traction));
    assert_eq!(held_up(0.2), Some(TractionLoops::Plain));
}

#[test]
fn with_no_wheel_to_spare_every_wheel_has_its_own_loop() {
    // Three of seven wheels and a gyro determine how it moves; of three without a gyro the wrong one cannot be found.
    let traction = preset();
    let with_usable = |usable: usize, gyro: bool| {
        let mut state = engaged(&traction);
        let rates: [f64; 7] = core::array::from_fn(|i| if i < usable { 0.0 } else { f64::NAN });
        let mut readings = level(AHEAD, &rates);
        if !gyro {
            readings.imu = Imu::silent();
        }
        traction
            .step(&mut state, &readings, &TractionTarget::at(0.3))
            .loops
    };
    assert_eq!(with_usable(3, true), TractionLoops::Traction);
    assert_eq!(with_usable(2, true), TractionLoops::Plain);
    assert_eq!(with_usable(4, false), TractionLoops::Traction);
    assert_eq!(with_usable(3, false), TractionLoops::Plain);
}

#[test]
fn a_wheel_that_reads_nothing_for_a_moment_is_not_doubted_whatever_the_speed() {
    for target_m_s in [0.3, 0.6, 1.0] {
        let (traction, mut plant) = (preset(), Plant::new(10.0));
        let mut state = engaged(&traction);
        let ahead = BodyTwist {
            vx_m_s: target_m_s,
            ..BodyTwist::ZERO
        };
        for period in 0..3000 {
            let mut rates = plant.rate_rad_s;
            if (1500..1520).contains(&period) {
                rates[3] = 1e-9 * f64::from(period);
            }
            let sample = traction.step(&mut state, &level(ahead, &rates), &TractionTarget::at(target_m_s));
            plant.step(&sample.wheels.applied.n_m);
            assert!(sample.wheels.active[3], "{target_m_s} m/s, period {period}");
        }
    }
}

#[test]
fn wheels_without_grip_do_not_outvote_the_one_that_pushes() {
    // Held at a wall: wheel 4 stands, the others spin free.
    let (traction, inertia, mut rates) = (preset(), 0.002178, [0.0; 7]);
    let mut state = engaged(&traction);
    for period in 0..3000 {
        rates[3] = 1e-9 * f64::from(period); // not mute
        let sample = traction.step(&mut state, &level(AHEAD, &rates), &TractionTarget::at(0.3));
        for wheel in [0, 2, 4, 6] {
            rates[wheel] += sample.wheels.applied.n_m[wheel] / inertia * T;
        }
        assert!(
            sample.wheels.active[3] && sample.loops != TractionLoops::Fallback,
            "period {period}"
        );
    }
}

#[test]
fn a_second_wheel_that_contradicts_ends_in_plain_loops_and_rest_forgives() {
    let (traction, mut plant) = (preset(), Plant::new(10.0));
    let (mut state, mut loops, mut active) = (engaged(&traction), TractionLoops::Traction, [true; 7]);
    for period in 0..4000 {
        let mut rates = plant.rate_rad_s;
        for (wheel, from) in [(3, 1000), (4, 2000)] {
            if period >= from {
                rates[wheel] = 1e-9 * f64::from(period);
            }
        }
        let sample = traction.step(&mut state, &level(AHEAD, &rates), &TractionTarget::at(0.3));
        plant.step(&sample.wheels.applied.n_m);
        (loops, active) = (sample.loops, sample.wheels.active);
        assert!(plant.speed_m_s < 2.0 * 0.3, "{} m/s", plant.speed_m_s);
    }
    assert!(
        !active[3] && active[4] && loops == TractionLoops::Fallback,
        "{active:?} {loops:?}"
    );
    let sample = traction.step(
        &mut state,
        &level(BodyTwist::ZERO, &[0.0; 7]),
        &TractionTarget::at(0.0),
    );
    assert!(sample.wheels.active[3] && sample.loops == TractionLoops::Plain);
}

#[test]
fn a_wheel_that_is_turned_back_is_not_doubted() {
    // As by the heading, on a vehicle that is braked: wheel 7 has no load and stands, the others roll.
    let traction = preset();
    let mut state = engaged(&traction);
    let flat = traction.kinematics().inverse(&AHEAD).rad_s;
    for period in 0..1000 {
        let mut rates = flat.map(|rate| rate + 1e-9 * f64::from(period));
        rates[6] = 1e-9 * f64::from(period);
        for (wheel, sign) in state.wheels.iter_mut().zip(Plant::SIGNS) {
            wheel.applied_n_m = -0.5 * sign;
        }
        let sample = traction.step(&mut state, &level(AHEAD, &rates), &TractionTarget::at(0.3));
        assert!(
            sample.wheels.active[6] && sample.loops != TractionLoops::Fallback,
            "period {period}"
        );
    }
}

#[test]
fn on_the_spot_no_wheel_is_doubted_and_every_one_has_its_own_loop() {
    let traction = preset();
    let mut state = engaged(&traction);
    let flat = traction
        .kinematics()
        .inverse(&BodyTwist {
            wz_rad_s: 1.0,
            ..BodyTwist::ZERO
        })
        .rad_s;
    for period in 0..1000 {
        // As commands made of counts are: beside the turn some millimetres per second in changing directions.
        let aside = 2e-3 * f64::from(period % 3);
        let turning = BodyTwist {
            vx_m_s: 2e-3 - aside,
            vy_m_s: aside,
            wz_rad_s: 1.0,
        };
        // 2 cm/s ahead, but wheel 7, which is slower by 2 mm/s.
        let mut rates = flat;
        for (rate, sign) in rates.iter_mut().zip(Plant::SIGNS) {
            *rate += sign * 0.3 + 1e-9 * f64::from(period);
        }
        rates[6] = flat[6] + 0.03 + 1e-9 * f64::from(period);
        let mut readings = level(turning, &rates);
        readings.imu.rate_rad_s[2] = 1.0;
        let target = TractionTarget::at(turning.vx_m_s.hypot(turning.vy_m_s));
        let sample = traction.step(&mut state, &readings, &target);
        assert!(
            sample.wheels.active == [true; 7] && sample.loops == TractionLoops::Plain,
            "period {period}: {sample:?}"
        );
    }
}

#[test]
fn a_direction_that_trembles_hides_no_dead_wheel() {
    let (traction, mut plant) = (preset(), Plant::new(10.0));
    let (mut state, mut out) = (engaged(&traction), None);
    for period in 0..3000 {
        let mut rates = plant.rate_rad_s;
        if period >= 1000 {
            rates[3] = 1e-9 * f64::from(period);
        }
        let command = BodyTwist {
            vy_m_s: if period % 2 == 0 { 1e-4 } else { -1e-4 },
            ..AHEAD
        };
        let sample = traction.step(&mut state, &level(command, &rates), &TractionTarget::at(0.3));
        plant.step(&sample.wheels.applied.n_m);
        if !sample.wheels.active[3] && out.is_none() {
            out = Some(period - 1000);
        }
        // As without: see `one_wheel_that_says_the_vehicle_is_slow...`.
        assert!(plant.speed_m_s < 1.5 * 0.3, "{}", plant.speed_m_s);
    }
    assert!(out.is_some_and(|period| period < 400), "{out:?}");
}

#[test]
fn counts_that_come_often_are_estimated_although_they_hide_slip() {
    // 64 counts hide 0.083 m/s; at 0.1 m/s half a count comes in their window. Plain loops on raw
    // counts heat with 0.38 N2.m2.
    let traction = with(|sensors| sensors.encoder_counts = 64.0);
    let slow = BodyTwist {
        vx_m_s: 0.1,
        ..BodyTwist::ZERO
    };
    let (mut state, mut plant) = (stood(&traction), Plant::new(10.0));
    let (mut angle, mut counted) = ([0.0_f64; 7], [0.0_f64; 7]);
    let (mut speed, mut heat) = (0.0, 0.0);
    let count = std::f64::consts::TAU / 64.0;
    for period in 0..10_000 {
        let mut rates = [0.0; 7];
        for i in 0..7 {
            angle[i] += plant.rate_rad_s[i] * T;
            let now = (angle[i] / count).floor();
            rates[i] = (now - counted[i]) * count / T;
            counted[i] = now;
        }
        let sample = traction.step(&mut state, &level(slow, &rates), &TractionTarget::at(0.1));
        plant.step(&sample.wheels.applied.n_m);
        assert_eq!(sample.loops, TractionLoops::Plain);
        if period >= 5000 {
            let torques = sample.wheels.applied.n_m;
            speed += plant.speed_m_s / 5000.0;
            heat += torques.iter().map(|torque| torque * torque).sum::<f64>() / 5000.0;
        }
    }
    // A hundredth: nothing holds the plant back, and the wheels' counts need not agree.
    assert!((speed - 0.1).abs() < 0.01 * 0.1, "{speed} m/s");
    assert!(heat < 0.01, "{heat} N2.m2");
}

/// Encoders of `dead` wheels read 0 from the first second on: when all of them that push are left out, and the largest
/// speed until then: on a slope the vehicle rolls on.
fn with_dead_wheels(dead: &[usize], target_m_s: f64, nose_up_rad: f64) -> (Option<usize>, f64) {
    let (traction, mut plant) = (preset(), Plant::new(10.0));
    let (mut state, mut out, mut fastest_m_s) = (engaged(&traction), None, 0.0_f64);
    plant.drag_n = Plant::MASS_KG * GRAVITY_M_S2 * nose_up_rad.sin();
    let ahead = BodyTwist {
        vx_m_s: target_m_s,
        ..BodyTwist::ZERO
    };
    let mut before_m_s = 0.0;
    for period in 0..3000 {
        let mut rates = plant.rate_rad_s;
        if period >= 1000 {
            // One after the other, as estimators of their velocities come to rest.
            let now = dead.iter().take(1 + (period - 1000) / 3);
            now.for_each(|&wheel| rates[wheel] = 0.0);
        }
        let mut readings = level(ahead, &rates);
        let gained = (plant.speed_m_s - before_m_s) / T;
        before_m_s = plant.speed_m_s;
        readings.imu.pitch_rad = nose_up_rad;
        readings.imu.specific_force_m_s2 = [
            gained + GRAVITY_M_S2 * nose_up_rad.sin(),
            0.0,
            GRAVITY_M_S2 * nose_up_rad.cos(),
        ];
        let sample = traction.step(&mut state, &readings, &TractionTarget::at(target_m_s));
        plant.step(&sample.wheels.applied.n_m);
        if out.is_none() {
            fastest_m_s = fastest_m_s.max(plant.speed_m_s);
        }
        if period >= 1000
            && out.is_none()
            && dead
                .iter()
                .all(|&wheel| Plant::SIGNS[wheel] == 0.0 || !sample.wheels.active[wheel])
        {
            out = Some(period - 1000);
        }
    }
    (out, fastest_m_s)
}

#[test]
fn encoders_that_die_together_are_found_by_the_accelerometer() {
    let driven: &[usize] = &[0, 2, 3, 4, 6];
    for dead in [driven, &[0, 1, 2, 3, 4, 5, 6], &[0, 3, 4, 6]] {
        for (target_m_s, nose_up_rad) in [(0.1, 0.0), (0.3, 0.0), (0.3, 0.1), (0.3, -0.1), (0.6, 0.0)] {
            let (out, fastest_m_s) = with_dead_wheels(dead, target_m_s, nose_up_rad);
            let case =
                std::format!("{dead:?}, {target_m_s} m/s, {nose_up_rad} rad: {out:?}, {fastest_m_s} m/s");
            // 0.3 m/s are gained within half a second, and what the vehicle has had stays; less of it, by the leak.
            assert!(out.is_some_and(|period| period < 500), "{case}");
            assert!(fastest_m_s < target_m_s + 0.6, "{case}");
        }
    }
}

#[test]
fn a_vehicle_before_an_obstacle_keeps_its_wheels_whatever_its_accelerometer_reads() {
    let mut noise = Noise(11);
    // What the unit reads beyond gravity: it trembles, its zero is off, the attitude is off by 3 degrees, it is hit
    // every half second, it was never filled in.
    type Reads = fn(usize, f64) -> [f64; 3];
    let readings: [Reads; 5] = [
        |_, noise| [3.0 * noise, 3.0 * noise, GRAVITY_M_S2],
        |_, _| [0.5, 0.5, GRAVITY_M_S2],
        |_, _| [GRAVITY_M_S2 * 0.05, -GRAVITY_M_S2 * 0.05, GRAVITY_M_S2],
        |period, _| [[50.0, -50.0, 0.0][(period % 500 / 5).min(2)], 0.0, GRAVITY_M_S2],
        |_, _| [0.0; 3],
    ];
    for (which, read) in readings.iter().enumerate() {
        let (traction, mut state) = (preset(), TractionState::new());
        for period in 0..8000 {
            let mut readings = level(AHEAD, &[0.0; 7]);
            readings.imu.specific_force_m_s2 = read(period, noise.next(1.0));
            if which == 4 {
                readings.imu.pitch_rad = -0.2; // nose down: by gravity alone it would run away
            }
            let sample = traction.step(&mut state, &readings, &TractionTarget::at(0.3));
            assert!(
                state.wheels.iter().all(|wheel| !wheel.doubted),
                "{which}, period {period}"
            );
            assert!(period < 500 || sample.thrust_n_m > 0.0);
        }
    }
}

/// Wheel 1 stands from the first period on and pushes ahead, while the unit reads that the vehicle's middle gains
/// speed ahead and turns. Is it doubted within a second?
fn stands_while_it_turns(yaw_rad_s_per_m_s: f64) -> bool {
    let traction = preset();
    let mut state = engaged(&traction);
    let mut speed_m_s = 0.0;
    for _ in 0..1000 {
        speed_m_s += T;
        let mut rates = [speed_m_s / 0.066; 7];
        rates[0] = 0.0;
        for (rate, sign) in rates.iter_mut().zip(Plant::SIGNS) {
            *rate *= sign;
        }
        let mut readings = level(AHEAD, &rates);
        readings.imu.specific_force_m_s2[0] = 1.0;
        readings.imu.rate_rad_s[2] = yaw_rad_s_per_m_s * speed_m_s;
        let _ = traction.step(&mut state, &readings, &TractionTarget::at(1.2));
        state.wheels[0].applied_n_m = 1.0;
        if state.any_stood {
            state
                .wheels
                .iter_mut()
                .skip(1)
                .for_each(|wheel| wheel.stood = false);
        }
        if state.wheels[0].doubted {
            return true;
        }
    }
    false
}

#[test]
fn a_blocked_wheel_about_which_the_vehicle_turns_is_not_taken_for_dead() {
    // A wheel that is y to the left goes v - y w ahead: nothing where the vehicle turns by 1 / y for each m/s.
    let left_m = PLACES[0][1];
    assert!(!stands_while_it_turns(1.0 / left_m));
    assert!(stands_while_it_turns(0.0) && stands_while_it_turns(-1.0 / left_m));
}
