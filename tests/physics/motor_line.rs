//! A motor's torque-speed line at its wheel's true speed, whatever the controller reads and however long torque holds.

use omni_core::BodyTwist;
use omni_sim::config::{Engine, Override, Scenario};
use omni_sim::controller::AnyController;
use omni_sim::{AxleDrive, ExternalFailure, ExternalPhysics, ExternalState, ExternalStep, Simulation, run};

use crate::engines::{load, on_both_engines};

/// Radius of the wheels of `mecanum4`, its motors' torque at rest, and their speed without load.
const RADIUS_M: f64 = 0.076;
const STALL_N_M: f64 = 3.0;
const NO_LOAD_RAD_S: f64 = 30.0;

fn keys(texts: &[&str]) -> Vec<Override> {
    let keys = texts.iter().map(|text| Override::parse(text).expect("KEY=VALUE"));
    keys.collect()
}

/// `mecanum4` on flat ground.
fn scenario(texts: &[&str]) -> Scenario {
    load("flat", &keys(&[&["vehicle=mecanum4"], texts].concat())).expect("valid")
}

/// The wheels' velocities after so many periods of these torques.
fn turned(simulation: &mut Simulation, torques_n_m: [f64; 4], periods: usize) -> Vec<f64> {
    for _ in 0..periods {
        simulation.step_torques(&torques_n_m).expect("finite");
    }
    simulation.measured_rad_s().to_vec()
}

fn no_wheel_passes_its_no_load_speed_by_a_stuck_dead_late_or_coarse_encoder() {
    for more in [
        r#"fault=[{ kind = "encoder_stuck", wheel = "front_left", from_s = 0.02 }]"#,
        r#"fault=[{ kind = "encoder_dead", wheel = "front_left", from_s = 0.02 }]"#,
        "sensors.delay_s=0.05",
        "sensors.encoder_counts=64",
        "control.period_s=0.02",
    ] {
        let ice = [
            "terrain.friction=0.02",
            "command.vx_m_s=1",
            "duration_s=4.0",
            more,
        ];
        let trace = run(&scenario(&[&ice[..], &["control.policy=independent"]].concat())).expect("runs");
        let way_m = RADIUS_M * std::f64::consts::FRAC_1_SQRT_2; // along a roller's axis, per rad
        for wheel in 0..4 {
            let rim = trace.wheel("rim_m_s", wheel).expect("a signal");
            let most = rim.iter().fold(0.0_f64, |most, speed| most.max(speed.abs())) / way_m;
            // The rim also has what its carrier turns and pitches by: hundredths of a rad/s.
            assert!(most < NO_LOAD_RAD_S * (1.0 + 1e-3), "{more}: {most} rad/s");
        }
        let energy = trace.outcome().energy_residual;
        assert!(energy.abs() < 1e-4, "{more}: {energy}");
    }
}

fn a_motor_gives_no_more_than_its_drive_lets_it_and_comes_to_its_no_load_speed() {
    let free = scenario(&["terrain.friction=0", "vehicle.motor.torque_limit_n_m=1"]);
    let [mut asked, mut limited] = [(); 2].map(|()| Simulation::new(&free).expect("valid"));
    for k in 0..1500 {
        // What is asked for beyond the limit is the limit, in every bit.
        let [beyond, at] = [(&mut asked, STALL_N_M), (&mut limited, 1.0)]
            .map(|(simulation, torque)| turned(simulation, [torque, -torque, -torque, torque], 1));
        assert_eq!(beyond, at, "period {k}");
    }
    // The line ends where it did: 1 N.m is left up to 20 rad/s, 70 ms; then J over the slope, 35
    // ms, is passed forty times.
    let speed = limited.measured_rad_s()[0];
    assert!((speed / NO_LOAD_RAD_S - 1.0).abs() < 1e-3, "{speed} rad/s");
}

fn without_load_a_motor_comes_to_its_no_load_speed_and_stays_there() {
    // Also with a line that is too steep for the wheel and the step: 3 N.m over 0.3 rad/s is 10 N.m.s/rad, and J /
    // dt is 7. That wheel gets there in one step, in which the platform gives way to four of them: 4 times 0.0035
    // of its 0.33 kg.m^2, less what contacts hold. Of the others a thousandth is left, as the platform swings.
    for (slope, steps) in [("0.1", "500"), ("0.1", "1000"), ("10.0", "500"), ("0.1", "125")] {
        let no_load = STALL_N_M / slope.parse::<f64>().expect("a number");
        let slope = format!("vehicle.motor.slope_n_m_s_rad={slope}");
        let step = format!("physics.timestep_s={steps}e-6");
        let free = scenario(&["terrain.friction=0", &slope, &step]);
        let mut simulation = Simulation::new(&free).expect("valid");
        for k in 0..1000 {
            let velocities = turned(&mut simulation, [STALL_N_M, -STALL_N_M, -STALL_N_M, STALL_N_M], 1);
            for (velocity, sign) in velocities.iter().zip([1.0, -1.0, -1.0, 1.0]) {
                let speed = sign * velocity;
                let beyond = if no_load < 1.0 { 0.03 } else { 1e-3 };
                assert!(speed <= no_load * (1.0 + beyond), "{slope} {step}: {speed} rad/s");
                // J over the slope is 35 ms: a second is 28 of them.
                assert!(
                    k < 999 || speed > no_load * (1.0 - 1e-3),
                    "{slope} {step}: {speed} rad/s"
                );
            }
        }
    }
}

fn a_torque_held_for_good_settles_where_the_line_meets_the_load() {
    // Behind a gear of efficiency 0.8, with a part p of the torque and v of the voltage: 0.8 p (3
    // v - 0.1 w) = 0.2 + 0.02 w.
    let cases = [
        ("", 22.0),
        (
            r#"fault=[{ kind = "supply_sag", part = 0.6, from_s = 0.1 }]"#,
            12.4,
        ),
        (
            r#"fault=[{ kind = "motor_weak", part = 0.5, wheel = "front_left", from_s = 0.1 },
                { kind = "motor_weak", part = 0.5, wheel = "front_right", from_s = 0.1 },
                { kind = "motor_weak", part = 0.5, wheel = "rear_left", from_s = 0.1 },
                { kind = "motor_weak", part = 0.5, wheel = "rear_right", from_s = 0.1 }]"#,
            50.0 / 3.0,
        ),
    ];
    for (fault, expected) in cases {
        let losses = [
            "vehicle.motor.gear_friction_n_m=0.2",
            "vehicle.motor.viscous_n_m_s_rad=0.02",
            "vehicle.motor.efficiency=0.8",
            "control.period_s=0.005",
        ];
        let faults = if fault.is_empty() { &[][..] } else { &[fault] };
        let mut simulation = Simulation::new(&scenario(&[&losses[..], faults].concat())).expect("valid");
        for velocity in turned(&mut simulation, [STALL_N_M; 4], 1000) {
            // Eight time constants of 0.6 s leave 3e-4 of it; a thousandth is for the contacts' creep.
            assert!(
                (velocity / expected - 1.0).abs() < 1.5e-3,
                "{fault}: {velocity} rad/s, {expected}"
            );
        }
    }
}

fn a_wheel_beyond_its_no_load_speed_is_braked_with_stall_torque_and_not_driven() {
    // Free wheels at 30 rad/s; then the supply falls to a half, and 15 rad/s is as fast as it
    // drives, 1.5 N.m all that it brakes with.
    let fault = r#"fault=[{ kind = "supply_sag", part = 0.5, from_s = 1.0 }]"#;
    let free = scenario(&["terrain.friction=0", fault]);
    let mut simulation = Simulation::new(&free).expect("valid");
    let before = turned(&mut simulation, [STALL_N_M; 4], 1000);
    let coasting = turned(&mut simulation, [STALL_N_M; 4], 10);
    for (a, b) in before.iter().zip(&coasting) {
        assert!(
            (a - b).abs() < 1e-3 * a,
            "{a} {b} rad/s: nothing brakes a free wheel"
        );
    }
    assert_eq!(simulation.observation().wheels[0].torque_n_m, 0.0);
    let braked = turned(&mut simulation, [-STALL_N_M; 4], 10);
    assert_eq!(simulation.observation().wheels[0].torque_n_m, -0.5 * STALL_N_M);
    for (a, b) in coasting.iter().zip(&braked) {
        // 1.5 N.m on 0.0035 kg.m^2 for 10 ms; the ball's reaction turns the platform by a hundredth of it.
        let expected = 1.5 / 0.0035 * 0.01;
        assert!(
            ((a - b) / expected - 1.0).abs() < 0.02,
            "{a} {b} rad/s, {expected}"
        );
    }
}

fn with_ideal_encoders_a_run_within_the_line_is_as_without_one() {
    // What the controller's limit lets through at the start of a period, the plant's lets through
    // too: the same torque, in every bit.
    let trace = run(&scenario(&["duration_s=3.0", "command.vx_m_s=0.5"])).expect("runs");
    for wheel in 0..4 {
        let (commanded, acted) = (
            trace.wheel("applied_n_m", wheel),
            trace.wheel("torque_n_m", wheel),
        );
        assert_eq!(commanded, acted, "wheel {wheel}");
    }
}

on_both_engines! {
    no_wheel_passes_its_no_load_speed_by_a_stuck_dead_late_or_coarse_encoder,
    a_motor_gives_no_more_than_its_drive_lets_it_and_comes_to_its_no_load_speed,
    without_load_a_motor_comes_to_its_no_load_speed_and_stays_there,
    a_torque_held_for_good_settles_where_the_line_meets_the_load,
    a_wheel_beyond_its_no_load_speed_is_braked_with_stall_torque_and_not_driven,
    with_ideal_encoders_a_run_within_the_line_is_as_without_one,
}

/// Wheels in the air: their inertia and nothing else.
struct Free {
    inertia_kg_m2: f64,
    step_s: f64,
    turned_rad: [f64; 4],
    rate_rad_s: [f64; 4],
}

impl ExternalPhysics for Free {
    fn engine(&self) -> Engine {
        Engine::Mujoco
    }

    fn start(&mut self, _: f64, _: f64) -> Result<(), ExternalFailure> {
        Ok(())
    }

    fn step(&mut self, axles: &[AxleDrive], shown: &mut ExternalStep) -> Result<(), ExternalFailure> {
        for (i, axle) in axles.iter().enumerate() {
            self.rate_rad_s[i] += axle.torque_n_m / self.inertia_kg_m2 * self.step_s;
            self.turned_rad[i] += self.rate_rad_s[i] * self.step_s;
        }
        shown.turned_rad.copy_from_slice(&self.turned_rad);
        shown.rate_rad_s.copy_from_slice(&self.rate_rad_s);
        Ok(())
    }

    fn observe(&mut self, state: &mut ExternalState) -> Result<(), ExternalFailure> {
        for body in &mut state.bodies {
            body.pose.rotation_xyzw = [0.0, 0.0, 0.0, 1.0];
        }
        Ok(())
    }
}

#[test]
fn external_physics_get_no_torque_beyond_the_line_behind_a_stuck_encoder() {
    let stuck = r#"fault=[{ kind = "encoder_stuck", wheel = "front_left", from_s = 0.0 }]"#;
    let scenario = scenario(&[stuck, "control.policy=independent"]);
    let free = Free {
        inertia_kg_m2: 0.0035,
        step_s: 0.0005,
        turned_rad: [0.0; 4],
        rate_rad_s: [0.0; 4],
    };
    let controller = AnyController::new(&scenario).expect("valid");
    let mut simulation = Simulation::with_physics(&scenario, controller, Box::new(free)).expect("starts");
    let ahead = BodyTwist {
        vx_m_s: 0.5,
        vy_m_s: 0.0,
        wz_rad_s: 0.0,
    };
    let (mut angle_rad, mut fastest) = (0.0, 0.0_f64);
    for _ in 0..3000 {
        simulation.step(&ahead).expect("goes on");
        let at = simulation.observation().energy.work_in_j;
        assert!(at.is_finite());
        let rim = simulation.observation().wheels[0].rim_m_s;
        let rate = rim / (RADIUS_M * std::f64::consts::FRAC_1_SQRT_2);
        fastest = fastest.max(rate);
        angle_rad += 0.001 * rate;
    }
    // It gets to the no-load speed, and not beyond it but by rounding: the wheel has its own inertia alone.
    assert!(
        (fastest / NO_LOAD_RAD_S - 1.0).abs() < 1e-9 && angle_rad > 60.0,
        "{fastest} rad/s, {angle_rad} rad"
    );
}

#[test]
fn external_physics_refuse_ground_that_changes_and_loads_that_are_added() {
    for (key, message) in [
        (
            "friction_patch=[{ x_m = [0, 1], y_m = [0, 1], friction = 0.1, velocity_m_s = [1, 0] }]",
            "scenario flat: friction_patch[0].velocity_m_s: set, allowed with physics.engine \"mujoco\": only patches that never change",
        ),
        (
            r#"fault=[{ kind = "load_added", body = "platform", mass_kg = 1.0, at_m = [0, 0, 0], from_s = 0.0 }]"#,
            "scenario flat: fault[0].kind: \"load_added\", allowed with physics.engine \"mujoco\": every other fault",
        ),
    ] {
        let scenario = scenario(&[key]);
        let free = Free {
            inertia_kg_m2: 1.0,
            step_s: 1.0,
            turned_rad: [0.0; 4],
            rate_rad_s: [0.0; 4],
        };
        let controller = AnyController::new(&scenario).expect("valid");
        let refused = Simulation::with_physics(&scenario, controller, Box::new(free)).err();
        assert_eq!(refused.map(|error| error.to_string()).as_deref(), Some(message));
    }
}
