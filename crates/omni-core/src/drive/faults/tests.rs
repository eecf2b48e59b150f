use super::*;
use proptest::prelude::*;

const CONFIG: FaultConfig<f64> = FaultConfig {
    jump_rad_s: 2.0,
    jump_periods: 5,
    stuck_rad_s: 1.0,
    stuck_torque_n_m: 1.5,
    stuck_periods: 50,
    silent_periods: 20,
    recovery_periods: 30,
};

/// One wheel, watched.
struct Bench {
    monitor: FaultMonitor<f64>,
    state: FaultState<f64, 1>,
    by_others: Option<f64>,
    torque: f64,
}

impl Bench {
    fn new() -> Self {
        Self {
            monitor: FaultMonitor::new(CONFIG).expect("valid"),
            state: FaultState::default(),
            by_others: None,
            torque: 0.0,
        }
    }

    fn read(&mut self, reading: Option<f64>) -> (f64, Option<Fault>) {
        let others = WheelVelocities {
            rad_s: [self.by_others.unwrap_or(0.0)],
        };
        let reference = WheelVelocities { rad_s: [5.0] };
        let expected = Expectation {
            by_others: &others,
            checked: &[self.by_others.is_some()],
            reference: &reference,
            torque_n_m: &[self.torque],
        };
        let velocities = self.monitor.step(&mut self.state, &[reading], &expected);
        (velocities.rad_s[0], self.state.faults()[0])
    }
}

#[test]
fn a_single_outlier_is_bridged_and_a_lasting_jump_is_a_fault() {
    let mut bench = Bench::new();
    assert_eq!(bench.read(Some(3.0)), (3.0, None));
    assert_eq!(bench.read(Some(300.0)), (3.0, None));
    assert_eq!(bench.read(Some(3.1)), (3.1, None));
    for _ in 0..4 {
        assert_eq!(bench.read(Some(9.0)), (3.1, None));
    }
    assert_eq!(bench.read(Some(9.0)), (0.0, Some(Fault::Jump)));
}

#[test]
fn a_silent_encoder_keeps_its_last_word_for_a_while_only() {
    let mut bench = Bench::new();
    bench.read(Some(3.0));
    for _ in 0..19 {
        assert_eq!(bench.read(None), (3.0, None));
    }
    assert_eq!(bench.read(None), (0.0, Some(Fault::Silent)));
    // One that has never said anything has no velocity to go on with.
    let mut mute = Bench::new();
    assert_eq!((mute.read(None), mute.state.usable()), ((0.0, None), [false]));
}

#[test]
fn a_reading_that_never_changes_is_stuck_only_while_it_should_have_moved() {
    let mut bench = Bench::new();
    for _ in 0..1000 {
        assert_eq!(bench.read(Some(3.0)), (3.0, None), "nothing speaks against it");
    }
    // The others may be wrong by any amount, as long as what they say does not move: a steady slip elsewhere.
    bench.by_others = Some(9.0);
    for _ in 0..1000 {
        assert_eq!(bench.read(Some(3.0)), (3.0, None), "a steady disagreement");
    }
    bench.by_others = Some(9.9);
    for _ in 0..1000 {
        assert_eq!(bench.read(Some(3.0)), (3.0, None), "less than what counts");
    }
    bench.by_others = Some(10.5);
    for _ in 0..49 {
        assert_eq!(bench.read(Some(3.0)).1, None);
    }
    assert_eq!(bench.read(Some(3.0)), (0.0, Some(Fault::Stuck)));

    // A reading that is wrong but alive is slip, not a fault of the encoder.
    let mut alive = Bench::new();
    for k in 0..1000 {
        alive.by_others = Some(0.1 * f64::from(k));
        assert_eq!(alive.read(Some(3.0 + 0.01 * f64::from(k % 3))).1, None);
    }
}

/// Periods until each of three wheels is stuck, up to 1000, where the first reads `first` and gets
/// 1.6 N.m in vain and the others read `others`.
fn stuck_after(first: impl Fn(u32) -> f64, others: impl Fn(u32) -> f64) -> [Option<u32>; 3] {
    stuck_at(5.0, first, others)
}

/// The same at a reference \[rad/s\].
fn stuck_at(reference: f64, first: impl Fn(u32) -> f64, others: impl Fn(u32) -> f64) -> [Option<u32>; 3] {
    let (monitor, mut state) = (FaultMonitor::new(CONFIG).expect("valid"), FaultState::default());
    let none_expected = WheelVelocities::zero();
    let mut after = [None; 3];
    for k in 0..1000 {
        let expected = Expectation {
            by_others: &none_expected,
            checked: &[false; 3],
            reference: &[reference; 3].into(),
            torque_n_m: &[1.6; 3],
        };
        monitor.step(
            &mut state,
            &[first(k), others(k), others(k + 1)].map(Some),
            &expected,
        );
        for (after, fault) in after.iter_mut().zip(state.faults()) {
            if fault == Some(Fault::Stuck) {
                after.get_or_insert(k);
            }
        }
    }
    after
}

#[test]
fn without_redundancy_no_count_while_torque_acts_and_others_turn_is_a_dead_encoder() {
    let turns = |k: u32| 4.0 + 0.1 * f64::from(k % 2);
    assert_eq!(stuck_after(|_| 0.0, turns), [Some(50), None, None]);
    // Stuck at a velocity is the same, and a wheel that moves ever so little is none.
    assert_eq!(stuck_after(|_| 3.0, turns), [Some(50), None, None]);
    assert_eq!(stuck_after(|k| 1e-3 * f64::from(k % 2), turns), [None; 3]);
    // However slowly it shall turn: a reading of 0 is no wheel near its reference. One that is stuck there
    // may be, for ten times as long, and for ever where the torque does not act towards the reference.
    assert_eq!(stuck_at(0.5, |_| 0.0, turns), [Some(50), None, None]);
    assert_eq!(stuck_at(0.5, |_| 0.4, turns), [Some(500), None, None]);
    assert_eq!(stuck_at(0.4, |_| 0.5, turns), [None; 3]);
}

#[test]
fn a_contradicted_reading_is_stuck_after_long_only_while_the_loop_pulls_in_vain() {
    let mut bench = Bench::new();
    bench.by_others = Some(9.0);
    for torque in [0.0, -0.3] {
        // At a limit the other way, or released: the wheel may well slip as it is.
        bench.torque = torque;
        for _ in 0..1000 {
            assert_eq!(bench.read(Some(0.0)), (0.0, None));
        }
    }
    bench.torque = 0.3; // towards its reference of 5 rad/s
    for _ in 0..499 {
        assert_eq!(bench.read(Some(0.0)), (0.0, None));
    }
    assert_eq!(bench.read(Some(0.0)).1, Some(Fault::Stuck));
}

#[test]
fn at_a_crawl_a_hard_pulled_wheel_without_a_count_is_stuck_if_the_others_turn() {
    // Periods until then; the others show this velocity in turn.
    let after = |torque: f64, shown: &[f64]| {
        let mut bench = Bench::new();
        bench.torque = torque;
        (0..20_000).find(|k| {
            bench.by_others = Some(shown[k % shown.len()]);
            bench.read(Some(0.0)).1 == Some(Fault::Stuck)
        })
    };
    // 1 rad/s in 500 periods is 5000 periods at 0.1 rad/s, whatever single counts make of it; the
    // first reading is no repetition.
    assert_eq!(after(1.6, &[0.125]), Some(4000));
    assert!(after(1.6, &[0.5, -0.25]).is_some_and(|after| after.abs_diff(4000) < 5));
    assert_eq!(after(1.6, &[0.5]), Some(1000));
    // A loop that is content, others that stand, that toggle, or that turn the other way.
    assert_eq!(after(1.4, &[0.5]), None);
    for shown in [&[0.0][..], &[0.5, -0.5], &[-0.5]] {
        assert_eq!(after(1.6, shown), None, "{shown:?}");
    }
    // Stuck at a velocity, which no sound encoder repeats for so long while the motor pulls, whatever the others show.
    let mut bench = Bench::new();
    (bench.torque, bench.by_others) = (1.6, Some(4.9));
    let found = (0..1000).find(|_| bench.read(Some(4.9)).1 == Some(Fault::Stuck));
    assert_eq!(found, Some(500));
}

#[test]
fn two_hard_pulled_wheels_without_a_count_have_twice_the_time_of_one() {
    // The same where no other wheel can check any more: of more than three wheels a blocked one has its second too.
    for (checked, second, stuck) in [
        (true, 0.0, 1000),
        (true, 5.5, 1000),
        (false, 0.0, 1000),
        (false, 5.5, 500),
    ] {
        let (monitor, mut state) = (FaultMonitor::new(CONFIG).expect("valid"), FaultState::default());
        let found = (0..20_000).find(|k| {
            let expected = Expectation {
                by_others: &[0.5; 4].into(),
                checked: &[checked; 4],
                reference: &[5.0; 4].into(),
                torque_n_m: &[1.6, 1.6, 0.0, 0.0],
            };
            let turning = 5.0 + 0.1 * f64::from(k % 2);
            monitor.step(&mut state, &[0.0, second, turning, turning].map(Some), &expected);
            state.faults()[0].is_some()
        });
        assert_eq!(found, Some(stuck), "checked {checked}, the second reads {second}");
    }
}

#[test]
fn a_released_wheel_makes_no_wheel_at_rest_faulty() {
    let (monitor, mut state) = (FaultMonitor::new(CONFIG).expect("valid"), FaultState::default());
    for k in 0..1000 {
        // The second stands; by the others it seemed to turn as long as the first was one of them.
        let others = [0.0, if k <= 100 { 3.0 } else { 0.0 }].into();
        let expected = Expectation {
            by_others: &others,
            checked: &[true; 2],
            reference: &WheelVelocities::zero(),
            torque_n_m: &[0.0; 2],
        };
        let first = if k < 100 { 0.0 } else { f64::NAN };
        monitor.step(&mut state, &[Some(first), Some(0.0)], &expected);
        assert_eq!(state.faults()[1], None, "period {k}");
    }
}

#[test]
fn a_vehicle_before_an_obstacle_is_no_dead_encoder_for_ten_times_as_long() {
    // Neither moves: after that time either every encoder is dead or every motor pushes in vain, and both should end.
    assert_eq!(stuck_after(|_| 0.0, |_| 0.0), [Some(500); 3]);
    // One wheel is blocked at a step while the others creep by less than counts.
    assert_eq!(
        stuck_after(|_| 0.0, |k| 0.9 + 0.01 * f64::from(k % 2)),
        [Some(500), None, None]
    );
}

#[test]
fn a_faulty_wheel_is_accepted_again_after_enough_good_readings() {
    let mut bench = Bench::new();
    bench.read(Some(3.0));
    assert_eq!(bench.read(Some(f64::NAN)).1, Some(Fault::NotANumber));
    for _ in 0..29 {
        assert_eq!(bench.read(Some(3.0)).1, Some(Fault::NotANumber));
    }
    assert_eq!(bench.read(Some(3.5)).1, None);
    assert_eq!(bench.read(Some(3.6)), (3.6, None));
    // 65535 is never.
    let mut never = Bench::new();
    never.monitor = FaultMonitor::new(FaultConfig {
        recovery_periods: u16::MAX,
        ..CONFIG
    })
    .expect("valid");
    never.read(Some(f64::NAN));
    for _ in 0..70_000 {
        assert_eq!(never.read(Some(1.0)).1, Some(Fault::NotANumber));
    }
}

/// A wheel whose encoder sticks at 3 rad/s while the vehicle slows down to rest.
fn stuck() -> Bench {
    let mut bench = Bench::new();
    bench.by_others = Some(3.0);
    bench.read(Some(3.0));
    bench.by_others = Some(0.0);
    for _ in 0..50 {
        bench.read(Some(3.0));
    }
    assert_eq!(bench.state.faults(), [Some(Fault::Stuck)]);
    bench
}

#[test]
fn a_dead_encoder_stays_faulty_when_the_vehicle_moves_as_it_reads() {
    let mut bench = stuck();
    bench.by_others = Some(3.0);
    for _ in 0..1000 {
        assert_eq!(bench.read(Some(3.0)).1, Some(Fault::Stuck));
    }
}

#[test]
fn a_stuck_wheel_comes_back_when_it_moves_again_and_agrees_with_the_others() {
    let mut bench = stuck();
    for k in 0..1000 {
        assert_eq!(
            bench.read(Some(3.0 + 0.01 * f64::from(k % 3))).1,
            Some(Fault::Stuck),
            "alive, but wrong"
        );
    }
    // Down to what the others say, as fast as a wheel can.
    for reading in [1.5, 0.1] {
        bench.read(Some(reading));
    }
    for _ in 0..30 {
        bench.read(Some(0.1));
    }
    assert_eq!(bench.state.faults(), [None]);
}

#[test]
fn faults_recover_at_rest_where_no_other_wheel_checks() {
    let mut bench = Bench::new();
    bench.read(Some(f64::NAN));
    for _ in 0..30 {
        assert_eq!(bench.state.faults(), [Some(Fault::NotANumber)]);
        bench.read(Some(0.0));
    }
    assert_eq!(bench.state.faults(), [None]);
    // Cleared by hand: judged afresh.
    bench.read(Some(f64::NAN));
    bench.state.clear();
    assert_eq!((bench.state.faults(), bench.state.usable()), ([None], [false]));
    bench.read(Some(0.0));
    assert_eq!(bench.state.usable(), [true]);
}

#[test]
fn a_gap_is_no_jump_and_a_slow_sensor_recovers() {
    let mut bench = Bench::new();
    bench.read(Some(0.0));
    for _ in 0..10 {
        bench.read(None);
    }
    assert_eq!(
        bench.read(Some(15.0)),
        (15.0, None),
        "2 rad/s a period for 11 periods"
    );
    // Readings every other period.
    bench.read(Some(f64::NAN));
    for _ in 0..30 {
        bench.read(None);
        bench.read(Some(15.0));
    }
    assert_eq!(bench.state.faults(), [None]);
}

#[test]
fn periods_that_read_no_number_are_a_gap_like_those_without_a_reading() {
    let mut bench = Bench::new();
    bench.read(Some(0.0));
    for _ in 0..5 {
        assert_eq!(bench.read(Some(f64::NAN)).1, Some(Fault::NotANumber));
    }
    // 9 rad/s after 6 periods of up to 2 rad/s each: good from the first.
    for reading in 1..=CONFIG.recovery_periods {
        assert_eq!(
            bench.state.faults(),
            [Some(Fault::NotANumber)],
            "before reading {reading}"
        );
        bench.read(Some(9.0));
    }
    assert_eq!(bench.state.faults(), [None]);
}

#[test]
fn jumps_in_most_periods_add_up_to_a_fault() {
    let mut bench = Bench::new();
    let mut found = None;
    for k in 0..40 {
        // 9 rad/s is out of reach within the one to four periods since the last good reading.
        found = bench.read(Some(if k % 5 == 0 { 1.0 } else { 10.0 })).1.or(found);
    }
    assert_eq!(found, Some(Fault::Jump));
}

#[test]
fn a_count_of_65535_periods_is_never() {
    let never = u16::MAX;
    let mut bench = Bench::new();
    let config = FaultConfig {
        jump_periods: never,
        stuck_periods: never,
        silent_periods: never,
        ..CONFIG
    };
    bench.monitor = FaultMonitor::new(config).expect("valid");
    bench.by_others = Some(0.0);
    bench.read(Some(0.0));
    bench.by_others = Some(9.0);
    for _ in 0..70_000 {
        assert_eq!(bench.read(Some(0.0)).1, None);
    }
    for _ in 0..70_000 {
        assert_eq!(bench.read(None).1, None);
    }
}

#[test]
fn a_lost_wheel_is_lost_until_declared_otherwise() {
    let mut bench = Bench::new();
    bench.state.declare_lost(&[true]);
    for _ in 0..1000 {
        assert_eq!(bench.read(Some(3.0)), (0.0, Some(Fault::Lost)));
    }
    bench.state.declare_lost(&[false]);
    assert_eq!(bench.read(Some(3.0)), (3.0, None));
}

#[test]
fn thresholds_and_times_are_checked_by_name() {
    let named = |config| FaultMonitor::<f64>::new(config).expect_err("refused").parameter;
    assert_eq!(
        named(FaultConfig {
            jump_rad_s: 0.0,
            ..CONFIG
        }),
        "jump_rad_s"
    );
    assert_eq!(
        named(FaultConfig {
            stuck_rad_s: f64::NAN,
            ..CONFIG
        }),
        "stuck_rad_s"
    );
    assert_eq!(
        named(FaultConfig {
            stuck_torque_n_m: -1.0,
            ..CONFIG
        }),
        "stuck_torque_n_m"
    );
    assert_eq!(
        named(FaultConfig {
            jump_periods: 0,
            ..CONFIG
        }),
        "jump_periods"
    );
    assert_eq!(
        named(FaultConfig {
            stuck_periods: 1,
            ..CONFIG
        }),
        "stuck_periods"
    );
    assert_eq!(
        named(FaultConfig {
            silent_periods: 0,
            ..CONFIG
        }),
        "silent_periods"
    );
    assert_eq!(
        named(FaultConfig {
            recovery_periods: 0,
            ..CONFIG
        }),
        "recovery_periods"
    );
}

proptest! {
    #[test]
    fn no_reading_at_all_makes_a_velocity_that_is_not_a_number(
        readings in prop::collection::vec(prop::option::of(any::<f64>()), 1..200),
    ) {
        let mut bench = Bench::new();
        for reading in readings {
            let (velocity, _) = bench.read(reading);
            prop_assert!(velocity.abs() <= 1e6);
        }
    }
}
