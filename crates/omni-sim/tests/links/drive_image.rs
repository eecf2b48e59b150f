//! A drive at the other end of a link: in this process, and as the image of a scenario with a `[drive]`.

use std::io::{PipeReader, PipeWriter, Read as _, Write as _, pipe};
use std::path::Path;
use std::thread;
use std::time::Duration;

use omni_core::{BodyTwist, Drive, DriveInput, DriveState, Fault};
use omni_link::{
    Action, Answer, DriveReport, FromController, MAX_ANSWER_FRAME, MAX_REQUEST_FRAME, PROTOCOL_VERSION,
    Receiver, Request, Served, Server, ToController, answer_frame, decode, encode, request_frame,
};
use omni_sim::config::{Override, Scenario};
use omni_sim::controller::{AnyController, Firmware, Link, emulator};
use omni_sim::{Error, Trace, run, run_with_controller};

const N: usize = 7;

/// The scenario of the image, with an encoder that falls silent and commands that stop on the way.
fn troubled() -> Scenario {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../firmware/scenarios/drive.toml");
    let faults = "fault=[{kind='encoder_silent',wheel='2',from_s=0.8,until_s=1.5},{kind='command_lost',from_s=1.8,until_s=2.6}]";
    Scenario::load(&file.display().to_string(), &[Override::parse(faults).unwrap()]).unwrap()
}

/// Is every column that an answer tells the host's, in every bit? Returns the modes that there were.
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
struct Liar {
    drive: Drive<f32, N>,
    lie: Lie,
}

impl Served<N> for Liar {
    type State = DriveState<f32, N>;

    fn start(&self) -> Self::State {
        self.drive.start()
    }

    fn step(&self, state: &mut Self::State, request: &Request<N>, answer: &mut Answer<N>) {
        Served::step(&self.drive, state, request, answer);
        if request.sequence > 100 {
            (self.lie)(answer);
        }
    }
}

/// Serves the scenario's drive until nobody asks any more.
fn serve(from: PipeReader, to: PipeWriter, scenario: &Scenario, lie: Lie) {
    let drive = scenario.drive::<f32, N>().unwrap().expect("it has a [drive]");
    let served = Liar { drive, lie };
    let (mut from, mut to) = (from, to);
    let mut server = Server::new(
        scenario.constants_digest().unwrap(),
        scenario.control.period_us as u32,
    );
    let mut receiver = Receiver::<{ request_frame(N) }>::new();
    let (mut out, mut byte) = ([0; answer_frame(N)], [0]);
    while from.read_exact(&mut byte).is_ok() {
        if let Some(frame) = receiver.push(byte[0])
            && to.write_all(server.answer(&served, frame, &mut out)).is_err()
        {
            return;
        }
    }
}

/// The run of a scenario whose drive is served over a link.
fn run_linked(scenario: &Scenario, lie: Lie) -> Result<Trace, Error> {
    let ((host_in, server_out), (server_in, host_out)) = (pipe().unwrap(), pipe().unwrap());
    let served = scenario.clone();
    thread::spawn(move || serve(server_in, server_out, &served, lie));
    let link = Link::new("server", host_in, host_out, Duration::from_secs(5));
    let controller = AnyController::over_link(scenario, link)?;
    run_with_controller(scenario, controller, |_, _| Ok(()))
}

#[test]
fn a_run_with_a_drive_over_a_link_is_the_hosts_bit_for_bit_while_readings_and_commands_are_lost() {
    let scenario = troubled();
    let linked = run_linked(&scenario, |_| {}).unwrap();
    let modes = assert_the_hosts(&scenario, &linked);
    assert!(modes[0] > 3000 && modes[1] > 500, "{modes:?}"); // degraded while wheel 2 is not believed
}

#[test]
fn what_a_drive_cannot_say_stops_the_run() {
    let lies: [(Lie, &str); 5] = [
        (|answer| answer.drive.mode = 4, "allowed: 0 to 3"),
        (|answer| answer.drive.faults[3] = 6, "0 to 5"),
        (|answer| answer.drive.pose[1] = f32::NAN, "as a part of its pose"),
        (
            |answer| answer.sample.wheels.measured.rad_s[0] = 77.0,
            "which was sent",
        ),
        (
            |answer| answer.drive.faults[0] = 3,
            "which it says it does not believe",
        ),
    ];
    for (lie, said) in lies {
        let error = run_linked(&troubled(), lie).unwrap_err().to_string();
        assert!(error.contains(said), "{error}");
    }
}

#[test]
fn an_emergency_stop_that_a_link_cannot_tell_of_is_refused() {
    let pressed = Override::parse("fault=[{kind='emergency_stop',from_s=1.0}]").unwrap();
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../firmware/scenarios/drive.toml");
    let scenario = Scenario::load(&file.display().to_string(), &[pressed]).unwrap();
    let error = run_linked(&scenario, |_| {}).unwrap_err().to_string();
    assert!(
        error.contains("fault[0].kind: \"emergency_stop\", allowed: not with a controller"),
        "{error}"
    );
}

#[test]
#[ignore = "needs QEMU and the image of firmware/; make firmware runs it"]
fn a_run_with_the_image_of_a_drive_is_the_hosts_bit_for_bit() {
    let scenario = troubled();
    let image = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../firmware/target/drive_loop");
    let controller = AnyController::in_qemu(&scenario, &Firmware::new(image)).unwrap();
    let linked = run_with_controller::<Error>(&scenario, controller, |_, _| Ok(())).unwrap();
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
        let mut input = DriveInput::measured(&asked.measured_rad_s.into());
        input.readings_rad_s = asked.measured_rad_s.map(|v| (!v.is_nan()).then_some(v));
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
        // Wheels take 20 ms to follow; one that is let go rolls on.
        for (i, wheel) in wheels.iter_mut().enumerate() {
            if sample.wheels.active[i] {
                *wheel += 0.05 * (sample.wheels.reference.rad_s[i] - *wheel);
            }
        }
    }
    // Normal for most of the time, degraded while wheel 5 is not believed, a safe stop from shortly after 2500 on; nobody asked for an
    // emergency stop.
    assert!(
        modes[0] > 2000 && modes[1] > 80 && modes[2] > 400 && modes[3] == 0,
        "{modes:?}"
    );
    drop(to); // the end of its input is the end of it
    assert!(processor.wait().unwrap().success());
}
