//! Controllers behind a link that answer falsely, chatter or are something else: the host stops and says so in a line.

use std::io::{PipeReader, PipeWriter, Read, Write, pipe};
use std::sync::mpsc;
use std::thread;
use std::time::Duration;

use omni_link::{
    Answer, FromController, Loops, MAX_ANSWER_FRAME, Receiver, Server, answer_frame, decode, encode,
    request_frame,
};
use omni_sim::config::{Override, Scenario};
use omni_sim::controller::{AnyController, Link};
use omni_sim::{Error, Simulation};

const N: usize = 7;
/// The first period, counted from 1, with an altered answer.
const ALTERED_FROM: u32 = 30;

type Said = FromController<Answer<N>>;

fn scenario(more: &[Override]) -> Scenario {
    of("flat", more)
}

fn of(name: &str, more: &[Override]) -> Scenario {
    let mut all = vec![
        Override::new("duration_s", 3.0),
        Override::new("control.precision", "f32"),
        Override::new("control.policy", "scale_references"),
    ];
    all.extend_from_slice(more);
    Scenario::load(name, &all).unwrap()
}

fn frame(message: &Said) -> Vec<u8> {
    encode(message, &mut [0; MAX_ANSWER_FRAME]).unwrap().to_vec()
}

/// A link to a peer that does as `act` says with what comes and goes.
fn peer(time_out: Duration, act: impl FnOnce(PipeReader, PipeWriter) + Send + 'static) -> Link {
    let (host_in, peer_out) = pipe().unwrap();
    let (peer_in, host_out) = pipe().unwrap();
    thread::spawn(move || act(peer_in, peer_out));
    Link::new("firmware", host_in, host_out, time_out)
}

/// A link to the scenario's controller, whose answers `change` alters before they are sent.
fn altered_link(scenario: &Scenario, mut change: impl FnMut(Said, &mut PipeWriter) + Send + 'static) -> Link {
    let (controller, limiter) = (
        scenario.controller::<f32, N>().unwrap(),
        scenario.limiter().unwrap(),
    );
    let mut server = Server::new(
        scenario.constants_digest().unwrap(),
        scenario.control.period_us as u32,
    );
    // Long: only what is never answered takes it.
    peer(Duration::from_secs(5), move |mut from, mut to| {
        let loops = Loops {
            controller: &controller,
            limiter: &limiter,
        };
        let mut receiver = Receiver::<{ request_frame(N) }>::new();
        let (mut out, mut byte) = ([0; answer_frame(N)], [0]);
        while from.read_exact(&mut byte).is_ok() {
            if let Some(received) = receiver.push(byte[0]) {
                server.answer(&loops, received, &mut out);
                change(decode(&mut out).unwrap(), &mut to);
            }
        }
    })
}

/// The same, of answers only, from [`ALTERED_FROM`] on.
fn answers(scenario: &Scenario, mut change: impl FnMut(&mut Answer<N>) + Send + 'static) -> Link {
    altered_link(scenario, move |mut said, to| {
        if let FromController::Answer(answer) = &mut said
            && answer.sequence >= ALTERED_FROM
        {
            change(answer);
        }
        let _ = to.write_all(&frame(&said)); // the host may have closed it
    })
}

/// The same, of their torques.
fn torques(scenario: &Scenario, mut change: impl FnMut(&mut [f32; N]) + Send + 'static) -> Link {
    answers(scenario, move |answer| {
        change(&mut answer.sample.wheels.applied.n_m)
    })
}

/// Runs until an error, which comes within a minute whatever the other end does; then nothing turns the wheels.
fn ended(scenario: Scenario, link: Link) -> (Error, u64) {
    let (sender, receiver) = mpsc::channel();
    thread::spawn(move || {
        let controller = match AnyController::over_link(&scenario, link) {
            Ok(controller) => controller,
            Err(error) => return sender.send((error, 0)).unwrap(),
        };
        let mut simulation = Simulation::with_controller(&scenario, controller).unwrap();
        let mut periods = 0;
        while periods < 3000 {
            if let Err(error) = simulation.step(&scenario.command.at(periods as f64 * 1e-3)) {
                assert!(simulation.sample().wheels.iter().all(|w| w.applied_n_m == 0.0));
                return sender.send((error, periods)).unwrap();
            }
            periods += 1;
        }
    });
    receiver
        .recv_timeout(Duration::from_secs(60))
        .expect("an error within a minute")
}

/// The one line, which blames the firmware's run, not the request and not the physics.
fn line(error: &Error) -> String {
    let line = error.to_string();
    assert!(
        !error.is_bad_input() && matches!(error, Error::Link { .. }),
        "{line}"
    );
    assert!(!line.contains("diverged") && line.lines().count() == 1, "{line}");
    assert!(line.chars().count() <= 300, "{line}");
    line
}

#[test]
fn a_torque_that_no_motor_gives_stops_the_run_and_is_said_to_be_the_firmwares() {
    for (change, shown) in [
        (1000.0_f32, "1000"),
        (-1000.0, "-1000"),
        (2.001, "2.001"),
        (f32::NAN, "NaN"),
        (f32::INFINITY, "inf"),
        (f32::NEG_INFINITY, "-inf"),
    ] {
        let scenario = scenario(&[]);
        let link = torques(&scenario, move |n_m| n_m[4] = change);
        let (error, periods) = ended(scenario, link);
        assert_eq!(periods, u64::from(ALTERED_FROM) - 1, "not one period of it");
        let said = line(&error);
        let expected = format!(
            "the link to the controller stopped at t = 0.029 s: the firmware answers {shown} N.m for wheel 5, allowed: -2 to 2, \
             the range of its motor at "
        );
        assert!(said.starts_with(&expected), "{said}");
    }
}

#[test]
fn torques_ten_or_a_thousand_times_too_large_are_noticed_beyond_the_motors() {
    // Over a step a fifth of a motor's torque is asked for, mN.m taken for N.m show at once.
    for (times, ground, latest) in [(10.0, "step", 3000), (1000.0, "flat", 29)] {
        let scenario = of(ground, &[]);
        let link = torques(&scenario, move |n_m| *n_m = n_m.map(|torque| times * torque));
        let (error, periods) = ended(scenario, link);
        assert!(line(&error).contains("the firmware answers"), "{error}");
        assert!(periods <= latest, "{ground}: {periods}");
    }
}

/// One signal of an answer, changed.
type Change = fn(&mut Answer<N>);

#[test]
fn signals_that_no_controller_has_stop_the_run_before_they_are_logged() {
    let changes: [(Change, &str); 6] = [
        (|a| a.estimated.vx_m_s = f32::NAN, "NaN as a twist"),
        (
            |a| a.residual.rad_s[2] = f32::INFINITY,
            "inf as residual of wheel 3",
        ),
        (
            |a| a.sample.wheels.i_n_m[0] = f32::NAN,
            "NaN as integral term of wheel 1",
        ),
        (
            |a| a.sample.wheels.measured.rad_s[6] += 1.0,
            "as measured velocity of wheel 7",
        ),
        // The command is a ramp: 0.029 m/s by then. Else it could run away unnoticed.
        (
            |a| a.sample.command.vx_m_s = 10.0,
            "10 as part of its command, allowed: -0.029",
        ),
        (
            |a| a.sample.wheels.common_factor = f32::NAN,
            "NaN as a twist or common factor",
        ),
    ];
    for (change, expected) in changes {
        let scenario = scenario(&[]);
        let link = answers(&scenario, change);
        let (error, periods) = ended(scenario, link);
        assert!(line(&error).contains(expected), "{error}");
        assert_eq!(periods, u64::from(ALTERED_FROM) - 1);
    }
}

#[test]
fn the_range_is_that_of_the_motor_at_the_velocity_that_was_sent() {
    // 2 N.m at rest, 0.2 less for each rad/s: at the 4.5 rad/s of 0.3 m/s the motor drives with 1.1
    // N.m and brakes with 2.
    let falling = [Override::new("vehicle.motor.slope_n_m_s_rad", 0.2)];
    let late = |answer: &Answer<N>| answer.sequence == 2000;
    for (sign, refused) in [(1.0, true), (-1.0, false)] {
        let scenario = scenario(&falling);
        let link = altered_link(&scenario, move |mut said, to| {
            if let FromController::Answer(answer) = &mut said
                && late(answer)
            {
                let wheels = &mut answer.sample.wheels;
                assert!((4.0..5.0).contains(&wheels.measured.rad_s[3]));
                wheels.applied.n_m[3] = sign * 1.9;
            }
            if let FromController::Answer(answer) = &mut said
                && answer.sequence == 2001
            {
                answer.sample.wheels.applied.n_m[0] = f32::NAN; // here it ends at the latest
            }
            let _ = to.write_all(&frame(&said));
        });
        let (error, periods) = ended(scenario, link);
        let said = line(&error);
        assert_eq!(
            said.contains("answers 1.9 N.m for wheel 4, allowed: -2 to 1."),
            refused,
            "{said}"
        );
        assert_eq!(periods == 1999, refused, "{periods}");
    }
}

#[test]
fn a_peer_that_repeats_itself_for_ever_is_given_up() {
    for begin in [ALTERED_FROM, 0] {
        let scenario = scenario(&[]);
        let link = altered_link(&scenario, move |said, to| {
            let (flood, own) = match &said {
                // In the middle of a run; of what was said before the run began, in place of the greeting.
                FromController::Answer(answer) if answer.sequence >= ALTERED_FROM => (
                    FromController::Answer(Answer {
                        sequence: 1,
                        ..*answer
                    }),
                    false,
                ),
                FromController::Greeting(_) if begin == 0 => {
                    (FromController::Answer(Answer::stopped()), false)
                }
                _ => (said, true),
            };
            let bytes = frame(&flood);
            while to.write_all(&bytes).is_ok() && !own {}
        });
        let (error, _) = ended(scenario, link);
        assert!(
            error
                .to_string()
                .contains("the firmware sent more than 100 messages that answer no request"),
            "{error}"
        );
    }
}

#[test]
fn a_peer_that_greets_for_ever_is_given_up() {
    let scenario = scenario(&[]);
    let link = altered_link(&scenario, |said, to| {
        let bytes = frame(&said);
        while to.write_all(&bytes).is_ok() && matches!(said, FromController::Greeting(_)) {}
    });
    let (error, periods) = ended(scenario, link);
    assert!(
        line(&error).contains("messages that answer no request"),
        "{error}"
    );
    assert_eq!(periods, 0);
}

#[test]
fn a_peer_that_never_reads_does_not_stop_the_host() {
    let scenario = scenario(&[]);
    let greeting = omni_link::Greeting {
        version: omni_link::PROTOCOL_VERSION,
        wheels: N as u32,
        period_us: 1000,
        digest: scenario.constants_digest().unwrap(),
    };
    let link = peer(Duration::from_secs(5), move |unread, mut to| {
        to.write_all(&frame(&FromController::Greeting(greeting))).unwrap();
        for sequence in 1.. {
            let mut answer = Answer::stopped();
            (answer.sequence, answer.action) = (sequence, omni_link::Action::Step);
            if to.write_all(&frame(&FromController::Answer(answer))).is_err() {
                break;
            }
        }
        drop(unread);
    });
    let (error, _) = ended(scenario, link);
    assert!(
        line(&error).contains("the firmware does not read the messages sent to it"),
        "{error}"
    );
}

#[test]
fn what_is_no_message_is_called_so_where_a_greeting_is_waited_for() {
    for (garbage, first) in [
        (b"Hello, world!\n".to_vec(), "Hello, world!\\n"),
        (b"\x7fELF\0\x01\x02\0".repeat(40), "\\x7fELF\\x00\\x01\\x02\\x00"),
        (vec![0xa5; 100_000], "\\xa5\\xa5"),
    ] {
        let count = garbage.len();
        let link = peer(Duration::from_millis(50), move |mut from, mut to| {
            to.write_all(&garbage).unwrap();
            let _ = from.read_to_end(&mut Vec::new()); // stays
        });
        let (error, _) = ended(scenario(&[]), link);
        let said = error.to_string();
        assert!(error.is_bad_input() && said.lines().count() == 1, "{said}");
        let expected =
            format!("firmware: the answer is no omni-link message ({count} bytes, first \"{first}");
        assert!(said.starts_with(&expected), "{said}");
        assert!(
            said.ends_with(": check that it is the image that serves omni-link frames"),
            "{said}"
        );
        assert!(said.chars().count() <= 300, "{said}");
    }
}
