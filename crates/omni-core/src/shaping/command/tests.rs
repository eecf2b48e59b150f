use super::*;
use crate::shaping::{AxisLimits, MotionLimits};
use proptest::prelude::*;
use std::vec::Vec;

const NONE: f64 = f64::INFINITY;
const PERIOD: f64 = 0.1;

fn twist<R: Real>(components: [f64; 3]) -> BodyTwist<R> {
    BodyTwist::from_array(components.map(R::of))
}

fn free<R: Real>() -> TwistLimits<R> {
    TwistLimits::AlongMotion {
        linear: MotionLimits::unlimited(),
        yaw: MotionLimits::unlimited(),
    }
}

/// Limits of 1.0 per second, 2.0 while slowing down, with jerk limits of 5.0.
fn gentle<R: Real>() -> TwistLimits<R> {
    let limits = MotionLimits {
        velocity: R::of(1.5),
        acceleration: R::of(1.0),
        deceleration: R::of(2.0),
        jerk: R::of(5.0),
    };
    TwistLimits::AlongMotion {
        linear: limits,
        yaw: limits,
    }
}

fn per_axis() -> TwistLimits<f32> {
    let axis = AxisLimits::symmetric(1.5, 1.0, 2.0, 5.0);
    TwistLimits::PerAxis {
        vx: axis,
        vy: AxisLimits {
            jerk: f32::INFINITY,
            ..axis
        },
        wz: AxisLimits::unlimited(),
    }
}

fn shaper<R: Real>(
    limits: TwistLimits<R>,
    timeout_s: Option<f64>,
    emergency: Option<[f64; 2]>,
) -> CommandShaper<R> {
    let config = ShapingConfig {
        limits,
        timeout_s: timeout_s.map(R::of),
        emergency_deceleration: emergency.map(|[linear, yaw]| EmergencyDeceleration {
            linear_m_s2: R::of(linear),
            yaw_rad_s2: R::of(yaw),
        }),
        restart: Restart::AtOnce,
    };
    CommandShaper::new(config, R::of(PERIOD)).expect("valid")
}

/// Periods in which a single command is followed.
fn periods_followed<R: Real>(timeout_s: f64) -> u32 {
    let shaper = shaper::<R>(free(), Some(timeout_s), None);
    let mut state = ShaperState::default();
    let command = twist([0.5, -0.2, 0.1]);
    let mut shaped = shaper.step(&mut state, Some(&command));
    let mut periods = 0;
    while shaped.status == CommandStatus::Following && periods < 1000 {
        assert_eq!(shaped.twist, command);
        periods += 1;
        shaped = shaper.step(&mut state, None);
    }
    assert_eq!(
        (shaped.twist, shaped.status),
        (BodyTwist::ZERO, CommandStatus::TimedOut)
    );
    periods
}

#[test]
fn a_command_is_followed_when_it_arrives_and_for_the_time_out_after() {
    // 0.3 / 0.1 and 0.7 / 0.1 are below 3 and 7 in binary.
    for (timeout_s, periods) in [
        (0.0, 1),
        (0.05, 1),
        (0.1, 2),
        (0.25, 3),
        (0.3, 4),
        (0.7, 8),
        (60.0, 601),
    ] {
        assert_eq!(periods_followed::<f64>(timeout_s), periods, "{timeout_s} s");
        assert_eq!(periods_followed::<f32>(timeout_s), periods, "{timeout_s} s");
    }
}

#[test]
fn the_age_saturates_and_a_command_without_time_out_never_expires() {
    for (timeout_s, status) in [
        (None, CommandStatus::Following),
        (Some(1e9), CommandStatus::Following), // 1e10 periods: more than the counter holds
        (Some(1e8), CommandStatus::TimedOut),
    ] {
        let shaper = shaper::<f64>(free(), timeout_s, None);
        let mut state = ShaperState::default();
        shaper.step(&mut state, Some(&twist([1.0, 0.0, 0.0])));
        state.age = u32::MAX - 1;
        for _ in 0..3 {
            assert_eq!(shaper.step(&mut state, None).status, status, "{timeout_s:?}");
        }
        assert_eq!(state.age, u32::MAX);
    }
}

#[test]
fn an_expired_command_ends_in_rest_within_the_limits() {
    let shaper = shaper::<f64>(gentle(), Some(0.0), None);
    let mut state = ShaperState::at(&twist([1.0, 0.0, 0.0]));
    let command = twist([1.0, 0.0, 0.0]);
    assert_eq!(
        shaper.step(&mut state, Some(&command)).status,
        CommandStatus::Following
    );
    let mut speeds = Vec::from([1.0, 1.0]);
    for _ in 0..12 {
        let shaped = shaper.step(&mut state, None);
        assert_eq!(shaped.status, CommandStatus::TimedOut);
        speeds.push(shaped.twist.vx_m_s);
    }
    // Jerk takes 0.05 more or less a step, deceleration at most 0.2; then up to two periods to take back the rounding.
    let expected = [0.95, 0.85, 0.7, 0.5, 0.3, 0.15, 0.05, 0.0, 0.0];
    for (v, expected) in speeds[2..].iter().zip(expected) {
        assert!((v - expected).abs() < 1e-15, "{speeds:?}");
    }
    assert_eq!(speeds[11..], [0.0; 3]);
    for v in speeds.windows(3) {
        assert!(v[1] - v[2] <= 0.2 + 1e-15, "{v:?}");
        assert!(((v[1] - v[2]) - (v[0] - v[1])).abs() <= 0.05 + 1e-15, "{v:?}");
    }
}

#[test]
fn without_any_command_the_vehicle_comes_to_rest() {
    let shaper = shaper::<f64>(gentle(), None, None);
    let mut state = ShaperState::default();
    let shaped = shaper.step(&mut state, None);
    assert_eq!(
        (shaped.twist, shaped.status),
        (BodyTwist::ZERO, CommandStatus::Idle)
    );
    let mut state = ShaperState::at(&twist([0.5, 0.5, 0.5]));
    for _ in 0..12 {
        assert_eq!(shaper.step(&mut state, None).status, CommandStatus::Idle);
    }
    assert_eq!(state.twist(), BodyTwist::ZERO);
}

/// Linear and yaw speeds of ten periods without a command, from 1.5 m/s and 3 rad/s on.
fn left_alone(shaper: &CommandShaper<f64>, mut state: ShaperState<f64>) -> [[f64; 2]; 10] {
    [0; 10].map(|_| {
        let [x, y, w] = shaper.step(&mut state, None).twist.to_array();
        assert!((4.0 * x - 3.0 * y).abs() < 1e-14); // straight on
        [x.hypot(y), w.abs()]
    })
}

#[test]
fn without_a_command_nothing_brakes_harder_than_an_emergency_stop() {
    let moving = || ShaperState::at(&twist([0.9, 1.2, -3.0]));
    let brakes = Some([5.0, 10.0]);
    // No limits: never commanded, timed out, released in the middle of an emergency stop.
    let free_shaper = shaper::<f64>(free(), Some(0.0), brakes);
    let mut commanded = ShaperState::default();
    free_shaper.step(&mut commanded, Some(&twist([0.9, 1.2, -3.0])));
    let mut released = ShaperState::at(&twist([1.2, 1.6, -4.0]));
    released.emergency_stop();
    free_shaper.step(&mut released, None);
    released.release();
    for state in [moving(), commanded, released] {
        let expected = [[1.0, 2.0], [0.5, 1.0], [0.0, 0.0], [0.0, 0.0]];
        for (left, expected) in left_alone(&free_shaper, state).iter().zip(expected) {
            assert!((left[0] - expected[0]).abs() < 1e-14 && (left[1] - expected[1]).abs() < 1e-14);
        }
    }
    // A command of rest is one: it acts at once.
    assert_eq!(
        free_shaper.step(&mut moving(), Some(&BodyTwist::ZERO)).twist,
        BodyTwist::ZERO
    );
    // Gentler limits hold alone, to the bit.
    assert_eq!(
        left_alone(&shaper(gentle(), Some(0.0), brakes), moving()),
        left_alone(&shaper(gentle(), Some(0.0), None), moving())
    );
}

#[test]
fn limits_that_brake_harder_keep_their_jerk_beside_the_brake() {
    let limits = MotionLimits {
        deceleration: 9.0,
        jerk: 20.0,
        ..MotionLimits::unlimited()
    };
    let limits = TwistLimits::AlongMotion {
        linear: limits,
        yaw: limits,
    };
    let shaper = shaper::<f64>(limits, None, Some([4.0, 4.0]));
    let left = left_alone(&shaper, ShaperState::at(&twist([0.9, 1.2, 0.0])));
    let speeds: Vec<f64> = core::iter::once(1.5).chain(left.map(|[v, _]| v)).collect();
    // 20 m/s^3 for a period of 0.1 s is 2 m/s^2: 0.2, then 0.4 a period, which is the brake, and less at the end.
    let taken: Vec<f64> = speeds.windows(2).map(|v| v[0] - v[1]).collect();
    assert!(
        (taken[0] - 0.2).abs() < 1e-14 && (taken[1] - 0.4).abs() < 1e-14,
        "{taken:?}"
    );
    assert!(
        taken.iter().all(|step| (-1e-14..0.4 + 1e-14).contains(step)),
        "{taken:?}"
    );
    assert!(speeds[10] == 0.0, "{speeds:?}");
}

#[test]
fn an_emergency_stop_brakes_at_its_own_deceleration_without_easing_in() {
    let shaper = shaper::<f64>(gentle(), None, Some([5.0, 20.0]));
    let mut state = ShaperState::at(&twist([0.9, 1.2, -3.0]));
    state.emergency_stop();
    let speeds = [0; 4].map(|_| {
        let shaped = shaper.step(&mut state, None);
        assert_eq!(shaped.status, CommandStatus::EmergencyStop);
        shaped.twist.to_array()
    });
    // 1.5 m/s in (0.6, 0.8) loses 0.5 a period, the yaw rate 2.0; 1e-15: a few roundings of numbers about 1.
    for (is, expected) in speeds
        .iter()
        .zip([[0.6, 0.8, -1.0], [0.3, 0.4, 0.0], [0.0; 3], [0.0; 3]])
    {
        for (a, b) in is.iter().zip(expected) {
            assert!((a - b).abs() < 1e-15, "{speeds:?}");
        }
    }
    assert_eq!(speeds[3], [0.0; 3]);
}

#[test]
fn an_emergency_stop_without_deceleration_is_at_once() {
    let shaper = shaper::<f32>(gentle(), None, None);
    let mut state = ShaperState::at(&twist([0.9, 1.2, -3.0]));
    state.emergency_stop();
    assert_eq!(shaper.step(&mut state, None).twist, BodyTwist::ZERO);
}

#[test]
fn only_a_command_after_the_release_moves_the_vehicle_again() {
    let shaper = shaper::<f64>(gentle(), None, Some([2.0, 2.0]));
    let command = twist([1.0, 0.0, 0.0]);
    let mut state = ShaperState::at(&command);
    assert_eq!(
        shaper.step(&mut state, Some(&command)).status,
        CommandStatus::Following
    );
    state.emergency_stop();
    for _ in 0..2 {
        shaper.step(&mut state, Some(&command)); // does not count
    }
    assert!(state.is_stopped());
    assert!((state.twist().vx_m_s - 0.6).abs() < 1e-15);
    state.release();
    assert!(!state.is_stopped());
    let shaped = shaper.step(&mut state, None);
    assert_eq!(shaped.status, CommandStatus::Idle);
    assert!((shaped.twist.vx_m_s - 0.55).abs() < 1e-15); // goes on to rest, eased by a jerk of 5.0
    let before = shaped.twist.vx_m_s;
    let shaped = shaper.step(&mut state, Some(&command));
    assert_eq!(shaped.status, CommandStatus::Limited);
    assert!((shaped.twist.vx_m_s - before).abs() < 1e-15); // the slowing down has to be taken back first
    for _ in 0..20 {
        shaper.step(&mut state, None);
    }
    assert_eq!(state.twist(), command);
}

#[test]
fn parameters_out_of_range_are_named() {
    let good = ShapingConfig {
        restart: Restart::AtOnce,
        limits: free(),
        timeout_s: Some(0.5),
        emergency_deceleration: None,
    };
    let named = |config, period| {
        CommandShaper::<f64>::new(config, period)
            .expect_err("refused")
            .parameter
    };
    for bad in [-0.1, f64::NAN, NONE] {
        let config = ShapingConfig {
            timeout_s: Some(bad),
            ..good
        };
        assert_eq!(named(config, 0.1), "timeout_s");
        if bad < NONE {
            assert_eq!(named(good, bad), "period_s");
        }
    }
    let stop = |linear_m_s2, yaw_rad_s2| ShapingConfig {
        emergency_deceleration: Some(EmergencyDeceleration {
            linear_m_s2,
            yaw_rad_s2,
        }),
        ..good
    };
    assert_eq!(named(stop(0.0, 1.0), 0.1), "emergency_deceleration.linear_m_s2");
    assert_eq!(
        named(stop(1.0, f64::NAN), 0.1),
        "emergency_deceleration.yaw_rad_s2"
    );
}

/// What may arrive in a period: mostly nothing or a good command, sometimes nonsense.
fn any_command() -> impl Strategy<Value = Option<[f64; 3]>> {
    let nonsense = prop::sample::select(std::vec![f64::NAN, NONE, -NONE, 1.1e6, -1e9, f64::MAX]);
    prop_oneof![
        3 => Just(None),
        3 => prop::array::uniform3(-3.0..3.0_f64).prop_map(Some),
        1 => (prop::array::uniform3(-3.0..3.0_f64), 0..3_usize, nonsense).prop_map(|(mut twist, i, bad)| {
            twist[i] = bad;
            Some(twist)
        }),
        1 => prop::array::uniform3(prop_oneof![-1e6..1e6_f64, Just(1e6), Just(1e-30), Just(0.0)]).prop_map(Some),
    ]
}

/// Emergency stop in every tenth period or so.
fn any_stops() -> impl Strategy<Value = Vec<bool>> {
    prop::collection::vec(prop::bool::weighted(0.1), 40)
}

fn good(command: &[f64; 3]) -> bool {
    command.iter().all(|v| v.is_finite() && v.abs() <= 1e6)
}

/// Steps through `commands`; an emergency stop is latched in periods where `stops` says so, and released elsewhere.
fn run<R: Real>(
    shaper: &CommandShaper<R>,
    commands: &[Option<[f64; 3]>],
    stops: &[bool],
) -> Vec<ShapedCommand<R>> {
    let mut state = ShaperState::default();
    let mut shaped = Vec::new();
    for (command, stop) in commands.iter().zip(stops) {
        match (*stop, state.is_stopped()) {
            (true, false) => state.emergency_stop(),
            (false, true) => state.release(),
            _ => {}
        }
        shaped.push(shaper.step(&mut state, command.map(twist).as_ref()));
    }
    shaped
}

proptest! {
    #[test]
    fn refused_commands_count_as_none_and_are_reported(
        commands in prop::collection::vec(any_command(), 40), stops in any_stops(),
    ) {
        let shaper = shaper::<f32>(gentle(), Some(0.35), Some([3.0, 3.0]));
        let all = run(&shaper, &commands, &stops);
        let filtered: Vec<_> = commands.iter().map(|c| c.filter(good)).collect();
        let only_good = run(&shaper, &filtered, &stops);
        for ((a, b), (command, kept)) in all.iter().zip(&only_good).zip(commands.iter().zip(&filtered)) {
            prop_assert_eq!((a.twist, a.status), (b.twist, b.status));
            prop_assert_eq!(a.rejected, command.is_some() && kept.is_none());
            prop_assert!(!b.rejected);
        }
    }

    #[test]
    fn the_status_is_of_the_command_in_force(
        commands in prop::collection::vec(any_command(), 40), stops in any_stops(),
    ) {
        let shaped = run(&shaper::<f64>(gentle(), Some(0.3), None), &commands, &stops);
        let mut last: Option<(usize, [f64; 3])> = None;
        for (k, shaped) in shaped.iter().enumerate() {
            if let Some(command) = commands[k].filter(good) {
                last = Some((k, command));
            }
            if stops[k] {
                last = None;
            }
            let expected = match last {
                _ if stops[k] => CommandStatus::EmergencyStop,
                None => CommandStatus::Idle,
                Some((arrived, _)) if k - arrived > 3 => CommandStatus::TimedOut,
                Some((_, command)) if shaped.twist == twist(command) => CommandStatus::Following,
                Some(_) => CommandStatus::Limited,
            };
            prop_assert_eq!(shaped.status, expected, "period {}", k);
        }
    }

    #[test]
    fn whatever_arrives_the_twist_is_finite_and_within_the_limits(
        commands in prop::collection::vec(any_command(), 40), stops in any_stops(),
    ) {
        for limits in [gentle(), per_axis()] {
            for shaped in run(&shaper::<f32>(limits, Some(0.3), Some([3.0, 3.0])), &commands, &stops) {
                prop_assert!(shaped.twist.to_array().iter().all(|v| v.is_finite()));
                // The limit along the motion is safe to 64 units in the last place.
                prop_assert!(shaped.twist.vx_m_s.abs() <= 1.5 * (1.0 + 64.0 * f32::EPSILON));
            }
        }
    }

    #[test]
    fn an_emergency_stop_keeps_the_direction_and_takes_speed_over_deceleration(
        start in prop::array::uniform3(-1e3..1e3_f64), linear in 1.0..1e3_f64, yaw in 1.0..1e3_f64,
    ) {
        let shaper = shaper::<f64>(free(), None, Some([linear, yaw]));
        let mut state = ShaperState::at(&twist(start));
        state.emergency_stop();
        let periods = |speed: f64, deceleration: f64| speed / (deceleration * PERIOD);
        let speed = start[0].hypot(start[1]);
        for k in 1..30_000 {
            let [x, y, w] = shaper.step(&mut state, None).twist.to_array();
            // k subtractions, each rounded to the size of the speed.
            let rounding = 1e-15 * f64::from(k) * (speed + start[2].abs());
            let left = |from: f64, rate: f64| (from - f64::from(k) * rate * PERIOD).max(0.0);
            prop_assert!((x.hypot(y) - left(speed, linear)).abs() <= rounding);
            prop_assert!((w.abs() - left(start[2].abs(), yaw)).abs() <= rounding);
            prop_assert!((x * start[1] - y * start[0]).abs() <= rounding * speed);
            if [x, y, w] == [0.0; 3] {
                let longest = periods(speed, linear).max(periods(start[2].abs(), yaw));
                prop_assert!((f64::from(k) - longest.ceil()).abs() <= 1.0, "{k} periods, {longest} expected");
                return Ok(());
            }
        }
        prop_assert!(false, "never stops");
    }
}

#[test]
fn after_a_start_a_time_out_and_a_stop_a_pushed_stick_moves_nothing_until_at_rest() {
    let mut config = ShapingConfig::none();
    (config.timeout_s, config.restart) = (Some(0.2), Restart::Neutral);
    let shaper = CommandShaper::new(config, PERIOD).expect("valid");
    let (pushed, rest) = (twist([0.5, 0.0, 0.0]), BodyTwist::ZERO);
    // Almost at rest is not at rest; a broken command neither.
    let never = [pushed, twist([1e-9, 0.0, 0.0]), twist([f64::NAN, 0.0, 0.0])];
    let waits = |state: &mut ShaperState<f64>, status| {
        for command in never {
            let shaped = shaper.step(state, Some(&command));
            assert_eq!((shaped.twist, shaped.status), (rest, status));
        }
        assert_eq!(shaper.step(state, Some(&rest)).status, CommandStatus::Following);
        assert_eq!(shaper.step(state, Some(&pushed)).twist, pushed);
    };
    let mut state = ShaperState::default();
    waits(&mut state, CommandStatus::Idle);
    // Two periods without a command are no time-out, three are.
    for _ in 0..2 {
        assert_eq!(shaper.step(&mut state, None).twist, pushed);
    }
    assert_eq!(shaper.step(&mut state, Some(&pushed)).twist, pushed);
    for _ in 0..3 {
        shaper.step(&mut state, None);
    }
    waits(&mut state, CommandStatus::TimedOut);
    state.emergency_stop();
    for command in [pushed, rest, pushed] {
        shaper.step(&mut state, Some(&command)); // rest during the stop is no release
    }
    state.release();
    waits(&mut state, CommandStatus::Idle);
}
