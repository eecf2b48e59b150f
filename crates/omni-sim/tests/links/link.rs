//! The loop through a link: a server in a thread, in-process pipes, and faults on the way.

use std::collections::BTreeMap;
use std::io::{PipeReader, PipeWriter, Read, Write, pipe};
use std::path::Path;
use std::thread;
use std::time::Duration;

use omni_link::{
    Counters, FrameError, HOLD_PERIODS, Loops, Receiver, Server, answer_frame, decode, request_frame,
};
use omni_sim::config::{Override, Precision, Scenario};
use omni_sim::controller::{AnyController, DEFAULT_FIRMWARE, Link, LinkCounters, emulator};
use omni_sim::{Error, Run, Simulation, Trace, run};

const N: usize = 7;

/// How long to wait for a frame: only lost ones take it. The busier the machine may be the longer,
/// and the shorter the more are lost; where none is, no delay may look like a loss.
fn time_out(requests: &Faults, answers: &Faults) -> Duration {
    let faults = requests.values().chain(answers.values());
    match faults.filter(|&&fault| fault == Fault::Lose).count() {
        0 => Duration::from_secs(60),
        1 => Duration::from_secs(2),
        _ => Duration::from_millis(500),
    }
}

/// What happens to a frame on its way.
#[derive(Clone, Copy, PartialEq)]
enum Fault {
    Lose,
    Truncate,
    Corrupt,
}

/// Faults by the frame's number in its direction: 0 is the greeting, 1 the first control period.
type Faults = BTreeMap<usize, Fault>;

fn one(frame: usize, fault: Fault) -> Faults {
    BTreeMap::from([(frame, fault)])
}

fn scenario(name: &str, duration_s: f64) -> Scenario {
    let overrides = [
        Override::new("duration_s", duration_s),
        Override::new("control.precision", "f32"),
        // Traction control is not served over a link.
        Override::new("control.policy", "scale_references"),
    ];
    Scenario::load(name, &overrides).unwrap()
}

/// The frame with two bits flipped in its last byte that says neither how long something is nor becomes a zero.
fn corrupted(frame: &[u8]) -> Vec<u8> {
    let damaged = (0..frame.len() - 1).rev().map(|at| {
        let mut damaged = frame.to_vec();
        damaged[at] ^= 3;
        damaged
    });
    // Read as nothing at all, a frame of the right structure has too many bytes.
    let intact = |damaged: &Vec<u8>| {
        !damaged[..damaged.len() - 1].contains(&0)
            && decode::<()>(&mut damaged.clone()) == Err(FrameError::Corrupted)
    };
    damaged.into_iter().find(intact).unwrap()
}

/// Carries frames on, but for the faults.
fn carry(mut from: impl Read, mut to: impl Write, faults: Faults) {
    let (mut frame, mut count, mut byte) = (Vec::new(), 0, [0]);
    while from.read_exact(&mut byte).is_ok() {
        frame.extend(byte);
        if byte != [0] {
            continue;
        }
        match faults.get(&count) {
            None => {}
            Some(Fault::Lose) => frame.clear(),
            Some(Fault::Truncate) => drop(frame.drain(frame.len() / 2..frame.len() - 1)),
            Some(Fault::Corrupt) => frame = corrupted(&frame),
        }
        count += 1;
        if to.write_all(&frame).is_err() {
            return;
        }
        frame.clear();
    }
}

fn digest_of(scenario: &Scenario) -> u32 {
    scenario.constants_digest().unwrap()
}

/// Serves the scenario's controller until no request comes any more, or until so many frames are answered.
fn serve(mut from: PipeReader, mut to: PipeWriter, scenario: &Scenario, digest: u32, frames: usize) {
    let controller = scenario.controller::<f32, N>().unwrap();
    let limiter = scenario.limiter::<f32>().unwrap();
    let loops = Loops {
        controller: &controller,
        limiter: &limiter,
    };
    let mut server = Server::new(digest, scenario.control.period_us as u32);
    let mut receiver = Receiver::<{ request_frame(N) }>::new();
    let (mut out, mut byte, mut answered) = ([0; answer_frame(N)], [0], 0);
    while answered < frames && from.read_exact(&mut byte).is_ok() {
        if let Some(frame) = receiver.push(byte[0]) {
            answered += 1;
            if to.write_all(server.answer(&loops, frame, &mut out)).is_err() {
                return;
            }
        }
    }
}

/// A link to a server of `built_for`, with faults both ways.
fn link_to(built_for: &Scenario, digest: u32, requests: Faults, answers: Faults, frames: usize) -> Link {
    let (host_in, answers_out) = pipe().unwrap();
    let (answers_in, server_out) = pipe().unwrap();
    let (server_in, requests_out) = pipe().unwrap();
    let (requests_in, host_out) = pipe().unwrap();
    let built_for = built_for.clone();
    let time_out = time_out(&requests, &answers);
    thread::spawn(move || carry(requests_in, requests_out, requests));
    thread::spawn(move || carry(answers_in, answers_out, answers));
    thread::spawn(move || serve(server_in, server_out, &built_for, digest, frames));
    Link::new("server", host_in, host_out, time_out)
}

/// A link to the image in QEMU, which ends when its console closes, with faults both ways.
fn link_to_qemu(requests: Faults, answers: Faults) -> Link {
    let top = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let image = top.join(DEFAULT_FIRMWARE);
    assert!(
        image.is_file(),
        "{} is missing: cd firmware && cargo build --release",
        image.display()
    );
    let mut emulator = emulator(&image).spawn().expect("qemu-system-arm starts");
    let (server_in, server_out) = (emulator.stdin.take().unwrap(), emulator.stdout.take().unwrap());
    let (host_in, answers_out) = pipe().unwrap();
    let (requests_in, host_out) = pipe().unwrap();
    let time_out = time_out(&requests, &answers);
    thread::spawn(move || carry(requests_in, server_in, requests));
    thread::spawn(move || {
        carry(server_out, answers_out, answers);
        let _ = emulator.wait(); // its console is closed: it has ended or is about to
    });
    Link::new("qemu", host_in, host_out, time_out)
}

/// Where the controller is.
#[derive(Clone, Copy)]
enum Place {
    /// In this process.
    Thread,
    /// In an emulated Cortex-M4F.
    Qemu,
}

fn linked(place: Place, scenario: &Scenario, requests: Faults, answers: Faults) -> AnyController {
    let link = match place {
        Place::Thread => link_to(scenario, digest_of(scenario), requests, answers, usize::MAX),
        Place::Qemu => link_to_qemu(requests, answers),
    };
    AnyController::over_link(scenario, link).unwrap()
}

/// The whole run, and what was lost.
fn run_linked(
    place: Place,
    scenario: &Scenario,
    requests: Faults,
    answers: Faults,
) -> (Result<Trace, Error>, LinkCounters) {
    let mut counters = LinkCounters::default();
    let trace = Run::new(scenario)
        .controller(linked(place, scenario, requests, answers))
        .watch(|simulation, _| {
            counters = simulation.controller().link_counters().unwrap();
            Ok(())
        })
        .trace();
    (trace, counters)
}

fn lost(lost: u32) -> Counters {
    Counters {
        lost,
        ..Counters::default()
    }
}

/// Every number of a trace, as bits.
fn bits(trace: &Trace) -> Vec<u64> {
    trace
        .names()
        .iter()
        .flat_map(|name| trace.column(name).unwrap())
        .map(|value| value.to_bits())
        .collect()
}

fn torques(trace: &Trace, row: usize) -> [u64; N] {
    std::array::from_fn(|wheel| trace.wheel("applied_n_m", wheel).unwrap()[row].to_bits())
}

fn without_faults_every_signal_of_the_run_is_the_hosts_bit_for_bit(place: Place) {
    for (name, duration_s) in [("flat", 0.5), ("step", 1.5)] {
        let scenario = scenario(name, duration_s);
        assert_eq!(scenario.control.precision, Precision::F32);
        let (trace, counters) = run_linked(place, &scenario, Faults::new(), Faults::new());
        let (trace, host) = (trace.unwrap(), run(&scenario).unwrap());
        assert_eq!(trace.names(), host.names());
        assert!(bits(&trace) == bits(&host), "{name}");
        assert_eq!(counters, LinkCounters::default());
    }
}

#[test]
fn a_link_computes_in_f32_whatever_the_scenario_says() {
    let in_f32 = scenario("flat", 0.05);
    let mut in_f64 = in_f32.clone();
    in_f64.control.precision = Precision::F64;
    let (trace, _) = run_linked(Place::Thread, &in_f64, Faults::new(), Faults::new());
    let (here, elsewhere) = (run(&in_f32).unwrap(), trace.unwrap());
    assert!(bits(&here) == bits(&elsewhere));
    assert!(bits(&run(&in_f64).unwrap()) != bits(&here));
}

/// Period 30, counted from 1, is the one that goes wrong; its row is 29.
const BAD: usize = 30;

fn one_bad_request_is_counted_there_and_the_torques_are_held(place: Place) {
    let scenario = scenario("flat", 0.06);
    let host = run(&scenario).unwrap();
    let of_damaged = |truncated, corrupted| Counters {
        lost: 0,
        truncated,
        corrupted,
    };
    for (fault, requests, answers) in [
        // A lost request looks like a lost answer: the host counts the answer that it did not get.
        (Fault::Lose, lost(1), lost(1)),
        (Fault::Truncate, of_damaged(1, 0), lost(0)),
        (Fault::Corrupt, of_damaged(0, 1), lost(0)),
    ] {
        let (trace, counters) = run_linked(place, &scenario, one(BAD, fault), Faults::new());
        let trace = trace.unwrap();
        assert_eq!((counters.answers, counters.requests), (answers, requests));
        assert_eq!(trace.rows(), 60);
        assert_eq!(torques(&trace, BAD - 2), torques(&host, BAD - 2));
        assert_eq!(torques(&trace, BAD - 1), torques(&trace, BAD - 2)); // held
        assert_ne!(torques(&host, BAD - 1), torques(&host, BAD - 2)); // where the host's change
        assert_ne!(torques(&trace, BAD), torques(&trace, BAD - 1)); // and on it goes
    }
}

fn one_bad_answer_is_counted_here_and_the_torques_are_held(place: Place) {
    let scenario = scenario("flat", 0.06);
    let host = run(&scenario).unwrap();
    let of_damaged = |truncated, corrupted| Counters {
        lost: 0,
        truncated,
        corrupted,
    };
    for (fault, answers) in [
        (Fault::Lose, lost(1)),
        (Fault::Truncate, of_damaged(1, 0)),
        (Fault::Corrupt, of_damaged(0, 1)),
    ] {
        let (trace, counters) = run_linked(place, &scenario, Faults::new(), one(BAD, fault));
        let trace = trace.unwrap();
        let requests = Counters::default(); // the controller has missed nothing
        assert_eq!((counters.answers, counters.requests), (answers, requests));
        assert_eq!(trace.rows(), 60);
        assert_eq!(torques(&trace, BAD - 2), torques(&host, BAD - 2));
        assert_eq!(torques(&trace, BAD - 1), torques(&trace, BAD - 2));
        assert_ne!(torques(&trace, BAD), torques(&trace, BAD - 1));
    }
}

fn ten_bad_frames_in_a_row_are_held_through(place: Place) {
    let scenario = scenario("flat", 0.06);
    let many: Faults = (BAD..BAD + HOLD_PERIODS as usize)
        .map(|frame| (frame, Fault::Corrupt))
        .collect();
    for (requests, answers) in [(many.clone(), Faults::new()), (Faults::new(), many)] {
        let (trace, counters) = run_linked(place, &scenario, requests, answers);
        let trace = trace.unwrap();
        assert_eq!(
            counters.requests.corrupted + counters.answers.corrupted,
            HOLD_PERIODS
        );
        for row in BAD - 1..BAD - 1 + HOLD_PERIODS as usize {
            assert_eq!(torques(&trace, row), torques(&trace, BAD - 2), "row {row}");
        }
        assert_ne!(torques(&trace, BAD + 9), torques(&trace, BAD - 2));
    }
}

fn the_eleventh_bad_frame_in_a_row_stops_the_run_without_torque(place: Place) {
    let scenario = scenario("flat", 0.06);
    let bad = |fault| (BAD..BAD + 11).map(|frame| (frame, fault)).collect::<Faults>();
    let cases = [
        (bad(Fault::Corrupt), Faults::new(), "the controller has stopped"),
        (bad(Fault::Truncate), Faults::new(), "the controller has stopped"),
        (
            Faults::new(),
            bad(Fault::Corrupt),
            "no new torques in 11 periods in a row",
        ),
        (
            Faults::new(),
            bad(Fault::Truncate),
            "no new torques in 11 periods in a row",
        ),
        (
            bad(Fault::Lose),
            Faults::new(),
            "no new torques in 11 periods in a row",
        ),
    ];
    for (requests, answers, why) in cases {
        let controller = linked(place, &scenario, requests, answers);
        let mut simulation = Simulation::with_controller(&scenario, controller).unwrap();
        let ahead = scenario.command.at(1.0);
        for period in 1..BAD + 10 {
            simulation.step(&ahead).unwrap();
            assert!(
                simulation.sample().wheels.iter().any(|w| w.applied_n_m != 0.0),
                "{period}"
            );
        }
        for _ in 0..3 {
            let error = simulation.step(&ahead).unwrap_err();
            assert!(!error.is_bad_input(), "the run failed, not the request");
            let Error::Link {
                time_s,
                reason,
                counters,
            } = &error
            else {
                panic!("{error}");
            };
            assert_eq!(reason, why);
            assert_eq!((time_s * 1e3).round(), 39.0); // period 40 begins 39 ms after the first
            let (a, r) = (counters.answers, counters.requests);
            let of = |c: Counters| c.lost.max(c.truncated).max(c.corrupted);
            assert_eq!(of(a).max(of(r)), 11, "{counters}");
            assert_eq!(error.to_string().lines().count(), 1);
            assert!(simulation.sample().wheels.iter().all(|w| w.applied_n_m == 0.0));
        }
        // Nothing drives it any more, but time goes on.
        assert_eq!(simulation.time_ns(), (BAD as u64 + 12) * 1_000_000);
    }
}

#[test]
fn a_lost_first_request_is_said_again() {
    let scenario = scenario("flat", 0.02);
    let (trace, counters) = run_linked(Place::Thread, &scenario, one(1, Fault::Corrupt), Faults::new());
    assert_eq!(trace.unwrap().rows(), 20);
    assert_eq!(counters.requests.corrupted, 1, "{counters}");
    assert!(counters.answers.is_zero(), "{counters}"); // the answer was there, saying that nothing runs yet
}

#[test]
fn a_bad_greeting_is_said_again() {
    let scenario = scenario("flat", 0.02);
    let (trace, _) = run_linked(
        Place::Thread,
        &scenario,
        one(0, Fault::Lose),
        one(0, Fault::Corrupt),
    );
    assert!(bits(&trace.unwrap()) == bits(&run(&scenario).unwrap()));
}

/// The line that refuses a server that was built for something else.
fn refused(scenario: &Scenario, built_for: &Scenario, digest: u32) -> String {
    let link = link_to(built_for, digest, Faults::new(), Faults::new(), usize::MAX);
    let error = AnyController::over_link(scenario, link).err().unwrap();
    assert!(error.is_bad_input());
    error.to_string()
}

#[test]
fn a_controller_that_was_built_for_something_else_is_refused_in_one_line() {
    let own = scenario("flat", 0.02);
    let other = own.with_policy("scale_torques").unwrap();
    let line = refused(&own, &other, digest_of(&other));
    assert!(
        line.starts_with("server: built for another vehicle or policy: its constants' digest is "),
        "{line}"
    );
    assert!(
        line.contains("; build it for this scenario: in firmware/, OMNISTEP_SCENARIO=FILE"),
        "{line}"
    );

    let slow = Scenario::load("flat", &[Override::new("control.period_s", 0.002)]).unwrap();
    let line = refused(&own, &slow, digest_of(&own));
    assert_eq!(
        line,
        "server: built for a control period of 2000 us, the scenario has 1000; build it for this scenario: \
         in firmware/, OMNISTEP_SCENARIO=FILE cargo build --release"
    );
}

#[test]
fn a_server_that_goes_away_ends_the_run_at_once() {
    let scenario = scenario("flat", 0.06);
    let link = link_to(&scenario, digest_of(&scenario), Faults::new(), Faults::new(), 20);
    let controller = AnyController::over_link(&scenario, link).unwrap();
    let start = std::time::Instant::now();
    let error = Run::new(&scenario).controller(controller).trace().unwrap_err();
    assert_eq!(
        error.to_string(),
        "the link to the controller stopped at t = 0.019 s: the other end has closed it (answers: 0 lost, \
         0 truncated, 0 corrupted; requests: 0 lost, 0 truncated, 0 corrupted)"
    );
    // Not after a time-out.
    assert!(
        start.elapsed() < time_out(&Faults::new(), &Faults::new()),
        "{:?}",
        start.elapsed()
    );
}

#[test]
fn a_peer_that_never_answers_is_given_up() {
    let scenario = scenario("flat", 0.02);
    let (reader, _kept_open) = pipe().unwrap();
    let link = Link::new("silence", reader, std::io::sink(), Duration::from_millis(20));
    let line = AnyController::over_link(&scenario, link)
        .err()
        .unwrap()
        .to_string();
    assert_eq!(
        line,
        "silence: no answer within 0.1 s: check that it is the image that serves omni-link frames"
    );
}

/// The laws above with the server in a thread.
mod in_this_process {
    use super::*;

    #[test]
    fn without_faults_every_signal_of_the_run_is_the_hosts_bit_for_bit() {
        super::without_faults_every_signal_of_the_run_is_the_hosts_bit_for_bit(Place::Thread);
    }

    #[test]
    fn one_bad_request_is_counted_there_and_the_torques_are_held() {
        super::one_bad_request_is_counted_there_and_the_torques_are_held(Place::Thread);
    }

    #[test]
    fn one_bad_answer_is_counted_here_and_the_torques_are_held() {
        super::one_bad_answer_is_counted_here_and_the_torques_are_held(Place::Thread);
    }

    #[test]
    fn ten_bad_frames_in_a_row_are_held_through() {
        super::ten_bad_frames_in_a_row_are_held_through(Place::Thread);
    }

    #[test]
    fn the_eleventh_bad_frame_in_a_row_stops_the_run_without_torque() {
        super::the_eleventh_bad_frame_in_a_row_stops_the_run_without_torque(Place::Thread);
    }
}

/// The same with the controller in an emulated Cortex-M4F, and the whole climb.
mod in_qemu {
    use super::*;

    #[test]
    #[ignore = "needs QEMU and the image of firmware/; make firmware runs it"]
    fn without_faults_every_signal_of_the_run_is_the_hosts_bit_for_bit() {
        super::without_faults_every_signal_of_the_run_is_the_hosts_bit_for_bit(Place::Qemu);
    }

    #[test]
    #[ignore = "needs QEMU and the image of firmware/; make firmware runs it"]
    fn one_bad_request_is_counted_there_and_the_torques_are_held() {
        super::one_bad_request_is_counted_there_and_the_torques_are_held(Place::Qemu);
    }

    #[test]
    #[ignore = "needs QEMU and the image of firmware/; make firmware runs it"]
    fn one_bad_answer_is_counted_here_and_the_torques_are_held() {
        super::one_bad_answer_is_counted_here_and_the_torques_are_held(Place::Qemu);
    }

    #[test]
    #[ignore = "needs QEMU and the image of firmware/; make firmware runs it"]
    fn ten_bad_frames_in_a_row_are_held_through() {
        super::ten_bad_frames_in_a_row_are_held_through(Place::Qemu);
    }

    #[test]
    #[ignore = "needs QEMU and the image of firmware/; make firmware runs it"]
    fn the_eleventh_bad_frame_in_a_row_stops_the_run_without_torque() {
        super::the_eleventh_bad_frame_in_a_row_stops_the_run_without_torque(Place::Qemu);
    }

    #[test]
    #[ignore = "needs QEMU and the image of firmware/; make firmware runs it"]
    fn every_torque_of_the_whole_climb_is_the_hosts_bit_for_bit() {
        let scenario = scenario("step", 6.0);
        let (trace, counters) = run_linked(Place::Qemu, &scenario, Faults::new(), Faults::new());
        let (trace, host) = (trace.unwrap(), run(&scenario).unwrap());
        assert_eq!((trace.rows(), trace.names()), (6000, host.names()));
        assert!(bits(&trace) == bits(&host));
        assert!(counters.is_zero(), "{counters}");
        assert!(trace.outcome().climbed);
    }
}
