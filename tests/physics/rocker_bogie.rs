//! The rocker-bogie on a step, against the trigonometry of its links; and the differential between its rockers.
//! What every vehicle does on flat ground is in `other_vehicles.rs`.

use omni_core::BodyTwist;
use omni_sim::Simulation;
use omni_sim::config::{Override, Scenario};

use crate::engines::{load, on_both_engines};

const HEIGHT_M: f64 = 0.02;
const AT_M: f64 = 0.45;
/// Links of one side in the vehicle file \[m\], x and z: hinge of the bogie, wheels' axles. (Where
/// the rocker's own hinge is does not matter to the angles.)
const BOGIE: [f64; 2] = [-0.15, 0.08];
const AXLES: [[f64; 2]; 3] = [[0.30, 0.07], [0.0, 0.07], [-0.30, 0.07]];

fn scenario(ratio: f64) -> Scenario {
    let overrides = [
        Override::new("vehicle", "rocker_bogie6"),
        Override::new("physics.wheel_model", "ball"), // each roller would be a bump of its own
        Override::new("vehicle.coupling[0].ratio", ratio),
        Override::new("terrain.height_m", HEIGHT_M),
        Override::new("terrain.start_x_m", AT_M),
    ];
    load("step", &overrides).expect("valid")
}

fn on_a_step() -> Simulation {
    Simulation::new(&scenario(1.0)).expect("valid")
}

/// Drives along the world's x until so many wheels, sorted by what leads, are `past_m` behind the
/// riser; then stops for a while.
fn advance(simulation: &mut Simulation, wheels: usize, past_m: f64) {
    let mut periods = 0;
    loop {
        let mut x: Vec<_> = simulation
            .observation()
            .wheels
            .iter()
            .map(|w| w.centre_m[0])
            .collect();
        x.sort_by(|a, b| b.total_cmp(a));
        if x[wheels - 1] >= AT_M + past_m {
            break;
        }
        assert!(periods < 6000, "{wheels} wheels do not get up: {x:?}");
        periods += 1;
        let yaw = simulation.observation().pose.yaw_rad();
        let along = BodyTwist {
            vx_m_s: 0.2 * yaw.cos(),
            vy_m_s: -0.2 * yaw.sin(),
            wz_rad_s: 0.0,
        };
        simulation.step(&along).expect("finite");
    }
    rest(simulation, 1500);
}

/// Turns left by 0.3 rad on the spot.
fn turn(simulation: &mut Simulation) {
    while simulation.observation().pose.yaw_rad() < 0.3 {
        let left = BodyTwist {
            vx_m_s: 0.0,
            vy_m_s: 0.0,
            wz_rad_s: 0.4,
        };
        simulation.step(&left).expect("finite");
    }
}

fn rest(simulation: &mut Simulation, periods: usize) {
    for _ in 0..periods {
        simulation.step(&BodyTwist::ZERO).expect("finite");
    }
}

/// Nose-up pitches of rocker and bogie of one side whose wheels (front, middle, rear) stand so high \[rad\].
fn links(heights: [f64; 3]) -> (f64, f64) {
    let [front, middle, rear] = heights;
    // The bogie turns by what its wheels differ; its hinge is midway, a little above the line of the axles.
    let bogie = ((middle - rear) / (AXLES[1][0] - AXLES[2][0])).asin();
    let hinge = (middle + rear) / 2.0 + (BOGIE[1] - AXLES[1][1]) * (bogie.cos() - 1.0);
    // The rocker carries the front axle at (along, up) from the bogie's hinge: along sin + up cos =
    // rise, solved for the angle.
    let (along, up) = (AXLES[0][0] - BOGIE[0], AXLES[0][1] - BOGIE[1]);
    let rise = front - hinge + up;
    let rocker = (rise / along.hypot(up)).asin() - up.atan2(along);
    (rocker, bogie)
}

/// Hinge angles and the body's pitch against the links, for the wheels (left front to rear, right
/// front to rear) that are up.
fn assert_stance(simulation: &Simulation, up: [bool; 6]) {
    let seen = simulation.observation();
    // The file's order is front left, front right, middle left, ...
    for (side, wheels) in [[0, 2, 4], [1, 3, 5]].into_iter().enumerate() {
        for (k, wheel) in wheels.into_iter().enumerate() {
            let expected = 0.07 + if up[3 * side + k] { HEIGHT_M } else { 0.0 };
            let axle = seen.wheels[wheel].centre_m[2];
            // Contacts of 200 Hz give by less than 0.1 mm.
            assert!(
                (axle - expected).abs() < 2e-4,
                "wheel {wheel}: axle at {axle} m, {up:?}"
            );
        }
    }
    let height = |wheel: usize| if up[wheel] { HEIGHT_M } else { 0.0 };
    let (left, left_bogie) = links([0, 1, 2].map(height));
    let (right, right_bogie) = links([3, 4, 5].map(height));
    let body = (left + right) / 2.0;
    let angles: Vec<_> = seen.hinges.iter().map(|hinge| hinge.angle_rad).collect();
    // Hinges turn about y: positive is the child's nose down. Order of the file: rockers, bogies, left first.
    let expected = [body - left, body - right, left - left_bogie, right - right_bogie];
    for (hinge, (angle, expected)) in angles.iter().zip(expected).enumerate() {
        // Contacts that give by up to 0.1 mm over 0.3 m, and half of what the differential's spring gives: 0.5 mrad.
        assert!(
            (angle - expected).abs() < 5e-4,
            "hinge {hinge}, {up:?}: {angle} rad, the links say {expected}"
        );
    }
    let pitch = seen.body_nose_up_rad[0];
    assert!(
        (pitch - body).abs() < 5e-4,
        "{up:?}: the body's pitch is {pitch} rad, the mean of the rockers' {body}"
    );
}

fn hinges_on_a_step_crossed_straight_stand_as_the_links_say() {
    let mut simulation = on_a_step();
    rest(&mut simulation, 500);
    assert_stance(&simulation, [false; 6]);
    advance(&mut simulation, 2, 0.10);
    assert_stance(&simulation, [true, false, false, true, false, false]);
    advance(&mut simulation, 4, 0.10);
    assert_stance(&simulation, [true, true, false, true, true, false]);
    advance(&mut simulation, 6, 0.10);
    assert_stance(&simulation, [true; 6]);
}

fn hinges_on_a_step_crossed_askew_stand_as_the_links_say_one_wheel_after_the_other() {
    // Turned left by 0.3 rad the right front wheel leads, and the others follow 13 to 16 cm apart.
    let mut simulation = on_a_step();
    turn(&mut simulation);
    let mut up = [false; 6]; // left front to rear, right front to rear
    for (wheels, next) in [3, 0, 4, 1, 5].into_iter().enumerate() {
        up[next] = true;
        advance(&mut simulation, wheels + 1, 0.04);
        assert_stance(&simulation, up);
    }
}

fn differential_carries_the_bodys_moment_and_gives_by_what_its_spring_says() {
    let mut simulation = on_a_step();
    let off = |simulation: &Simulation| {
        let hinges = &simulation.observation().hinges;
        hinges[0].angle_rad + hinges[1].angle_rad
    };
    rest(&mut simulation, 2000);
    // The body's centre of mass, 8 kg, is 2 cm ahead of its hinges. Each rocker takes half of that moment.
    let scenario = scenario(1.0);
    let vehicle = scenario.vehicle();
    let spring = vehicle.coupling_spring(&vehicle.coupling[0]);
    let expected = -8.0 * 9.81 * 0.02 / 2.0 / spring.stiffness_n_m_rad; // the body's nose goes down, so the rockers' up
    let at_rest = off(&simulation);
    assert!(
        (at_rest / expected - 1.0).abs() < 0.02,
        "{at_rest} rad, {expected}"
    );
    // Over the step, wheels bump against the riser: the angles' sum stays within a third of a degree.
    let mut most = 0.0_f64;
    while simulation.observation().pose.position_m[0] < AT_M + 0.35 {
        let ahead = BodyTwist {
            vx_m_s: 0.3,
            vy_m_s: 0.0,
            wz_rad_s: 0.0,
        };
        simulation.step(&ahead).expect("finite");
        most = most.max(off(&simulation).abs());
    }
    assert!(most < 6e-3, "{most} rad");
}

fn ratio_of_two_makes_the_second_rocker_count_twice() {
    let mut simulation = Simulation::new(&scenario(2.0)).expect("valid");
    turn(&mut simulation);
    advance(&mut simulation, 1, 0.04);
    // Only the right front wheel is up. a + 2 b = 0 with a = body - left, b = body - right.
    let (level, right) = (links([0.0; 3]).0, links([HEIGHT_M, 0.0, 0.0]).0);
    let expected = (level + 2.0 * right) / 3.0;
    let pitch = simulation.observation().body_nose_up_rad[0];
    assert!((pitch - expected).abs() < 5e-4, "{pitch} rad, {expected}"); // as in `assert_stance`
}

on_both_engines! {
    hinges_on_a_step_crossed_straight_stand_as_the_links_say,
    hinges_on_a_step_crossed_askew_stand_as_the_links_say_one_wheel_after_the_other,
    differential_carries_the_bodys_moment_and_gives_by_what_its_spring_says,
    ratio_of_two_makes_the_second_rocker_count_twice,
}
