use super::*;

use std::vec::Vec;

use omni_core::drive::Fault;
use omni_core::loops::Rest;
use omni_core::shaping::{AxisLimits, TwistLimiter, TwistLimits};
use omni_core::{
    BodyTwist, ControlState, Controller, Coordination, Drive, DriveConfig, DriveInput, DriveMode, DriveState,
    PidConfig, PidGains, TorqueLimit, WheelControlConfig, WheelLayout,
};

use crate::{DriveReport, FrameError, HOLD_PERIODS, Loops, LoopsState, answer_frame, request_frame};

const N: usize = 4;

fn layout() -> WheelLayout<f32, N> {
    WheelLayout::mecanum4(0.6, 0.4, 0.1).expect("valid")
}

fn control() -> WheelControlConfig<f32, N> {
    let gains = PidGains {
        kp_n_m_s_rad: 0.3,
        ki_n_m_rad: 2.0,
        kd_n_m_s2_rad: 0.0,
    };
    WheelControlConfig {
        pid: PidConfig::new(gains, 1e-3),
        limits: [TorqueLimit::constant(2.0).expect("valid"); N],
        coordination: Coordination::scale_references(),
    }
}

fn controller() -> Controller<f32, N> {
    Controller::new(&layout(), control()).expect("valid")
}

/// No more than 0.05 m/s sideways.
fn limiter() -> TwistLimiter<f32> {
    let any = AxisLimits::unlimited();
    let vy = AxisLimits {
        max_velocity: 0.05,
        ..any
    };
    TwistLimiter::new(TwistLimits::PerAxis { vx: any, vy, wz: any }, 1e-3).expect("valid")
}

fn request(sequence: u32, restart: bool) -> Request<N> {
    let command = BodyTwist {
        vx_m_s: 0.1,
        vy_m_s: 0.02,
        wz_rad_s: -0.1,
    };
    Request {
        sequence,
        restart,
        emergency_stop: false,
        command,
        measured_rad_s: [0.1, 0.2, 0.3, sequence as f32 * 0.01],
    }
}

/// A server and its wire.
struct Bench {
    server: Server<LoopsState<N>, N>,
    controller: Controller<f32, N>,
    limiter: TwistLimiter<f32>,
}

impl Bench {
    fn new() -> Self {
        Self {
            server: Server::new(7, 1000),
            controller: controller(),
            limiter: limiter(),
        }
    }

    fn raw(&mut self, received: &mut [u8]) -> FromController<Answer<N>> {
        let mut out = [0; answer_frame(N)];
        let loops = Loops {
            controller: &self.controller,
            limiter: &self.limiter,
        };
        let mut answer = self.server.answer(&loops, received, &mut out).to_vec();
        decode(&mut answer).expect("always answers")
    }

    fn ask(&mut self, sequence: u32, restart: bool) -> Answer<N> {
        self.step(request(sequence, restart))
    }

    fn step(&mut self, request: Request<N>) -> Answer<N> {
        let mut frame = [0; request_frame(N)];
        encode(&ToController::Request(request), &mut frame);
        self.answer(&mut frame)
    }

    fn answer(&mut self, received: &mut [u8]) -> Answer<N> {
        match self.raw(received) {
            FromController::Answer(answer) => answer,
            FromController::Greeting(_) => panic!("not asked for"),
        }
    }
}

#[test]
fn a_greeting_says_what_the_controller_was_built_for() {
    let mut frame = [0; 16];
    encode(&ToController::<N>::Hello, &mut frame);
    let expected = Greeting {
        version: PROTOCOL_VERSION,
        wheels: 4,
        period_us: 1000,
        digest: 7,
    };
    assert_eq!(Bench::new().raw(&mut frame), FromController::Greeting(expected));
}

#[test]
fn answers_are_the_controllers_own_steps_bit_for_bit() {
    let (mut bench, controller) = (Bench::new(), controller());
    let mut state = ControlState::default();
    for k in 1..50 {
        let answer = bench.ask(k, k == 1);
        let measured = request(k, false).measured_rad_s.into();
        let sample = controller.step(&mut state, &request(k, false).command, &measured);
        assert_eq!((answer.sequence, answer.action), (k, Action::Step));
        assert_eq!(answer.sample, sample);
        assert_eq!(answer.estimated, controller.kinematics().forward(&measured));
        assert_eq!(answer.residual, controller.kinematics().residual(&measured));
    }
}

#[test]
fn no_answer_holds_a_number_that_is_none() {
    let mut bench = Bench::new();
    for (k, bad) in (1..).zip([f32::NAN, f32::INFINITY, -1e30]) {
        let mut asked = request(k, k == 1);
        asked.measured_rad_s[1] = bad;
        let answer = bench.step(asked);
        let kinematics = answer
            .estimated
            .to_array()
            .into_iter()
            .chain(answer.residual.rad_s);
        assert!(
            kinematics
                .chain(answer.sample.wheels.applied.n_m)
                .all(f32::is_finite),
            "{bad}: {answer:?}"
        );
        assert!(!answer.sample.wheels.active[1]);
    }
}

#[test]
fn nothing_moves_before_a_restart() {
    let mut bench = Bench::new();
    for k in 1..4 {
        let answer = bench.ask(k, false);
        assert_eq!((answer.action, answer.sequence), (Action::Stop, k));
        // Without a step nothing but that there is no torque.
        let mut none = ControlSample::zero();
        none.wheels.end(false);
        assert_eq!(answer.sample, none);
    }
    assert_eq!(bench.ask(4, true).action, Action::Step);
}

#[test]
fn damaged_requests_hold_the_torques_ten_times_and_then_there_are_none() {
    let mut bench = Bench::new();
    bench.ask(1, true);
    let last = bench.ask(2, false);
    assert!(last.sample.wheels.applied.n_m.iter().all(|&torque| torque != 0.0));
    for k in 1..=HOLD_PERIODS {
        let answer = bench.answer(&mut [2, 1, 2]);
        assert_eq!((answer.action, answer.sequence), (Action::Hold, 2 + k));
        assert_eq!(answer.sample, last.sample);
        assert_eq!(answer.counters.truncated, k);
    }
    for _ in 0..3 {
        let answer = bench.answer(&mut [2, 1, 2]);
        assert_eq!(answer.action, Action::Stop);
        assert_eq!(answer.sample.wheels.applied, WheelTorques::zero());
    }
    assert_eq!(bench.ask(16, false).action, Action::Stop); // a good request does not help
    assert_eq!(bench.server.torques(), &WheelTorques::zero());
}

#[test]
fn a_server_that_stops_ends_the_sample_and_shorts_motors_if_configured() {
    for short_windings in [false, true] {
        let mut bench = Bench::new();
        let mut rest = Rest::default();
        rest.short_windings = short_windings;
        bench.controller = bench.controller.with_rest(rest).expect("valid");
        bench.ask(1, true);
        let driven = bench.ask(2, false).sample.wheels;
        assert_eq!((driven.active, driven.ended), ([true; N], false));
        let stopped = (0..=HOLD_PERIODS).map(|_| bench.server.missed()).last();
        assert_eq!(stopped, Some(Action::Stop));
        let wheels = bench.server.sample().wheels;
        assert_eq!((wheels.active, wheels.ended), ([false; N], true));
        let none = WheelTorques::zero();
        assert_eq!((wheels.applied, wheels.requested), (none, none));
        assert_eq!(bench.server.brake(), [short_windings; N]);
        // The answer to a late request says so too, and a restart drives again.
        assert_eq!(bench.ask(3, false).sample.wheels, wheels);
        assert_eq!(bench.ask(4, true).sample.wheels.active, [true; N]);
        assert_eq!(bench.server.brake(), [false; N]);
    }
}

#[test]
fn a_restart_starts_the_loops_afresh() {
    let mut bench = Bench::new();
    let fresh = bench.ask(1, true);
    for k in 2..30 {
        bench.ask(k, false);
    }
    let sample = |sequence| Request {
        sequence,
        ..request(1, true)
    };
    let mut frame = [0; request_frame(N)];
    encode(&ToController::Request(sample(900)), &mut frame);
    let again = bench.answer(&mut frame);
    assert_eq!(again.sample, fresh.sample); // the integrals have forgotten
    assert_eq!((again.action, again.sequence), (Action::Step, 900));
    assert_eq!(bench.ask(901, false).action, Action::Step);
    assert!(bench.server.guard().counters().is_zero());
}

#[test]
fn a_gap_in_the_numbers_is_counted_and_too_long_a_one_stops() {
    let mut bench = Bench::new();
    bench.ask(1, true);
    let answer = bench.ask(12, false);
    assert_eq!(
        (answer.action, answer.counters.lost),
        (Action::Step, HOLD_PERIODS)
    );
    let answer = bench.ask(24, false);
    assert_eq!(
        (answer.action, answer.counters.lost),
        (Action::Stop, 2 * HOLD_PERIODS + 1)
    );
    assert_eq!(answer.sample.wheels.applied, WheelTorques::zero());
}

#[test]
fn a_timer_without_frames_does_as_damaged_frames_do() {
    let mut bench = Bench::new();
    let last = bench.ask(1, true).sample.wheels.applied;
    for _ in 0..HOLD_PERIODS {
        assert_eq!(
            (bench.server.missed(), *bench.server.torques()),
            (Action::Hold, last)
        );
    }
    assert_eq!(
        (bench.server.missed(), *bench.server.torques()),
        (Action::Stop, WheelTorques::zero())
    );
    assert_eq!(bench.server.guard().counters().lost, HOLD_PERIODS + 1);
}

#[test]
fn a_request_that_repeats_itself_is_not_stepped_twice() {
    let mut bench = Bench::new();
    bench.ask(1, true);
    let (first, second) = (bench.ask(2, false), bench.ask(2, false));
    assert_eq!((second.action, second.sample), (Action::Hold, first.sample));
    assert_eq!(second.counters.lost, 1);
}

#[test]
fn a_short_buffer_is_left_without_an_answer() {
    let mut bench = Bench::new();
    let mut out = [0; answer_frame(N) - 8];
    let loops = Loops {
        controller: &bench.controller,
        limiter: &bench.limiter,
    };
    assert!(bench.server.answer(&loops, &mut [1], &mut out).is_empty());
}

#[test]
fn a_server_of_seven_wheels_is_small() {
    // State 4 numbers per wheel, and 5 words in whose bits overloads of all wheels are counted; answer 11 numbers, 2
    // marks and 2 bytes of the report a wheel: what is not stated in the docs is new.
    let bytes = core::mem::size_of::<Server<LoopsState<7>, 7>>();
    assert!(bytes <= 76 * 7 + 5 * 4 + 80 + 20, "{bytes}");
}

#[test]
fn every_damaged_request_is_answered_and_none_is_stepped() {
    let mut frame = [0; request_frame(N)];
    encode(&ToController::Request(request(2, false)), &mut frame);
    let outcomes: Vec<_> = (0..8 * frame.len() - 8)
        .map(|bit| {
            let mut bench = Bench::new();
            let before = bench.ask(1, true);
            let mut damaged = frame;
            damaged[bit / 8] ^= 1 << (bit % 8);
            let answer = bench.answer(&mut damaged);
            assert_eq!(
                (answer.action, answer.sample),
                (Action::Hold, before.sample),
                "bit {bit}"
            );
            let counters = answer.counters;
            assert_eq!(counters.truncated + counters.corrupted, 1, "bit {bit}");
            if counters.corrupted == 1 {
                FrameError::Corrupted
            } else {
                FrameError::Truncated
            }
        })
        .collect();
    // Most bits are payload; the few that say how long something is look like a loss of bytes.
    let corrupted = outcomes.iter().filter(|&&e| e == FrameError::Corrupted).count();
    assert!(
        corrupted * 4 > outcomes.len() * 3,
        "{corrupted} of {}",
        outcomes.len()
    );
}

/// A drive that releases a silent wheel after 3 periods, and a command after 5.
fn drive() -> Drive<f32, N> {
    let mut config = DriveConfig::new(layout(), control());
    config.shaping.timeout_s = Some(5e-3);
    let mut faults = omni_core::drive::FaultConfig::unchecked();
    faults.silent_periods = 3;
    config.faults = Some(faults);
    Drive::new(config).expect("valid")
}

/// One frame to a server of a drive, and its answer.
fn ask_drive(
    server: &mut Server<DriveState<f32, N>, N>,
    drive: &Drive<f32, N>,
    asked: Request<N>,
) -> Answer<N> {
    let (mut frame, mut out) = ([0; request_frame(N)], [0; answer_frame(N)]);
    encode(&ToController::Request(asked), &mut frame);
    let mut answer = server.answer(drive, &mut frame, &mut out).to_vec();
    match decode(&mut answer).expect("always answers") {
        FromController::Answer(answer) => answer,
        FromController::Greeting(_) => panic!("not asked for"),
    }
}

#[test]
fn answers_of_a_drive_are_its_own_steps_bit_for_bit() {
    let (drive, mut server) = (drive(), Server::new(7, 1000));
    let mut state = DriveState::new(&drive);
    for k in 1..50 {
        // Wheel 2 is silent for a while; the emergency stop is pressed for a while; commands end at some time.
        let mut asked = request(k, k == 1);
        if (20..30).contains(&k) {
            asked.measured_rad_s[1] = f32::NAN;
        }
        if k >= 35 {
            asked.command = BodyTwist::from_array([f32::NAN; 3]);
        }
        asked.emergency_stop = (10..15).contains(&k);
        let mut input = DriveInput::measured(&asked.measured_rad_s.into());
        input.emergency = asked.emergency_stop;
        if (20..30).contains(&k) {
            input.readings_rad_s[1] = None;
        }
        input.command = (k < 35).then_some(asked.command);
        let (answer, sample) = (
            ask_drive(&mut server, &drive, asked),
            drive.step(&mut state, &input),
        );
        assert_eq!((answer.sequence, answer.action), (k, Action::Step));
        assert_eq!(answer.sample.command, sample.shaped.twist);
        assert_eq!(answer.sample.wheels, sample.wheels);
        assert_eq!(
            (answer.estimated, answer.residual),
            (sample.slip.estimated, sample.slip.residual)
        );
        let report = DriveReport {
            mode: sample.mode.number(),
            faults: sample.faults.map(|fault| fault.map_or(0, Fault::number)),
            motion_known: sample.motion_known,
            excluded: sample.slip.excluded,
            pose: [sample.pose.x_m, sample.pose.y_m, sample.pose.yaw_rad],
        };
        assert_eq!(answer.drive, report);
        assert_eq!(answer.brake(), sample.brake);
        assert_eq!(server.report(), &report);
        // From its third silent period to one good reading the wheel is released; the others drive on.
        let silent = (22..30).contains(&k);
        assert_eq!(answer.drive.faults[1] == Fault::Silent.number(), silent, "{k}");
        assert_eq!(answer.drive.mode == DriveMode::Degraded.number(), silent, "{k}");
        // The last command came in period 34 and is good for five more; this drive's emergency stop is at once.
        let at_rest = k >= 40 || asked.emergency_stop;
        assert_eq!(answer.sample.command == BodyTwist::ZERO, at_rest, "{k}");
    }
}

#[test]
fn a_drive_that_sees_nothing_any_more_says_that_it_stops() {
    let (drive, mut server) = (drive(), Server::new(7, 1000));
    ask_drive(&mut server, &drive, request(1, true));
    let silent = |k| Request {
        measured_rad_s: [f32::NAN; N],
        ..request(k, false)
    };
    let modes: std::vec::Vec<_> = (2..20)
        .map(|k| {
            let report = ask_drive(&mut server, &drive, silent(k)).drive;
            let stopped = report.mode == DriveMode::SafeStop.number();
            // Every wheel is silent by then; before the stop none is shorted.
            assert_eq!(server.brake(), [stopped; N], "{k}");
            (report.mode, report.motion_known)
        })
        .collect();
    // Silent from its third period without a reading; then 10 periods without a motion.
    let (normal, degraded, stopped) = (2, 10, 6);
    let expected = [
        std::vec![(DriveMode::Normal.number(), true); normal],
        std::vec![(DriveMode::Degraded.number(), false); degraded],
        std::vec![(DriveMode::SafeStop.number(), false); stopped],
    ];
    assert_eq!(modes, expected.concat());
    // A restart forgets it all.
    let again = ask_drive(&mut server, &drive, request(50, true)).drive;
    assert_eq!((again.mode, again.faults), (DriveMode::Normal.number(), [0; N]));
}
