//! What a supervisor makes of rows that climb and of a vehicle that is stuck.

use super::*;

#[test]
fn the_row_behind_the_largest_drop_climbs_next_and_later_rows_are_run_up_to() {
    let supervisor = supervisor(SupervisorConfig::traction(T));
    for (heights, row, boost) in [
        ([0.0; 3], 0, 1.0),
        ([0.05, 0.0, 0.0], 1, 1.1936),
        ([0.05, 0.05, 0.0], 2, 1.1524),
        ([0.05; 3], 0, 1.0),
        ([0.009, 0.0, 0.0], 0, 1.0), // less than a centimetre
    ] {
        let state = seen(heights, 0.3, 0.1);
        let mut memory = SupervisorState::new();
        let mut target = TractionTarget::at(0.0);
        for _ in 0..200 {
            target = supervisor.step(&mut memory, &state);
        }
        assert_eq!(memory.row(), row, "{heights:?}");
        assert!(
            (target.speed_m_s - 0.3 * boost).abs() < 1e-9,
            "{heights:?}: {}",
            target.speed_m_s
        );
        let climbing: Vec<_> = (0..7).filter(|i| target.climbing[*i]).collect();
        assert_eq!(climbing, [&[4, 5, 6][..], &[3], &[0, 1, 2]][usize::from(row)]);
    }
}

#[test]
fn a_vehicle_that_is_stuck_backs_off_runs_up_and_gives_up_after_its_tries() {
    let mut config = SupervisorConfig::traction(T);
    config.retry.retries = 2;
    let supervisor = supervisor(config);
    let (mut memory, mut modes) = (SupervisorState::new(), Vec::new());
    let mut targets = Vec::new();
    for _ in 0..12_000 {
        // It follows its target backwards at once, and never moves ahead.
        let speed = targets.last().copied().unwrap_or(0.0_f64).min(0.0);
        let state = seen([0.05, 0.0, 0.0], speed, 1.0);
        let target = supervisor.step(&mut memory, &state);
        targets.push(target.speed_m_s);
        if modes.last() != Some(&memory.mode()) {
            modes.push(memory.mode());
        }
    }
    use SupervisorMode::{BackOff, Drive, GaveUp, RunUp};
    assert_eq!(
        modes,
        [Drive, BackOff, RunUp, Drive, BackOff, RunUp, Drive, GaveUp]
    );
    assert_eq!((memory.row_retries(), memory.retries()), (2, 2));
    let (slowest, fastest) = targets
        .iter()
        .fold((0.0_f64, 0.0_f64), |(low, high), t| (low.min(*t), high.max(*t)));
    // Back at 0.3 m/s, up at 0.505 and then a little more.
    assert!(
        (slowest + 0.3).abs() < 1e-9 && (fastest - 0.505 - 0.0173).abs() < 1e-9,
        "{slowest} {fastest}"
    );
    // At rest it forgets the row, not how often it has tried.
    let mut state = seen([0.05, 0.0, 0.0], 0.0, 0.0);
    preset().command(&mut state, &BodyTwist::ZERO);
    let _ = supervisor.step(&mut memory, &state);
    assert_eq!((memory.row_retries(), memory.retries(), memory.row()), (0, 2, 0));
}

#[test]
fn a_vehicle_that_gets_one_front_wheel_up_and_falls_back_gives_up_too() {
    for config in [SupervisorConfig::traction(T), SupervisorConfig::traction_runup(T)] {
        let supervisor = supervisor(config);
        let mut memory = SupervisorState::new();
        let mut target_m_s = 0.0_f64;
        for period in 0..200_000 {
            // Up by half of a step for 0.2 s of every 3 s, level again and stuck for the rest.
            let height = if period % 3000 < 200 { 0.025 } else { 0.0 };
            let state = seen([height, 0.0, 0.0], target_m_s.min(0.0), 1.0);
            target_m_s = supervisor.step(&mut memory, &state).speed_m_s;
        }
        assert_eq!(memory.retries(), u32::from(config.retry.retries));
        assert_eq!(memory.mode(), SupervisorMode::GaveUp);
    }
}

#[test]
fn on_an_edge_beyond_what_the_vehicle_climbs_there_is_one_retry() {
    let mut config = SupervisorConfig::traction(T);
    config.climbs_m = 0.055;
    let supervisor = supervisor(config);
    let tried = |climbed_m: f64| {
        let (mut memory, mut target_m_s) = (SupervisorState::new(), 0.0_f64);
        let mut drive = |memory: &mut SupervisorState<f64>, heights, climbed_m, moves: bool, periods| {
            for _ in 0..periods {
                let speed = if moves { target_m_s } else { target_m_s.min(0.0) };
                memory.feel(climbed_m, 0.055);
                target_m_s = supervisor.step(memory, &seen(heights, speed, 1.0)).speed_m_s;
            }
            (memory.retries(), memory.mode())
        };
        let of_first = drive(&mut memory, [0.0; 3], 0.0, false, 5000).0; // before its first row is up
        let _ = drive(&mut memory, [climbed_m, 0.0, 0.0], climbed_m, true, 1);
        let (retries, mode) = drive(&mut memory, [climbed_m, 0.0, 0.0], 0.0, false, 60_000);
        assert_eq!((mode, memory.edge_m()), (SupervisorMode::GaveUp, climbed_m));
        // Commanded to rest it forgets the edge.
        let mut state = seen([0.0; 3], 0.0, 0.0);
        preset().command(&mut state, &BodyTwist::ZERO);
        let _ = supervisor.step(&mut memory, &state);
        assert_eq!(memory.edge_m(), 0.0);
        assert!(of_first > 0, "it was stuck");
        retries - of_first
    };
    assert_eq!((tried(0.054), tried(0.056)), (8, 1));
    // That its next wheel finds the edge a little higher is no other edge.
    let (mut memory, mut target_m_s) = (SupervisorState::<f64>::new(), 0.0_f64);
    memory.feel(0.060, 0.055);
    for _ in 0..60_000 {
        if memory.retries() == 1 {
            memory.feel(0.0601, 0.055);
        }
        let state = seen([0.06, 0.0, 0.0], target_m_s.min(0.0), 1.0);
        target_m_s = supervisor.step(&mut memory, &state).speed_m_s;
    }
    assert_eq!((memory.retries(), memory.edge_m()), (1, 0.0601));
    // Past it, all is as before.
    let (mut memory, mut periods) = (SupervisorState::<f64>::new(), 0.0);
    memory.feel(0.060, 0.055);
    while memory.edge_m() > 0.0 {
        let _ = supervisor.step(&mut memory, &seen([0.06; 3], 0.3, 0.1));
        periods += 1.0;
    }
    let way_m: f64 = periods * 0.3 * T;
    assert!((way_m - 0.3).abs() < 1e-3, "{way_m}");
    // What is no height is none.
    let mut memory = SupervisorState::<f64>::new();
    for none in [f64::NAN, 0.0, -0.06] {
        memory.feel(none, 0.055);
    }
    assert_eq!(memory, SupervisorState::new());
}

#[test]
fn once_all_rows_are_past_an_obstacle_the_next_one_has_all_tries_again() {
    let supervisor = supervisor(SupervisorConfig::traction(T));
    let mut memory = SupervisorState::new();
    let mut target_m_s = 0.0_f64;
    let mut drive = |memory: &mut SupervisorState<f64>, heights, stuck: bool, periods| {
        for _ in 0..periods {
            let speed = if stuck { target_m_s.min(0.0) } else { target_m_s };
            let state = seen(heights, speed, 1.0);
            target_m_s = supervisor.step(memory, &state).speed_m_s;
        }
    };
    drive(&mut memory, [0.0; 3], true, 8000);
    let before = memory.retries();
    assert!(
        (1..8).contains(&before) && memory.mode() != SupervisorMode::GaveUp,
        "{memory:?}"
    );
    for heights in [[0.05, 0.0, 0.0], [0.05, 0.05, 0.0], [0.05; 3]] {
        drive(&mut memory, heights, false, 1000);
    }
    assert_eq!((memory.row_retries(), memory.row()), (0, 0));
    drive(&mut memory, [0.0; 3], true, 60_000);
    assert_eq!((memory.row_retries(), memory.retries()), (8, before + 8));
}

#[test]
fn rows_are_counted_in_the_direction_of_travel() {
    let supervisor = supervisor(SupervisorConfig::traction(T));
    let climbing = |vx_m_s: f64, vy_m_s: f64, high: [usize; 2]| {
        let mut state = seen([0.0; 3], 0.0, 0.0);
        let command = BodyTwist {
            vx_m_s,
            vy_m_s,
            wz_rad_s: 0.0,
        };
        preset().command(&mut state, &command);
        for i in high {
            state.motion.height_m[i] = 0.05;
        }
        let target = supervisor.step(&mut SupervisorState::new(), &state);
        (0..7).filter(|i| target.climbing[*i]).collect::<Vec<_>>()
    };
    assert_eq!(climbing(-0.3, 0.0, [0, 2]), [3]); // backwards the rear row is first, wheel 4 next
    assert_eq!(climbing(0.0, 0.3, [2, 6]), [1, 3, 5]); // to the left the left wheels are, then those in the middle
    assert_eq!(climbing(0.0, -0.3, [0, 4]), [1, 3, 5]);
}

#[test]
fn a_vehicle_that_nothing_moves_gives_up_although_its_encoders_read_nothing_at_all() {
    let any = crate::shaping::AxisLimits::unlimited();
    let limits = crate::shaping::TwistLimits::PerAxis {
        vx: any,
        vy: any,
        wz: any,
    };
    for usable in [7, 4] {
        let mut config = SupervisorConfig::traction(T);
        config.retry.retries = 2;
        let limiter = crate::shaping::TwistLimiter::new(limits, T).expect("valid");
        let mut policy = crate::traction::TractionPolicy::new(limiter, supervisor(config), preset());
        let mut torques = [0.0; 7];
        for period in 0..30_000 {
            let mut rates = [0.0; 7];
            rates[usable..].fill(f64::NAN);
            // Once it has given up, a reading that fails does not make it push again.
            if period > 25_000 {
                rates[..usable - 2].fill(f64::NAN);
            }
            crate::policy::Policy::step(&mut policy, &level(AHEAD, &rates), &mut torques);
        }
        assert_eq!(
            policy.supervisor().mode(),
            SupervisorMode::GaveUp,
            "{usable} wheels"
        );
        assert_eq!(torques, [0.0; 7]);
    }
}

/// A policy with two tries, on sensors.
fn policy_with(sensors: TractionSensors<f64>) -> crate::traction::TractionPolicy<f64, 7> {
    let any = crate::shaping::AxisLimits::unlimited();
    let limits = crate::shaping::TwistLimits::PerAxis {
        vx: any,
        vy: any,
        wz: any,
    };
    let mut config = SupervisorConfig::traction(T);
    config.retry.retries = 2;
    let limiter = crate::shaping::TwistLimiter::new(limits, T).expect("valid");
    let traction = seven(TractionConfig::traction(0.3, 2.0, T).with_sensors(sensors));
    crate::traction::TractionPolicy::new(limiter, supervisor(config), traction)
}

#[test]
fn a_vehicle_that_gave_up_drives_again_after_rest_or_in_another_direction() {
    let mut coarse = TractionSensors::perfect();
    coarse.encoder_counts = 256.0; // hide 0.04 m/s: slip is determined at 0.3 m/s, not at 0.05 m/s
    for (sensors, dead) in [(coarse, 7), (TractionSensors::perfect(), 2)] {
        for rests in [true, false] {
            let mut policy = policy_with(sensors);
            let mut torques = [0.0; 7];
            let mut go = |vx_m_s: f64, usable: usize, periods: usize| {
                let mut rates = [0.0; 7];
                rates[usable..].fill(f64::NAN);
                let command = BodyTwist {
                    vx_m_s,
                    ..BodyTwist::ZERO
                };
                for _ in 0..periods {
                    crate::policy::Policy::step(&mut policy, &level(command, &rates), &mut torques);
                }
                (policy.supervisor().mode(), torques[0])
            };
            assert_eq!(go(0.3, 7, 25_000).0, SupervisorMode::GaveUp);
            assert_eq!(go(0.3, dead, 1000), (SupervisorMode::GaveUp, 0.0)); // a reading that fails changes nothing
            if rests {
                let _ = go(0.0, dead, 5000);
            }
            let (mode, torque) = go(-0.05, dead, 100);
            assert!(
                mode == SupervisorMode::Drive && torque < -0.1,
                "{dead} wheels, {rests}: {mode:?}, {torque} N.m"
            );
        }
    }
}

#[test]
fn a_vehicle_that_gave_up_rests_although_it_is_lifted_onto_its_next_row() {
    let supervisor = supervisor(SupervisorConfig::traction(T));
    let mut memory = SupervisorState::new();
    let mut target_m_s = 0.0_f64;
    let mut stand = |memory: &mut SupervisorState<f64>, heights, slip_observable, periods| {
        for _ in 0..periods {
            let mut state = seen(heights, target_m_s.min(0.0), 1.0);
            state.slip_observable = slip_observable;
            target_m_s = supervisor.step(memory, &state).speed_m_s;
        }
        (memory.mode(), target_m_s)
    };
    let rests = (SupervisorMode::GaveUp, 0.0);
    assert_eq!(stand(&mut memory, [0.0; 3], true, 60_000), rests);
    assert_eq!(stand(&mut memory, [0.05, 0.0, 0.0], true, 5000), rests);
    assert_eq!(stand(&mut memory, [0.05, 0.05, 0.0], true, 5000), rests);
    // One that never had a retry: its sensors hide its slip. From 0.3 m/s it slows down with 4 m/s^2.
    let mut memory = SupervisorState::new();
    assert_eq!(stand(&mut memory, [0.0; 3], false, 5000), rests);
}

#[test]
fn a_vehicle_that_is_stuck_gives_up_where_slip_is_undetermined_too() {
    let mut coarse = TractionSensors::perfect();
    coarse.encoder_counts = 128.0; // hide 0.058 m/s
    let mut policy = policy_with(coarse);
    let slow = BodyTwist {
        vx_m_s: 0.1,
        ..BodyTwist::ZERO
    };
    let mut torques = [0.0; 7];
    for _ in 0..10_000 {
        // At a wall, which no count leaves: after a second of half its torque such a wheel is mute for three.
        crate::policy::Policy::step(&mut policy, &level(slow, &[0.0; 7]), &mut torques);
    }
    assert_eq!(policy.supervisor().mode(), SupervisorMode::GaveUp);
    assert_eq!((torques, policy.supervisor().retries()), ([0.0; 7], 0));
    // One that goes more than half as fast as commanded is not stuck, whatever it takes.
    let supervisor = supervisor(SupervisorConfig::traction(T));
    let mode = |speed_m_s: f64, periods: usize| {
        let mut state = seen([0.0; 3], speed_m_s, 1.0);
        preset().command(&mut state, &slow);
        (state.slip_observable, state.speed_m_s) = (false, speed_m_s);
        let mut memory = SupervisorState::new();
        for _ in 0..periods {
            let _ = supervisor.step(&mut memory, &state);
        }
        memory.mode()
    };
    assert_eq!(mode(0.051, 5000), SupervisorMode::Drive);
    // A second.
    assert_eq!(
        (mode(0.03, 999), mode(0.03, 1002)),
        (SupervisorMode::Drive, SupervisorMode::GaveUp)
    );
}

#[test]
fn a_slow_run_up_lasts_until_it_is_back_where_the_vehicle_was_stuck() {
    for config in [SupervisorConfig::traction(T), SupervisorConfig::traction_runup(T)] {
        for commanded_m_s in [0.02, 0.05, 0.3] {
            let supervisor = supervisor(config);
            let (mut state, mut retried) = (SupervisorState::new(), false);
            let (mut target_m_s, mut way_m, mut back_m) = (0.0, 0.0, 0.0_f64);
            // It follows its target, and is stuck at 0.
            for _ in 0..120_000 {
                let stuck = way_m >= 0.0;
                let mut traction = seen([0.0; 3], if stuck { 0.0 } else { target_m_s }, 1.0);
                traction.commanded_m_s = commanded_m_s;
                target_m_s = supervisor.step(&mut state, &traction).speed_m_s;
                way_m = f64::min(way_m + T * target_m_s, 0.0);
                back_m = back_m.min(way_m);
                retried |= state.mode() == SupervisorMode::RunUp;
                if retried && state.mode() == SupervisorMode::Drive {
                    break;
                }
            }
            // What the change of speed takes at both ends: less than a centimetre.
            assert!(
                retried && back_m < -0.1 && way_m > -0.01,
                "{commanded_m_s}: {back_m} {way_m}"
            );
        }
    }
}

/// As on a steep ramp: it needs nearly its whole thrust to keep the speed.
#[test]
fn a_vehicle_that_creeps_as_commanded_is_not_stuck() {
    for config in [SupervisorConfig::traction(T), SupervisorConfig::traction_runup(T)] {
        let supervisor = supervisor(config);
        let retries = |speed_m_s: f64| {
            let mut traction = seen([0.0; 3], speed_m_s, 1.0);
            traction.commanded_m_s = 0.03;
            let mut state = SupervisorState::new();
            for _ in 0..5000 {
                let _ = supervisor.step(&mut state, &traction);
            }
            state.retries()
        };
        assert_eq!((retries(0.03), retries(0.016)), (0, 0));
        assert!(retries(0.014) > 0); // less than half of it
    }
}

/// Of a vehicle whose wheels all spin as commanded: it goes by what they say, and stands.
#[test]
fn one_that_pushes_too_hard_for_its_slope_for_long_is_stuck_whatever_its_wheels_say() {
    let supervisor = supervisor(SupervisorConfig::traction(T));
    let first = |change: &dyn Fn(&mut TractionState<f64, 7>), mode| {
        let mut traction = seen([0.0; 3], 0.3, 0.6);
        traction.attitude_rad = Some([0.0; 2]);
        change(&mut traction);
        let mut state = SupervisorState::new();
        (0..20_000).find(|_| {
            let _ = supervisor.step(&mut state, &traction);
            state.mode() == mode
        })
    };
    let back_off = first(&|_| {}, SupervisorMode::BackOff).expect("stuck");
    // A sum of 3000 periods may be a rounding beyond 3 s.
    assert!((2999..=3000).contains(&back_off), "{back_off}");
    // Where slip does not stand out nothing is tried.
    let gave_up = first(
        &|traction| traction.slip_observable = false,
        SupervisorMode::GaveUp,
    );
    assert_eq!(gave_up, Some(back_off));
    // A light push, a climb, a slope, and no attitude, which would tell a slope.
    assert_eq!(
        first(&|traction| traction.thrust_n_m *= 0.8, SupervisorMode::BackOff),
        None
    );
    assert_eq!(
        first(
            &|traction| traction.motion.rise_m_s[3] = 0.05,
            SupervisorMode::BackOff
        ),
        None
    );
    // Without a mass its weight is two and a half times its thrust: 0.04 rad take a tenth of that, 0.06 rad more.
    for (pitch_rad, found) in [(0.035, Some(back_off)), (0.06, None)] {
        assert_eq!(
            first(
                &|traction| traction.attitude_rad = Some([0.0, pitch_rad]),
                SupervisorMode::BackOff
            ),
            found
        );
    }
    assert_eq!(
        first(&|traction| traction.attitude_rad = None, SupervisorMode::BackOff),
        None
    );
}

/// Three wheels at 120 degrees, going at so many m/s with so much thrust and this error of the heading.
fn three(speed_m_s: f64, thrust: f64, heading_rad: f64) -> TractionState<f64, 3> {
    let (traction, mut state) = (three_wheels(), TractionState::new());
    traction.command(&mut state, &AHEAD);
    (state.speed_m_s, state.heading_rad) = (speed_m_s, heading_rad);
    (state.thrust_n_m, state.largest_motor_n_m) = (thrust * LIMIT_N_M, LIMIT_N_M);
    state
}

const THREE_PLACES: [[f64; 2]; 3] = [[0.18, 0.0], [-0.09, 0.156], [-0.09, -0.156]];

fn three_wheels() -> Traction<f64, 3> {
    let carried = THREE_PLACES.map(|[x, y]| CarriedWheel {
        body: 0,
        centre_m: [x, y, 0.05],
    });
    let kinematics = Kinematics::new(&WheelLayout::omni(0.18, 0.0, 0.05).expect("valid")).expect("valid");
    let linkage = Linkage::new(&[], &carried).expect("a tree");
    Traction::new(
        kinematics,
        linkage,
        wheels(THREE_PLACES),
        TractionConfig::traction(0.3, 2.0, T),
    )
    .expect("valid")
}

#[test]
fn three_wheels_try_their_own_loops_and_one_thrust_in_turn() {
    let supervisor = Supervisor::new(&THREE_PLACES, SupervisorConfig::traction(T)).expect("valid");
    let (mut memory, mut by_own) = (SupervisorState::new(), Vec::new());
    let mut speed = 0.0_f64;
    for _ in 0..12_000 {
        // It follows its target backwards at once, and never moves ahead.
        let target = supervisor.step(&mut memory, &three(speed.min(0.0), 1.0, 0.0));
        speed = target.speed_m_s;
        if memory.row_retries() as usize == by_own.len() {
            by_own.push(target.own_loops);
        }
    }
    assert_eq!(&by_own[..4], [true, false, true, false]);
    // With a wheel to spare it is always one thrust.
    let seven = super::supervisor(SupervisorConfig::traction(T));
    assert!(
        !seven
            .step(&mut SupervisorState::new(), &seen([0.0; 3], 0.0, 1.0))
            .own_loops
    );
}

#[test]
fn three_wheels_that_turn_along_an_edge_by_their_own_loops_try_one_thrust() {
    for (heading_rad, mode) in [(0.44, SupervisorMode::Drive), (-0.46, SupervisorMode::BackOff)] {
        let supervisor = Supervisor::new(&THREE_PLACES, SupervisorConfig::traction(T)).expect("valid");
        let mut memory = SupervisorState::new();
        // It moves, and is not stuck.
        for _ in 0..10 {
            let _ = supervisor.step(&mut memory, &three(0.2, 0.5, heading_rad));
        }
        assert_eq!(memory.mode(), mode, "{heading_rad}");
    }
}

#[test]
fn own_loops_of_a_try_follow_its_target_and_give_way_to_no_slip() {
    let traction = three_wheels();
    let mut state = TractionState::new();
    let mut target = TractionTarget::at(-0.2);
    (target.trying, target.own_loops) = (true, true);
    let rolls = traction.kinematics().inverse(&AHEAD).rad_s; // rates of 0.3 m/s
    for period in 0..1000 {
        // Held up, and a wheel begins to spin.
        let read = [
            0.0,
            1e-6 * f64::from(period % 2),
            if period > 0 { 20.0 } else { 0.0 },
        ];
        let sample = traction.step(&mut state, &level(AHEAD, &read), &target);
        assert_eq!(sample.loops, TractionLoops::Plain);
        if period == 0 {
            for i in 0..3 {
                let wanted = 0.3 * rolls[i] * (-0.2 / 0.3);
                assert!(
                    (sample.wheels.requested.n_m[i] - wanted).abs() < 1e-5,
                    "wheel {i}"
                );
            }
        }
    }
}
