//! Started as `qemu-system-arm`: a firmware of the scenario `flat` that lies as the environment's `OMNISTEP_LIE` says.

use std::io::{Read as _, Write as _};

use omni_link::{
    Action, Answer, FromController, Greeting, Loops, MAX_ANSWER_FRAME, MAX_REQUEST_FRAME, PROTOCOL_VERSION,
    Receiver, Server, ToController, decode, encode,
};
use omni_sim::config::Scenario;

/// Wheels of `chugo7`.
const N: usize = 7;

/// Serves standard input and output until the host closes them, and lies.
pub(crate) fn serve(lie: &str) {
    let scenario = Scenario::load("flat", &[]).unwrap();
    let controller = scenario.controller::<f32, N>().unwrap();
    let limiter = scenario.limiter::<f32>().unwrap();
    let period_us = scenario.control.period_us as u32;
    let digest = scenario.constants_digest().unwrap();
    let loops = Loops {
        controller: &controller,
        limiter: &limiter,
    };
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
            Ok(ToController::Hello) => greet(lie, greeting),
            _ => {
                let mut out = [0; MAX_ANSWER_FRAME];
                let length = server.answer(&loops, frame, &mut out).len();
                let answer = decode(&mut out[..length]).expect("the server's own answer");
                answers += 1;
                let FromController::Answer(answer) = answer else {
                    continue;
                };
                reply(lie, answer, *first.get_or_insert(answer), answers)
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

fn greet(lie: &str, mut greeting: Greeting) -> Said {
    match lie {
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

/// The answer as the lie has it; the tenth is the first that lies.
fn reply(lie: &str, mut answer: Answer<N>, first: Answer<N>, answers: usize) -> Said {
    if answers < 10 {
        return Some((framed(&FromController::Answer(answer)), 1));
    }
    let torques = &mut answer.sample.wheels.applied.n_m;
    let mut times = 1;
    match lie {
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
        _ => {}
    }
    Some((framed(&FromController::Answer(answer)), times))
}

fn framed(message: &FromController<Answer<N>>) -> Vec<u8> {
    let mut out = [0; MAX_ANSWER_FRAME];
    encode(message, &mut out).unwrap_or_default().to_vec()
}
