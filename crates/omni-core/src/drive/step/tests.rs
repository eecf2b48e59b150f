mod faults;
mod stops;
mod traction;

use super::*;
use crate::drive::*;
use crate::estimate::OdometryNoise;
use crate::geometry::{Desaturation, PathFactors, PlanarPose, SpeedLimits, WheelLayout};
use crate::loops::{Coordination, PidConfig, PidGains, Rest, WheelControlConfig};
use crate::motor::{TorqueLimit, TorqueRange, TorqueRanges};
use crate::shaping::{
    CommandStatus, EmergencyDeceleration, MotionLimits, Restart, ShapingConfig, TwistLimits,
};
use proptest::prelude::*;

const DT: f64 = 1e-3;

fn layout() -> WheelLayout<f64, 7> {
    WheelLayout::chugo7(0.30, 0.23, 0.066).expect("valid")
}

fn loops<const N: usize>(coordination: Coordination<f64>) -> WheelControlConfig<f64, N> {
    let gains = PidGains {
        kp_n_m_s_rad: 0.3,
        ki_n_m_rad: 2.0,
        kd_n_m_s2_rad: 0.0,
    };
    let limits = [TorqueLimit::constant(2.0).expect("valid"); N];
    WheelControlConfig {
        pid: PidConfig::new(gains, DT),
        limits,
        coordination,
    }
}

/// Everything on.
fn config() -> DriveConfig<f64, 7> {
    let linear = MotionLimits {
        velocity: 0.5,
        acceleration: 1.0,
        deceleration: 2.0,
        jerk: f64::INFINITY,
    };
    let yaw = MotionLimits {
        velocity: 1.0,
        acceleration: 3.0,
        deceleration: 3.0,
        jerk: f64::INFINITY,
    };
    DriveConfig {
        shaping: ShapingConfig {
            limits: TwistLimits::AlongMotion { linear, yaw },
            timeout_s: Some(0.1),
            emergency_deceleration: Some(EmergencyDeceleration {
                linear_m_s2: 4.0,
                yaw_rad_s2: 10.0,
            }),
            restart: Restart::AtOnce,
        },
        discretize: true,
        speed_limits: Some(SpeedLimits::new([9.0; 7], Desaturation::Uniform).expect("valid")),
        slip: Some(SlipConfig {
            enter_rad_s: 1.0,
            leave_rad_s: 0.5,
            enter_periods: 20,
            leave_periods: 50,
        }),
        faults: Some(FaultConfig {
            jump_rad_s: 3.0,
            jump_periods: 5,
            stuck_rad_s: 1.0,
            stuck_torque_n_m: f64::INFINITY,
            stuck_periods: 50,
            silent_periods: 20,
            recovery_periods: 100,
        }),
        noise: Some(OdometryNoise {
            wheel_rad_per_sqrt_rad: 0.01,
            residual_gain: 1.0,
        }),
        ..DriveConfig::new(layout(), loops(Coordination::scale_references()))
    }
}

/// A vehicle of 20 kg on wheels that grip: what its encoders say is what it does.
struct Vehicle {
    drive: Drive<f64, 7>,
    state: DriveState<f64, 7>,
    twist: BodyTwist<f64>,
    pose: PlanarPose<f64>,
}

impl Vehicle {
    fn new(config: DriveConfig<f64, 7>) -> Self {
        let drive = Drive::new(config).expect("valid");
        let state = DriveState::new(&drive);
        Self {
            drive,
            state,
            twist: BodyTwist::ZERO,
            pose: PlanarPose::origin(),
        }
    }

    /// One period with the readings as `spoil` leaves them.
    fn step(
        &mut self,
        command: Option<BodyTwist<f64>>,
        spoil: impl Fn(&mut DriveInput<f64, 7>),
    ) -> DriveSample<f64, 7> {
        let mut input = DriveInput::measured(&self.drive.kinematics().inverse(&self.twist));
        input.command = command;
        spoil(&mut input);
        let sample = self.drive.step(&mut self.state, &input);
        // Virtual work: the force on each motion is the transposed inverse map times the torques.
        let mut force = [0.0; 3];
        for (row, torque) in self
            .drive
            .kinematics()
            .inverse_matrix()
            .iter()
            .zip(sample.wheels.applied.n_m)
        {
            for (f, a) in force.iter_mut().zip(row) {
                *f += a * torque;
            }
        }
        let mass = [20.0, 20.0, 1.0];
        let mut v = self.twist.to_array();
        for i in 0..3 {
            v[i] += DT * (force[i] / mass[i] - 0.1 * v[i]);
        }
        self.twist = BodyTwist::from_array(v);
        self.pose = self.pose.moved_by(&self.twist.over(DT));
        sample
    }

    fn run(
        &mut self,
        periods: usize,
        command: BodyTwist<f64>,
        spoil: impl Fn(&mut DriveInput<f64, 7>),
    ) -> DriveSample<f64, 7> {
        let mut sample = self.step(Some(command), &spoil);
        for _ in 1..periods {
            sample = self.step(Some(command), &spoil);
        }
        sample
    }
}

fn twist(vx: f64, vy: f64, wz: f64) -> BodyTwist<f64> {
    BodyTwist {
        vx_m_s: vx,
        vy_m_s: vy,
        wz_rad_s: wz,
    }
}

fn follows(vehicle: &Vehicle, command: BodyTwist<f64>) -> bool {
    let off = vehicle
        .twist
        .to_array()
        .iter()
        .zip(command.to_array())
        .map(|(v, c)| (v - c).abs())
        .fold(0.0, f64::max);
    off < 5e-3
}

const COMMAND: BodyTwist<f64> = BodyTwist {
    vx_m_s: 0.3,
    vy_m_s: 0.1,
    wz_rad_s: 0.2,
};

#[test]
fn a_healthy_vehicle_follows_its_command_and_knows_where_it_is() {
    let mut vehicle = Vehicle::new(config());
    let sample = vehicle.run(3000, COMMAND, |_| {});
    assert_eq!(
        (sample.mode, sample.shaped.status),
        (DriveMode::Normal, CommandStatus::Following)
    );
    assert!(follows(&vehicle, COMMAND));
    // Readings are a period old.
    assert!(
        (sample.pose.x_m - vehicle.pose.x_m).abs() < 1e-3
            && (sample.pose.y_m - vehicle.pose.y_m).abs() < 1e-3
    );
    let [x, y, yaw] = vehicle.state.covariance.standard_deviations();
    assert!(
        x > 1e-5 && x < 1e-2 && y > 1e-5 && y < 1e-2 && yaw > 1e-5 && yaw < 1e-2,
        "{x} {y} {yaw}"
    );
}

#[test]
fn a_command_that_stops_coming_ends_in_rest_and_nonsense_is_refused() {
    let mut vehicle = Vehicle::new(config());
    vehicle.run(1000, COMMAND, |_| {});
    for bad in [
        twist(f64::NAN, 0.0, 0.0),
        twist(0.0, f64::INFINITY, 0.0),
        twist(0.0, 0.0, 1e7),
    ] {
        let sample = vehicle.step(Some(bad), |_| {});
        assert!(
            sample.shaped.rejected && sample.shaped.twist == COMMAND,
            "the last good command stands"
        );
    }
    for _ in 0..1000 {
        vehicle.step(None, |_| {});
    }
    let sample = vehicle.step(None, |_| {});
    assert_eq!(
        (sample.shaped.status, sample.shaped.twist),
        (CommandStatus::TimedOut, BodyTwist::ZERO)
    );
    assert!(follows(&vehicle, BodyTwist::ZERO));
}

#[test]
fn the_commanded_point_moves_as_commanded() {
    let point = [0.3, -0.2];
    let mut vehicle = Vehicle::new(DriveConfig {
        command_point_m: point,
        ..config()
    });
    let about_the_point = twist(0.0, 0.0, 0.5);
    vehicle.run(3000, about_the_point, |_| {});
    // Up to what the limits of the origin's twist leave: the point stands still while the vehicle turns about it.
    let at_point = vehicle.twist.at_point(point);
    assert!(
        at_point.vx_m_s.abs() < 5e-3 && at_point.vy_m_s.abs() < 5e-3,
        "{at_point:?}"
    );
    assert!((vehicle.twist.wz_rad_s - 0.5).abs() < 5e-3);
}

#[test]
fn a_wheel_on_an_edge_turns_faster_and_the_estimated_motion_is_right() {
    let mut vehicle = Vehicle::new(config());
    vehicle.run(2000, COMMAND, |_| {});
    let path = PathFactors::new([1.0, 1.0, 1.0, 1.0, 1.5, 1.0, 1.0]).expect("valid");
    let drive = vehicle.drive;
    let wheels = path.of_wheels(&drive.kinematics().inverse(&vehicle.twist));
    let input = DriveInput {
        path,
        ..DriveInput::measured(&wheels).with_command(COMMAND)
    };
    let sample = drive.step(&mut vehicle.state, &input);
    assert!((sample.slip.estimated.vx_m_s - vehicle.twist.vx_m_s).abs() < 1e-12);
    assert!((sample.wheels.reference.rad_s[4] - 1.5 * sample.desaturated.velocities.rad_s[4]).abs() < 1e-12);
}

#[test]
fn a_lifted_wheel_turns_and_does_not_count() {
    let mut vehicle = Vehicle::new(config());
    vehicle.run(1000, COMMAND, |_| {});
    let sample = vehicle.run(100, COMMAND, |input| {
        input.lifted[3] = true;
        input.readings_rad_s[3] = input.readings_rad_s[3].map(|v| v + 0.9);
    });
    assert_eq!(
        (sample.mode, sample.slip.excluded[3], sample.faults[3]),
        (DriveMode::Degraded, true, None)
    );
    assert!(sample.wheels.active[3] && sample.wheels.applied.n_m[3] != 0.0);
    assert!((sample.slip.estimated.vx_m_s - vehicle.twist.vx_m_s).abs() < 1e-3);
}

#[test]
fn speed_limits_of_a_dropped_wheel_do_not_apply() {
    let limits = SpeedLimits::new([9.0, 9.0, 9.0, 0.1, 9.0, 9.0, 9.0], Desaturation::Uniform).expect("valid");
    let mut vehicle = Vehicle::new(DriveConfig {
        speed_limits: Some(limits),
        ..config()
    });
    let sample = vehicle.run(1000, COMMAND, |_| {});
    assert_eq!(sample.desaturated.limiting, Some(3));
    let mut lost = [false; 7];
    lost[3] = true;
    vehicle.state.faults.declare_lost(&lost);
    let sample = vehicle.run(1000, COMMAND, |_| {});
    assert_eq!(
        (sample.desaturated.limiting, sample.desaturated.translation_factor),
        (None, 1.0)
    );
}

#[test]
fn the_parts_errors_come_through_by_name() {
    let named = |config| Drive::<f64, 7>::new(config).expect_err("refused").parameter;
    for bad in [f64::NAN, 1001.0, -3.6e306] {
        assert_eq!(
            named(DriveConfig {
                command_point_m: [0.0, bad],
                ..config()
            }),
            "command_point_m"
        );
    }
    assert_eq!(
        named(DriveConfig {
            rest: Rest::hold(-1.0, 1.0),
            ..config()
        }),
        "rest.hold_s"
    );
    let mut bad = config();
    bad.shaping.timeout_s = Some(-1.0);
    assert_eq!(named(bad), "timeout_s");
    let mut bad = config();
    bad.control.pid.period_s = 0.0;
    assert_eq!(named(bad), "period_s");
}

#[test]
fn lifted_wheels_are_no_emergency() {
    let mut vehicle = Vehicle::new(config());
    vehicle.run(1000, COMMAND, |_| {});
    let sample = vehicle.run(500, COMMAND, |input| {
        // Both that measure lateral motion.
        input.lifted[1] = true;
        input.lifted[5] = true;
    });
    assert_eq!((sample.mode, sample.motion_known), (DriveMode::Degraded, false));
    let sample = vehicle.run(500, COMMAND, |_| {});
    assert_eq!((sample.mode, sample.motion_known), (DriveMode::Normal, true));
}

#[test]
fn an_operator_s_stop_is_the_operator_s_to_end() {
    // This vehicle has hardly any friction, and its loops take most of a second to bring it to rest by themselves.
    let rest = Rest {
        bleed_s: 0.8,
        ..Rest::default()
    };
    let mut vehicle = Vehicle::new(DriveConfig { rest, ..config() });
    vehicle.run(500, COMMAND, |_| {});
    let stopped = vehicle.run(1000, COMMAND, |input| input.emergency = true);
    assert_eq!(stopped.mode, DriveMode::EmergencyStop);
    assert!(follows(&vehicle, BodyTwist::ZERO));
    vehicle.state.release_safe_stop();
    let stopped = vehicle.run(1, COMMAND, |input| input.emergency = true);
    assert_eq!(stopped.mode, DriveMode::EmergencyStop);
    vehicle.run(3000, COMMAND, |_| {});
    assert!(follows(&vehicle, COMMAND));
}

#[test]
fn with_restart_from_neutral_a_vehicle_moves_again_only_after_the_stick_was_at_rest() {
    let shaping = ShapingConfig {
        restart: Restart::Neutral,
        timeout_s: Some(0.1),
        ..config().shaping
    };
    let rest = Rest {
        bleed_s: 0.8, // as above
        ..Rest::default()
    };
    let mut vehicle = Vehicle::new(DriveConfig {
        shaping,
        rest,
        ..config()
    });
    vehicle.run(500, COMMAND, |_| {});
    assert!(follows(&vehicle, BodyTwist::ZERO)); // pushed since before it was switched on
    for stop in [
        (|_| {}) as fn(&mut DriveInput<f64, 7>), // the start itself
        |input| input.emergency = true,
        |input| input.command = None, // the connection is lost
    ] {
        vehicle.run(3000, COMMAND, stop);
        vehicle.run(1000, COMMAND, |_| {});
        assert!(follows(&vehicle, BodyTwist::ZERO));
        vehicle.run(1, BodyTwist::ZERO, |_| {});
        vehicle.run(3000, COMMAND, |_| {});
        assert!(follows(&vehicle, COMMAND));
    }
}

#[test]
fn the_command_point_is_what_discretisation_and_limits_look_at() {
    let point = [0.5, 0.0];
    let control = WheelControlConfig {
        pid: PidConfig {
            period_s: 0.02,
            ..loops::<7>(Coordination::independent()).pid
        },
        ..loops(Coordination::independent())
    };
    let at_point = |command, desaturation| {
        let speed_limits = Some(SpeedLimits::new([9.0; 7], desaturation).expect("valid"));
        let config = DriveConfig {
            command_point_m: point,
            discretize: true,
            speed_limits,
            ..DriveConfig::new(layout(), control)
        };
        let drive = Drive::new(config).expect("valid");
        let input = DriveInput::measured(&WheelVelocities::zero()).with_command(command);
        drive.step(&mut DriveState::new(&drive), &input).desaturated.twist
    };
    // Turning about the point, which stands still whatever the period and whatever gives way.
    for desaturation in [
        Desaturation::Uniform,
        Desaturation::KeepsYaw,
        Desaturation::KeepsTranslation,
    ] {
        for wz in [0.5, 1.8] {
            let turned = at_point(twist(0.0, 0.0, wz), desaturation);
            let still = turned.at_point(point);
            assert!(
                still.vx_m_s.abs() < 1e-12 && still.vy_m_s.abs() < 1e-12,
                "{desaturation:?} {still:?}"
            );
            assert!(turned.wz_rad_s > 0.0);
        }
    }
    // Driving and turning: after a period the point is where the command says.
    let start = PlanarPose::origin();
    let moved = start.moved_by(&at_point(twist(0.3, 0.0, 0.5), Desaturation::Uniform).over(0.02));
    let (sin, cos) = moved.yaw_rad.sin_cos();
    let (x, y) = (
        moved.x_m + cos * point[0] - sin * point[1],
        moved.y_m + sin * point[0] + cos * point[1],
    );
    assert!(
        (x - point[0] - 0.3 * 0.02).abs() < 1e-12 && (y - point[1]).abs() < 1e-12,
        "{x} {y}"
    );
}

#[test]
fn speed_limits_hold_for_a_wheel_on_an_edge_too() {
    let mut vehicle = Vehicle::new(config());
    let path = PathFactors::new([1.0, 1.0, 1.0, 1.0, 1.5, 1.0, 1.0]).expect("valid");
    let fast = twist(0.5, 0.3, 0.9);
    let sample = vehicle.run(2000, fast, |input| input.path = path);
    assert_eq!(sample.desaturated.limiting, Some(4));
    assert!((sample.wheels.reference.rad_s[4].abs() - 9.0).abs() < 1e-9);
}

#[test]
fn hot_motors_and_a_low_battery_are_limits_of_single_periods() {
    let control = loops(Coordination::independent());
    let drive = Drive::new(DriveConfig::new(layout(), control)).expect("valid");
    let ahead = BodyTwist {
        vx_m_s: 0.3,
        ..BodyTwist::ZERO
    };
    let free = DriveInput::measured(&WheelVelocities::zero()).with_command(ahead);
    // One motor, or all of them.
    for wheels in [3..4, 0..7] {
        let mut limited = free;
        for wheel in wheels.clone() {
            let range = TorqueRange {
                lower_n_m: -0.25,
                upper_n_m: 0.25,
            };
            limited.torque_ranges.set(wheel, &range);
        }
        let mut state = DriveState::new(&drive);
        for _ in 0..10 {
            drive.step(&mut state, &free);
        }
        let mut other = state;
        let without = drive.step(&mut other, &free).wheels.applied.n_m;
        let with = drive.step(&mut state, &limited).wheels.applied.n_m;
        let after = drive.step(&mut state, &free).wheels.applied.n_m;
        // Wheels that stand: 0.3 N.m s/rad of 0.3 m/s over 66 mm, 1.4 N.m, for those that the motion turns.
        assert!(without[3].abs() > 1.0, "{without:?}");
        for wheel in 0..7 {
            let most = if wheels.contains(&wheel) {
                0.25
            } else {
                f64::INFINITY
            };
            assert_eq!(with[wheel], without[wheel].clamp(-most, most), "wheel {wheel}");
            // The integral of one period more or less: ki * 4.5 rad/s * 1 ms, 0.009 N.m.
            assert!((after[wheel] - without[wheel]).abs() < 0.02, "wheel {wheel}");
        }
    }
}

proptest! {
    #[test]
    fn nothing_is_ever_nan_and_torque_stays_within_limits_for_any_input_at_all(
        inputs in prop::collection::vec(
            (prop::array::uniform7(prop::option::of(any::<f32>())), prop::option::of(prop::array::uniform3(any::<f32>())),
             prop::array::uniform7(any::<bool>()), prop::array::uniform7(0.01..100.0_f32)), 1..40),
    ) {
        let gains = PidGains { kp_n_m_s_rad: 0.3_f32, ki_n_m_rad: 2.0, kd_n_m_s2_rad: 0.01 };
        let control = WheelControlConfig {
            pid: PidConfig::new(gains, 1e-3),
            limits: [TorqueLimit::line(2.0, 0.1).expect("valid"); 7],
            coordination: Coordination::scale_references(),
        };
        let single = DriveConfig {
            discretize: true,
            speed_limits: Some(SpeedLimits::new([9.0; 7], Desaturation::KeepsYaw).expect("valid")),
            slip: Some(SlipConfig { enter_rad_s: 1.0, leave_rad_s: 0.5, enter_periods: 2, leave_periods: 2 }),
            noise: Some(OdometryNoise { wheel_rad_per_sqrt_rad: 0.01, residual_gain: 1.0 }),
            ..DriveConfig::new(WheelLayout::chugo7(0.30, 0.23, 0.066).expect("valid"), control)
        };
        let drive = Drive::new(single).expect("valid");
        let mut state = DriveState::new(&drive);
        for (readings, command, lifted, path) in inputs {
            let input = DriveInput {
                emergency: false,
                command: command.map(BodyTwist::from_array),
                readings_rad_s: readings,
                lifted,
                path: PathFactors::new(path).expect("in range"),
                torque_ranges: TorqueRanges { lower_n_m: path.map(|p| -p), upper_n_m: path.map(|p| 2.0 - p) },
            };
            let sample = drive.step(&mut state, &input);
            let w = &sample.wheels;
            for i in 0..7 {
                prop_assert!(w.applied.n_m[i].abs() <= 2.0);
                prop_assert!(w.requested.n_m[i].is_finite() && sample.slip.slip_rad_s[i].is_finite());
            }
            prop_assert!(w.reference.is_finite() && w.measured.is_finite() && sample.slip.residual.is_finite());
            let pose = sample.pose;
            prop_assert!(pose.x_m.is_finite() && pose.y_m.is_finite() && pose.yaw_rad.is_finite());
            prop_assert!(state.covariance.matrix().iter().flatten().all(|c| c.is_finite()));
        }
    }
}
