use super::*;

use std::collections::BTreeSet;
use std::vec::Vec;

use omni_core::loops::ControlSample;
use omni_core::{BodyTwist, WheelVelocities};
use proptest::prelude::*;

use crate::{
    Action, Answer, Counters, DriveReport, FromController, Greeting, MAX_ANSWER_FRAME, Request, ToController,
    answer_frame, request_frame,
};

const N: usize = 7;

fn frame_of<T: Serialize>(message: &T) -> Vec<u8> {
    let mut buffer = [0; MAX_ANSWER_FRAME];
    encode(message, &mut buffer).expect("fits").to_vec()
}

fn request(sequence: u32, values: [f32; 3 + N]) -> ToController<N> {
    let mut measured_rad_s = [0.0; N];
    measured_rad_s.copy_from_slice(&values[3..]);
    ToController::Request(Request {
        sequence,
        restart: sequence.is_multiple_of(2),
        emergency_stop: sequence.is_multiple_of(3),
        command: BodyTwist {
            vx_m_s: values[0],
            vy_m_s: values[1],
            wz_rad_s: values[2],
        },
        measured_rad_s,
    })
}

/// An answer all of whose fields differ.
fn answer<const WHEELS: usize>(seed: u32) -> Answer<WHEELS> {
    let mut state = seed;
    let mut next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        state
    };
    let mut sample = ControlSample::zero();
    let mut each = || [0.0; WHEELS].map(|_: f32| f32::from_bits(next()));
    let wheels = &mut sample.wheels;
    wheels.reference.rad_s = each();
    wheels.measured.rad_s = each();
    (wheels.p_n_m, wheels.i_n_m, wheels.d_n_m, wheels.ff_n_m) = (each(), each(), each(), each());
    (wheels.requested.n_m, wheels.applied.n_m) = (each(), each());
    (wheels.range.lower_n_m, wheels.range.upper_n_m) = (each(), each());
    let residual = WheelVelocities { rad_s: each() };
    sample.wheels.active = [0; WHEELS].map(|_| next() > u32::MAX / 2);
    sample.wheels.saturated = [0; WHEELS].map(|_| next() > u32::MAX / 2);
    sample.wheels.common_factor = f32::from_bits(next());
    (sample.wheels.ended, sample.wheels.shorted) = (next() > u32::MAX / 2, next() > u32::MAX / 2);
    let mut twist = || BodyTwist {
        vx_m_s: f32::from_bits(next()),
        vy_m_s: f32::from_bits(next()),
        wz_rad_s: f32::from_bits(next()),
    };
    sample.command = twist();
    let estimated = twist();
    let drive = DriveReport {
        mode: (next() >> 24) as u8,
        faults: [0; WHEELS].map(|_: u8| (next() >> 24) as u8),
        motion_known: next() > u32::MAX / 2,
        excluded: [0; WHEELS].map(|_| next() > u32::MAX / 2),
        pose: [0; 3].map(|_| f32::from_bits(next())),
    };
    Answer {
        estimated,
        sequence: seed,
        action: Action::Hold,
        counters: Counters {
            lost: seed,
            truncated: !seed,
            corrupted: seed.rotate_left(7),
        },
        sample,
        residual,
        drive,
    }
}

/// Every bit of an answer: NaN is not equal to itself, its debug form does not show its bits.
fn bits<const WHEELS: usize>(a: &Answer<WHEELS>) -> Vec<u32> {
    let w = &a.sample.wheels;
    let columns = [
        w.reference.rad_s,
        w.measured.rad_s,
        w.p_n_m,
        w.i_n_m,
        w.d_n_m,
        w.ff_n_m,
        w.requested.n_m,
        w.applied.n_m,
        w.range.lower_n_m,
        w.range.upper_n_m,
        a.residual.rad_s,
    ];
    let twists = [a.sample.command.to_array(), a.estimated.to_array()].concat();
    let floats = columns
        .concat()
        .into_iter()
        .chain(twists)
        .chain([w.common_factor])
        .chain(a.drive.pose);
    let marks = w.active.into_iter().chain(w.saturated).chain(a.drive.excluded);
    let marks = marks
        .chain([a.drive.motion_known, w.ended, w.shorted])
        .map(u32::from);
    let numbers = a.drive.faults.into_iter().chain([a.drive.mode]).map(u32::from);
    let Counters {
        lost,
        truncated,
        corrupted,
    } = a.counters;
    floats
        .map(f32::to_bits)
        .chain(marks)
        .chain(numbers)
        .chain([a.sequence, a.action as u32, lost, truncated, corrupted])
        .collect()
}

/// Any bits, with the special numbers often.
fn any_bits() -> impl Strategy<Value = f32> {
    let special = [
        0.0,
        -0.0,
        f32::NAN,
        -f32::NAN,
        f32::INFINITY,
        f32::NEG_INFINITY,
        1e-42,
    ];
    prop_oneof![
        any::<u32>().prop_map(f32::from_bits),
        proptest::sample::select(special.to_vec()),
        Just(f32::from_bits(0x7f80_0001)), // a signalling NaN
    ]
}

proptest! {
    #[test]
    fn a_request_comes_out_with_the_bits_that_went_in(
        sequence: u32, values in proptest::array::uniform10(any_bits()),
    ) {
        let mut frame = frame_of(&request(sequence, values));
        prop_assert_eq!(frame.len(), request_frame(N));
        let ToController::Request(found) = decode::<ToController<N>>(&mut frame).expect("intact") else {
            panic!("a request");
        };
        let found_values = [&found.command.to_array()[..], &found.measured_rad_s].concat();
        prop_assert_eq!((found.sequence, found.restart), (sequence, sequence.is_multiple_of(2)));
        prop_assert!(found_values.iter().zip(values).all(|(a, b)| a.to_bits() == b.to_bits()));
    }

    #[test]
    fn an_answer_comes_out_with_the_bits_that_went_in(seed: u32) {
        let sent = answer::<N>(seed);
        let mut frame = frame_of(&FromController::Answer(&sent));
        prop_assert!(frame.len() <= answer_frame(N)); // a byte less where zeros shorten the stuffing
        let found = decode::<FromController<Answer<N>>>(&mut frame);
        let Ok(FromController::Answer(found)) = found else { panic!("an answer") };
        prop_assert_eq!(bits(&found), bits(&sent));
    }

    #[test]
    fn noise_is_no_message_and_nothing_panics(mut bytes in proptest::collection::vec(any::<u8>(), 0..600)) {
        prop_assert!(decode::<ToController<N>>(&mut bytes).is_err()); // but for one in 2^32
    }

    #[test]
    fn a_burst_of_damage_is_noticed(
        seed: u32, at in 0..200_usize, damage in proptest::collection::vec(1..=255_u8, 1..40),
    ) {
        let mut frame = frame_of(&FromController::Answer(&answer::<N>(seed)));
        for (byte, flips) in frame.iter_mut().skip(at).zip(&damage) {
            *byte ^= flips;
        }
        prop_assert!(decode::<FromController<Answer<N>>>(&mut frame).is_err());
    }
}

/// The frames that come out of a receiver, decoded.
fn received<T: DeserializeOwned>(bytes: &[u8]) -> Vec<Result<T, FrameError>> {
    let mut receiver = Receiver::<MAX_ANSWER_FRAME>::new();
    let mut found = Vec::new();
    for &byte in bytes {
        found.extend(receiver.push(byte).map(decode::<T>));
    }
    found
}

#[test]
fn every_single_flipped_bit_of_a_request_is_noticed() {
    let frame = frame_of(&request(
        77,
        [0.25, -0.0, 3.5, 1.0, 0.0, -2.0, 1e-9, 7.0, 0.0, 1e9],
    ));
    for bit in 0..8 * frame.len() {
        let mut damaged = frame.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        let found = received::<ToController<N>>(&damaged);
        assert!(found.iter().all(Result::is_err), "bit {bit}: {found:?}");
    }
}

#[test]
fn every_single_flipped_bit_of_an_answer_is_noticed() {
    let frame = frame_of(&FromController::Answer(&answer::<N>(3)));
    for bit in 0..8 * frame.len() {
        let mut damaged = frame.clone();
        damaged[bit / 8] ^= 1 << (bit % 8);
        let found = received::<FromController<Answer<N>>>(&damaged);
        assert!(found.iter().all(Result::is_err), "bit {bit}");
    }
}

#[test]
fn every_truncation_is_noticed_whichever_end_is_missing() {
    let frame = frame_of(&FromController::Answer(&answer::<N>(5)));
    let body = frame.len() - 1;
    let decoded = |bytes: &[u8]| decode::<FromController<Answer<N>>>(&mut bytes.to_vec()).map(|_| ());
    assert_eq!(decoded(&frame[..body]), Ok(())); // the zero has done its work
    for length in 0..body {
        assert_eq!(
            decoded(&frame[..length]),
            Err(FrameError::Truncated),
            "{length} bytes"
        );
        assert!(decoded(&frame[body - length..]).is_err(), "last {length} bytes");
    }
}

#[test]
fn every_gap_in_a_frame_is_noticed() {
    let frame = frame_of(&request(9, [1.5; 3 + N]));
    for start in 0..frame.len() - 1 {
        for end in start + 1..frame.len() {
            let mut damaged = [&frame[..start], &frame[end..]].concat();
            assert!(decode::<ToController<N>>(&mut damaged).is_err(), "{start}..{end}");
        }
    }
}

#[test]
fn a_frame_without_its_zero_costs_the_next_one_too_and_no_more() {
    let frames: Vec<_> = (0..3).map(|k| frame_of(&request(k, [0.5; 3 + N]))).collect();
    let stream = [&frames[0][..frames[0].len() - 1], &frames[1], &frames[2]].concat();
    let found = received::<ToController<N>>(&stream);
    assert_eq!(found.len(), 2);
    assert_eq!(found[0], Err(FrameError::Corrupted));
    assert_eq!(found[1], Ok(request(2, [0.5; 3 + N])));
}

#[test]
fn a_message_for_another_number_of_wheels_is_none() {
    let mut frame = frame_of(&request(1, [1.0; 3 + N]));
    assert_eq!(
        decode::<ToController<8>>(&mut frame.clone()),
        Err(FrameError::Truncated)
    );
    assert_eq!(decode::<ToController<6>>(&mut frame), Err(FrameError::Corrupted));
}

#[test]
fn a_greeting_reads_the_same_for_any_number_of_wheels() {
    let greeting = Greeting {
        version: 1,
        wheels: 4,
        period_us: 1000,
        digest: 0xdead_beef,
    };
    let mut frame = frame_of(&FromController::<&Answer<4>>::Greeting(greeting));
    let found = decode::<FromController<Answer<8>>>(&mut frame);
    assert_eq!(found, Ok(FromController::Greeting(greeting)));
}

#[test]
fn the_lengths_are_those_announced_for_every_number_of_wheels() {
    fn lengths<const WHEELS: usize>() {
        let request = ToController::Request(Request {
            sequence: u32::MAX,
            restart: true,
            emergency_stop: true,
            command: BodyTwist::ZERO,
            measured_rad_s: [f32::from_bits(u32::MAX); WHEELS],
        });
        assert_eq!(frame_of(&request).len(), request_frame(WHEELS));
        // Without any zero the stuffing is longest; the announced length is enough for all, and one less is not.
        let longest = (0..200_u32)
            .map(|seed| frame_of(&FromController::Answer(&answer::<WHEELS>(seed))).len())
            .max();
        assert!(longest <= Some(answer_frame(WHEELS)) && longest >= Some(answer_frame(WHEELS) - 1));
    }
    lengths::<3>();
    lengths::<4>();
    lengths::<5>();
    lengths::<6>();
    lengths::<7>();
    lengths::<8>();
}

#[test]
fn a_frame_has_one_zero_and_a_short_buffer_none() {
    let message = FromController::Answer(&answer::<N>(1));
    let frame = frame_of(&message);
    assert_eq!(frame.iter().filter(|&&byte| byte == 0).count(), 1);
    let mut buffer = [0; MAX_ANSWER_FRAME];
    for size in 0..frame.len() {
        assert!(encode(&message, &mut buffer[..size]).is_none(), "{size}");
    }
    assert!(encode(&message, &mut buffer[..frame.len()]).is_some());
}

#[test]
fn the_check_is_that_of_the_catalogue() {
    // CRC-32/MPEG-2 of "123456789", from the catalogue of parametrised CRC algorithms.
    let check = b"123456789"
        .iter()
        .fold(CHECK_OF_NOTHING, |check, &byte| check_with(check, byte));
    assert_eq!(check, 0x0376_e6e7);
}

#[test]
fn different_messages_have_different_frames() {
    let frames: BTreeSet<_> = (0..500).map(|k| frame_of(&request(k, [0.0; 3 + N]))).collect();
    assert_eq!(frames.len(), 500);
}
