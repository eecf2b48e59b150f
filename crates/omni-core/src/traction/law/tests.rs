mod doubts;
mod hazards;
mod laws;
mod retries;

use std::vec::Vec;

use proptest::prelude::*;

use super::*;
use crate::geometry::{BodyTwist, Kinematics, WheelLayout};
use crate::linkage::{CarriedWheel, HingeGeometry, Linkage};
use crate::motor::TorqueLimit;
use crate::policy::{GRAVITY_M_S2, Imu, Policy, Readings};
use crate::shaping::{AxisLimits, TwistLimiter, TwistLimits};
use crate::traction::encoder::{EncoderState, window_s};
use crate::traction::*;

const T: f64 = 1e-3;
const PLACES: [[f64; 2]; 7] = [
    [-0.3, -0.23],
    [-0.3, 0.0],
    [-0.3, 0.23],
    [0.0, 0.0],
    [0.3, -0.23],
    [0.3, 0.0],
    [0.3, 0.23],
];
const LIMIT_N_M: f64 = 2.0;
const J: f64 = 0.002_178;
const AHEAD: BodyTwist<f64> = BodyTwist {
    vx_m_s: 0.3,
    vy_m_s: 0.0,
    wz_rad_s: 0.0,
};

/// Readings of a vehicle that stands level, its hinges too.
fn level<'a>(command: BodyTwist<f64>, rates_rad_s: &'a [f64]) -> Readings<'a, f64> {
    let mut readings = Readings::new(command, rates_rad_s);
    (readings.hinges_rad, readings.hinges_rad_s) = (&[0.0; 2], &[0.0; 2]);
    readings
}

/// A state that knows the gyro's zero: the vehicle has stood for a moment.
fn stood(traction: &Traction<f64, 7>) -> TractionState<f64, 7> {
    let mut state = TractionState::new();
    for _ in 0..60 {
        let _ = traction.step(
            &mut state,
            &level(BodyTwist::ZERO, &[0.0; 7]),
            &TractionTarget::at(0.0),
        );
    }
    state
}

fn wheels<const N: usize>(places: [[f64; 2]; N]) -> [TractionWheel<f64>; N] {
    places.map(|place_m| TractionWheel {
        limit: TorqueLimit::constant(LIMIT_N_M).expect("valid"),
        inertia_kg_m2: J,
        carrier: [0.0; 2],
        place_m,
    })
}

/// Wheels of an omni layout: each rolls the way it pushes.
fn carried_wheels(layout: &Kinematics<f64, 7>) -> [TractionWheel<f64>; 7] {
    let mut wheels = wheels(PLACES);
    for (wheel, [ax, ay, _]) in wheels.iter_mut().zip(layout.inverse_matrix()) {
        wheel.carrier = [0.066 * ax, 0.066 * ay];
    }
    wheels
}

fn hinges() -> [HingeGeometry<f64>; 2] {
    let anchor_m = [0.0, 0.0, 0.066];
    [
        HingeGeometry {
            parent: 0,
            child: 1,
            axis: [0.0, 1.0, 0.0],
            anchor_m,
        },
        HingeGeometry {
            parent: 0,
            child: 2,
            axis: [1.0, 0.0, 0.0],
            anchor_m,
        },
    ]
}

fn seven(config: TractionConfig<f64>) -> Traction<f64, 7> {
    let body = |[x, _]: [f64; 2]| match x {
        x if x > 0.0 => 1,
        x if x < 0.0 => 2,
        _ => 0,
    };
    let carried = PLACES.map(|place| CarriedWheel {
        body: body(place),
        centre_m: [place[0], place[1], 0.066],
    });
    let linkage = Linkage::new(&hinges(), &carried).expect("a tree");
    let layout = WheelLayout::chugo7(0.30, 0.23, 0.066).expect("valid");
    let kinematics = Kinematics::new(&layout).expect("valid");
    let wheels = carried_wheels(&kinematics);
    Traction::new(kinematics, linkage, wheels, config).expect("valid")
}

fn preset() -> Traction<f64, 7> {
    seven(TractionConfig::traction(0.3, 2.0, T))
}

/// A vehicle on flat ground that only goes ahead: wheels with inertia, each with its own friction \[N.m\].
struct Plant {
    grip_n_m: [f64; 7],
    rate_rad_s: [f64; 7],
    speed_m_s: f64,
    /// What holds the vehicle back \[N\].
    drag_n: f64,
}

impl Plant {
    const SIGNS: [f64; 7] = [1.0, 0.0, -1.0, 1.0, 1.0, 0.0, -1.0];
    const MASS_KG: f64 = 20.0;

    fn new(grip_n_m: f64) -> Self {
        Self {
            grip_n_m: [grip_n_m; 7],
            rate_rad_s: [0.0; 7],
            speed_m_s: 0.0,
            drag_n: 0.0,
        }
    }

    fn step(&mut self, torques_n_m: &[f64; 7]) {
        let mut force = -self.drag_n * f64::from(u8::from(self.speed_m_s > 0.0));
        for i in 0..7 {
            let sign = Self::SIGNS[i];
            if sign == 0.0 {
                continue;
            }
            // Friction takes what brings the rim to the ground's speed within the period, up to its limit.
            let (along, slip) = (
                sign * torques_n_m[i],
                sign * self.rate_rad_s[i] - self.speed_m_s / 0.066,
            );
            let taken = (along + slip * J / T).clamp(-self.grip_n_m[i], self.grip_n_m[i]);
            self.rate_rad_s[i] += sign * (along - taken) / J * T;
            force += taken / 0.066;
        }
        self.speed_m_s += force / Self::MASS_KG * T;
    }
}

/// Drives the plant for so long; the last sample.
fn drive(
    traction: &Traction<f64, 7>,
    state: &mut TractionState<f64, 7>,
    plant: &mut Plant,
    periods: usize,
    target: f64,
) -> TractionSample<f64, 7> {
    let mut sample = TractionSample::zero();
    for _ in 0..periods {
        let readings = level(AHEAD, &plant.rate_rad_s);
        sample = traction.step(state, &readings, &TractionTarget::at(target));
        plant.step(&sample.wheels.applied.n_m);
    }
    sample
}

#[test]
fn with_grip_the_vehicle_comes_to_its_target_and_no_wheel_slips() {
    let (traction, mut state, mut plant) = (preset(), TractionState::new(), Plant::new(10.0));
    let sample = drive(&traction, &mut state, &mut plant, 5200, 0.3);
    // Plain loops: kp / ki = 0.15 s is their time constant, and 35 of them are over.
    assert!((plant.speed_m_s - 0.3).abs() < 1e-3, "{}", plant.speed_m_s);
    assert!(
        sample.slip_rad_s.iter().all(|slip| slip.abs() < 0.1),
        "{:?}",
        sample.slip_rad_s
    );
}

#[test]
fn a_wheel_on_ice_gives_what_the_ice_takes_and_spins_no_further() {
    let (traction, mut state, mut plant) = (preset(), TractionState::new(), Plant::new(10.0));
    plant.grip_n_m[4] = 0.2;
    plant.drag_n = 80.0; // 5 wheels have 5 x 2 / 0.066 = 150 N; the thrust is beyond what the ice takes
    let sample = drive(&traction, &mut state, &mut plant, 2000, 0.3);
    let slip = sample.slip_rad_s[4];
    // Free and a width of slip, 4 and 22 mm/s of rim, are 0.4 rad/s; a plain loop of the same gain
    // would spin at (1 - 0.2) / 0.74 rad/s.
    assert!(slip > 0.0 && slip < 0.6, "{slip}");
    assert!(
        (sample.wheels.applied.n_m[4] - 0.2).abs() < 0.05,
        "{:?}",
        sample.wheels.applied.n_m
    );
    assert!(
        (sample.contact_n_m[4] - 0.2).abs() < 0.05,
        "{:?}",
        sample.contact_n_m
    );
    assert!(
        sample.wheels.applied.n_m[3] > 0.9,
        "{:?}",
        sample.wheels.applied.n_m
    ); // the others push on
    assert!(sample.speed_wheel != Some(4)); // the one that spins does not give the speed
}

#[test]
fn the_slowest_wheels_that_push_give_the_speed_or_the_fastest_that_brakes() {
    let mut config = TractionConfig::traction(0.3, 2.0, T);
    (config.speed_s, config.acceleration_m_s2) = (0.0, 1e6);
    let traction = seven(config);
    let at = |rates: [f64; 7], torque: f64| {
        let mut state = TractionState::new();
        traction.command(&mut state, &AHEAD);
        for (wheel, sign) in state.wheels.iter_mut().zip(Plant::SIGNS) {
            (wheel.applied_n_m, wheel.most_n_m, wheel.usable) = (sign * torque, LIMIT_N_M, true);
        }
        for (wheel, rate) in state.wheels.iter_mut().zip(rates) {
            wheel.usable = rate.is_finite();
        }
        (
            traction.measure_speed(
                &mut state,
                &rates.map(|rate| if rate.is_finite() { rate } else { 0.0 }),
                0.0,
            ),
            state.speed_m_s,
        )
    };
    let rates = [5.0, 0.0, -4.0, 6.0, 5.0, 0.0, -7.0];
    let (speed_wheel, speed) = at(rates, 1.0);
    assert_eq!(speed_wheel, Some(2));
    assert!((speed - 4.0 * 0.066).abs() < 1e-12);
    // Wheels that agree with it within what is no slip, 4 mm/s, are averaged: zero-mean errors are none of the speed.
    let (_, speed) = at([4.02, 0.0, -4.0, 4.04, 5.0, 0.0, -7.0], 1.0);
    assert!((speed - 4.02 * 0.066).abs() < 1e-12);
    let (speed_wheel, speed) = at(rates, -1.0);
    assert_eq!(speed_wheel, Some(6));
    assert!((speed - 7.0 * 0.066).abs() < 1e-12);
    // One that is not usable says nothing.
    let (speed_wheel, speed) = at([5.0, 0.0, f64::NAN, 6.0, 5.01, 0.0, -7.0], 1.0);
    assert_eq!(speed_wheel, Some(0));
    assert!((speed - 5.005 * 0.066).abs() < 1e-12);
    // One wheel alone says that the vehicle stands; that it goes back takes two.
    assert_eq!(at([5.0, 0.0, 4.0, 6.0, 5.0, 0.0, -7.0], 1.0).1, 0.0);
    assert!((at([-3.0, 0.0, 4.0, 6.0, 5.0, 0.0, -7.0], 1.0).1 + 3.0 * 0.066).abs() < 1e-12);
}

#[test]
fn a_climbing_row_turns_faster_and_that_is_no_slip() {
    let traction = preset();
    let mut state = stood(&traction);
    // The front frame's nose goes up: its wheels rise with 0.3 x 0.8 m/s, and their encoders see the frame turn.
    let (angles, rates) = ([0.0, 0.0], [-0.8, 0.0]);
    let mut sample = TractionSample::zero();
    let flat = traction.kinematics().inverse(&AHEAD).rad_s;
    // No reading of a wheel that turns stays the same to the bit.
    for period in 0..400 {
        let flat = flat.map(|rate| rate + 1e-9 * f64::from(period));
        let _ = traction.step(&mut state, &level(AHEAD, &flat), &TractionTarget::at(0.3));
    }
    for period in 0..400 {
        let rolled = (0.3_f64.hypot(0.3 * 0.8) + 0.066 * 0.8) / 0.066;
        let rest = 0.3 / 0.066;
        let wheels =
            [rest, 0.0, -rest, rest, rolled, 0.0, -rolled].map(|rate: f64| rate + 1e-9 * f64::from(period));
        let mut readings = level(AHEAD, &wheels);
        (readings.hinges_rad, readings.hinges_rad_s) = (&angles, &rates);
        sample = traction.step(&mut state, &readings, &TractionTarget::at(0.3));
    }
    assert!(
        sample.slip_rad_s.iter().all(|slip| slip.abs() < 1e-6),
        "{:?}",
        sample.slip_rad_s
    );
    assert!((sample.speed_m_s - 0.3).abs() < 1e-6);
}

#[test]
fn a_gyros_zero_is_found_while_driving() {
    let (traction, mut state, mut plant) = (preset(), TractionState::new(), Plant::new(10.0));
    let mut imu = Imu::level();
    imu.rate_rad_s[2] = 0.02;
    let mut sample = TractionSample::zero();
    for _ in 0..6000 {
        let mut readings = level(AHEAD, &plant.rate_rad_s);
        readings.imu = imu;
        sample = traction.step(&mut state, &readings, &TractionTarget::at(0.3));
        plant.step(&sample.wheels.applied.n_m);
        // Nothing turns this plant: its transverse wheels stand.
        (plant.rate_rad_s[1], plant.rate_rad_s[5]) = (0.0, 0.0);
    }
    // A mean over up to 2 s: three time constants leave 5 %.
    assert!(
        (sample.gyro_zero_rad_s - 0.02).abs() < 0.001,
        "{}",
        sample.gyro_zero_rad_s
    );
}

#[test]
fn without_an_inertial_unit_the_wheels_say_how_the_vehicle_turns() {
    let (traction, mut state) = (preset(), TractionState::new());
    let turning = BodyTwist {
        wz_rad_s: 0.5,
        ..AHEAD
    };
    let rates = traction.kinematics().inverse(&turning).rad_s;
    let mut readings = level(turning, &rates);
    readings.imu = Imu::silent();
    let mut sample = TractionSample::zero();
    for _ in 0..300 {
        sample = traction.step(&mut state, &readings, &TractionTarget::at(0.3));
    }
    assert!((sample.yaw_rad_s - 0.5).abs() < 1e-12); // thirty time constants of its filter
}

#[test]
fn whole_counts_give_a_steady_rate_and_a_stop() {
    for counts in [32.0, 128.0, 512.0, 4096.0, 65536.0] {
        let count = core::f64::consts::TAU / counts;
        let best_s = window_s(count);
        let (mut state, mut angle) = (EncoderState::new(), 0.0_f64);
        let mut read = |rate: f64, periods: usize| {
            let mut last = Vec::new();
            for _ in 0..periods {
                let before = (angle / count).floor();
                angle += rate * T;
                let read_rad_s = ((angle / count).floor() - before) * count / T;
                last.push(state.step(read_rad_s, count, best_s, T));
            }
            last
        };
        let steady = read(4.5, 1500);
        // Half a count over the window that fits it, and what a period of jitter makes of the time between two counts.
        let rough = 0.5 * count / best_s;
        let worst = steady[1000..]
            .iter()
            .map(|rate| (rate - 4.5).abs())
            .fold(0.0, f64::max);
        assert!(worst < rough + 0.05 * 4.5, "{counts}: {worst} rad/s, {rough}");
        let stopped = read(0.0, 1500);
        // Falls as window over time from when the next count is overdue, or as a count over time if that is longer.
        assert!(
            stopped[1499].abs() < count.max(4.5 * best_s) / 1.5,
            "{counts}: {}",
            stopped[1499]
        );
    }
}

fn supervisor(config: SupervisorConfig<f64>) -> Supervisor<f64, 7> {
    Supervisor::new(&PLACES, config).expect("valid")
}

/// What the supervisor reads of a vehicle whose rows stand so high, front first \[m\], going at so
/// many m/s with so much thrust.
fn seen(heights: [f64; 3], speed_m_s: f64, thrust: f64) -> TractionState<f64, 7> {
    let (traction, mut state) = (preset(), TractionState::new());
    traction.command(&mut state, &AHEAD);
    state.motion.height_m = [2, 2, 2, 1, 0, 0, 0].map(|row: usize| heights[row]);
    (state.speed_m_s, state.thrust_n_m, state.largest_motor_n_m) = (speed_m_s, thrust * LIMIT_N_M, LIMIT_N_M);
    state
}

fn policy() -> TractionPolicy<f64, 7> {
    let any = AxisLimits::unlimited();
    let limiter = TwistLimiter::new(
        TwistLimits::PerAxis {
            vx: any,
            vy: any,
            wz: any,
        },
        T,
    )
    .expect("valid");
    TractionPolicy::new(
        limiter,
        supervisor(SupervisorConfig::traction_runup(T)),
        seven(TractionConfig::traction_runup(0.3, 2.0, T)),
    )
}

fn anything() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -20.0..20.0_f64,
        1 => prop::num::f64::ANY,
        1 => Just(f64::NAN),
    ]
}

proptest! {
    #[test]
    fn whatever_sensors_say_torques_are_limited_and_a_good_reading_is_controlled_again(
        rows in prop::collection::vec((prop::array::uniform7(anything()), prop::array::uniform4(anything()), prop::array::uniform5(anything())), 1..40),
    ) {
        let mut policy = policy();
        for (wheels, hinges, imu) in &rows {
            let mut readings = level(AHEAD, wheels);
            (readings.hinges_rad, readings.hinges_rad_s) = (&hinges[..2], &hinges[2..]);
            readings.imu.rate_rad_s = [imu[0], imu[1], imu[2]];
            (readings.imu.pitch_rad, readings.imu.roll_rad) = (imu[3], imu[4]);
            let mut torques = [0.0; 7];
            policy.step(&readings, &mut torques);
            for (torque, wheel) in torques.iter().zip(wheels) {
                prop_assert!(torque.abs() <= LIMIT_N_M, "{torques:?}");
                prop_assert!(!wheel.is_nan() || *torque == 0.0); // released
            }
        }
        let mut torques = [0.0; 7];
        for _ in 0..3 {
            policy.step(&level(AHEAD, &[0.0; 7]), &mut torques);
        }
        prop_assert!(torques.iter().all(|torque| torque.is_finite()));
        prop_assert!(policy.sample().speed_m_s.is_finite());
    }

    #[test]
    fn driven_the_other_way_round_it_is_its_mirror(rates in prop::array::uniform7(-8.0..8.0_f64)) {
        let traction = preset();
        let step = |sign: f64| {
            let mut state = TractionState::new();
            let command = BodyTwist { vx_m_s: sign * 0.3, ..BodyTwist::ZERO };
            let measured = rates.map(|rate| sign * rate);
            let readings = level(command, &measured);
            traction.step(&mut state, &readings, &TractionTarget::at(0.3)).wheels.applied.n_m.map(|t| sign * t)
        };
        let (ahead, back) = (step(1.0), step(-1.0));
        for (a, b) in ahead.iter().zip(back) {
            prop_assert!((a - b).abs() < 1e-12, "{ahead:?} {back:?}");
        }
    }
}

#[test]
fn what_the_ground_takes_along_the_thrust_is_taken_over_by_the_next_direction() {
    let (traction, mut state) = (preset(), TractionState::new());
    let command = |vx_m_s: f64, vy_m_s: f64| BodyTwist {
        vx_m_s,
        vy_m_s,
        wz_rad_s: 0.0,
    };
    let rates = [1.0, 0.0, -1.0, 1.0, 1.0, 0.0, -1.0];
    let mut step = |command: BodyTwist<f64>, rates: [f64; 7]| {
        let readings = level(command, &rates);
        traction.command(&mut state, &command);
        let contact = state.wheels.map(|wheel| wheel.contact_n_m);
        let sample = traction.step(&mut state, &readings, &TractionTarget::at(0.3));
        assert_eq!(sample.wheels.reference, traction.kinematics().inverse(&command));
        contact
    };
    let mut ahead = [0.0; 7];
    for _ in 0..200 {
        // Held up at 0.07 m/s: traction control after 0.15 s.
        ahead = step(command(0.3, 0.0), rates);
    }
    assert!(ahead[4] > 0.1 && ahead[6] < -0.1, "{ahead:?}");
    let last = step(command(0.3, 0.0), rates);
    // Backwards the same wheels push the other way; knowledge of the transverse wheels remains.
    let back = step(command(-0.3, 0.0), rates);
    assert!(
        back[4] < -0.1 && back[6] > 0.1 && back[3] < -0.1,
        "{back:?} {last:?}"
    );
    let sideways = step(command(0.0, 0.3), rates);
    assert_eq!((sideways[1], sideways[5]), (0.0, 0.0));
}

#[test]
fn a_reset_policy_is_a_fresh_one_and_a_restored_one_goes_on() {
    let (mut one, fresh) = (policy(), policy());
    let mut torques = [0.0; 7];
    for _ in 0..50 {
        one.step(
            &level(AHEAD, &[1.0, 0.0, -1.0, 2.0, 1.0, 0.0, -1.0]),
            &mut torques,
        );
    }
    let mut other = policy();
    other.restore(*one.state());
    let readings = level(AHEAD, &[2.0, 0.0, -1.0, 2.0, 1.0, 0.0, -1.0]);
    one.step(&readings, &mut torques);
    other.step(&readings, &mut torques);
    assert_eq!(one.sample().wheels.applied, other.sample().wheels.applied);
    one.reset();
    assert_eq!(one, fresh);
}

#[test]
fn what_is_out_of_range_is_refused_by_name() {
    let build = |change: fn(&mut TractionConfig<f64>)| {
        let mut config = TractionConfig::traction(0.3, 2.0, T);
        change(&mut config);
        let traction = preset();
        Traction::new(traction.kinematics, traction.linkage, wheels(PLACES), config)
            .map(|_| ())
            .expect_err("refused")
            .parameter
    };
    assert_eq!(build(|c| c.slip_s = 0.0), "slip_s");
    assert_eq!(build(|c| c.sensors.delay_s = 0.031), "delay_s");
    assert_eq!(build(|c| c.sensors.lag_s = -1e-9), "lag_s");
    assert_eq!(
        build(|c| c.sensors.encoder_noise_rad_s = f64::NAN),
        "encoder_noise_rad_s"
    );
    assert_eq!(build(|c| c.levelling_from = 1.0), "levelling_from");
    assert_eq!(
        build(|c| c.thrust_gain_n_m_s_rad = f64::NAN),
        "thrust_gain_n_m_s_rad"
    );
    assert_eq!(build(|c| c.period_s = 0.0), "period_s");
    let mut heavy = wheels(PLACES);
    heavy[6].inertia_kg_m2 = 0.0;
    let traction = preset();
    let error =
        Traction::new(traction.kinematics, traction.linkage, heavy, traction.config).expect_err("refused");
    assert_eq!((error.parameter, error.index), ("inertia_kg_m2", Some(6)));
}
