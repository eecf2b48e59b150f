//! A drive whose loops are traction control.

use super::*;
use crate::drive::{BodyReadings, TractionDriveState};
use crate::linkage::{CarriedWheel, Linkage};
use crate::policy::Imu;
use crate::traction::{Supervisor, SupervisorConfig, Traction, TractionConfig, TractionWheel};

const PLACES: [[f64; 2]; 4] = [[0.3, 0.2], [0.3, -0.2], [-0.3, 0.2], [-0.3, -0.2]];

/// Four mecanum wheels with everything on that [`config`] has but for speed limits of seven wheels.
fn drive<R: Real>() -> TractionDrive<R, 4> {
    let of = R::of;
    let limit = TorqueLimit::constant(of(2.0)).expect("valid");
    let layout = WheelLayout::mecanum4(of(0.6), of(0.4), of(0.1)).expect("valid");
    let gains = PidGains {
        kp_n_m_s_rad: of(0.3),
        ki_n_m_rad: of(2.0),
        kd_n_m_s2_rad: of(0.0),
    };
    let control = WheelControlConfig {
        pid: PidConfig::new(gains, of(DT)),
        limits: [limit; 4],
        coordination: Coordination::independent(),
    };
    let mut config = DriveConfig::new(layout, control);
    config.shaping.timeout_s = Some(of(0.1));
    config.shaping.emergency_deceleration = Some(EmergencyDeceleration {
        linear_m_s2: of(4.0),
        yaw_rad_s2: of(10.0),
    });
    let wheels = PLACES.map(|place| TractionWheel {
        limit,
        inertia_kg_m2: of(0.002),
        carrier: [of(1.0), of(0.0)],
        place_m: place.map(of),
    });
    let carried = PLACES.map(|[x, y]| CarriedWheel {
        body: 0,
        centre_m: [x, y, 0.1].map(of),
    });
    let traction = Traction::new(
        Kinematics::new(&layout).expect("valid"),
        Linkage::new(&[], &carried).expect("valid"),
        wheels,
        TractionConfig::traction(of(0.3), of(2.0), of(DT)),
    );
    let places = PLACES.map(|place| place.map(of));
    let supervisor = Supervisor::new(&places, SupervisorConfig::traction(of(DT))).expect("valid");
    TractionDrive::new(
        Drive::new(config).expect("valid"),
        supervisor,
        traction.expect("valid"),
    )
    .expect("one period")
}

fn ahead<R: Real>(speed: f64, rad_s: [f64; 4]) -> DriveInput<R, 4> {
    let command = BodyTwist::from_array([speed, 0.0, 0.0].map(R::of));
    DriveInput::measured(&WheelVelocities {
        rad_s: rad_s.map(R::of),
    })
    .with_command(command)
}

#[test]
fn a_hot_motor_s_range_holds_in_the_common_thrust_too() {
    let drive = drive::<f64>();
    let mut state = TractionDriveState::new(&drive);
    // Blocked: after 0.3 s it is traction control that pushes, with all that it has.
    let mut input = ahead(0.5, [0.0; 4]);
    let hot = TorqueRange {
        lower_n_m: -0.25,
        upper_n_m: 0.25,
    };
    input.torque_ranges.set(2, &hot);
    let (mut most, mut pushed) = ([0.0_f64; 4], false);
    for _ in 0..900 {
        let sample = drive.step(&mut state, &input, &BodyReadings::none());
        for (most, torque) in most.iter_mut().zip(sample.drive.wheels.applied.n_m) {
            *most = most.max(torque.abs());
        }
        pushed |= sample.traction.loops == crate::traction::TractionLoops::Traction
            && sample.traction.thrust_n_m == 2.0;
    }
    assert!(pushed);
    assert_eq!(most, [2.0, 2.0, 0.25, 2.0]);
}

/// What any stop does, whatever wheels read, in a scalar: no torque from its stated time on, and no try.
fn stops<R: Real>(stop: impl Fn(&mut DriveInput<R, 4>)) {
    for stuck in [[0.0; 4], [5.0; 4], [5.0, -5.0, 5.0, 0.0], [-4.0; 4]] {
        let drive = drive::<R>();
        let mut state = TractionDriveState::new(&drive);
        let mut input = ahead(0.5, stuck);
        let mut body = BodyReadings::none();
        body.imu = Imu::level();
        // Long enough to be stuck and to back off, where the wheels stand.
        for _ in 0..800 {
            drive.step(&mut state, &input, &body);
        }
        stop(&mut input);
        let mut sample = drive.step(&mut state, &input, &body);
        for _ in 0..100 + 125 + 500 {
            sample = drive.step(&mut state, &input, &body);
        }
        let wheels = &sample.drive.wheels;
        assert_eq!(wheels.applied.n_m, [R::zero(); 4], "{stuck:?}");
        assert!(wheels.ended);
        assert_eq!(
            state.supervisor().mode(),
            crate::traction::SupervisorMode::Drive,
            "{stuck:?}"
        );
    }
}

#[test]
fn every_stop_with_traction_control_ends_without_torque_whatever_is_measured() {
    // The button is pressed; a command of rest; no command arrives: 0.1 s until the time-out, 0.125
    // s of deceleration, 0.5 s of bleed.
    stops::<f32>(|input| input.emergency = true);
    stops::<f64>(|input| input.emergency = true);
    stops::<f32>(|input| input.command = Some(BodyTwist::ZERO));
    stops::<f64>(|input| input.command = Some(BodyTwist::ZERO));
    stops::<f32>(|input| input.command = None);
    stops::<f64>(|input| input.command = None);
}

#[test]
fn a_stop_takes_a_vehicle_that_backs_off_to_rest_and_not_ahead() {
    let drive = drive::<f64>();
    let mut state = TractionDriveState::new(&drive);
    let (mut input, mut body) = (ahead(0.5, [0.0; 4]), BodyReadings::none());
    body.imu = Imu::level();
    let backs = |state: &TractionDriveState<f64, 4>| {
        state.supervisor().mode() == crate::traction::SupervisorMode::BackOff
    };
    for _ in 0..3000 {
        if backs(&state) {
            break;
        }
        drive.step(&mut state, &input, &body);
    }
    assert!(backs(&state));
    // The target falls by 4 m/s^2.
    for _ in 0..200 {
        drive.step(&mut state, &input, &body);
    }
    input.emergency = true;
    for _ in 0..300 {
        let sample = drive.step(&mut state, &input, &body);
        assert_eq!(sample.traction.target_m_s, 0.0);
        assert!(!backs(&state));
    }
    // Released, it begins as if it had just been commanded: its first try is its first again.
    input.emergency = false;
    drive.step(&mut state, &input, &body);
    assert_eq!(state.supervisor().row_retries(), 0);
}

#[test]
fn with_too_few_wheels_it_stops_and_shorts_the_motors_that_it_lost() {
    let drive = drive::<f32>();
    let mut state = TractionDriveState::new(&drive);
    let mut input = ahead(0.5, [2.0; 4]);
    input.readings_rad_s[0] = None;
    input.readings_rad_s[1] = None;
    let mut sample = drive.step(&mut state, &input, &BodyReadings::none());
    for _ in 0..10 + 125 + 500 {
        sample = drive.step(&mut state, &input, &BodyReadings::none());
    }
    assert_eq!(sample.drive.mode, DriveMode::SafeStop);
    assert_eq!(sample.drive.wheels.applied.n_m, [0.0; 4]);
    assert_eq!(sample.drive.brake, [true; 4]);
}
