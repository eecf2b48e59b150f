//! The estimator of `omni-core` on the plant: is it off by as much as it says, and less than the wheels alone are?
//!
//! Errors are those of the pose in the plane, which is what the filter models, against the
//! simulation's own. Settings were found on seeds below 200.

use omni_core::estimate::{
    Estimator, EstimatorConfig, EstimatorInput, EstimatorState, Odometry, OdometryState, PoseCovariance,
};
use omni_core::geometry::PlanarPose;
use omni_core::{BodyTwist, Kinematics, Real};
use omni_sim::Simulation;
use omni_sim::config::{Override, Scenario};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;

use crate::pose_errors::{nees, normal};

const SEEDS: u64 = 24;
/// Ends of the middle 95 % of a chi-square of 72, three numbers a pose and 24 poses, over 72: of the mean over a drive.
const BAND: [f64; 2] = [0.70, 1.352];
/// Of the middle 99.9 %: of every tenth of a second of eight drives.
const AT_WORST: [f64; 2] = [0.541, 1.640];
/// The middle 95 % of the innovations of 24 vehicles with seven wheels, and with four, in one period:
/// chi-squares of 168 and of 96 over their number. Of a mean over a drive it is the band if one
/// period's innovations were those of all others, which is the most that they can have in common: were
/// they independent it would be fifty times narrower. Slip makes them common for parts of a second.
const SEVEN: [f64; 2] = [0.797, 1.225];
const FOUR: [f64; 2] = [0.737, 1.303];
/// The middle 95 % of a chi-square of 24 over 24: of what the bias is off by at the end, which all
/// of a drive has in common.
const OF_BIAS: [f64; 2] = [0.517, 1.640];
/// Known this well at the start \[m, rad\].
const START: f64 = 2e-3;

/// The inertial measurement unit.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Unit {
    /// Its accelerometer has noise and no bias, as the filter is configured.
    Calibrated,
    /// The accelerometer also has a bias, and the attitude that levels it wanders by 1 mrad per root of s. The
    /// filter has its usual settings.
    AsBought,
}

use Unit::{AsBought, Calibrated};

impl Unit {
    /// Factor on the lower ends of the bands. A bias counts with three of its deviations, so that no such bias is ever
    /// taken for slip: where it is unknown the filter promises less than it does, down to two thirds.
    fn surer(self) -> f64 {
        match self {
            Calibrated => 1.0,
            AsBought => 2.0 / 3.0,
        }
    }
}

/// One and a half seconds of rest, the last half of which is held, then as fast as commanded at once, a stop, and
/// sideways in a turn: wheels
/// slip on every start.
fn excitation(t: f64) -> [f64; 3] {
    match t {
        t if t < 1.5 => [0.0; 3],
        t if t < 3.0 => [0.6, 0.0, 0.0],
        t if t < 3.5 => [0.0; 3],
        t if t < 4.5 => [0.2, 0.3, 0.5],
        _ => [0.0; 3],
    }
}

/// As much rest, then 0.3 m/s ahead.
fn across(t: f64) -> [f64; 3] {
    [0.3 * ((t - 1.5) / 0.3).clamp(0.0, 1.0), 0.0, 0.0]
}

struct Drive {
    scenario: &'static str,
    keys: &'static [&'static str],
    command: fn(f64) -> [f64; 3],
    duration_s: f64,
    /// Factor on the upper ends of the bands with the unit as bought, too weak to tell what wheels hide: that their way
    /// across bumps is longer than the vehicle's, by 24 mm, or that they spin.
    hidden: f64,
}

const LEFT_ICE: &str = "friction_patch=[{ x_m = [-0.5, 1.0], y_m = [0.0, 5.0], friction = 0.05 }]";
const ALL_ICE: &str = "friction_patch=[{ x_m = [-0.5, 1.0], y_m = [-5.0, 5.0], friction = 0.05 }]";
const FLAT: Drive = Drive {
    scenario: "flat",
    keys: &[],
    command: excitation,
    duration_s: 5.0,
    hidden: 1.0,
};
const HALF_ON_ICE: Drive = Drive {
    scenario: "ice",
    keys: &[LEFT_ICE],
    command: excitation,
    duration_s: 5.0,
    hidden: 2.0,
};
const ON_ICE: Drive = Drive {
    scenario: "ice",
    keys: &[ALL_ICE],
    command: excitation,
    duration_s: 5.0,
    hidden: 2.0,
};
const BUMPS: Drive = Drive {
    scenario: "bumps",
    keys: &[],
    command: across,
    duration_s: 7.0,
    hidden: 2.0,
};
const STEP: Drive = Drive {
    scenario: "step",
    keys: &[],
    command: across,
    duration_s: 7.0,
    hidden: 1.0,
};

/// What came of a drive with one seed.
struct Came {
    /// Normalised squared error of the pose, three degrees of freedom, ten times a second.
    nees: Vec<f64>,
    /// Normalised squared innovations over their number, from start to end.
    nis: f64,
    /// Error of the place at the end \[m\].
    error_m: f64,
    /// That of odometry.
    odometry_m: f64,
    bias_rad_s: [f64; 2],
}

fn drive<R: Real, const N: usize>(drive: &Drive, unit: Unit, vehicle: &str, seed: u64) -> Came {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let bias = 0.02 * normal(&mut rng);
    let mut keys: Vec<_> = [
        "physics.engine=articulated",
        "control.policy=independent",
        "sensors.encoder_noise_rad_s=0.1",
        "sensors.gyro_noise_rad_s=0.01",
        "sensors.accelerometer_noise_m_s2=0.05",
        "perturbation.yaw_rad=0.05",
        "perturbation.start_m=0.05",
    ]
    .iter()
    .chain(drive.keys)
    .map(|key| Override::parse(key).expect("KEY=VALUE"))
    .collect();
    keys.push(Override::new("vehicle", vehicle));
    keys.push(Override::new("seed", seed as i64));
    keys.push(Override::new("sensors.gyro_bias_rad_s", bias));
    let mut config = EstimatorConfig::new(R::of(1e-3));
    match unit {
        Calibrated => {
            config.accelerometer_bias_m_s2 = R::of(1e-4);
            config.accelerometer_bias_walk_m_s2_per_sqrt_s = R::of(1e-4);
        }
        AsBought => {
            let bias = 0.05 * normal(&mut rng);
            keys.push(Override::new("sensors.accelerometer_bias_m_s2", bias));
            keys.push(Override::new("sensors.attitude_walk_rad_per_sqrt_s", 1e-3));
        }
    }
    let scenario = Scenario::load(drive.scenario, &keys).expect("valid");
    assert_eq!(scenario.period_s(), 1e-3);
    let kinematics =
        Kinematics::<R, N>::new(&scenario.vehicle().layout().expect("as many wheels")).expect("sound");
    let estimator = Estimator::new(config, &kinematics).expect("valid");
    let odometry = Odometry::<R, N>::new(R::of(scenario.period_s())).expect("valid");
    let mut simulation = Simulation::new(&scenario).expect("valid");
    let pose = &simulation.observation().pose;
    let truth = [pose.position_m[0], pose.position_m[1], pose.yaw_rad()];
    let [x_m, y_m, yaw_rad] = truth.map(|t| R::of(t + START * normal(&mut rng)));
    let known = PoseCovariance::diagonal([R::of(START * START); 3]).expect("valid");
    let mut state = estimator.start();
    assert!(state.reset(&PlanarPose { x_m, y_m, yaw_rad }, &known));
    let mut other = OdometryState::new();
    assert!(other.reset(&PlanarPose { x_m, y_m, yaw_rad }));
    let (mut came, mut innovations) = (Vec::new(), (0.0, 0));
    let of = |state: &EstimatorState<R, N>| {
        let PlanarPose { x_m, y_m, yaw_rad } = state.pose();
        [x_m, y_m, yaw_rad].map(Real::as_f64)
    };
    let mut error = [0.0; 3];
    let mut truth = truth;
    for k in 0..(drive.duration_s / scenario.period_s()).round() as usize {
        let [vx_m_s, vy_m_s, wz_rad_s] = (drive.command)(k as f64 * scenario.period_s());
        let command = BodyTwist {
            vx_m_s,
            vy_m_s,
            wz_rad_s,
        };
        simulation.step(&command).expect("goes on");
        let sensed = simulation.sensed();
        let wheels: [f64; N] = sensed.wheels_rad_s.as_slice().try_into().expect("as many wheels");
        let input = EstimatorInput::with_imu(&wheels.into(), &sensed.imu, &command);
        let mut single = EstimatorInput::new(&wheels.map(R::of).into());
        single.yaw_rate_rad_s = R::of(input.yaw_rate_rad_s);
        single.acceleration_m_s2 = input.acceleration_m_s2.map(R::of);
        single.commanded_rest = input.commanded_rest;
        let step = estimator.step(&mut state, &single);
        odometry.step_velocities(&mut other, &kinematics, &single.wheels);
        assert!(step.taken);
        innovations.0 += step.nis.as_f64();
        innovations.1 += step.readings;
        let pose = &simulation.observation().pose;
        truth = [pose.position_m[0], pose.position_m[1], pose.yaw_rad()];
        let here = of(&state);
        error = [
            truth[0] - here[0],
            truth[1] - here[1],
            (truth[2] - here[2]).wrapped_angle(),
        ];
        if k % 100 == 99 {
            came.push(nees(
                state.covariance().matrix().map(|row| row.map(Real::as_f64)),
                error,
            ));
        }
    }
    let there = other.pose();
    Came {
        nees: came,
        nis: innovations.0 / f64::from(innovations.1 as u32),
        error_m: error[0].hypot(error[1]),
        odometry_m: (truth[0] - there.x_m.as_f64()).hypot(truth[1] - there.y_m.as_f64()),
        bias_rad_s: [
            state.gyro_bias_rad_s().as_f64() - bias,
            state.gyro_bias_deviation_rad_s().as_f64(),
        ],
    }
}

/// Every seed of a drive; `nis` is what the innovations have to keep to.
#[expect(
    clippy::print_stdout,
    reason = "the rows of docs/estimate.md, with --nocapture"
)]
fn judged<R: Real, const N: usize>(
    name: &str,
    way: &Drive,
    unit: Unit,
    vehicle: &str,
    nis: [f64; 2],
) -> [f64; 2] {
    // Others than those that the settings were found on.
    let came: Vec<_> = (200..200 + SEEDS)
        .map(|seed| drive::<R, N>(way, unit, vehicle, seed))
        .collect();
    let count = SEEDS as f64;
    let instants: Vec<_> = (0..came[0].nees.len())
        .map(|at| came.iter().map(|c| c.nees[at]).sum::<f64>() / 3.0 / count)
        .collect();
    let mean = instants.iter().sum::<f64>() / instants.len() as f64;
    let innovations = came.iter().map(|c| c.nis).sum::<f64>() / count;
    let of_bias = |k: usize| (came.iter().map(|c| c.bias_rad_s[k].powi(2)).sum::<f64>() / count).sqrt();
    let (bias, said) = (of_bias(0), of_bias(1));
    let by_said = came
        .iter()
        .map(|c| (c.bias_rad_s[0] / c.bias_rad_s[1]).powi(2))
        .sum::<f64>()
        / count;
    let [error, odometry] = [0, 1].map(|k| {
        let of = |c: &Came| [c.error_m, c.odometry_m][k].powi(2);
        (came.iter().map(of).sum::<f64>() / count).sqrt()
    });
    let least = instants.iter().copied().fold(f64::INFINITY, f64::min);
    let most = instants.iter().copied().fold(0.0, f64::max);
    println!(
        "{vehicle} {name} {unit:?}: NEES {mean:.2}, {least:.2} to {most:.2}; NIS {innovations:.2}; bias {bias:.5}, said {said:.5} rad/s, NEES {by_said:.2}; place off by {error:.4} m, \
         odometry {odometry:.4} m"
    );
    let surer = unit.surer();
    let hidden = if unit == AsBought { way.hidden } else { 1.0 };
    assert!(
        (surer * BAND[0]..hidden * BAND[1]).contains(&mean),
        "{name} {unit:?}: NEES {mean}"
    );
    assert!(
        surer * AT_WORST[0] < least && most < hidden * AT_WORST[1],
        "{name} {unit:?}: NEES {instants:.2?}"
    );
    assert!(
        (surer * nis[0]..nis[1]).contains(&innovations),
        "{name} {unit:?}: NIS {innovations}"
    );
    // Half a second of rest teaches it to a twentieth of the 0.02 rad/s of the start, and it is off
    // by as much as it says.
    assert!(bias < 1e-3, "{name}: bias {bias}");
    assert!(
        (OF_BIAS[0]..OF_BIAS[1]).contains(&by_said),
        "{name}: NEES of the bias {by_said}"
    );
    [error, odometry]
}

#[test]
fn it_is_off_by_as_much_as_it_says_on_flat_ground() {
    for unit in [Calibrated, AsBought] {
        judged::<f64, 7>("flat", &FLAT, unit, "chugo7", SEVEN);
        judged::<f32, 4>("flat", &FLAT, unit, "mecanum4", FOUR);
    }
}

#[test]
fn it_is_off_by_as_much_as_it_says_on_bumps_and_on_the_step() {
    for (unit, bumps, step) in [(Calibrated, 0.7, 0.3), (AsBought, 2.0, 0.3)] {
        let [error, odometry] = judged::<f64, 7>("bumps", &BUMPS, unit, "chugo7", SEVEN);
        assert!(error < bumps * odometry, "{error} {odometry}");
        let [error, odometry] = judged::<f32, 7>("step", &STEP, unit, "chugo7", SEVEN);
        assert!(error < step * odometry, "{error} {odometry}");
    }
}

#[test]
fn on_ice_it_is_off_by_as_much_as_it_says_and_by_far_less_than_odometry() {
    for (unit, most) in [(Calibrated, 0.1), (AsBought, 0.4)] {
        for way in [("ice under the left wheels", &HALF_ON_ICE), ("ice", &ON_ICE)] {
            let seven = judged::<f64, 7>(way.0, way.1, unit, "chugo7", SEVEN);
            let four = judged::<f32, 4>(way.0, way.1, unit, "mecanum4", FOUR);
            for [error, odometry] in [seven, four] {
                assert!(error < most * odometry, "{} {unit:?}: {error} {odometry}", way.0);
            }
        }
    }
}
