//! The task on wheels that exist in memory: each motor turns a flywheel that its encoder counts.

use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;
use std::vec::Vec;

use embedded_can::{ErrorKind, Id, StandardId};
use embedded_hal::{digital, pwm};

use super::*;
use crate::constants::{COMMAND_TIMEOUT_S, MOTORS, PERIOD_US};
use crate::frames::{COMMAND, Command};

/// As in the scenario.
const COUNTS_PER_TURN: u32 = 60_000;
const MAX_DUTY: u16 = 8400;
const PERIOD_S: f32 = PERIOD_US as f32 * 1e-6;
/// What a wheel of the vehicle feels of its mass \[kg.m^2\], as in the vehicle file.
const INERTIA_KG_M2: f64 = 0.019;
const AHEAD: BodyTwist<f32> = BodyTwist {
    vx_m_s: 0.5,
    vy_m_s: 0.0,
    wz_rad_s: 0.0,
};

#[derive(Debug, Default)]
struct Wheel {
    duty: u16,
    forward: bool,
    enabled: bool,
    turns: f64,
    velocity_rad_s: f64,
    blocked: bool,
    encoder_fails: bool,
    /// Turns a period that the encoder reports, whatever the wheel does.
    stuck_at_turns: Option<f64>,
    reported_turns: f64,
    motor_fails: bool,
}

impl Wheel {
    fn turn(&mut self) {
        let duty = f64::from(self.duty) / f64::from(MAX_DUTY) * if self.forward { 1.0 } else { -1.0 };
        // All wheels have the same motor.
        let [stall, at_one_rad_s] = [0.0, 1.0].map(|velocity| f64::from(MOTORS[0].range(velocity).upper_n_m));
        let slope = stall - at_one_rad_s;
        if self.enabled {
            let torque = stall * duty - slope * self.velocity_rad_s;
            self.velocity_rad_s += torque / INERTIA_KG_M2 * f64::from(PERIOD_S);
        }
        if self.blocked {
            self.velocity_rad_s = 0.0;
        }
        let turned = self.velocity_rad_s * f64::from(PERIOD_S) / core::f64::consts::TAU;
        self.turns += turned;
        self.reported_turns += self.stuck_at_turns.unwrap_or(turned);
    }
}

type Shared<T> = Rc<RefCell<T>>;

#[derive(Debug)]
struct Failure;

impl pwm::Error for Failure {
    fn kind(&self) -> pwm::ErrorKind {
        pwm::ErrorKind::Other
    }
}

impl digital::Error for Failure {
    fn kind(&self) -> digital::ErrorKind {
        digital::ErrorKind::Other
    }
}

struct Pwm(Shared<Wheel>);

impl pwm::ErrorType for Pwm {
    type Error = Failure;
}

impl SetDutyCycle for Pwm {
    fn max_duty_cycle(&self) -> u16 {
        MAX_DUTY
    }

    fn set_duty_cycle(&mut self, duty: u16) -> Result<(), Failure> {
        assert!(duty <= MAX_DUTY);
        self.0.borrow_mut().duty = duty;
        Ok(())
    }
}

enum Pin {
    Direction(Shared<Wheel>),
    Enable(Shared<Wheel>),
}

impl Pin {
    fn set(&self, high: bool) -> Result<(), Failure> {
        match self {
            Self::Direction(wheel) if wheel.borrow().motor_fails => return Err(Failure),
            Self::Direction(wheel) => wheel.borrow_mut().forward = high,
            Self::Enable(wheel) => wheel.borrow_mut().enabled = high,
        }
        Ok(())
    }
}

impl digital::ErrorType for Pin {
    type Error = Failure;
}

impl OutputPin for Pin {
    fn set_low(&mut self) -> Result<(), Failure> {
        self.set(false)
    }

    fn set_high(&mut self) -> Result<(), Failure> {
        self.set(true)
    }
}

struct Counter(Shared<Wheel>);

impl Encoder for Counter {
    type Error = Failure;

    fn count(&mut self) -> Result<u16, Failure> {
        let wheel = self.0.borrow();
        if wheel.encoder_fails {
            return Err(Failure);
        }
        Ok((wheel.reported_turns * f64::from(COUNTS_PER_TURN))
            .floor()
            .rem_euclid(65_536.0) as u16)
    }
}

#[derive(Clone, Debug)]
struct Message {
    id: Id,
    remote: bool,
    data: Vec<u8>,
}

impl Frame for Message {
    fn new(id: impl Into<Id>, data: &[u8]) -> Option<Self> {
        (data.len() <= 8).then(|| Self {
            id: id.into(),
            remote: false,
            data: data.to_vec(),
        })
    }

    fn new_remote(id: impl Into<Id>, dlc: usize) -> Option<Self> {
        (dlc <= 8).then(|| Self {
            id: id.into(),
            remote: true,
            data: Vec::new(),
        })
    }

    fn is_extended(&self) -> bool {
        matches!(self.id, Id::Extended(_))
    }

    fn is_remote_frame(&self) -> bool {
        self.remote
    }

    fn id(&self) -> Id {
        self.id
    }

    fn dlc(&self) -> usize {
        self.data.len()
    }

    fn data(&self) -> &[u8] {
        &self.data
    }
}

#[derive(Default)]
struct Bus {
    to_vehicle: VecDeque<Message>,
    from_vehicle: Vec<Message>,
    full: bool,
    fails: bool,
}

struct Controller(Shared<Bus>);

impl Can for Controller {
    type Frame = Message;
    type Error = ErrorKind;

    fn transmit(&mut self, frame: &Message) -> nb::Result<Option<Message>, ErrorKind> {
        let mut bus = self.0.borrow_mut();
        if bus.fails {
            return Err(nb::Error::Other(ErrorKind::Acknowledge));
        }
        if bus.full {
            return Err(nb::Error::WouldBlock);
        }
        bus.from_vehicle.push(frame.clone());
        Ok(None)
    }

    fn receive(&mut self) -> nb::Result<Message, ErrorKind> {
        let mut bus = self.0.borrow_mut();
        if bus.fails {
            return Err(nb::Error::Other(ErrorKind::Form));
        }
        bus.to_vehicle.pop_front().ok_or(nb::Error::WouldBlock)
    }
}

struct Vehicle {
    wheels: [Shared<Wheel>; WHEELS],
    bus: Shared<Bus>,
    task: ControlTask<Pwm, Pin, Counter, Controller>,
    counter: u8,
}

impl Vehicle {
    /// As it is switched on.
    fn new() -> Self {
        let wheels: [Shared<Wheel>; WHEELS] = Default::default();
        let bus = Shared::<Bus>::default();
        let motors = wheels.each_ref().map(|w| {
            let (direction, enable) = (Pin::Direction(w.clone()), Pin::Enable(w.clone()));
            MotorDriver::new(MOTORS[0], Pwm(w.clone()), direction, enable)
        });
        let encoders = wheels.each_ref().map(|w| Counter(w.clone()));
        let task = ControlTask::new(motors, encoders, Controller(bus.clone()));
        Self {
            wheels,
            bus,
            task,
            counter: 0,
        }
    }

    /// Released, with a first velocity measured.
    fn ready() -> Self {
        let mut vehicle = Self::new();
        vehicle.period(None);
        vehicle.period(Some(BodyTwist::ZERO));
        vehicle
    }

    fn send(&mut self, data: &[u8]) {
        let frame = Message::new(COMMAND, data).expect("8 bytes at most");
        self.bus.borrow_mut().to_vehicle.push_back(frame);
    }

    fn period(&mut self, twist: Option<BodyTwist<f32>>) -> Status {
        if let Some(twist) = twist {
            self.counter = self.counter.wrapping_add(1);
            let counter = self.counter;
            self.send(&frames::command_bytes(&Command { twist, counter }));
        }
        let status = self.task.step();
        self.wheels.iter().for_each(|w| w.borrow_mut().turn());
        status
    }

    /// With `twist` commanded every 10 ms.
    fn drive(&mut self, twist: BodyTwist<f32>, periods: u32) -> Status {
        for k in 0..periods {
            self.period((k % 10 == 0).then_some(twist));
        }
        self.task.status
    }

    fn velocities(&self) -> [f64; WHEELS] {
        self.wheels.each_ref().map(|w| w.borrow().velocity_rad_s)
    }

    fn no_torque(&self) -> bool {
        self.wheels
            .iter()
            .all(|w| !w.borrow().enabled && w.borrow().duty == 0)
    }

    /// Every wheel within `margin_rad_s` of what the twist asks of it.
    fn follows(&self, twist: &BodyTwist<f32>, margin_rad_s: f64) -> bool {
        let wanted = CONTROLLER.kinematics().inverse(twist).rad_s;
        let each = self.velocities().into_iter().zip(wanted);
        each.fold(true, |all, (v, r)| all && (v - f64::from(r)).abs() < margin_rad_s)
    }
}

/// An encoder count in a period, in rad/s: no loop is smoother than its sensor.
const COUNT_RAD_S: f64 = core::f64::consts::TAU / (COUNTS_PER_TURN as f64 * 1e-3);

#[test]
fn wheels_follow_the_command() {
    let mut vehicle = Vehicle::ready();
    let twist = BodyTwist {
        vx_m_s: 0.4,
        vy_m_s: -0.2,
        wz_rad_s: 0.5,
    };
    let status = vehicle.drive(twist, 2000);
    assert_eq!((status.mode, status.driven), (Mode::Driving, [true; 4]));
    assert_eq!((status.ignored, status.hardware_errors), (0, 0));
    assert!(vehicle.follows(&twist, COUNT_RAD_S), "{:?}", vehicle.velocities());
}

#[test]
fn a_lost_command_stops_the_vehicle() {
    let mut vehicle = Vehicle::ready();
    vehicle.drive(AHEAD, 2000);
    // The last command came 9 periods ago.
    let timeout_periods = (COMMAND_TIMEOUT_S / PERIOD_S).round() as u32;
    let held = (0..)
        .take_while(|_| vehicle.period(None).mode == Mode::Driving)
        .count() as u32;
    assert_eq!(held, timeout_periods - 9);
    assert!(
        vehicle.follows(&AHEAD, 2.0 * COUNT_RAD_S),
        "{:?}",
        vehicle.velocities()
    );
    // 0.5 m/s at 1.5 m/s^2; then five of the loops' time constants of 127 ms leave 1 % of 7 rad/s.
    for _ in 0..334 + 5 * 127 {
        assert_eq!(vehicle.period(None).mode, Mode::TimedOut);
    }
    assert!(
        vehicle.follows(&BodyTwist::ZERO, COUNT_RAD_S),
        "{:?}",
        vehicle.velocities()
    );
    // It goes on at the next command.
    assert_eq!(vehicle.drive(AHEAD, 2000).mode, Mode::Driving);
    assert!(vehicle.follows(&AHEAD, COUNT_RAD_S));
}

#[test]
fn a_command_that_is_not_a_number_is_ignored_and_counted() {
    let mut vehicle = Vehicle::ready();
    let broken = BodyTwist {
        vy_m_s: f32::NAN,
        ..AHEAD
    };
    let still = vehicle.drive(broken, 500);
    assert_eq!((still.ignored, still.mode), (50, Mode::TimedOut));
    assert!(vehicle.follows(&BodyTwist::ZERO, COUNT_RAD_S));
    // Nor does it take the place of a good one that came in the same period.
    vehicle.period(Some(AHEAD));
    vehicle.send(&frames::command_bytes(&Command {
        twist: broken,
        counter: 200,
    }));
    assert_eq!(vehicle.period(None).mode, Mode::Driving);
    assert_eq!(vehicle.period(None).ignored, 51);
}

#[test]
fn malformed_frames_are_ignored_and_counted() {
    let mut vehicle = Vehicle::ready();
    let good = frames::command_bytes(&Command {
        twist: AHEAD,
        counter: 100,
    });
    for length in 0..8 {
        vehicle.send(&good[..length]);
    }
    assert_eq!(vehicle.period(None).ignored, 8);
    let mut reserved = good;
    reserved[7] = 1;
    vehicle.send(&reserved);
    let remote = Message::new_remote(COMMAND, 8).expect("8 bytes at most");
    vehicle.bus.borrow_mut().to_vehicle.push_back(remote);
    assert_eq!(vehicle.period(None).ignored, 10);
    // What is for others is not counted.
    let other = Message::new(StandardId::ZERO, &good).expect("8 bytes");
    vehicle.bus.borrow_mut().to_vehicle.push_back(other);
    assert_eq!(vehicle.period(None).ignored, 10);
    assert!(vehicle.follows(&BodyTwist::ZERO, COUNT_RAD_S));
}

#[test]
fn a_sender_that_hangs_is_a_lost_command() {
    let mut vehicle = Vehicle::ready();
    let frame = frames::command_bytes(&Command {
        twist: AHEAD,
        counter: 100,
    });
    for _ in 0..1000 {
        vehicle.send(&frame);
        vehicle.period(None);
    }
    assert_eq!(
        (vehicle.task.status.mode, vehicle.task.status.ignored),
        (Mode::TimedOut, 999)
    );
    assert!(vehicle.follows(&BodyTwist::ZERO, COUNT_RAD_S));
}

#[test]
fn duty_saturates_at_a_blocked_wheel_in_both_directions() {
    let mut vehicle = Vehicle::ready();
    vehicle.wheels.iter().for_each(|w| w.borrow_mut().blocked = true);
    for (ahead_m_s, forward) in [
        (0.5, [false, false, true, true]),
        (-0.5, [true, true, false, false]),
    ] {
        let twist = BodyTwist {
            vx_m_s: ahead_m_s,
            ..AHEAD
        };
        vehicle.drive(twist, 3000);
        for (wheel, forward) in vehicle.wheels.iter().zip(forward) {
            let wheel = wheel.borrow();
            assert_eq!(
                (wheel.duty, wheel.forward, wheel.enabled),
                (MAX_DUTY, forward, true)
            );
        }
    }
}

#[test]
fn nothing_moves_until_a_command_to_stand_still() {
    let mut vehicle = Vehicle::new();
    assert_eq!(vehicle.drive(AHEAD, 500).mode, Mode::Held);
    assert!(vehicle.no_torque() && vehicle.velocities() == [0.0; 4]);
    vehicle.period(Some(BodyTwist::ZERO));
    assert_eq!(vehicle.drive(AHEAD, 2000).mode, Mode::Driving);
    assert!(vehicle.follows(&AHEAD, COUNT_RAD_S));
}

#[test]
fn a_motor_that_fails_lets_all_wheels_go_until_a_command_to_stand_still() {
    let mut vehicle = Vehicle::ready();
    vehicle.drive(AHEAD, 1000);
    vehicle.wheels[2].borrow_mut().motor_fails = true;
    let status = vehicle.period(None);
    assert_eq!((status.mode, status.hardware_errors), (Mode::Held, 1));
    assert_eq!((status.driven, status.torque_n_m), ([false; 4], [0.0; 4]));
    assert!(vehicle.no_torque());
    vehicle.wheels[2].borrow_mut().motor_fails = false; // a loose contact
    assert_eq!(vehicle.drive(AHEAD, 100).mode, Mode::Held);
    assert!(vehicle.no_torque());
    vehicle.period(Some(BodyTwist::ZERO));
    assert_eq!(vehicle.drive(AHEAD, 2000).mode, Mode::Driving);
    assert!(vehicle.follows(&AHEAD, COUNT_RAD_S));
}

#[test]
fn a_wheel_whose_encoder_fails_is_released_and_the_others_drive_on() {
    let mut vehicle = Vehicle::ready();
    vehicle.drive(AHEAD, 1000);
    vehicle.wheels[0].borrow_mut().encoder_fails = true;
    let status = vehicle.drive(AHEAD, 100);
    assert_eq!(
        (status.mode, status.driven),
        (Mode::Driving, [false, true, true, true])
    );
    assert_eq!((status.hardware_errors, status.torque_n_m[0]), (100, 0.0));
    assert!(!vehicle.wheels[0].borrow().enabled && vehicle.wheels[1].borrow().enabled);
    vehicle.wheels[0].borrow_mut().encoder_fails = false;
    // The counts of a tenth of a second, over that time: the wheel has rolled on.
    let status = vehicle.period(None);
    assert!(status.driven[0]);
    let rolling = vehicle.velocities()[0];
    assert!(
        (f64::from(status.velocity_rad_s[0]) - rolling).abs() < 0.01 * rolling.abs(),
        "{rolling}, {status:?}"
    );
}

#[test]
fn torque_ends_and_bridges_open_although_an_encoder_is_stuck_at_speed() {
    let mut vehicle = Vehicle::ready();
    vehicle.drive(AHEAD, 1000);
    let turning = vehicle.velocities()[0] * f64::from(PERIOD_S) / core::f64::consts::TAU;
    vehicle.wheels[0].borrow_mut().stuck_at_turns = Some(turning);
    // 0.5 m/s at 1.5 m/s^2, and then the half second in which torques fall to 0.
    let stop_periods = 334 + 500;
    let last_driven = (0..2 * stop_periods)
        .filter(|k| {
            let command = (k % 10 == 0).then_some(BodyTwist::ZERO);
            vehicle.period(command).driven != [false; 4]
        })
        .last();
    // The last of as many, but for a period that the ramp may be shorter or longer by its rounding.
    assert!(
        last_driven.is_some_and(|last| (stop_periods - 2..=stop_periods).contains(&last)),
        "{last_driven:?}"
    );
    assert!(vehicle.no_torque());
    // The bridge is open, and not at the duty for no torque at the stuck velocity.
    assert_eq!(vehicle.task.status.torque_n_m, [0.0; 4]);
    assert!(vehicle.task.status.velocity_rad_s[0].abs() > 5.0);
    // A command drives again.
    vehicle.wheels[0].borrow_mut().stuck_at_turns = None;
    assert_eq!(vehicle.drive(AHEAD, 10).driven, [true; 4]);
}

#[test]
fn a_bus_that_fails_is_a_lost_command() {
    let mut vehicle = Vehicle::ready();
    vehicle.drive(AHEAD, 1000);
    vehicle.bus.borrow_mut().fails = true;
    let status = vehicle.drive(AHEAD, 1000);
    assert_eq!((status.mode, status.hardware_errors), (Mode::TimedOut, 1000));
    assert!(vehicle.follows(&BodyTwist::ZERO, COUNT_RAD_S));
}

#[test]
fn reports_say_what_the_wheels_do() {
    let mut vehicle = Vehicle::ready();
    vehicle.drive(AHEAD, 998);
    let sent = vehicle.bus.borrow().from_vehicle.clone();
    assert_eq!(sent.len(), 3 * 100); // 1000 periods
    let [torques, velocities, status] = &sent[297..] else {
        panic!("three frames")
    };
    assert_eq!(
        [torques.id, velocities.id, status.id],
        [0x180, 0x181, 0x182].map(|id| { Id::Standard(StandardId::new(id).expect("11 bits")) })
    );
    assert_eq!(status.data, [1, 0b1111, 0, 0, 0, 0, 100, 0]);
    let now = vehicle.task.status;
    for (frame, values, per_unit) in [
        (torques, now.torque_n_m, 1000.0),
        (velocities, now.velocity_rad_s, 100.0),
    ] {
        for (bytes, value) in frame.data.chunks_exact(2).zip(values) {
            let sent = f32::from(i16::from_le_bytes([bytes[0], bytes[1]])) / per_unit;
            // Rounded to the nearest, and the rounding of f32.
            assert!((sent - value).abs() < 0.501 / per_unit, "{sent}, {value}");
        }
    }
}

#[test]
fn a_bus_without_room_disturbs_nothing() {
    let mut vehicle = Vehicle::ready();
    vehicle.bus.borrow_mut().full = true;
    let status = vehicle.drive(AHEAD, 2000);
    assert_eq!((status.mode, status.hardware_errors), (Mode::Driving, 0));
    assert!(vehicle.follows(&AHEAD, COUNT_RAD_S));
}
