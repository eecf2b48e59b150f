//! What sensors and commands should not do, and do.

use super::*;

#[test]
fn a_command_that_turns_round_while_it_backs_off_goes_on_as_it_moves() {
    let supervisor = supervisor(SupervisorConfig::traction(T));
    let (mut memory, mut target_m_s) = (SupervisorState::new(), 0.0_f64);
    for _ in 0..2000 {
        let state = seen([0.0; 3], target_m_s.min(0.0), 1.0);
        target_m_s = supervisor.step(&mut memory, &state).speed_m_s;
        if memory.mode() == SupervisorMode::BackOff && target_m_s < -0.29 {
            break;
        }
    }
    assert_eq!(memory.mode(), SupervisorMode::BackOff);
    let mut state = seen([0.0; 3], 0.3, 0.0);
    state.direction = [-1.0, 0.0];
    // It drove back with 0.29 m/s, which is ahead now, and the way back was no try of that.
    let target = supervisor.step(&mut memory, &state);
    assert!((target.speed_m_s - 0.3).abs() < 0.02, "{}", target.speed_m_s);
    assert_eq!(
        (memory.mode(), memory.row_retries(), memory.retries()),
        (SupervisorMode::Drive, 0, 1)
    );
    // Across, nothing of it is left.
    state.direction = [0.0, 1.0];
    let target = supervisor.step(&mut memory, &state);
    assert!(target.speed_m_s.abs() < 0.01, "{}", target.speed_m_s);
}

#[test]
fn a_slope_is_no_step_and_a_step_on_a_slope_is_one() {
    let supervisor = supervisor(SupervisorConfig::traction(T));
    for (heights, row) in [
        ([0.1, 0.05, 0.0], 0),
        ([0.0, 0.05, 0.1], 0), // down
        ([0.15, 0.05, 0.0], 1),
        ([0.15, 0.10, 0.0], 2),
    ] {
        let state = seen(heights, 0.3, 0.1);
        let mut memory = SupervisorState::new();
        let target = supervisor.step(&mut memory, &state);
        assert_eq!(memory.row(), row, "{heights:?}");
        assert!(target.speed_m_s.is_finite());
    }
}

#[test]
fn a_command_or_target_that_is_no_number_is_none() {
    let (traction, mut state) = (preset(), TractionState::new());
    let rates = traction.kinematics().inverse(&AHEAD).rad_s;
    let mut step = |command, target| {
        let readings = level(command, &rates);
        traction.step(&mut state, &readings, &TractionTarget::at(target))
    };
    for _ in 0..50 {
        step(AHEAD, 0.3);
    }
    for nonsense in [f64::NAN, f64::INFINITY, 1e30] {
        for command in [
            BodyTwist {
                wz_rad_s: nonsense,
                ..AHEAD
            },
            BodyTwist {
                vx_m_s: nonsense,
                ..AHEAD
            },
            BodyTwist {
                vy_m_s: nonsense,
                ..AHEAD
            },
        ] {
            let sample = step(command, nonsense);
            assert!(sample.wheels.applied.n_m.iter().all(|torque| torque.is_finite()));
            assert_eq!((sample.target_m_s, sample.factor.is_finite()), (0.3, true)); // the last ones go on
            assert_eq!(sample.command, AHEAD);
        }
    }
    assert!(
        step(AHEAD, 0.3)
            .wheels
            .applied
            .n_m
            .iter()
            .all(|torque| torque.is_finite())
    );
}

#[test]
fn a_gyros_zero_is_not_learned_from_turning_and_has_a_bound() {
    for (wz_rad_s, gyro, bound) in [(1.0, 1.0, 1e-9), (0.0, 5.0, 1.0)] {
        let (traction, mut state) = (preset(), TractionState::new());
        let turning = BodyTwist {
            wz_rad_s,
            ..BodyTwist::ZERO
        };
        let rates = traction.kinematics().inverse(&turning).rad_s;
        for _ in 0..5000 {
            let mut readings = level(turning, &rates);
            readings.imu.rate_rad_s[2] = gyro;
            let _ = traction.step(&mut state, &readings, &TractionTarget::at(0.0));
        }
        assert!(state.gyro_zero_rad_s.abs() <= bound, "{}", state.gyro_zero_rad_s);
    }
}

#[test]
fn without_a_gyro_a_silent_wheel_does_not_turn_the_vehicle() {
    for command in [
        AHEAD,
        BodyTwist {
            wz_rad_s: 0.5,
            ..AHEAD
        },
    ] {
        let (traction, mut state) = (preset(), TractionState::new());
        let mut rates = traction.kinematics().inverse(&command).rad_s;
        rates[0] = f64::NAN;
        let mut yaw_rad_s = f64::NAN;
        for _ in 0..500 {
            let mut readings = level(command, &rates);
            readings.imu = Imu::silent();
            yaw_rad_s = traction
                .step(&mut state, &readings, &TractionTarget::at(0.3))
                .yaw_rad_s;
        }
        // What the other six wheels agree on; the filter of the speed is sixty time constants behind its start.
        assert!((yaw_rad_s - command.wz_rad_s).abs() < 1e-3, "{yaw_rad_s}");
    }
}

#[test]
fn a_hinge_that_falls_silent_stands() {
    let (traction, mut state) = (preset(), TractionState::new());
    let mut rise = |rate: f64, periods| {
        let mut last = f64::NAN;
        for _ in 0..periods {
            let (angles, rates) = ([0.0, 0.0], [rate, 0.0]);
            let mut readings = level(AHEAD, &[0.0; 7]);
            (readings.hinges_rad, readings.hinges_rad_s) = (&angles, &rates);
            let _ = traction.step(&mut state, &readings, &TractionTarget::at(0.3));
            last = state.motion.rise_m_s[5];
        }
        last
    };
    assert!((rise(-0.8, 200) - 0.24).abs() < 1e-3);
    assert!(rise(f64::NAN, 200).abs() < 1e-3); // eleven time constants of 17 ms
}

#[test]
fn the_higher_wheel_of_a_row_pushes_less_ahead_and_back() {
    let traction = preset();
    let step = |target: f64| {
        let mut state = stood(&traction);
        let mut readings = level(AHEAD, &[0.0; 7]);
        readings.imu.roll_rad = 0.05; // left side up
        let target = TractionTarget::at(target);
        let mut torques = [0.0; 7];
        for _ in 0..200 {
            // It stands, which is to be held up: traction control after 0.15 s.
            torques = traction.step(&mut state, &readings, &target).wheels.requested.n_m;
        }
        torques
    };
    let (ahead, back) = (step(1.0), step(-1.0));
    // Wheels 1 and 3: right and left of a row of the base.
    for torques in [ahead, back] {
        assert!(torques[2].abs() < torques[0].abs() - 0.1, "{torques:?}");
    }
}

fn mecanum_base() -> Traction<f64, 4> {
    mecanum_base_with([0.3, 2.0])
}

fn mecanum_base_with([kp, ki]: [f64; 2]) -> Traction<f64, 4> {
    let places = [[0.3, 0.2], [0.3, -0.2], [-0.3, 0.2], [-0.3, -0.2]];
    let mut wheels = wheels(places);
    for wheel in &mut wheels {
        wheel.carrier = [1.0, 0.0]; // direct drive, rolls ahead
    }
    let carried = places.map(|[x, y]| CarriedWheel {
        body: 0,
        centre_m: [x, y, 0.1],
    });
    let linkage = Linkage::new(&[], &carried).expect("a tree");
    let kinematics = Kinematics::new(&WheelLayout::mecanum4(0.6, 0.4, 0.1).expect("valid")).expect("valid");
    Traction::new(kinematics, linkage, wheels, TractionConfig::traction(kp, ki, T)).expect("valid")
}

#[test]
fn without_hinges_plain_loops_have_time_for_their_whole_torque() {
    // (kp + ki t) 3 rad/s is the 2 N.m that a motor has: after 0.18, 0.92 and 6.3 s.
    for (ki, takes_over_s) in [(2.0, 0.3), (0.4, 0.917), (0.058, 2.0)] {
        let traction = mecanum_base_with([0.3, ki]);
        let mut state = TractionState::new();
        let held_s = (1..4000).find(|period| {
            // Encoders that read the same while they push would be mute.
            let read = [1e-6 * f64::from(period % 2); 4];
            let _ = traction.step(&mut state, &level(AHEAD, &read), &TractionTarget::at(0.3));
            state.loops == TractionLoops::Traction
        });
        let held_s = held_s.map_or(f64::INFINITY, |periods| f64::from(periods) * T);
        // The speed's filter, and a period.
        assert!((held_s - takes_over_s).abs() < 5e-3, "{held_s}, {takes_over_s} s");
    }
}

#[test]
fn a_mecanum_base_that_slides_across_is_pushed_back_and_not_turned() {
    let traction = mecanum_base();
    let travel = [0, 1, 2].map(|axis| traction.kinematics().inverse_matrix().map(|row| row[axis]));
    for across in [0.08, -0.08] {
        // It is held up, and goes along what holds it up.
        let slides = BodyTwist {
            vx_m_s: 0.05,
            vy_m_s: across,
            wz_rad_s: 0.0,
        };
        let rates = traction.kinematics().inverse(&slides).rad_s;
        let (mut state, mut pushes) = (TractionState::new(), [0.0; 3]);
        for period in 0..3000 {
            // Encoders that read the same while they push would be mute.
            let read = rates.map(|rate| rate + 1e-6 * f64::from(period % 2));
            let sample = traction.step(&mut state, &level(AHEAD, &read), &TractionTarget::at(0.3));
            let torques = sample.wheels.requested.n_m;
            pushes = travel.map(|per| {
                per.iter()
                    .zip(torques)
                    .map(|(per, torque)| per * torque)
                    .sum::<f64>()
            });
        }
        let [ahead, left, turning] = pushes;
        assert_eq!(state.loops, TractionLoops::Traction);
        // As plain loops of 0.3 N.m.s/rad and 2 N.m/rad would with four wheels of 10 rad/m, for 5 cm of drift.
        let plain = -across.signum() * 4.0 * 10.0 * 10.0 * (0.3 * 0.08 + 2.0 * 0.05);
        // The rest is slip control's, which takes thrust from the two faster wheels.
        assert!((1.0..2.0).contains(&(left / plain)), "{left} of {plain} N");
        assert!(ahead > 0.0 && turning.abs() < 1e-9 * ahead, "{pushes:?}");
    }
}

#[test]
fn a_mecanum_base_that_rolls_is_not_taken_for_one_that_slips() {
    let traction = mecanum_base();
    let speed = |roll_rad_s: f64, pitch_rad_s: f64| {
        let mut state = TractionState::new();
        let rates = traction.kinematics().inverse(&AHEAD).rad_s;
        let mut readings = level(AHEAD, &rates);
        (readings.imu.rate_rad_s[0], readings.imu.rate_rad_s[1]) = (roll_rad_s, pitch_rad_s);
        for _ in 0..300 {
            readings.imu.roll_rad += roll_rad_s * T;
            readings.imu.pitch_rad -= pitch_rad_s * T; // nose up is positive, and a turn about y is nose down
            let _ = traction.step(&mut state, &readings, &TractionTarget::at(0.3));
        }
        state.speed_m_s
    };
    assert!((speed(0.5, 0.0) - 0.3).abs() < 1e-6);
    // Nose up at 0.5 rad/s turns encoders of 0.1 m by as much: 0.05 m/s less over the ground than they say.
    assert!((speed(0.0, -0.5) - 0.25).abs() < 1e-3, "{}", speed(0.0, -0.5));
}

#[test]
fn rates_beyond_the_change_of_the_attitude_are_the_gyros_zero_and_no_climb() {
    let (traction, mut plant) = (preset(), Plant::new(10.0));
    let mut state = TractionState::new();
    for period in 0..3000 {
        let mut readings = level(AHEAD, &plant.rate_rad_s);
        // 0.05 rad/s, as cheap gyros have by their datasheets; after two seconds it rolls besides, as it says.
        readings.imu.rate_rad_s = [0.05, -0.05, 0.05];
        let rolls = if period < 2000 { 0.0 } else { 0.2 };
        readings.imu.rate_rad_s[0] += rolls;
        readings.imu.roll_rad = rolls * T * f64::from(period - 2000);
        let sample = traction.step(&mut state, &readings, &TractionTarget::at(0.3));
        assert!(
            !(1000..2000).contains(&period) || sample.loops == TractionLoops::Plain,
            "period {period}"
        );
        plant.step(&sample.wheels.applied.n_m);
    }
    // A second's turn changes an average over two seconds by nothing: it is in rate and attitude.
    let [_, left] = state.base_rad_s;
    assert!((left.abs() - 0.2).abs() < 2e-3, "{left}");
}

/// Wheels that a direction drives: wheel i is bit i.
fn driven<const N: usize>(layout: &WheelLayout<f64, N>, direction_rad: f64) -> u32 {
    let kinematics = Kinematics::new(layout).expect("valid");
    let carried = [CarriedWheel {
        body: 0,
        centre_m: [0.0, 0.0, 0.1],
    }; N];
    let linkage = Linkage::new(&[], &carried).expect("a tree");
    let traction = Traction::new(
        kinematics,
        linkage,
        wheels([[0.0; 2]; N]),
        TractionConfig::traction(0.3, LIMIT_N_M, T),
    );
    let mut state = TractionState::new();
    let (sin, cos) = direction_rad.sin_cos();
    let command = BodyTwist {
        vx_m_s: 0.3 * cos,
        vy_m_s: 0.3 * sin,
        wz_rad_s: 0.0,
    };
    traction.expect("valid").command(&mut state, &command);
    (0..N).fold(0, |driven, i| driven | u32::from(state.travel[i].driven) << i)
}

#[test]
fn wheels_across_push_only_where_the_others_would_turn_the_vehicle() {
    let seven = WheelLayout::chugo7(0.30, 0.23, 0.066).expect("valid");
    let (along, all) = (0b101_1101, 0b111_1111); // wheels 2 and 6 roll across
    let found = [0.0_f64, 18.4, 30.0, 33.7, 45.0].map(|degrees| driven(&seven, degrees.to_radians()));
    // Beyond atan(0.6), 31 degrees, wheels across push a good part of it.
    assert_eq!(found, [along, along, along, all, all]);
    assert_eq!(driven(&seven, 1.5), 0b010_0010, "they alone, nearly across");
    // Three wheels at 120 degrees: going sideways wheel 1 has twice the way of the others, and
    // alone would turn the vehicle.
    let three = WheelLayout::omni(0.2, 0.0, 0.05).expect("valid");
    let sideways: [u32; 3] = [0.0, 90.0, 180.0].map(|degrees: f64| driven::<3>(&three, degrees.to_radians()));
    assert!(sideways.contains(&0b111), "{sideways:?}");
    assert!(
        sideways.iter().all(|driven| driven.count_ones() >= 2),
        "{sideways:?}"
    );
}

#[test]
fn drift_is_answered_with_the_gains_of_the_wheels_own_loops() {
    let traction = mecanum_base();
    let slides = BodyTwist {
        vx_m_s: 0.05,
        vy_m_s: 0.08,
        wz_rad_s: 0.0,
    };
    let rates = traction.kinematics().inverse(&slides).rad_s;
    let mut state = TractionState::new();
    for period in 0..600 {
        let read = rates.map(|rate| rate + 1e-6 * f64::from(period % 2));
        let _ = traction.step(&mut state, &level(AHEAD, &read), &TractionTarget::at(0.3));
    }
    assert_eq!(state.loops, TractionLoops::Traction);
    // Below 5 cm; and a thrust below that from which on rows are levelled, which leaves no wheel turned back.
    (state.drift_m, state.integral_n_m) = (0.02, 0.0);
    let torques = |mut state: TractionState<f64, 4>, more_m_s: f64, more_m: f64| {
        state.drift_m_s += more_m_s;
        state.drift_m += more_m;
        let sample = traction.step(&mut state, &level(AHEAD, &rates), &TractionTarget::at(0.1));
        (sample.wheels.requested.n_m, state.drift_m_s, state.drift_m)
    };
    let (none, v, m) = torques(state, 0.0, 0.0);
    let left = traction.kinematics().inverse_matrix().map(|row| row[1]);
    for (more_m_s, more_m) in [(0.02, 0.0), (0.0, 0.01)] {
        let (with, v1, m1) = torques(state, more_m_s, more_m);
        assert!((v1 - v) + (m1 - m) > 0.9 * (more_m_s + more_m) - 0.003); // the filter takes a period's part of it
        for i in 0..4 {
            // 0.3 N.m.s/rad and 2 N.m/rad; 2 %: slip and levels take the same in both.
            let own = -left[i] * (0.3 * (v1 - v) + 2.0 * (m1 - m));
            let more = with[i] - none[i];
            assert!(
                (more - own).abs() < 0.02 * own.abs(),
                "wheel {i}: {more} of {own} N.m"
            );
        }
    }
}

#[test]
fn a_change_of_direction_alone_is_no_fault() {
    // A heavy base without slip, 100 kg with four wheels of 10 rad/m: 0.8 m/s^2 at most, so the old
    // way lasts for 0.4 s.
    let traction = mecanum_base();
    let rows = traction.kinematics().inverse_matrix();
    let mass_kg = 100.0 + 4.0 * 100.0 * J;
    for from in [
        AHEAD,
        BodyTwist {
            vx_m_s: -0.3,
            ..AHEAD
        },
    ] {
        let (mut state, mut speed) = (TractionState::new(), [0.0_f64; 2]);
        for period in 0..12_000 {
            let aside = BodyTwist {
                vy_m_s: 0.3,
                ..BodyTwist::ZERO
            };
            let command = if period < 2000 { from } else { aside };
            let rates = rows.map(|[x, y, _]| x * speed[0] + y * speed[1]);
            let sample = traction.step(&mut state, &level(command, &rates), &TractionTarget::at(0.3));
            for axis in 0..2 {
                let torques = sample.wheels.applied.n_m;
                let force: f64 = rows
                    .iter()
                    .zip(torques)
                    .map(|(row, torque)| row[axis] * torque)
                    .sum();
                speed[axis] += force / mass_kg * T;
            }
            assert!(
                sample.loops != TractionLoops::Fallback,
                "period {period}: {speed:?}"
            );
        }
        // Loops of 120 N.s/m on 109 kg swing, by e each 1.8 s: 10 s leave 0.4 % of 0.3 m/s; five
        // times that for the limits in between.
        assert!(
            speed[0].abs() < 6e-3 && (speed[1] - 0.3).abs() < 6e-3,
            "{speed:?}"
        );
    }
}

#[test]
fn a_weak_motor_does_not_blunt_what_level_takes() {
    let mut wheels = carried_wheels(preset().kinematics());
    for i in [0, 2] {
        wheels[i].limit = TorqueLimit::constant(1.0).expect("valid"); // half of the others'
    }
    let traction = preset();
    let traction =
        Traction::new(traction.kinematics, traction.linkage, wheels, traction.config).expect("valid");
    let mut state = stood(&traction);
    let mut torques = [0.0; 7];
    for period in 0..200 {
        let rates = [1e-9 * f64::from(period); 7];
        let mut readings = level(AHEAD, &rates);
        readings.imu.roll_rad = 0.05; // left side up
        torques = traction
            .step(&mut state, &readings, &TractionTarget::at(1.0))
            .wheels
            .applied
            .n_m;
    }
    // 0.74 N.m.s/rad times 8 /s times 0.05 rad, 0.3 N.m, are taken from what the motor gives and
    // not from what it cannot.
    assert!(
        (torques[0].abs() - 1.0).abs() < 1e-9 && torques[2].abs() < 0.8,
        "{torques:?}"
    );
}
