//! A board that misbehaves: its supply sags, its timer runs at another rate, a period comes late, its watchdog bites.
//! The figures are those of docs/misbehaving-board.md.

use omni_core::estimate::{Encoder, EncoderConfig, EncoderState, VelocityMethod};
use omni_core::motor::TorqueRange;
use omni_core::shaping::{MotionLimits, Restart, TwistLimits};
use omni_core::{
    BodyTwist, Coordination, Drive, DriveConfig, DriveInput, DriveState, Kinematics, WheelVelocities,
};
use omni_core::{PidConfig, PidGains, TorqueLimit, WheelControlConfig, WheelLayout};

/// What the drive takes for its period \[s\].
const PERIOD_S: f64 = 0.005;
const STALL_N_M: f64 = 2.38;
const SLOPE_N_M_S_RAD: f64 = 0.073;
const COUNTS: f64 = 537.7;
/// Vehicle of 9.6 kg with four mecanum wheels of 97 mm: mass along x and y \[kg\], inertia about z
/// \[kg.m^2\]. The floor takes 4 N of each wheel.
const INERTIA: [f64; 3] = [9.6, 9.6, 0.5];
const FRICTION_N_M: f64 = 0.1;
const WANTED: BodyTwist<f64> = BodyTwist {
    vx_m_s: 0.8,
    vy_m_s: 0.3,
    wz_rad_s: 0.0,
};

/// What the board does with a brown-out.
#[derive(Clone, Copy, PartialEq)]
enum Supply {
    Ignored,
    /// Its voltage is measured: duties are of it, and the torque ranges are narrower.
    Measured,
}

/// How long a period is taken for.
#[derive(Clone, Copy, PartialEq)]
enum Clock {
    Trusted,
    Measured,
}

struct Board {
    drive: Drive<f64, 4>,
    state: DriveState<f64, 4>,
    encoder: Encoder<f64>,
    encoders: [EncoderState<f64>; 4],
    motor: TorqueLimit<f64>,
    inverse: [[f64; 3]; 4],
    twist: [f64; 3],
    turned: [f64; 4],
    /// Of the last step: none where the bridges are open.
    duties: [Option<f64>; 4],
    read: BodyTwist<f64>,
    odometry_m: f64,
    way_m: f64,
    integral: f64,
    /// The largest error of a reading \[rad/s\].
    off: f64,
}

impl Board {
    fn new(velocity: VelocityMethod<f64>) -> Self {
        let layout = WheelLayout::mecanum4(0.22, 0.26, 0.0485).expect("valid");
        let gains = PidGains {
            kp_n_m_s_rad: 0.1,
            ki_n_m_rad: 1.0,
            kd_n_m_s2_rad: 0.0,
        };
        let motor = TorqueLimit::line(STALL_N_M, SLOPE_N_M_S_RAD).expect("valid");
        let control = WheelControlConfig {
            pid: PidConfig::new(gains, PERIOD_S),
            limits: [motor; 4],
            coordination: Coordination::scale_references(),
        };
        let mut config = DriveConfig::new(layout, control);
        let limits = MotionLimits {
            acceleration: 1.5,
            deceleration: 3.0,
            ..MotionLimits::unlimited()
        };
        config.shaping.limits = TwistLimits::AlongMotion {
            linear: limits,
            yaw: limits,
        };
        config.shaping.timeout_s = Some(0.2);
        config.shaping.restart = Restart::Neutral;
        let drive = Drive::new(config).expect("valid");
        let encoder = EncoderConfig {
            counts_per_turn: COUNTS,
            bits: 16,
            velocity,
            period_s: PERIOD_S,
        };
        Self {
            inverse: *Kinematics::new(&layout).expect("valid").inverse_matrix(),
            state: DriveState::new(&drive),
            drive,
            encoder: Encoder::new(encoder).expect("valid"),
            encoders: [EncoderState::at_rest(); 4],
            motor,
            twist: [0.0; 3],
            turned: [0.0; 4],
            duties: [None; 4],
            read: BodyTwist::ZERO,
            odometry_m: 0.0,
            way_m: 0.0,
            integral: 0.0,
            off: 0.0,
        }
    }

    fn velocities(&self) -> [f64; 4] {
        self.inverse
            .map(|row| row.iter().zip(self.twist).map(|(a, v)| a * v).sum())
    }

    /// The world goes on for a time, by the duties that are there, with a part of the supply.
    fn pass(&mut self, time_s: f64, supply: f64) {
        let steps = (time_s / 1e-4).round() as usize;
        for _ in 0..steps {
            let dt = time_s / steps as f64;
            let velocities = self.velocities();
            let mut force = [0.0; 3];
            for i in 0..4 {
                let motor = self.duties[i].map_or(0.0, |duty| {
                    supply * STALL_N_M * duty - SLOPE_N_M_S_RAD * velocities[i]
                });
                let torque = motor - FRICTION_N_M * (velocities[i] / 0.05).clamp(-1.0, 1.0);
                for axis in 0..3 {
                    force[axis] += self.inverse[i][axis] * torque;
                }
                self.turned[i] += velocities[i] * dt;
            }
            for axis in 0..3 {
                self.twist[axis] += force[axis] / INERTIA[axis] * dt;
            }
            self.way_m += self.twist[0].hypot(self.twist[1]) * dt;
        }
    }

    /// One step of the drive, `late_s` after the one before.
    fn step(&mut self, command: Option<BodyTwist<f64>>, late_s: f64, clock: Clock, supply: (f64, Supply)) {
        let mut input = DriveInput::measured(&WheelVelocities::zero());
        input.command = command;
        let velocities = self.velocities();
        for i in 0..4 {
            let raw = (self.turned[i] / std::f64::consts::TAU * COUNTS).floor() as i64 as u16;
            let state = &mut self.encoders[i];
            let read = match clock {
                Clock::Trusted => self.encoder.step(state, Some(raw.into()), None),
                Clock::Measured => Some(self.encoder.step_after(state, raw.into(), late_s, None)),
            };
            self.off = self.off.max((read.unwrap_or(0.0) - velocities[i]).abs());
            input.readings_rad_s[i] = read;
        }
        let (part, seen) = supply;
        let part = if seen == Supply::Measured { part } else { 1.0 };
        if seen == Supply::Measured {
            for i in 0..4 {
                let back = SLOPE_N_M_S_RAD * input.readings_rad_s[i].unwrap_or(0.0);
                let range = TorqueRange {
                    lower_n_m: -STALL_N_M * part - back,
                    upper_n_m: STALL_N_M * part - back,
                };
                input.torque_ranges.set(i, &range);
            }
        }
        let before = self.state.odometry.pose();
        let sample = self.drive.step(&mut self.state, &input);
        self.odometry_m += (sample.pose.x_m - before.x_m).hypot(sample.pose.y_m - before.y_m);
        self.read = sample.slip.estimated;
        self.integral = self
            .state
            .control
            .integral_n_m
            .iter()
            .fold(0.0, |most, i| most.max(i.abs()));
        for i in 0..4 {
            let duty = self
                .motor
                .duty(sample.wheels.applied.n_m[i], sample.wheels.measured.rad_s[i])
                / part;
            self.duties[i] = match (sample.brake[i], sample.wheels.active[i]) {
                (true, _) => Some(0.0),
                (_, true) => Some(duty.clamp(-1.0, 1.0)),
                _ => None,
            };
        }
    }

    fn speed(&self) -> f64 {
        self.twist[0].hypot(self.twist[1])
    }

    /// How far the motion points away from the command \[degrees\].
    fn course(&self) -> f64 {
        let wanted = WANTED.vy_m_s.atan2(WANTED.vx_m_s);
        (self.twist[1].atan2(self.twist[0]) - wanted).to_degrees().abs()
    }
}

/// On the way for `time_s` with periods of `periods_s` in turn; how far off its course it was at most \[degrees\].
fn drive(board: &mut Board, time_s: f64, periods_s: &[f64], clock: Clock, supply: (f64, Supply)) -> f64 {
    let (mut now, mut k, mut course) = (0.0, 0, 0.0_f64);
    while now < time_s {
        let dt = periods_s[k % periods_s.len()];
        board.pass(dt, supply.0);
        board.step(Some(WANTED), dt, clock, supply);
        (now, k) = (now + dt, k + 1);
        if now > 0.3 {
            course = course.max(board.course());
        }
    }
    course
}

const FULL: (f64, Supply) = (1.0, Supply::Ignored);

/// Switched on, the stick at rest for once.
fn board(velocity: VelocityMethod<f64>) -> Board {
    let mut board = Board::new(velocity);
    board.step(Some(BodyTwist::ZERO), PERIOD_S, Clock::Trusted, FULL);
    board
}

fn observer() -> VelocityMethod<f64> {
    VelocityMethod::Observer {
        bandwidth_rad_s: 60.0,
    }
}

/// The figure is what the page says, to the digits that it gives.
fn is(figure: f64, stated: f64, digit: f64) {
    assert!((figure - stated).abs() <= digit, "{figure}, stated: {stated}");
}

#[test]
fn a_sagging_supply_costs_speed_and_the_loops_know_it_only_where_it_is_measured() {
    for (supply, speed, course, integral) in [
        (FULL, 0.85, 0.2, 0.10),
        ((0.55, Supply::Ignored), 0.62, 1.1, 1.17),
        ((0.55, Supply::Measured), 0.62, 0.3, 0.10),
    ] {
        let mut board = board(observer());
        let off = drive(&mut board, 3.0, &[PERIOD_S], Clock::Trusted, supply);
        is(board.speed(), speed, 0.01);
        is(off, course, 0.1);
        is(board.integral, integral, 0.02);
    }
}

#[test]
fn a_clock_that_is_off_moves_the_speed_or_the_odometry_by_its_ratio() {
    // Periods, and by how much speed and odometry are off where the period is trusted, and where it is measured [%].
    for (periods, trusted, measured) in [
        (&[0.005][..], [0.0, 0.0], [0.0, 0.0]),
        (&[0.0054], [-7.4, 0.0], [0.0, -7.4]),
        (&[0.0047], [6.4, 0.0], [0.0, 6.4]),
        (&[0.0047, 0.0054], [-1.0, 0.0], [0.0, -1.0]),
    ] {
        for (clock, [speed, way]) in [(Clock::Trusted, trusted), (Clock::Measured, measured)] {
            let mut board = board(observer());
            drive(&mut board, 3.0, periods, clock, FULL);
            let (true_m, odometry_m) = (board.way_m, board.odometry_m);
            drive(&mut board, 3.0, periods, clock, FULL);
            is(
                100.0 * (board.speed() / WANTED.vx_m_s.hypot(WANTED.vy_m_s) - 1.0),
                speed,
                0.2,
            );
            is(
                100.0 * ((board.odometry_m - odometry_m) / (board.way_m - true_m) - 1.0),
                way,
                0.2,
            );
        }
    }
    // What a reading is off by at 17 rad/s and periods of 4.7 and 5.4 ms in turn; a count in a period is 2.3 rad/s.
    for (method, trusted, measured) in [
        (VelocityMethod::Window { periods: 1 }, 3.23, 2.2),
        (observer(), 0.34, 0.1),
    ] {
        for (clock, stated) in [(Clock::Trusted, trusted), (Clock::Measured, measured)] {
            let mut board = board(method);
            drive(&mut board, 3.0, &[0.0047, 0.0054], clock, FULL);
            board.off = 0.0;
            drive(&mut board, 3.0, &[0.0047, 0.0054], clock, FULL);
            is(board.off, stated, 0.06);
        }
    }
}

#[test]
fn a_period_that_comes_late_is_a_jolt_only_where_its_time_is_not_measured() {
    for (clock, late_s, read, least) in [
        (Clock::Trusted, 0.05, 0.81, 0.46),
        (Clock::Measured, 0.05, 0.55, 0.58),
        (Clock::Trusted, 0.1, 1.21, 0.25),
        (Clock::Measured, 0.1, 0.58, 0.62),
    ] {
        let mut board = board(observer());
        // Speeding up: the duties that stand are those of 1.5 m/s^2.
        drive(&mut board, 0.3, &[PERIOD_S], Clock::Trusted, FULL);
        board.pass(late_s, 1.0);
        let mut slowest = board.speed();
        for k in 0..100 {
            board.step(Some(WANTED), if k == 0 { late_s } else { PERIOD_S }, clock, FULL);
            if k == 0 {
                is(board.read.vx_m_s.hypot(board.read.vy_m_s), read, 0.01);
            }
            board.pass(PERIOD_S, 1.0);
            slowest = slowest.min(board.speed());
        }
        is(slowest, least, 0.01);
    }
}

#[test]
fn after_a_watchdog_s_reset_a_pushed_stick_moves_nothing() {
    let mut hangs = board(observer());
    drive(&mut hangs, 2.0, &[PERIOD_S], Clock::Trusted, FULL);
    let start_m = hangs.way_m;
    // The duties stand until the watchdog bites; then every pin floats, and the bridges are open.
    hangs.pass(0.05, 1.0);
    is(hangs.way_m - start_m, 0.043, 0.001);
    hangs.duties = [None; 4];
    hangs.pass(0.02, 1.0);
    let mut anew = Board::new(observer());
    (anew.turned, anew.twist) = (hangs.turned, hangs.twist);
    let mut rests_s = 0.0;
    for k in 1..=400 {
        anew.step(Some(WANTED), PERIOD_S, Clock::Trusted, FULL);
        anew.pass(PERIOD_S, 1.0);
        if anew.speed() > 0.01 {
            rests_s = f64::from(k) * PERIOD_S;
        }
    }
    is(rests_s, 0.25, 0.02);
    is(anew.way_m, 0.045, 0.002);
    is(anew.speed(), 0.0, 0.005);
}
