//! Free flight, where nothing but gravity acts, and what solving contacts takes.

use rapier3d_f64::prelude::Vector as Vector3;

use super::World;
use super::solver::SolverStats;
use super::system::System;
use crate::config::{Override, Scenario};
use crate::observation::Observation;
use crate::world::interface::Plant;

/// A vehicle 100 m up that turns and whose hinges and wheels turn too, without dampers.
fn in_flight<const N: usize>(vehicle: &str, step_us: i64) -> World<N> {
    let mut keys = vec![
        Override::new("vehicle", vehicle),
        Override::new("physics.timestep_s", step_us as f64 / 1e6),
    ];
    let hinges = Scenario::load("flat", &keys)
        .expect("built in")
        .vehicle()
        .hinge
        .len();
    for i in 0..hinges {
        keys.push(Override::new(format!("vehicle.hinge.{i}.damping_n_m_s_rad"), 0.0));
        keys.push(Override::new(format!("vehicle.hinge.{i}.limit_rad"), 3.0));
    }
    let scenario = Scenario::load("flat", &keys).expect("valid");
    let mut world = World::<N>::new(&scenario, 0.0, 0.0).expect("flat");
    world.state.com_m[2] += 100.0;
    let turning = [0.3, -0.2, 1.0, 0.7, -1.1, 0.9, 1.3, -0.8];
    world.state.u[..turning.len().min(6 + hinges)].copy_from_slice(&turning[..turning.len().min(6 + hinges)]);
    for (i, spin) in world.state.spin_rad_s.iter_mut().enumerate() {
        *spin = 3.0 - i as f64;
    }
    world.tree.update(&world.model, &world.state);
    world
}

/// Energy \[J\], and angular momentum about the common centre of mass \[kg.m^2/s\].
fn kept<const N: usize>(world: &World<N>) -> (f64, Vector3) {
    let now = world.now();
    let mut angular = Vector3::ZERO;
    for [_, _, _, x, y, z] in world.tree.momentum {
        angular += Vector3::new(x, y, z);
    }
    for (wheel, spin) in world.model.wheels.iter().zip(&world.state.spin_rad_s) {
        angular += world.tree.rotation[wheel.body] * wheel.axle * (wheel.inertia_kg_m2 * spin);
    }
    (now.kinetic_j + now.potential_j, angular)
}

/// By how much, as parts, energy and angular momentum are off after a second.
fn off<const N: usize>(vehicle: &str, step_us: i64) -> [f64; 2] {
    let mut world = in_flight::<N>(vehicle, step_us);
    let (energy, angular) = kept(&world);
    let turning_j = world.now().kinetic_j;
    for _ in 0..1_000_000 / step_us {
        world.advance_step(|_| [0.0; 2]);
    }
    let (after_j, after) = kept(&world);
    // Free fall in steps: g^2 T dt m / 2 is the first order of the integration, and no error of the tree.
    let g = world.model.gravity_m_s2;
    let falling_j = 0.5 * world.model.mass_kg * g * g * step_us as f64 * 1e-6;
    [
        (after_j - energy + falling_j).abs() / turning_j,
        (after - angular).length() / angular.length(),
    ]
}

#[test]
fn free_flight_keeps_energy_and_angular_momentum_to_the_first_order_of_the_step() {
    for (vehicle, off) in [
        ("omni3", [500, 250].map(|step| off::<6>("omni3", step))),
        ("chugo7", [500, 250].map(|step| off::<8>("chugo7", step))),
    ] {
        let [coarse, fine] = off;
        for (coarse, fine) in coarse.into_iter().zip(fine) {
            // A radian a second, seven bodies: parts of a thousandth at half a millisecond.
            assert!(coarse < 1e-3, "{vehicle}: {coarse}");
            assert!(
                (coarse / fine - 2.0).abs() < 0.3 || coarse < 1e-9,
                "{vehicle}: {coarse}, with half the step {fine}"
            );
        }
    }
}

/// What the first steps of the seven-wheel vehicle take, driven ahead by the same torque on every
/// wheel that rolls that way \[N.m\].
fn driven_ahead(scenario: &Scenario, torque_n_m: f64, steps: usize) -> SolverStats {
    let mut world = World::<8>::new(scenario, 0.0, 0.0).expect("a known ground");
    let ahead = [1.0, 0.0, -1.0, 1.0, 1.0, 0.0, -1.0];
    world
        .torques_n_m
        .copy_from_slice(&ahead.map(|way| way * torque_n_m));
    for _ in 0..steps {
        world.advance_step(|_| [0.0; 2]);
    }
    world.stats
}

#[test]
fn a_step_over_an_edge_takes_one_solution_nearly_always() {
    // Full torque ahead for 3 s: up to the riser, against it, and with some wheels over it.
    let stats = driven_ahead(&Scenario::load("step", &[]).expect("built in"), 2.0, 6000);
    assert_eq!(stats.steps, 6000);
    // The study counted 1.00, and sweeps in 2 of 12,000 steps; wheels that spin and bounce here ask for more.
    assert!(stats.solutions < 6000 * 6 / 5, "{stats:?}");
    assert!(stats.swept < 60, "{stats:?}");
}

#[test]
fn on_a_height_map_rollers_ask_for_sweeps_and_all_of_them_settle() {
    let rollers = [Override::new("physics.wheel_model", "rollers")];
    let scenario = Scenario::load("height_map", &rollers).expect("built in");
    let stats = driven_ahead(&scenario, 0.5, 8000);
    assert!(stats.swept > 20, "nothing was asked of the sweeps: {stats:?}");
    assert_eq!(stats.unsettled, 0, "{stats:?}");
}

#[test]
fn a_run_whose_contacts_do_not_settle_ends_with_a_line_that_says_so() {
    let mut world = World::<8>::new(&Scenario::load("flat", &[]).expect("built in"), 0.0, 0.0).expect("flat");
    let mut seen = Observation::of(world.scenario.vehicle());
    let torques = [0.0; 7];
    // One in a hundred of a thousand steps is still a run.
    world.stats.unsettled = 10;
    assert!(world.step(&torques, &mut seen).is_ok());
    world.stats.unsettled = 11;
    let said = world
        .step(&torques, &mut seen)
        .expect_err("not settled")
        .to_string();
    assert!(
        said.contains("did not converge") && said.contains("physics.timestep_s below 0.0005"),
        "{said}"
    );
    // And it is so after a snapshot too.
    let saved = world.save().expect("saved");
    let mut other = World::<8>::new(&world.scenario, 0.0, 0.0).expect("flat");
    other.restore(&saved).expect("its own");
    assert!(other.step(&torques, &mut seen).is_err());
}

#[test]
fn forces_on_bodies_gather_to_what_their_rows_make_of_them_one_by_one() {
    let tree = in_flight::<8>("chugo7", 500).tree;
    for symmetric in [true, false] {
        let mut bodies = vec![System::ZERO; tree.bodies];
        let (mut whole, mut expected) = (System::<8>::ZERO, System::<8>::ZERO);
        for (b, body) in bodies.iter_mut().enumerate() {
            body.symmetric = symmetric;
            let line = [0.3, -0.8, 0.5, 0.2, 0.7 - b as f64, -0.4];
            let works = if symmetric {
                line
            } else {
                [-0.6, 0.1, 0.9, b as f64, 0.3, 0.5]
            };
            body.add_force(2.0, &works, &line, 0.7);
            expected.add_force(2.0, &tree.row(b, &works), &tree.row(b, &line), 0.7);
        }
        whole.gather(&tree, &mut bodies);
        for i in 0..8 {
            // Sums of some ten products of size one.
            assert!((whole.right[i] - expected.right[i]).abs() < 1e-13, "{i}");
            for j in if symmetric { i } else { 0 }..8 {
                let off = whole.matrix[i][j] - expected.matrix[i][j];
                assert!(off.abs() < 1e-13, "{i}, {j}: {off}");
            }
        }
    }
}
