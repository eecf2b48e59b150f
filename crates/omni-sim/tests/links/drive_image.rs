//! The image of a scenario with a `[drive]`: its answers are the drive's own steps.

use std::io::{Read as _, Write as _};
use std::path::Path;

use omni_core::{BodyTwist, DriveInput, DriveState, Fault};
use omni_link::{
    Action, Answer, DriveReport, FromController, MAX_ANSWER_FRAME, MAX_REQUEST_FRAME, PROTOCOL_VERSION,
    Receiver, Request, ToController, decode, encode,
};
use omni_sim::config::Scenario;
use omni_sim::controller::emulator;

const N: usize = 7;

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
