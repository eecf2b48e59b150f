//! Started as `qemu-system-arm`: a firmware of the scenario `flat`, with the `[drive]` of the
//! environment's `OMNISTEP_DRIVE` where it has one, that answers falsely as `OMNISTEP_LIE` says.

use std::io::{Read as _, Write as _};

use omni_core::drive::Fault;
use omni_core::{BodyTwist, DriveMode};
use omni_link::{
    Action, Answer, DriveReport, FromController, Greeting, Loops, MAX_ANSWER_FRAME, MAX_REQUEST_FRAME,
    PROTOCOL_VERSION, Receiver, Served, Server, ToController, decode, encode,
};
use omni_sim::config::{Override, Scenario};

/// Wheels of `chugo7`.
const N: usize = 7;
/// The first altered answer.
const FIRST_ALTERED: u32 = 10;

/// Serves standard input and output until the host closes them, with false answers.
pub(crate) fn serve(kind: &str) {
    let table = std::env::var("OMNISTEP_DRIVE").ok();
    let keys = table.map(|table| Override::parse(&format!("drive={table}")).unwrap());
    let scenario = Scenario::load("flat", keys.as_slice()).unwrap();
    match scenario.drive::<f32, N>().unwrap() {
        Some(drive) => converse(kind, &scenario, &drive),
        None => {
            let controller = scenario.controller::<f32, N>().unwrap();
            let limiter = scenario.limiter::<f32>().unwrap();
            let loops = Loops {
                controller: &controller,
                limiter: &limiter,
            };
            converse(kind, &scenario, &loops);
        }
    }
}

fn converse(kind: &str, scenario: &Scenario, served: &impl Served<N>) {
    let period_us = scenario.control.period_us as u32;
    let digest = scenario.constants_digest().unwrap();
    let mut server = Server::new(digest, period_us);
    let greeting = Greeting {
        version: PROTOCOL_VERSION,
        wheels: N as u32,
        period_us,
        digest,
    };
    let mut receiver = Receiver::<MAX_REQUEST_FRAME>::new();
    let (mut byte, mut answers, mut first) = ([0], 0, None);
    // The host kills it: that it cannot be written to any more is the end.
    while std::io::stdin().read_exact(&mut byte).is_ok() {
        let Some(frame) = receiver.push(byte[0]) else {
            continue;
        };
        let said = match decode::<ToController<N>>(&mut frame.to_vec()) {
            Ok(ToController::Hello) => greet(kind, greeting),
            _ => {
                let mut out = [0; MAX_ANSWER_FRAME];
                let length = server.answer(served, frame, &mut out).len();
                let answer = decode(&mut out[..length]).expect("the server's own answer");
                answers += 1;
                let FromController::Answer(answer) = answer else {
                    continue;
                };
                reply(kind, answer, *first.get_or_insert(answer), answers)
            }
        };
        let Some((said, times)) = said else { return };
        for _ in 0..times {
            let mut out = std::io::stdout().lock();
            if out.write_all(&said).and_then(|()| out.flush()).is_err() {
                return;
            }
        }
    }
}

/// Bytes, and how many times.
type Said = Option<(Vec<u8>, usize)>;

fn greet(kind: &str, mut greeting: Greeting) -> Said {
    match kind {
        "silent" => return Some((Vec::new(), 0)),
        "garbage" => return Some((b"Guru Meditation Error\0\x07\xff\x1b[2J\0".repeat(10), 1)),
        "endless_garbage" => return Some((b"\x55\xaa\xff\0".repeat(1000), usize::MAX)),
        "endless_frame" => return Some((vec![0x55; 4096], usize::MAX)),
        "dies_at_once" => return None,
        "wrong_version" => greeting.version = u32::MAX,
        "wrong_wheels" => greeting.wheels = u32::MAX,
        "wrong_digest" => greeting.digest ^= 1,
        _ => {}
    }
    Some((framed(&FromController::Greeting(greeting)), 1))
}

/// The answer, altered.
fn reply(kind: &str, mut answer: Answer<N>, first: Answer<N>, answers: u32) -> Said {
    if answers < FIRST_ALTERED {
        return Some((framed(&FromController::Answer(answer)), 1));
    }
    let torques = &mut answer.sample.wheels.applied.n_m;
    let mut times = 1;
    match kind {
        "torque_1000" => *torques = [1000.0; N],
        "torque_nan" => *torques = [f32::NAN; N],
        "torque_inf" => *torques = [f32::NEG_INFINITY; N],
        "estimate_nan" => answer.estimated.vx_m_s = f32::NAN,
        "stop_with_torque" => {
            *torques = [2.0; N];
            answer.action = Action::Stop;
        }
        "stale" => answer = first,
        "future" => answer.sequence = answer.sequence.wrapping_add(1 << 20),
        "flood_late" => (answer, times) = (first, usize::MAX),
        "flood_greetings" => {
            let greeting = Greeting {
                version: PROTOCOL_VERSION,
                wheels: 7,
                period_us: 1000,
                digest: 0,
            };
            return Some((framed(&FromController::Greeting(greeting)), usize::MAX));
        }
        "garbage_later" => return Some((b"Guru Meditation Error\0\x07\xff\x1b[2J\0".to_vec(), 1)),
        "silent_later" => return Some((Vec::new(), 0)),
        "dies_later" => return None,
        "drive_more_wheels" => return Some((of_wheels::<8>(&answer), 1)),
        "drive_fewer_wheels" => return Some((of_wheels::<6>(&answer), 1)),
        kind => of_a_drive(kind, &mut answer, answers - FIRST_ALTERED),
    }
    Some((framed(&FromController::Answer(answer)), times))
}

/// What a drive reports beside the wheels' signals; this is the `kth` altered answer.
fn of_a_drive(kind: &str, answer: &mut Answer<N>, kth: u32) {
    let Answer {
        drive,
        sample,
        estimated,
        ..
    } = answer;
    let silent = Fault::Silent.number();
    // All that follows from no wheel being accepted.
    let mut accept_none = |drive: &mut DriveReport<N>| {
        let wheels = &mut sample.wheels;
        (drive.faults, drive.excluded, drive.motion_known) = ([silent; N], [true; N], false);
        (wheels.active, wheels.applied.n_m, wheels.measured.rad_s) = ([false; N], [0.0; N], [0.0; N]);
        *estimated = BodyTwist::ZERO;
        drive.pose = [0.0; 3];
    };
    match kind {
        "drive_mode_4" => drive.mode = 4,
        "drive_mode_255" => drive.mode = u8::MAX,
        "drive_degraded" => drive.mode = DriveMode::Degraded.number(),
        "drive_safe_stop" => drive.mode = DriveMode::SafeStop.number(),
        "drive_emergency_stop" => drive.mode = DriveMode::EmergencyStop.number(),
        "drive_shorts_motors" => {
            accept_none(drive);
            (drive.mode, drive.motion_known) = (DriveMode::SafeStop.number(), true);
        }
        "drive_shorts_motors_in_an_emergency" => {
            accept_none(drive);
            drive.mode = DriveMode::EmergencyStop.number();
        }
        // Nothing is wrong with the first of these by itself.
        "drive_leaves_a_safe_stop" if kth == 0 => {
            accept_none(drive);
            drive.mode = DriveMode::SafeStop.number();
        }
        "drive_normal_without_wheels" => accept_none(drive),
        "drive_normal_without_a_wheel" => drive.excluded[2] = true,
        "drive_fault_6" => drive.faults[3] = 6,
        "drive_fault_255" => drive.faults = [u8::MAX; N],
        "drive_fault_of_a_driven_wheel" => drive.faults[0] = silent,
        "drive_fault_of_an_active_wheel" => {
            (drive.faults[0], drive.excluded[0], sample.wheels.applied.n_m[0]) = (silent, true, 0.0);
            drive.mode = DriveMode::Degraded.number();
        }
        "drive_motion_unknown" => drive.motion_known = false,
        "drive_pose_nan" => drive.pose[1] = f32::NAN,
        "drive_pose_inf" => drive.pose[2] = f32::NEG_INFINITY,
        "drive_pose_far" => drive.pose = [f32::MAX, f32::MIN, f32::MAX],
        "drive_pose_jumps" => drive.pose[0] += 0.5,
        "drive_pose_turned" => drive.pose[2] += 3.0,
        "drive_pose_stands" => drive.pose = [0.0; 3],
        "drive_of_loops" => *drive = DriveReport::of_loops(),
        _ => {}
    }
}

/// The answer of a vehicle of so many wheels.
fn of_wheels<const M: usize>(answer: &Answer<N>) -> Vec<u8> {
    let answer = Answer::<M> {
        sequence: answer.sequence,
        action: answer.action,
        ..Answer::stopped()
    };
    let mut out = [0; MAX_ANSWER_FRAME];
    encode(&FromController::Answer(answer), &mut out)
        .unwrap_or_default()
        .to_vec()
}

fn framed(message: &FromController<Answer<N>>) -> Vec<u8> {
    let mut out = [0; MAX_ANSWER_FRAME];
    encode(message, &mut out).unwrap_or_default().to_vec()
}
