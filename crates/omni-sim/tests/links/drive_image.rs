//! A drive at the other end of a link: in this process, and as the image of a scenario with a `[drive]`.

use std::cell::Cell;
use std::io::{PipeReader, PipeWriter, Read as _, Write as _, pipe};
use std::path::Path;
use std::thread;
use std::time::Duration;

use omni_core::drive::Fault;
use omni_core::{BodyTwist, DriveInput, DriveState};
use omni_link::{
    Action, Answer, Bodies, DriveReport, FromController, MAX_ANSWER_FRAME, MAX_REQUEST_FRAME,
    PROTOCOL_VERSION, Receiver, Request, Served, Server, ToController, answer_frame, decode, encode,
    request_with_bodies_frame,
};
use omni_sim::config::{Override, Scenario};
use omni_sim::controller::{AnyController, Firmware, Link, LinkCounters, emulator};
use omni_sim::{Error, Run, Trace, run};

const N: usize = 7;

/// The scenario of the image, with an encoder that falls silent and commands that stop on the way,
/// and an emergency stop that is pressed and released.
fn troubled() -> Scenario {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../firmware/scenarios/drive.toml");
    let faults = "fault=[{kind='encoder_silent',wheel='2',from_s=0.8,until_s=1.5},{kind='command_lost',from_s=1.8,until_s=2.6},\
                  {kind='emergency_stop',from_s=2.8,until_s=3.1}]";
    Scenario::load(&file.display().to_string(), &[Override::parse(faults).unwrap()]).unwrap()
}

/// The step under traction control, in a `[drive]`, in single precision.
fn climb() -> Scenario {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../firmware/scenarios/traction.toml");
    Scenario::load(&file.display().to_string(), &[]).unwrap()
}

/// Does a linked run of [`climb`] do what the host's does, in every bit? What traction control
/// alone reports is in no answer.
fn assert_it_climbs_as_the_host_does(linked: &Trace) {
    let host = run(&climb()).unwrap();
    assert!(host.outcome().climbed && linked.outcome().climbed);
    for name in linked.names() {
        if name == "drive_command_status" || name.starts_with("drive_std_") {
            continue;
        }
        let bits = |trace: &Trace| {
            trace
                .column(name)
                .unwrap()
                .iter()
                .map(|v| v.to_bits())
                .collect::<Vec<_>>()
        };
        assert!(bits(linked) == bits(&host), "{name} differs");
    }
    assert!(
        host.column("traction_loops").unwrap().contains(&1.0),
        "it is traction control that climbs"
    );
}

/// Is every column of an answer the host's, in every bit? Returns the modes that there were.
fn assert_the_hosts(scenario: &Scenario, linked: &Trace) -> [usize; 4] {
    let host = run(scenario).unwrap();
    assert_eq!(linked.names(), host.names());
    for name in host.names() {
        // Why the command is what it is, and how sure the pose is, are not in an answer.
        if name == "drive_command_status" || name.starts_with("drive_std_") {
            continue;
        }
        let bits =
            |trace: &Trace| -> Vec<u64> { trace.column(name).unwrap().iter().map(|v| v.to_bits()).collect() };
        assert!(bits(linked) == bits(&host), "{name} differs");
    }
    let mode = host.column("drive_mode").unwrap();
    std::array::from_fn(|k| mode.iter().filter(|mode| **mode == k as f64).count())
}

/// What is done to an answer.
type Lie = fn(&mut Answer<N>);

/// A drive that changes its answers from the hundredth on.
struct Liar<D, L> {
    drive: D,
    change: L,
}

impl<D: Served<N>, L: Fn(&mut Answer<N>)> Served<N> for Liar<D, L> {
    type State = D::State;

    fn start(&self) -> Self::State {
        self.drive.start()
    }

    fn step(&self, state: &mut Self::State, request: &Request<N>, bodies: &Bodies, answer: &mut Answer<N>) {
        self.drive.step(state, request, bodies, answer);
        if request.sequence > 100 {
            (self.change)(answer);
        }
    }
}

/// Serves the scenario's drive until no request comes any more. One answer is damaged on the way,
/// by its number, the greeting's being 0.
fn serve(
    from: PipeReader,
    to: PipeWriter,
    scenario: &Scenario,
    change: impl Fn(&mut Answer<N>),
    damaged: Option<usize>,
) {
    if let Some(drive) = scenario.traction_drive::<f32, N>().unwrap() {
        return answer_all(from, to, scenario, &Liar { drive, change }, damaged);
    }
    let drive = scenario.drive::<f32, N>().unwrap().expect("it has a [drive]");
    answer_all(from, to, scenario, &Liar { drive, change }, damaged);
}

fn answer_all(
    mut from: PipeReader,
    mut to: PipeWriter,
    scenario: &Scenario,
    served: &impl Served<N>,
    damaged: Option<usize>,
) {
    let mut server = Server::new(
        scenario.constants_digest().unwrap(),
        scenario.control.period_us as u32,
    );
    let mut receiver = Receiver::<{ request_with_bodies_frame(N) }>::new();
    let (mut out, mut byte, mut answers) = ([0; answer_frame(N)], [0], 0..);
    while from.read_exact(&mut byte).is_ok() {
        if let Some(frame) = receiver.push(byte[0]) {
            let mut answer = server.answer(served, frame, &mut out).to_vec();
            if answers.next() == damaged {
                answer[20] = if answer[20] == 1 { 2 } else { 1 }; // not 0, which ends a frame
            }
            if to.write_all(&answer).is_err() {
                return;
            }
        }
    }
}

/// The run of a scenario whose drive is served over a link.
fn run_linked(scenario: &Scenario, change: impl Fn(&mut Answer<N>) + Send + 'static) -> Result<Trace, Error> {
    run_with_damage(scenario, change, None).map(|(trace, _)| trace)
}

fn run_with_damage(
    scenario: &Scenario,
    change: impl Fn(&mut Answer<N>) + Send + 'static,
    damaged: Option<usize>,
) -> Result<(Trace, LinkCounters), Error> {
    let ((host_in, server_out), (server_in, host_out)) = (pipe().unwrap(), pipe().unwrap());
    let served = scenario.clone();
    thread::spawn(move || serve(server_in, server_out, &served, change, damaged));
    let link = Link::new("server", host_in, host_out, Duration::from_secs(5));
    let controller = AnyController::over_link(scenario, link)?;
    let mut counters = LinkCounters::default();
    let trace = Run::new(scenario).controller(controller).watch(|simulation, _| {
        counters = simulation.controller().link_counters().unwrap();
        Ok(())
    });
    let trace = trace.trace();
    trace.map(|trace| (trace, counters))
}

#[test]
fn a_drive_over_a_link_is_the_hosts_bit_for_bit_whatever_is_lost_or_stopped() {
    let scenario = troubled();
    let linked = run_linked(&scenario, |_| {}).unwrap();
    let modes = assert_the_hosts(&scenario, &linked);
    assert!(modes[0] > 2700 && modes[1] > 500, "{modes:?}"); // degraded while wheel 2 is faulty
    assert_eq!(modes[3], 300); // pressed for 0.3 s
}

#[test]
fn an_honest_drive_is_accepted_whatever_happens_to_its_vehicle() {
    let turning = "command={vx_m_s=0.2,vy_m_s=-0.1,wz_rad_s=1.5,ramp_s=0.3}"; // past half a turn, where the yaw jumps
    for (ground, keys, mode) in [
        ("flat", [turning, "sensors.encoder_counts=1000"], 0.0),
        (
            "flat",
            [
                turning,
                "fault=[{kind='encoder_stuck',wheel='1',from_s=0.1},{kind='wheel_lost',wheel='5',from_s=1.5}]",
            ],
            1.0,
        ),
        (
            "flat",
            [
                turning,
                "fault=[{kind='encoder_silent',wheel='1',from_s=1.0,until_s=1.5},{kind='encoder_silent',wheel='2',from_s=1.0},\
                 {kind='encoder_silent',wheel='4',from_s=1.0},{kind='encoder_silent',wheel='6',from_s=1.0},\
                 {kind='emergency_stop',from_s=1.8,until_s=2.0}]",
            ],
            2.0,
        ),
        (
            "step",
            ["control.policy=scale_references", "terrain.friction=0.3"],
            1.0,
        ),
    ] {
        let mut all = vec![
            "control.precision=f32",
            "control.policy=scale_references",
            "duration_s=3.0",
            "drive={slip={},faults={},noise={}}",
        ];
        all.extend(keys);
        let all: Vec<_> = all.into_iter().map(|key| Override::parse(key).unwrap()).collect();
        let scenario = Scenario::load(ground, &all).unwrap();
        let linked = run_linked(&scenario, |_| {}).unwrap();
        assert_the_hosts(&scenario, &linked);
        // The run has what it is here for.
        assert!(linked.column("drive_mode").unwrap().contains(&mode), "{keys:?}");
    }
}

/// No wheel is reported as accepted.
fn accepts_none(answer: &mut Answer<N>) {
    let wheels = &mut answer.sample.wheels;
    (wheels.active, wheels.applied.n_m, wheels.measured.rad_s) = ([false; N], [0.0; N], [0.0; N]);
    (answer.drive.faults, answer.drive.excluded) = ([Fault::Silent.number(); N], [true; N]);
    (answer.estimated, answer.drive.motion_known) = (BodyTwist::ZERO, false);
}

#[test]
fn a_drive_is_accepted_that_goes_on_with_a_reading_whose_answer_was_lost() {
    // From the 201st period on wheel 2 gives no reading: the drive goes on with the 200th, and in
    // one of these runs that answer is damaged.
    let keys = [
        "duration_s=0.3",
        "fault=[{kind='encoder_silent',wheel='2',from_s=0.2}]",
    ];
    let keys = keys.map(|key| Override::parse(key).unwrap());
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../firmware/scenarios/drive.toml");
    let scenario = Scenario::load(&file.display().to_string(), &keys).unwrap();
    for damaged in 197..204 {
        let (_, counters) = run_with_damage(&scenario, |_| {}, Some(damaged)).unwrap();
        assert_eq!(counters.answers.corrupted, 1, "{damaged}");
    }
}

#[test]
fn what_a_drive_cannot_say_stops_the_run() {
    let changes: [(Lie, &str); 15] = [
        (|answer| answer.drive.mode = 4, "allowed: 0 to 3"),
        (|answer| answer.drive.faults[3] = 6, "0 to 5"),
        (|answer| answer.drive.pose[1] = f32::NAN, "as a part of its pose"),
        (
            |answer| answer.sample.wheels.measured.rad_s[0] = 77.0,
            "(the value sent)",
        ),
        (|answer| answer.drive.faults[0] = 3, "which it reports as faulty"),
        // Each by itself is what a drive may say: it is the rest of the answer that it does not go with.
        (
            |answer| {
                answer.sample.wheels.applied.n_m[0] = 0.0;
                (answer.drive.faults[0], answer.drive.excluded[0]) = (3, true);
            },
            "fault 3 of wheel 1, which it still uses, allowed: 0",
        ),
        (
            |answer| answer.drive.mode = 3,
            "mode 3, allowed: 0 to 2, because no emergency stop is pressed",
        ),
        (
            |answer| answer.drive.mode = 1,
            "mode 1, allowed: 0 or 2, because no wheel is left out",
        ),
        (
            |answer| answer.drive.excluded[6] = true,
            "mode 0, allowed: 1 to 2, because a wheel is left out",
        ),
        (
            |answer| answer.drive.motion_known = false,
            "allowed: 0, because it reports an unknown motion",
        ),
        // It would short every motor of a vehicle that drives.
        (
            |answer| {
                accepts_none(answer);
                (answer.drive.mode, answer.drive.motion_known) = (2, true);
            },
            "mode 2, a safe stop, allowed: 0 to 1 while the motion is known",
        ),
        // A hundredth of the way of a period.
        (
            |answer| answer.drive.pose[0] += 0.01 * 1e-3 * answer.estimated.vx_m_s,
            "as x of its pose, allowed: 0.0",
        ),
        (
            |answer| answer.drive.pose = [f32::MAX; 3],
            "3.4028235e38 as x of its pose",
        ),
        (|answer| answer.drive.pose[2] += 0.001, "as yaw of its pose"),
        (
            |answer| answer.drive = DriveReport::of_loops(),
            "0.0 as x of its pose",
        ),
    ];
    for (change, said) in changes {
        let error = run_linked(&troubled(), change).unwrap_err().to_string();
        assert!(error.contains(said), "{error}");
        assert!(
            error.chars().count() <= 300 && error.lines().count() == 1,
            "{error}"
        );
        assert!(error.contains("stopped at t = 0.100 s"), "{error}"); // the first altered period
    }
}

#[test]
fn a_drive_cannot_take_back_what_it_said_of_a_stop() {
    // For a period it accepts no wheel and calls that a safe stop, which by itself may be so; then it drives on.
    let pose = Cell::new([0.0; 3]);
    let takes_back = move |answer: &mut Answer<N>| {
        if answer.sequence == 102 {
            accepts_none(answer);
            (answer.drive.mode, answer.drive.pose) = (2, pose.get());
        }
        pose.set(answer.drive.pose);
    };
    let error = run_linked(&troubled(), takes_back).unwrap_err().to_string();
    assert!(
        error.contains("mode 0 after a safe stop, allowed: 2 to 3, because nothing ended the stop"),
        "{error}"
    );
}

#[test]
fn a_drive_cannot_pass_over_an_emergency_stop() {
    let pressed = "fault=[{kind='emergency_stop',from_s=0.15,until_s=0.2}]";
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../firmware/scenarios/drive.toml");
    let scenario = Scenario::load(&file.display().to_string(), &[Override::parse(pressed).unwrap()]).unwrap();
    let deaf: Lie = |answer| {
        if answer.drive.mode == 3 {
            answer.drive.mode = 0;
        }
    };
    let error = run_linked(&scenario, deaf).unwrap_err().to_string();
    assert!(
        error.contains("mode 0, allowed: 3, because the emergency stop is pressed"),
        "{error}"
    );
}

#[test]
fn a_climb_under_traction_control_over_a_link_is_the_hosts_bit_for_bit() {
    assert_it_climbs_as_the_host_does(&run_linked(&climb(), |_| {}).unwrap());
}

#[test]
#[ignore = "needs QEMU and the image of firmware/; make firmware runs it"]
fn a_climb_under_traction_control_in_the_image_is_the_hosts_bit_for_bit() {
    let scenario = climb();
    let image = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../firmware/target/traction_loop");
    let controller = AnyController::in_qemu(&scenario, &Firmware::new(image)).unwrap();
    let linked = Run::new(&scenario).controller(controller).trace().unwrap();
    assert_it_climbs_as_the_host_does(&linked);
}

#[test]
#[ignore = "needs QEMU and the image of firmware/; make firmware runs it"]
fn a_run_with_the_image_of_a_drive_is_the_hosts_bit_for_bit() {
    let scenario = troubled();
    let image = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../firmware/target/drive_loop");
    let controller = AnyController::in_qemu(&scenario, &Firmware::new(image)).unwrap();
    let linked = Run::new(&scenario).controller(controller).trace().unwrap();
    assert_the_hosts(&scenario, &linked);
}

#[test]
#[ignore = "needs QEMU and the image of firmware/; make firmware runs it"]
fn every_signal_that_the_image_of_a_drive_answers_is_the_hosts_bit_for_bit() {
    let firmware = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../firmware");
    let scenario = firmware.join("scenarios/drive.toml");
    let scenario = Scenario::load(&scenario.display().to_string(), &[]).unwrap();
    let drive = scenario.drive::<f32, N>().unwrap().expect("it has a [drive]");
    let mut state = DriveState::new(&drive);
    let mut processor = emulator(&firmware.join("target/drive_loop")).spawn().unwrap();
    let (mut to, mut from) = (processor.stdin.take().unwrap(), processor.stdout.take().unwrap());
    let mut receiver = Receiver::<MAX_ANSWER_FRAME>::new();
    let mut ask = |message: ToController<N>| -> FromController<Answer<N>> {
        let mut out = [0; MAX_REQUEST_FRAME];
        to.write_all(encode(&message, &mut out).unwrap()).unwrap();
        let mut byte = [0];
        loop {
            from.read_exact(&mut byte).unwrap();
            if let Some(frame) = receiver.push(byte[0]) {
                return decode(frame).unwrap();
            }
        }
    };

    let FromController::Greeting(greeting) = ask(ToController::Hello) else {
        panic!("no greeting");
    };
    let digest = scenario.constants_digest().unwrap();
    assert_eq!((greeting.version, greeting.digest), (PROTOCOL_VERSION, digest));

    let (mut wheels, mut modes) = ([0.0_f32; N], [0; 4]);
    for k in 1..=3000 {
        let mut asked = Request {
            sequence: k,
            restart: k == 1,
            emergency_stop: (1600..1700).contains(&k),
            command: BodyTwist::from_array([0.3, 0.1, 0.2]),
            measured_rad_s: wheels,
        };
        // A command is NaN, and so is a reading, where none arrived: one encoder is silent for a while, later all are.
        if k % 20 != 1 || (1000..1500).contains(&k) {
            asked.command = BodyTwist::from_array([f32::NAN; 3]);
        }
        if (500..600).contains(&k) {
            asked.measured_rad_s[4] = f32::NAN;
        }
        if (2500..2600).contains(&k) {
            asked.measured_rad_s = [f32::NAN; N];
        }
        let FromController::Answer(answer) = ask(ToController::Request(asked)) else {
            panic!("no answer to {k}");
        };
        let mut input = DriveInput::received(&asked.measured_rad_s.into());
        input.emergency = asked.emergency_stop;
        input.command = Some(asked.command).filter(|command| !command.vx_m_s.is_nan());
        let sample = drive.step(&mut state, &input);
        assert_eq!((answer.sequence, answer.action), (k, Action::Step));
        assert_eq!(answer.sample.command, sample.shaped.twist, "{k}");
        assert_eq!(answer.sample.wheels, sample.wheels, "{k}");
        assert_eq!(answer.estimated, sample.slip.estimated, "{k}");
        assert_eq!(answer.residual, sample.slip.residual, "{k}");
        let report = DriveReport {
            mode: sample.mode.number(),
            faults: sample.faults.map(|fault| fault.map_or(0, Fault::number)),
            motion_known: sample.motion_known,
            excluded: sample.slip.excluded,
            pose: [sample.pose.x_m, sample.pose.y_m, sample.pose.yaw_rad],
        };
        assert_eq!(answer.drive, report, "{k}");
        modes[usize::from(answer.drive.mode)] += 1;
        // Wheels take 20 ms to follow; a released one rolls on.
        for (i, wheel) in wheels.iter_mut().enumerate() {
            if sample.wheels.active[i] {
                *wheel += 0.05 * (sample.wheels.reference.rad_s[i] - *wheel);
            }
        }
    }
    // Normal for most of the time, degraded while wheel 5 is faulty, a safe stop from shortly after 2500 on.
    assert!(
        modes[0] > 2000 && modes[1] > 80 && modes[2] > 400 && modes[3] == 100,
        "{modes:?}"
    );
    drop(to); // the end of its input is the end of it
    assert!(processor.wait().unwrap().success());
}
