//! A controller at the end of a link that damages, loses and invents frames.

use arbitrary::Unstructured;
use omni_core::shaping::TwistLimiter;
use omni_core::{Controller, TorqueLimit};
use omni_link::{
    Answer, FromController, Loops, Receiver, Request, Server, ToController, answer_frame, decode, encode,
    request_frame,
};

use super::config::{control, layout, twist_limits};
use super::numbers::{bits, byte, one_in};

/// Frames as far as the bytes reach; returns how many.
pub(super) fn run(data: &[u8]) -> usize {
    let mut u = Unstructured::new(data);
    match byte(&mut u) % 3 {
        0 => link::<3, { request_frame(3) }, { answer_frame(3) }>(&mut u),
        1 => link::<4, { request_frame(4) }, { answer_frame(4) }>(&mut u),
        _ => link::<7, { request_frame(7) }, { answer_frame(7) }>(&mut u),
    }
}

fn link<const N: usize, const REQUEST: usize, const ANSWER: usize>(u: &mut Unstructured<'_>) -> usize {
    let (Some(layout), Some(control)) = (layout::<f32, N>(u), control::<f32, N>(u)) else {
        return 0;
    };
    let limits = control.limits;
    let Ok(limiter) = TwistLimiter::new(twist_limits(u), control.pid.period_s) else {
        return 0;
    };
    let Ok(controller) = Controller::new(&layout, control) else {
        return 0;
    };
    let loops = Loops {
        controller: &controller,
        limiter: &limiter,
    };
    let mut server = Server::new(1, 1000);
    let (mut receiver, mut out) = (Receiver::<REQUEST>::new(), [0; ANSWER]);
    let (mut sequence, mut frames) = (0_u32, 0);
    while !u.is_empty() {
        if one_in(u, 20) {
            server.missed();
        }
        for byte in sent::<N>(u, &mut sequence) {
            let Some(frame) = receiver.push(byte) else {
                continue;
            };
            frames += 1;
            let answered = server.answer(&loops, frame, &mut out).len();
            assert!(answered > 0, "no answer");
            let answer = decode::<FromController<Answer<N>>>(&mut out[..answered]);
            match answer.expect("an answer is a message") {
                FromController::Greeting(greeting) => assert_eq!(greeting.wheels, N as u32),
                FromController::Answer(answer) => check(&answer, &limits, server.guard().is_stopped()),
            }
        }
        assert!(
            !server.guard().is_stopped() || server.torques().n_m == [0.0; N],
            "torque while stopped"
        );
    }
    frames
}

/// Torques are within the motors' limits and none while stopped; no number is NaN.
fn check<const N: usize>(answer: &Answer<N>, limits: &[TorqueLimit<f32>; N], stopped: bool) {
    let wheels = &answer.sample.wheels;
    for (i, limit) in limits.iter().enumerate() {
        let (applied, motor) = (wheels.applied.n_m[i], limit.range(wheels.measured.rad_s[i]));
        assert!(
            applied >= motor.lower_n_m && applied <= motor.upper_n_m,
            "wheel {i}: {applied} N.m, its motor has {motor:?}"
        );
        assert!(
            !stopped || applied == 0.0,
            "wheel {i}: {applied} N.m while stopped"
        );
    }
    let numbers = [
        answer.estimated.to_array().as_slice(),
        &answer.residual.rad_s,
        &wheels.p_n_m,
        &wheels.i_n_m,
        &wheels.d_n_m,
    ]
    .concat();
    assert!(
        numbers.iter().all(|v| !v.is_nan()),
        "an answer with NaN: {:?}",
        answer.estimated
    );
}

/// Bytes of one frame, sound, damaged, lying or none at all.
fn sent<const N: usize>(u: &mut Unstructured<'_>, sequence: &mut u32) -> Vec<u8> {
    *sequence = match byte(u) {
        0..5 => u.arbitrary().unwrap_or_default(),
        5..20 => sequence.wrapping_add(u32::from(byte(u) % 16)),
        _ => sequence.wrapping_add(1),
    };
    let message = if one_in(u, 30) {
        ToController::<N>::Hello
    } else {
        let hostile = one_in(u, 3);
        let number = |u: &mut Unstructured<'_>| {
            if hostile {
                bits(u)
            } else {
                f32::from(i16::from(byte(u)) - 128) / 8.0
            }
        };
        ToController::Request(Request {
            sequence: *sequence,
            restart: one_in(u, 10),
            emergency_stop: one_in(u, 20),
            command: omni_core::BodyTwist::from_array(std::array::from_fn(|_| number(u))),
            measured_rad_s: std::array::from_fn(|_| number(u)),
        })
    };
    let mut buffer = [0; 64];
    let mut frame = encode(&message, &mut buffer).unwrap_or_default().to_vec();
    match byte(u) {
        0..10 => {
            let (at, bit) = (usize::from(byte(u)), byte(u) % 8);
            if let Some(byte) = frame.get_mut(at) {
                *byte ^= 1 << bit;
            }
        }
        10..15 => frame.truncate(usize::from(byte(u) % 64)),
        15..20 => {
            let length = usize::from(byte(u) % 100).min(u.len());
            frame = u.bytes(length).unwrap_or_default().to_vec();
            frame.push(0);
        }
        _ => {}
    }
    frame
}
