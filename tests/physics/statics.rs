//! Forces at rest and in balance, against closed forms.

use omni_core::BodyTwist;
use omni_sim::Simulation;
use omni_sim::config::Override;

use crate::engines::{load, on_both_engines};

const G: f64 = 9.81;

/// The vehicle after one second at rest on flat ground. Its loops hold it: released, wheels without
/// friction would roll on by what is left of settling.
fn at_rest() -> Simulation {
    let hold = [("hold_s", 60.0), ("hold_torque_squared_n2m2s", 1e6)];
    let hold = hold.map(|(key, value)| Override::new(format!("control.rest.{key}"), value));
    let mut simulation = Simulation::new(&load("flat", &hold).expect("built-in")).expect("valid");
    for _ in 0..1000 {
        simulation.step(&BodyTwist::ZERO).expect("finite");
    }
    simulation
}

fn static_row_loads_follow_from_the_moment_balance_of_each_frame() {
    let simulation = at_rest();
    let load = |wheels: [usize; 3]| -> f64 {
        wheels
            .iter()
            .map(|w| simulation.observation().wheels[*w].force_normal_n)
            .sum()
    };
    // Front frame about the pitch axis at x = 0: 6 kg at 0.18 m and three wheels of 1 kg at 0.30 m rest on the row at
    // 0.30 m. The rear frame, the middle and wheel 4 share the roll axis, so the rear row carries its own share alike.
    let row = G * (6.0 * 0.18 + 3.0 * 0.30) / 0.30;
    let middle = 20.0 * G - 2.0 * row;
    // The middle and the rear are one body in pitch: the load between row and wheel 4 depends on contacts that give by
    // micrometres, not on balance alone; a hundredth of the weight covers it.
    assert!(
        (load([4, 5, 6]) - row).abs() < 0.01 * row,
        "front row {} N, expected {row}",
        load([4, 5, 6])
    );
    assert!(
        (load([0, 1, 2]) - row).abs() < 0.01 * row,
        "rear row {} N, expected {row}",
        load([0, 1, 2])
    );
    let wheel_4 = simulation.observation().wheels[3].force_normal_n;
    assert!(
        (wheel_4 - middle).abs() < 0.01 * middle,
        "wheel 4 {wheel_4} N, expected {middle}"
    );
}

fn contact_forces_are_all_that_accelerates_the_vehicle() {
    // Newton: weight plus ground forces = mass times acceleration of the centre of mass. At rest and when driving
    // steadily the acceleration is nil; contacts are read from the solver, so this tests the reading.
    let simulation = at_rest();
    let sum = |axis: usize| -> f64 {
        simulation
            .observation()
            .wheels
            .iter()
            .map(|w| w.force_n[axis])
            .sum()
    };
    assert!((sum(2) - 20.0 * G).abs() < 1e-3, "{} N upwards", sum(2));
    assert!(
        sum(0).abs() < 1e-3 && sum(1).abs() < 1e-3,
        "{} N, {} N along the ground",
        sum(0),
        sum(1)
    );
}

fn accelerating_ground_forces_equal_mass_times_acceleration_of_frames_and_wheels() {
    // All parts move forward alike on flat ground, so the momentum gained is 20 kg times the speed gained.
    let mut simulation = Simulation::new(&load("flat", &[]).expect("built-in")).expect("valid");
    for _ in 0..500 {
        simulation.step(&BodyTwist::ZERO).expect("finite");
    }
    let before = simulation.observation().twist.vx_m_s;
    let mut impulse = 0.0;
    for _ in 0..300 {
        simulation
            .step(&BodyTwist {
                vx_m_s: 0.3,
                ..BodyTwist::ZERO
            })
            .expect("finite");
        impulse += 1e-3
            * simulation
                .observation()
                .wheels
                .iter()
                .map(|w| w.force_n[0])
                .sum::<f64>();
    }
    let gained = 20.0 * (simulation.observation().twist.vx_m_s - before);
    assert!(gained > 5.0, "it did accelerate: {gained} N.s");
    // The frames pitch by a hundredth of a degree meanwhile: their centres of mass, 0.18 m up, lead or lag by 1e-5 m/s.
    assert!(
        (impulse - gained).abs() < 0.002 * gained,
        "{impulse} N.s of ground force, {gained} N.s of momentum"
    );
}

fn vehicle_at_rest_settles_by_micrometres_and_then_stays() {
    let mut simulation = at_rest();
    let settled = simulation.observation().pose.position_m;
    // Contacts of 200 Hz give by 42 um under wheel 4 (softer ones by half a millimetre), which turns the frames by
    // 1e-4 rad about axles 66 mm up: some micrometres along the ground.
    assert!(settled[2].abs() < 1e-4, "sinks by {} m", settled[2]);
    assert!(settled[0].abs() < 2e-5 && settled[1].abs() < 2e-5, "{settled:?}");
    for _ in 0..2000 {
        simulation.step(&BodyTwist::ZERO).expect("finite");
    }
    for (now, then) in simulation.observation().pose.position_m.iter().zip(settled) {
        assert!((now - then).abs() < 1e-7, "creeps from {then} to {now} m in 2 s");
    }
}

on_both_engines! {
    static_row_loads_follow_from_the_moment_balance_of_each_frame,
    contact_forces_are_all_that_accelerates_the_vehicle,
    accelerating_ground_forces_equal_mass_times_acceleration_of_frames_and_wheels,
    vehicle_at_rest_settles_by_micrometres_and_then_stays,
}
